"""``meltemi compare``: same winds for all, the same numbers as from Python, one page that needs nothing else."""

from __future__ import annotations

import csv
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from terminal import Command, Ran

import meltemi
from meltemi import Model
from meltemi.controllers import schemes, tuning
from meltemi.controllers.names import SCHEMES
from meltemi.simulation.channels import standard
from meltemi.simulation.result import Result
from meltemi.tuning.comparison_report import by_blade

OWN = """
import meltemi
from meltemi.control import signals as s

def controller(turbine):
    law = meltemi.control.BaselineController(turbine)
    def update(state, measured, demands, dt):
        law.update(state, measured, demands, dt)
        {body}
    return meltemi.Controller(update, init=law.init, name="mine")
"""
FAILS_ONCE = """
import meltemi
from meltemi.control import signals as s

runs = []

def controller(turbine):
    law = meltemi.control.BaselineController(turbine)
    def init(start):
        runs.append(start)
        return law.init(start)
    def update(state, measured, demands, dt):
        law.update(state, measured, demands, dt)
        if len(runs) == 2 and measured[s.TIME] > 30.0:
            demands[s.PITCH_DEMAND] = float("nan")
    return meltemi.Controller(update, init=init, name="mine")
"""
WIND = ("--ntm", "--class", "IIB", "--wind-speed", 18)
SHORT = (*WIND, "--duration", 45, "--transient", 20)
"""25 s are judged: the spectra's resolution must be coarser than usual."""
FILES = ("comparison.csv", "seeds.csv", "spectra.png", "series.png", "comparison.html")
WITH_LOOPS = (*FILES, "changes.png", "bode.png", "tuning.csv")


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Loops are tuned at one operating point."""
    monkeypatch.setattr(schemes, "linear_models", lambda model, progress=None: tuning.linear_models(model, [18.0]))


def own(folder: Path, body: str = "pass", name: str = "own.py") -> Path:
    path = folder / name
    path.write_text(OWN.format(body=body))
    return path


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def wrote(ran: Ran, out: Path, *names: str) -> None:
    assert sorted(ran.files) == sorted(out / name for name in names) == sorted(out.iterdir())


@pytest.mark.long
def test_three_schemes_in_two_winds(command: Command, tmp_path: Path, model: Model) -> None:
    out, mine = tmp_path / "new" / "out", own(tmp_path)
    options = (*SHORT, "--spectrum", "vonkarman", "--seeds", 2, "--seed", 3)
    ran = command("compare", "nrel5mw", *options, "--controllers", f"cpc,feedback,{mine}", "--out", out)
    assert (ran.status, ran.err) == (0, "")
    wrote(ran, out, *WITH_LOOPS)
    assert "nrel5mw: NTM class IIB, von Karman turbulence 18 m/s" in ran.out
    for text in ("RootMyc1 DEL", "of all seeds", "share %", "6 runs of 45 s in ", "tuning in "):
        assert text in ran.out
    seeds = rows(out / "seeds.csv")
    assert [(row["seed"], row["scheme"]) for row in seeds] == [
        (seed, scheme) for seed in ("3", "4") for scheme in ("cpc", "feedback", "own")
    ]
    # cpc is the baseline in that wind, and the own controller does the same
    wind = meltemi.iec_wind("NTM", turbine=model.turbine, wind_class="IIB", speed=18.0, spectrum="vonkarman", seed=4)
    alone = meltemi.simulate(model, wind, duration=45.0).between(20.0, 45.0)
    expected = 1e-3 * alone["RootMyc1"].std()
    found = {row["scheme"]: float(row["RootMyc1 std [kN m]"]) for row in seeds if row["seed"] == "4"}
    assert found["cpc"] == pytest.approx(expected, rel=1e-6) and found["own"] == pytest.approx(expected, rel=1e-6)
    assert found["feedback"] < 0.95 * expected
    # the table has their means
    table = {(row["quantity"], row["scheme"]): row for row in rows(out / "comparison.csv")}
    values = [float(row["RootMyc1 std [kN m]"]) for row in seeds if row["scheme"] == "feedback"]
    assert float(table["RootMyc1 std", "feedback"]["mean"]) == pytest.approx(np.mean(values), rel=1e-3)
    assert float(table["RootMyc1 std", "own"]["change [%]"]) == pytest.approx(0.0, abs=1e-6)
    assert table["RootMyc1 std", "cpc"]["unit"] == "kN m"
    (tuned,) = rows(out / "tuning.csv")
    assert tuned["loop"] == "feedback: 1P pitch" and float(tuned["wind [m/s]"]) == 18.0
    assert float(tuned["phase margin [deg]"]) >= 60.0 and float(tuned["gain margin"]) >= 2.0
    page = (out / "comparison.html").read_text(encoding="utf-8")
    assert not re.search(r'(?:src|href)="(?!data:|#)', page), "it opens offline"
    assert page.count("data:image/png;base64,") == 4
    for heading in ("Results", "Ideal removal of 1P and 2P", "Spectra", "Series", "Gains and margins", "Reproduction"):
        assert f"<h2>{heading}</h2>" in page
    given = shlex.join(map(str, ("compare", "nrel5mw", *options)))
    for text in (f"meltemi {given}", f"meltemi {meltemi.__version__}", "NTM class IIB", "3 to 4", "45 s each"):
        assert text in page


@pytest.mark.long
def test_schemes_follow_a_power_reference(command: Command, tmp_path: Path) -> None:
    """Half of rated power, and a step of a file: A2 pitches less than A0, both follow."""
    (tmp_path / "steps.csv").write_text("time,share\n0,0.5\n30,0.5\n30,0.6\n")
    for power, most in (("0.5", 2550.0), (str(tmp_path / "steps.csv"), 3050.0)):
        out = tmp_path / "out"
        arguments = (*SHORT, "--seeds", 1, "--controllers", "A0,A2", "--power", power, "--out", out)
        ran = command("compare", "nrel5mw", *arguments)
        assert (ran.status, ran.err) == (0, "")
        found = {(row["quantity"], row["scheme"]): float(row["mean"]) for row in rows(out / "comparison.csv")}
        for scheme in ("A0", "A2"):
            assert 2300.0 < found["power mean", scheme] < most
            assert 0.0 < found["tracking error", scheme] < 400.0
        assert found["pitch travel", "A2"] < found["pitch travel", "A0"]
        assert "deal removal" not in ran.out + (out / "comparison.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_one_scheme_and_one_seed_leave_nothing_of_an_earlier_comparison(command: Command, tmp_path: Path) -> None:
    for name in WITH_LOOPS:
        (tmp_path / name).write_text("old")
    ran = command("compare", "nrel5mw", *SHORT, "--seeds", 1, "--controllers", "cpc", "--out", tmp_path)
    assert (ran.status, ran.err) == (0, "")
    wrote(ran, tmp_path, *FILES)
    assert not any(path.read_bytes() == b"old" for path in tmp_path.iterdir())
    assert "of all seeds" not in ran.out


@pytest.mark.slow
def test_a_wind_that_one_scheme_does_not_survive_is_left_out_for_all(command: Command, tmp_path: Path) -> None:
    mine, out = tmp_path / "own.py", tmp_path / "out"
    mine.write_text(FAILS_ONCE)
    ran = command(
        "compare", "nrel5mw", *SHORT, "--seeds", 2, "--workers", 1, "--controllers", f"cpc,{mine}", "--out", out
    )
    assert ran.status == 1
    said = re.fullmatch(r"excluded: scheme 'own' in wind 1: at t = (3\d\.\d+) s the controller .*\n", ran.err)
    assert said, ran.err
    assert {row["seed"] for row in rows(out / "seeds.csv")} == {"2"}
    assert "scheme &#39;own&#39; in wind 1" in (out / "comparison.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_scheme_that_fails_in_every_wind_is_left_out(command: Command, tmp_path: Path) -> None:
    """The others are compared all the same, and a second try takes their runs over."""
    mine, out = own(tmp_path, "demands[s.PITCH_DEMAND] = float('nan') if measured[s.TIME] > 1 else 0"), tmp_path / "out"
    arguments = ("compare", "nrel5mw", *SHORT, "--seeds", 1, "--controllers", f"cpc,{mine}", "--out", out)
    ran = command(*arguments)
    assert ran.status == 1
    assert ran.err.startswith("excluded: scheme 'own' in wind 1: at t = 1.")
    assert {row["scheme"] for row in rows(out / "seeds.csv")} == {"cpc"}
    again = command(*arguments)
    assert again.status == 1
    assert again.err.startswith("reading 1 finished runs")


def test_flaps_that_a_scheme_adds_are_told(command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before anything runs: their increments are those of another section."""

    def stop(*_: object) -> None:
        raise meltemi.InputError("stop")

    monkeypatch.setattr("meltemi.build", stop)
    ran = command("compare", "nrel5mw", *SHORT, "--controllers", "cpc,cpfc", "--out", tmp_path / "out")
    assert "note: nrel5mw has no flaps; those of the scheme are added, their increments assumed: span, " in ran.err
    plain = command("compare", "nrel5mw", *SHORT, "--controllers", "cpc,ipc", "--out", tmp_path / "out")
    assert "note" not in plain.err and "stop" in plain.err


