"""Stores of a batch: what they keep of finished cases, so that these are not run again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from meltemi.compiler import package_folder, sources
from meltemi.control.controller import Controller
from meltemi.core.display import brief
from meltemi.core.errors import InputError, Status
from meltemi.core.fingerprint import fingerprint
from meltemi.core.representation import Card, badge
from meltemi.core.shown import Shown
from meltemi.core.stores import code_identity
from meltemi.simulation.result import Result
from meltemi.simulation.run import Run

Reduce = Callable[[Any], Any]
"""Function from a result to the value that is kept of it."""


@dataclass(frozen=True, repr=False)
class Outcome(Shown):
    """Outcome of one case of a batch.

    Attributes:
      name: name of the case.
      status: outcome; ``FAILED`` if it could not be prepared, or its result not be reduced or written.
      message: reason; empty for a complete and valid run.
      value: the result, the value of ``reduce``, or the file it was written to; None without a result.
      error: class of the exception that ended a failed case.
      reused: whether the stored result was reused without a new run.
    """

    name: str
    status: Status
    message: str = ""
    value: Any = None
    error: type[BaseException] | None = None
    reused: bool = False

    def __repr__(self) -> str:
        remark = f": {self.message}" if self.message else ""
        return f"<Outcome {self.name!r}, {self.status}{remark}>"

    def card(self) -> Card:
        """Status and message, and the result or file."""
        kind = "good" if self.ok else "doubtful" if self.status.complete else "bad"
        facts = [("status", badge(self.status.name, kind)), *([("message", self.message)] if self.message else [])]
        if self.reused:
            facts.append(("run", "not repeated: a stored result was reused"))
        if isinstance(self.value, Shown):
            return Card("Outcome", self.name, facts, [self.value.card().folded(type(self.value).__name__)])
        return Card("Outcome", self.name, [*facts, ("value", brief(self.value))])

    @property
    def ok(self) -> bool:
        """The case reached its end, within the range of validity of the model."""
        return self.status is Status.OK


class BatchStore(Protocol):
    """Store of a batch; its functions are called in the threads of the cases, ``begin`` before ``keep``."""

    def begin(self, name: str, case: Run, reduce: Reduce | None) -> Outcome | Run:
        """Outcome of a case that is finished already; otherwise the case, as it runs.

        Raises:
          MeltemiError: the case cannot run; this becomes its outcome.
        """

    def keep(self, name: str, result: Any, reduce: Reduce | None) -> Any:
        """Keep a result, and return the value of its outcome."""


def with_model_and_wind(case: Run) -> Run:
    """The case with its model and wind, evaluated where they are functions."""
    model = case.model() if callable(case.model) else case.model
    return replace(case, model=model, wind=case.wind() if callable(case.wind) else case.wind)


def reduced(result: Any, reduce: Reduce | None) -> Any:
    """Value of a result; None where too little of it can be reduced, as its status says more."""
    try:
        return result if reduce is None else reduce(result)
    except InputError:
        if result.status.complete:
            raise
        return None


class Nothing:
    """Store that keeps nothing."""

    def begin(self, name: str, case: Run, reduce: Reduce | None) -> Run:
        """The case."""
        return with_model_and_wind(case)

    def keep(self, name: str, result: Any, reduce: Reduce | None) -> Any:
        """The reduced result."""
        return reduced(result, reduce)


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
        self._inputs: dict[str, str | None] = {}
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{self.folder}: cannot be written ({error.strerror or error})") from None

    def begin(self, name: str, case: Run, reduce: Reduce | None) -> Outcome | Run:
        """The file or its reduced result, if it is complete and has the same inputs."""
        if Path(name).name != name:
            raise InputError(f"a case's name becomes that of a file, which {name!r} cannot be")
        case, path = with_model_and_wind(case), self._path(name)
        self._inputs[name] = inputs = inputs_of(case)
        stored = None if self.rerun or inputs is None else _read(path)
        if stored is None or stored.status is not Status.OK or stored.meta.get("inputs") != inputs:
            return case
        return Outcome(name, stored.status, value=path if reduce is None else reduce(stored), reused=True)

    def keep(self, name: str, result: Result, reduce: Reduce | None) -> Any:
        """Write the file; the value is its path, or the reduced result."""
        result.meta["inputs"] = self._inputs.pop(name)
        path: Path = _files().write_netcdf(result, self._path(name))
        return path if reduce is None else reduced(result, reduce)

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.nc"


def inputs_of(case: Run) -> str | None:
    """Hash of all inputs of a case and of the code; None if an input has no reproducible hash."""
    if isinstance(case.controller, Controller) and case.controller.fresh is not None:
        return None  # depends on a library or another process
    root = package_folder()
    called = {path.relative_to(root).parts[0] for path in sources()}  # packages whose kernels it may call
    code = code_identity(*(f"{root.name}.{package}" for package in sorted(called)))
    return fingerprint(code, replace(case, name="", progress=None, partial=False))


def _files() -> Any:
    """The module of result files, imported for the first one."""
    return import_module("meltemi.postprocess.files")


def _read(path: Path) -> Result | None:
    """The result in a file; None if it cannot be read."""
    try:
        return _files().read_netcdf(path) if path.is_file() else None
    except InputError:
        return None
