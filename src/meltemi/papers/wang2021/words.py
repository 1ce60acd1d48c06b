"""Sentences of the page: their words stand in ``words.md``, their numbers come from the results."""

from __future__ import annotations

from meltemi.papers.claim import paragraphs_of


def said(key: str, **numbers: object) -> str:
    """A sentence with its numbers, by its key."""
    return _WORDS[key].format(**numbers)


_WORDS = paragraphs_of("wang2021", "words.md")
