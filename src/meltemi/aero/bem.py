"""Blade-element momentum at one blade node, solved for the inflow angle.

Following Ning (2014) the balance of momentum is one equation in the inflow angle phi. With
sigma' = B c / (2 pi r), kappa = sigma' C_x / (4 F), s = sin(phi), c = cos(phi), and with g, the flow
through the annulus over the speed of the relative wind,

    V_y s / (1 - a) = V_x (c - sigma' C_y / (4 F g)),    s / (1 - a) = s + kappa / g

    s / (1 - a) = s + kappa / s                                    momentum (g = s), kappa <= 2/3 s^2
                = (5/3 - F) s + sqrt(2 F kappa - (4/3 - F) F s^2)  Buhl (2005) beyond

The second form is Buhl's parabola solved for 1 / (1 - a): smooth through phi = 0, where a = 1, and
valid beyond, so with it a solution exists for every wind and rotor speed in -pi/4 < phi < 3 pi/4 (without
it there is a pole at phi = 0). Its g stays above zero there, so drag in C_y makes no pole and no second
solution. Flow from behind and backward rotation are mirrored into that range.

Reference: docs/theory/aerodynamics.md (A-5 to A-15, A-56 to A-58); Ning (2014), Eqs. 5-14; Buhl (2005), Eq. 17; Madsen
et al. (2020).
"""

from __future__ import annotations

from math import acos, atan2, cos, exp, pi, sin, sqrt, tan
from typing import NamedTuple

from meltemi.aero.air import Air
from meltemi.aero.polars import coefficient, locate
from meltemi.compiler import anywhere, beyond, held, kernel, reverse, where

PHI_LOW, PHI_HIGH = -0.25 * pi, 0.75 * pi
RESCUE, BISECTIONS = 1e-6, 48
"""Residual beyond which bisections follow, and their number: to the resolution of the bracket."""
ROUNDING = 1e-12
"""[-], [rad] residual of a solution; by this a step may leave the bracket, which has no width at convergence."""
LEAST_SLOPE = 1e-3
"""Least slope of the residual for derivatives."""
LEAST_SECANT = 1e-10
"""[rad] step below which the slope stays: rounding would spoil it."""
LOSS_FLOOR = 1e-4
"""Smallest loss factor."""
LEAST_FLOW, TINY = 0.3, 1e-6
"""Minimum flow through the annulus over |s|, below all that occurs where a > 1 (A-10), and absolute minimum."""
NUDGE = 1e-8
"""[rad] step of the slopes that derivatives of the solution take."""
SKEW_STEPS = 12
"""Newton steps for the axial flow in skewed momentum."""
HALF_WAKE = 0.6
"""Half the skew angle of the wake over that of the wind, 1 + 0.6 a at a = 1/3 (A-27)."""
LEAST_SKEW, MOST_SKEW = 0.02, 10.0
"""Range of the tangent of the skew angle; below, the flow is axial to 2e-4."""
STILL = 1e-3
"""[m/s] below which the air counts as still."""
MADSEN = 2
"""Value of ``AeroOptions.high_induction``."""
K1, K2, K3 = 0.2460, 0.0586, 0.0883
"""Coefficients of a = K1 C + K2 C^2 + K3 C^3 at the thrust coefficient C (Madsen et al. 2020)."""
TURNED = 0.7710083186826041
"""1 / sqrt(C) where a = 1, so that no air passes."""
TURNED_SLOPE = 1.0 + (K1 + (3.0 * K2 + 5.0 * K3 / TURNED**2) / TURNED**2) / TURNED**2
MADSEN_STEPS = 5
"""Newton steps of Madsen's balance: to rounding, from the guess."""
LEAST_PASSAGE = 0.5
"""Least flow through the annulus over that of the thrust, below all of a < 0.75, with Madsen's polynomial (A-58)."""


class Strip(NamedTuple):
    """Input of the momentum balance at a strip of the rotor.

    Attributes:
      vx, vy: [m/s] relative wind without induction, normal to the strip and along it.
      theta: [rad] pitch and twist.
      solidity: blades times chord over circumference.
      tip_number, hub_number: parameters of Prandtl's loss factor.
      polar: index of the polar.
      skew: tangent of the angle between wind and shaft, for Glauert's momentum in skewed flow.
      lean: cosine of the angle between the strip's normal and the shaft, for Madsen's momentum.
    """

    vx: float
    vy: float
    theta: float
    solidity: float
    tip_number: float
    hub_number: float
    polar: int
    skew: float
    lean: float


class Onset(NamedTuple):
    """The relative wind without induction, mirrored into the range of the solution.

    Attributes:
      sin, cos: |V_x| and |V_y| over the speed: of the inflow angle without induction.
      mirror_x, mirror_y: signs of V_x and V_y.
    """

    sin: float
    cos: float
    mirror_x: float
    mirror_y: float


