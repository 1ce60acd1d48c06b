"""Masses of the parts of a turbine, as its description has them."""

from __future__ import annotations

from typing import Any

import numpy as np

from meltemi.frames.finite_elements import assemble
from meltemi.frames.reduction import tower_base
from meltemi.reports.turbine_facts import frame_masses


def masses(turbine: Any) -> dict[str, float]:
    """Masses [kg] by part: of one blade, tower, hub, rotor, nacelle, and of what stands or floats below.

    ``support`` is the steel of a pile with its fixtures, ``frame`` all of a frame but water and growth, ``platform``
    includes ballast, ``moorings`` are lines and their points in air. A power-coefficient turbine has none of the rotor.
    """
    found: dict[str, float] = {}
    if (blade := getattr(turbine, "blade", None)) is not None:
        structure = blade.structure
        line = structure.mass if getattr(structure, "mass", None) is not None else structure.mass_matrix[:, 0, 0]
        found["blade"] = float(np.trapezoid(line, structure.position))
        found["hub"], found["nacelle"] = turbine.hub.mass, turbine.nacelle.mass
        found["rotor"] = turbine.n_blades * found["blade"] + turbine.hub.mass
        found["tower"] = float(np.trapezoid(turbine.tower.mass, turbine.tower.position))
    if (pile := getattr(turbine, "support", None)) is not None:
        found["support"] = pile.density * _volume(pile) + sum(each.mass for each in pile.masses)
    if (frame := getattr(turbine, "frame", None)) is not None:
        parts = frame_masses(assemble(frame, tower_base(frame, turbine.tower)))
        found["frame"] = parts.get("steel", 0.0) + parts.get("masses at joints", 0.0)
    if (platform := getattr(turbine, "platform", None)) is not None:
        found["platform"] = platform.mass
        found["moorings"] = sum(line.mass * line.length for line in platform.lines)
        found["moorings"] += sum(point.mass for point in platform.points.values())
    return found


def _volume(pile: Any) -> float:
    """[m^3] volume of the wall: diameter and thickness are linear between stations, so Simpson's rule is exact."""
    ends = np.pi * pile.thickness * (pile.diameter - pile.thickness)
    d, t = (0.5 * (a[1:] + a[:-1]) for a in (pile.diameter, pile.thickness))
    middle = np.pi * t * (d - t)
    return float(np.sum(np.diff(pile.position) * (ends[:-1] + 4.0 * middle + ends[1:])) / 6.0)
