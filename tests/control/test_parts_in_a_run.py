"""Individual pitch control from the parts, in the user's own compiled function, on the whole machine."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi.compiler import Entries, Numbers, Table, blades, part, parts
from meltemi.control.baseline import BaselineState
from meltemi.control.controller import StartPoint
from meltemi.control.signals import Demands, Measurements
from meltemi.control_laws.filters import SecondOrder, band_pass, check_harmonic
from meltemi.control_laws.integrator import Integrator, integrator, integrator_settings
from meltemi.control_laws.multiblade import add_to_blades, to_fixed


class State(Table, title="individual pitch"):
    """The collective law's, and that of the parts."""

    collective: BaselineState = part(BaselineState)
    filter: Entries[SecondOrder] = parts(SecondOrder, 3)
    moment: Numbers = blades("N m", "band-passed")
    tilt: Integrator = part(Integrator)
    yaw: Integrator = part(Integrator)


@pytest.mark.slow
def test_individual_pitch_takes_the_shear_out_of_the_blade_moments() -> None:
    """Steady wind of 18 m/s with a shear exponent of 0.2: less than a third of the amplitude is left after a minute."""
    turbine = meltemi.load_turbine("nrel5mw")
    law = meltemi.control.BaselineController(turbine)
    collective: Any = law.update
    check_harmonic(1, 1.3, 0.0125)

    def update(state: NDArray[np.float64], m: Measurements, demands: Demands, dt: float) -> None:
        x = State(state)
        collective(x.collective.array, m, demands, dt)
        for b in range(3):
            x.moment[b] = band_pass(x.filter[b], m.out_of_plane_moment[b], m.rotor_speed, 0.25, dt)
        tilt, yaw = to_fixed(x.moment, 3, m.azimuth, 1)
        # more pitch, less moment: a positive gain takes it down
        tilt = integrator(x.tilt, tilt, -0.1, 0.1, dt)
        yaw = integrator(x.yaw, yaw, -0.1, 0.1, dt)
        add_to_blades(demands.pitch, 3, tilt, yaw, m.azimuth, 1, 0.2)

    def init(start: StartPoint) -> State:
        axis = integrator_settings(integral_gain=5e-9)
        return State.of(collective=BaselineState(law.initial_state(start)), tilt=axis, yaw=axis)

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
