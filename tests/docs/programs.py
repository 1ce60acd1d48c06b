"""Programs that stand on pages of the documentation: written into a folder, and run there."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path


def write_programs(page: str, folder: Path) -> list[Path]:
    """Write the programs of a page and their input, by the file names that are their titles."""
    programs = re.findall(r'^```(?:python|yaml) title="(\w+\.\w+)"\n(.*?)^```', page, re.MULTILINE | re.DOTALL)
    for name, text in programs:
        (folder / name).write_text(text, encoding="utf-8")
    return [folder / name for name, _ in programs]


def run(folder: Path, *arguments: str, **environment: str) -> str:
    """What Python prints with these arguments in a folder, in which it must end without an error."""
    ended = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr[-3000:]
    return ended.stdout
