"""Numbers over seeds, lifetimes, duty, and the tables and figures of them."""

from __future__ import annotations

from math import exp, gamma, inf, isnan, nan, pi, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meltemi import InputError, Result
from meltemi.postprocess.ensemble import (
    actuator_travel,
    ensemble_load,
    ensemble_table,
    lifetime_del,
    mean_interval,
    rayleigh_weights,
    weibull_weights,
)
from meltemi.report.tables import rich_table, write_csv
from meltemi.reports.ensemble_tables import ensemble_rows
from meltemi.reports.spectra_plots import plot_spectra
from meltemi.simulation.channels import standard

VALUES = {
    1: {"one": {"std": 10.0, "DEL": 30.0}, "two": {"std": 8.0, "DEL": 24.0}},
    2: {"one": {"std": 20.0, "DEL": 50.0}, "two": {"std": 15.0, "DEL": 45.0}},
    3: {"one": {"std": 12.0, "DEL": 40.0}, "two": {"std": 9.0, "DEL": 30.0}},
}


def test_intervals_are_those_of_student() -> None:
    found = mean_interval([1.0, 2.0, 3.0, 4.0, 5.0])
    assert (found.mean, found.n) == (3.0, 5)
    assert found.std == pytest.approx(sqrt(2.5))
    half_width = 2.7764451 * sqrt(2.5 / 5.0)  # tables: t(0.975, 4) = 2.776
    assert (found.low, found.high) == pytest.approx((3.0 - half_width, 3.0 + half_width))
    assert mean_interval([1.0, 3.0], confidence=0.9).half_width == pytest.approx(6.3137515)  # t(0.95, 1) = 6.314
    alone = mean_interval([7.0])
    assert alone.mean == 7.0
    assert isnan(alone.half_width) and isnan(alone.std)


def test_intervals_hold_the_mean_as_often_as_they_say() -> None:
    draws = np.random.default_rng(1).normal(4.0, 2.0, (4000, 6))
    found = [mean_interval(row) for row in draws]
    assert np.mean([e.low < 4.0 < e.high for e in found]) == pytest.approx(0.95, abs=0.01)


def test_changes_are_formed_for_each_seed() -> None:
    table = ensemble_table(VALUES, {"DEL": 10.0})
    assert (table.quantities, table.schemes, table.seeds) == (("std", "DEL"), ("one", "two"), 3)
    base, two = table.entry("std", "one"), table.entry("std", "two")
    assert base.change is None and base.load is None and base.load_change is None
    assert base.value == mean_interval([10.0, 20.0, 12.0])
    assert two.change is not None
    assert two.change.mean == pytest.approx((-0.2 - 0.25 - 0.25) / 3.0)
    assert two.change.half_width == pytest.approx(4.3026527 * 0.05 / sqrt(3.0) / sqrt(3.0))
    load = table.entry("DEL", "two")
    assert load.load == pytest.approx(((24.0**10 + 45.0**10 + 30.0**10) / 3.0) ** 0.1)
    assert load.load_change == pytest.approx(load.load / ((30.0**10 + 50.0**10 + 40.0**10) / 3.0) ** 0.1 - 1.0)
    assert [(e.quantity, e.scheme) for e in table] == [(q, s) for q in ("std", "DEL") for s in ("one", "two")]


def test_orders_of_mappings_do_not_mix_schemes() -> None:
    mixed = {seed: {s: dict(reversed(of[s].items())) for s in reversed(of)} for seed, of in VALUES.items() if seed > 1}
    same = ensemble_table({1: VALUES[1], **mixed}, {"DEL": 10.0})
    assert same == ensemble_table(VALUES, {"DEL": 10.0})


def test_changes_of_nothing_are_no_numbers() -> None:
    table = ensemble_table({s: {"a": {"x": 0.0}, "b": {"x": 1.0}} for s in (1, 2)}, {"x": 4.0})
    entry = table.entry("x", "b")
    assert entry.change is not None and isnan(entry.change.mean)
    assert entry.load_change is not None and isnan(entry.load_change)


