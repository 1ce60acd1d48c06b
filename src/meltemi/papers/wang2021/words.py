"""Sentences of the page, with numbers from the results."""

from __future__ import annotations

from meltemi.papers.claim import sentences_of

sentence = sentences_of("wang2021")
