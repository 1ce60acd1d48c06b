"""The load controller: each part by its own numbers, limits, options, bad input, derivatives; and on the machine.

``Driven`` calls the law on vectors, as the time loop does, with moments that the test makes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import InputError, Model, Result, Simulation, Status, SteadyWind, Turbine, simulate
from meltemi.control import FeedForward, HarmonicLoop, LoadControl, LoadController, LoadSensor, SpeedNotch, StartPoint
from meltemi.control import signals as s
from meltemi.control_laws.feedforward import weight, weight_settings
from meltemi.control_laws.filters import LowPass, low_pass
from meltemi.control_laws.multiblade import to_blade
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import march
from meltemi.turbine import naca64618_flap, with_flaps

Float = NDArray[np.float64]
DEGREE = np.pi / 180.0
RATED = 12.1 * np.pi / 30.0
DT = 0.0125
PITCH_GAIN, FLAP_GAIN = 0.4 * DEGREE / 1190e3, -0.2 * DEGREE / 160e3
PITCH = HarmonicLoop(harmonic=1, integral_gain=PITCH_GAIN, offset=30 * DEGREE, filter_damping=1.0)
FLAP = HarmonicLoop(harmonic=2, integral_gain=FLAP_GAIN, actuator="flap", offset=57 * DEGREE, filter_damping=1.0)
WIND = SteadyWind(speed=18.0, shear_exponent=0.2)
CHANNELS = (
    "azimuth",
    *(f"{name}{i}" for name in ("RootMyc", "pitch_", "flap_1_angle_") for i in (1, 2, 3)),
    "generator_torque",
    "rotor_speed",
)
BLADES = 2.0 * np.pi * np.arange(3) / 3.0
only_compiled = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="duals exist in compiled code only")


@pytest.fixture(scope="module")
def flapped(turbine: Turbine) -> Turbine:
    return with_flaps(turbine).replace(**{"pitch_actuator.kind": "second_order"})


@pytest.fixture(scope="module")
def flap_model(flapped: Turbine) -> Model:
    return meltemi.build(flapped)


def one(loop: HarmonicLoop, **changes: Any) -> LoadControl:
    return LoadControl(loops=(loop.replace(**changes),))


class Driven:
    """A load controller on vectors, from an operating point with this collective pitch [rad]."""

    def __init__(self, turbine: Turbine, settings: LoadControl, *, pitch: float = 0.26, dt: float = DT) -> None:
        self.controller, self.dt = LoadController(turbine, settings), dt
        reference = turbine.control.pitch.reference_speed
        torque = turbine.control.torque.rated_power / reference
        self.state = self.controller.initial_state(StartPoint(18.0, reference, pitch, torque))
        self.measured, self.demands = s.Measurements.zeros(), s.Demands.zeros()
        self.measured[s.GENERATOR_SPEED], self.measured[s.ROTOR_SPEED] = reference, RATED
        self.measured[s.N_BLADES] = 3

    def step(self, azimuth: float, moments: Sequence[float] | Float = (0.0, 0.0, 0.0)) -> Float:
        """(2, blades) pitch and flap demands."""
        self.measured[s.AZIMUTH] = azimuth
        self.measured[s.OUT_OF_PLANE_MOMENT : s.OUT_OF_PLANE_MOMENT + 3] = moments
        update: Callable[..., None] = self.controller.update
        update(self.state, self.measured, self.demands, self.dt)
        return np.stack([self.demands[first : first + 3].copy() for first in (s.PITCH_DEMAND, s.FLAP_DEMAND)])

    def turn(self, moments: Callable[[float, float], Any], seconds: float = 20.0) -> Float:
        """(T, 2, blades) demands with the rotor turning under moments of (time, azimuth)."""
        times = self.dt * np.arange(round(seconds / self.dt))
        return np.array([self.step(RATED * t, moments(t, RATED * t)) for t in times])

    def entry(self, name: str) -> float:
        return float(self.state[self.controller.state_names.index(name)])


def shear(t: float, psi: float) -> Float:
    """[N m] a 1P, a 2P and a slow part."""
    a = psi + BLADES
    return np.asarray(5e6 + 1.5e6 * np.cos(a) + 3e5 * np.sin(2.0 * a + 0.4) + 2e5 * np.cos(0.3 * t + a))


def amplitude(result: Result, harmonic: int, channel: str = "RootMyc1", skip: float = 40.0) -> float:
    """Of a channel at a multiple of the rotor speed."""
    late = result.time > skip
    psi = np.unwrap(result["azimuth"][late])
    basis = [np.ones_like(psi)] + [f(n * psi) for n in range(1, 7) for f in (np.cos, np.sin)]
    parts = np.linalg.lstsq(np.stack(basis, 1), result[channel][late], rcond=None)[0]
    return float(np.hypot(parts[2 * harmonic - 1], parts[2 * harmonic]))


def tilt_and_yaw(result: Result, harmonic: int, skip: float = 40.0) -> Float:
    """[N m] means over whole revolutions."""
    psi = np.unwrap(result["azimuth"])
    late = (result.time > skip) & (psi <= psi[result.time > skip][0] + 8.0 * np.pi)
    angle = harmonic * (psi[late, None] + BLADES)
    moments = np.stack([result[f"RootMyc{i}"][late] for i in (1, 2, 3)], 1)
    return np.array([2.0 / 3.0 * (moments * f(angle)).sum(axis=1).mean() for f in (np.cos, np.sin)])


# no parts -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [11.4, 18.0])
def test_without_parts_it_is_the_baseline_to_the_bit(model: Model, speed: float) -> None:
    wind = meltemi.wind.generate_field(
        meltemi.TurbulentWind(speed=speed, intensity=0.15, seed=2, points=9), model.turbine, 30.0
    )
    runs = [
        simulate(model, wind, duration=30.0, channels=["all"], controller=controller)
        for controller in (
            meltemi.control.BaselineController(model.turbine),
            LoadController(model.turbine),
            LoadController(model.turbine, LoadControl(feedforward=FeedForward(gain=0.0))),
        )
    ]
    assert np.array_equal(runs[0].data, runs[1].data)
    assert np.array_equal(runs[0].data, runs[2].data)


# feed-forward -------------------------------------------------------------------------------------------------


def still(t: float, psi: float) -> Float:
    return np.zeros(3)


def shares(psi: float, **changes: float) -> Float:
    x = weight_settings(**{"radius": 42.0, "hub_height": 90.0, "shear": 0.2, **changes})
    return np.array([weight(x, i, 3, psi) for i in range(3)])


def forward(turbine: Turbine, **settings: Any) -> Float:
    """(T, blades) pitch demands of feed-forward alone, at a collective pitch of 0.26 rad."""
    return Driven(turbine, LoadControl(feedforward=FeedForward(**settings))).turn(still, 10.0)[:, 0]


def test_feedforward_gives_each_blade_its_share(turbine: Turbine) -> None:
    found = forward(turbine, radius=42.0)
    rate = turbine.control.pitch.rate_limit
    assert np.abs(np.diff(found, axis=0)).max() < rate * DT
    settled = round(0.26 * 0.21 / rate / DT) + 1  # blades begin together
    psi = RATED * DT * np.arange(len(found))
    expected = 0.26 * np.array([shares(p) for p in psi])
    np.testing.assert_allclose(found[settled:], expected[settled:], atol=1e-12)
    np.testing.assert_allclose(found[settled:].sum(axis=1), 3.0 * 0.26, atol=1e-12)
    assert np.ptp(found[settled:], axis=0) == pytest.approx(0.26 * 0.39, rel=0.01)
    half = forward(turbine, radius=42.0, gain=0.5)
    np.testing.assert_allclose(half[settled:] - 0.26, 0.5 * (found[settled:] - 0.26), atol=1e-12)


@pytest.mark.parametrize(
    ("option", "value", "name"), [("shear_exponent", 0.1, "shear"), ("exponent", 1.0, "exponent"), ("radius", 30.0, "")]
)
def test_settings_of_the_weights_reach_them(turbine: Turbine, option: str, value: float, name: str) -> None:
    found = forward(turbine, **{"radius": 42.0, option: value})[100:]
    psi = RATED * DT * np.arange(100, 100 + len(found))
    np.testing.assert_allclose(found, 0.26 * np.array([shares(p, **{name or option: value}) for p in psi]), atol=1e-12)
    assert np.abs(found - forward(turbine, radius=42.0)[100:]).max() > 0.01


def test_tower_shadow_dips_no_faster_than_the_rate_limit(turbine: Turbine) -> None:
    """The radius is two thirds of the rotor's by default; the tower has its diameter where the blade passes."""
    found, plain = (forward(turbine, tower_shadow=shadow) for shadow in (True, False))
    assert (plain - found).max() > 0.01
    assert np.abs(np.diff(found, axis=0)).max() <= turbine.control.pitch.rate_limit * DT * (1.0 + 1e-12)
    slow = turbine.replace(**{"control.pitch.rate_limit": 0.05})
    limited = forward(slow, tower_shadow=True)
    assert np.abs(np.diff(limited, axis=0)).max() == pytest.approx(0.05 * DT, rel=1e-9)


