"""Main data of a turbine: names and values in engineering units."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from meltemi.analyses.modes import Mode
from meltemi.report import tables
from meltemi.report.tables import Rows
from meltemi.reports.turbine_overview import PowerTurbineOverview, TurbineOverview, masses
from meltemi.turbine.definition import Turbine
from meltemi.turbine.power_turbine import AnyTurbine

if TYPE_CHECKING:
    from meltemi.frames.finite_elements import Assembly

Groups = list[tuple[str, list[tuple[str, str]]]]
FIRST = (
    ("tower fore-aft", "tower 1st fore-aft"),
    ("tower side-side", "tower 1st side-side"),
    ("drivetrain", "drivetrain"),
)
"""Modes of the machine among the facts, and their coordinates; the generator's speed is held."""


def turbine_facts(overview: TurbineOverview | PowerTurbineOverview) -> Groups:
    """Groups of names and values, without quantities that could not be computed."""
    if isinstance(overview, PowerTurbineOverview):
        return _power_facts(overview)
    t = overview.turbine
    n, d, torque, pitch = t.nacelle, t.drivetrain, t.control.torque, t.control.pitch
    reference, swept = t.rated_rotor_speed, math.pi * t.rotor_radius**2
    kg = masses(t)
    rotor = [
        ("blades", f"{t.n_blades} of {number(t.blade.length)} m"),
        ("diameter", f"{number(t.rotor_diameter)} m"),
        ("hub height", f"{number(t.hub_height)} m"),
        ("hub radius", f"{number(t.hub.radius)} m"),
        ("cone, tilt", f"{_degrees(t.hub.precone)}, {_degrees(n.tilt)}"),
        ("overhang", f"{number(n.overhang)} m"),
        ("swept area", f"{number(swept)} m²"),
        ("specific power", f"{number(t.rated_power / swept)} W/m²"),
    ]
    operation = _operation(t, reference)
    if overview.rated:
        operation.insert(3, ("rated wind", f"{overview.rated.wind.speed:.2f} m/s, uniform"))
    if overview.curve:
        most = max(overview.curve, key=lambda p: p["rotor_aero_thrust"])
        force, wind = number(most["rotor_aero_thrust"] / 1e3), most.wind.speed
        operation.append(("largest thrust", f"{force} kN at {wind:.1f} m/s"))
    if overview.best:
        best, ratio, angle = overview.best
        operation.append(("largest C_p", f"{best:.3f} at λ {ratio:g}, {_degrees(angle)}"))
    drive = [
        ("gear ratio", "1, direct drive" if d.gear_ratio == 1.0 else number(d.gear_ratio)),
        ("generator speed", f"{number(pitch.reference_speed * 30.0 / math.pi)} rpm"),
        ("rated torque", prefixed(torque.rated_power / torque.rated_speed, "N m")),
        ("efficiency", f"{number(100.0 * d.generator_efficiency * d.gearbox_efficiency)} %"),
        ("generator inertia", _inertia(d.generator_inertia)),
        ("shaft stiffness", prefixed(d.stiffness, "N m/rad")),
    ]
    control = [("speed filter", f"{number(t.control.filter_frequency / (2.0 * math.pi))} Hz"), *_control(t)]
    weights = [(name, f"{number(value / 1e3)} t") for name, value in kg.items()]
    weights.append(("tower top", f"{number((kg['rotor'] + kg['nacelle']) / 1e3)} t"))
    groups = [("Rotor", rotor), ("Operation", operation), ("Drivetrain", drive), ("Control", control)]
    groups.append(("Mass", weights))
    if words := getattr(t.platform, "line_words", ""):
        groups.append(("Mooring", [("lines", words)]))
    if rows := _frame(t):
        groups.append(("Frame", rows))
    if frequencies := _frequencies(overview):
        groups.append(("Frequency at rest", frequencies))
    return groups


def frame_masses(assembly: Assembly) -> dict[str, float]:
    """Masses [kg] of a frame by what they are, without those that it has not."""
    e, frame = assembly.elements, assembly.frame
    parts = {"steel": e.steel, "liquid inside": e.fill, "marine growth": e.growth}
    masses = {name: float(each @ e.length) for name, each in parts.items()}
    masses["masses at joints"] = sum(each.mass for each in frame.masses)
    return {name: kg for name, kg in masses.items() if kg > 0.0}


def _frame(turbine: Turbine) -> list[tuple[str, str]]:
    """Counts, masses and displaced volume; empty without a frame."""
    if (frame := turbine.frame) is None:
        return []
    from meltemi.frames.finite_elements import assemble
    from meltemi.frames.reduction import tower_base
    from meltemi.frames.water import pieces

    assembly = assemble(frame, tower_base(frame, turbine.tower))
    kg, water = frame_masses(assembly), pieces(assembly)
    return [
        ("members, joints", f"{len(frame.members)}, {len(frame.joints)}"),
        ("steel, in all", f"{number(1e-3 * kg.get('steel', 0.0))} t, {number(1e-3 * sum(kg.values()))} t"),
        ("displaced water", f"{number(float(water.volume[water.high <= 1e-6].sum()))} m³"),
    ]


