"""Evaluation of a load base: design loads of every interface, fatigue, energy, duty, and what they lack.

Equations L-1 to L-45 of ``docs/theory/design-loads.md``, which names the sources of each rule.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from meltemi.core.display import Brief
from meltemi.loadbase.endurance import MarkovMatrix
from meltemi.loadbase.plan import Plan
from meltemi.loadbase.ultimate import ExtrapolatedLoad

if TYPE_CHECKING:
    import pandas as pd

    from meltemi.postprocess.lifetime import AnnualEnergy


@dataclass(frozen=True, repr=False)
class DesignLoads(Brief):
    """Design loads of a load base, in SI units and radians.

    Interfaces of the blades (``blade_root``, ``blade_station_1`` ...) stand for the worst of all blades; channels of
    fatigue are those of each blade. A row is a row of the load case table, such as "1.3" or "7.1b". Drivers are
    "Fx max" to "Mz min", "F_res max", "M_res max" (``meltemi.postprocess.extremes.DRIVERS``).

    Attributes:
      plan: of the load base.
      notes: sentences that belong beside the numbers: rows without all their cases, and what follows.
      coverage: index row; columns dlc, title, type, cases, ok, warned, doubtful, failed, missing, unsupported (numbers
        of cases; a warned one ended as OK), complete (bool), meaning (text; empty if complete).
      problems: index case, of all cases that are not simply OK; columns row, dlc, state ("warned", "doubtful", "failed",
        "missing", "unsupported"), message, meaning.
      ultimate: index (interface, driver): design loads, WITH partial safety factor. Columns Fx to Mz, F_res, M_res
        [N, N m], "F_res angle", "M_res angle" [rad], all of one instant; case, row, dlc, blade (0 if it is not one of a
        blade), time [s], factor, scale (ratio of the characteristic value to the driver's value in the run), rule,
        runs (over which a mean was taken), lacking (cases of the row that take no part), state of the case.
      characteristic: the same rows WITHOUT the factor; column factor is the one that ``ultimate`` contains.
      by_row: index (interface, driver, row): characteristic, factor, design [N, N m] (value of the driver without and
        with factor), case, runs, lacking.
      extrapolations: of DLC 1.1, for each interface and driver, and for deflection and clearance of the tip.
      clearance: index row: least distance of a blade's tip from the tower's surface. Columns clearance [m]
        (characteristic value), factor, deflection [m] (undeflected minus clearance), left [m] (undeflected minus
        deflection times factors), ratio (clearance over undeflected), case, runs, lacking, fits (bool: ``left``
        positive).
      undeflected: [m] tip clearance of the undeflected rotor; NaN if it is not known.
      signals: index (channel, end "max" or "min"): characteristic values of accelerations, rotor speed, deflections and
        other channels, without factor. Columns value, unit, case, row, runs.
      roses: index (interface, angle [deg]) from the first transverse axis: largest (moment in this direction with factor
        [N m]), case, row, factor, and a column of lifetime equivalent load [N m] for each slope (float).
      fatigue: index channel: interface, load ("Fx" to "Mz", "M@30", "flap", "edge"), blade (0: none), and a column of
        lifetime equivalent load (range) [N, N m] for each slope (float).
      reference: number of cycles of the equivalent loads.
      shares: index (channel, dlc, speed [m/s]): share in the damage, a column a slope; they sum to 1 for each channel.
      markov: by channel, cycles of the lifetime by range and mean.
      covered: share of the lifetime for which there are cases of fatigue; 1 if none is missing.
      energy: of a year in production with its interval from the seeds; None without cases of production.
      powers: index speed [m/s]: power [W] (mean), half_width [W], runs, probability, energy [J] of a year.
      stops: index row: stops in a year.
      duties: index drive: travel [rad], moving [s], starts, reversals, each in a year; rms_rate, largest_rate [rad/s],
        case (of the largest rate), moving_share.
      durations: index (load, low, high): time [s] and revolutions at levels of the load [N, N m] in the lifetime.
      duration_loads: index load: equivalent load of a bearing or gear, a column for each exponent (3, 10/3).
    """

    plan: Plan
    notes: tuple[str, ...]
    coverage: pd.DataFrame
    problems: pd.DataFrame
    ultimate: pd.DataFrame
    characteristic: pd.DataFrame
    by_row: pd.DataFrame
    extrapolations: tuple[ExtrapolatedLoad, ...]
    clearance: pd.DataFrame
    undeflected: float
    signals: pd.DataFrame
    roses: pd.DataFrame
    fatigue: pd.DataFrame
    reference: float
    shares: pd.DataFrame
    markov: dict[str, MarkovMatrix]
    covered: float
    energy: AnnualEnergy | None
    powers: pd.DataFrame
    stops: pd.DataFrame
    duties: pd.DataFrame
    durations: pd.DataFrame
    duration_loads: pd.DataFrame


def design_loads(plan: Plan, folder: str | Path) -> DesignLoads:
    """Evaluate a load base; what is missing is stated, not an error."""
    raise NotImplementedError


def compare_bases(base: DesignLoads, reference: DesignLoads) -> pd.DataFrame:
    """Loads of a load base over those of another one.

    Returns:
      index (kind, interface, load) with kind "ultimate" (load: driver), "fatigue" (load: "My m=10"), "clearance",
      "energy"; columns value, reference, ratio (utilisation; NaN if the reference is zero), case, reference_case.
    """
    raise NotImplementedError


def write_design_loads(design: DesignLoads, folder: str | Path) -> list[Path]:
    """Write all tables as CSV files and as one Excel file, ``design_loads.xlsx``."""
    raise NotImplementedError
