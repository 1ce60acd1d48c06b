"""Compiled functions as the host sees them, their addresses in kernels, and code that is compiled by other means."""

from __future__ import annotations

import ctypes
import sys
from typing import Any

import numba
import numpy as np
import pytest

from meltemi.compiler import (
    CompilationError,
    EntryPoint,
    KernelRecord,
    Loaded,
    Single,
    Table,
    announced,
    by_address,
    call_address,
    compile_seconds,
    function_at,
    is_cached,
    is_compiled,
    is_compiled_for,
    last_line,
    linked_code,
    loose,
    machine_code,
    number,
    object_code,
    processor,
    record_like,
    types,
    versions,
    without_dispatch,
)

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="about compiled code")

NUMBER = types.float64
VECTOR = types.float64[::1]
SIGNATURE = types.void(VECTOR, NUMBER)


def scale(x: Any, factor: float) -> None:
    for i in range(len(x)):
        x[i] *= factor


class Counter(Table, title="counter"):
    """A number."""

    count: float = number("-", "of calls")


class Counters(KernelRecord):
    """A record of it."""

    counter: Single[Counter]


def test_versions_and_processor_are_named() -> None:
    assert versions()["numba"] == numba.__version__
    assert set(versions()) == {"numba", "llvmlite"}
    assert processor()


def test_what_a_function_is() -> None:
    plain, cached = numba.njit(scale), numba.njit(cache=True)(scale)
    assert is_compiled(plain)
    assert not is_compiled(scale)
    assert is_cached(cached)
    assert not is_cached(plain)
    fixed = numba.njit(SIGNATURE)(scale)
    assert is_compiled_for(fixed, SIGNATURE)
    assert not is_compiled_for(fixed, types.void(VECTOR, types.int64))
    plain(np.ones(2), 2.0)
    assert not is_compiled_for(plain, SIGNATURE)  # more may follow


def test_the_reason_of_an_error_is_at_its_end() -> None:
    with pytest.raises(CompilationError) as caught:
        numba.njit(lambda x: x.nothing)(1.0)
    assert "nothing" in str(caught.value)
    assert last_line(ValueError("first\n  second \n\n")) == "second"
    assert last_line(ValueError()) == "ValueError"


def test_calls_without_a_look_at_types() -> None:
    function, x = numba.njit(scale), np.array([1.0, 2.0])
    without_dispatch(function, x, 3.0)(x, 3.0)  # compiles it
    without_dispatch(function, x, 3.0)(x, 3.0)
    assert x.tolist() == [9.0, 18.0]
    assert len(function.overloads) == 1


def test_functions_by_their_addresses() -> None:
    x = np.array([1.0, 2.0])
    entries = [by_address(numba.njit(f), VECTOR, NUMBER) for f in (scale, lambda x, factor: scale_back(x, factor))]
    assert by_address(entries[0].function, VECTOR, NUMBER) is entries[0]

    @numba.njit
    def called(function: Any, x: Any) -> None:
        function(x, 4.0)

    for entry, expected in zip(entries, ([4.0, 8.0], [1.0, 2.0]), strict=True):
        called(entry, x)
        assert x.tolist() == expected
    assert len(called.overloads) == 1  # of one type
    entries[0](x, 2.0)
    assert x.tolist() == [2.0, 4.0]


@numba.njit  # type: ignore[untyped-decorator]
def scale_back(x: Any, factor: float) -> None:
    for i in range(len(x)):
        x[i] /= factor


def test_a_function_from_its_addresses() -> None:
    entry, x = EntryPoint(numba.njit(SIGNATURE)(scale), SIGNATURE), np.array([1.0, 2.0])
    at = function_at(entry.type)

    @numba.njit
    def called(wrapper: int, code: int, x: Any) -> None:
        at(wrapper, 0, code)(x, 5.0)

    called(entry.wrapper, entry.code, x)
    assert x.tolist() == [5.0, 10.0]


def test_a_c_function_from_the_bits_of_a_number() -> None:
    heard: list[float] = []
    callback = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_double)(lambda x: heard.append(x) or 7)
    address = ctypes.cast(callback, ctypes.c_void_p).value
    bits = np.array([address], dtype=np.int64).view(np.float64)[0]
    assert numba.njit(lambda bits: call_address(bits, 1.5))(bits) == 7
    assert heard == [1.5]


def test_a_record_from_its_address() -> None:
    one, other = (Counters("floats", {"counter": Counter.zeros()}) for _ in range(2))

    @numba.njit
    def count(like: Any, address: int) -> None:
        record_like(like, address).counter.count += 1.0

    count(one, other.address)
    assert (one.counter.count, other.counter.count) == (0.0, 1.0)


def square(x: Any) -> None:
    x[0] = inner(x[0])


@loose
def inner(x: float) -> float:
    return x * x


POINTER = types.CPointer(NUMBER)


def test_code_that_is_compiled_by_other_means() -> None:
    text, name = linked_code(square, [VECTOR])
    assert f"@{name}(" in text.replace('"', "")
    before = compile_seconds()
    with announced(square):
        code = machine_code("define i64 @twice(i64 %x) {\n  %y = shl i64 %x, 1\n  ret i64 %y\n}")
    assert compile_seconds() > before
    loaded = Loaded(code)
    assert ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(loaded.address("twice"))(21) == 42


def shout(x: Any) -> None:
    print(x[0])


def test_object_code_for_other_programs() -> None:
    code, foreign = object_code(square, [VECTOR], "law", ())
    assert not foreign
    assert b"law" in code
    magic = {"linux": b"\x7fELF", "darwin": b"\xcf\xfa\xed\xfe"}
    assert code.startswith(magic.get(sys.platform, b""))
    code, foreign = object_code(shout, [VECTOR], "law", ())
    assert foreign
    assert code == b""
