"""The IEA 15 MW on the VolturnUS-S, on moving lines, against OpenFAST with MoorDyn, driven by the same waves.

The turbine is that of the OpenFAST deck that the package rosco brings, with the platform of the library's
iea15mw-volturnus. The rotor is parked with blades at 90 degrees without air, or runs under ROSCO's own library.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import distribution
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from comparisons import thinned
from comparisons.offshore import AIR, PARKED
from meltemi.bladed_controllers.controller import BladedController
from meltemi.bladed_controllers.rosco import edit_discon, find_rosco, rosco_example
from meltemi.control.constant import ConstantController
from meltemi.control.controller import Controller
from meltemi.core.errors import InputError
from meltemi.environment.site import Environment
from meltemi.io import read_openfast
from meltemi.postprocess.fatigue import damage_equivalent_load, usual_slope
from meltemi.postprocess.files.openfast import si_unit
from meltemi.sea.given import ComponentSea
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.simulate import simulate
from meltemi.simulation.start import Start
from meltemi.turbine.definition import BaseMotion
from meltemi.turbine.library import load_turbine
from meltemi.verification.table import Check, CheckTable, at_least, relative
from meltemi.wind.fields import SteadyWind
from meltemi.wind_files import read_bts

Float64 = NDArray[np.float64]

DECK = "Examples/Test_Cases/IEA-15-240-RWT/IEA-15-240-RWT-UMaineSemi/IEA-15-240-RWT-UMaineSemi.fst"
CHANNELS = "PtfmSurge PtfmSway PtfmHeave PtfmPitch PtfmYaw HydroFxi HydroFzi FAIRTEN1 FAIRTEN2 TwrBsMyt".split()
STEP = 0.2
"""[s] between records."""
REST = (0.45, -0.3503, -1.506)
"""[m, m, deg] surge, heave and pitch at the start of a case."""
SHARE = 0.25
"""Standard deviation below this share of that in waves is not compared (heave in a decay of yaw, say)."""
SIZE = {"PtfmSurge": 1.0, "PtfmSway": 1.0, "PtfmHeave": 0.5, "PtfmPitch": 0.005, "PtfmYaw": 0.01, "HydroFxi": 3e6,
        "HydroFzi": 3e6, "FAIRTEN1": 5e4, "FAIRTEN2": 5e4, "TwrBsMyt": 4e7}  # fmt: skip


@dataclass(frozen=True)
class Float:
    """A case: offset from rest in surge, heave [m], pitch, yaw [deg]; begin of the compared part [s]; drift."""

    offset: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    begin: float = 0.0
    drift: Any = "none"


CASES = {
    "F2_surge8": Float((8.0, 0.0, 0.0, 0.0)),
    "F2_heave3": Float((0.0, 3.0, 0.0, 0.0)),
    "F2_pitch8": Float((0.0, 0.0, 8.0, 0.0)),
    "F2_yaw8": Float((0.0, 0.0, 0.0, 8.0)),
    "F3_H2T12_dir30": Float(),
    "F3_H6T10": Float(),
    "F4_Hs6Tp12": Float(begin=100.0),
    "F4_Hs6Tp12_qtf": Float(begin=100.0, drift="full"),
}


@dataclass(frozen=True)
class Wind:
    """A case with wind: steady [m/s] or a box; rotor speed [rpm], pitch [deg] and the platform's six motions [m], [deg]
    at the start; whether ROSCO controls."""

    wind: float | str
    rotor_speed: float
    pitch: float
    place: tuple[float, ...] = (REST[0], 0.0, REST[1], 0.0, REST[2], 0.0)
    rosco: bool = True


UNDER_WAY = (17.41, 0.01, -0.46, 0.42, 3.27, -0.27)
WINDS = {
    "F5_8": Wind(8.0, 5.73, 0.0),
    "F5_12": Wind(12.0, 7.56, 7.0),
    "F5_18": Wind(18.0, 7.56, 15.5),
}
TURBULENT = {
    "F7_12": Wind("kai12_s1.bts", 7.55, 7.5, UNDER_WAY, rosco=False),
    "F6_12": Wind("kai12_s1.bts", 7.56, 7.0, UNDER_WAY),
}
WIND_CHANNELS = (
    "PtfmSurge PtfmSway PtfmHeave PtfmRoll PtfmPitch PtfmYaw RotSpeed BldPitch1 GenPwr HydroFxi FAIRTEN1 FAIRTEN2 "
    "TwrBsMyt TwrBsMxt RootMyc1"
).split()
TIME_STEP = 0.0125
"""[s] of our runs."""
WIND_BEGIN, WIND_STD, WIND_DEL, CALL = 100.0, 2.0, 3.0, 0.025
"""[s] begin of the compared part; [%] of standard deviations and equivalent loads; [s] between calls of ROSCO."""
RELEASED = {"F2_surge8": ("PtfmSurge", 136.0), "F2_heave3": ("PtfmHeave", 20.6), "F2_pitch8": ("PtfmPitch", 28.9),
            "F2_yaw8": ("PtfmYaw", 91.0)}  # fmt: skip
"""What swings in a decay, and in about how many seconds."""
BAND, TENSION, DECAY, CORRELATION = 1.0, 3.0, 2.0, 0.999
"""[%] of standard deviations of motions and forces, of tensions, and in decays; of all series in waves [-]."""
PERIOD, DAMPING = 0.5, 3.0
"""[%] of the mean period of a decay, and of its mean damping per cycle."""


def floating_model(
    drift: Any = "none", line_model: Any = "dynamic", *, air: bool = False, **changes: Any
) -> BladedModel:
    """The turbine of the deck on its platform, with degrees of freedom as in the runs of OpenFAST.

    Args:
      drift, line_model: of the platform.
      air: with aerodynamics as there (set A with drag in the induction).
      changes: of the options.
    """
    turbine = read_openfast(Path(str(distribution("rosco").locate_file(DECK))), fixed_base=True)
    own = load_turbine("iea15mw-volturnus")
    assert own.platform is not None
    platform = own.platform.replace(drift=drift, line_model=line_model, segments=50)
    nodes = {"blade_nodes": tuple(turbine.blade.aerodynamics.position.tolist()), **AIR} if air else {}
    options = ModelOptions().replace(**PARKED | {"time_step": TIME_STEP} | nodes | changes)
    parts: dict[str, Any] = {"foundation": own.foundation, "platform": platform, "pitch_actuator.kind": "ideal"}
    turbine = turbine.replace(**parts)
    model = build(turbine, options, Environment(gravity=9.81))
    return model if air else model.with_parameters(**{"aerodynamics.air_density": 0.0})


def base_at(
    surge: float, heave: float, pitch: float, yaw: float, height: float = 15.0, sway: float = 0.0, roll: float = 0.0
) -> dict[str, float]:
    """Coordinates of the tower base ``height`` [m] above a platform's point at [m], [deg]."""
    turn = Rotation.from_euler("ZYX", np.radians([yaw, pitch, roll]))
    place = np.array([surge, sway, heave - height]) + turn.apply([0.0, 0.0, height])
    names = get_args(BaseMotion)
    return {f"base {name}": float(x) for name, x in zip(names, [*place, *turn.as_rotvec()], strict=True)}


