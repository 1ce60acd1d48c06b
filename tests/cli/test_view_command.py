"""``meltemi view``, ``run --view`` and ``campbell --view``: what they write, and what they refuse."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from terminal import Command

from meltemi.core.errors import Status
from meltemi.simulation.result import Result
from meltemi.view.commands.view import _names

RUN = ("run", "nrel5mw", "--wind-speed", 10, "--duration", 1)


@pytest.fixture
def no_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures take most of the time; other tests look at them."""
    monkeypatch.setattr("meltemi.report.plots.save", lambda figure, path: path)


@pytest.mark.usefixtures("no_plots")
def test_a_run_writes_its_view_and_view_repeats_it(command: Command, tmp_path: Path) -> None:
    out, again, both = tmp_path / "out", tmp_path / "again.html", tmp_path / "both.html"
    ran = command(*RUN, "--view", "--out", out)
    assert ran.status == 0, ran.err
    assert out / "turbine.html" in ran.files
    ran = command("view", out, "-o", again)
    assert (ran.status, ran.files) == (0, [again])
    assert again.read_text("utf-8").replace('"names":["out"]', '"names":["result"]') == (
        (out / "turbine.html").read_text("utf-8")
    )
    ran = command("view", out, out / "result.nc", "-o", both, "--channels", "RootMyc1,GenPwr", "--theme", "dark")
    assert (ran.status, ran.files) == (0, [both])
    text = both.read_text("utf-8")
    assert '"names":["out","result"]' in text
    assert '"theme":"dark"' in text


@pytest.mark.parametrize(
    ("files", "names"),
    [
        (["a.nc", "b.nc"], ["a", "b"]),
        (["one/result.nc", "two/result.nc"], ["one", "two"]),
        (["one/a.nc", "one/a.outb"], ["1: one/a", "2: one/a"]),
    ],
)
def test_names_tell_the_results_apart(files: list[str], names: list[str]) -> None:
    assert _names([Path(file) for file in files]) == names


@pytest.mark.usefixtures("no_plots")
def test_a_case_file_asks_for_the_view(command: Command, tmp_path: Path) -> None:
    case = tmp_path / "case.yaml"
    case.write_text("turbine: nrel5mw\nwind: {kind: steady, speed: 10.0}\nduration: 1.0\nview: true\n", "utf-8")
    ran = command("run", case, "--out", tmp_path / "out")
    assert ran.status == 0, ran.err
    assert tmp_path / "out" / "turbine.html" in ran.files


@pytest.mark.usefixtures("no_plots")
def test_a_result_without_motion_names_the_option(command: Command, tmp_path: Path) -> None:
    assert command(*RUN, "--out", tmp_path / "out").status == 0
    ran = command("view", tmp_path / "out", "-o", tmp_path / "page.html")
    assert ran.status == 2
    assert "repeat the run with: meltemi run ... --view" in ran.err
    assert not (tmp_path / "page.html").exists()


@pytest.mark.usefixtures("no_plots")
def test_campbell_writes_the_mode_shapes(command: Command, tmp_path: Path) -> None:
    ran = command("campbell", "nrel5mw", "--rotor-speeds", 10, "--view", "--out", tmp_path / "out")
    assert ran.status == 0, ran.err
    assert "1st tower fore-aft" in (tmp_path / "out" / "campbell.csv").read_text("utf-8")
    assert tmp_path / "out" / "modes.html" in ran.files


def test_a_wind_file_is_viewed_alone(command: Command, bts: Callable[..., Path], tmp_path: Path) -> None:
    file, out = bts(), tmp_path / "wind.html"
    ran = command("view", file, "-o", out)
    assert (ran.status, ran.files) == (0, [out]), ran.err
    ran = command("view", file, file, "-o", tmp_path / "two.html")
    assert (ran.status, "a wind is viewed alone" in ran.err) == (2, True)


@pytest.mark.parametrize("inside", [False, True])
def test_ctrl_c_ends_it_in_a_line(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, inside: bool
) -> None:
    """Also where it ended a run that the command needs, whose status then raises."""

    def interrupted(path: Path) -> None:
        if inside:
            Result(np.zeros(0), np.zeros((0, 0)), (), Status.INTERRUPTED, "", {}).raise_for_status()
        raise KeyboardInterrupt

    monkeypatch.setattr("meltemi.view.commands.view._read", interrupted)
    ran = command("view", "some.nc", "-o", tmp_path / "x.html")
    assert (ran.status, ran.out, ran.err) == (130, "", "interrupted\n")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["missing.nc"], "missing.nc"),
        (["a.nc", "b.nc", "c.nc"], "one or two results, found 3"),
        (["a.nc", "--theme", "blue"], "--theme 'blue': expected light or dark"),
        (["pyproject.toml"], "not an OpenFAST text output"),
    ],
)
def test_bad_input(arguments: list[str], words: str, command: Command, tmp_path: Path) -> None:
    (tmp_path / "pyproject.toml").write_text("[x]\n", "utf-8")
    ran = command("view", *(str(tmp_path / a) if "." in a else a for a in arguments), "-o", tmp_path / "x.html")
    assert ran.status == 2
    assert words in ran.err
    assert not (tmp_path / "x.html").exists()
