"""Tables and plots of a fit and of the suitability for a site, in engineering units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from meltemi.loads.surrogate.campaign import SurrogateDesign
from meltemi.loads.surrogate.model import Float, LoadModel, Polynomials, Surrogate
from meltemi.loads.surrogate.site import Suitability
from meltemi.report.palette import COLOURS, FAINT, INK
from meltemi.report.plots import corner, figure_title, heading, new_figure, panel
from meltemi.report.tables import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Rows = tuple[list[str], list[list[str]]]
ERRORS = {"r2": "R2", "nrmse": "NRMSE %", "floor": "NRMSE of scatter %", "bias": "bias %"}
"""Heads of the errors at held-out points."""
COLUMNS = 3
"""Largest number of panels of a validation side by side."""
VERDICTS = {"yes": COLOURS[5], "no": COLOURS[6], "undecided": COLOURS[1]}
"""Colours by whether a load is below that of the design."""


def fit_rows(surrogate: Surrogate) -> Rows:
    """Header and rows of a fit: terms, scatter over seeds, errors at held-out points, and whether a load is usable."""
    head = ["load", "slope", "terms", "scatter %", *ERRORS.values(), "verdict"]
    rows = []
    for name, model in surrogate.loads.items():
        cells = [number(100.0 * model.scatter), *error_cells(model, *ERRORS), model.verdict]
        rows.append([name, f"{model.slope:g}", str(model.coefficients.shape[1]), *cells])
    return head, rows


def error_cells(model: LoadModel, *keys: str) -> list[str]:
    """Errors of a load at held-out points, in the order of keys of ``ERRORS``."""
    return [number(model.errors.get(key, np.nan) * (1.0 if key == "r2" else 100.0)) for key in keys]


def value_rows(surrogate: Surrogate, loads: Mapping[str, Float]) -> Rows:
    """Header and rows of the loads at one point, each beside its errors at held-out points."""
    head = ["load", "unit", "slope", "mean", "scatter %", ERRORS["r2"], ERRORS["nrmse"], "verdict"]
    rows = []
    for name, m in surrogate.loads.items():
        cells = [number(float(loads[name]) / 1e3), number(100.0 * m.scatter), *error_cells(m, "r2", "nrmse"), m.verdict]
        rows.append([name, f"k{m.unit}", f"{m.slope:g}", *cells])
    return head, rows


def influence_rows(surrogate: Surrogate) -> Rows:
    """Header and rows of the total Sobol indices of a polynomial surrogate; no rows for others."""
    models = [model for model in surrogate.loads.values() if isinstance(model.basis, Polynomials)]
    head = ["load", *(name.replace("_", "\n") for name in surrogate.space.names)]
    return head, [[model.name, *(f"{share:.3f}" for share in model.shares()[1])] for model in models]


def plot_surrogate(surrogate: Surrogate, design: SurrogateDesign, loads: Float) -> Figure:
    """Plot predicted loads over simulated ones, means over seeds, at held-out points; without any at all points.

    Args:
      surrogate: surrogate of the campaign.
      design: points of the runs.
      loads: (n, L) equivalent loads of the runs, from ``surrogate_loads``.
    """
    at = design.check if design.check.any() else np.ones(len(design), dtype=bool)
    _, first, place, count = np.unique(design.point[at], return_index=True, return_inverse=True, return_counts=True)
    n = len(surrogate.loads)
    columns = min(COLUMNS, n)
    lines = -(-n // columns)
    figure, axes = new_figure(lines, columns, size=(3.3 * columns, 3.1 * lines + 0.3), share=False)
    for i, (ax, (name, model)) in enumerate(zip(axes.ravel(), surrogate.loads.items(), strict=False)):
        mean = np.bincount(place, loads[at, i]) / count
        factor, unit = (1e-6, f"M{model.unit}") if mean.max() > 2e6 else (1e-3, f"k{model.unit}")
        predicted = model.predict_output(design.values[at][first], outside="clip")
        ends = np.array([0.0, 1.05 * max(mean.max(), predicted.max())]) * factor
        ax.plot(ends, ends, color=FAINT, linewidth=1.0)
        ax.plot(mean * factor, predicted * factor, "o", color=COLOURS[0], markersize=3.5, alpha=0.8)
        panel(ax, name.replace("_", " "), unit, f"simulated [{unit}]")
        ax.set_ylabel(f"predicted [{unit}]")
        if model.errors:
            corner(ax, 0.05, 0.86, f"R$^2$ {model.errors['r2']:.3f}, NRMSE {100.0 * model.errors['nrmse']:.1f} %")
        ax.set_xlim(*ends)
        ax.set_ylim(*ends)
    for ax in axes.ravel()[n:]:
        ax.set_visible(False)
    where = "held-out points" if design.check.any() else "points of the fit"
    figure_title(figure, f"{surrogate.turbine}: equivalent loads at {len(first)} {where}", "")
    return figure


def suitability_rows(suitability: Suitability) -> Rows:
    """Header and rows of the margins of a site."""
    head = ["load", "slope", "site kN m", "design kN m", "ratio", "5 %", "95 %", "margin %"]
    head += [ERRORS["r2"], ERRORS["nrmse"], "below design"]
    if any(margin.load.unit == "N" for margin in suitability.margins):
        head[2:4] = ["site kN, kN m", "design kN, kN m"]
    rows = []
    for m in suitability.margins:
        cells = [m.site / 1e3, m.design / 1e3, m.ratio, m.low, m.high, 100.0 * (1.0 - m.ratio)]
        errors = error_cells(m.load, "r2", "nrmse")
        rows.append([m.load.name, f"{m.load.slope:g}", *map(number, cells), *errors, m.verdict])
    return head, rows


def plot_suitability(suitability: Suitability) -> Figure:
    """Plot the ratios of lifetime loads of a site to those of the design, with intervals of 90 %."""
    n = len(suitability.margins)
    figure, axes = new_figure(1, size=(8.0, 0.42 * n + 1.7))
    ax = axes[0, 0]
    for i, m in enumerate(suitability.margins):
        colour = VERDICTS[m.verdict]
        ax.barh(n - 1 - i, m.ratio, height=0.6, color=colour, alpha=0.75)
        ax.plot([m.low, m.high], [n - 1 - i] * 2, color=INK, linewidth=2.0)
        ax.text(0.012, n - 1 - i, f"{m.ratio:.3f}", va="center", fontsize=8, color="white")
    ax.axvline(1.0, color=INK, linewidth=1.0, linestyle="--")
    ax.set_yticks(range(n), [m.load.name.replace("_", " ") for m in reversed(suitability.margins)])
    ax.set_xlim(0.0, 1.12 * max(1.0, *(max(m.ratio, m.high) for m in suitability.margins)))
    ax.grid(False, axis="y")
    ax.set_xlabel(f"lifetime equivalent load over that of {suitability.design.name or 'the design'}")
    heading(ax, f"{suitability.site.name or 'site'}: {suitability.verdict}")
    return figure
