"""Section coefficients in deep stall, where polars are extrapolated (host side).

A blade at rest with the wind across it acts on the flow like a plate: the force is normal to the chord, but for
friction. Extrapolations that match lift and drag at stall, such as Viterna's, leave a suction along the chord that
fades with the cosine squared; measured sections do not have it.

Reference: docs/theory/aerodynamics.md (A-42a, A-42b); Hoerner (1965), Fluid-Dynamic Drag; Sheldahl & Klimas (1981),
SAND80-2114.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

BEGIN, END = np.radians(30.0), np.radians(45.0)
"""[rad] angles of attack over which the polar gives way to the plate, from the front and from behind."""


def plate_polar(alpha: Float, lift: Float, drag: Float) -> tuple[Float, Float]:
    """Lift and drag of a polar with those of a plate in deep stall.

    The plate has the polar's drag at a right angle, which contains the aspect ratio, and its smallest drag as friction.

    Args:
      alpha: (P,) [rad] over the full circle; lift, drag: (P,).

    Returns:
      lift, drag: (P,).
    """
    s, c = np.sin(alpha), np.cos(alpha)
    across = np.where(s > 0.0, np.interp(0.5 * np.pi, alpha, drag), np.interp(-0.5 * np.pi, alpha, drag))
    normal = across * s * 0.505 / (0.222 * np.abs(s) + 0.283)
    chordwise = -float(np.min(drag)) * c
    x = np.clip((np.arcsin(np.abs(s)) - BEGIN) / (END - BEGIN), 0.0, 1.0)
    weight = x * x * (3.0 - 2.0 * x)
    plate = normal * c + chordwise * s, normal * s - chordwise * c
    return lift + weight * (plate[0] - lift), drag + weight * (plate[1] - drag)


def edgewise_damping(alpha: Float, lift: Float, drag: Float) -> Float:
    """(P,) aerodynamic damping of motion along the chord over rho U c / 2, by static coefficients (A-42b)."""
    chordwise = lift * np.sin(alpha) - drag * np.cos(alpha)
    return np.asarray(np.sin(alpha) * np.gradient(chordwise, alpha) - 2.0 * np.cos(alpha) * chordwise)
