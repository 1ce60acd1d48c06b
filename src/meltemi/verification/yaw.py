"""Operation in yaw against OpenFAST, and power over the yaw error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.postprocess.statistics import azimuth_bins
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure
from meltemi.simulation.simulate import simulate
from meltemi.simulation.trim import operating_point
from meltemi.verification.steady import PSI, deck_model
from meltemi.verification.table import Comparison, Row, reference_table, relative, source_of
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]
YAW = 20.0
"""[deg] of the reference runs."""
ANGLES = (-40.0, -30.0, -20.0, -10.0, 10.0, 20.0, 30.0, 40.0)
FLOOR = 0.2
"""Of the largest load of the same kind at the same place."""
LEAST = 0.01
"""Of a load's mean; a smaller amplitude is referred to this."""
SWINGING = ("YawBrFyp", "YawBrMxp", "TwrBsFyt", "TwrBsMxt")
"""Where OpenFAST's lateral tower mode has not died out after 150 s: its swing is six times the amplitude at 3P and
spills into it, so this amplitude is only reported."""


def yawed(aero: str) -> Comparison:
    """Power and loads of yaw bearing, tower base and blade root at 10 m/s and 20 deg of yaw error."""
    table = {r["channel"]: r for r in reference_table("yaw", set=aero)}
    wind = SteadyWind(speed=10.0, direction=float(np.radians(YAW)))
    result = simulate(deck_model(aero), wind, duration=160.0, channels=["azimuth", *table]).between(100.0, 160.0)
    rows: list[Row] = []
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
    (straight,) = reference_table("steady", set=aero, wind="10", channel="GenPwr")
    aligned = operating_point(deck_model(aero), 10.0)
    ours = float(result["GenPwr"].mean()) / aligned["GenPwr"]
    theirs = float(table["GenPwr"]["mean"]) / float(straight["value"])
    rows.append(relative("power over that without yaw", "10 m/s", "-", theirs, ours, 0.2))
    title = f"At 10 m/s with {YAW:g} deg of yaw error, against OpenFAST set {aero}"
    return Comparison(f"yaw {aero}", title, source_of("yaw"), rows)


def _kind(channel: str) -> str:
    """``F`` for forces, ``M`` for moments, empty for power and speed."""
    return channel[-3] if channel[-1] in "pt" else channel[-4] if channel.startswith("Root") else ""


def power_in_yaw() -> Comparison:
    """Power of steady operation at 8 m/s against the yaw error, beside the cube of its cosine."""
    model = deck_model("A")
    straight = operating_point(model, 8.0)["GenPwr"]
    cosines = np.cos(np.radians(ANGLES))
    winds = (SteadyWind(speed=8.0, direction=float(np.radians(angle))) for angle in ANGLES)
    ratios = np.array([operating_point(model, wind)["GenPwr"] / straight for wind in winds])
    rows = [
        relative("power over that without yaw", f"{angle:+g} deg", "-", cosine**3, ratio)
        for angle, cosine, ratio in zip(ANGLES, cosines, ratios, strict=True)
    ]
    exponent = float(np.log(ratios) @ np.log(cosines) / np.sum(np.log(cosines) ** 2))
    rows.append(relative("exponent of the cosine", "least squares", "-", 3.0, exponent))
    figure, axes = new_figure(1, 1, size=(9.0, 3.2))
    fine = np.linspace(-40.0, 40.0, 81)
    axes[0, 0].plot(ANGLES, ratios, "o", mfc="none", color=COLOURS[0], label="meltemi, 8 m/s, options of set A")
    for p, colour in ((exponent, COLOURS[0]), (3.0, COLOURS[1])):
        axes[0, 0].plot(fine, np.cos(np.radians(fine)) ** p, color=colour, label=f"cosine to the power of {p:.2f}")
    axes[0, 0].set_xlabel("yaw error [deg]")
    axes[0, 0].set_ylabel("power over that without yaw [-]")
    axes[0, 0].legend()
    source = "cube of the cosine: the power of the wind across the disk, with an unchanged power coefficient"
    title, figures = "Power against the yaw error at 8 m/s", {"power_in_yaw": figure}
    return Comparison("power in yaw", title, source, rows, figures=figures)
