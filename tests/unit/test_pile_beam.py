"""Sections of a monopile and the pieces into which it is cut, by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from meltemi_sea.pile_beam import pile_beam, pile_edges
from meltemi_sea.support import Growth, PointMass, Support

STEEL = {"elastic_modulus": 2e11, "shear_modulus": 8e10, "density": 8000.0, "shear_share": 0.6}


def pile(**changes: Any) -> Support:
    made = {"depth": 30.0, "position": (-50.0, 10.0), "diameter": (8.0, 6.0), "thickness": (0.08, 0.06)}
    return Support(**{**made, **STEEL, **changes})


def at(support: Support, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Diagonals of stiffness and mass at a height above mean sea level."""
    beam = pile_beam(support)
    place = height - float(support.position[0])
    return tuple(
        np.array([np.interp(place, beam.position, matrix[:, i, i]) for i in range(6)])
        for matrix in (beam.stiffness, beam.mass)
    )  # type: ignore[return-value]


def tube(diameter: float, wall: float) -> tuple[float, float]:
    """Area and second moment."""
    inner = diameter - 2.0 * wall
    return np.pi * wall * (diameter - wall), np.pi / 64.0 * (diameter**4 - inner**4)


@pytest.mark.parametrize("height", [-50.0, 10.0])
def test_a_dry_tube(height: float) -> None:
    area, second = tube(8.0, 0.08) if height < 0.0 else tube(6.0, 0.06)
    K, M = at(pile(flooded=None), height)
    shear = 0.6 * 8e10 * area
    assert [*K] == pytest.approx(
        [shear, shear, 2e11 * area, 2e11 * second, 2e11 * second, 8e10 * 2.0 * second], rel=1e-6
    )
    assert [*M] == pytest.approx(8000.0 * np.array([area, area, area, second, second, 2.0 * second]), rel=1e-6)


def test_water_inside_and_growth_move_sideways_only() -> None:
    growth = Growth(bottom=-20.0, top=-5.0, thickness=0.2, density=1300.0)
    support = pile(diameter=(6.0, 6.0), thickness=(0.06, 0.06), growth=(growth,), flooded=2.0)
    area, second = tube(6.0, 0.06)
    inside, outside = 1025.0 * 0.25 * np.pi * 5.88**2, 1300.0 * np.pi * 0.25 * (6.4**2 - 6.0**2)
    for height, more in ((-40.0, 0.0), (-25.0, inside), (-10.0, inside + outside), (1.0, inside), (5.0, 0.0)):
        _, M = at(support, height)
        lateral = 8000.0 * area + more
        assert [*M] == pytest.approx([lateral, lateral, *8000.0 * np.array([area, second, second, 2.0 * second])])


def test_point_masses_are_spread_over_their_length_below_their_end() -> None:
    given = {"mass": 1e4, "inertia": 5e4, "length": 2.0}
    even = {"flooded": None, "diameter": (6.0, 6.0), "thickness": (0.06, 0.06)}
    support = pile(**even, masses=(PointMass(height=4.0, **given), PointMass(height=-10.0, **given, yaw_inertia=7e4)))
    _, bare = at(pile(**even), 3.0)
    _, M = at(support, 3.0)
    assert M - bare == pytest.approx([5e3, 5e3, 5e3, 2.5e4, 2.5e4, 5e4])
    _, bare = at(pile(**even), -11.0)
    assert at(support, -11.0)[1] - bare == pytest.approx([5e3, 5e3, 5e3, 2.5e4, 2.5e4, 3.5e4])
    for height in (1.9, 4.1, -9.9, -12.1):
        assert at(support, height)[1] == pytest.approx(at(pile(**even), height)[1])


@pytest.mark.parametrize("foot", [-50.0, -30.0])
def test_pieces_are_fine_at_water_and_mudline_and_grow_away_from_them(foot: float) -> None:
    support = pile(position=(foot, 10.0))
    edges = pile_edges(support)
    assert edges[[0, -1]] == pytest.approx([foot, 10.0])
    length = np.diff(edges)
    assert length.min() > 0.2
    for height in (-30.0, 0.0):
        i = int(np.argmin(np.abs(edges - height)))
        assert edges[i] == pytest.approx(height, abs=1e-9)
    above, wet, ground = (
        length[(edges[:-1] >= low - 1e-9) & (edges[1:] <= high + 1e-9)]
        for low, high in ((0.0, 10.0), (-30.0, 0.0), (foot, -30.0))
    )
    for pieces in (above, wet[::-1], ground[::-1]):  # from still water and mudline on
        if len(pieces):
            assert 0.3 < pieces[0] < 0.42
            assert np.all(np.diff(pieces) > -1e-9)
            assert pieces.max() < 2.0 + 1e-9
            assert pieces[12] / pieces[11] == pytest.approx(1.1)
    assert wet.max() == pytest.approx(2.0, rel=0.1)
    assert len(ground) == 0 or foot < -30.0


def test_what_is_implausible_in_a_pile_is_said() -> None:
    tower = SimpleNamespace(mass=np.array([5e3, 5e3]), position=np.array([0.0, 80.0]))
    turbine = SimpleNamespace(nacelle=SimpleNamespace(mass=3e5), tower=tower)
    usual = pile(shear_modulus=8e10, elastic_modulus=2.1e11)
    assert [word for word in usual.doubts(turbine) if word] == []
    growth = (Growth(bottom=-49.0, top=-20.0, thickness=0.1), Growth(bottom=-51.0, top=11.0, thickness=0.1))
    said = " ".join(pile(elastic_modulus=2.1e11, growth=growth).doubts(turbine))
    assert "support.growth.1" in said and "support.growth.0" not in said
