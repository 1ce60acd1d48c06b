"""An OpenFAST deck as a turbine, with the equivalent model options and case."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from meltemi.core.errors import InputError, UnsupportedError, did_you_mean
from meltemi.core.record import Record, set_keys
from meltemi.core.yamlfile import validated
from meltemi.exchange.openfast.airfoils import Polars, read_airfoils
from meltemi.exchange.openfast.blade import add_torsion, read_aerodyn_blade, read_beamdyn, read_elastodyn_blade
from meltemi.exchange.openfast.control import IDEAL_RATE, fixed_pitch, from_discon, simple_torque
from meltemi.exchange.openfast.frame import read_frame, rigid_body
from meltemi.exchange.openfast.frame_water import frame_in_water
from meltemi.exchange.openfast.mass_dampers import read_mass_dampers
from meltemi.exchange.openfast.mooring import read_mooring
from meltemi.exchange.openfast.olaf import vortex_wake
from meltemi.exchange.openfast.outlist import outputs
from meltemi.exchange.openfast.superelement import read_superelement
from meltemi.exchange.openfast.text import InputFile, is_content, read_input
from meltemi.exchange.openfast.tower import add_diameter, is_pile, read_pile_in_water, read_tower
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.openfast.water import DeckWater
from meltemi.exchange.openfast.wind import read_inflow
from meltemi.exchange.report import ImportedModel, Notes
from meltemi.frames.definition import Frame
from meltemi.frames.finite_elements import assemble
from meltemi.frames.reduction import frequencies, tower_base
from meltemi.sea.pile_beam import first_frequency
from meltemi.simulation.rotors import build
from meltemi.turbine.definition import BaseMotion, Turbine

BladeChoice = Literal["deck", "elastodyn", "beamdyn"]
RIGID_SHAFT = 2.0 * math.pi * 10.0
"""[rad/s] natural frequency of the generator on the shaft, where the deck has a rigid shaft without stiffness."""
LEAST_YAW_FREQUENCY = 2.0 * math.pi * 2.0
"""[rad/s] natural frequency of the nacelle on its bearing, where the deck has no spring."""


@dataclass(frozen=True, repr=False)
class Deck(ImportedModel):
    """Content of an OpenFAST deck.

    Its options select the degrees of freedom and aerodynamic models of the deck; everything else follows OpenFAST 5.

    Attributes:
      library: the controller library as the deck names it, its input file, procedure, whether it controls the pitch
        individually, and its sample time [s] if that is not the time step; empty without a library.
    """

    library: dict[str, Any] = field(default_factory=dict)


def read_openfast(path: str | Path, **how: Any) -> Turbine:
    """Read the turbine of an OpenFAST deck, versions 2 to 5; see :func:`read_deck` for arguments and errors."""
    return read_deck(path, **how).turbine


@np.errstate(all="ignore")  # the record reports values that are not finite by their name
def read_deck(
    path: str | Path,
    *,
    blade: BladeChoice = "deck",
    fixed_base: bool = False,
    momentum_wake: bool = False,
    discon: str | Path | None = None,
    control_of: Turbine | None = None,
    extra: Mapping[str, Any] | None = None,
) -> Deck:
    """Read an OpenFAST deck: ElastoDyn, BeamDyn, AeroDyn 15, ServoDyn, InflowWind, ROSCO's DISCON.IN;
    SeaState, HydroDyn, SubDyn, MoorDyn and MAP++.

    Keywords are recognised on any line; paths of other operating systems and any case of letters are accepted.

    Args:
      path: the main file (.fst).
      blade: source of the blade: that which the deck uses (``CompElast``), ElastoDyn or BeamDyn. The ElastoDyn blade
        has torsion only if the deck names BeamDyn files, which then provide it.
      fixed_base: clamp the tower of a floating turbine, or of one on a pile or jacket, at its base.
      momentum_wake: use momentum theory where the deck has a vortex wake.
      discon: ROSCO settings (DISCON.IN) in place of those that the deck names.
      control_of: a turbine whose control, pitch actuator and rated power are taken, for decks with another controller.
      extra: key paths and values that supplement or replace those of the deck: ``{"drivetrain.stiffness": 8.7e8}``.

    Raises:
      InputError: the deck is not valid, with file, line, keyword and what was expected; or the missing data, as key
        paths for ``extra``.
      UnsupportedError: the deck has a named feature that is not supported.
    """
    path, notes = Path(path), Notes()
    main = _main(path)
    v = Values(notes, main)
    _refuse_modules(main, v, fixed_base)
    elastodyn = v.read(_open(main, "EDFile", "ElastoDyn"))
    sub = _subdyn(main, v) if v.given("comp_sub", 0) == 1 and not fixed_base else None
    floats = _floats(v, sub) and not fixed_base
    _refuse_platform(path, v, fixed_base, floats, sub is not None)
    aero = _open(main, "AeroFile", "AeroDyn")
    aero_values = Values(notes, aero)
    _wake(aero_values, momentum_wake)
    polars = _polars(aero, aero_values, notes)
    shape_path = _file(aero, aero_values, "blade_file")
    outer = read_aerodyn_blade(read_input(shape_path, "AeroDyn blade"), list(polars.airfoils), notes)
    structure = _structure(main, elastodyn, v, blade, notes)
    tower = read_tower(read_input(_file(elastodyn, v, "tower_file"), "ElastoDyn tower"), v, notes)
    add_diameter(tower, aero, aero_values, notes)
    data: dict[str, Any] = {
        "name": path.stem,
        "description": main.lines[1].strip()[:200] if len(main.lines) > 1 else "",
        "source": f"OpenFAST deck {path.name}",
        "n_blades": v["n_blades"],
        "blade": {"aerodynamics": outer, "structure": structure, "source": shape_path.name},
        "airfoils": polars.airfoils,
        "tower": tower,
    }
    _machine(data, v, elastodyn.path.name)
    if v["air_density"] is not None:
        aero_values.unneeded("that of the main file is used", "air_density")
    water = DeckWater(main, v, notes) if floats or sub is not None else None
    data |= _below_tower(main, v, water, sub, floats, fixed_base)
    servo = _control(main, data, v, None if discon is None else Path(discon), control_of)
    _drivetrain(data, v)
    if control_of is not None:
        v.unneeded("the control is that of control_of", *(f"simple_{name}" for name in SIMPLE))
    v.unneeded("given by extra", *(extra or {}))
    supplement(data, control_of, extra or {}, notes)
    _require_complete(path, data)
    below = next((name for name in ("support", "frame") if name in data), "")
    rayleigh = data.get(below, {}).pop("rayleigh", None)
    turbine = _validated(data, path, v)
    if rayleigh is not None:
        turbine = _with_damping_ratio(turbine, below, *rayleigh)
    inflow = v.file(main, "inflow") if v.given("comp_inflow", 1) == 1 else None
    wind = read_inflow(read_input(inflow, "InflowWind"), turbine.hub_height, notes) if inflow else None
    density = v["air_density"] if v["air_density"] is not None else aero_values["air_density"]
    surroundings = {"air_density": density, "gravity": v["gravity"]}
    sea = None if water is None or water.file is None else water.sea()
    options = _options(turbine, v, aero_values, polars, momentum_wake)  # its notes are already among those of the deck
    if aero_values["wake"] == 3 and not momentum_wake:
        options |= vortex_wake(aero, aero_values, v, turbine)
        if options["stall"] != "static":
            options["stall_constants"] = options["stall_constants"] | {"a1": 0.0, "a2": 0.0}
            why = "the model of UA_Mod 4 without A1 and A2, as in OLAF: the shed vorticity is in the wake"
            aero_values.note("used" if aero_values["unsteady"] == 4 else "approximated", "unsteady", why)
    output = outputs([elastodyn, aero, *_others(main, v, water, inflow)], v, aero_values, turbine, notes)
    return Deck(
        turbine,
        tuple(notes),
        options=options,
        environment={name: value for name, value in surroundings.items() if value is not None},
        wind=wind,
        duration=min(v.given("duration", 60.0), 1e6),
        output_step=v.given("output_step", 0.05),
        start=_start(v),
        library=servo,
        sea=sea,
        output={name: value for name, value in asdict(output).items() if value} if output.channels else {},
    )


def _others(main: InputFile, v: Values, water: DeckWater | None, inflow: Path | None) -> Iterator[InputFile]:
    """Files of the deck with lists of outputs other than those of ElastoDyn and AeroDyn."""
    at_sea = water is not None
    used = {
        "ServoDyn": ("servo", v.given("comp_servo", 1) == 1),
        "InflowWind": ("inflow", inflow is not None),
        "BeamDyn": ("beamdyn", v["comp_elast"] == 2),
        "SeaState": ("sea_file", at_sea),
        "HydroDyn": ("hydro_file", at_sea and bool(v.given("comp_hydro", 0))),
        "SubDyn": ("sub", at_sea and v.given("comp_sub", 0) == 1),
        "mooring": ("mooring_file", at_sea and v.given("comp_mooring", 0) == 3),
    }
    for module, (target, is_used) in used.items():
        path = v.file(main, target) if is_used and target in v.data else None
        if path is not None:
            yield read_input(path, module)


def _with_damping_ratio(
    turbine: Turbine, below: str, of_mass: float, of_stiffness: float, internal: float = 0.0
) -> Turbine:
    """The turbine on a pile or frame with the ratio that its Rayleigh damping has at the first natural frequency.

    Args:
      internal: damping ratio of the first mode of a frame whose interface is held, to which stiffness adds damping.
    """
    first = first_frequency(build(turbine).rotor.tower.modes)
    if internal and turbine.frame is not None:
        held = frequencies(assemble(turbine.frame, tower_base(turbine.frame, turbine.tower)), 1, fixed=True)
        of_stiffness += 2.0 * internal / float(held[0])
    return turbine.replace(**{f"{below}.damping": 0.5 * (of_mass / first + of_stiffness * first)})


def _start(v: Values) -> dict[str, float]:
    azimuth = math.remainder(v.given("azimuth", 0.0) - v.given("azimuth_up", 0.0), 2.0 * math.pi)
    return {"rotor_speed": v.given("rotor_speed", 0.0), "pitch": v.given("pitch", 0.0), "azimuth": azimuth}


def _main(path: Path) -> InputFile:
    main = read_input(path, "main")
    if main.find("EDFile") is None and main.find("CompElast") is None:
        raise InputError(f"{path}: not the main file of an OpenFAST deck (.fst): no CompElast and EDFile in it")
    return main


def _open(main: InputFile, keyword: str, module: str) -> InputFile:
    entry = main.require([keyword], f"name of the {module} file")
    path = main.file(entry.values[0], entry.line)
    if path is None:
        raise InputError(f"{main.at(entry.line)}: {entry.name}: a {module} file is needed, found {entry.values[0]!r}")
    return read_input(path, module)


def _file(file: InputFile, v: Values, target: str) -> Path:
    path = v.file(file, target)
    assert path is not None, "kind 'file' in the table makes sure of it"
    return path


def _refuse_modules(main: InputFile, v: Values, fixed_base: bool) -> None:
    moored = v.given("comp_mooring", 0) not in ((0, 1, 3) if v.given("comp_hydro", 0) else (0,)) and not fixed_base
    for target, unsupported, reason in (
        ("mhk", v.given("mhk", 0) != 0, "a marine turbine (MHK): water around the rotor is not modelled"),
        ("rotors", v.given("rotors", 1) != 1, "several rotors are not modelled"),
        ("mirror", v.given("mirror", False), "a rotor that turns counter-clockwise is not modelled"),
        ("comp_elast", v["comp_elast"] not in (1, 2), "only ElastoDyn (1) and ElastoDyn with BeamDyn (2) are read"),
        ("comp_aero", v["comp_aero"] in (0, 1), "aerodynamics of AeroDyn are needed (2)"),
        (
            "comp_mooring",
            moored,
            f"a floating turbine without HydroDyn, or on other lines than MoorDyn's and MAP's: {FIXED}",
        ),
        ("comp_sub", v.given("comp_sub", 0) > 2 and not fixed_base, f"expected 0, 1 or 2: {FIXED}"),
    ):
        if unsupported:
            raise UnsupportedError(f"{main.path.parent / v.source[target]}: {reason}")
    v.differs("ignored", 0, comp_ice="ice loads are not modelled", comp_soil="soil is not modelled")
    if fixed_base:
        clamped = "the tower base is clamped, as requested"
        v.differs("ignored", 0, comp_mooring=clamped, comp_sub=clamped)


SIMPLE = ("speed", "torque", "gain", "slip")
"""Values of ServoDyn's simple torque."""
MOTIONS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
FIXED = "not modelled; fixed_base=True (--fixed-base) clamps the tower base instead"
WATER = (
    "sea_file hydro_file mooring_file water_density depth level comp_sea platform_mass platform_centre_x "
    "platform_centre_y platform_centre_z platform_inertia_R platform_inertia_P platform_inertia_Y "
    "platform_inertia_XY platform_inertia_XZ platform_inertia_YZ "
    "platform_reference_x platform_reference_y platform_reference_z"
).split()
OF_FRAME = WATER[-6:]
"""Values that platforms and piles do not use."""


