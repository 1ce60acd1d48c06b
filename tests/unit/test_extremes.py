"""Extremes with contemporaneous loads, characteristic values, factors."""

from __future__ import annotations

from math import atan2, pi

import numpy as np
import pytest

from meltemi import InputError
from meltemi.postprocess.extremes import (
    COMPONENTS,
    DRIVERS,
    ExtremeRow,
    characteristic_rows,
    extreme_loads,
    extremes_table,
    factored_rows,
    governing_rows,
)


def random_loads(seed: int, n: int = 500) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.standard_normal((n, 6)) * [1.0, 2.0, 3.0, 10.0, 20.0, 30.0] + [1.0, 0.0, -20.0, 5.0, -5.0, 0.0]


def rows_of(runs: list[np.ndarray], rule: str, **more: object) -> tuple[ExtremeRow, ...]:
    extremes = np.stack([extreme_loads(run, "xy")[0] for run in runs])
    names = [f"run-{k}" for k in range(len(runs))]
    return characteristic_rows(extremes, "xy", names, rule=rule, factor=1.35, **more)  # type: ignore[arg-type]


def runs_with(values: list[float]) -> list[np.ndarray]:
    """Runs whose largest Fx is given, with the other loads in proportion, and which come back to -1."""
    return [np.array([[v] + [10.0 * v] * 5, [-1.0] * 6]) for v in values]


# extremes


@pytest.mark.parametrize(("plane", "axes"), [("xy", (0, 1)), ("yz", (1, 2))])
def test_each_row_has_all_loads_of_its_instant(plane: str, axes: tuple[int, int]) -> None:
    loads = random_loads(1)
    rows, at = extreme_loads(loads, plane)
    assert len(DRIVERS) == 14 == len(rows)
    np.testing.assert_array_equal(rows, loads[at])
    for k, name in enumerate(COMPONENTS):
        assert rows[DRIVERS.index(f"{name} max"), k] == loads[:, k].max()
        assert rows[DRIVERS.index(f"{name} min"), k] == loads[:, k].min()
    for driver, shift in (("F_res max", 0), ("M_res max", 3)):
        pair = loads[:, [shift + axes[0], shift + axes[1]]]
        assert at[DRIVERS.index(driver)] == np.argmax(np.sum(pair**2, axis=1))


def test_each_resultant_has_its_own_angle() -> None:
    row = ExtremeRow("M_res max", (3.0, 4.0, 9.0, -5.0, 0.0, 7.0), "xy", "dlc1.3", 1.35)
    assert (row.force, row.moment) == (5.0, 5.0)
    assert row.force_angle == pytest.approx(atan2(4.0, 3.0)) and row.moment_angle == pytest.approx(pi)
    shaft = ExtremeRow("M_res max", (9.0, 3.0, 4.0, 7.0, 0.0, -5.0), "yz", "dlc1.3", 1.35)
    assert (shaft.force, shaft.moment) == (5.0, 5.0)
    assert shaft.force_angle == pytest.approx(atan2(4.0, 3.0)) and shaft.moment_angle == pytest.approx(-0.5 * pi)


def test_the_frame_turns_the_angles_only() -> None:
    loads, turn = random_loads(2), 0.7
    c, s = np.cos(turn), np.sin(turn)
    turned = loads.copy()
    for k in (0, 3):  # the same vectors in a frame turned by -0.7
        turned[:, k], turned[:, k + 1] = c * loads[:, k] - s * loads[:, k + 1], s * loads[:, k] + c * loads[:, k + 1]
    one, other = (extreme_loads(x, "xy")[0][-1] for x in (loads, turned))
    row, moved = (ExtremeRow("M_res max", tuple(x), "xy", "", 1.0) for x in (one, other))
    assert moved.moment == pytest.approx(row.moment) and moved.force == pytest.approx(row.force)
    assert (moved.moment_angle - row.moment_angle - turn) % (2.0 * pi) == pytest.approx(0.0, abs=1e-12)


def test_loads_of_another_shape_are_refused() -> None:
    with pytest.raises(InputError, match=r"\(T, 6\)"):
        extreme_loads(np.zeros((4, 5)), "xy")
    with pytest.raises(InputError, match=r"\(T, 6\) finite"):
        extreme_loads(np.full((4, 6), np.nan), "xy")
    with pytest.raises(InputError, match="no plane 'zx'"):
        extreme_loads(np.zeros((4, 6)), "zx")


# characteristic values


