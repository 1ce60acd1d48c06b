"""Strength of plies and spar caps: closed forms of criteria, of a tube under bending, and of buckling."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi, prod, radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic_base import small_plan, synthetic_base

from meltemi import InputError, Result, load_turbine
from meltemi.loads.loadbase.campaign import write_campaign
from meltemi.loads.loadbase.coverage import read_results, shared_repetitions
from meltemi.loads.loadbase.plan import PlannedCase
from meltemi.postprocess.cycles import Cycles, rainflow_cycles
from meltemi.sections.layup import Layer, Layup, Material, Ply, Section, Shape, Web, WebLine
from meltemi.sections.thin_walled import thin_walled_section
from meltemi.simulation.channels import ChannelSet, catalogue
from meltemi.strength.criteria import (
    SnLine,
    bending_stiffness,
    critical_load,
    goodman_damage,
    strain_indices,
    stress_indices,
    tsai_wu_index,
)
from meltemi.strength.load_base import base_blade_strength
from meltemi.strength.plies import (
    ROOT,
    StationLoads,
    blade_factors,
    blade_loads,
    blade_strength,
    panel_strength,
    wall_forces,
    wrinkling,
)

STEEL: dict[str, Any] = {
    "density": 7850.0,
    "E1": 210e9,
    "E2": 210e9,
    "E3": 210e9,
    "nu12": 0.3,
    "nu13": 0.3,
    "nu23": 0.3,
    "G12": 210e9 / 2.6,
    "G13": 210e9 / 2.6,
    "G23": 210e9 / 2.6,
}
GLASS: dict[str, Any] = {
    "density": 1940.0,
    "E1": 44e9,
    "E2": 13e9,
    "E3": 13e9,
    "nu12": 0.28,
    "nu13": 0.28,
    "nu23": 0.4,
    "G12": 4.2e9,
    "G13": 4.2e9,
    "G23": 4.2e9,
    "Xt": 1000e6,
    "Xc": 700e6,
    "Yt": 50e6,
    "Yc": 150e6,
    "S12": 70e6,
    "fatigue_exponent": 10.0,
}
UD = Material(**GLASS)
SHEAR, NU = ("G12", "G13", "G23"), dict.fromkeys(("nu12", "nu13", "nu23"), 0.3)
NREL = load_turbine("nrel5mw")
KNOWN = catalogue(ChannelSet(blade_stations=2))


def plane(s11: float, s22: float, s12: float) -> np.ndarray:
    return np.array([s11, s22, 0.0, 0.0, 0.0, s12])


# criteria -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("stress", "mode"),
    [
        ((1000e6, 0.0, 0.0), 0),
        ((-700e6, 0.0, 0.0), 0),
        ((0.0, 50e6, 0.0), 1),
        ((0.0, -150e6, 0.0), 1),
        ((0.0, 0.0, 70e6), 2),
        ((0.0, 0.0, -70e6), 2),
    ],
)
def test_every_criterion_is_one_at_uniaxial_strengths(stress: tuple[float, float, float], mode: int) -> None:
    s = plane(*stress)
    assert stress_indices(UD, s)[mode] == pytest.approx(1.0, rel=1e-14)
    assert strain_indices(UD, UD.compliance @ s)[mode] == pytest.approx(1.0, rel=1e-12)
    assert float(tsai_wu_index(UD, s)) == pytest.approx(1.0, rel=1e-12)
    for factor in (0.0, 0.5, 2.0):  # in proportion to the loads
        assert float(tsai_wu_index(UD, factor * s)) == pytest.approx(factor, abs=1e-12)


@pytest.mark.parametrize("degrees", [0.0, 5.0, 15.0, 45.0, 90.0])
def test_off_axis_strength_of_a_unidirectional_ply(degrees: float) -> None:
    """Jones (1999), Mechanics of Composite Materials, 2.9: strengths under a tension at an angle to the fibres."""
    c, s, S = np.cos(radians(degrees)), np.sin(radians(degrees)), 30e6
    stress = S * plane(c * c, s * s, -c * s)
    by_stress = min(x for x in (1000e6 / c**2, 50e6 / max(s**2, 1e-30), 70e6 / max(c * s, 1e-30)))
    assert S / stress_indices(UD, stress).max() == pytest.approx(by_stress, rel=1e-12)
    F1, F2, F11, F22, F66 = 1e-9 - 1 / 700e6, 1 / 50e6 - 1 / 150e6, 1e-9 / 700e6, 1 / 50e6 / 150e6, 1 / 70e6**2
    F12 = -0.5 * np.sqrt(F11 * F22)
    a = F11 * c**4 + F22 * s**4 + (F66 + 2.0 * F12) * c**2 * s**2
    roots = np.roots([a, F1 * c**2 + F2 * s**2, -1.0])
    assert S / float(tsai_wu_index(UD, stress)) == pytest.approx(float(roots.max()), rel=1e-10)
    compressed = S / float(tsai_wu_index(UD, -stress))
    assert compressed == pytest.approx(-float(roots.min()), rel=1e-10)


def test_missing_strengths_do_not_count() -> None:
    partly = Material(**{k: v for k, v in GLASS.items() if k not in ("Yt", "Yc", "S12")})
    assert stress_indices(partly, plane(500e6, 1e9, 1e9)).tolist() == [0.5, 0.0, 0.0]
    assert np.isnan(tsai_wu_index(partly, plane(500e6, 0.0, 0.0)))


def test_goodman() -> None:
    """At the mean of half the difference of strengths the line is highest; beyond the strengths there is none."""
    tension, compression, m = 1000e6, 700e6, 10.0

    def damage(amplitude: float, mean: float, factors: tuple[float, float] = (1.0, 1.0)) -> float:
        cycles = Cycles(np.array([2.0 * amplitude]), np.array([mean]), np.array([1.0]))
        return goodman_damage(cycles, SnLine(tension, compression, m, *factors))

    assert damage(850e6, 150e6) == pytest.approx(1.0)
    assert damage(700e6, 0.0) == pytest.approx(1.0)  # in compression
    assert damage(500e6, 500e6) == pytest.approx(1.0)  # in tension: 500 + 500
    assert damage(350e6, -350e6) == pytest.approx(1.0)
    assert damage(70e6, 0.0) == pytest.approx(1e-10)
    assert damage(70e6, 0.0, (1.0, 1.2)) == pytest.approx(1.2**10 * 1e-10)
    assert damage(70e6, 100e6, (1.5, 1.0)) == pytest.approx((140.0 / (1700.0 - abs(300.0 - 300.0))) ** 10)
    assert damage(1e6, 1001e6) == inf


def test_a_long_isotropic_plate_has_k_4() -> None:
    E, nu, t, b = 210e9, 0.3, 0.02, 1.5
    D = E * t**3 / 12.0 / (1.0 - nu**2)
    matrix = D * np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])
    assert critical_load(matrix, b) == pytest.approx(4.0 * pi**2 * D / b**2, rel=1e-12)
    orthotropic = np.array([[16.0, 0.5, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 0.25]])  # the minimum over half waves
    a = np.linspace(0.2, 10.0, 4001)
    waves = pi**2 / b**2 * (16.0 * (b / a) ** 2 + 2.0 * (0.5 + 0.5) + (a / b) ** 2)
    assert critical_load(orthotropic, b) == pytest.approx(waves.min(), rel=1e-5)


# sections -------------------------------------------------------------------------------------------------


def ring(radius: float, n: int = 241) -> np.ndarray:
    """A circle from the trailing edge (y > 0) over the suction side (x > 0)."""
    a = np.linspace(0.0, 2.0 * pi, n)
    return radius * np.stack([np.sin(a), np.cos(a)], axis=1)


def tube(material: Material, angle: float = 0.0) -> Section:
    return Section("tube", ring(1.0), (Ply("wall", "m", 0.02, angle),), (), {"m": material})


@pytest.mark.parametrize(
    ("load", "where", "sign"),
    [(4, (1.0, 0.0), -1.0), (4, (-1.0, 0.0), 1.0), (3, (0.0, 1.0), 1.0), (3, (0.0, -1.0), -1.0)],
)
def test_bending_of_an_isotropic_tube(load: int, where: tuple[float, float], sign: float) -> None:
    """A flapwise moment compresses the suction side, as M x / I; an edgewise one stretches the trailing edge."""
    states = thin_walled_section(tube(Material(**STEEL))).states()
    M = np.zeros(6)
    M[load] = 1e6
    _, stress = states.under(M)
    at = np.argmin(np.hypot(*(states.position.real - 0.99 * np.array(where)).T))
    inertia = pi / 4.0 * (1.0 - 0.98**4)
    reach = states.position.real[at] @ np.array(where)
    assert stress[at, 0].real == pytest.approx(sign * 1e6 * reach / inertia, rel=2e-3)


def layup_of(material: dict[str, Any]) -> Layup:
    """A round blade of constant wall, with two webs."""
    a = np.linspace(0.0, 2.0 * pi, 121)
    coordinates = np.stack([0.5 + 0.5 * np.cos(a), 0.5 * np.sin(a)], axis=1)
    return Layup(
        name="round",
        position={"grid": [0.0, 1.0], "values": [0.0, NREL.blade.length]},
        chord=2.0,
        offset_y=1.0,
        thickness=1.0,
        shapes=(Shape(thickness=1.0, coordinates=coordinates),),
        materials={"m": Material(**material)},
        webs=(Web(name="front", start=0.35, end=0.65), Web(name="rear", start=0.15, end=0.85)),
        layers=(
            Layer(name="wall", material="m", thickness=0.02),
            Layer(name="front", material="m", thickness=0.01, web="front"),
            Layer(name="rear", material="m", thickness=0.01, web="rear"),
        ),
    )


def run_of(loads: dict[int, np.ndarray | float], twist: float = 0.0) -> tuple[Result, Any]:
    time = np.linspace(0.0, 100.0, 1001)
    data = np.zeros((len(time), 6))
    for k, x in loads.items():
        data[:, k] = x
    names = [f"{name}_1" for name in ROOT]
    structure = NREL.blade.structure.replace(twist=np.full(len(NREL.blade.structure.position), twist).tolist())
    turbine = NREL.replace(blade=NREL.blade.replace(structure=structure))
    return Result(time, data, tuple(KNOWN[name] for name in names), meta={"stations": {"blade": []}}), turbine


def test_loads_turn_with_the_twist() -> None:
    """Twist turns the leading edge into the wind: at 90 degrees the flap axis of the section is the edge axis of the
    blade, backwards."""
    result, turbine = run_of({0: 1.0, 1: 2.0, 3: 3.0, 4: 4.0}, radians(90.0))
    assert blade_loads(result, turbine)[0.0][0] == pytest.approx([-2.0, 1.0, 0.0, -4.0, 3.0, 0.0])
    with pytest.raises(InputError, match="no blade station with all six loads of blade 2"):
        blade_loads(result, turbine, blade=2)


def test_a_single_isotropic_layer() -> None:
    """Index, instant and damage of a flapwise moment of a sine, by hand."""
    strong = STEEL | {"Xt": 400e6, "Xc": 300e6, "Yt": 4e9, "Yc": 4e9, "S12": 1e9, "fatigue_exponent": 5.0}
    wave = 1e6 * (1.0 + np.sin(2.0 * pi * 0.1 * np.linspace(0.0, 100.0, 1001)))
    result, turbine = run_of({4: wave})
    found = blade_strength([result], turbine, layup_of(strong), factors="none", load_factor=1.0, years=1.0)
    model = thin_walled_section(layup_of(strong).section(0.0))
    states = model.states()
    stress = states.stress.real[:, 0, 4]
    wall = next(layer for layer in found.layers if layer.layer == "wall")
    assert wall.stress == pytest.approx(2e6 * max(stress.max() / 400e6, -stress.min() / 300e6), rel=1e-9)
    assert (wall.mode, wall.result) == ("fibre stress", 0)
    assert wall.index == max(wall.stress, wall.strain, wall.tsai_wu)
    assert wave[round(wall.time / 0.1)] == pytest.approx(2e6)
    assert wall.position[0] > 0.9  # the suction side
    counted = rainflow_cycles(wave * stress.min())
    by_hand = 8760.0 * 36.0 * goodman_damage(counted, SnLine(400e6, 300e6, 5.0))
    assert wall.damage == pytest.approx(by_hand, rel=0.02)
    assert found.warnings == ("no fatigue across the fibres, whose slope (across_exponent) is not given: m",)
    both = blade_strength([result], turbine, layup_of(strong), factors="iec61400-5", load_factor=1.35)
    gamma = 1.35 * prod(blade_factors()["iec61400-5"].ultimate)
    assert max(x.stress for x in both.layers) == pytest.approx(gamma * max(x.stress for x in found.layers), rel=1e-9)
    plain = blade_strength([result], turbine, layup_of(STEEL), factors="none")
    assert "m: no strengths along the fibres" in plain.warnings[0]
    assert np.isnan(plain.layers[0].index)
    other = layup_of(STEEL).replace(position={"grid": [0.0, 1.0], "values": [0.0, 40.0]})
    with pytest.raises(InputError, match="the layup of round is 40 m long, the blade of nrel5mw 61.5 m"):
        blade_strength([result], turbine, other)
    with pytest.raises(InputError, match="factors 'iec'"):
        blade_strength([result], turbine, layup_of(STEEL), factors="iec")


def test_panels_between_webs() -> None:
    """Axial compression: N = F t / A in every wall; the panels of suction and pressure side are alike."""
    model = thin_walled_section(layup_of(STEEL).section(0.0))
    states, force = model.states(), -1e6
    area = model.stiffness[2, 2] / 210e9
    of_shell = [model.section.plies[wall.plies[0][0]].web is None for wall in model.mesh.walls]
    shell = [w for w, wall in enumerate(model.mesh.walls) if of_shell[w] and not wall.link]
    assert wall_forces(model, states)[shell, 2] == pytest.approx(0.02 / area, rel=2e-3)
    loads = np.zeros((3, 6))
    loads[:, 2] = 0.0, force, 0.5 * force
    at = StationLoads(0.0, [np.arange(3.0)], [loads], lambda *_: 0.0)
    panels = panel_strength(at, model, states, 2.0)
    assert [panel.where for panel in panels] == ["suction side", "pressure side"]
    D = 210e9 * 0.02**3 / 12.0 / (1.0 - 0.3**2)
    for panel in panels:
        assert panel.width == pytest.approx(0.2 * 2.0 * pi * 0.99, rel=0.02)
        curved = (0.02 / 0.99) ** 2 / 12.0  # share by which laminates of curved walls differ
        assert panel.critical == pytest.approx(4.0 * pi**2 * D / panel.width**2, rel=1.1 * curved)
        assert panel.load == pytest.approx(-force * 0.02 / area, rel=2e-3)
        assert panel.index == pytest.approx(2.0 * panel.load / panel.critical)
        assert panel.time == 1.0
    loads[:, 2] *= -1.0
    assert panel_strength(at, model, states, 2.0)[0].index == 0.0


def test_plates_of_unsymmetric_laminates_bend_about_their_neutral_plane() -> None:
    A, B, D = np.diag([2.0, 2.0, 1.0]), np.diag([1.0, 0.0, 0.0]), np.diag([3.0, 3.0, 1.0])
    assert bending_stiffness(np.block([[A, B], [B, D]]))[0, 0] == pytest.approx(3.0 - 0.5)
    assert WebLine("w", 0.1, 0.9).start == 0.1


def test_faces_of_sandwiches_wrinkle() -> None:
    """Axial compression of a tube: the force of a face by its share of the stiffness, Hoff's critical stress."""
    foam = Material(density=130.0, **dict.fromkeys(("E1", "E2", "E3"), 130e6), **dict.fromkeys(SHEAR, 50e6), **NU)
    plies = (Ply("outside", "m", 0.003, 0.0), Ply("core", "foam", 0.03, 0.0), Ply("inside", "m", 0.003, 0.0))
    model = thin_walled_section(Section("tube", ring(1.0), plies, (), {"m": UD, "foam": foam}))
    loads = np.zeros((3, 6))
    loads[:, 2] = 0.0, -2e6, 1e6
    at = StationLoads(0.0, [np.arange(3.0)], [loads], lambda *_: 0.0)
    found = wrinkling(at, model, model.states(), 1.5)
    assert [(x.mode, x.where) for x in found] == [
        ("wrinkling", "suction side, core"),
        ("wrinkling", "pressure side, core"),
    ]
    stress = 0.5 * (44e9 * 130e6 * 50e6) ** (1.0 / 3.0)
    for x in found:
        assert x.critical == pytest.approx(0.003 * stress)
        assert x.load == pytest.approx(2e6 * 44e9 * 0.003 / model.stiffness[2, 2].real, rel=2e-3)
        assert (x.index, x.time) == (pytest.approx(1.5 * x.load / x.critical), 1.0)
    turned = (plies[0], Ply("core", "foam", 0.03, radians(30.0)), plies[2])
    both = replace(model.section, plies=turned, materials={"m": UD, "foam": foam.replace(G23=20e6)})
    other = thin_walled_section(both)
    ratio = (1.0 / (0.75 + 0.25 * 50.0 / 20.0)) ** (1.0 / 3.0)
    assert wrinkling(at, other, other.states(), 1.5)[0].critical == pytest.approx(0.003 * ratio * stress)
    plain = thin_walled_section(tube(UD))
    assert wrinkling(at, plain, plain.states(), 1.5) == []


