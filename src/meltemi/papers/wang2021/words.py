"""Sentences of the page from ``words.md``, with numbers from the results."""

from __future__ import annotations

from meltemi.papers.claim import paragraphs_of


def sentence(key: str, **numbers: object) -> str:
    """A sentence with numbers, by its key."""
    return _WORDS[key].format(**numbers)


_WORDS = paragraphs_of("wang2021", "words.md")
