"""An elastic line between two ends, in static equilibrium, with part of it on the sea bed.

Reference: docs/theory/floating.md (W-12, W-13); Jonkman (2007), NREL/TP-500-41958, chapter 2.5.
"""

from __future__ import annotations

from math import log, sqrt, tanh
from typing import NamedTuple

from meltemi.compiler import kernel


class Ends(NamedTuple):
    """Span of a line, its derivatives by the fairlead's forces, and the tension at the anchor.

    Attributes:
      x, z: [m] horizontal and vertical span.
      xh, xv, zh, zv: [m/N] their derivatives by horizontal and vertical force.
      anchor_h, anchor_v: [N] horizontal and vertical force at the anchor.
    """

    x: float
    z: float
    xh: float
    xv: float
    zh: float
    zv: float
    anchor_h: float
    anchor_v: float


@kernel
def asinh(x: float) -> float:
    """Inverse hyperbolic sine, as that of ``math`` and in dual numbers."""
    s = log(abs(x) + sqrt(1.0 + x * x))
    return s if x >= 0.0 else -s


@kernel
def span(H: float, V: float, L: float, w: float, EA: float, friction: float, on_bed: float) -> Ends:
    """Span of a line with forces H, V [N] on its upper end (W-12, W-13).

    Args:
      L: [m] unstretched length; w: [N/m] weight in water; EA: [N]; friction: of the sea bed [-].
      on_bed: 1 if the anchor lies on the sea bed, else 0.
    """
    a = V / H
    sa = sqrt(1.0 + a * a)
    if on_bed > 0.0 and w * L > V:
        lying = L - V / w
        x = lying + H / w * asinh(a) + H * L / EA
        z = H / w * (a * a / (1.0 + sa)) + 0.5 * V * V / (EA * w)
        xh, xv = (asinh(a) - a / sa) / w + L / EA, (1.0 / sa - 1.0) / w
        zh, zv = (sa - 1.0 - a * a / sa) / w, a / sa / w + V / (EA * w)
        anchor = H
        if friction > 0.0:
            drag = friction * w
            free = max(lying - H / drag, 0.0)
            x += 0.5 * drag / EA * (free * free - lying * lying)
            xh -= free / EA
            xv += drag / (EA * w) * (lying - free)
            anchor = max(H - drag * lying, 0.0)
        return Ends(x, z, xh, xv, zh, zv, anchor, 0.0 * V)
    b = (V - w * L) / H
    sb = sqrt(1.0 + b * b)
    x = H / w * (asinh(a) - asinh(b)) + H * L / EA
    z = H / w * (sa - sb) + (V * L - 0.5 * w * L * L) / EA
    xh = (asinh(a) - asinh(b) - a / sa + b / sb) / w + L / EA
    xv = (1.0 / sa - 1.0 / sb) / w
    zh, zv = (sa - sb - a * a / sa + b * b / sb) / w, (a / sa - b / sb) / w + L / EA
    return Ends(x, z, xh, xv, zh, zv, H, V - w * L)


@kernel
def guess(x: float, z: float, L: float, w: float) -> tuple[float, float]:
    """First forces H, V [N] of the search (Jonkman 2007, eq. 2-49 to 2-51)."""
    slack = (L * L - z * z) / (x * x + 1e-12) - 1.0
    flat = sqrt(3.0 * slack) if slack > 0.0133 else 0.2 + 0.0 * slack
    return 0.5 * w * x / flat + 1e-3 * w * L, 0.5 * w * (z / tanh(flat) + L)


@kernel
def improved(e: Ends, dx: float, dz: float, H: float, V: float) -> tuple[float, float]:
    """A step of Newton's method from the forces H, V [N] of a span that is ``dx``, ``dz`` [m] too short."""
    det = e.xh * e.zv - e.xv * e.zh
    dh, dv = (dx * e.zv - dz * e.xv) / det, (dz * e.xh - dx * e.zh) / det
    share = 1.0
    while share > 1e-6 and H + share * dh < 0.1 * H:
        share *= 0.5
    return H + share * dh, V + share * dv