def test_fatigue_across_the_fibres() -> None:
    """Fibres round a tube: bending stresses it across them; without a slope there is no damage."""
    given = GLASS | {"across_exponent": 8.0}
    wave = 1e5 * np.sin(2.0 * pi * 0.1 * np.linspace(0.0, 100.0, 1001))
    result, turbine = run_of({4: wave})
    round_ = layup_of(given)
    round_ = round_.replace(layers=(round_.layers[0].replace(angle=0.5 * pi), *round_.layers[1:]))
    found = blade_strength([result], turbine, round_, factors="iec61400-5", years=1.0)
    gamma = blade_factors()["iec61400-5"]
    stress = thin_walled_section(round_.section(0.0)).states().stress.real[:, 1, 4]
    line = SnLine(50e6, 150e6, 8.0, prod(gamma.interfibre), prod(gamma.fatigue))
    by_hand = 8760.0 * 36.0 * max(goodman_damage(rainflow_cycles(wave * s), line) for s in (stress.min(), stress.max()))
    assert max(x.damage_across for x in found.layers) == pytest.approx(by_hand, rel=0.02)
    assert found.warnings == ()
    plain = blade_strength([result], turbine, layup_of(GLASS), factors="none")
    assert all(np.isnan(x.damage_across) for x in plain.layers)


