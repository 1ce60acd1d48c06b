"""Figure of the test bench: lifetime loads over those of the reference, and stability margins by wind speed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from meltemi.report.figure import ShownFigure
from meltemi.report.palette import SOFT, curve
from meltemi.report.plots import heading, panel
from meltemi.tuning.controller_bench.bench import ControllerBench
from meltemi.tuning.controller_bench.margins import OpenLoop
from meltemi.tuning.controller_bench.report import RADAR, radar_start, radar_values
from meltemi.tuning.controller_bench.verdicts import decibel

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def plot_bench(bench: ControllerBench) -> Figure:
    """Plot lifetime loads of controllers over those of the reference, and their stability margins by wind speed."""
    figure: Any = ShownFigure(figsize=(9.5, 4.4), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=[1.25, 1.0])
    radar = figure.add_subplot(grid[:, 0], projection="polar", axes_class=None)
    by_controller = radar_values(bench)
    angles = np.linspace(0.0, 2.0 * math.pi, len(RADAR) + 1)
    for j, name in enumerate(bench.controllers):
        values = by_controller.get(name, [math.nan] * len(RADAR))
        radar.plot(angles, 100.0 * np.array([*values, values[0]]), label=name, **curve(j))
    radar.set_xticks(angles[:-1], RADAR.values())
    radar.tick_params(axis="x", pad=20)
    radar.set_rlim(100.0 * radar_start(by_controller) if by_controller else 0.0)
    radar.set_rlabel_position(67.5)
    radar.spines["polar"].set_color(SOFT)
    heading(radar, "lifetime loads over those of the reference [%]")
    handles, labels = radar.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=5)
    limits = bench.limits
    rows: tuple[tuple[str, str, Callable[[OpenLoop], float], float], ...] = (
        ("phase margin", "deg", lambda loop: math.degrees(loop.phase_margin), math.degrees(limits.phase_margin)),
        ("gain margin", "dB", lambda loop: decibel(loop.gain_margin), decibel(limits.gain_margin)),
    )
    for i, (title, unit, of, limit) in enumerate(rows):
        ax = figure.add_subplot(grid[i, 1])
        for j, name in enumerate(bench.controllers):
            for loops, style in ((bench.loops, {}), (bench.blade_loops, {"linestyle": "--", "marker": "s"})):
                at = loops.get(name, ())
                shown = [x if math.isfinite(x := of(loop)) else math.nan for loop in at]
                ax.plot([loop.wind_speed for loop in at], shown, **curve(j) | style)
        ax.axhline(limit, color=SOFT, linestyle=":", linewidth=1.2)
        ax.set_ylim(bottom=0.0)
        ax.set_xlim(min(bench.speeds) - 0.5, max(bench.speeds) + 0.5)
        loops_of = "speed loop (blade loops dashed)" if bench.blade_loops else "speed loop"
        panel(ax, f"{title} of the {loops_of}, limit dotted", unit, "wind speed [m/s]" if i else "")
    return figure
