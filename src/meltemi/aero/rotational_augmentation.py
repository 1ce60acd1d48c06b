"""Polars of rotating blades from those of the section in two-dimensional flow (host side).

On a rotating blade the separated air moves outwards and is turned towards the trailing edge, so that the flow separates
later: lift in stall comes closer to that of potential flow, the more so the larger the chord over the radius.

Reference: docs/theory/aerodynamics.md (A-50 to A-52); Snel, Houwink & Bosschers (1994), ECN-C--93-052; Chaviaropoulos &
Hansen (2000), J. Fluids Eng. 122, 330-336.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.stall_tables import zero_lift_angle
from meltemi.aero.variants import RotationalAugmentation

Float = NDArray[np.float64]

FADE_BEGIN, FADE_END = np.radians(30.0), np.radians(50.0)
"""[rad] angles of attack between which the increments fade out: in deep stall nothing comes near potential flow."""


def snel(chord_ratio: float, twist: float) -> tuple[float, float]:
    """Factors of the increments of lift and of drag and moment after Snel, Houwink and Bosschers: lift only.

    Args:
      chord_ratio: chord over distance from the shaft.
      twist: [rad] twist of the section, unused.
    """
    return 3.0 * chord_ratio**2, 0.0


def chaviaropoulos_hansen(chord_ratio: float, twist: float) -> tuple[float, float]:
    """Factors after Chaviaropoulos and Hansen, for all three coefficients."""
    factor = 2.2 * chord_ratio * np.cos(twist) ** 4
    return factor, factor


FACTORS: dict[str, Callable[[float, float], tuple[float, float]]] = {
    "snel": snel,
    "chaviaropoulos_hansen": chaviaropoulos_hansen,
}


def augmented(
    alpha: Float, coefficients: Float, chord_ratio: float, twist: float, model: RotationalAugmentation
) -> Float:
    """Coefficients of a section on a rotating blade (A-50 to A-52).

    Args:
      alpha: (P,) [rad] angles of attack.
      coefficients: (P, 3) lift, drag and moment in two-dimensional flow.
      chord_ratio: chord over distance from the shaft.
      twist: [rad] twist of the section from the rotor plane, at zero pitch.
      model: name of the model.

    Returns:
      (P, 3) the coefficients.
    """
    if model == "none":
        return coefficients
    lift, drag, moment = coefficients.T
    share_lift, share_drag = np.minimum(FACTORS[model](chord_ratio, twist), 1.0)
    zero = zero_lift_angle(alpha, lift)
    potential = 2.0 * np.pi * np.sin(alpha - zero)
    # steeper measured slopes in attached flow stay as they are
    missing = np.where((potential - lift) * np.sin(alpha - zero) > 0.0, potential - lift, 0.0)
    attached = np.abs(alpha) < FADE_BEGIN
    floor, level = np.min(drag[attached]), np.interp(zero, alpha, moment)
    beyond = np.clip((np.abs(alpha) - FADE_BEGIN) / (FADE_END - FADE_BEGIN), 0.0, 1.0)
    weight = 0.5 + 0.5 * np.cos(np.pi * beyond)
    increments = (share_lift * missing, share_drag * (drag - floor), share_drag * (moment - level))
    result: Float = coefficients + weight[:, None] * np.stack(increments, axis=1)
    return result
