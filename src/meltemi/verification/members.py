"""Jacket and tripod of many members in waves and wind against OpenFAST 5.0 (SubDyn, HydroDyn), in the same waves.

The runs lie in one folder: ``series`` of the channels, ``waves``, ``decks``, and a wind box beside it. The NREL 5 MW is
parked without air, blades at 90 deg, or turns; as there, the frame has given shapes and plates at all joints.

The further column has the deviation from what equilibrium and symmetry make of OpenFAST's channels: reactions are those
to its loads of water and tower, axial forces of legs the mean of two that are mirror images in waves along the axis.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.modes import natural_modes
from meltemi.bladed_controllers.controller import BladedController
from meltemi.bladed_controllers.rosco import edit_discon, find_rosco
from meltemi.control.constant import ConstantController
from meltemi.core.errors import InputError
from meltemi.environment.site import Environment
from meltemi.frames.definition import EndCoefficients
from meltemi.postprocess.fatigue import damage_equivalent_load, usual_slope
from meltemi.postprocess.files.openfast import si_unit
from meltemi.sea.given import ComponentSea
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.simulate import simulate
from meltemi.simulation.start import Start
from meltemi.turbine.library import load_turbine
from meltemi.verification.openfast_deck import deck_options, deck_turbine
from meltemi.verification.table import Check, CheckStudy, CheckTable, phase, relative
from meltemi.wind.fields import SteadyWind
from meltemi.wind_files import read_bts

Float = NDArray[np.float64]
Series = dict[str, Float]


class Case(NamedTuple):
    """A case: bands [%] of base, legs, braces, and equivalent loads; period [s] of a regular wave; plates; begin of the
    compared part [s]; wind [m/s] or box; rotor speed [rpm] and pitch [deg] at the start."""

    bands: tuple[float, float, float] = (1.0, 2.0, 5.0)
    damage: float = 0.0
    period: float = 0.0
    ends: float = 1.0
    begin: float = 20.0
    wind: float | str = 0.0
    rotor_speed: float = 0.0
    pitch: float = 90.0


CASES = {
    "J2_decay_dry": Case(),
    "J3_H6T10": Case(period=10.0),
    "J3_H6T10_noends": Case(period=10.0, ends=0.0),
    "J3_H6T10_dir45": Case(period=10.0),
    "T3_H6T10": Case(period=10.0),
    "J4_Hs6Tp10": Case(begin=30.0),
    "J5_12": Case((1.0, 1.0, 2.0), 2.0, begin=30.0, wind=12.0, rotor_speed=12.1, pitch=3.83),
    "J6_20": Case((2.0, 2.0, 2.0), 3.0, begin=30.0, wind="vkm20_s1.bts", rotor_speed=12.1, pitch=17.5),
}
HERTZ = {"1st tower side-side": 0.3106, "1st tower fore-aft": 0.3136}
"""Of the dry decay, in the README of the runs."""
BASE, TURBINE = "HydroFxi HydroMyi ReactFXss ReactMYss".split(), "TwrBsMyt RootMyc1".split()
LEGS = {f"M{i + 1}N1FKze": f"pile{x}-grout{x}" for i, x in enumerate("ABCD")}
LEGS |= {f"M{i + 5}N1FKze": f"{x}1-{x}2" for i, x in enumerate("ABCD")}
BRACES = {"M17N1FKze": "A1-AB1", "M18N1FKze": "A2-DA2", "M19N1FKze": "A3-DA3", "M20N1FKze": "B3-BC3"}
FEET = {f"M{i + 9}N1FKze": f"foot{x}-ring{x}" for i, x in enumerate("ABC")}
MIRRORED = {f"M{a}N1FKze": f"M{b}N1FKze" for a, b in ((1, 4), (4, 1), (2, 3), (3, 2), (5, 8), (8, 5), (6, 7), (7, 6))}
STEP, TIME_STEP = 0.05, 0.005
"""[s] between records, and of our runs."""
FLOOR = 0.1
"""Share of the largest range of a member's force to which small amplitudes are compared."""
SLOW = 0.9
"""[Hz] the turning turbine is compared below it, too: second modes of the tower ring beside six times the rotation."""


