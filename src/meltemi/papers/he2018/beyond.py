"""Results beyond the paper: alternatives to flaps, other wind speeds, lifetime loads, actuator duty, preview, winds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from meltemi.control_laws.filters import response
from meltemi.controllers.tuning import margins
from meltemi.papers.he2018.measures import change, edgewise, likelihood, percent, sentence
from meltemi.papers.he2018.runs import (
    ADDED,
    ALL_SPEEDS,
    CLASS_B,
    DECAY,
    LOST,
    PAPER,
    PARTS,
    PREVIEWS,
    RIVALS,
    SLOW,
    SPEED,
    TRAVEL,
    LoadControlRuns,
)
from meltemi.postprocess.ensemble import ensemble_load, lifetime_del, mean_interval, rayleigh_weights
from meltemi.report.tables import number
from meltemi.reports.blocks import Table
from meltemi.simulation.rotors import default_step
from meltemi.tuning.compare import WHOLE, Comparison
from meltemi.tuning.quantities import BLADE_SLOPE, STEEL_SLOPE
from meltemi.tuning.run_store import FailedResult, guarded

Float = NDArray[np.float64]

MEAN_WIND = 8.5
"""[m/s] yearly mean of class II, 0.2 V_ref."""
LIFETIME_SPEEDS = (8.0, 12.0, 16.0, 20.0, 24.0)
LOADS = {"RootMyc1 DEL": BLADE_SLOPE, "RootMxc1 DEL": BLADE_SLOPE, "TwrBsMyt DEL": STEEL_SLOPE}


def duty(c: Comparison, name: str, scheme: str) -> float:
    """Mean actuator travel [deg/s]."""
    return float(np.degrees(c.values(name, scheme).mean()))


def schemes_table(c: Comparison, schemes: Sequence[str], caption: str) -> Table:
    """Loads, rotor speed and actuator duty of schemes."""
    shown = [(name, window) for name, window in _MAIN if window in c.windows]
    rows = [
        [
            scheme,
            *(percent(change(c, name, scheme, window)) for name, window in shown),
            f"{duty(c, 'pitch travel', scheme):.2f}",
            f"{duty(c, 'flap travel', scheme):.2f}",
        ]
        for scheme in schemes
        if scheme in c.schemes
    ]
    head = ["scheme", *(name if window == WHOLE else f"{name}\n{window}" for name, window in shown)]
    travel = f"Pitch travel of CPC: {duty(c, 'pitch travel', 'cpc'):.2f} deg/s."
    note = f"Changes against CPC, means over {len(c.winds)} seeds with 95 % intervals. {travel}"
    return Table([*head, "pitch travel\ndeg/s", "flap travel\ndeg/s"], rows, caption, note=note)


_MAIN = (
    *((name, WHOLE) for name in ("RootMyc1 std", "RootMyc1 DEL", "RootMxc1 DEL", "OoPDefl1 std", "TwrBsMyt DEL")),
    *(("rotor speed std", WHOLE), ("RootMyc1 std", PAPER), ("RootMyc1 DEL", PAPER)),
)


def rivals(runs: LoadControlRuns) -> Table:
    """Table of the schemes without preview at the paper's wind speed."""
    schemes = (*PARTS[1:], *RIVALS, TRAVEL)
    return schemes_table(runs.readings[CLASS_B], schemes, f"All schemes at {SPEED:g} m/s, {CLASS_B}")


def best(runs: LoadControlRuns, reading: str) -> Table:
    """Table of the paper's proposal and combinations with preview, with measurement errors."""
    c = runs.readings[reading]
    table = schemes_table(c, ("cpfc", *PREVIEWS), f"The paper's CPFC and preview, {reading}")
    std, load = (100.0 * c.ceiling_change(2, name).mean for name in ("std", "load"))
    limit = f"Ideal removal of 1P and 2P: std of RootMyc1 {std:+.1f} %, DEL {load:+.1f} %."
    return replace(table, note=f"{table.note} {limit}")


LIDAR, DIVISION = sentence("lidar", slow=SLOW, decay=DECAY, lost=100 * LOST), sentence("division")


def not_detuned(runs: LoadControlRuns) -> str:
    """Text on CPFC as in the paper: flaps added to an unchanged IPC."""
    b, c = runs.bench, runs.readings[CLASS_B]
    margin, tuned = (margins(b.linear, b.loops(s), sample_time=default_step(b.model))[1] for s in (ADDED, "cpfc"))
    std, load, plane = (percent(change(c, name, ADDED)) for name in ("RootMyc1 std", "RootMyc1 DEL", "RootMxc1 DEL"))
    return sentence("not detuned", added=ADDED, std=std, load=load, margin=margin, tuned=tuned, plane=plane)


