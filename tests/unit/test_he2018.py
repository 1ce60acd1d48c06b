"""Parts of the reproduction of He et al. (2018) that need no run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi
from types import SimpleNamespace
from typing import Any
from zlib import crc32

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import InputError
from meltemi.analysis import preview_of
from meltemi.papers.claim import Claim, rows_of
from meltemi.papers.he2018.claims import RULES, Finding, count_by_reading, counts_words, verdicts_table
from meltemi.papers.he2018.measures import flap_slopes, probability, share_at, thin_airfoil
from meltemi.papers.he2018.page import _facts
from meltemi.papers.he2018.runs import (
    FAST_MODEL,
    LIDARS,
    MODEL_PARTS,
    PAPER,
    QUICK,
    READINGS,
    LoadControlRuns,
    paper_turbine,
)
from meltemi.papers.verdict import HOLDS, by_reading, differs, judgement, judgement_in
from meltemi.studies.preview import LidarErrors, measured
from meltemi.studies.wind_likelihood import Minutes, estimate_wind
from meltemi.tuning.compare import WHOLE
from meltemi.wind.fields import WindBox


def test_a_flap_as_long_as_the_chord_has_the_lift_of_the_airfoil() -> None:
    assert thin_airfoil(1.0) == pytest.approx((2.0 * pi, 0.0))
    lift, moment = thin_airfoil(0.1)
    assert (lift * pi / 180.0, moment * pi / 180.0) == pytest.approx((0.0434, -0.0094), abs=5e-5)


def test_increments_of_the_flap_are_a_little_below_thin_airfoil_theory() -> None:
    for found, ideal in zip(flap_slopes(), thin_airfoil(0.1), strict=True):
        assert 0.8 < found / ideal < 1.0


def test_the_share_of_a_tone() -> None:
    time = np.arange(0.0, 100.0, 0.05)
    x = 3.0 + 2.0 * np.sin(2.0 * pi * 0.2 * time) + np.sin(2.0 * pi * time)
    assert share_at(x, time, 0.2) == pytest.approx(0.8)


def test_the_errors_of_a_lidar_act_as_they_say() -> None:
    turbine = meltemi.turbine.load_turbine("nrel5mw")
    model, rng = meltemi.build(turbine), np.random.default_rng(3)
    velocity = np.zeros((6400, 11, 11, 3))
    gusts = rng.normal(0.0, 1.0, (1280, 1, 1)) + rng.normal(0.0, 1.0, (1280, 11, 11))
    velocity[..., 0] = 20.0 + np.repeat(gusts, 5, axis=0)
    box = WindBox(velocity, dt=0.1, dy=15.0, dz=15.0, bottom=15.0, speed=20.0, periodic=True)
    ideal = preview_of(model, box, (4.0, np.zeros(40))).wind
    np.testing.assert_array_equal(measured(box, model, LidarErrors()), ideal)
    beams = measured(box, model, LIDARS["4 beams"])
    assert np.std(beams - ideal) == pytest.approx(0.5, rel=0.15)  # of the mean of four points
    evolved = measured(box, model, LIDARS["evolving turbulence"])
    assert np.std(evolved) == pytest.approx(np.std(ideal), rel=0.1)
    coherence = [abs(np.corrcoef(low_passed(evolved, n), low_passed(ideal, n))[0, 1]) for n in (1, 400)]
    assert coherence[0] < 0.3 < 0.8 < coherence[1]
    held = measured(box, model, LIDARS["30 % lost"])
    assert np.mean(np.abs(held - ideal) > 1e-9) == pytest.approx(0.3, abs=0.08)


def low_passed(x: NDArray[np.float64], length: int) -> NDArray[np.float64]:
    return np.convolve(x - x.mean(), np.ones(length) / length, "valid")


def test_the_facts_are_those_of_the_turbine() -> None:
    """Another one has its own pitch actuator; its edgewise mode is not at the paper's frequency."""
    other = meltemi.load_turbine("iea15mw").pitch_actuator.natural_frequency
    for turbine, frequency in ((paper_turbine(), 11.11), (paper_turbine(meltemi.load_turbine("iea15mw")), other)):
        runs: Any = SimpleNamespace(bench=SimpleNamespace(model=SimpleNamespace(turbine=turbine)), readings=READINGS)
        runs.setup = QUICK
        words = f"{turbine.name}, flaps 66 to 96 % of the span, pitch actuator {frequency:g} rad/s"
        assert _facts(runs)[0] == ("turbine", words)


def judged(kind: str, c: Any, row: dict[str, str]) -> Finding:
    return RULES[kind].of(c, row)


