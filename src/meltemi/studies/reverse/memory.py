"""One block of memory for all arrays of a run, with the adjoint of every number at a fixed distance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.maths.records import Record, members
from meltemi.studies.reverse.transform import SHADOW

_PAGE = 4096
TAPE = 1 << 30
"""[bytes] reserved for the tape; untouched pages take no memory."""


class Memory:
    """Copies of the arrays of records, with their adjoints.

    Args:
      records: of one run; arrays that they share stay shared. Arrays of single precision remain where they are.
      used: [bytes] at the beginning, for the compiled code.

    Attributes:
      base: address of the block.
      words: for each record the words of its copy.

    Raises:
      InputError: the arrays are too large.
    """

    def __init__(self, records: Sequence[Record], used: int) -> None:
        arrays = [a for r in records for a in r.arrays if a.dtype != np.float32 and a.size]
        spans = sorted({(a.ctypes.data, a.ctypes.data + a.nbytes) for a in arrays})
        merged: list[list[int]] = []
        for begin, end in spans:
            if merged and begin < merged[-1][1]:
                merged[-1][1] = max(merged[-1][1], end)
            else:
                merged.append([begin, end])
        self.begins = np.array([begin for begin, _ in merged])
        self.places, at = [], used
        for begin, end in merged:
            at += (begin - at) % 64
            self.places.append(at)
            at += end - begin
        if at > SHADOW:
            raise InputError(f"gradient: the arrays of the run take {at >> 20} MiB, more than {SHADOW >> 20} MiB")
        self._block = np.zeros(SHADOW + at + _PAGE, dtype=np.uint8)
        self._tape = np.zeros(TAPE, dtype=np.uint8)
        first = -self._block.ctypes.data % _PAGE
        self._bytes = self._block[first:]
        self.base = int(self._bytes.ctypes.data)
        self.tape = int(self._tape.ctypes.data + (-self._tape.ctypes.data) % 64)
        self.words = [self._moved(record) for record in records]
        for array in arrays:
            self.of(array)[...] = array

    @staticmethod
    def pieces(records: Sequence[Record]) -> dict[tuple[str, str], frozenset[int] | None]:
        """Numbers of the pieces of memory of each member, by the names of record and member; overlapping members share
        pieces; None for a member without derivatives.
        """
        named = [(r, n, m, a) for r in records for (n, m), a in zip(members(type(r)).items(), r.arrays, strict=True)]
        ends = sorted({at for *_, a in named for at in (a.ctypes.data, a.ctypes.data + a.nbytes) if a.size})
        number = {at: i for i, at in enumerate(ends)}
        return {
            (type(r).__name__, n): None
            if m.constant
            else frozenset(range(number[a.ctypes.data], number[a.ctypes.data + a.nbytes]) if a.size else ())
            for r, n, m, a in named
        }

    def of(self, array: Any, *, adjoint: bool = False) -> Any:
        """The copy of an array, or its adjoints."""
        at = self.place(array.ctypes.data) + (SHADOW if adjoint else 0)
        return np.ndarray(array.shape, array.dtype, self._bytes, at, array.strides)

    def place(self, address: int) -> int:
        """Place in the block of what is at an address."""
        k = int(np.searchsorted(self.begins, address, side="right")) - 1
        return int(self.places[k] + address - self.begins[k])

    def rewind(self) -> None:
        """Begin the tape anew."""
        self._bytes[:8].view(np.int64)[0] = self.tape

    @property
    def recorded(self) -> int:
        """[bytes] on the tape."""
        return int(self._bytes[:8].view(np.int64)[0]) - self.tape

    def _moved(self, record: Record) -> Any:
        words, at = record.words.copy(), 0
        for array, member in zip(record.arrays, members(type(record)).values(), strict=True):
            if array.dtype != np.float32 and array.size:
                words[at] = self.base + self.place(array.ctypes.data)
            at += 2 + member.ndim
        return words
