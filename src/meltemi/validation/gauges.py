"""Calibration of strain gauges by gravity: blade roots by slow rotations at idle, the tower base by yaw sweeps.

The readings s of two gauges are fitted to the known moments M of gravity, s = s_0 + K M; then M = C (s - s_0) with
C = K^-1. Intervals are Student's, from the estimates that leave out one revolution, or part of a sweep, at a time.

Reference: docs/theory/validation.md (V-5 to V-11).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from meltemi.core.errors import InputError
from meltemi.environment.site import Environment
from meltemi.report.tables import number
from meltemi.reports.blocks import Table
from meltemi.structure.members import blade_beam
from meltemi.turbine.definition import Turbine
from meltemi.validation.issues import moment
from meltemi.validation.measurements import MeasuredRecord
from meltemi.validation.selection import rated_rotor_speed

Float = NDArray[np.float64]
GRAVITY = Environment().gravity
"""[m/s^2]."""
Use = Literal["all", "range"]
"""Of a calibrated gauge all statistics are compared; of another one its standard deviation and equivalent load only."""
FLAP, EDGE = "root_moment_flap_{}", "root_moment_edge_{}"
TOWER = ("tower_base_moment_fore_aft", "tower_base_moment_side_side")
LEAST_RANGE = 0.1
"""Standard deviation of a gravity moment over the largest of them that a gauge needs for zero and gain."""
LEAST_APART = 0.05
"""Least singular value of both moments, in the same measure, that is needed to separate crosstalk."""
LEAST_SHARE = 0.5
"""Share of the variance of the readings that gravity must explain."""
LEAST_PARTS = 5
"""Revolutions or parts of a sweep."""
SLOW = 0.2
"""Rotor speed over rated speed, up to which centrifugal loads are below a hundredth of the weight's."""


@dataclass(frozen=True)
class Calibration:
    """Zero and gain of two gauges with half-widths of their 95 % intervals.

    Attributes:
      channels: names of the gauges.
      zero, zero_half: (2,) readings without load, in the unit of the readings.
      gain, gain_half: (2, 2) C: moments [N m] per reading; crosstalk off the diagonal.
      use: of each gauge.
      parts: number of revolutions or parts of a sweep.
      angle_error: [rad] estimated error of azimuth or yaw, which the fit does not correct.
      date: [s] since 1970.
      notes: what could not be determined, and why.
    """

    channels: tuple[str, str]
    zero: Float
    zero_half: Float
    gain: Float
    gain_half: Float
    use: tuple[Use, Use]
    parts: int
    angle_error: float
    date: float = 0.0
    notes: tuple[str, ...] = field(default=())

    def moments(self, readings: Float) -> Float:
        """(T, 2) moments [N m] of (T, 2) readings; NaN for gauges that are not calibrated."""
        calibrated = np.array([use == "all" for use in self.use])
        return np.asarray(np.where(calibrated, readings - self.zero, 0.0) @ self.gain.T)


def first_moment(turbine: Turbine) -> Float:
    """(3,) [kg m] first moment of mass of a blade about its root, in blade axes at zero pitch (V-5)."""
    beam = blade_beam(turbine.blade.structure)

    def density(z: Float) -> Float:
        M = beam.at(z, "mass")
        offset = np.stack([M[:, 5, 1], -M[:, 5, 0], M[:, 4, 0]], axis=1)  # mass times centre from the axis
        return np.asarray(M[:, :1, 0] * beam.at(z, "axis") + offset)

    z = beam.position
    ends, middle = density(z), density(0.5 * (z[1:] + z[:-1]))  # linear mass and axis: Simpson's rule is exact
    return np.asarray((np.diff(z)[:, None] / 6.0 * (ends[1:] + 4.0 * middle + ends[:-1])).sum(axis=0))


