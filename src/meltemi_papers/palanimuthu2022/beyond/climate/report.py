"""Tables and figure of annual energy and lifetime loads."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.environment.site import STANDARD
from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure, panel
from meltemi_papers.palanimuthu2022.beyond.climate.response import ICED, IN_PLANE, ROOT, SHED, SIDE, SLOPES, TOWER, WET
from meltemi_papers.palanimuthu2022.beyond.climate.review import of_standard, review_table, said, share, verdict, words
from meltemi_papers.palanimuthu2022.beyond.climate.year import SHED_SHARE, STEPS, Found
from meltemi_papers.study import Chapter, Draw, answered
from meltemi_reports.blocks import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

GWH = 3.6e12
"""[J]."""
HOURS = 8766.0
"""Of a year."""
NAMES = {
    ROOT: "blade root, out of plane",
    IN_PLANE: "blade root, in plane",
    TOWER: "tower base, fore and aft",
    SIDE: "tower base, side to side",
}
SEED_RAIN = "rain by the review's formula, one drop size"


def energy_table(found: Found) -> Table:
    """Table of the contribution of each effect to annual energy."""
    head, rows = ["", *(words(name) for name in found.years)], []
    all_ = list(found.years.values())
    rated = found.response.turbine.rated_power

    def row(label: str, cells: list[str]) -> None:
        rows.append([label, *cells])

    row("density, least and most [kg/m³]", [f"{y.density.min():.3f}, {y.density.max():.3f}" for y in all_])
    response = found.response
    standard = float(np.interp(STANDARD, response.setup.densities, response.rated_wind))
    row("rated wind at 1.225 kg/m³ [m/s]", [f"{standard:.2f}"] * len(all_))
    row("rated wind, least and most [m/s]", [f"{y.rated_wind.min():.2f}, {y.rated_wind.max():.2f}" for y in all_])
    plain = [mean_interval(y.reference / GWH) for y in all_]
    row("energy at 1.225 kg/m³, dry, no ice [GWh]", [f"{e.mean:.2f} ± {e.half_width:.2f}" for e in plain])
    row("capacity factor of it [%]", [f"{100.0 * e.mean * GWH / (rated * HOURS * 3600.0):.1f}" for e in plain])
    for what in STEPS:
        row(f"{what} [%]", [said(of_standard(y, what), 3 if what == "rain" else 2) for y in all_])
    row("all together [%]", [said(of_standard(y, "all")) for y in all_])
    row("mean density of the year instead of the months' [%]", [said(share(y.constant, y.reference), 3) for y in all_])
    row(f"{SEED_RAIN} [%]", [said(share(y.seed_rain, y.reference)) for y in all_])
    note = (
        f"Shares of the energy at 1.225 kg/m³ in the site's wind; each effect on top of those above it. "
        f"Means over {len(found.response.setup.seeds)} seeds with 95 % intervals. Ice: on all blades but for "
        f"{100.0 * SHED_SHARE:.0f} % of its hours, in which one blade has shed it. Rain: momentum "
        f"of drops on the blades while the power is below rated. {_rated_winds(found)}"
    )
    return Table(head, rows, "A year's energy", note=note)


def _rated_winds(found: Found) -> str:
    """Rated wind speed with ice and in rain."""
    response, parts = found.response, []
    for name in (ICED, WET):
        state = response.states[name]
        dry = float(response.rated_wind[response.setup.densities.index(state.density)])
        parts.append(f"{name} from {dry:.2f} to {state.rated_wind:.2f} m/s (at {state.density:g} kg/m³)")
    return f"Rated wind moves with {' and with '.join(parts)}."


def load_table(found: Found) -> Table:
    """Table of the contribution of each effect to lifetime loads."""
    head, rows = ["", *(words(name) for name in found.years)], []
    for name in SLOPES:
        loads = [year.loads[name] for year in found.years.values()]
        base = [mean_interval(each["reference"] / 1e6) for each in loads]
        rows.append([f"{NAMES[name]} at 1.225 kg/m³ [MN m]", *(f"{e.mean:.2f} ± {e.half_width:.2f}" for e in base)])
        for before, what in zip(("reference", *STEPS), STEPS, strict=False):
            changes = [share(each[what] - each[before], each["reference"]) for each in loads]
            rows.append([f"- {what} [%]", *(said(change, 3 if what == "rain" else 2) for change in changes)])
        all_ = [share(each[STEPS[-1]] - each["reference"], each["reference"]) for each in loads]
        rows.append(["- all together [%]", *(said(change) for change in all_)])
    note = (
        "Equivalent to the hours of operation, 1 Hz, slopes 10 (blade) and 4 (tower); each effect on top of those "
        "above it. Simulated at three densities, with ice on all blades, with ice that one blade has shed, and in "
        "32 mm/h; other classes of rain in proportion to their water."
    )
    return Table(head, rows, "Loads of a year", note=note)


def scenario_table(found: Found) -> Table:
    """Table of scenarios."""
    head = ["scenario", *(f"{words(name)}\n%" for name in found.years)]
    names = next(iter(found.years.values())).scenarios
    rows = [
        [name, *(said(share(y.scenarios[name] - y.energy, y.energy)) for y in found.years.values())] for name in names
    ]
    note = "Change of the year's energy with all effects in."
    return Table(head, rows, "Scenarios", note=note)


def chapter(found: Found, draw: Draw) -> Chapter:
    """Chapter of a year in three climates."""
    caption = (
        "A year in three climates: what the turbine does, the air, and what weather adds; bars with 95 % intervals"
    )
    figure = draw("climate", caption, lambda: years_figure(found))
    heading = "Beyond the paper: a year in three climates"
    return answered(heading, lambda: verdict(found), [figure], lambda: tables(found))


def tables(found: Found) -> list[Table]:
    """Energy, the review beside it, loads, scenarios."""
    return [energy_table(found), review_table(found), load_table(found), scenario_table(found)]


def years_figure(found: Found) -> Figure:
    """Turbine response, air density and effects of weather."""
    figure, axes = new_figure(2, 3, size=(15.0, 8.2), share=False)
    response = found.response
    _over_speed(axes[0, 0], found, response.power, {name: response.states[name].power for name in (ICED, SHED)}, 1e6)
    panel(axes[0, 0], f"{response.turbine.name}: mean power in turbulence", "MW")
    axes[0, 0].legend()
    for ax, name in ((axes[0, 1], ROOT), (axes[0, 2], TOWER)):
        iced = {state: response.states[state].loads[name] for state in (ICED, SHED)}
        _over_speed(ax, found, response.loads[name], iced, 1e6)
        panel(ax, f"{NAMES[name]}: equivalent load", "MN m")
    months = np.arange(1, 13)
    for colour, (name, year) in zip(COLOURS, found.years.items(), strict=False):
        axes[1, 0].plot(months, year.density, "o-", color=colour, markersize=3, label=words(name))
    axes[1, 0].axhline(STANDARD, color=COLOURS[8], linewidth=0.8, linestyle="--")
    axes[1, 0].set_xlabel("month")
    panel(axes[1, 0], "air density", "kg/m³")
    axes[1, 0].legend()
    effects = {name: {what: of_standard(y, what) for what in STEPS} for name, y in found.years.items()}
    _bars(axes[1, 1], effects)
    panel(axes[1, 1], "what each effect adds to the year's energy at 1.225 kg/m³", "%")
    loads = {
        name: {NAMES[load]: share(of["ice"] - of["reference"], of["reference"]) for load, of in year.loads.items()}
        for name, year in found.years.items()
    }
    _bars(axes[1, 2], loads)
    panel(axes[1, 2], "what air, rain and ice do to the year's equivalent loads", "%")
    return figure


def _over_speed(ax: Axes, found: Found, clean: Float, iced: dict[str, Float], unit: float) -> None:
    setup = found.response.setup
    for i, (density, values) in enumerate(zip(setup.densities, clean, strict=True)):
        ax.plot(
            setup.speeds, values.mean(axis=1) / unit, "o-", color=COLOURS[i], markersize=3, label=f"{density:g} kg/m³"
        )
    for line, state in ((":", ICED), ("--", SHED)):
        label = f"{state}, {setup.icing_density:g} kg/m³"
        ax.plot(setup.speeds, iced[state].mean(axis=1) / unit, line, color=COLOURS[4], label=label)
    ax.set_xlabel("wind speed [m/s]")


def _bars(ax: Axes, groups: dict[str, dict[str, MeanEstimate]]) -> None:
    labels = list(next(iter(groups.values())))
    place, width = np.arange(len(labels)), 0.8 / len(groups)
    for i, (colour, (name, values)) in enumerate(zip(COLOURS, groups.items(), strict=False)):
        ax.bar(
            place + width * (i - 0.5 * (len(groups) - 1)),
            [e.mean for e in values.values()],
            0.95 * width,
            yerr=[e.half_width for e in values.values()],
            color=colour,
            label=words(name),
            error_kw={"linewidth": 0.8},
        )
    ax.set_xticks(place, [label.replace(", ", ",\n") for label in labels])
    ax.axhline(0.0, color="black", linewidth=0.6)
    ax.margins(y=0.25)  # room for the legend
    ax.legend(ncols=len(groups), loc="upper center")
