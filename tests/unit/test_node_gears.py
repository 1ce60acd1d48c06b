"""Kernels of drivetrain, gearbox and yaw bearing, in plain Python; a gearbox against its equations in one matrix."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from plain import plain, record, table

from meltemi.compiler import Sym, Vec
from meltemi.structure import gears
from meltemi.structure.nacelle import yaw_bearing
from meltemi.structure.shaft import drivetrain
from meltemi.structure.tables import (
    ApexColumns,
    GearLoads,
    GearModes,
    GearRows,
    Gears,
    SectionLoads,
    Structure,
    StructureParameters,
    TopShape,
)
from meltemi.turbine.exchange import Drive, Machine

Float = NDArray[np.float64]
J = np.array([[90.0, 20.0, 10.0], [20.0, 70.0, 15.0], [10.0, 15.0, 80.0]])
"""[kg m^2] of nacelle rotation, generator and torsion."""
P = np.array([[4.0, 7.0], [-6.0, 3.0], [5.0, 2.0]])
"""[kg m^2] coupling of two modes to them."""
W, Z, INERTIA = np.array([3.0, 5.0]), np.array([0.05, 0.02]), np.array([8.0, 11.0])
ANGLE, RATE = np.array([0.3, -0.2]), np.array([0.4, 0.7])
SHAFT, SPIN, SPIN_RATE = np.array([0.8, 0.0, 0.6]), np.array([0.3, -0.5, 0.2]), np.array([0.7, 0.1, -0.4])
ANGULAR = np.array([[0.2, 0.5, -0.1], [-0.3, 0.1, 0.4], [0.1, 0.2, 0.9]])
"""Of two modes of the tower and the yaw bearing; generator and torsion come behind."""
SPEEDS = np.array([0.05, -0.1, 0.02, 1.2, 0.03])


def machine(coupling: Float = P, **changes: Any) -> Any:
    members = {
        "v": SPEEDS.copy(), "a": np.zeros(5), "top_shape": table(TopShape, {"mode": 2}),
        "structure": StructureParameters.of(
            gears=Sym(J[0, 0], J[1, 1], J[2, 2], J[0, 1], J[0, 2], J[1, 2]), shaft_stiffness=600.0, shaft_damping=7.0
        ),
        "gear_modes": table(GearModes, {"mode": 2}, frequency=W, damping=Z, inertia=INERTIA, coupling=coupling),
        "gears": table(Gears, {"mode": 2}, angle=ANGLE, rate=RATE),
        "machine": Machine.of(shaft=Vec(*SHAFT), nacelle_spin=Vec(*SPIN), nacelle_spin_rate=Vec(*SPIN_RATE)),
        "columns": table(ApexColumns, {"coordinate": 5}, angular=np.pad(ANGULAR.T, ((0, 0), (0, 2)))),
        "core_mass": np.zeros((5, 5)), "core_force": np.zeros(5),
    }  # fmt: skip
    return record(Structure, **(members | changes))


@pytest.mark.parametrize("dt", [0.0, 0.1])
def test_accelerations_are_those_of_the_equations_with_all_modes(dt: float) -> None:
    rng = np.random.default_rng(1)
    root = rng.normal(size=(5, 5))
    mass, force = 100.0 * root @ root.T, rng.normal(size=5)
    m = machine(core_mass=np.tril(mass), core_force=force.copy())
    plain(gears.gear_equations)(dt, m)
    lower = np.tril(m.core_mass)
    assert np.array_equal(lower, m.core_mass)
    found = np.linalg.solve(lower + np.tril(lower, -1).T, m.core_force)
    m.a = found
    plain(gears.gear_accelerations)(dt, m)

    speeds = np.zeros((3, 5))  # nacelle rotation about the shaft, generator, torsion by the coordinates
    speeds[0, :3], speeds[1, 3], speeds[2, 4] = ANGULAR @ SHAFT, 1.0, 1.0
    known = np.array([SPIN_RATE @ SHAFT, 0.0, 0.0])
    momentum = J[0] @ [SPIN @ SHAFT, *SPEEDS[3:]] + P[0] @ RATE
    whirl = np.append(ANGULAR @ np.cross(SPIN, SHAFT), [0.0, 0.0])
    own = -W * (2.0 * Z * RATE + W * ANGLE)
    steps = np.array([plain(gears.implicit_step)(w * dt, z) for w, z in zip(W, Z, strict=True)]) if dt else [[0, 0]]
    beta, gamma = np.transpose(steps)
    resistance = 1.0 + 2.0 * Z * W * gamma * dt + W**2 * beta * dt**2
    whole = np.block([[mass + speeds.T @ J @ speeds, speeds.T @ P], [P.T @ speeds, np.diag(INERTIA * resistance)]])
    right = np.append(force - speeds.T @ J @ known - momentum * whirl, INERTIA * own - P.T @ known)
    expected = np.linalg.solve(whole, right)
    assert found == pytest.approx(expected[:5], rel=1e-10)
    assert np.array([*m.gears.acceleration]) == pytest.approx(expected[5:], rel=1e-10)


def test_without_gears_the_equations_stay() -> None:
    m = machine(structure=StructureParameters.of())
    plain(gears.gear_equations)(0.1, m)
    assert not m.core_mass.any()
    assert not m.core_force.any()


def test_momentum_and_its_rate_are_of_the_first_row() -> None:
    m, rates = machine(), np.array([0.5, -0.7])
    m.gears.acceleration[0], m.gears.acceleration[1] = rates
    found = plain(gears.gear_momentum)(m, Vec(0.1, 1.2, 0.03), Vec(0.4, -0.2, 0.6))
    assert found[0] == pytest.approx(J[0] @ [0.1, 1.2, 0.03] + P[0] @ RATE)
    assert found[1] == pytest.approx(J[0] @ [0.4, -0.2, 0.6] + P[0] @ rates)


def test_loads_are_static_quasi_static_and_of_the_modes() -> None:
    """(S-57), of two parts."""
    factor, inertia, shape = (
        np.array([0.7, -0.3]),
        np.array([[3.0, 2.0], [5.0, -4.0], [1.0, 6.0]]),
        np.array([[20.0, 30.0], [-50.0, 10.0]]),
    )
    rows = table(GearRows, {"part": 2}, factor=factor, inertia=inertia)
    s = record(SectionLoads, gear_rows=rows, gear_shape=shape, gear_loads=table(GearLoads, {"part": 2}))
    plain(gears.gear_loads)(machine(), s, 0.02, -0.4, Vec(0.3, 0.6, -0.9))
    static = 600.0 * 0.02 - 7.0 * 0.4
    expected = factor * static + inertia.T @ [0.3, 0.6, -0.9] + shape @ (ANGLE + 2.0 * Z / W * RATE)
    assert np.array([*s.gear_loads.load]) == pytest.approx(expected)


@pytest.mark.parametrize("dt", [0.01, 0.3])
def test_free_vibration_decays_as_it_should_whatever_the_step(dt: float) -> None:
    """The determinant of a step is exp(-2 zeta omega dt) (M-32)."""
    after = []
    for start in ((1.0, 0.0), (0.0, 1.0)):
        m = machine(coupling=np.zeros((3, 2)), machine=Machine.of(shaft=Vec(1.0, 0.0, 0.0)))
        m.gears = table(Gears, {"mode": 2}, angle=start[0], rate=start[1])
        plain(gears.gear_accelerations)(0.0, m)
        plain(gears.gear_begin)(dt, m)
        plain(gears.gear_accelerations)(dt, m)
        plain(gears.gear_end)(dt, m)
        after.append([np.array([*m.gears.angle]), np.array([*m.gears.rate])])
    (a, b), (c, d) = after
    assert a * d - b * c == pytest.approx(np.exp(-2.0 * Z * W * dt), rel=1e-9)
    step = 0.5 * (a + d) / np.sqrt(a * d - b * c)
    assert step == pytest.approx(np.cos(np.sqrt(1.0 - Z**2) * W * dt), abs=0.1 * (W * dt).max() ** 3 + 1e-9)


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("torque", [4e4, -4e4])
def test_generator_shaft_and_brake(torque: float, sense: float) -> None:
    """(S-37 to S-39): losses reduce a driving torque and add to a motoring one."""
    ratio, inertia, efficiency = 90.0, 500.0, 0.96
    structure = StructureParameters.of(
        gear_ratio=ratio, generator_inertia=inertia, generator_sense=sense, gearbox_efficiency=efficiency,
        shaft_stiffness=600.0, shaft_damping=7.0,
    )  # fmt: skip
    drive = Drive.of(generator_torque=torque, brake_torque=9e3, brake_speed=20.0)
    m = machine(structure=structure, drive=drive, q=np.array([0.0, 0.0, 0.1, 2.0, 0.02]))
    plain(drivetrain)(m)
    along = ANGULAR @ SHAFT
    mass = inertia * np.outer(along, along)
    assert np.tril(m.core_mass[:3, :3]) == pytest.approx(np.tril(mass))
    assert m.core_mass[3, :3] == pytest.approx(inertia * sense * ratio * along)
    assert m.core_mass[3, 3] == pytest.approx(inertia * ratio**2 / efficiency)
    assert not m.core_mass[4].any()
    spin = SPIN @ SHAFT + sense * ratio * SPEEDS[3]
    known = inertia * ((SPIN_RATE @ SHAFT) * SHAFT + spin * np.cross(SPIN, SHAFT))
    held = torque + 9e3 * np.tanh(ratio * SPEEDS[3] / 20.0)
    held *= 1.0 / efficiency if held > 0.0 else efficiency
    assert m.core_force[:3] == pytest.approx(-ANGULAR @ known)
    assert m.core_force[3] == pytest.approx(-ratio * held - sense * ratio * known @ SHAFT)
    assert m.core_force[4] == pytest.approx(-600.0 * 0.02 - 7.0 * SPEEDS[4])


@pytest.mark.parametrize(("holds", "rubs"), [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])
def test_yaw_bearing(holds: float, rubs: float) -> None:
    """(S-40)"""
    drive = Drive.of(
        yaw_held=holds, yaw_rubs=rubs, yaw_command=0.02, yaw_command_rate=0.003, yaw_rest=0.05, yaw_rest_rate=-0.01
    )
    structure = StructureParameters.of(yaw_stiffness=8e6, yaw_damping=3e5)
    m = machine(structure=structure, drive=drive, q=np.array([0.0, 0.0, 0.1, 2.0, 0.02]))
    plain(yaw_bearing)(m)
    held = holds * (8e6 * (0.1 - 0.02) + 3e5 * (SPEEDS[2] - 0.003))
    rubbed = rubs * (8e6 * (0.1 - 0.05) + 3e5 * (SPEEDS[2] + 0.01))
    assert (m.drive.yaw_drive_torque, m.drive.yaw_friction_torque) == pytest.approx((-held, -rubbed))
    assert m.core_force == pytest.approx([0.0, 0.0, -held - rubbed, 0.0, 0.0])
