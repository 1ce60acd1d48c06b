"""Mass dampers from OpenFAST's StC files: values, report of every key, what is refused."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from meltemi.core.errors import InputError, MeltemiError
from meltemi.exchange.openfast.deck import read_deck
from meltemi.io import read_openfast

VALUES = {
    "StC_DOF_MODE": "2", "StC_X_DOF": "true", "StC_Y_DOF": "true", "StC_Z_DOF": "FALSE", "StC_P_X": "3",
    "StC_P_Y": "0", "StC_P_Z": "2", "StC_X_DSP": "1", "StC_Y_DSP": "0", "StC_X_PSP": "10", "StC_X_NSP": "-9",
    "StC_Y_PSP": "10", "StC_Y_NSP": "-9", "StC_X_M": "20000", "StC_Y_M": "21000", "StC_XY_M": "20500",
    "StC_X_K": "28000", "StC_Y_K": "28000", "StC_X_C": "2800", "StC_Y_C": "2800", "StC_X_KS": "15000",
    "StC_Y_KS": "15000", "StC_X_CS": "10000", "StC_Y_CS": "10000", "Use_F_TBL": "False", "NKInpSt": "0",
    "StC_CMODE": "0", "StC_SA_MODE": "1", "StC_X_C_HIGH": "0", "L_X": "7.9", "rho_X": "1000",
}  # fmt: skip
"""Layout of OpenFAST 4 and 5: value, keyword."""

Edited = Callable[..., Path]


@pytest.fixture
def edited(openfast_deck: Path, tmp_path: Path) -> Edited:
    """A deck whose ServoDyn names StC files: those of the nacelle, of the tower, then of the blades."""

    def make(
        nacelle: list[dict[str, str]],
        tower: list[dict[str, str]] = [],  # noqa: B006
        blades: list[dict[str, str]] = [],  # noqa: B006
    ) -> Path:
        folder = tmp_path / "deck"
        shutil.copytree(openfast_deck, folder)
        servo = folder / "ServoDyn.dat"
        text = servo.read_text(encoding="utf-8")
        for kind, files in (("N", nacelle), ("T", tower), ("B", blades)):
            names = []
            for i, changes in enumerate(files):
                names.append(f'"{kind}{i}.dat"')
                lines = [f"{value}  {name}  - of it" for name, value in (VALUES | changes).items()]
                (folder / f"{kind}{i}.dat").write_text("\n".join(["title", *lines, ""]), encoding="utf-8")
            text = re.sub(rf"(?m)^.*\bNum{kind}StC\b.*$", f"{len(files)} Num{kind}StC", text)
            shown = " ".join(names) or "none"
            text = re.sub(rf"(?m)^.*\b{kind}StCfiles\b.*$", f"{shown} {kind}StCfiles", text)
        servo.write_text(text, encoding="utf-8")
        (deck,) = folder.glob("*.fst")
        return deck

    return make


def test_a_mass_in_the_nacelle_and_two_in_the_tower(edited: Edited) -> None:
    deck = read_deck(edited([{}], [{"StC_DOF_MODE": "1", "StC_P_Z": "60", "StC_X_KS": "0"}]))
    one, x, y = deck.turbine.mass_dampers
    assert (one.axes, one.mass, one.stiffness, one.damping) == ("xy", 20500.0, 28000.0, 2800.0)
    assert one.height == pytest.approx(deck.turbine.tower.length + 2.0)
    assert (one.stops, one.stop_stiffness, one.stop_damping) == ((-9.0, 10.0), 15000.0, 10000.0)
    assert (x.axes, x.mass, x.height, x.stops) == ("x", 20000.0, 60.0, None)
    assert (y.axes, y.mass, y.stops) == ("y", 21000.0, (-9.0, 10.0))
    told = {n.what.split(" =")[0]: n.kind for n in deck.notes if n.where.startswith("N0.dat")}
    assert told.keys() >= VALUES.keys()
    assert (told["StC_X_K"], told["StC_P_X"], told["StC_X_DSP"], told["StC_Y_DSP"], told["L_X"]) == (
        *("used", "approximated", "ignored", "equivalent", "not needed"),
    )


def test_version_5_has_another_name_for_the_mass_along_both_axes(edited: Edited) -> None:
    assert read_deck(edited([{"StC_XY_M": "1  note\n22000  StC_Omni_M"}])).turbine.mass_dampers[0].mass == 22000.0


def test_masses_in_blades(edited: Edited) -> None:
    """Axes are those of the blade root, not of the section; one file is a mass in each blade."""
    deck = read_deck(edited([], [], [{"StC_DOF_MODE": "1", "StC_X_DOF": "false", "StC_P_Z": "41"}, {"StC_P_Z": "30"}]))
    edge, both = deck.turbine.mass_dampers
    assert (edge.axes, edge.span, edge.height, edge.angle, edge.blades, edge.mass) == (
        "y",
        41.0,
        None,
        0.0,
        (),
        21000.0,
    )
    assert (both.axes, both.span, both.mass) == ("xy", 30.0, 20500.0)
    told = {n.what.split(" =")[0]: (n.kind, n.why) for n in deck.notes if n.where.startswith("B0.dat")}
    assert told["StC_P_Z"][0] == "used" and told["StC_P_X"] == ("approximated", "the mass is on the axis of the blade")


def test_a_deck_without_them_has_none(openfast_deck: Path) -> None:
    (deck,) = openfast_deck.glob("*.fst")
    assert read_openfast(deck).mass_dampers == ()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"StC_DOF_MODE": "3"}, "N0.dat:2: StC_DOF_MODE 3: only masses on springs"),
        ({"Use_F_TBL": "True"}, "Use_F_TBL: springs and dampers are linear"),
        ({"StC_CMODE": "5"}, "StC_CMODE: springs and dampers are linear and passive"),
        ({"StC_DOF_MODE": "1", "StC_Z_DOF": "True"}, "StC_Z_DOF: masses move along x and y only"),
        ({"StC_Y_K": "1000"}, "needs the same values along x and y"),
        ({"StC_X_K": "much"}, "StC_X_K: expected a number in N/m"),
    ],
)
def test_what_is_refused(edited: Edited, changes: dict[str, str], words: str) -> None:
    with pytest.raises(MeltemiError, match=words):
        read_deck(edited([changes]))


def test_files_that_are_missing(edited: Edited) -> None:
    deck = edited([{}])
    (deck.parent / "N0.dat").unlink()
    with pytest.raises(InputError, match="N0.dat"):
        read_deck(deck)
