"""Slips of unit in a turbine are told; turbines of the library and of ROSCO's decks are fine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meltemi
from meltemi import Turbine
from meltemi.core.errors import MeltemiError
from meltemi.electrical.system import size_electrical
from meltemi.exchange.openfast import read_deck
from meltemi.turbine import plausibility_warnings
from meltemi.turbine.plausibility import bending_frequency


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n in meltemi.list_turbines() if not n.startswith("iea")])
def test_turbines_of_the_library_are_usual(name: str) -> None:
    assert plausibility_warnings(meltemi.load_turbine(name)) == ()


def test_windio_turbines_are_usual() -> None:
    pytest.importorskip("windIO")
    for name in ("iea15mw", "iea22mw"):
        assert plausibility_warnings(meltemi.load_turbine(name)) == ()


@pytest.mark.rosco
def test_decks_of_rosco_are_usual(rosco_cases: Path) -> None:
    seen = 0
    for path in sorted(rosco_cases.rglob("*.fst")):
        try:
            turbine = read_deck(path).turbine
        except MeltemiError:  # floats, vortex wakes, water
            continue
        found = plausibility_warnings(turbine)
        if path.stem == "NREL-2p8-127":  # 4,941 kg m^2 behind a ratio of 97; the NREL 5 MW has 534
            assert len(found) == 1 and found[0].startswith("drivetrain.generator_inertia")
        elif path.stem.startswith("IEA-15"):  # the 28,116 N m of the NREL 5 MW on the slow shaft of a direct drive
            assert len(found) == 1 and found[0].startswith("drivetrain.brake_torque")
        else:
            assert found == (), path
        seen += 1
    assert seen >= 3


@pytest.mark.parametrize(
    ("key", "factor", "words"),
    [
        ("rated_power", 1e-3, "rated_power: 5000 W is unusual; usual is 7.9e+05 to 1.3e+07 W for a rotor of 126 m"),
        (
            "control.torque.rated_power",
            1e3,
            "control.torque.rated_power: rated_power over it and the efficiency is 0.00",
        ),
        ("control.torque.rated_speed", 30.0 / np.pi, "control.torque.rated_speed: it over control.pitch."),
        ("control.pitch.reference_speed", 30.0 / np.pi, "control.pitch.reference_speed: tip speed at it [m/s] is 762"),
        ("control.pitch.gain_halving_pitch", 180.0 / np.pi, "control.pitch.gain_halving_pitch: 6.302 rad (361 deg) is"),
        ("control.filter_frequency", 0.5 / np.pi, "control.filter_frequency: 0.25 rad/s (14.3 deg/s) is unusual"),
        ("drivetrain.generator_inertia", 97.0**2, "drivetrain.generator_inertia: it times gear_ratio squared, over"),
        ("blade.aerodynamics.chord", 1e3, "blade.aerodynamics.chord: 4652 m is unusual"),
        ("nacelle.mass", 1e-3, "nacelle.mass: 240 kg is unusual; usual is 4e+04 to 1.4e+06 kg for a rotor of 126 m"),
        ("hub.mass", 1e3, "hub.mass: "),
        ("drivetrain.stiffness", 0.01, "drivetrain.stiffness: twist [rad] at rated torque is 0.482; usual is 5e-05 to"),
        (
            "blade.structure.flap_stiffness",
            0.3,
            "blade: its stiffness and mass give a first frequency which over rated",
        ),
        ("blade.structure.axial_stiffness", 0.3, "blade.structure.axial_stiffness: at the root it over that of a thin"),
        ("tower.mass", 20.0, "tower.fore_aft_stiffness: modulus over density [m^2/s^2] of a thin tube of its mass and"),
        ("tower.fore_aft_stiffness", 1e-3, "tower: its stiffness and mass"),
        ("tower.torsion_stiffness", 1e-3, "tower.torsion_stiffness: it over that of a thin tube of the same bending"),
        ("hub.inertia", 57.3, "hub.inertia: radius of gyration over hub.radius"),
        ("yaw.stiffness", 1e3, "yaw.stiffness: frequency of the nacelle over rated rotor speed"),
    ],
)
def test_slips_are_told(turbine: Turbine, key: str, factor: float, words: str) -> None:
    value: object = turbine
    for part in key.split("."):
        value = getattr(value, part)
    said = plausibility_warnings(turbine.replace(**{key: factor * np.asarray(value)}))
    assert any(sentence.startswith(words) for sentence in said), said


@pytest.mark.filterwarnings("error")
def test_a_frequency_that_overflows_is_told_without_warnings_of_numpy(turbine: Turbine) -> None:
    soft = 1e-300 * np.asarray(turbine.tower.fore_aft_stiffness) * 1e-12
    said = plausibility_warnings(turbine.replace(**{"tower.fore_aft_stiffness": soft}))
    assert any(sentence.startswith("tower: its stiffness") for sentence in said)


def test_negative_drag_is_told(turbine: Turbine) -> None:
    name, airfoil = [*turbine.airfoils.items()][-1]
    airfoils = turbine.airfoils | {name: airfoil.replace(drag=airfoil.drag - 0.02)}
    (said,) = plausibility_warnings(turbine.replace(airfoils=airfoils))
    assert said.startswith(f"airfoils.{name}.drag: -0.0") and "negative" in said


def test_a_table_above_betz_is_told() -> None:
    machine = meltemi.load_turbine("pmsg20mw-bem")
    power = 1.3 * np.asarray(machine.coefficient.power)
    (said,) = plausibility_warnings(machine.replace(**{"coefficient.power": power}))
    assert said.startswith("coefficient.power: its largest, below Betz's limit of 16/27, is 0.643; usual is 0.3 to")


def test_a_sized_electrical_system_is_usual(turbine: Turbine) -> None:
    speed = turbine.rated_rotor_speed * turbine.drivetrain.gear_ratio
    system = size_electrical(turbine.control.torque.rated_power, speed)
    assert not plausibility_warnings(turbine.replace(electrical=system))
    small = turbine.replace(electrical=size_electrical(0.3048 * turbine.control.torque.rated_power, speed))
    (said,) = plausibility_warnings(small)
    assert said.startswith("electrical.machine.rated_power: it over control.torque.rated_power is 0.305")


def test_a_uniform_cantilever() -> None:
    """Rayleigh's quotient is 0.8 % above (1.8751 / L)^2 sqrt(EI / m), and right for a mass on a light beam."""
    z = np.linspace(0.0, 10.0, 401)
    one = np.ones_like(z)
    assert bending_frequency(z, 2.0 * one, 8.0 * one) == pytest.approx(1.8751**2 / 100.0 * 2.0, rel=0.01)
    assert bending_frequency(z, 1e-9 * one, 8.0 * one, 5.0) == pytest.approx(np.sqrt(3.0 * 8.0 / 1e3 / 5.0), rel=1e-4)
