"""``meltemi run --save-state`` and ``--continue``."""

from __future__ import annotations

from pathlib import Path

from terminal import Command

import meltemi

CASE = "turbine: nrel5mw\nwind: {kind: turbulence, speed: 14.0, intensity: 0.14}\nduration: 1.0\n"


def test_a_command_continues_what_another_saved(command: Command, tmp_path: Path) -> None:
    case, state = tmp_path / "case.yaml", tmp_path / "run.state"
    case.write_text(CASE)
    assert command("run", case, "--out", tmp_path / "whole").status == 0
    first = command("run", case, "--until", 0.5, "--save-state", state, "--out", tmp_path / "first")
    assert first.status == 0 and f"wrote {state}" in first.out
    second = command("run", case, "--continue", state, "--out", tmp_path / "second")
    assert second.status == 0 and second.err == ""
    whole, part, rest = (meltemi.read_result(tmp_path / name / "result.nc") for name in ("whole", "first", "second"))
    assert part.time[-1] == 0.5 and rest.time[-1] == 1.0
    assert rest.data.tobytes() == whole.data.tobytes()


def test_what_is_no_state_is_refused_in_a_line(command: Command, tmp_path: Path) -> None:
    case = tmp_path / "case.yaml"
    case.write_text(CASE)
    for arguments, words in (
        (("--continue", case), "no state of a run"),
        (("--continue", tmp_path / "none.npz"), "cannot be read"),
        (("--until", 2.0), "until: expected a time from 0 s to the end of the run at 1 s"),
        (("--save-state", tmp_path / "none" / "run.state", "--until", 0.1), "cannot be written"),
    ):
        ran = command("run", case, *arguments, "--out", tmp_path / "out")
        assert ran.status == 2 and words in ran.err and len(ran.err.splitlines()) == 1, ran
