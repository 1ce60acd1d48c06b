"""Campbell diagrams: standstill, whirl, names, the air."""

from __future__ import annotations

import re

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Model
from meltemi.analysis import Campbell, campbell
from meltemi.verification.table import reference_table

pytestmark = pytest.mark.slow

RPM = np.pi / 30.0


@pytest.fixture(scope="module")
def vacuum(model: Model) -> Campbell:
    return campbell(model, rotor_speeds=RPM * np.arange(0.0, 13.0, 1.0), air=False)


@pytest.fixture(scope="module")
def air(model: Model) -> Campbell:
    return campbell(model, wind_speeds=[6.0, 10.0, 14.0, 18.0, 22.0])


def curve(diagram: Campbell, label: str) -> np.ndarray:
    return diagram.frequency[diagram.labels.index(label)]


def test_standstill_has_the_natural_modes(model: Model) -> None:
    diagram = campbell(model, rotor_speeds=[0.0], air=False)
    still = meltemi.build(model.turbine, environment=meltemi.Environment(gravity=0.0))
    modes = meltemi.analysis.natural_modes(still)
    assert {mode.name for mode in modes} >= {"1st tower fore-aft", "1st drivetrain torsion", "1st flap", "1st edge"}
    assert re.fullmatch(r"<Mode 1st tower \S+: 0\.3\d* Hz, damping 0\.3\d* %>", repr(modes[0]))
    np.testing.assert_allclose(diagram.frequency[:, 0], [m.frequency for m in modes], rtol=1e-9)
    np.testing.assert_allclose(diagram.damping[:, 0], [m.damping for m in modes], rtol=1e-7)
    assert diagram.labels[:3] == ("1st tower side-side", "1st tower fore-aft", "1st drivetrain torsion")


def test_standstill_is_the_published_table(model: Model) -> None:
    diagram = campbell(model, rotor_speeds=[0.0], air=False)
    # of the report's asymmetric modes, yaw has one blade at rest, pitch all three in motion
    names = {
        "1st tower fore-aft": "1st tower fore-aft",
        "1st tower side-to-side": "1st tower side-side",
        "1st drivetrain torsion": "1st drivetrain torsion",
        "1st blade asymmetric flapwise yaw": "1st flap sine",
        "1st blade asymmetric flapwise pitch": "1st flap cosine",
        "1st blade collective flap": "1st flap collective",
        "1st blade asymmetric edgewise pitch": "1st edge sine",
        "1st blade asymmetric edgewise yaw": "1st edge cosine",
        "2nd blade asymmetric flapwise yaw": "2nd flap sine",
        "2nd blade asymmetric flapwise pitch": "2nd flap cosine",
        "2nd blade collective flap": "2nd flap collective",
        "2nd tower fore-aft": "2nd tower fore-aft",
        "2nd tower side-to-side": "2nd tower side-side",
    }
    table = reference_table("tp38060_modes")
    assert {row["mode"] for row in table} == set(names)
    for row in table:
        found = curve(diagram, names[row["mode"]])[0] / (2.0 * np.pi)
        assert found == pytest.approx(float(row["fast"]), rel=0.03), row["mode"]


@pytest.mark.parametrize("kind", ["1st flap", "1st edge", "1st torsion"])
def test_whirl_splits_by_the_rotor_speed(vacuum: Campbell, kind: str) -> None:
    speed = vacuum.rotor_speed[4:]
    split = 0.5 * (curve(vacuum, f"{kind} forward whirl") - curve(vacuum, f"{kind} backward whirl"))[4:]
    np.testing.assert_allclose(split, speed, rtol=0.02)


def test_curves_are_smooth_and_whole(vacuum: Campbell) -> None:
    assert np.isfinite(vacuum.frequency).all()
    assert len(vacuum.labels) == 18
    slope = np.abs(np.diff(vacuum.frequency, axis=1)) / np.diff(vacuum.rotor_speed)
    # whirl goes with the speed, and centrifugal stiffening adds half as much for flap modes
    assert np.max(slope) < 1.6


def test_order_of_the_points_does_not_matter(model: Model, vacuum: Campbell) -> None:
    backward = campbell(model, rotor_speeds=vacuum.rotor_speed[::-1], air=False)
    assert backward.labels == vacuum.labels
    np.testing.assert_allclose(backward.frequency[:, ::-1], vacuum.frequency, rtol=1e-12)


def test_the_air_damps_flap_and_tower(air: Campbell, model: Model) -> None:
    damping = dict(zip(air.labels, air.damping, strict=True))
    assert np.all(damping["1st flap collective"] > 0.3)
    assert np.all((damping["1st tower fore-aft"] > 0.04) & (damping["1st tower fore-aft"] < 0.12))
    assert np.all(damping["1st tower side-side"] < 0.02)
    assert np.all(np.abs(damping["1st edge backward whirl"]) < 0.03)
    # edge whirl around the same mean as in vacuum, split by twice the rotor speed
    split = 0.5 * (curve(air, "1st edge forward whirl") - curve(air, "1st edge backward whirl"))
    np.testing.assert_allclose(split, air.rotor_speed, rtol=0.02)
    empty = campbell(model, wind_speeds=[14.0], air=False)
    for label in ("1st edge backward whirl", "1st edge forward whirl", "1st tower fore-aft"):
        assert curve(empty, label)[0] == pytest.approx(curve(air, label)[2], rel=0.05)
        assert empty.damping[empty.labels.index(label), 0] < 0.01


def test_a_held_generator_changes_the_drivetrain(model: Model, air: Campbell) -> None:
    held = campbell(model, wind_speeds=[14.0], generator_free=False)
    assert curve(held, "1st drivetrain torsion")[0] / (2.0 * np.pi) == pytest.approx(0.62, rel=0.06)
    assert curve(air, "1st drivetrain torsion")[2] > 2.0 * curve(held, "1st drivetrain torsion")[0]


def test_errors_name_what_is_wrong(model: Model) -> None:
    with pytest.raises(InputError, match="one of wind_speeds and rotor_speeds"):
        campbell(model)
    with pytest.raises(InputError, match="air=False"):
        campbell(model, rotor_speeds=[1.0])


def test_plot_draws_every_mode(vacuum: Campbell, air: Campbell) -> None:
    for diagram in (vacuum, air):
        figure = meltemi.plots.plot_campbell(diagram)
        frequencies, _ = figure.axes  # high damping is cut off
        assert {*diagram.labels} <= {text.get_text() for text in frequencies.texts}
