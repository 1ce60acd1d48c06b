"""Modes of members from the mode shapes of a description: polynomials over the span."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import UnsupportedError
from meltemi.structure.beam import Beam, Mesh, Modes, ordinal
from meltemi.turbine.definition import BladeStructure, Tower

Float = NDArray[np.float64]


def given_blade_modes(blade: BladeStructure, beam: Beam, mesh: Mesh, counts: dict[str, int]) -> tuple[Modes, list[str]]:
    """Modes of a blade, and their names.

    Raises:
      UnsupportedError: the blade has not as many shapes.
    """
    if blade.mode_shapes is None or blade.flap_stiffness is None or blade.edge_stiffness is None:
        raise UnsupportedError("mode_shapes 'given': the blade has no mode_shapes (with classical section properties)")
    directions = {
        "flap": (blade.mode_shapes.flap, blade.flap_stiffness, np.cos(blade.twist), -np.sin(blade.twist)),
        "edge": (blade.mode_shapes.edge, blade.edge_stiffness, np.sin(blade.twist), np.cos(blade.twist)),
        "torsion": ((), blade.flap_stiffness, blade.twist, blade.twist),
    }
    return _modes(beam, mesh, counts, directions)


def given_tower_modes(tower: Tower, beam: Beam, mesh: Mesh, counts: dict[str, int]) -> tuple[Modes, list[str]]:
    """Modes of a tower, and their names.

    Raises:
      UnsupportedError: the tower has not as many shapes.
    """
    if tower.mode_shapes is None:
        raise UnsupportedError("mode_shapes 'given': the tower has no mode_shapes")
    one, zero = np.ones(len(tower.position)), np.zeros(len(tower.position))
    directions = {
        "fore-aft": (tower.mode_shapes.fore_aft, tower.fore_aft_stiffness, one, zero),
        "side-side": (tower.mode_shapes.side_side, tower.side_side_stiffness, zero, one),
        "torsion": ((), tower.fore_aft_stiffness, zero, zero),
    }
    named = {name.replace("_", "-"): count for name, count in counts.items()}
    return _modes(beam, mesh, named, directions)


def _modes(
    beam: Beam,
    mesh: Mesh,
    counts: dict[str, int],
    directions: Mapping[str, tuple[Sequence[Sequence[float]], Float, Float, Float]],
) -> tuple[Modes, list[str]]:
    """Modes from polynomials: bending curvature phi'' along a direction that rotates with the section.

    Args:
      directions: by kind the coefficients of x^2, x^3, ... over the span, the stiffness at the
        stations, and the direction's x and y components there.
    """
    names: list[str] = []
    z = mesh.z
    length = z[-1]
    middle, step = 0.5 * (z[1:] + z[:-1]), np.diff(z)
    q, weights = beam.pieces(z)
    weight = weights.sum(axis=1)
    shapes: list[Float] = []
    curvature: list[Float] = []
    for kind, (polynomials, stiffness, x, y) in directions.items():
        if counts[kind] > len(polynomials):
            raise UnsupportedError(
                f"{counts[kind]} {kind} modes are requested, but {len(polynomials)} shapes are given"
            )
        for i, coefficients in enumerate(polynomials[: counts[kind]]):
            names.append(f"{ordinal(i + 1)} {kind}")
            second = np.polynomial.Polynomial([0.0, 0.0, *coefficients]).deriv(2)
            shape = np.zeros((len(z), 6))
            for component, rotation, sign, part in ((0, 4, 1.0, x), (1, 3, -1.0, y)):
                bent = second(middle / length) / length**2 * np.interp(middle, beam.position, part)
                slope = np.concatenate([[0.0], np.cumsum(bent * step)])
                shape[:, rotation] = sign * slope
                shape[1:, component] = np.cumsum(0.5 * (slope[1:] + slope[:-1]) * step)
            shapes.append(shape)
            curvature.append(second(q / length) / length**2 * np.sqrt(np.interp(q, beam.position, stiffness)))
    shape_array, curved = np.array(shapes).reshape(-1, len(z), 6), np.array(curvature).reshape(-1, len(q))
    same = np.array([[a.split(" ", 1)[1] == b.split(" ", 1)[1] for a in names] for b in names], dtype=float)
    K = (curved * weight) @ curved.T * same.reshape(len(names), len(names))
    flat = shape_array.reshape(len(names), 6 * len(z))
    alone = flat @ mesh.mass @ flat.T
    return Modes(z, mesh.points, shape_array, K, alone, alone), names
