"""Turbulence against OpenFAST, in the same wind box and under the same control law."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError
from meltemi.postprocess.fatigue import damage_equivalent_load, usual_slope
from meltemi.postprocess.files.openfast import si_unit
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure, style
from meltemi.simulation.channels import find, standard
from meltemi.simulation.result import Result
from meltemi.simulation.simulate import simulate
from meltemi.wind.files import read_bts
from meltemi_verification.steady import deck_model
from meltemi_verification.table import Comparison, Row, at_least, relative

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

BEGIN, END = 100.0, 700.0
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
SEEDS = (1, 2)


def reference_series(folder: Path, name: str) -> dict[str, Float]:
    """Channels of a reference run in SI.

    Raises:
      InputError: the file is missing.
    """
    path = folder / "openfast/series" / f"{name}.npz"
    if not path.is_file():
        raise InputError(f"--reference {folder}: {path} is missing")
    with np.load(path) as z:
        data = z["data"].astype(float)
        return {
            str(c): data[:, i] * si_unit(str(u))[1]
            for i, (c, u) in enumerate(zip(z["channels"], z["units"], strict=True))
        }


def turbulence(folder: Path, progress: Callable[[float], None] = lambda share: None) -> list[Comparison]:
    """Means, standard deviations, equivalent loads and correlations in turbulence at 20 m/s, 14 %."""
    results: dict[tuple[str, int], Result] = {}
    theirs: dict[tuple[str, int], dict[str, Float]] = {}
    for i, seed in enumerate(SEEDS):
        wind = read_bts(folder / "openfast/wind" / f"vkm20_s{seed}.bts")
        for j, aero in enumerate("AB"):
            theirs[aero, seed] = reference_series(folder, f"{aero}_turb_vkm20_s{seed}")
            done = (2 * i + j) / 4
            results[aero, seed] = simulate(
                deck_model(aero),
                wind,
                duration=END,
                channels=CHANNELS,
                progress=lambda share, done=done: progress(done + 0.25 * share),  # type: ignore[misc]
            )
    tables = []
    for aero in "AB":
        rows: list[Row] = []
        for seed in SEEDS:
            rows += _compare(aero, seed, results[aero, seed], theirs[aero, seed], theirs["BA"["AB".index(aero)], seed])
        figure = {f"turbulence_{aero}": _plot(results[aero, 1], theirs[aero, 1], aero)}
        source = f"OpenFAST v5.0.0, set {aero}, TurbSim boxes vkm20_s1 and _s2, {BEGIN:g} to {END:g} s"
        title = f"Turbulence at 20 m/s against OpenFAST set {aero}"
        tables.append(Comparison(f"turbulence {aero}", title, source, rows, figures=figure))
    return tables


def _compare(aero: str, seed: int, ours: Result, own: dict[str, Float], other: dict[str, Float]) -> list[Row]:
    inside = (own["Time"] >= BEGIN - 1e-6) & (own["Time"] <= END + 1e-6)
    part = ours.between(BEGIN, END)
    mean_band, std_band, load_band = BANDS[aero]
    where = f"seed {seed}"
    rows: list[Row] = []
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
            a, b = (damage_equivalent_load(s, duration=END - BEGIN, slope=slope) for s in (x, y))
            rows.append(relative(f"{name} DEL", where, unit, b, a, wide or load_band))
        if name in CORRELATION[aero]:
            correlation = float(np.corrcoef(x, y)[0, 1])
            rows.append(at_least(f"{name} correlation", where, "-", CORRELATION[aero][name], correlation))
        near, far = (float(np.sqrt(np.mean((x - s) ** 2))) / spread for s in (y, z))
        closer = f"rms distance to set {aero} below that to the other set"
        rows.append(Row(closer, f"{name}, {where}", "-", far, near, max(0.0, near - far), "-", 0.0))
    return rows


def _plot(ours: Result, theirs: dict[str, Float], aero: str) -> Figure:
    names = ("RotSpeed", "BldPitch1", "RootMyc1", "TwrBsMyt", "TwrBsMxt")
    figure, axes = new_figure(len(names), size=(9.0, 8.0))
    shown = ours.between(300.0, 360.0)
    inside = (theirs["Time"] >= 300.0) & (theirs["Time"] <= 360.0)
    for ax, name in zip(axes[:, 0], names, strict=True):
        unit, factor = find(name, standard()).display_unit
        label, time, series = f"OpenFAST, set {aero}", theirs["Time"][inside], theirs[name][inside]
        ax.plot(time, series * factor, color=COLOURS[1], lw=1.6, label=label)
        ax.plot(shown.time, shown[name] * factor, color=COLOURS[0], lw=0.8, label="meltemi")
        ax.set_ylabel(f"{name} [{unit}]", fontsize=8)
        style(ax)
    axes[0, 0].legend(fontsize=8, ncols=2)
    axes[-1, 0].set_xlabel("time [s]")
    return figure
