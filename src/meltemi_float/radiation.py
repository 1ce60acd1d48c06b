"""Forces of the waves that past motion has radiated, as a sum of decaying oscillations fitted to the kernel.

Reference: docs/theory/floating.md (W-3 to W-6); Cummins (1962); Juang & Pappa (1985).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi_float.coefficients import Coefficients

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

MEMORY, STEP = 60.0, 0.2
"""[s] that the kernel lasts, and between its samples in the fit."""
GROUPS: tuple[tuple[int, ...], ...] = ((0, 4), (1, 3), (2,), (5,))
"""Motions that a platform with two planes of symmetry couples."""
ORDERS = range(6, 31, 2)
ACCURATE = 0.005
"""Root-mean-square error of the fitted kernel over that of the kernel, at which the order is enough."""
WORST, PASSIVE = 0.1, 0.01
"""Error with which a fit is refused, and negative damping over the largest."""


@dataclass(frozen=True)
class Radiation:
    """Sum of oscillations K(t) = Re sum_p output_p input_p^T exp(pole_p t) (W-5), and how well it fits.

    Attributes:
      pole: (P,) [1/s]; input, output: (P, 6).
      error: root-mean-square error over that of the kernel, of the worst group of motions [-].
      negative: largest negative damping over the largest damping of its group [-]; 0 is passive.
    """

    pole: Complex
    input: Complex
    output: Complex
    error: float
    negative: float

    @classmethod
    def none(cls) -> Radiation:
        """No memory."""
        empty = np.zeros((0, 6), dtype=np.complex128)
        return cls(np.zeros(0, dtype=np.complex128), empty, empty, 0.0, 0.0)

    def kernel(self, t: Float) -> Float:
        """(T, 6, 6) kernel over density at times (T,)."""
        return np.einsum("pi,pj,pt->tij", self.output, self.input, np.exp(np.outer(self.pole, t))).real

    def damping(self, frequency: Float) -> Float:
        """(F, 6, 6) radiation damping over density."""
        return self._transfer(frequency).real

    def _transfer(self, frequency: Float) -> Complex:
        """(F, 6, 6) of the pairs of poles."""
        s = 1j * frequency[:, None]
        one = np.einsum("pi,pj,fp->fij", self.output, self.input, 0.5 / (s - self.pole))
        other = np.einsum("pi,pj,fp->fij", self.output.conj(), self.input.conj(), 0.5 / (s - self.pole.conj()))
        return np.asarray(one + other)


def kernel(coefficients: Coefficients, t: Float) -> Float:
    """(T, 6, 6) retardation kernel over density: 2/pi int B cos(w t) dw, damping linear in between (W-3)."""
    w = np.append(0.0, coefficients.frequency)
    B = np.concatenate([np.zeros((1, 6, 6)), coefficients.damping])
    fine = np.linspace(0.0, w[-1], 8 * len(w))
    flat = np.stack([np.interp(fine, w, column) for column in B.reshape(len(w), -1).T])
    weight = np.full(len(fine), fine[1])
    weight[[0, -1]] *= 0.5
    return np.asarray((np.cos(np.outer(t, fine)) @ (weight[:, None] * flat.T) * 2.0 / np.pi).reshape(len(t), 6, 6))


def fit_radiation(coefficients: Coefficients) -> Radiation:
    """Fit the kernel by realisation of its Hankel matrix, with the lowest order that is accurate (W-5, W-6).

    Raises:
      InputError: no fit is accurate and passive.
    """
    t: Float = np.arange(0.0, MEMORY, STEP, dtype=np.float64)
    K = kernel(coefficients, t)
    # unit motions are those with equal damping
    size = np.sqrt(np.abs(coefficients.damping).max(axis=0).diagonal())
    size[size < 1e-6 * size.max()] = np.inf
    found = [
        _group(K, t, size, motions, coefficients.frequency)
        for motions in GROUPS
        if np.isfinite(size[list(motions)]).all()
    ]
    pole, inputs, outputs = (np.concatenate([each[i] for each in found]) for i in range(3))
    error, negative = (max(float(each[i]) for each in found) for i in (3, 4))
    if error > WORST or negative > PASSIVE:
        raise InputError(
            f"platform.coefficients: no model of the radiation fits: error {error:.2g} of the kernel, negative damping "
            f"{negative:.2g} of the largest; compute damping at more, or higher, frequencies"
        )
    return Radiation(pole, inputs, outputs, error, negative)


def _group(
    K: Float, t: Float, size: Float, motions: tuple[int, ...], frequency: Float
) -> tuple[Complex, Complex, Complex, float, float]:
    """Poles, inputs, outputs, error and negative damping of a group of motions."""
    some, n = list(motions), len(motions)
    h = K[:, some][:, :, some] / np.outer(size[some], size[some])
    half = len(t) // 2
    rows = np.arange(half)[:, None] + np.arange(half)
    H = h[rows].transpose(0, 2, 1, 3).reshape(half * n, half * n)
    H1 = h[rows + 1].transpose(0, 2, 1, 3).reshape(half * n, half * n)
    U, s, Vt = scipy.linalg.svd(H, full_matrices=False)
    wide = np.linspace(0.0, 2.0 * frequency[-1], 400)
    best: tuple[Complex, Complex, Complex, float, float] | None = None
    for order in ORDERS:
        root = np.sqrt(s[:order])
        A = (U[:, :order] / root).T @ H1 @ (Vt[:order].T / root)
        z = np.linalg.eigvals(A)
        poles = np.log(z[(np.abs(z) < 1.0) & (np.abs(z) > 1e-6)].astype(complex)) / STEP
        poles = poles[poles.imag >= -1e-9]
        basis = np.exp(np.outer(t, poles))
        real = np.concatenate([basis.real, -basis.imag], axis=1)
        # residues by least squares; symmetric, of rank one by their largest eigenvalue
        found = np.linalg.lstsq(real, h.reshape(len(t), -1), rcond=1e-10)[0]
        P = len(poles)
        residue = (found[:P] + 1j * found[P:]).reshape(P, n, n)
        residue = 0.5 * (residue + residue.transpose(0, 2, 1))
        u, sv, vh = np.linalg.svd(residue)
        outputs, inputs, repeated = [], [], []
        for p in range(P):
            for r in range(n):
                if sv[p, r] > 1e-3 * sv[:, 0].max():
                    repeated.append(poles[p])
                    outputs.append(u[p][:, r] * sv[p, r])
                    inputs.append(vh[p][r])
        pole = np.array(repeated)
        B, C = np.zeros((len(pole), 6), dtype=complex), np.zeros((len(pole), 6), dtype=complex)
        B[:, some], C[:, some] = np.array(inputs) * size[some], np.array(outputs) * size[some]
        trial = Radiation(pole, B, C, 0.0, 0.0)
        scale = np.outer(size[some], size[some])
        fitted = trial.kernel(t)[:, some][:, :, some] / scale
        error = float(np.sqrt(np.mean((fitted - h) ** 2) / np.mean(h**2)))
        least = np.linalg.eigvalsh(trial.damping(wide)[:, some][:, :, some] / scale)
        negative = max(0.0, -float(least.min()) / float(least.max()))
        if best is None or error + negative < best[3] + best[4]:
            best = (pole, B, C, error, negative)
        if error < ACCURATE and negative < 0.2 * PASSIVE:
            break
    assert best is not None
    return best