def test_ideal_removal_is_for_schemes_that_act_by_blade() -> None:
    """Power schemes pitch all blades alike: a share of the removal of 1P means nothing for them."""
    time = np.linspace(0.0, 1.0, 11)

    def ran(**columns: np.ndarray) -> Any:
        data = np.stack([0.0 * time + columns.get(name, 0.0) for name in ("pitch_1", "pitch_2")], axis=1)
        return SimpleNamespace(schemes=("A0",), results=lambda scheme: found(data))

    def found(data: np.ndarray) -> Result:
        return Result(time, data, tuple(standard()[name] for name in ("pitch_1", "pitch_2")))

    assert not by_blade(ran(pitch_1=np.sin(time), pitch_2=np.sin(time)))
    assert by_blade(ran(pitch_1=np.sin(time)))


def test_no_wind_is_left(command: Command, tmp_path: Path) -> None:
    mine, out = own(tmp_path, "demands[s.PITCH_DEMAND] = float('nan') if measured[s.TIME] > 1 else 0"), tmp_path / "out"
    ran = command("compare", "nrel5mw", *SHORT, "--seeds", 1, "--controllers", f"{mine}", "--out", out)
    assert (ran.status, ran.out) == (2, "")
    assert re.match(
        r"error: compare: in no wind did all schemes reach the end of their runs; "
        r"first of 1 failures: scheme 'own' in wind 1: "
        r"at t = 1\.\d+ s the controller 'mine' returned pitch_1 = nan",
        ran.err,
    )
    assert not out.exists()


