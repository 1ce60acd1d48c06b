"""A load case: turbine, wind, duration and channels, as a record and as a YAML file."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from meltemi.control.baseline import parameters, steady_torque
from meltemi.control.controller import Controller
from meltemi.controllers.schemes import fitted, make_controller
from meltemi.controllers.specification import (
    BaselineCase,
    FixedCase,
    LibraryCase,
    NamedCase,
    SupervisedCase,
    rooted,
)
from meltemi.core.deferred import deferred
from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.core.yamlfile import read_record
from meltemi.electrical.system import size_electrical
from meltemi.environment.grid import PowerGrid
from meltemi.environment.site import Environment
from meltemi.iec.classes import WindClass
from meltemi.iec.models import IecWind, iec_wind
from meltemi.simulation.channels import DEFAULT
from meltemi.simulation.events import BaseEvent, Event, conflict
from meltemi.simulation.model import Model, Stations
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.start import Start
from meltemi.supervisor.settings import limits
from meltemi.turbine.icing import Icing, with_ice
from meltemi.turbine.imbalance import Imbalance
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import AnyTurbine, aeroelastic
from meltemi.wind.fields import SteadyWind, WindSeries
from meltemi.wind.turbulent import AnyWind, TurbulentWind
from meltemi.wind_files import Hawc2Grid, read_hub_csv
from meltemi.wind_files.formats import read_wind

if TYPE_CHECKING:
    from meltemi.environment import Sea
else:
    Sea = deferred("meltemi.sea.kinds", "AnySea")


class SteadyCase(SteadyWind):
    """Constant wind with shear."""

    kind: Literal["steady"] = "steady"


class TurbulenceCase(TurbulentWind):
    """Turbulent wind, with a field generated for the turbine."""

    kind: Literal["turbulence"] = "turbulence"
    hub_file: str | None = None
    """Path of a CSV file with measured hub-height wind, relative to the case file."""


class IecCase(Record):
    """A wind model of IEC 61400-1 by name."""

    kind: Literal["iec"] = "iec"
    model: str
    """NTM, ETM, EWM1, EWM50, NWP, EOG, EDC, ECD, ECG, EWSH or EWSV."""
    wind_class: str | WindClass | None = None
    """Class and turbulence category, e.g. IIB, or a class with user-defined values: name, v_ref, i_ref and so on."""
    edition: Literal[2, 3, 4] | None = None
    """Edition of the standard; 3 by default."""
    speed: float | None = Field(default=None, gt=0.0, le=100.0)
    """[m/s; 1 to 80] speed at hub height; EWM uses that of its class."""
    sign: Literal[1, -1] | None = None
    """Sign of a direction change or shear."""
    begin: float | None = None
    """[s; 1 to 3600] start of a gust; 60 by default."""
    years: Literal[1, 50] | None = None
    """Recurrence period of the gusts of edition 2."""
    intensity: float | None = None
    """Turbulence intensity [-; 0.01 to 1], in place of that of the class."""
    steady: bool | None = None
    """EWM: steady instead of turbulent."""
    seed: int | None = None
    """Seed of the turbulence."""
    direction: float | None = Field(default=None, ge=-7.0, le=7.0)
    """[rad] clockwise from above."""
    upflow: float = Field(default=0.0, gt=-1.0, lt=1.0)
    """[rad] inclination of the flow, upwards when positive."""
    turbulence: dict[str, Any] = Field(default_factory=dict)
    """Other settings of turbulence: spectrum, coherent, shear_exponent, points and so on."""


class FileCase(Record):
    """A wind file of any format (docs/guide/wind-files.md)."""

    kind: Literal["file", "bts", "wnd"]
    """All three read any of these files."""
    file: str
    """Path, relative to the case file."""
    grid: Hawc2Grid | None = None
    """Grid of a HAWC2 turbulence box without its ``.hawc2.yaml``."""
    direction: float = Field(default=0.0, ge=-7.0, le=7.0)
    """[rad] angle, clockwise from above, by which the wind of the file is rotated about the tower."""


class StartCase(Record):
    """Initial state: parked, idling or rotating, in equilibrium with mean wind and gravity, or undeflected."""

    rotor_speed: Annotated[float, Field(ge=-10.0, le=10.0)] | Literal["idling"] = 0.0
    """[rad/s]; 0 is standstill, ``idling`` the equilibrium of a free rotor: at rest at the azimuth where its torque
    balances, or at the speed where the mean torque does. ``options: {locked: [generator]}`` holds the rotor."""
    pitch: float | None = Field(default=None, gt=-1.6, lt=3.2)
    """[rad]; by default the pitch actuator's largest, feathered."""
    azimuth: float = Field(default=0.0, ge=-7.0, le=7.0)
    """[rad] azimuth of blade 1, 0 when it points up."""
    undeflected: bool = False
    """Blades and tower straight and at rest, and the generator's torque that of the baseline law, as OpenFAST begins;
    for a rotor that turns, under any controller."""
    coordinates: dict[str, float] = Field(default_factory=dict)
    """[m, rad] coordinates that are not zero, with ``undeflected: true``; ``platform_pitch: 0.1`` for a decay."""

    @model_validator(mode="after")
    def _speed_is_given(self) -> StartCase:
        if self.undeflected and self.rotor_speed == "idling":
            raise ValueError("rotor_speed: idling is an equilibrium; with undeflected: true specify a number [rad/s]")
        if self.coordinates and not self.undeflected:
            raise ValueError("coordinates: are those of a turbine that is not in equilibrium; add undeflected: true")
        return self


