"""Compiled functions: where machine code is kept, and that it works without a place to keep it."""

from __future__ import annotations

import hashlib
import hmac
import os
import pickle
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest

from meltemi.compiler import kernels
from meltemi.core import private

SOURCES = Path(kernels.__file__).parents[1]
FOUND = (kernels.cache_folder, kernels.source_hash, kernels.sources)
"""What a process finds out once."""


@pytest.fixture
def fresh(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Path]:
    """An empty cache folder; what the process had found out before is forgotten and found again afterwards."""
    monkeypatch.setenv("MELTEMI_CACHE_DIR", str(tmp_path / "cache"))
    for function in FOUND:
        function.cache_clear()
    yield tmp_path / "cache"
    for function in FOUND:
        function.cache_clear()


def folder() -> Path:
    """The cache folder, looked up anew."""
    for function in FOUND:
        function.cache_clear()
    found = kernels.cache_folder()
    assert found is not None
    return found


@pytest.fixture
def sources(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A small tree of source files that the hash is taken of instead of the package."""
    root = tmp_path / "package"
    for name in ("core", "compiler"):
        (root / name).mkdir(parents=True)
    (root / "compiler" / "kernels.py").write_text("a = 1\n")
    (root / "core" / "other.py").write_text("b = 2\n")
    monkeypatch.setattr(kernels, "__file__", str(root / "compiler" / "kernels.py"))
    return root


def test_environment_variable_names_the_folder(fresh: Path) -> None:
    assert folder().parent == fresh / "kernels"
    assert folder().is_dir()


def test_the_same_sources_give_the_same_folder(fresh: Path, sources: Path) -> None:
    assert folder() == folder()


def test_an_edit_anywhere_gives_another_folder(fresh: Path, sources: Path) -> None:
    before = folder()
    (sources / "core" / "other.py").write_text("b = 3\n")
    assert folder() != before
    (sources / "core" / "other.py").write_text("b = 2\n")
    assert folder() == before


def test_a_new_or_renamed_file_gives_another_folder(fresh: Path, sources: Path) -> None:
    found = [folder()]
    (sources / "core" / "more.py").write_text("")
    found.append(folder())
    (sources / "core" / "more.py").rename(sources / "core" / "most.py")
    found.append(folder())
    assert len(set(found)) == 3


def test_edits_of_what_no_kernel_calls_change_nothing(fresh: Path, sources: Path) -> None:
    before = folder()
    for package, called in (("report", "()"), ("turbine", '("exchange.py",)')):
        (sources / package / "inner").mkdir(parents=True)
        (sources / package / "__init__.py").write_text(f"KERNELS = {called}\n")
        (sources / package / "plots.py").write_text("c = 1\n")
        (sources / package / "inner" / "more.py").write_text("c = 1\n")
    (sources / "__init__.py").write_text("d = 1\n")
    assert folder() == before
    (sources / "turbine" / "exchange.py").write_text("e = 1\n")
    assert folder() != before


def test_an_edit_of_a_kernel_in_a_named_file_gives_another_folder(fresh: Path, sources: Path) -> None:
    beside = sources / "learning"
    beside.mkdir()
    before = folder()
    (beside / "__init__.py").write_text("KERNELS = ()\n")
    (beside / "kernels.py").write_text("c = 1\n")
    assert folder() == before
    (beside / "__init__.py").write_text('KERNELS = ("kernels.py",)\n')
    named = folder()
    assert named != before
    (beside / "other.py").write_text("c = 1\n")
    assert folder() == named
    (beside / "kernels.py").write_text("c = 2\n")
    assert folder() not in (before, named)


def test_no_kernel_stands_in_a_file_that_the_hash_leaves_out() -> None:
    hashed = {path.relative_to(SOURCES).as_posix() for path in kernels.sources()}
    assert {"turbine/exchange.py", "aero/bem.py", "sea/pile.py", "learning/kernels.py"} <= hashed
    assert not hashed & {"turbine/definition.py", "sea/support.py", "namespaces.py", "papers/claim.py"}
    for path in SOURCES.rglob("*.py"):
        if (name := path.relative_to(SOURCES).as_posix()) not in hashed:
            text = path.read_text(encoding="utf-8")
            assert "@kernel" not in text, name
            assert "kernel_for" not in text, name


def test_files_that_are_not_source_change_nothing(fresh: Path, sources: Path) -> None:
    before = folder()
    (sources / "table.csv").write_text("1,2")
    assert folder() == before


@pytest.mark.parametrize("variable", ["NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"])
def test_another_processor_gives_another_folder(
    fresh: Path, sources: Path, monkeypatch: pytest.MonkeyPatch, variable: str
) -> None:
    before = folder()
    monkeypatch.setenv(variable, "generic")
    assert folder() != before


def test_another_numba_gives_another_folder(fresh: Path, sources: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = folder()
    monkeypatch.setattr(numba, "__version__", "0.0.0")
    assert folder() != before


def test_without_the_variable_the_users_cache_is_used(
    fresh: Path, sources: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("MELTEMI_CACHE_DIR")
    monkeypatch.setattr(private.platformdirs, "user_cache_dir", lambda name: str(tmp_path / "home" / name))
    assert folder().parent == tmp_path / "home" / "meltemi" / "kernels"


def test_old_folders_are_removed_the_oldest_first(fresh: Path, sources: Path) -> None:
    now = time.time()
    for age in range(2, 10):  # hours
        old = fresh / "kernels" / f"age{age}"
        old.mkdir(parents=True)
        (old / "used").write_text("")
        os.utime(old / "used", (now - 3600.0 * age, now - 3600.0 * age))
    current = folder()
    left = {f.name for f in (fresh / "kernels").iterdir()}
    assert left == {current.name, *(f"age{age}" for age in range(2, 2 + kernels.KEEP_FOLDERS))}


def test_folders_in_use_are_kept(fresh: Path, sources: Path) -> None:
    for i in range(9):
        (fresh / "kernels" / f"f{i}").mkdir(parents=True)
        (fresh / "kernels" / f"f{i}" / "used").write_text("")
    folder()
    assert len(list((fresh / "kernels").iterdir())) == 10


def test_no_folder_where_none_can_be_made(fresh: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("MELTEMI_CACHE_DIR", str(tmp_path / "file"))
    kernels.cache_folder.cache_clear()
    assert kernels.cache_folder() is None
    assert kernels.is_cold()


def test_a_new_folder_is_cold_until_the_time_loop_is_compiled(fresh: Path, sources: Path) -> None:
    place = folder()
    assert kernels.is_cold()
    (place / "bem.solve-1.py311.nbi").write_text("")
    assert kernels.is_cold()  # the first run was interrupted
    (place / "simulation_0123").mkdir()
    (place / "simulation_0123" / "step.advance-1.py311.nbi").write_text("")
    assert not kernels.is_cold()


SCRIPT = """
import numpy, sys
from meltemi.core import private
from meltemi.compiler import kernels
from meltemi.maths.solve import cholesky
A = numpy.array([[4.0, 0.0], [2.0, 5.0]])
cholesky(A, 2)
assert numpy.array_equal(A, [[0.5, 0.0], [1.0, 0.5]]), A
print(kernels.cache_folder(), *kernels.statistics(), kernels.is_cold())
"""


def run(cache: Path, before: str = "", script: str = SCRIPT, **variables: str) -> list[str]:
    """A new process that compiles one kernel; what it says about the cache."""
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_DISABLE_JIT"}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", f"{before}\n{script}"],
        env={**environment, **variables, "MELTEMI_CACHE_DIR": str(cache)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    lines = (done.stdout + done.stderr).splitlines()
    return " ".join(line for line in lines if not line.startswith("Compiling")).split()  # on a slow machine


@pytest.mark.slow
def test_a_second_process_compiles_nothing(tmp_path: Path) -> None:
    place, signatures, compiled, cold = run(tmp_path)
    assert Path(place).parent == tmp_path / "kernels"
    assert (signatures, compiled, cold) == ("1", "1", "True")
    assert run(tmp_path) == [place, "1", "0", "True"]


LINKED = """
import numba
from meltemi.maths.solve import cholesky as called
@numba.njit
def cholesky(A, n):
    called(A, n)
"""


@pytest.mark.long
def test_a_kernel_that_only_kernels_call_is_kept_without_machine_code(tmp_path: Path) -> None:
    script = (
        f"{LINKED}\n{SCRIPT.replace('from meltemi.maths.solve import cholesky', '')}\nprint(len(called.signatures))"
    )
    place, *first = run(tmp_path, script=script)
    assert first == ["1", "1", "True", "0"]
    assert run(tmp_path, script=script) == [place, "1", "0", "True", "0"]  # another caller: linked from the cache
    assert run(tmp_path) == [place, "1", "1", "True"]  # the first call from Python


@pytest.mark.slow
def test_kernels_work_where_nothing_can_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    place, signatures, _, cold, *said = run(tmp_path / "file")
    assert (place, signatures, cold) == ("None", "1", "True")
    assert " ".join(said).startswith("machine code cannot be kept in")


@pytest.mark.long
def test_processes_that_start_at_once_do_not_disturb_each_other(tmp_path: Path) -> None:
    with ThreadPoolExecutor(2) as pool:
        both = list(pool.map(run, [tmp_path, tmp_path]))
    assert both[0][0] == both[1][0]
    assert run(tmp_path) == [both[0][0], "1", "0", "True"]


def test_signatures_kept_at_once_are_not_mixed_up(tmp_path: Path) -> None:
    """Two processes that know of nothing yet keep the machine code of different signatures."""
    files = [kernels.CacheFile(str(tmp_path), "function", "stamp") for _ in range(3)]
    for file, key in zip(files, "ab", strict=False):
        file._load_index = dict
        file.save(key, f"code of {key}")
    assert files[2].load("a") in (None, "code of a")
    assert files[2].load("b") == "code of b"
    files[2].save("a", "code of a")
    assert [files[2].load(key) for key in "ab"] == ["code of a", "code of b"]


def damaged(file: Path) -> list[bytes]:
    """Its content with a wrong byte, without the end, and nothing of it."""
    whole = file.read_bytes()
    wrong = bytearray(whole)
    wrong[2 * len(whole) // 3] ^= 16
    return [bytes(wrong), whole[: len(whole) // 2], b""]


def test_a_damaged_file_is_as_if_it_were_not_there(tmp_path: Path) -> None:
    def found() -> Any:
        return kernels.CacheFile(str(tmp_path), "function", "stamp").load("key")

    kernels.CacheFile(str(tmp_path), "function", "stamp").save("key", "code" * 20)
    for ending in ("*.nbi", "*.nbc"):
        (file,) = tmp_path.rglob(ending)
        whole = file.read_bytes()
        for content in damaged(file):
            file.write_bytes(content)
            assert found() is None
            file.write_bytes(whole)
            assert found() == "code" * 20


@pytest.mark.long
def test_damaged_machine_code_is_compiled_again(tmp_path: Path) -> None:
    place, *_ = run(tmp_path)
    for ending in ("*.nbi", "*.nbc"):
        (file,) = Path(place).rglob(ending)
        file.write_bytes(damaged(file)[0])
        assert run(tmp_path) == [place, "1", "1", "True"]
    assert run(tmp_path) == [place, "1", "0", "True"]


class Planted:
    """Unpickled, it makes a file."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.file,)


@pytest.mark.long
def test_machine_code_of_somebody_else_is_never_unpickled(tmp_path: Path) -> None:
    """Not with a digest that anybody can compute, nor with a signature by another key."""
    place, *_ = run(tmp_path / "mine")
    content = pickle.dumps(Planted(tmp_path / "executed"))
    for seal in (hashlib.sha256(content).digest(), hmac.digest(b"k" * 32, content, "sha256")):
        for file in Path(place).rglob("*.nb?"):
            file.write_bytes(seal + content)
        assert run(tmp_path / "mine") == [place, "1", "1", "True"]
    assert not (tmp_path / "executed").exists()


@pytest.mark.long
@pytest.mark.skipif(os.name != "posix", reason="folders of users are private there")
@pytest.mark.parametrize("part", ["", "kernels"])
def test_a_cache_into_which_others_may_write_is_refused(tmp_path: Path, part: str) -> None:
    place, *_ = run(tmp_path / "cache")
    (tmp_path / "cache" / part).chmod(0o777)
    none, _, _, _, *said = run(tmp_path / "cache")
    assert none == "None"
    words = " ".join(said)
    assert f"machine code cannot be kept in {tmp_path / 'cache' / part}" in words
    assert "others may write to it; chmod go-w" in words
    (tmp_path / "cache" / part).chmod(0o700)
    assert run(tmp_path / "cache") == [place, "1", "0", "True"]


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "chown") or os.geteuid() != 0, reason="only root gives files away")
def test_a_cache_of_another_user_is_refused(tmp_path: Path) -> None:
    run(tmp_path / "cache")
    os.chown(tmp_path / "cache", 12345, -1)
    none, *_, words = run(tmp_path / "cache")[0], " ".join(run(tmp_path / "cache"))
    assert none == "None"
    assert "belongs to another user" in words


