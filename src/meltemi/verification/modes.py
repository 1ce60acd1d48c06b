"""Frequencies and damping against OpenFAST's linearisation."""

from __future__ import annotations

import numpy as np

from meltemi.analyses.modes import natural_modes
from meltemi.environment.site import Environment
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.rotors import build
from meltemi.turbine.library import load_turbine
from meltemi.verification.openfast_deck import deck_options, deck_turbine
from meltemi.verification.table import Check, CheckTable, difference, reference_table, relative, source_of

SPEED = 12.1 * np.pi / 30.0
CASES = {
    "lin_0rpm_g0_genfix": ("at rest", 0.0, 0.0, False),
    "lin_0rpm_g0_genfree": ("at rest, generator free", 0.0, 0.0, True),
    "lin_0rpm_g_genfix": ("at rest, with gravity", 0.0, 9.80665, False),
    "lin_12rpm_g0_genfix_mbc": ("12.1 rpm", SPEED, 0.0, False),
}
"""Case of the reference: name, rotor speed, gravity, generator free."""


def model_at(gravity: float, **changes: object) -> BladedModel:
    """The deck's turbine with 40 nodes a blade, at a gravity [m/s^2]."""
    turbine = deck_turbine(load_turbine("nrel5mw"))
    return build(turbine, deck_options(turbine, "A", blade_nodes=40, **changes), Environment(gravity=gravity))


def damping_row(what: str, case: str, reference: float, ours: float) -> Check:
    """Within 0.1 points or 4 %, whichever is wider."""
    band = max(0.1, 4.0 * reference)
    return difference(what, case, "-", reference, ours, band, measure="points", factor=100.0)


def linearised() -> CheckTable:
    """Modes at rest and at 12.1 rpm."""
    rows = []
    for case, (name, speed, gravity, free) in CASES.items():
        table = reference_table("modes", case=case)
        modes = natural_modes(model_at(gravity), speed, generator_free=free)
        for mode, r in zip(modes, table, strict=False):
            where = f"{name}: {r['mode']} {r['participation'].split(' 1.00')[0]}"
            frequency = mode.frequency / (2.0 * np.pi)
            rows.append(relative(f"frequency {name}", where, "Hz", float(r["frequency_hz"]), frequency, 1.5))
            rows.append(damping_row(f"damping {name}", where, 0.01 * float(r["damping_percent"]), mode.damping))
    return CheckTable("modes", "Linearised modes against OpenFAST", source_of("modes"), rows)
