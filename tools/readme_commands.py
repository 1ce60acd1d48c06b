"""Every command of the README, tried with the installation that the README describes: ``readme_commands.py MELTEMI``.

A command is run as it stands, or in a cheaper form where it is long. What needs an optional package must say so in one
line. Runs in the current folder, in this order: later commands read what earlier ones wrote.
"""

from __future__ import annotations

import csv
import shlex
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

from meltemi.core.extras import missing


class Try(NamedTuple):
    """A command of the README.

    Attributes:
      readme: as the README has it, without ``meltemi``.
      tried: the cheaper form; empty: as it stands.
      needs: optional packages; without them it must be refused with the command that installs them.
    """

    readme: str
    tried: str = ""
    needs: tuple[str, ...] = ()


TRIES = (
    Try("warmup", "warmup --help"),  # what compiles is compiled by the others
    Try("turbines"),
    Try("channels --explain RootMyc1"),
    Try("template case --out case.yaml"),
    Try(
        "run nrel5mw --wind-speed 12 --turbulence 0.14 --duration 60 --out out",
        "run nrel5mw --wind-speed 12 --turbulence 0.14 --duration 20 --out out",
    ),
    Try("run nrel5mw --wind-speed 12 --out out", "run nrel5mw --wind-speed 12 --duration 20 --outb --view --out out"),
    Try(
        "run nrel5mw --ntm --wind-class IIB --wind-speed 20 --seed 1 --out out",
        "run nrel5mw --ntm --wind-class IIB --wind-speed 20 --seed 1 --duration 10 --out ntm",
    ),
    Try(
        "wind NTM --wind-class IIB --speed 20 --turbine nrel5mw --seed 1 --out out",
        "wind NTM --wind-class IIB --speed 20 --turbine nrel5mw --seed 1 --duration 30 --out wind",
    ),
    Try("power-curve nrel5mw --out out", "power-curve nrel5mw --wind-speeds 8,12 --out curve"),
    Try(
        "compare nrel5mw --ntm --wind-class IIB --wind-speed 20 --controllers cpc,ipc,cpfc --out out",
        "compare nrel5mw --ntm --wind-class IIB --wind-speed 20 --controllers cpc,supervised --seeds 2 --duration 60 "
        "--transient 20 --out compared",
    ),
    Try("loads plan nrel5mw --class IB --out base", "loads plan nrel5mw --class IB --quick --out base"),
    Try("bench-controller ipc cpfc --quick --out page", "bench-controller --help"),  # minutes
    Try("export nrel5mw --out deck"),
    Try("import model.fst --out out", "import deck/nrel5mw.fst --control-of nrel5mw --out imported"),
    Try(
        "run model.fst --controller rosco --out out",
        "run nrel5mw --wind-speed 12 --controller rosco --controller-input deck/ServoDyn.dat --out rosco",
        ("rosco",),
    ),
    Try("diff out/result.nc theirs.outb --out out", "diff out/result.nc out/result.outb --out diff"),
    Try("view out -o turbine.html"),
    Try("live nrel5mw", "", ("websockets",)),
    Try("inspect nrel5mw --out out", "inspect nrel5mw --out inspected"),
    Try("farm nrel5mw --out out", "farm --help"),  # a minute and more
    Try("export-controller ipc --turbine nrel5mw --out libipc.so", "export-controller --help"),  # compiles for a minute
    Try("optimise examples/design.yaml --out design", "optimise --help"),  # minutes
    Try("reproduce he2018 --out out", "reproduce --help"),  # its quick form is a long test
    Try(
        "observe measured.csv --turbine nrel5mw",
        "observe measured.csv --turbine nrel5mw --transient 5 --out observed",
    ),
    Try("validate v27.yaml --data records --out out", "", ("pandas", "python-docx")),
    Try("surrogate design nrel5mw --out surrogate"),
    Try("campbell nrel5mw --out out", "campbell nrel5mw --wind-speeds 8,12 --out campbell"),
    Try("verify --out out", "verify --help"),  # its studies are tests
    Try("bench", "bench --help"),  # compiles everything anew
    Try("docs", "docs --help"),  # needs a clone and mkdocs
)


def signals_of(result: Path, target: Path) -> None:
    """Measured signals from a result."""
    import meltemi

    found = meltemi.io.read_netcdf(result)
    names = ("generator_speed", "generator_power", "pitch_1")
    with target.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(["time [s]", *(f"{name} [{found.channel(name).unit}]" for name in names)])
        rows.writerows(zip(found.time, *(found[name] for name in names), strict=True))


def attempt(meltemi: str, each: Try) -> str:
    """Run one; what is wrong with it, or nothing."""
    arguments = shlex.split(each.tried or each.readme)
    ran = subprocess.run([meltemi, *arguments], capture_output=True, text=True)
    lacking = bool(missing(each.needs))
    if "Traceback" in ran.stderr or (ran.returncode != 0) != lacking or (lacking and "pip install" not in ran.stderr):
        return (
            f"meltemi {shlex.join(arguments)}: exit status {ran.returncode}\n{ran.stdout[-2000:]}\n{ran.stderr[-2000:]}"
        )
    return ""


def main() -> None:
    """Run all."""
    wrong = []
    for each in TRIES:
        if each.readme.startswith("observe"):
            signals_of(Path("out/result.nc"), Path("measured.csv"))
        if each.needs and not missing(each.needs):
            print(f"not tried, since it is installed and goes on until Ctrl-C or needs more: {each.readme}")
            continue
        began = time.perf_counter()
        found = attempt(sys.argv[1], each)
        print(
            f"{'FAILED' if found else 'ok':6s} {time.perf_counter() - began:5.0f} s  {each.tried or each.readme}",
            flush=True,
        )
        wrong += [found] if found else []
    print("\n\n".join(wrong))
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
