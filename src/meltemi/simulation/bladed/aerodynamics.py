"""Arrays of the aerodynamics of a bladed turbine: nodes, polars, flaps, flow at the tower."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meltemi.aero import stall_tables, variants
from meltemi.aero.flaps import ALPHAS, DELTAS
from meltemi.aero.tables import AeroNode, AeroOptions, AeroParameters, PolarPoint, SectionConstants, TowerFlow
from meltemi.compiler import View
from meltemi.core.errors import InputError
from meltemi.core.variants import number
from meltemi.environment.site import Environment
from meltemi.simulation.options import ModelOptions
from meltemi.structure.beam import section_axes
from meltemi.structure.members import NodeLayout
from meltemi.turbine.definition import Airfoil, Turbine

Float = NDArray[np.float64]

POLAR_STEP = np.radians(0.25)
"""[rad] step of the polars' grid, which contains the usual half and whole degrees of polar files."""
FADE_BEGIN, FADE_END = 1.0, 2.0
"""Tip-speed ratios over which the induction fades in."""
SKEW_FACTOR = 15.0 * np.pi / 32.0
"""Factor of the skewed-wake correction, Pitt and Peters (1981)."""
INFLOW_LEAD = 0.6
"""Factor k of the dynamic inflow model (Øye)."""
RING_CENTRE, RING_WIDTH = 0.7, 0.1
"""Relative radius and half-width of the annulus whose mean induction determines the time constants of the inflow."""


def polars_outside(
    turbine: Turbine, environment: Environment, position: Float, polars: Float, section: Float, index: NDArray[np.int64]
) -> tuple[Float, Float, NDArray[np.int64]]:
    """Polars of clean, dry blades with the effects of ice and rain; the index is then that of each blade."""
    nearest = np.repeat(index[None, :], turbine.n_blades, axis=0)
    if turbine.icing is not None:
        from meltemi.simulation.ice import iced_polars

        polars, section, nearest = iced_polars(turbine, turbine.icing, position, polars, section, index)
    if environment.rain is not None:
        from meltemi.simulation.rain import wet_polars

        polars, section, nearest = wet_polars(
            turbine, environment, environment.rain, position, polars, section, nearest
        )
    return polars, section, nearest


def aero_parameters(turbine: Turbine, layout: NodeLayout, environment: Environment, options: ModelOptions) -> Float:
    """Parameters of the aerodynamics of a model."""
    array = AeroParameters.zeros()
    v = View(AeroParameters, array)
    c, advanced = options.stall_constants, options.advanced
    v["air_density"] = environment.density
    v["tip_factor"] = turbine.rotor_radius / (turbine.hub.radius + layout.position[-1])
    v["induction_tolerance"] = advanced.induction_tolerance
    v["inflow_lead"], v["inflow_time"], v["skew_factor"] = INFLOW_LEAD, options.inflow_time, SKEW_FACTOR
    v["axial_drag"], v["tangential_drag"] = float(options.axial_drag), float(options.tangential_drag)
    v["fade_begin"], v["fade_end"] = FADE_BEGIN, FADE_END
    v["stall_a1"], v["stall_a2"], v["stall_b1"], v["stall_b2"] = c.a1, c.a2, c.b1, c.b2
    v["stall_pressure"], v["stall_separation"] = c.pressure_lag, c.separation_lag
    v["chord_angle"] = float(advanced.chord_angle == "openfast")
    return array


def aero_options(options: ModelOptions) -> NDArray[np.int64]:
    """Options of the aerodynamics as integers."""
    array, advanced = np.zeros(len(AeroOptions), dtype=np.int64), options.advanced
    chosen = {
        "wake": int(options.wake != "none"),
        "high_induction": ("none", "buhl", "madsen").index(advanced.high_induction),
        "skew": ("none", "glauert").index(options.skew),
        "inflow": number(variants.InflowModel, options.inflow),
        "stall": number(variants.StallModel, options.stall),
        "stall_rotation": ("none", "camber", "openfast").index(advanced.stall_rotation),
        "reversed_flow": ("static", "lagged").index(advanced.reversed_flow),
        "tower": number(variants.TowerInfluence, options.tower_influence),
        "tower_drag": int(options.tower_drag),
        "iterations": advanced.induction_iterations,
        "skew_momentum": ("axial", "glauert", "cylinder").index(options.skew_momentum),
    }
    for name, value in chosen.items():
        array[AeroOptions.index(name)] = value
    return array


