"""Load control of meltemi and of ROSCO on the same turbine and winds, each relative to its collective pitch control."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from meltemi.bladed_controllers.controller import BladedController
from meltemi.bladed_controllers.rosco import edit_discon, find_rosco, rosco_example
from meltemi.control.controller import Controller
from meltemi.controllers.names import SCHEMES
from meltemi.papers.he2018.measures import change, percent, sentence
from meltemi.papers.he2018.runs import (
    CLASS_B,
    PAPER,
    READINGS,
    SPEED,
    LoadControlSetup,
    TunedTurbine,
    bench,
    paper_turbine,
    wind_of,
)
from meltemi.papers.study import Progress
from meltemi.reports.blocks import Section, Table
from meltemi.simulation.rotors import build
from meltemi.tuning.compare import WHOLE, Comparison, compare
from meltemi.turbine.definition import Turbine

DISCON = "Test_Cases/NREL-5MW/DISCON.IN"
OURS = ("cpc", "ipc", "ipc2", "cpfc")
BASE, ROSCO_BASE = "cpc", "ROSCO"
EXAMPLE = {"IPC_ControlMode": 1, "IPC_KI": (1e-8, 0.0)}
EXAMPLE_2P = {"IPC_ControlMode": 2, "IPC_KI": (1e-8, 5e-9)}
"""Gains of ROSCO's example for its NREL 5 MW at 1P, and half of that at 2P."""
LED = 2.0
"""Gain at 1P over the example's, with the phase lead of our loop: the largest of 1, 2, 4 that did not raise loads."""
PLANTS: Mapping[str, Callable[[], Turbine]] = {
    "pitch actuator of 11.11 rad/s": paper_turbine,
    "ideal pitch actuator": lambda: paper_turbine().replace(**{"pitch_actuator.kind": "ideal"}),
}
SHOWN = ("RootMyc1 std", "RootMyc1 DEL", "RootMxc1 DEL", "OoPDefl1 std", "TwrBsMyt DEL", "YawBrMyp DEL")


@dataclass(frozen=True)
class RoscoComparison:
    """Results of the comparison with ROSCO.

    Attributes:
      setup: extent of the simulations.
      plants: comparisons of all schemes in all winds, by name of the plant.
    """

    setup: LoadControlSetup
    plants: Mapping[str, Comparison]


def rosco_schemes(b: TunedTurbine, folder: Path) -> dict[str, Controller]:
    """ROSCO with collective pitch, individual pitch as in its example, and with the phase lead of our loops.

    Args:
      b: turbine with tuned loops.
      folder: folder for the input files.
    """
    # phase of the harmonic; ROSCO uses an angle of the rotor
    lead_1p, lead_2p = (t.loop.offset / t.loop.harmonic for t in b.tunings[SCHEMES["ipc2"].loops])
    settings: dict[str, dict[str, Any]] = {
        ROSCO_BASE: {},
        "ROSCO 1P": EXAMPLE,
        "ROSCO 1P, led": EXAMPLE | {"IPC_KI": (LED * 1e-8, 0.0), "IPC_aziOffset": (lead_1p, 0.0)},
        "ROSCO 1P, 2P": EXAMPLE_2P,
        "ROSCO 1P, 2P, led": EXAMPLE_2P | {"IPC_KI": (LED * 1e-8, 5e-9), "IPC_aziOffset": (lead_1p, lead_2p)},
    }
    source, library = rosco_example(DISCON), find_rosco()
    schemes = {}
    for name, changes in settings.items():
        file = edit_discon(source, folder / f"{name}.IN", LoggingLevel=0, **changes)
        schemes[name] = BladedController(b.model.turbine, library, file, name=name)
    return schemes


def compare_with_rosco(
    setup: LoadControlSetup, *, workers: int | None = None, progress: Progress = lambda share, what: None
) -> RoscoComparison:
    """Run the comparison.

    Raises:
      InputError: the rosco package is not installed.
    """
    find_rosco()
    winds = [wind_of(seed, SPEED, **READINGS[CLASS_B]) for seed in setup.seeds]
    plants = {}
    with tempfile.TemporaryDirectory(prefix="meltemi-") as folder:
        for i, (name, turbine) in enumerate(PLANTS.items()):
            progress(i / len(PLANTS), "tuning")
            b = bench(build(turbine()), OURS)
            place = Path(folder) / str(i)
            place.mkdir()
            schemes = {scheme: b.controller(scheme) for scheme in OURS} | rosco_schemes(b, place)
            plants[name] = compare(
                b.model,
                schemes,
                winds,
                duration=setup.duration,
                transient=setup.transient,
                windows=setup.windows,
                workers=workers,
                progress=lambda share, i=i, name=name: progress((i + share) / len(PLANTS), name),  # type: ignore[misc]
            )
    return RoscoComparison(setup, plants)


