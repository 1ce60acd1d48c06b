"""Gusts of the standard, stops and faults against OpenFAST, under OpenFAST's own pitch and torque.

OpenFAST ran ROSCO. Its law is kept out of the comparison: pitch and generator torque are those of its run, and a law of
its own adds the torque that keeps OpenFAST's generator speed, until a stop, or throughout a gust (the aerodynamic
torque, ``RtFldMxh``, is compared). A stop is made of events, as in a load base; from then on the rotor is free.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from comparisons import reference_table, source_of, thinned
from meltemi.compiler import njit
from meltemi.control.controller import Controller
from meltemi.control.signals import Demands, Measurements
from meltemi.iec.gusts import Sign, ecd, edc, eog, ews_horizontal, ews_vertical
from meltemi.report.palette import COLOURS
from meltemi.report.plots import heading, new_figure, panel
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.channels import find, standard
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.simulate import simulate
from meltemi.simulation.start import Start
from meltemi.supervisor.settings import Supervision
from meltemi.supervisor.supervised import SupervisedController
from meltemi.turbine.library import load_turbine
from meltemi.verification.openfast_deck import deck_options, deck_turbine
from meltemi.verification.steady import deck_model
from meltemi.verification.table import Check, CheckTable
from meltemi.wind.fields import SteadyWind, Wind, WindSeries
from meltemi.wind_files import read_bts

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]
Event = dict[str, Any]

RPM = math.pi / 30.0
STEP, OUTPUT = 0.01, 0.05
"""[s] time step, as OpenFAST's, and between records of both."""
BEGIN, BEFORE = 45.0, 10.0
"""[s] of the event; length of the windows before it and at the end of the run."""
CLASS = "IB"
"""Wind class of the gusts, edition 3."""
CHANNELS = (
    "RotSpeed RtFldMxh RtFldFxh RotThrust RootMxc1 RootMyc1 RootMzc1 OoPDefl1 IPDefl1 TwrClrnc1 TTDspFA TTDspSS "
    "YawBrTAxp TwrBsMxt TwrBsMyt YawBrMxp YawBrMyp YawBrMzp LSSTipMys LSSTipMzs"
).split()
STEADY, TRANSIENT, LATE = 3.0, 5.0, 0.3
"""[%] of the channel's range in the case, before the event and after; [s] of the time of an extreme."""
BOX = "estop_vkm20"
"""The case in turbulence, whose wind box does not come with the package."""
SHOWN = ("RotSpeed", "BldPitch1", "RootMyc1", "TwrBsMyt")
FIGURE = ("estop_25", "ecd_p_11.4")


@dataclass(frozen=True)
class Case:
    """A reference run.

    Attributes:
      wind: a speed [m/s] with shear, or a gust; None is the turbulent box.
      rotor_speed, pitch: at the start [rpm], [deg].
      events: of the run.
      event: [s] time from which the extremes count.
      end: [s] of the run.
    """

    wind: float | WindSeries | None
    rotor_speed: float
    pitch: float
    events: Sequence[Event] = ()
    event: float = BEGIN
    end: float = 80.0


def feather(at: float, rate: float = 8.0, blades: Sequence[int] = (1, 2, 3)) -> list[Event]:
    """Blades that pitch to feather at a rate [deg/s], whatever a controller asks for."""
    return [{"at": at, "type": "pitch_runaway", "blade": blade, "rate": math.radians(rate)} for blade in blades]


def off(at: float) -> list[Event]:
    """A generator without torque."""
    return [{"at": at, "type": "generator_fault"}]


def lost(at: float) -> list[Event]:
    """Loss of the grid."""
    return [{"at": at, "type": "grid_loss"}]


def stuck(at: float, blade: int) -> list[Event]:
    """A blade that stays as it is."""
    return [{"at": at, "type": "pitch_stuck", "blade": blade}]


