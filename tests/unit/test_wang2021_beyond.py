"""What lies beyond Wang et al. (2021) and is run only if asked for: slow gusts, derating on a damage budget."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from meltemi import InputError
from meltemi.app.cli import app
from meltemi.papers.wang2021.damage_budget import (
    ALIKE,
    LEVELS,
    PLANNED,
    SPEEDS,
    SPENT,
    DamageRates,
    budget_table,
    judged,
    plan,
)
from meltemi.papers.wang2021.damage_budget import verdict as budget_verdict
from meltemi.papers.wang2021.measured_gusts import JOINT, SHOWN, TURN, gusts_table, measured
from meltemi.papers.wang2021.measured_gusts import verdict as gusts_verdict
from meltemi.studies.yaw_gusts import GustResults

SHARES = np.array([0.6, 0.4])


def test_a_budget_is_spent_where_it_costs_least() -> None:
    """Two winds: to halve the limit spares 6 of the damage for 10 of the energy in one, for 30 in the other."""
    power = np.array([[30.0, 20.0], [90.0, 60.0]])
    damage = np.array([[10.0, 4.0], [10.0, 4.0]])
    found = plan(power, damage, SHARES, 0.82)  # spare 1.8 of 10: in half of the time of the first wind
    assert found == pytest.approx(np.array([[0.5, 0.5], [1.0, 0.0]]))
    alike = plan(power, damage, SHARES, 0.82, alike=True)
    assert alike == pytest.approx(np.tile([0.7, 0.3], (2, 1)))
    lost = [float(np.sum(SHARES[:, None] * (power[:, :1] - power) * x)) for x in (found, alike)]
    assert lost == pytest.approx([3.0, 5.4])


def test_a_budget_that_no_limit_keeps_has_no_plan() -> None:
    power, damage = np.array([[30.0, 20.0], [90.0, 60.0]]), np.full((2, 2), 10.0)
    assert np.isnan(plan(power, damage, SHARES, 0.9)).all()
    assert np.isnan(plan(power, damage, SHARES, 0.9, alike=True)).all()


def rates(spread: float) -> DamageRates:
    """Power and damage that fall with the limit, in high wind most; seeds differ by a factor."""
    level, speed = np.array(LEVELS)[None, :, None], np.array(SPEEDS)[:, None, None]
    seed = 1.0 + spread * np.array([-1.0, 1.0, -1.0, 1.0])
    power = np.minimum(3e6 * (speed / 9.0) ** 3, 3e6 * level) * np.ones(4)
    damage = (speed * level) ** 2 * seed
    shares = np.full(len(SPEEDS), 1.0 / len(SPEEDS))
    return DamageRates(
        dict.fromkeys(("A1", "A0"), power), {(s, load): damage for s in ("A1", "A0") for load in SPENT}, shares
    )


def test_a_plan_is_judged_by_seeds_that_it_does_not_know() -> None:
    """Where all seeds do the same, the budget is met; a plan over the wind loses less energy than one limit."""
    same = rates(0.0)
    planned, alike = (judged(same, "A1", SPENT[0], 0.75, alike=x) for x in (False, True))
    assert planned.damage == pytest.approx(np.full(4, 0.75)) and alike.damage == pytest.approx(np.full(4, 0.75))
    assert (planned.energy > alike.energy).all() and (planned.energy < 0.0).all()
    table = budget_table(same)
    assert len(table.rows) == len(SPENT) * 2 * 4 and {row[2] for row in table.rows} >= {
        f"{ALIKE}, A0",
        f"{PLANNED}, A1",
    }
    assert "0.75 ± 0.00" in table.rows[-1] and "points with A1 and" in budget_verdict(same)


def test_gusts_are_measured_within_the_standards_turn_or_a_minute() -> None:
    said = [measured(*of) for of in ((10.0, TURN), (60.0, 1.5 * TURN), (20.0, 1.5 * TURN))]
    assert said == ["the standard's turn", "beyond it, size not given", "none so fast"]
    assert np.degrees(TURN) == pytest.approx(67.48, abs=0.01)


def test_slow_gusts_are_told_apart_from_fast_ones() -> None:
    rows = []
    for speed, rise, change, time, sign, seed in JOINT.winds():
        for name, recheck, stops, energy, load in (
            ("S1", 0.0, int(time < 60.0), 1.0e9 if time < 60.0 else 2.0e9, 2.0),
            ("S2", 90.0, 0, 1.9e9, 1.1),
            ("S2 ours", 90.0, 0, 2.0e9, 1.0),
            ("S3", 0.0, 0, 2.0e9, 1.0),
        ):
            wind = {"speed": speed, "rise": rise, "change": change, "time": time, "sign": sign, "seed": seed}
            loads = {f"{shown}, extreme": load for shown in SHOWN}
            derates = int(name == "S2" and time < 60.0)
            key = {"yaw_rate": JOINT.yaw_rates[0], "strategy": name, "recheck": recheck, "energy": energy}
            rows.append(wind | key | {"stops": stops, "derates": derates} | loads)
    found = GustResults(JOINT, pd.DataFrame(rows))
    table = gusts_table(found)
    assert len(table.rows) == 4 * 2 * 4
    first = table.rows[0]
    assert (
        first[:6] == ["10", "67", "the standard's turn", "S1", "100", "0"]
        and first[6] == "278 ± 0"
        and first[7] == "+100 ± 0"
    )
    assert table.rows[4][2] == "none so fast" and table.rows[-1][2] == "beyond it, size not given"
    said = gusts_verdict(found)
    assert "derating acts in 100 % of our gusts, S1 stops in 100 % and S2 in 0 %" in said
    assert "derating acts in 0 %, S1 stops in 0 %" in said


def test_a_part_that_there_is_not_is_refused(tmp_path: Path) -> None:
    for study, part, words in (("wang2021", "gust", "did you mean 'gusts'"), ("he2018", "gusts", "he2018 always runs")):
        found = CliRunner().invoke(app, ["reproduce", study, "--beyond", part, "--out", str(tmp_path / "out")])
        assert isinstance(found.exception, InputError) and words in str(found.exception)
        assert not (tmp_path / "out").exists()
