"""What terminals and notebooks show of an object: short words, tables, pictures."""

from __future__ import annotations

from typing import Any

import numpy as np

from meltemi import Model, Result, load_turbine, plot
from meltemi.core.display import LONGEST, brief
from meltemi.plots import plot_states
from meltemi.simulation.channels import standard
from meltemi.turbine import RotorPerformance


def shown(thing: Any) -> None:
    """A terminal gets a few lines, a notebook a table."""
    assert len(repr(thing)) < 300
    assert thing._repr_html_().count("<tr>") > 1
    assert len(thing._repr_html_()) < 70_000


def test_large_objects_are_shown_in_a_few_lines(model: Model) -> None:
    """A model took 190,076 characters, a turbine 47,907."""
    assert repr(model) == "Model('nrel5mw', 19 coordinates)"
    for thing in (model, model.turbine, model.turbine.blade.structure, model.options, load_turbine("pmsg20mw")):
        shown(thing)
    shown(RotorPerformance(*(np.linspace(0.0, 1.0, 50) for _ in range(2)), *(np.ones((50, 50)) for _ in range(3))))


def test_what_is_short_is_shown_as_it_is() -> None:
    assert brief(np.zeros((12, 3))) == "<12 x 3 numbers>"
    assert brief((1.0, 2.0)) == "(1.0, 2.0)"
    assert len(brief("word " * 50)) == LONGEST
    assert brief({n: n for n in range(100)}) == "<100 entries>"


def test_figures_are_pictures_in_notebooks() -> None:
    """Figures are made without pyplot, so a notebook has to be told how to show them."""
    time = np.linspace(0.0, 9.0, 10)
    run = Result(time, time[:, None], (standard()["rotor_speed"],), meta={})
    for figure in (plot(run), plot_states("yaw")):
        assert figure._repr_png_().startswith(b"\x89PNG")
