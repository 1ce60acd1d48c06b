"""Rotors and wings that are set by hand in the record of a vortex wake, without the rest of the turbine."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import meltemi
from meltemi import ModelOptions, SteadyWind
from meltemi.compiler import Rot, View
from meltemi.simulation.case import Case
from meltemi.turbine.exchange import BladeFrame
from meltemi.vortex.start import build
from meltemi.vortex.wake import at_blades, store_blade, store_wake
from meltemi.wind.velocity import series_now

Float = NDArray[np.float64]
STILL = Rot(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def by_hand(
    turbine: Any, wake: str = "hybrid", nodes: int = 20, field: SteadyWind | None = None, **vortices: Any
) -> Case:
    """The arrays of a turbine with a vortex wake: rotor about the x axis in uniform wind, all else zero."""
    options = ModelOptions(blade_nodes=nodes, wake=wake, vortices={"eddy_viscosity": 0.0, **vortices})
    case = Case(meltemi.build(turbine, options), field or SteadyWind(speed=1.0, shear_exponent=0.0))
    series_now(0.0, case.system)
    case.view("machine")["shaft"] = [1.0, 0.0, 0.0]
    case.view("machine")["hub_position"] = case.view("machine")["hub_velocity"] = 0.0
    frame = View(BladeFrame, case["frame"])
    frame["orientation"] = np.eye(3).reshape(9, 1)
    frame["cos_pitch"], frame["sin_pitch"] = 1.0, 0.0
    case.view("lifting_line")["along"] = 0.0
    return case


def turn(case: Case, wind: float, speed: float) -> None:
    """Wind [m/s] along the x axis and rotor speed [rad/s] about it."""
    case.view("rotor")["wind"], case.view("rotor")["axial_wind"] = [wind, 0.0, 0.0], wind
    case.view("machine")["rotor_speed"], case.view("machine")["rotor_spin"] = speed, [speed, 0.0, 0.0]


def place(case: Case, ends: Float) -> None:
    """Elements between (blade, node + 1, 3) points [m], each with its control point in the middle."""
    line = case.view("lifting_line")
    line["inner_end"], line["outer_end"] = ends[:, :-1].transpose(2, 0, 1), ends[:, 1:].transpose(2, 0, 1)
    line["position"] = 0.5 * (line["inner_end"] + line["outer_end"])


def radial(r: ArrayLike, blades: int = 3) -> Float:
    """(blade, node + 1, 3) points at radii [m] on blades in the plane x = 0."""
    r, azimuth = np.asarray(r, float), 2.0 * np.pi * np.arange(blades)[:, None] / blades
    return np.stack([np.zeros((blades, len(r))), r * np.cos(azimuth), r * np.sin(azimuth)], axis=2)


def settle(case: Case, circulation: ArrayLike, step: float) -> Float:
    """(3, blade, node) [m/s] velocity at the elements by the straight wake of a circulation [m^2/s].

    Args:
      step: [s] step of the wake.
    """
    m, bound, own = case.system, case.view("bound"), case.view("bound_influence")
    bound["circulation"] = circulation
    for zone in (1, 2, 3):
        case[f"drift_{zone}"][...] = 0.0
    m.vortex_state.step = step
    build(m, step)
    m.vortex_state.step = 0.0
    at_blades(m, STILL, step, 1.0)
    m.vortex_state.step = step
    return np.asarray(bound["after"] + np.einsum("xbij,bj->xbi", own["after"], bound["circulation"]))


def solved(case: Case, chord: Float, wind: float, alpha: float, step: float) -> tuple[Float, Float]:
    """(node,) [m^2/s] circulation of a wing along the y axis with the lift 2 pi alpha, and (node,) [m/s] its upwash."""
    n, shape, gain = len(chord), case["bound"].shape[1:], np.pi * chord

    def upwash(G: Float) -> Float:
        return settle(case, np.concatenate([G[None], np.zeros((shape[0] - 1, n))]), step)[2, 0]

    matrix = np.stack([upwash(one) for one in np.eye(n)], axis=1)
    G = np.zeros(n)
    for _ in range(6):  # old vortices merge, which is not linear
        G += np.linalg.solve(np.eye(n) - gain[:, None] * matrix, gain * (wind * alpha + upwash(G)) - G)
    return G, upwash(G)


def rows_of(case: Case, zone: int) -> dict[str, Float]:
    """Arrays of a zone, of the rows that it has."""
    view, rows = case.view(f"wake_{zone}"), int(float(case.view("vortex_state")[f"rows_{zone}"]))
    return {name: view[name][..., :rows, :] for name in ("position", "velocity", "circulation", "width2")}


def stored(case: Case, factor: float = 0.1, age: float = 0.0) -> Float:
    """(9, S) filaments of the first blade and of all zones."""
    m = case.system
    count = store_wake(m.wake_sources, m, factor, age, float(m.vortex_state.step))
    count = store_blade(m.wake_sources, count, m, STILL, 0, factor, age)
    return np.array(case["wake_sources"][:, :count])