# load bases -----------------------------------------------------------------------------------------------


def test_plies_of_a_load_base(tmp_path: Path) -> None:
    """Ultimate: the stress of the design loads; fatigue: damage of one load as by hand, of two as if in phase."""
    strong = STEEL | {"Xt": 400e6, "Xc": 300e6, "Yt": 4e9, "Yc": 4e9, "S12": 1e9, "fatigue_exponent": 5.0}
    planned, lag = small_plan(("1.2", "1.3")), {1: 0.0, 2: 0.5, 3: 0.0}

    def series(case: PlannedCase, time: np.ndarray) -> dict[str, np.ndarray]:
        load, found = 1e5 * case.variant.speed, {}
        for n in lag:
            for b in (1, 2, 3):  # blade 2 has the largest loads
                size = load * (1.0 + 0.2 * (b == 2))
                found[f"station_{n}_moment_y_{b}"] = size * (1.0 + np.cos(pi * time))
                found[f"station_{n}_moment_x_{b}"] = size * (n > 1) * np.cos(pi * (time - lag[n]))
        return found

    write_campaign(planned.campaign, tmp_path)
    synthetic_base(tmp_path, planned, series)
    found = base_blade_strength(tmp_path, layup_of(strong), factors="none", turbine=run_of({})[1])
    assert sorted(found.points) == pytest.approx([0.25 * NREL.blade.length, 0.5 * NREL.blade.length, 46.125])
    states = thin_walled_section(layup_of(strong).section(0.25)).states()
    first, second, third = (x for x in found.layers if x.layer == "wall")
    cases = {case.name: case for case in read_results(planned, tmp_path).present}
    fastest = max(case.variant.speed for case in cases.values() if case.row == "1.3")
    top = 1.35 * 2.4e5 * fastest
    unit = states.stress.real[:, 0, 4]
    assert first.stress == pytest.approx(top * max(unit.max() / 400e6, -unit.min() / 300e6), rel=1e-6)
    assert cases[found.names[first.result]].row == "1.3"
    repeated = shared_repetitions(read_results(planned, tmp_path))

    def damage(n: int, of: np.ndarray) -> float:
        """At station n, of moments x and y by unit stresses."""
        total = 0.0
        for name, repetitions in repeated.items():
            time = 0.05 * np.arange(round(cases[name].duration / 0.05) + 1)
            loads = series(cases[name], time)
            stress = sum(s * loads[f"station_{n}_moment_{c}_2"] for s, c in zip(of, "xy", strict=True))
            total += repetitions * goodman_damage(rainflow_cycles(stress), SnLine(400e6, 300e6, 5.0))
        return total

    def worst(n: int, station: float) -> float:
        stress = thin_walled_section(layup_of(strong).section(station)).states().stress.real[:, 0, 3:5]
        return max(damage(n, s) for s in stress[:: max(len(stress) // 200, 1)])

    assert first.damage == pytest.approx(max(damage(1, np.array([0.0, s])) for s in (unit.min(), unit.max())), rel=0.02)
    assert third.damage == pytest.approx(worst(3, 0.75), rel=0.05)  # in phase
    apart = worst(2, 0.5)
    assert apart < second.damage < 1.3 * apart
    (tmp_path / "planned").mkdir()
    write_campaign(planned.campaign, tmp_path / "planned")
    with pytest.raises(InputError, match="no ultimate loads"):
        base_blade_strength(tmp_path / "planned", layup_of(strong))


def test_plies_of_a_load_base_without_fatigue(tmp_path: Path) -> None:
    planned = small_plan(("1.3",))

    def series(case: PlannedCase, time: np.ndarray) -> dict[str, np.ndarray]:
        return {f"station_{n}_moment_y_{b}": 1e6 + 0.0 * time for n in (1, 2, 3) for b in (1, 2, 3)}

    write_campaign(planned.campaign, tmp_path)
    synthetic_base(tmp_path, planned, series)
    found = base_blade_strength(tmp_path, layup_of(GLASS))
    assert all(x.index > 0.0 and np.isnan(x.damage) for x in found.layers)
    assert max(p.index for p in found.panels) > 0.0
