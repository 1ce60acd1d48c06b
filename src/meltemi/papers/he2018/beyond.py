"""Results beyond the paper: alternatives to flaps, other wind speeds, lifetime loads, actuator duty, preview, winds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from meltemi.control_laws.filters import response
from meltemi.controllers.tuning import margins
from meltemi.papers.he2018.designs import ADDED, DECAY, LOST, SLOW
from meltemi.papers.he2018.measures import change, edgewise, likelihood, percent
from meltemi.papers.he2018.runs import (
    ALL_SPEEDS,
    CLASS_B,
    PAPER,
    PARTS,
    PREVIEWS,
    RIVALS,
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


LIDAR = (
    "The preview is ideal where nothing else is said: the wind averaged over the rotor, known 1.1 s ahead (4.1 s at "
    f"{SLOW:g} rad/s). Its errors have assumed sizes: 4 beams at 0.7 of the radius; a coherence of exp(-{DECAY:g} s f) "
    f"between the wind measured and the wind at the rotor; {100 * LOST:.0f} % of the seconds lost, in which the last "
    "value is held. Four beams see eddies smaller than the rotor; the slow filter is for them."
)
DIVISION = (
    "The paper divides the load by frequency: 1P to the pitch, 2P to the flaps. In ours the coordinates of each "
    "harmonic and the integrators divide it, not the filters, which are as wide as actuator and turbine are slow, and "
    "overlap: both loops act on the same tones, and share their margins. That costs a part of the gains, which are "
    "lowered together. Flaps beside a pitch loop that stays as it is leave less margin. What can make them unstable is "
    "the first edgewise mode, at 1.1 Hz, not the overlap: with the same filters and integral gains it takes "
    "proportional parts that take back the whole delay of the filters. Narrow filters separate the loops further, and "
    "delay them."
)


def not_detuned(runs: LoadControlRuns) -> str:
    """Table of CPFC as in the paper, flaps added to an unchanged IPC, and the effort."""
    b, c = runs.bench, runs.readings[CLASS_B]
    margin = {s: margins(b.linear, b.loops(s), sample_time=default_step(b.model))[1] for s in ("cpfc", ADDED)}
    std, load, plane = (percent(change(c, name, ADDED)) for name in ("RootMyc1 std", "RootMyc1 DEL", "RootMxc1 DEL"))
    return (
        f"The paper adds flaps to an IPC that stays as it is. Ours so ({ADDED!r}) changes the standard deviation of "
        f"RootMyc1 by {std} and its equivalent load by {load}, with a gain margin of {margin[ADDED]:.1f} where CPFC "
        f"has {margin['cpfc']:.1f}; in plane the equivalent load changes by {plane}."
    )


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
        passed, reserve = "", ""
        if loops:
            gains = [
                abs(response("band_pass", (3 - loop.harmonic) * speed, loop.harmonic * speed, loop.filter_damping, dt))
                for loop in loops
            ]
            passed = ", ".join(f"{gain:.2f}" for gain in gains)
            phase, gain = margins(b.linear, loops, sample_time=dt)
            reserve = f"{gain:.1f}, {np.degrees(phase):.0f}" if gain > 1.0 else "unstable"
        words = [percent(change(c, name, scheme)) for name in ("RootMyc1 std", "RootMyc1 DEL", "RootMxc1 DEL")]
        mode = [f"{edgewise(c, scheme) * 1e-3:.0f}"] if edge else []
        travel = (f"{duty(c, name, scheme):.2f}" for name in ("pitch travel", "flap travel"))
        rows.append([scheme, passed, reserve, *(words if loops else [""] * 3), *mode, *travel])
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
    head = [
        "flap loops beside IPC",
        "RootMyc1 DEL\nkN m",
        "change\nagainst CPFC",
        "flap travel\ndeg/s",
        "no more travel",
    ]
    chosen = " and ".join(f"{100 * s:.0f} %" for s in runs.shares)
    return Table(
        head,
        rows,
        "Flap loops at 1P and 2P with shares of their gains",
        note=f"Chosen, as the least load at no more flap travel than CPFC: {chosen} of the gains at 1P and 2P. It is "
        f"judged in other winds as {TRAVEL!r}.",
    )


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
    return Table(
        head,
        rows,
        f"Lifetime in class II (Rayleigh, {MEAN_WIND:g} m/s) from {', '.join(f'{u:g}' for u in speeds)} m/s",
        note="Loads: damages summed over wind speeds and seeds. Travel and energy: means over the distribution.",
    )


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
    note = (
        "Probability: of a minute as far from the mean of all minutes as the paper's, in its eight changes of standard "
        "deviations and equivalent loads together (Hotelling's test)."
    )
    caption = f"RootMyc1 at {SPEED:g} m/s in other winds; the paper's figures in parentheses"
    return Table(head, rows, caption, note=note)


def lifetime_words(runs: LoadControlRuns) -> str:
    """Sentence on the load reduction of the blades by the schemes, and the pitch travel for it."""
    loads = {s: lifetime_load(runs, s, "RootMyc1 DEL") for s in ALL_SPEEDS}
    saved = {s: 100.0 * (1.0 - loads[s] / loads["cpc"]) for s in ALL_SPEEDS}
    travel = {s: lifetime_mean(runs, s, "pitch travel") for s in ALL_SPEEDS}
    return (
        f"Over a lifetime IPC takes {saved['ipc']:.1f} % of the equivalent root moment for "
        f"{travel['ipc'] / travel['cpc']:.1f} times the pitch travel, CPFC {saved['cpfc']:.1f} %, 2P individual pitch "
        f"instead of flaps {saved['ipc2']:.1f} % at {travel['ipc2'] / travel['cpc']:.1f} times the travel."
    )


def energy_words(runs: LoadControlRuns) -> str:
    """Sentence on the energy lost by the schemes."""
    energy = {s: lifetime_mean(runs, s, "power mean") for s in ALL_SPEEDS}
    names = {"ipc": "IPC", "cpfc": "CPFC", "flaps12": "flaps alone"}
    return ", ".join(f"{name} {100.0 * (1.0 - energy[s] / energy['cpc']):.1f} %" for s, name in names.items())


def findings_text(runs: LoadControlRuns) -> str:
    """Effects of the schemes on any turbine, without a recommendation."""
    changes = [percent(change(runs.readings[CLASS_B], "RootMyc1 DEL", scheme)) for scheme in ("ipc2", "cpfc")]
    return (
        f"{lifetime_words(runs)} At {SPEED:g} m/s 2P pitch changes it by {changes[0]}, 2P flaps by {changes[1]}. "
        f"Energy over a lifetime: {energy_words(runs)} less than with CPC."
    )


def verdict(runs: LoadControlRuns) -> str:
    """Recommended scheme for the paper's turbine, from the results."""
    c = runs.readings[CLASS_B]
    two = mean_interval(change(c, "RootMyc1 DEL", "ipc2"))
    flaps = mean_interval(change(c, "RootMyc1 DEL", "cpfc"))
    return (
        f"{lifetime_words(runs)} At "
        f"{SPEED:g} m/s 2P pitch ({two.mean:+.1f} %) and 2P flaps ({flaps.mean:+.1f} %) are equal in load. So on a "
        "turbine whose pitch bearings can take the 1P travel at all, the first step is 1P individual pitch: most of "
        "the gain, no new hardware. The second is preview of the wind, which relieves the tower and the speed and "
        "costs no travel. 2P is worth a flap only where the flap is there already, since 2P by pitch gives the same "
        "for more pitch travel and without a moving part in the blade. Flaps alone at 1P and 2P spare the pitch "
        f"bearings altogether. All cost energy ({energy_words(runs)} over a lifetime), all of it below rated, where "
        "there is little load to save: there the loops should fade out."
    )
