"""Tables for a page of the documentation."""

from __future__ import annotations

from meltemi.report.html import Table


def table_lines(table: Table) -> list[str]:
    """Caption, table and note as lines of Markdown."""

    def clean(text: str) -> str:
        return text.replace("\n", " ").replace("|", "\\|")

    head = [clean(h) for h in table.head]
    if table.groups:
        names = [text for text, span in table.groups for _ in range(span)]
        head = [f"{name}: {h}" if name else h for name, h in zip(names, head, strict=True)]
    lines = [f"*{table.caption}*", "", "| " + " | ".join(head) + " |"]
    lines.append("|" + "|".join("---" if i < table.text_columns else "---:" for i in range(len(head))) + "|")
    lines += ["| " + " | ".join(clean(cell) for cell in row) + " |" for row in table.rows]
    return lines + (["", table.note] if table.note else [])
