"""Controller from a Bladed-style shared library."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path

import numpy as np

from meltemi.bladed_controllers.host import Host, Library
from meltemi.bladed_controllers.records import CONSTANTS, RECORDS
from meltemi.bladed_controllers.rosco import is_rosco
from meltemi.control.controller import Controller, StartPoint, Vector
from meltemi.control.signals import Demands, Measurements
from meltemi.core.errors import InputError, RunError, did_you_mean
from meltemi.core.files import reading
from meltemi.turbine.power_turbine import AnyTurbine

FIRST_CALL = 3.0
"""Time limit of the first call, which reads files, over that of the others."""
MOST_MESSAGES = 10
"""Largest number of different messages of a library that are kept as warnings."""
LIBRARY_BEGINS = (
    *(b"\x7fELF", b"MZ"),
    *(b"\xfe\xed\xfa\xce", b"\xfe\xed\xfa\xcf", b"\xce\xfa\xed\xfe", b"\xcf\xfa\xed\xfe", b"\xca\xfe\xba\xbe"),
)
"""First bytes of shared libraries: ELF, PE, and Mach-O of both byte orders and of several processors."""
DEGREE = math.pi / 180.0
(STATUS, SAMPLE_TIME, PITCH_DEMAND, YAW_ERROR, INDIVIDUAL, CONTACTOR, BRAKE, PITCH_1, PITCH, TORQUE, YAW_RATE) = (
    number - 1 for number in (1, 3, 11, 24, 28, 35, 36, 42, 45, 47, 48)
)
INPUT_SIZE, ROOT_SIZE, PITCH_OVERRIDE, TORQUE_OVERRIDE, AZIMUTH, HUB_Y, HUB_Z, BEARING_Y, BEARING_Z, FLAP = (
    number - 1 for number in (50, 51, 55, 56, 60, 73, 74, 77, 78, 120)
)
"""Places of records in the swap array, which counts from 0 here."""


def BladedController(  # noqa: PLR0913 - settings of one library, each with a default
    turbine: AnyTurbine,
    library: str | Path,
    input_file: str | Path | None = None,
    *,
    sample_time: float | None = None,
    procedure: str = "DISCON",
    individual_pitch: bool = True,
    timeout: float = 10.0,
    folder: str | Path | None = None,
    name: str = "",
) -> Controller:
    """A controller from a shared library with Bladed's interface, such as ROSCO.

    Each run starts the library in a separate process, which isolates its state, its output, crashes and hangs.
    The turbine's limits and set-points are passed in the records of the swap array
    (docs/guide/bladed-controllers.md).

    Args:
      turbine: controlled turbine.
      library: shared library (.so, .dylib, .dll).
      input_file: input file of the library, e.g. ``DISCON.IN``.
      sample_time: [s] time between calls; by default every time step.
      procedure: name of the function in the library.
      individual_pitch: use the pitch demand of each blade (records 42 to 44); False: the collective one (45).
      timeout: [s] wall time limit of a call; three times as long for the first one.
      folder: folder in which each run keeps a folder with output and files of the library; by default temporary.
      name: name for messages; by default that of the library.

    Returns:
      The controller; it can be used in any number of runs at a time.

    Raises:
      InputError: a file is missing (ROSCO needs its settings) or is no library, or a number is out of range. The
        start of a run raises it if the library cannot be loaded.
    """
    path = _file(library, "library")
    check_library(path)
    if input_file is None and is_rosco(path):
        raise InputError(
            "controller rosco: needs its settings: --controller-input DISCON.IN (in a case file controller.input, in "
            "Python input_file)"
        )
    input_path = "" if input_file is None else str(_file(input_file, "input file"))
    if not (math.isfinite(timeout) and timeout > 0.0):
        raise InputError(f"controller {path.name}: timeout must be a positive number of seconds, found {timeout!r}")
    if folder is not None and not Path(folder).is_dir():
        raise InputError(f"controller {path.name}: no folder {folder}")
    kept = None if folder is None else Path(folder).absolute()
    described = Library(path, input_path, procedure, timeout, FIRST_CALL * timeout, kept)

    def fresh() -> Controller:
        run = _Run(turbine, described, individual_pitch)
        return Controller(
            update=run.update,
            init=run.init,
            sample_time=sample_time,
            name=name or path.name,
            warnings=lambda state: run.messages,
            close=run.close,
        )

    return Controller(update=_unbound, sample_time=sample_time, name=name or path.name, fresh=fresh)


def _file(path: str | Path, what: str) -> Path:
    """An absolute path that exists."""
    absolute = Path(path).absolute()
    if not absolute.is_file():
        names = [p.name for p in absolute.parent.iterdir()] if absolute.parent.is_dir() else []
        hint = did_you_mean(absolute.name, names)
        raise InputError(f"controller: {what} {path}: no such file{f'; {hint}' if hint.startswith('did') else ''}")
    return absolute


def check_library(path: Path) -> None:
    """Check that a file begins like a shared library (ELF, Mach-O or PE), so that others are rejected immediately.

    Raises:
      InputError: the file is no library, or cannot be read.
    """
    with reading(path) as (file, _):
        begin = file.read(4)
    if not begin.startswith(LIBRARY_BEGINS):
        python = "a Python file is a controller of kind: python" if path.suffix == ".py" else "it is no shared library"
        raise InputError(f"controller: {path}: cannot be used as a controller library: {python}")


def _unbound(state: Vector, measured: Measurements, demands: Demands, dt: float) -> None:
    raise InputError("a controller library is called through Controller.fresh(), which each run does")


class _Run:
    """Instance of the library for one run."""

    def __init__(self, turbine: AnyTurbine, library: Library, individual_pitch: bool) -> None:
        self.turbine, self.library = turbine, library
        self.host: Host | None = None
        self.messages: list[str] = []
        self.time = -math.inf
        self.n_flaps = len(turbine.flaps)
        self.individual = individual_pitch
        names = Measurements.names
        measured = [(r.number - 1, names.index(r.source)) for r in RECORDS if r.way == "to" and r.source in names]
        self.places, self.rows = (np.array(column) for column in zip(*measured, strict=True))

    def init(self, start: StartPoint) -> Vector:
        """Start the process; the library itself starts at its first call.

        Returns:
          Hash of the files of the library, which distinguishes runs in the metadata of results.
        """
        self._start()
        known = hashlib.sha256(self.library.path.read_bytes())
        if self.library.input_file:
            known.update(Path(self.library.input_file).read_bytes())
        return np.frombuffer(known.digest(), dtype=np.uint32).astype(float)

    def _start(self) -> None:
        self.close()
        self.host = Host(self.library)
        self.time = -math.inf
        self.records = np.asarray(self.host.records, dtype=np.float32)
        for r in RECORDS:
            if r.source in CONSTANTS:
                self.records[r.number - 1] = CONSTANTS[r.source](self.turbine)
        self.records[INDIVIDUAL] = float(self.individual)
        self.records[CONTACTOR] = 1.0
        self.records[INPUT_SIZE] = len(self.library.input_file.encode()) + 1
        self.records[ROOT_SIZE] = len(str(self.host.root_name).encode()) + 1

    def update(self, state: Vector, m: Measurements, demands: Demands, dt: float) -> None:
        """One call of the library."""
        now = m.time
        if self.host is None or now <= self.time:  # a new run needs a library in its initial state
            self._start()
        assert self.host is not None
        first, self.time = self.time == -math.inf, now
        records = self.host.records
        self.records[self.places] = m.array[self.rows]
        records[STATUS] = 0.0 if first else 1.0
        records[SAMPLE_TIME] = dt
        records[PITCH_DEMAND] = demands.pitch[0]
        records[YAW_ERROR] = math.remainder(-m.wind_direction - m.yaw, 2.0 * math.pi)
        azimuth, yaw = m.azimuth % (2.0 * math.pi), m.yaw
        records[AZIMUTH] = azimuth
        records[HUB_Y], records[HUB_Z] = _turned(m.hub_moment.y, m.hub_moment.z, azimuth)
        x, y, z = (float(part) for part in (m.yaw_bearing_moment.x, m.yaw_bearing_moment.y, m.yaw_bearing_moment.z))
        records[BEARING_Y], records[BEARING_Z] = _turned(y, -x, yaw)[0], z
        failed = self.host.call(self.library.first_timeout if first else self.library.timeout)
        if failed:
            self._message(failed)
        self._demand(records, demands)

    def _message(self, failed: int) -> None:
        """Handle a message of the library: it ends the run if ``failed`` is negative, otherwise it is a warning.

        Raises:
          RunError: the library requested the end of the run.
        """
        assert self.host is not None
        if failed < 0:
            printed = self.host.printed()
            message = self.host.message or printed or "without a message"
            raise RunError(f"the library {self.library.path} requested the end of the run: {message}")
        if self.host.message not in self.messages and len(self.messages) < MOST_MESSAGES:
            self.messages.append(self.host.message)

    def _demand(self, records: memoryview[float], demands: Demands) -> None:
        if records[PITCH_OVERRIDE] != 0.0 or records[TORQUE_OVERRIDE] != 0.0:
            raise RunError(
                f"the library {self.library.path} requests the simulation's pitch or torque control "
                "(records 55, 56), which is not there"
            )
        demands.generator_torque = records[TORQUE] if round(records[CONTACTOR]) else 0.0
        demands.brake = 1.0 if records[BRAKE] else 0.0
        demands.yaw_rate = records[YAW_RATE]
        for blade in range(self.turbine.n_blades):
            demands.pitch[blade] = records[PITCH_1 + blade] if self.individual else records[PITCH]
            for flap in range(self.n_flaps):
                demands.flap[flap, blade] = DEGREE * records[FLAP + blade]

    def close(self) -> None:
        """End the process, if it is running."""
        host, self.host = self.host, None
        if host is not None:
            host.close()


def _turned(y: float, z: float, angle: float) -> tuple[float, float]:
    """Components y, z of a vector in axes rotated by ``angle`` about x."""
    return y * math.cos(angle) + z * math.sin(angle), z * math.cos(angle) - y * math.sin(angle)
