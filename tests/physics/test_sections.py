"""Angle of the chord and rotation of blade sections, against exact geometry and thin aerofoil theory."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import meltemi
from meltemi import ModelOptions, Start, SteadyWind, Turbine
from meltemi.aero.tables import AERO_NODE, FLOW
from meltemi.core.tables import View
from meltemi.simulation.case import Case

Float = NDArray[np.float64]


def bent(turbine: Turbine, size: float, **options: Any) -> tuple[View, Float, Case]:
    """Flow, rotation vectors of the nodes of blade 1 (3, n), and the case of a blade bent and twisted by ``size``."""
    model = meltemi.build(turbine, ModelOptions(flap_modes=1, edge_modes=1, torsion_modes=1, **options))
    case = Case(model, SteadyWind(speed=8.0))
    shape = {"blade 1 1st flap": 8.0 * size, "blade 1 1st edge": 6.0 * size, "blade 1 1st torsion": size}
    Start(rotor_speed=1.0, pitch=0.2, coordinates=shape).put(case)
    case.evaluate(0.0)
    return View(FLOW, case["flow"]), case.view("motion")["rotation"][:, 0], case


def exact_angle(flow: View, theta: Float, pitch: float, twist: Float) -> Float:
    """Angle of the section's chord in its own plane, from the rotation of the section, towards feather."""
    found = np.empty(theta.shape[1])
    unpitched = Rotation.from_euler("z", -pitch)
    for n in range(theta.shape[1]):
        section = unpitched * Rotation.from_rotvec(theta[:, n]) * Rotation.from_euler("z", -twist[n])
        bend = np.arctan2(flow["sin_bend"][0, n], flow["cos_bend"][0, n])
        x, y, _ = (Rotation.from_euler("y", bend).inv() * section).as_matrix().T
        # the chord y and its normal x, seen from the strip's axes
        found[n] = 0.5 * (np.arctan2(y[0], y[1]) + np.arctan2(-x[1], x[0]))
    return found


@pytest.mark.parametrize(("chord_angle", "order"), [("section", 3.0), ("openfast", 2.0)])
def test_angle_of_the_chord_is_that_in_the_plane_of_the_section(
    turbine: Turbine, chord_angle: str, order: float
) -> None:
    error = []
    for size in (0.2, 0.1):
        flow, theta, case = bent(turbine, size, chord_angle=chord_angle)
        twist = View(AERO_NODE, case.model.aero_nodes)["twist"][0]
        error.append(np.abs(flow["theta"][0] - exact_angle(flow, theta, 0.2, twist)).max())
    assert np.log2(error[0] / error[1]) == pytest.approx(order, abs=0.4)


def test_a_bent_blade_turns_about_its_span_but_does_not_pitch(turbine: Turbine) -> None:
    flow, _, case = bent(turbine, 0.2)
    slope = np.arctan2(flow["sin_bend"][0], flow["cos_bend"][0]) - turbine.hub.precone
    np.testing.assert_allclose(flow["rotation"][0], np.sin(slope), atol=1e-12)  # at 1 rad/s
    assert np.all(flow["pitching"][0] == 0.0)
    case["pitch"][1] = 0.1  # rad/s towards feather is nose down
    case.evaluate(0.0)
    np.testing.assert_allclose(flow["pitching"][0], -0.1 * flow["cos_bend"][0], atol=1e-12)


@pytest.mark.parametrize(("variant", "least", "most"), [("camber", 0.0, 1e-3), ("openfast", 3e-3, 1e-1)])
def test_momentum_balances_the_lift_in_curved_flow(turbine: Turbine, variant: Any, least: float, most: float) -> None:
    # a / (1 - a) = sigma' C_x / (4 F sin^2 phi) on a coned rotor in steady operation
    coned = turbine.replace(**{"hub.precone": -0.15, "nacelle.tilt": 0.0})
    options = ModelOptions(stall_rotation=variant, tower_influence="none", tip_loss=False, hub_loss=False)
    model = meltemi.build(coned, options.replace(locked=("blades", "tower", "drivetrain", "yaw")))
    case = Case(model, SteadyWind(speed=8.0))
    for _ in range(3):
        Start(rotor_speed=0.95).put(case)
    case.evaluate(0.0)
    flow, nodes = View(FLOW, case["flow"]), View(AERO_NODE, model.aero_nodes)
    middle = slice(8, 17)
    phi, a = flow["phi"][0, middle], flow["axial"][0, middle]
    sigma = (nodes["solid_length"] / flow["radius"])[0, middle]
    balanced = sigma * flow["lift"][0, middle] * np.cos(phi) / (4.0 * np.sin(phi) ** 2)
    error = np.abs(balanced / (a / (1.0 - a)) - 1.0).max()
    assert least <= error < most
