"""Bodies of a HAWC2 model: their axes in space, their masses and sections.

Global axes of HAWC2: y downwind, z down, x to the left looking downwind. The axes of meltemi are (y, x, -z) of these.

Reference: docs/migrate/hawc2.md; Larsen and Hansen, How 2 HAWC2, the user's manual, DTU R-1597.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, UnsupportedError, did_you_mean
from meltemi.exchange.hawc2.htc import Block, Command, template_hint
from meltemi.exchange.hawc2.sections import read_subset, section_matrices
from meltemi.exchange.openfast.text import number

Float = NDArray[np.float64]
INERTIAL = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Our inertial axes from HAWC2's global ones."""
CLOSE = 1e-4
"""[m] within which stations are one."""
TURNS = ("eulerang", "eulerpar", "axisangle")
"""Commands that turn a body, behind ``mbdy_`` or ``mbdy2_``."""
HARMLESS = ("mbdy", "mbdy1", "mbdy2", "inipos", "relpos", "mbdy2_ini_rotvec_d1", "name")
"""Other commands of an orientation."""
DAMPING = ("damping_posdef", "damping_aniso", "damping_aniso_v2", "damping")


@dataclass(frozen=True, eq=False)
class Lump:
    """Lumped mass of a body.

    Attributes:
      mass: [kg] mass.
      position: (3,) [m] centre of mass, inertial axes.
      inertia: (3, 3) [kg m^2] inertia about it, inertial axes.
      span: [m] along the body, from its first node.
      last: whether it is fixed to the last node.
    """

    mass: float
    position: Float
    inertia: Float
    span: float
    last: bool = False


@dataclass(frozen=True, eq=False)
class Sections:
    """Sections of a body.

    Attributes:
      span: (S,) [m] stations along the axis: those of the sections, and the nodes.
      given: [m] position of the last section in the file.
      stiffness, mass: (S, 6, 6) matrices at the stations, in axes of the section.
      rows: (S, 19) or, with fully populated matrices, (S, 30) rows of the st file at the stations.
    """

    span: Float
    given: float
    rows: Float
    stiffness: Float
    mass: Float


