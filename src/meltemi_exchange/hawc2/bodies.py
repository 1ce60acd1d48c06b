"""Bodies of a HAWC2 model: their axes in space, their masses and sections.

Global axes of HAWC2: y downwind, z down, x to the left looking downwind. Ours are (y, x, -z) of these.

Reference: docs/migrate/hawc2.md; Larsen and Hansen, How 2 HAWC2, the user's manual, DTU R-1597.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, UnsupportedError, did_you_mean
from meltemi_exchange.hawc2.htc import Block, Command, file_of
from meltemi_exchange.hawc2.sections import read_subset, section_matrices

Float = NDArray[np.float64]
INERTIAL = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Our inertial axes from HAWC2's global ones."""
CLOSE = 1e-4
"""[m] within which stations are one."""
PARENT, CHILD = ("mbdy1", "body1"), ("mbdy2", "body2")


@dataclass(frozen=True)
class Lump:
    """A mass of a body.

    Attributes:
      mass: [kg].
      position: (3,) [m] centre of mass, inertial axes.
      inertia: (3, 3) [kg m^2] about it, inertial axes.
      span: [m] along the body, from its first node.
      last: whether it is fixed to the last node.
    """

    mass: float
    position: Float
    inertia: Float
    span: float
    last: bool = False


@dataclass(frozen=True)
class Body:
    """A main body in the undeflected model.

    Attributes:
      nodes: (N, 4) x, y, z [m] and twist [deg] of the half chord, body axes.
      axes: (3, 3) inertial components of its axes.
      origin: (3,) [m] its coordinates' origin, inertial axes.
      span: (S,) [m] stations along the axis: those of the sections, and the nodes.
      given: [m] to which the sections reach.
      stiffness, mass: (S, 6, 6) at the stations, axes of the section.
      damping: (6,) its damping factors; the last three are damping over stiffness [s].
    """

    name: str
    block: Block
    nodes: Float
    axes: Float
    origin: Float
    span: Float
    given: float
    stiffness: Float
    mass: Float
    damping: Float

    @property
    def arc(self) -> Float:
        """(N,) [m] length along the axis to the nodes."""
        return _arc(self.nodes)

    def place(self, point: Float) -> Float:
        """(3,) [m] inertial position of a point of the body."""
        position: Float = self.origin + self.axes @ point
        return position

    def lumps(self) -> list[Lump]:
        """Its distributed mass, in pieces, and its concentrated masses."""
        arc, found = self.arc, []
        for k, (a, b) in enumerate(zip(self.span[:-1], self.span[1:], strict=True)):
            s, ds, M = 0.5 * (a + b), b - a, 0.5 * (self.mass[k] + self.mass[k + 1])
            point = np.array([np.interp(s, arc, self.nodes[:, k]) for k in range(3)])
            J = self.axes @ (M[3:, 3:] * ds) @ self.axes.T
            found.append(Lump(M[0, 0] * ds, self.place(point), J, s))
        for command in self.block.all("concentrated_mass"):
            values = command.numbers()
            if len(values) < 8 or not 1 <= values[0] <= len(self.nodes):
                raise InputError(f"{command.where}: concentrated_mass needs node, offsets (3), mass and inertias (3)")
            node = int(values[0]) - 1
            xy, xz, yz = np.pad(values[8:11], (0, 3 - len(values[8:11])))
            J = np.diag(values[5:8]) + np.array([[0.0, xy, xz], [xy, 0.0, yz], [xz, yz, 0.0]])
            position = self.place(self.nodes[node, :3] + values[1:4])
            found.append(
                Lump(values[4], position, self.axes @ J @ self.axes.T, arc[node], last=node == len(self.nodes) - 1)
            )
        return found


def _arc(nodes: Float) -> Float:
    steps = np.linalg.norm(np.diff(nodes[:, :3], axis=0), axis=1)
    arc: Float = np.concatenate([[0.0], np.cumsum(steps)])
    return arc


