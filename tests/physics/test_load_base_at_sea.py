"""A load base at sea from plan to design loads: the pile and the mudline have loads, and cases are those of a run."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from meltemi.core.errors import Status
from meltemi.loads import base_table, design_loads, run_base, show_case
from meltemi.loads.loadbase.campaign import make_campaign
from meltemi.loads.loadbase.engine import same_numbers
from meltemi.loads.loadbase.metocean import read_metocean
from meltemi.loads.loadbase.plan import plan
from meltemi.loads.loadbase.report import exceeded, limit_ratios
from meltemi.loads.loadbase.table import load_table
from meltemi.turbine.library import load_turbine

ROWS = {"1.2", "6.1"}


@pytest.mark.long
def test_loads_down_to_the_mudline(tmp_path: Path) -> None:
    changes = {"without": sorted(load_table("61400-3-1").rows.keys() - ROWS)}
    given = {"standard": "61400-3-1", "metocean": read_metocean("weis"), "changes": changes, "rated_wind": 10.7}
    campaign = make_campaign("iea15mw-monopile", "IB", quick=True, duration=60.0, transient=20.0, **given)
    planned = plan(campaign)
    assert run_base(planned, tmp_path).done == len(planned.cases)
    case = planned.case("dlc6.1-50-y8-m0-s01")
    result = show_case(planned, case.name)
    assert result.status is Status.OK and same_numbers(planned, tmp_path, case.name, result)
    late = result.time >= 20.0
    moment, elevation = result["mudline_reaction_moment_y"][late], result["wave_elevation"][late]
    sea = case.content["sea"]
    assert elevation.max() - elevation.min() >= sea["crest"]["height"] - 0.05  # the embedded wave
    crest = result.time[np.argmax(result["wave_elevation"])]
    assert crest == pytest.approx(sea["crest"]["time"], abs=0.3)
    table = base_table(planned, tmp_path, "statistics").set_index(["channel", "case"])
    kept = table.loc[("mudline_reaction_moment_y", case.name)]
    assert (kept["min"], kept["max"]) == pytest.approx((moment.min(), moment.max()), rel=1e-6)
    design = design_loads(planned, tmp_path)
    bending = [design.characteristic.loc[(name, "M_res max"), "M_res"] for name in ("tower_base", "mudline")]
    assert bending[0] < bending[1]
    # the lowest station of this pile is the mudline, where its loads are those of the ground with the other sign
    lowest = design.characteristic.loc[("pile_station_1", "M_res max"), "M_res"]
    assert lowest == pytest.approx(bending[1], rel=1e-9)
    assert design.fatigue.loc["mudline_reaction_moment_y", 4.0] > design.fatigue.loc["tower_base_moment_fore_aft", 4.0]


@pytest.mark.long
def test_lines_and_offset_of_a_floating_turbine(tmp_path: Path) -> None:
    """Design tensions are of the runs' mean and largest values; the lost line pulls no more, others do the more."""
    table = load_table("61400-3-2")
    rows = {name: {"duration": 40.0, "transient": 20.0} for name in ("1.2", "1.3", "9.1")}
    changes = {"without": sorted(table.rows.keys() - rows.keys()), "rows": rows}
    given = {"standard": "61400-3-2", "metocean": read_metocean("weis"), "changes": changes, "rated_wind": 10.7}
    planned = plan(make_campaign("iea15mw-volturnus", "IB", quick=True, **given))
    assert run_base(planned, tmp_path).done == len(planned.cases)
    design = design_loads(planned, tmp_path)
    kept = base_table(planned, tmp_path, "statistics").set_index(["channel", "case"])
    strength = load_turbine("iea15mw-volturnus").platform.lines[0].strength
    for name, lost, mean_factor, rest in (("1.3", False, 1.3, 1.75), ("9.1", True, 1.0, 1.1)):
        line = design.lines.loc[("line_1_fairlead_tension", name)]
        mean, largest = kept.loc[("line_1_fairlead_tension", line["case"]), ["mean", "max"]]
        assert line["lost"] == lost and (line["mean"], line["largest"]) == (mean, largest)
        own = [c for c in planned.cases if c.row == name]
        each = [kept.loc[("line_1_fairlead_tension", c.name)] for c in own]
        alike: dict[float, list[float]] = {}
        for c, x in zip(own, each, strict=True):
            alike.setdefault(c.variant.speed, []).append(mean_factor * x["mean"] + rest * (x["max"] - x["mean"]))
        expected = max(np.mean(x) if name == "1.3" else max(x) for x in alike.values())
        assert line["design"] == pytest.approx(expected, rel=1e-9)
        assert line["utilisation"] == pytest.approx(line["design"] / strength, rel=1e-12)
    of_loss = {c.name: kept.loc[("line_1_fairlead_tension", c.name), "max"] for c in planned.cases if c.row == "9.1"}
    without_one = [value for name, value in of_loss.items() if "line_1_lost" in name]
    assert max(without_one) < max(of_loss.values())
    offset = float(design.signals.loc[("platform_offset", "max"), "value"])
    assert offset > 5.0
    ratios = limit_ratios(
        design, {"motion": {"platform": {"offset max": 0.8 * offset, "tilt max": math.radians(60.0)}}}
    )
    assert ratios.loc[("motion", "platform", "offset max"), "ratio"] == pytest.approx(1.25)
    assert 0.0 < ratios.loc[("motion", "platform", "tilt max"), "ratio"] < 1.0
    assert list(exceeded(design, ratios).index) == [("motion", "platform", "offset max")]
    assert {"line_1_fairlead_tension", "line_3_anchor_tension"} <= {*design.fatigue.index}
    assert (design.fatigue.loc["line_1_fairlead_tension", ["interface", "load"]] == ["line_1", "F"]).all()
