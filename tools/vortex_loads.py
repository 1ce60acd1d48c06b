"""Loads with vortex wakes beside momentum theory, made from one command:

    python tools/vortex_loads.py RUNS [--seeds 5]

RUNS is a JSON file with the numbers of finished runs, which are not repeated. The same wind, by seed, acts with each
wake. Prints the tables of docs/verification/vortices_loads.part.md and writes its figure.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

import meltemi
from meltemi.analyses.performance import RIGID
from meltemi.control import ConstantController
from meltemi.iec.gusts import eog
from meltemi.postprocess.fatigue import damage_equivalent_load
from meltemi.postprocess.statistics import once_per_revolution
from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import new_figure
from meltemi.simulation.case import Case
from meltemi.simulation.step import settle_induction
from meltemi.verification.table import reference_table
from meltemi.verification.uae import PITCH, phase_vi

FIGURE = Path(__file__).resolve().parents[1] / "docs" / "verification" / "vortices_loads.png"
MINUS = "\N{MINUS SIGN}"
FLAP = "root_moment_flap_1"
MEANS = {
    "power": "generator_power",
    "torque": "rotor_torque",
    "thrust": "rotor_aero_thrust",
    "mean flap": FLAP,
    "yaw moment": "yaw_moment_z",
}
FATIGUE = {
    "flap": (FLAP, 10.0),
    "edge": ("root_moment_edge_1", 10.0),
    "tower fore-aft": ("tower_base_moment_fore_aft", 4.0),
    "yaw bearing, tilt": ("yaw_moment_y", 4.0),
    "yaw bearing, yaw": ("yaw_moment_z", 4.0),
}
WAKES: dict[str, dict[str, Any]] = {
    "momentum": {},
    "no skew": {"skew": "none"},
    "cylinder": {"skew_momentum": "cylinder"},
    "near": {"wake": "near"},
    "hybrid": {"wake": "hybrid"},
    "free": {"wake": "free"},
}
"""Options by name of the wake; "no skew" and "cylinder" are momentum without Glauert's skew factor, and with the mean
induction of a skewed vortex cylinder."""
ALL = tuple(WAKES)
SWEEPS = 60
"""Of a wake beyond those of a start."""
STD = "std rotor_aero_thrust"
PERIOD = 60.0 / 12.1
"""[s] of a revolution of the rigid rotor."""
OLAF = (20.0, -184.0)
"""Yaw [deg] and sine of the flap moment [kN m] by OLAF at 10 m/s."""


@dataclass(frozen=True)
class Study:
    """A turbine in the same wind with several wakes; the wind is given by its seed."""

    name: str
    wind: Callable[[int], Any]
    turbine: str = "nrel5mw"
    yaw: float = 0.0
    seeds: int = 1
    wakes: tuple[str, ...] = ALL
    transient: float = 60.0
    duration: float = 300.0
    sea: Any = None
    period: float = 0.0
    """[s] of a revolution of a rigid rotor with static polars, without influence of the tower; 0 if flexible."""
    pitch: float = 0.0

    def run(self, wind: Any, wake: str) -> meltemi.Result:
        """The run with a wake."""
        options = {"nacelle_yaw": np.radians(self.yaw), **WAKES[wake]}
        given: dict[str, Any] = {} if self.sea is None else {"sea": self.sea}
        if self.period:
            options |= {"locked": RIGID, "stall": "static", "tower_influence": "none", "time_step": self.period / 288.0}
            start = meltemi.Start(rotor_speed=2.0 * np.pi / self.period, pitch=self.pitch, coordinates={})
            given |= {"controller": ConstantController(), "start": start}
        turbine = phase_vi() if self.turbine == "uae" else meltemi.load_turbine(self.turbine)
        model = meltemi.build(turbine, meltemi.ModelOptions(**options))
        return meltemi.simulate(
            model, wind, duration=self.transient + self.duration, transient=self.transient,
            output_step=self.period / 36.0 or 0.05, **given,
        )  # fmt: skip


def turbulence(speed: float) -> Callable[[int], Any]:
    """Wind of 14 % turbulence with a shear exponent of 0.2, by seed."""
    return lambda seed: meltemi.TurbulentWind(speed=speed, intensity=0.14, seed=seed)


def uniform(speed: float) -> Callable[[int], Any]:
    """Steady wind without shear, for any seed."""
    return lambda seed: meltemi.SteadyWind(speed=speed, shear_exponent=0.0)


def rotor(name: str, wind: float, yaw: float, period: float, **given: Any) -> Study:
    """A rigid rotor in uniform wind over its last nine revolutions of thirty."""
    return Study(name, uniform(wind), yaw=yaw, period=period, transient=21.0 * period, duration=9.0 * period, **given)


def gust(seed: int) -> Any:
    """Extreme operating gust of class IB at rated wind, 60 s after the start."""
    return eog(meltemi.load_turbine("nrel5mw"), 11.4, "IB", begin=60.0)


def studies(seeds: int) -> list[Study]:
    """All of the page: turbulence without and with yaw, a larger rotor, a floater in swell, a gust."""
    cases = [(u, yaw) for u in (8.0, 11.0, 16.0) for yaw in (0.0, 20.0)]
    swell = meltemi.environment.RegularSea(height=4.0, period=12.0)
    rigid = [(10.0, yaw) for yaw in (-20.0, 0.0, 10.0, 20.0, 30.0)] + [(12.0, 0.0), (12.0, 20.0)]
    return [
        *(rotor(f"rigid, {u:g} m/s, {yaw:g} deg", u, yaw, PERIOD) for u, yaw in rigid),
        *(rotor(f"UAE, {yaw:g} deg", 7.0, yaw, 60.0 / 72.0, turbine="uae", pitch=PITCH) for yaw in (10.0, 20.0, 30.0)),
        Study("EOG, 11.4 m/s", gust, transient=55.0, duration=40.0),
        Study("floater in swell, 9 m/s", lambda seed: meltemi.SteadyWind(speed=9.0), "iea15mw-volturnus",
              transient=200.0, duration=120.0, sea=swell),
        *(Study(f"{u:g} m/s, {yaw:g} deg", turbulence(u), yaw=yaw, seeds=seeds, wakes=ALL if u == 8.0 else ALL[:-1])
          for u, yaw in cases),
        Study("IEA 22 MW, 9 m/s, 0 deg", turbulence(9.0), "iea22mw", seeds=seeds, wakes=("momentum", "near", "hybrid")),
    ]  # fmt: skip


def measures(result: meltemi.Result, duration: float) -> dict[str, float]:
    """Means, equivalent and extreme loads, and the parts of the flap moment at the frequency of the rotor."""
    x = result.evaluated
    values = {name: float(x[channel].mean()) for name, channel in MEANS.items()}
    for name, (channel, slope) in FATIGUE.items():
        values[f"DEL {name}"] = damage_equivalent_load(x[channel], duration=duration, slope=slope)
        values[f"max {name}"] = float(x[channel].max())
    values["1P cosine"], values["1P sine"] = once_per_revolution(x, [FLAP])[FLAP]
    for name in ("rotor_aero_thrust", "platform_pitch"):
        if name in x:
            values[f"std {name}"] = float(x[name].std())
    return values


def ratio(runs: dict[str, dict[str, float]], study: Study, wake: str, key: str) -> str:
    """Change against momentum [%] with the same seed: mean, and half of the 95 % interval over the seeds."""
    mean, half = change(runs, study, wake, key)
    text = f"{100.0 * mean:+.1f}" + (f" ± {100.0 * half:.1f}" if study.seeds > 1 else "")
    return text.replace("-", MINUS)


def change(runs: dict[str, dict[str, float]], study: Study, wake: str, key: str) -> tuple[float, float]:
    """Mean relative change against momentum with the same seed, and half of its 95 % interval (t-distribution)."""
    seeds = [k.rsplit("|", 1)[1] for k in runs if k.startswith(f"{study.name}|{wake}|")]
    values = [runs[f"{study.name}|{wake}|{s}"][key] / runs[f"{study.name}|momentum|{s}"][key] - 1.0 for s in seeds]
    n = len(values)
    half = float(stats.t.ppf(0.975, n - 1) * np.std(values, ddof=1) / np.sqrt(n)) if n > 1 else 0.0
    return float(np.mean(values)), half


def table(runs: dict[str, dict[str, float]], columns: list[tuple[Study, str]], keys: list[str]) -> str:
    """Markdown of the changes: quantities by studies and wakes."""
    lines = ["| change [%] |" + "".join(f" {study.name}, {wake} |" for study, wake in columns)]
    lines.append("|---|" + "---|" * len(columns))
    lines += [f"| {key} |" + "".join(f" {ratio(runs, *column, key)} |" for column in columns) for key in keys]
    return "\n".join(lines) + "\n"


def once(runs: dict[str, dict[str, float]], listed: list[Study]) -> str:
    """Markdown of cosine and sine of the flap moment [kN m], and of the mean yaw moment."""
    lines = ["| cosine, sine, yaw moment [kN m] |" + "".join(f" {study.name} |" for study in listed)]
    lines.append("|---|" + "---|" * len(listed))
    for wake in WAKES:
        cells = []
        for study in listed:
            found = [v for k, v in runs.items() if k.startswith(f"{study.name}|{wake}|")]
            names = ("1P cosine", "1P sine", "yaw moment")
            cells.append(
                ", ".join(f"{1e-3 * np.mean([f[name] for f in found]):.0f}" for name in names) if found else "-"
            )
        lines.append(f"| {wake} | " + " | ".join(cells) + " |")
    return "\n".join(lines).replace("-", MINUS).replace(f"|{MINUS * 3}", "|---") + "\n"


def run_all(listed: list[Study], file: Path) -> dict[str, dict[str, float]]:
    """Numbers of all runs by "study|wake|seed"; each is written when it is finished."""
    runs = json.loads(file.read_text()) if file.exists() else {}
    for seed in range(1, max(study.seeds for study in listed) + 1):
        for study in (each for each in listed if seed <= each.seeds):
            wind = study.wind(seed)
            for wake in study.wakes:
                key = f"{study.name}|{wake}|{seed}"
                if key in runs:
                    continue
                result = study.run(wind, wake)
                runs[key] = measures(result, study.duration)
                print(key, {k: f"{v:.4g}" for k, v in runs[key].items()}, flush=True)
                file.write_text(json.dumps(runs, indent=1))
    return runs


def skewed(runs: dict[str, dict[str, float]], listed: list[Study]) -> str:
    """Markdown of the sine of the flap moment [kN m] of rigid rotors, and the part of Glauert's factor that fits."""
    wakes = ("momentum", "no skew", "near", "hybrid", "free")
    lines = ["| | " + " | ".join(wakes) + " | part, hybrid | part, free |", "|---|" + "---|" * (len(wakes) + 2)]
    for study in (s for s in listed if s.period and s.yaw):
        sine = {wake: 1e-3 * runs[f"{study.name}|{wake}|1"]["1P sine"] for wake in wakes}
        span = sine["momentum"] - sine["no skew"]
        parts = [(sine[wake] - sine["no skew"]) / span for wake in ("hybrid", "free")]
        lines.append(f"| {study.name} | " + " | ".join([f"{v:.3g}" for v in [*sine.values(), *parts]]) + " |")
    return "\n".join(lines) + "\n"


