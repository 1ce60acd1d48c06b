"""Small linear systems, solved in place."""

from __future__ import annotations

from math import sqrt

from numpy import float64
from numpy.typing import NDArray

from meltemi.compiler import kernel

Float = NDArray[float64]


@kernel
def cholesky(A: Float, n: int) -> None:
    """Lower triangle L of A = L L' in place; the diagonal then holds 1 / L_ii."""
    for j in range(n):
        s = A[j, j]
        for k in range(j):
            s -= A[j, k] * A[j, k]
        d = 1.0 / sqrt(s)
        A[j, j] = d
        for i in range(j + 1, n):
            t = A[i, j]
            for k in range(j):
                t -= A[i, k] * A[j, k]
            A[i, j] = t * d


@kernel
def solve_arrow(D: Float, C: Float, f: Float, A: Float, g: Float, n_arms: int, n_arm: int, n_core: int) -> None:  # noqa: C901 - elimination written out, without temporaries
    """Solve a symmetric system with an arrow structure, whose arms couple only through a core, in place.

        [ D_0           C_0 ] [x_0]   [f_0]
        [      ...      ... ] [...] = [...]
        [ C_0'  ...     A   ] [ y ]   [ g ]

    Each arm is eliminated by its Cholesky factor (no fill between arms), then the core is solved.

    Args:
      D: (arms, n_arm, n_arm) diagonal blocks; overwritten by their factors.
      C: (arms, n_arm, n_core) couplings; overwritten.
      f: (arms, n_arm) right-hand sides; overwritten by the solution of the arms.
      A: (n_core, n_core) core; overwritten by its factor.
      g: (n_core,) right-hand side; overwritten by the solution of the core.
    """
    for b in range(n_arms):
        L = D[b]
        cholesky(L, n_arm)
        for i in range(n_arm):  # f <- inv(L) f, C <- inv(L) C
            s = f[b, i]
            for k in range(i):
                s -= L[i, k] * f[b, k]
            f[b, i] = s * L[i, i]
            for j in range(n_core):
                s = C[b, i, j]
                for k in range(i):
                    s -= L[i, k] * C[b, k, j]
                C[b, i, j] = s * L[i, i]
        for i in range(n_arm):
            for j in range(n_core):
                c = C[b, i, j]
                g[j] -= c * f[b, i]
                for k in range(j + 1):
                    A[j, k] -= c * C[b, i, k]
    cholesky(A, n_core)
    for i in range(n_core):
        s = g[i]
        for k in range(i):
            s -= A[i, k] * g[k]
        g[i] = s * A[i, i]
    for m in range(n_core):
        i = n_core - 1 - m
        s = g[i]
        for k in range(i + 1, n_core):
            s -= A[k, i] * g[k]
        g[i] = s * A[i, i]
    for b in range(n_arms):
        L = D[b]
        for m in range(n_arm):
            i = n_arm - 1 - m
            s = f[b, i]
            for j in range(n_core):
                s -= C[b, i, j] * g[j]
            for k in range(i + 1, n_arm):
                s -= L[k, i] * f[b, k]
            f[b, i] = s * L[i, i]
