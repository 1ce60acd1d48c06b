"""Figure of a section: its plies and its centres."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import figure_title, heading, new_figure
from meltemi.sections.elements import Mesh
from meltemi.sections.layup import Section
from meltemi.sections.properties import Centres, SectionModel, centres_of
from meltemi.sections.thin_walled import Walls
from meltemi.sections.walls import at_arc

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Float = NDArray[np.float64]
POINTS = (("shear", "o", "shear centre"), ("tension", "s", "tension centre"), ("mass", "D", "centre of mass"))


def plot_section(model: SectionModel) -> Figure:
    """Draw a section seen from the blade's root: plies by material, centres, principal axes; details below.

    Args:
      model: of finite elements, or of thin walls.
    """
    from matplotlib.patches import Patch

    figure, axes = new_figure(2, 2, size=(12.0, 7.6), share=False)
    grid = axes[0, 0].get_gridspec()
    for ax in axes[0]:
        ax.remove()
    whole, centres = figure.add_subplot(grid[0, :]), centres_of(model.stiffness, model.mass)
    polygons, ply, corners = _polygons(model)
    names = list(dict.fromkeys(model.section.plies[i].material for i in ply))
    colour = {name: COLOURS[j % len(COLOURS)] for j, name in enumerate(names)}
    faces = [colour[model.section.plies[i].material] for i in ply]
    for ax in (whole, *axes[1]):
        _draw(ax, polygons, faces, lines=ax is not whole)
    _mark(whole, centres, corners)
    heading(whole, "seen from the root; crosses at the tension centre: principal axes")
    size = 0.07 * float(np.ptp(corners[:, 1]))
    spar = _thickest(model.section)
    edge = corners[int(np.argmax(corners[:, 1]))] - [0.0, 0.7 * size]
    for ax, at, title in (
        (axes[1, 0], spar, "detail at the thickest wall"),
        (axes[1, 1], edge, "detail at the trailing edge"),
    ):
        ax.set(xlim=(at[1] - size, at[1] + size), ylim=(at[0] - 0.55 * size, at[0] + 0.55 * size))
        heading(ax, title)
    patches = [Patch(facecolor=colour[name], edgecolor="none", label=name) for name in names]
    marks, _ = whole.get_legend_handles_labels()
    figure.legend(handles=[*patches, *marks], loc="outside lower center", ncols=5, fontsize="small")
    for ax in (whole, *axes[1]):
        ax.set(xlabel="y, towards the trailing edge [m]", ylabel="x, towards the suction side [m]")
    figure_title(figure, model.section.name, longest=110)
    return figure


def _polygons(model: SectionModel) -> tuple[list[Float], list[int], Float]:
    """Outlines, the ply of each, and all points."""
    if isinstance(model.mesh, Mesh):
        nodes = model.mesh.nodes.real
        return [nodes[e[[0, 4, 1, 5, 2, 6, 3, 7]]] for e in model.mesh.elements], list(model.mesh.ply), nodes
    walls: Walls = model.mesh
    outlines, ply = [], []
    for wall in walls.walls:
        a, b = (end.real for end in walls.ends(wall))
        t = (b - a) / np.hypot(*(b - a))
        n, faces = np.array([t[1], -t[0]]), wall.laminate.faces.real
        for (i, _), low, high in zip(() if wall.link else wall.plies, faces[:-1], faces[1:], strict=False):
            outlines.append(np.stack([a + low * n, b + low * n, b + high * n, a + high * n]))
            ply.append(i)
    return outlines, ply, np.concatenate(outlines)


def _thickest(section: Section) -> Float:
    """Where the wall of the suction side is thickest: its edge towards the leading edge."""
    at = np.linspace(0.02, 0.45, 400)
    shell = [ply for ply in section.plies if ply.web is None]
    total = sum((np.where((p.start <= at) & (at <= p.end), p.thickness.real, 0.0) for p in shell), np.zeros(400))
    return np.asarray(at_arc(section.contour.real, at[total > 0.99 * total.max()][-1:])[0])


def _draw(ax: Axes, polygons: list[Float], faces: list[str], *, lines: bool) -> None:
    from matplotlib.collections import PolyCollection

    look: dict[str, Any] = {"edgecolors": "white" if lines else "face", "linewidths": 0.3}
    ax.add_collection(PolyCollection([p[:, ::-1] for p in polygons], facecolors=faces, **look))
    ax.autoscale_view()
    ax.set_aspect("equal")


def _mark(ax: Axes, centres: Centres, corners: Float) -> None:
    for (name, marker, label), face in zip(POINTS, ("white", "white", INK), strict=True):
        x, y = getattr(centres, name).real
        ax.plot(
            y, x, marker, ms=6.0, mfc=face, mec=INK, mew=1.2, ls="", label=f"{label} ({x:.3f}, {y:.3f}) m", zorder=5
        )
    ax.plot(0.0, 0.0, "+", ms=9.0, color=INK, mew=1.2, ls="", label="reference axis")
    x, y = centres.tension.real
    c, s = np.cos(centres.direction), np.sin(centres.direction)
    for dx, dy, length in ((s, c, 0.5 * np.ptp(corners[:, 1])), (c, -s, 0.7 * np.ptp(corners[:, 0]))):
        ax.plot(
            [y - length * dy, y + length * dy], [x - length * dx, x + length * dx], color=INK, lw=0.7, ls="--", zorder=4
        )
