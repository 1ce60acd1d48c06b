"""Summary of a turbine: members, modes, rotor performance and steady operation, as far as available."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.modes import Mode, natural_modes
from meltemi.analyses.performance import performance_of, rotor_performance
from meltemi.analyses.power_curve import above_rated, curve_size, power_curve
from meltemi.analyses.rotor_performance import RotorPerformance
from meltemi.core.errors import InputError, MeltemiError
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.model import Model
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.rotors import build
from meltemi.structure.beam import Beam
from meltemi.structure.members import ModalMember, blade_beam, blade_member, cells, tower_beam
from meltemi.turbine.definition import BladeStructure, Turbine
from meltemi.turbine.power_turbine import PowerTurbine

Float = NDArray[np.float64]
T = TypeVar("T")

TIP_SPEED_RATIOS = tuple(np.arange(1.0, 15.01, 0.5).tolist())
PITCHES = tuple(np.radians(np.arange(-6.0, 20.01, 1.0)).tolist())


@dataclass(frozen=True)
class TurbineOverview:
    """Summary of an aeroelastic turbine; what could not be computed is None, with the reason in ``problems``.

    Attributes:
      turbine: description of the turbine.
      model: model of the turbine with default options.
      blade: the clamped blade with two flap and two edge modes, and the first torsion mode if it is flexible in
        torsion.
      modes: natural modes of the assembled turbine at rest, in vacuum.
      performance: coefficients of the rigid, straight rotor.
      curve: operating points in uniform wind, by wind speed; denser around rated.
      problems: reasons by missing item (model, blade, modes, performance, curve).
    """

    turbine: Turbine
    model: BladedModel | None
    blade: ModalMember | None
    modes: tuple[Mode, ...] | None
    performance: RotorPerformance | None
    curve: tuple[OperatingPoint, ...] | None
    problems: Mapping[str, str]

    @property
    def best(self) -> tuple[float, float, float] | None:
        """Highest power coefficient of the table, its tip-speed ratio, and its pitch [rad]."""
        if self.performance is None:
            return None
        table = self.performance
        i, j = np.unravel_index(np.argmax(table.power), table.power.shape)
        return float(table.power[i, j]), float(table.tip_speed_ratio[i]), float(table.pitch[j])

    @property
    def rated(self) -> OperatingPoint | None:
        """The operating point in the lowest wind speed with pitch above the smallest."""
        return next((p for p in self.curve or () if above_rated(self.turbine, p)), None)


@dataclass(frozen=True)
class PowerTurbineOverview:
    """Summary of a power-coefficient turbine; what could not be computed is None, with the reason in ``problems``.

    Attributes:
      turbine: description of the turbine.
      performance: coefficients of the rotor.
      curve: operating points by wind speed; denser around rated.
      problems: reasons by missing item.
    """

    turbine: PowerTurbine
    performance: RotorPerformance
    curve: tuple[OperatingPoint, ...] | None
    problems: Mapping[str, str]


def power_turbine_overview(turbine: PowerTurbine) -> PowerTurbineOverview:
    """Compute the summary of a power-coefficient turbine."""
    problems: dict[str, str] = {}
    model = build(turbine)
    curve = _attempt(problems, "curve", lambda: _curve(model, problems, lambda _: None))
    return PowerTurbineOverview(turbine, performance_of(turbine), curve, problems)


def turbine_overview(turbine: Turbine, *, progress: Callable[[float], None] | None = None) -> TurbineOverview:
    """Compute the summary of an aeroelastic turbine; what fails is omitted, with its reason.

    Args:
      progress: callback with the completed fraction.
    """
    problems: dict[str, str] = {}
    done = progress or (lambda _: None)
    model = _attempt(problems, "model", lambda: build(turbine))
    blade = _attempt(problems, "blade", lambda: _blade(turbine))
    modes = performance = curve = None
    if model is None:
        problems.update(dict.fromkeys(("modes", "performance", "curve"), problems["model"]))
    else:
        modes = _attempt(problems, "modes", lambda: tuple(natural_modes(model)))
        done(0.1)
        performance = _attempt(problems, "performance", lambda: rotor_performance(turbine, TIP_SPEED_RATIOS, PITCHES))
        done(0.3)
        curve = _attempt(problems, "curve", lambda: _curve(model, problems, lambda x: done(0.3 + 0.7 * x)))
    done(1.0)
    return TurbineOverview(turbine, model, blade, modes, performance, curve, problems)


def principal_stiffness(blade: BladeStructure) -> tuple[Float, Float, Float | None]:
    """Flapwise, edgewise and torsional stiffness [N m^2] at the stations.

    For a 6 x 6 matrix they are the principal ones: curvature under a pure moment is the same about every point of the
    section, so the moment block of the inverse does not depend on the reference axis; the reciprocals of its
    eigenvalues in the plane of bending are the stiffnesses, that of its last entry is the stiffness of free torsion.
    """
    if blade.stiffness_matrix is None:
        assert blade.flap_stiffness is not None and blade.edge_stiffness is not None
        return blade.flap_stiffness, blade.edge_stiffness, blade.torsion_stiffness
    compliance: Any = np.linalg.inv(blade.stiffness_matrix)[:, 3:, 3:]
    value, vector = np.linalg.eigh(compliance[:, :2, :2])
    flap = np.argmax(np.abs(vector[:, 1, :]), axis=1)  # flapwise bending is about y
    rows = np.arange(len(value))
    return 1.0 / value[rows, flap], 1.0 / value[rows, 1 - flap], 1.0 / compliance[:, 2, 2]


def line_mass(beam: Beam) -> Float:
    """(S,) [kg/m] mass per length at the stations."""
    return beam.mass[:, 0, 0]


def beam_mass(beam: Beam) -> tuple[float, float]:
    """Mass [kg] of a beam, and position [m] of its centre of mass along it."""
    z, weights = beam.pieces(beam.position[[0, -1]])
    share = weights[:, 0] * beam.at(z, "mass")[:, 0, 0]
    return float(share.sum()), float(share @ z / share.sum())


def masses(turbine: Turbine) -> dict[str, float]:
    """Mass [kg] of blade, hub, rotor, nacelle and tower."""
    blade, tower = beam_mass(blade_beam(turbine.blade.structure))[0], beam_mass(tower_beam(turbine.tower))[0]
    rotor = turbine.n_blades * blade + turbine.hub.mass
    below = tower + turbine.tower.top_mass
    return {"blade": blade, "hub": turbine.hub.mass, "rotor": rotor, "nacelle": turbine.nacelle.mass, "tower": below}


def _attempt(problems: dict[str, str], what: str, compute: Callable[[], T]) -> T | None:
    try:
        return compute()
    except (MeltemiError, ValueError, ArithmeticError) as error:  # LinAlgError is a ValueError
        problems[what] = str(error)
        return None


def _blade(turbine: Turbine) -> ModalMember:
    structure = turbine.blade.structure
    counts = {"flap": 2, "edge": 2, "torsion": int(structure.twists)}
    return blade_member(structure, counts, cells(np.linspace(0.0, turbine.blade.length, 21)))


def _curve(
    model: Model[Any], problems: dict[str, str], progress: Callable[[float], None]
) -> tuple[OperatingPoint, ...]:
    """Operating points of the power curve, by wind speed; speeds without one are omitted."""
    points, reasons = [], {}
    for i, (speed, point) in enumerate(power_curve(model), 1):
        if isinstance(point, str):
            reasons[speed] = point
        else:
            points.append(point)
        progress(i / curve_size(model.turbine))
    if reasons:
        some = ", ".join(f"{u:g}" for u in sorted(reasons))
        problems["some of the curve"] = f"no operating point in winds of {some} m/s: {reasons[min(reasons)]}"
    if not points:
        raise InputError(next(iter(reasons.values()), "no whole number of m/s lies between cut_in and cut_out"))
    return tuple(sorted(points, key=lambda point: point.wind.speed))
