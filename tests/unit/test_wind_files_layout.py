"""Binary wind files byte by byte: fields with a different number at every point, packed by hand."""

from __future__ import annotations

import struct
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi.core.errors import InputError
from meltemi.turbulence.field import generate_field
from meltemi.turbulence.grid import WindGrid
from meltemi.wind.fields import WindBox
from meltemi.wind.turbulent import TurbulentWind
from meltemi.wind_files import (
    Hawc2Grid,
    read_bladed,
    read_bts,
    read_hawc2,
    write_bladed,
    write_bts,
    write_hawc2,
)
from meltemi.wind_files.hawc2 import divergences

NT, NZ, NY = 4, 2, 3
STEPS = {"dt": 0.5, "dy": 10.0, "dz": 12.0, "bottom": 30.0, "speed": 8.0}


def distinct() -> NDArray[np.float32]:
    """(T, Z, Y, 3) numbers of which no two are equal: plane, row, column and component are digits of each."""
    v = np.empty((NT, NZ, NY, 3), np.float32)
    for t, z, y, c in np.ndindex(*v.shape):
        v[t, z, y, c] = 8.0 * (c == 0) + 0.1 * t + 0.01 * z + 0.001 * y + 1.0 * c - 1.5
    return v


def box(**changes: Any) -> WindBox:
    return replace(WindBox(velocity=distinct(), hub_height=36.0, **STEPS), **changes)


# TurbSim


def test_bytes_of_a_turbsim_file(tmp_path: Path) -> None:
    v = distinct()
    v[..., 0] = 8.0  # a constant component is kept exactly
    v[0, 0, 0, 1:], v[3, 1, 2, 1:] = -1.0, 3.0
    path = tmp_path / "a.bts"
    assert write_bts(box(velocity=v, source="by hand"), path) == [path]
    data = path.read_bytes()
    text = b"Written by meltemi: by hand"
    assert struct.unpack_from("<h4i", data) == (7, NZ, NY, 0, NT)
    assert struct.unpack_from("<6f", data, 18) == (12.0, 10.0, 0.5, 8.0, 36.0, 30.0)
    assert struct.unpack_from("<i", data, 66) == (len(text),) and data[70 : 70 + len(text)] == text
    slope = 65535.0 / 4.0
    scales = struct.unpack_from("<6f", data, 42)
    assert scales == pytest.approx((1.0, -8.0, slope, -32768.0 + slope, slope, -32768.0 + slope))
    counts = []
    for t, z, y in product(range(NT), range(NZ), range(NY)):  # columns first, from right to left; rows upwards
        counts += [0] + [round(slope * (float(v[t, z, y, c]) + 1.0) - 32768.0) for c in (1, 2)]
    stored = np.frombuffer(data, "<i2", offset=70 + len(text))
    assert stored[1] == -32768 and stored[-1] == 32767  # all of the range is used
    np.testing.assert_allclose(stored, counts, atol=1.0)  # a tie of the rounding
    assert np.all(read_bts(path).velocity[..., 0] == 8.0)


def test_turbsim_files_of_periodic_boxes_and_long_names(tmp_path: Path) -> None:
    write_bts(box(periodic=True, hub_height=None, source="ü" * 500), tmp_path / "a.bts")
    data = (tmp_path / "a.bts").read_bytes()
    assert struct.unpack_from("<h", data) == (8,)
    assert struct.unpack_from("<i", data, 66) == (200,) and data[70:270].isascii()
    again = read_bts(tmp_path / "a.bts")
    assert again.periodic and again.hub_height == 36.0  # the middle of the grid, for want of one


@pytest.mark.parametrize("seed", [1, 2])
def test_a_file_of_turbsim_is_written_again(tmp_path: Path, reference: Path, seed: int) -> None:
    original = reference / f"openfast/wind/vkm20_s{seed}.bts"
    first = read_bts(original)
    write_bts(first, tmp_path / "again.bts")
    old, new = original.read_bytes(), (tmp_path / "again.bts").read_bytes()
    assert old[:10] == new[:10] and old[14:42] == new[14:42]  # all but the tower points: bit by bit
    assert struct.unpack_from("<i", old, 10) == (2,) and struct.unpack_from("<i", new, 10) == (0,)
    np.testing.assert_allclose(struct.unpack_from("<6f", new, 42), struct.unpack_from("<6f", old, 42), rtol=0.2)
    slope = np.array(struct.unpack_from("<6f", new, 42))[::2]
    error = np.abs(read_bts(tmp_path / "again.bts").velocity - first.velocity).max(axis=(0, 1, 2))
    assert np.all(error <= 0.51 / slope)


