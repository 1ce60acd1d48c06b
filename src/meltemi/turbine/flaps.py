"""The flap of He et al. (2018) on the NREL 5 MW: data, and turbines with flaps.

Increments of a NACA 64-618 with a flap of 10 % of the chord: XFOIL 6.99, Re 8e6, M 0.15, Ncrit 9, hinge at
mid-thickness. Increments are used because the polar of the section has been corrected for rotation and stall.
"""

from __future__ import annotations

import numpy as np

from meltemi.turbine.definition import Flap, FlapIncrements, Turbine

DEFLECTION = (-15.0, -10.0, -5.0, 0.0, 5.0, 10.0, 15.0)
"""[deg] deflections."""
LIFT = """
    -10 -1.188 -1.016 -0.835 -0.655 -0.485 -0.377 -0.349
     -8 -0.997 -0.812 -0.624 -0.435 -0.258 -0.136 -0.087
     -6 -0.785 -0.594 -0.399 -0.205 -0.021  0.114  0.180
     -4 -0.562 -0.366 -0.166  0.032  0.222  0.374  0.459
     -2 -0.333 -0.134  0.070  0.274  0.475  0.644  0.728
      0 -0.104  0.097  0.309  0.519  0.716  0.877  0.963
      2  0.128  0.338  0.551  0.759  0.953  1.104  1.190
      4  0.369  0.580  0.790  0.979  1.153  1.281  1.367
      6  0.608  0.806  0.991  1.166  1.307  1.424  1.517
      8  0.817  1.000  1.169  1.313  1.442  1.567  1.663
     10  0.956  1.125  1.278  1.436  1.568  1.697  1.788
     12  1.044  1.230  1.384  1.538  1.670  1.794  1.877
     14  1.113  1.322  1.478  1.630  1.752  1.869  1.941
"""
"""Angle of attack [deg], then lift coefficients at the deflections."""
DRAG = (0.0056, 0.0047, 0.0045, 0.0046, 0.0048, 0.0052, 0.0061)
MOMENT = (0.0016, -0.039, -0.082, -0.124, -0.163, -0.194, -0.209)
"""Moment coefficients at zero angle of attack about the quarter chord, at the deflections."""


def naca64618_flap() -> Flap:
    """Trailing-edge flap of He et al. (2018): 66 to 96 % of the span, 10 % of the chord, +-15 deg, 40 deg/s."""
    rows = np.array([[float(word) for word in line.split()] for line in LIFT.strip().splitlines()])
    zero = DEFLECTION.index(0.0)
    lift = rows[:, 1:]
    return Flap(
        begin=0.66,
        end=0.96,
        chord_fraction=0.1,
        minimum=float(np.radians(-15.0)),
        maximum=float(np.radians(15.0)),
        rate=float(np.radians(40.0)),
        frequency=62.8,
        damping=0.7,
        increments=FlapIncrements(
            angle_of_attack=np.radians(rows[:, 0]),
            deflection=np.radians(DEFLECTION),
            lift=lift - lift[:, zero : zero + 1],
            drag=np.array(DRAG) - DRAG[zero],
            moment=np.array(MOMENT) - MOMENT[zero],
        ),
        source="span, chord and limits: He et al. (2018); increments: XFOIL 6.99, NACA 64-618; actuator assumed",
    )


def with_flaps(turbine: Turbine, *flaps: Flap) -> Turbine:
    """Turbine with trailing-edge flaps; by default that of He et al. (2018)."""
    return turbine.replace(**{"blade.flaps": [flap.content() for flap in flaps or (naca64618_flap(),)]})
