"""Joints and members of a turbine's frame in the cases of a load base.

Damage and utilisation need the simultaneous loads of all members, so each case is evaluated when it has run: of a case
of fatigue the damage of each point is kept, and the cycles at the worst point of each joint; of one of ultimate loads
the utilisation of each section, with the partial safety factor.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from meltemi.core.errors import InputError
from meltemi.frames.definition import Frame
from meltemi.frames.joints.fatigue import case_damage, largest_utilisations, stresses_of, welds_of
from meltemi.frames.joints.settings import JointSettings
from meltemi.frames.joints.utilisation import CLAUSES
from meltemi.frames.loads import PLACES, SIX, section_loads
from meltemi.loads.loadbase.campaign import Campaign
from meltemi.loads.loadbase.reduction import Reduced, large_cycles
from meltemi.postprocess.cycles import Cycles
from meltemi.simulation.result import Result
from meltemi.turbine.definition import Turbine

MEMBER = "member_"
"""Beginning of the names of members' channels."""
DAMAGE, USE, JOINT = "damage:", "utilisation:", "joint_"
"""Beginnings of the names under which results of a case are kept."""


def joint_settings(campaign: Campaign) -> JointSettings | None:
    """Settings of a campaign; None if it does not ask for joints."""
    return (
        campaign.joints if isinstance(campaign.joints, JointSettings) else JointSettings() if campaign.joints else None
    )


def frame_of(turbine: Turbine) -> Frame:
    """Frame of a turbine.

    Raises:
      InputError: it has none.
    """
    if turbine.frame is None:
        raise InputError(f"joints: {turbine.name} has no frame; leave joints out, or choose a turbine on a jacket")
    return turbine.frame


def member_channels(frame: Frame) -> tuple[str, ...]:
    """Channels of the section loads of the tubular members."""
    tubes = [name for name, m in frame.members.items() if m.kind == "beam" and frame.sections[m.section].kind == "tube"]
    return tuple(f"{MEMBER}{name}_{place}_{load}" for name in tubes for place in PLACES for load in SIX)


def without_members(result: Result) -> Result:
    """A result without the channels of members, whose statistics are not kept."""
    kept = [k for k, name in enumerate(result.names) if not name.startswith(MEMBER)]
    return replace(result, data=result.data[:, kept], channels=tuple(result.channels[k] for k in kept))


def with_joints(kept: Reduced, result: Result, frame: Frame, joints: dict[str, Any], *, cycles: bool) -> Reduced:
    """Reduced results of a case with those of its joints, for fatigue, or of its members, for ultimate loads.

    Args:
      joints: settings, and the partial safety factor of the case.
    """
    part, s = result.evaluated, JointSettings(**joints["settings"])
    loads, numbers = section_loads(frame, part), dict[str, float]()
    counted: dict[str, Cycles] = {}
    if cycles:
        for j, weld in enumerate(welds_of(frame, s)):
            stresses = stresses_of(weld, loads, s)
            damage = case_damage(weld, stresses, float(part.time[-1] - part.time[0]), s)
            numbers |= {f"{DAMAGE}{j}:{':'.join(map(str, at))}": float(d) for at, d in np.ndenumerate(damage)}
            counted[f"{JOINT}{j}"] = large_cycles(stresses[np.unravel_index(int(damage.argmax()), damage.shape)])
    else:
        for (member, place), (ratio, clause) in largest_utilisations(frame, loads, s, joints["factor"]).items():
            numbers[f"{USE}{CLAUSES[s.standard].index(clause)}:{place}:{member}"] = ratio
    return replace(kept, equivalent=kept.equivalent | numbers, cycles=kept.cycles | counted)
