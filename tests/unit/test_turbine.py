"""Turbine descriptions: the library, files and back, and every rule of the records by its message."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meltemi.core.errors import InputError
from meltemi.core.yamlfile import validated
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import (
    DATA,
    library_entries,
    list_turbines,
    load_turbine,
    write_turbine,
)
from meltemi.turbine.windio_package import windio_file

Content = dict[str, Any]


def get(content: Content, path: str) -> Any:
    for key in path.split("."):
        content = content[key]
    return content


def put(path: str, value: Any) -> Callable[[Content], None]:
    """A change that sets one value; a function gets the present one."""

    def change(content: Content) -> None:
        *parents, last = path.split(".")
        target = get(content, ".".join(parents)) if parents else content
        target[last] = value(target[last]) if callable(value) else value

    return change


def drop(path: str) -> Callable[[Content], None]:
    def change(content: Content) -> None:
        *parents, last = path.split(".")
        del (get(content, ".".join(parents)) if parents else content)[last]

    return change


def at(i: int, value: float) -> Callable[[list[Any]], list[Any]]:
    """A list with entry ``i`` replaced."""

    def change(values: list[Any]) -> list[Any]:
        return [*values[:i], value, *values[i:][1:]]

    return change


def refused(turbine: Turbine, *changes: Callable[[Content], None]) -> str:
    """The message for the turbine with some changes."""
    content = turbine.content()
    for change in changes:
        change(content)
    with pytest.raises(InputError) as caught:
        validated(content, Turbine, "t.yaml")
    return str(caught.value)


def test_the_library_lists_its_turbines() -> None:
    at_sea = ["iea15mw-monopile", "iea22mw-monopile", "nrel5mw-jacket", "nrel5mw-monopile", "nrel5mw-tripod"]
    at_sea += ["iea15mw-volturnus", "iea15mw-volturnus-flexible", "iea22mw-semi", "iea22mw-semi-flexible"]
    at_sea += ["nrel5mw-spar"]
    with_blades = sorted(["ct30-155", "iea10mw", "iea15mw", "iea22mw", "nrel5mw", "nrel5mw-offsets", *at_sea])
    assert list_turbines() == [*with_blades, "pmsg20mw", "pmsg20mw-bem", "zr20-122"]
    assert {entry.file for entry in library_entries().values()} == {p.name for p in DATA.glob("*.yaml")} - {
        "library.yaml"
    }


@pytest.mark.slow
@pytest.mark.parametrize("name", list_turbines())
def test_the_table_of_the_library_says_what_the_turbines_say(name: str) -> None:
    turbine, entry = load_turbine(name), library_entries()[name]
    assert turbine.rated_power == entry.rated_power
    assert turbine.rotor_diameter == pytest.approx(entry.rotor_diameter, abs=0.01)
    assert turbine.hub_height == pytest.approx(entry.hub_height, abs=0.01)


def test_a_variant_changes_only_what_its_file_has() -> None:
    base, variant = load_turbine("nrel5mw"), load_turbine("nrel5mw-offsets")
    assert base.blade.structure.mass_centre_y is None
    assert variant.blade.structure.mass_centre_y is not None
    structure = variant.blade.structure.replace(mass_centre_y=None)
    blade = variant.blade.replace(structure=structure, source=base.blade.source)
    told = {name: getattr(base, name) for name in ("name", "description", "source")}
    assert variant.replace(blade=blade, **told) == base


def test_a_turbine_whose_data_are_not_installed_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("meltemi.core.extras.installed", lambda name: False)
    with pytest.raises(InputError, match=r"iea15mw needs windIO, which is not.*: pip install 'windIO>=2\.1,<3'"):
        windio_file("IEA-15-240-RWT.yaml", "iea15mw")
    monkeypatch.undo()
    with pytest.raises(InputError, match=r"has no windIO/examples/turbine/IEA-16\.yaml"):
        windio_file("IEA-16.yaml", "iea16mw")


@pytest.mark.parametrize("name", list_turbines())
def test_every_turbine_of_the_library_is_valid_and_named_like_its_file(name: str) -> None:
    turbine = load_turbine(name)
    assert turbine.name == name
    assert turbine.description
    assert turbine.source


def test_the_reference_turbine_has_the_published_dimensions(turbine: Turbine) -> None:
    # NREL/TP-500-38060, tables 1-1, 4-1, 5-1 and 6-1
    assert turbine.rotor_radius == pytest.approx(63.0, abs=1e-9)
    assert turbine.hub_height == pytest.approx(90.0, abs=5e-4)  # overhang and shaft height have six digits
    assert turbine.rated_power == 5e6
    assert (turbine.cut_in, turbine.cut_out) == (3.0, 25.0)
    assert turbine.drivetrain.gear_ratio == 97.0
    assert turbine.tower.length == pytest.approx(87.6, abs=1e-9)
    s = turbine.blade.structure
    assert s.mass is not None
    # 17 740 kg in the report's table of the whole blade; its stations are trapezes
    assert np.trapezoid(s.mass, s.position) == pytest.approx(17740.0, rel=0.01)


@pytest.mark.long
@pytest.mark.parametrize("name", ["nrel5mw", "iea15mw"])
def test_written_and_read_back_a_turbine_is_equal(name: str, tmp_path: Path) -> None:
    turbine = load_turbine(name)
    write_turbine(turbine, tmp_path / "copy.yaml")
    copy = load_turbine(tmp_path / "copy.yaml")
    assert copy == turbine
    assert copy.content_hash() == turbine.content_hash()
    assert copy.name == name


def test_a_changed_turbine_survives_a_file_too(turbine: Turbine, tmp_path: Path) -> None:
    K = np.diag([1e9, 1e9, 2e9, 3e11, 3e11, 1e11])
    changed = turbine.replace(
        name="soft ground", foundation={"stiffness": K.tolist(), "mass": 1e5}, **{"hub.precone": -0.01}
    )
    write_turbine(changed, tmp_path / "soft.yml")
    again = load_turbine(str(tmp_path / "soft.yml"))
    assert again == changed
    assert again.foundation is not None
    np.testing.assert_array_equal(again.foundation.stiffness, K)


def test_a_misspelt_name_gets_the_closest() -> None:
    with pytest.raises(InputError, match=r"no turbine 'nrel5wm' in the library: did you mean 'nrel5mw' .*\.yaml file"):
        load_turbine("nrel5wm")


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"missing\.yaml: no such file"):
        load_turbine(tmp_path / "missing.yaml")


def test_an_invalid_file_is_refused_with_file_line_and_key(tmp_path: Path) -> None:
    text = (DATA / "nrel5mw.yaml").read_text(encoding="utf-8")
    assert "mass: 240000.0" in text
    (tmp_path / "t.yaml").write_text(text.replace("mass: 240000.0", "mass: -1.0"), encoding="utf-8")
    line = 1 + text[: text.index("mass: 240000.0")].count("\n")
    with pytest.raises(InputError) as caught:
        load_turbine(tmp_path / "t.yaml")
    assert str(caught.value).startswith(
        f"{tmp_path / 't.yaml'}:{line}: nacelle.mass: expected greater than or equal to 0, found -1"
    )


AERO, STRUCTURE = "blade.aerodynamics", "blade.structure"


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        # stations
        (put(f"{AERO}.position", at(3, 1.0)), f"{AERO}: position must increase from station to station, but station"),
        (put(f"{STRUCTURE}.position", at(1, 0.0)), f"{STRUCTURE}: position must increase from station to station"),
        (put("tower.position", at(-1, 1.0)), "tower: position must increase from station to station"),
        (put(f"{AERO}.position", [0.0]), f"{AERO}: position: at least two stations are needed"),
        (put("tower.position", []), "tower: position: at least two stations are needed"),
        (put("tower.position", [[0.0, 1.0]]), "tower.position: expected a list of numbers, found lists in a list"),
        (
            put(f"{AERO}.position", at(0, 0.5)),
            "blade: position must begin with 0 (the blade root), but begins with 0.5 m",
        ),
        (put(f"{STRUCTURE}.position", at(0, -1.0)), "blade: position must begin with 0 (the blade root)"),
        (
            put("tower.position", at(0, 0.5)),
            "tower: position must begin with 0 (the tower base), but begins with 0.5 m",
        ),
        # lengths of lists
        (put(f"{AERO}.chord", lambda c: c[:-1]), f"{AERO}: chord has 18 entries, but position has 19"),
        (put(f"{AERO}.twist", lambda c: [*c, 0.0]), f"{AERO}: twist has 20 entries, but position has 19"),
        (put(f"{AERO}.airfoil", lambda c: c[1:]), f"{AERO}: airfoil has 18 entries, but position has 19"),
        (put(f"{AERO}.centre_x", [0.0]), f"{AERO}: centre_x has 1 entries, but position has 19"),
        (put(f"{STRUCTURE}.mass", lambda c: c[:-2]), f"{STRUCTURE}: mass has 47 entries, but position has 49"),
        (put(f"{STRUCTURE}.flap_inertia", lambda c: c[:-1]), "flap_inertia has 48 entries, but position has 49"),
        (put(f"{STRUCTURE}.mass_centre_y", [0.0]), "mass_centre_y has 1 entries, but position has 49"),
        (put(f"{STRUCTURE}.axis_x", [0.0, 1.0]), "axis_x has 2 entries, but position has 49"),
        (put("tower.diameter", [6.0, 4.0]), "tower: diameter has 2 entries, but position has 11"),
        # numbers
        (
            put(f"{AERO}.chord", at(2, float("nan"))),
            f"{AERO}.chord: every entry must be a finite number; not so at entry 3",
        ),
        (put("tower.mass", at(0, float("inf"))), "tower.mass: every entry must be a finite number; not so at entry 1"),
        (put("hub.mass", float("nan")), "hub.mass: expected a finite number, found nan"),
        (put("hub.mass", "heavy"), "hub.mass: expected a number"),
        (put(f"{AERO}.chord", "wide"), f"{AERO}.chord: expected numbers in a regular (rectangular) list"),
        # positive
        (put(f"{AERO}.chord", at(4, 0.0)), f"{AERO}: chord must be positive, but entry 5 is 0"),
        (put(f"{STRUCTURE}.mass", at(7, -3.0)), f"{STRUCTURE}: mass must be positive, but entry 8 is -3"),
        (put(f"{STRUCTURE}.flap_stiffness", at(0, 0.0)), "flap_stiffness must be positive, but entry 1 is 0"),
        (put(f"{STRUCTURE}.torsion_stiffness", at(1, -1.0)), "torsion_stiffness must be positive, but entry 2 is -1"),
        (put(f"{STRUCTURE}.edge_inertia", at(1, -1.0)), "edge_inertia must be zero or positive, but entry 2 is -1"),
        (put("tower.mass", at(1, -3.0)), "tower: mass must be positive, but entry 2 is -3"),
        (put("tower.fore_aft_stiffness", at(1, 0.0)), "fore_aft_stiffness must be positive, but entry 2 is 0"),
        (put("nacelle.mass", -1.0), "nacelle.mass: expected greater than or equal to 0, found -1"),
        (put("hub.radius", 0.0), "hub.radius: expected greater than 0, found 0"),
        (put("drivetrain.gear_ratio", 0.0), "drivetrain.gear_ratio: expected greater than 0"),
        (
            put("drivetrain.generator_efficiency", 1.2),
            "drivetrain.generator_efficiency: expected less than or equal to 1",
        ),
        (put("yaw.stiffness", 0.0), "yaw.stiffness: expected greater than 0"),
        (put("rated_power", -5e6), "rated_power: expected greater than 0"),
        (put(f"{STRUCTURE}.damping.flap", 1.0), f"{STRUCTURE}.damping.flap: expected less than 1"),
        (put("n_blades", 0), "n_blades: expected greater than or equal to 1"),
        # degrees
        (
            put(f"{AERO}.twist", at(0, 13.308)),
            f"{AERO}: twist is in radians and expected within +-1.60, but entry 1 is 13.308; "
            "if these are degrees, multiply by pi/180 = 0.01745329",
        ),
        (
            put(f"{STRUCTURE}.twist", at(5, -13.3)),
            f"{STRUCTURE}: twist is in radians and expected within +-1.60, but entry 6",
        ),
        (put("hub.precone", 2.5), "hub.precone: expected less than 0.6"),
        (put("nacelle.tilt", 5.0), "nacelle.tilt: expected less than 0.6"),
        (put("pitch_actuator.maximum", 90.0), "pitch_actuator.maximum: expected less than 3.2"),
        (put("pitch_actuator.rate_limit", 8.0), "pitch_actuator.rate_limit: expected less than or equal to 2"),
        (put("control.pitch.rate_limit", 8.0), "control.pitch.rate_limit: expected less than or equal to 2"),
        (put("yaw.rate", 0.3), "yaw.rate: expected less than 0.2"),
        (
            put("airfoils.du40.angle_of_attack", lambda a: np.degrees(a).tolist()),
            "airfoils.du40: angle_of_attack must cover -pi to pi (+-180 degrees), but goes from -180 to 180 rad; "
            "the values look like degrees, multiply by pi/180",
        ),
        # airfoils
        (
            put(f"{AERO}.airfoil", at(4, "du41")),
            "blade.aerodynamics.airfoil station 5 names 'du41', which is not among",
        ),
        (put("airfoils", {}), "airfoils: at least one airfoil is needed"),
        (drop("airfoils.naca64"), "which is not among the airfoils: "),
        (put("airfoils.du40.angle_of_attack", at(0, -2.9)), "airfoils.du40: angle_of_attack must increase"),
        (
            put("airfoils.cylinder1.angle_of_attack", [-3.0, 0.0, 3.0]),
            "airfoils.cylinder1: angle_of_attack must cover -pi to pi (+-180 degrees), but goes from -3 to 3 rad",
        ),
        (put("airfoils.du40.angle_of_attack", at(5, -2.5)), "airfoils.du40: angle_of_attack must increase"),
        (
            put("airfoils.du40.lift", lambda c: c[:-1]),
            "airfoils.du40: lift has 135 entries, but angle_of_attack has 136",
        ),
        (put("airfoils.du40.moment", at(3, 11.0)), "airfoils.du40: moment has a coefficient beyond +-10"),
        (put("airfoils.du40.drag", at(3, float("nan"))), "airfoils.du40.drag: every entry must be a finite number"),
        # what belongs together
        (
            put(f"{STRUCTURE}.position", at(-1, 70.0)),
            "blade: the blade is 61.5 m long in aerodynamics.position, but 70 m in structure.position",
        ),
        (put("cut_in", 25.0), "cut_in 25 m/s must be less than cut_out 25 m/s"),
        (put("hub.radius", 40.0), "the blade tips reach the ground: hub at 90 m, rotor radius 101.5 m"),
        (put("nacelle.yaw_inertia", 1e5), "nacelle: yaw_inertia 100000 is less than mass times its distance"),
        (put("pitch_actuator.minimum", 1.58), "pitch_actuator: minimum 1.58 must be less than maximum 1.5708"),
        (put("control.torque.cut_in_speed", 95.0), "control.torque: speeds must satisfy cut_in_speed < optimal_speed"),
        (put("control.torque.rated_speed", 90.0), "control.torque: speeds must satisfy cut_in_speed < optimal_speed"),
        # keys
        (put("towr", {}), "towr: unknown key; did you mean 'tower'"),
        (put("hub.mas", 1.0), "hub.mas: unknown key; did you mean 'mass'"),
        (drop("hub.mass"), "hub.mass: missing ([kg; 2.5e3 to 1.2e5 at 100 m] mass.)"),
        (drop("drivetrain"), "drivetrain: missing"),
        (drop(f"{STRUCTURE}.mass"), f"{STRUCTURE}: mass missing (or give stiffness_matrix and mass_matrix)"),
        (put("pitch_actuator.kind", "first_order"), "pitch_actuator.kind: expected 'second_order' or 'ideal', found"),
    ],
)
def test_a_rule_is_kept_and_its_message_names_file_key_and_expectation(
    turbine: Turbine, change: Callable[[Content], None], expected: str
) -> None:
    message = refused(turbine, change)
    assert message.startswith("t.yaml: ")
    assert expected in message


@pytest.mark.parametrize(
    "path", [f"{AERO}.chord", f"{STRUCTURE}.mass", "tower.mass", "airfoils.du40.angle_of_attack", "airfoils.du40.lift"]
)
def test_a_number_where_a_list_is_expected_is_refused(turbine: Turbine, path: str) -> None:
    assert path.rsplit(".", 1)[0] in refused(turbine, put(path, 3.0))


@pytest.mark.parametrize(
    "path", [f"{AERO}.chord", f"{AERO}.twist", f"{STRUCTURE}.mass", "tower.mass", "airfoils.du40.lift"]
)
def test_nested_lists_are_refused(turbine: Turbine, path: str) -> None:
    assert path.rsplit(".", 1)[0] in refused(turbine, put(path, lambda values: [[v, v] for v in values]))


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
@pytest.mark.parametrize("path", ["nacelle.overhang", "hub.mass_centre", "tower.base_height"])
def test_numbers_must_be_finite(turbine: Turbine, path: str, value: float) -> None:
    assert path in refused(turbine, put(path, value))


def test_pitch_limits_of_the_controller_must_be_in_order(turbine: Turbine) -> None:
    message = refused(turbine, put("control.pitch.minimum", 1.0), put("control.pitch.maximum", 0.5))
    assert "control.pitch: minimum 1 must be less than maximum 0.5" in message


def test_what_differs_in_the_last_digit_only_is_no_disagreement(turbine: Turbine) -> None:
    content = turbine.content()
    put(f"{STRUCTURE}.position", at(-1, 61.5 * (1.0 + 5e-4)))(content)
    assert validated(content, Turbine, "t.yaml").blade.length == 61.5


MATRIX = np.diag([1e9, 1e9, 2e9, 3e9, 4e9, 1e9])
N = 3


def with_matrices(**changes: Any) -> Callable[[Content], None]:
    """The blade's structure by matrices, with some changes."""

    def change(content: Content) -> None:
        structure = {
            "position": [0.0, 30.0, 61.5],
            "twist": [0.2, 0.1, 0.0],
            "stiffness_matrix": np.stack([MATRIX] * N).tolist(),
            "mass_matrix": np.stack([np.diag([100.0, 100.0, 100.0, 5.0, 5.0, 10.0])] * N).tolist(),
            "damping": {},
        }
        for name, value in changes.items():
            structure[name] = value(np.array(structure[name])).tolist() if callable(value) else value
        content["blade"]["structure"] = {k: v for k, v in structure.items() if v is not None}

    return change


