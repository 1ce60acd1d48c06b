"""Faults of measurements: gaps, duplicates, spikes, stuck sensors, clocks; units, signs and wind of another turbine."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from meltemi import InputError, Turbine
from meltemi.reports.blocks import Table
from meltemi.validation import quality
from meltemi.validation.channel_map import ChannelMap, known_channel
from meltemi.validation.issues import DataIssue, issues_table
from meltemi.validation.measurements import MeasuredRecord, Signal, measurements_of
from meltemi.validation.plausibility import plausible
from meltemi.validation.quality import clock_lag, doubtful, spikes, stuck

Float = NDArray[np.float64]
RATE, BEGIN = 10.0, 1_699_999_800.0
STAMPS = {"column": "t", "form": "posix"}


def gusts(n: int, seed: int, time_scale: float = 100.0) -> Float:
    """(n,) first-order noise of unit variance; time scale in samples."""
    a = np.exp(-1.0 / time_scale)
    return np.asarray(lfilter([np.sqrt(1.0 - a * a)], [1.0, -a], np.random.default_rng(seed).standard_normal(n)))


def issues_of(channels: dict[str, Any], **columns: Any) -> list[DataIssue]:
    given = ChannelMap(loggers={"a": {"time": STAMPS, "channels": channels}}, wind=known_name(next(iter(channels))))
    return doubtful(measurements_of({"a": columns}, given), given)


def known_name(name: str) -> str:
    channel = known_channel(name)
    return channel.name if channel else name


def measured(**columns: Any) -> list[DataIssue]:
    return issues_of({"v": {"column": "u", "unit": "m/s", "kind": "sonic"}}, **columns)


def kinds(issues: list[DataIssue]) -> list[str]:
    return [issue.kind for issue in issues]


def test_clean_data_have_no_issues() -> None:
    """Turbulence, one revolution per 2 s, steps of a display: nothing is a spike, nothing is stuck."""
    time = BEGIN + np.arange(6000) / RATE
    for x in (8.0 + gusts(6000, 1), np.sin(np.pi * time), np.round(8.0 + gusts(6000, 2), 1)):
        assert not kinds(measured(t=time, u=x))


def test_gaps_duplicates_and_order_are_reported_not_repaired() -> None:
    time = BEGIN + np.delete(np.arange(6000), np.arange(500, 540)) / RATE
    time[1000] = time[999]
    time[2000:2100] -= 60.0
    x = gusts(len(time), 3)
    x[100:120] = np.nan
    given = ChannelMap(loggers={"a": {"time": STAMPS, "channels": {"v": {"column": "u", "unit": "m/s"}}}}, wind="v")
    records = measurements_of({"a": {"t": time, "u": x}}, given)
    checked = doubtful(records, given)
    assert sorted(kinds(checked)) == ["duplicate", "gap", "gap", "gap", "missing", "order"]
    gap = next(issue for issue in checked if issue.kind == "gap")
    assert gap.samples == 40 and "40 samples at 10 Hz are missing after 2023-11-14 22:10:49.9" in gap.text
    assert gap.time == pytest.approx(BEGIN + 49.9, abs=1e-3) and gap.duration == pytest.approx(4.1)
    missing = next(issue for issue in checked if issue.kind == "missing")
    assert missing.samples == 20 and missing.duration == pytest.approx(2.0) and "v (u)" in str(missing)
    assert np.array_equal(records[0]["v"].time, time) and np.array_equal(records[0]["v"].values, x, equal_nan=True)
    table = issues_table(checked)
    assert isinstance(table, Table) and table.rows[0][3].startswith("2023-11-14 ")
    assert [(row[0], row[4]) for row in table.rows] == [
        ("gap", "3"),
        ("duplicate", "1"),
        ("order", "1"),
        ("missing", "1"),
    ]


@pytest.mark.parametrize("length", [1, 3])
def test_spikes_are_detected_where_they_are(length: int) -> None:
    x = 15e3 + 3e3 * gusts(6000, 4) + 2e3 * np.sin(0.3 * np.arange(6000))
    for at in (3, 2500, 5990):
        y = x.copy()
        y[at : at + length] = -155e3
        assert np.flatnonzero(spikes(y, RATE)).tolist() == list(range(at, at + length))
    x[3000:3020] -= 155e3  # two seconds are an event
    assert not spikes(x, RATE).any()
    x[2000] = np.nan
    assert not spikes(x, RATE).any() and not spikes(np.full(50, np.nan), RATE).any()


def test_every_spike_is_an_issue_with_its_value() -> None:
    x = 10.0 + gusts(6000, 4)
    x[1000], x[4000] = 60.0, -40.0  # in the unit of the map
    checked = measured(t=BEGIN + np.arange(6000) / RATE, u=x)
    assert [issue.text.split(",")[0] for issue in checked] == ["60 m/s", "-40 m/s"]
    assert [issue.time - BEGIN for issue in checked] == pytest.approx([100.0, 400.0])


def test_gusts_and_short_events_are_no_spikes() -> None:
    x = gusts(6000, 5)
    x[1000:1006] += 12.0
    assert spikes(x, RATE).sum() == 6
    assert not spikes(x, 0.5 * RATE).any()  # 1.2 s
    slow = gusts(6000, 5)
    slow[1000:1009] += 15.0 * np.array([0.25, 0.5, 0.75, 1.0, 1.0, 1.0, 0.75, 0.5, 0.25])
    assert not spikes(slow, RATE).any()


def test_stuck_sensors() -> None:
    time, x = BEGIN + np.arange(6000) / RATE, gusts(6000, 6)
    x[1000:1400] = x[1000]
    assert np.flatnonzero(stuck(x, RATE, 30.0)).tolist() == list(range(1000, 1400))
    assert not stuck(x, RATE, 40.0).any()
    assert kinds(measured(t=time, u=x)) == ["stuck"]
    assert not kinds(machine("GenPwr", "power", time, x))  # steps of a display
    assert not kinds(machine("BldPitch1", "position", time, 0.0 * x))
    for level, expected in ((0.0, []), (3.0, ["stuck"])):
        assert kinds(machine("GenPwr", "power", time, 0.0 * x + level)) == expected


def machine(name: str, kind: str, time: Float, x: Float) -> list[DataIssue]:
    return issues_of({name: {"column": "x", "unit": "kW" if kind == "power" else "rad", "kind": kind}}, t=time, x=x)


def two_clocks(seed: int, lag: float, noise: float = 0.2, n: int = 6000) -> tuple[Signal, Signal]:
    """One quantity by two loggers: their noise is independent, the second one has its own rate and a late clock."""
    chance = np.random.default_rng(seed)
    fine = gusts(10 * n, seed, 300.0)
    t = BEGIN + np.arange(10 * n) / (10.0 * RATE)
    one, two = t[::10], t[::25] + 0.013
    a = fine[::10] + noise * chance.standard_normal(len(one))
    b = 3.0 * np.interp(two, t, fine) + 5.0 + 3.0 * noise * chance.standard_normal(len(two))
    return Signal(one, a, RATE), Signal(two + lag, b, 4.0)


def test_lag_of_clocks_is_recovered() -> None:
    """To a sample of the slower logger, with noise, of either sign."""
    for seed in range(40):
        lag = 12.0 * np.sin(seed)
        one, two = two_clocks(seed, lag)
        there, back = clock_lag(one, two, 4.0, 30.0), clock_lag(two, one, 4.0, 30.0)
        assert there[0] == pytest.approx(lag, abs=0.25) and back[0] == pytest.approx(-lag, abs=0.25)
        assert there[1] > 0.9 and back[1] > 0.9


def test_bounds_of_the_lag() -> None:
    one, two = two_clocks(1, 12.0)
    assert clock_lag(one, two, 4.0, 5.0)[1] < 0.9
    with pytest.raises(InputError, match="less than a minute"):
        clock_lag(Signal(one.time[:200], one.values[:200], RATE), two, 4.0, 30.0)


@pytest.mark.parametrize(
    ("lag", "words"), [(0.0, ""), (3.0, "later than .*its clock"), (20.0, "later"), (-1800.0, "earlier.*zone or stamp")]
)
def test_clocks_of_loggers_that_share_a_channel(lag: float, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Power by two loggers, one hour and a half at 1 Hz."""
    n = 5400
    x = 1e6 + 2e5 * gusts(n + 4000, 8, 60.0)
    power = {"generator_power": {"column": "P", "unit": "W", "kind": "power"}}
    given = ChannelMap(loggers={name: {"time": STAMPS, "channels": power} for name in "ab"}, wind="generator_power")
    t = BEGIN + np.arange(n)
    chance = np.random.default_rng(9)
    tables = {
        "a": {"t": t, "P": x[2000 : 2000 + n]},
        "b": {"t": t, "P": x[2000 - round(lag) : 2000 - round(lag) + n] + 2e4 * chance.standard_normal(n)},
    }
    (*_, last) = records = measurements_of(tables, given)
    checked = doubtful(records, given)
    assert kinds(checked) == ([] if not words else ["lag"] if lag == 3.0 else ["clock"])
    if words:
        assert checked[0].time == records[0].begin and checked[0].duration == last.begin + 600.0 - records[0].begin
        assert re.search(words, str(checked[0]))
        assert f"is {abs(lag):g} s" in checked[0].text
    tables["b"]["P"] = 1e6 + 2e5 * gusts(n, 10, 60.0)
    monkeypatch.setattr(quality, "LONGEST_LAG", 100.0)
    other = doubtful(measurements_of(tables, given), given)
    assert kinds(other) == ["clock"] and "another quantity" in other[0].text


