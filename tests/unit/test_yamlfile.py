"""Records from YAML files and back: every message names file, line, key, expectation and remedy."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field, model_validator
from ruamel.yaml import YAML

from meltemi.cases.case import read_case
from meltemi.core.errors import InputError
from meltemi.core.record import Array, Record
from meltemi.core.yamlfile import parse, read_record, validated, write_record


class Part(Record):
    length: float = Field(gt=0.0)
    """[m] from end to end."""
    weights: Array = Field(default_factory=lambda: np.ones(2))
    kind: Literal["thin", "thick"] = "thin"

    @model_validator(mode="after")
    def _check(self) -> Part:
        if self.weights.sum() > 100.0:
            raise ValueError("weights must not sum to more than 100")
        return self


class Paint(Record):
    dry: bool = True
    thickness: float = Field(default=0.1, gt=0.0, lt=1.0)
    finish: Literal["gloss", "matt"] = "matt"


class Machine(Record):
    name: str
    count: int = Field(default=1, ge=1)
    main: Part
    paint: Paint = Paint()
    parts: tuple[Part, ...] = ()
    named: dict[str, Part] = Field(default_factory=dict)


def read(folder: Path, text: str) -> Machine:
    path = folder / "machine.yaml"
    path.write_text(text, encoding="utf-8")
    return read_record(path, Machine)


def message(folder: Path, text: str) -> str:
    with pytest.raises(InputError) as caught:
        read(folder, text)
    return str(caught.value).replace(str(folder / "machine.yaml"), "FILE")


GOOD = """\
# a machine
name: lathe
count: 2
main:
  length: 2.5
  weights: [1, 2, 3]
parts:
  - length: 1.0
  - length: 2.0
    kind: thick
named:
  left: {length: 4}