WindCase = Annotated[SteadyCase | TurbulenceCase | IecCase | FileCase, Field(discriminator="kind")]


def _within(event: BaseEvent, info: ValidationInfo) -> BaseEvent:
    """Validate events here, and not in the case, so that messages name the line of the event."""
    duration = info.data.get("duration", math.inf)
    if event.at >= duration:
        raise ValueError(f"at {event.at:g} s is not before the end of the run at {duration:g} s (duration)")
    return event


class LoadCase(Record):
    """Complete description of one simulation."""

    turbine: str
    """Name in the library or path of a YAML file."""
    wind: WindCase
    controller: NamedCase = BaselineCase()
    start: Literal["operating", "standstill", "idling"] | StartCase = "operating"
    """Initial state: steady operation; or a free, feathered rotor that starts in suitable wind (``standstill``) or
    idles until the operator requests a start (``idling``), both with the supervised controller; or a parked rotor, with
    the supervised, bladed or fixed one; or that of OpenFAST (``undeflected``), with any controller."""
    duration: float = Field(gt=0.0, le=1e6)
    """[s; 1 to 1e5] duration."""
    channels: tuple[str, ...] = tuple(DEFAULT)
    """Channels to record, by meltemi's or OpenFAST's names; "all" records all of them, * is any text."""
    output_step: float = Field(default=0.05, gt=0.0, le=10.0)
    """[s; 0.001 to 2] interval of the records."""
    transient: float = Field(default=0.0, ge=0.0)
    """[s; 1 to 3600] initial transient; statistics and equivalent loads exclude it."""
    view: bool = False
    """Record the motion for the three-dimensional view (`meltemi view`)."""
    blade_stations: tuple[float, ...] = ()
    """[m] stations of blade loads from the root."""
    tower_stations: tuple[float, ...] = ()
    """[m] stations of tower loads above the base."""
    events: tuple[Annotated[Event, AfterValidator(_within)], ...] = ()
    """Faults, grid losses and operator requests."""
    options: ModelOptions = ModelOptions()
    environment: Environment = Environment()
    grid: PowerGrid = PowerGrid()
    """Voltage, frequency, reactive power, and power reference for controllers that follow it."""
    sea: Sea | None = None
    """Waves and current around the turbine's support; by default still water."""
    icing: Icing | None = None
    """Ice on the blades, in place of that of the turbine file."""
    imbalance: Imbalance | None = None
    """Differences between the blades, in place of those of the turbine file."""
    electrical: Literal["sized"] | None = None
    """``sized``: generator, converters and grid connection by rule, in place of what the turbine's file may have; used
    with options: {electrical: averaged}."""

    @property
    def label(self) -> str:
        """Turbine, wind and duration in one line."""
        wind = self.wind
        words = [str(getattr(wind, name)) for name in ("kind", "model") if getattr(wind, name, None)]
        speed = getattr(wind, "speed", None)
        return f"{self.turbine}, {' '.join(words)} wind{f' {speed:g} m/s' if speed else ''}, {self.duration:g} s"

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.channels:
            raise ValueError("channels: name at least one")
        if words := conflict(self.events):
            raise ValueError(words)
        if self.transient >= self.duration:
            raise ValueError(f"transient {self.transient:g} s leaves nothing of a duration of {self.duration:g} s")
        if self.electrical is not None and self.options.electrical == "ideal":
            raise ValueError(
                f"electrical: {self.electrical} has no effect without an electrical system; "
                "set options.electrical: averaged"
            )
        parked = isinstance(self.start, str) or not self.start.undeflected
        if self.start != "operating" and parked and not isinstance(self.controller, SupervisedCase):
            if isinstance(self.start, str):
                raise ValueError(
                    f"start: {self.start} needs a controller that can start the turbine: "
                    "controller: {kind: supervised}"
                )
            if not isinstance(self.controller, LibraryCase | FixedCase):
                raise ValueError(
                    f"start: a parked rotor would be accelerated by controller: {{kind: {self.controller.kind}}}; "
                    "controller: {kind: fixed} keeps it parked, {kind: supervised} idling; "
                    "a rotating one starts with any controller with undeflected: true, as in OpenFAST"
                )
        if self.grid.power_reference is not None and isinstance(self.controller, BaselineCase | SupervisedCase):
            raise ValueError(
                f"grid: power_reference is given, but controller: {{kind: {self.controller.kind}}} does not follow it: "
                "controller: {kind: power} does"
            )
        return self


