"""Causes of what differs from OpenFAST on parked rotors."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from comparisons import reference_table
from comparisons.elastodyn_blade import elastodyn_model
from comparisons.measure import vibration
from comparisons.parked import EDGEWISE, deck_blades, run, settings
from meltemi.aero.tables import AeroNode
from meltemi.simulation.options import BEDDOES
from meltemi.turbine.library import load_turbine
from meltemi.verification.openfast_deck import deck_turbine

pytestmark = pytest.mark.slow

Float = NDArray[np.float64]
CASES = {s["case"]: s for s in settings()}


def integral(r: Float, f: Float, g: Float) -> float:
    """Of the product of two quantities that are linear between the nodes."""
    h = np.diff(r)
    return float(np.sum(h / 6.0 * (2.0 * f[:-1] * g[:-1] + f[:-1] * g[1:] + f[1:] * g[:-1] + 2.0 * f[1:] * g[1:])))


@pytest.mark.parametrize("case", ["locked 42.5 m/s 0 deg at 0 deg", "locked 42.5 m/s 0 deg at 60 deg"])
def test_loads_linear_between_the_nodes_explain_the_root_moments(case: str) -> None:
    s, model = CASES[case], deck_blades(CASES[case])
    r = model.turbine.blade.aerodynamics.position
    quantities = ("normal_force", "driving_force")
    names = [f"node_{n + 1}_{q}_1" for q in quantities for n in range(len(r))]
    moments = ("RootMxc1", "RootMyc1", "RootMzc1")
    found = run(s, model, [*moments, *names]).between(float(s["begin"]), np.inf)
    means = np.array([found[name].mean() for name in names])
    normal, driving = means.reshape(2, -1)
    centre = [model.rotor.aero_nodes[AeroNode.index(f"centre_{axis}")][0] for axis in "xy"]
    # at 90 deg of pitch the blade's x axis points along the driving force, its y axis downwind
    pairs = {
        "RootMxc1": ((driving, r),),
        "RootMyc1": ((normal, r),),
        "RootMzc1": ((centre[0], normal), (-centre[1], driving)),
    }
    for name in moments:
        (row,) = reference_table("parked", case=case, channel=name)
        deviation = float(row["mean"]) - found[name].mean()
        linear = sum(integral(r, f, g) - float(np.trapezoid(f * g, r)) for f, g in pairs[name])
        assert abs(deviation) > 100.0
        assert linear == pytest.approx(deviation, rel=0.06)


def test_limit_of_a_vibration_in_dynamic_stall_is_sensitive() -> None:
    """To rotation of the sections about the span, which ElastoDyn's blades do not have, and to 2 ms of lag."""
    s = CASES["idling 59.5 m/s -15 deg, dynamic stall"]
    turbine, found = deck_turbine(load_turbine("nrel5mw")), []
    for rotation, lag in (("openfast", 3.0), ("none", 3.0), ("none", 2.9)):
        constants = BEDDOES.replace(separation_lag=lag)
        model = elastodyn_model(turbine, s["set"], stall_constants=constants, **{"advanced.stall_rotation": rotation})
        result = run(s, model, [f"{EDGEWISE.channel}{b}" for b in (1, 2, 3)])
        found.append(vibration(result.time, result.data.T, EDGEWISE.band, (12.0, 24.0)))
    (row,) = reference_table("parked_vibration", case=s["case"])
    amplitude, damping = float(row["amplitude"]), float(row["damping"])
    assert found[0][2] > 1.07 * amplitude
    assert found[1][2] < 0.93 * amplitude
    assert found[2][2] == pytest.approx(amplitude, rel=0.005)
    assert found[2][1] == pytest.approx(damping, abs=2e-5)


def test_a_rotor_beside_an_equilibrium_depends_on_its_start() -> None:
    """A tenth of a degree of azimuth changes the mean moment by more than it deviates from OpenFAST's."""
    s = CASES["one blade at 0 deg 25 m/s"]
    means = []
    for azimuth in ("0", "0.1"):
        result = run(s | {"azimuth_deg": azimuth}, deck_blades(s), ["RootMxc1"])
        means.append(result.between(float(s["begin"]), np.inf)["RootMxc1"].mean())
    (row,) = reference_table("parked", case=s["case"], channel="RootMxc1")
    assert abs(means[1] - means[0]) > abs(means[0] - float(row["mean"]))


def test_vibration_of_a_known_signal() -> None:
    """Growing vibration that wanders from blade to blade, on top of a mean and of another mode."""
    t = np.arange(0.0, 60.0, 0.05)
    growth, frequency = 0.05, 1.05
    beat = 0.3 * t
    shares = np.stack([np.cos(beat), np.sin(beat) * np.cos(1.0), np.sin(beat) * np.sin(1.0)])
    x = 3.0 + np.exp(growth * t) * shares * np.sin(2.0 * np.pi * frequency * t) + 0.5 * np.sin(2.0 * np.pi * 0.4 * t)
    found, damping, amplitude = vibration(t, x, (0.85, 1.35), (20.0, 50.0))
    assert found == pytest.approx(frequency, rel=2e-3)
    assert damping == pytest.approx(-growth / (2.0 * np.pi * frequency), rel=0.02)
    late = (t >= t[-1] - 12.0) & (t <= t[-1] - 4.0)
    assert amplitude == pytest.approx(np.exp(growth * t[late]).mean(), rel=0.02)
