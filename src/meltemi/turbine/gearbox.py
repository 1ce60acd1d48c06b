"""Gearbox: planetary stages, an optional parallel stage, and a sizing rule.

A planetary stage is driven at its carrier, its ring is held by the housing and its sun is the output. With the radii
of sun R_s and ring R_r = R_s + 2 r_p the output turns 1 + R_r/R_s times as fast (Willis 1841), in the same sense; a
parallel stage reverses the sense.

Reference: docs/theory/structure.md (S-49 to S-59).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Self

from pydantic import Field, model_validator

from meltemi.core.errors import InputError
from meltemi.core.record import Record


class PlanetaryStage(Record):
    """Planetary stage: carrier (input), planets, sun (output), and the shaft from the sun to the next stage."""

    planets: int = Field(ge=1, le=12)
    """Number of planets [-; 3 to 9]; they share the load equally."""
    ratio: float = Field(gt=2.0)
    """[-; 3 to 12] speed of the sun over that of the carrier."""
    sun_radius: float = Field(gt=0.0)
    """[m; 0.04 to 0.5 at 100 m] radius of the pitch circle; those of planets and ring follow from it and the ratio."""
    carrier_inertia: float = Field(ge=0.0)
    """[kg m^2; 5 to 2000 at 100 m] inertia of carrier and input shaft about the shaft, without planets."""
    planet_mass: float = Field(gt=0.0)
    """[kg; 40 to 3000 at 100 m] mass of one planet."""
    planet_inertia: float = Field(gt=0.0)
    """[kg m^2; 0.5 to 200 at 100 m] inertia of one planet about its axis."""
    sun_inertia: float = Field(gt=0.0)
    """[kg m^2; 0.05 to 20 at 100 m] inertia of the sun with half of the output shaft."""
    sun_mesh: float = Field(gt=0.0)
    """[N/m; 5e8 to 3e10 at 100 m] stiffness of the mesh of the sun with one planet, along the pitch circle: that of the
    line of action times the square of the cosine of the pressure angle."""
    ring_mesh: float = Field(gt=0.0)
    """[N/m; 5e8 to 3e10 at 100 m] stiffness of the mesh of one planet with the ring."""
    shaft_stiffness: float = Field(gt=0.0)
    """[N m/rad; 5e5 to 2e8 at 100 m] torsional stiffness of the output shaft."""
    ring_stiffness: float | None = Field(default=None, gt=0.0)
    """[N m/rad] torsional stiffness of the ring's support in the housing; without it the ring is fixed."""
    ring_inertia: float | None = Field(default=None, gt=0.0)
    """[kg m^2] inertia of an elastically supported ring."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.ring_stiffness is None) != (self.ring_inertia is None):
            raise ValueError("give both ring_stiffness and ring_inertia, or neither")
        return self

    @property
    def orbit_radius(self) -> float:
        """[m] orbit radius of the planet centres, which move at half the speed of the sun's pitch circle."""
        return 0.5 * self.ratio * self.sun_radius

    @property
    def planet_radius(self) -> float:
        """Radius [m] of the pitch circle."""
        return (0.5 * self.ratio - 1.0) * self.sun_radius

    @property
    def ring_radius(self) -> float:
        """Radius [m] of the pitch circle."""
        return (self.ratio - 1.0) * self.sun_radius

    @property
    def compliance(self) -> float:
        """[rad/(N m)] static compliance of meshes, ring and output shaft, referred to that shaft."""
        meshes = (1.0 / self.sun_mesh + 1.0 / self.ring_mesh) / (self.planets * self.sun_radius**2)
        ring = 0.0 if self.ring_stiffness is None else (self.ratio - 1.0) ** 2 / self.ring_stiffness
        return meshes + ring + 1.0 / self.shaft_stiffness


class ParallelStage(Record):
    """Parallel stage: wheel (input), pinion (output), and the shaft from the pinion to the generator."""

    ratio: float = Field(gt=0.0)
    """[-; 1.5 to 8] speed of the pinion over that of the wheel, without sign."""
    pinion_radius: float = Field(gt=0.0)
    """[m; 0.03 to 0.5 at 100 m] radius of the pitch circle; that of the wheel is ``ratio`` times as large."""
    wheel_inertia: float = Field(gt=0.0)
    """[kg m^2] inertia of the wheel with the input shaft."""
    pinion_inertia: float = Field(gt=0.0)
    """[kg m^2] inertia of the pinion with half of the output shaft."""
    mesh: float = Field(gt=0.0)
    """[N/m; 3e8 to 3e10 at 100 m] stiffness of the mesh along the pitch circle."""
    shaft_stiffness: float = Field(gt=0.0)
    """[N m/rad; 1e5 to 1e9 at 100 m] torsional stiffness of the output shaft, with its coupling."""

    @property
    def compliance(self) -> float:
        """[rad/(N m)] static compliance of mesh and output shaft, referred to that shaft."""
        return 1.0 / (self.mesh * self.pinion_radius**2) + 1.0 / self.shaft_stiffness


