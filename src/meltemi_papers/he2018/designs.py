"""Control designs beside the paper's: loops divided by frequency in other ways, preview of the wind and its errors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from meltemi.control.load_control import HarmonicLoop
from meltemi.controllers.names import SCHEMES, Target
from meltemi.controllers.tuning import LoopTuning, tune_loops
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.linear import LinearModel
from meltemi.wind.fields import WindBox
from meltemi_studies.preview import FREQUENCY, rotor_average

Float = NDArray[np.float64]

ADDED, WHOLE_LEAD = "ipc as it is, with flaps", "cpfc, whole lead"
NARROW = 0.5
"""Damping ratio of narrow band-pass filters: that of 1P passes 2P with a gain of 0.55."""
Tunings = Mapping[tuple[Target, ...], tuple[LoopTuning, ...]]


def designs(model: BladedModel, linear: Sequence[LinearModel], tunings: Tunings) -> dict[str, tuple[HarmonicLoop, ...]]:
    """Loops of 1P pitch and 2P flaps that are not those of the rule.

    "Whole lead" has the proportional part that takes back all of the band-pass's delay, "narrow" narrow band-passes.
    """

    def of(scheme: str) -> tuple[HarmonicLoop, ...]:
        return tuple(tuning.loop for tuning in tunings[SCHEMES[scheme].loops])

    def led(loops: Iterable[HarmonicLoop]) -> tuple[HarmonicLoop, ...]:
        nP = linear[0].point.rotor_speed
        return tuple(
            loop.replace(proportional_gain=loop.integral_gain / (loop.filter_damping * loop.harmonic * nP))
            for loop in loops
        )

    def narrow(scheme: str) -> tuple[HarmonicLoop, ...]:
        found = tune_loops(model, SCHEMES[scheme].loops, linear=linear, filter_damping=NARROW)
        return tuple(tuning.loop for tuning in found)

    added = of("ipc") + of("flaps")
    return {
        ADDED: added,
        WHOLE_LEAD: led(of("cpfc")),
        f"{ADDED}, whole lead": led(added),
        "ipc, narrow": narrow("ipc"),
        "cpfc, narrow": narrow("cpfc"),
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
