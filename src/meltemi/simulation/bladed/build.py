"""Arrays of the kernels from the description of a bladed turbine.

``build`` rejects unsupported input with a message; kernels assume valid arrays.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import MAX_BLADES, View
from meltemi.control.actuators import Actuators, FlapActuators
from meltemi.core.errors import InputError, UnsupportedError, did_you_mean
from meltemi.core.threads import one_blas_thread
from meltemi.core.variants import number
from meltemi.environment.site import Environment
from meltemi.simulation.bladed.aerodynamics import (
    aero_nodes,
    aero_options,
    aero_parameters,
    flap_increments,
    flap_nodes,
    per_blade,
    polars_of,
    polars_outside,
    tower_flow,
)
from meltemi.simulation.bladed.rotor import BladedModel, BladedRotor
from meltemi.simulation.blades import blade_model
from meltemi.simulation.model import Model, actuator_array, rows_of
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.parts import parts_of
from meltemi.structure.beam import Beam
from meltemi.structure.members import (
    MOST_RESIDUAL,
    ModalMember,
    NodeLayout,
    blade_member,
    cells,
    points,
    rigid_body,
    tower_member,
)
from meltemi.structure.tables import BladeNode, GearModes, GearRows, StructureParameters, TowerNode
from meltemi.turbine.definition import Turbine
from meltemi.turbine.exchange import ActuatorModel
from meltemi.turbine.imbalance import deviations

Float = NDArray[np.float64]

SUPPORTED = {"support": "meltemi.sea.pile_beam", "frame": "meltemi.frames.reduction"}
"""Modules whose ``supported_tower`` makes one member of a tower and the pile or frame below it."""
MOST_NATURAL = (5, 3, 2)
"""Flap, edge and torsion modes that fewer than all residual modes may complete."""


@one_blas_thread
def build_bladed(
    turbine: Turbine,
    options: ModelOptions | None = None,
    environment: Environment | None = None,
) -> BladedModel:
    """Make a model of a turbine with blades and tower.

    Args:
      turbine, options, environment: as for ``build``.

    Raises:
      UnsupportedError: the turbine or the options request a feature that is not modelled.
      InputError: options name an unknown coordinate, or modes cannot be computed.
    """
    options = options or ModelOptions()
    environment = environment or Environment()
    _refuse(turbine, options)
    blade_layout = _blade_layout(turbine, options)
    tower_layout = points(np.linspace(0.0, turbine.tower.length, options.tower_nodes))
    blade, pieces, tower = _members(turbine, options, blade_layout, tower_layout, environment.gravity)
    lift = float(tower.beam.position[-1]) - turbine.tower.length
    coordinates = _coordinates(turbine, blade, tower)
    position = blade_layout.position
    polars, section, polar_index = polars_outside(
        turbine, environment, position, *polars_of(turbine, blade_layout, options)
    )
    gears, gear_modes, gear_rows, gear_shape = _gears(turbine, options)
    k = len(tower.names)
    top = tower.modes.shape[:, -1, :].T.copy() if k else np.zeros((6, 0))
    rotor = BladedRotor(
        blade=blade,
        tower=tower,
        blade_layout=blade_layout,
        tower_layout=tower_layout,
        gear_stages=_gear_stages(turbine, options),
        blade_model=options.blade_model,
        blade_arrays=blade_model(options.blade_model).arrays(turbine, blade, blade_layout),
        gear_modes=gear_modes,
        gear_rows=gear_rows,
        gear_shape=gear_shape,
        blade_nodes=_blade_nodes(turbine, blade.beam, blade_layout, pieces),
        blade_edges=blade_layout.edges,
        shape=per_blade(turbine, _shapes(blade, blade_layout)),
        second=per_blade(turbine, _second(blade, blade_layout.position)),
        modal=np.repeat(np.stack([blade.modes.stiffness, blade.damping])[:, None], turbine.n_blades, axis=1),
        tip_shape=np.ascontiguousarray(blade.modes.shape[:, -1, :].T),
        tip_second=np.ascontiguousarray(blade.second[:, :, -1, :].transpose(2, 0, 1)),
        top_shape=top,
        top_second=np.ascontiguousarray(tower.second[:, :, -1, :].transpose(2, 0, 1)),
        tower_matrix=_tower_matrix(tower, turbine.tower.top_mass),
        tower_weight=_tower_weight(tower, turbine.tower.top_mass),
        tower_nodes=_tower_nodes(tower, tower_layout, lift),
        tower_shape=np.ascontiguousarray(_shapes(tower, tower_layout, lift)),
        aero_options=aero_options(options),
        aero_nodes=aero_nodes(turbine, blade_layout, options, polar_index),
        polars=polars,
        section=section,
        tower_flow=tower_flow(turbine, tower_layout),
        flap_nodes=flap_nodes(turbine, blade_layout),
        increments=flap_increments(turbine),
        flap_actuators=_flap_actuators(turbine),
    )
    return Model(
        turbine=turbine,
        environment=environment,
        options=options,
        coordinates=coordinates,
        locked=_locked(coordinates, options),
        structure=_structure(turbine, environment, options, gears),
        aero=aero_parameters(turbine, blade_layout, environment, options),
        actuators=_actuators(turbine, options),
        parts=parts_of(turbine, options, rotor),
        rotor=rotor,
    )


def _members(
    turbine: Turbine, options: ModelOptions, blade_layout: NodeLayout, tower_layout: NodeLayout, gravity: float
) -> tuple[ModalMember, Float, ModalMember]:
    """Blade, its pieces between cell edges, and tower; errors as for :func:`build_bladed`."""
    given = options.mode_shapes == "given"
    with _about(f"{turbine.name}: blade.structure"):
        blade = blade_member(turbine.blade.structure, blade_modes(turbine, options), blade_layout, given=given)
    axis = blade.beam.at(blade_layout.position, "axis")
    pieces = blade.beam.rigid_pieces(blade_layout.edges, axis)
    counts = {
        "fore_aft": options.fore_aft_modes,
        "side_side": options.side_side_modes,
        "torsion": options.tower_torsion_modes,
    }
    head = head_mass(turbine, pieces, axis)
    with _about(f"{turbine.name}: tower"):
        make: Any = tower_member
        for name, module in SUPPORTED.items():
            if (below := getattr(turbine, name)) is not None:
                make = partial(import_module(module).supported_tower, below)
        if turbine.frame is not None:
            make = partial(make, platform=turbine.platform, gravity=gravity)
        tower: ModalMember = make(turbine.tower, counts, head, turbine.foundation, tower_layout, given=given)
    return blade, pieces, tower


def _shapes(member: ModalMember, layout: NodeLayout, lift: float = 0.0) -> Float:
    """(6 modes, nodes) mode shapes at the nodes, which begin ``lift`` [m] above the end of the member."""
    at = member.modes.at(layout.position + lift)
    return at.transpose(0, 2, 1).reshape(6 * len(member.names), len(layout.position))


def _gear_stages(turbine: Turbine, options: ModelOptions) -> tuple[int, int]:
    """Number of planetary and of all stages of a gearbox that is modelled."""
    gearbox = turbine.drivetrain.gearbox
    if gearbox is None or options.drivetrain == "two_mass":
        return 0, 0
    return len(gearbox.planetary), len(gearbox.stages)


def blade_modes(turbine: Turbine, options: ModelOptions) -> dict[str, int]:
    """Numbers of flap, edge, torsion and residual modes of a blade: those of the options, or the defaults.

    The defaults for 6 x 6 sections give the twist of blades that bend by a tenth of their length within 0.1 deg. Above
    ``MOST_NATURAL`` modes all residual ones belong to them (docs/theory/structure.md).
    """
    structure = turbine.blade.structure
    usual = (3, 2, 1, 4) if structure.stiffness_matrix is not None else (2, 1, int(structure.twists), 0)
    if options.torsion_modes == 0 or options.mode_shapes == "given":
        usual = (*usual[:3], 0)
    requested = (options.flap_modes, options.edge_modes, options.torsion_modes, options.residual_modes)
    kinds = ("flap", "edge", "torsion", "residual")
    counts = {kind: n if given is None else given for kind, n, given in zip(kinds, usual, requested, strict=True)}
    many = any(counts[kind] > most for kind, most in zip(kinds, MOST_NATURAL, strict=False))
    if many and usual[3] and options.residual_modes is None:
        counts["residual"] = MOST_RESIDUAL
    if counts["residual"]:
        begin = f"{turbine.name}: options.residual_modes {counts['residual']} needs "
        if not structure.twists:
            raise UnsupportedError(begin + "a blade with torsion_stiffness or stiffness_matrix; use 0")
        if options.mode_shapes == "given":
            raise InputError(begin + "mode_shapes 'computed', found 'given'; use 0, or computed mode shapes")
        if not counts["torsion"]:
            raise InputError(
                begin + "torsion_modes of at least 1, found 0: residual modes twist the blade; use 0, or a torsion mode"
            )
        if many and counts["residual"] < MOST_RESIDUAL:
            most, natural = ("/".join(map(str, some)) for some in (MOST_NATURAL, [counts[k] for k in kinds[:3]]))
            raise InputError(
                begin + f"at most {most} flap, edge and torsion modes, found {natural}: with more, the tip would twist "
                f"under centrifugal force; use 0, or {MOST_RESIDUAL}, with which it also stretches"
            )
    return counts


@contextmanager
def _about(member: str) -> Iterator[None]:
    try:
        yield
    except np.linalg.LinAlgError:
        raise InputError(
            f"{member}: its modes cannot be computed; the stiffness or mass of a station is out of range"
        ) from None


def _refuse(turbine: Turbine, options: ModelOptions) -> None:
    problems = []
    if not 2 <= turbine.n_blades <= MAX_BLADES:
        problems.append(f"n_blades: {turbine.n_blades} blades; 2 and 3 are supported")
    d = turbine.drivetrain
    if options.drivetrain != "two_mass" and d.gearbox is None:
        missing = f"{turbine.name}: options.drivetrain {options.drivetrain!r} needs drivetrain.gearbox"
        from meltemi.turbine.gearbox import LEAST_RATIO

        if d.gear_ratio > LEAST_RATIO:
            rated = turbine.control.torque.rated_power * d.gear_ratio / turbine.control.torque.rated_speed
            missing += f"; size_gearbox(ratio={d.gear_ratio:g}, rated_torque={rated:.3g}) makes one"
        raise InputError(missing)
    if problems:
        raise UnsupportedError(f"{turbine.name}: " + "; ".join(problems))


def _blade_layout(turbine: Turbine, options: ModelOptions) -> NodeLayout:
    length = turbine.blade.length
    edges = options.advanced.blade_cells
    given = options.blade_nodes if edges is None else edges
    if isinstance(given, int):
        j = np.arange(given + 1) / given
        return cells(length * (0.5 * j + 0.5 * np.sin(0.5 * np.pi * j)))
    position = np.array(given, dtype=float)
    name = "blade_nodes" if edges is None else "advanced.blade_cells"
    if (
        np.any(np.diff(position) <= 0.0)
        or abs(position[0]) > 1e-3 * length
        or abs(position[-1] - length) > 1e-3 * length
    ):
        raise InputError(
            f"{name} must increase from 0 to the blade length {length:g} m, found {position[0]:g} to {position[-1]:g}"
        )
    position[0], position[-1] = 0.0, length
    return points(position) if edges is None else cells(position)


def _coordinates(turbine: Turbine, blade: ModalMember, tower: ModalMember) -> tuple[str, ...]:
    names = [n if n.startswith(("base ", "pile ", "frame ")) else f"tower {n}" for n in tower.names] + [""] * 3
    rows = rows_of(len(names))
    names[rows.yaw], names[rows.generator], names[rows.torsion] = "yaw", "generator", "drivetrain"
    for b in range(turbine.n_blades):
        names += [f"blade {b + 1} {name}" for name in blade.names]
    return tuple(names)


def _locked(coordinates: tuple[str, ...], options: ModelOptions) -> Float:
    # group: beginning and end of its names
    groups = {
        "tower": ("tower", ""),
        "blades": ("blade", ""),
        "flap": ("blade", "flap"),
        "edge": ("blade", "edge"),
        "torsion": ("blade", "torsion"),
    }
    locked = np.zeros(len(coordinates))
    for name in options.locked:
        begin, end = groups.get(name, (name, name))
        hits = [
            i
            for i, n in enumerate(coordinates)
            if n == name or (name in groups and n.startswith(begin) and n.endswith(end))
        ]
        if not hits and name not in groups:
            raise InputError(f"locked: no coordinate {name!r}: {did_you_mean(name, [*groups, *coordinates])}")
        locked[hits] = 1.0
    return locked


def head_mass(turbine: Turbine, pieces: Float, axis: Float) -> Float:
    """(6, 6) inertia about the tower top of all masses above it, as one mass at the common centre.

    Their rotary inertia is excluded from the tower's modes: in the assembled turbine the flexible blades do
    not follow the pitching and rolling of the second tower modes, and modes of a rigid rotor would be off
    by 8 % (docs/theory/structure.md). The multibody equations have the full inertia.
    """
    n, h = turbine.nacelle, turbine.hub
    blades = turbine.n_blades * pieces[:, 0, 0].sum()
    z = h.radius + np.sum(pieces[:, 0, 0] * axis[:, 2]) / pieces[:, 0, 0].sum()
    rotor = h.mass + blades
    # the blades lean upwind by the precone
    along = (h.mass * h.mass_centre - blades * z * np.sin(h.precone)) / rotor if rotor > 0.0 else 0.0
    c, s = np.cos(n.tilt), np.sin(n.tilt)
    x_rotor, z_rotor = (along - n.overhang) * c, n.shaft_height - (along - n.overhang) * s
    mass = turbine.tower.top_mass + n.mass + rotor
    x, y, zn = n.mass_centre
    centre = np.array([n.mass * x + rotor * x_rotor, n.mass * y, n.mass * zn + rotor * z_rotor]) / max(mass, 1e-9)
    return rigid_body(mass, centre, np.zeros((3, 3)))


def _second(member: ModalMember, position: Float) -> Float:
    """(3 k k, nodes) displacements of second order, component fastest, then mode, then mode."""
    k = len(member.names)
    return member.second_at(position).transpose(0, 1, 3, 2).reshape(3 * k * k, len(position))


def _structure(turbine: Turbine, environment: Environment, options: ModelOptions, gears: Float) -> Float:
    array = StructureParameters.zeros()
    v = View(StructureParameters, array)
    n, h, d = turbine.nacelle, turbine.hub, turbine.drivetrain
    axis_x, axis_y = turbine.blade.structure.axis_x, turbine.blade.structure.axis_y
    v["gravity"] = environment.gravity
    v["tower_base"], v["tower_length"] = turbine.tower.base_height, turbine.tower.length
    v["top_mass"] = turbine.tower.top_mass
    v["shaft_height"], v["overhang"], v["tilt"] = n.shaft_height, n.overhang, n.tilt
    v["precone"], v["hub_radius"] = h.precone, h.radius
    v["tip"] = (0.0 if axis_x is None else axis_x[-1], 0.0 if axis_y is None else axis_y[-1], turbine.rotor_radius)
    v["hub_mass"], v["hub_centre"], v["hub_inertia"] = h.mass, h.mass_centre, h.inertia
    v["nacelle_mass"], v["nacelle_centre"] = n.mass, n.mass_centre
    x, y, _ = n.mass_centre
    v["nacelle_inertia"] = (n.roll_inertia, n.nod_inertia, n.yaw_inertia - n.mass * (x * x + y * y))
    v["gear_ratio"], v["generator_inertia"] = d.gear_ratio, d.generator_inertia
    v["gearbox_efficiency"], v["gears"] = d.gearbox_efficiency, gears
    v["generator_sense"] = 1.0 if d.gearbox is None or options.drivetrain == "two_mass" else d.gearbox.sense
    v["shaft_stiffness"], v["shaft_damping"] = d.stiffness, d.damping
    v["yaw_stiffness"], v["yaw_damping"] = turbine.yaw.stiffness, turbine.yaw.damping
    return array


def _gears(turbine: Turbine, options: ModelOptions) -> tuple[Float, Float, Float, Float]:
    """Arrays of the gearbox, see ``structure.gear_train.gear_arrays``; empty ones where its parts are not modelled."""
    if options.drivetrain == "two_mass":
        return np.zeros(6), GearModes.zeros(mode=0), GearRows.zeros(part=0), np.zeros((0, 0))
    from meltemi.structure.gear_train import gear_arrays

    return gear_arrays(turbine.drivetrain, multibody=options.drivetrain == "multibody")


def _blade_nodes(turbine: Turbine, beam: Beam, layout: NodeLayout, pieces: Float) -> Float:
    axis = beam.at(layout.position, "axis")
    blades = [pieces * (1.0 + excess) for excess in deviations(turbine, "mass")]
    if turbine.icing is not None:
        from meltemi.simulation.ice import ice_pieces

        for blade in turbine.icing.on(turbine.n_blades):
            blades[blade - 1] = blades[blade - 1] + ice_pieces(turbine, turbine.icing, beam, layout)
    return np.ascontiguousarray(np.stack([_node_rows(turbine, each, axis) for each in blades], axis=1))


def _node_rows(turbine: Turbine, pieces: Float, axis: Float) -> Float:
    """(rows, nodes) properties of the pieces of one blade."""
    rows = BladeNode.zeros(blade=1, node=len(pieces))[:, 0, :]
    v = View(BladeNode, rows)
    v["position"] = (axis + np.array([0.0, 0.0, turbine.hub.radius])).T
    v["mass"] = pieces[:, 0, 0]
    # the lower left block of a mass matrix is skew(first moment)
    v["moment"] = np.stack([pieces[:, 5, 1], pieces[:, 3, 2], pieces[:, 4, 0]])
    J = pieces[:, 3:, 3:]
    v["inertia"] = np.stack([J[:, 0, 0], J[:, 1, 1], J[:, 2, 2], J[:, 0, 1], J[:, 0, 2], J[:, 1, 2]])
    return rows


def _tower_matrix(tower: ModalMember, top_mass: float) -> Float:
    k = len(tower.names)
    matrix = np.zeros((4, k, k))
    top = tower.modes.shape[:, -1, :3]
    matrix[0] = tower.modes.mass_alone + top_mass * top @ top.T
    matrix[1] = tower.modes.stiffness
    matrix[2] = tower.damping
    # weight, P-delta: V = g sum m u_z, with the second-order displacement 1/2 q Z q
    matrix[3] = np.einsum("n,kln->kl", _lumps(tower, top_mass), tower.second[:, :, :, 2])
    return matrix


def _tower_weight(tower: ModalMember, top_mass: float) -> Float:
    result: Float = -np.einsum("n,kn->k", _lumps(tower, top_mass), tower.modes.shape[:, :, 2])
    return result if tower.hull is None else np.zeros_like(result)  # gravity acts on its momenta


def _lumps(member: ModalMember, top_mass: float) -> Float:
    """(n,) [kg] mass at the nodes of a member's mesh."""
    z = member.modes.z
    edges = np.concatenate([z[:1], 0.5 * (z[1:] + z[:-1]), z[-1:]])
    mass: Float = member.beam.rigid_pieces(edges, member.modes.points)[:, 2, 2]
    mass[-1] += top_mass
    return mass


