"""Coefficients of a platform from datasets of Capytaine."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meltemi.core.errors import InputError
from meltemi.core.hdf5 import to_netcdf
from meltemi.floating.coefficients import read_coefficients
from meltemi.floating.members import Member, at_rest
from meltemi.floating.potential import HydroCoefficients, about_still_water
from meltemi.hydro.hull import Hull
from meltemi.hydro.panels import panels_of
from meltemi.hydro.potential import coefficients_of, hydrostatics

RHO, G = 1025.0, 9.81
WEIGHT, CENTRE = 8.1e6, np.array([0.3, -0.2, -70.0])
CENTRED = "rotation_center"
ORDER = [4, 0, 2, 1, 5, 3]
"""Motions in the files are in any order."""
NAMES = np.array([f"spar__{name}" for name in ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")], dtype=object)


def dataset(
    c: HydroCoefficients, turns: tuple[float, float, float] = (0.0, 0.0, 0.0), own: float = 1.0
) -> dict[str, Any]:
    """Variables of a dataset with the coefficients, as Capytaine 3.0 writes them, of motions about a point, of
    a body with an own mass over that of the water displaced."""
    square, S = np.ix_(ORDER, ORDER), np.eye(6)
    S[:3, 3:] = np.cross(turns, np.eye(3)).T  # the origin moves with -w x R
    radiation = [
        (S.T @ np.concatenate([each, last[None]]) @ S)[:, ORDER][:, :, ORDER] * RHO
        for each, last in ((c.added_mass, c.infinite), (c.damping, 0.0 * c.infinite))
    ]
    push = np.concatenate([c.excitation, np.full_like(c.excitation[:1], np.nan)]) @ S
    push = push[:, :, ORDER].conj() * RHO * G
    # buoyancy V z and weight m z / rho, about the point
    x, y, z = own * WEIGHT / RHO * (CENTRE - turns) + WEIGHT / RHO * np.array(turns)
    C = S.T @ c.hydrostatic @ S - np.diag([0.0, 0.0, 0.0, z, z, 0.0])
    C[3, 5], C[4, 5] = C[3, 5] + x, C[4, 5] + y
    mass = np.diag([own * WEIGHT] * 3 + [1e9] * 3)
    waves, motions = ("complex", "omega", "wave_direction", "influenced_dof"), ("influenced_dof", "radiating_dof")
    return {
        "omega": (("omega",), np.append(c.frequency, np.inf), {}),
        "wave_direction": (("wave_direction",), np.radians(c.heading), {}),
        "influenced_dof": (("influenced_dof",), NAMES[ORDER], {}),
        "radiating_dof": (("radiating_dof",), NAMES[ORDER], {}),
        "complex": (("complex",), np.array(["re", "im"], dtype=object), {}),
        "added_mass": (("omega", *motions), radiation[0], {}),
        "radiation_damping": (("omega", *motions), radiation[1], {}),
        "diffraction_force": (waves, 0.75 * np.stack([push.real, push.imag]), {}),
        "Froude_Krylov_force": (waves, 0.25 * np.stack([push.real, push.imag]), {}),
        "hydrostatic_stiffness": (motions, (C * RHO * G)[square], {}),
        "inertia_matrix": (motions, mass[square], {}),
        "center_of_mass": (("space_coordinate",), CENTRE, {}),
        "rotation_center": (("space_coordinate",), np.array(turns), {}),
        "rho": ((), RHO, {}),
        "g": ((), G, {}),
        "disp_mass": ((), WEIGHT, {}),
    }


def test_about_another_point_a_sphere_has_levers() -> None:
    """Of a sphere under water: added mass V / 2 in all directions, no moment about its centre (Newman 1977, 4.13)."""
    V, (x, y, z), u = 30.0, (2.0, -3.0, -11.0), np.zeros(0)
    A = np.diag([0.5 * V] * 3 + [0.0] * 3)
    X = np.array([1.0 + 2.0j, 0.5, -0.3j, 0.0, 0.0, 0.0])
    sphere = HydroCoefficients(u, A[None], 0.1 * A[None], 2.0 * A, u, X[None, None], np.zeros((6, 6)))
    found = about_still_water(sphere, np.array([x, y, z]), V)
    A = found.added_mass[0]
    assert A[0, 4] == A[4, 0] == 0.5 * V * z and A[1, 3] == A[3, 1] == -0.5 * V * z
    assert A[2, 3] == A[3, 2] == 0.5 * V * y and A[2, 4] == A[4, 2] == -0.5 * V * x
    assert A[0, 5] == -0.5 * V * y and A[1, 5] == 0.5 * V * x and A[3, 4] == -0.5 * V * x * y
    assert A[4, 4] == 0.5 * V * (x**2 + z**2) and A[3, 3] == 0.5 * V * (y**2 + z**2)
    np.testing.assert_allclose([found.damping[0], 0.05 * found.infinite], 0.1 * np.stack([A, A]))
    force = X[:3]
    np.testing.assert_allclose(found.excitation[0, 0], [*force, *np.cross([x, y, z], force)])
    C = np.zeros((6, 6))
    C[3, 3], C[4, 4], C[3, 5], C[4, 5] = V * z, V * z, -V * x, -V * y
    np.testing.assert_allclose(found.hydrostatic, C)


def test_about_another_point_a_column_has_the_stiffness_of_its_place() -> None:
    """From that about a point of its own axis (W-17)."""
    ends = {"start": np.array([0.0, 0.0, -20.0]), "end": np.array([0.0, 0.0, 9.0])}
    place, down = np.array([7.0, -4.0, 0.0]), np.array([0.0, 0.0, -6.0])
    V, b, C = at_rest([Member(**ends, diameter=8.0)])
    C[3:5, 3:5] -= V * down[2] * np.eye(2)
    zero, u = np.zeros((1, 6, 6)), np.zeros(0)
    own = HydroCoefficients(u, zero, zero, zero[0], u, np.zeros((1, 1, 6), dtype=np.complex128), C)
    there = at_rest([Member(**{name: end + place for name, end in ends.items()}, diameter=8.0)])[2]
    np.testing.assert_allclose(about_still_water(own, place + down, V).hydrostatic, there, atol=1e-9 * abs(V * b[2]))


@pytest.mark.parametrize("turns", [(0.0, 0.0, 0.0), (0.3, -0.2, -70.0), (5.0, 0.0, 8.0)], ids=str)
@pytest.mark.parametrize("own", [1.0, 0.8])
def test_a_dataset_comes_back(turns: tuple[float, float, float], own: float, tmp_path: Path) -> None:
    c = read_coefficients("nrel5mw-spar")
    to_netcdf(dataset(c, turns, own), {}, tmp_path / "spar.nc")
    found = read_coefficients(str(tmp_path / "spar.nc"))
    for name in ("frequency", "added_mass", "damping", "infinite", "heading", "excitation", "hydrostatic"):
        expected = getattr(c, name)
        np.testing.assert_allclose(getattr(found, name), expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_what_is_no_dataset_of_one_body_is_refused(tmp_path: Path) -> None:
    c, path = read_coefficients("nrel5mw-spar"), tmp_path / "spar.nc"
    good = dataset(c)
    dofs = {name: ((name,), np.append(NAMES[ORDER][:5], "bend"), {}) for name in ("influenced_dof", "radiating_dof")}
    waves, turns = ({name: value for name, value in good.items() if name != lost} for lost in ("disp_mass", CENTRED))
    finite = good | {"omega": (("omega",), np.append(c.frequency, 9.0), {})}
    for variables, words in (
        (waves, "no disp_mass; a dataset of Capytaine 3 has them"),
        (turns, "no rotation_center; .* motions of rigid_body_dofs"),
        (finite, "an infinite one for the added mass"),
        (good | dofs, "the six motions of one rigid body, found pitch, surge, .*bend"),
    ):
        to_netcdf(variables, {}, path)
        with pytest.raises(InputError, match=words):
            read_coefficients(str(path))
    path.write_text("no netCDF")
    with pytest.raises(InputError, match="not a dataset of Capytaine"):
        read_coefficients(str(path))


@pytest.mark.long
@pytest.mark.parametrize(
    ("turns", "mass"), [((0.0, 0.0, 0.0), None), ((0.5, -1.0, -6.0), None), ((0.0, 0.0, -9.0), 1.0e6)], ids=str
)
def test_a_dataset_of_capytaine_is_that_of_our_own_calls(
    turns: tuple[float, float, float], mass: float | None, tmp_path: Path
) -> None:
    """Signs, phases, weight and centre of rotation: a cylinder, by different panels."""
    capytaine = pytest.importorskip("capytaine", reason="needs capytaine")
    hull = Hull(depth=50.0, members=[{"start": [0, 0, -15], "end": [0, 0, 5], "diameter": 10.0}])
    w, heading = np.array([0.5, 0.9]), np.array([0.0, 40.0])
    own = coefficients_of(hull, panels_of(hull, 1.5), w, heading, hydrostatics(hull, 1.5)[2])
    mesh = capytaine.mesh_vertical_cylinder(radius=5.0, length=20.0, center=(0, 0, -5.0), resolution=(6, 30, 16))
    dofs = capytaine.rigid_body_dofs(rotation_center=turns)
    body = capytaine.FloatingBody(mesh=mesh.immersed_part(), dofs=dofs, center_of_mass=(0.5, -1.0, -6.0), mass=mass)
    body.inertia_matrix, body.hydrostatic_stiffness = (
        body.compute_rigid_body_inertia(),
        body.compute_hydrostatic_stiffness(),
    )
    import xarray as xr

    capytaine.set_logging("ERROR")
    asked = {"omega": [*w, math.inf], "wave_direction": np.radians(heading), "radiating_dof": list(body.dofs)}
    found = capytaine.BEMSolver().fill_dataset(xr.Dataset(coords=asked | {"water_depth": [50.0]}), body, n_jobs=1)
    capytaine.export_dataset(str(tmp_path / "cylinder.nc"), found)
    c = read_coefficients(str(tmp_path / "cylinder.nc"))
    for i in (0, 2, 4):
        for name in ("added_mass", "infinite"):
            a, b = (getattr(each, name)[..., i, i] for each in (c, own))
            assert a == pytest.approx(b, rel=0.05)
        assert c.excitation[..., i] == pytest.approx(own.excitation[..., i], rel=0.06)
    assert c.hydrostatic == pytest.approx(own.hydrostatic, rel=0.02, abs=0.02 * own.hydrostatic[2, 2])
    assert c.added_mass[:, 0, 4] == pytest.approx(own.added_mass[:, 0, 4], rel=0.05)
