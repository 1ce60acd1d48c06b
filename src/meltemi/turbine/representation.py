"""Representations of turbines in terminals and notebooks."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from meltemi.core.record import Record
from meltemi.core.shown import Viewed
from meltemi.core.units import display

if TYPE_CHECKING:
    from meltemi.core.representation import Card


class Machine(Record, Viewed):
    """Base of the records of whole turbines."""

    name: str
    description: str = ""
    source: str = ""

    if TYPE_CHECKING:
        control: Any
        drivetrain: Any

    @property
    def rated_rotor_speed(self) -> float:
        """[rad/s] rotor speed that the controller holds at rated power."""
        return float(self.control.pitch.reference_speed / self.drivetrain.gear_ratio)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {summary(self)}>"

    def card(self) -> Card:
        """The key figures, then all parts, folded."""
        from meltemi.core.representation import Fold, record_card

        whole = record_card(self)
        others = [row for row in whole.facts if row[0] not in ("name", "description", "source", "rated power")]
        source = [("source", self.source)] if self.source else []
        facts = [*key_figures(self), *source]
        inside = [*([Fold("Further data", others)] if others else []), *whole.sections]
        return replace(whole, lead=f"{self.name} {self.description}".strip(), facts=facts, sections=inside)


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
    found = [
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
    found.insert(3, ("blades", f"{turbine.n_blades}" + (f" of {blade.length:.4g} m{flaps}" if blade else "")))
    return found
