"""A load case: turbine, wind, duration, and what to record, as a record and as a YAML file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, Self

from pydantic import Field, model_validator

from meltemi.core.record import Record
from meltemi.core.yamlfile import read_record
from meltemi.environment.site import Environment
from meltemi.simulation.channels import DEFAULT
from meltemi.simulation.options import ModelOptions
from meltemi.turbine.library import load_turbine
from meltemi.wind.fields import SteadyWind
from meltemi.wind.files import read_bts, read_wnd
from meltemi.wind.turbulence import AnyWind
from meltemi.wind.turbulent import TurbulentWind

if TYPE_CHECKING:
    from meltemi.turbine.definition import Turbine


class SteadyCase(Record):
    """Constant wind with shear."""

    kind: Literal["steady"] = "steady"
    speed: float = Field(gt=0.0, le=100.0)
    """[m/s] at hub height."""
    shear_exponent: float = Field(default=0.0, gt=-1.0, lt=1.0)
    roughness: float = Field(default=0.0, ge=0.0, lt=10.0)
    """[m]; logarithmic profile instead of the power law when above zero."""
    direction: float = Field(default=0.0, ge=-3.2, le=3.2)
    """[rad] clockwise from above."""
    veer: float = Field(default=0.0, gt=-0.1, lt=0.1)
    """[rad/m]."""
    upflow: float = Field(default=0.0, gt=-1.0, lt=1.0)
    """[rad]."""


class TurbulenceCase(TurbulentWind):
    """A turbulent field made for the turbine."""

    kind: Literal["turbulence"] = "turbulence"


class FileCase(Record):
    """A wind file: TurbSim full field (.bts) or uniform wind (.wnd)."""

    kind: Literal["bts", "wnd"]
    file: str
    """Path, relative to the case file."""


WindCase = Annotated[SteadyCase | TurbulenceCase | FileCase, Field(discriminator="kind")]


class LoadCase(Record):
    """One simulation, completely described."""

    turbine: str
    """Name in the library or path of a YAML file."""
    wind: WindCase
    duration: float = Field(gt=0.0, le=1e6)
    """[s]."""
    channels: tuple[str, ...] = tuple(DEFAULT)
    """What to record, by our names or OpenFAST's; "all" records everything."""
    output_step: float = Field(default=0.05, gt=0.0, le=10.0)
    """[s] between records."""
    blade_stations: tuple[float, ...] = ()
    """[m] from the blade root: further places for section loads."""
    tower_stations: tuple[float, ...] = ()
    """[m] above the tower base: further places for section loads."""
    options: ModelOptions = ModelOptions()
    environment: Environment = Environment()

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.channels:
            raise ValueError("channels: name at least one")
        return self


def read_case(path: str | Path) -> LoadCase:
    """Read a load case from a YAML file.

    Raises:
      InputError: with file, line, key and remedy.
    """
    return read_record(path, LoadCase)


def case_turbine(case: LoadCase, folder: Path) -> Turbine:
    """The turbine of a case; paths are relative to ``folder``."""
    beside = folder / case.turbine
    return load_turbine(beside if beside.is_file() else case.turbine)


def self_contained(case: LoadCase, folder: Path) -> LoadCase:
    """The case with absolute paths, so that it can be run from any folder."""
    changes: dict[str, str] = {}
    if (folder / case.turbine).is_file():
        changes["turbine"] = str((folder / case.turbine).absolute())
    if isinstance(case.wind, FileCase):
        changes["wind.file"] = str((folder / case.wind.file).absolute())
    return case.replace(**changes)


def case_wind(case: LoadCase, turbine: Turbine, folder: Path) -> AnyWind:
    """The wind of a case; paths are relative to ``folder``."""
    w = case.wind
    if isinstance(w, SteadyCase):
        return SteadyWind(**w.model_dump(exclude={"kind"}))
    if isinstance(w, TurbulenceCase):
        return TurbulentWind(**w.model_dump(exclude={"kind"}))
    return (read_bts if w.kind == "bts" else read_wnd)(folder / w.file)


TEMPLATE = """\
# A load case of meltemi: run it with   meltemi run CASE.yaml --out FOLDER
# Units are SI: m, s, rad. Everything below `duration` may be left out.
turbine: nrel5mw             # a name from `meltemi turbines`, or the path of a .yaml file

wind:
  kind: turbulence           # or: steady, bts, wnd
  speed: 12.0                # m/s, mean at hub height
  intensity: 0.14            # standard deviation over mean
  seed: 1                    # the same seed gives the same field
  shear_exponent: 0.2        # of the mean wind
# wind: {kind: steady, speed: 12.0, shear_exponent: 0.2, direction: 0.0}
# wind: {kind: bts, file: field.bts}
# wind: {kind: wnd, file: gust.wnd}

duration: 60.0               # s

output_step: 0.05            # s between records
channels:                    # `meltemi channels` lists them; OpenFAST's names are understood
  - wind_x
  - rotor_speed
  - azimuth
  - pitch_1
  - generator_power
  - RootMyc1
  - RootMxc1
  - TwrBsMyt
  - tip_out_of_plane_1

blade_stations: [20.0, 40.0] # m from the root: section loads there are channels station_1_..., station_2_...
tower_stations: [43.8]       # m above the base

options:                     # docs: options; defaults are shown
  flap_modes: 2              # modes of each blade
  edge_modes: 1
  torsion_modes: 1
  fore_aft_modes: 2          # modes of the tower
  side_side_modes: 2
  locked: []                 # e.g. [yaw, drivetrain]
  blade_nodes: 20
  inflow: variable           # variable, constant, quasi_steady
  stall: hansen              # hansen, static
  skew: glauert              # glauert, none
  tower_influence: potential # potential, lower_half, none
  tower_drag: true

environment:
  air_density: 1.225         # kg/m^3
  gravity: 9.80665           # m/s^2
"""
"""What ``meltemi template case`` writes."""
