"""Saved states of runs: a continued run equals an uninterrupted one bit by bit.

The time loop reads and writes a fixed set of vectors (``Simulation.moving``); everything else is created anew from the
description of the run. A saved state consists of these vectors, the samples recorded so far, the log of manual actions,
and the identity of everything that must be equal in the continued run.

The kernels use numbers of these vectors as indices: states of a supervisor, rows of the output. A file is therefore
read only with the signature of the same user (``core/private.py``), which covers every byte; its counters and constants
are compared with those of the run all the same.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from meltemi.compiler import View, source_hash
from meltemi.control.controller import LogEntry
from meltemi.control.signals import CALLBACK
from meltemi.core.errors import InputError
from meltemi.core.files import bytes_of, replacing
from meltemi.core.physics import PHYSICS
from meltemi.core.private import signed, user_key, verified
from meltemi.simulation import step
from meltemi.simulation.simulate import Simulation, describe
from meltemi.simulation.tables import Watch

if TYPE_CHECKING:
    from numpy.typing import NDArray

FORMAT = 2
LARGEST = 20_000_000_000
VECTORS = "signals aero_states measured velocity acceleration clock controller_state faults watch weights".split()
"""Names of ``Simulation.moving`` in the file."""
REMEDIES = {
    "turbine_hash": "it was saved with another turbine",
    "model_hash": "it was saved with other options or air",
    "wind_hash": "it was saved in another wind; one that is generated for the duration of the run, such as turbulence, "
    "depends on it: give the whole duration from the beginning, and stop before its end (--until)",
    "sea": "it was saved in another sea",
    "grid": "it was saved with another grid",
    "start": "it was saved in a run with another start",
    "controller": "it was saved under another controller",
    "controller_state_hash": "it was saved under a controller with other settings",
    "time_step": "it was saved in a run with another time step",
    "output_step": "it was saved in a run with another output_step",
    "channels": "it was saved in a run with other channels",
}
"""Keys of the description of a run that must be equal, with the reason why a state is refused."""
SETTINGS = "every_output every_control corrections want_loads".split()
"""Rows of ``Clock`` that a run does not move."""
CONSTANT = ("limit", "notice", "scale", "place")
"""Rows of ``Watch`` that a run does not move."""
MACHINE = ("physics", "code", "python", "numba", "numpy", "machine", "processor")


def save_state(simulation: Simulation, path: str | Path) -> Path:
    """Save the state of a run at any time step, also during events; :func:`restore_state` continues it.

    Args:
      simulation: stopped by ``advance`` or ``march``, or at its end.
      path: file, which only the same user can continue.

    Returns:
      The path.

    Raises:
      InputError: the run has failed, a controller library or the wakes of other turbines have states outside of the
        run, or the file or the user's key cannot be written.
    """
    case, path = simulation.case, Path(path)
    if case.clock.status != step.OK:
        raise InputError(f"{path}: the run has failed and cannot be continued: {simulation.message}")
    if case.controller.close is not None:
        raise InputError(
            f"{path}: the controller {case.controller.name!r} keeps its state in a separate process, which cannot be "
            "saved; compiled controllers and plain functions of the state vector can"
        )
    if len(case.parts) > len(simulation.model.parts) + (simulation.sea is not None):
        raise InputError(f"{path}: the wakes of other turbines have states that are not saved")
    acted = [[at, asdict(entry)] for at, entry in simulation._acted]
    about = {"format": FORMAT, "identity": _identity(simulation), "machine": _machine(simulation), "acted": acted}
    about["run_seconds"] = simulation.run_seconds
    vectors: dict[str, Any] = dict(zip(VECTORS, simulation.moving, strict=True))
    past = case.events[: int(case.clock.next_event)]
    output = simulation.loop.output[: int(case.clock.row)]
    text, content = np.frombuffer(json.dumps(about).encode(), dtype=np.uint8), BytesIO()
    np.savez(content, about=text, past_events=past, output=output, **vectors)
    with _key() as key, replacing(path) as (partial,):
        partial.write_bytes(signed(content.getvalue(), key))
    return path


def restore_state(simulation: Simulation, path: str | Path) -> list[str]:
    """Put a saved state into a new simulation of the same run, which then continues it, with all samples so far.

    The new run may have another duration, and other events after the saved time. With the same code and processor
    the continued run equals an uninterrupted one bit by bit.

    Args:
      simulation: simulation with the same arguments, before its first step.
      path: file of :func:`save_state`.

    Returns:
      Differences in code and machine, because of which results may differ by rounding.

    Raises:
      InputError: the file is no saved state of this user, or of another run; the message lists the differences.
    """
    path, case = Path(path), simulation.case
    about, arrays = _read(path)
    identity = _identity(simulation)
    for key, why in REMEDIES.items():
        if about["identity"].get(key) != identity[key]:
            raise InputError(f"{path}: the state is not one of this run: {why}")
    moving = dict(zip(VECTORS, simulation.moving, strict=True))
    for name, array in moving.items():
        if arrays[name].shape != array.shape or arrays[name].dtype != array.dtype:
            raise InputError(f"{path}: {name}: expected the shape {array.shape}, found {arrays[name].shape}")
    if not _counts_fit(simulation, bool(about["acted"]), arrays):
        raise InputError(f"{path}: its counters are not those of a state of this run")
    at, samples = int(type(case.clock)(arrays["clock"]).step), arrays["output"]
    past, coming = arrays["past_events"], case.events[len(arrays["past_events"]) :]
    if not np.array_equal(case.events[: len(past)], past) or np.any(coming[:, 0] < at):
        raise InputError(
            f"{path}: events before the saved time, {at * simulation.dt:g} s, differ from those of this run"
        )
    if at > simulation.n_steps or len(samples) > len(simulation.loop.output):
        raise InputError(
            f"{path}: saved at {at * simulation.dt:g} s, after the end of this run at {simulation.duration:g} s; "
            "give a longer duration"
        )
    address = case.measured[CALLBACK]  # of this process
    for name, array in moving.items():
        array[...] = arrays[name]
    case.measured[CALLBACK] = address
    simulation.loop.output[: len(samples)] = samples
    simulation._acted[:] = [(at, LogEntry(**entry)) for at, entry in about["acted"]]
    simulation.run_seconds += float(about["run_seconds"])
    then, now = about["machine"], _machine(simulation)
    changed = [f"{key} {then.get(key)} -> {now[key]}" for key in MACHINE if then.get(key) != now[key]]
    consequence = "the rest of the run may differ from one that was not interrupted, beginning with rounding"
    return [f"{path}: saved by another program or computer ({', '.join(changed)}): {consequence}"] if changed else []


def stop_at(simulation: Simulation, time: float) -> None:
    """Let a run end at an earlier time [s], as if its duration were shorter; quantities that depend on the duration
    stay.

    Raises:
      InputError: the time is not between the present one and the end.
    """
    if not (math.isfinite(time) and simulation.time <= time <= simulation.duration):
        raise InputError(
            f"until: expected a time from {simulation.time:g} s to the end of the run at {simulation.duration:g} s, "
            f"found {time!r}"
        )
    simulation.n_steps = round(time / simulation.dt) + 1


def _identity(simulation: Simulation) -> dict[str, Any]:
    """Properties that must be equal, in the form in which they are saved."""
    known = describe(simulation)
    identity: dict[str, Any] = json.loads(json.dumps({key: known[key] for key in REMEDIES}, default=str))
    return identity


def _machine(simulation: Simulation) -> dict[str, Any]:
    known: dict[str, Any] = describe(simulation) | {"physics": PHYSICS, "code": source_hash()[:16]}
    return {key: known[key] for key in MACHINE}


@contextmanager
def _key() -> Iterator[bytes]:
    """Secret key of the user.

    Raises:
      InputError: the key cannot be created or read.
    """
    try:
        yield user_key()
    except OSError as error:
        raise InputError(f"{error.filename}: saved states need the user's key ({error.strerror or error})") from None


def _counts_fit(simulation: Simulation, acted: bool, arrays: dict[str, NDArray[Any]]) -> bool:
    """Whether counters and constants of a file, which kernels use as indices, are those of the run.

    Args:
      acted: events were triggered manually, after which sensors report also in a run without prescribed events.
    """
    clock, rows = simulation.case.clock, simulation.loop.output.shape[1]
    by_hand = acted and not len(simulation.case.events)
    saved, output = type(clock)(arrays["clock"]), arrays["output"]
    watch, now = (View(Watch, array) for array in (arrays["watch"], simulation.case["watch"]))
    return (
        saved.step >= 0
        and saved.row == len(output) <= saved.step // clock.every_output + 1
        and output.shape[1] == rows
        and saved.next_event == max(len(arrays["past_events"]), by_hand)
        and saved.status == step.OK
        and all(getattr(saved, name) == getattr(clock, name) for name in SETTINGS)
        and all(np.array_equal(watch[name], now[name]) for name in CONSTANT)
    )


def _read(path: Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Description and arrays of a file that the same user wrote."""
    with _key() as key:
        content = verified(bytes_of(path, LARGEST), key)
    if content is None:
        raise InputError(
            f"{path}: no state of a run that you saved with `meltemi run --save-state`, or it was changed afterwards; "
            "states of other users, or of a computer with another key of yours, are not read: save it again there"
        )
    with np.load(BytesIO(content), allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in ("about", "past_events", "output", *VECTORS)}
    return json.loads(arrays["about"].tobytes()), arrays
