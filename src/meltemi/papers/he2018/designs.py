"""Control designs other than the paper's: other divisions of frequencies, preview of the wind and its errors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial

from meltemi.analyses.linear import LinearModel
from meltemi.control_laws.load_control import HarmonicLoop
from meltemi.controllers.names import SCHEMES, Target
from meltemi.controllers.tuning import LoopTuning, tune_loops
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.studies.preview import LidarErrors

ADDED, WHOLE_LEAD = "ipc as it is, with flaps", "cpfc, whole lead"
NARROW = 0.5
"""Damping ratio of narrow band-pass filters: that of 1P passes 2P with a gain of 0.55."""
Tunings = Mapping[tuple[Target, ...], tuple[LoopTuning, ...]]


def _loops(tunings: Tunings, scheme: str) -> tuple[HarmonicLoop, ...]:
    return tuple(tuning.loop for tuning in tunings[SCHEMES[scheme].loops])


def added(tunings: Tunings) -> tuple[HarmonicLoop, ...]:
    """The paper's loops: flaps added to an unchanged IPC."""
    return _loops(tunings, "ipc") + _loops(tunings, "flaps")


def designs(model: BladedModel, linear: Sequence[LinearModel], tunings: Tunings) -> dict[str, tuple[HarmonicLoop, ...]]:
    """Loops of 1P pitch and 2P flaps that deviate from the tuning rule.

    "Whole lead" has a proportional part that compensates the full delay of the band-pass, "narrow" narrow band-passes.
    """

    of = partial(_loops, tunings)

    def led(loops: Iterable[HarmonicLoop]) -> tuple[HarmonicLoop, ...]:
        nP = linear[0].point.rotor_speed
        return tuple(
            loop.replace(proportional_gain=loop.integral_gain / (loop.filter_damping * loop.harmonic * nP))
            for loop in loops
        )

    def narrow(scheme: str) -> tuple[HarmonicLoop, ...]:
        narrow_tuning = tune_loops(model, SCHEMES[scheme].loops, linear=linear, filter_damping=NARROW)
        return tuple(tuning.loop for tuning in narrow_tuning)

    not_detuned = added(tunings)
    return {
        ADDED: not_detuned,
        WHOLE_LEAD: led(of("cpfc")),
        f"{ADDED}, whole lead": led(not_detuned),
        "ipc, narrow": narrow("ipc"),
        "cpfc, narrow": narrow("cpfc"),
    }


SLOW, DECAY, LOST = 0.25, 10.0, 0.3
LIDARS: Mapping[str, LidarErrors] = {
    "30 % lost": LidarErrors(lost=LOST),
    "evolving turbulence": LidarErrors(decay=DECAY),
    "4 beams": LidarErrors(beams=4),
    "4 beams, 0.25 rad/s": LidarErrors(SLOW, beams=4),
    "all errors, 0.25 rad/s": LidarErrors(SLOW, 4, DECAY, LOST),
}
"""Errors of the measurement, by name. Their sizes are assumed."""