def test_a_silent_second_logger_is_not_compared() -> None:
    power = {"generator_power": {"column": "P", "unit": "W", "kind": "power"}}
    given = ChannelMap(loggers={name: {"time": STAMPS, "channels": power} for name in "ab"}, wind="generator_power")
    t = BEGIN + np.arange(600.0)
    tables = {"a": {"t": t, "P": gusts(600, 1)}, "b": {"t": t, "P": np.full(600, np.nan)}}
    missing, lag = doubtful(measurements_of(tables, given), given)
    assert missing.kind == "missing" and lag.kind == "lag" and "no samples" in lag.text
    assert doubtful([], given) == []


# ------------------------------------------------------------------------------------------ plausibility


def operation(
    turbine: Turbine, *, shift: float = 0.0, n: int = 10800, **changed: Any
) -> tuple[list[MeasuredRecord], ChannelMap]:
    """Three hours of partial load at 1 Hz by two loggers; columns can be changed, the machine's clock shifted [s]."""
    wind = 8.0 + 1.2 * gusts(n + 8000, 11, 200.0)
    v = wind[4000 : 4000 + n]
    at = wind[4000 - round(shift) : 4000 - round(shift) + n]
    power = 0.5 * 1.225 * np.pi * turbine.rotor_radius**2 * 0.45 * at**3 / 1e3
    sensors = {
        "generator_power": {"column": "P", "unit": "kW", "kind": "power"},
        "rotor_speed": {"column": "speed", "unit": "rpm", "kind": "rpm"},
        "root_moment_flap_1": {"column": "My", "unit": "kN m", "kind": "gauge"},
        "pitch_1": {"column": "theta", "unit": "deg", "kind": "position"},
    }
    t = BEGIN + np.arange(n)
    columns = {"t": t, "P": power, "speed": 1.2 * at, "My": 400.0 * at, "theta": np.full(n, 1.0)}
    mast = {"t": t, "u": v}
    for name, change in changed.items():
        (columns if name in columns else mast)[name] = change(columns[name] if name in columns else mast[name])
    loggers = {
        "mast": {"time": STAMPS, "channels": {"wind_speed": {"column": "u", "unit": "m/s", "kind": "cup"}}},
        "machine": {"time": STAMPS, "channels": sensors},
    }
    given = ChannelMap(loggers=loggers)
    return measurements_of({"mast": mast, "machine": columns}, given), given


