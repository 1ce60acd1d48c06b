"""Give the package what it never expected and watch how it ends:  python tools/fuzz.py --seconds 180 --seed 7

Command lines, case and turbine files (keys and values, or their text), OpenFAST decks, result and wind files are
damaged by chance and given to the command line, in a process of their own that is killed when it does not return. It
must end with status 0 or 2, or 1 for a run that says that it ended early; say why in words; take no more than a minute
beside compilation, and some GB of memory; leave no folder of a refused run, and nothing half-written. Long studies are
only begun. An input is told by seed, kind and number: --only turbine:17 repeats one and shows what it was.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import io
import json
import multiprocessing
import os
import random
import resource
import shutil
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

LIMIT = 60.0
"""[s] for an input, beside compilation."""
WITH_COMPILATION = 400.0
MEMORY = 8 << 30
SIMULATED = 0.3
"""[s] of each run."""
RAW = ("Traceback", "validation error", "pydantic", "Exception ignored", "Warning:")
"""What no message may have in it."""

NUMBERS: list[Any] = [0, -1, 1, 2, 0.5, 12.0, 1e-6, 1e3, 1e6, 1e30, -1e30, 1e308, 5e-324, 10**23, -(10**23)]
NUMBERS += [float("nan"), float("inf"), -float("inf")]
WORDS: list[Any] = ["", " ", "nan", "1e3", "yes", "null", "nrel5mw", "é", "\x07", "a\nb", "x" * 300, "../..", "\udcff"]
JUNK: list[Any] = [
    *NUMBERS,
    *WORDS[:-1],
    None,
    True,
    False,
    [],
    {},
    [1.0],
    [[1.0]],
    {"a": 1},
    [None],
    10**400,
    "/dev/full",
]
FACTORS = [0.0, -1.0, 1e-9, 1e-6, 1e-3, 0.1, 0.3, 0.9, 1.1, 3.0, 10.0, 1e3, 1e6, 1e9]
PIECES = [b": ", b"\n", b"[", b"}", b"\t", b"- ", b"&a ", b"*a", b"!!float ", b".nan", b"1e999", b"\x00", b"\xff", b"'"]
PIECES += [b"-1", b"0", b"NaN", b'"', b"True", b"99999999999", b"1e30", b",", b"\r", b"!"]


# inputs: each kind takes a generator of chance and the folder of good files, and gives arguments of the command line;
# files of its own it writes into the working directory


def command(chance: random.Random, good: Path) -> list[str]:
    """A command with some of its options."""
    import typer

    from meltemi.app.cli import app

    commands = typer.main.get_command(app).commands  # type: ignore[attr-defined]
    name = chance.choice(sorted(commands))
    files = [str(p) for p in sorted(good.rglob("*")) if p.is_file()]
    usual = [
        "nrel5mw",
        "pmsg20mw",
        "NTM",
        "ETM",
        "EOG",
        "ECD",
        "II",
        "B",
        "4:24:4",
        "8,12",
        "12",
        "20",
        "0.14",
        "1",
        "3",
    ]
    usual += [
        "rosco",
        "supervised",
        "cpc,ipc",
        "case",
        "turbine",
        "kaimal",
        "he2018",
        "wang2021",
        "bladed",
        "bts",
        "all",
    ]
    strange = [
        *map(str, NUMBERS),
        *WORDS,
        "/dev/full",
        "/dev/zero",
        "/",
        "4:24:-1",
        "1:9:1e-9",
        ",",
        "-",
        "--",
        ":",
        "{}",
    ]

    def value() -> str:
        return str(chance.choice(chance.choice([usual, usual, files, strange])))

    words = [name]
    for each in commands[name].params:
        if each.param_type_name == "argument":
            if chance.random() < 0.95:
                words.append(chance.choice(["nrel5mw", value(), value()]))
        elif chance.random() < 0.3 and each.opts[0] not in ("--help", "--debug"):
            words.append(each.opts[0])
            if not each.is_flag:
                words.append(value())
    return words


def case(chance: random.Random, good: Path) -> list[str]:
    """A case file with some keys or values damaged."""
    content = json.loads((good / f"case{chance.randrange(CASES)}.json").read_text())
    _write_yaml(Path("case.yaml"), _damaged(content, chance))
    return ["run", "case.yaml"]


def turbine(chance: random.Random, good: Path) -> list[str]:
    """A turbine file with some keys or values damaged."""
    content = json.loads((good / chance.choice(["turbine.json", "turbine.json", "power.json"])).read_text())
    _write_yaml(Path("turbine.yaml"), _damaged(content, chance))
    return ["run", "turbine.yaml", "--wind-speed", chance.choice(["4", "8", "12", "20"])]


def text(chance: random.Random, good: Path) -> list[str]:
    """The text of a case or turbine file with pieces cut out, put in or exchanged."""
    name = chance.choice(["case.yaml", "turbine.yaml"])
    Path(name).write_bytes(_edited((good / name).read_bytes(), chance))
    return ["run", name] if name == "case.yaml" else ["run", name, "--wind-speed", "12"]


def deck(chance: random.Random, good: Path) -> list[str]:
    """An OpenFAST deck with one or two files damaged."""
    shutil.copytree(good / "deck", "deck")
    files = sorted(p for p in Path("deck").rglob("*") if p.is_file())
    for path in chance.sample(files, chance.choice([1, 1, 2])):
        raw = path.read_bytes()
        if chance.random() < 0.5:
            raw = _edited(raw, chance)
        else:  # another value
            lines = raw.split(b"\n")
            for _ in range(chance.choice([1, 1, 3])):
                i = chance.randrange(len(lines))
                if words := lines[i].split(b" "):
                    words[chance.randrange(len(words)) if chance.random() < 0.3 else 0] = _bytes(chance.choice(JUNK))
                    lines[i] = b" ".join(words)
            raw = b"\n".join(lines)
        path.write_bytes(raw)
    main = next(iter(sorted(Path("deck").glob("*.fst"))))
    return ["import", str(main), "--control-of", "nrel5mw"] if chance.random() < 0.9 else ["run", str(main)]


def result(chance: random.Random, good: Path) -> list[str]:
    """A result file with wrong bytes."""
    name = chance.choice(["result.nc", "result.nc", "result.outb", "result.out"])
    raw = (good / name).read_bytes()
    if name.endswith(".nc") and chance.random() < 0.7:
        from meltemi.core.hdf5 import LENGTH

        raw = raw[:-LENGTH]  # as of other programs: HDF5 is asked
    Path(name).write_bytes(_bitten(raw, chance))
    return ["diff", name, str(good / "result.nc")]


def wind(chance: random.Random, good: Path) -> list[str]:
    """A wind file with wrong bytes."""
    name = chance.choice(["w.nc", "w.bts", "w.bts", "w.wnd", "w-u.bin", "gust.wnd", "hub.csv"])
    for path in sorted(good.glob(f"{name[0]}*")):
        if path.stem.split("-")[0].split(".")[0] == name.split("-")[0].split(".")[0]:
            shutil.copy(path, ".")
    victim = Path(name) if chance.random() < 0.8 or name != "w.wnd" else Path("w.sum")
    if name == "w-u.bin" and chance.random() < 0.5:
        victim = Path("w.hawc2.yaml")
    raw = victim.read_bytes()
    if name == "w.nc" and chance.random() < 0.7:
        from meltemi.core.hdf5 import LENGTH

        raw = raw[:-LENGTH]
    is_text = victim.suffix in (".sum", ".csv", ".yaml") or name == "gust.wnd"
    victim.write_bytes(_edited(raw, chance) if is_text else _bitten(raw, chance))
    if name == "hub.csv" or chance.random() < 0.6:
        return ["wind", "--from", name]
    return ["run", "nrel5mw", "--wind-file", name]


KINDS: dict[str, Callable[[random.Random, Path], list[str]]] = {
    "command": command, "case": case, "turbine": turbine, "text": text, "deck": deck, "result": result, "wind": wind,
}  # fmt: skip


# damage


def _places(content: Any, here: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    entries = content.items() if isinstance(content, dict) else enumerate(content) if isinstance(content, list) else ()
    for key, value in entries:
        yield (*here, key)
        yield from _places(value, (*here, key))


def _damaged(content: Any, chance: random.Random) -> Any:
    """One to three keys or entries deleted, renamed, doubled, scaled or replaced by something else."""
    content = copy.deepcopy(content)
    for _ in range(chance.choice([1, 1, 2, 3])):
        found = list(_places(content))
        place = chance.choice(found)
        if len(place) > 2 and chance.random() < 0.4:
            place = chance.choice([p for p in found if len(p) <= 2])
        inside = content
        for key in place[:-1]:
            inside = inside[key]
        key = place[-1]
        how = chance.choice(["delete", "rename", "double", "scale", "scale", "scale", "replace", "replace", "other"])
        if how == "delete":
            del inside[key]
        elif how == "rename" and isinstance(inside, dict):
            inside[chance.choice([f"{key}s", str(key)[1:], str(chance.choice(WORDS[:-1]))])] = inside.pop(key)
        elif how == "double" and isinstance(inside, list):
            inside.insert(key, inside[key])
        elif how == "scale":
            factor = chance.choice(FACTORS)
            inside[key] = _scaled(inside[key], factor) if chance.random() < 0.8 else chance.choice(NUMBERS)
        elif how == "other":
            other = content
            for step in chance.choice(found)[:-1]:
                other = other[step] if isinstance(other, list | dict) and _has(other, step) else other
            inside[key] = copy.deepcopy(other) if len(str(other)) < 3000 else None
        else:
            inside[key] = chance.choice(JUNK)
    return content


def _has(inside: Any, key: Any) -> bool:
    return key in inside if isinstance(inside, dict) else isinstance(key, int) and key < len(inside)


def _scaled(value: Any, factor: float) -> Any:
    if isinstance(value, bool) or not isinstance(value, int | float | list):
        return value
    if isinstance(value, int) and abs(value) > 1e300:  # put there by an earlier damage
        return value
    return [_scaled(v, factor) for v in value] if isinstance(value, list) else value * factor


def _bytes(value: Any) -> bytes:
    return str(value).encode("utf-8", "surrogateescape")


def _edited(raw: bytes, chance: random.Random) -> bytes:
    """A text with one to four edits."""
    for _ in range(chance.randint(1, 4)):
        at, n = chance.randrange(len(raw) + 1), chance.randint(1, 30)
        how = chance.choice(["cut", "insert", "insert", "replace", "swap", "line", "end"])
        if how == "cut":
            raw = raw[:at] + raw[at + n :]
        elif how == "insert":
            raw = raw[:at] + chance.choice([*PIECES, _bytes(chance.choice(JUNK))]) + raw[at:]
        elif how == "replace":
            raw = raw[:at] + chance.choice(PIECES) + raw[at + chance.randint(1, 4) :]
        elif how == "swap":
            raw = raw[:at] + raw[at + n : at + 2 * n] + raw[at : at + n] + raw[at + 2 * n :]
        elif how == "line":
            lines = raw.split(b"\n")
            i = chance.randrange(len(lines))
            lines[i : i + 1] = chance.choice([[], [lines[i]] * 2, [b"  " + lines[i]], [lines[i].strip()]])
            raw = b"\n".join(lines)
        elif chance.random() < 0.3:
            raw = raw[:at]
    return raw


def _bitten(raw: bytes, chance: random.Random) -> bytes:
    """A binary file with wrong bytes, most of them where its structure is, or without its end."""
    raw = bytearray(raw)  # type: ignore[assignment]
    if chance.random() < 0.15:
        return bytes(raw[: chance.randrange(len(raw))])
    for _ in range(chance.choice([1, 1, 2, 5, 20, 100])):
        at = chance.randrange(min(len(raw), chance.choice([100, 1000, 10_000, len(raw)])))
        n = chance.choice([1, 1, 2, 4, 8])
        new = chance.choice(
            [chance.randbytes(n), b"\xff" * n, b"\0" * n, bytes([raw[at] ^ (1 << chance.randrange(8))])]
        )
        raw[at : at + len(new)] = new  # type: ignore[index]
    return bytes(raw)


def _write_yaml(path: Path, content: Any) -> None:
    from ruamel.yaml import YAML

    with path.open("w", encoding="utf-8", errors="surrogateescape") as file:
        YAML(typ="safe", pure=True).dump(content, file)


# good files

CASES = 5


def make_good(folder: Path) -> None:
    """What is damaged afterwards."""
    import numpy as np
    from ruamel.yaml import YAML

    import meltemi
    from meltemi.core.yamlfile import write_record
    from meltemi.loadcases.case import TEMPLATE
    from meltemi.studies.openfast_writer import write_openfast
    from meltemi.wind.fields import WindBox, WindSeries

    machine = meltemi.load_turbine("nrel5mw")
    model = meltemi.build(machine)
    found = meltemi.simulate(model, meltemi.SteadyWind(speed=12.0), duration=10.0)
    for name in ("result.nc", "result.outb", "result.out"):
        meltemi.write_result(found, folder / name)
    noise = np.random.default_rng(1).normal(12.0, 1.0, (100, 8, 8, 3)).astype(np.float32)
    box = WindBox(noise, dt=0.5, dy=25.0, dz=25.0, bottom=10.0, speed=12.0, hub_height=90.0)
    for name in ("w.nc", "w.bts", "w.wnd", "w-u.bin", "hub.csv"):
        meltemi.io.write_wind(box, folder / name)
    series = WindSeries(time=[0.0, 5.0, 9.0], speed=[12.0, 14.0, 12.0], direction=[0.0, 0.1, 0.0])
    meltemi.io.write_wind(series, folder / "gust.wnd")
    (folder / "deck").mkdir()
    write_openfast(machine, folder / "deck")
    write_record(machine, folder / "turbine.yaml")
    (folder / "case.yaml").write_text(TEMPLATE)
    contents = [("turbine", machine), ("power", meltemi.load_turbine("pmsg20mw"))]
    for name, record in contents:
        (folder / f"{name}.json").write_text(json.dumps(_thin(record.model_dump(mode="json", exclude_none=True))))
    template = YAML(typ="safe").load(TEMPLATE)
    steady = {"turbine": "nrel5mw", "wind": {"kind": "steady", "speed": 12.0, "shear_exponent": 0.2}, "duration": 30.0}
    stuck = {"at": 10.0, "type": "pitch_stuck", "blade": 2, "until": 20.0}
    loss = {"at": 5.0, "type": "sensor_loss", "sensor": "pitch_1", "holds": "zero"}
    cases = [
        template | {"wind": steady["wind"]},
        template | {"events": [stuck, loss]},
        steady | {"options": {"flap_modes": 2, "torsion_modes": 1, "blade_nodes": 10, "inflow": "constant"}},
        steady | {"wind": {"kind": "file", "path": str(folder / "w.bts")}, "environment": {"air_density": 1.2}},
        steady | {"turbine": "pmsg20mw", "channels": ["rotor_speed", "generator_power"], "output_step": 0.1},
    ]
    for i, content in enumerate(cases):
        (folder / f"case{i}.json").write_text(json.dumps(content))


def _thin(content: Any) -> Any:
    """Every fourth entry of long lists: quick to write and to read."""
    if isinstance(content, dict):
        return {name: _thin(value) for name, value in content.items()}
    if isinstance(content, list) and len(content) > 12 and not isinstance(content[0], dict):
        return [content[0], *content[3:-3:4], content[-1]]
    return [_thin(v) for v in content] if isinstance(content, list) else content


# the process that reads them


@dataclass
class Fate:
    """How an input ended.

    Attributes:
      status: of the command line, or what happened instead.
      finding: what is wrong about that; empty if nothing is.
      where: by which findings are told apart.
      said: on stderr, or the traceback.
      seconds: beside compilation.
    """

    status: int | str
    finding: str = ""
    where: str = ""
    said: str = ""
    seconds: float = 0.0
    words: list[str] = field(default_factory=list)


def worker(pipe: Connection, good: Path, seed: int) -> None:
    """Run what is asked for until the pipe is closed."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    _only_begin_what_is_long()
    pipe.send("ready")
    while True:
        try:
            kind, number = pipe.recv()
        except EOFError:
            return
        with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
            os.chdir(folder)
            pipe.send(_fate(kind, random.Random(f"{seed}/{kind}/{number}"), good, Path(folder)))
            os.chdir(good)


