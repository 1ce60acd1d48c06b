"""Markdown pages: tables, links, paths of pictures; the same texts for HTML pages."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from meltemi.report.tables import markdown_table
from meltemi.reports.blocks import Code, Section, Table

PICTURE = re.compile(r"(!\[.*?\]\()([^/)\s]+\.png\))")
ELSEWHERE = re.compile(r"(?<!!)\[([^\]]+)\]\(\.\./[^)]*\)")
SIGNS = {"sum": "Σ ", "cos": " cos ", "sin": " sin ", "psi": "ψ", "omega": "ω", "lambda": "λ", "beta": "β"}
"""Of formulas, by their names in TeX."""


def alone(text: str) -> str:
    """A page outside the documentation: links to other pages become plain text."""
    return ELSEWHERE.sub(r"\1", text)


def documented(text: str, name: str) -> str:
    """A page for the documentation, with its pictures in a folder of its name."""
    return PICTURE.sub(rf"\g<1>{name}/\g<2>", text)


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


def plain(text: str) -> str:
    """Text without the marks of Markdown: links, emphasis, code, and formulas in TeX."""

    def formula(found: re.Match[str]) -> str:
        signs = re.sub(r"\\(\w+?)(?![a-z])", lambda sign: SIGNS.get(sign[1], sign[1]), found[1])
        return " ".join(signs.replace("{", "").replace("}", "").split())

    text = re.sub(r"(?<!!)\[([^\]]+)\]\([^)\s]*\)", r"\1", text)
    text = re.sub(r"\$([^$]+)\$", formula, text)
    return re.sub(r"(\*\*|\*|`)(?=\S)(.+?)(?<=\S)\1", r"\2", text, flags=re.S)


def plain_table(table: Table) -> Table:
    """The table with plain texts."""
    rows = [[plain(cell) for cell in row] for row in table.texts]
    return replace(
        table, head=list(map(plain, table.head)), rows=rows, caption=plain(table.caption), note=plain(table.note)
    )


def sections(text: str, first: str) -> list[Section]:
    """Chapters of a Markdown text for an HTML page; ``first`` heads what stands before the first of them."""
    heading, content, found = first, list[str | Table | Code](), []
    for block in _blocks(text):
        if block.startswith("# "):
            continue  # the title is that of the page
        if block.startswith("##"):
            found.append(Section(heading, content))
            heading, content = plain(block.lstrip("# ")), []
        elif block.startswith("```"):
            content.append(Code("\n".join(block.split("\n")[1:-1])))
        elif block.startswith("|"):
            head, *rows = table_rows(block.split("\n"))
            content.append(plain_table(Table(head, rows, text_columns=len(head))))
        else:
            content.append(plain(" ".join(line.strip() for line in re.sub("^- ", "• ", block).split("\n"))))
    return [section for section in (*found, Section(heading, content)) if section.content]


def _blocks(text: str) -> Iterator[str]:
    """Paragraphs, headings, tables, items of lists and fenced code."""
    fenced = re.split(r"^(```.*?^```)$", text, flags=re.S | re.M)
    for i, part in enumerate(fenced):
        if i % 2:
            yield part
            continue
        for paragraph in re.split(r"\n\s*\n", part):
            yield from filter(None, map(str.strip, re.split(r"^(?=- |#)", paragraph, flags=re.M)))
