"""Export of a turbine as an OpenFAST 5 deck, for a simulation of the same case there."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from meltemi.aero.stall_tables import zero_lift_angle
from meltemi.core.errors import InputError, UnsupportedError
from meltemi.core.files import replacing
from meltemi.core.series import TimeSeries
from meltemi.core.threads import one_blas_thread
from meltemi.environment.site import Environment
from meltemi.exchange.openfast.airfoils import has_lift
from meltemi.exchange.openfast_writer.sections import classical, damping_ratios, damping_times, matrices
from meltemi.exchange.openfast_writer.shapes import Shape, blade_shapes, tower_shapes
from meltemi.exchange.openfast_writer.template import columns, fill, table
from meltemi.exchange.report import ImportNote
from meltemi.sea.conditions import Sea, StillWater
from meltemi.simulation.bladed.build import blade_modes, head_mass
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.options import BEDDOES, ModelOptions, StallConstants
from meltemi.simulation.rotors import build
from meltemi.simulation.vibrations import highest_frequency
from meltemi.structure.members import Member, blade_member
from meltemi.turbine.definition import Airfoil, Blade, Turbine
from meltemi.turbine.power_turbine import AnyTurbine, aeroelastic
from meltemi.wind.fields import SteadyWind

RPM, DEGREES = 30.0 / math.pi, 180.0 / math.pi
ATTACHED = 0.7
"""Attached fraction of the flow at OpenFAST's alpha1 and alpha2."""
LINEAR = (-0.06, 0.09)
"""[rad] range about zero lift in which the normal force is taken as linear."""
STEPS = (0.01, 0.00625, 0.005, 0.0025, 0.002, 0.00125, 0.001, 0.0005, 0.00025, 0.0002, 0.0001)
"""[s] time steps with few digits that divide ``OUTPUT_STEP``, as OpenFAST requires."""
OUTPUT_STEP = 0.05
"""[s] between outputs."""
LOOSE, TIGHT = 1, 3
"""Coupling of OpenFAST's modules: explicit; implicit, which BeamDyn and SubDyn need at any usable time step."""
FINENESS = 0.45
"""Time step times the highest frequency of ElastoDyn's degrees of freedom, at most."""
STALL_RADII = (0.25, 0.95)
"""Range of r/R in which OpenFAST computes dynamic stall: its model fails at cylindrical roots and at tips."""
ROUNDING = 1e-6
"""Relative, of OpenFAST in single precision."""
NEAR = 1e-7
"""[rad] difference below which OpenFAST treats two angles of a polar as equal, and stops."""
AT_SEA = "PtfmSurge PtfmSway PtfmHeave PtfmRoll PtfmPitch PtfmYaw".split()
"""Output channels of ElastoDyn at sea."""
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


@dataclass(frozen=True)
class Written:
    """An exported deck.

    Attributes:
      main: the main file (.fst).
      files: all files.
      notes: features that the deck lacks or approximates.
    """

    main: Path
    files: tuple[Path, ...]
    notes: tuple[ImportNote, ...]


