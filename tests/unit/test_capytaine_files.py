"""Coefficients of a platform from datasets of Capytaine."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meltemi.core.errors import InputError
from meltemi.core.hdf5 import to_netcdf
from meltemi_float.coefficients import read_coefficients
from meltemi_float.potential import Coefficients
from meltemi_hydro.hull import Hull
from meltemi_hydro.panels import panels_of
from meltemi_hydro.potential import coefficients_of, hydrostatics

RHO, G = 1025.0, 9.81
WEIGHT, CENTRE = 8.1e6, np.array([0.3, -0.2, -70.0])
ORDER = [4, 0, 2, 1, 5, 3]
"""Motions in the files are in any order."""
NAMES = np.array([f"spar__{name}" for name in ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")], dtype=object)


def dataset(c: Coefficients) -> dict[str, Any]:
    """Variables of a dataset with the coefficients, as Capytaine 3.0 writes them."""
    square = np.ix_(ORDER, ORDER)
    radiation = [
        np.concatenate([each, last[None]])[:, ORDER][:, :, ORDER] * RHO
        for each, last in ((c.added_mass, c.infinite), (c.damping, 0.0 * c.infinite))
    ]
    push = np.concatenate([c.excitation, np.full_like(c.excitation[:1], np.nan)])[:, :, ORDER].conj() * RHO * G
    x, y, z = WEIGHT / RHO * CENTRE
    C = c.hydrostatic - np.diag([0.0, 0.0, 0.0, z, z, 0.0])
    C[3, 5], C[4, 5] = C[3, 5] + x, C[4, 5] + y
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
        "center_of_mass": (("space_coordinate",), CENTRE, {}),
        "rho": ((), RHO, {}),
        "g": ((), G, {}),
        "disp_mass": ((), WEIGHT, {}),
    }


def test_a_dataset_comes_back(tmp_path: Path) -> None:
    c = read_coefficients("nrel5mw-spar")
    to_netcdf(dataset(c), {}, tmp_path / "spar.nc")
    found = read_coefficients(str(tmp_path / "spar.nc"))
    for name in ("frequency", "added_mass", "damping", "infinite", "heading", "excitation", "hydrostatic"):
        expected = getattr(c, name)
        np.testing.assert_allclose(getattr(found, name), expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_what_is_no_dataset_of_one_body_is_refused(tmp_path: Path) -> None:
    c, path = read_coefficients("nrel5mw-spar"), tmp_path / "spar.nc"
    good = dataset(c)
    dofs = {name: ((name,), np.append(NAMES[ORDER][:5], "bend"), {}) for name in ("influenced_dof", "radiating_dof")}
    waves = {name: value for name, value in good.items() if name != "disp_mass"}
    finite = good | {"omega": (("omega",), np.append(c.frequency, 9.0), {})}
    for variables, words in (
        (waves, "no disp_mass; a dataset of Capytaine 3 has them"),
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
def test_a_dataset_of_capytaine_is_that_of_our_own_calls(tmp_path: Path) -> None:
    """Signs, phases and weight: a cylinder, by different panels."""
    capytaine = pytest.importorskip("capytaine", reason="needs capytaine")
    hull = Hull(depth=50.0, members=[{"start": [0, 0, -15], "end": [0, 0, 5], "diameter": 10.0}])
    w, heading = np.array([0.5, 0.9]), np.array([0.0, 40.0])
    own = coefficients_of(hull, panels_of(hull, 1.5), w, heading, hydrostatics(hull, 1.5)[2])
    mesh = capytaine.mesh_vertical_cylinder(radius=5.0, length=20.0, center=(0, 0, -5.0), resolution=(6, 30, 16))
    dofs = capytaine.rigid_body_dofs(rotation_center=(0, 0, 0))
    body = capytaine.FloatingBody(mesh=mesh.immersed_part(), dofs=dofs, center_of_mass=(0.0, 0.0, -6.0))
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
    for i in (2, 4):
        assert c.hydrostatic[i, i] == pytest.approx(own.hydrostatic[i, i], rel=0.02)
