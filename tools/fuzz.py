"""Give the package what it never expected and watch how it ends:  python tools/fuzz.py --seconds 180 --seed 7

Command lines, case and turbine files (keys and values, or their text), OpenFAST decks, result and wind files, saved
states and views are damaged by chance and given to the command line; load base plans, settings, tables, results and
surrogates, seas, coefficients, farms, hulls, weather and FMUs, messages of the live page and arguments of functions to
Python; all in a process of their own that is killed when it does not
return. What fails in Python must be an error of meltemi. A command must end with status 0 or 2, or 1 for a run that
says that it ended early; say why in words; take no more than a minute beside compilation, and some GB of memory; leave
no folder of a refused run, and nothing half-written. Long studies are only begun. An input is told by seed, kind and
number: --only turbine:17 repeats one and shows what it was.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import hashlib
import io
import json
import multiprocessing
import os
import random
import re
import resource
import shutil
import socket
import sys
import tempfile
import time
import traceback
import urllib.request
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

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


# inputs: each kind takes a generator of chance and the folder of good files, and gives arguments of the command line,
# or a call; files of its own it writes into the working directory


class Call(NamedTuple):
    """A call of the package from Python, and what it is, in words."""

    words: list[str]
    function: Callable[[], Any]


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


def hawc2(chance: random.Random, good: Path) -> list[str]:
    """A HAWC2 model with one or two files damaged."""
    shutil.copytree(good / "hawc2", "hawc2")
    for path in chance.sample(sorted(Path("hawc2").iterdir()), chance.choice([1, 1, 2])):
        path.write_bytes(_edited(path.read_bytes(), chance))
    words = ["import", str(next(Path("hawc2").glob("*.htc")))]
    return words if chance.random() < 0.9 else [*words, "--control-of", "nrel5mw"]


def windio(chance: random.Random, good: Path) -> list[str]:
    """A windIO file, or what is added to it, with keys or values damaged, or its text."""
    names = ["windio.yaml", "extra.yaml"]
    damaged = chance.choice([*names, names[0]])
    for name in names:
        if name == damaged and chance.random() < 0.7:
            Path(name).write_text(json.dumps(_damaged(json.loads((good / name).read_text()), chance)))
        else:
            raw = (good / name).read_bytes()
            Path(name).write_bytes(_edited(raw, chance) if name == damaged else raw)
    return ["import", names[0], *(["--extra", names[1]] if chance.random() < 0.9 else [])]


def discon(chance: random.Random, good: Path) -> list[str]:
    """Settings of ROSCO with wrong values or text."""
    raw = _edited((good / "DISCON.IN").read_bytes(), chance)
    if chance.random() < 0.6:
        lines = raw.split(b"\n")
        for _ in range(chance.choice([1, 1, 3])):
            i = chance.randrange(len(lines))
            lines[i] = _bytes(chance.choice(JUNK)) + b" " + lines[i].partition(b"!")[2].rjust(1, b"!")
        raw = b"\n".join(lines)
    Path("DISCON.IN").write_bytes(raw)
    return ["import", str(good / "deck" / "nrel5mw.fst"), "--discon", "DISCON.IN"]


def csv(chance: random.Random, good: Path) -> list[str]:
    """Measured signals, or the wind at a hub, with wrong heads, values or text."""
    raw = (good / chance.choice(["signals.csv", "hub.csv"])).read_bytes()
    lines = raw.split(b"\n")
    for _ in range(chance.choice([0, 1, 1, 3])):
        i = chance.choice([0, 0, 1, chance.randrange(len(lines))])
        cells = lines[i].split(b",")
        cells[chance.randrange(len(cells))] = chance.choice(
            [_bytes(chance.choice(JUNK)), b"time [s]", b"wind_speed [ft/s]", b"rotor_speed", b"GenPwr [kW]", b" []"]
        )
        lines[i] = b",".join(cells)
    raw = b"\n".join(lines)
    Path("signals.csv").write_bytes(_edited(raw, chance) if chance.random() < 0.5 else raw)
    uses = [["diff", "signals.csv", str(good / "result.nc")], ["observe", "signals.csv", "--turbine", "nrel5mw"]]
    uses += [["wind", "--hub-series", "signals.csv", "--wind-speed", "9"], ["wind", "--from", "signals.csv"]]
    return chance.choice([uses[0], *uses])


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


def plan(chance: random.Random, good: Path) -> Call:
    """A campaign, changes of its table, settings of the evaluation, or conditions of a site, damaged."""
    from meltemi import loads
    from meltemi.loads.loadbase import excel, project, settings, site
    from meltemi.loads.loadbase.plan import plan as planned

    readers: dict[str, Callable[[Path], Any]] = {
        "campaign.yaml": lambda path: planned(loads.read_campaign(path.parent)),
        "changes.yaml": lambda path: planned(_campaign(excel.read_changes(path))),
        "settings.yaml": settings.read_settings,
        "site.json": lambda path: site.read_site(path).wind_class(4),
        "table.yaml": loads.read_site_table,
        "project.yaml": lambda path: project.read_project(path.parent, path),
    }
    name = chance.choice(sorted(readers))
    _damage_file(good / "loads" / name, Path(name), chance)
    return Call([name], lambda: readers[name](Path(name)))


def xlsx(chance: random.Random, good: Path) -> Call:
    """A load case table in Excel with wrong cells or bytes."""
    import openpyxl

    from meltemi.loads.loadbase.excel import read_changes

    if chance.random() < 0.4:
        Path("table.xlsx").write_bytes(_bitten((good / "loads" / "table.xlsx").read_bytes(), chance))
    else:
        book = openpyxl.load_workbook(good / "loads" / "table.xlsx")
        for _ in range(chance.choice([1, 1, 3, 8])):
            sheet = chance.choice(book.worksheets)
            cell = sheet.cell(chance.randint(1, sheet.max_row + 1), chance.randint(1, sheet.max_column + 1))
            with contextlib.suppress(Exception):  # what no cell holds
                value = chance.choice(JUNK)
                cell.value = json.dumps(value) if isinstance(value, list | dict) else value
        with contextlib.suppress(Exception):
            book.save("table.xlsx")
    return Call(["table.xlsx"], lambda: read_changes("table.xlsx", chance.choice([3, 4])))


def parquet(chance: random.Random, good: Path) -> Call:
    """Results of a load base with wrong columns, values or bytes, and their evaluation."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    from meltemi import loads
    from meltemi.loads.loadbase.engine import base_table
    from meltemi.loads.loadbase.settings import DesignSettings
    from meltemi.loads.loadbase.store import TABLES, read_file

    (path,) = (good / "loads" / "base" / "results").glob("*.parquet")
    if chance.random() < 0.3:
        Path("results").mkdir()
        (Path("results") / path.name).write_bytes(_bitten(path.read_bytes(), chance))
    else:
        table = read_file(path)
        for _ in range(chance.choice([1, 1, 2])):
            table = _other_table(table, chance)
        sink = pa.BufferOutputStream()
        pq.write_table(table, sink)
        content = sink.getvalue().to_pybytes()
        Path("results").mkdir()
        (Path("results") / f"{hashlib.sha256(content).hexdigest()[:32]}.parquet").write_bytes(content)
    planned, what = _campaign_plan(), chance.choice([*TABLES, "status", "design"])

    def evaluated() -> Any:
        if what == "status":
            return loads.base_status(planned, Path())
        if what == "design":
            return loads.design_loads(planned, Path(), DesignSettings(resamples=2, undeflected=12.0))
        return base_table(planned, Path(), what)

    return Call([what], evaluated)


