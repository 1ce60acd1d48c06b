"""The style of figures: units on all axes, nothing cut off, the same for every user, and nothing left behind."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from io import BytesIO
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from meltemi import Result, SteadyWind, TurbulentWind, WindSeries, build, load_turbine, plot
from meltemi.analyses.performance import RotorPerformance
from meltemi.analysis import Campbell, Flutter, ParkedStability, compare_results, operating_point
from meltemi.loads import ensemble_table
from meltemi.plots import (
    plot_campbell,
    plot_changes,
    plot_differences,
    plot_flutter,
    plot_parked,
    plot_performance,
    plot_power_curve,
    plot_spectra,
    plot_speed_power,
    plot_states,
    plot_tuning,
    plot_wind,
)
from meltemi.report.figure import STYLE, StyledAxes, grouped
from meltemi.report.plots import MAIN_CHANNELS, apart, new_figure, panel
from meltemi.simulation.channels import standard
from meltemi.wind import generate_field

pytestmark = pytest.mark.slow

FIELD = ("series", "spectra", "coherence", "section", "profile")
TIME = np.linspace(0.0, 60.0, 601)


def result(scale: float = 1.0) -> Result:
    waves = np.stack([scale * 1e7 * (2.0 + np.sin((i + 1.0) * TIME)) for i in range(len(MAIN_CHANNELS))], axis=1)
    return Result(TIME, waves, tuple(standard()[name] for name in MAIN_CHANNELS), meta={"turbine": "a", "wind": "b"})


def modes() -> Campbell:
    """Fourteen modes, some of them on top of each other."""
    speeds, frequency = (
        np.array([4.0, 8.0, 12.0]),
        np.array([0.32, 0.32, 0.7, 0.71, 0.72, 0.9, 1.0, 1.7, 2.0, 2.9, 2.9, 4.0]),
    )
    table = 2.0 * np.pi * frequency[:, None] * np.ones(3)
    labels = tuple(f"{i + 1}. mode backward whirl" for i in range(len(frequency)))
    damping = 0.01 * np.arange(len(frequency))[:, None] * np.ones(3)
    none = tuple((None,) * 3 for _ in frequency)
    return Campbell(speeds, speeds / 10.0, 0.0 * speeds, labels, table, damping, none, True)


def performance() -> RotorPerformance:
    ratio, pitch = np.linspace(2.0, 12.0, 9), np.radians([0.0, 5.0, 10.0])
    power = 0.5 - 0.01 * (ratio[:, None] - 7.0) ** 2 - pitch
    return RotorPerformance(ratio, pitch, power, power + 0.3, power / ratio[:, None])


def changes() -> Figure:
    numbers = {"load DEL": 1e6, "power std": 5e4, "pitch travel": 0.1}
    seeds = {k: {"a": numbers, "b": {name: (1.0 + 0.1 * k) * x for name, x in numbers.items()}} for k in (1, 2)}
    units = {"pitch travel": ("deg/s", 57.3)}
    return plot_changes(ensemble_table(seeds, {}), ["load DEL", "power std"], ["pitch travel"], units)


def gust() -> WindSeries:
    return WindSeries(time=TIME, speed=12.0 + np.sin(TIME))


@cache
def field() -> dict[str, Figure]:
    wind = TurbulentWind(speed=12.0, intensity=0.14, points=7, dt=0.4, veer=1e-3)
    turbine = load_turbine("nrel5mw")
    return plot_wind(generate_field(wind, turbine, 60.0), turbine, target=wind)


def stability() -> Flutter:
    found = modes()
    limit: Any = SimpleNamespace(rotor_speed=1.0)
    damping = 0.06 - 0.05 * found.rotor_speed * np.arange(1.0, 13.0)[:, None] / 12.0
    return Flutter(0.0, 0.0, found.rotor_speed, found.labels, found.frequency, damping, damping.min(axis=0), limit)


def standstill() -> ParkedStability:
    yaw, pitch = np.radians(np.arange(-180.0, 181.0, 10.0)), np.radians([0.0, 45.0, 90.0])
    damping = 0.06 * np.cos(yaw)[:, None] * np.ones(3)
    names = ((("blade edgewise 1",) * 3),) * len(yaw)
    return ParkedStability(SteadyWind(speed=42.5), yaw, pitch, (0.0,), damping, 4.0 + 0.0 * damping, names)


def tuning() -> Any:
    side = np.geomspace(1e-3, 8.0, 200)
    W = np.concatenate([-side[::-1], side])
    L = 0.4 / (1j * W) * np.exp(-1j * W)
    point = SimpleNamespace(
        wind_speed=13.0, frequency=W, together=L, phase_margin=1.17, gain_margin=3.9, sensitivity=1.4
    )
    return {"1P pitch": SimpleNamespace(points=(point,)), "2P flap": SimpleNamespace(points=(point,))}


def power_curve() -> Figure:
    model = build(load_turbine("nrel5mw"))
    return plot_power_curve([operating_point(model, speed) for speed in (8.0, 14.0)], model)


FIGURES: dict[str, Callable[[], Any]] = {
    "plot": lambda: plot(result()),
    "several": lambda: plot([result(), result(0.8)], labels=["one", "two"]),
    "campbell": lambda: plot_campbell(modes()),
    "performance": lambda: plot_performance(performance()),
    "spectra": lambda: plot_spectra({"a": result(), "b": result(2.0)}, MAIN_CHANNELS[4], rotor=0.2).figure,
    "changes": changes,
    "steady wind": lambda: plot_wind(SteadyWind(speed=12.0, shear_exponent=0.2))["profile"],
    "series": lambda: plot_wind(gust())["series"],
    "differences": lambda: plot_differences(compare_results(result(), result(0.9)), labels=("ours", "theirs")),
    "flutter": lambda: plot_flutter(stability(), "nrel5mw"),
    "parked": lambda: plot_parked(standstill(), "nrel5mw"),
    "tuning": lambda: plot_tuning(tuning()),
    "power curve": power_curve,
    "speed and power": lambda: plot_speed_power(
        load_turbine("nrel5mw"), performance(), {"low": result(1e-7), "high": result(1.1e-7)}, 3e6
    ),
}
FIGURES |= {f"field, {name}": partial(lambda name: field()[name], name) for name in FIELD}


@pytest.fixture(scope="module", params=FIGURES)
def drawn(request: pytest.FixtureRequest) -> Any:
    mpl.get_backend()  # Matplotlib chooses one when it is asked for the first time
    before = mpl.rcParams.copy()
    figure = FIGURES[request.param]()
    figure.canvas.draw()
    assert mpl.rcParams == before, "the style is left behind"
    return figure


def test_all_axes_have_units(drawn: Any) -> None:
    panels = [ax for ax in drawn.axes if ax.get_subplotspec() is not None and ax.axison]
    bottom = max(ax.get_subplotspec().rowspan.stop for ax in panels)
    for bar in (ax for ax in drawn.axes if ax.get_label() == "<colorbar>"):
        assert "[" in bar.get_xlabel() + bar.get_ylabel() + bar.get_title()
    for ax in panels:
        assert "[" in ax.get_ylabel() + drawn.axes[0].get_ylabel()
        categories = any(text.get_text()[:1].isalpha() for text in ax.get_xticklabels())
        assert "[" in ax.get_xlabel() or categories or ax.get_subplotspec().rowspan.stop < bottom


def test_no_text_is_cut_off(drawn: Any) -> None:
    whole = drawn.bbox.padded(1.0)
    texts = [*drawn.texts, *(text for legend in drawn.legends for text in legend.get_texts())]
    for ax in drawn.axes:
        legend = ax.get_legend()
        texts += [*ax.texts, ax.xaxis.label, ax.yaxis.label, ax.title, ax._left_title, ax._right_title]
        texts += legend.get_texts() if legend else []
    boxes = {text.get_text(): box_of(text) for text in texts if text.get_visible() and text.get_text()}
    inside = (whole.x0, whole.y0), (whole.x1, whole.y1)
    assert not [
        text for text, box in boxes.items() if not ((box.min >= inside[0]).all() and (box.max <= inside[1]).all())
    ]


def box_of(text: Text) -> Any:
    """Its place on the figure, without the arrow that it may have."""
    return Text.get_window_extent(text)


def test_names_beside_curves_do_not_overlap() -> None:
    figure = plot_campbell(modes())
    figure.canvas.draw()
    for ax in figure.axes:
        names = [box_of(text) for text in ax.texts if "mode" in text.get_text()]
        assert len(names) == len(modes().labels)
        assert not any(a.overlaps(b) for i, a in enumerate(names) for b in names[:i])
    assert not figure.legends


@pytest.mark.parametrize("places", [[0.0, 0.0, 0.0], [0.1, 0.12, 0.5, 0.51], [0.3], []])
def test_places_are_moved_as_little_as_possible(places: list[float]) -> None:
    found = apart(places, 0.1)
    assert all(b - a > 0.1 - 1e-12 for a, b in pairwise(found))
    assert sum(found) == pytest.approx(sum(places))
    assert apart([0.0, 1.0], 0.1) == [0.0, 1.0]


def test_thousands_stand_apart_on_all_axes() -> None:
    assert [grouped(text) for text in ("9999", "12469 m²", "-55000", "0.008069", "123456.78901")] == [
        *("9999", "12\u2009469 m²", "-55\u2009000", "0.008069", "123\u2009456.78901")
    ]
    figure, axes = new_figure(1, size=(3.0, 2.0))
    axes[0, 0].plot([0.0, 1.0], [0.0, 5e4])
    figure.canvas.draw()
    assert "40\u2009000" in [label.get_text() for label in axes[0, 0].get_yticklabels()]


def test_names_in_other_scripts_warn_of_nothing() -> None:
    figure, axes = new_figure(1, size=(3.0, 2.0))
    axes[0, 0].set_title("\u98ce\u673a \x07")
    figure.savefig(BytesIO(), dpi=100.0)


def test_the_style_is_the_same_for_every_user() -> None:
    """Parameters of the user change nothing in figures of the package."""
    with mpl.rc_context(
        {"axes.grid": False, "font.size": 30.0, "axes.spines.top": True, "axes.titlelocation": "right"}
    ):
        figure, axes = new_figure(1, size=(3.0, 2.0))
        axes[0, 0].plot([0.0, 1.0], label="a")
        panel(axes[0, 0], "power", "MW", "time [s]")
        legend = axes[0, 0].legend()
        figure.canvas.draw()
    ax = axes[0, 0]
    assert (
        isinstance(ax, StyledAxes) and not ax.spines["top"].get_visible() and ax.xaxis.get_gridlines()[0].get_visible()
    )
    assert ax.get_title(loc="left") == "power" and ax.yaxis.label.get_fontsize() == STYLE["axes.labelsize"]
    assert ax.get_yticklabels()[0].get_fontsize() == STYLE["ytick.labelsize"]
    assert legend.get_texts()[0].get_fontsize() == STYLE["legend.fontsize"]


def test_axes_of_a_user_get_the_style() -> None:
    ax = Figure().subplots()
    panel(ax, "power", "kW")
    ax.set_ylim(0.0, 5e4)
    ax.figure.canvas.draw()
    assert "40\u2009000" in [label.get_text() for label in ax.get_yticklabels()]
    assert not ax.spines["right"].get_visible()


def test_maps_have_no_grid_and_diagrams_no_axes() -> None:
    ax = new_figure(1, size=(3.0, 2.0))[1][0, 0]
    ax.imshow(np.zeros((2, 2)))
    assert not any(line.get_visible() for line in ax.xaxis.get_gridlines())
    assert not plot_states("yaw").axes[0].axison
