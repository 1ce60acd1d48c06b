"""Structure against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipk

from meltemi.analyses.modes import natural_modes
from meltemi.control.constant import ConstantController
from meltemi.environment.site import Environment
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.case import Case
from meltemi.simulation.options import AdvancedOptions, ModelOptions
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, simulate
from meltemi.simulation.start import Start
from meltemi.simulation.vibrations import equilibrium, vacuum_case
from meltemi.structure.tables import BladeNode
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine
from meltemi.verification.energy import mechanical_energy
from meltemi.verification.table import Check, CheckTable, relative
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]

LENGTH, MASS, FLAP, EDGE = 60.0, 250.0, 3.0e9, 6.0e9
"""[m], [kg/m], [N m^2] of the uniform blade."""
HEIGHT, TOWER_MASS, TOWER_STIFFNESS, HEAD = 80.0, 4000.0, 3.0e11, 4.0e5
"""[m], [kg/m], [N m^2], [kg] of the uniform tower and the mass on its top."""
TURN = 2.0 * np.pi
SPEED = 12.1 * np.pi / 30.0
NO_DAMPING = {"flap": 0.0, "edge": 0.0, "torsion": 0.0, "fore_aft": 0.0, "side_side": 0.0}
CALM = SteadyWind(speed=0.0)
SOUTHWELL = {1.0: 3.6816, 2.0: 4.1373, 4.0: 5.5850, 8.0: 9.2568}
"""Nondimensional speed -> first frequency of flapping of a uniform rotating cantilever, hub radius 0."""


def uniform_blade(turbine: Turbine, **changes: Any) -> Turbine:
    """A turbine with uniform, straight, untwisted blades on a small hub, without tilt and cone."""
    station = [0.0, 0.5 * LENGTH, LENGTH]
    a = turbine.blade.aerodynamics
    structure = {
        "position": station,
        "twist": [0.0] * 3,
        "mass": [MASS] * 3,
        "flap_stiffness": [FLAP] * 3,
        "edge_stiffness": [EDGE] * 3,
        "damping": NO_DAMPING,
    }
    return turbine.replace(
        **{
            "blade.structure": structure,
            "blade.aerodynamics.position": (a.position * LENGTH / a.position[-1]).tolist(),
            "hub.radius": 0.01,
            "hub.precone": 0.0,
            "nacelle.tilt": 0.0,
            **changes,
        }
    )


def structure() -> CheckTable:
    """Frequencies, deflections, inertia, pendulum and energy."""
    turbine = load_turbine("nrel5mw")
    rows = [
        *_cantilever(turbine),
        *_tip_mass(turbine),
        *_rotating(turbine),
        *_static(turbine),
        _inertia(turbine),
        *_pendulum(turbine),
        *_energy(turbine, "default step", ModelOptions()),
    ]
    return CheckTable("closed form", "Structure against closed forms", "closed forms, see docs/verification", rows)


def _blade_model(turbine: Turbine, flap: int, edge: int, nodes: int = 40) -> BladedModel:
    options = ModelOptions(
        flap_modes=flap, edge_modes=edge, torsion_modes=0, blade_nodes=nodes, locked=("tower", "yaw", "drivetrain")
    )
    return build(turbine, options, Environment(gravity=0.0))


def _cantilever(turbine: Turbine) -> list[Check]:
    rows = []
    model = _blade_model(uniform_blade(turbine), 3, 2)
    frequencies = np.unique(np.round([m.frequency for m in natural_modes(model)], 9))
    beta = np.array([1.8751041, 4.6940911, 7.8547574])
    exact = {f"flap {i + 1}": b**2 * np.sqrt(FLAP / MASS) / LENGTH**2 for i, b in enumerate(beta)}
    exact |= {f"edge {i + 1}": b**2 * np.sqrt(EDGE / MASS) / LENGTH**2 for i, b in enumerate(beta[:2])}
    for name, w in exact.items():
        ours = frequencies[np.argmin(np.abs(frequencies - w))]
        rows.append(relative("cantilever frequency", name, "Hz", w / TURN, ours / TURN, 0.5))
    return rows


def _tip_mass(turbine: Turbine) -> list[Check]:
    """Uniform tower that carries a point mass, in the assembled machine with blades of almost no mass."""
    one = [0.0, 0.5 * HEIGHT, HEIGHT]
    tower = {
        "position": one,
        "mass": [TOWER_MASS] * 3,
        "fore_aft_stiffness": [TOWER_STIFFNESS] * 3,
        "side_side_stiffness": [TOWER_STIFFNESS] * 3,
        "diameter": [0.01] * 3,  # no rotary inertia
        "damping": NO_DAMPING,
    }
    point = uniform_blade(
        turbine,
        **{
            "tower": tower,
            "nacelle.mass": HEAD,
            "nacelle.mass_centre": [0.0, 0.0, 0.0],
            "nacelle.yaw_inertia": 1.0,
            "nacelle.roll_inertia": 1.0,
            "nacelle.nod_inertia": 1.0,
            "hub.mass": 1.0,
            "hub.inertia": 1.0,
            "drivetrain.generator_inertia": 1.0,
        },
    )
    changes = {"blade.structure.mass": [1e-3] * 3}
    options = ModelOptions(flap_modes=0, edge_modes=0, torsion_modes=0, locked=("yaw", "drivetrain", "blades"))
    model = build(point.replace(**changes), options, Environment(gravity=0.0))
    frequencies = np.array([m.frequency for m in natural_modes(model)])
    ratio = HEAD / (TOWER_MASS * HEIGHT)

    def characteristic(b: float) -> float:
        return float(1.0 + np.cos(b) * np.cosh(b) + ratio * b * (np.cos(b) * np.sinh(b) - np.sin(b) * np.cosh(b)))

    rows = []
    for i, (low, high) in enumerate(((0.5, 2.0), (3.5, 4.5))):
        b = brentq(characteristic, low, high)
        exact = b**2 * np.sqrt(TOWER_STIFFNESS / TOWER_MASS) / HEIGHT**2
        ours = frequencies[np.argmin(np.abs(frequencies - exact))]
        rows.append(
            relative("cantilever with tip mass, frequency", f"mode {i + 1}", "Hz", exact / TURN, ours / TURN, 0.5)
        )
    return rows


def _rotating(turbine: Turbine) -> list[Check]:
    """Southwell: centrifugal stiffening of a uniform blade, out of plane and in plane."""
    rows = []
    model = _blade_model(uniform_blade(turbine), 4, 4, 80)
    for stiffness, what in ((FLAP, "out of plane"), (EDGE, "in plane")):
        unit = np.sqrt(stiffness / MASS) / LENGTH**2
        for speed, value in SOUTHWELL.items():
            exact = unit * np.sqrt(value**2 - (speed**2 if what == "in plane" else 0.0))
            modes = natural_modes(model, speed * unit)
            part = "flap" if what == "out of plane" else "edge"
            collective = [m.frequency for m in modes if f"1st {part} collective" in m.participation(1)]
            rows.append(
                relative(f"rotating beam, {what}", f"speed {speed:g}", "Hz", exact / TURN, min(collective) / TURN, 0.5)
            )
    return rows


def _static(turbine: Turbine) -> list[Check]:
    """Tip deflection of blades under gravity."""
    light = 2e-4  # so small a load that second-order effects vanish
    options = ModelOptions(
        flap_modes=4, edge_modes=4, torsion_modes=0, blade_nodes=40, locked=("tower", "yaw", "drivetrain", "generator")
    )
    model = build(uniform_blade(turbine), options, Environment(gravity=light))
    case = vacuum_case(model)
    case["q"][model.coordinates.index("generator")] = 0.5 * np.pi
    equilibrium(case, np.flatnonzero(model.locked == 0.0))
    case.evaluate(0.0)
    case.loads(0.0)
    root = case.view("root")
    deflection = -MASS * light * LENGTH**4 / (8.0 * EDGE)  # y points up there
    moment = MASS * light * LENGTH * 0.5 * LENGTH
    where = "horizontal blade, own weight"
    return [
        relative("static tip deflection", where, "m", deflection, float(root["tip"][1, 0]), 0.1),
        relative("root moment", where, "N m", moment, abs(float(root["moment"][0, 0])), 0.1),
    ]


def _inertia(turbine: Turbine) -> Check:
    """Rigid rotor and generator under a constant torque."""
    options = ModelOptions(torsion_modes=0, locked=("tower", "yaw", "drivetrain", "blades"))
    model = build(turbine, options)
    torque = 1e6
    ratio, s, h = turbine.drivetrain.gear_ratio, turbine.blade.structure, turbine.hub
    mass = s.mass
    assert mass is not None

    def piece(x: float) -> float:
        r = h.radius + x
        return float(np.interp(x, s.position, mass)) * (r * np.cos(h.precone)) ** 2

    blade = quad(piece, 0.0, s.position[-1], limit=400, points=s.position[1:-1])[0]
    exact = 3.0 * blade + h.inertia + turbine.drivetrain.generator_inertia * ratio**2
    case = vacuum_case(model)
    case.clock.array[:] = 0
    Start(generator_torque=-torque / ratio).put(case)
    case.evaluate(0.0)
    acceleration = case["a"][model.coordinates.index("generator")]
    return relative("rigid rotor inertia", "with generator", "kg m^2", exact, torque / float(acceleration), 0.5)


def _one_blade(turbine: Turbine) -> tuple[BladedModel, float, float]:
    """A rigid rotor with one blade, a pendulum; its moment m g d and its inertia."""
    options = ModelOptions(
        torsion_modes=0, locked=("tower", "yaw", "drivetrain", "blades"), time_step=0.005, blade_nodes=40
    )
    straight = turbine.replace(**{"nacelle.tilt": 0.0, "hub.precone": 0.0})
    model = build(straight, options).with_parameters(**{"aerodynamics.air_density": 0.0})
    nodes = model.rotor.blade_nodes.copy()
    for name in ("mass", "moment_x", "moment_y", "moment_z"):
        nodes[BladeNode.index(name), 1:] = 0.0
    nodes[BladeNode.index("inertia_xx") :, 1:] = 0.0
    s, h = turbine.blade.structure, turbine.hub
    assert s.mass is not None
    x = np.linspace(0.0, s.position[-1], 200001)
    m = np.interp(x, s.position, s.mass)
    moment = np.trapezoid(m * (h.radius + x), x) * model.environment.gravity
    inertia = np.trapezoid(m * (h.radius + x) ** 2, x) + h.inertia
    inertia += turbine.drivetrain.generator_inertia * turbine.drivetrain.gear_ratio**2
    return model.with_arrays(blade_nodes=nodes), float(moment), float(inertia)


def _pendulum(turbine: Turbine) -> list[Check]:
    model, moment, inertia = _one_blade(turbine)
    case = vacuum_case(model)
    horizontal = Start(coordinates={"generator": 0.5 * np.pi})
    horizontal.put(case)
    case.evaluate(0.0)
    fall = float(case["a"][model.coordinates.index("generator")])
    rows = [relative("free fall of one blade, acceleration", "horizontal", "rad/s^2", moment / inertia, fall, 0.5)]
    amplitude = np.radians(60.0)
    begin = Start(coordinates={"generator": np.pi - amplitude})
    swing: dict[str, Any] = {"controller": ConstantController(), "channels": ["azimuth"], "output_step": 0.005}
    result = simulate(model, CALM, duration=60.0, start=begin, **swing)
    hanging = np.sin(result["azimuth"])  # zero when the blade hangs down; falls when it swings on
    at = np.flatnonzero((hanging[:-1] > 0.0) & (hanging[1:] <= 0.0))
    crossings = result.time[at] + 0.005 * hanging[at] / (hanging[at] - hanging[at + 1])
    period = float(np.mean(np.diff(crossings)))
    exact = 4.0 * np.sqrt(inertia / moment) * float(ellipk(np.sin(0.5 * amplitude) ** 2))
    rows.append(relative("pendulum of one blade, period", "60 deg", "s", exact, period, 0.5))
    return rows


def _energy(turbine: Turbine, name: str, options: ModelOptions, elastic_band: float | None = None) -> list[Check]:
    """100 revolutions of the flexible machine, vibrating, without air, damping and drive."""
    free = turbine.replace(
        **{
            "blade.structure.damping": NO_DAMPING,
            "tower.damping": NO_DAMPING,
            "drivetrain.damping": 0.0,
            "yaw.damping": 0.0,
        }
    )
    start = Start(
        rotor_speed=SPEED, coordinates={"tower 1st fore-aft": 0.3, "blade 1 1st flap": 1.0, "blade 2 1st edge": 0.3}
    )
    model = build(free, options).with_parameters(**{"aerodynamics.air_density": 0.0})
    duration = round(100 * TURN / SPEED)
    law = ConstantController()
    run = Simulation(Run(model, CALM, duration=duration, controller=law, start=start, channels=["azimuth"]))
    probe, energies = Case(model, CALM), []
    run.advance(1)
    while True:
        probe["q"][:], probe["v"][:] = run.motion()
        energies.append(mechanical_energy(probe))
        if run.finished:
            break
        run.advance(37)
    kinetic, elastic, _ = np.array(energies).T
    total = np.array(energies).sum(axis=1)
    drift = float(total[-20:].mean() - total[:20].mean())
    exchanged = float(np.ptp(elastic))
    return [
        relative("energy after 100 revolutions", name, "J", kinetic[0], kinetic[0] + drift, 0.1),
        relative("the same, of the elastic energy's range", name, "J", exchanged, exchanged + drift, elastic_band),
    ]


def energy_to_the_last_digit() -> CheckTable:
    """Energy with half the time step and corrected velocities: the remaining error does not stem from the step."""
    options = ModelOptions(time_step=0.005, advanced=AdvancedOptions(corrections=1))
    rows = _energy(load_turbine("nrel5mw"), "half step, corrected velocity", options, 0.5)
    return CheckTable("energy", "Energy with a finer step", "closed form", rows)