def measured() -> str:
    """Markdown: torque, thrust and normal coefficients of UAE Phase VI at 7 m/s, deviation from the measured [%]."""
    record = reference_table("uae_performance", sequence="H", wind="7")[0]
    sections = reference_table("uae_spanwise", wind="7")
    wind, speed, density = (float(record[name]) for name in ("wind", "rotor_speed", "density"))
    lines = ["| deviation [%] | torque | thrust |" + "".join(f" {s['position']} R |" for s in sections)]
    lines.append("|---|" + "---|" * (2 + len(sections)))
    for wake in ("momentum", "near", "hybrid", "free"):
        options = meltemi.ModelOptions(
            locked=RIGID, stall="static", tower_influence="none", blade_nodes=40, **WAKES[wake]
        )
        case = Case(model := meltemi.build(phase_vi(), options), uniform(wind)(0))
        meltemi.Start(rotor_speed=speed * np.pi / 30.0, pitch=PITCH, coordinates={}).put(case)
        case.evaluate(0.0)
        for _ in range(SWEEPS if wake in ("hybrid", "free") else 0):
            settle_induction(case.system)
            case.evaluate(0.0)
        rotor, flow = case.view("rotor"), case.view("flow")
        alpha, lift, drag = (flow[name][0] for name in ("alpha", "lift", "drag"))
        normal = lift * np.cos(alpha) + drag * np.sin(alpha)
        air, place = density / model.environment.density, flow["radius"][0] / model.turbine.rotor_radius
        values = [air * rotor[name] / float(record[name]) for name in ("torque", "thrust")]
        values += [np.interp(float(s["position"]), place, normal) / float(s["normal"]) for s in sections]
        lines.append(f"| {wake} | " + " | ".join(f"{100.0 * (float(v) - 1.0):+.1f}" for v in values) + " |")
    return "\n".join(lines).replace(" -", f" {MINUS}") + "\n"


