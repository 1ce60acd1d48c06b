"""The image for clusters: its instructions, and its commands in a new environment, without a daemon."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from meltemi.app.cli import app

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
KNOWN = ("FROM", "COPY", "RUN", "WORKDIR", "ENTRYPOINT", "CMD")


def instructions() -> list[tuple[str, str]]:
    lines = (ROOT / "Containerfile").read_text(encoding="utf-8").replace("\\\n", " ").splitlines()
    return [(a, b.strip()) for a, _, b in (line.partition(" ") for line in lines if line and not line.startswith("#"))]


def test_instructions_of_the_image() -> None:
    found = instructions()
    assert {name for name, _ in found} <= set(KNOWN) and [name for name, _ in found].count("FROM") == 1
    assert found[0][0] == "FROM"
    version = re.fullmatch(r"docker\.io/library/python:(3\.\d+)-slim", found[0][1])
    assert version and f"Programming Language :: Python :: {version[1]}" in PROJECT["classifiers"]
    of = dict(found)
    assert of["COPY"].split() == ["dist/*.whl", "/wheels/"]
    (entry,) = json.loads(of["ENTRYPOINT"])
    assert entry in PROJECT["scripts"] and json.loads(of["CMD"]) == ["--help"]
    commands = {each.name or each.callback.__name__ for each in app.registered_commands}
    called = re.findall(r"meltemi (\w+)", " ".join(text for name, text in found if name == "RUN"))
    assert called and set(called) <= commands
    extras = re.findall(r"\[([\w,]+)\]", next(text for name, text in found if name == "RUN" and "pip" in text))
    assert extras and set(extras[0].split(",")) <= PROJECT["optional-dependencies"].keys()


@pytest.mark.long
def test_its_commands_install_the_wheel_into_a_new_environment(tmp_path: Path) -> None:
    """With what the package index has; without it, this cannot be tested."""
    wheels, place = tmp_path / "wheels", tmp_path / "venv"
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(wheels), str(ROOT)]
    built = subprocess.run(build, capture_output=True, text=True)
    if built.returncode and "hatchling" in built.stderr:
        pytest.skip("the package index, which has what builds the wheel, cannot be reached")
    assert built.returncode == 0, built.stderr
    subprocess.run([sys.executable, "-m", "venv", str(place)], check=True)
    environment = {**os.environ, "PATH": f"{place / 'bin'}:{os.environ['PATH']}", "MELTEMI_CACHE_DIR": str(tmp_path)}
    environment.pop("PYTHONPATH", None)
    for name, text in instructions():
        if name == "RUN":
            line = text.replace("/wheels", str(wheels)).replace(" --no-cache-dir", "")
            subprocess.run(line, shell=True, check=True, env=environment, cwd=tmp_path)
    assert shutil.which("meltemi", path=str(place / "bin"))
    shown = subprocess.run(["meltemi", "loads", "submit", "--help"], env=environment, capture_output=True, text=True)
    assert shown.returncode == 0 and "--slurm" in shown.stdout
