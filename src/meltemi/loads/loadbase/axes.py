"""Axes of the interfaces of a load base, as a table and a sketch of each (``docs/conventions.md``)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from meltemi.loads.loadbase.interfaces import Interface, interfaces_of, known_channels, stations
from meltemi.loads.loadbase.ultimate import blade_groups
from meltemi.reports.blocks import Beside, Block, Cell, Drawing, Stroke, Subsection, Table
from meltemi.reports.turbine_facts import number
from meltemi.simulation.channels import find
from meltemi.turbine.definition import Turbine

Point = tuple[float, float]
LENGTH = 15.0
"""Length of an axis in a sketch."""
TOP, RADIUS = 58.0, 36.0
"""Height of the tower and radius of the rotor in a sketch."""
TILT, CONE = math.radians(8.0), math.radians(5.0)
"""Angles in a sketch, larger than those of most turbines."""
TURNED = math.radians(35.0)
"""Azimuth of blade 1 in sketches of rotating axes."""
APEX: Point = (34.0, TOP + 6.0)
LOW, HIGH = -9.0, 114.0
"""Lower and upper edge of a sketch."""


@dataclass(frozen=True)
class Axes:
    """Axes of an interface in words: origin, name, positive directions, and whether they turn with the rotor."""

    origin: str
    name: str
    x: str
    y: str
    z: str
    turning: bool = False


def axes_of(name: str, turbine: Turbine) -> Axes:
    """Axes of an interface, by its name without the number of the blade."""
    blades, towers = stations(turbine)
    part = int(name.rpartition("_")[2]) if name[-1].isdigit() else 0
    downwind, left = "downwind", "to the left looking downwind"
    if name == "blade_root":
        edge = "in plane, towards the trailing edge at zero pitch"
        return Axes("blade root", "coned blade (c), not pitching", "out of plane, downwind", edge, "root to tip", True)
    if name.startswith("blade_station"):
        where = f"blade axis, {number(blades[part - 1])} m from the root"
        return Axes(where, "pitched blade (b)", "flapwise", "edgewise, towards the trailing edge", "root to tip", True)
    if name == "hub_fixed":
        return Axes(
            "rotor apex", "shaft (s), not rotating", "along the shaft, downwind", left, "up, normal to the shaft"
        )
    if name == "hub_rotating":
        along = "along blade 1, normal to the shaft"
        return Axes("rotor apex", "shaft, rotating (a)", "along the shaft, downwind", "completes x and z", along, True)
    if name == "yaw_bearing":
        return Axes("tower top", "tower top (p), not yawing", downwind, left, "up, along the tower")
    if name.startswith("tower_station"):
        where = f"tower axis, {number(towers[part - 1])} m above the tower base"
        return Axes(where, "inertial", downwind, left, "up")
    if name.startswith("pile_station"):
        assert turbine.support is not None
        where = f"pile axis, {number(turbine.support.load_stations[part - 1])} m above mean sea level"
        return Axes(where, "inertial", downwind, left, "up")
    if name == "mudline":
        where = "tower axis" if turbine.support is None else "pile axis"
        return Axes(f"{where} at the mudline", "inertial; reaction of the ground", downwind, left, "up")
    return Axes("tower base", "tower base (t)", downwind, left, "up")


def axes_blocks(turbine: Turbine) -> list[Block]:
    """Table of the axes of all interfaces, and their sketches."""
    groups = blade_groups(interfaces_of(turbine))
    rows: list[list[Cell]] = []
    sketches: list[Block] = []
    for name, members in groups.items():
        a, title = axes_of(name, turbine), name.replace("_", " ")
        rows.append([title, a.origin, a.name, a.x, a.y, a.z, _aliases(members[0], turbine)])
        sketches.append(Subsection(title, [Beside(sketches_of(name, a))]))
    words = (
        "Loads are those that the outboard part exerts on the inboard part: the rotor on the shaft, the nacelle on "
        "the tower, the tower on the foundation; at the mudline those of the ground on pile or frame. Axes are "
        "right-handed; moments are positive about them by the right-hand rule. The rotor turns clockwise looking "
        "downwind. In the sketches ⊗ is an axis into the picture; tilt and cone are drawn larger than they are, pitch "
        "is zero. F_res and M_res are the resultants of x and y, at the hub of y and z."
    )
    head = ["interface", "origin", "axes", "x", "y", "z", "OpenFAST: Fx, Fy, Fz, Mx, My, Mz"]
    return [words, Table(head, rows, caption="Axes of the interfaces", text_columns=7), Beside(sketches)]


def _aliases(interface: Interface, turbine: Turbine) -> str:
    known = known_channels(turbine.n_blades)
    return ", ".join(find(channel, known).alias for channel in interface.channels)


def sketches_of(name: str, axes: Axes) -> list[Drawing]:
    """Side view, the wind from the left, and front view, looking downwind."""
    blade, shaft = name.startswith("blade"), name.startswith("hub")
    tilt = TILT - CONE if blade else TILT if shaft else 0.0
    turned = TURNED if name == "hub_rotating" else 0.0
    part = 0.0 if not blade else 0.08 if name == "blade_root" else 0.25 * int(name[-1])
    height = TOP if name == "yaw_bearing" else 0.5 * TOP if name.startswith("tower_station") else 0.0
    at_side = _along(APEX, tilt, part * RADIUS) if blade or shaft else (50.0, height)
    at_front = (50.0, APEX[1] + part * RADIUS) if blade or shaft else (50.0, height)
    downwind, up = (math.cos(tilt), -math.sin(tilt)), (math.sin(tilt), math.cos(tilt))
    left, along = (-math.cos(turned), math.sin(turned)), (math.sin(turned), math.cos(turned))
    side = [*_side(), *_axes(at_side, {"x": downwind, "z": up}, "y")]
    front = [*_front(turned), *_axes(at_front, {"y": left, "z": along}, "x")]
    title, whose = name.replace("_", " "), ", blade 1 up" if axes.turning else ""
    return [
        Drawing(f"{title}, side view", side, LOW, HIGH, f"side view{whose}"),
        Drawing(f"{title}, looking downwind", front, LOW, HIGH, "looking downwind"),
    ]


def _along(start: Point, angle: float, length: float) -> Point:
    """End of a line that leans to the right by an angle."""
    return start[0] + length * math.sin(angle), start[1] + length * math.cos(angle)


def _axes(at: Point, directions: dict[str, Point], entering: str) -> list[Stroke]:
    ends = {name: (at[0] + LENGTH * u, at[1] + LENGTH * v) for name, (u, v) in directions.items()}
    return [*(Stroke([at, end], "axis", name) for name, end in ends.items()), Stroke([at], "into", entering)]


def _side() -> list[Stroke]:
    rear, low, high = 64.0, TOP, TOP + 7.0
    nacelle = [(APEX[0] + 2.0, low + 3.0), (rear, low), (rear, high), (APEX[0] + 2.0, high + 3.0)]
    blades = [Stroke([APEX, _along(APEX, TILT - CONE, RADIUS)]), Stroke([APEX, _along(APEX, TILT + CONE, -RADIUS)])]
    return [*_ground_and_tower(), Stroke(nacelle, "body"), *blades, Stroke([(3.0, 84.0), (15.0, 84.0)], "wind", "")]


def _front(turned: float) -> list[Stroke]:
    hub = (50.0, APEX[1])
    tips = [_along(hub, turned + 2.0 * math.pi * b / 3.0, RADIUS) for b in range(3)]  # clockwise looking downwind
    return [*_ground_and_tower(), *(Stroke([hub, tip]) for tip in tips)]


def _ground_and_tower() -> list[Stroke]:
    tower = [(46.5, 0.0), (53.5, 0.0), (52.0, TOP), (48.0, TOP)]
    return [Stroke([(0.0, 0.0), (100.0, 0.0)], "thin"), Stroke(tower, "body")]