@one_blas_thread
def write_openfast(  # noqa: PLR0913 - entries of the decks, each with a default
    turbine: AnyTurbine,
    folder: str | Path,
    *,
    options: ModelOptions | None = None,
    environment: Environment | None = None,
    wind: SteadyWind | str | Path | None = None,
    direction: float = 0.0,
    duration: float = 600.0,
    time_step: float | None = None,
    rotor_speed: float | None = None,
    pitch: float | None = None,
    azimuth: float = 0.0,
    beamdyn: bool = False,
    library: str | Path | None = None,
    settings: str | Path = "DISCON.IN",
    sea: Sea | None = None,
) -> Written:
    """Write a turbine as input of OpenFAST 5: main file, ElastoDyn, AeroDyn, InflowWind, ServoDyn, airfoils.

    At sea also SeaState with every wave, HydroDyn with coefficients of potential flow, and SubDyn or MoorDyn.
    BeamDyn files are written for blades with torsional stiffness. Mode shapes are those of the description, or the best
    polynomials of ElastoDyn for the sections.

    Args:
      turbine: aeroelastic.
      folder: created if needed; files of the same names are replaced.
      options: degrees of freedom and aerodynamic models.
      environment: air density and gravity.
      wind: a steady wind (12 m/s by default), or a TurbSim file (.bts).
      direction: [rad] by which the wind of a file is turned, clockwise from above.
      duration: [s].
      time_step: [s]; by default that of the options, or the one required by the highest frequency of ElastoDyn's
        degrees of freedom, at most 0.01 s; with BeamDyn and SubDyn, which are coupled implicitly, 0.01 s.
      rotor_speed: [rad/s] initial; by default rated.
      pitch: [rad] initial; by default the minimum.
      azimuth: [rad] initial, of blade 1, 0 when it points up.
      beamdyn: compute the blades with BeamDyn (CompElast 2) instead of ElastoDyn.
      library: Bladed-style controller library, with its input file ``settings``; without it the torque follows
        OpenFAST's simple law of regions 2 and 2 1/2 at constant pitch.
      settings: see library.
      sea: of a turbine that stands or floats in it; by default still water.

    Raises:
      InputError: a file cannot be written, the wind is of another kind, or the turbine of a sea stands on land.
      UnsupportedError: there is ice on a blade, BeamDyn is requested for a blade without torsion, the turbine cannot
        be modelled, or OpenFAST has no such support, platform, current or waves.
    """
    turbine, folder = aeroelastic(turbine, "write_openfast"), Path(folder)
    if turbine.icing is not None:
        raise UnsupportedError(f"{turbine.name}: a deck has no ice; take it off with with_ice(turbine, None)")
    if turbine.imbalance is not None:
        raise UnsupportedError(f"{turbine.name}: a deck has blades of one kind; take the imbalance off: imbalance=None")
    if beamdyn and not turbine.blade.structure.twists:
        raise UnsupportedError(f"{turbine.name}: BeamDyn needs blade.structure.torsion_stiffness, or 6 x 6 matrices")
    deck = _Deck(turbine, options or ModelOptions(), environment or Environment())
    rated = turbine.rated_rotor_speed
    start = (rated if rotor_speed is None else rotor_speed, turbine.control.pitch.minimum if pitch is None else pitch)
    texts: dict[str, str] = {}
    implicit = beamdyn or turbine.support is not None
    step = time_step or deck.options.time_step or (STEPS[0] if implicit else deck.time_step())
    if sea is not None and not deck.at_sea:
        raise InputError(f"sea: {turbine.name} stands on land")
    wet: dict[str, str] = {}
    if deck.at_sea:
        deck.water(wet, StillWater() if sea is None else sea, duration)
    deck.main(texts, wet, duration, step, beamdyn, 0.0 if sea is None else sea.level)
    texts |= wet
    deck.elastodyn(texts, *start, azimuth, beamdyn=beamdyn)
    if turbine.blade.structure.twists:
        deck.beamdyn(texts)
    deck.aerodyn(texts)
    deck.inflow(texts, SteadyWind(speed=12.0) if wind is None else wind, direction)
    deck.servo(texts, start[1], library, settings)
    return Written(folder / f"{deck.name}.fst", tuple(_save(folder, texts)), tuple(deck.notes))


def _save(folder: Path, texts: Mapping[str, str]) -> list[Path]:
    files = [folder / name for name in texts]
    try:
        for path in files:
            path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{error.filename or folder}: cannot be written ({error.strerror or error})") from None
    with replacing(*files) as partial:  # an incomplete deck would be read as another one
        for path, text in zip(partial, texts.values(), strict=True):
            path.write_text(text, encoding="utf-8")
    return files


