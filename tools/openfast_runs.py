"""Exported decks in OpenFAST and here: table of the page ``docs/guide/openfast-decks.md``.

    python tools/openfast_runs.py openfast --out runs nrel5mw iea15mw DECK.fst ...

``openfast`` is the executable of OpenFAST 5. Each turbine runs with ElastoDyn and BeamDyn in each case, ``kind speed``:
``steady`` wind (locked generator and tower, held pitch), steady wind with a ``free`` rotor under the deck's torque law,
below rated, where it is that of the baseline, and ``turbulent`` wind (locked generator). The same deck, read back, runs
here. Rows are appended to ``runs/runs.csv``.
"""

from __future__ import annotations

import argparse
import csv
import math
import resource
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

import meltemi
from meltemi import ModelOptions, Result, SteadyWind, Turbine, TurbulentWind
from meltemi.control.constant import ConstantController
from meltemi.io import read_deck, read_result, write_bts, write_openfast
from meltemi.turbine.power_turbine import aeroelastic

CASES = ("steady 8", "steady 12", "steady 18", "free 8", "turbulent 14")
SETTLED = {"steady": 12.0, "turbulent": 12.0, "free": 40.0}
"""[s] before runs are evaluated, steady ones over a revolution; speeds of free rotors begin apart by up to 2 %."""
TURBULENT = 30.0
"""[s] over which turbulent runs are evaluated."""
DAMPED: dict[str, Any] = {
    "blade.structure.damping": {"flap": 0.05, "edge": 0.05, "torsion": 0.05},
    "blade.structure.damping_time": None,
}
"""Of the blades in steady runs."""
CHANNELS = {
    "thrust": ("RotThrust", "RotThrust"),
    "flapwise": ("RootMyb1", "B1RootMyr"),
    "edgewise": ("RootMxb1", "B1RootMxr"),
    "tip": ("TipDxb1", "B1TipTDxr"),
    "tower base": ("TwrBsMyt", "TwrBsMyt"),
    "tower side": ("TwrBsMxt", "TwrBsMxt"),
}
"""Quantity: our channel, and that of BeamDyn; ElastoDyn has ours."""


def described(name: str) -> Turbine:
    """A turbine of the library, or of a deck."""
    if not name.endswith(".fst"):
        return aeroelastic(meltemi.load_turbine(name), "openfast_runs")
    extra = {"pitch_actuator.kind": "ideal"}
    return read_deck(name, extra=extra).turbine


def openfast(program: str, main: Path) -> tuple[Result, float]:
    """Output of a run and its CPU time [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, main.name], cwd=main.parent, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise SystemExit(f"{main}: {done.stdout[-2000:]}{done.stderr[-2000:]}")
    return read_result(main.with_suffix(".outb")), after.ru_utime - before.ru_utime


def both(program: str, turbine: Turbine, case: str, beamdyn: bool, folder: Path, **options: Any) -> dict[str, Any]:
    """Deviations [%] of our run from OpenFAST's: of means, or in turbulence of standard deviations."""
    kind, speed = case.split()[0], float(case.split()[1])
    free, turbulent = kind == "free", kind == "turbulent"
    locked = ("yaw",) if free else ("yaw", "generator") if turbulent else ("yaw", "generator", "tower")
    if not turbulent:  # edgewise vibrations of the start would last for minutes
        turbine = turbine.replace(**DAMPED)
    model_options = ModelOptions(locked=locked, **options)
    point = meltemi.operating_point(meltemi.build(turbine), speed)
    settled = SETTLED[kind]
    duration = settled + (TURBULENT if turbulent else math.tau / point.rotor_speed)
    wind: Any = SteadyWind(speed=speed, shear_exponent=0.2)
    written_wind: Any = wind
    if turbulent:
        made = TurbulentWind(speed=speed, intensity=0.15, points=15, dt=0.2)
        wind = meltemi.wind.generate_field(made, turbine, duration)
        (written_wind,) = write_bts(wind, folder.parent / f"{turbine.name}.bts")
        wind = meltemi.io.read_bts(written_wind)
    start: dict[str, Any] = {"rotor_speed": point.rotor_speed, "pitch": point.pitch}
    main = write_openfast(
        turbine, folder, options=model_options, wind=written_wind, duration=duration, beamdyn=beamdyn, **start
    ).main
    theirs, cpu = openfast(program, main)
    deck = read_deck(main, control_of=turbine)
    model = meltemi.build(deck.turbine, ModelOptions(**deck.options))
    more: dict[str, Any] = {} if free else {"controller": ConstantController()}
    more["channels"] = ["RotTorq", "RotSpeed", *(mine for mine, _ in CHANNELS.values())]
    ours = meltemi.simulate(model, wind, duration=duration, start=meltemi.Start(**start, coordinates={}), **more)
    ours.raise_for_status()
    a, b = (result.between(settled, duration) for result in (ours, theirs))
    measure = np.std if turbulent else np.mean
    power = [measure(r["RotTorq"] * r["RotSpeed"]) for r in (a, b)]
    row: dict[str, Any] = {"turbine": turbine.name, "blades": "BeamDyn" if beamdyn else "ElastoDyn", "wind": case}
    row["power"] = power[0] / power[1] - 1.0
    for name, (mine, other) in CHANNELS.items():
        row[name] = measure(a[mine]) / measure(b[other if beamdyn else mine]) - 1.0
    row["correlation"] = float(np.corrcoef(np.interp(b.time, a.time, a["RotThrust"]), b["RotThrust"])[0, 1])
    return row | {"cpu": cpu / duration}


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("program")
    asked.add_argument("turbines", nargs="+")
    asked.add_argument("--out", type=Path, default=Path("runs"))
    asked.add_argument("--cases", nargs="+", default=CASES)
    asked.add_argument("--blades", nargs="+", default=["ElastoDyn", "BeamDyn"])
    given = asked.parse_args()
    for name in given.turbines:
        turbine = described(name)
        for blades in given.blades:
            for case in given.cases:
                if blades == "BeamDyn" and not turbine.blade.structure.twists:
                    continue
                folder = given.out / f"{turbine.name}_{blades}_{case.replace(' ', '_')}"
                row = both(given.program, turbine, case, blades == "BeamDyn", folder)
                texts = {k: v if isinstance(v, str) else f"{v:.5f}" for k, v in row.items()}
                print(texts, flush=True)
                file = given.out / "runs.csv"
                new = not file.exists()
                with file.open("a", newline="") as stream:
                    table = csv.DictWriter(stream, list(texts))
                    if new:
                        table.writeheader()
                    table.writerow(texts)


if __name__ == "__main__":
    main()
