"""Tubular joints of a frame: chord, braces, gaps and planes (F-52).

The chord is the pair of members that are in line with the largest diameter, of equal ones that with the thickest wall,
then the first in the file; where no pair is in line it is the single member of largest diameter.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from math import cos, pi, radians

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.frames.definition import Frame
from meltemi.frames.finite_elements import member_axes
from meltemi.frames.water import sections_of

Float = NDArray[np.float64]

IN_LINE, IN_PLANE = cos(radians(10.0)), cos(radians(15.0))
"""Members are in line within 10 degrees; braces share a plane with the chord if they differ by 15 degrees about it."""


@dataclass(frozen=True)
class Tube:
    """End of a tubular member at a joint.

    Attributes:
      member, end: its name, and "start" or "end".
      direction: (3,) unit vector away from the joint.
      axes: (3, 3) member axes x, y, z as rows.
      length, diameter, thickness: [m] of the member, and of its section at this end.
    """

    member: str
    end: str
    direction: Float
    axes: Float
    length: float
    diameter: float
    thickness: float

    @property
    def hole(self) -> float:
        """[m] inner diameter."""
        return max(self.diameter - 2.0 * self.thickness, 0.0)

    @property
    def area(self) -> float:
        """[m^2] of the wall."""
        return 0.25 * pi * (self.diameter**2 - self.hole**2)

    @property
    def modulus(self) -> float:
        """[m^3] section modulus."""
        return 2.0 * (pi / 64.0 * (self.diameter**4 - self.hole**4)) / self.diameter


@dataclass(frozen=True)
class Brace:
    """A brace of a joint.

    Attributes:
      tube: its end.
      angle: [rad] between its axis and the chord's, up to a right angle.
      radial: (3,) unit vector from the chord's axis towards the brace.
      place, half: [m] of its axis on the chord's surface from the joint, and half of its weld, along the chord.
    """

    tube: Tube
    angle: float
    radial: Float
    place: float
    half: float


@dataclass(frozen=True)
class Joint:
    """A joint of tubes.

    Attributes:
      name, height: of the frame's joint, and its height [m] above mean sea level.
      chord: its members at the joint, the first along ``axis``; one where the chord ends.
      axis: (3,) unit vector along the chord.
      diameter, thickness, length: [m] of the chord; the thinner wall, and the length over both members.
      braces: in the order of the file.
    """

    name: str
    height: float
    chord: tuple[Tube, ...]
    axis: Float
    diameter: float
    thickness: float
    length: float
    braces: tuple[Brace, ...]

    def beside(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """(n, n) whether braces, each itself included, are on one side of the chord in a plane; on opposite sides."""
        directions = np.array([brace.radial for brace in self.braces])
        across = directions @ directions.T
        return across > IN_PLANE, across < -IN_PLANE

    def gap(self, i: int, j: int) -> float:
        """[m] between the welds of two braces along the chord; negative if they overlap."""
        a, b = self.braces[i], self.braces[j]
        return abs(a.place - b.place) - a.half - b.half


def tubes_at(frame: Frame) -> dict[str, list[Tube]]:
    """Ends of tubular members by joint."""
    ends: dict[str, list[Tube]] = {name: [] for name in frame.joints}
    for name, member in frame.members.items():
        if member.kind != "beam" or frame.sections[member.section].kind != "tube":
            continue
        a, b = (np.asarray(frame.joints[joint]) for joint in member.joints)
        axes, length = member_axes(b - a, member.spin).T, float(np.linalg.norm(b - a))
        for i, (joint, end) in enumerate(zip(member.joints, ("start", "end"), strict=True)):
            s = sections_of(frame, member)[i]
            D = float(s.diameter or 0.0)
            ends[joint].append(Tube(name, end, (1.0 - 2.0 * i) * axes[2], axes, length, D, s.thickness or 0.5 * D))
    return ends


def chord_of(tubes: list[Tube]) -> tuple[Tube, ...]:
    """Members of the chord at a joint: the rule of this module."""
    pairs: list[tuple[Tube, ...]] = [(a, b) for a, b in combinations(tubes, 2) if a.direction @ b.direction < -IN_LINE]
    singles: list[tuple[Tube, ...]] = [(tube,) for tube in tubes]
    return max(pairs or singles, key=lambda each: (min(t.diameter for t in each), min(t.thickness for t in each)))


def tubular_joints(frame: Frame, cans: Mapping[str, float] | None = None) -> tuple[Joint, ...]:
    """Joints at which at least one brace is welded to a chord, in the order of the file.

    Args:
      cans: [m] wall of the chord at some joints, in place of its members'.

    Raises:
      InputError: a can belongs to no joint.
    """
    joints, cans = [], cans or {}
    for name in cans:
        if name not in frame.joints:
            raise InputError(f"joints.cans: no joint {name!r}: {did_you_mean(name, frame.joints)}")
    for name, tubes in tubes_at(frame).items():
        if len(tubes) < 2 or len(tubes) == len(chord := chord_of(tubes)):
            continue
        members = {tube.member for tube in chord}
        chord = tuple(replace(tube, thickness=cans.get(name, tube.thickness)) for tube in chord)
        c = chord[0].direction - (chord[1].direction if len(chord) > 1 else 0.0)
        c = c / np.linalg.norm(c)
        D, T = min(tube.diameter for tube in chord), min(tube.thickness for tube in chord)
        braces = []
        for tube in tubes:
            along = float(tube.direction @ c)
            across = tube.direction - along * c
            sine = float(np.linalg.norm(across))
            if tube.member not in members and sine > 1e-3:  # what goes on along the chord is no brace
                angle, place, half = np.arctan2(sine, abs(along)), 0.5 * D * along / sine, 0.5 * tube.diameter / sine
                braces.append(Brace(tube, float(angle), across / sine, place, half))
        if braces:
            height, L = float(frame.joints[name][2]), sum(tube.length for tube in chord)
            joints.append(Joint(name, height, chord, c, D, T, L, tuple(braces)))
    return tuple(joints)
