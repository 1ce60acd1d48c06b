"""Extreme loads with contemporaneous loads, and their characteristic values.

The table of a point has 14 rows: each of the six components at its largest and smallest value, and the two transverse
resultants at their largest; every row holds all loads of that instant. Equations L-11 to L-15 of
``docs/theory/design-loads.md``; form of the table: IEC 61400-1, annex I (of edition 4), after secondary sources.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan2
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.extras import need
from meltemi.postprocess.inputs import floats, one_row, positive

if TYPE_CHECKING:
    import pandas as pd

Float = NDArray[np.float64]
Rule = Literal["largest", "mean", "upper_half"]

COMPONENTS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
DRIVERS = (*(f"{name} {end}" for name in COMPONENTS for end in ("max", "min")), "F_res max", "M_res max")
"""Rows of the table."""
TRANSVERSE: dict[str, tuple[int, int]] = {"xy": (0, 1), "yz": (1, 2), "xz": (0, 2)}
"""Places of the transverse axes: x and y for blades and towers, y and z for shafts and hubs."""
RULES = ("largest", "mean", "upper_half")


@dataclass(frozen=True)
class ExtremeRow:
    """Loads at the instant at which one of them is extreme.

    Attributes:
      driver: name of that extreme: "Fx max", "M_res max"; see ``DRIVERS``.
      loads: Fx, Fy, Fz [N], Mx, My, Mz [N m], contemporaneous.
      plane: transverse axes of the resultants: "xy", "yz" or "xz".
      case: load case and seed, in words.
      factor: partial safety factor for loads.
      factored: the loads contain the factor.
      scale: ratio of the characteristic value to the driver's value in the run that the row comes from; 1 without mean.
    """

    driver: str
    loads: tuple[float, ...]
    plane: str
    case: str
    factor: float
    factored: bool = False
    scale: float = 1.0

    @property
    def force(self) -> float:
        """Transverse force [N]."""
        return _resultants(np.array(self.loads), self.plane)[0].item()

    @property
    def moment(self) -> float:
        """Transverse moment [N m]."""
        return _resultants(np.array(self.loads), self.plane)[1].item()

    @property
    def force_angle(self) -> float:
        """[rad] direction of the transverse force, from the first to the second transverse axis."""
        i, j = TRANSVERSE[self.plane]
        return atan2(self.loads[j], self.loads[i])

    @property
    def moment_angle(self) -> float:
        """[rad] direction of the transverse moment, from the first to the second transverse axis."""
        i, j = TRANSVERSE[self.plane]
        return atan2(self.loads[3 + j], self.loads[3 + i])

    @property
    def value(self) -> float:
        """Value of the driver."""
        return driver_values(np.array(self.loads), self.plane)[DRIVERS.index(self.driver)].item()

    @property
    def severity(self) -> float:
        """The driver's value with the factor, positive in the direction of the extreme."""
        sign = -1.0 if self.driver.endswith("min") else 1.0
        return sign * self.value * (1.0 if self.factored else self.factor)


def extreme_loads(loads: ArrayLike, plane: str) -> tuple[Float, NDArray[np.intp]]:
    """Contemporaneous loads of the 14 extremes of a run.

    Args:
      loads: (T, 6) Fx, Fy, Fz [N], Mx, My, Mz [N m].
      plane: transverse axes: "xy" for blades and towers, "yz" for shafts and hubs.

    Returns:
      (14, 6) loads at the extremes in the order of ``DRIVERS``, and (14,) their places in the series.

    Raises:
      InputError: the shape is another one, values are not finite, or there is no such plane.
    """
    x = floats(loads, "extreme_loads: loads")
    if x.ndim != 2 or x.shape[1] != 6 or not len(x) or not np.all(np.isfinite(x)):
        raise InputError(f"extreme_loads: loads must be (T, 6) finite numbers, found shape {x.shape}")
    resultants = np.stack(_resultants(x, _plane(plane)), axis=1)
    at = np.empty(len(DRIVERS), dtype=np.intp)
    at[0:12:2], at[1:12:2], at[12:] = x.argmax(axis=0), x.argmin(axis=0), resultants.argmax(axis=0)
    return x[at], at


