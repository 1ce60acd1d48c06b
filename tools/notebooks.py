"""The notebooks of the documentation: run from their scripts, and shown as pages.

The scripts in ``examples/notebooks`` are divided by ``# %%`` into cells, ``# %% [markdown]`` into texts. A line that
ends with ``# reduced: VALUE`` has that value in the tests, which run every script.

    python tools/notebooks.py [NAME ...]     # runs scripts and writes docs/tutorials/NAME.ipynb, with outputs

mkdocs calls ``on_files``, which makes a page and its pictures of each notebook; nothing is run.
"""

from __future__ import annotations

import base64
import json
import os
import re
import sys
from html import unescape
from io import BytesIO
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
SCRIPTS, NOTEBOOKS = ROOT / "examples" / "notebooks", ROOT / "docs" / "tutorials"
REDUCED = re.compile(r"= (.*?)  # reduced: (.*)$", re.MULTILINE)
TERMINAL = re.compile(r"\x1b\[[0-9;]*m")


def cells(text: str, reduced: bool = False) -> list[tuple[str, str]]:
    """Kind and source of the cells of a script, with its full or its reduced values."""
    text = REDUCED.sub(r"= \2" if reduced else r"= \1", text)
    found = []
    for kind, source in re.findall(r"^# %%( \[markdown\])?\n(.*?)(?=^# %%|\Z)", text, re.MULTILINE | re.DOTALL):
        source = re.sub("^# ?", "", source, flags=re.MULTILINE) if kind else source
        found.append(("markdown" if kind else "code", source.strip()))
    return found


def run(name: str) -> None:
    """Run a script as a notebook, and write it with its outputs."""
    import nbformat
    from nbclient import NotebookClient

    made = {"markdown": nbformat.v4.new_markdown_cell, "code": nbformat.v4.new_code_cell}
    sources = cells((SCRIPTS / f"{name}.py").read_text(encoding="utf-8"))
    notebook = nbformat.v4.new_notebook(
        cells=[made[kind](source, id=f"cell-{i}") for i, (kind, source) in enumerate(sources)],
        metadata={"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}},
    )
    os.environ.pop("MPLBACKEND", None)  # figures of pyplot belong to their cells
    NotebookClient(notebook, timeout=900, resources={"metadata": {"path": str(SCRIPTS)}}).execute()
    for cell in notebook.cells:
        cell.metadata.clear()
        if "outputs" in cell:
            cell["outputs"] = [output for output in cell["outputs"] if output.get("name") != "stderr"]
        for output in cell.get("outputs", ()):
            output.get("data", {}).pop("application/vnd.jupyter.widget-view+json", None)  # the page in a frame stays
            if "image/png" in output.get("data", {}):
                output["data"]["image/png"] = _small(output["data"]["image/png"])
    for entry in ("language_info", "widgets"):
        notebook.metadata.pop(entry, None)
    nbformat.validate(notebook)
    (NOTEBOOKS / f"{name}.ipynb").write_text(nbformat.writes(notebook) + "\n", encoding="utf-8")


def _small(picture: str) -> str:
    """A PNG in 256 colours: a third of the size."""
    from PIL import Image

    file = BytesIO()
    Image.open(BytesIO(base64.b64decode(picture))).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(
        file, format="png", optimize=True
    )
    return base64.b64encode(file.getvalue()).decode()


def page(name: str) -> tuple[str, dict[str, bytes]]:
    """Markdown of a notebook; by name its pictures NAME-0.png, NAME-1.png and so on, and pages in frames."""
    parts: list[str] = []
    files: dict[str, bytes] = {}

    def framed(found: re.Match[str]) -> str:
        files[f"{name}-view-{len(files)}.html"] = unescape(found[1]).encode()
        return f'src="../{list(files)[-1]}"'

    for cell in json.loads((NOTEBOOKS / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            if "image/png" in data:
                picture = f"{name}-{sum(each.endswith('.png') for each in files)}.png"
                parts.append(f"![Output of the cell above]({picture})")
                files[picture] = base64.b64decode("".join(data["image/png"]))
            elif "text/html" in data:
                shown = re.sub('srcdoc="([^"]*)"', framed, "".join(data["text/html"]))
                parts.append(f'<div class="output">\n{shown}\n</div>')
            else:
                text = TERMINAL.sub("", "".join(output.get("text") or data.get("text/plain", "")))
                parts.append(f"```text\n{text.rstrip()}\n```")
    source = f"[This page as a Jupyter notebook]({name}.ipynb){{ download }}"
    parts.insert(1, f"{source}. Its script is `examples/notebooks/{name}.py`.")
    return "\n\n".join(parts) + "\n", files


def names() -> list[str]:
    """Of the notebooks, in the order of the navigation."""
    text = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    return [name for name in re.findall(r"tutorials/(\w+)\.md", text) if name != "index"]


def gallery() -> str:
    """Cards with picture, title and first paragraph of every notebook."""
    cards = []
    for name in names():
        text, _ = page(name)
        title, about = re.findall(r"\A# (.*)\n\n((?:.+\n)+)", text)[0]
        picture = f"[![]({name}-0.png)]({name}.md)"
        cards.append(f"-   {picture}\n\n    **[{title}]({name}.md)**\n\n    {' '.join(about.split())}")
    return '<div class="grid cards gallery" markdown>\n\n' + "\n\n".join(cards) + "\n\n</div>"


def on_files(files: Any, config: Any, **_: Any) -> Any:
    """Called by mkdocs: adds the pages and pictures of the notebooks."""
    from mkdocs.structure.files import File

    for name in names():
        text, parts = page(name)
        files.append(File.generated(config, f"tutorials/{name}.md", content=text))
        for part, content in parts.items():
            files.append(File.generated(config, f"tutorials/{part}", content=content))
    return files


if __name__ == "__main__":
    for each in sys.argv[1:] or names():
        print(each, flush=True)
        run(each)
