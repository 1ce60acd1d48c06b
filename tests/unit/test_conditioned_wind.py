"""Fields through the series of sensors: exact where they are, with the model's conditional variance elsewhere.

Amplitudes are independent from frequency to frequency, so that the mean over many of them is an ensemble mean.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import InputError, TurbulentWind
from meltemi.turbulence.conditioned import (
    NEAREST,
    Channel,
    ConditionedFields,
    RandomField,
    conditioned,
    conditioned_fields,
    continued,
    draw,
    on_planes,
    random_field,
)
from meltemi.turbulence.exponential import even_fast
from meltemi.turbulence.field import mean_profile
from meltemi.turbulence.sensors import Sensor, components, measured_wind
from meltemi.turbulence.targets import amplitude_variances, length_scale, sigmas
from meltemi.wind import WindGrid, generate_field, wind_grid_for
from meltemi.wind.fields import check_coverage

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

GRID = WindGrid(points_y=7, points_z=6, dy=12.0, dz=12.0, bottom=42.0, hub_height=90.0)
WIND = TurbulentWind(speed=10.0, intensity=0.15, coherent="all", dt=0.2, scaled=False)
DURATION = 120.0
TRUTH = generate_field(WIND.replace(seed=77), GRID, 200.0)
TIME = TRUTH.passing
EXACT = 2e-5
"""[m/s] velocities are stored in single precision."""


def seen(row: int, column: int, keep: slice = slice(None), **changes: Any) -> Sensor:
    """A sonic in the true field, at a point of the grid."""
    u, v, w = TRUTH.velocity[keep, row, column].astype(float).T
    fields = {"height": GRID.z[row], "across": GRID.y[column], "time": TIME[keep], "u": u, "v": v, "w": w}
    return Sensor(**fields | changes)


def make(sensors: list[Sensor], *, distance: float = 0.0, **changes: Any) -> ConditionedFields:
    return conditioned_fields(sensors, WIND.replace(**changes), GRID, DURATION, distance=distance, variance="wind")


def at(result: ConditionedFields, row: int, column: int) -> Float:
    """(T, 3) [m/s] at the planes that the true field has, too."""
    return result.fields[0].velocity[:, row, column].astype(float)


TWO: dict[str, Any] = {"height": 80.0, "time": [0.0, 1.0]}
THREE = ((4, 3), (1, 2), (3, 6))
PLANES = len(conditioned_fields([seen(4, 3)], WIND, GRID, DURATION).fields[0].velocity)


def test_the_planes_are_those_of_the_true_field() -> None:
    np.testing.assert_allclose(make([seen(4, 3)]).fields[0].passing, TIME[:PLANES], atol=1e-9)


@pytest.mark.parametrize("spectrum", ["kaimal", "vonkarman"])
def test_a_field_passes_through_all_sensors(spectrum: str) -> None:
    """In all components, and on their side: a wrong sign of v or of the lateral position misses by far."""
    result = make([seen(*place) for place in THREE], spectrum=spectrum)
    for place in THREE:
        np.testing.assert_allclose(at(result, *place), TRUTH.velocity[:PLANES, *place], rtol=0.0, atol=EXACT)
    row, column = THREE[2]
    assert np.std(at(result, row, 6 - column) - TRUTH.velocity[:PLANES, row, column], axis=0).min() > 0.5
    assert result.explained == pytest.approx([1.0, 1.0, 1.0])
    assert (result.begin, result.end) == (pytest.approx(0.0), DURATION)


@pytest.mark.parametrize("direction", [0.6, -2.9])
def test_sensors_measure_in_inertial_axes(direction: float) -> None:
    """A sonic, and a cup with a vane, in a wind that blows along (cos, -sin) of its direction."""
    u, v, w = TRUTH.velocity[:, 1, 2].astype(float).T
    c, s = np.cos(direction), np.sin(direction)
    x, y = c * u + s * v, c * v - s * u
    place: dict[str, Any] = {"height": GRID.z[1], "across": GRID.y[2], "time": TIME, "w": w}
    sonic = Sensor(u=x, v=y, **place)
    cup = Sensor(speed=np.hypot(x, y), direction=-np.arctan2(y, x), **place)
    for sensor in (sonic, cup):
        result = make([sensor], direction=direction)
        assert result.fields[0].direction == direction
        np.testing.assert_allclose(at(result, 1, 2), TRUTH.velocity[:PLANES, 1, 2], rtol=0.0, atol=EXACT)


def test_a_cup_alone_is_u_and_a_vane_alone_is_v() -> None:
    """To the first order; their errors are of the second one. A clockwise turn is a wind to the right."""
    u, v, _ = TRUTH.velocity[:, 4, 3].astype(float).T
    place: dict[str, Any] = {"height": GRID.z[4], "time": TIME}
    small = 0.05 * v
    result = make([Sensor(speed=np.hypot(u, small), **place), Sensor(direction=-np.arctan2(small, 10.0), **place)])
    assert [name[0] for name in result.channels] == ["u", "v"]
    computed = at(result, 4, 3)
    np.testing.assert_allclose(computed[:, 0], u[:PLANES], rtol=0.0, atol=2e-3)
    np.testing.assert_allclose(computed[:, 1], small[:PLANES], rtol=0.0, atol=2e-3)


def test_a_cup_in_veer_measures_the_speed_along_the_wind_at_its_height() -> None:
    wind = WIND.replace(veer=0.01, direction=0.3)
    mean = mean_profile(wind, np.array([42.0]), 90.0)[0]
    speed = float(np.hypot(mean[0], mean[1]))
    assert mean[0] < 0.95 * speed
    cup = Sensor(height=42.0, time=TWO["time"], speed=[speed, speed + 1.0])
    np.testing.assert_allclose(components(cup, wind, mean)[0], [mean[0], mean[0] + 1.0], rtol=1e-12)
    vane = Sensor(height=42.0, time=TWO["time"], direction=np.full(2, 0.3 + 0.01 * (42.0 - 90.0)))
    np.testing.assert_allclose(components(vane, wind, mean)[1], mean[1], rtol=1e-12)


def test_the_field_covers_a_run() -> None:
    result = make([seen(4, 3)], distance=100.0)
    check_coverage(result.fields[0], hub_height=90.0, radius=12.0, reach=5.0, duration=DURATION)
    grid = wind_grid_for(meltemi.load_turbine("nrel5mw"), 9)
    box = conditioned_fields([seen(4, 3)], WIND.replace(points=9), meltemi.load_turbine("nrel5mw"), 20.0).fields[0]
    assert (box.dy, box.bottom, box.velocity.shape[1:3]) == (grid.dy, grid.bottom, (grid.points_z, grid.points_y))
    check_coverage(box, hub_height=90.0, radius=63.0, reach=10.0, duration=20.0)


def test_several_seeds_give_the_fields_of_each_and_differ_between_the_sensors() -> None:
    sensors = [seen(4, 3), seen(1, 2, height=GRID.z[1] + 2.0)]
    both = conditioned_fields(sensors, WIND, GRID, DURATION, seeds=(1, 2), variance="wind").fields
    for seed, field in zip((1, 2), both, strict=True):
        (alone,) = make(sensors, seed=seed).fields
        np.testing.assert_allclose(field.velocity, alone.velocity, rtol=0.0, atol=EXACT)
        assert field.source == alone.source and f"seed {seed}" in field.source
    assert np.std(both[0].velocity[:, 0, 0] - both[1].velocity[:, 0, 0], axis=0).min() > 0.3


# amplitudes


def series(places: list[tuple[float, float]], n: int = 4096, noise: float = 0.0, component: int = 0) -> RandomField:
    """The field of a component, and series of some turbulence at places (z, y), known at all planes."""
    values, known = np.random.default_rng(5).normal(size=(len(places), n)), np.ones(n, bool)
    measured = [Channel(component, z, y, x, known, noise) for (z, y), x in zip(places, values, strict=True)]
    return random_field(WIND, GRID, n, component, measured)


def probable(field: RandomField) -> Complex:
    """(P, H) mean C_gs (C_ss + N)^-1 of the conditional amplitudes."""
    amplitudes = np.fft.rfft([channel.values for channel in field.channels], norm="forward").T[..., None]
    weights = field.covariances(field.places.points, field.places.sensors) @ np.linalg.inv(field.measured)
    result: Complex = (weights @ amplitudes)[..., 0].T
    return result


def residual(field: RandomField, seeds: range) -> Float:
    """(P, H) variance of the amplitudes about their mean, over the field's, of some seeds."""
    errors = conditioned(field, seeds) - probable(field)
    result: Float = np.mean(np.abs(errors) ** 2, axis=0) / field.variances
    return result


