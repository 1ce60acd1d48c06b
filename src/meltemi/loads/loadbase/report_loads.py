"""Sections of the report of a load base with loads: extremes, fatigue, clearance, directions, durations, energy."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.core.units import display
from meltemi.loads.energy import AnnualEnergy
from meltemi.loads.loadbase.design import DesignLoads
from meltemi.loads.loadbase.ultimate import ExtrapolatedLoad
from meltemi.loads.loadbase.weights import edges
from meltemi.postprocess.extremes import COMPONENTS, DRIVERS
from meltemi.reports.blocks import Axis, Beside, Block, CaseName, Cell, Chart, Curve, Marked, Share, Table, chosen
from meltemi.reports.turbine_facts import number

if TYPE_CHECKING:
    import pandas as pd

Float = NDArray[np.float64]
FORCE, MOMENT = display("N"), display("N m")
"""Units of the report, and factors to them."""
LOADS = (*COMPONENTS, "F_res", "M_res")
WITH, WITHOUT = "with partial safety factor", "without partial safety factor"
SMALL_SHARE = 0.005
"""Smallest share of damage that is printed."""
HOUR, GWH = 3600.0, 3.6e12


def title_of(name: str) -> str:
    """Name of an interface or channel in words."""
    return name.replace("_", " ")


def unit_of_driver(driver: str) -> tuple[str, float]:
    """Unit of the report and factor to it, of a component, resultant or driver such as "My max"."""
    return FORCE if driver.startswith("F") else MOMENT


def load_heads(drivers: Iterable[str]) -> list[str]:
    """Heads of columns of loads, with their units."""
    return [f"{driver}\n{unit_of_driver(driver)[0]}" for driver in drivers]


def load_cells(row: pd.Series, drivers: Iterable[str]) -> dict[str, float]:
    """Loads of a row in the units of the report."""
    return {driver: float(row[driver]) * unit_of_driver(driver)[1] for driver in drivers}


def with_band(value: float, half_width: float) -> str:
    """A value with the half width of its interval, if that is finite."""
    return number(value) + (f" ± {number(half_width)}" if math.isfinite(half_width) else "")


def energy_words(e: AnnualEnergy) -> str:
    """Annual energy production with its interval."""
    return f"{with_band(e.energy / GWH, e.half_width / GWH)} GWh"


def slopes_of(table: pd.DataFrame) -> list[float]:
    """Slopes or exponents that are columns of a table."""
    return [name for name in table.columns if isinstance(name, float | int)]


def extreme_blocks(d: DesignLoads) -> list[Block]:
    """Extremes of each interface with contemporaneous loads, with and without factor, and by row of the table."""
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


def _extremes(extremes: pd.DataFrame, words: str) -> Table:
    rows: list[list[Cell]] = []
    for driver, row in extremes.iterrows():
        extreme = str(driver).split()[0]
        loads = [Marked(x, "subject") if h == extreme else x for h, x in load_cells(row, LOADS).items()]
        angles = [f"{math.degrees(row[f'{h} angle']):.0f}" for h in LOADS[6:]]
        runs = f"{row.rule} of {row.runs}" if row.runs > 1 else str(row.rule)
        state = "" if row.state == "ok" else str(row.state)
        lacking = f"{row.lacking} cases excluded" if row.lacking else ""
        note = ", ".join(filter(None, (state, lacking)))
        conditions = (f"{row.factor:g}", CaseName(str(row.case)), str(row.blade or ""), f"{row.time:.1f}", runs)
        rows.append([str(driver), *loads, *angles, *conditions, Marked(note, "doubtful") if note else ""])
    head = ["extreme", *load_heads(LOADS), "F_res\ndeg", "M_res\ndeg", "factor", "case", "blade", "time\ns", "value"]
    return Table([*head, "note"], rows, caption=f"Extreme loads, {words}")


def _by_row(d: DesignLoads, place: str) -> Table:
    """Design loads of each row of the table."""
    loads_by_row = d.by_row.loc[place]
    drivers = [driver for driver in DRIVERS if driver in loads_by_row.index.unique("driver")]
    table = loads_by_row["design"].unstack("driver")[drivers]
    table = table.loc[[row for row in d.coverage.index if row in table.index]]
    severe = {name: table[name].idxmin() if name.endswith("min") else table[name].idxmax() for name in drivers}
    rows: list[list[Cell]] = []
    for row, values in table.iterrows():
        loads = load_cells(values, drivers).items()
        rows.append([str(row), *(Marked(x, "subject") if severe[name] == row else x for name, x in loads)])
    caption = f"Extreme loads by design load case, {WITH}"
    return Table(["DLC", *load_heads(drivers)], rows, caption=caption)


def extrapolation_blocks(d: DesignLoads) -> list[Block]:
    """Load of DLC 1.1 with a return period of 50 years, by all methods of extrapolation."""
    if not d.extrapolations:
        return []
    quantiles = [f"{factor:g} x {100.0 * q:g} % quantile" for factor, q in d.plan.table.extrapolation.quantiles]
    head = ["load", "unit", "largest", "Gumbel", "Gumbel band", "Weibull", "Weibull band", *quantiles, "factor"]
    rows: list[list[Cell]] = []
    for e in d.extrapolations:
        unit, factor = display(e.unit)
        cells: list[Cell] = [_name(e), unit, e.largest * factor]
        for x in (e.gumbel, e.weibull):
            band = None if x is None else f"{number(x.low * factor)} to {number(x.high * factor)}"
            cells += [None if x is None else x.load * factor, band]
        cells += [q * factor for q in e.quantiles] + [None] * (len(quantiles) - len(e.quantiles))
        rows.append([*cells, f"{e.factor:g}"])
    words = (
        f"Loads with a probability of exceedance of {d.plan.table.extrapolation.probability:g} in ten minutes (return "
        f"period 50 years), {WITHOUT}; bands by bootstrap over the seeds."
    )
    plots = [(_name(e), [_exceedance(e)]) for e in d.extrapolations if e.gumbel or e.weibull]
    return [words, Table(head, rows), *chosen("Plot of", plots)]


def _name(e: ExtrapolatedLoad) -> str:
    return f"{title_of(e.interface)} {e.driver}"


def _exceedance(e: ExtrapolatedLoad) -> Chart:
    unit, factor = display(e.unit)
    extrapolation = e.gumbel or e.weibull
    assert extrapolation is not None
    lowest = 0.3 * extrapolation.probability  # the chart ends below the probability of interest

    def curve(name: str, x: Float, y: Float, colour: int, upper: Float | None = None, dots: bool = False) -> Curve:
        keep = (y if upper is None else upper) > lowest
        top = None if upper is None else upper[keep]
        return Curve(name, factor * x[keep], np.maximum(y[keep], lowest), top, dots, colour=colour)

    curves = []
    for colour, (name, x) in enumerate((("Gumbel", e.gumbel), ("Weibull", e.weibull))):
        if x is not None:
            curves.append(curve(f"{name}, band", x.levels, x.band[0], colour, upper=x.band[1]))
            curves.append(curve(name, x.levels, x.exceedance, colour))
    curves.append(curve("simulations", extrapolation.points[0], extrapolation.points[1], 2, dots=True))
    ends = [float(np.min(extrapolation.points[0])) * factor, extrapolation.load * factor]
    curves.append(Curve("50 years", ends, [extrapolation.probability] * 2, dash="5 4", colour=4))
    words = "Probability of exceedance in ten minutes: simulations, fitted distributions and their bands."
    return Chart(_name(e), Axis(_name(e), unit), Axis("probability", log=True), curves, caption=words)


def clearance_table(d: DesignLoads) -> list[Block]:
    """Distance of the tips from the tower, by row."""
    if not len(d.clearance):
        return []
    rows: list[list[Cell]] = []
    for row, c in d.clearance.iterrows():
        values = [float(c[name]) for name in ("clearance", "factor", "deflection", "left")]
        result = "passes" if c.fits else Marked("tower strike", "bad")
        excluded = str(c.lacking or "")
        rows.append([str(row), *values, 100.0 * float(c.ratio), CaseName(str(c.case)), str(c.runs), excluded, result])
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
    for (channel, lost), tensions in table.groupby(["channel", "lost"], sort=False) if len(table) else ():
        worst = tensions.loc[tensions["design"].idxmax()]
        loads = [float(worst[name]) * FORCE[1] for name in ("mean", "largest", "design")]
        ratio = float(worst.utilisation)
        use = None if math.isnan(ratio) else Marked(ratio, "bad") if ratio > 1.0 else ratio
        state = "one line lost" if lost else "all lines"
        rows.append([title_of(str(channel)), state, *loads, use, f"DLC {worst.row}", CaseName(str(worst.case))])
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
        value, case = float(s.value) * factor, CaseName(str(s.case))
        rows.append([title_of(str(channel)), str(end), value, unit, case, str(s.runs)])
    head = ["channel", "end", "value", "unit", "case", "simulations"]
    return [f"Characteristic values, {WITHOUT}.", Table(head, rows)] if rows else []


def fatigue_blocks(d: DesignLoads) -> list[Block]:
    """Lifetime equivalent loads, and the damage by load case and wind speed."""
    if not len(d.fatigue):
        return []
    slopes = slopes_of(d.fatigue)
    rows: list[list[Cell]] = []
    for channel, row in d.fatigue.iterrows():
        unit, factor = unit_of_driver(str(row.load))
        place = (title_of(str(channel)), title_of(str(row.interface)), str(row.load), str(row.blade or ""))
        rows.append([*place, unit, *(float(row[m]) * factor for m in slopes)])
    head = ["channel", "interface", "load", "blade", "unit", *_slope_heads(slopes)]
    words = (
        f"Damage-equivalent load ranges for {d.settings.reference:.3g} cycles in a lifetime of "
        f"{d.plan.campaign.years:g} years, by the slope m of the S-N curve. The fatigue load cases cover "
        f"{100.0 * d.covered:.4g} % of the lifetime."
    )
    shares = [(name, [_shares(d, m)]) for m, name in zip(slopes, _slope_heads(slopes), strict=True)]
    speeds = [
        (title_of(name), [by_speed(d, name, slopes)])
        for name, row in d.fatigue.iterrows()
        if str(row.load) in COMPONENTS and int(row.blade) in (0, 1)
    ]
    charts = [*chosen("Damage by load case, slope", shares), *chosen("Damage by wind speed of", speeds)]
    return [words, Table(head, rows), *charts]


def _slope_heads(slopes: Iterable[float]) -> list[str]:
    return [f"m = {m:g}" for m in slopes]


def _shares(d: DesignLoads, slope: float) -> Table:
    """Share of each design load case in the damage of each channel."""
    table = d.shares[slope].groupby(level=["channel", "dlc"], sort=False).sum().unstack("dlc")
    table = table.loc[[name for name in d.fatigue.index if name in table.index]]
    rows = [
        [title_of(str(channel)), *(Share(float(x)) if x >= SMALL_SHARE else None for x in shares)]
        for channel, shares in table.iterrows()
    ]
    head = ["channel", *(f"DLC {dlc}\n%" for dlc in table.columns)]
    return Table(head, rows, caption=f"Share in the damage, m = {slope:g}")


def by_speed(d: DesignLoads, channel: str, slopes: list[float]) -> Chart:
    """Share of the damage in each bin of the wind speed; wind beyond cut-out is one bin."""
    shares = 100.0 * d.shares.loc[channel]
    speeds, c = shares.index.get_level_values("speed").to_numpy(float), d.plan.campaign
    inner = [v for v in edges(sorted(d.powers.index))[1:-1] if c.cut_in < v < c.cut_out]
    beyond = [float(speeds.max())] if speeds.max() > c.cut_out else []
    ends = np.array([c.cut_in, *inner, c.cut_out, *beyond])
    place = np.clip(np.searchsorted(ends, speeds, side="left") - 1, 0, len(ends) - 2)  # cut-out belongs to production
    curves = []
    for m in slopes:
        share = np.bincount(place, shares[m].to_numpy(float), len(ends) - 1)
        curves.append(Curve(f"m = {m:g}", np.repeat(ends, 2)[1:-1], np.repeat(share, 2)))
    axes = Axis("wind speed", "m/s"), Axis("share", "%", start=0.0)
    words = "share of each wind speed bin" + (f"; from {c.cut_out:g} m/s on the turbine idles" if beyond else "")
    return Chart(f"Damage of {title_of(channel)}", *axes, curves, caption=words)


def rose_blocks(d: DesignLoads) -> list[Block]:
    """Moments by direction."""
    parts: list[tuple[str, list[Block]]] = []
    axes = Axis("direction", "deg"), Axis("moment", MOMENT[0])
    for place in d.roses.index.unique("interface") if len(d.roses) else ():
        rose = d.roses.loc[place]
        angles, slopes = rose.index.to_numpy(float), slopes_of(rose)
        largest, *ranges = (rose[name].to_numpy(float) * MOMENT[1] for name in ("largest", *slopes))
        curves = [Curve(name, angles, x) for name, x in zip(_slope_heads(slopes), ranges, strict=True)]
        both: list[Block] = [
            Chart("Largest moment", *axes, [Curve("largest", angles, largest)], f"{WITH}, by direction", polar=True),
            Chart("Lifetime damage-equivalent range", *axes, curves, "of the moment in each direction", polar=True),
        ]
        rows: list[list[Cell]] = []
        for i, (angle, r) in enumerate(rose.iterrows()):
            governing = f"{r.factor:g}", f"DLC {r.row}", CaseName(str(r.case))
            rows.append([f"{angle:g}", float(largest[i]), *governing, *(float(x[i]) for x in ranges)])
        head = ["direction\ndeg", f"largest\n{MOMENT[0]}", "factor", "DLC", "case", *_slope_heads(slopes)]
        parts.append((title_of(str(place)), [Beside(both), Table(head, rows)]))
    words = "Moments by direction, from the first transverse axis (0 deg) towards the second (90 deg)."
    return [words, *chosen("Interface", parts)] if parts else []


def duration_blocks(d: DesignLoads) -> list[Block]:
    """Time and revolutions at levels of the loads of bearings and of the main shaft."""
    if not len(d.durations):
        return []
    exponents = slopes_of(d.duration_loads)
    rows: list[list[Cell]] = []
    for load, row in d.duration_loads.iterrows():
        unit, factor = _unit(str(load))
        rows.append([title_of(str(load)), unit, *(float(row[p]) * factor for p in exponents)])
    head = ["load", "unit", *(f"exponent {p:.3g}" for p in exponents)]
    parts = []
    for load in d.durations.index.unique("load"):
        levels, name = d.durations.loc[load], title_of(str(load))
        unit, factor = _unit(str(load))
        low, high = (levels.index.get_level_values(end).to_numpy(float) for end in ("low", "high"))
        curves = [Curve("time", 0.5 * (low + high) * factor, levels["time"].to_numpy(float) / HOUR, dots=True)]
        words = "in the lifetime at each load level; 20 levels per octave"
        axes = Axis(name, unit), Axis("time", "h", log=True)
        parts.append((name, [Chart(f"Duration of {name}", *axes, curves, caption=words)]))
    tables = [Table(head, rows, caption="Equivalent loads over revolutions")] if rows else []
    return [*tables, *chosen("Plot of", parts)]


def _unit(load: str) -> tuple[str, float]:
    return FORCE if load.endswith("_force") else MOMENT


def operation_blocks(d: DesignLoads) -> list[Block]:
    """Energy, stops, and duty of the drives."""
    blocks: list[Block] = []
    if d.energy is not None:
        e = d.energy
        seeds = f", {100.0 * e.confidence:g} % confidence interval over the seeds" * math.isfinite(e.half_width)
        blocks.append(
            f"Annual energy production: {energy_words(e)}{seeds}. Availability {100.0 * d.settings.availability:g} %; "
            "wake, electrical and other losses outside the simulation are not included."
        )
    if len(d.powers):
        blocks.append(Beside(_power_charts(d.powers)))
    if len(d.duties):
        blocks.append(_duty_table(d.duties))
    if len(d.stops):
        rows: list[list[Cell]] = [[str(row), float(stops)] for row, stops in d.stops.iloc[:, 0].items()]
        blocks.append(Table(["DLC", "stops"], rows, caption="Stops per year"))
    return blocks


def _power_charts(powers: pd.DataFrame) -> list[Block]:
    """Mean power and annual energy over wind speed."""
    speeds, kw = powers.index.to_numpy(float), display("W")[1]
    power, half = (powers[name].to_numpy(float) * kw for name in ("power", "half_width"))
    curves = [Curve("mean power", speeds, power)]
    if np.isfinite(half).any():
        curves.append(Curve("interval", speeds, power - half, upper=power + half, colour=0))
    energy = Curve("energy", speeds, powers["energy"].to_numpy(float) / 3.6e9)
    wind, words = Axis("wind speed", "m/s"), "annual energy production in each wind speed bin"
    mean = "mean of the production cases at each wind speed"
    return [
        Chart("Power", wind, Axis("power", "kW", start=0.0), curves, mean),
        Chart("Energy", wind, Axis("energy", "MWh", start=0.0), [energy], words),
    ]


def _duty_table(duties: pd.DataFrame) -> Table:
    """Annual travel, time and rates of the drives."""
    rows: list[list[Cell]] = []
    for drive, duty in duties.iterrows():
        travel = [math.degrees(duty.travel), duty.moving / HOUR, 100.0 * duty.moving_share]
        rates = [math.degrees(duty.rms_rate), math.degrees(duty.largest_rate)]
        counts = [float(duty.starts), float(duty.reversals)]
        rows.append([title_of(str(drive)), *travel, *counts, *rates, CaseName(str(duty.case))])
    head = ["drive", "travel\ndeg", "moving\nh", "moving\n%", "starts", "reversals", "rms rate\ndeg/s"]
    return Table([*head, "largest rate\ndeg/s", "case"], rows, caption="Annual duty of the drives")