def test_the_largest_is_the_runs_own_row() -> None:
    runs = [random_loads(k) for k in range(4)]
    for k, row in enumerate(rows_of(runs, "largest")):
        assert row.scale == 1.0 and row.factor == 1.35 and not row.factored
        source = runs[int(row.case.removeprefix("run-"))]
        assert any(np.array_equal(row.loads, x) for x in source)
        if k < 12:
            ends = [x[:, k // 2].max() if k % 2 == 0 else x[:, k // 2].min() for x in runs]
            assert row.value == (max(ends) if k % 2 == 0 else min(ends))


def test_the_mean_is_scaled_from_the_nearest_seed() -> None:
    # two speeds: means 4 of (2, 3, 7) and 3.5 of (1, 6); nearest to 4 is 3
    runs = runs_with([2.0, 3.0, 7.0, 1.0, 6.0])
    row = rows_of(runs, "mean", speeds=[10.0, 10.0, 10.0, 12.0, 12.0])[0]
    assert (row.value, row.case, row.scale) == (pytest.approx(4.0), "run-1", pytest.approx(4.0 / 3.0))
    np.testing.assert_allclose(row.loads, [4.0, 40.0, 40.0, 40.0, 40.0, 40.0])
    # without speeds the mean of all
    assert rows_of(runs, "mean")[0].value == pytest.approx(19.0 / 5.0)


def test_the_upper_half() -> None:
    # 12 runs at one speed: the mean of 7 to 12; nearest are 9 and 10
    row = rows_of(runs_with([float(k) for k in range(1, 13)]), "upper_half")[0]
    assert row.value == pytest.approx(9.5) and row.case in ("run-8", "run-9")
    # of three the largest one, of one the one
    assert rows_of(runs_with([1.0, 5.0, 2.0]), "upper_half")[0].value == 5.0
    assert rows_of(runs_with([3.0]), "upper_half")[0].value == 3.0


def test_smallest_values_mirror_largest() -> None:
    runs = [random_loads(k) for k in range(6)]
    for rule in ("largest", "mean", "upper_half"):
        rows, mirrored = rows_of(runs, rule), rows_of([-x for x in runs], rule)
        for k in range(12):
            other = mirrored[k + 1 if k % 2 == 0 else k - 1]
            np.testing.assert_allclose(other.loads, -np.array(rows[k].loads))
            assert (other.case, other.scale) == (rows[k].case, rows[k].scale)


def test_rules_differ() -> None:
    runs = [random_loads(k) for k in range(6)]
    largest, upper, mean = (rows_of(runs, rule)[0].value for rule in ("largest", "upper_half", "mean"))
    assert largest > upper > mean
    with pytest.raises(InputError, match="no rule 'means': did you mean 'mean'"):
        rows_of(runs, "means")


# factors


def test_factors_are_applied_once() -> None:
    rows = rows_of([random_loads(1)], "largest")
    design = factored_rows(rows)
    for row, plain in zip(design, rows, strict=True):
        np.testing.assert_allclose(row.loads, 1.35 * np.array(plain.loads))
        assert row.factored and row.severity == pytest.approx(plain.severity)
    with pytest.raises(InputError, match="Fx max contains the factor 1.35 already"):
        factored_rows(design)
    with pytest.raises(InputError, match="with and without factor"):
        governing_rows([rows, design])


def test_favourable_extremes_have_their_own_factor() -> None:
    rows = rows_of([random_loads(1) * [1, 1, 1, 1, 1, 1]], "largest")  # Fz about -20: always compression
    design = {row.driver: row for row in factored_rows(rows, favourable=0.9)}
    assert design["Fz max"].factor == 0.9 and design["Fz min"].factor == 1.35 and design["Mx min"].factor == 1.35
    plain = {row.driver: row for row in rows}
    assert design["Fz max"].value == pytest.approx(0.9 * plain["Fz max"].value)


def test_the_governing_case_has_the_largest_load_with_factor() -> None:
    fewer, more = runs_with([10.0]), runs_with([11.0])
    normal = characteristic_rows(extreme_loads(fewer[0], "xy")[0][None], "xy", ["dlc1.3"], rule="largest", factor=1.35)
    fault = characteristic_rows(extreme_loads(more[0], "xy")[0][None], "xy", ["dlc2.2"], rule="largest", factor=1.1)
    found = governing_rows([normal, fault])
    assert found[0].case == "dlc1.3" and found[0].value == 10.0  # 13.5 against 12.1
    table = extremes_table(factored_rows(found))
    assert list(table.index) == list(DRIVERS)
    assert table.loc["Fx max", "Fx"] == pytest.approx(13.5) and table.loc["Fx max", "case"] == "dlc1.3"
    assert bool(table["factored"].all())
