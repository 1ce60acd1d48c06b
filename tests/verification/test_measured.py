"""Measured loads of UAE Phase VI: the comparison, what explains its deviations, and the two-bladed simulation."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import SteadyWind, Turbine
from meltemi.verification import uae
from meltemi.verification.known import KNOWN
from meltemi.verification.table import CheckVerdict, reference_table
from meltemi.verification.verification import verification

Float = NDArray[np.float64]
RECORD = reference_table("uae_performance", wind="7")[0]
SPEED = float(RECORD["rotor_speed"]) * np.pi / 30.0
PAGE = Path(__file__).parents[2] / "docs/verification/measurements.csv"


def changed(turbine: Turbine, keep: NDArray[np.bool_], factor: Float, position: Float) -> Turbine:
    """The turbine with those stations at ``position`` [m] that are kept, lift and drag times ``factor``."""
    a = turbine.blade.aerodynamics
    station = np.minimum(np.searchsorted(a.position, position - 1e-9), len(a.position) - 1)
    airfoils = {}
    for x, j, f in zip(position[keep], station[keep], factor[keep], strict=True):
        airfoil = turbine.airfoils[a.airfoil[j]]
        airfoils[f"{x:.4f} m"] = airfoil.replace(lift=f * airfoil.lift, drag=f * airfoil.drag)
    x = position[keep]
    assert a.centre_y is not None
    return turbine.replace(
        **{
            "airfoils": airfoils,
            "hub.radius": turbine.hub.radius + x[0],
            "blade.aerodynamics": {
                "position": x - x[0],
                "airfoil": tuple(airfoils),
                **{name: np.interp(x, a.position, getattr(a, name)) for name in ("chord", "twist", "centre_y")},
            },
            "blade.structure.position": [0.0, x[-1] - x[0]],
        }
    )


def normal_deviation(ours: uae.SteadyLoads) -> dict[str, float]:
    """[%] of the normal coefficient at the measured sections at 7 m/s."""
    rows = reference_table("uae_spanwise", wind="7")
    at = {r["position"]: np.interp(float(r["position"]), ours.position, ours.normal) for r in rows}
    return {r["position"]: 100.0 * float(at[r["position"]] / float(r["normal"]) - 1.0) for r in rows}


def test_attached_flow() -> None:
    rows = uae.attached().judged(KNOWN).rows
    assert not [r for r in rows if r.verdict is CheckVerdict.FAIL]
    torque = [r for r in rows if r.what == "torque"]
    assert len(torque) == 2 and all(abs(r.deviation) < 5.0 for r in torque)
    inner = [r for r in rows if r.what == "normal coefficient" and r.verdict is CheckVerdict.PASS]
    assert [r.case for r in inner] == ["47 % of the radius", "63 % of the radius", "80 % of the radius"]


def test_stall_without_and_with_augmentation() -> None:
    """Beyond 10 m/s too little torque without, too much with it; Snel's model is the nearest."""
    by = {(r.what, r.case): r.deviation for r in uae.stalled().rows}
    for wind in ("13", "15", "20", "25"):
        none, snel, ch = (by[f"torque, {label}", f"{wind} m/s"] for label in uae.MODELS.values())
        assert none < -15.0 and 0.0 < snel < ch
        root = f"{wind} m/s, 30 % of the radius"
        deviations = [abs(by[f"normal coefficient, {label}", root]) for label in uae.MODELS.values()]
        assert deviations[1] < 12.0 < 20.0 < deviations[0]
    for wind in ("10", "13", "15", "20", "25"):  # within the codes of the blind comparison
        assert all(-70.0 < by[f"torque, {label}", f"{wind} m/s"] < 175.0 for label in uae.MODELS.values())


@pytest.mark.slow
def test_the_tip_deviates_by_its_loss() -> None:
    """Prandtl's tip loss leaves the section its coefficients; with Shen's factor on them the tip agrees."""
    turbine = uae.phase_vi()
    a, root, tip = turbine.blade.aerodynamics, turbine.hub.radius, turbine.rotor_radius
    plain = uae.at_record(uae.rigid_model(turbine), RECORD)
    assert normal_deviation(plain)["0.95"] > 15.0
    none = uae.at_record(uae.rigid_model(turbine, tip_loss=False), RECORD)
    assert normal_deviation(none)["0.95"] > 40.0
    position = np.unique(np.concatenate([a.position, np.linspace(2.0, a.position[-1], 60)]))
    radius, everywhere = root + position, np.ones(len(position), bool)
    g = np.exp(-0.125 * (2.0 * SPEED * tip / 7.0 - 21.0)) + 0.1
    ours = plain
    for _ in range(4):
        alpha = np.interp(radius, ours.position * tip, ours.alpha)
        phi = alpha + np.interp(position, a.position, a.twist) + uae.PITCH
        shen = 2.0 / np.pi * np.arccos(np.exp(-g * (tip - radius) / (radius * np.sin(phi))))
        ours = uae.at_record(uae.rigid_model(changed(turbine, everywhere, shen, position)), RECORD)
    assert abs(normal_deviation(ours)["0.95"]) < 6.0
    assert ours.torque == pytest.approx(plain.torque, rel=0.02)


