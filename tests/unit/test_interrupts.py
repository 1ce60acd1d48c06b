"""Ctrl-C: where it would be lost it is kept, and the keyboard is given back."""

from __future__ import annotations

import signal
import threading
from typing import Any

import pytest

from meltemi.control.entry import CALLED_BACK
from meltemi.control.plain_updates import callback
from meltemi.core.interrupts import on_interrupt
from meltemi.simulation.simulate import march

pytestmark = pytest.mark.skipif(
    signal.getsignal(signal.SIGINT) is not signal.default_int_handler, reason="Ctrl-C is handled by somebody else"
)


def ctrl_c() -> None:
    signal.raise_signal(signal.SIGINT)


def given_back() -> bool:
    return signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_the_first_calls_and_the_second_raises() -> None:
    heard: list[Any] = []

    def twice() -> None:
        with on_interrupt(heard.append):
            ctrl_c()
            heard.append("between")
            ctrl_c()

    with pytest.raises(KeyboardInterrupt):
        twice()
    assert len(heard) == 2
    assert given_back()


def test_the_signal_to_end_is_heard_once() -> None:
    """A second one ends the process, as it would have been without."""
    heard: list[Any] = []
    with on_interrupt(heard.append):
        signal.raise_signal(signal.SIGTERM)
        assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    assert len(heard) == 1 and signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


def test_what_is_called_may_raise() -> None:
    def act(frame: Any) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), on_interrupt(act):
        ctrl_c()
    assert given_back()


def test_other_threads_and_other_handlers_are_left_alone() -> None:
    seen: list[Any] = []

    def inside() -> None:
        with on_interrupt(seen.append):
            seen.append(given_back())

    thread = threading.Thread(target=inside)
    thread.start()
    thread.join()
    mine = signal.signal(signal.SIGINT, lambda number, frame: None)
    try:
        before = signal.getsignal(signal.SIGINT)
        with on_interrupt(seen.append):
            assert signal.getsignal(signal.SIGINT) is before
    finally:
        signal.signal(signal.SIGINT, mine)
    assert seen == [True]


def test_what_is_switched_off_stays_so() -> None:
    """As for a run in the background of a shell, or under nohup."""
    heard: list[Any] = []
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with on_interrupt(heard.append):
            ctrl_c()
            signal.raise_signal(signal.SIGTERM)  # of a scheduler that ends such a run
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN and len(heard) == 1
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


class Run:
    """Of a simulation what ``march`` needs; Ctrl-C comes in code of the module ``name``."""

    def __init__(self, name: str) -> None:
        self.interrupted, self.rest, self.passed, self.share = False, 5, 0, 0.0
        self.places = {"__name__": name, "signal": signal}
        exec("def work():\n    signal.raise_signal(signal.SIGINT)\n    return 1", self.places)

    @property
    def finished(self) -> bool:
        return self.interrupted or self.rest == 0

    def advance(self, chunk: int) -> None:
        self.rest -= 1
        self.passed += self.places["work"]()  # type: ignore[operator]

    def close(self) -> None:
        pass


@pytest.mark.parametrize(("name", "passed"), [(CALLED_BACK, 1), ("own_controller", 0)])
def test_a_run_stops_and_nothing_is_raised_through_compiled_code(name: str, passed: int) -> None:
    """ctypes swallows what is raised as its callback begins, and the run would go on."""
    assert callback.__module__ == CALLED_BACK
    run = Run(name)
    march(run)  # type: ignore[arg-type]
    assert (run.interrupted, run.rest, run.passed) == (True, 4, passed)
    assert given_back()


def test_an_inner_block_hears_first_and_gives_back_to_the_outer_one() -> None:
    heard: list[str] = []

    def outer(_: Any) -> None:
        heard.append("outer")
        raise KeyboardInterrupt

    with on_interrupt(outer):
        with on_interrupt(lambda _: heard.append("inner")):
            signal.raise_signal(signal.SIGTERM)
            assert heard == ["inner"]
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGTERM)
    assert heard == ["inner", "outer"]