def aero_nodes(turbine: Turbine, layout: NodeLayout, options: ModelOptions, polar_index: NDArray[np.int64]) -> Float:
    """(fields, blades, nodes) table of the aerodynamic nodes."""
    a, B = turbine.blade.aerodynamics, turbine.n_blades
    s = layout.position
    rows = AeroNode.zeros(blade=1, node=len(s))[:, 0, :]
    v = View(AeroNode, rows)

    def at(values: Float | None) -> Float:
        return np.zeros(len(s)) if values is None else np.interp(s, a.position, values)

    structure = turbine.blade.structure
    zero = np.zeros(len(structure.position))
    axis_x = zero if structure.axis_x is None else structure.axis_x
    axis_y = zero if structure.axis_y is None else structure.axis_y
    v["chord"] = at(a.chord)
    # the aerodynamic centre is given from the pitch axis, the node is on the beam axis
    v["centre"] = np.stack(
        [
            at(a.centre_x) - np.interp(s, structure.position, axis_x),
            at(a.centre_y) - np.interp(s, structure.position, axis_y),
            np.zeros(len(s)),
        ]
    )
    if a.cant is not None:
        slope = [np.tan(at(a.cant)), np.zeros(len(s))]
    else:
        slope = [np.interp(s, structure.position, np.gradient(x, structure.position)) for x in (axis_x, axis_y)]
    axes = section_axes(at(a.twist), np.stack([*slope, np.ones(len(s))], axis=1))[:, :3, :3]
    v["section"] = axes.reshape(-1, 9).T
    v["solid_length"] = B * v["chord"] / (2.0 * np.pi)
    # lengths along the line of aerodynamic centres
    line = [np.diff(x) for x in (a.position, a.centre_x, a.centre_y) if x is not None]
    arc = np.concatenate([[0.0], np.cumsum(np.sqrt(np.sum(np.square(line), axis=0)))])
    v["length"] = np.diff(np.interp(layout.edges, a.position, arc))
    root, end, hub = np.interp(s, a.position, arc), arc[-1], turbine.hub.radius
    v["tip_number"] = B * (end - root) / (2.0 * (hub + root)) if options.tip_loss else 1e9
    v["hub_number"] = B * root / (2.0 * max(hub, 1e-9)) if options.hub_loss else 1e9
    v["end"] = ((v["tip_number"] < 1e-9) | (v["hub_number"] < 1e-9)).astype(float)
    radius, tip = hub + s, turbine.rotor_radius
    area = radius * layout.length
    v["area"] = area / area.sum() / B
    u = np.clip((radius / tip - RING_CENTRE) / RING_WIDTH, -1.0, 1.0)
    ring = (1.0 - u * u) ** 3 * layout.length
    if ring.sum() <= 0.0:
        ring = np.where(np.abs(radius / tip - RING_CENTRE) == np.min(np.abs(radius / tip - RING_CENTRE)), 1.0, 0.0)
    v["ring"] = ring / ring.sum() / B
    array = per_blade(turbine, rows)
    View(AeroNode, array)["polar"] = polar_index
    return array


def polars_of(turbine: Turbine, layout: NodeLayout, options: ModelOptions) -> tuple[Float, Float, NDArray[np.int64]]:
    """Polars at the nodes on the common grid: (g, rows, columns), (g, constants), index of each node."""
    n = round(2.0 * np.pi / POLAR_STEP) + 1
    grid = np.linspace(-np.pi, np.pi, n)
    a = turbine.blade.aerodynamics
    tables = {name: _table(airfoil, grid, options) for name, airfoil in turbine.airfoils.items()}
    indices: dict[tuple[str, str, float], int] = {}
    polars: list[Float] = []
    sections: list[Float] = []
    index = np.zeros(len(layout.position), dtype=np.int64)
    for i, s in enumerate(layout.position):
        j = int(np.clip(np.searchsorted(a.position, s, side="right") - 1, 0, len(a.position) - 2))
        w = float((s - a.position[j]) / (a.position[j + 1] - a.position[j]))
        inner, outer = a.airfoil[j], a.airfoil[j + 1]
        if inner == outer or w < 1e-6:
            outer, w = inner, 0.0
        elif w > 1.0 - 1e-6:
            inner, w = outer, 0.0
        key = (inner, outer, w)
        if key not in indices:
            indices[key] = len(polars)
            polar, section = tables[inner]
            if w > 0.0:
                other, constants = tables[outer]
                polar = (1.0 - w) * polar + w * other
                dynamic = min(section[SectionConstants.index("dynamic")], constants[SectionConstants.index("dynamic")])
                section = (1.0 - w) * section + w * constants
                section[SectionConstants.index("dynamic")] = dynamic
                if dynamic > 0.0 and options.advanced.stall_fit == "hansen":  # the fit to the blend, which it recovers
                    polar, section = _stall_columns(grid, polar, section)
            polars.append(polar)
            sections.append(section)
        index[i] = indices[key]
    if options.rotational_augmentation != "none":
        return _augmented(turbine, layout, options, grid, [polars[i] for i in index], [sections[i] for i in index])
    return np.stack(polars), np.stack(sections), index


