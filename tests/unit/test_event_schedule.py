"""The schedule of events: each acts at every instant from ``at`` to ``until`` and at no other, in any order."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meltemi import Turbine, load_turbine
from meltemi.cases.case import LoadCase
from meltemi.control import faults as f
from meltemi.control import signals as s
from meltemi.control.controller import LogEntry
from meltemi.core.yamlfile import read_record, write_record
from meltemi.simulation.events import misplaced_events, read_events, schedule

DT, N_STEPS = 0.0125, 41
TURBINE: Turbine = load_turbine("nrel5mw")
fuzz = settings(derandomize=True, deadline=None, max_examples=60, database=None)
sensors = ("generator_speed", "pitch_2", "yaw_bearing_moment_z", "wind_speed")


@st.composite
def lists(draw: Any) -> list[dict[str, Any]]:
    """Events of different sensors, each with its span; some times are those of instants."""
    events: list[dict[str, Any]] = []
    for sensor in draw(st.lists(st.sampled_from(sensors), unique=True)):
        times = st.integers(0, 39).map(lambda k: k * DT) | st.floats(0.0, 38.9 * DT)
        at, length = draw(times), draw(st.none() | st.floats(1.01 * DT, 1.0))
        event = {"at": at, "type": "sensor_offset", "sensor": sensor, "offset": draw(st.floats(0.5, 3.0))}
        events.append(event if length is None else {**event, "until": at + length})
    return events


@fuzz
@given(events=lists(), seed=st.randoms(use_true_random=False))
def test_each_acts_in_its_span(events: list[dict[str, Any]], seed: Any) -> None:
    shuffled = events.copy()
    seed.shuffle(shuffled)
    rows = schedule(read_events(shuffled), TURBINE, DT, N_STEPS).rows
    assert np.array_equal(rows, schedule(read_events(events), TURBINE, DT, N_STEPS).rows)
    faults, following = f.Faults(f.healthy()), 0
    for k in range(N_STEPS):
        following = f.apply_events(k, following, rows, faults)
        measured, t = s.Measurements.zeros(), k * DT
        f.report(t, faults, s.Measurements(measured))
        expected = s.Measurements.zeros()
        expected[s.GRID], expected[s.POWER_LIMIT] = 1.0, np.inf
        for event in events:
            near = 1e-6 * DT
            if event["at"] <= t + near and t + near < event.get("until", np.inf):
                expected[s.Measurements.index(event["sensor"])] = event["offset"]
        assert np.array_equal(measured, expected)


@pytest.mark.slow
@fuzz
@given(events=lists())
def test_a_case_with_events_is_written_and_read(events: list[dict[str, Any]], tmp_path_factory: Any) -> None:
    path = tmp_path_factory.mktemp("case") / "case.yaml"
    wind = {"kind": "steady", "speed": 8.0}
    case = LoadCase.model_validate({"turbine": "nrel5mw", "wind": wind, "duration": 2.0, "events": events})
    write_record(case, path)
    again = read_record(path, LoadCase)
    assert again == case and again.events == read_events(events)


def test_what_a_lost_sensor_gives() -> None:
    """It keeps what it gave when it was lost, offset and drift included; zero is zero."""
    faults, place = f.Faults(f.healthy()), s.Measurements.index("wind_speed")
    i = place - f.FIRST
    faults.offset[i], faults.drift[i], faults.drift_begin[i] = 2.0, 0.5, 1.0
    seen = []
    for t, lost in ((3.0, None), (4.0, f.KEEP_NEXT), (5.0, None), (6.0, f.ZERO), (7.0, 0.0)):
        measured = s.Measurements.zeros()
        measured[place] = 10.0 * t
        if lost is not None:
            faults.lost[i] = lost
        f.report(t, faults, s.Measurements(measured))
        seen.append(measured[place])
    assert seen == [33.0, 43.5, 43.5, 0.0, 75.0]


LOSS = {"type": "sensor_loss", "sensor": "pitch_2"}


@pytest.mark.parametrize(
    ("state", "moves", "event", "said"),
    [
        ("standby", (), {"type": "request", "request": "start"}, None),
        ("standby", (), {"type": "request", "request": "normal_stop"}, "request normal stop at 5 s occurred in state"),
        ("standby", (), LOSS, None),
        ("maximum power", (), {"type": "request", "request": "normal_stop"}, None),
        ("maximum power", (), {"type": "request", "request": "none"}, None),
        ("maximum power", (), {"type": "request", "request": "start"}, "occurred in state 'maximum power'"),
        (
            "idling", ((3.0, "power limit -> normal stop", "high wind"), (4.0, "normal stop -> idling", "slow")),
            LOSS,
            "occurred in state 'idling', which stopped at 3.00 s (high wind)",
        ),
        ("idling", ((3.0, "power limit -> idling", "a"),), {"type": "request", "request": "start"}, None),
        ("idling", ((5.0, "power limit -> idling", "a"),), LOSS, None),
    ],
)  # fmt: skip
def test_events_that_have_no_meaning_where_they_occur_are_told(
    state: str, moves: tuple[tuple[float, str, str], ...], event: dict[str, Any], said: str | None
) -> None:
    log = [LogEntry(at, "supervisor", what, why) for at, what, why in moves]
    log.append(LogEntry(1.0, "event", "something else"))
    found = misplaced_events(read_events([{"at": 5.0, **event}]), log, state)
    assert len(found) == (said is not None)
    assert (said or "") in "".join(found)
