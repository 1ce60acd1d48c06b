"""Conditions of a site from the digital exchange format of IEC 61400-1's part 15-1, version 1.1 (JSON).

Source: the public JSON schema and example of the site suitability input conditions form, v17 of 2025-02-15
(github.com/IEC-61400-15/site_suitability_conditions_input_form); the text of IEC 61400-15-1 was not available.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record, Vector
from meltemi.core.yamlfile import read_text, validated
from meltemi.iec.classes import Edition, WindClass
from meltemi.loads.effective import FURTHEST, checked_neighbours, effective_intensity, wake_turbulence

VERSION = "1.1"
"""Version of the digital exchange format."""
QUANTILE = 1.28
"""Standard deviations from the mean to the 90 % quantile."""
FROM_SPEED = 15.0
"""Wind speed [m/s] at which the form gives one turbulence intensity."""
TOLERANCE = 0.2
"""Relative difference between that intensity and the table, above which the table is not in per cent."""


class Site(Record):
    """Wind conditions of a site at the hub of one turbine."""

    name: str = ""
    """Names of the project and of the turbine."""
    mean_speed: float = Field(gt=0.0, le=50.0)
    """Annual mean wind speed [m/s]."""
    weibull_scale: float = Field(gt=0.0, le=60.0)
    """Scale parameter [m/s] of the distribution of the wind speed."""
    weibull_shape: float = Field(gt=0.5, le=10.0)
    """Shape parameter of the distribution of the wind speed."""
    v50: float = Field(gt=0.0, le=70.0)
    """Extreme 10-minute mean wind speed [m/s] with a return period of 50 years."""
    speed: Vector
    """(n,) [m/s] wind speeds of the turbulence intensities, increasing."""
    intensity: Vector
    """(n,) characteristic turbulence intensity (90 % quantile), with the correction for complex terrain."""
    extreme_intensity: Vector
    """(n,) extreme turbulence intensity."""
    shear_exponent: float = Field(default=0.2, gt=-1.0, lt=1.0)
    """Shear exponent of the mean wind."""
    inclination: float = Field(default=0.0, ge=-0.5, le=0.5)
    """Largest inclination [rad] of the flow."""
    air_density: float = Field(default=1.225, gt=0.0, lt=3.0)
    """Density [kg/m^3] of the air."""
    neighbours: tuple[float, ...] = ()
    """Distances of other turbines in rotor diameters; normal turbulence then includes their wakes (Frandsen)."""
    slope: float = Field(default=10.0, ge=1.0, le=20.0)
    """S-N slope of the effective turbulence intensity of fatigue loads; the largest one of the turbine is safe."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        n = len(self.speed)
        checked_neighbours(self.neighbours)
        if n < 2 or np.any(np.diff(self.speed) <= 0.0):
            raise ValueError("speed needs at least 2 entries that increase")
        for name in ("intensity", "extreme_intensity"):
            values = getattr(self, name)
            if len(values) != n:
                raise ValueError(f"{name} must have {n} entries like speed, found {len(values)}")
            if values.min() <= 0.0 or values.max() >= 2.0:
                raise ValueError(f"{name} must be between 0 and 2 (0.14 is 14 %)")
        return self

    def intensity_at(self, speed: float, *, extreme: bool = False) -> float:
        """Turbulence intensity [-] at a wind speed [m/s], linear in between and constant beyond the table."""
        values = self.extreme_intensity if extreme else self.intensity
        return round(float(np.interp(speed, self.speed, values)), 6)

    def waked_at(self, speed: float, edition: Literal[3, 4], *, fatigue: bool) -> float:
        """Turbulence intensity with the wakes of neighbours: effective for fatigue loads, else of the nearest wake.

        The thrust coefficient is 7 m/s over the wind speed [m/s] (K-16, K-17).
        """
        ambient, thrust = self.intensity_at(speed), 7.0 / speed
        nearest = min(self.neighbours, default=FURTHEST)
        if nearest >= FURTHEST:
            return ambient
        if fatigue:
            near, slope = self.neighbours, self.slope
            return round(effective_intensity(speed, ambient, near, slope=slope, thrust=thrust, edition=edition), 6)
        return round(wake_turbulence(speed, ambient * speed, nearest, thrust, edition=edition) / speed, 6)

    def wind_class(self, edition: Edition) -> WindClass:
        """Class S with the speeds of the site, for extreme winds and gusts."""
        expected = self.intensity_at(FROM_SPEED)
        return WindClass(name="S", edition=edition, v_ref=self.v50, v_ave=self.mean_speed, i_ref=expected)


