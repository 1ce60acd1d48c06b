"""Power spectra, their peaks, and series without bands."""

from __future__ import annotations

from math import inf, isnan, pi, sqrt
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from comparisons import thinned
from meltemi import InputError, Result
from meltemi.postprocess.bands import harmonic_bands, ideal_removal, remove_bands
from meltemi.postprocess.spectra import average_spectra, decibels, power_spectrum, rotor_frequency, spectral_peak
from meltemi.simulation.channels import standard

Float = NDArray[np.float64]
DT, T = 0.05, 600.0
TIME = np.arange(round(T / DT)) * DT
P = 0.2
"""[Hz] Rotor frequency with whole periods in the record."""


def noise(seed: int = 1, n: int = len(TIME)) -> Float:
    return np.random.default_rng(seed).standard_normal(n)


def tone(frequency: float, amplitude: float = 1.0, phase: float = 0.3) -> Float:
    return amplitude * np.sin(2.0 * pi * frequency * TIME + phase)


def result(time: Any, **columns: Any) -> Result:
    channels = tuple(standard()[name] for name in columns)
    return Result(np.asarray(time, float), np.stack([np.asarray(c, float) for c in columns.values()], axis=1), channels)


# spectra


@pytest.mark.parametrize("n", [400, 401])
def test_the_integral_is_the_variance_under_the_window(n: int) -> None:
    x = noise(n=n) + 3.0
    window = 0.5 - 0.5 * np.cos(2.0 * pi * np.arange(n) / n)
    expected = np.sum((window * (x - x.mean())) ** 2) / np.sum(window**2)
    spectrum = power_spectrum(x, dt=0.1, segments=1)
    assert spectrum.variance == pytest.approx(expected, rel=1e-12)
    assert spectrum.segments == 1
    assert spectrum.degrees_of_freedom == pytest.approx(2.0)


def test_noise_is_flat_and_scatters_as_its_degrees_of_freedom_say() -> None:
    x = np.random.default_rng(3).normal(0.0, 2.0, 400_000)
    spectrum = power_spectrum(x, dt=0.05, resolution=0.1)
    inner = spectrum.density[3:-3]
    assert inner.mean() == pytest.approx(2.0 * 4.0 * 0.05, rel=0.01)  # 2 sigma^2 dt
    assert spectrum.variance == pytest.approx(x.var(), rel=0.01)
    ratios = np.concatenate(
        [power_spectrum(y, dt=0.05, resolution=0.1).density[3:-3] / 0.4 for y in x.reshape(80, 5000)]
    )
    one = power_spectrum(x[:5000], dt=0.05, resolution=0.1)
    assert one.segments == 49
    assert ratios.var() == pytest.approx(2.0 / one.degrees_of_freedom, rel=0.1)
    low, high = one.interval()
    assert np.mean((ratios * low < 1.0) & (ratios * high > 1.0)) == pytest.approx(0.95, abs=0.01)


def test_a_tone_has_its_power_where_it_belongs() -> None:
    spectrum = power_spectrum(tone(P, 3.0) + 100.0, dt=DT)
    assert spectrum.resolution == pytest.approx(0.02)
    assert spectrum.bandwidth == pytest.approx(0.03)
    assert spectrum.segments == 23
    found = spectral_peak(spectrum, P, 0.05)
    assert found.frequency == pytest.approx(P)
    assert found.variance == pytest.approx(4.5, rel=1e-9)
    assert found.density == pytest.approx(4.5 / spectrum.bandwidth, rel=1e-9)


def test_a_peak_stands_above_what_is_beside_it() -> None:
    x = noise() + tone(P, 2.0)
    spectrum = power_spectrum(x, dt=DT)
    at_1p, at_2p = spectral_peak(spectrum, P, 0.06), spectral_peak(spectrum, 2.0 * P, 0.06)
    assert at_1p.background == pytest.approx(2.0 * DT, rel=0.3)
    assert at_1p.decibels == pytest.approx(decibels(2.0 / 0.03, 2.0 * DT), abs=1.5)
    assert at_2p.decibels < 4.0
    assert isnan(spectral_peak(spectrum, P, 30.0).decibels)  # nothing is beside the whole spectrum


