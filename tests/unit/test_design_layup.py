"""Variables of the layup: sections that follow thickness and chord, their derivatives, files, refused input."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meltemi import InputError, load_turbine
from meltemi.core.yamlfile import write_record
from meltemi.designs.layup import design_layup
from meltemi.designs.settings import LayupSetting, VariableSetting
from meltemi.designs.strain import moments, per_moment
from meltemi.designs.terms import term_of
from meltemi.designs.variables import Variables, variables_of
from meltemi.sections.files import find_layup
from meltemi.sections.layup import Layer, Layup, Material, Shape, Web
from meltemi.sections.properties import centres_of
from meltemi.sections.thin_walled import thin_walled_section

NREL = load_turbine("nrel5mw")
SKIN = Material(density=1900.0, E1=42e9, E2=12e9, E3=12e9, G12=4e9, G13=4e9, G23=4e9, nu12=0.28, nu13=0.28, nu23=0.4)
CHORD, TWIST = "turbine.blade.aerodynamics.chord", "turbine.blade.aerodynamics.twist"
FACTOR = {"low": 0.5, "high": 2.0}


def layup_of(length: float = NREL.blade.length) -> Layup:
    """An ellipse with caps and a web, thinner towards the tip."""
    a = np.linspace(0.0, 2.0 * np.pi, 81)
    t = {"grid": [0.0, 0.5, 1.0], "values": [0.03, 0.02, 0.005]}
    cap = {"grid": [0.1, 0.9], "values": [0.05, 0.01]}
    return Layup(
        name="ellipse", position={"grid": [0.0, 1.0], "values": [0.0, length]}, offset_y=1.4, thickness=0.4,
        chord={"grid": [0.0, 1.0], "values": [4.0, 2.0]}, materials={"m": SKIN},
        shapes=(Shape(thickness=0.4, coordinates=np.stack([0.5 + 0.5 * np.cos(a), 0.2 * np.sin(a)], axis=1)),),
        webs=(Web(name="web", start=0.25, end=0.75),),
        layers=(
            Layer(name="skin", material="m", thickness=t, angle=0.2),
            Layer(name="cap_s", material="m", thickness=0.04, start=0.2, end=0.3),
            Layer(name="cap_p", material="m", thickness=cap, start=0.7, end=0.8),
            Layer(name="web", material="m", thickness=0.01, web="web"),
        ),
    )  # fmt: skip


def variables(folder: Path, settings: dict[str, dict[str, Any]], **options: Any) -> Variables:
    write_record(layup_of(), folder / "layup.yaml")
    given = {path: VariableSetting(**setting) for path, setting in settings.items()}
    layup = design_layup(LayupSetting(file="layup.yaml", stations=5, **options), NREL, folder, given)
    return variables_of(given, NREL, {}, layup)


def matrices(turbine: Any) -> tuple[np.ndarray, np.ndarray]:
    return turbine.blade.structure.stiffness_matrix, turbine.blade.structure.mass_matrix


@pytest.mark.parametrize(("model", "agree"), [("walls", 3e-5), ("elements", 1e-3)])  # nodes follow ramps of thickness
def test_sections_beside_a_design_are_those_of_first_order(tmp_path: Path, model: str, agree: float) -> None:
    """Thickness by complex steps, chord by homogeneity, against central differences of computed sections."""
    given = {"layup.cap_*": FACTOR | {"knots": 2}, "layup.web": FACTOR, CHORD: FACTOR | {"knots": 2}}
    found = variables(tmp_path, given | {TWIST: {"low": -0.1, "high": 0.1, "add": True}}, model=model)
    x = found.start + np.array([0.1, -0.1, 0.3, -0.1, 0.1, 0.02])
    for p in (0, 2, 4, 5):
        h = 1e-4 * np.eye(len(x))[p]
        near, computed = (
            [(a - b) / 2e-4 for a, b in zip(*(matrices(found.apply(x + s * h, about)) for s in (1, -1)), strict=True)]
            for about in (x, None)
        )
        for slopes, right in zip(near, computed, strict=True):
            assert np.any(right) == (p != 5), found.names[p]
            np.testing.assert_allclose(slopes, right, atol=agree * np.abs(right).max())
    np.testing.assert_array_equal(matrices(found.apply(x, x))[0], matrices(found.apply(x))[0])


def test_thickness_chord_and_twist_reach_the_blade(tmp_path: Path) -> None:
    thick = variables(tmp_path, {"layup.*": FACTOR})
    one, two = (matrices(thick.apply([f])) for f in (1.0, 1.05))
    area = two[0][2, 2, 2] / one[0][2, 2, 2]
    assert 1.04 < area < 1.05 and two[1][2, 0, 0] / one[1][2, 0, 0] == pytest.approx(area, rel=2e-3)
    wide = variables(tmp_path, {CHORD: FACTOR, "layup.*": FACTOR})
    one, two = (matrices(wide.apply([f, f])) for f in (1.0, 1.1))  # all lengths together
    np.testing.assert_allclose(two[0][:, 3:, 3:], 1.1**4 * one[0][:, 3:, 3:], rtol=1e-6)
    np.testing.assert_allclose(two[1][:, 0, 0], 1.1**2 * one[1][:, 0, 0], rtol=1e-6)
    turned = variables(tmp_path, {TWIST: {"low": -0.1, "high": 0.1, "add": True}})
    change = turned.apply([0.05]).blade.structure.twist - turned.apply([0.0]).blade.structure.twist
    np.testing.assert_allclose(change, 0.05)


def test_strains_of_layers_by_a_flapwise_moment(tmp_path: Path) -> None:
    """Isotropic: distance from the axis over bending stiffness; at 90 degrees of twist the other axis; beside a design
    to first order."""
    metal = dict.fromkeys("E1 E2 E3".split(), 70e9) | dict.fromkeys("G12 G13 G23".split(), 27e9)
    material = SKIN.replace(**metal, nu12=0.3, nu13=0.3, nu23=0.3)
    plain = layup_of().replace(materials={"m": material}, webs=(), layers=layup_of().layers[:1])
    write_record(plain, tmp_path / "layup.yaml")
    given = {"layup.skin": VariableSetting(**FACTOR), CHORD: VariableSetting(**FACTOR)}
    layup = design_layup(LayupSetting(file="layup.yaml", stations=5), NREL, tmp_path, given)
    found = variables_of(given, NREL, {}, layup)
    structure, places = NREL.blade.structure, np.array([15.375, 30.75])
    along = np.cos(0.2) ** 2 - 0.3 * np.sin(0.2) ** 2  # of the fibres, 0.2 rad from the axis
    for angle, i, across in ((0.0, 0, 0.2 * along), (np.pi / 2.0, 1, 0.5 * along)):
        turned = NREL.replace(**{"blade.structure.twist": np.full(len(structure.position), angle)})
        strains = layup.strains(turned, plain, "skin", places)
        for place, strain in zip(places, strains, strict=True):
            section = thin_walled_section(plain.section(place / NREL.blade.length))
            EI = centres_of(section.stiffness, section.mass).bending[i]
            assert strain == pytest.approx(across * plain.chord.at(place / 61.5) / EI, rel=0.01)
    x, slopes = np.array([1.1, 0.9]), []
    term = term_of("max strain skin", 1.0)
    assert moments(term, found, [30.75])[2:4] == ("root_moment_flap_3", "station_1_moment_y_1")
    for p in range(2):
        h = 1e-4 * np.eye(2)[p]
        near, computed = (
            (per_moment(term, found, x + h, [30.75], about) - per_moment(term, found, x - h, [30.75], about)) / 2e-4
            for about in (x, None)
        )
        np.testing.assert_allclose(near, computed, rtol=1e-3)
        slopes.append(computed[3] / per_moment(term, found, x, [30.75])[3])
    assert 1.1 * slopes[0] + 0.9 * slopes[1] == pytest.approx(-3.0, rel=1e-3)  # of the order of lengths
    assert 1.1 * slopes[0] == pytest.approx(-1.0, rel=0.1)  # thin walls


def test_strains_that_cannot_be(tmp_path: Path) -> None:
    term = term_of("max strain cap_q", 1.0)
    with pytest.raises(InputError, match="'max strain cap_q' needs a layup"):
        moments(term, variables_of({"turbine.tower.mass": VariableSetting(**FACTOR)}, NREL, {}), [])
    found = variables(tmp_path, {"layup.cap_p": FACTOR})
    with pytest.raises(InputError, match="'max strain cap_q': ellipse has no layer 'cap_q'"):
        moments(term, found, [])
    with pytest.raises(InputError, match="'cap_p' is at none of the stations of the blade: add blade_stations"):
        per_moment(term_of("max strain cap_p", 1.0), found, found.start, [])


def test_the_written_layup_is_the_designed_one(tmp_path: Path) -> None:
    found = variables(tmp_path, {"layup.cap_p": FACTOR | {"knots": 2}, CHORD: FACTOR})
    x = np.array([0.8, 1.3, 1.1])
    write_record(found.layup_at(x), tmp_path / "designed.yaml")
    layup = find_layup("designed.yaml", tmp_path)
    cap = next(layer for layer in layup.layers if layer.name == "cap_p")
    np.testing.assert_allclose(cap.thickness.at(0.1), 0.8 * 0.05)
    np.testing.assert_allclose(cap.thickness.at(0.5), 1.05 * 0.03)
    assert layup.chord.at(0.5) == pytest.approx(3.3) and layup.offset_y.at(0.5) == pytest.approx(1.54)
    assert found.layup is not None
    again = design_layup(LayupSetting(file="designed.yaml", stations=5), NREL, tmp_path, [])
    np.testing.assert_allclose(matrices(again.blade(NREL, again.start))[0], matrices(found.apply(x))[0], rtol=1e-9)


@pytest.mark.parametrize(
    ("path", "setting", "words"),
    [
        ("layup.cap_q", FACTOR, "ellipse has no layer 'cap_q': did you mean 'cap_"),
        ("layup.skin", FACTOR | {"entry": 2}, "'layup.skin' is a factor on thickness"),
        ("turbine.blade.structure.stiffness_matrix", FACTOR, "follows from the layup: change layup.LAYER"),
    ],
)
def test_refused(tmp_path: Path, path: str, setting: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        variables(tmp_path, {path: setting})


def test_a_layup_is_needed_and_must_be_of_this_blade(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="'layup.skin' needs a layup: add layup: {file: ...}"):
        variables_of({"layup.skin": VariableSetting(**FACTOR)}, NREL, {})
    write_record(layup_of(50.0), tmp_path / "short.yaml")
    with pytest.raises(InputError, match="blade of ellipse is 50 m long, that of nrel5mw 61.5 m"):
        design_layup(LayupSetting(file="short.yaml"), NREL, tmp_path, [])
    with pytest.raises(InputError, match="nrel5mw of the library has no layup; iea15mw"):
        design_layup(LayupSetting(file="nrel5mw"), NREL, tmp_path, [])
    with pytest.raises(InputError, match="no such file"):
        design_layup(LayupSetting(file="none.yaml"), NREL, tmp_path, [])