def floating_run(case: str, duration: float, **changes: Any) -> Result:
    """Our run of a case."""
    settings, waves = CASES[case], thinned("floating_runs").get(f"{case}_waves")
    sea = None
    if waves is not None:
        frequency, amplitude, phase, direction = waves.T
        sea = ComponentSea(
            frequency=frequency,
            amplitude=amplitude,
            phase=phase,
            direction=-float(direction[0]),
            stretching="none",
        )
    surge, heave, pitch = (a + b for a, b in zip(REST, settings.offset[:3], strict=True))
    return simulate(
        floating_model(settings.drift, **changes),
        0.1,
        duration=duration,
        sea=sea,
        controller=ConstantController(),
        start=Start(rotor_speed=0.0, pitch=0.5 * np.pi, coordinates=base_at(surge, heave, pitch, settings.offset[3])),
        channels=CHANNELS,
        output_step=STEP,
    )


def rosco_of(deck: str, turbine: Any, folder: Path) -> Controller:
    """ROSCO with the settings of a deck, which are written into the folder."""
    name = Path(deck).relative_to("Examples").with_suffix("")
    settings = edit_discon(rosco_example(f"{name}_DISCON.IN"), folder / "DISCON.IN", LoggingLevel=0)
    return BladedController(turbine, find_rosco(), settings, sample_time=CALL)


