"""Large deflections of the simulator's blade under dead loads against the geometrically exact beam.

The loads are the mean aerodynamic ones of the turbine at rated wind, scaled until the tip is out by a given share of
the blade's length. Both blades have the same loads: the simulator's at its nodes, with their moments about them.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from meltemi.simulation.bladed.rotor import BladedModel, with_blades
from meltemi.simulation.case import Case
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.simulation.trim import operating_point
from meltemi.structure.beam import Beam
from meltemi.structure.blades import blade_motion, tip_deflection
from meltemi.turbine.library import load_turbine
from meltemi.verification.exact_beam import DeadLoads, Deflection, deflect
from meltemi.verification.table import Check, CheckTable, angle, relative
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]

RATED = {"iea15mw": 10.6, "iea22mw": 10.6}
"""[m/s] wind speed whose loads are scaled."""
SHARES = (0.05, 0.10, 0.15, 0.20)
"""Deflection of the tip over the length of the blade."""
TWIST_SPAN = 0.8
"""Relative span at which the twist is compared; beyond it the sections of these blades carry little."""
STATIONS = 61
"""Least number of stations of the exact beam; with one step of integration between two its tip is exact to 1e-5."""


TIP_TOLERANCE = 0.01
"""Largest relative distance of the tip from the deflection that is looked for."""


def mean_loads(model: BladedModel, wind: float) -> tuple[Beam, DeadLoads]:
    """The blade with refined stations, and the loads on it in steady operation.

    Args:
      model: model of a turbine with 6 x 6 sections.
      wind: [m/s] wind speed.
    """
    case = Case(model, SteadyWind(speed=wind))
    operating_point(model, wind).put(case)
    case.evaluate(0.0)
    layout, beam = model.rotor.blade_layout, model.rotor.blade.beam
    z = np.unique(np.concatenate([beam.position, np.linspace(0.0, beam.position[-1], STATIONS)]))
    fine = Beam(z, beam.at(z, "axis"), beam.at(z, "stiffness"), beam.at(z, "mass"))
    nodes = case["load"][:, 0] / layout.length
    line = np.stack([np.interp(z, layout.position, row) for row in nodes], axis=1)
    return fine, DeadLoads(line[:, :3], line[:, 3:], np.zeros(3), np.zeros(3))


def times(share: float, loads: DeadLoads) -> DeadLoads:
    """The loads multiplied by a number."""
    return replace(loads, force=share * loads.force, moment=share * loads.moment)


def scaled(beam: Beam, loads: DeadLoads, out: float) -> tuple[float, Deflection]:
    """Factor on the loads for which the tip is out by the given share of the blade's length, and the deflection."""
    share, aim = 1.0, out * beam.position[-1]
    while True:
        deflection = deflect(beam, times(share, loads), increments=1, steps=1)
        tip = (deflection.position[-1] - beam.axis[-1])[0]
        if abs(tip / aim - 1.0) < TIP_TOLERANCE:
            return share, deflection
        share *= aim / tip


def on_nodes(beam: Beam, loads: DeadLoads, edges: Float, nodes: Float) -> tuple[Float, Float]:
    """(N, 3) forces [N] and moments [N m] about the nodes of the loads between the edges."""
    z = np.linspace(edges[0], edges[-1], 20_001)
    axis = beam.at(z, "axis")
    arc = np.linalg.norm(np.gradient(axis, z, axis=0), axis=1)
    owner = np.clip(np.searchsorted(edges, z, side="right") - 1, 0, len(nodes) - 1)
    weight = (arc * np.gradient(z))[:, None]
    force, moment = (
        weight * np.stack([np.interp(z, beam.position, line) for line in lines.T], axis=1)
        for lines in (loads.force, loads.moment)
    )
    moment += np.cross(axis - beam.at(nodes, "axis")[owner], force)
    F, M = np.zeros((len(nodes), 3)), np.zeros((len(nodes), 3))
    np.add.at(F, owner, force)
    np.add.at(M, owner, moment)
    return F, M


def simulated(model: BladedModel, force: Float, moment: Float, steps: int = 4) -> tuple[float, Float, Float]:
    """Deflection of the tip out of plane [m], twist of the nodes [rad] and root moment [N m] (3,) under dead loads.

    Args:
      model: model of the turbine.
      force, moment: (N, 3) [N], [N m] loads on the nodes, blade axes.
      steps: number of steps in which the loads are applied.
    """
    case, first = Case(model, SteadyWind(speed=1.0)), model.n_core
    case.evaluate(0.0)
    K, N = np.diag(model.rotor.blade.modes.stiffness), len(force)
    q = case["q"][first : first + len(K)]

    def lack(x: Float, share: float) -> Float:
        q[:] = x
        blade_motion(case.one)
        T = case["partial"].reshape(len(K), 6, -1, N)[:, :, 0]
        work = np.einsum("kcn,nc->k", T[:, :3], force) + np.einsum("kcn,nc->k", T[:, 3:], moment)
        return x - share * work / K

    x = np.zeros(len(K))
    for share in np.arange(1, steps + 1) / steps:
        x = root(partial(lack, share=share), x).x
    lack(x, 1.0)
    motion = case.view("motion")
    out, _ = tip_deflection(case.one, case.sections, 0)
    sections = Rotation.from_matrix(motion["orientation"][:, 0].T.reshape(N, 3, 3))
    arm = motion["position"][:, 0].T - np.array([0.0, 0.0, model.turbine.hub.radius])
    return float(out.x), sections.as_rotvec()[:, 2], (np.cross(arm, force) + moment).sum(axis=0)


def compare(name: str, options: ModelOptions | None = None, shares: tuple[float, ...] = SHARES) -> list[Check]:
    """Deflection, twist and root moment of a blade of the library, against the exact beam.

    Args:
      name: name of the turbine.
      options: options of its model.
      shares: deflections of the tip over the length of the blade.
    """
    model = with_blades(build(load_turbine(name), options), "static deflection")
    beam, loads = mean_loads(model, RATED[name])
    layout = model.rotor.blade_layout
    rows = []
    for out in shares:
        share, exact = scaled(beam, loads, out)
        tip, twist, root_moment = simulated(model, *on_nodes(beam, times(share, loads), layout.edges, layout.position))
        place, case = TWIST_SPAN * beam.position[-1], f"{name}, tip out by {out:.0%}"
        theirs = np.array([rotation.as_rotvec()[2] for rotation in exact.rotation])
        exact_twist = float(np.interp(place, beam.position, theirs))
        allowed = max(0.05, 0.02 * abs(np.degrees(exact_twist)))
        ours = float(np.interp(place, layout.position, twist))
        rows += [
            relative("tip out of plane", case, "m", (exact.position[-1] - beam.axis[-1])[0], tip, 1.0),
            angle(f"twist at {TWIST_SPAN:.0%} of the span", case, exact_twist, ours, allowed),
            relative("root moment out of plane", case, "N m", exact.root_moment[1], float(root_moment[1]), 0.3),
        ]
    return rows


def far_bending() -> CheckTable:
    """Both IEA turbines, to a tip deflection of a fifth of the blade's length."""
    rows = [row for name in RATED for row in compare(name)]
    return CheckTable(
        "far_bending", "Large blade deflections, against the geometrically exact beam", "exact_beam.py", rows
    )
