"""Statistics, spectra and coherence of winds whose own are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from meltemi import InputError, SteadyWind, TurbulentWind, WindBox, WindSeries
from meltemi.report.tables import field_rows, series_rows
from meltemi.turbulence.statistics import hub_point
from meltemi.turbulence.targets import target_coherence
from meltemi.wind import field_statistics, series_statistics, wind_coherence, wind_spectrum

Float = NDArray[np.float64]
DT, SPEED = 0.1, 10.0


def box(u: Float, v: Float | None = None, w: Float | None = None, **more: Any) -> WindBox:
    """A box of components (T, Z, Y)."""
    parts = [u, np.zeros_like(u) if v is None else v, np.zeros_like(u) if w is None else w]
    velocity = np.stack(parts, axis=-1).astype(np.float32)
    return WindBox(velocity, **{"dt": DT, "dy": 10.0, "dz": 5.0, "bottom": 20.0, "speed": SPEED, **more})


def noise(*shape: int, seed: int = 0) -> Float:
    return np.random.default_rng(seed).standard_normal(shape)


def exponential(n: int, points: int, scale: float) -> Float:
    """(T, 1, points) series with the autocorrelation exp(-t / scale)."""
    a = np.exp(-DT / scale)
    x = lfilter([np.sqrt(1.0 - a * a)], [1.0, -a], noise(n + 2000, 2, points), axis=0)
    return x[2000:]


def test_a_sinusoid_has_its_deviation_and_direction() -> None:
    t = DT * np.arange(1000)
    wave = np.sin(2.0 * np.pi * 0.2 * t)[:, None, None] * np.ones((3, 3))
    found = field_statistics(box(8.0 + wave, -6.0 + 0.5 * wave, periodic=True, direction=0.1))
    assert found.speed == pytest.approx(10.0)
    assert found.direction == pytest.approx(0.1 + np.arctan2(6.0, 8.0))
    np.testing.assert_allclose(found.mean[1, 1], [8.0, -6.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(found.std[..., 0], np.sqrt(0.5), rtol=1e-5)
    np.testing.assert_allclose(found.intensity[1, 1], [0.1 * np.sqrt(0.5), 0.05 * np.sqrt(0.5), 0.0], atol=1e-6)
    np.testing.assert_allclose(found.covariance[:2, :2], [[0.5, 0.25], [0.25, 0.125]], rtol=1e-5)
    np.testing.assert_allclose([found.lowest[0, 0, 0], found.highest[0, 0, 0]], [7.0, 9.0], atol=0.01)
    # the integral of a cosine to its first zero, and none of what is constant
    np.testing.assert_allclose(found.hub_time_scale[:2], 1.0 / (2.0 * np.pi * 0.2), rtol=2e-3)
    np.testing.assert_allclose(found.grid_length_scale[:2], SPEED / (2.0 * np.pi * 0.2), rtol=2e-3)
    assert np.isnan(found.hub_time_scale[2])


@pytest.mark.parametrize("periodic", [True, False])
def test_integral_scales_of_exponential_series(periodic: bool) -> None:
    found = field_statistics(box(SPEED + exponential(20_000, 40, 2.0), periodic=periodic))
    assert found.grid_time_scale[0] == pytest.approx(2.0, rel=0.05)
    assert found.grid_length_scale[0] == pytest.approx(20.0, rel=0.05)
    assert found.hub_time_scale[0] == pytest.approx(2.0, rel=0.4)


def test_white_noise_forgets_at_once() -> None:
    found = field_statistics(box(noise(8000, 5, 5)))
    assert found.grid_time_scale[0] == pytest.approx(0.5 * DT, rel=0.05)
    assert found.std[..., 0].mean() == pytest.approx(1.0, rel=0.01)


def test_moments_are_those_of_double_precision() -> None:
    b = box(30.0 + noise(3001, 11, 9), noise(3001, 11, 9, seed=1), noise(3001, 11, 9, seed=2))
    found, v = field_statistics(b), b.velocity.astype(np.float64)
    np.testing.assert_allclose(found.mean, v.mean(axis=0), rtol=1e-10)
    np.testing.assert_allclose(found.std, v.std(axis=0), rtol=1e-10)
    np.testing.assert_array_equal(found.lowest, v.min(axis=0))
    np.testing.assert_array_equal(found.highest, v.max(axis=0))


def test_the_hub_is_the_nearest_point() -> None:
    b = box(noise(10, 7, 5))
    assert hub_point(b) == (3, 2)
    assert hub_point(b, 23.0) == (1, 2)
    assert field_statistics(b, 23.0).height == 25.0
    with pytest.raises(
        InputError, match="a hub height of 90 m lies outside the field, which reaches from 20 m to 50 m"
    ):
        hub_point(b, 90.0)


@pytest.mark.parametrize("n", [600, 601])
@pytest.mark.parametrize("where", ["hub", "grid"])
def test_a_spectrum_integrates_to_the_variance(n: int, where: Any) -> None:
    b = box(SPEED + exponential(n, 5, 2.0))
    found = wind_spectrum(b, "u", where=where, per_decade=None)
    variance = b.velocity[..., 0].astype(np.float64).var(axis=0)
    wanted = variance.mean() if where == "grid" else variance[hub_point(b)]
    assert found.density.sum() / (n * DT) == pytest.approx(wanted, rel=1e-6)
    assert set(found.count) == {10 if where == "grid" else 1}


def test_bands_hold_every_frequency_once() -> None:
    b = box(noise(1000, 3, 4))
    fine, found = wind_spectrum(b, "u", per_decade=None), wind_spectrum(b, "u", per_decade=5)
    assert found.count.sum() == len(fine.f) == 500
    assert np.sum(found.density * found.count) == pytest.approx(fine.density.sum())
    assert np.all(np.diff(found.f) > 0.0)
    assert wind_spectrum(b, "u", where="grid", per_decade=5).count[-1] == 12 * found.count[-1]


def test_the_spectrum_of_noise_is_flat_within_its_error() -> None:
    found = wind_spectrum(box(noise(4000, 10, 10)), "u", where="grid")
    error = (found.density / (2.0 * DT) - 1.0) * np.sqrt(found.count)  # points are independent
    assert np.abs(error).max() < 4.0
    assert error.std() == pytest.approx(1.0, abs=0.4)


def test_a_sinusoid_stands_at_its_frequency() -> None:
    t = DT * np.arange(1000)
    found = wind_spectrum(box(np.sin(2.0 * np.pi * 0.2 * t)[:, None, None] * np.ones((2, 2))), "u", per_decade=None)
    assert found.f[np.argmax(found.density)] == pytest.approx(0.2)
    assert found.density.max() == pytest.approx(0.5 * 1000 * DT, rel=1e-5)


@pytest.mark.parametrize("direction", ["lateral", "vertical"])
def test_what_is_the_same_everywhere_is_coherent_and_noise_is_not(direction: Any) -> None:
    same, own = noise(2000, 1, 1) * np.ones((6, 6)), noise(2000, 6, 6, seed=1)
    b = box(same, own, -same + own)
    np.testing.assert_allclose(wind_coherence(b, "u", [10.0, 20.0], direction=direction).coherence, 1.0, rtol=1e-6)
    found = wind_coherence(b, "v", [10.0, 20.0], direction=direction)
    assert np.abs(found.coherence * np.sqrt(found.count)).max() < 4.0
    # half of the variance in common
    half = wind_coherence(b, "w", [10.0], direction=direction)
    assert np.average(half.coherence[0], weights=half.count[0]) == pytest.approx(0.5, abs=0.03)


def test_coherence_keeps_its_sign_and_its_direction() -> None:
    signs = np.array([1.0, -1.0, 1.0, -1.0])
    b = box(noise(500, 1, 1) * signs * np.ones((3, 1)))
    lateral = wind_coherence(b, "u", [9.0, 11.0, 20.0])
    np.testing.assert_array_equal(lateral.separation, [10.0, 20.0])
    np.testing.assert_allclose(lateral.coherence, np.array([[-1.0], [1.0]]) * np.ones_like(lateral.f), rtol=1e-6)
    assert lateral.count.sum(axis=1).tolist() == [250 * 9, 250 * 6]
    np.testing.assert_allclose(wind_coherence(b, "u", [5.0], direction="vertical").coherence, 1.0, rtol=1e-6)


def test_what_cannot_be_asked_is_refused() -> None:
    b = box(noise(100, 3, 3))
    with pytest.raises(InputError, match="no component 'x'"):
        wind_spectrum(b, "x")  # type: ignore[arg-type]
    for separations in ([], [2.0], [10.0, 30.0]):
        with pytest.raises(InputError, match="separations must lie between 10 m and 20 m"):
            wind_coherence(b, "u", separations)
    with pytest.raises(InputError, match="at least 1 band"):
        wind_spectrum(b, "u", per_decade=0)
    with pytest.raises(InputError, match="at least 4 planes, found 3"):
        wind_spectrum(box(noise(3, 3, 3)), "u")


def test_targets_of_coherence() -> None:
    f = np.array([1e-3, 0.01, 0.1, 1.0, 100.0])
    kaimal = TurbulentWind(speed=10.0, intensity=0.1)
    u, v, w = target_coherence(kaimal, 90.0, f, 30.0, 40.0)
    np.testing.assert_allclose(u, np.exp(-12.0 * 50.0 * np.hypot(f / 10.0, 0.12 / 340.2)))  # ed. 3, B.16
    assert not v.any() and not w.any()
    together = target_coherence(kaimal.replace(coherent="all"), 90.0, f, 50.0)
    np.testing.assert_allclose(together, [u, u, u])
    mann = kaimal.replace(spectrum="mann")
    np.testing.assert_array_equal(target_coherence(mann, 90.0, f, 0.0), 1.0)
    near, far = (target_coherence(mann, 90.0, f, 0.0, z) for z in (1.0, 60.0))
    np.testing.assert_allclose(near[:, 0], 1.0, atol=0.05)
    assert np.all(far <= near + 1e-9)
    assert not far[:, -1].any()


@pytest.mark.slow
def test_mann_fields_have_the_target() -> None:
    """Averaged over many frequencies and pairs."""
    from meltemi.wind import WindGrid, generate_field

    wind = TurbulentWind(speed=12.0, intensity=0.14, spectrum="mann", dt=0.4)
    grid = WindGrid(points_y=7, points_z=7, dy=10.0, dz=10.0, bottom=60.0, hub_height=90.0)
    field = generate_field(wind, grid, 4000.0)
    for direction, apart in (("lateral", (10.0, 0.0)), ("vertical", (0.0, 10.0))):
        for c, name in enumerate("uvw"):
            found = wind_coherence(field, name, [10.0], direction=direction)  # type: ignore[arg-type]
            wanted = target_coherence(wind, 90.0, found.f, *apart)[c]
            some = found.f > 0.02
            np.testing.assert_allclose(found.coherence[0][some], wanted[some], atol=0.06)


def test_statistics_of_a_series() -> None:
    t = np.array([0.0, 1.0, 3.0])
    found = series_statistics(
        WindSeries(time=t, speed=[10.0, 12.0, 12.0], gust=[0.0, 0.0, 3.0], direction=[0.0, 0.2, -0.1])
    )
    assert found.names[:3] == ("hub_speed", "speed", "direction")
    assert found.duration == 3.0
    np.testing.assert_allclose(found.mean[:2], [(11.0 + 2.0 * 13.5) / 3.0, (11.0 + 24.0) / 3.0])
    # deviation of what is linear in between, from its integral
    fine = np.interp((np.arange(300_000) + 0.5) * 1e-5, t, [10.0, 12.0, 15.0])
    assert found.std[0] == pytest.approx(fine.std(), rel=1e-6)
    assert (found.lowest[0], found.highest[0]) == (10.0, 15.0)
    assert found.direction_range == pytest.approx(0.3)
    head, rows = series_rows(found)
    assert rows[0][:2] == ["hub speed", "m/s"]
    assert rows[2] == ["direction", "deg", *rows[2][2:]]
    assert float(rows[2][head.index("max")]) == pytest.approx(np.degrees(0.2), rel=1e-3)


def test_statistics_of_a_steady_wind() -> None:
    found = series_statistics(SteadyWind(speed=10.0, upflow=0.1, direction=0.2, shear_exponent=0.14))
    np.testing.assert_allclose(found.mean[:4], [10.0, 10.0, 0.2, 10.0 * np.tan(0.1)])
    assert found.mean[found.names.index("exponent")] == 0.14
    assert not found.std.any()
    assert found.duration == 0.0


def test_a_field_is_tabulated() -> None:
    found = field_statistics(box(SPEED + noise(500, 5, 5), noise(500, 5, 5)))
    head, rows = field_rows(found)
    assert len(rows) == 12
    assert all(len(row) == len(head) for row in rows)
    assert rows[0][:2] == ["hub", "u"]
    assert float(rows[0][head.index("mean m/s")]) == pytest.approx(found.mean[2, 2, 0], rel=1e-3)
    assert float(rows[3][head.index("intensity %")]) == pytest.approx(100.0 * found.intensity[..., 0].mean(), rel=1e-3)
    assert rows[2][head.index("length m")] == "-"