@dataclass
class Drawn:
    """Changes of all quantities drawn about a factor times the paper's, in 240 minutes."""

    factor: float
    schemes: tuple[str, ...] = ("cpc", "ipc", "cpfc")
    windows: Mapping[str, tuple[float, float]] = field(
        default_factory=lambda: dict.fromkeys([WHOLE, PAPER, *map(str, range(39))], (0.0, 60.0))
    )

    def values(self, quantity: str, scheme: str, window: str) -> NDArray[np.float64]:
        stated = {(row["quantity"], row["scheme"]): row["paper"] for row in rows_of("he2018", "claims.csv").values()}
        if scheme == "cpc":
            return np.full(6, 100.0)
        rng = np.random.default_rng(crc32(f"{quantity} {scheme} {window}".encode()))
        paper = float(stated[quantity, scheme].removesuffix(" %"))
        return 100.0 + self.factor * paper + rng.normal(0.0, 2.0, 6)


def test_a_number_of_the_papers_holds_if_it_is_one_of_our_minutes() -> None:
    row = {"quantity": "RootMyc1 std", "scheme": "ipc", "paper": "-47.9 %"}
    found = [judged("near", Drawn(factor), row) for factor in (1.0, 0.5, 1.5)]
    assert [each.judged for each in found] == [HOLDS, differs("smaller effect"), differs("larger effect")]
    assert "p = " in found[0].ours and "none of 234 as far" in found[1].ours
    assert all("5 to 95 % of minutes" in each.ours for each in found)
    few = Drawn(1.0, windows=dict.fromkeys([WHOLE, PAPER, "0", "1"], (0.0, 60.0)))
    verdict = judgement(judged("near", few, row).judged)
    assert verdict.text == "cannot be judged: it needs 40 minutes, there are 12"


def test_a_claim_that_holds_by_few_minutes_says_so() -> None:
    """Of 60 minutes one is too few, two are enough, and up to three are few."""
    row = {"quantity": "RootMyc1 std", "scheme": "ipc", "paper": "-40 %"}
    found = [judged("near", Minutes60(reach), row) for reach in (1, 2, 3, 4)]
    assert [each.judged for each in found] == [differs("smaller effect"), HOLDS, HOLDS, HOLDS]
    assert [each.by_few for each in found] == [False, True, True, False]
    assert [each.text.endswith(": holds by few") for each in found] == [False, True, True, False]
    assert "2 of 60 as far (p = 0.067)" in found[1].ours


@dataclass
class Minutes60:
    """60 minutes of changes by -20 %, some of them by -41 %."""

    reach: int
    schemes: tuple[str, ...] = ("cpc", "ipc", "cpfc")
    windows: Mapping[str, tuple[float, float]] = field(
        default_factory=lambda: dict.fromkeys([WHOLE, *map(str, range(10))], (0.0, 60.0))
    )

    def values(self, quantity: str, scheme: str, window: str) -> NDArray[np.float64]:
        x = np.full(6, 100.0 if scheme == "cpc" else 80.0)
        if scheme != "cpc" and window.isdigit() and int(window) < self.reach:
            x[0] = 59.0
        return x


READ = ("FAST's model, class B", "full model, ed. 2")
MIXED = by_reading({READ[0]: True, READ[1]: differs("smaller effect")})


def lines(*verdicts: str) -> list[Claim]:
    found = [Claim(f"claim {k}", "", "", judgement_in(verdict), "") for k, verdict in enumerate(verdicts)]
    return [*found, Claim("asked for", "", "", judgement(True), "", basis="command")]


def test_a_verdict_is_that_of_each_reading() -> None:
    assert by_reading(dict.fromkeys(READ, True)) == judgement(True)
    assert MIXED.text == f"holds ({READ[0]}) / smaller effect ({READ[1]})"
    found = lines("holds", MIXED.text, "smaller effect")[:3]
    assert found[1].judgement == MIXED
    assert [[v.text for v in c.judgement.in_readings(READ)] for c in found] == [
        ["holds", "holds"],
        ["holds", "smaller effect"],
        ["smaller effect", "smaller effect"],
    ]


def test_the_headline_counts_each_reading() -> None:
    """What follows from a command and what cannot be checked is not among the claims that hold."""
    claims = lines("holds", MIXED.text, "smaller effect", "cannot be checked: because")
    assert count_by_reading(claims, READ) == [2, 1]
    words = counts_words(claims, claims, READ)
    assert words.startswith("Of 3 claims of the paper that can be checked, 1 hold in every reading")
    assert f"1 in some, 1 in none. There hold 2 with {READ[0]}, 1 with {READ[1]}" in words
    assert "1 more cannot be checked" in words
    rows = verdicts_table(claims, claims, READ).rows
    assert list(rows[0]) == ["hold", "2 of 3", "1 of 3"]
    assert [row[0] for row in rows[2:]] == ["claim 1", "claim 2"]