def test_decibels() -> None:
    assert decibels(100.0, 1.0) == pytest.approx(20.0)
    assert decibels(0.0, 1.0) == -inf
    assert isnan(decibels(1.0, 0.0))
    assert isnan(decibels(float("nan"), 1.0))


def test_channels_bring_their_unit_and_time() -> None:
    x = noise()
    run = result(100.0 + TIME, root_moment_out_of_plane_1=x)
    spectrum = power_spectrum(run, "RootMyc1", resolution=0.01)
    assert (spectrum.channel, spectrum.unit) == ("root_moment_out_of_plane_1", "N m")
    assert spectrum.density_unit == "(N m)^2/Hz"
    np.testing.assert_allclose(spectrum.density, power_spectrum(x, dt=DT, resolution=0.01).density, rtol=1e-9)


def test_times_in_single_precision_are_even() -> None:
    run = result((TIME + 100.0).astype(np.float32), wind_x=noise())
    assert power_spectrum(run, "wind_x").resolution == pytest.approx(0.02, rel=1e-6)


def test_numbers_of_segments() -> None:
    for k in (1, 2, 7, 30):
        assert power_spectrum(noise(), dt=DT, segments=k).segments == k
    apart = power_spectrum(noise(), dt=DT, segments=10, overlap=0.0)
    assert apart.degrees_of_freedom == pytest.approx(20.0)


def test_a_line_is_taken_out() -> None:
    x = noise() + 0.5 * TIME
    lines = power_spectrum(x, dt=DT, detrend="linear")
    assert lines.variance == pytest.approx(1.0, rel=0.05)
    assert power_spectrum(x, dt=DT).variance > 10.0


