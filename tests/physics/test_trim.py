"""A run starts in steady operation: nothing has to be thrown away."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Model, ModelOptions, SteadyWind, Turbine, operating_point, simulate
from meltemi.analyses.continuation import CarefulOrbit, balance_carefully
from meltemi.analyses.controlled_point import controlled_point
from meltemi.control import BaselineController
from meltemi.postprocess.statistics import means_over_revolutions
from meltemi.simulation import points, rotors, trim
from meltemi.simulation.operating_point import NotConverged
from meltemi.simulation.orbit import SAMPLES, Orbit

OWN = (
    "generator_power rotor_speed rotor_aero_thrust rotor_torque root_moment_in_plane_1 root_moment_out_of_plane_1 "
    "tip_out_of_plane_1 tip_in_plane_1 tower_base_moment_fore_aft"
).split()
"""Within 1 % of their own final value."""
ROOT = (
    "root_moment_torsion_1 root_moment_flap_1 root_moment_edge_1 shaft_tilt_moment shaft_yaw_moment shaft_moment_y "
    "shaft_moment_z yaw_moment_x yaw_moment_y yaw_moment_z"
).split()
"""Within 1 % of the mean out-of-plane root moment at rated wind."""
TOWER = ["tower_base_moment_torsion"]
"""Within 1 % of the mean fore-aft moment of the tower base at rated wind."""
SIDE = "tower_base_moment_side_side"


@pytest.mark.slow
@pytest.mark.parametrize("wind_speed", [5.0, 8.0, 11.0, 12.0, 18.0, 24.0])
def test_settled_from_the_second_revolution(model: Model, wind_speed: float) -> None:
    rated = operating_point(model, 11.4)
    root, tower = rated["RootMyc1"], rated["TwrBsMyt"]
    channels = ["azimuth", *OWN, *ROOT, *TOWER, SIDE]
    result = simulate(model, SteadyWind(speed=wind_speed), duration=150.0, channels=channels)
    for name in (*OWN, *ROOT, *TOWER):
        means, _ = means_over_revolutions(result.time, result["azimuth"], result[name])
        final = means[-5:].mean()
        scale = abs(final) if name in OWN else root if name in ROOT else tower
        assert np.max(np.abs(means[1:] - final)) < 0.01 * scale, name
    side = result[SIDE]
    period = round(1.0 / 0.31 / 0.05)
    first, last = (0.5 * np.ptp(part) for part in (side[: 3 * period], side[-3 * period :]))
    assert first < max(1.5 * last, 0.02 * tower)


@pytest.mark.parametrize(
    "wind", [SteadyWind(speed=10.0, shear_exponent=0.2), SteadyWind(speed=14.0, direction=0.35, upflow=0.1)]
)
def test_sheared_and_oblique_wind(model: Model, wind: SteadyWind) -> None:
    result = simulate(model, wind, duration=80.0, channels=["azimuth", *OWN])
    for name in OWN:
        means, _ = means_over_revolutions(result.time, result["azimuth"], result[name])
        assert np.max(np.abs(means[1:] / means[-1] - 1.0)) < 0.01, name


def test_operating_point_is_the_mean_of_a_long_run(model: Model) -> None:
    point = operating_point(model, 9.0)
    result = simulate(model, SteadyWind(speed=9.0), duration=120.0, channels=["azimuth", *OWN])
    for name in OWN:
        means, _ = means_over_revolutions(result.time, result["azimuth"], result[name])
        assert means[-5:].mean() == pytest.approx(point[name], rel=3e-3), name


@pytest.mark.slow
def test_power_curve_has_its_regions(model: Model) -> None:
    power = {u: operating_point(model, u)["generator_power"] for u in (5.0, 8.0, 11.0, 13.0, 20.0)}
    assert power[5.0] < power[8.0] < power[11.0] < 5.0e6
    # above rated the generator is held at 5 MW by torque and pitch
    assert power[13.0] == pytest.approx(5.0e6, rel=2e-3)
    assert power[20.0] == pytest.approx(5.0e6, rel=2e-3)
    assert operating_point(model, 20.0).pitch > operating_point(model, 13.0).pitch > 0.0


def test_the_baseline_as_a_controller_gives_the_operating_point(model: Model) -> None:
    point = operating_point(model, 15.0)
    mean = controlled_point(model, BaselineController(model.turbine), point)
    assert mean.pitch == pytest.approx(point.pitch, rel=2e-3)
    for name in OWN:
        assert mean[name] == pytest.approx(point[name], rel=3e-3), name


def test_prescribed_speed_and_pitch(model: Model) -> None:
    point = operating_point(model, 10.0, rotor_speed=1.2, pitch=0.05)
    assert (point.rotor_speed, point.pitch) == (1.2, 0.05)
    # the air drives harder than the generator holds, or the other way round: that is left over
    assert abs(point.imbalance) > 1e3


@pytest.mark.slow
@pytest.mark.parametrize("speed", [11.4, 11.5, 11.7, 12.0, 13.0])
def test_the_library_turbine_is_stable_under_its_law(model: Model, speed: float) -> None:
    wind = SteadyWind(speed=speed)
    result = simulate(model, wind, duration=120.0, channels=["RotTorq", "TwrBsMxt"])
    late = result.between(90.0, 120.0)
    assert np.ptp(late["RotTorq"]) < 0.05 * late["RotTorq"].mean()


def test_a_wind_that_does_not_turn_the_rotor_is_explained(model: Model) -> None:
    with pytest.raises(InputError, match=r"the generator\. Use a higher wind speed, or another start: in a case"):
        operating_point(model, 0.5)
    wet = meltemi.build(model.turbine, environment=meltemi.Environment(rain=meltemi.environment.Rain(rate=8.0)))
    with pytest.raises(InputError, match=r"the generator in rain of 8 mm/h\. Use less rain or a higher wind speed"):
        operating_point(wet, 0.5)


def test_a_time_step_of_nearly_nothing_is_refused(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    assert rotors.default_step(model) == pytest.approx(1 / 60)
    monkeypatch.setattr(rotors, "SHORTEST_STEP", 0.02)
    with pytest.raises(InputError, match=r"nrel5mw: its time step would be 0.017 s, 60 steps .* coordinate '.*' is"):
        rotors.default_step(model)


@pytest.mark.slow
@pytest.mark.parametrize("rpm", [20.0, 24.0])
def test_overspeed(model: Model, rpm: float) -> None:
    """At 24 rpm the corrections of the plain search grow without bound."""
    speed = rpm * math.pi / 30.0
    point = operating_point(model, 12.0, rotor_speed=speed)
    assert point.rotor_speed == speed
    assert abs(point.imbalance) < 1e6
    assert abs(point["tip_out_of_plane_1"]) < 10.0


@pytest.mark.slow
def test_continuation_finds_what_the_plain_search_finds(model: Model) -> None:
    wind = SteadyWind(speed=13.0, shear_exponent=0.2)
    plain = trim._search(Orbit(model, wind), None, None)
    careful = trim._search(CarefulOrbit(model, wind), None, None, partial(balance_carefully, trim._balance_speed))
    assert careful.pitch == pytest.approx(plain.pitch, abs=2e-4)
    for name in OWN:
        assert careful[name] == pytest.approx(plain[name], rel=2e-3), name


def test_large_yaw_error_in_strong_wind() -> None:
    """75 degrees at 25 m/s, where the stalled rotor idles along below its speed."""
    options = ModelOptions(blade_nodes=10, yaw="driven")
    machine = meltemi.build(meltemi.load_turbine("ct30-155"), options)
    wind = SteadyWind(speed=25.0, shear_exponent=0.2, direction=math.radians(75.0))
    point = operating_point(machine, wind)
    assert abs(point.imbalance) < 3e-3 * machine.turbine.rated_power / point.rotor_speed
    result = simulate(machine, wind, duration=60.0, start=point, channels=["rotor_speed"])
    assert result.between(30.0, 60.0)["rotor_speed"].mean() == pytest.approx(point.rotor_speed, rel=0.05)


def test_hurricane(model: Model) -> None:
    """The way to the feathered blades leads through motions that do not exist."""
    point = operating_point(model, 100.0)
    assert point.pitch > 1.0
    assert abs(point.imbalance) < 1e3


@pytest.mark.slow
def test_the_cause_is_named_where_there_is_no_steady_operation(model: Model) -> None:
    with pytest.raises(InputError, match=r"speed of 3\d\.?\d? rpm .* aeroelastically unstable there, its"):
        operating_point(model, 12.0, rotor_speed=40.0 * math.pi / 30.0)
    with pytest.raises(InputError, match="less than or equal to 100"):
        operating_point(model, 120.0)


@pytest.mark.parametrize(
    ("prescribed", "said"),
    [
        ({"rotor_speed": 20.0}, r"20 rad/s, 191 rpm, the blade tips would be faster than sound"),
        ({"rotor_speed": math.inf}, "faster than sound"),
        ({"rotor_speed": math.nan}, "rotor_speed must be above zero, found nan"),
        ({"pitch": 20.0}, "pitch 20 rad is not between -pi and pi; from degrees: math.radians"),
        ({"pitch": math.nan}, "pitch nan rad is not between"),
    ],
)
@pytest.mark.parametrize("name", ["nrel5mw", "pmsg20mw"])
def test_prescribed_values_in_other_units_are_refused(name: str, prescribed: dict[str, float], said: str) -> None:
    with pytest.raises(InputError, match=said):
        meltemi.operating_point(meltemi.build(meltemi.load_turbine(name)), 8.0, **prescribed)


@pytest.mark.slow
def test_an_unstable_point_at_a_prescribed_speed_has_a_warning() -> None:
    options = ModelOptions(flap_modes=4, edge_modes=2, torsion_modes=2)
    machine = meltemi.build(meltemi.load_turbine("nrel5mw-offsets"), options)
    unstable, stable = (
        operating_point(machine, 1.0, rotor_speed=rpm * math.pi / 30.0, pitch=0.0).warnings for rpm in (18.5, 12.0)
    )
    assert not stable
    assert "steady operation is unstable: its mode at 3." in unstable[0]


@pytest.mark.slow
def test_blades_that_twist_too_easily_are_unstable(turbine: Turbine) -> None:
    """With a twentieth of the stiffness lift twists them further than they can hold."""
    stiffness = turbine.blade.structure.torsion_stiffness
    assert stiffness is not None
    soft = meltemi.build(turbine.replace(**{"blade.structure.torsion_stiffness": 0.05 * stiffness}))
    with pytest.raises(InputError, match=r"the machine is aeroelastically unstable there, its .* 1st flap"):
        operating_point(soft, 8.0, rotor_speed=1.0, pitch=0.0)


def test_a_run_without_steady_operation_begins_all_the_same(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*arguments: Any) -> Any:
        raise NotConverged("no steady operation: because")

    wind = SteadyWind(speed=17.0)
    monkeypatch.setattr(points, "operating_point", fails)
    result = simulate(model, wind, duration=60.0, channels=["rotor_speed", "pitch_1"])
    assert result.meta["warnings"][0].startswith(
        "the run begins undeflected, with an initial transient: no steady operation"
    )
    assert result["rotor_speed"][0] == pytest.approx(result["rotor_speed"][-1], rel=0.01)
    assert result["pitch_1"][0] == pytest.approx(result["pitch_1"][-1], abs=0.03)


WIND_SPEEDS = np.arange(3.0, 25.5, 0.5)


@pytest.mark.long
@pytest.mark.parametrize("name", ["nrel5mw", "iea15mw", "iea22mw", "zr20-122", "ct30-155"])
def test_every_wind_speed_of_every_turbine(name: str) -> None:
    machine = meltemi.build(meltemi.load_turbine(name))
    for speed in WIND_SPEEDS:
        point = operating_point(machine, float(speed))
        assert abs(point.imbalance) < 3e-3 * machine.turbine.rated_power / point.rotor_speed, speed


@pytest.mark.slow
def test_some_wind_speeds(model: Model) -> None:
    for speed in (3.0, 4.0, 7.0, 11.4, 16.5, 25.0):
        point = operating_point(model, speed)
        assert abs(point.imbalance) < 3e-3 * model.turbine.rated_power / point.rotor_speed, speed


def test_the_secant_method_finds_a_root_close_by_in_steps_of_limited_length() -> None:
    seen: list[float] = []

    def f(x: float) -> float:
        seen.append(x)
        return math.exp(-x) - 0.5

    assert trim._secant(f, 0.6, 0.01) == pytest.approx(math.log(2.0), abs=1e-8)
    assert seen[1] == pytest.approx(0.61)  # the rotor accelerates: it looks at faster ones first
    assert len(seen) < 8
    assert np.abs(np.diff(seen)).max() <= 20.0 * 0.01 + 1e-12


def test_instants_of_a_sector_share_the_time_of_its_passage(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    seen, residuals = [], Orbit.residuals

    def watched(self: Orbit, motion: Any, dt: float) -> Any:
        if dt:
            seen.append(dt * self.speed)
        return residuals(self, motion, dt)

    monkeypatch.setattr(Orbit, "residuals", watched)
    trim.rigid_point(model, SteadyWind(speed=11.0))
    assert seen == pytest.approx([2.0 * math.pi / 3.0 / SAMPLES] * len(seen))
    assert len(seen) > 10


def test_a_rigid_point_is_not_deflected(model: Model) -> None:
    point = trim.rigid_point(model, SteadyWind(speed=9.0))
    moved = [name for name, q in zip(model.coordinates, point.q, strict=True) if q != 0.0]
    assert moved == []
    assert abs(point.imbalance) < 3e-3 * 5e6 / point.rotor_speed


def test_harmonics_have_their_rates_and_are_found_again_by_projection(model: Model) -> None:
    orbit = Orbit(model, SteadyWind(speed=9.0))
    orbit.speed, h = 1.1, 1e-4
    orbit.coefficients[:] = np.random.default_rng(3).normal(size=len(orbit.coefficients))
    azimuths = 0.2 + orbit.step * np.arange(SAMPLES)
    before, now, after = (orbit.motion(azimuths + shift) for shift in (-h, 0.0, h))
    rates = orbit.speed * (after - before)[:2] / (2.0 * h)
    np.testing.assert_allclose(now[1:], rates, rtol=0.0, atol=1e-5)
    both = orbit.motion(azimuths, np.stack([orbit.coefficients, 2.0 * orbit.coefficients]))
    np.testing.assert_array_equal(both[0], now)
    core, blade = np.split(now[0], [orbit.core], axis=1)
    found = orbit.projected(azimuths, core, blade.reshape(SAMPLES, orbit.B, orbit.K))
    np.testing.assert_allclose(found, orbit.coefficients[orbit.free], rtol=0.0, atol=1e-12)
