"""Kernels of the limits of validity, in plain Python."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from plain import plain, record, table

import meltemi
from meltemi.aero.tables import AeroParameters, RotorFlow, TowerFlow
from meltemi.compiler import Rot, Vec, View
from meltemi.simulation import validity
from meltemi.simulation import watch as watch_kernels
from meltemi.simulation.system import System
from meltemi.simulation.tables import Watch
from meltemi.simulation.validity import BENDING, CRITERIA, DEFLECTION, EDGE, PITCH, POWER, REVERSED, SPEED, TIP, TOWER
from meltemi.structure.tables import ApexColumns, BladeNode, StructureParameters
from meltemi.turbine.exchange import BladeFrame, BladeMotion, Drive, Machine, PitchMotion

Float = NDArray[np.float64]
V = np.array([0.1, 0.2, 0.05, 1.1, 0.04, 0.5, -3.0, 0.2, 4.0])
"""Speeds: two modes of the tower, yaw, generator, torsion, two modes of each of two blades."""


def watch_of(**columns: Any) -> Any:
    never = {"worst": -np.inf, "first": -1.0, "noticed": -1.0, "limit": np.inf, "notice": np.inf, "place": -1.0}
    return table(Watch, {"criterion": len(CRITERIA)}, **(never | columns))


def at(criterion: int, value: float, other: float = 0.0) -> Float:
    """A column with a value at one criterion."""
    return np.where(np.arange(len(CRITERIA)) == criterion, value, other)


def turbine(v: Float = V, **changes: Any) -> Any:
    two = {"blade": 2, "node": 2}
    members = {
        "v": v, "columns": table(ApexColumns, {"coordinate": 5}), "structure": StructureParameters.of(gear_ratio=50.0),
        "drive": Drive.of(generator_torque=2e3), "aero": AeroParameters.of(air_density=1.2),
        "rotor": RotorFlow.of(wind=Vec(8.0, -3.0, 2.0), torque=1e6),
        "pitch": table(PitchMotion, {"blade": 2}, angle=(0.3, -0.7)),
        "motion": table(BladeMotion, two), "blade_nodes": table(BladeNode, two),
    }  # fmt: skip
    return record(System, **(members | changes))


def test_a_criterion_keeps_its_largest_value_and_the_first_times_beyond_limit_and_notice() -> None:
    watch = watch_of(limit=at(TIP, 3.0, np.inf), notice=at(TIP, 2.0, np.inf))
    for t, value in ((0.0, 2.0), (1.0, 2.5), (2.0, 1.0), (3.0, 3.5), (4.0, 3.2)):
        plain(watch_kernels.record_criterion)(watch, TIP, t, value)
    assert (watch.worst[TIP], watch.noticed[TIP], watch.first[TIP]) == (3.5, 1.0, 3.0)


def test_speed_power_and_pitch() -> None:
    watch = watch_of(scale=at(POWER, 400.0), state=at(POWER, 1e4))
    plain(watch_kernels.watch_shaft)(1.0, 0.5, turbine(), watch)
    assert watch.worst[SPEED] == pytest.approx(1.14)
    assert watch.worst[REVERSED] == -np.inf
    excess = 1e6 * 1.14 - 400.0 * 1.2 * 77.0**1.5
    assert watch.worst[POWER] == pytest.approx(1e4 + (excess - 1e4) * 0.5 / 10.0)
    assert watch.worst[PITCH] == 0.7
    plain(watch_kernels.watch_shaft)(1.0, 30.0, turbine(), watch)  # a step beyond the time of the mean
    assert watch.state[POWER] == pytest.approx(excess)


def test_a_generator_that_drives_the_rotor_backwards() -> None:
    watch = watch_of(scale=at(POWER, 400.0))
    plain(watch_kernels.watch_shaft)(1.0, 0.5, turbine(-V), watch)
    assert watch.worst[SPEED] == pytest.approx(1.14)
    assert watch.worst[REVERSED] == pytest.approx(2e3 * 50.0 * 1.1)


def test_deflection_of_the_blades_and_way_to_the_tower() -> None:
    """The first blade points down and is bent, beside a tower that is bent, too; the second one points up."""
    bent = np.array([[[-2.0, -2.0], [-2.5, 0.0]], [[0.0, 1.0], [0.0, 0.5]], [[30.0, 58.0], [30.0, 60.0]]])
    rest = np.array([[[-2.0, -3.0], [-2.0, -3.0]], [[0.0, 0.0], [0.0, 0.0]], [[30.0, 60.0], [30.0, 60.0]]])
    two = {"blade": 2, "node": 2}
    m = turbine(
        motion=table(BladeMotion, two, position=bent), blade_nodes=table(BladeNode, two, position=rest),
        machine=Machine.of(hub_position=Vec(-4.0, 0.5, 92.0)),
        tower_flow=table(
            TowerFlow, {"node": 3}, height=(10.0, 50.0, 90.0), x=(0.0, 0.2, 0.6), y=(0.0, -0.1, 0.3), diameter=(6, 5, 4)
        ),
    )  # fmt: skip
    frame = table(BladeFrame, {"blade": 2})
    frame.orientation[0] = Rot(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0)
    frame.orientation[1] = Rot(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    m.frame, watch = frame, watch_of(state=at(BENDING, 0.7), last=at(BENDING, 4.0))
    plain(watch_kernels.watch_blades)(5.0, m, watch)
    first, second = np.hypot(1.0, 1.0), np.hypot(3.0, 0.5)
    assert watch.worst[DEFLECTION] == pytest.approx(second)
    mean = 0.5 * (first + second)
    assert watch.worst[BENDING] == watch.state[BENDING] == pytest.approx(0.7 + (mean - 0.7) * 1.0 / 10.0)
    # tip at (-6, -0.5, 34), the node inboard of it at (-6, 0.5, 62), that of the second blade above the tower
    tip, share = (-6.0, -0.5), (34.0 - 10.0) / 40.0
    inside = 0.5 * (6.0 - share) - np.hypot(tip[0] - 0.2 * share, tip[1] + 0.1 * share)
    assert watch.worst[TIP] == pytest.approx(inside)
    share = (62.0 - 50.0) / 40.0
    other = 0.5 * (5.0 - share) - np.hypot(-6.0 - 0.2 - 0.4 * share, 0.5 + 0.1 - 0.4 * share)
    assert watch.worst[TOWER] == pytest.approx(max(inside, other))


def test_an_edgewise_vibration_that_grows_from_interval_to_interval() -> None:
    """Of second modes; mean squares of 2, 6, 18: the speed grows by sqrt(3) twice."""
    watch = watch_of(place=at(EDGE, 1.0, -1.0), scale=at(EDGE, 2.0), before=at(EDGE, 2.0), earlier=at(EDGE, 3.0))
    m, found = turbine(np.zeros(9)), []
    for i in range(1, 13):
        square = 3.0 ** ((i - 1) // 4)
        m.v[6], m.v[8] = np.sqrt(0.25 * square), -np.sqrt(0.75 * square)
        plain(watch_kernels.watch_edges)(0.5 * i, m, watch)
        found.append(watch.worst[EDGE])
    assert found[:11] == [-np.inf] * 11
    assert found[11] == pytest.approx(np.sqrt(18.0))
    assert (watch.before[EDGE], watch.earlier[EDGE]) == pytest.approx((18.0, 6.0))
    assert (watch.state[EDGE], watch.since[EDGE], watch.last[EDGE]) == (0.0, 6.0, 6.0)


@pytest.mark.parametrize("growth", [(1.0, 2.2, 6.0), (1.0, 3.0, 6.6)])
def test_a_vibration_that_grows_less_is_none(growth: tuple[float, float, float]) -> None:
    watch = watch_of(place=at(EDGE, 1.0, -1.0), scale=at(EDGE, 1.0), before=at(EDGE, 2.0), earlier=at(EDGE, 3.0))
    m = turbine(np.zeros(9))
    for i, square in enumerate(growth):
        m.v[6] = np.sqrt(square)
        plain(watch_kernels.watch_edges)(1.0 + i, m, watch)
    assert watch.worst[EDGE] == -np.inf


def test_two_intervals_are_no_growth() -> None:
    start = View(Watch, validity.new_watch(meltemi.build(meltemi.load_turbine("nrel5mw"))))
    watch = watch_of(place=at(EDGE, 1.0, -1.0), scale=at(EDGE, 1.0), before=start["before"], earlier=start["earlier"])
    m, found = turbine(np.zeros(9)), []
    for i, square in enumerate((1.0, 3.0, 9.0)):
        m.v[6] = np.sqrt(square)
        plain(watch_kernels.watch_edges)(1.0 + i, m, watch)
        found.append(watch.worst[EDGE])
    assert found[:2] == [-np.inf, -np.inf] and found[2] == pytest.approx(np.sqrt(18.0))
