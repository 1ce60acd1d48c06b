"""Messages for misspelt names, the order of errors, and units at the borders."""

from __future__ import annotations

import math

import pytest

from meltemi.core.errors import (
    InputError,
    MeltemiError,
    RunError,
    Status,
    UnsupportedError,
    closest,
    did_you_mean,
)
from meltemi.core.units import FIELD, deg, display, rpm


def test_closest_ignores_case_and_keeps_the_spelling_of_the_valid_name() -> None:
    assert closest("rootmyc1", ["RootMyc1", "TwrBsMyt"]) == ["RootMyc1"]


def test_closest_is_best_first_and_no_longer_than_asked() -> None:
    valid = ["speed", "spend", "seed", "rotor_speed"]
    assert closest("speed", valid)[0] == "speed"
    assert len(closest("speed", valid, n=2)) == 2


def test_closest_gives_nothing_for_something_far() -> None:
    assert closest("zzzzzz", ["speed", "torque"]) == []


def test_equally_close_names_come_in_alphabetical_order_whatever_the_order_given() -> None:
    names = ["pitch_3", "pitch_1", "pitch_2"]
    assert closest("pitch_9", names) == closest("pitch_9", sorted(names)) == ["pitch_1", "pitch_2", "pitch_3"]


def test_did_you_mean_names_the_closest() -> None:
    assert did_you_mean("sped", ["speed", "torque"]) == "did you mean 'speed'?"
    assert did_you_mean("pitch_4", ["pitch_1", "pitch_2"]) == "did you mean 'pitch_1' or 'pitch_2'?"


def test_did_you_mean_lists_all_of_a_few_in_order() -> None:
    assert did_you_mean("zzz", ["b", "a"]) == "valid are: a, b"


def test_did_you_mean_counts_many() -> None:
    names = [f"name{i}" for i in range(13)]
    assert did_you_mean("zzz", names) == "none of the 13 valid names is close to it"
    assert did_you_mean("zzz", names[:12]).startswith("valid are: ")


def test_did_you_mean_takes_an_iterator() -> None:
    assert did_you_mean("sped", iter(["speed"])) == "did you mean 'speed'?"


@pytest.mark.parametrize("kind", [InputError, UnsupportedError, RunError])
def test_every_error_on_purpose_is_a_meltemi_error(kind: type[MeltemiError]) -> None:
    assert issubclass(kind, MeltemiError)
    assert not issubclass(kind, (ValueError, OSError))


def test_success_is_zero_and_every_status_has_its_own_words() -> None:
    assert Status.OK == 0
    messages = [status.message for status in Status]
    assert len(set(messages)) == len(messages)
    assert all(messages)


@pytest.mark.parametrize(
    ("unit", "shown", "factor"),
    [
        ("rad", "deg", 180.0 / math.pi),
        ("rad/s", "rpm", 30.0 / math.pi),
        ("N", "kN", 1e-3),
        ("N m", "kN m", 1e-3),
        ("W", "kW", 1e-3),
        ("m/s", "m/s", 1.0),
        ("-", "-", 1.0),
        ("N/m", "N/m", 1.0),
    ],
)
def test_units_for_people(unit: str, shown: str, factor: float) -> None:
    name, value = display(unit)
    assert name == shown
    assert value == pytest.approx(factor, rel=1e-15)  # rounding only


def test_pitch_rates_are_shown_in_degrees_per_second() -> None:
    assert display("rad/s", angular_rate_in_degrees=True) == ("deg/s", 180.0 / math.pi)
    assert display("N", angular_rate_in_degrees=True) == FIELD["N"]


def test_degrees_and_revolutions_per_minute_to_si() -> None:
    assert deg(180.0) == pytest.approx(math.pi, rel=1e-15)
    assert rpm(60.0) == pytest.approx(2.0 * math.pi, rel=1e-15)
    assert rpm(12.1) * display("rad/s")[1] == pytest.approx(12.1, rel=1e-15)
