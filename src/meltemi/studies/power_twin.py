"""``power_turbine_of``: conversion of an aeroelastic turbine to a power-coefficient turbine."""

from __future__ import annotations

from meltemi.analyses.performance import performance_of
from meltemi.analyses.rotor_performance import RotorPerformance
from meltemi.simulation.rotors import build
from meltemi.tuning.baseline_tuning import rotor_inertia
from meltemi.turbine.definition import Turbine, YawDrive
from meltemi.turbine.power_turbine import PowerTurbine, Shaft, TableCoefficient

SAME = ("n_blades", "rated_power", "cut_in", "cut_out", "rotor_radius", "hub_height", "electrical", "control")
"""Fields that both kinds of turbine have."""


def power_turbine_of(
    turbine: Turbine, performance: RotorPerformance | None = None, *, flexible_shaft: bool = False
) -> PowerTurbine:
    """Power-coefficient turbine with the rotor, inertia, actuators, yaw drive and control of an aeroelastic one.

    Pitch bearings keep only the constant part of their friction: without blades they carry no load.

    Args:
      turbine: aeroelastic turbine.
      performance: performance of its rotor; by default that of the rigid rotor with tilt, cone and tower.
      flexible_shaft: keep the torsion of the drivetrain; without it, the time step may be ten times as long.
    """
    p = performance or performance_of(turbine)
    d, actuator = turbine.drivetrain, turbine.pitch_actuator
    if actuator.friction is not None:
        actuator = actuator.replace(**{"friction.coefficient": 0.0})
    return PowerTurbine(
        name=f"{turbine.name}, power coefficient",
        description=f"{turbine.description or turbine.name}, by its power coefficient",
        source=turbine.source,
        coefficient=TableCoefficient(
            tip_speed_ratio=p.tip_speed_ratio, pitch=p.pitch, power=p.power, thrust=p.thrust, source="rotor_performance"
        ),
        drivetrain=Shaft(
            gear_ratio=d.gear_ratio,
            rotor_inertia=rotor_inertia(build(turbine)),
            generator_inertia=d.generator_inertia,
            stiffness=d.stiffness if flexible_shaft else None,
            damping=d.damping if flexible_shaft else 0.0,
            generator_efficiency=d.generator_efficiency * d.gearbox_efficiency,
            brake_torque=d.brake_torque,
            source=d.source,
        ),
        pitch_actuator=actuator,
        yaw=YawDrive(rate=turbine.yaw.rate, acceleration=turbine.yaw.acceleration),
        **{name: getattr(turbine, name) for name in SAME},
    )