def _fate(kind: str, chance: random.Random, good: Path, folder: Path) -> Fate:
    from meltemi.app.cli import main
    from meltemi.core.kernel import compile_seconds

    DEEP[0] = chance.random() < SHARE
    words = KINDS[kind](chance, good)
    before = set(folder.rglob("*"))
    out, err = io.StringIO(), io.StringIO()
    began, compiled = time.perf_counter(), compile_seconds()
    fate = Fate(0, words=words)
    sys.argv = ["meltemi", *words]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
    except SystemExit as end:
        fate.status = end.code if isinstance(end.code, int) else 0 if end.code is None else str(end.code)
    except BaseException as error:  # what is looked for
        last = traceback.extract_tb(error.__traceback__)[-1]
        fate.finding, fate.where = type(error).__name__, f"{Path(last.filename).name}:{last.name}"
        fate.said = traceback.format_exc()[-3000:]
        fate.status = "exception"
    fate.seconds = time.perf_counter() - began - (compile_seconds() - compiled)
    said = fate.said = fate.said or err.getvalue()[-3000:]
    left = set(folder.rglob("*")) - before
    raw = next((r for r in RAW if r in said), "")
    half = [p for p in left if p.suffix == ".part" or "probe" in p.name]
    checks = {
        "exit status": fate.status not in (0, 2) and not (fate.status == 1 and "the run ended early" in said),
        "no reason": fate.status != 0 and not said.strip() and not out.getvalue().strip(),
        f"{raw!r} in a message": raw,
        "half-written": half,
        "left by a refused run": fate.status == 2 and left,
        f"longer than {LIMIT:g} s": fate.seconds > LIMIT,
    }
    if not fate.finding and (wrong := next((what for what, found in checks.items() if found), "")):
        fate.finding, fate.where = wrong, said.strip().splitlines()[-1][:60] if said.strip() else words[0]
    if fate.status == 2 and ACCEPTED in said:
        fate.status = 0
    return fate