class _Deck:
    """The files of a deck; each method adds the texts of some files, and their limitations to the notes."""

    def __init__(self, turbine: Turbine, options: ModelOptions, environment: Environment) -> None:
        self.turbine, self.options, self.environment = turbine, options, environment
        self.modes = blade_modes(turbine, options)
        self.notes: list[ImportNote] = []
        self.name = re.sub(r"[^\w.-]+", "_", turbine.name)
        self.title = turbine.description or turbine.name
        self.model: BladedModel = build(turbine)
        counts = {"flap": 1, "edge": 1, "torsion": int(turbine.blade.structure.twists)}
        self.at_sea = turbine.support is not None or turbine.platform is not None
        self.member: Member = blade_member(turbine.blade.structure, counts, self.model.rotor.blade_layout)
        self._limits()

    def lost(self, what: str, why: str) -> None:
        self.notes.append(ImportNote("ignored", self.turbine.name, what, why))

    def changed(self, what: str, why: str) -> None:
        self.notes.append(ImportNote("approximated", self.turbine.name, what, why))

    def _limits(self) -> None:
        t, o, air = self.turbine, self.options, self.environment.air
        weather = air and any(isinstance(q, TimeSeries) for q in (air.temperature, air.humidity, air.pressure))
        nacelle = t.nacelle.roll_inertia or t.nacelle.nod_inertia
        speeds = (t.cut_in, t.cut_out) != (3.0, 25.0)
        tower = t.tower.torsion_stiffness is not None or t.tower.axial_stiffness is not None
        blade_modes = self.modes["flap"] > 2 or self.modes["edge"] > 1
        tower_modes = o.fore_aft_modes > 2 or o.side_side_modes > 2
        for there, what, why in (
            (t.foundation is not None and not self.at_sea, "foundation", "the tower is clamped; SubDyn is not written"),
            (t.mass_dampers, "mass dampers", "StC files are not written"),
            (nacelle, "roll and nod inertia of the nacelle", "only yaw inertia"),
            (t.blade.flaps, "trailing-edge flaps", "AeroDyn has them in tables of another kind"),
            (speeds, "cut-in and cut-out wind speed", "no file has them; they are 3 and 25 m/s when it is read back"),
            (t.drivetrain.gearbox, "gearbox", "ElastoDyn has the ratio, the efficiency and one spring"),
            (t.electrical, "electrical system", "ServoDyn has an efficiency"),
            (tower, "torsion and stretching of the tower", "ElastoDyn has none"),
            (t.yaw.friction or t.yaw.brake_torque is not None, "friction and brake of the yaw bearing", "not written"),
            (self.environment.rain, "rain", "the drag of its drops is in no polar"),
            (weather, "weather that changes", "the density is that of the start"),
            (blade_modes, "further blade modes", "ElastoDyn has 2 flap modes and 1 edge mode"),
            (tower_modes, "further tower modes", "ElastoDyn has two each way"),
            (o.yaw == "free", "free yaw", "YawSpr holds the nacelle"),
            (t.pitch_actuator.kind == "second_order", "pitch actuator", "the controller library has to model it"),
        ):
            if there:
                self.lost(what, why)

    def time_step(self) -> float:
        """[s] that resolves those of the requested degrees of freedom that ElastoDyn has."""
        o = self.options
        wanted = self.modes | {"fore_aft": o.fore_aft_modes, "side_side": o.side_side_modes}
        most = {"flap": 2, "edge": 1, "torsion": 0, "fore_aft": 2, "side_side": 2}
        modes = {f"{name}_modes": min(wanted[name], n) for name, n in most.items()}
        has = ModelOptions(locked=o.locked).replace(**modes)
        frequency = highest_frequency(build(self.turbine, has, self.environment))
        return next((step for step in STEPS if step * frequency <= FINENESS), STEPS[-1])

    def water(self, texts: dict[str, str], sea: Sea, duration: float) -> None:
        """The files of the water and of what stands or floats in it; imported only where there is some."""
        from meltemi.exchange.openfast_writer import water
        from meltemi.sea.pile_beam import first_frequency

        pile, platform = self.turbine.support, self.turbine.platform
        water.sea_state(texts, self.title, sea, duration, pile, platform)
        if pile is not None:
            texts["HydroDyn.dat"] = water.pile_water(self.title, pile)
            first = first_frequency(self.model.rotor.tower.modes)
            water.pile_structure(texts, self.title, pile, self.turbine.foundation, first)
            if pile.shear_share != 0.5:
                self.changed("support.shear_share", "that of SubDyn's tubes")
        if platform is not None:
            water.platform_water(texts, self.title, platform, self.changed)
            if platform.lines:
                texts["MoorDyn.dat"] = water.mooring(self.title, platform)
            if any(line.strength is not None for line in platform.lines):
                self.lost("strength of lines", "MoorDyn's lines do not part")
            if platform.line_model == "static":
                self.changed("lines in static shapes", f"moving lines of {water.FEWEST_SEGMENTS} segments")

    def main(
        self, texts: dict[str, str], wet: Mapping[str, str], duration: float, step: float, beamdyn: bool, level: float
    ) -> None:
        torsion, sea = self.turbine.blade.structure.twists, self.turbine.support or self.turbine.platform
        files = {"Hydro": "HydroDyn", "Sub": "SubDyn", "Mooring": "MoorDyn", "SeaSt": "SeaState"}
        values: dict[str, object] = {
            "TMax": duration,
            "DT": step,
            "ModCoupling": TIGHT if beamdyn or self.turbine.support is not None else LOOSE,
            "MaxConvIter": 30 if self.at_sea else 6,  # water moves with members: more exchanges in a step,
            "ConvTol": 1e-3 if self.at_sea else 1e-4,  # which end at 1e-4 of forces in single precision
            "DT_UJac": 1.0 if self.turbine.platform is not None else 99999.0,  # a tilted hull exchanges differently
            "DT_Out": step * max(1, round(OUTPUT_STEP / step)),
            "CompElast": 2 if beamdyn else 1,
            "Gravity": self.environment.gravity,
            "AirDens": self.environment.density,
            "EDFile": "ElastoDyn.dat",
            "BDBldFile": "BeamDyn.dat" if torsion else "unused",
            "InflowFile": "InflowWind.dat",
            "AeroFile": "AeroDyn.dat",
            "ServoFile": "ServoDyn.dat",
        }
        if sea is not None:
            values |= {"WtrDens": sea.water_density, "WtrDpth": sea.depth, "MSL2SWL": level}
            there = {name: f"{module}.dat" for name, module in files.items() if f"{module}.dat" in wet}
            values |= {f"Comp{name}": 3 if name == "Mooring" else 1 for name in there}
            values |= {f"{name}File": file for name, file in there.items()}
        texts[f"{self.name}.fst"] = fill("main", self.title, values, {})

    def elastodyn(
        self, texts: dict[str, str], rotor_speed: float, pitch: float, azimuth: float, *, beamdyn: bool
    ) -> None:
        t, o = self.turbine, self.options
        n, h, d = t.nacelle, t.hub, t.drivetrain
        free = {name: name not in o.locked for name in ("tower", "yaw", "generator", "drivetrain", "blades")}
        values: dict[str, object] = {
            "FlapDOF1": self.modes["flap"] > 0 and free["blades"] and "flap" not in o.locked,
            "FlapDOF2": self.modes["flap"] > 1 and free["blades"] and "flap" not in o.locked,
            "EdgeDOF": self.modes["edge"] > 0 and free["blades"] and "edge" not in o.locked,
            "DrTrDOF": free["drivetrain"],
            "GenDOF": free["generator"],
            "YawDOF": free["yaw"],
            "TwFADOF1": o.fore_aft_modes > 0 and free["tower"],
            "TwFADOF2": o.fore_aft_modes > 1 and free["tower"],
            "TwSSDOF1": o.side_side_modes > 0 and free["tower"],
            "TwSSDOF2": o.side_side_modes > 1 and free["tower"],
            "BlPitch": pitch * DEGREES,
            "Azimuth": azimuth * DEGREES % 360.0,
            "RotSpeed": rotor_speed * RPM,
            "NacYaw": _turn(o.nacelle_yaw),
            "NumBl": t.n_blades,
            "TipRad": t.rotor_radius,
            "HubRad": h.radius,
            "PreCone": -h.precone * DEGREES,
            "HubCM": h.mass_centre,
            "OverHang": -n.overhang,
            "ShftTilt": -n.tilt * DEGREES,
            **dict(zip(("NacCMxn", "NacCMyn", "NacCMzn"), n.mass_centre, strict=True)),
            "Twr2Shft": n.shaft_height,
            "TowerHt": t.tower.base_height + t.tower.length,
            "TowerBsHt": t.tower.base_height,
            "HubMass": h.mass,
            "YawBrMass": t.tower.top_mass,
            "HubIner": h.inertia,
            "GenIner": d.generator_inertia,
            "NacMass": n.mass,
            "NacYIner": n.yaw_inertia,
            "BldFile": "ElastoDyn_blade.dat",
            "GBoxEff": 100.0 * d.gearbox_efficiency,
            "GBRatio": d.gear_ratio,
            "DTTorSpr": d.stiffness,
            "DTTorDmp": d.damping,
            "TwrFile": "ElastoDyn_tower.dat",
        } | self._base()
        outputs = OUTPUTS["ElastoDyn"].split() + AT_SEA * self.at_sea
        texts["ElastoDyn.dat"] = fill("ElastoDyn", self.title, values, {"outputs": outputs})
        texts["ElastoDyn_blade.dat"] = self._elastodyn_blade(beamdyn)
        texts["ElastoDyn_tower.dat"] = self._tower()

    def _base(self) -> dict[str, object]:
        """What ElastoDyn has of a platform, or of the top of a pile, where the tower needs inertia about its axis."""
        tower, platform = self.turbine.tower, self.turbine.platform
        numbers, lever, mass = [0.0] * 6, 0.0, 0.0
        if platform is not None:
            numbers, mass = [*platform.centre.tolist(), *platform.inertia.tolist()], platform.mass
        elif self.turbine.support is not None:
            numbers[2] = lever = tower.base_height
            numbers[5] = float(np.trapezoid(0.25 * tower.diameter**2 * tower.mass, tower.position))
        else:
            return {}
        names = [f"PtfmCM{axis}t" for axis in "xyz"] + [f"Ptfm{axis}Iner" for axis in "RPY"]
        found: dict[str, object] = {f"Ptfm{name}DOF": True for name in ("Sg", "Sw", "Hv", "R", "P", "Y")}
        return found | dict(zip(names, numbers, strict=True)) | {"PtfmMass": mass, "PtfmRefzt": lever}

    def _elastodyn_blade(self, beamdyn: bool) -> str:
        whole = self.turbine.blade.structure
        ratios = damping_ratios(whole.damping or whole.damping_time, self.member)
        blade = classical(whole, ratios, (lambda what, why: None) if beamdyn else self.lost)
        if blade.mode_shapes is None:
            flap, edge = blade_shapes(blade, self.model)
            self._shapes("blade", {"flap": flap, "edge": edge})
        else:
            flap, edge = (_given(modes) for modes in (blade.mode_shapes.flap, blade.mode_shapes.edge))
        assert blade.mass is not None and blade.flap_stiffness is not None and blade.edge_stiffness is not None
        values: dict[str, object] = {
            "NBlInpSt": len(blade.position),
            "BldFlDmp": 100.0 * ratios.flap,
            "BldEdDmp": 100.0 * ratios.edge,
            "AdjBlMs": 1.0,
            **_coefficients(BldFl1Sh=flap[0], BldFl2Sh=flap[1], BldEdgSh=edge[0]),
        }
        sections = (blade.twist * DEGREES, blade.mass, blade.flap_stiffness, blade.edge_stiffness)
        names, units = "BlFract StrcTwst BMassDen FlpStff EdgStff", "- deg kg/m Nm^2 Nm^2"
        stations = table(names, units, blade.position / blade.position[-1], *sections)
        return fill("ElastoDyn blade", self.title, values, {"stations": stations})

    def _tower(self) -> str:
        tower = self.turbine.tower
        if tower.mode_shapes is None:
            model = self.model
            axis = model.rotor.blade.beam.at(model.rotor.blade_layout.position, "axis")
            pieces = model.rotor.blade.beam.rigid_pieces(model.rotor.blade_layout.edges, axis)
            fore_aft, side_side = tower_shapes(model, head_mass(self.turbine, pieces, axis))
            if not self.at_sea:  # where the tower's natural modes are those on its support
                self._shapes("tower", {"fore-aft": fore_aft, "side-side": side_side})
        else:
            fore_aft, side_side = (_given(modes) for modes in (tower.mode_shapes.fore_aft, tower.mode_shapes.side_side))
        values: dict[str, object] = {
            "NTwInpSt": len(tower.position),
            "TwrFADmp": 100.0 * tower.damping.fore_aft,
            "TwrSSDmp": 100.0 * tower.damping.side_side,
            **_coefficients(TwFAM1Sh=fore_aft[0], TwFAM2Sh=fore_aft[1], TwSSM1Sh=side_side[0], TwSSM2Sh=side_side[1]),
        }
        sections = (tower.position / tower.length, tower.mass, tower.fore_aft_stiffness, tower.side_side_stiffness)
        stations = table("HtFract TMassDen TwFAStif TwSSStif", "- kg/m Nm^2 Nm^2", *sections)
        return fill("ElastoDyn tower", self.title, values, {"stations": stations})

    def _shapes(self, member: str, shapes: Mapping[str, list[Shape]]) -> None:
        """Note the deviation of the polynomials' frequencies from those of the natural modes."""
        natural = self.model.rotor.blade if member == "blade" else self.model.rotor.tower
        for kind, found in shapes.items():
            for i, shape in enumerate(found):
                name = f"{('1st', '2nd')[i]} {kind}"
                if name in natural.names:
                    there = float(natural.modes.frequency[natural.names.index(name)])
                    off = 100.0 * (shape.frequency / there - 1.0)
                    why = f"polynomial of degree 6: frequency {off:+.2f} % of ours, {there / math.tau:.4g} Hz"
                    self.changed(f"{name} mode of the {member}", why)

    def beamdyn(self, texts: dict[str, str]) -> None:
        s = self.turbine.blade.structure
        K, M = matrices(s, self.changed)
        zero = np.zeros(len(s.position))
        x, y = (zero if value is None else value for value in (s.axis_x, s.axis_y))
        z = s.position
        arc = np.concatenate([[0.0], np.cumsum(np.sqrt(np.diff(x) ** 2 + np.diff(y) ** 2 + np.diff(z) ** 2))])
        values: dict[str, object] = {"kp_total": len(z), "BldFile": "BeamDyn_blade.dat"}
        points = table("kp_xr kp_yr kp_zr initial_twist", "m m m deg", x, y, z, s.twist * DEGREES)
        head = f"     1   {len(z)}   - member, its key points"
        tables = {"key_points": [head, *points], "outputs": OUTPUTS["BeamDyn"].split()}
        texts["BeamDyn.dat"] = fill("BeamDyn", self.title, values, tables)
        flap, edge, torsion = damping_times(s.damping or s.damping_time, self.member)
        if s.damping is not None:
            self.changed("damping of the blade", "ratios of the first modes as times over stiffness in BeamDyn")
        sections = []
        for share, stiffness, mass in zip(arc / arc[-1], K, M, strict=True):
            sections += [f"{share:.12f}", *columns(*stiffness.T), "", *columns(*mass.T), ""]
        times = ([mu] for mu in (flap, edge, flap, edge, flap, torsion))
        tables = {"damping": table("mu1 mu2 mu3 mu4 mu5 mu6", "s s s s s s", *times), "sections": sections}
        values = {"station_total": len(z), "damp_type": int(any((flap, edge, torsion)))}
        texts["BeamDyn_blade.dat"] = fill("BeamDyn blade", self.title, values, tables)

    def aerodyn(self, texts: dict[str, str]) -> None:
        t, o = self.turbine, self.options
        names = list(dict.fromkeys(t.blade.aerodynamics.airfoil))
        foils = {name: t.airfoils[name] for name in names}
        files = {name: f"Airfoils/{re.sub(r'[^A-Za-z0-9_.+-]+', '_', name)}.dat" for name in names}
        if len(set(files.values())) < len(files):
            files = {name: f"Airfoils/{i + 1:02d}.dat" for i, name in enumerate(names)}
        if unused := [name for name in t.airfoils if name not in files]:
            self.lost(f"airfoils {', '.join(unused)}", "no station of the blade uses them")
        if t.blade.aerodynamics.cant is None and t.blade.structure.axis_x is not None:
            self.changed("cant of the sections", "BlCrvAng is the slope of the beam's axis")
        if o.tower_influence == "lower_half":
            self.changed("tower_influence lower_half", "TwrPotent 1: everywhere below the tower top")
        steady = o.wake == "none" or o.inflow == "quasi_steady"
        values: dict[str, object] = {
            "Wake_Mod": 0 if o.wake == "none" else 1,
            "TwrPotent": 0 if o.tower_influence == "none" else 1,
            "TwrShadow": {"powles": 1, "eames": 2}.get(o.tower_influence, 0),
            "TwrAero": o.tower_drag,
            "AirDens": self.environment.density,
            "Skew_Mod": 1 if o.skew == "glauert" else 0,
            "TipLoss": o.tip_loss,
            "HubLoss": o.hub_loss,
            "AIDrag": o.axial_drag,
            "TIDrag": o.tangential_drag,
            "DBEMT_Mod": 0 if steady else 1 if o.inflow == "constant" else 2,
            "tau1_const": o.inflow_time,
            "UA_Mod": 4 if o.stall == "hansen" else 0,
            **dict(zip(("UAStartRad", "UAEndRad"), STALL_RADII if o.stall == "hansen" else (0, 1), strict=True)),
            "NumAFfiles": len(names),
            "ADBlFile": "AeroDyn_blade.dat",
            "NumTwrNds": len(t.tower.position),
        }
        constants = ([value] * len(t.tower.position) for value in (t.tower.drag_coefficient, 0.1, 0.0, 0.0, 0.0))
        height = t.tower.base_height + t.tower.position
        names_of_tower = "TwrElev TwrDiam TwrCd TwrTI TwrCb TwrCp TwrCa"
        tower = table(names_of_tower, "m m - - - - -", height, t.tower.diameter, *constants)
        listed = [f'"{file}"' for file in files.values()]
        listed[0] += "    AFNames - airfoil files"
        tables = {"airfoils": listed, "tower": tower, "outputs": OUTPUTS["AeroDyn"].split()}
        texts["AeroDyn.dat"] = fill("AeroDyn", self.title, values, tables)
        texts["AeroDyn_blade.dat"] = _aerodyn_blade(t.blade, names, self.title)
        if o.stall == "hansen":
            self.changed("dynamic stall", "from {} to {} of the radius; static polars beyond".format(*STALL_RADII))
            static = [n for n, a in foils.items() if not a.dynamic_stall and has_lift(a.angle_of_attack, a.lift)]
            if static:
                what = f"static polars of {', '.join(static)}"
                self.changed(what, "OpenFAST has dynamic stall wherever there is lift")
        whole = {name: _closed(foil) for name, foil in foils.items()}
        if changed := [name for name, foil in foils.items() if len(whole[name].lift) < len(foil.lift)]:
            why = "angles that are the same but for rounding are written once"
            self.changed(f"polars of {', '.join(changed)}", why)
        if changed := [name for name, foil in foils.items() if abs(foil.lift[-1] - foil.lift[0]) > NEAR]:
            self.changed(f"polars of {', '.join(changed)}", "the mean of both ends stands at -180 and 180 degrees")
        for name, file in files.items():
            texts[file] = _airfoil(name, whole[name], o.stall_constants)

    def inflow(self, texts: dict[str, str], wind: SteadyWind | str | Path, direction: float) -> None:
        hub = self.turbine.hub_height
        values: dict[str, object] = {"WindVziList": hub, "RefHt": hub, "RefHt_Uni": hub, "RefHt_Hawc": hub}
        if isinstance(wind, SteadyWind):
            values |= {
                "WindType": 1,
                "HWindSpeed": wind.speed / math.cos(wind.upflow),
                "RefHt": wind.reference_height or hub,
                "PLexp": wind.shear_exponent,
                "PropagationDir": _turn(wind.direction),
                "VFlowAng": wind.upflow * DEGREES,
            }
            if wind.roughness or wind.veer:
                self.lost("roughness or veer of the wind", "InflowWind's steady wind has a power law only")
        elif isinstance(wind, str | Path) and Path(wind).suffix.lower() == ".bts":
            values |= {"WindType": 3, "FileName_BTS": Path(wind).absolute().as_posix()}
            values["PropagationDir"] = _turn(direction)
        else:
            raise InputError(f"write_openfast: wind {str(wind)[:60]!r}: expected a SteadyWind or a TurbSim file (.bts)")
        texts["InflowWind.dat"] = fill("InflowWind", self.title, values, {"outputs": OUTPUTS["InflowWind"].split()})

    def servo(self, texts: dict[str, str], held: float, library: str | Path | None, settings: str | Path) -> None:
        t = self.turbine
        law, pitch = t.control.torque, t.control.pitch
        rated_torque = law.rated_power / law.rated_speed
        # OpenFAST refuses a law whose region 2 ends above the rated torque: it ends where it reaches that
        rated_speed = min(law.rated_speed, math.sqrt(rated_torque / law.optimal_gain) * (1.0 - ROUNDING))
        mode = 0 if library is None else 5
        if library is None:
            self.changed("control", "the pitch is held; torque by OpenFAST's simple law, constant above rated speed")
            if rated_speed < law.rated_speed * (1.0 - 10.0 * ROUNDING):
                why = f"optimal torque reaches rated torque at {rated_speed * RPM:.5g} rpm; constant from there"
                self.changed("rated speed of the torque law", why)
        values: dict[str, object] = {
            "PCMode": mode,
            "VSContrl": mode or 1,
            "PitManRat": t.pitch_actuator.rate_limit * DEGREES,
            "GenEff": 100.0 * t.drivetrain.generator_efficiency,
            "PitNeut": held * DEGREES,
            "VS_RtGnSp": rated_speed * RPM,
            "VS_RtTq": rated_torque,
            "VS_Rgn2K": law.optimal_gain / RPM**2,
            "VS_SlPc": 100.0 * law.slip,
            "HSSBrTqF": t.drivetrain.brake_torque,
            "YCMode": mode if self.options.yaw == "driven" else 0,
            "YawNeut": _turn(self.options.nacelle_yaw),
            "YawSpr": t.yaw.stiffness,
            "YawDamp": t.yaw.damping,
            "YawManRat": t.yaw.rate * DEGREES,
            "DLL_FileName": "unused" if library is None else str(library),
            "DLL_InFile": "unused" if library is None else str(settings),
            "Ptch_Cntrl": 1,
            "Ptch_SetPnt": pitch.minimum * DEGREES,
            "Ptch_Min": pitch.minimum * DEGREES,
            "Ptch_Max": pitch.maximum * DEGREES,
            "PtchRate_Min": -pitch.rate_limit * DEGREES,
            "PtchRate_Max": pitch.rate_limit * DEGREES,
            "Gain_OM": law.optimal_gain,
            "GenSpd_MinOM": law.optimal_speed * RPM,
            "GenSpd_MaxOM": law.rated_speed * RPM,
            "GenSpd_Dem": pitch.reference_speed * RPM,
            "GenTrq_Dem": rated_torque,
            "GenPwr_Dem": law.rated_power,
        }
        tables = {"torque_table": table("GenSpd_TLU GenTrq_TLU", "rpm Nm"), "outputs": OUTPUTS["ServoDyn"].split()}
        texts["ServoDyn.dat"] = fill("ServoDyn", self.title, values, tables)


