"""Wind files, written byte by byte here as the TurbSim user's guide lays them out, and read back."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.wind_files import read_bts, read_wnd

Float = NDArray[np.float64]
NT, NZ, NY, N_TOWER = 7, 3, 4, 2
TEXT = b"This full-field file was made by hand."


def field(seed: int = 1) -> tuple[Float, Float]:
    """(T, Z, Y, 3) velocities on the grid and (T, N, 3) on the tower below it."""
    rng = np.random.default_rng(seed)
    grid = rng.normal([9.0, 0.5, -0.2], [2.0, 1.0, 0.5], (NT, NZ, NY, 3))
    return grid, rng.normal(5.0, 1.0, (NT, N_TOWER, 3))


def bts(velocity: Float, tower: Float, **changes: Any) -> bytes:
    """A TurbSim file: each component scaled so that it fills the range of 16 bits."""
    header: dict[str, Any] = {
        "id": 7, "nz": velocity.shape[1], "ny": velocity.shape[2], "ntower": tower.shape[1], "nt": velocity.shape[0],
        "dz": 12.0, "dy": 10.0, "dt": 0.05, "speed": 9.25, "hub": 90.0, "bottom": 30.0,
    } | {k: v for k, v in changes.items() if k != "scale"}  # fmt: skip
    both = np.concatenate([velocity.reshape(-1, 3), tower.reshape(-1, 3)])
    low, high = both.min(axis=0), both.max(axis=0)
    slope = np.float32(65535.0 / (high - low))
    offset = np.float32(-32768.0 - slope * low)
    slope = np.float32(changes.get("scale", slope))
    out = struct.pack("<h", header["id"])
    out += struct.pack("<iiii", header["nz"], header["ny"], header["ntower"], header["nt"])
    out += struct.pack("<ffffff", *(header[k] for k in ("dz", "dy", "dt", "speed", "hub", "bottom")))
    for c in range(3):
        out += struct.pack("<ff", slope[c], offset[c])
    out += struct.pack("<i", len(TEXT)) + TEXT
    for t in range(velocity.shape[0]):
        for points in (velocity[t].reshape(-1, 3), tower[t]):  # rows from the bottom, in each from right to left
            for point in points:
                for c in range(3):
                    count = round(float(slope[c] * point[c] + offset[c]))
                    out += struct.pack("<h", min(max(count, -32768), 32767))
    return out


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "field.bts"


@pytest.mark.parametrize(("kind", "periodic"), [(7, False), (8, True)])
def test_a_turbsim_file_is_read_back_within_half_a_count(path: Path, kind: int, periodic: bool) -> None:
    grid, tower = field()
    path.write_bytes(bts(grid, tower, id=kind))
    box = read_bts(path)
    everything = np.concatenate([grid.reshape(-1, 3), tower.reshape(-1, 3)])
    count = np.ptp(everything, axis=0) / 65535.0
    # half a count, and the rounding of slope, offset and velocities to single precision (6e-8 of the raw range)
    allowed = 0.5 * count + 65536.0 * 6e-8 * 3.0 * count
    assert box.velocity.shape == (NT, NZ, NY, 3)
    assert np.all(np.abs(box.velocity - grid) <= allowed)
    assert box.periodic is periodic


def test_the_grid_of_a_turbsim_file(path: Path) -> None:
    path.write_bytes(bts(*field()))
    box = read_bts(str(path))
    assert (box.dz, box.dy, box.speed, box.hub_height, box.bottom) == (12.0, 10.0, 9.25, 90.0, 30.0)
    assert box.dt == 0.05  # written in single precision: 0.0500000007
    assert (box.width, box.top) == (30.0, 54.0)
    assert box.source == box.label == "field.bts"


def test_columns_go_from_right_to_left_and_rows_from_bottom_to_top(path: Path) -> None:
    from meltemi.maths.vectors import Vec
    from meltemi.wind.fields import wind_field
    from meltemi.wind.velocity import wind_velocity

    grid = np.full((NT, NZ, NY, 3), 8.0)
    grid[:, 0, 0, 0], grid[:, 2, 3, 0] = 1.0, 15.0
    path.write_bytes(bts(grid, np.full((NT, N_TOWER, 3), [4.0, 4.0, 4.0])))
    kernel_wind = wind_field(read_bts(path), 90.0, 126.0)
    for (y, z), expected in {(-15.0, 30.0): 1.0, (15.0, 54.0): 15.0, (-15.0, 54.0): 8.0}.items():
        u = wind_velocity(Vec(0.0, y, z), 2.0, kernel_wind).x
        assert u == pytest.approx(expected, abs=14.0 / 65535.0)  # half a count and the edge of the grid


def test_a_file_without_tower_points(path: Path) -> None:
    grid, _ = field()
    path.write_bytes(bts(grid, np.zeros((NT, 0, 3))))
    np.testing.assert_allclose(read_bts(path).velocity, grid, rtol=0.0, atol=2e-4)  # a count is 1.5e-4


def test_bytes_after_the_last_step_do_not_matter(path: Path) -> None:
    path.write_bytes(bts(*field()) + b"more")
    assert read_bts(path).velocity.shape == (NT, NZ, NY, 3)


@pytest.mark.parametrize("missing", [1, 50, 500])
def test_a_file_that_is_cut_off_is_refused(path: Path, missing: int) -> None:
    whole = bts(*field())
    path.write_bytes(whole[:-missing])
    with pytest.raises(InputError) as caught:
        read_bts(path)
    assert str(caught.value) == f"{path}: cut off: {len(whole) - missing} bytes, expected {len(whole)}"


@pytest.mark.parametrize("size", [0, 1, 69])
def test_a_file_shorter_than_its_header_is_refused(path: Path, size: int) -> None:
    path.write_bytes(bts(*field())[:size])
    with pytest.raises(InputError, match=rf"field\.bts: not a TurbSim \.bts file \(only {size} bytes\)"):
        read_bts(path)


@pytest.mark.parametrize("change", [{"id": 4}, {"nz": 0}, {"ny": -1}, {"nt": 0}, {"ntower": -1}])
def test_a_file_of_another_kind_is_refused(path: Path, change: dict[str, int]) -> None:
    path.write_bytes(bts(*field(), **change))
    with pytest.raises(InputError, match=r"field\.bts: not a TurbSim \.bts file"):
        read_bts(path)


@pytest.mark.parametrize("change", [{"dt": 0.0}, {"dy": -1.0}, {"speed": 0.0}, {"scale": [1.0, 0.0, 1.0]}])
def test_zero_steps_and_scales_are_refused(path: Path, change: dict[str, Any]) -> None:
    path.write_bytes(bts(*field(), **change))
    with pytest.raises(InputError, match=r"field\.bts: the header has a zero scale or step"):
        read_bts(path)


@pytest.mark.parametrize(
    "change",
    [{"nt": 1}, {"bottom": -5.0}, {"dt": float("nan")}, {"speed": float("inf")}, {"hub": float("nan")}],
)
def test_fields_no_box_can_have_are_refused_with_the_file_name(path: Path, change: dict[str, float]) -> None:
    path.write_bytes(bts(*field(), **change))
    with pytest.raises(InputError, match=r"field\.bts: "):
        read_bts(path)


def test_text_is_no_turbsim_file(path: Path) -> None:
    path.write_text("! a uniform wind file\n" + "0.0 12.0 0 0 0 0 0 0\n" * 10)
    with pytest.raises(InputError, match="not a TurbSim"):
        read_bts(path)


@pytest.mark.parametrize("read", [read_bts, read_wnd])
def test_missing_files_and_folders_are_named(tmp_path: Path, read: Any) -> None:
    with pytest.raises(InputError, match=r"nothing\.x: cannot be read \(No such file"):
        read(tmp_path / "nothing.x")
    with pytest.raises(InputError, match="cannot be read"):
        read(tmp_path)


WND = """\
! Time  Wind   Wind   Vert.  Horiz.  Pwr.Law  Lin.V.  Gust   Upflow
! [s]   [m/s]  [deg]  [m/s]  [-]     [-]      [-]     [m/s]  [deg]
 0.0    10.0    0.0   0.0    0.00    0.20     0.00    0.0    0.0
 5.0    12.0   30.0   0.5    0.10    0.14    -0.10    2.0    8.0   ! the gust

 9.0    11.0  -10.0   0.0    0.00    0.20     0.00    0.0    0.0
