"""ElastoDyn's discretisation of the blade in our equations, which explains differences in deflections.

ElastoDyn cuts the blade into 17 equal elements and takes everything at their middles: mass, stiffness,
curvature; slopes and displacements are sums of half elements. This costs 1 to 2 % in its first flap mode.
Here a model of ours gets exactly these numbers in place of its finite elements; what deviated before then
agrees, so the discretisation is the reason and not the equations of motion.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparisons.rigid import spinning
from meltemi.aero.tables import AeroNode
from meltemi.analyses.modes import natural_modes
from meltemi.environment.site import Environment
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.rotors import build
from meltemi.structure.tables import BladeNode
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import load_turbine
from meltemi.verification.openfast_deck import (
    BLADE_SHAPES,
    ELASTODYN_MOMENTS,
    TOWER_SHAPES,
    deck_options,
    deck_turbine,
)
from meltemi.verification.table import Check, CheckTable, reference_table, relative, source_of

Float = NDArray[np.float64]
ELEMENTS, TOWER_ELEMENTS = 17, 20


def elastodyn_model(turbine: Turbine, aero: str, gravity: float = 9.80665, **changes: Any) -> BladedModel:
    """The deck's turbine with ElastoDyn's seventeen lumps and sums for the blades, and AeroDyn's nodes.

    OpenFAST takes the loads as linear between AeroDyn's nodes; here the share of each node acts at its centre.

    Args:
      turbine: the deck's.
      aero: set of options; ``changes`` of them.
      gravity: [m/s^2].
    """
    turbine = with_summed_tower(turbine)
    s = turbine.blade.structure
    assert s.flap_stiffness is not None and s.edge_stiffness is not None
    original = load_turbine("nrel5mw").blade.structure.mass
    assert original is not None
    length, h = turbine.blade.length, turbine.blade.length / ELEMENTS
    r = h * (np.arange(ELEMENTS) + 0.5)
    mass = np.interp(r, s.position, original) * h
    mass *= ELASTODYN_MOMENTS[0] / mass.sum()
    flap, edge = np.interp(r, s.position, s.flap_stiffness), np.interp(r, s.position, s.edge_stiffness)
    twist = np.interp(r, s.position, s.twist)
    polynomials = (*BLADE_SHAPES["flap"], *BLADE_SHAPES["edge"])
    curvature = np.array(
        [np.polynomial.Polynomial([0.0, 0.0, *c]).deriv(2)(r / length) / length**2 for c in polynomials]
    )
    K = np.zeros((3, 3))
    K[:2, :2] = np.einsum("kn,ln,n->kl", curvature[:2], curvature[:2], flap) * h
    K[2, 2] = np.sum(curvature[2] ** 2 * edge) * h
    # bending in the section's directions, in blade axes: flap (cos, -sin), edge (sin, cos) for twist to feather
    direction = np.stack([np.stack([np.cos(twist), -np.sin(twist)])] * 2 + [np.stack([np.sin(twist), np.cos(twist)])])
    bent = curvature[:, None, :] * direction
    slope, slope_tip = _sum(bent, h)
    shift, shift_tip = _sum(slope, h)
    quadratic = np.einsum("kcn,lcn->kln", slope, slope)
    shortening, shortening_tip = _sum(quadratic, h)

    # the air acts on the nodes of the AeroDyn file, which have no mass, and whose motion is linear between the lumps
    stations = turbine.blade.aerodynamics.position
    places = np.unique(np.concatenate([r, stations]).round(9))
    of_lumps, of_air = (np.abs(places - x[:, None]).argmin(axis=1) for x in (r, stations))

    def at_nodes(lumps: Float, tip: Float) -> Float:
        values = np.concatenate([np.zeros_like(tip)[..., None], lumps, tip[..., None]], axis=-1)
        known = np.concatenate([[0.0], r, [length]])
        rows = np.array([np.interp(places, known, row) for row in values.reshape(-1, ELEMENTS + 2)])
        return np.ascontiguousarray(np.repeat(rows[:, None], turbine.n_blades, axis=1))

    options = deck_options(turbine, aero, blade_nodes=tuple(places.tolist()), **changes)
    model = build(turbine, options, Environment(gravity=gravity))
    air, own = model.rotor.aero_nodes.copy(), build(turbine, deck_options(turbine, aero)).rotor.aero_nodes
    for name in ("length", "area", "ring"):
        air[AeroNode.index(name)] = 0.0
    for row in set(range(len(AeroNode.names))) - {AeroNode.index("polar")}:  # polars have other numbers there
        air[row][:, of_air] = own[row]
    for axis, x in zip("xyz", (*(own[AeroNode.index(f"centre_{axis}")][0] for axis in "xy"), stations), strict=True):
        air[AeroNode.index(f"centre_{axis}")][:, of_air] += _centres(stations, x) - x
    nodes = np.zeros_like(model.rotor.blade_nodes)
    nodes[BladeNode.index("position_z")] = turbine.hub.radius + places
    nodes[BladeNode.index("mass")][:, of_lumps] = mass
    shape = np.zeros((3, 6, ELEMENTS))
    shape[:, 0], shape[:, 1], shape[:, 3], shape[:, 4] = shift[:, 0], shift[:, 1], -slope[:, 1], slope[:, 0]
    second = np.zeros((3, 3, 3, ELEMENTS))
    second[:, :, 2] = -shortening
    tip_shape, tip_second = np.zeros((6, 3)), np.zeros((3, 3, 3))
    tip_shape[:2], tip_shape[3], tip_shape[4] = shift_tip.T, -slope_tip[:, 1], slope_tip[:, 0]
    tip_second[2] = -shortening_tip
    uncoupled = np.sqrt(np.diag(K) / np.einsum("kn,n->k", _untwisted(curvature, h) ** 2, mass))
    damping = K * (2.0 * 0.00477465 / uncoupled)[None, :]
    return model.with_arrays(
        blade_nodes=nodes,
        aero_nodes=air,
        shape=at_nodes(shape, tip_shape.T),
        second=at_nodes(second, np.moveaxis(tip_second, 0, -1)),
        tip_shape=tip_shape,
        tip_second=tip_second,
        modal=np.repeat(np.stack([K, damping])[:, None], model.n_blades, axis=1),
    )


def in_vacuum(model: BladedModel) -> BladedModel:
    """The model without air."""
    return model.with_parameters(**{"aerodynamics.air_density": 0.0})


def _sum(f: Float, h: float) -> tuple[Float, Float]:
    """Integral from the root at the middles of the elements and at the tip, by half elements."""
    whole = np.cumsum(f, axis=-1) * h
    return whole - 0.5 * h * f, whole[..., -1]


def with_summed_tower(turbine: Turbine) -> Turbine:
    """The turbine with a tower as stiff in its first modes as ElastoDyn's sums over the middles of its elements."""
    tower, changes = turbine.tower, {}
    middles, fine = ((np.arange(n) + 0.5) / n for n in (TOWER_ELEMENTS, 100 * TOWER_ELEMENTS))
    for name, (first, _) in TOWER_SHAPES.items():
        curvature, stiffness = (
            np.polynomial.Polynomial([0.0, 0.0, *first]).deriv(2),
            getattr(tower, f"{name}_stiffness"),
        )
        ours, theirs = (
            np.mean(np.interp(x * tower.length, tower.position, stiffness) * curvature(x) ** 2) for x in (fine, middles)
        )
        changes[f"tower.{name}_stiffness"] = (stiffness * theirs / ours).tolist()
    return turbine.replace(**changes)


