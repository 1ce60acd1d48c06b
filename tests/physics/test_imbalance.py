"""Unequal blades: centrifugal force of the excess mass, pitch offsets that the controller does not see."""

from __future__ import annotations

import numpy as np
import pytest

import meltemi
from meltemi import InputError, ModelOptions, Start, SteadyWind, Turbine
from meltemi.compiler import View
from meltemi.core.errors import UnsupportedError
from meltemi.structure.tables import BladeNode
from meltemi.turbine import Imbalance

RIGID = ("tower", "yaw", "generator", "drivetrain", "blades")


def test_the_force_of_a_heavy_blade_turns_with_it(turbine: Turbine) -> None:
    """A rigid rotor in vacuum and without gravity: excess times first moment of a blade times speed squared."""
    excess, speed = 0.01, 1.2
    model = meltemi.build(
        turbine.replace(imbalance=Imbalance(mass=(0.0, excess))), ModelOptions(locked=RIGID)
    ).with_parameters(**{"aerodynamics.air_density": 0.0, "structure.gravity": 0.0})
    nodes = View(BladeNode, model.rotor.blade_nodes)
    first = nodes["mass"][0] @ nodes["position"][2, 0] + nodes["moment"][2, 0].sum()
    result = meltemi.simulate(
        model,
        SteadyWind(speed=0.0),
        duration=6.0,
        controller=meltemi.control.ConstantController(),
        start=Start(rotor_speed=speed),
        channels=["shaft_rotating_force_y", "shaft_rotating_force_z"],
        output_step=0.1,
    )
    force = np.hypot(result["shaft_rotating_force_y"], result["shaft_rotating_force_z"])
    expected = excess * first * np.cos(turbine.hub.precone) * speed**2
    assert force == pytest.approx(expected, rel=1e-3)
    assert np.allclose(nodes["mass"][1], (1.0 + excess) * nodes["mass"][0], rtol=1e-14)


@pytest.mark.slow
def test_a_pitch_offset_turns_the_blade_and_not_its_encoder(turbine: Turbine) -> None:
    model = meltemi.build(turbine.replace(imbalance=Imbalance(pitch=(0.01, -0.01))))
    channels = ["pitch_1", "pitch_2", "pitch_3", "generator_power", "rotor_speed", "tower_base_moment_side_side"]
    runs = [
        meltemi.simulate(each, SteadyWind(speed=16.0), duration=60.0, channels=channels)
        for each in (model, meltemi.build(turbine))
    ]
    unequal, equal = runs
    assert unequal["pitch_1"] - unequal["pitch_3"] == pytest.approx(0.01, abs=1e-12)
    assert unequal["pitch_2"] - unequal["pitch_3"] == pytest.approx(-0.01, abs=1e-12)
    # it begins in equilibrium, holds its power, and shakes the tower once a revolution
    assert unequal["rotor_speed"] == pytest.approx(equal["rotor_speed"].mean(), rel=5e-3)
    last = unequal.time > 40.0
    assert unequal["generator_power"][last].mean() == pytest.approx(5e6, rel=5e-3)
    shakes = [np.ptp(run["tower_base_moment_side_side"][last]) for run in runs]
    assert shakes[0] > 2.0 * shakes[1]


def test_what_cannot_be_is_refused(turbine: Turbine, tmp_path_factory: pytest.TempPathFactory) -> None:
    with pytest.raises(InputError, match="lists 4 blades; the rotor has 3"):
        turbine.replace(imbalance={"pitch": [0.0, 0.0, 0.0, 0.1]})
    with pytest.raises(InputError, match=r"0.005 is 0.5 %"):
        turbine.replace(imbalance={"mass": [5.0]})
    with pytest.raises(InputError, match="in rad"):
        turbine.replace(imbalance={"pitch": [-90.0]})
    with pytest.raises(UnsupportedError, match="blades of one kind"):
        meltemi.io.write_openfast(turbine.replace(imbalance=Imbalance()), tmp_path_factory.mktemp("deck"))
