"""Mooring lines move by default; where they are static, whoever records a tension is told what it lacks."""

from __future__ import annotations

import pytest

import meltemi
from meltemi.simulation.plan import planned, wind_of
from meltemi.turbine import Turbine

TENSIONS = ("FAIRTEN1", "ANCHTEN2", "line_3_fairlead_tension")
FLOATERS = ("iea15mw-volturnus", "iea22mw-semi", "nrel5mw-spar")


def floater(kind: str) -> Turbine:
    return meltemi.load_turbine("iea15mw-volturnus").replace(**{"platform.line_model": kind})


def warnings(kind: str, channels: tuple[str, ...]) -> list[str]:
    """Of a run, before it is simulated."""
    model = meltemi.build(floater(kind), meltemi.ModelOptions(time_step=0.01))
    run = meltemi.Run(model, 12.0, duration=1.0, channels=channels)
    return [words for words in wind_of(run, planned(run))[1] if "lines" in words]


@pytest.mark.parametrize("name", FLOATERS)
def test_lines_move_by_default(name: str) -> None:
    platform = meltemi.load_turbine(name).platform
    assert platform is not None
    assert platform.line_model == "dynamic" and not platform.tension_warning
    model = meltemi.build(meltemi.load_turbine(name))
    assert {"line_point", "line_state"} <= {*model.parts[0].signals}
    assert platform.line_words == "3 mooring lines, moving, of 30 segments each"


@pytest.mark.parametrize("channel", TENSIONS)
def test_a_recorded_tension_of_static_lines_has_a_warning(channel: str) -> None:
    (words,) = warnings("static", ("platform_surge", channel))
    assert "24 to 93 % too small" in words and "line_model: dynamic" in words
    assert not warnings("dynamic", (channel,))


def test_without_tensions_there_is_none() -> None:
    assert not warnings("static", ("platform_surge", "mooring_force_x"))
    assert "static shapes" in floater("static").platform.line_words


def test_a_platform_without_lines_says_nothing() -> None:
    platform = floater("static").platform.replace(lines=())
    assert not platform.tension_warning and not platform.line_words
