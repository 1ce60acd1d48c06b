"""Imported models of HAWC2 against results of HAWC2 and HAWCStab2: steady operation and frequencies.

At their rotor speed and pitch, without tilt and gravity, with HAWC2's balance of momentum. A further column has the
deviation with the known differences of the other program. HAWC2's elements have constant sections, the mean of those
between two nodes; imported blades have sections linear between the stations. HAWCStab2's lift is normal to the flow
at three quarters of the chord, ours (A-39) and HAWC2's to the flow at the aerodynamic centre. HAWC2 turns the centres
of mass of fully populated sections about the elastic ones (S-72).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.aero.tables import AeroNode
from meltemi.analyses.modes import natural_modes
from meltemi.compiler import View
from meltemi.core.errors import InputError
from meltemi.environment.site import Environment
from meltemi.exchange.hawc2.bodies import Body, read_bodies
from meltemi.exchange.hawc2.htc import read_htc
from meltemi.exchange.hawc2.model import SECTION
from meltemi.exchange.hawc2.sections import at_elastic_centre, section_matrices, turned_centres
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.case import Case
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.options import AdvancedOptions, ModelOptions
from meltemi.simulation.rotors import build
from meltemi.simulation.trim import operating_point
from meltemi.structure.members import blade_member, cells, points, tower_member
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import DATA, library_entries, load_turbine
from meltemi.verification.table import Check, CheckStudy, CheckTable, angle, reference_table, relative, source_of

Float = NDArray[np.float64]

BAND, TORSION, FREQUENCY = 1.5, 0.2, 1.0
"""Bands of power and thrust [%], of the tip's torsion [deg] and of frequencies [%]."""
MODES = {"flap_modes": 8, "edge_modes": 6, "torsion_modes": 5, "residual_modes": 5}
"""24 modes of a blade, with which the last twentieth of the IEA 22 MW's twists as its finite elements do."""
FIXED = ("tower", "yaw", "drivetrain", "generator")
CLAMPED = {"blade": {"flap": 3, "edge": 2, "torsion": 1}, "tower": {"fore_aft": 2, "side_side": 2, "torsion": 0}}
"""Number of modes of a clamped member by direction."""
NODES = 40
"""Nodes along a blade: with 80, steady power and thrust change by less than 0.05 %."""
ITERATIONS = 5
"""Torsion is ours or HAWC2's; each round leaves a quarter of what is missing."""
NODE_GAP = 2e-5
"""[m] distance between the sections on both sides of a node."""


@dataclass(frozen=True)
class Hawc2Model:
    """A model of HAWC2.

    Attributes:
      key: key of the reference data.
      title: title in words.
      main: name of its main file.
      stiff: whether the blades are stiff in the reference.
      stability: whether the reference is HAWCStab2's.
      full: whether the blades have fully populated matrices.
    """

    key: str
    title: str
    main: str
    stiff: bool = False
    stability: bool = False
    full: bool = False

    @property
    def beside(self) -> str:
        """Head of the further column."""
        if self.full:
            return f"{ELEMENTS}, centres of mass; 24 modes"
        return "" if self.stiff else "HAWCStab2's elements, lift" if self.stability else ELEMENTS


ELEMENTS = "HAWC2's elements"
DTU10 = Hawc2Model("dtu10", "DTU 10 MW", "DTU_10MW_RWT.htc")
IEA10 = Hawc2Model("iea10", "IEA 10 MW", "iea10mw.htc", stability=True)
IEA22 = Hawc2Model("iea22", "IEA 22 MW", "iea_22mw_rwt_steps.htc", full=True)
MODELS = (
    DTU10,
    Hawc2Model("dtu10 stiff", "DTU 10 MW with stiff blades", "DTU_10MW_RWT.htc", stiff=True),
    Hawc2Model("iea15", "IEA 15 MW", "IEA_15MW_RWT_Onshore.htc", stability=True),
    IEA22,
)


UNITS = {"power": "W", "thrust": "N"}


