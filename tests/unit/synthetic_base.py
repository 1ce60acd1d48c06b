"""A load base whose series are known: written without a simulation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import Status
from meltemi.loads.loadbase.campaign import make_campaign
from meltemi.loads.loadbase.interfaces import interfaces_of, known_channels, recorded
from meltemi.loads.loadbase.jobs import CaseRow, jobs_of
from meltemi.loads.loadbase.joints import member_channels, with_joints, without_members
from meltemi.loads.loadbase.plan import Plan, PlannedCase, plan
from meltemi.loads.loadbase.reduction import reduced
from meltemi.loads.loadbase.store import ResultStore
from meltemi.loads.loadbase.table import load_table
from meltemi.simulation.channels import find
from meltemi.simulation.result import Result
from meltemi.turbine.library import load_turbine

Series = Callable[[PlannedCase, NDArray[np.float64]], dict[str, Any]]
"""Series of a case by channel, from its time (T,) [s]; other channels are zero."""
STEP = 0.05


def small_plan(rows: Sequence[str] = ("1.1", "1.2", "1.3", "4.1", "6.2", "6.4"), **settings: Any) -> Plan:
    """Plan of a few rows of the table with short cases."""
    given: dict[str, Any] = {"rated_wind": 11.4, "quick": True, "duration": 10.0, "transient": 0.0}
    changes = {"without": sorted(load_table(settings.get("edition", 4)).rows.keys() - {*rows})} | settings.pop(
        "changes", {}
    )
    return plan(make_campaign(settings.pop("turbine", "nrel5mw"), "IB", changes=changes, **given | settings))


def waves(case: PlannedCase, time: NDArray[np.float64]) -> dict[str, Any]:
    """Loads and power that grow with the wind speed, different in each seed and yaw error."""
    speed, seed, yaw = case.variant.speed, case.variant.seed or 1, case.variant.yaw or 0.0
    level = speed * (1.0 + 0.02 * (seed % 7) + 0.001 * yaw)
    wave = np.sin(2.0 * np.pi * time)
    found: dict[str, Any] = {"tower_base_force_z": -6e6 + 0.0 * time, "tip_clearance_1": 12.0 - 0.1 * level + wave}
    found |= {f"tip_clearance_{b}": 13.0 + 0.0 * time for b in (2, 3)}
    found |= {"generator_power": 5e6 * min((speed / 11.4) ** 3, 1.0) + 0.0 * time, "rotor_speed": 1.2 + 0.01 * wave}
    found |= {
        "tower_base_moment_fore_aft": level * 1e6 * (2.0 + wave),
        "tower_base_moment_side_side": level * 1e5 * wave,
    }
    for b in (1, 2, 3):
        found[f"root_moment_out_of_plane_{b}"] = level * 1e5 * (5.0 + wave * (1.0 + 0.1 * b))
        found[f"root_moment_in_plane_{b}"] = 1e6 * np.cos(2.0 * np.pi * time + b)
        found[f"pitch_{b}"] = 0.01 * wave
    found |= {"rotor_torque": 4e6 + level * 1e4 * wave, "tower_top_acceleration_x": 0.01 * level * wave}
    return found


def synthetic_base(
    folder: Path,
    of: Plan,
    series: Series = waves,
    *,
    status: dict[str, tuple[Status, str]] | None = None,
    warnings: dict[str, tuple[str, ...]] | None = None,
    without: Sequence[str] = (),
) -> Plan:
    """Write results of the cases of a plan.

    Args:
      folder: of the load base.
      of: the plan.
      series: of each case.
      status: status and message of cases that are not OK.
      warnings: of cases.
      without: cases that are missing.
    """
    turbine = load_turbine(of.campaign.turbine)
    interfaces = interfaces_of(turbine)
    names = recorded(turbine, interfaces)
    known = known_channels(turbine.n_blades)
    channels = tuple(find(name, known) for name in names)
    if of.campaign.joints:
        like = find("tower_base_force_x", known)
        channels += tuple(replace(like, name=name) for name in member_channels(turbine.frame))
    cases, rows = {case.name: case for case in of.cases}, []
    for job in jobs_of(of):
        if job.name in without:
            continue
        case = cases[job.name]
        state, message = (status or {}).get(job.name, (Status.OK, "completed"))
        time = STEP * np.arange(round(case.duration / STEP) + 1)
        given = series(case, time)
        data = np.zeros((len(time), len(channels)))
        for k, channel in enumerate(channels):
            if channel.name in given:
                data[:, k] = given[channel.name]
        assert given.keys() <= {c.name for c in channels}
        result = Result(time, data, channels, state, message, {"output_step": STEP})
        kept = reduced(without_members(result), interfaces, rated_speed=1.267, cycles=job.cycles)
        if job.joints:
            kept = with_joints(kept, result, turbine.frame, job.joints, cycles=job.cycles)
        own = kept if state.complete else None
        words = (warnings or {}).get(job.name, ())
        rows.append(CaseRow(job.name, job.key, state, message, words, case.duration, reduced=own))
    ResultStore(folder).write(rows)
    return of