class Gearbox(Record):
    """Inertia and stiffness of a gearbox, for ``options.drivetrain`` ``quasi_static`` and ``multibody``."""

    planetary: tuple[PlanetaryStage, ...] = Field(min_length=1)
    """Planetary stages, from the rotor side."""
    parallel: ParallelStage | None = None
    """A last stage with parallel shafts."""
    damping_ratio: float = Field(default=0.05, ge=0.0, le=0.3)
    """[-; 0.005 to 0.2] damping ratio of the gearbox modes with rotor and generator fixed; in gear meshes 0.03 to 0.17
    was measured (Kasuba & Evans 1981)."""
    source: str = ""

    @property
    def ratios(self) -> tuple[float, ...]:
        """Ratios [-] of the stages, without sign."""
        return tuple(s.ratio for s in self.stages)

    @property
    def stages(self) -> tuple[PlanetaryStage | ParallelStage, ...]:
        """All stages, from the rotor side."""
        return (*self.planetary, *(() if self.parallel is None else (self.parallel,)))

    @property
    def ratio(self) -> float:
        """Ratio [-] of the complete gearbox, without sign."""
        return math.prod(self.ratios)

    @property
    def sense(self) -> float:
        """1 if generator and rotor turn in the same sense, otherwise -1."""
        return 1.0 if self.parallel is None else -1.0

    @property
    def compliance(self) -> float:
        """[rad/(N m)] static compliance of the gearbox without the main shaft, referred to the rotor."""
        speed, total = 1.0, 0.0
        for stage in self.stages:
            speed *= stage.ratio
            total += stage.compliance / speed**2
        return total


STEEL, SHEAR = 7850.0, 79.3e9
"""[kg/m^3], [Pa] density and shear modulus."""
PRESSURE_ANGLE = math.radians(20.0)
HERTZ_LIMIT, LIFE_FACTOR, SAFETY = 1500e6, 0.9, 1.25
"""[Pa] allowable Hertzian pressure of case-carburised steel, quality MQ (ISO 6336-5); life factor beyond 1e9 cycles
(ISO 6336-2); least safety against pitting (IEC 61400-4)."""
Z_ELASTIC, Z_ZONE, Z_CONTACT = 189.8e3, 2.4, 0.85
"""Factors of ISO 6336-2: elasticity of steel on steel [Pa^0.5], zone, contact ratio."""
APPLICATION, DISTRIBUTION = 1.3, 1.2
"""K_A; K_v K_Hb K_Ha of ISO 6336-1 together."""
SHARING = {3: 1.1, 4: 1.25, 5: 1.35}
"""Mesh load factor by the number of planets (IEC 61400-4): it enlarges the gears, and does not act in a simulation."""
MESH_PER_WIDTH = 20e9
"""[Pa] mean mesh stiffness per face width, 20 N/(mm um) (ISO 6336-1)."""
SHAFT_STRESS, SHAFT_LENGTH = 50e6, 4.0
"""[Pa] shear stress of solid shafts at rated torque; their length over their diameter."""
LEAST_RATIO, PARALLEL_FROM, PARALLEL_RATIO = 3.0, 50.0, 4.0
"""Least overall ratio; overall ratio above which a parallel stage is added; ratio of that stage."""
LEAST_STAGE, LARGEST_STAGE = 2.5, 7.5
"""Limits of the ratio of planetary stages: the planets would be too small below; a stage is added above."""


def size_gearbox(
    *,
    ratio: float,
    rated_torque: float,
    planetary: Sequence[float] | None = None,
    parallel: float | None = None,
    width_ratio: float = 1.0,
) -> Gearbox:
    """Size a gearbox of plausible inertia and stiffness for a turbine without gearbox data.

    Gears: the sun (pinion) is sized for pitting according to ISO 6336-2, with the constants of this module; mesh
    stiffness is 20 N/(mm um) of face width (ISO 6336-1); three to five planets, as space permits. Shafts: solid, 50
    MPa at rated torque. Stages: planetary, of equal ratio up to 7.5; above an overall ratio of 50 a parallel stage of
    4 comes last. Inertia: sun and pinion solid, planets with a bore of 0.6 (their bearings count as mass), carrier two
    discs, wheel a rim with a web.

    Args:
      ratio: generator over rotor speed [-].
      rated_torque: [N m] on the low-speed shaft.
      planetary: ratios of the planetary stages, if known.
      parallel: ratio of a parallel stage after them.
      width_ratio: face width over diameter of sun and pinion [-].

    Returns:
      The gearbox, whose ratio is the given one.

    Raises:
      InputError: no gearbox of this kind has the ratio, or the torque is not positive.
    """
    if not (math.isfinite(ratio) and ratio > LEAST_RATIO):
        raise InputError(
            f"size_gearbox: ratio must be greater than {LEAST_RATIO:g}, found {ratio!r}; a direct drive has no gearbox"
        )
    for name, value in (("rated_torque", rated_torque), ("width_ratio", width_ratio)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"size_gearbox: {name} must be positive, found {value!r}")
    if planetary is None:
        if parallel is None and ratio > PARALLEL_FROM:
            parallel = PARALLEL_RATIO
        rest = ratio / (parallel or 1.0)
        n = max(1, math.ceil(math.log(rest) / math.log(LARGEST_STAGE) - 1e-9))
        planetary = n * [rest ** (1.0 / n)]
    total = math.prod(planetary) * (parallel or 1.0)
    if abs(total - ratio) > 1e-3 * ratio or min(planetary) <= LEAST_STAGE:
        stages = " x ".join(f"{r:.4g}" for r in (*planetary, *([] if parallel is None else [parallel])))
        raise InputError(
            f"size_gearbox: stages of {stages} do not make a ratio of {ratio:g} with planetary stages above "
            f"{LEAST_STAGE:g}"
        )
    sized, torque = [], rated_torque
    for each in planetary:
        sized.append(_planetary(each, torque, width_ratio))
        torque /= each
    return Gearbox(
        planetary=tuple(sized),
        parallel=None if parallel is None else _parallel(parallel, torque, width_ratio),
        source=f"sized for {rated_torque / 1e6:g} MN m by ISO 6336 (size_gearbox)",
    )


