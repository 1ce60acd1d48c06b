"""Extremes of single channels of a load base: clearance of the tips, accelerations, moments by direction.

Equations L-16 to L-18 and L-38 of ``docs/theory/design-loads.md``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from meltemi.loads.extrapolation import Float
from meltemi.loads.loadbase.coverage import Results
from meltemi.loads.loadbase.interfaces import MOTIONS, TURNED, Interface, tensions
from meltemi.loads.loadbase.plan import PlannedCase
from meltemi.loads.loadbase.ultimate import EXTRAPOLATED, Evaluation, blade_groups, each_row, family
from meltemi.postprocess.extremes import TRANSVERSE
from meltemi.simulation.channels import every_kind

if TYPE_CHECKING:
    import pandas as pd

    from meltemi.turbine.definition import Turbine

SIGNALS = (
    *("tower_top_acceleration_x", "tower_top_acceleration_y", "tower_top_fore_aft", "tower_top_side_side"),
    *("rotor_speed", "generator_speed", "generator_torque", "generator_power", "brake_torque"),
    *("tip_out_of_plane", "tip_in_plane", "tip_twist", "pitch_rate", *MOTIONS),
)
CLEARANCE = "tip_clearance"
IN_FRONT = 10.0
"""Azimuth [deg] from straight down, within which a blade of a locked rotor is in front of the tower."""
DEFLECTION = "tip_out_of_plane"
TOWARDS_TOWER = "tip_towards_tower"
"""Name of the extrapolated deflection: undeflected clearance minus clearance."""


class Extremes:
    """Largest and smallest values of channels in the cases that are evaluated, also over all blades together.

    Args:
      results: results of the load base.
    """

    def __init__(self, results: Results) -> None:
        frame, names = results.table("statistics"), [case.name for case in results.present]
        self._places: dict[str, list[int]] = {}
        self._wide: dict[str, Float] = {}
        if len(frame):
            wide = frame.pivot(index="case", columns="channel", values=["min", "max", "mean"]).reindex(names)
            self._wide = {of: wide[of].to_numpy(float) for of in ("min", "max", "mean")}
            for place, name in enumerate(wide["max"].columns):
                for known in {name, family(name), _of_all(name)}:
                    self._places.setdefault(known, []).append(place)

    def __contains__(self, channel: str) -> bool:
        return channel in self._places

    def values(self, channel: str, of: Literal["min", "max", "mean"]) -> Float:
        """(cases,) extremes or means of a channel; a name without the number of the blade stands for all blades."""
        return np.asarray(getattr(self._wide[of][:, self._places[channel]], of)(axis=1))


def _of_all(name: str) -> str:
    """Name of a moment by direction without the number of the blade: ``blade_root_1_moment@30``."""
    stem, at, angle = name.partition("_moment@")
    return f"{family(stem)}{at}{angle}"


def signals_table(evaluation: Evaluation, extremes: Extremes) -> pd.DataFrame:
    """Characteristic values without factor; see ``DesignLoads.signals``. DLC 1.1 has the largest of all runs."""
    import pandas as pd

    units = {family(name): channel.unit for name, channel in every_kind().items()}
    lines = []
    for channel in SIGNALS:
        for end in ("max", "min") if channel in extremes else ():
            sign, values = (-1.0 if end == "min" else 1.0), extremes.values(channel, end)
            if rows := each_row(_plain(evaluation), values, (channel, end, ""), end == "min"):
                runs, value, run = max(rows, key=lambda each: sign * each[1])
                lines.append((channel, end, value, units[channel], runs.names[run], runs.row, runs.size(run)))
    head = ["channel", "end", "value", "unit", "case", "row", "runs"]
    return pd.DataFrame(lines, columns=head).set_index(head[:2])


def _plain(evaluation: Evaluation) -> Evaluation:
    """The evaluation with the largest of all runs in place of an extrapolation."""
    runs = [replace(each, rule="largest") if each.rule == EXTRAPOLATED else each for each in evaluation.runs]
    return replace(evaluation, runs=runs)


def clearance_table(
    evaluation: Evaluation, extremes: Extremes, undeflected: float, radius: float, material: float
) -> pd.DataFrame:
    """Clearance of the tips in each row; see ``DesignLoads.clearance`` (L-38).

    Args:
      evaluation: evaluation of characteristic values.
      undeflected: [m] distance of an undeflected tip from the surface of the tower.
      radius: [m] radius of the tower where the tips pass.
      material: partial safety factor for the elasticity of the blade.
    """
    import pandas as pd

    lines = []
    if CLEARANCE in extremes:
        # factors increase the deflection, which is therefore extrapolated
        origin = float(np.nan_to_num(undeflected))
        towards = origin + radius - extremes.values(CLEARANCE, "min")
        for runs, bent, run in each_row(_passing(evaluation), towards, (TOWARDS_TOWER, "max", "m"), False, keep=True):
            value, left = origin - bent, undeflected - runs.factor * material * bent
            of_blade = (runs.row, value, runs.factor, material, bent, left, value / undeflected, runs.names[run])
            lines.append((*of_blade, runs.size(run), runs.lacking, left > 0.0))
    head = ["row", "clearance", "factor", "material", "deflection", "left", "ratio", "case", "runs", "lacking", "fits"]
    if DEFLECTION in extremes:
        each_row(evaluation, extremes.values(DEFLECTION, "max"), (DEFLECTION, "max", "m"), False, keep=True)
    table = pd.DataFrame(lines, columns=head).set_index("row")
    return table.sort_values("left").groupby(level=0, sort=False).first()  # rows with several factors


def line_table(evaluation: Evaluation, extremes: Extremes, turbine: Turbine) -> pd.DataFrame:
    """Design tension of the mooring lines in each row; see ``DesignLoads.lines`` (L-42)."""
    import pandas as pd

    results, plain, table = evaluation.results, _plain(evaluation), []
    factors, lines = results.plan.table.factors, () if turbine.platform is None else turbine.platform.lines
    faults = [case.setting.fault for case in results.present]
    lost = np.array([fault is not None and fault.events[0].get("type") == "line_loss" for fault in faults], dtype=int)
    of_mean, of_rest = np.array(factors.line_mean)[lost], np.array(factors.line_dynamic)[lost]
    for channel, name in tensions(turbine).items():
        if channel not in extremes:
            continue
        strength = lines[int(name.removeprefix("line_")) - 1].strength
        mean, largest = extremes.values(channel, "mean"), extremes.values(channel, "max")
        design = of_mean * mean + of_rest * (largest - mean)
        for runs, value, run in each_row(plain, design, (channel, "max", "N"), False):
            place, use = runs.places[run], np.nan if strength is None else value / strength
            loads = (mean[place], largest[place], value, use)
            table.append((channel, runs.row, bool(lost[place]), *loads, runs.names[run], runs.size(run), runs.lacking))
    head = "channel row lost mean largest design utilisation case runs lacking".split()
    return pd.DataFrame(table, columns=head).set_index(head[:2])


def _passing(evaluation: Evaluation) -> Evaluation:
    """The evaluation of the runs in which a blade passes the tower."""
    blades = evaluation.results.plan.campaign.blades
    kept = []
    for runs in evaluation.runs:
        passing = np.array([passes_tower(evaluation.results.present[i], blades) for i in runs.places], dtype=bool)
        if passing.any():
            names = tuple(name for name, keep in zip(runs.names, passing, strict=True) if keep)
            parts = {name: getattr(runs, name)[passing] for name in ("places", "groups", "speeds")}
            kept.append(replace(runs, names=names, **parts))
    return replace(evaluation, runs=kept)


def passes_tower(case: PlannedCase, blades: int) -> bool:
    """Whether a blade passes the tower: the rotor turns, or is locked with a blade in front of it."""
    if case.setting.row.situation != "locked":
        return True
    azimuths = [(case.variant.azimuth or 0.0) + 360.0 * b / blades for b in range(blades)]
    return any(abs(azimuth % 360.0 - 180.0) <= IN_FRONT for azimuth in azimuths)


def tower_radius(turbine: Turbine) -> float:
    """Radius [m] of the tower at the height of the lowest tip of the undeflected rotor."""
    low = turbine.hub_height - turbine.rotor_radius - turbine.tower.base_height
    return 0.5 * float(np.interp(low, turbine.tower.position, turbine.tower.diameter))


def rose_extremes(evaluation: Evaluation, extremes: Extremes, interfaces: Sequence[Interface]) -> pd.DataFrame:
    """Largest moment with factor in each direction; see ``DesignLoads.roses`` (L-16, L-18)."""
    import pandas as pd

    lines = []
    for name, members in blade_groups(each for each in interfaces if each.rose).items():
        for angle in range(0, 360, 30):
            channel, smallest = rose_channel(members[0], angle % 180), angle >= 180
            kept = _of_all(channel) if "@" in channel else family(channel)
            if kept not in extremes:
                continue
            values, sign = extremes.values(kept, "min" if smallest else "max"), -1.0 if smallest else 1.0
            if rows := each_row(evaluation, values, (kept, "", "N m"), smallest):
                runs, value, run = max(rows, key=lambda each: sign * each[1] * each[0].factor)
                lines.append((name, angle, sign * value * runs.factor, runs.names[run], runs.row, runs.factor))
    head = ["interface", "angle", "largest", "case", "row", "factor"]
    return pd.DataFrame(lines, columns=head).set_index(head[:2])


def rose_channel(interface: Interface, angle: int) -> str:
    """Channel of the moment of an interface in a direction [deg] of the first half turn."""
    i, j = TRANSVERSE[interface.plane]
    if angle not in TURNED:
        return interface.channels[3 + (i if angle == 0 else j)]
    return f"{interface.name}_moment@{angle}"
