"""Print the oldest supported version of each dependency as pip constraints:  python tools/oldest.py > oldest.txt"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
for dependency in project["dependencies"]:
    name, oldest = re.fullmatch(r"([\w.-]+)>=([\d.]+)(?:,.*)?", dependency).groups()  # type: ignore[union-attr]
    print(f"{name}=={oldest}.*")
