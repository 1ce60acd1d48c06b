"""Description of a floating platform: a rigid body in potential flow, on mooring lines."""

from __future__ import annotations

from typing import Any, Literal, Self, get_args

import numpy as np
from pydantic import Field, model_validator

from meltemi.core.record import Array, Record, Vector
from meltemi.maths.tables import MAX_LINES
from meltemi.turbine.definition import BaseMotion, Foundation, Tower
from meltemi_float.members import Member
from meltemi_float.members import at_rest as displaced
from meltemi_float.moorings import MooringLine, MooringPoint, at_rest, shapes, strings

STATIC_TENSIONS = (
    "mooring lines in their static shapes: their tensions lack the waves that run along lines. In wind of 14 m/s and a "
    "sea of 3 m and 9 s their equivalent loads are 24 to 93 % too small, their standard deviations up to 88 %; set "
    "platform.line_model: dynamic for tensions"
)
"""What static lines lack; sizes of the library's floaters, docs/guide/floating.md."""
SAME_VOLUME = 0.01
"""Deviation of volumes that are the same."""


class Platform(Record):
    """A floating platform. Heights are above still water, positions from the tower's axis, in inertial axes at rest."""

    depth: float = Field(gt=1.0)
    """[m] of the water."""
    mass: float = Field(gt=0.0)
    """[kg] with ballast, without tower."""
    centre: Vector
    """(3,) [m] of mass."""
    inertia: Vector
    """(3,) [kg m^2] about the axes x, y, z through the centre of mass."""
    volume: float = Field(gt=0.0)
    """[m^3] of the water that it displaces at rest."""
    buoyancy_centre: tuple[float, float] = (0.0, 0.0)
    """[m] x and y of the centre of this volume."""
    coefficients: str = ""
    """Name in the library, or beside the turbine's file a compact file (.npz), a dataset of Capytaine (.nc), or the
    common path of WAMIT files .1, .3, .hst, .12d and .12s; about the point on the tower's axis at still water, without
    the platform's weight. Without, the members have it all."""
    linear_damping: Array | None = None
    """(6, 6) [N s/m, N s, N m s] force against the velocity."""
    quadratic_damping: Array | None = None
    """(6, 6) [N s^2/m^2 ..] force against velocity times its absolute value, each in the platform's axes."""
    stiffness: Array | None = None
    """(6, 6) [N/m, N/rad, N m/rad] besides that of water and lines."""
    excitation: Literal["at_rest", "displaced"] = "at_rest"
    """First-order forces of the waves at place and heading of the platform at rest; or where it is, which costs more
    time and needs coefficients of all headings."""
    drift: Literal["none", "mean", "newman", "full"] = "none"
    """Forces of second order at difference frequencies."""
    drift_directions: Literal["given", "turned"] = "given"
    """Waves in directions that the drift coefficients lack are refused; or have the forces of the direction that they
    have, turned with the waves: exact for bodies of revolution alone."""
    drift_cutoff: float = Field(default=0.75, gt=0.0)
    """[rad/s] highest difference frequency."""
    sum_forces: bool = False
    """Forces of second order at sums of frequencies, from a file .12s, at all of its frequencies."""
    lines: tuple[MooringLine, ...] = Field(default=(), max_length=MAX_LINES)
    points: dict[str, MooringPoint] = Field(default={})
    """Free points of the lines, by name."""
    line_model: Literal["static", "dynamic"] = "dynamic"
    """Moving lines, as points of ``segments``; or in their static shapes, with an estimate of drag and inertia, whose
    tensions lack most of what fatigues."""
    segments: int = Field(default=30, ge=4, le=400)
    """Of a moving line."""
    members: tuple[Member, ...] = ()
    """Columns, pontoons, plates: for pictures, and for what potential flow lacks (Morison)."""
    water_density: float = Field(default=1025.0, gt=0.0)
    """[kg/m^3]."""
    source: str = ""

    @property
    def line_words(self) -> str:
        """The lines and how they are computed, in words; empty without lines."""
        kind = "in their static shapes" if self.line_model == "static" else f"moving, of {self.segments} segments each"
        return f"{len(self.lines)} mooring lines, {kind}" if self.lines else ""

    @property
    def tension_warning(self) -> str:
        """What tensions of static lines lack; empty for moving ones."""
        return STATIC_TENSIONS if self.lines and self.line_model == "static" else ""

    def drawn(self) -> dict[str, Any]:
        """What views draw: depth [m], members with their ends and diameters [m], lines as points in equilibrium."""
        members = [[*each.start.tolist(), *each.end.tolist(), *each.diameters] for each in self.members]
        rest = at_rest(self.lines, self.points, self.depth, self.water_density)
        lines = [shape.round(2).tolist() for shape in shapes(rest, self.lines, self.water_density)]
        return {"depth": self.depth, "floats": True, "members": members, "lines": lines}

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name in ("centre", "inertia"):
            if len(getattr(self, name)) != 3:
                raise ValueError(f"{name} must have 3 entries, along x, y, z, found {len(getattr(self, name))}")
        if np.any(self.inertia <= 0.0):
            raise ValueError("inertia must be above 0")
        if not self.coefficients:
            found = displaced(self.members)[0]
            if abs(found - self.volume) > SAME_VOLUME * self.volume:
                raise ValueError(
                    f"members displace {found:.5g} m^3 of water, and volume is {self.volume:.5g}; correct either, "
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
          ValueError: it cannot.
        """
        motions = get_args(BaseMotion)
        if foundation is None or tuple(foundation.motions) != motions:
            raise ValueError(
                f"platform: the base of the tower must move: give foundation.motions: [{', '.join(motions)}] and a "
                "foundation.stiffness of zeros"
            )
        if tower.base_height < 0.0:
            raise ValueError(f"tower.base_height {tower.base_height:g} m is under water")
