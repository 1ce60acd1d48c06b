"""Studies keep what they have finished, and go on where they ended; a cell that fails does not end them."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from meltemi import InputError, Run, Start, SteadyWind, build, load_turbine, simulate_batch
from meltemi.core.stores import code_identity
from meltemi.papers.claim import Claim, claim_group, claims_table, count_held
from meltemi.papers.study import failed_chapters, guarded_figure, guarded_table
from meltemi.papers.verdict import judgement
from meltemi.simulation.result import Result
from meltemi.tuning.run_store import (
    FOLDER,
    FailedResult,
    FailedResultError,
    attempt,
    cells,
    current,
    guarded,
    run_store,
    survivors,
)


def cases(speeds: tuple[float, ...] = (8.0, 9.0, 10.0)) -> list[Run]:
    model = build(load_turbine("pmsg20mw"))
    return [Run(model, SteadyWind(speed=v), duration=1.0, name=f"{v:g} m/s") for v in speeds]


def count(ran: list[str], fails: str = "", interrupted: str = ""):  # type: ignore[no-untyped-def]
    def reduce(result: Result) -> float:
        name = result.meta["case"]
        ran.append(name)
        if name == fails:
            raise InputError("it cannot be")
        if name == interrupted:
            raise KeyboardInterrupt
        return float(result["generator_power"].mean())

    return reduce


def end_early(out: Path, part: Callable[[], object]) -> None:
    """A study that ends after a part of it."""

    def study() -> None:
        with run_store(out, "study"):
            part()
            raise RuntimeError

    with pytest.raises(RuntimeError):
        study()


def test_runs_that_were_finished_before_ctrl_c_are_taken_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first: list[str] = []
    with pytest.raises(KeyboardInterrupt), run_store(tmp_path, "study"):
        cells(cases(), reduce=count(first, interrupted="10 m/s"), workers=1)
    assert "2 finished runs are kept" in capsys.readouterr().err
    second: list[str] = []
    shares: list[float] = []
    with run_store(tmp_path, "study") as book:
        found = cells(cases(), reduce=count(second), workers=1, progress=shares.append)
        assert book.reused == 2
    assert first[:2] == ["8 m/s", "9 m/s"] and second == ["10 m/s"]
    assert found == cells(cases(), reduce=count([]), workers=1)
    assert shares[-1] == pytest.approx(1.0)
    assert "reading 2 finished runs" in capsys.readouterr().err
    assert not (tmp_path / FOLDER).exists()  # the study has come to its end


def test_the_wind_of_a_run_that_is_taken_over_is_not_made(tmp_path: Path) -> None:
    made: list[str] = []

    class Made:
        def content_hash(self) -> str:
            return "8 m/s"

        def __call__(self) -> SteadyWind:
            made.append("wind")
            return SteadyWind(speed=8.0)

    (case,) = cases((8.0,))
    case = Run(case.model, Made(), duration=1.0, name=case.name)
    end_early(tmp_path, lambda: cells([case], workers=1))
    with run_store(tmp_path, "study") as book:
        (outcome,) = simulate_batch([case], store=book)
    assert made == ["wind"] and outcome.reused and outcome.value.status is outcome.status
    for other in ({"out": tmp_path}, {"series": False}):
        with pytest.raises(InputError, match="store excludes out and series=False"):
            simulate_batch([case], store=book, **other)  # type: ignore[arg-type]


@pytest.mark.parametrize("change", ["inputs", "turbine", "wind", "place"])
def test_what_has_changed_is_computed_anew(tmp_path: Path, change: str) -> None:
    end_early(tmp_path, lambda: attempt("part", cells, cases(), workers=1))
    model = build(load_turbine("pmsg20mw").replace(**{"drivetrain.rotor_inertia": 3.0e9}))
    other = {
        "turbine": [Run(model, SteadyWind(speed=8.0), duration=1.0, name="8 m/s")],
        "wind": [Run(c.model, SteadyWind(speed=8.5), duration=1.0, name=c.name) for c in cases((8.0,))],
    }
    with run_store(tmp_path, "another" if change == "inputs" else "study") as book:
        attempt("elsewhere" if change == "place" else "part", cells, other.get(change, cases()), workers=1)
        assert book.reused == 0


def test_a_guests_study_is_computed_anew_when_the_guest_has_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "guest_study" / "__init__.py"
    file.parent.mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    taken: list[int] = []

    def study() -> None:
        with run_store(tmp_path, "study", "guest_study") as book:
            cells(cases((8.0,)), workers=1)
            taken.append(book.reused)
            raise RuntimeError

    for content in ("", "", "change = 1"):
        file.write_text(content, encoding="utf-8")
        code_identity.cache_clear()
        with pytest.raises(RuntimeError):
            study()
    assert taken == [0, 1, 0]


@pytest.mark.parametrize("damage", ["cut", "foreign", "empty"])
def test_a_file_that_is_not_whole_and_ours_is_not_unpacked(tmp_path: Path, damage: str) -> None:
    end_early(tmp_path, lambda: cells(cases((8.0,)), workers=1))
    (file,) = (tmp_path / FOLDER).iterdir()
    data = file.read_bytes()
    file.write_bytes({"cut": data[:-10], "foreign": bytes(32) + data[32:], "empty": b""}[damage])
    ran: list[str] = []
    with run_store(tmp_path, "study") as book:
        cells(cases((8.0,)), reduce=count(ran), workers=1)
        assert book.reused == 0 and ran == ["8 m/s"]


def test_a_full_disk_ends_no_study_and_leaves_nothing_half_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(handle: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with run_store(tmp_path, "study") as book:
        with monkeypatch.context() as patched:
            patched.setattr(os, "fsync", full)
            (power,) = cells(cases((8.0,)), reduce=count([]), workers=1)
        assert power > 0.0 and book.waiting() == 0 and not list((tmp_path / FOLDER).iterdir())


KILLED = """
import sys, time
from pathlib import Path
sys.path.insert(0, sys.argv[2])
from test_run_store import cases
from meltemi.tuning.run_store import cells, run_store

