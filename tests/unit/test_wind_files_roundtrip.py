"""What is written is read back, within what the format says it keeps."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import meltemi
from meltemi.core.errors import InputError
from meltemi.wind.fields import WindBox, WindSeries
from meltemi.wind.turbulent import HubSeries
from meltemi.wind_files.formats import FORMATS
from meltemi.wind_files.hub_csv import hub_series

Float = NDArray[np.float64]
steady = settings(derandomize=True, deadline=None, max_examples=60)
EPS = 2.0**-24
"""Relative rounding of a single-precision number."""


@st.composite
def boxes(draw: st.DrawFn, directions: bool = False) -> WindBox:
    """Boxes of any size, shear, turbulence and speed; components may be constant."""
    nt, nz, ny = draw(st.integers(2, 9)), draw(st.integers(2, 5)), draw(st.integers(2, 5))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    speed = draw(st.floats(0.5, 60.0))
    mean = [speed, draw(st.floats(-5.0, 5.0)), draw(st.floats(-5.0, 5.0))]
    sigma = [draw(st.sampled_from([0.0, 1e-4, 0.3, 4.0])) for _ in range(3)]
    v = rng.normal(mean, sigma, (nt, nz, ny, 3)) + draw(st.floats(-2.0, 2.0)) * np.arange(nz)[:, None, None] * [1, 0, 0]
    step = st.floats(0.5, 60.0)
    return WindBox(
        velocity=v.astype(np.float32),
        dt=draw(st.one_of(st.sampled_from([0.05, 0.1, 0.0125]), st.floats(0.01, 3.0))),
        dy=draw(step),
        dz=draw(step),
        bottom=draw(st.floats(1.0, 90.0)),
        speed=speed,
        hub_height=draw(st.one_of(st.none(), st.floats(2.0, 200.0))),
        periodic=draw(st.booleans()),
        direction=draw(st.floats(-3.0, 3.0)) if directions else 0.0,
        source="made for a test",
    )


def back(box: WindBox, name: str) -> WindBox:
    """The box that is read from what was written."""
    with tempfile.TemporaryDirectory() as folder:
        path = meltemi.io.write_wind(box, Path(folder) / name)[0]
        again = meltemi.read_wind(path)
    assert isinstance(again, WindBox)
    assert again.velocity.shape == box.velocity.shape and again.periodic == box.periodic
    return again


def bound(box: WindBox, name: str) -> Float:
    """[m/s] largest error of each component, from the text of each writer."""
    v = box.velocity.reshape(-1, 3).astype(float)
    largest = np.abs(v).max(axis=0)
    if name.endswith(".bts"):
        # half a step, a hundredth of one for the rounding of the slope; offset, difference and quotient are single
        return 0.51 * np.ptp(v, axis=0) / 65535.0 + 5.0 * EPS * largest
    if name.endswith(".wnd"):
        away = np.abs(v - [box.speed, 0.0, 0.0]).max(axis=0)
        about = (box.velocity - box.velocity.mean(axis=0, dtype=float)).reshape(-1, 3)
        sigma = np.maximum(np.maximum(np.sqrt(np.mean(about**2, axis=0)), 0.05 * away), 0.01)
        return 0.5001 * sigma / 1000.0 + 4.0 * EPS * (largest + np.array([box.speed, 0.0, 0.0]))
    if name.endswith(".bin"):
        return 4.0 * EPS * (largest + box.speed)  # the mean goes out and in again
    return np.zeros(3)


def check_grid(again: WindBox, box: WindBox, rtol: float) -> None:
    for name in ("dt", "dy", "dz", "speed"):
        assert getattr(again, name) == pytest.approx(getattr(box, name), rel=rtol)
    assert again.bottom == pytest.approx(box.bottom, rel=rtol, abs=2.0 * rtol * (box.top + (box.hub_height or 0.0)))
    hub = 0.5 * (box.bottom + box.top) if box.hub_height is None else box.hub_height
    assert again.hub_height == pytest.approx(hub, rel=rtol)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "rtol"), [("a.bts", 2.0 * EPS), ("a.wnd", 4.0 * EPS)])
@given(box=boxes())
@steady
def test_boxes_in_files_of_16_bits(name: str, rtol: float, box: WindBox) -> None:
    again = back(box, name)
    assert np.all(np.abs(again.velocity - box.velocity).max(axis=(0, 1, 2)) <= bound(box, name))
    check_grid(again, box, rtol)
    assert again.direction == 0.0 and again.source == name


@pytest.mark.slow
@given(box=boxes(directions=True))
@steady
def test_boxes_of_hawc2_with_their_description(box: WindBox) -> None:
    again = back(box, "a.bin")
    assert np.all(np.abs(again.velocity - box.velocity).max(axis=(0, 1, 2)) <= bound(box, "a.bin"))
    for name in ("dy", "dz", "bottom", "speed", "hub_height", "direction"):
        assert getattr(again, name) == getattr(box, name)
    assert again.dt == pytest.approx(box.dt, rel=1e-13)


@pytest.mark.slow
@given(box=boxes(directions=True), compression=st.sampled_from([0, 4]))
@settings(parent=steady, max_examples=15)
def test_boxes_in_netcdf_are_the_same(box: WindBox, compression: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.nc"
        meltemi.io.write_wind_netcdf(box, path, compression=compression)
        again = meltemi.read_wind(path)
    assert isinstance(again, WindBox)
    assert again.content_hash() == box.content_hash()
    assert (again.hub_height, again.source) == (box.hub_height, box.source)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.bts", "a.wnd", "a.bin", "a.nc"])
@given(box=boxes(), where=st.tuples(*[st.floats(-1.2, 1.2)] * 3), when=st.floats(0.0, 1.0))
@settings(parent=steady, max_examples=25)
def test_the_wind_of_a_file_is_that_of_the_box(
    name: str, box: WindBox, where: tuple[float, float, float], when: float
) -> None:
    from meltemi.maths.vectors import Vec
    from meltemi.wind.fields import wind_field
    from meltemi.wind.velocity import wind_velocity

    # steps that all formats keep exactly; else the same place is another one in the grid
    box = replace(box, dt=0.5, dy=8.0, dz=16.0, bottom=4.0, speed=16.0, hub_height=20.0)
    p = Vec(where[0] * 8.0, where[1] * box.width, 20.0 + where[2] * 20.0)
    pair = [wind_field(b, 20.0, 10.0) for b in (box, back(box, name))]
    one, two = (wind_velocity(p, when * box.duration, a) for a in pair)
    difference = np.abs([one.x - two.x, one.y - two.y, one.z - two.z])
    assert np.all(difference <= bound(box, name) + 1e-12)


def test_plain_xarray_opens_a_netcdf_box(tmp_path: Path) -> None:
    import xarray as xr

    v = np.random.default_rng(1).normal(size=(4, 2, 3, 3)).astype(np.float32)
    box = WindBox(velocity=v, dt=0.5, dy=10.0, dz=12.0, bottom=30.0, speed=8.0)
    meltemi.io.write_wind(box, tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc") as data:
        assert dict(data.sizes) == {"time": 4, "z": 2, "y": 3}
        assert data.u.attrs["units"] == "m s-1" and data.w.dtype == np.float32
        assert data.y.values.tolist() == [-10.0, 0.0, 10.0] and data.z.values.tolist() == [30.0, 42.0]
        assert float(data.v.sel(time=1.5, z=42.0, y=-10.0)) == v[3, 1, 0, 1]
        assert "hub_height" not in data.attrs and data.attrs["dt_units"] == "s"
    with pytest.raises(InputError, match="compression must be a whole number from 0 to 9"):
        meltemi.io.write_wind_netcdf(box, tmp_path / "b.nc", compression=11)


columns = st.lists(st.tuples(*[st.floats(-50.0, 50.0)] * 7), min_size=1, max_size=6)


@given(rows=columns, start=st.floats(-10.0, 10.0), step=st.floats(0.01, 10.0))
@steady
def test_series_in_uniform_wind_files(rows: list[tuple[float, ...]], start: float, step: float) -> None:
    names = ("speed", "direction", "vertical", "horizontal_shear", "exponent", "vertical_shear", "gust")
    data = {name: [row[i] for row in rows] for i, name in enumerate(names)}
    wind = WindSeries(time=start + step * np.arange(len(rows)), **data)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.wnd"
        assert meltemi.io.write_wind(wind, path) == [path]
        again = meltemi.read_wind(path)
    assert isinstance(again, WindSeries)
    for name in ("time", *names):  # twelve digits
        np.testing.assert_allclose(getattr(again, name), getattr(wind, name), rtol=1e-11)


@given(
    st.lists(st.tuples(*[st.floats(-1e6, 1e6)] * 3), min_size=2, max_size=6),
    st.booleans(),
    st.booleans(),
)
@steady
def test_hub_series_are_the_same(rows: list[tuple[float, float, float]], has_v: bool, has_w: bool) -> None:
    u, v, w = np.array(rows).T
    series = HubSeries(time=np.arange(len(rows)) / 3.0, u=u, v=v if has_v else None, w=w if has_w else None)
    with tempfile.TemporaryDirectory() as folder:
        meltemi.io.write_wind(series, Path(folder) / "a.csv")
        assert meltemi.io.read_hub_csv(Path(folder) / "a.csv") == series


@given(box=boxes())
@steady
def test_the_hub_series_of_a_box_is_its_wind_at_the_hub_in_time(box: WindBox) -> None:
    from meltemi.maths.vectors import Vec
    from meltemi.wind.fields import wind_field
    from meltemi.wind.velocity import wind_velocity

    box = replace(box, hub_height=box.bottom + 0.3 * (box.top - box.bottom))
    series = hub_series(box)
    assert box.hub_height is not None
    kernel_wind = wind_field(box, box.hub_height, 10.0)
    for i in (0, len(series.time) - 1):
        here = Vec(0.0, 0.0, box.hub_height)
        wind = wind_velocity(here, float(series.time[i]), kernel_wind)
        assert series.v is not None and series.w is not None
        # times have nine decimals and the kernel stops a millionth of a step before the edge
        slack = 1e-5 * float(np.ptp(box.velocity)) + 1e-5
        assert [series.u[i], series.v[i], series.w[i]] == pytest.approx([wind.x, wind.y, wind.z], abs=slack)


def test_a_height_outside_the_box_has_no_hub_series() -> None:
    box = WindBox(velocity=np.ones((2, 2, 2, 3)), dt=1.0, dy=1.0, dz=1.0, bottom=10.0, speed=5.0, hub_height=90.0)
    with pytest.raises(InputError, match="a height of 90 m is outside the box, 10 to 11 m"):
        hub_series(box)
    assert hub_series(box, 10.5).u.tolist() == [1.0, 1.0]


def test_a_direction_is_not_lost_in_silence(tmp_path: Path) -> None:
    box = WindBox(velocity=np.ones((2, 2, 2, 3)), dt=1.0, dy=1.0, dz=1.0, bottom=10.0, speed=5.0, direction=0.1)
    for name in ("a.bts", "a.wnd"):
        with pytest.raises(InputError, match=r"cannot store the direction of 5\.72958 deg"):
            meltemi.io.write_wind(box, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_each_format_has_its_own_name_and_functions() -> None:
    assert len({f.name for f in FORMATS}) == len(FORMATS)
    for f in FORMATS:
        assert f.read.__name__ == f.reader and f.write.__name__ == f.writer
