"""The NREL 5 MW turbine with a vortex wake: rigid, 12.1 rpm, no pitch. Start, and convergence of the defaults."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import ModelOptions, Start, SteadyWind, Turbine
from meltemi.control import ConstantController
from meltemi.simulation.case import Case
from meltemi.simulation.step import settle_induction

pytestmark = pytest.mark.long  # machine code of a turbine with a vortex wake
SPEED = 12.1 * np.pi / 30.0
PERIOD = 2.0 * np.pi / SPEED
SWEEPS, SETTLED = 60, 20
"""Sweeps of the developed wake, and after how many of them power is averaged: it wanders by some 0.2 %."""


def model(turbine: Turbine, nodes: int = 20, wake: str = "hybrid", **vortices: Any) -> Any:
    """The turbine in uniform wind without its tower's influence and dynamic stall."""
    options = ModelOptions(
        tower_influence="none",
        stall="static",
        locked=("tower", "yaw", "generator", "drivetrain", "blades"),
        blade_nodes=nodes,
        wake=wake,
        vortices=vortices,
        time_step=PERIOD / 288.0,
    )
    return meltemi.build(turbine, options)


@cache
def developed(turbine: Turbine, speed: float, nodes: int = 20, **vortices: float) -> tuple[float, float]:
    """(C_T, C_P) of the developed wake that runs begin with, averaged over sweeps."""
    case = Case(built := model(turbine, nodes, **vortices), SteadyWind(speed=speed, shear_exponent=0.0))
    Start(rotor_speed=SPEED, coordinates={}).set(case)
    case.evaluate(0.0)
    rotor, found = case.view("rotor"), []
    for _ in range(SWEEPS):
        settle_induction(case.system)
        case.evaluate(0.0)
        found.append((float(rotor["thrust"]), float(rotor["torque"]) * SPEED / speed))
    force = 0.5 * built.environment.density * np.pi * turbine.rotor_radius**2 * speed**2
    thrust, power = np.mean(found[SETTLED:], axis=0) / force
    return float(thrust), float(power)


@pytest.mark.parametrize("wake", ["hybrid", "free"])
def test_runs_begin_with_a_developed_wake(turbine: Turbine, wake: str) -> None:
    """Over the first 10 s thrust, averaged over thirds of a revolution, changes by less than 1 %."""
    result = meltemi.simulate(
        model(turbine, wake=wake),
        SteadyWind(speed=10.0, shear_exponent=0.0),
        duration=2.0 * PERIOD,
        controller=ConstantController(),
        start=Start(rotor_speed=SPEED, coordinates={}),
        channels=("rotor_aero_thrust",),
        output_step=PERIOD / 36.0,
    )
    thrust = np.asarray(result["rotor_aero_thrust"])[:72].reshape(6, 12).mean(axis=1)
    assert np.ptp(thrust) < 0.01 * thrust.mean()


@pytest.mark.parametrize(
    ("vortices", "power"),
    [
        ({"nodes": 40}, 0.013),  # the wake, not the line: 0.25 % after 20 revolutions of a run
        ({"azimuth_step": np.radians(5.0)}, 0.006),
        ({"lattice": 1.0}, 0.006),
        ({"free": 8.0}, 0.012),
        ({"length": 40.0}, 0.004),
        ({"blade_core": 0.05}, 0.002),
        ({"wake_core": 0.3}, 0.006),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)
def test_the_defaults_are_converged(turbine: Turbine, vortices: dict[str, Any], power: float) -> None:
    """One option at a time twice as fine changes power and thrust little."""
    usual, fine = developed(turbine, 12.0), developed(turbine, 12.0, **vortices)
    assert fine[1] == pytest.approx(usual[1], rel=power)
    assert fine[0] == pytest.approx(usual[0], rel=0.6 * power)


def test_coarse_discretisations_raise_power(turbine: Turbine) -> None:
    """What coarse rows and large cores leave out: some of the induced velocity."""
    usual = developed(turbine, 12.0)[1]
    for vortices in ({"azimuth_step": np.radians(20.0)}, {"blade_core": 0.6}):
        assert developed(turbine, 12.0, **vortices)[1] > 1.005 * usual
