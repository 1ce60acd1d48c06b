"""Draw the pictures of the guide anew, from the code and commands on its pages:  python tools/page_pictures.py"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

DOCS = Path(__file__).parents[1] / "docs"
PAGES = {"events": "events.png", "electrical": "dip.png", "yaw": "yaw.png", "power-control": "power_schemes.png"}
"""Pages, and the picture that their code saves and that they show."""
COMMANDS: dict[str, list[dict[str, str]]] = {
    "turbine-file": [{"turbine.png": "inspect_nrel5mw.png"}],
    "comparing": [{"changes.png": "comparison_changes.png", "spectra.png": "comparison_spectra.png"}],
    "stability": [
        {"flutter.png": "flutter.png"},
        {"parked.png": "parked-given.png"},
        {"parked.png": "parked-plate.png"},
    ],
}
"""Pages, and of the first commands on them that write into a folder the pictures, with their names in the docs."""
WRITING = re.compile(r"meltemi (?:inspect|compare|flutter|parked) [^`\n]*--out (\w+)")


def run() -> None:
    """In a folder of its own; pictures whose page shows another run are left alone."""
    with TemporaryDirectory() as folder:
        os.chdir(folder)
        for page, picture in PAGES.items():
            text = (DOCS / "guide" / f"{page}.md").read_text(encoding="utf-8")
            code = "\n".join(re.findall(r"^```python\n(.*?)^```", text, re.M | re.S))
            exec(compile(code, page, "exec"), {"__name__": "page"})
            shutil.copy(picture, DOCS / "images" / picture)
        for page, pictures in COMMANDS.items():
            text = (DOCS / "guide" / f"{page}.md").read_text(encoding="utf-8").replace("\\\n", "")
            for command, shown in zip(WRITING.finditer(text), pictures, strict=False):
                subprocess.run([sys.executable, "-m", *shlex.split(command[0])], check=True)
                for name, picture in shown.items():
                    seen = Image.open(Path(command[1]) / name).convert("RGB")
                    seen.quantize(256).save(DOCS / "images" / picture, optimize=True)


if __name__ == "__main__":
    run()
