"""Settings of the evaluation of a load base."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from meltemi.core.record import Record
from meltemi.core.yamlfile import read_record

Way = Literal["gumbel", "weibull", "quantile_99", "quantile_93"]
WAYS: tuple[Way, ...] = ("gumbel", "weibull", "quantile_99", "quantile_93")
Positive = Annotated[float, Field(gt=0.0)]


class DesignSettings(Record):
    """Settings of the evaluation of design loads, which leaves the results of a load base unchanged."""

    extrapolation: Way = "gumbel"
    """Extrapolation of DLC 1.1: "gumbel", "weibull" (three parameters); "quantile_99", "quantile_93" of edition 4."""
    resamples: int = Field(default=200, ge=1)
    """Number of bootstrap samples for the bands of the extrapolations."""
    doubtful: bool = True
    """Whether doubtful cases are evaluated, those outside the range of validity of the model."""
    slopes: tuple[Positive, ...] = Field(default=(3.0, 4.0, 5.0, 8.0, 10.0, 12.0), min_length=1)
    """Slopes m of the S-N curves."""
    reference: Positive = 1e7
    """Reference number of cycles of the equivalent loads; the seconds of the lifetime for a load at 1 Hz."""
    strengths: dict[str, Positive] = Field(default_factory=dict)
    """Strengths for the mean correction of cycles by the line of Goodman: by channel, also without the number of the
    blade ("root_moment_flap"), the load [N, N m] at which the component fails. None by default."""
    material: Positive = 1.1
    """Partial safety factor for the elasticity of the blades, in the clearance of the tips."""
    availability: float = Field(default=1.0, gt=0.0, le=1.0)
    """Share of the time in which the turbine produces when the wind allows it, for the energy."""
    undeflected: Positive | None = None
    """Clearance [m] of an undeflected tip from the surface of the tower; by default that of the model."""


STANDARD = DesignSettings()


def read_settings(path: str | Path | None) -> DesignSettings:
    """Settings of a YAML file, such as ``extrapolation: weibull``; the standard ones without a file.

    Raises:
      InputError: the file cannot be read, or has an unknown key.
    """
    return STANDARD if path is None else read_record(path, DesignSettings)
