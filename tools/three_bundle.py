"""Make ``meltemi/view/viewer/three.min.js``: the parts of three.js (MIT) that the viewer uses, in one minified file.

    python tools/three_bundle.py [VERSION]

needs npm and network. It installs three.js and esbuild in a temporary folder, and copies the licence beside the file.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

VIEWER = Path(__file__).parents[1] / "src/meltemi/view/viewer"
VERSION = "0.187.0"
CONTROLS = "OrbitControls"


def main(version: str) -> None:
    scripts = [path for path in VIEWER.glob("*.js") if path.name != "three.min.js"]
    names = {name for path in scripts for name in re.findall(r"THREE\.(\w+)", path.read_text(encoding="utf-8"))}
    names.discard(CONTROLS)
    entry = f'export {{ {", ".join(sorted(names))} }} from "three";\n'
    entry += f'export {{ {CONTROLS} }} from "three/examples/jsm/controls/{CONTROLS}.js";\n'
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "entry.js").write_text(entry, encoding="utf-8")
        (folder / "package.json").write_text("{}", encoding="utf-8")
        subprocess.run(["npm", "install", f"three@{version}", "esbuild@0.28"], cwd=folder, check=True)
        subprocess.run(["node", "node_modules/esbuild/install.js"], cwd=folder, check=True)
        banner = f"/* three.js {version}, MIT licence: see three-licence.txt */"
        command = ["npx", "esbuild", "entry.js", "--bundle", "--minify", "--format=iife", "--global-name=THREE"]
        command += ["--legal-comments=none", f"--banner:js={banner}", f"--outfile={VIEWER / 'three.min.js'}"]
        subprocess.run(command, cwd=folder, check=True)
        licence = (folder / "node_modules/three/LICENSE").read_text(encoding="utf-8")
        (VIEWER / "three-licence.txt").write_text(f"three.js {version}\n\n{licence}", encoding="utf-8")
    print(f"wrote {VIEWER / 'three.min.js'}: {len(names) + 1} names")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else VERSION)
