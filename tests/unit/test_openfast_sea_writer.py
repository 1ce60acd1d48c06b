"""Decks of turbines at sea for OpenFAST: what is written is read back, and what it does not have is refused."""

from __future__ import annotations

import re
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meltemi import InputError, ModelOptions, Turbine, UnsupportedError, load_turbine
from meltemi.exchange.openfast import Deck, read_deck
from meltemi.exchange.openfast.members import read_members, with_ballast
from meltemi.exchange.openfast.text import read_input
from meltemi.exchange.openfast.values import Values
from meltemi.exchange.openfast_writer.writer import ExportedDeck
from meltemi.exchange.report import Notes
from meltemi.floating.coefficients import read_coefficients
from meltemi.frames.definition import Frame
from meltemi.io import write_openfast
from meltemi.sea.conditions import Sea, StillWater
from meltemi.sea.current import Current
from meltemi.sea.irregular import IrregularSea
from meltemi.sea.kinds import sea_of
from meltemi.sea.regular import RegularSea
from meltemi.sea.spreading import Spreading
from meltemi.sea.support import Growth
from meltemi.turbine.definition import Foundation
from meltemi.turbine.library import write_turbine

SIMPLE = ModelOptions(stall="static", inflow="quasi_steady")
FLOATER, PILE = "nrel5mw-spar", "nrel5mw-monopile"


def written(turbine: Turbine, folder: Path, sea: Sea | None = None) -> ExportedDeck:
    return write_openfast(turbine, folder, options=SIMPLE, time_step=0.01, duration=60.0, sea=sea)


def again(turbine: Turbine, folder: Path, sea: Sea | None = None) -> Deck:
    return read_deck(written(turbine, folder, sea).main, control_of=turbine)


def load(name: str) -> Any:
    if name.startswith("iea"):
        pytest.importorskip("windIO")
    return load_turbine(name)


@pytest.mark.parametrize(
    "name", [FLOATER, *(pytest.param(n, marks=pytest.mark.long) for n in ("iea15mw-volturnus", "iea22mw-semi"))]
)
def test_a_platform_comes_back(name: str, tmp_path: Path) -> None:
    turbine = load(name).replace(**{"platform.excitation": "displaced" if name == FLOATER else "at_rest"})
    deck = again(turbine, tmp_path)
    old, new = turbine.platform, deck.turbine.platform
    assert new is not None
    assert (new.drift, new.excitation) == (old.drift, old.excitation)
    for field in "depth mass volume buoyancy_centre water_density".split():
        assert getattr(new, field) == pytest.approx(getattr(old, field), rel=1e-9), field
    for field in "centre inertia linear_damping quadratic_damping stiffness".split():
        value = getattr(old, field)
        found = getattr(new, field)
        assert (value is None and found is None) or found == pytest.approx(value, rel=1e-9), field
    for a, b in zip(old.lines, new.lines, strict=True):
        same = {k: x for k, x in a.content().items() if k != "strength"}
        assert all(np.allclose(x, b.content()[k], rtol=1e-9) for k, x in same.items())
    wet = [m for m in old.members if m.drag or m.plate_drag]
    assert [m.content() for m in wet] == [m.content() for m in new.members]
    for field, value in vars(read_coefficients(old.coefficients)).items():
        found = getattr(read_coefficients(new.coefficients), field)
        assert found == pytest.approx(value, rel=1e-8, abs=1e-9 * max(np.abs(value).max(initial=0.0), 1.0)), field


@pytest.mark.parametrize(
    "name", [PILE, *(pytest.param(n, marks=pytest.mark.slow) for n in ("iea15mw-monopile", "iea22mw-monopile"))]
)
def test_a_pile_comes_back(name: str, tmp_path: Path) -> None:
    turbine = load(name)
    old, new = turbine.support, again(turbine, tmp_path).turbine.support
    assert new is not None
    for field in "depth elastic_modulus shear_modulus density flooded water_density".split():
        assert getattr(new, field) == pytest.approx(getattr(old, field), rel=1e-9), field
    assert new.damping == pytest.approx(old.damping, rel=0.005)  # of its mode shapes by polynomials
    assert new.hydrodynamics.content() == old.hydrodynamics.content()
    assert [(m.height, m.mass, m.inertia) for m in new.masses] == [(m.height, m.mass, m.inertia) for m in old.masses]
    z = np.linspace(old.position[0], old.position[-1], 301)[1:-1] + 0.01
    for field in ("diameter", "thickness"):
        was, found = (np.interp(z, each.position, getattr(each, field)) for each in (old, new))
        assert found == pytest.approx(was, rel=1e-6), field


