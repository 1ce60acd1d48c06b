"""``meltemi export``: a deck, what it has otherwise, errors in one line and nothing half-written."""

from __future__ import annotations

from pathlib import Path

import pytest
from terminal import Command

from meltemi import Turbine
from meltemi.turbine.openfast import read_deck


def test_a_deck_is_written(command: Command, tmp_path: Path, turbine: Turbine) -> None:
    ran = command("export", "nrel5mw", "--wind-speed", 9, "--duration", 40, "--beamdyn", "--out", tmp_path / "deck")
    assert ran.status == 0 and ran.err == ""
    assert "1st flap mode of the blade" in ran.out and "the pitch is held" in ran.out
    assert ran.files[0] == tmp_path / "deck" / "nrel5mw.fst" and all(f.is_file() for f in ran.files)
    deck = read_deck(ran.files[0], control_of=turbine)
    assert deck.turbine.blade.structure.stiffness_matrix is not None  # of BeamDyn
    assert deck.wind == {"kind": "steady", "speed": 9.0, "shear_exponent": 0.0} and deck.duration == 40.0


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("nrel5",), "nrel5mw"),
        (("nrel5mw", "--wind-speed", "-3"), "--wind-speed"),
        (("nrel5mw", "--wind-speed", "9", "--wind-file", "a.bts"), "one of --wind-speed, --wind-file"),
        (("nrel5mw", "--wind-file", "a.wnd"), "TurbSim"),
        (("nrel5mw", "--duration", "0"), "--duration 0"),
    ],
)
def test_bad_input_writes_nothing(arguments: tuple[str, ...], says: str, command: Command, tmp_path: Path) -> None:
    ran = command("export", *arguments, "--out", tmp_path / "deck")
    assert ran.status == 2 and says in ran.err and len(ran.err.splitlines()) == 1
    assert not (tmp_path / "deck").exists()
