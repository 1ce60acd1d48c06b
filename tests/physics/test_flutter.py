"""Overspeed: continuation in rotor speed, damping over rotor speed, the flutter limit."""

from __future__ import annotations

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Model, ModelOptions
from meltemi.analyses.continuation import CarefulOrbit
from meltemi.analyses.linear import LinearModel
from meltemi.analysis import Flutter, flutter
from meltemi.simulation.operating_point import steady_wind
from meltemi.simulation.orbit import SETTLED
from meltemi.studies.flutter import diverging

pytestmark = pytest.mark.slow

RPM = np.pi / 30.0
REPORTED = 18.3 * RPM, 3.7 * 2.0 * np.pi
"""Flutter limit of the NREL 5 MW by a strip theory with Wagner's function."""


@pytest.fixture(scope="module")
def limits() -> Flutter:
    return flutter(meltemi.load_turbine("nrel5mw-offsets"), RPM * np.array([12.0, 16.0, 17.0, 19.0, 20.0]))


@pytest.mark.long
def test_the_limit_of_the_reference_turbine(limits: Flutter) -> None:
    assert limits.limit is not None
    speed, frequency = REPORTED
    assert limits.limit.rotor_speed == pytest.approx(speed, rel=0.02)
    assert limits.limit.blade_frequency == pytest.approx(frequency, rel=0.02)
    assert not limits.failures
    assert np.all(limits.least[:3] > 0.0)
    assert np.all(limits.least[3:] < 0.0)
    # flapwise bending and torsion together
    shape = dict(zip(limits.limit.mode.coordinates, np.abs(limits.limit.mode.shape), strict=True))
    assert max(shape[name] for name in shape if "flap" in name) == pytest.approx(1.0)
    assert max(shape[name] for name in shape if "torsion" in name) > 0.2


@pytest.mark.long
def test_curves_hold_the_least_damped_mode(limits: Flutter) -> None:
    blades = [i for i, label in enumerate(limits.labels) if any(n in label for n in ("flap", "edge", "torsion"))]
    assert np.nanmin(limits.damping[blades], axis=0)[:3] == pytest.approx(limits.least[:3])


@pytest.mark.long
def test_few_modes_overestimate_it(limits: Flutter) -> None:
    turbine, few = meltemi.load_turbine("nrel5mw-offsets"), ModelOptions(flap_modes=2, edge_modes=1, torsion_modes=1)
    assert limits.limit is not None
    late = flutter(turbine, RPM * np.array([20.0, 22.0, 24.0]), options=few).limit
    assert late is not None
    assert late.rotor_speed > 1.2 * limits.limit.rotor_speed


def test_the_mass_offset_is_its_cause() -> None:
    assert flutter(meltemi.load_turbine("nrel5mw"), RPM * np.array([17.0, 19.0, 21.0])).limit is None


def test_it_is_that_of_the_first_speed_if_this_is_unstable() -> None:
    found = flutter(meltemi.load_turbine("nrel5mw-offsets"), [20.0 * RPM])
    assert found.limit is not None
    assert found.limit.rotor_speed == found.rotor_speed[0]


@pytest.mark.long
def test_a_speed_without_motion_ends_the_curve(model: Model) -> None:
    found = flutter(model, RPM * np.array([12.0, 50.0]), wind=25.0)
    assert list(found.failures) == [pytest.approx(50.0 * RPM)]
    assert np.isnan(found.least[1])


@pytest.mark.parametrize("speeds", [[], [0.0, 1.0], [2.0, 1.0]])
def test_speeds_must_increase(model: Model, speeds: list[float]) -> None:
    with pytest.raises(InputError, match="rotor_speeds must be positive and increase"):
        flutter(model, speeds)


@pytest.mark.long
@pytest.mark.parametrize(("wind", "rpm"), [(8.0, 21.0), (8.0, 26.0), (1.0, 22.0)])
def test_overspeed_has_a_periodic_motion(model: Model, wind: float, rpm: float) -> None:
    """At 21 rpm and 8 m/s, three per revolution meet the edgewise frequency while the density of the air rises."""
    point = meltemi.operating_point(model, wind, rotor_speed=rpm * RPM, pitch=0.0)
    orbit = CarefulOrbit(model, steady_wind(wind, model.turbine.hub_height))
    orbit.level = 1
    for speed in np.linspace(12.0, rpm, 7) * RPM:
        orbit.sweep(float(speed), 0.0, point.generator_torque)
    assert orbit.moved < SETTLED * model.turbine.rotor_radius
    assert point["tip_out_of_plane_1"] == pytest.approx(orbit.finish()["tip_out_of_plane_1"], abs=2e-3)


def test_divergence_is_a_mode_without_frequency() -> None:
    def of(stiffness: float) -> LinearModel:
        A, none = np.array([[0.0, 1.0], [-stiffness, -1.0]]), np.zeros((0, 0))
        columns, x = np.zeros((2, 0)), np.zeros(2)
        empty: tuple[str, ...] = ()
        names = ("q blade 1 1st torsion", "v blade 1 1st torsion")
        units = ("rad", "rad/s")
        return LinearModel(
            A, columns, columns.T, none, names, empty, empty, units, empty, empty, x, x[:0], x[:0], None, None
        )  # type: ignore[arg-type]

    assert diverging(of(4.0)) == []
    (mode,) = diverging(of(-4.0))
    assert (mode.frequency, mode.damping) == (0.0, -1.0)
    assert mode.coordinates == ("blade 1 1st torsion",)
