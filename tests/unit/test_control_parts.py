"""Parts of load controllers against their transfer functions, exact identities and numbers by hand.

Filters run on long sampled sines; their response is the sum over whole periods. Where nothing but rounding separates
the two sides the tolerance is 1e-9, at the end of transients 1e-6.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numba
import numpy as np
import pytest
from kernel_arrays import call
from numpy.typing import NDArray

from meltemi.compiler import N_DERIVATIVES, Entries, Numbers, Table, blades, number, part, parts
from meltemi.compiler.kernels import FAST_MATH
from meltemi.control.dual_updates import update_of_duals
from meltemi.control_laws.feedforward import FeedforwardWeights, blade_wind, weight, weight_settings
from meltemi.control_laws.filters import (
    LowPass,
    SecondOrder,
    band_pass,
    check_harmonic,
    lag,
    low_pass,
    low_pass_start,
    notch,
    response,
    second_order_start,
)
from meltemi.control_laws.integrator import Integrator, back_calculate, integrator, integrator_settings
from meltemi.control_laws.multiblade import add_to_blades, blade_angle, to_blade, to_fixed
from meltemi.control_laws.sensors import Delay, Noise, delay, delay_start, noise, noise_start, normal, philox
from meltemi.core.errors import InputError

pytestmark = pytest.mark.slow

Float = NDArray[np.float64]
ROTOR = 1.2671
"""[rad/s] 12.1 revolutions per minute."""
ZETA = 0.25
RATES = (0.0125, 0.05, 0.2)
compiled: Any = (lambda f: f) if numba.config.DISABLE_JIT else numba.njit(fastmath=FAST_MATH, error_model="numpy")


def filtered(kind: str, signal: Float, w: Float | float, dt: float, zeta: float = ZETA) -> Float:
    """A signal behind a filter from rest, with a centre that may move."""
    vector, out = np.zeros(5), np.zeros(len(signal))
    first, second = LowPass(vector[2:3]), SecondOrder(vector[2:4])
    centre = np.broadcast_to(w, signal.shape)
    for k, value in enumerate(signal):
        if kind == "low_pass":
            out[k] = low_pass(first, value, centre[k], dt)
        else:
            out[k] = {"band_pass": band_pass, "notch": notch}[kind](second, value, centre[k], zeta, dt)
    assert not vector[:2].any() and (kind != "low_pass" or not vector[3:].any())  # only its own places
    return out


def analytic(kind: str, frequency: float, w: float, zeta: float = ZETA) -> complex:
    s = 1j * frequency
    below = s * s + 2.0 * zeta * w * s + w * w
    return {"low_pass": w / (s + w), "band_pass": 2.0 * zeta * w * s / below, "notch": (s * s + w * w) / below}[kind]


def measured_response(kind: str, frequency: float, w: float, dt: float) -> complex:
    """Gain and phase by projection of the end of a sine, after 25 of the slowest time constants."""
    lead = int(25.0 / (min(ZETA, 1.0) * w * dt))
    t = dt * np.arange(lead + 4000)
    out = filtered(kind, np.cos(frequency * t), w, dt)
    basis = np.stack([np.cos(frequency * t), -np.sin(frequency * t)], 1)
    (re, im), *_ = np.linalg.lstsq(basis[lead:], out[lead:], rcond=None)
    return complex(re, im)


@pytest.mark.parametrize("dt", RATES)
@pytest.mark.parametrize("kind", ["low_pass", "band_pass", "notch"])
def test_response_is_the_analytic_one(kind: str, dt: float) -> None:
    """At the centre exactly; elsewhere that of the continuous filter at the warped frequency, everywhere."""
    w = 2.0 * ROTOR
    centre = measured_response(kind, w, w, dt)
    assert abs(centre - analytic(kind, w, w)) < 1e-6
    if kind == "band_pass":
        assert abs(abs(centre) - 1.0) < 1e-6 and abs(math.atan2(centre.imag, centre.real)) < 1e-6
    for ratio in (0.25, 0.5, 0.9, 1.5, 3.0):
        if ratio * w * dt > 3.0:
            continue
        found = measured_response(kind, ratio * w, w, dt)
        warped = w * math.tan(0.5 * ratio * w * dt) / math.tan(0.5 * w * dt)
        assert abs(found - analytic(kind, warped, w)) < 1e-6
        assert abs(found - response(kind, ratio * w, w, ZETA, dt)) < 1e-6
        # and the error of sampling is of the order (w dt)^2
        assert abs(found - analytic(kind, ratio * w, w)) < 0.5 * (max(ratio, 1.0) * w * dt) ** 2
        assert response(kind, ratio * w, w, ZETA, 0.0) == pytest.approx(analytic(kind, ratio * w, w), abs=1e-14)


def test_a_signal_at_a_moving_centre_passes_unchanged() -> None:
    """The rotor speeds up from 0.8 to 1.27 rad/s in a minute: 2P stays within 2 % through the band-pass."""
    dt = 0.05
    t = dt * np.arange(4000)
    speed = 0.8 + 0.47 * np.clip((t - 80.0) / 60.0, 0.0, 1.0)
    psi = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * dt)])
    out = filtered("band_pass", np.cos(2.0 * psi), 2.0 * speed, dt)
    assert np.abs(out - np.cos(2.0 * psi))[1200:].max() < 0.02
    held = filtered("band_pass", np.cos(2.0 * psi), 2.0 * 0.8, dt)
    assert np.abs(held - np.cos(2.0 * psi))[3200:].max() > 0.5
    assert np.abs(filtered("notch", np.cos(2.0 * psi), 2.0 * speed, dt))[1200:].max() < 0.02


def test_no_change_of_the_centre_feeds_a_filter() -> None:
    """The states' sum of squares falls at every call without input, whatever the centre does, standstill included."""
    rng = np.random.default_rng(3)
    x = np.array([1.0, -2.0])
    centres, dampings = rng.uniform(-200.0, 200.0, 2000) * rng.integers(0, 2, 2000), rng.uniform(0.0, 2.0, 2000)
    for w, zeta in zip(centres, dampings, strict=True):
        before = x @ x
        band_pass(SecondOrder(x), 0.0, w, zeta, 0.05)
        assert x @ x <= before * (1.0 + 1e-14)


