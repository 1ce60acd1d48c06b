"""Records that describe a turbine.

Frames, signs and azimuth zero are defined in ``docs/conventions.md``. In short: x points downwind,
z up or from the blade root to its tip, y completes the right-handed set; blade pitch and twist are
positive towards feather (nose into the wind); tilt lifts the upwind end of the shaft; cone leans the
blades upwind. Units are SI throughout: metre, kilogram, second, radian, newton, watt. All records are in one module,
in the order of a turbine file.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from meltemi.compiler import MAX_FLAPS
from meltemi.core.deferred import deferred
from meltemi.core.record import Array, Record, Vector
from meltemi.turbine.checks import above_ground, angles, ordered, per_station, positive, stations
from meltemi.turbine.exchange import ActuatorModel
from meltemi.turbine.imbalance import Imbalance, deviations
from meltemi.turbine.representation import TurbineBase

if TYPE_CHECKING:
    from meltemi.turbine import ElectricalSystem, Frame, MassDamper, Platform, Support
    from meltemi.turbine.gearbox import Gearbox
    from meltemi.turbine.ice import Icing
else:
    Icing = deferred("meltemi.turbine.ice", "Icing")
    Gearbox = deferred("meltemi.turbine.gearbox", "Gearbox")
    ElectricalSystem = deferred("meltemi.electrical.system", "ElectricalSystem")
    MassDamper = deferred("meltemi.sea.mass_dampers", "MassDamper")
    Support = deferred("meltemi.sea.support", "Support")
    Frame = deferred("meltemi.frames.definition", "Frame")
    Platform = deferred("meltemi.floating.platform", "Platform")

HALF_TURN = math.pi
BaseMotion = Literal["surge", "sway", "heave", "roll", "pitch", "yaw"]
"""Rigid motions of the tower base: along the inertial axes x, y, z and about them."""


class ModeShapes(Record):
    """Mode shapes as polynomials of the relative span x: for each mode its coefficients of x^2, x^3, ..., with sum 1.

    They are optional: modes are computed. A description may contain the shapes of another code for comparison.
    """

    flap: tuple[tuple[float, ...], ...] = ()
    """Blades: flapwise modes."""
    edge: tuple[tuple[float, ...], ...] = ()
    """Blades: edgewise modes."""
    fore_aft: tuple[tuple[float, ...], ...] = ()
    """Tower: fore-aft modes."""
    side_side: tuple[tuple[float, ...], ...] = ()
    """Tower: side-to-side modes."""


class Airfoil(Record):
    """Lift, drag and moment of a section against the angle of attack, over the full circle."""

    angle_of_attack: Vector
    """(P,) [rad] from -pi to pi, increasing."""
    lift: Vector
    """(P,) [-; 0 to 3] lift coefficient."""
    drag: Vector
    """(P,) [-; 0.2 to 2.5] drag coefficient."""
    moment: Vector
    """(P,) [-; 0 to 1] moment coefficient about the aerodynamic centre, positive nose up."""
    dynamic_stall: bool = True
    """False for sections without lift, e.g. cylinders: the static polar is used."""
    zero_lift_angle: float | None = Field(default=None, gt=-1.0, lt=1.0)
    """[rad; 0.002 to 0.2] zero-lift angle that the source states; only used by OpenFAST's fit for dynamic stall."""
    zero_lift_drag: float | None = Field(default=None, ge=0.0)
    """Drag coefficient at the zero-lift angle [-; 0.002 to 1]."""
    relative_thickness: float | None = Field(default=None, gt=0.0, le=1.0)
    """Thickness over chord; needed for rain only, and only if the airfoil's name does not contain it (`DU40`)."""
    source: str = ""
    """Source of the numbers."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        a = self.angle_of_attack
        if len(a) < 3 or np.any(np.diff(a) <= 0.0):
            raise ValueError("angle_of_attack must increase from entry to entry")
        per_station(self, "lift drag moment", len(a), "angle_of_attack")
        if abs(a[0] + HALF_TURN) > 1e-3 or abs(a[-1] - HALF_TURN) > 1e-3:
            hint = "; the values look like degrees, multiply by pi/180" if a[-1] > 7.0 else ""
            raise ValueError(
                f"angle_of_attack must cover -pi to pi (+-180 degrees), but goes from {a[0]:g} to {a[-1]:g} rad{hint}"
            )
        for name in ("lift", "drag", "moment"):
            value = getattr(self, name)
            if np.any(np.abs(value) > 10.0):
                raise ValueError(f"{name} has a coefficient beyond +-10")
        return self


class Damping(Record):
    """Damping ratios of an isolated member: the blade clamped at its root, the tower without nacelle.

    The damping matrix is proportional to stiffness, so a mode of the assembled turbine has the ratio of
    the isolated member times the ratio of their frequencies.
    """

    flap: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Blades: flapwise modes, damping ratio [-; 0.0015 to 0.06] (0.01 is 1 %)."""
    edge: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Blades: edgewise modes [-; 0.0015 to 0.06]."""
    fore_aft: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Tower: fore-aft modes [-; 0.0015 to 0.06]."""
    side_side: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Tower: side-to-side modes [-; 0.0015 to 0.06]."""
    torsion: float = Field(default=0.0, ge=0.0, lt=1.0)
    """Torsional modes [-; 0.0015 to 0.06]."""


class DampingTime(Record):
    """Damping over stiffness (Kelvin-Voigt), instead of ratios: section forces from rates of strain.

    A mode of circular frequency w that strains the member in one way has the ratio w time / 2. BeamDyn and windIO
    call the time mu.
    """

    flap: float = Field(ge=0.0, lt=1.0)
    """[s; 3e-4 to 0.01 at 100 m] damping over stiffness in bending along the flap direction."""
    edge: float = Field(ge=0.0, lt=1.0)
    """[s; 3e-4 to 0.01 at 100 m] damping over stiffness in bending along the edge direction."""
    torsion: float = Field(default=0.0, ge=0.0, lt=1.0)
    """[s; 5e-5 to 0.02 at 100 m] damping over stiffness in torsion."""


class BladeAerodynamics(Record):
    """Outer shape of the blade, at stations along its axis."""

    position: Vector
    """(S,) [m; 40 to 50 at 100 m] distance from the blade root along the pitch axis; first 0, last the blade length."""
    chord: Vector
    """(S,) [m; 1.5 to 8 at 100 m] chord."""
    twist: Vector
    """(S,) [rad; 0.05 to 0.6] twist, positive towards feather."""
    airfoil: tuple[str, ...]
    """(S,) names of entries in ``Turbine.airfoils``; polars are interpolated between stations."""
    centre_x: Vector | None = None
    """(S,) [m; 0.03 to 6 at 100 m] aerodynamic centre from the pitch axis, downwind at zero pitch."""
    centre_y: Vector | None = None
    """(S,) [m; 0.05 to 1.5 at 100 m] aerodynamic centre from the pitch axis, to the trailing edge at zero pitch."""
    cant: Vector | None = None
    """(S,) [rad; 0.02 to 0.8] angle of the undeformed section against the plane normal to the pitch axis, its tip side
    downwind at zero pitch (negative if prebent upwind); by default sections are normal to the beam's axis."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        stations(self.position, "position")
        per_station(self, "chord twist airfoil centre_x centre_y cant", len(self.position))
        positive(self, "chord")
        angles(self, "twist", 1.6)
        angles(self, "cant", 0.8)
        return self


