"""Potential-flow coefficients of a hull, by Capytaine.

Reference: docs/theory/floating.md (W-1, W-17, W-36, W-37).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.extras import need
from meltemi.floating.potential import HydroCoefficients
from meltemi.hydro.hull import Hull
from meltemi.hydro.panels import Panels, hull_moments, panels_of
from meltemi.sea.airy import GRAVITY, wave_number

Float = NDArray[np.float64]
DEEP = 6.0
"""Wave number times depth above which the water counts as deep."""
COARSER = 1.4
"""Size of the panels in the convergence check over that of the other panels."""
PER_WAVE = 6.0
"""Panels per wavelength of the shortest resolved wave."""


def hydrostatics(hull: Hull, size: float) -> tuple[float, Float, Float]:
    """Volume [m^3], its centre (3,) [m], and stiffness (6, 6) over density and gravity (W-17, W-36).

    Args:
      size: [m] size of the panels; the grids of the integrals are finer.
    """
    V, x, y, z, area, area_y, area_x, yy, xx, xy = hull_moments(hull, size)
    C = np.zeros((6, 6))
    C[2, 2], C[2, 3], C[2, 4], C[3, 4] = area, area_y, -area_x, -xy
    C += C.T - np.diag(C.diagonal())
    C[3, 3], C[4, 4], C[3, 5], C[4, 5] = yy + z, xx + z, -x, -y
    return float(V), np.array([x, y, z]) / V, C


def coefficients_of(
    hull: Hull,
    panels: Panels,
    frequency: Float,
    heading: Float,
    hydrostatic: Float,
    progress: Callable[[float], None] | None = None,
) -> HydroCoefficients:
    """Added mass, damping and excitation of a hull (W-37).

    Args:
      frequency: (F,) [rad/s]; heading: (H,) [deg] direction of wave travel, counter-clockwise from x.
      hydrostatic: (6, 6) as of :func:`hydrostatics`.
      progress: callback with the completed fraction.

    Raises:
      InputError: Capytaine is not installed.
    """
    need("meltemi hydro", "capytaine")
    import capytaine
    from capytaine.bem.airy_waves import froude_krylov_force

    capytaine.set_logging("ERROR")
    mesh = capytaine.Mesh(panels.vertices, panels.faces)
    dofs = capytaine.rigid_body_dofs(rotation_center=(0.0, 0.0, 0.0))
    body = capytaine.FloatingBody(mesh=mesh, lid_mesh=mesh.generate_lid(), dofs=dofs)
    solver, names = capytaine.BEMSolver(), list(body.dofs)
    water = {"body": body, "rho": 1.0, "g": GRAVITY}
    added, damping = np.zeros((len(frequency) + 1, 6, 6)), np.zeros((len(frequency) + 1, 6, 6))
    excitation = np.zeros((len(frequency), len(heading), 6), dtype=np.complex128)
    k = wave_number(frequency, hull.depth, GRAVITY)
    for n, w in enumerate([*frequency, inf]):
        depth = inf if n == len(frequency) or k[n] * hull.depth > DEEP else hull.depth
        wave = water | {"omega": w, "water_depth": depth}
        moved = [capytaine.RadiationProblem(radiating_dof=name, **wave) for name in names]
        for j, solution in enumerate(_solved(solver, moved)):
            added[n, :, j] = [solution.added_masses[name] for name in names]
            damping[n, :, j] = [solution.radiation_dampings[name] for name in names]
        if n < len(frequency):
            waves = [capytaine.DiffractionProblem(wave_direction=b, **wave) for b in np.radians(heading)]
            for j, (problem, solution) in enumerate(zip(waves, _solved(solver, waves), strict=True)):
                undisturbed = froude_krylov_force(problem)
                # Capytaine's time dependence is e^{-i w t}
                excitation[n, j] = np.conj([undisturbed[name] + solution.forces[name] for name in names]) / GRAVITY
        if progress is not None:
            progress((n + 1.0) / (len(frequency) + 1.0))
    added = 0.5 * (added + added.transpose(0, 2, 1))
    damping = 0.5 * (damping + damping.transpose(0, 2, 1))
    return HydroCoefficients(frequency, added[:-1], damping[:-1], added[-1], heading, excitation, hydrostatic)


def _solved(solver: Any, problems: list[Any]) -> list[Any]:
    solutions: list[Any] = solver.solve_all(problems, progress_bar=False, keep_details=False)
    return solutions


def change_by_panels(hull: Hull, c: HydroCoefficients, size: float) -> tuple[float, float]:
    """Relative change of added mass and excitation with panels ``COARSER`` times as large.

    Evaluated at the middle frequency, for surge, heave and pitch and for waves along x, relative to the largest values.
    """
    middle = slice(len(c.frequency) // 2, len(c.frequency) // 2 + 1)
    along = [int(np.argmin(np.abs(c.heading)))]
    coarse = coefficients_of(
        hull, panels_of(hull, COARSER * size), c.frequency[middle], c.heading[along], c.hydrostatic
    )
    fine = replace(c, added_mass=c.added_mass[middle], excitation=c.excitation[middle][:, along])
    modes = [0, 2, 4]
    A, A0 = (x.added_mass[0][modes, modes] for x in (fine, coarse))
    X, X0 = (np.abs(x.excitation[0, 0][modes]) for x in (fine, coarse))
    largest = np.abs(c.excitation[:, along][..., modes]).max(axis=(0, 1))
    return float(np.abs(A0 / A - 1.0).max()), float((np.abs(X0 - X) / largest).max())


def shortest_period(size: float) -> float:
    """Period [s] of deep-water waves with ``PER_WAVE`` panels per wavelength."""
    return float(np.sqrt(2.0 * np.pi * PER_WAVE * size / GRAVITY))