def studies(folder: Path) -> tuple[CheckStudy, ...]:
    """The comparisons for the runs that are in a folder.

    Raises:
      InputError: it has none.
    """
    here = [name for name in CASES if (folder / "series" / f"{name}.npz").is_file()]
    if not here:
        raise InputError(f"--members {folder}: none of the runs series/{', '.join(CASES)}.npz in it")
    rosco = {"J6_20": ("the jacket under ROSCO", ("rosco",))}
    return tuple(CheckStudy(10.0, partial(compared, name, folder), *rosco.get(name, ())) for name in here)


def compared(name: str, folder: Path) -> CheckTable:
    """The comparison with a run."""
    rows = loads(name, folder) if "decay" not in name else frequencies(name)
    title = f"NREL 5 MW on its {'tripod' if name[0] == 'T' else 'jacket'}, case {name}"
    return CheckTable(f"members {name}", title, "OpenFAST v5.0.0 with SubDyn, HydroDyn", rows, "in equilibrium")


def model_of(name: str, *, dry: bool = False) -> BladedModel:
    """The turbine with degrees of freedom, air, plates and damping as in a run; ``dry`` without water."""
    case, turbine = CASES[name], load_turbine("nrel5mw-tripod" if name[0] == "T" else "nrel5mw-jacket")
    assert turbine.frame is not None
    ends = EndCoefficients(drag=case.ends, added_mass=case.ends, pressure=case.ends)
    heave = np.diag([0.0, 0.0, 1.066e6, 0.0, 0.0, 0.0])
    # braces of the tripod end in the column at still water, in HydroDyn's file 0.9 m above: no pressure on their ends
    dry_ends = {"column4": ends.replace(pressure=0.0)}
    changes = {"other_ends": dry_ends} if name[0] == "T" else {"interface_damping": heave}
    frame = turbine.frame.replace(damping=0.0, ends=ends, **changes)
    if dry:
        members = {each: member.replace(flooded=False) for each, member in frame.members.items()}
        frame = frame.replace(water_density=1e-9, growth=(), members=members)
    turbine = deck_turbine(turbine).replace(tower=turbine.tower, frame=frame)
    locked = ("drivetrain", "yaw") if isinstance(case.wind, str) else ("generator", "drivetrain", "yaw")
    options = deck_options(turbine, "A", locked=locked, time_step=TIME_STEP)
    model = build(turbine, options, Environment(gravity=9.80665))
    return model if case.wind else model.with_parameters(**{"aerodynamics.air_density": 0.0})


def frequencies(name: str) -> list[Check]:
    """Those of the parked turbine without water."""
    modes = natural_modes(model_of(name, dry=True), 0.0, pitch=0.5 * np.pi)
    hertz = {mode.name: mode.frequency / (2.0 * np.pi) for mode in reversed(modes)}
    return [relative(what, name, "Hz", reference, hertz[what], 0.5) for what, reference in HERTZ.items()]


def loads(name: str, folder: Path) -> list[Check]:
    """Amplitude and phase in regular waves, else standard deviations and in wind equivalent loads."""
    case, theirs = CASES[name], series(folder / "series" / f"{name}.npz")
    members = FEET if name[0] == "T" else LEGS if case.period else LEGS | BRACES
    floor = FLOOR * max(float(np.ptp(theirs[key])) for key in members) if case.period else 0.0
    channels = {key: key for key in (*BASE, *(TURBINE if case.wind else ()))}
    channels |= {key: f"member_{member}_start_force_z" for key, member in members.items()}
    result = run(name, folder, theirs, tuple(channels.values()))
    rows: list[Check] = []
    for key, channel in channels.items():
        unit, slope = result.channel(channel).unit, usual_slope(result.channel(channel))
        measure = partial(measures, case, theirs["Time"], None if key.startswith("Hydro") else slope)
        ours, reference = measure(result[channel]), measure(theirs[key])
        other = in_equilibrium(key, theirs, mirrored=not case.wind and name[-2:] != "45")
        equal = {} if other is None else measure(other)
        for what, value in reference.items():
            if what == "phase":
                rows += [phase(f"{key} {what}", name, value, ours[what], 1.0)] if key in BASE else []
                continue
            band = case.damage if "DEL" in what else case.bands[2 if key in BRACES else key in members]
            beside = 100.0 * (ours[what] / equal[what] - 1.0) if equal else None
            rows.append(
                relative(
                    f"{key} {what}", name, unit, value, ours[what], band, floor=floor * (key in members), beside=beside
                )
            )
    return rows


