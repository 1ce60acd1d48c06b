"""Vortices as a view draws them: four lines behind each blade, with points of equal age at all times."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.vortex.tables import VortexParameters

LENGTH, SPACING = 10.0, pi / 6.0
"""[revolutions] age at which the lines end; [rad] azimuth between their points."""


def vortex_lines(case: Any, parameters: Any) -> NDArray[np.float32]:
    """(blade, line, point, 4) points [m], inertial axes, and strength [m^2/s], positive towards the tip.

    Lines are numbered from root to tip. Where a zone has more vortices, they are some of these with the strength of their
    part of the span; where it has fewer, lines coincide and the inner ones have no strength. The present place of a
    vortex is that at the end of the step of the wake, less its way until then.
    """
    from scipy.interpolate import CubicSpline

    state, p, line = case.view("vortex_state"), VortexParameters(parameters), case.view("line")
    n, step = line["position"].shape[-1], max(float(state["step"]), 1e-9)
    late = float(state["begin"]) / step + 1.0 - float(state["time"]) / step
    edges = (0, n // 4, n - n // 4, n), (0, 1, 2, 3), (0, 0, 1, 1)
    panels = (n // 8, n // 2, n - 1 - n // 8), (0, 1, 2), (0, 0, 0)
    merged = 1.0, float(p.merge_2), float(p.merge_2 * p.merge_3)
    bound = np.concatenate([line["inner_end"], line["outer_end"][..., -1:]], axis=-1)[..., edges[0]]  # age 0
    ages, points, strengths, youngest = [np.zeros(1)], [bound[:, :, None]], [], 1.0 - late
    for number in range(3):
        zone, rows = case.view(f"wake_{number + 1}"), int(state[f"rows_{number + 1}"])
        rows -= number < 2  # the last row is the first one of the next zone
        age = np.arange(rows)
        place = zone["position"] - late * step * zone["velocity"]
        ages.append(youngest + merged[number] * age)
        points.append(place[:, :, :rows, edges[number]])
        strengths.append(-np.diff(zone["circulation"][:, :rows, panels[number]], axis=-1, prepend=0.0, append=0.0))
        youngest += merged[number] * rows
    strengths.insert(0, strengths[0][:, :1])
    known, each = np.concatenate(ages), max(round(SPACING / p.azimuth_step), 1)
    values = np.concatenate([np.concatenate(points, axis=2), np.concatenate(strengths, axis=1)[None]])
    last = min(
        2.0 * pi * LENGTH / p.azimuth_step, merged[0] * p.panels_1 + merged[1] * p.panels_2 + merged[2] * p.panels_3
    )
    drawn = np.minimum(np.arange(0.0, last + 1e-9, each), known[-1])
    curves = CubicSpline(known, np.moveaxis(values, 2, 0))(drawn)  # (point, 4, blade, line)
    return np.ascontiguousarray(np.transpose(curves, (2, 3, 0, 1)), dtype=np.float32)
