"""Turbulent boxes: repeatable, with the mean, deviations, spectra and coherence of IEC 61400-1 edition 3."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.wind.fields import WindBox, check_coverage
from meltemi.wind.turbulence import turbulence

SPEED, INTENSITY, HUB, DIAMETER = 11.0, 0.16, 90.0, 126.0
SCALE = 42.0  # IEC: 42 m above 60 m
SINGLE = 1e-6
"""Relative: velocities are stored in single precision."""


def make(**changes: Any) -> WindBox:
    arguments = {"hub_height": HUB, "rotor_diameter": DIAMETER, "duration": 300.0, "points": 9, "dt": 0.2} | changes
    return turbulence(arguments.pop("speed", SPEED), arguments.pop("intensity", INTENSITY), **arguments)


@pytest.fixture(scope="module")
def box() -> WindBox:
    return make()


def fluctuations(box: WindBox) -> NDArray[np.float64]:
    """(T, Z, Y, 3) without the mean."""
    v = box.velocity.astype(float)
    return v - v.mean(axis=0)


def test_the_same_seed_gives_the_same_field(box: WindBox) -> None:
    np.testing.assert_array_equal(make().velocity, box.velocity)
    assert make().content_hash() == box.content_hash()


def test_another_seed_gives_another_field_of_the_same_kind(box: WindBox) -> None:
    other = make(seed=2)
    correlation = np.corrcoef(fluctuations(box)[:, 4, 4, 0], fluctuations(other)[:, 4, 4, 0])[0, 1]
    # independent: the standard error with 300 s / 10 s independent samples is 0.2
    assert abs(correlation) < 0.6
    assert other.velocity.shape == box.velocity.shape


def test_the_mean_is_the_profile_asked_for(box: WindBox) -> None:
    z = box.bottom + box.dz * np.arange(9)
    expected = SPEED * (z / HUB) ** 0.2
    mean = box.velocity.astype(float).mean(axis=0)
    # the fluctuations have no mean; adding 3000 numbers of single precision leaves 1e-6
    np.testing.assert_allclose(mean[:, :, 0], np.tile(expected[:, None], (1, 9)), rtol=0.0, atol=SPEED * SINGLE)
    np.testing.assert_allclose(mean[:, :, 1:], 0.0, rtol=0.0, atol=SPEED * SINGLE)


def test_the_shear_is_the_one_asked_for() -> None:
    mean = make(shear_exponent=0.0, intensity=0.05, duration=20.0).velocity.astype(float).mean(axis=0)
    np.testing.assert_allclose(mean[:, :, 0], SPEED, rtol=SINGLE * 10.0)


def test_the_standard_deviations_at_the_hub_are_met_exactly(box: WindBox) -> None:
    found = fluctuations(box)[:, 4, 4].std(axis=0)
    # IEC: sigma_v = 0.8 sigma_u, sigma_w = 0.5 sigma_u
    np.testing.assert_allclose(found, INTENSITY * SPEED * np.array([1.0, 0.8, 0.5]), rtol=10.0 * SINGLE)


def test_the_standard_deviations_elsewhere_are_about_the_same(box: WindBox) -> None:
    found = fluctuations(box).std(axis=0).mean(axis=(0, 1))
    expected = INTENSITY * SPEED * np.array([1.0, 0.8, 0.5])
    np.testing.assert_allclose(found[1:], expected[1:], rtol=1e-3)  # every point has the same spectrum
    # u is correlated by mixing phases, so its spectrum at a point is random; the hub's slowest waves, few and
    # strong, set the scale for all points
    np.testing.assert_allclose(found[0], expected[0], rtol=0.2)


@pytest.mark.parametrize("intensity", [0.0, 0.05, 0.3])
def test_intensities_from_none_to_much(intensity: float) -> None:
    found = fluctuations(make(intensity=intensity, duration=50.0))[:, 4, 4, 0].std()
    assert found == pytest.approx(intensity * SPEED, rel=10.0 * SINGLE, abs=SPEED * SINGLE)


def kaimal(f: NDArray[np.float64], length: float) -> NDArray[np.float64]:
    """Spectral density over the variance [s]: IEC 61400-1 ed. 3, B.14."""
    return 4.0 * length / SPEED / (1.0 + 6.0 * f * length / SPEED) ** (5.0 / 3.0)


@pytest.mark.parametrize(("component", "length"), [(0, 8.1 * SCALE), (1, 2.7 * SCALE), (2, 0.66 * SCALE)])
def test_spectra_are_kaimals(box: WindBox, component: int, length: float) -> None:
    x = fluctuations(box)[..., component]
    n = len(x)
    f = np.fft.rfftfreq(n, box.dt)[1:-1]
    density = (np.abs(np.fft.rfft(x, axis=0)[1:-1]) ** 2).mean(axis=(1, 2)) * 2.0 * box.dt / n
    shape = density / kaimal(f, length)
    if component == 0:
        # correlated phases make single frequencies scatter; averages over 60 of them, at 81 points, do not
        parts = np.array([p.mean() for p in np.array_split(shape, 12)])
        np.testing.assert_allclose(parts / parts.mean(), 1.0, rtol=0.0, atol=0.25)
    else:
        # only the phases are random, so every frequency has its share exactly
        np.testing.assert_allclose(shape / shape.mean(), 1.0, rtol=0.0, atol=1e-3)
    high = f > 0.8
    slope = np.polyfit(np.log(f[high]), np.log(density[high]), 1)[0]
    # Kaimal's own slope there is a little less than 5/3: 1 / (1 + U / (6 f L)) of it
    expected = np.polyfit(np.log(f[high]), np.log(kaimal(f[high], length)), 1)[0]
    assert slope == pytest.approx(expected, abs=0.15 if component == 0 else 1e-3)
    assert expected == pytest.approx(-5.0 / 3.0, abs=0.11)


def coherence(box: WindBox, component: int, apart: int, band: tuple[float, float]) -> float:
    """Real part of the coherence of points some columns or rows apart, averaged over a band and all pairs."""
    x = np.fft.rfft(fluctuations(box)[..., component], axis=0)
    f = np.fft.rfftfreq(len(box.velocity), box.dt)
    x = x[(f >= band[0]) & (f < band[1])]
    pairs = [(x[:, :, apart:], x[:, :, :-apart]), (x[:, apart:], x[:, :-apart])]
    cross = sum(np.sum(a * b.conj()).real for a, b in pairs)
    power = sum(0.5 * np.sum(np.abs(a) ** 2 + np.abs(b) ** 2) for a, b in pairs)
    return float(cross / power)


@pytest.fixture(scope="module")
def long_box() -> WindBox:
    return make(duration=1200.0, points=8, dt=0.5, seed=3)


@pytest.mark.parametrize("apart", [1, 2, 4])
@pytest.mark.parametrize("band", [(0.01, 0.03), (0.05, 0.08)])
def test_coherence_of_the_longitudinal_component_decays_with_distance_and_frequency(
    long_box: WindBox, apart: int, band: tuple[float, float]
) -> None:
    # IEC 61400-1 ed. 3, B.16
    r, f = apart * long_box.dy, np.linspace(*band, 50)
    expected = np.exp(-12.0 * np.sqrt((f * r / SPEED) ** 2 + (0.12 * r / (8.1 * SCALE)) ** 2)).mean()
    # 25 frequencies of a field with some 10 independent patches: a standard error of 0.05
    assert coherence(long_box, 0, apart, band) == pytest.approx(expected, abs=0.12)


def test_coherence_falls_with_distance_and_with_frequency(long_box: WindBox) -> None:
    near, far = (coherence(long_box, 0, apart, (0.01, 0.03)) for apart in (1, 5))
    fast = coherence(long_box, 0, 1, (0.4, 0.8))
    assert near > far + 0.2
    assert near > fast + 0.3
    assert abs(fast) < 0.05


@pytest.mark.parametrize("component", [1, 2])
def test_the_other_components_are_independent_from_point_to_point(long_box: WindBox, component: int) -> None:
    # 2400 values at 112 pairs: a standard error below 0.01
    assert abs(coherence(long_box, component, 1, (0.0, 1.0))) < 0.03


def test_the_components_are_independent_of_each_other(long_box: WindBox) -> None:
    x = fluctuations(long_box).reshape(-1, 3)
    correlation = np.corrcoef(x, rowvar=False)
    assert np.abs(correlation - np.eye(3)).max() < 0.1


@pytest.mark.parametrize(("hub", "diameter"), [(90.0, 126.0), (119.0, 178.3), (70.0, 115.0)])
def test_a_box_covers_the_rotor_it_was_made_for(hub: float, diameter: float) -> None:
    field = make(hub_height=hub, rotor_diameter=diameter, duration=30.0, points=5)
    check_coverage(field, hub_height=hub, radius=0.5 * diameter, reach=0.1 * diameter, duration=30.0)
    assert field.bottom > 0.0
    assert field.hub_height == hub
    # long enough not to repeat within the run either
    assert field.velocity.shape[0] * field.dt >= 30.0 + field.width / field.speed


def test_settings_stand_in_the_label(box: WindBox) -> None:
    assert box.label.startswith(
        "Kaimal turbulence 11 m/s, intensity 0.16, seed 1, shear exponent 0.2, 9 x 9 points, every 0.2 s, "
    )
    assert box.periodic


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"speed": 0.0}, "speed must be positive, found 0.0"),
        ({"speed": float("nan")}, "speed must be positive, found nan"),
        ({"hub_height": -1.0}, "hub_height must be positive"),
        ({"rotor_diameter": float("inf")}, "rotor_diameter must be positive"),
        ({"dt": 0.0}, "dt must be positive"),
        ({"intensity": 14.0}, r"intensity must be between 0 and 1 \(0.14 is 14 %\), found 14.0"),
        ({"intensity": -0.1}, "intensity must be between 0 and 1"),
        ({"points": 1}, "points must be an integer between 2 and 41, found 1"),
        ({"points": 42}, "points must be an integer between 2 and 41, found 42"),
        ({"duration": 0.0}, "duration must be positive"),
        ({"duration": float("nan")}, "duration must be positive"),
        ({"hub_height": 63.0}, "the rotor comes too close to the ground"),
    ],
)
def test_arguments_are_checked(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=f"turbulence: {message}"):
        make(**change)


@pytest.mark.parametrize("change", [{"seed": -1}, {"seed": 1.5}, {"points": 5.5}, {"shear_exponent": float("nan")}])
def test_arguments_numpy_would_refuse_are_named(change: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=f"turbulence: {next(iter(change))}"):
        make(**change, duration=5.0)
