"""What users touch around a frame: summary page, view, channels, load base, decks' outputs, messages."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Run, SteadyWind, load_turbine, simulate
from meltemi.environment import IrregularSea
from meltemi.exchange.openfast.outlist import _available
from meltemi.frames.finite_elements import assemble
from meltemi.frames.reduction import tower_base
from meltemi.gradients.sensitivity import check_derived
from meltemi.loads.loadbase.axes import axes_of
from meltemi.loads.loadbase.interfaces import interfaces_of, recorded
from meltemi.reports.frame_overview import frame_blocks, words_on_ends
from meltemi.reports.turbine_facts import frame_masses
from meltemi.simulation.channels import catalogue, find
from meltemi.simulation.model import Model
from meltemi.simulation.plan import model_channels
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


@pytest.mark.slow
def test_derivatives_of_section_loads_are_refused() -> None:
    run = Run(model(), SteadyWind(speed=8.0), duration=0.1, channels=[LEG, "wave_elevation"])
    with pytest.raises(InputError, match=f"{LEG}: section loads of members are computed after the time loop"):
        check_derived(Simulation(run))
    check_derived(Simulation(replace(run, channels=["wave_elevation"])))


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
