"""A published study reproduced, put into the documentation: its page, its pictures beside it, and the papers' summary.

    python tools/paper_page.py palanimuthu2022 out --beyond all

What lies in the folder ``out`` from earlier parts beyond the paper stays on the page. Without arguments only the
summary of the pages that are there is written.
"""

from __future__ import annotations

import re
import shutil
import sys
from importlib import import_module
from pathlib import Path

from meltemi.papers.commands import STUDIES
from meltemi.papers.study import reproduce
from meltemi.papers.summary import summary

DOCS = Path(__file__).parents[1] / "docs" / "papers"


def main(name: str, out: Path, beyond: str = "") -> None:
    """Run the study and copy what its page shows."""
    study = import_module(f"meltemi.papers.{name}.page").STUDY
    parts = study.parts if beyond == "all" else [part for part in beyond.split(",") if part]
    out.mkdir(parents=True, exist_ok=True)
    found = reproduce(study, out, parts=parts)
    for cell, why in found.failed.items():
        sys.exit(f"not for the documentation: {cell}: {why}")
    text = found.page
    (DOCS / f"{name}.md").write_text(text, encoding="utf-8")
    for picture in re.findall(rf"\]\({name}/([^)]+)\)", text):
        shutil.copy(out / picture, DOCS / name)
    write_summary()


def write_summary() -> None:
    """Write the summary of the pages."""
    pages = {f"{name}.md": (DOCS / f"{name}.md").read_text(encoding="utf-8") for name in STUDIES}
    (DOCS / "index.md").write_text(summary(pages), encoding="utf-8")


if __name__ == "__main__":
    if given := [word for word in sys.argv[1:] if word != "--beyond"]:
        main(given[0], Path(given[1]), *given[2:])
    else:
        write_summary()
