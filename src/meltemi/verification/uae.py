"""Measured loads of a rotor: NREL's Unsteady Aerodynamics Experiment, Phase VI, in the NASA Ames wind tunnel.

Two blades with one airfoil (S809), 10 m of diameter, 72 rpm, no cone, tilt or shear.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.tables import AeroNode
from meltemi.aero.variants import RotationalAugmentation
from meltemi.analyses.performance import RIGID
from meltemi.report.palette import COLOURS, INK, SHADE
from meltemi.report.plots import new_figure
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.case import Case
from meltemi.simulation.options import AdvancedOptions, ModelOptions
from meltemi.simulation.rotors import build
from meltemi.turbine.definition import Airfoil, Turbine
from meltemi.turbine.library import load_turbine
from meltemi.verification.table import Check, CheckStudy, CheckTable, difference, reference_table, relative, source_of
from meltemi.wind.fields import SteadyWind

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

MODELS: dict[RotationalAugmentation, str] = {
    "none": "two-dimensional polars",
    "snel": "Snel",
    "chaviaropoulos_hansen": "Chaviaropoulos & Hansen",
}
ATTACHED = 7.0
"""[m/s] wind speed with attached flow."""
BAND = 5.0
"""Band [%] in attached flow."""
REPEATED_TORQUE = {7.0: 801.3, 15.0: 1163.8}
"""[N m] torque in sequence S, a repetition without the probes, by wind speed [m/s]; that of 15 m/s from a second
transcription."""
BLIND_COMPARISON = ((0.25, 1.75), (0.30, 2.75))
"""Least and largest power over the measured one in NREL's blind comparison: without stall, in stall (TP-500-29494)."""

SPEED = 72.0 * np.pi / 30.0
"""[rad/s] rotor speed."""
PITCH = np.radians(3.0 + 1.815)
"""[rad] tip pitch of 3 deg, and the twist of the tip."""
WAKE_RAKE = (-6.3, 8.3)
"""[deg] angles of attack of attached flow, where the drag is that of the wake; elsewhere that of the pressures."""
RE_RADII = (2.36, 4.02)
"""[m] radii with Reynolds numbers of 0.75 and 1 million at 7 m/s; the polars are interpolated between them."""
TUBE, SECTION = (0.8835, 0.1830), (1.2575, 0.1544)
"""Radius and thickness [m] where the tube of the root ends, and where the airfoil, 20.95 % thick, begins."""
TUBE_DRAG = 1.2
"""Drag coefficient of a cylinder below the critical Reynolds number."""


def s809(reynolds: str) -> Float:
    """(4, P) angle of attack [rad], lift, drag and moment: measured from -20 to 90 deg, mirrored beyond.

    Args:
      reynolds: number in millions, as in the table.
    """
    rows = [r for r in reference_table("s809") if r["reynolds"] in (reynolds, "0.3")]
    rows.sort(key=lambda r: float(r["angle"]))
    low, high = WAKE_RAKE
    angle, lift = ([float(r[name]) for r in rows] for name in ("angle", "lift"))
    drag = [
        float(r["wake_drag" if r["wake_drag"] and low < a < high else "pressure_drag"])
        for a, r in zip(angle, rows, strict=True)
    ]
    moment = [float(r["moment"]) for r in rows if r["moment"]]
    alpha = np.linspace(-180.0, 180.0, 1441)
    side = np.where(alpha < angle[0], -1.0, 1.0)
    behind = side * alpha > 90.0
    x = np.where(behind, 180.0 - side * alpha, side * alpha)
    turned = side * np.where(behind, -1.0, 1.0)
    return np.stack(
        [
            np.radians(alpha),
            turned * np.interp(x, angle, lift),
            np.interp(x, angle, drag),
            side * np.interp(x, angle[: len(moment)], moment),
        ]
    )