BANDS = [slice(1, 30), slice(30, 100), slice(100, 300), slice(300, 900)]
OFF_GRID = (87.0, 5.0)


def test_the_variance_at_a_distance_is_what_the_coherence_leaves() -> None:
    """(1 - coherence^2) S, by bands of frequency, for a sensor between the points of the grid."""
    field = series([OFF_GRID])
    seeds = range(1, 9)
    computed = residual(field, seeds)
    r = field.places.distances(field.places.points, field.places.sensors)
    np.testing.assert_allclose(r[:, 0], np.abs(field.places.all[:-1] - (5.0 + 87.0j)))
    expected = 1.0 - np.exp(-2.0 * r * field.places.kappa)
    near = np.argsort(r[:, 0])[:6]
    for some in BANDS:
        count = len(seeds) * len(range(*some.indices(5000)))
        for p in near:
            share = computed[p, some].mean() / expected[p, some].mean()
            assert share == pytest.approx(1.0, abs=4.5 * np.sqrt(1.5 / count)), (p, some)


def test_other_components_are_those_of_a_field_without_sensors() -> None:
    sensor = Sensor(height=87.0, across=5.0, time=TIME, speed=TRUTH.velocity[:, 4, 3, 0].astype(float))
    with_sensor, free = make([sensor]), random_field(WIND, GRID, 1024, 1, [])
    np.testing.assert_array_equal(conditioned(free, [7]), draw(free, [7]))
    other = make([sensor.replace(speed=sensor.speed + 1.0)])  # type: ignore[operator]
    np.testing.assert_array_equal(with_sensor.fields[0].velocity[..., 1:], other.fields[0].velocity[..., 1:])
    assert with_sensor.explained[0] > 0.4 and list(with_sensor.explained[1:]) == [0.0, 0.0]


