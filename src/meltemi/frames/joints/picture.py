"""Picture of a frame from two sides: members by utilisation, joints by damage."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from meltemi.frames.definition import Frame
from meltemi.report.palette import FAINT, GROWING, INK

if TYPE_CHECKING:
    from matplotlib.figure import Figure

VIEWS = ((0, "x, downwind [m]", "seen from the side"), (1, "y, to the left [m]", "seen downwind"))
"""Horizontal coordinate of each view."""
DECADES = 3.0
"""Decades of damage below the largest that are distinguished."""


def plot_joint_damage(frame: Frame, damage: Mapping[str, float], utilisation: Mapping[str, float]) -> Figure:
    """Two elevations of a frame.

    Args:
      damage: damage of the lifetime, with its design fatigue factor, by joint; joints without it are not drawn.
      utilisation: of members by name; those without it are grey.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize

    from meltemi.report.figure import ShownFigure

    colours = LinearSegmentedColormap.from_list("growing", [FAINT, *GROWING[1:], INK])
    largest = max([*damage.values(), 1e-12])
    of_damage = LogNorm(largest / 10.0**DECADES, largest, clip=True)
    of_use = Normalize(0.0, max([*utilisation.values(), 1.0]))
    figure = ShownFigure(figsize=(9.0, 6.0), layout="constrained")
    axes = [figure.add_subplot(1, 2, k + 1) for k in range(2)]
    for ax, (i, label, title) in zip(axes, VIEWS, strict=True):
        for name, member in frame.members.items():
            ends = np.array([frame.joints[joint] for joint in member.joints])
            known = name in utilisation
            colour = colours(of_use(utilisation[name])) if known else FAINT
            ax.plot(ends[:, i], ends[:, 2], color=colour, linewidth=2.5 if known else 1.0, solid_capstyle="round")
        for joint, value in sorted(damage.items(), key=lambda each: each[1]):
            x, z = frame.joints[joint][[i, 2]]
            ax.plot(x, z, "o", color=colours(of_damage(value)), markeredgecolor=INK, markersize=6.0)
        ax.axhline(0.0, color=FAINT, linestyle="--", linewidth=0.8)
        ax.set_aspect("equal")
        ax.set_xlabel(label)
        ax.set_title(title)
    axes[0].set_ylabel("height above mean sea level [m]")
    if utilisation:
        figure.colorbar(ScalarMappable(of_use, colours), ax=axes, shrink=0.6, label="members: utilisation [-]")
    if damage:
        figure.colorbar(
            ScalarMappable(of_damage, colours),
            ax=axes,
            shrink=0.6,
            label="joints: damage in the lifetime times DFF [-]",
        )
    return figure
