"""The speed loop of the baseline law, opened at its sensor, in the linear model; its fastest gains with margins.

With the turbine's responses G of the generator speed to torque and pitch demand, the law's low-pass and, in region 3,
constant power or constant torque, the loop is (C-9d)

    L(s) = -(w_f / (s + w_f)) (G_M(s) dM/dw + G_theta(s) (K_P + K_I / s) / (1 + 2 theta / theta_h))

The law multiplies proportional and integral part by its schedule 1 / (1 + theta / theta_h), so the demand of a steady
state satisfies theta (1 + theta / theta_h) = K_I x, and small changes see the factor 1 / (1 + 2 theta / theta_h).

Reference: docs/theory/control.md (C-9d to C-9f).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.linear import linearise
from meltemi.control.baseline import parameters, steady_torque
from meltemi.simulation.model import Model
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.tuning.controller_bench.margins import GAIN_MARGIN, PHASE_MARGIN, OpenLoop
from meltemi.turbine.definition import BaselineControl

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

AT_MINIMUM = 1e-6
"""[rad] pitch above its minimum that counts as none."""
FREQUENCIES = np.geomspace(0.03, 10.0, 2000)
"""[rad/s] frequencies of the responses."""


def speed_responses(model: Model[Any], points: Sequence[OperatingPoint]) -> list[Complex]:
    """(F, 2) responses of the generator speed to torque and collective pitch demand, one array per operating point."""
    inputs, outputs = ("generator_torque", "pitch"), ("generator_speed",)
    s = 1j * FREQUENCIES
    return [linearise(model, point, inputs=inputs, outputs=outputs).response(s)[:, 0] for point in points]


def of_small_changes(law: BaselineControl, point: OperatingPoint) -> tuple[float, float]:
    """Slope of the torque over the generator speed [N m s/rad] and divisor of the pitch gains, for small changes about
    an operating point; below rated wind, where the pitch stays at its minimum, the divisor is infinite."""
    torque, pitch = law.torque, law.pitch
    if point.pitch <= pitch.minimum + AT_MINIMUM:
        parameter, h = parameters(law), 1e-6 * point.generator_speed
        low, high = (steady_torque(parameter, point.generator_speed + way * h, point.pitch) for way in (-1.0, 1.0))
        return float(high - low) / (2.0 * h), math.inf
    slope = -torque.rated_power / pitch.reference_speed**2 if torque.hold == "power" else 0.0
    return slope, 1.0 + 2.0 * point.pitch / pitch.gain_halving_pitch


def speed_loops(law: BaselineControl, points: Sequence[OperatingPoint], responses: Sequence[Complex]) -> list[OpenLoop]:
    """The loop with a law at each operating point."""
    s, pitch = 1j * FREQUENCIES, law.pitch
    low_pass = law.filter_frequency / (s + law.filter_frequency)
    gain = pitch.proportional_gain + pitch.integral_gain / s
    loops = []
    for point, response in zip(points, responses, strict=True):
        slope, divisor = of_small_changes(law, point)
        loop = -low_pass * (response[:, 0] * slope + response[:, 1] * (gain / divisor))
        loops.append(OpenLoop(point.wind.speed, FREQUENCIES, loop, 0.0))
    return loops


def keep_margins(loops: Sequence[OpenLoop]) -> bool:
    """Whether all loops have the phase and gain margin that ``bench-controller`` requires."""
    return all(loop.phase_margin >= PHASE_MARGIN and loop.gain_margin >= GAIN_MARGIN for loop in loops)