def test_a_field_has_its_covariance_with_places_between_its_points() -> None:
    """Three sensors: inside the grid, beside it, and at the same place again."""
    field = series([(87.0, 15.0), (85.0, 40.0), (85.0, 40.0)], n=1024)
    some, seeds = slice(1, 20), range(1, 81)
    hub = 4 * GRID.points_y + 3
    places = np.array([hub, *field.places.sensors])
    unit = np.concatenate(draw(field, seeds)[:, places, some] / np.sqrt(field.variances[some]), axis=1)
    computed = (unit @ unit.conj().T).real / unit.shape[1]
    expected = field.places.coherence(places, places, some).mean(axis=0)
    assert expected[0, 1] > 0.25 and expected[1, 2] > 0.25
    np.testing.assert_allclose(computed, expected, atol=4.5 / np.sqrt(unit.shape[1]))


@pytest.mark.parametrize(("place", "largest"), [((31.5, 0.3), 5e-4), ((2.0, 14.0), 5e-4), ((30.0, 40.0), 1.3e-2)])
def test_few_points_determine_the_air_at_a_sensor(place: tuple[float, float], largest: float) -> None:
    """Error of its covariance with the other points, over its variance: inside, at a corner, 24 m beside the grid."""
    grid = WindGrid(points_y=9, points_z=14, dy=4.0, dz=4.0, bottom=1.0, hub_height=32.0)
    field = random_field(WIND, grid, 1024, 0, [Channel(0, *place, np.zeros(1024), np.ones(1024, bool))])
    given = np.argsort(field.places.distances(field.places.sensors, field.places.points)[0])[:NEAREST]
    weight = np.linalg.solve(field.covariances(given, given), field.covariances(given, field.places.sensors))
    error = field.covariances(field.places.points, given) @ weight - field.covariances(
        field.places.points, field.places.sensors
    )
    share = np.abs(error) / field.variances[:, None, None]
    assert 0.01 * largest < share.max() < largest
    assert share[:, given].max() < 1e-10


def test_a_sensor_beside_one_at_a_point_is_drawn_once() -> None:
    """The second sensor is at a point, the fourth at the third: neither is given twice."""
    z, y = GRID.z[4], GRID.y[3]
    field = series([(z - 3.0, y), (z, y), (z - 2.0, y + 1.0), (z - 2.0, y + 1.0), (z - 1.0, y)], n=512)
    drawn = draw(field, [3])[0]
    assert np.isfinite(drawn).all()
    np.testing.assert_array_equal(drawn[field.places.sensors[1]], drawn[4 * GRID.points_y + 3])
    np.testing.assert_array_equal(drawn[field.places.sensors[3]], drawn[field.places.sensors[2]])


