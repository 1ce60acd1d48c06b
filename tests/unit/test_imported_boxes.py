"""Wind of imported models: turbulence boxes in the order of their program; what is said to be used is used."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi.cases.case import FileCase, LoadCase, case_wind
from meltemi.core.yamlfile import validated
from meltemi.exchange.hawc2.htc import Treatment, notes_on, read_htc
from meltemi.exchange.hawc2.wind import read_wind
from meltemi.exchange.openfast.text import read_input
from meltemi.exchange.openfast.wind import read_inflow
from meltemi.exchange.report import Notes
from meltemi.wind.fields import WindBox

Imported = tuple[dict[str, Any] | None, Notes]
SHAPE = (8, 4, 3)
"""Planes, columns, rows."""

HTC = """begin wind;
wsp 9;
center_pos0 0 0 -90;
shear_format 3 0.2;
turb_format 1;
begin mann;
filename_u turb/a_s1_u;
filename_v turb/a_s1_v;
filename_w turb/a_s1_w;
box_dim_u 8 4.5;
box_dim_v 4 30;
box_dim_w 3 40;
dont_scale 1;
end mann;
end wind;
exit;
"""
INFLOW = """------- InflowWind v3.01.* INPUT FILE ---
test
---------------------------------------------
False Echo
5 WindType
0 PropagationDir
0 VFlowAng
12 HWindSpeed
90 RefHt
0 PLexp
"unused" Filename_Uni
90 RefHt_Uni
126 RefLength
"unused" FileName_BTS
"unused" FilenameRoot
"turb/a_s1_u" FileName_u
"turb/a_s1_v" FileName_v
"turb/a_s1_w" FileName_w
8 nx
4 ny
3 nz
4.5 dx
30 dy
40 dz
90 RefHt_Hawc
0 ScaleMethod
1 SFx
1 SFy
1 SFz
9 URef
2 WindProfile
0.2 PLExp_Hawc
0.03 Z0
0 XOffset
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """With two boxes of noise."""
    (tmp_path / "turb").mkdir()
    rng = np.random.default_rng(1)
    for name in ("a", "b"):
        for c in "uvw":
            (tmp_path / f"turb/{name}_s1_{c}").write_bytes(rng.normal(size=SHAPE).astype("<f4").tobytes())
    return tmp_path


def of_hawc2(folder: Path, text: str) -> Imported:
    path = folder / "model.htc"
    path.write_text(text)
    root, treatment = read_htc(path), Treatment()
    notes = Notes()
    wind = read_wind(root.find("wind"), path, 0.0, treatment, notes)
    return wind, [*notes_on(root, treatment), *notes]


def of_inflow(folder: Path, text: str) -> Imported:
    path = folder / "InflowWind.dat"
    path.write_text(text)
    notes = Notes()
    return read_inflow(read_input(path, "InflowWind"), 90.0, notes), notes


def played(wind: dict[str, Any] | None, folder: Path) -> WindBox:
    """The box of a case with this wind."""
    case = validated({"turbine": "nrel5mw", "wind": wind, "duration": 1.0}, LoadCase, "test")
    assert isinstance(case.wind, FileCase)
    box = case_wind(case, meltemi.load_turbine("nrel5mw"), folder)
    assert isinstance(box, WindBox)
    return box


@pytest.mark.parametrize(("read", "text"), [(of_hawc2, HTC), (of_inflow, INFLOW)])
def test_a_box_is_played_as_its_program_plays_it(read: Callable[..., Imported], text: str, folder: Path) -> None:
    wind, _ = read(folder, text)
    box = played(wind, folder)
    mean = 9.0 * (np.array([50.0, 90.0, 130.0]) / 90.0) ** 0.2
    u = np.fromfile(folder / "turb/a_s1_u", "<f4").reshape(SHAPE) + mean
    order = -np.arange(8) % 8 if read is of_hawc2 else np.arange(8)
    columns = slice(None) if read is of_hawc2 else slice(None, None, -1)
    np.testing.assert_allclose(box.velocity[..., 0], u[order][:, columns].transpose(0, 2, 1), rtol=1e-6)
    assert (box.dt, box.dy, box.dz, box.bottom, box.speed) == (0.5, 30.0, 40.0, 50.0, 9.0)
    assert box.periodic and box.lead == 0.0


def other(line: str) -> list[str]:
    """The line with another value: each number raised by a tenth, or a whole one by one, and files of the other box."""
    if "a_s1" in line:
        return [line.replace("a_s1", "b_s1")]
    words = line.rstrip(";").split()
    places = [i for i, word in enumerate(words) if word.lstrip("-").replace(".", "").isdigit()]
    changed = []
    for i in places:
        x = float(words[i])
        new = f"{x + 1:g}" if x == int(x) and "." not in words[i] else f"{1.1 * x + 0.01:g}"
        changed.append(" ".join([*words[:i], new, *words[i + 1 :]]) + (";" if line.endswith(";") else ""))
    return changed


