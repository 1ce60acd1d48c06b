"""The IEA 15 MW on the VolturnUS-S, on moving lines, against OpenFAST with MoorDyn, driven by the same waves.

The turbine is that of the OpenFAST deck that the package rosco brings, with the platform of the library's
iea15mw-volturnus. The rotor is parked with blades at 90 degrees, there is no air.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from meltemi.control.constant import ConstantController
from meltemi.environment.site import Environment
from meltemi.io import read_openfast
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.simulate import simulate
from meltemi.simulation.start import Start
from meltemi.turbine.library import load_turbine
from meltemi_sea.given import ComponentSea
from meltemi_verification.offshore import PARKED
from meltemi_verification.table import Comparison, Row, at_least, relative
from meltemi_verification.turbulent import thinned

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
RELEASED = {"F2_surge8": ("PtfmSurge", 136.0), "F2_heave3": ("PtfmHeave", 20.6), "F2_pitch8": ("PtfmPitch", 28.9),
            "F2_yaw8": ("PtfmYaw", 91.0)}  # fmt: skip
"""What swings in a decay, and in about how many seconds."""
BAND, TENSION, DECAY, CORRELATION = 1.0, 3.0, 2.0, 0.999
"""[%] of standard deviations of motions and forces, of tensions, and in decays; of all series in waves [-]."""
PERIOD, DAMPING = 0.5, 3.0
"""[%] of the mean period of a decay, and of its mean damping per cycle."""


def floating_model(drift: Any = "none", line_model: Any = "dynamic", **changes: Any) -> BladedModel:
    """The turbine of the deck on its platform, with degrees of freedom as in the runs of OpenFAST."""
    turbine = read_openfast(Path(str(distribution("rosco").locate_file(DECK))), fixed_base=True)
    own = load_turbine("iea15mw-volturnus")
    assert own.platform is not None
    platform = own.platform.replace(drift=drift, line_model=line_model, segments=50)
    options = ModelOptions(**PARKED | {"time_step": 0.0125} | changes)
    turbine = turbine.replace(foundation=own.foundation, platform=platform)
    model = build(turbine, options, Environment(gravity=9.81))
    return model.with_parameters(**{"aerodynamics.air_density": 0.0})


def base_at(surge: float, heave: float, pitch: float, yaw: float, height: float = 15.0) -> dict[str, float]:
    """Coordinates of the tower base ``height`` [m] above a platform's point at [m], [deg]."""
    turn = Rotation.from_euler("ZYX", np.radians([yaw, pitch, 0.0]))
    arm, angle = turn.apply([0.0, 0.0, height]), turn.as_rotvec()
    place = [surge + arm[0], arm[1], heave + arm[2] - height, *angle]
    names = ("surge", "sway", "heave", "roll", "pitch", "yaw")
    return {f"base {name}": float(value) for name, value in zip(names, place, strict=True)}


def floating_run(case: str, duration: float, **changes: Any) -> Result:
    """Our run of a case."""
    settings, waves = CASES[case], thinned("floating_runs").get(f"{case}_waves")
    sea = None
    if waves is not None:
        frequency, amplitude, phase, direction = waves.T
        sea = ComponentSea(frequency=frequency, amplitude=amplitude, phase=phase, direction=-float(direction[0]))
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


def floating() -> Comparison:
    """Decays, regular waves in two headings, an irregular sea without and with difference frequencies."""
    rows: list[Row] = []
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
    return Comparison("floating", "IEA 15 MW on the VolturnUS-S with moving lines", source, rows)