def test_more_sensors_leave_less() -> None:
    """Down to the closed form S_gg - C_gs C_ss^-1 C_sg, which goes to zero as they close in on the point."""
    point = 3 * GRID.points_y + 3
    some, shares = slice(1, 60), []
    for count, radius in ((1, 8.0), (2, 8.0), (4, 8.0), (8, 3.0), (8, 0.5), (8, 0.05)):
        angle = 2.0 * np.pi * np.arange(count) / count
        z, y = GRID.z[3] + radius * np.cos(angle), GRID.y[3] + radius * np.sin(angle)
        field = series(list(zip(z.tolist(), y.tolist(), strict=True)), n=1024)
        kappa = field.places.kappa[some, None, None]
        with_point = np.exp(-kappa * np.full((count, 1), radius))
        among = np.exp(-kappa * np.hypot(z[:, None] - z, y[:, None] - y))
        expected = 1.0 - np.mean(np.sum(with_point * np.linalg.solve(among, with_point), axis=(1, 2)))
        shares.append(residual(field, range(1, 7))[point, some].mean())
        assert shares[-1] == pytest.approx(expected, rel=4.5 / np.sqrt(6 * 59))
    assert shares == sorted(shares, reverse=True) and shares[-1] < 0.01 < 0.5 < shares[0]


def test_the_mean_over_seeds_is_the_most_probable_field() -> None:
    field = series([OFF_GRID, (100.0, -20.0)], n=512)
    mean = np.mean(conditioned(field, range(1, 33)), axis=0)
    error = np.abs(mean - probable(field)) ** 2 / field.variances
    # as a mean of 32 has it: the variance that is left, over 32
    left = residual(field, range(40, 48))
    assert error.sum() / left.sum() == pytest.approx(1.0 / 32.0, rel=0.1)


def test_noise_leaves_its_variance_at_the_sensor() -> None:
    """1 - S / (S + N) of a sensor at a point of the grid."""
    field = series([(GRID.z[3], GRID.y[3])], n=2048, noise=0.4)
    computed = residual(field, range(1, 9))[3 * GRID.points_y + 3]
    expected = 1.0 - field.variances / (field.variances + 0.4**2 / 2048)
    assert expected[900] > 1.5 * expected[300] > 0.1
    for some in (slice(1, 100), slice(200, 600), slice(600, 1000)):
        count = 8 * len(range(*some.indices(5000)))
        assert np.mean(computed[some] / expected[some]) == pytest.approx(1.0, abs=4.5 / np.sqrt(count))


@pytest.mark.parametrize("component", [0, 1, 2])
def test_a_sensor_far_away_leaves_the_models_spectra_and_coherence(component: int) -> None:
    field = series([(90.0, 9e3)], n=2048, component=component)
    np.testing.assert_allclose(field.variances[1:-1], amplitude_variances(WIND, 90.0, 2048)[1][component])
    power, cross = 0.0, 0.0
    for seed in range(1, 5):
        unit = (conditioned(field, [seed])[0] / np.sqrt(field.variances))[:, 1:-1]
        power = power + np.mean(np.abs(unit) ** 2, axis=0) / 4.0
        cross = cross + np.mean((unit[:-7] * unit[7:].conj()).real, axis=0) / 4.0  # a row below and one above
    for some in BANDS[:3]:
        assert power[some].mean() == pytest.approx(1.0, abs=0.15)
        assert cross[some].mean() == pytest.approx(np.exp(-12.0 * field.places.kappa[1:-1][some]).mean(), abs=0.15)


@pytest.mark.parametrize("spectrum", ["kaimal", "vonkarman"])
def test_what_is_slower_than_the_ring_completes_the_variance(spectrum: Any) -> None:
    """The integral of Kaimal's spectrum from zero to the half of a step is closed; that of all is the variance."""
    wind, n = WIND.replace(spectrum=spectrum, dt=0.02), 2**15
    field = random_field(wind, GRID, n, 0, [])
    sigma = sigmas(wind)[0]
    x = length_scale(wind, 90.0) * 8.1 / wind.speed / (n * wind.dt)
    if spectrum == "kaimal":
        assert field.variances[0] == pytest.approx(sigma**2 * (1.0 - (1.0 + 6.0 * 0.5 * x) ** (-2.0 / 3.0)), rel=1e-9)
    assert field.variances[0] + 2.0 * np.sum(field.variances[1:-1]) == pytest.approx(sigma**2, rel=0.02)
    assert 0.02 < field.variances[0] / sigma**2 < 0.1


