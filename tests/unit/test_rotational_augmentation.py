"""Polars of rotating blades: formulas of the papers, limits, and where they act."""

from __future__ import annotations

from math import cos, pi, radians, sin

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import ModelOptions, Turbine
from meltemi.aero.rotational_augmentation import augmented
from meltemi.aero.tables import AeroNode, PolarPoint, SectionConstants
from meltemi.aero.variants import RotationalAugmentation
from meltemi.simulation.bladed.rotor import BladedModel

Float = NDArray[np.float64]
ALPHA = np.radians(np.linspace(-180.0, 180.0, 1441))
MODELS: tuple[RotationalAugmentation, ...] = ("snel", "chaviaropoulos_hansen")


def section() -> Float:
    """(P, 3) a section with zero lift at -2 deg, slope 2 pi, stall at 12 deg, drag that grows from 0.01, moment."""
    a = ALPHA + radians(2.0)
    potential = 2.0 * pi * np.sin(a)
    lift = np.where(np.abs(a) < radians(14.0), potential, np.sign(a) * 1.1)
    drag = 0.01 + 1.3 * np.sin(a) ** 2
    return np.stack([lift, drag, -0.05 - 0.2 * np.maximum(np.sin(a), 0.0)], axis=1)


def at(coefficients: Float, degrees: float) -> Float:
    return np.array([np.interp(radians(degrees), ALPHA, column) for column in coefficients.T])


def test_increments_of_the_papers() -> None:
    """At 20 deg, chord over radius 0.3 and 15 deg of twist."""
    plain = at(section(), 20.0)
    lacking = np.array([2.0 * pi * sin(radians(22.0)), 0.0, 0.0]) - plain * [1.0, 0.0, 0.0]
    snel = at(augmented(ALPHA, section(), 0.3, radians(15.0), "snel"), 20.0)
    np.testing.assert_allclose(snel, plain + 3.0 * 0.3**2 * lacking, atol=1e-9)
    share = 2.2 * 0.3 * cos(radians(15.0)) ** 4
    lacking[1:] = plain[1] - 0.01, plain[2] + 0.05
    both = at(augmented(ALPHA, section(), 0.3, radians(15.0), "chaviaropoulos_hansen"), 20.0)
    np.testing.assert_allclose(both, plain + share * lacking, atol=1e-5)


@pytest.mark.parametrize("name", MODELS)
def test_lift_approaches_potential_flow_and_never_exceeds_it(name: RotationalAugmentation) -> None:
    potential = 2.0 * pi * np.sin(ALPHA + radians(2.0))
    before = section()
    for ratio in (0.05, 0.2, 0.5, 3.0):
        after = augmented(ALPHA, section(), ratio, 0.0, name)
        assert np.all(np.abs(after[:, 0]) >= np.abs(before[:, 0]) - 1e-12)
        near = np.abs(ALPHA) < radians(50.0)
        assert np.all(np.abs(after[near, 0]) <= np.maximum(np.abs(potential), np.abs(section()[:, 0]))[near] + 1e-12)
        before = after
    full = np.abs(ALPHA) < radians(30.0)
    np.testing.assert_allclose(before[full, 0], potential[full], atol=1e-9)


@pytest.mark.parametrize("name", MODELS)
def test_attached_flow_and_deep_stall_stay(name: RotationalAugmentation) -> None:
    after, before = augmented(ALPHA, section(), 0.4, 0.0, name), section()
    attached = np.abs(ALPHA + radians(2.0)) < radians(13.9)
    np.testing.assert_allclose(after[attached, 0], before[attached, 0], atol=1e-9)
    np.testing.assert_array_equal(after[np.abs(ALPHA) > radians(50.0)], before[np.abs(ALPHA) > radians(50.0)])
    # a steeper measured slope is not reduced
    steep = before * [1.1, 1.0, 1.0]
    lift = augmented(ALPHA, steep, 0.4, 0.0, name)[:, 0]
    np.testing.assert_allclose(lift[attached], steep[attached, 0], atol=1e-9)
    assert augmented(ALPHA, before, 0.4, 0.0, "none") is before


def node_polars(model: BladedModel) -> tuple[Float, Float, Float]:
    """(nodes, P) lift, attachment and (nodes,) whether dynamic stall applies."""
    index = model.rotor.aero_nodes[AeroNode.index("polar"), 0].astype(int)
    polars, section = model.rotor.polars[index], model.rotor.section[index]
    columns = [polars[:, :, PolarPoint.index(name)] for name in ("lift", "attachment")]
    return columns[0], columns[1], section[:, SectionConstants.index("dynamic")]


@pytest.mark.parametrize("name", MODELS)
def test_nodes_of_a_turbine(turbine: Turbine, name: RotationalAugmentation) -> None:
    """More at the root than at the tip; cylinders stay; attachment follows the new polar."""
    plain, new = (
        node_polars(meltemi.build(turbine, ModelOptions(rotational_augmentation=kind))) for kind in ("none", name)
    )
    change = np.max(new[0] - plain[0], axis=1)
    lifts = plain[2] > 0.0
    assert not lifts.all()
    np.testing.assert_array_equal(new[0][~lifts], plain[0][~lifts])
    assert np.all(change[lifts] > 0.0)
    first, last = np.flatnonzero(lifts)[[0, -1]]
    assert change[first] > 3.0 * change[last]
    assert np.max(new[1] - plain[1], axis=1)[first] > 0.1


def test_openfast_fit_is_refused(turbine: Turbine) -> None:
    options = ModelOptions(rotational_augmentation="snel", advanced={"stall_fit": "openfast"})
    with pytest.raises(meltemi.InputError, match="stall_fit"):
        meltemi.build(turbine, options)
