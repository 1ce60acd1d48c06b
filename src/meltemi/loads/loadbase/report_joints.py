"""Joints and members in the report of a load base: damage, utilisation, Markov matrices and their picture."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from meltemi.core.files import replacing
from meltemi.frames.definition import Frame
from meltemi.frames.joints.fatigue import JointFatigue, fatigue_tables, welds_of
from meltemi.frames.joints.picture import plot_joint_damage
from meltemi.frames.joints.settings import JointSettings
from meltemi.frames.joints.utilisation import CLAUSES
from meltemi.loads.loadbase.coverage import read_results, shared_repetitions
from meltemi.loads.loadbase.endurance import MEANS, RANGES
from meltemi.loads.loadbase.joints import DAMAGE, JOINT, USE, frame_of, joint_settings
from meltemi.loads.loadbase.plan import Plan
from meltemi.postprocess.cycles import Cycles, Float, markov_matrix, sum_cycles
from meltemi.postprocess.sn import editions
from meltemi.reports.blocks import Block, CaseName, Cell, Picture, Table
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import aeroelastic

if TYPE_CHECKING:
    import pandas as pd

SHOWN = 30
"""Largest number of members in the report; files have all."""


@dataclass(frozen=True)
class JointResults:
    """Results of joints and members.

    Attributes:
      frame, settings: frame of the turbine, and settings of the campaign.
      fatigue: fatigue of the joints; None without cases of fatigue.
      utilisation: index (member, place): ratio, clause, case, row.
    """

    frame: Frame
    settings: JointSettings
    fatigue: JointFatigue | None
    utilisation: pd.DataFrame


def joint_results(plan: Plan, folder: str | Path, *, doubtful: bool = True) -> JointResults | None:
    """Results of joints and members over all cases; None if the campaign does not ask for them.

    Raises:
      InputError: the turbine has no frame, or a file cannot be read.
    """
    import pandas as pd

    if (s := joint_settings(plan.campaign)) is None:
        return None
    frame = frame_of(aeroelastic(load_turbine(plan.campaign.turbine), "joints"))
    results = read_results(plan, folder, doubtful=doubtful)
    repetitions, cases = shared_repetitions(results), {case.name: case for case in results.present}
    conditions = list(dict.fromkeys(f"{c.dlc}, {c.variant.speed:g} m/s" for c in results.present if c.weight))
    welds = welds_of(frame, s)
    damage = [np.zeros((len(conditions), len(weld.joint.braces), 2, 8)) for weld in welds]
    uses = []
    for case, channel, value in results.table("equivalent").itertuples(index=False):
        of = cases[str(case)]
        if channel.startswith(DAMAGE) and of.name in repetitions:
            j, *at = map(int, channel.removeprefix(DAMAGE).split(":"))
            place = conditions.index(f"{of.dlc}, {of.variant.speed:g} m/s")
            damage[j][place, at[0], at[1], at[2]] += repetitions[of.name] * value
        elif channel.startswith(USE):
            clause, section, member = channel.removeprefix(USE).split(":", 2)
            uses.append((member, section, value, CLAUSES[s.standard][int(clause)], of.name, of.row))
    parts = defaultdict[str, list[Cycles]](list)
    for channel, names, codes, cycles in results.store.cycles(results.keys) if conditions else ():
        if channel.startswith(JOINT):
            weights = np.array([repetitions.get(name, 0.0) for name in names])
            parts[channel].append(cycles._replace(counts=cycles.counts * weights[codes]))
    markov = {weld.joint.name: sum_cycles(parts[f"{JOINT}{j}"]) for j, weld in enumerate(welds)}
    of_joints = {weld.joint.name: each for weld, each in zip(welds, damage, strict=True)}
    tables = fatigue_tables(welds, of_joints, conditions, s, plan.campaign.years)
    fatigue = JointFatigue(*tables, markov) if conditions else None
    table = pd.DataFrame(uses, columns=["member", "place", "ratio", "clause", "case", "row"])
    table = table.sort_values("ratio", ascending=False, kind="stable").drop_duplicates(["member", "place"])
    return JointResults(frame, s, fatigue, table.set_index(["member", "place"]))


def joint_blocks(r: JointResults | None) -> list[Block]:
    """Picture and tables of joints and members."""
    if r is None:
        return []
    s, blocks = r.settings, list[Block]()
    worst = None if r.fatigue is None else r.fatigue.worst
    damage = {} if worst is None else dict(zip(worst["joint"], worst["utilisation"], strict=True))
    use = r.utilisation["ratio"].groupby(level="member").max().to_dict()
    file = BytesIO()
    plot_joint_damage(r.frame, damage, use).savefig(file, format="png", dpi=110)
    blocks.append(Picture(file.getvalue(), "Utilisation of members, and damage of joints with design fatigue factor."))
    if r.fatigue is not None and worst is not None:
        source = editions()[s.edition].source if s.edition in editions() else s.edition
        blocks.append(
            "Hot-spot stresses by Efthymiou's equations and the superposition of DNV-RP-C203, axial loads by "
            f"{s.classification}; S-N curve {s.curve} of {source}; design fatigue factor {s.design_fatigue_factor:g}. "
            "Rows are the worst point of each joint; its Markov matrix is that of the worst point in each case."
        )
        rows: list[list[Cell]] = []
        for row in worst.itertuples():
            share = r.fatigue.shares.loc[row.joint]
            part = f"DLC {share.idxmax()}: {100.0 * share.max():.0f} %" if len(share) and share.max() > 0.0 else ""
            where = [f"{row.brace}, {row.end}", row.side, f"{row.position}", row.curve]
            rows.append([row.joint, *where, row.damage, row.life, row.utilisation, part, row.outside])
        head = ["joint", "brace", "side", "position\ndeg", "S-N curve", "damage", "life\nyears", "damage x DFF"]
        blocks.append(Table([*head, "largest share", "outside ranges"], rows, "Fatigue of joints", text_columns=5))
    if len(r.utilisation):
        rows = [
            [member, place, row.ratio, row.clause, CaseName(row.case)]
            for (member, place), row in r.utilisation.head(SHOWN).iterrows()
        ]
        caption = f"Utilisation of members by {s.standard}, with partial safety factor of the loads"
        blocks.append(Table(["member", "place", "utilisation", "clause", "case"], rows, caption, text_columns=2))
    return blocks


def write_joint_tables(r: JointResults | None, folder: Path) -> list[Path]:
    """Write damage of all points, shares of load cases, Markov matrices [N/m^2] and utilisations as CSV files."""
    if r is None:
        return []
    tables = {"utilisation": r.utilisation}
    if r.fatigue is not None:
        tables |= {"joints": r.fatigue.table.set_index("joint"), "joint_shares": r.fatigue.shares}
        tables["joint_markov"] = _markov_table(r.fatigue)
    files = []
    for name, table in tables.items():
        files.append(folder / f"{name}.csv")
        with replacing(files[-1]) as (partial,):
            table.to_csv(partial)
    return files


def _markov_table(fatigue: JointFatigue) -> pd.DataFrame:
    import pandas as pd

    rows: list[Sequence[Any]] = []
    for joint, cycles in fatigue.markov.items():
        if not len(cycles.ranges):
            continue
        edges: list[Float] = [
            np.linspace(0.0, cycles.ranges.max(), RANGES + 1),
            np.linspace(cycles.means.min() - 1.0, cycles.means.max() + 1.0, MEANS + 1),
        ]
        counts = markov_matrix(cycles, *edges)
        for i, j in zip(*counts.nonzero(), strict=True):
            rows.append((joint, *edges[0][i : i + 2], *edges[1][j : j + 2], counts[i, j]))
    head = ["joint", "range_low", "range_high", "mean_low", "mean_high", "cycles"]
    return pd.DataFrame(rows, columns=head).set_index("joint")
