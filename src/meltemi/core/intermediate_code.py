"""LLVM code of a function with all kernels that it calls, for those who change it, or compile it by other means."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numba
from numba.core.compiler_lock import global_compiler_lock

from meltemi.core import linking
from meltemi.core.kernel import OPTIONS


def linked_code(function: Any, kinds: Sequence[Any]) -> tuple[str, str]:
    """Optimised LLVM code of a function with all that it calls, and the name of the function in it.

    Args:
      function: plain Python function.
      kinds: Numba's types of its arguments.
    """
    linked = numba.njit(pipeline_class=linking.LinkedCompiler, **OPTIONS)(function)
    found: list[Any] = []
    linked.add_overload = found.append
    linked.compile(tuple(kinds))
    library = found[0].library
    with global_compiler_lock:
        library._ensure_finalized()  # links what it calls
        super(linking.LinkedLibrary, library)._optimize_final_module()
        return str(library._get_module_for_linking()), found[0].fndesc.llvm_func_name
