"""Terms of objective and constraints: statistics of runs with their derivatives by samples, and of the turbine itself.

Reference: docs/theory/designs.md (D-3 to D-7).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp, softmax

from meltemi.analyses.campbell import follow, multiblade_components
from meltemi.analyses.modes import natural_modes
from meltemi.core.errors import InputError, did_you_mean
from meltemi.designs.masses import masses
from meltemi.designs.settings import ConstraintSetting, TermSetting
from meltemi.gradients.weights import del_weights, std_weights
from meltemi.postprocess.fatigue import usual_slope
from meltemi.simulation.channels import Channel
from meltemi.simulation.model import Model
from meltemi.simulation.result import Result

Float = NDArray[np.float64]
OF_RUNS = {
    "del": "damage-equivalent load of a channel, 1 Hz",
    "max": "largest value of a channel (soft)",
    "min": "smallest value of a channel (soft)",
    "clearance": "smallest distance of a blade tip from the yaw axis (soft)",
    "mean": "mean of a channel",
    "std": "standard deviation of a channel",
    "travel": "mean of the absolute rate of a channel",
    "rate": "standard deviation of the rate of a channel",
}
"""Terms of time series."""
OF_TURBINES = {
    "mass": "mass of a part [kg]",
    "frequency": "natural frequency of the turbine at rest [Hz]",
    "value": "a number of the turbine's description",
    "damping": "damping ratio of a mode in operation under the baseline law [-]",
    "sensitivity": "largest amplification by a loop of the baseline law in operation [-] (soft)",
}
"""Terms of the turbine itself."""
OF_OPERATION = ("damping", "sensitivity")
"""Those of its linear model under the law."""
LOOPS = ("speed", "pitch")
"""Where a loop is opened: at the sensor of the generator speed, or at the pitch demand."""
STRAIN = "tower_base_strain"
"""Strain of the outer fibre at the tower's base by the fore-aft moment, in place of a channel."""
STRAIN_OF = "strain "
"""Begins what is in place of a channel for the strain of layers of the blade."""
TWO_PI = 2.0 * np.pi


@dataclass(frozen=True)
class Term:
    """A term of the objective or of a constraint.

    Attributes:
      name: as in the file.
      kind: a key of ``OF_RUNS`` or ``OF_TURBINES``.
      of: channel, part, mode or path.
      setting: weight, limits and options.
    """

    name: str
    kind: str
    of: str
    setting: TermSetting

    @property
    def strain(self) -> bool:
        """Whether it is of strains by moments (:mod:`meltemi.designs.strain`)."""
        return self.of_runs and (self.of == STRAIN or self.of.startswith(STRAIN_OF))

    @property
    def of_operation(self) -> bool:
        """Whether it is of the linear model in operation."""
        return self.kind in OF_OPERATION

    @property
    def of_runs(self) -> bool:
        """Whether it is a statistic of runs."""
        return self.kind in OF_RUNS

    @property
    def soft(self) -> bool:
        """Whether it is a soft extreme."""
        return self.kind in ("max", "min", "clearance")


def term_of(name: str, setting: float | TermSetting | ConstraintSetting) -> Term:
    """A term by its text, ``del TwrBsMyt``.

    Raises:
      InputError: its kind is unknown, or it lacks a channel.
    """
    kind, _, of = name.strip().partition(" ")
    of = of.strip()
    if kind == "energy":
        kind, of = "mean", of or "generator_power"
    if kind not in OF_RUNS | OF_TURBINES:
        raise InputError(
            f"terms: {name!r} begins with no kind of term: {did_you_mean(kind, [*OF_RUNS, *OF_TURBINES, 'energy'])}"
        )
    of = of or {"clearance": "tip_clearance_*", "travel": "pitch_1", "rate": "pitch_1"}.get(kind, "")
    if not of:
        raise InputError(f"terms: {name!r}: expected a name after {kind}, for instance: del TwrBsMyt")
    term = Term(name, kind, of, setting if isinstance(setting, TermSetting) else TermSetting(weight=setting))
    if term.of_operation:
        operation_of(term)
    return term


def operation_of(term: Term) -> tuple[str, float]:
    """Mode or loop of a term of operation, and the wind speed [m/s].

    Raises:
      InputError: there is no wind speed, or no such loop.
    """
    found = re.fullmatch(r"(.+?) at (\d+(?:\.\d+)?)(?: m/s)?", term.of)
    if found is None:
        example = "damping 1st tower fore-aft at 14" if term.kind == "damping" else "sensitivity speed at 14"
        raise InputError(f"terms: {term.name!r}: expected a name and a wind speed [m/s], for instance: {example}")
    if term.kind == "sensitivity" and found[1] not in LOOPS:
        raise InputError(f"terms: {term.name!r}: the loop is opened at the {' or the '.join(LOOPS)}, not {found[1]!r}")
    return found[1], float(found[2])


