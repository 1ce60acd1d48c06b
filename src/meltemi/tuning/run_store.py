"""Finished and failed runs of a long study, kept on disk so that the study can be resumed.

Within ``with run_store(out, inputs):`` each finished run of :func:`cells` is stored in a folder of ``out``. The same
study, started again after Ctrl-C, a crash or a kill, reads them and continues with the rest. They are identified by the
code of the study's package (:func:`~meltemi.core.stores.code_identity`), and by the inputs of the study and of the
case, so that changed runs are repeated.

Shards of a study each run a part of the cases of a stage and keep their values in that folder; the study goes on
where all are there.

A failed cell does not end the study: :class:`FailedResult` takes the place of its result and raises an error with the
reason when it is used. ``attempt`` makes cells of other computations, ``guarded`` replaces what depends on failed ones.
A doubtful run counts and is listed, so that results outside the range of validity of the model are shown, too.
"""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, cast

from numpy.lib.mixins import NDArrayOperatorsMixin

from meltemi.control.controller import Controller
from meltemi.core.errors import InputError, MeltemiError, RunError, Status
from meltemi.core.fingerprint import fingerprint
from meltemi.core.private import signed, user_key, verified
from meltemi.core.stores import code_identity, keep_bytes
from meltemi.loadcases.batch import Batch, Piece, check_division
from meltemi.loadcases.store import Outcome, Reduce, reduced
from meltemi.simulation.result import Result
from meltemi.simulation.run import Run

T = TypeVar("T")
THIS_PACKAGE = "meltemi.tuning"
FOLDER = "finished-runs"
"""Folder within the output folder, while the study runs."""
NOT_IDENTIFYING = ("name", "start", "progress")
"""Arguments of a case that do not identify it: names do, and operating points follow from the rest."""


class FailedResultError(MeltemiError):
    """The result of a failed cell was used."""


class OtherShardError(MeltemiError):
    """The case belongs to another shard, which has not finished it; not raised, but named by its outcome."""


class FailedResult(NDArrayOperatorsMixin):
    """Placeholder for the result of a failed cell; any use of it raises :class:`FailedResultError`.

    Results are records as well as numbers, so the operators of the mixin, which all call ``__array_ufunc__``, count.

    Attributes:
      why: cell and reason of the failure.
    """

    def __init__(self, why: str) -> None:
        self.why = why

    def _raise(self, *_: Any, **__: Any) -> Any:
        raise FailedResultError(self.why)

    __getattr__ = __getitem__ = __iter__ = __len__ = __call__ = __float__ = __contains__ = __array__ = _raise
    __array_ufunc__ = _raise

    def __reduce__(self) -> Any:
        return FailedResult, (self.why,)


