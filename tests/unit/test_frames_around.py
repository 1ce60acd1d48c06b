"""What users touch around a frame: summary page, view, channels, load base, decks' outputs, messages."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Run, SteadyWind, load_turbine, simulate
from meltemi.cases.case import LoadCase
from meltemi.environment import IrregularSea
from meltemi.exchange.openfast.outlist import _available
from meltemi.frames.finite_elements import assemble
from meltemi.frames.loads import Derived
from meltemi.frames.reduction import tower_base
from meltemi.gradients.adjoint import gradient
from meltemi.gradients.sensitivity import finite_difference_runs, sensitivity
from meltemi.gradients.weights import std_weights
from meltemi.io import export_fmu
from meltemi.learning.gym import TurbineEnv
from meltemi.loads.loadbase.axes import axes_of
from meltemi.loads.loadbase.interfaces import interfaces_of, recorded
from meltemi.reports.frame_overview import frame_blocks, words_on_ends
from meltemi.reports.turbine_facts import frame_masses
from meltemi.simulation.channels import Channel, catalogue, find
from meltemi.simulation.model import Model
from meltemi.simulation.plan import model_channels
from meltemi.simulation.result import Result
from meltemi.simulation.simulate import Simulation
from meltemi.turbine.definition import Turbine
from meltemi.view.utilisation import with_utilisation

LEG = "member_A1_A2_middle_force_z"


@pytest.fixture(scope="module")
def jacket() -> Turbine:
    return load_turbine("nrel5mw-jacket")


@cache
def model() -> Model[Any]:
    return meltemi.build(load_turbine("nrel5mw-jacket"))


@pytest.mark.slow
def test_the_summary_page_has_modes_masses_and_stiffness(jacket: Turbine) -> None:
    assert jacket.frame is not None
    assembly = assemble(jacket.frame, tower_base(jacket.frame, jacket.tower))
    steel = frame_masses(assembly)["steel"]
    total = np.tile([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], len(assembly.points))
    assert sum(frame_masses(assembly).values()) == pytest.approx(total @ (assembly.mass @ total), rel=1e-9)
    blocks: Any = frame_blocks(jacket, model().rotor.tower)
    picture, masses, frequencies, stiffness, ends = blocks
    assert masses.rows[0] == ["steel", f"{1e-3 * steel:.1f}"] and len(picture.png) > 20000
    assert float(frequencies.rows[0][1]) < float(frequencies.rows[0][2])
    assert [row[0] for row in stiffness.rows] == ["x", "y", "z", "about x", "about y", "about z"]
    assert ends == "Ends of members at joints: drag 0, added mass 0, pressure 1."


@pytest.mark.slow
def test_the_summary_page_of_a_floater_has_its_modes_afloat() -> None:
    turbine = load_turbine("iea15mw-volturnus-flexible")
    tower = meltemi.build(turbine).rotor.tower
    blocks: Any = frame_blocks(turbine, tower)
    picture, masses, frequencies, stiffness, _ = blocks
    assert sum(float(row[1]) for row in masses.rows) == pytest.approx(17839.0, rel=2e-3) and len(picture.png) > 20000
    assert frequencies.rows[0][0] == "1st fore-aft" and len(frequencies.rows) == len(tower.below)
    assert float(frequencies.rows[0][1]) == pytest.approx(0.428, rel=0.01)  # weight of tower and rotor lowers it
    assert "over joint main_water" in stiffness.caption


def test_ends_that_act_as_plates_are_reported(jacket: Turbine) -> None:
    assert jacket.frame is not None
    frame = jacket.frame.replace(ends=jacket.frame.ends.replace(drag=1.0))
    words = words_on_ends(assemble(frame, tower_base(frame, jacket.tower)))
    assert "drag 1, added mass 0" in words and "joints where members meet" in words
    free = frame.replace(ends=jacket.frame.ends, other_ends={"footA": frame.ends})
    words = words_on_ends(assemble(free, tower_base(free, jacket.tower)))
    assert "others at 1 joints" in words and "plates" not in words


def test_a_load_base_has_the_loads_of_the_ground(jacket: Turbine) -> None:
    names = [interface.name for interface in interfaces_of(jacket)]
    assert names[-1] == "mudline" and not any(name.startswith("pile") for name in names)
    assert "wave_elevation" in recorded(jacket, interfaces_of(jacket))
    assert axes_of("mudline", jacket).origin == "tower axis at the mudline"


def test_outputs_of_decks_are_those_of_a_turbine_in_the_sea(jacket: Turbine) -> None:
    assert find("ReactMYss", _available(jacket, 0, 0)).name == "mudline_reaction_moment_y"
    with pytest.raises(InputError):
        find("ReactMYss", _available(load_turbine("nrel5mw"), 0, 0))


def test_wrong_names_of_members_give_the_closest_ones(jacket: Turbine) -> None:
    with pytest.raises(InputError, match="did you mean member_A1_A2_middle_force_z"):
        find("member_A1_A22_middle_force_z", model_channels(model()))
    with pytest.raises(InputError, match="section loads of members are those of runs of a turbine on a frame"):
        find(LEG, catalogue())


@pytest.mark.slow
def test_patterns_select_channels() -> None:
    run = Run(model(), SteadyWind(speed=8.0), duration=0.1, channels=["member_A1_A2_*", "wave_elevation"])
    names = Simulation(run).result().names
    assert len(names) == 22 and LEG in names
    with pytest.raises(InputError, match="no channel is called 'member_Z\\*'"):
        Simulation(replace(run, channels=["member_Z*"]))


def test_derived_channels_do_not_depend_on_the_number_of_samples_at_a_time() -> None:
    random = np.random.default_rng(3)
    channels = [Channel(f"c{i}", "", "N", "", "", "", ("q", "c"), (i,)) for i in range(411)]
    sources = [Channel(f"s{i}", "", "-", "", "", "", ("q", "s"), (i,)) for i in range(300)]
    some = Derived(channels[1:], sources, random.normal(size=(300, 410)))
    run: Any = SimpleNamespace(channels=channels, derived=[some])
    run.derivations = partial(Simulation.derivations, run)
    samples = random.normal(size=(300, 711))
    whole = samples.copy()
    Simulation.derive(run, whole)
    np.testing.assert_allclose(whole[:, 1:411], samples[:, 411:] @ some.matrix, rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(whole[:, [0, *range(411, 711)]], samples[:, [0, *range(411, 711)]])
    for size in (7, 33, 130):
        parts = samples.copy()
        for first in range(0, 300, size):
            Simulation.derive(run, parts[first : first + size])
        np.testing.assert_array_equal(parts, whole)


@pytest.mark.long  # machine code of derivatives
def test_section_loads_have_derivatives() -> None:
    sea, gain = IrregularSea(height=4.0, period=9.0), "controller.proportional_gain"
    run = Run(model(), SteadyWind(speed=14.0), duration=2.0, sea=sea, channels=[LEG, "wave_elevation"])
    found = sensitivity(run, [gain])
    low, high, step = finite_difference_runs(run, gain)
    slope = float((high[LEG].mean() - low[LEG].mean()) / (2.0 * step))
    assert found.mean(LEG)[1] == pytest.approx([slope], rel=3e-4) and abs(slope) > 0.0
    with pytest.raises(InputError, match=r"'turbine.frame.piece' changes tables of the substructure or of the water"):
        sensitivity(run, ["turbine.frame.piece"])

    def deviation(result: Result) -> tuple[float, dict[str, Any]]:
        value, weights = std_weights(result[LEG])
        return value, {LEG: weights}

    back = gradient(run, deviation, [gain])
    value, by = found.std(LEG)
    assert back.value == pytest.approx(value) and back.slopes == pytest.approx(by, rel=1e-6)


@pytest.mark.slow
def test_section_loads_are_results_of_episodes_and_no_outputs_of_units(tmp_path: Path) -> None:
    env = TurbineEnv(turbine="nrel5mw-jacket", wind_speeds=(13.0, 14.0), duration=2.0, channels=(LEG,))
    env.reset(seed=1)
    env.step(np.zeros(2))
    axial = env.result()[LEG]
    assert axial.min() < -1e6 and np.isfinite(axial).all()
    env.close()
    case = LoadCase(turbine="nrel5mw-jacket", wind={"kind": "steady", "speed": 12.0}, duration=1.0, channels=(LEG,))
    with pytest.raises(InputError, match=f"channels: '{LEG}' is computed after the time loop, and no output of a unit"):
        export_fmu(case, tmp_path / "jacket.fmu")


@pytest.mark.slow
def test_section_loads_have_no_value_at_an_instant() -> None:
    point = meltemi.analysis.operating_point(model(), SteadyWind(speed=8.0))
    assert point["mudline_reaction_moment_y"] < 0.0
    with pytest.raises(InputError, match="section loads of members are those of runs"):
        point[LEG]
    with pytest.raises(InputError, match=f"linearise: '{LEG}' is computed after the time loop"):
        meltemi.analysis.linearise(model(), point, outputs=[LEG])


@pytest.mark.slow
def test_the_view_colours_members_by_utilisation(jacket: Turbine) -> None:
    sea = IrregularSea(height=4.0, period=9.0)
    run = simulate(
        model(), SteadyWind(speed=12.0), duration=1.0, sea=sea, view=True, channels=["member_A1_A2_*", "member_A2_A3_*"]
    )
    assert run.scene is not None and jacket.frame is not None
    scene, words = with_utilisation(run.scene, run)
    water = scene.about["turbine"]["water"]
    known = {name for name, use in zip(jacket.frame.members, water["utilisation"], strict=True) if use is not None}
    assert known == {"A1_A2", "A2_A3"} and "frame" not in water and "NORSOK N-004" in words
    assert 0.0 < max(use or 0.0 for use in water["utilisation"]) < 1.0
    none, words = with_utilisation(run.scene, replace(run, data=run.data[:, :0], channels=()))
    assert words == "" and set(none.about["turbine"]["water"]["utilisation"]) == {None}


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"frame.feet": ()}, "the frame has no feet, and the turbine does not float on a platform; give it either"),
        ({"support": load_turbine("nrel5mw-monopile").support}, "a tower stands on a frame or a support; remove one"),
        ({"frame.depth": 60.0}, "joint 'footA' is 10 m above the sea bed, at a depth of 60 m; feet stand on it"),
    ],
)
def test_a_tower_stands_on_one_thing_on_the_bed(jacket: Turbine, change: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        jacket.replace(**change)
