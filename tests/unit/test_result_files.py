"""Results in files: OpenFAST's formats by their definition, round trips, precision, damaged files."""

from __future__ import annotations

import re
import struct
import warnings
from pathlib import Path

import numpy as np
import openfast_files as openfast
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import meltemi
from meltemi import InputError, Result
from meltemi.postprocess.files.openfast import UNITS, Columns, result_of, si_unit
from meltemi.postprocess.files.outb import packed
from meltemi.simulation.channels import Channel, catalogue, find, standard

TIME = np.arange(0.0, 20.01, 0.05)
NAMES = ("RotSpeed", "PtchPMzc1", "-RootMyc1", "mTwrBsMyt", "RtFldFxh", "B1N3Alpha", "Spn1MLyb1", "QD_TFA1", "Odd")
UNITS_OF_NAMES = ("rpm", "deg", "kN-m", "kN-m", "N", "deg", "kN-m", "m/s", "furlong")
DATA = np.stack([(i + 1.0) * np.sin((0.3 + 0.1 * i) * TIME) + i for i in range(len(NAMES))], axis=1)
DEG = np.pi / 180.0
READ = {  # name in the result, column, factor
    "rotor_speed": (0, np.pi / 30.0),
    "pitch_1": (1, DEG),
    "root_moment_out_of_plane_1": (2, -1e3),
    "tower_base_moment_fore_aft": (3, -1e3),
    "rotor_aero_thrust": (4, 1.0),
    "B1N3Alpha": (5, DEG),
    "Spn1MLyb1": (6, 1e3),
    "QD_TFA1": (7, 1.0),
    "Odd": (8, 1.0),
}


def check(result: Result, tolerance: float, data: NDArray[np.float64] = DATA) -> None:
    assert result.names == list(READ)
    np.testing.assert_allclose(result.time, TIME, atol=1e-6)
    for name, (i, factor) in READ.items():
        expected = data[:, i] * factor
        assert np.max(np.abs(result[name] - expected)) <= tolerance * np.ptp(expected), name


@pytest.mark.parametrize("kind", [1, 2, 3, 4])
def test_the_four_kinds_of_binary_output(tmp_path: Path, kind: int) -> None:
    path = openfast.outb(tmp_path / "a.outb", NAMES, UNITS_OF_NAMES, TIME, DATA, kind=kind)
    result = meltemi.read_result(path)
    check(result, 0.0 if kind == 3 else 1.01 / 131070)
    assert result.meta["description"] == "OpenFAST-v5.0.0"
    assert [c.unit for c in result.channels] == ["rad/s", "rad", "N m", "N m", "N", "rad", "N m", "m/s", "furlong"]


def test_text_output(tmp_path: Path) -> None:
    result = meltemi.read_result(openfast.out(tmp_path / "a.out", NAMES, UNITS_OF_NAMES, TIME, DATA))
    check(result, 1e-4)
    assert result.meta["description"] == "a test"


def test_the_content_decides_and_not_the_name(tmp_path: Path) -> None:
    check(meltemi.read_result(openfast.outb(tmp_path / "a.out", NAMES, UNITS_OF_NAMES, TIME, DATA)), 1e-5)
    check(meltemi.read_result(openfast.out(tmp_path / "a.outb", NAMES, UNITS_OF_NAMES, TIME, DATA)), 1e-4)


def test_text_times_with_few_digits_are_even_again(tmp_path: Path) -> None:
    time = 0.00625 * np.arange(200)  # four digits: 0.0063, 0.0125, 0.0188
    result = meltemi.read_result(openfast.out(tmp_path / "a.out", ["GenPwr"], ["kW"], time, np.ones((200, 1))))
    np.testing.assert_allclose(np.diff(result.time), 0.00625, rtol=1e-3)
    assert np.ptp(np.diff(result.time)) < 1e-12