def test_feedforward_on_the_machine(model: Model) -> None:
    radius = 2.0 / 3.0 * model.turbine.rotor_radius
    controller = LoadController(model.turbine, LoadControl(feedforward=FeedForward()))
    result = simulate(model, WIND, duration=30.0, channels=CHANNELS[:7], controller=controller)
    pitch = np.stack([result[f"pitch_{i}"] for i in (1, 2, 3)], 1)[20:]
    mean = pitch.mean(axis=1, keepdims=True)
    weights = np.array([shares(psi, radius=radius) for psi in result["azimuth"][20:]])
    np.testing.assert_allclose(pitch, weights * mean, atol=1e-9)


# feedback on the machine --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def machine(flap_model: Model) -> Callable[..., Result]:
    found: dict[Any, Result] = {}

    def run(*loops: HarmonicLoop, wind: SteadyWind = WIND) -> Result:
        key = (loops, wind.speed)
        if key not in found:
            controller = LoadController(flap_model.turbine, LoadControl(loops=loops))
            found[key] = simulate(flap_model, wind, duration=70.0, channels=CHANNELS, controller=controller)
            found[key].raise_for_status()
        return found[key]

    return run


@pytest.mark.parametrize("loops", [(PITCH,), (FLAP,), (PITCH, FLAP)], ids=["1P pitch", "2P flap", "both"])
def test_the_moments_of_the_loops_harmonics_go(machine: Callable[..., Result], loops: tuple[HarmonicLoop, ...]) -> None:
    """Found are 0.02 % of 1.85 MN m at 1P and 0.2 % of 241 kN m at 2P."""
    before, after = machine(), machine(*loops)
    for harmonic in (1, 2):
        assert amplitude(before, harmonic) == pytest.approx({1: 1.85e6, 2: 2.41e5}[harmonic], rel=0.05)
        if harmonic in [loop.harmonic for loop in loops]:
            assert amplitude(after, harmonic) < 0.01 * amplitude(before, harmonic)
            gone = np.linalg.norm(tilt_and_yaw(after, harmonic)) / np.linalg.norm(tilt_and_yaw(before, harmonic))
            assert gone < 0.03
    assert after["rotor_speed"][-1] == pytest.approx(RATED, rel=1e-3)


