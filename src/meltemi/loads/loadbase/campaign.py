"""A campaign: turbine, class, table and options of a load base, as a record and a YAML file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from meltemi.controllers.schemes import equipped, located, make_controller, settled
from meltemi.controllers.specification import (
    BaselineCase,
    ControllerCase,
    FixedCase,
    LibraryCase,
    NamedCase,
    PowerCase,
    PythonCase,
    SupervisedCase,
    check_files,
    description,
    rooted,
    supervised_form,
)
from meltemi.controllers.trial import try_controllers
from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.core.yamlfile import read_record, write_record
from meltemi.environment.site import Environment
from meltemi.frames.joints.geometry import tubular_joints
from meltemi.frames.joints.settings import JointSettings
from meltemi.iec.classes import WindClass, wind_class
from meltemi.loads.loadbase.metocean import Metocean
from meltemi.loads.loadbase.site import Site
from meltemi.loads.loadbase.table import AT_SEA, Defaults, LoadTable, Standard, load_table
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build, operating_point
from meltemi.supervisor.settings import Supervision, limits
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import aeroelastic

FILE = "campaign.yaml"
RATED = 0.998
"""Share of the power at cut-out that counts as rated power, to exclude small differences above rated wind speed."""
STEP = 0.1
"""Resolution [m/s] of the rated wind speed."""
NO_WIND = 1000.0
"""Limit [m/s] that no wind reaches."""


class Campaign(Record):
    """Description of a load base, from which the plan of its cases follows."""

    turbine: str
    """Name in the library, or path of a turbine file or an OpenFAST deck (.fst)."""
    edition: Literal[3, 4] = 4
    """Edition of IEC 61400-1."""
    standard: Standard = "61400-1"
    """IEC 61400-1; in the sea IEC 61400-3-1 for a turbine on a fixed support, IEC 61400-3-2 for one that floats."""
    wind_class: str | WindClass
    """Wind turbine class and turbulence category, e.g. IB, or one with user-defined values."""
    site: Site | None = None
    """Conditions of a site, instead of those of the class."""
    metocean: Metocean | None = None
    """Conditions of a site in the sea."""
    depth: float | None = Field(default=None, gt=0.0)
    """Water depth [m; 3 to 3000] at mean sea level, which limits embedded waves."""
    changes: dict[str, Any] = Field(default_factory=dict)
    """Changes of the table of the edition."""

    cut_in: float = Field(gt=0.0, le=100.0)
    """V_in [m/s; 1.5 to 6]."""
    rated_wind: float = Field(gt=0.0, le=100.0)
    """V_r [m/s; 6 to 20]: lowest wind speed with rated power."""
    cut_out: float = Field(gt=0.0, le=100.0)
    """V_out [m/s; 12 to 40]."""
    rotor_speed: float = Field(gt=0.0, le=10.0)
    """Rotor speed [rad/s; 0.3 to 30] at rated power; azimuths of gusts and events are fractions of its revolution."""
    blades: int = Field(default=3, ge=2, le=3)
    """Number of blades."""
    hub_height: float = Field(gt=0.0)
    """Hub height [m; 10 to 300], for reports."""
    rotor_diameter: float = Field(gt=0.0)
    """Rotor diameter [m; 5 to 350], for reports."""
    electrical_system: bool = False
    """Whether the turbine describes its electrical system; where one is needed and it does not, it is sized by rule."""

    controller: NamedCase = SupervisedCase(kind="supervised")
    """Controller, as in a case file. The supervised one is the baseline controller in production. A scheme has a
    supervisor, too, and receives its gains with the campaign."""
    idle_pitch: float = Field(gt=-1.6, lt=3.2)
    """Pitch angle [rad; 0.5 to 1.7] of idling and locked rotors."""
    normal_rate: float = Field(gt=0.0, le=2.0)
    """Pitch rate [rad/s; 0.01 to 0.8] of normal stops under controllers that do not follow requests of the operator."""
    emergency_rate: float = Field(gt=0.0, le=2.0)
    """Pitch rate [rad/s; 0.02 to 1] of emergency stops under such controllers, and after loss of the grid."""
    pitch_imbalance: float = Field(default=math.radians(0.3), ge=0.0, le=0.2)
    """Pitch imbalance [rad; 5e-4 to 0.05]: blade 1 is above, blade 2 below the pitch of their encoders by this, in
    operation."""
    mass_imbalance: float = Field(default=0.005, ge=0.0, le=0.2)
    """Mass imbalance [-; 5e-4 to 0.05]: share by which blade 1 is heavier than the others, in operation."""
    inclination: float = Field(default=math.radians(8.0), ge=-0.5, le=0.5)
    """Flow inclination [rad; 0.02 to 0.3] in operation."""
    extreme_wind: Literal["turbulent", "steady"] = "turbulent"
    """Form of the extreme wind speed model."""
    start_margin: float = Field(default=0.9, gt=0.0, le=1.0)
    """Start margin [-; 0.5 to 1]: a start is permitted from this share of V_in, and to V_out over it, so that it can be
    simulated at both."""
    wind_stops: bool = False
    """Whether the supervisor stops production in wind below cut-in and above cut-out. By default it continues, as the
    design situation demands; DLC 4.1 has these stops."""

    duration: float | None = Field(default=None, gt=0.0)
    """Evaluated duration [s; 30 to 4000], in place of the default of the table."""
    transient: float | None = Field(default=None, ge=0.0)
    """Initial transient [s; 10 to 2000], not evaluated, in place of the default of the table."""
    begin: float | None = Field(default=None, ge=0.0)
    """Time [s; 1 to 600] of gusts and events after the transient, in place of the default of the table."""
    seeds: int | None = Field(default=None, ge=1, le=1000)
    """Number of turbulence seeds, in place of the default of the table."""
    yaw_error: float | None = Field(default=None, ge=0.0, le=180.0)
    """Usual yaw error [deg; 1 to 30], in place of the default of the table."""
    v_maint: float | None = Field(default=None, gt=0.0, le=100.0)
    """V_maint [m/s; 4 to 30], in place of the default of the table."""
    years: float = Field(default=20.0, gt=0.0, le=1000.0)
    """Lifetime [years; 5 to 100]."""
    realisation: int = Field(default=1, ge=1)
    """Another number gives other seeds."""
    quick: bool = False
    """One seed, three speeds, one azimuth and instant, yaw sweeps in steps of 90 deg: for a first look."""
    joints: bool | JointSettings = False
    """Whether damage of the joints and utilisation of the members of the turbine's frame are evaluated, by default
    settings or these; :func:`make_campaign` asks for them where a frame has joints of tubes."""

    options: dict[str, Any] = Field(default_factory=dict)
    """Model options, as in a case file."""
    environment: Environment = Environment()
    """Air and gravity, as in a case file."""
    turbulence: dict[str, Any] = Field(default_factory=dict)
    """Settings of turbulent winds: spectrum, points and so on, as in a case file."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.cut_in < self.rated_wind < self.cut_out:
            speeds = f"{self.cut_in:g}, {self.rated_wind:g}, {self.cut_out:g} m/s"
            raise ValueError(f"speeds must satisfy cut_in < rated_wind < cut_out, found {speeds}")
        if isinstance(self.controller, BaselineCase | PowerCase) and self.controller.yaw is not None:
            raise ValueError("controller.yaw: yaw errors of load cases are constant; leave active yaw control out")
        if self.options.get("nacelle_yaw"):
            raise ValueError("options.nacelle_yaw: yaw errors of load cases are directions of the wind; leave it out")
        if isinstance(self.controller, FixedCase):
            raise ValueError("controller: fixed holds torque and pitch and cannot produce")
        if isinstance(self.wind_class, str):
            wind_class(self.wind_class, self.edition)
        elif self.wind_class.edition != self.edition:
            raise ValueError(f"wind_class: {self.wind_class.label} cannot be used with edition {self.edition}")
        if self.standard in AT_SEA and (self.metocean is None or self.depth is None or self.edition != 4):
            raise ValueError(f"standard {self.standard} needs metocean, depth and edition 4")
        if self.metocean is not None and (self.site is not None or self.depth is None):
            raise ValueError("metocean: it needs depth, and excludes site")
        ModelOptions.model_validate(self.options)
        return self

    @property
    def iec_class(self) -> WindClass:
        """Wind turbine class of the campaign, or of its site."""
        if self.site is not None:
            return self.site.wind_class(self.edition)
        return wind_class(self.wind_class, self.edition) if isinstance(self.wind_class, str) else self.wind_class

    @property
    def turbine_name(self) -> str:
        """Name of the turbine, also where ``turbine`` is the path of its file."""
        return load_turbine(self.turbine).name

    @property
    def where(self) -> str:
        """Name of the site, or of the class without one."""
        site = self.site or self.metocean
        return site.name if site is not None else f"class {self.iec_class.name}"

    def table(self) -> LoadTable:
        """The table of the edition with the changes of the campaign.

        Raises:
          InputError: the changes are not valid.
        """
        return load_table(self.standard if self.standard in AT_SEA else self.edition, self.changes, "changes")

    def defaults(self, table: LoadTable) -> Defaults:
        """Defaults of the table, replaced by those of the campaign."""
        names = [name for name in Defaults.model_fields if name != "practice"]
        given = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        return table.defaults.replace(**given)

    def symbols(self, table: LoadTable) -> dict[str, float]:
        """Values of the names in the texts of the table."""
        defaults = self.defaults(table)
        return {
            "V_in": self.cut_in,
            "V_r": self.rated_wind,
            "V_out": self.cut_out,
            "V_ref": self.iec_class.v_ref,
            "V_maint": defaults.v_maint,
            "yaw_error": defaults.yaw_error,
        }