@pytest.mark.slow
@pytest.mark.parametrize("body", ["_thread.interrupt_main(); time.sleep(1.0)", "raise KeyboardInterrupt"])
def test_interrupted_comparisons_leave_nothing(command: Command, tmp_path: Path, body: str) -> None:
    mine, out = (
        own(tmp_path, f"import _thread, time\n        if abs(measured[s.TIME] - 1.0) < 1e-9: {body}"),
        tmp_path / "out",
    )
    ran = command("compare", "nrel5mw", *SHORT, "--workers", 1, "--controllers", f"{mine}", "--out", out)
    assert (ran.status, ran.out, ran.err) == (130, "", "interrupted\n")
    assert not out.exists()


@pytest.fixture
def files(tmp_path: Path) -> Iterator[Path]:
    """Files that are no controllers."""
    (tmp_path / "empty.py").write_text("x = 1\n")
    (tmp_path / "broken.py").write_text("def controller(turbine:\n")
    (tmp_path / "raises.py").write_text("def controller(turbine):\n    return turbine.nothing\n")
    (tmp_path / "number.py").write_text("def controller(turbine):\n    return 3\n")
    (tmp_path / "cpc.py").write_text(OWN.format(body="pass"))
    return tmp_path


@pytest.mark.parametrize(
    ("changed", "parts"),
    [
        (("--controllers", "cpc,icp"), ("no controller 'icp': did you mean", "'ipc'", "a Python file")),
        (("--controllers", "collective"), ("no controller 'collective'",)),
        (("--controllers", ","), ("name at least one of baseline",)),
        (("--controllers", "cpc,ipc,cpc"), ("'cpc' is named twice",)),
        (("--controllers", "cpc,{}/none.py"), ("none.py: cannot be read (No such file",)),
        (("--controllers", "cpc,{}/cpc.py"), ("two of them are called 'cpc'",)),
        (("--controllers", "cpc,{}/empty.py"), ("empty.py: expected a function controller(turbine)",)),
        (("--controllers", "cpc,{}/broken.py"), ("broken.py: SyntaxError",)),
        (("--controllers", "cpc,{}/raises.py"), ("raises.py: controller(turbine) raised AttributeError",)),
        (("--controllers", "cpc,{}/number.py"), ("number.py: controller(turbine) must return a meltemi.Controller",)),
        (("--transient", 45), ("transient 45 s must lie below the duration 45 s",)),
        (("--transient", 100), ("transient 100 s must lie below the duration 45 s",)),
        (("--transient", -1), ("transient -1 s",)),
        (("--transient", 40), ("5 s are left after the transient of 40 s", "20 s are needed")),
        (("--duration", 0), ("duration",)),
        (("--seeds", 0), ("--seeds 0: expected 1 to 1000",)),
        (("--seed", -2), ("--seed -2",)),
        (("--workers", 0), ("--workers 0",)),
        (("--spectrum", "vonkarmann"), ("--spectrum 'vonkarmann': did you mean 'vonkarman'",)),
        (("--class", "IVB"), ("IVB",)),
        (("--iec", "EOG"), ("is not turbulent, so seeds do not apply: use --ntm, --iec ETM or --turbulence",)),
        (("--power", "0.5"), ("the controller 'cpc' does not follow a power reference; name some of A0, A1, A2, A3",)),
        (("--pitch-actuator", "secondorder"), ("--pitch-actuator 'secondorder': did you mean 'second_order'",)),
    ],
)
def test_what_cannot_be_compared_is_refused_at_once(
    command: Command, files: Path, changed: tuple[str, Any], parts: tuple[str, ...]
) -> None:
    name, value = changed
    options = dict(zip(SHORT[1::2], SHORT[2::2], strict=True)) | {"--iec": "NTM"}
    options[name] = str(value).format(files)
    out = files / "out"
    ran = command("compare", "nrel5mw", *(part for pair in options.items() for part in pair), "--out", out)
    assert (ran.status, ran.out) == (2, "")
    assert ran.err.startswith("error: ") and ran.err.count("\n") == 1
    for part in parts:
        assert part in ran.err
    assert not out.exists()


def test_the_help_lists_the_schemes(command: Command) -> None:
    ran = command("compare", "--help")
    assert ran.status == 0
    for name, scheme in SCHEMES.items():
        assert re.search(rf"^ +{name} +{re.escape(scheme.about)}$", ran.out, re.MULTILINE)
