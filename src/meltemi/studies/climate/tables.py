"""Tables and figure of annual energy and lifetime loads at sites."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.environment.site import STANDARD
from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure, panel
from meltemi.reports.blocks import Table
from meltemi.reports.ensemble_tables import half_bar, with_interval
from meltemi.studies.climate.response import ICED, IN_PLANE, ROOT, SHED, SIDE, SLOPES, TOWER, WET
from meltemi.studies.climate.year import SHED_SHARE, STEPS, SiteYear, SiteYears

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

GWH = 3.6e12
"""[J] one gigawatt hour."""
HOURS = 8766.0
"""Hours of a year."""
NAMES = {
    ROOT: "blade root, out of plane",
    IN_PLANE: "blade root, in plane",
    TOWER: "tower base, fore and aft",
    SIDE: "tower base, side to side",
}
SEED_RAIN = "rain by the review's formula, one drop size"


def words(name: str) -> str:
    """Readable name of a site."""
    return name.replace("_", " ")


def share(part: Float, whole: Float) -> MeanEstimate:
    """Mean of the seeds in percent with its 95 % confidence interval."""
    return mean_interval(100.0 * part / whole)


def estimate_text(estimate: MeanEstimate, digits: int = 2) -> str:
    """Mean and confidence interval with sign."""
    no_minus_before_zero = round(estimate.mean, digits) + 0.0
    return with_interval(replace(estimate, mean=no_minus_before_zero), digits, "+")


def of_standard(year: SiteYear, what: str) -> MeanEstimate:
    """Contribution [%] of an effect to the energy at 1.225 kg/m^3; of all effects together for ``all``."""
    return share(year.energy - year.reference if what == "all" else year.steps[what], year.reference)


def energy_table(sites: SiteYears) -> Table:
    """Table of the contribution of each effect to annual energy."""
    head, rows = ["", *(words(name) for name in sites.years)], []
    all_ = list(sites.years.values())
    rated = sites.response.turbine.rated_power

    def row(label: str, cells: list[str]) -> None:
        rows.append([label, *cells])

    row("density, least and most [kg/m³]", [f"{y.density.min():.3f}, {y.density.max():.3f}" for y in all_])
    response = sites.response
    standard = float(np.interp(STANDARD, response.setup.densities, response.rated_wind))
    row("rated wind at 1.225 kg/m³ [m/s]", [f"{standard:.2f}"] * len(all_))
    row("rated wind, least and most [m/s]", [f"{y.rated_wind.min():.2f}, {y.rated_wind.max():.2f}" for y in all_])
    plain = [mean_interval(y.reference / GWH) for y in all_]
    row("energy at 1.225 kg/m³, dry, no ice [GWh]", [with_interval(e, 2) for e in plain])
    row("capacity factor of it [%]", [f"{100.0 * e.mean * GWH / (rated * HOURS * 3600.0):.1f}" for e in plain])
    for what in STEPS:
        row(f"{what} [%]", [estimate_text(of_standard(y, what), 3 if what == "rain" else 2) for y in all_])
    row("all together [%]", [estimate_text(of_standard(y, "all")) for y in all_])
    row(
        "mean density of the year instead of the months' [%]",
        [estimate_text(share(y.constant, y.reference), 3) for y in all_],
    )
    row(f"{SEED_RAIN} [%]", [estimate_text(share(y.seed_rain, y.reference)) for y in all_])
    note = (
        f"Shares of the energy at 1.225 kg/m³ in the site's wind; each effect on top of those above it. "
        f"Means over {len(sites.response.setup.seeds)} seeds with 95 % intervals. Ice: on all blades but for "
        f"{100.0 * SHED_SHARE:.0f} % of its hours, in which one blade has shed it. Rain: momentum "
        f"of drops on the blades while the power is below rated. {_rated_winds(sites)}"
    )
    return Table(head, rows, "A year's energy", note=note)


def _rated_winds(sites: SiteYears) -> str:
    """Rated wind speed with ice and in rain."""
    response, parts = sites.response, []
    for name in response.states.keys() & {ICED, WET}:
        state = response.states[name]
        dry = float(response.rated_wind[response.setup.densities.index(state.density)])
        parts.append(f"{name} from {dry:.2f} to {state.rated_wind:.2f} m/s (at {state.density:g} kg/m³)")
    return f"Rated wind moves with {' and with '.join(sorted(parts))}." if parts else ""


def load_table(sites: SiteYears) -> Table:
    """Table of the contribution of each effect to lifetime loads."""
    head, rows = ["", *(words(name) for name in sites.years)], []
    for name in SLOPES:
        loads = [year.loads[name] for year in sites.years.values()]
        base = [mean_interval(each["reference"] / 1e6) for each in loads]
        rows.append([f"{NAMES[name]} at 1.225 kg/m³ [MN m]", *(with_interval(e, 2) for e in base)])
        for before, what in zip(("reference", *STEPS), STEPS, strict=False):
            changes = [share(each[what] - each[before], each["reference"]) for each in loads]
            rows.append([f"- {what} [%]", *(estimate_text(change, 3 if what == "rain" else 2) for change in changes)])
        all_ = [share(each[STEPS[-1]] - each["reference"], each["reference"]) for each in loads]
        rows.append(["- all together [%]", *(estimate_text(change) for change in all_)])
    note = (
        "Equivalent to the hours of operation, 1 Hz, slopes 10 (blade) and 4 (tower); each effect on top of those "
        "above it. Simulated at three densities, with ice on all blades, with ice that one blade has shed, and in "
        "32 mm/h; other classes of rain in proportion to their water."
    )
    return Table(head, rows, "Loads of a year", note=note)


def month_table(year: SiteYear) -> Table:
    """Table of the months of a year: air, energy against standard air, weather."""
    climate, rows = year.climate, []
    for month in range(1, 13):
        at = climate.month == month
        if not at.any():
            continue
        air, energy, base = year.density[at], year.by_period[at].sum(), year.base_by_period[at].sum()
        rain = sum(float(hours[at].sum()) for hours in climate.rain_hours.values())
        change, mean = 100.0 * (energy / base - 1.0), energy / 3600.0 / float(climate.hours[at].sum())
        row = [f"{air.min():.3f}", f"{np.average(air, weights=climate.hours[at]):.3f}", f"{air.max():.3f}"]
        row += [f"{energy / 3.6e9:.1f}", f"{change:+.2f}", f"{mean / 1e3:.0f}"]
        rows.append([str(month), *row, f"{rain:.0f}", f"{climate.icing_hours[at].sum():.0f}"])
    head = ["month", "least density\nkg/m³", "mean density\nkg/m³", "most density\nkg/m³", "energy\nMWh"]
    head += ["against 1.225 kg/m³\n%", "mean power\nkW", "rain\nh", "ice\nh"]
    note = "Clean blades in dry air of the site; rain and ice are in the table of the year's energy."
    return Table(head, rows, "Months", note=note)


def years_figure(sites: SiteYears) -> Figure:
    """Turbine response, air density and effects of weather."""
    figure, panels = new_figure(3, 2, size=(10.5, 11.0), share=False)
    axes = panels.reshape(2, 3)  # legend entries row by row
    response = sites.response
    _over_speed(axes[0, 0], sites, response.power, {s: response.states[s].power for s in _ice(sites)}, 1e6)
    panel(axes[0, 0], f"{response.turbine.name}: mean power in turbulence", "MW")
    axes[0, 0].legend()
    for ax, name in ((axes[0, 1], ROOT), (axes[0, 2], TOWER)):
        iced = {state: response.states[state].loads[name] for state in _ice(sites)}
        _over_speed(ax, sites, response.loads[name], iced, 1e6)
        panel(ax, f"{NAMES[name]}: equivalent load", "MN m")
    for colour, (name, year) in zip(COLOURS, sites.years.items(), strict=False):
        months = np.unique(year.climate.month)
        density = [year.density[year.climate.month == month].mean() for month in months]
        axes[1, 0].plot(months, density, "o-", color=colour, markersize=3, label=words(name))
    axes[1, 0].axhline(STANDARD, color=COLOURS[8], linewidth=0.8, linestyle="--")
    axes[1, 0].set_xlabel("month")
    panel(axes[1, 0], "air density", "kg/m³")
    axes[1, 0].legend()
    effects = {name: {what: of_standard(y, what) for what in STEPS} for name, y in sites.years.items()}
    _bars(axes[1, 1], effects)
    panel(axes[1, 1], "what each effect adds to the year's energy at 1.225 kg/m³", "%")
    loads = {
        name: {NAMES[load]: share(of["ice"] - of["reference"], of["reference"]) for load, of in year.loads.items()}
        for name, year in sites.years.items()
    }
    _bars(axes[1, 2], loads)
    panel(axes[1, 2], "what air, rain and ice do to the year's equivalent loads", "%")
    return figure


def _ice(sites: SiteYears) -> list[str]:
    """Simulated states with ice."""
    return [state for state in (ICED, SHED) if state in sites.response.states]


def _over_speed(ax: Axes, sites: SiteYears, clean: Float, iced: dict[str, Float], unit: float) -> None:
    setup = sites.response.setup
    for i, (density, values) in enumerate(zip(setup.densities, clean, strict=True)):
        ax.plot(
            setup.speeds, values.mean(axis=1) / unit, "o-", color=COLOURS[i], markersize=3, label=f"{density:g} kg/m³"
        )
    for line, state in zip((":", "--"), iced, strict=False):
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
            yerr=[half_bar(e) for e in values.values()],
            color=colour,
            label=words(name),
            error_kw={"linewidth": 0.8},
        )
    ax.set_xticks(place, [label.replace(", ", ",\n") for label in labels])
    ax.axhline(0.0, color="black", linewidth=0.6)
    ax.margins(y=0.25)  # space for the legend
    ax.legend(ncols=len(groups), loc="upper center")
