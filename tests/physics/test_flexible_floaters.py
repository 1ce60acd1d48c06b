"""A floating turbine with a flexible frame: the rigid limit, loads that pass from tower to frame, momentum, energy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import ModelOptions, SteadyWind, Turbine, load_turbine
from meltemi.analysis import natural_modes
from meltemi.compiler import View
from meltemi.floating.moving_base import Base, BaseColumns, TowerBody, TowerMomentum, base_row
from meltemi.simulation.case import Case
from meltemi.simulation.result import Result
from meltemi.simulation.vibrations import vacuum_case
from meltemi.structure.tables import BladeNode, StructureParameters
from meltemi.turbine.exchange import BladeFrame, BladeMotion, Machine
from meltemi.verification.energy import mechanical_energy

Float = NDArray[np.float64]

pytestmark = pytest.mark.long  # machine code that no shorter test needs; signs are those of test_frames_floats
MOTIONS = ("platform_surge", "platform_heave", "platform_pitch", "tower_base_moment_fore_aft")
SECTIONS = ("member_main_4_end_moment_y", "member_pontoon_A_start_moment_x")


def turbine_of(name: str, stiffness: float = 1.0) -> Turbine:
    turbine = load_turbine(name)
    assert isinstance(turbine, Turbine)
    if turbine.frame is None:
        return turbine
    sections = {
        key: each.replace(
            elastic_modulus=stiffness * each.elastic_modulus, shear_modulus=stiffness * each.shear_modulus
        )
        for key, each in turbine.frame.sections.items()
    }
    return turbine.replace(frame=turbine.frame.replace(sections=sections))


def run(name: str, stiffness: float = 1.0) -> Result:
    turbine = turbine_of(name, stiffness)
    channels = MOTIONS if turbine.frame is None else (*MOTIONS, *SECTIONS)
    wind = SteadyWind(speed=12.0, shear_exponent=0.14)
    sea = meltemi.environment.IrregularSea(height=3.0, period=9.0, seed=1)
    return meltemi.simulate(meltemi.build(turbine), wind, duration=40.0, sea=sea, channels=channels)


def test_a_stiff_frame_moves_as_a_rigid_platform_and_a_soft_one_bends() -> None:
    """Motions and base moment of a frame 10 000 times as stiff are those of the rigid platform within 0.1 %; the
    moment at the top of the main column is that of the tower's base on it, and the pontoon carries its share."""
    rigid, stiff, soft = run("iea15mw-volturnus"), *(run("iea15mw-volturnus-flexible", x) for x in (1e4, 1.0))
    for name in MOTIONS:
        a, b = (np.asarray(each[name]) for each in (rigid, stiff))
        assert np.sqrt(np.mean((a - b) ** 2)) < 1e-3 * np.abs(a).max()
    for each in (stiff, soft):
        base, top = (np.asarray(each[name]) for name in ("tower_base_moment_fore_aft", SECTIONS[0]))
        np.testing.assert_allclose(top, base, atol=2e-3 * base.max())
    pitch = [float(np.asarray(each["platform_pitch"])[-1000:].mean()) for each in (rigid, soft)]
    assert 1.01 < pitch[1] / pitch[0] < 1.06  # the tower leans on the soft frame, and its weight with it
    assert np.asarray(soft[SECTIONS[1]]).mean() == pytest.approx(4.5e7, rel=0.3)


def first_modes(name: str, stiffness: float = 1.0, modes: int = 2) -> dict[str, float]:
    """[Hz] frequencies of the platform's motions and the first modes of the tower, by name."""
    model = meltemi.build(turbine_of(name, stiffness), ModelOptions(fore_aft_modes=modes, side_side_modes=modes))
    wanted = ("base heave", "base pitch", "1st tower side-side", "1st tower fore-aft")
    return {each.name: each.frequency / (2.0 * np.pi) for each in natural_modes(model) if each.name in wanted}


def test_hull_of_the_iea_22_mw() -> None:
    """As stiff as 10 000 hulls its modes are those on the rigid platform; the hull of steel lowers the tower's."""
    rigid = first_modes("iea22mw-semi", modes=4)
    assert len(rigid) == 4
    assert first_modes("iea22mw-semi-flexible", 1e4) == pytest.approx(rigid, rel=2e-4)
    soft = first_modes("iea22mw-semi-flexible")
    assert soft["1st tower side-side"] == pytest.approx(0.267, rel=5e-3)
    assert soft["1st tower fore-aft"] == pytest.approx(0.275, rel=5e-3)


def free_turbine(name: str) -> Case:
    """A floating turbine without gravity, air, water, lines, damping and drive."""
    turbine = turbine_of(name)
    damping = {
        "platform.lines": (), "platform.members": (), "frame.damping": 0.0, "tower.damping": dict.fromkeys(
            ("fore_aft", "side_side", "torsion"), 0.0), "drivetrain.damping": 0.0, "yaw.damping": 0.0,
        "blade.structure.damping_time": dict.fromkeys(("flap", "edge", "torsion"), 0.0),
    }  # fmt: skip
    model = meltemi.build(turbine.replace(**damping)).with_parameters(**{"structure.gravity": 0.0})
    case = vacuum_case(model)
    for loads_of_water in ("float_matrices", "float_output", "float_waves", "frame_push", "frame_added"):
        case[loads_of_water][:] = 0.0
    return case


