"""Gusts of IEC 61400-1: EOG, EDC, ECD, ECG and EWS, as series on the normal wind profile.

Signs: a direction change is positive clockwise seen from above, as a compass has it: the wind then blows towards
-y. A positive horizontal shear makes the wind faster to the left looking downwind (+y), a positive vertical one
faster above the hub. The standard gives both signs for these and leaves the choice to the load case. Gusts have no
sign: EOG dips first, ECD and ECG rise.

Reference: docs/theory/iec.md; IEC 61400-1 ed. 3, clause 6.3.2; ed. 2, clause 6.3.2; ed. 4, clause 6.3.3.
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.units import from_text
from meltemi.iec.classes import (
    Edition,
    WindClass,
    as_class,
    operating_gust_limit,
    positive_speed,
    sigma_ntm,
)
from meltemi.iec.winds import NORMAL_EXPONENT
from meltemi.turbine.power_turbine import AnyTurbine
from meltemi.turbulence.spectra import scale_parameter
from meltemi.wind.fields import WindSeries

Sign = Literal[1, -1]
BEGIN = 60.0
"""[s] default begin of a transient."""
LATEST = 1e6
"""[s] latest begin: no run is longer."""
MOST_TURNED = 7.0
"""[rad] largest wind direction, as of other winds."""
STEP = 0.05
"""[s] interval of the rows of a transient."""
EOG_TIME, EOG_TIME_50, EDC_TIME, RISE_TIME, EWS_TIME = 10.5, 14.0, 6.0, 10.0, 12.0
"""[s] duration T of each transient; edition 2 has a longer gust of 50 years."""
BETA = {1: 4.8, 50: 6.4}
"""[-] beta of edition 2 for 1 and 50 years; the extreme wind shear of all editions has that of 50 years."""
COHERENT_GUST = 15.0
"""V_cg [m/s]."""


def eog(
    turbine: AnyTurbine,
    speed: float,
    wind_class: str | WindClass,
    *,
    edition: Edition | None = None,
    years: Literal[1, 50] | None = None,
    intensity: float | None = None,
    begin: float = BEGIN,
    direction: float = 0.0,
) -> WindSeries:
    """Extreme operating gust: V(z) - 0.37 V_gust sin(3 pi t / T) (1 - cos(2 pi t / T)).

    Args:
      turbine: turbine, for its hub height and rotor diameter.
      speed: V_hub [m/s].
      wind_class: name of the class, or a user-defined class.
      edition: edition of a class given by name: 2, 3 or 4; 3 by default.
      years: recurrence period of the gust, 1 or 50: edition 2 alone, where it must be given.
      intensity: turbulence intensity [-], in place of that of the class.
      begin: [s] begin of the gust.
      direction: [rad] wind direction, clockwise seen from above.

    Returns:
      The series, with T = 10.5 s (50 years of edition 2: 14 s) and
      V_gust = min(1.35 (V_e1 - V_hub), 3.3 sigma_1 / (1 + 0.1 D / Lambda_1)), sigma_1 of the normal turbulence
      model; in edition 2 beta sigma_1 / (1 + 0.1 D / Lambda_1), beta = 4.8 and 6.4 for 1 and 50 years.

    Raises:
      InputError: the class is unknown, the speed or begin is invalid, years missing or of another edition.

    Source: ed. 3, clause 6.3.2.2, eq. 17 and 18; ed. 4, clause 6.3.3; ed. 2, clause 6.3.2.2.
    """
    k = as_class(wind_class, edition)
    v_hub = positive_speed("EOG", speed)
    beta = _beta("EOG", k, years)
    smoothed = sigma_ntm(v_hub, k, intensity=intensity) / _size(turbine, k)
    if beta is not None:
        v_gust = beta * smoothed
    else:
        limit = operating_gust_limit(k)
        if v_hub >= limit:
            raise InputError(f"EOG: speed must be below V_e1 = {limit:g} m/s of {k.label}, found {speed:g} m/s")
        v_gust = min(1.35 * (limit - v_hub), 3.3 * smoothed)
    duration = EOG_TIME_50 if years == 50 else EOG_TIME
    x = _course(duration)
    gust = -0.37 * v_gust * np.sin(3.0 * math.pi * x) * (1.0 - np.cos(2.0 * math.pi * x))
    return _series(turbine, v_hub, f"EOG{years or ''}", duration, begin, direction, k.label, gust=gust)


def edc(  # noqa: PLR0913 - quantities that the standard names
    turbine: AnyTurbine,
    speed: float,
    wind_class: str | WindClass,
    *,
    sign: Sign = 1,
    edition: Edition | None = None,
    years: Literal[1, 50] | None = None,
    intensity: float | None = None,
    begin: float = BEGIN,
    direction: float = 0.0,
) -> WindSeries:
    """Extreme direction change: the wind direction changes by theta_e within 6 s, permanently.

    Args:
      turbine: turbine, for its hub height and rotor diameter.
      speed: V_hub [m/s].
      wind_class: name of the class, or a user-defined class.
      sign: +1 turns the wind clockwise seen from above, -1 counter-clockwise.
      edition: edition of a class given by name: 2, 3 or 4; 3 by default.
      years: recurrence period, 1 or 50: edition 2 alone, where it must be given.
      intensity: turbulence intensity [-], in place of that of the class.
      begin: [s] begin of the change.
      direction: [rad] wind direction, clockwise seen from above.

    Returns:
      The series, with 0.5 theta_e (1 - cos(pi t / T)) and
      theta_e = 4 arctan(sigma_1 / (V_hub (1 + 0.1 D / Lambda_1))), at most 180 degrees; in edition 2 with beta = 4.8
      and 6.4 for 1 and 50 years in place of 4.

    Raises:
      InputError: the class is unknown, the speed, sign or begin is invalid, years missing or of another edition.

    Source: ed. 3, clause 6.3.2.4, eq. 20 and 21; ed. 4, clause 6.3.3; ed. 2, clause 6.3.2.3.
    """
    k = as_class(wind_class, edition)
    v_hub = positive_speed("EDC", speed)
    beta = _beta("EDC", k, years)
    smoothed = sigma_ntm(v_hub, k, intensity=intensity) / _size(turbine, k)
    theta_e = min((4.0 if beta is None else beta) * math.atan(smoothed / v_hub), math.pi)
    turn = _sign("EDC", sign) * theta_e * _rise(EDC_TIME)
    return _series(turbine, v_hub, f"EDC{years or ''}", EDC_TIME, begin, direction, k.label, sign, direction=turn)


def ecd(
    turbine: AnyTurbine,
    speed: float,
    *,
    sign: Sign = 1,
    gust: float = COHERENT_GUST,
    change: float | None = None,
    begin: float = BEGIN,
    direction: float = 0.0,
) -> WindSeries:
    """Extreme coherent gust with direction change: increase by V_cg and theta_cg within 10 s, permanently.

    Args:
      turbine: turbine, for its hub height.
      speed: V_hub [m/s].
      sign: +1 turns the wind clockwise seen from above, -1 counter-clockwise.
      gust: V_cg [m/s], 15 in the standard.
      change: theta_cg [rad], zero or more; by default that of the standard.
      begin: [s] begin of the change.
      direction: [rad] wind direction, clockwise seen from above.

    Returns:
      The series, with 0.5 V_cg (1 - cos(pi t / T)) added at all heights, 0.5 theta_cg (1 - cos(pi t / T)), and
      theta_cg = 180 degrees below 4 m/s, 720 degrees m/s over V_hub above.

    Raises:
      InputError: the speed, sign or begin is invalid.

    Source: ed. 3, clause 6.3.2.5, eq. 22 to 25; the same in editions 2 (6.3.2) and 4 (6.3.3). It is independent of the
      class.
    """
    v_hub = positive_speed("ECD", speed)
    if not -v_hub < gust < math.inf:
        raise InputError(f"ECD: gust must be an increase in m/s that leaves a positive wind speed, found {gust!r}")
    if change is not None and not 0.0 <= change <= math.pi:
        raise InputError(f"ECD: change must be an angle from 0 to pi rad, found {change!r}")
    theta_cg = math.pi if v_hub < 4.0 else math.radians(720.0 / v_hub)
    theta_cg = theta_cg if change is None else change
    rise = _rise(RISE_TIME)
    turn = _sign("ECD", sign) * theta_cg * rise
    return _series(turbine, v_hub, "ECD", RISE_TIME, begin, direction, "", sign, gust=gust * rise, direction=turn)


def ecg(turbine: AnyTurbine, speed: float, *, begin: float = BEGIN, direction: float = 0.0) -> WindSeries:
    """Extreme coherent gust of edition 2: increase by 15 m/s within 10 s, permanently.

    Args:
      turbine: turbine, for its hub height.
      speed: V_hub [m/s].
      begin: [s] begin of the gust.
      direction: [rad] wind direction, clockwise seen from above.

    Returns:
      The series, with 0.5 V_cg (1 - cos(pi t / T)) added at all heights.

    Raises:
      InputError: the speed or begin is invalid.

    Source: ed. 2, clause 6.3.2.4. Later editions do not have it; their ECD has the same gust. It is independent of the
      class.
    """
    v_hub = positive_speed("ECG", speed)
    return _series(
        turbine, v_hub, "ECG", RISE_TIME, begin, direction, "edition 2", gust=COHERENT_GUST * _rise(RISE_TIME)
    )


def ews_horizontal(
    turbine: AnyTurbine,
    speed: float,
    wind_class: str | WindClass,
    *,
    sign: Sign = 1,
    edition: Edition | None = None,
    intensity: float | None = None,
    begin: float = BEGIN,
    direction: float = 0.0,
) -> WindSeries:
    """Extreme wind shear, horizontal: a transient linear shear across the rotor of 12 s.

    Args:
      turbine: turbine, for its hub height and rotor diameter.
      speed: V_hub [m/s].
      wind_class: name of the class, or a user-defined class.
      sign: +1 makes the wind faster to the left looking downwind (+y), -1 to the right.
      edition: edition of a class given by name: 2, 3 or 4; 3 by default.
      intensity: turbulence intensity [-], in place of that of the class.
      begin: [s] begin of the transient.
      direction: [rad] wind direction, clockwise seen from above.

    Returns:
      The series, with the speed
      V(z) +- (y / D) (2.5 m/s + 0.2 beta sigma_1 (D / Lambda_1)^(1/4)) (1 - cos(2 pi t / T)), beta = 6.4.

    Raises:
      InputError: the class is unknown, or the speed, sign or begin is invalid.

    Source: ed. 3, clause 6.3.2.6, eq. 27; the same in editions 2 (6.3.2) and 4 (6.3.3) but for sigma_1 and Lambda_1.
    """
    k = as_class(wind_class, edition)
    shear = _sign("EWSH", sign) * _shear("EWSH", turbine, speed, k, intensity)
    return _series(turbine, float(speed), "EWSH", EWS_TIME, begin, direction, k.label, sign, horizontal_shear=shear)


def ews_vertical(
    turbine: AnyTurbine,
    speed: float,
    wind_class: str | WindClass,
    *,
    sign: Sign = 1,
    edition: Edition | None = None,
    intensity: float | None = None,
    begin: float = BEGIN,
    direction: float = 0.0,
) -> WindSeries:
    """Extreme wind shear, vertical: a transient linear shear of 12 s, added to the normal profile.

    Args:
      turbine: turbine, for its hub height and rotor diameter.
      speed: V_hub [m/s].
      wind_class: name of the class, or a user-defined class.
      sign: +1 makes the wind faster above the hub, -1 below.
      edition: edition of a class given by name: 2, 3 or 4; 3 by default.
      intensity: turbulence intensity [-], in place of that of the class.
      begin: [s] begin of the transient.
      direction: [rad] wind direction, clockwise seen from above.

    Returns:
      The series, with the speed
      V(z) +- ((z - z_hub) / D) (2.5 m/s + 0.2 beta sigma_1 (D / Lambda_1)^(1/4)) (1 - cos(2 pi t / T)), beta = 6.4.

    Raises:
      InputError: the class is unknown, or the speed, sign or begin is invalid.

    Source: ed. 3, clause 6.3.2.6, eq. 26; the same in editions 2 (6.3.2) and 4 (6.3.3) but for sigma_1 and Lambda_1.
    """
    k = as_class(wind_class, edition)
    shear = _sign("EWSV", sign) * _shear("EWSV", turbine, speed, k, intensity)
    return _series(turbine, float(speed), "EWSV", EWS_TIME, begin, direction, k.label, sign, vertical_shear=shear)


def _shear(model: str, turbine: AnyTurbine, speed: float, k: WindClass, intensity: float | None) -> NDArray[np.float64]:
    """Shear over the rotor diameter relative to the speed, as in a series; the standard gives m/s."""
    v_hub = positive_speed(model, speed)
    ratio = turbine.rotor_diameter / scale_parameter(k.edition, turbine.hub_height)
    amplitude = 2.5 + 0.2 * BETA[50] * sigma_ntm(v_hub, k, intensity=intensity) * ratio**0.25
    shear: NDArray[np.float64] = amplitude / v_hub * (1.0 - np.cos(2.0 * math.pi * _course(EWS_TIME)))
    return shear


def _beta(model: str, k: WindClass, years: int | None) -> float | None:
    """Factor beta of edition 2; None since edition 3."""
    if k.edition != 2:
        if years is not None:
            raise InputError(f"{model}: years applies to edition 2 only; edition {k.edition} has one {model} only")
        return None
    if years not in BETA:
        raise InputError(f"{model}: edition 2 has recurrence periods of 1 and 50 years; expected years 1 or 50")
    return BETA[years]


def _size(turbine: AnyTurbine, k: WindClass) -> float:
    """Size factor 1 + 0.1 D / Lambda_1: a large rotor averages over the gust."""
    return 1.0 + 0.1 * turbine.rotor_diameter / scale_parameter(k.edition, turbine.hub_height)


def _sign(model: str, sign: int) -> int:
    if sign not in (1, -1):
        raise InputError(f"{model}: sign: expected +1 or -1, found {sign!r}")
    return sign


def _course(duration: float) -> NDArray[np.float64]:
    """Time t / T from 0 to 1."""
    return np.linspace(0.0, 1.0, round(duration / STEP) + 1)


def _rise(duration: float) -> NDArray[np.float64]:
    """0.5 (1 - cos(pi t / T)), from 0 to 1."""
    rise: NDArray[np.float64] = 0.5 * (1.0 - np.cos(math.pi * _course(duration)))
    return rise


def _series(
    turbine: AnyTurbine,
    speed: float,
    model: str,
    duration: float,
    begin: float,
    mean_direction: float,
    label: str,
    sign: int | None = None,
    **columns: Any,
) -> WindSeries:
    """Series of a transient from its begin on; constant before and after."""
    if not 0.0 <= begin < math.inf:
        raise InputError(f"{model}: begin must be zero or a positive time in seconds, found {begin!r}")
    if begin > LATEST:
        raise InputError(f"{model}: begin: expected at most {LATEST:g} s, found {begin!r}")
    toward = from_text(mean_direction, "rad")
    if not isinstance(toward, int | float) or not abs(toward) <= MOST_TURNED:
        raise InputError(f"{model}: direction: expected an angle within +-{MOST_TURNED} rad, found {mean_direction!r}")
    columns["direction"] = toward + columns.get("direction", 0.0)
    parts = [f"IEC {model}{'' if sign is None else '+' if sign > 0 else '-'} {speed:g} m/s", label, f"at {begin:g} s"]
    return WindSeries(
        time=begin + duration * _course(duration),
        speed=speed,
        exponent=NORMAL_EXPONENT,
        reference_height=turbine.hub_height,
        reference_length=turbine.rotor_diameter,
        source=", ".join(p for p in parts if p),
        **columns,
    )