def entry(station: int, row: int, column: int, value: float) -> Callable[[Any], Any]:
    def change(matrices: Any) -> Any:
        matrices[station, row, column] = value
        return matrices

    return change


def test_a_blade_may_be_described_by_matrices(turbine: Turbine, tmp_path: Path) -> None:
    content = turbine.content()
    with_matrices()(content)
    blade = validated(content, Turbine, "t.yaml")
    write_turbine(blade, tmp_path / "t.yaml")
    assert load_turbine(tmp_path / "t.yaml") == blade


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"stiffness_matrix": entry(1, 3, 4, 1e8)}, "stiffness_matrix must be symmetric at every station"),
        ({"mass_matrix": entry(2, 0, 4, 50.0)}, "mass_matrix must be symmetric at every station"),
        (
            {"stiffness_matrix": entry(1, 2, 2, -2e9)},
            "stiffness_matrix must be positive definite, but is not at station 2",
        ),
        ({"mass_matrix": entry(2, 5, 5, 0.0)}, "mass_matrix must be positive definite, but is not at station 3"),
        ({"stiffness_matrix": lambda K: K[:2]}, "stiffness_matrix must have shape (3, 6, 6), but has (2, 6, 6)"),
        ({"mass_matrix": lambda K: K[:, :5, :5]}, "mass_matrix must have shape (3, 6, 6), but has (3, 5, 5)"),
        ({"mass_matrix": None}, "stiffness_matrix is given, so mass_matrix is needed too"),
        ({"mass": [1.0, 1.0, 1.0]}, "give either classical properties or 6 x 6 matrices, not both"),
        ({"torsion_stiffness": [1.0, 1.0, 1.0]}, "give either classical properties or 6 x 6 matrices, not both"),
    ],
)
def test_section_matrices_are_checked(turbine: Turbine, changes: dict[str, Any], expected: str) -> None:
    assert f"{STRUCTURE}: {expected}" in refused(turbine, with_matrices(**changes))