def test_what_is_slower_than_the_ring_differs_between_places() -> None:
    """By the variance that the coherence leaves: the mean at the sensor is not that of the rotor."""
    field, seeds = series([OFF_GRID], n=512), range(1, 401)
    drawn = draw(field, seeds)[..., 0]
    assert np.all(drawn.imag == 0.0)
    assert np.var(drawn[:, 0]) == pytest.approx(field.variances[0], rel=4.0 * np.sqrt(2.0 / 400))
    errors = conditioned(field, seeds)[..., 0].real - probable(field)[:, 0].real
    r = field.places.distances(field.places.points, field.places.sensors)[:, 0]
    left = field.variances[0] * (1.0 - np.exp(-2.0 * field.places.kappa[0] * r))
    for p in np.argsort(r)[:20]:
        assert np.mean(errors[:, p] ** 2) == pytest.approx(left[p], rel=4.0 * np.sqrt(2.0 / 400))


# series in time


def test_a_true_field_is_recovered_within_the_conditional_variance() -> None:
    """Another seed's field, sampled at three places: a sample errs by twice the variance that these leave."""
    sensors = [seen(*place) for place in THREE]
    samples = [make(sensors, seed=seed) for seed in (1, 2)]
    measured = [x for x in on_planes(sensors, WIND, GRID, TIME[0], 1024, PLANES) if x.component == 0]
    field = random_field(WIND, GRID, 1024, 0, measured)
    ratios = []
    for row, column in ((4, 4), (3, 3), (0, 0), (5, 6)):
        c = field.covariances(field.places.sensors, np.array([row * GRID.points_y + column]))
        left = field.variances - np.sum(c * np.linalg.solve(field.measured, c), axis=(1, 2))
        expected = 4.0 * np.sum(left[1:-1])
        inside = slice(20, PLANES - 20)
        errors = [(at(x, row, column) - TRUTH.velocity[:PLANES, row, column])[inside, 0] for x in samples]
        ratios.append(np.mean(np.var(errors, axis=1)) / expected)
    assert np.mean(ratios) == pytest.approx(1.0, rel=0.25)
    assert min(ratios) > 0.4 and max(ratios) < 2.0


def test_gaps_are_filled_like_turbulence() -> None:
    """Other samples are kept; the error in a gap is small beside the deviation, and smaller with a neighbour."""
    u = TRUTH.velocity[:, 4, 3, 0].astype(float).copy()
    lost = np.zeros(len(u), bool)
    for begin in range(60, 560, 25):
        lost[begin : begin + 3] = True
    u[lost] = np.nan
    sensor = seen(4, 3, u=u)
    result = make([sensor])
    computed, true = at(result, 4, 3)[:, 0], TRUTH.velocity[:PLANES, 4, 3, 0]
    np.testing.assert_allclose(computed[~lost[:PLANES]], true[~lost[:PLANES]], rtol=0.0, atol=EXACT)
    gaps = lost[:PLANES]
    alone = np.std((computed - true)[gaps])
    assert 0.05 < alone < 0.7 < np.std(true)
    assert result.missing == pytest.approx([lost.mean(), lost.mean(), 0.0])
    close = Sensor(height=GRID.z[4], across=0.3, time=TIME, u=TRUTH.velocity[:, 4, 3, 0], v=TRUTH.velocity[:, 4, 3, 1])
    helped = make([sensor, close])
    assert np.std((at(helped, 4, 3)[:, 0] - true)[gaps]) < 0.6 * alone


def test_a_continuation_is_the_conditional_mean() -> None:
    """C_gk C_kk^-1 d_k of the covariances in time, of two sensors with different gaps and errors."""
    field = series([(87.0, 5.0), (87.0, 8.0)], n=64, noise=0.2)
    known = np.random.default_rng(1).random((2, 64)) > 0.3
    values = np.array([channel.values for channel in field.channels])
    among = field.measured
    in_time = np.fft.irfft(among, 64, axis=0, norm="forward")  # by the lag
    lag = (np.arange(64)[:, None] - np.arange(64)) % 64
    covariance = in_time[lag].transpose(2, 0, 3, 1).reshape(128, 128)
    k = known.ravel()
    expected = values.ravel().copy()
    expected[~k] = covariance[np.ix_(~k, k)] @ np.linalg.solve(covariance[np.ix_(k, k)], expected[k])
    assert np.std(expected[~k]) > 0.1
    np.testing.assert_allclose(continued(values, known, among).ravel(), expected, atol=1e-7)