ACCEPTED = "accepted, and not computed here"


def _only_begin_what_is_long() -> None:
    """Studies say that they would begin; runs are short."""
    from meltemi.core.errors import RunError
    from meltemi.postprocess import difference
    from meltemi.report import wind_plots
    from meltemi.simulation import campbell, flutter, parked_modes, rotors, simulate
    from meltemi.studies import compare, inspection, schemes, warmup
    from meltemi_papers import study
    from meltemi_papers.he2018 import duel
    from meltemi_verification import bench, verification

    def begun(*_: Any, **__: Any) -> None:
        raise RunError(ACCEPTED)

    long: list[tuple[Any, str]] = [
        (campbell, "campbell"), (flutter, "flutter"), (parked_modes, "parked_stability"), (bench, "benchmark"),
        (compare, "compare"), (schemes, "design_controllers"),
        (inspection, "inspect_turbine"), (verification, "verification"), (warmup, "warmup"), (duel, "duel"),
        (study, "reproduce"),
    ]  # fmt: skip
    for module, name in long:
        setattr(module, name, begun)

    def seldom(module: Any, name: str, **instead: Any) -> None:
        """Done for one input of DEEP only, then as short as may be."""
        whole = getattr(module, name)

        def short(*arguments: Any, **named: Any) -> Any:
            if not DEEP[0]:
                begun()
            return whole(*arguments, **{n: min(v, instead[n]) if n in instead else v for n, v in named.items()})

        setattr(module, name, short)

    seldom(simulate, "simulate", duration=SIMULATED)
    seldom(rotors, "operating_point")
    seldom(difference, "compare_results")
    seldom(wind_plots, "plot_wind")


