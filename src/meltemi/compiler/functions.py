"""Compiled functions as the host sees them: what they are, their addresses, and calls without a look at types."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import llvmlite
import llvmlite.binding
import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.caching import NullCache
from numba.core.dispatcher import Dispatcher
from numba.core.errors import NumbaError
from numba.experimental.function_type import FunctionModel
from numba.extending import NativeValue, intrinsic, register_model, typeof_impl, unbox

CompilationError = NumbaError
"""Error of a function that Numba cannot compile; :func:`last_line` has the reason."""


def interpreted() -> bool:
    """Whether kernels run as plain Python: ``NUMBA_DISABLE_JIT`` is set."""
    return bool(numba.config.DISABLE_JIT)


def versions() -> dict[str, str]:
    """Versions of Numba and llvmlite."""
    return {"numba": numba.__version__, "llvmlite": llvmlite.__version__}


def llvm_version() -> str:
    """Version of LLVM."""
    return ".".join(map(str, llvmlite.binding.llvm_version_info))


def processor() -> str:
    """LLVM's name of the processor of this machine."""
    return str(llvmlite.binding.get_host_cpu_name())


def is_compiled(function: Any) -> bool:
    """Whether a function is compiled by Numba, not plain Python."""
    return isinstance(function, Dispatcher)


def is_cached(function: Any) -> bool:
    """Whether the author of a compiled function asked Numba to keep its machine code."""
    return not isinstance(function._cache, NullCache)


def is_compiled_for(function: Any, signature: Any) -> bool:
    """Whether a compiled function has this signature and no other, so that nothing else can be compiled of it."""
    return [s.args for s in function.nopython_signatures] == [signature.args] and not function._can_compile


def last_line(error: BaseException) -> str:
    """The last line of a message of Numba, where the cause is."""
    return ([line.strip() for line in str(error).splitlines() if line.strip()] or [type(error).__name__])[-1]


def compile_for_kernels(function: Any, *kinds: Any) -> None:
    """Compile the form of a kernel that other kernels link, for arguments of given types."""
    function.get_call_template(kinds, {})


def without_dispatch(function: Any, *arguments: Any) -> Any:
    """The form of a kernel for such arguments, which does not look for their types in every call: 20 us less."""
    if interpreted():
        return function
    kinds = tuple(map(numba.typeof, arguments))
    compiled = function.overloads.get(kinds)
    return compiled.entry_point if compiled else function.compile(kinds)


# functions and records by their addresses, in kernels ---------------------------------------------


class EntryType(types.FunctionType):
    """Numba's type of functions, whose addresses are found once, not in each call: 25 us less."""


class EntryPoint:
    """A compiled function with its addresses, as an argument of kernels.

    Args:
      function: compiled for the signature.
      signature: Numba's signature, such as ``types.void(types.float64)``.
    """

    def __init__(self, function: Any, signature: Any) -> None:
        compiled = function.get_compile_result(signature)
        self.function, self.type = function, EntryType(signature)
        self.wrapper, self.code = (
            compiled.library.get_pointer_to_function(name)
            for name in (compiled.fndesc.llvm_cfunc_wrapper_name, compiled.fndesc.llvm_func_name)
        )

    def __call__(self, *arguments: Any) -> None:
        """Call the function."""
        self.function(*arguments)


register_model(EntryType)(FunctionModel)


@typeof_impl.register(EntryPoint)
def _typeof(value: EntryPoint, context: Any) -> Any:
    return value.type


@unbox(EntryType)
def _unbox(kind: Any, value: Any, c: Any) -> Any:
    proxy = cgutils.create_struct_proxy(kind)(c.context, c.builder)
    proxy.py_addr = c.builder.bitcast(value, proxy.py_addr.type)
    for field, name in (("c_addr", "wrapper"), ("jit_addr", "code")):
        number = c.pyapi.object_getattr_string(value, name)
        setattr(proxy, field, c.pyapi.long_as_voidptr(number))
        c.pyapi.decref(number)
    return NativeValue(proxy._getvalue())


@cache
def by_address(function: Any, *kinds: Any) -> Any:
    """A kernel for arguments of given types, to be passed to kernels whose machine code it is not to become part of."""
    return function if interpreted() else EntryPoint(function, types.void(*kinds))


def function_at(kind: EntryType) -> Callable[[int, int, int], Any]:
    """Function for kernels, ``(c, py, jit)``: a function of this type from its three addresses."""

    @intrinsic
    def function(typing_context: Any, c: Any, py: Any, jit: Any) -> Any:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            proxy, pointer = cgutils.create_struct_proxy(kind)(context, builder), ir.IntType(8).as_pointer()
            proxy.c_addr, proxy.py_addr, proxy.jit_addr = (builder.inttoptr(a, pointer) for a in arguments)
            return proxy._getvalue()

        return kind(types.int64, types.int64, types.int64), generate

    return function


@intrinsic
def call_address(typing_context: Any, address: Any, x: Any) -> Any:
    """Call the C function ``int64 f(double)`` whose address is stored in the bits of a float."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        i64, f64 = ir.IntType(64), ir.DoubleType()
        function = ir.FunctionType(i64, [f64]).as_pointer()
        return builder.call(builder.inttoptr(builder.bitcast(arguments[0], i64), function), [arguments[1]])

    return types.int64(types.float64, types.float64), generate


@intrinsic
def record_like(typing_context: Any, like: Any, address: Any) -> Any:
    """The record, of the same type as ``like``, whose words are at an address."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[1], ir.IntType(64).as_pointer())

    return like(like, types.int64), generate
