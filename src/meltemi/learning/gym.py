"""The environments for Gymnasium: one turbine, or a vector of turbines in one process."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, RunError, did_you_mean
from meltemi.core.extras import need
from meltemi.learning.fleet import Fleet, TaskSetup
from meltemi.learning.kernels import TERMS
from meltemi.learning.settings import TASKS, EnvironmentSettings
from meltemi.simulation.result import Result

need("a learning environment", "gymnasium")

import gymnasium  # noqa: E402
from gymnasium import spaces  # noqa: E402
from gymnasium.utils import seeding  # noqa: E402
from gymnasium.vector import AutoresetMode, VectorEnv  # noqa: E402
from gymnasium.vector.utils import batch_space  # noqa: E402

Observation = NDArray[np.float32]
IDS = tuple(f"Meltemi/{task}-v0" for task in TASKS)
"""Names of the environments."""


def _box(n: int) -> spaces.Box:
    return spaces.Box(-1.0, 1.0, (n,), np.float32)


class TurbineEnv(gymnasium.Env[Observation, Observation]):  # type: ignore[misc]
    """One turbine in turbulent wind that an agent controls.

    Args:
      task: task of the environment: "LoadControl", "IPC", "Yaw" or "Power".
      render_mode: None; the results of episodes have plots.
      settings: fields of :class:`EnvironmentSettings`.

    Raises:
      InputError: a setting is not valid.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - as Gymnasium has it

    def __init__(self, task: str = "LoadControl", render_mode: str | None = None, **settings: Any) -> None:
        self.setup = TaskSetup(task, EnvironmentSettings(**settings))
        self.fleet = Fleet(self.setup, 1)
        self.render_mode = render_mode
        self.action_space, self.observation_space = _spaces(self.setup)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode.

        Args:
          seed: seed of all random numbers from now on.
          options: quantities that are not random: ``wind_speed`` [m/s], ``turbulence_seed``, ``begin`` [s] within the
            turbulence, ``azimuth`` [rad] of blade 1, ``misalignment`` [rad].

        Raises:
          InputError: an option is unknown.
          RunError: the run failed in the initial transient.
        """
        super().reset(seed=seed)
        self.fleet.begin(0, self.np_random, options)
        if self.fleet.ended[0]:
            raise RunError(
                f"reset: {self.setup.turbine.name} diverged or ran too fast in the transient of "
                f"{self.setup.settings.transient:g} s, with steps of {self.setup.dt:.3g} s: use model='full', or "
                "ModelOptions with a shorter time_step"
            )
        return self.fleet.observations[0].copy(), dict(self.fleet.episodes[0].facts)

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance one step under an action between -1 and 1.

        Returns:
          observation, reward, whether the episode was terminated (divergence, overspeed) and truncated (its end), and
          the weighted components of the reward, ``reward_power`` and so on.

        Raises:
          InputError: there is no episode, it has ended, or the action has another length.
        """
        fleet = self.fleet
        if fleet.episodes[0] is None or fleet.ended[0]:
            raise InputError("step: no episode is running; begin one by reset()")
        fleet.step(_ONE, np.asarray(action, dtype=np.float32).reshape(1, -1), [self.np_random])
        ended = int(fleet.ended[0])
        info = {**fleet.episodes[0].facts, **fleet.components(0)}
        return fleet.observations[0].copy(), float(fleet.rewards[0]), ended == 1, ended == 2, info

    def result(self) -> Result:
        """Result of the present episode up to now: loads, and channels of the setting ``channels``.

        Raises:
          InputError: there is no episode.
        """
        if self.fleet.episodes[0] is None:
            raise InputError("result: no episode is running; begin one by reset()")
        return self.fleet.episodes[0].result()

    def close(self) -> None:
        """Release the simulation."""
        self.fleet.close()


_ONE = np.zeros(1, dtype=np.int64)


def _spaces(setup: TaskSetup) -> tuple[spaces.Box, spaces.Box]:
    return _box(len(setup.action_names)), _box(len(setup.sensors))


