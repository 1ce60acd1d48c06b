"""The layup of the blade in a design: its sections and their derivatives by thickness and chord (G-9a, G-9b)."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.designs.settings import LayupSetting
from meltemi.designs.splines import spline_rows
from meltemi.sections.blade import MODELS, Model, distances, section_matrices, stations_of, with_matrices
from meltemi.sections.files import find_layup
from meltemi.sections.layup import Curve, Layup
from meltemi.turbine.definition import Turbine
from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[np.float64]
Matrices = tuple[Float, Float]
COMPLEX_STEP = 1e-30
CHORD = ""
"""In place of the name of a layer: the chord."""
DEGREE = 2 + np.add.outer(np.arange(6) // 3, np.arange(6) // 3)
"""Degree of the entries of the matrices in all lengths: forces by strains, of an area; moments by curvatures."""
OF_LAYUP = ("turbine.blade.structure.stiffness", "turbine.blade.structure.mass", "turbine.blade.structure.twist")
"""Paths of what the layup gives."""
KEPT = 4
"""Designs whose sections are remembered."""


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
          about: expand the sections to first order about this layup, for derivatives there (G-9a).

        Raises:
          InputError: a section cannot be computed.
        """
        K, M = self._matrices(layup) if about is None else self._expanded(layup, about)
        return with_matrices(turbine, layup, self.stations, K, M)

    def _matrices(self, layup: Layup) -> Matrices:
        with self.lock:
            key = layup.content_hash()
            if key not in self.known:
                self._remember(key, section_matrices(layup, self.stations, model=self.model))
            return self.known[key]  # type: ignore[return-value]

    def _remember(self, key: object, value: object) -> None:
        self.known[key] = value
        while len(self.known) > KEPT:
            self.known.pop(next(iter(self.known)))

    def _expanded(self, layup: Layup, about: Layup) -> Matrices:
        with self.lock:
            key = ("slopes", about.content_hash())
            if key not in self.known:
                self._remember(key, self._slopes(about))
            slopes: dict[str, Matrices] = self.known[key]  # type: ignore[assignment]
        K, M = (each.copy() for each in self._matrices(about))
        for name, (dK, dM) in slopes.items():
            ratio = _along(layup, name, self.stations) / _along(about, name, self.stations) - 1.0
            K += np.where(ratio == 0.0, 0.0, ratio)[:, None, None] * dK
            M += np.where(ratio == 0.0, 0.0, ratio)[:, None, None] * dM
        return K, M

    def _slopes(self, layup: Layup) -> dict[str, Matrices]:
        """Derivatives (S, 6, 6) of the matrices by relative changes of thickness, by complex steps, and of the chord.

        Matrices are homogeneous in all lengths: the derivative by the chord follows from that by all thickness (G-9b).
        """
        names = [*self.varied, *([CHORD] if self.of_chord else [])]
        found = {name: (np.zeros((len(self.stations), 6, 6)), np.zeros((len(self.stations), 6, 6))) for name in names}
        section = MODELS[self.model]
        for i, station in enumerate(map(float, self.stations)):
            plies = {ply.name for ply in layup.section(station).plies}
            for name in names:
                moved = plies if name == CHORD else plies & {name}
                if not moved:
                    continue
                made = section(layup.section(station, dict.fromkeys(moved, 1.0 + COMPLEX_STEP * 1j)))
                for slopes, matrix in zip(found[name], (made.stiffness, made.mass), strict=True):
                    by_thickness = matrix.imag / COMPLEX_STEP
                    slopes[i] = DEGREE * matrix.real - by_thickness if name == CHORD else by_thickness
        return found


def _along(layup: Layup, name: str, stations: Float) -> Float:
    """(S,) thickness of a layer, or the chord."""
    curve = layup.chord if name == CHORD else next(layer for layer in layup.layers if layer.name == name).thickness
    values: Float = np.interp(stations, curve.grid, curve.values)
    return values


def layers_of(layup: Layup, pattern: str) -> list[str]:
    """Names of the layers of a variable; ``*`` stands for any text.

    Raises:
      InputError: there is none.
    """
    names = [layer.name for layer in layup.layers]
    found = [name for name in names if fnmatchcase(name, pattern)]
    if not found:
        raise InputError(f"variables: {layup.name} has no layer {pattern!r}: {did_you_mean(pattern, names)}")
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