def _augmented(
    turbine: Turbine, layout: NodeLayout, options: ModelOptions, grid: Float, polars: list[Float], sections: list[Float]
) -> tuple[Float, Float, NDArray[np.int64]]:
    """Polars at the nodes with a separate polar for each node, corrected for the rotation of the blade."""
    from meltemi.aero.rotational_augmentation import augmented

    if options.advanced.stall_fit != "hansen":
        raise InputError("rotational_augmentation needs advanced.stall_fit 'hansen': OpenFAST's is that of the airfoil")
    a, s = turbine.blade.aerodynamics, layout.position
    ratio = np.interp(s, a.position, a.chord) / (turbine.hub.radius + s)
    twist = np.interp(s, a.position, a.twist)
    columns = [PolarPoint.index(name) for name in ("lift", "drag", "moment")]
    for i, section in enumerate(sections):
        if section[SectionConstants.index("dynamic")] > 0.0:
            polar = polars[i].copy()
            polar[:, columns] = augmented(grid, polar[:, columns], ratio[i], twist[i], options.rotational_augmentation)
            polars[i], sections[i] = _stall_columns(grid, polar, section)
    return np.stack(polars), np.stack(sections), np.arange(len(s))


def _table(airfoil: Airfoil, grid: Float, options: ModelOptions) -> tuple[Float, Float]:
    """Polar on the grid, and its constants."""
    polar = np.zeros((len(grid), len(PolarPoint)))
    for name in ("lift", "drag", "moment"):
        polar[:, PolarPoint.index(name)] = np.interp(grid, airfoil.angle_of_attack, getattr(airfoil, name))
    lift, drag = PolarPoint.index("lift"), PolarPoint.index("drag")
    if options.deep_stall == "plate" and np.ptp(airfoil.lift) >= 0.01:
        from meltemi.aero.deep_stall import plate_polar

        polar[:, lift], polar[:, drag] = plate_polar(grid, polar[:, lift], polar[:, drag])
    section = np.zeros(len(SectionConstants))
    if not airfoil.dynamic_stall or np.ptp(airfoil.lift) < 0.01:
        return polar, section
    section[SectionConstants.index("dynamic")] = 1.0
    if options.advanced.stall_fit == "hansen":
        return _stall_columns(grid, polar, section)
    if airfoil.zero_lift_angle is None or airfoil.zero_lift_drag is None:
        raise InputError(
            "advanced.stall_fit 'openfast' needs zero_lift_angle and zero_lift_drag of every airfoil with dynamic stall"
        )
    t = stall_tables.openfast(
        airfoil.angle_of_attack, airfoil.lift, airfoil.drag, airfoil.zero_lift_angle, airfoil.zero_lift_drag
    )
    columns = {"attachment": t.attachment, "attached_lift": t.attached_lift, "separated_lift": t.separated_lift}
    for name, values in columns.items():
        polar[:, PolarPoint.index(name)] = np.interp(grid, airfoil.angle_of_attack, values)
    view = View(SectionConstants, section)
    view["slope"], view["zero_lift"], view["drag_floor"] = t.slope, t.zero_lift, t.drag_floor
    return polar, section


def _stall_columns(grid: Float, polar: Float, section: Float) -> tuple[Float, Float]:
    """Columns and constants of the dynamic stall model for a polar on the grid."""
    t = stall_tables.hansen(grid, polar[:, PolarPoint.index("lift")], polar[:, PolarPoint.index("drag")])
    polar, section = polar.copy(), section.copy()
    polar[:, PolarPoint.index("attachment")] = t.attachment
    polar[:, PolarPoint.index("attached_lift")] = t.attached_lift
    polar[:, PolarPoint.index("separated_lift")] = t.separated_lift
    view = View(SectionConstants, section)
    view["slope"], view["zero_lift"], view["drag_floor"] = t.slope, t.zero_lift, t.drag_floor
    return polar, section


def tower_flow(turbine: Turbine, layout: NodeLayout) -> Float:
    """Rows of the flow at the nodes of the tower."""
    array = TowerFlow.zeros(node=len(layout.position))
    v = View(TowerFlow, array)
    t = turbine.tower
    v["height"] = t.base_height + layout.position
    v["diameter"] = np.interp(layout.position, t.position, t.diameter)
    v["drag"], v["length"] = t.drag_coefficient, layout.length
    return array


def flap_nodes(turbine: Turbine, layout: NodeLayout) -> Float:
    """(F, blades, nodes) fraction of each node's length that a flap covers."""
    inner, outer = layout.edges[:-1], layout.edges[1:]
    length = turbine.blade.length
    shares = np.zeros((len(turbine.blade.flaps), turbine.n_blades, len(layout.position)))
    for share, flap in zip(shares, turbine.blade.flaps, strict=True):
        covered = np.minimum(outer, flap.end * length) - np.maximum(inner, flap.begin * length)
        share[:] = np.maximum(covered, 0.0) / np.maximum(outer - inner, 1e-9)
    return shares


def flap_increments(turbine: Turbine) -> Float:
    """(F, ALPHAS DELTAS, 3) increments on the grid of the kernels."""
    if not turbine.blade.flaps:
        return np.zeros((0, ALPHAS * DELTAS, 3))
    from meltemi.simulation.flaps import increments

    return increments(turbine)


def per_blade(turbine: Turbine, rows: Float) -> Float:
    """(rows, blades, nodes) from (rows, nodes)."""
    return np.ascontiguousarray(np.repeat(rows[:, None, :], turbine.n_blades, axis=1))