def wind_run(case: str, duration: float, folder: Path | None) -> Result:
    """Our run of a case with wind, which for a box needs the folder of the reference runs, with its sea."""
    settings = (WINDS | TURBULENT)[case]
    surge, sway, heave, roll, pitch, yaw = settings.place
    start = Start(
        rotor_speed=settings.rotor_speed * np.pi / 30.0,
        pitch=np.radians(settings.pitch),
        coordinates=base_at(surge, heave, pitch, yaw, sway=sway, roll=roll),
    )
    wind, sea = wind_and_sea(case, settings, folder)
    locked = ("drivetrain", "yaw", *(() if settings.rosco else ("generator",)))
    model = floating_model("none" if sea is None else "full", air=True, locked=locked)
    with TemporaryDirectory() as scratch:
        rosco = rosco_of(DECK, model.turbine, Path(scratch)) if settings.rosco else ConstantController()
        return simulate(
            model, wind, duration=duration, sea=sea, controller=rosco, start=start, channels=WIND_CHANNELS,
            output_step=STEP,
        )  # fmt: skip


def wind_and_sea(case: str, settings: Wind, folder: Path | None) -> tuple[Any, ComponentSea | None]:
    """Steady wind over still water, or the box and the waves of a reference run."""
    if isinstance(settings.wind, float):
        return SteadyWind(speed=settings.wind), None
    assert folder is not None
    _, frequency, _, amplitude, phase, direction = np.genfromtxt(
        folder / f"waves/{case}.csv", delimiter=",", skip_header=1
    ).T
    sea = ComponentSea(
        frequency=frequency,
        amplitude=amplitude,
        phase=phase,
        direction=-np.radians(direction[0]),
        stretching="none",
    )
    return read_bts(folder / "wind" / settings.wind), sea


def in_wind(folder: Path | None = None) -> CheckTable:
    """Steady wind under ROSCO; with the folder of the reference runs turbulence and sea, too.

    Raises:
      InputError: the folder has no such runs.
    """
    rows: list[Check] = []
    data = thinned("floating_wind_runs")
    for case in WINDS | (TURBULENT if folder else {}):
        if case in WINDS:
            reference = data[f"{case}_counts"] * data[f"{case}_steps"]
        else:
            assert folder is not None
            reference = full_series(folder / f"series/{case}.npz", WIND_CHANNELS, STEP)
        time = STEP * np.arange(float(len(reference)))
        ours = wind_run(case, float(time[-1]), folder)
        inside = time >= WIND_BEGIN - 1e-6
        for name, series in zip(WIND_CHANNELS, reference.T, strict=True):
            rows += spread(name, case, ours, series[inside], inside, STEP, (WIND_STD, WIND_DEL))
    source = "OpenFAST v5.0.0 with SeaState, HydroDyn, MoorDyn and ROSCO 2.10.6, the same wind and waves (F5, F6, F7)"
    return CheckTable("floating wind", "IEA 15 MW on the VolturnUS-S in wind, under ROSCO", source, rows)


