"""Tables of ten-minute statistics: layouts, signs and units, doubtful rows, classes, wind and air, refusals."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from meltemi import InputError, Turbine
from meltemi.validation.channel_map import ChannelMap, Statistic
from meltemi.validation.conditions import SiteConditions, conditions_of, given_conditions
from meltemi.validation.measurements import MeasuredRecord, measurements_of, read_measurements
from meltemi.validation.plausibility import plausible
from meltemi.validation.quality import doubtful
from meltemi.validation.reduction import STATISTICS, reduce_statistics
from meltemi.validation.selection import operation_of, select
from meltemi.validation.settings import Validation
from meltemi.validation.simulations import field_of

BEGIN = 1_714_564_800.0
"""2024-05-01 12:00:00 UTC."""
N = 12
SPEED = np.linspace(6.0, 10.0, N)
POWER = 3.0 * SPEED**3
"""[kW] of a turbine of 5 MW."""
TIMES = {"column": "t", "form": "posix"}
WIND = {"unit": "m/s", "kind": "cup", "component": "speed", "height": 90.0}
ROWS = {
    "t": BEGIN + 600.0 * np.arange(N),
    "v": SPEED,
    "sv": 0.1 * SPEED,
    "P": POWER,
    "sP": 0.2 * POWER,
    "lP": 0.5 * POWER,
    "hP": 1.6 * POWER,
    "n": 1.1 * SPEED,
}
CHANNELS: dict[str, Any] = {
    "wind_speed": {"statistics": {"mean": "v", "std": "sv"}, **WIND},
    "generator_power": {
        "statistics": {"mean": "P", "std": "sP", "min": "lP", "max": "hP"},
        "unit": "kW",
        "kind": "power",
    },
    "rotor_speed": {"statistics": {"mean": "n"}, "unit": "rpm", "kind": "rpm"},
}


def channel_map(**changed: Any) -> ChannelMap:
    """The map of one table; channels, changed or added."""
    return ChannelMap(loggers={"scada": {"time": TIMES, "channels": {**CHANNELS, **changed}}})


def records(given: ChannelMap | None = None, **columns: Any) -> list[MeasuredRecord]:
    return measurements_of({"scada": {**ROWS, **columns}}, given or channel_map())


def test_names_are_those_of_the_comparison() -> None:
    assert get_args(Statistic) == STATISTICS[:6]


def test_a_row_is_a_record() -> None:
    every = records()
    assert [r.begin for r in every] == ROWS["t"].tolist() and {r.length for r in every} == {600.0}
    third = every[2].statistics
    assert third["generator_power"] == pytest.approx(
        {"mean": 1e3 * POWER[2], "std": 200.0 * POWER[2], "min": 500.0 * POWER[2], "max": 1600.0 * POWER[2]}
    )
    assert third["rotor_speed"] == pytest.approx({"mean": 1.1 * SPEED[2] * np.pi / 30.0})
    wind = every[2]["wind_speed"].finite  # stands for the series
    assert (np.mean(wind), np.std(wind)) == pytest.approx((SPEED[2], 0.1 * SPEED[2]))
    signals, reduced = reduce_statistics(every[2], ["generator_power", "rotor_speed", "root_moment_flap_1"], 0.5)
    assert list(reduced.values) == list(signals) == ["generator_power", "rotor_speed"] and not reduced.spectra
    assert len(signals["rotor_speed"].time) == 1200 and signals["rotor_speed"].time[0] == every[2].begin
    assert np.isfinite(reduced.values["rotor_speed"]).tolist() == [s == "mean" for s in STATISTICS]
    with pytest.raises(InputError, match="none of the compared channels has a statistic"):
        reduce_statistics(every[2], ["root_moment_flap_1"], 0.5)


def test_sign_gain_and_offset() -> None:
    """The spread has no offset; a reversed channel has its largest value where the column has the smallest."""
    power = {**CHANNELS["generator_power"], "sign": -1, "gain": 2.0, "offset": 5.0}
    of = records(channel_map(generator_power=power))[0].statistics["generator_power"]
    expected = {"mean": -2.0 * POWER[0] - 5.0, "std": 0.4 * POWER[0]}
    expected |= {"max": -POWER[0] - 5.0, "min": -3.2 * POWER[0] - 5.0}
    assert of == pytest.approx({key: 1e3 * x for key, x in expected.items()})


def test_a_file_for_each_statistic(tmp_path: Path) -> None:
    """Without time stamps the rows are numbered by ten minutes."""
    files = {"mean": "means.csv", "std": "deviations.csv"}
    for name, factor in (("means.csv", 1.0), ("deviations.csv", 0.1)):
        np.savetxt(tmp_path / name, factor * np.c_[SPEED, POWER], delimiter=",", header="v [m/s],P", comments="")
    channels = {"wind_speed": {"column": "v", **WIND}, "generator_power": {"column": "P", "unit": "kW"}}
    given = ChannelMap(loggers={"scada": {"statistics": files, "channels": channels}})
    every = read_measurements(tmp_path, given)
    assert [r.begin for r in every] == [600.0 * k for k in range(N)] and every[0].file == "means.csv"
    assert every[3].statistics["generator_power"] == pytest.approx({"mean": 1e3 * POWER[3], "std": 100.0 * POWER[3]})
    (tmp_path / "deviations.csv").write_text("v,P\n1,2\n")
    with pytest.raises(InputError, match="column 'std/v' has 1 samples for 12 times"):
        read_measurements(tmp_path, given)
    (tmp_path / "deviations.csv").unlink()
    with pytest.raises(InputError, match="deviations.csv"):
        read_measurements(tmp_path, given)


def test_tables_of_two_loggers_are_joined_by_their_times() -> None:
    channels = {name: CHANNELS[name] for name in ("generator_power", "rotor_speed")}
    mast = {"time": TIMES, "channels": {"wind_speed": CHANNELS["wind_speed"]}}
    loggers = {"mast": mast, "turbine": {"time": {**TIMES, "stamp": "end"}, "channels": channels}}
    later = {key: x[2:] for key, x in (ROWS | {"t": ROWS["t"] + 600.0}).items()}
    every = measurements_of({"mast": ROWS, "turbine": later}, ChannelMap(loggers=loggers))
    assert len(every) == N and every[1].statistics["generator_power"] == {}
    assert every[2].statistics["generator_power"]["mean"] == pytest.approx(1e3 * POWER[2])
    with pytest.raises(InputError, match="two rows begin at 2024-05-01 12:00:00; remove one, or correct zone"):
        measurements_of({"mast": {**ROWS, "t": np.full(N, BEGIN)}, "turbine": later}, ChannelMap(loggers=loggers))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"lP": ROWS["hP"], "hP": ROWS["lP"]},
            "generator_power: column 'P': the mean is not between minimum and maximum",
        ),
        (
            {"sP": ROWS["P"]},
            "generator_power: column 'P': the standard deviation is negative, or more than half of maximum",
        ),
        ({"P": np.full(N, np.nan)}, "generator_power: column 'P': no mean; the row is excluded"),
    ],
)
def test_statistics_that_no_series_has(turbine: Turbine, change: dict[str, Any], words: str) -> None:
    every = records(**change)
    issues = doubtful(every, channel_map())
    assert (
        len(issues) == N
        and {issue.samples for issue in issues} == {1}
        and words in str(issues[0])
        and len({str(issue) for issue in issues}) == 1
    )
    assert all(each.rejected for each in select(every, turbine, issues=issues))
    assert not doubtful(records(), channel_map())


def test_a_row_without_the_deviation_of_the_wind_is_rejected(turbine: Turbine) -> None:
    """It would be a wind without turbulence."""
    every = select(records(sv=np.where(np.arange(N) == 3, np.nan, ROWS["sv"])), turbine)
    assert [each.rejected for each in every if each.rejected] == ["wind_speed: 0.0 % of the samples, 99 % are required"]


def test_directions_may_pass_north() -> None:
    vane = {"statistics": {"mean": "d", "min": "l", "max": "h"}, "unit": "deg", "kind": "vane"}
    columns = {"d": np.full(N, 3.0), "l": np.full(N, 5.0), "h": np.full(N, 350.0)}
    given = channel_map(wind_direction=vane)
    assert not doubtful(records(given, **columns), given)


def test_a_wrong_unit_is_one_issue(turbine: Turbine) -> None:
    given = channel_map()
    assert not plausible(records(), given, turbine)
    issue = next(iter(plausible(records(P=1e3 * POWER, lP=500.0 * POWER, hP=1.6e3 * POWER), given, turbine)))
    assert (
        issue.kind == "unit" and "column 'P' in kW reaches" in str(issue) and "times 0.001 it would fit" in str(issue)
    )


@pytest.mark.parametrize(
    ("power", "speed", "operation"),
    [
        ({"mean": 2e6, "min": 1e5}, {}, "production"),
        ({"mean": 2e6}, {}, "production"),
        ({"mean": 2e6, "min": -1e3, "max": 3e6}, {}, "interrupted"),
        ({"mean": 2e6, "min": 1e6}, {"max": 1.5}, "fault"),
        ({"mean": 0.0, "max": 1e3}, {"mean": 0.5}, "idling"),
        ({"mean": 0.0, "max": 1e3}, {"mean": 0.001}, "parked"),
        ({"std": 2.0}, {}, None),
    ],
)
def test_classes(turbine: Turbine, power: Any, speed: Any, operation: str | None) -> None:
    statistics = {"generator_power": power, **({"rotor_speed": speed} if speed else {})}
    assert operation_of(replace(records()[0], statistics=statistics), turbine) == operation


def test_selection_and_capture(turbine: Turbine) -> None:
    columns = {key: CHANNELS[key] for key in ("wind_speed", "generator_power")}
    given = ChannelMap(loggers={"scada": {"time": TIMES, "channels": columns}})
    selected = select(records(given), turbine)  # without the rotor speed
    assert {(each.operation, each.rejected) for each in selected} == {("production", "")}
    assert [each.wind_speed for each in selected] == pytest.approx(SPEED)
    assert [each.turbulence for each in selected] == pytest.approx(np.full(N, 0.1))


def test_wind_and_air_of_a_row(turbine: Turbine) -> None:
    low = {"statistics": {"mean": "w", "std": "sv"}, **WIND, "height": 45.0}
    air = {"air_density": {"statistics": {"mean": "rho"}, "unit": "kg/m^3"}}
    columns = {"w": 0.9 * SPEED, "rho": np.full(N, 1.1), "alpha": np.full(N, 0.3)}
    given = channel_map(low=low, **air)
    settings = {"points": 3, "dt": 0.5}

    def of(channels: ChannelMap, **site: float) -> Any:
        record = records(channels, **columns)[4]
        given = given_conditions({"*": SiteConditions(**site)}, record.file, record)
        return conditions_of(record, channels, given, 90.0, 60.0, settings)

    c = of(given)
    assert (c.wind.speed, c.air_density) == pytest.approx((SPEED[4], 1.1))
    assert c.wind.shear_exponent == pytest.approx(np.log(1.0 / 0.9) / np.log(2.0))
    measured = channel_map(shear_exponent={"statistics": {"mean": "alpha"}, "unit": "-"}, **air)
    assert of(measured).wind.shear_exponent == 0.3
    known = of(measured, shear_exponent=0.1, air_density=1.2)
    assert (known.wind.shear_exponent, known.air_density) == (0.1, 1.2)
    c = of(channel_map())
    assert c.wind.intensity == pytest.approx(0.1)
    box, turned = (field_of((), c.wind, turbine, 100.0, 0.0, turn) for turn in (0.0, 0.1))
    u = box.velocity[:, box.velocity.shape[1] - 2, 1, 0]
    assert (u.mean(), u.std()) == pytest.approx((SPEED[4], 0.1 * SPEED[4]), rel=1e-3)  # at the hub
    assert turned.direction == pytest.approx(0.1)


MAPS: dict[str, tuple[dict[str, Any], str]] = {
    "both": ({"column": "P"}, "give column; or statistics"),
    "unknown": ({"statistics": {"average": "P"}}, "average"),
    "some": ({"column": "P", "statistics": {}}, "either every channel names the columns of them, or the logger"),
}


@pytest.mark.parametrize("kind", MAPS)
def test_wrong_entries_of_a_channel(kind: str) -> None:
    change, words = MAPS[kind]
    with pytest.raises(InputError, match=words):
        channel_map(generator_power={**CHANNELS["generator_power"], **change})


def test_wrong_maps() -> None:
    with pytest.raises(InputError, match="wind: wind_speed needs mean and std to define the wind; std is missing"):
        channel_map(wind_speed={**CHANNELS["wind_speed"], "statistics": {"mean": "v"}})
    series = {"time": TIMES, "channels": {"pitch_1": {"column": "a", "unit": "deg"}}}
    with pytest.raises(InputError, match="all have ten-minute statistics, with times to join their rows"):
        ChannelMap(loggers={"scada": {"time": TIMES, "channels": CHANNELS}, "b": series})
    with pytest.raises(InputError, match="time: the column of the time stamps is needed"):
        ChannelMap(loggers={"b": {"channels": series["channels"]}}, wind="pitch_1")
    with pytest.raises(InputError, match="gauges are calibrated by series"):
        Validation(case="", channels=channel_map(), idle=["idle_*"])
