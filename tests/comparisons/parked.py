"""Parked and idling rotors against OpenFAST: any yaw angle, one blade stuck, stalled blades, turbulence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from comparisons import reference_table, source_of
from comparisons.elastodyn_blade import elastodyn_model
from comparisons.measure import amplitudes, vibration
from comparisons.turbulent import thinned_box
from meltemi.control.constant import ConstantController
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.simulate import simulate
from meltemi.simulation.start import Start
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine
from meltemi.verification.openfast_deck import deck_options, deck_turbine
from meltemi.verification.table import Check, CheckTable, difference, relative
from meltemi.wind.fields import SteadyWind, WindBox
from meltemi.wind_files import read_bts

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]
Setting = dict[str, str]
"""A row of the table of cases."""
FEATHER = 0.5 * np.pi
CHANNELS = (
    "RotSpeed RotThrust RootMxc1 RootMyc1 RootMzc1 OoPDefl1 IPDefl1 TTDspFA TTDspSS TwrBsMxt TwrBsMyt YawBrMxp "
    "YawBrMyp YawBrMzp LSSTipMys LSSTipMzs"
).split()
MEASURES: dict[str, Callable[[Float], np.float64]] = {
    "mean": np.mean, "std": np.std, "minimum": np.min, "maximum": np.max,
}  # fmt: skip
STEADY, TRANSIENT = 3.0, 5.0
"""[%] of the channel's range over the whole case, in steady wind and in turbulence."""


class Part(NamedTuple):
    """Part of the runs in turbulence whose wind comes with the package: begin and end [s], suffix of its cases."""

    begin: float
    end: float
    suffix: str


SHORT = Part(20.0, 50.0, ", 30 s")


class Direction(NamedTuple):
    """Vibration of a feathered blade: name, deflection of the tip, band of frequencies [Hz]."""

    name: str
    channel: str
    band: tuple[float, float]


EDGEWISE = Direction("edgewise", "OoPDefl", (0.85, 1.35))
FLAPWISE = Direction("flapwise", "IPDefl", (0.5, 0.85))


def settings() -> list[Setting]:
    """Cases in steady wind."""
    return [s for s in reference_table("parked_cases") if s["speed"]]


LOADS = {
    "RootMxc1": "flapwise moment, blade 1", "RootMyc1": "edgewise moment, blade 1",
    "TwrBsMxt": "tower base, side to side", "YawBrMzp": "yaw bearing, torsion",
}  # fmt: skip
"""Loads in the figure over the yaw angle; the blades are feathered."""
YAWED = tuple(
    f"idling 42.5 m/s {yaw}"
    for yaw in ("-8 deg", "0 deg", "+8 deg", "+30 deg, dynamic stall", "+90 deg", "+120 deg", "+180 deg")
)


def deck_blades(s: Setting) -> BladedModel:
    """The model of a case, with our blades: finite elements, loads at the nodes."""
    turbine, changes = _description(s)
    return build(turbine, deck_options(turbine, s["set"], **changes))


def openfast_blades(s: Setting) -> BladedModel:
    """The model of a case, with OpenFAST's discretisation of structure and loads of the blades."""
    turbine, changes = _description(s)
    return elastodyn_model(turbine, s["set"], **changes)


def _description(s: Setting) -> tuple[Turbine, dict[str, Any]]:
    turbine = deck_turbine(load_turbine("nrel5mw"))
    if (own := float(np.radians(float(s["pitch_1_deg"]))) - FEATHER) != 0.0:
        turbine = turbine.replace(imbalance={"pitch": (own,)})
    locked = ("yaw", "generator") if s["locked"] == "1" else ("yaw",)
    return turbine, {"locked": locked, "tower_drag": s["tower_drag"] == "1"}


BLADES: dict[str, Callable[[Setting], BladedModel]] = {"": deck_blades, ", OpenFAST's blades": openfast_blades}


