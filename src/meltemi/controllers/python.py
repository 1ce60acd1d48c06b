"""Controllers in Python: functions of the turbine, in files and modules."""

from __future__ import annotations

import hashlib
import inspect
import sys
from collections.abc import Callable
from functools import lru_cache, partial
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

from meltemi.control.controller import Controller
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.files import bytes_of


def is_path(file: str) -> bool:
    """Whether a controller is in a file, of Python or an FMU, and not in a module that is imported by its name."""
    return file.endswith((".py", ".fmu"))


def function_of(file: str, name: str) -> Callable[[Any], object]:
    """The function of a Python file or module.

    Raises:
      InputError: the file or module is missing or cannot be run, or has no such function.
    """
    if file.endswith(".fmu"):
        from meltemi.io import fmu_controller

        return partial(fmu_controller, file)
    where = file if is_path(file) else f"controller {file}:{name}"
    module = _of_file(file, _digest(file)) if is_path(file) else _imported(file, where)
    attribute = getattr(module, name, None)
    if not callable(attribute):
        names = [n for n, x in vars(module).items() if inspect.isfunction(x) and x.__module__ == module.__name__]
        hint = did_you_mean(name, names) if names else "it has no functions"
        raise InputError(
            f"{where}: expected a function {name}(turbine) that returns a meltemi.Controller; there is no function "
            f"{name!r}; {hint}"
        )
    function: Callable[[Any], object] = attribute
    return function


def checked_controller(where: str, make: Callable[[Any], object], turbine: Any) -> Controller:
    """The controller that a user's function creates for a turbine.

    Raises:
      InputError: the function raises, or returns no controller.
    """
    try:
        controller = make(turbine)
    except Exception as error:
        if where.endswith(".fmu") and isinstance(error, InputError):
            raise
        raise InputError(f"{where}: controller(turbine) raised {type(error).__name__}: {error}") from error
    if not isinstance(controller, Controller):
        raise InputError(
            f"{where}: controller(turbine) must return a meltemi.Controller, found {type(controller).__name__}"
        )
    return controller


def _digest(path: str) -> str:
    return hashlib.sha256(bytes_of(Path(path))).hexdigest()


@lru_cache(maxsize=16)
def _of_file(path: str, digest: str) -> ModuleType:
    """The module of a file, which is executed once for each content (hash)."""
    name = f"meltemi_user_{Path(path).stem}_{digest[:8]}"
    spec = spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: expected a Python file (.py)")
    module = module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise InputError(f"{path}: {type(error).__name__}: {error}") from error
    return module


def _imported(name: str, where: str) -> ModuleType:
    """A module by its name; the working folder is searched first."""
    folder = str(Path.cwd())
    if folder not in sys.path:
        sys.path.insert(0, folder)
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        near = [p.stem for p in Path().glob("*.py")]
        hint = did_you_mean(name, near) if near else ""
        if error.name not in (name.partition(".")[0], name):
            raise InputError(f"{where}: the import of {name} failed: {error}") from error
        words = f"; {hint}" if hint.startswith("did") else ""
        raise InputError(f"{where}: there is no module {name!r} here or installed{words}") from None
    except Exception as error:
        raise InputError(f"{where}: {name} raised {type(error).__name__}: {error}") from error
