"""The yaw error that a load limit allows at each wind speed: base points from loads instead of from experience.

The turbine produces in turbulence with its nacelle held at a yaw error. The limit is what the bearing and tower must
stand anyway: the largest load of extreme turbulence with the wind within the dead band of the yaw control, and a tenth
more, because few runs of minutes stand for hours.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.result import Result
from meltemi.simulation.run import Run
from meltemi.simulation.trim import operating_point
from meltemi.wind.fields import SteadyWind
from meltemi.wind.iec.winds import etm, ntm
from meltemi_papers.wang2021.loads import CHANNELS, TOP_SHEAR, TOWER_BASE, YAW_BENDING, YAW_TORSION, extreme
from meltemi_papers.wang2021.winds import SHEAR
from meltemi_tuning.run_store import FailedResult, attempt, cells, survivors

Float = NDArray[np.float64]
BasePoints = tuple[Float, Float]
"""Wind speeds [m/s] and thresholds [rad]."""
JUDGED = (YAW_BENDING, YAW_TORSION, TOP_SHEAR, TOWER_BASE)
WIND_CLASS = "IIIB"
"""Of the turbulence; the turbine's class S does not say."""
SPEEDS = (5.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0)
"""[m/s]."""
ERRORS = tuple(np.radians((0.0, 15.0, 30.0, 45.0, 60.0, 75.0)))
"""[rad], of either sign."""
DEAD_BAND = float(np.radians(8.0))
ALLOWANCE = 1.1
"""Of the limit over the largest load found in extreme turbulence: few seeds of minutes stand for hours."""
LEAD, LENGTH = 30.0, 150.0
"""[s] not judged, and of a run."""


@dataclass(frozen=True)
class Limits:
    """Loads over wind speed and yaw error.

    Attributes:
      speeds, errors: (S,), (E,) [m/s], [rad].
      loads: by name (S, E), largest over seeds and both signs, in the load's unit.
      limit: by name, in the same unit.
    """

    speeds: Float
    errors: Float
    loads: dict[str, Float] = field(repr=False)
    limit: dict[str, float]

    @property
    def use(self) -> Float:
        """(S, E) largest ratio of a load to its limit."""
        return np.max([self.loads[name] / self.limit[name] for name in JUDGED], axis=0)

    def allowed(self) -> Float:
        """(S,) [rad] largest yaw error within all limits, interpolated linearly; non-increasing with wind speed."""
        found = []
        for use in self.use:
            over = np.flatnonzero(use > 1.0)
            if not len(over):
                found.append(self.errors[-1])
            elif over[0] == 0:
                found.append(0.0)
            else:
                k = over[0]
                share = (1.0 - use[k - 1]) / (use[k] - use[k - 1])
                found.append(self.errors[k - 1] + share * (self.errors[k] - self.errors[k - 1]))
        return np.minimum.accumulate(np.array(found))

    @property
    def base_points(self) -> BasePoints:
        """Base points of the interpolated law."""
        return self.speeds, self.allowed()


def find_limits(
    model: BladedModel,
    seeds: Sequence[int],
    *,
    speeds: Sequence[float] = SPEEDS,
    errors: Sequence[float] = ERRORS,
    length: float = LENGTH,
    workers: int | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Limits:
    """Simulate production at yaw errors, and extreme turbulence without.

    A run that cannot begin or does not reach its end counts as an infinite load at its yaw error; the limit is that of
    the others. Errors at which the wind does not turn the rotor have no load.

    Raises:
      LostError: no run in extreme turbulence reached its end.
    """
    keys: list[tuple[str, float, float, int]] = []
    for seed in seeds:
        for speed in speeds:
            keys += [("ntm", speed, sign * e, seed) for e in errors for sign in ((1.0, -1.0) if e > 0.0 else (1.0,))]
            keys += [("etm", speed, sign * DEAD_BAND, seed) for sign in (1.0, -1.0)]
    places = {(speed, angle) for _, speed, angle, _ in keys}
    starts = {
        (v, e): attempt(
            f"steady operation at {v:g} m/s, {np.degrees(e):g} deg",
            operating_point,
            model,
            SteadyWind(speed=v, shear_exponent=SHEAR, direction=e),
        )
        for v, e in places
    }
    cases = [
        Run(
            model=model,
            wind=(ntm if kind == "ntm" else etm)(speed, WIND_CLASS, seed=seed, direction=angle),
            duration=LEAD + length,
            channels=CHANNELS,
            start=starts[speed, angle],
            name=f"{kind} {speed:g} m/s {np.degrees(angle):g} deg seed {seed}",
        )
        for kind, speed, angle, seed in keys
    ]

    def peaks(result: Result) -> dict[str, float]:
        part = result.between(LEAD, np.inf)
        return {name: extreme(part, name) for name in JUDGED}

    found = cells(cases, reduce=peaks, workers=workers, progress=progress)
    survivors(peak for (kind, *_), peak in zip(keys, found, strict=True) if kind == "etm")
    loads = {name: np.zeros((len(speeds), len(errors))) for name in JUDGED}
    limit = dict.fromkeys(JUDGED, 0.0)
    for (kind, speed, angle, _), peak in zip(keys, found, strict=True):
        for name in JUDGED:
            value = np.inf if isinstance(peak, FailedResult) else peak[name]
            if kind == "etm":
                limit[name] = max(limit[name], 0.0 if isinstance(peak, FailedResult) else value)
            else:
                at = list(speeds).index(speed), int(np.argmin(np.abs(np.array(errors) - abs(angle))))
                loads[name][at] = max(loads[name][at], value)
    allowed = {name: ALLOWANCE * value for name, value in limit.items()}
    return Limits(np.array(speeds), np.array(errors), loads, allowed)
