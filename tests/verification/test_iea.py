"""IEA 15 MW and 22 MW: they run, what their flexible blades do, and what HAWC2's induction changes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import ModelOptions, Turbine, TurbulentWind, operating_point
from meltemi.verification.iea import MODES, rotor_alone
from meltemi.verification.table import reference_table

Float = NDArray[np.float64]

EARLIER_BLADE = np.array(
    [
        [11.718, 0.3762, 25.2830],
        [16.405, 0.7528, 10.4480],
        [23.436, 1.0333, 2.6797],
        [29.295, 1.1208, 1.0387],
        [35.154, 1.1495, 0.6211],
        [41.013, 1.0900, 0.4513],
        [46.872, 1.0594, 0.3525],
        [52.731, 1.0327, 0.2739],
        [58.590, 1.0005, 0.2077],
        [64.449, 0.9686, 0.1575],
        [70.308, 0.9124, 0.1199],
        [76.167, 0.8658, 0.0896],
        [82.026, 0.8148, 0.0674],
        [87.885, 0.7751, 0.0493],
        [93.744, 0.7112, 0.0371],
        [99.603, 0.5885, 0.0223],
        [105.46, 0.4854, 0.0128],
        [111.32, 0.3994, 0.0072],
    ]
)
"""Station [m], shear centre from half the chord towards the nose [m], torsional stiffness [GN m^2]: an earlier
definition of the blade, github.com/IEAWindTask37/IEA-15-240-RWT, commit 8a884e5, HAWC2/IEA-15-240-RWT-FixedBottom/data/
blade_beamdyn_c2_noFPM.st."""


@pytest.mark.slow
@pytest.mark.parametrize("name", ["iea15mw", "iea22mw"])
@pytest.mark.parametrize("wind", [8.0, 18.0])
def test_they_run_in_turbulence(name: str, wind: float) -> None:
    turbine = meltemi.load_turbine(name)
    result = meltemi.simulate(
        meltemi.build(turbine), TurbulentWind(speed=wind, intensity=0.14, seed=1, points=9), duration=60.0
    )
    result.raise_for_status()
    late = result.time > 20.0
    speed = result["rotor_speed"][late]
    reference = turbine.control.pitch.reference_speed
    if wind > 12.0:
        assert np.mean(speed) == pytest.approx(reference, rel=0.03)
        assert np.mean(result["generator_power"][late]) == pytest.approx(turbine.rated_power, rel=0.03)
    assert np.max(speed) < 1.15 * reference


@pytest.mark.slow
def test_the_blades_unload_themselves(rated: dict[str, tuple[float, float, float]]) -> None:
    """Near rated wind bending and twisting take 11 % of the thrust of rigid blades, and 3.5 % of the power."""
    thrust, power, twist = (dict(zip(rated, values, strict=True)) for values in zip(*rated.values(), strict=True))
    assert 0.80 < thrust["flexible"] / thrust["rigid"] < 0.90
    assert 0.90 < power["flexible"] / power["rigid"] < 0.98
    assert -4.5 < twist["flexible"] < -3.0  # deg, nose down, towards feather
    assert twist["rigid"] == 0.0
    # it comes from the sections' moments about their aerodynamic centres; lift acts ahead of the shear centres
    assert 0.5 < twist["without moments"] < 1.5
    assert thrust["without moments"] > 1.05 * thrust["flexible"]
    # the prebend brings the tips downwind out of the cone: a straight blade has less rotor
    assert power["straight"] < power["flexible"]


@pytest.fixture(scope="module")
def rated() -> dict[str, tuple[float, float, float]]:
    """Thrust [N], power [W], tip twist [deg] at 10.5 m/s and HAWC2's rotor speed, for variants of the IEA 15 MW."""
    turbine = meltemi.load_turbine("iea15mw")
    s, a = turbine.blade.structure, turbine.blade.aerodynamics
    assert s.axis_x is not None and a.centre_x is not None
    bent = np.interp(a.position, s.position, s.axis_x)
    variants: dict[str, tuple[Turbine, ModelOptions]] = {
        "flexible": (turbine, MODES),
        "rigid": (turbine, ModelOptions(locked=("blades",))),
        "without moments": (
            turbine.replace(
                airfoils={k: {**v.content(), "moment": np.zeros(len(v.lift))} for k, v in turbine.airfoils.items()}
            ),
            MODES,
        ),
        "straight": (
            turbine.replace(
                **{"blade.structure.axis_x": 0.0 * s.axis_x, "blade.aerodynamics.centre_x": a.centre_x - bent}
            ),
            MODES,
        ),
    }
    found = {}
    for name, (variant, options) in variants.items():
        point = operating_point(meltemi.build(variant, options), 10.5, rotor_speed=0.78125, pitch=0.0)
        found[name] = (
            point["rotor_aero_thrust"],
            point["rotor_aero_torque"] * point.rotor_speed,
            float(np.degrees(point["tip_twist_1"])),
        )
    return found


