"""ServoDyn: the control of a deck."""

from __future__ import annotations

import math
from pathlib import Path

from meltemi.exchange.openfast_writer.deck import DEGREES, OUTPUTS, RPM, DeckNotes, ExportModel, Texts, turn
from meltemi.exchange.openfast_writer.template import fill, table

ROUNDING = 1e-6
"""Relative, of OpenFAST in single precision."""


def servo(
    deck: ExportModel, notes: DeckNotes, fixed_pitch: float, library: str | Path | None, settings: str | Path
) -> Texts:
    """Text of the ServoDyn file: a controller library, or a fixed pitch [rad] and the torque of the simple law."""
    t = deck.turbine
    law, pitch = t.control.torque, t.control.pitch
    rated_torque = law.rated_power / law.rated_speed
    # OpenFAST rejects a law whose region 2 ends above the rated torque: region 2 ends at the rated torque
    rated_speed = min(law.rated_speed, math.sqrt(rated_torque / law.optimal_gain) * (1.0 - ROUNDING))
    mode = 0 if library is None else 5
    if library is None:
        notes.changed("control", "the pitch is held; torque by OpenFAST's simple law, constant above rated speed")
        if rated_speed < law.rated_speed * (1.0 - 10.0 * ROUNDING):
            why = f"optimal torque reaches rated torque at {rated_speed * RPM:.5g} rpm; constant from there"
            notes.changed("rated speed of the torque law", why)
    values: dict[str, object] = {
        "PCMode": mode,
        "VSContrl": mode or 1,
        "PitManRat": t.pitch_actuator.rate_limit * DEGREES,
        "GenEff": 100.0 * t.drivetrain.generator_efficiency,
        "PitNeut": fixed_pitch * DEGREES,
        "VS_RtGnSp": rated_speed * RPM,
        "VS_RtTq": rated_torque,
        "VS_Rgn2K": law.optimal_gain / RPM**2,
        "VS_SlPc": 100.0 * law.slip,
        "HSSBrTqF": t.drivetrain.brake_torque,
        "YCMode": mode if deck.options.yaw == "driven" else 0,
        "YawNeut": turn(deck.options.nacelle_yaw),
        "YawSpr": t.yaw.stiffness,
        "YawDamp": t.yaw.damping,
        "YawManRat": t.yaw.rate * DEGREES,
        "DLL_FileName": "unused" if library is None else str(library),
        "DLL_InFile": "unused" if library is None else str(settings),
        "Ptch_Cntrl": 1,
        "Ptch_SetPnt": pitch.minimum * DEGREES,
        "Ptch_Min": pitch.minimum * DEGREES,
        "Ptch_Max": pitch.maximum * DEGREES,
        "PtchRate_Min": -pitch.rate_limit * DEGREES,
        "PtchRate_Max": pitch.rate_limit * DEGREES,
        "Gain_OM": law.optimal_gain,
        "GenSpd_MinOM": law.optimal_speed * RPM,
        "GenSpd_MaxOM": law.rated_speed * RPM,
        "GenSpd_Dem": pitch.reference_speed * RPM,
        "GenTrq_Dem": rated_torque,
        "GenPwr_Dem": law.rated_power,
    }
    tables = {"torque_table": table("GenSpd_TLU GenTrq_TLU", "rpm Nm"), "outputs": OUTPUTS["ServoDyn"].split()}
    return {"ServoDyn.dat": fill("ServoDyn", deck.title, values, tables)}