DEEP = [False]
"""Whether this input is followed to its end; most are of interest for how they are read."""
SHARE = 0.06
"""Of such inputs."""


# the process that watches


class Watch:
    """A worker that is started again when it had to be killed."""

    def __init__(self, good: Path, seed: int) -> None:
        self.good, self.seed = good, seed
        self.context = multiprocessing.get_context("spawn")
        self.start()

    def start(self) -> None:
        self.pipe, other = self.context.Pipe()
        self.process = self.context.Process(target=worker, args=(other, self.good, self.seed), daemon=True)
        self.process.start()
        other.close()
        self.pipe.recv()

    def run(self, kind: str, number: int) -> Fate:
        """What becomes of an input."""
        self.pipe.send((kind, number))
        try:
            if self.pipe.poll(WITH_COMPILATION):
                return self.pipe.recv()  # type: ignore[no-any-return]
            fate = Fate("killed", "hang", kind, seconds=WITH_COMPILATION)
        except (EOFError, ConnectionResetError):
            fate = Fate("dead", "the process died", kind)
        self.process.kill()
        self.process.join()
        fate.where += f" (exit status {self.process.exitcode})"
        self.start()
        return fate


def main() -> int:
    """Until the time is over, or all inputs are done; the exit status is 1 if anything was found."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--seconds", type=float, default=180.0, help="of wall time")
    options.add_argument("--inputs", type=int, help="as many, however long they take, in place of --seconds")
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--kinds", default=",".join(KINDS), help="which, separated by commas")
    options.add_argument("--only", help="one input, as kind:number")
    options.add_argument("--from", dest="first", type=int, default=0, help="number of the first input of each kind")
    given = options.parse_args()
    kinds = given.kinds.split(",")
    counts, slowest, found = Counter[tuple[str, str]](), Counter[str](), {}
    with tempfile.TemporaryDirectory(prefix="fuzz-good-") as folder:
        make_good(Path(folder))
        watch = Watch(Path(folder), given.seed)
        if given.only:
            kind, _, number = given.only.partition(":")
            fate = watch.run(kind, int(number))
            print(f"meltemi {' '.join(map(repr, fate.words))}\n{fate.said}\n{fate.status} {fate.finding} {fate.where}")
            return bool(fate.finding)
        began, i = time.perf_counter(), 0
        while i < given.inputs if given.inputs else time.perf_counter() - began < given.seconds:
            kind, number = kinds[i % len(kinds)], given.first + i // len(kinds)
            fate = watch.run(kind, number)
            how = "found" if fate.finding else "refused" if fate.status == 2 else "accepted"
            counts[kind, how] += 1
            slowest[kind] = max(slowest[kind], round(fate.seconds))
            if fate.finding:
                known = found.setdefault((fate.finding, fate.where), [])
                known.append(f"{kind}:{number}")
                if len(known) == 1:
                    print(f"{kind}:{number} {fate.finding} {fate.where}", flush=True)
            i += 1
    print(f"\n{'kind':10}{'inputs':>8}{'accepted':>10}{'refused':>9}{'findings':>10}{'slowest s':>11}")
    for kind in kinds:
        n = [counts[kind, how] for how in ("accepted", "refused", "found")]
        print(f"{kind:10}{sum(n):8}{n[0]:10}{n[1]:9}{n[2]:10}{slowest[kind]:11}")
    print(f"seed {given.seed}, {i} inputs in {time.perf_counter() - began:.0f} s, {len(found)} different findings")
    for (what, where), inputs in found.items():
        print(f"  {what} at {where}: {len(inputs)} times, such as --seed {given.seed} --only {inputs[0]}")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
