"""Handling of Ctrl-C, and of the signal to end, where an exception could be lost or leave an inconsistent state.

Python turns Ctrl-C into an exception in the main thread, at whatever it runs then. That is lost if it is raised as
compiled code calls back into Python, and leaves locks behind if it is raised between threads. SIGTERM, with which a
scheduler announces that it will end a process, would end it at once.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

USUAL: dict[int, Any] = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}


@contextmanager
def on_interrupt(act: Callable[[FrameType | None], None]) -> Iterator[None]:
    """Within the block the first Ctrl-C or SIGTERM calls ``act`` with the current frame; later ones act as outside.

    Nothing changes outside of the main thread, or for a signal with another handler.
    """
    before = {n: signal.getsignal(n) for n in USUAL if threading.current_thread() is threading.main_thread()}
    ours = {n: h for n, h in before.items() if h == USUAL[n] or getattr(h, "__module__", "") == __name__}

    def heard(number: int, frame: FrameType | None) -> None:
        signal.signal(number, ours[number])
        act(frame)

    for number in ours:
        signal.signal(number, heard)
    try:
        yield
    finally:
        for number in ours:
            try:
                signal.signal(number, ours[number])
            except KeyboardInterrupt:  # Ctrl-C came just before the handler was changed
                signal.signal(number, ours[number])
                raise