@cache
def phase_vi() -> Turbine:
    """The turbine of the experiment for a rigid rotor at constant speed; other data are those of the NREL 5 MW."""
    rows = reference_table("uae_blade")
    radius, chord, twist, axis = (
        np.array([float(r[name]) for r in rows]) for name in ("radius", "chord", "twist", "pitch_axis")
    )
    low, high = s809("0.75"), s809("1.0")
    thick = np.interp(radius, (TUBE[0], SECTION[0]), (TUBE[1], SECTION[1])) / chord
    airfoils = {}
    for r, t in zip(radius, thick, strict=True):
        alpha, *airfoil = low + np.interp(r, RE_RADII, (0.0, 1.0)) * (high - low)
        # between tube and airfoil by relative thickness
        share = float(np.interp(t, (0.2095, 1.0), (0.0, 1.0))) if r < SECTION[0] else 0.0
        tube = np.zeros_like(alpha), np.full_like(alpha, TUBE_DRAG), np.zeros_like(alpha)
        lift, drag, moment = ((1.0 - share) * a + share * b for a, b in zip(airfoil, tube, strict=True))
        airfoils[f"{r:.4f} m"] = Airfoil(
            angle_of_attack=alpha, lift=lift, drag=drag, moment=moment, dynamic_stall=share == 0.0
        )
    position = radius - radius[0]
    other = load_turbine("nrel5mw")
    return other.replace(
        **{
            "name": "uae_phase_vi",
            "n_blades": 2,
            "hub.radius": radius[0],
            "hub.precone": 0.0,
            "nacelle.tilt": 0.0,
            "drivetrain.gear_ratio": other.control.pitch.reference_speed / SPEED,
            "airfoils": airfoils,
            "blade.aerodynamics": {
                "position": position,
                "chord": chord,
                "twist": np.radians(twist),
                "airfoil": tuple(airfoils),
                "centre_y": (0.25 - axis) * chord,
            },
            "blade.structure": {
                "position": position[[0, -1]],
                "twist": [0.0, 0.0],
                "mass": [12.0, 12.0],
                "flap_stiffness": [1e6, 1e6],
                "edge_stiffness": [1e6, 1e6],
                "damping": {"flap": 0.01, "edge": 0.01},
            },
        }
    )


@dataclass(frozen=True)
class SteadyLoads:
    """Steady loads of the rigid rotor.

    Attributes:
      torque, thrust: [N m], [N] loads of the rotor.
      position: (N,) radius over that of the rotor.
      alpha: (N,) [rad] angle of attack.
      normal, tangential: (N,) coefficients normal to the chord, and along it towards the leading edge.
      lever: (2, N) [N m] torque of the rotor by unit coefficients.
    """

    torque: float
    thrust: float
    position: Float
    alpha: Float
    normal: Float
    tangential: Float
    lever: Float

    def torque_with(self, normal: Float, tangential: Float) -> float:
        """[N m] torque with other coefficients at the nodes in the same flow."""
        return float(np.sum(self.lever * np.stack([normal, tangential])))


def rigid_model(turbine: Turbine, **options: Any) -> BladedModel:
    """The rigid rotor with static polars and steady wake, other options as given."""
    converged = AdvancedOptions(induction_iterations=20)
    chosen = {"inflow": "quasi_steady", "stall": "static", "blade_nodes": 60, "advanced": converged, **options}
    return build(turbine, ModelOptions(locked=RIGID, tower_influence="none", **chosen))


