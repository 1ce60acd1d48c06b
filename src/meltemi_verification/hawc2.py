"""Models of HAWC2, imported, against what HAWC2 and HAWCStab2 themselves have: steady operation and frequencies.

At their rotor speed and pitch, without tilt and gravity, with HAWC2's balance of momentum. Beside each deviation stands
that with HAWC2's elements, which have constant sections: the mean of those between two nodes. Imported blades have
sections linear between the stations.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.environment.site import Environment
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.modes import natural_modes
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.simulation.trim import operating_point
from meltemi.structure.members import blade_member, cells, points, tower_member
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import DATA, library_entries, load_turbine
from meltemi_exchange.hawc2.bodies import read_bodies
from meltemi_exchange.hawc2.htc import read_htc
from meltemi_verification.table import Comparison, Row, Study, angle, reference_table, relative, source_of

Float = NDArray[np.float64]

BAND, TORSION, FREQUENCY = 1.5, 0.2, 1.0
"""[%] of power and thrust, [deg] of the tip's torsion, [%] of frequencies."""
FIXED = ("tower", "yaw", "drivetrain", "generator")
NODES = 40
"""Nodes along a blade: with 80, steady power and thrust change by less than 0.05 %."""
JUST = 2e-5
"""[m] between the sections on both sides of a node."""


@dataclass(frozen=True)
class Model:
    """A model of HAWC2.

    Attributes:
      key: of the reference data.
      title: in words.
      main: name of its main file.
      stiff: whether the blades are stiff in the reference.
    """

    key: str
    title: str
    main: str
    stiff: bool = False


DTU10 = Model("dtu10", "DTU 10 MW", "DTU_10MW_RWT.htc")
MODELS = (
    DTU10,
    Model("dtu10 stiff", "DTU 10 MW with stiff blades", "DTU_10MW_RWT.htc", stiff=True),
    Model("iea15", "IEA 15 MW", "IEA_15MW_RWT_Onshore.htc"),
    Model("iea22", "IEA 22 MW", "iea_22mw_rwt_steps.htc"),
)


def studies(folder: Path) -> tuple[Study, ...]:
    """The comparisons for the models that are somewhere in a folder, and for the IEA 10 MW of the library.

    Raises:
      InputError: the folder has none of them.
    """
    found = {m.main: next(iter(sorted(folder.rglob(m.main))), None) for m in MODELS}
    made = [Study(10.0, iea10mw)]
    for model in MODELS:
        if (path := found[model.main]) is not None:
            made.append(Study(10.0, lambda model=model, path=path: steady(model, path)))  # type: ignore[misc]
    if (path := found[DTU10.main]) is not None:
        made.append(Study(10.0, lambda: frequencies(path)))
    if len(made) == 1:
        raise InputError(f"--hawc2 {folder}: none of the main files {', '.join(found)} in it")
    return tuple(made)


def iea10mw() -> Comparison:
    """The IEA 10 MW of the library."""
    entry = library_entries()["iea10mw"]
    assert entry.hawc2 is not None
    return steady(Model("iea10", "IEA 10 MW", "iea10mw.htc"), DATA / entry.hawc2, load_turbine("iea10mw"))


def steady(model: Model, path: Path, turbine: Turbine | None = None) -> Comparison:
    """Power, thrust and torsion of the tip over the wind speed.

    Args:
      path: its main file.
      turbine: what was read from it.
    """
    turbine = load_turbine(path) if turbine is None else turbine  # type: ignore[assignment]
    assert isinstance(turbine, Turbine)
    locked = (*FIXED, "blades") if model.stiff else FIXED
    variants = [rotor_of(turbine, locked)]
    if not model.stiff:
        variants.append(rotor_of(with_elements(turbine, blade_nodes(path)), locked))
    rows: list[Row] = []
    for r in reference_table("hawc2_steady", turbine=model.key):
        wind, case = float(r["wind"]), f"{float(r['wind']):g} m/s"
        speed, pitch = float(r["rotor_speed"]) * np.pi / 30.0, float(np.radians(float(r["pitch"])))
        power, thrust = 1e3 * float(r["power"]), 1e3 * float(r["thrust"])
        found = [operating_point(m, wind, rotor_speed=speed, pitch=pitch) for m in variants]
        pairs = [
            relative("power", case, "W", power, found[0]["rotor_aero_torque"] * speed, BAND),
            relative("thrust", case, "N", thrust, found[0]["rotor_aero_thrust"], BAND),
        ]
        besides = [
            relative("power", case, "W", power, found[-1]["rotor_aero_torque"] * speed),
            relative("thrust", case, "N", thrust, found[-1]["rotor_aero_thrust"]),
        ]
        if r["torsion"]:
            torsion = float(np.radians(float(r["torsion"])))
            pairs.append(angle("tip torsion", case, torsion, found[0]["tip_twist_1"], TORSION))
            besides.append(angle("tip torsion", case, torsion, found[-1]["tip_twist_1"], None))
        rows += [_beside(*both) for both in zip(pairs, besides, strict=True)]
    title = f"{model.title} at HAWC2's speed and pitch"
    return Comparison(f"hawc2 {model.key}", title, _source(model.key), rows, "" if model.stiff else BESIDE)


