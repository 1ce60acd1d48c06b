"""Evaluation of a load base: design loads of every interface, fatigue, energy, duty, and their gaps.

Equations L-1 to L-42 of ``docs/theory/design-loads.md``, which names the sources of each rule.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from meltemi.core.errors import InputError
from meltemi.core.files import replacing
from meltemi.core.shown import Brief
from meltemi.loads.extrapolation import LEAST
from meltemi.loads.loadbase.coverage import Results, condition_of, coverage_of, problems_of, read_results
from meltemi.loads.loadbase.endurance import (
    MarkovMatrix,
    durations_of,
    duties_of,
    energy_of,
    fatigue_loads,
    rose_fatigue,
    stops_of,
)
from meltemi.loads.loadbase.interfaces import interfaces_of, tensions
from meltemi.loads.loadbase.plan import Plan
from meltemi.loads.loadbase.settings import STANDARD, WAYS, DesignSettings
from meltemi.loads.loadbase.signals import (
    Extremes,
    clearance_table,
    line_table,
    rose_extremes,
    signals_table,
    tower_radius,
)
from meltemi.loads.loadbase.ultimate import (
    EXTRAPOLATED,
    Evaluation,
    ExtrapolatedLoad,
    runs_of,
    ultimate_tables,
)
from meltemi.postprocess.extremes import COMPONENTS
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.simulation.validity import undeflected_clearance
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import aeroelastic

if TYPE_CHECKING:
    import pandas as pd

    from meltemi.loads.energy import AnnualEnergy


@dataclass(frozen=True, repr=False)
class DesignLoads(Brief):
    """Design loads of a load base, in SI units and radians.

    Loads do not contain the factor for the consequence of failure. Interfaces of the blades (``blade_root``,
    ``blade_station_1`` ...) stand for the worst of all blades; channels of fatigue are those of each blade. A row is a
    row of the load case table, such as "1.3" or "7.1b". Drivers are "Fx max" to "Mz min", "F_res max", "M_res max"
    (``meltemi.postprocess.extremes.DRIVERS``).

    Attributes:
      plan: plan of the load base.
      settings: settings of the evaluation.
      common: warnings that hold for all cases: about the turbine, and those that all runs share.
      notes: remarks on the numbers: warnings for all cases, rows with missing cases, and the consequences.
      coverage: index row; columns dlc, title, type, cases, ok, warned, doubtful, failed, missing, unsupported (numbers
        of cases; a warned one ended as OK), complete (bool), meaning (text; empty if complete).
      problems: index case, all cases that are not simply OK; columns row, dlc, state ("warned", "doubtful", "failed",
        "missing", "unsupported"), message, meaning.
      ultimate: index (interface, driver): design loads, WITH partial safety factor. Columns Fx to Mz, F_res, M_res
        [N, N m], "F_res angle", "M_res angle" [rad], all of one instant; case, row, dlc, blade (0 if it is not one of a
        blade), time [s], factor, scale (ratio of the characteristic value to the driver's value in the run), rule,
        runs (over which a mean was taken), lacking (cases of the row without results), state of the case.
      characteristic: the same rows WITHOUT the factor; column factor is the one that ``ultimate`` contains.
      by_row: index (interface, driver, row): characteristic, factor, design [N, N m] (value of the driver without and
        with factor), case, runs, lacking.
      extrapolations: extrapolated loads of DLC 1.1, for each interface and driver, and for the deflection of the tip
        out of plane and towards the tower.
      clearance: index row: least distance of a blade tip from the surface of the tower, where a blade passes the
        tower. Columns clearance [m] (characteristic value), factor, material, deflection [m] (undeflected minus
        clearance), left [m] (undeflected minus deflection times both factors), ratio (clearance over undeflected),
        case, runs, lacking, fits (bool: ``left`` is positive).
      undeflected: [m] tip clearance of the undeflected rotor; NaN if it is not known.
      lines: index (channel, row), tensions of mooring lines: lost (bool: a line has parted), mean and largest tension
        [N] of the case, design [N] (characteristic value, with factors), utilisation (over the strength of the line;
        NaN if that is not known), case, runs, lacking.
      signals: index (channel, end "max" or "min"): characteristic values of accelerations, rotor speed, deflections and
        other channels, without factor. Columns value, unit, case, row, runs.
      roses: index (interface, angle [deg]) from the first transverse axis: largest (moment in this direction with
        factor [N m]), case, row, factor, and a column of lifetime equivalent load [N m] for each slope (float).
      fatigue: index channel: interface, load ("Fx" to "Mz", "M@30", "flap", "edge"), blade (0: none), and a column of
        lifetime equivalent load (range) [N, N m] for each slope (float), with ``settings.reference`` cycles.
      shares: index (channel, dlc, speed [m/s]): share in the damage, a column a slope; they sum to 1 for each channel.
      markov: cycles of the lifetime by range and mean, by channel.
      covered: share of the lifetime for which there are cases of fatigue; 1 if none is missing.
      energy: annual energy in production with its interval from the seeds; None without cases of production.
      powers: index speed [m/s]: power [W] (mean), half_width [W], runs, probability, energy [J] of a year.
      stops: index row: stops in a year.
      duties: index drive: travel [rad], moving [s], starts, reversals, each in a year; rms_rate, largest_rate [rad/s],
        case (of the largest rate), moving_share.
      durations: index (load, low, high): time [s] and revolutions at levels of the load [N, N m] in the lifetime.
      duration_loads: index load: equivalent load of a bearing or gear, a column for each exponent (3, 10/3).
    """

    plan: Plan
    settings: DesignSettings
    common: tuple[str, ...]
    notes: tuple[str, ...]
    coverage: pd.DataFrame
    problems: pd.DataFrame
    ultimate: pd.DataFrame
    characteristic: pd.DataFrame
    by_row: pd.DataFrame
    extrapolations: tuple[ExtrapolatedLoad, ...]
    clearance: pd.DataFrame
    undeflected: float
    lines: pd.DataFrame
    signals: pd.DataFrame
    roses: pd.DataFrame
    fatigue: pd.DataFrame
    shares: pd.DataFrame
    markov: dict[str, MarkovMatrix]
    covered: float
    energy: AnnualEnergy | None
    powers: pd.DataFrame
    stops: pd.DataFrame
    duties: pd.DataFrame
    durations: pd.DataFrame
    duration_loads: pd.DataFrame


def design_loads(plan: Plan, folder: str | Path, settings: DesignSettings = STANDARD) -> DesignLoads:
    """Evaluate a load base. Missing cases are no error; ``notes``, ``coverage`` and ``problems`` state what follows.

    Args:
      plan: plan of the load base.
      folder: folder of the load base.
      settings: settings such as ``DesignSettings(extrapolation="weibull")``.

    Raises:
      InputError: the method of extrapolation is not in the table, or the turbine or a file cannot be read.
    """
    results = read_results(plan, folder, doubtful=settings.doubtful)
    if settings.extrapolation in WAYS[2 + len(plan.table.extrapolation.quantiles) :]:
        raise InputError(f"design_loads: {settings.extrapolation} is not in the table of edition {plan.table.edition}")
    turbine = aeroelastic(load_turbine(plan.campaign.turbine), "design_loads")
    interfaces, extremes = interfaces_of(turbine), Extremes(results)
    evaluation = Evaluation(results, runs_of(results), settings.extrapolation, settings.resamples, [])
    matrix, by_row = ultimate_tables(evaluation, interfaces, plan.table.factors.favourable)
    undeflected = settings.undeflected
    if undeflected is None:
        undeflected = undeflected_clearance(build(turbine, ModelOptions(**plan.campaign.options)))
    clearance = clearance_table(evaluation, extremes, undeflected, tower_radius(turbine), settings.material)
    fatigue, shares, markov = fatigue_loads(results, extremes, interfaces, tensions(turbine), settings)
    roses = rose_extremes(evaluation, extremes, interfaces)
    roses = roses.join(rose_fatigue(fatigue, interfaces, settings.slopes), how="outer") if len(roses) else roses
    energy, powers = energy_of(results, extremes, settings.availability)
    durations, duration_loads = durations_of(results)
    coverage = coverage_of(results)
    return DesignLoads(
        plan=plan,
        settings=settings,
        common=results.common,
        notes=tuple(_notes(results, coverage, evaluation)),
        coverage=coverage,
        problems=problems_of(results),
        ultimate=matrix,
        characteristic=without_factor(matrix),
        by_row=by_row,
        extrapolations=tuple(evaluation.extrapolations),
        clearance=clearance,
        undeflected=undeflected,
        lines=line_table(evaluation, extremes, turbine),
        signals=signals_table(evaluation, extremes),
        roses=roses,
        fatigue=fatigue,
        shares=shares,
        markov=markov,
        covered=_covered(results),
        energy=energy,
        powers=powers,
        stops=stops_of(results),
        duties=duties_of(results),
        durations=durations,
        duration_loads=duration_loads,
    )


def without_factor(matrix: pd.DataFrame) -> pd.DataFrame:
    """Rows of extreme loads divided by their factor; the column factor stays."""
    if matrix.empty:
        return matrix
    loads = [*COMPONENTS, "F_res", "M_res"]
    return matrix.assign(**matrix[loads].div(matrix["factor"], axis=0), factored=False)


def _covered(results: Results) -> float:
    """Share of the planned lifetime whose conditions have cases."""
    present = {condition_of(case) for case in results.present}
    weights = [(case.weight.share, condition_of(case)) for case in results.plan.cases if case.weight]
    whole = sum(share for share, _ in weights)
    return sum(share for share, condition in weights if condition in present) / whole if whole > 0.0 else nan


def _notes(results: Results, coverage: pd.DataFrame, evaluation: Evaluation) -> Iterator[str]:
    """Remarks on the numbers."""
    plan = results.plan
    yield from (f"All cases: {words.rstrip('.')}{'' if words.endswith('?') else '.'}" for words in results.common)
    if plan.campaign.quick:
        yield "Quick plan with one seed and few wind speeds: not valid for design."
    for row, line in coverage.iterrows():
        if line["meaning"]:
            yield f"DLC {line['dlc']} ({row}): {line['meaning']}."
    words = {"doubtful": "outside the range of validity of the model", "warned": "with warnings"}
    for state, text in words.items():
        if n := sum(results.states[case.name] == state for case in results.present):
            yield f"{n} case{'s' if n > 1 else ''} {text} included."
    for runs in evaluation.runs:
        if runs.rule == EXTRAPOLATED:
            least = LEAST["weibull" if evaluation.way == "weibull" else "gumbel"]
            few = sorted({v for v in runs.speeds.tolist() if np.sum(runs.speeds == v) < least})
            if len(few) == len(set(runs.speeds)):
                yield f"DLC {runs.dlc}: fewer than the {least} seeds that an extrapolation needs; not evaluated."
            elif few:
                speeds = ", ".join(f"{v:g}" for v in few)
                yield f"DLC {runs.dlc}: {speeds} m/s have fewer than {least} seeds and are not extrapolated."


def compare_bases(base: DesignLoads, reference: DesignLoads) -> pd.DataFrame:
    """Ratios of the loads of a load base to those of another one, such as of another controller or of the design.

    Args:
      base: design loads in the numerators.
      reference: design loads in the denominators.

    Returns:
      index (kind, interface, load), see L-41: kind "ultimate" (load: driver; with factor), "fatigue" (load: "My m=10",
      the worst blade), "clearance" (least ``left`` of all rows [m]), "motion" (largest offset [m] and tilt [rad] of a
      platform) or "energy" (of a year [J]); columns value, reference, ratio (utilisation; NaN where the reference is
      zero), case, reference_case. Loads of only one base are left out.
    """
    import pandas as pd

    one, other = _compared(base), _compared(reference)
    lines = [
        (*key, value, other[key][0], value / other[key][0] if other[key][0] else nan, case, other[key][1])
        for key, (value, case) in one.items()
        if key in other
    ]
    head = ["kind", "interface", "load", "value", "reference", "ratio", "case", "reference_case"]
    return pd.DataFrame(lines, columns=head).set_index(head[:3])


def _compared(design: DesignLoads) -> dict[tuple[str, str, str], tuple[float, str]]:
    """Value and case by kind, interface and load."""
    loads: dict[tuple[str, str, str], tuple[float, str]] = {}
    for (interface, driver), row in design.ultimate.iterrows():
        column = driver.split()[0]
        loads["ultimate", interface, driver] = (float(row[column]), str(row["case"]))
    slopes = [name for name in design.fatigue.columns if isinstance(name, float)]
    for (interface, load), row in design.fatigue.groupby(["interface", "load"], sort=False)[slopes].max().iterrows():
        loads |= {("fatigue", interface, f"{load} m={slope:g}"): (float(row[slope]), "") for slope in slopes}
    if len(design.clearance):
        worst = design.clearance.sort_values("left").iloc[0]
        loads["clearance", "blade", "tip"] = (float(worst["left"]), str(worst["case"]))
    for load in ("offset", "tilt"):
        if (f"platform_{load}", "max") in design.signals.index:
            row = design.signals.loc[(f"platform_{load}", "max")]
            loads["motion", "platform", f"{load} max"] = (float(row["value"]), str(row["case"]))
    if design.energy is not None:
        loads["energy", "turbine", "year"] = (design.energy.energy, "")
    return loads


TABLES = (
    "ultimate characteristic by_row clearance lines signals roses fatigue shares powers stops duties durations "
    "duration_loads coverage problems"
).split()


def design_tables(design: DesignLoads) -> dict[str, pd.DataFrame]:
    """All results as tables by name: the frames of ``DesignLoads``, extrapolations, cycles and notes."""
    import pandas as pd

    tables = {name: getattr(design, name) for name in TABLES}
    tables["extrapolations"] = extrapolation_table(design)
    cycles = []
    for channel, matrix in design.markov.items():
        for i, j in zip(*matrix.counts.nonzero(), strict=True):
            ends = (*matrix.range_edges[i : i + 2], *matrix.mean_edges[j : j + 2])
            cycles.append((channel, *ends, matrix.counts[i, j]))
    head = ["channel", "range_low", "range_high", "mean_low", "mean_high", "cycles"]
    tables["markov"] = pd.DataFrame(cycles, columns=head).set_index("channel")
    tables["notes"] = pd.DataFrame({"note": list(design.notes)})
    return tables


def extrapolation_table(design: DesignLoads) -> pd.DataFrame:
    """Loads of DLC 1.1 by all methods of extrapolation, without factor; index (interface, driver)."""
    import pandas as pd

    lines = []
    for each in design.extrapolations:
        line: dict[str, object] = {"interface": each.interface, "driver": each.driver, "unit": each.unit}
        for name, extrapolation in (("gumbel", each.gumbel), ("weibull", each.weibull)):
            values = (
                (nan, nan, nan)
                if extrapolation is None
                else (extrapolation.load, extrapolation.low, extrapolation.high)
            )
            line |= dict(zip((name, f"{name}_low", f"{name}_high"), values, strict=True))
            line[f"{name} without speeds"] = ", ".join(f"{speed:g}" for speed in each.left_out[name])
        line |= {way: each.load(way) for way in WAYS[2:]} | {"largest": each.largest, "factor": each.factor}
        lines.append(line)
    return pd.DataFrame(lines).set_index(["interface", "driver"]) if lines else pd.DataFrame()


def write_tables(design: DesignLoads, folder: str | Path) -> list[Path]:
    """Write all tables as CSV files, in SI units.

    Returns:
      the files.

    Raises:
      InputError: a file cannot be written.
    """
    tables, files, folder = design_tables(design), list[Path](), Path(folder)
    with suppress(OSError):  # the message comes from writing
        folder.mkdir(parents=True, exist_ok=True)
    for name, table in tables.items():
        path = folder / f"{name}.csv"
        with replacing(path) as (partial,):
            table.to_csv(partial)
        files.append(path)
    return files
