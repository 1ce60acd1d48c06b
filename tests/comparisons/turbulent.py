"""Turbulence against OpenFAST, in the same wind box and under the same control law."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from comparisons import thinned
from meltemi.core.errors import InputError
from meltemi.postprocess.fatigue import damage_equivalent_load, usual_slope
from meltemi.postprocess.files.openfast import si_unit
from meltemi.report.palette import COLOURS
from meltemi.report.plots import ABOVE, new_figure, panel
from meltemi.simulation.channels import find, standard
from meltemi.simulation.result import Result
from meltemi.simulation.simulate import simulate
from meltemi.simulation.start import Start
from meltemi.verification.steady import deck_model
from meltemi.verification.table import Check, CheckTable, at_least, relative
from meltemi.wind.fields import WindBox
from meltemi.wind_files import read_bts

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]
Series = dict[str, Float]


@dataclass(frozen=True)
class Span:
    """Compared part of a run [s], step of its records, part that is plotted, seeds, initial conditions."""

    begin: float
    end: float
    step: float
    shown: tuple[float, float]
    seeds: tuple[int, ...]
    start: Start | None = None


LONG = Span(100.0, 700.0, 0.05, (300.0, 360.0), (1, 2))
"""Of the folder of reference runs."""
SHORT = Span(20.0, 65.0, 0.1, (20.0, 65.0), (1,), Start(12.1 * np.pi / 30.0, np.radians(17.47), 43093.55, {}))
"""Of the package, from OpenFAST's initial conditions."""
BANDS = {"A": (1.5, 2.5, 3.5), "B": (1.5, 4.0, 5.0)}
"""[%] of mean, standard deviation and damage-equivalent load."""
CORRELATION = {
    "A": {"RootMyc1": 0.997, "RotSpeed": 0.998, "BldPitch1": 0.999},
    "B": {"RootMyc1": 0.993, "RotSpeed": 0.995, "BldPitch1": 0.998},
}
CHANNELS = (
    "GenPwr RotSpeed BldPitch1 RtFldFxh RootMyc1 RootMxc1 OoPDefl1 IPDefl1 TTDspFA TwrBsMyt YawBrMyp YawBrMzp TwrBsMxt"
).split()
WIDE = {"YawBrMzp": 10.0, "TwrBsMxt": 10.0}
"""[%] for the two channels that a weakly damped mode or a small mean make uncertain."""


def reference_series(folder: Path, name: str) -> Series:
    """Channels of a reference run in SI.

    Raises:
      InputError: the file is missing.
    """
    path = folder / "openfast/series" / f"{name}.npz"
    if not path.is_file():
        raise InputError(f"--reference {folder}: {path} is missing")
    with np.load(path) as z:
        return _si(z["channels"], z["units"], z["data"].astype(float))


def _si(names: NDArray[np.str_], units: NDArray[np.str_], data: Float) -> Series:
    return {str(c): data[:, i] * si_unit(str(u))[1] for i, (c, u) in enumerate(zip(names, units, strict=True))}


def short_series(aero: str) -> Series:
    """Channels of the reference run of a set, 20 to 65 s at 10 Hz, in SI."""
    z = thinned("turbulent_runs")
    counts = z[f"{aero}_counts"]
    time = {"Time": SHORT.begin + SHORT.step * np.arange(float(len(counts)))}
    return time | _si(z[f"{aero}_channels"], z[f"{aero}_units"], counts * z[f"{aero}_steps"])


def short_wind() -> WindBox:
    """Wind of these runs, 65 s of simulation."""
    return thinned_box("turbulent_wind", "vkm20_s1, thinned")


def thinned_box(name: str, source: str) -> WindBox:
    """Wind box from thinned data; outside the rotor's reach it is the mean of the other points."""
    z = thinned(name)
    dt, dy, dz, bottom, speed, step = map(float, z["grid"])
    counts = np.concatenate([z["first"][None], z["steps"]]).cumsum(axis=0)
    velocity = np.broadcast_to(counts.mean(axis=1)[:, None, None], (len(counts), *z["near"].shape, 3)).copy()
    velocity[:, z["near"]] = counts
    return WindBox((velocity * step).astype(np.float32), dt, dy, dz, bottom, speed, 90.0, source=source)


