"""Response amplitude operators of a floating turbine: from its linear model, and from a run in a white-noise sea.

Reference: docs/theory/floating.md (W-21, W-22).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.linear import LinearModel, linearise
from meltemi.control.constant import ConstantController
from meltemi.core.errors import InputError, UnsupportedError
from meltemi.floating.floater import MOTIONS, FloaterPart
from meltemi.floating.waves import excitation
from meltemi.sea.airy import WaveComponents
from meltemi.sea.irregular import IrregularSea
from meltemi.simulation.model import Model
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.rotors import operating_point
from meltemi.simulation.simulate import simulate

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

CHANNELS = (*MOTIONS, "tower_base_moment_fore_aft")
STILL = 0.1
"""[m/s] wind of a turbine out of operation, its rotor at nearly no speed and its blades feathered."""
STEPS = 300
"""Frequencies of the linear model, equal steps of their logarithm."""
FLANK, WIDEST = 10, 0.1
"""Points to either side of a resonance, and how far they reach, as a share of its frequency."""
LEAST_DAMPING, MOST_DAMPING = 1e-3, 0.3
"""Damping ratios that the bandwidth counts at least, and above which a mode has no resonance to be refined."""
PERIODS = (5.0, 25.0)
"""[s] periods of waves in which motions have their usual size."""
SILENT = 1e-3
"""Usual size of a motion over the largest one of its unit, below which it is left out of figures and tables."""
BINS = 12
"""Neighbouring frequencies of the run over which spectra are averaged."""


@dataclass(frozen=True)
class Operators:
    """Motions and loads per wave amplitude over frequency.

    Attributes:
      frequency: (F,) [rad/s] angular frequencies.
      channels, units: (K,) names and units of the channels.
      value: (F, K) complex; phase relative to the wave at the turbine at rest, advance positive.
      resonances: (R, 2) natural frequencies [rad/s] and damping ratios of the linear model, lowest first.
    """

    frequency: Float
    channels: tuple[str, ...]
    units: tuple[str, ...]
    value: Complex
    resonances: Float = field(default_factory=lambda: np.zeros((0, 2)))

    @property
    def shown(self) -> list[tuple[str, float]]:
        """Unit in which each channel is shown, and the factor to it."""
        return [("deg", np.degrees(1.0)) if unit == "rad" else (unit, 1.0) for unit in self.units]

    @property
    def readable(self) -> list[tuple[str, float]]:
        """Units and factors for figures and tables: forces and moments in kilo- or meganewtons."""
        readable = []
        for (unit, factor), size in zip(self.shown, self.usual(), strict=True):
            prefix, power = ("M", 1e-6) if size >= 1e6 else ("k", 1e-3)
            readable.append((prefix + unit, power) if unit.startswith("N") else (unit, factor))
        return readable

    def usual(self) -> Float:
        """(K,) median amplitude in waves of ``PERIODS``, in which resonances hardly count."""
        w = 2.0 * np.pi / np.linspace(*PERIODS, 101)
        return np.array([np.median(np.interp(w, self.frequency, size)) for size in np.abs(self.value).T])

    def silent(self) -> list[str]:
        """Motions that symmetry makes negligible, such as sway in waves along x: below ``SILENT``."""
        size = dict(zip(self.channels, self.usual(), strict=True))
        silent = []
        for three in (MOTIONS[:3], MOTIONS[3:]):
            present = [name for name in three if name in size]
            most = max((size[name] for name in present), default=0.0)
            silent += [name for name in present if size[name] < SILENT * most]
        return silent


def steady_point(model: Model[Any], wind_speed: float) -> OperatingPoint:
    """Steady operation in a wind [m/s]; in none at rest with feathered blades."""
    if wind_speed > 0.0:
        return operating_point(model, wind_speed)
    return operating_point(model, STILL, rotor_speed=1e-3, pitch=0.5 * np.pi)


def linear_operators(
    model: Model[Any],
    wind_speed: float = 0.0,
    direction: float = 0.0,
    channels: Sequence[str] = CHANNELS,
    *,
    frequency: Float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Operators:
    """Operators of the linear model about steady operation, with pitch and torque held (W-21).

    Args:
      wind_speed: [m/s]; 0 for a rotor at rest.
      direction: [rad] direction of the waves' travel, clockwise as that of the wind.
      frequency: (F,) [rad/s]; by default :func:`resonant_frequencies` up to the highest of the coefficients.
      progress: callback with the completed fraction.

    Raises:
      InputError: the turbine does not float, or the direction is not in its coefficients.
      UnsupportedError: the platform has no radiation.
    """
    part = floater_of(model)
    linear = linearise(model, steady_point(model, wind_speed), (), channels, progress=progress)
    if not wind_speed:
        linear = _without_air(linear)
    highest = float(part.coefficients.frequency[-1])
    frequencies = resonances(linear, highest)
    w = resonant_frequencies(frequencies, highest) if frequency is None else frequency
    waves = WaveComponents(w, np.ones(len(w), dtype=np.complex128), np.full(len(w), -direction), None)
    scale = part.platform.water_density * model.environment.gravity
    X = scale * excitation(part.coefficients, waves)
    value = np.einsum("foi,fi->fo", wave_driven(linear, part).response(1j * w), X)
    return Operators(w, tuple(linear.outputs), tuple(linear.output_units), value, frequencies)


def resonances(linear: LinearModel, highest: float) -> Float:
    """(R, 2) natural frequencies [rad/s] up to ``highest``, and damping ratios, of modes that resonate."""
    modes = [(m.frequency, m.damping) for m in linear.modes() if m.frequency < highest and m.damping < MOST_DAMPING]
    return np.array(modes).reshape(-1, 2)


def resonant_frequencies(resonances: Float, highest: float) -> Float:
    """(F,) [rad/s] frequencies from half the lowest natural frequency to ``highest``, finer about resonances.

    A resonance of natural frequency w and damping ratio d has half its power at about w (1 - d) and w (1 + d): points
    to either side of w begin at a quarter of this distance, and widen.
    """
    lowest = min(0.1, 0.5 * float(resonances[:, 0].min(initial=np.inf)))
    frequencies = [np.geomspace(lowest, highest, STEPS)]
    for w, damping in resonances:
        away = np.geomspace(0.25 * max(abs(damping), LEAST_DAMPING), WIDEST, FLANK)
        frequencies += [w * (1.0 - away), np.array([w]), w * (1.0 + away)]
    w = np.unique(np.concatenate(frequencies))
    return w[(w >= lowest) & (w <= highest)]


def wave_driven(linear: LinearModel, part: FloaterPart) -> LinearModel:
    """The model with forces and moments of the water on the platform's point as inputs (W-21).

    The states of the radiation exert such forces, so that their columns in A and C have the answer.

    Raises:
      UnsupportedError: the platform has no radiation.
    """
    place = [i for i, name in enumerate(linear.states) if name.startswith("radiation")]
    if not place:
        raise UnsupportedError("rao: the platform has no potential flow; its linear model has no force of the water")
    out = part.constants["float_output"]
    G = np.concatenate([-out[:, :6], out[:, 6:]]).T  # (6, states) by unit states
    size = np.abs(G).max(axis=1, keepdims=True)
    some = size[:, 0] > 1e-9 * size.max()
    back = np.zeros((len(place), 6))
    back[:, some] = np.linalg.pinv(G[some] / size[some], rcond=1e-9) / size[some].T
    B = linear.A[:, place] @ back
    B[place] = 0.0
    names = tuple(f"water_{kind}_{axis}" for kind in ("force", "moment") for axis in "xyz")
    units = ("N",) * 3 + ("N m",) * 3
    D = linear.C[:, place] @ back
    return replace(linear, B=B, D=D, inputs=names, input_units=units, u0=np.zeros(6))


def random_operators(
    model: Model[Any],
    wind_speed: float = 0.0,
    direction: float = 0.0,
    channels: Sequence[str] = CHANNELS,
    *,
    height: float = 2.0,
    duration: float = 3600.0,
    seed: int = 1,
    progress: Callable[[float], None] | None = None,
) -> tuple[Operators, Float]:
    """Operators from a run in a white-noise sea, and their coherence (F, K) [-] (W-22).

    Args:
      wind_speed: [m/s]; 0 for a rotor at rest.
      direction: [rad] direction of the waves' travel, clockwise as that of the wind.
      height: [m] significant height of the sea.
      duration: [s] evaluated, after a tenth of it.
      progress: callback with the completed fraction.

    Raises:
      InputError: the turbine does not float, or the direction is not in its coefficients.
    """
    part = floater_of(model)
    limits = (0.1, min(float(part.coefficients.frequency[-1]), 2.0))
    sea = IrregularSea(height=height, spectrum="white", frequencies=limits, direction=direction, seed=seed)
    names = ("wave_elevation", *channels)
    result = simulate(
        model,
        wind_speed or STILL,
        duration=1.1 * duration,
        controller=ConstantController(),
        channels=names,
        output_step=0.25,
        start=steady_point(model, wind_speed),
        sea=sea,
        progress=progress,
    )
    first = int(0.1 * duration / 0.25)
    series = np.stack([np.asarray(result[name])[first:] for name in names])
    n = series.shape[1]
    F = np.fft.rfft(np.hanning(n) * (series - series.mean(axis=1, keepdims=True)))
    w = 2.0 * np.pi * np.fft.rfftfreq(n, 0.25)
    inside = np.flatnonzero((w > limits[0]) & (w < limits[1]))
    groups = inside[: len(inside) // BINS * BINS].reshape(-1, BINS)
    wave, rest = F[0, groups], F[1:, groups]
    cross = (rest * wave.conj()).mean(axis=-1)
    power, noise = (np.abs(wave) ** 2).mean(axis=-1), (np.abs(rest) ** 2).mean(axis=-1)
    units = tuple(result.channel(name).unit for name in channels)
    coherence = np.abs(cross) ** 2 / (power * noise)
    return Operators(w[groups].mean(axis=1), tuple(channels), units, (cross / power).T), coherence.T


def _without_air(linear: LinearModel) -> LinearModel:
    """The model without the states of inflow and stall, whose rates in still air are badly scaled."""
    keep = [i for i, name in enumerate(linear.states) if name.startswith(("q ", "v ", "radiation"))]
    states, units = (tuple(names[i] for i in keep) for names in (linear.states, linear.state_units))
    A, B, C = linear.A[np.ix_(keep, keep)], linear.B[keep], linear.C[:, keep]
    return replace(linear, A=A, B=B, C=C, states=states, state_units=units, x0=linear.x0[keep])


def floater_of(model: Model[Any]) -> FloaterPart:
    """The platform of a model.

    Raises:
      InputError: the turbine does not float.
    """
    for part in model.parts:
        if isinstance(part, FloaterPart):
            return part
    raise InputError(f"rao: {model.turbine.name} does not float; choose a floating turbine, such as iea15mw-volturnus")
