"""Jacket and tripod of many members in waves and wind against OpenFAST 5.0 (SubDyn, HydroDyn), in the same waves.

The runs lie in one folder: ``series`` of the channels, ``waves``, ``decks``, for the last case a wind box anywhere
above. The NREL 5 MW is parked without air, blades at 90 deg, or turns; there are plates at joints as in those decks.
The further column has the deviation from what equilibrium and symmetry make of OpenFAST's channels: reactions are those
to its loads of water and tower, and axial forces of legs the mean of both that mirror each other in the waves.
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
from meltemi.postprocess.fatigue import damage_equivalent_load
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


class Case(NamedTuple):
    """A case: bands [%] of base loads, legs and braces, and of equivalent loads; period [s] of regular waves; plates at
    joints; begin of the comparison [s]; wind [m/s] or box; rotor speed [rpm] and pitch [deg] at the start."""

    bands: tuple[float, float, float] = (1.0, 2.0, 5.0)
    damage: float | None = None
    period: float | None = None
    ends: float = 1.0
    begin: float = 20.0
    wind: float | str | None = None
    rotor_speed: float = 0.0
    pitch: float = 90.0


CASES = {
    "J3_H6T10": Case(period=10.0),
    "J3_H6T10_noends": Case(period=10.0, ends=0.0),
    "J3_H6T10_dir45": Case(period=10.0),
    "J4_Hs6Tp10": Case(begin=30.0),
    "T3_H6T10": Case(period=10.0),
    "J5_12": Case((1.0, 1.0, 1.0), 2.0, wind=12.0, rotor_speed=12.1, pitch=3.83),
    "J6_20": Case((2.0, 2.0, 2.0), 3.0, wind="vkm20_s1.bts", rotor_speed=12.1, pitch=17.5),
}
DECAY, HERTZ = "J2_decay_dry", {"1st side-side": 0.3106, "1st fore-aft": 0.3136, "2nd": 1.20, "2nd higher": 1.27}
"""The dry decay and its frequencies, in the README of the runs."""
BASE, TURBINE = "HydroFxi HydroMyi ReactFXss ReactMYss".split(), "TwrBsMyt RootMyc1".split()
LEGS = {f"M{i + 1}N1FKze": f"pile{x}-grout{x}" for i, x in enumerate("ABCD")} | {
    f"M{i + 5}N1FKze": f"{x}1-{x}2" for i, x in enumerate("ABCD")
}
BRACES = {"M17N1FKze": "A1-AB1", "M18N1FKze": "A2-DA2", "M19N1FKze": "A3-DA3", "M20N1FKze": "B3-BC3"}
FEET = {f"M{i + 9}N1FKze": f"foot{x}-ring{x}" for i, x in enumerate("ABC")}
MIRRORED = {"M1N": "M4N", "M2N": "M3N", "M5N": "M8N", "M6N": "M7N"}
MIRRORED |= {b: a for a, b in MIRRORED.items()}
STEP, TIME_STEP = 0.05, 0.005
"""[s] between records, and of our runs."""


def studies(folder: Path) -> tuple[CheckStudy, ...]:
    """The comparisons for the runs that are in a folder.

    Raises:
      InputError: it has none.
    """
    here = [name for name in (DECAY, *CASES) if (folder / "series" / f"{name}.npz").is_file()]
    if not here:
        raise InputError(f"--members {folder}: none of the runs series/{', '.join(CASES)}.npz in it")
    rosco = {"J6_20": ("the jacket under ROSCO", ("rosco",))}
    return tuple(CheckStudy(10.0, partial(compared, name, folder), *rosco.get(name, ())) for name in here)


def compared(name: str, folder: Path) -> CheckTable:
    """The comparison with a run."""
    rows = frequencies() if name == DECAY else loads(name, folder)
    title = f"NREL 5 MW on its {'tripod' if name[0] == 'T' else 'jacket'}, case {name}"
    return CheckTable(f"members {name}", title, "OpenFAST v5.0.0", rows, "in equilibrium")


def model_of(name: str, case: Case, *, dry: bool = False) -> BladedModel:
    """The turbine with degrees of freedom, air, plates and damping as in a run; ``dry`` without water."""
    turbine: Any = load_turbine("nrel5mw-tripod" if name[0] == "T" else "nrel5mw-jacket")
    changes: dict[str, Any] = {"ends": EndCoefficients(drag=case.ends, added_mass=case.ends, pressure=case.ends)}
    if name[0] == "J":
        changes["interface_damping"] = np.diag([0.0, 0.0, 1.066e6, 0.0, 0.0, 0.0])
    if dry:
        members = {each: member.replace(flooded=False) for each, member in turbine.frame.members.items()}
        changes |= {"water_density": 1e-9, "growth": (), "members": members}
    deck = deck_turbine(turbine).replace(tower=turbine.tower, frame=turbine.frame.replace(damping=0.0, **changes))
    locked = ("drivetrain", "yaw") if isinstance(case.wind, str) else ("generator", "drivetrain", "yaw")
    options = deck_options(deck, "A", locked=locked, time_step=TIME_STEP)
    model = build(deck, options, Environment(gravity=9.80665))
    return model if case.wind is not None else model.with_parameters(**{"aerodynamics.air_density": 0.0})


def frequencies() -> list[Check]:
    """Those of the dry jacket with parked turbine."""
    modes = natural_modes(model_of(DECAY, Case(), dry=True), 0.0, pitch=0.5 * np.pi)
    hertz = [mode.frequency / (2.0 * np.pi) for mode in modes if "tower" in mode.participation(9)]
    near = {what: min(hertz, key=lambda f: abs(f - reference)) for what, reference in HERTZ.items()}
    return [relative(what, DECAY, "Hz", HERTZ[what], found, 0.5) for what, found in near.items()]


def loads(name: str, folder: Path) -> list[Check]:
    """Amplitude and phase in regular waves, else standard deviations and in wind equivalent loads."""
    case, theirs = CASES[name], series(folder / "series" / f"{name}.npz")
    tripod, in_wind = name[0] == "T", case.wind is not None
    members = FEET if tripod else LEGS | ({} if case.period else BRACES)
    ours = {key: f"member_{member}_start_force_z" for key, member in members.items()}
    ours |= {key: key for key in (*BASE, *(TURBINE if in_wind else ()))}
    result = run(name, folder, theirs, tuple(ours.values()))
    rows: list[Check] = []
    last = len(theirs["Time"]) if not case.period else round((case.begin + 2.0 * case.period) / STEP)
    inside, time = slice(round(case.begin / STEP), last), theirs["Time"]
    for key, channel in ours.items():
        unit, x = result.channel(channel).unit, result[channel]
        y, other = theirs[key], in_equilibrium(key, theirs, symmetric=not in_wind and "dir" not in name)
        x, y, other = x[inside], y[inside], None if other is None else other[inside]
        band = case.bands[2 if key in BRACES else 1 if key[0] == "M" else 0]
        if case.period:
            turn = 2.0 * np.exp(-2j * np.pi / case.period * time[inside])
            a, b = complex(np.mean(x * turn)), complex(np.mean(y * turn))
            beside = None if other is None else _percent(abs(a), abs(complex(np.mean(other * turn))))
            rows.append(relative(f"{key} amplitude", name, unit, abs(b), abs(a), band, beside=beside))
            if key in BASE:
                rows.append(phase(f"{key} phase", name, float(np.angle(b)), float(np.angle(a)), 1.0))
            continue
        beside = None if other is None else _percent(float(x.std()), float(other.std()))
        rows.append(relative(f"{key} std", name, unit, float(y.std()), float(x.std()), band, beside=beside))
        if case.damage and not key.startswith("Hydro"):
            slope, span = 10.0 if key.startswith("Root") else 4.0, STEP * (len(x) - 1)
            a, b, c = (damage_equivalent_load(s, duration=span, slope=slope) for s in (x, y, y if other is None else other))
            beside = None if other is None else _percent(a, c)
            rows.append(relative(f"{key} DEL", name, unit, b, a, case.damage, beside=beside))
    return rows


def _percent(ours: float, reference: float) -> float:
    return 100.0 * (ours / reference - 1.0)


def series(path: Path) -> dict[str, Float]:
    """Channels of a run in SI."""
    with np.load(path) as z:
        units, data = z["units"].tolist(), z["data"].astype(float)
        return {str(c): data[:, i] * si_unit(units[i])[1] for i, c in enumerate(z["channels"].tolist())}


def in_equilibrium(key: str, x: dict[str, Float], *, symmetric: bool) -> Float | None:
    """What equilibrium with the loads on the frame, whose inertia is small, and its symmetry make of a channel."""
    depth, top = (45.0, 55.0) if "M24N1FKze" not in x else (50.0, 68.15)
    if key == "ReactFXss":
        return -(x["HydroFxi"] + x["IntfFXss"])
    if key == "ReactMYss":
        return -(x["HydroMyi"] + depth * x["HydroFxi"] + x["IntfMYss"] + top * x["IntfFXss"])
    if symmetric and "M24N1FKze" in x and key[:3] in MIRRORED:
        return 0.5 * (x[key] + x[MIRRORED[key[:3]] + key[3:]])
    return None


def run(name: str, folder: Path, theirs: dict[str, Float], channels: tuple[str, ...]) -> Result:
    """Our run of a case, from the displacements at its start."""
    case, model = CASES[name], model_of(name, CASES[name])
    sea = ComponentSea(frequency=[0.2 * np.pi], amplitude=[3.0], phase=[0.0], stretching="none")
    if (path := folder / "waves" / f"{name}.csv").is_file():
        _, w, _, a, angle, heading = np.atleast_2d(np.genfromtxt(path, delimiter=",", skip_header=1)).T
        some = a > 1e-6
        sea = ComponentSea(frequency=w[some], amplitude=a[some], phase=angle[some], direction=-np.radians(heading[0]), stretching="none")  # fmt: skip
    wind: Any = SteadyWind(speed=case.wind or 0.1, shear_exponent=0.14, reference_height=90.0) if not isinstance(case.wind, str) else read_bts(next(p for p in (q / "openfast" / "wind" / case.wind for q in folder.resolve().parents) if p.is_file()))
    with TemporaryDirectory() as scratch:
        controller: Any = ConstantController()
        if isinstance(case.wind, str):
            settings = edit_discon(folder / "decks/base/DISCON.IN", Path(scratch) / "DISCON.IN", LoggingLevel=0)
            controller = BladedController(model.turbine, find_rosco(), settings, sample_time=STEP)
        start = Start(case.rotor_speed * np.pi / 30.0, np.radians(case.pitch), coordinates=released(theirs))
        return simulate(model, wind, duration=float(theirs["Time"][-1]), sea=sea, controller=controller, start=start, channels=channels, output_step=STEP)  # fmt: skip


def released(x: dict[str, Float]) -> dict[str, float]:
    """Coordinates of tower and frame at the start."""
    coordinates = {"tower 1st fore-aft": "TTDspFA", "tower 1st side-side": "TTDspSS"}
    coordinates |= {f"frame {each.lower()}": f"Ptfm{each}" for each in ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")}
    return {ours: float(x[name][0]) for ours, name in coordinates.items()}