def read_case(path: str | Path) -> LoadCase:
    """Read a load case from a YAML file.

    Raises:
      InputError: with file, line, key and remedy.
    """
    return read_record(path, LoadCase)


def case_turbine(case: LoadCase, folder: Path) -> AnyTurbine:
    """The turbine of a case, including ice and electrical system; paths are relative to ``folder``."""
    beside = folder / case.turbine
    turbine = load_turbine(beside if beside.is_file() else case.turbine)
    if case.icing is not None:
        turbine = with_ice(aeroelastic(turbine, "icing"), case.icing)
    turbine = fitted(turbine, case.controller)
    if case.imbalance is not None:
        turbine = aeroelastic(turbine, "imbalance").replace(imbalance=case.imbalance)
    if case.electrical == "sized":
        law = turbine.control
        turbine = turbine.replace(electrical=size_electrical(law.torque.rated_power, law.pitch.reference_speed))
    return turbine


def self_contained(case: LoadCase, folder: Path) -> LoadCase:
    """The case with absolute paths, so that it can be run from any folder."""
    changes: dict[str, str] = {}
    if (folder / case.turbine).is_file():
        changes["turbine"] = str((folder / case.turbine).absolute())
    if isinstance(case.wind, FileCase):
        changes["wind.file"] = str((folder / case.wind.file).absolute())
    if isinstance(case.wind, TurbulenceCase) and case.wind.hub_file is not None:
        changes["wind.hub_file"] = str((folder / case.wind.hub_file).absolute())
    return case.replace(controller=rooted(case.controller, folder), **changes)


