"""Gearbox: records and their rules, sizing, the torsional chain and its reduction, the implicit step of its modes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import InputError, ModelOptions, Turbine
from meltemi.core.yamlfile import validated
from meltemi.structure.gear_train import gear_train, reduced
from meltemi.structure.gears import implicit_step
from meltemi.turbine import Gearbox, ParallelStage, PlanetaryStage, size_gearbox
from meltemi.turbine.definition import Drivetrain
from meltemi.turbine.library import load_turbine, write_turbine

Float = NDArray[np.float64]
ROTOR = 3.9e7
"""[kg m^2] about the inertia of the NREL 5 MW's rotor."""
STAGE = PlanetaryStage(
    planets=3,
    ratio=5.0,
    sun_radius=0.3,
    carrier_inertia=3000.0,
    planet_mass=2000.0,
    planet_inertia=150.0,
    sun_inertia=80.0,
    sun_mesh=8e9,
    ring_mesh=9e9,
    shaft_stiffness=1.5e8,
)


def drivetrain(gearbox: Gearbox, **changes: Any) -> Drivetrain:
    given = {"gear_ratio": gearbox.ratio, "generator_inertia": 534.116, "stiffness": 867637000.0, "damping": 0.0}
    return Drivetrain.model_validate({**given, "gearbox": gearbox.content(), **changes})


def one_stage(**changes: Any) -> Drivetrain:
    return drivetrain(Gearbox(planetary=(STAGE.replace(**changes),)), stiffness=5e8)


ELASTIC_RING = {"ring_stiffness": 3e9, "ring_inertia": 4000.0}
TRAINS: dict[str, Drivetrain] = {
    "one stage": one_stage(),
    "elastic ring": one_stage(**ELASTIC_RING),
    "38.1": drivetrain(size_gearbox(ratio=38.1, rated_torque=1.6e6), stiffness=5e8),
    "97": drivetrain(size_gearbox(ratio=97.0, rated_torque=4.18e6)),
}


# sizing -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("ratio", "planetary", "parallel"), [(5.0, 1, False), (38.1, 2, False), (40.49, 2, False), (97.0, 2, True)]
)
def test_sized_stages_have_the_ratio(ratio: float, planetary: int, parallel: bool) -> None:
    gearbox = size_gearbox(ratio=ratio, rated_torque=2e6)
    assert gearbox.ratio == pytest.approx(ratio, rel=1e-12)
    assert (len(gearbox.planetary), gearbox.parallel is not None) == (planetary, parallel)
    for s in gearbox.planetary:  # planets have room beside each other
        assert s.orbit_radius * math.sin(math.pi / s.planets) > s.planet_radius


def test_gears_carry_the_torque_at_the_allowable_pressure() -> None:
    """The pressure of ISO 6336-2, written out, of the sun with its planets is the allowable one."""
    torque = 2e6
    (stage,) = size_gearbox(ratio=5.0, rated_torque=torque).planetary
    d, width, u = 2.0 * stage.sun_radius, 2.0 * stage.sun_radius, stage.planet_radius / stage.sun_radius
    force = 1.25 * torque / 5.0 / (4 * stage.sun_radius)  # four planets, of which one has 1.25 of its share
    assert stage.planets == 4
    nominal = 2.4 * 189.8e3 * 0.85 * math.sqrt(force / (d * width) * (u + 1.0) / u)
    assert nominal * math.sqrt(1.3 * 1.2) == pytest.approx(1500e6 * 0.9 / 1.25, rel=1e-9)
    assert stage.sun_mesh == pytest.approx(20e9 * width * math.cos(math.radians(20.0)) ** 2)


def test_a_gearbox_for_eight_times_the_torque_is_twice_as_large() -> None:
    small, large = (size_gearbox(ratio=97.0, rated_torque=torque) for torque in (1e6, 8e6))
    for a, b in zip(small.planetary, large.planetary, strict=True):
        assert b.sun_radius == pytest.approx(2.0 * a.sun_radius)
        assert b.planet_mass == pytest.approx(8.0 * a.planet_mass)
        assert b.planet_inertia == pytest.approx(32.0 * a.planet_inertia)
        assert b.sun_mesh == pytest.approx(2.0 * a.sun_mesh)
        assert b.shaft_stiffness == pytest.approx(8.0 * a.shaft_stiffness)


