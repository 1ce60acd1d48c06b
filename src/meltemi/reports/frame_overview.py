"""Frame of a turbine on its summary page: stiffness at the tower's base, frequencies, picture of its modes."""

from __future__ import annotations

import math
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np

from meltemi.frames.finite_elements import Assembly, assemble
from meltemi.frames.hull import afloat, clamped_joint
from meltemi.frames.reduction import frequencies, reduced, tower_base
from meltemi.frames.water import pieces, plates
from meltemi.report.palette import COLOURS, FAINT
from meltemi.reports.blocks import Block, Picture, Table
from meltemi.reports.turbine_facts import frame_masses, number
from meltemi.structure.members import ModalMember
from meltemi.turbine.definition import Turbine

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN, PANELS = 6, 4
"""Frequencies in the tables; modes in the picture."""
DRAWN = 0.1
"""Largest displacement of a drawn mode over the height of frame and tower."""
MOTIONS = ("x", "y", "z", "about x", "about y", "about z")


def words_on_ends(assembly: Assembly) -> str:
    """What the coefficients of the ends of members at joints are, and at which of these the ends act like plates."""
    frame, joints = assembly.frame, plates(assembly, pieces(assembly))
    c = frame.ends
    words = f"Ends of members at joints: drag {c.drag:g}, added mass {c.added_mass:g}, pressure {c.pressure:g}"
    words += f", others at {len(frame.other_ends)} joints." if frame.other_ends else "."
    if joints:
        words += (
            f" At {len(joints)} joints where members meet, {joints[0]} the first of them, these ends act on the water "
            "like plates as wide as the braces, although they are inside of other members: set drag and added mass to "
            "0 there, unless you compare with a program that has them."
        )
    return words


def frame_assembly(turbine: Turbine) -> Assembly:
    """Finite elements of a turbine's frame; one that floats is clamped at its joint next to the platform's point."""
    assert turbine.frame is not None
    base = tower_base(turbine.frame, turbine.tower)
    return assemble(turbine.frame, base) if turbine.platform is None else afloat(turbine.frame, turbine.platform, base)


def frame_blocks(turbine: Turbine, member: ModalMember) -> list[Block]:
    """Picture, masses, frequencies, and stiffness at the tower's base.

    Args:
      member: tower and frame, of a model.
    """
    assembly = frame_assembly(turbine)
    masses = [[name, number(1e-3 * kg)] for name, kg in frame_masses(assembly).items()]
    file = BytesIO()
    plot_frame_modes(turbine, member).savefig(file, format="png", dpi=110)
    if turbine.platform is None:
        free, fixed = (frequencies(assembly, SHOWN, fixed=fixed) / (2.0 * math.pi) for fixed in (False, True))
        header = ["mode", "free\nHz", "clamped\nHz"]
        rows = [[str(i + 1), number(a), number(b)] for i, (a, b) in enumerate(zip(free, fixed, strict=False))]
        caption, held = "Frequencies of the frame alone, in air, with the tower's base free and clamped.", ""
    else:
        header = ["mode", "Hz"]
        names = [name for name in member.names if not name.startswith("base")]
        rows = [[name, number(f / (2.0 * math.pi))] for name, f in zip(names, member.modes.frequency, strict=False)]
        caption = "Frequencies of platform and tower with the mass on top, afloat in still water, without weight."
        held = f" over joint {clamped_joint(assembly.frame)}"
    K = reduced(assembly, 0).stiffness
    small = 1e-9 * np.sqrt(np.outer(np.diag(K), np.diag(K)))
    stiffness = [
        [name, *(number(x) for x in row)] for name, row in zip(MOTIONS, np.where(abs(K) > small, K, 0.0), strict=True)
    ]
    height = number(turbine.tower.base_height)
    at = f"Static stiffness at the tower's base{held}, {height} m above mean sea level, in N and N m."
    return [
        Picture(file.getvalue(), "First modes of tower and frame with the mass on top and the still water around."),
        Table(["mass", "t"], masses, "Masses; that of the water around is not among them.", text_columns=1),
        Table(header, rows, caption, text_columns=1),
        Table(
            ["", *(f"{name}\n{'rad' if 'about' in name else 'm'}" for name in MOTIONS)], stiffness, at, text_columns=1
        ),
        words_on_ends(assembly),
    ]


def plot_frame_modes(turbine: Turbine, member: ModalMember) -> Figure:
    """Elevations of the first modes of tower and frame: fore-aft ones from the side, others looking downwind."""
    from meltemi.report.figure import ShownFigure

    below = member.below
    assert below is not None
    assembly, modes, frequency = frame_assembly(turbine), member.modes, member.modes.frequency[: len(below)]
    base = assembly.points[-1]
    tower = np.column_stack([np.full((len(modes.z), 2), base[:2]), base[2] + modes.z])
    height = float(np.ptp(np.concatenate([tower[:, 2], assembly.points[:, 2]])))
    figure = ShownFigure(figsize=(11.0, 6.4), layout="constrained")
    for panel, k in enumerate(np.argsort(frequency)[:PANELS]):
        i = 0 if "fore" in member.names[k] else 1
        ax = figure.add_subplot(1, PANELS, panel + 1)
        scale = DRAWN * height / max(np.abs(modes.shape[k, :, :3]).max(), np.abs(below[k, :, :3]).max())
        moved = assembly.points + scale * below[k, :, :3], tower + scale * modes.shape[k, :, :3]
        for points, line, colour in ((assembly.points, tower, FAINT), (*moved, COLOURS[0])):
            for nodes in assembly.member_nodes.values():
                ax.plot(points[nodes, i], points[nodes, 2], color=colour, linewidth=1.0)
            ax.plot(line[:, i], line[:, 2], color=colour, linewidth=2.2)
        ax.axhline(0.0, color=FAINT, linestyle="--", linewidth=0.8)
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_title(f"{member.names[k]}\n{number(frequency[k] / (2.0 * math.pi))} Hz", fontsize=9)
        ax.set_xlabel("x, downwind [m]" if i == 0 else "y, to the left [m]")
    figure.axes[0].set_ylabel("height above mean sea level [m]")
    return figure