class BladeStructure(Record):
    """Beam properties of the blade, at stations along its axis.

    Either the classical properties, or full 6 x 6 matrices of section stiffness and mass. Both refer to
    the section's axes: x along the flap direction, y along the edge direction (towards the trailing
    edge), z along the blade, turned by ``twist``.
    """

    position: Vector
    """(S,) [m; 40 to 50 at 100 m] distance from the blade root along the pitch axis; first 0, last the blade length."""
    twist: Vector
    """(S,) [rad; 0.05 to 0.6] twist of the section's principal axes, positive towards feather."""
    mass: Vector | None = None
    """(S,) [kg/m; 150 to 3000 at 100 m] mass per length."""
    flap_stiffness: Vector | None = None
    """(S,) [N m^2; 3e9 to 3e10 at 100 m] bending stiffness in the flap direction (about y)."""
    edge_stiffness: Vector | None = None
    """(S,) [N m^2; 3e9 to 3e10 at 100 m] bending stiffness in the edge direction (about x)."""
    torsion_stiffness: Vector | None = None
    """(S,) [N m^2; 5e8 to 1e10 at 100 m] torsional stiffness; without it the blade is rigid in torsion."""
    axial_stiffness: Vector | None = None
    """(S,) [N; 2e9 to 2e10 at 100 m] axial stiffness; without it the blade is rigid axially."""
    flap_inertia: Vector | None = None
    """(S,) [kg m; 50 to 2000 at 100 m] rotary inertia about y."""
    edge_inertia: Vector | None = None
    """(S,) [kg m; 50 to 2000 at 100 m] rotary inertia about x."""
    mass_centre_x: Vector | None = None
    """(S,) [m; 0.02 to 2 at 100 m] centre of mass from the pitch axis in the section's axes."""
    mass_centre_y: Vector | None = None
    """(S,) [m; 0.05 to 2 at 100 m] centre of mass from the pitch axis in the section's axes."""
    axis_x: Vector | None = None
    """(S,) [m; 0.2 to 8 at 100 m] prebend: the beam's axis from the pitch axis, downwind at zero pitch (upwind is
    negative); move the aerodynamic centre ``aerodynamics.centre_x``, which is from the pitch axis, too, with it."""
    axis_y: Vector | None = None
    """(S,) [m; 0.05 to 8 at 100 m] sweep: the beam's axis from the pitch axis, towards the trailing edge; move
    ``aerodynamics.centre_y`` with it."""
    stiffness_matrix: Array | None = None
    """(S, 6, 6) [N, N m, N m^2] forces and moments (x, y, z, about x, y, z) from strains and curvatures."""
    mass_matrix: Array | None = None
    """(S, 6, 6) [kg/m, kg, kg m] momenta from velocities."""
    damping: Damping | None = None
    """Structural damping of the isolated, clamped blade."""
    damping_time: DampingTime | None = None
    """Stiffness-proportional damping, instead of ``damping``."""
    mode_shapes: ModeShapes | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        n = len(stations(self.position, "position"))
        if (self.damping is None) == (self.damping_time is None):
            raise ValueError("give either damping (ratios of the modes) or damping_time (damping over stiffness)")
        classical = "mass flap_stiffness edge_stiffness"
        optional = "torsion_stiffness axial_stiffness flap_inertia edge_inertia"
        given = [name for name in classical.split() if getattr(self, name) is not None]
        if self.stiffness_matrix is None:
            missing = [name for name in classical.split() if name not in given]
            if missing:
                raise ValueError(f"{', '.join(missing)} missing (or give stiffness_matrix and mass_matrix)")
        elif given or any(getattr(self, name) is not None for name in optional.split()):
            raise ValueError("give either classical properties or 6 x 6 matrices, not both")
        elif self.mass_matrix is None:
            raise ValueError("stiffness_matrix is given, so mass_matrix is needed too")
        for name in ("stiffness_matrix", "mass_matrix"):
            value = getattr(self, name)
            if value is not None:
                if value.shape != (n, 6, 6):
                    raise ValueError(f"{name} must have shape ({n}, 6, 6), but has {value.shape}")
                if not np.allclose(value, value.transpose(0, 2, 1), rtol=1e-6, atol=1e-6 * np.abs(value).max()):
                    raise ValueError(f"{name} must be symmetric at every station")
                if np.any(np.linalg.eigvalsh(value)[:, 0] <= 0.0):
                    i = int(np.flatnonzero(np.linalg.eigvalsh(value)[:, 0] <= 0.0)[0])
                    raise ValueError(f"{name} must be positive definite, but is not at station {i + 1}")
        per_station(self, f"twist {classical} {optional} mass_centre_x mass_centre_y axis_x axis_y", n)
        positive(self, f"{classical} torsion_stiffness axial_stiffness")
        positive(self, "flap_inertia edge_inertia", zero=True)
        angles(self, "twist", 1.6)
        return self

    @property
    def twists(self) -> bool:
        """Whether a torsional stiffness is given; otherwise the blade is rigid in torsion."""
        return self.torsion_stiffness is not None or self.stiffness_matrix is not None


