"""A turbine on one page: its numbers, its panels, and what happens when a part cannot be had."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Turbine
from meltemi.reports.turbine_facts import mode_rows, turbine_facts
from meltemi.reports.turbine_overview import TurbineOverview, masses, principal_stiffness, turbine_overview
from meltemi.reports.turbine_plots import _short, plot_turbine, turbine_figures
from meltemi.structure.beam import transfer

pytestmark = pytest.mark.slow

IMPOSSIBLE = {"n_blades": 1}
"""What ``build`` refuses."""


@pytest.fixture(scope="module")
def seen(turbine: Turbine) -> TurbineOverview:
    return turbine_overview(turbine)


@pytest.fixture(scope="module")
def unmodelled(turbine: Turbine) -> TurbineOverview:
    return turbine_overview(turbine.replace(**IMPOSSIBLE))


def fact(found: TurbineOverview, group: str, what: str) -> str:
    return dict(dict(turbine_facts(found))[group])[what]


def axes_named(figure: Any, begin: str) -> Any:
    (ax,) = [ax for ax in figure.axes if ax.get_title(loc="left").startswith(begin)]
    return ax


def test_masses_are_those_of_the_report(turbine: Turbine) -> None:
    """NREL/TP-500-38060, tables 1-1, 2-2 and 6-2."""
    found = masses(turbine)
    assert found["blade"] == pytest.approx(17740.0, rel=1e-6)
    assert found["rotor"] == pytest.approx(110000.0, rel=1e-6)
    assert found["tower"] == pytest.approx(347460.0, rel=1e-5)


@pytest.mark.long
def test_rated_operation_is_that_of_the_report(seen: TurbineOverview) -> None:
    """12.1 rpm, 80 m/s at the tip, 5 MW from 11.4 m/s on; a largest power coefficient of 0.482 at 7.55 and 0 deg."""
    assert seen.problems == {}
    assert seen.rated is not None and seen.best is not None
    assert seen.rated.wind.speed == pytest.approx(11.4, abs=0.1)
    assert seen.rated["generator_power"] == pytest.approx(5e6, rel=1e-3)
    best, ratio, pitch = seen.best
    assert best == pytest.approx(0.482, abs=0.012) and ratio == pytest.approx(7.55, abs=0.3) and pitch == 0.0
    assert fact(seen, "Operation", "rotor speed") == "12.1 rpm"
    assert fact(seen, "Operation", "tip speed") == "79.83 m/s"
    assert fact(seen, "Drivetrain", "rated torque") == "43.53 kN m"


@pytest.mark.long
def test_the_curve_is_finer_around_rated(seen: TurbineOverview) -> None:
    assert seen.curve is not None
    speeds = np.array([p.wind.speed for p in seen.curve])
    steps = np.diff(speeds)
    assert np.all(steps > 0.0) and steps.max() == pytest.approx(1.0) and steps.min() == pytest.approx(1.0 / 32.0)
    assert 11.0 < speeds[np.argmin(steps)] < 12.0
    assert {float(u) for u in range(3, 26)} <= set(speeds.tolist())


def test_frequencies_are_those_of_their_modes(seen: TurbineOverview) -> None:
    """The report has 0.312 Hz for side-to-side, 0.324 Hz for fore-aft and 0.62 Hz for the drivetrain (table 9-1)."""
    found = {what: float(value.split()[0]) for what, value in dict(turbine_facts(seen))["Frequency at rest"]}
    assert found["tower side-side"] == pytest.approx(0.312, abs=0.004)
    assert found["tower fore-aft"] == pytest.approx(0.324, abs=0.012)
    assert found["drivetrain"] == pytest.approx(0.62, abs=0.01)
    assert found["blade flap"] < found["blade edge"] < found["blade torsion"]
    assert seen.modes is not None
    head, rows = mode_rows(seen.modes)
    assert len(rows) == len(seen.modes) and {len(row) for row in rows} == {len(head)}


def test_principal_stiffness_of_a_moved_and_turned_section(turbine: Turbine) -> None:
    """The section keeps its principal stiffness wherever its reference point lies."""
    s = turbine.blade.structure
    assert s.flap_stiffness is not None and s.edge_stiffness is not None and s.torsion_stiffness is not None
    n = len(s.position)
    K = np.zeros((n, 6, 6))
    for i, values in enumerate((4e8, 3e8, 5e9, s.edge_stiffness, s.flap_stiffness, s.torsion_stiffness)):
        K[:, i, i] = values
    T = transfer(np.array([0.3, -0.4, 0.0]))
    turned = np.kron(np.eye(2), [[math.cos(0.2), math.sin(0.2), 0], [-math.sin(0.2), math.cos(0.2), 0], [0, 0, 1]])
    matrix = turned @ (T.T @ K @ T) @ turned.T
    data = {"position": s.position, "twist": s.twist, "damping": s.damping, "stiffness_matrix": matrix}
    found = principal_stiffness(type(s)(**data, mass_matrix=np.repeat(np.eye(6)[None], n, axis=0)))
    assert found[2] is not None
    plainly = principal_stiffness(s)
    different = np.abs(s.edge_stiffness / s.flap_stiffness - 1.0) > 0.05  # of round sections either may be the other
    for got, wanted in zip(found, plainly, strict=True):
        assert got is not None and wanted is not None
        np.testing.assert_allclose(got[different], wanted[different], rtol=1e-9)


def test_every_panel_has_units_and_something_in_it(seen: TurbineOverview) -> None:
    figure = plot_turbine(seen)
    labelled = [ax for ax in figure.axes if ax.axison]
    assert len(labelled) == 19
    for ax in labelled:
        assert ax.get_title(loc="left")
        assert "[" in ax.get_xlabel() and "[" in ax.get_ylabel()
        assert ax.lines
    for name, part in turbine_figures(seen).items():
        assert part.axes, name


def test_panels_show_the_turbines_numbers(seen: TurbineOverview, turbine: Turbine) -> None:
    figure = plot_turbine(seen)
    twist = axes_named(figure, "twist").lines[0]
    np.testing.assert_allclose(twist.get_ydata(), np.degrees(turbine.blade.aerodynamics.twist))
    x, stiffness = axes_named(figure, "tower stiffness").lines[0].get_data()
    np.testing.assert_allclose(x, turbine.tower.fore_aft_stiffness / 1e9)
    np.testing.assert_allclose(stiffness, turbine.tower.position)
    leading, trailing = (line.get_ydata() for line in axes_named(figure, "planform").lines[:2])
    np.testing.assert_allclose(leading - trailing, turbine.blade.aerodynamics.chord)
    assert seen.curve is not None
    _, power = axes_named(figure, "electrical power").lines[0].get_data()
    np.testing.assert_allclose(power, [p["generator_power"] / 1e6 for p in seen.curve])


def test_two_prebent_blades_are_drawn(turbine: Turbine, seen: TurbineOverview) -> None:
    s = turbine.blade.structure
    bent = (-3.0 * (s.position / s.position[-1]) ** 2).tolist()
    other = turbine.replace(**{"n_blades": 2, "blade.structure.axis_x": bent})
    figure = plot_turbine(replace(seen, turbine=other))
    assert "prebend 3 m upwind" in " ".join(t.get_text() for t in axes_named(figure, "front").texts)
    line = axes_named(figure, "offsets").lines[0]
    np.testing.assert_allclose(line.get_ydata(), bent)
    blades = [len(axes_named(plot_turbine(each), "front").patches) for each in (seen, replace(seen, turbine=other))]
    assert blades[0] - blades[1] == 2  # one blade, seen from two sides


def test_parts_that_cannot_be_had_say_why(unmodelled: TurbineOverview) -> None:
    assert unmodelled.model is None and unmodelled.curve is None and unmodelled.blade is not None
    texts = [t.get_text().replace("\n", " ") for t in axes_named(plot_turbine(unmodelled), "electrical power").texts]
    assert any("2 and 3 are supported" in text for text in texts)
    assert "Frequency at rest" in dict(turbine_facts(unmodelled))  # of the blade


def test_winds_without_operation_are_left_out(turbine: Turbine) -> None:
    """Far below cut-in the wind does not turn the rotor: the rest of the curve stands."""
    found = turbine_overview(turbine.replace(cut_in=0.5, cut_out=6.0))
    assert found.curve is not None
    assert found.curve[0].wind.speed > 1.0 and found.curve[-1].wind.speed == 6.0
    assert "in winds of 1" in found.problems["some of the curve"]
    assert found.rated is None


def test_a_folder_that_is_not_there(turbine: Turbine, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such folder"):
        meltemi.analysis.inspect_turbine(turbine, tmp_path / "nowhere")


def test_long_names_are_shortened() -> None:
    """By what they share, if that is long; what is left of a name is never empty."""
    assert _short(["polar_of_IEA_01", "polar_of_IEA_02"]) == ["1", "2"]
    assert _short(["polar_of", "polar_of_2"]) == ["polar_of", "_2"]
    assert _short(["du21", "du25"]) == ["du21", "du25"]
    assert _short(["polar_of_IEA_01"]) == ["polar_of_IEA_01"]
