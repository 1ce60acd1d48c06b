"""Why simulations deviate: derivatives by uncertain parameters, and a fit of these on half of the records.

Reference: docs/theory/validation.md (V-21 to V-26).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.linalg import solve_triangular

from meltemi.cases.case import case_controller
from meltemi.control.controller import update_with_derivatives
from meltemi.core.errors import InputError, MeltemiError, did_you_mean
from meltemi.gradients.sensitivity import sensitivity
from meltemi.loadcases.batch import Piece
from meltemi.report.tables import number
from meltemi.reports.blocks import Section, Table
from meltemi.simulation.simulate import simulate
from meltemi.tuning.run_store import completed, resumed
from meltemi.validation.comparison import CONFIDENCE, Comparison
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
EVIDENCE = "A logarithm of the evidence above 3 speaks strongly for a parameter; below 0 the data do not need it."


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
    kind, _, channel = name.partition(".")
    if kind == "gauge_zero" and name not in settings.priors:
        return GAUGE_ZERO * float(np.nanmean(np.abs(comparison.values(channel, "mean")[0])))
    return settings.priors.get(name, PRIORS.get(name, GAUGE_GAIN))


class Linear(NamedTuple):
    """Statistics of the first page of one simulation of each record, with their derivatives by parameters."""

    values: Float  # (R, C, 3), NaN where a channel is not measured
    slopes: Float  # (R, C, 3, P)


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
      RunError: the controller has no derivatives, or a run does not reach its end.
    """
    changed, skip = simulator.parameters, simulator.settings.transient
    of_model = [name for name in parameters if name in PATHS]
    turned = [
        replace(simulator, parameters={**changed, "yaw_error": changed.get("yaw_error", 0.0) + step})
        for step in (-YAW_STEP, YAW_STEP)
        if "yaw_error" in parameters
    ]

    def one(each: Prepared) -> tuple[Float, Float]:
        """Values (C, 3) and slopes (C, 3, P) of a record."""
        values = np.full((len(channels), len(HEADLINE)), np.nan)
        slopes = np.zeros((*values.shape, len(parameters)))
        run = sensitivity(simulator.run(each, 1), [PATHS[name] for name in of_model or ["pitch_offset"]])
        # a factor of the run is relative to what is changed already
        unit = [1.0 if name == "pitch_offset" else value / (1.0 + changed.get(name, 0.0))
                for name, value in zip(of_model, run.values, strict=False)]  # fmt: skip
        sides = [side.reduced(each, simulate(**vars(side.run(each, 1)))).values for side in turned]
        for c, name in enumerate(channels):
            if name not in each.measured.values:
                continue
            pairs = run.mean(name, skip=skip), run.std(name, skip=skip), run.fatigue(name, 10.0, skip=skip)
            x, by = (np.array(each) for each in zip(*pairs, strict=True))
            gain, zero = simulator.gauge(name)
            values[c] = gain * x + zero * ZERO
            known = {f"gauge_gain.{name}": x, f"gauge_zero.{name}": ZERO}
            known |= {parameter: gain * unit[k] * by[:, k] for k, parameter in enumerate(of_model)}
            if sides:
                low, high = (side[name][PLACES] for side in sides)
                known["yaw_error"] = (high - low) / (2.0 * YAW_STEP)
            slopes[c] = np.stack([known.get(parameter, 0.0 * ZERO) for parameter in parameters], axis=-1)
        return values, slopes

    pieces = [Piece(f"sensitivities, {each.record.name}", partial(one, each)) for each in prepared]
    done = completed(resumed(pieces, workers=workers, progress=progress))
    return Linear(*(np.array(each) for each in zip(*done, strict=True)))


@dataclass(frozen=True)
class Posterior:
    """Parameters of a fit."""

    parameters: tuple[str, ...]
    prior: Float  # (P,) standard deviations about zero
    estimate: Float  # (P,) most probable values
    covariance: Float  # (P, P)
    misfit: float  # of the fitted records: mean square of the whitened deviations
    steps: int  # of Gauss and Newton
    freedom: int  # degrees of freedom of the covariance of the data

    @property
    def evidence(self) -> Float:
        """(P,) change of the logarithm of the evidence by fitting each parameter beside the others (V-25)."""
        variance = np.diag(self.covariance)
        return np.asarray(0.5 * (self.estimate**2 / variance - np.log(self.prior**2 / variance)))

    @property
    def half(self) -> Float:
        """(P,) half-widths of the intervals of 95 % (V-26)."""
        C, variance = self.covariance, np.diag(self.covariance)
        by_data = 1.0 - np.sum(C**2 / self.prior**2, axis=1) / variance
        quantile = stats.t.ppf(0.5 + 0.5 * CONFIDENCE, self.freedom / by_data**2)
        return np.asarray(quantile * np.sqrt(variance))


def posterior(deviation: Float, slopes: Float, prior: Float, at: Float) -> tuple[Float, Float]:
    """Most probable parameters (P,) of a linear model with normal priors about zero, and their covariance (V-23).

    Args:
      deviation: (N,) simulated less measured values at ``at``, :func:`whitened`.
      slopes: (N, P) their derivatives.
      prior: (P,) standard deviations.
      at: (P,) parameters.
    """
    scaled = slopes * prior
    covariance = prior[:, None] * np.linalg.inv(np.eye(len(prior)) + scaled.T @ scaled) * prior
    return -covariance @ slopes.T @ (deviation - slopes @ at), covariance


