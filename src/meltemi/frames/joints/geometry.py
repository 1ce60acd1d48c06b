"""Tubular joints of a frame: chord, braces, gaps and planes, (F-52).

The chord is the pair of members that are in line with the largest diameter, of equal ones that with the thickest wall,
then the first in the file; where no pair is in line it is the single member of largest diameter.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from math import cos, radians
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.frames.definition import Frame, Section
from meltemi.frames.finite_elements import member_axes

Float = NDArray[np.float64]
End = Literal["start", "end"]

IN_LINE = cos(radians(10.0))
"""Members at a joint are in line if they deviate from it by less than 10 degrees."""
IN_PLANE = cos(radians(15.0))
"""Braces share a plane with the chord if their directions about it differ by less than 15 degrees."""


@dataclass(frozen=True)
class Tube:
    """End of a tubular member at a joint.

    Attributes:
      member, end: its name, and which of its ends.
      direction: (3,) unit vector away from the joint.
      axes: (3, 3) member axes x, y, z as rows.
      length, diameter, thickness: [m]; the section is that of this end.
      section: the section itself.
    """

    member: str
    end: End
    direction: Float
    axes: Float
    length: float
    diameter: float
    thickness: float
    section: Section


@dataclass(frozen=True)
class Brace:
    """A brace of a joint.

    Attributes:
      tube: its end.
      angle: [rad] between its axis and the chord's, up to a right angle.
      radial: (3,) unit vector from the chord's axis towards the brace.
      place: [m] of its axis on the chord's surface, along the chord from the joint.
      half: [m] half the length of its weld along the chord.
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
      name: of the frame's joint.
      height: [m] above mean sea level.
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
        sections = (member.section, member.end_section or member.section)
        sides: tuple[tuple[End, float], ...] = (("start", 1.0), ("end", -1.0))
        for joint, section, (end, sign) in zip(member.joints, sections, sides, strict=True):
            s = frame.sections[section]
            D = float(s.diameter or 0.0)
            ends[joint].append(Tube(name, end, sign * axes[2], axes, length, D, s.thickness or 0.5 * D, s))
    return ends


def chord_of(tubes: list[Tube]) -> tuple[Tube, ...]:
    """Members of the chord at a joint: the rule of this module."""

    def size(pair: tuple[Tube, ...]) -> tuple[float, float]:
        return min(t.diameter for t in pair), min(t.thickness for t in pair)

    pairs: list[tuple[Tube, ...]] = [(a, b) for a, b in combinations(tubes, 2) if a.direction @ b.direction < -IN_LINE]
    return max(pairs or [(tube,) for tube in tubes], key=size)


def tubular_joints(frame: Frame) -> tuple[Joint, ...]:
    """Joints at which at least one brace is welded to a chord, in the order of the file."""
    joints = []
    for name, tubes in tubes_at(frame).items():
        if len(tubes) < 2 or len(tubes) == len(chord := chord_of(tubes)):
            continue
        c = chord[0].direction - (chord[1].direction if len(chord) > 1 else 0.0)
        c = c / np.linalg.norm(c)
        D = min(tube.diameter for tube in chord)
        braces = []
        for tube in tubes:
            along = float(tube.direction @ c)
            across = tube.direction - along * c
            sine = float(np.linalg.norm(across))
            if all(tube is not each for each in chord) and sine > 1e-3:  # what goes on along the chord is no brace
                angle = float(np.arctan2(sine, abs(along)))
                place, half = 0.5 * D * along / sine, 0.5 * tube.diameter / sine
                braces.append(Brace(tube, angle, across / sine, place, half))
        if braces:
            T, L = min(tube.thickness for tube in chord), sum(tube.length for tube in chord)
            height = float(frame.joints[name][2])
            joints.append(Joint(name, height, chord, c, D, T, L, tuple(braces)))
    return tuple(joints)
