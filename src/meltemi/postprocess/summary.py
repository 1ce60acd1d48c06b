"""Statistics and equivalent loads of a run without its time series: computed while it runs, in constant memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, Status
from meltemi.core.representation import Card, Fold
from meltemi.core.shown import Shown
from meltemi.postprocess.counting import DEPTH, ChannelState, Tally, add_samples, damage_until_now
from meltemi.postprocess.fatigue import check_equivalent, usual_slope
from meltemi.simulation.channels import Channel, find
from meltemi.simulation.result import Result
from meltemi.simulation.simulate import Simulation
from meltemi.simulation.tables import Clock

Float = NDArray[np.float64]

COLUMNS = ("mean", "std", "min", "max")
KEPT = ("samples", "begin", "total", "squares", "low", "high", "slope")


@dataclass(frozen=True, repr=False)
class Summary(Shown):
    """Statistics of the channels after the initial transient, and damage of the loads, in SI units.

    Attributes:
      channels: (C,) the channels.
      statistics: (C, 4) mean, standard deviation, minimum and maximum; NaN where a channel is not defined.
      slopes: (C,) slopes m of the S-N curves; 0 for channels that are no loads.
      damages: (C,) sums of n S^m of the rainflow cycles, the residue as half cycles.
      samples: number of samples.
      duration: [s] duration of the samples.
      status, message, meta: status, message and data as in a ``Result``.
    """

    channels: tuple[Channel, ...]
    statistics: Float
    slopes: Float
    damages: Float
    samples: int
    duration: float
    status: Status = Status.OK
    message: str = ""
    meta: dict[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"<Summary of {len(self.channels)} channels over {self.duration:g} s, {self.status}>"

    def __getitem__(self, name: str) -> dict[str, float]:
        """Mean, standard deviation, minimum and maximum of a channel; InputError for an unknown name."""
        names = {channel.name: channel for channel in self.channels}
        row = self.statistics[[*names].index(find(name, names).name)]
        return dict(zip(COLUMNS, map(float, row), strict=True))

    def equivalent_loads(self, f_eq: float = 1.0) -> dict[str, float]:
        """Damage-equivalent loads of the load channels, as :func:`meltemi.equivalent_loads` has them.

        Args:
          f_eq: [Hz] frequency of the equivalent load.

        Raises:
          InputError: ``f_eq`` is not positive.
        """
        if self.samples < 2:
            return {}
        check_equivalent(self.duration, 1.0, f_eq)
        return {
            channel.name: float((damage / (f_eq * self.duration)) ** (1.0 / slope))
            for channel, slope, damage in zip(self.channels, self.slopes, self.damages, strict=True)
            if slope > 0.0
        }

    def card(self) -> Card:
        """Statistics and equivalent loads of the channels."""
        loads = self.equivalent_loads()
        rows = [
            [c.name, c.unit, *(f"{x:.4g}" for x in row), f"{loads[c.name]:.4g}" if c.name in loads else ""]
            for c, row in zip(self.channels, self.statistics, strict=True)
        ]
        facts = [("status", self.status.name), ("time", f"{self.duration:g} s"), ("samples", str(self.samples))]
        head = ["channel", "unit", *COLUMNS, "equivalent load"]
        return Card("Summary", str(self.meta.get("case", "")), facts, [Fold("Channels", rows, head, open=True)])


class Counter:
    """Statistics of channels whose series grow.

    Args:
      channels: channels of the first columns of ``output``.
      output: (rows, columns) samples, of which ``clock.row`` are new whenever the counter is called.
      clock: (fields,) array of :class:`Clock`.
      skipped: number of samples of the initial transient.
      wrap: whether angles still grow beyond a revolution.
      slopes: slopes of the S-N curves by channel; for others the usual ones.

    Raises:
      InputError: a name is unknown, or a slope is not positive.
    """

    def __init__(
        self,
        channels: Sequence[Channel],
        output: Float,
        clock: Any,
        *,
        skipped: int = 0,
        wrap: bool = False,
        slopes: Mapping[str, float] | None = None,
    ) -> None:
        names = {channel.name: channel for channel in channels}
        given = {find(name, names).name: m for name, m in (slopes or {}).items()}
        for name, slope in given.items():
            if not slope > 0.0:
                raise InputError(f"slopes: that of {name!r} must be positive, found {slope!r}")
        states = []
        for channel in channels:
            period = 2.0 * np.pi if wrap and channel.wrap else 0.0
            state = ChannelState.of(skipped=float(skipped), period=period)
            state.cycles.slope = given.get(channel.name, usual_slope(channel) or 0.0)
            states.append(state.array)
        points = np.zeros((len(states), DEPTH))
        arrays = {"clock": clock, "output": output, "states": np.array(states), "points": points}
        self.record, self.channels = Tally("floats", arrays), tuple(channels)

    def __call__(self) -> None:
        """Add the new samples."""
        add_samples(self.record)

    def summary(self, about: Result, step: float) -> Summary:
        """Statistics of the samples so far.

        Args:
          about: status, message and origin.
          step: [s] interval between samples.
        """
        states, spare = self.record.states, np.zeros(DEPTH)
        n, begin, total, squares, low, high, slopes = (states[:, ChannelState.index(name)] for name in KEPT)
        shift = total / np.maximum(n, 1.0)
        std = np.sqrt(np.maximum(squares / np.maximum(n, 1.0) - shift * shift, 0.0))
        rows = np.stack([begin + shift, std, low, high], axis=1)
        rows[~np.isfinite(total) | (n == 0.0)] = np.nan
        damages = np.zeros(len(states))
        for k in np.flatnonzero(slopes):
            damages[k] = damage_until_now(ChannelState(states[k]).cycles, self.record.points[k], spare)
        samples, origin = int(n[0]), (about.status, about.message, about.meta)
        return Summary(self.channels, rows, slopes.copy(), damages, samples, max(samples - 1, 0) * step, *origin)


def counted(run: Simulation, slopes: Mapping[str, float] | None = None) -> Counter:
    """Let a run with few ``held_steps`` that has not begun keep its statistics only.

    Raises:
      InputError: as :class:`Counter`.
    """
    transient = np.arange(round(run.transient / run.output_step) + 2) * run.output_step < run.transient - 1e-9
    clock = run.case.clock.array
    run.sink = counter = Counter(
        run.channels, run.loop.output, clock, skipped=int(transient.sum()), wrap=True, slopes=slopes
    )
    return counter


def summary(result: Result, slopes: Mapping[str, float] | None = None) -> Summary:
    """The summary of a result: bit for bit the numbers of a run that keeps no series.

    Args:
      result: result with its series.
      slopes: m of the S-N curves by channel; else 10 for blades, 3 for mooring lines, 4 for others.

    Raises:
      InputError: a name is unknown, or a slope is not positive.
    """
    part = result.evaluated
    clock = Clock(np.zeros(len(Clock), dtype=np.int64))
    clock.row = len(part.time)
    counter = Counter(part.channels, np.ascontiguousarray(part.data), clock.array, slopes=slopes)
    counter()
    step = float(part.time[1] - part.time[0]) if len(part.time) > 1 else 0.0
    return counter.summary(result, float(result.meta.get("output_step", step)))