def test_sizing_against_the_reference_gearbox() -> None:
    """Nejad, Guo, Gao & Moan (2016), Wind Energy 19, table V: pitch diameters and face widths of the 5 MW.

    Our gears have one and the same small safety, theirs have more in the faster stages: the volumes d^2 b of sun and
    pinion are 0.5 to 0.9 of theirs for as many planets.
    """
    gearbox = size_gearbox(ratio=96.354, rated_torque=4.18e6, planetary=(3.947, 6.167), parallel=3.958)
    assert gearbox.parallel is not None
    radii = [*(s.sun_radius for s in gearbox.planetary), gearbox.parallel.pinion_radius]
    # volumes for three planets: load per mesh and its factor against those of the number that was chosen
    few = [1.1 / 3 / {3: 1.1 / 3, 4: 1.25 / 4, 5: 1.35 / 5}[s.planets] for s in gearbox.planetary] + [1.0]
    volume = np.array([(2.0 * r) ** 3 for r in radii]) * few
    theirs = np.array([0.855**2 * 0.491, 0.378**2 * 0.550, 0.341183**2 * 0.360])
    assert np.all(volume / theirs > 0.45)
    assert np.all(volume / theirs < 1.0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"ratio": 1.0, "rated_torque": 1e6}, "ratio must be greater than 3, found 1.0; a direct drive has no gearbox"),
        ({"ratio": float("nan"), "rated_torque": 1e6}, "ratio must be greater than 3"),
        ({"ratio": 40.0, "rated_torque": 0.0}, "rated_torque must be positive, found 0.0"),
        ({"ratio": 40.0, "rated_torque": 1e6, "width_ratio": -1.0}, "width_ratio must be positive"),
        ({"ratio": 40.0, "rated_torque": 1e6, "planetary": (5.0, 6.0)}, "stages of 5 x 6 do not make a ratio of 40"),
        ({"ratio": 40.0, "rated_torque": 1e6, "planetary": (2.0, 20.0)}, "planetary stages above 2.5"),
    ],
)
def test_what_cannot_be_sized_is_refused(arguments: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        size_gearbox(**arguments)


# records ------------------------------------------------------------------------------------------------


def refused(turbine: Turbine, changes: dict[str, Any]) -> str:
    content = turbine.content()
    content["drivetrain"]["gearbox"] = size_gearbox(ratio=97.0, rated_torque=4.18e6).content()
    for path, value in changes.items():
        target: Any = content["drivetrain"]
        *parts, last = path.split(".")
        for part in parts:
            target = target[int(part) if part.isdigit() else part]
        target[last] = value
    with pytest.raises(InputError) as caught:
        validated(content, Turbine, "t.yaml")
    return str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gear_ratio": 90.0}, "the gearbox has the ratio 4.9244 x 4.9244 x 4 = 97, but gear_ratio is 90"),
        ({"stiffness": 1e10}, "must be less than that of its gearbox, 2.943e+09 N m/rad referred to the rotor"),
        ({"gearbox.planetary": []}, "gearbox.planetary: "),
        ({"gearbox.planetary.1.ratio": 2.0}, "gearbox.planetary.1.ratio: expected greater than 2, found 2"),
        ({"gearbox.planetary.0.ring_inertia": 5.0}, "give both ring_stiffness and ring_inertia, or neither"),
        ({"gearbox.planetary.0.planetss": 5}, "gearbox.planetary.0.planetss: unknown key; did you mean 'planets' or"),
        ({"gearbox.damping_ratio": 0.9}, "gearbox.damping_ratio: expected less than or equal to 0.3"),
        ({"gearbox.parallel.mesh": 0.0}, "gearbox.parallel.mesh: expected greater than 0"),
    ],
)
def test_rules_of_the_records(turbine: Turbine, changes: dict[str, Any], message: str) -> None:
    assert message in refused(turbine, changes)


def test_a_gearbox_survives_a_file(turbine: Turbine, tmp_path: Any) -> None:
    geared = turbine.replace(**{"drivetrain.gearbox": size_gearbox(ratio=97.0, rated_torque=4.18e6)})
    write_turbine(geared, tmp_path / "geared.yaml")
    again = load_turbine(tmp_path / "geared.yaml")
    assert again == geared
    assert isinstance(again.drivetrain.gearbox, Gearbox)
    assert isinstance(again.drivetrain.gearbox.parallel, ParallelStage)


def test_without_a_gearbox_the_option_says_what_to_do(turbine: Turbine) -> None:
    with pytest.raises(InputError, match=r"needs drivetrain\.gearbox; size_gearbox\(ratio=97, rated_torque=4\.\d+e"):
        meltemi.build(turbine, ModelOptions(drivetrain="multibody"))
    direct = turbine.replace(**{"drivetrain.gear_ratio": 1.0})
    with pytest.raises(InputError, match=r"needs drivetrain\.gearbox$"):
        meltemi.build(direct, ModelOptions(drivetrain="quasi_static"))


