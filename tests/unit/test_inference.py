"""Type inference asks Numba's templates once for a function and types of arguments."""

from __future__ import annotations

from typing import Any

import numba
import pytest
from numba.core import types
from numba.core.types.functions import BaseFunction

from meltemi.compiler import inference


def test_a_signature_is_searched_for_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def search(self: BaseFunction, context: Any, args: Any, kws: Any) -> Any:
        asked.append((self.typing_key, tuple(args)))
        return found(self, context, args, kws)

    found = inference._search
    monkeypatch.setattr(inference, "_search", search)

    def sums(a: float, b: int) -> tuple[float, int, float]:
        return a + a + a + a, b + b, a + b

    assert numba.njit(sums)(1.5, 2) == (6.0, 4, 3.5)
    again = len(asked)
    assert len(set(asked)) == again
    assert numba.njit(lambda a: a + a)(1.5) == 3.0  # in another function it is known, too
    assert [each for each in asked[again:] if each[1] == (types.float64, types.float64)] == []


def test_what_fails_is_told_each_time() -> None:
    for _ in range(2):
        with pytest.raises(numba.TypingError, match="No implementation of function"):
            numba.njit(lambda a: a + "text")(1.5)


def test_what_is_remembered_is_not_stored_with_compiled_code(monkeypatch: pytest.MonkeyPatch) -> None:
    """Types of functions are pickled with code that refers to them; the context of inference cannot be."""
    monkeypatch.setattr(inference, "_search", lambda *_: None)
    kind = types.Function(next(iter(inference._SIGNATURES)).templates[0])
    before = dict(vars(kind))
    context = object()
    assert inference._remembered(kind, context, (types.int8,), {}) is None
    assert vars(kind) == before and kind in inference._SIGNATURES
