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
from meltemi.verification.table import Study
from meltemi.verification.verification import WINDIO

QUICK: tuple[Study, ...] = (
    Study(2.0, decays.decays),
    Study(1.0, elastodyn_blade.discretisation),
    Study(3.0, rigid.fixed_rotor),
    Study(1.0, rigid.spin),
    Study(2.0, rigid.pitch_steps),
    Study(3.0, partial(periodic.periodic, "A", ("shear_8", "shear_12", "shear_20", "yaw20_10"))),
    Study(1.0, partial(yaw.yawed, "A")),
    Study(2.0, transient.gust),
    Study(2.0, transient.step),
    Study(4.0, stops.gusts),
    Study(3.0, stops.stops),
    Study(2.0, partial(turbulent.turbulence, "A")),
    Study(1.0, partial(turbulent.turbulence, "B")),
    Study(4.0, parked.parked),
    Study(2.0, parked.stalled),
    Study(1.0, parked.turbulent),
)
LAND: tuple[Study, ...] = (
    *QUICK,
    Study(2.0, partial(periodic.periodic, "B", ("shear_12", "yaw20_10"))),
    Study(1.0, partial(yaw.yawed, "B")),
    Study(5.0, parked.discretised),
)


def on_land(reference: Path | None) -> list[Study]:
    """With the complete series of a folder, ten minutes of turbulence beside the 45 s of the package, and a stop."""
    studies = [*LAND]
    if reference is not None:
        studies += [Study(10.0, partial(turbulent.turbulence, aero, reference)) for aero in "AB"]
        if (reference / "openfast_dlc").is_dir():
            studies.append(Study(2.0, partial(parked.turbulent, reference)))
        studies.append(Study(1.0, partial(stops.stops, reference)))
    return studies


def at_sea(reference: Path | None) -> list[Study]:
    """Monopile and floating platform; with the wind boxes of a folder in turbulence, too."""
    folder, rosco = reference and reference / "openfast_offshore", ("rosco", *WINDIO)
    windy = [Study(10.0, partial(offshore_wind.turbulent, folder), "monopile in turbulence", rosco)] if folder else []
    return [
        Study(60.0, offshore.frequencies, "frequencies on the monopile", rosco),
        Study(30.0, offshore.waves, "monopile in waves", rosco),
        Study(15.0, offshore_wind.steady, "monopile under ROSCO", rosco),
        *windy,
        Study(60.0, floating.floating, "floating platform", ("rosco",)),
        Study(40.0, partial(floating.in_wind, folder), "floating platform under ROSCO", ("rosco",)),
    ]
