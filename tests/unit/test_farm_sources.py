"""Layouts of FAST.Farm, windIO and FLORIS files."""

from __future__ import annotations

from pathlib import Path

import pytest

from meltemi.farm.sources import read_layout

D = 126.0
HEAD = """\
------- FAST.Farm for OpenFAST INPUT FILE ---
two turbines
--- SIMULATION CONTROL ---
2        Mod_AmbWind  - one InflowWind module
{control}--- AMBIENT WIND ---
3.0      DT_Low       - (s)
17       NZ_Low       -
10.0     Z0_Low       -
15.0     dZ_Low       -
--- WIND TURBINES ---
2        NumTurbines  -
WT_X WT_Y WT_Z WT_FASTInFile X0_High
(m) (m) (m) (string) (m)
0.0    -15.0 0.0 "a.fst" -31.0
378.0   15.0 0.0 "b.fst" -31.0
--- WAKE DYNAMICS ---
"""
VERSIONS = {
    4: HEAD.format(control="False UseSC -\n")
    + """\
6.0      dr           - (m)
40       NumRadii     -
140      NumPlanes    -
0.2      f_c          - (Hz)
DEFAULT  C_NearWake   -
0.05     k_vAmb       -
0.0      C_vAmb_DMin  -
0.02     k_vShr       -
4.0      C_vShr_DMin  -
""",
    5: HEAD.format(control="")
    + """\
1        Mod_Wake     - polar
126.0    RotorDiamRef - (m)
6.0      dr           - (m)
40       NumRadii     -
15       NumDFull     -
0.2      f_c          - (Hz)
1.8      C_NearWake   -
DEFAULT  k_vAmb       -
0.02, 0.2, 4.0, 25.0, 0.1  k_vShr -
1        WAT          -
""",
}


@pytest.mark.parametrize("version", VERSIONS)
def test_primary_files_of_fast_farm(version: int, tmp_path: Path) -> None:
    path = tmp_path / "farm.fstf"
    path.write_text(VERSIONS[version])
    found = read_layout(path, D)
    assert found.positions == ((0.0, -15.0), (378.0, 15.0))
    expected = {"model": "fast.farm", "step": 3.0, "cut_off": 12.6, "radial_points": 21, "ceiling": 250.0}
    assert found.wakes == pytest.approx(expected | {"added_turbulence": version == 5})
    notes = "\n".join(found.notes)
    assert "k_vShr 0.02" in notes and "0.016 0.2 3 25 0.1" in notes
    assert ("C_vShr_DMin 4 is not taken" in notes) == (version == 4)
    assert "k_vAmb" not in notes and "C_NearWake" not in notes


def test_curled_wakes_of_fast_farm(tmp_path: Path) -> None:
    path, text = tmp_path / "farm.fstf", VERSIONS[5].replace("1        Mod_Wake ", "2        Mod_Wake ")
    path.write_text(text + "True Swirl -\n0.1 sigma_D -\nDEFAULT k_vCurl -\n0 C_HWkDfl_xY -\n")
    found = read_layout(path, D)
    assert found.wakes["model"] == "curled"
    notes = "\n".join(found.notes)
    assert "sigma_D 0.1 is not taken: the set curled has 0.2" in notes
    assert "k_vCurl" not in notes and "C_HWkDfl_xY" not in notes
    path.write_text(text.replace("2        Mod_Wake ", "3        Mod_Wake "))
    assert read_layout(path, D).wakes["model"] == "fast.farm"
    assert any("Mod_Wake 3" in note for note in read_layout(path, D).notes)


PLANT = "name: a\nlayouts:\n  - coordinates: {x: [0, 650.5], y: [0, 10]}\nturbines: !include turbine.yaml\n"
FLORIS = "farm: {layout_x: [0.0, 630.0], layout_y: [0.0, 0.0], turbine_type: [nrel_5MW]}\nwake: {}\n"


def test_layouts_of_windio_and_floris(tmp_path: Path) -> None:
    (tmp_path / "plant.yaml").write_text(PLANT)
    (tmp_path / "system.yaml").write_text("site: !include site.yaml\nwind_farm: !include plant.yaml\n")
    (tmp_path / "floris.yaml").write_text(FLORIS)
    (tmp_path / "far.yaml").write_text(FLORIS.replace("[0.0, 630.0]", "[5e6, 5000630.0]"))
    for name in ("plant.yaml", "system.yaml"):
        found = read_layout(tmp_path / name, D)
        assert found.positions == ((0.0, 0.0), (650.5, 10.0))
        assert "from the west" in found.notes[0]
    assert read_layout(tmp_path / "floris.yaml", D).positions == ((0.0, 0.0), (630.0, 0.0))
    for types in ("3", "[[1], [2]]", "[a, a]"):  # of any form: they are not taken
        (tmp_path / "plant.yaml").write_text(PLANT.replace("\nturbines", f"\n    turbine_types: {types}\nturbines"))
        several = "several types" in read_layout(tmp_path / "plant.yaml", D).notes[0]
        assert several == (types == "[[1], [2]]")
    far = read_layout(tmp_path / "far.yaml", D)
    assert far.positions == ((-315.0, 0.0), (315.0, 0.0)) and "origin is moved" in far.notes[-1]


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.yaml", "farm: {layout_x: [0.0]}", "farm.layout_y: expected a list of numbers"),
        ("a.yaml", FLORIS.replace("layout_y: [0.0, 0.0]", "layout_y: [0.0]"), "2 numbers of layout_x, but 1"),
        ("a.yaml", FLORIS.replace("[0.0, 630.0]", "[0.0, .nan]"), "farm.layout_x: expected a list of numbers"),
        ("a.yaml", "layout: 1", "expected the layout of a farm"),
        ("a.yaml", "layouts: []", "layouts.coordinates.x: expected"),
        ("a.yaml", "wind_farm: !include none.yaml", "no such file"),
        ("a.fstf", VERSIONS[4].replace("NumTurbines", "NTurbines"), "keyword NumTurbines is missing"),
        ("a.fstf", VERSIONS[4].replace("2        NumT", "3        NumT"), "says 3"),
        ("a.fstf", VERSIONS[4].replace("0.2      f_c", "fast     f_c"), "f_c: expected numbers or DEFAULT"),
        ("a.fstf", VERSIONS[4].replace("0.2      f_c", "0.0      f_c"), r"a.fstf, by DT_Low, f_c.*cut_off: .* 0.0"),
        ("a.fstf", VERSIONS[4].replace("3.0      DT_Low", "50.0      DT_Low"), "a.fstf, by DT_Low.*step: .* 50.0 s"),
        ("a.fstf", HEAD.format(control=""), "no wake dynamics"),
    ],
)
def test_mistakes_are_answered_in_words(name: str, text: str, words: str, tmp_path: Path) -> None:
    from meltemi.core.errors import InputError

    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=words):
        read_layout(tmp_path / name, D)


def test_several_types_of_turbines_are_noted_in_floris_as_in_windio(tmp_path: Path) -> None:
    (tmp_path / "farm.yaml").write_text(FLORIS.replace("[nrel_5MW]", "[nrel_5MW, iea_10MW]"))
    (tmp_path / "one.yaml").write_text(FLORIS.replace("[nrel_5MW]", "[nrel_5MW, nrel_5MW]"))
    assert any("several types" in note for note in read_layout(tmp_path / "farm.yaml", D).notes)
    assert not any("several types" in note for note in read_layout(tmp_path / "one.yaml", D).notes)
