"""windIO files: frames, units and geometry against numbers of the OpenFAST decks, options, notes, bad input."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from proof_of_use import differences

import meltemi
from meltemi import InputError, Turbine
from meltemi.app.cli import main
from meltemi.core.yamlfile import parse, read_mapping
from meltemi.exchange.report import ImportedTurbine
from meltemi.exchange.windio import defaults, gains
from meltemi.exchange.windio.tower import tube
from meltemi.exchange.windio.tree import Tree, load, parse_quickly
from meltemi.io import import_windio, read_windio
from meltemi.turbine.library import DATA
from meltemi.turbine.windio_package import windio_file

EXTRA = DATA / "iea15mw.yaml"


@pytest.fixture(scope="module")
def path() -> Path:
    return windio_file("IEA-15-240-RWT.yaml", "the tests")


@pytest.fixture(scope="module")
def data(path: Path) -> dict[str, Any]:
    return load(path).data


@pytest.fixture(scope="module")
def iea15() -> Turbine:
    return meltemi.load_turbine("iea15mw")


Change = Callable[[dict[str, Any]], object]
Changed = Callable[..., Path]


def text_of(value: Any, indent: str = "") -> str:
    """YAML with lists of numbers in one line."""
    if isinstance(value, dict):
        return "".join(f"\n{indent}{key}:{text_of(inner, indent + '  ')}" for key, inner in value.items())
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return "".join(f"\n{indent}-{text_of(inner, indent + '  ')}" for inner in value)
    return " " + ("null" if value is None else json.dumps(value))


@pytest.fixture
def changed(data: dict[str, Any], tmp_path: Path) -> Changed:
    """The file with some of its content changed."""

    def write(*changes: Change) -> Path:
        content = copy.deepcopy(data)
        for change in changes:
            change(content)
        (tmp_path / "changed.yaml").write_text(text_of(content), encoding="utf-8")
        return tmp_path / "changed.yaml"

    return write


def at(content: dict[str, Any], path: str) -> Any:
    for key in path.split("."):
        content = content[key]
    return content


def put(path: str, value: Any) -> Change:
    above, _, last = path.rpartition(".")
    return lambda content: (at(content, above) if above else content).update({last: value})


def drop(path: str) -> Change:
    above, _, last = path.rpartition(".")
    return lambda content: (at(content, above) if above else content).pop(last)


def rename(path: str, new: str) -> Change:
    above, _, last = path.rpartition(".")
    return lambda content: (inner := at(content, above)).update({new: inner.pop(last)})


def walls_only(content: dict[str, Any]) -> dict[str, Any]:
    """The structure of the tower, without section properties."""
    structure: dict[str, Any] = content["components"]["tower"]["structure"]
    del structure["elastic_properties"]
    return structure


def message(path: Path, extra: Any = EXTRA, **options: Any) -> str:
    with pytest.raises(InputError) as caught:
        read_windio(path, extra, **options)
    return str(caught.value)


# What the file means -----------------------------------------------------------------------------------------------


def test_the_geometry_is_that_of_the_openfast_deck(iea15: Turbine) -> None:
    # ElastoDyn file of IEA-15-240-RWT-Monopile, rosco 2.10.6
    assert iea15.nacelle.overhang == pytest.approx(12.097571763912535, rel=1e-12)
    assert iea15.nacelle.shaft_height == pytest.approx(4.349459414248071, rel=1e-12)
    assert np.degrees(iea15.nacelle.tilt) == pytest.approx(6.0)
    assert np.degrees(iea15.hub.precone) == pytest.approx(4.0)
    assert iea15.hub.radius == pytest.approx(3.97)
    assert iea15.rotor_radius == pytest.approx(120.97)
    assert iea15.tower.base_height + iea15.tower.length == pytest.approx(144.386)
    assert iea15.drivetrain.generator_inertia == pytest.approx(1836784.0, rel=1e-6)
    assert iea15.drivetrain.stiffness == pytest.approx(69737644900.0, rel=1e-6)


def test_the_nacelle_is_the_drivetrain_and_the_yaw_system_belongs_to_the_tower(
    iea15: Turbine, data: dict[str, Any]
) -> None:
    body, yaw = data["components"]["drivetrain"]["elastic_properties"], data["components"]["yaw"]["elastic_properties"]
    n = iea15.nacelle
    assert n.mass == body["mass"]
    assert iea15.tower.top_mass == yaw["mass"]
    np.testing.assert_allclose(n.mass_centre, body["location"])
    # about the tower top, where the file has its inertia, too
    x, y, z = n.mass_centre
    about_top = [
        n.roll_inertia + n.mass * (y * y + z * z),
        n.nod_inertia + n.mass * (x * x + z * z),
        n.yaw_inertia,
    ]
    np.testing.assert_allclose(about_top, body["inertia_tt"][:3], rtol=1e-6)


def test_prebend_is_upwind_twist_towards_feather_and_the_nose_ahead_of_the_axis(iea15: Turbine) -> None:
    s, a = iea15.blade.structure, iea15.blade.aerodynamics
    assert s.axis_x is not None and s.axis_y is not None and a.centre_x is not None and a.centre_y is not None
    assert s.axis_x[-1] == pytest.approx(-4.0)
    assert np.degrees(a.twist[0]) == pytest.approx(15.5946, abs=1e-4)
    # at the root circle axis and aerodynamic centre are close to the middle of the chord
    assert abs(a.centre_y[0]) < 0.03
    # outboard the aerodynamic centre lies ahead of the axis; where the nose is turned into the wind, also upwind of it
    middle = int(np.searchsorted(a.position, 40.0))
    axis = np.interp(a.position, s.position, s.axis_x)
    assert a.twist[middle] > 0.0 and a.centre_x[middle] < axis[middle]
    assert np.all(a.centre_y[(a.position > 30.0) & (a.position < 110.0)] < 0.0)


def test_section_offset_x_moves_the_chord_line_towards_the_suction_side(changed: Changed, iea15: Turbine) -> None:
    offset = {"grid": [0.0, 1.0], "values": [0.5, 0.5]}
    a = read_windio(changed(put("components.blade.outer_shape.section_offset_x", offset)), EXTRA).blade.aerodynamics
    b = iea15.blade.aerodynamics
    assert a.centre_x is not None and a.centre_y is not None and b.centre_x is not None and b.centre_y is not None
    np.testing.assert_allclose(a.centre_x - b.centre_x, 0.5 * np.cos(b.twist), atol=1e-12)
    np.testing.assert_allclose(a.centre_y - b.centre_y, -0.5 * np.sin(b.twist), atol=1e-12)


def test_the_section_matrices_stand_across_and_along_the_chord(iea15: Turbine, data: dict[str, Any]) -> None:
    s = iea15.blade.structure
    K, M = s.stiffness_matrix, s.mass_matrix
    assert K is not None and M is not None
    outer = s.position > 40.0
    assert np.all(K[outer, 3, 3] > 1.5 * K[outer, 4, 4])  # edgewise stiffer than flapwise
    assert np.all(K[outer, 1, 1] > 1.5 * K[outer, 0, 0])  # so is shear: spar caps and shells lie along the chord
    # centres of mass and of stiffness, each from its own entries, both lie behind the axis
    mass_y, stiff_y, stiff_x = M[:, 2, 3] / M[:, 0, 0], K[:, 2, 3] / K[:, 2, 2], -K[:, 2, 4] / K[:, 2, 2]
    assert np.all(mass_y[outer][:-1] > 0.0)
    assert np.all(stiff_y[outer][:-1] > 0.0)
    # the coupling of the two bendings belongs to the same right-handed frame: mostly -EA x y towards the tip
    tip = s.position > 62.0
    assert np.all((K[:, 3, 4] * stiff_x * stiff_y)[tip] < 0.0)
    grid = np.array(data["components"]["blade"]["structure"]["elastic_properties"]["inertia_matrix"]["grid"])
    mass = data["components"]["blade"]["structure"]["elastic_properties"]["inertia_matrix"]["mass"]
    assert np.trapezoid(M[:, 0, 0], s.position) == pytest.approx(np.trapezoid(mass, 117.0 * grid), rel=1e-9)


@pytest.mark.rosco
def test_the_section_matrices_are_those_of_the_beamdyn_deck(iea15: Turbine, rosco_cases: Path) -> None:
    deck = rosco_cases / "IEA-15-240-RWT/IEA-15-240-RWT/IEA-15-240-RWT_BeamDyn_blade.dat"
    lines = deck.read_text().split("DISTRIBUTED PROPERTIES")[1].splitlines()[1:]
    numbers = [[float(word) for word in line.split()] for line in lines if line.split()]
    s = iea15.blade.structure
    K, M = s.stiffness_matrix, s.mass_matrix
    assert K is not None and M is not None and len(numbers) == 26 * 13
    for k in range(26):
        rows = numbers[13 * k : 13 * (k + 1)]
        i = int(np.argmin(np.abs(s.position - 117.0 * rows[0][0])))
        for ours, theirs in ((K[i], rows[1:7]), (M[i], rows[7:13])):
            np.testing.assert_allclose(ours, theirs, rtol=1e-5, atol=1e-6 * np.abs(theirs).max())


def test_the_walls_of_the_tower_have_the_stiffness_that_the_file_gives(path: Path, iea15: Turbine) -> None:
    # the file's section properties are means between stations, its walls are at them
    walls = tube(load(path), "components.tower")
    for ours, given in (
        (walls.mass, iea15.tower.mass),
        (walls.bending, iea15.tower.fore_aft_stiffness),
        (walls.torsion, iea15.tower.torsion_stiffness),
    ):
        assert given is not None
        assert np.trapezoid(ours, walls.height) == pytest.approx(
            np.trapezoid(given, iea15.tower.position + iea15.tower.base_height), rel=0.03
        )


def test_a_tower_without_section_properties_is_made_of_its_walls(changed: Changed, path: Path) -> None:
    turbine = read_windio(changed(drop("components.tower.structure.elastic_properties")), EXTRA)
    walls = tube(load(path), "components.tower")
    np.testing.assert_array_equal(turbine.tower.fore_aft_stiffness, walls.bending)
    # a thin tube of steel, E 200 GPa: EI = E pi D^3 t / 8 with the diameter of the wall's middle
    D, t = 10.0 - 0.039496, 0.039496
    assert walls.bending[0] == pytest.approx(2e11 * np.pi * D**3 * t / 8.0, rel=1e-4)
    assert walls.mass[0] == pytest.approx(7800.0 * np.pi * D * t * 1.07, rel=1e-9)


def test_polars_are_blended_by_relative_thickness(iea15: Turbine, data: dict[str, Any]) -> None:
    a = iea15.blade.aerodynamics
    shape = data["components"]["blade"]["outer_shape"]
    grid = a.position / a.position[-1]
    thickness = np.interp(grid, shape["rthick"]["grid"], shape["rthick"]["values"])
    i = int(np.argmin(np.abs(thickness - 0.225)))
    assert 0.212 < thickness[i] < 0.240
    found = iea15.airfoils[a.airfoil[i]]
    polars = {p["name"]: p["polars"][0]["re_sets"][0]["cl"] for p in data["airfoils"]}
    alpha = np.radians(5.0)
    thin, thick = (
        np.interp(5.0, polars[name]["grid"], polars[name]["values"]) for name in ("FFA-W3-211", "FFA-W3-241")
    )
    share = (thickness[i] - 0.211) / 0.03
    blend = (1.0 - share) * thin + share * thick
    assert np.interp(alpha, found.angle_of_attack, found.lift) == pytest.approx(blend, abs=2e-3)
    assert a.airfoil[-1] == "FFA-W3-211"
    assert not iea15.airfoils["circular"].dynamic_stall and iea15.airfoils["FFA-W3-211"].dynamic_stall


# Options -----------------------------------------------------------------------------------------------------------


def test_a_thickness_that_is_missing_is_interpolated_between_the_airfoils(changed: Changed) -> None:
    imported = import_windio(changed(drop("components.blade.outer_shape.rthick")), EXTRA)
    assert any(n.kind == "approximated" and "PCHIP" in n.why for n in imported.notes)
    assert imported.turbine.blade.aerodynamics.airfoil[-1] == "FFA-W3-211"


def test_the_polar_of_the_nearest_reynolds_number_is_taken(changed: Changed) -> None:
    flat = {c: {"grid": [-180.0, 180.0], "values": [v, v]} for c, v in (("cl", 0.1), ("cd", 0.2), ("cm", 0.0))}

    def second(content: dict[str, Any]) -> None:
        (airfoil,) = (a for a in content["airfoils"] if a["name"] == "SNL-FFA-W3-500")
        airfoil["polars"][0]["re_sets"].append({"re": 4e6, **flat})

    file = changed(second)
    default, low = (import_windio(file, EXTRA, reynolds=re_) for re_ in (None, 3e6))
    name = "SNL-FFA-W3-500"
    lifts = []
    for turbine in (default.turbine, low.turbine):
        a = turbine.blade.aerodynamics
        polar = turbine.airfoils[a.airfoil[int(np.searchsorted(a.position, 0.15 * a.position[-1]))]]
        lifts.append(np.interp(np.radians(5.0), polar.angle_of_attack, polar.lift))
    assert lifts[1] < lifts[0] - 0.1
    assert any(n.where.endswith(name) and "Re 8.1e+06 of 4e+06, 8.1e+06" in n.why for n in default.notes)
    assert any(n.where.endswith(name) and n.why.startswith("Re 4e+06") for n in low.notes)


def test_a_pile_below_the_tower_is_softer_the_deeper_it_is_clamped(path: Path, iea15: Turbine) -> None:
    assert iea15.foundation is None
    shallow, deep = (read_windio(path, EXTRA, foundation="pile", mudline=z).foundation for z in (-30.0, -60.0))
    assert shallow is not None and deep is not None
    assert np.all(np.diag(deep.stiffness) < np.diag(shallow.stiffness))
    assert shallow.mass > 1e5  # with the transition piece
    assert deep.mass > shallow.mass


def test_extra_is_a_file_or_a_dictionary_and_wins(path: Path, iea15: Turbine) -> None:
    nested = parse(EXTRA.read_text(encoding="utf-8"), EXTRA, "")
    assert read_windio(path, nested) == iea15
    flat = {**nested, "hub.mass": 1.0, "yaw.rate": 0.01}
    changed = read_windio(path, flat)
    assert (changed.hub.mass, changed.yaw.rate) == (1.0, 0.01)
    assert changed.yaw.stiffness == iea15.yaw.stiffness


def test_without_gains_the_pitch_loop_is_that_of_the_nrel5mw_by_similarity(path: Path) -> None:
    nested = parse(EXTRA.read_text(encoding="utf-8"), EXTRA, "")
    del nested["control"]
    imported = import_windio(path, nested)
    pitch = imported.turbine.control.pitch
    # w / Omega and zeta of the NREL 5 MW: K_I / K_P = w / (2 zeta)
    assert pitch.integral_gain / pitch.proportional_gain == pytest.approx(0.6 / 1.2671 * 0.79168 / 1.4, rel=1e-3)
    assert any(n.what == "pitch gains" and n.kind == "approximated" for n in imported.notes)
    torque = imported.turbine.control.torque
    assert torque.optimal_gain * torque.rated_speed**3 <= torque.rated_power * (1.0 + 1e-12)


def test_what_the_file_does_not_say_is_in_the_notes(path: Path) -> None:
    notes = import_windio(path, EXTRA).notes
    assert {n.kind for n in notes} == {"used", "approximated", "ignored"}
    assert any(n.where == "control.min_pitch_table" and n.kind == "ignored" for n in notes)
    assert any(n.where == "components.monopile" and n.kind == "ignored" for n in notes)


def test_what_is_given_beside_the_file_is_not_called_approximated(path: Path) -> None:
    values = {"control.pitch.proportional_gain": 0.01, "control.filter_frequency": 1.5}
    plain, given = import_windio(path), import_windio(path, values)
    gone = {note.what for note in plain.noted("approximated")} - {note.what for note in given.noted("approximated")}
    assert gone == {gains.GAINS, "filter of the generator speed"}
    assert {note.what for note in given.notes if note.where == "extra"} == set(values)


def test_damping_and_yaw_bearing_follow_the_rules_of_the_nrel5mw(path: Path) -> None:
    """What windIO has no place for."""
    imported = import_windio(path)
    t, notes = imported.turbine, {note.what: note.why for note in imported.notes if note.kind == "approximated"}
    assert t.blade.structure.damping is not None and t.blade.structure.damping.flap == 0.00477465  # 0.03 / (2 pi)
    assert t.tower.damping.side_side == 0.01
    b, n = t.blade.structure, t.nacelle
    assert b.mass_matrix is not None
    mass = b.mass_matrix[:, 0, 0]
    radius = t.hub.radius + b.position
    about_shaft = 3.0 * np.trapezoid(mass * radius**2, b.position) * np.cos(t.hub.precone) ** 2 + t.hub.inertia
    heavy = 3.0 * np.trapezoid(mass, b.position) + t.hub.mass
    turning = n.yaw_inertia + 0.5 * about_shaft + heavy * n.overhang**2
    frequency = 2.0 * np.pi * 3.0 * 7.559987120819503 / 12.1
    assert t.yaw.stiffness == pytest.approx(turning * frequency**2, rel=1e-9)
    assert t.yaw.damping == pytest.approx(2.0 * 0.02 * turning * frequency, rel=1e-9)
    for what in ("blades", "tower"):
        assert "of critical in all modes" in notes[f"damping of the {what}"]
    for what in ("stiffness", "damping"):
        assert "NREL/TP-500-38060, section 4" in notes[f"{what} of the locked yaw bearing"]
    given = import_windio(
        path, {"yaw.damping": 5.0, "tower.damping.torsion": 0.02, "blade.structure.damping_time": TIMES}
    )
    assert given.turbine.yaw == t.yaw.replace(damping=5.0)
    assert given.turbine.blade.structure.damping is None


TIMES = {"flap": 0.003, "edge": 0.002, "torsion": 0.001}


def test_the_yaw_bearing_of_the_nrel5mw_is_that_of_its_report() -> None:
    t = meltemi.load_turbine("nrel5mw")
    b, hub, n = t.blade.structure, t.hub, t.nacelle
    M = np.zeros((len(b.position), 6, 6))
    M[:, 0, 0] = b.mass
    data = {
        "n_blades": 3,
        "blade": {"structure": {"position": b.position, "mass_matrix": M}},
        "hub": {"mass": hub.mass, "inertia": hub.inertia, "radius": hub.radius, "precone": hub.precone},
        "nacelle": {"yaw_inertia": n.yaw_inertia, "overhang": n.overhang},
    }
    found = defaults.yaw_inertia(data, {})
    assert found is not None
    assert found * (6.0 * np.pi) ** 2 == pytest.approx(9.02832e9, rel=0.03)
    assert defaults.YAW_DAMPING * 2.0 * found * 6.0 * np.pi == pytest.approx(1.916e7, rel=0.03)


CONTROL_2_0 = {
    "supervisory": {"Vin": 3.5, "Vout": 24.0},
    "pitch": {"max_pitch": 89.0, "max_pitch_rate": 2.0, "min_pitch": 0.5},
    "torque": {"tsr": 9.0, "max_torque_rate": 1.5e6, "VS_minspd": 5.0, "VS_maxspd": 7.56},
}


def test_keys_of_control_of_windio_2_0_are_those_of_2_1(changed: Changed, path: Path) -> None:
    """The torque of 2.0 has neither gain nor largest torque: rated power at rated speed, 1.1 of rated torque."""
    speeds = (drop(f"assembly.cut_{name}_wind_speed") for name in ("in", "out"))
    imported = import_windio(changed(put("control", CONTROL_2_0), *speeds))
    t, rated = imported.turbine, 7.56 * np.pi / 30.0
    torque, pitch = t.control.torque, t.control.pitch
    assert (t.cut_in, t.cut_out, torque.rate_limit) == (3.5, 24.0, 1.5e6)
    assert torque.optimal_speed == pytest.approx(5.0 * np.pi / 30.0)
    assert torque.rated_speed == pytest.approx(0.99 * rated) and pitch.reference_speed == pytest.approx(rated)
    np.testing.assert_allclose(np.degrees([pitch.minimum, pitch.maximum, pitch.rate_limit]), [0.5, 89.0, 2.0])
    assert torque.optimal_gain == pytest.approx(torque.rated_power / torque.rated_speed**3)
    assert torque.maximum_torque == pytest.approx(1.1 * torque.rated_power / rated)
    assert t.control.filter_frequency == pytest.approx(0.5 * np.pi * 7.56 / 12.1)
    assert "control.torque.VS_maxspd" in {note.where for note in imported.noted("used")}


def values(node: Any, i: int = 1) -> Any:
    """All numbers of a part of the file changed a little, those of a list differently."""
    if isinstance(node, dict):
        return {key: inner if key in ("grid", "name", "material") else values(inner) for key, inner in node.items()}
    if isinstance(node, list):
        return [values(inner, i + 1) for i, inner in enumerate(node)]
    return node if isinstance(node, str | bool | None) else (1.0 - 1e-4 * i) * node or 1e-4 * i


OFFSET = {"grid": [0.0, 1.0], "values": [0.5, 0.5]}
VARIANTS: dict[str, tuple[list[Change], dict[str, Any]]] = {
    "2.1": ([], {}),
    "2.0": ([put("control", CONTROL_2_0)], {}),
    "walls": ([walls_only], {}),
    "pile": ([], {"foundation": "pile", "mudline": -30.0}),
    "offset": ([put("components.blade.outer_shape.section_offset_x", OFFSET)], {}),
    "thickness": ([drop("components.blade.outer_shape.rthick")], {}),
    "extra": ([], {"extra": EXTRA}),
}


@pytest.mark.long
@pytest.mark.parametrize("variant", VARIANTS)
def test_every_key_that_the_report_calls_used_is_used(
    variant: str, path: Path, data: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One key at a time is changed, and the turbine changes; what is ignored changes nothing."""
    changes, how = VARIANTS[variant]
    data = copy.deepcopy(data)
    for each in changes:
        each(data)

    def read(change: Change = lambda content: None) -> ImportedTurbine:
        content = copy.deepcopy(data)
        change(content)
        monkeypatch.setattr("meltemi.exchange.windio.load", lambda _: Tree(content, str(path)))
        return import_windio(path, **how)

    before, missed = read(), []
    used = [note.where for note in before.noted("used") if note.where != "extra"]
    for where in used:
        if where.endswith(".grid"):  # the curves above it are perturbed
            continue
        perturbed = put(where, values(at(data, where)))
        if where == "components.blade.outer_shape.airfoils":
            perturbed = put("airfoils", values(data["airfoils"]))
        if not differences(before, read(perturbed)):
            missed.append(where)
    assert not missed
    assert len(used) > 60
    for note in before.noted("ignored"):
        if "inertia" not in note.what and not note.why.startswith("all zero"):
            assert not differences(before, read(put(note.where, values(at(data, note.where))))), note.where


