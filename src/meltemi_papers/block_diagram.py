"""Block diagrams: blocks at given positions, connected by wires."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from meltemi.core.errors import InputError, did_you_mean
from meltemi.report.palette import FACES, FAINT, INK, SOFT
from meltemi.report.plots import new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Point = tuple[float, float]

SIDES = {"left": (-0.5, 0.0), "right": (0.5, 0.0), "top": (0.0, 0.5), "bottom": (0.0, -0.5)}
WIRE = SOFT


@dataclass(frozen=True)
class Block:
    """A box with a label.

    Attributes:
      text: words, with line breaks.
      at: centre; the unit of length is an inch of the drawing.
      size: width and height.
      kind: key of ``palette.FACES``.
    """

    text: str
    at: Point
    size: tuple[float, float] = (1.5, 0.62)
    kind: str = "plant"


@dataclass(frozen=True)
class Wire:
    """An arrow between two blocks.

    Attributes:
      begin, end: ``"name.side"``, side being one of ``SIDES``, with an optional shift along that side as in
        ``"rotor.top+0.3"``; or a point.
      label: words on it.
      via: corners.
      place: of the label as a share of the wire's length.
      above: whether the label stands above a level part, or to the right of an upright one.
      arrow: whether it ends in an arrowhead.
    """

    begin: str | Point
    end: str | Point
    label: str = ""
    via: Sequence[Point] = ()
    place: float = 0.5
    above: bool = True
    arrow: bool = True


@dataclass(frozen=True)
class Frame:
    """A dashed frame with a label at its lower left, given by its lower left and upper right corners."""

    text: str
    low: Point
    high: Point


def plot_blocks(
    blocks: Mapping[str, Block], wires: Sequence[Wire], frames: Sequence[Frame] = (), *, font: float = 8.0
) -> Figure:
    """Plot a block diagram; the figure size fits its content.

    Raises:
      InputError: a wire names a block or a side that does not exist.
    """
    corners = [
        (b.at[0] + sx * b.size[0], b.at[1] + sy * b.size[1])
        for b in blocks.values()
        for sx, sy in ((-0.5, -0.5), (0.5, 0.5))
    ]
    corners += [p for w in wires for p in w.via] + [p for f in frames for p in (f.low, f.high)]
    xs, ys = zip(*corners, strict=True)
    low, high = (min(xs) - 0.15, min(ys) - 0.15), (max(xs) + 0.15, max(ys) + 0.15)
    figure, axes = new_figure(1, size=(high[0] - low[0], high[1] - low[1]))
    ax: Axes = axes[0, 0]
    ax.set_axis_off()
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])
    ax.set_aspect("equal")
    for frame in frames:
        _frame(ax, frame, font)
    for wire in wires:
        _wire(ax, blocks, wire, font)
    for block in blocks.values():
        _block(ax, block, font)
    return figure


def _block(ax: Axes, block: Block, font: float) -> None:
    from matplotlib.patches import FancyBboxPatch

    face, edge = FACES[block.kind]
    (x, y), (w, h) = block.at, block.size
    shape = "round,pad=0,rounding_size=0.07"
    ax.add_patch(
        FancyBboxPatch(
            (x - 0.5 * w, y - 0.5 * h), w, h, boxstyle=shape, facecolor=face, edgecolor=edge, linewidth=1.1, zorder=3
        )
    )
    ax.text(x, y, block.text, ha="center", va="center", fontsize=font, color=INK, zorder=4, linespacing=1.15)


def _frame(ax: Axes, frame: Frame, font: float) -> None:
    from matplotlib.patches import Rectangle

    (x0, y0), (x1, y1) = frame.low, frame.high
    look: dict[str, Any] = {
        "facecolor": "none",
        "edgecolor": FAINT,
        "linestyle": (0, (5, 3)),
        "linewidth": 0.9,
        "zorder": 1,
    }
    ax.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, **look))
    ax.text(x0 + 0.07, y0 + 0.06, frame.text, fontsize=font, color=SOFT, va="bottom", ha="left", zorder=4)


def _end(blocks: Mapping[str, Block], where: str | Point) -> Point:
    if not isinstance(where, str):
        return where
    name, _, rest = where.partition(".")
    side = rest.split("+")[0].split("-")[0]
    if name not in blocks:
        raise InputError(f"plot_blocks: no block {name!r}: {did_you_mean(name, blocks)}")
    if side not in SIDES:
        raise InputError(f"plot_blocks: {where!r} has no side {side!r}: {did_you_mean(side, SIDES)}")
    shift = float(rest[len(side) :] or 0.0)
    block, (sx, sy) = blocks[name], SIDES[side]
    x, y = block.at[0] + sx * block.size[0], block.at[1] + sy * block.size[1]
    return (x, y + shift) if sy == 0.0 else (x + shift, y)


def _wire(ax: Axes, blocks: Mapping[str, Block], wire: Wire, font: float) -> None:
    points = [_end(blocks, wire.begin), *wire.via, _end(blocks, wire.end)]
    xs, ys = zip(*points, strict=True)
    ax.plot(xs[:-1], ys[:-1], color=WIRE, linewidth=1.0, zorder=2, solid_capstyle="round")
    head = "-|>" if wire.arrow else "-"
    shape = {"arrowstyle": head, "color": WIRE, "linewidth": 1.0, "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 9}
    ax.annotate("", xy=points[-1], xytext=points[-2], arrowprops=shape, zorder=2)
    if wire.label:
        _label(ax, points, wire, font)


def _label(ax: Axes, points: Sequence[Point], wire: Wire, font: float) -> None:
    lengths = [abs(b[0] - a[0]) + abs(b[1] - a[1]) for a, b in pairwise(points)]
    left = wire.place * sum(lengths)
    for (a, b), length in zip(pairwise(points), lengths, strict=True):
        if left <= length:
            share = left / length if length > 0.0 else 0.0
            x, y = a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
            level = abs(b[1] - a[1]) < abs(b[0] - a[0])
            side = 1.0 if wire.above else -1.0
            if level:
                look: dict[str, Any] = {"ha": "center", "va": "bottom" if wire.above else "top"}
                y += 0.04 * side
            else:
                look = {"ha": "left" if wire.above else "right", "va": "center"}
                x += 0.05 * side
            ax.text(x, y, wire.label, fontsize=font - 1.0, color=INK, zorder=4, linespacing=1.1, **look)
            return
        left -= length