def make_campaign(
    turbine: str | Path,
    wind_class: str | WindClass = "IB",
    edition: int = 4,
    *,
    rated_wind: float | None = None,
    **settings: Any,
) -> Campaign:
    """Describe the load base of a turbine.

    Args:
      turbine: name in the library, or path of a turbine file or an OpenFAST deck (.fst).
      wind_class: wind turbine class of IEC 61400-1, or a user-defined one.
      edition: edition of IEC 61400-1: 3 or 4.
      rated_wind: [m/s] rated wind speed; by default from steady operation, to 0.1 m/s.
      settings: further fields of a :class:`Campaign`.

    Raises:
      InputError: no such turbine, class or setting; or speeds that do not ascend; or a supervisor that cannot start and
        stop the turbine.
    """
    path = Path(turbine)
    data: dict[str, Any] = {"turbine": str(path.absolute()) if path.is_file() else str(turbine)}
    if path.suffix.lower() == ".fst":
        from meltemi.exchange.openfast import read_deck

        deck = read_deck(path)
        described, data["options"], data["environment"] = deck.turbine, deck.options, deck.environment
        for name in ("yaw", "nacelle_yaw"):  # yaw errors are those of the load cases
            data["options"].pop(name, None)
    else:
        described = aeroelastic(load_turbine(turbine), "meltemi loads")
    described = aeroelastic(described, "meltemi loads")
    load_table(edition)  # reports an unknown edition first
    data |= {
        "edition": edition,
        "wind_class": wind_class,
        "cut_in": described.cut_in,
        "cut_out": described.cut_out,
        "blades": described.n_blades,
        "hub_height": described.hub_height,
        "rotor_diameter": described.rotor_diameter,
        "electrical_system": described.electrical is not None,
    }
    for below in described.substructures:
        data["depth"] = below.depth
    data["joints"] = described.frame is not None and bool(tubular_joints(described.frame))
    data |= settings
    if (standard := data.get("standard")) in AT_SEA:
        stands = described.frame is not None and described.platform is None
        if getattr(described, AT_SEA[standard]) is None and not (stands and AT_SEA[standard] == "support"):
            like = {"support": "iea15mw-monopile", "platform": "iea15mw-volturnus"}[AT_SEA[standard]]
            raise InputError(
                f"standard {standard}: {turbine} has no {AT_SEA[standard]}; choose a turbine that has one, such as "
                f"{like}, or give it one (turbine.{AT_SEA[standard]})"
            )
        if data.get("metocean") is None:
            raise InputError(f"standard {standard} needs the conditions of the site (metocean)")
        data.setdefault("inclination", 0.0)
    stops = limits(described, Supervision())
    derived = {"rotor_speed": described.rated_rotor_speed, "idle_pitch": described.control.pitch.maximum}
    derived |= {name: round(stops[name], 9) for name in ("normal_rate", "emergency_rate")}
    # everything but the rated wind speed is tested before it is computed
    middle = 0.5 * (described.cut_in + described.cut_out) if rated_wind is None else rated_wind
    if rated_wind is None and all(isinstance(data[name], int | float) for name in ("cut_in", "cut_out")):
        middle = 0.5 * (data["cut_in"] + data["cut_out"])
    campaign = Campaign(**(derived | data | {"rated_wind": middle}))
    if {"cut_in", "cut_out"} & settings.keys() and isinstance(campaign.controller, SupervisedCase):
        campaign = _with_winds(campaign, described)
    campaign = campaign.replace(controller=rooted(located(campaign.controller, described), Path()))
    check_files(campaign.controller)
    for case in (campaign.controller, start_controller(campaign)):
        if isinstance(case, SupervisedCase):
            limits(described, case.supervision)
    campaign.table()
    if rated_wind is None:
        model = build(described, ModelOptions(**campaign.options), campaign.environment)
        campaign = campaign.replace(rated_wind=rated_wind_speed(model, campaign.cut_in, campaign.cut_out))
    return campaign.replace(controller=_ready(campaign, described))