def root_moments(turbine: Turbine, azimuth: Float, pitch: Float, gravity: float = GRAVITY) -> Float:
    """(T, 2) flapwise and edgewise moment [N m] of a blade's weight at its root, in pitched blade axes (V-6, V-7).

    Args:
      turbine: its blade, precone and tilt.
      azimuth: (T,) [rad] of this blade.
      pitch: (T,) [rad].
      gravity: [m/s^2].
    """
    tilt, cone = turbine.nacelle.tilt, turbine.hub.precone
    along, down = gravity * np.sin(tilt), gravity * np.cos(tilt)
    outward = -down * np.cos(azimuth)
    x = along * np.cos(cone) + outward * np.sin(cone)
    y = -down * np.sin(azimuth)
    z = outward * np.cos(cone) - along * np.sin(cone)
    x, y = np.cos(pitch) * x - np.sin(pitch) * y, np.sin(pitch) * x + np.cos(pitch) * y
    S = first_moment(turbine)
    return np.stack([S[2] * x - S[0] * z, S[1] * z - S[2] * y], axis=-1)


def overhanging_mass(turbine: Turbine) -> Float:
    """(2,) [kg m] first moment of rotor and nacelle about the yaw axis: x downwind, y to the left (V-8)."""
    nacelle, hub, n = turbine.nacelle, turbine.hub, turbine.n_blades
    beam = blade_beam(turbine.blade.structure)
    blade = float(np.trapezoid(beam.mass[:, 0, 0], beam.position))
    S = first_moment(turbine)
    along = (
        n * (np.cos(hub.precone) * S[0] - np.sin(hub.precone) * (S[2] + blade * hub.radius))
        + hub.mass * hub.mass_centre
    )
    x = np.cos(nacelle.tilt) * (along - (n * blade + hub.mass) * nacelle.overhang)
    return np.array([x + nacelle.mass * nacelle.mass_centre[0], nacelle.mass * nacelle.mass_centre[1]])


def tower_moments(turbine: Turbine, yaw: Float, gravity: float = GRAVITY) -> Float:
    """(T, 2) fore-aft and side-to-side moment [N m] of rotor and nacelle at the tower base over the yaw angle (V-9)."""
    x, y = overhanging_mass(turbine)
    c, s = np.cos(yaw), np.sin(yaw)
    return gravity * np.stack([x * c - y * s, -(x * s + y * c)], axis=-1)


def calibrate(
    channels: tuple[str, str],
    readings: Float,
    moments: Float,
    turned: Float,
    parts: NDArray[np.intp],
    date: float = 0.0,
) -> Calibration:
    """Zero and gain of two gauges from their readings under gravity (V-10, V-11).

    Args:
      channels: names of the gauges.
      readings: (T, 2) in any unit, NaN where one is missing.
      moments: (T, 2) [N m] of gravity.
      turned: (T, 2) [N m/rad] their derivatives by azimuth or yaw.
      parts: (T,) number of the revolution, or part of a sweep, of each sample.
      date: [s] since 1970.

    Raises:
      InputError: there are too few parts, or a gauge has the wrong sign.
    """
    finite = np.all(np.isfinite(readings), axis=1)
    M, s, part = moments[finite], readings[finite], parts[finite]
    known = np.unique(part)
    if len(known) < LEAST_PARTS:
        raise InputError(f"{channels[0]}: {len(known)} revolutions or parts of a sweep; {LEAST_PARTS} are needed")
    size = float(np.max(np.abs(M)))
    shape = M - M.mean(axis=0)
    deviation = np.sqrt(np.mean(shape**2, axis=0)) / size
    coupled = float(np.linalg.svd(shape, compute_uv=False)[-1]) / np.sqrt(len(M)) / size >= LEAST_APART
    free = np.full((2, 2), coupled) | np.eye(2, dtype=bool)
    scale = np.array([1.0, size, size])
    design = np.column_stack([np.ones(len(M)), M]) / scale
    grams = np.stack([design[part == k].T @ np.column_stack([design, s])[part == k] for k in known])
    best = _fit(grams.sum(axis=0), free, scale)
    left = np.stack([_fit(grams.sum(axis=0) - gram, free, scale).ravel() for gram in grams])
    n = len(known)
    quantile = float(student.ppf(0.975, n - 1))
    half = quantile * np.sqrt((n - 1.0) / n * np.sum((left - left.mean(axis=0)) ** 2, axis=0))
    zero, gain, notes = best[0].copy(), best[1:].copy(), []
    use: list[Use] = []
    K = np.linalg.pinv(gain)
    rest = s - zero - M @ K.T
    for i, name in enumerate(channels):
        share = 1.0 - float(np.var(rest[:, i]) / max(np.var(s[:, i]), 1e-300))
        if deviation[i] < LEAST_RANGE:
            why = f"gravity moves it by {100.0 * deviation[i]:.1f} % of its largest moment only; turn at another pitch"
        elif share < LEAST_SHARE:
            why = f"gravity explains {100.0 * max(share, 0.0):.0f} % of its variance only"
        else:
            if gain[i, i] + half[2 + 3 * i] < 0.0:
                raise InputError(
                    f"{name}: the reading falls where the moment of gravity grows; give sign: -1, or correct the "
                    "direction of azimuth or yaw"
                )
            use.append("all")
            continue
        use.append("range")
        notes.append(f"{name}: not calibrated: {why}; only its standard deviation and equivalent load are compared")
    if not coupled:
        notes.append(
            "crosstalk cannot be separated: the moments of both gauges are proportional; turn at two pitch angles"
        )
    unknown = [i for i in range(2) if use[i] == "range"]
    gain[:, unknown] = 0.0  # and without that gauge no crosstalk of the other one
    half = np.vstack([half[:2], half[2:].reshape(2, 2)])
    zero[unknown], gain[unknown], half[0, unknown], half[1:][unknown] = np.nan, np.nan, np.nan, np.nan
    error = _angle_error(turned[finite] @ K.T, rest, M, [i for i in range(2) if use[i] == "all"])
    return Calibration(channels, zero, half[0], gain, half[1:], (use[0], use[1]), n, error, date, tuple(notes))


