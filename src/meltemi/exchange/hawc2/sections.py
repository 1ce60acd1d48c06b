"""Section properties (st), blade planform (ae) and polars (pc) of a HAWC2 model.

Axes of a section, at the half chord: x towards the leading edge, y towards the suction side, z along the axis. The
beam has its axial force and bending at the elastic centre E, in axes turned by the structural pitch, and shear and
torsion at the shear centre S, in the same axes. For strains x, y, z and curvatures about x, y, z

    K = A_E^T diag(0, 0, EA, EI_x, EI_y, 0) A_E + A_S^T diag(k_x GA, k_y GA, 0, 0, 0, GK) A_S,   A_P = Q T(P)

with T(P) from the half chord to a point P and Q the rotation by the structural pitch. A fully populated matrix
(FPM 1) stands at E: K = A_E^T K_E A_E. Radii of gyration are about E, the mass is at its centre.

Reference: docs/theory/structure.md (S-69, S-70); Larsen and Hansen, How 2 HAWC2, the user's manual, DTU R-1597.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.exchange.hawc2.htc import lines_of
from meltemi.exchange.openfast.text import number

Float = NDArray[np.float64]
COLUMNS, FULL_COLUMNS = 19, 30
"""Numbers of columns of a subset in an st file: of a classical beam, and of fully populated matrices."""
LEAST_INERTIA = 1e-6
"""Rotary inertia over mass [m^2] below which a section has none that matters."""


def read_subset(path: Path, group: int, subset: int, full: bool) -> Float:
    """(S, 19) or, with ``full``, (S, 30) rows of a subset of an st file.

    Raises:
      InputError: the file has no such subset, or it is incomplete.
    """
    lines = lines_of(path)
    width = FULL_COLUMNS if full else COLUMNS
    groups = {_index(line, path, i): i for i, line in enumerate(lines) if line.lstrip().startswith("#")}
    if group not in groups:
        raise InputError(f"{path}: no set #{group}; there are {', '.join(f'#{g}' for g in groups) or 'none'}")
    end = min((i for i in groups.values() if i > groups[group]), default=len(lines))
    for i in range(groups[group], end):
        if lines[i].lstrip().startswith("$") and _index(lines[i], path, i) == subset:
            count = [*lines[i].lstrip("$ \t").split(), "", ""][1]
            rows = int(number(count) or 0)
            if not 2 <= rows <= 10_000:
                raise InputError(f"{path}:{i + 1}: expected the number of rows, from 2 on, found {count!r}")
            return _numbers(path, lines, i + 1, rows, width)
    raise InputError(f"{path}: set #{group} has no subset ${subset}")


def _index(line: str, path: Path, i: int) -> int:
    word = (line.lstrip("#$ \t").split() or [""])[0]
    if not word.isdigit():
        raise InputError(f"{path}:{i + 1}: expected a number behind # or $, found {word!r}")
    return int(word)


def _numbers(path: Path, lines: list[str], begin: int, rows: int, width: int) -> Float:
    if rows < 1:
        raise InputError(f"{path}:{begin}: expected the number of rows that follow, found {rows}")
    table = []
    for i in range(begin, begin + rows):
        words = lines[i].split(";")[0].split()[:width] if i < len(lines) else []
        values = [number(word) for word in words]
        if len(values) < width or None in values:
            raise InputError(f"{path}:{i + 1}: expected {width} numbers, found {' '.join(words)[:40]!r}")
        table.append(values)
    return np.array(table, dtype=float)


def section_matrices(rows: Float) -> tuple[Float, Float]:
    """(S, 6, 6) stiffness and mass at the half chord, in HAWC2's axes of the section (S-69, S-70)."""
    full = rows.shape[1] == FULL_COLUMNS
    m, xg, yg, rx, ry = rows[:, 1:6].T
    angle, xe, ye = rows[:, 6:9].T if full else rows[:, 16:19].T
    A_e = _to_point(xe, ye, np.radians(angle))
    if full:
        upper = np.triu_indices(6)
        K_e = np.zeros((len(rows), 6, 6))
        K_e[:, upper[0], upper[1]] = K_e[:, upper[1], upper[0]] = rows[:, 9:30]
        K = _congruent(A_e, K_e)
    else:
        xs, ys, E, G, Ix, Iy, J, kx, ky, A = rows[:, 6:16].T
        zero = np.zeros_like(E)
        A_s = _to_point(xs, ys, np.radians(angle))
        K = _congruent(A_e, _diagonal(zero, zero, E * A, E * Ix, E * Iy, zero))
        K += _congruent(A_s, _diagonal(kx * G * A, ky * G * A, zero, zero, zero, G * J))
    # inertia about the elastic centre, moved to the centre of mass and on to the half chord
    zero = 0.0 * xe
    J = _congruent(_to_point(zero, zero, np.radians(angle)), _diagonal(m, m, m, m * rx**2, m * ry**2, zero))
    dx, dy = xg - xe, yg - ye
    J[:, 3, 3] = np.maximum(J[:, 3, 3] - m * dy**2, LEAST_INERTIA * m)
    J[:, 4, 4] = np.maximum(J[:, 4, 4] - m * dx**2, LEAST_INERTIA * m)
    J[:, 5, 5] = J[:, 3, 3] + J[:, 4, 4]
    J[:, 3, 4] += m * dx * dy
    J[:, 4, 3] = J[:, 3, 4]
    return K, _congruent(_to_point(xg, yg, zero), J)