"""


@pytest.fixture
def wnd(tmp_path: Path) -> Path:
    return tmp_path / "gust.wnd"


def test_a_uniform_wind_file_is_read(wnd: Path) -> None:
    wnd.write_text(WND)
    wind = read_wnd(wnd)
    np.testing.assert_array_equal(wind.time, [0.0, 5.0, 9.0])
    # the upflow angle turns the wind and its gust up, the vertical speed comes on top
    level = np.array([1.0, np.cos(np.radians(8.0)), 1.0])
    np.testing.assert_allclose(wind.speed, level * [10.0, 12.0, 11.0], rtol=1e-14)
    np.testing.assert_array_equal(wind.direction, np.radians([0.0, 30.0, -10.0]))
    np.testing.assert_array_equal(wind.horizontal_shear, [0.0, 0.1, 0.0])
    np.testing.assert_array_equal(wind.exponent, [0.2, 0.14, 0.2])
    np.testing.assert_array_equal(wind.vertical_shear, [0.0, -0.1, 0.0])
    np.testing.assert_allclose(wind.gust, level * [0.0, 2.0, 0.0], rtol=1e-14)
    np.testing.assert_allclose(wind.vertical, [0.0, 0.5 + np.sin(np.radians(8.0)) * 14.0, 0.0], rtol=1e-14)
    assert wind.label == "gust.wnd"


def test_eight_columns_commas_and_headers_without_sign_are_understood(wnd: Path) -> None:
    wnd.write_text("Time Speed Dir\n0, 10, 0, 0, 0, 0.2, 0, 0\n1, 11, 0, 0, 0, 0.2, 0, 0\n")
    assert read_wnd(wnd).speed.tolist() == [10.0, 11.0]


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("5.0 12.0 oops 0 0 0 0 0", r"gust\.wnd:4: expected numbers, found '5\.0 12\.0 oops 0 0 0 0 0'"),
        ("5.0 12.0 0 0 0 0 0", r"gust\.wnd:4: expected 8 or 9 numbers, found 7"),
    ],
)
def test_a_line_that_cannot_be_read_is_named(wnd: Path, line: str, message: str) -> None:
    wnd.write_text("\n".join([*WND.splitlines()[:3], line]))
    with pytest.raises(InputError, match=message):
        read_wnd(wnd)


@pytest.mark.parametrize("text", ["", "! nothing\n", "\n\n", "words only\n"])
def test_a_file_without_rows_is_refused(wnd: Path, text: str) -> None:
    wnd.write_text(text)
    with pytest.raises(InputError, match=r"gust\.wnd: no rows of wind"):
        read_wnd(wnd)


@pytest.mark.parametrize(
    ("line", "message"), [("0.0 12 0 0 0 0 0 0", "time must increase"), ("9.0 nan 0 0 0 0 0 0", "finite number")]
)
def test_rows_that_make_no_series_are_explained(wnd: Path, line: str, message: str) -> None:
    wnd.write_text("\n".join([*WND.splitlines()[:3], line]))
    with pytest.raises(InputError, match=message):
        read_wnd(wnd)


def test_broken_encodings_do_not_stop_a_header(wnd: Path) -> None:
    wnd.write_bytes("! wind aus der Datei für die Böe\n".encode("latin-1") + b"0 10 0 0 0 0 0 0\n")
    assert read_wnd(wnd).speed.tolist() == [10.0]
