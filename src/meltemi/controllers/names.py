"""Names of controllers and definitions of the control schemes, without heavy imports, so that commands list them.

``ipc`` is CPC with feed-forward and 1P feedback to pitch, ``cpfc`` is ``ipc`` with 2P feedback to flaps: the load is
divided by frequency.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from meltemi.core.errors import InputError, closest

Target = tuple[Literal["pitch", "flap"], int]
"""Actuator and harmonic of a loop."""
PITCH_1P: Target = ("pitch", 1)
PITCH_2P: Target = ("pitch", 2)
FLAP_1P: Target = ("flap", 1)
FLAP_2P: Target = ("flap", 2)


@dataclass(frozen=True)
class Scheme:
    """Parts of a load controller in addition to the collective pitch law.

    Attributes:
      about: description in one line.
      loops: feedback loops.
      feedforward: whether it has feed-forward by azimuth.
    """

    about: str
    loops: tuple[Target, ...] = ()
    feedforward: bool = False

    @property
    def flaps(self) -> bool:
        """Whether it requires flaps."""
        return any(actuator == "flap" for actuator, _ in self.loops)


SCHEMES: Mapping[str, Scheme] = {
    "cpc": Scheme("collective pitch"),
    "ipc": Scheme("feed-forward and 1P individual pitch", (PITCH_1P,), True),
    "cpfc": Scheme("ipc and 2P flaps", (PITCH_1P, FLAP_2P), True),
    "feedforward": Scheme("feed-forward by azimuth alone", (), True),
    "feedback": Scheme("1P individual pitch without feed-forward", (PITCH_1P,)),
    "flaps": Scheme("2P flaps alone", (FLAP_2P,)),
    "flaps12": Scheme("1P and 2P flaps, pitch collective", (FLAP_1P, FLAP_2P)),
    "ipc2": Scheme("ipc and 2P individual pitch", (PITCH_1P, PITCH_2P), True),
    "cpfc12": Scheme("ipc and 1P and 2P flaps", (PITCH_1P, FLAP_1P, FLAP_2P), True),
}


NAMES: Mapping[str, str] = {
    "baseline": "collective pitch and torque of the turbine's file, no supervision",
    "supervised": "the baseline under supervision: start, stop, protection",
    **{name: scheme.about for name, scheme in SCHEMES.items()},
    "A0": "power control, optimal speed",
    "A1": "power control, rated speed",
    "A2": "power control, hold",
    "A3": "power control, wide hold",
    "power": "the same as A2",
    "rosco": "library of the installed rosco package, its input file after @",
    "fixed": "constant torque and pitch",
}
"""Names of controllers, with what they are; a controller may also be a file, see :func:`controller_keys`."""
LIBRARIES = (".so", ".dylib", ".dll")
"""Endings of controller libraries."""
FILES = "a Python file, module:function, an FMU, or a controller library (its input file after @)"


def controller_keys(text: str) -> dict[str, str]:
    """Keys of the record of a controller (docs/guide/controller-names.md) from its name or file.

    The names are common to all commands, case files and Python: one of ``NAMES``, the path of a Python file or
    ``module:function``, or the path of a library; libraries have their input file after ``@``. ``./ipc`` is a file,
    ``ipc`` a scheme. No file is read.

    Raises:
      InputError: the name is unknown; the message has the closest ones and the list.
    """
    source, _, given = (text, "", "") if Path(text).is_file() else text.partition("@")
    name = {each.lower(): each for each in NAMES}.get(source.lower(), source)
    path, plain = Path(source), source and not given
    if name == "rosco" or path.suffix in LIBRARIES or ".so." in path.name:
        return {"kind": "bladed", "library": source} | ({"input": given} if given else {})
    if plain and name in SCHEMES:
        return {"kind": "baseline", "scheme": name}
    if plain and name in NAMES:
        power = name in ("A0", "A1", "A2", "A3")
        return {"kind": "power", "scheme": name} if power else {"kind": name}
    if plain and path.suffix in (".py", ".fmu"):
        return {"kind": "python", "file": source}
    if plain and ":" in source and not path.is_file():
        module, _, function = source.rpartition(":")
        if not module or not function:
            raise InputError(f"controller {text!r}: expected module:function, such as my_controller:controller")
        return {"kind": "python", "file": module, "function": function}
    if path.is_file() or len(path.parts) > 1:
        return {"kind": "bladed", "library": source} | ({"input": given} if given else {})
    near = " or ".join(repr(each) for each in closest(source, NAMES))
    hint = f"did you mean {near}? " if near else ""
    raise InputError(f"no controller {text!r}: {hint}Valid are {', '.join(NAMES)}; {FILES}")


def labelled(names: Sequence[str]) -> dict[str, str]:
    """Controllers by label: their names, those of files without folder and suffix.

    Raises:
      InputError: the list is empty, a name is unknown, or two have the same label.
    """
    if not names:
        raise InputError(f"controllers: name at least one of {', '.join(NAMES)}; {FILES}")
    by_label: dict[str, str] = {}
    for name in names:
        controller_keys(name)
        if list(names).count(name) > 1:
            raise InputError(f"controllers: {name!r} is named twice")
        if (text := label(name)) in by_label:
            raise InputError(f"controllers: two of them are called {text!r}")
        by_label[text] = name
    return by_label


def label(name: str) -> str:
    """Label of a controller in tables and files."""
    source = name if Path(name).is_file() else name.partition("@")[0]
    return Path(source).stem if source.endswith((".py", ".fmu", *LIBRARIES)) else source


def need_flaps(names: Iterable[str | None]) -> bool:
    """Whether one of the names is a scheme with flaps."""
    schemes = [SCHEMES.get(name.lower()) for name in names if name is not None]
    return any(scheme.flaps for scheme in schemes if scheme is not None)