def _subdyn(main: InputFile, v: Values) -> InputFile:
    path = v.file(main, "sub")
    if path is None:
        raise InputError(f"{main.path}: CompSub is 1, but SubFile names no file")
    return read_input(path, "SubDyn")


def _floats(v: Values, sub: InputFile | None) -> bool:
    """Whether the deck has a floating platform: HydroDyn, platform motion, and no SubDyn or one without ground."""
    free = any(v.given(f"platform_{name}", False) for name in ("surge", "pitch"))
    grounds = sub is not None and sub.count(sub.require(["NReact"], "of lines")) > 0
    return free and bool(v.given("comp_hydro", 0)) and v.given("comp_sub", 0) < 2 and not grounds


def _below_tower(
    main: InputFile, v: Values, water: DeckWater | None, sub: InputFile | None, floats: bool, fixed_base: bool
) -> dict[str, Any]:
    """What the tower stands on: nothing else on land, a superelement, a pile, a frame, a floating platform."""
    data: dict[str, Any] = {}
    if v.given("comp_sub", 0) == 0:
        v.unneeded("of CompSub 1", "sub")
    if v.given("comp_sub", 0) == 2 and not fixed_base:
        v.unneeded("of SubDyn or a platform", *WATER)
        return read_superelement(main, v, v.notes)
    if water is None:
        v.differs("ignored", 0, comp_hydro="the tower stands on land, or is clamped at its base as requested")
        v.unneeded("the tower stands on land", *WATER)
        return data
    if sub is not None and is_pile(sub, v.notes):
        data = read_pile_in_water(sub, v, water, v.notes)
    elif sub is not None:
        data["frame"] = frame_in_water(water, read_frame(sub, v, v.notes), v.notes)
    if floats:
        data |= _floating(main, v, water, data.get("frame"))
    else:
        v.unneeded("of a platform", "mooring_file")
    if "frame" not in data:
        v.unneeded("of a frame of many members, or a superelement", *OF_FRAME)
    return data