def test_what_fortran_writes_in_place_of_numbers(tmp_path: Path) -> None:
    path = openfast.out(tmp_path / "a.out", ["GenPwr", "Odd"], ["kW", "-"], TIME, np.ones((len(TIME), 2)))
    lines = path.read_text().splitlines()
    lines[10] = "    0.1000\t**********\tNaN"
    path.write_text("\n".join(lines))
    result = meltemi.read_result(path)
    assert np.isnan(result.data[2]).all()
    assert np.isfinite(np.delete(result.data, 2, axis=0)).all()


def test_channels_that_openfast_could_not_compute_are_left_out_and_named(tmp_path: Path) -> None:
    path = openfast.outb(tmp_path / "a.outb", ["GenPwr", "TwHt9MLxt"], ["kW", "INVALID"], TIME, DATA[:, :2])
    result = meltemi.read_result(path)
    assert result.names == ["generator_power"]
    assert result.warnings == ("left out, since OpenFAST could not compute them: TwHt9MLxt",)


def test_two_names_of_one_channel_and_a_unit_that_does_not_fit() -> None:
    names = ("TipDxc1", "OoPDefl1", "RotSpeed", "GenTq", "GenTq")
    table = Columns(names, ("m", "m", "furlong", "kN-m", "kN-m"), TIME, DATA[:, :5])
    result = result_of(table, Path("a.out"))
    assert result.names == ["tip_out_of_plane_1", "OoPDefl1", "RotSpeed", "generator_torque", "GenTq"]
    np.testing.assert_array_equal(result["OoPDefl1"], DATA[:, 1])
    assert result.channel("RotSpeed").unit == "furlong"


@pytest.mark.parametrize("sign", ["-", "_", "m", "M"])
def test_a_sign_before_the_name_is_undone(sign: str) -> None:
    result = result_of(Columns((f"{sign}GenTq",), ("kN-m",), TIME, DATA[:, :1]), Path("a.out"))
    np.testing.assert_array_equal(result["generator_torque"], -1e3 * DATA[:, 0])


@pytest.mark.parametrize(
    ("text", "si"),
    [
        ("(kN-m)", ("N m", 1e3)),
        ("(kN·m)", ("N m", 1e3)),
        ("(kN m)", ("N m", 1e3)),
        ("N*m", ("N m", 1.0)),
        ("(deg/sec)", ("rad/s", DEG)),
        ("(m/s/s)", ("m/s^2", 1.0)),
        ("(deg/s^2)", ("rad/s^2", DEG)),
        ("(rpm)", ("rad/s", np.pi / 30.0)),
        ("(sec)", ("s", 1.0)),
        ("()", ("-", 1.0)),
        ("(furlong)", ("furlong", 1.0)),
    ],
)
def test_units_of_openfast(text: str, si: tuple[str, float]) -> None:
    assert si_unit(text) == (si[0], pytest.approx(si[1], rel=1e-15))


def test_units_lead_to_those_of_the_catalogue() -> None:
    known = {unit for unit, _ in UNITS.values()}
    assert {c.unit for c in catalogue(3, 1, 1, 1, flaps=1).values()} <= known


# our own files


def everything(n_channels: int | None = None) -> Result:
    """All channels of a turbine with coordinates, each with numbers of its own size."""
    every = catalogue(3, 20, 2, 3, ["blade 1 1st flap", "1st fore-aft", "generator", "blade 2 1st torsion"], 2)
    channels = [c for c in every.values() if c.name != "time"][:n_channels]
    rng = np.random.default_rng(1)
    size = 10.0 ** rng.uniform(-6, 8, len(channels))
    data = size * (rng.normal(0.0, 3.0, len(channels)) + rng.uniform(-1.0, 1.0, (len(TIME), len(channels))))
    return Result(TIME, data, tuple(channels), meta={"turbine": "nrel5mw", "wind": "a wind", "version": "0.1.0"})


