"""Algebra of a stationary Kalman filter: reduction of fast states, discrete model with its noise, gain.

Reference: docs/theory/observer.md (O-1a, O-7 to O-9).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.linear import LinearModel

Float = NDArray[np.float64]


def condensed(linear: LinearModel, fast: NDArray[np.bool_]) -> LinearModel:
    """The model with the states of a mask in equilibrium with the others (O-1a).

    In the fixed frame this is exact for steady wind with shear, yaw and tilt: once-per-revolution excitations of the
    blades are constant there, and the lag of a state in the rotating frame is part of its matrix.

    Args:
      linear: linear model in the fixed frame.
      fast: (n,) mask of the fast states.
    """
    kept = ~fast
    follows = -np.linalg.solve(linear.A[np.ix_(fast, fast)], np.hstack([linear.A[np.ix_(fast, kept)], linear.B[fast]]))
    n = int(kept.sum())
    A = linear.A[np.ix_(kept, kept)] + linear.A[np.ix_(kept, fast)] @ follows[:, :n]
    B = linear.B[kept] + linear.A[np.ix_(kept, fast)] @ follows[:, n:]
    C, D = linear.C[:, kept] + linear.C[:, fast] @ follows[:, :n], linear.D + linear.C[:, fast] @ follows[:, n:]
    states, units = (tuple(np.array(x)[kept].tolist()) for x in (linear.states, linear.state_units))
    return replace(linear, A=A, B=B, C=C, D=D, states=states, state_units=units, x0=linear.x0[kept])


def discrete(A: Float, B: Float, W: Float, dt: float) -> tuple[Float, Float, Float]:
    """Matrices of a step, and covariance of its noise (Van Loan 1978; O-7).

    Args:
      A, B: (n, n), (n, m) of dz/dt = A z + B u + w.
      W: (n, n) intensity of w.
      dt: [s] time step.
    """
    from scipy.linalg import expm

    n, m = B.shape
    both = expm(np.block([[A, B], [np.zeros((m, n + m))]]) * dt)
    loan = expm(np.block([[-A, W], [np.zeros((n, n)), A.T]]) * dt)
    Ad = both[:n, :n]
    Q = loan[n:, n:].T @ loan[:n, n:]
    return Ad, both[:n, n:], 0.5 * (Q + Q.T)


def stationary(A: Float, C: Float, Q: Float, R: Float) -> tuple[Float, Float, Float]:
    """Gain, covariance after an update and covariance of the innovation in the steady state (O-8, O-9).

    Args:
      A, C: (n, n), (s, n) matrices of a discrete model.
      Q, R: (n, n), (s, s) covariances of process and sensors.
    """
    from scipy.linalg import solve_discrete_are

    M = solve_discrete_are(A.T, C.T, Q, R)
    S = C @ M @ C.T + R
    K = np.linalg.solve(S, C @ M).T
    P = M - K @ S @ K.T
    return K, 0.5 * (P + P.T), S