def turned_centres(rows: Float) -> Float:
    """Rows of fully populated sections whose centres of mass are turned by the structural pitch about the elastic ones.

    HAWC2 treats the sections of the IEA 22 MW in this way (S-72): it takes the vector from elastic centre to centre of
    mass in the principal axes. According to its manual both are relative to the half chord, as in the importer and in
    converters to HAWC2.
    """
    if rows.shape[1] != FULL_COLUMNS:
        return rows
    turned = rows.copy()
    angle = np.radians(rows[:, 6])
    dx, dy = (rows[:, 2:4] - rows[:, 7:9]).T
    turned[:, 2] = rows[:, 7] + np.cos(angle) * dx - np.sin(angle) * dy
    turned[:, 3] = rows[:, 8] + np.sin(angle) * dx + np.cos(angle) * dy
    return turned


def at_elastic_centre(K: Float, M: Float) -> tuple[Float, Float, Float]:
    """Stiffness and mass, moved from the origin to the elastic centre, and its position (S-71).

    Returns:
      (S, 6, 6), (S, 6, 6) matrices there; (S, 2) [m] x and y of the point whose axial force does not bend the section.
    """
    x, y = -K[:, 2, 4] / K[:, 2, 2], K[:, 2, 3] / K[:, 2, 2]
    A = _to_point(-x, -y, 0.0 * x)
    return _congruent(A, K), _congruent(A, M), np.stack([x, y], axis=-1)


def _to_point(x: Float, y: Float, angle: Float) -> Float:
    """(S, 6, 6) strains, or velocities, at points in axes turned by angles, from those at the origin."""
    c, s, zero = np.cos(angle), np.sin(angle), 0.0 * x
    Q, T = np.zeros((len(x), 6, 6)), np.tile(np.eye(6), (len(x), 1, 1))
    for k in (0, 3):
        Q[:, k, k] = Q[:, k + 1, k + 1] = c
        Q[:, k, k + 1], Q[:, k + 1, k], Q[:, k + 2, k + 2] = s, -s, 1.0 + zero
    T[:, 0, 5], T[:, 1, 5], T[:, 2, 3], T[:, 2, 4] = -y, x, y, -x
    product: Float = Q @ T
    return product


def _diagonal(*values: Float) -> Float:
    matrix: Float = np.stack(values, axis=-1)[..., None] * np.eye(6)
    return matrix


def _congruent(A: Float, K: Float) -> Float:
    product: Float = A.transpose(0, 2, 1) @ K @ A
    return product


def read_planform(path: Path, group: int) -> Float:
    """(S, 4) curved length, chord [m], relative thickness [%] and set of polars of a set of an ae file.

    Raises:
      InputError: the file is not valid; the message has file and line.
    """
    lines = lines_of(path)
    at = 1
    for i in range(1, group + 1):
        words = lines[at].split() if at < len(lines) else []
        rows = int(number(words[1]) or 0) if len(words) > 1 else 0
        if not 2 <= rows <= 10_000:
            raise InputError(f"{path}:{at + 1}: expected the number of set {i} and its number of rows, from 2 on")
        if i == group:
            return _numbers(path, lines, at + 1, rows, 4)
        at += rows + 1
    raise InputError(f"{path}: sets count from 1, found {group}")


def read_polars(path: Path, group: int) -> list[tuple[float, str, Float]]:
    """Relative thickness [%], name and (P, 4) angle [deg] and coefficients of lift, drag and moment of each airfoil.

    Raises:
      InputError: the file is not valid; the message has file and line.
    """
    lines = lines_of(path)

    def header(i: int, count: int) -> list[str]:
        words = lines[i].split() if i < len(lines) else []
        if len(words) < count or any(number(word) is None for word in words[:count]):
            raise InputError(f"{path}:{i + 1}: expected {count} numbers of a head line, found {' '.join(words)[:40]!r}")
        return words

    sets = int(float(header(0, 1)[0]))
    if not 1 <= group <= sets:
        raise InputError(f"{path}: the blade needs set {group}, the file has {sets}")
    at = 1
    for k in range(1, group + 1):
        airfoils = []
        count = int(float(header(at, 1)[0]))
        at += 1
        for _ in range(count):
            words = header(at, 3)
            rows = int(float(words[1]))
            airfoils.append((float(words[2]), " ".join(words[3:]), _numbers(path, lines, at + 1, rows, 4)))
            at += rows + 1
        if k == group:
            return airfoils
    return []
