"""Space of the site variables of a load surrogate, with bounds that depend on the wind speed.

A bound is a polynomial in 1/U between two limits, where U is the mean wind speed. The germ has the values of all
variables, scaled from -1 to 1 between their bounds. Equations LS-1 to LS-3 of ``docs/theory/surrogate.md``, which has
the source of the bounds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, log, radians

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError, did_you_mean

Float = NDArray[np.float64]
SPEED = "speed"
UNITS = {
    SPEED: "m/s",
    "turbulence_intensity": "-",
    "shear_exponent": "-",
    "air_density": "kg/m^3",
    "inclination": "rad",
    "yaw_error": "rad",
    "power_reference": "W",
}
"""Units of the variables."""
USUAL = tuple(UNITS)[:-1]
"""Default variables of a surrogate."""
REFERENCE_SPEED = 25.0
"""Reference wind speed [m/s] of the bounds of the shear exponent."""


@dataclass(frozen=True)
class SiteVariable:
    """A variable and its bounds.

    Attributes:
      name: name such as ``shear_exponent``.
      lower, upper: coefficients of 1, 1/U, 1/U^2 ... of the bounds.
      least, most: limits of both bounds.
    """

    name: str
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    least: float = -inf
    most: float = inf

    def bounds(self, speed: ArrayLike) -> tuple[Float, Float]:
        """Lower and upper bound at wind speeds (n,) [m/s]."""
        x = 1.0 / np.asarray(speed, dtype=float)
        low, high = (np.polynomial.polynomial.polyval(x, np.array(c)) for c in (self.lower, self.upper))
        return np.clip(low, self.least, self.most), np.clip(high, self.least, self.most)


@dataclass(frozen=True)
class Space:
    """Variables of a surrogate; the first one is the mean wind speed."""

    variables: tuple[SiteVariable, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(variable.name for variable in self.variables)

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest wind speed [m/s]."""
        return self.variables[0].lower[0], self.variables[0].upper[0]

    def bounds(self, speed: ArrayLike) -> tuple[Float, Float]:
        """Lower and upper bounds (n, d) at wind speeds (n,) [m/s]; constant beyond the least and largest speed."""
        at = np.clip(speed, *self.ends)
        pairs = [variable.bounds(at) for variable in self.variables]
        return np.column_stack([low for low, _ in pairs]), np.column_stack([high for _, high in pairs])

    def points(self, germ: Float) -> Float:
        """Values (n, d) of the variables at germs (n, d)."""
        first, last = self.ends
        low, high = self.bounds(0.5 * (first + last + (last - first) * germ[:, 0]))
        return 0.5 * (low + high + (high - low) * germ)

    def germ(self, points: Float) -> Float:
        """Germs (n, d) of values (n, d); beyond -1 to 1 outside the bounds."""
        low, high = self.bounds(points[:, 0])
        return (2.0 * points - low - high) / (high - low)


def site_space(
    *,
    hub_height: float,
    rotor_radius: float,
    cut_in: float,
    cut_out: float,
    rated_power: float,
    variables: Sequence[str] = USUAL,
    bounds: Mapping[str, tuple[float, float]] | None = None,
) -> Space:
    """Space of site variables of a turbine.

    Args:
      hub_height, rotor_radius: [m] hub height and rotor radius.
      cut_in, cut_out: [m/s] cut-in and cut-out wind speed.
      rated_power: [W] rated power.
      variables: names; ``speed`` is always the first.
      bounds: constant bounds by name, in place of the usual ones.

    Raises:
      InputError: there is no such variable, or bounds do not ascend or belong to no variable.
    """
    power = 0.4 * (rotor_radius / hub_height) * REFERENCE_SPEED
    shear = 0.23 * (1.0 - (0.4 * log(rotor_radius / hub_height)) ** 2) * REFERENCE_SPEED
    usual = (
        SiteVariable(SPEED, (cut_in,), (cut_out,)),
        SiteVariable("turbulence_intensity", (0.025,), (0.135, 1.224, 0.0, 54.0), 0.0, 0.5),
        SiteVariable("shear_exponent", (0.15, -shear), (0.22, power), -0.3, 0.8),
        SiteVariable("air_density", (1.0,), (1.35,)),
        SiteVariable("inclination", (-radians(10.0),), (radians(10.0),)),
        SiteVariable("yaw_error", (-radians(10.0),), (radians(10.0),)),
        SiteVariable("power_reference", (0.4 * rated_power,), (rated_power,)),
    )
    given = dict(bounds or {})
    for name in [*variables, *given]:
        if name not in UNITS:
            raise InputError(f"variables: no site variable {name!r}: {did_you_mean(name, UNITS)}")
    chosen = dict.fromkeys((SPEED, *variables))
    for name, (low, high) in given.items():
        if name not in chosen:
            raise InputError(f"bounds: {name} is not among the variables {', '.join(chosen)}")
        if not low < high:
            raise InputError(f"bounds of {name}: {low:g} and {high:g} must ascend")
    replaced = {name: SiteVariable(name, (float(low),), (float(high),)) for name, (low, high) in given.items()}
    return Space(tuple(replaced.get(v.name, v) for v in usual if v.name in chosen))


def space_filling(dimensions: int, n: int, method: str = "sobol", *, seed: int = 1) -> Float:
    """Germs (n, d) that fill the cube.

    Args:
      dimensions: number d of dimensions.
      n: number of points.
      method: "sobol" (scrambled; more points continue the sequence) or "latin" (hypercube).

    Raises:
      InputError: there is no such method, or ``n`` is not positive.
    """
    from warnings import catch_warnings

    from scipy.stats import qmc

    if n < 1:
        raise InputError(f"points: expected at least 1, found {n}")
    kinds = {"sobol": qmc.Sobol, "latin": qmc.LatinHypercube}
    if method not in kinds:
        raise InputError(f"method: no design {method!r}: {did_you_mean(method, kinds)}")
    with catch_warnings(action="ignore"):  # of numbers that are no power of two
        return np.asarray(2.0 * kinds[method](dimensions, seed=seed).random(n) - 1.0)
