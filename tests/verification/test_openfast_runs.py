"""An exported deck in OpenFAST itself, where there is one: on the PATH, or named by MELTEMI_OPENFAST."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import ModelOptions, SteadyWind, Turbine
from meltemi.io import read_deck, read_result, write_openfast

PROGRAM = os.environ.get("MELTEMI_OPENFAST") or shutil.which("openfast")
SETTLED = 10.0
"""[s]."""
BOUNDS = {"RotTorq": 4e-3, "RotThrust": 2e-3}
"""Largest deviations in ``docs/verification``: power coefficient of the rigid rotor at given speed and pitch, 0.41 %,
as the pitch is held and no controller restores the torque; thrust in steady operation, 0.16 % and 0.18 %."""


@pytest.mark.slow
@pytest.mark.skipif(PROGRAM is None, reason="no openfast on the PATH, and MELTEMI_OPENFAST is not set")
def test_openfast_runs_the_deck_as_we_do(turbine: Turbine, tmp_path: Path) -> None:
    """Torque and thrust, within what ElastoDyn's half elements change; the torque law is one that it would refuse."""
    law, pitch, speed = turbine.control.torque, math.radians(3.0), 1.2
    gain = 1.08 * law.rated_power / law.rated_speed**3
    damping = {"flap": 0.05, "edge": 0.05}  # else edgewise vibrations of the start last for minutes
    changes: dict[str, Any] = {"control.torque.optimal_gain": gain, "blade.structure.damping": damping}
    described = turbine.replace(**changes)
    wind, duration = SteadyWind(speed=11.0), SETTLED + math.tau / speed
    options = ModelOptions(locked=("yaw", "tower", "generator"), inflow="quasi_steady", stall="static")
    at: dict[str, Any] = {"rotor_speed": speed, "pitch": pitch}
    main = write_openfast(described, tmp_path, options=options, wind=wind, duration=duration, **at).main
    done = subprocess.run([str(PROGRAM), main.name], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    theirs = read_result(main.with_suffix(".outb")).between(SETTLED, duration)
    deck = read_deck(main, control_of=described)
    ours = meltemi.simulate(
        meltemi.build(deck.turbine, ModelOptions(**deck.options)),
        wind,
        duration=duration,
        start=meltemi.Start(**at, coordinates={}),
        controller=meltemi.control.ConstantController(),
    ).between(SETTLED, duration)
    np.testing.assert_allclose(theirs["BldPitch1"], pitch, rtol=1e-5)
    for name, bound in BOUNDS.items():
        assert ours[name].mean() == pytest.approx(theirs[name].mean(), rel=bound), name
