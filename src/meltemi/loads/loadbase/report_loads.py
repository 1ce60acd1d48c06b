"""Sections of the report of a load base with loads: extremes, fatigue, clearance, directions, durations, energy."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from meltemi.core.units import display
from meltemi.loads.loadbase.design import DesignLoads
from meltemi.loads.loadbase.ultimate import ExtrapolatedLoad
from meltemi.loads.loadbase.weights import edges
from meltemi.postprocess.extremes import COMPONENTS, DRIVERS
from meltemi.reports.blocks import Axis, Beside, Block, Case, Cell, Chart, Curve, Marked, Share, Table, chosen
from meltemi.reports.turbine_facts import number

if TYPE_CHECKING:
    import pandas as pd

FORCE, MOMENT = display("N"), display("N m")
"""Units of the report, and factors to them."""
WITH, WITHOUT = "with partial safety factor", "without partial safety factor"
SMALL_SHARE = 0.005
"""Shares of damage below it are not printed."""
HOUR = 3600.0


def title_of(name: str) -> str:
    """Name of an interface or channel in words."""
    return name.replace("_", " ")


def unit_of_driver(driver: str) -> tuple[str, float]:
    """Unit of the report and factor to it, of a component, resultant or driver such as "My max"."""
    return FORCE if driver.startswith("F") else MOMENT


def with_band(value: float, half_width: float) -> str:
    """A value with its interval, if there is one."""
    return number(value) + (f" ± {number(half_width)}" if math.isfinite(half_width) else "")


def slopes_of(table: pd.DataFrame) -> list[float]:
    """Slopes or exponents that are columns of a table."""
    return [name for name in table.columns if isinstance(name, float | int)]


# ------------------------------------------------------------------------------------------------ extreme loads


def extreme_blocks(d: DesignLoads) -> list[Block]:
    """For each interface the extremes with contemporaneous loads, with and without factor, and by row of the table."""
    if not len(d.ultimate):
        return []
    words = (
        "Each row is one instant: the extreme load (shaded) with the contemporaneous loads. F_res and M_res are "
        "transverse resultants; their angles count from the first towards the second transverse axis. Where the "
        "characteristic value is a mean over simulations, the row is that of the nearest simulation, scaled to the "
        "mean."
    )
    parts: list[tuple[str, list[Block]]] = []
    for place in d.ultimate.index.unique("interface"):
        tables = [_extremes(d.ultimate.loc[place], WITH), _extremes(d.characteristic.loc[place], WITHOUT)]
        parts.append((title_of(place), [*tables, _by_row(d, place)]))
    return [words, *chosen("Interface", parts)]


def _extremes(own: pd.DataFrame, words: str) -> Table:
    heads = [*COMPONENTS, "F_res", "M_res"]
    names = [f"{h}\n{unit_of_driver(h)[0]}" for h in heads] + ["F_res\ndeg", "M_res\ndeg"]
    rows: list[list[Cell]] = []
    for driver, row in own.iterrows():
        extreme = str(driver).split()[0]
        values = {h: float(row[h]) * unit_of_driver(h)[1] for h in heads}
        loads: list[Cell] = [Marked(x, "own") if h == extreme else x for h, x in values.items()]
        angles: list[Cell] = [f"{math.degrees(row[f'{h} angle']):.0f}" for h in heads[6:]]
        runs = f"{row.rule} of {row.runs}" if row.runs > 1 else str(row.rule)
        state = "" if row.state == "ok" else str(row.state)
        lacking = f"{row.lacking} cases excluded" if row.lacking else ""
        case = Case(str(row.case))
        blade = str(row.blade or "")
        factor = f"{row.factor:g}"
        note = Marked(", ".join(filter(None, (state, lacking))), "doubtful")
        rows.append([str(driver), *loads, *angles, factor, case, blade, f"{row.time:.1f}", runs, note])
    head = ["extreme", *names, "factor", "case", "blade", "time\ns", "value", "note"]
    return Table(head, rows, caption=f"Extreme loads, {words}")


def _by_row(d: DesignLoads, place: str) -> Table:
    """Design loads of each row of the table."""
    own = d.by_row.loc[place]
    drivers = [driver for driver in DRIVERS if driver in own.index.unique("driver")]
    table = own["design"].unstack("driver")[drivers]
    table = table.loc[[row for row in d.coverage.index if row in table.index]]
    severe = {
        driver: (table[driver].idxmin() if driver.endswith("min") else table[driver].idxmax()) for driver in drivers
    }
    rows: list[list[Cell]] = []
    for row, values in table.iterrows():
        loads = {driver: float(values[driver]) * unit_of_driver(driver)[1] for driver in drivers}
        rows.append([str(row), *(Marked(x, "own") if severe[driver] == row else x for driver, x in loads.items())])
    heads = [f"{driver}\n{unit_of_driver(driver)[0]}" for driver in drivers]
    return Table(["DLC", *heads], rows, caption=f"Extreme loads by design load case, {WITH}")


def extrapolation_blocks(d: DesignLoads) -> list[Block]:
    """Load of DLC 1.1 with a return period of 50 years, by all ways."""
    if not d.extrapolations:
        return []
    quantiles = [f"{factor:g} x {100.0 * q:g} % quantile" for factor, q in d.plan.table.extrapolation.quantiles]
    head = ["load", "unit", "largest", "Gumbel", "Gumbel band", "Weibull", "Weibull band", *quantiles, "factor"]
    rows: list[list[Cell]] = []
    for e in d.extrapolations:
        factor = display(e.unit)[1]
        cells: list[Cell] = [f"{title_of(e.interface)} {e.driver}", display(e.unit)[0], e.largest * factor]
        for x in (e.gumbel, e.weibull):
            band = None if x is None else f"{number(x.low * factor)} to {number(x.high * factor)}"
            cells += [None if x is None else x.load * factor, band]
        cells += [q * factor for q in e.quantiles] + [None] * (len(quantiles) - len(e.quantiles))
        rows.append([*cells, f"{e.factor:g}"])
    words = (
        f"Loads with a probability of exceedance of {d.plan.table.extrapolation.probability:g} in ten minutes (return "
        f"period 50 years), {WITHOUT}; bands by bootstrap over the seeds."
    )
    drawn = [
        (f"{title_of(e.interface)} {e.driver}", [_exceedance(e)]) for e in d.extrapolations if e.gumbel or e.weibull
    ]
    return [words, Table(head, rows), *(chosen("Plot of", drawn) if drawn else [])]


def _exceedance(e: ExtrapolatedLoad) -> Chart:
    unit, factor = display(e.unit)
    curves = []
    for colour, (name, x) in enumerate((("Gumbel", e.gumbel), ("Weibull", e.weibull))):
        if x is None:
            continue
        load = x.levels * factor
        curves.append(Curve(f"{name}, band", load, x.band[0], upper=x.band[1], colour=colour))
        curves.append(Curve(name, load, x.exceedance, colour=colour))
    found = e.gumbel or e.weibull
    assert found is not None
    curves.append(Curve("simulations", found.points[0] * factor, found.points[1], dots=True, colour=2))
    lowest = 0.3 * found.probability
    for i, c in enumerate(curves):  # nothing below the probability that is asked for
        levels, y = np.asarray(c.x), np.asarray(c.y)
        upper = y if c.upper is None else np.asarray(c.upper)
        keep = upper > lowest
        band = None if c.upper is None else upper[keep]
        curves[i] = Curve(c.name, levels[keep], np.maximum(y[keep], lowest), band, c.dots, colour=c.colour)
    ends = [float(np.min(found.points[0])) * factor, found.load * factor]
    curves.append(Curve("50 years", ends, [found.probability] * 2, dash="5 4", colour=4))
    words = "Probability of exceedance in ten minutes: simulations, fitted distributions and their bands."
    axes = Axis(f"{title_of(e.interface)} {e.driver}", unit), Axis("probability", log=True)
    return Chart(f"{title_of(e.interface)} {e.driver}", *axes, curves, caption=words)


def clearance_table(d: DesignLoads) -> list[Block]:
    """Distance of the tips from the tower, by row."""
    if not len(d.clearance):
        return []
    rows: list[list[Cell]] = []
    for row, c in d.clearance.iterrows():
        lacking = str(c.lacking or "")
        values = [float(c[name]) for name in ("clearance", "factor", "deflection", "left")]
        case, verdict = Case(str(c.case)), "passes" if c.fits else Marked("tower strike", "bad")
        rows.append([str(row), *values, 100.0 * float(c.ratio), case, str(c.runs), lacking, verdict])
    head = ["DLC", "clearance\nm", "factor", "deflection\nm", "remaining\nm", "clearance\n%"]
    words = (
        f"Smallest distance between blade tip and tower surface; {number(d.undeflected)} m undeflected. Remaining "
        "clearance: undeflected clearance less the deflection towards the tower times the partial safety factors of "
        "load and material. Load cases in which no blade passes the tower, such as those of a rotor locked with the "
        "blades away from it, have no clearance."
    )
    return [words, Table([*head, "case", "simulations", "excluded", "result"], rows)]


def line_blocks(d: DesignLoads) -> list[Block]:
    """Design tensions of the mooring lines: the governing row of each with all lines and after the loss of one."""
    rows: list[list[Cell]] = []
    table = d.lines.reset_index()
    for (channel, lost), own in table.groupby(["channel", "lost"], sort=False) if len(table) else ():
        worst = own.loc[own["design"].idxmax()]
        loads = [float(worst[name]) * FORCE[1] for name in ("mean", "largest", "design")]
        ratio = float(worst.utilisation)
        use = None if math.isnan(ratio) else Marked(ratio, "bad") if ratio > 1.0 else ratio
        state = "one line lost" if lost else "all lines"
        rows.append([title_of(str(channel)), state, *loads, use, f"DLC {worst.row}", Case(str(worst.case))])
    head = ["tension", "state", *(f"{name}\n{FORCE[0]}" for name in ("mean", "largest", "design")), "utilisation"]
    factors = d.plan.table.factors
    words = (
        f"Design tension: the mean times {factors.line_mean[0]:g} and the rest times {factors.line_dynamic[0]:g}; "
        f"after the loss of a line {factors.line_mean[1]:g} and {factors.line_dynamic[1]:g}. Utilisation: over the "
        "strength of the line."
    )
    return [words, Table([*head, "DLC", "case"], rows)] if rows else []


def signal_table(d: DesignLoads) -> list[Block]:
    """Extremes of accelerations, speeds, deflections."""
    rows: list[list[Cell]] = []
    for (channel, end), s in d.signals.iterrows():
        unit, factor = display(str(s.unit), angular_rate_in_degrees="speed" not in str(channel))
        value, case = float(s.value) * factor, Case(str(s.case))
        rows.append([title_of(str(channel)), str(end), value, unit, case, str(s.runs)])
    head = ["channel", "end", "value", "unit", "case", "simulations"]
    return [f"Characteristic values, {WITHOUT}.", Table(head, rows)] if rows else []


# ------------------------------------------------------------------------------------------------------ fatigue


def fatigue_blocks(d: DesignLoads) -> list[Block]:
    """Lifetime equivalent loads, and where the damage comes from."""
    if not len(d.fatigue):
        return []
    slopes = slopes_of(d.fatigue)
    rows: list[list[Cell]] = []
    for channel, row in d.fatigue.iterrows():
        unit, factor = unit_of_driver(str(row.load)) if str(row.load).startswith("F") else MOMENT
        loads = [float(row[m]) * factor for m in slopes]
        rows.append(
            [title_of(str(channel)), title_of(str(row.interface)), str(row.load), str(row.blade or ""), unit, *loads]
        )
    head = ["channel", "interface", "load", "blade", "unit", *(f"m = {m:g}" for m in slopes)]
    words = (
        f"Damage-equivalent load ranges for {d.settings.reference:.3g} cycles in a lifetime of "
        f"{d.plan.campaign.years:g} years, by the slope m of the S-N curve. The fatigue load cases cover "
        f"{100.0 * d.covered:.4g} % of the lifetime."
    )
    shares = [(f"m = {m:g}", [_shares(d, m)]) for m in slopes]
    speeds = [
        (title_of(name), [by_speed(d, name, slopes)])
        for name in d.fatigue.index
        if str(d.fatigue.at[name, "load"]) in COMPONENTS and int(d.fatigue.at[name, "blade"]) in (0, 1)
    ]
    return [
        words,
        Table(head, rows),
        *chosen("Damage by load case, slope", shares),
        *chosen("Damage by wind speed of", speeds),
    ]


def _shares(d: DesignLoads, slope: float) -> Table:
    """Share of each design load case in the damage of each channel."""
    table = d.shares[slope].groupby(level=["channel", "dlc"], sort=False).sum().unstack("dlc")
    table = table.loc[[name for name in d.fatigue.index if name in table.index]]
    rows: list[list[Cell]] = []
    for channel, shares in table.iterrows():
        rows.append([title_of(str(channel)), *(Share(float(x)) if x >= SMALL_SHARE else None for x in shares)])
    head = ["channel", *(f"DLC {dlc}\n%" for dlc in table.columns)]
    return Table(head, rows, caption=f"Share in the damage, m = {slope:g}")


def by_speed(d: DesignLoads, channel: str, slopes: list[float]) -> Chart:
    """Share of the damage in each bin of the wind speed; what is beyond cut-out is one bin."""
    own = 100.0 * d.shares.loc[channel]
    speeds, c = own.index.get_level_values("speed").to_numpy(float), d.plan.campaign
    inner = [v for v in edges(sorted(d.powers.index))[1:-1] if c.cut_in < v < c.cut_out]
    beyond = [float(speeds.max())] if speeds.max() > c.cut_out else []
    ends = np.array([c.cut_in, *inner, c.cut_out, *beyond])
    place = np.clip(np.searchsorted(ends, speeds, side="left") - 1, 0, len(ends) - 2)  # cut-out belongs to production
    curves = []
    for m in slopes:
        share = np.bincount(place, own[m].to_numpy(float), len(ends) - 1)
        curves.append(Curve(f"m = {m:g}", np.repeat(ends, 2)[1:-1], np.repeat(share, 2)))
    axes = Axis("wind speed", "m/s"), Axis("share", "%", start=0.0)
    words = "share of each wind speed bin" + (f"; from {c.cut_out:g} m/s on the turbine idles" if beyond else "")
    return Chart(f"Damage of {title_of(channel)}", *axes, curves, caption=words)


def rose_blocks(d: DesignLoads) -> list[Block]:
    """Moments by direction."""
    parts: list[tuple[str, list[Block]]] = []
    for place in d.roses.index.unique("interface") if len(d.roses) else ():
        own = d.roses.loc[place]
        angles, slopes = own.index.to_numpy(float), slopes_of(own)
        axes = Axis("direction", "deg"), Axis("moment", MOMENT[0])
        largest = Curve("largest", angles, own["largest"].to_numpy(float) * MOMENT[1])
        drawn = [
            Chart("Largest moment", *axes, [largest], polar=True, caption=f"{WITH}, by direction"),
            Chart(
                "Lifetime damage-equivalent range",
                *axes,
                [Curve(f"m = {m:g}", angles, own[m].to_numpy(float) * MOMENT[1]) for m in slopes],
                polar=True,
                caption="of the moment in each direction",
            ),
        ]
        rows: list[list[Cell]] = [
            [
                *(
                    f"{angle:g}",
                    float(r.largest) * MOMENT[1],
                    f"{r.factor:g}",
                    f"DLC {r.row}",
                    Case(str(r.case)),
                ),
                *(float(r[m]) * MOMENT[1] for m in slopes),
            ]
            for angle, r in own.iterrows()
        ]
        head = ["direction\ndeg", f"largest\n{MOMENT[0]}", "factor", "DLC", "case", *(f"m = {m:g}" for m in slopes)]
        both = Beside(drawn)
        parts.append((title_of(str(place)), [both, Table(head, rows)]))
    words = "Moments by direction, from the first transverse axis (0 deg) towards the second (90 deg)."
    return [words, *chosen("Interface", parts)] if parts else []


# ------------------------------------------------------------------------------------- durations, energy, operation


def duration_blocks(d: DesignLoads) -> list[Block]:
    """Time and revolutions at levels of the loads of bearings and of the main shaft."""
    if not len(d.durations):
        return []
    exponents = slopes_of(d.duration_loads)
    rows: list[list[Cell]] = [
        [title_of(str(load)), _unit(str(load))[0], *(float(row[p]) * _unit(str(load))[1] for p in exponents)]
        for load, row in d.duration_loads.iterrows()
    ]
    head = ["load", "unit", *(f"exponent {p:.3g}" for p in exponents)]
    parts = []
    for load in d.durations.index.unique("load"):
        own = d.durations.loc[load]
        unit, factor = _unit(str(load))
        low, high = (own.index.get_level_values(name).to_numpy(float) for name in ("low", "high"))
        curves = [Curve("time", 0.5 * (low + high) * factor, own["time"].to_numpy(float) / HOUR, dots=True)]
        words = "in the lifetime at each load level; 20 levels per octave"
        axes = Axis(title_of(str(load)), unit), Axis("time", "h", log=True)
        parts.append((title_of(str(load)), [Chart(f"Duration of {title_of(str(load))}", *axes, curves, caption=words)]))
    tables = [Table(head, rows, caption="Equivalent loads over revolutions")] if rows else []
    return [*tables, *chosen("Plot of", parts)]


def _unit(load: str) -> tuple[str, float]:
    return FORCE if load.endswith("_force") else MOMENT


def operation_blocks(d: DesignLoads) -> list[Block]:
    """Energy, stops, and duty of the drives."""
    blocks: list[Block] = []
    if d.energy is not None:
        e, gwh = d.energy, 1.0 / 3.6e12
        seeds = (
            f", {100.0 * e.confidence:g} % confidence interval over the seeds" if math.isfinite(e.half_width) else ""
        )
        blocks.append(
            f"Annual energy production: {with_band(e.energy * gwh, e.half_width * gwh)} GWh{seeds}. Availability "
            f"{100.0 * d.settings.availability:g} %; wake, electrical and other losses outside the simulation are not "
            "included."
        )
    if len(d.powers):
        speeds, kw = d.powers.index.to_numpy(float), display("W")[1]
        power, half = (d.powers[name].to_numpy(float) * kw for name in ("power", "half_width"))
        curves = [
            Curve("mean power", speeds, power),
            *(
                [Curve("interval", speeds, power - half, upper=power + half, colour=0)]
                if np.isfinite(half).any()
                else []
            ),
        ]
        energy = Curve("energy", speeds, d.powers["energy"].to_numpy(float) / 3.6e9)
        wind = Axis("wind speed", "m/s")
        drawn = [
            Chart(
                "Power",
                wind,
                Axis("power", "kW", start=0.0),
                curves,
                caption="mean of the production cases at each wind speed",
            ),
            Chart(
                "Energy",
                wind,
                Axis("energy", "MWh", start=0.0),
                [energy],
                caption="annual energy production in each wind speed bin",
            ),
        ]
        blocks.append(Beside(drawn))
    if len(d.duties):
        rows: list[list[Cell]] = []
        for drive, duty in d.duties.iterrows():
            travel = [math.degrees(duty.travel), duty.moving / HOUR, 100.0 * duty.moving_share]
            rates = [math.degrees(duty.rms_rate), math.degrees(duty.largest_rate)]
            rows.append(
                [
                    title_of(str(drive)),
                    *travel,
                    float(duty.starts),
                    float(duty.reversals),
                    *rates,
                    Case(str(duty.case)),
                ]
            )
        head = [
            "drive",
            "travel\ndeg",
            "moving\nh",
            "moving\n%",
            "starts",
            "reversals",
            "rms rate\ndeg/s",
            "largest rate\ndeg/s",
            "case",
        ]
        blocks.append(Table(head, rows, caption="Annual duty of the drives"))
    if len(d.stops):
        rows = [[str(row), float(stops)] for row, stops in d.stops.iloc[:, 0].items()]
        blocks.append(Table(["DLC", "stops"], rows, caption="Stops per year"))
    return blocks
