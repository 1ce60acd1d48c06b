"""The page of load bases under collective, individual and combined control, made from one command:

    python tools/control_bases.py [--quick] [--short] [--seeds N] [--schemes supervised,ipc] [--work DIR] [TURBINE ...]

For each turbine and scheme a load base is planned, run (what is finished is not repeated) and evaluated. Cases that do
not depend on the scheme, such as parked ones, are computed once: each base begins with the results of the ones before.
Writes docs/verification/control-bases.md and a picture a turbine; turbines that are not named keep their section.
"""

from __future__ import annotations

import argparse
import math
import shutil
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import meltemi
from meltemi.loads.loadbase.campaign import FILE, make_campaign, read_campaign, write_campaign
from meltemi.loads.loadbase.design import DesignLoads, design_loads
from meltemi.loads.loadbase.engine import base_status, run_base
from meltemi.loads.loadbase.plan import plan, write_plan
from meltemi.loads.loadbase.store import FOLDER

PAGES = Path(__file__).resolve().parents[1] / "docs" / "verification"
SCHEMES = {"supervised": "collective", "ipc": "individual", "cpfc": "combined"}
"""Controllers, and their words; all have the same supervisor and collective law."""
FATIGUE = {
    "blade root, out of plane": ("root_moment_out_of_plane_1", 10.0),
    "blade root, in plane": ("root_moment_in_plane_1", 10.0),
    "shaft, rotating bending": ("shaft_moment_y", 4.0),
    "yaw bearing, tilt": ("yaw_moment_y", 4.0),
    "yaw bearing, yaw": ("yaw_moment_z", 4.0),
    "tower base, fore-aft": ("tower_base_moment_fore_aft", 4.0),
    "tower base, side to side": ("tower_base_moment_side_side", 4.0),
}
ULTIMATE = {
    "blade root": "blade_root",
    "rotating hub": "hub_rotating",
    "yaw bearing": "yaw_bearing",
    "tower base": "tower_base",
}


HEAD = """# Load bases under three control schemes

Design loads of a load base of IEC 61400-1 (edition 4, class IB) under collective pitch control, with individual pitch
at 1P and feed-forward (`ipc`), and with flaps at 2P in addition (`cpfc`: the combined pitch and flap control of He et
al. 2018). Supervisor, collective law, winds and seeds are the same; the loops are [tuned for
margins](../theory/control.md) of each turbine, its flaps are those of He et al. (2018).
"""
QUICK = """!!! warning
    These are numbers of **quick bases**: one seed and three wind speeds of each load case{seconds}. They show that
    the chain works, and are no design loads.
"""
USE = """```sh
{command}
```

The same by hand, for one base, and the comparison of two in full:

```sh
meltemi loads plan nrel5mw --class IB --controller ipc --out nrel5mw-ipc
cp nrel5mw-supervised/results/*.parquet nrel5mw-ipc/results/   # parked cases are the same: not run twice
meltemi loads run nrel5mw-ipc
meltemi loads report nrel5mw-ipc --against nrel5mw-supervised
meltemi loads compare nrel5mw-supervised nrel5mw-ipc
```
"""
FOOT = """## Reading the tables

Ultimate loads are resultant moments with partial safety factors, of the cases in operation (DLC 1 to 5) and of the
parked and locked ones (DLC 6 to 8), which do not depend on the scheme. Lifetime loads are ranges for 10⁷ cycles,
slope 10 (blades) and 4 (other components); travel is the mean of the blades.

The locked rotor of the IEA 15 MW is unstable at 40 m/s and 45° (edgewise vibration, by stall; each case says so): its
loads in DLC 7.1 and 6.2 are no loads to design for, but a reason to lock and yaw it otherwise.

In DLC 1.3 at 3 m/s the wind falls to zero for a minute. The rotor of the IEA 15 MW slows to 4.6 rpm, where three times
its speed meets the tower's first frequency (0.22 Hz), whose damping without wind is 0.3 %: the side-to-side moment of
the tower base reaches 390 MN m under collective control (without safety factor), 460 under individual control, and one
of nine cases ends at the limit of the tower-top acceleration.

Pitch drives of the IEA 15 MW move by 2 deg/s, which individual pitch at 1P often uses up (the cases say so), and then
the collective law has less: in DLC 1.3 generator overspeed stops none of 117 cases under collective control, five under
individual and three under combined control.

A tower clearance below zero is a blade that strikes. For DLC 1.1 the deflection towards the tower is extrapolated to
50 years by a Gumbel distribution, which knows nothing of the pitch that bounds the thrust above rated wind, and is the
more pessimistic the more the maxima of the seeds scatter: compare its band in the report, and the other cases."""