def test_rayleigh_damping_is_that_of_the_first_mode(tmp_path: Path) -> None:
    """Factors of mass and stiffness: a / (2 w) + b w / 2 at the first natural frequency w; only with GuyanDampMod 1."""
    turbine = load(PILE)
    main = written(turbine, tmp_path).main
    file = main.with_name("SubDyn.dat")
    text = file.read_text()
    (line,) = [x for x in text.splitlines() if "RayleighDamp" in x]
    of_stiffness = float(line.split()[1])
    first = 2.0 * turbine.support.damping / of_stiffness

    def damping(row: str, kind: int = 1) -> float:
        changed = text.replace(line, row).replace("1   GuyanDampMod", f"{kind}   GuyanDampMod")
        assert kind == 1 or changed != text.replace(line, row)
        file.write_text(changed)
        support = read_deck(main, control_of=turbine).turbine.support
        assert support is not None
        return float(support.damping)

    assert damping(f"0.01  {of_stiffness}  RayleighDamp") == pytest.approx(0.01 + 0.005 / first, rel=0.005)
    assert damping(f"0.01  {of_stiffness}  RayleighDamp", kind=0) == 0.0
    with pytest.raises(InputError, match=r"SubDyn.dat: RayleighDamp: expected factors of mass and stiffness"):
        damping("0.01  RayleighDamp")


def test_a_pile_that_is_not_upright_is_a_frame(tmp_path: Path) -> None:
    turbine = load(PILE)
    main = written(turbine, tmp_path).main
    sub, hydro = (main.with_name(f"{name}.dat") for name in ("SubDyn", "HydroDyn"))
    good = sub.read_text()

    def frame(old: str, new: str) -> Frame:
        assert old in good
        sub.write_text(good.replace(old, new, 1))
        assert read_deck(main, control_of=turbine, fixed_base=True).turbine.substructures == ()
        (below,) = read_deck(main, control_of=turbine).turbine.substructures
        sub.write_text(good)
        assert isinstance(below, Frame)
        return below

    def row(text: str, column: str, n: int) -> str:
        lines = text.splitlines()
        return lines[next(i for i, line in enumerate(lines) if line.split()[:1] == [column]) + 2 + n]

    joint, member = row(good, "JointID", 2), row(good, "MemberID", 0)
    words = joint.split()
    moved = " ".join([words[0], "2.0", *words[2:]])
    assert frame(joint, moved).joints["J3"][0] == 2.0
    count = next(line for line in good.splitlines() if "NMembers" in line)
    n = int(count.split()[0])
    second = " ".join([str(n + 1), *member.split()[1:]])
    braced = good.replace(count, count.replace(str(n), str(n + 1), 1), 1).replace(member, f"{member}\n{second}", 1)
    assert len(frame(good, braced).members) == n + 1
    text = hydro.read_text()
    joint = row(text, "JointID", 1)
    words = joint.split()
    hydro.write_text(text.replace(joint, " ".join([words[0], "2.0", *words[2:]]), 1))
    says = (
        "Jointxi, Jointyi: joints that are not above each other; only upright monopiles are modelled; fixed_base=True"
    )
    with pytest.raises(UnsupportedError, match=re.escape(f"{hydro}: {says}")):
        read_deck(main, control_of=turbine)
    hydro.write_text(text)
    sub.write_text(good.replace("NPropSetsCyl ", "NPropSets ", 1))
    assert read_deck(main, control_of=turbine).turbine.support is not None


def test_coefficients_growth_and_springs_of_a_pile(tmp_path: Path) -> None:
    turbine = load(PILE)
    assert turbine.support is not None
    drag = [0.7, 0.8, 0.9, 1.0]
    grown = (Growth(bottom=-10.0, top=-2.0, thickness=0.1, density=1100.0),)
    water = turbine.support.hydrodynamics.replace(drag=drag)
    pile = turbine.support.replace(hydrodynamics=water, growth=grown, flooded=None)
    K = np.diag([1e9, 1e9, 2e9, 5e11, 5e11, 3e11])
    K[0, 4] = K[4, 0] = -1e10
    springs = Foundation(stiffness=K, mass=np.diag([1e4] * 3 + [2e5] * 3))
    found = again(turbine.replace(support=pile, foundation=springs), tmp_path).turbine
    assert found.support is not None and found.foundation is not None
    assert found.support.flooded is None
    heights = np.interp(found.support.position, pile.position, drag)
    assert found.support.hydrodynamics.drag == pytest.approx(heights, rel=1e-6)
    (layer,) = found.support.growth
    assert (layer.thickness, layer.density) == (0.1, 1100.0) and layer.top == pytest.approx(-2.0, abs=2e-3)
    assert found.foundation.matrix("stiffness") == pytest.approx(K)
    assert found.foundation.matrix("mass") == pytest.approx(springs.matrix("mass"))