def _other_table(table: Any, chance: random.Random) -> Any:
    """A table with one wrong column, or without its last rows."""
    import pyarrow as pa

    at = chance.randrange(table.num_columns)
    column, name, n = table.column(at), table.column_names[at], len(table)
    how = chance.choice(["drop", "rename", "junk", "other", "reverse", "cut"])
    if how == "drop":
        return table.remove_column(at)
    if how == "rename":
        return table.rename_columns([each + "s" * (each == name) for each in table.column_names])
    if how == "cut":
        return table.slice(0, chance.randrange(n) if n else 0)
    if how == "junk":
        junk = chance.choice([None, 1.5, "x", b"\xff", [1.0], {"a": 1}, float("nan"), -1])
        return table.set_column(at, name, pa.array([junk] * n))
    other = table.column(chance.randrange(table.num_columns))
    return table.set_column(
        at, name, other if how == "other" else column.take(pa.array(range(n - 1, -1, -1), pa.int64()))
    )


def surrogate(chance: random.Random, good: Path) -> Call:
    """A surrogate's file, campaign or design, damaged, and its evaluation."""
    from meltemi import loads
    from meltemi.loads.surrogate.campaign import read_surrogate_campaign
    from meltemi.loads.surrogate.model import _checksum

    name = chance.choice(["surrogate.json", "surrogate.json", "surrogate.yaml", "design.csv"])
    for path in (good / "surrogate").iterdir():
        shutil.copy(path, ".")
    if name == "design.csv" or chance.random() < 0.3:
        Path(name).write_bytes(_edited(Path(name).read_bytes(), chance))
    elif name == "surrogate.yaml":
        _damage_file(good / "surrogate" / name, Path(name), chance)
    else:
        content = _damaged(json.loads(Path(name).read_text()), chance)
        with contextlib.suppress(Exception):
            content |= {"checksum": _checksum(content)} if chance.random() < 0.9 else {}
        with contextlib.suppress(Exception):
            Path(name).write_text(json.dumps(content))
    at: dict[str, Any] = {"speed": 10.0, "turbulence_intensity": [0.1, 0.12]}
    if chance.random() < 0.5:
        at[chance.choice([*at, "yaw_error", "spedd"])] = _junk(chance)
    outside = chance.choice(["error", "clip", "nan", "x"])

    def evaluated() -> Any:
        if name != "surrogate.json":
            return read_surrogate_campaign(Path())
        made = loads.load_surrogate(name)
        with warnings.catch_warnings(category=UserWarning, action="ignore"):  # of points outside, in our words
            made(outside=outside, **at)
        return loads.site_suitability(made, loads.class_table("IB"), loads.class_table("IIIC"))

    return Call([name, repr(at)[:200], outside], evaluated)


def live(chance: random.Random, good: Path) -> Call:
    """Messages of the page of a live simulation."""
    from meltemi.core.errors import MeltemiError

    messages: list[Any] = []
    for _ in range(chance.randint(1, 4)):
        message: Any = chance.choice(
            [
                {"set": chance.choice(["wind_speed", "power_limit", "yaw_error", "x"]), "value": 9},
                {"fault": chance.choice(["grid_loss", "brake", "speed_sensor"]), "on": True},
                {"request": "normal_stop"}, {"controller": "baseline"}, {"reset": True}, {"playing": True, "speed": 2},
            ]
        )  # fmt: skip
        if chance.random() < 0.8:
            message = _damaged(message, chance)
        messages.append(message)

    def obeyed() -> None:
        session = _session()
        for message in messages:
            try:
                session.obey(message)
            except MeltemiError:
                continue
            json.dumps(session.state(), allow_nan=False)
            session.piece(0.1)

    return Call([repr(messages)[:300]], obeyed)


