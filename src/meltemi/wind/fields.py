"""Wind descriptions."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from meltemi.compiler import View
from meltemi.core.display import rounded
from meltemi.core.errors import InputError
from meltemi.core.record import Record, Vector
from meltemi.core.series import changing
from meltemi.core.shown import Brief, Viewed
from meltemi.wind.velocity import WindField, WindNow, WindParameters

if TYPE_CHECKING:
    from meltemi.core.representation import Card


class SteadyWind(Record, Viewed):
    """Steady wind, uniform over the rotor except for shear and veer."""

    speed: float = Field(ge=0.0, le=100.0)
    """[m/s; 1 to 80] at the reference height."""
    shear_exponent: float = Field(default=0.0, gt=-1.0, lt=1.0)
    """Exponent of the power law [-]; 0 is no shear."""
    roughness: float = Field(default=0.0, ge=0.0, lt=10.0)
    """[m; 1e-5 to 3] length of the logarithmic profile, used instead of the power law when above zero."""
    direction: float = Field(default=0.0, ge=-7.0, le=7.0)
    """[rad] clockwise seen from above: the wind then blows towards -y."""
    veer: float = Field(default=0.0, gt=-0.1, lt=0.1)
    """[rad/m; 1e-5 to 0.02] change of the direction with height."""
    upflow: float = Field(default=0.0, gt=-1.0, lt=1.0)
    """[rad] inclination of the flow, upwards when positive."""
    reference_height: float | None = Field(default=None, gt=0.0)
    """[m; 5 to 300]; the hub height by default."""

    @property
    def label(self) -> str:
        """Short description, for titles and metadata."""
        parts = [f"steady wind {self.speed:g} m/s"]
        if self.roughness:
            parts.append(f"roughness {self.roughness:g} m")
        elif self.shear_exponent:
            parts.append(f"shear exponent {self.shear_exponent:g}")
        for name in ("direction", "upflow"):
            if angle := getattr(self, name):
                parts.append(f"{name} {np.degrees(angle):g} deg")
        if self.veer:
            parts.append(f"veer {np.degrees(self.veer):g} deg/m")
        return ", ".join(parts)


class WindSeries(Record, Viewed):
    """Time-varying wind, uniform over the rotor except for shear: the content of a ``.wnd`` file."""

    time: Vector
    """(T,) [s] increasing; constant before and after."""
    speed: Vector
    """(T,) [m/s; 1 to 80]."""
    direction: Vector
    """(T,) [rad]; zero by default, like all that follow."""
    vertical: Vector
    """(T,) [m/s]."""
    horizontal_shear: Vector
    """(T,) [-] linear, over the reference length."""
    exponent: Vector
    """(T,) [-] of the power law."""
    vertical_shear: Vector
    """(T,) [-] linear, over the reference length."""
    gust: Vector
    """(T,) [m/s] added everywhere."""
    reference_height: float | None = Field(default=None, gt=0.0)
    """[m]; the hub height by default."""
    reference_length: float | None = Field(default=None, gt=0.0)
    """[m]; the rotor diameter by default."""
    source: str = ""

    if TYPE_CHECKING:

        def __init__(  # noqa: PLR0913 - the columns of a wind file
            self,
            *,
            time: ArrayLike,
            speed: ArrayLike,
            direction: ArrayLike = 0.0,
            vertical: ArrayLike = 0.0,
            horizontal_shear: ArrayLike = 0.0,
            exponent: ArrayLike = 0.0,
            vertical_shear: ArrayLike = 0.0,
            gust: ArrayLike = 0.0,
            reference_height: float | None = None,
            reference_length: float | None = None,
            source: str = "",
        ) -> None: ...

    @model_validator(mode="before")
    @classmethod
    def _fill(cls, data: Any) -> Any:
        """Omitted columns are zero, scalars are constant in time."""
        if not isinstance(data, dict) or "time" not in data:
            return data
        n = np.size(data["time"])
        columns = {name: data.get(name, 0.0) for name in WindNow.names if name in data or name != "speed"}
        return data | {name: np.full(n, v) if isinstance(v, int | float) else v for name, v in columns.items()}

    @model_validator(mode="after")
    def _check(self) -> Self:
        n = len(self.time)
        for name in WindNow.names:
            if getattr(self, name).shape != (n,):
                raise ValueError(f"{name} must have {n} entries like time")
            most = FASTEST if name in ("speed", "vertical", "gust") else MOST if name != "time" else np.inf
            beyond = np.flatnonzero(np.abs(getattr(self, name)) > most)
            if len(beyond):
                value = getattr(self, name)[beyond[0]]
                raise ValueError(f"{name} must be within {most:g}, but row {beyond[0] + 1} has {value:g}")
        if np.any(np.diff(self.time) <= 0.0):
            i = int(np.flatnonzero(np.diff(self.time) <= 0.0)[0])
            raise ValueError(f"time must increase, but row {i + 2} ({self.time[i + 1]:g} s) does not")
        return self

    @property
    def label(self) -> str:
        """Short description, for titles and metadata."""
        return self.source or "wind series"

    @property
    def changes(self) -> tuple[float, float] | None:
        """Begin and end [s] of changes, such as a gust; None for a constant wind."""
        return changing(self.time, *(getattr(self, name) for name in WindNow.names if name != "time"))

    def __repr__(self) -> str:
        return f"<WindSeries {self.label}: {len(self.time)} times, {self.time[0]:g} to {self.time[-1]:g} s>"


LARGEST = {"dt": 1e4, "dy": 1e4, "dz": 1e4, "bottom": 1e4, "speed": 100.0, "hub_height": 1e4}
"""Largest numbers of a box, in their units."""
FASTEST = 300.0
"""[m/s] largest wind speed in a box or series; a tornado has half of it."""
MOST = 1e3
"""[rad or -] largest direction and shears of a series."""


@dataclass(frozen=True, repr=False)
class WindBox(Brief, Viewed):
    """A turbulent field on a grid, convected past the turbine at its mean speed.

    At time 0 the first plane is half the grid's width downwind of the tower, so that a yawed rotor is inside; that of
    a periodic field is at the tower. OpenFAST has the same convention. The wind at (x, y, z) and time t is that of
    plane (t + (lead - x) / speed) / dt.

    Attributes:
      velocity: (T, Z, Y, 3) [m/s] including the mean; y to the left looking downwind, z up.
      dt, dy, dz: [s], [m], [m] spacing of planes, columns, rows.
      bottom: [m] height of the lowest row above ground.
      speed: [m/s] convection speed of the field.
      hub_height: [m] hub height of the field; None suits every turbine whose rotor it covers.
      periodic: the field repeats after its last plane.
      direction: [rad] wind direction of the box, clockwise from above.
      mean: wind without turbulence of which it is a realisation; None: it is that of the velocities.
      source: file or generator and its settings.
    """

    velocity: NDArray[np.float32]
    dt: float
    dy: float
    dz: float
    bottom: float
    speed: float
    hub_height: float | None = None
    periodic: bool = False
    direction: float = 0.0
    mean: SteadyWind | None = None
    source: str = ""

    def __post_init__(self) -> None:
        # kernels are compiled for one kind of array
        try:
            v = np.require(self.velocity, np.float32, ["C_CONTIGUOUS", "WRITEABLE"])
        except (TypeError, ValueError, OverflowError):
            raise InputError(f"wind box: velocity must be numbers (T, Z, Y, 3), found {self.velocity!r:.60}") from None
        object.__setattr__(self, "velocity", v)
        if v.ndim != 4 or v.shape[3] != 3 or min(v.shape[:3]) < 2:
            raise InputError(
                f"wind box: velocity must have shape (T, Z, Y, 3) with at least 2 points each, found {v.shape}"
            )
        for name, most in LARGEST.items():
            value = getattr(self, name)
            number = isinstance(value, int | float | np.number)
            if not (name == "hub_height" and value is None) and not (number and 0.0 < value <= most):
                raise InputError(f"wind box: {name} must be a positive number, found {value!r} (at most {most:g})")
        if not (isinstance(self.direction, int | float | np.number) and abs(self.direction) <= np.pi + 1e-9):
            raise InputError(f"wind box: direction must be an angle within pi rad, found {self.direction!r}")
        if not (fastest := max(v.max(), -v.min())) <= FASTEST:
            if not np.all(np.isfinite(v)):
                raise InputError(f"wind box: {int(np.sum(~np.isfinite(v)))} velocities are not finite")
            raise InputError(f"wind box: velocities reach {fastest:g} m/s, expected at most {FASTEST:g}")

    @property
    def label(self) -> str:
        """Short description, for titles and metadata."""
        return self.source or "wind box"

    def __repr__(self) -> str:
        return f"<WindBox {self.label}: {self._grid()}>"

    def _grid(self) -> str:
        planes, rows, columns = self.velocity.shape[:3]
        return f"{planes} planes of {rows} x {columns} points, {self.duration:g} s"

    def card(self) -> Card:
        """Grid, and the wind at the middle of the grid."""
        from meltemi.core.representation import Card, Fold, sparkline

        facts = [
            ("grid", self._grid()),
            ("between planes", f"{self.dt:g} s, carried at {self.speed:.5g} m/s"),
            ("height", f"{self.bottom:g} to {self.top:g} m, rows every {self.dz:g} m"),
            ("width", f"{self.width:g} m, columns every {self.dy:g} m"),
            ("periodic", "yes" if self.periodic else "no"),
        ]
        if self.direction:
            facts.append(("direction", f"{np.degrees(self.direction):.4g} deg"))
        middle = self.velocity[:, self.velocity.shape[1] // 2, self.velocity.shape[2] // 2].astype(float)
        rows = [
            [name, *(rounded(float(f(x))) for f in (np.mean, np.std, np.min, np.max)), sparkline(x)]
            for name, x in zip("uvw", middle.T, strict=True)
        ]
        head = ["", "mean m/s", "std m/s", "min m/s", "max m/s", ""]
        return Card("WindBox", self.label, facts, [Fold("Wind in the middle of the grid", rows, head, open=True)])

    @property
    def width(self) -> float:
        """Lateral extent [m]."""
        return (self.velocity.shape[2] - 1) * self.dy

    @property
    def lead(self) -> float:
        """Distance [m] of the first plane downwind of the tower axis at time 0."""
        return 0.0 if self.periodic else 0.5 * self.width

    @property
    def passing(self) -> NDArray[np.float64]:
        """(T,) [s] times at which the planes pass the tower axis."""
        return self.dt * np.arange(len(self.velocity), dtype=np.float64) - self.lead / self.speed

    @property
    def top(self) -> float:
        """Height [m] of the highest row above ground."""
        return self.bottom + (self.velocity.shape[1] - 1) * self.dz

    @property
    def duration(self) -> float:
        """Time [s] from first to last plane."""
        return (self.velocity.shape[0] - 1) * self.dt

    def content_hash(self) -> str:
        """Hash of velocities and grid."""
        return self._digest

    @cached_property
    def _digest(self) -> str:
        digest = hashlib.sha256(self.velocity.data)
        digest.update(
            repr((self.dt, self.dy, self.dz, self.bottom, self.speed, self.periodic, self.direction)).encode()
        )
        return digest.hexdigest()[:16]


def at_speed(box: WindBox, speed: float) -> WindBox:
    """The same turbulence with another mean wind speed.

    Planes keep their distance and pass faster or slower; the mean profile is scaled with the speed, the fluctuations
    are the same. (``dataclasses.replace(box, speed=...)`` keeps the time between planes and stretches the eddies.)

    Args:
      box: wind box.
      speed: [m/s] new mean wind speed.

    Raises:
      InputError: the speed is not positive.
    """
    if not 0.0 < speed < np.inf:
        raise InputError(f"{box.label}: speed must be a positive number, found {speed!r}")
    mean = box.velocity.mean(axis=(0, 2), dtype=np.float64)
    velocity = box.velocity + ((speed / box.speed - 1.0) * mean).astype(np.float32)[:, None]
    return replace(box, velocity=velocity, dt=box.dt * box.speed / speed, speed=speed)


def unit_turbulence(box: WindBox) -> WindBox:
    """The fluctuations of a field over the standard deviation of their longitudinal component at the hub.

    For :class:`SharedTurbulence`, which combines them with another mean wind and standard deviation.

    Args:
      box: wind box; without a hub height the hub is in the middle of its grid.

    Raises:
      InputError: the wind does not fluctuate.
    """
    mean = box.velocity.mean(axis=(0, 2), dtype=np.float64).astype(np.float32)
    velocity = box.velocity - mean[:, None]
    row = _row(box, box.hub_height or 0.5 * (box.bottom + box.top))
    sigma = float(velocity[:, row, velocity.shape[2] // 2, 0].std(dtype=np.float64))
    if not sigma > 0.0:
        raise InputError(f"{box.label}: a wind without turbulence cannot be scaled")
    return replace(box, velocity=velocity / np.float32(sigma), direction=0.0, source=f"unit turbulence of {box.label}")


@dataclass(frozen=True)
class SharedTurbulence:
    """A steady mean wind, and turbulence shared with other cases, so that many cases need the memory of few fields.

    The spectra and coherence of IEC 61400-1 are functions of wave number, so the same turbulence is right for every
    mean speed: its planes keep their distance.

    Attributes:
      mean: wind without turbulence: speed, shear, direction, upflow.
      field: unit turbulence from :func:`unit_turbulence`.
      sigma: [m/s] standard deviation of the longitudinal component at the hub.
      begin: [m] length of the field that has passed at the start of the run; any value for a periodic field.

    Raises:
      InputError: ``sigma`` or ``begin`` is negative or not finite.
    """

    mean: SteadyWind
    field: WindBox
    sigma: float
    begin: float = 0.0

    def __post_init__(self) -> None:
        for name in ("sigma", "begin"):
            if not 0.0 <= (value := getattr(self, name)) < np.inf:
                raise InputError(f"shared turbulence: {name} must be 0 or a positive number, found {value!r}")

    @property
    def label(self) -> str:
        """Short description, for titles and metadata."""
        return f"{self.mean.label}, {self.field.label} times {self.sigma:.4g} m/s from {self.begin:.6g} m on"

    def content_hash(self) -> str:
        """Hash of mean, field and both numbers."""
        parts = (self.mean.content_hash(), self.field.content_hash(), self.sigma, self.begin)
        return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


Wind = SteadyWind | WindSeries | WindBox | SharedTurbulence


NO_BOX = np.zeros((2, 2, 2, 3), dtype=np.float32)
NO_SERIES = np.zeros((1, len(WindNow.fields)))


def wind_arrays(
    wind: Wind, hub_height: float, rotor_diameter: float, origin: tuple[float, float] = (0.0, 0.0)
) -> dict[str, NDArray[Any]]:
    """Arrays of the record ``WindField`` of a wind for a turbine, by name.

    Args:
      origin: (x, y) [m] position of the turbine in the axes of the wind: a box passes there later; a series is uniform.
    """
    array = WindParameters.zeros()
    view = View(WindParameters, array)
    view["reference_height"], view["reference_length"] = hub_height, rotor_diameter
    view["box_speed"] = view["box_dt"] = view["box_dy"] = view["box_dz"] = view["box_z"] = 1.0
    if isinstance(wind, WindBox):
        view["kind"] = 1.0
        _put_box(view, wind, wind.speed, wind.direction, origin)
        return _arrays(array, NO_SERIES, wind.velocity)
    if isinstance(wind, SharedTurbulence):
        arrays = wind_arrays(wind.mean, hub_height, rotor_diameter)
        view = View(WindParameters, arrays["wind"])
        view["kind"], view["gain"] = 2.0, wind.sigma
        _put_box(view, wind.field, mean_speed(wind, hub_height), wind.mean.direction, origin)
        view["box_x"] += wind.begin
        return arrays | {"box": wind.field.velocity}
    if wind.reference_height is not None:
        view["reference_height"] = wind.reference_height
    if isinstance(wind, SteadyWind):
        view["roughness"], view["veer"], view["upflow"] = wind.roughness, wind.veer, wind.upflow
        row = View(WindNow, WindNow.zeros())
        row["speed"], row["direction"], row["exponent"] = wind.speed, wind.direction, wind.shear_exponent
        return _arrays(array, row.array.reshape(1, -1).copy(), NO_BOX)
    if wind.reference_length is not None:
        view["reference_length"] = wind.reference_length
    series = np.stack([getattr(wind, name) for name in WindNow.names], axis=1)
    return _arrays(array, np.ascontiguousarray(series), NO_BOX)


def _put_box(view: View, box: WindBox, speed: float, direction: float, origin: tuple[float, float]) -> None:
    """Parameters of a box that travels with ``speed`` [m/s]; its planes keep their distance."""
    view["box_speed"], view["box_dt"] = speed, box.dt * (box.speed / speed)
    view["box_dy"], view["box_dz"] = box.dy, box.dz
    along, across = in_axes(direction, *origin)
    view["box_y"], view["box_z"], view["box_x"] = -0.5 * box.width - across, box.bottom, box.lead - along
    view["box_direction"], view["periodic"] = direction, float(box.periodic)


def in_axes(direction: float, x: float, y: float) -> tuple[float, float]:
    """Components of a horizontal vector along and across a wind direction [rad]."""
    c, s = math.cos(direction), math.sin(direction)
    return x * c - y * s, x * s + y * c


def _arrays(
    wind: NDArray[np.float64], series: NDArray[np.float64], box: NDArray[np.float32]
) -> dict[str, NDArray[Any]]:
    """Arrays of a wind, with those that its kernels fill."""
    times = np.ascontiguousarray(series[:, WindNow.index("time")])
    return {"wind": wind, "times": times, "series": series, "now": WindNow.zeros(), "box": box}


def wind_field(wind: Wind, hub_height: float, rotor_diameter: float) -> WindField:
    """Record of a wind for a turbine, in plain numbers."""
    return WindField("floats", wind_arrays(wind, hub_height, rotor_diameter))


def mean_speed(wind: Wind, hub_height: float) -> float:
    """Initial wind speed [m/s] at hub height: of a series at its start (without linear shear), of a box the mean.

    The mean of a box is that of the horizontal speed, which drives the rotor.
    """
    if isinstance(wind, WindBox):
        u = _at_hub(wind, hub_height)
        return float(np.mean(np.hypot(u[:, 0], u[:, 1])))
    if isinstance(wind, SharedTurbulence):
        return mean_speed(wind.mean, hub_height)
    ratio = hub_height / (wind.reference_height or hub_height)
    if isinstance(wind, WindSeries):
        return float(wind.speed[0] * ratio ** wind.exponent[0] + wind.gust[0])
    if wind.roughness > 0.0:
        return wind.speed * float(np.log(hub_height / wind.roughness) / np.log(hub_height / ratio / wind.roughness))
    return wind.speed * float(ratio**wind.shear_exponent)


def _at_hub(box: WindBox, hub_height: float) -> NDArray[np.floating[Any]]:
    """(T, 2) [m/s] horizontal velocities of a box at the grid point nearest to the hub."""
    return box.velocity[:, _row(box, hub_height), box.velocity.shape[2] // 2, :2]


def _row(box: WindBox, height: float) -> int:
    """Row of a box nearest to a height [m]."""
    return int(np.clip(round((height - box.bottom) / box.dz), 0, box.velocity.shape[1] - 1))


def mean_before(wind: Wind, hub_height: float) -> float:
    """Mean wind speed [m/s] at hub height assumed before a run.

    For a box it is the magnitude of the mean vector, the mean wind speed of a case: the mean of the horizontal speed is
    larger due to lateral turbulence. For a series that fluctuates from its start it is the mean of the series.
    """
    if isinstance(wind, WindBox):
        return float(np.linalg.norm(np.mean(_at_hub(wind, hub_height), axis=0, dtype=np.float64)))
    if isinstance(wind, WindSeries) and len(wind.time) > 1:
        speed = wind.speed * (hub_height / (wind.reference_height or hub_height)) ** wind.exponent + wind.gust
        if speed[1] != speed[0]:  # a gust or change of the standard begins with constant wind
            return float(np.trapezoid(speed, wind.time) / (wind.time[-1] - wind.time[0]))
    return mean_speed(wind, hub_height)


USUAL_EXPONENT, USUAL_UPFLOW = (-0.3, 0.7), np.radians(20.0)
"""Range of the exponent of the power law, from stable nights to hills; [rad] inclination of flow over steep hills."""
USUAL_TURBULENCE = 1.5
"""Largest usual turbulence over the extreme turbulence of class IA+."""


def unusual(wind: Any, *, produces: bool = True, yaw: float = 0.0) -> list[str]:
    """Warnings about implausible shear, upflow, direction and turbulence of a wind.

    Args:
      produces: the turbine faces the wind in production.
      yaw: [rad] yaw angle of the nacelle, counter-clockwise from above.
    """
    intensity = _intensity(wind)
    wind = wind.mean if isinstance(wind, SharedTurbulence) else wind
    exponent = np.atleast_1d(getattr(wind, "shear_exponent", getattr(wind, "exponent", 0.0)))
    upflow = np.atleast_1d(getattr(wind, "upflow", 0.0))
    if isinstance(wind, WindSeries):
        upflow = np.arctan2(wind.vertical, np.maximum(np.abs(wind.speed + wind.gust), 1e-9))
    sentences = []
    worst = exponent[np.argmax(np.abs(exponent - np.clip(exponent, *USUAL_EXPONENT)))]
    if not USUAL_EXPONENT[0] <= worst <= USUAL_EXPONENT[1]:
        sentences.append(f"wind: a shear exponent of {worst:g} is unusual; IEC 61400-1 has 0.2, sites have -0.3 to 0.7")
    worst = upflow[np.argmax(np.abs(upflow))]
    if abs(worst) > USUAL_UPFLOW:
        sentences.append(
            f"wind: an upflow of {np.degrees(worst):.3g} deg is unusual; IEC 61400-1 has 8 deg; it is in rad"
        )
    worst = float(np.arccos(np.min(np.cos(np.asarray(getattr(wind, "direction", 0.0)) + yaw))))
    if produces and worst > 0.49 * np.pi:
        sentences.append(
            f"wind: it comes across the rotor or from behind, {np.degrees(worst):.3g} deg from its front, where "
            "sections and wake have no model of a producing turbine; in Python and in files directions are in rad"
        )
    speed = float(getattr(wind, "speed", 0.0)) if intensity else 0.0
    extreme = 0.36 * (0.576 * (0.5 * speed - 4.0) + 10.0)
    if intensity * speed > USUAL_TURBULENCE * extreme:
        sentences.append(
            f"wind: a turbulence intensity of {100.0 * intensity:.3g} % at {speed:g} m/s is unusual; the extreme "
            f"turbulence of IEC 61400-1 has {100.0 * extreme / speed:.2g} % (class IA+); it is a fraction: 0.14 is 14 %"
        )
    return sentences


def _intensity(wind: Any) -> float:
    """Turbulence intensity at the hub, as given or from a box; 0 for other winds."""
    if isinstance(wind, SharedTurbulence):
        return float(wind.sigma / wind.mean.speed) if wind.mean.speed else 0.0
    if isinstance(wind, WindBox):
        middle = wind.velocity[:, wind.velocity.shape[1] // 2, wind.velocity.shape[2] // 2, 0]
        return float(np.std(middle, dtype=float) / max(wind.speed, 1e-9))
    return float(getattr(wind, "intensity", 0.0))


def check_coverage(
    wind: Wind,
    *,
    hub_height: float,
    radius: float,
    reach: float,
    duration: float,
    origin: tuple[float, float] = (0.0, 0.0),
) -> None:
    """Raise an error for a box that is too small or too short for the turbine, or a gust outside the run.

    Args:
      hub_height, radius: [m] hub height and rotor radius.
      reach: [m] extent of the rotor up- and downwind of the tower axis.
      duration: [s] duration of the run.
      origin: (x, y) [m] position of the turbine in the axes of the wind.

    Raises:
      InputError: with the insufficient quantity, its value and the required value.
    """
    if isinstance(wind, WindSeries) and (span := wind.changes) and not (span[0] < duration and span[1] > 0.0):
        raise InputError(
            f"{wind.label}: the wind changes from {span[0]:g} s to {span[1]:g} s only, outside the run of "
            f"{duration:g} s: let it begin earlier, or simulate longer"
        )
    if isinstance(wind, SharedTurbulence):
        name, box, speed, ahead = wind.label, wind.field, mean_speed(wind, hub_height), wind.begin + reach
    elif isinstance(wind, WindBox):
        name, box, speed, ahead = wind.label, wind, wind.speed, reach
    else:
        return
    direction = wind.mean.direction if isinstance(wind, SharedTurbulence) else box.direction
    along, across = in_axes(direction, *origin)
    ahead -= along
    problems: list[str] = []
    if not box.periodic and along > box.lead:
        problems.append(f"it begins {box.lead:g} m downwind of its origin, and the turbine is at {along:g} m")
    if box.width < 2.0 * (radius + abs(across)):
        problems.append(f"it is {box.width:g} m wide, the rotor needs {2.0 * (radius + abs(across)):.1f} m")
    if box.top < hub_height + radius:
        problems.append(f"it reaches up to {box.top:g} m, the rotor to {hub_height + radius:.1f} m")
    if box.bottom > hub_height - radius:
        problems.append(
            f"it begins at {box.bottom:g} m above ground, the rotor reaches down to {hub_height - radius:.1f} m"
        )
    if box.hub_height is not None and abs(box.hub_height - hub_height) > 0.02 * hub_height:
        problems.append(
            f"it was generated for a hub height of {box.hub_height:g} m, the turbine's is {hub_height:.1f} m "
            "(in Python, dataclasses.replace(box, hub_height=None) overrides this)"
        )
    available = box.duration * (box.speed / speed)
    needed = duration + (box.lead + ahead) / speed
    if not box.periodic and available < needed:
        longest = available - (box.lead + ahead) / speed
        problems.append(
            f"it is {available:.1f} s long, a run of {duration:g} s needs {needed:.1f} s "
            f"(half its width passes the rotor before the end); the longest run is {max(longest, 0.0):.1f} s"
        )
    if problems:
        raise InputError(f"{name}: the wind field does not cover the run: " + "; ".join(problems))
