"""Compiled functions: the configuration of Numba and its cache.

``@kernel`` compiles a function for the processor it runs on and keeps the machine code in a folder
of the user's cache. Numba's own cache detects a change of the file that defines a function, but not of
a function it calls in another file. Therefore the folder's name is a hash of every source file that
defines kernels or functions they call, and of everything else the machine code depends on; a change to any
of them starts a new folder, and old ones are removed. A file that is damaged or that another user wrote counts as
missing; if the folder is not writable, its content is used, and the rest is compiled in each process.

Kernels assume valid input; everything is checked before they are called. They use IEEE arithmetic
with contraction to fused multiply-add, and no reordering: the same machine gives the same bits.
"""

from __future__ import annotations

import gc
import hashlib
import os
import pickle
import platform
import re
import shutil
import sys
import threading
import time
from ast import literal_eval
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import llvmlite.binding
import numba
import numpy as np
from numba.core import event, typeinfer
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, InTreeCacheLocator

from meltemi.compiler import inference as inference
from meltemi.compiler import linking
from meltemi.core.private import private_folder, signed, user_key, verified

F = TypeVar("F", bound=Callable[..., Any])

FAST_MATH = {"contract", "nsz", "arcp"}
OPTIONS: dict[str, Any] = {"fastmath": FAST_MATH, "error_model": "numpy", "nogil": True}
KEEP_FOLDERS = 4
"""Cache folders of other versions that are kept, most recently used first."""
KERNELS = re.compile(r"^KERNELS = (\(.*\))$", re.MULTILINE)
"""Line of a package's ``__init__.py`` that names the files of the package, and of those in it, that kernels call."""


def package_folder() -> Path:
    """Folder of the package."""
    return Path(__file__).parents[1]


@cache
def sources() -> tuple[Path, ...]:
    """Source files on which the machine code depends: all below the package but those that ``KERNELS`` leaves out."""
    root = package_folder()

    @cache
    def called(folder: Path) -> tuple[str, ...] | None:
        file = folder / "__init__.py"
        line = KERNELS.search(file.read_text(encoding="utf-8")) if file.is_file() else None
        if line:
            return literal_eval(line[1])
        return None if folder == root else called(folder.parent)

    def counts(path: Path) -> bool:
        names = called(path.parent)
        return path.parent != root if names is None else path.name in names

    return tuple(path for path in sorted(root.rglob("*.py")) if counts(path))


@cache
def is_ours(module: str) -> bool:
    """Whether the file of a module is one of these, so that its machine code may be kept under their hash."""
    return package_folder().parent.joinpath(*module.split(".")).with_suffix(".py") in sources()


@cache
def source_hash() -> str:
    """Hash of these files."""
    digest, root = hashlib.sha256(), package_folder()
    for path in sources():
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:16]


@cache
def cache_folder() -> Path | None:
    """Cache folder for this version of the package, Numba, NumPy, Python and processor.

    Returns:
      The folder, created if needed, or None if none can be made or others may write to it (then every process
      compiles anew).
    """
    cpu = os.environ.get("NUMBA_CPU_NAME") or llvmlite.binding.get_host_cpu_name()
    features = os.environ.get("NUMBA_CPU_FEATURES") or ""
    versions = numba.__version__, np.__version__, platform.python_version()
    key = (source_hash(), *versions, cpu, features, platform.machine())
    try:
        user_key()
        folder = private_folder("kernels", hashlib.sha256("|".join(key).encode()).hexdigest()[:16])
    except OSError as error:
        _cannot_keep(Path(error.filename or ""), error.strerror or str(error))
        return None
    with suppress(OSError):  # read-only, or the disk is full
        (folder / "used").write_text(" ".join(key), encoding="utf-8")
        _prune(folder.parent, keep=folder)
    return folder


def _prune(base: Path, keep: Path) -> None:
    """Remove the least recently used folders; another process may remove them at the same time."""

    def used(folder: Path) -> float:
        try:
            return (folder / "used").stat().st_mtime
        except OSError:
            return 0.0

    others = sorted((f for f in base.iterdir() if f.is_dir() and f != keep), key=used, reverse=True)
    for folder in others[KEEP_FOLDERS:]:
        if time.time() - used(folder) > 3600.0:  # a process that just started may use it
            shutil.rmtree(folder, ignore_errors=True)


def is_cold() -> bool:
    """Whether the time loop, compiled last, is still missing in the cache."""
    folder = cache_folder()
    return folder is None or not any(folder.rglob("step.advance-*.nbi"))


COLD = "Compiling for this machine: this happens once and takes about a minute ..."
_looked = False


def announce() -> bool:
    """Announce the compilation of a first run on stderr, once per process.

    Returns:
      Whether it was said.
    """
    global _looked
    announced = not (_looked or numba.config.DISABLE_JIT) and is_cold()
    _looked = True
    if announced:
        _FEATURES_TOLD.add(FEATURE)
        print(COLD, file=sys.stderr, flush=True)
    return announced


