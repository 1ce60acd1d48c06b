"""Check by their waves whether potential-flow coefficients are about the platform's point and without its weight.

Reference: docs/theory/floating.md (W-45, W-46).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.floating.platform import Platform
from meltemi.floating.potential import HydroCoefficients
from meltemi.sea.airy import GRAVITY, wave_number

Float = NDArray[np.float64]

KNOWN = 0.1
"""Deviation of the volume by long waves from the platform's above which they do not determine the stiffness."""
HEAVY = 0.2
"""Ratio of the stiffness by the weight to that by long waves below which they do not determine it."""
SHORT = 0.2
"""[1/m] wave number of the longest of the short waves; they reach 1 / SHORT below still water."""
ENOUGH = 3
"""Number of short waves that determine the height of their force."""


def check_coefficients(c: HydroCoefficients, platform: Platform, where: str) -> None:
    """Check that the motions turn about still water and that the hydrostatic stiffness is that of the water alone.

    Coefficients whose waves do not tell it pass.

    Args:
      c: coefficients of potential flow alone.
      where: beginning of messages.

    Raises:
      InputError: they turn about another point, or have the weight.
    """
    k = wave_number(c.frequency, platform.depth, GRAVITY)
    height = force_height(c, k)
    if height is not None and height > 1.0 / SHORT:
        raise InputError(
            f"{where}: short waves act {height:.3g} m above the point of the moments, which is thus below still water: "
            "expected the point on the tower's axis at still water; compute the coefficients about it (Capytaine: "
            "rigid_body_dofs(rotation_center=(0, 0, 0)), or give its dataset .nc, which says its point)"
        )
    volume, stiffness, known = long_wave_stiffness(c, k[0])
    weight = -platform.mass / platform.water_density * platform.centre[2]
    if abs(volume / platform.volume - 1.0) > KNOWN or abs(weight) < HEAVY * abs(stiffness):
        return
    if (known - stiffness) / weight > 0.5:
        raise InputError(
            f"{where}: stiffness in roll or pitch is {known:.4g} m^4 (over density and gravity); that of the water is "
            f"{stiffness:.4g} by the excitation of long waves, and the platform's weight adds {weight:.4g}: give the "
            f"water "
            "alone in .hst (WAMIT: VCG 0; Capytaine: its dataset .nc, or center_of_mass (0, 0, 0))"
        )


def force_height(c: HydroCoefficients, k: Float) -> float | None:
    """Height [m] of the horizontal force of short waves above the point of the moments (W-46); None without them."""
    short = k > SHORT
    if short.sum() < ENOUGH:
        return None
    force, moment = _along_waves(c.heading, c.excitation[short])
    power = float((np.abs(force) ** 2).sum())
    return float((moment * force.conj()).real.sum()) / power if power > 0.0 else None


def long_wave_stiffness(c: HydroCoefficients, k: float) -> tuple[float, float, float]:
    """Volume [m^3], and stiffness [m^4] of the water in tilt, by the longest waves (W-45); and that given.

    Args:
      k: [1/m] wave number of the lowest frequency.
    """
    force, moment = (each / (1j * k) for each in _along_waves(c.heading, c.excitation[:1]))
    b = np.radians(c.heading)
    push = np.column_stack([np.cos(b), np.sin(b)])
    turn = np.column_stack([-np.sin(b), np.cos(b)])
    added = c.added_mass[0]
    volume = force[0].real - np.einsum("hi,ij,hj->h", push, added[:2, :2], push)
    stiffness = moment[0].real - np.einsum("hi,ij,hj->h", turn, added[3:5, :2], push)
    known = np.einsum("hi,ij,hj->h", turn, c.hydrostatic[3:5, 3:5], turn)
    return float(volume.mean()), float(stiffness.mean()), float(known.mean())


def _along_waves(heading: Float, X: NDArray[np.complex128]) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Force along the waves and moment about their crests of excitation (F, H, 6)."""
    b = np.radians(heading)
    return X[..., 0] * np.cos(b) + X[..., 1] * np.sin(b), X[..., 4] * np.cos(b) - X[..., 3] * np.sin(b)