@pytest.mark.parametrize(
    "sea",
    [
        IrregularSea(height=2.0, period=8.0, repeat=300.0, direction=0.3, spreading=Spreading(), stretching="vertical"),
        RegularSea(height=2.0, period=9.0, phase=1.0, direction=-0.4),
        IrregularSea(height=1.0, period=7.0, repeat=200.0, level=0.5, current=Current(uniform=0.4, sub_surface=0.2)),
    ],
    ids=["spread", "regular", "current"],
)
def test_every_wave_comes_back(sea: Sea, tmp_path: Path) -> None:
    turbine = load(PILE)
    deck = again(turbine, tmp_path, sea)
    assert deck.sea is not None
    found = sea_of(deck.sea, "deck")
    assert (found.stretching, found.level) == (sea.stretching, sea.level)
    old, new = (each.components(20.0, 60.0) for each in (sea, found))
    for field in ("frequency", "amplitude", "direction"):
        assert getattr(new, field) == pytest.approx(getattr(old, field), abs=1e-9), field
    assert new.period == pytest.approx(old.period)
    if sea.current is not None and found.current is not None:
        assert found.current.content() == pytest.approx(sea.current.content())


@pytest.mark.parametrize(
    ("name", "change", "sea", "says"),
    [
        ("nrel5mw", {}, StillWater(), "stands on land"),
        (FLOATER, {}, StillWater(level=1.0), "sea.level"),
        (PILE, {}, StillWater(current=Current(height=[-9.0, 0.0], speed=[0.1, 0.2])), "no table of the current"),
        (PILE, {"support.soil": {"kind": "springs"}}, None, "support.soil"),
        (FLOATER, {"platform.coefficients": ""}, None, "with potential flow only"),
    ],
)
def test_what_openfast_lacks(name: str, change: dict[str, Any], sea: Sea | None, says: str, tmp_path: Path) -> None:
    turbine = load(name)
    if "support.soil" in change:
        sand = {"kind": "sand", "top": 0.0, "friction_angle": 0.6, "weight": 9e3}
        pile = turbine.support.replace(position=[-40.0, -10.0, 0.0, 10.0], soil={"layers": [sand]})
        turbine = turbine.replace(support=pile)
    if "platform.coefficients" in change:
        members = [
            m.replace(pressure=1.0, added_mass=1.0, plate_pressure=float(i == 0))
            for i, m in enumerate(turbine.platform.members)
        ]
        turbine = turbine.replace(platform=turbine.platform.replace(coefficients="", members=members))
    with pytest.raises((InputError, UnsupportedError), match=says):
        written(turbine, tmp_path, sea)


@pytest.mark.slow
@pytest.mark.parametrize("module", ["SeaState", "HydroDyn"])
def test_order_of_the_keywords(module: str, tmp_path: Path) -> None:
    """OpenFAST reads by position."""
    try:
        decks = Path(
            str(distribution("rosco").locate_file("Examples/Test_Cases/IEA-15-240-RWT/IEA-15-240-RWT-UMaineSemi"))
        )
    except PackageNotFoundError:
        pytest.skip("the package rosco, which has the deck, is not installed")
    written(load(FLOATER), tmp_path)
    theirs = read_input(next(decks.glob(f"*_{module}.dat")), module)
    ours = read_input(tmp_path / f"{module}.dat", module)
    theirs_order, ours_order = (
        [k for k, _ in sorted(((k, e[0].line) for k, e in file.entries.items()), key=lambda x: x[1])]
        for file in (theirs, ours)
    )
    both = set(theirs_order) & set(ours_order)
    assert [k for k in ours_order if k in both] == [k for k in theirs_order if k in both]
    assert len(both) >= 0.9 * len(ours_order)