@pytest.mark.parametrize(("name", "tolerance"), [("a.nc", 0.0), ("a.outb", 1.01 / 131064), ("a.out", 1e-5)])
def test_every_channel_survives_a_file(tmp_path: Path, name: str, tolerance: float) -> None:
    result = everything(100 if name == "a.nc" else None)
    found = meltemi.read_result(meltemi.write_result(result, tmp_path / name))
    assert found.names == result.names
    np.testing.assert_allclose(found.time, result.time, atol=1e-9)
    for channel in result.channels:
        assert found.channel(channel.name).unit == channel.unit
        error = np.max(np.abs(found[channel.name] - result[channel.name]))
        assert error <= tolerance * np.ptp(result[channel.name]), channel.name


def test_netcdf_keeps_all_names_of_a_channel(tmp_path: Path) -> None:
    result = meltemi.read_result(meltemi.write_result(everything(40), tmp_path / "a.nc"))
    assert result.channels == everything(40).channels
    assert "LSShftMxa" in result


def test_a_file_of_openfast_that_is_written_again_keeps_its_own_nodes(tmp_path: Path) -> None:
    path = openfast.outb(tmp_path / "a.outb", NAMES, UNITS_OF_NAMES, TIME, DATA)
    again = meltemi.read_result(meltemi.write_result(meltemi.read_result(path), tmp_path / "b.outb"))
    check(again, 3e-5)


def test_the_bytes_of_a_file(tmp_path: Path) -> None:
    """Kind 2, as the format is defined, number by number."""
    channels = (standard()["generator_power"], standard()["nacelle_yaw"])
    data = np.array([[1e6, 0.1], [2e6, 0.1], [4e6, 0.1]])
    result = Result(np.array([1.0, 1.5, 2.0]), data, channels, meta={"turbine": "T", "wind": "W", "version": "0"})
    content = meltemi.write_result(result, tmp_path / "a.outb").read_bytes()
    assert struct.unpack_from("<hiidd", content) == (2, 2, 3, 1.0, 0.5)
    scale, offset = np.frombuffer(content, "<f4", 4, 26).astype(float).reshape(2, 2)
    assert struct.unpack_from("<i", content, 42) == (24,)
    assert content[46:70] == b"Result of meltemi 0 T: W"
    assert content[70:130] == b"Time      GenPwr    NacYaw    (s)       (kW)      (deg)     "
    numbers = np.frombuffer(content, "<i2", 6, 130).reshape(3, 2)
    assert len(content) == 142
    assert list(numbers[:, 0]) == [-32766, -10922, 32766]
    np.testing.assert_allclose((numbers - offset) / scale, data * [1e-3, 180.0 / np.pi], rtol=2e-5)


def test_long_names_need_the_fourth_kind(tmp_path: Path) -> None:
    result = Result(TIME, DATA[:, :1], (standard()["mean_induction"],))
    content = meltemi.write_result(result, tmp_path / "a.outb").read_bytes()
    assert struct.unpack_from("<hhii", content) == (4, len("mean_induction"), 1, len(TIME))
    assert meltemi.read_result(tmp_path / "a.outb").names == ["mean_induction"]


def test_four_thousand_channels(tmp_path: Path) -> None:
    channels = tuple(Channel(f"channel_{i}", "", "-", "-", "-", "number", ("x", "y")) for i in range(4000))
    data = np.random.default_rng(1).normal(size=(50, 4000))
    found = meltemi.read_result(meltemi.write_result(Result(TIME[:50], data, channels), tmp_path / "a.outb"))
    assert found.names[-1] == "channel_3999"
    assert np.max(np.abs(found.data - data)) < 1e-4


