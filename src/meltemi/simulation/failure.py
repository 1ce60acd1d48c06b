"""Why a run ended early."""

from __future__ import annotations

import numpy as np

from meltemi.core.errors import MeltemiError, Status
from meltemi.simulation.case import Case


def explain(case: Case, status: Status, t: float, dt: float) -> str:
    """Reason for the end of a run, with time, state and a hint."""
    name = case.controller.name
    if status is Status.DIVERGED:
        if reasons := [why for part in case.parts if (why := part.why(case))]:
            return f"at t = {t:.3f} s {reasons[0]}"
        # once one coordinate is NaN all are, within a step: the last velocities show which diverged first
        last = np.where(np.isfinite(case["v"]), case["v"], case.v_old)
        size = np.nan_to_num(np.abs(case["q"]), posinf=np.inf) + np.abs(last)
        worst = int(np.argmax(np.where(np.isfinite(size), size, np.inf)))
        return (
            f"at t = {t:.3f} s {status.message} "
            f"(worst: {case.model.coordinates[worst]!r}, q = {case['q'][worst]:.3g}, dq/dt = {case['v'][worst]:.3g}; "
            f"time step {dt:g} s)"
        )
    if status is Status.CONTROLLER_RAISED:
        error = case.entry.exception
        if isinstance(error, MeltemiError):
            return f"at t = {t:.3f} s the controller {name!r} failed: {error}"
        what = f"{type(error).__name__}: {error}" if error is not None else "an exception in compiled code"
        return f"at t = {t:.3f} s the controller {name!r} raised {what}"
    if status is Status.CONTROLLER_DEMAND:
        demands = case.view("demands")
        bad = [
            f"{n} = {demands.array[i]:g} (limit {case.limits[i]:g})"
            for i, n in enumerate(demands.table.names)
            if not abs(demands.array[i]) <= case.limits[i]
        ]
        return f"at t = {t:.3f} s the controller {name!r} returned {', '.join(bad)}"
    return f"at t = {t:.3f} s: {status.message}"
