"""Parts of the machine and kinds of rotors that other packages register as entry points."""

from __future__ import annotations

from pathlib import Path

import pytest

import meltemi
from meltemi import InputError, Turbine
from meltemi.simulation import rotors

CODE = """
from dataclasses import dataclass
from meltemi.simulation.parts import Part

@dataclass(frozen=True)
class Ballast(Part):
    mass: float
    def notices(self, channels):
        return [f"{self.mass:g} kg of ballast"]

def part_of(turbine, options, rotor):
    return Ballast(turbine.extensions["ballast"]["mass"])

class Kite:
    pass
KIND = "of kites"
"""


@pytest.fixture
def guest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A package with a part and a kind of rotor, as pip would leave it there."""
    info = tmp_path / "guest-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: guest\nVersion: 1.0\n", encoding="utf-8")
    lines = ["[meltemi.parts]", "ballast = guest_parts:part_of", "[meltemi.rotors]", "Kite = guest_parts:KIND"]
    (info / "entry_points.txt").write_text("\n".join(lines), encoding="utf-8")
    (tmp_path / "guest_parts.py").write_text(CODE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)


def test_another_package_registers_a_part(turbine: Turbine, guest: None) -> None:
    model = meltemi.build(turbine.replace(extensions={"ballast": {"mass": 12.0}}))
    (part,) = model.parts
    assert part.notices(()) == ["12 kg of ballast"]
    assert not meltemi.build(turbine).parts


def test_a_part_that_nobody_registers_is_refused(turbine: Turbine, guest: None) -> None:
    with pytest.raises(InputError, match=r"extensions.balast: no installed package .*did you mean 'ballast'"):
        meltemi.build(turbine.replace(extensions={"balast": {}}))


def test_another_package_registers_a_kind_of_rotor(guest: None) -> None:
    kite = type("BigKite", (type("Kite", (), {}),), {})
    assert rotors._kind(kite) == "of kites"
