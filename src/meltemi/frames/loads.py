"""What section loads of members follow from at one instant, as a matrix; their channels.

Reference: docs/theory/frames.md (F-25 to F-29).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from meltemi.core.fingerprint import fingerprint
from meltemi.frames.finite_elements import Assembly
from meltemi.frames.recovery import Recovery, recovery
from meltemi.frames.water import NOWHERE, Pieces, beams, grown, liquid_inside
from meltemi.simulation.channels import Channel
from meltemi.structure.beam import transfer

if TYPE_CHECKING:
    from meltemi.frames.definition import Frame
    from meltemi.simulation.result import Result

Float = NDArray[np.float64]

BLOCK, MULTIPLE = 128, 16
"""Number of samples in a block, and what its number of channels is a multiple of."""
PLACES = {"start": 0.0, "middle": 0.5, "end": 1.0}
COMPONENTS = (
    ("force_x", "N", "shear along the member's x"),
    ("force_y", "N", "shear along the member's y"),
    ("force_z", "N", "axial force in the wall, tension positive"),
    ("moment_x", "N m", "bending moment about the member's x"),
    ("moment_y", "N m", "bending moment about the member's y"),
    ("moment_z", "N m", "torsion"),
    ("tension", "N", "effective tension: axial force and the pressures of still water on full sections"),
)


SIX = tuple(name for name, _, _ in COMPONENTS[:6])


def section_loads(frame: Frame, result: Result) -> dict[tuple[str, str], Float]:
    """Section loads (T, 6) [N, N m] by member and place, of those sections whose six channels a result has."""
    channels = {(name, at): [f"member_{name}_{at}_{load}" for load in SIX] for name in frame.members for at in PLACES}
    return {
        section: np.stack([result[name] for name in names], axis=1)
        for section, names in channels.items()
        if all(name in result for name in names)
    }


@dataclass(frozen=True)
class Derived:
    """Channels that are a linear function of others, which a run computes for all its samples at once.

    Attributes:
      channels: the R channels.
      sources: the B channels that the time loop records for them.
      matrix: (B, R) values by those of the sources.
    """

    channels: Sequence[Channel]
    sources: Sequence[Channel]
    matrix: Float

    @cached_property
    def padded(self) -> Float:
        """(B, R or more) the matrix with columns of zeros up to a multiple of ``MULTIPLE``."""
        padded: Float = np.pad(self.matrix, ((0, 0), (0, -len(self.channels) % MULTIPLE)))
        return padded

    def product(self, values: Float) -> Float:
        """(T, R) values by those of the sources (T, B), in blocks of one size.

        Sums of a matrix product are rounded by its size: so no value depends on the number of samples at a time.
        """
        result = np.zeros((len(values), len(self.channels)))
        for first in range(0, len(values), BLOCK):
            rows = values[first : first + BLOCK]
            block = np.zeros((BLOCK, values.shape[1]))
            block[: len(rows)] = rows
            result[first : first + BLOCK] = (block @ self.padded)[: len(rows), : len(self.channels)]
        return result


@dataclass(frozen=True)
class Loads:
    """Section loads of members as a product of a matrix with the present loads and motion.

    Attributes:
      assembly: finite elements.
      pieces: pieces on which the water acts.
      below: (k, n, 6) modes at the nodes.
      gravity: [m/s^2].
      level: [m] of still water above mean sea level, outside and inside of flooded members.
    """

    assembly: Assembly
    pieces: Pieces
    below: Float
    gravity: float
    level: float = field(default=0.0, kw_only=True)

    def at_level(self, level: float) -> Self:
        """The same with still water at a level [m]."""
        return self if level == self.level else replace(self, level=level)

    def content_hash(self) -> str:
        """Hash of the description from which all of it follows."""
        return str(fingerprint(self.assembly.frame, self.assembly.points, self.below, self.gravity, self.level))

    @cached_property
    def sections(self) -> tuple[tuple[str, str], ...]:
        """Member and place of each section."""
        beams = [name for name, member in self.assembly.frame.members.items() if member.kind in ("beam", "cable")]
        return tuple((name, place) for name in beams for place in PLACES)

    @cached_property
    def channels(self) -> tuple[Channel, ...]:
        """Channels of all sections."""
        sign = "load of the part beyond the section on the part before it"
        return tuple(
            Channel(
                f"member_{name}_{place}_{component}",
                "",
                unit,
                "member",
                sign,
                f"{what}, {place} of member {name}",
                ("frame_section", component),
                (n,),
            )
            for n, (name, place) in enumerate(self.sections)
            for component, unit, what in COMPONENTS
        )

    @cached_property
    def constant(self) -> tuple[Float, Float]:
        """Constant loads of weight and liquid inside, on nodes (n, 6) and on the ends of elements (e, 2, 6)."""
        a, e = self.assembly, self.assembly.elements
        nodes, ends = liquid_inside(a, self.level)
        growth = np.zeros((len(e.length), 3))
        growth[:, 2] = -e.growth
        return self.gravity * (nodes + a.joint_weight), self.gravity * (ends + a.weight + a.line_loads(growth))

    @cached_property
    def shape(self) -> Float:
        """(k, P, 3) modes at the pieces."""
        return self.pieces.moved(self.assembly, self.below)

    @cached_property
    def generalised(self) -> Float:
        """(k,) generalised forces of the constant loads."""
        nodes, ends = self.constant
        result: Float = np.einsum("kni,ni->k", self.below, nodes + self.assembly.nodal(ends))
        return result

    def of_ground_and_water(self, still: Float) -> Float:
        """(B, 12) reaction of the ground at the mudline, and load of the water about still water (F-29).

        Args:
          still: (P, 3) [N] forces of still water on the pieces, which also turn with the displaced frame.
        """
        p, k, a = self.pieces, len(self.below), self.assembly
        m = 3 * len(p.low)
        result = np.zeros((m + 7 + 2 * k, 12))
        bed = np.array([0.0, 0.0, -a.frame.depth])
        # a load does the work of its wrench about a point under the rigid motions of that point
        result[:m, 6:] = transfer(p.place - np.array([0.0, 0.0, self.level]))[:, :3].reshape(-1, 6)
        result[:m, :6] = -transfer(p.place - bed)[:, :3].reshape(-1, 6)
        result[m : m + 6, :6] = -transfer(a.points[-1] - bed)
        nodes, ends = self.constant
        arms = transfer(a.points - bed).reshape(-1, 6)
        result[m + 6 : m + 6 + k, :6] = (a.mass @ self.below.reshape(k, -1).T).T @ arms
        result[-1, :6] = -(nodes + a.nodal(ends)).reshape(-1) @ arms
        result[m + 6 + k : -1, :6] = -np.concatenate([np.zeros((k, 3)), self._leaning(still)[2]], axis=1)
        return result

    def _leaning(self, still: Float) -> tuple[Float, Float, Float]:
        """Moments by constant loads on the displaced frame per coordinate: nodes, ends, and all (k, 3) (F-28)."""
        nodes, ends = self.constant
        moved = self.below[..., :3]
        on_nodes, on_ends = np.zeros_like(self.below), np.zeros((len(self.below), *ends.shape))
        on_nodes[..., 3:] = np.cross(moved, nodes[:, :3])
        on_ends[..., 3:] = np.cross(moved[:, self.assembly.elements.nodes], ends[..., :3])
        for n in np.flatnonzero(self.pieces.node != NOWHERE):
            on_nodes[:, self.pieces.node[n], 3:] += np.cross(self.shape[:, n], still[n])
        return on_nodes, on_ends, on_nodes[..., 3:].sum(axis=1) + on_ends[..., 3:].sum(axis=(1, 2))

    def derived(self, channels: Sequence[Channel], used: Sequence[int], still: Float) -> Derived | None:
        """Those of the channels of a run that are section loads, by the entries ``used`` of the basis; None without."""
        asked = [channel for channel in channels if channel.source[0] == "frame_section"]
        if not asked:
            return None
        sources = [Channel(f"frame_basis_{i}", "", "-", "", "", "", ("frame_basis", "value"), (i,)) for i in used]
        return Derived(asked, sources, self.of_members(asked, still)[used])

    def of_members(self, channels: Sequence[Channel], still: Float) -> Float:
        """(B, R) the loads of channels of sections."""
        asked = sorted({channel.index[0] for channel in channels})
        row = {section: i for i, section in enumerate(asked)}
        sections = [self.sections[n] for n in asked]
        count = 6 * len(sections)
        r = recovery(self.assembly, [(name, PLACES[place]) for name, place in sections])
        result = self.by_basis(r, count, still)
        result = np.concatenate([result, result[:, 2::6]], axis=1)
        result[-1, count:] += [self._pressures(*section) for section in sections]
        names = [name for name, _, _ in COMPONENTS]
        columns = [
            count + row[c.index[0]] if c.source[1] == "tension" else 6 * row[c.index[0]] + names.index(c.source[1])
            for c in channels
        ]
        return result[:, columns]

    def by_basis(self, r: Recovery, count: int, still: Float) -> Float:
        """(B, C) the first ``count`` loads of a recovery, those of sections, by the entries of the basis (F-25)."""
        a = self.assembly
        leaning, on_ends, _ = self._leaning(still)
        nodes, ends = self.constant
        return np.vstack(
            [
                self.of_pieces(r, count),
                r.interface[:count].T,
                -self.of_motion(r, self.below, count),
                r.loads(leaning + a.nodal(on_ends), on_ends)[:, :count],
                r.loads(nodes + a.nodal(ends) + a.nodal(a.pretension), ends + a.pretension)[None, :count],
            ]
        )

    def of_pieces(self, r: Recovery, count: int) -> Float:
        """(3 P, C) loads of sections by forces on the pieces."""
        a, p = self.assembly, self.pieces
        result, nodal, shapes = np.zeros((3 * len(p.low), count)), r.nodal[:count].reshape(count, -1, 6), p.ends(a)
        for n in range(len(p.low)):
            mine = slice(3 * n, 3 * n + 3)
            if p.node[n] != NOWHERE:
                result[mine] = nodal[:, p.node[n], :3].T
                continue
            first, last = a.elements.nodes[p.element[n]]
            result[mine] = shapes[n, :, :6] @ nodal[:, first].T + shapes[n, :, 6:] @ nodal[:, last].T
            for i in np.flatnonzero(r.element == p.element[n]):
                result[mine, 6 * i : 6 * i + 6] -= (r.cut[i] @ shapes[n].T).T
        return result

    def of_motion(self, r: Recovery, acceleration: Float, count: int) -> Float:
        """(k, C) loads of sections by the mass of the frame times accelerations (k, n, 6) of its nodes."""
        a, flat = self.assembly, acceleration.reshape(len(acceleration), -1)
        return r.loads((a.mass @ flat.T).T.reshape(acceleration.shape), a.inertia(acceleration))[:, :count]

    def _pressures(self, name: str, place: str) -> float:
        """[N] pressure of still water outside less that inside on the full sections of a member (F-42)."""
        frame, member = self.assembly.frame, self.assembly.frame.members[name]
        if member.kind != "beam":
            return 0.0
        _, _, a, b, diameter = next(each for each in beams(frame) if each[0] == name)
        s = PLACES[place]
        z = float(a[2] + s * (b[2] - a[2]))
        outside = inside = 0.0
        if -frame.depth <= z < self.level:
            outside = (self.level - z) * frame.water_density * 0.25 * np.pi * (diameter(s) + 2.0 * grown(frame, z)) ** 2
        liquid = frame.liquid(member, self.level)
        if liquid is not None and z < liquid[0]:
            mine = np.flatnonzero(self.assembly.elements.member == self.assembly.members.index(name))
            section = self.assembly.elements.properties[mine[min(int(s * len(mine)), len(mine) - 1)]]
            assert section is not None
            inside = (liquid[0] - z) * liquid[1] * section.hole
        return self.gravity * (outside - inside)
