"""Fatigue, averages over revolutions and azimuth, and results in files."""

from __future__ import annotations

import json
from collections import Counter
from itertools import pairwise
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import meltemi
from meltemi import InputError, Model, Result, Start, Status, SteadyWind
from meltemi.postprocess.cycles import rainflow_cycles
from meltemi.postprocess.fatigue import damage_equivalent_load, equivalent_loads
from meltemi.postprocess.files import read_netcdf, write_netcdf
from meltemi.postprocess.statistics import azimuth_bins, azimuthal_averages, means_over_revolutions
from meltemi.simulation.channels import Channel, standard

Float = NDArray[np.float64]
steady = settings(derandomize=True, deadline=None, max_examples=150)
series = st.lists(st.integers(-20, 20).map(float), min_size=2, max_size=60)


def result(time: Any, **columns: Any) -> Result:
    """A result with some channels."""
    channels = tuple(standard()[name] for name in columns)
    return Result(np.asarray(time, float), np.stack([np.asarray(c, float) for c in columns.values()], axis=1), channels)


# rainflow

ASTM = [-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0]
"""The example of ASTM E1049-85, figure 6."""


def counted(x: Any) -> dict[tuple[float, float], float]:
    """Counts of the cycles of a series by range and mean."""
    counts: Counter[tuple[float, float]] = Counter()
    for r, m, c in zip(*rainflow_cycles(x), strict=True):
        counts[float(r), float(m)] += float(c)
    return dict(counts)


def test_the_example_of_the_standard() -> None:
    # E1049-85, section 5.4.4: half cycles A-B, B-C, C-D, D-G, G-H, H-I and the cycle E-F
    assert counted(ASTM) == {
        (3.0, -0.5): 0.5,
        (4.0, -1.0): 0.5,
        (4.0, 1.0): 1.0,
        (8.0, 1.0): 0.5,
        (9.0, 0.5): 0.5,
        (8.0, 0.0): 0.5,
        (6.0, 1.0): 0.5,
    }


def by_the_standard(x: list[float]) -> Counter[float]:
    """Counts by range, with the rules of E1049-85, section 5.4.4, one by one."""
    points: list[float] = []
    for value in x:
        if points and value == points[-1]:
            continue
        if len(points) > 1 and (points[-1] - points[-2]) * (value - points[-1]) > 0.0:
            points[-1] = value
        else:
            points.append(value)
    counts: Counter[float] = Counter()
    stack: list[float] = []
    for point in points:
        stack.append(point)
        while len(stack) > 2:
            X, Y = abs(stack[-1] - stack[-2]), abs(stack[-2] - stack[-3])
            if X < Y:
                break
            if len(stack) == 3:  # Y holds the starting point
                counts[Y] += 0.5
                del stack[0]
            else:
                counts[Y] += 1.0
                del stack[-3:-1]
    for a, b in pairwise(stack):
        counts[abs(b - a)] += 0.5
    return counts


@steady
@given(x=series)
def test_cycles_are_counted_by_the_rules_of_the_standard(x: list[float]) -> None:
    ranges: Counter[float] = Counter()
    for (r, _), count in counted(x).items():
        ranges[r] += count
    ranges.pop(0.0, None)  # see below
    assert ranges == by_the_standard(x)


@steady
@given(x=series)
def test_the_largest_cycle_is_that_from_lowest_to_highest_value(x: list[float]) -> None:
    ranges, means, counts = rainflow_cycles(x)
    assert max(ranges, default=0.0) == max(x) - min(x)
    assert np.all((counts == 0.5) | (counts == 1.0))
    assert np.all(means + 0.5 * ranges <= max(x))
    assert np.all(means - 0.5 * ranges >= min(x))


