"""The IEA 15 MW and 22 MW against the HAWC2 models of the same turbines."""

from __future__ import annotations

import numpy as np

from meltemi.core.errors import InputError
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.simulation.trim import OperatingPoint, operating_point
from meltemi.structure.members import blade_member, cells, points, tower_member
from meltemi.turbine.library import library_entries, load_turbine, windio_file
from meltemi_verification.table import Comparison, Row, angle, reference_table, relative, source_of

MODES = ModelOptions()
"""Three flap, two edge and two torsion modes, the default for 6 x 6 sections: these blades twist by 5 deg."""
LOWEST = 5.0
"""[m/s] below which rows are only reported: HAWC2's controller holds its smallest rotor speed by pitch."""
RATED = 10.9
"""[m/s] between the last wind of the table at the smallest pitch and the first above it."""


def installed() -> bool:
    """The data of the IEA turbines are installed."""
    try:
        for name, entry in library_entries().items():
            if entry.windio is not None:
                windio_file(entry.windio, name)
    except InputError:
        return False
    return True


def steady_15mw() -> Comparison:
    """Steady operation from 3 to 25 m/s: at the table's rotor speed and pitch, and under the turbine's own control."""
    model = build(load_turbine("iea15mw"), MODES)
    rows: list[Row] = []
    for r in reference_table("iea15mw_hawc2"):
        wind, pitch = float(r["wind"]), np.radians(float(r["pitch"]))
        speed = float(r["rotor_speed"]) * np.pi / 30.0
        case, judged = f"{wind:g} m/s", wind >= LOWEST
        if wind < RATED:
            same = operating_point(model, wind, rotor_speed=speed, pitch=float(pitch))
            rows += _loads(same, r, case, "at the table's speed and pitch", judged)
        own = operating_point(model, wind)
        rows += _loads(own, r, case, "own control", judged)
        rows.append(_pitch(own, r, case, 0.5 if judged else None))
        rows.append(relative("rotor speed, own control", case, "rad/s", speed, own.rotor_speed))
    return Comparison("iea15mw", "IEA 15 MW, steady operation against HAWC2", source_of("iea15mw_hawc2"), rows)


def _loads(point: OperatingPoint, r: dict[str, str], case: str, what: str, judged: bool) -> list[Row]:
    power = point["rotor_aero_torque"] * point.rotor_speed
    reference, thrust = 1e3 * float(r["power"]), 1e3 * float(r["thrust"])
    return [
        relative(f"aerodynamic power, {what}", case, "W", reference, power, 1.5 if judged else None),
        relative(f"thrust, {what}", case, "N", thrust, point["rotor_aero_thrust"], 3.0 if judged else None),
    ]


def _pitch(point: OperatingPoint, r: dict[str, str], case: str, band: float | None) -> Row:
    reference = float(np.radians(float(r["pitch"])))
    return angle("pitch, own control", case, reference, point.pitch, band)


def steady_22mw() -> Comparison:
    """Pitch above rated; reported only, since the table does not give the power it belongs to."""
    model = build(load_turbine("iea22mw"), MODES)
    rows = [
        _pitch(operating_point(model, float(r["wind"])), r, f"{r['wind']} m/s", None)
        for r in reference_table("iea22mw_hawc2")
        if float(r["wind"]) > 12.5 and float(r["wind"]) % 2.0 == 1.0
    ]
    return Comparison("iea22mw", "IEA 22 MW, pitch against HAWC2", source_of("iea22mw_hawc2"), rows)


def frequencies() -> Comparison:
    """Natural frequencies of isolated blades and towers."""
    models = {name: build(load_turbine(name)) for name in ("iea15mw", "iea22mw")}
    rows = []
    for r in reference_table("iea_frequencies"):
        ours = _alone(models[r["turbine"]], r["member"])
        rows.append(relative("frequency", f"{r['turbine']} {r['member']}", "Hz", float(r["frequency"]), ours, 3.0))
    title = "IEA 15 MW and 22 MW, frequencies of blade and tower"
    return Comparison("iea modes", title, source_of("iea_frequencies"), rows)


def _alone(model: BladedModel, member: str) -> float:
    """[Hz] first natural frequency of an isolated member."""
    turbine = model.turbine
    if member == "tower alone":
        layout = points(np.linspace(0.0, turbine.tower.length, 21))
        counts = {"fore_aft": 1, "side_side": 0, "torsion": 0}
        found = tower_member(turbine.tower, counts, np.zeros((6, 6)), None, layout)
        kind = "1st fore-aft"
    else:
        layout = cells(np.linspace(0.0, turbine.blade.length, 21))
        found = blade_member(turbine.blade.structure, {"flap": 1, "edge": 1, "torsion": 0}, layout)
        kind = member.removeprefix("blade ")
    return float(found.modes.frequency[found.names.index(kind)]) / (2.0 * np.pi)
