"""Pieces of a batch on the workers of a Dask cluster. What a dead worker had runs on another one."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from time import monotonic
from typing import Any, TypeVar

import meltemi
from meltemi.core.errors import InputError
from meltemi.core.extras import need
from meltemi.core.physics import PHYSICS
from meltemi.core.threads import available_cores

T = TypeVar("T")
LOCAL = "local"
"""Address that stands for worker processes of this machine."""
AHEAD = 2
"""Pieces that a worker receives before it has finished the first."""
CONNECTED = 20.0
"""[s] within which a scheduler must answer."""
TRIES = 8
"""Times that a piece is sent; Dask gives it up when four workers have died in it."""
POLL = 0.5
"""[s] between looks at Ctrl-C, and at the number of workers."""
VERSION = f"meltemi {meltemi.__version__}, physics {PHYSICS}"


class Cluster:
    """Workers of a cluster.

    Args:
      client: Dask's connection to its scheduler.
      address: of the scheduler, for messages.
    """

    def __init__(self, client: Any, address: str) -> None:
        self.client, self.address = client, address
        self.looked, self.threads = -POLL, 0

    def has_room(self, n: int) -> bool:
        """Whether the workers, which may come and go, can take one more piece than ``n``."""
        if monotonic() - self.looked >= POLL:
            self.looked = monotonic()  # before the answer: only one thread asks
            self.threads = sum(self._asked(self.client.nthreads).values())
        return n < AHEAD * max(self.threads, 1)

    def value(self, work: Callable[[], T], folder: Path | None, stop: threading.Event) -> T:
        """Value of a function without arguments, called by a worker.

        Args:
          work: pickled, as is its value; what it raises is raised here.
          folder: that the worker must see; None: none.
          stop: set when the value is no longer wanted.

        Raises:
          InputError: the worker has another version or does not see the folder, workers die in it, or there is no
            scheduler any more.
          KeyboardInterrupt: ``stop`` is set.
        """
        from distributed import KilledWorker

        for _ in range(TRIES):
            future = self._asked(self.client.submit, on_worker, VERSION, folder, work, pure=False)
            ended = threading.Event()
            future.add_done_callback(lambda _, ended=ended: ended.set())
            while not ended.wait(POLL):
                if stop.is_set():
                    future.cancel()
                    raise KeyboardInterrupt
            with suppress(KilledWorker):
                return self._asked(future.result)
        raise InputError(f"workers died {TRIES} times in it, for instance for want of memory")

    def _asked(self, what: Callable[..., Any], *arguments: Any, **settings: Any) -> Any:
        """What the scheduler answers.

        Raises:
          InputError: it does not.
        """
        from distributed import CancelledError
        from distributed.comm import CommClosedError

        try:
            return what(*arguments, **settings)
        except (CommClosedError, CancelledError) as error:
            raise InputError(f"dask {self.address}: the scheduler has ended ({error})") from None


@contextmanager
def connected(address: str) -> Iterator[Cluster]:
    """The workers of a scheduler at an address, or of this machine.

    Raises:
      InputError: Dask is not installed, or there is no scheduler at the address.
    """
    need("dask", "distributed")
    from distributed import Client, LocalCluster

    cluster = None
    if address == LOCAL:
        cluster = LocalCluster(n_workers=available_cores(), threads_per_worker=1, dashboard_address=":0")
    try:
        client = Client(cluster or address, set_as_default=False, timeout=CONNECTED)
    except (OSError, ValueError) as error:
        raise InputError(f"dask {address}: no scheduler there ({error})") from None
    with cluster or nullcontext(), client:
        yield Cluster(client, address)


def on_worker(version: str, folder: Path | None, work: Callable[[], T]) -> T:
    """Value of a function, in a worker.

    Raises:
      InputError: it has another version than the process that sends it, or does not see the folder.
    """
    if version != VERSION:
        raise InputError(f"the worker on {socket.gethostname()} has {VERSION}, the process that sends work {version}")
    if folder is not None and not folder.is_dir():
        raise InputError(f"the worker on {socket.gethostname()} does not see {folder}: give a folder that all share")
    return work()