def studies(folder: Path) -> tuple[CheckStudy, ...]:
    """The comparisons for the models that are somewhere in a folder, and for the IEA 10 MW of the library.

    Raises:
      InputError: the folder has none of them.
    """
    main_files = {m.main: next(iter(sorted(folder.rglob(m.main))), None) for m in MODELS}
    comparisons = [CheckStudy(10.0, iea10mw)]
    for model in MODELS:
        if (path := main_files[model.main]) is not None:
            comparisons.append(CheckStudy(15.0, partial(steady, model, path)))
    if (path := main_files[IEA22.main]) is not None:
        comparisons.append(CheckStudy(15.0, partial(with_their_torsion, path)))
    if (path := main_files[DTU10.main]) is not None:
        comparisons.append(CheckStudy(5.0, partial(frequencies, path)))
    if len(comparisons) == 1:
        raise InputError(f"--hawc2 {folder}: none of the main files {', '.join(main_files)} in it")
    return tuple(comparisons)


def iea10mw() -> CheckTable:
    """The IEA 10 MW of the library."""
    entry = library_entries()[IEA10.key + "mw"]
    assert entry.hawc2 is not None
    return steady(IEA10, DATA / entry.hawc2, _turbine(IEA10.key + "mw"))


def _turbine(source: Path | str) -> Turbine:
    turbine = load_turbine(source)
    assert isinstance(turbine, Turbine)
    return turbine


def steady(model: Hawc2Model, path: Path, turbine: Turbine | None = None) -> CheckTable:
    """Power, thrust and torsion of the tip over the wind speed.

    Args:
      model: HAWC2 model.
      path: main file of the model.
      turbine: turbine of the library that was read from it, instead.
    """
    turbine = _turbine(path) if turbine is None else turbine
    locked = (*FIXED, "blades") if model.stiff else FIXED
    plain = rotor_of(turbine, locked)
    theirs = plain
    if not model.stiff:
        blade = blade_of(path)
        moved = with_turned_centres(turbine, blade) if model.full else turbine
        theirs = rotor_of(with_elements(moved, blade_nodes(blade)), locked, **(MODES if model.full else {}))
    rows: list[Check] = []
    for r in reference_table("hawc2_steady", turbine=model.key):
        beside_point = point_of_row(theirs, r)
        ours, other = _loads(point_of_row(plain, r)), _loads(beside_point)
        if model.stability:
            other["power"] += _power_of_tilt(theirs, beside_point)
        for what, unit in UNITS.items():
            reference = 1e3 * float(r[what])
            beside = None if model.stiff else 100.0 * (other[what] / reference - 1.0)
            rows.append(relative(what, _case(r), unit, reference, ours[what], BAND, beside=beside))
        if r["torsion"]:
            reference = float(np.radians(float(r["torsion"])))
            besides = float(np.degrees(other["torsion"] - reference))
            rows.append(angle("tip torsion", _case(r), reference, ours["torsion"], TORSION, beside=besides))
    title = f"{model.title} at HAWC2's speed and pitch"
    return CheckTable(f"hawc2 {model.key}", title, _source(model.key), rows, model.beside)


def with_their_torsion(path: Path) -> CheckTable:
    """The IEA 22 MW with the torsion of HAWC2's blade in place of ours: the remaining deviation is aerodynamic."""
    turbine = _turbine(path)
    outer, length = turbine.blade.aerodynamics, turbine.blade.length
    rows: list[Check] = []
    for r in reference_table("hawc2_steady", turbine=IEA22.key):
        table = reference_table("hawc2_torsion", wind=r["wind"])
        if not table:
            continue
        place, torsion = np.array([(float(t["place"]), np.radians(float(t["torsion"]))) for t in table]).T
        missing = np.zeros(len(outer.position))
        for _ in range(ITERATIONS):
            # a twist is positive towards feather, torsion nose up
            model = rotor_of(turbine.replace(**{"blade.aerodynamics": outer.replace(twist=outer.twist - missing)}))
            point = point_of_row(model, r)
            z, computed = _torsion(model, point)
            missing = np.interp(outer.position, place * length, torsion) - np.interp(outer.position, z, computed)
        ours = _loads(point)
        for what, unit in UNITS.items():
            rows.append(relative(what, _case(r), unit, 1e3 * float(r[what]), ours[what], BAND))
    title = f"{IEA22.title} at HAWC2's speed and pitch, with the torsion of HAWC2's blade"
    return CheckTable("hawc2 iea22 torsion", title, source_of("hawc2_torsion"), rows)