def _floating(main: InputFile, v: Values, water: DeckWater, frame: dict[str, Any] | None) -> dict[str, Any]:
    """Platform with its mooring lines, and the degrees of freedom of the tower base; the frame is its elastic body."""
    platform = water.platform(v)
    if frame is not None:
        if frame.pop("rayleigh", None) is not None:
            v.notes.add("ignored", frame["source"], "damping of the frame", "give frame.damping")
        platform |= rigid_body(validated(frame, Frame, f"{main.path}: frame"))
    moored = v.file(main, "mooring_file") if v.given("comp_mooring", 0) else None
    if moored is not None:
        lines = read_input(moored, "mooring")
        platform |= read_mooring(lines, platform["depth"], v.notes, of_map=v["comp_mooring"] == 1)
    foundation = {"motions": get_args(BaseMotion), "stiffness": np.zeros((6, 6))}
    return {"platform": platform, "foundation": foundation}


def _refuse_platform(path: Path, v: Values, fixed_base: bool, floats: bool, elastic: bool) -> None:
    free = any(v.given(f"platform_{name}", False) for name in ("surge", "pitch"))
    why = "a platform has all six motions" if floats else "what is below the tower is elastic, or fixed"
    for name in MOTIONS:
        if (moves := v[f"platform_{name}"]) is not None:
            v.note("equivalent" if moves == (floats or elastic) else "ignored", f"platform_{name}", why)
    if free and not floats and v.given("comp_sub", 0) == 0 and not fixed_base:
        raise UnsupportedError(
            f"{path.parent / v.source['platform_surge']} and PtfmPDOF: a platform that moves without SubDyn and "
            f"HydroDyn: {FIXED}"
        )