def _pinion_diameter(torque: float, sharing: float, u: float, width_ratio: float) -> float:
    """[m] diameter with the permissible Hertzian pressure in a mesh with a gear u times as large.

    Args:
      torque: [N m] on the gear, through all its meshes.
      sharing: mesh load factor over the number of meshes.
    """
    pressure = HERTZ_LIMIT * LIFE_FACTOR / SAFETY / (Z_ELASTIC * Z_ZONE * Z_CONTACT)
    intensity = pressure**2 / (APPLICATION * DISTRIBUTION)
    return float((2.0 * torque * sharing * (u + 1.0) / (u * width_ratio * intensity)) ** (1.0 / 3.0))


def _shaft(torque: float) -> tuple[float, float]:
    """Stiffness [N m/rad] and inertia [kg m^2] of a solid shaft."""
    d = (16.0 * torque / (math.pi * SHAFT_STRESS)) ** (1.0 / 3.0)
    polar = math.pi / 32.0 * d**4
    return SHEAR * polar / (SHAFT_LENGTH * d), STEEL * polar * SHAFT_LENGTH * d


def _disc(width: float, outer: float, inner: float = 0.0) -> float:
    """[kg m^2] inertia of a steel ring about its axis."""
    return 0.5 * math.pi * STEEL * width * (outer**4 - inner**4)


def _planetary(ratio: float, torque: float, width_ratio: float) -> PlanetaryStage:
    """Size a planetary stage for a torque [N m] on its carrier."""
    u = 0.5 * ratio - 1.0
    # adjacent planets must not touch: half their distance, orbit times sin(pi/n), exceeds the planet radius by a tenth
    planets = max(n for n in SHARING if n == min(SHARING) or math.sin(math.pi / n) >= 1.1 * (ratio - 2.0) / ratio)
    d = _pinion_diameter(torque / ratio, SHARING[planets] / planets, u, width_ratio)
    sun, width = 0.5 * d, width_ratio * d
    planet, orbit = u * sun, 0.5 * ratio * sun
    mesh = MESH_PER_WIDTH * width * math.cos(PRESSURE_ANGLE) ** 2
    incoming, outgoing = _shaft(torque), _shaft(torque / ratio)
    return PlanetaryStage(
        planets=planets,
        ratio=ratio,
        sun_radius=sun,
        carrier_inertia=2.0 * _disc(0.25 * width, orbit + 0.5 * planet) + 0.5 * incoming[1],
        planet_mass=math.pi * STEEL * width * planet**2,
        planet_inertia=_disc(width, planet, 0.6 * planet),
        sun_inertia=_disc(width, sun) + 0.5 * outgoing[1],
        sun_mesh=mesh,
        ring_mesh=mesh,
        shaft_stiffness=outgoing[0],
    )


def _parallel(ratio: float, torque: float, width_ratio: float) -> ParallelStage:
    """Size a parallel stage for a torque [N m] on its wheel."""
    d = _pinion_diameter(torque / ratio, 1.0, ratio, width_ratio)
    pinion, width = 0.5 * d, width_ratio * d
    wheel, rim = ratio * pinion, 0.8 * ratio * pinion
    incoming, outgoing = _shaft(torque), _shaft(torque / ratio)
    return ParallelStage(
        ratio=ratio,
        pinion_radius=pinion,
        wheel_inertia=_disc(width, wheel, rim) + _disc(0.3 * width, rim) + 0.5 * incoming[1],
        pinion_inertia=_disc(width, pinion) + 0.5 * outgoing[1],
        mesh=MESH_PER_WIDTH * width * math.cos(PRESSURE_ANGLE) ** 2,
        shaft_stiffness=outgoing[0],
    )
