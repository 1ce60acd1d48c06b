"""Tables and figure of the strength of a blade's plies and panels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from meltemi.report.palette import FAINT, GRID, GROWING, INK, curve
from meltemi.report.plots import figure_title, panel
from meltemi.report.tables import Rows, number
from meltemi.strength.plies import BladeStrength, LayerStrength

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 7
"""Largest number of layers that are drawn over the span: those with the largest index."""
TOP = 1e6
"""Largest damage that is drawn."""
LAYERS = "station [m]|layer|material|stress|strain|Tsai-Wu|index|margin|mode|result|time [s]|x [m]|y [m]|damage".split(
    "|"
)
PANELS = "station [m],panel,width [m],critical [kN/m],compression [kN/m],index,margin,result,time [s]".split(",")
WORST = "station [m]|worst layer|mode|index|margin|time [s]|buckling|damage|of layer|result".split("|")


def margin(index: float) -> str:
    """Margin of safety; empty where the index is zero or not known."""
    return number(1.0 / index - 1.0) if index > 0.0 else ""


def layer_rows(strength: BladeStrength, names: Sequence[str]) -> Rows:
    """Header and rows of all layers; ``names`` of the results."""
    rows = []
    for x in strength.layers:
        values = [number(v) if v == v else "" for v in (x.stress, x.strain, x.tsai_wu, x.index)]
        at = [names[x.result], *map(number, (x.time, *x.position)), number(x.damage) if x.damage == x.damage else ""]
        rows.append([number(x.station), x.layer, x.material, *values, margin(x.index), x.mode, *at])
    return list(LAYERS), rows


def worst_rows(strength: BladeStrength, names: Sequence[str]) -> Rows:
    """Header and rows for a terminal: of each station the layer with the largest index, and its panels."""
    rows = []
    for place in strength.points:
        here = [x for x in strength.layers if x.station == place and x.index == x.index]
        if here:
            x, tired = max(here, key=lambda x: x.index), max(here, key=lambda x: np.nan_to_num(x.damage, posinf=1e300))
            buckling = max((p.index for p in strength.panels if p.station == place), default=float("nan"))
            judged = [
                number(x.index),
                margin(x.index),
                number(x.time),
                number(buckling) if buckling == buckling else "",
            ]
            rows.append([number(place), x.layer, x.mode, *judged, number(tired.damage), tired.layer, names[x.result]])
    return list(WORST), rows


def panel_rows(strength: BladeStrength, names: Sequence[str]) -> Rows:
    """Header and rows of the panels between webs."""
    rows = []
    for p in strength.panels:
        values = map(number, (p.width, 1e-3 * p.critical, 1e-3 * p.load, p.index))
        rows.append([number(p.station), p.side, *values, margin(p.index), names[p.result], number(p.time)])
    return list(PANELS), rows


def plot_blade_strength(strength: BladeStrength, title: str = "") -> Figure:
    """Draw index and damage of layers over the span, and the index of all plies in the section of the worst station."""
    from meltemi.report.figure import ShownFigure

    figure = ShownFigure(figsize=(12.0, 8.0), layout="constrained")
    axes = figure.subplot_mosaic([["span", "tired"], ["section", "section"]], height_ratios=[1.0, 0.75])
    span, tired, section = (axes[name] for name in ("span", "tired", "section"))
    judged = [x for x in strength.layers if x.index == x.index]
    by_name: dict[str, list[LayerStrength]] = {}
    for x in judged:
        by_name.setdefault(x.layer, []).append(x)
    looks: dict[str, dict[str, Any]] = {}
    for ax, of in ((span, "index"), (tired, "damage")):
        order = sorted(by_name, key=lambda name: -np.nanmax([0.0, *(getattr(x, of) for x in by_name[name])]))
        for name in order[:SHOWN]:
            places = [x.station for x in by_name[name]]
            values = np.clip([getattr(x, of) for x in by_name[name]], 1e-12, TOP)
            look = looks.setdefault(name, curve(len(looks)) | {"markersize": 3.5})
            ax.plot(places, values, label=name, **look)
        ax.axhline(1.0, color=INK, linewidth=0.8, linestyle="--")
    for side, line in (("suction side", "-"), ("pressure side", "--")):
        of_side = [p for p in strength.panels if p.side == side]
        if of_side:
            look = {"color": FAINT, "linestyle": line, "linewidth": 2.2, "zorder": 1.5}
            span.plot([p.station for p in of_side], [p.index for p in of_side], label=f"buckling, {side}", **look)
    span.set_ylim(bottom=0.0)
    tired.set_yscale("log")
    tired.set_ylim(1e-8, 2.0 * TOP)
    panel(span, "largest index with partial factors", "-", "distance from the root [m]")
    panel(tired, "damage along the fibres over the lifetime", "-", "distance from the root [m]")
    for ax in (span, tired):
        ax.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3)
    if judged:
        from matplotlib.colors import LinearSegmentedColormap

        place = max(judged, key=lambda x: x.index).station
        at, index = strength.points[place]
        last = np.argsort(np.nan_to_num(index))
        colours = LinearSegmentedColormap.from_list("index", [GRID, *GROWING[1:]])
        drawn = section.scatter(at[last, 1], at[last, 0], c=index[last], s=7.0, cmap=colours, vmin=0.0)
        figure.colorbar(drawn, ax=section, label="index [-]", shrink=0.9)
        section.set_aspect("equal", adjustable="box")
        section.set_ylabel("x, to the suction side [m]")
        section.set_xlabel("y, to the trailing edge [m]")
        section.set_title(f"largest index of all plies at {place:g} m")
    if title:
        figure_title(figure, title)
    return figure
