"""Controllers as data: records of case files, from a name or file, and their hashes."""

from __future__ import annotations

import hashlib
import inspect
import json
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from meltemi.bladed_controllers.controller import check_library
from meltemi.bladed_controllers.rosco import find_rosco
from meltemi.control_laws.load_control import LoadControl
from meltemi.control_laws.yaw import YawControl
from meltemi.controllers.names import SCHEMES, controller_keys, need_flaps
from meltemi.controllers.python import function_of, is_path
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.files import bytes_of
from meltemi.core.record import Record
from meltemi.power_control.coordinated import Coordination
from meltemi.power_control.settings import PowerControl
from meltemi.supervisor.settings import Supervision
from meltemi.supervisor.threshold import YawProtection

ROSCO = "rosco"
"""Path of a library that stands for the library of the installed rosco package."""
LARGEST_LIBRARY = 10**9
"""[bytes] largest size of a controller library."""
QUOTED = re.compile(r"""["']([^"'\n]+)["']""")


def _scheme(name: str) -> str:
    if name not in SCHEMES:
        raise ValueError(f"no scheme {name!r}: {did_you_mean(name, SCHEMES)}")
    return name


SchemeName = Annotated[str, BeforeValidator(_scheme)]


class BaselineCase(Record):
    """The baseline controller with the turbine's settings."""

    kind: Literal["baseline"] = "baseline"
    yaw: YawControl | None = None
    """Additional active yaw control, which needs ``options: {yaw: driven}``; none by default."""
    scheme: SchemeName | None = None
    """Control scheme whose load control is added, e.g. ipc, tuned for the turbine; flaps are added where it needs
    them and the turbine has none."""
    load: LoadControl | None = None
    """Load control by individual pitch and flaps; with ``scheme`` in place of its tuning."""

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if self.yaw is not None and (self.load is not None or self.scheme is not None):
            raise ValueError("yaw: together with load control it is in kind: supervised, or power")
        return self


class LibraryCase(Record):
    """A Bladed-style controller library."""

    kind: Literal["bladed"]
    library: str
    """Path, relative to the case file; ``rosco`` is that of the installed rosco package."""
    input: str | None = None
    """Path of the library's input file, e.g. DISCON.IN, relative to the case file."""
    procedure: str = "DISCON"
    """Name of the function in the library."""
    sample_time: float | None = Field(default=None, gt=0.0)
    """[s] sample time; by default the time step of the simulation."""
    individual_pitch: bool = True
    """Use the pitch demand of each blade instead of the collective one."""
    timeout: float = Field(default=10.0, gt=0.0)
    """[s] longest wall time of a call; three times as long for the first one."""


class SupervisedCase(Record):
    """Supervisory control: starts, stops and protects the turbine."""

    kind: Literal["supervised"]
    supervision: Supervision = Supervision()
    """Conditions for start, stop and trip."""
    scheme: SchemeName | None = None
    """Control scheme whose load control acts in production, as for ``baseline``."""
    load: LoadControl | None = None
    """Load control in production; by default the collective controller only; with ``scheme`` in place of its tuning."""
    yaw: YawControl | None = None
    """Yaw control; requires options: {yaw: driven}."""
    protection: YawProtection | None = None
    """Yaw error protection."""
    sample_time: float | None = Field(default=None, gt=0.0)
    """[s] sample time; by default the time step of the simulation."""


class PowerCase(PowerControl):
    """Power control: optimal torque or tip-speed ratio, power reference, frequency; coordinated with yaw and pitch."""

    kind: Literal["power"]
    yaw: YawControl | None = None
    """Yaw control; requires options: {yaw: driven}."""
    relief: Coordination | None = None
    """Widens the dead band of the yaw control with surplus power; requires yaw."""
    load: LoadControl | None = None
    """Load control by individual pitch and flaps."""
    sample_time: float | None = Field(default=None, gt=0.0)
    """[s] sample time; by default the time step of the simulation."""


class PythonCase(Record):
    """A controller in Python, which a function of the turbine creates."""

    kind: Literal["python"]
    file: str
    """Path of a Python file (.py), relative to the case file, or the name of an installed module."""
    function: str = "controller"
    """Name of the function that returns a ``meltemi.Controller`` for a turbine."""


class FixedCase(Record):
    """No control: torque and pitch keep their initial values, as for parked turbines."""

    kind: Literal["fixed"]


def _named(value: Any) -> Any:
    """Keys of a controller given by name; other values are returned unchanged."""
    if not isinstance(value, str):
        return value
    try:
        return controller_keys(value)
    except InputError as error:
        raise ValueError(str(error)) from None


ControllerCase = Annotated[
    BaselineCase | LibraryCase | SupervisedCase | PowerCase | PythonCase | FixedCase, Field(discriminator="kind")
]
NamedCase = Annotated[ControllerCase, BeforeValidator(_named)]
"""A controller by its keys or by its name."""


class _Holder(Record):
    controller: NamedCase