# chain --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("what", TRAINS)
def test_rigid_motion_strains_nothing_and_follows_willis(what: str) -> None:
    d = TRAINS[what]
    train = gear_train(d)
    assert np.abs(train.deflection @ train.speed).max() < 1e-12
    speed = dict(zip(train.bodies, train.speed, strict=True))
    assert d.gearbox is not None
    for n, s in enumerate(d.gearbox.planetary, 1):
        carrier, sun, planet = (speed[f"{body} {n}"] for body in ("carrier", "sun", "planets"))
        # Willis (1841): seen from the carrier all wheels turn about fixed axes; the ring stands
        assert (sun - carrier) / (0.0 - carrier) == pytest.approx(-s.ring_radius / s.sun_radius)
        assert (planet - carrier) / (sun - carrier) == pytest.approx(-s.sun_radius / s.planet_radius)
    assert abs(train.speed[-1]) == pytest.approx(d.gear_ratio)
    assert np.sign(train.speed[-1]) == d.gearbox.sense


def lumped_chain(d: Drivetrain, rotor: float) -> tuple[Float, Float]:
    """Mass and stiffness of the whole drivetrain from its energies, all angles seen from the rotor.

    Written without the module: stage by stage from carrier to sun, with referred springs, as text books have chains of
    discs. A planet leaves the plain chain by its own freedom to roll: x = r_p times its spin over that of rolling on
    the ring at the carrier's speed.
    """
    assert d.gearbox is not None
    inertia, springs = [rotor], []
    speed, last, stiffness = 1.0, 0, d.main_shaft_stiffness
    for s in d.gearbox.planetary:
        a, r_p, r_s, r_r = 0.5 * s.ratio * s.sun_radius, s.planet_radius, s.sun_radius, s.ring_radius
        c, p, sun = len(inertia), len(inertia) + 1, len(inertia) + 2
        springs.append(({last: 1.0, c: -1.0}, stiffness * 1.0))
        inertia += [
            (s.carrier_inertia + s.planets * s.planet_mass * a * a) * speed**2,
            s.planets * s.planet_inertia * (speed * a / r_p) ** 2,
            s.sun_inertia * (speed * s.ratio) ** 2,
        ]
        # pitch point at the sun: half of its speed is the carrier's, half the planet's; at the ring they cancel
        springs.append(({c: 1.0, p: 1.0, sun: -2.0}, s.planets * s.sun_mesh * (speed * a) ** 2))
        ring: dict[int, float] = {c: 1.0, p: -1.0}
        if s.ring_stiffness is not None and s.ring_inertia is not None:
            inertia.append(s.ring_inertia)
            ring[sun + 1] = -r_r / (speed * a)
            springs.append(({sun + 1: 1.0}, s.ring_stiffness))
        springs.append((ring, s.planets * s.ring_mesh * (speed * a) ** 2))
        assert r_s * s.ratio == pytest.approx(2.0 * a)
        speed *= s.ratio
        last, stiffness = sun, s.shaft_stiffness * speed**2
    if (g := d.gearbox.parallel) is not None:
        w, p = len(inertia), len(inertia) + 1
        springs.append(({last: 1.0, w: -1.0}, stiffness))
        inertia += [g.wheel_inertia * speed**2, g.pinion_inertia * (speed * g.ratio) ** 2]
        springs.append(({w: 1.0, p: -1.0}, g.mesh * (g.ratio * g.pinion_radius * speed) ** 2))
        speed *= g.ratio
        last, stiffness = p, g.shaft_stiffness * speed**2
    springs.append(({last: 1.0, len(inertia): -1.0}, stiffness))
    inertia.append(d.generator_inertia * speed**2)
    K = np.zeros((len(inertia), len(inertia)))
    for arms, k in springs:
        row = np.zeros(len(inertia))
        row[list(arms)] = list(arms.values())
        K += k * np.outer(row, row)
    return np.diag(inertia), K


def frequencies(M: Float, K: Float) -> Float:
    """[rad/s] of all modes."""
    root = 1.0 / np.sqrt(np.diag(M))
    return np.sqrt(np.abs(np.linalg.eigvalsh(K * np.outer(root, root))))