def read_site(path: str | Path, turbine: str | None = None) -> Site:
    """Read the conditions at one turbine from a JSON file of IEC 61400-15-1.

    The characteristic intensity is C_cT (mean + 1.28 standard deviations); speeds without data take that of the next
    speed with data.

    Args:
      path: JSON file.
      turbine: ID of the turbine in the file; not needed if there is only one.

    Raises:
      InputError: another form or version, no such turbine, or a value that is missing or not allowed.
    """
    path = Path(path)
    try:
        data = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not valid JSON: {error}") from None
    if not isinstance(data, Mapping) or "Turbine Layout Summary" not in data:
        raise InputError(
            f"{path}: not a site suitability input conditions form of IEC 61400-15-1: no 'Turbine Layout Summary'"
        )
    if data.get("DEF version") != VERSION:
        raise InputError(
            f"{path}: DEF version: expected {VERSION!r} (form v17 of 2025), found {data.get('DEF version')!r}; "
            "earlier forms have other keys"
        )
    turbines = data["Turbine Layout Summary"]
    if not isinstance(turbines, Mapping):
        raise InputError(f"{path}: Turbine Layout Summary: expected turbines by their ID, found {turbines!r:.60}")
    if turbine is None:
        if len(turbines) != 1:
            shown = ", ".join(list(turbines)[:12])
            raise InputError(f"{path}: it has {len(turbines)} turbines; choose one of them with its ID: {shown}")
        (turbine,) = turbines
    if turbine not in turbines:
        raise InputError(f"{path}: Turbine Layout Summary: no {turbine!r}; {did_you_mean(turbine, turbines)}")
    return _site(data, turbine, str(path))


def _site(data: Mapping[str, Any], turbine: str, where: str) -> Site:
    def at(part: str, *keys: str) -> Any:
        inner: Any = data.get(part)
        for key in keys:
            inner = {k.strip(): v for k, v in inner.items()}.get(key) if isinstance(inner, Mapping) else None
        if inner is None:
            raise InputError(f"{where}: {'.'.join((part, *keys))}: missing")
        return inner

    def number(part: str, *keys: str) -> float:
        value = at(part, *keys)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(f"{where}: {'.'.join((part, *keys))}: expected a number, found {value!r}")
        return float(value)

    def bins(part: str, key: str) -> np.ndarray:
        values = at(part, turbine, key)
        try:
            return np.array(values, dtype=float).reshape(len(values)) / 100.0
        except (TypeError, ValueError):
            raise InputError(f"{where}: {part}.{turbine}.{key}: expected numbers [%]") from None

    layout = ("Turbine Layout Summary", turbine)
    mean, deviation = bins("Ambient Mean TI", "Ambient mean TI all directions"), bins("SD TI", "SD TI all directions")
    extreme = bins("Extreme Ambient TI", "Extreme ambient TI")
    width = number("Meta Data", "Wind speed bin width")
    if not (len(mean) == len(deviation) == len(extreme) and width > 0.0):
        raise InputError(f"{where}: the tables of turbulence of {turbine!r} have different lengths")
    speed = width * np.arange(len(mean))
    known = (mean > 0.0) & (extreme > 0.0)
    if known.sum() < 2:
        raise InputError(f"{where}: Ambient Mean TI.{turbine}: fewer than two wind speeds have data")
    ti15 = number(*layout, "TI15")
    if abs(float(np.interp(FROM_SPEED, speed[known], mean[known])) - ti15) > TOLERANCE * ti15:
        raise InputError(
            f"{where}: Ambient Mean TI.{turbine}: at 15 m/s it is not TI15 = {ti15:g}; the tables must be in per cent, "
            "TI15 must not"
        )
    correction, project = number("CcT", turbine, "CcT"), data.get("Project Information")
    angle = math.radians(number("Inflow Angle", turbine, "Inflow angle max"))
    conditions = {
        "name": f"{project.get('Project name', '') if isinstance(project, Mapping) else ''}, turbine {turbine}",
        "mean_speed": number(*layout, "Annual Average Wind Speed"),
        "weibull_scale": number(*layout, "Weibull Scale Parameter"),
        "weibull_shape": number(*layout, "Weibull Shape Parameter"),
        "v50": number(*layout, "V50"),
        "speed": speed[known].tolist(),
        "intensity": np.round(correction * (mean + QUANTILE * deviation)[known], 6).tolist(),
        "extreme_intensity": np.round(extreme[known], 6).tolist(),
        "shear_exponent": number("Shear", turbine, "Shear all directions"),
        "inclination": round(angle, 9),
        "air_density": number(*layout, "Air Density"),
    }
    return validated(conditions, Site, f"{where}: {turbine}")
