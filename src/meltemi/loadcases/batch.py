"""Batches of cases: on all cores, a share of them, or on a cluster.

Kernels release Python's global interpreter lock, so cases are threads of one process, and nothing is copied or compiled
twice. Cases share no arrays that they change. On a cluster the threads wait for its workers.

The field of a turbulent wind is generated when its case starts and freed when it ends. Cases may come from a generator,
from which each free worker takes the next one, so memory holds as many fields as there are workers.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sized
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import nullcontext
from dataclasses import KW_ONLY, dataclass, replace
from functools import partial
from importlib import import_module
from itertools import islice
from pathlib import Path
from types import FrameType
from typing import Any, cast

from meltemi.core.calls import arguments_of, explained
from meltemi.core.errors import InputError, MeltemiError, Status
from meltemi.core.interrupts import on_interrupt
from meltemi.core.log import LOG
from meltemi.core.threads import available_cores, one_blas_thread
from meltemi.loadcases.store import BatchStore, Nothing, Outcome, Reduce, with_model_and_wind
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march

MOST_WORKERS = 1000
WAITING = 512
"""Threads that wait for workers of a cluster; two for each of them."""
DEVICES = ("cpu", "cuda", "cuda-single")
PROGRESS_SECONDS = 0.2
"""Wall time between calls of ``progress``."""
GROUP = 8192
"""Runs that march together on a card: the fastest on an H100, which 16,384 slow down by a third."""
MEMORY = 8 << 30
"""Bytes of wind fields and series above which a group begins to march."""
CHUNK = 500
"""Time steps of a run without series of which it holds the samples; on a card, between checks of the keyboard."""
_THREAD = threading.local()
Begun = tuple[Run, Reduce, Simulation]
"""A case that is prepared, and the function of its result."""


@dataclass(frozen=True)
class Piece:
    """A case of a batch that is not the run of a turbine: a farm, derivatives.

    Attributes:
      name: as of a run.
      work: function without arguments whose value becomes that of the outcome; pickled on a cluster.
      inputs: what identifies the value beside the name, where values are stored; None: it is not stored.
    """

    name: str
    work: Callable[[], Any]
    inputs: Any = None


def check_division(shard: tuple[int, int], dask: str | None, device: str) -> None:
    """Test whether a batch can be divided so.

    Raises:
      InputError: it cannot.
    """
    k, n = shard
    if not 1 <= k <= n:
        raise InputError(f"shard: {k}/{n} must be k/N with k from 1 to N")
    if device != "cpu" and dask is not None:
        raise InputError(f"device {device!r} and dask exclude each other: the workers of Dask run on processors")


@dataclass
class Batch:
    """A batch in progress, shared between threads: each entry is written by one thread.

    Attributes:
      cases: any iterable of runs or pieces; the next item of a generator is requested when a worker is free.
      reduce: called with each result in its worker; only what it returns is kept.
      out: folder in which each result is written as ``NAME.nc`` as soon as it is complete, instead of being kept. A
        case with a completed file from the same inputs and version is not run again.
      workers: threads; by default one for each core this process may use.
      progress: callback with the completed fraction, from the calling thread; 0 while the number of cases is
        unknown.
      total: number of cases of a generator, for ``progress``.
      rerun: run all cases, also those that are finished.
      done: callback with each outcome, from the calling thread; outcomes are then not kept, and none is returned.
      device: "cpu" or "cuda", a graphics card, where cases march together in groups; needs ``meltemi[cuda]``, and
        controllers that are compiled; "cuda-single" evaluates in single precision.
      series: keep the time series; without them the value of a case, and what ``reduce`` is called with, is a
        :class:`~meltemi.loads.Summary`, computed while the case runs.
      slopes: m of the S-N curves of summaries by channel; else 10 for blades, 3 for mooring lines, 4 for others.
      store: stores values instead of files in ``out``.
      shard: number k, from 1, and N: only every N-th case, beginning with the k-th.
      dask: address of the scheduler of a Dask cluster, or ``local``: worker processes of this machine.
    """

    cases: Iterable[Run | Piece]
    _: KW_ONLY
    reduce: Callable[[Any], Any] | None = None
    out: str | Path | None = None
    workers: int | None = None
    progress: Callable[[float], None] | None = None
    total: int | None = None
    rerun: bool = False
    done: Callable[[Outcome], None] | None = None
    device: str = "cpu"
    series: bool = True
    slopes: Mapping[str, float] | None = None
    store: BatchStore | None = None
    shard: tuple[int, int] = (1, 1)
    dask: str | None = None

    def __post_init__(self) -> None:
        check_division(self.shard, self.dask, self.device)
        if self.workers is not None and not (isinstance(self.workers, int) and 1 <= self.workers <= MOST_WORKERS):
            raise InputError(f"workers must be an integer from 1 to {MOST_WORKERS}, found {self.workers!r}")
        if self.device not in DEVICES:
            raise InputError(f"device must be one of {', '.join(DEVICES)}, found {self.device!r}")
        if not self.series and self.out is not None:
            raise InputError("out and series=False exclude each other: files contain the time series")
        if self.store is not None and (self.out is not None or not self.series):
            raise InputError("store excludes out and series=False: it stores the results itself")
        if self.series and self.slopes is not None:
            raise InputError("slopes are those of summaries: give series=False")
        if self.device != "cpu":
            _cards().check()
            self.workers = 2  # one group is prepared or evaluated while another one marches
        self.kept: BatchStore = self.store or Nothing()
        if self.out is not None:
            files = import_module("meltemi.postprocess.result_folder")
            self.kept = files.ResultFiles(Path(self.out).absolute() if self.dask else self.out, rerun=self.rerun)
        (k, n), total = self.shard, len(self.cases) if isinstance(self.cases, Sized) else self.total
        self.total = None if total is None else len(range(k - 1, total, n))
        self.waiting: Iterator[tuple[int, Run | Piece]] = islice(enumerate(self.cases), k - 1, None, n)
        self.cluster: Any = None
        self.stop = threading.Event()
        self.next_lock, self.first_lock, self.card_lock = threading.Lock(), threading.Lock(), threading.Lock()
        self.compiled = self.interrupted = self.exhausted = False
        self.names: set[str] = set()
        self.outcomes: dict[int, Outcome] = {}
        self.under_way: dict[int, Simulation] = {}
        self.started = self.reported = 0

    @one_blas_thread  # once for all threads: the setting belongs to the process
    def run(self) -> list[Outcome]:
        """Run all cases; after Ctrl-C, ``interrupted`` is set, which no outcome may show."""
        workers = WAITING if self.dask else self.workers or available_cores()
        cluster = import_module("meltemi.cluster.dask").connected(self.dask) if self.dask else nullcontext()
        with (
            on_interrupt(self._heard),
            cluster as self.cluster,
            ThreadPoolExecutor(workers, thread_name_prefix="meltemi") as pool,
        ):
            futures = [pool.submit(self._work, number) for number in range(workers)]
            try:
                busy = set(futures)
                while busy:
                    done, busy = wait(busy, timeout=PROGRESS_SECONDS)
                    self._tell()
                    if any(future.exception() for future in done):
                        break  # the iterable of the cases has failed
            except KeyboardInterrupt:
                self.interrupted = True
            finally:
                self.stop.set()
        for future in futures:
            future.result()
        self._tell()
        return [self.outcomes[i] for i in sorted(self.outcomes)]

    def _heard(self, _: FrameType | None) -> None:
        """Handle Ctrl-C without an exception, which could leave a lock acquired."""
        self.interrupted = True
        self.stop.set()

    def _tell(self) -> None:
        """Call the callbacks."""
        if self.done is not None:
            for i in sorted([*self.outcomes]):
                self.reported += 1
                self.done(self.outcomes.pop(i))
        if self.progress is not None:
            self.progress(self._share())

    def _share(self) -> float:
        if self.total is None:
            return 0.0
        done = self.reported + len(self.outcomes)
        running = [run.share for run in list(self.under_way.values())]
        return (done + sum(running)) / max(self.total, done + len(running), 1)

    def _work(self, number: int) -> None:
        """Worker thread: run cases until none is left, one by one or, on a graphics card, in groups."""
        _THREAD.stop = self.stop
        while not (self.stop.is_set() or self.exhausted):
            if self.cluster is None or self.cluster.has_room(number):
                self._run_group()
            else:
                self.stop.wait(1.0)

    def _run_group(self) -> None:
        group = [*self._group()]
        if self.device != "cpu":
            with self.card_lock:
                runs = [begun[-1] for _, _, begun in group]
                single = self.device == "cuda-single"
                _cards().march_together(runs, self.stop.is_set, steps=CHUNK, single=single)
        for i, name, begun in group:
            self._guarded(i, name, self._end, i, name, *begun)
            self.under_way.pop(i, None)

    def _group(self) -> Iterator[tuple[int, str, Begun]]:
        """Prepare one case, or as many as the memory holds and a graphics card runs together."""
        memory: dict[int, int] = {}
        for count, (i, name, case) in enumerate(iter(self._next, None), 1):
            if (begun := self._guarded(i, name, self._begin, i, name, case)) is not None:
                yield i, name, begun
                memory |= memory_of(begun[-1])
            if self.device == "cpu" or count == GROUP or sum(memory.values()) > MEMORY or self.stop.is_set():
                return

    def _next(self) -> tuple[int, str, Run | Piece] | None:
        with self.next_lock:
            following = next(self.waiting, None)
            if following is None:
                self.total, self.exhausted = self.started, True
                return None
            i, case = following
            if not isinstance(case, Run | Piece):
                raise InputError(f"simulate_batch: cases: expected meltemi.Run, found {case!r:.60} as number {i + 1}")
            name = case.name or f"case_{i + 1:04d}"
            repeated, self.started = name in self.names, self.started + 1
            if case.name or self.out is not None:  # a million names would need 0.1 GB
                self.names.add(name)
        if repeated:
            self.outcomes[i] = Outcome(
                name, Status.FAILED, f"another case of the batch has the name {name!r}", error=InputError
            )
        return self._next() if repeated else (i, name, case)

    def _guarded(self, i: int, name: str, action: Callable[..., Any], *arguments: Any) -> Any:
        """The value of an action for a case; an exception in it becomes the outcome of the case."""
        try:
            return action(*arguments)
        except BaseException as error:
            words = str(error) if isinstance(error, MeltemiError) else f"{type(error).__name__}: {error}"
            ended = Status.INTERRUPTED if isinstance(error, KeyboardInterrupt) else Status.FAILED
            self.outcomes[i] = Outcome(name, ended, words, error=type(error))
            LOG.warning("case %s failed: %s", name, words)
            if isinstance(error, KeyboardInterrupt):  # by a function of the case: handled as Ctrl-C
                self._heard(None)
            return None

    def _begin(self, i: int, name: str, case: Run | Piece) -> Begun | None:
        """Prepare a case; None if it is finished: by a stored result, by a worker of a cluster, or as a piece."""
        stored = self.kept.begin(name, case, self.reduce)
        if isinstance(stored, Outcome):
            self.outcomes[i] = stored
            return None
        case, keep = stored
        if self.cluster is not None or isinstance(case, Piece):
            work = partial(alone, name, case, keep, self.series, self.slopes)
            self.outcomes[i] = self.cluster.value(work, self.kept.folder, self.stop) if self.cluster else work()
            return None
        run = self.under_way[i] = self._prepare(with_model_and_wind(case))
        return case, keep, run

    def _end(self, i: int, name: str, case: Run, keep: Reduce, run: Simulation) -> None:
        """March a case to its end, unless a graphics card has done so, and keep what is asked for."""
        march(run, case.progress, stop=self.stop.is_set)
        if run.status is Status.INTERRUPTED:
            self._heard(None)
        if self.device != "cpu":  # a card does not
            run.derive(run.loop.output[: int(run.case.clock.row)])
        result = run.result()
        result.meta["case"] = name
        ended: Any = result if self.series else cast("Any", run.sink).summary(result, run.output_step)
        self.outcomes[i] = Outcome(name, result.status, result.message, keep(ended))

    def _prepare(self, case: Run) -> Simulation:
        if case.view and not self.series:
            raise InputError("view=True and series=False exclude each other: the view needs time series")
        chunk = None if self.series else CHUNK
        with self.first_lock:  # Numba compiles under one lock: the first case compiles, the others find it done
            run = None if self.compiled else prepare(case, self.device, chunk)
            self.compiled = True
        run = run or prepare(case, self.device, chunk)
        if not self.series:
            if self.device != "cpu" and run.derived:
                raise InputError(f"device {self.device!r}: section loads of members need series=True")
            import_module("meltemi.postprocess.summary").counted(run, self.slopes)
        return run


def told_to_end() -> bool:
    """Whether the batch to which this thread belongs is told to end: pieces that take long ask for it."""
    return hasattr(_THREAD, "stop") and _THREAD.stop.is_set()


def alone(name: str, case: Run | Piece, keep: Reduce, series: bool, slopes: Mapping[str, float] | None) -> Outcome:
    """Outcome of one case, in a thread of a process that may be anywhere."""
    if isinstance(case, Piece):
        return Outcome(name, Status.OK, value=keep(case.work()))
    case = replace(case, name=name, progress=None)
    (outcome,) = Batch([case], reduce=keep, workers=1, series=series, slopes=slopes).run()
    return outcome


def memory_of(run: Simulation) -> dict[int, int]:
    """Bytes of the wind field of a run and of its output, by their addresses."""
    return {array.ctypes.data: array.nbytes for array in (run.case.arrays["box"], run.loop.output)}


def _cards() -> Any:
    return import_module("meltemi.cuda.march")


@explained
def prepare(case: Run, device: str = "cpu", held_steps: int | None = None) -> Simulation:
    """Create the simulation of a case, as :class:`Simulation`.

    Raises:
      InputError: something of it is not valid, or its controller cannot run on the device.
    """
    if device == "cpu":
        return Simulation(case, held_steps=held_steps)
    run = Simulation(case, numbers="floats", held_steps=held_steps)
    _cards().compiled_update(run.case.controller)
    return run


@arguments_of(Batch)
def simulate_batch(batch: Batch) -> list[Outcome]:
    """Simulate many cases on all cores; the arguments are the fields of :class:`Batch`.

    A case that fails, for any reason, reports this in its outcome and affects no other. Ctrl-C ends all cases; results
    up to then are returned.

    Returns:
      One outcome a case, in their order; after Ctrl-C those that were begun. None with ``done``.

    Raises:
      InputError: ``workers`` or ``out`` is not valid, or one of ``cases`` is no run.
    """
    return batch.run()
