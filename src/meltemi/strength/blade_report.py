"""Tables and figure of the strength of a blade's plies, panels and faces."""

from __future__ import annotations

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
STABILITY = "buckling", "wrinkling"
TOP = 1e6
"""Largest damage that is drawn."""
LAYERS = (
    "station [m]|layer|material|stress|strain|Tsai-Wu|index|margin|mode|result|time [s]|x [m]|y [m]|damage|across"
).split("|")
PANELS = "station [m],mode,where,width [m],critical [kN/m],compression [kN/m],index,margin,result,time [s]".split(",")
WORST = "station [m]|worst layer|mode|index|margin|buckling|wrinkling|damage|of layer|result".split("|")


def _known(value: float) -> str:
    """A number; empty where it is not known."""
    return "" if np.isnan(value) else number(value)


def margin(index: float) -> str:
    """Margin of safety; empty where the index is zero or not known."""
    return number(1.0 / index - 1.0) if index > 0.0 else ""


def layer_rows(strength: BladeStrength) -> Rows:
    """Header and rows of all layers."""
    rows = []
    for x in strength.layers:
        indices, at = map(_known, (x.stress, x.strain, x.tsai_wu, x.index)), map(_known, (x.time, *x.position))
        judged = [*indices, margin(x.index), x.mode, strength.names[x.result], *at]
        rows.append([number(x.station), x.layer, x.material, *judged, _known(x.damage), _known(x.damage_across)])
    return list(LAYERS), rows


def worst_rows(strength: BladeStrength) -> Rows:
    """Header and rows for a terminal: of each station the layers with the largest index and damage, and stability."""
    rows = []
    for place in strength.points:
        here = [x for x in strength.layers if x.station == place and x.index == x.index]
        if here:
            x, tired = max(here, key=lambda x: x.index), max(here, key=lambda x: np.nan_to_num(x.damage, posinf=1e300))
            panels = [p for p in strength.panels if p.station == place]
            most = [max((p.index for p in panels if p.mode == mode), default=np.nan) for mode in STABILITY]
            judged = [x.layer, x.mode, number(x.index), margin(x.index), *map(_known, most), _known(tired.damage)]
            rows.append([number(place), *judged, tired.layer, strength.names[x.result]])
    return list(WORST), rows


def panel_rows(strength: BladeStrength) -> Rows:
    """Header and rows of panels between webs and faces of sandwiches."""
    rows = []
    for p in strength.panels:
        values = map(_known, (p.width, 1e-3 * p.critical, 1e-3 * p.load, p.index))
        rows.append([number(p.station), p.mode, p.where, *values, margin(p.index), strength.names[p.result]])
        rows[-1].append(_known(p.time))
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
    for mode, line in zip(STABILITY, ("-", "--"), strict=True):
        most = {p.station: 0.0 for p in strength.panels if p.mode == mode}
        most = {place: max(p.index for p in strength.panels if (p.mode, p.station) == (mode, place)) for place in most}
        if most:
            look = {"color": FAINT, "linestyle": line, "linewidth": 2.2, "zorder": 1.5}
            span.plot(list(most), list(most.values()), label=f"{mode}, largest", **look)
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