def test_spectra_of_seeds_are_averaged() -> None:
    a, b = (power_spectrum(noise(seed), dt=DT) for seed in (1, 2))
    mean = average_spectra([a, b])
    np.testing.assert_allclose(mean.density, 0.5 * (a.density + b.density))
    assert mean.segments == 46
    assert mean.degrees_of_freedom == pytest.approx(2.0 * a.degrees_of_freedom)
    with pytest.raises(InputError, match="must be the same"):
        average_spectra([a, power_spectrum(noise(), dt=DT, resolution=0.04)])
    with pytest.raises(InputError, match="no spectra"):
        average_spectra([])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"resolution": 1e-4}, "needs 10000 s, the series has 600 s"),
        ({"resolution": 0.1, "segments": 3}, "specify either the resolution or"),
        ({"resolution": 0.0}, "resolution must be positive"),
        ({"resolution": 10.0}, "a segment would have 2 values"),
        ({"segments": 0}, "segments must be a whole number of at least 1"),
        ({"overlap": 1.0}, "overlap must be"),
        ({"detrend": "cubic"}, "detrend must be"),
        ({"dt": None}, "needs its time step"),
        ({"dt": -1.0}, "dt must be positive"),
        ({"channel": "wind_x"}, "no channels"),
    ],
)
def test_what_a_spectrum_cannot_do(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        power_spectrum(noise(), **{"dt": DT, **arguments})


def test_bad_series_are_refused() -> None:
    x = noise()
    x[7] = np.nan
    with pytest.raises(InputError, match="not finite"):
        power_spectrum(x, dt=DT)
    with pytest.raises(InputError, match="row of at least two"):
        power_spectrum(np.zeros((10, 2)), dt=DT)
    with pytest.raises(InputError, match="evenly spaced"):
        power_spectrum(result(TIME**1.01, wind_x=noise()), "wind_x")
    with pytest.raises(InputError, match="fewer than two"):
        power_spectrum(result([0.0], wind_x=[1.0]), "wind_x")
    with pytest.raises(InputError, match="requires a channel"):
        power_spectrum(result(TIME, wind_x=noise()))
    spectrum = power_spectrum(noise(), dt=DT)
    with pytest.raises(InputError, match="no frequency within"):
        spectral_peak(spectrum, 50.0, 0.1)
    with pytest.raises(InputError, match="half_width"):
        spectral_peak(spectrum, 0.2, 0.0)
    with pytest.raises(InputError, match="confidence"):
        spectrum.interval(95.0)


def test_the_rotor_frequency() -> None:
    speed = 1.2 + 0.1 * np.sin(2.0 * pi * 0.05 * TIME)
    assert rotor_frequency(result(TIME, rotor_speed=speed)) == pytest.approx(1.2 / (2.0 * pi), rel=1e-4)
    azimuth = (1.2 * TIME + 5.0) % (2.0 * pi)
    assert rotor_frequency(result(TIME, azimuth=azimuth)) == pytest.approx(1.2 / (2.0 * pi), rel=1e-12)
    with pytest.raises(InputError, match="rotor_speed"):
        rotor_frequency(result(TIME, wind_x=azimuth))
    with pytest.raises(InputError, match="fewer than two"):
        rotor_frequency(result([0.0], rotor_speed=[1.0]))


# bands


def test_whole_periods_in_a_band_vanish_and_all_else_stays() -> None:
    rest = 4.0 + tone(0.1) + tone(0.6, 0.5, 1.0)
    x = rest + tone(P, 3.0) + tone(2.0 * P, 1.5, 2.0)
    left = remove_bands(x, DT, harmonic_bands(P, (1, 2), 0.25))
    np.testing.assert_allclose(left, rest, atol=1e-10)
    only = remove_bands(x, DT, [(0.15, 0.25)])
    np.testing.assert_allclose(only, rest + tone(2.0 * P, 1.5, 2.0), atol=1e-10)


def test_a_line_stays() -> None:
    line = 4.0 + 0.1 * TIME
    bands = harmonic_bands(P, (1, 2), 0.25)
    x = line + tone(P, 3.0) + tone(2.0 * P, 1.5, 2.0)
    np.testing.assert_allclose(remove_bands(x, DT, bands, detrend="linear"), line, atol=1e-9)
    jump = line[-1] - line[0]
    taken = line.var() - remove_bands(line, DT, [(0.15, 0.25)]).var()
    assert taken == pytest.approx(jump**2 / (2.0 * pi**2) * (1.0 / 90.0 - 1.0 / 150.0), rel=0.02)


def test_noise_outside_the_bands_stays() -> None:
    bands = harmonic_bands(P, (1, 2), 0.25)
    rest = remove_bands(noise(), DT, bands)
    np.testing.assert_allclose(remove_bands(rest, DT, bands), rest, atol=1e-12)
    x = rest + tone(P, 3.0) + tone(2.0 * P, 1.5, 2.0)
    found = ideal_removal(x, bands=bands, dt=DT, slope=10.0)
    wanted = ideal_removal(rest, bands=bands, dt=DT, slope=10.0)
    assert found.std**2 == pytest.approx(rest.var() + 4.5 + 1.125, rel=1e-12)
    assert found.std_left == pytest.approx(rest.std(), rel=1e-12)
    assert found.load_left == pytest.approx(wanted.load, rel=1e-12)
    assert wanted.std_change == pytest.approx(0.0, abs=1e-12)
    assert found.std_change == pytest.approx(rest.std() / sqrt(rest.var() + 5.625) - 1.0, rel=1e-12)
    assert found.load_change == pytest.approx(wanted.load / found.load - 1.0, rel=1e-12)
    # of the whole noise a share as wide as the bands goes
    assert 1.0 - rest.var() / noise().var() == pytest.approx(0.2 / 10.0, rel=0.2)


def test_of_a_tone_that_does_not_fit_little_stays() -> None:
    x = tone(P + 0.5 / T)
    left = remove_bands(x, DT, [(0.15, 0.25)])
    assert left.var() / x.var() < 0.01


@settings(derandomize=True, deadline=None, max_examples=50)
@given(
    st.lists(st.tuples(st.floats(0.0, 4.0), st.floats(0.5, 6.0)), min_size=1, max_size=3),
    st.integers(30, 61),
    st.integers(0, 99),
    st.sampled_from(["constant", "linear"]),
)
def test_removal_is_linear_and_keeps_the_mean(
    pairs: list[tuple[float, float]], n: int, seed: int, detrend: Literal["constant", "linear"]
) -> None:
    bands = [(low, low + width) for low, width in pairs]
    x, y = noise(seed, n) + 5.0, noise(seed + 100, n)
    a, b, both = (remove_bands(z, 0.1, bands, detrend=detrend) for z in (x, y, 2.0 * x - 3.0 * y))
    np.testing.assert_allclose(both, 2.0 * a - 3.0 * b, atol=1e-8)
    assert a.mean() == pytest.approx(x.mean(), abs=1e-10)
    again = remove_bands(a, 0.1, bands, detrend=detrend)
    np.testing.assert_allclose(again, a, atol=1e-8)
    if detrend == "constant":
        assert a.var() <= x.var() * (1.0 + 1e-12)


def test_a_window_of_the_record_is_judged() -> None:
    x = tone(P, 3.0) + tone(0.6, 1.0) * (TIME > 300.0)
    bands = [(0.15, 0.25)]
    run = result(50.0 + TIME, root_moment_out_of_plane_1=x)
    late = ideal_removal(run, "RootMyc1", bands=bands, between=(400.0, 500.0))
    assert late.slope == 10.0
    assert late.std == pytest.approx(sqrt(4.5 + 0.5), rel=0.01)
    assert late.std_left == pytest.approx(sqrt(0.5), rel=0.01)
    bare = ideal_removal(x, bands=bands, dt=DT, slope=10.0, between=(350.0, 450.0))
    assert bare.load_left == pytest.approx(late.load_left, rel=1e-9)


def test_nothing_changes_where_nothing_is() -> None:
    still = ideal_removal(np.full(100, 3.0), bands=[(0.1, 0.3)], dt=0.1, slope=4.0)
    assert isnan(still.std_change) or still.std < 1e-12
    all_gone = remove_bands(noise(n=64), 0.1, [(0.0, 5.0)])
    np.testing.assert_allclose(all_gone, noise(n=64).mean(), atol=1e-12)
    kept = remove_bands(noise(n=64), 0.1, [])
    np.testing.assert_array_equal(kept, noise(n=64))


def test_bad_bands_are_refused() -> None:
    x = noise()
    for band in ((0.3, 0.2), (-0.1, 0.2), (0.2, 0.2), (float("nan"), 1.0)):
        with pytest.raises(InputError, match="a band must go"):
            remove_bands(x, DT, [band])
    with pytest.raises(InputError, match="contains no frequency"):
        remove_bands(x, DT, [(11.0, 12.0)])
    with pytest.raises(InputError, match="detrend must be"):
        remove_bands(x, DT, [(0.1, 0.2)], detrend="cubic")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="must be positive"):
        harmonic_bands(0.0, (1,), 0.2)
    with pytest.raises(InputError, match="a band must go"):
        harmonic_bands(0.2, (1,), 1.5)
    with pytest.raises(InputError, match="harmonic_bands: multiples: expected numbers in a regular list"):
        harmonic_bands(0.2, (1, (2,)), 0.25)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="specify the slope"):
        ideal_removal(x, bands=[(0.1, 0.2)], dt=DT)
    with pytest.raises(InputError, match="specify the slope"):
        ideal_removal(result(TIME, wind_x=x), "wind_x", bands=[(0.1, 0.2)])
    with pytest.raises(InputError, match="fewer than two values"):
        ideal_removal(x, bands=[(0.1, 0.2)], dt=DT, slope=4.0, between=(700.0, 800.0))


def test_what_ideal_control_of_harmonics_could_reach() -> None:
    """Blade-root moment in turbulence at 20 m/s with collective pitch control, in four runs of OpenFAST."""
    runs = thinned("turbulent_runs")
    one, both = [], []
    for x in (runs["root_moment_counts"] * runs["root_moment_steps"]).T:
        one.append(ideal_removal(x, dt=0.1, bands=[(0.15, 0.25)], slope=10.0))
        both.append(ideal_removal(x, dt=0.1, bands=[(0.15, 0.25), (0.35, 0.45)], slope=10.0))
    for found, std, load in ((one, (-0.31, -0.26), (-0.29, -0.225)), (both, (-0.355, -0.315), (-0.365, -0.295))):
        assert std[0] < min(c.std_change for c in found) and max(c.std_change for c in found) < std[1]
        assert load[0] < min(c.load_change for c in found) and max(c.load_change for c in found) < load[1]