@pytest.mark.parametrize(
    ("stiffness", "expected"),
    [
        (np.eye(5), "foundation: stiffness must have shape (6, 6), but has (5, 5)"),
        (np.diag([1.0, 1.0, 1.0, 1.0, 1.0, -1.0]), "foundation: stiffness must be symmetric and positive definite"),
        (np.eye(6) + np.eye(6, k=1), "foundation: stiffness must be symmetric and positive definite"),
        (np.diag([1.0, 1.0, 1.0, 1.0, 1.0, 0.0]), "foundation: stiffness must be symmetric and positive definite"),
    ],
)
def test_foundation_springs_are_checked(turbine: Turbine, stiffness: Any, expected: str) -> None:
    assert expected in refused(turbine, put("foundation", {"stiffness": stiffness.tolist()}))


def test_mode_shapes_are_part_of_the_description(turbine: Turbine, tmp_path: Path) -> None:
    content = turbine.content()
    content["tower"]["mode_shapes"] = {"fore_aft": [[0.7, 2.2, -5.6, 6.2, -2.5]]}
    described = validated(content, Turbine, "t.yaml")
    write_turbine(described, tmp_path / "t.yaml")
    again = load_turbine(tmp_path / "t.yaml")
    assert again.tower.mode_shapes is not None
    assert again.tower.mode_shapes.fore_aft == ((0.7, 2.2, -5.6, 6.2, -2.5),)
