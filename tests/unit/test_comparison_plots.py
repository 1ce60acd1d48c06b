"""Tables and pictures of comparisons: values, labels and units."""

from __future__ import annotations

import numpy as np
import pytest

from meltemi import InputError
from meltemi.loads import EnsembleTable, PowerSpectrum, average_spectra, ensemble_table
from meltemi.plots import plot_changes, plot_spectra
from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.postprocess.spectra import power_spectrum
from meltemi_reports.ensemble_tables import change_bar, change_text, half_bar, scheme_rows, with_interval

UNITS = {"load DEL": ("kN m", 1e-3), "power std": ("kW", 1e-3), "pitch travel": ("deg/s", 180.0 / np.pi)}


def numbers(load: float, power: float, travel: float) -> dict[str, float]:
    return {"load DEL": load, "power std": power, "pitch travel": travel}


@pytest.fixture
def table() -> EnsembleTable:
    """Two seeds; scheme b has 10 % and 20 % less load."""
    return ensemble_table(
        {
            1: {"a": numbers(1e6, 5e4, 0.0), "b": numbers(0.9e6, 5e4, 0.02)},
            2: {"a": numbers(2e6, 6e4, 0.0), "b": numbers(1.6e6, 6e4, 0.04)},
        },
        {"load DEL": 10.0},
    )


def test_schemes_stand_beside_each_other(table: EnsembleTable) -> None:
    head, rows, groups = scheme_rows(table, UNITS)
    assert head == ["quantity", "unit", "a", "mean", "change %"]
    assert groups == [("", 3), ("b", 2)]
    assert sum(span for _, span in groups) == len(head)
    assert [row[0] for row in rows] == ["load DEL", "  of all seeds", "power std", "pitch travel"]
    # mean of -10 and -20 %; the interval of two numbers 10 apart is 12.706 / sqrt(2) * 10 / sqrt(2)
    assert rows[0] == ["load DEL", "kN m", "1500", "1250", "?"]
    together = [1e3 * ((x**10 + y**10) / 2.0) ** 0.1 for x, y in ((1.0, 2.0), (0.9, 1.6))]
    assert [float(text) for text in rows[1][2:]] == pytest.approx(
        [*together, 100.0 * (together[1] / together[0] - 1.0)], rel=3e-3
    )
    assert rows[2][-1] == "+0.0 ± 0.0"
    assert rows[3] == ["pitch travel", "deg/s", "0", "1.719", "-"]
    head, rows, groups = scheme_rows(table, UNITS, means=False)
    assert head == ["quantity", "unit", "a", "change %"] and groups == [("", 3), ("b", 1)]
    assert rows[0] == ["load DEL", "kN m", "1500", "?"]


def estimate(*numbers: float) -> MeanEstimate:
    return mean_interval(np.array(numbers))


@pytest.mark.parametrize(
    ("change", "printed"),
    [
        ((-0.10, -0.20), "?"),  # 12.706 standard errors hold zero
        ((0.5, 2.1), "?"),
        ((-0.10, -0.11), "-10.5 ± 6.4"),
        ((0.0, 1e-6), "+0.0 ± 0.0"),  # as narrow as what is printed
        ((-0.10, -0.20, 0.15), "-5.0 ± 44.8"),
        ((0.5,), "+50.0"),
    ],
)
def test_what_two_seeds_do_not_tell_is_not_printed(change: tuple[float, ...], printed: str) -> None:
    """In tables, sentences and bars by one rule."""
    e = estimate(*change)
    assert change_text(e) == with_interval(e, 1, "+", 100.0) == printed
    assert np.isnan(change_bar(e)[0]) == np.isnan(half_bar(e) if len(change) > 1 else 0.0) == (printed == "?") or (
        printed == "+0.0 ± 0.0"
    )


def test_a_change_of_sign_is_no_percentage() -> None:
    """A mean moment of -5 kN m is not -150 % of one of 10 kN m."""
    table = ensemble_table({k: {"a": {"Myaw mean": 10.0}, "b": {"Myaw mean": x}} for k, x in ((1, 5.0), (2, -5.0))})
    change = table.entry("Myaw mean", "b").change
    assert change is not None and np.isnan(change.mean) and change_text(change) == "-"
    negative = ensemble_table({1: {"a": {"x": -10.0}, "b": {"x": -5.0}}}).entry("x", "b").change
    assert negative is not None and negative.mean == pytest.approx(-0.5)


