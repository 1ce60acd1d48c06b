"""The offshore decks of the rosco package beside the library's turbines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meltemi
from meltemi.core.record import Record
from meltemi.exchange.deck_case import deck_case
from meltemi.floating.coefficients import read_coefficients
from meltemi.floating.platform import Platform
from meltemi.sea.support import Support

pytestmark = pytest.mark.rosco


def deck_of(folder: Path, name: str) -> meltemi.io.Deck:
    return meltemi.io.read_deck(next(folder.rglob(f"IEA-15-240-RWT-{name}.fst")))


def unlike(a: Record, b: Record) -> set[str]:
    """Names of the fields that differ."""
    return {name for name, value in a.content().items() if repr(value) != repr(b.content()[name])}


def test_the_pile_is_the_one_of_the_library(rosco_cases: Path) -> None:
    deck, library = deck_of(rosco_cases, "Monopile"), meltemi.load_turbine("iea15mw-monopile")
    found, expected = deck.turbine.support, library.support
    assert isinstance(found, Support) and isinstance(expected, Support)
    assert unlike(found, expected) == {"damping", "stations", "source"} and found.damping == 0.0
    case = deck_case(deck, "turbine.yaml")
    assert case.sea is not None and case.sea.label == "JONSWAP sea 4.52 m, 9.45 s, seed 123456789"


def test_the_platform_is_the_one_of_the_library(rosco_cases: Path) -> None:
    deck, library = deck_of(rosco_cases, "UMaineSemi"), meltemi.load_turbine("iea15mw-volturnus")
    found, expected = deck.turbine.platform, library.platform
    assert isinstance(found, Platform) and isinstance(expected, Platform)
    names = {"volume", "coefficients", "members", "source", "segments", "lines", "drift_directions"}
    assert unlike(found, expected) <= names
    assert all(unlike(a, b) <= {"strength"} for a, b in zip(found.lines, expected.lines, strict=True))
    assert found.volume == pytest.approx(expected.volume, rel=1e-8)
    ours, theirs = read_coefficients(found.coefficients), read_coefficients(expected.coefficients)
    for name in ("added_mass", "excitation", "hydrostatic", "drift"):
        a, b = getattr(ours, name), getattr(theirs, name)
        assert np.abs(a - b).max() < 1e-7 * np.abs(b).max(), name
