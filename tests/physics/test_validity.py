"""Runs beyond what the model is made for end as DOUBTFUL and say what, how far and when; usual ones are OK."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import Model, Result, RunError, Start, Status, SteadyWind, Turbine
from meltemi.iec.models import iec_wind
from meltemi.simulation import validity
from meltemi.simulation.run import Run
from meltemi.simulation.simulate import Simulation, march
from meltemi.simulation.tables import Watch

WIND = SteadyWind(speed=12.0)
CHANNELS = ["rotor_speed", "generator_power", "tip_out_of_plane_1", "tip_clearance_1"]


def run(model: Model, wind: Any = WIND, duration: float = 2.0, **others: Any) -> Result:
    return meltemi.simulate(model, wind, duration=duration, channels=CHANNELS, **others)


def told(result: Result) -> str:
    return " ".join(finding.what for finding in result.findings)


@pytest.fixture(scope="module")
def overspeed(model: Model) -> Result:
    """From 48 rpm: it used to be OK with the blade bent beyond all measure and through the tower."""
    return run(model, SteadyWind(speed=20.0), 4.0, start=Start(rotor_speed=5.0))


def test_overspeed_and_deflection(overspeed: Result) -> None:
    assert overspeed.status is Status.DOUBTFUL
    assert overspeed.time[-1] == pytest.approx(4.0)
    for words in ("1.5 times its rated speed", "beyond the model's range"):
        assert words in told(overspeed) and words in overspeed.message
    speed, bent = overspeed.findings[:2]
    assert speed.time == 0.0
    assert speed.limit == pytest.approx(1.5 * 12.1 * math.pi / 30.0, rel=1e-3)
    assert speed.value >= overspeed["rotor_speed"].max()
    assert 0.0 < bent.time < 1.0
    assert bent.value > np.abs(overspeed["tip_out_of_plane_1"]).max() * 0.8
    with pytest.raises(RunError, match="rated speed"):
        overspeed.raise_for_status()


def test_blades_in_the_tower(turbine: Turbine) -> None:
    """A rotor 2 m nearer to the tower, without tilt."""
    near = meltemi.build(turbine.replace(**{"nacelle.tilt": 0.0, "nacelle.overhang": 3.0}))
    result = run(near, duration=5.0)
    assert result.status is Status.DOUBTFUL
    assert told(result) == "blade within the tower's surface, by"
    with pytest.raises(RunError, match="tower"):
        result.raise_for_status()


@pytest.mark.slow
def test_findings_stand_wherever_the_result_goes(overspeed: Result, model: Model, tmp_path: Path) -> None:
    assert f"{overspeed.status}" == str(overspeed.status) == "DOUBTFUL"
    assert "DOUBTFUL; rotor faster" in repr(overspeed)
    path = meltemi.io.write_netcdf(overspeed, tmp_path / "result.nc")
    again = meltemi.io.read_netcdf(path)
    assert again.status is Status.DOUBTFUL
    assert again.findings == overspeed.findings
    assert overspeed.to_xarray().attrs["status_name"] == "DOUBTFUL"
    fast = meltemi.Run(model, WIND, duration=0.5, start=Start(rotor_speed=5.0), channels=CHANNELS)
    usual = meltemi.Run(model, WIND, duration=0.5, channels=CHANNELS)
    first, second = meltemi.simulate_batch([fast, usual], workers=1)
    assert not first.ok and first.status is Status.DOUBTFUL and "rated speed" in first.message
    assert isinstance(first.value, Result)
    assert second.ok


def test_a_reversed_rotor_under_torque(model: Model) -> None:
    law = meltemi.control.ConstantController()
    torque = model.turbine.control.torque.maximum_torque
    result = run(model, controller=law, start=Start(rotor_speed=-0.5, pitch=math.pi / 2, generator_torque=torque))
    assert "drives a rotor that turns backwards" in told(result)
    assert result.findings[0].value == pytest.approx(0.5 * 97.0 * torque, rel=0.3)


def test_power_above_that_of_the_wind(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing else makes this: the share of the wind that counts is lowered."""
    assert run(model, SteadyWind(speed=9.0), 6.0).status is Status.OK
    monkeypatch.setattr(validity, "WIND_POWER", 0.06)
    result = run(model, SteadyWind(speed=9.0), 6.0)
    assert "power above that of the wind" in told(result)
    available = 0.5 * 1.225 * math.pi * model.turbine.rotor_radius**2 * 9.0**3
    excess = (0.47 - 0.06) * available
    assert result.findings[0].value == pytest.approx(excess * (1.0 - math.exp(-0.6)), rel=0.2)


def test_pitch_beyond_half_a_turn(model: Model) -> None:
    simulation = Simulation(Run(model, WIND, duration=1.0, channels=CHANNELS))
    simulation.case["watch"][Watch.index("limit"), validity.PITCH] = -1.0  # actuators have closer limits
    march(simulation)
    assert "half a turn" in told(simulation.result())
    with pytest.raises(meltemi.InputError, match="not between -pi and pi"):
        run(model, start=Start(rotor_speed=1.0, pitch=math.radians(1e6)))


def test_a_blade_of_a_third_of_its_stiffness_strikes_the_tower(model: Model) -> None:
    """In an extreme gust; with all of it there are metres of room."""
    blade = model.turbine.blade.structure
    soft = model.turbine.replace(**{"blade.structure.flap_stiffness": 0.3 * blade.flap_stiffness})
    wind = iec_wind(turbine=model.turbine, model="EOG", wind_class="IA", speed=11.4, begin=2.0)
    assert run(model, wind, 12.0).status is Status.OK
    result = run(meltemi.build(soft), wind, 12.0)
    assert result.status is Status.DOUBTFUL
    assert "within the tower's surface" in told(result)
    assert any("blade: its stiffness" in words for words in result.warnings)


