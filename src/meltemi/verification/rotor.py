"""Power and thrust of the rotor: against OpenFAST over tip-speed ratio and pitch, and over the yaw error."""

from __future__ import annotations

import numpy as np

from meltemi.analyses.performance import rotor_performance
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure
from meltemi.simulation.trim import operating_point
from meltemi.turbine.library import load_turbine
from meltemi.verification.openfast_deck import deck_options, deck_turbine
from meltemi.verification.steady import deck_model
from meltemi.verification.table import Check, CheckTable, reference_table, relative, source_of
from meltemi.wind.fields import SteadyWind

ANGLES = (-40.0, -30.0, -20.0, -10.0, 10.0, 20.0, 30.0, 40.0)
"""[deg] yaw errors."""


def performance() -> CheckTable:
    """Power and thrust coefficient of the rigid rotor."""
    turbine = deck_turbine(load_turbine("nrel5mw"))
    table = reference_table("performance")
    ratios = sorted({float(r["tip_speed_ratio"]) for r in table})
    pitches = sorted({float(r["pitch_deg"]) for r in table})
    ours = rotor_performance(turbine, ratios, np.radians(pitches).tolist(), options=deck_options(turbine, "A"))
    rows: list[Check] = []
    figure, axes = new_figure(1, 2, size=(9.0, 3.6))
    for ax, quantity, values in zip(axes[0], ("power", "thrust"), (ours.power, ours.thrust), strict=True):
        name, column = f"{quantity} coefficient", f"{quantity}_coefficient"
        largest = max(float(r[column]) for r in table)
        for r in table:
            i, j = ratios.index(float(r["tip_speed_ratio"])), pitches.index(float(r["pitch_deg"]))
            case = f"tip-speed ratio {ratios[i]:g}, pitch {pitches[j]:g} deg"
            reference, value = float(r[column]), float(values[i, j])
            rows.append(Check(name, case, "-", reference, value, 100.0 * (value - reference) / largest, "%", 1.0))
        for j, pitch in enumerate(pitches):
            points = [(float(r["tip_speed_ratio"]), float(r[column])) for r in table if float(r["pitch_deg"]) == pitch]
            ax.plot(ratios, values[:, j], color=COLOURS[j], label=f"{pitch:g} deg")
            ax.plot(*zip(*sorted(points), strict=True), "o", ms=3.5, mfc="none", color=COLOURS[j])
        ax.set_xlabel("tip-speed ratio [-]")
        ax.set_ylabel(f"{name} [-]")
        ax.set_ylim(bottom=0.0)
    axes[0, 0].legend(title="pitch (circles: OpenFAST)")
    title = "Rigid rotor against OpenFAST (aerodyn_driver)"
    return CheckTable("performance", title, source_of("performance"), rows, figures={"performance": figure})


def power_in_yaw() -> CheckTable:
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
    return CheckTable("power in yaw", title, source, rows, figures=figures)
