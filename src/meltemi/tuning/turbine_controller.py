"""The controller that a turbine was designed with."""

from __future__ import annotations

from meltemi.bladed_controllers.controller import BladedController
from meltemi.bladed_controllers.rosco import find_rosco
from meltemi.control.controller import StartPoint
from meltemi.control.signals import Demands, Measurements
from meltemi.core.errors import MeltemiError
from meltemi.core.extras import missing
from meltemi.turbine.power_turbine import AnyTurbine

LONGEST = 300
"""Largest number of characters of a library's message in a note."""


def turbine_controller(turbine: AnyTurbine, otherwise: str = "baseline") -> tuple[str, str]:
    """Name of a turbine's controller, and a note for the terminal.

    ``rosco`` for a turbine with settings of ROSCO (``control.discon``), where the package is installed and reads them:
    the baseline controller only approximates their gains.

    Args:
      turbine: turbine of either kind.
      otherwise: name of the controller of other turbines, and without ROSCO.
    """
    if turbine.control.discon is None:
        return otherwise, ""
    lacking = missing(("rosco",))
    why = f"ROSCO itself needs {lacking}" if lacking else refused(turbine)
    if why:
        return otherwise, f"{turbine.name}: controller {otherwise} approximates its settings of ROSCO; {why}"
    return "rosco", f"{turbine.name}: controller rosco, with the turbine's settings (control.discon)"


def refused(turbine: AnyTurbine) -> str:
    """Why the installed ROSCO cannot begin with the settings of a turbine, by a call at rated speed; or empty."""
    speed = turbine.control.pitch.reference_speed
    start = StartPoint(wind_speed=12.0, generator_speed=speed, pitch=0.0, generator_torque=0.0)
    measured = Measurements.of(generator_speed=speed, wind_speed=12.0, n_blades=float(turbine.n_blades))
    try:
        begun = BladedController(turbine, find_rosco(), turbine.control.discon)
        assert begun.fresh is not None
        law = begun.fresh()
        assert law.init is not None and law.close is not None
        try:
            law.update(law.init(start), measured, Demands.of(), 0.01)
        finally:
            law.close()
    except MeltemiError as error:
        return f"the installed ROSCO cannot begin with {turbine.control.discon}: {str(error)[:LONGEST]}"
    return ""