def _torsion(model: BladedModel, point: OperatingPoint) -> tuple[Float, Float]:
    """(N,) [m] heights of the nodes of blade 1 and (N,) [rad] rotation of their sections about z, nose up."""
    R = np.asarray(_evaluated(model, point).view("motion")["orientation"])[:, 0].reshape(3, 3, -1)
    z: Float = model.rotor.blade_layout.position
    return z, np.arctan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1])


def _power_of_tilt(model: BladedModel, point: OperatingPoint) -> float:
    """[W] more power if lift is normal to the flow at three quarters of the chord, half a chord behind (A-31)."""
    case = _evaluated(model, point)
    flow, node = case.view("flow"), View(AeroNode, case["aero_nodes"])
    tilt = 0.5 * flow["rotation"] * node["chord"] / flow["speed"]
    lift = 0.5 * model.environment.density * flow["speed"] ** 2 * node["chord"] * flow["lift"]
    return float(np.sum(node["length"] * flow["radius"] * lift * tilt)) * point.rotor_speed


def _evaluated(model: BladedModel, point: OperatingPoint) -> Case:
    case = Case(model, point.wind)
    point.put(case)
    case.evaluate(0.0)
    return case


def _loads(point: OperatingPoint) -> dict[str, float]:
    """Power [W], thrust [N] and torsion of the tip [rad]."""
    return {
        "power": point["rotor_aero_torque"] * point.rotor_speed,
        "thrust": point["rotor_aero_thrust"],
        "torsion": point["tip_twist_1"],
    }


def point_of_row(model: BladedModel, r: dict[str, str]) -> OperatingPoint:
    """Steady operation at wind speed [m/s], rotor speed [rpm] and pitch [deg] of a row of a reference table."""
    speed, pitch = float(r["rotor_speed"]) * np.pi / 30.0, float(np.radians(float(r["pitch"])))
    return operating_point(model, float(r["wind"]), rotor_speed=speed, pitch=pitch)


def _case(r: dict[str, str]) -> str:
    return f"{float(r['wind']):g} m/s"


def _source(key: str) -> str:
    part = next(part for part in source_of("hawc2_steady").split("; ") if part.startswith(key.split()[0]))
    return part.partition(", ")[2]


def rotor_of(turbine: Turbine, locked: tuple[str, ...] = FIXED, **more: Any) -> BladedModel:
    """The turbine without tilt and gravity, in undisturbed wind, with HAWC2's balance of momentum."""
    options = ModelOptions(
        hub_loss=False,
        axial_drag=True,
        tangential_drag=True,
        tower_influence="none",
        locked=locked,
        blade_nodes=NODES,
        advanced=AdvancedOptions(high_induction="madsen"),
        **more,
    )
    return build(turbine.replace(**{"nacelle.tilt": 0.0}), options, Environment(gravity=0.0))


def blade_of(path: Path) -> Body:
    """Blade 1 of a main file."""
    root = read_htc(path)
    link = next(c for c in root.block("aero").all("link") if c.values[0] == "1")
    return read_bodies(root.block("new_htc_structure"), path, link.word(2))[-1]


def blade_nodes(blade: Body) -> Float:
    """(N,) [m] heights of the nodes of a blade above its root."""
    height: Float = blade.nodes[:, 2] - blade.nodes[0, 2]
    return height


def with_turned_centres(turbine: Turbine, blade: Body) -> Turbine:
    """The turbine with the centres of mass where HAWC2 has those of its fully populated sections (S-72)."""
    _, mass, _ = at_elastic_centre(*section_matrices(turned_centres(blade.sections.rows)))
    return turbine.replace(**{"blade.structure.mass_matrix": SECTION @ mass @ SECTION.T})


