"""Filaments of vortex wakes beside closed forms: segment, ring, cylinder and helices."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from vortex_lines import chain, cylinder, filaments, helices, helix, polygon, richardson, ring, velocity

from meltemi.compiler import Vec
from meltemi.vortex.filaments import CORES, NONE, OFFSET, ROWS, VATISTAS, filament, induced, store

AT = ((0.5, 0.0, 0.0), (0.1, 0.0, 0.3), (0.05, 0.0, 1.5))
SEGMENT = {
    "none": (0.28470502, 1.58120753, 0.00758034),
    "rankine": (0.28470502, 0.39530188, 0.00047377),
    "lamb_oseen": (0.28459435, 0.42622951, 0.00057249),
    "vatistas": (0.28112930, 0.38349916, 0.00047285),
    "offset": (0.22667597, 0.17756903, 0.00721420),
}
"""[m/s] y component at ``AT`` of the filament from z = -1 to 1 with a core of 0.2 m, van Garrel's equation in NumPy."""


def stored(begin: Vec, end: Vec, core: int, radius: float, kind: type = np.float64) -> np.ndarray:
    """One filament of unit circulation, as the wake stores it."""
    sources = np.zeros((ROWS, 1), kind)
    store(sources, 0, begin, end, 1.0, radius * radius, core)
    return sources


@pytest.mark.parametrize("name", SEGMENT)
def test_a_segment_with_each_core(name: str) -> None:
    """In double precision to 1e-8, and in single precision to 1e-4."""
    core, ends = CORES.index(name), (Vec(0.0, 0.0, -1.0), Vec(0.0, 0.0, 1.0))
    for p, expected in zip(AT, SEGMENT[name], strict=True):
        u = filament(Vec(*p), *ends, 0.04, core)
        assert (u.x, u.y, u.z) == pytest.approx((0.0, expected, 0.0), abs=1e-8)
        assert induced(np.array(p), stored(*ends, core, 0.2), 0, 1, core) == pytest.approx(
            (0.0, expected, 0.0), abs=1e-8
        )
        single = induced(np.array(p, np.float32), stored(*ends, core, 0.2, np.float32), 0, 1, core)
        assert single == pytest.approx((0.0, expected, 0.0), rel=1e-4, abs=1e-7)


def test_a_core_keeps_the_velocity_finite_on_the_filament() -> None:
    """It vanishes on the line, also at the ends and on the extension."""
    for core in range(len(CORES)):
        ends = (Vec(0.0, 0.0, -1.0), Vec(0.0, 0.0, 1.0))
        for z in (-3.0, -1.0, 0.0, 0.3, 1.0, 2.0):
            u = induced(np.array([0.0, 0.0, z]), stored(*ends, core, 0.2), 0, 1, core)
            assert u == (0.0, 0.0, 0.0)
            v = filament(Vec(0.0, 0.0, z), *ends, 0.04, core)
            assert (v.x, v.y, v.z) == (0.0, 0.0, 0.0)


def test_a_filament_split_in_two_induces_the_same() -> None:
    """With all cores but the offset, whose term depends on the length."""
    a, b, c = Vec(0.1, -0.2, -1.0), Vec(0.137, -0.126, -0.26), Vec(0.2, 0.0, 1.0)
    for core in range(len(CORES)):
        for p in AT:
            whole = np.array(induced(np.array(p), stored(a, c, core, 0.2), 0, 1, core))
            halves = np.concatenate([stored(a, b, core, 0.2), stored(b, c, core, 0.2)], axis=1)
            split = np.array(induced(np.array(p), halves, 0, 2, core))
            if core == OFFSET:
                assert np.abs(split / whole - 1.0).max() > 0.01
            else:
                np.testing.assert_allclose(split, whole, rtol=1e-9, atol=1e-12)


def test_sources_count_from_first_to_last() -> None:
    many = chain(polygon(12))
    part = induced(np.array([0.2, 0.1, 0.4]), many, 3, 7, NONE)
    assert part == pytest.approx(tuple(velocity([0.2, 0.1, 0.4], many[:, 3:7])))


def test_chains_of_these_tests_are_those_of_the_wake() -> None:
    begin, end = (0.1, -0.2, -1.0), (0.3, 0.4, 1.0)
    np.testing.assert_allclose(filaments(begin, end), stored(Vec(*begin), Vec(*end), NONE, 0.0), rtol=1e-15)


def test_single_precision_holds_beside_long_wakes() -> None:
    """Helices of 20 turns far from the origin: the error of the sum is below 1e-4 of it."""
    away = np.array([300.0, -200.0, 90.0])
    s = chain(60.0 * helix(1.0, 0.6, (0.0, 20.0), 36) + away, 100.0)
    single = s.astype(np.float32)
    single[8] += 3e-8 * (s[3:6] ** 2).sum(axis=0) ** 2
    for p in ((20.0, 10.0, 0.0), (50.0, 0.0, 100.0), (59.0, 2.0, 300.0)):
        x = np.array(p) + away
        u = np.array(induced(x, s, 0, s.shape[1], VATISTAS))
        error = np.array(induced(x.astype(np.float32), single, 0, s.shape[1], VATISTAS)) - u
        assert np.linalg.norm(error) < 1e-4 * np.linalg.norm(u)