class FlapIncrements(Record):
    """Increments of the section coefficients due to flap deflection."""

    angle_of_attack: Vector
    """(A,) [rad] increasing; beyond its ends the increments fade out within 16 degrees, where the flow is stalled."""
    deflection: Vector
    """(D,) [rad] increasing, with 0; positive with the trailing edge towards the pressure side."""
    lift: Array
    """(A, D) increment of the lift coefficient; zero at deflection 0."""
    drag: Vector
    """(D,) increment of the drag coefficient."""
    moment: Vector
    """(D,) increment of the moment coefficient about the aerodynamic centre, nose up."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        a, d = self.angle_of_attack, self.deflection
        for name, values in (("angle_of_attack", a), ("deflection", d)):
            if len(values) < 4 or np.any(np.diff(values) <= 0.0):
                raise ValueError(f"{name} must have at least 4 entries and increase")
        if 0.0 not in d:
            raise ValueError("deflection must contain 0")
        if self.lift.shape != (len(a), len(d)):
            raise ValueError(f"lift must have shape ({len(a)}, {len(d)}), but has {self.lift.shape}")
        for name in ("drag", "moment"):
            if len(getattr(self, name)) != len(d):
                raise ValueError(f"{name} must have {len(d)} entries like deflection, found {len(getattr(self, name))}")
        zero = int(np.flatnonzero(d == 0.0)[0])
        if np.any(self.lift[:, zero] != 0.0) or self.drag[zero] != 0.0 or self.moment[zero] != 0.0:
            raise ValueError("increments must be zero at deflection 0")
        return self


class Flap(Record):
    """A trailing-edge flap of each blade, and its actuator."""

    begin: float = Field(ge=0.0, lt=1.0)
    """Inner end, fraction of the blade length from the root."""
    end: float = Field(gt=0.0, le=1.0)
    """Outer end, fraction of the blade length."""
    chord_fraction: float = Field(gt=0.0, lt=1.0)
    """Chord of the flap over that of the section [-; 0.03 to 0.5]; for information: increments have its effect."""
    minimum: float = Field(le=0.0)
    """[rad; 0.02 to 0.6] limit of the deflection."""
    maximum: float = Field(ge=0.0)
    """[rad; 0.02 to 0.6] limit of the deflection."""
    rate: float = Field(gt=0.0)
    """[rad/s; 0.05 to 20] limit of the rate of deflection."""
    frequency: float | None = Field(default=None, gt=0.0)
    """[rad/s; 1 to 500] natural frequency of the actuator; without it the flap follows its demand without delay."""
    damping: float = Field(default=0.7, gt=0.0)
    """Damping ratio of the actuator [-; 0.2 to 2]."""
    increments: FlapIncrements
    source: str = ""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.begin >= self.end:
            raise ValueError(f"begin {self.begin:g} must lie inside end {self.end:g}")
        ordered(self, "minimum", "maximum", "rad")
        d = self.increments.deflection
        if self.minimum < d[0] - 1e-9 or self.maximum > d[-1] + 1e-9:
            raise ValueError(f"the limits lie outside increments.deflection, {d[0]:g} to {d[-1]:g} rad")
        return self


class Blade(Record):
    """One blade; all blades of a turbine are identical."""

    aerodynamics: BladeAerodynamics
    structure: BladeStructure
    flaps: tuple[Flap, ...] = ()
    """Trailing-edge flaps, up to four."""
    source: str = ""

    @property
    def length(self) -> float:
        """Length [m] from root to tip."""
        return float(self.aerodynamics.position[-1])

    @model_validator(mode="after")
    def _check(self) -> Self:
        for part in (self.aerodynamics, self.structure):
            if abs(part.position[0]) > 1e-6:
                raise ValueError(f"position must begin with 0 (the blade root), but begins with {part.position[0]:g} m")
        if len(self.flaps) > MAX_FLAPS:
            raise ValueError(f"flaps: {len(self.flaps)} are given, up to {MAX_FLAPS} are supported")
        a, s = self.aerodynamics.position[-1], self.structure.position[-1]
        if abs(a - s) > 1e-3 * max(a, s):
            raise ValueError(f"the blade is {a:g} m long in aerodynamics.position, but {s:g} m in structure.position")
        return self


class Hub(Record):
    """Hub and rotor geometry."""

    radius: float = Field(gt=0.0)
    """[m; 0.7 to 3 at 100 m] distance from the rotor apex to the blade root along the blade."""
    precone: float = Field(default=0.0, gt=-0.6, lt=0.6)
    """[rad; 0.005 to 0.3] precone; blades lean upwind when positive."""
    mass: float = Field(ge=0.0)
    """[kg; 2.5e3 to 1.2e5 at 100 m] mass."""
    inertia: float = Field(ge=0.0)
    """[kg m^2; 4e3 to 2e5 at 100 m] inertia about the shaft."""
    mass_centre: float = 0.0
    """[m; 0.05 to 2 at 100 m] centre of mass along the shaft from the rotor apex, downwind when positive."""
    source: str = ""


class Nacelle(Record):
    """Nacelle and shaft geometry. Positions are relative to the tower top, in nacelle axes."""

    mass: float = Field(ge=0.0)
    """[kg; 2e4 to 7e5 at 100 m] mass."""
    mass_centre: tuple[float, float, float]
    """[m; 0.4 to 5 at 100 m] centre of mass: x downwind, y left looking downwind, z up."""
    yaw_inertia: float = Field(ge=0.0)
    """[kg m^2; 5e4 to 2e7 at 100 m] inertia about the yaw axis, with that of the mass at its centre."""
    roll_inertia: float = Field(default=0.0, ge=0.0)
    """[kg m^2; 1e4 to 2e6 at 100 m] inertia about the downwind axis through the centre of mass."""
    nod_inertia: float = Field(default=0.0, ge=0.0)
    """[kg m^2; 1e4 to 2e7 at 100 m] inertia about the lateral axis through the centre of mass."""
    overhang: float
    """[m; 2.2 to 9 at 100 m] distance from yaw axis to rotor apex along the shaft; positive for an upwind rotor."""
    shaft_height: float = Field(ge=0.0)
    """[m; 0.7 to 6 at 100 m] height of the intersection of shaft and yaw axis above the tower top."""
    tilt: float = Field(default=0.0, gt=-0.6, lt=0.6)
    """[rad; 0.034 to 0.2] tilt of the shaft; the upwind end is up when positive."""
    source: str = ""

    @model_validator(mode="after")
    def _check(self) -> Self:
        x, y, _ = self.mass_centre
        if self.yaw_inertia < self.mass * (x * x + y * y) * (1.0 - 1e-9):
            raise ValueError(
                f"yaw_inertia {self.yaw_inertia:g} is less than mass times its distance from the yaw axis squared"
            )
        return self


class Drivetrain(Record):
    """Shaft, gearbox, generator and brake."""

    gear_ratio: float = Field(gt=0.0)
    """Generator speed over rotor speed [-; 1 to 250]; 1 for a direct drive."""
    generator_inertia: float = Field(gt=0.0)
    """[kg m^2] inertia of the generator about its shaft."""
    stiffness: float = Field(gt=0.0)
    """[N m/rad] torsional stiffness of the drivetrain, referred to the rotor."""
    damping: float = Field(ge=0.0)
    """[N m s/rad] torsional damping of the drivetrain, referred to the rotor."""
    generator_efficiency: float = Field(default=1.0, gt=0.0, le=1.0)
    """Electrical over mechanical power [-; 0.75 to 1]."""
    gearbox_efficiency: float = Field(default=1.0, gt=0.0, le=1.0)
    """Power on the high-speed side over power on the low-speed side [-; 0.8 to 1]."""
    brake_torque: float = Field(default=0.0, ge=0.0)
    """[N m] torque of the fully applied brake on the generator's shaft."""
    gearbox: Gearbox | None = None
    """Stages of the gearbox, for ``options.drivetrain`` other than ``two_mass``; ``stiffness`` remains that of the
    whole drivetrain, and the main shaft has the stiffness that gives this total."""
    source: str = ""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.gearbox is None:
            return self
        ratio = self.gearbox.ratio
        if abs(ratio - self.gear_ratio) > 1e-3 * self.gear_ratio:
            stages = " x ".join(f"{r:.5g}" for r in self.gearbox.ratios)
            raise ValueError(f"the gearbox has the ratio {stages} = {ratio:.6g}, but gear_ratio is {self.gear_ratio:g}")
        if self.stiffness * self.gearbox.compliance >= 1.0:
            raise ValueError(
                f"stiffness {self.stiffness:.4g} N m/rad is that of the complete drivetrain and must be less than that "
                f"of its gearbox, {1.0 / self.gearbox.compliance:.4g} N m/rad referred to the rotor"
            )
        return self

    @property
    def main_shaft_stiffness(self) -> float:
        """[N m/rad] stiffness of the main shaft; in series with the gearbox it gives ``stiffness``."""
        return 1.0 / (1.0 / self.stiffness - (0.0 if self.gearbox is None else self.gearbox.compliance))


