"""Scene of a Campbell diagram: mode shapes at each operating point."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.campbell import Campbell
from meltemi.analyses.linear import PARTS
from meltemi.analyses.modes import Mode
from meltemi.core.errors import MeltemiError
from meltemi.scene.motion import blade_arrays, deformed
from meltemi.scene.record import Scene
from meltemi.scene.shape import machine, sections
from meltemi.simulation.bladed.rotor import with_blades
from meltemi.simulation.case import Case
from meltemi.simulation.model import Model, Rows
from meltemi.simulation.trim import operating_point
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]

STEP = 1e-3
"""[m or rad] steps of the difference quotients for the shapes of the coordinates."""


def modes_scene(model: Model[Any], diagram: Campbell) -> Scene:
    """Scene of the modes of a diagram, each scaled to a largest amplitude of 1 m.

    Blades vibrate about their mean deflection in steady operation, or about the undeformed shape without air; blade
    coordinates are collective, cosine and sine components.
    """
    model = with_blades(model, "view")
    turbine, core, names = model.turbine, model.n_core, model.rotor.blade.names
    K, R = len(names), turbine.rotor_radius
    s = sections(turbine.blade.length)
    heights = np.array(machine(turbine)["tower_height"])
    tower = model.rotor.tower.modes.at(heights)
    order = [*model.coordinates[:core], *(f"{name} {part}" for name in names for part in PARTS)]
    points, steady, bases = [], [], []
    shapes = np.zeros((len(diagram.pitch), len(diagram.labels), len(order), 2))
    for i in range(len(diagram.pitch)):
        mean = mean_shape(model, float(diagram.wind_speed[i])) if diagram.air else np.zeros(K)
        rest, basis = blade_basis(model, mean, s)
        steady.append(rest)
        bases.append(basis)
        modes = []
        for j, label in enumerate(diagram.labels):
            mode = diagram.modes[j][i]
            if mode is None:
                modes.append({"label": label, "frequency": 0.0, "damping": 0.0})
                continue
            shape = ordered(mode, order)
            shape = shape / max(largest(shape, tower[:, -1, :3], basis[:, -1, :3], model.rows, R), 1e-12)
            shapes[i, j] = np.stack([shape.real, shape.imag], axis=1)
            modes.append({"label": label, "frequency": mode.frequency, "damping": mode.damping})
        speed, turns = diagram.wind_speed[i], diagram.rotor_speed[i] * 30.0 / np.pi
        where = f"{speed:g} m/s, {turns:.1f} rpm" if np.isfinite(speed) else f"{turns:.1f} rpm"
        numbers = {"rotor_speed": diagram.rotor_speed[i], "pitch": diagram.pitch[i]}
        points.append(
            {"name": where, "modes": modes} | {name: float(np.nan_to_num(value)) for name, value in numbers.items()}
        )
    places = [round(float(v), 3) for v in s]
    about = {"kind": "modes", "turbine": machine(turbine), "sections": places, "points": points, "steps": {}}
    arrays = {
        "tower_shape": tower.astype(np.float32),
        "steady": np.array(steady, dtype=np.float32),
        "basis": np.array(bases, dtype=np.float32),
        "shapes": shapes.astype(np.float32),
    }
    return Scene(about, arrays | blade_arrays(model, s))


def ordered(mode: Mode, names: list[str]) -> NDArray[np.complex128]:
    """Amplitudes of a mode in the order of ``names``; zero for coordinates that the mode lacks."""
    given = dict(zip(mode.coordinates, mode.shape, strict=True))
    return np.array([given.get(name, 0.0) for name in names], dtype=complex)


def largest(shape: NDArray[np.complex128], top: Float, tip: Float, rows: Rows, radius: float) -> float:
    """Largest displacement [m] of tower top and blade tips in a mode.

    Args:
      shape: amplitudes: tower, yaw, generator, drivetrain, blades.
      top: (M, 3) displacement of the tower top per coordinate of the tower.
      tip: (K, 3) displacement of the tip per coordinate of a blade.
      rows: indices of yaw, generator and torsion.
      radius: [m] rotor radius.
    """
    moved = [np.linalg.norm(shape[: rows.yaw] @ top)]
    turned = radius * abs(shape[rows.yaw]), radius * abs(shape[rows.generator] + shape[rows.torsion])
    collective, cosine, sine = shape[rows.torsion + 1 :].reshape(-1, 3).T
    for azimuth in 2.0 * np.pi / 12.0 * np.arange(12):
        q = collective + cosine * np.cos(azimuth) + sine * np.sin(azimuth)
        moved.append(np.linalg.norm(q @ tip))
    return float(max(*moved, *turned))


def mean_shape(model: Model[Any], speed: float) -> Float:
    """(K,) coordinates of a blade, averaged over a revolution of steady operation; zero without steady operation."""
    K, core = len(model.rotor.blade.names), model.n_core
    try:
        q = operating_point(model, speed).revolution[:, core : core + K]
    except MeltemiError:
        return np.zeros(K)
    return np.asarray(q.mean(axis=0))


def blade_basis(model: Model[Any], mean: Float, s: Float) -> tuple[Float, Float]:
    """Displacement and rotation (S, 6) of the blade sections at coordinates (K,), and derivatives (K, S, 6)."""
    K, core = len(mean), model.n_core
    q = np.zeros((2 * K + 1, len(model.coordinates)))
    q[:, core : core + K] = mean
    for k in range(K):
        q[2 * k + 1, core + k] += STEP
        q[2 * k + 2, core + k] -= STEP
    moved = deformed(Case(model, SteadyWind(speed=0.0)), q, None, s)[:, 0]
    return moved[0], (moved[1::2] - moved[2::2]) / (2.0 * STEP)
