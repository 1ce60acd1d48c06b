"""Tests of the paper's equations on the components of its controllers."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot, pi

import numpy as np

from meltemi.aero.flaps import ALPHAS, DELTAS, STEP
from meltemi.aero.tables import FlapIncrement
from meltemi.control.feedforward import blade_wind, weight, weight_settings
from meltemi.control.filters import response
from meltemi.control.multiblade import blade_angle, to_blade, to_fixed
from meltemi.simulation.rotors import build
from meltemi.simulation.trim import operating_point
from meltemi.turbine.flaps import DEFLECTION
from meltemi.turbine.flaps import LIFT as LIFT_TABLE
from meltemi_papers.he2018.runs import FAST_MODEL, SHEAR, SPEED, Runs

RADIUS, HUB = 42.0, 90.0
"""[m] of the weights, and of the hub in the paper's turbine."""


@dataclass(frozen=True)
class Check:
    """A value that follows from the paper's equations, and ours.

    Attributes:
      item: what it is.
      expected: value, as the equation gives it.
      found: ours.
      tolerance: largest difference.
      unit: of both.
    """

    item: str
    expected: float
    found: float
    tolerance: float
    unit: str = "-"

    @property
    def ok(self) -> bool:
        """The value is within the tolerance."""
        return abs(self.found - self.expected) <= self.tolerance


def checks(runs: Runs) -> list[Check]:
    """All checks."""
    return [*_wind(), *_multiblade(), *_filters(), *_limits(runs), *_steady(runs), *_polars(runs)]


def _wind() -> list[Check]:
    plain = weight_settings(radius=RADIUS, hub_height=HUB, shear=SHEAR)
    tower = weight_settings(radius=RADIUS, hub_height=HUB, shear=0.0, tower_radius=2.0, clearance=5.0)
    shares = np.array([[weight(plain, i, 3, psi) for i in range(3)] for psi in np.linspace(0.0, 2.0 * pi, 361)])
    return [
        Check("(1) wind at 132 m over that at 90 m", 1.0796, float(blade_wind(plain, 0.0)), 1e-4),
        Check("(1) wind at 48 m over that at 90 m", 0.8819, float(blade_wind(plain, pi)), 1e-4),
        Check("(2) tower shadow 5 m before a tower of 4 m", 0.84, float(blade_wind(tower, pi)), 1e-4),
        Check("(10) sum of the weights", 3.0, float(shares.sum(axis=1)[100]), 1e-9),
        Check("(9) smallest weight", 0.790, float(shares.min()), 2e-3),
        Check("(9) largest weight", 1.180, float(shares.max()), 2e-3),
    ]


def _multiblade() -> list[Check]:
    found = []
    for n in (1, 2):
        worst, crosstalk = 0.0, []
        for psi in np.linspace(0.0, 2.0 * pi, 73):
            angles = [n * blade_angle(psi, i, 3) for i in range(3)]
            x = np.array([2.0 * np.cos(a) - 0.7 * np.sin(a) for a in angles])
            tilt, yaw = to_fixed(x, 3, psi, n)
            back = [to_blade(tilt, yaw, i, 3, psi, n, 0.0) for i in range(3)]
            worst = max(worst, abs(tilt - 2.0), abs(yaw + 0.7), *np.abs(np.array(back) - x))
            one = np.array([np.cos(blade_angle(psi, i, 3)) for i in range(3)])
            crosstalk.append(to_fixed(one, 3, psi, 2))
        found.append(Check(f"(13), (14) {n}P there and back, largest error", 0.0, float(worst), 1e-9))
    size = [hypot(*pair) for pair in crosstalk]
    turned = np.unwrap([atan2(pair[1], pair[0]) for pair in crosstalk])
    found.append(Check("1P in coordinates of 2P: amplitude", 1.0, float(np.mean(size)), 1e-9))
    found.append(Check("1P in coordinates of 2P: frequency", 3.0, abs(turned[-1] - turned[0]) / (2.0 * pi), 1e-9, "P"))
    return found


def _filters() -> list[Check]:
    speed, found = 1.2671, []
    for n in (1, 2):
        gain = response("band_pass", n * speed, n * speed, 0.25, 0.0125)
        found.append(Check(f"(15), (20) band-pass at {n}P: gain", 1.0, abs(gain), 1e-6))
        found.append(Check(f"(15), (20) band-pass at {n}P: phase", 0.0, atan2(gain.imag, gain.real), 1e-6, "rad"))
    return found


def _limits(runs: Runs) -> list[Check]:
    """Largest excess of rates and angles over their limits, over all schemes with the first seed."""
    turbine = runs.bench.model.turbine
    pitch, flap = turbine.pitch_actuator, turbine.blade.flaps[0]
    excess = {"pitch rate": 0.0, "pitch angle": 0.0, "flap rate": 0.0, "flap angle": 0.0}
    for c in (*runs.readings.values(), *runs.speeds.values()):
        for scheme in c.schemes:
            result = c.results(scheme)
            for name, low, high, rate in (
                ("pitch", pitch.minimum, pitch.maximum, pitch.rate_limit),
                ("flap", flap.minimum, flap.maximum, flap.rate),
            ):
                x = result["pitch_1" if name == "pitch" else "flap_1_angle_1"]
                fastest = float(np.abs(np.diff(x)).max() / (result.time[1] - result.time[0]))
                excess[f"{name} rate"] = max(excess[f"{name} rate"], fastest - rate)
                excess[f"{name} angle"] = max(excess[f"{name} angle"], float(x.max()) - high, low - float(x.min()))
    return [Check(f"(19), (24) {name} beyond its limit", 0.0, value, 1e-6, "rad") for name, value in excess.items()]


def _steady(runs: Runs) -> list[Check]:
    point = operating_point(runs.bench.model, SPEED)
    stiff = operating_point(build(runs.bench.model.turbine, FAST_MODEL), SPEED)
    power = point.generator_torque * point.rotor_speed * runs.bench.model.turbine.drivetrain.gear_ratio
    return [
        Check("steady at 20 m/s: pitch", 17.47, np.degrees(point.pitch), 0.7, "deg"),
        Check("steady at 20 m/s: pitch, blades stiff in torsion", 17.47, np.degrees(stiff.pitch), 0.7, "deg"),
        Check("steady at 20 m/s: rotor speed", 12.1, point.rotor_speed * 30.0 / pi, 0.06, "rpm"),
        Check("steady at 20 m/s: mechanical power", 5.297, power / 1e6, 0.053, "MW"),
    ]


def _polars(runs: Runs) -> list[Check]:
    """Largest difference between flap lift increments and the table, over all its angles."""
    grid = runs.bench.model.rotor.increments[0, :, FlapIncrement.index("lift")].reshape(ALPHAS, DELTAS)
    worst = 0.0
    for row in LIFT_TABLE.strip().splitlines():
        alpha, *lift = (float(word) for word in row.split())
        i = round(np.radians(alpha) / STEP + 0.5 * (ALPHAS - 1))
        for delta, value in zip(DEFLECTION, lift, strict=True):
            k = round(np.radians(delta) / STEP + 0.5 * (DELTAS - 1))
            worst = max(worst, abs(float(grid[i, k]) - (value - lift[DEFLECTION.index(0.0)])))
    return [Check("Fig. 4: lift increments, largest difference", 0.0, worst, 0.03)]