class YawDrive(Record):
    """Yaw drive."""

    rate: float = Field(default=0.0052, ge=0.0, lt=0.2)
    """[rad/s; 0.002 to 0.1] yaw rate."""
    acceleration: float | None = Field(default=None, gt=0.0)
    """[rad/s^2; 1e-4 to 0.1] yaw acceleration; without it the drive reaches its rate instantly."""


class Yaw(YawDrive):
    """Yaw bearing, its drive and its brake."""

    stiffness: float = Field(gt=0.0)
    """[N m/rad; 3e7 to 1e10 at 100 m] stiffness of the locked bearing."""
    damping: float = Field(ge=0.0)
    """[N m s/rad; 3e4 to 2e7 at 100 m] damping of the locked bearing."""
    friction: float = Field(default=0.0, ge=0.0)
    """[N m; 1e4 to 5e6 at 100 m] Coulomb friction of the bearing."""
    brake_torque: float | None = Field(default=None, ge=0.0)
    """[N m; 1e5 to 2e7 at 100 m] slip torque of drive and brake at standstill, besides friction; by default none."""
    source: str = ""


class Tower(Record):
    """Tower, at stations above its base."""

    position: Vector
    """(S,) [m; 40 to 300 at 100 m] height above the tower base; first 0, last the tower top."""
    mass: Vector
    """(S,) [kg/m; 800 to 2e4 at 100 m] mass per length."""
    fore_aft_stiffness: Vector
    """(S,) [N m^2; 3e10 to 4e12 at 100 m] bending stiffness fore-aft."""
    side_side_stiffness: Vector
    """(S,) [N m^2; 3e10 to 4e12 at 100 m] bending stiffness side-to-side."""
    torsion_stiffness: Vector | None = None
    """(S,) [N m^2] torsional stiffness; without it the tower is rigid in torsion."""
    axial_stiffness: Vector | None = None
    """(S,) [N] axial stiffness; without it the tower is rigid axially."""
    shear_stiffness: Vector | None = None
    """(S,) [N] shear stiffness k G A; without it the tower is rigid in shear."""
    diameter: Vector
    """(S,) [m; 1.8 to 18 at 100 m] outer diameter."""
    drag_coefficient: float = Field(default=1.0, ge=0.0)
    """Drag coefficient of the tower as a cylinder [-; 0.35 to 1.5]."""
    top_mass: float = Field(default=0.0, ge=0.0)
    """[kg; 100 to 1e5 at 100 m] mass at the tower top below the yaw bearing: it neither yaws nor loads the bearing."""
    base_height: float = 0.0
    """[m; 1 to 30 at 100 m] height of the tower base above the ground."""
    damping: Damping
    """Structural damping of the isolated tower."""
    mode_shapes: ModeShapes | None = None
    source: str = ""

    @property
    def length(self) -> float:
        """Length [m] from base to top."""
        return float(self.position[-1])

    @model_validator(mode="after")
    def _check(self) -> Self:
        n = len(stations(self.position, "position"))
        names = "mass fore_aft_stiffness side_side_stiffness torsion_stiffness axial_stiffness shear_stiffness diameter"
        per_station(self, names, n)
        positive(self, names)
        if abs(self.position[0]) > 1e-6:
            raise ValueError(f"position must begin with 0 (the tower base), but begins with {self.position[0]:g} m")
        return self