NO_ROOM = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))"
"""As on a full disk, for users who may write everywhere, too: files can be made and stay empty."""


@pytest.mark.long
@pytest.mark.skipif(os.name != "posix", reason="there are no limits of a process")
def test_where_there_is_no_room_kept_code_is_used_and_the_rest_compiled(tmp_path: Path) -> None:
    run(tmp_path, script="from meltemi.core import private; private.user_key()")
    place, _, compiled, _, *said = run(tmp_path, NO_ROOM)
    assert compiled == "1"
    assert " ".join(said).startswith(f"machine code cannot be kept in {place} (File too large)")
    assert said.count("machine") == 1
    assert run(tmp_path) == [place, "1", "1", "True"]  # nothing half-written is taken for whole
    assert run(tmp_path, NO_ROOM) == [place, "1", "0", "True"]


@pytest.mark.slow
def test_installations_share_machine_code_and_may_be_read_only(tmp_path: Path) -> None:
    site = tmp_path / "site"
    shutil.copytree(SOURCES, site / "meltemi", ignore=shutil.ignore_patterns("__pycache__"))
    before = sorted(site.rglob("*"))
    for path in (*before, site):
        path.chmod(0o555 if path.is_dir() else 0o444)
    try:
        place, *found = run(tmp_path / "cache", PYTHONPATH=str(site), PYTHONDONTWRITEBYTECODE="1")
        assert found == ["1", "1", "True"]
        assert Path(place).is_relative_to(tmp_path / "cache")
        assert sorted(site.rglob("*")) == before  # nothing was tried there, even by a user who may
        assert run(tmp_path / "cache") == [place, "1", "0", "True"]
    finally:
        for path in (*before, site):
            path.chmod(0o755 if path.is_dir() else 0o644)


def test_functions_of_the_user_keep_their_own_cache_folder(fresh: Path) -> None:
    before = numba.config.CACHE_DIR

    @kernels.kernel
    def double(x: float) -> float:
        return 2.0 * x

    now = numba.config.CACHE_DIR
    assert now == before
    assert double(2.0) == 4.0


def test_kernels_divide_by_zero_like_numpy(fresh: Path) -> None:
    if numba.config.DISABLE_JIT:
        pytest.skip("plain Python raises instead")

    @kernels.kernel
    def ratio(a: float, b: float) -> float:
        return a / b

    assert ratio(1.0, 0.0) == np.inf


def test_names_of_compiled_functions_differ_between_processes() -> None:
    """Numba's own numbers begin with 1 in each process: cached code of one was linked in place of code of another."""
    text = "from meltemi.compiler.linking import FunctionIdentity as f; print(f.from_function(lambda: 0).unique_id)"
    found = {subprocess.run([sys.executable, "-c", text], capture_output=True, check=True).stdout for _ in range(3)}
    assert len(found) == 3