def soft_maximum(y: Float, sharpness: float, unit: float) -> tuple[float, Float]:
    """Soft maximum of values and its derivatives by them (D-5)."""
    z = sharpness / unit * y
    return float(logsumexp(z)) * unit / sharpness, softmax(z)


def statistic(
    term: Term, result: Result, transient: float, unit: float, factors: Mapping[str, float] | None = None
) -> tuple[float, dict[str, Float]]:
    """Statistic of a run, and its derivatives by the samples of its channels (D-3 to D-6).

    Args:
      transient: [s] initial part that is left out.
      unit: held magnitude of a soft extreme.
      factors: channels and factors on them, in place of the term's channels.
    """
    after = result.time >= transient - 1e-9
    channels = matching(term.of, result, factors)
    scales = [1.0 if factors is None else factors[c.name] for c in channels]
    step = float(result.time[1] - result.time[0])
    y = np.concatenate([scale * result[c.name][after] for c, scale in zip(channels, scales, strict=True)])
    duration = float(result.time[-1] - result.time[after][0])
    if term.kind == "del":
        value, by = del_weights(y, duration=duration, slope=slope_of(term, channels[0]))
    elif term.kind == "std":
        value, by = std_weights(y)
    elif term.kind == "mean":
        value, by = float(y.mean()), np.full(len(y), 1.0 / len(y))
    elif term.kind == "rate":
        value, inner = std_weights(np.diff(y) / step)
        by = -np.diff(inner, prepend=0.0, append=0.0) / step
    elif term.kind == "travel":
        change = np.diff(y)
        value, inner = float(np.abs(change).sum() / duration), np.sign(change) / duration
        by = -np.diff(inner, prepend=0.0, append=0.0)
    else:
        sign = 1.0 if term.kind == "max" else -1.0
        value, by = soft_maximum(sign * y, term.setting.sharpness, unit)
        value = sign * value
    weights = {}
    for channel, scale, part in zip(channels, scales, np.split(by, len(channels)), strict=True):
        weights[channel.name] = np.zeros(len(result.time))
        weights[channel.name][after] = scale * part
    return value, weights


def hard(term: Term, result: Result, transient: float, factors: Mapping[str, float] | None = None) -> float:
    """Extreme that a soft one approximates."""
    after = result.time >= transient - 1e-9
    scales = factors or {}
    values = [scales.get(c.name, 1.0) * result[c.name][after] for c in matching(term.of, result, factors)]
    return float(np.max(values)) if term.kind == "max" else float(np.min(values))


def matching(of: str, result: Result, names: Iterable[str] | None = None) -> list[Channel]:
    """Channels of a term, or of given names."""
    if names is not None:
        return [result.channel(name) for name in names]
    if of.endswith("*"):
        return [c for c in result.channels if c.name.startswith(of[:-1])]
    return [result.channel(of)]


def slope_of(term: Term, channel: Channel) -> float:
    """Slope of the S-N curve."""
    return term.setting.slope or usual_slope(channel) or 4.0


def combined(term: Term, slope: float, values: Float, weights: Float, unit: float) -> tuple[float, Float]:
    """Statistic of all runs from those of each, and its derivatives by them (D-4, D-7).

    Args:
      values: (C,) statistics of the runs.
      weights: (C,) shares of the runs, of sum 1.
      unit: held magnitude of a soft extreme.
    """
    if term.kind == "del":
        largest = float(values.max())
        if largest == 0.0:
            return 0.0, np.zeros(len(values))
        total = largest * float(weights @ (values / largest) ** slope) ** (1.0 / slope)
        return total, weights * (values / total) ** (slope - 1.0)
    if term.soft:
        sign = 1.0 if term.kind == "max" else -1.0
        value, by = soft_maximum(sign * values, term.setting.sharpness, unit)
        return sign * value, by
    return float(weights @ values), weights


def of_turbine(term: Term, model: Model[Any]) -> float:
    """A term of the turbine itself.

    Raises:
      InputError: there is no such part, mode or number.
    """
    turbine = model.turbine
    if term.kind == "mass":
        parts = masses(turbine)
        if term.of not in parts:
            raise InputError(f"terms: {term.name!r}: {did_you_mean(term.of, parts)}")
        return parts[term.of]
    if term.kind == "frequency":
        found = natural_modes(model)
        curves = follow([[multiblade_components(mode) for mode in found]], [0], turning=False)
        named = {name: modes[0] for name, modes in curves.items()}  # also where two modes share a coordinate
        named |= {mode.name: mode for mode in reversed(found)}
        modes = {name: mode.frequency / TWO_PI for name, mode in named.items() if mode}
        if term.of not in modes:
            raise InputError(f"terms: {term.name!r}: {did_you_mean(term.of, modes)}")
        return float(modes[term.of])
    from meltemi.designs.variables import places

    data = turbine.model_dump(mode="python")
    ((holder, key),) = places(data, term.of.removeprefix("turbine."), term.of)
    return float(holder[key])
