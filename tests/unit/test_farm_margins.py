"""Load constraints and margins of two turbines in a row, and the wake between them, without a run."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from meltemi.papers.palanimuthu2022.beyond.farm import (
    ALIGNED,
    ANGLES,
    LOADS,
    SHARES,
    SPLITS,
    FarmSetPoint,
    TwoTurbineResults,
    loads_table,
    margins_table,
    splits,
    verdict,
)
from meltemi.studies.power_schemes.gaussian_wake import _widths, deflection, waked_speed

CT, TI, TURNED = 0.8, 0.06, math.radians(25.0)


def test_a_wake_follows_its_closed_form() -> None:
    """Bastankhah and Porté-Agel (2016): a straight path in the near wake, and from there on no jump, but less slope."""
    angle = 0.3 * TURNED / math.cos(TURNED) * (1.0 - math.sqrt(1.0 - CT * math.cos(TURNED)))
    near = _widths(CT, TURNED, TI, 5.0)[1]
    assert deflection(CT, TURNED, TI, 1.0) == pytest.approx(angle, rel=1e-12)
    assert deflection(CT, TURNED, TI, near + 1e-9) == pytest.approx(angle * near, rel=1e-6)
    assert 0.0 < deflection(CT, TURNED, TI, near + 2.0) - angle * near < 2.0 * angle
    assert deflection(CT, -TURNED, TI, 7.0) == -deflection(CT, TURNED, TI, 7.0) and deflection(CT, 0.0, TI, 7.0) == 0.0


def test_wind_behind_a_turbine() -> None:
    """Less thrust, more distance, turbulence or misalignment: more wind, but never less than at the centre."""
    wind = waked_speed(CT, 0.0, TI, 5.0)
    others = [(0.6, 0.0, TI, 5.0), (CT, 0.0, TI, 8.0), (CT, 0.0, 0.12, 5.0), (CT, TURNED, TI, 5.0)]
    assert 0.4 < wind < min(waked_speed(*other) for other in others) < 1.0
    assert waked_speed(1e-9, 0.0, TI, 5.0) == pytest.approx(1.0, abs=1e-8)
    _, _, across, up = _widths(CT, 0.0, TI, 10.0)
    centre = math.sqrt(1.0 - CT / (8.0 * across * up))
    assert centre < waked_speed(CT, 0.0, TI, 10.0) < 1.0


@pytest.fixture
def farm() -> TwoTurbineResults:
    """Derating takes thrust and load; misalignment takes power and adds load, from one side more than the other."""
    turbine: Any = SimpleNamespace(name="t", rotor_radius=63.0)
    seeds = np.array([1.0, 1.01, 0.99, 1.02])
    points = {}
    for angle in ANGLES:
        for share in SHARES:
            load = share * (1.0 + (0.15 if angle > 0.0 else 0.05 if angle < 0.0 else 0.0))
            numbers = {"generator_power": 2.3e6 * share * math.cos(angle) ** 2, "rotor_aero_thrust": 5e5 * share}
            points[FarmSetPoint(angle, share)] = {
                n: x * seeds for n, x in (numbers | dict.fromkeys(LOADS, load)).items()
            }
    made = TwoTurbineResults(turbine, points, {}, {})
    margins = splits(made)
    return TwoTurbineResults(
        turbine, points, margins, {split: (3 - i) * 0.01 * seeds for i, split in enumerate(SPLITS)}
    )


def test_derating_compensates_misalignment(farm: TwoTurbineResults) -> None:
    within = {(round(math.degrees(p.angle)), p.share): farm.within(p) for p in farm.points}
    assert within[0, 1.0] and within[-20, 0.9] and within[20, 0.8]
    assert not within[-20, 1.0] and not within[20, 0.9]
    assert farm.gain(ALIGNED).mean == 0.0 and farm.speed(FarmSetPoint(0.0, 0.8)) > farm.speed(ALIGNED)


def test_the_largest_margin_is_the_smaller_of_both(farm: TwoTurbineResults) -> None:
    equal, aligned, steered = (farm.margins[split] for split in SPLITS)
    assert sum(equal[1]) == pytest.approx(sum(aligned[1])) == pytest.approx(sum(steered[1]))
    assert equal[0] == aligned[0] == 0.0 and equal[2] <= aligned[2] <= steered[2]
    (up, down), least = aligned[1], aligned[2]
    mean = float(farm.points[ALIGNED]["generator_power"].mean())
    both = (mean - up, mean * farm.speed_at(0.0, up) ** 3 - down)
    assert least == pytest.approx(min(both)) and both[0] == pytest.approx(both[1], rel=0.1), (
        "both have as much to spare"
    )


def test_tables_and_words_of_the_farm(farm: TwoTurbineResults) -> None:
    loads, margins = loads_table({"t": farm}), margins_table({"t": farm})
    assert [row[8] for row in loads.rows if row[1] == "+20"] == ["no", "no", "yes"]
    assert [row[7] for row in margins.rows] == ["", "-33.3 ± 0.0", "-66.7 ± 0.0"]
    words = verdict({"t": farm})
    assert "within the loads of the aligned turbine: -20° at 90 %; -20° at 80 %; +20° at 80 %" in words
    assert "no misalignment tried adds any; the split by the smaller margin leaves" in words
    assert "the lack of power changes by -66.7 ± 0.0 %" in words
