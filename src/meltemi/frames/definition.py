"""A frame below the tower as data: joints, members with their sections, links, masses, feet and water.

Positions are in inertial axes from the tower's axis at mean sea level: x downwind, y to the left, z up.
"""

from __future__ import annotations

from typing import Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from meltemi.core.errors import PlacedError, did_you_mean
from meltemi.core.record import Array, Record, Vector
from meltemi.frames.checks import TOLERANCE, check
from meltemi.sea.soil import Soil
from meltemi.sea.support import Growth
from meltemi.turbine.definition import Foundation, Tower
from meltemi.turbine.plausibility import doubt

BURIED = 1.0
"""[m] feet farther above the sea bed do not stand on it."""


class Section(Record):
    """Section of a member: a tube, a rectangle, or any by its area and moments. Its material is by default steel."""

    kind: Literal["tube", "rectangle", "general"] = "tube"
    diameter: float | None = Field(default=None, gt=0.0)
    """[m; 0.2 to 20] outer diameter of a tube; of a general section that in the water."""
    width: float | None = Field(default=None, gt=0.0)
    """[m; 0.2 to 30] outer width of a rectangle along the member's x."""
    height: float | None = Field(default=None, gt=0.0)
    """[m; 0.2 to 30] outer height of a rectangle along the member's y."""
    thickness: float | None = Field(default=None, gt=0.0)
    """[m; 0.005 to 0.6] thickness of the wall; without it the section is solid."""
    area: float | None = Field(default=None, gt=0.0)
    """[m^2] area of a general section."""
    shear_area_x: float | None = Field(default=None, gt=0.0)
    """[m^2] area that carries shear along the member's x."""
    shear_area_y: float | None = Field(default=None, gt=0.0)
    """[m^2] area that carries shear along the member's y."""
    inertia_x: float | None = Field(default=None, gt=0.0)
    """[m^4] second moment of area about the member's x."""
    inertia_y: float | None = Field(default=None, gt=0.0)
    """[m^4] second moment of area about the member's y."""
    torsion: float | None = Field(default=None, gt=0.0)
    """[m^4] torsion constant."""
    elastic_modulus: float = Field(default=210e9, gt=0.0)
    """[N/m^2; 1.8e11 to 2.3e11] Young's modulus."""
    shear_modulus: float = Field(default=80.8e9, gt=0.0)
    """[N/m^2; 7e10 to 9e10] shear modulus."""
    density: float = Field(default=7850.0, ge=0.0)
    """[kg/m^3; 2000 to 9500] density, from concrete to steel with additions."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        needed = {
            "tube": ("diameter",),
            "rectangle": ("width", "height"),
            "general": ("area", "inertia_x", "inertia_y", "torsion"),
        }[self.kind]
        if missing := [name for name in needed if getattr(self, name) is None]:
            raise ValueError(f"a {self.kind} section needs {', '.join(missing)}")
        if self.thickness is not None and self.kind != "general":
            across = min(getattr(self, name) for name in needed)
            if self.thickness > 0.5 * across + 1e-12:
                raise ValueError(
                    f"thickness {self.thickness:g} m is more than half of {across:g} m; is it in mm? It is in m"
                )
        return self

    @property
    def breadth(self) -> float:
        """[m] diameter; mean of the sides of a rectangle; diameter of a rod of the area of a general section."""
        if self.diameter is not None:
            return self.diameter
        if self.kind == "rectangle":
            return 0.5 * (float(self.width or 0.0) + float(self.height or 0.0))
        return float(np.sqrt(4.0 / np.pi * (self.area or 0.0)))


class Releases(Record):
    """Rotations that the end of a member does not transfer, about inertial axes or one direction."""

    kind: Literal["pin", "universal", "ball"]
    """``pin``: free about ``axis``; ``universal``: about both directions across it; ``ball``: about all."""
    axis: Vector | None = None
    """(3,) axis of a pin (free) or of a universal joint (not free)."""
    stiffness: float = Field(default=0.0, ge=0.0)
    """[N m/rad] stiffness of the free rotations."""


class Member(Record):
    """A member between two joints; its z points from the first to the second, its x is horizontal."""

    joints: tuple[str, str]
    """Names of its joints."""
    section: str
    """Name of its section; of a rigid link, a spring or a cable that of nothing, ``-``."""
    end_section: str | None = None
    """Name of the section at its second joint, of the same kind; by default ``section``."""
    kind: Literal["beam", "rigid", "cable", "spring"] = "beam"
    spin: float = 0.0
    """[rad] rotation of the section's axes about the member's z."""
    stiffness: Array | None = None
    """(6, 6) stiffness of a spring between coinciding joints, inertial axes."""
    axial_stiffness: float | None = Field(default=None, gt=0.0)
    """[N] Young's modulus times area of a cable."""
    pretension: float = Field(default=0.0, ge=0.0)
    """[N] tension of a cable as installed."""
    line_mass: float = Field(default=0.0, ge=0.0)
    """[kg/m] mass per length of a cable, or of a rigid link."""
    flooded: bool = False
    """Whether the sea fills it up to its level; a closed member has ``filled_to`` instead."""
    filled_to: float | None = None
    """[m] height above mean sea level of the liquid in a closed member, which is full where this is above it."""
    fill_density: float = Field(default=1025.0, gt=0.0)
    """[kg/m^3; 980 to 3000] density of the liquid inside."""
    hydrodynamics: str | None = None
    """Name of its coefficients; by default those of the frame."""
    potential_flow: bool = False
    """Whether inertia and buoyancy are those of the platform's potential flow: only drag and filling are its own."""