class Foundation(Record):
    """Support of the tower base, fixed or floating; without this record the base is clamped.

    Matrices are of motions along the inertial axes x, y, z at the tower base and about them.
    """

    stiffness: Array
    """(6, 6) [N/m, N/rad, N m/rad] forces and moments on the ground, or on water and moorings, per motion; with
    ``motions`` they may be zero."""
    mass: float | Array = 0.0
    """[kg] point mass that moves with the tower base; or (6, 6) [kg, kg m, kg m^2] mass of a floater and added mass."""
    damping: float | Array = 0.0
    """[N s/m] damping of the translations; or (6, 6) [N s/m, N s, N m s]."""
    motions: tuple[BaseMotion, ...] = ()
    """Motions of the base that are degrees of freedom, as for a floater: surge, sway, heave, roll, pitch, yaw; the
    others are fixed. Without any the base moves with the modes of the tower on its springs."""
    source: str = ""

    def matrix(self, name: Literal["stiffness", "mass", "damping"]) -> NDArray[np.float64]:
        """(6, 6) stiffness, mass or damping; a number is that of the translations."""
        value = np.asarray(getattr(self, name))
        return value if value.ndim else np.diag([float(value)] * 3 + [0.0] * 3)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(set(self.motions)) < len(self.motions):
            raise ValueError(f"motions must differ, found {', '.join(self.motions)}")
        for name in ("stiffness", "mass", "damping"):
            matrix = self.matrix(name)
            if matrix.shape != (6, 6):
                raise ValueError(f"{name} must have shape (6, 6), but has {matrix.shape}")
            least = np.linalg.eigvalsh(matrix)[0]
            if name == "stiffness":  # water and weight may destabilise a floater
                bad, definite = least <= 0.0 and not self.motions, "definite"
            else:
                bad, definite = least < -1e-9 * np.abs(matrix).max(), "semidefinite"
            if bad or not np.allclose(matrix, matrix.T, rtol=1e-6):
                raise ValueError(f"{name} must be symmetric and positive {definite}")
        return self


