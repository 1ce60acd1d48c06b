"""Layup of a blade, and its section at one station.

Frame of a section: that of ``blade.structure``, x along the flap direction towards the suction side, y along the chord
towards the trailing edge, z towards the tip, origin on the reference axis. The contour is the outer surface. It begins
at the middle of the trailing edge and runs along the suction side, round the leading edge and back along the pressure
side; arcs are fractions of its length, as in windIO. Layers are listed from the outside to the inside.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, model_validator

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Array, Record, Vector

Numbers = NDArray[Any]
"""Floats, or complex numbers whose imaginary part carries a derivative."""
EDGE = np.linspace(0.0, 0.03, 121)
ARCS = np.unique(np.concatenate([EDGE, np.linspace(0.0, 1.0, 401), 1.0 - EDGE]))
"""Arcs of the points of a blended contour, dense about the corners of trailing edges."""


class Curve(Record):
    """A quantity along the blade, linear between its points; what it describes ends with its grid."""

    grid: Vector
    """(G,) fractions of the span, increasing."""
    values: Vector
    """(G,)"""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.grid) < 2 or np.any(np.diff(self.grid) <= 0.0) or len(self.values) != len(self.grid):
            raise ValueError("grid must have two or more numbers that increase, and values one for each")
        return self

    def at(self, station: float) -> float:
        """The value at a fraction of the span; the nearest one outside the grid."""
        return float(np.interp(station, self.grid, self.values))

    def covers(self, station: float) -> bool:
        """Whether the grid reaches over a station."""
        return bool(self.grid[0] - 1e-9 <= station <= self.grid[-1] + 1e-9)


def constant(value: float) -> Curve:
    """The same value from root to tip."""
    return Curve(grid=np.array([0.0, 1.0]), values=np.array([value, value]))


def _curve(value: Any) -> Any:
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return {"grid": [0.0, 1.0], "values": [value, value]}
    return value


Along = Annotated[Curve, BeforeValidator(_curve)]
"""A :class:`Curve`; a plain number is constant along the blade."""


class Material(Record):
    """An orthotropic material: 1 along the fibres, 2 across them in the plane of the layer, 3 through its thickness.

    Strengths are positive and may be missing.
    """

    density: float = Field(gt=0.0)
    """[kg/m^3]"""
    E1: float = Field(gt=0.0)
    """[Pa]"""
    E2: float = Field(gt=0.0)
    """[Pa]"""
    E3: float = Field(gt=0.0)
    """[Pa]"""
    G12: float = Field(gt=0.0)
    """[Pa]"""
    G13: float = Field(gt=0.0)
    """[Pa]"""
    G23: float = Field(gt=0.0)
    """[Pa]"""
    nu12: float
    """Strain along 2 over that along 1, with opposite sign, under stress along 1."""
    nu13: float
    nu23: float
    Xt: float | None = Field(default=None, gt=0.0)
    """[Pa] strength along 1 in tension."""
    Xc: float | None = Field(default=None, gt=0.0)
    """[Pa] strength along 1 in compression."""
    Yt: float | None = Field(default=None, gt=0.0)
    """[Pa] strength along 2 in tension."""
    Yc: float | None = Field(default=None, gt=0.0)
    """[Pa] strength along 2 in compression."""
    S12: float | None = Field(default=None, gt=0.0)
    """[Pa] strength in shear in the plane of the layer."""
    fatigue_exponent: float | None = Field(default=None, gt=1.0)
    """Wöhler exponent along the fibres."""
    across_exponent: float | None = Field(default=None, gt=1.0)
    """Wöhler exponent across the fibres."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if np.any(np.linalg.eigvalsh(self.compliance) <= 0.0):
            raise ValueError(
                "these moduli and Poisson ratios are not those of a stable material: its strain energy is not "
                "positive (windIO lists nu as 12, 13, 23)"
            )
        return self

    @property
    def compliance(self) -> NDArray[np.float64]:
        """(6, 6) [1/Pa] strains from stresses, in the order 11, 22, 33, 23, 13, 12."""
        S = np.zeros((6, 6))
        S[0, 0], S[1, 1], S[2, 2] = 1.0 / self.E1, 1.0 / self.E2, 1.0 / self.E3
        S[0, 1] = S[1, 0] = -self.nu12 / self.E1
        S[0, 2] = S[2, 0] = -self.nu13 / self.E1
        S[1, 2] = S[2, 1] = -self.nu23 / self.E2
        S[3, 3], S[4, 4], S[5, 5] = 1.0 / self.G23, 1.0 / self.G13, 1.0 / self.G12
        return S

    @cached_property
    def stiffness(self) -> NDArray[np.float64]:
        """(6, 6) [Pa] stresses from strains, in the order 11, 22, 33, 23, 13, 12."""
        return np.asarray(np.linalg.inv(self.compliance), dtype=np.float64)

    @cached_property
    def plane(self) -> NDArray[np.float64]:
        """(3, 3) [Pa] stresses 11, 22, 12 from strains, where 33, 23 and 13 carry no stress."""
        return np.asarray(np.linalg.inv(self.compliance[np.ix_([0, 1, 5], [0, 1, 5])]), dtype=np.float64)