def _wake(values: Values, momentum_wake: bool) -> None:
    """Add notes on the induction and the other models of AeroDyn."""
    vortex = values["wake"] == 3 and not momentum_wake
    if values["wake"] == 3 and momentum_wake:
        values.note("approximated", "wake", "momentum theory instead of a vortex wake, as requested")
    if not vortex:
        values.unneeded("of a vortex wake: see Wake_Mod", "olaf")
    values.differs("ignored", True, tangential="always on", use_moment="always on")
    values.differs("approximated", 1, bem="momentum theory of meltemi, see docs/theory/aerodynamics.md")
    if values.given("tower_potential", 0) == 2:
        values.note("approximated", "tower_potential", "potential flow without Bak's correction")
    if values.given("table_mode", 1) == 2:
        values.note("approximated", "table_mode", "polars are taken at one Reynolds number, the first")
    if values.given("dynamic_wake", 0) == -1:
        values.note("approximated", "dynamic_wake", "a quasi-steady wake: a frozen wake is for linearisation only")
    if _dynamic(values, momentum_wake) not in (1, 3):
        values.unneeded("of DBEMT_Mod 1 and 3", "wake_time")
    if values.given("wake", 1) == 0 or vortex:
        names = ("tip_loss", "hub_loss", "axial_drag", "tangential_drag", "skew", "skew_redistribution", "dynamic_wake")
        values.unneeded("of momentum theory: see Wake_Mod", *names, "wake_time", "tangential", "bem")
    if values.given("unsteady", 0) not in (0, 4):
        values.note("approximated", "unsteady", "the model of Hansen, Gaunaa and Madsen (UA_Mod 4)")