def _tower_nodes(tower: ModalMember, layout: NodeLayout, lift: float) -> Float:
    """Nodes of the tower, whose base is ``lift`` [m] above the end of its member."""
    array = TowerNode.zeros(node=len(layout.position))
    v = View(TowerNode, array)
    # the pieces' inertia is taken about the middle of each piece, where section_loads puts their weight
    middle = 0.5 * (layout.edges[1:] + layout.edges[:-1])
    pieces = tower.beam.rigid_pieces(layout.edges + lift, tower.beam.at(middle + lift, "axis"))
    v["height"], v["length"] = layout.position, layout.length
    v["mass"] = pieces[:, 0, 0]
    v["inertia"] = np.stack([pieces[:, 3, 3], pieces[:, 4, 4], pieces[:, 5, 5]])
    return array


def _flap_actuators(turbine: Turbine) -> Float:
    flaps = turbine.blade.flaps
    array = FlapActuators.zeros(flap=len(flaps))
    v = View(FlapActuators, array)
    v["model"] = [number(ActuatorModel, "ideal" if f.frequency is None else "second_order") for f in flaps]
    v["frequency"] = [f.frequency or 1.0 for f in flaps]
    for name in ("damping", "rate", "minimum", "maximum"):
        v[name] = [getattr(f, name) for f in flaps]
    return array


def _actuators(turbine: Turbine, options: ModelOptions) -> Float:
    p = Actuators(actuator_array(turbine, options))
    yaw = turbine.yaw
    p.yaw_friction = yaw.friction
    if (rub := turbine.pitch_actuator.friction) is not None:
        # loaded by bending moment and centrifugal force (C-94)
        z, load = turbine.blade.structure.position, 0.5 * rub.coefficient / rub.inertia
        beam = turbine.blade.structure
        mass = np.asarray(beam.mass if beam.mass_matrix is None else beam.mass_matrix[:, 0, 0])
        p.pitch_friction_moment = 4.4 * load
        p.pitch_friction_spin = load * rub.diameter * float(np.trapezoid(mass * (turbine.hub.radius + z), z))
    p.yaw_hold = -1.0 if yaw.brake_torque is None else yaw.brake_torque + yaw.friction
    for blade, offset in enumerate(deviations(turbine, "pitch")):
        p.pitch_offset[blade] = offset
    return p.array
