"""The kind of rotor with blades on a tower, see ``simulation.rotors``."""

from __future__ import annotations

import math
from importlib import import_module

from meltemi.simulation import vibrations
from meltemi.simulation.bladed.build import build_bladed
from meltemi.simulation.bladed.rotor import bladed_channels
from meltemi.simulation.channels import find
from meltemi.simulation.rotors import RotorKind

KIND = RotorKind(
    build=build_bladed,
    time_step=vibrations.time_step,
    step_weights=vibrations.step_weights,
    step_cause=lambda model: (
        f"coordinate {vibrations.fastest_coordinate(model)!r} is very stiff for its inertia, with "
        f"{vibrations.highest_frequency(model):.3g} rad/s"
    ),
    channels=bladed_channels,
    channel=lambda name, model, available: find(name, available),
    operating_point=lambda *given, **others: import_module("meltemi.simulation.trim").operating_point(*given, **others),
    reach=lambda t: t.nacelle.overhang + t.rotor_radius * math.sin(t.hub.precone + t.nacelle.tilt),
    brake_inertia=lambda t: t.drivetrain.generator_inertia,
    tables=tuple(
        "structure blade_nodes blade_edges shape second modal tip_shape tip_second top_shape top_second tower_matrix "
        "tower_weight tower_nodes tower_shape aero aero_nodes polars section tower_flow actuators".split()
    ),
)