# Bladed


def bladed(kind: int, counts: NDArray[np.int16], *, half: int = NT // 2, **changes: Any) -> bytes:
    """A field with counts in the order of the file (planes, rows, columns, components)."""
    n = counts.shape[3]
    h: dict[str, Any] = {"id": -99, "speed": 8.0, "dx": 4.0, "dy": 10.0, "dz": 12.0, "n": n, "rows": NZ, "ti": 10.0}
    h |= changes
    out = struct.pack("<hh", h["id"], kind)
    if kind == 4:
        out += struct.pack("<i6f", h["n"], 50.0, 0.03, 36.0, h["ti"], 0.8 * h["ti"], 0.5 * h["ti"])
    if kind in (7, 8):
        out += struct.pack("<ii", 100, h["n"])
    out += struct.pack("<fff", h["dz"], h["dy"], h["dx"])
    out += struct.pack("<i", half) + struct.pack("<f", h["speed"]) + struct.pack("<fff", 1.0, 2.0, 3.0)
    out += struct.pack("<iiii", 0, 1234, h["rows"], counts.shape[2])
    if n == 3:
        out += struct.pack("<6f", *range(6))
    if kind == 7:
        out += struct.pack("<ff", 12.0, 340.0)
    if kind == 8:
        out += bytes(64)
    return out + counts.astype("<i2").tobytes()


def summary(*extra: str, clockwise: str = "F", ubar: float = 8.0) -> str:
    return "\n".join(
        [
            "",
            "This summary file was generated by TurbSim (v2.00) on 1-Jan-2020.",
            f"   {clockwise}        Clockwise rotation when looking downwind?",
            "    40.000  Hub height [m]",
            "    12.000  Grid height [m]",
            f"   UBar  = {ubar:8.4f} m/s",
            "   TI(u) =  10.0000 %",
            "   TI(v) =   8.0000 %",
            "   TI(w) =   5.0000 %",
            "",
            "   Height Offset =   4.0000 m",
            "   Grid Base     =  30.0000 m",
            *extra,
        ]
    )


def counts(components: int = 3) -> NDArray[np.int16]:
    return np.arange(NT * NZ * NY * components).reshape(NT, NZ, NY, components).astype(np.int16) * 7 - 200


@pytest.mark.parametrize("kind", [3, 4, 5, 7, 8])
def test_a_bladed_field_of_each_type(tmp_path: Path, kind: int) -> None:
    raw = counts()
    (tmp_path / "a.wnd").write_bytes(bladed(kind, raw))
    (tmp_path / "a.sum").write_text(summary())
    field = read_bladed(tmp_path / "a.wnd")
    # a count is a thousandth of the standard deviation: intensity times 8 m/s
    np.testing.assert_allclose(field.velocity, [8.0, 0.0, 0.0] + raw * [0.8e-3, 0.64e-3, 0.4e-3], atol=1e-6)
    assert (field.dt, field.dy, field.dz, field.speed) == (0.5, 10.0, 12.0, 8.0)
    assert (field.hub_height, field.bottom) == (40.0, 30.0)  # hub less the offset less half the height
    assert not field.periodic


def test_intensities_of_the_header_come_before_those_of_the_summary(tmp_path: Path) -> None:
    (tmp_path / "a.sum").write_text(summary())
    for given, expected in {20.0: 1.6e-3, 0.0: 0.8e-3}.items():
        (tmp_path / "a.wnd").write_bytes(bladed(4, counts(), ti=given))
        u = read_bladed(tmp_path / "a.wnd").velocity[..., 0]
        np.testing.assert_allclose(u, 8.0 + expected * counts()[..., 0], atol=1e-6)


def test_words_of_the_summary_turn_columns_and_the_lateral_wind(tmp_path: Path) -> None:
    (tmp_path / "a.wnd").write_bytes(bladed(3, counts()))
    (tmp_path / "a.sum").write_text(summary())
    plain = read_bladed(tmp_path / "a.wnd")
    (tmp_path / "a.sum").write_text(summary(clockwise="T"))
    np.testing.assert_array_equal(read_bladed(tmp_path / "a.wnd").velocity, plain.velocity[:, :, ::-1])
    words = ["Creating a PERIODIC output file.", "Creating a BLADED LEFT-HAND RULE output file."]
    (tmp_path / "a.sum").write_text(summary(*words))
    turned = read_bladed(tmp_path / "a.wnd")
    assert turned.periodic
    np.testing.assert_array_equal(turned.velocity, plain.velocity * [1.0, -1.0, 1.0])


def test_an_odd_number_of_planes_and_one_component(tmp_path: Path) -> None:
    (tmp_path / "a.sum").write_text(summary())
    (tmp_path / "a.wnd").write_bytes(bladed(3, counts(), half=1))
    assert len(read_bladed(tmp_path / "a.wnd").velocity) == 3
    (tmp_path / "a.wnd").write_bytes(bladed(1, counts(1)))
    field = read_bladed(tmp_path / "a.wnd").velocity
    np.testing.assert_allclose(field[..., 0], 8.0 + 0.8e-3 * counts(1)[..., 0], atol=1e-6)
    assert not np.any(field[..., 1:])


def test_bytes_of_a_bladed_file(tmp_path: Path) -> None:
    v = distinct()
    path = tmp_path / "a.wnd"
    assert write_bladed(box(periodic=True), path) == [path, tmp_path / "a.sum"]
    data = path.read_bytes()
    assert struct.unpack_from("<hhi", data) == (-99, 4, 3)
    assert struct.unpack_from("<3f", data, 8) == (0.0, 0.0, 36.0)  # the last is the height of the grid's middle
    percent = struct.unpack_from("<3f", data, 20)
    assert struct.unpack_from("<3f", data, 32) == (12.0, 10.0, 4.0)
    assert struct.unpack_from("<if", data, 44) == (NT // 2, 8.0)
    assert struct.unpack_from("<3f4i6f", data, 52) == (0.0,) * 3 + (0, 0, NZ, NY) + (0.0,) * 6
    stored = np.frombuffer(data, "<i2", offset=104).reshape(NT, NZ, NY, 3)
    scale = 0.001 * 8.0 * np.array(percent) / 100.0 * [1.0, -1.0, 1.0]  # v is positive to the right
    np.testing.assert_allclose([8.0, 0.0, 0.0] + stored * scale, v, atol=0.51 * np.abs(scale).max())
    assert np.abs(stored).max() <= 20_000
    lines = (tmp_path / "a.sum").read_text().splitlines()
    assert "TurbSim" in lines[1]  # where old versions look for it
    wanted = ["Clockwise", "Hub height", "UBar", "TI(u)", "TI(v)", "TI(w)", "Height offset", "PERIODIC", "LEFT-HAND"]
    found = [next(i for i, line in enumerate(lines) if word in line) for word in wanted]
    assert found == sorted(found)  # the order in which InflowWind looks for them
    assert "periodic" not in "".join(lines[: found[-2]]).lower()
    write_bladed(box(), path)
    assert "periodic" not in (tmp_path / "a.sum").read_text().lower()


def test_bladed_files_that_do_not_belong_together(tmp_path: Path) -> None:
    path = tmp_path / "a.wnd"
    path.write_bytes(bladed(3, counts()))
    with pytest.raises(InputError, match=r"a\.wnd: requires a\.sum in the same folder"):
        read_bladed(path)
    (tmp_path / "a.sum").write_text(summary(ubar=9.0))
    with pytest.raises(InputError, match=r"8 m/s, but a\.sum has 9 m/s: the two files do not belong together"):
        read_bladed(path)
    (tmp_path / "a.sum").write_text(summary().replace("TI(v) =   8.0000", "TI(v) ="))
    with pytest.raises(InputError, match=r"a\.sum: no TI\(v\) in it"):
        read_bladed(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"id": -3}, "old Bladed format"),
        ({"id": 7}, "its first number is 7, expected -99"),
        ({"n": 2}, "it has 2 components"),
        ({"rows": -1}, "-1 rows"),
        ({"rows": 10**9}, r"cut off: 248 bytes, expected 720{0,2}"),
        ({"dx": float("nan")}, "not a positive number"),
        ({"speed": 0.0}, "not a positive number"),
        ({"half": 0}, "0 pairs of planes"),
        ({"half": 3}, "cut off"),
    ],
)
def test_headers_of_bladed_files_no_field_can_have(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    (tmp_path / "a.sum").write_text(summary())
    (tmp_path / "a.wnd").write_bytes(bladed(4, counts(), **change))
    with pytest.raises(InputError, match=rf"a\.wnd: .*{message}"):
        read_bladed(tmp_path / "a.wnd")


# HAWC2

GRID = {"planes": 2, "columns": 3, "rows": 4, "dx": 4.0, "dy": 10.0, "dz": 12.0, "speed": 8.0, "hub_height": 60.0}


def hawc2(folder: Path, names: str = "box_{}.bin") -> None:
    """Planes one after the other, in each columns from left to right, in each column rows upwards."""
    for c in range(3):
        values = [100 * c + 50 * x + 10 * y + z for x, y, z in product(range(2), range(3), range(4))]
        (folder / names.format("uvw"[c])).write_bytes(struct.pack("<24f", *values))


NAMES = ["box_{}.bin", "box-{}.bin", "box{}.bin", "{}.bin", "box_4.00_s0001_{}", "box_{}.turb", "box_16x8x8.{}"]


@pytest.mark.parametrize("names", NAMES)
def test_axes_of_a_hawc2_box(tmp_path: Path, names: str) -> None:
    hawc2(tmp_path, names)
    for front in ("last", "first"):
        field = meltemi.read_wind(tmp_path / names.format("v"), Hawc2Grid(**GRID, box_front=front))
        assert isinstance(field, WindBox) and field.velocity.shape == (2, 4, 3, 3)
        for x, y, z, c in product(range(2), range(3), range(4), range(3)):
            column = y if front == "last" else 2 - y  # from the right; two planes have one order
            assert field.velocity[x, z, column, c] == 8.0 * (c == 0) + 100 * c + 50 * x + 10 * y + z
        assert (field.dt, field.dy, field.dz, field.bottom, field.speed) == (0.5, 10.0, 12.0, 42.0, 8.0)
        assert field.periodic and field.hub_height == 60.0


@pytest.mark.parametrize("front", ["last", "first"])
def test_a_point_of_a_hawc2_box_over_time(tmp_path: Path, front: Literal["last", "first"]) -> None:
    """HAWC2: plane 0 is at the tower at time 0, then the last, column 0 on the right; InflowWind: 0, 1, on the left."""
    from meltemi.maths.vectors import Vec
    from meltemi.wind.fields import wind_field
    from meltemi.wind.velocity import wind_velocity

    for c in range(3):  # u: 50 a plane, 10 a column, 1 a row
        values = [0.1 * (50 * x + 10 * y + z) * (c == 0) for x, y, z in product(range(4), range(3), range(4))]
        (tmp_path / f"box_{'uvw'[c]}.bin").write_bytes(struct.pack("<48f", *values))
    field = read_hawc2(tmp_path / "box_u.bin", Hawc2Grid(**(GRID | {"planes": 4, "box_front": front})))
    kernel_wind = wind_field(field, 60.0, 20.0)
    played = [0, 3, 2, 1, 0] if front == "last" else [0, 1, 2, 3, 0]
    for k, plane in enumerate(played):
        for y, z in product((-10.0, 0.0, 10.0), (42.0, 78.0)):
            column = 1 + round(y / 10.0) * (1 if front == "last" else -1)
            u = wind_velocity(Vec(0.0, y, z), 0.5 * k, kernel_wind).x
            assert u == pytest.approx(8.0 + 0.1 * (50 * plane + 10 * column + (z - 42.0) / 12.0), abs=1e-4)


def test_hawc2_plays_its_box_as_it_is_read_here(reference: Path) -> None:
    """Free wind of HAWC2 13.0.4 at a corner of the box of h2lib-tests, whose plane 0 begins 2 m downwind."""
    folder = Path(str(pytest.importorskip("h2lib_tests").__path__[0])) / "test_files/minimal/turb"
    time, u, v, w = np.loadtxt(reference / "hawc2/mann_corner_hawc2.csv", delimiter=",", skiprows=1).T
    grid = Hawc2Grid(planes=512, columns=32, rows=16, dx=2, dy=3, dz=4, speed=5, bottom=1, profile="none")
    field = read_hawc2(next(folder.glob("*_s0001_u")), grid)
    corner = np.column_stack([np.interp(time + 0.4, field.passing, x) for x in field.velocity[:, 0, 0].T])
    np.testing.assert_allclose(corner, np.column_stack([u, v, w]), atol=1e-6)
    here, turned = divergences(field)
    assert turned > 5.0 * here


@pytest.mark.parametrize("front", ["last", "first"])
def test_the_divergence_tells_the_order_of_a_box(tmp_path: Path, front: Literal["last", "first"]) -> None:
    """A field whose divergence vanishes: the curl of a smooth random potential that fades across."""
    rng = np.random.default_rng(1)
    shape = (64, 16, 16)
    k = np.meshgrid(*(2.0 * np.pi * np.fft.fftfreq(n) for n in shape), indexing="ij")
    smooth = np.exp(-4.0 * (k[0] ** 2 + k[1] ** 2 + k[2] ** 2))
    a = [np.fft.fftn(rng.normal(size=shape)) * smooth for _ in range(3)]
    curl = [k[(i + 1) % 3] * a[(i + 2) % 3] - k[(i + 2) % 3] * a[(i + 1) % 3] for i in range(3)]
    u, v, w = (np.fft.ifftn(1j * c).real for c in curl)  # over x, y, z: downwind, to the left, up
    played = np.stack([u, v, w], axis=-1).transpose(0, 2, 1, 3)[-np.arange(64) % 64]  # what is downwind passes first
    steps = {"dt": 1.0, "dy": 8.0, "dz": 8.0, "bottom": 20.0, "speed": 8.0, "periodic": True}
    field = WindBox(velocity=(100.0 * played + [8.0, 0.0, 0.0]).astype(np.float32), **steps)
    here, turned = divergences(field)
    assert here < 1e-2 * turned  # central differences
    write_hawc2(field, tmp_path / "a.bin", front)
    raw = [np.fromfile(tmp_path / f"a-{c}.bin", "<f4").reshape(64, 16, 16) for c in "uvw"]
    signs = (1.0, 1.0, 1.0) if front == "last" else (-1.0, -1.0, 1.0)  # of the file's axes
    slopes = [s * np.gradient(x, axis=i)[2:-2, 2:-2, 2:-2] for i, (s, x) in enumerate(zip(signs, raw, strict=True))]
    assert np.var(sum(slopes)) < 1e-2 * sum(np.var(x) for x in slopes)
    np.testing.assert_allclose(read_hawc2(tmp_path / "a-u.bin").velocity, field.velocity, atol=1e-5)
    note = (tmp_path / "a.hawc2.yaml").read_text()
    other = "first" if front == "last" else "last"
    (tmp_path / "a.hawc2.yaml").write_text(note.replace(f"box_front: {front}", f"box_front: {other}"))
    with pytest.warns(UserWarning, match=f"a-u.bin: read with box_front: {other}, .* with box_front: {front}"):
        read_hawc2(tmp_path / "a-u.bin")


def test_turbulence_of_mann_passes_with_its_lee_first(tmp_path: Path) -> None:
    """The generator's field is freer of divergence than when turned, and so is what HAWC2 plays of its file; Kaimal's
    components are independent, and no order is better."""
    grid = WindGrid(points_y=12, points_z=12, dy=3.0, dz=3.0, bottom=73.5, hub_height=90.0)
    settings: dict[str, Any] = {"speed": 8.0, "intensity": 0.1, "coherent": "all", "dt": 0.25, "periodic": True}
    made = {name: generate_field(TurbulentWind(spectrum=name, **settings), grid, 100.0) for name in ("mann", "kaimal")}
    here, turned = divergences(made["mann"])
    assert turned > 2.0 * here
    assert divergences(made["kaimal"])[0] == pytest.approx(divergences(made["kaimal"])[1], rel=0.05)
    raw = [np.fromfile(path, "<f4").reshape(400, 12, 12) for path in write_hawc2(made["mann"], tmp_path / "a.bin")[:3]]
    x, y, z = (np.gradient(c, step, axis=i) for i, (c, step) in enumerate(zip(raw, (2.0, 3.0, 3.0), strict=True)))
    assert np.var(z - x - y) > 2.0 * np.var(x + y + z)  # axes of HAWC2's box: downwind, to the left, up


@pytest.mark.parametrize(
    ("change", "means"),
    [
        ({"shear_exponent": 0.2}, 8.0 * (np.array([42.0, 54.0, 66.0, 78.0]) / 60.0) ** 0.2),
        ({"profile": "none"}, np.zeros(4)),
        ({"mean_u": [1.0, 2.0, 3.0, 4.0]}, np.array([1.0, 2.0, 3.0, 4.0])),
        ({"bottom": 30.0, "hub_height": None}, np.full(4, 8.0)),
    ],
)
def test_the_mean_wind_of_a_hawc2_box(tmp_path: Path, change: dict[str, Any], means: NDArray[np.float64]) -> None:
    hawc2(tmp_path)
    field = read_hawc2(tmp_path / "box_u.bin", Hawc2Grid(**(GRID | change)))
    np.testing.assert_allclose(field.velocity[0, :, 0, 0], means + np.arange(4), rtol=1e-6)
    assert field.bottom == change.get("bottom", 42.0)


def test_bytes_of_a_hawc2_box(tmp_path: Path) -> None:
    v = distinct()
    paths = write_hawc2(box(), tmp_path / "a.bin")
    assert [p.name for p in paths] == ["a-u.bin", "a-v.bin", "a-w.bin", "a.hawc2.yaml"]
    means = v.mean(axis=(0, 2), dtype=float)
    orders = {"last": ((0, 3, 2, 1), (0, 1, 2)), "first": ((0, 1, 2, 3), (2, 1, 0))}  # of planes and columns
    for front, (planes, columns) in orders.items():
        write_hawc2(box(), tmp_path / "a.bin", front)  # type: ignore[arg-type]
        for c in range(3):
            expected = [v[t, z, y, c] - means[z, c] for t, y, z in product(planes, columns, range(NZ))]
            np.testing.assert_allclose(np.frombuffer(paths[c].read_bytes(), "<f4"), expected, atol=1e-7)
        assert f"box_front: {front}" in paths[3].read_text()
    assert "planes: 4" in paths[3].read_text()


def test_names_of_hawc2_files(tmp_path: Path) -> None:
    names = {"menu.bin": "menu-u.bin", "a_w.bin": "a_u.bin", "A-U.bin": "A-U.bin", "u.bin": "u.bin"}
    for name, first in names.items():
        assert write_hawc2(box(), tmp_path / name)[0].name == first
    with pytest.raises(InputError, match=r"field\.dat: expected the name of a file of HAWC2, such as field-u\.bin"):
        write_hawc2(box(), tmp_path / "field.dat")


def test_hawc2_files_that_do_not_fit_their_grid(tmp_path: Path) -> None:
    hawc2(tmp_path)
    with pytest.raises(
        InputError, match=r"box\.hawc2\.yaml is missing in their folder: specify grid=meltemi\.io\.Hawc2Grid"
    ):
        read_hawc2(tmp_path / "box_u.bin")
    with pytest.raises(InputError, match=r"box_u\.bin: 96 bytes, expected 144 for 3 planes of 3 columns and 4 rows"):
        read_hawc2(tmp_path / "box_u.bin", Hawc2Grid(**(GRID | {"planes": 3})))
    (tmp_path / "box_w.bin").unlink()
    with pytest.raises(InputError, match=r"box_w\.bin: cannot be read"):
        read_hawc2(tmp_path / "box_u.bin", Hawc2Grid(**GRID))
    write_hawc2(box(), tmp_path / "old.bin")
    note = (tmp_path / "old.hawc2.yaml").read_text()
    (tmp_path / "old.hawc2.yaml").write_text(note.replace("box_front: last\n", ""))
    with pytest.raises(InputError, match=r"old\.hawc2\.yaml: box_front is missing: add 'box_front: last' for .* HAWC2"):
        read_hawc2(tmp_path / "old-u.bin")
    (tmp_path / "box.hawc2.yaml").write_text("planes: 2\ncolums: 3\n")
    with pytest.raises(InputError, match=r"box\.hawc2\.yaml:2: colums: unknown key; did you mean 'columns'"):
        read_hawc2(tmp_path / "box_u.bin")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"hub_height": None}, "hub_height or bottom"),
        ({"hub_height": None, "bottom": 5.0, "shear_exponent": 0.2}, "power law needs the hub_height"),
        ({"mean_v": [1.0, 2.0]}, "mean_v must have 4 entries"),
        ({"hub_height": 10.0}, "below the ground"),
    ],
)
def test_grids_no_hawc2_box_can_have(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Hawc2Grid(**(GRID | change))
