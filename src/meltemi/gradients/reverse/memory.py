"""One block of memory for all arrays of a run, with the adjoint of every number at a fixed distance."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from meltemi.compiler import KernelRecord, members
from meltemi.core.errors import InputError
from meltemi.gradients.reverse.tape import SHADOW

_PAGE = 4096
TAPE = 1 << 30
"""[bytes] reserved for the tape; untouched pages take no memory."""


class Memory:
    """Copies of the arrays of records, with their adjoints.

    Args:
      records: records of one run; arrays that they share stay shared. Arrays of single precision remain where they are.
      used: [bytes] memory at the beginning, for the compiled code.

    Attributes:
      base: address of the block.
      addresses: addresses of the words of the copies of the records.
      adjoints: bytes of the adjoints of all arrays.

    Raises:
      InputError: the arrays are too large.
    """

    def __init__(self, records: Sequence[KernelRecord], used: int) -> None:
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
        self.base, self._end = int(self._bytes.ctypes.data), self._bytes[:8].view(np.int64)
        self.tape = int(self._tape.ctypes.data + (-self._tape.ctypes.data) % 64)
        self._words = [self._moved(record) for record in records]
        self.addresses = [int(words.ctypes.data) for words in self._words]
        self.adjoints = self._bytes[SHADOW + self.places[0] : SHADOW + at] if self.places else self._bytes[:0]
        for array in arrays:
            self.of(array)[...] = array

    @staticmethod
    def numbers(records: Sequence[KernelRecord]) -> dict[tuple[str, str], int | None]:
        """Number of the array of each member by the names of record and member; None for one without derivatives."""
        classes: list[Any] = [type(record) for record in records]
        pairs = [zip(members(c).items(), r.arrays, strict=True) for c, r in zip(classes, records, strict=True)]
        named = [(r, n, m, a) for r, each in zip(records, pairs, strict=True) for (n, m), a in each]
        ends = sorted((a.ctypes.data, a.ctypes.data + a.nbytes) for *_, a in named if a.size)
        begins: list[int] = []
        last = 0
        for begin, end in ends:
            if begin >= last:
                begins.append(begin)
            last = max(last, end)
        numbers: dict[tuple[str, str], int | None] = {}
        order: dict[int, int] = {}
        for record, name, member, array in named:
            at = int(np.searchsorted(begins, array.ctypes.data, side="right"))
            number = order.setdefault(at if array.size else -len(order) - 1, len(order))
            numbers[type(record).__name__, name] = None if member.constant else number
        return numbers

    def of(self, array: Any, *, adjoint: bool = False) -> Any:
        """The copy of an array, or its adjoints."""
        if not array.size:
            return np.empty(array.shape, array.dtype)
        at = self.place(array.ctypes.data) + (SHADOW if adjoint else 0)
        return np.ndarray(array.shape, array.dtype, self._bytes, at, array.strides)

    def place(self, address: int) -> int:
        """Place in the block of what is at an address."""
        k = int(np.searchsorted(self.begins, address, side="right")) - 1
        return int(self.places[k] + address - self.begins[k])

    def rewind(self, recorded: int = 0) -> None:
        """Set the end of the tape, by default its beginning."""
        self._end[0] = self.tape + recorded

    @property
    def recorded(self) -> int:
        """[bytes] recorded length of the tape."""
        return int(self._end[0]) - self.tape

    def _moved(self, record: KernelRecord) -> Any:
        words, at = record.words.copy(), 0
        cls: Any = type(record)
        for array, member in zip(record.arrays, members(cls).values(), strict=True):
            if array.dtype != np.float32 and array.size:
                words[at] = self.base + self.place(array.ctypes.data)
            at += 2 + member.ndim
        return words
