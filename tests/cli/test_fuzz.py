"""Case and turbine files damaged by machine: the loader accepts them or raises InputError, nothing else."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from copy import deepcopy
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

import meltemi
from meltemi import InputError, MeltemiError, ModelOptions, Turbine
from meltemi.core.record import Record
from meltemi.core.yamlfile import read_record, validated, write_record
from meltemi.io import LoadCase

Content = dict[str, Any]
TEMPLATE = files("meltemi.cases").joinpath("template.yaml").read_text(encoding="utf-8")


def fuzz(examples: int) -> settings:
    return settings(derandomize=True, deadline=None, max_examples=examples, database=None)


def thinned(values: Any, n: int) -> Any:
    """At most ``n`` entries of a list, first and last among them."""
    if not isinstance(values, list):
        return values
    return [values[i] for i in sorted(set(np.linspace(0, len(values) - 1, n).astype(int)))]


def small_turbine() -> Content:
    """The reference turbine with few stations and rough polars: quick to write, read and build."""
    content = meltemi.load_turbine("nrel5mw").model_dump(mode="json", exclude_none=True)
    blade, polars = content["blade"], content["airfoils"].values()
    for part, n in (*((p, 5) for p in (*blade.values(), content["tower"]) if p), *((p, 9) for p in polars)):
        if isinstance(part, dict):
            part.update({name: thinned(values, n) for name, values in part.items()})
    return content


TURBINE: Content = small_turbine()
EVENTS = [
    {"at": 40.0, "type": "pitch_stuck", "blade": 2, "until": 50.0},
    {"at": 30.0, "type": "sensor_loss", "sensor": "pitch_1", "holds": "zero"},
    {"at": 50.0, "type": "request", "request": "normal_stop"},
]
CASE: Content = YAML(typ="safe").load(TEMPLATE) | {"events": EVENTS}
KINDS: dict[str, tuple[type[Record], Content]] = {"turbine": (Turbine, TURBINE), "case": (LoadCase, CASE)}
whats = st.sampled_from(list(KINDS))


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("fuzz") / "file.yaml"


# damage

Place = tuple[Any, ...]
texts = st.text(max_size=6)
junk = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | texts
    | st.sampled_from([0, -1, 1e300, -1e300, 10**400, "nan", "1e3", "yes", "nrel5mw"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(texts | st.integers() | st.none(), inner, max_size=3),
    max_leaves=6,
)


def places(content: Any, here: Place = ()) -> Iterator[Place]:
    """All keys and entries in nested dictionaries and lists."""
    entries = content.items() if isinstance(content, dict) else enumerate(content) if isinstance(content, list) else ()
    for key, value in entries:
        yield (*here, key)
        yield from places(value, (*here, key))


def holder(content: Any, place: Place) -> Any:
    for key in place[:-1]:
        content = content[key]
    return content


@st.composite
def damaged(draw: Callable[[Any], Any], content: Content) -> Content:
    """One to four keys or entries deleted, renamed, doubled, emptied or replaced by something else."""
    content = deepcopy(content)
    for _ in range(draw(st.integers(1, 4))):
        found = list(places(content))
        if not found:
            break
        place = found[draw(st.integers(0, len(found) - 1))]
        inside, key = holder(content, place), place[-1]
        hows = ["delete", "rename", "double", "nest", *4 * ["scale"], "replace", "replace"]
        how = draw(st.sampled_from(hows))
        if how == "delete":
            del inside[key]
        elif how == "rename" and isinstance(inside, dict):
            inside[draw(st.sampled_from([f"{key}s", str(key)[1:], None, 3]) | texts)] = inside.pop(key)
        elif how == "double" and isinstance(inside, list):
            inside.insert(key, inside[key])
        elif how == "nest":
            inside[key] = [inside[key]]
        elif how == "scale" and isinstance(inside[key], int | float) and abs(inside[key]) < 1e300:
            inside[key] *= draw(st.floats(0.9, 1.1))
        else:
            inside[key] = draw(junk)
    return content


def loaded(load: Callable[[], Any], where: str) -> Any:
    """What loads, or None if it is refused; then the message begins with the place."""
    try:
        return load()
    except InputError as error:
        message = str(error)
    assert message.startswith(where)
    return None


@pytest.mark.long
@fuzz(1000)
@given(data=st.data(), what=whats)
def test_damaged_content_is_refused_in_words_or_valid(path: Path, data: st.DataObject, what: str) -> None:
    kind, content = KINDS[what]
    content = data.draw(damaged(content))
    record = loaded(lambda: validated(content, kind, "FILE"), "FILE: ")
    if record is not None:
        write_record(record, path)
        assert read_record(path, kind) == record


@pytest.mark.long
def test_damage_is_neither_always_fatal_nor_always_harmless() -> None:
    # what the tests above and below see
    fates = {"turbine": [0, 0], "case": [0, 0]}

    @fuzz(400)
    @given(data=st.data(), what=whats)
    def count(data: st.DataObject, what: str) -> None:
        kind, content = KINDS[what]
        content = data.draw(damaged(content))
        fates[what][loaded(lambda: validated(content, kind, "FILE"), "FILE") is not None] += 1

    count()
    assert min(min(fate) for fate in fates.values()) >= 5, fates


def test_a_whole_number_beyond_all_floats_is_refused(path: Path) -> None:
    path.write_text("1" + "0" * 400)
    number = YAML(typ="safe").load(path)
    content = TURBINE | {"tower": TURBINE["tower"] | {"mass": [number] * 5}}
    assert loaded(lambda: validated(content, Turbine, "FILE"), "FILE: tower.mass: ") is None


# text

edits = st.lists(
    st.tuples(
        st.sampled_from(["cut", "truncate", "insert", "swap", "indent"]),
        st.floats(0.0, 1.0),
        st.integers(1, 30),
        st.sampled_from(b": |\n|[|}|\t|- |&a |*a|!!float |.nan|1e999|\x00|\xff|'|?".split(b"|"))
        | st.binary(max_size=6),
    ),
    min_size=1,
    max_size=4,
)


def edited(text: bytes, changes: list[tuple[str, float, int, bytes]]) -> bytes:
    """A text with pieces cut out, put in, exchanged, or its rest missing."""
    for how, share, n, piece in changes:
        at = int(share * len(text))
        if how == "cut":
            text = text[:at] + text[at + n :]
        elif how == "truncate":
            text = text[:at]
        elif how == "insert":
            text = text[:at] + piece + text[at:]
        elif how == "swap":
            text = text[:at] + text[at + n : at + 2 * n] + text[at : at + n] + text[at + 2 * n :]
        else:
            lines = text.split(b"\n")
            i = int(share * (len(lines) - 1))
            lines[i] = b" " * (n % 5) + lines[i]
            text = b"\n".join(lines)
    return text


@pytest.fixture(scope="module")
def texts_of(path: Path) -> dict[str, bytes]:
    """The files before they are damaged."""
    write_record(Turbine.model_validate(TURBINE), path)
    return {"turbine": path.read_bytes(), "case": TEMPLATE.encode()}


READ: dict[str, Callable[[Path], Any]] = {"turbine": meltemi.load_turbine, "case": meltemi.io.read_case}


@pytest.mark.slow
@fuzz(300)
@given(changes=edits, what=whats)
def test_damaged_text_is_refused_in_words_or_valid(
    path: Path, texts_of: dict[str, bytes], changes: list[tuple[str, float, int, bytes]], what: str
) -> None:
    path.write_bytes(edited(texts_of[what], changes))
    loaded(lambda: READ[what](path), str(path))


@pytest.mark.slow
@fuzz(200)
@given(content=st.binary(max_size=60) | st.text(max_size=60).map(lambda text: text.encode("utf-8", "surrogatepass")))
def test_noise_is_refused(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    for read in READ.values():
        with pytest.raises(InputError):
            read(path)


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99])
def test_the_reference_turbine_cut_off_anywhere_is_refused(path: Path, share: float) -> None:
    whole = (Path(meltemi.__file__).parent / "turbine" / "data" / "nrel5mw.yaml").read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError):
        meltemi.load_turbine(path)


# changes that may be valid


@st.composite
def changed(draw: Callable[[Any], Any], factors: st.SearchStrategy[float], most: int) -> Content:
    """The small turbine with some numbers multiplied."""
    content = deepcopy(TURBINE)
    numbers = [p for p in places(content) if isinstance(holder(content, p)[p[-1]], float)]
    for i in draw(st.lists(st.integers(0, len(numbers) - 1), max_size=most)):
        holder(content, numbers[i])[numbers[i][-1]] *= draw(factors)
    return content


words = st.text(st.characters(codec="utf-8"), max_size=20)
foundations = st.floats(1e6, 1e12).map(lambda k: {"stiffness": (k * np.eye(6)).tolist(), "mass": k / 3.0})


@pytest.mark.long
@fuzz(100)
@given(
    content=changed(st.floats(0.98, 1.02), 20),
    labels=st.fixed_dictionaries({"name": words, "description": words, "source": words}),
    foundation=st.none() | foundations,
)
def test_a_changed_turbine_survives_a_file(
    path: Path, content: Content, labels: dict[str, str], foundation: Content | None
) -> None:
    turbine = loaded(lambda: validated(content | labels | {"foundation": foundation}, Turbine, "FILE"), "FILE")
    assume(turbine is not None)
    meltemi.io.write_turbine(turbine, path)
    again = meltemi.load_turbine(path)
    assert again == turbine
    assert again.content() == turbine.content()
    assert again.content_hash() == turbine.content_hash()


@pytest.mark.parametrize("mark", ["\x85", "\u2028", "\u2029", "\ufeff", "\t", "\r\n"])
def test_line_breaks_and_marks_survive_a_file(path: Path, mark: str) -> None:
    turbine = Turbine.model_validate(TURBINE | {"name": mark, "description": f"one{mark}twé"})
    meltemi.io.write_turbine(turbine, path)
    assert meltemi.load_turbine(path) == turbine


LIGHT = ModelOptions(
    flap_modes=1, edge_modes=1, torsion_modes=1, fore_aft_modes=1, side_side_modes=1, blade_nodes=5, tower_nodes=3
)


@pytest.mark.slow
@fuzz(100)
@given(content=changed(st.sampled_from([0.0, -1.0, 1e-6, 0.1, 0.5, 2.0, 10.0, 1e6]), 4))
def test_what_loads_builds_or_is_refused_in_words(content: Content) -> None:
    turbine = loaded(lambda: validated(content, Turbine, "FILE"), "FILE")
    if turbine is not None:
        with suppress(MeltemiError):
            meltemi.build(turbine, LIGHT)


MOST_MODES = {"flap": 10, "edge": 10, "torsion": 5, "fore_aft": 5, "side_side": 5, "tower_torsion": 3}
advanced = {
    "blade_cells": st.none() | st.lists(st.floats(0.0, 61.5), max_size=8).map(lambda x: [0.0, *sorted(x), 61.5]),
    "stall_fit": st.sampled_from(["hansen", "openfast"]),
}
options = st.fixed_dictionaries(
    {},
    optional={
        **{f"{name}_modes": st.integers(0, most) for name, most in MOST_MODES.items()},
        "mode_shapes": st.sampled_from(["computed", "given"]),
        "locked": st.lists(st.sampled_from(["tower", "yaw", "generator", "blades", "1st flap"]), max_size=3),
        "blade_nodes": st.integers(4, 20) | st.lists(st.floats(0.0, 61.5), max_size=8).map(sorted),
        "tower_nodes": st.integers(2, 20),
        "advanced": st.fixed_dictionaries({}, optional=advanced),
        "inflow": st.sampled_from(["variable", "constant", "quasi_steady"]),
    },
)


@pytest.mark.slow
@fuzz(20)
@given(options=options)
def test_options_that_load_build_or_are_refused_in_words(options: Content) -> None:
    case = loaded(lambda: validated(CASE | {"options": options}, LoadCase, "FILE"), "FILE")
    if case is not None:
        with suppress(MeltemiError):
            meltemi.build(Turbine.model_validate(TURBINE), case.options, case.environment)


@pytest.mark.parametrize(
    ("part", "name"),
    [("tower", "fore_aft_stiffness"), ("blade.structure", "flap_stiffness")],
)
def test_what_is_absurdly_stiff_builds_or_is_refused_in_words(part: str, name: str) -> None:
    content = deepcopy(TURBINE)
    holder(content, (*part.split("."), name))[name][2] *= 1e30
    try:
        model = meltemi.build(Turbine.model_validate(content), LIGHT)
    except MeltemiError as error:
        assert part in str(error)
    else:
        assert np.isfinite(model.rotor.modal).all()
        assert np.isfinite(model.rotor.tower_matrix).all()
