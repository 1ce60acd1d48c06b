"""Figure of potential-flow coefficients."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from meltemi.report.palette import COLOURS
from meltemi.report.plots import figure_title, new_figure, panel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from meltemi.floating.potential import HydroCoefficients

SHOWN = (("surge", 0, 3), ("heave", 2, 3), ("pitch", 4, 5))
"""Motions, their places, and the power of length [m] of their added mass over density."""
FAINTEST = 1e-3
"""Share of the largest excitation below which its phase is noise."""


def plot_coefficients(title: str, c: HydroCoefficients) -> Figure:
    """Added mass and damping over density, and excitation in waves along x over density and gravity, over period.

    Phases are those by which the force leads the wave crest at the origin.
    """
    figure, axes = new_figure(3, 4, size=(14.0, 7.5), share=True)
    T, along = 2.0 * np.pi / c.frequency, int(np.argmin(np.abs(c.heading)))
    for row, (name, k, power) in enumerate(SHOWN):
        X = c.excitation[:, along, k]
        some = np.abs(X) > FAINTEST * np.abs(X).max(initial=0.0)
        force = "moment" if k > 2 else "force"
        lines = (
            (rf"added mass / $\rho$, {name}", c.added_mass[:, k, k], f"m$^{power}$"),
            (rf"damping / $\rho$, {name}", c.damping[:, k, k], f"m$^{power}$/s"),
            (rf"exciting {force} / ($\rho g$), {name}", np.abs(X), f"m$^{3 if k > 2 else 2}$"),
            (f"phase of the {force}, {name}", np.where(some, np.degrees(np.angle(X)), np.nan), "deg"),
        )
        for column, (label, values, unit) in enumerate(lines):
            ax = axes[row, column]
            look = {"ls": "", "marker": ".", "ms": 3.5} if unit == "deg" else {"lw": 1.2}
            ax.plot(T, values, color=COLOURS[min(column, 2)], **look)
            panel(ax, label, unit)
            if column == 3:
                ax.set(ylim=(-190.0, 190.0), yticks=(-180.0, -90.0, 0.0, 90.0, 180.0))
        infinite = axes[row, 0].axhline(c.infinite[k, k], color="0.6", lw=0.8, ls="--", label="at infinite frequency")
        if not row:
            axes[row, 0].legend(handles=[infinite], fontsize="small")
    for ax in axes[-1]:
        ax.set_xlim(0.0, 35.0)
        ax.set_xlabel("period [s]")
    figure_title(figure, title, f": waves along {c.heading[along]:g} deg, density $\\rho$, gravity $g$", longest=110)
    return figure
