"""Seas: spectra and moments, dispersion, kinematics, crests and spreading against closed forms."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from meltemi import InputError
from meltemi.compiler import View
from meltemi.sea.airy import WaveComponents, maccamy_fuchs, profiles, wave_number
from meltemi.sea.conditions import StillWater
from meltemi.sea.crest import Crest
from meltemi.sea.current import Current
from meltemi.sea.field import AHEAD, sea_field
from meltemi.sea.given import ComponentSea, ElevationSea
from meltemi.sea.irregular import IrregularSea, UserSpectrum
from meltemi.sea.pile import PileNode, PilePart, PileWater
from meltemi.sea.regular import RegularSea
from meltemi.sea.sea_part import sea_part
from meltemi.sea.spectra import default_peak_factor, jonswap
from meltemi.sea.spreading import Spreading
from meltemi.sea.statistics import sea_series, sea_statistics

G = 9.80665


def elevation(waves: WaveComponents, t: float) -> float:
    return float((waves.amplitude * np.exp(1j * waves.frequency * t)).real.sum())


def test_wave_numbers_satisfy_the_dispersion_relation() -> None:
    w = np.geomspace(1e-3, 20.0, 400)
    for depth in (5.0, 30.0, 4000.0):
        k = wave_number(w, depth)
        np.testing.assert_allclose(G * k * np.tanh(k * depth), w * w, rtol=1e-12)


def test_profiles_are_hyperbolic_and_stable_in_deep_water() -> None:
    k, z, h = np.array([0.02, 0.1, 0.5]), np.array([-30.0, -12.0, 0.0]), 30.0
    s, t, p = profiles(k, z, h)
    up = np.outer(z + h, k)
    np.testing.assert_allclose(s, np.cosh(up) / np.sinh(k * h), rtol=1e-12)
    np.testing.assert_allclose(t, np.sinh(up) / np.sinh(k * h), rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(p, np.cosh(up) / np.cosh(k * h), rtol=1e-12)
    deep = profiles(np.array([50.0]), np.array([-0.1]), 300.0)
    np.testing.assert_allclose(np.ravel(deep), math.exp(-5.0), rtol=1e-12)


@pytest.mark.parametrize(("factor", "ratio"), [(1.0, 1.4049), (3.3, 1.2859)])
def test_jonswap_has_its_moments(factor: float, ratio: float) -> None:
    """Hs^2 / 16, and the period of zero up-crossings that DNV-RP-C205 (3.5.5) gives for the peak factor."""
    w = np.linspace(1e-3, 60.0, 400_000)
    S = jonswap(w, 4.0, 10.0, factor)
    m0, m2 = np.trapezoid(S, w), np.trapezoid(S * w * w, w)
    assert m0 == pytest.approx(1.0, rel=3e-3 if factor == 1.0 else 2e-2)
    assert 10.0 / (2.0 * np.pi * np.sqrt(m0 / m2)) == pytest.approx(ratio, rel=5e-3)
    assert w[np.argmax(S)] == pytest.approx(2.0 * np.pi / 10.0, rel=1e-3)


def test_the_peak_factor_of_the_iec_is_continuous() -> None:
    assert default_peak_factor(4.0, 6.0) == 5.0
    assert default_peak_factor(4.0, 10.0) == pytest.approx(1.0, abs=1e-9)
    assert default_peak_factor(4.0, 7.2) == pytest.approx(5.0, rel=2e-2)
    assert default_peak_factor(4.0, 8.0) == pytest.approx(math.exp(1.15))


def test_random_phases_keep_the_variance_and_random_amplitudes_keep_its_mean() -> None:
    sea = IrregularSea(height=3.0, period=9.0)
    wanted = sea.density(sea.components(50.0, 0.0).frequency).sum() * 2.0 * np.pi / sea.repeat
    assert wanted == pytest.approx(9.0 / 16.0, rel=1e-2)
    found = [0.5 * (abs(sea.replace(seed=s).components(50.0, 0.0).amplitude) ** 2).sum() for s in (1, 2)]
    np.testing.assert_allclose(found, wanted, rtol=1e-12)
    random = [
        0.5 * (abs(sea.replace(seed=s, amplitudes="gaussian").components(50.0, 0.0).amplitude) ** 2).sum()
        for s in range(60)
    ]
    assert np.std(random) > 0.02 * wanted
    assert np.mean(random) == pytest.approx(wanted, abs=4.0 * np.std(random) / math.sqrt(60))


def test_white_noise_and_a_spectrum_by_values() -> None:
    white = IrregularSea(height=2.0, spectrum="white", frequencies=(0.3, 1.5))
    waves = white.components(100.0, 0.0)
    assert waves.frequency.min() >= 0.3
    assert 0.5 * (abs(waves.amplitude) ** 2).sum() == pytest.approx(0.25, rel=2e-3)
    own = IrregularSea(spectrum=UserSpectrum(frequency=[0.4, 0.6, 0.8], density=[0.0, 2.0, 0.0]))
    waves = own.components(100.0, 0.0)
    assert 0.5 * (abs(waves.amplitude) ** 2).sum() == pytest.approx(0.4, rel=1e-3)


@pytest.mark.parametrize("time", [60.0, 123.4])
def test_an_embedded_crest_has_its_height_and_the_expected_shape(time: float) -> None:
    sea = IrregularSea(height=8.0, period=13.0)
    crest = sea.replace(crest=Crest(height=9.0, time=time)).components(60.0, 600.0)
    assert elevation(crest, time) == pytest.approx(9.0, rel=1e-9)
    before, after = (elevation(crest, time + dt) for dt in (-0.01, 0.01))
    assert abs(after - before) < 1e-6
    assert elevation(crest, time + 0.5) < 9.0
    # the mean over seeds is the autocorrelation times the height: Tromans et al. (1991)
    lag, waves = 4.0, sea.components(60.0, 600.0)
    share = abs(waves.amplitude) ** 2 / (abs(waves.amplitude) ** 2).sum()
    expected = 9.0 * float((share * np.cos(waves.frequency * lag)).sum())
    many = [
        elevation(sea.replace(seed=s, crest=Crest(height=9.0, time=time)).components(60.0, 600.0), time + lag)
        for s in range(40)
    ]
    assert np.mean(many) == pytest.approx(expected, abs=4.0 * np.std(many) / math.sqrt(40))


def test_a_crest_may_be_given_by_the_height_of_its_wave() -> None:
    sea = IrregularSea(height=8.0, period=13.0, crest=Crest(height=14.0, of="crest to trough"))
    many = []
    for seed in range(12):
        waves = sea.replace(seed=seed).components(60.0, 600.0)
        many.append([elevation(waves, 60.0 + dt) for dt in np.arange(0.0, 9.0, 0.25)])
    mean = np.mean(many, axis=0)
    assert mean[0] - mean.min() == pytest.approx(14.0, rel=0.06)


def test_spreading_has_the_moments_of_its_density() -> None:
    sea = IrregularSea(height=3.0, period=9.0, direction=0.5, spreading=Spreading(exponent=2.0, directions=181))
    angle = sea.components(50.0, 0.0).direction + 0.5  # counter-clockwise of -0.5
    # cos^4 over half a turn: variance pi^2 / 12 - 5 / 8
    assert np.mean(angle) == pytest.approx(0.0, abs=5e-3)
    assert np.var(angle) == pytest.approx(np.pi**2 / 12.0 - 0.625, rel=2e-2)


def test_waves_and_wind_of_one_direction_travel_alike() -> None:
    """Directions are clockwise, as the wind's; those of OpenFAST's waves are counter-clockwise."""
    waves = RegularSea(height=2.0, period=9.0, direction=math.radians(30.0)).components(50.0, 0.0)
    field = sea_field(waves, 50.0, np.array([0.0]), 9.0)
    u, v = field.velocity[AHEAD, 0]
    assert math.atan2(-v, u) == pytest.approx(math.radians(30.0))
    flow = Current(uniform=1.0, direction=math.radians(30.0)).at(np.array([-3.0]), 50.0)[0]
    np.testing.assert_allclose(flow, [math.cos(math.radians(30.0)), -math.sin(math.radians(30.0))])


def test_a_field_has_the_closed_form_of_a_regular_wave() -> None:
    h, z, place = 40.0, np.array([-35.0, -10.0, 0.0]), (12.0, -7.0)
    waves = RegularSea(height=4.0, period=8.0, direction=0.3, phase=0.7).components(h, 0.0)
    field = sea_field(waves, h, z, 20.0, origin=place, slope=True)
    w, k = 2.0 * np.pi / 8.0, float(wave_number(np.array([2.0 * np.pi / 8.0]), h)[0])
    t = field.dt * (np.arange(len(field.elevation)) - AHEAD)
    phase = w * t - k * (place[0] * math.cos(-0.3) + place[1] * math.sin(-0.3)) + 0.7
    np.testing.assert_allclose(field.elevation, 2.0 * np.cos(phase), atol=1e-12)
    u = 2.0 * w * np.cosh(k * (z + h)) / np.sinh(k * h) * np.cos(phase)[:, None]
    np.testing.assert_allclose(field.velocity[:, :3, 0], u * math.cos(0.3), atol=1e-12)
    np.testing.assert_allclose(field.velocity[:, 3, 0], 2.0 * w * k * np.cos(phase) * math.cos(0.3), atol=1e-12)
    a = -2.0 * w * w * np.cosh(k * (z + h)) / np.sinh(k * h) * np.sin(phase)[:, None]
    np.testing.assert_allclose(field.acceleration[:, :3, 1], -a * math.sin(0.3), atol=1e-12)


def test_waves_of_any_frequencies_are_summed_one_by_one() -> None:
    sea = ComponentSea(frequency=[0.5, 0.5 * math.sqrt(2.0)], amplitude=[1.0, 0.5], phase=[0.2, -1.0])
    waves = sea.components(30.0, 50.0)
    assert waves.period is None
    field = sea_field(waves, 30.0, np.array([-5.0]), 50.0)
    t = field.dt * (np.arange(len(field.elevation)) - AHEAD)
    expected = np.cos(0.5 * t + 0.2) + 0.5 * np.cos(0.5 * math.sqrt(2.0) * t - 1.0)
    np.testing.assert_allclose(field.elevation, expected, atol=1e-12)
    grid = ComponentSea(
        frequency=np.round(2.0 * np.pi / 1200.0 * np.arange(30, 200), 10), amplitude=np.ones(170), phase=np.zeros(170)
    ).components(30.0, 50.0)
    assert grid.period == pytest.approx(1200.0, rel=1e-8)


def test_a_given_elevation_is_repeated() -> None:
    rng = np.random.default_rng(3)
    t = 0.5 * np.arange(240)
    series = sum(
        a * np.cos(2.0 * np.pi / 120.0 * n * t + p)
        for n, a, p in zip((6, 9, 14), (1.0, 0.6, 0.3), rng.uniform(0.0, 6.0, 3), strict=True)
    )
    waves = ElevationSea(elevation=series, time_step=0.5).components(30.0, 100.0)
    field = sea_field(waves, 30.0, np.array([0.0]), 100.0)
    times = field.dt * (np.arange(len(field.elevation)) - AHEAD)
    here = np.interp(times, t, series)
    inside = (times >= 0.0) & (times < 100.0)
    assert np.abs(field.elevation - here)[inside].max() < 0.03  # of the linear interpolation here
    with pytest.raises(InputError, match="shorter than the run of 130 s"):
        ElevationSea(elevation=series, time_step=0.5).components(30.0, 130.0)


def test_diffraction_has_its_limits() -> None:
    """A slender cylinder has twice the Froude-Krylov force; MacCamy & Fuchs: 4 / (pi (ka)^2 |H1'|)."""
    np.testing.assert_allclose(maccamy_fuchs(np.array([1e-3])), [2.0], atol=1e-4)
    from scipy.special import jvp, yvp

    ka = np.array([0.3, 1.0, 2.5])
    np.testing.assert_allclose(
        abs(maccamy_fuchs(ka)), 4.0 / (np.pi * ka**2 * np.hypot(jvp(1, ka), yvp(1, ka))), rtol=1e-12
    )
    lag = np.angle(maccamy_fuchs(ka))
    np.testing.assert_allclose(np.tan(lag), -jvp(1, ka) / yvp(1, ka), rtol=1e-9)


def test_an_hour_of_sea_is_small() -> None:
    sea = IrregularSea(height=6.0, period=10.0)
    field = sea_field(sea.components(30.0, 3600.0), 30.0, np.linspace(-30.0, 0.0, 40), 3600.0)
    assert field.velocity.nbytes + field.acceleration.nbytes < 1e8


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: RegularSea(height=9.0, period=8.0).components(10.0, 0.0), "break in water of 10 m; expected at most"),
        (lambda: RegularSea(height=5.0, period=4.0).components(50.0, 0.0), "break with a period of 4 s"),
        (lambda: IrregularSea(height=9.0, period=12.0).components(10.0, 0.0), "sea.height: waves of"),
        (lambda: IrregularSea(height=2.0, period=-8.0), "period: expected greater than 1, found -8"),
        (lambda: IrregularSea(height=2.0), "spectrum jonswap needs period"),
        (lambda: IrregularSea(height=2.0, period=8.0, spreading=Spreading(), crest=Crest(height=3.0)), "does not go"),
        (lambda: IrregularSea(height=2.0, period=8.0, crest=Crest(height=3.0, time=4000.0)).components(30.0, 60.0),
         "after the sea repeats"),
        (lambda: ComponentSea(frequency=[0.5, 0.6], amplitude=[1.0], phase=[0.0, 0.0]), "must have 2 entries"),
        (lambda: Current(height=[0.0]), "come together"),
    ],
)  # fmt: skip
def test_bad_seas_are_told_in_one_sentence(make: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()  # type: ignore[operator]


def test_current_has_its_profiles() -> None:
    z = np.array([-30.0, -20.0, -10.0, 0.0, 5.0])
    flow = Current(sub_surface=1.0, near_surface=0.5).at(z, 30.0)[:, 0]
    np.testing.assert_allclose(flow, [0.0, (1 / 3) ** (1 / 7), (2 / 3) ** (1 / 7) + 0.25, 1.5, 1.5])
    table = Current(height=[-30.0, 0.0], speed=[0.2, 0.8]).at(z, 30.0)[:, 0]
    np.testing.assert_allclose(table, [0.2, 0.4, 0.6, 0.8, 0.8])


def test_still_water_has_no_waves() -> None:
    field = sea_field(StillWater().components(30.0, 60.0), 30.0, np.array([-1.0, 0.0]), 60.0)
    assert not field.velocity.any() and len(field.elevation) == 4 and field.period == field.dt


def statistics_of(sea: Any, depth: float, duration: float) -> dict[str, tuple[str, str]]:
    _, rows = sea_statistics(sea_series(sea, depth, duration))
    return {name: (waves, series) for name, waves, series, _ in rows}


def test_periods_of_a_spectrum_are_those_of_its_moments() -> None:
    """Pierson-Moskowitz: m_n goes with (5/4)^(n/4) G(1 - n/4), so that the energy period is G(5/4) / (5/4)^(1/4) of the
    peak period, and that of zero up-crossings (5/4 pi)^(-1/4)."""
    sea = IrregularSea(height=4.0, period=10.0, peak_factor=1.0, repeat=2400.0)
    found = statistics_of(sea, 300.0, 600.0)
    assert float(found["energy period"][0]) == pytest.approx(10.0 * math.gamma(1.25) / 1.25**0.25, rel=5e-3)
    assert float(found["mean period (zero up-crossing)"][0]) == pytest.approx(
        10.0 / (1.25 * math.pi) ** 0.25, rel=0.03
    )  # the spectrum ends, which takes 2.5 % of it
    assert float(found["peak period"][0]) == pytest.approx(10.0, rel=2e-3)
    assert float(found["significant wave height"][0]) == pytest.approx(4.0, rel=5e-3)


def test_statistics_of_a_regular_wave() -> None:
    """The velocity at still water is w a / tanh(k d), with the current along the waves."""
    current = Current(uniform=0.4, direction=0.3 + math.pi / 3.0)
    sea = RegularSea(height=3.0, period=8.0, direction=0.3, current=current)
    found = {name: series for name, (_, series) in statistics_of(sea, 20.0, 80.0).items()}
    w = 2.0 * math.pi / 8.0
    top = w * 1.5 / math.tanh(float(wave_number(np.array([w]), 20.0)[0]) * 20.0) + 0.2
    wanted = {
        "highest crest": 1.5, "deepest trough": -1.5, "highest wave": 3.0, "mean period (zero up-crossing)": 8.0,
        "significant wave height": 4.0 * 1.5 / math.sqrt(2.0), "largest velocity at still water": top,
    }  # fmt: skip
    assert {name: float(found[name]) for name in wanted} == pytest.approx(wanted, rel=5e-3)


@pytest.mark.parametrize("stretching", ["vertical", "wheeler"])
def test_the_field_at_a_pile_is_that_of_airy_at_its_pieces(stretching: Any) -> None:
    """At the middles of the wet pieces and at still water, which stands 1 m higher than on the chart; Wheeler's
    stretching needs the sea bed, too. The current is that of all pieces."""
    heights = np.array([-25.0, -15.0, -6.0, 0.5, 5.0])
    nodes = PileNode.zeros(node=5)
    View(PileNode, nodes)["height"] = heights
    pile = PilePart(PileWater.zeros(), nodes, *[np.zeros(0)] * 3)
    model: Any = SimpleNamespace(
        parts=(pile,), environment=SimpleNamespace(gravity=G),
        turbine=SimpleNamespace(support=SimpleNamespace(depth=20.0, hydrodynamics=SimpleNamespace(diffraction="none"))),
    )  # fmt: skip
    current = Current(near_surface=1.0, reference_depth=21.0, direction=0.5)
    sea = RegularSea(height=2.0, period=8.0, direction=0.5, level=1.0, current=current, stretching=stretching)
    part: Any = sea_part(sea, model, 8.0, (30.0, -10.0))
    levels = [*[-21.0][: stretching == "wheeler"], -16.0, -7.0, -0.5, 0.0]
    np.testing.assert_allclose(part.sea_levels, levels)
    v = View(PileWater, part.water)
    assert (v["depth"], v["level"]) == (21.0, 1.0)
    w, way = 2.0 * math.pi / 8.0, np.array([math.cos(0.5), -math.sin(0.5)])
    k = float(wave_number(np.array([w]), 21.0)[0])
    t = v["step"] * (np.arange(len(part.sea_field)) - AHEAD)
    phase = np.exp(1j * (w * t - k * way @ [30.0, -10.0]))
    start = RegularSea(height=2.0, period=8.0, direction=0.5).components(21.0, 8.0).amplitude[0]
    np.testing.assert_allclose(part.sea_field[:, 0], (start * phase).real, atol=1e-9)
    for i, z in enumerate(levels):
        size = w * math.cosh(k * (z + 21.0)) / math.sinh(k * 21.0) * start * phase
        wanted = np.column_stack([np.outer(size.real, way), np.outer((1j * w * size).real, way)])
        np.testing.assert_allclose(part.sea_field[:, 1 + 4 * i : 5 + 4 * i], wanted, atol=1e-9)
    slope = (k * w * start * phase).real
    np.testing.assert_allclose(part.sea_field[:, -4:-2], np.outer(slope, way), atol=1e-9)
    shares = np.clip(1.0 + (heights - 1.0) / 21.0, 0.0, 1.0)
    np.testing.assert_allclose(part.sea_current, np.outer(way, shares), atol=1e-12)