def server(chance: random.Random, good: Path) -> Call:
    """Requests and frames of the live page that are none; a right request must be answered after them."""
    server = _server()
    path = server.url.partition(server.host)[2].encode()
    host = server.host.encode()
    opening = b"GET %ssocket HTTP/1.1\r\nHost: %s\r\nOrigin: http://%s\r\nUpgrade: websocket\r\n" % (path, host, host)
    opening += (
        b"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
    )
    text = chance.choice([b"[" * 120, b'{"reset": true}', b'{"set": "wind_speed", "value": 1e999}', b"\xff" * 9])
    frame = bytes([chance.choice([0x81, 0x81, 0x82, 0x01, 0x88, 0x8A, 0xF1]), 0x80 | len(text), 0, 0, 0, 0]) + text
    raw = chance.choice([b"GET %s HTTP/1.1\r\nHost: %s\r\n\r\n" % (path, host), opening, opening + frame])
    raw = raw if chance.random() < 0.3 else chance.choice([_edited, _bitten])(raw, chance)

    def talked() -> None:
        where = (server.host.partition(":")[0], int(server.host.partition(":")[2]))
        with socket.create_connection(where, timeout=5.0) as line, contextlib.suppress(ConnectionError):
            line.sendall(raw)
            line.shutdown(socket.SHUT_WR)
            while line.recv(4096):
                pass
        list(server.received(0.0))
        with urllib.request.urlopen(server.url, timeout=5.0) as answer:
            assert answer.read() == b"page"

    return Call([repr(raw)[:300]], talked)


def api(chance: random.Random, good: Path) -> Call:
    """A function of Python with one or two arguments of another type, shape or size."""
    name, function, given = chance.choice(_functions(good))
    given = dict(given)
    for key in chance.sample(sorted(given), min(len(given), chance.choice([1, 1, 2]))):
        given[key] = _junk(chance, given[key])
    return Call([name, *(f"{key}={value!r:.80}" for key, value in given.items())], lambda: function(**given))


def offshore(chance: random.Random, good: Path) -> list[str]:
    """A turbine on a pile in soil, or on a floater with moorings, with keys or values damaged."""
    name = chance.choice(["nrel5mw-monopile", "nrel5mw-spar", "iea22mw-semi"])
    content = json.loads((good / f"{name}.json").read_text())
    part = chance.choice([k for k in content if k in ("foundation", "platform", "tower", "environment")])
    if chance.random() < 0.8 and isinstance(content[part], dict):
        content[part] = _damaged(content[part], chance)
    else:
        content = _damaged(content, chance)
    _write_yaml(Path("turbine.yaml"), content)
    return ["run", "turbine.yaml", "--wind-speed", "12", *chance.choice([[], ["--sea", "3,9"]])]


def sea(chance: random.Random, good: Path) -> Call:
    """A sea with keys or values damaged, and its elevation."""
    from meltemi.core.yamlfile import read_mapping
    from meltemi.sea.kinds import sea_of
    from meltemi.sea.statistics import sea_series

    _damage_file(good / "sea.yaml", Path("sea.yaml"), chance)
    return Call(["sea"], lambda: sea_series(sea_of(read_mapping(Path("sea.yaml")), "sea.yaml"), 30.0, 10.0))


def module(chance: random.Random, good: Path) -> list[str]:
    """An OpenFAST deck at sea with a table of HydroDyn, SeaState, SubDyn, MoorDyn or WAMIT damaged."""
    name = chance.choice(["nrel5mw-spar", "nrel5mw-monopile"])
    shutil.copytree(good / "sea" / name, "deck")
    files = [p for p in sorted(Path("deck").iterdir()) if p.stem in ("HydroDyn", "SeaState", "SubDyn", "MoorDyn")]
    for path in chance.sample(files, chance.choice([1, 1, 2])):
        path.write_bytes(_other_words(path.read_bytes(), chance))
    return ["import", f"deck/{name}.fst"]


def _other_words(raw: bytes, chance: random.Random) -> bytes:
    """Text with pieces exchanged, or with other values."""
    if chance.random() < 0.4:
        return _edited(raw, chance)
    lines = raw.split(b"\n")
    for _ in range(chance.choice([1, 1, 3])):
        i = chance.randrange(len(lines))
        words = lines[i].split()
        if words:
            words[chance.randrange(min(len(words), 9))] = _bytes(chance.choice(JUNK))
            lines[i] = b"  ".join(words)
    return b"\n".join(lines)


def coefficients(chance: random.Random, good: Path) -> Call:
    """Hydrodynamic coefficients: compact, of WAMIT or of Capytaine, with wrong words or bytes."""
    from meltemi.floating.coefficients import read_coefficients

    kind = chance.choice(["spar.npz", "spar.nc", "spar"])
    victim = chance.choice(["spar.1", "spar.3", "spar.hst"]) if kind == "spar" else kind
    for path in good.joinpath("coefficients").glob("spar.*"):
        if path.suffix in (".1", ".3", ".hst") or path.name == kind:
            shutil.copy(path, ".")
    raw = Path(victim).read_bytes()
    Path(victim).write_bytes(_other_words(raw, chance) if kind == "spar" else _bitten(raw, chance))
    return Call([victim], lambda: read_coefficients(str(Path(kind))))


def farm(chance: random.Random, good: Path) -> Call:
    """A farm, or a layout of FAST.Farm, windIO or FLORIS, with keys, values or text damaged."""
    from meltemi.core.yamlfile import read_record
    from meltemi.farm.layout import FarmCase
    from meltemi.farm.sources import read_layout

    name = chance.choice(["farm.yaml", "floris.yaml", "plant.yaml", "farm.fstf"])
    if name == "farm.fstf":
        Path(name).write_bytes(_other_words((good / name).read_bytes(), chance))
    else:
        _damage_file(good / name, Path(name), chance)
    if name == "farm.yaml":
        return Call([name], lambda: read_record(Path(name), FarmCase))
    return Call([name], lambda: read_layout(Path(name), 126.0))


