"""Polars from the shape of an airfoil: NeuralFoil below stall, Viterna's extension beyond (A-59, A-60).

Reference: docs/theory/aerodynamics.md. Sharpe & Hansman (2025), NeuralFoil; Viterna & Corrigan (1982), Fixed pitch
rotor performance of large horizontal axis wind turbines; Montgomerie (2004), FOI-R-1305-SE.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError
from meltemi.core.extras import need
from meltemi.postprocess.inputs import floats, number
from meltemi.turbine.definition import Airfoil

Float = NDArray[np.float64]

NETWORK = "xlarge"
REYNOLDS = (1e4, 1e8)
GAP = 0.05
"""Largest gap of the trailing edge over the chord."""
FEW = 20
"""Least number of points of a shape."""
SEARCH = np.radians(np.arange(-24.0, 24.01, 0.5))
"""[rad] angles of attack at which NeuralFoil is asked."""
FULL = np.radians(np.concatenate([np.arange(-180.0, -30.0, 5.0), np.arange(-30.0, 30.0), np.arange(30.0, 180.1, 5.0)]))
"""[rad] angles of attack of the polar."""
BACKWARDS = 0.7
"""Lift of an airfoil from behind, and of the negative side in deep stall, over that of Viterna."""


def polar_of_shape(
    coordinates: ArrayLike,
    reynolds: float,
    *,
    aspect_ratio: float = 10.0,
    n_crit: float = 9.0,
    trip: float = 1.0,
) -> Airfoil:
    """Polar of an airfoil over the full circle from its shape, for smooth surfaces and low Mach number.

    Below stall coefficients are those of NeuralFoil, a fit to XFOIL; beyond the angles of largest and smallest lift
    those of Viterna and Corrigan. They are two-dimensional: ``options.rotational_augmentation`` acts on them in a
    simulation.

    Args:
      coordinates: (P, 2) along the chord and across it, from the trailing edge round to it, on either side first.
      reynolds: Reynolds number of the chord, 1e4 to 1e8.
      aspect_ratio: of the blade, for its drag across the wind: radius over chord at three quarters of it.
      n_crit: exponent of transition, 9 in a wind tunnel, less in turbulence or with dirt.
      trip: place over the chord, on both sides, at which the flow becomes turbulent, if it is not yet; 0.05 for dirt.

    Raises:
      InputError: the shape is open or crosses itself, or the Reynolds number is out of range.
      MissingPackageError: NeuralFoil is not installed.
    """
    shape = checked_shape(coordinates)
    if not REYNOLDS[0] <= number(reynolds, "polar_of_shape: reynolds") <= REYNOLDS[1]:
        raise InputError(f"polar_of_shape: reynolds {reynolds:g}: expected 1e4 to 1e8")
    need("polar_of_shape", "neuralfoil")
    import neuralfoil

    found = neuralfoil.get_aero_from_coordinates(
        shape,
        alpha=np.degrees(SEARCH),
        Re=float(reynolds),
        n_crit=n_crit,
        xtr_upper=trip,
        xtr_lower=trip,
        model_size=NETWORK,
    )
    lift, drag, moment = (np.asarray(found[name], dtype=float) for name in ("CL", "CD", "CM"))
    low, high = stall_limits(lift)
    part = slice(low, high + 1)
    cl, cd, cm = extended_polar(SEARCH[part], lift[part], drag[part], moment[part], aspect_ratio)
    sure = float(np.min(np.asarray(found["analysis_confidence"])[part]))
    thickness = float(np.ptp(np.stack(sides(shape)), axis=0).max())
    return Airfoil(
        angle_of_attack=FULL,
        lift=cl,
        drag=cd,
        moment=cm,
        relative_thickness=round(thickness, 4),
        source=f"NeuralFoil {NETWORK}, Re {float(reynolds):.3g}, n_crit {n_crit:g}, trip {trip:g}, confidence "
        f"{sure:.2f}; Viterna beyond {np.degrees(SEARCH[low]):.1f} and {np.degrees(SEARCH[high]):.1f} deg",
    )


def checked_shape(coordinates: ArrayLike) -> Float:
    """A shape with chord 1 along the first axis, over its upper side first.

    Raises:
      InputError: it is no closed curve without crossings.
    """
    x = floats(coordinates, "polar_of_shape: coordinates")
    if x.ndim != 2 or x.shape[1] != 2 or len(x) < FEW or not np.all(np.isfinite(x)):
        raise InputError(f"polar_of_shape: coordinates must be {FEW} pairs or more, found the shape {x.shape}")
    edge = 0.5 * (x[0] + x[-1])
    nose = x[int(np.argmax(np.hypot(*(x - edge).T)))]
    along = edge - nose
    chord = float(np.hypot(*along))
    gap = float(np.hypot(*(x[0] - x[-1]))) / max(chord, 1e-300)
    if gap > GAP:
        raise InputError(
            f"polar_of_shape: the shape is not closed: its ends are {100.0 * gap:.0f} % of the chord apart; it must "
            "begin and end at the trailing edge"
        )
    c, s = along / chord
    x = (x - nose) @ np.array([[c, -s], [s, c]]) / chord
    middle = int(np.argmin(x[:, 0]))
    if x[: middle + 1, 1].mean() < x[middle:, 1].mean():
        x = x[::-1]
    a, b = x[:-1], x[1:]
    d = b - a
    # crossings of pieces that do not follow each other: ends of each on both sides of the other
    side = d[:, None, 0] * (x[None, :, 1] - a[:, None, 1]) - d[:, None, 1] * (x[None, :, 0] - a[:, None, 0])
    apart = side[:, :-1] * side[:, 1:] < -1e-20
    cross = np.triu(apart & apart.T, 2)
    if cross.any():
        i, j = np.argwhere(cross)[0]
        raise InputError(
            f"polar_of_shape: the shape crosses itself near {x[i][0]:.3g}, {x[i][1]:.3g} of the chord "
            f"(points {i + 1} and {j + 1}): list the points in order round it"
        )
    return x


def sides(shape: Float) -> tuple[Float, Float]:
    """Upper and lower side at 100 places along the chord."""
    middle, at = int(np.argmin(shape[:, 0])), np.linspace(0.01, 0.99, 100)
    upper, lower = shape[: middle + 1][::-1], shape[middle:]
    return np.interp(at, *upper.T), np.interp(at, *lower.T)


def stall_limits(lift: Float) -> tuple[int, int]:
    """Places of the first minimum and maximum of lift on both sides of zero angle of attack."""
    zero = len(lift) // 2
    high, low = zero, zero
    while high + 1 < len(lift) and lift[high + 1] > lift[high]:
        high += 1
    while low > 0 and lift[low - 1] < lift[low]:
        low -= 1
    return low, high


def viterna(alpha: Float, stall: float, lift: float, drag: float, aspect_ratio: float) -> tuple[Float, Float]:
    """Lift and drag beyond stall, to a right angle (A-59).

    Args:
      alpha: [rad] from ``stall`` to pi/2.
      stall, lift, drag: angle [rad] and coefficients at stall.
      aspect_ratio: of the blade.
    """
    most, s, c = 1.11 + 0.018 * aspect_ratio, np.sin(stall), np.cos(stall)
    a2, b2 = (lift - most * s * c) * s / c**2, (drag - most * s * s) / c
    sine, cosine = np.sin(alpha), np.cos(alpha)
    return most * sine * cosine + a2 * cosine**2 / sine, most * sine**2 + b2 * cosine


def extended_polar(
    alpha: Float, lift: Float, drag: Float, moment: Float, aspect_ratio: float
) -> tuple[Float, Float, Float]:
    """Lift, drag and moment at ``FULL`` from those between the angles of stall (A-59, A-60).

    Args:
      alpha: (N,) [rad] from the smallest to the largest lift; lift, drag, moment: (N,) coefficients.
      aspect_ratio: of the blade.
    """
    values = [np.interp(FULL, alpha, x) for x in (lift, drag, moment)]
    for sign, end in ((1.0, -1), (-1.0, 0)):
        stall, weight = sign * alpha[end], 1.0 if sign > 0.0 else BACKWARDS
        angle = sign * FULL
        front = (angle > stall) & (angle <= 0.5 * np.pi + 1e-9)
        behind = angle > 0.5 * np.pi + 1e-9
        cl, cd = viterna(angle[front], stall, sign * lift[end], drag[end], aspect_ratio)
        share = (angle[front] - stall) / (0.5 * np.pi - stall)  # full lift at stall
        values[0][front] = sign * cl * (1.0 + share * (weight - 1.0))
        values[1][front] = cd
        # from behind the flow sees a sharp nose: that of the mirrored angle, to zero at half a turn
        mirrored = np.clip(np.pi - angle[behind], 1e-6, None)
        cl, cd = viterna(np.maximum(mirrored, stall), stall, sign * lift[end], drag[end], aspect_ratio)
        values[0][behind] = -sign * BACKWARDS * cl * np.minimum(mirrored / stall, 1.0)
        values[1][behind] = np.where(
            mirrored < stall, np.interp(mirrored, [0.0, stall], [2.0 * drag.min(), drag[end]]), cd
        )
        beyond = front | behind
        normal = values[0][beyond] * np.cos(FULL[beyond]) + values[1][beyond] * np.sin(FULL[beyond])
        place = 0.5 - 0.175 * (1.0 - 2.0 / np.pi * angle[beyond])
        pressed, fade = -normal * (place - 0.25), np.clip((angle[beyond] - stall) / np.radians(20.0), 0.0, 1.0)
        values[2][beyond] = (1.0 - fade) * moment[end] + fade * pressed
    return values[0], values[1], values[2]
