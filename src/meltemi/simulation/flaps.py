"""Increments of trailing-edge flaps, for models that have them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator, RectBivariateSpline

from meltemi.aero.flaps import ALPHAS, DELTAS, STEP
from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]

FLAP_FADE = np.radians(16.0)
"""[rad] beyond the angles of attack of a flap's data, over which its increments fade out."""


def increments(turbine: Turbine) -> Float:
    """(F, ALPHAS DELTAS, 3) increments on the grid of the kernels: bicubic between the data, faded out beyond stall."""
    result = np.zeros((len(turbine.blade.flaps), ALPHAS * DELTAS, 3))
    alpha = STEP * (np.arange(ALPHAS) - ALPHAS // 2)
    delta = STEP * (np.arange(DELTAS) - DELTAS // 2)
    for table, flap in zip(result, turbine.blade.flaps, strict=True):
        d = flap.increments
        inside, bent = np.clip(alpha, *d.angle_of_attack[[0, -1]]), np.clip(delta, *d.deflection[[0, -1]])
        fade = 0.5 + 0.5 * np.cos(np.pi * np.minimum(np.abs(alpha - inside) / FLAP_FADE, 1.0))
        lift = RectBivariateSpline(d.angle_of_attack, d.deflection, d.lift)(inside, bent)
        drag, moment = (PchipInterpolator(d.deflection, x)(bent) for x in (d.drag, d.moment))
        grid = np.stack([lift, np.broadcast_to(drag, lift.shape), np.broadcast_to(moment, lift.shape)], axis=-1)
        table[:] = (fade[:, None, None] * grid).reshape(-1, 3)
    return result
