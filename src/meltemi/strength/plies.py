"""Strength of a blade's plies, spar caps and sandwich faces under its section loads (G-7 to G-19).

Reference: docs/theory/strength.md.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from math import inf, nan, prod
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record
from meltemi.core.shown import Brief
from meltemi.core.yamlfile import read_mapping, validated
from meltemi.postprocess.cycles import rainflow_cycles
from meltemi.sections.blade import load_rotation
from meltemi.sections.laminate import laminate, turned
from meltemi.sections.layup import Layup, Material
from meltemi.sections.properties import PlyStates, SectionModel
from meltemi.sections.thin_walled import Wall, thin_walled_section
from meltemi.simulation.result import Result
from meltemi.strength.criteria import (
    MODES,
    SnLine,
    bending_stiffness,
    critical_load,
    goodman_damage,
    strain_indices,
    stress_indices,
    tsai_wu_index,
    wrinkling_load,
)
from meltemi.strength.welds import SIX, common, numbered_stations, parts_of
from meltemi.turbine.definition import Turbine

Float = NDArray[np.float64]

WAYS = 1000
"""Number of points whose stresses are directions in the space of loads in which instants are extreme, and of others."""
LENGTH = 0.03
"""Largest difference of the lengths of layup and blade."""
LEAST_STRAIN = 1e-5
"""Strength over modulus below which strengths are in another unit."""
COUNTED = 6
"""Points of a layer, those with the largest range of stress, at which its cycles are counted."""
CORE = 0.1
"""Modulus along the blade, over the largest one of a wall, below which a ply between others is a sandwich's core."""
ROOT = "root_force_flap root_force_edge root_force_z root_moment_edge root_moment_flap root_moment_torsion".split()
"""Channels of the blade root in pitched axes, in the order of the six loads."""
FILE = Path(__file__).with_name("blade_factors.yaml")


class BladeFactors(Record):
    """Partial factors of materials, each a product."""

    ultimate: tuple[float, ...] = Field(min_length=1)
    """Fibre failure [-; 1 to 3]."""
    interfibre: tuple[float, ...] = Field(min_length=1)
    """Failure between fibres [-; 1 to 2]."""
    fatigue: tuple[float, ...] = Field(min_length=1)
    """Fatigue [-; 1 to 3]."""
    stability: tuple[float, ...] = Field(min_length=1)
    """Buckling [-; 1 to 2.5]."""
    source: str = ""


@cache
def blade_factors() -> dict[str, BladeFactors]:
    """Partial factors that come with the package, by name."""
    return {name: validated(data, BladeFactors, f"{FILE}: {name}") for name, data in read_mapping(FILE).items()}


@dataclass(frozen=True)
class LayerStrength:
    """Strength of a layer at a station; indices have all partial factors, failure is at 1.

    Attributes:
      station: [m] from the root.
      layer, material: names.
      stress, strain, tsai_wu: largest indices of maximum stress, maximum strain, and of Tsai and Wu.
      index: largest of them; NaN for a material without strengths.
      mode: its criterion: fibre, across, shear or Tsai-Wu.
      result, time: place among ``BladeStrength.names``, and instant [s] of the largest index.
      position: (2,) [m] where it is, in the axes of the section.
      damage, damage_across: of fatigue along and across the fibres over the lifetime; NaN without strengths or slope of
        the S-N line.
    """

    station: float
    layer: str
    material: str
    stress: float
    strain: float
    tsai_wu: float
    index: float
    mode: str
    result: int
    time: float
    position: tuple[float, float]
    damage: float
    damage_across: float


@dataclass(frozen=True)
class PanelStrength:
    """Stability of the shell between two webs, or of a sandwich's faces, at a station.

    Attributes:
      station: [m] from the root.
      mode: buckling of a panel, or wrinkling of a face.
      where: suction or pressure side, or web; of wrinkling also the core.
      width: [m] of a panel along the shell.
      critical: [N/m] critical load.
      load: [N/m] largest compression, with the factor of the loads.
      index: compression with all factors over critical load.
      result, time: place among ``BladeStrength.names``, and instant [s].
    """

    station: float
    mode: str
    where: str
    width: float
    critical: float
    load: float
    index: float
    result: int
    time: float