def test_a_single_seed_has_no_intervals() -> None:
    one = ensemble_table({1: {"a": numbers(1e6, 5e4, 0.1), "b": numbers(3e6, 5e4, 0.1)}}, {"load DEL": 10.0})
    rows = scheme_rows(one, UNITS)[1]
    assert rows[0] == ["load DEL", "kN m", "1000", "3000", "+200"]
    assert len(rows) == 3
    assert change_text(None) == "-"


def test_bars_are_changes_with_their_intervals(table: EnsembleTable) -> None:
    figure = plot_changes(table, ["load DEL", "power std"], ["pitch travel"], UNITS)
    changes, duty = figure.axes
    assert changes.get_ylabel() == "[%]" and duty.get_ylabel() == "[deg/s]"
    assert [text.get_text() for text in changes.get_xticklabels()] == ["load\nDEL", "power\nstd"]
    assert "change against a, mean over seeds and its 95 % interval" in changes.get_title(loc="left")
    heights = [bar.get_height() for bar in changes.patches]
    assert np.isnan(heights[0]) and heights[1] == 0.0, "two seeds do not tell the change of the load"
    assert [bar.get_height() for bar in duty.patches] == pytest.approx([0.0, 1.719], rel=1e-3)
    three = {k: {"a": numbers(1e6, 5e4, 0.0), "b": numbers(x, 5e4, 0.02)} for k, x in ((1, 8e5), (2, 9e5), (3, 1e6))}
    changes = plot_changes(ensemble_table(three), ["load DEL"]).axes[0]
    (bars,) = (found for found in changes.containers if hasattr(found, "errorbar"))
    ends = bars.errorbar.lines[2][0].get_segments()[0][:, 1]
    assert ends == pytest.approx([-10.0 - 24.84, -10.0 + 24.84], rel=1e-3)
    assert [text.get_text() for text in duty.get_legend().get_texts()] == ["a", "b"]
    assert len(plot_changes(table, ["load DEL"]).axes) == 1
    with pytest.raises(InputError, match="no 'load'"):
        plot_changes(table, ["load"])
    alone = ensemble_table({1: {"a": numbers(1.0, 1.0, 1.0)}})
    with pytest.raises(InputError, match="nothing to compare"):
        plot_changes(alone, ["load DEL"])


def test_power_and_speed_have_a_panel_of_their_own(table: EnsembleTable) -> None:
    loads, power, duty = plot_changes(table, ["load DEL"], ["pitch travel"], UNITS, ["power std"]).axes
    assert len(loads.patches) == 1
    assert [bar.get_height() for bar in power.patches] == pytest.approx([0.0])
    assert loads.get_title(loc="left").startswith("loads: change against a")
    assert (power.get_ylabel(), duty.get_ylabel()) == ("[%]", "[deg/s]")
    assert [text.get_text() for text in power.get_xticklabels()] == ["power\nstd"]
    top, *below = (ax.get_subplotspec().get_topmost_subplotspec() for ax in (loads, power, duty))
    assert all(top.rowspan.stop <= each.rowspan.start for each in below)
    assert len(plot_changes(table, ["load DEL"], (), UNITS, ["power std"]).axes) == 2


def spectrum(frequency: float) -> PowerSpectrum:
    t = 0.05 * np.arange(4000)
    found = power_spectrum(1e6 * np.sin(2.0 * np.pi * frequency * t), dt=0.05)
    return average_spectra([found, found])


def test_spectra_are_plotted_as_they_are() -> None:
    ax = plot_spectra({"one": spectrum(0.2), "other": spectrum(0.4)}, "RootMyc1", rotor=0.2)
    one, other, *marks = ax.lines
    assert [line.get_label() for line in (one, other)] == ["one", "other"]
    for line, f in ((one, 0.2), (other, 0.4)):
        x, y = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
        assert x[np.argmax(y)] == pytest.approx(f)
        assert y.max() == pytest.approx(1e-6 * spectrum(f).density.max())  # (kN m)^2/Hz
    assert [text.get_text() for text in ax.texts] == ["1P", "2P", "3P"] and len(marks) == 3
    assert ax.get_ylabel() == "[(kN m)$^2$/Hz]" and ax.get_xlabel() == "frequency [Hz]"
    assert ax.get_xlim() == pytest.approx((0.0, 0.96))
    assert not plot_spectra({"one": spectrum(0.2)}, "RootMyc1").texts  # no rotor is known
    with pytest.raises(InputError, match="no channel 'RootMyc9'"):
        plot_spectra({"one": spectrum(0.2)}, "RootMyc9")
    with pytest.raises(InputError, match="no results"):
        plot_spectra({"one": []}, "RootMyc1")