def test_a_started_filter_gives_no_jump() -> None:
    low, band, stop = LowPass.of(), SecondOrder.of(), SecondOrder.of()
    for x in (low, band, stop):
        x.array[:] = np.nan
    low_pass_start(low, 7.0)
    second_order_start(band, 7.0)
    second_order_start(stop, 7.0)
    for w in (1.0, 2.0, 0.3):
        assert low_pass(low, 7.0, w, 0.05) == 7.0
        assert band_pass(band, 7.0, w, ZETA, 0.05) == 0.0
        assert notch(stop, 7.0, w, ZETA, 0.05) == 7.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((2, 1.27, 2.0), "half the sampling rate"),
        ((1, np.pi, 1.0), "half the sampling rate"),
        ((0, 1.27, 0.1), "from 1 on"),
        ((1.5, 1.27, 0.1), "whole"),
        ((3, 1.27, 0.1), "3 blades"),
        ((1, 1.27, 0.1, 2), "2 blades"),
        ((1, 0.0, 0.1), "speed"),
        ((1, 1.27, -0.1), "sample_time"),
    ],
)
def test_harmonics_that_cannot_be_are_refused(arguments: tuple[Any, ...], words: str) -> None:
    with pytest.raises(InputError, match=words):
        check_harmonic(*arguments)


def test_harmonics_that_can_be_are_not() -> None:
    for harmonic in (1, 2, 4, 5):
        check_harmonic(harmonic, 1.2671, 0.05)
    with pytest.raises(InputError, match="sampling"):
        response("notch", 100.0, 1.0, 0.2, 0.05)
    with pytest.raises(InputError, match="kind"):
        response("high_pass", 1.0, 1.0, 0.2, 0.05)


