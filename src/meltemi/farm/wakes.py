"""Wakes of a running farm: their arrays, and their update at each exchange with the turbines.

The coupling is explicit: between exchanges the turbines are exposed to planes that drift with constant velocities, and
the wakes receive the mean state of the rotors since the last exchange. Turbines and wakes can thus be advanced in
parallel.

Reference: docs/theory/wakes.md (K-1 to K-9).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import View
from meltemi.farm.averages import (
    ALONG,
    AMBIENT,
    DISTURBED,
    drift,
    horizontal,
    longest,
    observe,
    rotor_mean,
    rotor_wind,
)
from meltemi.farm.curled import Curled
from meltemi.farm.eddies import EDDY_SPACING, eddies_of
from meltemi.farm.field import LARGEST, LINEAR, QUADRATIC, PlaneField, Planes, VisiblePlanes, WakeField, WakePart, Wakes
from meltemi.farm.march import Mixing, march, totals
from meltemi.farm.quick import quick
from meltemi.farm.release import Released, load_coefficients, release, within
from meltemi.farm.sets import FINE_RINGS, WakeSet, average_points, by_angle, quadrature_error
from meltemi.farm.settings import WakeSettings
from meltemi.maths.vectors import Vec, dot
from meltemi.wind.fields import SteadyWind, Wind, wind_arrays

Float = NDArray[np.float64]
Together = Callable[[Callable[[int], Any]], list[Any]]
"""Call of a function for all turbines, on threads."""
RADII = 60
"""Points of a profile."""
ASIDE, WANDERS = 2.0, math.radians(15.0)
"""Limits for downwind turbines that a wake may meet: rotor diameters beside its path, angle to the mean wind."""
BEYOND = 3.0
"""Rotor diameters that a wake extends behind the last of these turbines."""
FURTHEST = 20.0
"""Rotor diameters at which every wake ends."""
SLOWEST = 0.3
"""Lowest drift speed of a wake over the mean wind, which determines the memory for its planes."""
DEVELOPED = 0.6
"""Lowest drift speed over the mean wind while wakes develop before a run."""
SLACK = 15.0
"""[m] deflection of nodes out of the rotor plane, in addition to the drift of planes between exchanges."""
SEEN = 0.6
"""Radius about a rotor within which wakes are evaluated, over its diameter: with deflected blades."""
CELLS = 250
"""Number of cells of a view of the farm along its longer side."""
MEMORY = 60.0
"""[s] time constant of the filtered wind in which rotors operate while wakes develop."""
LEAST_SHARE = 0.3
"""Least wind in which a turbine starts, over the ambient wind."""
LEAST_WIND = 1.0
"""[m/s] least wind of a thrust coefficient: a rotor in calm air leaves no wake."""


def left_of(axis: Float) -> Float:
    """(3, ...) horizontal unit vectors across axes (3, ...), to the left."""
    return np.array([-axis[1], axis[0], 0.0 * axis[0]]) / np.maximum(np.hypot(axis[0], axis[1]), 1e-6)


def mixing_of(model: WakeSet, diameter: float) -> Mixing:
    """Mixing constants of a wake model for a rotor diameter [m]."""
    names = ("ambient", "power", "shear", "gradient", "slowest", "rotor_wide")
    return Mixing.of(radius=0.5 * diameter, **{name: float(getattr(model, name)) for name in names})


@dataclass(frozen=True)
class RotorState:
    """Mean state of a rotor since the last exchange, the input of its wake.

    Attributes:
      hub: (3,) [m] rotor apex, axes of the turbine.
      shaft: (3,) direction of the rotor axis, downwind.
      wind: (3,) [m/s] mean wind over the span of the blades, relative to the hub.
      radius: (n,) [m] radii of the nodes, increasing.
      load: (2, n) [N/m] thrust and driving force of all blades, per length.
      density: [kg/m^3] air density.
    """

    hub: Float
    shaft: Float
    wind: Float
    radius: Float
    load: Float
    density: float

    def coefficients(self, r: Float, radius: float, wind: float) -> Float:
        """(2, R) local load coefficients at equidistant radii [m] from 0, for the wind along the axis [m/s] (K-1)."""
        local = np.empty((2, len(r)))
        speed, spacing = max(wind, LEAST_WIND), float(r[1])
        given = np.ascontiguousarray(self.radius), np.ascontiguousarray(self.load)
        quick(load_coefficients, *given, spacing, radius, self.density, speed, local)
        return local

    def mixed(self, other: RotorState, w: float) -> RotorState:
        """Linear interpolation by w from this state to another one of the same rotor."""
        names = ("hub", "shaft", "wind", "radius", "load")
        return replace(self, **{name: (1.0 - w) * getattr(self, name) + w * getattr(other, name) for name in names})

    @property
    def yaw_error(self) -> float:
        """Angle [rad] from the rotor axis to the wind, counter-clockwise from above."""
        n, u = self.shaft, self.wind
        return math.atan2(n[0] * u[1] - n[1] * u[0], n[0] * u[0] + n[1] * u[1])

    @property
    def skew(self) -> Float:
        """(2,) direction cosines of the wind in the rotor plane, to the left and upwards."""
        (x, y, z), (u, v, w) = self.shaft.tolist(), self.wind.tolist()
        level = max(math.hypot(x, y), 1e-6)
        left, up = (x * v - y * u) / level, (level * w - z * (x * u + y * v) / level)
        return np.array([left, up]) / max(math.hypot(u, v, w), LEAST_WIND)


@dataclass(frozen=True)
class Axisymmetric:
    """Axisymmetric planes: axial and radial velocity [m/s] and factor [-] of added turbulence at equidistant radii.

    Attributes:
      model: set of constants.
      r: [m] equidistant radii.
    """

    model: WakeSet
    r: Float
    part: ClassVar[Any] = WakePart
    field: ClassVar[Any] = WakeField
    planes: ClassVar[Any] = PlaneField
    arrays: ClassVar[dict[str, Any]] = {}
    points: ClassVar[int] = RADII

    @property
    def reach(self) -> float:
        """Largest radius [m]."""
        return float(self.r[-1])

    def inlet(self, state: dict[str, Any], radius: float, wind: float) -> Float:
        """(points, 3) profiles behind a rotor (K-2, K-3)."""
        profile = np.zeros((RADII, 3))
        profile[:, 0] = self.model.inlet(self.r, state["load"][0], radius, wind)
        return profile

    def quadrature_error(self, diameter: float, rings: int) -> Float:
        """Error of averages over points for a profile (K-9a)."""
        average = partial(average_points, self.model, diameter)
        return quadrature_error(average(rings), average(FINE_RINGS), self.r)


class FarmWakes:
    """The wakes of a farm.

    Args:
      settings: set of constants, merging, added turbulence.
      wind: the ambient wind.
      positions: (turbines, 2) [m] positions in the axes of the wind.
      diameters, hubs: [m] rotor diameters and hub heights.
      mean: mean wind.
      step: [s] interval between exchanges.
    """

    def __init__(
        self,
        settings: WakeSettings,
        wind: Wind,
        positions: Float,
        diameters: Sequence[float],
        hubs: Sequence[float],
        mean: SteadyWind,
        step: float,
    ) -> None:
        self.model: WakeSet = settings.constants()
        self.positions, self.diameters, self.hubs, self.step = positions, diameters, hubs, step
        n, largest = len(positions), max(diameters)
        self.reach = _reaches(positions, wind, mean, largest)
        self.spacing = largest / (settings.radial_points or self.model.points)
        self.r = self.spacing * np.arange(RADII, dtype=np.float64)
        self.shape = Curled(self.model, self.r, largest) if self.model.curled else Axisymmetric(self.model, self.r)
        most = math.ceil(float(self.reach.max()) / (SLOWEST * mean.speed * step)) + 4
        shared: dict[str, Any] = {
            "planes": Planes.zeros(wake=n, plane=most),
            "profile": np.zeros((n, most, self.shape.points, 3), dtype=np.float32),
            "longest": np.zeros((2, n)),
            "eddies": eddies_of(settings.seed) if settings.added_turbulence else np.zeros((2, 2, 3, 3), np.float32),
        } | self.shape.arrays
        self.planes, self.profile = View(Planes, shared["planes"]), shared["profile"]
        self.shown = np.zeros_like(self.profile)
        self.count, self.crossed = np.zeros(n, dtype=np.int64), 0
        merging = {"quadratic": QUADRATIC, "linear": LINEAR, "largest": LARGEST}[settings.merging]
        self._parameters = {
            "spacing": self.spacing,
            "reach": self.shape.reach,
            "merging": merging,
            "ceiling": settings.ceiling or math.inf,
            "eddy_spacing": EDDY_SPACING * largest,
            "eddy_speed_x": mean.speed * math.cos(mean.direction),
            "eddy_speed_y": -mean.speed * math.sin(mean.direction),
        }
        self.mean = mean
        added = float(settings.added_turbulence)
        visible = shared | {"profile": self.shown}
        self.parts = [self.shape.part(self._members(visible, x, y, added)) for x, y in positions]
        # small eddies do not advect wakes
        undisturbed = [self._members(shared, 0.0, 0.0, 0.0) for _ in range(n)]
        self.observers = [
            self.shape.field("floats", wind_arrays(wind, hub, diameter) | part.members)
            for hub, diameter, part in zip(hubs, diameters, self.parts, strict=True)
        ]
        self.boxes, self.slack = np.full((n, 2, 2), np.inf), SLACK
        self.near = self.meeting = np.zeros((n, n), dtype=np.int64)
        self.fields, self._reach = list[PlaneField](), list[float]()
        for hub, diameter, members in zip(hubs, diameters, undisturbed, strict=True):
            points = _average_points(self.model, diameter, settings.rings)
            self.fields.append(self.shape.planes("lanes", wind_arrays(wind, hub, diameter) | members | points))
            self._reach.append(float(np.hypot(*points["drift"][:2]).max()))
        self._missed = {d: self.shape.quadrature_error(d, settings.rings) for d in set(diameters)}
        self._averages = (ALONG if self.model.curled else DISTURBED) if self.model.disturbed else AMBIENT
        self.mixing = [mixing_of(self.model, d) for d in diameters]
        self.intensity = settings.intensity
        self.keep = [math.exp(-2.0 * math.pi * step * self.model.cut_off / (0.5 * d)) for d in diameters]
        self._turn = [np.array([self.model.turn, self.model.turn_yaw, self.model.lateral, 0.5 * d]) for d in diameters]
        self._aside = np.array([self.model.aside, self.model.aside_yaw])
        self._filtered = [Released.of() for _ in range(n)]
        self._loads = np.zeros((n, 2, RADII))

    def _members(self, shared: dict[str, Any], x: float, y: float, added: float) -> dict[str, Any]:
        """Arrays of the wakes for an observer with its origin at x and y."""
        wakes = Wakes.of(origin_x=x, origin_y=y, added=added, **self._parameters)
        return shared | {
            "wakes": wakes.array,
            "visible": np.zeros((len(VisiblePlanes), len(self.positions)), dtype=np.int64),
        }

    def along(self) -> list[Float]:
        """(4, planes) filters along each wake: viscosities at its planes, added turbulence a step further."""
        x = [self.planes["travelled"][k, :n] for k, n in enumerate(self.count)]
        way = [self.step * np.abs(self.planes["axial"][k, :n]) for k, n in enumerate(self.count)]
        diameters = np.repeat(self.diameters, self.count)
        before = np.concatenate(x)
        filters = np.zeros((4, len(before)))
        filters[:2] = self.model.filters(before / diameters)
        filters[2:] = self.model.added((before + np.concatenate(way)) / diameters)
        at_rotor, along, end = self.model.added(np.zeros(1)), list[Float](), np.cumsum(self.count)
        for last, n in zip(end, self.count, strict=True):
            each = np.zeros((4, n + 1))
            each[:2, :n], each[2:, :1], each[2:, 1:] = (
                filters[:2, last - n : last],
                at_rotor,
                filters[2:, last - n : last],
            )
            along.append(each)
        return along

    def exchange(self, k: int, rotor: RotorState, t: float, along: Float) -> None:
        """Advance wake k to time ``t`` [s] and begin a plane at its rotor with the mean state since the last one.

        Args:
          along: filters of :meth:`along` for this wake.
        """
        m, before = self.fields[k], int(self.count[k])
        if before:
            now = quick(march, m, k, before, self.step, self.keep[k], self.mixing[k], along)
            self.crossed += min(before + 1, self.profile.shape[1]) - now
            self.count[k] = quick(within, m, k, now, float(self.reach[k]))
        else:
            self.count[k] = 1
        self._begin(k, rotor, t, 0.0 if before == 0 else self.keep[k])
        quick(totals, m, k, 0)
        quick(longest, m, k, int(self.count[k]))

    def _begin(self, k: int, rotor: RotorState, t: float, keep: float) -> None:
        """Set the plane at the rotor from filtered states (K-1 to K-3)."""
        m, radius = self.fields[k], 0.5 * self.diameters[k]
        hub, axis = self._disk(k, rotor)
        ambient, intensity = quick(rotor_wind, m, t, hub, axis)
        relative = float(rotor.wind @ np.array(axis))
        left, up = rotor.skew
        new = Released.of(
            hub=hub,
            axis=axis,
            relative=relative,
            ambient=ambient,
            intensity=intensity if self.intensity is None else self.intensity,
            yaw=rotor.yaw_error,
            skew_left=left,
            skew_up=up,
        )
        now, loads = self._filtered[k], self._loads[k]
        coefficients = rotor.coefficients(self.r, radius, relative)
        quick(release, m, k, new, coefficients, now, loads, keep, self._aside)
        state = {"load": loads, "skew": np.array([now.skew_left, now.skew_up]), "ambient": now.ambient}
        self.profile[k, 0] = self.shape.inlet(state, radius, max(now.relative, LEAST_WIND))

    def settle(self, k: int, t: float) -> None:
        """Compute the velocities of the planes of wake k at time ``t`` [s], after all wakes have been advanced."""
        m = self.fields[k]
        m.wakes.time = t
        missed = self._missed[self.diameters[k]]
        quick(drift, m, k, self.count, self.meeting[k], t, self._averages, missed, self._turn[k])

    def show(self, i: int, rotor: RotorState, t: float) -> None:
        """Select the planes of wakes that turbine i evaluates until the next exchange."""
        m, (centre, axis), radius = self.observers[i], self._disk(i, rotor), SEEN * self.diameters[i]
        quick(observe, m, t, self.count, self.near[i], centre, axis, radius, SLACK, self.slack, self.profile)

    def _boxes(self) -> Float:
        """(wakes, 2, 2) [m] smallest and largest x and y of the centres of each wake."""
        centres = [self.planes["centre"][:2, k, :n] for k, n in enumerate(self.count)]
        return np.array([[centre.min(axis=1), centre.max(axis=1)] for centre in centres])

    def _meeting(self, boxes: Float, beside: Float) -> NDArray[np.int64]:
        """(n, wakes) 1 for each wake that may meet disks of radii (n,) [m] whose centres are within boxes."""
        wide = beside[:, None, None] + self.shape.reach + SLACK
        low, high = self.boxes[None, :, 0] - wide, self.boxes[None, :, 1] + wide
        return np.all((low <= boxes[:, None, 1]) & (boxes[:, None, 0] <= high), axis=2).astype(np.int64)

    def _near(self) -> None:
        """Find the wakes of other turbines that may meet each rotor until the next exchange."""
        rotors, radii = np.repeat(self.positions[:, None], 2, axis=1), SEEN * np.array(self.diameters)
        self.slack = SLACK + self.step * math.sqrt(float((self.planes["velocity"] ** 2).sum(axis=0).max()))
        self.near = self._meeting(rotors, radii + self.slack) * (1 - np.eye(len(radii), dtype=np.int64))

    def _disk(self, i: int, rotor: RotorState) -> tuple[Vec, Vec]:
        """Centre [m] and axis of a rotor in the farm."""
        (x, y, z), axis = rotor.hub.tolist(), Vec(*rotor.shaft.tolist())
        there = self.positions[i].tolist()
        return Vec(x + there[0], y + there[1], z), (1.0 / math.sqrt(dot(axis, axis))) * axis

    def rotor_wind(self, i: int, rotor: RotorState, t: float) -> tuple[Float, Float]:
        """(3,) [m/s] mean wind over the span of rotor i with the wakes of the other turbines, and (3,) ambient wind."""
        m = self.fields[i]
        m.wakes.time = t
        u, v = quick(rotor_mean, m, t, self.count, self.near[i], *self._disk(i, rotor))
        return np.array([u.x, u.y, u.z]), np.array([v.x, v.y, v.z])

    def advance(self, rotors: Sequence[RotorState], t: float, together: Together) -> None:
        """One exchange at time ``t`` [s]: advance wakes, begin planes at the rotors, update velocities."""
        along = self.along()
        together(lambda k: self.exchange(k, rotors[k], t, along[k]))
        self.boxes = self._boxes()
        self.meeting = self._meeting(self.boxes, np.array(self._reach))
        together(lambda k: self.settle(k, t))
        self._near()
        together(lambda k: self.show(k, rotors[k], t))

    def develop(self, rotor: Callable[[int, float], RotorState], together: Together) -> Float:
        """Develop the wakes until time 0 in the preceding wind; rotors are at their operating points.

        Args:
          rotor: state of a rotor in steady operation, by number and wind speed over that without wakes.

        Returns:
          (turbines,) ratio of the mean wind along each rotor axis with the wakes of the others to the ambient one.
        """
        n, shares = len(self.count), np.ones(len(self.count))
        self.count[:], self.near = 0, np.zeros((n, n), dtype=np.int64)  # no wakes yet
        last = math.ceil(float(self.reach.max()) / (DEVELOPED * self.mean.speed * self.step))
        keep = math.exp(-self.step / MEMORY)
        for e in range(-last, 1):
            t = e * self.step
            rotors = [rotor(i, float(shares[i])) for i in range(n)]
            winds = together(lambda i, t=t, rotors=rotors: self.rotor_wind(i, rotors[i], t))  # type: ignore[misc]
            self.advance([_in_wind(r, wind) for r, (wind, _) in zip(rotors, winds, strict=True)], t, together)
            now = [float(u @ r.shaft) / max(float(v @ r.shaft), 1e-9) for r, (u, v) in zip(rotors, winds, strict=True)]
            shares = keep * shares + (1.0 - keep) * np.clip(now, LEAST_SHARE, 1.0)
        self.crossed = 0
        return shares

    def paths(self) -> list[NDArray[np.float32]]:
        """(9, planes) centre, travelled path, velocity, and deficit and radius of top hats for each wake."""
        p, every = self.planes, slice(0, int(self.count.max()))
        axis, flux, square = (p[name][..., every] for name in ("normal", "flux", "square"))
        hat = square / np.where(flux > 0.0, flux, np.inf)  # a top hat: deficit times half the radius squared
        wide = np.sqrt(2.0 * np.maximum(flux, 0.0) / np.where(hat > 0.0, hat, np.inf))
        rows = np.empty((9, *flux.shape), dtype=np.float32)
        side = left_of(axis)
        rows[:3] = (
            p["centre"][..., every] + p["left"][:, every] * side + p["up"][:, every] * np.cross(axis, side, axis=0)
        )
        rows[3], rows[4:7], rows[7], rows[8] = p["travelled"][:, every], p["velocity"][..., every], hat, wide
        return [rows[:, k, :n].copy() for k, n in enumerate(self.count)]

    def horizontal(self) -> tuple[Float, Float, Float]:
        """Wind speed at hub height over the farm now: x, y [m], (x, y) [m/s]."""
        beyond = BEYOND * max(self.diameters)
        (x0, y0), (x1, y1) = self.positions.min(axis=0) - beyond, self.positions.max(axis=0) + beyond
        cell = max(x1 - x0, y1 - y0) / CELLS
        x, y = np.arange(x0 + 0.5 * beyond, x1, cell), np.arange(y0 + 0.5 * beyond, y1 - 0.5 * beyond, cell)
        speed = np.zeros((len(x), len(y)))
        everywhere = np.ones(len(self.count), dtype=np.int64)
        horizontal(self.fields[0], self.fields[0].wakes.time, self.count, everywhere, x, y, self.hubs[0], speed)
        return x, y, speed


def _reaches(positions: Float, wind: Wind, mean: SteadyWind, largest: float) -> Float:
    """(turbines,) [m] length of each wake: to the last turbine that it may meet, but limited."""
    to, (c, d) = positions[None] - positions[:, None], (math.cos(mean.direction), math.sin(mean.direction))
    along, across = to @ [c, -d], np.maximum(np.abs(to @ [d, c]) - ASIDE * largest, 0.0)
    turns = WANDERS + float(np.ptp(getattr(wind, "direction", 0.0)))
    distance = np.where(np.arctan2(across, along) <= turns, np.linalg.norm(to, axis=2), 0.0)
    return np.minimum(distance.max(axis=1) + BEYOND * largest, FURTHEST * largest)


def _average_points(model: WakeSet, diameter: float, rings: int) -> dict[str, Float]:
    """(3, n) points of the averages of :class:`PlaneField` for a rotor diameter [m]."""
    disk = replace(model, windowed=False)
    span = average_points(disk, diameter, 5, 1.0)
    span[:, 2] /= np.hypot(span[:, 0], span[:, 1])  # the mean over the span, as that of a rotor's state
    points = {
        "drift": average_points(model, diameter, rings),
        "disk": average_points(disk, diameter, rings),
        "span": span,
    }
    return {name: np.ascontiguousarray(by_angle(each).T) for name, each in points.items()}


def _in_wind(rotor: RotorState, wind: Float) -> RotorState:
    """A rotor with the same coefficients in another mean wind (3,) [m/s]."""
    before, now = (max(float(u @ rotor.shaft), LEAST_WIND) for u in (rotor.wind, wind))
    return replace(rotor, wind=wind, load=rotor.load * (now / before) ** 2)
