"""The learning environment of a farm."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import meltemi

pytest.importorskip("pettingzoo", reason="needs pettingzoo")
from meltemi.farm.env import ACTIONS, OBSERVED, FarmEnv
from meltemi.farm.settings import WakeSettings

WIND = meltemi.TurbulentWind(speed=9.0, intensity=0.06, points=5, dt=0.5)
FARM = meltemi.Farm("nrel5mw", [(0.0, 0.0), (630.0, 0.0)], WakeSettings(added_turbulence=False))


@pytest.mark.slow
def test_episodes_repeat_and_actions_act() -> None:
    env = FarmEnv(FARM, WIND, duration=12.0, actions=("yaw", "pitch"))
    ends = {}
    for case, pitch in (("first", -1.0), ("again", -1.0), ("pitched", 1.0)):
        seen, infos = env.reset(seed=3)
        assert set(seen) == set(infos) == {"turbine_1", "turbine_2"}
        assert seen["turbine_2"][OBSERVED.index("power")] < 0.8 * seen["turbine_1"][OBSERVED.index("power")]
        done, steps = False, 0
        while not done:
            actions = {"turbine_1": np.array([0.4, pitch]), "turbine_2": np.array([0.0, -1.0])}
            seen, rewards, terminations, truncations, _ = env.step(actions)
            assert all(env.observation_space(agent).contains(each) for agent, each in seen.items())
            assert rewards["turbine_1"] == rewards["turbine_2"] and not any(terminations.values())
            done, steps = any(truncations.values()), steps + 1
        assert steps in (6, 7) and not env.agents
        ends[case] = seen["turbine_1"].copy()
    assert np.array_equal(ends["first"], ends["again"])
    power, yaw = OBSERVED.index("power"), OBSERVED.index("yaw")
    assert ends["pitched"][power] < 0.9 * ends["first"][power]
    rate = meltemi.load_turbine("nrel5mw").yaw.rate
    assert ends["first"][yaw] * 0.5 == pytest.approx(12.0 * rate, rel=0.2)  # the drive is on its way to 0.2 rad
    env.close()


def test_mistakes_are_answered_in_words() -> None:
    with pytest.raises(meltemi.InputError, match="no action 'yow'; did you mean 'yaw'"):
        FarmEnv(FARM, WIND, actions=("yow",))
    env = FarmEnv(FARM, WIND)
    assert set(ACTIONS) == {"yaw", "pitch", "power"}
    with pytest.raises(meltemi.InputError, match=r"begin one by reset"):
        env.step({})


@pytest.mark.slow
def test_the_agents_of_the_page() -> None:
    text = (Path(__file__).parents[2] / "docs" / "guide" / "farm.md").read_text(encoding="utf-8")
    found = re.search(r'title="farm_agents.py"\n(.*?)```', text, re.DOTALL)
    assert found
    names: dict[str, object] = {}
    exec(found[1].replace("duration=600.0", "duration=6.0"), names)
    assert names["infos"] == {"turbine_1": {}, "turbine_2": {}}