def run(s: Setting, model: BladedModel, channels: Sequence[str] = CHANNELS, wind: WindBox | None = None) -> Result:
    """Simulate a case as OpenFAST did: undeflected blades and tower, the full wind from the begin on."""
    direction, nacelle, azimuth = (float(np.radians(float(s[f"{k}_deg"]))) for k in ("direction", "nacelle", "azimuth"))
    start = Start(
        rotor_speed=float(s["rpm"]) * np.pi / 30.0,
        pitch=FEATHER,
        coordinates={"yaw": nacelle} if nacelle else {},
        azimuth=azimuth,
    )
    if wind is None:
        steady = SteadyWind(speed=float(s["speed"]), shear_exponent=float(s["shear"]), direction=direction)
    return simulate(
        model,
        steady if wind is None else wind,
        duration=float(s["duration"]),
        controller=ConstantController(),
        start=start,
        channels=channels,
    )


def parked() -> CheckTable:
    """Statistics of parked and idling rotors in steady wind."""
    rows: list[Check] = []
    found: dict[str, Result] = {}
    for s in settings():
        found[s["case"]] = run(s, deck_blades(s)).between(float(s["begin"]), np.inf)
        rows += statistics(s, found[s["case"]], STEADY)
    title = "Parked and idling rotors against OpenFAST (percent of the channel's range over the case)"
    return CheckTable("parked", title, source_of("parked"), rows, figures={"parked": _plot_yaw(found)})


def discretised() -> CheckTable:
    """The same with OpenFAST's discretisation of the blades, which explains most deviations."""
    rows: list[Check] = []
    for s in settings():
        rows += statistics(s, run(s, openfast_blades(s)).between(float(s["begin"]), np.inf), STEADY)
    title = "Parked and idling rotors with OpenFAST's discretisation in our equations (percent of the channel's range)"
    return CheckTable("parked discretisation", title, source_of("parked"), rows)


def statistics(s: Setting, result: Result, band: float, blades: str = "") -> list[Check]:
    """Mean, standard deviation and extremes of a case, in percent of the channel's range over the whole case."""
    rows: list[Check] = []
    for r in reference_table("parked", case=s["case"]):
        channel, span = r["channel"], float(r["range"])
        for name, measure in MEASURES.items():
            reference, ours = float(r[name]), float(measure(result[channel]))
            deviation, unit = 100.0 * (ours - reference) / span, result.channel(channel).unit
            rows.append(Check(channel, f"{s['case']}{blades}: {name}", unit, reference, ours, deviation, "%", band))
    return rows


def stalled() -> CheckTable:
    """Vibration of stalled blades with our blades and with OpenFAST's."""
    rows: list[Check] = []
    found: dict[tuple[str, str], tuple[Float, Float]] = {}
    at = {s["case"]: s for s in settings()}
    for r in reference_table("parked_vibration"):
        s, direction = at[r["case"]], EDGEWISE if r["direction"] == EDGEWISE.name else FLAPWISE
        names = [f"{direction.channel}{b}" for b in (1, 2, 3)]
        for blades, model in BLADES.items():
            result = run(s, model(s), names)
            x = np.stack([result[name] for name in names])
            between = float(r["begin"]), float(r["end"])
            frequency, damping, amplitude = vibration(result.time, x, direction.band, between)
            case, reference = f"{s['case']}{blades}", float(r["damping"])
            rows.append(relative("frequency", case, "Hz", float(r["frequency"]), frequency, 1.5))
            rows.append(difference("damping ratio", case, "-", reference, damping, 0.2, measure="points", factor=100.0))
            rows.append(relative("last amplitude", case, "m", float(r["amplitude"]), amplitude, 5.0))
            found[case, blades] = result.time, amplitudes(result.time, x, direction.band)[0]
    title = "Vibration of stalled blades of parked rotors against OpenFAST"
    figures = {"parked_stall": _plot_amplitudes(found)}
    return CheckTable("parked stall", title, source_of("parked_vibration"), rows, figures=figures)