@pytest.mark.parametrize(
    ("low", "high", "bound"),
    [
        (-1.0, 1.0, 2.0 / 131064),
        (0.0, 7e8, 7e8 / 131064),
        (12.0999, 12.1001, 2e-4 / 131064 + 12.1 * 6e-8),  # float32 of the scales counts
        (5e6, 5e6, 5e6 * 6e-8),
        (-1e-3, -1e-3, 1e-3 * 6e-8),
        (0.0, 0.0, 0.0),
        (1e-30, 3e-30, 2e-30 / 131064),
    ],
)
def test_the_precision_of_packing(low: float, high: float, bound: float) -> None:
    data = np.linspace(low, high, 1001)[:, None]
    scale, offset, numbers = packed(data)
    assert np.max(np.abs((numbers.astype(float) - offset) / scale - data)) <= 1.0001 * bound
    if high > low and bound < 1e-4 * (high - low):
        assert np.ptp(numbers.astype(int)) > 65000  # all of the 16 bits


@settings(derandomize=True, deadline=None, max_examples=200)
@given(st.lists(st.floats(-1e36, 1e36) | st.floats(-1.0, 1.0), min_size=1, max_size=20))
def test_packing_never_leaves_its_bound(values: list[float]) -> None:
    data = np.array(values)[:, None]
    scale, offset, numbers = packed(data)
    bound = max(np.ptp(data) / 131064, 6e-8 * np.max(np.abs(data)), 1e-37)
    assert np.max(np.abs((numbers.astype(float) - offset) / scale - data)) <= 1.001 * bound


@pytest.mark.parametrize("name", ["a.outb", "a.out"])
def test_tools_for_openfast_read_what_is_written(tmp_path: Path, name: str) -> None:
    reader = pytest.importorskip("openfast_io.FAST_output_reader")
    result = everything(60)
    path = meltemi.write_result(result, tmp_path / name)
    found = reader.FASTOutputFile(str(path))
    at = found.info["attribute_names"].index("RootMyc1")
    assert found.info["attribute_names"][0] == "Time"
    assert found.info["attribute_units"][at] == "kN-m"
    np.testing.assert_allclose(found.data[:, 0], TIME, atol=1e-6)
    expected = result["RootMyc1"] * 1e-3
    np.testing.assert_allclose(found.data[:, at], expected, atol=1e-5 * np.ptp(expected))


def test_a_reference_run_of_openfast_survives(tmp_path: Path, reference: Path) -> None:
    with np.load(reference / "openfast/series/A_turb_vkm20_s1.npz") as z:
        names, units, data = [str(n) for n in z["channels"]], [str(u) for u in z["units"]], z["data"].astype(float)
    path = openfast.outb(tmp_path / "a.outb", names[1:], units[1:], data[:, 0], data[:, 1:])
    result = meltemi.read_result(path)
    assert len(result.names) == 146
    ours = [c for c in result.channels if c.source[0] != "file"]
    assert len(ours) == 64
    assert {find(n, standard()).name for n in names[1:] if n in {c.alias for c in standard().values()}} <= {
        c.name for c in ours
    }
    np.testing.assert_allclose(result["RootMyc1"], 1e3 * data[:, names.index("RootMyc1")], atol=3e2)


# what cannot be


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1e200])
def test_binary_output_has_no_room_for_what_is_no_number(tmp_path: Path, bad: float) -> None:
    result = everything(3)
    result.data[100, 1] = bad
    with pytest.raises(InputError, match=f"{result.names[1]} is not a number below 1e.37 at 5 s.*write .nc"):
        meltemi.write_result(result, tmp_path / "a.outb")
    assert not list(tmp_path.iterdir())
    for name in ("a.out", "a.nc"):
        found = meltemi.read_result(meltemi.write_result(result, tmp_path / name))
        assert np.argwhere(~(np.abs(found.data) < 1e37)).tolist() == [[100, 1]]


def test_uneven_times_are_refused(tmp_path: Path) -> None:
    time = TIME.copy()
    time[5] += 0.01
    with pytest.raises(InputError, match="not evenly spaced"):
        meltemi.write_result(Result(time, DATA[:, :1], (standard()["wind_x"],)), tmp_path / "a.outb")