def reduced_matrices(d: Drivetrain, rotor: float, modes: int | None = None) -> tuple[Float, Float]:
    """The same as mass and stiffness of generator, torsion and modes."""
    r = reduced(gear_train(d))
    k = len(r.frequency) if modes is None else modes
    M, K = np.diag(np.full(2 + k, r.modal_inertia)), np.zeros((2 + k, 2 + k))
    M[:2, :2] = r.inertia[1:, 1:] + rotor
    M[0, 0] += d.generator_inertia * d.gear_ratio**2
    M[:2, 2:], M[2:, :2] = r.coupling[1:, :k], r.coupling[1:, :k].T
    K[1, 1] = d.stiffness
    K[2:, 2:] = np.diag(r.modal_inertia * r.frequency[:k] ** 2)
    return M, K


@pytest.mark.parametrize("what", TRAINS)
def test_frequencies_are_those_of_the_lumped_chain(what: str) -> None:
    d = TRAINS[what]
    M, K = lumped_chain(d, ROTOR)
    R, S = reduced_matrices(d, ROTOR)
    free = np.sort(np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(R, S)))))
    expected = frequencies(M, K)
    assert len(free) == len(expected)
    assert free[0] < 1e-2  # turns as one
    np.testing.assert_allclose(free[1:], expected[1:], rtol=1e-8)
    # rotor free, generator held; both held
    fixed = np.sort(np.sqrt(np.linalg.eigvals(np.linalg.solve(R[1:, 1:], S[1:, 1:])).real))
    np.testing.assert_allclose(fixed, frequencies(M[:-1, :-1], K[:-1, :-1]), rtol=1e-8)
    held = reduced(gear_train(d)).frequency
    np.testing.assert_allclose(held, frequencies(M[1:-1, 1:-1], K[1:-1, 1:-1]), rtol=1e-8)


@pytest.mark.parametrize("what", TRAINS)
def test_static_gears_keep_the_first_mode(what: str) -> None:
    d = TRAINS[what]
    static = np.linalg.eigvals(np.linalg.solve(*reduced_matrices(d, ROTOR, 0))).real
    first = frequencies(*lumped_chain(d, ROTOR))[1]
    # Rayleigh: from above, by the square of its frequency over that of the gears, times their share in the inertia
    error = math.sqrt(static.max()) / first - 1.0
    assert 0.0 < error < 0.05
    # two masses without the gears are above, too
    two = math.sqrt(d.stiffness * (1.0 / ROTOR + 1.0 / (d.generator_inertia * d.gear_ratio**2)))
    assert first < two
    if d.gear_ratio > 30.0:
        assert error < 1e-4
        assert first == pytest.approx(two, rel=0.06)


def test_three_masses_in_closed_form() -> None:
    """With stiff meshes a stage is one disc between two shafts: J1 w^4 ... of text books (Den Hartog)."""
    d = one_stage(sun_mesh=1e15, ring_mesh=1e15)
    inertia = np.diag(lumped_chain(d, ROTOR)[0])
    J1, J2, J3 = ROTOR, inertia[1:-1].sum(), inertia[-1]
    k1, k2 = d.main_shaft_stiffness, STAGE.shaft_stiffness * STAGE.ratio**2
    b = k1 * (J1 + J2) / (J1 * J2) + k2 * (J2 + J3) / (J2 * J3)
    c = k1 * k2 * (J1 + J2 + J3) / (J1 * J2 * J3)
    expected = [math.sqrt(0.5 * (b + sign * math.sqrt(b * b - 4.0 * c))) for sign in (-1.0, 1.0)]
    M, K = reduced_matrices(d, ROTOR)
    found = np.sort(np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(M, K)))))
    np.testing.assert_allclose(found[1:3], expected, rtol=1e-5)


def test_a_planet_between_held_wheels_in_closed_form() -> None:
    """Heavy carrier and sun stand still: w^2 = r_p^2 (k_sun + k_ring) / J_planet."""
    d = one_stage(carrier_inertia=1e15, sun_inertia=1e15)
    expected = STAGE.planet_radius * math.sqrt((STAGE.sun_mesh + STAGE.ring_mesh) / STAGE.planet_inertia)
    assert reduced(gear_train(d)).frequency[-1] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("what", TRAINS)
