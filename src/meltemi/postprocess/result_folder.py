"""Result files of a batch: a case with a completed file from the same inputs and code is not run again."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from meltemi.compiler import package_folder, sources
from meltemi.control.controller import Controller
from meltemi.core.errors import InputError, Status
from meltemi.core.fingerprint import fingerprint
from meltemi.core.stores import code_identity
from meltemi.loadcases.store import Outcome, Reduce, reduced, with_model_and_wind
from meltemi.postprocess.files import read_netcdf, write_netcdf
from meltemi.simulation.result import Result
from meltemi.simulation.run import Run


class ResultFiles:
    """Store of results as files ``NAME.nc``, identified by all inputs of their cases and the code.

    Args:
      folder: created if needed.
      rerun: run cases that are finished again.

    Raises:
      InputError: the folder cannot be written.
    """

    def __init__(self, folder: str | Path, *, rerun: bool = False) -> None:
        self.folder, self.rerun = Path(folder), rerun
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{self.folder}: cannot be written ({error.strerror or error})") from None

    def begin(self, name: str, case: Any, reduce: Reduce | None) -> Outcome | tuple[Run, Reduce]:
        """The file or its reduced result, if it is complete and has the same inputs."""
        if Path(name).name != name:
            raise InputError(f"a case's name becomes that of a file, which {name!r} cannot be")
        if not isinstance(case, Run):
            raise InputError("out: only runs have time series, which files contain")
        case, path = with_model_and_wind(case), self.folder / f"{name}.nc"
        inputs = inputs_of(case)
        stored = None if self.rerun or inputs is None else _read(path)
        if stored is None or stored.status is not Status.OK or stored.meta.get("inputs") != inputs:
            return case, partial(_written, path, inputs, reduce)
        return Outcome(name, stored.status, value=path if reduce is None else reduce(stored), reused=True)


def _written(path: Path, inputs: str | None, reduce: Reduce | None, result: Result) -> Any:
    """Write the file of a result; its path, or the reduced result."""
    result.meta["inputs"] = inputs
    written = write_netcdf(result, path)
    return written if reduce is None else reduced(reduce, result)


def inputs_of(case: Run) -> str | None:
    """Hash of all inputs of a case and of the code; None if an input has no reproducible hash."""
    if isinstance(case.controller, Controller) and case.controller.fresh is not None:
        return None  # depends on a library or another process
    root = package_folder()
    called = {path.relative_to(root).parts[0] for path in sources()}  # packages whose kernels it may call
    code = code_identity(*(f"{root.name}.{package}" for package in sorted(called)))
    return fingerprint(code, replace(case, name="", progress=None, partial=False))


def _read(path: Path) -> Result | None:
    """The result in a file; None if it cannot be read."""
    try:
        return read_netcdf(path) if path.is_file() else None
    except InputError:
        return None
