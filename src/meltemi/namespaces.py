"""Public names, imported when they are first used.

Each namespace (``meltemi``, ``meltemi.wind``, ``meltemi.loads`` ...) has a stub file beside it with lines such as
``from meltemi.wind.fields import SteadyWind as SteadyWind``. Type checkers and editors read the stub as it is; the
module reads it here to find the home of a name that is asked for. So ``import meltemi`` is quick, and every name is
declared in one place.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from types import FunctionType
from typing import Any

NAMESPACES = ("wind", "control", "turbine", "environment", "events", "loads", "analysis", "io", "plots")


@cache
def declared(namespace: str) -> dict[str, tuple[str, str]]:
    """Module and name there of each public name of a namespace, from its stub file; a module has no name there."""
    place = os.path.join(os.path.dirname(__file__), *namespace.split(".")[1:])  # noqa: PTH118, PTH120 - pathlib is slow to import
    stub = f"{place}/__init__.pyi" if os.path.isdir(place) else f"{place}.pyi"  # noqa: PTH112
    entries: dict[str, tuple[str, str]] = {}
    with open(stub, encoding="utf-8") as lines:  # noqa: PTH123
        for line in lines:
            match line.split():
                case ["from", "meltemi", "import", inner, "as", name]:
                    entries[name] = (f"meltemi.{inner}", "")
                case ["from", module, "import", there, "as", name]:
                    entries[name] = (module, there)
                case [name, _] if name.endswith(":"):
                    entries[name[:-1]] = (namespace, name[:-1])
    return entries


def public(namespace: str, *, explain: bool = True) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """``__getattr__`` and ``__dir__`` of the module of a namespace.

    Args:
      namespace: name of the module.
      explain: whether its functions explain invalid arguments, and errors have the closest names.
    """

    def get(name: str) -> Any:
        names = declared(namespace)
        if name == "__all__":
            return sorted(names)
        if name not in names:
            hint = f": {_hint(name, namespace)}" if explain else ""  # one of its modules, most often
            raise AttributeError(f"module {namespace!r} has no attribute {name!r}{hint}")
        module, there = names[name]
        value = import_module(module)
        if there:
            value = _explained(value, there) if explain else getattr(value, there)
        setattr(sys.modules[namespace], name, value)
        return value

    return get, lambda: sorted(declared(namespace))


def _explained(module: Any, name: str) -> Any:
    """Attribute of a module; a function explains invalid arguments."""
    from meltemi.core.calls import explained

    value = getattr(module, name)
    if isinstance(value, FunctionType) and not hasattr(value, "explained"):
        value = explained(value)
        setattr(module, name, value)  # in its module, too, where pickle looks it up
    return value


def _hint(name: str, namespace: str) -> str:
    """Namespace of a name that another namespace does not have, or the closest names."""
    from meltemi.core.errors import did_you_mean

    places = [place for each in ("", *NAMESPACES) if name in declared(place := f"meltemi.{each}".strip("."))]
    if not places:
        return did_you_mean(name, declared(namespace))
    return f"it is {places[0]}.{name}"