# multi-blade coordinates ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("blades", [3, 4, 5])
@pytest.mark.parametrize("harmonic", [1, 2])
def test_a_signal_at_its_harmonic_comes_back(harmonic: int, blades: int) -> None:
    if (2 * harmonic) % blades == 0:
        return
    for psi in np.linspace(0.0, 7.0, 23):
        angles = harmonic * (psi + 2.0 * np.pi * np.arange(blades) / blades)
        x = np.full(blades + 1, 99.0)
        x[:blades] = 1.3 * np.cos(angles) - 0.7 * np.sin(angles)
        tilt, yaw = to_fixed(x, blades, psi, harmonic)
        assert (tilt, yaw) == pytest.approx((1.3, -0.7), abs=1e-12)
        back = [to_blade(tilt, yaw, i, blades, psi, harmonic, 0.0) for i in range(blades)]
        np.testing.assert_allclose(back, x[:blades], atol=1e-12)
        ahead = np.ones(blades + 1)
        add_to_blades(ahead, blades, tilt, yaw, psi, harmonic, 0.4)
        np.testing.assert_allclose(
            ahead[:-1], 1.0 + 1.3 * np.cos(angles + 0.4) - 0.7 * np.sin(angles + 0.4), atol=1e-12
        )
        assert ahead[-1] == 1.0


@pytest.mark.parametrize("harmonic", [1, 2])
def test_recovery_behind_the_band_pass(harmonic: int) -> None:
    """A pure nP signal of all blades, filtered about nP, transformed and back, is the signal."""
    dt, w = 0.05, harmonic * ROTOR
    t = dt * np.arange(2600)
    angle = harmonic * (ROTOR * t[:, None] + 2.0 * np.pi * np.arange(3) / 3.0)
    blades = 0.8 * np.cos(angle) + 0.5 * np.sin(angle)
    out = np.stack([filtered("band_pass", blades[:, i], w, dt) for i in range(3)], 1)
    for k in range(2500, 2600):
        tilt, yaw = to_fixed(np.ascontiguousarray(out[k]), 3, ROTOR * t[k], harmonic)
        assert (tilt, yaw) == pytest.approx((0.8, 0.5), abs=1e-9)
        back = [to_blade(tilt, yaw, i, 3, ROTOR * t[k], harmonic, 0.0) for i in range(3)]
        np.testing.assert_allclose(back, blades[k], atol=1e-9)


@pytest.mark.parametrize(("seen", "frame"), [(1, 2), (2, 1)])
def test_the_other_harmonic_appears_as_3p(seen: int, frame: int) -> None:
    psi = 2.0 * np.pi * np.arange(64) / 64
    tilt, yaw = np.array([to_fixed(np.cos(seen * (p + 2.0 * np.pi * np.arange(3) / 3.0)), 3, p, frame) for p in psi]).T
    np.testing.assert_allclose(tilt, np.cos(3.0 * psi), atol=1e-12)
    np.testing.assert_allclose(yaw, np.sin(3.0 * psi), atol=1e-12)


def test_offset_undoes_the_lag_of_filter_and_actuator() -> None:
    """A demand that leads by the lag of what lies behind it arrives in phase."""
    g_low, g_band = response("low_pass", ROTOR, 4.0, 0.0, 0.05), response("band_pass", ROTOR, 1.1 * ROTOR, ZETA, 0.05)
    phi = lag(g_low, g_band)
    assert phi == pytest.approx(-math.atan2(g_low.imag, g_low.real) - math.atan2(g_band.imag, g_band.real), abs=1e-14)
    t = 0.05 * np.arange(2000)
    demand = np.array([to_blade(1.0, 0.0, 1, 3, ROTOR * a, 1, phi) for a in t])
    out = filtered("band_pass", filtered("low_pass", demand, 4.0, 0.05), 1.1 * ROTOR, 0.05)
    wanted = abs(g_low * g_band) * np.cos([blade_angle(ROTOR * a, 1, 3) for a in t])
    np.testing.assert_allclose(out[1500:], wanted[1500:], atol=1e-6)


