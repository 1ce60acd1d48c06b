"""Schemes by name: each gives a controller with the parts it says, for a turbine that has what it needs."""

from __future__ import annotations

from pathlib import Path

import pytest

import meltemi
from meltemi import Controller, InputError, Model, Turbine, build
from meltemi.analysis import design_controllers
from meltemi.controllers import schemes, tuning
from meltemi.controllers.names import FLAP_1P, FLAP_2P, PITCH_1P, PITCH_2P, SCHEMES, label
from meltemi.controllers.schemes import equipped


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Loops are tuned at one operating point."""
    monkeypatch.setattr(schemes, "linear_models", lambda model, progress=None: tuning.linear_models(model, [18.0]))


@pytest.fixture(scope="module")
def machine(turbine: Turbine) -> Model:
    return build(equipped(turbine.replace(**{"pitch_actuator.kind": "second_order"}), SCHEMES))


@pytest.mark.slow
def test_all_schemes_have_controllers(machine: Model) -> None:
    design = design_controllers(machine, list(SCHEMES))
    assert list(design.controllers) == list(SCHEMES)
    found = {(t.loop.actuator, t.loop.harmonic) for t in design.tunings.values()}
    assert found == {PITCH_1P, PITCH_2P, FLAP_1P, FLAP_2P}
    for name, scheme in SCHEMES.items():
        controller = design.controllers[name]
        assert isinstance(controller, Controller) and controller.name == name
        assert controller.uses_loads == bool(scheme.loops)
        assert len(scheme.loops) == len(set(scheme.loops))
        states = controller.state_names
        assert len([s for s in states if s.endswith("_harmonic")]) == len(scheme.loops)
    for name, tuned in design.tunings.items():
        loop = tuned.loop
        assert name.endswith(f": {loop.harmonic}P {loop.actuator}")
        assert (loop.integral_gain > 0.0) == (loop.actuator == "pitch")
    assert "ipc, feedback: 1P pitch" in design.tunings  # the same loops, tuned once


@pytest.mark.slow
def test_flaps_are_added_only_where_they_are_needed(turbine: Turbine) -> None:
    assert not equipped(turbine, ["cpc", "ipc", "own.py"]).blade.flaps
    flapped = equipped(turbine, ["cpc", "cpfc"])
    assert len(flapped.blade.flaps) == 1
    assert equipped(flapped, ["flaps"]) is flapped
    with pytest.raises(InputError, match="flap 1 is required"):
        design_controllers(build(turbine), ["flaps"])


def test_collective_pitch_with_an_ideal_actuator_needs_no_linear_model(
    model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(schemes, "linear_models", None)
    design = design_controllers(model, ["cpc", "feedforward"])
    assert list(design.controllers) == ["cpc", "feedforward"] and not design.tunings


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ([], "name at least one of baseline, supervised"),
        (["cpc", "cpcf"], "no controller 'cpcf': did you mean .*'cpfc'.*Valid are baseline, supervised, cpc, ipc"),
        (["cpc", "cpc"], "'cpc' is named twice"),
        (["none.py"], "none.py: no such file"),
    ],
)
def test_unknown_schemes_are_refused(model: Model, names: list[str], said: str) -> None:
    with pytest.raises(InputError, match=said):
        design_controllers(model, names)


def test_a_controller_of_ones_own_stands_beside_ours(model: Model, tmp_path: Path) -> None:
    path = tmp_path / "mine.py"
    path.write_text(
        "import meltemi\n\ndef controller(turbine):\n    return meltemi.control.BaselineController(turbine)\n"
    )
    design = design_controllers(model, ["cpc", str(path)])
    assert list(design.controllers) == ["cpc", "mine"] == ["cpc", label(str(path))]
    assert design.controllers["mine"].update is meltemi.control.BaselineController(model.turbine).update
