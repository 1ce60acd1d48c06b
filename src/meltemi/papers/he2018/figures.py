"""Figures 4 to 12 of the paper from our runs: first seed, time window of the paper."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.papers.claim import rows_of
from meltemi.papers.he2018.beyond import at_speed
from meltemi.papers.he2018.measures import change, thin_airfoil
from meltemi.papers.he2018.runs import ALL_SPEEDS, CLASS_B, PAPER, SPEED, THREE, LoadControlRuns
from meltemi.postprocess.ensemble import mean_interval
from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import ABOVE, heading, new_figure, panel
from meltemi.reports.panels import Panel, channel, series
from meltemi.reports.spectra_plots import plot_spectra
from meltemi.tuning.quantities import hub_moments
from meltemi.tuning.tuning_plots import plot_tuning
from meltemi.turbine.flaps import DEFLECTION, naca64618_flap
from meltemi.turbine.flaps import LIFT as LIFT_TABLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from meltemi.controllers.tuning import LoopTuning

Float = NDArray[np.float64]
HIGHEST = 0.9
"""[Hz] upper limit of spectra: a little beyond 4P."""
WIDTH = 7.4
"""[in] width of all figures, so that letters are legible in the text column of a page of 1200 pixels."""


def polars(runs: LoadControlRuns) -> Figure:
    """Fig. 4: lift of the section with flap, and the increments compared with thin-airfoil theory."""
    figure, axes = new_figure(2, size=(WIDTH, 8.0), share=False)
    rows = np.array([[float(word) for word in line.split()] for line in LIFT_TABLE.strip().splitlines()])
    for j, delta in enumerate(DEFLECTION):
        colour = COLOURS[j] if j < len(COLOURS) else INK
        axes[0, 0].plot(rows[:, 0], rows[:, j + 1], marker=".", label=f"{delta:+g} deg", color=colour)
    axes[0, 0].legend(title="flap")
    axes[0, 0].set_xlabel("angle of attack [deg]")
    panel(axes[0, 0], "Fig. 4: lift coefficient of NACA 64-618 with a flap of 10 % chord", "-")
    increments, angles = naca64618_flap().increments, np.array(DEFLECTION)
    for colour, alpha in zip(COLOURS, (-8.0, 0.0, 8.0), strict=False):
        added = increments.lift[int(np.argmin(np.abs(np.degrees(increments.angle_of_attack) - alpha)))]
        axes[1, 0].plot(angles, added, marker=".", color=colour, label=f"increments at {alpha:g} deg")
    ideal = thin_airfoil(naca64618_flap().chord_fraction)[0] * np.radians(angles)
    axes[1, 0].plot(angles, ideal, color=INK, linestyle="--", label="thin-airfoil theory (Glauert)")
    axes[1, 0].legend()
    axes[1, 0].set_xlabel("flap [deg]")
    panel(axes[1, 0], "Lift that the flap adds, by angle of attack", "-")
    return figure


def hub_wind(runs: LoadControlRuns) -> Figure:
    """Fig. 5: wind speed at the hub."""
    figure, axes = new_figure(len(runs.readings), size=(WIDTH, 1.9 * len(runs.readings) + 0.6))
    for ax, (reading, c) in zip(axes[:, 0], runs.readings.items(), strict=True):
        result = c.results("cpc")
        ax.plot(result.time, result["wind_x"], linewidth=0.6, color=COLOURS[0])
        ax.axvspan(*runs.setup.window, color=COLOURS[3], alpha=0.2, linewidth=0.0)
        panel(ax, f"Fig. 5: wind at the hub, {reading}; shaded: the paper's window", "m/s")
    axes[-1, 0].set_xlabel("time [s]")
    return figure


def shown(*panels: Panel) -> Callable[[LoadControlRuns], Figure]:
    """Draw panels over the time window of the paper, one curve for each scheme."""

    def draw(runs: LoadControlRuns) -> Figure:
        c = runs.readings[CLASS_B]
        results = {scheme.upper(): c.results(scheme).between(*c.windows[PAPER]) for scheme in THREE}
        figure = series(panels, results, height=2.1, rest=0.7)
        figure.set_size_inches(WIDTH, figure.get_size_inches()[1])
        return figure

    return draw


def spectra(runs: LoadControlRuns) -> Figure:
    """Fig. 9: power spectral density of RootMyc1, mean over seeds, for all readings of model and wind."""
    figure, axes = new_figure(len(runs.judged), size=(WIDTH, 2.7 * len(runs.judged)))
    for ax, (reading, c) in zip(axes[:, 0], runs.judged.items(), strict=True):
        spectra_by_scheme = {scheme.upper(): c.spectrum("RootMyc1", scheme) for scheme in THREE}
        plot_spectra(
            spectra_by_scheme, "RootMyc1", rotor=c.rotor_frequency(), harmonics=(1, 2, 3, 4), highest=HIGHEST, ax=ax
        )
        ax.set_title(f"Fig. 9: PSD of RootMyc1, {reading}", fontsize=9)
    return figure


def actuators(runs: LoadControlRuns) -> Figure:
    """Fig. 11: pitch of blade 1 by scheme, and the three flaps of CPFC."""
    c = runs.readings[CLASS_B]
    figure, axes = new_figure(2, size=(WIDTH, 5.0))
    for i, scheme in enumerate(THREE):
        part = c.results(scheme).between(*c.windows[PAPER])
        axes[0, 0].plot(part.time, np.degrees(part["pitch_1"]), linewidth=1.0, color=COLOURS[i], label=scheme.upper())
    axes[0, 0].legend(ncols=3, **ABOVE)
    panel(axes[0, 0], "Fig. 11a: pitch of blade 1", "deg")
    part = c.results("cpfc").between(*c.windows[PAPER])
    for b in (1, 2, 3):
        flap = np.degrees(part[f"flap_1_angle_{b}"])
        axes[1, 0].plot(part.time, flap, linewidth=0.9, color=COLOURS[b - 1], label=f"blade {b}")
    axes[1, 0].legend(ncols=3, **ABOVE)
    panel(axes[1, 0], "Fig. 11b: flaps of CPFC", "deg")
    axes[1, 0].set_xlabel("time [s]")
    return figure


def numbers(runs: LoadControlRuns) -> Figure:
    """Tables 2 to 5 and Fig. 12: changes against CPC, means over seeds with intervals, compared with the paper."""
    stated = [
        row for row in rows_of("he2018", "claims.csv").values() if row["kind"] == "near" and "/" not in row["scheme"]
    ]
    names = [*((row["quantity"], row["scheme"], float(row["paper"].removesuffix(" %"))) for row in stated), *_UNSTATED]
    figure, axes = new_figure(1, size=(WIDTH, 0.42 * len(names) + 1.3))
    ax, y = axes[0, 0], np.arange(len(names))
    for i, (reading, c) in enumerate(runs.judged.items()):
        intervals = [mean_interval(change(c, name, scheme)) for name, scheme, _ in names]
        width = [0.0 if e.n < 2 else e.half_width for e in intervals]
        at = y + 0.19 * (i - 0.5 * (len(runs.judged) - 1))
        look = {"color": COLOURS[i], "linestyle": "", "marker": "o", "markersize": 4, "capsize": 2}
        ax.errorbar([e.mean for e in intervals], at, xerr=width, label=reading, **look)
    ax.plot([paper for *_, paper in names], y, color=INK, marker="D", markersize=5, linestyle="", label="paper")
    ax.axvline(0.0, color=INK, linewidth=0.8)
    ax.set_yticks(y, [f"{name}, {scheme.upper()}" for name, scheme, _ in names])
    ax.invert_yaxis()
    ax.set_xlabel("%")
    figure.legend(loc="outside lower center", ncols=3)
    heading(ax, "Fig. 12 and Tables 2 to 5: change against CPC")
    return figure


_UNSTATED = [(f"{name} DEL", s, np.nan) for name in ("RootMxc1", "Myaw", "Mtilt") for s in ("ipc", "cpfc")]


def over_speeds(runs: LoadControlRuns) -> Figure:
    """Change of loads over wind speed, beyond the paper."""
    every = sorted({*runs.speeds, SPEED})
    names = ("RootMyc1 DEL", "TwrBsMyt DEL", "power mean")
    figure, axes = new_figure(len(names), size=(WIDTH, 2.5 * len(names)))
    for ax, name in zip(axes[:, 0], names, strict=True):
        for i, scheme in enumerate(ALL_SPEEDS[1:]):
            means = [float(change(at_speed(runs, u), name, scheme).mean()) for u in every]
            ax.plot(every, means, marker="o", markersize=4, color=COLOURS[i], label=scheme)
        ax.axhline(0.0, color=INK, linewidth=0.8)
        panel(ax, f"{name}, change against CPC", "%")
    axes[-1, 0].set_xlabel("wind speed [m/s]")
    axes[0, 0].legend(ncols=4, **ABOVE)
    return figure


def bode(loops: Mapping[str, LoopTuning]) -> Figure:
    """Bode diagram of the loops of CPFC in the width of a page."""
    figure = plot_tuning(loops)
    figure.set_size_inches(1.25 * WIDTH, 6.4)
    return figure


FIGURES: Mapping[str, tuple[str, Callable[[LoadControlRuns], Figure]]] = {
    "fig04_polars": ("Lift of the flapped section, and what the flap adds beside thin-airfoil theory", polars),
    "fig05_wind": ("Wind at the hub, first seed", hub_wind),
    "fig06_root_moments": (
        "Root moments of blade 1, first seed",
        shown(
            ("Fig. 6a: RootMyc1, out of plane", "kN m", channel("RootMyc1", 1e-3)),
            ("Fig. 6b: RootMxc1, in plane", "kN m", channel("RootMxc1", 1e-3)),
        ),
    ),
    "fig07_hub_moments": (
        "Moments of the blades on the hub, first seed",
        shown(
            ("Fig. 7a: Myaw, of the blades on the hub", "kN m", lambda r: hub_moments(r)[1] * 1e-3),
            ("Fig. 7b: Mtilt, of the blades on the hub", "kN m", lambda r: hub_moments(r)[0] * 1e-3),
        ),
    ),
    "fig08_deflections": (
        "Tip deflections of blade 1, first seed",
        shown(
            ("Fig. 8a: OoPDefl1, out of plane", "m", channel("OoPDefl1")),
            ("Fig. 8b: IPDefl1, in plane", "m", channel("IPDefl1")),
        ),
    ),
    "fig09_spectra": ("Power spectral densities, mean over seeds", spectra),
    "fig10_power": (
        "Electrical power, first seed",
        shown(("Fig. 10: electrical power", "kW", channel("generator_power", 1e-3))),
    ),
    "fig11_actuators": ("Pitch and flaps, first seed", actuators),
    "fig12_loads": ("Changes against CPC beside the paper's, 95 % intervals over seeds", numbers),
}
"""Caption and function of each figure, by file name."""
