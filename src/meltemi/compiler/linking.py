"""Kernels that kernels call: compiled for linking, without machine code of their own.

Numba generates machine code for each compiled function, which contains that of all functions it calls. Kernels call
each other eight levels deep, so most of that code would never be used by itself. Here a kernel has two compiled forms:
the one that the host calls has machine code; the one that kernels call is optimised intermediate code, linked into
them. Both are compiled, and cached, independently, so that machine code does not depend on the order of compilation.

The linker knows a function by its name. What tells functions apart that differ only in their closures, such as choices
between variants, is a number in it, which Numba counts anew in each process: a function of the cache and one of this
process could have the same name, and a kernel would call the wrong one. Here the numbers are random.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from inspect import signature
from itertools import zip_longest
from secrets import randbits
from typing import Any

import llvmlite.binding
from numba.core import types
from numba.core.bytecode import FunctionIdentity
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NativeLowering
from numba.core.types.misc import unliteral

FunctionIdentity._unique_ids = iter(partial(randbits, 62), None)
FUNCTIONS = types.Callable, types.FunctionType
NARROWER: dict[type, Callable[[Any, Any, str], Any]] = {}
"""For a class of Numba types: the type that a function takes as its parameter of a name if one of them is passed."""


class LinkedLibrary(JITCodeLibrary):  # type: ignore[misc]
    """Intermediate code of a function and of those it calls.

    Numba's passes over single functions and its cheap ones over the module have optimised it: those that take most time
    run once, on the code of which machine code is generated.
    """

    def _optimize_final_module(self) -> None:
        manager, builder = self._codegen._module_pass_manager(
            loop_vectorize=False, slp_vectorize=False, opt=0, cost="cheap"
        )
        manager.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class Key:
    """Identity of a compiled function that has no entry point."""


@register_pass(mutates_CFG=True, analysis_only=False)
class LinkedLowering(NativeLowering):  # type: ignore[misc]
    """Numba's last pass, without machine code."""

    _name = "meltemi_linked_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower a function whose types are known."""
        state.library = LinkedLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = state.flags.no_cpython_wrapper = state.flags.no_cfunc_wrapper = True
        super().run_pass(state)
        lowered, key = state["cr"], Key()
        state.targetctx.insert_user_function(key, lowered.fndesc, [state.library])
        state["cr"] = lowered._replace(cfunc=key)
        return True


class LinkedCompiler(CompilerBase):  # type: ignore[misc]
    """Numba's compiler with that pass."""

    def define_pipelines(self) -> list[Any]:
        """The one pipeline."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.passes = [(LinkedLowering if p is NativeLowering else p, words) for p, words in passes.passes]
        passes.finalize()
        return [passes]


def to_bytes(cres: Any) -> tuple[Any, ...]:
    """Bytes of a linked function for the cache."""
    cres.fndesc.typemap = cres.fndesc.calltypes = None
    code = cres.library._get_module_for_linking().as_bitcode()
    return cres.library.name, code, cres.fndesc, cres.environment, cres.signature


def from_bytes(context: Any, kept: tuple[Any, ...]) -> Any:
    """A linked function of the cache."""
    name, code, fndesc, environment, signature = kept
    library = LinkedLibrary(context.codegen(), name)
    library._final_module = llvmlite.binding.parse_bitcode(code)
    library._finalize_final_module()
    return CompileResult(
        target_context=context,
        typing_context=context.typing_context,
        library=library,
        environment=environment,
        entry_point=Key(),
        fndesc=fndesc,
        type_annotation=None,
        signature=signature,
        objectmode=False,
        lifted=(),
        typing_error=None,
        call_helper=None,
        metadata=None,
        reload_init=[],
        referenced_envs=(),
    )


def link_from(dispatcher: Any, linked: Any) -> None:
    """Make kernels that call ``dispatcher`` link ``linked``, the same function compiled by :class:`LinkedCompiler`.

    Calls with different constants share one compilation: Numba separates f(A, 3) and f(A, 6). So do calls with records
    of which it takes a part, unless a function is passed, which may take all of it.
    """
    names = list(signature(dispatcher.py_func).parameters)

    def add_overload(cres: Any) -> None:  # without an entry point for calls from Python
        linked.overloads[tuple(cres.signature.args)] = cres

    def get_call_template(arguments: Any, keywords: Any) -> Any:
        narrower = {} if any(isinstance(kind, FUNCTIONS) for kind in arguments) else NARROWER

        def taken(name: str, kind: Any) -> Any:
            narrow = narrower.get(type(kind))
            return narrow(kind, dispatcher.py_func, name) if narrow else unliteral(kind)

        positional = zip_longest(names[: len(arguments)], arguments, fillvalue="")
        return resolve(
            tuple(taken(*each) for each in positional), {name: taken(name, kind) for name, kind in keywords.items()}
        )

    linked.add_overload, resolve = add_overload, linked.get_call_template
    dispatcher.get_call_template, dispatcher.get_overload = get_call_template, linked.get_overload
