"""Floating platforms: lines, coefficients, radiation, waves, equilibrium."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi.core.errors import InputError
from meltemi.floating.catenary import span
from meltemi.floating.coefficients import read_coefficients, read_wamit
from meltemi.floating.moorings import MooringLine, at_rest
from meltemi.floating.radiation import fit_radiation, kernel
from meltemi.floating.waves import wave_forces
from meltemi.hydro.wamit import wamit_texts
from meltemi.sea.airy import GRAVITY

VECTORS = [
    # x, z, L, EA, w, friction, on the bed; H, V, anchor H: MoorPy's test of its catenary
    (400.0, 200.0, 500.0, 7.51e12, 800.0, 0.0, 1.0, 96643.428, 237751.755, 96643.428),
    (400.0, 200.0, 500.0, 7.51e12, 800.0, 0.1, 1.0, 96643.429, 237751.756, 80418.604),
    (400.0, 200.0, 500.0, 7.51e12, 200.0, 0.0, 0.0, 43694.581, 77634.401, 43694.581),
    (89.9, 59.2, 130.0, 7.51e8, 881.05, 0.0, 0.0, 31373.229, 87886.159, 31373.229),
]


@pytest.fixture(scope="module")
def coefficients() -> Any:
    return read_coefficients("iea15mw-volturnus")


@pytest.mark.parametrize("case", VECTORS)
def test_lines_have_the_forces_of_moorpy(case: tuple[float, ...]) -> None:
    x, z, L, EA, w, friction, on_bed, *known = case
    line = MooringLine(
        fairlead=[x, 0.0, z - 300.0], anchor=[0.0, 0.0, -300.0], length=L, mass=w / GRAVITY, diameter=0.0, stiffness=EA,
        friction=friction,
    )  # fmt: skip
    rest = at_rest([line], {}, 300.0 if on_bed else 400.0, 1025.0)
    if on_bed:
        assert rest.tension[0, 1] == pytest.approx(known[2], rel=2e-6)
    assert [rest.horizontal[0], rest.vertical[0]] == pytest.approx(known[:2], rel=2e-6)


@pytest.mark.parametrize("forces", [(1e6, 1.5e6, 0.0), (1e6, 1.5e6, 0.5), (2e6, 6e6, 0.0)])
def test_derivatives_of_the_span(forces: tuple[float, float, float]) -> None:
    H, V, friction = forces
    e = span(H, V, 850.0, 5844.0, 3.27e9, friction, 1.0)
    for change, names in ((1.0, ("xh", "zh")), (1j, ("xv", "zv"))):
        dh, dv = 10.0 * change.real, 10.0 * change.imag
        ahead, behind = (span(H + s * dh, V + s * dv, 850.0, 5844.0, 3.27e9, friction, 1.0) for s in (1, -1))
        found = [(ahead.x - behind.x) / 20.0, (ahead.z - behind.z) / 20.0]
        assert found == pytest.approx([getattr(e, name) for name in names], rel=1e-5)


def test_coefficients_of_the_volturnus(coefficients: Any) -> None:
    c = coefficients
    assert 1025.0 * c.infinite.diagonal() == pytest.approx(
        [9.6424e6, 9.6425e6, 2.48217e7, 1.16405e10, 1.16399e10, 2.01375e10], rel=1e-5
    )
    assert c.hydrostatic.diagonal()[2:5] == pytest.approx([443.0486, 218240.5, 218216.6], rel=1e-6)


def test_radiation_fits_and_feeds_no_energy(coefficients: Any) -> None:
    fit = fit_radiation(coefficients)
    assert fit.error < 0.03 and fit.negative < 5e-4
    slow = np.abs(1025.0 * fit.damping(np.linspace(0.0, 0.1, 11)))  # critical: 2.9e6 in surge, 6e9 in yaw
    assert slow[:, 0, 0].max() < 0.001 * 2.9e6 and slow[:, 5, 5].max() < 0.001 * 6e9
    t = np.linspace(0.0, 60.0, 300)
    exact, found = kernel(coefficients, t), fit.kernel(t)
    for i in (0, 2, 4, 5):
        assert np.std(found[:, i, i] - exact[:, i, i]) < 0.03 * np.std(exact[:, i, i])


def test_waves_push_by_the_excitation(coefficients: Any) -> None:
    """OpenFAST: 4.83864e6 N at 75.58 deg in surge, 4.82090e6 N at 174.59 deg in heave, T 12 s, H 2 m."""
    platform = meltemi.load_turbine("iea15mw-volturnus").platform
    assert platform is not None
    sea = meltemi.environment.ComponentSea(frequency=[2.0 * math.pi / 12.0], amplitude=[1.0], phase=[0.0])
    dt, _, series = wave_forces(sea, coefficients, platform.replace(drift="none"), 60.0, (0.0, 0.0), 9.81)
    t = dt * (np.arange(len(series)) - 1.0)
    some = (t >= 0.0) & (t < 12.0 - 0.5 * dt)  # the series is one period
    for column, size, angle in ((1, 4.83864e6, 75.58), (3, 4.82090e6, 174.59)):
        found = 2.0 * np.mean(series[some, column] * np.exp(-2j * np.pi / 12.0 * t[some]))
        assert abs(found) == pytest.approx(size, rel=1e-4)
        assert np.degrees(np.angle(found)) == pytest.approx(angle, abs=0.1)


def test_drift_depends_on_its_option_and_refuses_unknown_directions(coefficients: Any) -> None:
    platform = meltemi.load_turbine("iea15mw-volturnus").platform
    assert platform is not None
    sea = meltemi.environment.ComponentSea(frequency=[0.5, 0.6], amplitude=[1.0, 1.5], phase=[0.0, 1.0])
    force = {
        drift: wave_forces(sea, coefficients, platform.replace(drift=drift), 130.0, (0.0, 0.0), 9.81)[2][:, 1]
        for drift in ("none", "mean", "newman", "full")
    }
    extra = {drift: force[drift] - force["none"] for drift in ("mean", "newman", "full")}
    assert np.ptp(extra["mean"]) < 1e-6 * extra["mean"].mean()
    for drift in ("newman", "full"):
        assert np.ptp(extra[drift]) > 0.5 * extra["mean"].mean()
    assert np.abs(extra["full"] - extra["newman"]).max() > 0.01 * np.ptp(extra["full"])
    given = platform.replace(drift_directions="given")
    with pytest.raises(InputError, match="drift: none.*drift_directions: turned"):
        wave_forces(sea.replace(direction=0.5), coefficients, given, 60.0, (0.0, 0.0), 9.81)


def test_drift_forces_turn_with_the_waves(coefficients: Any) -> None:
    """A turn by an angle about z turns force and moment by it; two directions at once are refused."""
    platform = meltemi.load_turbine("iea15mw-volturnus").platform
    assert platform is not None and platform.drift_directions == "turned"
    sea = meltemi.environment.ComponentSea(frequency=[0.5, 0.6], amplitude=[1.0, 1.5], phase=[0.0, 1.0])

    def extra(direction: float) -> Any:
        of = (sea.replace(direction=direction), coefficients)
        forces = [
            wave_forces(*of, platform.replace(drift=drift), 130.0, (0.0, 0.0), 9.81)[2] for drift in ("full", "none")
        ]
        return (forces[0] - forces[1])[:, 1:]

    along, across = extra(0.0), extra(-0.5)  # directions count clockwise, axes counter-clockwise
    c, s = np.cos(0.5), np.sin(0.5)
    for x, y in ((0, 1), (3, 4)):
        turned = np.stack([c * along[:, x] - s * along[:, y], s * along[:, x] + c * along[:, y]])
        assert np.abs(turned - across[:, [x, y]].T).max() < 1e-6 * np.abs(along).max()
    spread = sea.replace(direction=[0.0, 0.5])
    with pytest.raises(InputError, match="without spreading"):
        wave_forces(spread, coefficients, platform, 60.0, (0.0, 0.0), 9.81)


def test_bad_platforms_are_refused() -> None:
    turbine = meltemi.load_turbine("iea15mw-volturnus")
    with pytest.raises(InputError, match="base of the tower must move"):
        turbine.replace(foundation=None)
    with pytest.raises(InputError, match="hangs straight down"):
        turbine.platform.lines[0].replace(length=1200.0)
    with pytest.raises(InputError, match="no library platform"):
        read_coefficients("volturn")
    with pytest.raises(InputError):
        read_wamit(Path("nothing"))


def with_sums(coefficients: Any) -> tuple[Any, Any]:
    """Coefficients with forces at sum frequencies that are linear in the frequencies, at 0 and 40 deg, twice as much;
    and these forces at 0 deg."""

    def force(a: Any, b: Any) -> Any:
        return (3.0 + 2.0j) * (a + b) - 1.0j

    w = np.linspace(0.3, 2.0, 8)
    one = np.zeros((8, 8, 6), dtype=np.complex128)
    one[..., 2] = force(w[:, None], w)
    both = dataclasses.replace(
        coefficients, sums_frequency=w, sums=np.stack([one, 2.0 * one]), sums_heading=np.array([0.0, 40.0])
    )
    return both, force


@pytest.mark.parametrize("heading", [0.0, 10.0])
def test_forces_at_sum_frequencies(coefficients: Any, heading: float) -> None:
    """Of two waves, in closed form (W-38); at 10 deg a quarter of the way from 0 to 40 deg."""
    c, force = with_sums(coefficients)
    platform = meltemi.load_turbine("iea15mw-volturnus").platform
    assert platform is not None
    w, size, phase = np.array([0.7, 1.1]), np.array([1.5, 0.8]), np.array([0.4, -1.2])
    sea = meltemi.environment.ComponentSea(frequency=w, amplitude=size, phase=phase, direction=-np.radians(heading))
    dt, _, first = wave_forces(sea, c, platform.replace(drift="none", sum_forces=True), 60.0, (0.0, 0.0), 9.81)
    # the same steps without these forces
    none = dataclasses.replace(c, sums=0.0 * c.sums)
    again, _, second = wave_forces(sea, none, platform.replace(drift="none", sum_forces=True), 60.0, (0.0, 0.0), 9.81)
    t, a = dt * (np.arange(len(first)) - 1.0), size * np.exp(1j * phase)
    expected = sum(
        (a[i] * a[j] * force(w[i], w[j]) * np.exp(1j * (w[i] + w[j]) * t)).real for i in range(2) for j in range(2)
    )
    scale = platform.water_density * 9.81 * (1.0 + heading / 40.0)
    assert again == dt <= 1.0 / (2.0 * w[-1])
    np.testing.assert_allclose(
        (first - second)[:, 3], scale * expected, rtol=1e-9, atol=1e-9 * np.abs(first[:, 3]).max()
    )


def test_sum_frequencies_go_through_files(coefficients: Any, tmp_path: Path) -> None:
    c, _ = with_sums(coefficients)
    for end, text in wamit_texts(c).items():
        (tmp_path / f"hull{end}").write_text(text, encoding="utf-8")
    found = read_wamit(tmp_path / "hull")
    for name in ("drift", "sums", "sums_frequency", "sums_heading"):
        expected = getattr(c, name)
        np.testing.assert_allclose(getattr(found, name), expected, atol=1e-7 * np.abs(expected).max(), err_msg=name)
    platform = meltemi.load_turbine("iea15mw-volturnus").platform
    assert platform is not None
    summing = platform.replace(drift="none", sum_forces=True, drift_directions="given")
    with pytest.raises(
        InputError, match="sum_forces is known for waves along 0 to 40 deg only, and these travel 5 deg"
    ):
        wave_forces(
            meltemi.environment.RegularSea(height=2.0, period=9.0, direction=math.radians(-45.0)),
            found,
            summing,
            60.0,
            (0.0, 0.0),
            9.81,
        )
    with pytest.raises(InputError, match="sum_forces needs a file .12s"):
        wave_forces(meltemi.environment.RegularSea(height=2.0, period=9.0), coefficients, summing, 9.0, (0, 0), 9.81)


@pytest.mark.slow
@pytest.mark.parametrize("motion", ["roll", "pitch"])
def test_a_platform_that_turns_over_ends_its_run(motion: str) -> None:
    """What was computed until then is kept."""
    model = meltemi.build(meltemi.load_turbine("iea15mw-volturnus"))

    def pushed(case: Any, unsettled: bool) -> None:
        case["v"][model.coordinates.index(f"base {motion}")] = 0.6

    run = meltemi.Run(
        model=model, wind=meltemi.SteadyWind(speed=3.0), duration=30.0, start=meltemi.Start(pitch=1.57),
        controller=meltemi.control.ConstantController(),
    )  # fmt: skip
    simulation = meltemi.Simulation(run, starting=pushed)
    simulation.advance(simulation.n_steps)
    result = simulation.result()
    assert result.status.name == "DIVERGED"
    assert "s the platform turns over (tilt beyond 60 deg): look at its ballast" in result.message
    angle = np.abs(np.asarray(result[f"platform_{motion}"]))
    assert len(angle) > 10 and math.radians(55.0) < angle[-1] < math.radians(60.1)
    assert np.all(np.isfinite(result.data))