@dataclass(frozen=True, repr=False)
class BladeStrength(Brief):
    """Strength of a blade.

    Attributes:
      layers, panels: strength of each layer, and of panels and faces, by station.
      points: by station [m] the place (Q, 2) [m] of the points of plies, and the largest index at each (Q,).
      names: of results, or of cases.
      factors: partial factors.
      warnings: what was not judged.
    """

    layers: tuple[LayerStrength, ...]
    panels: tuple[PanelStrength, ...]
    points: dict[float, tuple[Float, Float]] = field(repr=False)
    names: tuple[str, ...] = field(repr=False)
    factors: BladeFactors
    warnings: tuple[str, ...]


class StationLoads(NamedTuple):
    """Loads of a station.

    Attributes:
      place: [m] from the root.
      times: instants (T,) [s] of each result.
      loads: (T, 6) [N, N m] of each, in the axes of the section, with the factor of the loads.
      damage: damage of the lifetime of the stress by unit loads (6,) for an S-N line.
    """

    place: float
    times: Sequence[Float]
    loads: Sequence[Float]
    damage: Callable[[Float, SnLine], float]


def blade_loads(
    result: Result, turbine: Turbine, blade: int = 1, stations: Sequence[float] | None = None
) -> dict[float, Float]:
    """Section loads (T, 6) [N, N m] in the axes of the section, by distance [m] of the stations from the root (G-7).

    Args:
      result: the result; its transient is left out.
      turbine: its turbine, whose structural twist turns the loads.
      blade: number of the blade.
      stations: [m] of the blade's stations 1, 2, ...; by default those that the result states.

    Raises:
      InputError: no station has all six loads, or places are not known.
    """
    part = result.evaluated
    names = {0.0: [f"{name}_{blade}" for name in ROOT]}
    for place, n in numbered_stations(part, "blade", rf"station_(\d+)_moment_y_{blade}", stations).items():
        names[place] = [f"station_{n}_{load}_{blade}" for load in SIX]
    found = {}
    for place, channels in names.items():
        if all(name in part for name in channels):
            found[place] = np.stack([part[name] for name in channels], axis=1) @ load_rotation(turbine, place).T
    if not found:
        raise InputError(
            f"stress: the result has no blade station with all six loads of blade {blade}: run with blade_stations"
        )
    return dict(sorted(found.items()))


def blade_strength(  # noqa: PLR0913 - settings by name
    results: Sequence[Result],
    turbine: Turbine,
    layup: Layup,
    *,
    factors: str = "iec61400-5",
    load_factor: float = 1.35,
    blade: int = 1,
    shares: Sequence[float] | None = None,
    years: float = 20.0,
    stations: Sequence[float] | None = None,
    names: Sequence[str] = (),
) -> BladeStrength:
    """Strength of plies, spar caps and sandwich faces at the stations of results (G-7 to G-19).

    Args:
      results: results with section loads of the blade.
      turbine: their turbine.
      layup: layup of its blade.
      factors: name of partial factors of materials.
      load_factor: partial factor of the loads for strength and stability; fatigue has 1.
      blade: number of the blade.
      shares: shares of the results in the lifetime, for fatigue; equal ones by default.
      years: design lifetime [years].
      stations: see :func:`blade_loads`.
      names: of the results; by default their numbers.

    Raises:
      InputError: loads are missing, the layup is of another blade, there are no such factors, or a section cannot be
        modelled.
    """
    repeated = parts_of(results, shares, years)
    loads = [blade_loads(result, turbine, blade, stations) for result in results]
    times = [result.evaluated.time for result in results]

    def of_station(place: float) -> StationLoads:
        series = [each[place] for each in loads]

        def damage(unit: Float, line: SnLine) -> float:
            each = [goodman_damage(rainflow_cycles(x @ unit), line) for x in series]
            return float(sum(n * d for n, d in zip(repeated, each, strict=True)))

        return StationLoads(place, times, [load_factor * x for x in series], damage)

    named = tuple(names) or tuple(str(i + 1) for i in range(len(results)))
    return judged_blade(turbine, layup, factors, map(of_station, common(loads)), named)


