"""Support structure of a turbine in the sea: a monopile from its toe, or from the mudline, to the tower base."""

from __future__ import annotations

from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from meltemi.core.record import Record, Vector
from meltemi.sea.soil import Soil
from meltemi.turbine.checks import per_station, positive, stations
from meltemi.turbine.definition import Foundation, Tower
from meltemi.turbine.plausibility import doubt


class PointMass(Record):
    """A flange, a platform, or a transition piece, on a short length of the pile."""

    height: float
    """[m] height of the upper end above mean sea level."""
    mass: float = Field(gt=0.0)
    """[kg; 500 to 2e6] mass."""
    inertia: float = Field(default=0.0, ge=0.0)
    """[kg m^2; 100 to 1e9] inertia about a horizontal axis through the centre."""
    yaw_inertia: float | None = Field(default=None, ge=0.0)
    """[kg m^2] inertia about the pile's axis; by default twice ``inertia``."""
    length: float = Field(default=0.5, gt=0.0)
    """[m; 0.1 to 30] length over which the mass is spread."""

    @property
    def about_axis(self) -> float:
        """Inertia [kg m^2] about the pile's axis."""
        return 2.0 * self.inertia if self.yaw_inertia is None else self.yaw_inertia


class Growth(Record):
    """Marine growth between two heights."""

    bottom: float
    """[m] lower end above mean sea level."""
    top: float
    """[m] upper end above mean sea level."""
    thickness: float = Field(gt=0.0, lt=1.0)
    """[m; 0.01 to 0.4] thickness of the growth."""
    density: float = Field(default=1325.0, gt=0.0)
    """[kg/m^3; 900 to 1700] density in air."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.bottom < self.top:
            raise ValueError(f"bottom {self.bottom:g} m must be below top {self.top:g} m")
        return self


class Hydrodynamics(Record):
    """Coefficients of Morison's equation for a vertical cylinder, over its outer diameter with marine growth."""

    drag: float | Vector = 1.0
    """Drag coefficient [-; 0.35 to 2]: one, or (S,) at the stations."""
    added_mass: float | Vector = 1.0
    """Added-mass coefficient [-; 0.35 to 2] of the cylinder's acceleration."""
    pressure: float | Vector = 1.0
    """Excess [-; 0.35 to 2] of the coefficient of the water's acceleration over that of added mass."""
    diffraction: Literal["none", "maccamy_fuchs"] = "none"
    """Inertia coefficient that depends on wave number times radius, for large diameters; then that of the description
    is of the current's drag and added mass only."""


