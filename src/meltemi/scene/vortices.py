"""Vortices of a wake for the view of a run: frames at equal numbers of time steps, as a track.

They are the lines of a part with a function ``vortex_lines(case)``: (blade, line, point, 4) points [m], inertial axes,
and strength [m^2/s]. Points have the same age in all frames, so that a few frames a revolution are enough.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.scene.record import track_arrays
from meltemi.simulation.case import Case
from meltemi.simulation.loop import Loop
from meltemi.turbine.definition import Turbine

FRAMES = 12
"""Frames of a revolution at rated speed; the view interpolates with cubic polynomials."""


@dataclass
class VortexFrames:
    """Frames of a run by time step, every ``every`` steps from the first one on."""

    every: int
    frames: dict[int, NDArray[np.float32]] = field(default_factory=dict)

    @classmethod
    def of(cls, turbine: Turbine, dt: float) -> VortexFrames:
        """Frames for a time step [s]."""
        return cls(max(round(2.0 * pi / FRAMES / turbine.rated_rotor_speed / dt), 1))

    def take(self, step: int, lines: Callable[[], NDArray[np.float32]]) -> int:
        """Take a frame, of ``lines()``, if it is time for one; returns the number of steps to the next."""
        last = next(reversed(self.frames), inf)
        if step < last:  # the first frame, or the run has begun again
            self.frames.clear()
            last = step - self.every
        if step >= last + self.every:
            self.frames[step] = lines()
            last = step
        return int(last) + self.every - step

    def track(self, dt: float, begin: float, end: float) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Description and arrays of the track between two times [s], whose time begins with the first frame."""
        chosen = {step: lines for step, lines in self.frames.items() if begin - 1e-9 <= step * dt <= end + 1e-9}
        if not chosen:
            return {}, {}
        values = np.stack(list(chosen.values())).astype(float)
        about = {"blades": values.shape[1], "lines": values.shape[2], "points": values.shape[3]}
        about |= {"largest": float(np.abs(values[..., 3]).max()), "step": self.every * dt}
        return {"vortices": about | {"begin": next(iter(chosen)) * dt - begin}}, track_arrays("vortices", values)


@dataclass(frozen=True)
class FramedLoop(Loop):
    """A time loop that takes frames between its time steps.

    Attributes:
      case: case that it marches.
      frames: taken frames.
      lines: part of the case that gives them.
    """

    case: Case
    frames: VortexFrames
    lines: Any

    def march(self, n_steps: int) -> None:
        """March a number of time steps, or until something ends the run."""
        clock, left = self.case.clock, n_steps
        while True:
            before = int(clock.step)
            piece = min(self.frames.take(before, lambda: self.lines.vortex_lines(self.case)), left)
            if not piece:
                return
            super().march(piece)
            left = left - piece if int(clock.step) - before == piece else 0
