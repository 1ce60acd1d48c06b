"""Natural modes of the assembled turbine in vacuum, and its least damped mode in wind.

The equations of motion are linearised by central differences about the deflected equilibrium; those of a rotating
rotor are transformed to multiblade coordinates and averaged over the azimuth.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.tables import AeroOptions
from meltemi.core.errors import UnsupportedError
from meltemi.core.threads import one_blas_thread
from meltemi.maths.multiblade import fixed_frame
from meltemi.simulation.bladed.rotor import with_blades
from meltemi.simulation.case import Case
from meltemi.simulation.model import Model
from meltemi.simulation.vibrations import derivative_matrix, equilibrium, finite, vacuum_case
from meltemi.turbine.imbalance import deviations

Float = NDArray[np.float64]

GROWING, SLOW = -2e-3, 5e-3
"""Damping ratio and growth rate [1/s] beyond which a mode counts as unstable."""
ITERATIONS = 20
"""Iterations of the momentum balance, enough for its derivatives to converge as well."""
AZIMUTHS = 6
"""Rotor positions over which the equations of a rotating rotor are averaged."""


@dataclass(frozen=True, repr=False)
class Mode:
    """A natural mode.

    Attributes:
      frequency: [rad/s], undamped.
      damping: ratio to critical.
      coordinates: names of the coordinates; those of the blades are collective, cosine and sine components
        when the rotor rotates.
      shape: complex amplitudes of the coordinates, the largest one 1.
      energy: sums of the magnitudes of the participation factors of the coordinates and their rates, products of left
        and right eigenvectors: without damping in proportion to potential and kinetic energy (M-47).
    """

    frequency: float
    damping: float
    coordinates: tuple[str, ...]
    shape: NDArray[np.complex128]
    energy: Float

    @property
    def name(self) -> str:
        """Name by the coordinate with most of the energy: ``1st tower fore-aft``, ``1st flap backward whirl``.

        Modes that share the energy of a coordinate, such as those of blades at standstill, may have the same name;
        those of :func:`campbell` differ.
        """
        amplitude = dict(zip(self.coordinates, self.shape, strict=True))
        largest = self.coordinates[int(np.argmax(self.energy))]
        kind, _, part = largest.rpartition(" ")
        if part in ("cosine", "sine"):
            c, s = (amplitude.get(f"{kind} {each}", 0.0) for each in ("cosine", "sine"))
            return f"{kind} {'backward' if abs(c - 1j * s) >= abs(c + 1j * s) else 'forward'} whirl"
        return mode_name(re.sub(r"^blade \d ", "", largest))

    def __repr__(self) -> str:
        return f"<Mode {self.name}: {self.frequency / (2.0 * np.pi):.4g} Hz, damping {100.0 * self.damping:.3g} %>"

    def participation(self, n: int = 3) -> str:
        """The coordinates with the largest amplitudes, as text."""
        order = np.argsort(-np.abs(self.shape))[:n]
        return "; ".join(f"{self.coordinates[i]} {abs(self.shape[i]):.2f}" for i in order if abs(self.shape[i]) > 0.05)


def mode_name(coordinate: str) -> str:
    """Name of a mode by its coordinate."""
    if match := re.fullmatch(r"tower (\S+) (.*)", coordinate):
        return f"{match[1]} tower {match[2]}"
    return {"yaw": "nacelle yaw", "drivetrain": "1st drivetrain torsion"}.get(coordinate, coordinate)


@one_blas_thread
def natural_modes(
    model: Model[Any], rotor_speed: float = 0.0, *, pitch: float = 0.0, generator_free: bool = False
) -> list[Mode]:
    """Natural modes of the turbine in vacuum, lowest frequency first.

    Args:
      rotor_speed: [rad/s] speed of the rotor.
      pitch: [rad] pitch angle of all blades.
      generator_free: whether the generator may rotate about its mean speed; otherwise its speed is prescribed.

    Raises:
      InputError: the turbine is a power-coefficient turbine.
      UnsupportedError: a rotating rotor does not have three blades, or is in gravity (its motion is periodic) and not
        on a floater, whose platform needs it; its blades keep the mean of their deflections at rest.
    """
    model = with_blades(model, "natural_modes")
    case = vacuum_case(model)
    case.view("pitch")["angle"] = pitch + deviations(model.turbine, "pitch")
    core, modes = model.n_core, len(model.rotor.blade.names)
    generator = model.rows.generator
    if rotor_speed and model.n_blades != 3:
        raise UnsupportedError("natural modes of a rotating rotor need three blades")
    floats = getattr(model.turbine, "platform", None) is not None
    if rotor_speed and model.environment.gravity and not floats:
        raise UnsupportedError("natural modes of a rotating rotor need zero gravity; set environment.gravity to 0")
    if not generator_free:
        case["locked"][generator] = 1.0
    free = np.flatnonzero(case["locked"] == 0.0)
    case["v"][generator] = rotor_speed
    equilibrium(case, free[free != generator])
    if rotor_speed and floats:
        case["q"][core:] = np.tile(case["q"][core:].reshape(-1, modes).mean(axis=0), model.n_blades)
    names = list(model.coordinates)
    if rotor_speed:
        K, D = np.zeros((2, len(names), len(names)))
        for azimuth in 2.0 * np.pi / 3.0 / AZIMUTHS * np.arange(AZIMUTHS):
            case["q"][generator] = azimuth
            k, d = fixed_frame(
                derivative_matrix(case, "q"), derivative_matrix(case, "v"), azimuth, rotor_speed, core, modes
            )
            K += k / AZIMUTHS
            D += d / AZIMUTHS
        names[core:] = [
            f"{name} {part}" for name in model.rotor.blade.names for part in ("collective", "cosine", "sine")
        ]
        locked = case["locked"][core:].reshape(3, modes)[0]
        free = np.concatenate([free[free < core], core + np.flatnonzero(np.repeat(locked, 3) == 0.0)])
    else:
        K, D = derivative_matrix(case, "q"), derivative_matrix(case, "v")
    some = np.ix_(free, free)
    finite(K, D)
    return eigenmodes(K[some], D[some], tuple(names[i] for i in free))


def eigenmodes(K: Float, D: Float, names: tuple[str, ...]) -> list[Mode]:
    """Oscillating solutions of q'' = K q + D q', lowest frequency first."""
    n = len(K)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [K, D]])
    value, vector = np.linalg.eig(A)
    factor = np.abs(np.linalg.pinv(vector).T * vector)
    modes = []
    for i in np.argsort(np.abs(value)):
        if value[i].imag > 1e-6:
            shape = vector[:n, i]
            shape = shape / shape[np.argmax(np.abs(shape))]
            energy = factor[:n, i] + factor[n:, i]
            modes.append(Mode(abs(value[i]), float(-value[i].real / abs(value[i])), names, shape, energy))
    return modes