class Support(Record):
    """A monopile, at stations from its foot to the tower base; steel in water."""

    depth: float = Field(gt=0.0, le=200.0)
    """[m; 3 to 100] depth of the water at mean sea level."""
    position: Vector
    """(S,) [m] heights above mean sea level, increasing, from the foot to the tower base; properties are linear in
    between."""
    diameter: Vector
    """(S,) [m; 1.8 to 12 at 100 m] outer diameter."""
    thickness: Vector
    """(S,) [m; 0.01 to 0.15 at 100 m] thickness of the wall."""
    elastic_modulus: float = Field(default=210e9, gt=0.0)
    """[N/m^2; 1.8e11 to 2.3e11] Young's modulus."""
    shear_modulus: float = Field(default=80.8e9, gt=0.0)
    """[N/m^2; 7e10 to 9e10] shear modulus."""
    density: float = Field(default=7850.0, gt=0.0)
    """[kg/m^3; 7000 to 9500] density of the steel, with fixtures along the pile."""
    shear_share: float = Field(default=0.5, gt=0.0, le=1.0)
    """Share of the section that carries shear [-; 0.4 to 1]: 0.5 for a thin tube (Cowper 1966)."""
    masses: tuple[PointMass, ...] = ()
    damping: float = Field(default=0.0, ge=0.0, lt=0.3)
    """Damping ratio of the first mode if all its stiffness were that of the pile's steel [-; 0.001 to 0.1]."""
    soil: Soil | None = None
    """Soil along the embedded part as springs; without it the foot is clamped, or on the springs of ``foundation``."""
    hydrodynamics: Hydrodynamics = Hydrodynamics()
    water_density: float = Field(default=1025.0, gt=0.0)
    """[kg/m^3; 980 to 1060] density of the water."""
    flooded: float | None = 0.0
    """[m] height of the water inside above mean sea level; none for a pile without."""
    growth: tuple[Growth, ...] = ()
    stations: Vector | None = None
    """(N,) [m] heights above mean sea level with channels of section loads; by default the foot and the mudline."""
    source: str = ""

    def view_shape(self) -> dict[str, Any]:
        """Geometry for views: depth [m], members from x, y, z to x, y, z with diameters at both ends [m]; no lines."""
        z, d = self.position, self.diameter
        ends = zip(z[:-1], z[1:], d[:-1], d[1:], strict=True)
        members = [[0.0, 0.0, float(a), 0.0, 0.0, float(b), float(c), float(e)] for a, b, c, e in ends]
        return {"depth": self.depth, "floats": False, "members": members, "lines": []}

    @model_validator(mode="after")
    def _check(self) -> Self:
        n = len(stations(self.position, "position"))
        per_station(self, "diameter thickness", n)
        positive(self, "diameter thickness")
        for name in ("drag", "added_mass", "pressure"):
            value = np.asarray(getattr(self.hydrodynamics, name))
            if value.ndim and len(value) != n:
                raise ValueError(f"hydrodynamics.{name} must have {n} entries like position, found {len(value)}")
            if np.any(value < 0.0):
                raise ValueError(f"hydrodynamics.{name} must be 0 or more")
        thick = np.flatnonzero(2.0 * self.thickness >= self.diameter)
        if len(thick):
            raise ValueError(f"thickness at station {thick[0] + 1} is more than half the diameter")
        foot, top = float(self.position[0]), float(self.position[-1])
        if foot > -self.depth + 1e-6 or top <= 0.0:
            raise ValueError(
                f"position must begin at the sea bed, at -{self.depth:g} m (depth), or below it and end above the "
                f"water, but is from {foot:g} to {top:g} m"
            )
        if self.flooded is not None and not foot <= self.flooded <= top:
            raise ValueError(
                f"flooded: {self.flooded:g} m above mean sea level is not in the pile, from {foot:g} to {top:g} m; "
                "none is a pile without water"
            )
        if self.soil is not None and foot > -self.depth - 1.0:
            raise ValueError(f"soil: position begins at {foot:g} m, so that no part of the pile is in the ground")
        for name, heights in (("masses", [each.height for each in self.masses]), ("stations", self.load_stations)):
            for height in heights:
                if not foot - 1e-6 <= height <= top + 1e-6:
                    raise ValueError(f"{name}: {height:g} m is not on the pile, from {foot:g} to {top:g} m")
        return self

    def check_fit(self, tower: Tower, foundation: Foundation | None) -> None:
        """Check the fit to the tower, and to the foundation, if any.

        Raises:
          ValueError: tower or foundation do not fit.
        """
        if abs(self.position[-1] - tower.base_height) > 1e-3:
            raise ValueError(
                f"support.position ends at {self.position[-1]:g} m, but tower.base_height is {tower.base_height:g} m"
            )
        if foundation is not None and (foundation.motions or self.soil is not None):
            raise ValueError("foundation: motions, or a support with soil, exclude it; remove one")

    def doubts(self, turbine: Any) -> list[str]:
        """Sentences about implausible values: wall, growth, and the mass of the pile over that of the structure."""
        foot, top = float(self.position[0]), float(self.position[-1])
        slender = self.diameter / self.thickness
        carried = turbine.nacelle.mass + float(np.trapezoid(turbine.tower.mass, turbine.tower.position))
        area = np.pi * self.thickness * (self.diameter - self.thickness)
        steel = self.density * float(np.trapezoid(area, self.position))
        sentences = [
            doubt("support.thickness", "diameter over it", float(slender.min()), 25.0, 250.0),
            doubt("support.thickness", "diameter over it", float(slender.max()), 25.0, 250.0),
            doubt("support", "mass of its steel over that of tower and nacelle", steel / carried, 0.1, 5.0),
            doubt(
                "support.elastic_modulus", "it over shear_modulus", self.elastic_modulus / self.shear_modulus, 2.4, 2.8
            ),
        ]
        for i, each in enumerate(self.masses):
            if each.inertia > 0.0:
                share = float(np.sqrt(each.inertia / each.mass) / np.interp(each.height, self.position, self.diameter))
                sentences.append(
                    doubt(f"support.masses.{i}.inertia", "radius of gyration over diameter", share, 0.1, 2.0)
                )
        for i, layer in enumerate(self.growth):
            if layer.bottom < foot or layer.top > min(top, 10.0):
                sentences.append(doubt(f"support.growth.{i}", "its top [m]", layer.top, foot, min(top, 10.0)))
                sentences.append(doubt(f"support.growth.{i}", "its bottom [m]", layer.bottom, foot, min(top, 10.0)))
        return list(dict.fromkeys(sentences))

    @property
    def load_stations(self) -> Any:
        """Heights [m] of the stations of section loads, increasing."""
        if self.stations is not None:
            return np.sort(self.stations)
        return np.unique([float(self.position[0]), -self.depth])
