"""Records: frozen, strict, comparable by content."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field

from meltemi.core.errors import InputError
from meltemi.core.record import Array, Particular, Record
from meltemi.core.yamlfile import read_record, write_record


class Part(Record):
    length: float = Field(default=1.0, gt=0.0)
    values: Array = Field(default_factory=lambda: np.array([1.0, 2.0]))


class Whole(Record):
    name: str = "thing"
    part: Part = Part()
    spare: Part | None = None
    table: dict[str, Part] = Field(default_factory=dict)


numbers = st.floats(min_value=-1e50, max_value=1e50)
nonzero = numbers.filter(lambda x: x != 0.0)  # the sign of zero has its own test


def test_fields_cannot_be_set() -> None:
    part = Part()
    with pytest.raises(InputError, match="frozen"):
        part.length = 2.0  # type: ignore[misc]


def test_unknown_keys_are_refused() -> None:
    with pytest.raises(InputError, match="lenght: unknown key; did you mean 'length'"):
        Part(lenght=2.0)  # type: ignore[call-arg]


def test_arrays_are_float_read_only_copies() -> None:
    source = np.array([1, 2, 3])
    part = Part(values=source)
    assert part.values.dtype == np.float64
    source[0] = 99
    np.testing.assert_array_equal(part.values, [1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="read-only"):
        part.values[0] = 5.0


def test_arrays_refuse_ragged_lists_and_text() -> None:
    for value in ([[1.0, 2.0], [3.0]], ["a", "b"], {"a": 1}, None):
        with pytest.raises(InputError, match="regular .rectangular. list|finite"):
            Part(values=value)  # type: ignore[arg-type]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_arrays_refuse_what_is_not_a_number_and_say_where(bad: float) -> None:
    with pytest.raises(InputError, match="finite number; not so at entry 3"):
        Part(values=[1.0, 2.0, bad])  # type: ignore[arg-type]


def test_numbers_beyond_any_physical_quantity_are_refused() -> None:
    """Their products would overflow where nobody can name the key any more."""
    with pytest.raises(InputError, match="at most 1e[+]50; not so at entry 2"):
        Part(values=[1.0, -1e51])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="length: expected a number of at most 1e[+]50"):
        Whole(part={"length": 1e308})  # type: ignore[arg-type]


def test_arrays_name_at_most_five_bad_entries() -> None:
    with pytest.raises(InputError, match=r"at entry 1, 2, 3, 4, 5$"):
        Part(values=[np.nan] * 9)  # type: ignore[arg-type]


@settings(derandomize=True, deadline=None, max_examples=200)
@given(a=st.lists(nonzero, min_size=1, max_size=3), b=st.lists(nonzero, min_size=1, max_size=3))
def test_hashes_are_equal_exactly_when_contents_are(a: list[float], b: list[float]) -> None:
    one, two = Part(values=a), Part(values=b)  # type: ignore[arg-type]
    assert (one.content_hash() == two.content_hash()) is (a == b)
    assert Part(values=list(a)).content_hash() == one.content_hash()  # type: ignore[arg-type]


@settings(derandomize=True, deadline=None, max_examples=100)
@given(a=nonzero, b=nonzero)
def test_equal_records_have_equal_hashes(a: float, b: float) -> None:
    one, two = Part(values=[a]), Part(values=[b])  # type: ignore[arg-type]
    assert (one == two) is (a == b)
    if one == two:
        assert hash(one) == hash(two)


def test_negative_zero_hashes_like_zero() -> None:
    one, two = Part(values=[0.0]), Part(values=[-0.0])  # type: ignore[arg-type]
    assert (one == two) is (hash(one) == hash(two))


def test_records_of_another_kind_are_never_equal() -> None:
    class Other(Record):
        length: float = 1.0

    class Same(Record):
        length: float = 1.0

    assert Other() != Same()
    assert Other() != {"length": 1.0}


def test_records_serve_as_keys() -> None:
    assert {Part(): 1}[Part(length=1.0)] == 1
    assert len({Part(), Part(length=1.0), Part(length=2.0)}) == 2


def test_replace_gives_a_changed_copy() -> None:
    before = Whole()
    after = before.replace(name="other")
    assert (before.name, after.name) == ("thing", "other")
    assert after.part == before.part


def test_replace_reaches_deeper_by_a_dotted_path() -> None:
    whole = Whole(table={"a": Part()})
    after = whole.replace(**{"part.length": 3.0, "part.values": [4.0], "table.a.length": 5.0})
    assert after.part.length == 3.0
    np.testing.assert_array_equal(after.part.values, [4.0])
    assert after.table["a"].length == 5.0
    assert whole.part.length == whole.table["a"].length == 1.0


def test_replace_takes_records() -> None:
    assert Whole().replace(spare=Part(length=7.0)).spare == Part(length=7.0)
    assert Whole(spare=Part()).replace(spare=None).spare is None


def test_replace_validates() -> None:
    with pytest.raises(InputError, match="greater than 0"):
        Whole().replace(**{"part.length": -1.0})
    with pytest.raises(InputError, match="Whole has no 'part.lenght': did you mean 'length'"):
        Whole().replace(**{"part.lenght": 1.0})
    with pytest.raises(InputError, match="did you mean 'name'"):
        Whole().replace(nmae="x")


@pytest.mark.parametrize("path", ["prat.length", "spare.length", "name.length"])
def test_replace_refuses_paths_that_lead_nowhere(path: str) -> None:
    with pytest.raises(InputError):
        Whole().replace(**{path: 1.0})


def test_content_is_plain_data_that_makes_the_same_record() -> None:
    whole = Whole(spare=Part(values=[1.5, 2.5]))  # type: ignore[arg-type]
    content = whole.content()
    assert content["spare"]["values"] == [1.5, 2.5]
    assert Whole.model_validate(content) == whole


class Either(Particular):
    WHEN_GIVEN: ClassVar[tuple[str, ...]] = ("spare",)
    spare: float = 2.0
    other: float = 1.0


class Holder(Record):
    one: Either = Either()


def test_copies_and_files_give_only_what_was_given(tmp_path: Path) -> None:
    """And the record is whole all the same: what it says of itself has the default."""
    path = tmp_path / "holder.yaml"
    for either, said in ((Either(), False), (Either(spare=2.0), True)):
        holder = Holder(one=either)
        assert holder.content() == {"one": {"spare": 2.0, "other": 1.0}}
        write_record(holder, path)
        copies = (
            either.replace(other=3.0),
            holder.replace(**{"one.other": 3.0}).one,
            Holder().replace(one=either).one,
            read_record(path, Holder).one,
            copy.deepcopy(either),
            pickle.loads(pickle.dumps(either)),
        )
        for made in copies:
            assert ("spare" in made.model_fields_set) is said
            assert made.spare == 2.0
    assert "spare" in Either().replace(spare=2.0).model_fields_set
    assert Either(spare=5.0).replace(spare=None) == Either()
    assert Either() == Either(spare=2.0)