def hull(chance: random.Random, good: Path) -> Call:
    """A hull and its panels, damaged."""
    from meltemi.core.yamlfile import read_record
    from meltemi.hydro.hull import Hull
    from meltemi.hydro.panels import hull_moments

    _damage_file(good / "hull.yaml", Path("hull.yaml"), chance)
    return Call(["hull"], lambda: hull_moments(read_record(Path("hull.yaml"), Hull), 4.0))


def climate(chance: random.Random, good: Path) -> Call:
    """Hourly weather as CSV or EPW with wrong heads, values or text."""
    from meltemi.studies.climate.weather import read_weather

    name = chance.choice(["weather.csv", "weather.epw"])
    lines = (good / name).read_bytes().split(b"\n")
    for _ in range(chance.choice([1, 1, 3])):
        i = chance.choice([0, 0, chance.randrange(len(lines))])
        cells = lines[i].split(b",")
        cells[chance.randrange(len(cells))] = _bytes(chance.choice(JUNK))
        lines[i] = b",".join(cells)
    raw = b"\n".join(lines)
    Path(name).write_bytes(_edited(raw, chance) if chance.random() < 0.5 else raw)
    how = {"wind_height": chance.choice([None, None, 10.0, 0, -1.0, float("nan")])}
    return Call([name], lambda: read_weather(Path(name), **how))


def state(chance: random.Random, good: Path) -> list[str]:
    """A saved state with wrong bytes."""
    Path("state").write_bytes(_bitten((good / "run.state").read_bytes(), chance))
    return ["run", "nrel5mw", "--wind-speed", "12", "--duration", "3", "--continue", "state"]


def unit(chance: random.Random, good: Path) -> Call:
    """A functional mock-up unit with a wrong description, wrong bytes, or no library for this machine."""
    import zipfile

    import meltemi
    from meltemi.exchange.fmu.controller import fmu_controller

    with zipfile.ZipFile("law.fmu", "w") as made:
        made.writestr("modelDescription.xml", _edited(UNIT, chance) if chance.random() < 0.7 else UNIT)
        made.writestr(chance.choice(["binaries/win64/law.dll", "binaries/linux64/law.so"]), chance.randbytes(64))
    if chance.random() < 0.3:
        Path("law.fmu").write_bytes(_bitten(Path("law.fmu").read_bytes(), chance))
    turbine = meltemi.load_turbine("nrel5mw")
    return Call(["law.fmu"], lambda: fmu_controller(Path("law.fmu"), turbine).fresh())  # type: ignore[misc]