def test_the_other_harmonic_stays(machine: Callable[..., Result]) -> None:
    """The 2P flap loop leaves 1P within 5 % and the pitch alone; the 1P pitch loop leaves the flaps alone."""
    before, flap, pitch = machine(), machine(FLAP), machine(PITCH)
    assert amplitude(flap, 1) == pytest.approx(amplitude(before, 1), rel=0.05)
    assert np.ptp(flap["pitch_1"][800:]) < 0.1 * DEGREE
    assert not pitch["flap_1_angle_1"].any()
    # what the actuators do
    assert amplitude(pitch, 1, "pitch_1") == pytest.approx(1.6 * DEGREE, rel=0.1)
    assert amplitude(flap, 2, "flap_1_angle_1") == pytest.approx(1.56 * DEGREE, rel=0.1)


def test_below_rated_pitch_rests_on_its_limit_without_wind_up(machine: Callable[..., Result]) -> None:
    """The loop may pitch towards feather only; its integrals stay where the blades can follow."""
    result = machine(PITCH, wind=SteadyWind(speed=8.0, shear_exponent=0.2))
    pitch = np.stack([result[f"pitch_{i}"] for i in (1, 2, 3)])
    assert pitch.min() == 0.0
    assert 0.1 * DEGREE < pitch.max() < 0.5 * DEGREE


@pytest.mark.parametrize(
    "loop",
    [
        PITCH.replace(integral_gain=-PITCH_GAIN),
        PITCH.replace(integral_gain=50.0 * PITCH_GAIN),
        FLAP.replace(integral_gain=-FLAP_GAIN),
        FLAP.replace(integral_gain=50.0 * FLAP_GAIN),
    ],
)
def test_loops_that_are_unstable_stay_within_the_limits(flap_model: Model, loop: HarmonicLoop) -> None:
    """The run goes on: what the actuators cannot do is not done."""
    controller = LoadController(flap_model.turbine, LoadControl(loops=(loop,)))
    result = simulate(flap_model, WIND, duration=60.0, channels=CHANNELS, controller=controller)
    assert result.status is Status.OK and result.message == "" and np.all(np.isfinite(result.data))
    (warning,) = [text for text in result.warnings if "demands" in text]  # the blades may vibrate, too
    said = re.fullmatch(
        r"(pitch|flap 1): demands at their limits (\d+) % of the time: gains too high or of the wrong sign\?", warning
    )
    assert said and said[1] == ("pitch" if loop.actuator == "pitch" else "flap 1") and 50 < int(said[2]) <= 100
    assert warning in repr(result) and result.meta["warnings"] == [*result.warnings]
    pitch, flap = (np.stack([result[f"{name}{i}"] for i in (1, 2, 3)]) for name in ("pitch_", "flap_1_angle_"))
    assert pitch.min() >= 0.0 and pitch.max() <= 0.5 * np.pi
    assert np.abs(flap).max() <= 15.0 * DEGREE * (1.0 + 1e-9)
    if loop.actuator == "flap":
        assert np.abs(flap).max() == pytest.approx(15.0 * DEGREE)
        assert np.ptp(pitch[:, 800:]) < DEGREE
    else:
        assert np.ptp(pitch[:, 800:]) > 15.0 * DEGREE