# Bad input -----------------------------------------------------------------------------------------------------------


def test_everything_that_lacks_is_listed_at_once(changed: Changed) -> None:
    """Masses have no default, and without them the yaw bearing has none."""
    text = message(changed(drop("components.hub.elastic_properties"), drop("components.drivetrain.gearbox")), None)
    assert "supply the missing data with extra, a YAML file or a dictionary of these keys" in text
    for key in (
        "hub.mass: missing ([kg; ",
        "hub.inertia: missing",
        "yaw.stiffness: missing ([N m/rad; ",
        "yaw.damping",
    ):
        assert key in text
    assert "damping_time" not in text and "tower" not in text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (drop("components.blade"), "not a windIO turbine: components.blade is missing"),
        (rename("components.blade.outer_shape", "outer_shape_bem"), "this is windIO 1; convert it to windIO 2"),
        (drop("components.blade.outer_shape.twist"), "components.blade.outer_shape.twist.grid is missing"),
        (
            drop("components.blade.structure.elastic_properties.stiffness_matrix.K44"),
            "components.blade.structure.elastic_properties.stiffness_matrix.K44 is missing",
        ),
        (lambda c: c["airfoils"][0].update(name="circle"), "airfoils 1 names 'circular'"),
        (lambda c: c["airfoils"][0].pop("polars"), "airfoils circular: polars is missing"),
        (lambda c: c["airfoils"].append("more"), "airfoils: expected a list of entries with keys"),
        (lambda c: c["airfoils"][0].update(rthick=[1]), "airfoils circular: rthick: expected a number, found '[1.0]'"),
        (put("components.blade.outer_shape.chord.values", [1.0]), "outer_shape.chord.values: expected 53 numbers"),
        (
            put("components.blade.outer_shape.chord.grid", [1.0, 0.0]),
            "chord.grid: expected two or more numbers that",
        ),
        (put("assembly.rotor_orientation", "Downwind"), "upwind rotors only"),
        (put("components.drivetrain.outer_shape.uptilt", "high"), "uptilt: expected a number, found 'high'"),
        (drop("components.hub"), "changed.yaml with iea15mw.yaml: hub.radius: missing ([m; "),
        (drop("components.tower.structure"), "components.tower.structure needs elastic_properties or layers"),
        (lambda c: walls_only(c)["layers"][0].update(material="steal"), "no material 'steal': did"),
    ],
)
def test_what_is_wrong_is_named(changed: Changed, change: Change, expected: str) -> None:
    assert expected in message(changed(change))