BESIDE = "HAWC2's elements"


def _beside(row: Row, other: Row) -> Row:
    return Row(**{**{k: getattr(row, k) for k in row.__dataclass_fields__}, "beside": other.deviation})


def _source(key: str) -> str:
    return next(part for part in source_of("hawc2_steady").split("; ") if part.startswith(key.split()[0]))


def rotor_of(turbine: Turbine, locked: tuple[str, ...] = FIXED, **more: Any) -> BladedModel:
    """The turbine without tilt and gravity, in undisturbed wind, with HAWC2's balance of momentum."""
    options = ModelOptions(
        hub_loss=False,
        axial_drag=True,
        tangential_drag=True,
        tower_influence="none",
        locked=locked,
        blade_nodes=NODES,
        advanced={"high_induction": "madsen"},
        **more,
    )
    return build(turbine.replace(**{"nacelle.tilt": 0.0}), options, Environment(gravity=0.0))


def blade_nodes(path: Path) -> Float:
    """(N,) [m] heights of the nodes of blade 1 above its root, from the main file."""
    root = read_htc(path)
    link = next(c for c in root.block("aero").all("link") if c.values[0] == "1")
    nodes = read_bodies(root.block("new_htc_structure"), path, link.word(2))[-1].nodes
    height: Float = nodes[:, 2] - nodes[0, 2]
    return height


def with_elements(turbine: Turbine, nodes: Float) -> Turbine:
    """The turbine with the same blade sections from node to node: the mean of those between, as HAWC2's elements.

    Args:
      nodes: (N,) [m] heights of the nodes.
    """
    blade = turbine.blade.structure
    at = blade.position
    nodes = nodes * at[-1] / nodes[-1]
    z = np.ravel(np.column_stack([nodes[:-1] + JUST, nodes[1:] - JUST]))
    z[0], z[-1] = 0.0, at[-1]

    def mean(of: Float | None) -> Float:
        assert of is not None
        flat = of.reshape(len(at), -1)
        means = []
        for a, b in zip(nodes[:-1], nodes[1:], strict=True):
            q = np.unique(np.concatenate([[a, b], at[(at > a) & (at < b)]]))
            values = np.stack([np.interp(q, at, column) for column in flat.T], axis=-1)
            means.append(np.trapezoid(values, q, axis=0) / (b - a))
        result: Float = np.repeat(means, 2, axis=0).reshape(-1, *of.shape[1:])
        return result

    lines = {name: np.interp(z, at, getattr(blade, name)) for name in ("twist", "axis_x", "axis_y")}
    matrices = {name: mean(getattr(blade, name)) for name in ("stiffness_matrix", "mass_matrix")}
    return turbine.replace(**{"blade.structure": blade.replace(position=z, **lines, **matrices)})


def frequencies(path: Path) -> Comparison:
    """Frequencies of the DTU 10 MW at rest in its parts, clamped, and of the turbine that turns without air."""
    plain = load_turbine(path)
    assert isinstance(plain, Turbine)
    both = (plain, with_elements(plain, blade_nodes(path)))
    rows: list[Row] = []
    for of in dict.fromkeys(r["of"] for r in reference_table("hawc2_modes")):
        theirs = [float(r["frequency"]) for r in reference_table("hawc2_modes", of=of)]
        (names, ours), (_, elements) = (_modes(turbine, of) for turbine in both)
        for name, reference, *found in zip(names, theirs, ours, elements, strict=False):
            what = f"{of}, clamped" if of in ("blade", "tower") else f"turbine, {of} rad/s"
            beside = 100.0 * (found[1] / reference - 1.0)
            rows.append(relative(what, name, "Hz", reference, found[0], FREQUENCY, beside=beside))
    title = "DTU 10 MW, natural frequencies against HAWCStab2 (turbine) and HAWC2 (blade, tower)"
    return Comparison("hawc2 modes", title, source_of("hawc2_modes"), rows, BESIDE)


def _modes(turbine: Turbine, of: str) -> tuple[list[str], list[float]]:
    """Names and frequencies [Hz], in their order, of a clamped member, or of the turbine at a rotor speed [rad/s]."""
    if of == "blade":
        layout = cells(np.linspace(0.0, turbine.blade.length, NODES + 1))
        member = blade_member(turbine.blade.structure, {"flap": 3, "edge": 2, "torsion": 1}, layout)
    elif of == "tower":
        layout = points(np.linspace(0.0, turbine.tower.length, NODES + 1))
        counts = {"fore_aft": 2, "side_side": 2, "torsion": 0}
        member = tower_member(turbine.tower, counts, np.zeros((6, 6)), None, layout)
    else:
        model = rotor_of(turbine, ("yaw",), tower_torsion_modes=1)
        modes = natural_modes(model, float(of), generator_free=True)
        return [mode.name for mode in modes], [mode.frequency / (2.0 * np.pi) for mode in modes]
    order = np.argsort(member.modes.frequency)
    return [member.names[k] for k in order], (member.modes.frequency[order] / (2.0 * np.pi)).tolist()