def base_of(scheme: str) -> str:
    """The collective pitch scheme to which a scheme is compared."""
    return ROSCO_BASE if scheme.startswith(ROSCO_BASE) else BASE


def comparison_tables(comparison: RoscoComparison) -> list[Table]:
    """Table for each plant: changes relative to collective pitch, and actuator duty."""
    tables = []
    for plant, c in comparison.plants.items():
        rows = []
        for scheme in c.schemes:
            base = base_of(scheme)
            changes = ["" if scheme == base else percent(change(c, q, scheme, WHOLE, base)) for q in SHOWN]
            window = "" if scheme == base else percent(change(c, "RootMyc1 DEL", scheme, PAPER, base))
            travel = f"{np.degrees(c.values('pitch travel', scheme).mean()):.2f}"
            speed = f"{30.0 / np.pi * c.values('rotor speed std', scheme).mean():.3f}"
            tower = f"{1e-3 * c.values('TwrBsMyt DEL', scheme).mean():.0f}"
            rows.append([scheme, *changes, window, travel, speed, tower])
        begin, end = comparison.setup.window
        head = ["scheme", *SHOWN, f"RootMyc1 DEL {begin:g}-{end:g} s"]
        head += ["pitch travel deg/s", "rotor speed std rpm", "TwrBsMyt DEL kN m"]
        seeds = "1 seed" if len(c.winds) == 1 else f"{len(c.winds)} seeds"
        caption = f"{plant[0].upper()}{plant[1:]}: {SPEED:g} m/s, {CLASS_B}, {seeds}"
        tables.append(Table(head, rows, caption))
    return tables


def brief(table: Table) -> Table:
    """The table in short form for the terminal."""
    kept = [table.head.index(name) for name in ("scheme", "RootMyc1 std", "RootMyc1 DEL", "TwrBsMyt DEL")]
    kept.append(table.head.index("pitch travel deg/s"))
    return Table([table.head[i] for i in kept], [[row[i] for i in kept] for row in table.rows], table.caption)


def findings(comparison: RoscoComparison) -> list[str]:
    """Sentence on the DEL of RootMyc1 for each plant."""
    lines = []
    for plant, c in comparison.plants.items():

        def reduction(scheme: str, c: Comparison = c) -> Any:
            return change(c, "RootMyc1 DEL", scheme, WHOLE, base_of(scheme))

        ahead = {s: int(np.sum(reduction("ipc") < reduction(s))) for s in ("ROSCO 1P", "ROSCO 1P, led")}
        mean = {s: f"{reduction(s).mean():+.1f} %" for s in (*OURS[1:], *ahead)}
        speed_std, tower = (
            f"{c.values(q, ROSCO_BASE).mean() / c.values(q, BASE).mean() * 100.0 - 100.0:+.0f}"
            for q in ("rotor speed std", "TwrBsMyt DEL")
        )
        numbers = {"n": len(c.winds), "speed": speed_std, "tower": tower}
        lines.append(sentence("rosco", plant=f"{plant[0].upper()}{plant[1:]}", mean=mean, ahead=ahead, **numbers))
    return lines


def chapter(comparison: RoscoComparison) -> Section:
    """The chapter of the page."""
    head = (Path(__file__).parent / "rosco_head.md").read_text(encoding="utf-8")
    versions = f"rosco {version('rosco')}, meltemi {version('meltemi')}, {datetime.now(UTC):%Y-%m-%d}"
    s = comparison.setup
    last = f"*Made with {versions}; {s.transient:g} to {s.duration:g} s of seeds {', '.join(map(str, s.seeds))}.*"
    return Section("Beside ROSCO", [head.strip(), *comparison_tables(comparison), *findings(comparison), last])
