"""Files of layups: of windIO, of meltemi, and those behind turbines of the library."""

from __future__ import annotations

from pathlib import Path

from meltemi.core.errors import InputError
from meltemi.sections.layup import Layup


def find_layup(name: str | Path, folder: Path | None = None) -> Layup:
    """The layup of a file, or of a turbine of the library.

    Args:
      name: windIO file, layup file, or a turbine of the library that is read from a windIO file.
      folder: to which paths are relative.

    Raises:
      InputError: there is no such file, or it has no layup.
    """
    import meltemi.io
    from meltemi.turbine.library import library_entries
    from meltemi.turbine.windio_package import windio_file

    path = (folder or Path()) / name
    known = library_entries()
    if not path.is_file() and str(name) in known:
        entry = known[str(name)]
        while entry.windio is None and entry.base is not None:
            entry = known[entry.base]
        if entry.windio is None:
            having = ", ".join(each for each, other in known.items() if other.windio)
            raise InputError(f"layup: {name} of the library has no layup; {having} have one: give a file")
        return meltemi.io.read_layup(windio_file(entry.windio, str(name)))
    return meltemi.io.read_layup(path)
