"""A run with a vortex wake beside the same run by momentum theory: what the wake changes in power and loads."""

from __future__ import annotations

from collections.abc import Sequence

from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.postprocess.statistics import once_per_revolution
from meltemi.report.tables import Rows, number
from meltemi.simulation.result import Result

MEANS = ("generator_power", "rotor_aero_thrust", "root_moment_flap_1", "shaft_tilt_moment", "shaft_yaw_moment")
ONCE = ("root_moment_flap_1", "root_moment_edge_1")
CYCLES = ("root_moment_flap_1", "tower_base_moment_fore_aft", "yaw_moment_z")
"""Channels whose means, parts at the frequency of the rotor, and damage-equivalent loads are compared."""


def beside_momentum(result: Result, momentum: Result) -> Rows:
    """Header and rows of the quantities of two runs, in engineering units, for the channels that both have.

    Means and equivalent loads are without the initial transient. Cosine and sine of a moment are about the azimuth of
    blade 1, which is 0 where it points up, over the last whole revolutions.
    """
    rows: list[list[str]] = []

    def add(what: str, name: str, values: Sequence[float]) -> None:
        channel = result.channel(name)
        unit, factor = channel.display_unit
        ours, theirs = (value * factor for value in values)
        share = number(100.0 * (ours - theirs) / abs(theirs)) if theirs else ""
        rows.append([channel.description, what, unit, number(ours), number(theirs), number(ours - theirs), share])

    both = [each.evaluated for each in (result, momentum)]

    def present(names: Sequence[str]) -> list[str]:
        return [name for name in names if all(name in each for each in both)]

    for name in present(MEANS):
        add("mean", name, [float(each[name].mean()) for each in both])
    turns = [once_per_revolution(each, present(ONCE)) for each in both] if present(["azimuth"]) else [{}, {}]
    for name in filter(turns[1].__contains__, turns[0]):
        for i, what in enumerate(("cosine of the azimuth", "sine of the azimuth")):
            add(what, name, [turn[name][i] for turn in turns])
    if all(len(each.time) > 1 for each in both):
        loads = [equivalent_loads(each, present(CYCLES)) for each in (result, momentum)]
        for name in loads[0]:
            add("DEL 1 Hz", name, [load[name] for load in loads])
    return ["quantity", "part", "unit", "vortex wake", "momentum", "difference", "%"], rows
