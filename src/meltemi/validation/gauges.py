"""Calibration of strain gauges by gravity: blade roots by slow rotations at idle, the tower base by yaw sweeps.

The readings s of two gauges are fitted to the known moments M of gravity, s = s_0 + K M; then M = C (s - s_0) with
C = K^-1. Intervals are Student's, from the estimates that leave out one revolution, or part of a sweep, at a time.

Reference: docs/theory/validation.md (V-5 to V-11).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from typing import Literal

import numpy as np
from scipy.integrate import simpson
from scipy.spatial.transform import Rotation
from scipy.stats import t as student

from meltemi.core.errors import InputError
from meltemi.environment.site import Environment
from meltemi.report.tables import number
from meltemi.reports.blocks import Table
from meltemi.structure.members import blade_beam
from meltemi.turbine.definition import Turbine
from meltemi.validation.measurements import Float, MeasuredRecord, moment
from meltemi.validation.selection import rated_rotor_speed

GRAVITY = Environment().gravity  # [m/s^2]
Use = Literal["all", "range"]
"""Of a calibrated gauge all statistics are compared; of another one its standard deviation and equivalent load only."""
FLAP, EDGE = "root_moment_flap_{}", "root_moment_edge_{}"
TOWER = ("tower_base_moment_fore_aft", "tower_base_moment_side_side")
LEAST_RANGE = 0.1  # standard deviation of a gravity moment over the largest one, for zero and gain of its gauge
LEAST_APART = 0.05  # least singular value of both moments, in the same measure, to separate crosstalk
LEAST_SHARE = 0.5  # of the variance of the readings that gravity must explain
LEAST_PARTS = 5  # revolutions, or sectors of a yaw sweep
SECTORS = 12  # of a yaw sweep, which are left out one at a time
SLOW = 0.2  # rotor speed over rated speed, up to which centrifugal loads are below a hundredth of the weight's


@dataclass(frozen=True)
class Calibration:
    """Zero and gain of two gauges with half-widths of their 95 % intervals."""

    channels: tuple[str, str]
    zero: Float  # (2,) readings without load, in the unit of the readings
    zero_half: Float
    gain: Float  # (2, 2) C: moments [N m] per reading; crosstalk off the diagonal
    gain_half: Float
    use: tuple[Use, ...]  # of each gauge
    parts: int  # number of revolutions or sectors
    date: float  # [s] since 1970
    notes: tuple[str, ...]  # what could not be determined, and why

    def moments(self, readings: Float) -> Float:
        """(T, 2) moments [N m] of (T, 2) readings; NaN for gauges that are not calibrated."""
        calibrated = np.array([use == "all" for use in self.use])
        return np.asarray(np.where(calibrated, readings - self.zero, 0.0) @ self.gain.T)


def first_moment(turbine: Turbine) -> Float:
    """(3,) [kg m] first moment of mass of a blade about its root, in blade axes at zero pitch (V-5)."""
    beam = blade_beam(turbine.blade.structure)
    ends = beam.position
    z = np.sort(np.concatenate([ends, 0.5 * (ends[1:] + ends[:-1])]))  # linear mass and axis: Simpson's rule is exact
    M = beam.at(z, "mass")
    offset = np.stack([M[:, 5, 1], -M[:, 5, 0], M[:, 4, 0]], axis=1)  # mass times centre from the axis
    return np.asarray(simpson(M[:, :1, 0] * beam.at(z, "axis") + offset, x=z, axis=0))


def root_moments(turbine: Turbine, azimuth: Float, pitch: Float) -> Float:
    """(T, 2) flapwise and edgewise moment [N m] of a blade's weight at its root, in pitched blade axes (V-6, V-7).

    Both angles (T,) [rad] are those of the blade.
    """
    shaft, cone = (Rotation.from_euler("y", angle) for angle in (turbine.nacelle.tilt, -turbine.hub.precone))
    blade = shaft * Rotation.from_euler("x", azimuth[:, None]) * cone * Rotation.from_euler("z", -pitch[:, None])
    return np.cross(first_moment(turbine), blade.inv().apply([0.0, 0.0, -GRAVITY]))[..., [1, 0]]


def overhanging_mass(turbine: Turbine) -> Float:
    """(2,) [kg m] first moment of rotor and nacelle about the yaw axis: x downwind, y to the left (V-8)."""
    nacelle, hub, n = turbine.nacelle, turbine.hub, turbine.n_blades
    beam, S = blade_beam(turbine.blade.structure), first_moment(turbine)
    blade = float(np.trapezoid(beam.mass[:, 0, 0], beam.position))
    blades = n * (np.cos(hub.precone) * S[0] - np.sin(hub.precone) * (S[2] + blade * hub.radius))
    along = blades + hub.mass * hub.mass_centre - (n * blade + hub.mass) * nacelle.overhang
    x, y, _ = nacelle.mass * np.asarray(nacelle.mass_centre)
    return np.array([np.cos(nacelle.tilt) * along + x, y])


def tower_moments(turbine: Turbine, yaw: Float) -> Float:
    """(T, 2) fore-aft and side-to-side moment [N m] of rotor and nacelle at the tower base over the yaw angle (V-9)."""
    x, y = overhanging_mass(turbine)
    c, s = np.cos(yaw), np.sin(yaw)
    return GRAVITY * np.stack([x * c - y * s, -(x * s + y * c)], axis=-1)


def calibrate(
    channels: tuple[str, str], readings: Float, moments: Float, parts: Float, date: float = 0.0
) -> Calibration:
    """Zero and gain of two gauges from their readings under gravity (V-10, V-11).

    Args:
      channels, date: names of the gauges; [s] since 1970.
      readings, moments: (T, 2) in any unit, NaN where one is missing; [N m] of gravity.
      parts: (T,) number of the revolution, or sector of a sweep, of each sample.

    Raises:
      InputError: there are too few parts, or a gauge has the wrong sign.
    """
    finite = np.all(np.isfinite(readings), axis=1)
    M, s, part = moments[finite], readings[finite], parts[finite]
    if (n := len(np.unique(part))) < LEAST_PARTS:
        raise InputError(f"{channels[0]}: {n} revolutions or parts of a sweep; {LEAST_PARTS} are needed")
    shape = (M - M.mean(axis=0)) / np.max(np.abs(M))
    coupled = bool(np.linalg.svd(shape, compute_uv=False)[-1] >= LEAST_APART * np.sqrt(len(M)))
    best = _fit(s, M, coupled)
    left = np.stack([_fit(s[part != k], M[part != k], coupled) for k in np.unique(part)])
    half = student.ppf(0.975, n - 1) * np.sqrt((n - 1.0) * left.var(axis=0))
    rest = s - best[0] - M @ np.linalg.pinv(best[1:]).T
    deviation, share = shape.std(axis=0), 1.0 - rest.var(axis=0) / np.maximum(s.var(axis=0), 1e-300)
    notes = []
    unmoved, unexplained = deviation < LEAST_RANGE, share < LEAST_SHARE
    unknown = unmoved | unexplained
    for i, name in enumerate(channels):
        if unknown[i]:
            moves, explains = 100.0 * deviation[i], 100.0 * max(share[i], 0.0)
            why = f"gravity explains {explains:.0f} % of its variance only"
            if unmoved[i]:
                why = f"gravity moves it by {moves:.1f} % of its largest moment only; turn at another pitch"
            notes.append(f"{name}: not calibrated: {why}; only its standard deviation and equivalent load are compared")
        elif best[1 + i, i] + half[1 + i, i] < 0.0:
            raise InputError(
                f"{name}: the reading falls where the moment of gravity grows; give sign: -1, or correct the direction "
                "of azimuth or yaw"
            )
    if not coupled:
        notes.append("crosstalk is not known: the moments of both gauges are proportional; turn at two pitch angles")
    best[1:, unknown] = 0.0  # and without that gauge no crosstalk of the other one
    for estimates in (best, half):
        estimates[0, unknown] = estimates[1:][unknown] = np.nan
    use: list[Use] = ["range" if each else "all" for each in unknown]
    return Calibration(channels, best[0], half[0], best[1:], half[1:], tuple(use), n, date, tuple(notes))


def _fit(s: Float, M: Float, coupled: bool) -> Float:
    """Rows: zero (2,), and C (2, 2), by least squares of the readings over the moments that each gauge may feel."""
    size = np.max(np.abs(M))
    design, rows = np.column_stack([np.ones(len(M)), M / size]), np.zeros((3, 2))
    for i in range(2):
        feels = [0, 1, 2] if coupled else [0, 1 + i]
        rows[feels, i] = np.linalg.lstsq(design[:, feels], s[:, i], rcond=None)[0]
    return np.vstack([rows[0], size * np.linalg.pinv(rows[1:].T)])


def calibrate_roots(records: Sequence[MeasuredRecord], turbine: Turbine, blade: int = 1) -> Calibration:
    """Flap and edge gauges of a blade root from records of slow rotation, at one or more pitch angles.

    Raises:
      InputError: a channel is missing, the rotor is too fast, there are too few revolutions, or a sign is wrong.
    """
    names = (FLAP.format(blade), EDGE.format(blade))
    whole_turns, count = [], 0
    for record in records:
        s, psi, pitch = _together(record, names, ("azimuth", f"pitch_{blade}"))
        turn = np.abs(psi - psi[0]) / (2.0 * np.pi)
        if (speed := 2.0 * np.pi * turn[-1] / np.ptp(record[names[0]].time)) > SLOW * rated_rotor_speed(turbine):
            raise InputError(
                f"{record.file}: the rotor turns with {speed * 30.0 / np.pi:.3g} rpm; at most {100.0 * SLOW:g} % of "
                "rated speed is needed to calibrate by gravity"
            )
        M, turns = root_moments(turbine, psi + 2.0 * np.pi * (blade - 1) / turbine.n_blades, pitch), int(turn.max())
        whole_turns.append([x[turn < turns] for x in (s, M, count + np.floor(turn))])
        count += turns
    s, M, turn = (np.concatenate(of_records) for of_records in zip(*whole_turns, strict=True))
    return calibrate(names, s, M, turn, records[0].begin)


def calibrate_tower(record: MeasuredRecord, turbine: Turbine) -> Calibration:
    """Bending gauges of the tower base from a yaw sweep in low wind, by both gauges and ``nacelle_yaw``.

    Raises:
      InputError: a channel is missing, the sweep is too short, or a sign is wrong.
    """
    s, yaw = _together(record, TOWER, ("nacelle_yaw",))
    return calibrate(TOWER, s, tower_moments(turbine, yaw), np.floor(yaw / (2.0 * np.pi) * SECTORS), record.begin)


def calibrations_of(
    records: Sequence[MeasuredRecord], turbine: Turbine, idle: Sequence[str], sweeps: Sequence[str]
) -> list[Calibration]:
    """Calibrations of all gauges, one for each pattern of files: slow rotations at idle of one date, and yaw sweeps.

    Raises:
      InputError: no file matches, or as of :func:`calibrate_roots` and :func:`calibrate_tower`.
    """
    result = []
    for pattern in (*idle, *sweeps):
        some = [record for record in records if fnmatch(record.file, pattern)]
        if not some:
            raise InputError(f"calibration: no record {pattern!r}; the first one is {records[0].file!r}")
        if pattern in sweeps:
            result.append(calibrate_tower(some[0], turbine))
            continue
        for b in range(1, turbine.n_blades + 1):
            if {FLAP.format(b), EDGE.format(b)} <= some[0].signals.keys():
                result.append(calibrate_roots(some, turbine, b))
    return result


def in_moments(records: Sequence[MeasuredRecord], calibrations: Sequence[Calibration]) -> list[MeasuredRecord]:
    """The records with calibrated gauges in N m, by the calibration of the nearest date."""
    changed = []
    for record in records:
        signals = dict(record.signals)
        for channels in {each.channels for each in calibrations if set(each.channels) <= signals.keys()}:
            nearest = min((c for c in calibrations if c.channels == channels), key=lambda c: abs(c.date - record.begin))
            moments = nearest.moments(np.stack([record[name].values for name in channels], axis=1))
            for name, use, values in zip(channels, nearest.use, moments.T, strict=True):
                signals[name] = replace(signals[name], values=values) if use == "all" else signals[name]
        changed.append(replace(record, signals=signals))
    return changed


def _together(record: MeasuredRecord, gauges: tuple[str, str], angles: Sequence[str]) -> list[Float]:
    """Readings of both gauges, and angles at their times: angles turn evenly between samples."""
    time = record[gauges[0]].time
    if not np.array_equal(record[gauges[1]].time, time):
        raise InputError(f"{record.file}: {gauges[1]} and {gauges[0]} are of loggers with different time stamps")
    together = [np.stack([record[name].values for name in gauges], axis=1)]
    for name in angles:
        signal, there = record[name], np.isfinite(record[name].values)
        if min(there.sum(), len(time)) < 2:
            raise InputError(f"{record.file}: {name} or {gauges[0]} has no samples")
        together.append(np.interp(time, signal.time[there], np.unwrap(signal.values[there])))
    return together


def calibration_table(calibrations: Sequence[Calibration]) -> Table:
    """Zeros, gains and crosstalk with their intervals, and drift since the first calibration of the same gauges."""
    rows: list[list[str]] = []
    first: dict[str, Calibration] = {}
    for c in calibrations:
        begin = first.setdefault(c.channels[0], c)
        for i, name in enumerate(c.channels):
            values = c.zero[i], c.zero_half[i], c.gain[i, i], c.gain_half[i, i], 100.0 * c.gain[i, 1 - i] / c.gain[i, i]
            drift = "" if begin is c else "yes" if drifted(begin, c)[i] else "no"
            rows.append([name, moment(c.date), *map(number, values), drift, c.use[i]])
    head = "gauge|date (UTC)|zero|+/-|gain\nN m|+/-|crosstalk\n%|drift|compared".split("|")
    note = "; ".join(dict.fromkeys(note for each in calibrations for note in each.notes))
    return Table(head, rows, "Calibration by gravity, 95 % intervals", text_columns=2, note=note)


def drifted(before: Calibration, after: Calibration) -> tuple[bool, bool]:
    """Whether zero or gain of each gauge differ by more than their intervals between two dates."""
    zero = np.abs(after.zero - before.zero) > np.hypot(after.zero_half, before.zero_half)
    gain = np.abs(after.gain - before.gain) > np.hypot(after.gain_half, before.gain_half)
    flap, edge = zero | np.diag(gain)
    return bool(flap), bool(edge)