# sensors ------------------------------------------------------------------------------------------------------


def test_bits_are_those_of_the_published_generator() -> None:
    """Known answers distributed with Random123."""
    ones = 0xFFFFFFFF
    assert philox(0, 0, 0) == (0xFF1DAE59, 0x6CD10DF2)
    assert philox(ones, ones, ones) == (0x2C3F628B, 0xAB4FD7AD)
    assert philox(0x243F6A88, 0x85A308D3, 0x13198A2E) == (0xDD7CE038, 0xF62A4C12)


def test_noise_is_white_and_normal() -> None:
    n = 20000
    z = np.array([normal(k, 0, 5) for k in range(n)])
    assert abs(z.mean()) < 4.0 / math.sqrt(n)
    assert abs(z.std() - 1.0) < 4.0 / math.sqrt(2.0 * n)
    assert abs((z**3).mean()) < 4.0 * math.sqrt(6.0 / n)
    assert abs((z**4).mean() - 3.0) < 4.0 * math.sqrt(24.0 / n)
    for shift in (1, 2, 3, 10):
        assert abs((z[shift:] * z[:-shift]).mean()) < 4.0 / math.sqrt(n)
    other, stream = np.array([[normal(k, 0, 6), normal(k, 1, 5)] for k in range(n)]).T
    assert abs((z * other).mean()) < 4.0 / math.sqrt(n) and abs((z * stream).mean()) < 4.0 / math.sqrt(n)


def test_noise_repeats_with_its_seed() -> None:
    sources = [noise_start(seed, stream) for seed, stream in ((2, 0), (2, 0), (3, 0))]
    first, again, other = (np.array([noise(x, 0.5) for _ in range(50)]) for x in sources)
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(first, [0.5 * normal(k, 0, 2) for k in range(50)])
    assert not np.any(first == other)
    assert sources[0].count == 50.0
    wrong: tuple[tuple[Any, int], ...] = ((-1, 0), (2**32, 0), (0.5, 0), (0, -1))
    for seed, stream in wrong:
        with pytest.raises(InputError, match="whole number"):
            noise_start(seed, stream)


@pytest.mark.parametrize("samples", [0, 1, 2, 7])
def test_delay_is_exact(samples: int) -> None:
    vector = np.full(samples + 4, -1.0)
    vector[1:-1] = delay_start(samples, 3.0).array
    x = Delay(vector[1:-1])
    signal = np.random.default_rng(1).normal(size=50)
    out = np.array([delay(x, value) for value in signal])
    np.testing.assert_array_equal(out, np.concatenate([np.full(samples, 3.0), signal])[:50])
    assert vector[0] == -1.0 and vector[-1] == -1.0
    for wrong in (-1, 0.5):
        with pytest.raises(InputError, match="whole"):
            delay_start(wrong)  # type: ignore[arg-type]


# feed-forward -------------------------------------------------------------------------------------------------


def weights(x: FeedforwardWeights, psi: float) -> Float:
    return np.array([weight(x, i, 3, psi) for i in range(3)])