class Coefficients(Record):
    """Coefficients of Morison's equation of members, over the diameter with marine growth."""

    drag: float = Field(default=1.0, ge=0.0)
    """Drag coefficient [-; 0.35 to 2] across the member."""
    added_mass: float = Field(default=1.0, ge=0.0)
    """Added-mass coefficient [-; 0.35 to 2] across the member."""
    pressure: float = Field(default=1.0, ge=0.0)
    """Excess [-; 0.35 to 2] of the coefficient of the water's acceleration over that of added mass."""
    grown_drag: float | None = Field(default=None, ge=0.0)
    """Drag coefficient [-] under marine growth; by default ``drag``."""
    grown_added_mass: float | None = Field(default=None, ge=0.0)
    """Added-mass coefficient [-] under marine growth; by default ``added_mass``."""
    grown_pressure: float | None = Field(default=None, ge=0.0)
    """Pressure coefficient [-] under marine growth; by default ``pressure``."""
    diffraction: Literal["none", "maccamy_fuchs"] = "none"
    """Inertia coefficient that depends on wave number times radius, for thick upright members."""


class EndCoefficients(Record):
    """Coefficients of the loads along members on their ends at a joint, over the sum of their outward areas.

    By default ends have pressure only, which the wall of a leg lacks where a brace ends in it.
    """

    drag: float = Field(default=0.0, ge=0.0)
    """Drag coefficient [-; 0.4 to 12] of the ends."""
    added_mass: float = Field(default=0.0, ge=0.0)
    """Added-mass coefficient [-; 0.2 to 2] of the ends."""
    pressure: float = Field(default=1.0, ge=0.0)
    """Share of the pressure of the wave on the ends [-; 0.5 to 1]."""


class JointMass(Record):
    """A rigid body fixed to a joint."""

    joint: str
    mass: float = Field(ge=0.0)
    """[kg; 100 to 2e6] mass."""
    inertia: Vector | None = None
    """(6,) [kg m^2] inertia about its centre: xx, yy, zz, xy, xz, yz; by default none."""
    centre: Vector | None = None
    """(3,) [m] its centre from the joint; by default there."""


class Foot(Record):
    """A joint on the sea bed: clamped, on springs, or on a pile in soil."""

    joint: str
    stiffness: Array | None = None
    """(6, 6) stiffness of the ground, inertial axes; without it and soil the joint is clamped."""
    mass: Array | None = None
    """(6, 6) mass of the ground that moves with it."""
    soil: Soil | None = None
    """Soil around the pile below the joint."""
    pile_length: float | None = Field(default=None, gt=0.0)
    """[m; 10 to 80] length of the pile in the soil."""
    pile_section: str | None = None
    """Name of the pile's section, a tube."""