def _turn(angle: float) -> float:
    """[deg] within half a turn of an angle [rad]."""
    return math.remainder(angle * DEGREES, 360.0)


def _given(modes: Sequence[tuple[float, ...]]) -> list[Shape]:
    """Shapes of the description; their frequencies are unknown."""
    return [Shape(coefficients, math.nan) for coefficients in modes]


def _coefficients(**shapes: Shape) -> dict[str, object]:
    return {
        f"{name}({power})": float(c)
        for name, shape in shapes.items()
        for power, c in zip(range(2, 7), shape.coefficients, strict=True)
    }


def _aerodyn_blade(blade: Blade, names: list[str], title: str) -> str:
    a, s = blade.aerodynamics, blade.structure
    n = len(a.position)
    zero = np.zeros(n)
    x, y = (zero if value is None else value for value in (a.centre_x, a.centre_y))
    cant = zero if a.cant is None else a.cant
    if a.cant is None and s.axis_x is not None:  # sections stand normal to the beam's own axis
        cant = np.arctan(np.interp(a.position, s.position, np.gradient(s.axis_x, s.position)))
    ids = [str(names.index(name) + 1) for name in a.airfoil]
    numbers = (a.position, x, y, cant * DEGREES, a.twist * DEGREES, a.chord)
    names_of_columns = (
        "BlSpn BlCrvAC BlSwpAC BlCrvAng BlTwist BlChord BlAFID t_c BlCb BlCenBn BlCenBt BlCpn BlCpt BlCan BlCat BlCam"
    )
    units = "m m m deg deg m - - - m m - - - - -"
    stations = table(names_of_columns, units, *numbers, ids, *([0.0] * n for _ in range(9)))
    return fill("AeroDyn blade", title, {"NumBlNds": n}, {"stations": stations})


