"""Aeroelastic stability in overspeed: damping of the modes over rotor speed, and the flutter limit.

The rotor is driven at a given speed, at constant pitch, in a wind that is by default almost still air. The turbine is
linearised in the fixed frame about the periodic motion at each speed, which is computed by continuation.

Reference: docs/theory/simulation.md (M-38, M-39); Lobitz (2004), Wind Energy 7(3), 211-224; Hansen (2007), Wind Energy
10(6), 551-577.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.campbell import WHIRL, curve_values, follow, participation
from meltemi.analyses.continuation import CarefulOrbit
from meltemi.analyses.linear import LinearModel, linearise
from meltemi.analyses.modes import SLOW, Mode
from meltemi.core.errors import InputError, UnsupportedError
from meltemi.core.shown import Brief
from meltemi.core.threads import one_blas_thread
from meltemi.simulation.bladed.rotor import BladedModel, with_blades, with_static_gears
from meltemi.simulation.model import Model
from meltemi.simulation.operating_point import NotConverged, check_prescribed, steady_wind
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.orbit import FULL
from meltemi.simulation.rotors import build
from meltemi.turbine.definition import Turbine
from meltemi.turbine.power_turbine import aeroelastic
from meltemi.wind.fields import SteadyWind
from meltemi.wind.turbulent import AnyWind

Float = NDArray[np.float64]

MODES = {"flap_modes": 4, "edge_modes": 2, "torsion_modes": 2}
"""Modes of a blade for analyses of stability: two flapwise modes overestimate the flutter speed by a seventh."""
STILL = 1.0
"""[m/s] wind of the classical analysis: momentum theory does not hold in air at rest."""
RANGE, POINTS = (0.6, 2.0), 29
"""Default rotor speeds over rated speed, and their number."""
AZIMUTHS = 4
BLADES = re.compile(r"^\d+\w+ (flap|edge|torsion) ")
LASTING = 1.02
"""An instability has to last up to this multiple of the speed."""
KINK = (
    "unstable at this speed, but not 2 % above: the motion meets a kink in the polars or the momentum balance, where a "
    "linear model is not valid, however small the motion"
)
HALVINGS = 6
"""Bisections of the interval between the last stable and the first unstable speed."""


@dataclass(frozen=True)
class StabilityLimit:
    """Onset of an instability.

    Attributes:
      rotor_speed: [rad/s] speed at which the damping of the first mode vanishes.
      frequency: [rad/s] frequency of this mode in the fixed frame; 0 for divergence, which does not oscillate.
      blade_frequency: [rad/s] its frequency in the rotating blades, for the direction of whirl with most of the energy
        of flapwise bending and torsion.
      label: the coordinate with most of its energy.
      mode: the mode, a little above the limit.
    """

    rotor_speed: float
    frequency: float
    blade_frequency: float
    label: str
    mode: Mode


@dataclass(frozen=True, repr=False)
class Flutter(Brief):
    """Modes over rotor speed in air.

    Attributes:
      wind_speed, pitch: [m/s], [rad] common values of all rotor speeds.
      rotor_speed: (n,) [rad/s] rotor speeds.
      labels: names of the modes.
      frequency: (modes, n) [rad/s], undamped; NaN where a mode does not oscillate or there is no steady motion.
      damping: (modes, n) ratio to critical.
      least: (n,) smallest damping of the blade modes, those with most of their energy in the blades.
      limit: lowest speed at which a blade mode is unstable, or None; the first speed if it is already unstable.
      failures: reasons for missing speeds, by rotor speed: no steady motion, or an instability only at this speed.
    """

    wind_speed: float
    pitch: float
    rotor_speed: Float
    labels: tuple[str, ...]
    frequency: Float = field(repr=False)
    damping: Float = field(repr=False)
    least: Float = field(repr=False)
    limit: StabilityLimit | None
    failures: dict[float, str] = field(default_factory=dict)


def stability_options(options: ModelOptions | None = None) -> ModelOptions:
    """Options with the numbers of modes for stability analyses where they are not given."""
    options = options or ModelOptions()
    return options.replace(**{name: n for name, n in MODES.items() if getattr(options, name) is None})


def stability_model(turbine: Turbine, options: ModelOptions | None) -> BladedModel:
    """Model of a turbine with three blades for stability analyses; a blade rigid in torsion has no torsion mode."""
    options = stability_options(options)
    if not turbine.blade.structure.twists:
        options = options.replace(torsion_modes=0)
    return with_static_gears(with_blades(build(turbine, options), "stability"))


@one_blas_thread
def flutter(
    turbine: Turbine | Model[Any],
    rotor_speeds: Sequence[float] | None = None,
    *,
    wind: float | AnyWind = STILL,
    pitch: float | None = None,
    generator_free: bool = False,
    options: ModelOptions | None = None,
    progress: Callable[[float], None] | None = None,
) -> Flutter:
    """Damping of the modes over rotor speed, and the speed from which the turbine is unstable.

    The classical definition is the default: a rotor in almost still air, driven at constant speed and at its smallest
    pitch. A higher wind speed represents overspeed in operation: the limit then includes edgewise and stall-induced
    instabilities, and depends on the mean loads.

    Args:
      turbine: a turbine, or a model, whose modes and options are then used as they are.
      rotor_speeds: [rad/s] increasing; by default 29 from 0.6 to 2 times rated speed.
      wind: wind speed [m/s] at hub height, or a steady wind.
      pitch: [rad] collective pitch; by default the smallest in operation.
      generator_free: whether the generator may rotate about its mean speed; by default its speed is prescribed.
      options: model options; numbers of modes that are not given are 4 flapwise, 2 edgewise and 2 torsional.
      progress: callback with the completed fraction.

    Returns:
      The diagram. Values are NaN at speeds beyond the first without steady motion, and at isolated unstable speeds,
      where the turbine is stable 2 % above; ``failures`` has the reason.

    Raises:
      InputError: speeds are not positive and increasing, the first has no steady motion, or the turbine has no
        blades.
      UnsupportedError: the rotor does not have three blades.
    """
    described = aeroelastic(turbine.turbine if isinstance(turbine, Model) else turbine, "flutter")
    if described.n_blades != 3:
        raise UnsupportedError("flutter: the fixed frame needs three blades")
    rated = described.rated_rotor_speed
    speeds = np.linspace(*RANGE, POINTS) * rated if rotor_speeds is None else np.array(rotor_speeds, dtype=float)
    if not len(speeds) or not np.all(np.diff(speeds, prepend=0.0) > 0.0):
        raise InputError("flutter: rotor_speeds must be positive and increase")
    angle = described.control.pitch.minimum if pitch is None else pitch
    check_prescribed("flutter", described, float(speeds[-1]), angle)
    steady = steady_wind(wind, described.hub_height)
    given_model = with_static_gears(with_blades(turbine, "flutter")) if isinstance(turbine, Model) else None
    model = given_model or stability_model(described, options)
    modes_at = _modes_of(model, steady, angle, generator_free)

    def reached(speed: float) -> list[Mode]:
        """The modes at a speed; empty without steady motion."""
        try:
            return modes_at(speed)
        except NotConverged:
            return []

    def unstable(modes: list[Mode]) -> bool:
        return blade_mode(modes).damping < 0.0

    modes_by_speed: list[list[Mode]] = [[] for _ in speeds]
    limit, failures = None, {}
    for i, speed in enumerate(speeds):
        try:
            modes_by_speed[i] = modes_at(float(speed))
        except NotConverged as error:
            if i == 0:
                raise
            failures[float(speed)] = str(error)
            break
        if progress is not None:
            progress((i + 1) / len(speeds))
        if limit is None and unstable(modes_by_speed[i]):
            if unstable(reached(LASTING * float(speed)) or modes_by_speed[i]):
                limit = _onset(reached, float(speeds[max(i - 1, 0)]), float(speed), modes_by_speed[i])
            else:
                modes_by_speed[i], failures[float(speed)] = [], KINK
    oscillating = [[mode for mode in modes if mode.frequency > 0.0] for modes in modes_by_speed]
    curves = follow(oscillating, [i for i, modes in enumerate(oscillating) if modes])
    least = np.array([blade_mode(modes).damping if modes else np.nan for modes in modes_by_speed])
    values = curve_values(curves, len(speeds))
    return Flutter(steady.speed, angle, speeds, tuple(curves), *values, least, limit, failures)


def _modes_of(
    model: BladedModel, wind: SteadyWind, pitch: float, generator_free: bool
) -> Callable[[float], list[Mode]]:
    """Function of the rotor speed [rad/s] that returns the modes, starting from the motion at the previous speed."""
    locked = model.locked.copy()
    if not generator_free:
        locked[model.coordinates.index("generator")] = 1.0
    fixed, orbit = replace(model, locked=locked), CarefulOrbit(model, wind)
    orbit.level = FULL

    def modes_at(speed: float) -> list[Mode]:
        orbit.sweep(speed, pitch, 0.0)
        linear = linearise(fixed, orbit.finish(), (), (), azimuths=AZIMUTHS)
        return linear.modes() + diverging(linear)

    return modes_at


def blade_mode(modes: Sequence[Mode]) -> Mode:
    """The least damped of the modes with more than half of their energy in the blades."""

    def of_blades(mode: Mode) -> bool:
        shares = participation(mode)
        return sum(value for name, value in shares.items() if BLADES.search(name)) > 0.5

    return min(filter(of_blades, modes), key=lambda mode: mode.damping)


def _onset(modes_at: Callable[[float], list[Mode]], low: float, high: float, modes: list[Mode]) -> StabilityLimit:
    """The limit between a stable and an unstable speed, by bisection."""
    for _ in range(HALVINGS if high > low else 0):
        middle = 0.5 * (low + high)
        tried = modes_at(middle)
        if not tried:
            break
        if blade_mode(tried).damping < 0.0:
            high, modes = middle, tried
        else:
            low = middle
    mode, speed = blade_mode(modes), 0.5 * (low + high)
    share = participation(mode)
    fluttering = {name: value for name, value in share.items() if "edge" not in name}
    turns = {way: sum(value for name, value in fluttering.items() if name.endswith(way)) for way in WHIRL}
    turned = dict(zip(WHIRL, (0.0, speed, -speed), strict=True))[max(turns, key=lambda way: turns[way])]
    blade_frequency = abs(mode.frequency + turned) if mode.frequency else 0.0
    return StabilityLimit(speed, mode.frequency, blade_frequency, max(share, key=lambda name: share[name]), mode)


def diverging(linear: LinearModel) -> list[Mode]:
    """Motion that grows without oscillation, if any, as a mode of frequency 0 and damping ratio -1."""
    from scipy.linalg import eig

    value, left, right = eig(linear.A, left=True)
    real = np.where(np.abs(value.imag) < 1e-6, value.real, -np.inf)
    i = int(np.argmax(real))
    if real[i] <= SLOW:
        return []
    place = np.flatnonzero([name.startswith("q ") for name in linear.states])
    names = tuple(linear.states[j][2:] for j in place)
    factor = np.abs(left[:, i].conj() * right[:, i])
    energy = factor[place] + factor[[linear.states.index(f"v {name}") for name in names]]
    shape = right[place, i] / right[place, i][np.argmax(np.abs(right[place, i]))]
    return [Mode(0.0, -1.0, names, shape, energy)]
