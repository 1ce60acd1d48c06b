"""Controllers of the test bench by name: built-in ones, libraries, Python files and functions."""

from __future__ import annotations

import hashlib
import inspect
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

from meltemi.control.baseline import BaselineController
from meltemi.control.bladed.controller import BladedController
from meltemi.control.bladed.rosco import SUFFIXES, find_rosco, rosco_example
from meltemi.control.controller import Controller
from meltemi.control.coordinated import CoordinatedController
from meltemi.control.power_control.settings import SCHEMES as POWER_SCHEMES
from meltemi.control.power_control.settings import PowerControl
from meltemi.control.supervisor.supervised import SupervisedController
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.files import bytes_of
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.performance import performance_of
from meltemi.studies.scheme_names import SCHEMES, is_file
from meltemi.studies.schemes import checked_controller, design_controllers, own_controller
from meltemi.turbine.definition import Turbine

ROSCO, BASELINE = "rosco", "baseline"
EXAMPLES = {"nrel5mw": "Test_Cases/NREL-5MW/DISCON.IN"}
"""Input files of ROSCO's own examples, by turbine."""
LIBRARIES = tuple(SUFFIXES)
NAMES = (BASELINE, ROSCO, *SCHEMES, *POWER_SCHEMES)


@dataclass(frozen=True)
class Contender:
    """A controller on the bench.

    Attributes:
      name: in tables.
      controller: in production.
      operating: in starts, stops and grid losses: the same with the supervisor where it has one of meltemi's.
      about: what it is.
      digest: of its files and sources, so that finished runs of an earlier version are not reused.
    """

    name: str
    controller: Controller = field(repr=False)
    operating: Controller = field(repr=False)
    about: str = ""
    digest: str = ""


def contenders(
    names: Sequence[str],
    model: BladedModel,
    turbine_name: str,
    *,
    progress: Callable[[float], None] | None = None,
) -> list[Contender]:
    """Controllers by name, in their order.

    Args:
      names: ``baseline``, ``rosco``, a scheme of ``meltemi compare``, A0 to A3, the path of a library or of a Python
        file with ``controller(turbine)``, or ``module:function``; libraries with their input file after ``@``.
      model: of the turbine with the actuators that the schemes require; controllers are made for it.
      turbine_name: in the library, which selects ROSCO's example input.
      progress: callback with the completed fraction of the tuning.

    Raises:
      InputError: a name is unknown or repeated, a file or function is missing, or makes no controller.
    """
    check_names(names)
    designed = [name for name in names if name in SCHEMES]
    tuned = design_controllers(model, designed, progress=progress) if designed else None
    turbine, found = model.turbine, []
    for name in names:
        if name == BASELINE:
            plain = BaselineController(turbine)
            found.append(Contender(name, plain, SupervisedController(turbine), "baseline controller of the turbine"))
        elif tuned is not None and name in SCHEMES:
            settings = tuned.settings[name]
            operating = SupervisedController(turbine, load=settings)
            found.append(Contender(name, tuned.controllers[name], operating, SCHEMES[name].about))
        elif name.upper() in POWER_SCHEMES:
            scheme = PowerControl.model_validate({"scheme": name.upper()})
            power = CoordinatedController(turbine, performance_of(turbine), power=scheme)
            found.append(Contender(name, power, power, f"power control, scheme {name.upper()}"))
        else:
            found.append(_external(name, turbine, turbine_name))
    return found


def check_names(names: Sequence[str]) -> None:
    """Check names without making anything.

    Raises:
      InputError: see :func:`contenders`.
    """
    if not names:
        raise InputError(f"controllers: name at least one of {', '.join(NAMES)}, a library, or module:function")
    for name in names:
        path = Path(name.partition("@")[0])
        if path.suffix in LIBRARIES or is_file(name):
            if not path.is_file():
                beside = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else []
                hint = did_you_mean(path.name, beside)
                raise InputError(f"{path}: there is no such file{f'; {hint}' if hint.startswith('did') else ''}")
        elif name.partition("@")[0] != ROSCO and name not in NAMES and name.upper() not in NAMES and ":" not in name:
            raise InputError(
                f"no controller {name!r}: {did_you_mean(name, NAMES)} "
                "(or give a library, a Python file, or module:function)"
            )
    labels = [_label(name) for name in names]
    for label in labels:
        if labels.count(label) > 1:
            raise InputError(f"controllers: two of them are called {label!r}")


def _label(name: str) -> str:
    path = Path(name.partition("@")[0])
    return path.stem if path.suffix in (".py", *LIBRARIES) else name.partition("@")[0]


def _external(name: str, turbine: Turbine, turbine_name: str) -> Contender:
    source, _, given = name.partition("@")
    label = _label(name)
    if source == ROSCO or Path(source).suffix in LIBRARIES:
        library = find_rosco() if source == ROSCO else Path(source)
        file = Path(given) if given else None
        if file is None and source == ROSCO:
            if turbine_name not in EXAMPLES:
                raise InputError(f"controller rosco: needs its input file for {turbine_name}: rosco@DISCON.IN")
            file = rosco_example(EXAMPLES[turbine_name])
        made = BladedController(turbine, library, file, name=label)
        digest = hashlib.sha256(bytes_of(library, 10**9) + (bytes_of(file) if file else b"")).hexdigest()
        about = f"library {library.name}" + (f" with {file.name}" if file else "")
        return Contender(label, made, made, about, digest)
    if is_file(name):
        made = own_controller(name, turbine)
        return Contender(label, made, made, name, hashlib.sha256(bytes_of(Path(name))).hexdigest())
    function = _function(name)
    made = checked_controller(name, function, turbine)
    try:
        text = inspect.getsource(sys.modules[function.__module__])
    except (OSError, TypeError, KeyError):
        text = os.urandom(16).hex()
    return Contender(label, made, made, f"function {name}", hashlib.sha256(text.encode()).hexdigest())


def _function(name: str) -> Callable[[Turbine], object]:
    """The function of ``module:function``; the working folder is searched first."""
    module_name, _, function_name = name.partition(":")
    if not module_name or not function_name:
        raise InputError(f"controller {name!r}: expected module:function, such as my_controller:controller")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        module = import_module(module_name)
    except ModuleNotFoundError as error:
        near = [p.stem for p in Path().glob("*.py")]
        hint = did_you_mean(module_name, near) if near else ""
        if error.name != module_name.partition(".")[0] and error.name != module_name:
            raise InputError(f"controller {name}: the import of {module_name} failed: {error}") from error
        words = f"; {hint}" if hint.startswith("did") else ""
        raise InputError(f"controller {name}: there is no module {module_name!r} here or installed{words}") from None
    except Exception as error:
        raise InputError(f"controller {name}: {module_name} raised {type(error).__name__}: {error}") from error
    found = getattr(module, function_name, None)
    if not callable(found):
        own = [n for n, x in vars(module).items() if inspect.isfunction(x) and x.__module__ == module.__name__]
        hint = did_you_mean(function_name, own) if own else "it has no functions"
        raise InputError(f"controller {name}: {module_name} has no function {function_name!r}; {hint}")
    function: Callable[[Turbine], object] = found
    return function