def turbulence(aero: str, folder: Path | None = None) -> CheckTable:
    """Means, standard deviations, equivalent loads and correlations in turbulence at 20 m/s, 14 %.

    Args:
      aero: set of options.
      folder: reference runs, two seeds of ten minutes; without it one seed of 45 s, which comes with the package.
    """
    span = LONG if folder else SHORT
    rows: list[Check] = []
    for seed in span.seeds:
        case = f"turb_vkm20_s{seed}"
        own, other = (
            reference_series(folder, f"{name}_{case}") if folder else short_series(name)
            for name in (aero, "BA"["AB".index(aero)])
        )
        wind = read_bts(folder / "openfast/wind" / f"vkm20_s{seed}.bts") if folder else short_wind()
        result = simulate(
            deck_model(aero), wind, duration=span.end, channels=CHANNELS, output_step=span.step, start=span.start
        )
        rows += _compare(aero, f"seed {seed}", span, result, own, other)
        if seed == 1:
            figure = _plot(result, own, aero, span.shown)
    boxes = "TurbSim boxes vkm20_s1 and _s2" if folder else "TurbSim box vkm20_s1, thinned"
    source = f"OpenFAST v5.0.0, set {aero}, {boxes}, {span.begin:g} to {span.end:g} s"
    title = f"Turbulence at 20 m/s against OpenFAST set {aero}" + ("" if folder else ", 45 s")
    name = f"turbulence {aero}" + ("" if folder else " short")
    return CheckTable(name, title, source, rows, figures={name.replace(" ", "_"): figure})


def _compare(aero: str, where: str, span: Span, ours: Result, own: Series, other: Series) -> list[Check]:
    inside = (own["Time"] >= span.begin - 1e-6) & (own["Time"] <= span.end + 1e-6)
    part = ours.between(span.begin, span.end)
    mean_band, std_band, load_band = BANDS[aero]
    rows: list[Check] = []
    for name in CHANNELS:
        x, y, z = part[name], own[name][inside], other[name][inside]
        channel = part.channel(name)
        unit, spread = channel.unit, float(y.std())
        wide = WIDE.get(name)
        rows.append(
            relative(f"{name} mean", where, unit, float(y.mean()), float(x.mean()), wide or mean_band, floor=spread)
        )
        rows.append(relative(f"{name} std", where, unit, spread, float(x.std()), wide or std_band))
        slope = usual_slope(channel)
        if slope is not None and name != "RtFldFxh":
            a, b = (damage_equivalent_load(s, duration=span.end - span.begin, slope=slope) for s in (x, y))
            rows.append(relative(f"{name} DEL", where, unit, b, a, wide or load_band))
        if name in CORRELATION[aero]:
            correlation = float(np.corrcoef(x, y)[0, 1])
            rows.append(at_least(f"{name} correlation", where, "-", CORRELATION[aero][name], correlation))
        near, far = (float(np.sqrt(np.mean((x - s) ** 2))) / spread for s in (y, z))
        closer = f"rms distance to set {aero} below that to the other set"
        rows.append(Check(closer, f"{name}, {where}", "-", far, near, max(0.0, near - far), "-", 0.0))
    return rows


def _plot(ours: Result, theirs: Series, aero: str, between: tuple[float, float]) -> Figure:
    names = ("RotSpeed", "BldPitch1", "RootMyc1", "TwrBsMyt", "TwrBsMxt")
    figure, axes = new_figure(len(names), size=(9.0, 8.0))
    shown = ours.between(*between)
    inside = (theirs["Time"] >= between[0]) & (theirs["Time"] <= between[1])
    for ax, name in zip(axes[:, 0], names, strict=True):
        unit, factor = find(name, standard()).display_unit
        label, time, series = f"OpenFAST, set {aero}", theirs["Time"][inside], theirs[name][inside]
        ax.plot(time, series * factor, color=COLOURS[1], lw=2.4, alpha=0.6, label=label)
        ax.plot(shown.time, shown[name] * factor, color=COLOURS[0], lw=0.8, label="meltemi")
        panel(ax, name, unit)
    axes[0, 0].legend(ncols=2, **ABOVE)
    axes[-1, 0].set_xlabel("time [s]")
    return figure
