"""Controllers of the test bench by name: built-in ones, libraries, Python files and functions."""

from __future__ import annotations

import hashlib
import inspect
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
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


Entry = Controller | Callable[[Turbine], Controller] | str
"""A controller, a function of the turbine that returns one, or a name."""


@dataclass(frozen=True)
class Contender:
    """A controller on the bench.

    Attributes:
      name: in tables.
      controller: in production.
      operating: in starts, stops and grid losses: the same with the supervisor where it has one of meltemi's.
      about: what it is.
    """

    name: str
    controller: Controller = field(repr=False)
    operating: Controller = field(repr=False)
    about: str = ""


def contenders(
    entries: Mapping[str, Entry], model: BladedModel, *, progress: Callable[[float], None] | None = None
) -> list[Contender]:
    """Controllers for a turbine, in their order.

    Args:
      entries: by label. Names are ``baseline``, ``rosco``, a scheme of ``meltemi compare``, A0 to A3, the path of a
        library or of a Python file with ``controller(turbine)``, or ``module:function``; libraries with their input
        file after ``@``.
      model: of the turbine with the actuators that the schemes require; controllers are made for it.
      progress: callback with the completed fraction of the tuning.

    Raises:
      InputError: a name is unknown, a file or function is missing, or makes no controller.
    """
    designed = list(dict.fromkeys(entry for entry in entries.values() if isinstance(entry, str) and entry in SCHEMES))
    tuned = design_controllers(model, designed, progress=progress) if designed else None
    turbine, found = model.turbine, []
    for label, entry in entries.items():
        if isinstance(entry, Controller):
            found.append(Contender(label, entry, entry, f"controller {entry.name}"))
        elif callable(entry):
            made = checked_controller(label, entry, turbine)
            found.append(Contender(label, made, made, f"function {getattr(entry, '__name__', type(entry).__name__)}"))
        elif entry == BASELINE:
            plain = BaselineController(turbine)
            found.append(Contender(label, plain, SupervisedController(turbine), "baseline controller of the turbine"))
        elif tuned is not None and entry in SCHEMES:
            operating = SupervisedController(turbine, load=tuned.settings[entry])
            found.append(
                Contender(label, tuned.controllers[entry], operating, f"scheme {entry}: {SCHEMES[entry].about}")
            )
        elif entry.upper() in POWER_SCHEMES:
            scheme = PowerControl.model_validate({"scheme": entry.upper()})
            power = CoordinatedController(turbine, performance_of(turbine), power=scheme)
            found.append(Contender(label, power, power, f"power control, scheme {entry.upper()}"))
        else:
            made, about = _external(entry, label, turbine)
            found.append(Contender(label, made, made, about))
    return found


def labelled(names: Sequence[str]) -> dict[str, str]:
    """Names by label, that of files without folder and ending.

    Raises:
      InputError: two have the same label.
    """
    labels = [_label(name) for name in names]
    for label in labels:
        if labels.count(label) > 1:
            raise InputError(f"controllers: two of them are called {label!r}")
    return dict(zip(labels, names, strict=True))


def check_names(names: Iterable[str]) -> None:
    """Check names without making anything.

    Raises:
      InputError: a name is unknown, or a file is missing.
    """
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


def digest_of(name: str) -> str:
    """Hash of the files or source of a named controller, so that runs of an earlier version are not taken over.

    Raises:
      InputError: a file or function is missing.
    """
    source, _, given = name.partition("@")
    if source == ROSCO or Path(source).suffix in LIBRARIES:
        library = find_rosco() if source == ROSCO else Path(source)
        return _hash(bytes_of(library, 10**9) + (bytes_of(Path(given)) if given else b""))
    if is_file(name):
        return _hash(bytes_of(Path(name)))
    if name in NAMES or name.upper() in NAMES:
        return ""
    try:
        return _hash(inspect.getsource(sys.modules[_function(name).__module__]).encode())
    except (OSError, TypeError, KeyError):
        return os.urandom(16).hex()


def _hash(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _label(name: str) -> str:
    path = Path(name.partition("@")[0])
    return path.stem if path.suffix in (".py", *LIBRARIES) else name.partition("@")[0]


def _external(name: str, label: str, turbine: Turbine) -> tuple[Controller, str]:
    """The controller of a library, a file or a function, and what it is."""
    source, _, given = name.partition("@")
    if source == ROSCO or Path(source).suffix in LIBRARIES:
        library = find_rosco() if source == ROSCO else Path(source)
        file = Path(given) if given else None
        if file is None and source == ROSCO:
            if turbine.name not in EXAMPLES:
                raise InputError(f"controller rosco: needs its input file for {turbine.name}: rosco@DISCON.IN")
            file = rosco_example(EXAMPLES[turbine.name])
        about = f"library {library.name}" + (f" with {file.name}" if file else "")
        return BladedController(turbine, library, file, name=label), about
    if is_file(name):
        return own_controller(name, turbine), name
    return checked_controller(name, _function(name), turbine), f"function {name}"


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