HYDRODYN = """title
a title
0 PotMod
2 NAxCoef
AxCoefID AxCd AxCa AxCp
(-) (-) (-) (-)
1 0.0 0.0 0.0
2 9.6 1.0 1.0
3 NJoints
JointID Jointxi Jointyi Jointzi JointAxID JointOvrlp
(-) (m) (m) (m) (-) (-)
1 0.0 0.0 -20.0 2 0
2 0.0 0.0 -14.0 2 0
3 0.0 0.0 10.0 1 0
2 NPropSetsCyl
PropSetID PropD PropThck
(-) (m) (m)
1 24.0 0.06
2 12.0 0.06
---------- SIMPLE HYDRODYNAMIC COEFFICIENTS ----------
SimplCd SimplCdMG SimplCa SimplCaMG SimplCp SimplCpMG
(-) (-) (-) (-) (-) (-)
0.6 0.7 0.9 0.8 1.0 1.1
1 NCoefMembersCyl
MemberID_HydC MemberCd1 MemberCd2 MemberCdMG1 MemberCdMG2 MemberCa1 MemberCa2 MemberCaMG1 MemberCaMG2 MemberCp1
(-) (-) (-) (-) (-) (-) (-) (-) (-) (-) (-)
7 0.5 0.7 0.8 0.8 0.2 0.4 0.9 0.9 1.0 1.0
2 NMembers
MemberID MJointID1 MJointID2 MPropSetID1 MPropSetID2 MDivSize MCoefMod PropPot
(-) (-) (-) (-) (-) (m) (-) (-)
7 1 2 1 1 1.0 3 FALSE
8 2 3 2 2 1.0 1 FALSE
1 NFillGroups
FillNumM FillMList FillFSLoc FillDens
(-) (-) (m) (kg/m^3)
1 7 -15.0 1025.0
"""


def hydrodyn(folder: Path, text: str = HYDRODYN) -> tuple[Any, Values]:
    (folder / "hydro.dat").write_text(text)
    values = Values(Notes())
    return values.read(read_input(folder / "hydro.dat", "HydroDyn")), values


def test_a_base_column_under_a_thinner_one(tmp_path: Path) -> None:
    """The plate has the whole area below, and the ring above; the base has both ends in the water: two halves."""
    file, values = hydrodyn(tmp_path)
    low, high, column = read_members(file, values)
    assert (low["drag"], low["added_mass"], column["drag"], column["added_mass"]) == pytest.approx((0.6, 0.3, 0.6, 0.9))
    ring = 1.0 - (12.0 / 24.0) ** 2
    assert (low["plate_drag"], high["plate_drag"]) == pytest.approx((4.8, 4.8 * ring))
    assert high["plate_added_mass"] == pytest.approx(1.0 - 0.5**3)
    assert (low["start"][2], low["end"][2], high["start"][2], high["end"][2]) == (-20.0, -17.0, -14.0, -17.0)
    assert "plate_drag" not in column
    assert not [note for note in values.notes if note.kind == "warning"]
    within = HYDRODYN.replace("FALSE", "TRUE")
    low, _, column = read_members(*hydrodyn(tmp_path, within))
    assert (low["added_mass"], low["plate_drag"], column["pressure"]) == (0.0, 4.8, 0.0)


def test_ballast_of_a_filled_member(tmp_path: Path) -> None:
    """A cylinder of water of 5 m in the base."""
    body = [1e6, 0.0, 0.0, -10.0, 1e9, 1e9, 1e9]
    mass, *centre_inertia = with_ballast(body, *hydrodyn(tmp_path))
    r, h = 12.0 - 0.06, 5.0
    water = 1025.0 * np.pi * r**2 * h
    z = (1e6 * -10.0 + water * -17.5) / (1e6 + water)
    assert mass == pytest.approx(1e6 + water, rel=5e-3)
    assert centre_inertia[2] == pytest.approx(z, rel=1e-3)
    across = 1e9 + 1e6 * (z + 10.0) ** 2 + water * ((z + 17.5) ** 2 + r**2 / 4.0 + h**2 / 12.0)
    assert centre_inertia[3] == pytest.approx(across, rel=2e-3)
    assert centre_inertia[5] == pytest.approx(1e9 + 0.5 * water * r**2, rel=5e-3)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("7 1 2 1 1", "7 1 9 1 1", "not defined"),
        ("7 0.5 0.7", "6 0.5 0.7", "no line of coefficients"),
        ("1 7 -15.0", "2 7 -15.0", "FillNumM"),
    ],
)
def test_members_that_do_not_fit(old: str, new: str, says: str, tmp_path: Path) -> None:
    file, values = hydrodyn(tmp_path, HYDRODYN.replace(old, new))
    with pytest.raises(InputError, match=says):
        assert read_members(file, values) and with_ballast([1.0] * 7, file, values)


def test_coefficients_beside_the_turbine(tmp_path: Path) -> None:
    """A folder with turbine and coefficients can be moved."""
    turbine = load(FLOATER)
    main = written(turbine, tmp_path / "deck").main
    deck = read_deck(main, control_of=turbine).turbine
    assert deck.platform is not None
    moved = deck.replace(platform=deck.platform.replace(coefficients="HydroData/platform"))
    write_turbine(moved, tmp_path / "deck" / "turbine.yaml")
    (tmp_path / "deck").rename(tmp_path / "other")
    found = load_turbine(tmp_path / "other" / "turbine.yaml")
    assert isinstance(found, Turbine) and found.platform is not None
    assert found.platform.coefficients == str(tmp_path / "other" / "HydroData" / "platform")
