"""The monopile in waves against OpenFAST's figures, which come with the package; the deck comes with rosco."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("windIO")

from comparisons import offshore, offshore_wind
from comparisons.floating import full_series
from comparisons.known import KNOWN
from meltemi.control.constant import ConstantController
from meltemi.postprocess.fatigue import damage_equivalent_load
from meltemi.simulation.rotors import build
from meltemi.simulation.simulate import simulate
from meltemi.simulation.start import Start
from meltemi.verification.table import CheckVerdict
from meltemi.wind.fields import SteadyWind

pytestmark = pytest.mark.rosco


def test_frequencies_in_water_and_air() -> None:
    rows = offshore.frequencies().judged(KNOWN).rows
    assert [row for row in rows if row.verdict is CheckVerdict.FAIL] == []
    given = [row for row in rows if "given" in row.case]
    assert len(given) == 6 and all(abs(row.deviation) < 0.15 for row in given)


def test_loads_in_waves() -> None:
    rows = offshore.waves().judged(KNOWN).rows
    assert [f"{row.what}, {row.case}: {row.deviation}" for row in rows if row.verdict is CheckVerdict.FAIL] == []
    force = [row for row in rows if row.what.startswith("Hydro") and row.measure == "%"]
    assert force and all(abs(row.deviation) < 0.15 for row in force)


def test_in_wind_under_rosco() -> None:
    rows = offshore_wind.steady().judged(KNOWN).rows
    assert [f"{row.what}, {row.case}: {row.deviation}" for row in rows if row.verdict is CheckVerdict.FAIL] == []
    means = [row for row in rows if row.what.endswith("mean") and row.case != "M4_18"]
    assert means and all(abs(row.deviation) <= 1.0 for row in means)


@pytest.mark.reference
def test_in_turbulence_and_sea(reference: Path) -> None:
    """Under ROSCO, in waves along the wind and from 60 degrees."""
    rows = offshore_wind.turbulent(reference / "openfast_offshore").judged(KNOWN).rows
    assert [f"{row.what}, {row.case}: {row.deviation}" for row in rows if row.verdict is CheckVerdict.FAIL] == []
    assert sum(row.verdict is CheckVerdict.PASS for row in rows) > 100


@pytest.mark.long
def test_pitching_moment_of_rotary_inertia() -> None:
    """Of the mean of RootMzc1 at 12 m/s, -90 kN m, 13 are Omega^2 integral (J_edge - J_flap) sin theta cos theta dr,
    which ElastoDyn's sections without rotary inertia lack."""
    full = offshore.monopile_model(air=True, time_step=0.0125, locked=("generator", "drivetrain", "yaw"))
    blade = full.turbine.blade.structure
    assert blade.flap_inertia is not None and blade.edge_inertia is not None
    none = np.zeros(len(blade.position))
    slender = build(
        full.turbine.replace(**{"blade.structure.flap_inertia": none, "blade.structure.edge_inertia": none}),
        full.options,
        full.environment,
    )
    speed, pitch = 7.56 * np.pi / 30.0, np.radians(6.55)
    run = {"duration": 24.0, "controller": ConstantController(), "start": Start(speed, pitch), "channels": ["RootMzc1"]}
    last = 24.0 - 2.0 * np.pi / speed
    means = [simulate(m, SteadyWind(speed=12.0), **run).between(last, 24.0)["RootMzc1"].mean() for m in (full, slender)]
    angle = pitch + blade.twist
    moment = (blade.edge_inertia - blade.flap_inertia) * np.sin(angle) * np.cos(angle)
    assert means[0] - means[1] == pytest.approx(speed**2 * np.trapezoid(moment, blade.position), rel=0.02)
    assert means[1] < -9e4


@pytest.mark.reference
@pytest.mark.parametrize(("case", "bound"), [("M5_12", 0.015), ("M5_18_dir60", 0.005)])
def test_axial_force_without_heave_of_the_pile(case: str, bound: float, reference: Path) -> None:
    """-4.7 and -3.5 % of the equivalent load at the tower base become less than 1.5 and 0.5 % without the inertia of
    all above, which OpenFAST's heave of the pile accelerates."""
    folder = reference / "openfast_offshore"
    force, heave = full_series(folder / f"series/{case}.npz", ["TwrBsFzt", "QD2_Hv"], 0.05).T
    ours = offshore_wind.wind_run(case, 0.05 * (len(force) - 1), folder, step=0.05)["TwrBsFzt"]
    late = slice(round(offshore_wind.BEGIN / 0.05), None)
    mass = -ours[late].mean() / 9.81
    without, found = (damage_equivalent_load(x[late], duration=120.0, slope=4.0) for x in (force + mass * heave, ours))
    assert found == pytest.approx(without, rel=bound)