def test_formats_that_do_not_exist(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a\.outc: did you mean '\.out"):
        meltemi.write_result(everything(2), tmp_path / "a.outc")
    with pytest.raises(InputError, match=r"cannot be written"):
        meltemi.write_result(everything(2), tmp_path / "nowhere/a.outb")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\x07\x00" + bytes(40), "no result"),
        (b"\x02\x00", "cut or damaged"),
        (b"\x02\x00" + struct.pack("<ii", -1, 5) + bytes(40), "it tells of -1 channels"),
        (b"\x02\x00" + struct.pack("<ii", 1, -5) + bytes(68), "a negative number of bytes"),
        (b"\x02\x00" + struct.pack("<ii", 2**31 - 1, 2**31 - 1) + bytes(40), "cut or damaged"),
        (b"\x04\x00\x00\x00" + bytes(40), "names of 0 characters"),
        (b"hello\nworld\n", "no line of names that begins with 'Time'"),
        (b"Time GenPwr\n(s)\n0 1\n", ":2: 2 channels are named, but 1 have a unit"),
        (b"Time GenPwr\n(s) (kW)\n0 1\n1\n", ":4: expected 2 numbers, found 1; the file is cut"),
        (b"Time GenPwr\n(s) (kW)\n0 1\n1 x\n2 3\n", ":4: 'x' is no number"),
        (b"Time GenPwr\n(s) (kW)\n0 1\n0 1\n", "times in it do not increase"),
        (b"\x89HDF\r\n\x1a\n and nothing", "not a result of meltemi"),
    ],
)
def test_files_that_are_none(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "file"
    path.write_bytes(content)
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        meltemi.read_result(path)
    assert str(path) in str(caught.value)


def test_missing_files_and_folders(tmp_path: Path) -> None:
    for path in (tmp_path / "missing.outb", tmp_path):
        with pytest.raises(InputError, match="cannot be read"):
            meltemi.read_result(path)


@pytest.mark.parametrize("kind", [1, 2, 3, 4])
def test_a_file_that_is_cut_or_too_long_anywhere(tmp_path: Path, kind: int) -> None:
    whole = openfast.outb(
        tmp_path / "a.outb", NAMES[:2], UNITS_OF_NAMES[:2], TIME[:4], DATA[:4, :2], kind=kind
    ).read_bytes()
    path = tmp_path / "b.outb"
    for n in range(1, len(whole)):
        path.write_bytes(whole[:n])
        with pytest.raises(InputError, match=r"b\.outb"):
            meltemi.read_result(path)
    path.write_bytes(whole + b"\0")
    with pytest.raises(InputError, match="1 bytes more than its header tells of"):
        meltemi.read_result(path)


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("good")
    for kind in (1, 2, 3, 4):
        openfast.outb(folder / f"{kind}.outb", NAMES[:3], UNITS_OF_NAMES[:3], TIME[:20], DATA[:20, :3], kind=kind)
    openfast.out(folder / "5.out", NAMES[:3], UNITS_OF_NAMES[:3], TIME[:20], DATA[:20, :3])
    return folder


@settings(derandomize=True, deadline=None, max_examples=400)
@given(
    which=st.sampled_from(["1.outb", "2.outb", "3.outb", "4.outb", "5.out"]),
    at=st.floats(0.0, 0.999),
    new=st.binary(min_size=1, max_size=8),
)
def test_damaged_files_are_read_or_explained(good: Path, which: str, at: float, new: bytes) -> None:
    content = bytearray((good / which).read_bytes())
    place = int(at**2 * len(content))  # rather in the header
    content[place : place + len(new)] = new
    path = good / "damaged"
    path.write_bytes(content)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            result = meltemi.read_result(path)
        except InputError as error:
            assert "damaged" in str(error)
        else:
            assert result.data.shape == (len(result.time), len(result.channels))


@settings(derandomize=True, deadline=None, max_examples=200)
@given(st.binary(max_size=200))
def test_anything_else_is_no_result(good: Path, content: bytes) -> None:
    path = good / "anything"
    path.write_bytes(content)
    with pytest.raises(InputError, match="anything"):
        meltemi.read_result(path)
