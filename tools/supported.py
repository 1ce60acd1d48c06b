"""Try the supported versions: python tools/supported.py [--only oldest|newest] [--pythons 3.11,3.14]

For every Python version of pyproject.toml that this machine has, a new environment with the newest dependencies gets
the package, and runs kernels and regression; for the oldest Python, one with the oldest dependencies, too, which were
never built for later ones. A version without an interpreter is listed as not run. Exit status 1 if one fails.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
TESTS = ("tests/unit/test_kernel.py", "tests/unit/test_node_bem.py", "tests/unit/test_records.py", "tests/regression")


def versions() -> list[str]:
    """Python versions of ``requires-python``."""
    text = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["requires-python"]
    first, end = (int(number) for number in re.fullmatch(r">=3\.(\d+),<3\.(\d+)", text).groups())  # type: ignore[union-attr]
    return [f"3.{minor}" for minor in range(first, end)]


def interpreter(version: str) -> str | None:
    """Path of a Python of this version that runs."""
    for name in (f"python{version}", "python3", "python", sys.executable):
        if path := shutil.which(name):
            asked = [path, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"]
            done = subprocess.run(asked, capture_output=True, text=True, check=False)
            if done.returncode == 0 and done.stdout.strip() == version:
                return path
    return None


def tried(python: str, age: str) -> str:
    """Verdict on one Python with one age of dependencies."""
    with tempfile.TemporaryDirectory() as folder:
        work, constraints = Path(folder), []
        if age == "oldest":
            listed = subprocess.run([sys.executable, ROOT / "tools" / "oldest.py"], capture_output=True, check=True)
            (work / "oldest.txt").write_bytes(listed.stdout)
            constraints = ["-c", str(work / "oldest.txt")]
        subprocess.run([python, "-m", "venv", work / "env"], check=True)
        own = work / "env" / ("Scripts" if sys.platform == "win32" else "bin") / "python"
        began = time.perf_counter()
        for command in (
            [own, "-m", "pip", "install", "-q", *constraints, ROOT, "pytest", "hypothesis", "pytest-timeout"],
            [own, "-m", "pytest", "-q", "-p", "no:cacheprovider", *TESTS],
        ):
            if subprocess.run(command, cwd=ROOT, check=False).returncode:
                return "FAILED"
        return f"passed in {time.perf_counter() - began:.0f} s"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=("oldest", "newest"))
    parser.add_argument("--pythons")
    given = parser.parse_args()
    verdicts = {}
    for version in given.pythons.split(",") if given.pythons else versions():
        for age in ("oldest", "newest") if version == versions()[0] else ("newest",):
            if given.only not in (None, age):
                continue
            python = interpreter(version)
            verdicts[version, age] = "not run: no such interpreter here" if python is None else tried(python, age)
            print(f"Python {version}, {age} dependencies: {verdicts[version, age]}", flush=True)
    return int("FAILED" in verdicts.values())


if __name__ == "__main__":
    sys.exit(main())