def _ready(campaign: Campaign, turbine: Turbine) -> ControllerCase:
    """Controller with the gains of its scheme for the equipped turbine; it is tried for a few steps."""
    case = campaign.controller
    if isinstance(case, BaselineCase) and (case.scheme or case.load):
        case = supervised_form(case) or case
    scheme = getattr(case, "scheme", None)
    if scheme is None and not isinstance(case, LibraryCase | PythonCase):
        return case
    model = build(equipped(turbine, [scheme or ""]), ModelOptions(**campaign.options), campaign.environment)
    case = settled(case, model)
    try_controllers({description(case): make_controller(case, model)}, model)
    return case


def _with_winds(campaign: Campaign, turbine: Turbine) -> Campaign:
    """The campaign with a supervisor for the cut-in and cut-out of the campaign."""
    assert isinstance(campaign.controller, SupervisedCase)
    winds = limits(turbine.replace(cut_in=campaign.cut_in, cut_out=campaign.cut_out), campaign.controller.supervision)
    names = "start_wind stop_wind cut_out_mean cut_out_wind cut_out_gust restart_wind".split()
    return campaign.replace(**{f"controller.supervision.{name}": round(winds[name], 6) for name in names})


def rated_wind_speed(model: Any, cut_in: float, cut_out: float) -> float:
    """Lowest wind speed [m/s] with rated power in steady operation, to 0.1 m/s.

    Raises:
      InputError: the power at cut-out is not that below it.
    """

    def power(speed: float) -> float:
        return float(operating_point(model, speed)["generator_power"])

    rated = RATED * power(cut_out)
    low, high = math.floor(cut_in / STEP), math.ceil(cut_out / STEP)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if power(middle * STEP) >= rated else (middle, high)
    rated_wind = round(high * STEP, 1)
    if not cut_in < rated_wind < cut_out - STEP:
        raise InputError(
            f"the power of {model.turbine.name} still rises at cut-out, {cut_out:g} m/s: specify the rated wind speed"
        )
    return rated_wind