def test_weights_of_shear() -> None:
    """Reference turbine, two thirds of the radius, power law 0.2: 0.790 below to 1.180 above, 1P amplitude 0.195."""
    x = weight_settings(radius=42.0, hub_height=90.0, shear=0.2)
    psi = np.radians(np.arange(0.0, 360.0, 1.0))
    k = np.array([weights(x, p) for p in psi])
    np.testing.assert_allclose(k.sum(axis=1), 3.0, atol=1e-12)
    assert k[:, 0].min() == pytest.approx(0.790, abs=0.002) and k[:, 0].argmin() == 180
    assert k[:, 0].max() == pytest.approx(1.180, abs=0.002) and k[:, 0].argmax() == 0
    assert 2.0 * (k[:, 0] * np.cos(psi)).mean() == pytest.approx(0.195, abs=0.001)
    np.testing.assert_allclose(k[:, 1], np.roll(k[:, 0], -120), atol=1e-12)
    # by hand, blade 1 up
    v = [(1.0 + 42.0 / 90.0) ** 0.2, (1.0 - 21.0 / 90.0) ** 0.2]
    assert k[0, 0] == pytest.approx(3.0 * v[0] ** 2 / (v[0] ** 2 + 2.0 * v[1] ** 2), abs=1e-12)
    np.testing.assert_allclose(weights(weight_settings(radius=42.0, hub_height=90.0, shear=0.0), 1.0), 1.0, atol=1e-14)