@cache
def gust_cases() -> dict[str, Case]:
    """Production in the gusts of IEC 61400-1; p and n are the senses of the change."""
    t = deck_model("B").turbine
    cases = {
        "eog_11.4": Case(eog(t, 11.4, CLASS, begin=BEGIN), 11.95, 0.0),
        "eog_25": Case(eog(t, 25.0, CLASS, begin=BEGIN), 12.1, 23.0),
    }
    senses: dict[str, Sign] = {"p": 1, "n": -1}
    for name, sign in senses.items():
        cases |= {
            f"ecd_{name}_11.4": Case(ecd(t, 11.4, sign=sign, begin=BEGIN), 11.95, 0.0),
            f"edc_{name}_12": Case(edc(t, 12.0, CLASS, sign=sign, begin=BEGIN), 12.1, 3.5),
            f"ewsh_{name}_12": Case(ews_horizontal(t, 12.0, CLASS, sign=sign, begin=BEGIN), 12.1, 3.5),
            f"ewsv_{name}_12": Case(ews_vertical(t, 12.0, CLASS, sign=sign, begin=BEGIN), 12.1, 3.5),
        }
    return cases


STOPS = {
    "estop_11.4": Case(11.4, 11.95, 0.0, [*feather(BEGIN), *off(BEGIN)], end=95.0),
    "estop_15_noROSCO": Case(15.0, 12.1, 10.3, [*feather(BEGIN), *off(BEGIN)], end=90.0),
    "estop_25": Case(25.0, 12.1, 23.0, [*feather(BEGIN), *off(BEGIN)], end=95.0),
    "gridloss_25": Case(25.0, 12.1, 23.0, [*lost(BEGIN), *feather(BEGIN + 0.2)], end=95.0),
    "normalstop_12": Case(12.0, 12.1, 3.5, [*feather(BEGIN, 2.0), *off(55.35)], end=100.0),
    "stuck1_estop_14": Case(14.0, 12.1, 8.5, [*stuck(BEGIN, 1), *feather(BEGIN, 8.0, (2, 3)), *off(BEGIN)], end=95.0),
    BOX: Case(None, 12.1, 17.3, [*feather(60.0), *off(60.0)], event=60.0, end=100.0),
}
"""Emergency stops, loss of the grid, a normal stop, an emergency stop with a blade that does not pitch."""


# OpenFAST's pitch and torque -----------------------------------------------------------------------------

ROWS, UNTIL, TRIM, TABLE = range(4)
"""State of the controller: number of rows, [s] until which it follows the speed, [N m] integral, first row."""
INERTIA = 4650.0
"""[kg m^2] of rotor and generator on the generator's shaft."""


@njit  # type: ignore[untyped-decorator]
def play(state: Float, measurements: Measurements, demands: Demands, dt: float) -> None:
    """Pitch and torque of the table; until the event with what a PI law of the generator speed adds."""
    rows = int(state[ROWS])
    place = min(measurements.time / OUTPUT, rows - 1.0)
    i = min(int(place), rows - 2)
    now = state[TABLE + 3 * i : TABLE + 3 * i + 3] * (1.0 + i - place)
    now += state[TABLE + 3 * i + 3 : TABLE + 3 * i + 6] * (place - i)
    for blade in range(3):
        demands.pitch[blade] = now[0]
    demands.generator_torque = now[1]
    if measurements.time < state[UNTIL]:
        # 0.5 rad/s, damping ratio 0.5
        error = measurements.generator_speed - now[2]
        state[TRIM] += 0.25 * INERTIA * error * dt
        demands.generator_torque += state[TRIM] + 0.5 * INERTIA * error


def playback(table: Float, until: float) -> Controller:
    """Controller that plays back pitch [rad], torque [N m] and, until a time [s], generator speed [rad/s] of a table
    (T, 3) of steps of 0.05 s."""
    state = np.concatenate([[len(table), until - 0.5 * STEP, 0.0], table.ravel()])
    return Controller(play, init=lambda start: state, name="playback", uses_loads=False)


