"""Kernels of rotors with a power coefficient, in plain Python: wind over the disk, power, torque and thrust, shaft."""

from __future__ import annotations

from math import cos, pi, sin, tan, tanh
from typing import Any

import numpy as np
import pytest
from plain import plain, record, table

from meltemi.aero.coefficient import power_coefficient, rotor_coefficients, thrust_coefficient
from meltemi.aero.tables import AeroParameters, RotorFlow
from meltemi.environment.rain import RainParameters
from meltemi.simulation.disk import system
from meltemi.simulation.disk.system import Disk, DiskFlow, DiskSystem
from meltemi.structure.tables import ApexColumns, MachineLoad, StructureParameters
from meltemi.turbine import TableCoefficient
from meltemi.turbine.exchange import Drive, PitchMotion
from meltemi.wind.fields import SteadyWind, Wind, WindSeries, wind_field
from meltemi.wind.velocity import series_now

HUB, R, RHO = 100.0, 50.0, 1.2
YAW, SPEED, TWIST, TWIST_RATE = 0.2, 1.1, 0.01, -0.05
RATIOS, PITCHES = np.array([2.0, 6.0, 10.0, 14.0]), np.array([0.0, 0.1, 0.3])
COEFFICIENT = rotor_coefficients(
    TableCoefficient(
        tip_speed_ratio=RATIOS, pitch=PITCHES, power=0.05 * RATIOS[:, None] - 0.002 * RATIOS[:, None] ** 2 - PITCHES,
        thrust=0.3 + 0.04 * RATIOS[:, None] - 0.5 * PITCHES,
    )
)  # fmt: skip


def turbine(wind: Wind, **changes: Any) -> Any:
    field = wind_field(wind, HUB, 2.0 * R)
    members = {
        "q": np.array([YAW, 0.4, TWIST]), "v": np.array([0.0, SPEED - TWIST_RATE, TWIST_RATE]), "a": np.ones(3),
        "locked": np.zeros(3), "columns": table(ApexColumns, {"coordinate": 3}), "points": np.zeros((2, 1)),
        "structure": StructureParameters.of(
            tower_length=HUB, gear_ratio=90.0, generator_inertia=400.0, shaft_stiffness=9e7, shaft_damping=5e6
        ),
        "disk": Disk.of(radius=R, inertia=2e7, friction=3e3, power_exponent=3.0, thrust_exponent=2.0),
        "rotor": RotorFlow.of(), "disk_flow": DiskFlow.of(), "chain": MachineLoad.of(), "rain": RainParameters.of(),
        "aero": AeroParameters.of(air_density=RHO), "drive": Drive.of(brake_speed=1.0),
        "pitch": table(PitchMotion, {"blade": 2}, angle=(0.05, 0.15)),
    }  # fmt: skip
    for record_, names in ((COEFFICIENT, "coefficient ratios pitches values"), (field, "wind times series now box")):
        members |= {name: getattr(record_, name) for name in names.split()}
    m = record(DiskSystem, **(members | changes))
    plain(series_now)(0.0, m)
    return m


def test_the_wind_is_the_mean_over_the_points_of_the_yawed_disk() -> None:
    """Of a wind that is linear to the left and up."""
    wind = WindSeries(time=[0.0], speed=[10.0], horizontal_shear=[0.3], vertical_shear=[0.2], vertical=[0.5])
    left, up = np.array([30.0, -10.0, 25.0]), np.array([20.0, 40.0, -6.0])
    u = plain(system.disk_wind)(0.0, turbine(wind, points=np.array([left, up])))
    expected = 10.0 * (1.0 + 0.3 * left.mean() * cos(YAW) / (2.0 * R) + 0.2 * up.mean() / (2.0 * R))
    assert [*u] == pytest.approx([expected, 0.0, 0.5])