@pytest.mark.parametrize("x", [[], [3.0], [3.0, 3.0], [3.0] * 10])
def test_what_does_not_change_has_no_cycles(x: list[float]) -> None:
    assert [len(part) for part in rainflow_cycles(x)] == [0, 0, 0]
    if len(x) < 2:
        with pytest.raises(InputError, match="at least 2 numbers"):
            damage_equivalent_load(x, duration=10.0, slope=4.0)
        return
    assert damage_equivalent_load(x, duration=10.0, slope=4.0) == 0.0
    assert damage_equivalent_load(x, duration=10.0, slope=4.0, bins=10) == 0.0


@pytest.mark.parametrize("x", [[1.0, 5.0], [5.0, 3.0, 1.0], [1.0, 1.0, 4.0, 5.0, 5.0]])
def test_a_rise_or_fall_is_half_a_cycle(x: list[float]) -> None:
    assert counted(x) == {(4.0, 3.0): 0.5}


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_values_that_are_no_numbers_are_refused(bad: float) -> None:
    with pytest.raises(InputError, match="the series contains values that are not finite"):
        rainflow_cycles([1.0, bad, 2.0])


# damage-equivalent loads


@pytest.mark.parametrize("slope", [3.0, 4.0, 10.0])
@pytest.mark.parametrize("frequency", [0.2, 1.0, 2.5])
def test_the_equivalent_load_of_a_cosine(slope: float, frequency: float) -> None:
    t = np.linspace(0.0, 100.0, 100001)
    x = 7.0 + 3.0 * np.cos(2.0 * pi * frequency * t)
    # f T cycles of range 6 against f_eq T of the equivalent one; samples miss the peaks by (pi f dt)^2 / 2
    expected = 6.0 * (frequency / 1.0) ** (1.0 / slope)
    assert damage_equivalent_load(x, duration=100.0, slope=slope) == pytest.approx(expected, rel=1e-5)


def test_the_equivalent_load_of_the_standards_example() -> None:
    # by hand with m = 4: (3^4 + 4^4 + 2 * 4^4 + 2 * 8^4 + 9^4 + 6^4) / 2 over 20 reference cycles
    damage = 0.5 * (3**4 + 4**4 + 8**4 + 9**4 + 8**4 + 6**4) + 4**4
    found = damage_equivalent_load(ASTM, duration=10.0, slope=4.0, f_eq=2.0)
    assert found == pytest.approx((damage / 20.0) ** 0.25, rel=1e-14)


@steady
@given(
    x=series,
    scale=st.floats(1e-3, 1e6),
    shift=st.integers(-1000, 1000),
    slope=st.floats(1.0, 15.0),
    f=st.floats(0.1, 10.0),
)
def test_equivalent_loads_scale(x: list[float], scale: float, shift: int, slope: float, f: float) -> None:
    load = damage_equivalent_load(x, duration=60.0, slope=slope)
    array = np.array(x)
    assert damage_equivalent_load(-scale * (array + shift), duration=60.0, slope=slope) == pytest.approx(
        scale * load, rel=1e-9, abs=1e-12
    )
    assert damage_equivalent_load(array, duration=60.0, slope=slope, f_eq=f) == pytest.approx(
        load * f ** (-1.0 / slope), rel=1e-12
    )
    assert damage_equivalent_load(array, duration=60.0 * f, slope=slope) == pytest.approx(
        load * f ** (-1.0 / slope), rel=1e-12
    )


def test_large_loads_and_slopes_do_not_overflow() -> None:
    assert np.isfinite(damage_equivalent_load([0.0, 1e40, 0.0], duration=1.0, slope=12.0))


@steady
@given(x=series.filter(lambda x: len(set(x)) > 1), bins=st.integers(1, 100), slope=st.floats(1.0, 12.0))
def test_bins_take_the_range_of_their_upper_edge(x: list[float], bins: int, slope: float) -> None:
    load = damage_equivalent_load(x, duration=60.0, slope=slope)
    binned = damage_equivalent_load(x, duration=60.0, slope=slope, bins=bins)
    ranges, _, counts = rainflow_cycles(x)
    width = ranges.max() / bins
    edges = np.arange(1, bins + 1) * width
    upper = edges[np.minimum(np.searchsorted(edges, ranges * (1.0 - 1e-12)), bins - 1)]
    assert binned == pytest.approx((np.sum(counts * upper**slope) / 60.0) ** (1.0 / slope), rel=1e-9)
    assert binned >= load * (1.0 - 1e-9)


