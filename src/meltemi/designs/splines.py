"""Natural cubic splines through the control points of a variable.

Reference: docs/theory/designs.md (D-2).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Float = NDArray[np.float64]


def spline_rows(span: Float, knots: int) -> Float:
    """(knots, S) values at ``span`` (0 to 1) of the natural cubic splines that are one at a knot (D-2)."""
    if knots == 2:
        return np.array([1.0 - span, span])
    spline = CubicSpline(np.linspace(0.0, 1.0, knots), np.eye(knots), bc_type="natural")
    return np.asarray(spline(span)).T