def reduce(result):
    if result.meta["case"] == "10 m/s":
        print("there", flush=True)
        time.sleep(3.0)
    return float(result["generator_power"].mean())

with run_store(Path(sys.argv[1]), "study") as book:
    print(cells(cases(), reduce=reduce, workers=1), book.taken)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_study_that_was_killed_goes_on(tmp_path: Path, number: signal.Signals) -> None:
    command = [sys.executable, "-c", KILLED, str(tmp_path), str(Path(__file__).parent)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stdout.readline() == "there\n"
        os.kill(process.pid, number)
        said = process.communicate()[1]
    ran: list[str] = []
    with run_store(tmp_path, "study") as book:
        cells(cases(), reduce=count(ran), workers=1)
        if number is signal.SIGKILL:
            assert book.reused == 2 and ran == ["10 m/s"]
        else:  # the run that was in its last step came to its end
            assert book.reused == 3 and not ran
            assert "3 finished runs are kept" in said


def test_a_cell_that_fails_is_named_where_it_is_needed(tmp_path: Path) -> None:
    with run_store(tmp_path, "study") as book:
        found = attempt("powers", cells, cases(), reduce=count([], fails="9 m/s"), workers=1)
        assert [isinstance(value, FailedResult) for value in found] == [False, True, False]
        assert len(survivors(found)) == 2
        start = attempt("start at 25 m/s", lambda: (_ for _ in ()).throw(InputError("no steady operation")))
        for use in (
            lambda: start.pitch,
            lambda: start["x"],
            lambda: start < 1.0,
            lambda: start**2,
            lambda: 1.0 + start,
            lambda: np.sqrt(start),
            lambda: [*start],
        ):
            with pytest.raises(FailedResultError, match="start at 25 m/s: no steady operation"):
                use()
        # what needs a lost cell is lost for the same reason, and is not another failure
        later = attempt("run", lambda: start.pitch + 1.0)
        assert later.why == "start at 25 m/s: no steady operation"
        assert list(book.failed) == ["powers: 9 m/s", "start at 25 m/s"]
        case = Run(cases()[0].model, SteadyWind(speed=8.0), duration=1.0, start=start, name="without a start")
        assert cells([case])[0].why == "without a start: start at 25 m/s: no steady operation"

        fine = claim_group("one", "", lambda: [Claim("one", "1", "1", judgement(True), "Fig. 1")])
        lost = claim_group("two", "Fig. 2", lambda: [Claim("two", "1", f"{start.pitch}", judgement(True), "Fig. 2")])
        assert lost[0].verdict == "cannot be judged: start at 25 m/s: no steady operation"
        assert count_held([*fine, *lost]) == "1 of 2 claims of the paper hold (1 cannot be judged)."
        table = guarded_table("Table 2", lambda: claims_table([Claim("", "", start.pitch, judgement(True), "")]))
        assert table.rows == [["not available: start at 25 m/s: no steady operation"]]
        figure = guarded_figure("fig", "Figure 1", lambda: start.figure, tmp_path)
        assert isinstance(figure, str) and "cannot be drawn: start at 25 m/s" in figure
        ((failed,),) = (chapter.content for chapter in failed_chapters().values())
        assert failed.rows[0] == ("powers: 9 m/s", "it cannot be")
    assert (tmp_path / FOLDER).is_dir()  # the next try computes only what failed


def test_an_error_of_the_program_is_no_failed_cell(tmp_path: Path) -> None:
    with run_store(tmp_path, "study"):
        with pytest.raises(KeyError):
            guarded(lambda: {}["x"], str)
        current().failed["a cell"] = "why"
        assert "cells failed" in guarded(lambda: {}["x"], str)


def test_doubtful_runs_count_are_listed_and_are_taken_over(tmp_path: Path) -> None:
    model = build(load_turbine("pmsg20mw"))
    fast = Start(rotor_speed=1.6 * 0.75)
    runaway = Run(model, SteadyWind(speed=9.0), duration=1.0, start=fast, name="runaway")
    ran: list[str] = []
    end_early(tmp_path, lambda: cells([runaway], reduce=count(ran), workers=1))
    with run_store(tmp_path, "study") as book:
        (value,) = cells([runaway], reduce=count(ran), workers=1)
        assert book.reused == 1 and ran == ["runaway"] and np.isfinite(value)
        assert "1.5 times its rated speed" in book.doubtful["runaway"] and not book.failed
        (table,) = failed_chapters()["doubtful"].content
        assert table.rows == [("runaway", book.doubtful["runaway"])]
    assert not (tmp_path / FOLDER).exists()
