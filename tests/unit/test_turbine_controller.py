"""The controller that a turbine was designed with: ROSCO with its settings where the package is installed."""

from __future__ import annotations

from pathlib import Path

import pytest

import meltemi
from meltemi import InputError
from meltemi.controllers.schemes import located
from meltemi.controllers.specification import LibraryCase, digest, specification
from meltemi.exchange.deck_case import deck_case, deck_controller
from meltemi.exchange.report import ImportedModel
from meltemi.tuning import turbine_controller as module
from meltemi.tuning.turbine_controller import turbine_controller


@pytest.fixture
def own(turbine: meltemi.Turbine, tmp_path: Path) -> meltemi.Turbine:
    (tmp_path / "DISCON.IN").write_text("1 ! LoggingLevel\n")
    meltemi.io.write_turbine(turbine.replace(**{"control.discon": "DISCON.IN"}), tmp_path / "turbine.yaml")
    found = meltemi.load_turbine(tmp_path / "turbine.yaml")
    assert isinstance(found, meltemi.Turbine)
    return found


def test_settings_are_beside_the_turbine(own: meltemi.Turbine, tmp_path: Path) -> None:
    assert own.control.discon == str(tmp_path / "DISCON.IN")
    case = located(specification("rosco"), own)
    assert isinstance(case, LibraryCase) and case.input == str(tmp_path / "DISCON.IN")
    given = specification("rosco@other.IN")
    assert located(given, own) == given, "given settings come first"
    assert located(specification("ipc"), own) == specification("ipc")


def test_a_turbine_without_settings(turbine: meltemi.Turbine) -> None:
    assert turbine_controller(turbine, otherwise="supervised") == ("supervised", "")
    with pytest.raises(InputError, match=r"needs its settings for other: .* control\.discon"):
        located(specification("rosco"), turbine.replace(name="other"))


def test_with_and_without_the_package(own: meltemi.Turbine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "missing", lambda _: "")
    monkeypatch.setattr(module, "refused", lambda _: "it cannot read them")
    assert turbine_controller(own)[0] == "baseline" and "it cannot read them" in turbine_controller(own)[1]
    monkeypatch.setattr(module, "refused", lambda _: "")
    assert turbine_controller(own, otherwise="supervised")[0] == "rosco"
    monkeypatch.setattr(module, "missing", lambda _: "rosco, which is not installed: pip install rosco")
    name, note = turbine_controller(own, otherwise="supervised")
    assert name == "supervised"
    assert "controller supervised approximates its settings of ROSCO" in note and "pip install rosco" in note


def test_the_case_of_a_deck(own: meltemi.Turbine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """ROSCO is called as the deck calls its library."""
    deck = meltemi.io.Deck(
        own, (), library={"input": None, "step": 0.1, "procedure": "MINE", "individual_pitch": False}
    )
    monkeypatch.setattr(module, "missing", lambda _: "")
    monkeypatch.setattr(module, "refused", lambda _: "")
    case = deck_case(deck, "turbine.yaml", controller=deck_controller(deck)[0]).controller
    assert isinstance(case, LibraryCase)
    assert (case.library, case.input, case.procedure) == ("rosco", str(tmp_path / "DISCON.IN"), "MINE")
    assert (case.sample_time, case.individual_pitch) == (0.1, False)
    other = deck_case(
        deck, "turbine.yaml", controller={"kind": "bladed", "library": "x.so", "input": "x.in"}
    ).controller
    assert isinstance(other, LibraryCase) and (other.library, other.input) == ("x.so", "x.in")
    monkeypatch.setattr(module, "missing", lambda _: "rosco, which is not installed")
    keys, note = deck_controller(deck)
    assert deck_case(deck, "turbine.yaml", controller=keys).controller.kind == "baseline" and "not installed" in note
    assert deck_controller(ImportedModel(own.replace(**{"control.discon": None}), ())) == ({"kind": "baseline"}, "")


def test_changed_settings_are_other_results(
    own: meltemi.Turbine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("meltemi.controllers.specification.find_rosco", lambda: tmp_path / "turbine.yaml")
    before = digest(located(specification("rosco"), own))
    (tmp_path / "DISCON.IN").write_text("2 ! LoggingLevel\n")
    assert digest(located(specification("rosco"), own)) != before


@pytest.mark.rosco
def test_rosco_tells_which_settings_it_reads(own: meltemi.Turbine, rosco_cases: Path) -> None:
    good = own.replace(**{"control.discon": str(rosco_cases / "NREL-5MW" / "DISCON.IN")})
    assert turbine_controller(good)[0] == "rosco"
    name, note = turbine_controller(own, otherwise="supervised")
    assert name == "supervised" and "the installed ROSCO cannot begin with" in note