class Layer(Record):
    """A layer of the shell or of a web."""

    name: str
    material: str
    thickness: Along
    """[m]"""
    angle: Along = constant(0.0)
    """[rad] of the fibres from the blade's axis: towards the leading edge on both sides, towards the pressure side on
    webs."""
    start: Along = constant(0.0)
    """Arc at which it begins: of the contour, or of the web from its suction side."""
    end: Along = constant(1.0)
    """Arc at which it ends."""
    web: str | None = None
    """The web that it belongs to."""


class Web(Record):
    """A plane shear web between two points of the contour."""

    name: str
    start: Along
    """Arc on the suction side."""
    end: Along
    """Arc on the pressure side."""


class Shape(Record):
    """Shape of an airfoil."""

    thickness: float = Field(gt=0.0, le=1.0)
    """Thickness over chord."""
    coordinates: Array
    """(P, 2) along the chord and towards the suction side, chord 1; from the trailing edge over the suction side."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.coordinates.ndim != 2 or self.coordinates.shape[1] != 2 or len(self.coordinates) < 4:
            raise ValueError("coordinates must be a list of four or more pairs")
        return self

    @cached_property
    def even(self) -> NDArray[np.float64]:
        """(len(ARCS), 2) the contour from the middle of the trailing edge, at arcs ``ARCS``."""
        c = self.coordinates
        middle = 0.5 * (c[:1] + c[-1:])
        c = np.concatenate([middle, c, middle])
        length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(c, axis=0).T))])
        keep = np.concatenate([[True], np.diff(length) > 1e-9])
        s = ARCS * length[-1]
        return np.stack([np.interp(s, length[keep], column[keep]) for column in c.T], axis=1)


class Layup(Record):
    """Shapes, webs, layers and materials of a blade."""

    name: str
    position: Along
    """[m] distance from the root along the blade's axis."""
    chord: Along
    """[m]"""
    offset_y: Along
    """[m] distance of the leading edge from the reference axis, along the chord."""
    offset_x: Along = constant(0.0)
    """[m] distance of the chord from the reference axis, towards the suction side."""
    thickness: Along
    """Thickness over chord, by which shapes are blended."""
    shapes: tuple[Shape, ...] = Field(min_length=1)
    materials: dict[str, Material]
    webs: tuple[Web, ...] = ()
    layers: tuple[Layer, ...] = Field(min_length=1)
    source: str = ""

    @model_validator(mode="after")
    def _check(self) -> Self:
        webs = {web.name for web in self.webs}
        for layer in self.layers:
            if layer.material not in self.materials:
                raise ValueError(
                    f"layer {layer.name}: no material {layer.material!r}: "
                    f"{did_you_mean(layer.material, self.materials)}"
                )
            if layer.web is not None and layer.web not in webs:
                raise ValueError(f"layer {layer.name}: no web {layer.web!r}: {did_you_mean(layer.web, webs)}")
        return self

    @cached_property
    def blend(self) -> Callable[[float], NDArray[np.float64]]:
        """Contour of chord 1 by thickness."""
        known = {shape.thickness: shape.even for shape in self.shapes}
        order = np.array(sorted(known))
        if len(order) < 2:
            return lambda t: known[order[0]]
        from scipy.interpolate import PchipInterpolator

        curve = PchipInterpolator(order, np.stack([known[t] for t in order]), axis=0)
        return lambda t: np.asarray(curve(np.clip(t, order[0], order[-1])))

    def contour(self, station: float) -> NDArray[np.float64]:
        """(P, 2) [m] the outer surface at a station: shapes blended by thickness (PCHIP), arc by arc."""
        along, across = self.blend(self.thickness.at(station)).T
        chord = self.chord.at(station)
        return np.stack([chord * across + self.offset_x.at(station), chord * along - self.offset_y.at(station)], axis=1)

    def section(self, station: float, factors: Mapping[str, complex] | None = None) -> Section:
        """The section at a station.

        Args:
          station: fraction of the span.
          factors: factors of thickness by the name of a layer; complex ones carry a derivative through all that
            follows.

        Raises:
          InputError: the station is outside the blade, a name is unknown, or there is no layer.
        """
        if not 0.0 <= station <= 1.0:
            raise InputError(f"station {station:g}: expected a fraction of the span, 0 to 1")
        factors = factors or {}
        names = {layer.name for layer in self.layers}
        for name in factors:
            if name not in names:
                raise InputError(f"factors: {self.name} has no layer {name!r}: {did_you_mean(name, names)}")
        contour = self.contour(station)
        webs = [web for web in self.webs if web.start.covers(station)]
        order = {web.name: i for i, web in enumerate(webs)}
        s = arcs(contour)
        y = contour[:, 1]
        leading = float(np.mean(s[y <= y.min() + 1e-6 * np.ptp(y)]))
        plies: list[Ply] = []
        for layer in self.layers:
            thickness = layer.thickness.at(station)
            start, end = layer.start.at(station), layer.end.at(station)
            if not layer.thickness.covers(station) or thickness < THINNEST or end - start < SHORTEST:
                continue
            if layer.web is not None and layer.web not in order:
                continue
            web = None if layer.web is None else order[layer.web]
            angle = layer.angle.at(station)
            t = thickness * factors.get(layer.name, 1.0)
            pieces = [(start, end, angle)]
            if web is None and angle:  # towards the leading edge: along the arc before it, against it behind
                pieces = [(start, min(end, leading), angle), (max(start, leading), end, -angle)]
            for a, b, turned in pieces:
                if b - a >= SHORTEST:
                    plies.append(Ply(layer.name, layer.material, t, turned, a, b, web))
        used = {ply.web for ply in plies}
        kept = [i for i in range(len(webs)) if i in used]
        if None not in used:
            raise InputError(f"{self.name}: no layer of the shell at station {station:g}")
        plies = [ply if ply.web is None else replace(ply, web=kept.index(ply.web)) for ply in plies]
        lines = [WebLine(webs[i].name, webs[i].start.at(station), webs[i].end.at(station)) for i in kept]
        return Section(f"{self.name} at {station:g}", contour, tuple(plies), tuple(lines), self.materials)


