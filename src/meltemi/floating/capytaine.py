"""Potential-flow coefficients of one rigid body from a dataset of Capytaine (netCDF).

Its time is e^{-i w t}, its forces are those of the water in SI units about the centre of rotation of its motions, which
is any point, and its stiffness contains the weight. Here they are about the platform's point, without the weight.

Reference: docs/theory/floating.md (W-37, W-43, W-44); Capytaine 3.0, user manual, "Outputs".
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.core.hdf5 import read_hdf5
from meltemi.floating.potential import HydroCoefficients, about_still_water, tilt_stiffness
from meltemi.turbine.definition import BaseMotion

if TYPE_CHECKING:
    import h5py

MOTIONS = get_args(BaseMotion)
NEEDED = (
    "omega wave_direction influenced_dof radiating_dof added_mass radiation_damping diffraction_force "
    "Froude_Krylov_force hydrostatic_stiffness inertia_matrix rho g center_of_mass disp_mass rotation_center"
).split()


def read_capytaine(path: Path) -> HydroCoefficients:
    """Coefficients from a dataset of Capytaine, with an infinite frequency among those of the radiation.

    Raises:
      InputError: the file is not such a dataset, has not what it needs, or motions of more than one rigid body.
    """
    return read_hdf5(path, lambda content: _coefficients(content, path), "a dataset of Capytaine")


def _coefficients(content: h5py.File, path: Path) -> HydroCoefficients:
    if missing := [name for name in NEEDED if name not in content]:
        raise InputError(
            f"{path}: no {', '.join(missing)}; a dataset of Capytaine 3 has them for a body with motions of "
            "rigid_body_dofs and a center_of_mass (fill_dataset with hydrostatics=True)"
        )
    w, rho, g = np.asarray(content["omega"]), float(content["rho"][()]), float(content["g"][()])
    places = {axis: _motions(content[axis], path) for axis in ("influenced_dof", "radiating_dof")}

    def array(name: str, *axes: str) -> NDArray[Any]:
        data, given = np.asarray(content[name]), [d[0].name.strip("/") for d in content[name].dims]
        for axis, place in places.items():
            if axis in given:
                data = np.take(data, place, axis=given.index(axis))
        if sorted(given) != sorted(axes):
            raise InputError(f"{path}: {name} is over {', '.join(given)}, expected {', '.join(axes)}")
        return data.transpose([given.index(axis) for axis in axes])

    order = np.argsort(w)
    finite, limit = order[np.isfinite(w[order]) & (w[order] > 0.0)], np.flatnonzero(np.isinf(w))
    if not len(limit) or not len(finite):
        raise InputError(f"{path}: expected frequencies, and an infinite one for the added mass there (omega: inf)")
    square = ("omega", "influenced_dof", "radiating_dof")
    added, damping = array("added_mass", *square) / rho, array("radiation_damping", *square) / rho
    push = [
        array(name, "complex", "omega", "wave_direction", "influenced_dof")
        for name in ("diffraction_force", "Froude_Krylov_force")
    ]
    real, imaginary = push[0] + push[1]
    heading = np.degrees(np.asarray(content["wave_direction"]))
    along = np.argsort(heading)
    excitation = ((real - 1j * imaginary) / (rho * g))[finite][:, along]
    motions = ("influenced_dof", "radiating_dof")
    C, mass = array("hydrostatic_stiffness", *motions) / (rho * g), float(array("inertia_matrix", *motions)[0, 0])
    centre, R = np.asarray(content["center_of_mass"]), np.asarray(content["rotation_center"])
    water = C - tilt_stiffness(centre - R, -mass / rho)  # the mass of a body need not be that of the displaced water
    coefficients = HydroCoefficients(
        w[finite], added[finite], damping[finite], added[limit[0]], heading[along], excitation, water
    )
    return about_still_water(coefficients, R, float(content["disp_mass"][()]) / rho)


def _motions(names: Any, path: Path) -> list[int]:
    """Indices of the six motions among those of a dataset."""
    known = [str(name.decode() if isinstance(name, bytes) else name).split("__")[-1].lower() for name in names]
    if sorted(known) != sorted(MOTIONS):
        raise InputError(f"{path}: expected the six motions of one rigid body, found {', '.join(known)[:80]}")
    return [known.index(name) for name in MOTIONS]