def _polars(aero: InputFile, values: Values, notes: Notes) -> Polars:
    entry = aero.require(["NumAFfiles"], "number of airfoil files")
    first = aero.require(["AFNames"], "name of the first airfoil file")
    paths = []
    named = [(i, text) for i, text in enumerate(aero.lines[first.line - 1 :], first.line) if is_content(text)]
    for i in range(aero.count(entry)):
        line, text = named[i] if i < len(named) else (len(aero.lines), "")
        tokens, text = text.split(), text.strip()
        name = text.split('"')[1] if text.count('"') > 1 else text.split("'")[1] if text.count("'") > 1 else text[:60]
        path = aero.file(name, line) if text and (text[0] in "\"'" or i == 0 or len(tokens) == 1) else None
        if path is None:
            raise InputError(
                f"{aero.at(line)}: expected the name of airfoil file {i + 1} of {aero.count(entry)} in quotes "
                f"(NumAFfiles, line {entry.line}), found {text[:40]!r}"
            )
        paths.append(path)
    columns = {
        name: values.given(f"column_{name}", place)
        for name, place in (("alpha", 1), ("lift", 2), ("drag", 3), ("moment", 4))
    }
    for name, place in columns.items():
        if not 0 <= place <= 20 or (place == 0 and name != "moment"):
            raise InputError(
                f"{aero.path.parent / values.source[f'column_{name}']}: expected a column from 1, found {place}"
            )
    if not paths:
        raise InputError(f"{aero.at(entry.line)}: NumAFfiles: at least one airfoil is needed")
    return read_airfoils(paths, columns, values.given("table_mode", 1), notes)


def _structure(main: InputFile, elastodyn: InputFile, v: Values, blade: BladeChoice, notes: Notes) -> dict[str, Any]:
    length = v["tip_radius"] - v["hub.radius"]
    if not length > 0.0:
        raise InputError(f"{elastodyn.path}: TipRad must be larger than HubRad")
    if blade not in ("deck", "elastodyn", "beamdyn"):
        raise InputError(f"blade: {blade!r}: {did_you_mean(str(blade), ['deck', 'elastodyn', 'beamdyn'])}")
    matrices = blade == "beamdyn" or (blade == "deck" and v["comp_elast"] == 2)
    try:
        path = v.file(main, "beamdyn")
    except InputError:
        if matrices:
            raise
        path = None
        v.note("ignored", "beamdyn", "the file does not exist, and the deck does not need it")
    if matrices:
        v.unneeded("of ElastoDyn's blades", "blade_file")
        if path is None:
            raise InputError(f"{main.path}: BDBldFile(1) names no BeamDyn file")
        return read_beamdyn(read_input(path, "BeamDyn"), length, notes)
    blade_file = v.file(elastodyn, "blade_file")
    if blade_file is None:
        raise InputError(f"{elastodyn.path}: BldFile(1) names no file, but the blades are ElastoDyn's")
    structure = read_elastodyn_blade(read_input(blade_file, "ElastoDyn blade"), length, notes)
    v.differs("ignored", 0.0, tip_mass="tip brakes are not modelled")
    if path is not None:
        try:
            of_beam = read_beamdyn(read_input(path, "BeamDyn"), length, Notes())
        except (InputError, UnsupportedError) as error:
            v.note("ignored", "beamdyn", f"blades without torsion: {error}; the deck does not need it")
        else:
            add_torsion(structure, of_beam, path.name, notes)
    return structure


def supplement(data: dict[str, Any], control_of: Turbine | None, extra: Mapping[str, Any], notes: Notes) -> None:
    """Replace the control by that of another turbine, and further values by those of the caller, by key path."""
    if control_of is not None:
        for name in ("control", "pitch_actuator", "rated_power"):
            value = getattr(control_of, name)
            data[name] = value.content() if isinstance(value, Record) else value
        notes.add("used", "control_of", control_of.name, "control, pitch_actuator, rated_power")
    for target, value in extra.items():
        set_keys(data, target, value)
        notes.add("used", "extra", target, "given in addition to the model")


def _machine(data: dict[str, Any], v: Values, source: str) -> None:
    """Set the values that have a key path of the turbine: hub, nacelle, drivetrain."""
    for target, value in v.data.items():
        if "." in target and value is not None:
            set_keys(data, target, value)
    data["nacelle"] |= {"mass": v["nacelle_mass"], "mass_centre": tuple(v[f"nacelle_{axis}"] for axis in "xyz")}
    data["hub"]["source"] = data["nacelle"]["source"] = source


