"""Description of a floating platform: a rigid body in potential flow, on mooring lines."""

from __future__ import annotations

from typing import Any, Literal, Self, get_args

import numpy as np
from pydantic import Field, model_validator

from meltemi.compiler import MAX_LINES
from meltemi.core.record import Array, Record, Vector
from meltemi.floating.members import Member
from meltemi.floating.members import at_rest as displaced
from meltemi.floating.moorings import MooringLine, MooringPoint, at_rest, shapes, strings
from meltemi.turbine.definition import BaseMotion, Foundation, Tower
from meltemi.turbine.plausibility import doubt

STATIC_TENSIONS = (
    "mooring lines in their static shapes: their tensions lack the waves that run along lines. In wind of 14 m/s and a "
    "sea of 3 m and 9 s their equivalent loads are 24 to 93 % too small, their standard deviations up to 88 %; set "
    "platform.line_model: dynamic for tensions"
)
"""Warning about the tensions of static lines; errors of the library's floaters, docs/guide/floating.md."""
SAME_VOLUME = 0.01
"""Largest deviation of volumes that count as equal."""
OFF_BED = 0.02
"""Height of an anchor above the sea bed, over the depth, from which on it hangs in the water."""


class Body(Record):
    """One of several bodies to which potential flow is known, with axes parallel to those of the platform."""

    place: Vector
    """(3,) [m] point about which its motions turn."""
    volume: float = Field(ge=0.0)
    """[m^3] volume of the water that it displaces at rest."""
    members: tuple[str, ...] = ()
    """Members of the frame of a flexible platform over which its loads spread."""


