"""Whether a platform floats upright with its turbine and lines, before anything is simulated.

Reference: docs/theory/floating.md (W-23).
"""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.floating.moorings import at_rest, strings
from meltemi.floating.platform import Platform
from meltemi.floating.potential import HydroCoefficients
from meltemi.sea.airy import GRAVITY
from meltemi.structure.members import blade_beam, tower_beam

Float = NDArray[np.float64]

DEEPEST = 5.0
"""[m] largest rise or fall of a platform to its equilibrium."""
ADDED = (1e-2, 1e2)
"""Bounds of added mass in surge over the mass of the water displaced."""
STRETCH = 0.02
"""Largest strain of a line at rest."""


def check_balance(turbine: Any, c: HydroCoefficients) -> None:
    """Check that coefficients, masses and lines belong together, and that the platform floats upright.

    Raises:
      InputError: they do not, or it does not.
    """
    platform: Platform = turbine.platform
    name, rho = turbine.name, platform.water_density
    share = c.infinite[0, 0] / platform.volume
    if c.infinite.any() and not ADDED[0] <= share <= ADDED[1]:
        raise InputError(
            f"{name}: platform.coefficients: added mass in surge is {share:.3g} of the water that volume displaces: "
            "of another platform, or not for a reference length of 1 m"
        )
    for i, line in enumerate(platform.lines):
        if line.wet_mass(rho) <= 0.0:
            raise InputError(f"{name}: platform.lines: line {i + 1} floats; check its diameter")
    check_reach(platform, f"{name}: platform.lines")
    mass, moment = turbine_weight(turbine)
    pull = lines_load(platform, np.zeros(6))
    lift = rho * platform.volume - platform.mass - mass + pull[2] / GRAVITY
    area = c.hydrostatic[2, 2]
    if abs(lift) > DEEPEST * rho * area:
        what = "sinks" if lift < 0.0 else "rises"
        by = f"{abs(lift) / (rho * area):.3g} m" if area > 0.0 else "without end"
        raise InputError(
            f"{name}: platform {what} {by}: it displaces {1e-3 * rho * platform.volume:.6g} t of water, and platform "
            f"({1e-3 * platform.mass:.6g} t), turbine ({1e-3 * mass:.6g} t) and lines ({-1e-3 * pull[2] / GRAVITY:.4g} "
            "t) weigh other than that; correct volume or mass (ballast)"
        )
    weight = GRAVITY * (platform.mass * platform.centre[2] + moment)
    for k, motion in ((3, "roll"), (4, "pitch")):
        turn = np.zeros(6)
        turn[k] = 1e-3
        lines = -(lines_load(platform, turn)[k] - lines_load(platform, -turn)[k]) / 2e-3
        platform_stiffness = 0.0 if platform.stiffness is None else platform.stiffness[k, k]
        stiffness = rho * GRAVITY * c.hydrostatic[k, k] - weight + lines + platform_stiffness
        if stiffness <= 0.0:
            raise InputError(
                f"{name}: platform capsizes in {motion}: water, weight and lines have a stiffness of {stiffness:.3g} "
                "N m/rad; lower platform.centre with ballast, or use coefficients whose .hst has the water alone"
            )


def check_reach(platform: Platform, where: str, level: float = 0.0) -> None:
    """Check that lines reach from the platform to their anchors, with water a level [m] above that at rest.

    Raises:
      InputError: they are too short.
    """
    problems, lines = [], platform.lines
    for row in strings(lines, platform.points):
        ends = lines[row[0]].fairlead, lines[row[-1]].anchor
        fixed = [x + up for x, up in zip(ends, (level * np.eye(3)[2], 0.0), strict=True) if not isinstance(x, str)]
        problems.append((row, fixed, next((x for x in ends if isinstance(x, str)), "")))
    ways = [(row, fixed) for row, fixed, point in problems if not point]
    # two strings that meet in a free point
    ways += [(a[0] + b[0], a[1] + b[1]) for a, b in combinations(problems, 2) if a[2] and a[2] == b[2]]
    for which, (first, last) in ways:
        length = sum(lines[k].length for k in which)
        strain = float(np.linalg.norm(first - last)) / length - 1.0
        if strain > STRETCH:
            numbers = ", ".join(str(k + 1) for k in which)
            raise InputError(
                f"{where}: line {numbers}: the ends are {100.0 * strain:.3g} "
                f"% further apart than its length of {length:g} m; correct the length or the anchor"
            )


def turbine_weight(turbine: Any) -> tuple[float, float]:
    """Mass [kg] of the turbine on the platform, and its moment [kg m] about still water, undeflected."""
    tower, blade, nacelle = tower_beam(turbine.tower), blade_beam(turbine.blade.structure), turbine.nacelle
    z, weights = tower.pieces(tower.position[[0, -1]])
    share = weights[:, 0] * tower.at(z, "mass")[:, 0, 0]
    s, along = blade.pieces(blade.position[[0, -1]])
    rotor = turbine.hub.mass + turbine.n_blades * float(along[:, 0] @ blade.at(s, "mass")[:, 0, 0])
    base, fixed = turbine.tower.base_height, turbine.tower.top_mass
    top = base + turbine.tower.length
    moment = float(share @ (base + z)) + nacelle.mass * (top + nacelle.mass_centre[2]) + rotor * turbine.hub_height
    return float(share.sum()) + nacelle.mass + rotor + fixed, moment + fixed * top


def lines_load(platform: Platform, motion: Float) -> Float:
    """(6,) load [N], [N m] of the lines on the platform's point in a small motion (6,) [m], [rad]."""
    fairleads = np.array([np.zeros(3) if isinstance(line.fairlead, str) else line.fairlead for line in platform.lines])
    fairleads = fairleads.reshape(-1, 3)
    r = fairleads + np.cross(motion[3:], fairleads)
    rest = at_rest(platform.lines, platform.points, platform.depth, platform.water_density, motion[:3] + r)
    return np.concatenate([rest.force.sum(axis=0), np.cross(r, rest.force).sum(axis=0)])
