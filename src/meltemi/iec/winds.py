"""Steady and turbulent winds of IEC 61400-1: NWP, NTM, ETM and EWM. Gusts are in ``gusts.py``.

Reference: docs/theory/iec.md; IEC 61400-1 ed. 3, clauses 6.3.1 and 6.3.2.
"""

from __future__ import annotations

from typing import Any, Literal

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.yamlfile import validated
from meltemi.iec.classes import (
    STORM_INTENSITY,
    Edition,
    WindClass,
    as_class,
    extreme_speed,
    positive_intensity,
    positive_speed,
    sigma_etm,
    sigma_ntm,
)
from meltemi.wind.fields import SteadyWind
from meltemi.wind.turbulent import TurbulentWind

NORMAL_EXPONENT, STORM_EXPONENT = 0.2, 0.11
"""[-] exponents of the power law: ed. 3, eq. 10, and eq. 12 to 15."""
TURBULENCE = tuple(n for n in TurbulentWind.model_fields if n not in ("speed", "intensity", "edition"))
"""Fields of a turbulent wind that the models do not set."""


def nwp(speed: float, *, direction: float = 0.0) -> SteadyWind:
    """Normal wind profile: V_hub (z / z_hub)^0.2.

    Args:
      speed: V_hub [m/s].
      direction: [rad] clockwise seen from above.

    Returns:
      The steady wind; its reference height is the hub's.

    Raises:
      InputError: the speed is invalid.

    Source: ed. 3, clause 6.3.1.2, eq. 10; the same in editions 2 (6.3.1.2) and 4 (6.3.2).
    """
    return _steady("NWP", positive_speed("NWP", speed), NORMAL_EXPONENT, direction)


def ntm(
    speed: float,
    wind_class: str | WindClass | None = None,
    *,
    edition: Edition | None = None,
    intensity: float | None = None,
    **turbulence: Any,
) -> TurbulentWind:
    """Normal turbulence model, on the normal wind profile.

    Args:
      speed: V_hub [m/s].
      wind_class: name of the class, or a user-defined class; not needed with an intensity.
      edition: edition of a class given by name, and of the constants of the spectrum: 2, 3 or 4; 3 by default.
      intensity: intensity of the longitudinal component [-], in place of that of the class.
      turbulence: further fields of a :class:`TurbulentWind`: ``seed``, ``spectrum``, ``points`` and so on.

    Returns:
      The turbulent wind, with the intensity sigma_1 / V_hub.

    Raises:
      InputError: the class or option is unknown, or the speed is invalid.

    Source: ed. 3, clause 6.3.1.3, eq. 11; ed. 4, clause 6.3.2; ed. 2, clause 6.3.1.3.
    """
    if wind_class is not None:
        k = as_class(wind_class, edition)
        share, edition = sigma_ntm(speed, k, intensity=intensity) / speed, k.edition
    elif intensity is not None:
        share, edition = positive_intensity(intensity), 3 if edition is None else edition
    else:
        raise InputError("NTM: needs a wind_class (like 'IIB') or an intensity")
    return _turbulent("NTM", positive_speed("NTM", speed), share, edition, turbulence)


def etm(
    speed: float, wind_class: str | WindClass, *, edition: Edition | None = None, **turbulence: Any
) -> TurbulentWind:
    """Extreme turbulence model, on the normal wind profile.

    Args:
      speed: V_hub [m/s].
      wind_class: name of the class, or a user-defined class.
      edition: edition of a class given by name: 3 (default) or 4.
      turbulence: further fields of a :class:`TurbulentWind`: ``seed``, ``spectrum``, ``points`` and so on.

    Returns:
      The turbulent wind, with the intensity sigma_1 / V_hub.

    Raises:
      InputError: the class or option is unknown, the speed is invalid, or edition 2, which has no such model.

    Source: ed. 3, clause 6.3.2.3, eq. 19; ed. 4, clause 6.3.3.
    """
    k = as_class(wind_class, edition)
    return _turbulent("ETM", speed, sigma_etm(speed, k) / speed, k.edition, turbulence)


def ewm_turbulent(
    wind_class: str | WindClass, *, years: Literal[1, 50] = 50, edition: Edition | None = None, **turbulence: Any
) -> TurbulentWind:
    """Extreme wind speed model, turbulent: the 10 min mean of 50 years or 1 year.

    Args:
      wind_class: name of the class, or a user-defined class, which sets the speed.
      years: recurrence period: 50 or 1.
      edition: edition of a class given by name: 3 (default) or 4.
      turbulence: further fields of a :class:`TurbulentWind`: ``seed``, ``direction``, ``points`` and so on.

    Returns:
      The turbulent wind: V_ref or 0.8 V_ref at the hub, (z / z_hub)^0.11, sigma_1 = 0.11 V_hub.

    Raises:
      InputError: unknown class or option.
      UnsupportedError: edition 2.

    Source: ed. 3, clause 6.3.2.1, eq. 14 to 16; ed. 4, clause 6.3.3.
    """
    k = as_class(wind_class, edition)
    speed = extreme_speed(k, years=years, steady=False)
    options = {"shear_exponent": STORM_EXPONENT} | turbulence
    return _turbulent(f"EWM{years}", speed, STORM_INTENSITY, k.edition, options)


def ewm_steady(
    wind_class: str | WindClass,
    *,
    years: Literal[1, 50] = 50,
    edition: Edition | None = None,
    direction: float = 0.0,
) -> SteadyWind:
    """Extreme wind speed model, steady: the 3 s gust of 50 years or 1 year.

    Args:
      wind_class: name of the class, or a user-defined class, which sets the speed.
      years: recurrence period: 50 or 1.
      edition: edition of a class given by name: 2, 3 or 4; 3 by default.
      direction: [rad] clockwise seen from above. The standard asks for constant yaw misalignments of up to +-15
        degrees with this model, which is left to the load case.

    Returns:
      The steady wind: 1.4 V_ref or 0.8 times 1.4 V_ref at the hub, (z / z_hub)^0.11.

    Raises:
      InputError: unknown class.
      UnsupportedError: 1 year of edition 2.

    Source: ed. 3, clause 6.3.2.1, eq. 12 and 13; ed. 4, clause 6.3.3; ed. 2, clause 6.3.2.1.
    """
    speed = extreme_speed(wind_class, years=years, edition=edition)
    return _steady(f"EWM{years}", speed, STORM_EXPONENT, direction)


def _steady(model: str, speed: float, exponent: float, direction: float) -> SteadyWind:
    data = {"speed": speed, "shear_exponent": exponent, "direction": direction}
    return validated(data, SteadyWind, model)


def _turbulent(model: str, speed: float, intensity: float, edition: int, options: dict[str, Any]) -> TurbulentWind:
    for name in options:
        if name not in TURBULENCE:
            raise InputError(f"{model}: no option {name!r}; {did_you_mean(name, TURBULENCE)}")
    return validated({"speed": speed, "intensity": intensity, "edition": edition} | options, TurbulentWind, model)