class Frame(Record):
    """Joints and members from the sea bed, or of a floating platform, to the tower's base."""

    depth: float = Field(gt=0.0)
    """[m; 5 to 400] depth of the water at mean sea level."""
    joints: dict[str, Vector]
    """(3,) [m] positions x, y, z of each joint."""
    sections: dict[str, Section]
    members: dict[str, Member]
    feet: tuple[Foot, ...] = ()
    """Joints on the sea bed; none for a platform that floats."""
    interface: tuple[str, ...] = Field(min_length=1)
    """Joints that are rigidly connected with the tower's base."""
    masses: tuple[JointMass, ...] = ()
    releases: dict[str, Releases] = Field(default={})
    """Joints at which members are not rigidly connected with each other."""
    divisions: int = Field(default=2, ge=1, le=20)
    """Number of finite elements of a member [-; 1 to 8]."""
    damping: float = Field(default=0.0, ge=0.0, lt=0.3)
    """Damping ratio of the first mode if all its stiffness were that of the frame [-; 0.001 to 0.05]."""
    interface_damping: Array | None = None
    """(6, 6) damping between the tower's base and the ground, about the base, inertial axes."""
    hydrodynamics: Coefficients = Coefficients()
    other_hydrodynamics: dict[str, Coefficients] = Field(default={})
    """Coefficients of members that name them."""
    ends: EndCoefficients = EndCoefficients()
    """Loads on ends of members at joints."""
    other_ends: dict[str, EndCoefficients] = Field(default={})
    """Those of some joints, by joint."""
    growth: tuple[Growth, ...] = ()
    """Marine growth on all members between heights."""
    water_density: float = Field(default=1025.0, gt=0.0)
    """[kg/m^3; 980 to 1060] density of the water."""
    piece: float = Field(default=3.0, gt=0.0)
    """[m; 0.5 to 5] length of the pieces of members on which the water acts: half of it at still water, and up to 2.5
    times far below."""
    source: str = ""

    def check_beside(self, support: Any, platform: Any) -> None:
        """Check that the tower stands on one thing, or floats.

        Raises:
          ValueError: there is a support, too, or feet and a platform, or neither.
        """
        if support is not None:
            raise PlacedError("a tower stands on a frame or a support; remove one of them", "frame")
        if bool(self.feet) == (platform is not None):
            feet, what = ("has", "floats on a platform") if self.feet else ("has no", "does not float on a platform")
            raise PlacedError(f"the frame {feet} feet, and the turbine {what}; give it either", "frame", "feet")

    def check_fit(self, tower: Tower, foundation: Foundation | None) -> None:
        """Check the fit to the tower.

        Raises:
          ValueError: tower or foundation do not fit.
        """
        base, first = tower.base_height, self.joints[self.interface[0]][2]
        if len(self.interface) == 1 and abs(first - base) > TOLERANCE:
            raise PlacedError(
                f"the interface is at {first:g} m, but tower.base_height is {base:g} m", "frame", "interface"
            )
        for name, (_, _, z) in self.joints.items():
            if self.feet and z > base + TOLERANCE:  # columns of a floater may rise above the base
                raise PlacedError(
                    f"joint {name!r} is at {z:g} m, above the tower's base at {base:g} m", "frame", "joints", name
                )
        for i, foot in enumerate(self.feet):
            if (above := self.joints[foot.joint][2] + self.depth) > BURIED:
                raise PlacedError(
                    f"joint {foot.joint!r} is {above:g} m above the sea bed, at a depth of {self.depth:g} m; feet "
                    "stand on it",
                    *("frame", "feet", i),
                )
        if self.feet and foundation is not None:
            raise ValueError("foundation: the frame has feet of its own; remove foundation")

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name, place in self.joints.items():
            if len(place) != 3:
                raise PlacedError(f"expected x, y, z [m], found {len(place)} numbers", "joints", name)
        self._check_names()
        check(self)
        return self

    def _check_names(self) -> None:
        def known(name: str | None, names: Any, what: str, *keys: str | int) -> None:
            if name is not None and name not in names:
                near = did_you_mean(name, names) if names else "there are none"
                raise PlacedError(f"{what} {name!r} is not there: {near}", *keys)

        for name, member in self.members.items():
            for joint in member.joints:
                known(joint, self.joints, "joint", "members", name, "joints")
            if member.kind == "beam":
                known(member.section, self.sections, "section", "members", name, "section")
                known(member.end_section, self.sections, "section", "members", name, "end_section")
            known(member.hydrodynamics, self.other_hydrodynamics, "entry", "members", name, "hydrodynamics")
        for i, foot in enumerate(self.feet):
            known(foot.joint, self.joints, "joint", "feet", i, "joint")
            known(foot.pile_section, self.sections, "section", "feet", i, "pile_section")
        for i, mass in enumerate(self.masses):
            known(mass.joint, self.joints, "joint", "masses", i, "joint")
        for field in ("interface", "releases", "other_ends"):
            for name in getattr(self, field):
                known(name, self.joints, "joint", field)

    def view_shape(self) -> dict[str, Any]:
        """Geometry for views: depth [m], members from x, y, z to x, y, z with diameters at both ends [m]; no lines;
        the frame itself."""
        members = []
        for member in self.members.values():
            if member.kind == "beam":
                a, b = (self.joints[name] for name in member.joints)
                first = self.sections[member.section]
                last = self.sections[member.end_section or member.section]
                members.append([*map(float, a), *map(float, b), first.breadth, last.breadth])
        shape = {"depth": self.depth, "floats": not self.feet, "members": members, "lines": []}
        return shape | {"frame": self.content()}

    def liquid(self, member: Member, level: float = 0.0) -> tuple[float, float] | None:
        """Height [m] of the surface of the liquid inside a member, and its density [kg/m^3]; None without liquid.

        Args:
          level: [m] of still water, to which the sea fills flooded members.
        """
        if member.flooded:
            return level, self.water_density
        if member.filled_to is None:
            return None
        return min(member.filled_to, max(float(self.joints[joint][2]) for joint in member.joints)), member.fill_density

    def doubts(self, turbine: Any) -> list[str]:
        """Sentences about implausible walls, moduli and growth."""
        sentences = []
        for name, each in self.sections.items():
            key = f"frame.sections.{name}"
            if each.kind == "tube" and each.thickness is not None:
                slender = each.breadth / each.thickness
                sentences.append(doubt(f"{key}.thickness", "diameter over it", slender, 3.0, 400.0))
            moduli = each.elastic_modulus / each.shear_modulus
            sentences.append(doubt(f"{key}.elastic_modulus", "it over shear_modulus", moduli, 2.2, 2.8))
        for i, layer in enumerate(self.growth):
            sentences.append(doubt(f"frame.growth.{i}", "its top [m]", layer.top, -self.depth, 10.0))
        return sentences
