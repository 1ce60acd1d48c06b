"""Job scripts for the scheduler of a cluster: machine code first, then an array of shards, then what is left.

The scheduler distributes the work: it starts a task again that it took away, and the scripts ask it to do so when a
task was killed or ran out of time. What a task has finished is on the disk.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path

from meltemi.core.errors import InputError
from meltemi.core.files import write_text

TASK_SECONDS = 900.0
"""[s] that a task of an array is to take: long beside its start, short beside a day's limit."""
MOST_TASKS = 1000
"""Largest number of tasks of an array: Slurm takes numbers to 1000 unless it is set up otherwise."""
START = 600.0
"""[s] for the start of a task on a slow file system, in its limit of time."""
MARGIN = 3.0
"""Factor on the estimate in the limit of time: a slower processor, neighbours on the same node."""
COMPILER = 3e9
"""Memory [bytes] to generate machine code."""
WARNING = 60
"""[s] before the limit of time when a task is told to end."""
RESTARTS = 20
"""Times that a task of Slurm asks to be started again."""
PORTABLE = {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": ""}
"""Environment in which machine code runs on all processors of the last ten years."""
KEPT = ("MELTEMI_CACHE_DIR", "PYTHONPATH", *PORTABLE)
"""Variables of the environment that scripts set as they are when they are written."""


@dataclass(frozen=True)
class JobSize:
    """What is asked of the scheduler.

    Attributes:
      tasks: of the array.
      cores: of a task.
      seconds: limit of time [s] of a task.
      bytes: memory of a task.
    """

    tasks: int
    cores: int
    seconds: float
    bytes: float

    @property
    def minutes(self) -> int:
        """Limit of time [min]."""
        return ceil(self.seconds / 60.0)

    @property
    def megabytes(self) -> int:
        """Memory [MB], to the next hundred."""
        return 100 * ceil(self.bytes / 1e8)


def job_size(processor: float, longest: float, memory: float, most: int, cores: int, tasks: int | None) -> JobSize:
    """Size of the jobs of some work.

    Args:
      processor: [s] processor time of all cases.
      longest: [s] that of the longest one, with a reserve.
      memory: [bytes] of a task.
      most: number of cases.
      cores: cores of a task.
      tasks: number of tasks; None: tasks of a quarter of an hour.

    Raises:
      InputError: a number is not positive.
    """
    for name, number in (("cores", cores), ("tasks", tasks)):
        if number is not None and number < 1:
            raise InputError(f"--{name} {number}: expected 1 or more")
    wanted = tasks or min(ceil(processor / (cores * TASK_SECONDS)), MOST_TASKS)
    tasks = max(min(wanted, most), 1)
    return JobSize(tasks, cores, START + MARGIN * (processor / (tasks * cores) + longest), memory)


@dataclass(frozen=True)
class Scheduler:
    """How a scheduler is told what a job is.

    Attributes:
      program: that takes a script.
      mark: of the lines of a script that are meant for it.
      index: variable of a task of an array.
      again: command by which a task asks to be started again.
      waits: options of the program for a job that waits for others: for the array, for the last job.
      number: turns what the program prints into the number of the job.
    """

    program: str
    mark: str
    index: str
    again: str
    waits: tuple[str, str]
    number: str = "cat"

    def head(self, name: str, size: JobSize, array: bool, folder: Path) -> list[str]:
        """Lines of a script for the scheduler."""
        if self.mark == "#SBATCH":
            lines = [
                f"--job-name={name} --requeue --open-mode=append --output={folder}/%x-{'%A_%a' if array else '%j'}.txt"
            ]
            lines += [f"--cpus-per-task={size.cores} --mem={size.megabytes}M --time={size.minutes}"]
            lines += [f"--signal=B:USR1@{WARNING}"] + ([f"--array=1-{size.tasks}"] if array else [])
        else:
            lines = [f"-N {name}", "-r y", "-j oe", f"-o {folder}/"]
            lines += [f"-l select=1:ncpus={size.cores}:mem={size.megabytes}mb"]
            lines += [f"-l walltime={size.minutes // 60}:{size.minutes % 60:02d}:00"]
            lines += [f"-J 1-{size.tasks}"] if array and size.tasks > 1 else []  # PBS has no array of one
        return [f"{self.mark} {line}" for line in lines]


SCHEDULERS = {
    "slurm": Scheduler(
        "sbatch --parsable --kill-on-invalid-dep=yes",
        "#SBATCH",
        "SLURM_ARRAY_TASK_ID",
        f'[ "${{SLURM_RESTART_COUNT:-0}}" -lt {RESTARTS} ] && '
        'scontrol requeue "${SLURM_ARRAY_JOB_ID:-$SLURM_JOB_ID}${SLURM_ARRAY_TASK_ID:+_$SLURM_ARRAY_TASK_ID}"',
        ("--dependency=afterok:{0}", "--dependency=afterok:{0},afterany:{1}"),
        "cut -d';' -f1",
    ),
    "pbs": Scheduler(
        "qsub",
        "#PBS",
        "PBS_ARRAY_INDEX",
        "true",
        ("-W depend=afterok:{0}", "-W depend=afterok:{0}:afterany:{1}"),
    ),
}
"""Schedulers by the name of the option."""
TASK = """\
cd {folder} || {{ echo "$(hostname) does not see {folder}, which all nodes must share" >&2; exit 2; }}
{exports}
again=
trap 'again=1; kill -TERM $run' USR1  # the limit of time is near
trap 'kill -TERM $run' TERM  # cancelled, or preempted: what is finished is written
{command} &
run=$!
wait $run; status=$?
while kill -0 $run 2>/dev/null; do wait $run; status=$?; done  # a signal ends the first wait
if [ -n "$again" ] || [ $status -eq 137 ]; then  # killed, for instance by somebody who wanted the memory
    {again}
fi
exit $status
"""
PLAIN = """\
#!/bin/sh
# Without an argument all tasks, one after the other; with a number, or in an array of a scheduler, that one.
task=${{1:-${{SLURM_ARRAY_TASK_ID:-${{PBS_ARRAY_INDEX:-${{PBS_ARRAYID:-${{SGE_TASK_ID:-${{LSB_JOBINDEX:-}}}}}}}}}}}}
cd {folder} || {{ echo "$(hostname) does not see {folder}, which all nodes must share" >&2; exit 2; }}
{exports}
for k in ${{task:-$(seq {tasks})}}; do
    {command} || exit
done
"""


def write_scripts(
    scheduler: str, folder: Path, size: JobSize, words: Sequence[str], *, lines: str = "", portable: bool = False
) -> list[Path]:
    """Write the scripts of ``meltemi loads run`` to ``jobs`` in a load base; the last submits the others.

    Args:
      scheduler: ``slurm``, ``pbs``, or ``array``: one script for any scheduler.
      folder: of the load base.
      size: what is asked for.
      words: further arguments of the command.
      lines: further options for the scheduler, such as ``--partition=short``.
      portable: generate machine code for all processors of the last ten years, not for each kind of them.

    Raises:
      InputError: a file cannot be written.
    """
    folder = folder.resolve()
    out, name, meltemi = folder / "jobs", folder.name, [sys.executable, "-m", "meltemi", "loads"]
    given: Mapping[str, str] = dict(os.environ) | (PORTABLE if portable else {})
    values = {key: given[key] for key in KEPT if key in given}
    for key in values.keys() - PORTABLE:  # jobs begin in another folder
        values[key] = os.pathsep.join(str(Path(each).absolute()) for each in values[key].split(os.pathsep) if each)
    exports = "\n".join(f"export {key}={shlex.quote(value)}" for key, value in values.items()) or ":"
    place = {"folder": shlex.quote(str(folder)), "exports": exports}
    run = shlex.join([*meltemi, "run", str(folder), *words, "--workers", str(size.cores)])
    if scheduler == "array":
        text = PLAIN.format(**place, tasks=size.tasks, command=f'{run} --shard "$k/{size.tasks}"')
        return [_script(out / "submit.sh", text)]
    s = SCHEDULERS[scheduler]
    whole = JobSize(1, size.cores, max(size.seconds, 3600.0), max(size.bytes, COMPILER))
    tasks = {
        "warmup": (whole, False, shlex.join([*meltemi, "warmup", str(folder)])),
        "array": (size, True, f'{run} --shard "${{{s.index}:-1}}/{size.tasks}"'),
        "rest": (whole, False, run),
    }
    files = []
    for kind, (of_job, array, command) in tasks.items():
        head = ["#!/bin/sh", *s.head(f"{name}-{kind}", of_job, array, out)]
        head += [f"{s.mark} {lines}"] if lines else []
        files.append(
            _script(out / f"{kind}.sh", "\n".join([*head, TASK.format(**place, command=command, again=s.again)]))
        )
    after = [""] + [f' "{options}"'.format("$warmup", "$array") for options in s.waits]
    calls = [
        f'{kind}=$({s.program}{wait} {shlex.quote(str(file))} | {s.number}) && [ -n "${kind}" ] || exit 1'
        for kind, wait, file in zip(tasks, after, files, strict=True)
    ]
    said = 'echo "submitted: $warmup machine code, $array tasks, $rest what is left"'
    return [*files, _script(out / "submit.sh", "\n".join(["#!/bin/sh", *calls, said, ""]))]


def _script(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, text)
    path.chmod(0o755)
    return path


def submit(scheduler: str, script: Path) -> str:
    """Submit jobs; what the script prints.

    Raises:
      InputError: the scheduler is not on this machine, or refuses.
    """
    if scheduler == "array":
        raise InputError(
            f"--now needs --slurm or --pbs; {script} is for any scheduler, which submits it by its own means"
        )
    program = SCHEDULERS[scheduler].program.split()[0]
    if shutil.which(program) is None:
        raise InputError(f"{program} is not on this machine: run {script} where the scheduler is")
    done = subprocess.run(["sh", str(script)], capture_output=True, text=True)
    if done.returncode:
        words = " ".join(done.stderr.split()) or f"exit status {done.returncode}"
        raise InputError(f"{program} refused: {words}; {script} can be run again")
    return done.stdout.strip()