def _fit(gram: Float, free: NDArray[np.bool_], scale: Float) -> Float:
    """Rows: zero (2,), and C (2, 2), by least squares of the readings over the moments.

    Args:
      gram: (3, 5) products of the columns of the design, which are one and the moments, with it and the readings.
      free: (2, 2) which moments each gauge may feel.
      scale: (3,) of the columns.
    """
    rows = np.zeros((2, 3))
    for i in range(2):
        at = np.flatnonzero(np.append(True, free[i]))
        rows[i, at] = np.linalg.lstsq(gram[np.ix_(at, at)], gram[at, 3 + i], rcond=None)[0] / scale[at]
    return np.vstack([rows[:, 0], np.linalg.pinv(rows[:, 1:])])


def _angle_error(turned: Float, rest: Float, M: Float, gauges: Sequence[int]) -> float:
    """[rad] by which the angle must grow for the least residual: one step of Gauss and Newton beside the fit (V-11)."""
    design = np.column_stack([np.ones(len(M)), M / np.max(np.abs(M))])
    free = turned - design @ np.linalg.lstsq(design, turned, rcond=None)[0]
    below = float(np.sum(free[:, gauges] ** 2))
    return float(np.sum(free[:, gauges] * rest[:, gauges]) / below) if below > 1e-12 * np.sum(turned**2) else np.nan


def calibrate_roots(records: Sequence[MeasuredRecord], turbine: Turbine, blade: int = 1) -> Calibration:
    """Flap and edge gauges of a blade root from records of slow rotation, at one or more pitch angles.

    Raises:
      InputError: a channel is missing, the rotor is too fast, there are too few revolutions, or a sign is wrong.
    """
    names = (FLAP.format(blade), EDGE.format(blade))
    readings, azimuths, pitches, parts = [], [], [], []
    count = 0
    for record in records:
        s, (azimuth, pitch) = _together(record, names, ("azimuth", f"pitch_{blade}"))
        psi = np.unwrap(azimuth)
        time = record[names[0]].time
        speed = abs(psi[-1] - psi[0]) / (time[-1] - time[0])
        if speed > SLOW * rated_rotor_speed(turbine):
            raise InputError(
                f"{record.file}: the rotor turns with {speed * 30.0 / np.pi:.3g} rpm; at most {100.0 * SLOW:g} % of "
                "rated speed is needed to calibrate by gravity"
            )
        turn = np.floor(np.abs(psi - psi[0]) / (2.0 * np.pi)).astype(np.intp)
        whole = turn < turn.max()
        readings.append(s[whole])
        azimuths.append(psi[whole] + 2.0 * np.pi * (blade - 1) / turbine.n_blades)
        pitches.append(pitch[whole])
        parts.append(turn[whole] + count)
        count += int(turn.max())
    psi, pitch = np.concatenate(azimuths), np.concatenate(pitches)
    M, turned = _and_derivative(lambda angle: root_moments(turbine, angle, pitch), psi)
    return calibrate(names, np.concatenate(readings), M, turned, np.concatenate(parts), records[0].begin)


