"""Compilation of a kernel together with its adjoint, with a cache of the machine code."""

from __future__ import annotations

import ctypes
import hashlib
import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from meltemi.compiler import (
    Loaded,
    RecordType,
    announced,
    cache_folder,
    linked_code,
    machine_code,
    reverse_code,
    target_name,
)
from meltemi.core.errors import MeltemiError
from meltemi.core.files import replacing
from meltemi.core.private import signed, user_key, verified
from meltemi.gradients.reverse.memory import Memory
from meltemi.gradients.reverse.transform import ModuleCode, transformed


class Compiled:
    """A kernel and its adjoint in machine code.

    Args:
      function: plain Python function for Numba, without results.
      kinds: types of its arguments: integers and functions, then records.
      arrays, wanted: see :func:`transformed`.
      name: key of the cache if all sources of function and records are those of meltemi; else their code is the key.

    Attributes:
      used: [bytes] memory that the code uses itself.

    Raises:
      InputError: the function calls something whose derivative is not known.
    """

    def __init__(
        self,
        function: Any,
        kinds: Sequence[Any],
        arrays: Mapping[tuple[str, str], int | None],
        *,
        wanted: frozenset[str] | None,
        name: str = "",
    ) -> None:
        code = None if name else code_of(function, kinds)
        others = repr((sorted(arrays.items()), wanted and sorted(wanted), target_name()))
        key = hashlib.sha256((name if code is None else code.text).encode() + sources() + others.encode()).hexdigest()
        folder = cache_folder()
        file = None if folder is None else folder / f"adjoint-{key[:32]}.o"
        kept = _kept(file)
        if kept is None:
            records = {2 + i: kind.cls for i, kind in enumerate(kinds) if isinstance(kind, RecordType)}
            with announced(function):
                text, used = transformed(code or code_of(function, kinds), records, arrays, wanted)
                kept = used, machine_code(text)
            _keep(file, *kept)
        self.used, loaded = kept
        self._loaded = Loaded(loaded)
        made_of = [ctypes.c_void_p if isinstance(kind, RecordType) else ctypes.c_int64 for kind in kinds]
        prototype = ctypes.CFUNCTYPE(ctypes.c_int32, *[ctypes.c_void_p] * 3, *made_of)
        self._forward, self._backward = (prototype(self._loaded.address(each)) for each in ("forward", "backward"))
        self._results = np.zeros(4, dtype=np.int64)
        at = int(self._results.ctypes.data)
        self._places = at, at + 16

    def forward(self, memory: Memory, *numbers: int) -> None:
        """Evaluate the kernel, and record what the adjoint needs.

        Args:
          numbers: arguments before the records.
        """
        if self._forward(memory.base, *self._places, *numbers, *memory.addresses) != 0:
            raise MeltemiError("adjoint: an exception in the code that is differentiated")

    def backward(self, memory: Memory, *numbers: int) -> None:
        """Carry the adjoints back over what was recorded."""
        self._backward(memory.base, *self._places, *numbers, *memory.addresses)


@cache
def sources() -> bytes:
    """The source files of this package and of its user, for the key of the cache."""
    folder = Path(__file__).parent
    return b"".join(path.read_bytes() for path in (folder.parent / "adjoint.py", *sorted(folder.glob("*.py"))))


def code_of(function: Any, kinds: Sequence[Any]) -> ModuleCode:
    """Optimised LLVM code of a function with all that it calls, with names that no address is part of."""
    linked, name = linked_code(function, kinds)
    text = reverse_code(linked)
    names: dict[str, str] = {}

    def renamed(match: re.Match[str]) -> str:
        return names.setdefault(match[0], f"k{len(names)}")

    text = re.sub(r"^(?:; |!\d+ = |source_filename).*$| +; preds = .*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"(?<![-\w.$])_ZN[-\w.$]+", renamed, text)  # of functions, and of blocks where one was inlined
    return ModuleCode(text, "@" + names[name], {short: _readable(mangled) for mangled, short in names.items()})


def _readable(mangled: str) -> str:
    """Name in Python of a kernel: Numba writes its parts behind their lengths."""
    parts, rest = [], mangled.removeprefix("_ZN")
    while length := re.match(r"\d+", rest):
        end = length.end() + int(length[0])
        parts.append(rest[length.end() : end])
        rest = rest[end:]
    return ".".join(parts)


def _kept(file: Path | None) -> tuple[int, bytes] | None:
    if file is None or not file.is_file():
        return None
    content = verified(file.read_bytes(), user_key())
    return None if content is None else (int.from_bytes(content[:8], "little"), content[8:])


def _keep(file: Path | None, used: int, code: bytes) -> None:
    if file is None:
        return
    try:
        with replacing(file) as (part,):
            part.write_bytes(signed(used.to_bytes(8, "little") + code, user_key()))
    except MeltemiError:  # read-only, or the disk is full: the next process compiles again
        return
