"""Deep stall: the plate, and the damping of motion along the chord."""

from __future__ import annotations

import numpy as np
import pytest

import meltemi
from meltemi.aero.deep_stall import edgewise_damping, plate_polar

MEASURED = np.array(
    # Sheldahl & Klimas (1981): angle of attack [deg], lift, drag of NACA 0015
    [
        *([30.0, 0.855, 0.570], [35.0, 0.980, 0.745], [40.0, 1.035, 0.920], [45.0, 1.050, 1.075]),
        *([50.0, 1.020, 1.215], [55.0, 0.955, 1.345], [60.0, 0.875, 1.470], [65.0, 0.760, 1.575]),
        *([70.0, 0.630, 1.665], [75.0, 0.500, 1.735], [80.0, 0.365, 1.780], [85.0, 0.230, 1.800]),
        [90.0, 0.090, 1.800],
    ]
)


def of_airfoil(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    airfoil = meltemi.load_turbine("nrel5mw").airfoils[name]
    grid = np.linspace(-np.pi, np.pi, 1441)
    return grid, *(np.interp(grid, airfoil.angle_of_attack, getattr(airfoil, n)) for n in ("lift", "drag"))


def test_the_suction_of_viternas_extrapolation_drives_motion_along_the_chord() -> None:
    alpha, suction = np.radians(np.linspace(30.0, 80.0, 501)), 0.3
    chordwise, normal = suction * np.cos(alpha) ** 2, 1.5 * np.sin(alpha)
    lift = normal * np.cos(alpha) + chordwise * np.sin(alpha)
    drag = normal * np.sin(alpha) - chordwise * np.cos(alpha)
    found = edgewise_damping(alpha, lift, drag)
    np.testing.assert_allclose(found[1:-1], -2.0 * suction * np.cos(alpha[1:-1]), atol=1e-4)


def test_a_measured_section_does_not() -> None:
    alpha, lift, drag = np.radians(MEASURED[:, 0]), MEASURED[:, 1], MEASURED[:, 2]
    every_ten = slice(1, -1, 2)
    assert np.all(edgewise_damping(alpha, lift, drag)[every_ten] > -0.03)
    suction = lift * np.sin(alpha) - drag * np.cos(alpha)
    assert np.all((suction > -0.08) & (suction < 0.1))


def test_the_plate_has_the_normal_force_of_hoerner_and_the_polars_drag_across() -> None:
    grid, lift, drag = of_airfoil("naca64")
    plate_lift, plate_drag = plate_polar(grid, lift, drag)
    degree = np.degrees(grid)
    near = (np.abs(degree) <= 30.0) | (np.abs(degree) >= 150.0)
    np.testing.assert_array_equal(plate_lift[near], lift[near])
    np.testing.assert_array_equal(plate_drag[near], drag[near])
    at = np.searchsorted(degree, [60.0, 90.0])
    across = drag[at[1]]
    assert plate_drag[at[1]] == pytest.approx(across)
    normal = plate_lift[at[0]] * np.cos(grid[at[0]]) + plate_drag[at[0]] * np.sin(grid[at[0]])
    assert normal == pytest.approx(across * 0.505 / (0.222 + 0.283 / np.sin(grid[at[0]])))
    whole = (np.abs(degree) > 46.0) & (np.abs(degree) < 134.0)
    assert np.all(edgewise_damping(grid, plate_lift, plate_drag)[whole] > 0.0)
    assert np.any(edgewise_damping(*of_airfoil("du40"))[whole & (degree > 0.0)] < -0.2)


def test_the_option_changes_the_polars_of_blades_only_there() -> None:
    turbine = meltemi.load_turbine("nrel5mw")
    given, plate = (meltemi.build(turbine, meltemi.ModelOptions(deep_stall=kind)) for kind in ("given", "plate"))
    moved = np.any(given.rotor.polars != plate.rotor.polars, axis=(0, 2))
    grid = np.degrees(np.linspace(-np.pi, np.pi, len(moved)))
    assert moved.any()
    assert np.all(np.abs(grid[moved]) > 30.0)
