"""The library's NREL 5 MW against its report (NREL/TP-500-38060)."""

from __future__ import annotations

import numpy as np

from meltemi.analyses.modes import natural_modes
from meltemi.environment.site import Environment
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.simulation.trim import operating_point
from meltemi.turbine.library import load_turbine
from meltemi.verification.table import Check, CheckTable, angle, reference_table, relative, source_of

TURN = 2.0 * np.pi
COLUMNS = (
    ("rotor speed", "rotor_speed", "rad/s", "rotor_speed", np.pi / 30.0, "RotSpeed", 1.0),
    ("pitch", "pitch_1", "rad", "pitch", np.pi / 180.0, "BldPitch1", 0.5),
    ("mechanical power", "rotor_power", "W", "power", 1e3, "RotPwr", 3.0),
    ("thrust with weight", "rotor_thrust", "N", "thrust", 1e3, "RotThrust", 3.0),
    ("torque", "rotor_torque", "N m", "torque", 1e3, "RotTorq", 3.0),
)
"""Quantity, channel, unit, column of the report, its unit, channel of OpenFAST, band."""


def report_steady() -> CheckTable:
    """Steady operation from 3 to 25 m/s, with the options of reference set A."""
    # the report's turbine with ElastoDyn's degrees of freedom, quasi-steady wake, static polars
    options = ModelOptions(torsion_modes=0, inflow="quasi_steady", stall="static", tower_drag=False, locked=("yaw",))
    model = build(load_turbine("nrel5mw"), options)
    openfast = {(float(r["wind"]), r["channel"]): float(r["value"]) for r in reference_table("steady", set="A")}
    rows: list[Check] = []
    for r in reference_table("tp38060_steady"):
        wind = float(r["wind"])
        point = operating_point(model, wind)
        for what, channel, unit, column, factor, theirs, limit in COLUMNS:
            reference, ours = float(r[column]) * factor, point[channel]
            band = limit if wind > 3.0 else None
            other = openfast.get((wind, theirs))
            case = f"{wind:g} m/s"
            if unit == "rad":
                beside = None if other is None else np.degrees(other - reference)
                rows.append(angle(what, case, reference, ours, band, beside=beside))
            else:
                beside = None if other is None else 100.0 * (other / reference - 1.0)
                rows.append(relative(what, case, unit, reference, ours, band, beside=beside))
    return CheckTable(
        "report", "Steady operation against the report", source_of("tp38060_steady"), rows, "OpenFAST set A"
    )


def report_modes() -> CheckTable:
    """The 13 lowest natural frequencies at standstill, about equilibrium under gravity."""
    model = build(load_turbine("nrel5mw"), ModelOptions(locked=("yaw",)), Environment())
    modes = natural_modes(model)
    rows = []
    for mode, r in zip(modes, sorted(reference_table("tp38060_modes"), key=lambda r: float(r["fast"])), strict=False):
        fast, beside = float(r["fast"]), 100 * (float(r["adams"]) / float(r["fast"]) - 1)
        rows.append(relative("natural frequency", r["mode"], "Hz", fast, mode.frequency / TURN, 3.0, beside=beside))
    return CheckTable(
        "report modes", "Natural frequencies against the report (FAST)", source_of("tp38060_modes"), rows, "ADAMS"
    )