PATIENCE = 1.0
"""[s] compilation time before it is announced."""
FEATURE = "the simulation"
"""Feature of a compiled function, unless its module, or the package of it, has another ``FEATURE``."""
_FEATURES_TOLD: set[str] = set()


class Announcer(event.Listener):  # type: ignore[misc]
    """Announces on stderr, once per feature, compilations that take noticeable time.

    Compiling returns with each feature that is used for the first time; without a word it looks like a hang.
    """

    def __init__(self, patience: float = PATIENCE) -> None:
        self.patience, self.spent = patience, dict[str, float]()
        self.depth, self.began, self.feature, self.collects = 0, 0.0, "", True
        self.timer: threading.Timer | None = None

    def on_start(self, event: Any) -> None:
        """Start of a (possibly nested) compilation."""
        self.depth += 1
        if self.depth > 1:
            return
        self.collects = gc.isenabled()
        gc.disable()  # collections among the objects of a compilation, of which none goes before its end, take a tenth
        self.feature, self.began = feature_of(event.data), time.perf_counter()
        if self.feature not in _FEATURES_TOLD:
            wait = self.patience - self.spent.get(self.feature, 0.0)
            self.timer = threading.Timer(max(wait, 0.0), self._tell, [self.feature])
            self.timer.daemon = True
            self.timer.start()

    def on_end(self, event: Any) -> None:
        """End of a compilation, successful or not."""
        self.depth -= 1
        if self.depth == 0:
            if self.collects:
                gc.enable()
            self.spent[self.feature] = self.spent.get(self.feature, 0.0) + time.perf_counter() - self.began
            if self.timer is not None:
                self.timer.cancel()
                self.timer = None

    def _tell(self, feature: str) -> None:
        if feature not in _FEATURES_TOLD:
            _FEATURES_TOLD.add(feature)
            print(f"Compiling {feature} for this machine: this happens once ...", file=sys.stderr, flush=True)


def feature_of(data: dict[str, Any]) -> str:
    """Name of the feature to which a compiled function belongs."""
    if any("Dual" in type(a).__name__ or getattr(a, "kind", None) == "duals" for a in data["args"]):
        return "derivatives"
    function = data["dispatcher"].py_func
    module = function.__module__ or ""
    while module.startswith("meltemi"):
        if words := vars(sys.modules[module]).get("FEATURE"):
            return str(words)
        module = module.rpartition(".")[0]
    return FEATURE if is_ours(function.__module__ or "") else f"{function.__module__}.{function.__name__}"


def kernel(function: F) -> F:
    """Compile ``function`` at its first call for each combination of argument types; cached on disk."""
    return _compiled(function)


def summing(function: F) -> F:
    """A kernel that may add in another order, and so many numbers at a time; the same machine gives the same bits.

    It keeps machine code of its own: what is linked is not turned into instructions for vectors.
    """
    return _compiled(function, options={**OPTIONS, "fastmath": FAST_MATH | {"reassoc"}})


def kernel_for(signature: Any) -> Callable[[F], F]:
    """Compile a function now, for one signature only; cached on disk."""

    def decorate(function: F) -> F:
        return _compiled(function, signature)

    return decorate


def choice(kernels: Sequence[Callable[..., Any]]) -> Any:
    """A kernel that calls one of several by its number: ``choice([f, g])(1, x)`` is ``g(x)``.

    The kernels take the same arguments and return the same types. It has no cache: its code is part of its callers'.
    """
    first, *others = kernels
    if all(other is first for other in others):

        def call(which: int, *arguments: Any) -> Any:
            return first(*arguments)
    else:
        following = choice(others)

        def call(which: int, *arguments: Any) -> Any:
            if which == 0:
                return first(*arguments)
            return following(which - 1, *arguments)

    return _compiled(call, cached=False)


def in_turn(kernels: Sequence[Callable[..., Any]], parameters: int) -> Any:
    """A kernel that calls several, which take up to three parameters, one after the other."""
    if not kernels:
        nothing: Any = (lambda a: None, lambda a, b: None, lambda a, b, c: None)[parameters - 1]
        return _compiled(nothing)
    first, following = kernels[0], in_turn(kernels[1:], parameters)

    def one(a: Any) -> None:
        first(a)
        following(a)

    def two(a: Any, b: Any) -> None:
        first(a, b)
        following(a, b)

    def three(a: Any, b: Any, c: Any) -> None:
        first(a, b, c)
        following(a, b, c)

    return _compiled((one, two, three)[parameters - 1], cached=False)


def loose(function: F) -> F:
    """A kernel without a cache of its own, compiled as part of its callers."""
    return _compiled(function, cached=False)


def all_kernels() -> list[Any]:
    """Numba's dispatchers of all kernels of this process."""
    return list(_DISPATCHERS)


