"""Which turbines pay for a held pitch, and what was changed to find out: tables and words without a run."""

from __future__ import annotations

from meltemi.papers.palanimuthu2022.beyond import machines
from meltemi.papers.palanimuthu2022.beyond.machines import BASE, FAST, HELD, NARROWED, SLOW_BASE, SLOW_FAST, SLOW_HELD
from meltemi.postprocess.ensemble import EnsembleTable, ensemble_table
from meltemi.studies.power_schemes import costs


def changes(names: tuple[str, ...], tower: dict[str, float]) -> EnsembleTable:
    """Four seeds in which only the tower's load differs."""
    rows = {
        seed: {
            name: dict.fromkeys(costs.UNITS, 1.0) | {costs.TOWER_LOAD: tower.get(name, 1.0) + 0.01 * seed}
            for name in names
        }
        for seed in (1, 2, 3, 4)
    }
    return ensemble_table(rows, costs.SLOPES)


def test_the_slow_loop_is_compared_with_its_own_base() -> None:
    """A0 with the slow loop, too: otherwise the loop's own effect on A0 would count for A2."""
    tower = {HELD: 2.0, NARROWED: 1.4, SLOW_BASE: 0.5, SLOW_HELD: 0.5, FAST: 3.0, SLOW_FAST: 0.5}
    own = changes((BASE, HELD, SLOW_BASE, SLOW_HELD, FAST, SLOW_FAST, NARROWED), tower)
    slow = changes((SLOW_BASE, SLOW_HELD, SLOW_FAST), tower)
    found = {"t": machines.SchemeChanges(0.8, 0.2, own, slow)}
    rows = {(row[3], row[4]): row[6] for row in machines.changes_table(found).rows}
    assert rows[SLOW_HELD, SLOW_BASE] == "+0.0 ± 0.0" and rows[SLOW_HELD, BASE].startswith("-4")
    words = machines.verdict(found)
    assert "80 % of rated speed on (t)" in words
    assert "A2 changes the tower base against A0 by +0.0 ± 0.0 % (t)" in words
    assert "from 90 % of its upper end on it is +39.0" in words
    wide = {
        "t": machines.SchemeChanges(
            0.95, 0.2, changes((BASE, HELD, SLOW_BASE, SLOW_HELD, FAST, SLOW_FAST), tower), slow
        )
    }
    assert "width of the range" not in machines.verdict(wide)
