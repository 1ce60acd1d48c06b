"""The IEA 15 MW on its monopile in waves against OpenFAST, driven by the same waves.

The turbine is that of the OpenFAST deck that the package rosco brings, with the pile of the library's
iea15mw-monopile. The rotor is parked with blades at 90 degrees, there is no air. As ElastoDyn and SubDyn have it,
the tower deforms by its polynomials and the pile by static deflections of its top (``mode_shapes: given``); the
last rows tell what natural modes change.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import distribution
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from comparisons import thinned
from meltemi.analyses.modes import natural_modes
from meltemi.control.constant import ConstantController
from meltemi.environment.site import Environment
from meltemi.io import read_openfast
from meltemi.report.palette import COLOURS
from meltemi.report.plots import ABOVE, new_figure, panel
from meltemi.sea.current import Current
from meltemi.sea.given import ComponentSea
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.simulate import simulate
from meltemi.simulation.start import Start
from meltemi.turbine.library import load_turbine
from meltemi.verification.table import Check, CheckTable, at_least, phase, relative

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

DECK = "Examples/Test_Cases/IEA-15-240-RWT/IEA-15-240-RWT-Monopile/IEA-15-240-RWT-Monopile.fst"
CHANNELS = (
    "Wave1Elev HydroFxi HydroMyi ReactFXss ReactMYss M1N1FKxe M3N1MKye M5N1FKxe M5N1MKye TwrBsFxt TwrBsMyt TTDspFA"
).split()
STEP = 0.1
"""[s] between records."""
PARKED: dict[str, Any] = {
    "locked": ("generator", "drivetrain", "yaw"),
    "blade_model": "modal",
    "mode_shapes": "given",
    "torsion_modes": 0,
    "flap_modes": 2,
    "edge_modes": 1,
    "tower_drag": False,
}
"""Degrees of freedom of the turbine as in the runs of OpenFAST without air."""
AIR = {
    "inflow": "quasi_steady", "stall": "static", "axial_drag": True, "tangential_drag": True,
    "advanced.chord_angle": "openfast",
}  # fmt: skip
"""Aerodynamics of the runs of OpenFAST at sea."""
YAW_INERTIA = 2.5e6 + 1e8
"""[kg m^2] of the transition piece, and PtfmYIner, which the deck adds there to slow the pile's torsion."""
RELEASED = {"tower 1st fore-aft": -0.37, "pile surge": -0.016, "pile pitch": np.radians(-0.0438)}
"""[m], [rad] at the start of all runs."""


@dataclass(frozen=True)
class Waves:
    """A case: stretching, current [m/s], beginning of the compared part [s], and its period [s] if it is regular."""

    stretching: Any = "none"
    current: float = 0.0
    begin: float = 40.0
    period: float | None = None


CASES = {
    "M2_H6T10": Waves(period=10.0),
    "M2_H10T12": Waves(begin=48.0, period=12.0),
    "M2_H10T12_wheeler": Waves("wheeler", begin=48.0, period=12.0),
    "M6_H6T10_cur1": Waves(current=1.0, period=10.0),
    "M3_Hs6Tp12": Waves(),
}
FREQUENCIES = {
    "water": {"1st fore-aft": 0.1733, "blades edgewise": 0.6656, "2nd fore-aft": 1.2652},
    "air": {"1st fore-aft": 0.1733, "blades edgewise": 0.6661, "2nd fore-aft": 1.2947},
}
"""[Hz] fitted to the decay of OpenFAST after a release of the tower top."""
FREQUENCY_BAND, FORCE_BAND, PHASE_BAND, STD_BAND, CORRELATION = 0.3, 0.5, 1.0, 0.5, 0.9995
"""[%] of frequencies; [%] and [deg] of first harmonics in regular waves; [%] and [-] of an irregular sea."""


def monopile_model(*, water: bool = True, air: bool = False, **changes: Any) -> BladedModel:
    """The turbine of the deck on its monopile, with degrees of freedom as in the runs of OpenFAST.

    Args:
      water: whether there is any.
      air: with aerodynamics as there (set A with drag in the induction).
      changes: of the options.
    """
    turbine = read_openfast(Path(str(distribution("rosco").locate_file(DECK))))
    support = load_turbine("iea15mw-monopile").support
    assert support is not None
    piece = support.masses[0].replace(yaw_inertia=YAW_INERTIA)
    pile = support.replace(damping=0.0, masses=(piece,), **({} if water else {"flooded": None}))
    nodes = {"blade_nodes": tuple(turbine.blade.aerodynamics.position.tolist()), **AIR} if air else {}
    options = ModelOptions().replace(**PARKED | {"time_step": 0.005} | nodes | changes)
    parts: dict[str, Any] = {"foundation": None, "support": pile, "pitch_actuator.kind": "ideal"}
    model = build(turbine.replace(**parts), options, Environment(gravity=9.81))
    still = ({} if air else {"aerodynamics.air_density": 0.0}) | ({} if water else {"water.density": 0.0})
    return model.with_parameters(**still)


