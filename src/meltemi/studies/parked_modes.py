"""Stability of a turbine at standstill over yaw misalignment and pitch.

At each point the turbine is in equilibrium with a locked rotor, and is linearised there with the states of dynamic
stall.

Reference: docs/theory/simulation.md (M-16b, M-38, M-47).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.linear import linearise
from meltemi.analyses.modes import Mode
from meltemi.analyses.parked import standing_point
from meltemi.core.errors import InputError, MeltemiError
from meltemi.core.shown import Brief
from meltemi.core.threads import one_blas_thread
from meltemi.simulation.bladed.rotor import BladedModel, with_blades
from meltemi.simulation.model import Model
from meltemi.simulation.options import ModelOptions
from meltemi.studies.flutter import stability_model
from meltemi.turbine.definition import Turbine
from meltemi.turbine.power_turbine import aeroelastic
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]

YAWS = tuple(np.radians(np.arange(-180.0, 181.0, 10.0)).tolist())
PITCHES = tuple(np.radians([0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0]).tolist())
AZIMUTHS = (0.0, np.pi / 3.0)
"""[rad] azimuths of blade 1: up, and with another blade down."""
STORM = SteadyWind(speed=50.0, shear_exponent=0.11)
"""Steady extreme wind of class I, IEC 61400-1."""


@dataclass(frozen=True, repr=False)
class ParkedStability(Brief):
    """Least damped mode of a turbine at standstill over yaw misalignment and pitch.

    Attributes:
      wind: steady wind; the map sets its direction.
      yaw: (n,) [rad] misalignment, the wind's direction relative to the shaft, clockwise from above.
      pitch: (m,) [rad] collective pitch.
      azimuths: [rad] rotor positions; each point of the map has the least damped of their modes.
      damping: (n, m) damping ratio; NaN without equilibrium.
      frequency: (n, m) [rad/s] natural frequency.
      coordinate: (n, m) names of the coordinate with most of the mode's strain energy, without the blade: ``1st edge``;
        of a floating turbine, whose platform has none, with most of the energy (M-47).
      failures: reasons for points without equilibrium, by yaw and pitch [rad].
    """

    wind: SteadyWind
    yaw: Float
    pitch: Float
    azimuths: tuple[float, ...]
    damping: Float = field(repr=False)
    frequency: Float = field(repr=False)
    coordinate: tuple[tuple[str, ...], ...] = field(repr=False)
    failures: dict[tuple[float, float], str] = field(default_factory=dict)


@one_blas_thread
def parked_stability(
    turbine: Turbine | Model[Any],
    yaws: Sequence[float] = YAWS,
    pitches: Sequence[float] = PITCHES,
    *,
    wind: SteadyWind = STORM,
    azimuths: Sequence[float] = AZIMUTHS,
    options: ModelOptions | None = None,
    progress: Callable[[float], None] | None = None,
) -> ParkedStability:
    """Damping of the least damped mode of a turbine at standstill with a locked rotor, over yaw and pitch.

    Args:
      turbine: a turbine, or a model, whose modes and options are then used as they are.
      yaws: [rad] misalignments, an axis of the map.
      pitches: [rad] collective pitch, the other axis.
      wind: steady wind; the map sets its direction.
      azimuths: [rad] rotor positions evaluated at each point.
      options: model options; numbers of modes that are not given are 4 flapwise, 2 edgewise and 2 torsional.
      progress: callback with the completed fraction.

    Raises:
      InputError: an axis is empty, all points fail, or the turbine has no blades.
    """
    model = (
        with_blades(turbine, "parked_stability")
        if isinstance(turbine, Model)
        else stability_model(aeroelastic(turbine, "parked_stability"), options)
    )
    if not (len(yaws) and len(pitches) and len(azimuths)):
        raise InputError("parked_stability: yaws, pitches and azimuths need at least one value each")
    locked = model.locked.copy()
    locked[model.coordinates.index("generator")] = 1.0
    fixed, weights = replace(model, locked=locked), _stiffness(model)
    shape = (len(yaws), len(pitches))
    damping, frequency = np.full(shape, np.nan), np.full(shape, np.nan)
    names = [[""] * shape[1] for _ in range(shape[0])]
    failures: dict[tuple[float, float], str] = {}
    for i, yaw in enumerate(yaws):
        turned = wind.replace(direction=float(yaw))
        for j, pitch in enumerate(pitches):
            try:
                modes = [
                    mode
                    for azimuth in azimuths
                    for mode in linearise(
                        fixed, standing_point(fixed, turned, pitch, azimuth), (), (), azimuth=azimuth
                    ).modes()
                ]
                least = min(modes, key=lambda mode: mode.damping)
                damping[i, j], frequency[i, j] = least.damping, least.frequency
                names[i][j] = _carrier(least, weights)
            except MeltemiError as error:
                failures[float(yaw), float(pitch)] = str(error)
        if progress is not None:
            progress((i + 1) / len(yaws))
    if np.all(np.isnan(damping)):
        raise InputError(f"parked_stability: no point has an equilibrium; the last one: {list(failures.values())[-1]}")
    axes = np.array(yaws, dtype=float), np.array(pitches, dtype=float)
    carriers = tuple(tuple(row) for row in names)
    return ParkedStability(wind, *axes, tuple(azimuths), damping, frequency, carriers, failures)


def _stiffness(model: BladedModel) -> dict[str, float]:
    """Stiffness of each coordinate of tower and blades; empty for a floating turbine."""
    if model.turbine.platform is not None:
        return {}
    stiffness = dict(zip(model.coordinates, np.diag(model.rotor.tower_matrix[1]).tolist(), strict=False))
    for name, k in zip(model.rotor.blade.names, np.diag(model.rotor.modal[0, 0]), strict=True):
        stiffness.update({f"blade {b + 1} {name}": float(k) for b in range(model.n_blades)})
    return stiffness


def _carrier(mode: Mode, stiffness: dict[str, float]) -> str:
    """The coordinate with most of the energy of a mode, summed over the blades.

    Participation factors (M-47) are that energy without damping. Aerodynamic forces couple the first two tower modes,
    which have nearly equal frequencies, so strongly that the factors indicate the wrong direction: the motion decides.
    """
    energy: dict[str, float] = {}
    for name, x, share in zip(mode.coordinates, mode.shape, mode.energy, strict=True):
        key = name.split(" ", 2)[2] if name.startswith("blade ") else name
        of = stiffness.get(name, 0.0) * float(abs(x)) ** 2 if stiffness else float(share)
        energy[key] = energy.get(key, 0.0) + of
    return max(energy, key=lambda key: energy[key])
