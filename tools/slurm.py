"""A Slurm of one machine, to try what ``meltemi loads submit`` writes:  python tools/slurm.py start FOLDER

    python tools/slurm.py start FOLDER [--nodes 4]   prints the line that makes sbatch find it
    python tools/slurm.py stop FOLDER

Needs root and, of Debian, ``slurm-wlm`` and ``munge``. All its files are in FOLDER. It has as many nodes as are asked
for, of two processors each, whatever the machine has: tests of what happens to jobs need more jobs than processors.
"""

from __future__ import annotations

import argparse
import os
import secrets
import shutil
import signal
import socket
import subprocess
import time
from contextlib import suppress
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch")
PROCESSORS = 2
"""Of a node."""
MEMORY = 8000
"""Of a node [MB]."""
CONFIGURATION = """\
ClusterName=meltemi
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket,cred_expire=5
SlurmUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SlurmdParameters=config_overrides
JobRequeue=1
KillWait=5
MinJobAge=3600
ReturnToService=2
SchedulerParameters=sched_interval=2,bf_interval=2,batch_sched_delay=1
{nodes}
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def missing() -> str:
    """What keeps Slurm from being started here, as a sentence; empty if nothing does."""
    lacking = [name for name in PROGRAMS if shutil.which(name, path=_path()) is None]
    if lacking:
        return f"{', '.join(lacking)} not installed (Debian: slurm-wlm and munge)"
    return "" if os.geteuid() == 0 else "Slurm's daemons are started by root only"


def start(folder: Path, nodes: int = 4) -> dict[str, str]:
    """Start the daemons; the environment in which the commands of Slurm find them."""
    folder = folder.resolve()
    for name in ("", "state", *(f"spool-n{i}" for i in range(nodes))):
        (folder / name).mkdir(parents=True, exist_ok=True, mode=0o755)
    key, (port, *ports) = folder / "munge.key", _free_ports(1 + nodes)
    if not key.exists():
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o600)
    lines = [
        f"NodeName=n{i} NodeAddr=127.0.0.1 NodeHostname={socket.gethostname()} Port={p} CPUs={PROCESSORS} "
        f"RealMemory={MEMORY} State=UNKNOWN"
        for i, p in enumerate(ports)
    ]
    conf = folder / "slurm.conf"
    conf.write_text(
        CONFIGURATION.format(host=socket.gethostname(), port=port, folder=folder, nodes="\n".join(lines)), "utf-8"
    )
    environment = {"SLURM_CONF": str(conf)}
    both = {**os.environ, **environment, "PATH": _path()}
    munge = ["--force", f"--key-file={key}", f"--socket={folder}/munge.socket", f"--pid-file={folder}/munged.pid"]
    munge += [f"--log-file={folder}/munged.log", f"--seed-file={folder}/munged.seed"]
    commands = [["munged", *munge], ["slurmctld", "-c"], *(["slurmd", "-N", f"n{i}"] for i in range(nodes))]
    for words in commands:
        subprocess.run(words, env=both, check=True)
    for _ in range(100):
        found = subprocess.run(["sinfo", "-h", "-t", "idle", "-o", "%D"], env=both, capture_output=True, text=True)
        if found.stdout.strip() == str(nodes):
            return environment
        time.sleep(0.2)
    stop(folder)
    raise SystemExit(f"Slurm did not start: {folder}/*.log has the reasons")


def stop(folder: Path) -> None:
    """End the jobs and the daemons that were started in a folder, by their numbers."""
    folder = folder.resolve()
    environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
    with suppress(OSError, subprocess.TimeoutExpired):
        subprocess.run(["scancel", "--me"], env=environment, capture_output=True, timeout=20.0)
        for _ in range(50):
            left = subprocess.run(["squeue", "-h"], env=environment, capture_output=True, text=True, timeout=20.0)
            if not left.stdout.strip():
                break
            time.sleep(0.2)
    for file in (*folder.glob("slurmd-*.pid"), folder / "slurmctld.pid", folder / "munged.pid"):
        with suppress(OSError, ValueError):
            os.kill(int(file.read_text()), signal.SIGTERM)


def _path() -> str:
    return f"{os.environ.get('PATH', '')}:/usr/sbin:/usr/bin"


def _free_ports(count: int) -> list[int]:
    opened = [socket.socket() for _ in range(count)]
    for each in opened:
        each.bind(("127.0.0.1", 0))
    ports = [each.getsockname()[1] for each in opened]
    for each in opened:
        each.close()
    return ports


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["start", "stop"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--nodes", type=int, default=4)
    given = parser.parse_args()
    if given.what == "stop":
        stop(given.folder)
    elif why := missing():
        raise SystemExit(why)
    else:
        print("\n".join(f"export {name}={value}" for name, value in start(given.folder, given.nodes).items()))