def case_controller(case: LoadCase, model: Model[Any], folder: Path, kept: Path | None = None) -> Controller | None:
    """The controller of a case, None for the plain baseline one; paths are relative to ``folder``.

    A controller library has its working folder in ``kept``; without it, it has a temporary one.
    """
    c = case.controller
    if c == BaselineCase():
        return None
    if isinstance(c, SupervisedCase) and case.start in ("standstill", "idling"):
        c = c.replace(**{"supervision.begin": "standby" if case.start == "standstill" else "idling"})
    return make_controller(c, model, folder=folder, kept=kept)


def case_start(case: LoadCase, turbine: AnyTurbine) -> Start | None:
    """The initial state of a case; None for steady operation."""
    if case.start == "operating":
        return None
    feather = turbine.pitch_actuator.maximum
    if isinstance(case.controller, SupervisedCase):
        feather = limits(turbine, case.controller.supervision)["feather"]
    if isinstance(case.start, str):
        return Start(rotor_speed="idling", pitch=feather)
    pitch = feather if case.start.pitch is None else case.start.pitch
    speed, azimuth = case.start.rotor_speed, case.start.azimuth
    if case.start.undeflected and speed != "idling":
        torque = float(steady_torque(parameters(turbine.control), speed * turbine.drivetrain.gear_ratio, pitch))
        return Start(speed, pitch, torque, coordinates=case.start.coordinates, azimuth=azimuth)
    return Start(speed, pitch, azimuth=azimuth)


def case_wind(case: LoadCase, turbine: AnyTurbine, folder: Path) -> AnyWind:
    """The wind of a case; paths are relative to ``folder``."""
    w = case.wind
    if isinstance(w, SteadyCase):
        return SteadyWind(**w.model_dump(exclude={"kind"}))
    if isinstance(w, TurbulenceCase):
        measured = {} if w.hub_file is None else {"hub_series": read_hub_csv(folder / w.hub_file)}
        return TurbulentWind(**(w.model_dump(exclude={"kind", "hub_file"}) | measured))
    if isinstance(w, IecCase):
        given = w.model_dump(exclude={"kind", "turbulence", "upflow", "wind_class"}, exclude_none=True)
        if w.wind_class is not None:
            given["wind_class"] = w.wind_class
        if twice := given.keys() & w.turbulence.keys():
            raise InputError(f"wind.turbulence: {', '.join(sorted(twice))} is given twice")
        return inclined(iec_wind(turbine=turbine, **given, **w.turbulence), w.upflow)
    wind = read_wind(folder / w.file, w.grid)
    if isinstance(wind, WindSeries):
        return wind.replace(direction=wind.direction + w.direction)
    return replace(wind, direction=math.remainder(wind.direction + w.direction, 2.0 * math.pi))


def inclined(wind: IecWind, upflow: float) -> IecWind:
    """A wind with an inclination [rad]; of a series it turns the speed at the reference height and the gust up."""
    if not upflow:
        return wind
    if isinstance(wind, WindSeries):
        return wind.replace(vertical=wind.vertical + math.tan(upflow) * (wind.speed + wind.gust))
    return wind.replace(upflow=upflow)


def case_run(
    case: LoadCase,
    turbine: AnyTurbine,
    folder: Path,
    kept: Path | None = None,
    model: Model[Any] | None = None,
    controller: Controller | None = None,
) -> Run:
    """The arguments of :func:`simulate` of a case; paths are relative to ``folder``, ``kept`` as for the controller.

    ``model`` is that of the turbine with the case's options and environment, and ``controller`` that of the case, if
    they exist already.
    """
    same = ("duration", "channels", "output_step", "transient", "view", "events", "grid", "sea")
    model = model or build(turbine, case.options, case.environment)
    return Run(
        model,
        case_wind(case, turbine, folder),
        controller=controller or case_controller(case, model, folder, kept),
        start=case_start(case, turbine),
        stations=Stations(case.blade_stations, case.tower_stations),
        **{name: getattr(case, name) for name in same},
    )
