"""Fits of load surrogates, their validation, and the points where further runs help most.

Equations S-4 to S-12 of ``docs/theory/surrogate.md``.
"""

from __future__ import annotations

from itertools import product
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.surrogate.campaign import Design, SurrogateCampaign
from meltemi.surrogate.model import Float, Kernels, LoadModel, Polynomials, Surrogate, legendre_products
from meltemi.surrogate.space import Space

Kind = Literal["polynomial", "gaussian"]
KINDS = ("polynomial", "gaussian")
RESAMPLED = 24
"""Fits to resampled residuals."""
DEGREE = 10
"""Largest degree of a polynomial."""
NORM = 0.6
"""Exponent q of the hyperbolic truncation (S-6)."""
MOST_TERMS = 1500
"""Candidates among which terms are chosen."""


def candidates(dimensions: int, degree: int, norm: float = NORM) -> NDArray[np.int64]:
    """Degrees (P, d) of the products of a hyperbolic truncation, the constant first (S-6)."""
    found: list[tuple[int, ...]] = [()]
    for _ in range(dimensions):
        grown = (one + (k,) for one, k in product(found, range(degree + 1)))
        found = [one for one in grown if sum(k**norm for k in one) ** (1.0 / norm) <= degree + 1e-9]
    return np.array(sorted(found, key=lambda one: (sum(one), [-k for k in one])), dtype=np.int64)


