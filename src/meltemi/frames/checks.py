"""Checks of the geometry of a frame, with the joint or member of which something is wrong."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.sparse.csgraph
from scipy.spatial import cKDTree

from meltemi.core.errors import PlacedError

Frame = Any
"""A record of ``frames.definition``, which imports this module."""
TOLERANCE = 1e-3
"""[m] joints closer than this are the same."""
FARTHEST, WIDEST = 2000.0, 30.0
"""[m] coordinates and widths beyond which they are taken for millimetres."""


def check(frame: Frame) -> None:
    """Check lengths, connections and what springs, cables and feet need.

    Raises:
      PlacedError: something is wrong.
    """
    for name, place in frame.joints.items():
        if np.abs(place).max() > FARTHEST:
            raise PlacedError(f"joint {name!r} is at {np.abs(place).max():g} m; is it in mm?", "joints", name)
    for name, section in frame.sections.items():
        if section.breadth > WIDEST:
            raise PlacedError(f"section {name!r} is {section.breadth:g} m wide; is it in mm?", "sections", name)
    _members(frame)
    _connections(frame)
    for i, foot in enumerate(frame.feet):
        _shapes(foot, {"stiffness": (6, 6), "mass": (6, 6)}, "feet", i)
        if foot.joint in (each.joint for each in frame.feet[:i]):
            raise PlacedError(f"joint {foot.joint!r} has two feet", "feet", i)
        if (K := foot.stiffness) is not None and not (np.allclose(K, K.T, rtol=1e-6) and np.linalg.eigvalsh(K)[0] > 0):
            raise PlacedError("stiffness must be symmetric and positive definite", "feet", i, "stiffness")
        pile = frame.sections.get(foot.pile_section or "")
        if foot.soil is not None and (foot.pile_length is None or pile is None or pile.kind != "tube"):
            raise PlacedError("a foot with soil needs pile_length and pile_section, a tube", "feet", i)
    for i, mass in enumerate(frame.masses):
        _shapes(mass, {"inertia": (6,), "centre": (3,)}, "masses", i)
    _shapes(frame, {"interface_damping": (6, 6)})
    for name, release in frame.releases.items():
        if release.kind != "ball" and (release.axis is None or len(release.axis) != 3 or not release.axis.any()):
            raise PlacedError(f"a {release.kind} joint needs axis, a direction of 3 numbers", "releases", name)
    layers = sorted((layer.bottom, layer.top, i) for i, layer in enumerate(frame.growth))
    for (_, top, _), (bottom, _, i) in pairwise(layers):
        if bottom < top:
            raise PlacedError(f"growth from {bottom:g} m begins within that which ends at {top:g} m", "growth", i)


def _members(frame: Frame) -> None:
    for name, member in frame.members.items():
        a, b = member.joints
        length = float(np.linalg.norm(frame.joints[b] - frame.joints[a]))
        problem = ""
        if a == b or (member.kind in ("beam", "cable") and length < TOLERANCE):
            problem = f"has no length: joints {a!r} and {b!r} are at one place; use one joint, or a spring"
        elif member.kind == "spring" and length > TOLERANCE:
            problem = f"is a spring between joints {length:g} m apart; they must be at one place"
        elif member.kind == "spring" and (member.stiffness is None or member.stiffness.shape != (6, 6)):
            problem = "is a spring and needs stiffness, 6 rows of 6"
        elif member.kind == "cable" and member.axial_stiffness is None:
            problem = "is a cable and needs axial_stiffness"
        elif member.kind == "beam" and member.end_section is not None:
            first, last = (frame.sections[each] for each in (member.section, member.end_section))
            if first.kind != last.kind or (first.thickness is None) != (last.thickness is None):
                problem = f"has a section {member.section!r} and an end_section {member.end_section!r} of another kind"
        if not problem and member.flooded and member.filled_to is not None:
            problem = "is flooded and has filled_to: the sea fills a flooded member to its level; remove one of them"
        if problem:
            raise PlacedError(f"member {name!r} {problem}", "members", name)


def _connections(frame: Frame) -> None:
    """Every joint is connected with a foot or the interface, and those at one place with each other."""
    names = list(frame.joints)
    number = {name: i for i, name in enumerate(names)}
    links = [member.joints for member in frame.members.values()]
    links += [(frame.interface[0], name) for name in frame.interface[1:]]
    row, column = np.array([[number[name] for name in link] for link in links]).reshape(-1, 2).T
    graph = scipy.sparse.coo_array((np.ones(len(row)), (row, column)), (len(names), len(names)))
    _, group = scipy.sparse.csgraph.connected_components(graph, directed=False)
    held = {int(group[number[name]]) for name in (*frame.interface, *(foot.joint for foot in frame.feet))}
    for name, i in zip(names, group, strict=True):
        if int(i) not in held:
            raise PlacedError(
                f"joint {name!r} hangs free: no members connect it with a foot or the interface", "joints", name
            )
    joined = {frozenset(link) for link in links}
    close = cKDTree(np.array([frame.joints[name] for name in names])).query_pairs(TOLERANCE)
    for first, second in ((names[i], names[j]) for i, j in sorted(close)):
        if {first, second} not in joined and not {first, second} <= set(frame.interface):
            raise PlacedError(
                f"joints {first!r} and {second!r} are at one place and not connected; "
                "use one joint, or a spring or a rigid link between them",
                "joints",
                second,
            )


def _shapes(record: Any, wanted: Mapping[str, tuple[int, ...]], *keys: str | int) -> None:
    for name, shape in wanted.items():
        value = getattr(record, name)
        if value is not None and value.shape != shape:
            size = " rows of ".join(map(str, shape))
            raise PlacedError(f"expected {size} numbers, found {value.size}", *keys, name)
