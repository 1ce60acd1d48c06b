"""Handling of Ctrl-C where an exception could be lost or leave an inconsistent state.

Python turns Ctrl-C into an exception in the main thread, at whatever it runs then. That is lost if it is raised as
compiled code calls back into Python, and leaves locks behind if it is raised between threads.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def on_interrupt(act: Callable[[FrameType | None], None]) -> Iterator[None]:
    """Within the block the first Ctrl-C calls ``act`` with the current frame; later ones raise KeyboardInterrupt.

    Nothing changes outside of the main thread, or where another handler of Ctrl-C is installed.
    """
    ours = threading.current_thread() is threading.main_thread()
    if not (ours and signal.getsignal(signal.SIGINT) is signal.default_int_handler):
        yield
        return

    def heard(number: int, frame: FrameType | None) -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        act(frame)

    signal.signal(signal.SIGINT, heard)
    try:
        yield
    finally:
        try:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        except KeyboardInterrupt:  # Ctrl-C came just before the handler was changed
            signal.signal(signal.SIGINT, signal.default_int_handler)
            raise
