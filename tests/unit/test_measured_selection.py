"""Records by operation, their selection with reasons, the capture matrix as table and figure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from meltemi import InputError, Turbine
from meltemi.validation.issues import DataIssue
from meltemi.validation.measurements import MeasuredRecord, Signal
from meltemi.validation.plots import plot_capture_matrix
from meltemi.validation.selection import (
    SPEED_LABELS,
    TURBULENCE_LABELS,
    SelectionRules,
    capture_matrix,
    capture_table,
    operation_of,
    select,
    selection_table,
)

Float = NDArray[np.float64]
N, RATE, BEGIN = 6000, 10.0, 1.7e9
TIME = BEGIN + np.arange(N) / RATE
SHARE = np.arange(N) / N
RATED_SPEED = 12.1 * np.pi / 30.0


def record(
    power: Float | float = 2e6,
    speed: Float | float = 1.0,
    *,
    wind: float = 8.0,
    turbulence: float = 0.1,
    number: int = 0,
) -> MeasuredRecord:
    """Power [W], rotor speed over its rated value, wind of a mean and standard deviation over mean."""
    wave = np.sqrt(2.0) * np.sin(2.0 * np.pi * np.arange(N) / 100.0)
    values = {
        "generator_power": power + np.zeros(N),
        "rotor_speed": RATED_SPEED * (speed + np.zeros(N)),
        "wind_speed": wind * (1.0 + turbulence * wave),
        "wind_direction": np.radians(355.0 + 10.0 * np.sin(SHARE)) % (2.0 * np.pi),
    }
    time = TIME + 600.0 * number
    signals = {name: Signal(time, x, RATE) for name, x in values.items()}
    return MeasuredRecord(float(time[0]), 600.0, f"{number}.csv", signals)


CLASSES = {
    "production": record(),
    "start": record(np.where(SHARE > 0.5, 2e6 * (SHARE - 0.5), 0.0), np.minimum(2.0 * SHARE, 1.0)),
    "stop": record(np.maximum(2e6 * (1.0 - 2.0 * SHARE), 0.0), np.maximum(1.0 - SHARE, 0.05)),
    "idling": record(0.0, 0.08),
    "parked": record(-5e3, 0.001),
    "fault": record(np.where(SHARE < 0.5, 4e6, 0.0), np.where(SHARE < 0.5, 1.0, 0.3)),
}


@pytest.mark.parametrize("operation", CLASSES)
def test_classes(turbine: Turbine, operation: str) -> None:
    assert operation_of(CLASSES[operation], turbine) == operation


def test_further_classes(turbine: Turbine) -> None:
    assert operation_of(record(speed=1.2), turbine) == "fault"  # overspeed
    assert operation_of(record(np.where(abs(SHARE - 0.5) < 0.1, 0.0, 5e5)), turbine) == "fault"  # an interruption
    assert operation_of(record(np.where(abs(SHARE - 0.5) < 0.1, 5e5, 0.0)), turbine) == "start"  # a failed one
    chance = np.random.default_rng(1)
    assert operation_of(record(1e5 + 8e4 * chance.standard_normal(N)), turbine) == "production"  # noise below zero
    assert operation_of(record(4e4), turbine) == "idling"
    assert operation_of(record(6e4), turbine) == "production"
    assert operation_of(record(np.nan), turbine) is None


def test_records_are_rejected_with_a_reason(turbine: Turbine) -> None:
    records = [record(number=i) for i in range(5)]
    records[1]["rotor_speed"].values[:100] = np.nan
    spike = DataIssue("spike", "2.csv", "generator_power (P)", records[2].begin + 100.0, 0.1, 1, "")
    elsewhere = DataIssue("spike", "2.csv", "root_moment_flap_1 (My)", records[3].begin + 100.0, 0.1, 1, "")
    clock = DataIssue("clock", "b", "generator_power", records[4].begin, 30.0, 1, "")
    before = DataIssue("stuck", "0.csv", "generator_power (P)", records[0].begin - 50.0, 60.0, 1, "")
    selected = select(records, turbine, issues=[spike, elsewhere, clock, before])
    assert [each.rejected for each in selected] == [
        "stuck in generator_power (P)",
        "rotor_speed: 98.3 % of the samples, 99 % are required",
        "spike in generator_power (P)",
        "",
        "clock in generator_power",
    ]
    assert not any(s.rejected for s in select(records[1:2], turbine, rules=SelectionRules(complete=0.9)))
    assert not select(records[2:3], turbine, issues=[spike], rules=SelectionRules(excluding=("stuck",)))[0].rejected
    assert not select(records[:1], turbine, issues=[replace(before, duration=40.0)])[0].rejected
    rows = selection_table(selected).rows
    assert rows[2][2:5] == ["production", "rejected", "8.000"] and rows[2][-1] == "spike in generator_power (P)"
    with pytest.raises(InputError, match=r"0.csv: no channel 'root_moment_flap_1'"):
        select(records, turbine, needed=["root_moment_flap_1"])


def test_sectors_turn_through_north(turbine: Turbine) -> None:
    for low, high, used in ((340.0, 20.0, True), (20.0, 340.0, False), (0.0, 30.0, False), (350.0, 5.0, True)):
        rules = SelectionRules(sector=(np.radians(low), np.radians(high)))
        (one,) = select([record()], turbine, rules=rules)
        assert (not one.rejected) == used
    assert (
        one.rejected == ""
        and "outside" in select([record()], turbine, rules=SelectionRules(sector=(1.0, 2.0)))[0].rejected
    )
    with pytest.raises(InputError, match="no channel 'nacelle'"):
        select([record()], turbine, rules=SelectionRules(sector=(1.0, 2.0), direction="nacelle"))


def test_capture_matrix(turbine: Turbine) -> None:
    """Bins contain their lower edge; of every class its own records, without the rejected ones."""
    places = ((8.0, 0.1), (8.4, 0.1), (8.6, 0.1), (8.0, 0.02), (8.0, 0.35), (2.0, 0.1), (8.0, 0.1301))
    selected = select([record(wind=v, turbulence=i, number=k) for k, (v, i) in enumerate(places)], turbine)
    selected.append(replace(selected[0], rejected="spike"))
    selected += select([record(0.0, 0.08)], turbine)
    matrix, speeds, intensities = capture_matrix(selected), SPEED_LABELS, TURBULENCE_LABELS
    assert intensities[:3] == ("< 3", "3-5", "5-7") and intensities[-2:] == ("27-29", "> 29")
    assert speeds[:3] == ("0-2.5", "3", "4") and speeds[-1] == "24"

    def at(v: str, i: str) -> int:
        return int(matrix[intensities.index(i), speeds.index(v)])

    assert (at("8", "9-11"), at("9", "9-11"), at("8", "< 3"), at("8", "> 29"), at("0-2.5", "9-11")) == (2, 1, 1, 1, 1)
    assert at("8", "13-15") == 1 and matrix.sum() == 7
    assert capture_matrix(selected, "idling").sum() == 1
    table = capture_table(matrix)
    assert table.head == ["turbulence\n%", "0-2.5\nm/s", "8\nm/s", "9\nm/s"] and table.rows[-1] == [
        "all",
        "1",
        "5",
        "1",
    ]
    ax = plot_capture_matrix(matrix, "production").axes[0]
    assert sorted(text.get_text() for text in ax.texts) == ["1", "1", "1", "1", "1", "2"]
