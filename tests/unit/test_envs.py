"""Learning environments: Gymnasium's rules, physics against ``simulate``, rewards, options."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi.core.errors import InputError, RunError
from meltemi.postprocess.cycles import damage_sum, rainflow_cycles

gymnasium = pytest.importorskip("gymnasium", reason="needs pip install 'gymnasium>=1.0,<2'")

import meltemi.envs as envs  # noqa: E402
from meltemi.learning.sensors import load_scale, sensors_of  # noqa: E402

SHORT: dict[str, Any] = {"duration": 4.0, "transient": 1.0, "wind_duration": 5.0, "wind_points": 7, "model": "light"}
LOAD, YAW = "Meltemi/LoadControl-v0", "Meltemi/Yaw-v0"


def make(name: str = LOAD, **settings: Any) -> Any:
    return gymnasium.make(name, **{**SHORT, **settings}).unwrapped


def episode(env: Any, action: Any = None, *, seed: int = 1, options: dict[str, Any] | None = None) -> dict[str, Any]:
    """Observations, rewards and infos of an episode under a constant action, or one of the observation."""
    observation, info = env.reset(seed=seed, options=options)
    seen, rewards, infos, ended = [observation], [], [info], (False, False)
    while not any(ended):
        now = action(observation) if callable(action) else action
        if now is None:
            now = np.zeros(env.action_space.shape)
        observation, reward, *ended, info = env.step(np.float32(now))
        seen.append(observation)
        rewards.append(reward)
        infos.append(info)
    return {"observations": np.array(seen), "rewards": np.array(rewards), "infos": infos, "ended": tuple(ended)}


@pytest.mark.long
@pytest.mark.parametrize("name", envs.IDS)
def test_environments_follow_the_rules_of_gymnasium(name: str) -> None:
    from gymnasium.utils.env_checker import check_env

    env = make(name)
    check_env(env)
    one = gymnasium.make(name, **SHORT)  # with Gymnasium's own checks at every step
    first, again = episode(one.unwrapped, seed=5), episode(one.unwrapped, seed=5)
    assert np.array_equal(first["observations"], again["observations"])
    assert np.array_equal(first["rewards"], again["rewards"])
    assert first["ended"] == (False, True) and len(first["rewards"]) == round(4.0 / env.setup.step)
    other = episode(one.unwrapped, seed=6)
    assert not np.array_equal(first["observations"], other["observations"])
    assert np.abs(first["observations"]).max() <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    "controller", ["baseline", "supervised", pytest.param("ipc", marks=pytest.mark.long(reason="it is tuned"))]
)
def test_no_action_is_the_controller(controller: str) -> None:
    channels = ("generator_speed", "pitch_1", "generator_torque", "root_moment_out_of_plane_2")
    env = make(channels=channels, controller=controller)
    episode(env, options={"wind_speed": 13.0})
    run = env.fleet.episodes[0].run
    ours = env.result()
    theirs = meltemi.simulate(
        run.model,
        run.wind,
        duration=run.duration,
        start=run.start,
        channels=run.channels,
        output_step=run.output_step,
        transient=run.transient,
        controller=meltemi.control.make_controller(controller, run.model),
    )
    assert len(ours.time) == len(theirs.time) > 100
    for name in ("tower_base_moment_fore_aft", *channels):
        np.testing.assert_allclose(ours[name], theirs[name], rtol=1e-12, err_msg=name)


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 2])
def test_vector_is_as_single_environments(threads: int) -> None:
    """Step by step, over the end of episodes, with noise."""
    settings = {**SHORT, "duration": 1.0, "noise": 0.01, "delay": 1}
    vector, singles = envs.make_vec(LOAD, 2, threads=threads, **settings), [make(**settings) for _ in range(2)]
    seen, _ = vector.reset(seed=7)
    for i, env in enumerate(singles):
        assert np.array_equal(env.reset(seed=7 + i)[0], seen[i])
    rng, ended = np.random.default_rng(1), np.zeros(2, dtype=bool)
    for step in range(23):
        actions = rng.uniform(-1.0, 1.0, (2, 2)).astype(np.float32)
        seen, rewards, terminated, truncated, info = vector.step(actions)
        for i, env in enumerate(singles):
            if ended[i]:
                expected: Any = (env.reset()[0], 0.0, False, False, {"reward_load": 0.0})
            else:
                expected = env.step(actions[i])
            assert np.array_equal(seen[i], expected[0]), step
            assert (rewards[i], terminated[i], truncated[i]) == expected[1:4], step
            assert info["reward_load"][i] == expected[4]["reward_load"], step
        ended = terminated | truncated
        assert ended.all() == (step in (9, 20))
    vector.close()


@pytest.mark.slow
def test_an_ended_episode_does_not_march_on() -> None:
    """Its arrays end with it."""
    env = make(duration=1.0)
    episode(env)
    clock = env.fleet.episodes[0].simulation.case.clock
    at = clock.step
    env.fleet.step(np.zeros(1, dtype=np.int64), np.zeros((1, 2), dtype=np.float32), [])
    assert clock.step == at == env.fleet.episodes[0].simulation.n_steps


def test_gymnasium_makes_the_same_vector() -> None:
    vector = gymnasium.make_vec(LOAD, num_envs=2, vectorization_mode="vector_entry_point", **SHORT)
    assert isinstance(vector, envs.TurbineVectorEnv)
    assert vector.metadata["autoreset_mode"] is gymnasium.vector.AutoresetMode.NEXT_STEP
    seen, info = vector.reset(seed=1, options={"turbulence_seed": [2003, 2004], "begin": 1.0})
    assert seen.shape == vector.observation_space.shape
    assert info["turbulence_seed"].tolist() == [2003, 2004] and info["begin"].tolist() == [1.0, 1.0]


def test_reward_is_the_sum_of_its_components() -> None:
    env = make("Meltemi/Power-v0", load_measure="rainflow")
    run = episode(env, lambda _: env.action_space.sample())
    for reward, info in zip(run["rewards"], run["infos"][1:], strict=True):
        terms = {name: value for name, value in info.items() if name.startswith("reward_")}
        assert len(terms) == 8 and reward == pytest.approx(sum(terms.values()), rel=1e-12)
        assert terms["reward_reference"] < 0.0 and terms["reward_load"] <= 0.0


def test_power_component_is_the_mean_power() -> None:
    env = make(channels=("generator_power",), wind_speeds=(9.0, 9.0))
    run = episode(env)
    mean = np.mean([info["reward_power"] for info in run["infos"][1:]])
    assert mean == pytest.approx(env.result().evaluated["generator_power"].mean() / 5e6, rel=2e-3)


def test_load_component_is_the_damage_of_the_episode() -> None:
    """By rainflow counting, and the mean square of the rate."""
    name = "tower_base_moment_fore_aft"
    for measure in ("rainflow", "rate"):
        env = make(load_measure=measure, weights={"load": 2.0}, loads={name: 0.5})
        run = episode(env)
        total = -sum(info["reward_load"] for info in run["infos"][1:])
        series = env.result().evaluated[name] / load_scale(env.setup.turbine, name)
        damage = damage_sum(rainflow_cycles(series), 4.0) / env.setup.step
        rate = np.sum((np.diff(series) / env.setup.output_step) ** 2) / (env.setup.step / env.setup.output_step)
        assert total == pytest.approx(damage if measure == "rainflow" else rate, rel=1e-9)


def test_observations_are_sensors_on_their_ranges() -> None:
    names = ("generator_speed", "pitch_1", "power", "azimuth_sine", "fore_aft_acceleration")
    env = make(sensors=names)
    seen = episode(env)["observations"][-1]
    measured, known = env.fleet.episodes[0].simulation.case.control.measured, sensors_of(env.setup.turbine)
    values = [measured.generator_speed, measured.pitch[0], measured.power]
    values += [np.sin(measured.azimuth), measured.fore_aft_acceleration]
    for name, value, shown in zip(names, values, seen, strict=True):
        low, high = known[name].low, known[name].high
        assert low + 0.5 * (float(shown) + 1.0) * (high - low) == pytest.approx(value, abs=1e-6 * (high - low)), name


def test_noise_and_delay_of_observations() -> None:
    clean, noisy = episode(make(duration=20.0)), episode(make(duration=20.0, noise=0.05))
    late = episode(make(duration=20.0, delay=3))
    free = np.abs(clean["observations"]).max(axis=0) < 0.7  # that no limit cuts
    difference = (noisy["observations"] - clean["observations"])[:, free]
    assert free.sum() >= 4 and np.std(difference) == pytest.approx(0.05, rel=0.1)
    assert abs(np.mean(difference)) < 0.005
    assert np.abs(np.corrcoef(difference[1:, 0], difference[:-1, 0])[0, 1]) < 0.2
    assert np.array_equal(late["observations"][3:], clean["observations"][:-3])
    assert np.array_equal(noisy["rewards"], clean["rewards"])  # the turbine feels neither


def test_training_and_test_seeds_have_none_in_common() -> None:
    assert not set(envs.TRAINING_SEEDS) & set(envs.TEST_SEEDS)
    assert len({*envs.TRAINING_SEEDS}) == len(envs.TRAINING_SEEDS) and len({*envs.TEST_SEEDS}) == len(envs.TEST_SEEDS)
    env = make()
    assert {env.reset(seed=i)[1]["turbulence_seed"] for i in range(8)} <= set(envs.TRAINING_SEEDS)
    speeds = [env.setup.wind_speed(seed) for seed in envs.TEST_SEEDS]
    assert min(speeds) < 9.5 and max(speeds) > 16.5  # the whole range


CHANGES: dict[str, Any] = {
    "controller": "fixed",
    "model": "full",
    "wind_speeds": (15.0, 17.0),
    "wind_class": "IC",
    "seeds": (77,),
    "wind_points": 9,
    "wind_step": 0.5,
    "wind_duration": 7.0,
    "step": 0.2,
    "duration": 3.0,
    "transient": 2.0,
    "action": "absolute",
    "pitch_range": 0.02,
    "torque_range": 0.2,
    "sensors": ("power",),
    "noise": 0.1,
    "delay": 2,
    "leak": 1.0,
    "weights": {"power": 3.0},
    "loads": {"root_moment_flap_1": 1.0},
    "load_measure": "rainflow",
    "overspeed": 1.0001,
    "misalignment": 0.3,
}


def outcome(**settings: Any) -> tuple[Any, ...]:
    run = episode(make(**settings), (0.5, 0.3), options=None)
    return run["observations"].tobytes(), run["rewards"].tobytes()


@pytest.fixture(scope="module")
def reference() -> tuple[Any, ...]:
    return outcome()


@pytest.mark.parametrize("name", CHANGES)
def test_every_setting_changes_something(name: str, reference: tuple[Any, ...]) -> None:
    assert outcome(**{name: CHANGES[name]}) != reference


def test_other_settings_change_something() -> None:
    """Of the power reference, of the turbine; the settings are complete."""
    assert {*CHANGES, "turbine", "sea", "channels", "reference_range", "reference_hold"} == {
        *envs.EnvironmentSettings.model_fields
    }
    rewards = [
        episode(make("Meltemi/Power-v0", **change))["rewards"].tobytes()
        for change in ({}, {"reference_range": (0.5, 0.6)}, {"reference_hold": 1.0})
    ]
    assert len({*rewards}) == 3
    heavy = meltemi.load_turbine("nrel5mw")
    heavy = heavy.replace(hub=heavy.hub.replace(mass=2.0 * heavy.hub.mass))
    assert episode(make(turbine=heavy))["rewards"].tobytes() != episode(make())["rewards"].tobytes()


@pytest.mark.long
def test_sea_of_an_environment_has_the_seed_of_the_episode() -> None:
    """Waves load the pile; each turbulence has its own sea; no action is ``simulate`` in that sea."""
    settings: dict[str, Any] = {"turbine": "iea15mw-monopile", "channels": ("ReactMYss",)}
    settings["model"] = meltemi.ModelOptions(integration="implicit", time_step=1.0 / 60.0)
    sea = meltemi.environment.IrregularSea(height=4.0, period=9.0, seed=2)

    def run(seed: int, sea: Any) -> Any:
        env = make(**settings, sea=sea)
        episode(env, options={"wind_speed": 13.0, "turbulence_seed": seed, "begin": 0.0, "azimuth": 0.0})
        return env

    still, waves, again, other = run(5, None), run(5, sea), run(5, sea.replace(seed=3)), run(6, sea)
    series = [env.result()["ReactMYss"] for env in (still, waves, again, other)]
    assert np.array_equal(series[1], series[2])
    assert series[1].std() > 1.2 * series[0].std() and not np.allclose(series[1], series[3])
    it = waves.fleet.episodes[0].run
    names = ("duration", "start", "channels", "output_step", "transient", "sea")
    law = meltemi.control.make_controller("baseline", it.model)
    whole = meltemi.simulate(it.model, it.wind, controller=law, **{name: getattr(it, name) for name in names})
    np.testing.assert_allclose(series[1], whole["ReactMYss"], rtol=1e-12)
    with pytest.raises(InputError, match="stands on land"):
        make(sea=sea).reset()


@pytest.mark.long
def test_a_start_that_diverges_is_said_at_reset() -> None:
    """Steps of the fast model are too long for blades of 117 m."""
    with pytest.raises(RunError, match=r"diverged or ran too fast .* steps of 0.0333 s: use model='full'"):
        make(turbine="iea15mw", model="fast").reset(seed=1)


@pytest.mark.parametrize(
    ("option", "value"),
    [("wind_speed", 16.0), ("turbulence_seed", 2001), ("begin", 1.0), ("azimuth", 1.0), ("misalignment", 0.2)],
)
def test_options_of_reset(option: str, value: float) -> None:
    env = make()
    first = episode(env, seed=2)
    changed = episode(env, seed=2, options={option: value})
    assert not np.array_equal(first["observations"], changed["observations"])
    if option in changed["infos"][0]:
        assert changed["infos"][0][option] == pytest.approx(value, abs=0.11)


def test_actions_move_the_actuators() -> None:
    calm = {"wind_speed": 16.0}
    env = make(channels=("pitch_1", "pitch_2", "generator_torque"), pitch_range=0.03, torque_range=0.05)
    run = {}
    for action in ((0.0, 0.0), (1.0, 0.0), (0.0, -1.0)):
        episode(env, action, options=calm)
        run[action] = env.result().evaluated
    none, pitched, eased = run.values()
    assert pitched["pitch_1"][5] > none["pitch_1"][5] + 0.01
    most = env.setup.turbine.control.torque.maximum_torque
    assert (eased["generator_torque"] - none["generator_torque"])[30] == pytest.approx(-0.05 * most, rel=0.1)
    ipc = make("Meltemi/IPC-v0", channels=("pitch_1", "pitch_2"))
    episode(ipc, (0.0, 1.0, 0.0), options=calm)
    assert np.ptp(ipc.result()["pitch_2"] - ipc.result()["pitch_1"]) == pytest.approx(0.0524, rel=0.02)


def test_yaw_turns_into_the_wind() -> None:
    """A simple rule reduces the yaw error; the drive keeps its rate."""
    env = make(YAW, duration=60.0)
    toward = episode(env, lambda seen: -np.sign(seen[:1]), options={"misalignment": 0.3})
    at_rest = episode(env, options={"misalignment": 0.3})
    assert abs(toward["observations"][-5:, 0].mean()) < 0.5 * abs(at_rest["observations"][-5:, 0].mean())
    assert toward["infos"][-1]["reward_yaw"] > at_rest["infos"][-1]["reward_yaw"]


def test_torque_keeps_the_power_below_the_reference() -> None:
    env = make("Meltemi/Power-v0", reference_range=(0.5, 0.5), channels=("generator_power",), duration=20.0)
    episode(env, options={"wind_speed": 16.0})
    assert env.result().evaluated["generator_power"][100:].mean() == pytest.approx(2.5e6, rel=0.02)


def test_overspeed_terminates() -> None:
    """Full pitch demand towards zero with no torque, above rated wind."""
    env = make(action="absolute", duration=30.0, overspeed=1.1)
    run = episode(env, (-1.0, -1.0), options={"wind_speed": 16.0})
    assert run["ended"] == (True, False) and run["infos"][-1]["reward_failure"] == -100.0
    with pytest.raises(InputError, match=r"no episode is running; begin one by reset\(\)"):
        env.step(np.zeros(2, dtype=np.float32))


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"sensors": ("generator_sped",)}, "no sensor 'generator_sped': did you mean 'generator_speed'"),
        ({"loads": {"generator_power": 1.0}}, "'generator_power' is not the meltemi name of a load channel"),
        ({"step": 0.05}, "not a multiple of the time step"),
        ({"wind_speeds": (12.0, 8.0)}, "lower one first"),
        ({"nois": 0.1}, "nois"),
        ({"duration": 4.05}, "not a multiple of the step"),
        ({"controller": "superviced"}, "did you mean 'supervised'"),
    ],
)
def test_invalid_settings_are_refused(settings: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        make(**settings).reset()


def test_unknown_names_are_refused() -> None:
    with pytest.raises(InputError, match=r"no environment .*did you mean 'Meltemi/Power-v0'"):
        envs.make_vec("Meltemi/Powr-v0", 2)
    with pytest.raises(InputError, match="no option 'wind'"):
        make().reset(options={"wind": 12.0})
    with pytest.raises(InputError, match="at least 1"):
        envs.make_vec(LOAD, 0)


def test_actions_of_another_shape_are_refused() -> None:
    """The compiled loop would read beyond them."""
    env = make("Meltemi/IPC-v0")
    env.reset(seed=1)
    with pytest.raises(InputError, match=r"expected 1 x 3 actions \(pitch_1, pitch_2, pitch_3\), found 1 x 2"):
        env.step(np.zeros(2, np.float32))
    vector = envs.make_vec("Meltemi/IPC-v0", 2, **SHORT)
    with pytest.raises(InputError, match="begin one by reset"):
        vector.step(np.zeros((2, 3), np.float32))
    vector.reset(seed=1)
    for shape in ((1, 3), (2, 1), (6,)):
        with pytest.raises(InputError, match="expected 2 x 3 actions"):
            vector.step(np.zeros(shape, np.float32))
    vector.close()
