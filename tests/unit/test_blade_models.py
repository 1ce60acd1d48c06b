"""Arrays that a structural model of the blades has beyond those of every turbine with blades."""

from __future__ import annotations

import sys
from dataclasses import replace
from types import ModuleType

import numba
import numpy as np
import pytest

from meltemi import ModelOptions, SteadyWind, build, load_turbine
from meltemi.compiler import Kind, RecordType
from meltemi.compiler.dispatch import Variants
from meltemi.simulation import system
from meltemi.simulation.bladed.rotor import BladedModel, with_blades
from meltemi.simulation.case import Case
from meltemi.structure.blades import blade_motion, collect_blades, node_load, tip_deflection
from meltemi.structure.tables import BladePartial, Structure


class System(system.System):
    turn: BladePartial


@pytest.fixture
def model(monkeypatch: pytest.MonkeyPatch) -> BladedModel:
    found = with_blades(build(load_turbine("nrel5mw"), ModelOptions(blade_nodes=6, tower_nodes=5)), "a test")
    module = ModuleType("turning")
    module.System = System  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "meltemi.simulation.blades.turning", module)
    turn = np.arange(3.0 * 4 * 3 * 6).reshape(12, 3, 6)
    other: dict[str, object] = {"blade_model": "turning", "blade_arrays": {"turn": turn}}
    return replace(found, rotor=replace(found.rotor, **other))  # type: ignore[arg-type]


@pytest.mark.parametrize("numbers", ["floats", "lanes", "duals"])
def test_each_case_has_its_copy(model: BladedModel, numbers: Kind) -> None:
    given = model.rotor.blade_arrays["turn"]
    one, two = (Case(model, SteadyWind(speed=10.0), numbers=numbers) for _ in range(2))
    for case in (one, two):
        assert type(case.system) is type(case.plain) is System
        np.testing.assert_array_equal(case["turn"], given)
        assert not np.shares_memory(case["turn"], given)
        lanes = numbers == "lanes" and not numba.config.DISABLE_JIT
        assert case.system.turn.array.shape[-1] == (8 if lanes else 6)
        assert ("turn" in case.slopes) == (numbers == "duals")
    assert not np.shares_memory(one["turn"], two["turn"])


@pytest.mark.parametrize("function", [blade_motion, collect_blades, tip_deflection, node_load])
def test_what_a_model_does_not_replace_is_that_of_the_modal_blade(function: Variants) -> None:  # type: ignore[type-arg]
    assert function.of(System) is function.of(Structure)
    with pytest.raises(TypeError, match="has no variant for AnySystem"):
        function.of(system.AnySystem)


def test_models_that_differ_in_the_blades_alone_have_different_hashes(model: BladedModel) -> None:
    changed = {"turn": model.rotor.blade_arrays["turn"] + 1.0}
    other = replace(model, rotor=replace(model.rotor, blade_arrays=changed))
    assert other.content_hash() != model.content_hash()


def test_types_of_kernels_tell_classes_of_one_name_apart() -> None:
    """Each blade model has a class ``System``: a cache that took one for the other would read its arrays wrongly."""
    here, there = (type("System", (system.System,), {"__module__": name}) for name in ("here", "there"))
    assert RecordType(here, "floats") != RecordType(there, "floats")
    assert str(RecordType(here, "floats")) != str(RecordType(there, "floats"))
