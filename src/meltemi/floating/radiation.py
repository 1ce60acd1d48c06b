"""Forces of the waves that past motion has radiated, as a sum of decaying oscillations fitted to the kernel.

Reference: docs/theory/floating.md (W-3 to W-6); Cummins (1962); Juang & Pappa (1985).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.floating.potential import HydroCoefficients

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

MEMORY, STEP = 60.0, 0.2
"""[s] length of the kernel, and interval between its samples in the fit."""
GROUPS: tuple[tuple[int, ...], ...] = ((0, 4), (1, 3), (2,), (5,))
"""Motions that a platform with two planes of symmetry couples."""
ORDERS = range(6, 41, 2)
ACCURATE = 0.005
"""Root-mean-square error of the fitted kernel over that of the kernel, at which the order is enough."""
SLOW = np.arange(0.0, 0.21, 0.05)
"""[rad/s] frequency of motions that are slower than the waves."""
FIRM, CUTS, NOTHING, SMALL = 1e2, 20, 1e-4, 1e-4
"""Weight of conditions on the damping, most rounds of them, negative damping over the largest that is none, and
residues over the largest that are left out."""
WORST, PASSIVE = 0.1, 0.001
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

    @property
    def words(self) -> str:
        """Text with the number of oscillations and the errors."""
        return (
            f"{len(self.pole)} oscillations, error {self.error:.1%} of the kernel, negative damping "
            f"{self.negative:.2%} of the largest"
        )

    @property
    def residue(self) -> Complex:
        """(P, 6, 6) residue of each pole: output times input."""
        return self.output[:, :, None] * self.input[:, None]

    def kernel(self, t: Float) -> Float:
        """(T, 6, 6) kernel over density at times (T,)."""
        return np.asarray(np.tensordot(np.exp(np.outer(t, self.pole)), self.residue, 1).real)

    def damping(self, frequency: Float) -> Float:
        """(F, 6, 6) radiation damping over density, of the pairs of poles."""
        s = 1j * frequency[:, None]
        one = np.tensordot(0.5 / (s - self.pole), self.residue, 1)
        other = np.tensordot(0.5 / (s - self.pole.conj()), self.residue.conj(), 1)
        return np.asarray((one + other).real)


class RadiationDamping(NamedTuple):
    """Radiation damping (F, 6, 6) over density at frequencies (F,) [rad/s], as in :class:`HydroCoefficients`."""

    frequency: Float
    damping: Float


def damping_at(coefficients: HydroCoefficients | RadiationDamping, frequency: Float) -> Float:
    """(F, 6, 6) damping over density, linear between the frequencies of the coefficients from none at rest."""
    w = np.append(0.0, coefficients.frequency)
    B = np.concatenate([np.zeros((1, 6, 6)), coefficients.damping])
    return np.stack([np.interp(frequency, w, c) for c in B.reshape(len(w), -1).T], axis=-1).reshape(-1, 6, 6)


def kernel(coefficients: HydroCoefficients | RadiationDamping, t: Float) -> Float:
    """(T, 6, 6) retardation kernel over density: 2/pi int B cos(w t) dw, damping linear in between (W-3)."""
    fine = np.linspace(0.0, coefficients.frequency[-1], 8 * (len(coefficients.frequency) + 1))
    flat = damping_at(coefficients, fine).reshape(len(fine), -1)
    weight = np.full(len(fine), fine[1])
    weight[[0, -1]] *= 0.5
    return np.asarray((np.cos(np.outer(t, fine)) @ (weight[:, None] * flat) * 2.0 / np.pi).reshape(len(t), 6, 6))


def fit_radiation(coefficients: HydroCoefficients) -> Radiation:
    """Fit the kernel by realisation of its Hankel matrix, with the lowest order that is accurate (W-5, W-6).

    Without damping there is no memory. The last fits are kept for further models of the same platforms.

    Raises:
      InputError: no fit is accurate and passive.
    """
    return _fitted(coefficients.frequency.tobytes(), coefficients.damping.tobytes())


@lru_cache(maxsize=16)
def _fitted(frequency: bytes, damping: bytes) -> Radiation:
    coefficients = RadiationDamping(np.frombuffer(frequency), np.frombuffer(damping).reshape(-1, 6, 6))
    t: Float = np.arange(0.0, MEMORY, STEP, dtype=np.float64)
    K = kernel(coefficients, t)
    # unit motions are those with equal damping
    size = np.sqrt(np.abs(coefficients.damping).max(axis=0).diagonal())
    size[size <= 1e-6 * size.max()] = np.inf
    none = np.zeros((0, 6), dtype=np.complex128)
    groups = [Radiation(none[:, 0], none, none, 0.0, 0.0)]
    groups += [
        _group(K, t, size, motions, coefficients) for motions in GROUPS if np.isfinite(size[list(motions)]).all()
    ]
    pole, inputs, outputs = (np.concatenate([getattr(e, n) for e in groups]) for n in ("pole", "input", "output"))
    error, negative = max(each.error for each in groups), max(each.negative for each in groups)
    if error > WORST or negative > PASSIVE:
        raise InputError(
            f"platform.coefficients: no model of the radiation fits: error {error:.2g} of the kernel, negative damping "
            f"{negative:.2g} of the largest; compute damping at more, or higher, frequencies"
        )
    return Radiation(pole, inputs, outputs, error, negative)


def _group(K: Float, t: Float, size: Float, motions: tuple[int, ...], coefficients: RadiationDamping) -> Radiation:
    """Passive model of a group of motions, with the lowest accurate order."""
    some, n = list(motions), len(motions)
    scale = np.outer(size[some], size[some])

    def scaled(matrices: Float) -> Float:
        return matrices[:, some][:, :, some] / scale

    h = scaled(K)
    half = len(t) // 2
    rows = np.arange(half)[:, None] + np.arange(half)
    H = h[rows].transpose(0, 2, 1, 3).reshape(half * n, half * n)
    H1 = h[rows + 1].transpose(0, 2, 1, 3).reshape(half * n, half * n)
    U, s, Vt = scipy.linalg.svd(H, full_matrices=False)
    slow = scaled(damping_at(coefficients, SLOW))
    wide = np.linspace(0.0, 2.0 * coefficients.frequency[-1], 400)

    def fit(poles: Complex, cuts: int) -> tuple[Complex, Complex, Complex]:
        residue = _residues(poles, h, t, slow, wide, cuts)
        u, sv, vh = np.linalg.svd(residue)
        # residues of any rank as sums of products
        p, r = np.nonzero(sv > SMALL * sv.max())
        B, C = np.zeros((len(p), 6), dtype=complex), np.zeros((len(p), 6), dtype=complex)
        B[:, some], C[:, some] = vh[p, r] * size[some], u[p, :, r] * sv[p, r, None] * size[some]
        return poles[p], B, C

    def error_of(found: Radiation) -> float:
        return float(np.sqrt(np.mean((scaled(found.kernel(t)) - h) ** 2) / np.mean(h**2)))

    best = np.inf, np.zeros(0, dtype=np.complex128)
    for order in ORDERS:
        root = np.sqrt(s[:order])
        A = (U[:, :order] / root).T @ H1 @ (Vt[:order].T / root)
        z = np.linalg.eigvals(A)
        poles = np.log(z[(np.abs(z) < 1.0) & (np.abs(z) > 1e-6)].astype(complex)) / STEP
        poles = poles[poles.imag >= -1e-9]
        error = error_of(Radiation(*fit(poles, 1), 0.0, 0.0))
        best = min(best, (error, poles), key=lambda each: each[0])
        if error < ACCURATE:
            break
    found = Radiation(*fit(best[1], CUTS), 0.0, 0.0)
    least = np.linalg.eigvalsh(scaled(found.damping(wide)))
    negative = max(0.0, -float(least.min()) / float(least.max()))
    return replace(found, error=error_of(found), negative=negative)


def _residues(poles: Complex, h: Float, t: Float, slow: Float, frequency: Float, cuts: int) -> Complex:
    """(P, n, n) symmetric residues by least squares (W-6).

    The damping of slow motions, (S, n, n) at ``SLOW``, is kept, for it is often all that they have. Where the damping
    in a direction is negative it is required to vanish, and all is fitted again, up to ``cuts`` times.
    """
    n, P = h.shape[1], len(poles)
    a, b = np.triu_indices(n)
    twice = np.where(a == b, 1.0, 2.0)
    basis = np.exp(np.outer(t, poles))
    real = np.concatenate([basis.real, -basis.imag], axis=1)

    def damping(w: Float) -> Float:
        low, high = 0.5 / (1j * w[:, None] - poles), 0.5 / (1j * w[:, None] - poles.conj())
        return np.concatenate([(low + high).real, (1j * (low - high)).real], axis=1)

    target, kept = damping(frequency), damping(SLOW)
    firm = FIRM * np.abs(real).max() / np.abs(kept).max()
    Q, R = np.linalg.qr(real)
    rows = [np.kron(np.diag(np.sqrt(twice)), R), np.kron(np.eye(len(a)), firm * kept)]
    wanted = [(Q.T @ (h[:, a, b] * np.sqrt(twice))).T.ravel(), firm * slow[:, a, b].T.ravel()]
    for rounds in range(1, cuts + 1):
        x = np.linalg.lstsq(np.concatenate(rows), np.concatenate(wanted), rcond=1e-12)[0].reshape(len(a), 2 * P)
        if rounds == cuts:
            break
        fitted = np.zeros((len(frequency), n, n))
        fitted[:, a, b] = fitted[:, b, a] = target @ x.T
        least, direction = np.linalg.eigh(fitted)
        lowest = np.pad(least[:, 0], 1, constant_values=np.inf)
        bad = (least[:, 0] < -NOTHING * least.max()) & (lowest[1:-1] <= lowest[:-2]) & (lowest[1:-1] <= lowest[2:])
        if not bad.any():
            break
        for k in np.flatnonzero(bad):
            v = direction[k, :, 0]
            size = FIRM * np.abs(real).max() / np.abs(target[k]).max()
            rows.append(size * np.kron((v[a] * v[b] * twice)[None], target[k : k + 1]))
            wanted.append(np.zeros(1))
    residue = np.zeros((P, n, n), dtype=np.complex128)
    residue[:, a, b] = residue[:, b, a] = (x[:, :P] + 1j * x[:, P:]).T
    return residue
