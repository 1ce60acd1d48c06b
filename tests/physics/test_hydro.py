"""Hulls, their panels and hydrostatics, and potential flow by Capytaine beside published coefficients."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from meltemi.app.cli import app
from meltemi.core.errors import InputError
from meltemi.floating.coefficients import read_coefficients, read_wamit
from meltemi.floating.members import Member, at_rest
from meltemi.hydro.hull import Box, Hull
from meltemi.hydro.panels import contour, panels_of
from meltemi.hydro.plots import plot_coefficients
from meltemi.hydro.potential import change_by_panels, coefficients_of, hydrostatics
from meltemi.hydro.wamit import wamit_texts

COLUMN = Member(start=[3.0, -2.0, -20.0], end=[3.0, -2.0, 15.0], diameter=12.5)
CONE = Member(start=[0.0, 0.0, -30.0], end=[0.0, 0.0, 10.0], diameter=18.0, end_diameter=10.0)


def volturnus() -> Hull:
    """Columns and pontoons of the VolturnUS-S: Allen et al. (2020), NREL/TP-5000-76773, table 1."""
    ends = [51.75 * np.array([np.cos(a), np.sin(a), 0.0]) for a in np.radians([180.0, 60.0, 300.0])]
    columns = [([0.0, 0.0, 0.0], 10.0), *((end, 12.5) for end in ends)]
    members = [
        Member(start=np.array(x) - [0, 0, 20.0], end=np.array(x) + np.array([0, 0, 15.0]), diameter=d)
        for x, d in columns
    ]
    boxes = [Box(start=[0.0, 0.0, -16.5], end=end - [0, 0, 16.5], width=12.5, height=7.0) for end in ends]
    return Hull(depth=200.0, members=members, boxes=boxes)


def test_a_box_has_its_volume_and_waterplane() -> None:
    """Of a box turned by 29 deg, of which panels cut a little of the edges."""
    box = Box(start=[-10.0, -3.0, -1.0], end=[12.0, 9.0, -1.0], width=6.0, height=8.0)
    hull, length = Hull(depth=50.0, boxes=[box]), float(np.hypot(22.0, 12.0))
    volume, centre, C = hydrostatics(hull, 2.0)
    assert volume == pytest.approx(5.0 * 6.0 * length, rel=2e-3)
    assert centre == pytest.approx([1.0, 3.0, -2.5], abs=0.01)
    assert C[2, 2] == pytest.approx(6.0 * length, rel=2e-3)


@pytest.mark.parametrize("member", [COLUMN, CONE], ids=["column", "cone"])
def test_hydrostatics_are_those_of_members(member: Member) -> None:
    """By the panels' integrals and by closed forms (W-17)."""
    hull = Hull(depth=100.0, members=[member])
    volume, centre, C = hydrostatics(hull, 2.0)
    V, b, known = at_rest([member])
    assert volume == pytest.approx(V, rel=2e-4) and centre == pytest.approx(b, abs=0.01)
    assert np.abs(C - known).max() < 2e-3 * np.abs(known).max()
    assert C[2, 2] == pytest.approx(known[2, 2], rel=1e-3)


def test_panels_converge_and_displace_as_much_as_the_hull() -> None:
    """The volume of a mesh inside a column is of second order in the size of the panels."""
    hull, V = Hull(depth=100.0, members=[COLUMN]), 20.0 * 0.25 * np.pi * 12.5**2
    errors = [1.0 - contour(hull.distance, *hull.bounds(), size).moments()[0] / V for size in (2.0, 1.0, 0.5)]
    assert np.log2(errors[0] / errors[2]) / 2.0 == pytest.approx(2.0, abs=0.15)
    panels = panels_of(hull, 2.0)
    assert panels.moments()[0] == pytest.approx(V, rel=1e-4)
    top = panels.vertices[panels.vertices[:, 2] == 0.0]
    assert len(top) > 12 and np.hypot(*(top[:, :2] - [3.0, -2.0]).T) == pytest.approx(6.3, abs=0.1)
    assert panels.vertices[:, 2].max() == 0.0