def simple_law(state: Float, measurements: Measurements, demands: Demands, dt: float) -> None:
    """OpenFAST's simple torque law with the numbers of the case without ROSCO; the pitch stays."""
    rated, torque, square = 1173.7, 43093.55, 0.0255764
    slip, rpm = rated / 1.1, measurements.generator_speed / RPM
    demands.generator_torque = min(max(torque * (rpm - slip) / (rated - slip), square * rpm**2), torque)


def reference_run(name: str) -> Float:
    """(T, 3) pitch [rad], generator torque [N m] and speed [rad/s] of a reference run, every 0.05 s."""
    z = thinned("stops_runs")
    return np.cumsum(z[name].astype(float), axis=0) * z["steps"]


def wind_of(case: Case, folder: Path | None) -> Wind:
    """Wind of a case; the box is in the folder of reference runs."""
    if case.wind is None:
        assert folder is not None
        return read_bts(folder / "openfast/wind/vkm20_s1.bts")
    return case.wind if isinstance(case.wind, WindSeries) else SteadyWind(speed=case.wind, shear_exponent=0.2)


def arguments(name: str, folder: Path | None = None) -> dict[str, Any]:
    """Arguments of ``simulate`` that repeat a reference run: OpenFAST's start, wind, pitch and torque.

    Args:
      name: of the case.
      folder: of reference runs, for the case in turbulence.
    """
    case = (gust_cases() | STOPS)[name]
    if name.endswith("noROSCO"):
        controller, torque = Controller(simple_law, name="simple law", uses_loads=False), 43093.55
    else:
        table = reference_run(name)
        until = case.event if case.events else case.end + 1.0
        controller, torque = playback(table, until), float(table[0, 1])
    return {
        "model": deck_model("B", time_step=STEP),
        "wind": wind_of(case, folder),
        "duration": case.end,
        "controller": controller,
        "start": Start(case.rotor_speed * RPM, math.radians(case.pitch), torque, {}),
        "events": case.events,
        "channels": [*CHANNELS, "BldPitch1"],
        "output_step": OUTPUT,
    }


@cache
def slender_model() -> BladedModel:
    """The model with blade sections without rotary inertia, as ElastoDyn's are."""
    turbine = deck_turbine(load_turbine("nrel5mw"))
    none = np.zeros(len(turbine.blade.structure.position))
    turbine = turbine.replace(**{"blade.structure.flap_inertia": none, "blade.structure.edge_inertia": none})
    return build(turbine, deck_options(turbine, "B", time_step=STEP))


def run_case(name: str, folder: Path | None = None, **changes: Any) -> Result:
    """Result of a case, some arguments of ``simulate`` changed."""
    return simulate(**(arguments(name, folder) | changes))


# comparison ----------------------------------------------------------------------------------------------


def measured(time: Float, x: Float, event: float) -> dict[str, float]:
    """Mean, least and largest value before the event, extremes from then on and their times, mean at the end, range."""
    before = x[(time >= event - BEFORE - 1e-6) & (time < event - 1e-6)]
    after = time >= event - 1e-6
    t, late = time[after], x[after]
    return {
        "before": float(before.mean()),
        "least_before": float(before.min()),
        "most_before": float(before.max()),
        "minimum": float(late.min()),
        "at_minimum": float(t[late.argmin()]),
        "maximum": float(late.max()),
        "at_maximum": float(t[late.argmax()]),
        "end": float(late[t > time[-1] - BEFORE + 1e-6].mean()),
        "range": float(max(before.max(), late.max()) - min(before.min(), late.min())),
    }


KINDS = {
    "before": ("mean before", STEADY),
    "least_before": ("minimum before", STEADY),
    "most_before": ("maximum before", STEADY),
    "minimum": ("minimum", TRANSIENT),
    "maximum": ("maximum", TRANSIENT),
    "end": ("mean at the end", TRANSIENT),
}
"""Words and bands."""