@pytest.mark.slow
def test_an_extreme_between_outputs_is_seen(model: Model) -> None:
    often = run(model, SteadyWind(speed=20.0), 3.0, start=Start(rotor_speed=5.0))
    seldom = run(model, SteadyWind(speed=20.0), 3.0, start=Start(rotor_speed=5.0), output_step=1.0)
    assert seldom.findings == often.findings


def test_a_new_begin_forgets_the_findings(model: Model) -> None:
    simulation = Simulation(Run(model, SteadyWind(speed=20.0), duration=1.0, start=Start(rotor_speed=5.0)))
    march(simulation)
    assert simulation.status is Status.DOUBTFUL and simulation.finished
    simulation.reset()
    assert not simulation.finished
    assert [finding["what"][:12] for finding in validity.violations(simulation.case["watch"])] == []


def test_a_parked_turbine_is_not_driven(model: Model) -> None:
    """Feathered at 12 m/s the generator drove the rotor backwards with 2.7 MW."""
    result = run(model, WIND, 10.0, start=Start(rotor_speed=0.0, pitch=math.pi / 2))
    assert result.status is Status.OK
    assert result["generator_power"].min() == 0.0
    assert result["rotor_speed"].min() > -0.02


@pytest.mark.parametrize("name", ["EOG", "ECD", "ETM"])
def test_usual_winds_are_fine(model: Model, name: str) -> None:
    wind = iec_wind(
        turbine=model.turbine, model=name, wind_class="IA", speed=11.4, **({} if name == "ETM" else {"begin": 5.0})
    )
    result = run(model, wind, 30.0)
    assert result.status is Status.OK, result.message
    assert result.findings == () and result.message == ""


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n in meltemi.list_turbines() if not n.startswith("iea")])
@pytest.mark.parametrize("speed", [7.0, 11.0, 23.0])
def test_turbines_of_the_library_are_fine(name: str, speed: float) -> None:
    turbine = meltemi.load_turbine(name)
    speed = min(speed, turbine.cut_out - 2.0)
    wind = iec_wind(turbine=turbine, model="NTM", wind_class="IA", speed=speed, seed=2)
    result = meltemi.simulate(meltemi.build(turbine), wind, duration=60.0)
    assert result.findings == () and result.warnings == ()


def test_unusual_winds_are_named(model: Model) -> None:
    result = run(model, SteadyWind(speed=12.0, shear_exponent=0.99, upflow=0.99), 0.5, start=Start(rotor_speed=1.0))
    assert any("shear exponent of 0.99" in words for words in result.warnings)
    assert any("upflow of 56.7 deg" in words for words in result.warnings)
    assert run(model, SteadyWind(speed=12.0, shear_exponent=0.3, upflow=0.14), 0.5).warnings == ()


# warnings -------------------------------------------------------------------------------------------------


def warned(result: Result, words: str) -> bool:
    return any(words in warning for warning in result.warnings)


def test_a_usual_run_has_no_warning(model: Model) -> None:
    wind = iec_wind(turbine=model.turbine, model="NTM", wind_class="IA", speed=11.4, seed=3)
    assert run(model, wind, 60.0).warnings == ()


def test_a_fast_rotor_is_named_before_it_is_doubtful(model: Model) -> None:
    rated = model.turbine.control.pitch.reference_speed / model.turbine.drivetrain.gear_ratio
    result = run(model, 8.0, 0.5, start=Start(rotor_speed=1.3 * rated))
    assert result.status is Status.OK
    assert warned(result, "rotor overspeed 15.")
    assert not warned(run(model, 8.0, 0.5, start=Start(rotor_speed=1.1 * rated)), "overspeed")


def test_a_blade_near_the_tower_is_named_at_the_given_distance(model: Model) -> None:
    base = validity.undeflected_clearance(model)
    assert base == pytest.approx(10.6, abs=0.5)  # by hand from the report's geometry
    near = meltemi.build(model.turbine, model.options.replace(tower_clearance=0.9 * base))
    assert warned(run(near, 11.0, 6.0), "distance of its tip from the surface")
    assert not warned(run(model, 11.0, 6.0), "tower")
    result = run(near, 11.0, 6.0)
    value = float(next(w for w in result.warnings if "tower" in w).split("surface ")[1].split()[0])
    lowest = result["tip_clearance_1"].min()  # from the axis, about two radii further
    assert 1.5 < lowest - value < 3.5


def test_blades_that_bend_far_are_named(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    assert not warned(run(model, 10.0, 20.0), "bend beyond the range")
    monkeypatch.setitem(validity.RANGES, model.options.blade_model, 0.06)
    assert warned(run(model, 10.0, 20.0), "tip deflection (10 s mean)")


def test_growing_edgewise_vibrations_are_named(model: Model) -> None:
    """Feathered blades in a storm: by static polars their damping is negative in stall, as in OpenFAST."""
    static = meltemi.build(model.turbine, model.options.replace(locked=("generator",), stall="static"))
    for yaw, grows in ((-15.0, True), (0.0, False)):
        storm = SteadyWind(speed=59.5, shear_exponent=0.11, direction=math.radians(yaw))
        law = meltemi.control.ConstantController()
        result = run(static, storm, 50.0, start=Start(pitch=math.pi / 2), controller=law)
        assert warned(result, "growing edgewise vibration") is grows