@pytest.mark.slow
def test_ten_times_the_gain_is_noticed(flap_model: Model) -> None:
    """1P pitch, 10 times its gain, in turbulence; a comparison passes the words on."""
    wild = LoadController(flap_model.turbine, one(PITCH, integral_gain=10.0 * PITCH_GAIN))
    tuned = LoadController(flap_model.turbine, one(PITCH))
    winds = [meltemi.TurbulentWind(speed=18.0, intensity=0.15, seed=seed, points=9) for seed in (1, 2)]
    found = meltemi.analysis.compare(flap_model, {"tuned": tuned, "wild": wild}, winds, duration=60.0, transient=20.0)
    (line,) = found.warnings()
    assert re.match(r"scheme 'wild' in 2 of 2 winds: pitch: demands at their limits \d\d % of the time", line)


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "intensity"), [(6.0, 0.2), (11.4, 0.2), (24.0, 0.16)])
def test_sound_gains_have_no_warning(flap_model: Model, speed: float, intensity: float) -> None:
    """Below rated the pitch rests on its lower limit nearly always, which does not count."""
    turbine = flap_model.turbine
    wind = meltemi.TurbulentWind(speed=speed, intensity=intensity, shear_exponent=0.2, seed=4, points=9)
    law = LoadController(turbine, LoadControl(loops=(PITCH, FLAP), feedforward=FeedForward(tower_shadow=True)))
    run = Simulation(Run(flap_model, wind, duration=100.0, controller=law, channels=CHANNELS))
    march(run)
    result = run.result()
    assert result.status is Status.OK and result.warnings == ()
    if speed < 8.0:
        assert np.mean(result["pitch_1"] == 0.0) > 0.4
    names = list(law.state_names)
    state = run.case.controller_state
    assert state[names.index("time")] == pytest.approx(100.0, abs=0.02)
    # the tower's shadow is faster than the pitch: 7 s at 24 m/s
    assert state[names.index("blade_pitch_held")] < 10.0 and state[names.index("flap_1_held")] < 15.0


def test_time_at_limits_is_counted(flapped: Turbine) -> None:
    """A flap held at its end by a steady moment counts, a pitch on its lower limit does not; a third for one blade."""
    driven = Driven(flapped, one(FLAP, filter_damping=0.0, offset=0.0, integral_gain=1e3 * FLAP_GAIN, authority=1.0))
    for _ in range(2000):
        driven.step(0.0, [3e6, 0.0, 0.0])
    assert driven.entry("time") == pytest.approx(2000 * DT)
    assert driven.entry("flap_1_held") == pytest.approx(2000 * DT, rel=0.05)
    assert driven.entry("blade_pitch_held") == 0.0
    low = Driven(flapped, one(PITCH, filter_damping=0.0, offset=0.0), pitch=0.0)
    low.measured[s.GENERATOR_SPEED] *= 0.7
    for _ in range(2000):
        pitch = low.step(0.0, [0.0, 1e6, 1e6])[0]
    assert pitch[0] == 0.0 and pitch[1] > 0.0
    assert low.entry("time") == pytest.approx(2000 * DT) and low.entry("blade_pitch_held") == 0.0
    assert low.controller.warnings is not None and list(low.controller.warnings(low.state)) == []


# limits -------------------------------------------------------------------------------------------------------


def test_demands_are_within_angle_and_rate_at_every_call(flapped: Turbine) -> None:
    rng = np.random.default_rng(4)
    limits = [(0.0, 0.5 * np.pi, 8.0 * DEGREE), (-15.0 * DEGREE, 15.0 * DEGREE, 40.0 * DEGREE)]
    law = flapped.control.pitch
    assert limits[0] == pytest.approx((law.minimum, law.maximum, law.rate_limit), rel=1e-6)
    settings = LoadControl(
        loops=(PITCH, PITCH.replace(harmonic=2), FLAP.replace(harmonic=1), FLAP), feedforward=FeedForward()
    )
    driven, walk = Driven(flapped, settings), np.zeros(3)

    def wild(t: float, psi: float) -> Float:
        walk[:] = 0.99 * walk + 2e6 * rng.standard_normal(3)
        return walk + 3e7 * np.cos(psi + BLADES) * (10.0 < t < 20.0)

    found = driven.turn(wild, 40.0)
    flap = naca64618_flap()
    exact = [(law.minimum, law.maximum, law.rate_limit), (flap.minimum, flap.maximum, flap.rate)]
    for group, (low, high, rate) in enumerate(exact):
        demands = found[:, group]
        assert demands.min() >= low and demands.max() <= high
        assert np.abs(np.diff(demands, axis=0)).max() <= rate * DT * (1.0 + 1e-13)
        assert np.count_nonzero(demands == low) > 5
    assert np.abs(np.diff(found[:, 1], axis=0)).max() == pytest.approx(exact[1][2] * DT)


@pytest.mark.parametrize("authority", [None, 3.0])
@pytest.mark.parametrize("loop", [PITCH, FLAP], ids=["pitch", "flap"])
def test_nothing_winds_up(flapped: Turbine, loop: HarmonicLoop, authority: float | None) -> None:
    """A tilt moment of 50 MN m for a minute on a rotor that stands, then the opposite one.

    With clamping by the axis or, with a wide authority, by the blade: within a time constant the demand has left its
    limit.
    """
    group = 0 if loop.actuator == "pitch" else 1
    times = {}
    for tracking in (1.0, 1e9):
        settings = one(
            loop,
            integral_gain=20.0 * loop.integral_gain,
            filter_damping=0.0,
            offset=0.0,
            authority=authority,
            tracking_time=tracking,
        )
        driven = Driven(flapped, settings)
        moments = 5e7 * np.cos(loop.harmonic * BLADES)
        for _ in range(round(60.0 / DT)):
            held = driven.step(0.0, moments)[group, 0]
        limit = (0.5 * np.pi if group == 0 else -15.0 * DEGREE) if authority or group else 0.5 * np.pi
        assert held == pytest.approx(limit, rel=1e-6)
        times[tracking] = np.inf
        for k in range(round(30.0 / DT)):
            if driven.step(0.0, -moments)[group, 0] != held:
                times[tracking] = k * DT
                break
    assert times[1.0] < 1.0
    assert times[1e9] > 10.0