def _drivetrain(data: dict[str, Any], v: Values) -> None:
    d = data["drivetrain"]
    if not d.get("stiffness"):
        d.pop("stiffness", None)
    if d.get("generator_inertia") == 0.0:
        d["generator_inertia"] = 1e-3 * max(data["hub"]["inertia"], 1.0) / d["gear_ratio"] ** 2
        v.note("approximated", "drivetrain.generator_inertia", "a thousandth of the hub's, as it may not be zero")
    if "stiffness" not in d and v.given("drivetrain", True) is False:
        d["stiffness"] = RIGID_SHAFT**2 * d["generator_inertia"] * d["gear_ratio"] ** 2
        d["damping"] = 0.1 * d["stiffness"] / RIGID_SHAFT
        why = "the shaft is rigid (DrTrDOF): 10 Hz with the generator alone, damping ratio 5 %, where it is free"
        v.note("approximated", "drivetrain.stiffness", why)


def _control(  # noqa: C901 - a branch for each kind of control
    main: InputFile, data: dict[str, Any], v: Values, discon: Path | None, control_of: Turbine | None
) -> dict[str, Any]:
    """Set controller, actuator and yaw drive; returns the controller library of the deck."""
    library: dict[str, Any] = {}
    notes, given = v.notes, discon is not None
    servo = v.file(main, "servo") if v.given("comp_servo", 1) == 1 else None
    if servo is not None:
        file = v.read(read_input(servo, "ServoDyn"))
        data["yaw"] = {"source": servo.name}
        if dampers := read_mass_dampers(file, v, data["tower"]["position"][-1] - data["tower"]["position"][0], notes):
            data["mass_dampers"] = dampers
        for name, target in (("stiffness", "yaw_stiffness"), ("damping", "yaw_damping"), ("rate", "yaw_rate")):
            if v[target] is not None:
                data["yaw"][name] = v[target]
        if "drivetrain.generator_efficiency" in v.data and v["drivetrain.generator_efficiency"]:
            set_keys(data, "drivetrain.generator_efficiency", v["drivetrain.generator_efficiency"])
        if v.given("brake_torque", 0.0) > 0.0:
            set_keys(data, "drivetrain.brake_torque", v["brake_torque"])
        torque = simple_torque(v) if v.given("torque_mode", 0) == 1 else None
        if v.given("torque_mode", 0) != 1:
            v.unneeded("of VSContrl 1", *(f"simple_{name}" for name in SIMPLE))
        if torque is not None and v.given("pitch_mode", 0) == 0:
            data["control"] = fixed_pitch(torque, v.given("pitch", 0.0), v["drivetrain.gear_ratio"], servo.name)
            if control_of is None:
                why = "blades keep their initial pitch, as PCMode is 0; control_of= (--control-of) gives other control"
                v.note("warning", "pitch", why)
        elif torque is not None:
            set_keys(data, "control.torque", torque)
        if 5 in (v["pitch_mode"], v["torque_mode"]):
            step = v["library_step"]
            every = step is None or v["time_step"] is None or step <= 1.001 * v["time_step"]
            keys = {"procedure": v.given("procedure", "DISCON"), "individual_pitch": v.given("individual", 1) == 1}
            library = {"library": v["library"], "input": None, "step": None if every else step, **keys}
            for target in ("pitch_mode", "torque_mode"):
                if v[target] != 5:
                    v.note("approximated", target, "the controller library has both pitch and torque")
            discon = discon or _named_settings(file, v)
            library["input"] = None if discon is None else str(discon)
        else:
            names = ("library", "library_input", "library_step", "procedure", "individual")
            v.unneeded("of a controller library: see PCMode, VSContrl", *names)
    if discon is not None:
        _discon(discon, data, v, notes if control_of is None else Notes(), must=given)
        if control_of is not None:
            why = "the control is that of control_of; without GenEff of ServoDyn VS_GenEff counts, and Y_Rate"
            notes.add("not needed", discon.name, "settings of ROSCO", why)
    yaw = data.setdefault("yaw", {})
    if not yaw.get("stiffness"):
        yaw["stiffness"] = LEAST_YAW_FREQUENCY**2 * max(data["nacelle"]["yaw_inertia"], 1.0)
        yaw["damping"] = 0.02 * yaw["stiffness"] / LEAST_YAW_FREQUENCY
        notes.add("approximated", "yaw bearing", "no YawSpr", "yaw frequency 2 Hz, damping ratio 1 %")
    yaw.setdefault("damping", 0.0)
    if yaw.get("rate") and yaw["rate"] >= 0.2:
        yaw.pop("rate")
    if not library.get("step"):
        v.unneeded("the time step follows from the highest frequency of the model", "time_step", "library_step")
    if not (v.given("pitch_free", False) and data.get("pitch_actuator", {}).get("kind") == "second_order"):
        drive = ("pitch_inertia", "bearing_inertia", "pitch_stiffness", "pitch_damping")
        v.unneeded("of PitchDOF, with ROSCO", *drive)
        if v.given("pitch_free", False):
            v.note("ignored", "pitch_free", "the pitch actuator is that of the controller")
    return library


