"""Periodic motions by continuation, where the balance of harmonics does not converge at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.operating_point import NotConverged, no_balance
from meltemi.simulation.orbit import FARTHEST, NEARLY, PITCH_SCAN, SAMPLES, SETTLED, Orbit
from meltemi.structure.tower import STIFFNESS
from meltemi.wind.fields import SteadyWind

Float = NDArray[np.float64]

PATIENCE, FRESH, AGE = 90, 18, 3
"""Largest number of sectors to converge, initial sectors with new derivatives each, and sectors that reuse them."""
SHORTEST = 1.0 / 32.0
"""Smallest continuation step, as a fraction of the way from a motion to the next one."""
BENT = 0.25
"""Tip deflection over blade length beyond which the range of the blades' models ends."""


def in_steps(reach: Callable[[float], bool], state: Sequence[Float]) -> float:
    """Completed fraction of a path from 0 to 1, in steps that are halved after a failure.

    Args:
      reach: (fraction of the path) -> whether a state could be moved to it.
      state: arrays that are restored after a failure.
    """
    share, step = 0.0, 1.0
    while share < 1.0 and step >= SHORTEST:
        kept, tried = [part.copy() for part in state], min(share + step, 1.0)
        if reach(tried):
            share, step = tried, 2.0 * step
            continue
        for part, values in zip(state, kept, strict=True):
            part[:] = values
        step *= 0.5
    return share


