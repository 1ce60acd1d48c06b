"""``power_turbine_of``: the turbine of a power coefficient that an aeroelastic one is when nothing of it bends."""

from __future__ import annotations

from meltemi.simulation.engines import build
from meltemi.simulation.performance import performance_of
from meltemi.studies.baseline_tuning import rotor_inertia
from meltemi.turbine.definition import Turbine, YawDrive
from meltemi.turbine.performance import RotorPerformance
from meltemi.turbine.power_turbine import PowerTurbine, Shaft, TableCoefficient


def power_turbine_of(
    turbine: Turbine, performance: RotorPerformance | None = None, *, flexible_shaft: bool = False
) -> PowerTurbine:
    """The same rotor as a table of coefficients, with the same inertia, actuators, yaw drive and control.

    Args:
      turbine: aeroelastic.
      performance: of its rotor; by default that of the rigid rotor as built, with tilt, cone and tower.
      flexible_shaft: with the torsion of its drivetrain; without, a step of time may be ten times as long.
    """
    p = performance or performance_of(turbine)
    d = turbine.drivetrain
    return PowerTurbine(
        name=f"{turbine.name}, power coefficient",
        description=f"{turbine.description or turbine.name}, by its power coefficient",
        source=turbine.source,
        n_blades=turbine.n_blades,
        rated_power=turbine.rated_power,
        cut_in=turbine.cut_in,
        cut_out=turbine.cut_out,
        rotor_radius=turbine.rotor_radius,
        hub_height=turbine.hub_height,
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
        pitch_actuator=turbine.pitch_actuator,
        yaw=YawDrive(rate=turbine.yaw.rate, acceleration=turbine.yaw.acceleration),
        electrical=turbine.electrical,
        control=turbine.control,
    )
