"""Curled wakes against FAST.Farm of OpenFAST 5.0: two NREL 5 MW at fixed speed (docs/verification/farm.md)."""

from __future__ import annotations

import numpy as np
import pytest

import meltemi
from meltemi.farm.settings import WakeSettings
from meltemi.farm.wakes import FarmWakes
from meltemi.verification.openfast_deck import deck_options, deck_turbine

pytestmark = pytest.mark.long
D = 126.0
SECOND = {
    0.0: {"RtAeroMxh": 6.6901e5, "RotThrust": 2.8389e5, "RootMyc1": 3.2372e6, "TwrBsMyt": 1.5302e7},
    20.0: {"RtAeroMxh": 1.0542e6, "RotThrust": 3.2038e5, "RootMyc1": 3.6688e6, "TwrBsMyt": 1.8512e7},
}
"""Means [N, N m] of the second rotor by the yaw angle [deg] of the first one: 9 m/s, 5 D in line, 10.5, 7.5 rpm, set A,
Mod_Wake 2, dr 8 m, DT_Low 1 s, from 210 to 250 s."""
CENTRE = {0.0: (0.56, 97.83), 20.0: (-14.35, 99.96)}
"""[m] y and z of the centroid of the deficit at 3 D, of FAST.Farm's disturbed wind on a plane."""
BOUNDS = {"RtAeroMxh": 0.02, "RotThrust": 0.01, "RootMyc1": 0.02, "TwrBsMyt": 0.02}


@pytest.mark.parametrize("yaw", SECOND)
def test_loads_and_path_are_those_of_fast_farm(yaw: float) -> None:
    turbine = deck_turbine(meltemi.load_turbine("nrel5mw"))
    model = meltemi.build(turbine, deck_options(turbine, "A", locked=("yaw", "generator", "drivetrain")))
    wakes = WakeSettings(model="curled", added_turbulence=False, step=1.0, ceiling=250.0, radial_points=D / 8.0)
    last: list[FarmWakes] = []
    result = meltemi.simulate_farm(
        meltemi.Farm(model, [(0.0, 0.0), (5.0 * D, 0.0)], wakes, [np.radians(yaw), 0.0]),
        meltemi.SteadyWind(speed=9.0),
        duration=250.0,
        controllers=meltemi.control.ConstantController(),
        start=[meltemi.Start(rotor_speed=rpm * np.pi / 30.0, coordinates={}) for rpm in (10.5, 7.5)],
        channels=tuple(SECOND[yaw]),
        watch=lambda wakes, time: last.append(wakes),
        partial=True,
    )
    second = result.turbines[1].between(210.5, 250.0)
    for name, theirs in SECOND[yaw].items():
        assert second[name].mean() == pytest.approx(theirs, rel=BOUNDS[name]), name
    planes, (left, up, _) = last[-1].planes, last[-1].shape.places
    i = int(np.argmin(np.abs(planes["centre"][0, 0] - 3.0 * D)))
    y, z, V = planes["centre"][1, 0, i] + left, planes["centre"][2, 0, i] + up, last[-1].profile[0, i, :, 0]
    seen = (np.abs(y) < 155.0) & (z > 15.0) & (z < 245.0)  # as on the plane
    for found, theirs in zip((y, z), CENTRE[yaw], strict=True):
        assert found[seen] @ V[seen] / V[seen].sum() == pytest.approx(
            theirs, abs=0.02 * D
        )  # here on one normal to the rotor
