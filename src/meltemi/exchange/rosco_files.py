"""Files of ROSCO: tables of the rotor's coefficients, and a DISCON.IN with settings of a turbine.

ROSCO 2.x reads its table by line numbers (``ReadCpFile``): four lines, pitch angles, a line, tip-speed ratios, five
lines, C_p, four lines, C_t, four lines, C_q. ROSCO's toolbox (``load_from_txt``) finds the parts by words in
these lines, with upper and lower case: Pitch angle, TSR, Power, Thrust, Torque.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from meltemi.analyses.performance import performance_of
from meltemi.analyses.rotor_performance import RotorPerformance
from meltemi.bladed_controllers.rosco import edit_discon
from meltemi.core.errors import InputError
from meltemi.core.files import text_of, write_text
from meltemi.environment.site import Environment
from meltemi.tuning.baseline_tuning import BaselineTuning, tune_baseline
from meltemi.turbine.power_turbine import AnyTurbine

SCHEDULED = 30
"""Pitch angles of the gain schedule."""
AIR_DENSITY = Environment().density


def write_rosco_table(
    performance: RotorPerformance, path: str | Path, *, name: str = "", wind_speed: float = 8.0
) -> Path:
    """Write C_p, C_t, C_q over pitch [deg] and tip-speed ratio as ROSCO reads them (``PerfFileName``).

    Args:
      performance: complete tables from ``rotor_performance`` or ``performance_of``.
      path: output file.
      name: name of the turbine, for the first line, in lower case.
      wind_speed: [m/s] wind speed stated in the table; ROSCO does not use it.

    Raises:
      InputError: a coefficient is missing, or the file cannot be written.
    """
    tables = {"Power": performance.power, "Thrust": performance.thrust, "Torque": performance.torque}
    for what, table in tables.items():
        if not np.all(np.isfinite(table)):
            raise InputError(f"{path}: the {what.lower()} coefficient is not known for all angles and ratios")
    title = (name or "a turbine").lower()  # so that it contains none of the words that the toolbox searches
    lines = [f"# Rotor performance tables of {title}", "# written by meltemi", ""]
    lines += ["# Pitch angle vector (matrix columns), deg", _row(np.degrees(performance.pitch))]
    lines += ["# TSR: tip-speed ratio vector (matrix rows)", _row(performance.tip_speed_ratio)]
    lines += ["# Wind speed, m/s", _row([wind_speed]), "", "# Power coefficient", ""]
    for what, table in tables.items():
        if what != "Power":
            lines += ["", "", f"# {what} coefficient", ""]
        lines += [_row(row) for row in table]
    return write_text(Path(path), "\n".join(lines) + "\n")


def read_rosco_table(path: str | Path) -> RotorPerformance:
    """Read a table of ROSCO: pitch angles, tip-speed ratios, C_p, C_t and C_q between comments.

    Raises:
      InputError: the file cannot be read, or is no table of ROSCO.
    """
    path = Path(path)
    lines = [line for line in text_of(path).splitlines() if line.strip() and not line.lstrip().startswith("#")]
    try:
        rows = [np.array(line.split(), dtype=float) for line in lines]
        pitch, ratios, _, *values = rows
        table = np.array(values).reshape(3, len(ratios), len(pitch))
    except ValueError as error:
        raise InputError(
            f"{path}: expected pitch angles, tip-speed ratios, wind speed and three tables ({error})"
        ) from None
    return RotorPerformance(ratios, np.radians(pitch), *table)


def rosco_settings(turbine: AnyTurbine, tuning: BaselineTuning | None = None) -> dict[str, Any]:
    """Settings of ROSCO for a turbine by their names in DISCON.IN: gains, speeds, limits, inertia.

    The pitch gains are those of the baseline controller tuned by the sensitivity of power to pitch at the operating
    points of the turbine (``tune_baseline``), in the sign convention of ROSCO, which subtracts the measured speed.

    Args:
      turbine: turbine of either kind.
      tuning: result of ``tune_baseline``, which is called by default.
    """
    tuned = tuning or tune_baseline(turbine, margins=False)
    pitch, torque = tuned.control.pitch, tuned.control.torque
    angles = np.linspace(0.0, float(tuned.pitch[-1]), SCHEDULED)
    share = 1.0 / (1.0 + angles / pitch.gain_halving_pitch)
    gear, rate = turbine.drivetrain.gear_ratio, turbine.pitch_actuator.rate_limit
    none = np.zeros(SCHEDULED)
    return {
        "PC_GS_n": SCHEDULED,
        "PC_GS_angles": angles,
        "PC_GS_KP": -pitch.proportional_gain * share,
        "PC_GS_KI": -pitch.integral_gain * share,
        "PC_GS_KD": none,
        "PC_GS_TF": none,
        "PC_MinPit": pitch.minimum,
        "PC_MaxPit": pitch.maximum,
        "PC_MaxRat": rate,
        "PC_MinRat": -rate,
        "PC_RefSpd": pitch.reference_speed,
        "VS_MaxRat": torque.rate_limit,
        "VS_MaxTq": torque.maximum_torque,
        "VS_Rgn2K": torque.optimal_gain,
        "VS_RtPwr": turbine.rated_power,
        "VS_RtTq": torque.rated_power / pitch.reference_speed,
        "VS_RefSpd": pitch.reference_speed,
        "VS_TSRopt": tuned.tip_speed_ratio,
        "VS_GenEff": 100.0 * turbine.drivetrain.generator_efficiency,
        "WE_BladeRadius": turbine.rotor_radius,
        "WE_GearboxRatio": gear,
        "WE_Jtot": tuned.inertia,
        "WE_RhoAir": AIR_DENSITY,
    }


def export_rosco(
    turbine: AnyTurbine, folder: str | Path, discon: str | Path | None = None, tuning: BaselineTuning | None = None
) -> list[Path]:
    """Write the table of a turbine's coefficients and, from an existing DISCON.IN, one with its settings.

    Args:
      turbine: turbine of either kind.
      folder: existing folder.
      discon: a DISCON.IN of the version of ROSCO in use, which gives filters, modes and all other settings.
      tuning: result of ``tune_baseline``, which is called by default.

    Returns:
      The files.

    Raises:
      InputError: the rotor has no table, or ``discon`` lacks a setting.
    """
    folder, performance = Path(folder), performance_of(turbine)
    table = write_rosco_table(performance, folder / f"Cp_Ct_Cq.{turbine.name}.txt", name=turbine.name)
    if discon is None:
        return [table]
    settings = rosco_settings(turbine, tuning)
    names = {"PerfFileName": f'"{table.absolute()}"', "PerfTableSize": performance.power.shape[::-1]}
    return [table, edit_discon(discon, folder / "DISCON.IN", **settings, **names)]


def _row(values: Iterable[float]) -> str:
    return " ".join(f"{value:.8g}" for value in values)