_DISPATCHERS: list[Any] = []
_TIMES = event.TimingListener()
event.register("numba:compile", _TIMES)
event.register("numba:compile", Announcer())


def compile_seconds() -> float:
    """Time [s] spent compiling in this process, without loading from the cache."""
    return float(_TIMES.duration) if _TIMES.done else 0.0


def statistics() -> tuple[int, int]:
    """Number of kernel signatures in this process, and of those that were compiled here."""
    signatures = sum(len(d.nopython_signatures) for d in _DISPATCHERS)
    compiled = sum(sum(d.stats.cache_misses.values()) for d in _DISPATCHERS)
    return signatures, compiled


class CacheFile(IndexDataCacheFile):  # type: ignore[misc]
    """Numba's index of a function's machine code, with data files named by their content.

    Numba numbers them. Two processes that compile different signatures of a function at the same time then write both
    under one number, and the next process runs the code of the other signature. Here they can only forget one.

    Each file begins with the user's signature of the rest: machine code with a wrong bit would crash, or compute
    something else, and a file of somebody else could run anything.
    """

    def save(self, key: Any, data: Any) -> None:
        """Store the machine code ``data`` of a signature, if there is enough disk space."""
        name = f"{self._index_name}.{hashlib.sha256(repr(key).encode()).hexdigest()[:16]}.nbc"
        try:
            self._write(self._data_path(name), data)
            known = self._load_index()
            if known.get(repr(key)) != name:
                self._save_index({**known, repr(key): name})
        except OSError as error:
            _cannot_keep(Path(self._cache_path).parent, error.strerror or str(error))

    def load(self, key: Any) -> Any:
        """Machine code of a signature, or None; the index names signatures by text: their types may be foreign."""
        name = self._load_index().get(repr(key))
        return None if name is None else self._read(self._data_path(name))

    def _load_index(self) -> dict[str, str]:
        stamp, known = self._read(self._index_path) or (None, {})
        return known if stamp == self._source_stamp else {}

    def _save_index(self, overloads: dict[str, str]) -> None:
        self._write(self._index_path, (self._source_stamp, overloads))

    def _read(self, path: str) -> Any:
        """Content of a file, or None if it is missing or damaged."""
        try:
            content = verified(Path(path).read_bytes(), user_key())
            return None if content is None else pickle.loads(content)
        except OSError:
            return None
        except (ImportError, AttributeError):  # of a record or table that another program defines
            return None

    def _write(self, path: str, data: Any) -> None:
        content = self._dump(data)
        Path(path).parent.mkdir(exist_ok=True)
        with self._open_for_write(path) as file:
            file.write(signed(content, user_key()))


@cache
def _cannot_keep(folder: Path, why: str) -> None:
    """Warn once that machine code cannot be cached."""
    print(f"machine code cannot be kept in {folder} ({why}): each process compiles again", file=sys.stderr, flush=True)


class _Locator(InTreeCacheLocator):  # type: ignore[misc]
    """Locator of Numba's cache files: installations of equal sources share them, wherever they are, writable or not."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        super().__init__(function, file)
        package = (function.__module__ or "").rpartition(".")[0]
        self.place = package if is_ours(function.__module__ or "") else self.get_suitable_cache_subpath(file)

    def get_cache_path(self) -> str:
        return str(Path(cache_folder() or "") / self.place)

    def ensure_cache_path(self) -> None:
        """The folder is created on the first write."""


class _Kept(CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Locator, *CompileResultCacheImpl._locator_classes)


class _KeptLinked(_Kept):
    def reduce(self, cres: Any) -> Any:
        """Content of the cache file."""
        return linking.to_bytes(cres)

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """Compiled function from that content."""
        return linking.from_bytes(target_context, payload)


class _Cache(FunctionCache):  # type: ignore[misc]
    _impl_class = _Kept
    suffix = ""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        name, stamp = self._impl.filename_base + self.suffix, self._impl.locator.get_source_stamp()
        self._cache_file = CacheFile(self.cache_path, name, stamp)


class _LinkedCache(_Cache):
    _impl_class = _KeptLinked
    suffix = ".linked"


def _compiled(function: F, *signature: Any, cached: bool = True, options: dict[str, Any] = OPTIONS) -> F:
    cached = cached and cache_folder() is not None
    if numba.config.DISABLE_JIT:
        return function
    compiled = numba.njit(**options)(function)
    _DISPATCHERS.append(compiled)
    if cached:
        compiled._cache = _Cache(function)
    if signature:
        with typeinfer.register_dispatcher(compiled):
            compiled.compile(*signature)
        compiled.disable_compile()
    elif options is OPTIONS:
        linked = numba.njit(pipeline_class=linking.LinkedCompiler, **options)(function)
        _DISPATCHERS.append(linked)
        if cached:
            linked._cache = _LinkedCache(function)
        linking.link_from(compiled, linked)
    return compiled