def _closed(airfoil: Airfoil) -> Airfoil:
    """A polar with angles that increase by more than ``NEAR``, from -pi to pi, and equal coefficients at both ends."""
    alpha = airfoil.angle_of_attack.copy()
    alpha[[0, -1]] = -np.pi, np.pi
    keep = [0]
    for i in range(1, len(alpha) - 1):
        if alpha[keep[-1]] + NEAR < alpha[i] < np.pi - NEAR:
            keep.append(i)
    keep.append(len(alpha) - 1)
    values = {"angle_of_attack": alpha[keep]}
    for name in ("lift", "drag", "moment"):
        values[name] = getattr(airfoil, name)[keep]
        values[name][[0, -1]] = 0.5 * (values[name][0] + values[name][-1])
    return airfoil.replace(**{name: value.tolist() for name, value in values.items()})


def _airfoil(name: str, airfoil: Airfoil, constants: StallConstants) -> str:
    """A polar; constants of dynamic stall are written where they are stated, OpenFAST finds the others itself."""
    alpha = airfoil.angle_of_attack
    stated = airfoil.dynamic_stall and (airfoil.zero_lift_angle is not None or constants != BEDDOES)
    values: dict[str, object] = {"NumAlf": len(alpha), "InclUAdata": stated}
    if stated:
        values |= _stall(airfoil, constants)
    names, units, *rows = table(
        "Alpha Cl Cd Cm", "deg - - -", alpha * DEGREES, airfoil.lift, airfoil.drag, airfoil.moment
    )
    text = fill("airfoil", name, values, {"polar": [f"!  {names}", f"!  {units}", *rows]})
    if not stated:
        lines = text.splitlines(keepends=True)
        first = next(i for i, line in enumerate(lines) if " alpha0 " in line)
        last = next(i for i, line in enumerate(lines) if " NumAlf " in line)
        text = "".join(lines[:first] + lines[last:])
    return text