THINNEST = 1e-6
"""[m] a thinner layer is absent."""
SHORTEST = 1e-5
"""Arc; a narrower layer is absent."""


def arcs(contour: Numbers) -> NDArray[np.float64]:
    """(P,) fractions of the length of a contour, closed by its first point if that is not its last."""
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(contour, axis=0).T.real))])
    fractions: NDArray[np.float64] = length / length[-1]
    return fractions


@dataclass(frozen=True)
class Ply:
    """A layer at one station.

    Attributes:
      name: of the layer.
      material: its name.
      thickness: [m], real or complex.
      angle: [rad] of the fibres from z, towards increasing arcs.
      start, end: arcs of the contour, or of the web.
      web: index of the web, None on the shell.
    """

    name: str
    material: str
    thickness: complex
    angle: float
    start: float = 0.0
    end: float = 1.0
    web: int | None = None


@dataclass(frozen=True)
class WebLine:
    """A web at one station: the arcs of the contour at which it begins and ends."""

    name: str
    start: float
    end: float


@dataclass(frozen=True)
class Section:
    """A section at one station; walls are where plies are, so that open sections are described, too.

    Attributes:
      name: for messages and titles.
      contour: (P, 2) [m] outer surface, x and y, closed, from the trailing edge along the suction side.
      plies: from the outside to the inside; those of a web from its side of smaller y to the other.
      webs: straight lines across the section.
      materials: by name.
    """

    name: str
    contour: Numbers
    plies: tuple[Ply, ...]
    webs: tuple[WebLine, ...]
    materials: Mapping[str, Material]