class Platform(Record):
    """A floating platform. Heights are above still water, positions from the tower's axis, in inertial axes at rest."""

    depth: float = Field(gt=1.0)
    """[m; 20 to 3000] depth of the water."""
    mass: float = Field(gt=0.0)
    """[kg] mass with ballast, without tower."""
    centre: Vector
    """(3,) [m; 0.3 to 130] centre of mass."""
    inertia: Vector
    """(3,) [kg m^2] moments of inertia about the axes x, y, z through the centre of mass."""
    volume: float = Field(gt=0.0)
    """[m^3] volume of the displaced water at rest."""
    buoyancy_centre: tuple[float, float] = (0.0, 0.0)
    """[m] x and y of the centre of this volume."""
    coefficients: str = ""
    """Name in the library, or beside the turbine's file a compact file (.npz), a dataset of Capytaine (.nc), or the
    common path of WAMIT files .1, .3, .hst, .12d and .12s; about the point on the tower's axis at still water, without
    the platform's weight. Without, the members have it all."""
    bodies: tuple[Body, ...] = ()
    """Bodies of the coefficients, if they are those of several, in the order of their motions 1 to 6, 7 to 12, ..."""
    linear_damping: Array | None = None
    """(6, 6) [N s/m, N s, N m s] linear damping: force against the velocity."""
    quadratic_damping: Array | None = None
    """(6, 6) [N s^2/m^2 ..] force against velocity times its absolute value, each in the platform's axes."""
    stiffness: Array | None = None
    """(6, 6) [N/m, N/rad, N m/rad] stiffness besides that of water and lines."""
    excitation: Literal["at_rest", "displaced"] = "at_rest"
    """First-order forces of the waves at place and heading of the platform at rest; or where it is, which costs more
    time and needs coefficients of all headings."""
    drift: Literal["none", "mean", "newman", "full"] = "none"
    """Forces of second order at difference frequencies."""
    drift_directions: Literal["given", "turned"] = "given"
    """Waves in directions that the drift coefficients lack are refused; or have the forces of the direction that they
    have, turned with the waves: exact for bodies of revolution alone."""
    drift_cutoff: float = Field(default=0.75, gt=0.0)
    """[rad/s; 0.25 to 2] highest difference frequency of the drift forces."""
    sum_forces: bool = False
    """Forces of second order at sums of frequencies, from a file .12s, at all of its frequencies."""
    lines: tuple[MooringLine, ...] = Field(default=(), max_length=MAX_LINES)
    points: dict[str, MooringPoint] = Field(default={})
    """Free points of the lines, by name."""
    line_model: Literal["static", "dynamic"] = "dynamic"
    """Moving lines, as points of ``segments``; or in their static shapes, with an estimate of drag and inertia, whose
    tensions lack most of what fatigues."""
    segments: int = Field(default=30, ge=4, le=400)
    """Number of segments of a moving line."""
    members: tuple[Member, ...] = ()
    """Columns, pontoons, plates: for pictures, and for what potential flow lacks (Morison)."""
    water_density: float = Field(default=1025.0, gt=0.0)
    """[kg/m^3; 980 to 1060] density of the water."""
    source: str = ""

    @property
    def line_words(self) -> str:
        """Text about the lines and how they are computed; empty without lines."""
        kind = "in their static shapes" if self.line_model == "static" else f"moving, of {self.segments} segments each"
        return f"{len(self.lines)} mooring lines, {kind}" if self.lines else ""

    @property
    def tension_warning(self) -> str:
        """Note on what tensions of static lines do not include; empty for moving ones."""
        return STATIC_TENSIONS if self.lines and self.line_model == "static" else ""

    def view_shape(self) -> dict[str, Any]:
        """Shape for views: depth [m], members with their ends and diameters [m], lines as points in equilibrium."""
        members = [[*each.start.tolist(), *each.end.tolist(), *each.diameters] for each in self.members]
        rest = at_rest(self.lines, self.points, self.depth, self.water_density)
        lines = [shape.round(2).tolist() for shape in shapes(rest, self.lines, self.water_density)]
        return {"depth": self.depth, "floats": True, "members": members, "lines": lines}

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name in ("centre", "inertia"):
            if len(getattr(self, name)) != 3:
                raise ValueError(f"{name} must have 3 entries, along x, y, z, found {len(getattr(self, name))}")
        if self.bodies and not self.coefficients:
            raise ValueError("bodies: they are those of coefficients of potential flow; give coefficients")
        for i, body in enumerate(self.bodies):
            if len(body.place) != 3:
                raise ValueError(f"bodies: place of body {i + 1} must be x, y, z, found {len(body.place)} numbers")
        if self.bodies and abs((total := sum(each.volume for each in self.bodies)) / self.volume - 1.0) > SAME_VOLUME:
            raise ValueError(
                f"bodies displace {total:.5g} m^3 of water, and volume is {self.volume:.5g}; correct either"
            )
        if np.any(self.inertia <= 0.0):
            raise ValueError("inertia must be above 0")
        if not self.coefficients:
            volume = displaced(self.members)[0]
            if abs(volume - self.volume) > SAME_VOLUME * self.volume:
                raise ValueError(
                    f"members displace {volume:.5g} m^3 of water, and volume is {self.volume:.5g}; correct either, "
                    "or give coefficients of potential flow"
                )
        for name in ("linear_damping", "quadratic_damping", "stiffness"):
            value = getattr(self, name)
            if value is not None and value.shape != (6, 6):
                raise ValueError(f"{name} must have shape (6, 6), but has {value.shape}")
        for i, line in enumerate(self.lines):
            if not isinstance(line.anchor, str) and line.anchor[2] < -self.depth - 1e-3:
                raise ValueError(
                    f"lines: anchor {i + 1} at {line.anchor[2]:g} m is below the sea bed at -{self.depth:g} m"
                )
        strings(self.lines, self.points)
        return self

    def check_fit(self, tower: Tower, foundation: Foundation | None) -> None:
        """Check that the base of a tower can move with it.

        Raises:
          ValueError: the base of this tower cannot move.
        """
        motions = get_args(BaseMotion)
        if foundation is None or tuple(foundation.motions) != motions:
            raise ValueError(
                f"platform: the base of the tower must move: give foundation.motions: [{', '.join(motions)}] and a "
                "foundation.stiffness of zeros"
            )
        if tower.base_height < 0.0:
            raise ValueError(f"tower.base_height {tower.base_height:g} m is under water")

    def doubts(self, turbine: Any) -> list[str]:
        """Doubts about implausible values: weight, inertia, damping and members against its volume; places; lines."""
        tower, lines = turbine.tower, enumerate(self.lines)
        size, water = self.volume ** (1.0 / 3.0), self.water_density * self.volume
        weight = self.mass + turbine.nacelle.mass + turbine.hub.mass + float(np.trapezoid(tower.mass, tower.position))
        gyration = np.sqrt(self.inertia / self.mass) / size
        over = "over the cube root of volume"
        doubts = [
            doubt("platform.mass", "it and the turbine's over that of the water displaced", weight / water, 0.45, 1.02),
            doubt("platform.inertia", f"largest radius of gyration {over}", float(gyration.max()), 0.35, 2.5),
            doubt("platform.inertia", f"smallest radius of gyration {over}", float(gyration.min()), 0.1, 2.0),
        ]
        for key, place in (("buoyancy_centre", self.buoyancy_centre), ("centre", self.centre[:2])):
            doubts.append(
                doubt(f"platform.{key}", f"its distance from the axis {over}", float(np.hypot(*place)) / size, 0.0, 1.0)
            )
        for name, scale, least, most in (
            ("linear_damping", water, 3e-4, 0.5),
            ("quadratic_damping", self.water_density * size**2, 0.06, 60.0),
        ):
            if (matrix := getattr(self, name)) is not None and (largest := float(np.abs(matrix[:3, :3]).max())) > 0.0:
                what = f"of x, y, z over {'mass' if name == 'linear_damping' else 'density and area'} of the water"
                doubts.append(doubt(f"platform.{name}", what, largest / scale, least, most))
        if self.members:
            low, *_, high = sorted(float(end[2]) for each in self.members for end in (each.start, each.end))
            doubts.append(
                doubt("platform.centre", "its height [m], between those of members,", float(self.centre[2]), low, high)
            )
            share = displaced(self.members)[0] / self.volume
            doubts.append(doubt("platform.members", "volume of those under water over volume", share, 0.6, 1.1))
        for i, line in lines:
            key = f"platform.lines.{i}"
            doubts += line.ratios(key)
            if not isinstance(line.fairlead, str):
                away = float(np.hypot(*line.fairlead[:2])) / size
                doubts.append(doubt(f"{key}.fairlead", f"its distance from the axis {over}", away, 0.1, 5.0))
            if not isinstance(line.anchor, str):
                off, most = float(line.anchor[2] + self.depth), OFF_BED * self.depth
                doubts.append(doubt(f"{key}.anchor", "its height above the sea bed [m]", off, -1.0, most))
        return doubts
