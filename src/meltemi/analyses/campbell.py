"""Campbell diagrams: frequencies and damping of the modes over wind speed or rotor speed.

Modes are tracked from one operating point to the next by the similarity of their shapes (modal assurance criterion),
and named after the coordinates that hold their kinetic and potential energy.

Reference: docs/theory/simulation.md (M-27 to M-30, M-47); Allemang (2003), Sound and Vibration 37(8).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.linear import AZIMUTHS, PARTS, linearise
from meltemi.analyses.modes import Mode, mode_name, natural_modes
from meltemi.core.errors import InputError, MeltemiError, UnsupportedError
from meltemi.core.representation import Card, Fold, sparkline
from meltemi.core.shown import Brief
from meltemi.maths.multiblade import blade_matrix
from meltemi.simulation.bladed.rotor import BladedModel, with_blades, with_static_gears
from meltemi.simulation.model import Model
from meltemi.simulation.trim import operating_point

Float = NDArray[np.float64]

STEADY_SHARE = 0.3
"""Fraction of the computing time of an operating point that steady operation takes, for the progress bar."""
LEAST = 0.02
"""Smallest fraction of the energy that is listed."""
WHIRL = ("collective", "backward whirl", "forward whirl")


@dataclass(frozen=True, repr=False)
class Campbell(Brief):
    """Modes over operating points.

    Attributes:
      wind_speed: (n,) [m/s]; NaN without wind.
      rotor_speed: (n,) [rad/s] speed of the rotor.
      pitch: (n,) [rad] pitch angle.
      labels: names of the modes, e.g. ``"1st flap backward whirl"``.
      frequency: (modes, n) [rad/s], undamped; NaN where a mode does not oscillate.
      damping: (modes, n) ratio to critical.
      modes: the mode of each label at each operating point, or None.
      air: True with aerodynamics; False in vacuum.
      failures: reasons for missing operating points, by wind speed or rotor speed.
    """

    wind_speed: Float
    rotor_speed: Float
    pitch: Float
    labels: tuple[str, ...]
    frequency: Float = field(repr=False)
    damping: Float = field(repr=False)
    modes: tuple[tuple[Mode | None, ...], ...] = field(repr=False)
    air: bool
    failures: dict[float, str] = field(default_factory=dict)

    def participation(self, label: str, i: int, n: int = 3) -> str:
        """The coordinates with most of the energy of a mode at operating point ``i``, as text: ``base roll 0.98``."""
        mode = self.modes[self.labels.index(label)][i]
        shares = participation(mode, bool(np.any(self.rotor_speed > 0.0))) if mode else {}
        largest = sorted(shares, key=lambda name: -shares[name])[:n]
        return "; ".join(f"{name} {shares[name]:.2f}" for name in largest if shares[name] >= LEAST)

    def __repr__(self) -> str:
        return f"<Campbell: {len(self.labels)} modes at {len(self.rotor_speed)} operating points>"

    def card(self) -> Card:
        """Frequency and damping of the modes at the first and last point, and lines over all points."""

        speeds = self.rotor_speed * 30.0 / np.pi
        facts = [("rotor speed", f"{speeds.min():.4g} to {speeds.max():.4g} rpm, {len(speeds)} operating points")]
        hertz, percent = self.frequency / (2.0 * np.pi), 100.0 * self.damping
        rows = [
            [label, f"{f[0]:.4g}", f"{f[-1]:.4g}", sparkline(f), f"{d[0]:.3g}", f"{d[-1]:.3g}", sparkline(d)]
            for label, f, d in zip(self.labels, hertz, percent, strict=True)
        ]
        head = ["mode", "Hz, first", "last", "", "damping %, first", "last", ""]
        return Card("Campbell", "with air" if self.air else "in vacuum", facts, [Fold("Modes", rows, head, open=True)])


def campbell(
    model: Model[Any],
    *,
    wind_speeds: Sequence[float] | None = None,
    rotor_speeds: Sequence[float] | None = None,
    air: bool = True,
    generator_free: bool | None = None,
    azimuths: int = AZIMUTHS // 2,
    progress: Callable[[float], None] | None = None,
) -> Campbell:
    """Natural frequencies and damping ratios over wind speed or rotor speed.

    With aerodynamics, the turbine is linearised in the fixed frame about its steady operation, with torque and pitch
    held constant; purely aerodynamic modes are excluded. In vacuum it has the rotor speed and pitch of that operation,
    and no gravity; a floating turbine keeps it, since it floats by it.

    Args:
      wind_speeds: [m/s] speeds of steady wind; rotor speed and pitch follow from steady operation.
      rotor_speeds: [rad/s] rotor speeds in place of wind speeds, in vacuum and at fine pitch; 0 is standstill.
      air: whether to include aerodynamics; otherwise the modes are those of the structure in vacuum.
      generator_free: whether the generator may rotate about its mean speed or has a prescribed speed; free by default
        with aerodynamics.
      azimuths: see ``linearise``.
      progress: callback with the completed fraction.

    Returns:
      The diagram. Operating points that fail are NaN in it; ``failures`` has the reasons.

    Raises:
      InputError: all operating points fail, the turbine is a power-coefficient turbine, wind speeds and rotor speeds
        are both given or both missing, or rotor speeds are given with aerodynamics.
      UnsupportedError: the rotor does not have three blades.
    """
    model = with_blades(model, "campbell")
    given = _points(model, wind_speeds, rotor_speeds, air)
    free = air if generator_free is None else generator_free
    model = with_static_gears(model)  # modes of a gearbox have far higher frequencies
    vacuum = model
    if getattr(model.turbine, "platform", None) is None:
        weightless = model.with_parameters(**{"structure.gravity": 0.0})
        vacuum = replace(weightless, environment=model.environment.replace(gravity=0.0))
    # the generator is locked only after the search for steady operation, in which it is free
    locked = model.locked.copy()
    if not free:
        locked[model.coordinates.index("generator")] = 1.0

    def done(i: int, share: float) -> None:
        if progress is not None:
            progress((i + share) / len(given))

    point_modes, operation, failures = list[list[Mode]](), [], {}
    for i, value in enumerate(given):
        where_now, modes = (value, np.nan, np.nan) if rotor_speeds is None else (np.nan, value, 0.0), []
        try:
            if rotor_speeds is None:
                point = operating_point(model, value)
                where_now = (value, point.rotor_speed, point.pitch)
                done(i, STEADY_SHARE)
            if air:
                turned = partial(_shifted, partial(done, i))
                locked_model = replace(model, locked=locked)
                modes = linearise(locked_model, point, (), (), azimuths=azimuths, progress=turned).modes()
            else:
                _, speed, pitch = where_now
                modes = natural_modes(vacuum, speed, pitch=pitch, generator_free=free)
                modes = [multiblade_components(mode) if speed == 0.0 else mode for mode in modes]
        except MeltemiError as error:
            failures[value] = str(error)
        operation.append(where_now)
        point_modes.append(modes)
        done(i, 1.0)
    if len(failures) == len(set(given)):
        raise InputError(f"campbell: all operating points failed; the last one: {failures[given[-1]]}")
    where = np.array(operation)
    # begin where modes are distinguished best: at high rotor speed in vacuum, in slow wind with little damping
    order = [i for i in np.argsort(where[:, 0] if air else -where[:, 1], kind="stable") if point_modes[i]]
    curves = follow(point_modes, [int(i) for i in order], bool(np.any(where[:, 1] > 0.0)))
    frequency, damping = curve_values(curves, len(given))
    wind_speed, rotor_speed, pitch = where.T
    tracked = tuple(tuple(curve) for curve in curves.values())
    return Campbell(wind_speed, rotor_speed, pitch, tuple(curves), frequency, damping, tracked, air, failures)


def _points(
    model: BladedModel, wind_speeds: Sequence[float] | None, rotor_speeds: Sequence[float] | None, air: bool
) -> list[float]:
    """The wind speeds or rotor speeds that are given; errors as for :func:`campbell`."""
    if (wind_speeds is None) == (rotor_speeds is None):
        raise InputError("campbell: give one of wind_speeds and rotor_speeds")
    if rotor_speeds is not None and air:
        raise InputError("campbell: with air the rotor speed follows from the wind: give wind_speeds, or air=False")
    if model.n_blades != 3:
        raise UnsupportedError("campbell: the fixed frame needs three blades")
    given = [float(value) for speeds in (wind_speeds, rotor_speeds) if speeds is not None for value in speeds]
    if not given:
        raise InputError("campbell: no wind speeds or rotor speeds")
    return given


def curve_values(curves: dict[str, list[Mode | None]], n: int) -> tuple[Float, Float]:
    """(modes, n) frequencies [rad/s] and damping ratios of curves; NaN where a mode is missing."""
    nan = (np.nan, np.nan)
    values = [[(m.frequency, m.damping) if m else nan for m in curve] for curve in curves.values()]
    frequency, damping = np.moveaxis(np.array(values).reshape(len(curves), n, 2), -1, 0)
    return frequency, damping


def _shifted(done: Callable[[float], None], share: float) -> None:
    """Report the progress of a linearisation, which follows the search for steady operation."""
    done(STEADY_SHARE + (1.0 - STEADY_SHARE) * share)


def multiblade_components(mode: Mode) -> Mode:
    """A mode at standstill, blade 1 up, with collective, cosine and sine components in place of the blades."""
    shape, energy, names = mode.shape.copy(), mode.energy.copy(), list(mode.coordinates)
    for name in dict.fromkeys(n[8:] for n in names if re.match("blade [123] ", n)):
        at = [names.index(f"blade {b} {name}") for b in (1, 2, 3)]
        shape[at] = np.linalg.solve(blade_matrix(0.0)[0], shape[at])
        # sum over the blades of |c0 + c cos psi + s sin psi|^2 = 3 |c0|^2 + 3/2 |c|^2 + 3/2 |s|^2
        square = np.array([3.0, 1.5, 1.5]) * np.abs(shape[at]) ** 2
        energy[at] = np.sum(energy[at]) * square / max(np.sum(square), 1e-300)
        for i, part in zip(at, PARTS, strict=True):
            names[i] = f"{name} {part}"
    return replace(mode, coordinates=tuple(names), shape=shape / shape[np.argmax(np.abs(shape))], energy=energy)


def _weighted(mode: Mode) -> dict[str, complex]:
    """Amplitudes of the coordinates, but for the free generator, whose squares are fractions of the energy (M-47)."""
    x = np.sqrt(mode.energy) * np.exp(1j * np.angle(mode.shape))
    x[[name == "generator" for name in mode.coordinates]] = 0.0
    return dict(zip(mode.coordinates, x / max(np.linalg.norm(x), 1e-300), strict=True))


def _root(mode: Mode) -> complex:
    """Eigenvalue [1/s]."""
    return mode.frequency * complex(-mode.damping, np.sqrt(max(1.0 - mode.damping**2, 0.0)))


def similarity(a: Mode, b: Mode) -> float:
    """Similarity of two modes, 1 for the same mode, 0 for unrelated ones, from shapes (MAC) and eigenvalues.

    Shapes alone do not suffice: with air a heavily damped flap mode and a mode of the wake may move the blades alike.
    """
    x, y = _weighted(a), _weighted(b)
    mac = abs(sum(value.conjugate() * y.get(name, 0.0) for name, value in x.items())) ** 2
    apart = abs(_root(a) - _root(b)) / (abs(_root(a)) + abs(_root(b)))
    return float(mac * (1.0 - apart))


def participation(mode: Mode, turning: bool = True) -> dict[str, float]:
    """Fractions of the kinetic and potential energy by coordinate and whirl direction.

    With cosine and sine amplitudes c and s, a blade's motion is Re[(c cos psi + s sin psi) exp(i w t)]: the component
    (c + i s) / 2 travels with the rotor (forward whirl), the component (c - i s) / 2 against it (backward whirl).
    """
    shape = _weighted(mode)
    shares: dict[str, float] = {}
    for name, x in shape.items():
        kind, _, part = name.rpartition(" ")
        if turning and part in ("cosine", "sine"):
            c, s = shape[f"{kind} cosine"], shape[f"{kind} sine"]
            whirl = c - 1j * s if part == "cosine" else c + 1j * s
            shares[f"{kind} {WHIRL[PARTS.index(part)]}"] = float(abs(whirl) ** 2 / 2.0)
        else:
            shares[mode_name(name)] = float(abs(x) ** 2)
    return shares


def follow(
    point_modes: Sequence[Sequence[Mode]], order: Sequence[int], turning: bool = True
) -> dict[str, list[Mode | None]]:
    """Curves of modes by name, in the order of their mean frequencies.

    At each operating point every mode has at most one name and every name at most one mode.

    A name goes to a mode by its share of the mode's energy, up to doubled by the similarity to the mode of that name at
    the previous point (M-30). There are as many names as coordinates; the remaining modes are not structural.

    Args:
      point_modes: modes at each operating point.
      order: sequence in which the points are evaluated.
    """
    from scipy.optimize import linear_sum_assignment

    names = list(dict.fromkeys(n for modes in point_modes for m in modes for n in participation(m, turning)))
    curves: dict[str, list[Mode | None]] = {name: [None] * len(point_modes) for name in names}
    last: dict[str, Mode] = {}
    for i in order:
        score = np.zeros((len(point_modes[i]), len(names)))
        for k, mode in enumerate(point_modes[i]):
            for name, share in participation(mode, turning).items():
                # The first point has no predecessor; there, lower damping distinguishes the structure from the wake.
                alike = similarity(last[name], mode) if name in last else 1.0 - mode.damping
                score[k, names.index(name)] = share * (1.0 + alike)
        for k, j in zip(*linear_sum_assignment(-score), strict=True):
            if score[k, j] > 0.0:
                curves[names[j]][i] = last[names[j]] = point_modes[i][k]
    curves = {name: curve for name, curve in curves.items() if any(curve)}
    order_of = {name: float(np.mean([m.frequency for m in curve if m])) for name, curve in curves.items()}
    return {name: curves[name] for name in sorted(curves, key=lambda name: order_of[name])}
