"""Session of ``meltemi live``: an endless run, and the quantities that its page may change.

Messages of the page are plain values; values of sliders are in the units shown on the page.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import radians
from time import monotonic
from typing import Any

from meltemi.control.controller import Controller
from meltemi.controllers.names import label
from meltemi.controllers.schemes import fitted, make_controller
from meltemi.controllers.specification import (
    BaselineCase,
    FixedCase,
    check_files,
    specification,
    supervised_form,
    uses_flaps,
)
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.threads import one_blas_thread
from meltemi.scene.record import Scene, packed
from meltemi.simulation.bladed.rotor import BladedModel, with_blades
from meltemi.simulation.events import (
    BaseEvent,
    Brake,
    GeneratorFault,
    GridLoss,
    LineLoss,
    PitchRunaway,
    PitchStuck,
    PowerLimit,
    SensorLoss,
    YawRunaway,
    read_events,
)
from meltemi.simulation.model import Model
from meltemi.simulation.plan import model_channels
from meltemi.simulation.rotors import build
from meltemi.turbine.definition import Turbine
from meltemi.view.live_run import SAMPLE, LiveRun, LiveWind, WindState
from meltemi.view.view import PLOTS, Look, View, view_of

LOG = 40
"""Entries of the log that the page shows."""
MOST_PIECE = 40
"""Samples of a piece."""


@dataclass(frozen=True)
class Slider:
    """A quantity that the page can change, in the unit shown on the page."""

    name: str
    label: str
    unit: str
    low: float
    high: float
    step: float


WIND_SLIDERS = (
    Slider("wind_speed", "Wind speed", "m/s", 3.0, 25.0, 0.5),
    Slider("turbulence", "Turbulence intensity", "%", 0.0, 30.0, 1.0),
    Slider("yaw_error", "Yaw error", "deg", -40.0, 40.0, 1.0),
)


@dataclass(frozen=True)
class Choice:
    """A controller in the menu of the page.

    Attributes:
      about: description in one line.
      make: creates the model, with flaps if needed, and the controller (None for the baseline).
      operator: whether the controller follows power limit and requests of the operator.
    """

    about: str
    make: Callable[[], tuple[Model[Any], Controller | None]]
    operator: bool = True


MENU = {
    "baseline": "Collective pitch, no supervision",
    "supervised": "Start, stop, protection, power limit",
    "ipc": "Supervised, individual pitch (1P)",
    "cpfc": "Supervised, individual pitch and flaps",
}
"""Controllers of the page beside the one that it begins with."""


def choices(turbine: Turbine, first: str = "supervised") -> dict[str, Choice]:
    """Controllers of a page by label: those of its menu, and the initial one.

    Schemes run under supervisory control, so that they can start and stop.

    Args:
      first: a name or file of docs/guide/controller-names.md.

    Raises:
      InputError: the name is unknown or the file does not exist.
    """
    plain = build(turbine)

    def choice(name: str, about: str) -> Choice:
        case = specification(name)
        check_files(case)
        if isinstance(case, BaselineCase) and case.scheme is not None:
            case = supervised_form(case) or case

        def make() -> tuple[Model[Any], Controller | None]:
            model = build(fitted(turbine, case)) if uses_flaps(case) else plain
            return model, None if case == BaselineCase() else make_controller(case, model)

        return Choice(about, make, operator=not isinstance(case, BaselineCase | FixedCase))

    named = MENU if label(first) in MENU else MENU | {first: f"From {first}"}
    return {label(name): choice(name, about) for name, about in named.items()}


def faults(model: BladedModel) -> dict[str, tuple[str, BaseEvent]]:
    """Events that the page can start and end, by name, with the text of their button."""
    events: dict[str, tuple[str, BaseEvent]] = {
        "pitch_stuck": ("Blade 1 stuck", PitchStuck(at=0.0, blade=1)),
        "pitch_runaway": ("Blade 1 runs to fine", PitchRunaway(at=0.0, blade=1, rate=-radians(4.0))),
        "grid_loss": ("Grid loss", GridLoss(at=0.0)),
        "generator": ("Generator fault", GeneratorFault(at=0.0)),
        "speed_sensor": ("Speed sensor lost", SensorLoss(at=0.0, sensor="generator_speed")),
        "brake": ("Brake applied", Brake(at=0.0)),
    }
    if model.options.yaw == "driven":
        events["yaw"] = ("Yaw runaway", YawRunaway(at=0.0, rate=radians(0.5)))
    if lines := getattr(model.turbine.platform, "lines", ()):
        events["line"] = (f"Line 1 of {len(lines)} lost", LineLoss(at=0.0, line=1))
    return events


REQUESTS = {"start": "Start", "normal_stop": "Normal stop", "emergency_stop": "Emergency stop"}


class Session:
    """Session of one page.

    Args:
      turbine: turbine with blades.
      controller: a name or file of docs/guide/controller-names.md.
      wind_speed, turbulence: initial wind speed [m/s] and turbulence intensity [-].
      seed: seed of the turbulence.
      sea: periodic sea around the turbine; by default still water, or none.
      tell: callback with a message before work that takes seconds.

    Raises:
      InputError: the turbine has no blades, or a value is outside the range of its slider.
    """

    def __init__(
        self,
        turbine: Turbine,
        controller: str = "supervised",
        *,
        wind_speed: float = 10.0,
        turbulence: float = 0.1,
        seed: int = 1,
        sea: Any = None,
        tell: Callable[[str], None] = lambda line: None,
    ) -> None:
        self.turbine, self.tell, self.number, self.sea = turbine, tell, 0, sea
        self.choices = choices(turbine, controller)
        self.controller = label(controller)
        rated = turbine.rated_power / 1e6
        unit, factor = ("MW", 1e-6) if rated >= 1.0 else ("kW", 1e-3)
        most = round(turbine.rated_power * factor, 3)
        self.power_factor = factor
        power = Slider("power_limit", "Power limit", unit, round(0.2 * most, 3), most, round(most / 50.0, 4))
        self.sliders = {slider.name: slider for slider in (*WIND_SLIDERS, power)}
        self.values = {
            "wind_speed": wind_speed,
            "turbulence": 100.0 * turbulence,
            "yaw_error": 0.0,
            "power_limit": most,
        }
        for name, value in self.values.items():
            self._check(name, value)
        self._models: dict[str, tuple[Model[Any], Controller | None]] = {}
        self.wind = LiveWind(turbine, self.air, seed)
        self.restart()

    @property
    def air(self) -> WindState:
        """Target of the wind from the sliders."""
        v = self.values
        return WindState(v["wind_speed"], v["turbulence"] / 100.0, radians(v["yaw_error"]))

    @one_blas_thread
    def restart(self) -> None:
        """Restart in steady operation at the wind and power limit of the sliders, without faults."""
        choice = self.choices[self.controller]
        if self.controller not in self._models:
            self.tell(f"Preparing controller {self.controller} ...")
            self._models[self.controller] = choice.make()
        model, controller = self._models[self.controller]
        self.wind.air = self.air
        self.wind.fill()
        self.plots, channels = plots(model)
        self.run = LiveRun(model, self.wind, controller, channels, self.sea)
        self.faults = faults(with_blades(model, "live"))
        self.active: set[str] = set()
        self.number += 1
        if self.limited:
            self._limit()

    def _check(self, name: str, value: Any) -> float:
        slider = self.sliders.get(name) if isinstance(name, str) else None
        if slider is None:
            raise InputError(f"live: there is no slider {name!r}; {did_you_mean(str(name), self.sliders)}")
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (number and slider.low <= value <= slider.high):
            raise InputError(
                f"live: {name} must be from {slider.low:g} to {slider.high:g} {slider.unit}, found {value!r}"
            )
        return float(value)

    @property
    def limited(self) -> bool:
        """Whether the operator limits the power."""
        slider = self.sliders["power_limit"]
        return self.choices[self.controller].operator and self.values["power_limit"] < slider.high

    def _limit(self) -> None:
        power = self.values["power_limit"] / self.power_factor
        self.run.simulation.act(PowerLimit(at=0.0, power=power), ended=not self.limited)

    def obey(self, message: Any) -> None:
        """Execute a message of the page; it takes effect from the next piece on.

        Args:
          message: one of ``{"set": name, "value": number}``, ``{"fault": name, "on": bool}``, ``{"request": name}``,
            ``{"controller": name}`` and ``{"reset": true}``.

        Raises:
          InputError: the message is invalid, or the controller does not support it.
        """
        match message:
            case {"set": str(name), "value": value}:
                number = self._check(name, value)
                if name == "power_limit" and not self.choices[self.controller].operator:
                    raise InputError(f"live: controller {self.controller} does not follow a power limit")
                self.values[name] = number
                self.run.target = self.air
                if name == "power_limit":
                    self._limit()
            case {"fault": str(name), "on": bool(on)} if name in self.faults:
                now = self.run.simulation.time
                self.run.simulation.act(self.faults[name][1].replace(at=now), ended=not on)
                (self.active.add if on else self.active.discard)(name)
            case {"request": str(name)} if name in REQUESTS:
                if not self.choices[self.controller].operator:
                    raise InputError(f"live: controller {self.controller} ignores requests of the operator")
                self.run.simulation.act(read_events([{"type": "request", "at": 0.0, "request": name}])[0])
            case {"controller": str(name)} if name in self.choices:
                before, self.controller = self.controller, name
                try:
                    self.restart()
                except Exception:
                    self.controller = before
                    raise
            case {"reset": True}:
                self.restart()
            case _:
                raise InputError(f"live: message not understood: {str(message)[:80]}")

    @one_blas_thread
    def piece(self, seconds: float) -> bytes | None:
        """The next piece of about ``seconds`` seconds in the format of the page; None if the run has ended."""
        scene = self.run.piece(min(max(round(seconds / SAMPLE), 1), MOST_PIECE))
        more = {"run": self.number, "sent": monotonic()}
        return None if scene is None else packed(replace(scene, about=scene.about | more))

    def state(self) -> dict[str, Any]:
        """State of the controls of the page as plain values."""
        run = self.run.simulation
        choice = self.choices[self.controller]
        return {
            "run": self.number,
            "values": dict(self.values),
            "controller": self.controller,
            "operator": choice.operator,
            "faults": sorted(self.active),
            "ended": run.message if run.finished else "",
            "status": run.status.name,
            "warnings": [*run.warnings(), *([run.message] if run.message and not run.finished else [])],
            "log": [[round(e.time, 2), e.source, e.what, e.reason] for e in run.log()[-LOG:]],
        }

    def view(self, theme: str = "", speed: float = 1.0) -> View:
        """The page with the first instant of the run; ``speed`` is simulated over real time."""
        first = self.run.first
        about = first.about | {"plots": self.plots, "run": self.number}
        live = {
            "sliders": [vars(slider) for slider in self.sliders.values()],
            "controllers": [{"name": name, "about": choice.about} for name, choice in self.choices.items()],
            "faults": {name: text for name, (text, _) in self.faults.items()},
            "requests": REQUESTS,
            "state": self.state(),
        }
        note = (
            "Changes of the wind take about 5 s of simulated time; the turbulent field passes faster in a higher wind "
            "and repeats after some 7 km. Nacelle and hub have usual proportions."
        )
        scene = Scene(about, first.arrays)
        return view_of(self.turbine.name, "", [scene], note=note, look=Look(theme, state={"speed": speed}), live=live)


def plots(model: Model[Any]) -> tuple[list[dict[str, Any]], list[tuple[str, float]]]:
    """Plots in the format of the page, and their channels with the factor from SI units."""
    available = model_channels(model)
    plots: list[dict[str, Any]] = []
    columns: list[tuple[str, float]] = []
    large = model.turbine.rated_power >= 1e6
    for title, names in PLOTS.items():
        present = [name for name in names if name in available]
        if not present:
            continue
        unit, factor = available[present[0]].display_unit
        if unit[:1] == "k" and large:
            unit, factor = "M" + unit[1:], 1e-3 * factor
        lines = [{"name": name, "column": len(columns) + i} for i, name in enumerate(present)]
        plots.append({"title": title, "unit": unit, "lines": lines})
        columns += [(name, factor) for name in present]
    return plots, columns