STEADY = HTC.replace("turb_format 1", "turb_format 0")
VARIANTS = [
    (of_hawc2, HTC),
    (of_hawc2, STEADY),
    (of_hawc2, STEADY.replace("format 3 0.2", "format 2 0.03")),
    (of_hawc2, HTC.replace("format 3 0.2", "format 2 0.03")),
    (of_inflow, INFLOW),
    (of_inflow, INFLOW.replace("2 WindProfile", "1 WindProfile")),
    (of_inflow, INFLOW.replace("5 WindType", "1 WindType")),
    (of_inflow, INFLOW.replace("5 WindType", "1 WindType").replace("0 PLexp", "0.2 PLexp")),
    (
        of_inflow,
        INFLOW.replace("5 WindType", "2 WindType").replace('"unused" Filename_Uni', '"turb/a_s1_u" Filename_Uni'),
    ),
    (
        of_inflow,
        INFLOW.replace("5 WindType", "3 WindType").replace('"unused" FileName_BTS', '"turb/a_s1_u" FileName_BTS'),
    ),
]


@pytest.mark.parametrize(("read", "text"), VARIANTS)
def test_what_is_used_changes_the_wind(read: Callable[..., Imported], text: str, folder: Path) -> None:
    """Each value that the report calls used, changed alone: another wind, or a refusal. The rest changes nothing."""
    before, notes = read(folder, text)
    lines = text.splitlines()
    tried = set()
    for note in notes:
        number = int(note.where.rsplit(":", 1)[1]) - 1
        if note.kind == "ignored" or number in tried:
            continue
        tried.add(number)
        line = lines[number]
        if "a_s1" in line and note.kind == "used":  # the three files of a box have one name
            changed = [text.replace("a_s1", "b_s1")]
        else:
            changed = ["\n".join([*lines[:number], new, *lines[number + 1 :]]) + "\n" for new in other(line)]
        winds = []
        for one in changed:
            try:
                winds.append(read(folder, one)[0])
            except meltemi.InputError:
                winds.append({"refused": one})
        if note.kind == "used":
            assert all(wind != before for wind in winds[-1:]), line
        elif note.kind == "not needed":
            assert all(wind == before for wind in winds), line
    assert len(tried) > 3


@pytest.mark.parametrize(
    ("read", "text", "words"),
    [
        (of_hawc2, HTC.replace("dont_scale 1", "dont_scale 0"), "scales its box to tint unless dont_scale is 1"),
        (of_hawc2, HTC.replace("dont_scale 1", "dont_scale 1;\nfactor_scaling 1 2 3"), "factor_scaling is not read"),
        (of_hawc2, HTC.replace("turb/a_s1_w", "turb/none_w"), "turb/none_w does not exist"),
        (of_hawc2, HTC.replace("turb/a_s1_w", "turb/b_s1_w"), r"must differ in u, v, w only"),
        (of_hawc2, STEADY.replace("format 3 0.2", "format 4 0.01"), "only 0 to 3 are read"),
        (of_inflow, INFLOW.replace("0 ScaleMethod", "2 ScaleMethod"), "boxes are not scaled"),
        (of_inflow, INFLOW.replace("0 ScaleMethod", "1 ScaleMethod").replace("1 SFy", "2 SFy"), "boxes are not scaled"),
        (of_inflow, INFLOW.replace("turb/a_s1_w", "turb/none_w"), "the file does not exist"),
        (of_inflow, INFLOW.replace("0 VFlowAng", "5 VFlowAng"), "only a steady wind can have an upflow"),
    ],
)
def test_what_is_not_read_of_a_wind_is_said(read: Callable[..., Imported], text: str, words: str, folder: Path) -> None:
    wind, notes = read(folder, text)
    assert any(note.kind == "ignored" and words in note.why for note in notes)
    assert wind is None or wind["kind"] == ("file" if "5 VFlowAng" in text else "steady")


def test_a_mean_wind_that_a_box_does_not_have(folder: Path) -> None:
    assert of_hawc2(folder, STEADY.replace("format 3 0.2", "format 0 0"))[0] == {"kind": "steady", "speed": 0.0}
    wind, _ = of_hawc2(folder, HTC.replace("format 3 0.2", "format 0 0"))
    u = np.fromfile(folder / "turb/a_s1_u", "<f4").reshape(SHAPE)
    np.testing.assert_allclose(played(wind, folder).velocity[0, :, :, 0], u[0].T, rtol=1e-6)
    wind, _ = of_inflow(folder, INFLOW.replace("0 PropagationDir", "10 PropagationDir"))
    assert played(wind, folder).direction == pytest.approx(np.radians(10.0))
    with pytest.raises(meltemi.InputError, match="WindType is 5, but the box has no planes, speed"):
        of_inflow(folder, INFLOW.replace("8 nx\n", "").replace("9 URef\n", ""))
