"""The NREL 5 MW turbine with a vortex wake beside OpenFAST 5.0's OLAF: circulation, yaw, a pitch step.

OLAF's power is some 5 % high with the settings of its guidelines: cores of 0.6 elements give 3 %, loads at nodes to
which velocities are extrapolated 1.7 % (docs/verification/vortices.md). So distributions, harmonics and changes are
compared.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import ModelOptions, Start, SteadyWind, Turbine
from meltemi.control import ConstantController, Controller
from meltemi.simulation.case import Case

FOLDER = Path(__file__).parents[3] / "shared" / "reference" / "olaf"
pytestmark = [
    pytest.mark.long,  # machine code of a turbine with a vortex wake
    pytest.mark.skipif(not FOLDER.is_dir(), reason="needs the reference folder beside the repository"),
]
SPEED = 12.1 * np.pi / 30.0
PERIOD = 2.0 * np.pi / SPEED
NODES = np.array([10.25, 14.35, 18.45, 22.55, 26.65, 30.75, 34.85, 38.95, 43.05, 47.15, 51.25, 54.6667, 57.4, 60.1333])
"""[m] from the root: AeroDyn's nodes 5 to 18 of the deck."""
Float = NDArray[np.float64]


def olaf(name: str) -> dict[str, Float]:
    """Channels of a run of OpenFAST."""
    with np.load(FOLDER / f"{name}.npz") as file:
        return {str(c): file["data"][:, i].astype(float) for i, c in enumerate(file["channels"])}


def model(turbine: Turbine, wake: str, **others: Any) -> Any:
    """The rigid turbine as there: without tower influence and dynamic stall, at 12.1 rpm."""
    locked = ("tower", "yaw", "generator", "drivetrain", "blades")
    options = ModelOptions(
        tower_influence="none",
        tower_drag=False,
        stall="static",
        locked=locked,
        wake=wake,
        time_step=PERIOD / 504,
        **others,
    )
    return meltemi.build(turbine, options)


def run(turbine: Turbine, wake: str, speed: float, duration: float, controller: Any = None, **others: Any) -> Any:
    """A run in uniform wind."""
    return meltemi.simulate(
        model(turbine, wake, **others),
        SteadyWind(speed=speed, shear_exponent=0.0),
        duration=duration,
        controller=controller or ConstantController(),
        start=Start(rotor_speed=SPEED, coordinates={}),
        output_step=PERIOD / 72,
    )


def harmonics(azimuth: Float, moment: Float) -> Float:
    """Mean, sine and cosine over the azimuth [rad]."""
    terms = np.stack([np.ones_like(azimuth), np.sin(azimuth), np.cos(azimuth)], axis=1)
    found: Float = np.linalg.lstsq(terms, moment, rcond=None)[0]
    return found


def test_distribution_of_circulation(turbine: Turbine) -> None:
    """At 12 m/s, from 0.3 R to 0.9 R over its mean: within 3 % at each node, 1.2 % on average."""
    case = Case(built := model(turbine, "hybrid"), SteadyWind(speed=12.0, shear_exponent=0.0))
    Start(rotor_speed=SPEED, coordinates={}).set(case)
    case.begin_parts()
    radius = built.rotor.blade_layout.position
    ours = np.interp(NODES, radius, case.view("bound")["circulation"][0])
    theirs = olaf("rigid_12")
    last = theirs["Time"] > theirs["Time"][-1] - PERIOD
    theirs_mean = np.array([theirs[f"AB1N{n:03d}Gam"][last].mean() for n in range(5, 19)])
    inner = (NODES + 1.5 > 0.3 * 63.0) & (NODES + 1.5 < 0.9 * 63.0)
    ratio = (ours / ours[inner].mean() / (theirs_mean / theirs_mean[inner].mean()))[inner]
    assert np.abs(ratio - 1.0).max() < 0.03
    assert np.abs(ratio - 1.0).mean() < 0.012


@pytest.mark.parametrize(("wake", "share"), [("free", 0.01), ("hybrid", 0.015)])
def test_moment_over_the_azimuth_in_yaw(turbine: Turbine, wake: str, share: float) -> None:
    """At 10 m/s, 20 degrees: what varies over the azimuth, over the mean. Momentum's sine is 5 % off."""
    theirs = olaf("yaw20_10")
    last = theirs["Time"] > theirs["Time"][-1] - 5.0 * PERIOD
    expected = harmonics(np.radians(theirs["Azimuth"][last]), theirs["RootMyb1"][last])
    result = run(turbine, wake, 10.0, 40.0, nacelle_yaw=np.radians(20.0))
    last = result.time > result.time[-1] - 5.0 * PERIOD
    azimuth, moment = np.asarray(result["azimuth"])[last], np.asarray(result["root_moment_out_of_plane_1"])[last] / 1e3
    found = harmonics(azimuth, moment)
    psi = np.linspace(0.0, 2.0 * np.pi, 72)
    deviation = (found[1] - expected[1]) * np.sin(psi) + (found[2] - expected[2]) * np.cos(psi)
    assert np.abs(deviation).max() < share * expected[0]
    assert found[1] == pytest.approx(expected[1], abs=100.0)


@pytest.mark.parametrize("wake", ["hybrid", "free"])
def test_pitch_step(turbine: Turbine, wake: str) -> None:
    """At 10 m/s, 0 to 3 degrees within 0.5 s: what thrust and torque undershoot. Momentum's is half as much again."""
    theirs = olaf("step_10")
    result = run(turbine, wake, 10.0, 70.0, Controller(update=step, name="pitch step", uses_loads=False))
    for ours, name in (("rotor_aero_thrust", "RtFldFxh"), ("rotor_aero_torque", "RtFldMxh")):
        expected = undershoot(theirs["Time"], theirs[name])
        assert undershoot(result.time, np.asarray(result[ours])) == pytest.approx(expected, rel=0.06)


def step(state: Any, measured: Any, demands: Any, dt: float) -> None:
    """Law of the pitch: the step at 45 s."""
    for b in range(3):
        demands.pitch[b] = np.radians(3.0) * min(max((measured.time - 45.0) / 0.5, 0.0), 1.0)


def undershoot(time: Float, value: Float) -> float:
    """Value at the end less the lowest one after the step."""
    return float(value[time > 65.0].mean() - value[(time > 45.4) & (time < 50.0)].min())