def test_rare_samples_leave_turbulence_between_them() -> None:
    """A cup of one sample a second: the field meets it, and fluctuates in between, on no straight line."""
    u = TRUTH.velocity[:, 4, 3, 0].astype(float)
    first = int(np.argmin(np.abs(TIME)))
    rare = slice(first % 5, None, 5)
    result = make([Sensor(height=GRID.z[4], time=TIME[rare], speed=u[rare])])
    computed = at(result, 4, 3)[:, 0]
    np.testing.assert_allclose(computed[rare], u[:PLANES][rare], rtol=0.0, atol=EXACT)
    steps = np.std(np.diff(computed))
    assert steps == pytest.approx(np.std(np.diff(u)), rel=0.15)
    assert steps > 1.3 * np.std(np.diff(np.interp(TIME, TIME[rare], u[rare])))


def test_the_air_needs_time_from_the_mast() -> None:
    """By the distance over the speed; a fraction of a plane is a shift of all frequencies, not an interpolation."""
    u = TRUTH.velocity[:, 4, 3, 0].astype(float)
    for planes in (25.0, 25.5):
        result = make([seen(4, 3)], distance=10.0 * 0.2 * planes)
        assert result.delay == pytest.approx(0.2 * planes)
        computed = at(result, 4, 3)[:, 0]
        if planes == 25.0:
            np.testing.assert_allclose(computed[60:], u[60 - 25 : PLANES - 25], rtol=0.0, atol=EXACT)
        else:
            whole = slice(100, PLANES - 100)
            expected = u[100 - 25 : PLANES - 125]
            slow = np.exp(-0.5 * (np.arange(-40, 41) / 8.0) ** 2) / (8.0 * np.sqrt(2.0 * np.pi))
            middle = np.convolve(0.5 * (expected + np.roll(expected, 1)), slow, "same")
            error = (np.convolve(computed[whole], slow, "same") - middle)[50:-50]
            assert np.std(error) < 0.02
            assert np.std(computed[whole]) == pytest.approx(np.std(expected), rel=0.02)
            start = TRUTH.passing[0]
            assert result.begin == pytest.approx(start + 5.1, abs=0.11) or result.begin == 0.0


def test_begin_and_end_are_those_of_the_series() -> None:
    some = slice(200, 450)
    result = make([seen(4, 3, some)], distance=100.0)
    assert (result.begin, result.end) == (pytest.approx(TIME[200] + 10.0), pytest.approx(TIME[449] + 10.0))
    computed = at(result, 4, 3)[:, 0]
    np.testing.assert_allclose(computed[250:500], TRUTH.velocity[some, 4, 3, 0], rtol=0.0, atol=EXACT)
    assert np.std(computed[500:] - TRUTH.velocity[450 : PLANES - 50, 4, 3, 0]) > 0.5


def test_a_trend_does_not_leak_to_high_frequencies() -> None:
    """The field is longer than the series, and closes the ring there: a jump would be broad-band."""
    trend = 0.02 * TIME
    rising = [Sensor(height=GRID.z[4], time=TIME, speed=10.0 + x) for x in (trend, 0.0 * trend)]
    (measured,) = on_planes(rising[:1], WIND, GRID, TIME[0], 1280, PLANES)
    assert 1.0 - measured.known.mean() > 0.1
    near = np.subtract(*(at(make([sensor]), 4, 4)[:, 0] for sensor in rising))  # what is random is the same
    steps = np.diff(near)[10:-10]
    assert np.ptp(near) > 1.0 and np.std(steps - steps.mean()) < 2e-3
    jump = [Channel(0, GRID.z[4], 0.0, trend[:1024], np.ones(1024, bool))]
    ring = probable(random_field(WIND, GRID, 1024, 0, jump))[4 * GRID.points_y + 4]
    naive = np.diff(np.fft.irfft(ring, 1024, norm="forward"))[10:-10]
    assert np.std(naive - naive.mean()) > 5.0 * np.std(steps - steps.mean())


# mean wind and variance


def steady(height: float, speed: float, direction: float, **changes: Any) -> Sensor:
    ripple = np.array([1.0, -1.0, 1.0, -1.0])
    u, v = (speed + ripple) * np.cos(direction), -(speed + ripple) * np.sin(direction)
    return Sensor(**{"height": height, "time": np.arange(4.0), "u": u, "v": v} | changes)