def test_static_loads_follow_the_ratios(what: str) -> None:
    d = TRAINS[what]
    train = gear_train(d)
    factor = dict(zip(train.springs, reduced(train).factor, strict=True))
    assert d.gearbox is not None
    assert factor["main shaft"] == pytest.approx(1.0)
    torque = 1.0
    for n, s in enumerate(d.gearbox.planetary, 1):
        torque /= s.ratio
        for mesh in ("sun", "ring"):
            assert factor[f"stage {n} {mesh}"] == pytest.approx(torque / (s.planets * s.sun_radius))
        assert factor[f"stage {n} shaft"] == pytest.approx(torque)
    if (p := d.gearbox.parallel) is not None:
        torque /= p.ratio
        assert factor["stage 3 mesh"] == pytest.approx(torque / p.pinion_radius)
        assert factor["stage 3 shaft"] == pytest.approx(torque)
    assert torque == pytest.approx(1.0 / d.gear_ratio)


def test_the_whole_is_as_stiff_as_stated() -> None:
    for d in TRAINS.values():
        K = gear_train(d).stiffness_matrix[:-1, :-1]  # generator held
        assert 1.0 / np.linalg.inv(K)[0, 0] == pytest.approx(d.stiffness, rel=1e-9)


def test_parts_that_follow_statically_load_like_their_inertia() -> None:
    """The main shaft drives everything behind it: its load from accelerations is the rotor's end's share of inertia."""
    for d in TRAINS.values():
        r = reduced(gear_train(d))
        np.testing.assert_allclose(r.static_loads[0], r.inertia[2], rtol=1e-8)


# implicit step ------------------------------------------------------------------------------------------


def amplification(x: float, z: float) -> Float:
    """(2, 2) of amplitude and rate times step, over a step of a mode that nothing pushes."""
    beta, gamma = implicit_step(x, z)
    columns = []
    for angle, rate in ((1.0, 0.0), (0.0, 1.0)):
        now = -2.0 * z * x * rate - x * x * angle
        angle, rate = angle + rate + (0.5 - beta) * now, rate + (1.0 - gamma) * now
        new = -(2.0 * z * x * rate + x * x * angle) / (1.0 + 2.0 * z * x * gamma + x * x * beta)
        columns.append((angle + beta * new, rate + gamma * new))
    return np.array(columns).T


@pytest.mark.parametrize("z", [0.0, 0.01, 0.05, 0.2])
@pytest.mark.parametrize("x", [0.02, 0.3, 2.0, 9.0, 60.0])
def test_a_mode_decays_as_it_should_whatever_the_step(x: float, z: float) -> None:
    exact = math.exp(-z * x)
    found = math.sqrt(abs(np.linalg.det(amplification(x, z))))
    if exact > 0.2:
        assert found == pytest.approx(exact, rel=1e-6)
    else:  # gone within a step or two
        assert found < 0.35


def test_the_frequency_of_a_mode_converges_with_the_square_of_the_step() -> None:
    errors = []
    for x in (0.4, 0.2, 0.1, 0.05):
        value = np.log(np.linalg.eigvals(amplification(x, 0.05)).astype(complex)) / x
        errors.append(abs(abs(value[0]) - 1.0))
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(order > 1.8), order
    assert errors[-1] < 5e-4


def coupled_radius(x: float, z: float, share: float, stiff: float) -> float:
    """Spectral radius of explicit Newmark steps of a spring with a mass, on which a mode of share ``share`` rides."""
    beta, gamma = implicit_step(x, z)
    resistance = 1.0 + 2.0 * z * x * gamma + x * x * beta
    columns = []
    for unit in np.eye(6):
        q, v, a, angle, rate, acceleration = unit
        q, v = q + v + 0.5 * a, v + 0.5 * a
        angle, rate = angle + rate + (0.5 - beta) * acceleration, rate + (1.0 - gamma) * acceleration
        own = -2.0 * z * x * rate - x * x * angle
        p = math.sqrt(share)
        a = (-(stiff**2) * q - p * own / resistance) / (1.0 - share / resistance)
        acceleration = (own - p * a) / resistance
        columns.append((q, v + 0.5 * a, a, angle + beta * acceleration, rate + gamma * acceleration, acceleration))
    return float(np.abs(np.linalg.eigvals(np.array(columns).T)).max())


@pytest.mark.parametrize("z", [0.0, 0.01, 0.05, 0.2])
def test_modes_never_destabilise_the_step(z: float) -> None:
    """However stiff a mode, and with up to half of the inertia; sized gearboxes have shares of 0.02."""
    worst = max(
        coupled_radius(x, z, share, stiff)
        for x in np.geomspace(0.05, 300.0, 60)
        for share in (0.001, 0.02, 0.2, 0.5)
        for stiff in (0.01, 0.1, 0.4)
    )
    assert worst < 1.0 + 1e-9
