"""Library turbines that are scaled from the NREL 5 MW: the two of Wang et al. (2021), and their parameters.

    python -m meltemi.studies.scaling.library [folder]     writes their files again

Diameter, power, rotor speeds, gear ratio, tower height and wind speeds are those of Wang et al. (2021), Table 1. Not
stated there, and assumed: the tip-speed ratio (9.15 and 9.3 follow from the stated rated wind speeds), efficiencies
(generator 0.97, converter 0.98, two planetary stages 0.975), stages by ``size_gearbox``, a blade stiffness for which
the rules give the frequencies of a published blade of this size (NREL 2.8-127), and towers with the first mode 15 %
above the rated rotor speed.
The paper states 12.6 rpm for the 3 MW turbine, a tip speed of 102 m/s; 9.9 rpm are used, which is 80 m/s.

Reference: Wang, Cai, Xu and Li (2021), Frontiers in Energy Research 9:711927.
"""

from __future__ import annotations

import sys
from inspect import signature
from pathlib import Path
from typing import Any, Final

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.units import rpm
from meltemi.core.yamlfile import validated
from meltemi.studies.scaling.turbine import scale_turbine
from meltemi.tuning.baseline_tuning import tune_baseline
from meltemi.turbine.definition import Turbine
from meltemi.turbine.gearbox import size_gearbox
from meltemi.turbine.library import DATA, load_turbine, write_turbine

REFERENCE: Final = "nrel5mw"
BOTH: dict[str, Any] = {
    "tower_height": 120.0,
    "minimum_rotor_speed": rpm(6.0),
    "tip_speed_ratio": 9.0,
    "blade_stiffness": 1.8,
    "generator_efficiency": 0.97 * 0.98,
    "gearbox_efficiency": 0.975,
    "cut_in": 2.5,
}
NUMBERS: dict[str, dict[str, Any]] = {
    "zr20-122": {
        "rotor_diameter": 122.0,
        "rated_power": 2e6,
        "rotor_speed": rpm(12.6),
        "gear_ratio": 38.1,
        "tower_frequency": 0.25,
        "cut_out": 22.0,
        "description": "2 MW, 122 m, two-stage planetary gearbox: the ZR2.0-122 of Wang et al. (2021), scaled",
    },
    "ct30-155": {
        "rotor_diameter": 155.0,
        "rated_power": 3e6,
        "rotor_speed": rpm(9.9),
        "gear_ratio": 40.49,
        "tower_frequency": 0.20,
        "cut_out": 25.0,
        "description": "3 MW, 155 m, two-stage planetary gearbox: the CT3.0-155 of Wang et al. (2021), scaled",
    },
}
KEYWORDS = tuple(signature(scale_turbine).parameters)[1:]
DIGITS = 7
"""Significant digits of the numbers in the files."""


def scaled_turbine(name: str, **changes: Any) -> Turbine:
    """A scaled turbine of the library, with some parameters changed.

    Args:
      name: ``zr20-122`` or ``ct30-155``.
      changes: arguments of ``scale_turbine``: ``rotor_speed=1.32`` for the 3 MW turbine with the 12.6 rpm of the paper.

    Raises:
      InputError: the turbine or argument is unknown, or a number is not possible.
    """
    if name not in NUMBERS:
        raise InputError(f"scaled_turbine: no turbine {name!r}: {did_you_mean(name, NUMBERS)}")
    numbers = {"name": name} | BOTH | NUMBERS[name]
    for key in changes:
        if key not in KEYWORDS:
            raise InputError(f"scaled_turbine: no number {key!r}: {did_you_mean(key, KEYWORDS)}")
    turbine = scale_turbine(load_turbine(REFERENCE), **(numbers | changes))
    turbine = turbine.replace(control=tune_baseline(turbine, margins=False).control)
    drive, law = turbine.drivetrain, turbine.control
    torque = law.torque.rated_power / drive.gearbox_efficiency / law.pitch.reference_speed * drive.gear_ratio
    gearbox = size_gearbox(ratio=drive.gear_ratio, rated_torque=torque)
    turbine = turbine.replace(**{"drivetrain.gearbox": gearbox})
    return validated(_rounded(turbine.content()), Turbine, name)


def main(folder: Path = DATA) -> None:
    """Write the files."""
    for name in NUMBERS:
        path = folder / f"{name}.yaml"
        write_turbine(scaled_turbine(name), path)
        header = "# Made by python -m meltemi.studies.scaling.library; docs/guide/scaling.md says how.\n"
        path.write_text(header + path.read_text(encoding="utf-8"), encoding="utf-8")


def _rounded(content: Any) -> Any:
    """The value rounded: the last digits depend on the compiler."""
    if isinstance(content, dict):
        return {key: _rounded(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_rounded(value) for value in content]
    return float(f"{content:.{DIGITS}g}") if isinstance(content, float) else content


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
