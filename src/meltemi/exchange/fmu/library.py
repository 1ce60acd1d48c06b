"""Workarounds for the libraries of pythonfmu (0.7.0) and pythonfmu3 (0.3.4), which call Python."""

from __future__ import annotations

import atexit
import ctypes
import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

END = "finalizePythonInterpreter"


def keep(names: dict[str, Any]) -> None:
    """Add a reference to the namespace of a script each time it runs.

    The library of pythonfmu runs the script for each instance and then releases a reference that it only borrowed.
    Without this one the namespace vanishes with the second instance or at the next garbage collection.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(names))


def end_with_python(path: str | Path) -> None:
    """Unload a library of this kind from the process together with Python.

    On Linux it may stay loaded to the end of the process and would then be finalised twice: it frees memory a second
    time, and one process in thirty aborts. Other libraries are not changed.
    """
    if sys.platform == "linux":
        with suppress(OSError):  # it is not loaded
            library = ctypes.CDLL(str(path), mode=os.RTLD_NOLOAD)  # which keeps it loaded
            if hasattr(library, END):
                atexit.register(getattr(library, END))
