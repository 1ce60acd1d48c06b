"""Vortices as a view draws them: four lines behind each blade, with points of equal age at all times."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.vortex.tables import VortexParameters

LENGTH, SPACING = 7.0, pi / 6.0
"""[revolutions] age at which the lines end; [rad] azimuth between their points."""
Float = NDArray[np.float64]


def vortex_lines(case: Any, parameters: Any) -> NDArray[np.float32]:
    """(blade, line, point, 4) points [m], inertial axes, and strength [m^2/s], positive towards the tip.

    Lines are numbered from root to tip. In the first zone they go from four edges of the elements to the centres of the
    vortices that will merge; in the last revolution of the second the inner two approach the outer ones. So they are
    the same before and after vortices merge. Age 0 is at the trailing edge. The present place of a vortex is that at
    the end of the step of the wake, less its way until then.
    """
    from scipy.interpolate import CubicSpline

    state, p, line = case.view("vortex_state"), VortexParameters(parameters), case.view("lifting_line")
    n, step, turn = line["position"].shape[-1], max(float(state["step"]), 1e-9), 2.0 * pi / p.azimuth_step
    late = 1.0 - (float(state["time"]) - float(state["begin"])) / step
    first, merged = [0, n // 4, n - n // 4, n], np.array([1.0, p.merge_2, p.merge_2 * p.merge_3])
    ends = np.cumsum(merged * (p.panels_1, p.panels_2, p.panels_3))  # least ages [steps] of the zones' last rows
    bound = np.concatenate([line["inner_end"], line["outer_end"][..., -1:]], axis=-1)[..., first]
    ages, points, strengths, youngest = [np.array([-0.5])], [bound[:, :, None]], [], 1.0 - late
    for number in range(3):
        zone, rows = case.view(f"wake_{number + 1}"), int(state[f"rows_{number + 1}"])
        rows -= number < 2  # the last row is the first one of the next zone
        age = youngest + merged[number] * np.arange(rows)
        place = (zone["position"] - late * step * zone["velocity"])[:, :, :rows]
        circulation = zone["circulation"][:, :rows, :-1]
        trailed = -np.diff(circulation, axis=-1, prepend=0.0, append=0.0)
        if number == 0:
            centre, strength = _groups(place, trailed, np.abs(circulation).argmax(axis=-1))
            share = np.clip(age / ends[0], 0.0, 1.0)[:, None]
            place = (1.0 - share) * place[..., first] + share * centre
        elif number == 1:
            weight = np.abs(trailed) + 1e-9
            pairs = (weight * place).reshape(*place.shape[:-1], 2, 2).sum(axis=-1)
            centre = np.repeat(pairs / weight.reshape(*weight.shape[:-1], 2, 2).sum(axis=-1), 2, axis=-1)
            share = np.clip(1.0 + (age - ends[1]) / turn, 0.0, 1.0)[:, None]
            place, moved = (1.0 - share) * place + share * centre, share * trailed[..., 1:3]
            strength = trailed + np.stack([moved[..., 0], -moved[..., 0], -moved[..., 1], moved[..., 1]], axis=-1)
        else:
            place, strength = place[..., [0, 0, 1, 1]], trailed[..., [0, 0, 1, 1]] * [1.0, 0.0, 0.0, 1.0]
        ages.append(age)
        points.append(place)
        strengths.append(strength)
        youngest += merged[number] * rows
    values = np.concatenate(points, axis=2), np.concatenate([strengths[0][:, :1], *strengths], axis=1)[None]
    known = np.nan_to_num(np.concatenate(values), posinf=0.0, neginf=0.0)  # of a wake that is lost
    known_ages, each = np.concatenate(ages), max(round(SPACING / p.azimuth_step), 1)
    drawn = np.minimum(np.arange(0.0, min(LENGTH * turn, ends[-1]) + 1e-9, each), known_ages[-1])
    curves = CubicSpline(known_ages, np.moveaxis(known, 2, 0))(drawn)  # (point, 4, blade, line)
    return np.ascontiguousarray(np.transpose(curves, (2, 3, 0, 1)), dtype=np.float32)


def _groups(place: Float, trailed: Float, peak: NDArray[np.int64]) -> tuple[Float, Float]:
    """Centres (3, blade, row, 4) and strengths of the vortices of a row: two groups inboard of the peak, two outboard.

    The groups of a side are equally strong, as those that ``wake.merge`` forms.
    """
    weight = np.abs(trailed) + 1e-9
    upto, outer = np.cumsum(weight, axis=-1), np.arange(weight.shape[-1]) > peak[..., None]
    middle, inner = upto - 0.5 * weight, np.take_along_axis(upto, peak[..., None], axis=-1)
    group = np.where(outer, 2 + (middle > 0.5 * (inner + upto[..., -1:])), middle > 0.5 * inner)
    member = (group[..., None] == np.arange(4)).astype(float)
    total = np.maximum(np.einsum("bre,breg->brg", weight, member), 1e-12)
    return np.einsum("kbre,bre,breg->kbrg", place, weight, member) / total, np.einsum("bre,breg->brg", trailed, member)