UNIT = b"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="law" guid="{0}"><CoSimulation modelIdentifier="law"/><ModelVariables>
<ScalarVariable name="generator_speed" valueReference="0" causality="input"><Real start="0.0"/></ScalarVariable>
<ScalarVariable name="generator_torque" valueReference="1" causality="output"><Real unit="N.m"/></ScalarVariable>
</ModelVariables><ModelStructure><Outputs><Unknown index="2"/></Outputs></ModelStructure></fmiModelDescription>
"""


def view(chance: random.Random, good: Path) -> list[str]:
    """A result or a wind with wrong bytes, shown in three dimensions."""
    from meltemi.core.hdf5 import LENGTH

    name = chance.choice(["result.nc", "w.nc", "w.bts"])
    raw = (good / name).read_bytes()
    Path(name).write_bytes(_bitten(raw[:-LENGTH] if name.endswith(".nc") else raw, chance))
    return ["view", name]


KINDS: dict[str, Callable[[random.Random, Path], list[str] | Call]] = {
    "command": command, "case": case, "turbine": turbine, "text": text, "deck": deck, "hawc2": hawc2, "windio": windio,
    "discon": discon, "result": result, "csv": csv, "wind": wind, "plan": plan, "xlsx": xlsx, "parquet": parquet,
    "surrogate": surrogate, "live": live, "server": server, "api": api, "offshore": offshore, "sea": sea,
    "module": module, "coefficients": coefficients, "farm": farm, "hull": hull, "climate": climate, "state": state,
    "unit": unit, "view": view,
}  # fmt: skip


# what the calls take


def _junk(chance: random.Random, good: Any = 1.0) -> Any:
    """A value of another type, shape or size."""
    import numpy as np

    x = np.asarray(good if isinstance(good, int | float | list | np.ndarray) else 1.0, dtype=object)
    try:
        x = x.astype(float)
    except (TypeError, ValueError, OverflowError):  # a list of words
        x = np.ones(x.shape)
    changed = [x.tolist(), x[None], x.ravel()[:0], x.astype(str), -x, 1e300 * x, 0.0 * x, np.full(x.shape, np.nan)]
    return chance.choice([*JUNK, *changed, x.astype(complex), x.ravel()[:1], [x.tolist(), [1.0]], object(), {1, 2}])


@cache
def _functions(good: Path) -> list[tuple[str, Callable[..., Any], dict[str, Any]]]:
    """Functions of the public interface with good arguments."""
    import numpy as np

    import meltemi
    from meltemi import analysis, control, loads
    from meltemi.loads import durations, extrapolation
    from meltemi.postprocess import extremes
    from meltemi.wind import TurbulentWind, iec_wind

    machine = meltemi.load_turbine("nrel5mw")
    model = meltemi.build(machine)
    held = meltemi.Simulation(meltemi.Run(model, 12.0, duration=1.0, controller=control.ConstantController()))
    sine = np.sin(0.3 * np.arange(300.0))
    cycles = loads.rainflow_cycles(sine)
    result = meltemi.read_result(good / "result.nc")

    def step(demands: Any) -> None:
        held.reset()
        held.step(demands)

    def controlled(init: Any, sample_time: Any, demand: Any) -> None:
        def update(state: Any, measured: Any, demands: Any, dt: float) -> None:
            demands.generator_torque = demand
            demands.pitch[0] = demand

        controller = control.Controller(update=update, init=lambda start: init, sample_time=sample_time)
        meltemi.simulate(model, 12.0, duration=0.1, controller=controller)

    series = {"series": sine}
    return [
        ("simulate", lambda **k: meltemi.simulate(model, **k),
         {"wind": 12.0, "duration": 0.2, "transient": 0.0, "output_step": 0.05, "channels": ["rotor_speed"]}),
        ("step", step, {"demands": {"pitch": 0.1}}),
        ("step by vector", step, {"demands": [0.0] * 25}),
        ("controller", controlled, {"init": [0.0], "sample_time": 0.01, "demand": 0.1}),
        ("operating_point", lambda **k: analysis.operating_point(model, **k),
         {"wind": 9.0, "rotor_speed": 1.2, "pitch": 0.1}),
        ("build", meltemi.build, {"turbine": machine, "options": None}),
        ("options", meltemi.ModelOptions, {"time_step": 0.01, "blade_nodes": 10, "locked": [], "inflow_time": 4.0}),
        ("steady", meltemi.SteadyWind, {"speed": 9.0, "direction": 0.1, "shear_exponent": 0.2}),
        ("turbulent", TurbulentWind, {"speed": 9.0, "intensity": 0.1, "seed": 1}),
        ("series of wind", meltemi.wind.WindSeries, {"time": [0.0, 5.0], "speed": [9.0, 10.0]}),
        ("box", meltemi.wind.WindBox, {"velocity": np.ones((4, 3, 3, 3)), "dt": 0.5, "dy": 40.0, "dz": 40.0,
         "bottom": 10.0, "speed": 9.0}),
        ("iec", lambda **k: iec_wind(turbine=machine, **k), {"model": "EOG", "wind_class": "IB", "speed": 9.0}),
        ("load_turbine", meltemi.load_turbine, {"name": "nrel5mw"}),
        ("del", loads.damage_equivalent_load, {**series, "duration": 30.0, "slope": 4.0, "f_eq": 1.0, "bins": 10}),
        ("equivalent_loads", loads.equivalent_loads, {"result": result, "names": None, "f_eq": 1.0}),
        ("rainflow", loads.rainflow_cycles, {**series, "residue": "half"}),
        ("cycle_load", lambda **k: loads.cycle_load(cycles, **k), {"slope": 4.0, "reference": 1e7}),
        ("goodman", lambda **k: loads.goodman_cycles(cycles, **k), {"strength": 9.0, "mean": 0.0}),
        ("markov", lambda **k: loads.markov_matrix(cycles, **k),
         {"range_edges": [0.0, 1.0, 3.0], "mean_edges": [-2.0, 0.0, 2.0]}),
        ("sum_cycles", lambda **k: loads.sum_cycles([cycles, cycles], **k), {"weights": [1.0, 2.0]}),
        ("del_weights", loads.del_weights, {**series, "duration": 30.0, "slope": 4.0}),
        ("std_weights", loads.std_weights, dict(series)),
        ("spectrum", loads.power_spectrum, {"source": sine, "dt": 0.1, "segments": 3, "overlap": 0.5}),
        ("remove_bands", loads.remove_bands, {**series, "dt": 0.1, "bands": [(0.4, 0.6)]}),
        ("harmonic_bands", loads.harmonic_bands, {"rotor_frequency": 0.2, "multiples": [1.0, 2.0], "half_width": 0.02}),
        ("fit_extremes", extrapolation.fit_extremes, {"extremes": sine[:30], "distribution": "gumbel"}),
        ("extrapolate", extrapolation.extrapolate, {"extremes": [sine[:30], sine[30:60]],
         "probability_of_speed": [0.4, 0.6], "resamples": 5, "confidence": 90.0}),
        ("extreme_loads", extremes.extreme_loads, {"loads": np.ones((9, 6)), "plane": "xy"}),
        ("characteristic", extremes.characteristic_value, {"extremes": [1.0, 2.0], "rule": "mean"}),
        ("duration", durations.load_duration, {"load": sine, "shaft_speed": sine, "dt": 0.1,
         "load_edges": [-2.0, 0.0, 2.0]}),
        ("duty", durations.actuator_duty, {"position": sine, "dt": 0.1, "threshold": 0.0}),
        ("stops", durations.count_stops, {"speed": sine, "on": 0.5, "off": 0.1}),
        ("ensemble_load", loads.ensemble_load, {"loads": [1.0, 2.0], "slope": 4.0, "weights": [0.5, 0.5]}),
        ("mean_interval", loads.mean_interval, {"values": [1.0, 2.0], "confidence": 0.9}),
        ("travel", loads.actuator_travel, {"source": sine, "dt": 0.1}),
        ("weibull", loads.weibull_weights, {"speeds": [4.0, 6.0], "mean_speed": 8.0, "k": 2.0}),
        ("lifetime_del", loads.lifetime_del, {"loads": [1.0, 2.0], "slope": 4.0, "speeds": [4.0, 6.0],
         "mean_speed": 8.0}),
        ("period_statistics", loads.period_statistics, {"time": np.arange(30.0), "series": {"v": sine[:30]},
         "period": 10.0, "complete": 1.0}),
        ("azimuthal", loads.azimuthal_averages, {"result": result, "name": "rotor_speed"}),
        ("channel", lambda name: result[name], {"name": "rotor_speed"}),
        ("between", result.between, {"begin": 0.0, "end": 5.0}),
    ]  # fmt: skip


def _campaign(changes: Any) -> Any:
    from meltemi.loads import make_campaign

    settings: dict[str, Any] = {"rated_wind": 11.4, "quick": True, "duration": 10.0, "transient": 0.0}
    return make_campaign("nrel5mw", "IB", changes=changes, **settings)


@cache
def _campaign_plan() -> Any:
    from meltemi.loads.loadbase.plan import plan as planned
    from meltemi.loads.loadbase.table import load_table

    return planned(_campaign({"without": sorted(load_table(4).rows.keys() - {"1.2", "1.3", "6.4"})}))


@cache
def _session() -> Any:
    import meltemi
    from meltemi.view.live_session import Session

    return Session(meltemi.load_turbine("nrel5mw"), "baseline", wind_speed=8.0, turbulence=0.02)


@cache
def _server() -> Any:
    from meltemi.view.commands.live_server import LiveServer

    return LiveServer(lambda: "page").__enter__()


def _damage_file(source: Path, target: Path, chance: random.Random) -> None:
    """A copy of a YAML or JSON file with wrong keys and values, or wrong text."""
    from ruamel.yaml import YAML

    if chance.random() < 0.3:
        target.write_bytes(_edited(source.read_bytes(), chance))
        return
    content = _damaged(YAML(typ="safe").load(source.read_text()), chance)
    if target.suffix == ".json":
        with contextlib.suppress(Exception):
            target.write_text(json.dumps(content, default=str))
    else:
        _write_yaml(target, content)


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
        if not found:
            break
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
    from importlib.resources import files

    import numpy as np
    from ruamel.yaml import YAML

    import meltemi
    from meltemi.bladed_controllers.rosco import rosco_example
    from meltemi.core.yamlfile import write_record
    from meltemi.exchange.openfast_writer import write_openfast
    from meltemi.turbine.library import DATA
    from meltemi.turbine.windio_package import windio_file
    from meltemi.wind.fields import WindBox, WindSeries

    machine = meltemi.load_turbine("nrel5mw")
    model = meltemi.build(machine)
    found = meltemi.simulate(model, meltemi.SteadyWind(speed=12.0), duration=10.0)
    for name in ("result.nc", "result.outb", "result.out", "signals.csv"):
        meltemi.write_result(found, folder / name)
    noise = np.random.default_rng(1).normal(12.0, 1.0, (100, 8, 8, 3)).astype(np.float32)
    box = WindBox(noise, dt=0.5, dy=25.0, dz=25.0, bottom=10.0, speed=12.0, hub_height=90.0)
    for name in ("w.nc", "w.bts", "w.wnd", "w-u.bin", "hub.csv"):
        meltemi.io.write_wind(box, folder / name)
    series = WindSeries(time=[0.0, 5.0, 9.0], speed=[12.0, 14.0, 12.0], direction=[0.0, 0.1, 0.0])
    meltemi.io.write_wind(series, folder / "gust.wnd")
    (folder / "deck").mkdir()
    write_openfast(machine, folder / "deck")
    shutil.copytree(DATA / "iea10mw", folder / "hawc2")
    reference = YAML(typ="safe").load(windio_file("IEA-15-240-RWT.yaml", "fuzzing").read_text())
    (folder / "windio.yaml").write_text(json.dumps(_thin(reference), default=str))
    (folder / "extra.yaml").write_text(json.dumps(YAML(typ="safe").load((DATA / "iea15mw.yaml").read_text())))
    shutil.copy(rosco_example("Test_Cases/NREL-5MW/DISCON.IN"), folder)
    write_record(machine, folder / "turbine.yaml")
    text = files("meltemi.cases").joinpath("template.yaml").read_text(encoding="utf-8")
    (folder / "case.yaml").write_text(text)
    contents = [("turbine", machine), ("power", meltemi.load_turbine("pmsg20mw"))]
    for name, record in contents:
        (folder / f"{name}.json").write_text(json.dumps(_thin(record.model_dump(mode="json", exclude_none=True))))
    template = YAML(typ="safe").load(text)
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
    _make_loads(folder / "loads")
    _make_surrogate(folder / "surrogate")
    _make_sea(folder)
    _make_other(folder)


def _make_sea(folder: Path) -> None:
    """Turbines at sea, their decks and coefficients."""
    import meltemi
    from meltemi.core.hdf5 import to_netcdf
    from meltemi.exchange.openfast_writer import write_openfast
    from meltemi.floating.coefficients import DATA, read_coefficients
    from meltemi.hydro.wamit import wamit_texts

    for name in ("nrel5mw-monopile", "nrel5mw-spar", "iea22mw-semi"):
        machine = meltemi.load_turbine(name)
        content = _thin(machine.model_dump(mode="json", exclude_none=True))
        (folder / f"{name}.json").write_text(json.dumps(content))
        if name != "iea22mw-semi":
            (folder / "sea" / name).mkdir(parents=True)
            write_openfast(machine, folder / "sea" / name)
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "unit"))
    from test_capytaine_files import dataset

    c, own = read_coefficients("nrel5mw-spar"), folder / "coefficients"
    own.mkdir()
    shutil.copy(DATA / "nrel5mw-spar.npz", own / "spar.npz")
    to_netcdf(dataset(c), {}, own / "spar.nc")
    for end, content in wamit_texts(c).items():
        (own / f"spar{end}").write_text(content)


def _make_other(folder: Path) -> None:
    """Seas, farms, a hull, weather and a saved state."""
    import meltemi

    (folder / "sea.yaml").write_text(SEA)
    (folder / "farm.yaml").write_text(FARM)
    (folder / "floris.yaml").write_text("farm: {layout_x: [0, 630], layout_y: [0, 0], turbine_type: [nrel_5MW]}\n")
    (folder / "plant.yaml").write_text("wind_farm: {layouts: [{coordinates: {x: [0, 630.0], y: [0.0, 1.0]}}]}\n")
    (folder / "farm.fstf").write_text(FAST_FARM)
    (folder / "hull.yaml").write_text(HULL)
    head = "time,wind_speed,temperature,humidity,pressure,rain\n"
    hours = [(m, h) for m in range(1, 13) for h in range(24)]
    lines = (f"2020-{m:02d}-01T{h:02d}:00,{8 + 0.1 * h},{m - 3},0.7,1.0e5,0.2\n" for m, h in hours)
    (folder / "weather.csv").write_text(head + "".join(lines))
    place = "LOCATION,Town,-,GBR,SRC,1,51,0,0,25\n" + "DATA\n" * 7
    cells = "2020,{m},1,{h},60,?,8.0,4.0,70,101000" + ",0" * 10 + ",180,5.0" + ",0" * 13
    rows = "".join(cells.format(m=m, h=h + 1) + "\n" for m, h in hours)
    (folder / "weather.epw").write_text(place + rows)
    run = meltemi.Simulation(meltemi.Run(meltemi.build(meltemi.load_turbine("nrel5mw")), 12.0, duration=3.0))
    run.advance(20)
    meltemi.io.save_state(run, folder / "run.state")


SEA = """
kind: irregular
height: 6.0
period: 11.0
direction: 30 deg
seed: 3
stretching: wheeler
level: 1.2
current: {sub_surface: 0.6, near_surface: 0.3}
crest: {height: 9.0, time: 5.0}
"""
FARM = """
turbine: nrel5mw
positions: [[0, 0], [630, 0], [1260, 40]]
yaw: [20 deg, 0, 0]
wind: {kind: turbulence, speed: 9.0, intensity: 0.1}
duration: 120
transient: 30
wakes: {model: fast.farm, merging: quadratic, added_turbulence: true}
"""
FAST_FARM = """
------- FAST.Farm INPUT FILE
a farm
--- WIND TURBINES ---
2  NumTurbines - Number of wind turbines
WT_X WT_Y WT_Z WT_FASTInFile X0_High Y0_High Z0_High dX_High dY_High dZ_High
(m) (m) (m) (string) (m) (m) (m) (m) (m) (m)
0.0 0.0 0.0 "a.fst" 0 0 0 5 5 5
630.0 0.0 0.0 "a.fst" 0 0 0 5 5 5
--- WAKE DYNAMICS ---
1 Mod_Wake - Model
5.0 dr - Radial increment (m)
40 NumRadii - Number of radii
"""
HULL = """
depth: 200.0
members:
  - {start: [0, 0, -20], end: [0, 0, 15], diameter: 10.0}
  - {start: [-51.75, 0, -20], end: [-51.75, 0, 15], diameter: 12.5}
