"""Frequencies and damping of free decays against OpenFAST."""

from __future__ import annotations

from comparisons import reference_table, source_of
from comparisons.measure import decay
from meltemi.control.constant import ConstantController
from meltemi.simulation.simulate import simulate
from meltemi.simulation.start import Start
from meltemi.verification.modes import damping_row, model_at
from meltemi.verification.table import CheckTable, relative
from meltemi.wind.fields import SteadyWind


def decays() -> CheckTable:
    """Free decays from an initial deflection."""
    blades = {f"blade {b} 1st flap": 1.9752 for b in (1, 2, 3)} | {f"blade {b} 1st edge": 0.2535 for b in (1, 2, 3)}
    cases = {
        "tower_fa": ({"tower 1st fore-aft": 0.5}, 9.80665, (), 100.0),
        "tower_ss": ({"tower 1st side-side": 0.5}, 9.80665, (), 100.0),
        "tower_fa_rigidblades_g0": ({"tower 1st fore-aft": 0.5}, 0.0, ("blades", "drivetrain"), 100.0),
        "flap": (blades, 0.0, ("tower", "drivetrain"), 60.0),
    }
    rows = []
    for r in reference_table("decay"):
        deflection, gravity, locked, duration = cases[r["case"]]
        model = model_at(gravity, locked=("yaw", "generator", *locked))
        model = model.with_parameters(**{"aerodynamics.air_density": 0.0})
        result = simulate(
            model,
            SteadyWind(speed=0.0),
            duration=duration,
            controller=ConstantController(),
            start=Start(coordinates=deflection),
            channels=[r["channel"]],
        )
        frequency, damping = decay(result.time, result[r["channel"]])
        rows.append(relative("frequency", r["case"], "Hz", float(r["frequency_hz"]), frequency, 1.5))
        rows.append(damping_row("damping", r["case"], float(r["damping"]), damping))
    return CheckTable("decays", "Free decays against OpenFAST", source_of("decay"), rows)
