"""Hot-spot stresses of the welds of a joint from section loads (F-58 to F-61)."""

from __future__ import annotations

from collections.abc import Mapping
from math import sin
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.frames.joints.geometry import Brace, Joint, Tube
from meltemi.frames.joints.scf import Factors
from meltemi.frames.joints.stress import ANGLES

Float = NDArray[np.float64]
Loads = Mapping[tuple[str, str], Float]
"""Section loads (T, 6) [N, N m] by member and place: start, middle or end."""
Classification = Literal["load path", "geometry"]

SIDES = ("chord", "brace")
ATTACHMENT = 1.27, 0.4 * 1.27
"""Factors of the chord's nominal stress at the crowns of chord and brace side."""


def classes(joint: Joint, loads: Loads, how: Classification) -> Float:
    """Shares of K, X and T/Y of each brace's axial load, (n, 3, T), or (n, 3, 1) by geometry (F-59).

    By load path, the components of the axial forces normal to the chord are balanced in each plane and at each instant:
    K with braces on the same side, X with those on the other side, T/Y by shear of the chord. By geometry: K with a
    brace beside it, otherwise X with one opposite to it, otherwise T/Y.
    """
    same, opposite = joint.beside()
    if how == "geometry":
        beside = same.sum(axis=1) > 1
        crossing = ~beside & opposite.any(axis=1)
        return np.stack([beside, crossing, ~beside & ~crossing], axis=1)[:, :, None].astype(float)
    P = np.array([loads_of(b.tube, loads)[:, 2] * sin(b.angle) for b in joint.braces])
    pull, push = same @ np.maximum(P, 0.0), same @ np.maximum(-P, 0.0)
    largest = np.where(P >= 0.0, pull, push)
    with np.errstate(divide="ignore", invalid="ignore"):
        K = np.where(largest > 0.0, np.minimum(pull, push) / largest, 0.0)
        rest, across = pull - push, opposite @ P
        through = np.where(rest * across > 0.0, np.minimum(np.abs(across / rest), 1.0), 0.0)
    X = (1.0 - K) * through
    return np.stack([K, X, 1.0 - K - X], axis=1)


def balanced(joint: Joint, stresses: Float, how: Classification) -> Float:
    """Share of each brace's out-of-plane bending that braces opposite to it balance, (n, T) or (n, 1) (F-59).

    Args:
      stresses: (n, T, 3) nominal stresses of the braces.
    """
    if how == "geometry":
        return classes(joint, {}, how)[:, 1]
    sizes = np.array([brace.tube.modulus * sin(brace.angle) for brace in joint.braces])
    about = sizes[:, None] * stresses[:, :, 2]  # moments on the chord about its axis
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.clip(np.where(about != 0.0, -(joint.beside()[1] @ about) / about, 0.0), 0.0, 1.0)


def loads_of(tube: Tube, loads: Loads) -> Float:
    """Section loads (T, 6) of a member's end.

    Raises:
      InputError: they are missing or of another shape.
    """
    given = loads.get((tube.member, tube.end))
    if given is None or given.ndim != 2 or given.shape[1] != 6:
        what = "are missing" if given is None else f"have the shape {given.shape}, expected (T, 6)"
        raise InputError(f"joints: section loads of member {tube.member!r} at its {tube.end} {what}")
    return given


def weld_stresses(joint: Joint, brace: Brace, loads: Loads) -> Float:
    """Nominal stresses (T, 3) of a brace at its weld: axial, and in-plane and out-of-plane bending (F-58).

    In-plane bending is positive at the crown along the chord's axis, out-of-plane bending at the saddle a right angle
    on, by the right-hand rule about the brace's direction. Moments are those where its axis meets the chord's surface.
    """
    tube, given = brace.tube, loads_of(brace.tube, loads)
    arm = 0.5 * joint.diameter / sin(brace.angle) * (1.0 if tube.end == "start" else -1.0)
    x, y = given[:, 3] + arm * given[:, 1], given[:, 4] - arm * given[:, 0]
    crown = joint.axis - (joint.axis @ tube.direction) * tube.direction
    crown /= np.linalg.norm(crown)
    points = (tube.axes @ e for e in (crown, np.cross(tube.direction, crown)))
    return np.stack([given[:, 2] / tube.area, *((x * e[1] - y * e[0]) / tube.modulus for e in points)], axis=1)


def chord_stress(joint: Joint, brace: Brace, loads: Loads, *, bending: bool, axial: bool) -> Float:
    """Nominal stresses (T, 2) of the chord's surface below a brace, ahead of and behind the joint (F-60).

    The axial stress is the mean of both sides: what the braces add to one and take from the other is in their factors.
    """
    bent, pulled = [], []
    for tube in (joint.chord[0], joint.chord[-1]):
        e, given = tube.axes @ brace.radial, loads_of(tube, loads)
        bent.append(bending * (given[:, 3] * e[1] - given[:, 4] * e[0]) / tube.modulus)
        pulled.append(axial * given[:, 2] / tube.area)
    return np.stack(bent, axis=1) + np.mean(pulled, axis=0)[:, None]


def hot_spots(
    joint: Joint,
    factors: list[Factors],
    loads: Loads,
    how: Classification = "load path",
    *,
    bending: bool = True,
    axial: bool = True,
) -> Float:
    """Hot-spot stresses (n, 2, 8, T) [N/m^2] of each brace, chord and brace side, at eight points of its weld (F-61).

    Points go round from the crown along the chord's axis in steps of 45 degrees: crowns 0 and 4, saddles 2 and 6.

    Args:
      factors: of each brace.
      loads: section loads of braces and chord at the joint.
      how: classification of the axial loads.
      bending, axial: whether stress of the chord by its bending and by its axial force is added at the crowns.

    Raises:
      InputError: loads are missing.
    """
    c, s = np.cos(ANGLES), np.sin(ANGLES)
    near, shares = c**2, classes(joint, loads, how)
    nominal = np.array([weld_stresses(joint, brace, loads) for brace in joint.braces])
    across = balanced(joint, nominal, how)
    stresses = []
    for i, (brace, f) in enumerate(zip(joint.braces, factors, strict=True)):
        straight, in_plane, out_of_plane = nominal[i].T
        mixed = np.einsum("kij,kt->ijt", f.axial, shares[i])  # side, crown or saddle, instant
        around = near[:, None] * mixed[:, None, 0] + (1.0 - near)[:, None] * mixed[:, None, 1]
        inside, alone, opposed = f.bending.T[:, :, None, None]
        out_of_plane = (alone + (opposed - alone) * across[i]) * out_of_plane
        stress = around * straight + inside * c[:, None] * in_plane + s[:, None] * out_of_plane
        if bending or axial:
            ahead, behind = chord_stress(joint, brace, loads, bending=bending, axial=axial).T
            below = np.where(c[:, None] > 1e-9, ahead, behind) * near[:, None]
            stress = stress + np.array(ATTACHMENT)[:, None, None] * below
        stresses.append(stress)
    return np.array(stresses)
