"""Tower and monopile of a windIO file: upright tubes from section properties or wall layers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.exchange.pile import pile_foundation
from meltemi.exchange.windio.tree import Tree

Float = NDArray[np.float64]

SHEAR_FACTOR = 0.5
"""Share of the area of a thin-walled tube that carries shear."""


@dataclass(frozen=True)
class Tube:
    """Beam properties of a tube.

    Attributes:
      height: (S,) [m] height of the stations.
      diameter: (S,) [m] outer diameter.
      mass: (S,) [kg/m] mass per length.
      bending, torsion: (S,) [N m^2] stiffness.
      axial, shear: (S,) [N] stiffness.
    """

    height: Float
    diameter: Float
    mass: Float
    bending: Float
    torsion: Float
    axial: Float
    shear: Float


def tube(tree: Tree, part: str, *, outfitted: bool = True) -> Tube:
    """The tube of ``components.tower`` or ``components.monopile``; layers are nested.

    Args:
      outfitted: include the outfitting in the mass.

    Raises:
      InputError: data are missing, or a wall is thicker than the radius.
    """
    axis, shape = f"{part}.reference_axis.z", f"{part}.outer_shape.outer_diameter"
    grids = [tree.curve(axis)[0], tree.curve(shape)[0]]
    layers = tree.entries(f"{part}.structure.layers")
    for i in range(len(layers)):
        grids.append(_curve(tree, part, layers, i)[0])
    grid = np.unique(np.concatenate(grids))
    height, diameter = tree.at(axis, grid), tree.at(shape, grid)
    mass, bending, torsion, axial, shear = np.zeros((5, len(grid)))
    outer = 0.5 * diameter
    for i, layer in enumerate(layers):
        material = _material(tree, str(layer.get("material")))
        E, rho = (_constant(tree, material, key) for key in ("E", "rho"))
        G = _constant(tree, material, "G") if "G" in material else 0.5 * E / (1.0 + _constant(tree, material, "nu"))
        inner = outer - np.interp(grid, *_curve(tree, part, layers, i))
        if np.any(inner < 0.0):
            raise InputError(f"{tree.where}: {part}.structure.layers: the wall is thicker than the tube's radius")
        area, second = np.pi * (outer**2 - inner**2), 0.25 * np.pi * (outer**4 - inner**4)
        mass += rho * area
        bending, torsion = bending + E * second, torsion + 2.0 * G * second
        axial, shear = axial + E * area, shear + SHEAR_FACTOR * G * area
        outer = inner
    mass *= (tree.number(f"{part}.structure.outfitting_factor") if outfitted else None) or 1.0
    return Tube(height, diameter, mass, bending, torsion, axial, shear)


def _curve(tree: Tree, part: str, layers: list[dict[str, Any]], i: int) -> tuple[Float, Float]:
    one = Tree({"thickness": layers[i].get("thickness")}, f"{tree.where}: {part}.structure.layers {i + 1}")
    return one.curve("thickness")


def _material(tree: Tree, name: str) -> dict[str, Any]:
    known = {str(m.get("name")): m for m in tree.entries("materials")}
    if name not in known:
        raise InputError(f"{tree.where}: no material {name!r}: {did_you_mean(name, known)}")
    material: dict[str, Any] = known[name]
    return material


def _constant(tree: Tree, material: dict[str, Any], key: str) -> float:
    try:
        return float(material[key])
    except (KeyError, TypeError, ValueError):
        raise InputError(f"{tree.where}: materials {material.get('name')}: {key} must be a number") from None


def read_tower(tree: Tree) -> dict[str, Any]:
    """Content of ``Turbine.tower``, as far as available in the file.

    Section properties of the file where available, otherwise from its wall layers.
    """
    part = "components.tower"
    elastic = f"{part}.structure.elastic_properties"
    layered = tree.get(f"{part}.structure.layers") is not None
    content: dict[str, Any] = {"source": tree.source}
    if tree.get(f"{elastic}.stiffness_matrix") is not None:
        K, M = f"{elastic}.stiffness_matrix", f"{elastic}.inertia_matrix"
        axis, shape = f"{part}.reference_axis.z", f"{part}.outer_shape.outer_diameter"
        grid = np.unique(np.concatenate([tree.curve(path)[0] for path in (axis, shape)] + [tree.numbers(f"{K}.grid")]))
        height = tree.at(axis, grid)
        content |= {
            "mass": tree.at(M, grid, "mass"),
            "side_side_stiffness": tree.at(K, grid, "K44"),
            "fore_aft_stiffness": tree.at(K, grid, "K55"),
            "torsion_stiffness": tree.at(K, grid, "K66"),
            "diameter": tree.at(shape, grid),
        }
        if tree.get(f"{K}.K33") is not None:
            content["axial_stiffness"] = tree.at(K, grid, "K33")
        if tree.get(f"{K}.K11") is not None and tree.get(f"{K}.K22") is not None:
            content["shear_stiffness"] = 0.5 * (tree.at(K, grid, "K11") + tree.at(K, grid, "K22"))
        if "axial_stiffness" not in content and layered:
            walls = tube(tree, part, outfitted=False)
            content["axial_stiffness"] = np.interp(height, walls.height, walls.axial)
            tree.note("approximated", f"{K}.K33", "axial stiffness", "from the walls")
        tree.note("used", elastic, "mass and stiffness of the tower")
    elif layered:
        walls = tube(tree, part)
        height = walls.height
        content |= {
            "mass": walls.mass,
            "fore_aft_stiffness": walls.bending,
            "side_side_stiffness": walls.bending,
            "torsion_stiffness": walls.torsion,
            "axial_stiffness": walls.axial,
            "diameter": walls.diameter,
        }
        tree.note("used", f"{part}.structure.layers", "mass and stiffness of the tower", "sections of a tube")
    else:
        raise InputError(f"{tree.where}: {part}.structure needs elastic_properties or layers")
    yaw = "components.yaw.elastic_properties.mass"
    if mass := tree.number(yaw):
        content["top_mass"] = mass
        tree.note("used", yaw, "tower.top_mass", f"{mass:.6g} kg of the yaw system")
    content |= {"position": height - height[0], "base_height": float(height[0])}
    if tree.get(f"{part}.outer_shape.cd") is not None:
        content["drag_coefficient"] = float(np.mean(tree.curve(f"{part}.outer_shape.cd")[1]))
    mu = f"{elastic}.structural_damping.mu"
    if tree.get(mu) is not None:
        why = "the format does not say which entry is which strain"
        tree.note("ignored", mu, "structural damping of the tower", why)
    return content


def read_pile(tree: Tree, mudline: float) -> dict[str, Any]:
    """Content of ``Turbine.foundation``: the monopile, clamped at the mudline.

    Raises:
      InputError: the file has no monopile, or it does not reach from the mudline to the tower base.
    """
    part = "components.monopile"
    if tree.get(part) is None:
        raise InputError(f"{tree.where}: foundation is 'pile', but {part} is missing")
    walls = tube(tree, part)
    low, high = walls.height[0], walls.height[-1]
    if not low <= mudline < high:
        raise InputError(f"{tree.where}: mudline {mudline:g} m lies outside the monopile, {low:g} to {high:g} m")
    height = np.concatenate([[mudline], walls.height[walls.height > mudline]])
    bending, shear, axial, torsion, mass = (
        np.interp(height, walls.height, values)
        for values in (walls.bending, walls.shear, walls.axial, walls.torsion, walls.mass)
    )
    source = f"{tree.source}: {part}, clamped at {mudline:g} m; no soil, no water"
    foundation = pile_foundation(height, bending, shear, axial, torsion, mass, source)
    piece = tree.number(f"{part}.transition_piece_mass") or 0.0
    tree.note("approximated", part, "monopile", f"springs at its top; clamped at {mudline:g} m, no soil, no water")
    return foundation.replace(mass=foundation.mass + piece).content()