class PitchFriction(Record):
    """Dry friction of the pitch bearings: a constant, and a part in proportion to the load on the bearing."""

    torque: float = Field(default=0.0, ge=0.0)
    """[N m; 100 to 3e5 at 100 m] friction torque of the unloaded bearing, seals and drive."""
    coefficient: float = Field(default=0.0, ge=0.0, lt=0.1)
    """Friction coefficient of the raceways [-; 0.001 to 0.02], 0.003 to 0.006 for ball bearings."""
    diameter: float = Field(default=0.0, ge=0.0)
    """[m; 0.8 to 6 at 100 m] diameter of the raceway."""
    inertia: float = Field(gt=0.0)
    """[kg m^2; 1e3 to 1e6 at 100 m] inertia of blade and drive about the pitch axis."""


class PitchActuator(Record):
    """Pitch actuator with limits; ``kind: ideal`` follows its demand without delay."""

    kind: ActuatorModel = "second_order"
    natural_frequency: float = Field(default=11.11, gt=0.0)
    """[rad/s; 1.5 to 50 at 100 m] natural frequency."""
    damping_ratio: float = Field(default=0.6, gt=0.0)
    """[-; 0.3 to 2] damping ratio."""
    rate_limit: float = Field(gt=0.0, le=2.0)
    """[rad/s; 0.02 to 5 at 100 m] limit of the pitch rate."""
    minimum: float = Field(gt=-1.6, lt=1.6)
    """[rad; 0.005 to 0.4] smallest pitch."""
    maximum: float = Field(gt=-1.6, lt=3.2)
    """[rad; 0.1 to 1.7] largest pitch."""
    friction: PitchFriction | None = None
    """Dry friction of the bearings; without it there is none."""
    source: str = ""

    @model_validator(mode="after")
    def _check(self) -> Self:
        ordered(self, "minimum", "maximum")
        if self.friction is not None and self.kind != "second_order":
            raise ValueError(f"friction needs kind: second_order, the actuator is {self.kind}")
        return self


