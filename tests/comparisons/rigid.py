"""The rigid rotor, prescribed motion and pitch steps against OpenFAST."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from comparisons import reference_table, source_of
from comparisons.measure import harmonic, undershoot
from meltemi.analyses.performance import RIGID
from meltemi.control.constant import ConstantController
from meltemi.control.controller import Controller
from meltemi.control.signals import Demands, Measurements
from meltemi.postprocess.statistics import azimuth_bins
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.channels import find, standard
from meltemi.simulation.rotors import build
from meltemi.simulation.simulate import simulate
from meltemi.simulation.start import Start
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine
from meltemi.verification.openfast_deck import deck_options, deck_turbine
from meltemi.verification.steady import NODE_FIELDS, NODES, deck_model
from meltemi.verification.table import Check, CheckTable, phase, relative
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]
SPEED, PITCH = 12.1 * np.pi / 30.0, np.radians(3.83)


def straight(turbine: Turbine) -> Turbine:
    """The turbine without tilt and cone, hub at 90 m."""
    return turbine.replace(
        **{"nacelle.tilt": 0.0, "hub.precone": 0.0, "nacelle.shaft_height": 90.0 - turbine.tower.length}
    )


FIXED = {
    "straight": (True, {"tower_influence": "none"}, SteadyWind(speed=12.0)),
    "notower": (False, {"tower_influence": "none"}, SteadyWind(speed=12.0)),
    "as built": (False, {}, SteadyWind(speed=12.0)),
    "shear": (False, {}, SteadyWind(speed=12.0, shear_exponent=0.2)),
    "yaw20": (False, {}, SteadyWind(speed=12.0, direction=float(np.radians(20.0)))),
}
"""Case: without tilt and cone, options, wind."""


def fixed_rotor() -> CheckTable:
    """Rigid turbine at 12.1 rpm: kinematics, momentum theory and section loads."""
    turbine = deck_turbine(load_turbine("nrel5mw"))
    rows: list[Check] = []
    for case, (plain, changes, wind) in FIXED.items():
        described = straight(turbine) if plain else turbine
        model = build(described, deck_options(described, "A", locked=RIGID, time_step=0.0125, **changes))
        table = reference_table("fixed", case=case)
        names = [_ours(r["channel"]) for r in table]
        thrust_moment = next(float(r["mean"]) for r in table if r["channel"] == "RootMyc1")
        result = simulate(
            model,
            wind,
            duration=60.0,
            controller=ConstantController(),
            start=Start(rotor_speed=SPEED, pitch=PITCH, coordinates={}),
            channels=["azimuth", *names],
        ).between(30.0, 60.0)  # the window, and so the azimuths, of the reference
        for r, name in zip(table, names, strict=True):
            bins = azimuth_bins(result, name)
            unit = result.channel(name).unit
            mean, half = float(r["mean"]), float(r["half_range"])
            # bending about an axis that the mean load hardly bends: refer to what that load does elsewhere
            floor = max(half, 0.05 * thrust_moment if r["channel"].startswith("YawBr") else 0.0)
            rows.append(relative(f"{r['channel']} mean", case, unit, mean, float(bins.mean()), 1.5, floor=floor))
            if half > 1e-2 * abs(mean):
                least = max(floor, 0.2 * abs(mean))
                ours = 0.5 * float(np.ptp(bins))
                rows.append(relative(f"{r['channel']} half range", case, unit, half, ours, 1.5, floor=least))
    return CheckTable("fixed rotor", "Rigid machine at fixed speed against OpenFAST", source_of("fixed"), rows)


def _ours(channel: str) -> str:
    """Name of an OpenFAST channel in meltemi."""
    if channel.startswith("B1N"):
        return f"node_{NODES[int(channel[3]) - 1]}_{NODE_FIELDS[channel[4:]][0]}_1"
    return find(channel, standard()).name


def spin() -> CheckTable:
    """Flexible rotor turning in vacuum under gravity: mean and first harmonic."""
    model = deck_model("A", locked=("yaw", "generator")).with_parameters(**{"aerodynamics.air_density": 0.0})
    rows = spinning(model, [r["channel"] for r in reference_table("spin")], 1.5)
    return CheckTable("spin", "Spinning in vacuum against OpenFAST", source_of("spin"), rows)


def spinning(model: BladedModel, channels: Sequence[str], band: float, prefix: str = "") -> list[Check]:
    """Mean, amplitude and phase over the azimuth of a rotor turning in vacuum."""
    result = simulate(
        model,
        SteadyWind(speed=0.0),
        duration=120.0,
        controller=ConstantController(),
        start=Start(rotor_speed=SPEED, coordinates={}),
        channels=["azimuth", *channels],
    ).between(60.0, 120.0)
    rows: list[Check] = []
    for r in reference_table("spin"):
        if (name := r["channel"]) in channels:
            mean, amplitude, lag = harmonic(result["azimuth"], result[name])
            unit, theirs = result.channel(name).unit, (float(r["mean"]), float(r["amplitude"]))
            floor = max(abs(theirs[0]), theirs[1])
            rows.append(relative(f"{prefix}mean", name, unit, theirs[0], mean, band, floor=floor))
            rows.append(relative(f"{prefix}amplitude", name, unit, theirs[1], amplitude, band, floor=0.1 * floor))
            if theirs[1] > 0.05 * floor and not prefix:
                rows.append(phase("phase", name, float(r["phase"]), lag, 10.0))
    return rows


def pitch_steps() -> CheckTable:
    """Rigid rotor, pitch 0 to 2 deg: undershoot and recovery by dynamic inflow."""
    turbine = straight(deck_turbine(load_turbine("nrel5mw")))
    speed = 11.43 * np.pi / 30.0

    def step(state: Float, measured: Measurements, demands: Demands, dt: float) -> None:
        for blade in range(3):
            demands.pitch[blade] = np.radians(2.0) * min(max((measured.time - 80.0) / 0.1, 0.0), 1.0)

    rows: list[Check] = []
    figure, axes = new_figure(1, 1, size=(9.0, 3.2))
    for i, aero in enumerate(("A", "B", "E", "E3")):
        model = build(turbine, deck_options(turbine, aero, locked=RIGID, tower_influence="none", time_step=0.01))
        result = simulate(
            model,
            SteadyWind(speed=10.0),
            duration=140.0,
            controller=Controller(update=step, name="pitch step", uses_loads=False),
            start=Start(rotor_speed=speed, coordinates={}),
            channels=["RtFldFxh", "RtFldMxh"],
        )
        for r in reference_table("pitch_step", set=aero):
            channel = r["channel"]
            before, lowest, final, recovery = undershoot(result.time, result[channel], 80.0)
            unit, where = result.channel(channel).unit, f"set {aero}"
            b, low, f, wait = (float(r[k]) for k in ("before", "lowest", "final", "recovery"))
            rows.append(relative(f"{channel} before", where, unit, b, before, 1.5))
            rows.append(relative(f"{channel} final", where, unit, f, final, 1.5))
            if wait:
                rows.append(relative(f"{channel} undershoot", where, unit, f - low, final - lowest, 5.0))
                rows.append(relative(f"{channel} recovery", where, "s", wait, recovery, 5.0))
        shown = (result.time > 75.0) & (result.time < 110.0)
        axes[0, 0].plot(
            result.time[shown], result["RtFldFxh"][shown] * 1e-3, color=COLOURS[i], label=f"options of set {aero}"
        )
        low = float(reference_table("pitch_step", set=aero, channel="RtFldFxh")[0]["lowest"])
        at = result.time[result["RtFldFxh"].argmin()]
        axes[0, 0].plot([at], [low * 1e-3], "o", mfc="none", color=COLOURS[i])
    axes[0, 0].set_xlabel("time [s]")
    axes[0, 0].set_ylabel("thrust [kN]")
    axes[0, 0].legend(title="circles: OpenFAST's lowest value")
    title = "Pitch steps of the rigid rotor against OpenFAST"
    return CheckTable("pitch step", title, source_of("pitch_step"), rows, figures={"pitch_step": figure})