def test_a_range_on_an_edge_belongs_to_the_bin_below() -> None:
    # ranges 3 4 4 6 8 8 9 in nine bins of width 1
    load, binned = (damage_equivalent_load(ASTM, duration=1.0, slope=4.0, bins=bins) for bins in (None, 9))
    assert binned == pytest.approx(load, rel=1e-12)


@pytest.mark.parametrize("name", ["duration", "slope", "f_eq"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan")])
def test_durations_slopes_and_frequencies_must_be_positive(name: str, value: float) -> None:
    arguments = {"duration": 10.0, "slope": 4.0, name: value}
    with pytest.raises(InputError, match=f"damage_equivalent_load: {name} must be positive, found"):
        damage_equivalent_load(ASTM, **arguments)


@pytest.mark.parametrize("bins", [0, -3])
def test_there_must_be_bins(bins: int) -> None:
    with pytest.raises(InputError, match="bins"):
        damage_equivalent_load(ASTM, duration=10.0, slope=4.0, bins=bins)


def test_equivalent_loads_of_a_result_have_the_usual_slopes() -> None:
    t = np.linspace(0.0, 20.0, 401)
    wave = 1e3 * np.cos(2.0 * pi * t)
    no_loads = ("azimuth", "generator_power", "pitch_1")
    loads = ("root_moment_out_of_plane_1", "root_force_x_2", "tower_base_moment_fore_aft", "rotor_torque")
    columns = dict.fromkeys(no_loads + loads, wave)
    assert tuple(equivalent_loads(result(t, **columns))) == loads
    for f_eq, factor in ((1.0, 1.0), (2.0, 0.5)):
        found = equivalent_loads(result(t, **columns), f_eq=f_eq)
        assert found["root_moment_out_of_plane_1"] == pytest.approx(2e3 * factor**0.1, rel=1e-9)
        assert found["tower_base_moment_fore_aft"] == pytest.approx(2e3 * factor**0.25, rel=1e-9)


def test_equivalent_loads_of_given_slopes() -> None:
    t = np.linspace(0.0, 20.0, 401)
    wave = 1e3 * np.cos(2.0 * pi * t)
    some = result(t, root_moment_out_of_plane_1=wave, tower_base_moment_fore_aft=wave, pitch_1=wave)
    found = equivalent_loads(some, f_eq=2.0, slopes={"RootMyc1": 12.0, "pitch_1": 3.0})
    assert found["root_moment_out_of_plane_1"] == pytest.approx(2e3 * 0.5 ** (1.0 / 12.0), rel=1e-9)
    assert found["tower_base_moment_fore_aft"] == pytest.approx(2e3 * 0.5**0.25, rel=1e-9)
    assert found["pitch_1"] == pytest.approx(2e3 * 0.5 ** (1.0 / 3.0), rel=1e-9)
    with pytest.raises(InputError, match="RootMyc1"):
        equivalent_loads(some, slopes={"RootMyc11": 10.0})


def test_equivalent_loads_of_chosen_channels() -> None:
    t = np.linspace(0.0, 20.0, 401)
    some = result(t, root_moment_out_of_plane_1=np.cos(t), tower_base_moment_fore_aft=np.cos(t), pitch_1=np.cos(t))
    assert list(equivalent_loads(some, ["RootMyc1", "pitch_1"])) == ["root_moment_out_of_plane_1"]
    with pytest.raises(InputError, match="no channel 'RootMyc2': did you mean RootMyc1"):
        equivalent_loads(some, ["RootMyc2"])


@pytest.mark.parametrize("n", [0, 1])
def test_a_result_too_short_has_no_equivalent_loads(n: int) -> None:
    with pytest.raises(InputError, match="one sample" if n else "no samples"):
        equivalent_loads(result(np.zeros(n), rotor_torque=np.zeros(n)))


# averages over revolutions


def test_averages_over_revolutions_of_a_steady_rotor() -> None:
    t = np.linspace(0.0, 10.0, 1001)
    azimuth = 0.3 + 2.0 * pi * 0.45 * t
    x = 5.0 + 2.0 * np.cos(azimuth) + 0.1 * np.sin(3.0 * azimuth)
    means, ends = means_over_revolutions(t, azimuth, x)
    np.testing.assert_allclose(ends, np.arange(1, 5) / 0.45, rtol=1e-12)
    # trapezes miss (omega dt)^2 / 12 of the oscillation, and what is cut at the ends of a revolution
    np.testing.assert_allclose(means, 5.0, rtol=0.0, atol=1e-3)


@steady
@given(seed=st.integers(0, 10**6))
def test_averages_are_exact_between_samples(seed: int) -> None:
    rng = np.random.default_rng(seed)
    t = np.cumsum(rng.uniform(0.05, 0.4, 80))
    azimuth = rng.uniform(-3.0, 3.0) + np.cumsum(rng.uniform(0.05, 0.8, 80))
    x = rng.standard_normal(80)
    means, ends = means_over_revolutions(t, azimuth, x)
    # the series with every end put in: then trapezes are exact
    begins = np.interp(azimuth[0] + 2.0 * pi * np.arange(len(means)), azimuth, t)
    for begin, end, mean in zip(begins, ends, means, strict=True):
        inside = np.concatenate([[begin], t[(t > begin) & (t < end)], [end]])
        assert mean == pytest.approx(np.trapezoid(np.interp(inside, t, x), inside) / (end - begin), abs=1e-10)


def test_a_wrapped_azimuth_is_the_same() -> None:
    t = np.linspace(0.0, 30.0, 601)
    azimuth, x = 1.0 + 1.2 * t, np.sin(t)
    for found, expected in zip(
        means_over_revolutions(t, azimuth % (2.0 * pi), x), means_over_revolutions(t, azimuth, x), strict=True
    ):
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("n", range(1, 30))
def test_a_series_of_whole_revolutions_gives_all_of_them(n: int) -> None:
    azimuth = np.linspace(0.0, 2.0 * pi * n, 40 * n + 1)
    found, _ = means_over_revolutions(np.linspace(0.0, 5.0 * n, 40 * n + 1), azimuth % (2.0 * pi), np.ones(40 * n + 1))
    assert len(found) == n


@pytest.mark.parametrize("turns", [0.0, 0.5, 0.99, -3.0])
def test_less_than_a_revolution_is_refused(turns: float) -> None:
    t = np.linspace(0.0, 1.0, 101)
    with pytest.raises(InputError, match="the series covers less than one revolution"):
        means_over_revolutions(t, 2.0 * pi * turns * t, t)


@pytest.mark.parametrize("n", [0, 1])
def test_series_without_length_are_refused(n: int) -> None:
    with pytest.raises(InputError, match="less than one revolution"):
        means_over_revolutions(np.zeros(n), np.zeros(n), np.zeros(n))


def test_revolution_means_of_a_channel() -> None:
    t = np.linspace(0.0, 21.0, 421)
    some = result(t, azimuth=(t % (2.0 * pi)), root_moment_out_of_plane_1=t)
    # one rad/s: the mean over a revolution of the time is its middle
    expected = 2.0 * pi * (np.arange(3) + 0.5)
    np.testing.assert_allclose(azimuthal_averages(some, "RootMyc1"), expected, rtol=1e-9)


def test_revolution_means_need_the_azimuth() -> None:
    t = np.linspace(0.0, 21.0, 421)
    with pytest.raises(InputError, match="no channel 'azimuth'"):
        azimuthal_averages(result(t, rotor_torque=t), "rotor_torque")


# averages over the azimuth


def test_azimuth_bins() -> None:
    azimuth = np.radians([0.0, 89.9, 90.0, 100.0, 359.9, 360.0, 450.0, -10.0])
    some = result(np.arange(8.0), azimuth=azimuth, rotor_torque=[1.0, 3.0, 10.0, 20.0, 5.0, 2.0, 30.0, 7.0])
    means = azimuth_bins(some, "RotTorq", 4)
    np.testing.assert_allclose(means, [2.0, 20.0, np.nan, 6.0])


def test_one_bin_is_the_mean() -> None:
    x = np.arange(50.0)
    assert azimuth_bins(result(x, azimuth=x, rotor_torque=x), "rotor_torque", 1) == pytest.approx([24.5])


def test_bins_of_a_function_of_the_azimuth() -> None:
    azimuth = np.linspace(0.0, 40.0 * pi, 36 * 500, endpoint=False)
    some = result(azimuth, azimuth=azimuth % (2.0 * pi), rotor_torque=np.cos(azimuth))
    middles = 2.0 * pi * (np.arange(36) + 0.5) / 36.0
    # the mean of a cosine over 10 degrees: sinc(5 degrees) of its middle; 900 samples a revolution begin each bin
    expected = np.cos(middles) * np.sinc(10.0 / 360.0)
    np.testing.assert_allclose(azimuth_bins(some, "rotor_torque"), expected, rtol=0.0, atol=pi / 900.0)


def test_an_azimuth_just_below_zero_is_in_the_last_bin() -> None:
    some = result([0.0], azimuth=[-1e-20], rotor_torque=[3.0])
    assert azimuth_bins(some, "rotor_torque", 6)[5] == 3.0


# files


@pytest.fixture(scope="module")
def run(model: Model) -> Result:
    """A second of a run in which everything is recorded."""
    start = Start(rotor_speed=1.2, generator_torque=3e4)
    return meltemi.simulate(model, SteadyWind(speed=11.0), duration=1.0, channels=["all"], start=start)


@pytest.fixture(scope="module")
def run_file(run: Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_netcdf(run, tmp_path_factory.mktemp("run") / "run.nc")


def same(a: Result, b: Result) -> None:
    assert np.array_equal(a.time, b.time)
    assert np.array_equal(a.data, b.data, equal_nan=True)
    assert a.channels == b.channels
    assert (a.status, a.message, a.meta) == (b.status, b.message, b.meta)


@pytest.mark.long
def test_a_run_survives_a_file(run: Result, run_file: Path) -> None:
    assert len(run.channels) > 800
    again = read_netcdf(run_file)
    same(again, run)
    assert again.meta["options"]["fore_aft_modes"] == 2
    assert np.array_equal(again["q blade 1 1st flap"], run["q blade 1 1st flap"])


def test_a_run_that_ended_early_survives_with_its_reason(tmp_path: Path) -> None:
    data = np.array([[1.0, np.nan], [np.inf, -0.0]])
    meta = {"turbine": "prüf", "nested": {"list": [1, 2.5, None, True]}, "time_step": 0.01}
    channels = (standard()["wind_x"], standard()["azimuth"])
    early = Result(np.array([0.0, 0.05]), data, channels, Status.DIVERGED, "at t = 0.1 s …", meta)
    path = write_netcdf(early, str(tmp_path / "a.nc"))
    assert path == tmp_path / "a.nc"
    same(read_netcdf(path), early)


@pytest.mark.parametrize(("rows", "columns"), [(0, 2), (3, 0), (0, 0)])
def test_empty_results_survive(tmp_path: Path, rows: int, columns: int) -> None:
    channels = tuple(standard().values())[1 : 1 + columns]
    empty = Result(np.arange(float(rows)), np.zeros((rows, columns)), channels)
    again = read_netcdf(write_netcdf(empty, tmp_path / "a.nc"))
    same(again, empty)
    assert again.data.shape == (rows, columns)


@pytest.mark.long
def test_other_programs_find_labels_in_the_file(run: Result, run_file: Path) -> None:
    with xr.open_dataset(run_file, engine="h5netcdf") as data:
        moment = data["root_moment_out_of_plane_1"]
        assert moment.dims == ("time",)
        assert moment.attrs == {
            "units": "N m",
            "long_name": "out-of-plane bending moment at the blade root",
            "frame": "coned blade axes",
            "positive_direction": "about y: positive when thrust bends the blade downwind",
            "openfast_name": "RootMyc1",
            "unit_in_tables": "kN m",
            "factor_to_tables": 1e-3,
        }
        assert data["time"].attrs["units"] == "s"
        assert data["time"].attrs["axis"] == "T"
        assert data.attrs["Conventions"].startswith("CF-")
        assert data.attrs["title"] == "nrel5mw: " + run.meta["wind"]
        assert "-" not in {series.attrs["units"] for series in data.values()}
        np.testing.assert_array_equal(moment.values, run["RootMyc1"])
        assert json.loads(data.attrs["meta"])["turbine"] == "nrel5mw"


def small() -> Result:
    return result([0.0, 1.0], wind_x=[8.0, 9.0])


def test_a_file_is_replaced_as_a_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_netcdf(small(), tmp_path / "a.nc")
    before = path.read_bytes()

    def full(variables: object, attributes: object, path: Path) -> None:
        path.write_bytes(b"half of a file")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("meltemi.postprocess.files.netcdf.to_netcdf", full)
    with pytest.raises(InputError, match=r"a\.nc: cannot be written \(No space left on device\)"):
        write_netcdf(small(), path)
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_bytes() == before


@pytest.mark.parametrize("name", ["nowhere/a.nc", "folder"])
def test_places_that_cannot_be_written_are_named(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match=rf"{name}: cannot be written \("):
        write_netcdf(small(), tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == ["folder"]


def test_missing_files_are_named(tmp_path: Path) -> None:
    for path, why in ((tmp_path / "missing.nc", "No such file"), (tmp_path, "it is a folder")):
        with pytest.raises(InputError, match=why):
            read_netcdf(path)


def test_other_files_are_refused(tmp_path: Path) -> None:
    whole = write_netcdf(small(), tmp_path / "a.nc").read_bytes()
    other, cut, text, nothing = (tmp_path / name for name in ("other.nc", "cut.nc", "text.nc", "nothing.nc"))
    xr.Dataset({"x": ("t", [1.0, 2.0])}).to_netcdf(other, engine="h5netcdf")
    cut.write_bytes(whole[: len(whole) // 2])
    text.write_text("no netCDF")
    nothing.touch()
    for path in (other, cut, text, nothing):
        with pytest.raises(InputError, match=rf"{path.name}: not a result of meltemi"):
            read_netcdf(path)


NEWER = json.dumps([{**{name: getattr(standard()["wind_x"], name) for name in Channel.__slots__}, "colour": "red"}])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("channels", "[]]"),
        ("channels", '[{"name": "wind_x"}]'),
        ("channels", "[3]"),
        ("channels", "null"),
        ("channels", NEWER),  # as a later version might write it
        ("status", 77),
        ("meta", "{"),
    ],
)
def test_damaged_descriptions_are_refused(tmp_path: Path, name: str, value: Any) -> None:
    path = write_netcdf(small(), tmp_path / "a.nc")
    with xr.open_dataset(path, engine="h5netcdf") as data:
        damaged = data.load()
    damaged.attrs[name] = value
    damaged.to_netcdf(path, engine="h5netcdf")
    with pytest.raises(InputError, match="not a result of meltemi"):
        read_netcdf(path)
