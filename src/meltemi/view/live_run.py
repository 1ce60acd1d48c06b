"""Endless run of ``meltemi live`` whose wind, events and limits can be changed while it runs.

The wind is a periodic turbulent field of unit intensity. Mean speed, intensity and direction follow their targets with
a time constant of :data:`LAG`; the eddies keep their size in space and pass faster or slower (frozen turbulence).

Reference: docs/guide/live.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import View
from meltemi.control.controller import Controller
from meltemi.scene.air import sampled
from meltemi.scene.motion import WIND_RATE
from meltemi.scene.record import Scene, track_arrays
from meltemi.simulation.model import Model
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation
from meltemi.turbine.power_turbine import AnyTurbine
from meltemi.turbulence.field import generate_field
from meltemi.view.sea_surface import surfaced
from meltemi.wind.fields import WindBox
from meltemi.wind.turbulent import TurbulentWind
from meltemi.wind.velocity import WindField, WindParameters

if TYPE_CHECKING:
    from meltemi.sea.conditions import Sea

LAG = 5.0
"""[s] time constant of changes of the wind."""
PERIOD, MADE_AT, MADE_WITH, POINTS, PLANE_STEP = 600.0, 12.0, 0.1, 15, 0.2
"""Period [s] and wind speed [m/s] of the turbulent field, its intensity, points across, and plane interval [s]."""
SEA_PERIOD = 600.0
"""[s] after which a sea repeats."""
SAMPLE, LONGEST = 0.05, 2.0
"""[s] interval between samples, and length of the longest piece."""


@dataclass(frozen=True)
class WindState:
    """State of the wind, or its target.

    Attributes:
      speed: [m/s] mean wind speed at hub height.
      intensity: turbulence intensity [-].
      direction: [rad] wind direction, clockwise from above: the yaw error of a fixed nacelle.
    """

    speed: float
    intensity: float
    direction: float = 0.0

    def towards(self, target: WindState, time: float) -> WindState:
        """The state after a time [s] with a first-order lag towards a target."""
        share = -math.expm1(-time / LAG)
        pairs = ((now, getattr(target, name)) for name, now in vars(self).items())
        return WindState(*(b if abs(b - a) < 1e-6 else a + share * (b - a) for a, b in pairs))


class LiveWind:
    """A periodic turbulent field whose mean speed, intensity and direction may change.

    Attributes:
      box: present field; its arrays are updated in place.
    """

    def __init__(self, turbine: AnyTurbine, air: WindState, seed: int = 1) -> None:
        unit_wind = TurbulentWind(
            speed=MADE_AT, intensity=MADE_WITH, seed=seed, periodic=True, points=POINTS, dt=PLANE_STEP
        )
        field = generate_field(unit_wind, turbine, PERIOD)
        self._mean = field.velocity.mean(axis=(0, 2), keepdims=True, dtype=np.float64).astype(np.float32) / MADE_AT
        self._unit = (field.velocity - MADE_AT * self._mean) / np.float32(MADE_WITH * MADE_AT)
        self._spacing, self.air = field.dt * field.speed, air
        self.box = field
        self.fill()

    def fill(self) -> None:
        """Update the velocities of the field in place for the present mean speed and intensity."""
        np.multiply(self._unit, np.float32(self.air.intensity * self.air.speed), out=self.box.velocity)
        self.box.velocity[...] += np.float32(self.air.speed) * self._mean

    def begin(self) -> WindBox:
        """The field for a run that starts in the present wind."""
        speed, old = self.air.speed, self.box
        self.box = WindBox(
            velocity=old.velocity,
            dt=self._spacing / speed,
            dy=old.dy,
            dz=old.dz,
            bottom=old.bottom,
            speed=speed,
            hub_height=old.hub_height,
            periodic=True,
            direction=self.air.direction,
            source=f"live wind {speed:g} m/s",
        )
        return self.box

    def change(self, air: WindState, t: float, parameters: NDArray[np.float64]) -> None:
        """Change the wind of a run at time ``t`` [s] without a jump of the position in the field."""
        if air == self.air:
            return
        refill = (air.speed, air.intensity) != (self.air.speed, self.air.intensity)
        now = View(WindParameters, parameters)
        # the plane at the tower is (t speed + first plane) / spacing
        now["box_x"] += t * (now["box_speed"] - air.speed)
        now["box_speed"], now["box_dt"], now["box_direction"] = air.speed, self._spacing / air.speed, air.direction
        self.air = air
        if refill:
            self.fill()


class LiveRun:
    """A run in pieces, each of which is a scene with the channels of the plots.

    Args:
      model: model of a turbine with blades.
      wind: initial wind.
      controller: by default the baseline controller.
      channels: channels of the plots, each with the factor from SI units.
      sea: periodic sea around the turbine.

    Attributes:
      target: target of the wind.
      simulation: the run; its ``act`` triggers events.
    """

    def __init__(
        self,
        model: Model[Any],
        wind: LiveWind,
        controller: Controller | None = None,
        channels: Sequence[tuple[str, float]] = (("wind_x", 1.0),),
        sea: Sea | None = None,
    ) -> None:
        self.sea = sea
        if sea is not None:
            from meltemi.sea.sea_part import sea_part

            model = replace(model, parts=(*model.parts, sea_part(sea, model, SEA_PERIOD, (0.0, 0.0))))
            water: Any = model.turbine.substructures[0]
            self.waves = sea.components(water.depth + sea.level, SEA_PERIOD, model.environment.gravity)
            assert self.waves.period == SEA_PERIOD, "the kernels read no further"
        names = [name for name, _ in channels]
        self.simulation = Simulation(
            Run(
                model,
                wind.begin(),
                duration=LONGEST + 2.0 * SAMPLE,
                controller=controller,
                channels=names,
                output_step=SAMPLE,
                view=True,
            )
        )
        recorder = self.simulation.recorder
        assert recorder is not None
        self.recorder, self.wind, self.target = recorder, wind, wind.air
        self._columns = [[channel.name for channel in self.simulation.channels].index(name) for name in names]
        self._factors = np.array([factor for _, factor in channels])
        self._field = WindField("floats", self.simulation.case.arrays)
        self._time, self._rows = self._stream(1)
        about, arrays = self.recorder.still
        self._turbine = {"turbine": about["turbine"]}
        self.first = self._scene(about, arrays)

    def _stream(self, samples: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        time, rows = self.simulation.stream(samples)
        good = np.isfinite(rows).all(axis=1)
        return time[good], rows[good].copy()

    @property
    def time(self) -> float:
        """Time [s] of the last sample."""
        return float(self._time[-1])

    def piece(self, samples: int) -> Scene | None:
        """Advance by a number of samples of :data:`SAMPLE` seconds; None if the run has ended.

        The first sample of a piece is the last one of the previous piece.
        """
        run = self.simulation
        if run.finished:
            return None
        now = self.wind.air.towards(self.target, samples * SAMPLE)
        self.wind.change(now, run.time, run.case["wind"])
        time, rows = self._stream(samples)
        self._time = np.concatenate([self._time[-1:], time])
        self._rows = np.concatenate([self._rows[-1:], rows])
        return self._scene({}, {})

    def _scene(self, about: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Scene:
        n_channels = len(self.simulation.channels)
        moved, tracks = self.recorder.moving(self._rows[:, n_channels:], self._time)
        about, air = about | moved, self.wind.air
        begin, end = about["begin"], about["begin"] + about["duration"]
        times = np.linspace(begin, end, 1 + max(1, math.ceil(WIND_RATE * (end - begin))))
        about["wind"], wind = sampled(self._field, self.recorder.section, times, air.direction)
        about["steps"] |= {"wind": max((end - begin) / (len(times) - 1), 1e-3), "plot": SAMPLE}
        about["wind"] |= {"label": "", "speed": air.speed, "intensity": air.intensity}
        plot = track_arrays("plot", self._factors * self._rows[:, self._columns])
        scene = Scene(self._turbine | about, arrays | tracks | wind | plot)
        return scene if self.sea is None else surfaced(scene, self.sea, self.waves)
