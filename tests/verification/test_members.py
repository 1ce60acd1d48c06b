"""The jacket of OC4 and the tripod of OC3 with the NREL 5 MW in waves and wind against OpenFAST 5.0.

Some figures of its runs (OpenFAST v5.0.0 with the decks of its r-test) are here; the series are beside
the project.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from meltemi import load_turbine
from meltemi.core.errors import InputError
from meltemi.frames.finite_elements import assemble
from meltemi.frames.reduction import tower_base
from meltemi.frames.water import pieces
from meltemi.sea.airy import wave_number
from meltemi.simulation.result import Result
from meltemi.verification import members
from meltemi.verification.known import KNOWN
from meltemi.verification.table import CheckVerdict
from meltemi.verification.verification import verification

TIME = members.STEP * np.arange(801.0)
START = {"TTDspFA": -0.018, "PtfmSurge": -0.0011, "PtfmPitch": -4.189e-5, "PtfmHeave": -0.0071}
"""[m], [rad] at the start of the runs of the jacket in waves."""
JACKET = {
    "HydroFxi": (780131.1, 1.19338),
    "HydroMyi": (14627456.0, -1.83527),
    "ReactMYss": (25290499.0, -2.02963),
    "-HydroFxi - IntfFXss": (784882.0, -1.95241),
}
"""Amplitude [N], [N m] and phase [rad] in a regular wave of 6 m and 10 s, 20 to 40 s after the start."""
JACKET_LEGS = {"pileA-groutA": 861076.0, "pileB-groutB": 833376.0, "A1-A2": 576751.0, "B1-B2": 556859.0}
"""[N] amplitude of the axial force, mean of two legs that are mirror images."""
TRIPOD = {"HydroFxi": (2217285.0, 1.41042), "HydroMyi": (42406113.0, -1.68709), "ReactMYss": (57509755.0, -1.76392)}
TRIPOD_LEGS = {"footA-ringA": 1226405.0, "footB-ringB": 580642.0, "footC-ringC": 580757.0}


def started(**start: float) -> members.Series:
    channels = ("TTDspFA", "TTDspSS", *(f"Ptfm{x}" for x in ("Surge", "Sway", "Heave", "Roll", "Pitch", "Yaw")))
    return {"Time": TIME} | {name: np.array([start.get(name, 0.0)]) for name in channels}


def harmonics(name: str, run: Result, channels: list[str]) -> dict[str, tuple[float, float]]:
    measured = {c: members.measures(members.CASES[name], TIME, None, run[c]) for c in channels}
    return {c: (m["amplitude"], m["phase"]) for c, m in measured.items()}


@pytest.mark.parametrize(
    ("name", "start", "figures", "legs", "band"),
    [("J3_H6T10", START, JACKET, JACKET_LEGS, 1.1), ("T3_H6T10", {}, TRIPOD, TRIPOD_LEGS, 0.9)],
)
def test_loads_in_a_regular_wave(name: str, start: dict[str, float], figures: dict[str, tuple[float, float]],
                                 legs: dict[str, float], band: float, tmp_path: Path) -> None:  # fmt: skip
    """Base shear and overturning within 1 % and 1 deg, axial forces of legs within 1.1 %."""
    axial = [f"member_{leg}_start_force_z" for leg in legs]
    run = members.run(name, tmp_path, started(**start), (*members.BASE, *axial))
    found = harmonics(name, run, [*members.BASE, *axial])
    # OpenFAST's reaction is that to the loads on its jacket, see below
    found["-HydroFxi - IntfFXss"] = found["ReactFXss"]
    for channel, (amplitude, angle) in figures.items():
        assert found[channel][0] == pytest.approx(amplitude, rel=0.009)
        assert np.degrees(found[channel][1] - angle) == pytest.approx(0.0, abs=0.5)
    for channel, amplitude in zip(axial, legs.values(), strict=True):
        assert found[channel][0] == pytest.approx(amplitude, rel=0.01 * band)


def test_frequencies_of_the_dry_jacket() -> None:
    rows = members.frequencies("J2_decay_dry")
    assert len(rows) == 2 and all(abs(row.deviation) < 0.3 for row in rows)


def test_the_wave_of_the_jacket_at_rest() -> None:
    """Inertia of 0.5 m pieces of a direct sum: 694.3 kN and 13.22 MN m without plates and drag; 3 m pieces have it."""
    frame = load_turbine("nrel5mw-jacket").frame
    assert frame is not None
    p = pieces(assemble(frame, tower_base(frame, load_turbine("nrel5mw-jacket").tower)))
    w = 0.2 * np.pi
    k, s = float(wave_number(np.array([w]), 50.0)[0]), p.place[:, 2] + 50.0
    wave = 3.0 * w**2 * np.exp(-1j * k * p.place[:, 0]) / np.sinh(50.0 * k)
    a = np.stack([1j * wave * np.cosh(k * s), 0.0 * wave, -wave * np.sinh(k * s)], axis=1)
    across = a - np.einsum("pi,pi->p", a, p.axis)[:, None] * p.axis
    force = np.where(p.high < 1e-6, p.inertial, 0.0)[:, None] * across
    assert abs(force[:, 0].sum()) == pytest.approx(694.3e3, rel=4e-3)
    moment = (p.place[:, 2] * force[:, 0] - p.place[:, 0] * force[:, 2]).sum()
    assert abs(moment) == pytest.approx(13.219e6, rel=6e-3)


def test_a_folder_without_runs_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="none of the runs series/J2_decay_dry, J3"):
        verification(frames=tmp_path)
    with pytest.raises(InputError, match="--members excludes the other options"):
        verification(frames=tmp_path, quick=True)


# with the series ----------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.reference
@pytest.mark.parametrize("name", [name for name in members.CASES if name != "J6_20"])
def test_all_bands(name: str, reference: Path) -> None:
    rows = members.compared(name, reference / "openfast_members").judged(KNOWN).rows
    assert [f"{row.what}: {row.deviation:.2f}" for row in rows if row.verdict is CheckVerdict.FAIL] == []
    assert sum(row.verdict is CheckVerdict.PASS for row in rows) >= 0.5 * len(rows)


@pytest.mark.rosco
@pytest.mark.reference
def test_all_bands_under_rosco(reference: Path) -> None:
    rows = members.compared("J6_20", reference / "openfast_members").judged(KNOWN).rows
    assert [f"{row.what}: {row.deviation:.2f}" for row in rows if row.verdict is CheckVerdict.FAIL] == []
    slow = [row for row in rows if "below" in row.what and row.verdict is CheckVerdict.PASS]
    assert len(slow) > 25


@pytest.mark.reference
def test_openfasts_reactions_are_not_in_equilibrium_on_a_jacket(reference: Path) -> None:
    """Water, tower and ground: on the tripod they add up to the frame's small inertia, on the jacket they do not.

    Across waves along the axis, where all loads on the jacket are 0.1 kN, the ground pushes with 14 kN and the legs'
    shears sum up to 22 kN; along it with 820 kN against 785 kN. Legs that are mirror images differ by 2.6 %.
    """

    def first(name: str, *channels: str) -> complex:
        x = members.series(reference / f"openfast_members/series/{name}.npz")
        m = members.measures(members.CASES[name], x["Time"], None, sum(x[c] for c in channels))
        return complex(m["amplitude"] * np.exp(1j * m["phase"]))

    assert abs(first("J3_H6T10", "HydroFyi", "IntfFYss")) < 0.2e3
    assert abs(first("J3_H6T10", "ReactFYss")) == pytest.approx(14.2e3, abs=0.1e3)
    assert abs(first("J3_H6T10", *(f"M{i}N1FKye" for i in (1, 2, 3, 4)))) == pytest.approx(22.0e3, abs=0.1e3)
    along = abs(first("J3_H6T10", "HydroFxi", "IntfFXss", "ReactFXss")) / abs(first("J3_H6T10", "HydroFxi"))
    assert along == pytest.approx(0.045, abs=0.002)
    left, right = (abs(first("J3_H6T10", f"M{i}N1FKze")) for i in (1, 4))
    assert right / left == pytest.approx(1.023, abs=0.002)
    rest = abs(first("T3_H6T10", "HydroFxi", "IntfFXss", "ReactFXss")) / abs(first("T3_H6T10", "HydroFxi"))
    assert rest < 1e-3


@pytest.mark.reference
def test_braces_of_the_tripod_end_in_the_air_in_hydrodyns_file(reference: Path, tmp_path: Path) -> None:
    """First harmonic of ReactFZss: 103 kN; with pressure on the ends of braces at still water 312 kN."""
    deck = (reference / "openfast_members/decks/T3_H6T10/HydroDyn.dat").read_text().splitlines()
    assert any(line.split()[:4] == ["47", "0.00000", "0.00000", "0.90000"] for line in deck)
    name = "T3_H6T10"
    run = members.run(name, tmp_path, started(), ("ReactFZss",))
    (found,) = harmonics(name, run, ["ReactFZss"]).values()
    frame = load_turbine("nrel5mw-tripod").frame
    assert frame is not None
    p = pieces(assemble(frame, np.array([0.0, 0.0, 10.0])))
    at_surface = (np.abs(p.place[:, 2]) < 1e-9) & (p.node >= 0)
    ends = np.abs((p.area[:, None] * p.axis)[at_surface, 2].sum())
    pressure = 1025.0 * 9.80665 * 3.0 * ends
    assert pressure == pytest.approx(366e3, rel=0.03)  # of three braces, in the phase of the elevation
    assert found[0] == pytest.approx(103e3, rel=0.16)