@pytest.mark.slow
def test_an_earlier_definition_of_the_blade_explains_a_third_of_the_thrust() -> None:
    """Its shear centres are nearer to the nose, so that it twists more."""
    turbine = meltemi.load_turbine("iea15mw").replace(**{"nacelle.tilt": 0.0})
    s, a = turbine.blade.structure, turbine.blade.aerodynamics
    assert s.stiffness_matrix is not None and s.axis_y is not None and a.centre_y is not None
    across = np.interp(s.position, a.position, a.centre_y / np.cos(a.twist))
    half_chord = across + 0.25 * np.interp(s.position, a.position, a.chord)
    K = s.stiffness_matrix.copy()
    station, centre, stiffness = EARLIER_BLADE.T
    for k in np.flatnonzero((s.position > station[0]) & (s.position < station[-1])):
        z = s.position[k]
        shear = np.linalg.solve(K[k, :2, :2], K[k, :2, 5])
        shear[0] = np.interp(z, station, centre) - half_chord[k]
        K[k, :2, 5] = K[k, 5, :2] = K[k, :2, :2] @ shear
        K[k, 5, 5] = 1e9 * np.interp(z, station, stiffness) + shear @ K[k, :2, :2] @ shear
    thrust = []
    for variant in (turbine, turbine.replace(**{"blade.structure.stiffness_matrix": K})):
        model = meltemi.build(variant, MODES, meltemi.Environment(gravity=0.0))
        thrust.append(operating_point(model, 10.0, rotor_speed=0.74372, pitch=0.0)["rotor_aero_thrust"] / 1.89868e6)
    assert thrust[0] == pytest.approx(1.059, abs=0.003)
    assert thrust[1] == pytest.approx(1.036, abs=0.003)


@pytest.mark.slow
@pytest.mark.parametrize("wind", ["12", "20"])
def test_the_22mw_at_the_power_of_hawc2(wind: str) -> None:
    """Deviations at its pitch are those of a tenth of a degree: at its power thrust and deflection agree."""
    (theirs,) = reference_table("iea22mw_steady", wind=wind)
    model = rotor_alone("iea22mw")
    speed, pitch = float(theirs["rotor_speed"]) * np.pi / 30.0, np.radians(float(theirs["pitch"]))
    power, thrust, flap = [], [], []
    for angle in (pitch, pitch + np.radians(0.2)):
        point = operating_point(model, float(wind), rotor_speed=speed, pitch=float(angle))
        power.append(point["rotor_aero_torque"] * speed)
        thrust.append(point["rotor_aero_thrust"])
        flap.append(point["tip_flap_1"])
    share = (float(theirs["power"]) - power[0]) / (power[1] - power[0])
    assert abs(0.2 * share) < 0.16
    assert thrust[0] + share * (thrust[1] - thrust[0]) == pytest.approx(float(theirs["thrust"]), rel=0.008)
    assert flap[0] + share * (flap[1] - flap[0]) == pytest.approx(float(theirs["flap"]), rel=0.018)


