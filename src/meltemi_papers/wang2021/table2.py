"""Table 2: each bin simulated with its mean speed and intensity, then binned like the measurements.

The rotor is scaled from another, so it is reported twice: as it comes, and calibrated by two numbers, an efficiency and
an air density, that are fitted to power and flapwise moment of bins 5 to 7 alone. The other bins then judge it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.environment.site import Environment
from meltemi.postprocess.bins import EDGES, bin_statistics, result_statistics
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.trim import operating_point
from meltemi.studies.run_store import FailedResult, FailedResultError, attempt, cells, survivors
from meltemi.turbine.definition import Turbine
from meltemi.wind.fields import SteadyWind
from meltemi_papers.wang2021.winds import SHEAR, MeasuredBin, bin_wind, measured

if TYPE_CHECKING:
    import pandas as pd

Float = NDArray[np.float64]
TRANSIENT = 100.0
"""[s] not judged."""
SPEED, POWER, MOMENT = "wind_x", "generator_power", "root_moment_flap_1"
CHANNELS = (SPEED, POWER, MOMENT, "rotor_speed", "pitch_1")
FITTED = (5, 6, 7)
"""Bins that the calibration sees."""
ROUNDS = 2
"""Of the calibration."""


@dataclass(frozen=True)
class Calibration:
    """Two factors that fit the scaled turbine to the measurements.

    Attributes:
      efficiency: electrical power over that of the scaled turbine: losses of a rotor that is not as good.
      air_density: [kg/m^3].
    """

    efficiency: float = 1.0
    air_density: float = 1.225

    def turbine(self, reference: Turbine) -> Turbine:
        """The turbine with the calibrated efficiency and unchanged rated electrical power."""
        share = reference.drivetrain.generator_efficiency * self.efficiency
        torque = reference.control.torque
        return reference.replace(
            **{
                "drivetrain.generator_efficiency": share,
                "control.torque.rated_power": torque.rated_power / self.efficiency,
                "control.torque.maximum_torque": torque.maximum_torque / self.efficiency,
            }
        )


@dataclass(frozen=True)
class Table2:
    """Our Table 2.

    Attributes:
      calibration: with which.
      bins: from ``bin_statistics``, SI; over the runs that reached their end.
      lost: bins without such a run, and why.
    """

    calibration: Calibration
    bins: pd.DataFrame = field(repr=False)
    lost: Mapping[int, str] = field(default_factory=dict)

    def whole(self) -> Table2:
        """The table; raises if a part is lost.

        Raises:
          LostError: a bin has no run that reached its end.
        """
        for why in self.lost.values():
            raise FailedResultError(why)
        return self

    def column(self, name: str, of: str) -> Float:
        """(18,) column of the measured bins, in kW and kNm."""
        return np.asarray(self.bins[name, of].to_numpy()[: len(measured())] * 1e-3)


def simulate_bins(
    turbine: Turbine,
    calibration: Calibration,
    rows: Sequence[MeasuredBin],
    seeds: Sequence[int],
    *,
    period: float = 600.0,
    workers: int | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Table2:
    """Simulate bins and bin the results.

    Raises:
      LostError: no run reached its end.
    """
    import pandas as pd

    model = build(calibration.turbine(turbine), environment=Environment(air_density=calibration.air_density))
    winds = {row.bin: SteadyWind(speed=row.speed, shear_exponent=SHEAR) for row in rows}
    # one a bin, not one a seed
    starts = {k: attempt(f"steady operation, bin {k}", operating_point, model, wind) for k, wind in winds.items()}
    cases = [
        Run(
            model=model,
            wind=bin_wind(row, seed),
            duration=TRANSIENT + period,
            channels=CHANNELS,
            start=starts[row.bin],
            name=f"bin {row.bin}, seed {seed}",
        )
        for row in reversed(rows)  # those in high wind, which take longest, first
        for seed in seeds
    ]

    def statistics(result: Result) -> pd.DataFrame:
        return result_statistics(result, CHANNELS, begin=TRANSIENT)

    found = cells(cases, reduce=statistics, workers=workers, progress=progress)
    n = len(seeds)
    whole = {row.bin: found[i * n : (i + 1) * n] for i, row in enumerate(reversed(rows))}
    lost = {k: of[0].why for k, of in whole.items() if all(isinstance(each, FailedResult) for each in of)}
    bins = bin_statistics(pd.concat(survivors(found)), SPEED, edges=EDGES)
    return Table2(calibration, bins, lost)


def calibrate(
    turbine: Turbine,
    seeds: Sequence[int],
    *,
    period: float = 600.0,
    workers: int | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Calibration:
    """Efficiency and air density with which bins 5 to 7 have the measured power and moment, in the mean of logarithms.

    Moments go with the density, powers with density and efficiency; each round corrects both by what is missing. Where
    this asks for an efficiency above that of the scaled turbine, it stays there, and the density divides what is left
    between power and moment: least squares of the logarithms.
    """
    now = Calibration()
    rows = [row for row in measured() if row.bin in FITTED]
    for i in range(ROUNDS):
        found = simulate_bins(
            turbine,
            now,
            rows,
            seeds,
            period=period,
            workers=workers,
            progress=lambda share, i=i: progress((i + share) / ROUNDS),  # type: ignore[misc]
        )
        at = [k - 1 for k in FITTED]
        found.whole()
        power = float(np.mean(np.log([r.power_mean for r in rows] / found.column(POWER, "mean")[at])))
        moment = float(np.mean(np.log([r.moment_mean for r in rows] / found.column(MOMENT, "mean")[at])))
        efficiency = min(float(np.log(now.efficiency)) + power - moment, 0.0)
        power -= efficiency - float(np.log(now.efficiency))  # left for the density
        density = moment if efficiency < 0.0 else 0.5 * (power + moment)
        now = Calibration(float(np.exp(efficiency)), now.air_density * float(np.exp(density)))
    return now
