"""Runs of a floating turbine with a flexible frame: the rigid limit, and loads that pass from tower to frame."""

from __future__ import annotations

import numpy as np
import pytest

import meltemi
from meltemi import SteadyWind, load_turbine
from meltemi.simulation.result import Result

pytestmark = pytest.mark.long  # machine code that no shorter test needs; signs are those of test_frames_floats
MOTIONS = ("platform_surge", "platform_heave", "platform_pitch", "tower_base_moment_fore_aft")
SECTIONS = ("member_main_4_end_moment_y", "member_pontoon_A_start_moment_x")


def run(name: str, stiffness: float = 1.0) -> Result:
    turbine = load_turbine(name)
    if turbine.frame is not None:
        sections = {
            key: each.replace(
                elastic_modulus=stiffness * each.elastic_modulus, shear_modulus=stiffness * each.shear_modulus
            )
            for key, each in turbine.frame.sections.items()
        }
        turbine = turbine.replace(frame=turbine.frame.replace(sections=sections))
    channels = MOTIONS if turbine.frame is None else (*MOTIONS, *SECTIONS)
    wind = SteadyWind(speed=12.0, shear_exponent=0.14)
    sea = meltemi.environment.IrregularSea(height=3.0, period=9.0, seed=1)
    return meltemi.simulate(meltemi.build(turbine), wind, duration=40.0, sea=sea, channels=channels)


def test_a_stiff_frame_moves_as_a_rigid_platform_and_a_soft_one_bends() -> None:
    """Motions and base moment of a frame 10 000 times as stiff are those of the rigid platform within 0.1 %; the
    moment at the top of the main column is that of the tower's base on it, and the pontoon carries its share."""
    rigid, stiff, soft = run("iea15mw-volturnus"), *(run("iea15mw-volturnus-flexible", x) for x in (1e4, 1.0))
    for name in MOTIONS:
        a, b = (np.asarray(each[name]) for each in (rigid, stiff))
        assert np.sqrt(np.mean((a - b) ** 2)) < 1e-3 * np.abs(a).max()
    for each in (stiff, soft):
        base, top = (np.asarray(each[name]) for name in ("tower_base_moment_fore_aft", SECTIONS[0]))
        np.testing.assert_allclose(top, base, atol=2e-3 * base.max())
    pitch = [float(np.asarray(each["platform_pitch"])[-1000:].mean()) for each in (rigid, soft)]
    assert 1.01 < pitch[1] / pitch[0] < 1.06  # the tower leans on the soft frame, and its weight with it
    assert np.asarray(soft[SECTIONS[1]]).mean() == pytest.approx(4.5e7, rel=0.3)