def _centres(r: Float, x: Float) -> Float:
    """Means of x, linear between its values at nodes r, under the hat functions of the nodes."""
    h = np.diff(r)
    moments = np.append(h * (2.0 * x[:-1] + x[1:]), 0.0) + np.append(0.0, h * (x[:-1] + 2.0 * x[1:]))
    return moments / (3.0 * (np.append(h, 0.0) + np.append(0.0, h)))


def _untwisted(curvature: Float, h: float) -> Float:
    return _sum(_sum(curvature, h)[0], h)[0]


def discretisation() -> CheckTable:
    """Modes and spinning in vacuum with ElastoDyn's discretisation of the blade."""
    rows: list[Check] = []
    turbine = deck_turbine(load_turbine("nrel5mw"))
    modes = natural_modes(in_vacuum(elastodyn_model(turbine, "A", 0.0)))
    table = reference_table("modes", case="lin_0rpm_g0_genfix")
    for mode, r in zip(modes, table, strict=False):
        where = f"{r['mode']} {r['participation'].split(' 1.00')[0]}"
        rows.append(
            relative("frequency at rest", where, "Hz", float(r["frequency_hz"]), mode.frequency / (2 * np.pi), 0.5)
        )
    model = in_vacuum(elastodyn_model(turbine, "A", locked=("yaw", "generator")))
    rows += spinning(model, ("OoPDefl1", "IPDefl1", "RootMyc1", "RootMxc1"), 0.5, "spin, ")
    title = "ElastoDyn's discretisation of the blade in our equations (explains deflections and flap frequencies)"
    return CheckTable("discretisation", title, source_of("modes"), rows)