class CarefulOrbit(Orbit):
    """The periodic motion by continuation, for motions that do not converge at once.

    From a converged motion the next speed, pitch and torque are reached in steps that are halved after a failure; the
    first motion is that in vacuum, from which the air density is raised. In overspeed the first motion is that at the
    reference speed: with a fraction of the air, a harmonic may meet a frequency on the way. Corrections are limited,
    and derivatives are recomputed as long as corrections do not shrink, with inflow and stall marched along: if held,
    they would damp a motion near resonance so much more that corrections would grow.
    """

    def __init__(self, model: BladedModel, wind: SteadyWind) -> None:
        super().__init__(model, wind)
        self.farthest = FARTHEST * model.turbine.rotor_radius
        self.air = float(self.case.plain.aero.air_density)
        self.at: Float | None = None

    def sweep(self, speed: float, pitch: float, torque: float) -> float:
        """Converge the motion; returns the mean residual torque [N m].

        Raises:
          NotConverged: the continuation does not reach it.
        """
        goal = np.array([speed, pitch, torque, self.air])
        if self.at is not None:
            try:
                self.follow(goal)
                return self.left
            except NotConverged:
                pass
        reference = self.model.turbine.rated_rotor_speed
        self.begin(float(np.clip(speed, -reference, reference)), pitch, torque)
        self.follow(goal)
        return self.left

    def begin(self, speed: float, pitch: float, torque: float) -> None:
        """Converge the motion from that in vacuum."""
        for part in (self.blade_c, self.blade_s, self.deviation, self.core_c, self.core_s):
            part[:] = 0.0
        self.core_c[0] = self.undeflected
        goal = np.array([speed, pitch, torque, self.air])
        self.at = goal * [1.0, 1.0, 1.0, 0.0]
        self.impose(speed, pitch, torque)
        self.prescribe(0.0)
        self.case.settle(0.0)
        self.follow(goal)

    def follow(self, goal: Float) -> None:
        """Continue the converged motion to another speed, pitch, torque and density of the air."""
        assert self.at is not None
        begin = self.at
        parts = [self.blade_c, self.blade_s, self.deviation, self.core_c, self.core_s, self.case.aero_state.vector]
        share = in_steps(lambda share: self.settle(begin + share * (goal - begin)), parts)
        self.at = begin + share * (goal - begin)
        if share < 1.0:
            raise NotConverged(self.cause(goal))

    def linearise(self) -> None:
        """Compute the derivatives over the next sector."""
        self.differentiate(self.azimuth + self.step * np.arange(1.0, SAMPLES + 1.0), self.step / self.speed)

    def settle(self, at: Float) -> bool:
        """Whether the motion converges at a speed, pitch, torque and density."""
        *imposed, self.case.plain.aero.air_density = at
        self.impose(*imposed)
        radius, before = self.model.turbine.rotor_radius, np.inf
        self.lefts.clear()
        try:
            for i in range(PATIENCE):
                if i % AGE == 0 and i < FRESH and (i == 0 or self.moved > 0.2 * before):
                    before = self.moved if i else np.inf
                    self.linearise()
                self.sector()
                if i >= FRESH and self.moved >= self.farthest:
                    return False
                if i >= self.B and self.moved < SETTLED * radius:
                    return True
        except NotConverged:
            return False
        return self.moved < NEARLY * radius

    def cause(self, goal: Float) -> str:
        """Reason for the lack of steady motion beyond the last converged one, on the way to a goal of ``follow``."""
        assert self.at is not None
        speed, pitch, _, density = self.at
        case, turbine = self.case, self.model.turbine
        *imposed, case.plain.aero.air_density = self.at
        self.impose(*imposed)
        where = (
            f"at a wind speed of {self.wind.speed:g} m/s, near a rotor speed of {30.0 / np.pi * speed:.3g} rpm and "
            f"a pitch of {np.degrees(pitch):.3g} deg"
        )
        if abs(goal[0] - speed) > 0.01 * abs(goal[0]):
            where += f" on the way to {30.0 / np.pi * goal[0]:.4g} rpm"
        if density < self.air:
            where += f", with {100.0 * density / self.air:.0f} % of the aerodynamic loads"
        tip = float(np.linalg.norm(self.model.rotor.tip_shape[:3] @ self.blade_c[0]))
        unstable = self.unstable()
        begin = f"operating_point: no steady operation {where}: "
        if unstable:
            return begin + f"the machine is aeroelastically unstable there, {unstable}"
        if tip > BENT * turbine.blade.length:
            return begin + (
                f"the blades deflect by {tip:.3g} m of their {turbine.blade.length:.3g} m, beyond the range of their "
                "model; less wind, feathered blades (meltemi.analysis.parked_point) or stiffer blades help"
            )
        if loose := self.unsupported():
            return begin + (
                f"the foundation has no stiffness against {', '.join(loose)}; if the body below the tower has none "
                f"either, hold it: options.locked: {loose}"
            )
        modal = self.model.options.blade_model == "modal"
        exact = "other blades than options.blade_model 'modal' may help; " if modal else ""
        return begin + (
            f"the search does not converge beyond; {exact}a simulation can start from initial conditions instead "
            "(start=meltemi.Start(...))"
        )

    def unsupported(self) -> list[str]:
        """Free motions of the base that the foundation does not hold; a platform floats."""
        model = self.model
        stiffness = np.diag(model.rotor.tower_matrix[STIFFNESS])
        motions = zip(model.coordinates[: model.rows.yaw], model.locked, stiffness, strict=False)
        if model.turbine.platform is not None:
            return []
        return [name for name, locked, k in motions if name.startswith("base ") and not locked and k == 0.0]


def balance_carefully(
    balance_speed: Callable[..., tuple[float, float, bool]],
    left_over: Callable[[float, float], float],
    reference: float,
    pitch: float,
    most: float,
    stalled: float,
    wind_speed: float,
    rain: str,
) -> tuple[float, float, bool]:
    """Balance as ``balance_speed``, but from feather on: at fine pitch there may be no steady motion."""
    failed: list[NotConverged] = []

    def torque(speed: float, angle: float) -> float:
        try:
            return left_over(speed, angle)
        except NotConverged as error:
            failed.append(error)
            return float("nan")

    for angle in (*np.arange(most, pitch, -PITCH_SCAN), pitch):
        value = torque(reference, float(angle))
        if value > 0.0:
            return reference, float(angle), True
        if not np.isfinite(value):
            break
    try:
        return balance_speed(torque, reference, pitch, pitch, stalled, wind_speed, rain)
    except InputError:
        raise failed[0] if failed else no_balance(wind_speed, rain) from None
