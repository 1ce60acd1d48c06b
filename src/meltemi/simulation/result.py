"""Results of a simulation, and how files, tables, notebooks and other packages show them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.display import rounded
from meltemi.core.errors import InputError, RunError, Status
from meltemi.core.shown import Shown, Viewed
from meltemi.core.units import display
from meltemi.simulation.channels import Channel, find

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from meltemi.control.controller import LogEntry
    from meltemi.core.hdf5 import Variable
    from meltemi.core.representation import Card

Float = NDArray[np.float64]
CONVENTIONS = "CF-1.11"
UNITS = {"-": "1"}
"""Units in the spelling of UDUNITS, where it differs: that of the climate and forecast conventions (CF), which pint
and cf-xarray read."""


@dataclass(frozen=True)
class Finding:
    """A violation of the model's range of validity.

    Attributes:
      what: the criterion.
      value: largest value of its quantity in the whole run, SI.
      limit: largest allowed value.
      unit: unit of both.
      time: [s] time of the first violation.
    """

    what: str
    value: float
    limit: float
    unit: str
    time: float

    def __str__(self) -> str:
        unit, factor = display(self.unit, angular_rate_in_degrees=False)
        value, limit = (f"{x * factor:.4g} {unit}" for x in (self.value, self.limit))
        return f"{self.what} {value} (limit {limit}), first at t = {self.time:.2f} s"


@dataclass(frozen=True, repr=False, eq=False)
class Result(Shown, Viewed, Mapping[str, Float]):
    """Time series of the recorded channels in SI units, and the outcome of the run.

    A mapping of names to series, as ``result["root_moment_out_of_plane_1"]`` or ``result["RootMyc1"]``, with the unit
    ``result.channel(name).unit``; ``result["time"]`` is the time, too.

    Attributes:
      time: (T,) [s] instants of the samples.
      data: (T, C) one column per channel, SI.
      channels: the channels of the columns.
      status: outcome of the run.
      message: reason for the end of the run.
      meta: data to repeat the run: version, hashes, options, computer, times; ``warnings``, ``findings``.
      scene: shapes, motion and wind for the three-dimensional view, of runs with ``view=True``.
    """

    time: Float
    data: Float
    channels: tuple[Channel, ...]
    status: Status = Status.OK
    message: str = ""
    meta: dict[str, Any] = field(default_factory=dict)
    scene: Any = field(default=None, repr=False)

    @property
    def names(self) -> list[str]:
        """Names of the channels."""
        return [channel.name for channel in self.channels]

    @property
    def title(self) -> str:
        """Turbine, wind and sea of the run."""
        surroundings = ", ".join(filter(None, (self.meta.get("wind"), self.meta.get("waves"))))
        return ": ".join(filter(None, (self.meta.get("turbine"), surroundings)))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of the run and its controller, such as demands that were at their limits for most of it."""
        return tuple(self.meta.get("warnings", ()))

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Violations of the model's range of validity; the status is then ``DOUBTFUL``, unless the run ended early."""
        return tuple(Finding(**entry) for entry in self.meta.get("findings", ()))

    @property
    def log(self) -> tuple[LogEntry, ...]:
        """Events and the supervisor's transitions, in order of time."""
        from meltemi.control.controller import LogEntry  # imports the compiler

        return tuple(LogEntry(**entry) for entry in self.meta.get("log", ()))

    def channel(self, name: str) -> Channel:
        """The description of a recorded channel; an unknown name raises UnknownNameError with the closest names."""
        return find(name, {channel.name: channel for channel in self.channels})

    def __getitem__(self, name: str) -> Float:
        if name == "time":
            return self.time
        return self.data[:, self.names.index(self.channel(name).name)]

    def __contains__(self, name: object) -> bool:
        lower = str(name).lower()
        return lower == "time" or any(lower == known.lower() for c in self.channels for known in c.names)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.channels)

    def __bool__(self) -> bool:
        return True

    __eq__, __hash__ = object.__eq__, object.__hash__

    def between(self, begin: float, end: float) -> Result:
        """The part of the series from ``begin`` to ``end`` [s], both included; none of it counts as transient."""
        try:
            inside = (self.time >= float(begin - 1e-9)) & (self.time <= float(end + 1e-9))
        except (TypeError, ValueError):
            raise InputError(f"between: expected two numbers [s], found {begin!r} and {end!r}") from None
        meta = {name: value for name, value in self.meta.items() if name != "transient"}
        return Result(self.time[inside], self.data[inside], self.channels, self.status, self.message, meta)

    @property
    def evaluated(self) -> Result:
        """The part after the initial transient, for statistics and equivalent loads.

        Raises:
          InputError: the result has no samples.
        """
        return self.after_transient.require_samples()

    @property
    def after_transient(self) -> Result:
        """The part after the initial transient; it may have no samples."""
        transient = self.meta.get("transient", 0.0)
        return self.between(transient, np.inf) if transient > 0.0 else self

    @property
    def sampled(self) -> bool:
        """Whether there are samples after the initial transient."""
        return len(self.after_transient.time) > 0

    def require_samples(self) -> Result:
        """Return the result, or raise InputError, with the reason for the end of its run, if it has no samples."""
        if not len(self.time):
            why = "" if self.status.complete else f": {self.message or self.status.message}"
            raise InputError(f"the result has no samples, or none after its initial transient{why}")
        return self

    def raise_for_status(self) -> Result:
        """Return the result, or raise an error if the run ended early or is doubtful.

        Raises:
          RunError: with the reason for the end or the violations, and with this result.
        """
        if self.status is not Status.OK:
            raise RunError(self.message or self.status.message, self)
        return self

    def to_xarray(self) -> xr.Dataset:
        """Labelled arrays with units, frames, signs and descriptions.

        Raises:
          MissingPackageError: xarray is not installed.
        """
        from meltemi.core.extras import need

        need("Result.to_xarray", "xarray")
        import xarray as xr

        variables, about = labelled(self)
        return xr.Dataset(variables, attrs=about)

    def to_pandas(self) -> pd.DataFrame:
        """Table of the series over the time [s], in SI units, which ``attrs["units"]`` has by channel.

        Raises:
          MissingPackageError: pandas is not installed.
        """
        from meltemi.core.extras import need

        need("Result.to_pandas", "pandas")
        import pandas as pd

        table = pd.DataFrame(self.data, pd.Index(self.time, name="time"), self.names)
        table.attrs["units"] = {channel.name: channel.unit for channel in self.channels}
        return table

    def statistics(self) -> pd.DataFrame:
        """Mean, standard deviation, minimum and maximum of each channel after the transient, in engineering units.

        Raises:
          InputError: there are no samples.
          MissingPackageError: pandas is not installed.
        """
        from meltemi.core.extras import need

        need("Result.statistics", "pandas")
        import pandas as pd

        columns = ["unit", "mean", "std", "min", "max"]
        rows = [[c.display_unit[0], *numbers] for c, numbers in channel_statistics(self)]
        return pd.DataFrame(rows, pd.Index(self.names, name="channel"), columns)

    def card(self) -> Card:
        """Status, statistics of the channels in engineering units with a line of each, messages, events, origin."""
        from meltemi.core.representation import Card, Fold, badge

        kind = "good" if self.status is Status.OK else "doubtful" if self.status.complete else "bad"
        remarks = [*filter(None, [self.message]), *map(str, self.findings), *self.warnings]
        facts = [("status", badge(self.status.name, kind)), ("time", self.span())]
        for name, unit in (("transient", "s"), ("output_step", "s"), ("controller", ""), ("real_time_factor", "")):
            if self.meta.get(name):
                facts.append((name.replace("_", " "), f"{self.meta[name]} {unit}".strip()))
        rows = _channel_rows(self)
        head = ["channel", "OpenFAST", "unit", "mean", "std", "min", "max", ""]
        after = "after the transient" if self.meta.get("transient") else ""
        sections = [
            *([Fold("Messages", [[words] for words in remarks], [""], open=True)] if remarks else []),
            Fold(f"{len(self.channels)} channels", rows, head, note=after, open=True),
        ]
        if self.log:
            log = [[f"{entry.time:.2f}", entry.source, entry.what, entry.reason] for entry in self.log]
            sections.append(Fold(f"{len(log)} events", log, ["time s", "source", "what", "reason"]))
        origin = [(k.replace("_", " "), str(v)) for k, v in self.meta.items() if isinstance(v, str | int | float)]
        sections.append(Fold("Origin", origin, note=f"meltemi {self.meta.get('meltemi', '')}"))
        return Card("Result", self.title, facts, sections if self.meta else sections[:-1])

    def span(self) -> str:
        """Text with the beginning and end of the series."""
        return f"{self.time[0]:g} to {self.time[-1]:g} s" if len(self.time) else "empty"

    def __repr__(self) -> str:
        why = [self.message] if self.message else [str(finding) for finding in self.findings]
        remarks = "".join(f"; {words}" for words in (*why, *self.warnings))
        return f"<Result: {len(self.channels)} channels, {self.span()}, {self.status.name}{remarks}>"