def growing(case: Case) -> str:
    """Description of the least damped structural mode about the present state if it is unstable; else empty.

    Azimuth and speed of the rotor are prescribed. A first analysis holds the aerodynamic states; only where it finds
    growth, a second one includes them, which takes more time.
    """
    from scipy.linalg import eig

    generator = case.model.rows.generator
    free = np.flatnonzero((case["locked"] == 0.0) & (np.arange(len(case["q"])) != generator))
    options, kept = case["aero_options"], case["aero_options"].copy()
    options[AeroOptions.index("stall")], options[AeroOptions.index("iterations")] = 0, ITERATIONS
    case.evaluate(0.0)
    K, D = (derivative_matrix(case, which)[np.ix_(free, free)] for which in ("q", "v"))
    n = len(free)
    if np.all(np.isfinite(K)) and np.all(np.isfinite(D)):
        mild = np.all(_damping(np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [K, D]]))) > GROWING)
        options[AeroOptions.index("stall")] = kept[AeroOptions.index("stall")]
        A = np.zeros((0, 0)) if mild else _with_air(case, free)
    else:
        A = np.zeros((0, 0))
    options[:] = kept
    case.evaluate(0.0)
    if not (A.size and np.all(np.isfinite(A))):
        return ""
    value, left, right = eig(A, left=True)
    factor = np.abs(left.conj() * right)
    structural = factor[: 2 * n].sum(axis=0) > 0.5 * factor.sum(axis=0)
    damping = np.where(structural & (value.imag >= 0.0), _damping(value), np.inf)
    i = int(np.argmin(damping))
    if damping[i] > GROWING:
        return ""
    shape = right[:n, i] / right[:n, i][np.argmax(np.abs(right[:n, i]))]
    energy, names = factor[:n, i] + factor[n : 2 * n, i], tuple(case.model.coordinates[j] for j in free)
    mode = Mode(float(abs(value[i])), float(damping[i]), names, shape, energy)
    if value[i].imag < 1e-6:
        return f"its deflection ({mode.participation()}) grows by a factor of e in {1.0 / value[i].real:.2g} s"
    return (
        f"its mode at {mode.frequency / (2.0 * np.pi):.3g} Hz ({mode.participation()}) grows with "
        f"{-100.0 * mode.damping:.2g} % of critical damping"
    )


def _damping(value: NDArray[np.complex128]) -> Float:
    """Damping ratios of eigenvalues; 1 for those that hardly grow, such as that of an azimuth."""
    ratio: Float = np.where(value.real > SLOW, -value.real / np.maximum(np.abs(value), SLOW), 1.0)
    return ratio


def _with_air(case: Case, free: NDArray[np.intp], step: float = 1e-5) -> Float:
    """State matrix for coordinates, velocities, and states of inflow and stall, by central differences."""
    air = (case["inflow"], case["stall"])
    places = [(case[name], (i,)) for name in ("q", "v") for i in free]
    places += [(array, index) for array in air for index in np.ndindex(array.shape)]

    def rates() -> Float:
        case.evaluate(0.0)
        case.rates()
        return np.concatenate(
            [case["v"][free], case["a"][free], case["d_inflow"].reshape(-1), case["d_stall"].reshape(-1)]
        )

    A = np.zeros((len(places), len(places)))
    for j, (array, index) in enumerate(places):
        value = array[index]
        array[index] = value + step
        ahead = rates()
        array[index] = value - step
        A[:, j] = (ahead - rates()) / (2.0 * step)
        array[index] = value
    return A