@pytest.mark.parametrize("at", [(0.5, 0.0), (0.5, 0.5), (1.5, 0.2), (0.05, -1.0)])
def test_a_ring_by_polygons(at: tuple[float, float]) -> None:
    """Second order in the number of sides; their limit is the ring to 1e-6."""
    p, exact = [at[0], 0.0, at[1]], np.array(ring(*at))
    u = [velocity(p, chain(polygon(sides))) for sides in (48, 96, 192)]
    errors = [np.abs(each[[0, 2]] - exact).max() for each in u]
    for coarse, fine in pairwise(errors):
        assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.05)
    np.testing.assert_allclose(richardson(u[1], u[2])[[0, 2]], exact, atol=1e-6)
    assert np.abs(u[2][1]) < 1e-12  # no swirl


def test_the_velocity_in_the_middle_of_a_ring() -> None:
    """Upwards for counter-clockwise circulation: the right hand."""
    u = [velocity([0.0, 0.0, 0.0], chain(polygon(sides)))[2] for sides in (48, 96)]
    assert richardson(*u) == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("at", [(0.5, 0.0), (0.5, 1.0), (0.5, -1.0), (1.2, 0.5), (0.75, 2.0)])
def test_a_cylinder_by_rings(at: tuple[float, float]) -> None:
    """A cylinder from z = 0 to 4 as the difference of two closed forms that have no end."""
    exact = np.array(cylinder(*at)) - np.array(cylinder(at[0], at[1] - 4.0))
    results = []
    for rings in (64, 128):
        z = at[1] - 4.0 * (np.arange(rings) + 0.5) / rings
        points = np.stack([np.full(rings, at[0]), np.zeros(rings), z], axis=1)
        results.append(4.0 / rings * velocity(points, chain(polygon(2 * rings))).sum(axis=0)[[0, 2]])
    np.testing.assert_allclose(richardson(*results), exact, atol=1e-6)


def test_closed_forms_of_the_cylinder() -> None:
    """Published values, which the velocities of the tests above rest on."""
    for at, expected in (
        ((0.5, 0.0), (-0.13896655, 0.5)),
        ((0.5, 1.0), (-0.04098867, 0.86972344)),
        ((1.2, 0.5), (-0.13066914, -0.09279857)),
    ):
        assert cylinder(*at) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("pitch", [2.0 * np.pi / 9.0, 0.4 * np.pi])
@pytest.mark.parametrize("r", [0.2, 0.5, 0.8, 1.2])
def test_three_helices(pitch: float, r: float) -> None:
    """Endless ones to 1e-5 of their mean, 20 turns of them closed by cylinders; of those that begin here, half."""
    blades, turns, mean = 3, 20, 3.0 / pitch
    azimuths = 2.0 * np.pi * np.arange(blades) / blades
    beyond = mean * cylinder(r, -turns * pitch)[1]
    down = velocity([r, 0.0, 0.0], *(chain(helix(1.0, pitch, (0.0, turns), 72, a)) for a in azimuths))
    up = velocity([r, 0.0, 0.0], *(chain(helix(1.0, pitch, (-turns, 0.0), 72, a)) for a in azimuths))
    exact = helices(blades, pitch, r)
    assert down[2] + up[2] + 2.0 * beyond == pytest.approx(exact, abs=1e-5 * mean)
    assert down[2] == pytest.approx(up[2], rel=1e-9)
    swirl = 2.0 * down[1]
    assert swirl == pytest.approx((pitch / (2.0 * np.pi * r)) * (mean - exact), abs=1e-3 * mean)


def test_closed_forms_of_helices() -> None:
    """Published values of Kawada's series (Okulov 2004), to their digits."""
    for pitch, r, expected in (
        (2.0 * np.pi / 9.0, 0.5, 4.297),
        (2.0 * np.pi / 9.0, 0.95, 5.8456),
        (2.0 * np.pi / 9.0, 1.2, -0.0170),
        (0.4 * np.pi, 0.8, 2.5201),
        (0.4 * np.pi, 1.2, -0.1055),
    ):
        assert helices(3, pitch, r) == pytest.approx(expected, abs=2e-4)


def test_helices_become_a_cylinder_with_their_number() -> None:
    """With the same circulation per pitch the velocity of the disk is uniform closer and closer to the tip."""
    pitch, mean, r = 0.5, 1.0, np.array([0.3, 0.6, 0.8, 0.9, 0.95])
    spread = []
    for blades in (3, 6, 12, 24):
        azimuths = 2.0 * np.pi * np.arange(blades) / blades + np.pi / blades  # between the helices
        sources = [chain(helix(1.0, pitch, (0.0, 12.0), 60, a), mean * pitch / blades) for a in azimuths]
        u = velocity(np.stack([r, 0.0 * r, 0.0 * r], axis=1), *sources)[:, 2]
        u += [mean * cylinder(x, -12.0 * pitch)[1] for x in r]
        spread.append(np.abs(u - 0.5 * mean).max())
    assert all(fine < 0.6 * coarse for coarse, fine in pairwise(spread))
    assert spread[-1] < 0.01
