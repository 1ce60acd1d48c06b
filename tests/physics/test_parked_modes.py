"""Stability at standstill: the map, OpenFAST's vibrations, deep stall."""

from __future__ import annotations

import numpy as np
import pytest

import meltemi
from meltemi import InputError, ModelOptions, SteadyWind
from meltemi.analyses.linear import linearise
from meltemi.analyses.parked import standing_point
from meltemi.analysis import parked_stability

FEATHER = 0.5 * np.pi


@pytest.mark.slow
@pytest.mark.parametrize(
    ("speed", "yaw", "azimuth", "stall", "frequency", "damping"),
    # locked at 0; idling, where it stands; the damping of OpenFAST is the smallest over 8 s at finite amplitude
    [
        (42.5, 30.0, 0.0, "static", 1.080, -1.8),
        (42.5, 30.0, 332.0, "static", 1.050, -2.1),
        (59.5, -15.0, 38.3, "static", 1.084, -2.3),
        (59.5, -15.0, 37.3, "hansen", 1.052, -0.5),
    ],
)
def test_edgewise_vibrations_as_in_openfast(
    speed: float, yaw: float, azimuth: float, stall: str, frequency: float, damping: float
) -> None:
    options = ModelOptions(torsion_modes=0, wake="none", stall=stall, tower_drag=False, locked=("yaw", "generator"))
    model = meltemi.build(meltemi.load_turbine("nrel5mw"), options)
    wind = SteadyWind(speed=speed, shear_exponent=0.11, direction=np.radians(yaw))
    point = standing_point(model, wind, FEATHER, np.radians(azimuth))
    modes = linearise(model, point, (), (), azimuth=np.radians(azimuth)).modes()
    edge = min((m for m in modes if 6.0 < m.frequency < 7.2), key=lambda m: m.damping)
    assert edge.frequency / (2.0 * np.pi) == pytest.approx(frequency, rel=0.016)
    assert 100.0 * edge.damping == pytest.approx(damping, abs=1.0)


@pytest.mark.slow
@pytest.mark.parametrize(("reversed_flow", "unstable"), [("static", True), ("lagged", False)])
def test_wind_from_behind_excites_torsion_only_without_the_lag_of_the_wake(reversed_flow: str, unstable: bool) -> None:
    """The lift at 3/4 chord follows the twist at once; behind the wake it follows late, which damps."""
    model = meltemi.build(meltemi.load_turbine("nrel5mw"), ModelOptions(advanced={"reversed_flow": reversed_flow}))
    wind = SteadyWind(speed=50.0, shear_exponent=0.11)
    found = parked_stability(model, [np.pi], [FEATHER], wind=wind, azimuths=(0.0,))
    assert (found.damping[0, 0] < -0.03) == unstable == ("torsion" in found.coordinate[0][0])
    assert unstable or found.damping[0, 0] > 0.004


@pytest.mark.slow
def test_a_map_of_yaw_and_pitch() -> None:
    model = meltemi.build(meltemi.load_turbine("nrel5mw"))
    shares: list[float] = []
    found = parked_stability(
        model,
        np.radians([0.0, 30.0, 180.0]),
        [1.2, FEATHER],
        wind=SteadyWind(speed=42.5, shear_exponent=0.11),
        progress=shares.append,
    )
    assert found.damping.shape == found.frequency.shape == (3, 2)
    assert found.damping[0, 1] > 0.003
    assert shares[-1] == 1.0
    assert all(found.coordinate[i][j] for i in range(3) for j in range(2))
    assert found.damping[2, 1] > 0.003
    alone = parked_stability(model, [np.radians(30.0)], [FEATHER], wind=found.wind, azimuths=(0.0,))
    assert found.damping[1, 1] <= alone.damping[0, 0] + 1e-12
    with pytest.raises(InputError, match="at least one value each"):
        parked_stability(model, [], [FEATHER])


@pytest.mark.slow
def test_a_plate_ends_the_edgewise_vibration_in_deep_stall() -> None:
    """Of the IEA 15 MW at 70 degrees, which comes from the suction of its extrapolated polars."""
    turbine, yaw = meltemi.load_turbine("iea15mw"), [np.radians(70.0)]
    given, plate = (
        parked_stability(turbine, yaw, [FEATHER], options=ModelOptions(deep_stall=kind)) for kind in ("given", "plate")
    )
    assert given.damping[0, 0] < -0.004
    assert given.coordinate[0][0] == "1st edge"
    assert plate.damping[0, 0] > 0.0