def division(runs: LoadControlRuns, *, edge: bool = True) -> Table:
    """Designs with different divisions of the frequencies: overlap, margins and loads.

    Args:
      runs: results of the schemes.
      edge: show the edgewise mode, whose frequency is that of the paper's turbine.
    """
    b, c = runs.bench, runs.readings[CLASS_B]
    dt, speed = default_step(b.model), b.linear[0].point.rotor_speed
    rows = []
    for scheme in ("cpc", "ipc", "cpfc", *b.designs):
        loops = b.loops(scheme)
        mode = [f"{edgewise(c, scheme) * 1e-3:.0f}"] if edge else []
        travel = [f"{duty(c, name, scheme):.2f}" for name in ("pitch travel", "flap travel")]
        if not loops:
            rows.append([scheme, *[""] * 5, *mode, *travel])
            continue
        gains = [
            abs(response("band_pass", (3 - loop.harmonic) * speed, loop.harmonic * speed, loop.filter_damping, dt))
            for loop in loops
        ]
        phase, gain = margins(b.linear, loops, sample_time=dt)
        margin = f"{gain:.1f}, {np.degrees(phase):.0f}" if gain > 1.0 else "unstable"
        words = [percent(change(c, name, scheme)) for name in ("RootMyc1 std", "RootMyc1 DEL", "RootMxc1 DEL")]
        rows.append([scheme, ", ".join(f"{x:.2f}" for x in gains), margin, *words, *mode, *travel])
    head = ["design", "1P filter at 2P,\n2P filter at 1P", "gain margin, phase\nmargin deg"]
    head += ["RootMyc1 std", "RootMyc1 DEL", "RootMxc1 DEL", *(["RootMxc1 std\n0.95 to 1.3 Hz\nkN m"] if edge else [])]
    head += ["pitch travel\ndeg/s", "flap travel\ndeg/s"]
    note = f"{CLASS_B}, {len(c.winds)} seeds. Whole lead: proportional parts that take back all of the filters' delay."
    return Table(head, rows, f"Designs of the loops at {SPEED:g} m/s", note=note)


def equal_travel(runs: LoadControlRuns) -> Table:
    """Flap loops at equal actuator travel, in winds used for tuning only."""
    load, allowed = runs.travel["cpfc"]
    rows = []
    for name, (other, travel) in runs.travel.items():
        fits = "yes" if travel <= allowed else "no"
        share = f"{100.0 * (other / load - 1.0):+.1f} %"
        rows.append([name, number(other * 1e-3), share, f"{np.degrees(travel):.2f}", "" if name == "cpfc" else fits])
    head = ["flap loops beside IPC", "RootMyc1 DEL\nkN m", "change\nagainst CPFC", "flap travel\ndeg/s"]
    head += ["no more travel"]
    note = sentence("travel", chosen=" and ".join(f"{100 * s:.0f} %" for s in runs.shares), name=TRAVEL)
    return Table(head, rows, "Flap loops at 1P and 2P with shares of their gains", note=note)


def below_rated(runs: LoadControlRuns) -> Table:
    """Loads and energy of the schemes below rated wind speed, with the pitch at its lower limit."""
    rows = []
    for u, c in runs.speeds.items():
        if u < 11.4 and isinstance(c, FailedResult):
            rows.append([f"{u:g}", f"failed: {c.why}"])
        elif u < 11.4:
            for scheme in c.schemes[1:]:
                names = ("RootMyc1 std", "RootMyc1 DEL", "TwrBsMyt DEL", "power mean")
                travel = (f"{duty(c, name, scheme):.2f}" for name in ("pitch travel", "flap travel"))
                rows.append([f"{u:g}", scheme, *(percent(change(c, name, scheme)) for name in names), *travel])
    head = ["wind\nm/s", "scheme", "RootMyc1 std", "RootMyc1 DEL", "TwrBsMyt DEL", "power"]
    head += ["pitch travel\ndeg/s", "flap travel\ndeg/s"]
    return Table(head, rows, "Below rated: changes against CPC", text_columns=2)


def at_speed(runs: LoadControlRuns, speed: float) -> Comparison:
    """Comparison of the schemes at a wind speed, in turbulence of the wind class."""
    return runs.readings[CLASS_B] if speed == SPEED else runs.speeds[speed]


def lifetime_speeds(runs: LoadControlRuns) -> list[float]:
    """Simulated wind speeds [m/s] for the lifetime loads."""
    return sorted({u for u in (*runs.speeds, SPEED) if u in LIFETIME_SPEEDS})


def lifetime(runs: LoadControlRuns) -> Table:
    """Table of lifetime damage-equivalent loads, energy and actuator duty."""
    speeds = lifetime_speeds(runs)
    rows, base = [], dict[str, float]()
    for scheme in ALL_SPEEDS:
        row = [scheme]
        loads = {name: lifetime_load(runs, scheme, name) for name in LOADS}
        for name, value in loads.items():
            base.setdefault(name, value)
            row += [number(value * 1e-3), "" if scheme == "cpc" else f"{100.0 * (value / base[name] - 1.0):+.1f} %"]
        energy = lifetime_mean(runs, scheme, "power mean")
        base.setdefault("energy", energy)
        row.append("" if scheme == "cpc" else f"{100.0 * (energy / base['energy'] - 1.0):+.2f} %")
        pitch, flap = (lifetime_mean(runs, scheme, name) for name in ("pitch travel", "flap travel"))
        saved = 1.0 - loads["RootMyc1 DEL"] / base["RootMyc1 DEL"]
        base.setdefault("pitch", pitch)
        price = "" if saved <= 0.0 else f"{np.degrees(pitch - base['pitch']) / (100.0 * saved):.3f}"
        row += [f"{np.degrees(pitch):.2f}", f"{np.degrees(flap):.2f}", price]
        rows.append(row)
    head = ["scheme"]
    for name in LOADS:
        head += [f"{name}\nkN m", "change"]
    head += ["energy\nchange", "pitch travel\ndeg/s", "flap travel\ndeg/s", "more pitch travel\nper % of RootMyc1 DEL"]
    caption = f"Lifetime in class II (Rayleigh, {MEAN_WIND:g} m/s) from {', '.join(f'{u:g}' for u in speeds)} m/s"
    return Table(head, rows, caption, note=sentence("lifetime"))


