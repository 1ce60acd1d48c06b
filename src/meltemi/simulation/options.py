"""Options of a model; each has a default."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from meltemi.aero.variants import InflowModel, RotationalAugmentation, StallModel, TowerInfluence
from meltemi.core.record import Record
from meltemi.simulation.blades import BladeModel


class StallConstants(Record):
    """Constants of the dynamic stall model.

    The defaults are those of the model's authors: Jones' approximation of the Wagner function of a flat plate, and lags
    of 1.5 and 6 semi-chords (Hansen, Gaunaa & Madsen 2004).
    """

    a1: float = Field(default=0.165, ge=0.0, le=1.0)
    a2: float = Field(default=0.335, ge=0.0, le=1.0)
    b1: float = Field(default=0.0455, gt=0.0, le=10.0)
    b2: float = Field(default=0.3, gt=0.0, le=10.0)
    pressure_lag: float = Field(default=1.5, gt=0.0)
    """[semi-chords; 0.5 to 5] lag of the pressure."""
    separation_lag: float = Field(default=6.0, gt=0.0)
    """[semi-chords; 1 to 20] lag of the separation point."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.a1 + self.a2 > 1.0 + 1e-9:
            raise ValueError(f"a1 + a2, the lagging part of lift, must be at most 1, found {self.a1 + self.a2:g}")
        return self


BEDDOES = StallConstants(a1=0.3, a2=0.7, b1=0.14, b2=0.53, pressure_lag=1.7, separation_lag=3.0)
"""Constants of Beddoes and Leishman, OpenFAST's default."""


class AdvancedOptions(Record):
    """Options for comparisons with other codes and for studies of convergence; load calculations need none of them."""

    high_induction: Literal["buhl", "none", "madsen"] = "buhl"
    """Momentum at high loads: Buhl's, uncorrected, or HAWC2's polynomial (Madsen 2020)."""
    stall_fit: Literal["hansen", "openfast"] = "hansen"
    """Degree of attachment and fully separated lift from the polar: as the model's authors define them, so that
    the static lift is recovered exactly, or as in OpenFAST 5."""
    stall_rotation: Literal["camber", "openfast", "none"] = "camber"
    """Effect of the rotation of a section about its span with dynamic stall: the rotation of a coned or bent blade with
    the rotor curves the flow and acts like camber, and pitching and torsion also add apparent-mass lift; or the whole
    rotation does both and tilts the lift, as in OpenFAST 5; or none."""
    reversed_flow: Literal["lagged", "static"] = "lagged"
    """Dynamic stall model with the trailing edge ahead, within 45 degrees from the chord: the static polar behind the
    lag of the shed wake, or, as in OpenFAST 5, the static polar."""
    chord_angle: Literal["section", "openfast"] = "section"
    """Second-order part of the chord's angle on a blade bent both ways: in the plane of the section, or from the order
    of rotations in OpenFAST 5."""

    blade_cells: tuple[float, ...] | None = Field(default=None, min_length=2, max_length=201)
    """Edges [m] from the root of blade pieces with a node in the middle of each, in place of ``blade_nodes``."""
    corrections: int = Field(default=0, ge=0, le=5)
    """Additional evaluations in each step, with corrected velocities."""
    induction_iterations: int = Field(default=5, ge=2, le=100)
    """Largest number of evaluations of the momentum balance at each node and step."""
    induction_tolerance: float = Field(default=1e-6, ge=0.0, le=1e-4)
    """Residual of the momentum balance, over the relative wind, at which they end; with 0 at 1e-12."""


