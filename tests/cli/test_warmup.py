"""Compilation: announced once, and done beforehand by ``meltemi warmup``."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest
from terminal import Command

from meltemi import InputError, MeltemiError, Model, SteadyWind, simulate
from meltemi.app import warmup
from meltemi.app.cli import main
from meltemi.compiler import kernels
from meltemi.compiler.kernels import COLD


@pytest.mark.slow
def test_a_cold_start_says_what_happens_and_that_it_happens_once(
    model: Model, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    simulate(model, SteadyWind(speed=9.0), duration=0.1)
    capsys.readouterr()  # this one may have been cold itself
    arguments = ["meltemi", "run", "nrel5mw", "--wind-speed", "9", "--duration", "1", "--out", str(tmp_path)]
    beside: list[list[str]] = []
    monkeypatch.setattr(sys, "argv", arguments)
    for cold in (True, False):
        monkeypatch.setattr(kernels, "_looked", False)
        if cold:
            monkeypatch.setattr(kernels, "is_cold", lambda: True)
            monkeypatch.setattr(warmup, "available_cores", lambda: 2)
            monkeypatch.setattr(warmup, "Popen", lambda command, **how: beside.append(command))
        else:
            monkeypatch.undo()  # the real one: everything is compiled
            monkeypatch.setattr(sys, "argv", arguments)
        with pytest.raises(SystemExit) as end:
            main()
        assert not end.value.code
        said = capsys.readouterr().err
        assert said == (COLD + "\n" if cold else "")
    assert [command[1:] for command in beside] == [["-m", "meltemi.app.warmup", "stepping"]]
    assert "Compiling" in COLD
    assert "once" in COLD


class _Compiling:
    """What Numba tells when it compiles."""

    def __init__(self, module: str, *arguments: object) -> None:
        def function() -> None: ...

        function.__module__ = module
        dispatcher = type("Dispatcher", (), {"py_func": staticmethod(function)})
        self.data = {"dispatcher": dispatcher, "args": arguments}


def test_each_feature_that_compiles_long_is_announced_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(kernels, "_FEATURES_TOLD", set())
    heard = kernels.Announcer(patience=0.1)
    supervisor, node = _Compiling("meltemi.supervisor.supervised"), _Compiling("meltemi.aero.bem")
    dual = type("DualArrayType", (), {})()
    steps = ((node, 0.02), (supervisor, 0.2), (supervisor, 0.2), (_Compiling("meltemi.simulation.step", dual), 0.2))
    for what, seconds in steps:
        heard.on_start(what)
        heard.on_start(node)  # one within the other
        heard.on_end(node)
        time.sleep(seconds)
        heard.on_end(what)
    said = capsys.readouterr().err.splitlines()
    assert said == [
        f"Compiling {what} for this machine: this happens once ..." for what in ("the supervisor", "derivatives")
    ]


@pytest.mark.slow
def test_a_function_that_compiles_long_says_so() -> None:
    """In a process of its own, with an empty cache."""
    code = """
import numba, time
from meltemi.compiler import kernels
from numba.core import event
heard = kernels.Announcer(patience=0.0)
event.register("numba:compile", heard)
@numba.njit
def own(x):
    return x + 1.0
own(1.0)
time.sleep(0.2)
"""
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "Compiling __main__.own for this machine: this happens once ..." in ran.stderr


@pytest.mark.long
def test_warmup_leaves_nothing_to_compile(command: Command) -> None:
    assert command("warmup").status == 0
    ran = command("warmup", "--json")
    assert ran.status == 0
    assert "once" in ran.err
    told = json.loads(ran.out)
    assert str(kernels.cache_folder()) in told["notes"][-1]
    assert {row["stage"]: row["compiled"] for row in told["tables"][0]["rows"]} == dict.fromkeys(warmup.STAGES, 0)


@pytest.mark.long
def test_after_warmup_a_comparison_compiles_nothing(command: Command, tmp_path: Path) -> None:
    """Linear models, tuning, turbulence, load controllers with flaps: all of them in a new process."""
    assert command("warmup").status == 0
    code = """
import sys
from meltemi.app.cli import main
from meltemi.compiler import statistics
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
print(*statistics())
"""
    options = "--ntm --class IIB --wind-speed 18 --controllers cpc,cpfc --seeds 1 --duration 45 --transient 20"
    arguments = ["compare", "nrel5mw", *options.split(), "--out", str(tmp_path / "out")]
    ran = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True)
    signatures, compiled = map(int, ran.stdout.splitlines()[-1].split())
    assert signatures >= 10 and compiled == 0
    assert COLD not in ran.stderr


@pytest.mark.slow
def test_a_stage_that_fails_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=r"no stage 'run'.*'runs'"):
        warmup.warmup(["run"])
    monkeypatch.setitem(warmup.STAGES, "other", lambda: None)  # the process does not know it
    with pytest.raises(MeltemiError, match=r"warmup: other: KeyError"):
        warmup.warmup(["other"])


def test_without_a_folder_there_is_nothing_to_warm(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warmup, "cache_folder", lambda: None)
    with pytest.raises(InputError, match="MELTEMI_CACHE_DIR"):
        warmup.warmup()
