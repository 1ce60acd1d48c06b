"""Winds as records: limits, labels, hashes, and whether a box covers a run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from meltemi.core.errors import InputError
from meltemi.wind.fields import (
    SharedTurbulence,
    SteadyWind,
    WindBox,
    WindSeries,
    at_speed,
    check_coverage,
    unit_turbulence,
)

NT, NZ, NY = 200, 15, 15
WIND = np.full((NT, NZ, NY, 3), 8.0, dtype=np.float32)
BOX = WindBox(velocity=WIND, dt=0.5, dy=10.0, dz=10.0, bottom=20.0, speed=8.0, hub_height=90.0, source="field.bts")
# 140 m wide, 20 m to 160 m high, 99.5 s long
RUN = {"hub_height": 90.0, "radius": 63.0, "reach": 5.0, "duration": 60.0}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("speed", -1.0),
        ("speed", 101.0),
        ("speed", float("nan")),
        ("shear_exponent", 1.0),
        ("roughness", -0.1),
        ("direction", 30.0),
        ("veer", 0.2),
        ("upflow", 8.0),
        ("reference_height", 0.0),
    ],
)
def test_a_steady_wind_has_limits_that_catch_degrees(name: str, value: float) -> None:
    with pytest.raises(InputError, match=name):
        SteadyWind(**{"speed": 10.0, name: value})


def test_labels_say_what_the_wind_is() -> None:
    assert SteadyWind(speed=12.0).label == "steady wind 12 m/s"
    assert SteadyWind(speed=12.0, shear_exponent=0.2, direction=np.radians(30.0)).label == (
        "steady wind 12 m/s, shear exponent 0.2, direction 30 deg"
    )
    assert SteadyWind(speed=12.0, shear_exponent=0.2, roughness=0.03).label == "steady wind 12 m/s, roughness 0.03 m"
    assert BOX.label == "field.bts"
    assert replace(BOX, source="").label == "wind box"


COLUMNS = "speed direction vertical horizontal_shear exponent vertical_shear gust".split()


def test_columns_of_a_series_have_the_length_of_its_time() -> None:
    columns: dict[str, Any] = {name: np.zeros(3) for name in COLUMNS}
    assert WindSeries(time=np.arange(3.0), **columns).label == "wind series"
    columns["gust"] = np.zeros(2)
    with pytest.raises(InputError, match="gust must have 3 entries like time"):
        WindSeries(time=np.arange(3.0), **columns)


@pytest.mark.parametrize(("time", "row"), [([0.0, 2.0, 1.0], 3), ([0.0, 0.0, 1.0], 2)])
def test_time_of_a_series_increases(time: list[float], row: int) -> None:
    with pytest.raises(InputError, match=f"time must increase, but row {row}"):
        WindSeries(time=time, **{name: np.zeros(3) for name in COLUMNS})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"velocity": WIND[..., 0]}, r"velocity must have shape \(T, Z, Y, 3\)"),
        ({"velocity": WIND[:1]}, "at least 2 points each"),
        ({"velocity": WIND[:, :, :1]}, "at least 2 points each"),
        ({"dt": 0.0}, "dt must be a positive number, found 0.0"),
        ({"dy": -1.0}, "dy must be a positive number"),
        ({"speed": float("nan")}, "speed must be a positive number, found nan"),
        ({"speed": 1e6}, "speed must be a positive number, found 1000000.0 .at most 100."),
        ({"direction": 1e9}, "direction must be an angle within pi rad"),
        ({"direction": float("nan")}, "direction must be an angle within pi rad"),
        ({"velocity": 1e3 * WIND}, "velocities reach .* m/s, expected at most 300"),
        ({"bottom": 0.0}, "bottom must be a positive number"),
        (
            {"velocity": np.where(np.arange(3) == 1, np.nan, WIND).astype(np.float32)},
            f"{NT * NZ * NY} velocities are not",
        ),
    ],
)
def test_a_box_is_checked(changes: dict[str, Any], expected: str) -> None:
    with pytest.raises(InputError, match=f"wind box: {expected}|wind box: .*{expected}"):
        replace(BOX, **changes)


def test_dimensions_of_a_box() -> None:
    assert (BOX.width, BOX.top, BOX.duration) == (140.0, 160.0, 99.5)


def test_the_hash_of_a_box_is_that_of_velocities_and_grid() -> None:
    assert BOX.content_hash() == replace(BOX, source="another name").content_hash()
    others = [
        replace(BOX, **change)
        for change in (
            {"dt": 0.25},
            {"dy": 9.0},
            {"dz": 9.0},
            {"bottom": 21.0},
            {"speed": 9.0},
            {"periodic": True},
            {"direction": 0.1},
            {"velocity": WIND + 1.0},
        )
    ]
    assert len({BOX.content_hash(), *(b.content_hash() for b in others)}) == 9


def test_a_changed_copy_of_a_box_has_its_own_hash() -> None:
    before = BOX.content_hash()
    assert replace(BOX, velocity=WIND + 1.0).content_hash() != before


def test_a_box_that_covers_the_run_passes() -> None:
    check_coverage(BOX, **RUN)


@pytest.mark.parametrize("wind", [SteadyWind(speed=10.0)])
def test_only_boxes_are_checked(wind: SteadyWind) -> None:
    check_coverage(wind, **{**RUN, "radius": 1e4})


@pytest.mark.parametrize(
    ("box", "run", "expected"),
    [
        ({}, {"radius": 70.5}, "it is 140 m wide, the rotor needs 141.0 m"),
        ({}, {"radius": 70.5}, "it reaches up to 160 m, the rotor to 160.5 m"),
        ({"bottom": 30.0}, {}, "it begins at 30 m above ground, the rotor reaches down to 27.0 m"),
        (
            {},
            {"hub_height": 95.0, "radius": 60.0},
            "it was generated for a hub height of 90 m, the turbine's is 95.0 m",
        ),
        # half the width (70 m) and the reach (5 m) pass at 8 m/s: 9.375 s
        ({}, {"duration": 91.0}, "it is 99.5 s long, a run of 91 s needs 100.4 s"),
        ({}, {"duration": 91.0}, "the longest run is 90.1 s"),
        ({"dt": 0.01}, {}, "the longest run is 0.0 s"),
    ],
)
def test_what_a_box_does_not_cover_is_named(box: dict[str, Any], run: dict[str, float], expected: str) -> None:
    with pytest.raises(InputError) as caught:
        check_coverage(replace(BOX, **box), **{**RUN, **run})
    assert str(caught.value).startswith("field.bts: the wind field does not cover the run: ")
    assert expected in str(caught.value)


def test_everything_that_is_missing_is_listed() -> None:
    with pytest.raises(InputError) as caught:
        check_coverage(BOX, hub_height=120.0, radius=110.0, reach=5.0, duration=1e4)
    message = str(caught.value)
    for part in ("140 m wide", "reaches up to 160 m", "begins at 20 m above", "hub height of 90 m", "99.5 s long"):
        assert part in message


def test_a_periodic_box_is_long_enough_for_any_run() -> None:
    check_coverage(replace(BOX, periodic=True), **{**RUN, "duration": 1e5})


def test_a_box_without_hub_height_fits_every_turbine_it_covers() -> None:
    check_coverage(replace(BOX, hub_height=None), hub_height=85.0, radius=60.0, reach=5.0, duration=60.0)


def test_the_longest_run_that_is_named_is_long_enough() -> None:
    longest = BOX.duration - (0.5 * BOX.width + 5.0) / BOX.speed
    check_coverage(BOX, **{**RUN, "duration": longest})
    with pytest.raises(InputError, match="long"):
        check_coverage(BOX, **{**RUN, "duration": longest + 1e-6})


def test_a_field_at_another_speed_has_the_same_eddies() -> None:
    fast = at_speed(BOX, 2.0 * BOX.speed)
    assert (fast.speed, fast.dt) == (2.0 * BOX.speed, 0.5 * BOX.dt)  # the same distance between planes
    mean, faster = (box.velocity.astype(float).mean(axis=(0, 2)) for box in (BOX, fast))
    np.testing.assert_allclose(faster, 2.0 * mean, rtol=1e-5, atol=1e-5)
    fluctuations = [box.velocity - box.velocity.mean(axis=(0, 2))[:, None] for box in (BOX, fast)]
    np.testing.assert_allclose(fluctuations[1], fluctuations[0], atol=1e-4)
    with pytest.raises(InputError, match="speed must be a positive number, found -1"):
        at_speed(BOX, -1.0)


@pytest.mark.parametrize(("name", "value"), [("speed", 301.0), ("gust", -1e40), ("direction", 2e3)])
def test_a_series_out_of_range_is_refused(name: str, value: float) -> None:
    columns = {"speed": [10.0, 10.0], name: [1.0, value]}
    with pytest.raises(InputError, match=f"{name} must be within .*, but row 2 has"):
        WindSeries(time=[0.0, 1.0], **columns)


def test_shared_turbulence_must_cover_the_run_with_its_own_speed() -> None:
    def check(speed: float, begin: float = 0.0) -> None:
        check_coverage(SharedTurbulence(SteadyWind(speed=speed), BOX, 1.0, begin), **RUN)

    check(8.0)
    with pytest.raises(InputError, match="it is 66.3 s long, a run of 60 s needs 66.2 s|needs"):
        check(12.1)
    check(8.0, 200.0)
    with pytest.raises(InputError, match="needs 100.6 s"):
        check(8.0, 250.0)
    check_coverage(SharedTurbulence(SteadyWind(speed=25.0), replace(BOX, periodic=True), 1.0, 1e6), **RUN)


def test_shared_turbulence_has_limits_and_a_hash_of_all_its_parts() -> None:
    mean, other = SteadyWind(speed=8.0), SteadyWind(speed=9.0)
    winds = [
        SharedTurbulence(mean, BOX, 1.0),
        SharedTurbulence(other, BOX, 1.0),
        SharedTurbulence(mean, replace(BOX, velocity=WIND + 1.0), 1.0),
        SharedTurbulence(mean, BOX, 2.0),
        SharedTurbulence(mean, BOX, 1.0, 3.0),
    ]
    assert len({wind.content_hash() for wind in winds}) == len(winds)
    assert winds[4].label == "steady wind 8 m/s, field.bts times 1 m/s from 3 m on"
    for sigma, begin in ((-1.0, 0.0), (1.0, float("nan"))):
        with pytest.raises(InputError, match="must be 0 or a positive number"):
            SharedTurbulence(mean, BOX, sigma, begin)
    with pytest.raises(InputError, match="a wind without turbulence cannot be scaled"):
        unit_turbulence(BOX)