def lifetime_load(runs: LoadControlRuns, scheme: str, name: str) -> float:
    """Lifetime damage-equivalent load [N m] at 1 Hz."""
    speeds = lifetime_speeds(runs)
    slope = LOADS[name]
    loads = [ensemble_load(at_speed(runs, u).values(name, scheme), slope) for u in speeds]
    return lifetime_del(speeds, loads, slope=slope, mean_speed=MEAN_WIND)


def lifetime_mean(runs: LoadControlRuns, scheme: str, name: str) -> float:
    """Mean of a quantity [SI] over the wind speed distribution."""
    speeds = lifetime_speeds(runs)
    values = [at_speed(runs, u).values(name, scheme).mean() for u in speeds]
    return float(np.average(values, weights=rayleigh_weights(speeds, MEAN_WIND)))


def winds(runs: LoadControlRuns) -> Table:
    """Changes and upper limits in other winds and with a stiffer blade."""

    def row(name: str, c: Comparison) -> list[str]:
        base = number(float(c.values("RootMyc1 std", "cpc").mean()) * 1e-3)
        changes = [
            float(change(c, quantity, scheme).mean())
            for quantity in ("RootMyc1 std", "RootMyc1 DEL")
            for scheme in ("ipc", "cpfc")
        ]
        limits = [100.0 * c.ceiling_change(n, "std").mean for n in (1, 2)]
        return [name, base, *(f"{x:+.1f} %" for x in (*changes, *limits)), likelihood(c)]

    rows = [
        guarded(partial(row, name, c), lambda why, name=name: [name, f"failed: {why}"])  # type: ignore[misc]
        for name, c in {**runs.judged, **runs.studies}.items()
    ]
    head = ["wind or model", "CPC std\nkN m", "IPC std\n(-47.9 %)", "CPFC std\n(-55.3 %)", "IPC DEL\n(-42.2 %)"]
    head += ["CPFC DEL\n(-53.7 %)", "ceiling 1P\nstd", "ceiling 1P, 2P\nstd", "probability"]
    caption = f"RootMyc1 at {SPEED:g} m/s in other winds; the paper's figures in parentheses"
    return Table(head, rows, caption, note=sentence("probability"))


def lifetime_words(runs: LoadControlRuns) -> str:
    """Sentence on the load reduction of the blades by the schemes, and the pitch travel for it."""
    loads = {s: lifetime_load(runs, s, "RootMyc1 DEL") for s in ALL_SPEEDS}
    saved = {s: 100.0 * (1.0 - loads[s] / loads["cpc"]) for s in ALL_SPEEDS}
    travel = {s: lifetime_mean(runs, s, "pitch travel") for s in ALL_SPEEDS}
    one, two = (travel[s] / travel["cpc"] for s in ("ipc", "ipc2"))
    return sentence("saved", **saved, one=one, two=two)


def energy_words(runs: LoadControlRuns) -> str:
    """Sentence on the energy lost by the schemes."""
    energy = {s: lifetime_mean(runs, s, "power mean") for s in ALL_SPEEDS}
    names = {"ipc": "IPC", "cpfc": "CPFC", "flaps12": "flaps alone"}
    return ", ".join(f"{name} {100.0 * (1.0 - energy[s] / energy['cpc']):.1f} %" for s, name in names.items())


def findings_text(runs: LoadControlRuns) -> str:
    """Effects of the schemes on any turbine, without a recommendation."""
    pitch, flaps = (percent(change(runs.readings[CLASS_B], "RootMyc1 DEL", scheme)) for scheme in ("ipc2", "cpfc"))
    numbers = {"lifetime": lifetime_words(runs), "energy": energy_words(runs)}
    return sentence("findings", speed=SPEED, pitch=pitch, flaps=flaps, **numbers)


def verdict(runs: LoadControlRuns) -> str:
    """Recommended scheme for the paper's turbine, from the results."""
    c = runs.readings[CLASS_B]
    pitch, flaps = (mean_interval(change(c, "RootMyc1 DEL", scheme)).mean for scheme in ("ipc2", "cpfc"))
    numbers = {"lifetime": lifetime_words(runs), "energy": energy_words(runs)}
    return sentence("verdict", speed=SPEED, pitch=pitch, flaps=flaps, **numbers)
