"""Layups of windIO files: arcs, angles, materials, axes of the matrices; the IEA blades against their own matrices."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError
from meltemi.exchange.windio.blade import _mass, _stiffness
from meltemi.exchange.windio.layup import _Reader
from meltemi.exchange.windio.tree import Tree, load
from meltemi.sections.elements import finite_element_section
from meltemi.sections.layup import Layup
from meltemi.sections.properties import centres_of
from meltemi.sections.thin_walled import thin_walled_section
from meltemi.structure.members import blade_member, cells
from meltemi.turbine.windio_package import windio_file

BLADE = "components.blade"


@pytest.fixture(scope="module")
def trees() -> dict[str, Tree]:
    return {name: load(windio_file(f"IEA-{name}-RWT.yaml", "the tests")) for name in ("15-240", "22-280")}


@pytest.fixture(scope="module")
def layups(trees: dict[str, Tree]) -> dict[str, Layup]:
    return {name: _Reader(tree).layup() for name, tree in trees.items()}


def changed(tree: Tree, change: Callable[[dict[str, Any]], None]) -> Layup:
    data = copy.deepcopy(tree.data)
    change(data["components"]["blade"])
    return _Reader(Tree(data, "file.yaml")).layup()


def test_the_example_is_read(layups: dict[str, Layup]) -> None:
    layup = layups["15-240"]
    assert len(layup.layers) == 18
    assert [web.name for web in layup.webs] == ["web0", "web1"]
    cap = next(layer for layer in layup.layers if layer.name == "Spar_Cap_SS")
    assert layup.materials[cap.material].E1 == 114.5e9
    assert layup.materials["glass_uni"].nu13 == 0.35
    assert layup.materials["CarbonUD"].Yt is None  # the file has 0 for what is not known
    assert layup.position.values[-1] == pytest.approx(117.0, abs=0.5)
    section = layup.section(0.5)
    assert section.contour[:, 0].max() > -section.contour[:, 0].min() * 0.9  # suction side first, x > 0
    assert section.contour[:, 1].max() == pytest.approx(layup.chord.at(0.5) - layup.offset_y.at(0.5), rel=1e-3)
    # the caps: arcs of the anchors, about the reference axis, their width as given
    a = section.plies[[p.name for p in section.plies].index("Spar_Cap_SS")]
    length = np.sum(np.hypot(*np.diff(section.contour, axis=0).T))
    assert (a.end - a.start) * length == pytest.approx(0.9, rel=0.01)


def test_a_width_and_one_end_give_the_other(trees: dict[str, Tree], layups: dict[str, Layup]) -> None:
    """The anchors of the example have both: arcs, and widths (0.75 m where its arcs are up to 0.81 m long)."""

    def drop(blade: dict[str, Any]) -> None:
        for anchor in blade["structure"]["anchors"]:
            if anchor["name"] == "TE_reinforcement_SS":
                del anchor["end_nd_arc"]
            if anchor["name"] == "LE_reinforcement":
                del anchor["start_nd_arc"], anchor["end_nd_arc"]

    other = changed(trees["15-240"], drop)
    for name in ("TE_reinforcement_SS", "LE_reinforcement", "TE_SS_filler"):
        a, b = (next(layer for layer in x.layers if layer.name == name) for x in (layups["15-240"], other))
        for station in (0.2, 0.5):
            assert b.start.at(station) == pytest.approx(a.start.at(station), abs=6e-3)
            assert b.end.at(station) == pytest.approx(a.end.at(station), abs=6e-3)


def test_planes_cut_the_surface(trees: dict[str, Tree], layups: dict[str, Layup]) -> None:
    """Without arcs, webs and caps are where their planes cut the surface: within 0.6 % of the contour."""

    def drop(blade: dict[str, Any]) -> None:
        for anchor in blade["structure"]["anchors"]:
            if "plane_intersection" in anchor:
                del anchor["start_nd_arc"], anchor["end_nd_arc"]

    for name, tree in trees.items():
        other = changed(tree, drop)
        for a, b in zip((*layups[name].webs, *layups[name].layers), (*other.webs, *other.layers), strict=True):
            for station in (0.15, 0.3, 0.45):
                assert b.start.at(station) == pytest.approx(a.start.at(station), abs=7e-3), a.name
                assert b.end.at(station) == pytest.approx(a.end.at(station), abs=7e-3), a.name


def test_layers_end_with_their_grid(layups: dict[str, Layup]) -> None:
    layup = layups["22-280"]  # web0 from 5 to 50 % of the span
    assert [w.name for w in layup.section(0.45).webs] == ["web0", "web1", "web2"]
    assert [w.name for w in layup.section(0.55).webs] == ["web1", "web2"]
    assert not layup.section(0.02).webs


def test_angles_are_towards_the_leading_edge(trees: dict[str, Tree]) -> None:
    """Both caps at 7 deg: along the arc on the suction side, against it on the other; bending twists to feather."""

    def turn(blade: dict[str, Any]) -> None:
        for layer in blade["structure"]["layers"]:
            if layer["name"].startswith("Spar_Cap"):
                layer["fiber_orientation"] = {"grid": [0.0, 1.0], "values": [7.0, 7.0]}

    section = changed(trees["15-240"], turn).section(0.6)
    angles = {ply.name: np.degrees(ply.angle) for ply in section.plies if ply.angle}
    assert angles == pytest.approx({"Spar_Cap_SS": 7.0, "Spar_Cap_PS": -7.0})
    F = np.linalg.inv(thin_walled_section(section).stiffness)
    assert 0.05 < -F[4, 5] / np.sqrt(F[4, 4] * F[5, 5]) < 0.5  # positive with the sign of (B-13)


def test_the_axes_of_the_matrices(trees: dict[str, Tree], layups: dict[str, Layup]) -> None:
    """The schema calls K44 flapwise; in its own examples it is edgewise, as computed here from shape and layup.

    A reader that followed the schema would exchange flap and edge: they differ by a factor of 2.4 and more at mid-span.
    """
    for name, least in (("15-240", 2.5), ("22-280", 2.4)):
        K = _stiffness(trees[name], np.array([0.5]))[0]
        made = thin_walled_section(layups[name].section(0.5)).stiffness
        assert K[3, 3] / K[4, 4] > least
        for i, j in ((3, 3), (4, 4)):
            assert made[i, j] == pytest.approx(K[i, j], rel=0.12)
        assert made[3, 3] / made[4, 4] > least
        centres = [centres_of(M, _mass(trees[name], np.array([0.5]))[0]) for M in (made, K)]
        assert centres[0].tension == pytest.approx(centres[1].tension, abs=0.02)  # both to the same sides
    schema = windio_file("IEA-15-240-RWT.yaml", "the tests").parents[2] / "schemas" / "turbine" / "turbine_schema.yaml"
    text = schema.read_text(encoding="utf-8")
    assert "K44 corresponds to the flapwise stiffness" in text  # if not, the sentence in docs/guide/sections.md goes


@pytest.mark.parametrize("model", [thin_walled_section, finite_element_section])
def test_iea22_against_its_matrices(model, trees: dict[str, Tree], layups: dict[str, Layup]) -> None:
    station = 0.3
    made = model(layups["22-280"].section(station))
    K, M = (read(trees["22-280"], np.array([station, 0.5, 0.9]))[0] for read in (_stiffness, _mass))
    assert np.diag(made.stiffness) == pytest.approx(np.diag(K), rel=0.05)
    assert made.mass[0, 0] == pytest.approx(M[0, 0], rel=0.005)
    ours, theirs = centres_of(made.stiffness, made.mass), centres_of(K, M)
    for name in ("shear", "tension", "mass"):
        assert getattr(ours, name) == pytest.approx(getattr(theirs, name), abs=0.01)  # of a chord of 7 m
    assert ours.direction == pytest.approx(theirs.direction, abs=0.004)


@pytest.mark.slow
@pytest.mark.parametrize("station", [0.0, 0.03, 0.1, 0.2, 0.5, 0.7, 0.9])
def test_iea22_along_the_span(station: float, trees: dict[str, Tree], layups: dict[str, Layup]) -> None:
    K, M = (read(trees["22-280"], np.array([station, 0.5, 0.9]))[0] for read in (_stiffness, _mass))
    for model in (thin_walled_section, finite_element_section):
        made = model(layups["22-280"].section(station))
        assert np.diag(made.stiffness) == pytest.approx(np.diag(K), rel=0.05)
        assert made.mass[0, 0] == pytest.approx(M[0, 0], rel=0.03)


@pytest.mark.slow
def test_frequencies_of_the_iea22_blade(layups: dict[str, Layup]) -> None:
    turbine = meltemi.turbine.load_turbine("iea22mw")
    made = meltemi.turbine.blade_of_layup(turbine, layups["22-280"], stations=np.linspace(0.0, 1.0, 31))
    found = []
    for blade in (turbine.blade.structure, made.blade.structure):
        layout = cells(np.linspace(0.0, blade.position[-1], 31))
        modes = blade_member(blade, {"flap": 3, "edge": 2, "torsion": 1}, layout).modes
        found.append(np.sqrt(np.diag(modes.stiffness) / np.diag(modes.mass)))
    assert found[1] == pytest.approx(found[0], rel=0.01)


def test_blades_of_another_length_are_refused(layups: dict[str, Layup]) -> None:
    turbine = meltemi.turbine.load_turbine("nrel5mw")
    with pytest.raises(InputError, match=r"is 117 m long, that of nrel5mw 61.5 m"):
        meltemi.turbine.blade_of_layup(turbine, layups["15-240"])
    with pytest.raises(InputError, match="has no layer 'Spar_Cap': did you mean 'Spar_Cap_"):
        layups["15-240"].section(0.5, {"Spar_Cap": 1.1})


def test_derivative_of_a_blade(layups: dict[str, Layup]) -> None:
    matrices = meltemi.turbine.section_matrices
    at = [0.3, 0.6]
    K, M = matrices(layups["15-240"], at, factors={"Spar_Cap_SS": 1.0 + 1e-30j})
    up, down = (matrices(layups["15-240"], at, factors={"Spar_Cap_SS": 1.0 + e}) for e in (1e-5, -1e-5))
    for exact, a, b in zip((K, M), up, down, strict=True):
        difference = (a - b) / 2e-5
        assert np.allclose(exact.imag / 1e-30, difference, rtol=1e-3, atol=1e-4 * np.abs(difference).max())


BAD = [
    (lambda b: b.pop("structure"), "components.blade.structure.layers is missing: the file has no layup"),
    (
        lambda b: b["structure"]["layers"][2].update(material="CarbonUS"),
        "no material 'CarbonUS': did you mean 'CarbonUD'",
    ),
    (
        lambda b: b["structure"]["layers"][2]["start_nd_arc"]["anchor"].update(name="Spar_Cap_S"),
        "layers Spar_Cap_SS.start_nd_arc: no anchor 'Spar_Cap_S': did you mean",
    ),
    (lambda b: b["structure"]["layers"][2].pop("thickness"), "layers Spar_Cap_SS: thickness is missing"),
    (
        lambda b: b["structure"]["layers"][2].update(
            thickness={"grid": [0.0, 1.0], "values": [[1.0, 1.0], [1.0, 1.0]]}
        ),
        "Spar_Cap_SS.thickness: a thickness that varies round the section is not read",
    ),
    (
        lambda b: next(a for a in b["structure"]["anchors"] if a["name"] == "TE").pop("start_nd_arc"),
        "anchors TE.start_nd_arc: missing: expected grid and values, an anchor, a plane, or a width",
    ),
    (lambda b: b["structure"]["layers"][-1].update(web="web7"), "no web 'web7'"),
]


@pytest.mark.parametrize(("change", "message"), BAD)
def test_bad_files_name_their_key(
    change: Callable[[dict[str, Any]], None], message: str, trees: dict[str, Tree]
) -> None:
    with pytest.raises(InputError) as error:
        changed(trees["15-240"], change)
    assert message in str(error.value)
    assert str(error.value).startswith("file.yaml")


def test_windio_1(tmp_path: Path) -> None:
    """Arcs in the layers, angles in radians, the offset relative to the chord."""
    circle = np.linspace(0.0, 2.0 * np.pi, 41)
    x, y = (0.5 + 0.5 * np.cos(circle)).tolist(), (0.5 * np.sin(circle)).tolist()
    flat = {"grid": [0.0, 1.0], "values": [0.0, 0.0]}
    one = {"grid": [0.0, 1.0], "values": [1.0, 1.0]}
    shape = {
        "airfoil_position": {"grid": [0.0, 1.0], "labels": ["circular", "circular"]},
        "chord": {"grid": [0.0, 1.0], "values": [2.0, 2.0]},
        "twist": flat,
        "pitch_axis": {"grid": [0.0, 1.0], "values": [0.5, 0.5]},
        "reference_axis": {"x": flat, "y": flat, "z": {"grid": [0.0, 1.0], "values": [0.0, 60.0]}},
    }
    layer = {"name": "skin", "material": "m", "thickness": {"grid": [0.0, 1.0], "values": [0.02, 0.01]}}
    layer |= {"start_nd_arc": flat, "end_nd_arc": one, "fiber_orientation": {"grid": [0.0, 1.0], "values": [0.1, 0.1]}}
    data = {
        "components": {"blade": {"outer_shape_bem": shape, "internal_structure_2d_fem": {"layers": [layer]}}},
        "airfoils": [{"name": "circular", "relative_thickness": 1.0, "coordinates": {"x": x, "y": y}}],
        "materials": [{"name": "m", "orth": 0, "rho": 1900.0, "E": 30e9, "nu": 0.3}],
    }
    layup = _Reader(Tree(data, "file.yaml")).layup()
    section = layup.section(0.5)
    assert [ply.angle for ply in section.plies] == pytest.approx([0.1, -0.1])
    made = thin_walled_section(section)
    assert made.mass[0, 0] == pytest.approx(1900.0 * np.pi * (1.0 - 0.985**2), rel=5e-3)
    assert centres_of(made.stiffness, made.mass).mass == pytest.approx([0.0, 0.0], abs=1e-3)


def test_derivative_where_the_trailing_edge_is_bonded(layups: dict[str, Layup]) -> None:
    """Plies that fill the room between the sides end there; a third of an entry was lost once."""
    layup, h = layups["15-240"], 1e-4
    low, high = (thin_walled_section(layup.section(0.55, {"Shell_skin": 1.0 + s * h})).stiffness for s in (-1.0, 1.0))
    found = thin_walled_section(layup.section(0.55, {"Shell_skin": 1.0 + 1e-30j})).stiffness.imag / 1e-30
    np.testing.assert_allclose(np.diag(found), np.diag(high - low) / (2.0 * h), rtol=1e-4)
