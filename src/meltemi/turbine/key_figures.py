"""Key figures of turbines in engineering units."""

from __future__ import annotations

import math
from typing import Any

from meltemi.core.units import display


def summary(turbine: Any) -> str:
    """Name, rated power, rotor diameter, hub height in one line."""
    return f"{turbine.name}: {', '.join(f'{name} {value}' for name, value in key_figures(turbine)[:3])}"


def key_figures(turbine: Any) -> list[tuple[str, str]]:
    """Names and values of the key figures in engineering units."""
    rpm, to_degrees, torque, gears = (
        display("rad/s")[1],
        display("rad")[1],
        turbine.control.torque,
        turbine.drivetrain.gear_ratio,
    )
    actuator = turbine.pitch_actuator
    lowest, highest, rate = (x * to_degrees for x in (actuator.minimum, actuator.maximum, actuator.rate_limit))
    figures = [
        ("rated power", f"{turbine.rated_power / 1e6:.4g} MW"),
        ("rotor diameter", f"{turbine.rotor_diameter:.4g} m"),
        ("hub height", f"{turbine.hub_height:.4g} m"),
        ("wind speeds", f"{turbine.cut_in:g} to {turbine.cut_out:g} m/s"),
        ("rated rotor speed", f"{turbine.rated_rotor_speed * rpm:.4g} rpm"),
        ("rated generator torque", f"{torque.rated_power / torque.rated_speed / 1e3:.5g} kN m, gear ratio {gears:.4g}"),
        ("pitch", f"{lowest:.3g} to {highest:.3g} deg, at most {rate:.3g} deg/s"),
        ("specific power", f"{turbine.rated_power / (math.pi * turbine.rotor_radius**2):.4g} W/m^2"),
    ]
    blade = getattr(turbine, "blade", None)
    flaps = f", {len(turbine.flaps)} flaps each" if turbine.flaps else ""
    figures.insert(3, ("blades", f"{turbine.n_blades}" + (f" of {blade.length:.4g} m{flaps}" if blade else "")))
    return figures
