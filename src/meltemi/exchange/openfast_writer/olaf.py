"""OLAF: the vortex wake of a deck."""

from __future__ import annotations

import math

from meltemi.exchange.openfast.olaf import CORES
from meltemi.exchange.openfast_writer.deck import DEGREES, DeckNotes, ExportModel, Texts
from meltemi.exchange.openfast_writer.template import fill

FEWEST = 30
"""Rows of a near wake below which OLAF refuses to leave out the shed vorticity of a far wake."""
GUIDELINES = "rows of 5 to 8 degrees, at least 8 revolutions, cores of 0.25 to 3 of the width of an element"
NEVER = 99999.0
"""[s] start of a free wake after the end of any simulation."""


def olaf(deck: ExportModel, notes: DeckNotes, step: float, rotor_speed: float) -> Texts:
    """Text of OLAF's file, if the wake is one of vortices that OLAF can represent.

    Its wake is a near wake of all elements to its end, the free part in front, as its guidelines recommend; a row
    begins at a multiple of the time step, since OLAF moves the wake between time steps.

    Args:
      step: [s] time step of the deck.
      rotor_speed: [rad/s] initial rotor speed, by which revolutions become panels; at a standstill it is rated speed.
    """
    o, v = deck.options, deck.options.vortices
    if o.wake == "near":
        notes.changed("coupled near wake", "momentum theory (Wake_Mod 1)")
    if o.wake not in ("hybrid", "free"):
        return {}
    if not rotor_speed > 0.0:
        rotor_speed = deck.turbine.rated_rotor_speed
    row = step * max(1, round(v.azimuth_step / (rotor_speed * step)))
    panels, free = (max(1, round(2.0 * math.pi * age / (row * rotor_speed))) for age in (v.length, v.free))
    values: dict[str, object] = {
        "DTfvw": row,
        "FreeWakeStart": 0.0 if v.free else NEVER,
        "nNWPanels": panels,
        # all free if none ever is, and where one frozen row would be left, which OLAF divides by
        "nNWPanelsFree": free if v.free and free < panels - 1 else panels,
        "FWShedVorticity": panels < FEWEST,
        "RegFunction": next(n for n, core in CORES.items() if core == v.core),
        "WakeRegFactor": v.wake_core,
        "WingRegFactor": v.blade_core,
        "CoreSpreadEddyVisc": v.eddy_viscosity,
        "ShearModel": int(v.ground),
    }
    azimuth, cores = row * rotor_speed * DEGREES, (v.wake_core, v.blade_core)
    usual = 5.0 <= azimuth <= 8.0 and panels * azimuth >= 8 * 360.0 and 0.25 <= min(cores) <= max(cores) <= 3.0
    lag = v.shed > 0.0 or (o.stall == "hansen" and o.stall_constants.a1 + o.stall_constants.a2 > 0.0)
    for differs, what, how in (
        (o.wake == "hybrid", "hybrid wake", "each vortex moves with the velocity at its place"),
        (True, "wake that is coarser with age", f"all elements of the blades in {panels} rows"),
        (
            abs(azimuth / (v.azimuth_step * DEGREES) - 1.0) > 1e-6,
            "azimuth_step",
            f"{azimuth:.3g} degrees at {rotor_speed:.4g} rad/s, as a row takes whole time steps",
        ),
        (v.wind == "mean", "mean wind on the wake", "each vortex moves with the wind at its place"),
        (lag, "lag of the shed vorticity", "it counts from the first row; OLAF leaves out A1 and A2 of dynamic stall"),
        (v.blade_core != v.wake_core, "blade_core", "the core of the blades' vortices and the first row"),
        (not usual, "discretisation of the wake", f"OLAF's guidelines: {GUIDELINES}"),
    ):
        if differs:
            notes.changed(what, how)
    return {"OLAF.dat": fill("OLAF", deck.title, values, {})}