def specification(name: str | Mapping[str, Any] | ControllerCase) -> ControllerCase:
    """A controller as data, from a name or file (docs/guide/controller-names.md).

    Args:
      name: such as ``ipc``, ``A2``, ``rosco@DISCON.IN``, ``mine.py``, ``module:function``, ``libdiscon.so``; or the
        keys of its record.

    Raises:
      InputError: the name is unknown; the message has the closest ones and the list.
    """
    if not isinstance(name, str | Mapping | Record):
        raise InputError(f"controller: expected a name, a file, or keys as in a case file, found {type(name).__name__}")
    keys: Any = controller_keys(name) if isinstance(name, str) else name
    case: ControllerCase = _Holder(controller=keys).controller
    return case


def keyed(case: ControllerCase) -> dict[str, Any]:
    """Keys of a controller that are not the defaults, as in a case file."""
    return case.model_dump(mode="json", exclude_defaults=True) | {"kind": case.kind}


def description(case: ControllerCase) -> str:
    """Short description of a controller."""
    if isinstance(case, LibraryCase):
        return f"library {Path(case.library).name}" + (f" with {Path(case.input).name}" if case.input else "")
    if isinstance(case, PythonCase):
        return f"{case.function} of {case.file}"
    if isinstance(case, PowerCase):
        return f"power control, scheme {case.scheme}"
    added = getattr(case, "scheme", None)
    return f"{case.kind}, scheme {added}: {SCHEMES[added].about}" if added else case.kind


def supervised_form(case: ControllerCase) -> SupervisedCase | None:
    """The controller with supervisory control: the same demands in production, and starts and stops.

    None for complete controllers: libraries, power control, Python and fixed demands.
    """
    if isinstance(case, BaselineCase):
        return SupervisedCase(kind="supervised", scheme=case.scheme, load=case.load, yaw=case.yaw)
    return case if isinstance(case, SupervisedCase) else None


def uses_flaps(case: ControllerCase) -> bool:
    """Whether a controller is a scheme that moves flaps."""
    return need_flaps([getattr(case, "scheme", None)])


def rooted(case: ControllerCase, folder: Path) -> ControllerCase:
    """The controller with absolute paths; those given are relative to ``folder``."""
    return case.replace(**{key: str(path.absolute()) for key, path in _files(case, folder)})


def _files(case: ControllerCase, folder: Path) -> Iterator[tuple[str, Path]]:
    """Keys and paths of the files of a controller."""
    if isinstance(case, LibraryCase):
        if case.library != ROSCO:
            yield "library", folder / case.library
        if case.input is not None:
            yield "input", folder / case.input
    elif isinstance(case, PythonCase) and is_path(case.file):
        yield "file", folder / case.file


def check_files(case: ControllerCase, folder: Path = Path()) -> None:
    """Check that the files of a controller exist and are of the expected kind.

    Raises:
      InputError: a file is missing (with the closest name), or is not a library.
    """
    for key, path in _files(case, folder):
        if not path.is_file():
            beside = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else []
            hint = did_you_mean(path.name, beside)
            raise InputError(
                f"controller: {'input file' if key == 'input' else key} {path}: no such file"
                + (f"; {hint}" if hint.startswith("did") else "")
            )
        if key == "library":
            check_library(path)


def hashed(case: ControllerCase, once: Callable[[str, Callable[[], str]], str] | None = None) -> dict[str, Any]:
    """Content of a controller with hashes of its files instead of their paths, for keys of results.

    Args:
      case: controller with absolute paths.
      once: returns the hash of a file by its name, and computes it if it is not known.

    Raises:
      InputError: a file cannot be read.
    """
    once = once or (lambda name, make: make())
    keys = keyed(case)
    for key, path in _files(case, Path()):
        keys[key] = once(str(path), lambda path=path, key=key: _files_hash(path, key == "input"))  # type: ignore[misc]
    if isinstance(case, LibraryCase) and case.library == ROSCO:
        path = find_rosco()
        keys["library"] = once(str(path), lambda: _files_hash(path, False))
    if isinstance(case, PythonCase) and not is_path(case.file):
        keys["file"] = _source_hash(case)
    return keys


def digest(case: ControllerCase) -> str:
    """Hash of a controller and its files, see :func:`hashed`."""
    return hashlib.sha256(json.dumps(hashed(case), sort_keys=True).encode()).hexdigest()


def _files_hash(path: Path, named: bool) -> str:
    """Hash of a file, and of the files that a text names in quotes."""
    data = bytes_of(path, LARGEST_LIBRARY)
    digest = hashlib.sha256(data)
    for name in QUOTED.findall(data.decode(errors="replace")) if named else ():
        if (path.parent / name).is_file():
            digest.update(bytes_of(path.parent / name))
    return digest.hexdigest()


def _source_hash(case: PythonCase) -> str:
    """Hash of the module of a function; random if it has no source."""
    try:
        module = sys.modules[function_of(case.file, case.function).__module__]
        return hashlib.sha256(inspect.getsource(module).encode()).hexdigest()
    except (OSError, TypeError, KeyError):
        return os.urandom(16).hex()
