"""The compiler layer: kernels, number types, records and tables, and all that the package needs from Numba and LLVM.

Physics imports the names that the stub beside this file declares, such as ``from meltemi.compiler import kernel``, and
no module of Numba; a new version of Numba is a matter of this package (docs: What a new version of Numba can break).
"""

import sys
from importlib import import_module
from typing import Any

from meltemi.namespaces import public

_get, __dir__ = public(__name__, explain=False)


def __getattr__(name: str) -> Any:
    value = _get(name)
    if "numba" in sys.modules:
        import_module("meltemi.compiler.record_types")  # by it kernels know what tables and records are
    return value
