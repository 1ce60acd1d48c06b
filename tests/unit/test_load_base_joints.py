"""Joints and members of a frame in a load base: what each case keeps, tables over the lifetime, and the report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from synthetic_base import small_plan, synthetic_base

from meltemi import InputError
from meltemi.frames.definition import Foot, Frame, Member, Section
from meltemi.frames.joints.fatigue import LoadCase, joint_fatigue, largest_utilisations
from meltemi.frames.joints.settings import JointSettings
from meltemi.loads.loadbase.coverage import read_results, shared_repetitions
from meltemi.loads.loadbase.design import design_loads
from meltemi.loads.loadbase.jobs import jobs_of
from meltemi.loads.loadbase.plan import Plan, PlannedCase
from meltemi.loads.loadbase.report import write_report
from meltemi.loads.loadbase.report_joints import joint_results
from meltemi.loads.loadbase.settings import DesignSettings
from meltemi.turbine.library import load_turbine, write_turbine

SECTIONS = {"leg": Section(diameter=1.2, thickness=0.05), "brace": Section(diameter=0.8, thickness=0.02)}
FRAME = Frame(
    depth=20.0,
    joints={
        "foot": (0.0, 0.0, -20.0),
        "node_1": (0.0, 0.0, -10.0),
        "top": (0.0, 0.0, 0.0),
        "side_a": (8.0, 0.0, -2.0),
        "side_b": (8.0, 0.0, -18.0),
    },
    feet=(Foot(joint="foot"),),
    sections=SECTIONS,
    members={
        "leg_1": Member(joints=("foot", "node_1"), section="leg"),
        "leg_2": Member(joints=("node_1", "top"), section="leg"),
        "a": Member(joints=("node_1", "side_a"), section="brace"),
        "b": Member(joints=("side_b", "node_1"), section="brace"),
    },
    interface=("top",),
)
SIX = ("force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z")
SIZES = (1e4, 1e4, 6e5, 2e5, 2e5, 1e4)


def member_loads(case: PlannedCase, time: NDArray[np.float64]) -> dict[str, Any]:
    """Loads that grow with the wind speed, with another phase for each member and component."""
    series = {}
    for i, member in enumerate(FRAME.members):
        for j, place in enumerate(("start", "middle", "end")):
            for k, (name, size) in enumerate(zip(SIX, SIZES, strict=True)):
                wave = np.sin(2.0 * np.pi * (0.3 + 0.1 * k) * time + i + 2.0 * j + 0.5 * (case.variant.seed or 0))
                series[f"member_{member}_{place}_{name}"] = case.variant.speed / 10.0 * size * wave
    return series


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> tuple[Plan, Path]:
    folder = tmp_path_factory.mktemp("joints")
    write_turbine(load_turbine("nrel5mw").replace(frame=FRAME), folder / "jacket.yaml")
    planned = small_plan(("1.2", "1.3", "6.4"), turbine=str(folder / "jacket.yaml"), joints=True)
    return synthetic_base(folder, planned, member_loads), folder


def loads_of(case: PlannedCase) -> dict[tuple[str, str], NDArray[np.float64]]:
    time = 0.05 * np.arange(round(case.duration / 0.05) + 1)
    series = member_loads(case, time)
    return {
        (member, place): np.stack([series[f"member_{member}_{place}_{name}"] for name in SIX], axis=1)
        for member in FRAME.members
        for place in ("start", "middle", "end")
    }


def test_damage_is_that_of_the_cases_with_their_weights(base: tuple[Plan, Path]) -> None:
    results = joint_results(*base)
    assert results is not None and results.fatigue is not None
    repetitions = shared_repetitions(read_results(*base))
    cases = [
        LoadCase(case.name, loads_of(case), case.duration, repetitions[case.name] * case.duration / 3600.0)
        for case in base[0].cases
        if case.weight
    ]
    direct = joint_fatigue(FRAME, cases)
    assert results.fatigue.table["damage"].to_numpy() == pytest.approx(direct.table["damage"].to_numpy(), rel=1e-9)
    assert results.fatigue.shares.loc["node_1"].sum() == pytest.approx(1.0)
    assert results.fatigue.table["curve"].unique().tolist() == ["T, cathodic"]


def test_utilisation_is_the_largest_with_the_factor_of_its_case(base: tuple[Plan, Path]) -> None:
    results = joint_results(*base)
    assert results is not None
    row = results.utilisation.loc[("a", "start")]
    case = base[0].case(str(row["case"]))
    direct = largest_utilisations(FRAME, loads_of(case), factor=case.factor)["a", "start"]
    assert (row["ratio"], row["clause"]) == (pytest.approx(direct[0]), direct[1])
    assert case.type == "ultimate" and case.factor > 1.0
    assert len(results.utilisation) == 3 * len(FRAME.members)


def test_report_has_picture_tables_and_files(base: tuple[Plan, Path]) -> None:
    design = design_loads(*base, DesignSettings(resamples=10, undeflected=5.0))
    page, *files = write_report(*base, design=design)
    text = page.read_text(encoding="utf-8")
    for words in ("Joints and members", "Fatigue of joints", "node_1", "NORSOK N-004", "6.3.8.2", "load path"):
        assert words in text
    assert {"joints.csv", "joint_shares.csv", "joint_markov.csv", "utilisation.csv"} <= {path.name for path in files}
    markov = pd.read_csv(base[1] / "tables" / "joint_markov.csv")
    assert (markov["cycles"] > 0.0).all() and markov["range_high"].max() > 1e7  # N/m^2
    statistics = read_results(*base).table("statistics")["channel"]
    assert not statistics.astype(str).str.startswith("member_").any()


def test_settings_belong_to_the_key_of_a_case(base: tuple[Plan, Path]) -> None:
    plain, with_other = (
        Plan(base[0].campaign.replace(joints=joints), base[0].table, base[0].cases)
        for joints in (False, JointSettings(curve="D"))
    )
    keys = [[job.key for job in jobs_of(each)] for each in (base[0], plain, with_other)]
    assert not set(keys[0]) & set(keys[1]) and not set(keys[0]) & set(keys[2])
    assert joint_results(plain, base[1]) is None


def test_turbine_without_frame_is_refused() -> None:
    with pytest.raises(InputError, match="nrel5mw.*has no frame"):
        jobs_of(small_plan(joints=True))