class TurbineVectorEnv(VectorEnv[Observation, Observation, NDArray[np.float64]]):  # type: ignore[misc]
    """Vector of turbines in one process; after the end of an episode the next step begins another one.

    Args:
      task: as for :class:`TurbineEnv`.
      num_envs: number of turbines.
      threads: number of threads.
      settings: fields of :class:`EnvironmentSettings`.

    Raises:
      InputError: a setting is not valid.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 - as Gymnasium has it

    def __init__(self, task: str = "LoadControl", num_envs: int = 1, threads: int = 1, **settings: Any) -> None:
        if num_envs < 1 or threads < 1:
            raise InputError(f"num_envs and threads must be at least 1, found {num_envs} and {threads}")
        settings.pop("render_mode", None)
        self.setup = TaskSetup(task, EnvironmentSettings(**settings))
        self.num_envs, self.fleet = num_envs, Fleet(self.setup, num_envs, threads)
        self.single_action_space, self.single_observation_space = _spaces(self.setup)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._rngs = [np.random.default_rng() for _ in range(num_envs)]
        self._ended = np.zeros(num_envs, dtype=bool)
        self._all = np.ones(num_envs, dtype=bool)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode of every turbine.

        Args:
          seed: seed of the first turbine, increasing by one for the others, or one each.
          options: as for :meth:`TurbineEnv.reset`, for all, or lists with one value each.
        """
        n = self.num_envs
        seeds = [seed + i for i in range(n)] if isinstance(seed, int | np.integer) else seed or [None] * n
        for i, each in enumerate(seeds):
            if each is not None:
                self._rngs[i] = seeding.np_random(each)[0]
            given = options or {}
            self.fleet.begin(i, self._rngs[i], {k: v if np.ndim(v) == 0 else v[i] for k, v in given.items()})
        self._ended[:] = False
        return self.fleet.observations.copy(), self._facts()

    def step(
        self, actions: Observation
    ) -> tuple[Observation, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Advance every turbine by one step; one whose episode has ended begins another, without reward.

        Args:
          actions: (num_envs, actions) between -1 and 1.

        Returns:
          (num_envs, ...) observations, rewards, terminated, truncated, and the weighted components of the rewards.

        Raises:
          InputError: there is no episode, or the actions have another shape.
        """
        fleet = self.fleet
        again = self._ended
        if again.any():
            for i in np.flatnonzero(again).tolist():
                fleet.begin(i, self._rngs[i])
                fleet.terms[i] = 0.0
                fleet.rewards[i] = 0.0
        which = np.flatnonzero(~again)
        fleet.step(which, np.ascontiguousarray(actions, dtype=np.float32), self._rngs)
        terminated, truncated = fleet.ended == 1, fleet.ended == 2
        self._ended = terminated | truncated
        info: dict[str, Any] = {}
        terms = fleet.terms.copy()
        for k, name in enumerate(TERMS):
            info[f"reward_{name}"], info[f"_reward_{name}"] = terms[:, k], self._all
        return fleet.observations.copy(), fleet.rewards.copy(), terminated, truncated, info

    def _facts(self) -> dict[str, Any]:
        facts: dict[str, Any] = {}
        for name in self.fleet.episodes[0].facts:
            facts[name] = np.array([episode.facts[name] for episode in self.fleet.episodes])
            facts[f"_{name}"] = self._all
        return facts

    def results(self) -> list[Result]:
        """Result of every turbine, as :meth:`TurbineEnv.result`."""
        return [episode.result() for episode in self.fleet.episodes]

    def close_extras(self, **kwargs: Any) -> None:
        """Release the simulations and threads."""
        self.fleet.close()


def _task(name: str) -> str:
    if name not in IDS:
        raise InputError(f"make_vec: no environment {name!r}: {did_you_mean(name, IDS)}")
    return name.removeprefix("Meltemi/").removesuffix("-v0")


def make_vec(id: str, num_envs: int, *, threads: int = 1, **settings: Any) -> TurbineVectorEnv:  # noqa: A002 - as Gymnasium
    """Vector environment of turbines in one process, advanced by one compiled loop.

    Args:
      id: "Meltemi/LoadControl-v0", "Meltemi/IPC-v0", "Meltemi/Yaw-v0" or "Meltemi/Power-v0".
      num_envs: number of turbines.
      threads: number of threads; the loop releases Python's global interpreter lock.
      settings: fields of :class:`EnvironmentSettings`.

    Raises:
      InputError: the environment is unknown, or a setting is not valid.
    """
    return TurbineVectorEnv(_task(id), num_envs, threads, **settings)


def register() -> None:
    """Register the environments with Gymnasium."""
    for name in IDS:
        if name not in gymnasium.registry:
            gymnasium.register(
                name,
                entry_point=f"{__name__}:TurbineEnv",
                vector_entry_point=f"{__name__}:TurbineVectorEnv",
                kwargs={"task": _task(name)},
            )
