"""Differences of two results by channel: means, standard deviations, loads, time series."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from meltemi.core.display import rounded
from meltemi.core.errors import InputError
from meltemi.core.representation import Card, Fold
from meltemi.core.shown import Brief
from meltemi.postprocess.fatigue import damage_equivalent_load, usual_slope
from meltemi.simulation.channels import Channel
from meltemi.simulation.result import Result

Float = NDArray[np.float64]
ROUNDING = 1e-3
"""Tolerance of equal instants over the time step."""


@dataclass(frozen=True)
class ChannelDifference:
    """Differences of a channel between two results, in SI units.

    Attributes:
      channel: channel of the first result.
      mean, std: mean and standard deviation of the first and the second result.
      load: their damage-equivalent loads at 1 Hz, with the usual slope; NaN for channels that are no loads.
      correlation: correlation of the two series; NaN where one is constant.
      distance: root mean square of the difference over the standard deviation of the second; NaN where that is 0.
      worst: largest difference, first minus second, with its sign.
      worst_time: [s] time of the largest difference.
    """

    channel: Channel
    mean: tuple[float, float]
    std: tuple[float, float]
    load: tuple[float, float]
    correlation: float
    distance: float
    worst: float
    worst_time: float

    @property
    def mean_change(self) -> float:
        """Difference of the means over the magnitude of the second or, if larger, its standard deviation."""
        return _over(self.mean[0] - self.mean[1], max(abs(self.mean[1]), self.std[1]))

    @property
    def std_change(self) -> float:
        """Change of the standard deviation relative to the second."""
        return _over(self.std[0] - self.std[1], self.std[1])

    @property
    def load_change(self) -> float:
        """Change of the equivalent load relative to the second."""
        return _over(self.load[0] - self.load[1], self.load[1])


@dataclass(frozen=True, repr=False)
class ResultDifferences(Brief):
    """Two results on their common time.

    Attributes:
      first, second: the results on the same instants, with the compared channels in the same columns.
      channels: differences by channel.
      only_first, only_second: names of channels that the other result does not have.
      notes: adjustments for the comparison.
    """

    first: Result
    second: Result
    channels: tuple[ChannelDifference, ...]
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]
    notes: tuple[str, ...]

    def facts(self) -> dict[str, str]:
        """Number of channels, and adjustments for the comparison."""
        facts = {"channels": str(len(self.channels))}
        for name in ("only_first", "only_second", "notes"):
            if words := getattr(self, name):
                facts[name] = ", ".join(words)
        return facts

    def card(self) -> Card:
        """The channels, the most different one first."""
        head = ["channel", "unit", "mean, second", "change %", "std, second", "change %", "rms / std", "worst", "at s"]
        rows = []
        for d in sorted(self.channels, key=lambda d: -np.nan_to_num(d.distance)):
            unit, factor = d.channel.display_unit
            means = (rounded(factor * d.mean[1]), percent_text(d.mean_change))
            deviations = (rounded(factor * d.std[1]), percent_text(d.std_change))
            worst = (rounded(d.distance), rounded(factor * d.worst), f"{d.worst_time:g}")
            rows.append([d.channel.name, unit, *means, *deviations, *worst])
        return replace(super().card(), sections=[Fold("Differences, the largest first", rows, head, open=True)])

    def of(self, i: int) -> tuple[Float, Float]:
        """Time series (T,) of the compared channel ``i`` in both results."""
        return self.first.data[:, i], self.second.data[:, i]


def compare_results(
    first: Result,
    second: Result,
    channels: Sequence[str] | None = None,
    *,
    begin: float | None = None,
    end: float | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> ResultDifferences:
    """Differences of two results; the second is the reference.

    They are compared over the time that both cover, at the instants of the one with the longer time step, onto which
    the other is interpolated linearly.

    Args:
      first: a result, of a run or of a file (``read_result``).
      second: the reference, likewise.
      channels: channels by any of their names; ``"node_6_alpha_1=B1N1Alpha"`` pairs channels of different names. By
        default all common channels except revolving angles.
      begin: [s] begin of the compared part; by default that of the common time.
      end: [s] end of the compared part; by default that of the common time.
      progress: callback with the completed fraction.

    Raises:
      InputError: the results have no common time or no common channel, or a name is unknown.
    """
    pairs = _named_pairs(first, second, channels) if channels else _common(first, second)
    time, notes = _common_time(first, second, begin, end)
    a, b = (_at(r, [pair[i] for pair in pairs], time) for i, r in enumerate((first, second)))
    differences = []
    for i, channel in enumerate(a.channels):
        differences.append(_difference(channel, time, a.data[:, i], b.data[:, i]))
        progress((i + 1) / len(pairs))
    return ResultDifferences(
        a,
        b,
        channels=tuple(differences),
        only_first=_others(first, [c for c, _ in pairs], channels),
        only_second=_others(second, [c for _, c in pairs], channels),
        notes=notes,
    )


def _common(first: Result, second: Result) -> list[tuple[Channel, Channel]]:
    names = {c.name: c for c in second.channels}
    pairs = [(c, names[c.name]) for c in first.channels if c.name in names and not c.wrap and c.unit != "s"]
    if not pairs:
        raise InputError(
            f"no channel is in both: the first has {_some(first)}, the second {_some(second)}; "
            "pair channels of different names by name=other"
        )
    return pairs


def _some(result: Result) -> str:
    names = result.names
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "") if names else "none"


def _named_pairs(first: Result, second: Result, wanted: Sequence[str]) -> list[tuple[Channel, Channel]]:
    pairs = []
    for text in wanted:
        name, _, other = (part.strip() for part in text.partition("="))
        pair = _channel(first, name, "first"), _channel(second, other or name, "second")
        if pair[0].unit != pair[1].unit:
            raise InputError(f"{text}: the units differ: {pair[0].unit} and {pair[1].unit}")
        pairs.append(pair)
    return pairs


def _channel(result: Result, name: str, which: str) -> Channel:
    try:
        return result.channel(name)
    except InputError as error:
        raise InputError(f"{which} result: {error}") from None


def _others(result: Result, used: list[Channel], wanted: Sequence[str] | None) -> tuple[str, ...]:
    """Channels that only one result has; empty if channels are named."""
    return () if wanted else tuple(c.name for c in result.channels if c not in used and not c.wrap and c.unit != "s")


def _common_time(
    first: Result, second: Result, begin: float | None, end: float | None
) -> tuple[Float, tuple[str, ...]]:
    for result, which in ((first, "first"), (second, "second")):
        if len(result.time) < 2:
            raise InputError(f"the {which} result has {len(result.time)} instants: there is nothing to compare")
    steps = [float(np.median(np.diff(r.time))) for r in (first, second)]
    spans = [(float(r.time[0]), float(r.time[-1])) for r in (first, second)]
    low = max(spans[0][0], spans[1][0], -np.inf if begin is None else begin)
    high = min(spans[0][1], spans[1][1], np.inf if end is None else end)
    coarse = first if steps[0] > steps[1] else second
    margin = ROUNDING * max(steps)
    time = coarse.time[(coarse.time >= low - margin) & (coarse.time <= high + margin)]
    if len(time) < 2:
        requested = "" if begin is None and end is None else f", asked for {low:g} to {high:g} s"
        both = " and ".join(f"{a:g} to {b:g} s" for a, b in spans)
        raise InputError(f"no time in common: the results cover {both}{requested}")
    notes = []
    if max(abs(spans[0][i] - spans[1][i]) for i in (0, 1)) > margin:
        notes.append("they cover " + " and ".join(f"{a:g} to {b:g} s" for a, b in spans))
    if abs(steps[0] - steps[1]) > margin:
        finer, step = ("second", steps[0]) if coarse is first else ("first", steps[1])
        notes.append(f"the {finer} is interpolated onto the time step of the other, {step:g} s")
    return time, (*notes, f"compared from {time[0]:g} to {time[-1]:g} s")


def _at(result: Result, channels: list[Channel], time: Float) -> Result:
    """The channels of a result, interpolated to other times."""
    columns = [_interpolated(time, result.time, result[c.name], c.wrap) for c in channels]
    return Result(time, np.stack(columns, axis=1), tuple(channels), result.status, result.message, result.meta)


def _interpolated(time: Float, known: Float, x: Float, wrap: bool) -> Float:
    if wrap:
        x = np.unwrap(x)
    values: Float = np.interp(time, known, x)
    return values % (2.0 * np.pi) if wrap else values


def gaps(channel: Channel, x: Float, y: Float) -> Float:
    """Difference x - y; for angles along the shorter arc."""
    return (x - y + np.pi) % (2.0 * np.pi) - np.pi if channel.wrap else x - y


def _difference(channel: Channel, time: Float, x: Float, y: Float) -> ChannelDifference:
    difference = gaps(channel, x, y)
    slope = usual_slope(channel)
    finite = bool(np.all(np.isfinite(x)) and np.all(np.isfinite(y)))

    def load(series: Float) -> float:
        if slope is None or not finite:
            return np.nan
        return damage_equivalent_load(series, duration=float(time[-1] - time[0]), slope=slope)

    std = _scatter(x), _scatter(y)
    size = np.where(np.isfinite(difference), np.abs(difference), np.inf)
    at = int(np.argmax(size))
    correlation = np.nan
    if finite and min(std) > 0.0:
        correlation = float(np.mean((x - x.mean()) * (y - y.mean())) / (std[0] * std[1]))
    with np.errstate(invalid="ignore"):
        rms = float(np.sqrt(np.mean(difference**2)))
        mean = float(x.mean()), float(y.mean())
    loads = load(x), load(y)
    return ChannelDifference(
        channel, mean, std, loads, correlation, _over(rms, std[1]), float(difference[at]), float(time[at])
    )


def _scatter(x: Float) -> float:
    """Standard deviation, exactly 0 for a constant."""
    with np.errstate(invalid="ignore"):
        return float(x.std()) if np.ptp(x) != 0.0 else 0.0


def percent_text(change: float) -> str:
    """A relative change in percent, or ``-`` where it has no value."""
    return "-" if np.isnan(change) else f"{100.0 * change:+.2f}"


def _over(value: float, size: float) -> float:
    return value / size if size > 0.0 else (0.0 if value == 0.0 else np.nan)


def most_different(differences: ResultDifferences, n: int) -> list[ChannelDifference]:
    """The ``n`` channels with the largest difference relative to their standard deviation, largest first."""
    known = [d for d in differences.channels if np.isfinite(d.distance)]
    return sorted(known, key=lambda d: -d.distance)[:n]