def production_controller(campaign: Campaign) -> ControllerCase:
    """Controller of production; a supervisor without stops for the wind unless ``wind_stops``."""
    c = campaign.controller
    if campaign.wind_stops or not isinstance(c, SupervisedCase):
        return c
    beyond = dict.fromkeys(("cut_out_mean", "cut_out_wind", "cut_out_gust"), NO_WIND)
    return c.replace(supervision=c.supervision.replace(stop_wind=0.0, **beyond))


def start_controller(campaign: Campaign) -> SupervisedCase | None:
    """Controller of starts and stops; None if the campaign's controller cannot start and stop the turbine.

    A start is permitted at V_in and V_out, where a turbine in service would wait.
    """
    c = campaign.controller
    case = supervised_form(c)
    if case is None:
        return None
    least, most = campaign.start_margin * campaign.cut_in, campaign.cut_out / campaign.start_margin
    winds = {"start_wind": least, "stop_wind": 0.8 * least, "restart_wind": most}
    winds |= {"cut_out_mean": 1.05 * most, "cut_out_wind": 1.2 * most, "cut_out_gust": 1.4 * most}
    supervision = case.supervision.replace(**{name: round(value, 6) for name, value in winds.items()})
    return case.replace(supervision=supervision)


def read_campaign(folder: str | Path) -> Campaign:
    """Read the campaign of a load base.

    Args:
      folder: folder of the load base, or its ``campaign.yaml``.

    Raises:
      InputError: there is no campaign, or it is not valid.
    """
    path = Path(folder)
    file = path if path.is_file() else path / FILE
    if not file.is_file():
        raise InputError(
            f"{path}: no load base, since it has no {FILE}; 'meltemi loads plan TURBINE --out FOLDER' writes one"
        )
    campaign = read_record(file, Campaign)
    campaign.table()
    return campaign


def write_campaign(campaign: Campaign, folder: str | Path) -> Path:
    """Write ``campaign.yaml``.

    Raises:
      InputError: the file cannot be written.
    """
    path = Path(folder) / FILE
    write_record(campaign, path)
    return path