def calibrate_tower(record: MeasuredRecord, turbine: Turbine, sectors: int = 12) -> Calibration:
    """Bending gauges of the tower base from a yaw sweep in low wind.

    Args:
      record: with both gauges and ``nacelle_yaw``.
      turbine: its rotor and nacelle.
      sectors: of a revolution, which are left out one at a time for the intervals.

    Raises:
      InputError: a channel is missing, the sweep is too short, or a sign is wrong.
    """
    s, (yaw,) = _together(record, TOWER, ("nacelle_yaw",))
    sector = np.floor(yaw / (2.0 * np.pi) * sectors).astype(np.intp)
    M, turned = _and_derivative(lambda angle: tower_moments(turbine, angle), yaw)
    return calibrate(TOWER, s, M, turned, sector, record.begin)


def _and_derivative(moments: Callable[[Float], Float], angle: Float, step: float = 1e-4) -> tuple[Float, Float]:
    """Moments at angles and their derivatives by the angle."""
    return moments(angle), (moments(angle + step) - moments(angle - step)) / (2.0 * step)


def _together(record: MeasuredRecord, gauges: Sequence[str], angles: Sequence[str]) -> tuple[Float, list[Float]]:
    """Readings, and angles at their times: angles turn evenly between samples."""
    time = record[gauges[0]].time
    if len(time) < 2:
        raise InputError(f"{record.file}: {gauges[0]} has no samples")
    for name in gauges[1:]:
        if not np.array_equal(record[name].time, time):
            raise InputError(f"{record.file}: {name} and {gauges[0]} are of loggers with different time stamps")
    at_times = []
    for name in angles:
        signal, there = record[name], np.isfinite(record[name].values)
        if there.sum() < 2:
            raise InputError(f"{record.file}: {name} has no samples")
        at_times.append(np.interp(time, signal.time[there], np.unwrap(signal.values[there])))
    return np.stack([record[name].values for name in gauges], axis=1), at_times


def calibration_table(calibrations: Sequence[Calibration]) -> Table:
    """Zeros, gains and crosstalk with their intervals, and drift since the first calibration of the same gauges."""
    rows: list[list[str]] = []
    first: dict[str, Calibration] = {}
    for each in calibrations:
        begin = first.setdefault(each.channels[0], each)
        for i, name in enumerate(each.channels):
            zero, gain = (each.zero[i], each.zero_half[i]), (each.gain[i, i], each.gain_half[i, i])
            cross = each.gain[i, 1 - i] / each.gain[i, i]
            drift = "" if begin is each else "yes" if drifted(begin, each)[i] else "no"
            cells = [number(zero[0]), number(zero[1]), number(gain[0]), number(gain[1]), number(100.0 * cross)]
            rows.append([name, moment(each.date), *cells, number(np.degrees(each.angle_error)), drift, each.use[i]])
    head = "gauge|date (UTC)|zero|+/-|gain\nN m|+/-|crosstalk\n%|angle error\ndeg|drift|compared".split("|")
    note = "; ".join(dict.fromkeys(note for each in calibrations for note in each.notes))
    return Table(head, rows, "Calibration by gravity, 95 % intervals", text_columns=2, note=note)


def drifted(before: Calibration, after: Calibration) -> tuple[bool, bool]:
    """Whether zero or gain of each gauge differ by more than their intervals between two dates."""
    zero = np.abs(after.zero - before.zero) > np.hypot(after.zero_half, before.zero_half)
    gain = np.abs(after.gain - before.gain) > np.hypot(after.gain_half, before.gain_half)
    change = zero | np.diag(gain)
    return bool(change[0]), bool(change[1])
