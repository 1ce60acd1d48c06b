"""Figure of coefficients of potential flow."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from meltemi.report.palette import COLOURS
from meltemi.report.plots import heading, new_figure, panel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from meltemi_float.potential import Coefficients

SHOWN = (("surge", 0, "m^3"), ("heave", 2, "m^3"), ("pitch", 4, "m^5"))


def plot_coefficients(title: str, c: Coefficients) -> Figure:
    """Added mass and damping over density, and excitation in waves along x over density and gravity, over period."""
    figure, axes = new_figure(3, 3, size=(11.0, 7.0), share=True)
    T, along = 2.0 * np.pi / c.frequency, int(np.argmin(np.abs(c.heading)))
    for row, (name, k, unit) in enumerate(SHOWN):
        lines = (
            (f"added mass, {name}", c.added_mass[:, k, k], unit),
            (f"damping, {name}", c.damping[:, k, k], f"{unit}/s"),
            (
                f"excitation, {name}",
                np.abs(c.excitation[:, along, k]),
                unit.replace("5", "3").replace("m^3", "m^2") if k < 3 else "m^3",
            ),
        )
        for column, (label, values, what) in enumerate(lines):
            ax = axes[row, column]
            ax.plot(T, values, color=COLOURS[column], lw=1.2)
            panel(ax, label, what)
            if column == 0:
                ax.axhline(c.infinite[k, k], color="0.6", lw=0.8, ls="--")
    for ax in axes[-1]:
        ax.set_xlim(0.0, 35.0)
        ax.set_xlabel("period [s]")
    heading(axes[0, 0], title, "right")
    return figure
