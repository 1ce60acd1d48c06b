"""What the pages need to be built and read: docstrings that name arguments one by one, nothing from the web."""

from __future__ import annotations

import inspect
import re
from importlib import import_module
from pathlib import Path
from pkgutil import resolve_name

import pytest

ROOT = Path(__file__).parents[2]
SHOWN = sorted(set(re.findall(r"^::: (\S+)", (ROOT / "docs/reference/python.md").read_text("utf-8"), re.MULTILINE)))


@pytest.mark.parametrize("path", SHOWN)
def test_documented_arguments_are_those_of_the_signature(path: str) -> None:
    """``mkdocs build`` stops where a docstring names two arguments on a line, or one that is not there."""
    found = resolve_name(path)
    own = [v for v in vars(found).values() if callable(v) and getattr(v, "__module__", "") == path]
    for thing in own if inspect.ismodule(found) else [found]:
        methods = vars(thing).items() if isinstance(thing, type) else ()
        for each in [thing, *(v for k, v in methods if inspect.isfunction(v) and k[0] != "_")]:
            part = re.search(r"^Args:\n((?: +.*\n?|\n)*)", inspect.getdoc(each) or "", re.MULTILINE)
            named = re.findall(r"^ {2}(\S.*?):", part[1], re.MULTILINE) if part else []
            assert not named or set(named) <= set(inspect.signature(each).parameters), each


@pytest.mark.parametrize("page", sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "docs").rglob("*.md")))
def test_tables_of_pages_are_made(page: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "tools")
    assert "{{ " not in import_module("docs_tables").on_page_markdown((ROOT / page).read_text(encoding="utf-8"))


def test_pages_take_nothing_from_the_web() -> None:
    """Formulas are read offline, too."""
    text = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    extra = [f for line in re.findall(r"^extra_\w+: \[(.*)\]$", text, re.MULTILINE) for f in line.split(", ")]
    assert "javascripts/katex/katex.min.js" in extra
    assert all((ROOT / "docs" / file).is_file() for file in extra)
    folder = ROOT / "docs/javascripts/katex"
    fonts = set(re.findall(r"fonts/\S+?\.woff2", (folder / "katex.min.css").read_text(encoding="utf-8")))
    assert fonts and all((folder / font).is_file() for font in fonts)
    assert "http" not in "".join(extra) and (folder / "LICENSE").is_file()


def test_equations_are_where_the_sources_say() -> None:
    """Numbers of equations are unique on a page, and those that a module cites are on the pages that it names."""
    number = r"\b([A-Z]{1,2})-(\d+[a-z]?)\b"
    texts = {
        path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in (ROOT / "docs").rglob("*.md")
    }
    given = {page: re.findall(r"\\tag\{(.*?)\}", text) for page, text in texts.items()}
    for page, tags in given.items():
        assert len(tags) == len(set(tags)), f"{page}: {sorted(t for t in set(tags) if tags.count(t) > 1)}"
    named = {page: set(re.findall(number, text)) for page, text in texts.items()}
    for path in sorted((ROOT / "src").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        pages = re.findall(r"docs/[\w/-]+\.md", text)
        known = set[tuple[str, str]]().union(*(named[page] for page in pages))
        kinds = {tag.split("-")[0] for page in pages for tag in given[page]}
        lost = {cited for cited in set(re.findall(number, text)) - known if cited[0] in kinds}
        assert not lost, f"{path.name} cites {sorted('-'.join(each) for each in lost)}"