@pytest.mark.parametrize("offset", [0.9, -1.7])
def test_what_blades_cannot_do_is_taken_back_in_phase(flapped: Turbine, offset: float) -> None:
    """Integrals beyond the flaps' limits shrink to them along their own direction, whatever the offset."""
    driven = Driven(flapped, one(FLAP, offset=offset, authority=1.0))
    names = driven.controller.state_names
    places = [names.index(f"loop_1_{axis}_integral") for axis in ("tilt", "yaw")]
    driven.state[places] = 0.3, -0.2
    driven.turn(still, 30.0)
    found = driven.state[places]
    assert np.hypot(*found) == pytest.approx(15.0 * DEGREE, rel=0.02)
    assert np.arctan2(found[1], found[0]) == pytest.approx(np.arctan2(-0.2, 0.3), abs=0.05)


# options ------------------------------------------------------------------------------------------------------

CHANGES: dict[str, dict[str, Any]] = {
    "harmonic": {"harmonic": 2},
    "integral_gain": {"integral_gain": 1.5 * PITCH_GAIN},
    "proportional_gain": {"proportional_gain": 1e-8},
    "derivative_gain": {"derivative_gain": 1e-8, "derivative_frequency": 2.0},
    "filter_damping": {"filter_damping": 0.25},
    "no band-pass": {"filter_damping": 0.0},
    "offset": {"offset": 0.0},
    "gain_halving_pitch": {"gain_halving_pitch": 0.11},
    "authority": {"authority": 0.01},
    "flap": {"actuator": "flap"},
}


@pytest.mark.parametrize("what", CHANGES)
def test_every_option_of_a_loop_changes_the_demands(flapped: Turbine, what: str) -> None:
    usual, changed = (Driven(flapped, one(PITCH, **c)).turn(shear, 10.0) for c in ({}, CHANGES[what]))
    assert np.abs(usual - changed).max() > 1e-3


def standing(turbine: Turbine, loop: HarmonicLoop, calls: int = 1, pitch: float = 0.26) -> Float:
    """(blades,) pitch beyond the collective one, after calls with a steady 1P moment at an azimuth of 0.7."""
    driven = Driven(turbine, LoadControl(loops=(loop,)), pitch=pitch)
    for _ in range(calls):
        found = driven.step(0.7, 1e6 * np.cos(0.7 + BLADES) + 4e5 * np.sin(0.7 + BLADES))
    return np.asarray(found[0] - pitch)


def test_the_law_of_a_call(flapped: Turbine) -> None:
    """Integral of one call, offset, schedule and gains by hand."""
    bare = PITCH.replace(filter_damping=0.0, offset=0.0)
    tilt, yaw = 1e6 * PITCH_GAIN * DT, 4e5 * PITCH_GAIN * DT
    for offset in (0.0, 0.5):
        expected = [to_blade(tilt, yaw, i, 3, 0.7, 1, offset) for i in range(3)]
        np.testing.assert_allclose(standing(flapped, bare.replace(offset=offset)), expected, atol=1e-14)
    once = standing(flapped, bare)
    halved = standing(flapped, bare.replace(gain_halving_pitch=0.26))
    np.testing.assert_allclose(halved, 0.5 * once, atol=1e-14)
    np.testing.assert_allclose(standing(flapped, bare, calls=7), 7.0 * once, atol=1e-14)
    # proportional 1e-9 rad/(N m): a thousandth of a radian for 1 MN m
    more = standing(flapped, bare.replace(proportional_gain=1e-9)) - once
    np.testing.assert_allclose(more, 1e-9 * (1e6 * np.cos(0.7 + BLADES) + 4e5 * np.sin(0.7 + BLADES)), atol=1e-14)
    # two loops add
    both = Driven(flapped, LoadControl(loops=(bare, bare))).step(
        0.7, 1e6 * np.cos(0.7 + BLADES) + 4e5 * np.sin(0.7 + BLADES)
    )
    np.testing.assert_allclose(both[0] - 0.26, 2.0 * once, atol=1e-14)


def test_authority_limits_the_axes(flapped: Turbine) -> None:
    settings = one(PITCH, authority=0.005, filter_damping=0.0)
    for phase, most in ((0.0, 1.0), (0.25 * np.pi, np.sqrt(2.0))):
        found = Driven(flapped, settings).turn(lambda t, psi, p=phase: 2e7 * np.cos(psi + BLADES + p), 30.0)  # type: ignore[misc]
        assert np.abs(found[:, 0] - 0.26).max() == pytest.approx(0.005 * most, rel=1e-3)