@pytest.mark.parametrize("direction", [0.3, 3.1])
def test_shear_and_veer_are_recovered(direction: float) -> None:
    """Also where directions pass a half turn."""
    exponent, veer = 0.17, 0.003
    sensors = [steady(z, 9.0 * (z / 90.0) ** exponent, direction + veer * (z - 90.0)) for z in (40.0, 75.0, 120.0)]
    wind = measured_wind(sensors, 90.0, spectrum="vonkarman", seed=4)
    assert (wind.speed, wind.shear_exponent) == (pytest.approx(9.0), pytest.approx(exponent))
    assert (wind.direction, wind.veer) == (pytest.approx(direction), pytest.approx(veer))
    assert (wind.spectrum, wind.seed) == ("vonkarman", 4)
    assert wind.intensity == pytest.approx(1.0 / 9.0, rel=0.01)
    noisy = [sensor.replace(noise=0.5) for sensor in sensors]
    assert measured_wind(noisy, 90.0).intensity == pytest.approx(np.sqrt(0.75) / 9.0, rel=0.01)
    given = measured_wind(sensors[:1], 90.0, shear_exponent=exponent, veer=veer)
    assert (given.speed, given.direction) == (pytest.approx(9.0), pytest.approx(direction))
    assert measured_wind(sensors[:1], 90.0).shear_exponent == 0.2


def test_cups_and_vanes_have_a_mean_wind() -> None:
    time = np.arange(6.0)
    sensors = [
        Sensor(height=50.0, time=time, speed=[8.0, np.nan, 10.0, 9.0, 9.0, 9.0]),
        Sensor(height=50.0, time=time, direction=[3.0, -3.0, np.nan, np.pi, np.pi, -np.pi]),  # about a half turn
        Sensor(height=100.0, time=time, speed=[9.0, 11.0, 10.0, 10.0, 10.0, 10.0], direction=np.full(6, np.pi)),
    ]
    wind = measured_wind(sensors, 100.0)
    assert wind.shear_exponent == pytest.approx(np.log(10.0 / 9.0) / np.log(2.0), rel=1e-3)
    assert abs(wind.direction) == pytest.approx(np.pi) and wind.veer == pytest.approx(0.0, abs=1e-9)
    assert measured_wind(sensors[:1], 50.0, direction=0.7).direction == 0.7


def test_the_profile_that_does_not_fit_is_reported_and_met() -> None:
    """Three heights, two parameters: the field passes through the sensors all the same."""
    shifted = seen(1, 2, u=TRUTH.velocity[:, 1, 2, 0] + 1.0)
    result = make([seen(4, 3), shifted])
    u = [i for i, name in enumerate(result.channels) if name.startswith("u")]
    assert np.diff(result.offset[u])[0] == pytest.approx(1.0, abs=0.8)
    assert np.mean(result.offset[u]) > 0.2
    np.testing.assert_allclose(at(result, 1, 2)[:, 0], shifted.u[:PLANES], rtol=0.0, atol=EXACT)  # type: ignore[index]


def test_the_variance_is_that_of_the_sensors_or_of_the_wind() -> None:
    wide = 10.0 + 3.0 * (TRUTH.velocity[:, 4, 3, 0].astype(float) - 10.0)
    cup = Sensor(height=GRID.z[4], time=TIME, speed=wide, noise=0.3)
    measured, model = conditioned_fields([cup], WIND, GRID, DURATION), make([cup])
    n = even_fast(PLANES + math.ceil(8.1 * 42.0 / 10.0 / 0.2), real=True)
    (planes,) = on_planes([cup], WIND, GRID, TIME[0], n, PLANES)
    variance = np.var(planes.values[planes.known]) - 0.3**2
    f, variances = amplitude_variances(WIND, GRID.hub_height, n)
    turns = np.exp(-2j * np.pi * f[:, None] * 0.2 * np.flatnonzero(planes.known))
    # what is slower than the series belongs to its mean
    expected = np.sqrt(variance / (2.0 * np.sum(variances[0] * (1.0 - np.abs(turns.mean(axis=1)) ** 2))))
    assert measured.factor == pytest.approx([expected, 1.0, 1.0]) and expected > 2.0
    assert model.factor == pytest.approx([1.0, 1.0, 1.0])
    far = [np.std(result.fields[0].velocity[:, 0, 0], axis=0) for result in (measured, model)]
    assert far[0][0] > 1.5 * far[1][0] and far[0][1:] == pytest.approx(far[1][1:])


