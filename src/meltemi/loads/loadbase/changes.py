"""Changes of a load case table from a YAML or an Excel file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from meltemi.core.errors import InputError
from meltemi.core.yamlfile import parse, read_text
from meltemi.loads.loadbase.excel import read_excel
from meltemi.loads.loadbase.table import load_table


def read_changes(path: str | Path, edition: int | str = 4) -> dict[str, Any]:
    """Changes of a table from a YAML file, or from an Excel file, compared with the edition.

    Raises:
      InputError: the file cannot be read, or its changes are not valid.
    """
    path = Path(path)
    if path.suffix.lower() == ".xlsx":
        changes, text = read_excel(path, edition), None
    else:
        text = read_text(path)
        changes = parse(text, path, "changes of a load case table")
        if given := changes.keys() & {"edition", "extends"}:
            raise InputError(f"{path}: {', '.join(sorted(given))}: the campaign has the edition; leave it out")
    load_table(edition, changes, str(path), text)
    return changes
