"""Wind and air of a record: places and signs of sensors, density, given conditions, travel from mast to rotor."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from meltemi import InputError, Turbine
from meltemi.environment.air import air_density
from meltemi.validation.channel_map import ChannelMap
from meltemi.validation.conditions import RecordConditions, SiteConditions, conditions_of, given_conditions
from meltemi.validation.measurements import MeasuredRecord, Signal, measurements_of
from meltemi.validation.simulations import field_of

Float = NDArray[np.float64]
BEGIN, RATE, N, TRANSIENT = 1_714_564_800.0, 4.0, 2400, 30.0
TIME = np.arange(N) / RATE
"""[s] of the record."""
SLOW = np.sin(2.0 * np.pi * TIME / 25.0)
"""Of a period that the planes of a field resolve."""
LATE = np.cos(2.0 * np.pi * TIME / 25.0)
SONIC = {"unit": "m/s", "kind": "sonic", "height": 80.0, "upwind": 150.0}
U, V, W = ({"column": name, "component": name, **SONIC} for name in "uvw")
CUP = {
    "column": "s",
    "unit": "m/s",
    "kind": "cup",
    "component": "speed",
    "height": 40.0,
    "upwind": 150.0,
    "lateral": 3.0,
}
VANE = {"column": "d", "unit": "deg", "kind": "vane", "component": "direction", "height": 40.0, "upwind": 150.0}
VANE |= {"lateral": 3.0}
AXIS = {"column": "n", "unit": "deg", "kind": "position"}
COLUMNS: dict[str, Float] = {
    "u": 9.0 + SLOW,
    "v": 0.5 + 0.4 * SLOW,
    "w": 0.2 * SLOW,
    "s": 8.0 + 0.5 * SLOW,
    "d": (355.0 + 10.0 * LATE) % 360.0,
    "n": np.full(N, 350.0),
}


def read(sensors: dict[str, Any], **columns: Float) -> tuple[MeasuredRecord, ChannelMap]:
    """The record of columns, and their map."""
    time = {"column": "t", "form": "posix"}
    wind = next(iter(sensors))
    channels = ChannelMap(loggers={"mast": {"time": time, "channels": sensors}}, wind=wind)
    (record,) = measurements_of({"mast": {"t": BEGIN + TIME, **COLUMNS, **columns}}, channels)
    return record, channels


def of(sensors: dict[str, Any], given: dict[str, float] | None = None, **columns: Float) -> RecordConditions:
    record, channels = read(sensors, **columns)
    return conditions_of(record, channels, SiteConditions(**given or {}), 80.0, TRANSIENT, {"dt": 0.25})


def test_sensors_by_their_place() -> None:
    c = of({"wind_speed": U, "v": V, "w": W, "cup": CUP, "vane": VANE})
    sonic, cup = c.sensors
    assert (sonic.height, sonic.across, cup.height, cup.across, c.distance) == (80.0, 0.0, 40.0, 3.0, 150.0)
    for name in "uvw":
        assert getattr(sonic, name) == pytest.approx(COLUMNS[name])
    assert sonic.speed is None and cup.u is None and cup.speed == pytest.approx(COLUMNS["s"])
    # time 0 is the start of the simulation
    assert sonic.time == pytest.approx(TIME + TRANSIENT) and cup.time == pytest.approx(TIME + TRANSIENT)
    low = abs(np.mean(COLUMNS["s"] * np.exp(1j * np.radians(10.0 * LATE))))
    assert c.wind.shear_exponent == pytest.approx(np.log(np.hypot(9.0, 0.5) / low) / np.log(2.0), rel=1e-6)
    assert c.air_density is None


def test_what_is_behind_or_not_measured_is_left_out() -> None:
    nacelle = {**CUP, "upwind": -4.0}
    c = of({"wind_speed": U, "v": V, "cup": nacelle, "other": {"column": "s", "unit": "m/s"}})
    assert len(c.sensors) == 1 and c.wind.shear_exponent == 0.2


def test_the_vane_is_taken_from_the_axis_of_the_rotor() -> None:
    with_axis = of({"cup": CUP, "vane": VANE, "nacelle_direction": AXIS})
    (sensor,) = with_axis.sensors
    # 355 degrees are 5 degrees clockwise of 350 seen from above, across north
    assert sensor.direction == pytest.approx(np.radians(5.0 + 10.0 * LATE))
    assert np.degrees(with_axis.wind.direction) == pytest.approx(5.0, abs=0.01)
    alone = of({"cup": CUP, "vane": VANE})
    assert alone.wind.direction == pytest.approx(0.0, abs=1e-4)
    assert alone.sensors[0].direction == pytest.approx(np.radians(10.0 * LATE), abs=1e-4)
    # v is positive to the left looking downwind: such wind has turned counter-clockwise
    assert of({"wind_speed": U, "v": V}).wind.direction == pytest.approx(-np.arctan2(0.5, 9.0), rel=1e-3)


def test_gaps_of_the_vane_stay_gaps() -> None:
    gaps = COLUMNS["d"].copy()
    gaps[10:20] = np.nan
    (sensor,) = of({"cup": CUP, "vane": VANE, "nacelle_direction": AXIS}, d=gaps).sensors
    assert sensor.direction is not None
    assert np.array_equal(np.isnan(sensor.direction), np.isnan(gaps))


def test_density() -> None:
    kelvin = {"column": "T", "unit": "K", "offset": 273.15}  # the logger has degrees Celsius
    temperature, pressure, humidity = 8.0 + SLOW, np.full(N, 985.0), np.full(N, 80.0)
    hpa, share = {"column": "p", "unit": "hPa"}, {"column": "h", "unit": "%"}
    wind = {"wind_speed": U, "v": V}
    air = {"air_temperature": kelvin, "air_pressure": hpa, "humidity": share}
    columns = {"T": temperature, "p": pressure, "h": humidity}
    assert of(wind | air, **columns).air_density == pytest.approx(
        float(air_density(8.0, 0.8, pressure=98500.0)), rel=1e-6
    )
    dry = {name: air[name] for name in ("air_temperature", "air_pressure")}
    assert of(wind | dry, **columns).air_density == pytest.approx(float(air_density(8.0, 0.5, pressure=98500.0)))
    warm = {"air_temperature": kelvin}
    assert of(wind | warm, {"pressure": 9e4}, **columns).air_density == pytest.approx(
        float(air_density(8.0, 0.5, pressure=9e4))
    )
    assert of(wind | warm, **columns).air_density is None  # without pressure it is not known
    assert of(wind | air, {"air_density": 1.1}, **columns).air_density == 1.1  # given is preferred
    lost = {**columns, "T": np.full(N, np.nan)}
    assert of(wind | air, **lost).air_density is None


def test_later_patterns_take_precedence() -> None:
    patterns = {
        "*": SiteConditions(air_density=1.2, shear_exponent=0.1),
        "stable_*": SiteConditions(shear_exponent=0.4, veer=0.001),
        "stable_0[12].csv": SiteConditions(air_density=1.1),
    }
    assert given_conditions(patterns, "neutral_01.csv") == patterns["*"]
    assert given_conditions(patterns, "stable_03.csv") == SiteConditions(
        air_density=1.2, shear_exponent=0.4, veer=0.001
    )
    both = SiteConditions(air_density=1.1, shear_exponent=0.4, veer=0.001)
    assert given_conditions(patterns, "stable_02.csv") == both
    assert given_conditions({}, "a.csv") == SiteConditions()
    c = of({"wind_speed": U, "v": V, "cup": CUP}, {"shear_exponent": 0.4, "veer": 0.001})
    assert (c.wind.shear_exponent, c.wind.veer) == (0.4, 0.001)


REFUSED = {
    "no anemometer upwind": ({"other": {"column": "s", "unit": "m/s"}}, {}, "mast: no wind upwind of the rotor"),
    "only behind the rotor": ({"cup": {**CUP, "upwind": -3.0}}, {}, "mast: no wind upwind of the rotor"),
    "no height": ({"cup": {**CUP, "height": None}}, {}, "channels.cup: the height of an anemometer"),
    "two distances": (
        {"wind_speed": U, "v": V, "cup": {**CUP, "upwind": 80.0}},
        {},
        "mast: anemometers at 80, 150 m upwind: leave those out",
    ),
    "u without v": ({"wind_speed": U}, {}, "mast: .* u and v are given together"),
    "only a vane": ({"vane": VANE}, {}, "mast: .*the mean wind needs a mean speed above 0"),
    "gaps": ({"cup": CUP}, {"s": np.where(np.arange(N) % 3, 8.0, np.nan)}, "mast: .*33.3 % of speed is missing"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_wind_that_is_not_known_is_refused_in_one_sentence(kind: str) -> None:
    sensors, columns, message = REFUSED[kind]
    with pytest.raises(InputError, match=message) as refused:
        of(sensors, **columns)
    assert "\n" not in str(refused.value) and "pydantic" not in str(refused.value)


def test_series_of_one_place_have_one_clock() -> None:
    record, channels = read({"wind_speed": U, "v": V})
    signals = {**record.signals, "v": Signal(record["v"].time[1:], record["v"].values[1:], RATE)}
    with pytest.raises(InputError, match="mast: v and others at 80 m have different times"):
        conditions_of(replace(record, signals=signals), channels, SiteConditions(), 80.0, TRANSIENT, {})


def test_the_air_needs_time_from_the_mast_to_the_rotor(turbine: Turbine) -> None:
    sonic = {"wind_speed": {**U, "height": 90.0}, "v": {**V, "column": "zero", "height": 90.0}}
    record, channels = read(sonic, zero=0.01 * SLOW)
    settings = {"points": 3, "dt": 0.25, "coherent": "all"}
    c = conditions_of(record, channels, SiteConditions(), turbine.hub_height, TRANSIENT, settings)
    box = field_of(c.sensors, c.wind, turbine, TRANSIENT + TIME[-1], c.distance, 0.1)
    assert box.direction == pytest.approx(0.1, abs=1e-3)  # the yaw error turns the wind clockwise
    seen = box.velocity[:, int(np.argmin(np.abs(box.bottom + box.dz * np.arange(9) - 90.0))), 1, 0].astype(float)
    travel = 150.0 / c.wind.speed
    inside = (box.passing > TRANSIENT + travel) & (box.passing < TRANSIENT + TIME[-1])
    measured = np.interp(box.passing[inside] - TRANSIENT - travel, TIME, COLUMNS["u"])
    assert np.std(seen[inside] - measured) < 0.1 * np.std(measured)
