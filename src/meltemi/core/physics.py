"""Identity of the code, for everything that keeps results: version of the physics, hash of the files."""

from __future__ import annotations

import hashlib
import re
from functools import cache
from importlib.util import find_spec
from pathlib import Path

PHYSICS = 2
"""Increased by every change that moves results of an unchanged input by more than rounding.

``tests/regression`` compares its stored numbers under this version; pages with results state it.
"""
BESIDE = re.compile(rb"^\s*(?:from|import) (meltemi_\w+)", re.MULTILINE)
"""Import of a package beside meltemi."""


@cache
def code_identity(*packages: str) -> tuple[int | str, ...]:
    """Identity of the code that made a result; a stored result with another one is not used.

    Args:
      packages: packages of which each file counts, data included, with meltemi and the packages beside it that they
        import. Without any, the version of the physics counts alone: results outlive edits that do not move them.
    """
    if not packages:
        return (PHYSICS,)
    digest, names = hashlib.sha256(), [*dict.fromkeys(("meltemi", *packages))]
    for name in names:  # it grows by what each one imports
        found = find_spec(name)
        assert found is not None and found.submodule_search_locations, name
        (root,) = map(Path, found.submodule_search_locations)
        for path in sorted(p for p in root.rglob("*") if p.is_file() and p.suffix != ".pyc"):
            content = path.read_bytes()
            digest.update(path.relative_to(root.parent).as_posix().encode())
            digest.update(content)
            if path.suffix == ".py":
                imported = {match.decode() for match in BESIDE.findall(content)}
                names += sorted(each for each in imported.difference(names) if find_spec(each))
    return PHYSICS, digest.hexdigest()