boxes:
  - {start: [0, 0, -16.5], end: [-51.75, 0, -16.5], width: 12.5, height: 7.0}
"""


def _make_loads(folder: Path) -> None:
    from meltemi import loads
    from meltemi.loads.loadbase.excel import write_excel
    from meltemi.loads.loadbase.table import load_table

    sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "unit"))
    from synthetic_base import synthetic_base

    folder.mkdir()
    synthetic_base(folder / "base", _campaign_plan())
    loads.write_campaign(_campaign_plan().campaign, folder)
    write_excel(load_table(4), folder / "table.xlsx")
    (folder / "changes.yaml").write_text(CHANGES)
    (folder / "settings.yaml").write_text(
        "extrapolation: weibull\nslopes: [4, 10]\nstrengths: {root_moment_flap: 9e7}\n"
    )
    (folder / "project.yaml").write_text("project: Ridge\nauthor: A. B.\nrevision: 1\n")
    (folder / "table.yaml").write_text(SECTORS)
    (folder / "site.json").write_text(json.dumps(_site()))


CHANGES = """
without: ["2.1", "2.2"]
defaults: {seeds: 3}
rows:
  "1.3": {speeds: "V_in to V_out by 4", factor: 1.3}
  "1.3b": {like: "1.3", yaw: "-8, 8"}
