"""Bad frames get one sentence with the joint or member, and with file and line from a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meltemi import InputError, load_turbine
from meltemi.frames.definition import Foot, Frame, Member, Section
from meltemi.sea.soil import Sand, Soil
from meltemi.turbine.library import write_turbine

TUBE = {"tube": {"diameter": 1.0, "thickness": 0.02}}


def good() -> dict[str, Any]:
    return {
        "depth": 20.0,
        "joints": {"a": [0.0, 0.0, -20.0], "b": [0.0, 0.0, 0.0], "c": [0.0, 0.0, 10.0], "d": [5.0, 0.0, -20.0]},
        "sections": {
            "tube": {"diameter": 1.0, "thickness": 0.02},
            "box": {"kind": "rectangle", "width": 1.0, "height": 2.0},
        },
        "members": {name: {"joints": list(name), "section": "tube"} for name in ("ab", "bc", "bd")},
        "feet": [{"joint": "a"}, {"joint": "d"}],
        "interface": ["c"],
    }


def joints(**places: Any) -> Callable[[dict[str, Any]], None]:
    return lambda data: data["joints"].update(places)


def member(name: str, **fields: Any) -> Callable[[dict[str, Any]], None]:
    return lambda data: data["members"].setdefault(name, {"joints": list(name), "section": "tube"}).update(fields)


def fields(**values: Any) -> Callable[[dict[str, Any]], None]:
    return lambda data: data.update(values)


SOIL = {"layers": [{"kind": "sand", "top": 0.0, "friction_angle": 0.6, "weight": 1e4}]}
LAYER = {"thickness": 0.1, "density": 1100.0}


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (joints(c=[0, 0, 10000.0]), "joints.c: joint 'c' is at 10000 m; is it in mm"),
        (joints(c=[0.0, 10.0]), "joints.c: expected x, y, z"),
        (
            fields(sections={"tube": {"diameter": 1000.0, "thickness": 20.0}}),
            "sections.tube: section 'tube' is 1000 m wide; is it in mm",
        ),
        (joints(b=[0.0, 0.0, -20.0]), "members.ab: member 'ab' has no length: joints 'a' and 'b' are at one place"),
        (member("bb"), "members.bb: member 'bb' has no length"),
        (
            joints(e=[3.0, 3.0, 3.0]),
            "joints.e: joint 'e' hangs free: no members connect it with a foot or the interface",
        ),
        (joints(b2=[0.0, 0.0, 0.0]), "joints.b2: joint 'b2' hangs free"),
        (
            lambda data: (joints(e=[0.0, 0.0, 0.0])(data), member("ea")(data)),
            "joints.e: joints 'b' and 'e' are at one place and not connected",
        ),
        (
            member("ac", kind="spring", section="-", stiffness=np.eye(6).tolist()),
            "members.ac: member 'ac' is a spring between joints 30 m apart",
        ),
        (member("ac", kind="cable", section="-"), "members.ac: member 'ac' is a cable and needs axial_stiffness"),
        (
            member("ab", end_section="box"),
            "members.ab: member 'ab' has a section 'tube' and an end_section 'box' of another kind",
        ),
        (
            member("ab", flooded=True, filled_to=-3.0),
            "members.ab: member 'ab' is flooded and has filled_to: the sea fills a flooded member to its level; remove",
        ),
        (member("ab", section="tub"), "members.ab.section: section 'tub' is not there: did you mean 'tube'"),
        (member("ab", joints=["a", "bb"]), "members.ab.joints: joint 'bb' is not there: "),
        (
            fields(feet=[{"joint": "a", "soil": SOIL}]),
            "feet.0: a foot with soil needs pile_length and pile_section, a tube",
        ),
        (
            fields(feet=[{"joint": "a", "stiffness": [1.0, 2.0]}]),
            "feet.0.stiffness: expected 6 rows of 6 numbers, found 2",
        ),
        (
            fields(masses=[{"joint": "a", "mass": 1.0, "inertia": [1.0, 2.0]}]),
            "masses.0.inertia: expected 6 numbers, found 2",
        ),
        (fields(releases={"b": {"kind": "pin"}}), "releases.b: a pin joint needs axis, a direction of 3 numbers"),
        (
            fields(growth=[LAYER | {"bottom": -20.0, "top": -5.0}, LAYER | {"bottom": -6.0, "top": -2.0}]),
            "growth.1: growth from -6 m begins within that which ends at -5 m",
        ),
    ],
)
def test_bad_frames_are_refused(change: Callable[[dict[str, Any]], Any], sentence: str) -> None:
    data = good()
    Frame.model_validate(data)
    change(data)
    with pytest.raises(InputError) as refused:
        Frame.model_validate(data)
    assert str(refused.value).startswith(f"Frame: {sentence}") and "\n" not in str(refused.value)


def test_springs_and_links_connect_joints_at_one_place() -> None:
    for kind, more in (("spring", {"stiffness": np.eye(6).tolist()}), ("rigid", {})):
        data = good()
        joints(e=[0.0, 0.0, 0.0])(data)
        member("be", kind=kind, section="-", **more)(data)
        member("ed")(data)
        Frame.model_validate(data)
    soil = Soil(layers=[Sand(top=0.0, friction_angle=0.6, weight=1e4)])
    pile = Foot(joint="a", soil=soil, pile_length=20.0, pile_section="tube")
    Frame(
        depth=20.0,
        joints=good()["joints"],
        sections={"tube": Section(diameter=1.0)},
        interface=["c"],
        feet=[pile],
        members={name: Member(joints=(name[0], name[1]), section="tube") for name in ("ab", "bc", "bd")},
    )


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("A1", "[9.0, 9.0, 30.0]", "frame.joints.A1: joint 'A1' is at 30 m, above the tower's base at 20.15 m"),
        ("A1", "[9000.0, 9000.0, -43000.0]", "frame.joints.A1: joint 'A1' is at 43000 m; is it in mm"),
        ("interface", "[deckA, toppA]", "frame.interface: joint 'toppA' is not there: did you mean 'topA'"),
    ],
)
def test_the_file_and_the_line_are_named(tmp_path: Path, key: str, value: str, sentence: str) -> None:
    path = tmp_path / "jacket.yaml"
    write_turbine(load_turbine("nrel5mw-jacket"), path)
    lines = path.read_text().splitlines()
    line = next(i for i, text in enumerate(lines) if text.strip().startswith(f"{key}: ["))
    lines[line] = lines[line].split(":")[0] + f": {value}"
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=rf"jacket\.yaml:{line + 1}: {sentence}"):
        load_turbine(path)


def test_the_tower_stands_on_the_interface() -> None:
    tripod = load_turbine("nrel5mw-tripod")
    with pytest.raises(InputError, match="frame.interface: the interface is at 10 m, but tower.base_height is 12 m"):
        tripod.replace(**{"tower.base_height": 12.0})
