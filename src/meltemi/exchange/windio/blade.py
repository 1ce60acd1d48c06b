"""Blade of a windIO file: axis, outer shape, beam sections.

Frames. The reference axis has x towards the suction side, y towards the trailing edge, z along the pitch axis from the
blade root: the axes of docs/conventions.md. Twist is positive towards feather. The 6 x 6 matrices refer to axes
that are rotated by the twist and normal to the reference axis. The schema states "x points to the trailing
edge, y to the suction side", which with z towards the tip is no right-handed frame; the data of the IEA turbines,
and the BeamDyn files derived from them, have x across the chord and y along it, as here. ``_check_axes`` tests that.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.exchange.windio.polars import blended
from meltemi.exchange.windio.tree import Tree

Float = NDArray[np.float64]

BLADE = "components.blade"
SHAPE = f"{BLADE}.outer_shape"
ELASTIC = f"{BLADE}.structure.elastic_properties"
OUTBOARD = 0.3
"""Share of the span beyond which every blade is stiffer along its chord than across it."""


@dataclass(frozen=True)
class ReferenceAxis:
    """The reference axis.

    Attributes:
      grid: (S,) relative positions, 0 to 1.
      x, y, z: (S,) [m] coordinates from the blade root.
    """

    grid: Float
    x: Float
    y: Float
    z: Float

    def at(self, grid: Float) -> tuple[Float, Float, Float]:
        """Coordinates x, y, z at other grid points."""
        return (
            np.interp(grid, self.grid, self.x),
            np.interp(grid, self.grid, self.y),
            np.interp(grid, self.grid, self.z),
        )


def read_blade(tree: Tree, reynolds: float | None) -> tuple[dict[str, Any], dict[str, Any]]:
    """Content of ``Turbine.blade`` and ``Turbine.airfoils``, as far as available in the file.

    Args:
      reynolds: where an airfoil has polars of several Reynolds numbers, the nearest is used; by default the highest.
    """
    axis = _axis(tree)
    shape, airfoils = _aerodynamics(tree, axis, reynolds)
    structure = _structure(tree, axis)
    return {"aerodynamics": shape, "structure": structure, "source": tree.source}, airfoils


def _axis(tree: Tree) -> ReferenceAxis:
    path = f"{BLADE}.reference_axis"
    curves = {c: tree.curve(f"{path}.{c}") for c in "xyz"}
    grid = np.unique(np.concatenate([g for g, _ in curves.values()]))
    x, y, z = (np.interp(grid, *curves[c]) for c in "xyz")
    if np.any(np.diff(z) <= 0.0):
        raise InputError(f"{tree.where}: {path}.z must increase from root to tip")
    if max(abs(x[0]), abs(y[0]), abs(z[0])) > 1e-3 * z[-1]:
        raise InputError(f"{tree.where}: {path} must begin at the blade root, at x = y = z = 0")
    tree.note("used", path, "prebend and sweep", f"tip at x {x[-1]:.3g} m, y {y[-1]:.3g} m, z {z[-1]:.6g} m")
    return ReferenceAxis(grid, x - x[0], y - y[0], z - z[0])


def _aerodynamics(tree: Tree, axis: ReferenceAxis, reynolds: float | None) -> tuple[dict[str, Any], dict[str, Any]]:
    curves = [tree.curve(f"{SHAPE}.{name}")[0] for name in ("chord", "twist")]
    grid = np.unique(np.concatenate([[0.0, 1.0], *curves]))
    x, y, z = axis.at(grid)
    chord, twist = tree.at(f"{SHAPE}.chord", grid), np.radians(tree.at(f"{SHAPE}.twist", grid))
    if tree.get(f"{SHAPE}.section_offset_y") is not None:
        leading_edge = tree.at(f"{SHAPE}.section_offset_y", grid)
    else:  # relative to the chord, as in windIO 1
        leading_edge = tree.at(f"{SHAPE}.pitch_axis", grid) * chord
    names, airfoils, centre = blended(tree, SHAPE, grid, reynolds)
    # the aerodynamic centre in the section's axes, x across the chord and y towards the trailing edge
    across = np.zeros(len(grid))
    if tree.get(f"{SHAPE}.section_offset_x") is not None:
        across = tree.at(f"{SHAPE}.section_offset_x", grid)
    along = centre * chord - leading_edge
    content = {
        "position": z,
        "chord": chord,
        "twist": twist,
        "airfoil": names,
        "centre_x": x + np.cos(twist) * across + np.sin(twist) * along,
        "centre_y": y - np.sin(twist) * across + np.cos(twist) * along,
    }
    return content, airfoils


def _structure(tree: Tree, axis: ReferenceAxis) -> dict[str, Any]:
    K_grid, M_grid = tree.numbers(f"{ELASTIC}.stiffness_matrix.grid"), tree.numbers(f"{ELASTIC}.inertia_matrix.grid")
    grid = np.unique(np.concatenate([axis.grid, K_grid, M_grid]))
    x, y, z = axis.at(grid)
    content: dict[str, Any] = {
        "position": z,
        "twist": np.radians(tree.at(f"{SHAPE}.twist", grid)),
        "axis_x": x,
        "axis_y": y,
        "stiffness_matrix": _stiffness(tree, grid),
        "mass_matrix": _mass(tree, grid),
    }
    mu = tree.get(f"{ELASTIC}.structural_damping.mu")
    if mu is not None and np.any(times := tree.numbers(f"{ELASTIC}.structural_damping.mu", 6)):
        content["damping_time"] = {"flap": times[4], "edge": times[3], "torsion": times[5]}
        why = "numbering of BeamDyn: 4th entry about the flap axis (edge), 5th about the edge axis (flap), 6th torsion"
        tree.note("used", f"{ELASTIC}.structural_damping.mu", "damping over stiffness", why)
    elif mu is not None:
        tree.note("ignored", f"{ELASTIC}.structural_damping.mu", "structural damping", "all zero: not given")
    if tree.get(f"{ELASTIC}.point_mass") is not None:
        tree.note("ignored", f"{ELASTIC}.point_mass", "point masses on the blade", "the beam has distributed mass only")
    return content


def _stiffness(tree: Tree, grid: Float) -> Float:
    """(S, 6, 6) section stiffness; missing entries are zero."""
    path = f"{ELASTIC}.stiffness_matrix"
    K = np.zeros((len(grid), 6, 6))
    for i in range(6):
        for j in range(i, 6):
            name = f"K{i + 1}{j + 1}"
            if i == j or tree.get(f"{path}.{name}") is not None:
                K[:, i, j] = K[:, j, i] = tree.at(path, grid, name)
    _check_axes(tree, grid, K)
    return K


def _check_axes(tree: Tree, grid: Float, K: Float) -> None:
    outer = grid > OUTBOARD
    if np.mean(K[outer, 3, 3] < K[outer, 4, 4]) > 0.5:
        raise InputError(
            f"{tree.where}: {ELASTIC}.stiffness_matrix: beyond {100 * OUTBOARD:g} % of the span K44 is mostly less "
            "than K55, so x seems to lie along the chord; expected is x across the chord, y towards the trailing "
            "edge, z towards the tip, as in BeamDyn, so that K44 is the edgewise bending stiffness: turn the matrices"
        )


def _mass(tree: Tree, grid: Float) -> Float:
    """(S, 6, 6) section mass about the reference axis, like the moments of inertia of the file."""
    path = f"{ELASTIC}.inertia_matrix"
    m, x, y, edge, flap, polar, product = (
        tree.at(path, grid, name) for name in ("mass", "cm_x", "cm_y", "i_edge", "i_flap", "i_plr", "i_cp")
    )
    M = np.zeros((len(grid), 6, 6))
    M[:, 0, 0] = M[:, 1, 1] = M[:, 2, 2] = m
    M[:, 0, 5] = M[:, 5, 0] = -m * y
    M[:, 1, 5] = M[:, 5, 1] = m * x
    M[:, 2, 3] = M[:, 3, 2] = m * y
    M[:, 2, 4] = M[:, 4, 2] = -m * x
    M[:, 3, 3], M[:, 4, 4], M[:, 5, 5] = edge, flap, polar
    M[:, 3, 4] = M[:, 4, 3] = -product
    return M