faults:
  stuck: {title: One blade is stuck, events: [{type: pitch_stuck, blade: 1, after: 1.0, lasts: 5.0}]}
"""
SECTORS = """
name: Ridge
sectors:
  - {frequency: 0.4, weibull_scale: 9.0, speed: [5, 15, 25], intensity: [0.2, 0.15, 0.13]}
  - {frequency: 0.6, weibull_scale: 8.0, weibull_shape: 1.9, speed: [5, 15], intensity: [0.2, 0.15], yaw_error: 0.1}
"""


def _site() -> dict[str, Any]:
    """A form of IEC 61400-15-1 with what is read of it."""
    layout = {"Annual Average Wind Speed": 8.0, "Weibull Scale Parameter": 9.0, "Weibull Shape Parameter": 2.0}
    ti = [0.0, 0.0, *[16.0] * 24]
    return {
        "DEF version": "1.1",
        "Project Information": {"Project name": "Ridge"},
        "Meta Data": {"Wind speed bin width": 1.0},
        "Turbine Layout Summary": {"T1": layout | {"V50": 40.0, "Air Density": 1.2, "TI15": 0.16}},
        "Ambient Mean TI": {"T1": {"Ambient mean TI all directions": ti}},
        "SD TI": {"T1": {"SD TI all directions": [0.1 * x for x in ti]}},
        "Extreme Ambient TI": {"T1": {"Extreme ambient TI": [1.5 * x for x in ti]}},
        "CcT": {"T1": {"CcT": 1.0}},
        "Inflow Angle": {"T1": {"Inflow angle max": 5.0}},
        "Shear": {"T1": {"Shear all directions": 0.2}},
    }


def _make_surrogate(folder: Path) -> None:
    import numpy as np

    from meltemi import loads

    load = "tower_base_moment_fore_aft"
    campaign = loads.SurrogateCampaign(
        turbine="nrel5mw",
        variables=("turbulence_intensity",),
        loads={load: 4.0},
        points=30,
        repeats=5,
        checks=10,
        seeds=2,
    )
    design = loads.surrogate_design(campaign)
    noise = np.exp(0.05 * np.random.default_rng(2).standard_normal((len(design), 1)))
    folder.mkdir()
    loads.write_surrogate_campaign(campaign, design, folder)
    made = loads.fit_surrogate(campaign, design, 1e6 * (2.0 + design.values[:, :1]) * noise)
    loads.write_surrogate(made, folder / "surrogate.json")


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
    from meltemi.compiler import compile_seconds
    from meltemi.core.errors import MeltemiError

    DEEP[0] = chance.random() < SHARE or kind in SHORT
    found = KINDS[kind](chance, good)
    words = found.words if isinstance(found, Call) else found
    before = set(folder.rglob("*"))
    out, err = io.StringIO(), io.StringIO()
    began, compiled = time.perf_counter(), compile_seconds()
    fate = Fate(0, words=words)
    sys.argv = ["meltemi", *words]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            if isinstance(found, Call):
                found.function()
            else:
                main()
    except MeltemiError as error:  # of a call; the command line tells it
        fate.status, fate.said = 2, str(error)
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
    ours = re.sub(r"it printed: .*", "", said)  # a library of another program
    raw = next((r for r in RAW if r in ours), "")
    half = [p for p in left if p.suffix == ".part" or "probe" in p.name]
    checks = {
        "exit status": fate.status not in (0, 2)
        and not (fate.status == 1 and ("the run ended early" in said or "DOUBTFUL: " in said)),
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
    import meltemi
    from meltemi import analysis
    from meltemi.analyses import campbell
    from meltemi.app import docs, warmup
    from meltemi.controllers import schemes
    from meltemi.core.errors import RunError
    from meltemi.papers import study
    from meltemi.papers.he2018 import rosco
    from meltemi.reports import inspection, wind_plots
    from meltemi.simulation import rotors, simulate
    from meltemi.studies import difference, flutter, observer, parked_modes
    from meltemi.tuning import compare
    from meltemi.verification import bench, verification
    from meltemi.view.commands import live_server

    _ = meltemi.simulate, analysis.operating_point  # as calls from Python find them

    _server()  # of the messages; that of the command waits for a page

    def begun(*_: Any, **__: Any) -> None:
        raise RunError(ACCEPTED)

    long: list[tuple[Any, str]] = [
        (campbell, "campbell"), (flutter, "flutter"), (parked_modes, "parked_stability"), (bench, "benchmark"),
        (compare, "compare"), (schemes, "design_controllers"), (observer, "observer"),
        (docs, "built_site"), (live_server, "LiveServer"),
        (inspection, "inspect_turbine"), (verification, "verification"), (warmup, "warmup"),
        (rosco, "compare_with_rosco"), (study, "reproduce"),
    ]  # fmt: skip
    for module, name in long:
        setattr(module, name, begun)

    def seldom(module: Any, name: str, **instead: Any) -> None:
        """Done for one input of DEEP only, then as short as may be."""
        whole = getattr(module, name)

        def short(*arguments: Any, **named: Any) -> Any:
            if not DEEP[0]:
                begun()
            for name, most in instead.items():
                if isinstance(named.get(name), int | float):
                    named[name] = min(named[name], most)
            return whole(*arguments, **named)

        setattr(module, name, short)

    seldom(simulate, "simulate", duration=SIMULATED)
    seldom(rotors, "operating_point")
    seldom(difference, "compare_results")
    seldom(wind_plots, "plot_wind")


DEEP = [False]
"""Whether this input is followed to its end; most are of interest for how they are read."""
SHARE = 0.06
"""Of such inputs."""
SHORT = ("api", "live")
"""Kinds whose inputs are all followed to their end."""


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
    counts, slowest, took, found = Counter[tuple[str, str]](), Counter[str](), Counter[str](), {}
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
            asked = time.perf_counter()
            fate = watch.run(kind, number)
            took[kind] += round(1e6 * (time.perf_counter() - asked))
            how = "found" if fate.finding else "refused" if fate.status == 2 else "accepted"
            counts[kind, how] += 1
            slowest[kind] = max(slowest[kind], round(fate.seconds))
            if fate.finding:
                known = found.setdefault((fate.finding, fate.where), [])
                known.append(f"{kind}:{number}")
                if len(known) == 1:
                    print(f"{kind}:{number} {fate.finding} {fate.where}", flush=True)
            i += 1
    print(f"\n{'kind':10}{'inputs':>8}{'accepted':>10}{'refused':>9}{'findings':>10}{'mean s':>8}{'slowest':>9}")
    for kind in kinds:
        n = [counts[kind, how] for how in ("accepted", "refused", "found")]
        print(
            f"{kind:10}{sum(n):8}{n[0]:10}{n[1]:9}{n[2]:10}{1e-6 * took[kind] / max(sum(n), 1):8.2f}{slowest[kind]:9}"
        )
    print(f"seed {given.seed}, {i} inputs in {time.perf_counter() - began:.0f} s, {len(found)} different findings")
    for (what, where), inputs in found.items():
        print(f"  {what} at {where}: {len(inputs)} times, such as --seed {given.seed} --only {inputs[0]}")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