def compare(name: str, result: Result, event: float, reference: str | None = None) -> list[Check]:
    """Rows of a case, in percent of the range that the channel has in it, and the times of the extremes."""
    rows: list[Check] = []
    for r in reference_table("stops", case=reference or name):
        channel, span = r["channel"], float(r["range"])
        x, unit = result[channel], result.channel(channel).unit
        ours = measured(result.time, x, event)
        for key, (words, band) in KINDS.items():
            theirs = float(r[key])
            deviation = 100.0 * (ours[key] - theirs) / span
            rows.append(Check(channel, f"{name}, {words}", unit, theirs, ours[key], deviation, "%", band))
        for key, sign in (("minimum", -1.0), ("maximum", 1.0)):
            # of peaks that are equal within the band, the nearest in time
            near = result.time[(sign * (x - ours[key]) >= -0.01 * TRANSIENT * span) & (result.time >= event - 1e-6)]
            theirs = float(r[f"at_{key}"])
            at = float(near[np.abs(near - theirs).argmin()])
            rows.append(Check("time of extreme", f"{name}, {channel} {key}", "s", theirs, at, at - theirs, "s", LATE))
    return rows


def gusts() -> CheckTable:
    """Production in gusts, direction changes and shears of the standard."""
    rows: list[Check] = []
    for name, case in gust_cases().items():
        rows += compare(name, run_case(name), case.event)
    title = "Production in IEC gusts against OpenFAST (percent of the channel's range in the case)"
    return CheckTable("gusts", title, source_of("stops"), rows)


def stops(folder: Path | None = None) -> CheckTable:
    """Stops, loss of the grid and a stuck blade.

    Args:
      folder: of reference runs: only the stop in turbulence, whose wind is there.
    """
    rows: list[Check] = []
    figures = {}
    names = [BOX] if folder else [name for name in STOPS if name != BOX]
    for name in names:
        rows += compare(name, run_case(name, folder), STOPS[name].event)
    if folder is None:
        rows += compare("supervised, 25 m/s", supervised(), BEGIN, reference="estop_25")
        figures["stops"] = plot_stops()
    title = "Stops and faults against OpenFAST (percent of the channel's range in the case)"
    return CheckTable("stops in turbulence" if folder else "stops", title, source_of("stops"), rows, figures=figures)


def supervised() -> Result:
    """The emergency stop at 25 m/s under our own law and supervisor, which notices that the grid is lost."""
    settings = Supervision(emergency_rate=math.radians(8.0), brake=0.0)
    controller = SupervisedController(deck_model("B").turbine, settings)
    return run_case("estop_25", controller=controller, events=lost(BEGIN))


def plot_stops() -> Figure:
    """Rotor speed, pitch and loads of a stop and of a gust with change of direction, of both codes."""
    z = thinned("stops_runs")
    figure, axes = new_figure(len(SHOWN), len(FIGURE), size=(9.0, 7.5))
    for column, name in zip(axes.T, FIGURE, strict=True):
        ours = run_case(name).between(40.0, 80.0)
        for ax, channel, counts in zip(column, SHOWN, z[f"shown_{name}"].T, strict=True):
            unit, factor = find(channel, standard()).display_unit
            series = np.cumsum(counts.astype(float)) * z["shown_steps"][SHOWN.index(channel)]
            ax.plot(
                ours.time,
                series[: len(ours.time)] * factor,
                color=COLOURS[1],
                lw=2.4,
                alpha=0.6,
                label="OpenFAST, set B",
            )
            ax.plot(ours.time, ours[channel] * factor, color=COLOURS[0], lw=0.9, label="meltemi")
            panel(ax, channel, unit)
    for ax, words in zip(axes[0], ("emergency stop at 25 m/s", "extreme coherent gust at 11.4 m/s"), strict=True):
        heading(ax, words, "right")
    axes[0, 0].legend()
    for ax in axes[-1]:
        ax.set_xlabel("time [s]")
    return figure
