"""Polars of a windIO file, interpolated along the blade by relative thickness."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.exchange.windio.tree import Tree, as_entries, as_number, as_numbers

Float = NDArray[np.float64]

THICKEST = 0.5
"""Relative thickness beyond which a section has no attached flow that stall could be dynamic from."""
NO_STALL = f"none on sections thicker than {100 * THICKEST:g} %"
ROUNDING = 1e-4
"""Relative thickness within which stations share a polar."""
COEFFICIENTS = {"cl": "lift", "cd": "drag", "cm": "moment"}


def blended(tree: Tree, shape: str, grid: Float, reynolds: float | None) -> tuple[list[str], dict[str, Any], Float]:
    """Airfoils at grid points of the blade.

    Without a distribution of thickness along the blade in the file it is interpolated through the airfoils' positions
    (PCHIP, as the format specifies).

    Returns:
      Names of the stations' airfoils, content of ``Turbine.airfoils``, aerodynamic centres [chord] from the leading
      edge.
    """
    masters = _masters(tree, shape, reynolds)
    thickness = _thickness(tree, shape, grid, masters)
    names, airfoils = by_thickness(thickness, masters, tree.source)
    why = f"{len(masters)} airfoils, blended by relative thickness at {len(airfoils)}"
    tree.note("used", f"{shape}.airfoils", "polars", why)
    tree.note("approximated", f"{shape}.airfoils", "dynamic stall", NO_STALL)
    order = sorted({m["thickness"]: m["centre"] for m in masters}.items())
    return names, airfoils, np.interp(thickness, *np.array(order).T)


def by_thickness(
    thickness: Float, masters: list[dict[str, Any]], source: str
) -> tuple[list[str], dict[str, dict[str, Any]]]:
    """Airfoils of stations, linearly interpolated in relative thickness between master airfoils.

    Args:
      thickness: (S,) relative thickness of the stations.
      masters: name, thickness, angles [rad], lift, drag and moment of each master airfoil.
      source: origin of the masters.

    Returns:
      Names of the stations' airfoils, content of ``Turbine.airfoils``.
    """
    order = sorted({_rounded(m["thickness"]): m for m in masters}.items())
    known = np.array([t for t, _ in order])
    angles = np.unique(np.concatenate([m["angles"] for _, m in order]))
    table = np.stack(
        [np.stack([np.interp(angles, m["angles"], m[name]) for name in COEFFICIENTS.values()]) for _, m in order]
    )
    names, airfoils = [], {}
    for t in map(_rounded, thickness):
        j = int(np.clip(np.searchsorted(known, t, side="right") - 1, 0, max(len(known) - 2, 0)))
        k = min(j + 1, len(known) - 1)
        w = float(np.clip((t - known[j]) / (known[k] - known[j]), 0.0, 1.0)) if k > j else 0.0
        inner, outer = order[j][1]["name"], order[k][1]["name"]
        name = inner if w == 0.0 else outer if w == 1.0 else f"{100 * t:.2f} % thick"
        names.append(name)
        polar = (1.0 - w) * table[j] + w * table[k]
        airfoils[name] = {
            "angle_of_attack": angles,
            **dict(zip(COEFFICIENTS.values(), polar, strict=True)),
            "dynamic_stall": bool(t <= THICKEST),
            "source": f"{source}: {1.0 - w:.3f} {inner} + {w:.3f} {outer}",
        }
    return names, airfoils


def _rounded(thickness: float) -> float:
    return float(round(thickness / ROUNDING) * ROUNDING)


def _thickness(tree: Tree, shape: str, grid: Float, masters: list[dict[str, Any]]) -> Float:
    if tree.get(f"{shape}.rthick") is not None:
        thickness = tree.at(f"{shape}.rthick", grid)
    else:
        from scipy.interpolate import PchipInterpolator

        if any(m["position"] is None for m in masters):
            raise InputError(f"{tree.where}: {shape}: rthick is missing, so every airfoil needs a spanwise_position")
        places = {m["position"]: m["thickness"] for m in masters}
        x = np.array(sorted(places))
        thickness = PchipInterpolator(x, [places[p] for p in x])(np.clip(grid, x[0], x[-1]))
        tree.note("approximated", f"{shape}.rthick", "relative thickness", "PCHIP through the airfoils' positions")
    return np.round(thickness / ROUNDING) * ROUNDING


def _masters(tree: Tree, shape: str, reynolds: float | None) -> list[dict[str, Any]]:
    """The airfoils used by the blade."""
    library = {str(a.get("name")): a for a in tree.entries("airfoils")}
    masters = []
    for i, entry in enumerate(tree.entries(f"{shape}.airfoils")):
        name = str(entry.get("name"))
        if name not in library:
            raise InputError(f"{tree.where}: {shape}.airfoils {i + 1} names {name!r}: {did_you_mean(name, library)}")
        airfoil = library[name]
        where = f"airfoils {name}"
        masters.append(
            {
                "name": name,
                "thickness": _rounded(as_number(airfoil.get("rthick"), f"{tree.where}: {where}: rthick")),
                "centre": as_number(
                    airfoil.get("aerodynamic_center", 0.25), f"{tree.where}: {where}: aerodynamic_center"
                ),
                "position": entry.get("spanwise_position"),
                **_polar(tree, where, airfoil, entry, reynolds),
            }
        )
    return masters


def _polar(
    tree: Tree, where: str, airfoil: dict[str, Any], entry: dict[str, Any], reynolds: float | None
) -> dict[str, Any]:
    """Angles [rad] and coefficients: weighted mean of the configurations used by the blade."""
    polars = as_entries(airfoil.get("polars"), f"{tree.where}: {where}: polars")
    sets = {str(p.get("configuration", "default")): p for p in polars}
    named = entry.get("configuration", [next(iter(sets))])
    wanted = [str(c) for c in (named if isinstance(named, list) else [named])]
    weights = as_numbers(entry.get("weight", [1.0] * len(wanted)), f"{tree.where}: {where}: weight", len(wanted))
    if abs(weights.sum() - 1.0) > 1e-3:
        raise InputError(f"{tree.where}: {where}: weights must have the sum 1, but have {weights.sum():g}")
    parts = []
    for configuration in wanted:
        if configuration not in sets:
            raise InputError(f"{tree.where}: {where}: no polars {configuration!r}: {did_you_mean(configuration, sets)}")
        parts.append(_chosen(tree, where, sets[configuration].get("re_sets"), reynolds))
    angles = np.unique(np.concatenate([curve[0] for part in parts for curve in part.values()]))
    if angles[0] > np.radians(-179.9) or angles[-1] < np.radians(179.9):
        first, last = np.degrees(angles[[0, -1]])
        raise InputError(f"{tree.where}: {where}: polars must reach from -180 to 180 deg, found {first:g} to {last:g}")
    mixed = {
        name: sum(w * np.interp(angles, *part[key]) for w, part in zip(weights, parts, strict=True))
        for key, name in COEFFICIENTS.items()
    }
    return {"angles": angles, **mixed}


def _chosen(tree: Tree, where: str, polars: Any, reynolds: float | None) -> dict[str, tuple[Float, Float]]:
    """The polar with the nearest Reynolds number (by ratio)."""
    sets = as_entries(polars, f"{tree.where}: {where}: re_sets")
    numbers = [as_number(s.get("re", 1.0), f"{tree.where}: {where}: re") for s in sets]
    if min(numbers) <= 0.0:
        raise InputError(f"{tree.where}: {where}: re must be positive")
    wanted = reynolds or max(numbers)
    pick = int(np.argmin(np.abs(np.log(np.array(numbers) / wanted))))
    if len(sets) > 1:
        why = f"Re {numbers[pick]:.3g} of {', '.join(f'{n:.3g}' for n in sorted(numbers))}: nearest to {wanted:.3g}"
        tree.note("approximated", where, "polar", why)
    curves = {}
    for key in COEFFICIENTS:
        curve = sets[pick].get(key)
        if not isinstance(curve, dict):
            raise InputError(f"{tree.where}: {where}: {key} is missing")
        grid = np.radians(as_numbers(curve.get("grid"), f"{tree.where}: {where}: {key}.grid"))
        if np.any(np.diff(grid) <= 0.0):
            raise InputError(f"{tree.where}: {where}: {key}.grid must increase (degrees, -180 to 180)")
        values = as_numbers(curve.get("values"), f"{tree.where}: {where}: {key}.values", len(grid))
        curves[key] = (grid, values)
    return curves
