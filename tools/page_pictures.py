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
COMMANDS = {
    "turbine-file": {"turbine.png": "inspect_nrel5mw.png"},
    "comparing": {"changes.png": "comparison_changes.png", "spectra.png": "comparison_spectra.png"},
}
"""Pages, and the pictures of the first command on them that writes into ``out``, with their names in the docs."""


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
            command = re.search(r"meltemi (?:inspect|compare) [^`\n]*--out out", text)
            assert command is not None, page
            subprocess.run([sys.executable, "-m", *shlex.split(command[0])], check=True)
            for name, picture in pictures.items():
                seen = Image.open(Path("out") / name).convert("RGB")
                seen.quantize(256).save(DOCS / "images" / picture, optimize=True)


if __name__ == "__main__":
    run()
