"""Scene of a run: the motion is rebuilt from the recorded coordinates with the kinematics of the blades."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.scene.air import CrossSection, wind_section
from meltemi.scene.record import Scene, track_arrays
from meltemi.scene.shape import beam_axis, blade_skin, machine, sections
from meltemi.scene.vortices import FramedLoop, VortexFrames
from meltemi.simulation.bladed.rotor import BladedModel, with_blades
from meltemi.simulation.case import Case
from meltemi.simulation.loop import Loop
from meltemi.simulation.model import Model, Stations
from meltemi.structure.blades import blade_motion
from meltemi.wind.fields import SteadyWind, Wind

Float = NDArray[np.float64]

RATE, LOAD_RATE, AIR_RATE, WIND_RATE = 20.0, 10.0, 5.0, 2.0
"""[Hz] largest rates of motion, section loads, distributed loads and wind."""
POSITION_ERROR, LOAD_ERROR = 2e-4, 0.03
"""Largest errors: of a drawn position over the rotor radius, of loads over their largest value."""
WIND_POINTS, WIND_SIZE = 9, 1.15
"""Points of the drawn wind along each side, and its half width over the rotor radius."""
BLADE_CUTS, TOWER_CUTS = 9, 6
"""Stations of section loads that colour blades and tower."""


def cuts(model: BladedModel) -> Stations:
    """Stations of section loads along blades and tower."""
    blade, tower = model.turbine.blade.length, model.turbine.tower.length
    along = np.linspace(0.0, 1.0, BLADE_CUTS + 1)[:-1]
    up = np.linspace(0.0, 1.0, TOWER_CUTS + 1)[1:]
    return Stations(tuple(blade * along), tuple(tower * up))


class Recorder:
    """Records what a scene needs, as further columns of a run's output.

    Args:
      model: model of a turbine with blades.
      stations: stations of section loads of the run.

    Raises:
      InputError: the model is a power-coefficient turbine.
    """

    def __init__(self, model: Model[Any], stations: Stations) -> None:
        self.model, added = with_blades(model, "view"), cuts(with_blades(model, "view"))
        self.requested, self.cuts = stations, added
        self.stations = Stations((*stations.blade, *added.blade), (*stations.tower, *added.tower))

    def places(self, case: Case) -> NDArray[np.int64]:
        """Indices of the recorded signals of a case; remembers their order."""
        B, N = case["motion"].shape[1:]
        blades, nodes = range(B), range(N)
        first, low = len(self.requested.blade), len(self.requested.tower)
        span = range(first, first + len(self.cuts.blade))
        up = (0, *range(1 + low, 1 + low + len(self.cuts.tower)))
        wanted: dict[str, list[tuple[str, str | None, tuple[int, ...]]]] = {
            "q": [("q", None, (i,)) for i in range(len(self.model.coordinates))],
            "pitch": [("pitch", "angle", (b,)) for b in blades],
            "top": [
                (f, f"top_{name}_{x}", ())
                for f, name in (("machine", "position"), ("chain", "rotation"))
                for x in "xyz"
            ],
            "tip": [
                ("root", f"{name}_{x}", (b,)) for b in blades for name in ("pitched_tip", "tip_rotation") for x in "xyz"
            ],
            "air": [
                ("flow", name, (b, n)) for b in blades for n in nodes for name in ("normal_force", "driving_force")
            ],
            "bending": [("station", f"moment_{x}", (b, i)) for b in blades for i in span for x in "xy"],
            "tower_bending": [("tower_station", f"moment_{x}", (i,)) for i in up for x in "xy"],
        }
        places, at = [], 0
        self.columns: dict[str, slice] = {}
        for name, entries in wanted.items():
            for array, row, index in entries:
                place = index if row is None else (case.view(array).table.index(row), *index)
                places.append(case.signals.place(array, place))
            self.columns[name] = slice(at, len(places))
            at = len(places)
        return np.array(places, dtype=np.int64)

    def framed(self, loop: Loop, case: Case, dt: float) -> Loop:
        """The time loop of a run, which takes frames of the vortices if there are any."""
        self.vortices, self.dt = VortexFrames.of(self.model.turbine, dt), dt
        lines = next((part for part in case.parts if hasattr(part, "vortex_lines")), None)
        return loop if lines is None else FramedLoop(**vars(loop), case=case, frames=self.vortices, lines=lines)

    def scene(self, data: Float, time: Float, wind: Wind) -> Scene | None:
        """The scene of a run; None of one that has no samples.

        Args:
          data: (T, n) values of the signals of :meth:`places`.
          time: (T,) [s] instants of the samples.
          wind: wind of the run.
        """
        good = np.isfinite(data).all(axis=1)
        if not good.any():
            return None
        about, arrays = self.moving(data[good], time[good])
        still, constant = self.still
        begin, end = about["begin"], about["begin"] + about["duration"]
        about["wind"], air = wind_section(wind, self.section, begin, end, WIND_RATE)
        about["steps"]["wind"] = 1.0 / WIND_RATE
        wake, vortices = self.vortices.track(self.dt, begin, end)
        return Scene(still | about | wake, constant | arrays | air | vortices)

    @cached_property
    def section(self) -> CrossSection:
        """The drawn section of the wind."""
        turbine = self.model.turbine
        size = WIND_SIZE * turbine.rotor_radius
        return CrossSection(turbine.hub_height, size, size, WIND_POINTS, turbine.rotor_diameter)

    @cached_property
    def still(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Constants and arrays of a scene that do not depend on time."""
        turbine, s = self.model.turbine, self._sections
        about: dict[str, Any] = {
            "kind": "run",
            "turbine": machine(turbine),
            "sections": [round(float(v), 3) for v in s],
            "air_position": [round(float(v), 3) for v in self.model.rotor.blade_layout.position],
            "cuts": [round(float(v), 3) for v in self.cuts.blade],
            "tower_cuts": [0.0, *(round(float(v), 3) for v in self.cuts.tower)],
        }
        shape = self.model.rotor.tower.modes.at(np.array(about["turbine"]["tower_height"]))
        return about, {"tower_shape": shape.astype(np.float32)} | blade_arrays(self.model, s)

    @cached_property
    def _sections(self) -> Float:
        return sections(self.model.turbine.blade.length)

    @cached_property
    def _case(self) -> Case:
        return Case(self.model, SteadyWind(speed=0.0))

    def moving(self, data: Float, time: Float) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Time and tracks of a scene; the arguments are those of :meth:`scene`, finite and with a sample at least."""
        step = float(time[1] - time[0]) if len(time) > 1 else 1.0 / RATE
        steps, arrays = {}, {}

        def every(rate: float) -> slice:
            return slice(None, None, max(1, round(1.0 / (rate * step) - 1e-6)))

        def part(name: str, *shape: int, rate: float = RATE) -> Float:
            chosen = data[every(rate), self.columns[name]]
            return chosen.reshape(len(chosen), *shape)

        turbine, B, rows = self.model.turbine, self.model.n_blades, self.model.rows
        q = part("q", len(self.model.coordinates))
        tower_modes = len(self.model.rotor.tower.names)
        steps["motion"] = step * every(RATE).step
        azimuth = q[:, rows.generator] + q[:, rows.torsion]
        whole_turns = 2.0 * np.pi * np.floor(azimuth[0] / (2.0 * np.pi))  # 32 bits lose precision in long runs
        arrays["azimuth"] = (azimuth - whole_turns).astype(np.float32)
        arrays |= track_arrays("body", np.hstack([part("top", 6), q[:, rows.yaw, None], part("pitch", B)]))
        arrays |= track_arrays("tower", q[:, :tower_modes])
        moved = deformed(self._case, q, part("tip", B, 6), self._sections)
        chord = float(np.max(turbine.blade.aerodynamics.chord))
        weight = np.array([1.0, 1.0, 1.0, chord, chord, chord])
        arrays |= track_arrays("blade", moved, POSITION_ERROR * turbine.rotor_radius, weight)
        largest = {}
        for name, series, points, rate in (
            ("air", B, self.model.rotor.n_nodes, AIR_RATE),
            ("bending", B, BLADE_CUTS, LOAD_RATE),
            ("tower_bending", 1, TOWER_CUTS + 1, LOAD_RATE),
        ):
            values = part(name, series, points, 2, rate=rate)
            largest[name] = float(np.abs(values).max())
            arrays |= track_arrays(name, values, LOAD_ERROR * max(largest[name], 1e-9))
            steps[name] = step * every(rate).step
        about = {
            "begin": float(time[0]),
            "duration": float(time[-1] - time[0]),
            "steps": steps,
            "largest": largest,
            "accuracy": float(np.abs(Scene({}, arrays).track("blade")[..., :3] - moved[..., :3]).max()),
        }
        return about, arrays


def deformed(case: Case, q: Float, tip: Float | None, s: Float) -> Float:
    """(T, B, S, 6) displacement [m] of the blade sections and their rotation vector [rad], blade axes.

    Args:
      case: a case of the model, whose coordinates and motion are overwritten.
      q: (T, n) coordinates.
      tip: (T, B, 6) displacement and rotation of the tips; without it they are extrapolated.
      s: (S,) [m] sections from the blade root.
    """
    from scipy.interpolate import CubicSpline
    from scipy.spatial.transform import Rotation

    model, (B, N) = case.model, case["motion"].shape[1:]
    position, orientation = (case.view("motion").rows(name) for name in ("position", "orientation"))
    nodes = np.zeros((len(q), B, N + 1 + (tip is not None), 6), dtype=np.float32)
    matrices = np.empty((len(q), 9, B, N))
    case["q"][:] = 0.0
    blade_motion(case.system)
    rest = case["motion"][position].copy()
    for i, row in enumerate(q):
        case["q"][:] = row
        blade_motion(case.system)
        nodes[i, :, 1 : N + 1, :3] = np.moveaxis(case["motion"][position] - rest, 0, -1)
        matrices[i] = case["motion"][orientation]
    turned = Rotation.from_matrix(np.moveaxis(matrices, 1, -1).reshape(-1, 3, 3)).as_rotvec()
    nodes[:, :, 1 : N + 1, 3:] = turned.reshape(len(q), B, N, 3)
    z = np.concatenate([[0.0], model.rotor.blade_layout.position, [model.turbine.blade.length]])
    if tip is not None:
        nodes[:, :, -1] = tip
    between = CubicSpline(z[: nodes.shape[2]], np.eye(nodes.shape[2]))(s)  # (S, nodes)
    nodes_at: Float = np.einsum("sn,tbnk->tbsk", between.astype(np.float32), nodes, optimize=True)
    return nodes_at


def blade_arrays(model: BladedModel, s: Float) -> dict[str, NDArray[Any]]:
    """Undeformed beam axis (S, 3) from the rotor apex and skin (S, P, 3) about it [m], blade axes."""
    turbine, blade = model.turbine, model.rotor.blade
    return {
        "axis": beam_axis(blade, s, turbine.hub.radius).astype(np.float32),
        "skin": blade_skin(turbine, blade, s).astype(np.float32),
    }
