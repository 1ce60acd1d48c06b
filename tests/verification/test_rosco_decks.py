"""Every OpenFAST deck inside the rosco package: read, trimmed and run in turbulence, or refused by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import ModelOptions, Status, TurbulentWind, UnsupportedError

pytestmark = pytest.mark.rosco

DECKS: dict[str, tuple[dict[str, Any], float]] = {
    "5MW_Land_Simulink": ({"control_of": "NREL-5MW"}, 11.0),
    "BAR_10": ({}, 9.0),
    "IEA-15-240-RWT-Monopile": ({}, 10.5),
    "IEA-15-240-RWT-Monopile_wDTUcontroller": ({"control_of": "IEA-15-240-RWT-Monopile"}, 10.5),
    "IEA-15-240-RWT_OLAF": ({"momentum_wake": True}, 10.5),
    "IEA-15-240-RWT-UMaineSemi": ({"fixed_base": True}, 10.5),
    "NREL-2p8-127": ({}, 9.5),
    "NREL-5MW": ({}, 11.0),
}
"""How each is read, and a wind speed [m/s] somewhat below its rated one."""
REFUSED = {
    "IEA-15-240-RWT_OLAF": "vortex wake",
    "IEA-15-240-RWT-UMaineSemi": "floating",
    "MHK_RM1_Floating": "marine",
    "5MW_Land_Simulink": "controller is not ROSCO",
}


def main_file(folder: Path, name: str) -> Path:
    return next(folder.rglob(f"{name}.fst"))


def read(folder: Path, name: str, how: dict[str, Any]) -> meltemi.Deck:
    if "control_of" in how:
        how = how | {"control_of": meltemi.read_openfast(main_file(folder, how["control_of"]))}
    return meltemi.read_deck(main_file(folder, name), **how)


def test_no_deck_is_left_out(rosco_cases: Path) -> None:
    assert {path.stem for path in rosco_cases.rglob("*.fst")} == DECKS.keys() | REFUSED.keys()


@pytest.mark.parametrize("name", REFUSED)
def test_refused_by_name(rosco_cases: Path, name: str) -> None:
    with pytest.raises((UnsupportedError, meltemi.InputError), match=REFUSED[name]):
        meltemi.read_openfast(main_file(rosco_cases, name))


@pytest.mark.parametrize("models", ["as in the deck", "ours"])
@pytest.mark.parametrize("name", DECKS)
def test_trims_and_runs_in_turbulence(rosco_cases: Path, name: str, models: str) -> None:
    how, below = DECKS[name]
    deck = read(rosco_cases, name, how)
    turbine = deck.turbine
    model = meltemi.build(turbine, ModelOptions(**deck.options) if models == "as in the deck" else None)
    reference = turbine.control.pitch.reference_speed / turbine.drivetrain.gear_ratio
    pitch = []
    for speed in (0.6 * below, below, 1.3 * below, 2.0 * below):
        point = meltemi.operating_point(model, speed)
        assert abs(point.imbalance) < 1e-3 * turbine.rated_power / reference
        share = 0.5 * 1.225 * np.pi * turbine.rotor_radius**2 * speed**3
        assert 0.02 < point["rotor_power"] / share < 0.55
        pitch.append(point.pitch)
        if speed > 1.2 * below:
            assert point.rotor_speed == pytest.approx(reference, rel=2e-3)
            assert point["generator_power"] == pytest.approx(turbine.rated_power, rel=0.01)
    assert pitch[-1] > pitch[-2] > pitch[0]
    result = meltemi.simulate(model, TurbulentWind(speed=1.6 * below, intensity=0.12, seed=1), duration=60.0)
    assert result.status is Status.OK, result.message
    late = result.between(20.0, 60.0)
    assert late["generator_power"].mean() == pytest.approx(turbine.rated_power, rel=0.12)
    assert late["rotor_speed"].mean() == pytest.approx(reference, rel=0.06)
    assert late["tip_clearance_1"].min() > 0.0


def test_the_monopile_softens_the_tower(rosco_cases: Path) -> None:
    path = main_file(rosco_cases, "IEA-15-240-RWT-Monopile")
    free, clamped = (meltemi.build(meltemi.read_openfast(path, fixed_base=fixed)) for fixed in (False, True))
    on_pile, on_ground = (m.tower.modes.frequency[0] / (2.0 * np.pi) for m in (free, clamped))
    assert on_pile < 0.9 * on_ground
    assert on_pile == pytest.approx(0.17, abs=0.02)  # NREL/TP-5000-75698: 0.17 Hz on its monopile


def test_flaps_of_the_bar_stand_at_zero(rosco_cases: Path) -> None:
    """Four of its airfoils have tables for UserProp -10, 0 and 10; the first are half a unit of lift lower."""
    turbine = meltemi.read_openfast(main_file(rosco_cases, "BAR_10"))
    lift = [
        float(np.interp(0.05, polar.angle_of_attack, polar.lift))
        for name, polar in turbine.airfoils.items()
        if name[-2:] in ("20", "21", "22", "23")
    ]
    assert lift == pytest.approx([0.5526, 0.5718, 0.6008, 0.6286], abs=1e-3)


def test_losses_of_the_gearbox_are_read(rosco_cases: Path) -> None:
    assert meltemi.read_openfast(main_file(rosco_cases, "BAR_10")).drivetrain.gearbox_efficiency == pytest.approx(0.95)
