"""Control designs beside the paper's: loops divided by frequency in other ways, preview of the wind and its errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import pi

import numpy as np
from numpy.typing import NDArray

from meltemi.control.load_control import HarmonicLoop, LoadSensor
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.linear import LinearModel
from meltemi.studies.preview import FREQUENCY, rotor_average
from meltemi.studies.tuning import tune_ipc, tune_loops
from meltemi.wind.fields import WindBox

Float = NDArray[np.float64]

ADDED = "ipc as it is, with flaps"
INTEGRAL_IPC, INTEGRAL = "ipc, integral", "cpfc, integral"
ROLL_OFF = 2.0 * pi * 0.5
"""[rad/s] corner of the low-pass of the moments: half the frequency of the first edgewise mode."""
NARROW = 0.5
"""Damping ratio of narrow band-pass filters: that of 1P passes 2P with a gain of 0.55."""


@dataclass(frozen=True)
class Design:
    """Feedback loops.

    Attributes:
      loops: that act together.
      sensor: of the moments.
    """

    loops: tuple[HarmonicLoop, ...]
    sensor: LoadSensor = field(default_factory=LoadSensor)


def designs(model: BladedModel, linear: Sequence[LinearModel]) -> dict[str, Design]:
    """Loops of 1P pitch and 2P flaps that are tuned in other ways; those with flaps have the pitch loop of their IPC.

    "Integral" has no proportional part, whose gain does not fall with frequency. With a roll-off the loops are tuned
    together, and share their margins.
    """

    def both(lead_time: float | None = None, filter_damping: float | None = None) -> tuple[HarmonicLoop, HarmonicLoop]:
        tune = partial(tune_ipc, model, lead_time=lead_time, filter_damping=filter_damping, linear=linear)
        return tune(1, "pitch").loop, tune(2, "flap").loop

    integral, narrow = both(0.0), both(0.0, NARROW)
    sensor = LoadSensor(low_pass=ROLL_OFF)
    rolled = [
        tuple(tuning.loop for tuning in tune_loops(model, targets, linear=linear, sensor=sensor))
        for targets in ((("pitch", 1),), (("pitch", 1), ("flap", 2)))
    ]
    return {
        ADDED: Design(both()),
        "ipc, roll-off": Design(rolled[0], sensor),
        "cpfc, roll-off": Design(rolled[1], sensor),
        INTEGRAL_IPC: Design(integral[:1]),
        INTEGRAL: Design(integral),
        "ipc, integral, narrow": Design(narrow[:1]),
        "cpfc, integral, narrow": Design(narrow),
    }


@dataclass(frozen=True)
class Lidar:
    """How the wind is measured before the rotor; none of the errors by default.

    Attributes:
      frequency: [rad/s] corner of the preview's low-pass.
      beams: at 0.7 of the radius, of which the mean is taken; 0: the mean over the rotor.
      decay: [s] of the coherence exp(-decay f) between the wind measured and the wind at the rotor.
      lost: share of the seconds without measurement, in which the last value is held.
    """

    frequency: float = FREQUENCY
    beams: int = 0
    decay: float = 0.0
    lost: float = 0.0


SLOW, DECAY, LOST = 0.25, 10.0, 0.3
LIDARS: Mapping[str, Lidar] = {
    "30 % lost": Lidar(lost=LOST),
    "evolving turbulence": Lidar(decay=DECAY),
    "4 beams": Lidar(beams=4),
    "4 beams, 0.25 rad/s": Lidar(SLOW, beams=4),
    "all errors, 0.25 rad/s": Lidar(SLOW, 4, DECAY, LOST),
}
"""Errors of the measurement, by name. Their sizes are assumed."""
BEAM_RADIUS = 0.7


def measured(box: WindBox, model: BladedModel, lidar: Lidar) -> Float:
    """(T,) [m/s] wind speed at the rotor as a lidar measures it, at the times of a wind box from zero on."""
    turbine, rng = model.turbine, np.random.default_rng(1)
    u = rotor_average(box, turbine.hub_height, turbine.rotor_radius)
    if lidar.beams:
        rows, columns = box.velocity.shape[1:3]
        z = box.bottom + box.dz * np.arange(rows) - turbine.hub_height
        y = box.dy * (np.arange(columns) - 0.5 * (columns - 1))
        at = BEAM_RADIUS * turbine.rotor_radius * np.exp(2j * pi * (np.arange(lidar.beams) + 0.5) / lidar.beams)
        points = [(int(np.abs(z - p.real).argmin()), int(np.abs(y - p.imag).argmin())) for p in at]
        u = np.mean([box.velocity[:, row, column, 0] for row, column in points], axis=0, dtype=np.float64)
    if lidar.decay:
        tones = np.fft.rfft(u - u.mean())
        kept = np.exp(-0.5 * lidar.decay * np.fft.rfftfreq(len(u), box.dt))
        other = np.abs(tones) * np.exp(2j * pi * rng.random(len(tones)))
        u = u.mean() + np.fft.irfft(kept * tones + np.sqrt(1.0 - kept**2) * other, len(u))
    if lidar.lost:
        second = np.arange(len(u)) * box.dt // 1.0
        there = (rng.random(int(second[-1]) + 1) >= lidar.lost)[second.astype(int)]
        there[0] = True
        u = u[np.maximum.accumulate(np.where(there, np.arange(len(u)), 0))]
    return np.interp(box.dt * np.arange(len(u)), box.passing - turbine.nacelle.overhang / box.speed, u)