def _power_facts(overview: PowerTurbineOverview) -> Groups:
    """Main data of a power-coefficient turbine."""
    t, p = overview.turbine, overview.performance
    d, law, pitch = t.drivetrain, t.control.torque, t.control.pitch
    reference, swept = t.rated_rotor_speed, math.pi * t.rotor_radius**2
    stored = 0.5 * d.inertia * reference**2
    i, j = divmod(int(p.power.argmax()), len(p.pitch))
    rotor = [
        ("diameter", f"{number(t.rotor_diameter)} m"),
        ("hub height", f"{number(t.hub_height)} m"),
        ("specific power", f"{number(t.rated_power / swept)} W/m²"),
        ("coefficient", t.coefficient.kind),
        ("largest C_p", f"{p.power[i, j]:.3f} at λ {number(float(p.tip_speed_ratio[i]))}, {_degrees(p.pitch[j])}"),
    ]
    operation = _operation(t, reference)
    if pitched := [point for point in overview.curve or () if point.pitch > pitch.minimum + 1e-3]:
        operation.append(("rated wind", f"{pitched[0].wind.speed:.2f} m/s, uniform"))
    drive = [
        ("gear ratio", "1, direct drive" if d.gear_ratio == 1.0 else number(d.gear_ratio)),
        ("inertia", f"{_inertia(d.inertia)}, {number(stored / t.rated_power)} s of rated power"),
        ("shaft", "rigid" if d.stiffness is None else prefixed(d.stiffness, "N m/rad")),
        ("rated torque", prefixed(law.rated_power / law.rated_speed, "N m")),
        ("efficiency", f"{number(100.0 * d.generator_efficiency)} %"),
    ]
    return [("Rotor", rotor), ("Operation", operation), ("Drivetrain", drive), ("Control", _control(t))]


def _operation(turbine: AnyTurbine, reference: float) -> list[tuple[str, str]]:
    return [
        ("rated power", f"{number(turbine.rated_power / 1e6)} MW electrical"),
        ("rotor speed", f"{number(reference * 30.0 / math.pi)} rpm"),
        ("tip speed", f"{number(reference * turbine.rotor_radius)} m/s"),
        ("wind", f"{number(turbine.cut_in)} to {number(turbine.cut_out)} m/s"),
    ]


def _control(turbine: AnyTurbine) -> list[tuple[str, str]]:
    pitch, actuator = turbine.control.pitch, turbine.pitch_actuator
    return [
        ("region 2 gain", f"{number(turbine.control.torque.optimal_gain)} N m s²"),
        ("pitch gains", f"{number(pitch.proportional_gain)} s, {number(pitch.integral_gain)}"),
        ("halved at", _degrees(pitch.gain_halving_pitch)),
        ("pitch", f"{_degrees(pitch.minimum)} to {_degrees(pitch.maximum)}"),
        ("pitch rate", f"{_degrees(actuator.rate_limit)}/s"),
        ("actuator", "ideal" if actuator.kind == "ideal" else f"{number(actuator.natural_frequency)} rad/s"),
    ]


def fact_rows(overview: TurbineOverview | PowerTurbineOverview) -> list[list[str]]:
    """Rows of :func:`turbine_facts`: group, named once, name and value."""
    return [[name if i == 0 else "", *row] for name, facts in turbine_facts(overview) for i, row in enumerate(facts)]


def mode_rows(modes: tuple[Mode, ...]) -> Rows:
    """Header and rows of natural modes."""
    rows = [
        [str(i + 1), mode.participation(), number(mode.frequency / (2.0 * math.pi)), number(100.0 * mode.damping)]
        for i, mode in enumerate(modes)
    ]
    return ["mode", "coordinates that move most", "Hz", "damping %"], rows


def _frequencies(overview: TurbineOverview) -> list[tuple[str, str]]:
    """First frequencies: of the turbine if its modes are known, otherwise of the clamped blade."""
    rows = []
    for name, coordinate in FIRST:
        moving = [m for m in overview.modes or () if coordinate in m.coordinates]
        if moving:  # the mode with the largest share of its energy in it
            mode = max(moving, key=lambda m: m.energy[m.coordinates.index(coordinate)] / m.energy.sum())
            rows.append((name, f"{number(mode.frequency / (2.0 * math.pi))} Hz"))
    if overview.blade:
        for name, frequency in zip(overview.blade.names, overview.blade.modes.frequency, strict=True):
            if name.startswith("1st"):
                rows.append((f"blade {name[4:]}", f"{number(float(frequency) / (2.0 * math.pi))} Hz, clamped"))
    return rows


def number(value: float) -> str:
    """Format with four significant digits, without trailing zeros."""
    text = tables.number(value)
    return text.rstrip("0").rstrip(".") if "." in text and "e" not in text else text


def prefixed(value: float, unit: str) -> str:
    """A value with the prefix of its unit that leaves one to three digits before the point."""
    steps = 0 if abs(value) < 1e3 else min(int(math.log10(abs(value)) // 3), 3)
    return f"{number(value / 1e3**steps)} {('', 'k', 'M', 'G')[steps]}{unit}"


def _inertia(value: float) -> str:
    """A moment of inertia in kg m² or, if it is large, in t m²."""
    return f"{number(value)} kg m²" if value < 1e6 else f"{number(value / 1e3)} t m²"


def _degrees(angle: float) -> str:
    return f"{number(round(math.degrees(angle), 4))}°"
