"""``tune_platform_feedback``: pitch of a floater's blades against the motion of its tower top.

The speed loop responds to the wind relative to the rotor, so the thrust decreases while the platform moves upwind.
The rule: the pitch from the velocity of the tower top is what the steady pitch has from the wind speed,

    k_m = d theta / d V,     theta(V) steady, from 1.1 times rated wind to cut-out, by least squares          (C-9h)

with which a slow motion has the pitch of the wind alone; or three, two, one fourth of it, until in the linear model
under the law the platform's motion in pitch has no less damping at any of these wind speeds than without. A band-pass
about the platform's natural frequency in pitch filters the motion of the tower top.

Reference: docs/theory/control.md (C-9g, C-9h).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.linear import LinearModel, linearise
from meltemi.analyses.modes import natural_modes
from meltemi.control.baseline import MOTION_BAND
from meltemi.core.errors import InputError
from meltemi.core.shown import Brief
from meltemi.simulation.model import Model
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.rotors import operating_point
from meltemi.tuning.baseline_tuning import ABOVE_RATED, MARGIN_POINTS, rated_wind
from meltemi.tuning.speed_loop import of_small_changes
from meltemi.turbine.definition import BaselineControl

Float = NDArray[np.float64]
PITCH = "base pitch"
SLOPE_FRACTIONS = 1.0, 0.75, 0.5, 0.25
"""Fractions of the slope of the steady pitch that are tried."""
EIGENVALUES, LEVER = 8, 100.0
"""Eigenvalues next to the platform's frequency among which its motion in pitch is sought, and a length [m] by which
rotations are compared with displacements."""


@dataclass(frozen=True, repr=False)
class PlatformFeedback(Brief):
    """Feedback of a platform's motion and what it does.

    Attributes:
      control: control of the turbine with the feedback.
      gain: [rad s/m] gain from the velocity of the tower top to pitch.
      frequency: [rad/s] centre of the band-pass of the motion.
      wind_speed: (n,) [m/s] wind speeds of the operating points.
      damping, damping_without: (n,) damping ratio of the platform's motion in pitch, under the law with and without it.
    """

    control: BaselineControl
    gain: float
    frequency: float
    wind_speed: Float
    damping: Float
    damping_without: Float


def tune_platform_feedback(model: Model[Any]) -> PlatformFeedback:
    """Tune the feedback of the tower top's motion to the pitch of the baseline law.

    Raises:
      InputError: the turbine does not float, no natural mode is its platform's pitch, or no gain adds damping to it at
        all wind speeds.
    """
    turbine = model.turbine
    if getattr(turbine, "platform", None) is None:
        raise InputError(f"tune_platform_feedback: {turbine.name} does not float: it has no platform")
    speeds = np.linspace(ABOVE_RATED * rated_wind(model), turbine.cut_out, MARGIN_POINTS)
    points = [operating_point(model, float(u)) for u in speeds]
    slope = float(np.polyfit(speeds, [point.pitch for point in points], 1)[0])
    swings = [mode.frequency for mode in natural_modes(model) if mode.name == PITCH]
    if not swings:
        raise InputError(f"tune_platform_feedback: no natural mode of {turbine.name} is its platform's pitch")
    frequency = swings[0]
    law, outputs = turbine.control, ("generator_speed", "tower_top_acceleration_x")
    linear = [linearise(model, point, inputs=("generator_torque", "pitch"), outputs=outputs) for point in points]

    def damping(share: float) -> tuple[BaselineControl, Float]:
        gains = {"pitch.motion_gain": share * slope, "pitch.motion_frequency": frequency}
        control = law.replace(**gains)
        return control, np.array([pitch_damping(each, control, frequency) for each in linear])

    _, without = damping(0.0)
    for share in SLOPE_FRACTIONS:
        control, damped = damping(share)
        if np.all(damped >= without):
            return PlatformFeedback(control, share * slope, frequency, speeds, damped, without)
    raise InputError(
        f"tune_platform_feedback: no gain adds damping to the platform of {turbine.name} at all wind speeds above "
        "rated: slow its speed loop first (tune_baseline with a lower frequency)"
    )


def pitch_damping(linear: LinearModel, law: BaselineControl, frequency: float) -> float:
    """Damping ratio of the platform's motion in pitch near a frequency [rad/s], under a law."""
    from scipy.linalg import lu_factor, lu_solve
    from scipy.sparse.linalg import LinearOperator, eigs

    A = under(linear, law)
    shift = 1j * frequency
    factors = lu_factor(A - shift * np.eye(len(A)))
    inverse = LinearOperator(A.shape, matvec=lambda x: lu_solve(factors, x), dtype=np.complex128)
    start = np.ones(len(A), dtype=np.complex128)
    values, vectors = eigs(inverse, k=EIGENVALUES, v0=start)
    base = [i for i, name in enumerate(linear.states) if name.startswith("q base")]
    lever = np.array([1.0 if linear.state_units[i] == "m" else LEVER for i in base])[:, None]
    motions = np.abs(vectors[base]) * lever
    share = motions[base.index(linear.states.index(f"q {PITCH}"))] / motions.sum(axis=0)
    pole = shift + 1.0 / values[int(np.argmax(share))]
    return float(-pole.real / abs(pole))


def under(linear: LinearModel, law: BaselineControl) -> Float:
    """(n + 4, n + 4) matrix of a linear model under the law: its states, and those of :func:`law_matrices`.

    Inputs of the linear model are torque and pitch demand, outputs generator speed and acceleration of the tower top.
    """
    states, sensed, demand = law_matrices(law, linear.point)
    return np.block([[linear.A, linear.B @ demand], [sensed @ linear.C, states + sensed @ linear.D @ demand]])


def law_matrices(law: BaselineControl, point: OperatingPoint) -> tuple[Float, Float, Float]:
    """Matrices dx/dt = (4, 4) x + (4, 2) y, u = (2, 4) x of the law, for small changes about an operating point.

    States are the filtered generator speed, its integral, the velocity of the tower top, and that without what is
    fast; y generator speed and acceleration of the tower top, u torque and pitch demand.
    """
    p, filtered, w = law.pitch, law.filter_frequency, law.pitch.motion_frequency
    slope, divisor = of_small_changes(law, point)
    states, sensed, demand = np.zeros((4, 4)), np.zeros((4, 2)), np.zeros((2, 4))
    states[0, 0], states[1, 0] = -filtered, 1.0
    states[2, 2], states[3, 2], states[3, 3] = -w / MOTION_BAND, w * MOTION_BAND, -w * MOTION_BAND
    sensed[0, 0], sensed[2, 1] = filtered, 1.0
    demand[0, 0] = slope
    motion = p.motion_gain if np.isfinite(divisor) else 0.0  # limited to the distance from the minimum
    demand[1] = p.proportional_gain / divisor, p.integral_gain / divisor, 0.0, motion
    return states, sensed, demand