class TorqueControl(Record):
    """Generator torque as a function of filtered generator speed, by region (on the generator shaft).

    Below ``cut_in_speed`` no torque; to ``optimal_speed`` a straight line (region 1 1/2); then
    ``optimal_gain`` times speed squared (region 2); near rated a straight line with the slope of an
    induction machine of ``slip`` (region 2 1/2); above, constant power or constant torque (region 3, ``hold``), also
    whenever the pitch exceeds ``power_pitch``.
    """

    cut_in_speed: float = Field(ge=0.0)
    """[rad/s] generator speed at which the torque begins."""
    optimal_speed: float = Field(gt=0.0)
    """[rad/s] start of region 2."""
    rated_speed: float = Field(gt=0.0)
    """[rad/s] start of region 3."""
    optimal_gain: float = Field(gt=0.0)
    """[N m s^2/rad^2] torque over speed squared in region 2."""
    slip: float = Field(gt=0.0, lt=1.0)
    """[-; 0.005 to 0.2] slip of region 2 1/2."""
    rated_power: float = Field(gt=0.0)
    """[W] mechanical rated power."""
    maximum_torque: float = Field(gt=0.0)
    """[N m] torque limit."""
    rate_limit: float = Field(gt=0.0)
    """[N m/s] torque rate limit."""
    power_pitch: float = Field(default=0.0, ge=0.0)
    """[rad; 0.006 to 0.2] pitch above which region 3 applies at all speeds."""
    hold: Literal["power", "torque"] = "power"
    """Constant of region 3: rated power, or the torque that gives rated power at ``pitch.reference_speed``."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.cut_in_speed < self.optimal_speed < self.rated_speed:
            raise ValueError("speeds must satisfy cut_in_speed < optimal_speed < rated_speed")
        return self


class PitchControl(Record):
    """Gain-scheduled PI from the filtered generator speed to the collective pitch."""

    reference_speed: float = Field(gt=0.0)
    """[rad/s] set-point of the generator speed."""
    proportional_gain: float = Field(ge=0.0)
    """[s] proportional gain at zero pitch: pitch [rad] from generator speed [rad/s]."""
    integral_gain: float = Field(gt=0.0)
    """[-] integral gain at zero pitch."""
    gain_halving_pitch: float = Field(gt=0.0)
    """[rad; 0.01 to 0.8] pitch at which the pitch sensitivity is doubled and the gains are halved."""
    minimum: float = Field(gt=-1.6, lt=1.6)
    """[rad; 0.005 to 0.4] smallest pitch."""
    maximum: float = Field(gt=-1.6, lt=3.2)
    """[rad; 0.1 to 1.7] largest pitch demand."""
    rate_limit: float = Field(gt=0.0, le=2.0)
    """[rad/s; 0.02 to 5 at 100 m] limit of the rate of the pitch demand."""
    motion_gain: float = 0.0
    """[rad s/m; 1e-4 to 0.5] gain from the downwind velocity of the tower top to the pitch, for floaters; 0: none."""
    motion_frequency: float = Field(default=0.2, gt=0.0)
    """[rad/s; 0.03 to 1.5 at 100 m] centre of the band-pass of this velocity, that of platform pitch."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        ordered(self, "minimum", "maximum")
        return self