SHORT = {"duration": 40.0, "transient": 20.0, "begin": 10.0}
"""[s] of cases that only try whether everything works."""


def base(turbine: str, scheme: str, work: Path, settings: dict[str, Any], before: list[Path]) -> DesignLoads:
    """The evaluated load base of a turbine under a scheme."""
    folder = work / f"{turbine}-{scheme}"
    folder.mkdir(parents=True, exist_ok=True)
    if not (folder / FILE).is_file():
        write_campaign(make_campaign(turbine, "IB", controller=scheme, **settings), folder)
        (folder / FOLDER).mkdir(exist_ok=True)
        for other in before:
            for file in (other / FOLDER).glob("*.parquet"):
                shutil.copy2(file, folder / FOLDER / file.name)
    planned = plan(read_campaign(folder))
    write_plan(planned, folder)
    status = base_status(planned, folder)
    print(f"{folder}: {status.done} of {status.total} cases done, {status.hours:.1f} h to be simulated", flush=True)
    run_base(planned, folder)
    return design_loads(planned, folder)


def values(found: DesignLoads) -> dict[tuple[str, str], float]:
    """Numbers of the page by kind and name, in its units."""
    rows = {("fatigue", name): 1e-6 * found.fatigue.at[c, m] for name, (c, m) in FATIGUE.items()}
    for name, interface in ULTIMATE.items():
        each = found.by_row.xs((interface, "M_res max"), level=("interface", "driver"))["design"]
        rows["ultimate", name] = 1e-6 * each[each.index.str[0] < "6"].max()
        rows["ultimate", f"{name}, parked and locked"] = 1e-6 * each[each.index.str[0] >= "6"].max()
    left = found.clearance["clearance"]
    rows["ultimate", "tower clearance, DLC 1.1 extrapolated"] = left.get("1.1", math.nan)
    rows["ultimate", "tower clearance, other cases"] = left.drop("1.1", errors="ignore").min()
    for kind, words in (("pitch_", "pitch"), ("flap_", "flap")):
        drives = [name for name in found.duties.index if name.startswith(kind)]
        travel = found.duties.loc[drives, "travel"].mean() if drives else 0.0
        rows["use", f"{words} travel"] = 1e-6 * math.degrees(travel)
    rows["use", "energy"] = found.energy.energy / 3.6e12 if found.energy else math.nan
    rows["use", "stops"] = found.stops["stops"].sum() if len(found.stops) else 0.0
    return rows


UNITS = {"fatigue": "MN m", "ultimate": "MN m"}
OTHERS = {"tower clearance, DLC 1.1 extrapolated": "m", "tower clearance, other cases": "m"}
OTHERS |= {"pitch travel": "10⁶ deg/year", "flap travel": "10⁶ deg/year"}
OTHERS |= {"energy": "GWh/year", "stops": "1/year"}
HEADS = {"fatigue": "Lifetime damage-equivalent loads", "ultimate": "Ultimate loads", "use": "Energy and actuators"}


def table(found: dict[str, dict[tuple[str, str], float]], kind: str) -> list[str]:
    """A table in Markdown: the schemes side by side, changes against the first one."""
    first, *rest = found
    lines = [
        "| | unit | " + " | ".join([SCHEMES[first], *(f"{SCHEMES[s]} | change" for s in rest)]) + " |",
        "|---|---|" + "---:|" * (2 * len(found) - 1),
    ]
    for name in (n for k, n in found[first] if k == kind):
        a, unit = found[first][kind, name], OTHERS.get(name) or UNITS[kind]
        cells = [f"{a:.4g}"]
        for scheme in rest:
            b = found[scheme][kind, name]
            change = f"{b - a:+.2f} m" if unit == "m" else f"{100.0 * (b / a - 1.0):+.1f} %" if a else "-"
            cells += [f"{b:.4g}", change]
        lines.append(f"| {name} | {unit} | " + " | ".join(cells) + " |")
    return lines


