"""The electrical system in the machine: torque, power, number types, derivatives, linear models."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi.electrical.tables import N_STATES
from meltemi.gradients.sensitivity import finite_difference_runs, sensitivity
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march

FLOWS = "copper_loss iron_loss converter_loss filter_loss chopper_power electrical_stored_power generator_power".split()
DIP = {"at": 0.5, "until": 0.7, "type": "voltage_dip", "voltage": 0.2}


def turbine_with_machine(name: str = "nrel5mw") -> Any:
    turbine = meltemi.load_turbine(name)
    law = turbine.control
    system = meltemi.turbine.size_electrical(law.torque.rated_power, law.pitch.reference_speed)
    return turbine.replace(electrical=system)


def averaged(turbine: Any, **options: Any) -> Any:
    return meltemi.build(turbine, meltemi.ModelOptions(electrical="averaged", **options))


@pytest.fixture(scope="module")
def model() -> Any:
    return averaged(meltemi.load_turbine("pmsg20mw"))


def closes(result: meltemi.Result) -> float:
    """Largest share of the shaft's power by which the balance of a run does not close."""
    shaft = np.asarray(result["electrical_shaft_power"])
    return float(np.abs(shaft - sum(np.asarray(result[name]) for name in FLOWS)).max() / shaft.max())


@pytest.mark.slow
def test_a_dip_in_a_run(model: Any) -> None:
    result = meltemi.simulate(
        model,
        meltemi.SteadyWind(speed=12.0),
        duration=1.5,
        output_step=0.05,
        channels=["all"],
        events=[DIP, {"at": 1.2, "type": "grid_loss"}],
    )
    result.raise_for_status()
    assert closes(result) < 1e-12
    t, power = result.time, np.asarray(result["generator_power"])
    low = (t > 0.52) & (t < 0.69)
    assert np.allclose(np.asarray(result["grid_voltage"])[low], 0.2)
    assert power[0] == pytest.approx(19.2e6, rel=5e-3)
    assert power[low].max() < 0.2 * power[0]
    assert np.asarray(result["reactive_power"])[low].min() > 3.9e6
    # the rotor feels nothing of the dip; the lost grid takes the torque off, and trips after its time
    torque = np.asarray(result["generator_torque"])
    assert np.allclose(torque[t < 1.19], torque[0], rtol=1e-2)
    assert abs(torque[-1]) < 1e-5 * torque[0]  # the rotor speeds up, and the current control lags behind
    trips = [entry for entry in result.meta["log"] if entry["source"] == "protection"]
    assert [entry["reason"] for entry in trips] == ["grid voltage low for too long"]
    assert trips[0]["time"] == pytest.approx(1.35, abs=2e-3)