@pytest.mark.parametrize(
    ("values", "slopes", "message"),
    [
        ({}, {}, "no numbers"),
        ({1: {}}, {}, "no numbers"),
        ({1: {"a": {}}}, {}, "no numbers"),
        ({1: {"a": {"x": 1.0}}, 2: {"b": {"x": 1.0}}}, {}, "seed 2 has the schemes b, the first a"),
        ({1: {"a": {"x": 1.0}, "b": {"y": 1.0}}}, {}, "seed 1, scheme 'b': not for all there is x, y"),
        ({1: {"a": {"x": inf}}}, {}, "seed 1, scheme 'a': x is inf"),
        ({1: {"a": {"load": 1.0}}}, {"laod": 4.0}, "did you mean 'load'"),
        ({1: {"a": {"x": -1.0}}}, {"x": 4.0}, "none negative"),
    ],
)
def test_what_is_no_table(values: Any, slopes: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        ensemble_table(values, slopes)


def test_unknown_entries_are_named() -> None:
    table = ensemble_table(VALUES)
    with pytest.raises(InputError, match="no 'three'"):
        table.entry("std", "three")
    with pytest.raises(InputError, match="no 'mean'"):
        table.entry("mean", "one")


@settings(derandomize=True, deadline=None, max_examples=50)
@given(st.lists(st.floats(1e-3, 1e9), min_size=1, max_size=8), st.floats(1.0, 20.0))
def test_the_load_of_an_ensemble_lies_between_mean_and_largest(loads: list[float], slope: float) -> None:
    found = ensemble_load(loads, slope)
    assert np.mean(loads) * (1.0 - 1e-9) <= found <= max(loads) * (1.0 + 1e-9)
    assert ensemble_load([*loads, *loads], slope) == pytest.approx(found)
    assert ensemble_load([*loads, 1.0], slope, [1.0] * len(loads) + [0.0]) == pytest.approx(found)


def test_bad_loads_are_refused() -> None:
    assert ensemble_load([0.0, 0.0], 4.0) == 0.0
    for loads, slope in (([], 4.0), ([-1.0], 4.0), ([np.nan], 4.0), ([1.0], 0.0), ([1.0], inf)):
        with pytest.raises(InputError, match="ensemble_load"):
            ensemble_load(loads, slope)
    for weights in ([1.0], [1.0, -1.0], [0.0, 0.0]):
        with pytest.raises(InputError, match="a weight for each load"):
            ensemble_load([1.0, 2.0], 4.0, weights)
    for values, confidence in (([], 0.95), ([[1.0]], 0.95), ([1.0], 95.0)):
        with pytest.raises(InputError, match="mean_interval"):
            mean_interval(values, confidence)


# lifetime


def test_weights_are_those_of_rayleigh() -> None:
    weights = rayleigh_weights(np.arange(4.0, 25.0, 2.0), 8.5)
    assert weights.sum() == pytest.approx(exp(-pi * (3.0 / 17.0) ** 2) - exp(-pi * (25.0 / 17.0) ** 2))
    speeds = np.arange(0.05, 60.0, 0.1)
    fine = rayleigh_weights(speeds, 8.5)
    assert fine.sum() == pytest.approx(1.0)
    assert fine @ speeds == pytest.approx(8.5, rel=1e-4)
    assert fine @ speeds**2 == pytest.approx(8.5**2 * 4.0 / pi, rel=1e-4)
    assert rayleigh_weights([1.0, 4.0], 8.0)[0] == pytest.approx(1.0 - exp(-pi * (2.5 / 16.0) ** 2))


def test_a_constant_load_is_its_lifetime_load() -> None:
    speeds, loads = [4.0, 12.0, 24.0], [5.0, 5.0, 5.0]
    assert lifetime_del(speeds, loads, slope=10.0, mean_speed=8.5, edges=[0.0, 8.0, 18.0, inf]) == pytest.approx(5.0)
    share = rayleigh_weights(speeds, 8.5).sum()
    assert lifetime_del(speeds, loads, slope=10.0, mean_speed=8.5) == pytest.approx(5.0 * share**0.1)
    assert lifetime_del(speeds, loads, slope=10.0, mean_speed=8.5, operating_time=True) == pytest.approx(5.0)


def test_lifetime_loads_add_damage() -> None:
    speeds, loads, edges = [8.0, 16.0], [2.0, 6.0], [4.0, 12.0, 20.0]
    p = rayleigh_weights(speeds, 10.0, edges)
    expected = (p[0] * 2.0**4 + p[1] * 6.0**4) ** 0.25
    assert lifetime_del(speeds, loads, slope=4.0, mean_speed=10.0, edges=edges) == pytest.approx(expected)
    assert lifetime_del([9.0], [2.0], slope=4.0, mean_speed=10.0, edges=[0.0, inf]) == pytest.approx(2.0)


def test_bad_bins_are_refused() -> None:
    for speeds in ([8.0, 4.0], [-1.0, 4.0], [], [[4.0, 8.0]], [4.0, np.nan]):
        with pytest.raises(InputError, match="speeds must be"):
            rayleigh_weights(speeds, 8.5)
    with pytest.raises(InputError, match="mean_speed"):
        rayleigh_weights([4.0, 8.0], 0.0)
    with pytest.raises(InputError, match="needs the edges"):
        rayleigh_weights([8.0], 8.5)
    with pytest.raises(InputError, match="3 ascending edges"):
        rayleigh_weights([4.0, 8.0], 8.5, [3.0, 9.0])
    with pytest.raises(InputError, match="3 ascending edges"):
        rayleigh_weights([4.0, 8.0], 8.5, [3.0, 3.0, 9.0])
    with pytest.raises(InputError, match="between the edges"):
        rayleigh_weights([4.0, 8.0], 8.5, [3.0, 3.5, 9.0])
    with pytest.raises(InputError, match="3 loads for 2 speeds"):
        lifetime_del([4.0, 8.0], [1.0, 2.0, 3.0], slope=4.0, mean_speed=8.5)


# duty


def result(time: Any, **columns: Any) -> Result:
    channels = tuple(standard()[name] for name in columns)
    return Result(np.asarray(time, float), np.stack([np.asarray(c, float) for c in columns.values()], axis=1), channels)


def test_travel_of_an_actuator() -> None:
    time = np.linspace(0.0, 100.0, 10_001)
    angle = 0.3 + 0.05 * np.sin(2.0 * pi * 0.2 * time)
    assert actuator_travel(angle, dt=0.01) == pytest.approx(4.0 * 0.05 * 0.2, rel=1e-6)  # four amplitudes a period
    assert actuator_travel(result(time, pitch_1=angle), "BldPitch1") == pytest.approx(actuator_travel(angle, dt=0.01))
    assert actuator_travel([1.0, 1.0, 1.0], dt=0.1) == 0.0
    assert actuator_travel(0.2 * time, dt=0.01) == pytest.approx(0.2)
    with pytest.raises(InputError, match="travel: a bare series needs its time step"):
        actuator_travel(angle)


# tables and figures


def test_rows_of_an_ensemble(tmp_path: Path) -> None:
    head, rows = ensemble_rows(ensemble_table(VALUES, {"DEL": 10.0}), {"std": ("kN m", 0.5)})
    assert head == [
        *("quantity", "scheme", "unit", "mean", "± 95 %", "change %", "change ± 95 %"),
        *("ensemble DEL", "DEL change %"),
    ]
    assert len(set(head)) == len(head)
    assert [row[:4] for row in rows[:2]] == [["std", "one", "kN m", "7.000"], ["std", "two", "kN m", "5.333"]]
    assert rows[0][5:] == ["", "", "", ""]
    assert rows[1][5:] == ["-23.33", "7.171", "", ""]
    assert rows[3][2] == "" and rows[3][7] != "" and float(rows[3][8]) < 0.0
    assert rich_table("ensemble", head, rows, text_columns=3).row_count == 4
    text = write_csv(tmp_path / "ensemble.csv", head, rows).read_text(encoding="utf-8")
    assert text.splitlines()[2].startswith("std,two,kN m,5.333")


def test_rows_of_one_seed_without_loads() -> None:
    head, rows = ensemble_rows(ensemble_table({1: VALUES[1]}, confidence=0.9))
    assert head[-1] == "change ± 90 %"
    assert rows[1] == ["std", "two", "", "8.000", "", "-20.00", ""]


def runs(seed: int, gain: float = 1.0, n: int = 4000) -> Result:
    time = np.arange(n) * 0.05
    moment = np.random.default_rng(seed).standard_normal(n) + 10.0 * gain * np.sin(1.2 * time)
    return result(time, rotor_speed=np.full(n, 1.2), root_moment_out_of_plane_1=1e3 * moment)


def test_spectra_in_one_panel() -> None:
    ax = plot_spectra({"collective": [runs(1), runs(2)], "individual": runs(1, 0.1)}, "RootMyc1")
    assert ax.figure.get_figwidth() == 9.0
    ax.figure.canvas.draw()
    assert ax.get_yscale() == "log"
    assert ax.get_ylabel() == "[(kN m)$^2$/Hz]"
    assert "root moment out of plane 1" in ax.get_title(loc="left")
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["collective", "individual"]
    assert [text.get_text() for text in ax.texts] == ["1P", "2P", "3P"]
    rotor = 1.2 / (2.0 * pi)
    marks = [line.get_xdata()[0] for line in ax.lines if len(line.get_xdata()) == 2]
    np.testing.assert_allclose(marks, [rotor, 2.0 * rotor, 3.0 * rotor])
    one, other = (line for line in ax.lines if len(line.get_xdata()) > 2)
    x, y = np.asarray(one.get_xdata()), np.asarray(one.get_ydata())
    assert abs(x[np.argmax(y)] - rotor) < 0.02
    assert y.max() == pytest.approx(50.0 / 0.03, rel=0.3)  # (kN m)^2/Hz, lower between two frequencies
    assert y.max() / np.asarray(other.get_ydata()).max() > 20.0
    assert ax.get_xlim()[1] == pytest.approx(4.8 * rotor)


def test_spectra_of_runs_that_do_not_tell_their_rotor() -> None:
    run = runs(1)
    bare = Result(run.time, run.data[:, 1:], run.channels[1:])
    ax = plot_spectra({"run": bare}, "RootMyc1")
    assert not ax.texts and ax.get_legend() is None
    assert ax.get_xlim() == (0.0, 1.0)
    assert plot_spectra({"run": run}, "RootMyc1", highest=0.3, ax=ax) is ax
    assert [text.get_text() for text in ax.texts] == ["1P"]


def test_spectra_of_nothing() -> None:
    for results in ({}, {"none": []}):
        with pytest.raises(InputError, match="no results"):
            plot_spectra(results, "RootMyc1")


def test_a_weibull_distribution_has_its_mean_and_rayleigh_s_is_that_of_k_2() -> None:
    edges = np.linspace(0.0, 120.0, 24001)
    middle = 0.5 * (edges[1:] + edges[:-1])
    for k in (1.5, 2.0, 2.3):
        share = weibull_weights(middle, 8.5, k, list(edges))
        assert share.sum() == pytest.approx(1.0)
        assert share @ middle == pytest.approx(8.5, rel=1e-5)
        spread = gamma(1.0 + 2.0 / k) / gamma(1.0 + 1.0 / k) ** 2 - 1.0  # of the variance, over the mean squared
        assert share @ (middle - 8.5) ** 2 == pytest.approx(spread * 8.5**2, rel=1e-4)
    speeds = np.arange(4.0, 25.0, 2.0)
    np.testing.assert_array_equal(rayleigh_weights(speeds, 8.5), weibull_weights(speeds, 8.5, 2.0))
    loads = speeds**2
    calm, windy = (lifetime_del(speeds, loads, slope=4.0, mean_speed=8.5, k=k) for k in (3.0, 1.5))
    assert calm < lifetime_del(speeds, loads, slope=4.0, mean_speed=8.5) < windy
    for k in (0.0, -1.0, nan, 1e9):
        with pytest.raises(InputError, match="k must (lie between|be positive)"):
            weibull_weights(speeds, 8.5, k)