def labelled(result: Result) -> tuple[dict[str, Variable], dict[str, object]]:
    """Series with units, frames, signs and descriptions, and attributes of the whole, as files and xarray have them."""
    variables: dict[str, Variable] = {}
    variables["time"] = ("time",), result.time, {"units": "s", "long_name": "simulation time", "axis": "T"}
    for channel, series in zip(result.channels, result.data.T, strict=True):
        unit, factor = channel.display_unit
        about = {
            "units": UNITS.get(channel.unit, channel.unit),
            "unit_in_tables": unit,
            "factor_to_tables": factor,
            "long_name": channel.description,
            "frame": channel.frame,
            "positive_direction": channel.sign,
            "openfast_name": channel.alias,
        }
        variables[channel.name] = ("time",), series, about
    return variables, {
        "Conventions": CONVENTIONS,
        "title": result.title or "time series of a wind turbine",
        "source": f"meltemi {result.meta.get('meltemi', '')}".strip(),
        "status": int(result.status),
        "status_name": result.status.name,
        "message": result.message,
        "unit_system": "SI: angles in rad, rotational speeds in rad/s; tables and plots use unit_in_tables",
        "meta": json.dumps(result.meta, default=str),
    }


def channel_statistics(result: Result) -> Iterator[tuple[Channel, tuple[float, float, float, float]]]:
    """Channels with mean, standard deviation, minimum and maximum after the transient, in engineering units.

    Raises:
      InputError: there are no samples.
    """
    for channel, series in zip(result.channels, result.evaluated.data.T, strict=True):
        x = series * channel.display_unit[1]
        yield channel, (float(x.mean()), float(x.std()), float(x.min()), float(x.max()))


def _channel_rows(result: Result) -> list[list[str]]:
    """Names, unit, statistics and line of each channel; of those that a notebook leaves out, names."""
    from meltemi.core.representation import MOST_ROWS, sparkline

    data, rows = result.after_transient.data, []
    for i, channel in enumerate(result.channels[:MOST_ROWS]):
        unit, factor = channel.display_unit
        x = data[:, i] * factor
        numbers = [rounded(float(f(x))) if len(x) else "-" for f in (np.mean, np.std, np.min, np.max)]
        rows.append([channel.name, channel.alias, unit, *numbers, sparkline(x)])
    return rows + [[channel.name] for channel in result.channels[MOST_ROWS:]]