def test_tracking_time_matters_at_limits_only(flapped: Turbine) -> None:
    def turned(tracking: float, authority: float) -> Float:
        driven = Driven(flapped, one(PITCH, tracking_time=tracking, authority=authority))
        return driven.turn(lambda t, psi: shear(t, psi) if t < 10.0 else -shear(t, psi), 15.0)

    np.testing.assert_array_equal(turned(0.5, 1.0), turned(5.0, 1.0))
    assert np.abs(turned(0.5, 0.003) - turned(5.0, 0.003)).max() > 1e-4


def test_sensors_low_pass(flapped: Turbine) -> None:
    """It is the part's filter before the loop."""
    state = [LowPass.of() for _ in range(3)]
    filtered = Driven(flapped, one(PITCH)).turn(
        lambda t, psi: [low_pass(state[i], m, 4.0, DT) for i, m in enumerate(shear(t, psi))]
    )
    settings = LoadControl(loops=(PITCH,), sensor=LoadSensor(low_pass=4.0))
    found = Driven(flapped, settings).turn(shear)
    np.testing.assert_allclose(found, filtered, rtol=1e-12, atol=1e-14)
    assert np.abs(found - Driven(flapped, one(PITCH)).turn(shear)).max() > 1e-3


def test_sensors_delay_is_so_many_samples(flapped: Turbine) -> None:
    samples = 8
    settings = LoadControl(loops=(PITCH,), sensor=LoadSensor(delay=samples))
    found = Driven(flapped, settings).turn(shear)
    late: list[Float] = [np.zeros(3)] * samples

    def delayed(t: float, psi: float) -> Float:
        late.append(shear(t, psi))
        return late[-1 - samples]

    np.testing.assert_array_equal(found, Driven(flapped, one(PITCH)).turn(delayed))
    assert np.abs(found - Driven(flapped, one(PITCH)).turn(shear)).max() > 1e-4


def test_sensors_noise_repeats_with_its_seed(flapped: Turbine) -> None:
    sensors = [LoadSensor(noise=1e5, seed=1), LoadSensor(noise=1e5, seed=1), LoadSensor(noise=1e5, seed=2)]
    found = [Driven(flapped, LoadControl(loops=(PITCH,), sensor=sensor)).turn(shear, 5.0) for sensor in sensors]
    np.testing.assert_array_equal(found[0], found[1])
    assert np.abs(found[0] - found[2]).max() > 1e-6
    assert np.abs(found[0] - Driven(flapped, one(PITCH)).turn(shear, 5.0)).max() > 1e-6
    # the blades have streams of their own: with one stream the noise would be collective, which no axis sees
    quiet = Driven(flapped, LoadControl(loops=(PITCH,), sensor=sensors[0])).turn(still, 5.0)
    assert np.abs(quiet[:, 0] - 0.26).max() > 1e-6


def test_notch_in_the_generator_speed(turbine: Turbine) -> None:
    """The steady speed passes to the bit, at the notch's frequency nothing does."""
    driven = Driven(turbine, LoadControl(notch=SpeedNotch(frequency=10.55)))
    plain = Driven(turbine, LoadControl())
    for k in range(400):
        np.testing.assert_array_equal(driven.step(0.1 * k), plain.step(0.1 * k))
    reference = turbine.control.pitch.reference_speed
    spread = {}
    for name, law in (("notch", driven), ("plain", plain)):
        speeds = []
        for k in range(3200):
            law.measured[s.GENERATOR_SPEED] = reference + 2.0 * np.sin(10.55 * DT * k)
            law.step(0.0)
            speeds.append(law.entry("speed") - reference)
        spread[name] = np.ptp(speeds[2400:])
    assert spread["plain"] > 0.5
    assert spread["notch"] < 1e-6
    wide = Driven(turbine, LoadControl(notch=SpeedNotch(frequency=10.55, damping=2.0)))
    narrow = Driven(turbine, LoadControl(notch=SpeedNotch(frequency=10.55)))
    for law in (wide, narrow):
        law.measured[s.GENERATOR_SPEED] = reference + 1.0
    found = [np.array([law.step(0.0) for _ in range(20)]) for law in (wide, narrow)]
    assert np.abs(found[0] - found[1]).max() > 1e-6


def test_the_notch_ends_the_limit_cycle_just_above_rated(flap_model: Model) -> None:
    """Rotor torque in steady wind of 11.6 m/s with a second-order pitch actuator: 4.6 MN m without, 13 kN m with it."""
    spread = []
    for part in (None, SpeedNotch(frequency=10.55)):
        controller = LoadController(flap_model.turbine, LoadControl(notch=part))
        result = simulate(
            flap_model, SteadyWind(speed=11.6), duration=120.0, channels=["RotTorq"], controller=controller
        )
        spread.append(result["RotTorq"][result.time > 80.0].std())
    assert spread[0] > 2e6
    assert spread[1] < 2e4