def judged_blade(
    turbine: Turbine, layup: Layup, factors: str, stations: Iterable[StationLoads], names: tuple[str, ...]
) -> BladeStrength:
    """Strength of a blade from the loads of its stations; see :func:`blade_strength`."""
    if factors not in blade_factors():
        raise InputError(f"factors {factors!r}: {did_you_mean(factors, blade_factors())}")
    length, described = turbine.blade.length, float(layup.position.values[-1])
    if abs(described / length - 1.0) > LENGTH:
        raise InputError(
            f"the layup of {layup.name} is {described:.4g} m long, the blade of {turbine.name} {length:.4g} m"
        )
    gamma, along = blade_factors()[factors], layup.position.values * length / described
    layers: list[LayerStrength] = []
    panels: list[PanelStrength] = []
    points: dict[float, tuple[Float, Float]] = {}
    materials: dict[str, Material] = {}
    for at in stations:
        model = thin_walled_section(layup.section(float(np.interp(at.place, along, layup.position.grid))))
        plies, states = model.section.plies, model.states()
        picks = [extreme_instants(loads, states) for loads in at.loads]
        few = at._replace(
            times=[time[i] for time, i in zip(at.times, picks, strict=True)],
            loads=[loads[i] for loads, i in zip(at.loads, picks, strict=True)],
        )
        index = np.zeros(len(states.ply))
        for name, label in dict.fromkeys((ply.name, ply.material) for ply in plies):
            inside = np.flatnonzero([plies[i].name == name for i in states.ply])
            if len(inside):
                materials[label] = model.section.materials[label]
                layer, index[inside] = layer_strength(few, name, label, materials[label], states.at(inside), gamma)
                layers.append(layer)
        points[at.place] = states.position.real, index
        panels += panel_strength(at, model, states, prod(gamma.stability))
        panels += wrinkling(few, model, states, prod(gamma.stability))
    words = [text for label, material in materials.items() if (text := unjudged_words(label, material))]
    if flat := [label for label, m in materials.items() if m.fatigue_exponent and not m.across_exponent]:
        words.append(f"no fatigue across the fibres, whose slope (across_exponent) is not given: {', '.join(flat)}")
    return BladeStrength(tuple(layers), tuple(panels), points, names, gamma, tuple(words))


def unjudged_words(name: str, material: Material) -> str:
    """Why a material cannot be judged; empty if it can."""
    xt, xc = material.Xt, material.Xc
    if xt is None or xc is None:
        return f"{name}: no strengths along the fibres: its layers are not judged"
    if min(xt, xc) < LEAST_STRAIN * material.E1:
        return f"{name}: strengths of {xt:g} and {xc:g} Pa, are they in MPa? Its layers are not judged"
    return ""


