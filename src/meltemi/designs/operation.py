"""Terms of the linear model in steady operation under the baseline law: damping of modes, and sensitivity of loops.

The model with the law is one matrix of states, injections and what they reach, and each term has its derivatives by the
entries of that matrix: of an eigenvalue from its two eigenvectors, of a response from the two halves of the loop.

Reference: docs/theory/designs.md (D-12 to D-16).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.campbell import follow
from meltemi.analyses.linear import AZIMUTHS, LinearModel, linearise
from meltemi.analyses.modes import Mode
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.threads import one_blas_thread
from meltemi.designs.kept import keep
from meltemi.designs.terms import LOOPS, Term, operation_of, soft_maximum
from meltemi.simulation.bladed.rotor import with_blades, with_static_gears
from meltemi.simulation.model import Model
from meltemi.simulation.rotors import operating_point
from meltemi.tuning.platform_feedback import law_matrices, under
from meltemi.tuning.speed_loop import FREQUENCIES
from meltemi.turbine.definition import BaselineControl

Float = NDArray[np.float64]
LAW = ("filtered generator speed", "its integral", "tower-top velocity", "tower-top velocity without what is fast")
"""States of the law."""
MAGNITUDE = {"damping": 0.1, "sensitivity": 1.0}
"""Magnitudes of the soft extremes."""
LEAST_SHARE = 1e-12
"""Share of a frequency in the soft maximum that counts as none."""


def linear_model(model: Model[Any], wind_speed: float) -> LinearModel:
    """Linear model of a turbine in steady operation: torque and pitch demand to generator speed and motion of the top.

    Raises:
      InputError: the turbine is a power-coefficient turbine.
    """
    model = with_static_gears(with_blades(model, "linear terms"))
    inputs, outputs = ("generator_torque", "pitch"), ("generator_speed", "tower_top_acceleration_x")
    return linearise(model, operating_point(model, wind_speed), inputs, outputs, azimuths=AZIMUTHS // 2)


def under_law(linear: LinearModel, law: BaselineControl) -> Float:
    """(n + 6, n + 6) linear model under the law (D-12): rates of its states and of those of the law, and the generator
    speed and pitch demand that the loops carry; by the states and by what is added to these two."""
    _, sensed, demand = law_matrices(law, linear.point)
    B, C, D = linear.B, linear.C, linear.D
    added = np.block([[np.zeros((len(B), 1)), B[:, 1:]], [sensed[:, :1], sensed @ D[:, 1:]]])
    carried = np.block([[C[:1], D[:1] @ demand], [np.zeros((1, len(B))), demand[1:]]])
    return np.block([[under(linear, law), added], [carried, np.array([[1.0, D[0, 1]], [0.0, 1.0]])]])


def value_and_slopes(term: Term, linear: LinearModel, matrix: Float) -> tuple[float, Float]:
    """A term, and its derivatives by the entries of the matrix of :func:`under_law`.

    Raises:
      InputError: no mode in operation has this name.
    """
    what, _ = operation_of(term)
    return _damping(term, what, linear, matrix) if term.kind == "damping" else _sensitivity(term, what, matrix)


@one_blas_thread
def _damping(term: Term, name: str, linear: LinearModel, matrix: Float) -> tuple[float, Float]:
    """Damping ratio of a mode, or soft minimum of those of several (D-13, D-14)."""
    from scipy.linalg import eig

    n = len(matrix) - len(LOOPS)
    A = matrix[:n, :n]
    modes = replace(linear, A=A, states=(*linear.states, *LAW)).modes()
    found: dict[str, Mode] = {label: curve[0] for label, curve in follow([modes], [0]).items() if curve[0]}
    some = [mode for label, mode in found.items() if label == name or (name[-1] == "*" and label.startswith(name[:-1]))]
    if not some:
        raise InputError(f"terms: {term.name!r}: {did_you_mean(name, found)}")
    values, left, right = eig(A, left=True)
    damping, slopes = [], np.zeros((len(some), *matrix.shape))
    for k, mode in enumerate(some):
        i = int(np.argmin(np.abs(values - mode.frequency * complex(-mode.damping, np.sqrt(1.0 - mode.damping**2)))))
        at, size = values[i], abs(values[i])
        by = np.outer(left[:, i].conj(), right[:, i]) / (left[:, i].conj() @ right[:, i])
        damping.append(float(-at.real / size))
        slopes[k, :n, :n] = -by.real / size + at.real * (at.conj() * by).real / size**3
    if len(some) == 1:
        return damping[0], slopes[0]
    value, share = soft_maximum(-np.array(damping), term.setting.sharpness, MAGNITUDE["damping"])
    return -value, np.einsum("k,kij->ij", share, slopes)


@one_blas_thread
def _sensitivity(term: Term, loop: str, matrix: Float) -> tuple[float, Float]:
    """Soft maximum over the frequencies of |1 / (1 + L)|: of what a loop carries over what is added to it (D-15, D-16).

    An unstable loop has no such amplification; that of its response is returned, which is large near the limit.
    """
    from scipy.linalg import schur
    from scipy.linalg.lapack import ztrtrs

    n, at = len(matrix) - len(LOOPS), len(matrix) - len(LOOPS) + LOOPS.index(loop)
    T, U = schur(matrix[:n, :n], output="complex")
    into, out = np.asfortranarray(U.conj().T @ matrix[:n, at, None]), matrix[at, :n] @ U
    shifted, diagonal = np.asfortranarray(-T), np.diag(T).copy()

    def solved(w: float, right: Any, trans: int) -> Any:
        np.fill_diagonal(shifted, 1j * w - diagonal)
        return ztrtrs(shifted, right, trans=trans)[0][:, 0]

    reached = [solved(w, into, 0) for w in FREQUENCIES]
    responses = matrix[at, at] + np.array([out @ x for x in reached])
    value, share = soft_maximum(np.abs(responses), term.setting.sharpness, MAGNITUDE["sensitivity"])
    slopes = np.zeros(matrix.shape)
    for k in np.flatnonzero(share > LEAST_SHARE):
        row = solved(FREQUENCIES[k], np.asfortranarray(out[:, None]), 1)
        right, left = np.append(U @ reached[k], 1.0), np.append(U.conj() @ row, 1.0)
        place = [*range(n), at]
        turn = share[k] * responses[k].conj() / abs(responses[k])
        slopes[np.ix_(place, place)] += (turn * np.outer(left, right)).real
    return value, slopes


class Operation:
    """Terms of operation of a design.

    Args:
      terms: the terms.
      model: the model of a design, or of one beside another (``Variables.apply``).
      origin: (P,) the design at the start.
      steady: (P,) whether a variable acts on steady operation; linear models are kept for those that do not.
      steps: (P,) steps of the differences of the matrix.
    """

    def __init__(
        self, terms: Sequence[Term], model: Callable[[Float, Float | None], Model[Any]], origin: Float,
        steady: NDArray[np.bool_], steps: Float,
    ) -> None:  # fmt: skip
        self.terms, self.model, self.origin, self.steady, self.steps = terms, model, origin, steady, steps
        self._linear: dict[tuple[bytes, float, bytes | None], LinearModel] = {}
        self._found: tuple[bytes, dict[str, tuple[float, Float]]] = b"", {}

    def linear(self, x: Float, wind_speed: float, about: Float | None = None) -> LinearModel:
        """The linear model of a design, without the law."""
        held = np.where(self.steady, x, self.origin)
        key = held.tobytes(), wind_speed, None if about is None else about.tobytes()
        if key not in self._linear:
            keep(self._linear, key, linear_model(self.model(held, about), wind_speed), 4 * len(x) + 1)
        return self._linear[key]

    def matrix(self, x: Float, wind_speed: float, about: Float | None = None) -> Float:
        """The linear model of a design under its law."""
        return under_law(self.linear(x, wind_speed, about), self.model(x, about).turbine.control)

    def values(self, x: Float) -> dict[str, float]:
        """Terms by name.

        Raises:
          InputError: no mode in operation has the name of a term.
        """
        return {name: value for name, (value, _) in self._by_matrix(x).items()}

    def _by_matrix(self, x: Float) -> dict[str, tuple[float, Float]]:
        if self._found[0] != x.tobytes():
            speeds = {term.name: operation_of(term)[1] for term in self.terms}
            self._found = (
                x.tobytes(),
                {
                    t.name: value_and_slopes(t, self.linear(x, speeds[t.name]), self.matrix(x, speeds[t.name]))
                    for t in self.terms
                },
            )
        return self._found[1]

    def slopes(self, x: Float) -> dict[str, Float]:
        """(P,) derivatives of the terms by the variables (D-13), with central differences of the matrix.

        Raises:
          InputError: the linear model has other states beside the design.
        """
        found = {term.name: np.zeros(len(x)) for term in self.terms}
        for p, h in enumerate(self.steps):
            change = np.zeros(len(x))
            change[p] = h
            for speed in {operation_of(term)[1] for term in self.terms}:
                low, high = (self.matrix(x + sign * change, speed, x) for sign in (-1.0, 1.0))
                for term in self.terms:
                    by = self._by_matrix(x)[term.name][1]
                    if operation_of(term)[1] == speed:
                        if low.shape != by.shape or high.shape != by.shape:
                            raise InputError(f"{term.name}: the linear model has other states beside the design")
                        found[term.name][p] = np.sum(by * (high - low)) / (2.0 * h)
        return found