def kept(case: Case) -> tuple[Float, Float, Float, float]:
    """Momentum (3,), angular momentum (3,) about the origin, first moment (3,) of all masses, energy."""
    kinetic, elastic, _ = mechanical_energy(case)
    model, q, v, first = case.model, case["q"], case["v"], base_row(case.system)
    core, modes = case["core_mass"], v[model.n_core :].reshape(model.n_blades, -1)
    core = np.tril(core) + np.tril(core, -1).T
    momenta = (core @ v[: model.n_core] + np.einsum("bkj,bk->j", case["coupling"], modes))[first : first + 6]
    base, columns = View(Base, case["base"]), View(BaseColumns, case["base_columns"])
    P, at, R = momenta[:3], np.asarray(base["position"]), base["orientation"].reshape(3, 3)
    L = np.linalg.solve(columns["angular"][:, 3:].T, momenta[3:]) + np.cross(at, P)
    # the first moment is by places of masses
    machine, p = View(Machine, case["machine"]), View(StructureParameters, model.structure)
    moment = float(p["nacelle_mass"]) * (
        machine["top_position"] + machine["nacelle"].reshape(3, 3) @ p["nacelle_centre"]
    )
    moment += float(p["hub_mass"]) * (machine["hub_position"] + float(p["hub_centre"]) * machine["shaft"])
    nodes, motion = View(BladeNode, model.rotor.blade_nodes), View(BladeMotion, case["motion"])
    for b in range(model.n_blades):
        sections = motion["orientation"][:, b].reshape(3, 3, -1)
        inside = nodes["mass"][b] * motion["position"][:, b] + np.einsum("ijn,jn->in", sections, nodes["moment"][:, b])
        frame = View(BladeFrame, case["frame"])["orientation"][:, b].reshape(3, 3)
        moment += nodes["mass"][b].sum() * machine["hub_position"] + frame @ inside.sum(axis=1)
    body, platform = View(TowerBody, case["tower_body"]), load_turbine(model.turbine.name).platform
    below = body["moment"] + View(TowerMomentum, case["tower_momentum"])["linear"] @ q[:first]
    below = below + platform.mass * (platform.centre - [0.0, 0.0, float(p["tower_base"])])
    moment += (float(body["mass"]) + platform.mass) * at + R @ below
    return P, L, moment, kinetic + elastic


RATES = {
    "base surge": 0.5, "base sway": -0.3, "base heave": 0.2, "base roll": 0.01, "base pitch": -0.02, "base yaw": 0.015,
    "generator": 0.5,
}  # fmt: skip
PLACES = {
    "tower 1st fore-aft": 0.5, "tower 1st side-side": -0.4, "blade 1 1st flap": 2.0, "base pitch": 0.05,
    "base yaw": 0.1,
}  # fmt: skip


def free_flight(case: Case, size: float, duration: float = 5.0, dt: float = 0.005) -> tuple[Float, ...]:
    """Series of what :func:`kept` has, after a start with the places and rates above times ``size``, by Runge-Kutta."""
    names, q, v, series = case.model.coordinates, case["q"], case["v"], []
    for values, start in ((q, PLACES), (v, RATES)):
        values[:] = [size * start.get(name, 0.0) for name in names]
    y = np.stack([q, v])

    def rate(y: Float) -> Float:
        q[:], v[:] = y
        case.evaluate(0.0)
        return np.stack([y[1], case["a"]])

    for n in range(round(duration / dt) + 1):
        if n % 20 == 0:
            q[:], v[:] = y
            series.append(kept(case))
        one = rate(y)
        two = rate(y + 0.5 * dt * one)
        three = rate(y + 0.5 * dt * two)
        y = y + dt / 6.0 * (one + 2.0 * (two + three) + rate(y + dt * three))
    return tuple(np.array(each) for each in zip(*series, strict=True))


def test_momentum_and_energy_are_kept_in_free_flight() -> None:
    """Nothing acts on the turbine: its momentum stays as it is, and the centre of all masses moves with it; errors of
    angular momentum and energy shrink with the motion, for kinematics of the modes are of second order."""
    case = free_turbine("iea15mw-volturnus-flexible")
    for size in (1.0, 0.01):
        P, L, moment, energy = free_flight(case, size)
        time, speed = np.linspace(0.0, 5.0, len(P))[:, None], float(np.linalg.norm(P[0]))
        assert np.abs(P - P[0]).max() < 1e-9 * speed
        assert np.abs(moment - moment[0] - time * P[0]).max() < 1e-9 * 5.0 * speed
        assert np.abs(L - L[0]).max() < 5e-4 * size * np.linalg.norm(L[0])
        assert np.ptp(energy) < 1e-4 * size * energy[0]
