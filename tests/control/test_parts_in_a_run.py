"""Individual pitch control from the parts, in the user's own compiled function, on the whole machine."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi.control import signals as s
from meltemi.control.baseline import BaselineState
from meltemi.control.controller import StartPoint
from meltemi.control.filters import band_pass, check_harmonic
from meltemi.control.integrator import IntegratorState, integrator, integrator_settings
from meltemi.control.multiblade import add_to_blades, to_fixed

FILTERED = len(BaselineState)
MOMENTS = FILTERED + 6
TILT = MOMENTS + 3
YAW = TILT + len(IntegratorState)


def test_individual_pitch_takes_the_shear_out_of_the_blade_moments() -> None:
    """Steady wind of 18 m/s with a shear exponent of 0.2: less than a third of the amplitude is left after a minute."""
    turbine = meltemi.load_turbine("nrel5mw")
    law = meltemi.control.BaselineController(turbine.control)
    collective: Any = law.update
    check_harmonic(1, 1.3, 0.0125)

    def update(x: NDArray[np.float64], m: NDArray[np.float64], demands: NDArray[np.float64], dt: float) -> None:
        collective(x, m, demands, dt)
        for i in range(3):
            x[MOMENTS + i] = band_pass(x, FILTERED + 2 * i, m[s.OUT_OF_PLANE_MOMENT + i], m[s.ROTOR_SPEED], 0.25, dt)
        tilt, yaw = to_fixed(x, MOMENTS, 3, m[s.AZIMUTH], 1)
        # more pitch, less moment: a positive gain takes it down
        tilt = integrator(x, TILT, tilt, -0.1, 0.1, dt)
        yaw = integrator(x, YAW, yaw, -0.1, 0.1, dt)
        add_to_blades(demands, s.PITCH_DEMAND, 3, tilt, yaw, m[s.AZIMUTH], 1, 0.2)

    def init(start: StartPoint) -> NDArray[np.float64]:
        axis = integrator_settings(integral_gain=5e-9)
        return np.concatenate([law.initial_state(start), np.zeros(9), axis, axis])

    compiled = update if numba.config.DISABLE_JIT else numba.njit(update)
    controller = meltemi.Controller(update=compiled, init=init, name="individual pitch")
    model, wind = meltemi.build(turbine), meltemi.SteadyWind(speed=18.0, shear_exponent=0.2)
    ranges = []
    for c in (law, controller):
        result = meltemi.simulate(model, wind, duration=80.0, controller=c)
        result.raise_for_status()
        last = result.time > 65.0
        ranges.append(np.ptp(result["RootMyc1"][last]))
    assert ranges[0] == pytest.approx(4.15e6, rel=0.1)
    assert ranges[1] < ranges[0] / 3.0
