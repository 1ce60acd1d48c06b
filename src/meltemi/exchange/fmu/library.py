"""What the libraries of pythonfmu (0.7.0) and pythonfmu3 (0.3.4), which call Python, leave undone."""

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
    """Count a reference to the names of a script, once each time that it runs.

    The library of pythonfmu runs it for each instance, and then returns a reference that it only borrowed. Without
    this one the names vanish, with the second instance or when Python collects what it no longer needs.
    """
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(names))


def end_with_python(path: str | Path) -> None:
    """End a library of these kinds, which this process has loaded, together with Python.

    On Linux it may stay loaded to the end of the process, and would then end twice: what it frees the second time is no
    longer its own, and one process in thirty aborts. Other libraries are left alone.
    """
    if sys.platform == "linux":
        with suppress(OSError):  # it is not loaded
            library = ctypes.CDLL(str(path), mode=os.RTLD_NOLOAD)  # which keeps it loaded
            if hasattr(library, END):
                atexit.register(getattr(library, END))