def data_of(comparison: Comparison, channels: Sequence[str]) -> tuple[Float, Float, int]:
    """Deviations (R, D) of the means of the seeds, their covariance (D, D), and its degrees of freedom.

    D are the statistics of the first page of all channels. The covariance is that of the seeds, and what the deviations
    scatter more over records (V-22).
    """
    pairs = [(name, statistic) for name in channels for statistic in HEADLINE]
    values = zip(*(comparison.values(*pair) for pair in pairs), strict=True)
    x, y = (np.ma.masked_invalid(np.stack(each, axis=1)) for each in values)
    x[:, [name in comparison.range_only and statistic == "mean" for name, statistic in pairs]] = np.ma.masked
    mean, freedom = y.mean(axis=2), (y.count(axis=2) - 1).clip(0).sum(axis=0)
    rest = (y - mean[:, :, None]).filled(0.0)
    seeds = np.einsum("rik,rjk->ij", rest, rest) / np.sqrt(np.outer(freedom, freedom)).clip(1.0)
    seeds *= 1.0 + 1.0 / max(y.count(axis=2).max(), 1)  # one seed more is what happened
    shrinkage = len(pairs) / (len(pairs) + freedom.max())
    deviation = mean - x
    excess = (deviation.var(axis=0, ddof=1).filled(0.0) - np.diag(seeds)).clip(0.0)
    covariance = (1.0 - shrinkage) * seeds + np.diag(shrinkage * np.diag(seeds) + excess)
    return deviation.filled(np.nan), covariance, int(freedom.max())


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
    at = np.zeros(len(parameters))
    width = np.array([prior(name, simulator.settings, comparison) for name in parameters])
    deviation, covariance_of_data, freedom = data_of(comparison, comparison.channels)
    first: Float | None = None
    steps = 0
    while True:
        steps += 1
        now = linear(simulator.at(parameters, at), prepared, comparison.channels, parameters, workers, progress)
        first = now.values if first is None else first
        moved = deviation + (now.values - first).reshape(deviation.shape)
        y, J = whitened(moved, now.slopes.reshape(*deviation.shape, -1), covariance_of_data)
        if not np.any(J):
            raise InputError("fit: no compared statistic depends on the parameters")
        before, (at, covariance) = at, posterior(y, J, width, at)
        if steps == MOST_STEPS or np.all(np.abs(at - before) <= CONVERGED * np.sqrt(np.diag(covariance))):
            misfit = float(np.mean((y + J @ (at - before)) ** 2))
            return Posterior(tuple(parameters), width, at, covariance, misfit, steps, freedom)


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
        chosen = order[np.linspace(0, len(order) - 1, min(why, len(order))).round().astype(int)]
        try:
            now = linear(simulator, prepared(chosen.tolist()), comparison.channels, list(PRIORS), workers, progress)
            yield Section("Why", [why_table(now, simulator.settings, comparison)])
        except MeltemiError as error:
            yield Section("Why", [f"No sensitivities: {error}"])
    if parameters:
        half, rest = ([*range(first, len(measured), 2)] for first in (0, 1))
        before = comparison.some(rest)
        try:
            found = fitted(simulator, prepared(half), comparison.some(half), parameters, progress, workers)
            changed = simulator.at(found.parameters, found.estimate)
            judged, _ = simulate_records(changed, [measured[k] for k in rest], before.channels, workers=workers)
            after = replace(before, records=tuple(judged))
            tables = [
                agreement_table(headline(each.agreements(), each.channels), f"Other half of the records, {how} fit")
                for each, how in ((before, "no"), (after, "with the"))
            ]
            yield Section("Fit", [posterior_table(found), EVIDENCE, *tables])
        except MeltemiError as error:
            yield Section("Fit", [f"No fit: {error}"])


def why_table(now: Linear, settings: Validation, comparison: Comparison) -> Table:
    """Change of each statistic by one prior standard deviation of each parameter, in per cent of its magnitude."""
    width = {name: prior(name, settings, comparison) for name in PRIORS}
    scale = np.nanmean(np.abs(now.values), axis=0)[..., None]
    changes = 100.0 * now.slopes.mean(axis=0) * [*width.values()] / scale
    rows = [
        [name, statistic, *map(number, changes[c, s])]
        for c, name in enumerate(comparison.channels)
        for s, statistic in enumerate(HEADLINE)
    ]
    head = ["channel", "statistic", *(f"{name}\n{_shown(name, x)}" for name, x in width.items())]
    what = (
        f"Change [%] of a statistic by one prior standard deviation of a parameter, mean of {len(now.values)} records"
    )
    return Table(head, rows, what, 2)


def posterior_table(found: Posterior) -> Table:
    """Parameters with prior, estimate, interval and evidence."""
    columns = found.prior, found.estimate, found.half
    rows = [
        [name, *(_shown(name, x) for x in values), number(evidence)]
        for name, *values, evidence in zip(found.parameters, *columns, found.evidence, strict=True)
    ]
    head = ["parameter", "prior\n+/- one standard deviation", "estimate", "95 %\n+/-", "ln evidence"]
    return Table(head, rows, f"Posterior after {found.steps} steps; misfit {found.misfit:.2f} per datum")


def _shown(name: str, value: float) -> str:
    if name in ("pitch_offset", "yaw_error"):
        return f"{np.degrees(value):.3g} deg"
    return f"{value:.3g}" if name.startswith("gauge_zero") else f"{100.0 * value:.3g} %"
