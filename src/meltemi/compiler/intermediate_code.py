"""LLVM code of a function with all kernels that it calls, for those who change it, or compile it by other means."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import llvmlite.binding as llvm
import numba
from numba.core import event
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

from meltemi.compiler import linking
from meltemi.compiler.kernels import OPTIONS
from meltemi.compiler.lanes import REVERSE


def linked_code(function: Any, kinds: Sequence[Any]) -> tuple[str, str]:
    """Optimised LLVM code of a function with all that it calls, and the name of the function in it.

    Args:
      function: plain Python function.
      kinds: Numba's types of its arguments.
    """
    linked = numba.njit(pipeline_class=linking.LinkedCompiler, **OPTIONS)(function)
    libraries: list[Any] = []
    linked.add_overload = libraries.append
    linked.compile(tuple(kinds))
    library = libraries[0].library
    with global_compiler_lock:
        library._ensure_finalized()  # links what it calls
        super(linking.LinkedLibrary, library)._optimize_final_module()
        return str(library._get_module_for_linking()), libraries[0].fndesc.llvm_func_name


@contextmanager
def announced(function: Any) -> Iterator[None]:
    """Count and announce what is compiled within, as Numba's compilation of a function."""
    with event.trigger_event("numba:compile", {"dispatcher": SimpleNamespace(py_func=function), "args": ()}):
        yield


# machine code in this process -----------------------------------------------------------------------


def reverse_code(text: str) -> str:
    """The code for reverse differentiation: what is never evaluated there is left out."""
    module = llvm.parse_assembly(
        re.sub(rf"^@{REVERSE} = .*$", f"@{REVERSE} = internal constant i64 1", text, flags=re.M)
    )
    passes = llvm.create_new_module_pass_manager()
    passes.add_sccp_pass()
    passes.add_simplify_cfg_pass()
    passes.add_loop_simplify_pass()  # what follows a loop is reached from it only
    target = llvm.Target.from_default_triple().create_target_machine()
    passes.run(module, llvm.create_pass_builder(target, llvm.create_pipeline_tuning_options(speed_level=1)))
    return str(module)


def target_name() -> str:
    """Target of :func:`machine_code`, on which machine code depends beside the code: processor and version of LLVM."""
    return f"{_processor()} {llvm.llvm_version_info}"


def _processor() -> tuple[str, str]:
    """Processor and features of Numba's machine code: of this machine, or by ``NUMBA_CPU_NAME``."""
    _, name, features = cpu_target.target_context.codegen().magic_tuple()
    return name, features


def machine_code(text: str) -> bytes:
    """Machine code of LLVM code for this processor."""
    module, machine = llvm.parse_assembly(text), _machine()
    module.verify()
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    options.loop_vectorization = options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return bytes(machine.emit_object(module))


def _machine() -> Any:
    name, features = _processor()
    return llvm.Target.from_default_triple().create_target_machine(cpu=name, features=features, opt=3, jit=True)


class Loaded:
    """Machine code of :func:`machine_code`, ready to be called; it lives as long as this object."""

    def __init__(self, code: bytes) -> None:
        self._engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
        self._engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        self._engine.finalize_object()

    def address(self, name: str) -> int:
        """Address of a function."""
        return int(self._engine.get_function_address(name))


# object files for other programs --------------------------------------------------------------------


def object_code(function: Any, kinds: Sequence[Any], name: str, allowed: Collection[str]) -> tuple[bytes, list[str]]:
    """Object code of a function for any processor of this platform, and what it needs and a program may not have.

    Args:
      function: plain Python function.
      kinds: Numba's types of its arguments.
      name: name of the function in the object file, which hides all others.
      allowed: names of external functions that any program has.
    """
    code, inside = linked_code(function, kinds)
    module = llvm.parse_assembly(code)
    for each in module.functions:
        if each.name == inside:
            each.name, each.linkage = name, "external"
            each.visibility = "hidden"
        elif not each.is_declaration:
            each.linkage = "internal"
    for value in module.global_variables:  # environments of Python, which nothing reads
        if value.linkage == llvm.Linkage.common:
            value.linkage = "internal"
    target = llvm.Target.from_triple(llvm.get_process_triple())
    machine = target.create_target_machine(opt=3, reloc="pic", codemodel="default")
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=0)))
    declared = [each.name for each in module.functions if each.is_declaration]
    foreign = sorted(each for each in declared if not each.startswith("llvm.") and each not in allowed)
    if not foreign and re.search(r"inttoptr \(i64 -?\d+ to ptr\)", str(module)):
        foreign = ["an address of this process"]
    return (b"" if foreign else bytes(machine.emit_object(module))), foreign