def _named_settings(file: InputFile, v: Values) -> Path | None:
    """The controller input file named by ServoDyn, if it exists."""
    try:
        return v.file(file, "library_input")
    except InputError:
        v.note("ignored", "library_input", "there is no such file")
        return None


def _discon(path: Path, data: dict[str, Any], v: Values, notes: Notes, *, must: bool) -> None:
    """Controller and actuator from ROSCO settings; ``must``: the user gave the file, so it has to be valid."""
    discon = read_input(path, "DISCON")
    if discon.find("PC_GS_KP") is None:
        if must:
            raise InputError(f"{path}: not the settings of ROSCO (a DISCON.IN): no PC_GS_KP in it")
        v.note("ignored", "library_input", "not ROSCO's settings (no PC_GS_KP); the library itself can be run")
        return
    settings = Values(notes, discon)
    control, actuator = from_discon(settings, notes)
    data["control"], data["pitch_actuator"] = control | {"discon": str(path.absolute())}, actuator
    data["rated_power"] = settings["rated_power"]
    efficiency = v.given("drivetrain.generator_efficiency", settings.given("efficiency", 1.0))
    set_keys(data, "drivetrain.generator_efficiency", efficiency)
    if settings["yaw_rate"]:
        data.setdefault("yaw", {})["rate"] = settings["yaw_rate"]
        v.unneeded("that of ROSCO's settings is used", "yaw_rate")
    stiffness = v.given("pitch_stiffness", 0.0)
    inertia = v.given("pitch_inertia", 0.0) + v.given("bearing_inertia", 0.0)
    if v.given("pitch_free", False) and stiffness > 0.0 and inertia > 0.0:
        w = math.sqrt(stiffness / inertia)
        actuator |= {
            "kind": "second_order",
            "natural_frequency": w,
            "damping_ratio": max(v.given("pitch_damping", 0.0) * w / (2.0 * stiffness), 0.01),
        }


def _require_complete(path: Path, data: dict[str, Any]) -> None:
    """Raise an error that names the data missing in the deck."""
    control = data.get("control", {})
    wanted = {
        "drivetrain.stiffness": ("[N m/rad]", "stiffness" in data["drivetrain"]),
        "control.torque": ("table of the torque control", "torque" in control),
        "control.pitch": ("gains and limits of the pitch control", "pitch" in control),
        "control.filter_frequency": ("[rad/s]", "filter_frequency" in control),
        "rated_power": ("[W]", "rated_power" in data or "torque" in control),
    }
    missing = [f"  {name}: {what}" for name, (what, present) in wanted.items() if not present]
    if not wanted["drivetrain.stiffness"][1]:
        raise InputError(
            f"{path}: DTTorSpr is 0 in ElastoDyn's file although the shaft twists (DrTrDOF True): expected a stiffness "
            "[N m/rad], or DrTrDOF False; or give drivetrain.stiffness by extra={...} (--extra)"
        )
    if missing:
        raise InputError(
            f"{path}: missing in the deck (its controller is not ROSCO with a readable DISCON.IN):\n"
            + "\n".join(missing)
            + "\nspecify ROSCO's settings (discon='DISCON.IN'), a turbine with such control (control_of=...), or "
            "values by these key paths (extra={...}); to `meltemi import`: --discon, --control-of, --extra"
        )
    if "rated_power" not in data:
        efficiency = data["drivetrain"].get("generator_efficiency", 1.0)
        data["rated_power"] = control["torque"]["rated_power"] * efficiency
    if "pitch_actuator" not in data:
        pitch = control["pitch"]
        data["pitch_actuator"] = {
            "kind": "ideal",
            "rate_limit": pitch.get("rate_limit", IDEAL_RATE),
            "minimum": pitch["minimum"],
            "maximum": pitch["maximum"],
        }


def _validated(data: dict[str, Any], path: Path, v: Values) -> Turbine:
    try:
        return validated(data, Turbine, str(path))
    except InputError as error:
        lines = []
        for line in str(error).splitlines():
            where = next((s for t, s in v.source.items() if f" {t}:" in line), None)
            lines.append(f"{line} ({where})" if where else line)
        raise InputError("\n".join(lines)) from None