@pytest.mark.long
def test_members_that_overlap_are_one_body() -> None:
    """Published: 20206 m^3 of water displaced; the waterplane of circles, 446.7 m^2."""
    hull = volturnus()
    volume, centre, C = hydrostatics(hull, 2.5)
    assert volume == pytest.approx(20206.35, rel=5e-4) and np.abs(centre[:2]).max() < 0.01
    assert C[2, 2] == pytest.approx(0.25 * np.pi * (100.0 + 3.0 * 12.5**2), rel=1e-3)
    known = read_coefficients("iea15mw-volturnus").hydrostatic
    # the published panels lie within the circles: columns of their waterplane have their stiffness, to 0.1 % for 1.6 %
    share = known[2, 2] / C[2, 2]
    assert share == pytest.approx(28.0 / (2.0 * np.pi) * np.sin(2.0 * np.pi / 28.0), rel=1e-3)
    within = [each.replace(diameter=each.diameter * np.sqrt(share)) for each in hull.members]
    inner = hydrostatics(hull.replace(members=within), 2.5)[2]
    for k in (2, 3, 4):
        assert C[k, k] == pytest.approx(known[k, k], rel=0.02)
        assert inner[k, k] == pytest.approx(known[k, k], rel=1.5e-3)
    edges = np.sort(panels_of(hull, 3.0).faces, axis=1)
    assert len(np.unique(edges, axis=0)) == len(edges)


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"depth": 100.0}, "must reach below still water"),
        ({"depth": 19.0, "members": [COLUMN]}, "touches the sea bed at -19 m"),
        (
            {"depth": 99.0, "boxes": [{"start": [0, 0, -9], "end": [0, 0, -3], "width": 1, "height": 1}]},
            "must not be upright",
        ),
    ],
)
def test_hulls_that_are_refused(values: dict[str, object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        Hull(**values)  # type: ignore[arg-type]


def test_wamit_files_are_read_as_written(tmp_path: Path) -> None:
    c = read_coefficients("iea15mw-volturnus")
    for end, text in wamit_texts(c).items():
        (tmp_path / f"x{end}").write_text(text)
    found = read_wamit(tmp_path / "x")
    assert found.added_mass == pytest.approx(c.added_mass, rel=1e-6, abs=1e-3)
    assert found.excitation == pytest.approx(c.excitation, rel=1e-6, abs=1e-6)


def test_the_figure_has_units_and_phases() -> None:
    """In long waves that travel along x, surge leads the crest by 90 deg (force down the slope), heave goes with it."""
    axes: Any = np.reshape(plot_coefficients("volturnus", read_coefficients("iea15mw-volturnus")).axes, (3, 4))
    assert [ax.get_ylabel() for ax in axes[0]] == ["[m$^3$]", "[m$^3$/s]", "[m$^2$]", "[deg]"]
    assert [ax.get_ylabel() for ax in axes[2]] == ["[m$^5$]", "[m$^5$/s]", "[m$^3$]", "[deg]"]
    for row, phase in ((0, 90.0), (1, 0.0)):
        T, found = axes[row, 3].lines[0].get_data()
        assert found[(T > 24.0) & (T < 35.0)] == pytest.approx(phase, abs=5.0)
    assert "rho" in axes[0, 0].get_title(loc="left") and "rho g" in axes[0, 2].get_title(loc="left")


def test_without_capytaine_one_sentence_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "hull.yaml").write_text("depth: 100\nmembers: [{start: [0, 0, -20], end: [0, 0, 9], diameter: 9}]\n")
    monkeypatch.setattr("meltemi.core.extras.installed", lambda _: False)
    result = CliRunner().invoke(app, ["hydro", str(tmp_path / "hull.yaml"), "--out", str(tmp_path / "out")])
    assert result.exit_code != 0 and not (tmp_path / "out").exists()
    assert "capytaine" in f"{result.output}{result.exception}"


@pytest.mark.long
def test_a_command_writes_what_a_platform_reads(tmp_path: Path) -> None:
    pytest.importorskip("capytaine")
    (tmp_path / "spar.yaml").write_text("depth: 100\nmembers: [{start: [0, 0, -30], end: [0, 0, 9], diameter: 12}]\n")
    arguments = ["hydro", str(tmp_path / "spar.yaml"), "--panel", "3", "--frequencies", "12", "--heading-step", "45"]
    result = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert "volume: 3392" in result.output and "With panels 1.4 times as large" in result.output
    assert (tmp_path / "spar.png").is_file()
    c = read_coefficients(str(tmp_path / "spar"))
    assert len(c.frequency) == 12 and len(c.heading) == 9
    # damping from the energy of the waves that excite (Haskind): of a body of revolution, deep water
    w, X = c.frequency, c.excitation
    B = w**3 / 9.80665 * np.abs(X[:, 4, 2]) ** 2 / 2.0
    some = (w > 0.6) & (w < 1.1)
    assert c.damping[some, 2, 2] == pytest.approx(B[some], rel=0.05)


@pytest.mark.long
def test_the_volturnus_beside_its_published_coefficients() -> None:
    """Periods of 15 to 8 s, panels of 2.2 m."""
    pytest.importorskip("capytaine")
    hull, known = volturnus(), read_coefficients("iea15mw-volturnus")
    at = [int(np.argmin(np.abs(known.frequency - 2.0 * np.pi / T))) for T in (15.0, 10.0, 8.0)]
    along = int(np.argmin(np.abs(known.heading)))
    c = coefficients_of(hull, panels_of(hull, 2.2), known.frequency[at], np.zeros(1), known.hydrostatic)
    modes = [0, 2, 4]
    assert c.added_mass[:, modes, modes] == pytest.approx(known.added_mass[at][:, modes, modes], rel=0.05)
    largest = np.abs(known.excitation[:, along, modes]).max(axis=0)
    error = np.abs(c.excitation[:, 0, modes] - known.excitation[at][:, along][:, modes]) / largest
    assert error.max() < 0.025
    mass, force = change_by_panels(hull, c, 2.2)
    assert 0.001 < mass < 0.1 and 0.001 < force < 0.1