def characteristic_value(extremes: ArrayLike, *, rule: Rule, speeds: ArrayLike | None = None) -> tuple[float, int]:
    """Characteristic value of the extremes of the runs of a load case (L-12 to L-14).

    Args:
      extremes: (R,) largest values of the runs; negated smallest ones for the other end.
      rule: "largest" of all runs; "mean" of the runs' extremes at each speed, the largest over speeds; "upper_half":
        mean of the larger half of the runs' extremes at each speed, the largest over speeds. Of an odd number of runs
        the half is the smaller one, of a single run the run.
      speeds: (R,) groups of runs for the means, such as [m/s]; a single group by default.

    Returns:
      the value, and the place of the run of that speed whose extreme is nearest to it.

    Raises:
      InputError: there are no runs, shapes do not fit, values are not finite, or there is no such rule.
    """
    x = one_row(extremes, "characteristic_value: extremes")
    v = np.zeros(len(x)) if speeds is None else floats(speeds, "characteristic_value: speeds")
    if x.ndim != 1 or v.shape != x.shape or not len(x) or not np.all(np.isfinite(x)):
        raise InputError(f"characteristic_value: finite extremes (R,) need speeds (R,), found {x.shape} and {v.shape}")
    if rule not in RULES:
        raise InputError(f"characteristic_value: no rule {rule!r}: {did_you_mean(rule, RULES)}")
    candidates = []
    for speed in np.unique(v):
        runs = np.flatnonzero(v == speed)
        ordered = np.sort(x[runs])
        kept = {"largest": ordered[-1:], "mean": ordered, "upper_half": ordered[-max(len(runs) // 2, 1) :]}[rule]
        value = float(kept.mean())
        candidates.append((value, int(runs[np.argmin(np.abs(x[runs] - value))])))
    return max(candidates, key=lambda pair: pair[0])


def characteristic_rows(
    extremes: ArrayLike, plane: str, cases: Sequence[str], *, rule: Rule, factor: float, speeds: ArrayLike | None = None
) -> tuple[ExtremeRow, ...]:
    """Characteristic loads of the runs of a load case, for each of the 14 extremes.

    Args:
      extremes: (R, 14, 6) extremes of R runs, from ``extreme_loads``.
      plane: transverse axes.
      cases: (R,) names of the runs.
      rule: see ``characteristic_value``.
      factor: partial safety factor for loads; the loads of the rows do not contain it.
      speeds: (R,) groups of runs for the means, such as [m/s]; a single group by default.

    Returns:
      14 rows. Where the value is a mean, the row is that of the run whose extreme is nearest to it, all its loads in
      the ratio of the two; no ratio is applied if they differ in sign.

    Raises:
      InputError: shapes do not fit, there is no such rule or plane, or ``factor`` is not positive.
    """
    x, names = floats(extremes, "characteristic_rows: extremes"), list(cases)
    if x.shape != (len(names), len(DRIVERS), 6):
        raise InputError(f"characteristic_rows: {len(names)} runs need extremes (R, 14, 6), found shape {x.shape}")
    positive(factor, "characteristic_rows: factor")
    rows = []
    for k, driver in enumerate(DRIVERS):
        sign = -1.0 if driver.endswith("min") else 1.0
        values = sign * driver_values(x[:, k], _plane(plane))[:, k]
        value, run = characteristic_value(values, rule=rule, speeds=speeds)
        ratio = value / values[run] if values[run] * value > 0.0 else 1.0
        loads = tuple((ratio * x[run, k]).tolist())
        rows.append(ExtremeRow(driver, loads, plane, names[run], factor, scale=float(ratio)))
    return tuple(rows)


def governing_rows(tables: Sequence[Sequence[ExtremeRow]]) -> tuple[ExtremeRow, ...]:
    """Rows of the load cases whose loads with their factors are most severe, for each of the 14 extremes.

    Args:
      tables: rows of each load case, from ``characteristic_rows``.

    Raises:
      InputError: there are none, a table lacks a row, or loads with and without factor meet.
    """
    if not tables or any(tuple(row.driver for row in table) != DRIVERS for table in tables):
        raise InputError("governing_rows: each table must have the 14 rows")
    if len({(row.factored, row.plane) for table in tables for row in table}) > 1:
        raise InputError("governing_rows: loads with and without factor, or of other planes, cannot be compared")
    return tuple(max(rows, key=lambda row: row.severity) for rows in zip(*tables, strict=True))


def factored_rows(rows: Sequence[ExtremeRow], *, favourable: float | None = None) -> tuple[ExtremeRow, ...]:
    """Design loads: rows with their loads times the factor.

    Args:
      rows: without factor.
      favourable: factor of extremes that relieve, whose value has the sign of the other extreme, such as the largest
        Fz of a tower that is always in compression; 0.9 in IEC 61400-1. By default the factor of the others.

    Raises:
      InputError: a row contains the factor already.
    """
    design = []
    for row in rows:
        if row.factored:
            raise InputError(f"factored_rows: {row.driver} contains the factor {row.factor:g} already")
        factor = row.factor if favourable is None or row.severity >= 0.0 else favourable
        loads = tuple(factor * x for x in row.loads)
        design.append(replace(row, loads=loads, factor=factor, factored=True))
    return tuple(design)


def extremes_table(rows: Sequence[ExtremeRow]) -> pd.DataFrame:
    """Rows as a table: one line each, named by its driver.

    Returns:
      columns Fx to Mz, F_res and M_res [N, N m], their angles [rad], "case", "factor", "factored" and "scale".

    Raises:
      MissingPackageError: pandas is not installed.
    """
    need("extremes_table", "pandas")
    import pandas as pd

    lines = [
        {
            **dict(zip(COMPONENTS, row.loads, strict=True)),
            "F_res": row.force,
            "F_res angle": row.force_angle,
            "M_res": row.moment,
            "M_res angle": row.moment_angle,
            "case": row.case,
            "factor": row.factor,
            "factored": row.factored,
            "scale": row.scale,
        }
        for row in rows
    ]
    return pd.DataFrame(lines, index=pd.Index([row.driver for row in rows], name="driver"))


def _plane(plane: str) -> str:
    if not isinstance(plane, str) or plane not in TRANSVERSE:
        raise InputError(f"extreme loads: no plane {plane!r}: {did_you_mean(str(plane), TRANSVERSE)}")
    return plane


def _resultants(loads: Float, plane: str) -> tuple[Float, Float]:
    """Transverse force and moment of (..., 6) loads."""
    i, j = TRANSVERSE[plane]
    return np.hypot(loads[..., i], loads[..., j]), np.hypot(loads[..., 3 + i], loads[..., 3 + j])


def driver_values(loads: Float, plane: str) -> Float:
    """(..., 14) values of all drivers in (..., 6) loads."""
    return np.concatenate([np.repeat(loads, 2, axis=-1), np.stack(_resultants(loads, plane), axis=-1)], axis=-1)
