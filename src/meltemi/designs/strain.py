"""Strains in place of channels: section moments times strains per moment, which follow the design.

Reference: docs/theory/designs.md (D-8 to D-10).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.designs.layup import layers_of
from meltemi.designs.terms import STRAIN, STRAIN_OF, Term
from meltemi.designs.tower import strain_per_moment
from meltemi.designs.variables import Variables
from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]
TOWER_BASE = "tower_base_moment_fore_aft"


def moments(term: Term, variables: Variables, stations: Sequence[float]) -> tuple[str, ...]:
    """Channels of the moments of a strain: of the tower's base, or flapwise of all blades at the root and at stations.

    Args:
      stations: [m] of the blades, from the root (``blade_stations`` of the cases).

    Raises:
      InputError: there is no layup, or no such layer.
    """
    if term.of == STRAIN:
        return (TOWER_BASE,)
    if variables.layup is None:
        raise InputError(f"terms: {term.name!r} needs a layup: add layup: {{file: ...}}, a windIO or layup file")
    layers_of(variables.layup.start, term.of.removeprefix(STRAIN_OF), f"terms: {term.name!r}")
    places = ["root_moment_flap", *(f"station_{n + 1}_moment_y" for n in range(len(stations)))]
    blades = range(1, getattr(variables.turbine, "n_blades", 3) + 1)
    return tuple(f"{place}_{b}" for place in places for b in blades)


def per_moment(
    term: Term, variables: Variables, x: Float, stations: Sequence[float], about: Float | None = None
) -> Float:  # fmt: skip
    """(C,) [1/(N m)] strains by moments of 1 N m in the channels of :func:`moments`.

    Args:
      x: (P,) the design.
      about: design beside which they are wanted for derivatives (``Variables.apply``).

    Raises:
      InputError: the turbine has no tower, or a section cannot be computed.
    """
    turbine = variables.apply(x, about)
    if term.of == STRAIN:
        return np.array([strain_per_moment(turbine)])
    assert variables.layup is not None and isinstance(turbine, Turbine)
    base = None if about is None else variables.layup_at(about)
    places = np.array([0.0, *stations])
    layers = term.of.removeprefix(STRAIN_OF)
    found = variables.layup.strains(turbine, variables.layup_at(x, turbine), layers, places, base)
    if not np.any(found):
        raise InputError(
            f"terms: {term.name!r}: {layers!r} is at none of the stations of the blade: add blade_stations"
        )
    return np.repeat(found, turbine.n_blades)
