"""What terminals and notebooks show of an object: key numbers with units, in sections that fold."""

from __future__ import annotations

import re
import subprocess
import sys
from html.parser import HTMLParser
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import Model, Outcome, Result, Status, SteadyWind, TurbulentWind, WindBox, load_turbine
from meltemi.analysis import Campbell, LinearModel, linearise
from meltemi.core.display import quantity
from meltemi.core.representation import BINS, MOST_ROWS, Card, Fold, html, sparkline
from meltemi.io import LoadCase
from meltemi.loads.loadbase.campaign import make_campaign
from meltemi.loads.loadbase.engine import BaseStatus, DlcStatus
from meltemi.loads.loadbase.plan import plan
from meltemi.simulation.channels import DEFAULT, standard


class Reader(HTMLParser):
    """Text of well-formed HTML, whose tags are closed in the order in which they were opened."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text: list[str] = []
        self.tags: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        assert tag not in ("script", "a", "img"), "only text and lines"
        self.open.append(tag)
        self.tags.append(tag)

    def handle_startendtag(self, tag: str, attrs: Any) -> None:
        self.tags.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open[-1] != "style":
            self.text.append(data.strip())


def read(thing: Any, *expected: str, most: int = 12_000) -> Reader:
    """The HTML of an object: well-formed, of limited size, with the expected texts in it; its ``repr`` is short."""
    text = thing._repr_html_()
    found = Reader(text)
    words = " | ".join(filter(None, found.text))
    for each in expected:
        assert each in words, words[:3000]
    assert len(text) < most
    assert len(repr(thing)) < 300
    return found


@pytest.fixture(scope="module")
def long_result() -> Result:
    """Ten minutes of the default channels."""
    time = np.linspace(0.0, 600.0, 12_001)
    channels = tuple(standard()[name] for name in DEFAULT)
    data = np.random.default_rng(1).normal(size=(len(time), len(channels))) + 1.0
    meta = {"turbine": "nrel5mw", "wind": "a <wind> & more", "transient": 60.0, "output_step": 0.05}
    meta["warnings"] = ["pitch: <look> at it"]
    return Result(time, data, channels, Status.DOUBTFUL, meta=meta)


def test_a_turbine_shows_its_key_figures_and_folds_its_parts(model: Model) -> None:
    found = read(model.turbine, "5 MW", "126 m", "3 of 61.5 m", "12.1 rpm", "8 deg/s", "airfoils", most=60_000)
    assert found.tags.count("details") > 10
    assert repr(model.turbine) == "<Turbine nrel5mw: rated power 5 MW, rotor diameter 126 m, hub height 90 m>"
    read(load_turbine("pmsg20mw"), "PowerTurbine", "20 MW", "276 m", most=20_000)


def test_a_model_shows_turbine_coordinates_and_options(model: Model) -> None:
    read(model, "nrel5mw: rated power 5 MW", "19", "1.225 kg/m^3", "Coordinates", "tower 1st fore-aft", most=70_000)
    read(meltemi.ModelOptions(stall="static"), "stall", "static", "Defaults")


def test_winds_show_speed_and_turbulence_with_units(model: Model) -> None:
    read(SteadyWind(speed=12.0, direction=0.1), "12 m/s", "5.7296 deg", "steady wind 12 m/s, direction 5.72958 deg")
    read(TurbulentWind(speed=9.0, intensity=0.14), "9 m/s", "0.14", "Kaimal turbulence 9 m/s")
    read(meltemi.iec_wind("EOG", turbine=model.turbine, wind_class="IIB", speed=12.0), "211 values", "60.00 to 70.50 s")
    velocity = np.zeros((5, 3, 3, 3), np.float32)
    velocity[..., 0] = np.linspace(9.0, 11.0, 5)[:, None, None]
    box = WindBox(velocity, dt=0.5, dy=10.0, dz=10.0, bottom=70.0, speed=10.0, source="mine")
    read(box, "5 planes of 3 x 3 points, 2 s", "70 to 90 m", "mean m/s", "9.000", "11.00")


def test_a_result_shows_status_messages_and_statistics(long_result: Result) -> None:
    text = long_result._repr_html_()
    found = read(long_result, "DOUBTFUL", "0 to 600 s", "60.0 s", "rotor_speed", "RotSpeed", "rpm", most=60_000)
    assert "a <wind> & more" in " ".join(found.text) and "a <wind>" not in text, "texts are escaped"
    assert "pitch: <look> at it" in found.text
    assert found.tags.count("svg") == len(DEFAULT)
    cells = [cell for cell in found.text if cell]
    i = cells.index("rotor_speed")
    x = long_result.evaluated["rotor_speed"] * 30.0 / np.pi
    assert float(cells[i + 3]) == pytest.approx(x.mean(), rel=1e-3), "after the transient, in rpm"
    assert repr(long_result).startswith("<Result: 37 channels, 0 to 600 s, DOUBTFUL")


def test_of_many_channels_the_rest_is_counted(long_result: Result) -> None:
    many = Result(long_result.time, np.tile(long_result.data, 5), long_result.channels * 5)
    read(many, f"and {5 * len(DEFAULT) - MOST_ROWS} more", "OK", most=90_000)
    read(Result(np.zeros(0), np.zeros((0, 1)), many.channels[:1], Status.DIVERGED), "empty", "DIVERGED")


@pytest.mark.slow
def test_a_linear_model_shows_operating_point_and_modes(model: Model) -> None:
    point = meltemi.operating_point(model, 12.0)
    linear = linearise(model, point)
    read(point, "12 m/s", "12.1 rpm", "kW")
    found = read(linear, "3 inputs, 2 outputs", "fixed frame", "12.1 rpm", "damping %", "rotor_speed", most=30_000)
    assert len(linear.modes()) == int(found.text[found.text.index("Modes") + 1])


def test_modes_over_rotor_speed_have_units_of_the_field() -> None:
    speed, frequency, damping = np.array([1.0, 1.2]), np.array([[3.0, 4.0]]), np.array([[0.05, 0.02]])
    made = Campbell(speed, speed, 0.0 * speed, ("1st flap",), frequency, damping, ((None, None),), air=True)
    facts, (modes,) = dict(made.card().facts), made.card().sections
    assert facts["rotor speed"] == "9.549 to 11.46 rpm, 2 operating points"
    (row,) = modes.rows
    assert (row[1:3], row[4:6]) == (["0.4775", "0.6366"], ["5", "2"])


def test_a_linear_model_has_frequency_and_damping_of_its_matrix() -> None:
    """Of an oscillator of 3 rad/s and 5 %."""
    A, B, C, D = np.array([[0.0, 1.0], [-9.0, -0.3]]), np.ones((2, 1)), np.ones((1, 2)), np.zeros((1, 1))
    names, units = (("q a", "v a"), ("pitch",), ("power",)), (("m", "m/s"), ("rad",), ("W",))
    point: Any = SimpleNamespace(facts=lambda: {"rotor_speed": "12 rpm"})
    made = LinearModel(A, B, C, D, *names, *units, np.zeros(2), np.zeros(1), np.zeros(1), 0.5, point)
    card = made.card()
    assert card.facts[-1] == ("rotor speed", "12 rpm")
    assert card.facts[1] == ("frame", "blade 1 at 28.6479 deg")
    assert card.sections[0].rows[0][:2] == ["0.4775", "5"]


def test_a_load_case_and_an_outcome(long_result: Result) -> None:
    wind = {"kind": "iec", "model": "NTM", "wind_class": "IIB", "speed": 12.0}
    case = LoadCase(turbine="nrel5mw", wind=wind, duration=600.0, events=[{"at": 2.0, "type": "grid_loss"}])
    read(case, "nrel5mw, iec NTM wind 12 m/s, 600 s", "IIB", "GridLoss", "2 s", "Defaults", most=14_000)
    read(Outcome("a", Status.FAILED, "no <file>"), "FAILED", "no <file>")
    read(Outcome("a", Status.OK, value=long_result), "OK", "rotor_speed", most=60_000)


def test_a_load_base() -> None:
    planned = plan(make_campaign("nrel5mw", "IB", 4, quick=True, rated_wind=11.4))
    read(planned, "class IB", "h simulated", "1.1", "V_ref 50 m/s", most=40_000)
    status = BaseStatus((DlcStatus("1.1", 5, 2, 0, 1, 2, 0),), {"dlc1.1-a": "tip < tower"}, 0.4, {}, 0)
    read(status, "3 of 5 cases", "0.4 h", "tip < tower")


def test_quantities_have_engineering_units() -> None:
    assert quantity(1.2671, "rad/s", "rotor_speed") == "12.1 rpm"
    assert quantity(0.1, "rad/s", "rate_limit") == "5.7296 deg/s"
    assert quantity(3.2, "rad/s", "natural_frequency") == "3.2 rad/s"
    assert quantity(5e6, "W") == "5000 kW"
    assert quantity(0.14, "") == "0.14"


def test_a_small_line_keeps_the_extremes() -> None:
    x = np.zeros(10_000)
    x[5000], x[7000] = 3.0, -1.0
    points = re.findall(r"(\d+),([\d.]+)", sparkline(x))
    assert len(points) == 2 * BINS
    heights = [float(y) for _, y in points]
    assert (min(heights), max(heights)) == (1.0, 17.0), "the whole height is used"
    assert float(points[int(np.argmin(heights))][0]) == pytest.approx(BINS, abs=2), "the peak is in the middle"
    assert sparkline([1.0]) == "" and "nan" not in sparkline([1.0, np.nan, 2.0])


def test_texts_are_escaped() -> None:
    card = Card("<b>", "x & y", [("a<", "<i>")], [Fold("<u>", [["<s>"]], ["<h>"], note="<n>")])
    assert not set(Reader(html(card)).tags) & {"i", "u", "s", "h", "n"}


def test_representations_are_not_loaded_with_the_package() -> None:
    code = "import sys, meltemi; print([m for m in sys.modules if m.startswith('meltemi.')])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "['meltemi.namespaces']"