def spread(
    name: str, case: str, ours: Result, reference: Float64, inside: NDArray[np.bool_], step: float,
    bands: tuple[float, float],
) -> list[Check]:  # fmt: skip
    """Standard deviation and, of a load, equivalent load of a channel that varies.

    Args:
      reference: (T,) compared part of the series, every ``step`` [s].
      inside: the part of ours.
      bands: [%] of both.
    """
    y, channel = reference, ours.channel(name)
    if y.std() <= 1e-6 * abs(y.mean()):
        return []
    x = ours[name][: len(inside)][inside]
    rows = [relative(f"{name} std", case, channel.unit, float(y.std()), float(x.std()), bands[0])]
    if (slope := usual_slope(channel)) and not name.startswith("Hydro"):
        theirs, found = (damage_equivalent_load(s, duration=step * (len(y) - 1), slope=slope) for s in (y, x))
        rows.append(relative(f"{name} DEL", case, channel.unit, theirs, found, bands[1]))
    return rows


def full_series(path: Path, channels: Sequence[str], step: float) -> Float64:
    """(T, C) channels of a reference run with wind, in SI, every ``step`` [s]; zeros for those that it lacks.

    Raises:
      InputError: the file is missing.
    """
    if not path.is_file():
        raise InputError(f"--reference: {path} is missing")
    with np.load(path) as z:
        names, units, series = z["channels"].tolist(), z["units"].tolist(), z["data"].astype(float)
    every = round(step / (series[1, 0] - series[0, 0]))
    known = {name: series[::every, i] * si_unit(units[i])[1] for i, name in enumerate(names)}
    return np.stack([known.get(name, 0.0 * known["Time"]) for name in channels], axis=1)


def swings(time: Float64, x: Float64, period: float) -> tuple[float, float]:
    """Mean period [s] and logarithmic decrement per cycle [-] of a decay, from the first extreme after the release on.

    Extremes are those of parabolas through what lies within an eighth of ``period`` [s] of them; ranges between them
    know nothing of the mean.
    """
    near = round(period / 8.0 / (time[1] - time[0]))
    smooth = np.convolve(x, np.full(2 * near + 1, 1.0 / (2 * near + 1)), "valid")
    rises = np.diff(smooth) > 0.0
    at, value = [], []
    for i in np.flatnonzero(rises[1:] != rises[:-1]) + 1 + near:
        some = slice(max(i - near, 0), i + near + 1)
        a, b, c = np.polyfit(time[some] - time[i], x[some], 2)
        at.append(time[i] - 0.5 * b / a)
        value.append(c - 0.25 * b * b / a)
    cycles = 0.5 * (len(at) - 2)
    span = np.abs(np.diff(value))
    return float((at[-1] - at[0]) / (cycles + 0.5)), float(np.log(span[0] / span[-1]) / cycles)


def floating() -> CheckTable:
    """Decays, regular waves in two headings, an irregular sea without and with difference frequencies."""
    rows: list[Check] = []
    data = thinned("floating_runs")
    for case, settings in CASES.items():
        reference = data[f"{case}_counts"] * data[f"{case}_steps"]
        time = STEP * np.arange(float(len(reference)))
        ours = floating_run(case, float(time[-1]))
        inside = time >= settings.begin - 1e-6
        if case in RELEASED:
            name, about = RELEASED[case]
            theirs = swings(time, reference[:, CHANNELS.index(name)], about)
            found = swings(time, ours[name][: len(time)], about)
            rows.append(relative(f"{name} period", case, "s", theirs[0], found[0], PERIOD))
            rows.append(relative(f"{name} damping per cycle", case, "-", theirs[1], found[1], DAMPING))
        for name, series in zip(CHANNELS, reference.T, strict=True):
            x, y = ours[name][: len(time)][inside], series[inside]
            if y.std() < SHARE * SIZE[name]:
                continue
            band = TENSION if "TEN" in name else BAND if case.startswith("F4") else DECAY
            unit = ours.channel(name).unit
            rows.append(relative(f"{name} std", case, unit, float(y.std()), float(x.std()), band))
            if case.startswith("F4"):
                rows.append(at_least(f"{name} correlation", case, "-", CORRELATION, float(np.corrcoef(x, y)[0, 1])))
    source = "OpenFAST v5.0.0 with SeaState, HydroDyn, MoorDyn, the same waves (cases F2, F3, F4); no air"
    return CheckTable("floating", "IEA 15 MW on the VolturnUS-S with moving lines", source, rows)
