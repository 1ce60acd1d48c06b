"""Utilisation of tubular members by NORSOK N-004 (6.3) or ISO 19902:2007 (13.2 to 13.4) (F-66 to F-69).

Loads are design loads, with their partial safety factors. docs/theory/frames.md says which formulas were checked, and
which are from memory.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import pi, sqrt
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.frames.definition import Section
from meltemi.frames.sections import properties

Float = NDArray[np.float64]
Standard = Literal["NORSOK N-004", "ISO 19902"]

CLAUSES: Mapping[Standard, tuple[str, ...]] = {
    "NORSOK N-004": (
        *("6.3.8.1, 6.3.9.1 tension and bending", "6.3.8.2, 6.3.9.2 column buckling and bending"),
        *("6.3.8.2, 6.3.9.2 compression and bending", "6.3.5 shear and torsion", "6.3.8.3 bending and shear"),
        *("6.3.6 hoop buckling", "6.3.9 local buckling"),
    ),
    "ISO 19902": (
        *("13.3.2, 13.4.2 tension and bending", "13.3.3, 13.4.3 column buckling and bending"),
        *("13.3.3, 13.4.3 compression and bending", "13.2.5 shear and torsion", "13.2.5 with bending, NORSOK's form"),
        *("13.2.6 hoop buckling", "13.4.3 local buckling"),
    ),
}
"""Checks in the order of the results."""
ISO = {"tension": 1.05, "compression": 1.18, "bending": 1.05, "shear": 1.05, "hoop": 1.25}
"""Partial resistance factors of ISO 19902."""
SLENDER = 0.170
"""Yield stress over elastic local buckling stress above which walls are slender."""


class Strengths(NamedTuple):
    """Characteristic strengths [N/m^2] of a tube: local, column, bending, hoop; elastic local, column and hoop ones.

    ``slenderness`` is that of the column (lambda).
    """

    local: float
    column: float
    bending: float
    hoop: float
    elastic_local: float
    euler: float
    elastic_hoop: float
    slenderness: float


class Checks(NamedTuple):
    """Utilisations (7, T) in the order of ``CLAUSES``, and what they were computed with by name."""

    ratios: Float
    factors: dict[str, float]


def strengths(section: Section, length: float, yield_stress: float, k: float = 1.0, iso: bool = False) -> Strengths:
    """Characteristic strengths of a tube (F-66, F-67).

    Args:
      length: [m] of the column, and between its rings.
      yield_stress: [N/m^2].
      k: effective length factor.

    Raises:
      InputError: the section is no tube with a wall, or the yield stress is none of steel in N/m^2.
    """
    D, t = section.diameter, section.thickness
    if section.kind != "tube" or D is None or t is None:
        raise InputError("utilisation: the standards are for tubes with a wall; give diameter and thickness")
    if not 1e8 <= yield_stress <= 1.5e9:
        raise InputError(f"utilisation: yield_stress {yield_stress:g} N/m^2: expected 1e8 to 1.5e9; is it in MPa?")
    E, fy, p = section.elastic_modulus, yield_stress, properties(section, section, 0.0)
    fcle = 0.6 * E * t / D
    ratio = fy / fcle
    fcl = fy if ratio <= SLENDER else (1.047 - 0.274 * ratio) * fy if ratio <= 1.911 else fcle
    fE = (pi / (k * length)) ** 2 * E * p.inertia_x / p.area
    lam = sqrt(fcl / fE)
    fc = fcl * (1.0 - (0.278 if iso else 0.28) * lam**2 if lam <= 1.34 else 0.9 / lam**2)
    x = fy * D / (E * t)
    shape = (D**3 - (D - 2.0 * t) ** 3) / 6.0 / (p.inertia_x / (0.5 * D))
    fm = shape * fy * (1.0 if x <= 0.0517 else 1.13 - 2.58 * x if x <= 0.1034 else 0.94 - 0.76 * x)
    mu, slim = length / D * sqrt(2.0 * D / t), D / t
    if mu >= 0.825 * slim:
        Ch = 0.44 / slim + (0.21 * slim**3 / mu**4 if mu < 1.6 * slim else 0.0)
    else:
        Ch = 0.737 / (mu - 0.579) if mu >= 1.5 else 0.80
    fhe = 2.0 * Ch * E * t / D
    fh = fy if fhe > 2.44 * fy else 0.7 * fy * (fhe / fy) ** 0.4 if fhe > 0.55 * fy else fhe
    return Strengths(fcl, fc, fm, fh, fcle, fE, fhe, lam)


def member_checks(  # noqa: PLR0913 - the factors of the standards by name
    loads: Float,
    section: Section,
    length: float,
    *,
    yield_stress: float = 355e6,
    standard: Standard = "NORSOK N-004",
    k: float = 1.0,
    C_m: float = 0.85,
    pressure: float = 0.0,
    end_caps: bool = True,
) -> Checks:
    """Utilisations of a section of a tubular member at each instant (F-68, F-69).

    Args:
      loads: (T, 6) section loads [N, N m] in member axes, with their partial safety factors.
      section, length, yield_stress, k: see :func:`strengths`.
      standard: whose clauses are checked.
      C_m: factor of the moments in column buckling.
      pressure: [N/m^2] of the water outside over that inside; 0 for a flooded member.
      end_caps: whether axial loads contain the pressure on the ends (wall force), or not (effective tension).

    Raises:
      InputError: see :func:`strengths`.
    """
    iso = standard == "ISO 19902"
    s, p = strengths(section, length, yield_stress, k, iso), properties(section, section, 0.0)
    fy, D, t = yield_stress, float(section.diameter or 0.0), float(section.thickness or 0.0)
    sp = pressure * D / (2.0 * t)
    sq = 0.5 * sp
    net = loads[:, 2] / p.area - (0.0 if end_caps else sq)  # tension positive, with the pressure on the ends
    outer = 0.5 * D / p.inertia_x
    sm = np.hypot(loads[:, 3], loads[:, 4]) * outer
    pressed = np.maximum(-net - sq, 0.0)  # axial compression without the pressure on the ends
    factor = material_factor(s, fy, np.maximum(sm - net, 0.0), sp)
    gt, gc, gb, gv, gh = (np.asarray(ISO[name] if iso else factor) for name in ISO)
    B = np.minimum(gh * sp / s.hoop, 1.0)
    eta = 5.0 - 4.0 * s.hoop / fy
    left = np.sqrt(np.maximum(1.0 + 0.09 * B**2 - B ** (2.0 * eta), 0.0)) - 0.3 * B
    left = np.maximum(left, 1e-6)
    bent = gb * sm / (s.bending * left)
    axial = gt * np.maximum(net, 0.0) / (fy * left)
    if not iso and pressure == 0.0:
        axial = axial**1.75
    amplified = C_m / np.maximum(1.0 - pressed / s.euler, 1e-6)
    fch = column_strength(s, sq, iso)
    shear = gv * sqrt(3.0) / fy * np.hypot(loads[:, 0], loads[:, 1]) * 2.0 / p.area
    local, half = sm - net - 0.5 * s.elastic_hoop / gh, s.elastic_local / gc - 0.5 * s.elastic_hoop / gh
    buckled = np.where(
        (local > 0.0) & (half > 0.0), local / np.where(half > 0.0, half, 1.0) + (gh * sp / s.elastic_hoop) ** 2, 0.0
    )
    ratios = [
        np.where(net >= 0.0, axial + bent, 0.0),
        np.where(pressed > 0.0, gc * pressed / fch + amplified * bent, 0.0),
        np.where(net < 0.0, gc * np.maximum(-net, 0.0) / s.local + bent, 0.0),
        shear + gv * sqrt(3.0) / fy * np.abs(loads[:, 5]) * 0.5 * D / p.torsion,
        np.where(shear >= 0.4, (bent + shear) / 1.4, 0.0),
        gh * sp / s.hoop * np.ones(len(loads)),
        buckled if pressure > 0.0 else np.zeros(len(loads)),
    ]
    given = {"k": k, "C_m": C_m, "f_y": fy, "lambda": s.slenderness, "f_cl": s.local, "f_c": s.column, "f_m": s.bending}
    given |= {"f_h": s.hoop, "gamma_M": float(np.max(gc)), "sigma_p": sp}
    return Checks(np.array(ratios), given)


def material_factor(s: Strengths, fy: float, compression: Float, hoop: float) -> Float:
    """NORSOK's gamma_M (T,) at a compression (T,) and a hoop stress [N/m^2] (6.3.7; F-68)."""
    if fy / s.elastic_local <= SLENDER and hoop == 0.0:
        return np.full(len(compression), 1.15)
    squares = (compression / s.local) ** 2 * fy / s.elastic_local + (hoop / s.hoop) ** 2 * fy / s.elastic_hoop
    return np.asarray(np.clip(0.85 + 0.60 * np.sqrt(squares), 1.15, 1.45))


def column_strength(s: Strengths, end: float, iso: bool = False) -> float:
    """Strength [N/m^2] of a column beside the stress of pressure on its ends [N/m^2] (6.3.9.2, 13.4.3; F-69)."""
    q, lam = 2.0 * end / s.local, s.slenderness
    if q >= 1.0 or lam >= 1.34 / sqrt(1.0 - q):
        return 0.9 / lam**2 * s.local
    xi = 1.0 - (0.278 if iso else 0.28) * lam**2
    return 0.5 * s.local * (xi - q + sqrt(xi**2 + 0.56 * lam**2 * q))
