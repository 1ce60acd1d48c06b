"""Figures 1, 15 and 16, which are block diagrams: drawn as this package has the system, from ``diagrams.yaml``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from meltemi.core.yamlfile import read_mapping
from meltemi_papers.block_diagram import Block, Frame, Wire, plot_blocks

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def parts(name: str) -> tuple[dict[str, Block], list[Wire], list[Frame]]:
    """Blocks, wires and frames of a diagram: ``system``, ``climate`` or ``coordination``."""
    found = read_mapping(Path(__file__).with_suffix(".yaml"))[name]
    blocks = {key: Block(**block) for key, block in found["blocks"].items()}
    return blocks, [Wire(**wire) for wire in found["wires"]], [Frame(**frame) for frame in found["frames"]]


def diagram(name: str) -> Figure:
    """Draw a diagram."""
    return plot_blocks(*parts(name), font=9.5)