class RunStore:
    """Finished and failed cells of one study.

    Attributes:
      failed: reasons by cell, in order of occurrence.
      doubtful: findings by cell whose run left the range of validity of the model.
      reused: number of finished runs that were read from disk.
    """

    def __init__(
        self,
        folder: Path | None = None,
        inputs: str = "",
        package: str = THIS_PACKAGE,
        shard: tuple[int, int] = (1, 1),
        dask: str | None = None,
    ) -> None:
        check_division(shard, dask, "cpu")
        self.shard, self.dask = shard, dask
        self.failed: dict[str, str] = {}
        self.doubtful: dict[str, str] = {}
        self.reused = 0
        self.path: tuple[str, ...] = ()
        self._seal = b""
        with suppress(OSError):
            self._seal = user_key() if folder is not None else b""
        self.folder = folder.absolute() if folder is not None and self._seal else None
        if self.folder is not None and dask is not None:
            self.folder.mkdir(parents=True, exist_ok=True)  # for its workers to see
        self._study = f"{fingerprint(code_identity(package), inputs)}" if self._seal else ""
        self._seen: set[Path] = set()

    def enter(self, cell: str, why: str, *, doubtful: bool = False) -> None:
        """Enter a failed or doubtful cell, under its name and those of the enclosing cells."""
        (self.doubtful if doubtful else self.failed).setdefault(": ".join((*self.path, cell)), why)

    def problems(self) -> dict[str, Any]:
        """Failed and doubtful cells so far."""
        return {"failed": dict(self.failed), "doubtful": dict(self.doubtful)}

    def waiting(self) -> int:
        """Number of stored runs of this study."""
        return 0 if self.folder is None else len(list(self.folder.glob(f"{self._study}-*")))

    def _file_of(self, name: str, case: Run | Piece) -> Path | None:
        """File for the value of a case; None without a folder, or for a piece without inputs."""
        if self.folder is None or (isinstance(case, Piece) and case.inputs is None):
            return None
        given = (
            [case.inputs]
            if isinstance(case, Piece)
            else [getattr(case, field.name) for field in fields(case) if field.name not in NOT_IDENTIFYING]
        )
        inputs = [*map(_input, given)]
        file = self.folder / f"{self._study}-{fingerprint(self.path, name, inputs)}"
        if file in self._seen:
            raise AssertionError(f"two cases of a study cannot be distinguished: {self.path}, {name}")
        self._seen.add(file)
        return file

    def begin(self, name: str, case: Run | Piece, reduce: Reduce | None) -> Outcome | tuple[Run | Piece, Reduce]:
        """Stored outcome of a case, unless its file is missing, damaged, or not written by this user.

        Raises:
          FailedResultError: the case needs the result of a failed one.
        """
        for each in fields(case):
            if isinstance(needed := getattr(case, each.name), FailedResult):
                raise FailedResultError(needed.why)
        file = self._file_of(name, case)
        with suppress(OSError):
            data = None if file is None else verified(file.read_bytes(), self._seal)
            if data is not None:
                status, message, value = pickle.loads(data)
                return Outcome(name, status, message, value, reused=True)
        k, n = self.shard
        if file is not None and int(file.name[-8:], 16) % n != k - 1:
            return Outcome(name, Status.FAILED, "belongs to another shard", error=OtherShardError)
        return case, partial(_kept, file, reduce)

    def clear(self) -> None:
        """Remove the stored values at the end of the study."""
        if self.folder is not None and self.folder.is_dir():
            for file in self.folder.iterdir():
                with suppress(OSError):
                    file.unlink()
            with suppress(OSError):
                self.folder.rmdir()


def _kept(file: Path | None, reduce: Reduce | None, result: Any) -> Any:
    """The value of a case that reached its end, stored in a file; the study continues if the disk is full."""
    run = isinstance(result, Result)
    if run and not result.status.complete:
        return None
    value = reduced(reduce, result)
    if file is not None:
        with suppress(InputError, OSError):
            outcome = (result.status, result.message) if run else (Status.OK, "")
            keep_bytes(file, signed(pickle.dumps((*outcome, value), protocol=5), user_key()))
    return value


_OPEN: ContextVar[RunStore] = ContextVar("run_store", default=RunStore())  # noqa: B039 - it keeps nothing on disk


def current() -> RunStore:
    """The store of the current study."""
    return _OPEN.get()


@contextmanager
def run_store(
    out: Path,
    inputs: str,
    package: str = THIS_PACKAGE,
    shard: tuple[int, int] = (1, 1),
    dask: str | None = None,
) -> Iterator[RunStore]:
    """Context with the store of a study, in its output folder.

    Stored values are removed when the study ends without a failed cell.

    Args:
      out: existing folder.
      inputs: all inputs of the study other than the files of the packages, as text.
      package: package of the study; by default this one.
      shard: number k, from 1, and N: run the N-th part of the cases of each stage.
      dask: address of the scheduler of a Dask cluster that runs them, or ``local``; None: threads of this process.
    """
    store = RunStore(out / FOLDER, inputs, package, shard, dask)
    if store.waiting():
        _say(f"reading {store.waiting()} finished runs from {out / FOLDER}")
    token = _OPEN.set(store)
    try:
        yield store
        if not store.failed:
            store.clear()
    except BaseException:
        if store.waiting():
            _say(
                f"{store.waiting()} finished runs are kept in {out / FOLDER}: the same command continues with the rest"
            )
        raise
    finally:
        _OPEN.reset(token)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def attempt(name: str, function: Callable[..., T], *arguments: Any, **keywords: Any) -> T:
    """Cell of a study: the value of a function, or :class:`FailedResult` if it raises a ``MeltemiError``.

    The names of cells inside it begin with its name.
    """
    store, before = current(), current().path
    store.path = (*before, name)
    try:
        return function(*arguments, **keywords)
    except MeltemiError as error:
        if not isinstance(error, FailedResultError):  # the cell that failed first is listed already
            store.path = before
            store.enter(name, str(error))
        return cast("T", FailedResult(str(error) if isinstance(error, FailedResultError) else f"{name}: {error}"))
    finally:
        store.path = before