"""


def test_a_good_file_is_read(tmp_path: Path) -> None:
    machine = read(tmp_path, GOOD)
    assert machine.name == "lathe"
    assert [p.length for p in machine.parts] == [1.0, 2.0]
    assert machine.parts[1].kind == "thick"
    assert machine.named["left"].length == 4.0
    np.testing.assert_array_equal(machine.main.weights, [1.0, 2.0, 3.0])


def test_the_path_may_be_text(tmp_path: Path) -> None:
    read(tmp_path, GOOD)
    assert read_record(str(tmp_path / "machine.yaml"), Machine).name == "lathe"


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("count: 2", "cuont: 2", "FILE:3: cuont: unknown key; did you mean 'count'?"),
        ("  length: 2.5", "  lenght: 2.5", "FILE:5: main.lenght: unknown key; did you mean 'length'"),
        ("    kind: thick", "    knid: thick", "FILE:10: parts.1.knid: unknown key"),
        ("  length: 2.5", "  length: -2.5", "FILE:5: main.length: expected greater than 0, found -2.5 m"),
        (
            "  length: 2.5",
            "  length: wide",
            "FILE:5: main.length: expected a number, unable to parse string as a number",
        ),
        ("count: 2", "count: 2.5", "FILE:3: count: expected a"),
        ("  weights: [1, 2, 3]", "  weights: [1, .nan]", "FILE:6: main.weights: every entry must be a finite number"),
        ("  weights: [1, 2, 3]", "  weights: [[1], 2]", "FILE:6: main.weights: expected numbers in a regular"),
        ("  weights: [1, 2, 3]", "  weights: [99, 2]", "FILE:4: main: weights must not sum to more than 100"),
        (
            "    kind: thick",
            "    kind: thicc",
            "FILE:10: parts.1.kind: expected 'thin' or 'thick', found 'thicc'; did you",
        ),
        ("    kind: thick", "    kind: xyz", "FILE:10: parts.1.kind: expected 'thin' or 'thick', found 'xyz'"),
        ("name: lathe\n", "", "FILE: name: missing"),
        ("  length: 2.5\n", "", "FILE:4: main.length: missing"),
        (
            "main:\n  length: 2.5\n  weights: [1, 2, 3]",
            "main: 3",
            "FILE:4: main: expected keys and values, for instance {length: 3}, found 3",
        ),
        (
            "count: 2\n",
            "paint: gloss\n",
            "FILE:3: paint: expected keys and values, for instance {finish: gloss}, found",
        ),
        (
            "count: 2\n",
            "paint: 0.2\n",
            "FILE:3: paint: expected keys and values, for instance {thickness: 0.2}, found 0.2",
        ),
        ("count: 2\n", "paint: 9\n", "FILE:3: paint: expected keys and values (dry, thickness, finish), found 9"),
        ("count: 2\n", "paint:\n", "FILE:3: paint: expected keys and values (dry, thickness, finish), found nothing"),
        (
            "parts:\n  - length: 1.0\n  - length: 2.0\n    kind: thick",
            "parts: one",
            "FILE:7: parts: expected a list, found",
        ),
        ("parts:\n  - length: 1.0", "parts:\n  - 1.0\n  - length: 1.0", "FILE:8: parts.0: "),
        ("parts:\n  - length: 1.0", "parts:\n  - thick\n  - length: 1.0", "such as {length: ...}, found 'thick'"),
        ("name: lathe", "name: [1]", "FILE:2: name: expected a string, found [1]"),
    ],
)
def test_a_mistake_is_named_with_file_line_and_key(tmp_path: Path, old: str, new: str, expected: str) -> None:
    assert old in GOOD
    assert expected in message(tmp_path, GOOD.replace(old, new, 1))


@pytest.mark.parametrize(
    ("old", "new"), [("    kind: thick", "    knid: thick"), ("{length: 4}", "{length: 4, knid: thick}")]
)
def test_a_misspelt_key_in_a_collection_of_records_gets_the_closest(tmp_path: Path, old: str, new: str) -> None:
    assert "knid: unknown key; did you mean 'kind'?" in message(tmp_path, GOOD.replace(old, new, 1))


def test_a_missing_key_is_explained(tmp_path: Path) -> None:
    text = message(tmp_path, "name: lathe\nmain: {kind: thick}\n")
    assert text == "FILE:2: main.length: missing ([m] from end to end.)"


def test_all_mistakes_are_listed_one_a_line(tmp_path: Path) -> None:
    text = message(tmp_path, GOOD.replace("count: 2", "count: 0").replace("length: 4", "length: 0"))
    assert text.splitlines() == [
        "FILE:3: count: expected greater than or equal to 1, found 0",
        "FILE:12: named.left.length: expected greater than 0, found 0 m",
    ]


def test_long_values_are_shortened(tmp_path: Path) -> None:
    text = message(tmp_path, GOOD.replace("count: 2", f"count: {'x' * 200}"))
    assert "..." in text
    assert len(text) < 200


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "FILE: expected keys and values (a Machine), found NoneType"),
        ("# only a comment\n", "expected keys and values (a Machine)"),
        ("- 1\n- 2\n", "FILE: expected keys and values (a Machine), found list"),
        ("just words\n", "FILE: expected keys and values (a Machine), found str"),
        ("name: a\nname: b\n", "FILE: line 2, column 1: not valid YAML: found duplicate key"),
        ("name: [1, 2\n", "not valid YAML"),
        ("name: a\n\tcount: 2\n", "FILE: line 2, column 1: not valid YAML"),
        ("name: *nothing\n", "FILE: line 1, column 7: not valid YAML: found undefined alias"),
        ("name: !thing 3\n", "FILE: line 1, column 7: not valid YAML"),
        ("name: a\n---\nname: b\n", "not valid YAML"),
        ("name: \x01\n", "not valid YAML"),
        ("1: a\n2: b\n", "Keys should be strings, found 1"),
        ("? [a, b]\n: c\n", "FILE"),
    ],
)
def test_what_is_not_a_mapping_of_valid_yaml(tmp_path: Path, text: str, expected: str) -> None:
    found = message(tmp_path, text)
    assert expected in found
    assert found.startswith("FILE")


@pytest.mark.filterwarnings("error")
def test_an_anchor_may_be_set_twice(tmp_path: Path) -> None:
    text = GOOD.replace("name: lathe", "name: &a lathe").replace("count: 2", "count: &a 0")
    assert "count: expected greater than" in message(tmp_path, text)


def test_missing_file_names_one_that_looks_like_it(tmp_path: Path) -> None:
    read(tmp_path, GOOD)
    with pytest.raises(InputError, match=r"machin\.yaml: no such file; did you mean 'machine\.yaml'"):
        read_record(tmp_path / "machin.yaml", Machine)


def test_missing_file_without_a_similar_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"zzz\.yaml: no such file$"):
        read_record(tmp_path / "zzz.yaml", Machine)


def test_missing_folder_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no such file \(the folder .*nowhere does not exist either\)"):
        read_record(tmp_path / "nowhere" / "a.yaml", Machine)


def test_a_folder_is_not_a_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="it is a folder, expected a file"):
        read_record(tmp_path, Machine)


def test_other_encodings_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "latin.yaml"
    path.write_bytes("name: Grüße\n".encode("latin-1"))
    with pytest.raises(InputError, match=r"latin\.yaml: cannot be read as UTF-8 text"):
        read_record(path, Machine)


def test_comments_about_a_wrong_value_do_no_harm(tmp_path: Path) -> None:
    """Where a list became a text over several lines, with comments before and after it."""
    path = tmp_path / "case.yaml"
    text = (
        "turbine: nrel5mw\nwind: {kind: steady, speed: 8.0}\nduration: 1.0\nchannels:    # some\n  -a\n  -b\n\n# end\n"
    )
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"case\.yaml:4: channels: expected a list"):
        read_case(path)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("a: 010\nb: yes\nc: 1_000\nd: 0o17\ne: 1e5\nf: .inf\ng: ~\nh: 0x1F\ni: q#r\n", None),
        ("%YAML 1.1\n---\na: 010\nb: yes\n", {"a": 8, "b": True}),
        ("{a:1, b: [c:d]}", {"a:1": None, "b": ["c:d"]}),  # which the parser in C refuses
        ("a: &x [1]\nb: *x\n? c\n: >\n  fold\n  ed\nd: 'it''s'\n", None),
    ],
)
def test_both_parsers_find_the_same(text: str, found: dict[str, Any] | None) -> None:
    assert parse(text, Path("a.yaml")) == (found or YAML(typ="safe", pure=True).load(text))


@pytest.mark.slow
def test_deep_nesting_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        read(tmp_path, "name: " + "[" * 3000 + "]" * 3000)


def test_plain_data_is_validated_with_its_origin() -> None:
    with pytest.raises(InputError, match="^command line: main.length: expected greater than 0, found 0"):
        validated({"name": "a", "main": {"length": 0}}, Machine, "command line")


names = st.text(st.characters(codec="utf-8", exclude_categories=["Cs", "Cc"]), max_size=12)
numbers = st.floats(allow_nan=False, allow_infinity=False)
lengths = st.floats(min_value=0.0, exclude_min=True, max_value=1e50)
parts = st.builds(
    Part,
    length=lengths,
    weights=st.lists(st.floats(min_value=-1e50, max_value=20.0), min_size=1, max_size=4),
    kind=st.sampled_from(["thin", "thick"]),
)


@pytest.mark.slow
@settings(derandomize=True, deadline=None, max_examples=60)
@given(
    machine=st.builds(
        Machine,
        name=names,
        count=st.integers(min_value=1, max_value=10**18),
        main=parts,
        parts=st.lists(parts, max_size=2).map(tuple),
        named=st.dictionaries(names, parts, max_size=2),
    )
)
def test_what_is_written_is_read_back_equal(tmp_path_factory: pytest.TempPathFactory, machine: Machine) -> None:
    path = tmp_path_factory.getbasetemp() / "round_trip.yaml"
    write_record(machine, path)
    again = read_record(path, Machine)
    assert again == machine
    assert again.content_hash() == machine.content_hash()


@pytest.mark.parametrize("word", ["yes", "null", "1e3", "0x1F", "1:30", "~", "", " a ", "a: b", "# c", "'", "- x", "é"])
def test_text_that_looks_like_something_else_survives(tmp_path: Path, word: str) -> None:
    machine = Machine(name=word, main=Part(length=1.0))
    write_record(machine, tmp_path / "a.yaml")
    assert read_record(tmp_path / "a.yaml", Machine).name == word


@pytest.mark.parametrize("number", [5e6, 1e-300, 0.1, 1.0 / 3.0, 1e22, 123456789.123456789, 2.0**-1074])
def test_numbers_survive_to_the_last_digit(tmp_path: Path, number: float) -> None:
    machine = Machine(name="a", main=Part(length=number))
    write_record(machine, tmp_path / "a.yaml")
    assert read_record(tmp_path / "a.yaml", Machine).main.length == number
