"""Why simulations deviate: derivatives by uncertain parameters, and a fit of these on half of the records.

Reference: docs/theory/validation.md (V-21 to V-25).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from meltemi.cases.case import case_controller
from meltemi.control.controller import update_with_derivatives
from meltemi.core.errors import InputError, MeltemiError, did_you_mean
from meltemi.core.threads import available_cores
from meltemi.gradients.sensitivity import Sensitivity, sensitivity
from meltemi.gradients.weights import del_gradient, mean_gradient, std_gradient
from meltemi.loadcases.store import with_model_and_wind
from meltemi.report.tables import number
from meltemi.reports.blocks import Section, Table
from meltemi.simulation.result import Result
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march
from meltemi.validation.comparison import Comparison
from meltemi.validation.measurements import MeasuredRecord
from meltemi.validation.reduction import STATISTICS
from meltemi.validation.report import HEADLINE, agreement_table, headline
from meltemi.validation.settings import Validation
from meltemi.validation.simulations import PATHS, Prepared, Simulator, simulate_records

Float = NDArray[np.float64]
PRIORS = {
    "air_density": 0.01,
    "pitch_offset": np.radians(0.5),
    "yaw_error": np.radians(5.0),
    "lift": 0.03,
    "drag": 0.2,
    "blade_stiffness": 0.05,
    "blade_mass": 0.03,
}
"""Prior standard deviations: angles in rad, others relative. That of ``gauge_gain.CHANNEL`` is 0.03, of
``gauge_zero.CHANNEL`` a tenth of the mean magnitude measured."""
GAUGE_GAIN, GAUGE_ZERO = 0.03, 0.1
YAW_STEP = np.radians(2.0)
"""Of the difference for the yaw error, which no derivative of a run describes: it turns the wind."""
PLACES = [STATISTICS.index(each) for each in HEADLINE]
ZERO = np.array([1.0, 0.0, 0.0])
"""Derivatives of the statistics of the first page by the zero of a gauge."""
LEAST_FREEDOM = 8
"""Degrees of freedom of the covariance of the seeds below which a fit would be certain of anything."""
MOST_STEPS, CONVERGED = 4, 0.05
"""Steps of Gauss and Newton, and the step over the posterior standard deviation at which they end."""


def checked(names: Sequence[str], settings: Validation, compared: Sequence[str]) -> tuple[str, ...]:
    """The names of parameters.

    Raises:
      InputError: one is unknown, or of a gauge of a channel that is not compared.
    """
    known = [*PRIORS, *(f"gauge_{kind}.{name}" for name in compared for kind in ("gain", "zero"))]
    for name in (*names, *settings.priors):
        if name not in known:
            raise InputError(f"no parameter {name!r} to fit: {did_you_mean(name, known)}")
    return tuple(dict.fromkeys(names))


def check_fit(simulator: Simulator, records: Sequence[MeasuredRecord], parameters: Sequence[str]) -> None:
    """Refuse, before the simulations, a fit of parameters that is not possible.

    Raises:
      InputError: there are less than two records, the controller has no derivatives, or records and seeds are too few
        to know how the winds differ.
    """
    if not parameters:
        return
    if len(records) < 2:
        raise InputError("fit: at least two records are needed: one half is fitted, the other one judged")
    if controller := case_controller(simulator.case, simulator.model(None), simulator.folder):
        update_with_derivatives(controller)
    fitted_half = -(-len(records) // 2)
    if (freedom := fitted_half * (simulator.settings.seeds - 1)) < LEAST_FREEDOM:
        raise InputError(
            f"fit: {len(records)} records with {simulator.settings.seeds} seeds do not show how the winds differ: "
            f"half of the records times (seeds - 1) must be at least {LEAST_FREEDOM}, found {freedom}; give --seeds"
        )


def prior(name: str, settings: Validation, comparison: Comparison) -> float:
    """Prior standard deviation of a parameter."""
    if name in settings.priors or name in PRIORS:
        return settings.priors.get(name, PRIORS.get(name, 0.0))
    if name.startswith("gauge_gain."):
        return GAUGE_GAIN
    measured = comparison.values(name.partition(".")[2], "mean")[0]
    return GAUGE_ZERO * float(np.nanmean(np.abs(measured)))


@dataclass(frozen=True)
class Linear:
    """Statistics of one simulation of each record, with their derivatives.

    Attributes:
      values: (R, C, 3) of the statistics of the first page, NaN where a channel is not measured.
      slopes: (R, C, 3, P).
    """

    values: Float
    slopes: Float


def linear(
    simulator: Simulator,
    prepared: Sequence[Prepared],
    channels: Sequence[str],
    parameters: Sequence[str],
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Linear:
    """Statistics of a seed of each record and their derivatives by parameters, at those of the simulator (V-21).

    Raises:
      InputError: the controller has no derivatives, or a run does not reach its end.
    """
    of_model = [name for name in parameters if name in PATHS]
    turn = simulator.parameters.get("yaw_error", 0.0)
    beside = [
        replace(simulator, parameters={**simulator.parameters, "yaw_error": turn + sign * YAW_STEP})
        for sign in (-1.0, 1.0)
        if "yaw_error" in parameters
    ]

    def one(each: Prepared) -> tuple[Float, Float]:
        """Values (C, 3) and slopes (C, 3, P) of a record."""
        values = np.full((len(channels), len(HEADLINE)), np.nan)
        slopes = np.zeros((*values.shape, len(parameters)))
        derived = sensitivity(
            with_model_and_wind(simulator.run(each, 1)), [PATHS[name] for name in of_model or ["pitch_offset"]]
        )
        sides = [of.reduced(each, result_of(with_model_and_wind(of.run(each, 1)))) for of in beside]
        for c, name in enumerate(channels):
            if name not in each.measured.values:
                continue
            gain, zero = (simulator.parameters.get(f"{kind}.{name}", 0.0) for kind in ("gauge_gain", "gauge_zero"))
            x, by = _statistics(derived, name, simulator.settings.transient)
            values[c] = (1.0 + gain) * x + zero * ZERO
            for p, parameter in enumerate(parameters):
                if parameter in of_model:
                    k = of_model.index(parameter)
                    scale = derived.values[k] if parameter == "air_density" else 1.0
                    if parameter != "pitch_offset":  # the run's factor is relative to what is changed already
                        scale /= 1.0 + simulator.parameters.get(parameter, 0.0)
                    slopes[c, :, p] = (1.0 + gain) * scale * by[:, k]
                elif parameter == "yaw_error":
                    low, high = (side.values[name][PLACES] for side in sides)
                    slopes[c, :, p] = (high - low) / (2.0 * YAW_STEP)
                elif parameter.endswith(f".{name}"):
                    slopes[c, :, p] = x if parameter.startswith("gauge_gain") else ZERO
        return values, slopes

    both = []
    with ThreadPoolExecutor(workers or available_cores()) as pool:
        for n, pair in enumerate(pool.map(one, prepared), 1):
            both.append(pair)
            if progress is not None:
                progress(n / len(prepared))
    return Linear(*(np.array(x) for x in zip(*both, strict=True)))


def result_of(run: Run) -> Result:
    """Result of a run that reaches its end.

    Raises:
      RunError: it does not.
    """
    simulation = Simulation(run)
    march(simulation)
    return simulation.result().raise_for_status()


def _statistics(run: Sensitivity, name: str, skip: float) -> tuple[Float, Float]:
    """(3,) statistics of the first page and (3, P) their derivatives."""
    series, slopes = run.series(name, skip=skip)
    duration = float(run.result.time[-1]) - skip
    load = del_gradient(series, slopes, duration=duration, slope=10.0)
    pairs = mean_gradient(series, slopes), std_gradient(series, slopes), load
    return np.array([value for value, _ in pairs]), np.array([by for _, by in pairs])


@dataclass(frozen=True)
class Posterior:
    """Parameters of a fit.

    Attributes:
      parameters: names.
      prior: (P,) standard deviations about zero.
      estimate: (P,) most probable values.
      covariance: (P, P).
      evidence: (P,) change of the logarithm of the evidence by fitting each parameter beside the others.
      misfit: of the fitted records: mean square of the whitened deviations.
      steps: of Gauss and Newton.
    """

    parameters: tuple[str, ...]
    prior: Float
    estimate: Float
    covariance: Float
    evidence: Float
    misfit: float
    steps: int


def posterior(deviation: Float, slopes: Float, prior: Float, at: Float) -> tuple[Float, Float, float]:
    """Most probable parameters of a linear model with normal priors about zero (V-23, V-24).

    Args:
      deviation: (N,) simulated less measured values at ``at``, :func:`whitened`.
      slopes: (N, P) their derivatives.
      prior: (P,) standard deviations.
      at: (P,) parameters.

    Returns:
      Parameters (P,), their covariance (P, P), and the logarithm of the evidence of the whitened data.
    """
    y = deviation - slopes @ at  # deviation of the linear model at zero
    scaled = slopes * prior
    H = np.eye(len(prior)) + scaled.T @ scaled
    x = -np.linalg.solve(H, scaled.T @ y)
    evidence = -0.5 * float(y @ (y + scaled @ x) + np.linalg.slogdet(H)[1] + len(y) * np.log(2.0 * np.pi))
    return prior * x, prior[:, None] * np.linalg.inv(H) * prior, evidence


def data_of(comparison: Comparison, channels: Sequence[str]) -> tuple[Float, Float]:
    """Deviations (R, D) of the means of the seeds, and their covariance (D, D).

    D are the statistics of the first page of all channels. The covariance is that of the seeds, and what the deviations
    scatter more over records (V-22).
    """
    pairs = [(name, statistic) for name in channels for statistic in HEADLINE]
    x, y = (np.stack(each, axis=1) for each in zip(*(comparison.values(*pair) for pair in pairs), strict=True))
    x[:, [name in comparison.range_only and statistic == "mean" for name, statistic in pairs]] = np.nan
    count = np.isfinite(y).sum(axis=2)
    mean = np.where(count, np.nansum(y, axis=2) / np.maximum(count, 1), np.nan)
    rest, freedom = np.nan_to_num(y - mean[:, :, None]), np.maximum(count - 1, 0).sum(axis=0)
    seeds = np.einsum("rik,rjk->ij", rest, rest) / np.maximum(np.sqrt(np.outer(freedom, freedom)), 1.0)
    seeds *= 1.0 + 1.0 / np.maximum(count.max(), 1)  # one seed more is what happened
    shrinkage = len(pairs) / (len(pairs) + freedom.max())
    deviation = mean - x
    there = np.isfinite(deviation)
    n = np.maximum(there.sum(axis=0), 1)
    centred = np.nan_to_num(deviation - np.nansum(deviation, axis=0) / n)
    excess = np.maximum(np.sum(centred**2, axis=0) / np.maximum(n - 1, 1) - np.diag(seeds), 0.0)
    return deviation, (1.0 - shrinkage) * seeds + np.diag(shrinkage * np.diag(seeds) + excess)


def whitened(deviation: Float, slopes: Float, covariance: Float) -> tuple[Float, Float]:
    """Deviations (N,) and derivatives (N, P) of all records as independent ones of variance 1; of what is measured."""
    rows = []
    for y, J in zip(deviation, slopes, strict=True):
        some = np.isfinite(y) & (np.diag(covariance) > 0.0)
        factor = np.linalg.cholesky(covariance[np.ix_(some, some)])
        rows.append(solve_triangular(factor, np.column_stack([y, J])[some], lower=True))
    both = np.concatenate(rows)
    return both[:, 0], both[:, 1:]


def fitted(
    simulator: Simulator,
    prepared: Sequence[Prepared],
    comparison: Comparison,
    parameters: Sequence[str],
    progress: Callable[[float], None] | None = None,
    workers: int | None = None,
) -> Posterior:
    """Fit parameters by steps of Gauss and Newton (V-23).

    Raises:
      InputError: as of :func:`linear`; or nothing of the records depends on the parameters.
    """
    channels, at = list(comparison.channels), np.zeros(len(parameters))
    width = np.array([prior(name, simulator.settings, comparison) for name in parameters])
    deviation, covariance_of_data = data_of(comparison, channels)
    first: Float | None = None
    steps = 0
    while True:
        steps += 1
        now = linear(simulator.at(parameters, at), prepared, channels, parameters, workers, progress)
        first = now.values if first is None else first
        moved = deviation + (now.values - first).reshape(deviation.shape)
        y, J = whitened(moved, now.slopes.reshape(*deviation.shape, -1), covariance_of_data)
        if not np.any(J):
            raise InputError("fit: no compared statistic depends on the parameters")
        before = at
        at, covariance, evidence = posterior(y, J, width, before)
        if steps == MOST_STEPS or np.all(np.abs(at - before) <= CONVERGED * np.sqrt(np.diag(covariance))):
            break
    others = [[k for k in range(len(parameters)) if k != p] for p in range(len(parameters))]
    held = [posterior(y - J[:, p] * before[p], J[:, o], width[o], before[o])[2] for p, o in enumerate(others)]
    left = y + J @ (at - before)
    return Posterior(
        tuple(parameters), width, at, covariance, evidence - np.array(held), float(np.mean(left**2)), steps
    )


def sections(
    simulator: Simulator,
    records: Sequence[MeasuredRecord],
    comparison: Comparison,
    parameters: Sequence[str],
    *,
    why: int = 3,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Iterator[Section]:
    """Sections of a report: sensitivities over ``why`` records; a fit on half of the records, judged on the others."""
    by_name = {each.name: each for each in records}
    measured = [by_name[each.name] for each in comparison.records]

    def prepared(rows: Sequence[int]) -> list[Prepared]:
        return [simulator.prepared(measured[k], comparison.channels) for k in rows]

    if why:
        order = np.argsort([each.wind_speed for each in comparison.records])
        chosen = prepared(order[np.linspace(0, len(order) - 1, min(why, len(order))).round().astype(int)].tolist())
        try:
            yield Section("Why", [why_table(simulator, chosen, comparison, workers, progress)])
        except MeltemiError as error:
            yield Section("Why", [f"No sensitivities: {error}"])
    if parameters:
        half, rest = ([*range(first, len(measured), 2)] for first in (0, 1))
        try:
            found = fitted(simulator, prepared(half), comparison.some(half), parameters, progress, workers)
            judged = [measured[k] for k in rest]
            yield Section("Fit", [*fit_tables(simulator, found, judged, comparison.some(rest), workers)])
        except MeltemiError as error:
            yield Section("Fit", [f"No fit: {error}"])


def why_table(
    simulator: Simulator, prepared: Sequence[Prepared], comparison: Comparison, workers: int | None,
    progress: Callable[[float], None] | None,
) -> Table:  # fmt: skip
    """Change of each statistic by one prior standard deviation of each parameter, in per cent of its magnitude."""
    names = list(PRIORS)
    now = linear(simulator, prepared, comparison.channels, names, workers, progress)
    scale = np.nanmean(np.abs(now.values), axis=0)
    rows = []
    for c, name in enumerate(comparison.channels):
        for s, statistic in enumerate(HEADLINE):
            changes = [prior(p, simulator.settings, comparison) * np.mean(now.slopes[:, c, s, k]) / scale[c, s]
                       for k, p in enumerate(names)]  # fmt: skip
            rows.append([name, statistic, *(number(100.0 * x) for x in changes)])
    head = [f"{p}\n{_shown(p, prior(p, simulator.settings, comparison))}" for p in names]
    caption = (
        f"Change [%] of a statistic by one prior standard deviation of a parameter, mean of {len(prepared)} records"
    )
    return Table(["channel", "statistic", *head], rows, caption, 2)


def _shown(name: str, value: float) -> str:
    if name in ("pitch_offset", "yaw_error"):
        return f"{np.degrees(value):.3g} deg"
    return f"{value:.3g}" if name.startswith("gauge_zero") else f"{100.0 * value:.3g} %"


def fit_tables(
    simulator: Simulator,
    found: Posterior,
    judged: Sequence[MeasuredRecord],
    comparison: Comparison,
    workers: int | None,
) -> Iterator[str | Table]:
    """The posterior, and the judged half before and after."""
    quantile = 1.96
    rows = []
    for p, name in enumerate(found.parameters):
        half = quantile * float(np.sqrt(found.covariance[p, p]))
        values = (_shown(name, found.prior[p]), _shown(name, found.estimate[p]), _shown(name, half))
        rows.append([name, *values, number(found.evidence[p])])
    head = ["parameter", "prior\n+/- one standard deviation", "estimate", "95 %\n+/-", "ln evidence"]
    yield Table(head, rows, f"Posterior after {found.steps} steps; misfit {found.misfit:.2f} per datum")
    yield "A logarithm of the evidence above 3 speaks strongly for a parameter; below 0 the data do not need it."
    yield agreement_table(headline(comparison.agreements(), comparison.channels), "Other half of the records, no fit")
    after = simulator.at(found.parameters, found.estimate)
    records, _ = simulate_records(after, judged, comparison.channels, workers=workers)
    judged_after = replace(comparison, records=tuple(records))
    yield agreement_table(headline(judged_after.agreements(), comparison.channels), "Other half, with the fit")
