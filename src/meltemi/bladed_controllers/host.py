"""Host of a controller library, which runs in a separate process.

A library keeps its state in global variables, may write anywhere, crash or hang. A new process for each run isolates
the turbine and other runs: a call that does not return becomes a :class:`RunError` with a message.
"""

from __future__ import annotations

import contextlib
import math
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import weakref
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from meltemi.bladed_controllers.child import HEADER
from meltemi.bladed_controllers.records import EXCHANGED, SIZE
from meltemi.core.errors import InputError, RunError

CHILD = Path(__file__).with_name("child.py")
LOG, ROOT = "library.log", "run"
LAST_LINES = 6
"""Number of lines of the output of a library that are shown when it fails."""
LAST_CALL = 2.0
"""[s] time limit of the last call of a library."""


@dataclass(frozen=True)
class Library:
    """Library to load, and its settings.

    Attributes:
      path: path of the shared library.
      input_file: input file of the library, or empty.
      procedure: name of the function.
      timeout: [s] wall time limit of a call.
      first_timeout: [s] limit for loading, and for the first call.
      folder: folder in which each run creates a working folder; None for a temporary one that is removed.
    """

    path: Path
    input_file: str
    procedure: str
    timeout: float
    first_timeout: float
    folder: Path | None


@dataclass
class _Watch:
    """Data shared with the thread that ends a child whose call takes too long; it must not keep the host alive."""

    process: subprocess.Popen[bytes]
    deadline: float = math.inf
    overdue: bool = False
    idle: bool = True
    done: threading.Event = field(default_factory=threading.Event)


class Host:
    """A running library.

    Attributes:
      records: the records of the swap array that are exchanged, float32, record 1 first; write before a call, read
        after it.
      message: message of the last call that had one.
      folder: the working folder.
      root_name: root of names of files that the library writes there. It ends in ``.SrvD`` as in OpenFAST: libraries
        remove the part after the last dot, ROSCO together with the terminating zero, which would otherwise truncate
        the names of its files.

    Raises:
      InputError: the library cannot be loaded or has no such function.
    """

    def __init__(self, library: Library) -> None:
        self.library = library
        try:
            self.folder = Path(tempfile.mkdtemp(prefix="controller-", dir=library.folder))
        except OSError as error:
            raise InputError(f"{library.folder}: cannot be written ({error.strerror or error})") from None
        self.root_name = str(self.folder / f"{ROOT}.SrvD")
        buffer = bytearray(HEADER + 4 * EXCHANGED)
        self._answer = memoryview(buffer)
        self._request = self._answer[HEADER:]
        self._head = self._answer[:HEADER].cast("i")
        self.records = self._request.cast("f")
        self.message = ""
        self._usable = True
        arguments = (library.path, library.procedure, library.input_file, self.root_name, EXCHANGED, SIZE)
        with (self.folder / LOG).open("wb") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-I", "-S", str(CHILD), *(str(a) for a in arguments)],
                bufsize=0,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                cwd=self.folder,
            )
        self._watch = _Watch(self._process)
        self._end = weakref.finalize(self, _end, self._watch, None if library.folder else self.folder)
        threading.Thread(
            target=_watch, args=(self._watch, min(0.25, 0.25 * library.timeout)), name="meltemi library", daemon=True
        ).start()
        assert self._process.stdin is not None and self._process.stdout is not None
        self._requests, self._answers = self._process.stdin, self._process.stdout
        try:
            failed = self._receive(library.first_timeout)
        except RunError as error:
            self.close()
            raise InputError(str(error)) from None
        if failed:
            self.close()
            raise InputError(
                f"{library.path}: cannot be used as a controller library: {self.message}; "
                f"expected a shared library for this machine with the function {library.procedure}"
            )

    def call(self, timeout: float) -> int:
        """Call the library with the present records; return ``aviFAIL``.

        Raises:
          RunError: the library crashed, or did not return within ``timeout`` seconds.
        """
        if not self._usable:
            raise RunError(f"the library {self.library.path} has ended")
        self._watch.idle = False
        with contextlib.suppress(OSError):  # the process has ended, which the missing answer shows, too
            self._requests.write(self._request)
        return self._receive(timeout)

    def _receive(self, timeout: float) -> int:
        self._watch.idle = False
        self._watch.deadline = time.monotonic() + timeout
        try:
            _fill(self._answers, self._answer)
            failed, length = self._head
            if length:
                text = bytearray(length)
                _fill(self._answers, memoryview(text))
                self.message = text.decode(errors="replace").strip()
        except EOFError:
            raise RunError(self._reason_of_failure(timeout)) from None
        finally:
            self._watch.deadline = math.inf
        self._watch.idle = True
        return failed

    def _reason_of_failure(self, timeout: float) -> str:
        """Reason why the process no longer answers, for the message."""
        self._usable = False
        try:
            code = self._process.wait(LAST_CALL)
        except subprocess.TimeoutExpired:
            code = None
        if self._watch.overdue:
            what = f"did not come back from a call within {timeout:g} s and was ended; allow it more by timeout"
        elif code is not None and code < 0:
            what = f"crashed ({_signal_name(-code)})"
        else:
            what = f"ended its process{'' if code is None else f' with exit code {code}'}"
        printed = self.printed()
        without = "" if self.library.input_file else " (it was given no input file: input_file, --controller-input)"
        return f"the library {self.library.path} {what}{without}" + (f"; it printed: {printed}" if printed else "")

    def printed(self) -> str:
        """Last lines of the output of the library, in one line."""
        try:
            text = (self.folder / LOG).read_text(errors="replace")
        except OSError:
            return ""
        lines = [line.strip() for line in text.splitlines() if line.strip(" -")]
        return " / ".join(lines[-LAST_LINES:])

    def close(self) -> None:
        """Make the last call of the library (status -1), then end its process; can be called again."""
        if self._usable and self._watch.idle and self._end.alive:
            self.records[0] = -1.0
            with contextlib.suppress(RunError):
                self.call(LAST_CALL)
        self._usable = False
        self._end()


def _fill(file: IO[bytes], view: memoryview) -> None:
    while len(view):
        n = file.readinto(view)  # type: ignore[attr-defined]
        if not n:
            raise EOFError
        view = view[n:]


def _watch(watch: _Watch, every: float) -> None:
    while not watch.done.wait(every):
        if time.monotonic() > watch.deadline:
            watch.overdue = True
            watch.process.kill()
            return


def _end(watch: _Watch, folder: Path | None) -> None:
    """End the process and remove its folder; runs at the latest when the interpreter ends."""
    watch.done.set()
    process: Any = watch.process
    process.stdin.close()  # the process then ends and completes its files
    if watch.idle:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(LAST_CALL)
    process.kill()
    process.wait()
    process.stdout.close()
    if folder is not None:
        shutil.rmtree(folder, ignore_errors=True)


def _signal_name(number: int) -> str:
    try:
        return f"{signal.Signals(number).name}: {signal.strsignal(number)}"
    except ValueError:
        return f"signal {number}"
