"""Turbulent fields: repeatable, of the right size, with the mean, deviations and series asked for.

Spectra and coherence over many seeds are in tests/verification/test_wind_ensembles.py.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import InputError, SteadyWind, Turbine, TurbulentWind, WindBox
from meltemi.simulation.operating_point import steady_wind
from meltemi.turbulence.mann import GAMMA, one_point
from meltemi.turbulence.targets import sigmas, target_coherence, target_densities
from meltemi.wind import HubSeries, WindGrid, generate_field
from meltemi.wind.fields import check_coverage

GRID = WindGrid(points_y=9, points_z=10, dy=18.0, dz=17.0, bottom=5.0, hub_height=90.0)
DURATION = 300.0
SINGLE = 1e-6
"""Relative: velocities are stored in single precision."""
SPECTRA = ("kaimal", "vonkarman", "mann")


def described(**changes: Any) -> TurbulentWind:
    return TurbulentWind(**{"speed": 11.0, "intensity": 0.16, "dt": 0.2} | changes)


def make(duration: float = DURATION, **changes: Any) -> WindBox:
    return generate_field(described(**changes), GRID, duration)


def at_hub(box: WindBox) -> NDArray[np.float64]:
    """(T, 3)"""
    return box.velocity[:, GRID.hub[0], GRID.hub[1]].astype(float)


@pytest.mark.parametrize("spectrum", SPECTRA)
def test_the_same_seed_gives_the_same_field(spectrum: str) -> None:
    a, b, other = (make(spectrum=spectrum, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(a.velocity, b.velocity)
    assert a.content_hash() == b.content_hash() != other.content_hash()


# velocities [m/s] of u, v, w at plane 100 of the lower left corner, of seed 1
PINNED = {
    "kaimal": [7.71476841, 1.82386959, -0.135861471],
    "vonkarman": [9.05118942, 2.59950209, -0.195813864],
    "mann": [8.47597313, 2.56984544, -0.210216463],
}


@pytest.mark.parametrize("spectrum", SPECTRA)
def test_a_field_is_the_same_on_every_platform(spectrum: str) -> None:
    field = make(spectrum=spectrum).velocity[100, 0, 0]
    # 1e-6 standard deviations, and half a unit in the last place of single precision
    np.testing.assert_allclose(field, PINNED[spectrum], rtol=6e-8, atol=1e-6 * 0.16 * 11.0)


@pytest.mark.parametrize("spectrum", SPECTRA)
@pytest.mark.parametrize("periodic", [False, True])
def test_the_standard_deviation_at_the_hub_is_met(spectrum: str, periodic: bool) -> None:
    wind = described(spectrum=spectrum, periodic=periodic)
    hub = at_hub(make(spectrum=spectrum, periodic=periodic))
    np.testing.assert_allclose(hub.mean(axis=0), [11.0, 0.0, 0.0], rtol=0.0, atol=11.0 * SINGLE)
    np.testing.assert_allclose(hub.std(axis=0), sigmas(wind), rtol=11.0 * SINGLE)


def test_a_field_that_is_not_scaled_has_the_deviation_of_its_sample() -> None:
    scaled, free = make(), make(scaled=False)
    ratio = (free.velocity[..., 1] / scaled.velocity[..., 1]).astype(float)
    assert np.median(ratio) != pytest.approx(1.0, abs=1e-3)  # the same field but for one factor
    np.testing.assert_allclose(free.velocity[..., 1], np.median(ratio) * scaled.velocity[..., 1], rtol=0.0, atol=3e-6)


def test_the_mean_is_the_profile_asked_for() -> None:
    power = make().velocity.astype(float).mean(axis=(0, 2))
    np.testing.assert_allclose(power[:, 0], 11.0 * (GRID.z / 90.0) ** 0.2, rtol=0.0, atol=1e-4)
    rough = make(roughness=0.1).velocity.astype(float).mean(axis=(0, 2))
    np.testing.assert_allclose(rough[:, 0], 11.0 * np.log(GRID.z / 0.1) / np.log(900.0), rtol=0.0, atol=1e-4)
    veer = 0.003
    turned = make(veer=veer).velocity.astype(float).mean(axis=(0, 2))
    # clockwise from above with height: above the hub the wind blows to the right, towards -y
    np.testing.assert_allclose(np.arctan2(-turned[:, 1], turned[:, 0]), veer * (GRID.z - 90.0), rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(np.hypot(turned[:, 0], turned[:, 1]), power[:, 0], rtol=0.0, atol=1e-4)
    inclined = make(upflow=0.14).velocity.astype(float).mean(axis=(0, 2))
    np.testing.assert_allclose(inclined[:, 2] / inclined[:, 0], np.tan(0.14), rtol=0.0, atol=1e-4)
    np.testing.assert_allclose(inclined[:, 0], power[:, 0], rtol=0.0, atol=1e-4)


def test_realisations_of_one_wind_begin_in_its_mean(turbine: Turbine) -> None:
    """In the same operating point, with the upflow and the veer that the velocities of a row do not tell."""
    wind = TurbulentWind(speed=12.0, intensity=0.2, shear_exponent=0.1, upflow=0.1, veer=0.001, direction=0.2)
    begins = [
        steady_wind(generate_field(wind.replace(seed=seed), turbine, 10.0), turbine.hub_height) for seed in (1, 2)
    ]
    mean = SteadyWind(speed=12.0, shear_exponent=0.1, upflow=0.1, veer=0.001, direction=0.2)
    assert begins == [mean, mean]


def test_no_turbulence_leaves_the_mean() -> None:
    box = make(intensity=0.0)
    assert np.all(np.ptp(box.velocity, axis=0) == 0.0)


def test_a_periodic_field_lasts_as_long_as_the_run_and_a_padded_one_covers_it(turbine: Turbine) -> None:
    wind = described()
    for duration in (10.0, 60.0, 601.3):
        padded, periodic = (generate_field(described(periodic=p, points=9), turbine, duration) for p in (False, True))
        assert len(periodic.velocity) * periodic.dt == pytest.approx(duration, abs=2.0 * wind.dt)
        assert periodic.periodic and not padded.periodic
        for box in (padded, periodic):
            check_coverage(box, hub_height=90.0, radius=63.0, reach=10.0, duration=duration)


@pytest.mark.parametrize("spectrum", SPECTRA)
@pytest.mark.parametrize("coherent", ["u", "all"])
def test_a_field_passes_through_a_measured_series(spectrum: str, coherent: str) -> None:
    time = np.arange(0.0, 400.0, 0.37)
    series = HubSeries(time=time, u=12.0 + np.sin(0.3 * time), v=0.5 * np.cos(0.2 * time), w=0.2 * np.sin(1.3 * time))
    box = make(spectrum=spectrum, coherent=coherent, hub_series=series)
    known = box.passing >= 0.0
    for c, column in enumerate((series.u, series.v, series.w)):
        expected = np.interp(box.passing, time, column)
        np.testing.assert_allclose(at_hub(box)[known, c], expected[known], rtol=0.0, atol=1e-5)
    plain = make(spectrum=spectrum, coherent=coherent, scaled=False)
    near, far = ((GRID.hub[0], GRID.hub[1] + 1), (0, 0))
    slow = np.sin(0.3 * box.passing[known])  # what the series has most of
    share = [np.dot((box.velocity - plain.velocity)[known, *p, 0], slow) / np.dot(slow, slow) for p in (near, far)]
    # its neighbour follows the series, a point far away does not; the mean of the series is the mean of the wind
    assert share[0] > 0.2 > 0.15 > abs(share[1])
    mean = box.velocity[..., 0].astype(float).mean(axis=(0, 2))
    np.testing.assert_allclose(mean, mean[GRID.hub[0]] * (GRID.z / 90.0) ** 0.2, rtol=0.0, atol=0.1)
    assert mean[GRID.hub[0]] == pytest.approx(12.0, abs=0.1)


def test_components_that_were_not_measured_stay_free() -> None:
    time = np.arange(0.0, 400.0, 0.2)
    only_u = HubSeries(time=time, u=np.full_like(time, 11.0))
    box, plain = make(hub_series=only_u), make()
    np.testing.assert_array_equal(box.velocity[..., 1:], plain.velocity[..., 1:])
    assert np.ptp(at_hub(box)[box.passing >= 0.0, 0]) < 1e-4


def test_the_gap_of_a_short_series_is_filled_like_turbulence() -> None:
    wind = described()
    plain = generate_field(wind, GRID, DURATION)
    time = plain.passing
    part = (time >= 40.0) & (time <= 180.0)
    series = HubSeries(time=time[part], u=at_hub(plain)[part, 0])
    box = make(hub_series=series, seed=9)
    hub = at_hub(box)[:, 0]
    np.testing.assert_allclose(hub[part], at_hub(plain)[part, 0], rtol=0.0, atol=1e-5)
    steps = np.diff(hub)
    joints = np.flatnonzero(np.diff(part.astype(int)) != 0)
    assert np.max(np.abs(steps[joints])) < 4.0 * steps.std()
    assert hub[~part].std() == pytest.approx(1.76, rel=0.5)


def test_a_series_elsewhere_in_time_is_refused() -> None:
    late = HubSeries(time=[1000.0, 1100.0], u=[10.0, 11.0])
    with pytest.raises(InputError, match=r"hub series: it reaches from 1000 s to 1100 s, the field from -6\.5"):
        make(hub_series=late)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"time": [0.0], "u": [1.0]}, "at least 2"),
        ({"time": [0.0, 1.0, 1.0], "u": [1.0, 2.0, 3.0]}, "entry 3"),
        ({"time": [0.0, 1.0], "u": [1.0]}, "u must have 2 entries like time, found 1"),
        ({"time": [0.0, 1.0], "u": [1.0, 2.0], "w": [1.0]}, "w must have 2"),
    ],
)
def test_a_series_that_cannot_be_is_refused(columns: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        HubSeries(**columns)


OPTIONS: list[dict[str, Any]] = [
    {"speed": 12.0},
    {"intensity": 0.2},
    {"seed": 2},
    {"spectrum": "vonkarman"},
    {"spectrum": "mann"},
    {"edition": 2},
    {"length_factor": 2.0},
    {"coherent": "all"},
    {"shear_exponent": 0.1},
    {"roughness": 0.1},
    {"veer": 0.001},
    {"upflow": 0.1},
    {"scaled": False},
    {"periodic": True},
    {"dt": 0.25},
]


@pytest.mark.parametrize("option", OPTIONS, ids=lambda o: next(iter(o)))
def test_every_option_changes_the_field(option: dict[str, Any]) -> None:
    a, b = make().velocity, make(**option).velocity
    assert a.shape != b.shape or not np.allclose(a, b, atol=1e-3)


def test_beyond_its_table_the_one_point_spectrum_is_flat_below_and_a_power_law_above() -> None:
    f = one_point(GAMMA)(np.array([1e-5, 1e-3, 1e4, 1e4 * (1.0 + 1e-12), 8e4]))
    np.testing.assert_array_equal(f[:, 0], f[:, 1])
    np.testing.assert_allclose(f[:, 3], f[:, 2])
    np.testing.assert_allclose(f[:, 4], f[:, 2] / 32.0)


def test_half_the_lengths_of_edition_3_are_those_of_edition_2() -> None:
    f = np.geomspace(1e-3, 2.0, 30)
    for spectrum in SPECTRA:
        halved, edition_2 = described(spectrum=spectrum, length_factor=0.5), described(spectrum=spectrum, edition=2)
        found, expected = (target_densities(wind, GRID.hub_height, f) for wind in (halved, edition_2))
        np.testing.assert_allclose(found, expected, rtol=1e-12)
    # twice the lengths: the same coherence at half the frequency and twice the distance
    plain, doubled = described(), described(length_factor=2.0)
    near, far = (
        target_coherence(plain, GRID.hub_height, f, 20.0),
        target_coherence(doubled, GRID.hub_height, f / 2, 40.0),
    )
    np.testing.assert_allclose(near[0], far[0], rtol=1e-12)
    assert "lengths times 2" in doubled.label and "lengths" not in plain.label


def test_options_of_place_and_size(turbine: Turbine) -> None:
    assert make(direction=0.3).direction == 0.3
    assert generate_field(described(points=11), turbine, 10.0).velocity.shape[2] == 11
    assert set(TurbulentWind.model_fields) == {next(iter(o)) for o in OPTIONS} | {"direction", "points", "hub_series"}


def test_progress_ends_with_the_whole() -> None:
    shares: list[float] = []
    generate_field(described(), GRID, 20.0, shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"intensity": -0.1}, "greater than or equal to 0"),
        ({"speed": 0.0}, "greater than 0"),
        ({"seed": -1}, "greater than or equal to 0"),
        ({"spectrum": "kaimal2"}, "'kaimal', 'vonkarman' or 'mann'"),
        ({"edition": 5}, "2, 3 or 4"),
        ({"points": 1}, "greater than or equal to 3"),
        ({"points": 2.5}, "an integer"),
        ({"dt": 0.0}, "greater than 0"),
        ({"gust": 1.0}, "unknown key"),
        ({"intensity": 0.0, "hub_series": {"time": [0.0, 1.0], "u": [1.0, 2.0]}}, "intensity must be above 0"),
    ],
)
def test_what_cannot_be_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        described(**changes)


def test_a_field_that_does_not_fit_into_memory_is_refused() -> None:
    with pytest.raises(InputError, match=r"does not fit into memory: a higher speed, a shorter duration"):
        make(duration=1e6)
    with pytest.raises(InputError, match="duration must be positive"):
        make(duration=-1.0)


def test_runs_share_a_field_and_a_described_wind_makes_the_same(turbine: Turbine, model: meltemi.Model) -> None:
    wind = described(points=9)
    box = generate_field(wind, turbine, 2.0)
    runs = [meltemi.Simulation(meltemi.Run(model, w, duration=2.0)) for w in (box, box, wind)]
    assert runs[0].case["box"] is runs[1].case["box"] is box.velocity
    np.testing.assert_array_equal(runs[2].case["box"], box.velocity)
    digest = hashlib.sha256(runs[2].wind.velocity.data).hexdigest()  # type: ignore[union-attr]
    assert digest == hashlib.sha256(box.velocity.data).hexdigest()
