"""Roles of the blocks of a HAWC2 model in the turbine, which decide on the treatment of their commands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, UnsupportedError
from meltemi.exchange.hawc2.bodies import Body, read_bodies
from meltemi.exchange.hawc2.control import libraries
from meltemi.exchange.hawc2.htc import Block, Treatment
from meltemi.exchange.report import Notes

Float = NDArray[np.float64]


def assign_roles(
    root: Block, chain: dict[str, list[Body]], others: list[Block], replaced: bool, treatment: Treatment
) -> None:
    """Give roles to the blocks of a model.

    Args:
      chain: the bodies from the ground to blade 1 by role: foundation, tower, rigid, shaft, blade.
      others: orientation blocks of the other blades, which blade 1 represents.
      replaced: whether the control is that of another turbine.
    """
    structure, roles = root.block("new_htc_structure"), treatment.roles
    orientation, constraint = structure.block("orientation"), structure.block("constraint")
    role_of = {body.name: role for role, bodies in chain.items() for body in bodies}
    shaft = chain["shaft"][0].name
    for block in structure.within("main_body"):
        copy = block.get("copy_main_body") is not None
        name = block.need("name").word()
        roles[id(block)] = "other" if name not in role_of else "copy" if copy else role_of[name]
    for role, bodies in chain.items():
        roles |= {id(body.block): role for body in bodies}
    read = {id(body.joint) for bodies in chain.values() for body in bodies}
    for block in orientation.blocks:
        if id(block) not in read:
            roles[id(block)] = "like_blade_1" if block in others else "other"
    for block in constraint.blocks:
        child = block.get("mbdy2")
        if child is not None and child.word() == shaft:
            roles[id(block)] = "shaft"
        elif child is not None and child.word() in _linked(root.block("aero")).values():
            roles[id(block)] = "pitch"
    tower = chain["tower"][0].name
    for block in root.find("aerodrag").within("aerodrag_element"):
        if is_about(block, tower):
            roles[id(block)] = "tower"
    for name, block in libraries(root.find("dll")).items():
        roles[id(block)] = "replaced" if replaced and name in ("dtu_we_controller", "servo_with_limits") else name


def is_about(element: Block, name: str) -> bool:
    """Whether an element of drag belongs to a body."""
    command = element.get("mbdy_name")
    return command is not None and command.word() == name


def _linked(aero: Block) -> dict[int, str]:
    """Bodies of the blades by their number."""
    links = [c for c in aero.all("link") if len(c.values) > 2 and c.values[0].isdigit()]
    return {int(c.values[0]): c.word(2) for c in links}


def other_blades(
    structure: Block, aero: Block, main: Path, blade: Body, down: Float, count: int, notes: Notes
) -> list[Block]:
    """Orientation blocks of the bodies up to the other blades, if these equal blade 1; a note on each that does not."""
    joints: list[Block] = []
    for k, name in _linked(aero).items():
        if not 2 <= k <= count:
            continue
        try:
            bodies = read_bodies(structure, main, name)
        except (InputError, UnsupportedError) as error:
            notes.add("ignored", aero.where, f"blade {k}", f"taken as blade 1; {error}")
            continue
        other = bodies[-1]
        turned = blade.axes @ np.linalg.inv(other.axes)
        if not np.allclose(turned @ down, down, atol=1e-6) or not _is_blade_angle(turned, count):
            why = "its orientation on the hub differs (pitch, cone or azimuth)"
        elif other.nodes.shape != blade.nodes.shape or not np.allclose(other.nodes, blade.nodes, atol=1e-6):
            why = "its c2_def differs"
        elif other.block is not blade.block and _content(other.block) != _content(blade.block):
            why = "its commands differ"
        else:
            joints += [body.joint for body in bodies]
            continue
        notes.add("ignored", other.joint.where, f"blade {k}", f"taken as blade 1, although {why}")
    return joints


def _content(block: Block) -> list[Any]:
    """Commands and blocks, regardless of their order and of the name of the body."""
    commands = [(c.name, c.values) for c in block.commands if c.name != "name"]
    return [*commands, *((inner.name, _content(inner)) for inner in block.blocks)]


def _is_blade_angle(turned: Float, count: int) -> bool:
    """Whether a rotation is a multiple of the angle between the blades."""
    angle = np.arccos(np.clip(0.5 * (np.trace(turned) - 1.0), -1.0, 1.0)) * count / (2.0 * np.pi)
    return bool(abs(angle - np.round(angle)) < 1e-4 and np.round(angle) > 0.0)