def _stall(airfoil: Airfoil, constants: StallConstants) -> dict[str, object]:
    """OpenFAST's constants of dynamic stall, from the airfoil or from its normal force.

    Its slope is that of a straight line near zero lift; alpha1 and alpha2 are where Kirchhoff's flow
    C_n = C_n,alpha (1 + sqrt f)^2 / 4 (alpha - alpha0) has the attachment f = 0.7 on either side.
    """
    alpha, lift, drag = airfoil.angle_of_attack, airfoil.lift, airfoil.drag
    zero = zero_lift_angle(alpha, lift) if airfoil.zero_lift_angle is None else airfoil.zero_lift_angle
    floor = float(np.interp(zero, alpha, drag)) if airfoil.zero_lift_drag is None else airfoil.zero_lift_drag
    normal = lift * np.cos(alpha) + (drag - floor) * np.sin(alpha)
    fine = zero + np.linspace(*LINEAR, 41)
    slope = float(np.polyfit(fine, np.interp(fine, alpha, normal), 1)[0])
    fine = zero + np.linspace(-0.6, 0.6, 2401)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.interp(fine, alpha, normal) / (slope * (fine - zero))
    separated = (2.0 * np.sqrt(np.clip(ratio, 0.25, 1.0)) - 1.0) ** 2 < ATTACHED
    upper = fine[separated & (fine > zero + LINEAR[1])]
    lower = fine[separated & (fine < zero + LINEAR[0])]
    first = float(upper[0]) if len(upper) else zero + 0.6
    last = float(lower[-1]) if len(lower) else zero - 0.6
    return {
        "alpha0": zero * DEGREES,
        "alpha1": first * DEGREES,
        "alpha2": last * DEGREES,
        "C_nalpha": slope,
        "T_f0": constants.separation_lag,
        "T_p": constants.pressure_lag,
        "b1": constants.b1,
        "b2": constants.b2,
        "A1": constants.a1,
        "A2": constants.a2,
        "Cn1": float(np.interp(first, alpha, normal)),
        "Cn2": float(np.interp(last, alpha, normal)),
        "Cd0": floor,
        "Cm0": float(np.interp(zero, alpha, airfoil.moment)),
    }