@dataclass(frozen=True, eq=False)
class Body:
    """A main body in the undeflected model; its sections are read when they are used.

    Attributes:
      block: block with the content of the body, or of the body that it copies.
      joint: block of its orientation.
      main: the main file.
      nodes: (N, 4) x, y, z [m] and twist [deg] of the half chord, body axes.
      axes: (3, 3) inertial components of its axes.
      origin: (3,) [m] origin of its coordinates, inertial axes.
    """

    name: str
    block: Block
    joint: Block
    main: Path
    nodes: Float
    axes: Float
    origin: Float

    @property
    def arc(self) -> Float:
        """(N,) [m] length along the axis to the nodes."""
        steps = np.linalg.norm(np.diff(self.nodes[:, :3], axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @cached_property
    def sections(self) -> Sections:
        """Sections from the st file of the body.

        Raises:
          InputError: the file is not valid; the message has file and line.
        """
        beam = self.block.block("timoschenko_input")
        chosen = beam.need("set").numbers(0, 2)
        path = beam.need("filename").file(self.main)
        table = read_subset(path, int(chosen[0]), int(chosen[1]), beam.value("fpm", 0.0) == 1.0)
        given = table[:, 0]
        if abs(given[0]) > 1e-6 or np.any(np.diff(given) <= 0.0):
            raise InputError(f"{path}: the stations of {self.name} must increase from 0")
        arc = self.arc
        span = np.unique(np.concatenate([given[given < arc[-1]], arc]))
        span = span[np.append(np.diff(span) > CLOSE, True)]
        span[0] = 0.0
        rows = np.stack([np.interp(span, given, column) for column in table.T], axis=-1)
        return Sections(span, float(given[-1]), rows, *section_matrices(rows))

    @property
    def damping(self) -> Float:
        """(6,) damping factors; the last three are damping over stiffness [s]."""
        damped = self.block.get(*DAMPING)
        return np.zeros(6) if damped is None else damped.numbers(0, 6)

    def place(self, point: Float) -> Float:
        """(3,) [m] inertial position of a point of the body."""
        position: Float = self.origin + self.axes @ point
        return position

    def lumps(self) -> list[Lump]:
        """Distributed mass in pieces, and concentrated masses."""
        arc, sections = self.arc, self.sections
        lumps: list[Lump] = []
        for k, (a, b) in enumerate(pairwise(sections.span)):
            s, ds, M = 0.5 * (a + b), b - a, 0.5 * (sections.mass[k] + sections.mass[k + 1])
            point = np.array([np.interp(s, arc, self.nodes[:, k]) for k in range(3)])
            J = self.axes @ (M[3:, 3:] * ds) @ self.axes.T
            lumps.append(Lump(M[0, 0] * ds, self.place(point), J, s))
        return lumps + [self.concentrated(command) for command in self.block.all("concentrated_mass")]

    def concentrated(self, command: Command) -> Lump:
        """The mass of a command: node, offsets (3), mass, moments of inertia (3), products of inertia (3).

        Raises:
          InputError: it lacks numbers, or the body has no such node.
        """
        node = self.node(command, 0)
        values = command.numbers(1, 7, more=3)
        xy, xz, yz = np.pad(values[7:], (0, 10 - len(values)))
        J = np.diag(values[4:7]) + np.array([[0.0, xy, xz], [xy, 0.0, yz], [xz, yz, 0.0]])
        position = self.place(self.nodes[node, :3] + values[:3])
        return Lump(values[3], position, self.axes @ J @ self.axes.T, self.arc[node], last=node == len(self.nodes) - 1)

    def node(self, command: Command, place: int) -> int:
        """Index of the node that a command names by its number from 1, or by ``last``; 0 if it names none.

        Raises:
          InputError: the body has no such node.
        """
        word = command.word(place) if len(command.values) > place else "1"
        counted = float(len(self.nodes)) if word == "last" else number(word) or 0.0
        if counted != int(counted) or not 1 <= counted <= len(self.nodes):
            expected = f"a node of {self.name}, 1 to {len(self.nodes)} or last"
            raise InputError(f"{command.where}: {command.name}: expected {expected}, found {word}{template_hint(word)}")
        return int(counted) - 1


def read_bodies(structure: Block, main: Path, blade: str, ground: Float = INERTIAL) -> list[Body]:
    """Read the bodies from the ground to a blade.

    Args:
      ground: (3, 3) rotation from HAWC2's global axes to the inertial axes of meltemi.

    Raises:
      InputError: the file is not valid; the message has file and line.
      UnsupportedError: a body of another type than a beam, or one beside the node that carries it.
    """
    blocks = {b.need("name").word(): b for b in structure.within("main_body")}
    orientation = structure.block("orientation")
    joints = {b.need("mbdy2").word(): b for b in orientation.within("relative")}
    chain = [blade]
    while chain[0] in joints:
        chain.insert(0, joints[chain[0]].need("mbdy1").word())
        if chain[0] in chain[1:]:
            raise InputError(f"{orientation.where}: body {chain[0]} is fixed to itself")
    base = next((b for b in orientation.within("base") if b.need("mbdy").word() == chain[0]), None)
    if base is None:
        raise InputError(f"{orientation.where}: no chain of bodies from a base to {blade}: it ends at {chain[0]}")
    at = base.need("inipos").numbers(0, 3)
    bodies = [_body(chain[0], base, blocks, main, ground @ _turned(base), ground @ at)]
    for name in chain[1:]:
        joint, parent = joints[name], bodies[-1]
        body = _body(name, joint, blocks, main, parent.axes @ _turned(joint), np.zeros(3))
        where = parent.place(parent.nodes[parent.node(joint.need("mbdy1"), 1), :3])
        start = body.axes @ body.nodes[body.node(joint.need("mbdy2"), 1), :3]
        bodies.append(replace(body, origin=where - start))
    return bodies


def _turned(block: Block) -> Float:
    """(3, 3) axes of a body in those of the body that carries it: the rotations of a block, one after the other.

    Raises:
      InputError: a command that is none of an orientation.
      UnsupportedError: a distance between the bodies.
    """
    R: Float = np.eye(3)
    for command in block.commands:
        kind = command.name.rpartition("mbdy2_" if command.name.startswith("mbdy2_") else "mbdy_")[2]
        if kind in TURNS:
            R = R @ _rotation(command, kind)
        elif command.name not in HARMLESS:
            # an unknown command may rotate the body
            known = [f"mbdy{'2' if block.name == 'relative' else ''}_{turn}" for turn in TURNS]
            raise InputError(
                f"{command.where}: block {block.name}: {command.name} is unknown: "
                f"{did_you_mean(command.name, [*known, *HARMLESS])}"
            )
        elif command.name == "relpos" and np.any(command.numbers(0, 3)):
            raise UnsupportedError(f"{command.where}: relpos: a distance between two bodies is not read")
    return R


def _rotation(command: Command, kind: str) -> Float:
    """(3, 3) one rotation: angles [deg] about x, y and z of the axes that turn with it; Euler parameters, the scalar
    first; or an axis and the angle [deg] about it."""
    if kind == "eulerang":
        R: Float = np.eye(3)
        for axis, angle in zip(np.eye(3), np.radians(command.numbers(0, 3)), strict=True):
            R = R @ rotation(axis, angle)
        return R
    values = command.numbers(0, 4)
    if kind == "axisangle":
        length = float(np.linalg.norm(values[:3]))
        if length == 0.0 and values[3]:
            raise InputError(f"{command.where}: {command.name}: expected an axis, three numbers, found zeros")
        return rotation(values[:3] / (length or 1.0), math.radians(values[3]))
    length = float(np.linalg.norm(values))
    if abs(length - 1.0) > 1e-3:
        raise InputError(f"{command.where}: {command.name}: expected four numbers of length 1, found length {length:g}")
    sine = float(np.linalg.norm(values[1:]))
    return rotation(values[1:] / (sine or 1.0), 2.0 * math.atan2(sine, values[0]))


def rotation(axis: Float, angle: float) -> Float:
    """(3, 3) rotation by an angle [rad] about a unit vector (Rodrigues)."""
    x, y, z = axis
    S = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    R: Float = np.eye(3) + math.sin(angle) * S + (1.0 - math.cos(angle)) * (S @ S)
    return R


def _body(name: str, joint: Block, blocks: dict[str, Block], main: Path, axes: Float, origin: Float) -> Body:
    block, copies = blocks.get(name), {name}
    while block is not None and (copied := block.get("copy_main_body")) is not None:
        original = copied.word()
        if original in copies:
            raise InputError(f"{copied.where}: body {original} is a copy of itself")
        copies.add(original)
        block = blocks.get(original)
        name = original if block is None else name
    if block is None:
        raise InputError(f"{main}: no main_body {name}: {did_you_mean(name, blocks)}")
    kind = block.get("type")
    if kind is not None and kind.word() != "timoschenko":
        raise UnsupportedError(f"{kind.where}: main_body {name} is of type {kind.word()}; only timoschenko is read")
    rows = sorted((command.numbers(0, 5) for command in block.block("c2_def").all("sec")), key=lambda row: row[0])
    if len(rows) < 2:
        raise InputError(f"{block.where}: c2_def of {name} needs two sections or more")
    return Body(name, block, joint, main, np.array(rows)[:, 1:], axes, origin)