def choose_terms(basis: Float, y: Float, most: int | None = None) -> tuple[list[int], float]:
    """Terms of a sparse expansion, by orthogonal least squares with the leave-one-out error (S-7).

    The term that reduces the residual most is added until the error has its minimum behind it.

    Args:
      basis: (n, P) values of the candidates, the constant first.
      y: (n,) values.
      most: terms; by default a third of the values.

    Returns:
      columns, and the leave-one-out variance.
    """
    n = len(y)
    rest, residual, leverage = basis.copy(), y.astype(float).copy(), np.zeros(n)
    chosen: list[int] = []
    best, kept = np.inf, 1
    scale = np.sum(basis**2, axis=0)
    for k in range(min(most or max(n // 3, 1), basis.shape[1])):
        norms = np.sum(rest**2, axis=0)
        free = norms > 1e-9 * scale
        gain = np.where(free, (residual @ rest) ** 2 / np.where(free, norms, 1.0), -1.0)
        gain[chosen] = -1.0
        j = int(np.argmax(gain)) if k else 0
        if gain[j] < 0.0:
            break
        unit = rest[:, j] / np.sqrt(norms[j])
        residual -= unit * (unit @ residual)
        leverage += unit**2
        rest -= np.outer(unit, unit @ rest)
        chosen.append(j)
        size = k + 1
        if size >= n:
            break
        left = residual / np.maximum(1.0 - leverage, 1e-12)
        error = float(np.mean(left**2)) * (n + size) / (n - size)
        if error < best:
            best, kept = error, size
        elif size > 1.5 * kept + 10 or error > 2.0 * best:
            break
    return chosen[:kept], best


def polynomial_fit(germ: Float, y: Float) -> tuple[Polynomials, Float]:
    """Sparse polynomial chaos expansion: its basis, and the matrix (P, n) from values to coefficients (S-4 to S-7)."""
    n, d = germ.shape
    found: tuple[float, NDArray[np.int64]] | None = None
    worse = 0
    for degree in range(1, DEGREE + 1):
        degrees = candidates(d, degree)
        if len(degrees) > MOST_TERMS or worse == 2:
            break
        columns, error = choose_terms(legendre_products(germ, degrees), y)
        worse = 0 if found is None or error < found[0] else worse + 1
        if found is None or error < found[0]:
            found = error, degrees[columns]
    assert found is not None
    return Polynomials(found[1]), np.linalg.pinv(legendre_products(germ, found[1]))


def gaussian_fit(germ: Float, y: Float) -> tuple[Kernels, Float]:
    """Gaussian process with a length scale for each variable and noise: its basis and the matrix (N + 1, n).

    Raises:
      InputError: scikit-learn is not installed.
    """
    try:
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel
    except ImportError:
        raise InputError('kind gaussian needs scikit-learn: pip install "meltemi[surrogate]"') from None
    from warnings import catch_warnings

    kernel = ConstantKernel(4.0, (1e-2, 1e4)) * RBF(np.ones(germ.shape[1]), (0.1, 100.0)) + WhiteKernel(0.05, (1e-10, 2))
    with catch_warnings(action="ignore"):  # of hyperparameters at their limits
        learned = GaussianProcessRegressor(kernel).fit(germ, (y - y.mean()) / y.std()).kernel_
    basis = Kernels(germ, np.broadcast_to(learned.k1.k2.length_scale, germ.shape[1:]).copy())
    n, variance, noise = len(y), learned.k1.k1.constant_value, learned.k2.noise_level
    inverse = np.linalg.inv(variance * basis(germ)[:, :n] + noise * np.eye(n))
    mean = inverse.sum(axis=0) / inverse.sum()  # generalised least squares of the constant
    return basis, np.vstack([variance * inverse @ (np.eye(n) - mean), mean])


def fit_surrogate(
    campaign: SurrogateCampaign, design: Design, loads: Float, kind: Kind = "polynomial"
) -> Surrogate:
    """Fit a surrogate to the runs of a campaign that are no held-out points, and validate it with these.

    Args:
      campaign, design, loads: of ``read_loads``.
      kind: "polynomial" chaos expansion or "gaussian" process.

    Raises:
      InputError: there are too few points, no such kind, or scikit-learn is not installed.
    """
    if kind not in KINDS:
        raise InputError(f"kind: {did_you_mean(kind, KINDS)}")
    train = ~design.check
    germ, least = design.space.germ(design.values[train]), 2 * len(design.space.variables) + 2
    if len(np.unique(design.point[train])) < least:
        raise InputError(f"{len(np.unique(design.point[train]))} points are too few for a fit: expected {least}")
    models = {}
    for i, (name, slope) in enumerate(campaign.loads.items()):
        y = np.log(np.maximum(loads[train, i], 1e-300))
        basis, matrix = (polynomial_fit if kind == "polynomial" else gaussian_fit)(germ, y)
        values = basis(germ)
        fitted, leverage = values @ (matrix @ y), np.einsum("ij,ji->i", values, matrix)
        left = (y - fitted) / np.sqrt(np.maximum(1.0 - leverage, 1e-6))
        drawn = np.random.default_rng(i).choice(left - left.mean(), (RESAMPLED, len(y)))
        coefficients = np.vstack([y, fitted + drawn]) @ matrix.T
        scatter = seed_scatter(design.point[train], y)
        deviation = scatter if scatter is not None else float(np.sqrt(np.mean(left**2)))
        unit = "N" if "force" in name or name == "rotor_thrust" else "N m"
        model = LoadModel(name, unit, slope, design.space, basis, coefficients, deviation, {})
        models[name] = LoadModel(**(vars(model) | {"errors": validation(model, design, loads[:, i])}))
    counts = {"points": len(np.unique(design.point[train])), "runs": int(train.sum())}
    counts |= {"checks": len(np.unique(design.point[~train])), "check_runs": int((~train).sum())}
    facts: dict[str, Any] = {"kind": kind, **counts, "duration": campaign.duration, "f_eq": 1.0}
    return Surrogate(campaign.turbine, design.space, models, facts)


def seed_scatter(point: NDArray[np.int64], y: Float) -> float | None:
    """Pooled standard deviation of values over the seeds of their points; None without repeated points (S-10)."""
    _, place, count = np.unique(point, return_inverse=True, return_counts=True)
    mean = np.bincount(place, y) / count
    freedom = int((count - 1).sum())
    return float(np.sqrt(np.sum((y - mean[place]) ** 2) / freedom)) if freedom else None


def validation(model: LoadModel, design: Design, loads: Float) -> dict[str, float]:
    """Errors at held-out points against the mean over seeds (S-11): ``r2``, ``nrmse`` (over the mean load), ``bias``
    (mean relative error), and ``floor``, the part of ``nrmse`` that is scatter of these means; empty without them."""
    if not design.check.any():
        return {}
    _, first, place, count = np.unique(
        design.point[design.check], return_index=True, return_inverse=True, return_counts=True
    )
    mean = np.bincount(place, loads[design.check]) / count
    error = model.predict_output(design.values[design.check][first]) - mean
    spread = np.bincount(place, (loads[design.check] - mean[place]) ** 2) / np.maximum(count - 1, 1) / count
    return {
        "r2": float(1.0 - np.sum(error**2) / max(float(np.sum((mean - mean.mean()) ** 2)), 1e-300)),
        "nrmse": float(np.sqrt(np.mean(error**2)) / mean.mean()),
        "bias": float(np.mean(error / mean)),
        "floor": float(np.sqrt(np.mean(spread)) / mean.mean()),
    }


def further_points(
    surrogate: Surrogate, n: int, probability: Any, *, candidates_per_point: int = 64, seed: int = 1
) -> Float:
    """Points (n, d) where further runs reduce the error of the lifetime loads most (S-12).

    Args:
      surrogate: of polynomial form.
      n: number of points.
      probability: function of wind speeds (k,) [m/s], proportional to their probability density.
      candidates_per_point: points of a space-filling design for each chosen one.
      seed: of the candidates and the choice.
    """
    from meltemi.surrogate.space import space_filling

    space: Space = surrogate.space
    germ = space_filling(len(space.variables), n * candidates_per_point, seed=seed)
    points = space.points(germ)
    density = np.asarray(probability(points[:, 0]), dtype=float)
    score = np.zeros(len(germ))
    for model in surrogate.loads.values():
        log = model.logarithm(germ, len(model.coefficients))
        damage = density * np.exp(model.slope * (log[:, 0] - log[:, 0].max()))
        score += (model.slope * damage / damage.sum()) ** 2 * log[:, 1:].var(axis=1)
    chosen = np.random.default_rng(seed).choice(len(germ), n, replace=False, p=np.sqrt(score) / np.sqrt(score).sum())
    return points[np.sort(chosen)]
