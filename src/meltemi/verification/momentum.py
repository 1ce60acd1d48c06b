"""The rotor against momentum theory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from meltemi.analyses.performance import RIGID, rotor_performance
from meltemi.simulation.case import Case
from meltemi.simulation.options import AdvancedOptions, ModelOptions
from meltemi.simulation.rotors import build
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine
from meltemi.verification.table import Check, CheckTable, at_least, relative
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]

BETZ = 16.0 / 27.0
RATIOS = (4.0, 7.0, 10.0, 20.0)
LIFT, INCIDENCE, SLOPE = 0.8, 0.1, 6.0
"""Design lift coefficient and angle of attack of the optimum rotor's section; its lift slope [1/rad]."""
STATIONS = 200


def momentum() -> CheckTable:
    """Power of Glauert's optimum rotor, Betz's limit, thrust against the momentum of the wake."""
    turbine = load_turbine("nrel5mw")
    rows: list[Check] = []
    plain = ModelOptions(
        tip_loss=False, hub_loss=False, blade_nodes=200, advanced=AdvancedOptions(induction_iterations=40)
    )
    for ratio in RATIOS:
        rotor, exact = optimum_rotor(turbine, ratio)
        ours = rotor_performance(rotor, [ratio], [0.0], options=plain)
        power = float(ours.power[0, 0])
        rows.append(relative("optimum rotor, power coefficient", f"tip-speed ratio {ratio:g}", "-", exact, power, 0.5))
        rows.append(at_least("optimum rotor, below Betz by", f"tip-speed ratio {ratio:g}", "-", 1e-9, BETZ - power))
        if ratio == RATIOS[-1]:
            rows.append(relative("Betz limit approached", f"tip-speed ratio {ratio:g}", "-", BETZ, power, 0.5))
    for loss in (False, True):
        thrust, wake = _far_wake(turbine, loss)
        name = "with tip and hub loss" if loss else "without losses"
        rows.append(relative("thrust from far-wake momentum", name, "N", wake, thrust, 0.5))
    return CheckTable("momentum", "The rotor against momentum theory", "Glauert (1935); Betz (1920)", rows)


def optimum_rotor(turbine: Turbine, ratio: float) -> tuple[Turbine, float]:
    """Glauert's optimum rotor without drag for a tip-speed ratio, and its power coefficient."""
    R, hub = turbine.rotor_radius, turbine.hub.radius
    r = np.linspace(hub, R, STATIONS)
    x = ratio * r / R
    a, tangential = np.array([_optimum(float(value)) for value in x]).T
    phi = np.arctan2(1.0 - a, x * (1.0 + tangential))
    # thrust: sigma C_l cos(phi) (1 - a)^2 / sin(phi)^2 = 4 a (1 - a)
    solidity = 4.0 * a * np.sin(phi) ** 2 / ((1.0 - a) * LIFT * np.cos(phi))
    chord = 2.0 * np.pi * r * solidity / turbine.n_blades
    alpha = np.concatenate([[-np.pi], np.linspace(-1.2, 1.2, 481), [np.pi]])
    lift = np.where(np.abs(alpha) < 1.3, LIFT + SLOPE * (alpha - INCIDENCE), 0.0)
    section = {
        "angle_of_attack": alpha.tolist(),
        "lift": lift.tolist(),
        "drag": [0.0] * len(alpha),
        "moment": [0.0] * len(alpha),
        "dynamic_stall": False,
    }
    data = turbine.replace(
        **{
            "airfoils": {**turbine.content()["airfoils"], "ideal": section},
            "blade.aerodynamics": {
                "position": (r - hub).tolist(),
                "chord": chord.tolist(),
                "twist": (phi - INCIDENCE).tolist(),
                "airfoil": ["ideal"] * STATIONS,
            },
        }
    )
    power = 8.0 / ratio**2 * np.trapezoid(tangential * (1.0 - a) * x**3, x)
    return data, float(power)


def _optimum(x: float) -> tuple[float, float]:
    """Axial and tangential induction of the optimum rotor at local speed ratio x (Glauert)."""

    def condition(a: float) -> float:
        # (1 - a)(4 a - 1)^2 / (1 - 3 a) = x^2 from the optimum with wake rotation
        return (1.0 - a) * (4.0 * a - 1.0) ** 2 - x**2 * (1.0 - 3.0 * a)

    a = float(brentq(condition, 0.25, 1.0 / 3.0))
    return a, (1.0 - 3.0 * a) / (4.0 * a - 1.0)


def _far_wake(turbine: Turbine, loss: bool) -> tuple[float, float]:
    """Thrust of the blade loads, and rho U^2 (1 - a) 2 a F of the annuli."""
    content = turbine.content()["airfoils"]
    airfoils = {name: {**foil, "drag": [0.0] * len(foil["drag"])} for name, foil in content.items()}
    rigid = turbine.replace(airfoils=airfoils, **{"nacelle.tilt": 0.0, "hub.precone": 0.0})
    options = ModelOptions(
        locked=RIGID,
        flap_modes=0,
        edge_modes=0,
        torsion_modes=0,
        inflow="quasi_steady",
        stall="static",
        tower_influence="none",
        tip_loss=loss,
        hub_loss=loss,
        advanced=AdvancedOptions(high_induction="none", induction_iterations=40),
    )
    model = build(rigid, options)
    speed, ratio = 8.0, 7.0
    case = Case(model, SteadyWind(speed=speed))
    case["v"][model.rows.generator] = ratio * speed / rigid.rotor_radius
    case.view("pitch")["angle"] = 0.0
    case.evaluate(0.0)
    flow = case.view("flow")
    a, phi, r, width = flow["axial"][0], flow["phi"][0], flow["radius"][0], model.rotor.blade_layout.length
    F = np.ones_like(a)
    if loss:
        B, tip, hub = model.n_blades, rigid.rotor_radius, rigid.hub.radius
        F *= 2.0 / np.pi * np.arccos(np.exp(-0.5 * B * (tip - r) / (r * np.sin(phi))))
        F *= 2.0 / np.pi * np.arccos(np.exp(-0.5 * B * (r - hub) / (hub * np.sin(phi))))
    density = model.environment.density
    wake = np.sum(density * 2.0 * np.pi * r * width * speed**2 * (1.0 - a) * 2.0 * a * F)
    return float(case.view("rotor")["thrust"]), float(wake)
