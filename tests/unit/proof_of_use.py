"""Proof that an importer uses what its report calls used: one entry is changed, and the imported record changes.

For any format: ``read`` makes the record of a folder, ``files`` are its texts, ``changes`` gives the keys that differ
between the record of the files and that of the same files with some of them replaced.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from meltemi.core.record import Record
from meltemi.exchange.report import ImportedModel, ImportedTurbine

Read = Callable[[Path], ImportedTurbine]
Files = Mapping[str, str]
BESIDE = ("options", "environment", "wind", "sea", "duration", "output_step", "start", "library")
"""Of an imported model, beside the turbine; a library only of OpenFAST decks."""


def write(files: Files, folder: Path) -> Path:
    """Write texts by their paths below a folder."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def content(imported: ImportedTurbine) -> dict[str, Any]:
    """Values of an imported turbine or model by key path, without names and sources."""
    found = dict(_leaves(imported.turbine.content(), "turbine"))
    if isinstance(imported, ImportedModel):
        for name in BESIDE:
            found |= dict(_leaves(getattr(imported, name, None), name))
    return {key: value for key, value in found.items() if key.rpartition(".")[2] not in ("name", "source")}


def _leaves(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    if isinstance(value, Record):
        value = value.content()
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from _leaves(inner, f"{path}.{key}")
    else:
        yield path, value


def differences(one: ImportedTurbine, two: ImportedTurbine) -> list[str]:
    """Key paths at which two imports differ."""
    a, b = content(one), content(two)
    return sorted(key for key in a.keys() | b.keys() if key not in a or key not in b or not _same(a[key], b[key]))


def _same(a: Any, b: Any) -> bool:
    return np.shape(a) == np.shape(b) and bool(np.all(np.asarray(a) == np.asarray(b)))


def changes(read: Read, files: Files, replaced: Files, folder: Path) -> list[str]:
    """Key paths that change when files are replaced.

    Args:
      read: record of the files in a folder.
      files: texts by path below the folder.
      replaced: those that a perturbation makes different.
      folder: an empty one.

    Raises:
      InputError: the importer refuses the perturbed files, which shows as well that it reads the entry.
    """
    before = read(write(files, folder / "before"))
    return differences(before, read(write({**files, **replaced}, folder / "after")))
