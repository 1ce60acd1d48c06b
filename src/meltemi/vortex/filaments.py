"""Velocity that straight vortex filaments induce, each with a core (VW-1 to VW-4).

A filament of circulation G (right hand about its direction, from x_1 to x_2) induces at x, with r_1 = x - x_1 and
r_2 = x - x_2,

    u = F G / (4 pi) (|r_1| + |r_2|) c / (|r_1| |r_2| (|r_1| |r_2| + r_1 . r_2)),    c = (x_2 - x_1) x r_1

which has no singularity off the filament (van Garrel 2003, eq. 4.2). The core makes it vanish on it: with the distance
h = |c| / l from the line and the core radius r_c, F is

    Vatistas (n = 2)   h^2 / sqrt(h^4 + r_c^4)          Rankine       min(1, h^2 / r_c^2)
    Lamb and Oseen     1 - exp(-1.25643 h^2 / r_c^2)    offset        1, with r_c^2 l^2 added to the denominator

Sources are columns of an array: their sum is one loop without branches, which fills the processor's vectors.

References: Vatistas, Kozel & Mih (1991); Leishman (2006), sec. 10.6; van Garrel (2003), ECN-C--03-079.
"""

from __future__ import annotations

from math import exp, pi, sqrt
from typing import Any

from meltemi.compiler import kernel, summing
from meltemi.maths.vectors import Vec, cross, dot

CORES = ("vatistas", "lamb_oseen", "rankine", "offset", "none")
VATISTAS, LAMB_OSEEN, RANKINE, OFFSET, NONE = range(5)
LAMB = 1.25643
"""Constant of a Lamb-Oseen vortex whose velocity is largest at the core radius."""
ROWS = 9
"""Rows of an array of filaments: begin, difference of the ends, G / (4 pi), terms of the core."""
TINY = 1e-30
ROUNDING, ROUNDING_32 = 1e-16, 3e-8
"""Term of the denominator over the fourth power of the length, in double and single precision: it exceeds the rounding
errors of the denominator between the ends of a filament, where that vanishes."""


@summing
def induced(p: Any, s: Any, first: int, last: int, core: int) -> tuple[float, float, float]:
    """Velocity [m/s] at a point that filaments induce.

    Args:
      p: (3,) [m] point, in the precision of ``s``.
      s: (9, S) filaments, as :func:`store` writes them.
      first, last: those that count, without the last.
      core: number of the core, in ``CORES``.
    """
    x, y, z = p[0], p[1], p[2]
    u = v = w = x - x
    if core in (LAMB_OSEEN, RANKINE):
        for j in range(first, last):
            lx, ly, lz = s[3, j], s[4, j], s[5, j]
            ax, ay, az = x - s[0, j], y - s[1, j], z - s[2, j]
            bx, by, bz = ax - lx, ay - ly, az - lz
            ra, rb = sqrt(ax * ax + ay * ay + az * az), sqrt(bx * bx + by * by + bz * bz)
            cx, cy, cz = ly * az - lz * ay, lz * ax - lx * az, lx * ay - ly * ax
            q = (cx * cx + cy * cy + cz * cz) / s[7, j]
            f = s[6, j] * (ra + rb) * (min(q, 1.0) if core == RANKINE else 1.0 - exp(-LAMB * q))
            f /= ra * rb * (ra * rb + ax * bx + ay * by + az * bz) + s[8, j]
            u += f * cx
            v += f * cy
            w += f * cz
        return u, v, w
    for j in range(first, last):
        lx, ly, lz = s[3, j], s[4, j], s[5, j]
        ax, ay, az = x - s[0, j], y - s[1, j], z - s[2, j]
        bx, by, bz = ax - lx, ay - ly, az - lz
        ra, rb = sqrt(ax * ax + ay * ay + az * az), sqrt(bx * bx + by * by + bz * bz)
        cx, cy, cz = ly * az - lz * ay, lz * ax - lx * az, lx * ay - ly * ax
        cc, p_ab = cx * cx + cy * cy + cz * cz, ra * rb
        f = s[6, j] * (ra + rb) * cc
        f /= (p_ab * (p_ab + ax * bx + ay * by + az * bz) + s[8, j]) * sqrt(cc * cc + s[7, j])
        u += f * cx
        v += f * cy
        w += f * cz
    return u, v, w


@kernel
def core_terms(length2: float, core2: float, core: int) -> tuple[float, float]:
    """Terms of the core of a filament in :func:`induced`, by the squares [m^2] of its length and its core radius."""
    k = core2 * length2
    if core == VATISTAS:
        return k * k + TINY, TINY
    if core == OFFSET:
        return TINY, k + TINY
    return (k + TINY if core != NONE else TINY), TINY


@kernel
def store(s: Any, j: int, begin: Vec, end: Vec, circulation: float, core2: float, core: int) -> None:
    """Write a filament into column ``j`` of ``s``, with the square [m^2] of its core radius."""
    along = end - begin
    s[0, j], s[1, j], s[2, j] = begin.x, begin.y, begin.z
    s[3, j], s[4, j], s[5, j] = along.x, along.y, along.z
    s[6, j] = circulation / (4.0 * pi)
    s[7, j], s[8, j] = core_terms(dot(along, along), core2, core)
    s[8, j] += (ROUNDING_32 if s.itemsize == 4 else ROUNDING) * dot(along, along) * dot(along, along)


@kernel
def filament(p: Vec, begin: Vec, end: Vec, core2: float, core: int) -> Vec:
    """Velocity [m/s] at ``p`` by a filament of unit circulation, as in :func:`induced`."""
    along, a, b = end - begin, p - begin, p - end
    k, offset = core_terms(dot(along, along), core2, core)
    ra, rb, c = sqrt(dot(a, a)), sqrt(dot(b, b)), cross(along, a)
    cc, p_ab = dot(c, c), ra * rb
    if core == RANKINE:
        share = min(cc / k, 1.0)
    elif core == LAMB_OSEEN:
        share = 1.0 - exp(-LAMB * cc / k)
    else:
        share = cc / sqrt(cc * cc + k)
    return (share * (ra + rb) / (4.0 * pi * (p_ab * (p_ab + dot(a, b)) + offset))) * c
