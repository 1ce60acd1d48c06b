"""Identity of the code behind stored results: which files count."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

import meltemi
from meltemi import Run, SteadyWind
from meltemi.core.physics import PHYSICS
from meltemi.core.stores import code_identity
from meltemi.postprocess.result_folder import inputs_of


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A study that imports a package of meltemi, which imports another one; a third one is not imported."""
    imports = {
        "own_study": "from meltemi.first.inner import x\nfrom meltemi.namespaces import public\n",
        "first": "def f():\n    import meltemi.second\n",
    }
    for name in ("own_study", "first", "second", "third"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(imports.get(name, ""), encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("meltemi.__path__", [*meltemi.__path__, str(tmp_path)])
    code_identity.cache_clear()
    yield tmp_path
    code_identity.cache_clear()


def identity(*names: str) -> tuple[int | str, ...]:
    """Found anew."""
    code_identity.cache_clear()
    return code_identity(*names)


@pytest.mark.parametrize("file", ["own_study/table.csv", "first/more.py", "second/notes/page.md"])
def test_every_file_of_a_package_and_of_those_it_imports_counts(packages: Path, file: str) -> None:
    before = identity("own_study")
    assert identity("own_study") == before
    (packages / file).parent.mkdir(exist_ok=True)
    (packages / file).write_text("1", encoding="utf-8")
    written = identity("own_study")
    (packages / file).write_text("2", encoding="utf-8")
    assert len({before, written, identity("own_study")}) == 3


@pytest.mark.parametrize("file", ["third/more.py", "own_study/__init__.cpython-311.pyc"])
def test_packages_that_are_not_imported_and_compiled_files_do_not_count(packages: Path, file: str) -> None:
    before = identity("own_study")
    (packages / file).write_text("1", encoding="utf-8")
    assert identity("own_study") == before


def test_without_a_package_the_version_of_the_physics_counts_alone() -> None:
    assert code_identity() == (PHYSICS,)
    assert code_identity("meltemi") == code_identity("meltemi", "meltemi")


def test_batches_run_again_after_an_edit_of_a_file_that_no_kernel_calls(
    packages: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a copy of the file that writes results, in the place of meltemi."""
    own = packages / "own_study" / "netcdf.py"
    found_at = {"meltemi.postprocess": "own_study"}
    monkeypatch.setattr("meltemi.core.stores.find_spec", lambda name: find_spec(found_at.get(name, name)))
    case = Run(meltemi.build(meltemi.load_turbine("pmsg20mw")), SteadyWind(speed=8.0), duration=1.0)
    found = []
    for content in ("a = 1", "a = 1", "a = 2"):
        own.write_text(content, encoding="utf-8")
        code_identity.cache_clear()
        found.append(inputs_of(case))
    assert found[0] is not None and found[0] == found[1] != found[2]
