"""Base points of the yaw protection from load limits, without simulations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from meltemi import InputError, Model, Run
from meltemi.control import YawProtection
from meltemi.simulation.validity import undeflected_clearance
from meltemi.studies import yaw_limits
from meltemi.studies.machine_loads import BLADE_ROOT, TOWER_BASE
from meltemi.studies.yaw_limits import (
    CLEARANCE,
    DEAD_BAND,
    TIP,
    UNITS,
    YawLimits,
    find_limits,
    limit_rows,
    limit_words,
    plot_limits,
    speeds_between,
)
from meltemi.tuning.run_store import FailedResult


def limits(use: list[list[float]], other: float = 0.5) -> YawLimits:
    """Loads at 0, 30 and 60 degrees; errors of negative sign load by a factor less or more."""
    errors = np.radians([0.0, 30.0, 60.0])
    both = np.array(use)[..., None] * np.array([1.0, other])
    loads = {name: both * (k + 1.0) * (1.0 if name == TOWER_BASE else 0.9) for k, name in enumerate(UNITS)}
    return YawLimits(np.array([5.0, 10.0, 20.0, 25.0]), errors, loads, {n: k + 1.0 for k, n in enumerate(UNITS)})


USE = [[0.2, 0.3, 0.4], [0.5, 0.5, 1.5], [0.8, 0.9, 0.7], [1.1, 1.2, 1.3]]


def test_base_points_lie_where_a_load_reaches_its_limit() -> None:
    found = limits(USE)
    # within the limit everywhere; halfway from 30 to 60; within, but never above what a lower wind allows; beyond
    assert np.degrees(found.allowed()) == pytest.approx([60.0, 45.0, 45.0, 0.0])
    speeds, thresholds = found.base_points
    assert YawProtection(wind_speeds=speeds, thresholds=thresholds).thresholds[1] == pytest.approx(np.radians(45.0))


def test_the_worse_sign_of_the_error_governs() -> None:
    assert limits(USE).governing()[:2] == ["tower base bending, +60 deg", "tower base bending, +60 deg"]
    worse = limits(USE, other=1.2)
    assert worse.governing()[1] == "tower base bending, -60 deg"
    assert np.degrees(worse.allowed()[1]) == pytest.approx(40.0)
    assert len(plot_limits(worse).axes) == 2


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Runs in which all loads are 1, but for two that fail; the list gets their names."""
    names: list[str] = []

    def found(cases: list[Run], **_: object) -> list[Any]:
        names.extend(str(c.name) for c in cases)
        failed = ("etm 8 m/s 8 deg seed 1", "ntm 8 m/s 60 deg seed 1")
        return [FailedResult("no start") if c.name in failed else dict.fromkeys(UNITS, 1.0) for c in cases]

    monkeypatch.setattr(yaw_limits, "cells", found)
    monkeypatch.setattr(yaw_limits, "operating_point", lambda *_: None)
    return names


def test_a_failed_run_limits_its_own_yaw_error_only(fake: list[str], model: Model) -> None:
    """Not the load limit, which would become infinite and allow everything."""
    assert np.degrees(DEAD_BAND) == pytest.approx(8.0)
    made = find_limits(model, [1], speeds=(8.0,), errors=tuple(np.radians((0.0, 30.0, 60.0))))
    assert made.limit == pytest.approx(dict.fromkeys(UNITS, 1.1))  # blade root and tip clearance, too
    assert made.use.tolist() == [[pytest.approx(1 / 1.1), pytest.approx(1 / 1.1), np.inf]]
    assert limit_rows(made)[1][0][3] == "failed"
    assert np.degrees(made.allowed()) == pytest.approx([30.0])


def test_with_limits_of_the_user_no_extreme_turbulence_is_run(fake: list[str], model: Model) -> None:
    made = find_limits(model, [1], speeds=(8.0, 9.0), errors=(0.0, 0.5), limit={TOWER_BASE: 2.0})
    assert made.limit == {TOWER_BASE: 2.0} and made.use == pytest.approx(np.full((2, 2), 0.5))
    assert len(fake) == 6 and all(name.startswith("ntm") for name in fake)
    with pytest.raises(InputError, match="no load 'tower base': did you mean 'tower base bending'"):
        find_limits(model, [1], limit={"tower base": 2.0})


def test_default_speeds_reach_from_cut_in_to_cut_out() -> None:
    assert speeds_between(3.0, 25.0).tolist() == [5.0, 8.0, 12.0, 15.0, 18.0, 22.0, 25.0]


def test_blade_root_and_tip_clearance_limit_the_yaw_error(monkeypatch: pytest.MonkeyPatch, model: Model) -> None:
    """A blade whose load rises by 42 % up to 50 degrees, as that of the NREL 5 MW at 18 m/s; and a tip that comes near.

    The other loads stay. The least clearance that the extreme turbulence leaves, less a tenth of the deflection, is the
    limit: the tip may take up so much of that of the undeflected rotor.
    """
    rest = undeflected_clearance(model) + yaw_limits._tower_radius(model.turbine)

    def found(cases: list[Run], reduce: Any, **_: object) -> list[Any]:
        def peaks(case: Run) -> Any:
            kind, _, _, error, *_ = str(case.name).split()
            loads = dict.fromkeys(("yaw_moment_x", "yaw_moment_z", "yaw_force_x", "tower_base_moment_fore_aft"), 1.0)
            bent = 4.0 if kind == "etm" else 4.0 * (1.0 + 0.004 * abs(float(error)))
            flap = 1.0 if kind == "etm" else 1.0 + 0.42 / 50.0 * abs(float(error))
            loads |= {"root_moment_flap_1": flap, CLEARANCE: rest - bent}
            return reduce(Peaks(loads))

        return [peaks(case) for case in cases]

    monkeypatch.setattr(yaw_limits, "cells", found)
    monkeypatch.setattr(yaw_limits, "operating_point", lambda *_: None)
    errors = tuple(np.radians((0.0, 50.0)))
    made = find_limits(model, [1], speeds=(18.0,), errors=errors)
    assert np.degrees(made.allowed()) == pytest.approx([50.0 * 0.1 / 0.42])
    assert made.governing() == ["blade root flap, +50 deg"]
    assert made.loads[TIP][0, :, 0] == pytest.approx([4.0, 4.8])
    assert made.limit[TIP] == pytest.approx(4.4)
    assert f"tip clearance {rest - yaw_limits._tower_radius(model.turbine) - 4.4:.4g} m" in limit_words(made)
    least = undeflected_clearance(model) - 4.4
    own = find_limits(model, [1], speeds=(18.0,), errors=errors, limit={TIP: least})
    assert np.degrees(own.allowed()) == pytest.approx([25.0])
    with pytest.raises(InputError, match="load limits: tip clearance: expected less than the .* of the undeflected"):
        find_limits(model, [1], limit={TIP: 100.0})
    assert BLADE_ROOT in UNITS and UNITS[TIP] == "m"


class Peaks:
    """A result with one record."""

    def __init__(self, values: dict[str, float]) -> None:
        self.values = values

    def between(self, begin: float, end: float) -> Peaks:
        return self

    def __getitem__(self, name: str) -> np.ndarray:
        return np.array([self.values.get(name, 0.0)])