def steady_loads(model: BladedModel, wind: float, speed: float, density: float) -> SteadyLoads:
    """Loads in uniform wind [m/s] at a rotor speed [rad/s] and an air density [kg/m^3]."""
    case = Case(model, SteadyWind(speed=wind))
    case["v"][model.rows.generator] = speed
    case.view("pitch")["angle"] = PITCH
    for _ in range(10):
        case.evaluate(0.0)
    flow, rotor, air = case.view("flow"), case.view("rotor"), density / model.environment.density
    alpha, lift, drag = (flow[name][0].copy() for name in ("alpha", "lift", "drag"))
    c, s = np.cos(alpha), np.sin(alpha)
    chord, length = (model.rotor.aero_nodes[AeroNode.index(name), 0] for name in ("chord", "length"))
    area = model.n_blades * 0.5 * density * flow["speed"][0] ** 2 * chord * length * flow["radius"][0]
    return SteadyLoads(
        torque=air * float(rotor["torque"]),
        thrust=air * float(rotor["thrust"]),
        position=flow["radius"][0] / model.turbine.rotor_radius,
        alpha=alpha,
        normal=lift * c + drag * s,
        tangential=lift * s - drag * c,
        lever=area * np.stack([np.sin(flow["theta"][0]), np.cos(flow["theta"][0])]),
    )


def at_record(model: BladedModel, record: dict[str, str]) -> SteadyLoads:
    """Loads at wind, rotor speed and air density of a record."""
    wind, speed, density = (float(record[name]) for name in ("wind", "rotor_speed", "density"))
    return steady_loads(model, wind, speed * np.pi / 30.0, density)


@cache
def _ours() -> dict[RotationalAugmentation, dict[str, SteadyLoads]]:
    """Loads of each model at each record."""
    models = {name: rigid_model(phase_vi(), rotational_augmentation=name) for name in MODELS}
    records = reference_table("uae_performance")
    return {name: {r["record"]: at_record(model, r) for r in records} for name, model in models.items()}


def attached() -> CheckTable:
    """Comparison at 7 m/s with the airfoil's polars."""
    rows: list[Check] = []
    ours = _ours()["none"]
    for r in reference_table("uae_performance", wind="7"):
        for name, unit in (("torque", "N m"), ("thrust", "N")):
            value = getattr(ours[r["record"]], name)
            rows.append(relative(name, f"sequence {r['sequence']}", unit, float(r[name]), value, BAND))
    for r in reference_table("uae_spanwise", wind="7"):
        rows += _section("", f"{100.0 * float(r['position']):g} % of the radius", r, ours["h0700000"], BAND)
    title = "UAE Phase VI, attached flow at 7 m/s"
    return CheckTable("uae attached", title, source_of("uae_performance"), rows)


def stalled() -> CheckTable:
    """Sequence H, without and with rotational augmentation: reported."""
    rows: list[Check] = []
    for model, label in MODELS.items():
        for r in reference_table("uae_performance", sequence="H"):
            case, ours = f"{r['wind']} m/s", _ours()[model][r["record"]]
            rows.append(relative(f"torque, {label}", case, "N m", float(r["torque"]), ours.torque))
            rows.append(relative(f"thrust, {label}", case, "N", float(r["thrust"]), ours.thrust))
            normal, tangential = _measured_along(ours, r["wind"])
            swapped = ours.torque_with(ours.normal, tangential)
            what = "torque with measured tangential coefficients"
            rows.append(relative(f"{what}, {label}", case, "N m", float(r["torque"]), swapped))
            both = ours.torque_with(normal, tangential)
            rows.append(relative(f"torque from measured coefficients, {label}", case, "N m", float(r["torque"]), both))
            for s in reference_table("uae_spanwise", wind=r["wind"]):
                where = f"{case}, {100.0 * float(s['position']):g} % of the radius"
                rows += _section(f", {label}", where, s, ours)
    title = "UAE Phase VI, into stall, without and with rotational augmentation"
    figures = {"uae_torque": _plot_torque(), "uae_sections": _plot_sections((7.0, 10.0, 15.0, 25.0))}
    return CheckTable("uae stalled", title, source_of("uae_performance"), rows, figures=figures)


def _measured_along(ours: SteadyLoads, wind: str) -> tuple[Float, Float]:
    """Measured coefficients at the nodes: interpolated, constant beyond the outer sections; ours inside the airfoil."""
    table = reference_table("uae_spanwise", wind=wind)
    position, normal, tangential = (
        np.array([float(r[name]) for r in table]) for name in ("position", "normal", "tangential")
    )
    airfoil = ours.position > SECTION[0] / phase_vi().rotor_radius
    n, t = (np.interp(ours.position, position, x) for x in (normal, tangential))
    return np.where(airfoil, n, ours.normal), np.where(airfoil, t, ours.tangential)


