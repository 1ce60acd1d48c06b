"""Settings of the learning environments, and the tasks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Self

from pydantic import Field, model_validator

from meltemi.core.deferred import deferred
from meltemi.core.record import Record
from meltemi.simulation.options import ModelOptions

if TYPE_CHECKING:
    from meltemi.environment import Sea
else:
    Sea = deferred("meltemi.sea.kinds", "AnySea")

Task = Literal["LoadControl", "IPC", "Yaw", "Power"]

TRAINING_SEEDS = tuple(range(1001, 1025))
"""Seeds of the turbulence that agents learn in."""
TEST_SEEDS = tuple(range(2001, 2013))
"""Seeds of the turbulence in which they are evaluated; no training seed is among them."""

FAST = ModelOptions(time_step=1.0 / 30.0)
"""The whole flexible turbine with implicit steps of a thirtieth of a second."""
LIGHT = FAST.replace(blade_nodes=8)
"""``FAST`` with eight nodes per blade."""
MODELS = {"full": ModelOptions(), "fast": FAST, "light": LIGHT}
"""Options of the models by name; docs/guide/learning.md has their speeds and deviations."""


class Weights(Record):
    """Weights of the components of the reward; see docs/guide/learning.md for the components."""

    power: float = Field(default=0.0, ge=0.0)
    speed: float = Field(default=0.0, ge=0.0)
    reference: float = Field(default=0.0, ge=0.0)
    yaw: float = Field(default=0.0, ge=0.0)
    load: float = Field(default=0.0, ge=0.0)
    pitch_travel: float = Field(default=0.0, ge=0.0)
    yaw_travel: float = Field(default=0.0, ge=0.0)
    failure: float = Field(default=100.0, ge=0.0)


@dataclass(frozen=True)
class TaskDefaults:
    """Default settings of a task.

    Attributes:
      actions: names of the actions.
      sensors: sensors of the observation.
      weights: weights of the reward.
      step, duration: [s] step of the environment and duration of an episode.
      misalignment: [rad] largest initial yaw error.
    """

    actions: tuple[str, ...]
    sensors: tuple[str, ...]
    weights: Weights
    step: float = 0.1
    duration: float = 120.0
    misalignment: float = 0.0


_SPEED = ("generator_speed", "torque", "power")
_TOWER = ("fore_aft_acceleration", "fore_aft_velocity")
_PITCH = ("pitch_1", "pitch_2", "pitch_3")
_MOMENTS = ("out_of_plane_moment_1", "out_of_plane_moment_2", "out_of_plane_moment_3", "tilt_moment", "yaw_moment")

TASKS: dict[str, TaskDefaults] = {
    "LoadControl": TaskDefaults(
        ("pitch", "torque"),
        (*_SPEED, "pitch_1", *_TOWER, "side_side_acceleration", "side_side_velocity", "wind_speed"),
        Weights(power=1.0, speed=0.1, load=1.0, pitch_travel=0.1),
    ),
    "IPC": TaskDefaults(
        _PITCH,
        (*_SPEED, *_PITCH, "azimuth_sine", "azimuth_cosine", *_MOMENTS, *_TOWER),
        Weights(power=1.0, speed=0.1, load=1.0, pitch_travel=0.1),
    ),
    "Yaw": TaskDefaults(
        ("yaw_rate",),
        ("yaw_error", "yaw", "yaw_rate", "wind_speed", "power", "generator_speed", "pitch_1"),
        Weights(power=1.0, yaw=0.1, yaw_travel=0.1),
        step=1.0,
        duration=300.0,
        misalignment=0.5,
    ),
    "Power": TaskDefaults(
        ("pitch", "torque"),
        (*_SPEED, "pitch_1", "power_reference", "power_error", "fore_aft_acceleration", "wind_speed"),
        Weights(reference=1.0, speed=0.1, load=0.1, pitch_travel=0.1),
    ),
}
"""The tasks by the names of their environments."""


class EnvironmentSettings(Record):
    """Settings of a learning environment; the arguments of ``gymnasium.make`` and :func:`meltemi.envs.make_vec`."""

    turbine: Any = "nrel5mw"
    """Name in the turbine library, or a turbine."""
    model: Literal["full", "fast", "light"] | ModelOptions = "fast"
    """Options of the model, or one of those of docs/guide/learning.md."""
    controller: Any = "baseline"
    """Underlying controller: a name or file of docs/guide/controller-names.md, or its record; compiled."""
    wind_speeds: tuple[float, float] = (8.0, 18.0)
    """[m/s] range of the mean wind speeds at hub height; each seed has one."""
    wind_class: str = "IB"
    """Class of IEC 61400-1, for the intensity of the normal turbulence model."""
    seeds: tuple[int, ...] = Field(default=TRAINING_SEEDS, min_length=1)
    """Seeds of the turbulent winds from which an episode chooses."""
    wind_points: int = Field(default=17, ge=3, le=201)
    """Grid points across the rotor."""
    wind_step: float = Field(default=0.2, gt=0.0, le=2.0)
    """[s] interval between planes of the wind."""
    wind_duration: float = Field(default=300.0, gt=0.0)
    """[s] turbulence beyond the duration of an episode, which starts at a random time in it."""
    sea: Sea | None = None
    """Waves and current around an offshore turbine, by default still water; irregular waves have the episode's seed."""
    step: float | None = Field(default=None, gt=0.0)
    """[s] step of the environment; by default 0.1 s, for yaw 1 s."""
    duration: float | None = Field(default=None, gt=0.0)
    """[s] duration of an episode; by default 120 s, for yaw 300 s."""
    transient: float = Field(default=10.0, ge=0.0)
    """[s] initial transient under the controller before an episode."""
    action: Literal["offset", "absolute"] = "offset"
    """Actions are added to the demands of the controller, or replace them."""
    pitch_range: float = Field(default=0.0524, ge=0.0)
    """[rad] largest offset of the pitch; 0: the action has no effect."""
    torque_range: float = Field(default=0.1, ge=0.0, le=1.0)
    """Largest offset of the torque over the largest torque; 0: the action has no effect."""
    sensors: tuple[str, ...] | None = Field(default=None, min_length=1)
    """Sensors of the observation; by default those of the task."""
    noise: float = Field(default=0.0, ge=0.0, le=1.0)
    """Standard deviation of the white noise of all sensors over half their range."""
    delay: int = Field(default=0, ge=0, le=100)
    """Delay of observations in steps."""
    leak: float = Field(default=0.3, ge=0.0)
    """[1/s] leakage rate of the integration of tower-top velocities from accelerations."""
    weights: Weights | None = None
    """Weights of the components of the reward; by default those of the task."""
    loads: dict[str, float] = Field(default={"tower_base_moment_fore_aft": 1.0})
    """Channels of the load component, and their weights."""
    load_measure: Literal["rate", "rainflow"] = "rate"
    """Load component: mean square of the rate of the load, or damage by rainflow counting, as in equivalent loads."""
    overspeed: float = Field(default=1.3, gt=1.0)
    """Generator speed over its reference at which an episode is terminated."""
    misalignment: float | None = Field(default=None, ge=0.0, le=1.0)
    """[rad] largest initial yaw error; by default 0, for yaw 0.5 rad."""
    reference_range: tuple[float, float] = (0.4, 1.0)
    """Range of the power reference over rated power, for the task Power."""
    reference_hold: float = Field(default=20.0, gt=0.0)
    """[s] interval between changes of the power reference."""
    channels: tuple[str, ...] = ()
    """Further channels that the results of episodes contain."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name in ("wind_speeds", "reference_range"):
            low, high = getattr(self, name)
            if not 0.0 < low <= high:
                raise ValueError(f"{name}: expected two positive numbers, the lower one first, found {low:g}, {high:g}")
        return self

    def of(self, task: str, name: str) -> Any:
        """A setting, or its default of the task."""
        value = getattr(self, name)
        return getattr(TASKS[task], name) if value is None else value
