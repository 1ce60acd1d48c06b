"""Azimuth-dependent feed-forward of the collective pitch against shear and tower shadow.

    K_i = N V_i^m / sum V_j^m,   sum K_i = N,   theta_i = K_i theta_collective

with V_i the wind at one radius of blade i: a power law of the height above ground, and a potential flow around the
tower below the hub. The exponent m is 2, since the torque of a blade is proportional to the square of the wind. The
weights need only the azimuth, no load sensor. Only ratios matter, so V is relative to the wind at the hub.

Reference: docs/theory/control.md (C-22 and C-23).
"""

from __future__ import annotations

from math import cos, exp, isfinite, log, sin

from meltemi.compiler import Table, kernel, number
from meltemi.control_laws.multiblade import blade_angle
from meltemi.core.errors import InputError


class FeedforwardWeights(Table, title="feed-forward weights"):
    """Settings of the feed-forward weights."""

    exponent: float = number("-", "exponent m of the wind speed in the weights")
    radius: float = number("m", "radius for the wind of a blade")
    hub_height: float = number("m", "hub height above ground")
    shear: float = number("-", "exponent of the power law of the height")
    tower_radius: float = number("m", "tower radius where the blade passes; 0: no tower")
    clearance: float = number("m", "distance of the passing blade from the tower axis")


_LEAST = 0.01
"""Smallest height over hub height, and share of the wind that a tower leaves, so that logarithms stay finite."""


@kernel
def blade_wind(x: FeedforwardWeights, angle: float) -> float:
    """Ratio of the wind speed at a blade at an azimuth [rad] to that at the hub (C-22)."""
    above, aside = x.radius * cos(angle), x.radius * sin(angle)
    height = max(1.0 + above / x.hub_height, _LEAST)
    wind = exp(x.shear * log(height))
    if x.tower_radius > 0.0:
        # in tower radii; full from the hub downwards, zero one tower radius above it, so that it is continuous
        c, y = x.clearance / x.tower_radius, aside / x.tower_radius
        share = min(max(1.0 - above / x.tower_radius, 0.0), 1.0)
        square = c * c + y * y
        wind *= max(1.0 - share * (c * c - y * y) / (square * square), _LEAST)
    return wind


@kernel
def weight(x: FeedforwardWeights, blade: int, blades: int, azimuth: float) -> float:
    """Feed-forward weight of a blade (C-23).

    Args:
      x: settings.
      blades: number N of blades.
      azimuth: [rad] azimuth of the first blade.
    """
    this, total = 0.0, 0.0
    for i in range(blades):
        power = exp(x.exponent * log(blade_wind(x, blade_angle(azimuth, i, blades))))
        total += power
        if i == blade:
            this += power
    return blades * this / total


def weight_settings(
    *,
    radius: float,
    hub_height: float,
    shear: float,
    tower_radius: float = 0.0,
    clearance: float = 0.0,
    exponent: float = 2.0,
) -> FeedforwardWeights:
    """Validated settings of the feed-forward weights.

    Args:
      radius: [m] radius for the wind of a blade; two thirds of the rotor radius is the torque-weighted mean.
      hub_height: [m] hub height above ground.
      shear: exponent of the power law.
      tower_radius: [m] tower radius where the blade passes at ``radius``; 0 for no tower.
      clearance: [m] distance there from the tower axis to the blade, larger than the tower radius.
      exponent: m of the weights.

    Raises:
      InputError: a number is out of range.
    """
    values = {
        "exponent": exponent,
        "radius": radius,
        "hub_height": hub_height,
        "shear": shear,
        "tower_radius": tower_radius,
        "clearance": clearance,
    }
    for name, value in values.items():
        if not (isfinite(value) and value >= 0.0):
            raise InputError(f"feed-forward weights: {name} must be zero or a positive number, found {value!r}")
    if not radius < hub_height:
        raise InputError(f"feed-forward weights: radius {radius:g} m must be below hub_height {hub_height:g} m")
    if tower_radius > 0.0 and not clearance > tower_radius:
        raise InputError(
            f"feed-forward weights: clearance {clearance:g} m must be larger than tower_radius {tower_radius:g} m"
        )
    return FeedforwardWeights.of(**values)