def test_sample_time(model: Model) -> None:
    """Pitch demands are held between samples."""
    runs = {
        time: simulate(
            model,
            WIND,
            duration=10.0,
            channels=["pitch_1"],
            output_step=0.01,
            controller=LoadController(model.turbine, one(PITCH), sample_time=time),
        )["pitch_1"]
        for time in (None, 0.05)
    }
    assert np.count_nonzero(np.diff(runs[0.05])) <= 201 < np.count_nonzero(np.diff(runs[None]))
    assert np.abs(runs[0.05] - runs[None]).max() > 1e-5


# bad input ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("settings", "arguments", "words"),
    [
        (one(FLAP), {}, r"loops\[0\]: flap 1 is required, the blades of '.*' have none: add flaps.*with_flaps"),
        (one(PITCH), {"sample_time": 3.0}, r"loops\[0\]: harmonic 1 .*half the sampling rate.*use a sample_time below"),
        (one(PITCH, harmonic=20), {"sample_time": 0.2}, "use a sample_time below 0.12"),
        (one(PITCH, harmonic=3), {}, "harmonic 3: 3 blades cannot tell its cosine from its sine part"),
        (LoadControl(loops=(PITCH, PITCH.replace(harmonic=6))), {}, r"loops\[1\]: harmonic 6"),
        (one(PITCH), {"sample_time": -0.1}, "sample_time must be positive"),
        (LoadControl(), {"sample_time": -0.1}, "sample_time must be positive"),
        (LoadControl(notch=SpeedNotch(frequency=70.0)), {"sample_time": 0.05}, "notch.frequency 70 .*62.8"),
        (LoadControl(feedforward=FeedForward(radius=95.0)), {}, "radius 95 m must be below hub_height 90 m"),
    ],
)
def test_settings_that_do_not_fit_are_refused(
    turbine: Turbine, settings: LoadControl, arguments: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        LoadController(turbine, settings, **arguments)


def test_a_flap_that_is_not_there_is_refused(flapped: Turbine, turbine: Turbine) -> None:
    with pytest.raises(InputError, match="flap 2 is required, the blades of '.*' have 1"):
        LoadController(flapped, one(FLAP, flap=2))
    with pytest.raises(InputError, match="2 blades"):
        LoadController(turbine.replace(n_blades=2), one(PITCH))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: FLAP.replace(flap=5), "flap.*less than or equal to 4"),
        (lambda: FLAP.replace(harmonic=0), "greater than or equal to 1"),
        (lambda: FLAP.replace(harmonic=1.5), "harmonic.*integer"),
        (lambda: FLAP.replace(actuator="brake"), "'pitch' or 'flap'"),
        (lambda: FLAP.replace(proportional_gain=1e-9), "proportional_gain and integral_gain must have the same sign"),
        (lambda: PITCH.replace(derivative_gain=1e-9), "derivative_gain needs a derivative_frequency"),
        (lambda: PITCH.replace(filter_damping=-1.0), "filter_damping.*greater than or equal to 0"),
        (lambda: PITCH.replace(tracking_time=0.0), "tracking_time.*greater than 0"),
        (lambda: PITCH.replace(authority=-0.1), "authority.*greater than 0"),
        (lambda: PITCH.replace(gain_halving_pitch=0.0), "gain_halving_pitch.*greater than 0"),
        (lambda: PITCH.replace(offset=60.0), "offset.*less than or equal to 3.14"),
        (lambda: PITCH.replace(integral_gain=np.nan), "integral_gain.*finite"),
        (lambda: PITCH.replace(derivative_frequency=-1.0), "derivative_frequency.*greater than or equal to 0"),
        (lambda: LoadSensor(noise=-1.0), "noise.*greater than or equal to 0"),
        (lambda: LoadSensor(low_pass=-1.0), "low_pass.*greater than or equal to 0"),
        (lambda: LoadSensor(delay=-1), "delay.*greater than or equal to 0"),
        (lambda: LoadSensor(seed=-1), "seed.*greater than or equal to 0"),
        (lambda: SpeedNotch(frequency=0.0), "frequency.*greater than 0"),
        (lambda: SpeedNotch(frequency=10.0, damping=0.0), "damping.*greater than 0"),
        (lambda: FeedForward(gain=-0.1), "gain.*greater than or equal to 0"),
        (lambda: FeedForward(shear_exponent=-0.1), "shear_exponent.*greater than or equal to 0"),
        (lambda: FeedForward(radius=0.0), "radius.*greater than 0"),
        (lambda: LoadControl(loop=(PITCH,)), "loop: unknown key"),  # type: ignore[call-arg]
    ],
)
def test_numbers_that_cannot_be_are_refused(make: Callable[[], Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()


# derivatives and number types ---------------------------------------------------------------------------------

ALL = LoadControl(loops=(PITCH, FLAP), feedforward=FeedForward(gain=0.3), notch=SpeedNotch(frequency=10.55))


def test_state_names(flapped: Turbine) -> None:
    """One for each entry, none twice, the collective law's first."""
    settings = ALL.replace(sensor={"delay": 3, "noise": 1e3})
    driven = Driven(flapped, settings)
    names = driven.controller.state_names
    assert len(names) == len(set(names)) == len(driven.state)
    assert (
        names[: len(meltemi.control.BaselineController(flapped).state_names)]
        == meltemi.control.BaselineController(flapped).state_names
    )
    for name, value in {
        "loop_1_tilt_integral_gain": PITCH_GAIN,
        "loop_1_yaw_integral_gain": PITCH_GAIN,
        "loop_2_tilt_integral_gain": FLAP_GAIN,
        "loop_2_offset": 57 * DEGREE,
        "loop_2_damping": 1.0,
        "loop_2_group": 1.0,
        "feedforward": 0.3,
        "weights_shear": 0.2,
        "notch_frequency": 10.55,
        "notch_second": flapped.control.pitch.reference_speed,
        "delay_2_samples": 3.0,
        "noise_2_stream": 1.0,
        "blade_pitch_rate": flapped.control.pitch.rate_limit,
        "blade_pitch_last_2": 0.26,
        "flap_1_maximum": naca64618_flap().maximum,
        "flap_2_maximum": 0.0,
        "delay_3_value_3": 0.0,
    }.items():
        assert driven.entry(name) == value, name
    driven.step(0.3, [1e6, 2e6, 3e6])
    assert [driven.entry(f"moment_{i}") for i in (1, 2, 3)] == [0.0, 0.0, 0.0]
    assert [driven.entry(f"delay_{i}_oldest") for i in (1, 2, 3)] == [1.0, 1.0, 1.0]
    assert driven.entry("delay_3_value_1") == pytest.approx(3e6, rel=0.01)
    assert driven.entry("blade_pitch_last_2") == driven.demands[s.PITCH_DEMAND + 1]


PARAMETERS = (
    "controller.loop_1_tilt_integral_gain",
    "controller.loop_1_offset",
    "controller.loop_1_damping",
    "controller.loop_2_yaw_integral_gain",
    "controller.loop_2_offset",
    "controller.feedforward",
    "controller.notch_damping",
    "controller.proportional_gain",
)


@pytest.mark.long  # two minutes of compilation
@only_compiled
def test_derivatives_are_limits_of_differences(flap_model: Model) -> None:
    """By settings of all parts, in wind that changes; found are 1e-5 and less."""
    wind = meltemi.WindSeries(time=[0.0, 5.0, 10.0, 15.0, 20.0], speed=[18.0, 17.0, 18.5, 17.5, 18.0], exponent=0.2)
    channels = ("root_moment_out_of_plane_1", "pitch_2", "flap_1_angle_3", "rotor_speed")
    law = LoadController(flap_model.turbine, ALL)
    case: dict[str, Any] = {"duration": 20.0, "channels": channels, "controller": law}
    found = meltemi.analysis.sensitivity(meltemi.Run(flap_model, wind, **case), PARAMETERS)
    assert found.switches["controller"] == 0
    run = Simulation(Run(flap_model, wind, **case), numbers="floats")
    march(run)
    assert np.all(np.abs(found.result.data - run.result().data).max(axis=0) < 1e-9 * np.abs(found.result.data).max(0))
    for number, name in enumerate(PARAMETERS):
        low, high, step = meltemi.analysis.finite_difference_runs(
            meltemi.Run(flap_model, wind, **case), name, step=1e-5 * abs(found.values[number])
        )
        exact = found.slopes[..., number]
        size = np.abs(exact).max(axis=0)
        change = (high.data - low.data) / (2.0 * step)
        error = np.abs(change - exact).max(axis=0) / size
        assert np.all(size > 0.0) and error.max() < 1e-4, (name, error)


@pytest.mark.long  # two minutes of compilation
@only_compiled
def test_switches_of_all_parts_are_counted(flap_model: Model) -> None:
    """Below rated the pitch demands rest on their limit; with little authority so do the axes of the flaps."""
    case: dict[str, Any] = {"duration": 10.0, "channels": ["pitch_1"]}
    name = "controller.loop_1_tilt_integral_gain"
    counts = []
    for loop, wind in ((PITCH, SteadyWind(speed=8.0, shear_exponent=0.2)), (FLAP.replace(authority=0.01), WIND)):
        law = LoadController(flap_model.turbine, LoadControl(loops=(loop,)))
        step = {name: 0.1 * abs(loop.integral_gain)}
        counts.append(
            meltemi.analysis.sensitivity(
                meltemi.Run(flap_model, wind, controller=law, **case), [name], steps=step
            ).switches
        )
    assert all(count["controller"] for count in counts)


@pytest.mark.long  # kernels of floats around the load control
def test_lanes_and_floats_agree(flapped: Turbine) -> None:
    """With the induction's iterations to their end: where they stop early, rounding decides where."""
    model = meltemi.build(flapped, meltemi.ModelOptions().replace(**{"advanced.induction_tolerance": 0.0}))
    runs = []
    for numbers in ("lanes", "floats"):
        law = LoadController(flapped, ALL)
        run = Simulation(Run(model, WIND, duration=20.0, channels=["all"], controller=law), numbers=numbers)
        march(run)
        keep = [name not in ("induction_residual", "azimuth") for name in run.result().names]
        runs.append(run.result().data[:, keep])
    scale = np.abs(runs[1]).max(axis=0) + 1e-5
    assert np.max(np.abs(runs[0] - runs[1]) / scale) < 1e-10