def test_weights_with_a_tower() -> None:
    """Behind the tower the potential flow by hand; above the hub none; no jump anywhere."""
    x = weight_settings(radius=42.0, hub_height=90.0, shear=0.2, tower_radius=2.4, clearance=5.0)
    none = weight_settings(radius=42.0, hub_height=90.0, shear=0.2)
    assert blade_wind(x, np.pi) == pytest.approx((1.0 - 42.0 / 90.0) ** 0.2 * (1.0 - (2.4 / 5.0) ** 2), abs=1e-12)
    y = 42.0 * np.sin(2.5)
    dip = 1.0 - 2.4**2 * (25.0 - y * y) / (25.0 + y * y) ** 2
    assert blade_wind(x, 2.5) == pytest.approx(blade_wind(none, 2.5) * dip, abs=1e-12)
    assert blade_wind(x, 0.3) == blade_wind(none, 0.3)
    k = np.array([weights(x, p) for p in np.radians(np.arange(0.0, 360.0, 0.05))])
    np.testing.assert_allclose(k.sum(axis=1), 3.0, atol=1e-12)
    assert k[:, 0].min() == pytest.approx(0.52, abs=0.02)
    assert np.abs(np.diff(k[:, 0])).max() < 0.005


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"radius": 90.0}, "below hub_height"),
        ({"shear": -0.1}, "shear"),
        ({"exponent": math.nan}, "exponent"),
        ({"tower_radius": 2.0}, "clearance"),
    ],
)
def test_settings_that_cannot_be_are_refused(change: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        weight_settings(**{"radius": 42.0, "hub_height": 90.0, "shear": 0.2, **change})


# integrator ---------------------------------------------------------------------------------------------------


def test_law_within_its_limits() -> None:
    """The integral of a constant error, its proportional part, and the derivative of a ramp."""
    vector = np.full(len(Integrator) + 1, 9.0)
    vector[1:] = integrator_settings(proportional_gain=2.0, integral_gain=0.5, integral=0.3).array
    x = Integrator(vector[1:])
    for _ in range(40):
        demand = integrator(x, 0.1, -9.0, 9.0, 0.05)
    assert demand == pytest.approx(0.2 + 0.3 + 0.5 * 0.1 * 2.0, abs=1e-12)
    assert vector[0] == 9.0
    x = integrator_settings(derivative_gain=2.0, derivative_frequency=5.0)
    for k in range(1, 200):
        demand = integrator(x, 0.3 * 0.05 * k, -9.0, 9.0, 0.05)
    assert demand == pytest.approx(0.6, abs=1e-12)
    x = integrator_settings(derivative_gain=2.0, derivative_frequency=5.0, error=0.7)
    assert integrator(x, 0.7, -9.0, 9.0, 0.05) == 0.0


def loop(tracking_time: float, limit: float = 1.0) -> tuple[Float, Float]:
    """Speed and demand of dv/dt = demand - load under PI; for 60 s the load is twice what the limit allows."""
    dt = 0.01
    x = integrator_settings(proportional_gain=1.4, integral_gain=1.0, tracking_time=tracking_time)
    v, speeds, demands = 0.0, [], []
    for k in range(12000):
        u = integrator(x, 0.0 - v, -limit, limit, dt)
        v += dt * (u - (0.5 if k > 6000 else 1.2))
        speeds.append(v)
        demands.append(u)
    return np.array(speeds), np.array(demands)


def recovery(tracking_time: float) -> float:
    """Time [s] at the limit after an error, held at 2 for a minute, has become -0.5; proportional gain 1."""
    dt = 0.01
    x = integrator_settings(proportional_gain=1.0, integral_gain=0.5, tracking_time=tracking_time)
    for _ in range(6000):
        assert integrator(x, 2.0, -1.0, 1.0, dt) == 1.0
    for k in range(6000):
        if integrator(x, -0.5, -1.0, 1.0, dt) < 1.0:
            return k * dt
    return math.inf


@pytest.mark.parametrize("tracking_time", [0.0, 0.5])
def test_recovery_from_a_limit(tracking_time: float) -> None:
    """Less than the law's time constant k_p / k_i of 2 s; one that winds up takes two minutes and more."""
    assert recovery(tracking_time) < 2.0
    assert recovery(1e9) > 60.0
    speed, demand = loop(tracking_time)
    assert np.abs(demand).max() <= 1.0
    assert np.abs(speed[-1]) < 1e-3


def test_giving_back_draws_the_integral_to_what_was_done() -> None:
    x = integrator_settings(integral_gain=1.0, tracking_time=2.0, integral=3.0)
    for _ in range(40):
        back_calculate(x, x.integral, 1.0, 0.05)
    assert x.integral == pytest.approx(1.0 + 2.0 * math.exp(-1.0), abs=1e-12)
    x = integrator_settings(integral_gain=1.0, integral=3.0)
    back_calculate(x, 3.0, 1.0, 0.05)
    assert x.integral == 1.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"integral_gain": math.inf}, "finite"),
        ({"tracking_time": -1.0}, "tracking_time"),
        ({"derivative_gain": 1.0}, "derivative_frequency"),
    ],
)
def test_laws_that_cannot_be_are_refused(change: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        integrator_settings(**change)


# derivatives --------------------------------------------------------------------------------------------------


class PitchState(Table, title="individual pitch"):
    """All parts in one law, as a user declares them."""

    centre: float = number("-", "of the band-pass, over the speed")
    damping: float = number("-", "of the band-pass")
    offset: float = number("rad", "by which the demand leads")
    deviation: float = number("-", "of the noise")
    low_pass: Entries[LowPass] = parts(LowPass, 3)
    band_pass: Entries[SecondOrder] = parts(SecondOrder, 3)
    notch: SecondOrder = part(SecondOrder)
    axis: Integrator = part(Integrator)
    weights: FeedforwardWeights = part(FeedforwardWeights)
    noise: Noise = part(Noise)
    delay: Entries[Delay] = parts(Delay, 3)


class Signals(Table, title="signals"):
    """What the law of the test reads."""

    speed: float = number("rad/s", "of the rotor")
    azimuth: float = number("rad", "of the first blade")
    moment: Numbers = blades("N m", "of the blades")


class Wanted(Table, title="wanted"):
    """What it gives."""

    pitch: Numbers = blades("rad", "of the blades")
    filtered: Numbers = blades("N m", "of the blades")


def individual_pitch(state: Any, measurements: Any, demands: Any, dt: float) -> None:
    """All parts in one law: what a user writes."""
    x, measured, wanted = PitchState(state), Signals(measurements), Wanted(demands)
    speed, azimuth = measured.speed, measured.azimuth
    for b in range(3):
        moment = delay(x.delay[b], measured.moment[b] + noise(x.noise, x.deviation))
        low = low_pass(x.low_pass[b], moment, 4.0 * speed, dt)
        wanted.filtered[b] = band_pass(x.band_pass[b], low, x.centre * speed, x.damping, dt)
    tilt, yaw = to_fixed(wanted.filtered, 3, azimuth, 1)
    kept = notch(x.notch, tilt, 3.0 * speed, 0.2, dt)
    up = integrator(x.axis, kept, -0.03, 0.03, dt)
    for b in range(3):
        wanted.pitch[b] = up * weight(x.weights, b, 3, azimuth)
    add_to_blades(wanted.pitch, 3, up, 0.1 * yaw, azimuth, 1, x.offset)


def start_of_all() -> Float:
    x = PitchState.of(
        centre=1.0,
        damping=0.3,
        offset=0.4,
        deviation=0.1,
        axis=integrator_settings(proportional_gain=0.05, integral_gain=0.02, tracking_time=1.5),
        weights=weight_settings(radius=42.0, hub_height=90.0, shear=0.2, tower_radius=2.4, clearance=5.0),
        noise=noise_start(4),
        delay=[delay_start(1) for _ in range(3)],
    )
    return x.array


def run_of_all(slopes: tuple[Any, ...] | None, *arrays: Float) -> None:
    law = compiled(individual_pitch)

    def march(state: Any, measurements: Any, demands: Any) -> None:
        for k in range(100):
            measurements[1] = 0.05 * k * measurements[0]
            for i in range(3):
                measurements[2 + i] = math.cos(measurements[1] + 2.1 * i) + 0.3
            law(state, measurements, demands, 0.05)

    call(march, *arrays, kind="floats" if slopes is None else "duals", slopes=slopes)


@pytest.mark.long
@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="duals exist in compiled code only")
def test_derivatives_by_gains_equal_differences() -> None:
    """By centre, damping, offset, two gains, tracking time, shear and noise: the eight derivatives at once."""
    names = "centre damping offset axis_proportional_gain axis_integral_gain axis_tracking_time weights_shear deviation"
    places = [PitchState.index(name) for name in names.split()]
    assert len(places) == N_DERIVATIVES
    integral = PitchState.index("axis_integral")

    def outputs(x: Float) -> Float:
        """All demands, and the integral, whose demand is at a limit for a part of the run."""
        demands = np.zeros(6)
        run_of_all(None, x, np.array([ROTOR, 0.0, 0.0, 0.0, 0.0]), demands)
        return np.append(demands, x[integral])

    x, measured, demands = start_of_all(), np.array([ROTOR, 0.0, 0.0, 0.0, 0.0]), np.zeros(6)
    d_x, d_measured, d_demands = (np.zeros((len(a), N_DERIVATIVES)) for a in (x, measured, demands))
    d_x[places, range(N_DERIVATIVES)] = 1.0
    run_of_all((d_x, d_measured, d_demands), x, measured, demands)
    found = np.append(d_demands, d_x[integral, np.newaxis], axis=0)
    np.testing.assert_allclose(np.append(demands, x[integral]), outputs(start_of_all()), rtol=1e-12)
    for k, place in enumerate(places):
        ends = []
        for sign in (1.0, -1.0):
            other = start_of_all()
            other[place] += sign * 1e-6
            ends.append(outputs(other))
        difference = (ends[0] - ends[1]) / 2e-6
        size = np.abs(difference).max()
        assert size > 1e-4
        np.testing.assert_allclose(found[:, k], difference, atol=1e-7 * max(size, 1e-2))


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="compiled code only")
def test_parts_compile_into_a_user_controller() -> None:
    """For floats and for derivative runs, as the simulation compiles a user's function."""
    law: Callable[..., None] = numba.njit(individual_pitch)
    x, demands = start_of_all(), np.zeros(6)
    for _ in range(3):
        law(x, np.array([ROTOR, 0.3, 1.0, 0.5, -0.2]), demands, 0.05)
    assert np.all(np.isfinite(demands)) and demands.any()
    numba.njit(update_of_duals())(individual_pitch)
