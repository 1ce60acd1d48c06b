"""Operation in yaw against OpenFAST."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from comparisons import reference_table, source_of
from comparisons.periodic import PSI
from meltemi.postprocess.statistics import azimuth_bins
from meltemi.simulation.simulate import simulate
from meltemi.simulation.trim import operating_point
from meltemi.verification.steady import deck_model
from meltemi.verification.table import Check, CheckTable, relative
from meltemi.verification.table import reference_table as table_of
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]
YAW = 20.0
"""[deg] of the reference runs."""
FLOOR = 0.2
"""Of the largest load of the same kind at the same place."""
LEAST = 0.01
"""Of a load's mean; a smaller amplitude is referred to this."""
SWINGING = ("YawBrFyp", "YawBrMxp", "TwrBsFyt", "TwrBsMxt")
"""Where OpenFAST's lateral tower mode has not died out after 150 s: its swing is six times the amplitude at 3P and
spills into it, so this amplitude is only reported."""


def yawed(aero: str) -> CheckTable:
    """Power and loads of yaw bearing, tower base and blade root at 10 m/s and 20 deg of yaw error."""
    table = {r["channel"]: r for r in reference_table("yaw", set=aero)}
    wind = SteadyWind(speed=10.0, direction=float(np.radians(YAW)))
    result = simulate(deck_model(aero), wind, duration=160.0, channels=["azimuth", *table]).between(100.0, 160.0)
    rows: list[Check] = []
    for name, r in table.items():
        unit, x = result.channel(name).unit, azimuth_bins(result, name)
        alike = [other for channel, other in table.items() if channel[:5] == name[:5] and _kind(channel) == _kind(name)]
        floor = FLOOR * max(abs(float(other["mean"])) for other in alike)
        band = 0.2 if _kind(name) == "" else 1.5
        rows.append(relative("mean", name, unit, float(r["mean"]), float(x.mean()), band, floor=floor))
        if _kind(name) == "":
            continue
        column, n = ("first", 1) if name.startswith("Root") else ("third", 3)
        floor = max(FLOOR * max(float(other[column]) for other in alike), LEAST * abs(float(r["mean"])))
        ours = 2.0 * float(abs(np.mean(x * np.exp(1j * n * PSI))))
        within = None if name in SWINGING else 5.0
        rows.append(relative(f"amplitude at {n}P", name, unit, float(r[column]), ours, within, floor=floor))
    (straight,) = table_of("steady", set=aero, wind="10", channel="GenPwr")
    aligned = operating_point(deck_model(aero), 10.0)
    ours = float(result["GenPwr"].mean()) / aligned["GenPwr"]
    theirs = float(table["GenPwr"]["mean"]) / float(straight["value"])
    rows.append(relative("power over that without yaw", "10 m/s", "-", theirs, ours, 0.2))
    title = f"At 10 m/s with {YAW:g} deg of yaw error, against OpenFAST set {aero}"
    return CheckTable(f"yaw {aero}", title, source_of("yaw"), rows)


def _kind(channel: str) -> str:
    """``F`` for forces, ``M`` for moments, empty for power and speed."""
    return channel[-3] if channel[-1] in "pt" else channel[-4] if channel.startswith("Root") else ""
