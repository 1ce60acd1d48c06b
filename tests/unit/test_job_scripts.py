"""Job scripts: what is asked of a scheduler, and what a task does when it is killed or told to end."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from meltemi.cluster.scripts import MOST_TASKS, JobSize, job_size, submit, write_scripts
from meltemi.core.errors import InputError

SIZE = JobSize(64, 8, 1500.0, 2.05e9)
WORDS = ("--expect", "abc")


def texts(files: list[Path]) -> dict[str, str]:
    for file in files:
        assert subprocess.run(["sh", "-n", str(file)]).returncode == 0 and os.access(file, os.X_OK)
    return {file.stem: file.read_text(encoding="utf-8") for file in files}


def test_slurm_is_asked_for_time_memory_and_a_warning(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MELTEMI_CACHE_DIR", "/a cache")
    monkeypatch.setenv("PYTHONPATH", "src")
    found = texts(write_scripts("slurm", tmp_path, SIZE, WORDS, lines="--partition=short -A me"))
    assert list(found) == ["warmup", "array", "rest", "submit"]
    array = found["array"]
    assert "#SBATCH --cpus-per-task=8 --mem=2100M --time=25\n" in array
    assert "#SBATCH --array=1-64\n" in array and "#SBATCH --signal=B:USR1@60\n" in array and "--requeue" in array
    assert "#SBATCH --partition=short -A me\n" in array and "export MELTEMI_CACHE_DIR='/a cache'\n" in array
    run = f'-m meltemi loads run {tmp_path} --expect abc --workers 8 --shard "${{SLURM_ARRAY_TASK_ID:-1}}/64"'
    assert run in array and "scontrol requeue" in array
    assert "--shard" not in found["rest"] and "--array" not in found["rest"]
    assert f"export PYTHONPATH={Path.cwd() / 'src'}\n" in array
    assert f"meltemi loads warmup {tmp_path}" in found["warmup"] and "NUMBA_CPU_NAME" not in array


def test_pbs_has_its_own_words(tmp_path: Path) -> None:
    found = texts(write_scripts("pbs", tmp_path, SIZE, WORDS))
    assert "#PBS -l select=1:ncpus=8:mem=2100mb\n#PBS -l walltime=0:25:00\n#PBS -J 1-64\n" in found["array"]
    assert "$PBS_ARRAY_INDEX" not in found["rest"] and "scontrol" not in found["array"]
    one = texts(write_scripts("pbs", tmp_path, JobSize(1, 8, 1500.0, 2e9), WORDS))["array"]
    assert "-J" not in one and '"${PBS_ARRAY_INDEX:-1}/1"' in one


def test_portable_machine_code_is_asked_for_by_the_environment(tmp_path: Path) -> None:
    found = texts(write_scripts("array", tmp_path, SIZE, WORDS, portable=True))
    assert "export NUMBA_CPU_NAME=x86-64-v3\nexport NUMBA_CPU_FEATURES=''\n" in found["submit"]


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ({}, ["1/3", "2/3", "3/3"]),
        ({"PBS_ARRAY_INDEX": "2"}, ["2/3"]),
        ({"SLURM_ARRAY_TASK_ID": "3"}, ["3/3"]),
        ({"SGE_TASK_ID": "1"}, ["1/3"]),
    ],
)
def test_a_script_for_any_scheduler_finds_its_number(
    given: dict[str, str], expected: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", "echo")
    (file,) = write_scripts("array", tmp_path, JobSize(3, 1, 600.0, 1e9), WORDS)
    lines = subprocess.run(["sh", file], capture_output=True, text=True, check=True, env=os.environ | given).stdout
    assert [line.split()[-1] for line in lines.splitlines()] == expected
    if not given:
        alone = subprocess.run(["sh", file, "2"], capture_output=True, text=True, check=True).stdout
        assert alone.split()[-1] == "2/3"


def test_a_node_that_does_not_see_the_folder_says_so(tmp_path: Path) -> None:
    folder = tmp_path / "base"
    folder.mkdir()
    file = write_scripts("slurm", folder, SIZE, WORDS)[1]
    folder.rename(tmp_path / "elsewhere")
    done = subprocess.run(["sh", tmp_path / "elsewhere" / "jobs" / file.name], capture_output=True, text=True)
    assert done.returncode == 2 and f"does not see {folder}, which all nodes must share" in done.stderr


@pytest.mark.parametrize(("end", "again"), [("kill -9 $$", True), ("exit 3", False), ("exit 0", False)])
def test_a_task_that_was_killed_asks_to_be_started_again(
    end: str, again: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program(tmp_path / "python", f"{end}\n")
    program(tmp_path / "scontrol", f'echo "$@" > {tmp_path}/asked\n')
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    file = write_scripts("slurm", tmp_path, SIZE, WORDS)[1]
    given = {"SLURM_ARRAY_JOB_ID": "7", "SLURM_ARRAY_TASK_ID": "5"}
    status = subprocess.run(["sh", file], env=os.environ | given, stderr=subprocess.DEVNULL).returncode
    assert status == (137 if again else int(end.split()[1]))
    assert ((tmp_path / "asked").read_text().split() if again else []) == (["requeue", "7_5"] if again else [])
    given["SLURM_RESTART_COUNT"] = "20"
    (tmp_path / "asked").unlink(missing_ok=True)
    subprocess.run(["sh", file], env=os.environ | given, stderr=subprocess.DEVNULL)
    assert not (tmp_path / "asked").exists()  # not for ever


def test_a_signal_reaches_the_run_which_is_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program(
        tmp_path / "python", f"trap 'echo kept > {tmp_path}/kept; exit 130' TERM\nkill -USR1 $PPID\nsleep 5 & wait\n"
    )
    program(tmp_path / "scontrol", f'echo "$@" > {tmp_path}/asked\n')
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    monkeypatch.setenv("SLURM_JOB_ID", "9")
    file = write_scripts("slurm", tmp_path, SIZE, WORDS)[2]
    assert subprocess.run(["sh", file]).returncode == 130
    assert (tmp_path / "kept").exists() and (tmp_path / "asked").read_text() == "requeue 9\n"


def test_jobs_depend_on_each_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program(tmp_path / "sbatch", f'echo "$@" >> {tmp_path}/asked; wc -l < {tmp_path}/asked\n')
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    files = write_scripts("slurm", tmp_path, SIZE, WORDS)
    assert submit("slurm", files[-1]) == "submitted: 1 machine code, 2 tasks, 3 what is left"
    asked = (tmp_path / "asked").read_text().splitlines()
    assert "--dependency" not in asked[0]
    assert "--dependency=afterok:1 " in asked[1] and "--dependency=afterok:1,afterany:2 " in asked[2]
    program(tmp_path / "sbatch", "echo 'invalid partition' >&2; exit 1\n")
    with pytest.raises(InputError, match=r"sbatch refused: invalid partition; \S+submit.sh can be run again"):
        submit("slurm", files[-1])


def test_a_scheduler_that_is_not_there_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = write_scripts("pbs", tmp_path, SIZE, WORDS)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"qsub is not on this machine: run \S+submit.sh where the scheduler is"):
        submit("pbs", files[-1])
    with pytest.raises(InputError, match="--now needs --slurm or --pbs"):
        submit("array", files[-1])


def test_tasks_take_a_quarter_of_an_hour() -> None:
    size = job_size(36000.0, 10.0, 1e9, 5000, 4, None)
    assert size.tasks == 10 and size.minutes == 56 and size.megabytes == 1000
    assert job_size(36000.0, 10.0, 1e9, 3, 4, None).tasks == 3  # not more than cases
    assert job_size(1e9, 10.0, 1e9, 10**7, 4, None).tasks == MOST_TASKS
    assert job_size(1.0, 10.0, 1e9, 5, 4, 2).tasks == 2
    with pytest.raises(InputError, match="--cores 0: expected 1 or more"):
        job_size(1.0, 1.0, 1e9, 5, 0, None)
    with pytest.raises(InputError, match="--tasks 0: expected 1 or more"):
        job_size(1.0, 1.0, 1e9, 5, 1, 0)


def program(path: Path, text: str) -> None:
    path.write_text(f"#!/bin/sh\n{text}", encoding="utf-8")
    path.chmod(0o755)
