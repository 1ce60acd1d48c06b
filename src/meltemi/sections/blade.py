"""From the layup of a blade to the beam properties of a turbine's blade."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.sections.elements import finite_element_section
from meltemi.sections.layup import Layup
from meltemi.sections.thin_walled import thin_walled_section

if TYPE_CHECKING:
    from meltemi.turbine.definition import Turbine

Numbers = NDArray[Any]
Model = Literal["walls", "elements"]
MODELS = {"walls": thin_walled_section, "elements": finite_element_section}


def section_matrices(
    layup: Layup,
    stations: Sequence[float] | Numbers,
    *,
    model: Model = "walls",
    factors: Mapping[str, complex] | None = None,
) -> tuple[Numbers, Numbers]:
    """Stiffness and mass matrices of stations of a blade.

    Args:
      layup: of the blade.
      stations: (S,) fractions of the span.
      model: thin walls, or two-dimensional finite elements.
      factors: factors of thickness by the name of a layer. With a complex one, such as 1 + 1e-30j, the imaginary parts
        of the results over 1e-30 are the derivatives with respect to it, exact but for the curvature of thin walls'
        middle lines and the places of nodes, which are held (1e-5 of a matrix, 1e-4 at the tip).

    Returns:
      (S, 6, 6) stiffness [N, N m, N m^2] and (S, 6, 6) mass [kg/m, kg, kg m], about the reference axis, in the axes of
      ``blade.structure``.

    Raises:
      InputError: a station cannot be computed; the message names it.
    """
    if model not in MODELS:
        raise InputError(f"section_matrices: model must be 'walls' or 'elements', found {model!r}")
    models = [MODELS[model](layup.section(float(station), factors)) for station in stations]
    return np.stack([each.stiffness for each in models]), np.stack([each.mass for each in models])


def blade_of_layup(
    turbine: Turbine,
    layup: Layup,
    *,
    stations: Sequence[float] | Numbers | None = None,
    model: Model = "walls",
    factors: Mapping[str, float] | None = None,
) -> Turbine:
    """The turbine with the stiffness and mass of its blade computed from a layup.

    Args:
      turbine: axis, twist and damping of its blade are kept.
      layup: a blade of the same length.
      stations: fractions of the span, from 0 to 1; by default those of the turbine's blade.
      model: thin walls, or two-dimensional finite elements.
      factors: factors of thickness by the name of a layer.

    Raises:
      InputError: the blades are not equally long, or a station cannot be computed.
    """
    if stations is None:
        stations = stations_of(turbine, layup)
    return with_matrices(turbine, layup, stations, *section_matrices(layup, stations, model=model, factors=factors))


def stations_of(turbine: Turbine, layup: Layup) -> NDArray[np.float64]:
    """(S,) fractions of the span of a layup at the stations of the turbine's blade.

    Raises:
      InputError: the blades are not equally long.
    """
    along = distances(turbine, layup, layup.position.grid)
    return np.asarray(np.interp(turbine.blade.structure.position, along, layup.position.grid))


def distances(turbine: Turbine, layup: Layup, stations: Sequence[float] | Numbers) -> NDArray[np.float64]:
    """(S,) [m] distances from the root of the turbine's blade of fractions of the span of a layup.

    Raises:
      InputError: the blades are not equally long.
    """
    z = layup.position.values - layup.position.values[0]
    if abs(z[-1] - turbine.blade.length) > 0.01 * z[-1]:
        raise InputError(
            f"layup: the blade of {layup.name} is {z[-1]:.4g} m long, that of {turbine.name} "
            f"{turbine.blade.length:.4g} m"
        )
    return np.asarray(turbine.blade.length / z[-1] * np.interp(stations, layup.position.grid, z))


def with_matrices(
    turbine: Turbine, layup: Layup, stations: Sequence[float] | Numbers, K: Numbers, M: Numbers
) -> Turbine:
    """The turbine with the matrices (S, 6, 6) of the sections of a layup at stations (S,)."""
    structure, shape = turbine.blade.structure, turbine.blade.aerodynamics
    position = distances(turbine, layup, stations)
    axis = {
        name: np.interp(position, structure.position, values)
        for name in ("axis_x", "axis_y")
        if (values := getattr(structure, name)) is not None
    }
    changed = {
        "position": position,
        "twist": np.interp(position, shape.position, shape.twist),
        "stiffness_matrix": K,
        "mass_matrix": M,
        "damping": structure.damping,
        "damping_time": structure.damping_time,
        **axis,
    }
    new = type(structure)(**{name: value for name, value in changed.items() if value is not None})
    return turbine.replace(blade=turbine.blade.replace(structure=new))


def load_rotation(turbine: Turbine, place: float) -> NDArray[np.float64]:
    """(6, 6) loads in the axes of the section from those in pitched axes, at a distance [m] from the root.

    Reference: docs/theory/strength.md (G-7).
    """
    twist = float(np.interp(place, turbine.blade.structure.position, turbine.blade.structure.twist))
    c, s = np.cos(twist), np.sin(twist)
    return np.kron(np.eye(2), [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
