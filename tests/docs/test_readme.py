"""Every command line of the README is tried with the README's installation."""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))
from readme_commands import TRIES  # noqa: E402


def test_no_command_of_the_readme_is_left_out() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```sh\n(.*?)^```", text, re.M | re.S)
    stated = re.findall(r"(?:^|/)meltemi (.*?)(?: +#.*)?$", "".join(blocks), re.M)
    assert sorted(stated) == sorted(each.readme for each in TRIES)


def test_they_are_tried_with_the_wheel() -> None:
    assert "tools/readme_commands.py" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")
