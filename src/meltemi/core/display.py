"""Short representations of objects for terminals and notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from html import escape
from typing import Any

import numpy as np

LONGEST = 60
"""Characters of a value; of a longer one, kind and size are shown."""


def brief(value: Any) -> str:
    """The ``repr`` of a value, shortened to a description if it is long."""
    if isinstance(value, np.ndarray) and value.size > 6:
        return f"<{' x '.join(map(str, value.shape))} numbers>"
    text = repr(value)
    if len(text) <= LONGEST:
        return text
    if isinstance(value, str):
        return f"{text[: LONGEST - 4]}...'"
    if isinstance(value, (Mapping, Sequence)):
        return f"<{len(value)} entries>"
    return f"<{type(value).__name__}>"


def one_line(title: str, facts: Mapping[str, str]) -> str:
    """Names and values in the form of a call."""
    return f"{title}({', '.join(f'{name}={text}' for name, text in facts.items())})"


def html_table(title: str, facts: Mapping[str, str]) -> str:
    """HTML table of names and values under a title."""
    rows = "".join(
        f"<tr><th>{escape(name)}</th><td>{escape(text, quote=False)}</td></tr>" for name, text in facts.items()
    )
    return f'<table style="text-align: left"><caption><b>{escape(title)}</b></caption>{rows}</table>'


class Brief:
    """Base of dataclasses that hold arrays or other records; they are decorated with ``repr=False``."""

    def facts(self) -> dict[str, str]:
        """Names and values to be displayed, as text."""
        return {f.name: brief(getattr(self, f.name)) for f in fields(self) if f.repr}  # type: ignore[arg-type]

    def __repr__(self) -> str:
        return one_line(type(self).__name__, self.facts())

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, self.facts())