def test_matrices_in_other_axes_are_refused(changed: Changed) -> None:
    K = "components.blade.structure.elastic_properties.stiffness_matrix"
    text = message(changed(rename(f"{K}.K44", "K"), rename(f"{K}.K55", "K44"), rename(f"{K}.K", "K55")))
    assert "K44 is mostly less than K55" in text
    assert "turn the matrices" in text


def test_numbers_without_sense_warn_of_nothing(changed: Changed, data: dict[str, Any]) -> None:
    path = "components.blade.structure.elastic_properties"
    n = len(at(data, f"{path}.inertia_matrix")["mass"])
    huge = (put(f"{path}.inertia_matrix.{name}", [1e200] * n) for name in ("mass", "cm_x"))
    assert "must be a finite number" in message(changed(*huge))
    zeros = put(f"{path}.stiffness_matrix.K55", [0.0] * len(at(data, f"{path}.stiffness_matrix")["K55"]))
    assert "positive definite" in message(changed(zeros))


def test_options_that_make_no_sense_are_refused(path: Path) -> None:
    assert "needs mudline" in message(path, foundation="pile")
    assert "outside the monopile" in message(path, foundation="pile", mudline=-100.0)
    assert "must be 'clamped' or 'pile'" in message(path, foundation="jacket")
    assert "unknown key; did you mean 'stiffness'" in message(path, {"yaw.stifness": 1.0})