def test_the_root_deviates_by_where_the_lift_begins() -> None:
    turbine = uae.phase_vi()
    position = turbine.blade.aerodynamics.position
    outer = position + turbine.hub.radius > uae.SECTION[0] - 1e-6
    late = uae.at_record(uae.rigid_model(changed(turbine, outer, np.ones(len(position)), position)), RECORD)
    early = uae.at_record(uae.rigid_model(turbine), RECORD)
    assert normal_deviation(late)["0.3"] < -5.0 < 5.0 < normal_deviation(early)["0.3"]


def test_where_the_torque_is_lost_and_gained() -> None:
    """The measured coefficients give the shaft's torque up to 15 m/s only; the models fail by the tangential one."""
    ours = uae.at_record(uae.rigid_model(uae.phase_vi()), RECORD)
    assert ours.torque_with(ours.normal, ours.tangential) == pytest.approx(ours.torque, rel=1e-4)
    by = {(r.what, r.case): r.deviation for r in uae.stalled().rows}
    for label in uae.MODELS.values():
        for wind, least, most in ((7, -3, 0), (10, 0, 5), (13, -8, 0), (15, -8, 0), (20, -35, -25), (25, -30, -20)):
            assert least < by[f"torque from measured coefficients, {label}", f"{wind} m/s"] < most
    for wind in (10, 13, 15):
        assert by["torque, Snel", f"{wind} m/s"] > 5.0
        assert abs(by["torque with measured tangential coefficients, Snel", f"{wind} m/s"]) < 8.0


@pytest.mark.slow
def test_nodes_are_enough() -> None:
    coarse, fine = (uae.at_record(uae.rigid_model(uae.phase_vi(), blade_nodes=n), RECORD) for n in (60, 120))
    assert coarse.torque == pytest.approx(fine.torque, rel=2e-3)
    assert coarse.thrust == pytest.approx(fine.thrust, rel=2e-3)


def test_simulation_of_two_blades_settles_at_the_steady_loads() -> None:
    """In time, with dynamic inflow and dynamic stall, from a start with another pitch."""
    model = uae.rigid_model(uae.phase_vi(), inflow="variable", stall="hansen", blade_nodes=20)
    steady = uae.at_record(uae.rigid_model(uae.phase_vi(), blade_nodes=20), RECORD)
    result = meltemi.simulate(
        model,
        SteadyWind(speed=7.0),
        duration=10.0,
        controller=meltemi.control.ConstantController(),
        start=meltemi.Start(rotor_speed=SPEED, pitch=uae.PITCH),
        channels=["rotor_aero_torque", "rotor_aero_thrust", "azimuth"],
    )
    result.raise_for_status()
    air = float(RECORD["density"]) / model.environment.density
    late = result.time > 5.0
    for name in ("torque", "thrust"):
        x = air * result[f"rotor_aero_{name}"][late]
        assert np.ptp(x) < 1e-3 * abs(x.mean())
        assert x.mean() == pytest.approx(getattr(steady, name), rel=2e-3)


def rows(path: Path) -> dict[tuple[str, ...], float]:
    """Our values of a table that was written."""
    with path.open(encoding="utf-8") as file:
        return {(r["table"], r["what"], r["case"]): float(r["ours"]) for r in csv.DictReader(file)}


@pytest.mark.slow
def test_only_measurements(tmp_path: Path) -> None:
    with pytest.raises(meltemi.InputError, match="excludes the other options"):
        verification(measured=True, quick=True)
    report = verification(measured=True)
    assert [table.name for table in report.tables] == ["uae attached", "uae stalled"]
    assert not report.failed
    written = {path.name for path in report.write(tmp_path)}
    assert written == {"measurements.csv", "measurements.md", "uae_torque.png", "uae_sections.png"}
    # the figures of the page are those of today
    page, today = (rows(file) for file in (PAGE, tmp_path / "measurements.csv"))
    assert page == pytest.approx(today, rel=1e-3, abs=1e-4)


@pytest.mark.reference
def test_carried_figures_are_those_of_the_sources(reference: Path) -> None:
    pairs = {
        "performance": ("uae_performance", {"torque": "shaft_torque_N_m", "density": "density_kg_m3"}),
        "spanwise_H": ("uae_spanwise", {"normal": "cn", "tangential": "ct", "moment": "cm"}),
        "blade": ("uae_blade", {"radius": "radius_m", "chord": "chord_m", "twist": "twist_deg"}),
    }
    for theirs, (ours, columns) in pairs.items():
        with (reference / f"uae_phase_vi/{theirs}.csv").open(encoding="utf-8") as file:
            source = list(csv.DictReader(file))
        carried = reference_table(ours)
        for name, column in columns.items():
            assert [float(r[name]) for r in carried] == [float(r[column]) for r in source]
    with (reference / "uae_phase_vi/s809_osu_clean.csv").open(encoding="utf-8") as file:
        source_rows = [list(r.values()) for r in csv.DictReader(file)]
    assert [list(r.values()) for r in reference_table("s809") if r["reynolds"] != "0.3"] == source_rows