def guarded(function: Callable[[], T], instead: Callable[[str], T]) -> T:
    """Value of a function of the results, or, if it fails, of a function of the reason.

    After failed cells any error counts as their consequence; otherwise only a ``MeltemiError`` is caught.
    """
    try:
        return function()
    except Exception as error:
        if isinstance(error, MeltemiError):
            return instead(str(error))
        if not current().failed:
            raise
        return instead(f"cells failed that it needs ({type(error).__name__}: {error})")


def survivors(values: Iterable[T]) -> list[T]:
    """Values of the cells that did not fail.

    Raises:
      FailedResultError: all failed; with the reason of the first one.
    """
    values = list(values)
    left = [value for value in values if not isinstance(value, FailedResult)]
    if values and not left:
        raise FailedResultError(cast("FailedResult", values[0]).why)
    return left


def cells(
    cases: Iterable[Run | Piece],
    *,
    reduce: Callable[[Any], Any] | None = None,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
    total: int | None = None,
) -> list[Any]:
    """Values of a batch's cases, :class:`FailedResult` for those that failed; arguments as of ``simulate_batch``.

    Only runs that reached their end are reduced; of those, the open store lists the doubtful ones.

    Raises:
      KeyboardInterrupt: Ctrl-C ended the runs.
    """
    store, values = current(), []
    for outcome in resumed(cases, reduce=reduce, workers=workers, progress=progress, total=total):
        complete = outcome.status.complete
        if not outcome.ok:
            store.enter(outcome.name, outcome.message, doubtful=complete)
        values.append(outcome.value if complete else FailedResult(f"{outcome.name}: {outcome.message}"))
    return values


def resumed(
    cases: Iterable[Run | Piece],
    *,
    reduce: Callable[[Any], Any] | None = None,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
    total: int | None = None,
) -> list[Outcome]:
    """Outcomes of ``simulate_batch``; the open store gives the runs that it has already, and keeps the others.

    Raises:
      KeyboardInterrupt: Ctrl-C ended the runs.
      SystemExit: cases belong to other shards, which have not finished them; those of this one are stored.
    """
    store = current()
    batch = Batch(cases, reduce=reduce, workers=workers, progress=progress, total=total, store=store, dask=store.dask)
    outcomes = batch.run()
    if batch.interrupted or any(outcome.status is Status.INTERRUPTED for outcome in outcomes):
        raise KeyboardInterrupt
    store.reused += sum(outcome.reused for outcome in outcomes)
    if others := sum(outcome.error is OtherShardError for outcome in outcomes):
        _say(f"{others} of {len(outcomes)} runs of this stage belong to other shards and are not finished")
        raise SystemExit(0)
    return outcomes


def completed(outcomes: Iterable[Outcome]) -> list[Any]:
    """Values of the outcomes, all of which must have the status OK.

    Raises:
      RunError: a case has another status; the message has its name and the reason.
    """
    values = []
    for outcome in outcomes:
        if not outcome.ok:
            raise RunError(f"{outcome.name}: {outcome.message}")
        values.append(outcome.value)
    return values


def _input(value: Any) -> Any:
    """Identity of an argument of a case by its content; None without a reproducible hash."""
    if isinstance(value, Controller):
        # what depends on a library or another process may count its starts
        return value.name, value.sample_time, fingerprint(value) if value.fresh is None else None
    if isinstance(value, partial):
        return _input(value.args)
    return [*map(_input, value)] if isinstance(value, (list, tuple)) else fingerprint(value)
