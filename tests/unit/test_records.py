"""Records and tables in kernels: every kind of number reads and writes what plain Python does."""

from __future__ import annotations

import pickle

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

from meltemi.compiler import (
    Array1,
    Array2,
    Constant,
    KernelRecord,
    Kind,
    Nodes,
    Numbers,
    Rot,
    Single,
    Symmetrics,
    Table,
    Vec,
    Vectors,
    number,
    rotation,
    symmetric,
    total,
    xyz,
)
from meltemi.compiler import record_types as compiled
from meltemi.compiler.kernels import FAST_MATH
from meltemi.maths.vectors import cross
from meltemi.simulation.arena import aligned

Float = NDArray[np.float64]
jit = numba.njit(fastmath=FAST_MATH, error_model="numpy")
BLADES, NODES = 3, 16


class Section(Table, axes="blade node"):
    """A table along the blades."""

    mass: Numbers = number("kg", "of the node")
    place: Vectors = xyz("m", "of the node")
    inertia: Symmetrics = symmetric("kg m^2", "about the node")


class Body(Table, axes="blade"):
    """One of each blade."""

    mass: Numbers = number("kg", "of the blade")
    moment: Vectors = xyz("kg m", "first moment")


class Shape(Table, axes="mode blade node", outer=1):
    """Modes along the blades: the first axis stands before the fields."""

    displacement: Vectors = xyz("-", "of the nodes")
    rotation: Vectors = xyz("rad/m", "of the sections")


class Hub(Table):
    """A table without axes."""

    speed: float = number("rad/s", "of the rotor")
    spin: Vec = xyz("rad/s", "angular velocity")
    frame: Rot = rotation("-", "orientation")


class Choice(Table, integer=True):
    """Whole numbers."""

    law: int = number("-", "which")


class Rotor(KernelRecord):
    """What the kernels of this test take."""

    q: Array1
    section: Section
    body: Body
    hub: Hub
    choice: Choice
    shape: Shape
    weight: Nodes[Array2]
    fixed: Constant[Array1]
    root: Single[Section]


def motion(m: Rotor) -> None:
    """A bit of everything: fields with and without axes, sums over nodes, rotations, options, plain arrays."""
    section, hub = m.section, m.hub
    hub.frame = Rot(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    spin = hub.frame @ (m.q[1] * hub.spin)
    hub.spin = spin
    hub.speed += m.fixed[0] * m.q[0]
    for b in range(section.blades):
        m.body.mass[b] = 0.0
        m.body.moment[b] = Vec(0.0, 0.0, 0.0)
        for n in range(section.nodes):
            r, mass = section.place[b, n], m.weight[b, n] * section.mass[b, n]
            for k in range(m.shape.modes):
                r += m.q[k] * (m.shape.displacement[k, b, n] - cross(m.shape.rotation[k, b, n], r))
            m.shape.rotation[1, b, n] = r
            section.place[b, n] = r + cross(spin, r) + section.inertia[b, n] @ hub.spin
            m.body.mass[b] += total(mass)
            m.body.moment[b] += total(mass * r)
    if m.choice.law == 2:
        hub.speed -= m.root.mass[0, 1]


def arrays() -> dict[str, NDArray[np.generic]]:
    chance = np.random.default_rng(5)
    shapes = {
        "q": (2,),
        "section": Section.shape(blade=BLADES, node=NODES),
        "body": Body.shape(blade=BLADES),
        "hub": Hub.shape(),
        "shape": Shape.shape(mode=2, blade=BLADES, node=NODES),
        "weight": (BLADES, NODES),
        "fixed": (1,),
    }
    made: dict[str, NDArray[np.generic]] = {}
    for name, shape in shapes.items():
        made[name] = aligned(shape)
        made[name][...] = chance.normal(size=shape)
    return made | {"choice": np.array([2]), "root": made["section"]}


def run(kind: Kind, of: dict[str, NDArray[np.generic]], slopes: dict[str, Float] | None = None) -> Rotor:
    m = Rotor(kind, of, slopes)
    assert m.section.nodes == NODES and m.body.blades == BLADES
    jit(motion)(m)
    return m


def expected() -> dict[str, NDArray[np.generic]]:
    of = arrays()
    motion(Rotor("floats", of))
    return of


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["floats", "lanes", "duals"])
def test_kernels_compute_what_python_does(kind: Kind) -> None:
    of = arrays()
    slopes = {name: np.zeros((*array.shape, 8)) for name, array in of.items()} if kind == "duals" else None
    run(kind, of, slopes)
    for name, array in expected().items():
        np.testing.assert_allclose(of[name], array, rtol=2e-15, atol=1e-14, err_msg=name)


@pytest.mark.slow
@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="duals exist in compiled code only")
def test_duals_carry_derivatives_through_tables() -> None:
    of = arrays()
    slopes = {name: np.zeros((*array.shape, 8)) for name, array in of.items()}
    slopes["q"][1, 3] = 1.0
    run("duals", of, slopes)
    step = 1e-6
    low, high = arrays(), arrays()
    low["q"][1] -= step  # type: ignore[operator]
    high["q"][1] += step  # type: ignore[operator]
    for each in (low, high):
        motion(Rotor("floats", each))
    for name in ("section", "hub", "body", "shape"):
        difference = (high[name] - low[name]) / (2.0 * step)  # type: ignore[operator]
        np.testing.assert_allclose(slopes[name][..., 3], difference, rtol=0.0, atol=1e-8, err_msg=name)
        assert not slopes[name][..., :3].any()
    assert np.abs(slopes["section"][..., 3]).max() > 0.1


def test_arrays_of_tables_are_those_of_the_host() -> None:
    @jit
    def whole(m: Rotor) -> float:
        return m.body.array[1, 2] + m.body.array.shape[0] + m.hub.array[0] + m.shape.array.shape[0]

    of = arrays()
    assert whole(Rotor("floats", of)) == of["body"][1, 2] + 4 + of["hub"][0] + 12  # type: ignore[operator]


def test_an_unknown_member_or_field_does_not_compile() -> None:
    for wrong in (lambda m: m.sections, lambda m: m.section.chord, lambda m: m.section.mass[0]):
        with pytest.raises(numba.core.errors.TypingError):
            jit(wrong)(Rotor("floats", arrays()))


def test_wrong_arrays_are_refused() -> None:
    of = arrays()
    with pytest.raises(TypeError, match="Rotor.weight: expected a contiguous array of float64"):
        Rotor("floats", of | {"weight": of["weight"].T})
    with pytest.raises(TypeError, match="Rotor.q: expected 1 axes, found 2"):
        Rotor("floats", of | {"q": np.zeros((2, 2))})
    with pytest.raises(TypeError, match="create it from its arrays"):
        pickle.dumps(Rotor("floats", of))


def test_lanes_are_as_wide_as_those_of_kernels() -> None:
    from meltemi.compiler import records

    assert records.LANES == compiled.WIDTH