def test_what_a_controller_asks_for_is_no_prediction() -> None:
    rows = rows_of("he2018", "claims.csv").values()
    commanded = {row["item"] for row in rows if row["basis"] == "command"}
    assert commanded == {"power mean, IPC", "power mean, CPFC", "pitch 1 of IPC about that of CPC", "flap angles"}


@pytest.mark.parametrize(
    ("alone", "beside", "verdict"),
    [(110.0, 99.0, "falls beside the feedback only"), (90.0, 99.0, "holds"), (110.0, 101.0, "does not fall")],
)
def test_feed_forward_is_judged_alone_and_beside_the_feedback(alone: float, beside: float, verdict: str) -> None:
    loads = {"cpc": 100.0, "feedforward": alone, "feedback": 100.0, "ipc": beside}
    c: Any = SimpleNamespace(values=lambda quantity, scheme, window: loads[scheme] + np.array([-0.1, 0.0, 0.1, 0.0]))
    assert judgement(judged("feedforward", c, {"quantity": "RootMyc1 DEL"}).judged).text == verdict


def test_both_models_meet_both_winds() -> None:
    """The model of the paper's FAST has stiff blades, static polars and a quasi-steady wake."""
    assert (FAST_MODEL.torsion_modes, FAST_MODEL.stall, FAST_MODEL.inflow) == (0, "static", "quasi_steady")
    c: Any = object()
    runs = LoadControlRuns(*[None] * 2, dict.fromkeys(READINGS, c), dict.fromkeys(READINGS, c), *[None] * 4)  # type: ignore[arg-type]
    assert list(runs.judged) == [f"{m}, {w}" for m in ("FAST's model", "full model") for w in ("class B", "ed. 2")]
    together = {
        name: value for part in MODEL_PARTS.values() for name, value in part.model_dump(exclude_unset=True).items()
    }
    assert together == FAST_MODEL.model_dump(exclude_unset=True)


def test_the_papers_changes_are_likely_where_minutes_scatter_about_them() -> None:
    near, far = (probability(Drawn(factor)) for factor in (1.0, 0.5))  # type: ignore[arg-type]
    assert near > 0.5 > 1e-6 > far


LOADING = np.array([1.0, 0.9, 0.3, 0.4, 0.8, 0.7, 1.1, 1.0])
"""Of the changes on the logarithms of intensity and length."""


def drawn_minutes(intensity: float, length: float, n: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """(n, 8) logarithms of ratios that tell intensity from length, with a part that all have in common."""
    a, b = np.log(intensity / 0.1), np.log(length)
    mean = -0.7 + LOADING * a + LOADING[::-1] ** 2 * b
    common, own = rng.normal(0.0, 1.0, (n, 1)), rng.normal(0.0, 1.0, (n, 8))
    return np.asarray(mean + 0.1 * (intensity / 0.1) ** 0.5 * (0.8 * common + 0.6 * own))


def test_the_most_likely_wind_is_that_of_the_minute() -> None:
    rng = np.random.default_rng(5)
    winds = [(0.05, 1.0), (0.08, 0.5), (0.08, 1.0), (0.08, 2.0), (0.12, 0.5), (0.12, 1.0), (0.12, 2.0), (0.144, 1.0)]
    cells = [
        Minutes(f"{wind}", *wind, np.full(50, 7), 60.0 * np.arange(50), drawn_minutes(*wind, 50, rng)) for wind in winds
    ]
    inside, p = [], []
    for _ in range(60):
        e = estimate_wind(cells, 100.0 * np.expm1(drawn_minutes(0.09, 1.0, 1, rng)[0]))
        ends = [e.interval(axis) for axis in (0, 1)]
        inside.append([low <= true <= high for (_, low, high), true in zip(ends, (0.09, 1.0), strict=True)])
        p.append(e.probability)
    assert np.all(np.abs(np.mean(inside, axis=0) - 0.95) < 0.09)  # three standard deviations of 60 drawn ones
    assert np.mean(p) > 0.4
    e = estimate_wind(cells, 100.0 * np.expm1(cells[3].changes[11]))
    assert e.nearest == (cells[3].name, 7, 660.0) and np.array_equal(e.nearest_changes, cells[3].changes[11])
    assert e.ratio(0.144, 1.0) < 0.01 < e.ratio(*(e.interval(axis)[0] for axis in (0, 1))) == 1.0
    with pytest.raises(InputError, match="100 minutes"):
        estimate_wind(cells[:1], np.full(8, -50.0))
