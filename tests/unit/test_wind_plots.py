"""Figures of winds: what they show, in which units, beside which target."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

from meltemi import InputError, SteadyWind, Turbine, TurbulentWind, WindBox, WindSeries
from meltemi.plots import plot_wind
from meltemi.reports.wind_plots import plot_coherence, plot_section, plot_spectra
from meltemi.wind import generate_field

NAMES = ["series", "spectra", "coherence", "section", "profile"]


@pytest.fixture(scope="module", params=["kaimal", "mann"])
def wind(request: pytest.FixtureRequest) -> TurbulentWind:
    return TurbulentWind(speed=12.0, intensity=0.14, spectrum=request.param, points=9, dt=0.4, veer=1e-3)


@pytest.fixture(scope="module")
def field(wind: TurbulentWind, turbine: Turbine) -> WindBox:
    return generate_field(wind, turbine, 60.0)


@pytest.fixture(scope="module")
def figures(wind: TurbulentWind, field: WindBox, turbine: Turbine) -> dict[str, Any]:
    return plot_wind(field, turbine, target=wind)


def legend(ax: Any) -> list[str]:
    return [text.get_text() for text in ax.get_legend().get_texts()]


def dashed(ax: Any) -> list[Any]:
    return [line for line in ax.lines if line.is_dashed() and len(line.get_xdata()) > 2]


@pytest.mark.long
def test_all_figures_are_there_and_can_be_drawn(figures: dict[str, Any], wind: TurbulentWind) -> None:
    assert list(figures) == NAMES
    for figure in figures.values():
        assert figure.get_suptitle().startswith(wind.label[:40])
        figure.canvas.draw()
    pyplot = sys.modules.get("matplotlib.pyplot")
    shown = [pyplot.figure(number) for number in pyplot.get_fignums()] if pyplot else []
    assert not any(figure in shown for figure in figures.values())


def test_every_panel_has_a_title_and_units(figures: dict[str, Any]) -> None:
    for figure in figures.values():
        for ax in figure.axes:
            assert "[" in ax.get_ylabel()
            if ax.get_label() != "<colorbar>":
                assert ax.get_title(loc="left")
        assert all("[" in ax.get_xlabel() for ax in figure.axes if ax.get_xlabel())
        assert any(ax.get_xlabel() for ax in figure.axes)


def test_the_series_is_that_of_the_hub(figures: dict[str, Any], field: WindBox) -> None:
    axes = figures["series"].axes
    row = round((90.0 - field.bottom) / field.dz)
    for c, ax in enumerate(axes):
        time, values = ax.lines[0].get_data()
        np.testing.assert_array_equal(values, field.velocity[:, row, 4, c])
        assert time[0] == pytest.approx(-0.5 * field.width / field.speed)
    assert "mean 12.00 m/s, standard deviation 1.68 m/s" in axes[0].get_title(loc="right")


def test_spectra_stand_beside_the_target(figures: dict[str, Any], field: WindBox) -> None:
    for ax in figures["spectra"].axes:
        assert legend(ax) == ["two thirds of samples", "hub", "mean over the grid", "target"]
        assert len(dashed(ax)) == 1
        assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
        assert "grid steps, 37.8 m" in ax.texts[0].get_text()
    assert "target" not in legend(plot_spectra(field).axes[0])


def test_coherence_stands_beside_the_target(figures: dict[str, Any], field: WindBox) -> None:
    axes = figures["coherence"].axes
    assert len(axes) == 6
    assert all(len(dashed(ax)) == 4 for ax in axes)
    assert [text.split()[-1] for text in legend(axes[2])] == ["m"] * 4 + ["target"]
    mine = plot_coherence(field, separations=[40.0]).axes
    assert legend(mine[2]) == ["37.8 m"]
    assert not dashed(mine[0])


def test_a_section_shows_the_rotor(figures: dict[str, Any], field: WindBox, turbine: Turbine) -> None:
    left, right, bar = figures["section"].axes
    circle, hub = left.lines
    assert np.ptp(circle.get_xdata()) == pytest.approx(turbine.rotor_diameter)
    assert hub.get_ydata()[0] == pytest.approx(turbine.hub_height)
    assert np.ptp(right.lines[0].get_ydata()) == pytest.approx(turbine.rotor_diameter)
    assert bar.get_ylabel() == "u [m/s]"
    assert left.xaxis_inverted()  # y to the left looking downwind
    again = plot_section(field, turbine, time=20.0).axes[0]
    plane = round((20.0 + 0.5 * field.width / field.speed) / field.dt)
    np.testing.assert_array_equal(np.ravel(again.collections[0].get_array()), field.velocity[plane, :, :, 0].ravel())
    with pytest.raises(InputError, match="500 s lies outside the field"):
        plot_section(field, turbine, time=500.0)


def test_profiles_lie_on_the_target(figures: dict[str, Any]) -> None:
    speed, direction, _ = figures["profile"].axes
    for ax in (speed, direction):
        wanted, found = sorted(ax.lines[:2], key=lambda line: not line.is_dashed())
        np.testing.assert_allclose(found.get_xdata(), wanted.get_xdata(), atol=1e-3)


def test_turbulence_is_made_and_is_its_own_target(turbine: Turbine) -> None:
    wind = TurbulentWind(speed=12.0, intensity=0.14, points=5, dt=1.0)
    figures = plot_wind(wind, turbine, duration=30.0)
    assert list(figures) == NAMES
    assert "target" in legend(figures["spectra"].axes[0])
    with pytest.raises(InputError, match="a turbulent wind requires a turbine"):
        plot_wind(wind)


@pytest.mark.slow
def test_a_field_without_turbulence_is_drawn() -> None:
    box = WindBox(np.full((8, 3, 3, 3), 5.0), dt=1.0, dy=1.0, dz=1.0, bottom=9.0, speed=5.0)
    for figure in plot_wind(box).values():
        figure.canvas.draw()


def test_a_series_is_drawn_in_units_for_people() -> None:
    time = np.linspace(0.0, 10.0, 11)
    wind = WindSeries(time=time, speed=10.0 + time, direction=0.1 * time, gust=1.0, exponent=0.2, source="a gust")
    figure = plot_wind(wind)["series"]
    speed, direction = figure.axes
    assert figure.get_suptitle() == "a gust"
    assert [ax.get_ylabel() for ax in figure.axes] == ["[m/s]", "[deg]"]
    assert speed.get_title(loc="left") == "speed, gust included"
    np.testing.assert_allclose(speed.lines[0].get_ydata(), 11.0 + time)
    np.testing.assert_allclose(direction.lines[0].get_ydata(), np.degrees(0.1 * time))
    assert direction.get_xlabel() == "time [s]"
    assert figure.get_supxlabel() == (
        "constant: vertical speed 0 m/s, exponent of the power law 0.2, linear vertical shear 0, "
        "linear horizontal shear 0"
    )
    wind = wind.replace(vertical_shear=0.1 * time, vertical=0.5)
    *_, shear = plot_wind(wind)["series"].axes
    assert len(shear.lines) == 3
    still = plot_wind(WindSeries(time=time, speed=10.0 + 0.0 * time))["series"]
    assert [ax.get_ylim() for ax in still.axes] == [(9.0, 11.0)]


def test_a_steady_wind_has_a_profile(turbine: Turbine) -> None:
    wind = SteadyWind(speed=10.0, shear_exponent=0.2, veer=1e-3, direction=0.1)
    speed, direction = plot_wind(wind, turbine)["profile"].axes
    u, z = speed.lines[0].get_data()
    np.testing.assert_allclose(u, 10.0 * (z / 90.0) ** 0.2, rtol=1e-3)
    np.testing.assert_allclose(direction.lines[0].get_xdata(), np.degrees(0.1 + 1e-3 * (z - turbine.hub_height)))
    rough = plot_wind(SteadyWind(speed=10.0, roughness=0.03, reference_height=50.0))["profile"].axes[0]
    u, z = rough.lines[0].get_data()
    np.testing.assert_allclose(u, np.maximum(10.0 * np.log(z / 0.03) / np.log(50.0 / 0.03), 0.0), rtol=1e-9)