@pytest.mark.parametrize("raining", [0.0, 1e-4, 1.0])
def test_power_torque_and_thrust_in_oblique_wind(raining: float) -> None:
    """(P-1); rain takes all the power at most."""
    m = turbine(
        SteadyWind(speed=10.0, direction=0.3, upflow=0.1),
        rain=RainParameters.of(drag_density=raining, drop_speed=6.0, radius=R),
    )
    plain(system.aerodynamics)(0.0, m)
    across, ratio = 0.3 + YAW, R * SPEED / 10.0  # the wind blows to the right, the nacelle is turned to the left
    coefficients = [
        [plain(c)(ratio, p, COEFFICIENT) for p in (0.05, 0.15)] for c in (power_coefficient, thrust_coefficient)
    ]
    c_p, c_t = np.mean(coefficients, axis=1)
    loss = raining * 36.0 * pi * R * R * 10.0
    power = 0.5 * RHO * pi * R**2 * 1e3 * c_p * cos(across) ** 3
    lost = min(loss, power)
    assert (lost == 0.0, lost == power) == (raining == 0.0, raining == 1.0)
    assert m.rotor.torque == pytest.approx((power - lost) / SPEED, abs=1e-6)
    assert m.rotor.thrust == pytest.approx(0.5 * RHO * pi * R**2 * 100.0 * c_t * cos(across) ** 2)
    assert (m.rotor.tip_ratio, m.rotor.skew) == pytest.approx((ratio, across))
    assert m.rotor.axial_wind == pytest.approx(10.0 * cos(across))
    assert [*m.rotor.wind] == pytest.approx([10.0 * cos(0.3), -10.0 * sin(0.3), 10.0 * tan(0.1)])
    flow = (m.disk_flow.wind_speed, m.disk_flow.power_coefficient, m.disk_flow.rain_loss)
    assert flow == pytest.approx((10.0, c_p, lost))
    assert m.disk_flow.aerodynamic_power == pytest.approx(power - lost, abs=1e-6)


def test_no_power_from_behind_and_little_wind_has_a_torque() -> None:
    m = turbine(SteadyWind(speed=10.0, direction=2.0))
    plain(system.aerodynamics)(0.0, m)
    assert (m.rotor.torque, m.rotor.thrust) == (0.0, 0.0)
    m = turbine(SteadyWind(speed=10.0), v=np.zeros(3))
    plain(system.aerodynamics)(0.0, m)
    c_p = np.mean([plain(power_coefficient)(0.01, p, COEFFICIENT) for p in (0.05, 0.15)])
    expected = 0.5 * RHO * pi * R**2 * 1e3 * c_p * cos(YAW) ** 3 * R / (0.01 * 10.0)
    assert m.rotor.torque == pytest.approx(expected)
    m = turbine(SteadyWind(speed=0.05))
    plain(system.aerodynamics)(0.0, m)
    assert m.rotor.tip_ratio == pytest.approx(R * SPEED / 0.1)


@pytest.mark.parametrize("locked", [(), (1,), (2,), (1, 2)])
def test_accelerations_of_the_shaft(locked: tuple[int, ...]) -> None:
    """(P-6, P-7)"""
    m = turbine(SteadyWind(speed=10.0), locked=np.isin(range(3), locked).astype(float))
    m.rotor.torque, m.drive.generator_torque, m.drive.brake_torque = 4e6, 3e4, 1e3
    plain(system.shaft)(m)
    held = 90.0 * (3e4 + 1e3 * tanh(90.0 * (SPEED - TWIST_RATE)))
    driving, other, twist = 4e6 - 3e3 * SPEED, 90.0**2 * 400.0, 9e7 * TWIST + 5e6 * TWIST_RATE
    if 2 in locked:
        rotor = generator = (driving - held) / (2e7 + other)
    else:
        rotor, generator = (driving - twist) / 2e7, (twist - held) / other
    if 1 in locked:
        rotor, generator = (0.0 if 2 in locked else rotor), 0.0
    assert m.a == pytest.approx([0.0, generator, rotor - generator])
    assert m.chain.rotor_acceleration == pytest.approx(rotor)
    assert [*m.chain.apex_moment] == pytest.approx([4e6 - 2e7 * rotor, 0.0, 0.0])