def turbulent(folder: Path | None = None) -> CheckTable:
    """Statistics of idling rotors in turbulence, with our blades and with OpenFAST's.

    Args:
      folder: reference runs, 140 s each; without it their 20 to 50 s, whose wind comes with the package.
    """
    if folder is None:
        wind = thinned_box("parked_wind", "ewm42.5_s1, thinned")
    else:
        wind = read_bts(folder / "openfast_dlc/wind/ewm42.5_s1.bts")
    rows: list[Check] = []
    for s in reference_table("parked_cases", speed=""):
        if s["case"].endswith(SHORT.suffix) is (folder is None):
            for blades, model in BLADES.items():
                result = run(s, model(s), wind=wind).between(float(s["begin"]), np.inf)
                rows += statistics(s, result, TRANSIENT, blades)
    title = "Idling in turbulence against OpenFAST (percent of the channel's range over the case)"
    name = "parked turbulence" + ("" if folder else " short")
    return CheckTable(name, title + ("" if folder else ", 30 s"), source_of("parked"), rows)


def _plot_yaw(found: dict[str, Result]) -> Figure:
    figure, axes = new_figure(2, 2, size=(9.0, 6.0))
    cases = {s["case"]: float(s["direction_deg"]) for s in settings() if s["case"] in YAWED}
    for ax, (channel, name) in zip(axes.flat, LOADS.items(), strict=True):
        theirs = {r["case"]: r for r in reference_table("parked", channel=channel)}
        for case, yaw in cases.items():
            r, x = theirs[case], 1e-6 * found[case][channel]
            pairs = ([1e-6 * float(r[k]) for k in ("mean", "minimum", "maximum")], [x.mean(), x.min(), x.max()])
            for (mean, low, high), shift, colour, fill in zip(
                pairs, (-1.5, 1.5), COLOURS[1::-1], ("w", None), strict=True
            ):
                ax.plot([yaw + shift] * 2, [low, high], color=colour, lw=1.2)
                ax.plot([yaw + shift], [mean], "o", ms=5, mfc=fill or colour, color=colour)
        ax.set_ylabel(f"{name} [MN m]")
    for colour, fill, label in ((COLOURS[1], "w", "OpenFAST"), (COLOURS[0], COLOURS[0], "meltemi")):
        axes[0, 0].plot([], [], "o-", mfc=fill, color=colour, label=label)
    axes[0, 0].legend(title="mean, minimum to maximum")
    for ax in axes[-1]:
        ax.set_xlabel("yaw error [deg]")
    for ax in axes.flat:
        ax.set_xticks(np.arange(0.0, 181.0, 30.0))
    figure.suptitle("Idling at 42.5 m/s, 30 to 70 s (30 deg: with dynamic stall)")
    return figure


def _plot_amplitudes(found: dict[tuple[str, str], tuple[Float, Float]]) -> Figure:
    figure, axes = new_figure(1, 1, size=(9.0, 3.6))
    ax, table = axes[0, 0], reference_table("parked_amplitude")
    for colour, case in zip(COLOURS, dict.fromkeys(r["case"] for r in table), strict=False):
        theirs = [(float(r["time"]), float(r["amplitude"])) for r in table if r["case"] == case]
        ax.plot(*zip(*theirs, strict=True), "o", ms=4, mfc="none", color=colour, label=case)
        for blades, dashes in zip(BLADES, ("-", "--"), strict=True):
            time, amplitude = found[case + blades, blades]
            inside = (time >= 4.0) & (time <= 66.0)
            ax.plot(time[inside], amplitude[inside], dashes, color=colour, lw=1.0)
    ax.set_yscale("log")
    ax.set_xlabel("time [s]")
    ax.set_ylabel("edgewise amplitude of the tips [m]")
    ax.legend(title="circles: OpenFAST; lines: meltemi; dashed: with OpenFAST's blades")
    return figure
