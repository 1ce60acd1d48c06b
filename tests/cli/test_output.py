"""What all commands share: JSON, the next command, progress, completion in shells."""

from __future__ import annotations

import csv
import json
import os
import pty
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import typer
from terminal import Command, check_next

from meltemi.app import terminal
from meltemi.app.cli import app
from meltemi.app.commands import SECTIONS
from meltemi.report.tables import number


def all_commands() -> dict[str, Any]:
    """Commands by what is typed, those of groups and other packages included."""
    group: Any = typer.main.get_command(app)
    context = group.make_context("meltemi", [], resilient_parsing=True)
    found = {}
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if hasattr(command, "list_commands"):
            inner = command.make_context(name, [], parent=context, resilient_parsing=True)
            found |= {f"{name} {n}": command.get_command(inner, n) for n in command.list_commands(inner)}
        else:
            found[name] = command
    return found


COMMANDS = all_commands()


def test_every_command_has_json_once() -> None:
    assert {"run", "loads plan", "loads show", "verify", "bench", "reproduce"} <= set(COMMANDS)
    for name, command in COMMANDS.items():
        options = [option for p in command.params for option in p.opts]
        assert options.count("--json") == 1, name


def test_the_help_lists_every_command_in_one_section(command: Command) -> None:
    group: Any = typer.main.get_command(app)
    names = [name for section in SECTIONS.values() for name in section.split()]
    assert sorted(names) == sorted(group.list_commands(group.make_context("meltemi", [], resilient_parsing=True)))
    text = command("--help").out
    assert [line for line in text.splitlines() if line.rstrip(":") in SECTIONS] == [f"{s}:" for s in SECTIONS]


