"""The record of one simulation."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import TYPE_CHECKING, Any

from meltemi.control.controller import Controller
from meltemi.environment.grid import PowerGrid
from meltemi.simulation.channels import DEFAULT
from meltemi.simulation.model import Model, Stations
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.parts import Part
from meltemi.simulation.start import Start
from meltemi.wind.fields import Wind
from meltemi.wind.turbulent import AnyWind

if TYPE_CHECKING:
    from meltemi.environment import Sea
    from meltemi.simulation.events import BaseEvent


@dataclass(frozen=True)
class Run:
    """The record of one simulation: a model in a wind, under control, for a duration.

    These are the arguments of :func:`meltemi.simulate`. A batch is a list of such records; stepping and derivatives
    take one.

    Attributes:
      model: model from ``build``, or a function without arguments that returns it when the run is prepared.
      wind: speed [m/s] of steady wind, or a wind: steady, a series, a turbulent wind, whose field is generated for the
        run, or such a field; or a function without arguments that returns it when the run is prepared. Many runs may
        share one ``WindBox``.
      duration: [s] simulated time.
      controller: by default the baseline controller with the turbine's settings; or a function of the wind that
        returns it.
      channels: names of the recorded channels, meltemi's or OpenFAST's; ``"all"`` among them records every channel,
        and ``*`` stands for any text, as in ``"member_*"``.
      output_step: [s] between output samples; a multiple of the time step.
      start: operating point or initial conditions; conditions that name no coordinates begin in
        equilibrium; or a function without arguments that returns it when the run is prepared. By default the steady
        operating point for the wind.
      stations: additional stations of section loads.
      events: faults, grid losses and requests, as records or as keys and values:
        ``[{"at": 60.0, "type": "pitch_stuck", "blade": 2}]``.
      grid: voltage, frequency, reactive power, and power reference, which needs a controller that follows it; by
        default a stiff grid that takes all power.
      sea: the sea around the support of the turbine, or a part that acts on it; by default still water.
      other_wind: a part that adds to the wind, such as the wakes of other turbines.
      origin: (x, y) [m] position of the turbine in the axes of the wind.
      transient: [s] initial transient, recorded, but excluded from statistics and equivalent loads.
      view: record the motion for the three-dimensional view (``meltemi view``), in ``result.scene``.
      partial: return the result of a run that ends early instead of raising; for ``simulate``: a batch reports it.
      name: name of the run in a batch, for messages and files; by default ``case_0001`` and so on.
      progress: callback with the completed fraction.
    """

    model: Model[Any] | Callable[[], Model[Any]]
    wind: float | AnyWind | Callable[[], AnyWind]
    _: KW_ONLY
    duration: float
    controller: Controller | Callable[[Wind], Controller] | None = None
    channels: Sequence[str] = tuple(DEFAULT)
    output_step: float = 0.05
    start: OperatingPoint | Start | Callable[[], OperatingPoint | Start | None] | None = None
    stations: Stations | None = None
    events: Iterable[BaseEvent | Mapping[str, Any]] = ()
    grid: PowerGrid | None = None
    sea: Sea | Part | None = None
    other_wind: Part | None = None
    origin: tuple[float, float] = (0.0, 0.0)
    transient: float = 0.0
    view: bool = False
    partial: bool = False
    name: str = ""
    progress: Callable[[float], None] | None = field(default=None, repr=False, compare=False)
