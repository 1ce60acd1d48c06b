"""Common data of the files of a deck: the turbine with its models, units, output channels, and notes."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from meltemi.core.series import TimeSeries
from meltemi.environment.site import Environment
from meltemi.exchange.report import Notes
from meltemi.floating.platform import Platform
from meltemi.frames.definition import Frame
from meltemi.sea.support import Support
from meltemi.simulation.bladed.build import blade_modes
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.structure.members import ModalMember, blade_member
from meltemi.turbine.definition import Turbine

Texts = dict[str, str]
"""Texts of files, by their paths in the deck."""
RPM, DEGREES = 30.0 / math.pi, 180.0 / math.pi
OUTPUTS = {
    "ElastoDyn": (
        "RotSpeed GenSpeed BldPitch1 Azimuth OoPDefl1 IPDefl1 TipDxb1 TipDyb1 TTDspFA TTDspSS "
        "RootMxc1 RootMyc1 RootMzc1 RootMxb1 RootMyb1 "
        "RotThrust RotTorq LSSTipMys LSSTipMzs TwrBsMxt TwrBsMyt TwrBsMzt YawBrMzp"
    ),
    "AeroDyn": "RtAeroFxh RtAeroMxh RtAeroCp RtAeroCt RtTSR",
    "ServoDyn": "GenPwr GenTq",
    "InflowWind": "Wind1VelX Wind1VelY Wind1VelZ",
    "BeamDyn": "TipTDxr TipTDyr TipRDzr RootMxr RootMyr",
}
"""Output channels; meltemi's catalogue contains them under these names."""


class DeckNotes(Notes):
    """Notes on features of a turbine, by its name, that a deck lacks or approximates."""

    def __init__(self, turbine: str) -> None:
        super().__init__()
        self.turbine = turbine

    def lost(self, what: str, why: str) -> None:
        """Note a feature that the deck lacks."""
        self.add("ignored", self.turbine, what, why)

    def changed(self, what: str, why: str) -> None:
        """Note a feature that the deck approximates."""
        self.add("approximated", self.turbine, what, why)


@dataclass(frozen=True)
class ExportModel:
    """Turbine to be exported, with its models.

    Attributes:
      turbine, options, environment: arguments of the caller.
      modes: number of blade modes by kind.
      model: model with the default options.
      member: a blade with its first modes.
    """

    turbine: Turbine
    options: ModelOptions
    environment: Environment
    modes: dict[str, int]
    model: BladedModel
    member: ModalMember

    @property
    def name(self) -> str:
        """Name of the main file."""
        return re.sub(r"[^\w.-]+", "_", self.turbine.name)

    @property
    def title(self) -> str:
        """Title line of each file."""
        return self.turbine.description or self.turbine.name

    @property
    def at_sea(self) -> bool:
        """Whether the turbine stands or floats in water."""
        return self.below is not None

    @property
    def below(self) -> Support | Frame | Platform | None:
        """What the tower stands on in the water."""
        return next(iter(self.turbine.substructures), None)

    @property
    def stands(self) -> bool:
        """Whether this stands on the sea bed."""
        return self.at_sea and self.turbine.platform is None


def deck_of(turbine: Turbine, options: ModelOptions, environment: Environment) -> ExportModel:
    """Prepare the models for the export of a turbine.

    Raises:
      UnsupportedError: the turbine cannot be modelled.
    """
    model: BladedModel = build(turbine)
    counts = {"flap": 1, "edge": 1, "torsion": int(turbine.blade.structure.twists)}
    member = blade_member(turbine.blade.structure, counts, model.rotor.blade_layout)
    return ExportModel(turbine, options, environment, blade_modes(turbine, options), model, member)


def limits(deck: ExportModel, notes: DeckNotes) -> None:
    """Note features of the turbine that no file of a deck can represent."""
    t, o, air = deck.turbine, deck.options, deck.environment.air
    weather = air and any(isinstance(q, TimeSeries) for q in (air.temperature, air.humidity, air.pressure))
    nacelle = t.nacelle.roll_inertia or t.nacelle.nod_inertia
    speeds = (t.cut_in, t.cut_out) != (3.0, 25.0)
    tower = t.tower.torsion_stiffness is not None or t.tower.axial_stiffness is not None
    blade_modes = deck.modes["flap"] > 2 or deck.modes["edge"] > 1
    tower_modes = o.fore_aft_modes > 2 or o.side_side_modes > 2
    for present, what, why in (
        (t.foundation is not None and not deck.at_sea, "foundation", "the tower is clamped; SubDyn is not written"),
        (t.mass_dampers, "mass dampers", "StC files are not written"),
        (nacelle, "roll and nod inertia of the nacelle", "only yaw inertia"),
        (t.blade.flaps, "trailing-edge flaps", "AeroDyn has them in tables of another kind"),
        (speeds, "cut-in and cut-out wind speed", "no file has them; they are 3 and 25 m/s when it is read back"),
        (t.drivetrain.gearbox, "gearbox", "ElastoDyn has the ratio, the efficiency and one spring"),
        (t.electrical, "electrical system", "ServoDyn has an efficiency"),
        (tower, "torsion and stretching of the tower", "ElastoDyn has none"),
        (t.yaw.friction or t.yaw.brake_torque is not None, "friction and brake of the yaw bearing", "not written"),
        (deck.environment.rain, "rain", "the drag of its drops is in no polar"),
        (weather, "weather that changes", "the density is that of the start"),
        (blade_modes, "further blade modes", "ElastoDyn has 2 flap modes and 1 edge mode"),
        (tower_modes, "further tower modes", "ElastoDyn has two each way"),
        (o.yaw == "free", "free yaw", "YawSpr holds the nacelle"),
        (t.pitch_actuator.kind == "second_order", "pitch actuator", "the controller library has to model it"),
    ):
        if present:
            notes.lost(what, why)


def turn(angle: float) -> float:
    """An angle [rad] in degrees between -180 and 180."""
    return math.remainder(angle * DEGREES, 360.0)