def picture(turbine: str, of: dict[str, dict[tuple[str, str], float]], path: Path) -> None:
    """Changes of lifetime and ultimate loads against collective control."""
    fig, ax = plt.subplots(figsize=(8.0, 4.4))
    first, *rest = of
    names = [key for key in of[first] if key[0] in UNITS and key[1] not in OTHERS and "parked" not in key[1]]
    y = np.arange(len(names))
    for i, scheme in enumerate(rest):
        change = [100.0 * (of[scheme][key] / of[first][key] - 1.0) for key in names]
        ax.barh(y + 0.38 * (i - 0.5), change, 0.36, label=SCHEMES[scheme])
    ax.set_yticks(y, [f"{name} ({'DEL' if kind == 'fatigue' else 'ultimate'})" for kind, name in names])
    ax.axvline(0.0, color="0.5", lw=0.8)
    ax.set(title=turbine, xlabel="change against collective control, %")
    ax.invert_yaxis()
    ax.legend()
    fig.tight_layout()
    fig.savefig(path, dpi=110)


def section(turbine: str, found: dict[str, DesignLoads]) -> str:
    """The part of the page on a turbine, and its picture."""
    numbers = {scheme: values(design) for scheme, design in found.items()}
    picture(turbine, numbers, PAGES / f"control-bases-{turbine}.png")
    campaign, lines = next(iter(found.values())).plan.campaign, []
    if campaign.quick:
        lines += [QUICK.format(seconds=f", of {campaign.duration:g} s each" if campaign.duration else "")]
    if missing := [words for scheme, words in SCHEMES.items() if scheme not in found]:
        lines += [f"Without {', '.join(missing)} control, which was not run (`--schemes {','.join(found)}`).", ""]
    if (n := campaign.seeds) not in (None, 6):
        lines += [f"With {n} seeds of turbulence where the table has six (`--seeds {n}`); DLC 1.1 has its 6 to 15.", ""]
    lines += [f"![Changes of loads of {turbine} against collective control](control-bases-{turbine}.png)", ""]
    for kind, head in HEADS.items():
        lines += [f"{head}:", "", *table(numbers, kind), ""]
    if bad := {s: len(d.problems) for s, d in found.items() if len(d.problems)}:
        said = ", ".join(f"{SCHEMES[s]} {n}" for s, n in bad.items())
        lines += [f"Cases with a warning or a finding: {said}; the reports of the bases list them.", ""]
    return "\n".join(lines)


def page(new: dict[str, str], path: Path) -> str:
    """The page in Markdown, with the sections of turbines that it has already."""
    parts = path.read_text(encoding="utf-8").split("\n## ")[1:-1] if path.is_file() else []
    sections = dict(part.split("\n\n", 1) for part in parts) | new
    command = f"python tools/control_bases.py {' '.join(sections)}   # plans, runs, evaluates, makes this page"
    body = [f"## {name}\n\n{text.strip()}\n" for name, text in sections.items()]
    return "\n".join([HEAD, USE.format(command=command), *body, FOOT, "", f"meltemi {meltemi.__version__}.", ""])


def main() -> None:
    """Plan, run and evaluate what is missing; write the page."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("turbines", nargs="*", default=["nrel5mw", "iea15mw"])
    arguments.add_argument("--quick", action="store_true")
    arguments.add_argument("--short", action="store_true")
    arguments.add_argument("--seeds", type=int, default=6, help="of turbulence, where the table has the usual six")
    arguments.add_argument("--schemes", default=",".join(SCHEMES), help="the first one is compared with")
    arguments.add_argument("--work", type=Path, default=Path("bases"))
    given = arguments.parse_args()
    settings: dict[str, Any] = {"quick": given.quick or given.short, "seeds": given.seeds}
    settings |= SHORT if given.short else {}
    path, new = PAGES / "control-bases.md", {}
    for turbine in given.turbines:
        done: list[Path] = []
        found = {}
        for scheme in given.schemes.split(","):
            found[scheme] = base(turbine, scheme, given.work, settings, done)
            done.append(given.work / f"{turbine}-{scheme}")
        new[turbine] = section(turbine, found)
    path.write_text(page(new, path), encoding="utf-8")


if __name__ == "__main__":
    main()
