"""Colours of all figures.

The colours of series differ for readers with full, red-blind and green-blind sight, the first seven by at least 20, all
ten by at least 15 units of CIELAB (tested with the matrices of Machado, Oliveira and Fernandes 2009).
"""

from __future__ import annotations

from typing import Any

INK, SOFT, FAINT, GRID, SHADE = "#1b2a38", "#5b6873", "#9aa5ae", "#d7dde2", "#e8edf1"
"""Text and axes; secondary text; reference lines; grid; areas."""
COLOURS = (
    *("#0b6e99", "#e08a00", "#332288", "#56b4e9", "#994f12"),
    *("#009e73", "#882255", "#86cbb4", "#5c3a00", "#7f3ff0"),
)
"""Colours of series, in this order."""
ON_DARK = (
    *("#3cb6d1", "#efa031", "#8f7bff", "#ace4ff", "#cc853d"),
    *("#30c798", "#ff5fba", "#c5ecdb", "#a18a53", "#d1a0ff"),
)
"""Colours of series on a dark page; they differ by at least 13."""
BLADES = tuple(COLOURS[i] for i in (0, 1, 6))
"""Colours of blades 1 to 3."""
DIVERGING = ("#882255", "#e9a3c4", "#ffffff", "#a8d5e5", "#0b6e99")
"""Colours of fields that are negative, zero and positive."""
GROWING = ("#ffffff", "#e9a3c4", "#882255")
"""Colours of fields from zero to large, where large is bad."""
MARKERS = "osD^v<>P*Xp"
LINES = ("-", "--", "-.")
FACES = {
    "plant": ("#e8f3f2", "#1b7f79"),
    "control": ("#f7ecd9", "#b7791f"),
    "outside": ("#e6eef5", "#0b6e99"),
    "plain": ("white", SOFT),
}
"""Face and edge colour of the blocks of a diagram, by kind."""


def curve(j: int) -> dict[str, Any]:
    """Colour, marker and line style of the j-th curve, unique for the first 110."""
    line = LINES[j // len(COLOURS) % len(LINES)]
    return {"color": COLOURS[j % len(COLOURS)], "marker": MARKERS[j % len(MARKERS)], "linestyle": line}
