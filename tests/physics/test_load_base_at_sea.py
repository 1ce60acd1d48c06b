"""A load base at sea from plan to design loads: the pile and the mudline have loads, and cases are those of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from meltemi.core.errors import Status
from meltemi.loads import base_table, design_loads, run_base, show_case
from meltemi_loads.loadbase.campaign import make_campaign
from meltemi_loads.loadbase.engine import same_numbers
from meltemi_loads.loadbase.metocean import read_metocean
from meltemi_loads.loadbase.plan import plan
from meltemi_loads.loadbase.table import load_table

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
