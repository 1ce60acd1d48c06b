"""Effects of blade icing: ice mass along the span, and penalties on lift and drag.

Reference: docs/guide/icing.md (I-1 to I-4).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.turbine.definition import Blade, Turbine
from meltemi.turbine.ice import Icing as Icing

Float = NDArray[np.float64]

REACH = {"gl2010": 0.5, "iec": 1.0}
"""Share of the rotor radius at which the mass reaches its largest value, by law."""
IEC_DENSITY, IEC_PLACE = 0.125, 0.85
"""Density [kg/m^3] of the law of IEC, and share of the rotor radius at which it evaluates the chord."""
CONTOUR = (0.7, 0.95)
"""Shares of the rotor radius between which the contour is extrapolated to the tip, without the rounding of the tip."""
FULL, GONE = math.radians(20.0), math.radians(40.0)
"""Angles of attack (either sign) up to which penalties are full, and above which they are zero: in deep stall, and when
the flow comes from behind, the shape of the leading edge hardly matters."""


def with_ice(turbine: Turbine, icing: Icing | None) -> Turbine:
    """Replace the ice of a turbine; None removes it.

    Raises:
      InputError: the rotor has no such blade, or the turbine has no blades.
    """
    if "icing" not in type(turbine).model_fields:
        raise InputError(f"{turbine.name}: ice needs a turbine with blades, this one is only a power coefficient")
    if icing is not None:
        try:
            icing.on(turbine.n_blades)
        except ValueError as error:
            raise InputError(f"{turbine.name}: {error}") from None
    return turbine.model_copy(update={"icing": icing})


def law_mass(turbine: Turbine, icing: Icing) -> float:
    """mu_E [kg/m] of the ice mass formula (I-2), times ``amount``.

    GL: rho k c_t (c_max + c_t), k = 0.00675 + 0.3 exp(-0.32 R / 1 m), with the chord c_t of the extrapolated contour at
    the tip. IEC: 0.125 kg/m^3 c_85 R with the chord at 85 % of the radius.
    """
    if icing.mass is not None:
        return icing.amount * icing.mass
    aero, radius = turbine.blade.aerodynamics, turbine.rotor_radius
    if icing.law == "iec":
        chord_85 = float(np.interp(IEC_PLACE * radius - turbine.hub.radius, aero.position, aero.chord))
        return icing.amount * IEC_DENSITY * chord_85 * radius
    tip = icing.tip_chord
    if tip is None:
        r = np.linspace(CONTOUR[0], CONTOUR[1], 26) * radius
        chord = np.interp(r - turbine.hub.radius, aero.position, aero.chord)
        tip = max(float(np.polyval(np.polyfit(r, chord, 1), radius)), 0.0)
    k = 0.00675 + 0.3 * math.exp(-0.32 * radius)
    return icing.amount * icing.density * k * tip * (float(aero.chord.max()) + tip)


def ice_mass(turbine: Turbine, icing: Icing, position: Float) -> Float:
    """(n,) [kg/m] ice mass per length at distances [m] from the blade root (I-1)."""
    radius = turbine.hub.radius + np.asarray(position, dtype=float)
    result: Float = law_mass(turbine, icing) * np.minimum(radius / (REACH[icing.law] * turbine.rotor_radius), 1.0)
    return result


def ice_stations(turbine: Turbine) -> Float:
    """(n,) [m] distances from the blade root between which the ice mass is linear."""
    kink = min(REACH.values()) * turbine.rotor_radius - turbine.hub.radius
    blade = turbine.blade
    stations: Float = np.unique(np.concatenate([blade.aerodynamics.position, blade.structure.position, [kink]]))
    return stations[(stations >= 0.0) & (stations <= blade.length)]


def leading_edge(blade: Blade, position: Float) -> Float:
    """(n, 2) [m] leading edge from the pitch axis, x downwind and y towards the trailing edge at zero pitch (I-3).

    The aerodynamic centre is taken to lie a quarter of the chord behind it.
    """
    a = blade.aerodynamics
    zero = np.zeros(len(a.position))
    quarter, twist = 0.25 * np.interp(position, a.position, a.chord), np.interp(position, a.position, a.twist)
    centre = [np.interp(position, a.position, zero if c is None else c) for c in (a.centre_x, a.centre_y)]
    # positive twist rotates the leading edge into the wind, so the trailing edge points downwind
    result: Float = np.stack([centre[0] - quarter * np.sin(twist), centre[1] - quarter * np.cos(twist)], axis=1)
    return result


def penalty_share(turbine: Turbine, icing: Icing, position: Float) -> Float:
    """(n,) fraction of the full penalties at distances [m] from the blade root (I-4)."""
    x = (turbine.hub.radius + np.asarray(position, dtype=float)) / turbine.rotor_radius
    # at least a small step
    width = max(icing.penalty_full - icing.penalty_begin, 1e-9)
    result: Float = np.clip((x - icing.penalty_begin) / width, 0.0, 1.0)
    return result


def penalty_factors(icing: Icing, share: float, angle_of_attack: Float) -> tuple[Float, Float]:
    """(P,) factors of lift and drag at angles of attack [rad], for a fraction of the penalties (I-4)."""
    beyond = np.clip((np.abs(angle_of_attack) - FULL) / (GONE - FULL), 0.0, 1.0)
    weight = share * (0.5 + 0.5 * np.cos(math.pi * beyond))
    return 1.0 - icing.lift_penalty * weight, 1.0 + icing.drag_penalty * weight