def _options(turbine: Turbine, v: Values, aero: Values, polars: Polars, momentum_wake: bool) -> dict[str, Any]:
    """Degrees of freedom and models of the deck, with OpenFAST 5 defaults."""
    locked = [name for name in ("drivetrain", "generator", "yaw") if v.given(name, True) is False]
    flexible = turbine.blade.structure.stiffness_matrix is not None
    options: dict[str, Any] = {
        "fore_aft_modes": int(v.given("fore_aft_1", True)) + int(v.given("fore_aft_2", True)),
        "side_side_modes": int(v.given("side_side_1", True)) + int(v.given("side_side_2", True)),
        "locked": tuple(locked),
        "wake": "none" if aero["wake"] == 0 else "momentum",
        "tip_loss": aero.given("tip_loss", True),
        "hub_loss": aero.given("hub_loss", True),
        "axial_drag": aero.given("axial_drag", False),
        "tangential_drag": aero.given("tangential_drag", False),
        "skew": "glauert" if _skewed(aero) else "none",
        "inflow": {2: "variable", 1: "constant", 3: "constant"}.get(_dynamic(aero, momentum_wake), "quasi_steady"),
        "inflow_time": aero.given("wake_time", 4.0),
        "stall": "static" if aero.given("unsteady", 0) == 0 else "hansen",
        "tower_influence": _influence(aero),
        "tower_drag": aero.given("tower_drag", False),
        "blade_nodes": tuple(np.asarray(turbine.blade.aerodynamics.position).tolist()),
    }
    options |= _yaw(v)
    advanced = options["advanced"] = {"chord_angle": "openfast"}
    if options["stall"] != "static":
        options["stall_constants"] = polars.constants
        advanced |= {"stall_rotation": "openfast", "reversed_flow": "static"}
        lifting = [airfoil for airfoil in turbine.airfoils.values() if airfoil.dynamic_stall]
        if all(None not in (airfoil.zero_lift_angle, airfoil.zero_lift_drag) for airfoil in lifting):
            advanced["stall_fit"] = "openfast"
    if options["inflow"] != "constant":
        del options["inflow_time"]
    if not flexible:
        options |= {
            "flap_modes": int(v.given("flap_1", True)) + int(v.given("flap_2", True)),
            "edge_modes": int(v.given("edge", True)),
            "torsion_modes": 0,
            "blade_model": "modal",
        }
        shapes = turbine.blade.structure.mode_shapes is not None and turbine.tower.mode_shapes is not None
        if shapes and turbine.foundation is None:
            options["mode_shapes"] = "given"
    return options


def _yaw(v: Values) -> dict[str, Any]:
    """Yaw angle and yaw bearing: the spring is neutral at ``YawNeut``, the reference of the controller's yaw rates."""
    sprung = v.given("yaw", True) and v["yaw_neutral"] is not None
    angle = v.given("yaw_neutral" if sprung else "nacelle_yaw", 0.0)
    if sprung and v.given("nacelle_yaw", angle) != angle:
        v.note("ignored", "nacelle_yaw", "YawSpr turns the nacelle to YawNeut, where simulations start")
    if not sprung:
        v.unneeded("of YawDOF True", "yaw_neutral")
    mode = v.given("yaw_mode", 0)
    if mode == 5 and not v.given("yaw", True):
        v.unneeded("of YawDOF True", "yaw_mode")
    elif mode not in (0, 5):
        v.note("ignored", "yaw_mode", "yaw is set by a controller of meltemi, or by a library (5)")
    driven = {"yaw": "driven"} if mode == 5 and v.given("yaw", True) else {}
    return driven | ({"nacelle_yaw": angle} if angle else {})


def _influence(aero: Values) -> str:
    shadow = {"1": "powles", "2": "eames", "t": "powles", "true": "powles"}.get(str(aero["tower_shadow"]).lower())
    return shadow or ("potential" if aero.given("tower_potential", 0) else "none")


def _dynamic(aero: Values, momentum_wake: bool) -> int:
    if aero["wake"] == 3 and momentum_wake:
        return 2
    if "dynamic_wake" not in aero.data or aero.source["wake"].split(" ")[1].lower() == "wakemod":
        return aero.given("dynamic_wake", 2) if aero["wake"] == 2 else 0  # before version 4: only with WakeMod 2
    return int(aero.given("dynamic_wake", 0))


def _skewed(aero: Values) -> bool:
    if "skew" not in aero.data:
        return True
    old = aero.source["skew"].split(" ")[1].lower() == "skewmod"
    if old:
        return bool(aero.given("skew", 2) == 2)
    return bool(aero.given("skew", 1) == 1 and aero.given("skew_redistribution", 1) == 1)