def measures(case: Case, time: Float, slope: float | None, x: Float) -> dict[str, float]:
    """Statistics of a series of a case: of the first harmonic over two waves, or of the whole compared part."""
    begin = round(case.begin / STEP)
    if case.period:
        some = slice(begin, begin + round(2.0 * case.period / STEP))
        first = complex(2.0 * np.mean(x[some] * np.exp(-2j * np.pi / case.period * time[some])))
        return {"amplitude": abs(first), "phase": float(np.angle(first))}
    x = x[begin:] - x[begin:].mean()
    result = {"std": float(x.std())}
    if case.wind:
        waves = np.fft.rfft(x)
        waves[np.fft.rfftfreq(len(x), STEP) > SLOW] = 0.0
        slow = np.fft.irfft(waves, len(x))
        result[f"std below {SLOW} Hz"] = float(slow.std())
        if slope:
            duration = STEP * (len(x) - 1)
            result[f"DEL below {SLOW} Hz"] = damage_equivalent_load(slow, duration=duration, slope=slope)
    return result


def series(path: Path) -> Series:
    """Channels of a run in SI."""
    with np.load(path) as z:
        factors = [si_unit(unit)[1] for unit in z["units"].tolist()]
        return {name: factors[i] * z["data"][:, i].astype(float) for i, name in enumerate(z["channels"].tolist())}


def in_equilibrium(key: str, x: Series, *, mirrored: bool) -> Float | None:
    """A reaction to the loads of water and tower, without the frame's small inertia, or mean of two mirrored legs."""
    jacket = "M24N1FKze" in x
    depth, top = (50.0, 68.15) if jacket else (45.0, 55.0)
    if key == "ReactFXss":
        return -x["HydroFxi"] - x["IntfFXss"]
    if key == "ReactMYss":
        return -x["HydroMyi"] - depth * x["HydroFxi"] - x["IntfMYss"] - top * x["IntfFXss"]
    return 0.5 * (x[key] + x[MIRRORED[key]]) if mirrored and jacket and key in MIRRORED else None


def run(name: str, folder: Path, theirs: Series, channels: tuple[str, ...]) -> Result:
    """Our run of a case, from the coordinates at its start."""
    case, model = CASES[name], model_of(name)
    start = {"tower 1st fore-aft": "TTDspFA", "tower 1st side-side": "TTDspSS"}
    start |= {f"frame {each.lower()}": f"Ptfm{each}" for each in ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")}
    w, a, angle, heading = np.array([[0.2 * np.pi, 3.0, 0.0, 0.0]]).T
    if (path := folder / "waves" / f"{name}.csv").is_file():
        columns = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=(1, 3, 4, 5), ndmin=2)
        w, a, angle, heading = columns[columns[:, 1] > 1e-6].T
    sea = ComponentSea(frequency=w, amplitude=a, phase=angle, direction=-np.radians(heading[0]), stretching="none")
    wind: Any = SteadyWind(speed=case.wind or 0.1, shear_exponent=0.14) if isinstance(case.wind, float) else None
    wind = wind or read_bts(folder.parent / "openfast" / "wind" / str(case.wind))
    controller: Any = ConstantController()
    with TemporaryDirectory() as scratch:
        if isinstance(case.wind, str):
            settings = edit_discon(folder / "decks/base/DISCON.IN", Path(scratch) / "DISCON.IN", LoggingLevel=0)
            controller = BladedController(model.turbine, find_rosco(), settings, sample_time=STEP)
        coordinates = {ours: float(theirs[name][0]) for ours, name in start.items()}
        return simulate(
            model, wind, duration=float(theirs["Time"][-1]), sea=sea, controller=controller, channels=channels,
            start=Start(case.rotor_speed * np.pi / 30.0, np.radians(case.pitch), coordinates=coordinates),
            output_step=STEP,
        )  # fmt: skip
