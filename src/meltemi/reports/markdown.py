"""Documents as Markdown, whose texts have its marks: sections, links, paths of pictures; their texts without marks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from meltemi.report.tables import markdown_table
from meltemi.reports.blocks import Block, Code, Picture, Section, Subsection, Table

Whole = TypeVar("Whole")
PICTURE = re.compile(r"(!\[.*?\]\()([^/)\s]+\.png\))")
ELSEWHERE = re.compile(r"(?<!!)\[([^\]]+)\]\(\.\./[^)]*\)")
SIGNS = {"sum": "Σ ", "cos": " cos ", "sin": " sin ", "psi": "ψ", "omega": "ω", "lambda": "λ", "beta": "β"}
"""Signs of formulas by their names in TeX."""


def alone(text: str) -> str:
    """A page outside the documentation: links to other pages become plain text."""
    return ELSEWHERE.sub(r"\1", text)


def documented(text: str, name: str) -> str:
    """A page for the documentation, with its pictures in a folder of its name."""
    return PICTURE.sub(rf"\g<1>{name}/\g<2>", text)


def section_lines(section: Section) -> list[str]:
    """A section as lines of Markdown."""
    return [f"## {section.heading}", "", *(line for each in section.content for line in (*block_lines(each), ""))]


def block_lines(block: Block) -> list[str]:
    """A text, table, picture or part as lines of Markdown."""
    match block:
        case str():
            return [block]
        case Table():
            return table_lines(block)
        case Picture(png=Path() as file):
            return [f"![{block.caption}]({file.name})"]
        case Subsection():
            return [f"### {block.heading}", *(line for each in block.content for line in ("", *block_lines(each)))]
    raise TypeError(f"{type(block).__name__}: no block of Markdown")


def table_lines(table: Table) -> list[str]:
    """Caption, table and note as lines of Markdown."""

    head = table.head
    if table.groups:
        names = [text for text, span in table.groups for _ in range(span)]
        head = [f"{name}: {h}" if name else h for name, h in zip(names, head, strict=True)]
    lines = [f"*{table.caption}*", "", *markdown_table(head, table.texts, table.text_columns)]
    return lines + (["", table.note] if table.note else [])


def table_rows(lines: list[str]) -> list[list[str]]:
    """Cells of the lines of a Markdown table, its head first."""
    cells = [[cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]
    return [row for row in cells if not all(re.fullmatch(":?-+:?", cell) for cell in row)]


def plain(value: Whole) -> Whole:
    """A text without the marks of Markdown, or a document whose texts are without: links, emphasis, code, formulas."""
    result: Any = value
    if isinstance(value, str):
        text = re.sub(r"(?<!!)\[([^\]]+)\]\([^)\s]*\)", r"\1", value)
        text = re.sub(r"\$([^$]+)\$", _formula, text)
        result = re.sub(r"(\*\*|\*|`)(?=\S)(.+?)(?<=\S)\1", r"\2", text, flags=re.S)
    elif isinstance(value, list | tuple):
        texts = map(plain, value)
        result = tuple(texts) if isinstance(value, tuple) else list(texts)
    elif is_dataclass(value) and not isinstance(value, Code | type):
        result = replace(value, **{each.name: plain(getattr(value, each.name)) for each in fields(value)})
    return result


def _formula(match: re.Match[str]) -> str:
    """A formula in TeX as text."""
    signs = re.sub(r"\\(\w+?)(?![a-z])", lambda sign: SIGNS.get(sign[1], sign[1]), match[1])
    return " ".join(signs.replace("{", "").replace("}", "").split())


def sections(text: str, first: str) -> list[Section]:
    """Chapters of a Markdown text for an HTML page; ``first`` heads what stands before the first of them."""
    heading, content, chapters = first, list[Block](), []
    for block in _blocks(text):
        if block.startswith("# "):
            continue  # the title is that of the page
        if block.startswith("##"):
            chapters.append(Section(heading, content))
            heading, content = block.lstrip("# "), []
        elif block.startswith("```"):
            content.append(Code("\n".join(block.split("\n")[1:-1])))
        elif block.startswith("|"):
            head, *rows = table_rows(block.split("\n"))
            content.append(Table(head, rows, text_columns=len(head)))
        else:
            content.append(" ".join(line.strip() for line in re.sub("^- ", "• ", block).split("\n")))
    return [section for section in (*chapters, Section(heading, content)) if section.content]


def _blocks(text: str) -> Iterator[str]:
    """Paragraphs, headings, tables, items of lists and fenced code."""
    fenced = re.split(r"^(```.*?^```)$", text, flags=re.S | re.M)
    for i, part in enumerate(fenced):
        if i % 2:
            yield part
            continue
        for paragraph in re.split(r"\n\s*\n", part):
            yield from filter(None, map(str.strip, re.split(r"^(?=- |#)", paragraph, flags=re.M)))
