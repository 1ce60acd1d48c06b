"""Defaults for data that windIO does not have, scaled from the NREL 5 MW (Jonkman et al. 2009, NREL/TP-500-38060).

Damping of blades and tower as ratios of the isolated modes, and the locked yaw bearing as a spring. All are noted as
approximated, and supplementary data replace them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from meltemi.core.units import rpm
from meltemi.exchange.windio.control import rotor_inertia
from meltemi.exchange.windio.machine import rotor_speed
from meltemi.exchange.windio.tree import Tree

BLADE, TOWER = 0.00477465, 0.01
"""Damping ratios of all modes of isolated blades, a logarithmic decrement of 3 % (section 2), and tower (section 6)."""
YAW, YAW_DAMPING = 2.0 * math.pi * 3.0 / rpm(12.1), 0.02
"""Frequency of nacelle and rotor on the yaw bearing over the rated rotor speed, and its damping ratio (section 4)."""
NEEDED = {"hub": ("mass",), "nacelle": ("yaw_inertia", "overhang")}
"""Properties that the inertia about the yaw axis requires, in addition to the blades."""
REPORT = "NREL/TP-500-38060"


def supply(data: dict[str, Any], more: Mapping[str, Any], tree: Tree) -> None:
    """Add defaults for data that neither the file nor the supplementary data have.

    Args:
      data: content from the file, which is changed.
      more: supplementary data.
    """

    def lacks(part: str, *names: str) -> bool:
        given = more.get(part, {})
        return isinstance(given, Mapping) and not any(name in each for each in (data[part], given) for name in names)

    beside = more.get("blade", {})
    beside = beside.get("structure", {}) if isinstance(beside, Mapping) else {}
    structure, ratios = data["blade"]["structure"], ("damping", "damping_time")
    if isinstance(beside, Mapping) and not any(name in each for each in (structure, beside) for name in ratios):
        structure["damping"] = dict.fromkeys(("flap", "edge", "torsion"), BLADE)
        why = f"{BLADE:.4g} of critical in all modes, a logarithmic decrement of 3 %, as {REPORT}, section 2"
        tree.note("approximated", "components.blade.structure", "damping of the blades", why)
    if lacks("tower", "damping"):
        data["tower"]["damping"] = dict.fromkeys(("fore_aft", "side_side", "torsion"), TOWER)
        why = f"{TOWER:.4g} of critical in all modes, as {REPORT}, section 6"
        tree.note("approximated", "components.tower.structure", "damping of the tower", why)
    rated, inertia = rotor_speed(tree, "rated_rotor_speed"), yaw_inertia(data, more)
    if rated is None or inertia is None:
        return
    frequency = YAW * rated
    values = {"stiffness": inertia * frequency**2, "damping": 2.0 * YAW_DAMPING * inertia * frequency}
    for name, value in values.items():
        if lacks("yaw", name):
            data["yaw"][name] = value
            rule = f"{YAW:.3g} times rated rotor speed and {YAW_DAMPING:g} of critical, as {REPORT}, section 4"
            why = f"{value:.4g}: {rule}, for {inertia:.4g} kg m^2 of nacelle and rotor"
            tree.note("approximated", "components.yaw", f"{name} of the locked yaw bearing", why)


def yaw_inertia(data: Mapping[str, Any], more: Mapping[str, Any]) -> float | None:
    """Inertia [kg m^2] of nacelle and rotor about the yaw axis; None if a value is unknown.

    The diametral inertia of the rotor is half of that about the shaft, as for any rotor with three or more blades; its
    mass is at the overhang.
    """
    parts = {name: {**data[name], **more.get(name, {})} for name in NEEDED}
    if any(key not in parts[name] for name, keys in NEEDED.items() for key in keys):
        return None
    structure, hub, nacelle = data["blade"]["structure"], parts["hub"], parts["nacelle"]
    blade = float(np.trapezoid(structure["mass_matrix"][:, 0, 0], structure["position"]))
    rotor = data["n_blades"] * blade + hub["mass"]
    turning = rotor_inertia(data["blade"], hub, data["n_blades"])
    return float(nacelle["yaw_inertia"] + 0.5 * turning + rotor * nacelle["overhang"] ** 2)