def _section(label: str, case: str, r: dict[str, str], ours: SteadyLoads, band: float | None = None) -> list[Check]:
    """Coefficients of a section; that along the chord is only reported."""
    n, t = (float(np.interp(float(r["position"]), ours.position, x)) for x in (ours.normal, ours.tangential))
    return [
        relative(f"normal coefficient{label}", case, "-", float(r["normal"]), n, band),
        difference(f"tangential coefficient{label}", case, "-", float(r["tangential"]), t),
    ]


MEASURED = (CheckStudy(5.0, attached), CheckStudy(1.0, stalled))


def _plot_torque() -> Figure:
    records = reference_table("uae_performance", sequence="H")
    wind, torque, thrust = (np.array([float(r[name]) for r in records]) for name in ("wind", "torque", "thrust"))
    figure, axes = new_figure(1, 2, size=(9.0, 3.8))
    left, right = axes.flat
    least, most = (np.where(wind > ATTACHED, BLIND_COMPARISON[1][i], BLIND_COMPARISON[0][i]) * torque for i in (0, 1))
    left.fill_between(wind, 1e-3 * least, 1e-3 * most, color=SHADE, label="codes of the blind comparison")
    for ax, name in ((left, "torque"), (right, "thrust")):
        for j, (model, label) in enumerate(MODELS.items()):
            ours = [getattr(_ours()[model][r["record"]], name) for r in records]
            ax.plot(wind, 1e-3 * np.array(ours), "o-", ms=3, color=COLOURS[j], label=label)
        ax.set_xlabel("wind speed [m/s]")
    again = np.array([REPEATED_TORQUE.get(float(u), q) for u, q in zip(wind, torque, strict=True)])
    error = 1e-3 * np.stack([np.maximum(torque - again, 0.0), np.maximum(again - torque, 0.0)])
    left.errorbar(wind, 1e-3 * torque, error, fmt="s", ms=5, capsize=4, color=INK, label="measured", zorder=5)
    right.plot(wind, 1e-3 * thrust, "s", ms=5, color=INK, label="measured, from pressures", zorder=5)
    left.set_ylabel("torque [kN m]")
    right.set_ylabel("thrust [kN]")
    for ax in (left, right):
        ax.set_ylim(bottom=0.0)
        ax.set_xticks(wind)
        ax.legend(loc="upper left")
    return figure


def _plot_sections(winds: tuple[float, ...]) -> Figure:
    figure, axes = new_figure(2, len(winds), size=(9.0, 4.6))
    records = {float(r["wind"]): r["record"] for r in reference_table("uae_performance", sequence="H")}
    for column, wind in zip(axes.T, winds, strict=True):
        table = reference_table("uae_spanwise", wind=f"{wind:g}")
        for ax, name in zip(column, ("normal", "tangential"), strict=True):
            for j, (model, label) in enumerate(MODELS.items()):
                ours = _ours()[model][records[wind]]
                blade = ours.position > SECTION[0] / phase_vi().rotor_radius
                ax.plot(ours.position[blade], getattr(ours, name)[blade], color=COLOURS[j], label=label)
            measured = [float(r[name]) for r in table]
            ax.plot([float(r["position"]) for r in table], measured, "s", ms=4, color=INK, label="measured")
            ax.set_xlim(0.2, 1.0)
        column[0].set_title(f"{wind:g} m/s")
        column[1].set_xlabel("$r/R$ [-]")
    for ax in axes[0]:
        ax.set_ylim(0.0, 3.0)
    for ax in axes[1]:
        ax.set_ylim(-0.2, 0.6)
    axes[0, 0].set_ylabel("normal coefficient [-]")
    axes[1, 0].set_ylabel("tangential coefficient [-]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=4)
    return figure