class VortexOptions(Record):
    """Discretisation of vortex wakes.

    Up to thrust coefficients of 0.75 finer ones change steady power by less than 1 %; above 0.8 the length of the free
    part changes it by 2 to 3 %.
    """

    azimuth_step: float = Field(default=0.1745, ge=0.01, le=0.53)
    """[rad; 0.08 to 0.18] azimuth between the rows of the wake."""
    lattice: float = Field(default=0.5, ge=0.05, le=20.0)
    """[revolutions] age up to which every element of the blades has its vortices; beyond it, four a blade."""
    free: float = Field(default=4.0, ge=0.0, le=40.0)
    """[revolutions] age up to which the wake moves with the velocity at its place; beyond it, with that at its end."""
    length: float = Field(default=20.0, ge=1.0, le=100.0)
    """[revolutions] age at which the wake ends."""
    core: Literal["vatistas", "lamb_oseen", "rankine", "offset", "none"] = "vatistas"
    """Velocity within the cores of the vortices."""
    blade_core: float = Field(default=0.1, ge=0.0, le=5.0)
    """[-] core radius over the width of an element, for velocities at the blades."""
    wake_core: float = Field(default=0.6, ge=0.0, le=5.0)
    """[-] core radius over the width of an element, for velocities in the wake."""
    eddy_viscosity: float = Field(default=1000.0, ge=0.0, le=1e6)
    """[-] viscosity with which cores grow, over that of air."""
    shed: float = Field(default=0.125, ge=0.0)
    """[revolutions] age from which vorticity shed by changes of lift counts; before, the dynamic stall model has it."""
    ground: bool = False
    """Mirror the wake at the ground."""
    wind: Literal["local", "mean"] = "local"
    """Wind that moves the wake: at each vortex, or the mean over the rotor."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if max(self.lattice, self.free) > self.length:
            least = max(self.lattice, self.free)
            raise ValueError(f"length: expected at least lattice and free, {least:g}, found {self.length:g}")
        return self


class ModelOptions(Record):
    """Degrees of freedom, aerodynamic models, discretisation."""

    flap_modes: int | None = Field(default=None, ge=0, le=10)
    """Flapwise modes of each blade; by default two, or three if its sections are 6 x 6 matrices, which couple bending
    and torsion."""
    edge_modes: int | None = Field(default=None, ge=0, le=10)
    """Edgewise modes of each blade; by default one, or two with 6 x 6 matrices."""
    torsion_modes: int | None = Field(default=None, ge=0, le=5)
    """Torsional modes of each blade; by default one if it has a torsional stiffness."""
    residual_modes: int | None = Field(default=None, ge=0, le=5)
    """Residual modes of each blade: what the natural modes leave out of its static deflection by a flapwise load, by
    three distributions of moments about the span, and by centrifugal force; by default four with 6 x 6 matrices,
    otherwise none. More than five flapwise, three edgewise or two torsional modes need all five, the default then, or
    none."""
    fore_aft_modes: int = Field(default=2, ge=0, le=5)
    """Fore-aft modes of the tower."""
    side_side_modes: int = Field(default=2, ge=0, le=5)
    """Side-to-side modes of the tower."""
    tower_torsion_modes: int = Field(default=0, ge=0, le=3)
    """Torsional modes of the tower."""
    mode_shapes: Literal["computed", "given"] = "computed"
    """Natural modes computed from the section data, or the mode shapes of the description."""
    blade_model: BladeModel = "geometrically_exact"
    """Structural model of the blades, from the same modes: cells between the nodes that rotate without limit against
    each other, or "modal": deflections of second order, for up to a tenth of the blade's length."""
    locked: tuple[str, ...] = ()
    """Coordinates that keep their initial velocity (that of a locked generator is the start's, by default rated speed);
    names or groups, see ``Model.coordinates``:
    "tower", "yaw", "generator", "drivetrain", "blades", "flap", "edge", "torsion", or a full name."""
    yaw: Literal["held", "free", "driven"] = "held"
    """The yaw bearing: held by its spring and damper, free, or driven by the controller's yaw rate."""
    nacelle_yaw: float = Field(default=0.0, ge=-7.0, le=7.0)
    """[rad] yaw angle of the nacelle at the start, counter-clockwise."""
    drivetrain: Literal["two_mass", "quasi_static", "multibody"] = "two_mass"
    """Torsion of the drivetrain: one spring between rotor and generator; with the inertia of the gearbox's parts in
    quasi-static motion; or with all their degrees of freedom. The last two need ``drivetrain.gearbox``."""

    electrical: Literal["ideal", "averaged"] = "ideal"
    """Ideal generator, whose torque is the demand and whose power is torque times speed times an efficiency; or
    generator, averaged converters, DC link and grid of ``turbine.electrical``."""

    blade_nodes: int | tuple[float, ...] = 20
    """Number of nodes along a blade (midpoint rule, denser towards the tip), or their distances [m] from
    the root, including root and tip (trapezoidal rule)."""
    tower_nodes: int = Field(default=21, ge=3, le=200)
    """Number of nodes along the tower."""

    disk_points: int = Field(default=32, ge=1, le=1000)
    """Power-coefficient turbines only: number of points of the rotor disk over which a wind field is averaged; a
    hub-height wind is evaluated at the hub."""

    wake: Literal["momentum", "near", "hybrid", "free", "none"] = "momentum"
    """Induction by blade-element momentum, or none; by trailed vortices behind each blade with momentum's far wake
    (near); by a vortex wake that moves with velocities by its age (hybrid), or at each of its vortices (free)."""
    vortices: VortexOptions = VortexOptions()
    """Discretisation of vortex wakes."""
    tip_loss: bool = True
    """Prandtl's tip loss."""
    hub_loss: bool = True
    """Prandtl's hub loss."""
    axial_drag: bool = False
    """Include the drag in the axial momentum balance."""
    tangential_drag: bool = False
    """Include the drag in the tangential momentum balance."""
    skew: Literal["glauert", "none"] = "glauert"
    """Redistribution of the induction in a skewed wake."""
    skew_momentum: Literal["axial", "glauert", "cylinder"] = "axial"
    """Mean induction of a rotor in skewed flow: from the momentum of the flow along the shaft; from that of the whole
    flow through the disk (Glauert); or from a skewed vortex cylinder, between them."""
    inflow: InflowModel = "variable"
    """Dynamic inflow with a time constant that depends on wind and induction, with a constant one, or none."""
    inflow_time: float = Field(default=4.0, gt=0.0)
    """[s; 0.2 to 60] time constant of the constant variant."""
    stall: StallModel = "hansen"
    """Dynamic stall, or static polars."""
    stall_constants: StallConstants = StallConstants()
    deep_stall: Literal["given", "plate"] = "given"
    """Polars in deep stall, beyond 30 to 45 degrees from the chord: as the description gives them, or those of a plate
    with their drag at 90 degrees, which has no suction along the chord."""
    rotational_augmentation: RotationalAugmentation = "none"
    """Correction of two-dimensional polars for the rotation of the blade, which delays stall at small radii: none, as
    the polars of a turbine usually contain it; after Snel; or after Chaviaropoulos and Hansen."""
    tower_influence: TowerInfluence = "potential"
    """Potential flow around the tower, at all heights below its top or only for blades that point down; with the wake
    of the tower after Powles or after Eames, for rotors downwind of it; or none."""
    tower_drag: bool = True
    """Drag of the wind on the tower."""

    tower_clearance: float | None = Field(default=None, ge=0.0)
    """[m] distance of a blade's axis from the tower's surface below which a run has a warning; by default 30 % of that
    of the undeflected rotor."""
    time_step: float | None = Field(default=None, gt=0.0, le=1.0)
    """[s] time step; by default from the highest natural frequency of the model, and such that it divides the intervals
    of outputs and of the controller."""
    integration: Literal["implicit", "explicit"] = "implicit"
    """Stiffness and structural damping in the time integration: implicit for all coordinates, exact for their free
    vibrations; or explicit, in shorter steps, but for modes that are stiff, such as the shaft of a direct drive."""

    advanced: AdvancedOptions = AdvancedOptions()
    """Conventions of other codes and accuracy of the method, for comparisons and studies of convergence."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if isinstance(self.blade_nodes, int):
            if not 5 <= self.blade_nodes <= 200:
                raise ValueError(f"blade_nodes must be between 5 and 200, found {self.blade_nodes}")
        elif not 5 <= len(self.blade_nodes) <= 200:
            raise ValueError(f"blade_nodes: from 5 to 200 positions are needed, found {len(self.blade_nodes)}")
        if self.advanced.high_induction == "madsen" and self.skew_momentum != "axial":
            raise ValueError(f"high_induction madsen needs skew_momentum axial, found {self.skew_momentum}")
        return self
