"""The vocabulary of controllers: what a name or file means, as data."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

from meltemi import InputError
from meltemi.controllers.names import NAMES, SCHEMES, controller_keys, label, labelled
from meltemi.controllers.specification import (
    SupervisedCase,
    check_files,
    digest,
    rooted,
    specification,
    supervised_form,
    uses_flaps,
)


@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("baseline", {"kind": "baseline"}),
        ("Supervised", {"kind": "supervised"}),
        ("ipc", {"kind": "baseline", "scheme": "ipc"}),
        ("a2", {"kind": "power", "scheme": "A2"}),
        ("power", {"kind": "power"}),
        ("fixed", {"kind": "fixed"}),
        ("rosco", {"kind": "bladed", "library": "rosco"}),
        ("rosco@DISCON.IN", {"kind": "bladed", "library": "rosco", "input": "DISCON.IN"}),
        ("our/law.so@a.in", {"kind": "bladed", "library": "our/law.so", "input": "a.in"}),
        ("libdiscon.so.2", {"kind": "bladed", "library": "libdiscon.so.2"}),
        ("our/law", {"kind": "bladed", "library": "our/law"}),
        ("mine.py", {"kind": "python", "file": "mine.py"}),
        ("mine:law", {"kind": "python", "file": "mine", "function": "law"}),
        ("mine.py:law", {"kind": "python", "file": "mine.py", "function": "law"}),
    ],
)
def test_what_a_name_means(name: str, keys: dict[str, str]) -> None:
    assert controller_keys(name) == keys
    case = specification(name)
    assert specification(keys) == case == pickle.loads(pickle.dumps(case))


def test_every_name_is_valid_and_has_a_hash_of_its_own() -> None:
    found = [digest(specification(name)) for name in NAMES if name not in ("rosco", "power")]
    assert len(set(found)) == len(found) == len(NAMES) - 2
    assert set(SCHEMES) < set(NAMES)


@pytest.mark.parametrize("name", ["basline", "ipc@x.in", "", "supervised@law.in"])
def test_other_names_are_refused_with_the_list(name: str) -> None:
    with pytest.raises(InputError, match=r"no controller .*Valid are baseline, supervised, .*rosco.*a Python file"):
        controller_keys(name)
    with pytest.raises(InputError, match="expected module:function"):
        controller_keys(":x")


def test_labels() -> None:
    assert [label(name) for name in ("ipc", "a/b.py", "c/d.so@e.in", "rosco@x")] == ["ipc", "b", "d", "rosco"]
    with pytest.raises(InputError, match="two of them are called 'mine'"):
        labelled(["mine.py", "other/mine.py"])


def test_a_hash_is_that_of_the_files(tmp_path: Path) -> None:
    """Wherever they lie; a changed file is another controller."""
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "mine.py").write_text("x = 1\n")
    first, same = (rooted(specification("mine.py"), tmp_path / folder) for folder in ("a", "b"))
    before = digest(first)
    assert first != same and before == digest(same)
    (tmp_path / "a" / "mine.py").write_text("x = 2\n")
    assert digest(first) != before


def test_files_are_what_they_are_taken_for(tmp_path: Path) -> None:
    (tmp_path / "law.so").write_text("no library")
    (tmp_path / "mine.py").write_text("")
    for name, words in (
        ("law.so", "law.so: cannot be used as a controller library: it is no shared library"),
        ("mime.py", "mime.py: no such file; did you mean 'mine.py'"),
        ("lew.so", "lew.so: no such file; did you mean 'law.so'"),
    ):
        with pytest.raises(InputError, match=words):
            check_files(specification(name), tmp_path)
    check_files(specification("mine.py"), tmp_path)


def test_schemes_have_a_supervised_form() -> None:
    whole = supervised_form(specification("cpfc"))
    assert isinstance(whole, SupervisedCase) and whole.scheme == "cpfc" and uses_flaps(whole)
    assert supervised_form(specification("baseline")) == specification("supervised")
    assert supervised_form(specification("A2")) is supervised_form(specification("rosco")) is None
