"""The IEA 15 MW and 22 MW against the HAWC2 models of the same turbines."""

from __future__ import annotations

import numpy as np

from meltemi.analyses.linear import linearise
from meltemi.environment.site import Environment
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.simulation.trim import operating_point
from meltemi.turbine.library import load_turbine
from meltemi.verification.hawc2 import clamped_frequencies, point_of_row
from meltemi.verification.table import Check, CheckTable, angle, difference, reference_table, relative, source_of

MODES = ModelOptions()
"""The defaults for 6 x 6 sections: these blades twist by 5 deg."""
LOWEST = 5.0
"""[m/s] below which rows are only reported: HAWC2's controller holds its smallest rotor speed by pitch."""
FLAPWISE_DAMPING = 0.12
"""Damping ratio above which a mode is flapwise."""
RATED = 10.9
"""[m/s] rated wind speed, between the last wind of the table at the smallest pitch and the first above it."""


def steady_15mw() -> CheckTable:
    """Steady operation from 3 to 25 m/s: at the table's rotor speed and pitch, and under the turbine's control."""
    alone, model = rotor_alone("iea15mw"), build(load_turbine("iea15mw"), MODES)
    rows: list[Check] = []
    for r in reference_table("iea15mw_hawc2"):
        wind, pitch, speed = float(r["wind"]), np.radians(float(r["pitch"])), float(r["rotor_speed"]) * np.pi / 30.0
        case, judged = f"{wind:g} m/s", wind >= LOWEST
        if wind < RATED:
            rows += _loads(point_of_row(alone, r), r, case, "at the table's speed and pitch", judged)
        controlled = operating_point(model, wind)
        rows += _loads(controlled, r, case, "controlled", judged)
        rows.append(angle("pitch, controlled", case, float(pitch), controlled.pitch, 0.5 if judged else None))
        rows.append(relative("rotor speed, controlled", case, "rad/s", speed, controlled.rotor_speed))
    return CheckTable("iea15mw", "IEA 15 MW, steady operation against HAWC2", source_of("iea15mw_hawc2"), rows)


def _loads(point: OperatingPoint, r: dict[str, str], case: str, what: str, judged: bool) -> list[Check]:
    power = point["rotor_aero_torque"] * point.rotor_speed
    reference, thrust = 1e3 * float(r["power"]), 1e3 * float(r["thrust"])
    return [
        relative(f"aerodynamic power, {what}", case, "W", reference, power, 1.5 if judged else None),
        relative(f"thrust, {what}", case, "N", thrust, point["rotor_aero_thrust"], 3.0 if judged else None),
    ]


def rotor_alone(name: str, **options: object) -> BladedModel:
    """The turbine as the tables have it: no tilt and no gravity."""
    level = load_turbine(name).replace(**{"nacelle.tilt": 0.0})
    return build(level, MODES.replace(**options), Environment(gravity=0.0))


def steady_22mw() -> CheckTable:
    """Loads and deflections at HAWC2's rotor speed and pitch: within a band or between HAWC2 and OpenFAST."""
    model = rotor_alone("iea22mw")
    rows: list[Check] = []
    for r in reference_table("iea22mw_steady"):
        case, point = f"{r['wind']} m/s", point_of_row(model, r)
        quantities = {
            "power": (point["rotor_aero_torque"] * point.rotor_speed, "W", 2.5),
            "thrust": (point["rotor_aero_thrust"], "N", 2.5),
            "flap": (point["tip_flap_1"], "m", 3.0),
            "torsion": (float(np.degrees(point["tip_twist_1"])), "deg", 10.0),
        }
        for what, (ours, unit, band) in quantities.items():
            theirs, other = float(r[what]), float(r[f"{what}_openfast"])
            gap = 100.0 * (other - theirs) / abs(theirs)
            between = abs(gap) if gap * (ours - theirs) > 0.0 else 0.0
            rows.append(relative(what, case, unit, theirs, ours, max(band, between), beside=gap))
    title = "IEA 22 MW at HAWC2's speed and pitch; beside: OpenFAST against HAWC2"
    return CheckTable("iea22mw", title, source_of("iea22mw_steady"), rows)


def modes_22mw() -> CheckTable:
    """Aeroelastic edgewise modes: frequencies within 3 %, damping in the gap of both codes widened by a quarter."""
    model = rotor_alone("iea22mw", locked=("tower", "yaw", "generator", "drivetrain"))
    steady = {r["wind"]: r for r in reference_table("iea22mw_steady")}
    rows: list[Check] = []
    for wind, r in steady.items():
        modes = reference_table("iea22mw_modes", wind=wind)
        if not modes:
            continue
        ours = linearise(model, point_of_row(model, r), ("pitch",), ("rotor_aero_thrust",), azimuths=1).modes()
        for m in modes:
            theirs, other = (float(m[name]) for name in ("frequency", "frequency_openfast"))
            nearest = min(
                (mode for mode in ours if mode.damping < FLAPWISE_DAMPING),
                key=lambda mode: abs(mode.frequency / (2.0 * np.pi) - 0.5 * (theirs + other)),
            )
            case, frequency = f"{m['mode']}, {wind} m/s", nearest.frequency / (2.0 * np.pi)
            rows.append(
                relative("frequency", case, "Hz", theirs, frequency, 3.0, beside=100.0 * (other / theirs - 1.0))
            )
            low, high = sorted(float(m[name]) for name in ("damping", "damping_openfast"))
            band = 75.0 * (high - low) if "1st" in case else None
            middle = 0.5 * (low + high)
            rows.append(difference("damping", case, "-", middle, nearest.damping, band, measure="points", factor=100.0))
    title = "IEA 22 MW, aeroelastic edgewise modes against HAWC2 and OpenFAST (damping: against their mean)"
    return CheckTable("iea22mw modes", title, source_of("iea22mw_modes"), rows)


def frequencies() -> CheckTable:
    """Natural frequencies of isolated blades and towers."""
    turbines = {name: load_turbine(name) for name in ("iea15mw", "iea22mw")}
    counts = {"tower": {"fore_aft": 1, "side_side": 0, "torsion": 0}, "blade": {"flap": 1, "edge": 1, "torsion": 0}}
    rows = []
    for r in reference_table("iea_frequencies"):
        member, _, mode = r["member"].partition(" ")
        names, computed = clamped_frequencies(turbines[r["turbine"]], member, counts[member], 21)
        ours = computed[names.index("1st fore-aft" if mode == "alone" else mode)]
        rows.append(relative("frequency", f"{r['turbine']} {r['member']}", "Hz", float(r["frequency"]), ours, 3.0))
    title = "IEA 15 MW and 22 MW, frequencies of blade and tower"
    return CheckTable("iea modes", title, source_of("iea_frequencies"), rows)
