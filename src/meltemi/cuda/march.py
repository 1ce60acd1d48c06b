"""Runs on a graphics card: the time loop of many runs at once, one thread each, compiled by numba-cuda.

The kernels are those of the processor, for floats. A record is a row of addresses, so a run is moved to the card by
copying its memory and replacing the addresses (:class:`Image`). Memory that several runs share, such as their model and
the field of their wind, is copied once. Afterwards the memory is copied back, and the runs continue on the host.
"""

from __future__ import annotations

import ctypes
import time
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from numba import config
from numpy.typing import NDArray

from meltemi.compiler import TableClass, all_kernels, is_compiled, loose, members, type_of_class, types
from meltemi.control.controller import Controller, of_vectors
from meltemi.core.errors import InputError
from meltemi.core.extras import need
from meltemi.cuda import single_precision
from meltemi.simulation import step
from meltemi.simulation.simulate import Simulation

BLOCK = 32
"""Threads of a block."""
ALIGNMENT = 64
SIGNATURE = types.void(types.int64[::1], types.int64[:, ::1])
"""Arguments of the kernel: number of steps of each run, and addresses of its records."""
Bytes = NDArray[np.uint8]


def check() -> None:
    """Raise InputError unless numba-cuda and a graphics card are present."""
    need("device 'cuda'", "numba-cuda")
    from numba import cuda

    if not cuda.is_available():
        raise InputError("device 'cuda': no graphics card of NVIDIA, or no driver of it; device 'cpu' needs none")


def compiled_update(controller: Controller) -> Any:
    """The compiled update of a controller; InputError if it is plain Python."""
    if not is_compiled(controller.update):
        raise InputError(
            f"controller {controller.name!r} cannot run on a graphics card: it is plain Python; decorate its update by "
            "numba.njit"
        )
    return controller.update