class Balance(NamedTuple):
    """Both sides of the momentum balance at a trial inflow angle.

    Attributes:
      residual: left minus right side, over the speed of the relative wind.
      axial: s / (1 - a).
      tangential: c / (1 + a').
      sin, cos: sine and cosine of the trial angle, s and c.
    """

    residual: float
    axial: float
    tangential: float
    sin: float
    cos: float


class Induction(NamedTuple):
    """Solution at one node.

    Attributes:
      a, ap: axial and tangential induction factor.
      phi, slope: inflow angle [rad], and slope of the residual there.
      residual: residual of the last evaluation.
    """

    a: float
    ap: float
    phi: float
    slope: float
    residual: float


@kernel
def loss_factor(tip_number: float, hub_number: float, sin_phi: float) -> float:
    """Prandtl's factor F for tip and hub (A-9)."""
    s = max(sin_phi, 1e-9)
    return max((4.0 / (pi * pi)) * end_angle(tip_number, s) * end_angle(hub_number, s), LOSS_FLOOR)


@kernel
def end_angle(number: float, s: float) -> float:
    """Loss at one end: arc cos(exp(-number / s)), which is a right angle far from it."""
    angle = 0.5 * pi
    if anywhere(number < 40.0 * s):
        angle = acos(exp(-number / s))
    return angle


@kernel
def skewed_axial(s: float, kappa: float, skew: float) -> float:
    """Ratio s / (1 - a) of Glauert's skewed momentum, (y - s) sqrt(s^2 + skew^2 y^2) = kappa, by Newton (A-10a)."""
    k = max(kappa, 0.0)
    ahead = max(s, 0.0) + min(sqrt(k / skew), k / max(s, TINY))
    # reversed flow whose thrust does not turn it: from the other side, where r falls towards y = 0
    y = where(k < -s * abs(s), s + k / (max(abs(s), TINY) * sqrt(1.0 + skew * skew)), ahead)
    for _ in range(SKEW_STEPS):
        r = max(sqrt(s * s + skew * skew * y * y), TINY)
        slope = r + max(y - s, 0.0) * skew * skew * y / r
        y -= ((y - s) * r - k) / max(slope, 0.2 * r)
    return y


@kernel
def cylinder_axial(s: float, kappa: float, added: float, along: float) -> float:
    """Ratio s / (1 - a) of a skewed vortex cylinder, (y - s) (added y + along s) = kappa (A-10b)."""
    k, p = max(kappa, 0.0), (along - added) * s
    return (sqrt(max(p * p + 4.0 * added * (along * s * s + k), 0.0)) - p) / (2.0 * added)


@kernel
def madsen_axial(s: float, kappa: float) -> float:
    """Ratio s / (1 - a) of Madsen's polynomial, 1 - s/y = K1 C + K2 C^2 + K3 C^3, C = 4 kappa / y^2 (A-57)."""
    scale = 2.0 * sqrt(max(kappa, TINY * TINY))
    t = max(s, 0.0) / scale
    y = 0.5 * (t + sqrt(t * t + 4.0 * TURNED * TURNED))
    for _ in range(MADSEN_STEPS):
        c = 1.0 / (y * y)
        y -= (y - (K1 + (K2 + K3 * c) * c) / y - t) / (1.0 + (K1 + (3.0 * K2 + 5.0 * K3 * c) * c) * c)
    # reversed flow along the tangent; a propeller by momentum theory
    turned = max(scale * y + min(s, 0.0) / TURNED_SLOPE, TINY)
    return where(kappa > 0.0, turned, where(s > 0.0, s + kappa / max(s, TINY), TINY))


@kernel
def balance(phi: float, strip: Strip, onset: Onset, m: Air) -> Balance:
    """The momentum balance at ``phi`` (A-6 to A-12)."""
    s, c = sin(phi), cos(phi)
    true_phi = onset.mirror_x * where(onset.mirror_y > 0.0, phi, pi - phi)
    at = locate(true_phi - strip.theta, m)
    cl, cd = coefficient(m.polars.lift, strip.polar, at), coefficient(m.polars.drag, strip.polar, at)
    lift = onset.mirror_x * onset.mirror_y * cl
    cx = lift * c + m.aero.axial_drag * cd * s
    F = loss_factor(strip.tip_number, strip.hub_number, abs(s))
    q = strip.solidity / (4.0 * F)
    kappa = q * cx
    high = (5.0 / 3.0 - F) * s + sqrt(max(2.0 * F * kappa - (4.0 / 3.0 - F) * F * s * s, 0.0))
    heavy = (s <= 0.0) | (m.aero_options.high_induction == 1) & (kappa > (2.0 / 3.0) * s * s)
    through = s
    if m.aero_options.skew_momentum > 0:
        if m.aero_options.skew_momentum == 1:
            y = skewed_axial(s, kappa, strip.skew)
            through = sqrt(s * s + strip.skew * strip.skew * y * y)
        else:
            lean = min(tan(HALF_WAKE * atan2(strip.skew, 1.0)), 1.0)
            added, along = lean * (strip.skew - lean), 1.0 + lean * lean
            y = cylinder_axial(s, kappa, added, along)
            through = added * y + along * s
        heavy = heavy & ((y > high) | (kappa <= 0.0))
    # the flow that takes up the thrust takes up the torque as well
    added = high - s
    flow = where(heavy, kappa / where(abs(added) > TINY, added, TINY), through)
    flow = max(flow, max(LEAST_FLOW * abs(s), TINY))
    axial = where(heavy, high, s + kappa / flow)
    if m.aero_options.high_induction == MADSEN:
        # momentum along the shaft; the blades' torque without loss factor, from the air that passes
        kappa *= strip.lean * strip.lean
        axial = madsen_axial(s, kappa)
        flow = max(s, LEAST_PASSAGE * max(kappa, 0.0) / max(axial - s, TINY))
        flow = max(flow, max(LEAST_FLOW * abs(s), TINY))
        q *= F * strip.lean
    cy = lift * s - m.aero.tangential_drag * cd * c
    # air that turns back under blades that push it on does not exist: there the balance is left open
    tangential = c - q * where(s > 0.0, cy, min(cy, 0.0)) / flow
    return Balance(onset.cos * axial - onset.sin * tangential, axial, tangential, s, c)


