"""Mechanical energy of the turbine: constant in a run without air, damping, drive and brake.

Reference: docs/theory/structure.md (S-48).
"""

from __future__ import annotations

import numpy as np

from meltemi.compiler import View
from meltemi.simulation.case import Case
from meltemi.simulation.step import equations
from meltemi.structure.tables import BladeNode, GearModes, StructureParameters
from meltemi.structure.tower import STIFFNESS, WEIGHT
from meltemi.turbine.exchange import BladeFrame, BladeMotion, Machine


def mechanical_energy(case: Case) -> tuple[float, float, float]:
    """Kinetic, elastic and gravitational energy [J] for the present coordinates and velocities."""
    equations(0.0, 0.0, case.system)
    model = case.model
    q, v, n = case["q"], case["v"], model.n_core
    A, D = (np.tril(m) + np.tril(m, -1).swapaxes(-1, -2) for m in (case["core_mass"], case["arm_mass"]))
    v_core, v_blade = v[:n], v[n:].reshape(model.n_blades, -1)
    kinetic = 0.5 * v_core @ A @ v_core
    kinetic += np.einsum("bk,bkj,j->", v_blade, case["coupling"], v_core)
    kinetic += 0.5 * np.einsum("bk,bkl,bl->", v_blade, D, v_blade)

    p = View(StructureParameters, model.structure)
    tower, rows = q[: model.rows.yaw], model.rows
    drive = case.control.drive
    twist, yaw = q[rows.torsion], drive.yaw_held * (q[rows.yaw] - drive.yaw_command)
    q_blade = q[n:].reshape(model.n_blades, -1)
    matrix = model.rotor.tower_matrix
    elastic = 0.5 * tower @ matrix[STIFFNESS] @ tower
    rubbed = drive.yaw_rubs * (q[rows.yaw] - drive.yaw_rest)
    elastic += 0.5 * (float(p["shaft_stiffness"]) * twist**2 + float(p["yaw_stiffness"]) * (yaw**2 + rubbed**2))
    elastic += 0.5 * np.einsum("bk,bkl,bl->", q_blade, model.rotor.modal[0], q_blade)

    machine = View(Machine, case["machine"])
    shaft, top, hub = machine["shaft"], machine["top_position"], machine["hub_position"]
    lift = float(p["nacelle_mass"]) * (top + machine["nacelle"].reshape(3, 3) @ p["nacelle_centre"])[2]
    lift += float(p["hub_mass"]) * (hub + float(p["hub_centre"]) * shaft)[2]
    nodes, motion = View(BladeNode, model.rotor.blade_nodes), View(BladeMotion, case["motion"])
    for b in range(model.n_blades):
        R = View(BladeFrame, case["frame"])["orientation"][:, b].reshape(3, 3)
        sections = motion["orientation"][:, b].reshape(3, 3, -1)
        moment = np.einsum("ijn,jn->in", sections, nodes["moment"][:, b])
        total = nodes["mass"][b].sum()
        lift += total * hub[2] + (R @ (nodes["mass"][b] * motion["position"][:, b] + moment).sum(axis=1))[2]
    # energy of the tower itself, as far as it varies
    lift += 0.5 * tower @ matrix[WEIGHT] @ tower - model.rotor.tower_weight @ tower
    moving, strained = _gear_energy(case)
    return float(kinetic) + moving, float(elastic) + strained, float(p["gravity"]) * float(lift)


def _gear_energy(case: Case) -> tuple[float, float]:
    """Kinetic and elastic energy of a gearbox's modes; the mass matrix has the remainder when they are free (S-58)."""
    modes, gears = View(GearModes, case["gear_modes"]), case.view("gears")
    rows = case.model.rows
    machine, v = View(Machine, case["machine"]), case["v"]
    spins = np.array([machine["nacelle_spin"] @ machine["shaft"], v[rows.generator], v[rows.torsion]])
    speed = gears["rate"] + spins @ modes["coupling"] / modes["inertia"]
    strain = modes["frequency"] * gears["angle"]
    return 0.5 * float(modes["inertia"] @ speed**2), 0.5 * float(modes["inertia"] @ strain**2)