def test_what_hawc2_takes_for_the_induction_explains_its_power() -> None:
    turbine = meltemi.load_turbine("iea15mw")
    ours = {}
    for wind, speed, pitch in ((5.0, 0.5236, 0.377), (10.5, 0.78125, 0.0)):
        buhl, hawc2 = (
            plain_bem(turbine, wind, speed, np.radians(pitch), law) for law in (buhl_induction, hawc2_induction)
        )
        ours[wind] = hawc2 / buhl - 1.0
        ratio = speed * turbine.rotor_radius / wind
        table = meltemi.analysis.rotor_performance(turbine, [ratio], [np.radians(pitch)])
        force = 0.5 * 1.225 * np.pi * turbine.rotor_radius**2 * wind**3
        assert buhl == pytest.approx(float(table.power[0, 0]) * force, rel=0.015)  # the plain BEM has no hub loss
    assert ours[5.0] == pytest.approx(0.135, abs=0.015)
    assert ours[10.5] == pytest.approx(0.008, abs=0.003)


def buhl_induction(C: Float) -> Float:
    """Momentum theory, beyond C_T = 0.96 Buhl (2005) with F = 1."""
    low = 0.5 * (1.0 - np.sqrt(np.clip(1.0 - C, 0.0, None)))
    a, b, c = 50.0 / 9.0 - 4.0, 4.0 - 40.0 / 9.0, 8.0 / 9.0 - C
    return np.where(C < 0.96, low, (-b + np.sqrt(np.clip(b * b - 4.0 * a * c, 0.0, None))) / (2.0 * a))


def hawc2_induction(C: Float) -> Float:
    """Madsen et al. (2020), Wind Energ. Sci. 5, 1-27."""
    C = np.minimum(C, 2.5)
    return 0.0883 * C**3 + 0.0586 * C**2 + 0.246 * C


def plain_bem(turbine: Turbine, wind: float, speed: float, pitch: float, law: Callable[[Float], Float]) -> float:
    """[W] of a straight, rigid rotor: fixed-point iteration at 60 annuli, Prandtl's tip loss."""
    shape, R = turbine.blade.aerodynamics, turbine.rotor_radius
    edges = np.linspace(0.0, turbine.blade.length, 61)
    s, ds = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    r, chord = s + turbine.hub.radius, np.interp(s, shape.position, shape.chord)
    theta = np.interp(s, shape.position, shape.twist) + pitch
    grid = np.radians(np.linspace(-30.0, 60.0, 1801))

    def at_sections(name: str) -> Float:
        station = [
            np.interp(grid, turbine.airfoils[k].angle_of_attack, getattr(turbine.airfoils[k], name))
            for k in shape.airfoil
        ]
        j = np.clip(np.searchsorted(shape.position, s, side="right") - 1, 0, len(station) - 2)
        w = ((s - shape.position[j]) / (shape.position[j + 1] - shape.position[j]))[:, None]
        stacked = np.array(station)
        return (1.0 - w) * stacked[j] + w * stacked[j + 1]

    lift, drag = at_sections("lift"), at_sections("drag")
    a, swirl = np.full(len(s), 0.3), np.zeros(len(s))
    for _ in range(400):
        tangential, axial = speed * r * (1.0 + swirl), wind * (1.0 - a)
        phi, W2 = np.arctan2(axial, tangential), axial**2 + tangential**2
        x = (phi - theta - grid[0]) / (grid[1] - grid[0])
        row = np.clip(x.astype(int), 0, len(grid) - 2)
        k, share = np.arange(len(s)), x - row
        cl, cd = ((1.0 - share) * table[k, row] + share * table[k, row + 1] for table in (lift, drag))
        loss = 2.0 / np.pi * np.arccos(np.clip(np.exp(-1.5 * (R - r) / (r * np.abs(np.sin(phi)))), 0.0, 1.0))
        solidity = 3.0 * chord / (2.0 * np.pi * r)
        a = 0.8 * a + 0.2 * law(solidity * W2 * cl * np.cos(phi) / wind**2 / loss)
        drive = solidity * W2 * cl * np.sin(phi)
        swirl = 0.8 * swirl + 0.2 * drive / (4.0 * loss * np.maximum(1.0 - a, 0.05) * wind * speed * r)
    torque = 3.0 * np.sum(0.5 * 1.225 * W2 * chord * r * (cl * np.sin(phi) - cd * np.cos(phi)) * ds)
    return float(torque * speed)