@kernel
def induction(phi: float, slope: float, strip: Strip, m: Air) -> Induction:
    """Solve the momentum balance by safeguarded secant steps from a guess, at least one (A-13 to A-15).

    The bracket [-pi/4, 3 pi/4] always holds a solution; a step that leaves the bracket becomes a
    bisection. Where the guess was so far off that the steps do not converge, as when the flow reverses, a
    fixed number of bisections follows.

    Args:
      phi, slope: guess of the solution [rad] and of the residual's slope there.
    """
    mirror_x, mirror_y = where(strip.vx >= 0.0, 1.0, -1.0), where(strip.vy >= 0.0, 1.0, -1.0)
    vx, vy = abs(strip.vx), abs(strip.vy)
    speed = max(sqrt(vx * vx + vy * vy), STILL)
    onset = Onset(vx / speed, vy / speed, mirror_x, mirror_y)
    x = min(max(phi, PHI_LOW + 1e-3), PHI_HIGH - 1e-3)
    slope = min(max(slope, 0.05), 50.0)
    now = balance(x, strip, onset, m)
    low, high = where(now.residual < 0.0, x, PHI_LOW), where(now.residual < 0.0, PHI_HIGH, x)
    axial_slope, tangential_slope = 0.0 * x, 0.0 * x
    # a solution stays: steps with a slope from the other side of a corner would drive it away
    most = ROUNDING
    for _ in range(m.aero_options.iterations - 1):
        open_ = beyond(now.residual, most)
        if not anywhere(open_):
            break
        most = max(m.aero.induction_tolerance, ROUNDING)
        step = x - now.residual / slope
        inside = (step >= low - ROUNDING) & (step <= high + ROUNDING)
        x_old, old = x, now
        x = where(open_, where(inside, step, 0.5 * (low + high)), x)
        now = balance(x, strip, onset, m)
        low, high = where(now.residual < 0.0, x, low), where(now.residual < 0.0, high, x)
        dx = x - x_old
        known = abs(dx) > LEAST_SECANT
        over = 1.0 / where(known, dx, 1.0)
        slope = where(known, min(max((now.residual - old.residual) * over, 0.05), 50.0), slope)
        axial_slope = where(known, (now.axial - old.axial) * over, axial_slope)
        tangential_slope = where(known, (now.tangential - old.tangential) * over, tangential_slope)
    lost = abs(now.residual) > max(m.aero.induction_tolerance, RESCUE)
    if anywhere(lost):
        for _ in range(BISECTIONS):
            x = where(lost, 0.5 * (low + high), x)
            now = balance(x, strip, onset, m)
            low, high = where(now.residual < 0.0, x, low), where(now.residual < 0.0, high, x)
    open_ = beyond(now.residual, ROUNDING)
    if reverse(x):
        # derivatives from a Newton step and the last one below: exact to the square of the error of the slopes (J-3a)
        x = held(x)
        old, now = balance(x, strip, onset, m), balance(x + NUDGE, strip, onset, m)
        slope = held(max((now.residual - old.residual) / NUDGE, LEAST_SLOPE))
        axial_slope = held((now.axial - old.axial) / NUDGE)
        tangential_slope = held((now.tangential - old.tangential) / NUDGE)
        x = where(lost, x, x - old.residual / slope)
        now = balance(x, strip, onset, m)
        open_ = now.residual == now.residual
    # a last secant step, along which both sides, sine and cosine are linear
    dx = where(open_, where(lost, 0.0, -now.residual / slope), 0.0)
    axial, tangential = now.axial + dx * axial_slope, now.tangential + dx * tangential_slope
    a = 1.0 - (now.sin + dx * now.cos) / where(abs(axial) > 1e-6, axial, 1e-6)
    ap = (now.cos - dx * now.sin) / where(abs(tangential) > 1e-6, tangential, 1e-6) - 1.0
    return Induction(min(max(a, -1.0), 1.5), min(max(ap, -1.0), 1.0), x + dx, slope, now.residual)
