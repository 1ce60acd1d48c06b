"""The wake of the tower, and a rotor downwind of it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import meltemi
from meltemi.aero.tower_flow import eames, powles


def test_the_wakes_in_closed_form() -> None:
    """Deficit on the axis, its width, and the momentum of Eames' wake at any distance."""
    assert powles.deficit(4.0, 0.0, 0.9) == pytest.approx(0.9 / 2.0)
    assert powles.deficit(4.0, 2.2, 0.9) == 0.0
    assert powles.deficit(-4.0, 0.0, 0.9) == eames.deficit(-4.0, 0.0, 0.9) == 0.0
    y = np.linspace(-12.0, 12.0, 4001)
    for x in (2.0, 6.0, 12.0):
        momentum = np.trapezoid([eames.deficit(x, float(v), 0.9) for v in y], y)
        assert momentum == pytest.approx(0.9, rel=1e-6)


def downwind(turbine: meltemi.turbine.Turbine) -> meltemi.turbine.Turbine:
    """The turbine with its rotor behind the tower, coned and tilted away from it."""
    n = turbine.nacelle
    turned = {"nacelle.overhang": -n.overhang, "nacelle.tilt": -n.tilt, "hub.precone": -turbine.hub.precone}
    x, y, z = n.mass_centre
    return turbine.replace(**turned, **{"nacelle.mass_centre": (-x, y, z)})


@pytest.fixture(scope="module")
def passes(turbine: meltemi.turbine.Turbine) -> dict[str, meltemi.Result]:
    """One revolution downwind of the tower, without and with its wake."""
    channels = ("azimuth", "node_14_alpha_1", "RootMyc1", "tip_clearance_1", "rotor_aero_thrust")
    wind = meltemi.SteadyWind(speed=10.0)
    found = {}
    for name in ("none", "powles", "eames"):
        options = meltemi.ModelOptions(tower_influence=name, locked=("tower", "yaw", "drivetrain", "generator"))
        model = meltemi.build(downwind(turbine), options)
        found[name] = meltemi.simulate(model, wind, duration=12.0, channels=channels)
    return found


@pytest.mark.slow
def test_the_wake_is_passed_once_a_revolution(passes: dict[str, meltemi.Result]) -> None:
    azimuth = np.mod(passes["none"]["azimuth"], 2.0 * math.pi)
    late = passes["none"].time > 6.0
    down = late & (np.abs(azimuth - math.pi) < 0.1)
    for name in ("powles", "eames"):
        change = passes[name]["node_14_alpha_1"] - passes["none"]["node_14_alpha_1"]
        assert change[down].min() < -0.03  # the wind is lower in the wake
        up = late & (np.cos(azimuth) > 0.5)
        assert np.abs(change[up]).max() < 0.01
        assert np.ptp(passes[name]["RootMyc1"][late]) > 1.1 * np.ptp(passes["none"]["RootMyc1"][late])


def test_a_rotor_downwind_of_the_tower_runs(passes: dict[str, meltemi.Result]) -> None:
    """Blades bend away from the tower: more clearance than upwind; the thrust is that of the upwind rotor."""
    run = passes["none"]
    assert run.status.complete
    assert run["tip_clearance_1"].min() > 5.0
    assert run["rotor_aero_thrust"][-1] == pytest.approx(6.4e5, rel=0.1)