def absorbing() -> meltemi.Controller:
    """Asks for 20 MN m and takes 3 Mvar."""
    from meltemi.control import signals as s

    def update(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        demands[s.GENERATOR_TORQUE] = 2e7
        demands[s.REACTIVE_POWER] = -3e6

    return meltemi.Controller(update)


@pytest.mark.slow
def test_reactive_power_is_a_demand_and_frequency_is_followed(model: Any) -> None:
    result = meltemi.simulate(
        model,
        meltemi.SteadyWind(speed=12.0),
        duration=0.5,
        controller=absorbing(),
        channels=["reactive_power", "generator_torque", "generator_power"],
        grid=meltemi.environment.PowerGrid(frequency=50.5),
    )
    result.raise_for_status()
    assert np.asarray(result["reactive_power"])[-1] == pytest.approx(-3e6, rel=1e-3)
    assert np.asarray(result["generator_torque"])[-1] == pytest.approx(2e7, rel=1e-5)


def test_the_operator_asks_for_reactive_power(model: Any) -> None:
    """From the begin on, in time, and beside what a controller demands."""
    series = {"time": [0.0, 0.2, 0.2], "value": [4e6, 4e6, 2e6]}
    result = meltemi.simulate(
        model,
        meltemi.SteadyWind(speed=12.0),
        duration=0.5,
        channels=["reactive_power"],
        grid=meltemi.environment.PowerGrid.model_validate({"reactive_power": series}),
    )
    found = np.asarray(result["reactive_power"])
    assert found[0] == pytest.approx(4e6, rel=1e-6)
    assert np.allclose(found[:4], 4e6, rtol=1e-6)
    assert found[-1] == pytest.approx(2e6, rel=1e-6)

    result = meltemi.simulate(
        model,
        meltemi.SteadyWind(speed=12.0),
        duration=0.5,
        controller=absorbing(),
        channels=["reactive_power"],
        grid=meltemi.environment.PowerGrid(reactive_power=1e6),
    )
    assert np.asarray(result["reactive_power"])[-1] == pytest.approx(-2e6, rel=1e-3)


def test_misunderstandings_are_told() -> None:
    pmsg, wind = meltemi.load_turbine("pmsg20mw"), meltemi.SteadyWind(speed=12.0)
    with pytest.raises(meltemi.InputError, match=r"needs turbine.electrical; size_electrical\(rated_power=5.297e\+06"):
        averaged(meltemi.load_turbine("nrel5mw"))
    with pytest.raises(meltemi.InputError, match=r"machine.rated_speed 122.9 rad/s does not match|makes .* less than"):
        averaged(pmsg.replace(electrical=turbine_with_machine().electrical))
    ideal = meltemi.build(pmsg)
    with pytest.raises(meltemi.InputError, match="set options.electrical: averaged"):
        meltemi.simulate(ideal, wind, duration=1.0, events=[DIP])
    changing = {"time": [0.0, 1.0], "value": [1.0, 0.9]}
    for name, value in (("voltage", 0.9), ("voltage", changing), ("reactive_power", 1e6)):
        grid = meltemi.environment.PowerGrid.model_validate({name: value})
        with pytest.raises(meltemi.InputError, match=rf"grid.{name}: .*set options.electrical: averaged"):
            meltemi.simulate(ideal, wind, duration=1.0, grid=grid)
    with pytest.raises(meltemi.InputError, match=r"4e\+08 var is far beyond the rated power of 2e\+07 W"):
        meltemi.simulate(averaged(pmsg), wind, duration=1.0, grid=meltemi.environment.PowerGrid(reactive_power=4e8))
    with pytest.raises(meltemi.InputError, match="relative to the nominal voltage, not in volts"):
        meltemi.simulate(ideal, wind, duration=1.0, events=[{**DIP, "voltage": 1320.0}])
    with pytest.raises(meltemi.InputError, match="need options.electrical: averaged"):
        meltemi.simulate(ideal, wind, duration=1.0, channels=["dc_link_voltage"])
    with pytest.raises(meltemi.InputError, match="not before the end of the run"):
        meltemi.simulate(averaged(pmsg), wind, duration=1.0, events=[{**DIP, "at": 2.0, "until": 3.0}])


def test_a_point_tells_the_torque_that_cannot_be_made() -> None:
    forced = meltemi.load_turbine("pmsg20mw").replace(
        **{"electrical.forced": True, "electrical.dc_link.voltage": 9000.0}
    )
    point = meltemi.operating_point(averaged(forced), 12.0)
    assert point.imbalance == pytest.approx(point.generator_torque - point["generator_torque"], rel=1e-6)
    assert point.imbalance > 1e4


@pytest.mark.long
def test_lanes_and_floats_agree_through_a_dip() -> None:
    model, ends = averaged(turbine_with_machine()), []
    for numbers in ("lanes", "floats"):
        run = Simulation(
            Run(
                model,
                meltemi.SteadyWind(speed=13.0),
                duration=2.0,
                channels=["generator_torque", "generator_power", "tower_base_moment_side_side", *FLOWS],
                events=[DIP],  # type: ignore[arg-type]
            ),
            numbers=numbers,
        )
        march(run)
        ends.append(run.result())
    scale = np.abs(ends[0].data).max(axis=0)
    assert np.all(np.abs(ends[0].data - ends[1].data) < 1e-10 * np.maximum(scale, 1.0))


@pytest.mark.long
@pytest.mark.parametrize("parameter", ["electrical.flux", "electrical.capacitance", "electrical.voltage_rate"])
def test_derivatives_are_differences_through_a_dip(parameter: str) -> None:
    model = averaged(turbine_with_machine())
    wind = meltemi.SteadyWind(speed=13.0)
    channels = ["generator_power", "dc_link_voltage", "stator_current_q", "grid_current_d", "reactive_power"]
    arguments: dict[str, Any] = {
        "duration": 1.0,
        "channels": channels,
        "output_step": 0.01,
        "events": [{"at": 0.3, "until": 0.4, "type": "voltage_dip", "voltage": 0.85}],
        "start": meltemi.operating_point(model, wind),
    }
    found = sensitivity(Run(model, wind, **arguments), [parameter])
    low, high, step = finite_difference_runs(Run(model, wind, **arguments), parameter)
    expected = (high.data - low.data) / (2.0 * step)
    # as relative changes; differences are taken over 1e-7 of the value, so rounding leaves them seven digits or so
    unit = found.values[0] / np.abs(found.result.data).max(axis=0)
    assert (unit * np.abs(expected).max(axis=0)).max() > 5e-3
    assert np.all(unit * np.abs(found.slopes[..., 0] - expected).max(axis=0) < 1e-7)


@pytest.mark.long
def test_the_linear_model_has_the_bandwidths_of_the_design() -> None:
    model = averaged(turbine_with_machine())
    point = meltemi.operating_point(model, 12.0)
    inputs = ("generator_torque", "reactive_power", "grid_voltage", "grid_frequency")
    outputs = ("generator_torque", "generator_power", "reactive_power", "dc_link_voltage")
    linear = meltemi.analysis.linearise(model, point, inputs=inputs, outputs=outputs, azimuth=0.0)
    first = linear.states.index("stator_d")
    own = slice(first, first + N_STATES)
    poles = np.linalg.eigvals(linear.A[own, own])
    fast = 2.0 * np.pi * 100.0
    assert (
        np.count_nonzero(np.abs(poles + fast) < 0.02 * fast) >= 7
    )  # two each for four currents, one moved by the link
    lock = poles[np.argmin(np.abs(poles - 62.83 * np.exp(0.75j * np.pi)))]
    assert abs(lock) == pytest.approx(62.83, rel=1e-3)
    dc = poles[(np.abs(poles) < 100.0) & (np.abs(np.abs(poles) - 62.83) > 1e-2)]
    assert len(dc) == 2
    assert np.abs(dc) == pytest.approx(62.83, rel=0.1)
    # a torque demand arrives like 1 / (1 + s/w); in the long run its power does, less the losses
    G = linear.response(np.array([1e-3j, 1j * fast]))
    assert abs(G[1, 0, 0]) == pytest.approx(np.sqrt(0.5), rel=1e-3)
    assert abs(linear.response(np.array([1j]))[0, 2, 1]) == pytest.approx(1.0 / np.hypot(1.0, 1.0 / fast), rel=1e-9)
    assert point["generator_power"] < point["generator_torque"] * point["generator_speed"]
