"""Coefficients whose own waves say that they are about another point, or have the weight."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi.core.errors import InputError
from meltemi.floating.coefficients import platform_coefficients, read_coefficients
from meltemi.floating.consistency import check_coefficients, force_height, long_wave_stiffness
from meltemi.floating.members import Member, with_members
from meltemi.floating.platform import Body
from meltemi.floating.potential import NO_FORCE, NONE, about_still_water, tilt_stiffness
from meltemi.hydro.wamit import wamit_texts
from meltemi.sea.airy import wave_number
from meltemi.structure.beam import transfer

FLOATERS = ["nrel5mw-spar", "iea15mw-volturnus", "iea22mw-semi"]


@cache
def floater(name: str) -> tuple[Any, Any]:
    platform = meltemi.load_turbine(name).platform
    return platform, read_coefficients(platform.coefficients)


def test_long_waves_have_the_stiffness_of_members() -> None:
    """Of a slender column off the axis: volume, tilt stiffness within the shares k D, k T that the limit leaves."""
    member = Member(start=[4.0, 2.0, -30.0], end=[4.0, 2.0, 9.0], diameter=6.0, added_mass=1.0, pressure=1.0,
                    plate_pressure=1.0)  # fmt: skip
    c = with_members(None, [member], 200.0, 9.80665)
    k = wave_number(c.frequency, 200.0, 9.80665)
    volume, found, known = long_wave_stiffness(c, k[0])
    assert volume == pytest.approx(30.0 * 9.0 * np.pi, rel=0.02)
    assert found == pytest.approx(known, rel=0.02)
    depth = force_height(c, k)
    assert depth is not None and -1.0 / 0.2 < depth < 0.0


@pytest.mark.parametrize("name", FLOATERS)
def test_a_centre_of_rotation_under_water_is_refused(name: str) -> None:
    platform, c = floater(name)
    check_coefficients(c, platform, name)
    k = wave_number(c.frequency, platform.depth, 9.80665)
    sunk = about_still_water(c, -platform.centre, platform.volume)
    heights = [force_height(each, k) for each in (c, sunk)]
    assert heights[1] == pytest.approx(heights[0] - platform.centre[2])  # type: ignore[operator]
    with pytest.raises(InputError, match="short waves act .* m above the point of the moments"):
        check_coefficients(sunk, platform, name)


@pytest.mark.parametrize("name", FLOATERS[:2])
def test_a_stiffness_with_the_weight_is_refused(name: str) -> None:
    """As of a file .hst that Capytaine exports. The long waves of the third have another volume than its platform."""
    platform, c = floater(name)
    volume, found, known = long_wave_stiffness(c, float(wave_number(c.frequency, platform.depth, 9.80665)[0]))
    assert volume == pytest.approx(platform.volume, rel=0.03) and found == pytest.approx(known, rel=0.04)
    heavy = c.hydrostatic + tilt_stiffness(platform.centre, -platform.mass / platform.water_density)
    with pytest.raises(InputError, match=r"the platform's weight adds .* give the water alone in \.hst"):
        check_coefficients(replace(c, hydrostatic=heavy), platform, name)
    # of a fifth of the stiffness of the water on, the weight can be told from its inaccuracy
    mass = platform.mass / platform.water_density
    for share, told in ((0.18, False), (0.22, True)):
        light = platform.replace(centre=(*platform.centre[:2], -share * abs(found) / mass))
        given = replace(c, hydrostatic=c.hydrostatic + tilt_stiffness(light.centre, -mass))
        with pytest.raises(InputError, match="the platform's weight adds") if told else nullcontext():
            check_coefficients(given, light, name)


def test_two_halves_of_a_hull_are_the_hull(tmp_path: Path) -> None:
    """Halves of the loads on points of two bodies, from files with twelve motions, together are those of one body."""
    platform, c = floater("iea15mw-volturnus")
    some = np.linspace(5, len(c.frequency) - 1, 6).astype(int)
    c = replace(
        c, frequency=c.frequency[some], added_mass=c.added_mass[some], damping=c.damping[some],
        excitation=c.excitation[some], drift=NO_FORCE, drift_frequency=NONE, drift_heading=NONE,
    )  # fmt: skip
    V = platform.volume
    bodies = Body(place=[-20.0, 5.0, -3.0], volume=0.3 * V), Body(place=[30.0, -10.0, 2.0], volume=0.7 * V)
    half = np.vstack([0.5 * np.linalg.inv(transfer(each.place)).T for each in bodies])
    water = c.hydrostatic - sum(tilt_stiffness(each.place, each.volume) for each in bodies)
    square = (half @ each @ half.T for each in (c.added_mass, c.damping, c.infinite, water))
    names = ("added_mass", "damping", "infinite", "hydrostatic")
    two = replace(c, excitation=c.excitation @ half.T, **dict(zip(names, square, strict=True)))
    for end, text in wamit_texts(two).items():
        (tmp_path / f"two{end}").write_text(text)
    path = str(tmp_path / "two")
    found = platform_coefficients(platform.replace(coefficients=path, bodies=bodies, drift="none"))
    for name in (*names, "frequency", "excitation"):
        expected = getattr(c, name)
        np.testing.assert_allclose(getattr(found, name), expected, atol=1e-7 * np.abs(expected).max())
    with pytest.raises(InputError, match="0 bodies, but .* has motions of 2; give place and volume of each"):
        platform_coefficients(platform.replace(coefficients=path))
    with pytest.raises(InputError, match="has forces of second order, which need one body"):
        platform_coefficients(platform.replace(bodies=bodies[:1], volume=0.3 * V))
    for change, message in (
        ({"bodies": (bodies[0], bodies[0])}, "bodies displace .* and volume is"),
        ({"bodies": bodies, "coefficients": ""}, "bodies: they are those of coefficients"),
    ):
        with pytest.raises(InputError, match=message):
            platform.replace(**change)
