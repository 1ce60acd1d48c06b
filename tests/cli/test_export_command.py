"""``meltemi export``: a deck, what it has otherwise, errors in one line and nothing half-written."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest
from terminal import Command

import meltemi
from meltemi import Model, Turbine
from meltemi.exchange.openfast import read_deck
from meltemi.wind.fields import WindBox


def test_a_deck_is_written(command: Command, tmp_path: Path, turbine: Turbine) -> None:
    ran = command("export", "nrel5mw", "--wind-speed", 9, "--duration", 40, "--beamdyn", "--out", tmp_path / "deck")
    assert ran.status == 0 and ran.err == ""
    assert "1st flap mode of the blade" in ran.out and "the pitch is held" in ran.out
    assert ran.files[0] == tmp_path / "deck" / "nrel5mw.fst" and all(f.is_file() for f in ran.files)
    deck = read_deck(ran.files[0], control_of=turbine)
    assert deck.turbine.blade.structure.stiffness_matrix is not None  # of BeamDyn
    assert deck.wind == {"kind": "steady", "speed": 9.0, "shear_exponent": 0.0} and deck.duration == 40.0


@pytest.mark.parametrize("kind", ["steady", "file"])
def test_a_deck_starts_in_operation(
    kind: str, command: Command, tmp_path: Path, turbine: Turbine, model: Model
) -> None:
    """At the mean of its wind: from rated speed at no pitch OpenFAST overspeeds first."""
    field = np.full((40, 5, 5, 3), [18.0, 0.0, 0.0], np.float32)
    box = WindBox(velocity=field, dt=0.5, dy=40.0, dz=40.0, bottom=10.0, speed=18.0, hub_height=90.0)
    meltemi.io.write_wind(box, tmp_path / "w.bts")
    wind = ("--wind-speed", 18) if kind == "steady" else ("--wind-file", tmp_path / "w.bts")
    ran = command("export", "nrel5mw", *wind, "--out", tmp_path / "deck")
    assert ran.status == 0, ran
    start, point = read_deck(ran.files[0], control_of=turbine).start, meltemi.operating_point(model, 18.0)
    assert start is not None and start["azimuth"] == 0.0
    assert start["rotor_speed"] == pytest.approx(point.rotor_speed, rel=1e-3)
    assert start["pitch"] == pytest.approx(point.pitch, abs=0.003)


def test_options_of_the_model(command: Command, tmp_path: Path, turbine: Turbine) -> None:
    options = ("stall=static", "flap_modes=1", "locked=[yaw, drivetrain]", "time_step=0.004", "axial_drag=true")
    asked = [word for option in options for word in ("--option", option)]
    ran = command("export", "nrel5mw", *asked, "--out", tmp_path)
    assert ran.status == 0, ran
    found = read_deck(ran.files[0], control_of=turbine).options
    assert (found["stall"], found["flap_modes"], found["axial_drag"]) == ("static", 1, True)
    assert set(found["locked"]) == {"yaw", "drivetrain"}
    assert " 0.004   DT " in ran.files[0].read_text()


def test_a_case_is_written_with_all_that_a_deck_has(command: Command, tmp_path: Path, turbine: Turbine) -> None:
    """Models, site, wind, duration and start."""
    case = tmp_path / "case.yaml"
    case.write_text(
        "turbine: nrel5mw\nwind: {kind: steady, speed: 9.0, shear_exponent: 0.2}\nduration: 33.0\n"
        "start: {rotor_speed: 1.1, pitch: 0.02, azimuth: 0.5, undeflected: true}\n"
        "environment: {air_density: 1.1, gravity: 9.7}\n"
        "options: {axial_drag: true, tangential_drag: true, stall: static, inflow: quasi_steady}\n"
    )
    ran = command("export", case, "--option", "edge_modes=0", "--out", tmp_path / "deck")
    assert ran.status == 0, ran
    parked = tmp_path / "parked.yaml"
    parked.write_text(case.read_text().replace(", undeflected: true", ""))
    assert "any controller with undeflected: true, as in OpenFAST" in command("export", parked).err
    deck = read_deck(ran.files[0], control_of=turbine)
    wanted = {"axial_drag": True, "tangential_drag": True, "stall": "static", "inflow": "quasi_steady", "edge_modes": 0}
    assert {name: deck.options[name] for name in wanted} == wanted
    assert deck.wind is not None and deck.wind.pop("kind") == "steady" and deck.duration == 33.0
    assert deck.wind == pytest.approx({"speed": 9.0, "shear_exponent": 0.2})
    assert deck.start == pytest.approx({"rotor_speed": 1.1, "pitch": 0.02, "azimuth": 0.5})
    assert deck.environment == pytest.approx({"air_density": 1.1, "gravity": 9.7})


@pytest.mark.rosco
@pytest.mark.parametrize(
    "name", ["NREL_2p8_127/NREL-2p8-127", "IEA-15-240-RWT/IEA-15-240-RWT-Monopile/IEA-15-240-RWT-Monopile"]
)
def test_a_deck_is_written_anew(name: str, command: Command, rosco_cases: Path, tmp_path: Path) -> None:
    """The same turbine and models when that is read; drag in the induction among them."""
    source = rosco_cases / f"{name}.fst"
    first = read_deck(source)
    ran = command("export", source, "--out", tmp_path / "deck")
    assert ran.status == 0, ran
    second = read_deck(ran.files[0], control_of=first.turbine)
    assert second.options["tangential_drag"] is first.options["tangential_drag"] is True
    different = {
        k
        for k in first.options
        if k not in ("stall_constants", "blade_nodes", "mode_shapes") and second.options.get(k) != first.options[k]
    }
    assert not different
    assert second.start == pytest.approx(first.start) and second.environment == first.environment


@pytest.mark.slow
@pytest.mark.parametrize("of", ["library", "case"])
def test_the_proposed_commands_work(command: Command, tmp_path: Path, of: str) -> None:
    """That of the export, and that which it proposes in turn: the deck runs with the turbine's own control."""
    (tmp_path / "case.yaml").write_text("turbine: nrel5mw\nwind: {kind: steady, speed: 9.0}\nduration: 2.0\n")
    source = "nrel5mw" if of == "library" else tmp_path / "case.yaml"
    ran = command("export", source, "--duration", 2, "--wind-speed", 9, "--out", tmp_path / "deck")
    for expected in ("import", "run"):
        words = shlex.split(next(line for line in ran.out.splitlines() if line.startswith("next: ")))
        assert words[2] == expected
        ran = command(*words[2:])
        assert ran.status == 0, ran
    assert ran.files
