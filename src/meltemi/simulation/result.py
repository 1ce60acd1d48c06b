"""What a simulation gives back."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import RunError, Status
from meltemi.core.units import display
from meltemi.simulation.channels import Channel, find

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from meltemi.control.controller import LogEntry

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Finding:
    """Where a run left what the model is made for.

    Attributes:
      what: the criterion, in words.
      value: the largest value of its quantity in the whole run, SI.
      limit: that it should not exceed.
      unit: of both.
      time: [s] at which it exceeded it first.
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


@dataclass(frozen=True)
class Result:
    """Time series of the recorded channels, in SI, and how the run went.

    ``result["root_moment_out_of_plane_1"]`` or ``result["RootMyc1"]`` gives a series; its unit stands in
    ``result.channel(name).unit``.

    Attributes:
      time: (T,) [s].
      data: (T, C) one column a channel, SI.
      channels: what the columns are.
      status: how the run ended.
      message: why it ended, in words.
      meta: everything needed to repeat the run: version, hashes, options, machine, times; ``warnings``, ``findings``.
    """

    time: Float
    data: Float
    channels: tuple[Channel, ...]
    status: Status = Status.OK
    message: str = ""
    meta: dict[str, Any] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Names of the channels."""
        return [channel.name for channel in self.channels]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What its controller has to say about a run, such as demands that were at their limits for most of it."""
        return tuple(self.meta.get("warnings", ()))

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Where the run left what the model is made for; then its status is ``DOUBTFUL``, unless it ended early."""
        return tuple(Finding(**entry) for entry in self.meta.get("findings", ()))

    @property
    def log(self) -> tuple[LogEntry, ...]:
        """What happened in the run: events and the supervisor's transitions, by time."""
        from meltemi.control.controller import LogEntry  # brings the compiler along

        return tuple(LogEntry(**entry) for entry in self.meta.get("log", ()))

    def channel(self, name: str) -> Channel:
        """The description of a recorded channel; unknown names are answered with the closest ones."""
        return find(name, {channel.name: channel for channel in self.channels})

    def __getitem__(self, name: str) -> Float:
        return self.data[:, self.names.index(self.channel(name).name)]

    def __contains__(self, name: str) -> bool:
        return any(name.lower() == known.lower() for c in self.channels for known in c.names)

    def between(self, begin: float, end: float) -> Result:
        """The part of the series from ``begin`` to ``end`` [s], both included; all of it is judged."""
        inside = (self.time >= begin - 1e-9) & (self.time <= end + 1e-9)
        meta = {name: value for name, value in self.meta.items() if name != "transient"}
        return Result(self.time[inside], self.data[inside], self.channels, self.status, self.message, meta)

    @property
    def evaluated(self) -> Result:
        """The part after the transient: what statistics and equivalent loads are made of."""
        transient = self.meta.get("transient", 0.0)
        return self.between(transient, np.inf) if transient > 0.0 else self

    def raise_for_status(self) -> Result:
        """The result itself, or an error if the run did not reach its end or is doubtful.

        Raises:
          RunError: with the reason.
        """
        if self.status is not Status.OK:
            raise RunError(self.message or self.status.message)
        return self

    def to_xarray(self) -> xr.Dataset:
        """Labelled arrays with units, frames, signs and descriptions."""
        import json

        import xarray as xr

        variables: dict[str, Any] = {}
        for i, c in enumerate(self.channels):
            attributes = {
                "units": c.unit,
                "unit_in_tables": c.display_unit[0],
                "factor_to_tables": c.display_unit[1],
                "long_name": c.description,
                "frame": c.frame,
                "positive_direction": c.sign,
                "openfast_name": c.alias,
            }
            variables[c.name] = ("time", self.data[:, i], attributes)
        coordinates = {"time": ("time", self.time, {"units": "s", "long_name": "simulation time"})}
        about: dict[str, Any] = {
            "status": int(self.status),
            "status_name": self.status.name,
            "message": self.message,
            "units": "SI: angles in rad, speeds of rotation in rad/s; tables and plots show unit_in_tables",
            "meta": json.dumps(self.meta, default=str),
        }
        return xr.Dataset(variables, coordinates, about)

    def statistics(self) -> pd.DataFrame:
        """Mean, standard deviation, minimum and maximum of every channel after the transient, in units for people."""
        import pandas as pd

        rows, data = [], self.evaluated.data
        for i, c in enumerate(self.channels):
            unit, factor = c.display_unit
            x = data[:, i] * factor
            some = len(x) > 0
            rows.append(
                {
                    "channel": c.name,
                    "unit": unit,
                    "mean": x.mean() if some else np.nan,
                    "std": x.std() if some else np.nan,
                    "min": x.min() if some else np.nan,
                    "max": x.max() if some else np.nan,
                }
            )
        return pd.DataFrame(rows).set_index("channel")

    def _repr_html_(self) -> str:
        from html import escape

        return f"<p>{escape(repr(self))}</p>{self.statistics().to_html(float_format=lambda v: f'{v:.4g}')}"

    def __repr__(self) -> str:
        span = f"{self.time[0]:g} to {self.time[-1]:g} s" if len(self.time) else "empty"
        said = "".join(f"; {words}" for words in (*self.findings, *self.warnings))
        return f"<Result: {len(self.channels)} channels, {span}, {self.status.name}{said}>"
