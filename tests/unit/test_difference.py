"""Differences of two results: numbers with a known answer, times that do not match, pairs of names."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from meltemi import InputError, Result
from meltemi.simulation.channels import Channel, ChannelSet, catalogue
from meltemi.studies.difference import compare_results, most_different
from meltemi.studies.difference_plots import PANELS, difference_rows, plot_differences, short_difference_rows

KNOWN = catalogue(ChannelSet(nodes=6))
LABELS = ("a", "b")


def series(step: float, duration: float, begin: float = 0.0, **columns: Callable[..., NDArray[np.float64]]) -> Result:
    time = begin + step * np.arange(round(duration / step) + 1)
    data = np.stack([f(time) for f in columns.values()], axis=1)
    return Result(time, data, tuple(KNOWN[name] for name in columns))


def sine(amplitude: float = 1.0, mean: float = 0.0, lag: float = 0.0) -> Callable[..., NDArray[np.float64]]:
    return lambda t: mean + amplitude * np.sin(2.0 * np.pi * (t - lag))


def test_a_result_does_not_differ_from_itself() -> None:
    a = series(0.05, 20.0, rotor_speed=sine(0.1, 1.2), root_moment_out_of_plane_1=sine(1e6, 8e6))
    for d in compare_results(a, a).channels:
        assert (d.mean_change, d.std_change, d.distance, d.worst) == (0.0, 0.0, 0.0, 0.0)
        assert d.correlation == pytest.approx(1.0, abs=1e-12)


def test_numbers_of_sines() -> None:
    a = series(0.01, 10.0, root_moment_out_of_plane_1=sine(2e6, 9e6)).between(0.0, 9.99)
    b = series(0.01, 10.0, root_moment_out_of_plane_1=sine(1e6, 8e6)).between(0.0, 9.99)
    (d,) = compare_results(a, b).channels
    assert d.mean == pytest.approx((9e6, 8e6))
    assert d.mean_change == pytest.approx(1 / 8)
    assert d.std == pytest.approx((2e6 / np.sqrt(2.0), 1e6 / np.sqrt(2.0)))
    assert d.std_change == pytest.approx(1.0)
    assert d.load_change == pytest.approx(1.0)
    assert d.load[1] == pytest.approx(2e6, rel=0.02)  # a sine of 1 Hz: its range, with slope 10
    assert d.correlation == pytest.approx(1.0)
    assert d.distance == pytest.approx(np.sqrt(1e12 + 0.5e12) / (1e6 / np.sqrt(2.0)))
    assert d.worst == pytest.approx(2e6)
    assert d.worst_time % 1.0 == pytest.approx(0.25)


def test_a_quarter_period_takes_the_correlation_away_and_half_turns_it_round() -> None:
    b = series(0.01, 9.99, wind_x=sine())
    for lag, correlation, distance in ((0.25, 0.0, np.sqrt(2.0)), (0.5, -1.0, 2.0)):
        (d,) = compare_results(series(0.01, 9.99, wind_x=sine(lag=lag)), b).channels
        assert d.correlation == pytest.approx(correlation, abs=1e-9)
        assert d.distance == pytest.approx(distance)
        assert np.isnan(d.load).all()  # a wind is no load


def test_the_worst_instant() -> None:
    a, b = series(0.1, 10.0, wind_x=sine()), series(0.1, 10.0, wind_x=sine())
    a.data[33, 0] -= 5.0
    (d,) = compare_results(a, b).channels
    assert (d.worst, d.worst_time) == (pytest.approx(-5.0), pytest.approx(3.3))


def test_a_mean_near_zero_is_measured_by_the_scatter() -> None:
    a, b = (series(0.01, 9.99, wind_y=sine(2.0, mean)) for mean in (0.1, 0.0))
    (d,) = compare_results(a, b).channels
    assert d.mean_change == pytest.approx(0.1 / np.sqrt(2.0))


def test_constants_and_what_is_no_number() -> None:
    flat = lambda value: lambda t: np.full_like(t, value)  # noqa: E731
    a = series(0.1, 5.0, wind_x=flat(3.3), wind_y=flat(1.0), rotor_torque=flat(np.nan))
    b = series(0.1, 5.0, wind_x=flat(3.3), wind_y=flat(2.0), rotor_torque=flat(1.0))
    same, other, none = compare_results(a, b).channels
    assert np.isnan(same.correlation)
    assert (same.distance, same.std_change, other.mean_change) == (0.0, 0.0, -0.5)
    assert np.isnan(other.distance)
    assert np.isnan(none.mean[0])
    assert np.isnan(none.load).all()
    for rows in (difference_rows, lambda found, labels: short_difference_rows(found)):
        head, table = rows(compare_results(a, b), LABELS)
        assert all(len(row) == len(head) for row in table)
        assert not any("nan" in text for row in table for text in row)


def test_time_steps_and_lengths_that_differ() -> None:
    line = lambda t: 3.0 * t  # noqa: E731
    a, b = series(0.1, 20.0, wind_x=line), series(0.25, 15.0, begin=2.5, wind_x=line)
    for one, other, which in ((a, b, "first"), (b, a, "second")):
        found = compare_results(one, other)
        np.testing.assert_allclose(found.first.time, np.arange(2.5, 17.51, 0.25))
        assert np.max(np.abs(found.channels[0].worst)) < 1e-12  # a line is interpolated exactly
        assert found.notes[0].startswith("they cover ")
        assert f"the {which} is interpolated onto the time step of the other, 0.25 s" in found.notes
        assert found.notes[-1] == "compared from 2.5 to 17.5 s"


def test_begin_and_end() -> None:
    a, b = series(0.1, 20.0, wind_x=sine()), series(0.1, 20.0, wind_x=sine())
    a.data[10, 0] += 7.0
    assert compare_results(a, b).channels[0].worst == pytest.approx(7.0)
    found = compare_results(a, b, begin=5.0, end=15.0)
    assert found.channels[0].worst == 0.0
    assert found.notes == ("compared from 5 to 15 s",)


@pytest.mark.parametrize(
    ("begin", "end", "message"),
    [(30.0, None, "no time in common: the results cover 0 to 20 s and 0 to 20 s, asked for 30 to 20 s"),
     (5.0, 4.0, "no time in common")],
)  # fmt: skip
def test_no_time_in_common(begin: float | None, end: float | None, message: str) -> None:
    a = series(0.1, 20.0, wind_x=sine())
    with pytest.raises(InputError, match=message):
        compare_results(a, a, begin=begin, end=end)
    with pytest.raises(InputError, match="no time in common: the results cover 0 to 20 s and 50 to 60 s"):
        compare_results(a, series(0.1, 10.0, begin=50.0, wind_x=sine()))
    with pytest.raises(InputError, match="the second result has 1 instants"):
        compare_results(a, a.between(0.0, 0.0))


def test_common_channels_and_the_others() -> None:
    a = series(0.1, 20.0, wind_x=sine(), azimuth=sine(), pitch_1=sine(), wind_z=sine())
    b = series(0.1, 20.0, wind_z=sine(), azimuth=sine(), wind_y=sine(), wind_x=sine())
    found = compare_results(a, b)
    assert [d.channel.name for d in found.channels] == ["wind_x", "wind_z"]
    assert (found.only_first, found.only_second) == (("pitch_1",), ("wind_y",))
    with pytest.raises(
        InputError, match=r"no channel is in both: the first has pitch_1, the second wind_z.*name=other"
    ):
        compare_results(series(0.1, 9.0, pitch_1=sine()), series(0.1, 9.0, wind_z=sine()))


def test_channels_by_any_name_and_in_pairs() -> None:
    a = series(0.1, 20.0, pitch_1=sine(), node_6_alpha_1=sine(2.0))
    theirs = Channel("B1N1Alpha", "", "rad", "-", "-", "channel of OpenFAST", ("file", "B1N1Alpha"))
    b = Result(a.time, a.data, (KNOWN["pitch_1"], theirs))
    found = compare_results(a, b, ["ptchpmzc1", "B1N6Alpha=B1N1Alpha"])
    assert [d.channel.name for d in found.channels] == ["pitch_1", "node_6_alpha_1"]
    assert all(d.distance == 0.0 for d in found.channels)
    assert (found.only_first, found.only_second) == ((), ())
    with pytest.raises(InputError, match="second result: no channel 'node_6_alpha_1'"):
        compare_results(a, b, ["node_6_alpha_1"])
    with pytest.raises(InputError, match="first result: no channel 'pich'"):
        compare_results(a, b, ["pich"])
    with pytest.raises(InputError, match="pitch_1=wind_x: the units differ: rad and m/s"):
        compare_results(a, series(0.1, 20.0, wind_x=sine()), ["pitch_1=wind_x"])


def test_angles_that_turn_differ_the_short_way_round() -> None:
    turning = lambda offset: lambda t: (2.0 * t + offset) % (2.0 * np.pi)  # noqa: E731
    a, b = series(0.1, 20.0, azimuth=turning(0.1)), series(0.05, 20.0, azimuth=turning(0.0))
    (d,) = compare_results(a, b, ["Azimuth"]).channels
    assert d.worst == pytest.approx(0.1, abs=1e-9)


def test_the_most_different_come_first() -> None:
    names = ("wind_x", "wind_y", "wind_z")
    a = series(0.1, 20.0, **{name: sine(1.0 + 0.1 * i) for i, name in enumerate(names)})
    b = series(0.1, 20.0, **dict.fromkeys(names, sine()))
    assert [d.channel.name for d in most_different(compare_results(a, b), 2)] == ["wind_z", "wind_y"]


def test_progress_goes_to_its_end() -> None:
    a, shares = series(0.1, 20.0, wind_x=sine(), wind_y=sine()), list[float]()
    compare_results(a, a, progress=shares.append)
    assert shares == [0.5, 1.0]


# tables and pictures


def test_rows_are_in_units_for_people() -> None:
    a, b = (series(0.01, 9.99, root_moment_out_of_plane_1=sine(1e6, mean)) for mean in (9e6, 8e6))
    head, (row,) = difference_rows(compare_results(a, b), LABELS)
    told = dict(zip(head, row, strict=True))
    assert (told["channel"], told["OpenFAST"], told["unit"]) == ("root_moment_out_of_plane_1", "RootMyc1", "kN m")
    assert (told["mean a"], told["mean b"], told["mean %"], told["worst"]) == ("9000", "8000", "+12.50", "1000")
    assert told["correlation"] == "1.00000"
    head, (row,) = short_difference_rows(compare_results(a, b))
    assert row[:4] == ["RootMyc1", "kN m", "8000", "+12.50"]


def test_a_notebook_shows_the_most_different_channels_first() -> None:
    names = ("wind_x", "root_moment_out_of_plane_1")
    a = series(0.1, 20.0, **{name: sine(1.0 + 0.1 * i, 8.0) for i, name in enumerate(names)})
    b = series(0.1, 20.0, **dict.fromkeys(names, sine(1.0, 8.0)), wind_y=sine())
    found = compare_results(a, b)
    (section,) = found.card().sections
    assert [row[0] for row in section.rows] == ["root_moment_out_of_plane_1", "wind_x"]
    assert section.rows[0][1:4] == ["kN m", "0.008000", "+0.00"]
    assert repr(found) == "ResultDifferences(channels=2, only_second=wind_y, notes=compared from 0 to 20 s)"


def test_a_picture_shows_what_everyone_wants_and_the_most_different() -> None:
    names = ["rotor_speed", "pitch_1", *(f"node_{n}_alpha_{b}" for n in range(1, 7) for b in (1, 2))]
    a = series(0.1, 50.0, **{name: sine(1.0 + 0.01 * i) for i, name in enumerate(names)})
    b = series(0.1, 50.0, **dict.fromkeys(names, sine()))
    axes = plot_differences(compare_results(a, b), labels=LABELS).axes
    titles = [ax.get_title(loc="left") for ax in axes[::3]]
    assert len(titles) == PANELS
    assert titles[:3] == ["rotor speed", "pitch 1", "node 6 alpha 2"]
    assert [text.get_text() for text in axes[0].figure.legends[0].get_texts()] == ["a", "b"]


def test_a_picture_zooms_to_the_worst_instant() -> None:
    a, b = series(0.1, 200.0, wind_x=sine()), series(0.1, 200.0, wind_x=sine())
    a.data[1999, 0] += 3.0
    figure = plot_differences(compare_results(a, b), ["Wind1VelX"], labels=LABELS)
    whole, zoom, gap = figure.axes
    shown = zoom.lines[0].get_xdata()
    assert (shown[0], shown[-1]) == (pytest.approx(180.0), pytest.approx(200.0))
    assert len(whole.lines[0].get_xdata()) == 2001
    assert "worst 3.000 m/s at 199.9 s" in zoom.get_title(loc="left")
    assert np.max(gap.lines[0].get_ydata()) == pytest.approx(3.0)