def frequencies() -> CheckTable:
    """Natural frequencies in water and air of the parked turbine."""
    rows = []
    for where, values in FREQUENCIES.items():
        for shapes, band in (("given", FREQUENCY_BAND), ("computed", None)):
            changes: dict[str, Any] = {} if shapes == "given" else {"fore_aft_modes": 4, "side_side_modes": 4}
            model = monopile_model(water=where == "water", mode_shapes=shapes, **changes)
            modes = natural_modes(model, 0.0, pitch=0.5 * np.pi)
            for name, reference in values.items():
                found = _nearest(modes, reference, name)
                rows.append(relative(name, f"{where}, {shapes} shapes", "Hz", reference, found, band))
    source = "OpenFAST v5.0.0: release of the tower top, blades at 90 deg (cases M1)"
    return CheckTable("offshore frequencies", "IEA 15 MW on its monopile, natural frequencies", source, rows)


def _nearest(modes: Any, reference: float, name: str) -> float:
    """[Hz] of the mode nearest to a frequency among those in which the tower moves fore and aft, or blades edgewise."""
    wanted = "edge" if "edgewise" in name else "fore-aft"
    some = [mode.frequency / (2.0 * np.pi) for mode in modes if wanted in mode.participation(9)]
    return float(min(some, key=lambda f: abs(f - reference)))


def sea_run(case: str, duration: float, **changes: Any) -> Result:
    """Our run of a case."""
    waves, data = CASES[case], thinned("offshore_runs")
    frequency, amplitude, angle = data[f"{case}_waves"].T
    current = Current(uniform=waves.current) if waves.current else None
    sea = ComponentSea(
        frequency=frequency, amplitude=amplitude, phase=angle, stretching=waves.stretching, current=current
    )
    return simulate(
        monopile_model(**changes),
        0.1,
        duration=duration,
        sea=sea,
        controller=ConstantController(),
        start=Start(rotor_speed=0.0, pitch=0.5 * np.pi, coordinates=RELEASED),
        channels=CHANNELS,
        output_step=STEP,
    )


def waves() -> CheckTable:
    """Loads in regular waves, with stretching and current, and in an irregular sea."""
    rows: list[Check] = []
    figures = {}
    data = thinned("offshore_runs")
    for case, settings in CASES.items():
        reference = data[f"{case}_counts"] * data[f"{case}_steps"]
        time: Float = STEP * np.arange(len(reference), dtype=np.float64)
        ours = sea_run(case, float(time[-1]))
        inside = time >= settings.begin - 1e-6
        for name, series in zip(CHANNELS, reference.T, strict=True):
            unit = ours.channel(name).unit
            x, y = ours[name][: len(time)][inside], series[inside]
            if settings.period is not None:
                rows += _harmonic(name, case, unit, time[inside], x, y, settings.period)
            else:
                rows.append(relative(f"{name} std", case, unit, float(y.std()), float(x.std()), STD_BAND))
                found = float(np.corrcoef(x, y)[0, 1])
                rows.append(at_least(f"{name} correlation", case, "-", CORRELATION, found))
        if settings.period is None:
            figures["offshore_sea"] = _plot(ours, time, reference, settings.begin)
    source = "OpenFAST v5.0.0 with SeaState, HydroDyn, SubDyn, the same waves (cases M2, M3, M6); no air"
    return CheckTable("offshore waves", "IEA 15 MW on its monopile in waves", source, rows, figures=figures)


def _harmonic(name: str, case: str, unit: str, time: Float, ours: Float, theirs: Float, period: float) -> list[Check]:
    """Amplitude and phase of the first harmonic, over whole periods."""
    whole = time - time[0] < period * np.floor((time[-1] - time[0]) / period) - 1e-6
    turn = np.exp(-2j * np.pi / period * time[whole])
    x, y = (complex(2.0 * np.mean(series[whole] * turn)) for series in (ours, theirs))
    return [
        relative(f"{name} amplitude", case, unit, abs(y), abs(x), FORCE_BAND),
        phase(f"{name} phase", case, float(np.angle(y)), float(np.angle(x)), PHASE_BAND),
    ]


def _plot(ours: Result, time: Float, theirs: Float, begin: float) -> Figure:
    names = ("Wave1Elev", "HydroFxi", "ReactFXss", "ReactMYss", "TTDspFA")
    figure, axes = new_figure(len(names), size=(9.0, 8.0))
    inside = (time >= begin) & (time <= begin + 60.0)
    for ax, name in zip(axes[:, 0], names, strict=True):
        unit, factor = ours.channel(name).display_unit
        ax.plot(time[inside], theirs[inside, CHANNELS.index(name)] * factor, color=COLOURS[1], lw=2.4, alpha=0.6,
                label="OpenFAST")  # fmt: skip
        ax.plot(time[inside], ours[name][: len(time)][inside] * factor, color=COLOURS[0], lw=0.8, label="meltemi")
        panel(ax, name, unit)
    axes[0, 0].legend(ncols=2, **ABOVE)
    axes[-1, 0].set_xlabel("time [s]")
    return figure
