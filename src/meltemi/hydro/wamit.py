"""WAMIT files from potential-flow coefficients.

Reference: docs/theory/floating.md (W-1, W-2); WAMIT user manual, chapter 4.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from meltemi.floating.potential import HydroCoefficients


def wamit_texts(c: HydroCoefficients) -> dict[str, str]:
    """Files .1, .3, .hst, .12d, .12s with reference length 1 m; zero frequency has the added mass of the lowest."""
    n = len(c.infinite)
    modes = [(i, j) for i in range(n) for j in range(n)]
    period = (2.0 * np.pi / c.frequency).tolist()
    rows = [
        [T, i + 1, j + 1, float(A[i, j])] for T, A in ((-1.0, c.added_mass[0]), (0.0, c.infinite)) for i, j in modes
    ]
    for T, w, A, B in zip(period, c.frequency, c.added_mass, c.damping, strict=True):
        rows += [[T, i + 1, j + 1, float(A[i, j]), float(B[i, j] / w)] for i, j in modes]
    excitation = (
        [T, float(beta), k + 1, *_polar(X[h, k])]
        for T, X in zip(period, c.excitation, strict=True)
        for h, beta in enumerate(c.heading)
        for k in range(n)
    )
    hydrostatic = ([i + 1, j + 1, float(c.hydrostatic[i, j])] for i, j in modes)
    texts = {".1": _text(rows), ".3": _text(excitation), ".hst": _text(hydrostatic)}
    for end, kind in ((".12d", "drift"), (".12s", "sums")):
        w, force, heading = (getattr(c, f"{kind}{part}") for part in ("_frequency", "", "_heading"))
        slow = (2.0 * np.pi / w).tolist()
        if slow:
            texts[end] = _text(
                [slow[a], slow[b], float(beta), float(beta), k + 1, *_polar(table[a, b, k])]
                for beta, table in zip(heading, force, strict=True)
                for b in range(len(slow))
                for a in range(b, len(slow))
                for k in range(6)
            )
    return texts


def _polar(z: complex) -> list[float]:
    """Modulus, phase [deg], real and imaginary part, in the format of WAMIT."""
    return [float(abs(z)), float(np.degrees(np.angle(z))), float(z.real), float(z.imag)]


def _text(rows: Iterable[Iterable[object]]) -> str:
    return "\n".join(" ".join(f"{x:.9E}" if isinstance(x, float) else str(x) for x in row) for row in rows) + "\n"
