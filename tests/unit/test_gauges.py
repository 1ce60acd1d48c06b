"""Gauges calibrated by gravity: moments by rotation matrices, and known zeros, gains, crosstalk and drift recovered."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from meltemi import InputError, Turbine
from meltemi.validation.gauges import (
    TOWER,
    Calibration,
    calibrate_roots,
    calibrate_tower,
    calibration_table,
    drifted,
    first_moment,
    overhanging_mass,
    root_moments,
    tower_moments,
)
from meltemi.validation.measurements import MeasuredRecord, Signal

Float = NDArray[np.float64]
GRAVITY = 9.80665
RATE = 10.0
ZERO = np.array([4.0e5, -2.5e5])
K = np.array([[0.9, 0.04], [-0.06, 1.15]])
"""Readings over moments, with crosstalk."""


def about(axis: int, angle: float) -> Float:
    """Rotation matrix about an axis of a right-handed frame."""
    c, s = np.cos(angle), np.sin(angle)
    R, (i, j) = np.eye(3), [(1, 2), (2, 0), (0, 1)][axis]
    R[i, i] = R[j, j] = c
    R[j, i], R[i, j] = s, -s
    return R


def record(signals: dict[str, Float], begin: float = 1e9) -> MeasuredRecord:
    n = len(next(iter(signals.values())))
    time = begin + np.arange(n) / RATE
    series = {name: Signal(time, x, RATE) for name, x in signals.items()}
    return MeasuredRecord(begin, n / RATE, "idle.csv", series)


def noise(n: int, size: float, seed: np.random.Generator) -> Float:
    """(n, 2) first-order noise with a time constant of a second: gusts at idle."""
    shocks = seed.standard_normal((n, 2)) * np.sqrt(1.0 - 0.9**2)
    return size * np.asarray(lfilter([1.0], [1.0, -0.9], shocks, axis=0))


def idle(
    turbine: Turbine,
    seed: int,
    *,
    pitches: tuple[float, ...] = (0.05, 1.4),
    zero: Float = ZERO,
) -> list[MeasuredRecord]:
    """Records of twelve revolutions at 1.5 rpm and each pitch angle."""
    chance, records = np.random.default_rng(seed), []
    n = round(12.3 * 40.0 * RATE)
    psi = 2.0 * np.pi * np.arange(n) / RATE / 40.0 + 0.7
    for pitch in pitches:
        theta = np.full(n, pitch)
        s = zero + root_moments(turbine, psi, theta) @ K.T + noise(n, 5e4, chance)
        names = ("root_moment_flap_1", "root_moment_edge_1", "azimuth", "pitch_1")
        values = (s[:, 0], s[:, 1], psi % (2.0 * np.pi), theta)
        records.append(record(dict(zip(names, values, strict=True))))
    return records


@pytest.mark.parametrize(("azimuth", "pitch"), [(0.0, 0.0), (0.9, 0.2), (2.5, 1.5), (4.4, -0.1)])
def test_root_moments_are_those_of_rotation_matrices(turbine: Turbine, azimuth: float, pitch: float) -> None:
    """Tilt about -y lifts the upwind end, the blade turns about x, leans upwind about -y, pitches about -z."""
    turbine = turbine.replace(**{"blade.structure.axis_x": -3.0 * (turbine.blade.structure.position / 60.0) ** 2})
    tilt, cone = turbine.nacelle.tilt, turbine.hub.precone
    shaft = about(1, tilt)
    assert (shaft @ [-1.0, 0.0, 0.0])[2] * np.sign(tilt) > 0.0
    blade = shaft @ about(0, azimuth) @ about(1, -cone) @ about(2, -pitch)
    S = blade @ first_moment(turbine)
    M = blade.T @ np.cross(S, [0.0, 0.0, -GRAVITY])
    ours = root_moments(turbine, np.array([azimuth]), np.array([pitch]))[0]
    assert ours == pytest.approx([M[1], M[0]], rel=1e-12, abs=1e-6)


def test_signs_of_the_moments(turbine: Turbine) -> None:
    """At zero pitch a falling blade is driven in plane; at feather its weight bends the flap gauge."""
    psi = np.array([0.5, 1.5]) * np.pi
    at_zero, at_feather = (root_moments(turbine, psi, np.full(2, pitch)) for pitch in (0.0, 0.5 * np.pi))
    S = first_moment(turbine)[2] * GRAVITY * np.cos(turbine.nacelle.tilt)
    assert at_zero[:, 1] == pytest.approx([S, -S], rel=2e-2)
    assert at_feather[:, 0] == pytest.approx([S, -S], rel=2e-2)


def test_first_moment_has_offsets_and_prebend(turbine: Turbine) -> None:
    s = turbine.blade.structure
    assert s.mass is not None
    plain = first_moment(turbine)
    z = np.linspace(0.0, s.position[-1], 20001)
    assert plain[2] == pytest.approx(np.trapezoid(np.interp(z, s.position, s.mass) * z, z), rel=1e-5)
    there = turbine.replace(
        **{
            "blade.structure.axis_x": -2.0 * s.position / s.position[-1],
            "blade.structure.twist": np.zeros(len(s.position)),
            "blade.structure.mass_centre_y": np.full(len(s.position), 0.3),
        }
    )
    mass = np.trapezoid(s.mass, s.position)
    assert first_moment(there)[0] == pytest.approx(-2.0 * plain[2] / s.position[-1])
    assert first_moment(there)[1] == pytest.approx(0.3 * mass, rel=1e-2)


def test_overhanging_mass_is_that_of_its_parts(turbine: Turbine) -> None:
    """An upwind rotor pulls the tower upwind: a negative fore-aft moment, plus the nacelle behind the tower."""
    changed = {"nacelle.mass_centre": (1.9, 0.4, 1.75), "nacelle.yaw_inertia": 2.7e6, "hub.mass_centre": -0.3}
    turbine = turbine.replace(**changed)
    s, n, hub = turbine.blade.structure, turbine.nacelle, turbine.hub
    assert s.mass is not None
    r = hub.radius + s.position
    along = -hub.mass * n.overhang + hub.mass * hub.mass_centre
    along += 3.0 * np.trapezoid(s.mass * (-n.overhang - r * np.sin(hub.precone)), s.position)
    x, y = overhanging_mass(turbine)
    assert x == pytest.approx(np.cos(n.tilt) * along + n.mass * n.mass_centre[0], rel=1e-3)
    assert y == pytest.approx(n.mass * n.mass_centre[1], abs=1e-9)
    ahead, left, back = tower_moments(turbine, np.array([0.0, 0.5 * np.pi, np.pi]))
    assert back == pytest.approx(-ahead) and x < 0.0 < y
    assert ahead == pytest.approx([GRAVITY * x, -GRAVITY * y])
    assert left == pytest.approx([-GRAVITY * y, -GRAVITY * x], abs=1e-6)


def test_the_second_blade_follows_the_first(turbine: Turbine) -> None:
    """By a third of a revolution in azimuth: the gauges of blade 2 feel its weight."""
    psi = 2.0 * np.pi * np.arange(4000) / 400.0
    records = []
    for pitch in (0.05, 1.4):
        theta = np.full(len(psi), pitch)
        s = ZERO + root_moments(turbine, psi + 2.0 * np.pi / 3.0, theta) @ K.T
        signals = {"root_moment_flap_2": s[:, 0], "root_moment_edge_2": s[:, 1]}
        records.append(record(signals | {"azimuth": psi % (2.0 * np.pi), "pitch_2": theta}))
    calibration = calibrate_roots(records, turbine, 2)
    assert calibration.zero == pytest.approx(ZERO) and calibration.gain == pytest.approx(np.linalg.inv(K))


def inside(calibration: Calibration, zero: Float, gain: Float) -> NDArray[np.bool_]:
    """Whether the true numbers lie within the intervals: both zeros and the four gains."""
    errors = np.concatenate([calibration.zero - zero, (calibration.gain - gain).ravel()])
    return np.abs(errors) <= np.concatenate([calibration.zero_half, calibration.gain_half.ravel()])


def test_zeros_gains_and_crosstalk_are_recovered(turbine: Turbine) -> None:
    """Within the intervals in 19 of 20, with coloured noise; the intervals are not trivially wide."""
    C = np.linalg.inv(K)
    every = [calibrate_roots(idle(turbine, seed), turbine) for seed in range(100)]
    share = np.mean([inside(each, ZERO, C) for each in every], axis=0)
    assert np.all(share >= 0.87) and 0.93 <= share.mean() <= 0.98
    one = every[0]
    assert one.use == ("all", "all") and one.parts == 24 and not one.notes
    assert np.all(one.gain_half < 0.02)
    s = ZERO + np.array([[1e6, -2e6]]) @ K.T
    assert one.moments(s)[0] == pytest.approx([1e6, -2e6], rel=0.02)


def test_tower_gauges_are_recovered(turbine: Turbine) -> None:
    n, C = 6000, np.linalg.inv(K)
    yaw = np.linspace(0.2, 0.2 + 2.1 * np.pi, n)
    size = GRAVITY * np.hypot(*overhanging_mass(turbine))
    shares = []
    for seed in range(60):
        s = ZERO + tower_moments(turbine, yaw) @ K.T + noise(n, 0.05 * size, np.random.default_rng(seed))
        calibration = calibrate_tower(record({TOWER[0]: s[:, 0], TOWER[1]: s[:, 1], "nacelle_yaw": yaw}), turbine)
        shares.append(inside(calibration, ZERO, C))
    assert calibration.use == ("all", "all")
    assert 0.92 <= np.mean(shares) <= 0.99


def test_one_pitch_angle_calibrates_one_gauge(turbine: Turbine) -> None:
    """At feather the edge gauge feels hardly any weight: only its deviation and equivalent load are compared."""
    calibration = calibrate_roots(idle(turbine, 3, pitches=(1.55,)), turbine)
    assert calibration.use == ("all", "range")
    assert np.isfinite(calibration.zero[0]) and np.isnan(calibration.zero[1])
    flap, edge = calibration.moments(ZERO + np.array([[2e6, 0.0]]) @ K.T)[0]
    assert flap == pytest.approx(2e6, rel=0.05) and np.isnan(edge)
    assert any("crosstalk" in note for note in calibration.notes) and any(
        "another pitch" in note for note in calibration.notes
    )
    table = calibration_table([calibration])
    assert [row[-1] for row in table.rows] == ["all", "range"] and "equivalent load" in table.note


def test_a_gauge_that_feels_no_gravity_is_not_calibrated(turbine: Turbine) -> None:
    records = idle(turbine, 4)
    chance = np.random.default_rng(1)
    for each in records:
        each["root_moment_flap_1"].values[:] = 3e6 * chance.standard_normal(len(each["azimuth"].time))
    calibration = calibrate_roots(records, turbine)
    assert calibration.use[0] == "range" and "explains" in calibration.notes[0]


def test_wrong_signs_are_refused(turbine: Turbine) -> None:
    for name in ("root_moment_flap_1", "root_moment_edge_1"):
        records = idle(turbine, 5)
        for each in records:
            each[name].values[:] *= -1.0
        with pytest.raises(InputError, match=f"{name}: the reading falls.*sign: -1"):
            calibrate_roots(records, turbine)
    records = idle(turbine, 5)
    for each in records:
        each["azimuth"].values[:] *= -1.0
    with pytest.raises(InputError, match="direction of azimuth"):
        calibrate_roots(records, turbine)


def test_drift_between_dates(turbine: Turbine) -> None:
    first, same, later = (
        calibrate_roots(idle(turbine, seed, zero=ZERO + np.array([shift, 0.0])), turbine)
        for seed, shift in ((7, 0.0), (8, 0.0), (9, 1e5))
    )
    assert drifted(first, same) == (False, False)
    assert drifted(first, later) == (True, False)
    rows = calibration_table([first, same, later]).rows
    assert [row[-2] for row in rows] == ["", "", "no", "no", "yes", "no"]


@pytest.mark.parametrize(("speed", "words"), [(1.2, "rpm; at most 20 %"), (0.03, "5 are needed")])
def test_too_fast_or_too_few_revolutions(turbine: Turbine, speed: float, words: str) -> None:
    one = idle(turbine, 1)[0]
    psi = one["azimuth"].values
    psi[:] = np.arange(len(psi)) / RATE * speed % (2.0 * np.pi)
    with pytest.raises(InputError, match=words):
        calibrate_roots([one], turbine)