def with_elements(turbine: Turbine, nodes: Float) -> Turbine:
    """The turbine with the same blade sections from node to node: the mean of those between, as HAWC2's elements.

    Args:
      nodes: (N,) [m] heights of the nodes.
    """
    blade = turbine.blade.structure
    at = blade.position
    nodes = nodes * at[-1] / nodes[-1]
    z = np.ravel(np.column_stack([nodes[:-1] + NODE_GAP, nodes[1:] - NODE_GAP]))
    z[0], z[-1] = 0.0, at[-1]

    def mean(of: Float | None) -> Float:
        assert of is not None
        flat = of.reshape(len(at), -1)
        means = []
        for a, b in pairwise(nodes):
            q = np.unique(np.concatenate([[a, b], at[(at > a) & (at < b)]]))
            values = np.stack([np.interp(q, at, column) for column in flat.T], axis=-1)
            means.append(np.trapezoid(values, q, axis=0) / (b - a))
        result: Float = np.repeat(means, 2, axis=0).reshape(-1, *of.shape[1:])
        return result

    lines = {name: np.interp(z, at, getattr(blade, name)) for name in ("twist", "axis_x", "axis_y")}
    matrices = {name: mean(getattr(blade, name)) for name in ("stiffness_matrix", "mass_matrix")}
    return turbine.replace(**{"blade.structure": blade.replace(position=z, **lines, **matrices)})


def frequencies(path: Path) -> CheckTable:
    """Frequencies of the DTU 10 MW at rest in its parts, clamped, and of the turbine that turns without air."""
    plain = _turbine(path)
    both = (plain, with_elements(plain, blade_nodes(blade_of(path))))
    rows: list[Check] = []
    for of in dict.fromkeys(r["of"] for r in reference_table("hawc2_modes")):
        theirs = [float(r["frequency"]) for r in reference_table("hawc2_modes", of=of)]
        (names, ours), (_, elements) = (_modes(turbine, of) for turbine in both)
        for name, reference, *computed in zip(names, theirs, ours, elements, strict=False):
            what = f"{of}, clamped" if of in CLAMPED else f"turbine, {of} rad/s"
            beside = 100.0 * (computed[1] / reference - 1.0)
            rows.append(relative(what, name, "Hz", reference, computed[0], FREQUENCY, beside=beside))
    title = "DTU 10 MW, natural frequencies against HAWCStab2 (turbine) and HAWC2 (blade, tower)"
    return CheckTable("hawc2 modes", title, source_of("hawc2_modes"), rows, ELEMENTS)


def _modes(turbine: Turbine, of: str) -> tuple[list[str], list[float]]:
    """Names and frequencies [Hz], in their order, of a clamped member, or of the turbine at a rotor speed [rad/s]."""
    if of in CLAMPED:
        return clamped_frequencies(turbine, of, CLAMPED[of], NODES + 1)
    model = rotor_of(turbine, ("yaw",), tower_torsion_modes=1)
    modes = natural_modes(model, float(of), generator_free=True)
    return [mode.name for mode in modes], [mode.frequency / (2.0 * np.pi) for mode in modes]


def clamped_frequencies(
    turbine: Turbine, member: str, counts: dict[str, int], stations: int
) -> tuple[list[str], list[float]]:
    """Names and frequencies [Hz], in their order, of the modes of an isolated blade or tower, clamped at its root.

    Args:
      turbine: the turbine with the member.
      member: ``"blade"`` or ``"tower"``.
      counts: number of modes by direction.
      stations: number of stations along the member.
    """
    if member == "blade":
        layout = cells(np.linspace(0.0, turbine.blade.length, stations))
        clamped = blade_member(turbine.blade.structure, counts, layout)
    else:
        layout = points(np.linspace(0.0, turbine.tower.length, stations))
        clamped = tower_member(turbine.tower, counts, np.zeros((6, 6)), None, layout)
    order = np.argsort(clamped.modes.frequency)
    return [clamped.names[k] for k in order], (clamped.modes.frequency[order] / (2.0 * np.pi)).tolist()
