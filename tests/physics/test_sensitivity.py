"""Derivatives of runs against central differences of runs.

What a difference is taken over: steps that move the recorded channel which moves most by MOVES of its standard
deviation (rms over the run). They are small, since polars and wind boxes are piecewise linear. Where a kink lies within
a step h, at h0, the difference has an error e (1 - h0 / h), which is gone with a step of h0; in 4 of 12 winds a blade
node passes a row of the box so closely that the first step reaches it. A derivative that is wrong is so with every
step. With steps smaller than these rounding takes over.

What errors are relative to: the derivative of the statistic, or a tenth of the rms of the series' derivative where that
is more. The rms is the most that mean and standard deviation can change by. Where changes of both signs cancel, the
rest cannot be compared to more digits than its parts have.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import pytest

import meltemi
from meltemi import (
    Controller,
    InputError,
    Model,
    ModelOptions,
    Result,
    RunError,
    Simulation,
    Start,
    Status,
    SteadyWind,
    WindBox,
    simulate,
)
from meltemi.analysis import Sensitivity, finite_difference_runs, sensitivity
from meltemi.compiler import N_DERIVATIVES, crossed
from meltemi.control import StartPoint
from meltemi.control import signals as s
from meltemi.gradients.sensitivity import matched
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import march

pytestmark = pytest.mark.slow

SECONDS = 40.0
CHANNELS = ("rotor_speed", "root_moment_out_of_plane_1", "tower_base_moment_fore_aft", "pitch_1")
PARAMETERS = (
    "controller.proportional_gain",
    "controller.integral_gain",
    "controller.gain_halving_pitch",
    "controller.filter_frequency",
    "controller.rated_power",
    "pitch_offset",
    "actuators.pitch_offset_2",
    "aerodynamics.air_density",
    "turbine.blade.structure.flap_stiffness",
    "turbine.tower.damping.fore_aft",
    "structure.hub_mass",
)
SLOPE = 4.0
MOVES = (6e-7, 2e-7, 7e-8, 2.5e-8)


def box(speed: float, seed: int) -> WindBox:
    wind = meltemi.TurbulentWind(speed=speed, intensity=0.14, seed=seed, points=9)
    return meltemi.wind.generate_field(wind, meltemi.load_turbine("nrel5mw"), SECONDS)


def statistics(result: Result, channel: str) -> tuple[float, float, float]:
    x = result[channel]
    return x.mean(), x.std(), meltemi.loads.damage_equivalent_load(x, duration=SECONDS, slope=SLOPE)


def gradients(found: Sensitivity, channel: str) -> list[tuple[float, Any]]:
    return [found.mean(channel), found.std(channel), found.fatigue(channel, SLOPE)]


def errors(found: Sensitivity, number: int, **arguments: Any) -> Any:
    """(channels, 3) relative errors of mean, standard deviation and equivalent load by a parameter, each the least of
    those with several steps."""
    return np.min([mismatch(found, number, move, **arguments) for move in MOVES], axis=0)


def mismatch(found: Sensitivity, number: int, move: float, **arguments: Any) -> Any:
    """The errors with one step."""
    name = found.parameters[number]
    spread = {c: float(np.sqrt(np.mean(found.series(c)[1][:, number] ** 2))) for c in CHANNELS}
    step = move / max(spread[c] / found.std(c)[0] for c in CHANNELS)
    low, high, step = finite_difference_runs(
        Run(duration=SECONDS, channels=CHANNELS, **arguments), parameter=name, step=step
    )
    low.raise_for_status()
    high.raise_for_status()
    rows = []
    for channel in CHANNELS:
        change = (np.array(statistics(high, channel)) - statistics(low, channel)) / (2.0 * step)
        exact = np.array([gradient[number] for _, gradient in gradients(found, channel)])
        rows.append(np.abs(exact - change) / np.maximum(np.abs(change), 0.1 * spread[channel]))
    return np.array(rows)


@pytest.fixture(scope="module")
def wind() -> WindBox:
    return box(20.0, 3)


@pytest.fixture(scope="module")
def found(model: Model, wind: WindBox) -> Sensitivity:
    assert len(PARAMETERS) > N_DERIVATIVES
    return sensitivity(Run(model, wind, duration=SECONDS, channels=CHANNELS), PARAMETERS)


@pytest.mark.parametrize("name", PARAMETERS)
def test_derivatives_are_limits_of_differences(found: Sensitivity, model: Model, wind: WindBox, name: str) -> None:
    number = PARAMETERS.index(name)
    error = errors(found, number, model=model, wind=wind)
    assert error[:, :2].max() < 1e-5
    assert error[:, 2].max() < 1e-4
    assert np.all(np.abs(found.slopes[..., number]).max(axis=0) > 0.0)


def test_nothing_switches_at_20_metres_a_second(found: Sensitivity) -> None:
    assert found.switches == {"controller": 0, "pitch limits": 0, "stall": 0, "yaw brake": 0}
    assert found.result["pitch_1"].min() > 0.1


def test_the_run_is_that_of_floats(found: Sensitivity, model: Model, wind: WindBox) -> None:
    run = Simulation(Run(model, wind, duration=SECONDS, channels=CHANNELS), numbers="floats")
    march(run)
    for result in (run.result(), simulate(model, wind, duration=SECONDS, channels=CHANNELS)):
        assert np.all(np.abs(found.result.data - result.data).max(axis=0) < 1e-9 * np.abs(result.data).max(axis=0))
    assert found.result.meta["parameters"] == dict(zip(found.parameters, found.values, strict=True))


def test_values_are_those_of_the_usual_functions(found: Sensitivity) -> None:
    for channel in CHANNELS:
        values = [value for value, _ in gradients(found, channel)]
        assert np.allclose(values, statistics(found.result, channel), rtol=1e-12)
    late = found.result.between(20.0, SECONDS)["RootMyc1"]
    assert found.mean("RootMyc1", skip=20.0)[0] == late.mean()
    expected = meltemi.loads.damage_equivalent_load(late, duration=SECONDS - 20.0, slope=10.0)
    assert found.fatigue("RootMyc1", 10.0, skip=20.0)[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.long
def test_near_rated_with_smoothing(model: Model) -> None:
    wind, law = box(11.4, 4), meltemi.control.BaselineController(model.turbine, smoothing=0.01)
    assert simulate(model, wind, duration=SECONDS)["pitch_1"].min() == 0.0
    names = PARAMETERS[:8]
    found = sensitivity(Run(model, wind, duration=SECONDS, channels=CHANNELS, controller=law), names)
    for number in range(len(names)):
        assert errors(found, number, model=model, wind=wind, controller=law).max() < 1e-3


def test_through_events(model: Model, wind: WindBox) -> None:
    """Their times are held; a value that is frozen keeps its derivatives."""
    events: list[dict[str, Any]] = [
        {"at": 2.0, "until": 5.0, "type": "sensor_loss", "sensor": "generator_speed"},
        {"at": 4.0, "type": "pitch_stuck", "blade": 2},
        {"at": 6.0, "until": 7.0, "type": "grid_loss"},
        {"at": 6.0, "type": "sensor_drift", "sensor": "pitch_1", "rate": 1e-3},
        {"at": 7.0, "until": 9.0, "type": "pitch_runaway", "blade": 3, "rate": -0.01},
    ]
    arguments: dict[str, Any] = {"duration": 12.0, "channels": CHANNELS, "events": events}
    names = ["controller.proportional_gain", "aerodynamics.air_density"]
    found = sensitivity(Run(model, wind, **arguments), names)
    plain = sensitivity(Run(model, wind, duration=12.0, channels=CHANNELS), names)
    for number, name in enumerate(names):
        low, high, step = finite_difference_runs(Run(model, wind, **arguments), name)
        change = (high.data - low.data) / (2.0 * step)
        exact = found.slopes[..., number]
        assert np.all(np.abs(change - exact).max(axis=0) < 1e-4 * np.abs(exact).max(axis=0))
        assert np.array_equal(exact[:41], plain.slopes[:41, :, number])
        assert not np.allclose(exact[60:], plain.slopes[60:, :, number], rtol=0.1)
    run = Simulation(Run(model, wind, **arguments), numbers="floats")
    march(run)
    for result in (run.result(), simulate(model, wind, **arguments)):
        assert np.all(np.abs(found.result.data - result.data).max(axis=0) < 1e-9 * np.abs(result.data).max(axis=0))
    assert len(found.result.log) == 8


@pytest.mark.long
def test_switches_are_counted(model: Model) -> None:
    wind = box(11.4, 4)
    arguments: dict[str, Any] = {"duration": SECONDS, "channels": CHANNELS}
    run = Run(model, wind, **arguments)
    usual = sensitivity(run, ["controller.rated_power"])
    wide = sensitivity(run, ["controller.rated_power"], steps={"controller.rated_power": 1e5})
    tiny = sensitivity(run, ["controller.rated_power"], steps={"controller.rated_power": 1e-3})
    assert wide.switches["controller"] > usual.switches["controller"] >= tiny.switches["controller"] == 0  # type: ignore[operator]
    assert wide.switches["pitch limits"] > 0  # type: ignore[operator]
    # the step decides what is counted, not the derivative
    assert np.allclose(wide.slopes, tiny.slopes, rtol=1e-9, atol=1e-12 * np.abs(tiny.slopes).max())
    storm = sensitivity(
        Run(
            model,
            SteadyWind(speed=28.0, direction=0.5),
            duration=10.0,
            controller=meltemi.control.ConstantController(),
            start=Start(rotor_speed=0.3, pitch=0.9),
        ),
        ["pitch_offset"],
        steps={"pitch_offset": 0.05},
    )
    assert storm.switches["stall"] > 0  # type: ignore[operator]
    assert storm.switches["controller"] is None


def test_tables_by_differences_follow_models_that_are_built_anew(model: Model, wind: WindBox) -> None:
    name = "turbine.blade.structure.flap_stiffness"
    point = meltemi.operating_point(model, 20.0)
    found = sensitivity(Run(model, wind, duration=20.0, channels=CHANNELS, start=point), [name])
    given = model.turbine.blade.structure.flap_stiffness
    assert given is not None
    sides = []
    for factor in (1.0 - 1e-4, 1.0 + 1e-4):
        turbine = model.turbine.replace(**{name.removeprefix("turbine."): (factor * given).tolist()})
        built = matched(meltemi.build(turbine), model)
        sides.append(simulate(built, wind, duration=20.0, channels=CHANNELS, start=point))
    for channel in CHANNELS:
        exact = found.series(channel)[1][:, 0]
        change = (sides[1][channel] - sides[0][channel]) / 2e-4
        assert np.abs(change - exact).max() < 2e-3 * np.abs(exact).max()


def test_matched_modes_move_the_machine_alike(model: Model) -> None:
    """With the signs of all modes turned, the same turbine."""
    from dataclasses import replace

    turned = {
        name: replace(member, modes=replace(member.modes, shape=-member.modes.shape))
        for name, member in (("blade", model.rotor.blade), ("tower", model.rotor.tower))
    }
    other = matched(model, replace(model, rotor=replace(model.rotor, **turned)))
    assert not np.array_equal(other.rotor.shape, model.rotor.shape)
    wind, start = box(20.0, 3), Start(rotor_speed=1.267, pitch=0.3, generator_torque=4e4)
    undeflected = replace(start, coordinates={})
    ours, theirs = (simulate(m, wind, duration=5.0, start=undeflected) for m in (model, other))
    assert np.all(np.abs(ours.data - theirs.data).max(axis=0) <= 1e-9 * np.abs(ours.data).max(axis=0))
    # each begins in an equilibrium of its own
    assert other.content_hash() != model.content_hash()
    ours, theirs = (simulate(m, wind, duration=1.0, start=start) for m in (model, other))
    assert ours["tower_top_fore_aft"] == pytest.approx(theirs["tower_top_fore_aft"], rel=1e-5)


GAIN, REFERENCE, COUNT = range(3)


@numba.njit
def proportional(state: Any, measurements: Any, demands: Any, dt: float) -> None:
    error = measurements[s.GENERATOR_SPEED] - state[REFERENCE]
    pitch = min(max(0.3 + state[GAIN] * error, 0.0), 1.5)
    state[COUNT] += crossed(error)
    demands[s.GENERATOR_TORQUE] = 5.29661e6 / max(measurements[s.GENERATOR_SPEED], 1.0)
    for blade in range(3):
        demands[s.PITCH_DEMAND + blade] = pitch


def plain(state: Any, measurements: Any, demands: Any, dt: float) -> None:
    demands[s.GENERATOR_TORQUE] = 4e4


@numba.njit
def sliced(state: Any, measurements: Any, demands: Any, dt: float) -> None:
    demands[s.GENERATOR_TORQUE] = 4e4 * measurements[s.PITCH : s.PITCH + 3].mean()


def begin(start: StartPoint) -> list[float]:
    return [0.004, start.generator_speed, 0.0]


@pytest.mark.long
def test_own_controllers(model: Model, wind: WindBox) -> None:
    named = Controller(proportional, init=begin, name="mine", state_names=("gain", "reference", "switches"))
    names = ["controller.gain", "controller.reference", "aerodynamics.air_density"]
    found = sensitivity(Run(model, wind, duration=SECONDS, channels=CHANNELS, controller=named), names)
    assert found.values[:2] == pytest.approx([0.004, 122.9096], rel=1e-3)
    for number in range(3):
        error = errors(found, number, model=model, wind=wind, controller=named)
        assert error[:, :2].max() < 1e-5
        assert error[:, 2].max() < 1e-4
    assert found.switches["controller"] is not None
    numbered = Controller(proportional, init=begin)
    other = sensitivity(Run(model, wind, duration=SECONDS, channels=CHANNELS, controller=numbered), ["controller.0"])
    assert np.allclose(other.slopes[..., 0], found.slopes[..., 0], rtol=1e-9)
    assert other.switches["controller"] is None


@pytest.mark.long
def test_a_compiled_controller_around_the_baseline(model: Model, wind: WindBox) -> None:
    law = meltemi.control.BaselineController(model.turbine)
    inner = law.update

    @numba.njit
    def around(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        inner(state, measurements, demands, dt)
        demands[s.PITCH_DEMAND] += 1e-9 * measurements[s.OUT_OF_PLANE_MOMENT]

    own = Controller(around, init=law.init, state_names=law.state_names)
    names = ["controller.proportional_gain", "pitch_offset"]
    found = sensitivity(Run(model, wind, duration=SECONDS, channels=CHANNELS, controller=own), names)
    for number in range(2):
        assert errors(found, number, model=model, wind=wind, controller=own).max() < 1e-4


def refused(model: Model, parameters: Any, words: str, steps: Any = None, **arguments: Any) -> None:
    with pytest.raises(InputError, match=words):
        sensitivity(Run(model, SteadyWind(speed=18.0), **{"duration": 1.0, **arguments}), parameters, steps=steps)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ([], "at least one"),
        ("pitch_offset", "list"),
        (["pitch_offset", "pitch_offset"], "twice"),
        (["aerodynamics.air_densty"], "no parameter.*air_density"),
        (["controller.proportional"], "has no.*controller.proportional_gain"),
        (["blade.structure.flap_stiffness"], "turbine.PATH"),
        (["turbine.blade.structure.flap_stifness"], "flap_stiffness"),
        (["turbine.name"], "neither a number nor a list of numbers"),
        (["turbine.n_blades"], "n_blades.*cannot be changed"),
        (["turbine.control.pitch.proportional_gain"], "controller.NAME"),
        (["turbine.drivetrain.generator_efficiency"], "changes nothing"),
        (["nonsense"], "no parameter"),
    ],
)
def test_parameters_that_are_refused(model: Model, parameters: Any, words: str) -> None:
    refused(model, parameters, words)


def test_other_refusals(model: Model) -> None:
    some = ["pitch_offset"]
    refused(model, some, "plain.*plain Python.*njit", controller=Controller(plain))
    refused(model, some, "sliced.*no derivatives", controller=Controller(sliced))
    refused(model, some, "step for", steps={"pitch_ofset": 1.0})
    refused(model, some, "positive", steps={"pitch_offset": -1.0})
    refused(model, some, "state_names", controller=Controller(proportional, state_names=("a", "b")))
    refused(model, some, "duration", duration=-1.0)


def test_locked_two_bladed_and_stations(model: Model) -> None:
    turbine = model.turbine.replace(n_blades=2)
    two = meltemi.build(turbine, ModelOptions(locked=("tower",)))
    stations = meltemi.Stations(blade=(20.0,))
    arguments: dict[str, Any] = {
        "wind": SteadyWind(speed=16.0),
        "start": Start(rotor_speed=1.267, pitch=0.2, generator_torque=4e4),
        "duration": 5.0,
        "channels": ["RootMyc1", "azimuth", "tower_top_fore_aft"],
        "stations": stations,
    }
    found = sensitivity(Run(two, **arguments), parameters=["structure.gravity", "aerodynamics.air_density"])
    assert found.slopes.shape == (101, len(found.result.channels), 2)
    errors = []
    for asked in (None, 1e-8):  # rounding decides which of both crosses a kink of the model
        low, high, step = finite_difference_runs(
            Run(two, **arguments), parameter="aerodynamics.air_density", step=asked
        )
        change = high.data - low.data
        angle = [channel.wrap for channel in found.result.channels]  # slopes have no jump at a full turn
        change[:, angle] = (change[:, angle] + np.pi) % (2.0 * np.pi) - np.pi
        errors.append(np.abs(change / (2.0 * step) - found.slopes[:, :, 1]).max(axis=0))
    assert np.all(np.min(errors, axis=0) <= 1e-4 * np.abs(found.slopes[:, :, 1]).max(axis=0))
    assert np.all(found.slopes[:, found.result.names.index("tower_top_fore_aft")] == 0.0)


def test_a_run_that_diverges_has_no_statistics(model: Model) -> None:
    wild = meltemi.build(model.turbine, ModelOptions(time_step=0.1))
    names = [f"structure.{name}" for name in "hub_mass gravity tilt precone overhang gear_ratio nacelle_mass".split()]
    found = sensitivity(
        Run(
            wild,
            SteadyWind(speed=11.0),
            duration=3.0,
            start=Start(rotor_speed=1.2),
            output_step=0.1,
        ),
        [*names, "pitch_offset", "aerodynamics.air_density"],
    )
    assert found.result.status is Status.DIVERGED
    assert found.slopes.shape == (*found.result.data.shape, 9)
    with pytest.raises(RunError, match="diverged"):
        found.mean("rotor_speed")


def test_statistics_of_what_is_not_there(found: Sensitivity) -> None:
    with pytest.raises(InputError, match="leaves nothing"):
        found.mean("rotor_speed", skip=SECONDS)
    with pytest.raises(InputError, match="rotor_speed"):
        found.std("rotor_sped")


def test_progress_and_interrupts(model: Model) -> None:
    shares: list[float] = []
    names = [name for name in model.parameter_names() if name.startswith("structure.hub")][:3] + list(PARAMETERS[:6])
    sensitivity(Run(model, SteadyWind(speed=18.0), duration=20.0, progress=shares.append), names)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0

    def stop(share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sensitivity(Run(model, SteadyWind(speed=18.0), duration=20.0, progress=stop), ["pitch_offset"])
