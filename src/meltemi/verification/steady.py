"""Steady operation against OpenFAST."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.report.palette import COLOURS
from meltemi.report.plots import ABOVE, new_figure, panel
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.channels import find, standard
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.rotors import build
from meltemi.simulation.trim import operating_point
from meltemi.turbine.library import load_turbine
from meltemi.verification.openfast_deck import deck_options, deck_turbine
from meltemi.verification.table import Check, CheckTable, angle, reference_table, relative, source_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

BANDS = {
    "GenPwr": 1.0,
    "RotSpeed": 0.3,
    "RtFldFxh": 1.5,
    "RootMyc1": 2.0,
    "RootMxc1": 2.0,
    "OoPDefl1": 3.0,
    "IPDefl1": 3.0,
    "TTDspFA": 3.0,
    "TwrBsMyt": 2.0,
    "YawBrMyp": 2.0,
    "YawBrMzp": 10.0,
    "TwrBsMxt": 10.0,
}
"""Bands [%] of steady means; that of the pitch angle is 0.2 deg."""
FLOOR = 0.2
"""Fraction of the channel's largest steady mean to which small values are compared."""


@cache
def deck_model(aero: str, **changes: Any) -> BladedModel:
    """The turbine of the reference runs with the options of a set, some of them changed."""
    turbine = deck_turbine(load_turbine("nrel5mw"))
    return build(turbine, deck_options(turbine, aero, **changes))


def _steady_table(aero: str) -> dict[float, dict[str, float]]:
    table: dict[float, dict[str, float]] = {}
    for r in reference_table("steady", set=aero):
        table.setdefault(float(r["wind"]), {})[r["channel"]] = float(r["value"])
    return table


def steady(aero: str) -> CheckTable:
    """Means at twelve wind speeds, and the effect of blade torsion, which ElastoDyn lacks."""
    table = _steady_table(aero)
    points = {wind: operating_point(deck_model(aero), wind) for wind in table}
    # computed modes are the base for the effect of torsion
    stiff, soft = (deck_model(aero, mode_shapes="computed", torsion_modes=n) for n in (0, 1))
    untwisted, twisted = ({wind: operating_point(model, wind) for wind in table} for model in (stiff, soft))
    rows: list[Check] = []
    for name in ("BldPitch1", *BANDS):
        floor = FLOOR * max(abs(values[name]) for values in table.values())
        unit = find(name, standard()).unit
        for wind, values in table.items():
            reference, ours = values[name], points[wind][name]
            change = twisted[wind][name] - untwisted[wind][name]
            where = f"{wind:g} m/s"
            if unit == "rad":
                rows.append(angle(name, where, reference, ours, 0.2, beside=float(np.degrees(change))))
            else:
                beside = 100.0 * change / max(abs(reference), floor)
                rows.append(relative(name, where, unit, reference, ours, BANDS[name], floor=floor, beside=beside))
    title = f"Steady operation in uniform wind against OpenFAST set {aero}"
    figures = {f"steady_{aero}": _plot_steady(table, points, f"set {aero}")}
    return CheckTable(f"steady {aero}", title, source_of("steady"), rows, "with torsion", figures)


def _plot_steady(table: dict[float, dict[str, float]], points: dict[float, OperatingPoint], label: str) -> Figure:
    names = ("GenPwr", "RotSpeed", "BldPitch1", "RtFldFxh", "RootMyc1", "OoPDefl1", "TTDspFA", "TwrBsMyt")
    figure, axes = new_figure(4, 2, size=(9.0, 9.0))
    for ax, name in zip(axes.flat, names, strict=True):
        unit, factor = find(name, standard()).display_unit
        ax.plot(list(points), [p[name] * factor for p in points.values()], color=COLOURS[0], label="meltemi")
        ax.plot(list(table), [v[name] * factor for v in table.values()], "o", ms=4, mfc="none", color=COLOURS[1],
                label=f"OpenFAST, {label}")  # fmt: skip
        panel(ax, name, unit)
    axes[0, 0].legend(ncols=2, **ABOVE)
    for ax in axes[-1]:
        ax.set_xlabel("wind speed [m/s]")
    return figure


NODE_BANDS = {"Alpha": 2.0, "AxInd": 2.0, "Fx": 2.0, "Fy": 2.0}
NODE_FIELDS = {"Alpha": ("alpha", "rad"), "AxInd": ("axial_induction", "-"), "Fx": ("normal_force", "N/m"),
               "Fy": ("driving_force", "N/m")}  # fmt: skip
NODES = (6, 9, 12, 15, 17, 18)
"""Output nodes of the reference runs."""


def spanwise(aero: str) -> CheckTable:
    """Angle of attack, induction and loads along the blade."""
    rows: list[Check] = []
    figures = {}
    for wind in (8.0, 12.0, 20.0):
        point = operating_point(deck_model(aero), wind)
        table: dict[str, dict[int, float]] = {}
        for r in reference_table("nodes", case=f"{aero}_steady_{wind:g}"):
            table.setdefault(r["quantity"], {})[int(r["node"])] = float(r["value"])
        for quantity, band in NODE_BANDS.items():
            field, unit = NODE_FIELDS[quantity]
            floor = FLOOR * max(abs(table[quantity][n]) for n in NODES)
            for n in NODES:
                ours = point[f"node_{n}_{field}_1"]
                rows.append(
                    relative(quantity, f"{wind:g} m/s, node {n}", unit, table[quantity][n], ours, band, floor=floor)
                )
        if wind == 12.0:
            figures[f"spanwise_{aero}"] = _plot_nodes(table, point)
    title = f"Along the blade, against OpenFAST set {aero}"
    return CheckTable(f"spanwise {aero}", title, source_of("nodes"), rows, figures=figures)


def _plot_nodes(table: dict[str, dict[int, float]], point: OperatingPoint) -> Figure:
    figure, axes = new_figure(2, 2, size=(9.0, 5.5))
    radius = 1.5 + load_turbine("nrel5mw").blade.aerodynamics.position
    for ax, quantity in zip(axes.flat, NODE_BANDS, strict=True):
        field, unit = NODE_FIELDS[quantity]
        factor = 180.0 / np.pi if unit == "rad" else 1.0
        nodes = sorted(table[quantity])
        inner = nodes[1:-1]  # the end nodes carry no load: their induction has no meaning
        ours = [point[f"node_{n}_{field}_1"] * factor for n in inner]
        ax.plot(radius[1:-1], ours, color=COLOURS[0], label="meltemi")
        ax.plot(radius[1:-1], [table[quantity][n] * factor for n in inner], "o", ms=4, mfc="none", color=COLOURS[1],
                label="OpenFAST")  # fmt: skip
        ax.set_ylabel(f"{quantity} [{'deg' if unit == 'rad' else unit}]")
    for ax in axes[-1]:
        ax.set_xlabel("radius [m]")
    axes[0, 0].legend()
    figure.suptitle("12 m/s, means over a revolution")
    return figure
