"""The yaw error that load limits allow at each wind speed: base points of the yaw protection.

The turbine produces in normal turbulence with its nacelle fixed at a yaw error of either sign. The limits are those of
the user; or the loads for which the turbine is designed anyway: the largest load in extreme turbulence with the wind
within the dead band of the yaw control, plus a tenth, because few runs of minutes represent hours. The tip clearance is
evaluated as the deflection towards the tower that uses it up, and no limit lets the tip touch the tower.

Reference: docs/guide/yaw-limits.md; the law between base points is that of Wang et al. (2021).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.control_laws.yaw import YawControl
from meltemi.core.errors import InputError, did_you_mean
from meltemi.iec.winds import etm, ntm, nwp
from meltemi.report.palette import COLOURS, DIVERGING, INK
from meltemi.report.plots import new_figure
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.result import Result
from meltemi.simulation.run import Run
from meltemi.simulation.trim import operating_point
from meltemi.simulation.validity import undeflected_clearance
from meltemi.studies.machine_loads import CHANNELS, LOADS, extreme
from meltemi.supervisor.threshold import YawProtection, yaw_threshold
from meltemi.tuning.run_store import FailedResult, attempt, cells, survivors
from meltemi.turbine.definition import Turbine

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Float = NDArray[np.float64]
BasePoints = tuple[Float, Float]
"""Wind speeds [m/s] and thresholds [rad]."""
Key = tuple[str, float, float, int]
"""Model of the turbulence, wind speed [m/s], yaw error [rad] and seed of a run."""
TIP, CLEARANCE = "tip clearance", "tip_clearance_1"
"""Name of the judged tip clearance and its channel: the distance of the tip from the yaw axis."""
UNITS: Mapping[str, str] = {name: load.unit for name, load in LOADS.items()} | {TIP: "m"}
"""Units of the judged quantities; without limits of the user all of them are judged."""
ERRORS = tuple(np.radians((0.0, 15.0, 30.0, 45.0, 60.0, 75.0)))
"""[rad], of either sign."""
DEAD_BAND = YawControl().dead_band
"""[rad] yaw error in extreme turbulence, of either sign."""
ALLOWANCE = 1.1
"""Limit over the largest load in extreme turbulence: a few seeds of some minutes represent hours."""
LEAD, LENGTH = 30.0, 150.0
"""[s] not judged, and judged, of a run."""
N_SPEEDS = 7


@dataclass(frozen=True)
class YawLimits:
    """Loads over wind speed and yaw error.

    Attributes:
      speeds: (S,) [m/s] wind speeds.
      errors: (E,) [rad] absolute yaw errors, ascending.
      loads: by name (S, E, 2), largest over seeds, for an error of positive and of negative sign, in the unit of
        ``UNITS``; for the tip clearance its reduction by the deflection.
      limit: limits by name, in the same unit.
      undeflected: [m] tip clearance of the undeflected rotor.
    """

    speeds: Float
    errors: Float
    loads: dict[str, Float] = field(repr=False)
    limit: dict[str, float]
    undeflected: float = np.nan

    @property
    def use(self) -> Float:
        """(S, E) largest ratio of a load to its limit, over loads and signs."""
        return self.by_sign.max(axis=-1)

    @property
    def by_sign(self) -> Float:
        """(S, E, 2) largest ratio of a load to its limit, for an error of positive and of negative sign."""
        return np.max([self.loads[name] / limit for name, limit in self.limit.items()], axis=0)

    def governing(self) -> list[str]:
        """Load with the largest use at each wind speed up to the first error beyond the limits, and that error."""
        governing = []
        for i, use in enumerate(self.use):
            over = np.flatnonzero(use > 1.0)
            last = over[0] + 1 if len(over) else len(use)
            ratios = {name: self.loads[name][i, :last] / limit for name, limit in self.limit.items()}
            name = max(ratios, key=lambda key: float(ratios[key].max()))
            j, k = np.unravel_index(np.argmax(ratios[name]), ratios[name].shape)
            governing.append(
                f"{name}, {'-+'[int(k == 0)] if self.errors[j] > 0.0 else ''}{np.degrees(self.errors[j]):.0f} deg"
            )
        return governing

    def allowed(self) -> Float:
        """(S,) [rad] largest yaw error within all limits, interpolated linearly; non-increasing with wind speed."""
        allowed = []
        for use in self.use:
            over = np.flatnonzero(use > 1.0)
            if not len(over):
                allowed.append(self.errors[-1])
            elif over[0] == 0:
                allowed.append(0.0)
            else:
                k = over[0]
                share = (1.0 - use[k - 1]) / (use[k] - use[k - 1])
                allowed.append(self.errors[k - 1] + share * (self.errors[k] - self.errors[k - 1]))
        return np.minimum.accumulate(np.array(allowed))

    @property
    def base_points(self) -> BasePoints:
        """Base points of the interpolated law."""
        return self.speeds, self.allowed()


def speeds_between(cut_in: float, cut_out: float) -> Float:
    """(7,) [m/s] integer wind speeds from two above cut-in to cut-out."""
    return np.unique(np.round(np.linspace(cut_in + 2.0, cut_out, N_SPEEDS)))


def find_limits(  # noqa: PLR0913 - options of a study, each with a default
    model: BladedModel,
    seeds: Sequence[int],
    *,
    wind_class: str = "IB",
    speeds: Sequence[float] | None = None,
    errors: Sequence[float] = ERRORS,
    limit: Mapping[str, float] | None = None,
    allowance: float = ALLOWANCE,
    length: float = LENGTH,
    workers: int | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> YawLimits:
    """Simulate production at yaw errors and, unless limits are given, extreme turbulence without yaw error.

    A run that cannot start or fails counts as an infinite load at its yaw error; the limit is that of the other runs.
    Errors at which the wind does not drive the rotor have no load.

    Args:
      model: turbine model with fixed yaw.
      seeds: turbulence seeds.
      wind_class: wind class of IEC 61400-1.
      speeds: [m/s] wind speeds; by default seven from cut-in to cut-out.
      errors: [rad] absolute yaw errors, ascending.
      limit: limits by name of ``UNITS``, in its unit; only these are evaluated. For the tip clearance it is the
        smallest one.
      allowance: factor on the largest load in extreme turbulence.
      length: [s] evaluated length of each run.
      workers: number of threads.
      progress: callback with the completed fraction.

    Raises:
      InputError: a load is unknown, or a limit is not positive.
      FailedResultError: all runs in extreme turbulence failed.
    """
    for name, value in (limit or {}).items():
        if name not in UNITS:
            raise InputError(f"load limits: no load {name!r}: {did_you_mean(name, UNITS)}")
        if not 0.0 < value < np.inf:
            raise InputError(f"load limits: {name}: expected a positive number of {UNITS[name]}, found {value:g}")
    judged, undeflected = tuple(limit or UNITS), undeflected_clearance(model)
    if limit is not None and TIP in limit:
        if limit[TIP] >= undeflected:
            raise InputError(
                f"load limits: {TIP}: expected less than the {undeflected:.4g} m of the undeflected rotor, "
                f"found {limit[TIP]:g} m"
            )
        limit = {**limit, TIP: undeflected - limit[TIP]}
    axis = undeflected + _tower_radius(model.turbine)
    speeds = list(speeds_between(model.turbine.cut_in, model.turbine.cut_out) if speeds is None else speeds)
    keys: list[Key] = []
    for seed in seeds:
        for speed in speeds:
            keys += [("ntm", speed, sign * e, seed) for e in errors for sign in ((1.0, -1.0) if e > 0.0 else (1.0,))]
            keys += [("etm", speed, sign * DEAD_BAND, seed) for sign in (1.0, -1.0)] if limit is None else []
    cases = cases_in_turbulence(model, keys, wind_class, LEAD + length)

    def peaks(result: Result) -> dict[str, float]:
        part = result.between(LEAD, np.inf)
        return {name: axis - float(part[CLEARANCE].min()) if name == TIP else extreme(part, name) for name in judged}

    results = cells(cases, reduce=peaks, workers=workers, progress=progress)
    extremes = [peak for (kind, *_), peak in zip(keys, results, strict=True) if kind == "etm"]
    if limit is None:
        limit = {name: allowance * max(peak[name] for peak in survivors(extremes)) for name in judged}
        # a tip that deflects away from the tower, as of a downwind rotor, keeps its full clearance
        limit[TIP] = min(limit[TIP], undeflected) if limit[TIP] > 0.0 else undeflected
    loads = {name: np.zeros((len(speeds), len(errors), 2)) for name in judged}
    for (kind, speed, angle, _), peak in zip(keys, results, strict=True):
        if kind == "ntm":
            j = int(np.argmin(np.abs(np.array(errors) - abs(angle))))
            sides = slice(None) if angle == 0.0 else int(angle < 0.0)
            for name, of in loads.items():
                value = np.inf if isinstance(peak, FailedResult) else peak[name]
                of[speeds.index(speed), j, sides] = np.maximum(of[speeds.index(speed), j, sides], value)
    return YawLimits(np.array(speeds), np.array(errors), loads, dict(limit), undeflected)


def _tower_radius(turbine: Turbine) -> float:
    """Radius [m] of the tower at the height of the lowest tip of the undeflected rotor."""
    low = turbine.hub_height - turbine.rotor_radius - turbine.tower.base_height
    return 0.5 * float(np.interp(low, turbine.tower.position, turbine.tower.diameter))


def cases_in_turbulence(model: BladedModel, keys: Sequence[Key], wind_class: str, duration: float) -> list[Run]:
    """Runs for keys of turbulence model, wind speed [m/s], yaw error [rad] and seed."""
    starts = {
        (v, e): attempt(
            f"steady operation at {v:g} m/s, {np.degrees(e):g} deg", operating_point, model, nwp(v, direction=e)
        )
        for v, e in {(speed, angle) for _, speed, angle, _ in keys}
    }
    return [
        Run(
            model=model,
            wind=(ntm if kind == "ntm" else etm)(speed, wind_class, seed=seed, direction=angle),
            duration=duration,
            channels=(*CHANNELS, CLEARANCE),
            start=starts[speed, angle],
            name=f"{kind} {speed:g} m/s {np.degrees(angle):g} deg seed {seed}",
        )
        for kind, speed, angle, seed in keys
    ]


def limit_rows(limits: YawLimits) -> tuple[list[str], list[list[str]]]:
    """Header and rows: largest load over its limit by wind speed and yaw error, base points, governing load."""
    head = ["wind m/s", *(f"{np.degrees(e):.0f} deg" for e in limits.errors), "allowed deg", "most use"]
    rows = [
        [f"{c:g}", *(f"{u:.2f}" if np.isfinite(u) else "failed" for u in use), f"{np.degrees(b):.1f}", what]
        for c, use, b, what in zip(limits.speeds, limits.use, limits.allowed(), limits.governing(), strict=True)
    ]
    return head, rows


def limit_words(limits: YawLimits) -> str:
    """Text on the limits."""
    least = {name: limits.undeflected - value if name == TIP else value for name, value in limits.limit.items()}
    return "; ".join(f"{name} {value:.4g} {UNITS[name]}" for name, value in least.items())


def plot_limits(limits: YawLimits) -> Figure:
    """Map of the largest load over its limit, the allowed yaw error, and the laws of Wang et al. (2021)."""
    figure, axes = new_figure(1, size=(8.0, 5.0))
    draw_limits(axes[0, 0], limits)
    return figure


def draw_limits(ax: Axes, limits: YawLimits) -> None:
    """Draw the map on given axes: errors of positive sign above zero, of negative sign below."""
    from matplotlib.colors import LinearSegmentedColormap, TwoSlopeNorm

    errors = np.degrees(limits.errors)
    side = limits.by_sign
    both = np.concatenate([-errors[:0:-1], errors])
    use = np.concatenate([side[:, :0:-1, 1], side[:, :, 0]], axis=1)
    contours = ax.contourf(
        limits.speeds,
        both,
        np.minimum(use, 9.0).T,
        levels=np.arange(0.2, 2.01, 0.2),
        norm=TwoSlopeNorm(1.0, 0.0, 2.0),
        cmap=LinearSegmentedColormap.from_list("change", DIVERGING[::-1]),
        extend="both",
    )
    ax.figure.colorbar(contours, ax=ax, label="largest load over its limit")
    fine = np.linspace(limits.speeds[0], limits.speeds[-1], 301)
    lines = [("loads within limits", limits.speeds, np.degrees(limits.allowed()), INK, "o-")]
    for colour, law in zip((COLOURS[4], COLOURS[2]), ("interpolated", "stepwise"), strict=True):
        angles = np.degrees(yaw_threshold(YawProtection.model_validate({"law": law}), fine))
        lines.append((f"Wang et al. (2021), {law}", fine, angles, colour, "-"))
    for label, x, y, colour, mark in lines:
        # the allowed error may be the largest one on the axis
        ax.plot(x, y, mark, color=colour, label=label, clip_on=False)
        ax.plot(x, -y, mark, color=colour, clip_on=False)
    ax.set_ylim(both[0], both[-1])
    ax.set_title("allowed yaw error, and the loads there")
    ax.set_xlabel("wind speed [m/s]")
    ax.set_ylabel("yaw error [deg]")
    ax.legend()