def test_lists_beside_yaml_are_what_yaml_reads() -> None:
    text = (
        "a: [1, 2.5,\n    -3e-2]\nb:\n  - c: &x [1.0]\n    d: *x\ne: 'text [1, 2]'\nf: [a, b]\ng: []\n"
        "h: note [1, 2]\ni: {grid: [1, 2], values: [3, 4]}\n"
    )
    where = Path("t.yaml")
    assert parse_quickly(text, where) == parse(text, where, "")
    with pytest.raises(InputError, match=r"t\.yaml: line 4, column 3: not valid YAML"):
        parse_quickly("a: [1,\n 2]\nb: 1\n c: :\n", where)


@pytest.mark.long
def test_the_command_writes_turbine_and_report(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    for arguments, status in (
        ([str(path), "--extra", str(EXTRA)], 0),
        ([str(tmp_path / "none.yaml")], 2),
        ([str(path), "--fixed-base"], 2),
    ):
        monkeypatch.setattr("sys.argv", ["meltemi", "import", *arguments, "--out", str(out)])
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == status
    said = capsys.readouterr()
    assert "min_pitch_table" in (out / "report.md").read_text(encoding="utf-8")
    assert meltemi.load_turbine(out / "turbine.yaml") == read_windio(path, EXTRA)
    assert f"next: meltemi run {out / 'turbine.yaml'}" in said.out
    assert "none.yaml" in said.err
    assert "--fixed-base is for OpenFAST decks" in said.err


@pytest.mark.long
def test_an_import_has_gains_of_its_own(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The library has gains of the same rule; those by similarity are for twice the frequency, without margins."""
    extra = {key: value for key, value in read_mapping(EXTRA).items() if key != "control"}
    similar = import_windio(path, extra)
    found = gains.with_tuned_gains(similar, {"torque.slip": 0.07})
    assert found.turbine.control.torque.slip == 0.07
    own, library = (t.control.pitch for t in (found.turbine, meltemi.load_turbine("iea15mw")))
    assert own.integral_gain == pytest.approx(library.integral_gain, rel=0.03)
    assert similar.turbine.control.pitch.integral_gain > 1.5 * own.integral_gain
    assert "0.172 rad/s" in next(note.why for note in found.notes if note.what == "pitch gains")

    def fails(turbine: meltemi.Turbine) -> None:
        raise InputError("no margins")

    monkeypatch.setattr(gains, "tune_baseline", fails)
    assert gains.with_tuned_gains(similar, {}).turbine == similar.turbine
    assert "margins unknown (no margins)" in str(gains.with_tuned_gains(similar, {}).notes)


def test_extra_numbers_of_the_drivetrain_are_checked_before_they_are_used(path: Path, tmp_path: Path) -> None:
    extra = tmp_path / "extra.yaml"
    for value in ("{a: 1}", "0.0"):
        extra.write_text(f"drivetrain: {{generator_efficiency: {value}}}\n", encoding="utf-8")
        with pytest.raises(InputError, match=r"drivetrain.generator_efficiency .* expected a positive number"):
            import_windio(path, extra)
