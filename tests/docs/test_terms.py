"""Phrases foreign to the field stay out of source, documentation and README; docs/glossary.md has the terms."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
INSTEAD = {
    r"what became of": "status, outcome, treatment",
    r"share that is done": "completed fraction",
    r"door for": "interface",
    r"hears (?:its|the|him|it)\b": "measures, receives",
    r"\b(?:is|are) no numbers?\b": "is not a number, is NaN, is not finite",
    r"moving in\b": "migration",
    r"done again": "reproduced",
    r"\bto be had\b": "available",
    r"for people\b": "for the user; engineering units",
    r"\bsays so\b": "reports, warns",
    r"\bto the (?:bit|digit)\b": "bitwise, exactly",
    r"of one's own": "user-defined",
    r"turbines? of a power coefficient": "power-coefficient turbine",
    r"averages? over (?:a|the|each) revolution": "azimuthal average",
    r"the (?:first|last) word of the operator|operator's words?\b": "operator request",
    r"swings? without end": "limit cycle",
    r"tuned by margins": "tuned for stability margins",
    r"words? of the operator": "operator request",
    r"left over\b": "residual, remainder",
    r"fills? up the last": "pads",
    r"kinds? of numbers?": "number type",
    r"told apart": "distinguished",
    r"holds? on to": "keeps, retains",
    r"makes of\b": "name the result",
    r"gives? back": "returns",
    r"(?:is|are|be) let go": "released",
    r"in (?:no|thin) air\b": "in vacuum",
    r"goes? astray": "drifts",
    r"for good\b": "permanently",
}
"""Banned phrases and the standard terms in their place."""

GENERATED = ("docs/papers", "docs/verification", "docs/performance.md")
"""Pages whose text comes from the studies."""

TEXTS = {
    name: path
    for path in (
        *ROOT.glob("*.md"),
        *(ROOT / "docs").rglob("*.md"),
        *(ROOT / "src").rglob("*.py"),
        *(ROOT / "src").rglob("*.md"),
    )
    if not (name := path.relative_to(ROOT).as_posix()).startswith((*GENERATED, "CHANGELOG.md"))
}


@pytest.mark.parametrize("phrase", INSTEAD)
def test_standard_terms(phrase: str) -> None:
    pattern = re.compile(r"\s+".join(phrase.split(" ")), re.IGNORECASE)
    for name, path in TEXTS.items():
        text = path.read_text(encoding="utf-8")
        found = [f"{name}:{text.count(chr(10), 0, m.start()) + 1}: {m[0]!r}" for m in pattern.finditer(text)]
        assert not found, f"{found}: use {INSTEAD[phrase]}"