class BaselineControl(Record):
    """Parameters of the variable-speed, pitch-to-feather controller of Jonkman et al. (2009)."""

    filter_frequency: float = Field(gt=0.0)
    """[rad/s; 1 to 20 at 100 m] corner frequency of the first-order low-pass filter of the generator speed."""
    torque: TorqueControl
    pitch: PitchControl
    discon: str | None = None
    """Path of ROSCO's settings (DISCON.IN) for controller ``rosco``, relative to the turbine's file."""
    source: str = ""


class Turbine(TurbineBase):
    """A horizontal-axis wind turbine on land, on a pile in the sea, or on a floating platform."""

    n_blades: int = Field(default=3, ge=1)
    """Number of blades [-; 1 to 3]; 2 or 3 in a simulation."""
    rated_power: float = Field(gt=0.0)
    """[W; 5e5 to 8e6 at 100 m] electrical, for tables; the controller uses ``control.torque.rated_power``."""
    cut_in: float = Field(default=3.0, gt=0.0)
    """[m/s; 1.5 to 6] wind speed at hub height where power curves start; not used in simulations."""
    cut_out: float = Field(default=25.0, gt=0.0)
    """[m/s; 12 to 40] wind speed at hub height where power curves end; not used in simulations."""
    blade: Blade
    airfoils: dict[str, Airfoil]
    hub: Hub
    nacelle: Nacelle
    drivetrain: Drivetrain
    yaw: Yaw
    tower: Tower
    foundation: Foundation | None = None
    support: Support | None = None
    """Pile in the sea below the tower; ``foundation`` is then that of its foot."""
    frame: Frame | None = None
    """Frame of many members below the tower: a jacket or tripod, or with ``platform`` the structure of a floater."""
    mass_dampers: tuple[MassDamper, ...] = ()
    """Tuned mass dampers in tower, nacelle or blades, whose masses do not include them."""
    platform: Platform | None = None
    """Floating platform below the tower; ``foundation`` then has the motions of its base."""
    extensions: dict[str, Any] = Field(default={})
    """Data of parts that other packages register (entry points ``meltemi.parts``), by their names."""
    pitch_actuator: PitchActuator
    control: BaselineControl
    icing: Icing | None = None
    """Ice on the blades."""
    imbalance: Imbalance | None = None
    """Differences between the blades; none by default."""
    electrical: ElectricalSystem | None = None
    """Generator, converters and grid, for ``options.electrical: averaged``; ``size_electrical`` sizes one."""

    @field_validator("airfoils")
    @classmethod
    def _some(cls, airfoils: dict[str, Airfoil]) -> dict[str, Airfoil]:
        if not airfoils:
            raise ValueError("at least one airfoil is needed")
        return airfoils

    @model_validator(mode="after")
    def _check(self) -> Self:
        from meltemi.core.errors import did_you_mean

        for i, name in enumerate(self.blade.aerodynamics.airfoil):
            if name not in self.airfoils:
                raise ValueError(
                    f"blade.aerodynamics.airfoil station {i + 1} names {name!r}, which is not among the airfoils: "
                    f"{did_you_mean(name, self.airfoils)}"
                )
        if self.frame is not None:
            self.frame.check_beside(self.support, self.platform)
        for below in self.substructures:
            below.check_fit(self.tower, self.foundation)
        if self.icing is not None:
            self.icing.on(self.n_blades)
        for name in ("pitch", "mass"):
            deviations(self, name)
        ordered(self, "cut_in", "cut_out", "m/s")
        above_ground(self.hub_height, self.rotor_radius)
        return self

    @property
    def substructures(self) -> tuple[Support | Frame | Platform, ...]:
        """What the tower stands on in the water: pile, frame, platform."""
        return tuple(each for each in (self.support, self.frame, self.platform) if each is not None)

    @property
    def blades_alike(self) -> bool:
        """Whether all blades are equal, including their ice."""
        iced = self.n_blades if self.icing is None else len(self.icing.on(self.n_blades))
        damped = not any(damper.blades for damper in self.mass_dampers)
        return damped and iced == self.n_blades and not any(deviations(self, n).any() for n in ("pitch", "mass"))

    @property
    def flaps(self) -> tuple[Flap, ...]:
        """Flaps of each blade."""
        return self.blade.flaps

    @property
    def rotor_radius(self) -> float:
        """Rotor radius [m] to the tip of the undeflected blade, without cone."""
        return self.hub.radius + self.blade.length

    @property
    def rotor_diameter(self) -> float:
        """Rotor diameter [m]."""
        return 2.0 * self.rotor_radius

    @property
    def hub_height(self) -> float:
        """Height [m] of the rotor apex above ground."""
        n = self.nacelle
        return self.tower.base_height + self.tower.length + n.shaft_height + n.overhang * math.sin(n.tilt)
