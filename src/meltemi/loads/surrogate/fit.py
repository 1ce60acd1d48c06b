"""Fits of load surrogates, their validation, and the points where further runs help most.

Equations LS-4 to LS-12 of ``docs/theory/surrogate.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.extras import need
from meltemi.loads.surrogate.campaign import SurrogateCampaign, SurrogateDesign
from meltemi.loads.surrogate.model import Float, Kernels, LoadModel, Polynomials, Surrogate, legendre_products
from meltemi.loads.surrogate.space import Space
from meltemi.turbine.library import load_turbine

KINDS = ("polynomial", "gaussian")
DRAWS = 24
"""Number of draws of the coefficients, which show their uncertainty."""
DEGREE, NORM = 12, 0.6
"""Largest degree, and exponent q, of the hyperbolic truncation (LS-6)."""
NEGLIGIBLE = 0.01
"""Share of a coefficient that the runs determine, below which its term is omitted."""
LEARNED = 400
"""Largest number of runs from which a Gaussian process learns its length scales; its values use all runs."""


def candidates(dimensions: int, degree: int, norm: float = NORM) -> NDArray[np.int64]:
    """Degrees (P, d) of the products of a hyperbolic truncation, the constant first (LS-6)."""
    products: list[tuple[int, ...]] = [()]
    for _ in range(dimensions):
        grown = ((*one, k) for one, k in product(products, range(degree + 1)))
        products = [one for one in grown if sum(k**norm for k in one) ** (1.0 / norm) <= degree + 1e-9]
    return np.array(sorted(products, key=lambda one: (sum(one), [-k for k in one])), dtype=np.int64)


@dataclass(frozen=True)
class Fit:
    """Basis and coefficients of one logarithm.

    Attributes:
      coefficients: (1 + B, P) coefficients of the fit, and draws that show its uncertainty.
      noise: variance of the values about the fit.
    """

    basis: Polynomials | Kernels
    coefficients: Float
    noise: float


def polynomial_fit(germ: Float, y: Float, seed: int = 0, degree: int = DEGREE, norm: float = NORM) -> Fit:
    """Polynomial chaos expansion whose coefficients are normally distributed a priori (LS-7).

    Their variance falls with the degree at a rate that differs between variables; rates and noise maximise the marginal
    likelihood of the values. The draws are from the posterior distribution.

    Args:
      germ: (n, d) germs.
      y: (n,) values.
      degree, norm: degree and exponent of the truncation.
    """
    from scipy.linalg import cho_factor, cho_solve
    from scipy.optimize import minimize

    degrees = candidates(germ.shape[1], degree, norm)
    phi, mean, scale = legendre_products(germ, degrees), float(y.mean()), float(y.std()) or 1.0
    z = (y - mean) / scale
    gram, moment, square = phi.T @ phi, phi.T @ z, float(z @ z)

    def prior(p: Float) -> Float:
        return np.asarray(np.exp(0.5 * (p[-2] - degrees @ np.exp(p[:-2]))))

    def cost(p: Float) -> tuple[float, Float]:
        """Negative logarithm of the marginal likelihood, without constants, and its gradient."""
        d, noise = prior(p), float(np.exp(p[-1]))
        inner = gram * np.outer(d, d) / noise
        inner.flat[:: len(d) + 1] += 1.0
        try:
            factor = cho_factor(inner, lower=True, overwrite_a=True, check_finite=False)
        except np.linalg.LinAlgError:
            return 1e12, np.zeros(len(p))
        kept = np.diag(cho_solve(factor, np.eye(len(d)), check_finite=False))
        w = cho_solve(factor, d * moment / noise, check_finite=False)
        c = d * w
        value = 0.5 * (square - c @ moment) / noise + np.log(np.diag(factor[0])).sum() + 0.5 * len(z) * p[-1]
        slope = 0.5 * (1.0 - kept - w**2)
        misfit = (square - 2.0 * c @ moment + c @ gram @ c) / noise
        rates = -(slope @ degrees) * np.exp(p[:-2])
        return float(value), np.array([*rates, slope.sum(), 0.5 * (len(z) - misfit - (1.0 - kept).sum())])

    start = np.array([*np.zeros(germ.shape[1]), 0.0, -4.0])
    bounds = [(-4.0, 2.5)] * germ.shape[1] + [(-8.0, 8.0), (-28.0, 1.0)]
    optimum = minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": 60}).x
    d, noise = prior(optimum), float(np.exp(optimum[-1]))
    determined = len(z) * d**2 > NEGLIGIBLE * noise
    determined[0] = True
    degrees, phi, d = degrees[determined], phi[:, determined], d[determined]
    u, s, v = np.linalg.svd(phi * d, full_matrices=False)
    weights = v.T @ (s / (s**2 + noise) * (u.T @ z))
    normal = np.random.default_rng(seed).standard_normal((len(d), DRAWS))
    deviations = normal + v.T @ ((np.sqrt(noise / (s**2 + noise)) - 1.0)[:, None] * (v @ normal))
    coefficients = np.vstack([weights, (weights[:, None] + deviations).T]) * d * scale
    coefficients[:, 0] += mean
    return Fit(Polynomials(degrees), coefficients, noise * scale**2)


def gaussian_fit(germ: Float, y: Float, seed: int = 0) -> Fit:
    """Gaussian process with a length scale for each variable and noise. The draws are fits to resampled residuals.

    Raises:
      InputError: scikit-learn is not installed.
    """
    need("kind gaussian", "scikit-learn")
    from warnings import catch_warnings

    from scipy.linalg import cho_solve
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    smooth = ConstantKernel(4.0, (1e-2, 1e2)) * RBF(np.ones(germ.shape[1]), (0.1, 100.0))
    random, n, mean, scale = np.random.default_rng(seed), len(y), float(y.mean()), float(y.std()) or 1.0
    some, z = random.permutation(n)[:LEARNED], (y - mean) / scale
    with catch_warnings(action="ignore"):  # of hyperparameters at their limits
        learned = GaussianProcessRegressor(smooth + WhiteKernel(0.05, (1e-8, 2.0))).fit(germ[some], z[some]).kernel_
    process = GaussianProcessRegressor(learned, optimizer=None).fit(germ, z)
    fitted, noise = process.predict(germ), learned.k2.noise_level
    left = (z - fitted) / np.sqrt(np.maximum(noise * np.diag(cho_solve((process.L_, True), np.eye(n))), 1e-6))
    resampled = random.choice(left - left.mean(), (n, DRAWS))
    weights = process.fit(germ, np.column_stack([z, fitted[:, None] + resampled])).alpha_
    rows = np.vstack([scale * learned.k1.k1.constant_value * weights, np.full(1 + DRAWS, mean)]).T
    basis = Kernels(germ, np.broadcast_to(learned.k1.k2.length_scale, germ.shape[1:]).copy())
    return Fit(basis, rows, noise * scale**2)


def fit_surrogate(
    campaign: SurrogateCampaign, design: SurrogateDesign, loads: Float, kind: str = "polynomial", degree: int = DEGREE
) -> Surrogate:
    """Fit a surrogate to the runs of a campaign except those of held-out points, and validate it with these.

    Args:
      campaign: campaign of the runs.
      design: points of the runs.
      loads: (n, L) equivalent loads, from ``surrogate_loads``.
      kind: "polynomial" chaos expansion or "gaussian" process.
      degree: largest degree of the polynomials; a lower one has fewer terms.

    Raises:
      InputError: there are too few points, no such kind or degree, or scikit-learn is not installed.
    """
    if kind not in KINDS:
        raise InputError(f"kind: {did_you_mean(kind, KINDS)}")
    if not 1 <= degree <= DEGREE:
        raise InputError(f"degree {degree}: expected 1 to {DEGREE}")
    train = ~design.check
    germ, least = design.space.germ(design.values[train]), 2 * len(design.space.variables) + 2
    if len(np.unique(design.point[train])) < least:
        raise InputError(f"{len(np.unique(design.point[train]))} points are too few for a fit: expected {least}")
    models = {}
    for i, (name, slope) in enumerate(campaign.loads.items()):
        y = np.log(np.maximum(loads[train, i], 1e-300))
        fitted = polynomial_fit(germ, y, i, degree) if kind == "polynomial" else gaussian_fit(germ, y, i)
        scatter = seed_scatter(design.point[train], y)
        deviation = sqrt(fitted.noise) if scatter is None else scatter
        unit = "N" if "force" in name or name == "rotor_thrust" else "N m"
        model = LoadModel(name, unit, slope, design.space, fitted.basis, fitted.coefficients, deviation, {})
        models[name] = LoadModel(**(vars(model) | {"errors": validation(model, design, loads[:, i])}))
    counts = {"points": len(np.unique(design.point[train])), "runs": int(train.sum())}
    counts |= {"checks": len(np.unique(design.point[~train])), "check_runs": int((~train).sum())}
    facts: dict[str, Any] = {"kind": kind, **counts, "duration": campaign.duration, "f_eq": 1.0}
    turbine = load_turbine(campaign.turbine)
    facts["turbine_hash"] = turbine.content_hash()
    return Surrogate(turbine.name, design.space, models, facts)


def seed_scatter(point: NDArray[np.int64], y: Float) -> float | None:
    """Pooled standard deviation of values over the seeds of their points; None without repeated points (LS-10)."""
    _, place, count = np.unique(point, return_inverse=True, return_counts=True)
    mean = np.bincount(place, y) / count
    freedom = int((count - 1).sum())
    return float(np.sqrt(np.sum((y - mean[place]) ** 2) / freedom)) if freedom else None


def validation(model: LoadModel, design: SurrogateDesign, loads: Float) -> dict[str, float]:
    """Errors at held-out points against the mean over seeds (LS-11): ``r2``, ``nrmse`` (over the mean load), ``bias``
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
    """Points (n, d) where further runs reduce the error of the lifetime loads most (LS-12).

    The errors of a surrogate that is not usable give no such points: the points then fill the space.

    Args:
      surrogate: surrogate of polynomial form.
      n: number of points.
      probability: function of wind speeds (k,) [m/s], proportional to their probability density.
      candidates_per_point: points of a space-filling design for each chosen one.
      seed: seed of the candidates and the choice.
    """
    from meltemi.loads.surrogate.space import space_filling

    space: Space = surrogate.space
    if not surrogate.usable:
        return space.points(space_filling(len(space.variables), n, seed=seed))
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