def extreme_instants(loads: Float, states: PlyStates) -> NDArray[np.intp]:
    """Places of the instants on the hull of loads (T, 6), found in the directions of stresses and in others.

    Indices are convex functions of the loads, so that the largest one is at a corner of their hull.
    """
    few = states.stress.real[:: max(len(states.ply) // WAYS, 1), (0, 1, 5)].reshape(-1, 6)
    others = np.random.default_rng(1).normal(size=(WAYS, 6)) / np.maximum(np.ptp(loads, axis=0), 1e-300)
    found = []
    for ways in np.array_split(np.concatenate([few, others]), 8):
        along = ways @ loads.T
        found += [along.argmax(axis=1), along.argmin(axis=1)]
    return np.unique(np.concatenate(found))


def layer_strength(
    at: StationLoads, name: str, label: str, material: Material, states: PlyStates, gamma: BladeFactors
) -> tuple[LayerStrength, Float]:
    """Strength of a layer under extreme loads, and the largest index at each of its points."""
    judged = not unjudged_words(label, material)
    ultimate, across, fatigue = prod(gamma.ultimate), prod(gamma.interfibre), prod(gamma.fatigue)
    by_mode = np.array([ultimate, across, across])
    best, point_index, largest = (-1.0, "", 0, 0.0, 0), np.zeros(len(states.ply)), np.zeros(3)
    low, high = np.full((2, len(states.ply)), inf), np.full((2, len(states.ply)), -inf)
    for r, (loads, time) in enumerate(zip(at.loads, at.times, strict=True)):
        strain, stress = states.under(loads)
        parts = by_mode * stress_indices(material, stress), by_mode * strain_indices(material, strain)
        wu = np.nan_to_num(tsai_wu_index(material, stress * np.insert(by_mode, 2, [1.0, 1.0, 1.0])), nan=0.0)
        every = np.concatenate([*parts, wu[..., None]], axis=-1)
        largest = np.maximum(largest, [parts[0].max(), parts[1].max(), wu.max()])
        point_index = np.maximum(point_index, every.max(axis=(0, 2)))
        t, q, kind = np.unravel_index(int(every.argmax()), every.shape)
        if every[t, q, kind] > best[0]:
            mode = "Tsai-Wu" if kind == 6 else f"{MODES[kind % 3]} {('stress', 'strain')[kind // 3]}"
            best = (float(every[t, q, kind]), mode, r, float(time[t]), int(q))
        sides = stress[..., :2].transpose(2, 0, 1)
        low, high = np.minimum(low, sides.min(axis=1)), np.maximum(high, sides.max(axis=1))
    damages = []
    for k, (tension, compression, slope, static) in enumerate(
        (
            (material.Xt, material.Xc, material.fatigue_exponent, ultimate),
            (material.Yt, material.Yc, material.across_exponent, across),
        )
    ):
        if judged and tension and compression and slope:
            line, worst = SnLine(tension, compression, slope, static, fatigue), np.argsort(low[k] - high[k])[:COUNTED]
            damages.append(max(at.damage(unit, line) for unit in states.stress[worst, k]))
        else:
            damages.append(nan)
    x, y = states.position[best[4]]
    index, mode, r, time_of, _ = best
    stress_index, strain_index, wu_index = map(float, largest)
    head = at.place, name, label, stress_index, strain_index, wu_index, index if judged else nan
    layer = LayerStrength(*head, mode, r, time_of, (float(x), float(y)), damages[0], damages[1])
    return layer, point_index if judged else np.full(len(states.ply), nan)


def panel_strength(at: StationLoads, model: SectionModel, states: PlyStates, factor: float) -> list[PanelStrength]:
    """Buckling of the shell between neighbouring webs, as a long flat plate (G-15 to G-18)."""
    mesh, forces = model.mesh, wall_forces(model, states)
    webs = [model.section.plies[wall.plies[0][0]].web is not None for wall in mesh.walls]
    shell = [w for w, wall in enumerate(mesh.walls) if not webs[w] and not wall.link]
    of_webs = {n for w, wall in enumerate(mesh.walls) if webs[w] for n in wall.nodes}
    leading = int(np.argmin(mesh.nodes[:, 1].real))
    parts: list[list[int]] = [[]]
    for w in shell:
        parts[-1].append(w)
        if mesh.walls[w].nodes[1] in of_webs:
            parts.append([])
    found = []
    for walls in parts[1:-1]:  # the first and the last one lie at the trailing edge
        if any(leading in mesh.walls[w].nodes for w in walls):
            continue
        length = np.array([float(np.hypot(*(b - a).real)) for a, b in (mesh.ends(mesh.walls[w]) for w in walls)])
        share, width = length / length.sum(), float(length.sum())
        D = np.tensordot(share, [bending_stiffness(mesh.walls[w].laminate.ABD) for w in walls], 1)
        side = "suction side" if mesh.walls[walls[0]].nodes[0] < leading else "pressure side"
        found.append(_panel(at, "buckling", side, width, critical_load(D, width), share @ forces[walls], factor))
    return found


def _panel(
    at: StationLoads, mode: str, where: str, width: float, critical: float, unit: Float, factor: float
) -> PanelStrength:
    """Stability under the largest compression, minus loads times ``unit`` (6,)."""
    series = [-loads @ unit for loads in at.loads]
    r = int(np.argmax([c.max() for c in series]))
    t = int(series[r].argmax())
    load = max(float(series[r][t]), 0.0)
    index = factor * load / critical
    return PanelStrength(at.place, mode, where, width, critical, load, index, r, float(at.times[r][t]))


def wrinkling(at: StationLoads, model: SectionModel, states: PlyStates, factor: float) -> list[PanelStrength]:
    """Wrinkling of the faces of sandwich walls: of each core on each side the face with the largest index (G-19)."""
    section, forces, leading = model.section, ply_forces(model, states), int(np.argmin(model.mesh.nodes[:, 1].real))
    worst: dict[str, PanelStrength] = {}
    known: dict[tuple[tuple[int, complex], ...], list[tuple[slice, int, float]]] = {}
    first = np.cumsum([0, *(0 if wall.link else len(wall.plies) for wall in model.mesh.walls)])
    for w, wall in enumerate(model.mesh.walls):
        if wall.link:
            continue
        if wall.plies not in known:
            known[wall.plies] = sandwich_faces(model, wall)
        for face, core, critical in known[wall.plies]:
            ply = section.plies[wall.plies[core][0]]
            side = "suction side" if wall.nodes[0] < leading else "pressure side"
            where = f"{side if ply.web is None else section.webs[ply.web].name}, {ply.name}"
            unit = forces[first[w] : first[w + 1]][face].sum(axis=0)
            found = _panel(at, "wrinkling", where, nan, critical, unit, factor)
            if where not in worst or found.index > worst[where].index:
                worst[where] = found
    return list(worst.values())


def sandwich_faces(model: SectionModel, wall: Wall) -> list[tuple[slice, int, float]]:
    """Faces of a wall's sandwiches: plies of the face, that of the core beside it, critical load [N/m] (G-19)."""
    section = model.section
    plies = [(section.plies[i], t.real) for i, t in wall.plies]
    moduli = [1.0 / np.linalg.inv(turned(section.materials[p.material], p.angle))[0, 0] for p, _ in plies]
    soft = [CORE * max(moduli) > E and 0 < k < len(plies) - 1 for k, E in enumerate(moduli)]
    ends = [-1, *np.flatnonzero(soft).tolist(), len(plies)]
    found = []
    for a, b in itertools.pairwise(ends):
        if b - a < 2 or len(ends) < 3:
            continue
        A = laminate(plies[a + 1 : b], section.materials, closed=True).ABD[:3, :3].real
        thickness = sum(t for _, t in plies[a + 1 : b])
        for k in (k for k in (a, b) if 0 <= k < len(plies)):
            core, c2 = section.materials[plies[k][0].material], np.cos(plies[k][0].angle) ** 2
            shear = 1.0 / (c2 / core.G13 + (1.0 - c2) / core.G23)
            membrane = 1.0 / np.linalg.inv(A)[0, 0]
            found.append((slice(a + 1, b), k, wrinkling_load(membrane, thickness, core.E3, shear)))
    return found


def ply_forces(model: SectionModel, states: PlyStates) -> Float:
    """(P, 6) axial force per width [N/m] of each ply of each wall, in their order, by unit loads (G-15)."""
    angle = np.array([model.section.plies[i].angle for i in states.ply])
    c, s = np.cos(angle), np.sin(angle)
    axial = np.einsum("kq,qkj->qj", [c * c, s * s, -2.0 * c * s], states.stress.real[:, (0, 1, 5)])
    thickness = np.array([t.real for wall in model.mesh.walls if not wall.link for _, t in wall.plies])
    return np.asarray(0.5 * thickness[:, None] * (axial[0::2] + axial[1::2]))  # both faces of each ply


def wall_forces(model: SectionModel, states: PlyStates) -> Float:
    """(walls, 6) axial force per width [N/m] of each wall by unit loads (G-15)."""
    forces = np.zeros((len(model.mesh.walls), 6))
    np.add.at(forces, states.wall[::2], ply_forces(model, states))
    return forces
