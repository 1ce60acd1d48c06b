"""Strength of a blade's plies and spar caps under the section loads of results (G-7 to G-18).

Reference: docs/theory/strength.md.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from math import inf, prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record
from meltemi.core.shown import Brief
from meltemi.core.yamlfile import read_mapping, validated
from meltemi.postprocess.cycles import rainflow_cycles
from meltemi.sections.layup import Layup, Material
from meltemi.sections.properties import SectionModel
from meltemi.sections.recovery import PlyStates, ply_states
from meltemi.sections.thin_walled import thin_walled_section
from meltemi.simulation.result import Result
from meltemi.strength.criteria import (
    MODES,
    bending_stiffness,
    critical_load,
    goodman_damage,
    strain_indices,
    stress_indices,
    tsai_wu_index,
)
from meltemi.strength.welds import SIX, common, parts_of
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
      result, time: place of the result, and instant [s] of the largest index.
      position: (2,) [m] where it is, in the axes of the section.
      damage: of fatigue along the fibres over the lifetime; NaN without strengths or slope of the S-N line.
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


@dataclass(frozen=True)
class PanelStrength:
    """Buckling of the shell between two webs at a station.

    Attributes:
      station: [m] from the root.
      side: suction or pressure side.
      width: [m] along the shell.
      critical: [N/m] critical load.
      load: [N/m] largest compression, without factors.
      index: compression with factors over critical load.
      result, time: place of the result, and instant [s].
    """

    station: float
    side: str
    width: float
    critical: float
    load: float
    index: float
    result: int
    time: float


@dataclass(frozen=True, repr=False)
class BladeStrength(Brief):
    """Strength of a blade at the stations of its results.

    Attributes:
      layers, panels: strength of each layer, and of each panel between webs, by station.
      points: by station [m] the place (Q, 2) [m] of the points of plies, and the largest index at each (Q,).
      factors: partial factors.
      warnings: what was not judged.
    """

    layers: tuple[LayerStrength, ...]
    panels: tuple[PanelStrength, ...]
    points: dict[float, tuple[Float, Float]] = field(repr=False)
    factors: BladeFactors
    warnings: tuple[str, ...]


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
    part, structure = result.evaluated, turbine.blade.structure
    places = list((result.meta.get("stations") or {}).get("blade", ()) if stations is None else stations)
    names = {0.0: [f"{name}_{blade}" for name in ROOT]}
    ending = f"_moment_y_{blade}"
    for n in sorted(int(name.split("_")[1]) for name in part.names if re.fullmatch(rf"station_\d+{ending}", name)):
        if n > len(places):
            raise InputError(f"the place of blade station {n} is not known: give those of all stations (--stations)")
        names[float(places[n - 1])] = [f"station_{n}_{load}_{blade}" for load in SIX]
    found = {}
    for place, channels in names.items():
        if all(name in part for name in channels):
            loads = np.stack([part[name] for name in channels], axis=1)
            twist = float(np.interp(place, structure.position, structure.twist))
            c, s = np.cos(twist), np.sin(twist)
            turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            loads = np.concatenate([loads[:, :3] @ turned.T, loads[:, 3:] @ turned.T], axis=1)
            found[place] = loads
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
) -> BladeStrength:
    """Strength of plies and spar caps at the stations of results (G-7 to G-18).

    Args:
      results: results with section loads of the blade.
      turbine: their turbine.
      layup: layup of its blade.
      factors: name of partial factors of materials.
      load_factor: partial factor of the loads for strength and buckling; fatigue has 1.
      blade: number of the blade.
      shares: shares of the results in the lifetime, for fatigue; equal ones by default.
      years: design lifetime [years].
      stations: see :func:`blade_loads`.

    Raises:
      InputError: loads are missing, the layup is of another blade, there are no such factors, or a section cannot be
        modelled.
    """
    if factors not in blade_factors():
        raise InputError(f"factors {factors!r}: {did_you_mean(factors, blade_factors())}")
    length, described = turbine.blade.length, float(layup.position.values[-1])
    if abs(described / length - 1.0) > LENGTH:
        raise InputError(
            f"the layup of {layup.name} is {described:.4g} m long, the blade of {turbine.name} {length:.4g} m"
        )
    gamma, repeated = blade_factors()[factors], parts_of(results, shares, years)
    loads = [blade_loads(result, turbine, blade, stations) for result in results]
    times = [result.evaluated.time for result in results]
    layers: list[LayerStrength] = []
    panels: list[PanelStrength] = []
    points: dict[float, tuple[Float, Float]] = {}
    unjudged: dict[str, None] = {}
    for place in common(loads):
        along = layup.position.values * length / described
        model = thin_walled_section(layup.section(float(np.interp(place, along, layup.position.grid))))
        states, whole = ply_states(model), [each[place] for each in loads]
        extreme = [extreme_instants(each, states) for each in whole]
        at = [time[i] for time, i in zip(times, extreme, strict=True)]
        series = [each[i] for each, i in zip(whole, extreme, strict=True)]
        index = np.zeros(len(states.ply))
        for name in dict.fromkeys(ply.name for ply in model.section.plies):
            inside = np.flatnonzero([model.section.plies[i].name == name for i in states.ply])
            if not len(inside):
                continue
            material = next(ply.material for ply in model.section.plies if ply.name == name)
            if words := unjudged_words(material, model.section.materials[material]):
                unjudged[words] = None
            layer, index[inside] = layer_strength(
                place, name, model, states, inside, whole, at, series, repeated, gamma, load_factor
            )
            layers.append(layer)
        points[place] = states.position.real, index
        panels += panel_strength(place, model, states, whole, times, load_factor * prod(gamma.stability))
    return BladeStrength(tuple(layers), tuple(panels), points, gamma, tuple(unjudged))


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
        along = loads @ ways.T
        found += [along.argmax(axis=0), along.argmin(axis=0)]
    return np.unique(np.concatenate(found))


def layer_strength(  # noqa: PLR0913 - one layer of one station
    place: float,
    name: str,
    model: SectionModel,
    states: PlyStates,
    inside: NDArray[np.intp],
    whole: Sequence[Float],
    times: Sequence[Float],
    series: Sequence[Float],
    repeated: Float,
    gamma: BladeFactors,
    load_factor: float,
) -> tuple[LayerStrength, Float]:
    """Strength of a layer, and the largest index at each of its points ``inside`` the states.

    Args:
      whole: loads (T, 6) of each result, for cycles.
      times, series: extreme instants of each result and loads (t, 6) at them.
    """
    label = next(ply.material for ply in model.section.plies if ply.name == name)
    material = model.section.materials[label]
    by_mode = load_factor * np.array([prod(gamma.ultimate), prod(gamma.interfibre), prod(gamma.interfibre)])
    part = PlyStates(
        *(x[inside].real for x in (states.ply, states.wall, states.position, states.strain, states.stress))
    )
    best, point_index, largest = (-1.0, "", 0, 0.0, 0), np.zeros(len(inside)), np.zeros(3)
    low, high = np.full(len(inside), inf), np.full(len(inside), -inf)
    for r, (loads, time) in enumerate(zip(series, times, strict=True)):
        strain, stress = part.under(loads)
        parts = by_mode * stress_indices(material, stress), by_mode * strain_indices(material, strain)
        wu = np.nan_to_num(tsai_wu_index(material, stress * np.insert(by_mode, 2, [1.0, 1.0, 1.0])), nan=0.0)
        every = np.concatenate([*parts, wu[..., None]], axis=-1)
        largest = np.maximum(largest, [parts[0].max(), parts[1].max(), wu.max()])
        point_index = np.maximum(point_index, every.max(axis=(0, 2)))
        t, q, kind = np.unravel_index(int(every.argmax()), every.shape)
        if every[t, q, kind] > best[0]:
            mode = "Tsai-Wu" if kind == 6 else f"{MODES[kind % 3]} {('stress', 'strain')[kind // 3]}"
            best = (float(every[t, q, kind]), mode, r, float(time[t]), int(q))
        low, high = np.minimum(low, stress[..., 0].min(axis=0)), np.maximum(high, stress[..., 0].max(axis=0))
    damage, judged = float("nan"), not unjudged_words(label, material)
    if judged and material.Xt and material.Xc and material.fatigue_exponent:
        both, damage = (prod(gamma.ultimate), prod(gamma.fatigue)), 0.0
        for unit in part.stress[np.argsort(low - high)[:COUNTED], 0]:
            cycles = (rainflow_cycles(loads @ unit) for loads in whole)
            each = (goodman_damage(c, material.Xt, material.Xc, material.fatigue_exponent, both) for c in cycles)
            damage = max(damage, float(sum(n * d for n, d in zip(repeated, each, strict=True))))
    x, y = part.position[best[4]].real
    at, top = (float(x), float(y)), best[0] if judged else float("nan")
    three = float(largest[0]), float(largest[1]), float(largest[2])
    layer = LayerStrength(place, name, label, *three, top, best[1], best[2], best[3], at, damage)
    return layer, point_index if judged else np.full(len(inside), np.nan)


def panel_strength(
    place: float, model: SectionModel, states: PlyStates, series: Sequence[Float], times: Sequence[Float], factor: float
) -> list[PanelStrength]:
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
        critical, unit = critical_load(D, width), share @ forces[walls]
        compression = [-loads @ unit for loads in series]
        r = int(np.argmax([c.max() for c in compression]))
        t = int(compression[r].argmax())
        load = max(float(compression[r][t]), 0.0)
        side = "suction side" if mesh.walls[walls[0]].nodes[0] < leading else "pressure side"
        found.append(PanelStrength(place, side, width, critical, load, factor * load / critical, r, float(times[r][t])))
    return found


def wall_forces(model: SectionModel, states: PlyStates) -> NDArray[Any]:
    """(walls, 6) axial force per width [N/m] of each wall by unit loads (G-15)."""
    forces = np.zeros((len(model.mesh.walls), 6))
    faces = states.stress.real[:, (0, 1, 5)]
    for w, wall in enumerate(model.mesh.walls):
        for i, thickness in wall.plies if not wall.link else ():
            c, s = np.cos(model.section.plies[i].angle), np.sin(model.section.plies[i].angle)
            at = (states.wall == w) & (states.ply == i)
            forces[w] += thickness.real * np.array([c * c, s * s, -2.0 * c * s]) @ faces[at].mean(axis=0)
    return forces