def test_long_commands_suggest_the_next_one(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The fixture ``command`` tests the lines; here are the commands that other tests do not run to their end."""
    from meltemi.app import warmup
    from meltemi.papers import study
    from meltemi.verification import bench, verification

    class Report(SimpleNamespace):
        tables, failed, lead, files, doubtful = (), {}, "", (), {}

        def summary(self) -> str:
            return "all passed"

        def write(self, out: Path) -> list[Path]:
            return [out / "report.md"]

    monkeypatch.setattr(verification, "verification", lambda **_: Report())
    monkeypatch.setattr(study, "reproduce", lambda *_, **__: Report())
    monkeypatch.setattr(bench, "benchmark", lambda **_: {"step": 1e-5})
    monkeypatch.setattr(bench, "report_lines", lambda figures: [f"{figures['step']:g} s"])
    monkeypatch.setattr(warmup, "warmup", lambda done: done(warmup.Stage("wind", 1.5, 3, 2)) or tmp_path)
    for words in (("verify", "--quick"), ("verify",), ("reproduce", "wang2021", "--quick"), ("reproduce", "he2018")):
        assert command(*words, "--out", tmp_path).status == 0
    assert "1e-05 s" in command("bench").out
    assert json.loads(command("bench", "--json").out)["figures"] == {"step": 1e-5}
    (row,) = json.loads(command("warmup", "--json").out)["tables"][0]["rows"]
    assert row == {"stage": "wind", "signatures": 3, "compiled": 2, "time": 1.5}
    assert command("warmup").status == 0


def test_json_has_numbers_with_units_and_nothing_else_is_printed(command: Command, tmp_path: Path) -> None:
    options = ("--wind-speed", 10, "--duration", 5, "--channels", "RootMyc1,RotSpeed", "--out", tmp_path)
    ran = command("run", "nrel5mw", *options, "--json")
    found = json.loads(ran.out)
    assert (ran.status, found["command"]) == (0, "run")
    (table,) = found["tables"]
    with (tmp_path / "statistics.csv").open(newline="") as file:
        expected = list(csv.DictReader(file))
    assert [row["unit"] for row in table["rows"]] == ["kN m", "rpm"]
    for row, other in zip(table["rows"], expected, strict=True):
        assert row["mean"] == pytest.approx(float(other["mean"]), rel=1e-14), "all digits"
    assert sorted(found["files"]) == sorted(map(str, tmp_path.iterdir()))
    assert any("5 s simulated" in note for note in found["notes"])
    check_next(f"next: {found['next']}")


@pytest.mark.slow
def test_json_of_scans_has_all_points(command: Command, tmp_path: Path) -> None:
    ran = command("power-curve", "pmsg20mw", "--wind-speeds", "8,12", "--out", tmp_path, "--json")
    (table,) = json.loads(ran.out)["tables"]
    assert table["units"]["torque"] == "kN m" and table["units"]["wind"] == "m/s"
    assert [row["wind"] for row in table["rows"]] == [8.0, 12.0]
    assert table["rows"][1]["power"] == pytest.approx(20e3, rel=0.05)
    (failed,) = json.loads(command("turbines", "--json").out)["tables"]
    assert {"nrel5mw", "iea22mw"} <= {row["name"] for row in failed["rows"]}


def test_json_has_the_error(command: Command) -> None:
    ran = command("channels", "--search", "nothing of this", "--json")
    found = json.loads(ran.out)
    assert ran.status == 2 and "no channel name" in ran.err
    assert "no channel name" in found["error"] and found["tables"] == []


def test_json_of_incomplete_results_has_the_messages(command: Command, tmp_path: Path) -> None:
    ran = command("power-curve", "pmsg20mw", "--wind-speeds", "8,24", "--out", tmp_path, "--json")
    assert ran.status == 1
    found = json.loads(ran.out)
    assert "24" in found["messages"][-1] and found["messages"][-1] in ran.err


def test_records_of_a_table() -> None:
    head = ["", "wind\nm/s", "root oop kN m", "change %", "DEL 1 Hz", "wind\nm/s"]
    found = terminal.records("t", head, [["1.1", number(1.0 / 3.0), "-", "", "5", "x"]], 1)
    assert found["units"] == {"wind": "m/s", "root oop": "kN m", "change": "%", "wind m/s": "m/s"}
    row = {"item": "1.1", "wind": 1.0 / 3.0, "root oop": "-", "change": None, "DEL 1 Hz": 5, "wind m/s": "x"}
    assert found["rows"] == [row]
    assert terminal.records("t", ["a"], [[number(float("nan"))]], 0)["rows"] == [{"a": None}]


def test_rates() -> None:
    assert terminal.rate(1200.0, 4.0, "s") == "300 times real time"
    assert terminal.rate(3.0, 60.0, "runs") == "3 runs/min"
    assert terminal.rate(20.0, 2.0, "points") == "10 points/s"
    assert terminal.rate(1.0, 600.0, "runs") == "6 runs/h"
    assert terminal.time_left(0.25, 20.0, 0.5) == "0:00:40 left"
    assert terminal.time_left(0.0, 20.0, 1.0) == ""
    assert terminal.rate(0.0, 1.0, "runs") == terminal.rate(1.0, 0.0, "runs") == ""


PROGRESS = """
from meltemi.app.terminal import progress_bar
with progress_bar("work", 100, "runs") as progress:
    for i in range(5):
        __import__("time").sleep(0.15); progress((i + 1) / 5)
"""


@pytest.mark.slow
def test_progress_shows_rate_and_time_left_on_a_terminal_only() -> None:
    quiet = subprocess.run([sys.executable, "-c", PROGRESS], capture_output=True, text=True, check=True)
    assert (quiet.stdout, quiet.stderr) == ("", "")
    main, side = pty.openpty()
    ran = subprocess.Popen(
        [sys.executable, "-c", PROGRESS], stderr=side, env=os.environ | {"COLUMNS": "120", "TERM": "xterm"}
    )
    ran.wait(30)
    os.close(side)
    time.sleep(0.05)
    shown = os.read(main, 100_000).decode()
    os.close(main)
    assert "runs/s" in shown and "left" in shown and "work" in shown and "0:00:00 left" in shown


def completed(*words: str) -> list[str]:
    """What a shell offers for the last word."""
    environment = os.environ | {
        "_MELTEMI_COMPLETE": "complete_bash",
        "COMP_WORDS": " ".join(["meltemi", *words]),
        "COMP_CWORD": str(len(words)),
    }
    code = "import sys; sys.argv = ['meltemi']; from meltemi.app.cli import main; main()"
    return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True).stdout.split()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("power-c",), ["power-curve"]),
        (("veri",), ["verify"]),
        (("loads", "pl"), ["plan"]),
        (("run", "iea22"), ["iea22mw", "iea22mw-monopile", "iea22mw-semi", "iea22mw-semi-flexible"]),
        (("run", "nrel5mw", "--controller", "r"), ["rosco"]),
        (("run", "nrel5mw", "--channels", "RotSpeed,RootMyc"), [f"RotSpeed,RootMyc{i}" for i in (1, 2, 3)]),
        (("compare", "nrel5mw", "--controllers", "cpc,cp"), ["cpc,cpc", "cpc,cpfc", "cpc,cpfc12"]),
        (("wind", "ET"), ["ETM"]),
        (("reproduce", "he"), ["he2018"]),
    ],
)
def test_names_are_completed(words: tuple[str, ...], expected: list[str]) -> None:
    assert completed(*words) == expected
