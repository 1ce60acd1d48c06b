"""Plots and tables: labelled axes, units for people, files that hold a picture."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

import matplotlib.colors
import matplotlib.image
import numpy as np
import pytest
from rich.console import Console

from meltemi import InputError, Model, Result, operating_point, plot
from meltemi.analyses.performance import RotorPerformance
from meltemi.analysis import OperatingPoint
from meltemi.plots import plot_performance, plot_power_curve
from meltemi.report.palette import COLOURS
from meltemi.report.plots import MAIN_CHANNELS, new_figure, plot_channel, save
from meltemi.report.tables import POWER_CURVE, markdown_table, power_curve_rows, rich_table
from meltemi.simulation.channels import every_kind

TIME = np.linspace(0.0, 20.0, 201)


def result(*names: str, scale: float = 1.0, turbine: str = "nrel5mw") -> Result:
    """Waves under the names of channels."""
    data = np.stack([scale * (i + 1.0) * np.sin(TIME + i) for i in range(len(names))], axis=1)
    meta = {"turbine": turbine, "wind": "steady wind 9 m/s"}
    return Result(TIME, data, tuple(every_kind()[name] for name in names), meta=meta)


def panels(figure: Any) -> dict[str, Any]:
    """Axes by their titles."""
    return {ax.get_title(loc="left"): ax for ax in figure.axes}


def labelled(figure: Any) -> None:
    """Every panel says what it shows and in which unit; every column says what it is over."""
    for ax in figure.axes:
        assert ax.get_title(loc="left") or ax.get_ylabel()
        assert "[" in ax.get_ylabel()
        assert ax.lines
        assert all(len(line.get_xdata()) > 0 for line in ax.lines)
        if ax.get_subplotspec().is_last_row():
            assert "[" in ax.get_xlabel()


def test_what_happened_is_marked_and_listed() -> None:
    """In every panel; entries that are close share a number; those outside the plot are left out."""
    some = result("rotor_speed", "root_moment_out_of_plane_1")
    entries = [
        (2.0, "event", "grid lost"),
        (2.1, "supervisor", "production -> stop"),
        (15.0, "event", "grid lost: over"),
    ]
    some.meta["log"] = [{"time": t, "source": source, "what": what} for t, source, what in [*entries, (30.0, "x", "y")]]
    figure = plot(some, ["RotSpeed", "RootMyc1"])
    for ax in figure.axes:
        assert [line.get_xdata()[0] for line in ax.lines[1:]] == [2.0, 2.1, 15.0]
    assert [text.get_text() for text in figure.axes[0].texts] == ["1 to 2", "3"]
    (legend,) = figure.legends
    said = [text.get_text() for text in legend.get_texts()]
    assert said == ["1: 2 s, grid lost", "2: 2.1 s, production -> stop", "3: 15 s, grid lost: over"]
    colours = [line.get_color() for line in figure.axes[0].lines[1:]]
    assert colours[0] == colours[2] != colours[1]
    assert not plot([some, some], ["RotSpeed"]).axes[0].texts
    some.meta["log"] *= 5
    assert [text.get_text() for text in plot(some, ["RotSpeed"]).legends[0].get_texts()][-1] == "and 4 more"


def test_a_result_is_plotted_in_units_for_people() -> None:
    some = result("rotor_speed", "root_moment_out_of_plane_1")
    figure = plot(some, ["RotSpeed", "RootMyc1"])
    labelled(figure)
    speed, moment = figure.axes
    assert (speed.get_title(loc="left"), speed.get_ylabel()) == ("rotor speed", "[rpm]")
    assert (moment.get_title(loc="left"), moment.get_ylabel()) == ("root moment out of plane 1", "[kN m]")
    assert moment.get_xlabel() == "time [s]"
    np.testing.assert_array_equal(speed.lines[0].get_xdata(), TIME)
    np.testing.assert_allclose(speed.lines[0].get_ydata(), some["rotor_speed"] * 30.0 / np.pi)
    np.testing.assert_allclose(moment.lines[0].get_ydata(), some["RootMyc1"] * 1e-3)
    assert figure.get_suptitle() == "nrel5mw: steady wind 9 m/s"


def test_of_many_channels_the_main_ones_are_plotted_by_default() -> None:
    """Those at sea among them; three blades share a panel."""
    at_sea = ("wave_elevation", "platform_surge", "platform_pitch", "line_1_fairlead_tension")
    many = ("azimuth", "wind_y", "wind_z", "nacelle_yaw", "rotor_torque", "platform_sway", "platform_yaw")
    titles = [name.replace("_", " ") for name in (*MAIN_CHANNELS, *at_sea)]
    assert list(panels(plot(result(*many, *at_sea, *MAIN_CHANNELS[::-1])))) == titles
    assert list(panels(plot(result(*many, *MAIN_CHANNELS)))) == titles[: len(MAIN_CHANNELS)]


def test_no_recorded_channel_is_dropped() -> None:
    names = ["azimuth", "wind_y", "pitch_1", "pitch_2", "pitch_3", "nacelle_yaw", "rotor_torque", "platform_sway"]
    some = result(*names)
    some.data[:, 4] = some.data[:, 3] = some.data[:, 2]
    found = panels(plot(some))
    assert list(found) == ["azimuth", "wind y", "pitch", "nacelle yaw", "rotor torque", "platform sway"]
    assert [line.get_label() for line in found["pitch"].lines] == ["blades 1 to 3"]
    some.data[3, 4] += 0.1
    assert len(panels(plot(some))["pitch"].lines) == 3


def test_the_title_names_the_sea() -> None:
    some = result("wave_elevation")
    some.meta["waves"] = "regular wave 4 m, 12 s"
    assert plot(some).get_suptitle() == "nrel5mw: steady wind 9 m/s, regular wave 4 m, 12 s"


def test_several_results_lie_on_top_of_each_other() -> None:
    a, b = result("wind_x", "rotor_speed"), result("wind_x", "rotor_speed", scale=2.0, turbine="other")
    figure = plot([a, b])
    labelled(figure)
    for ax in figure.axes:
        assert len(ax.lines) == 2
        assert len({line.get_color() for line in ax.lines}) == 2
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == ["nrel5mw", "other"]
    legend = plot([a, b], labels=["before", "after"]).axes[0].get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["before", "after"]


def test_one_result_needs_no_legend() -> None:
    assert plot(result("wind_x")).axes[0].get_legend() is None


def test_long_titles_are_shortened() -> None:
    some = result("wind_x")
    some.meta["wind"] = "x" * 200
    assert len(plot(some).get_suptitle()) == 90


def test_what_cannot_be_plotted_is_refused() -> None:
    with pytest.raises(InputError, match="plot: no results"):
        plot([])
    with pytest.raises(InputError, match="plot: the result has no channels"):
        plot(Result(TIME, np.zeros((len(TIME), 0)), ()))
    with pytest.raises(InputError, match="no channel 'wind_y': did you mean wind_x"):
        plot(result("wind_x"), ["wind_y"])


def test_a_channel_in_axes_of_the_caller() -> None:
    axes = new_figure(2, size=(4.0, 4.0))[1]
    ax = plot_channel(result("pitch_1"), "BldPitch1", axes[1, 0], label="mine", colour="red")
    assert ax is axes[1, 0]
    assert (ax.lines[0].get_label(), ax.lines[0].get_color()) == ("mine", "red")
    assert not axes[0, 0].lines
    assert plot_channel(result("pitch_1"), "pitch_1") is not ax


@pytest.fixture(scope="module")
def points(model: Model) -> list[OperatingPoint]:
    return [operating_point(model, speed) for speed in (8.0, 14.0)]


def test_all_blades_are_shown_from_the_first_instant_on() -> None:
    """One blade alone hides the one that is stuck; 3 s before the run there was nothing."""
    names = [f"{name}_{b}" for name in ("pitch", "root_moment_out_of_plane") for b in (1, 2, 3)]
    found = panels(plot(result("rotor_speed", *names, scale=1e7)))
    assert list(found) == ["rotor speed", "pitch", "root moment out of plane"]
    assert [len(ax.lines) for ax in found.values()] == [1, 3, 3]
    assert all(ax.get_xlim() == (0.0, 20.0) for ax in found.values())
    assert found["root moment out of plane"].get_ylabel() == "[MN m]"
    assert [t.get_text() for t in found["pitch"].get_legend().get_texts()] == ["blade 1", "blade 2", "blade 3"]


@pytest.mark.slow
def test_a_power_curve_is_plotted(points: list[OperatingPoint], model: Model) -> None:
    figure = plot_power_curve(points)
    labelled(figure)
    assert {ax.get_xlabel() for ax in figure.axes} == {"", "wind speed [m/s]"}
    power = panels(figure)["generator power"]
    assert power.get_ylabel() == "[kW]"
    assert "$C_p$" not in "".join(panels(figure)), "it needs the rotor's radius"
    ratio = panels(plot_power_curve(points, model))["power coefficient $C_p$"].lines[0]
    assert 0.45 < ratio.get_ydata()[0] < 0.593
    np.testing.assert_array_equal(power.lines[0].get_xdata(), [8.0, 14.0])
    assert power.lines[0].get_ydata()[1] == pytest.approx(5000.0, rel=0.01)
    tip = panels(figure)["tip deflection"]
    assert [text.get_text() for text in tip.texts] == ["tip out of plane", "tip in plane"]


def test_a_power_curve_is_tabulated(points: list[OperatingPoint]) -> None:
    head, rows = power_curve_rows(points)
    assert len(head) == 1 + len(POWER_CURVE) == len(rows[0]) == len(rows[1])
    assert head[0] == "wind\nm/s"
    assert all("\n" in name for name in head)
    assert [row[0] for row in rows] == ["8.000", "14.00"]
    assert float(rows[1][head.index("power\nkW")]) == pytest.approx(5000.0, rel=0.01)
    assert float(rows[0][head.index("speed\nrpm")]) == pytest.approx(points[0]["rotor_speed"] * 30.0 / np.pi, rel=1e-3)


def performance() -> RotorPerformance:
    ratio, pitch = np.linspace(4.0, 12.0, 9), np.radians([0.0, 5.0])
    power = 0.48 - 0.01 * (ratio[:, None] - 7.5) ** 2 - pitch
    return RotorPerformance(ratio, pitch, power, 2.0 * power, power / ratio[:, None])


def test_performance_is_plotted() -> None:
    figure = plot_performance(performance())
    labelled(figure)
    assert [ax.get_ylabel() for ax in figure.axes] == ["$C_p$ [-]", "$C_t$ [-]", "$C_q$ [-]"]
    assert {ax.get_xlabel() for ax in figure.axes} == {"tip-speed ratio [-]"}
    assert [text.get_text() for text in figure.axes[0].get_legend().get_texts()] == ["0 deg", "5 deg"]
    for ax, values in zip(figure.axes, (performance().power, performance().thrust, performance().torque), strict=True):
        np.testing.assert_array_equal(ax.lines[1].get_ydata(), values[:, 1])


@pytest.mark.parametrize("draw", [lambda: plot(result(*MAIN_CHANNELS)), lambda: plot_performance(performance())])
def test_a_picture_is_saved(tmp_path: Path, draw: Callable[[], Any]) -> None:
    path = save(draw(), tmp_path / "a.png")
    picture = matplotlib.image.imread(path)
    assert path == tmp_path / "a.png"
    assert min(picture.shape[:2]) > 300
    # lines in their colour, not a blank page
    ink = np.abs(picture[..., :3] - matplotlib.colors.to_rgb(COLOURS[0])).max(axis=-1) < 0.02
    assert ink.sum() > 500


@pytest.mark.parametrize(("name", "begin"), [("a.svg", b"<?xml"), ("a.pdf", b"%PDF")])
def test_the_ending_of_the_name_chooses_the_format(tmp_path: Path, name: str, begin: bytes) -> None:
    assert save(plot(result("wind_x")), str(tmp_path / name)).read_bytes().startswith(begin)


@pytest.mark.parametrize("name", ["nowhere/a.png", "folder.png"])
def test_pictures_that_cannot_be_written_are_named(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(InputError, match=rf"{name}: cannot be written \("):
        save(plot(result("wind_x")), tmp_path / name)


def test_formats_that_do_not_exist_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a\.xyz: "):
        save(plot(result("wind_x")), tmp_path / "a.xyz")


@pytest.mark.slow
def test_plots_need_no_display_and_leave_no_global_state() -> None:
    code = (
        "import sys, numpy as np\n"
        "from meltemi.report.plots import plot\n"
        "from meltemi.simulation.channels import standard\n"
        "from meltemi.simulation.result import Result\n"
        "plot(Result(np.arange(3.0), np.zeros((3, 1)), (standard()['wind_x'],)))\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_tables_on_the_terminal() -> None:
    console = Console(width=60, record=True, file=StringIO())
    console.print(rich_table("A title", ["name", "value"], [["first", "1.5"], ["second", "-22"]]))
    lines = console.export_text().splitlines()
    assert lines[0].strip() == "A title"
    cells = [[cell.strip() for cell in line.strip("│").split("│")] for line in lines if line.startswith("│")]
    assert cells == [["first", "1.5"], ["second", "-22"]]
    # numbers stand at the right
    ends = {line.rstrip("│").rstrip()[-1] for line in lines if line.startswith("│")}
    assert ends == {"5", "2"}


def test_units_in_brackets_are_shown_on_the_terminal() -> None:
    """Not taken for styles of text."""
    console = Console(width=80, record=True, file=StringIO())
    console.print(rich_table("at [hub]", ["wind [m/s]", "mean [kW]"], [["density [kg/m³]", "1.2"]]))
    text = console.export_text()
    assert all(words in text for words in ("at [hub]", "wind [m/s]", "mean [kW]", "density [kg/m³]"))


def test_cells_of_a_markdown_table_stay_in_their_column() -> None:
    lines = markdown_table(["load\nkN m", "value"], [["a|b", "1"], ["", "2"]], text_columns=1)
    assert lines == ["| load kN m | value |", "|---|---:|", "| a\\|b | 1 |", "|  | 2 |"]
    assert markdown_table(["x", "y"], []) == ["| x | y |", "|---|---|"]
