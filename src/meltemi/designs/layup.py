"""The layup of the blade in a design: its sections and their derivatives by thickness and chord (D-19, D-20)."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.designs.kept import keep
from meltemi.designs.settings import LayupSetting
from meltemi.designs.splines import spline_rows
from meltemi.sections.blade import MODELS, Model, distances, load_rotation, stations_of, with_matrices
from meltemi.sections.files import find_layup
from meltemi.sections.layup import Curve, Layup
from meltemi.sections.properties import SectionModel
from meltemi.turbine.definition import Turbine
from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[np.float64]
Numbers = NDArray[Any]
COMPLEX_STEP = 1e-30
CHORD = ""
"""In place of the name of a layer: the chord."""
OF_LAYUP = ("turbine.blade.structure.stiffness", "turbine.blade.structure.mass", "turbine.blade.structure.twist")
"""Paths of what the layup gives."""
KEPT = 8
"""Sections of designs, and derivatives, that are remembered."""


@dataclass(frozen=True)
class DesignLayup:
    """Sections of a blade as functions of a design.

    Attributes:
      start: layup at the start.
      turbine: turbine at the start, whose chord belongs to it.
      stations: (S,) fractions of the span.
      model: of the sections.
      varied: names of the layers whose thickness variables change.
      of_chord: whether a variable changes the chord.
    """

    start: Layup
    turbine: Turbine
    stations: Float
    model: Model
    varied: frozenset[str]
    of_chord: bool
    known: dict[object, object] = field(default_factory=dict, repr=False, compare=False)
    lock: threading.RLock = field(default_factory=threading.RLock, repr=False, compare=False)

    def changed(self, turbine: Turbine, factors: Mapping[str, Sequence[float] | Float]) -> Layup:
        """The layup of a design.

        Args:
          turbine: its chord over that at the start scales the sections.
          factors: by a pattern of names of layers: (K,) factors on thickness, at knots from a layer's first to its last
            station.
        """
        layers = []
        for layer in self.start.layers:
            grid, t = layer.thickness.grid, layer.thickness.values
            for pattern, f in factors.items():
                if fnmatchcase(layer.name, pattern):
                    inside = self.stations[(self.stations > grid[0]) & (self.stations < grid[-1])]
                    finer = np.unique(np.concatenate([grid, inside]))
                    span = (finer - finer[0]) / (finer[-1] - finer[0])
                    along = np.asarray(f) @ spline_rows(span, len(f)) if len(f) > 1 else f[0]
                    grid, t = finer, along * np.interp(finer, grid, t)
            layers.append(layer.replace(thickness=Curve(grid=grid, values=t)))
        shape = {}
        if self.of_chord:
            curves = {name: getattr(self.start, name) for name in ("chord", "offset_x", "offset_y")}
            grid = np.unique(np.concatenate([self.stations, *(curve.grid for curve in curves.values())]))
            old, new = self.turbine.blade.aerodynamics, turbine.blade.aerodynamics
            scale = np.interp(distances(turbine, self.start, grid), old.position, new.chord / old.chord)
            shape = {
                name: Curve(grid=grid, values=scale * np.interp(grid, curve.grid, curve.values))
                for name, curve in curves.items()
            }
        return self.start.replace(layers=tuple(layers), **shape)

    def blade(self, turbine: Turbine, layup: Layup, about: Layup | None = None) -> Turbine:
        """The turbine with the sections of a layup.

        Args:
          turbine: the design without them.
          layup: its layup.
          about: expand the sections to first order about this layup, for derivatives there (D-19).

        Raises:
          InputError: a section cannot be computed.
        """
        K, M = zip(*self._sections(layup, self.stations, MATRICES, about), strict=True)
        return with_matrices(turbine, layup, self.stations, np.stack(K), np.stack(M))

    def strains(
        self, turbine: Turbine, layup: Layup, layers: str, places: Float, about: Layup | None = None
    ) -> Float:  # fmt: skip
        """(S,) [1/(N m)] largest strains along the fibres of layers by a flapwise moment of 1 N m; 0 without them.

        Args:
          turbine: with the twist of the design.
          layup, about: as in :meth:`blade`.
          layers: pattern of names.
          places: (S,) [m] distances from the root.
        """
        stations = np.interp(places, distances(turbine, self.start, self.start.position.grid), self.start.position.grid)
        what = Quantity(layers, partial(_fibre_strains, layers), (STRAIN_DEGREE,))
        found = []
        for place, (rows,) in zip(places, self._sections(layup, stations, what, about), strict=True):
            axes = load_rotation(turbine, float(place))
            found.append(float(np.max(np.abs(rows @ axes[:, 4]), initial=0.0)))
        return np.array(found)

    def _sections(
        self, layup: Layup, stations: Float, what: Quantity, about: Layup | None = None
    ) -> list[tuple[Float, ...]]:
        """Quantities of the sections at stations; with ``about`` of first order (D-19)."""
        section, key = MODELS[self.model], (what.name, stations.tobytes())
        if about is None:
            made = lambda: [what.of(section(layup.section(float(s)))) for s in stations]  # noqa: E731
            return self._known((*key, layup.content_hash()), made)
        near = self._sections(about, stations, what)
        slopes = self._known((*key, about.content_hash(), "slopes"), lambda: self._slopes(about, stations, what))
        found = []
        for station, values, by in zip(stations, near, slopes, strict=True):
            ratios = {name: _along(layup, name, station) / _along(about, name, station) - 1.0 for name in by}
            found.append(tuple(
                value + sum(ratio * by[name][k] for name, ratio in ratios.items()) for k, value in enumerate(values)
            ))  # fmt: skip
        return found

    def _slopes(self, layup: Layup, stations: Float, what: Quantity) -> list[dict[str, tuple[Float, ...]]]:
        """Derivatives by relative changes of thickness, by complex steps, and of the chord, at each station.

        Quantities are homogeneous in all lengths: the derivative by the chord follows from that by all thickness
        (D-20).
        """
        section, found = MODELS[self.model], []
        for station in map(float, stations):
            plies = {ply.name for ply in layup.section(station).plies}
            moved = {name: {name} for name in sorted(self.varied & plies)} | ({CHORD: plies} if self.of_chord else {})
            here: dict[str, tuple[Float, ...]] = {}
            for name, layers in moved.items():
                values = what.of(section(layup.section(station, dict.fromkeys(layers, 1.0 + COMPLEX_STEP * 1j))))
                slopes = [value.imag / COMPLEX_STEP for value in values]
                if name == CHORD:
                    slopes = [d * v.real - by for d, v, by in zip(what.degrees, values, slopes, strict=True)]
                here[name] = tuple(slopes)
            found.append(here)
        return found

    def _known(self, key: object, make: Callable[[], Any]) -> Any:
        with self.lock:
            return self.known[key] if key in self.known else keep(self.known, key, make(), KEPT)


@dataclass(frozen=True)
class Quantity:
    """Arrays that follow from a section.

    Attributes:
      name: of the quantity.
      of: the arrays of a section.
      degrees: of their homogeneity in all lengths.
    """

    name: str
    of: Callable[[SectionModel], tuple[Numbers, ...]]
    degrees: tuple[NDArray[np.intp], ...]


DEGREE = 2 + np.add.outer(np.arange(6) // 3, np.arange(6) // 3)
"""Degree of the entries of the matrices in all lengths: forces by strains, of an area; moments by curvatures."""
MATRICES = Quantity("matrices", lambda made: (made.stiffness, made.mass), (DEGREE, DEGREE))
STRAIN_DEGREE = np.array([-2, -2, -2, -3, -3, -3])
"""Degree of strains by forces and moments."""


def _fibre_strains(layers: str, made: SectionModel) -> tuple[Numbers, ...]:
    """(Q, 6) strains along the fibres by unit loads at the points of layers."""
    states = made.states()
    chosen = [fnmatchcase(made.section.plies[i].name, layers) for i in states.ply]
    return (states.strain[chosen, 0],)


def _along(layup: Layup, name: str, station: float) -> float:
    """Thickness of a layer, or the chord, at a station."""
    curve = layup.chord if name == CHORD else next(layer for layer in layup.layers if layer.name == name).thickness
    return curve.at(station)


def layers_of(layup: Layup, pattern: str, where: str = "variables") -> list[str]:
    """Names of the layers of a variable or term; ``*`` stands for any text.

    Raises:
      InputError: there is none.
    """
    names = [layer.name for layer in layup.layers]
    found = [name for name in names if fnmatchcase(name, pattern)]
    if not found:
        raise InputError(f"{where}: {layup.name} has no layer {pattern!r}: {did_you_mean(pattern, names)}")
    return found


def design_layup(setting: LayupSetting, turbine: AnyTurbine, folder: Path, paths: Iterable[str]) -> DesignLayup:
    """The layup of a design.

    Args:
      setting: of the design's file.
      turbine: at the start.
      folder: to which paths of files are relative.
      paths: of the variables.

    Raises:
      InputError: the file cannot be read, is of another blade, or a variable changes what follows from the layup.
    """
    if not isinstance(turbine, Turbine):
        raise InputError(f"layup: {turbine.name} has no blades")
    start = find_layup(setting.file, folder)
    stations = stations_of(turbine, start) if setting.stations is None else np.linspace(0.0, 1.0, setting.stations)
    given = list(paths)
    if follows := [p for p in given if p.startswith(OF_LAYUP)]:
        raise InputError(
            f"variables: {follows[0]!r} follows from the layup: change layup.LAYER, chord or twist instead"
        )
    varied = {name for p in given if p.startswith("layup.") for name in layers_of(start, p.removeprefix("layup."))}
    of_chord = any(p.startswith("turbine.blade.aerodynamics.chord") for p in given)
    return DesignLayup(start, turbine, stations, setting.model, frozenset(varied), of_chord)
