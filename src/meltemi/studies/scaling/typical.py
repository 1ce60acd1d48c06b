"""Typical masses of blades, hubs, nacelles and towers: NREL's Cost and Scaling Model.

The laws are regressions over turbines of 0.75 to 5 MW, in the form of 2015. The report of 2006 has the original ones.

References: Fingersh, Hand and Laxson (2006), NREL/TP-500-40566; the update of 2015 as in WISDEM, nrelcsm/
nrel_csm_mass_2015.py, with its former law for the gearbox, 113 Q^0.71.
"""

from __future__ import annotations

from dataclasses import dataclass

from meltemi.turbine.definition import Turbine
from meltemi.turbine.moments import blade_moments


@dataclass(frozen=True)
class ComponentMasses:
    """Typical masses [kg]: one blade, hub with pitch system and spinner, nacelle, tower."""

    blade: float
    hub: float
    nacelle: float
    tower: float


def typical_masses(turbine: Turbine) -> ComponentMasses:
    """Typical masses for a turbine's diameter, power, rotor speed, hub height and blade mass.

    Blades are of glass fibre for low wind speeds (class II and below); hub and shaft depend on the blades of the
    turbine.
    """
    D, blade = turbine.rotor_diameter, blade_moments(turbine.blade.structure, turbine.hub.radius)[0]
    kw = turbine.rated_power / 1e3
    drive, control = turbine.drivetrain, turbine.control
    speed = turbine.rated_rotor_speed
    torque = control.torque.rated_power / drive.gearbox_efficiency / speed  # [N m]
    bearings = turbine.n_blades * 0.1295 * blade + 491.31
    bedplate = D**2.2
    nacelle = {
        "shaft": 13.0 * (blade * kw / 1e3) ** 0.65 + 775.0,
        "main bearings": 2.0 * 1e-4 * D**3.5,
        "gearbox": 113.0 * (torque / 1e3) ** 0.71,
        "fast shaft": 0.19894 * kw,
        "brake": 0.00122 * torque,
        "generator": 2.3 * kw + 3400.0,
        "bedplate": bedplate,
        "platforms": 0.125 * bedplate,
        "yaw system": 1.5 * 0.0009 * D**3.314,
        "cooling": 0.08 * kw,
        "cover": 1.2817 * kw + 428.19,
        "transformer": 1.915 * kw + 1910.0,
    }
    return ComponentMasses(
        blade=0.5 * (0.5 * D) ** 2.5,
        hub=2.3 * blade + 1320.0 + 1.328 * bearings + 555.0 + 15.5 * D - 980.0,
        nacelle=sum(nacelle.values()),
        tower=19.828 * turbine.hub_height**2.0282,
    )