def read_bodies(structure: Block, main: Path, blade: str) -> list[Body]:
    """The bodies from the ground to a blade.

    Raises:
      InputError: with file and line.
      UnsupportedError: a body of another type than a beam.
    """
    blocks = {b.need("name").values[0]: b for b in structure.within("main_body")}
    orientation = structure.block("orientation")
    joints = {_name(joint, CHILD): joint for joint in orientation.within("relative")}
    chain = [blade]
    while chain[0] in joints:
        chain.insert(0, _name(joints[chain[0]], PARENT))
        if chain[0] in chain[1:]:
            raise InputError(f"{orientation.where}: body {chain[0]} is fixed to itself")
    base = next((b for b in orientation.within("base") if _name(b, ("mbdy", "body")) == chain[0]), None)
    if base is None:
        raise InputError(f"{orientation.where}: no chain of bodies from a base to {blade}: it ends at {chain[0]}")
    at = base.need("inipos").numbers(0, 3)
    found = [_body(chain[0], blocks, main, INERTIAL @ _turned(base), INERTIAL @ at)]
    for name in chain[1:]:
        joint, parent = joints[name], found[-1]
        body = _body(name, blocks, main, parent.axes @ _turned(joint), np.zeros(3))
        where = parent.place(parent.nodes[_node(joint.need(*PARENT), parent), :3])
        start = body.axes @ body.nodes[_node(joint.need(*CHILD), body), :3]
        found.append(Body(**{**vars(body), "origin": where - start}))
    return found


def _name(block: Block, names: tuple[str, ...]) -> str:
    command = block.need(*names)
    return command.values[0] if command.values else ""


def _node(command: Command, body: Body) -> int:
    word = command.values[1] if len(command.values) > 1 else "1"
    if word.lower() == "last":
        return len(body.nodes) - 1
    if not word.isdigit() or not 1 <= int(word) <= len(body.nodes):
        raise InputError(f"{command.where}: expected a node of {body.name}, 1 to {len(body.nodes)} or last, not {word}")
    return int(word) - 1


def _turned(block: Block) -> Float:
    """(3, 3) rotations about x, y and z of the body's own axes, one after the other."""
    R: Float = np.eye(3)
    for command in block.all("mbdy2_eulerang", "body2_eulerang", "mbdy_eulerang", "body_eulerang"):
        for k, angle in enumerate(np.radians(command.numbers(0, 3))):
            c, s, i, j = np.cos(angle), np.sin(angle), (k + 1) % 3, (k + 2) % 3
            turn = np.eye(3)
            turn[i, i] = turn[j, j] = c
            turn[i, j], turn[j, i] = -s, s
            R = R @ turn
    return R


def _body(name: str, blocks: dict[str, Block], main: Path, axes: Float, origin: Float) -> Body:
    if name not in blocks:
        raise InputError(f"{main}: no main_body {name}: {did_you_mean(name, blocks)}")
    block = blocks[name]
    if (copied := block.get("copy_main_body")) is not None:
        return _body(copied.values[0], blocks, main, axes, origin)
    kind = block.get("type")
    if kind is not None and kind.values[0].lower() != "timoschenko":
        raise UnsupportedError(f"{kind.where}: main_body {name} is of type {kind.values[0]}; only timoschenko is read")
    rows = sorted((command.numbers(0, 5) for command in block.block("c2_def").all("sec")), key=lambda row: row[0])
    if len(rows) < 2:
        raise InputError(f"{block.where}: c2_def of {name} needs two sections or more")
    beam = block.block("timoschenko_input")
    file, chosen = beam.need("filename"), beam.need("set").numbers(0, 2)
    path = file_of(main, " ".join(file.values), file.where)
    table = read_subset(path, int(chosen[0]), int(chosen[1]), beam.value("fpm", 0.0) == 1.0)
    given, nodes = table[:, 0], np.array(rows)[:, 1:]
    if abs(given[0]) > 1e-6 or np.any(np.diff(given) <= 0.0):
        raise InputError(f"{path}: the stations of {name} must increase from 0")
    arc = _arc(nodes)
    span = np.unique(np.concatenate([given[given < arc[-1]], arc]))
    span = span[np.append(np.diff(span) > CLOSE, True)]
    span[0] = 0.0
    K, M = section_matrices(np.stack([np.interp(span, given, column) for column in table.T], axis=-1))
    damped = block.get("damping_posdef", "damping_aniso", "damping_aniso_v2")
    damping = np.zeros(6) if damped is None else damped.numbers(0, 6)
    return Body(name, block, nodes, axes, origin, span, given[-1], K, M, damping)