def draw(runs: dict[str, dict[str, float]], listed: list[Study]) -> None:
    """Change of equivalent loads with the hybrid wake, and the sine of the flap moment over yaw."""
    figure, axes = new_figure(1, 2, size=(9.5, 4.2), share=False)
    left, right = axes.flat
    turbulent = [s for s in listed if s.seeds > 1 and s.turbine == "nrel5mw"]
    for i, study in enumerate(turbulent):
        values = 100.0 * np.array([change(runs, study, "hybrid", f"DEL {name}") for name in FATIGUE])
        place = np.arange(len(FATIGUE)) + 0.12 * (i - 2.5)
        colour, mark = COLOURS[i // 2], "s" if study.yaw else "o"
        left.errorbar(place, values[:, 0], values[:, 1], fmt=mark, ms=4, capsize=2, color=colour, label=study.name)
    left.axhline(0.0, color=INK, lw=0.8)
    left.set_xticks(range(len(FATIGUE)), [name.replace(", ", ",\n").replace(" fore", "\nfore") for name in FATIGUE])
    left.set_ylabel("change of the equivalent load [%]")
    left.legend(fontsize=7, ncols=2)
    straight = [s for s in listed if s.name.startswith("rigid, 10 m/s")]
    lines = {
        wake: [1e-3 * runs[f"{s.name}|{wake}|1"]["1P sine"] for s in straight] for wake in ALL if wake != "cylinder"
    }
    lines["half of Glauert's factor"] = [
        0.5 * (a + b) for a, b in zip(lines["momentum"], lines["no skew"], strict=True)
    ]
    for i, (wake, values) in enumerate(lines.items()):
        style = "--" if i in (0, 1, 5) else "-"
        right.plot([s.yaw for s in straight], values, style, marker="o", ms=3, color=COLOURS[i], label=wake)
    right.plot(*OLAF, "*", ms=10, color=INK, label="OLAF")
    right.set_xlabel("yaw [deg]")
    right.set_ylabel("sine of the flap moment [kN m]")
    right.legend(fontsize=7)
    figure.savefig(FIGURE, dpi=110)


def main() -> None:
    """Run all that is missing, print the tables and write the figure."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("runs", type=Path)
    options.add_argument("--seeds", type=int, default=5)
    given = options.parse_args()
    listed = studies(given.seeds)
    runs = run_all(listed, given.runs)
    keys = ["power", "thrust", "mean flap", *(f"DEL {name}" for name in FATIGUE)]
    turbulent = [s for s in listed if s.seeds > 1 and s.turbine == "nrel5mw"]
    large = [s for s in listed if s.turbine == "iea22mw"]
    for wake in ("near", "hybrid"):
        print(table(runs, [(s, wake) for s in turbulent + large], keys))
    slow = [s for s in turbulent if "free" in s.wakes]
    print(table(runs, [(s, "free") for s in slow] + [(s, "cylinder") for s in turbulent if s.yaw], keys))
    print(once(runs, turbulent))
    single = [(s, wake) for s in listed if s.seeds == 1 and not s.period for wake in ("near", "hybrid", "free")]
    print(table(runs, single, [*keys, "max flap", "max tower fore-aft", STD]))
    print(skewed(runs, listed))
    print(measured())
    draw(runs, listed)


if __name__ == "__main__":
    main()
