"""All comparisons with stored runs."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from comparisons import (
    decays,
    elastodyn_blade,
    floating,
    offshore,
    offshore_wind,
    parked,
    periodic,
    rigid,
    stops,
    transient,
    turbulent,
    yaw,
)
from meltemi.verification.table import CheckStudy
from meltemi.verification.verification import WINDIO

QUICK: tuple[CheckStudy, ...] = (
    CheckStudy(2.0, decays.decays),
    CheckStudy(1.0, elastodyn_blade.discretisation),
    CheckStudy(3.0, rigid.fixed_rotor),
    CheckStudy(1.0, rigid.spin),
    CheckStudy(2.0, rigid.pitch_steps),
    CheckStudy(3.0, partial(periodic.periodic, "A", ("shear_8", "shear_12", "shear_20", "yaw20_10"))),
    CheckStudy(1.0, partial(yaw.yawed, "A")),
    CheckStudy(2.0, transient.gust),
    CheckStudy(2.0, transient.step),
    CheckStudy(4.0, stops.gusts),
    CheckStudy(3.0, stops.stops),
    CheckStudy(2.0, partial(turbulent.turbulence, "A")),
    CheckStudy(1.0, partial(turbulent.turbulence, "B")),
    CheckStudy(4.0, parked.parked),
    CheckStudy(2.0, parked.stalled),
    CheckStudy(1.0, parked.turbulent),
)
LAND: tuple[CheckStudy, ...] = (
    *QUICK,
    CheckStudy(2.0, partial(periodic.periodic, "B", ("shear_12", "yaw20_10"))),
    CheckStudy(1.0, partial(yaw.yawed, "B")),
    CheckStudy(5.0, parked.discretised),
)


def on_land(reference: Path | None) -> list[CheckStudy]:
    """With the complete series of a folder, ten minutes of turbulence beside the 45 s of the package, and a stop."""
    studies = [*LAND]
    if reference is not None:
        studies += [CheckStudy(10.0, partial(turbulent.turbulence, aero, reference)) for aero in "AB"]
        if (reference / "openfast_dlc").is_dir():
            studies.append(CheckStudy(2.0, partial(parked.turbulent, reference)))
        studies.append(CheckStudy(1.0, partial(stops.stops, reference)))
    return studies


def at_sea(reference: Path | None) -> list[CheckStudy]:
    """Monopile and floating platform; with the wind boxes of a folder in turbulence, too."""
    folder, rosco = reference and reference / "openfast_offshore", ("rosco", *WINDIO)
    windy = (
        [CheckStudy(10.0, partial(offshore_wind.turbulent, folder), "monopile in turbulence", rosco)] if folder else []
    )
    return [
        CheckStudy(60.0, offshore.frequencies, "frequencies on the monopile", rosco),
        CheckStudy(30.0, offshore.waves, "monopile in waves", rosco),
        CheckStudy(15.0, offshore_wind.steady, "monopile under ROSCO", rosco),
        *windy,
        CheckStudy(60.0, floating.floating, "floating platform", ("rosco",)),
        CheckStudy(40.0, partial(floating.in_wind, folder), "floating platform under ROSCO", ("rosco",)),
    ]