def test_a_short_series_of_a_right_model_keeps_its_level() -> None:
    """The expected variance of 40 s of an endless wind is 0.7 of that of a periodic one of the field's length."""
    time = WIND.dt * np.arange(200)
    f, variances = amplitude_variances(WIND, GRID.hub_height, 2**17)
    turns = np.sin(200 * np.pi * f * WIND.dt) / (200 * np.sin(np.pi * f * WIND.dt))
    expected = 2.0 * np.sum(variances[0] * (1.0 - turns**2))
    x = np.random.default_rng(0).standard_normal(200)
    cup = Sensor(height=GRID.z[4], time=time, speed=10.0 + np.sqrt(expected) * (x - x.mean()) / np.std(x))
    assert conditioned_fields([cup], WIND, GRID, 40.0).factor[0] == pytest.approx(1.0, abs=0.02)


# input


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({}, "measures nothing"),
        ({"u": [1.0, 2.0]}, "u and v are given together"),
        ({"u": [1.0, 2.0], "v": [0.0, 0.0], "speed": [1.0, 2.0]}, "give only one of both"),
        ({"speed": [1.0, 2.0, 3.0]}, "speed must have 2 entries like time, found 3"),
        ({"speed": [1.0, np.nan]}, "50 % of speed is missing, expected at most 20 %"),
        ({"speed": [1.0, np.inf]}, "every entry must be a finite number; not so at entry 2"),
        ({"speed": [1.0, 999.9]}, "speed: entry 2 is beyond 300"),
        ({"time": [0.0, 0.0], "speed": [1.0, 2.0]}, "must increase"),
        ({"speed": [1.0, 2.0], "noise": -1.0}, "greater than or equal to 0"),
        ({"speed": "fast"}, "expected numbers"),
    ],
)
def test_a_sensor_that_cannot_be_is_refused(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Sensor(**TWO | fields)


def test_what_cannot_be_conditioned_is_refused() -> None:
    sensor = seen(4, 3)
    for call, message in (
        (lambda: conditioned_fields([], WIND, GRID, 10.0), "at least one sensor"),
        (lambda: make([sensor], intensity=0.0), "intensity must be above 0"),
        (lambda: make([sensor], periodic=True), "neither periodic nor hub_series"),
        (lambda: make([sensor], distance=-1.0), "0 to 1e5 m upwind"),
        (lambda: conditioned_fields([sensor], WIND, GRID, np.nan), "duration must be positive"),
        (lambda: conditioned_fields([sensor], WIND, GRID, 1e7), "does not fit into memory"),
        (lambda: conditioned_fields([sensor], WIND, GRID, 1e5, seeds=range(100)), "not fit into memory 100 times"),
        (lambda: make([seen(4, 3, time=TIME + 5000.0)]), "they measure from 49"),
        (lambda: make([sensor, sensor]), "two of them measure u at 90 m, 0 m across: leave one out, or give noise"),
        (
            lambda: measured_wind([Sensor(height=5.0, time=[0.0, 1.0], w=[0.0, 1.0])], 90.0),
            "needs a mean speed above 0",
        ),
        (lambda: make([sensor], spectrum="mann"), "takes the spectrum kaimal or vonkarman, found mann"),
        (
            lambda: conditioned_fields([sensor], WIND, GRID, 10.0, variance="measure"),  # type: ignore[arg-type]
            "variance: unknown choice 'measure'; did you mean 'measured'",
        ),
        (lambda: conditioned_fields([seen(4, 3, noise=9.0)], WIND, GRID, 10.0), "u at 90 m, .* no more than its noise"),
    ):
        with pytest.raises(InputError, match=message):
            call()


def test_two_noisy_sensors_at_one_place_are_averaged() -> None:
    noise = np.random.default_rng(3).normal(size=(2, len(TIME)))
    u = TRUTH.velocity[:, 4, 3, 0].astype(float)
    pair = [Sensor(height=GRID.z[4], time=TIME, speed=u + 0.4 * e, noise=0.4) for e in noise]
    errors = [np.std(at(make(some), 4, 3)[:, 0] - u[:PLANES]) for some in (pair[:1], pair)]
    assert 0.1 < errors[1] < 0.85 * errors[0] < 0.4