def test_operation_of_the_turbine_is_plausible(turbine: Turbine) -> None:
    assert plausible(*operation(turbine), turbine) == []


@pytest.mark.parametrize(
    ("column", "factor", "kind", "words"),
    [
        (
            "P",
            1e3,
            "unit",
            "column 'P' in kW reaches .* expected of this turbine is at most .* times 0.001 it would fit",
        ),
        ("P", 1e-3, "unit", "at least 25 kW; times 1000 it would fit"),
        ("speed", 30.0 / np.pi, "unit", "column 'speed' in rpm.*times 0.1047"),
        ("speed", np.pi / 30.0, "unit", "at least .* rpm; times 9.549"),
        ("My", 1e3, "unit", "column 'My' in kN m .*times 0.001"),
        ("My", 1e-3, "unit", "times 1000"),
        ("theta", 57.3 * 20.0, "unit", "column 'theta' in deg"),
        ("u", 30.0, "unit", "column 'u' in m/s reaches"),
        ("P", -1.0, "sign", "column 'P' is negative.*sign: -1"),
        ("speed", -1.0, "sign", "column 'speed' is negative"),
        ("u", -1.0, "sign", "column 'u' is negative"),
        ("My", -1.0, "sign", "column 'My' falls where power grows.*sign: -1"),
        ("u", 0.5, "turbine", "another turbine"),
    ],
)
def test_wrong_units_and_signs(turbine: Turbine, column: str, factor: float, kind: str, words: str) -> None:
    changed = operation(turbine, **{column: lambda x: factor * x})
    issues = plausible(*changed, turbine)
    assert any(issue.kind == kind and re.search(words, str(issue)) for issue in issues), "\n".join(map(str, issues))


def test_wind_of_another_turbine(turbine: Turbine) -> None:
    other = operation(turbine, u=lambda u: 8.0 + 1.2 * gusts(len(u), 12, 200.0))
    (issue,) = plausible(*other, turbine)
    assert issue.kind == "turbine" and "column 'u'" in issue.text and issue.file == "mast"


@pytest.mark.parametrize(("shift", "words"), [(1800.0, "30 min earlier"), (-3600.0, "60 min later")])
def test_half_an_hour_apart(turbine: Turbine, shift: float, words: str) -> None:
    (issue,) = plausible(*operation(turbine, shift=shift), turbine)
    assert issue.kind == "clock" and f"when it is {words}" in issue.text
    assert issue.channel == "generator_power" and "logger 'machine'" in issue.text and "zone" in issue.text
