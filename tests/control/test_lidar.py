"""The nacelle lidar: closed forms of its probe volumes, scans, blockage, controllers and preview."""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
import pytest

import meltemi
from meltemi.control.signals import Measurements
from meltemi.control_laws.lidar import LidarSensor, lidar_scan, lidar_wind
from meltemi.core.errors import InputError
from meltemi.studies.lidar import Lidar, lidar_preview, line_of_sight_speeds, measure_lidar

SPEED, LENGTH = 10.0, 120.0
"""[m/s] of the wind; [m] wave length of its fluctuation."""


@pytest.fixture(scope="module")
def waves() -> meltemi.WindBox:
    """A frozen wave of 1 m/s, uniform across."""
    dt = 0.2
    t = dt * np.arange(3000)
    u = SPEED + np.sin(2.0 * math.pi * SPEED * t / LENGTH)
    velocity = np.zeros((len(t), 4, 4, 3), dtype=np.float32)
    velocity[..., 0] = u[:, None, None]
    return meltemi.WindBox(velocity=velocity, dt=dt, dy=80.0, dz=80.0, bottom=10.0, speed=SPEED)


def test_a_uniform_wind_gives_its_component(turbine: meltemi.turbine.Turbine) -> None:
    lidar = Lidar(beams=((0.3, 0.2), (-0.3, 0.0)))
    found = measure_lidar(turbine, meltemi.SteadyWind(speed=12.0, shear_exponent=0.0), lidar, 5.0)
    speed = np.array([found.line_of_sight[i] for i in range(12)]).reshape(2, 6)
    assert speed[0] == pytest.approx(12.0 * math.cos(0.3) * math.cos(0.2), rel=1e-9)
    assert speed[1] == pytest.approx(12.0 * math.cos(0.3), rel=1e-9)
    assert lidar_wind(found, 3) == pytest.approx(12.0)
    aside = measure_lidar(turbine, meltemi.SteadyWind(speed=12.0, direction=0.1, shear_exponent=0.0), lidar, 5.0)
    assert aside.line_of_sight[6] == pytest.approx(12.0 * math.cos(0.3 + 0.1), rel=1e-6)


@pytest.mark.parametrize("kind", ["pulsed", "continuous"])
def test_the_probe_volume_filters_waves_in_closed_form(
    kind: Any, waves: meltemi.WindBox, turbine: meltemi.turbine.Turbine
) -> None:
    """Amplitudes of a frozen wave: exp(-(k sigma)^2 / 2) and exp(-k z_R), and of a point the wave itself."""
    lidar = Lidar(kind=kind, beams=((0.0, 0.0),), ranges=(60.0,), sample_time=0.5, probe_length=40.0)
    k = 2.0 * math.pi / LENGTH
    expected = {
        "pulsed": math.exp(-0.5 * (k * 40.0 / math.sqrt(8.0 * math.log(2.0))) ** 2),
        "continuous": math.exp(-k * 1.55e-6 * 60.0**2 / (math.pi * 0.028**2)),
    }
    # to 480 s, so that the wave reaches the farthest points of the probe volume
    speed = line_of_sight_speeds(turbine, waves, lidar, 480.0)[200:]
    if kind == "continuous":  # the weight ends at the lidar
        length = 1.55e-6 * 60.0**2 / (math.pi * 0.028**2)
        r = np.linspace(0.0, 6000.0, 600001)
        weight = 1.0 / (1.0 + ((r - 60.0) / length) ** 2)
        ahead = abs(np.sum(weight * np.exp(1j * k * r))) / np.sum(weight)
        assert ahead == pytest.approx(expected[kind], rel=0.025)
        expected[kind] = ahead
    assert 0.5 * np.ptp(speed) == pytest.approx(expected[kind], rel=0.01)
    assert expected[kind] < 0.92


def test_scans_hold_and_blades_block(turbine: meltemi.turbine.Turbine) -> None:
    lidar = Lidar(beams=((0.0, 0.3), (0.0, 0.0)), ranges=(100.0,), sample_time=2.0, blade_width=3.0)
    rising = meltemi.WindSeries(time=[0.0, 100.0], speed=[5.0, 105.0])
    x, m = measure_lidar(turbine, rising, lidar, 50.0), Measurements(Measurements.zeros())
    m.n_blades = 3.0
    seen = []
    for time, azimuth in ((0.0, 1.0), (0.9, 1.0), (1.0, 1.0), (2.0, 0.0), (3.0, 1.0), (4.0, 1.0)):
        m.time, m.azimuth = time, azimuth
        lidar_scan(x, m)
        seen.append((x.line_of_sight[0], x.line_of_sight[1], x.seen[0]))
    assert seen[0] == seen[1] and seen[2][0] == seen[1][0]
    assert seen[4][1] > seen[3][1] == seen[2][1]  # the second beam measures half a scan later
    assert seen[3][2] == 0.0 and seen[3][0] == seen[2][0]  # blade 1 stands in the upper beam
    assert seen[5][2] == 1.0 and seen[5][0] > seen[3][0]


def test_plain_and_compiled_controllers_use_it(turbine: meltemi.turbine.Turbine) -> None:
    """A controller that reports what its lidar sees has the wind of later at the hub."""
    model = meltemi.build(turbine, meltemi.ModelOptions(locked=("tower", "blades")))
    wind = meltemi.WindSeries(time=[0.0, 3.0, 4.0, 20.0], speed=[10.0, 10.0, 12.0, 12.0])
    lidar = Lidar(beams=((0.2, 0.0), (-0.2, 0.0)), ranges=(100.0,), sample_time=0.5)
    sensor = measure_lidar(turbine, wind, lidar, 8.0)

    def update(state: Any, measurements: Any, demands: Any, dt: float) -> None:
        x = LidarSensor(state)
        lidar_scan(x, measurements)
        demands.wind_estimate = lidar_wind(x, 0)
        demands.generator_torque = 30000.0

    runs = []
    for chosen in (update, numba.njit(update)):
        controller = meltemi.Controller(update=chosen, init=lambda start: sensor.array.copy())
        start = meltemi.Start(rotor_speed=1.0, pitch=0.0)
        run = meltemi.simulate(
            model, wind, duration=8.0, controller=controller, start=start, channels=("wind_estimate",)
        )
        runs.append(run["wind_estimate"])
    assert np.array_equal(*runs)
    assert runs[0][5] == pytest.approx(10.0, rel=1e-3) and runs[0][-1] == pytest.approx(12.0, rel=1e-3)


def test_the_preview_of_a_lidar_is_the_wind_to_come(model: Any, waves: meltemi.WindBox) -> None:
    """A point-like lidar that sees far enough gives the wave at the rotor; one that does not is refused."""
    lidar = Lidar(beams=((0.0, 0.0),), ranges=(50.0, 150.0), sample_time=0.5, probe_length=0.0)
    table = (3.0, np.linspace(0.0, 0.4, 20))
    known = meltemi.analysis.preview_of(model, waves, table)
    seen = lidar_preview(model, waves, lidar, 100.0, table)
    at = np.arange(30.0, 90.0, 0.5)
    exact, found = (np.interp(at, p.time_step * np.arange(len(p.wind)), p.wind) for p in (known, seen))
    assert found == pytest.approx(exact, abs=0.05)
    assert seen.lead == known.lead
    with pytest.raises(InputError, match="farthest range"):
        lidar_preview(model, waves, lidar.replace(ranges=(8.0,)), 100.0, table)
