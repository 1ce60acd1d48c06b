"""The periodic motion of a turbine in steady operation.

Under gravity, tilt, shear and tower influence every blade repeats the same motion once per revolution, and the tower at
B times that frequency:

    blade b:            q(psi) = sum_n c_n cos(n psi_b) + s_n sin(n psi_b),  n = 0..H
    tower, yaw, shaft:  the same in the rotor's azimuth with n = 0, B

Harmonic balance solves for it: march the flow around the azimuth with this motion prescribed, project the residuals of
the equations of motion on the harmonics, correct the motion with the linearised equations, repeat.

Reference: docs/theory/simulation.md (M-10 to M-16).
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.tables import AeroOptions, InflowState
from meltemi.compiler import by_address, kernel, typeof, without_dispatch
from meltemi.simulation.bladed.rotor import BladedModel, channels_at_instants, with_static_gears
from meltemi.simulation.case import Case
from meltemi.simulation.loop import NUMBER
from meltemi.simulation.operating_point import NotConverged, OperatingPoint
from meltemi.simulation.step import ABSURD, equations, settle_induction
from meltemi.simulation.system import System
from meltemi.turbine.imbalance import deviations
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]

BLADE_HARMONICS = 4
SAMPLES = 12
"""Azimuths per sector of 1/B revolution."""
SWEEPS = 3
"""Sectors marched, each with a correction of the motion, at each trial rotor speed and pitch."""
UNLIKE_SWEEPS = 3 * SWEEPS
"""Sectors marched for blades that differ: a balance over one revolution, after revolutions in which they settle."""
JACOBIAN_SAMPLES, UNLIKE_SAMPLES = 5, 10
"""Azimuths per sector at which derivatives are evaluated: enough to tell products of two harmonics from a constant, and
where blades differ."""
PERTURBATION = 1e-3
"""[m or rad] perturbation of the coefficients for finite differences."""
MEAN_ONLY, FULL = 0, 1
"""Levels: only mean deflections during the search for speed and pitch; then all harmonics."""
FARTHEST = 0.05
"""Largest correction over the rotor radius in a careful search."""
SETTLED, NEARLY = 1e-5, 2e-3
"""Corrections over the rotor radius: of a converged motion, and the largest acceptable one."""
PITCH_SCAN = 0.05
"""[rad] spacing of the pitch angles of a search over the range of pitch."""
DIVERGES = "operating_point: the motion diverges"


@kernel
def residuals_of(
    dt: float, motion: Float, equations: Any, m: System, one: System, core: Float, blade: Float, lack: Float
) -> None:
    """Residuals of the equations of motion at consecutive instants of a motion.

    Args:
      dt: [s] interval between the instants.
      motion: (3, instants, coordinates) coordinates, velocities and accelerations.
      equations: the equations of motion, ``step.equations``, by address.
      m, one: the system, and the same node by node.
      core, blade: (instants, core), (instants, blades, modes) receive the residuals.
      lack: (2, blades, nodes) receives the sums of quasi-steady minus lagged induced velocity, normal and tangential.
    """
    A, D, C = one.core_mass, one.arm_mass, one.coupling  # of symmetric matrices the lower triangle is filled
    q, v, a, flow, inflow = one.q, one.v, one.a, one.flow, one.inflow
    for i in range(motion.shape[1]):
        for j in range(q.shape[0]):
            q[j], v[j], a[j] = motion[0, i, j], motion[1, i, j], motion[2, i, j]
        equations(0.0, dt, m)
        if dt > 0.0:
            settle_induction(m)
        for j in range(core.shape[1]):
            core[i, j] = one.core_force[j]
            for k in range(core.shape[1]):
                core[i, j] -= A[max(j, k), min(j, k)] * motion[2, i, k]
        for b in range(blade.shape[1]):
            first = core.shape[1] + b * blade.shape[2]
            for k in range(blade.shape[2]):
                blade[i, b, k] = one.arm_force[b, k]
                for n in range(blade.shape[2]):
                    blade[i, b, k] -= D[b, max(k, n), min(k, n)] * motion[2, i, first + n]
                for j in range(core.shape[1]):
                    blade[i, b, k] -= C[b, k, j] * motion[2, i, j]
                    core[i, j] -= C[b, k, j] * motion[2, i, first + k]
        for b in range(flow.blades):
            for n in range(flow.nodes):
                lack[0, b, n] += flow.steady_axial[b, n] * flow.vx[b, n] - inflow.x[b, n]
                lack[1, b, n] += flow.steady_tangential[b, n] * flow.vy[b, n] - inflow.y[b, n]


@dataclass(frozen=True)
class Waves:
    """Harmonics at azimuths.

    Attributes:
      core: (3, azimuths, 4) that give the motion of the core, its rate and acceleration at unit rotor speed from the
        coefficients 1, cos B psi, 0, sin B psi.
      blade: (3, azimuths blades, 2 H + 2) that give those of the blades, cosines before sines.
      of_core, of_blade: (3, azimuths), (2 H + 1, azimuths blades) that project residuals on them.
    """

    core: Float
    blade: Float
    of_core: Float
    of_blade: Float


@lru_cache(maxsize=64)
def harmonics(instants: bytes, blades: int) -> Waves:
    """Harmonics at azimuths of a rotor, given by their bytes, which recur from revolution to revolution."""

    def rates(order: Float, angle: Float) -> Float:
        """Cosines and sines of harmonics (N,) of angles (M,), and their first two derivatives: (3, M, 2 N)."""
        c, s = np.cos(order * angle[:, None]), np.sin(order * angle[:, None])
        values = np.concatenate([c, s], axis=1), np.concatenate([-order * s, order * c], axis=1)
        return np.stack([*values, -(np.tile(order, 2) ** 2) * values[0]])

    azimuths = np.frombuffer(instants)
    core = rates(np.array([0.0, blades]), azimuths)
    of_blades = (azimuths[:, None] + 2.0 * np.pi / blades * np.arange(blades)).ravel()
    blade = rates(np.arange(BLADE_HARMONICS + 1.0), of_blades)
    of_core, of_blade = (np.delete(each[0], each.shape[2] // 2, axis=1).T / len(azimuths) for each in (core, blade))
    of_core[1:] *= 2.0
    of_blade[0] *= 0.5
    return Waves(core, blade, of_core, 2.0 / blades * of_blade)


class Orbit:
    """The periodic motion of a model in a steady wind, improved sector by sector."""

    def __init__(self, model: BladedModel, wind: SteadyWind) -> None:
        self.model, self.wind = model, wind
        self.case = Case(with_static_gears(model), wind)
        self.equations = by_address(equations, NUMBER, NUMBER, typeof(self.case.system))
        self.case.control.drive.yaw_held = 1.0  # a free nacelle has no steady direction
        self.B, self.K = model.n_blades, len(model.rotor.blade.names)
        self.core = model.n_core
        self.generator = model.rows.generator
        self.torsion = model.rows.torsion
        free = model.locked == 0.0
        self.free_core = np.flatnonzero(free[: self.core] & (np.arange(self.core) != self.generator))
        self.free_blade = np.flatnonzero(free[self.core : self.core + self.K])
        # cosine and sine coefficients; those of a blade in its azimuth, those of the core for harmonics 0 and B
        self.coefficients = np.zeros(2 * (2 * self.core + (BLADE_HARMONICS + 1) * self.K))
        self.core_c, self.core_s, self.blade_c, self.blade_s = self.groups(self.coefficients)
        self.core_c[0] = self.undeflected = self.case["q"][: self.core].copy()
        # individual deviations of the blades from it in the mean, for they differ if not all have ice
        self.deviation = np.zeros((self.B, self.K))
        self.azimuth = 0.0
        self.speed = self.pitch = self.torque = 0.0
        self.farthest, self.moved = np.inf, 0.0
        self.level = MEAN_ONLY
        self.correct: dict[int, Float] = {}
        self.lefts: deque[float] = deque(maxlen=self.B)
        # near their roots blades may settle in different flow states, so that sectors keep differing
        self.unlike = self.uneven = not model.turbine.blades_alike
        # quasi-steady minus lagged induced velocity, summed over a sector
        self.lack = np.zeros((2, *self.case.one.flow.array.shape[1:]))
        # of each sector: residuals, velocities, and residuals of each blade minus their mean over the blades
        self.parts: list[tuple[Float, Float, Float]] = []
        self.lead = model.parameter("aerodynamics.inflow_lead")

    # motion -------------------------------------------------------------------------------------

    def prescribe(self, psi: float) -> None:
        """Set coordinates, velocities and accelerations of the motion at rotor azimuth ``psi``."""
        case, motion = self.case, self.motion(np.array([psi]))
        case["q"][:], case["v"][:], case["a"][:] = motion[:, 0]

    def motion(self, azimuths: Float, coefficients: Float | None = None) -> Float:
        """(..., 3, azimuths, coordinates) coordinates, velocities and accelerations of the motion.

        All azimuths at once, since time in Python is time that threads wait.

        Args:
          coefficients: (..., coefficients) of several motions; by default those of the present one.
        """
        w, waves = self.speed, harmonics(azimuths.tobytes(), self.B)
        each = self.coefficients if coefficients is None else coefficients
        lead, n = each.shape[:-1], len(azimuths)
        core, blade = np.split(each, [4 * self.core], axis=-1)
        result = np.empty((*lead, 3, n, len(self.case["q"])))
        result[..., : self.core] = waves.core @ core.reshape(*lead, 1, 4, self.core)
        arms = waves.blade @ blade.reshape(*lead, 1, 2 * (BLADE_HARMONICS + 1), self.K)
        result[..., self.core :] = arms.reshape(*lead, 3, n, self.B * self.K)
        q, v, a = (result[..., i, :, :] for i in range(3))
        q[..., self.core :] += self.deviation.ravel()
        v *= w
        a *= w**2
        q[..., self.generator] = azimuths - q[..., self.torsion]
        v[..., self.generator] = w - v[..., self.torsion]
        a[..., self.generator] = -a[..., self.torsion]
        return result

    def residuals(self, motion: Float, dt: float) -> tuple[Float, Float]:
        """Residuals of the equations at consecutive azimuths: (azimuths, core), (azimuths, blades, modes).

        Args:
          motion: (3, azimuths, coordinates), as :meth:`motion` returns it.
          dt: [s] interval between the azimuths; 0 holds inflow and stall.
        """
        case, n = self.case, motion.shape[1]
        core, blade = np.empty((n, self.core)), np.empty((n, self.B, self.K))
        self.lack[:] = 0.0
        self._residuals_of(dt, motion, self.equations, case.system, case.one, core, blade, self.lack)
        return core, blade

    @cached_property
    def _residuals_of(self) -> Any:
        two, three = np.empty((1, 1)), np.empty((1, 1, 1))
        records = self.case.system, self.case.one
        return without_dispatch(residuals_of, 0.0, three, self.equations, *records, two, three, self.lack)

    # corrections --------------------------------------------------------------------------------

    def groups(self, each: Any) -> tuple[Any, Any, Any, Any]:
        """Views of a vector of all coefficients: cosines and sines of the core, of a blade, by harmonic."""
        core, blade = np.split(each, [4 * self.core])
        return *core.reshape(2, 2, -1), *blade.reshape(2, BLADE_HARMONICS + 1, -1)

    @cached_property
    def free(self) -> NDArray[np.intp]:
        """Places of the free coefficients among all, for ``free_core`` and ``free_blade`` as they are at first use."""
        core_c, core_s, blade_c, blade_s = self.groups(np.arange(len(self.coefficients)))
        core, blade = self.free_core, self.free_blade
        parts = core_c[:, core], core_s[1, core], blade_c[:, blade], blade_s[1:, blade]
        return np.concatenate([part.ravel() for part in parts])

    def move(self, change: Float) -> None:
        """Add a change to the free coefficients.

        Raises:
          NotConverged: the motion diverges.
        """
        if not np.all(np.abs(change) < ABSURD):
            raise NotConverged(DIVERGES)
        self.coefficients[self.free] += change

    def projected(self, azimuths: Float, core: Float, blade: Float) -> Float:
        """Residuals (..., azimuths, core), (..., azimuths, blades, modes) on the harmonics, ordered as :attr:`free`.

        Raises:
          NotConverged: the motion diverges.
        """
        if not (np.isfinite(core).all() and np.isfinite(blade).all()):
            raise NotConverged(DIVERGES)
        waves, lead = harmonics(azimuths.tobytes(), self.B), core.shape[:-2]
        of_core, of_blade = waves.of_core @ core, waves.of_blade @ blade.reshape(*lead, len(azimuths) * self.B, self.K)
        parts = of_core[..., self.free_core], of_blade[..., self.free_blade]
        return np.concatenate([part.reshape(*lead, -1) for part in parts], axis=-1)

    def unknowns(self) -> NDArray[np.intp]:
        """Indices of the coefficients that are corrected at the present level."""
        core, blade = len(self.free_core), len(self.free_blade)
        if self.level == MEAN_ONLY:
            return np.concatenate([np.arange(core), 3 * core + np.arange(blade)])
        return np.arange(3 * core + (2 * BLADE_HARMONICS + 1) * blade)

    def linearise(self) -> None:
        """Compute the derivatives of the residuals by the coefficients, with inflow held and static polars."""
        options, stall = self.case["aero_options"], AeroOptions.index("stall")
        kept, options[stall] = options[stall], 0
        n = UNLIKE_SAMPLES if self.unlike else JACOBIAN_SAMPLES
        self.differentiate(2.0 * np.pi / self.B / n * np.arange(n, dtype=float), 0.0)
        options[stall] = kept

    def differentiate(self, azimuths: Float, dt: float) -> None:
        """Compute derivatives at azimuths; ``dt`` [s] as for :meth:`residuals`."""
        air = self.case.aero_state.vector
        state = air.copy()
        unknowns = self.unknowns()
        each = np.repeat(self.coefficients[None], 1 + len(unknowns), axis=0)
        each[np.arange(1, len(each)), self.free[unknowns]] += PERTURBATION
        residuals = []
        for motion in self.motion(azimuths, each):
            if dt:
                air[:] = state
            residuals.append(self.residuals(motion, dt))
        air[:] = state
        rows = self.projected(azimuths, *map(np.array, zip(*residuals, strict=True)))[:, unknowns]
        try:
            self.correct[self.level] = np.asarray(np.linalg.inv((rows[1:] - rows[0]).T / PERTURBATION), dtype=float)
        except np.linalg.LinAlgError:
            raise NotConverged(DIVERGES) from None

    def mean_correction(self) -> Float:
        """(free modes, free modes) correction of a blade's mean deflection for unit residuals of its equations."""
        core, blade = len(self.free_core), len(self.free_blade)
        begin = core if self.level == MEAN_ONLY else 3 * core
        result: Float = self.correct[self.level][begin : begin + blade, begin : begin + blade]
        return result

    def impose(self, speed: float, pitch: float, torque: float) -> None:
        """Set rotor speed [rad/s], pitch [rad] and generator torque [N m]."""
        case = self.case
        self.parts.clear()
        self.speed = speed
        case["pitch"][:] = 0.0
        self.pitch = pitch
        case.view("pitch")["angle"] = pitch + deviations(self.model.turbine, "pitch")
        case.control.drive.generator_torque = self.torque = torque

    def sweep(self, speed: float, pitch: float, torque: float) -> float:
        """March sectors and correct the motion after each; returns the mean residual torque [N m]."""
        self.impose(speed, pitch, torque)
        if not self.correct:
            self.prescribe(0.0)
            self.case.settle(0.0)
        if self.level not in self.correct:
            for _ in range(2):
                self.linearise()
                self.sector()
        for _ in range(UNLIKE_SWEEPS if self.unlike else SWEEPS):
            self.sector()
        return self.left

    @property
    def left(self) -> float:
        """Mean residual torque [N m], of the last sector or of the last revolution."""
        return self.over_revolution if self.unlike else self.lefts[-1]

    @property
    def over_revolution(self) -> float:
        """Mean residual torque [N m] of the last B sectors."""
        return sum(self.lefts) / len(self.lefts)

    @property
    def step(self) -> float:
        """[rad] step between the azimuths of a sector, in the sense of rotation."""
        return float(np.copysign(2.0 * np.pi / self.B / SAMPLES, self.speed))

    def sector(self) -> None:
        """March 1/B revolution, and correct motion and mean inflow; for blades that differ after each revolution.

        Over a revolution the forces that turn with such a rotor cancel out on the tower.
        """
        case, B = self.case, self.B
        step = self.step
        azimuths = self.azimuth + step * np.arange(1.0, SAMPLES + 1.0)
        core, blade = self.residuals(self.motion(azimuths), step / self.speed)
        missing = self.projected(azimuths, core, blade)
        self.azimuth = step * SAMPLES * ((round(self.azimuth / (step * SAMPLES)) + 1) % B)
        self.lefts.append(float(core[:, self.generator].mean()))
        inflow = case["inflow"]
        lack = self.lack[..., : inflow.shape[-1]]
        if self.uneven:
            self.parts.append((missing, lack.copy(), blade.mean(axis=0) - blade.mean(axis=(0, 1))))
            if len(self.parts) < B:
                return
            missing, lack, residuals = (np.mean(parts, axis=0) for parts in zip(*self.parts, strict=True))
            self.parts.clear()
            self.deviation[:, self.free_blade] -= residuals[:, self.free_blade] @ self.mean_correction().T
        else:
            lack = lack.mean(axis=1, keepdims=True)
        lack = lack / SAMPLES
        change = np.zeros(len(missing))
        unknowns = self.unknowns()
        change[unknowns] = -self.correct[self.level] @ missing[unknowns]
        self.moved = float(np.max(np.abs(change), initial=0.0))
        if self.moved > self.farthest:
            change *= self.farthest / self.moved
        self.move(change)
        # dynamic inflow has time constants of many seconds: set its azimuthal mean to the steady value at once
        for i, (reduced, velocity) in enumerate((("reduced_x", "x"), ("reduced_y", "y"))):
            inflow[InflowState.index(velocity)] += lack[i]
            inflow[InflowState.index(reduced)] += (1.0 - self.lead) * lack[i]

    # result -------------------------------------------------------------------------------------

    def unstable(self) -> str:
        """Result of ``growing`` of ``meltemi.analyses.modes`` with blade 1 up."""
        self.prescribe(0.0)
        unstable: str = import_module("meltemi.analyses.modes").growing(self.case)
        return unstable

    def finish(self, azimuth: float = 0.0, warnings: tuple[str, ...] = ()) -> OperatingPoint:
        """March one more revolution, average all signals, and store the state with blade 1 up.

        Args:
          azimuth, warnings: azimuth and warnings of the operating point.
        """
        case, B = self.case, self.B
        # approach azimuth 0 with the flow that belongs to it
        while self.azimuth:
            self.sector()
        step = self.step
        means, mean_torque = np.zeros_like(case.signals.vector), 0.0
        rows = []
        azimuths = step * np.arange(1.0, B * SAMPLES + 1.0)
        evaluate = without_dispatch(equations, 0.0, 0.0, case.system)
        for i, (case["q"][:], case["v"][:], case["a"][:]) in enumerate(zip(*self.motion(azimuths), strict=True)):
            evaluate(0.0, step / self.speed, case.system)
            case.control.drive.generator_torque = self.torque
            if case.parts or not i:
                case.begin_parts()
            mean_torque += float(case.control.drive.generator_torque) / (B * SAMPLES)
            case.loads(0.0)
            means += case.signals.vector / (B * SAMPLES)
            rows.append(np.concatenate([case["q"], case["v"], case.aero_states()]))
            rows[-1][self.generator] -= azimuths[i]
        aero = case.aero_states()
        self.prescribe(0.0)
        model = self.model
        channels = channels_at_instants(model)
        revolution = np.roll(rows, 1, axis=0)
        if self.speed < 0.0:  # order by rising azimuth
            revolution[1:] = revolution[:0:-1].copy()
        return OperatingPoint(
            wind=self.wind,
            rotor_speed=self.speed,
            pitch=self.pitch,
            generator_speed=self.speed * model.turbine.drivetrain.gear_ratio,
            generator_torque=self.torque,
            imbalance=self.over_revolution + model.turbine.drivetrain.gear_ratio * (self.torque - mean_torque),
            q=case["q"].copy(),
            v=case["v"].copy(),
            aero=aero,
            revolution=revolution,
            means=means,
            channels=channels,
            places={name: case.place(channel) for name, channel in channels.items()},
            warnings=warnings,
            azimuth=azimuth,
        )
