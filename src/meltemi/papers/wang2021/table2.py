"""Table 2: each bin simulated with its mean speed and intensity, then binned like the measurements.

The rotor is scaled from another, so it is reported twice: as scaled, and with an aerodynamic penalty of two
parameters, of chord and of drag, fitted to power and flapwise moment of bins 5 to 7. The other bins validate it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.papers.wang2021.winds import SHEAR, MeasuredBin, bin_wind, measured
from meltemi.postprocess.bins import EDGES, bin_statistics, result_statistics
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.trim import operating_point
from meltemi.tuning.run_store import FailedResult, FailedResultError, attempt, cells, survivors
from meltemi.turbine.definition import Turbine
from meltemi.wind.fields import SteadyWind

if TYPE_CHECKING:
    import pandas as pd

Float = NDArray[np.float64]
TRANSIENT = 100.0
"""[s] initial transient, by default."""
SPEED, POWER, MOMENT = "wind_x", "generator_power", "root_moment_flap_1"
CHANNELS = (SPEED, POWER, MOMENT, "rotor_speed", "pitch_1")
FITTED = (5, 6, 7)
"""Bins that the calibration sees."""
ROUNDS, FIRST, STEPS = 3, (0.75, 0.01), (-0.1, 0.01)
"""Gauss-Newton steps of the calibration; chord and drag at its start; their differences for the derivatives."""


@dataclass(frozen=True)
class Calibration:
    """Aerodynamic penalty that fits the blade of the scaled turbine to the measurements.

    Attributes:
      chord: factor of the chord, which reduces lift and drag.
      drag: increment of the drag coefficient of all polars.
      errors: half-widths of the 95 % intervals of both, from the scatter of the bins about the fit.
    """

    chord: float = 1.0
    drag: float = 0.0
    errors: tuple[float, float] = (np.nan, np.nan)

    def turbine(self, reference: Turbine) -> Turbine:
        """The turbine with the penalty; its structure and control are unchanged."""
        polars = {f"airfoils.{name}.drag": polar.drag + self.drag for name, polar in reference.airfoils.items()}
        chord = reference.blade.aerodynamics.chord * self.chord
        return reference.replace(**{"blade.aerodynamics.chord": chord}, **polars)


@dataclass(frozen=True)
class Table2:
    """Simulated Table 2.

    Attributes:
      calibration: calibration of the turbine.
      bins: statistics of the completed runs from ``bin_statistics``, SI units.
      runs: statistics of these runs, one row each.
      lost: bins without a completed run, and why.
    """

    calibration: Calibration
    bins: pd.DataFrame = field(repr=False)
    runs: pd.DataFrame = field(repr=False)
    lost: Mapping[int, str] = field(default_factory=dict)

    def whole(self) -> Table2:
        """The table; raises an error if bins are missing.

        Raises:
          FailedResultError: a bin has no completed run.
        """
        for why in self.lost.values():
            raise FailedResultError(why)
        return self

    def column(self, name: str, of: str) -> Float:
        """(18,) column of the measured bins, in kW and kNm."""
        return np.asarray(self.bins[name, of].to_numpy()[: len(measured())] * 1e-3)

    def scatter(self, name: str, of: str) -> Float:
        """(18,) two standard errors of such a column over the seeds; zero for a single run."""
        deviations = []
        for row in measured():
            inside = self.runs[self.runs[SPEED, "mean"].between(row.begin, row.end, inclusive="left")]
            deviations.append(2e-3 * float(inside[name, of].sem()) if len(inside) > 1 else 0.0)
        return np.array(deviations)


def simulate_bins(
    turbine: Turbine,
    calibration: Calibration,
    rows: Sequence[MeasuredBin],
    seeds: Sequence[int],
    *,
    period: float = 600.0,
    transient: float = TRANSIENT,
    workers: int | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Table2:
    """Simulate bins and bin the results.

    Raises:
      FailedResultError: no run reached its end.
    """
    import pandas as pd

    model = build(calibration.turbine(turbine))
    winds = {row.bin: SteadyWind(speed=row.speed, shear_exponent=SHEAR) for row in rows}
    # one per bin, not one per seed
    starts = {k: attempt(f"steady operation, bin {k}", operating_point, model, wind) for k, wind in winds.items()}
    cases = [
        Run(
            model=model,
            wind=bin_wind(row, seed),
            duration=transient + period,
            channels=CHANNELS,
            start=starts[row.bin],
            name=f"bin {row.bin}, seed {seed}",
        )
        for row in reversed(rows)  # runs in high wind, which take longest, first
        for seed in seeds
    ]

    def statistics(result: Result) -> pd.DataFrame:
        return result_statistics(result, CHANNELS, begin=transient)

    results = cells(cases, reduce=statistics, workers=workers, progress=progress)
    n = len(seeds)
    whole = {row.bin: results[i * n : (i + 1) * n] for i, row in enumerate(reversed(rows))}
    lost = {k: of[0].why for k, of in whole.items() if all(isinstance(each, FailedResult) for each in of)}
    runs = pd.concat(survivors(results))
    return Table2(calibration, bin_statistics(runs, SPEED, edges=EDGES), runs, lost)


SPEED_LOOPS = (1.0, 1.3, 1.6, 2.0)
"""Tried frequencies of the speed loop over the usual one, that of the NREL 5 MW by the rated rotor speeds."""
LOOP_BINS = (12, 14, 16, 18)
"""Bins by whose std of power it is chosen."""


@dataclass(frozen=True)
class SpeedLoop:
    """Choice of the speed loop.

    Attributes:
      power_std: (bins,) [kW] standard deviation of power, by tried factor.
    """

    power_std: Mapping[float, Float]

    @property
    def target(self) -> Float:
        """(bins,) [kW] measured standard deviation of power."""
        return np.array([row.power_std for row in measured() if row.bin in LOOP_BINS])

    def off(self, factor: float) -> float:
        """Root mean square [kW] of the differences from the measured standard deviation, over bins with wind."""
        return float(np.sqrt(np.nanmean((self.power_std[factor] - self.target) ** 2)))

    @property
    def chosen(self) -> float:
        """The factor with the smallest difference."""
        return min(self.power_std, key=self.off)


def choose_speed_loop(
    make: Callable[[float], Turbine],
    seeds: Sequence[int],
    *,
    period: float = 600.0,
    transient: float = TRANSIENT,
    workers: int | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> SpeedLoop:
    """Simulate the bins with each tried factor; ``make`` creates the turbine with it."""
    rows = [row for row in measured() if row.bin in LOOP_BINS]
    power_std = {}
    for i, factor in enumerate(SPEED_LOOPS):
        bins = simulate_bins(
            make(factor),
            Calibration(),
            rows,
            seeds,
            period=period,
            transient=transient,
            workers=workers,
            progress=lambda share, i=i: progress((i + share) / len(SPEED_LOOPS)),  # type: ignore[misc]
        ).whole()
        power_std[factor] = bins.column(POWER, "std")[[row.bin - 1 for row in rows]]
    return SpeedLoop(power_std)


def calibrate(
    turbine: Turbine,
    seeds: Sequence[int],
    *,
    period: float = 600.0,
    transient: float = TRANSIENT,
    workers: int | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Calibration:
    """Aerodynamic penalty that fits the measured power and moment of bins 5 to 7 by least squares of the logarithms.

    Gauss-Newton steps with the derivatives of the first step. The intervals are Student's, from the residuals.

    Raises:
      FailedResultError: no run had the mean wind of one of the bins.
    """
    from scipy.stats import t as student

    rows, at = [row for row in measured() if row.bin in FITTED], [k - 1 for k in FITTED]
    target = np.log([r.power_mean for r in rows] + [r.moment_mean for r in rows])
    parameters = np.array(FIRST)

    def lacks(done: int, x: Float) -> Float:
        bins = simulate_bins(
            turbine,
            Calibration(*x),
            rows,
            seeds,
            period=period,
            transient=transient,
            workers=workers,
            progress=lambda share: progress((done + share) / (len(x) + ROUNDS)),
        ).whole()
        means = np.concatenate([bins.column(name, "mean")[at] for name in (POWER, MOMENT)])
        if not np.all(np.isfinite(means)):
            raise FailedResultError(f"calibration: bins {FITTED}: no run had the mean wind of one: simulate longer")
        return target - np.log(means)

    rest = lacks(0, parameters)
    slopes = np.stack([(rest - lacks(1 + i, parameters + d)) / d[i] for i, d in enumerate(np.diag(STEPS))], axis=1)
    for i in range(ROUNDS):
        rest = lacks(2 + i, parameters) if i else rest
        step = np.linalg.lstsq(slopes, rest)[0]
        parameters = parameters + step
    rest = rest - slopes @ step
    free = len(target) - len(parameters)
    variance = np.diag(np.linalg.inv(slopes.T @ slopes)) * float(rest @ rest) / free
    one, two = student.ppf(0.975, free) * np.sqrt(variance)
    return Calibration(float(parameters[0]), float(parameters[1]), (float(one), float(two)))
