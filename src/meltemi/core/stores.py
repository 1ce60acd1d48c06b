"""Common functions of stores of results: identity of the code behind a result, and files that outlast a crash."""

from __future__ import annotations

import hashlib
import os
import re
from contextlib import suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from meltemi.core.errors import InputError
from meltemi.core.files import replacing
from meltemi.core.physics import PHYSICS

CORE = "core compiler maths environment turbine wind aero structure control simulation loadcases".split()
"""Packages that a plain simulation needs, on which all others stand."""
SIMULATOR = (
    *CORE,
    *"turbulence iec wind_files electrical control_laws supervisor power_control bladed_controllers analyses".split(),
    *"vortex postprocess controllers cases report scene app".split(),
)
"""The core and what any run may use of other packages: with another line in one of their files, a result is another."""
IMPORT = re.compile(rb"^\s*(?:from|import) (meltemi\.\w+)", re.MULTILINE)


@cache
def code_identity(*packages: str) -> tuple[int | str, ...]:
    """Identity of the code that computed a result; a stored result with another one is not used.

    Args:
      packages: packages of which each file counts, data included, with the simulator and what they import of meltemi.
        Without any, the version of the physics counts alone: results outlive edits that do not move them.
    """
    if not packages:
        return (PHYSICS,)
    digest, names = hashlib.sha256(), [*dict.fromkeys((*(f"meltemi.{layer}" for layer in SIMULATOR), *packages))]
    for name in names:  # it grows by what each one imports
        spec = find_spec(name)
        assert spec is not None and spec.origin is not None, name
        root = Path(spec.origin).parent
        for path in sorted(p for p in root.rglob("*") if p.is_file() and p.suffix != ".pyc"):
            content = path.read_bytes()
            digest.update(path.relative_to(root.parent).as_posix().encode())
            digest.update(content)
            if path.suffix == ".py":
                imported = {match.decode() for match in IMPORT.findall(content)}
                names += sorted(filter(_is_package, imported.difference(names)))
    return PHYSICS, digest.hexdigest()


def _is_package(name: str) -> bool:
    spec = find_spec(name)
    return spec is not None and bool(spec.submodule_search_locations)


def keep_bytes(path: Path, data: bytes) -> Path:
    """Write a file atomically, and its folder where it is missing, so that it outlasts a crash of the machine.

    Raises:
      InputError: the file cannot be written; nothing of it is then there.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error})") from None
    with replacing(path) as (partial,), partial.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    with suppress(OSError):  # the new name, too, where folders can be opened
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
    return path