class Image:
    """Memory of runs as one vector of bytes, with their records as rows of addresses in it.

    Args:
      runs: runs that have not begun; a run may occur several times, as independent copies with equal initial states.

    Attributes:
      content: memory of all runs (bytes).
      words: records of each run (runs, words), with addresses relative to the beginning of ``content``.
      first: index of the first word of each record.
    """

    def __init__(self, runs: Sequence[Simulation]) -> None:
        memory = {id(run): _spans(records_of(run)) for run in runs}
        common = Counter(span for spans in memory.values() for span in spans)
        places: dict[tuple[int, ...], int] = {}
        self.parts: list[tuple[int, int, int]] = []  # address, bytes, offset: separate for each run
        size, rows = 0, []
        for i, run in enumerate(runs):
            spans = memory[id(run)]
            begins = []
            for begin, end, writeable in spans:
                shared = common[begin, end, writeable] > 1 or not writeable
                key = (begin, end) if shared else (begin, end, i)
                if key not in places:
                    places[key], size = size, size + -(-(end - begin) // ALIGNMENT) * ALIGNMENT
                    if not shared:
                        self.parts.append((begin, end - begin, places[key]))
                begins.append(places[key])
            rows.append(_relocated(run, np.array([s[0] for s in spans]), np.array(begins)))
        self.content: Bytes = np.zeros(size, dtype=np.uint8)
        for (begin, end, *_), place in places.items():
            self.content[place : place + end - begin] = _bytes(begin, end - begin)
        self.words = np.array(rows, dtype=np.int64)
        lengths = [len(record.words) for record in records_of(runs[0])]
        self.first = [sum(lengths[:k]) for k in range(len(lengths))]
        self.addresses = np.concatenate([_addresses(record) for record in records_of(runs[0])])

    def at(self, base: int) -> NDArray[np.int64]:
        """Records with addresses for memory that begins at ``base``."""
        return self.words + np.where(self.addresses, base, 0)

    def restore(self) -> None:
        """Copy the memory of each run back."""
        for begin, size, place in self.parts:
            _bytes(begin, size)[:] = self.content[place : place + size]


def records_of(run: Simulation) -> tuple[Any, ...]:
    """The records of a run in the order of the time loop, with those of statistics if no series are recorded."""
    return (*run.loop.records, *(() if run.sink is None else (run.sink.record,)))


def _spans(records: Sequence[Any]) -> list[tuple[int, int, bool]]:
    """Begin and end of the memory of records, without overlaps, and whether it is written to."""
    arrays = [array for record in records for array in record._keep if array is not None and array.nbytes]
    spans: list[tuple[int, int, bool]] = []
    for begin, size, writeable in sorted(
        (a.ctypes.data, a.nbytes, a.flags.writeable and a.dtype != np.float32) for a in arrays
    ):
        if spans and begin < spans[-1][1]:
            spans[-1] = (spans[-1][0], max(spans[-1][1], begin + size), spans[-1][2] or writeable)
        else:
            spans.append((begin, begin + size, writeable))
    return spans


def _addresses(record: Any) -> NDArray[np.bool_]:
    """Indices of the words of a record that are addresses of floats."""
    cls: Any = type(record)
    return np.concatenate([[True, False] + [False] * member.ndim for member in members(cls).values()])


def _relocated(run: Simulation, begins: NDArray[np.int64], places: NDArray[np.int64]) -> NDArray[np.int64]:
    """Words of the records of a run; the memory at ``begins`` moves to ``places``."""
    words = np.concatenate([record.words for record in records_of(run)])
    at = np.concatenate([_addresses(record) for record in records_of(run)])
    span = np.maximum(np.searchsorted(begins, words[at], side="right") - 1, 0)
    words[at] += places[span] - begins[span]
    return words


def _bytes(address: int, size: int) -> Bytes:
    return np.ctypeslib.as_array((ctypes.c_uint8 * size).from_address(address))


def on_card(function: Any) -> Any:
    """A function for kernels of the card, with IEEE arithmetic."""
    from numba.cuda.dispatcher import CUDADispatcher

    return CUDADispatcher(function, {"device": True, "fastmath": False, "debug": False, "opt": True})


@cache
def _loop() -> Any:
    """The time loop for the card, with every kernel that it calls.

    numba-cuda compiles called kernels by an attribute of each, which it would otherwise set itself with all of Numba's
    fast mathematics: NaN could then no longer be recognised.
    """
    from numba.cuda.extending import typeof_impl

    typeof_impl.register(TableClass)(type_of_class)
    loop = loose(step.advance)
    for kernel in all_kernels():
        kernel._CUDATypingContext__dispatcher = on_card(kernel.py_func)
    return loop


@cache
def _compiled(
    update: Any, classes: tuple[type, ...], first: tuple[int, ...], registers: int | None, single: bool
) -> Any:
    from meltemi.cuda.kernel import march_kernel

    functions = _loop(), on_card(of_vectors(update)), step.evaluate, step.observe
    kernel = march_kernel(functions, classes, first, max_registers=registers)
    if single:
        with single_precision.on_card():
            kernel.compile(SIGNATURE)
    return kernel


def kernel_of(run: Simulation, registers: int | None = None, *, single: bool = False) -> Any:
    """The kernel for a run and others with the same kind of rotor and the same controller.

    Args:
      registers: largest number of registers per thread; by default unlimited.
      single: evaluate in single precision.
    """
    records = records_of(run)
    lengths = [len(record.words) for record in records]
    classes, first = tuple(map(type, records)), tuple(sum(lengths[:k]) for k in range(len(lengths)))
    if config.ENABLE_CUDASIM:  # cannot be compiled: the loop of the processor takes the same words
        from meltemi.cuda.kernel import march_kernel

        return march_kernel((run.loop.function, run.loop.controller, *run.loop.physics), classes, first)
    return _compiled(compiled_update(run.case.controller), classes, first, registers, single)


def march_together(
    runs: Sequence[Simulation], stop: Callable[[], bool] = lambda: False, *, steps: int = 500, single: bool = False
) -> None:
    """Advance runs on the card to their ends, or until ``stop`` interrupts them.

    Args:
      steps: time steps between two checks of ``stop``; a run without a series holds the output of as many.
      single: evaluate in single precision.
    """
    groups: dict[Any, list[Simulation]] = {}
    for run in runs:
        groups.setdefault((run.case.controller.update, *map(type, records_of(run))), []).append(run)
    for group in groups.values():
        _march(group, stop, steps, single)


def _march(runs: Sequence[Simulation], stop: Callable[[], bool], steps: int, single: bool) -> None:
    from numba import cuda

    began = time.perf_counter()
    kernel, image = kernel_of(runs[0], single=single), Image(runs)
    memory = cuda.to_device(image.content)
    words = cuda.to_device(image.at(address(memory)))
    left = np.array([run.n_steps - int(run.case.clock.step) for run in runs])
    while left.any() and not stop():
        counts = np.minimum(left, steps)
        kernel[-(-len(runs) // BLOCK), BLOCK](cuda.to_device(counts), words)
        cuda.synchronize()
        left -= counts
    memory.copy_to_host(image.content)
    image.restore()
    for run in runs:
        run.interrupted = bool(left.any()) and not run.finished
        run.run_seconds += (time.perf_counter() - began) / len(runs)


def address(array: Any) -> int:
    """Address of an array on the card."""
    pointer = getattr(array, "device_ctypes_pointer", None)
    return int(array.ctypes.data if pointer is None else pointer.value)
