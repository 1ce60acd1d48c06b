"""A learning environment of a farm for PettingZoo (parallel API): each turbine is an agent, an exchange is a step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import View
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.extras import need
from meltemi.core.threads import available_cores
from meltemi.farm.layout import Farm
from meltemi.farm.simulation import FarmMarch, SetPoint, farm_runs
from meltemi.simulation.options import ModelOptions
from meltemi.wind.turbulent import TurbulentWind

need("a learning environment of a farm", "gymnasium", "pettingzoo")

from gymnasium import spaces  # noqa: E402
from pettingzoo import ParallelEnv  # noqa: E402

Float = NDArray[np.float32]
ACTIONS = {"yaw": (-0.5, 0.5), "pitch": (0.0, 0.1), "power": (0.0, 1.0)}
"""Set-points of actions -1 and 1: yaw [rad], pitch offset [rad], power limit over rated power."""
OBSERVED = ("wind_speed", "wind_direction", "yaw", "power", "rotor_speed")
"""Measurements of a turbine, each over its scale: 20 m/s, 0.5 rad, 0.5 rad, rated power, 2 rad/s."""
Reward = Callable[[Sequence[View], Sequence[float]], Sequence[float]]
"""Reward of each turbine from the measurements and rated powers [W] of all."""


def mean_power(measured: Sequence[View], rated: Sequence[float]) -> list[float]:
    """Reward of each agent: power of the farm over its rated power."""
    power = sum(float(each["power"]) for each in measured) / sum(rated)
    return [power] * len(measured)


class FarmEnv(ParallelEnv[str, Float, Float]):  # type: ignore[misc]
    """Turbines in each other's wakes; agents set yaw, pitch offset or power limit every exchange of wakes.

    Args:
      farm: farm whose turbines are names or descriptions, since they are built with a yaw drive.
      wind: wind of every episode, with the seed given to ``reset``.
      duration: [s] duration of an episode.
      actions: names of :data:`ACTIONS`.
      reward: reward function, by default :func:`mean_power`.
      controllers: turbine controllers, as for :func:`meltemi.simulate_farm`.

    Raises:
      InputError: an action is unknown.
    """

    metadata: dict[str, Any] = {"name": "meltemi_farm_v0", "render_modes": []}  # noqa: RUF012 - as PettingZoo has it

    def __init__(
        self,
        farm: Farm,
        wind: TurbulentWind,
        duration: float = 600.0,
        actions: Sequence[str] = ("yaw",),
        reward: Reward = mean_power,
        controllers: Any = None,
    ) -> None:
        for name in actions:
            if name not in ACTIONS:
                raise InputError(f"farm environment: no action {name!r}; {did_you_mean(name, ACTIONS)}")
        self.farm = Farm(farm.models(ModelOptions(yaw="driven")), farm.positions, farm.wakes, farm.yaw)
        self.wind, self.duration, self.actions, self.reward = wind, duration, tuple(actions), reward
        self.controllers = controllers
        self.rated = [model.turbine.rated_power for model in self.farm.turbine]  # type: ignore[union-attr]
        self.possible_agents = [f"turbine_{i + 1}" for i in range(len(farm.positions))]
        self.agents: list[str] = []
        self.march: FarmMarch | None = None

    def observation_space(self, agent: str) -> spaces.Box:
        """Observation space of the quantities :data:`OBSERVED`."""
        return spaces.Box(-np.inf, np.inf, (len(OBSERVED),), np.float32)

    def action_space(self, agent: str) -> spaces.Box:
        """Action space, from -1 to 1 for each action."""
        return spaces.Box(-1.0, 1.0, (len(self.actions),), np.float32)

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Float], dict[str, dict[str, Any]]]:
        """Begin an episode with developed wakes; without a seed, that of the wind increases by one."""
        self.close()
        self.wind = self.wind.replace(seed=self.wind.seed + 1 if seed is None else seed)
        runs = farm_runs(self.farm, self.wind, self.duration, self.controllers, None)
        self.march = FarmMarch(runs, self.farm.places(), self.farm.settings, self.farm.angles(), available_cores())
        self.agents = list(self.possible_agents)
        return self._observed()[0], {agent: {} for agent in self.agents}

    def step(self, actions: dict[str, Float]) -> tuple[dict[str, Any], ...]:
        """Advance to the next exchange under actions; return observations, rewards, terminations, truncations, infos.

        Raises:
          InputError: no episode is running, or an agent has no action.
        """
        if self.march is None or not self.agents:
            raise InputError("farm environment: no episode is running; begin one by reset()")
        if set(actions) != set(self.agents):
            raise InputError(f"farm environment: expected an action for each of {', '.join(self.agents)}")
        for turbine, agent, rated in zip(self.march.turbines, self.agents, self.rated, strict=True):
            given = np.clip(np.asarray(actions[agent], dtype=np.float64), -1.0, 1.0)
            if given.shape != (len(self.actions),) or not np.isfinite(given).all():
                raise InputError(f"farm environment: {agent}: expected {len(self.actions)} numbers, found {given}")
            ends = (ACTIONS[name] for name in self.actions)
            point = {n: a + 0.5 * (x + 1.0) * (b - a) for n, x, (a, b) in zip(self.actions, given, ends, strict=True)}
            if "power" in point:
                point["power"] *= rated
            turbine.demand(SetPoint(**point))
        self.march.exchange()
        observations, measured = self._observed()
        rewards = dict(zip(self.agents, map(float, self.reward(measured, self.rated)), strict=True))
        runs = [turbine.simulation for turbine in self.march.turbines]
        ended, failed = all(run.finished for run in runs), any(run.finished and run.share < 1.0 for run in runs)
        flags = [dict.fromkeys(self.agents, flag) for flag in (failed, ended and not failed)]
        infos: dict[str, dict[str, Any]] = {agent: {} for agent in self.agents}
        if ended or failed:
            self.agents = []
        return observations, rewards, *flags, infos

    def _observed(self) -> tuple[dict[str, Float], list[View]]:
        assert self.march is not None
        measured = [turbine.measurements() for turbine in self.march.turbines]
        observations = {}
        for agent, each, rated in zip(self.agents, measured, self.rated, strict=True):
            scales = (20.0, 0.5, 0.5, rated, 2.0)
            values = [float(each[name]) / scale for name, scale in zip(OBSERVED, scales, strict=True)]
            observations[agent] = np.array(values, dtype=np.float32)
        return observations, measured

    def close(self) -> None:
        """Release the turbines."""
        if self.march is not None:
            self.march.close()
        self.march, self.agents = None, []
