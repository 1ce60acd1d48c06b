"""Periodic operation in shear and yaw against OpenFAST."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from comparisons import reference_table, source_of
from comparisons.measure import harmonic
from meltemi.postprocess.statistics import azimuth_bins
from meltemi.report.palette import COLOURS
from meltemi.report.plots import ABOVE, new_figure, panel
from meltemi.simulation.simulate import simulate
from meltemi.verification.steady import deck_model
from meltemi.verification.table import Check, CheckTable, phase, relative
from meltemi.wind.fields import SteadyWind

PSI = np.radians(5.0 + 10.0 * np.arange(36.0))
"""Azimuths of the reference runs."""
PERIODIC = {
    "shear_8": SteadyWind(speed=8.0, shear_exponent=0.2),
    "shear_12": SteadyWind(speed=12.0, shear_exponent=0.2),
    "shear_20": SteadyWind(speed=20.0, shear_exponent=0.2),
    "yaw20_10": SteadyWind(speed=10.0, direction=float(np.radians(20.0))),
}


def _words(case: str) -> str:
    kind, speed = case.split("_")
    return f"{'shear' if kind == 'shear' else 'yaw 20 deg'}, {speed} m/s"


def periodic(aero: str, cases: Sequence[str]) -> CheckTable:
    """First harmonic over the azimuth of root moments and tip deflection in shear and in yaw."""
    rows: list[Check] = []
    figure, axes = new_figure(len(cases), 2, size=(9.0, 2.2 * len(cases) + 0.5))
    for i, name in enumerate(cases):
        result = simulate(
            deck_model(aero), PERIODIC[name], duration=90.0, channels=["azimuth", "RootMyc1", "RootMxc1", "OoPDefl1"]
        ).between(30.0, 90.0)
        for channel in ("RootMyc1", "RootMxc1", "OoPDefl1"):
            table = reference_table("azimuth", case=f"{aero}_{name}", channel=channel)
            theirs = np.array([float(r["value"]) for r in table])
            ours = azimuth_bins(result, channel)
            mean, amplitude, lag = harmonic(PSI, theirs)
            mean_ours, amplitude_ours, lag_ours = harmonic(PSI, ours)
            unit = result.channel(channel).unit
            rows.append(relative(f"{channel} mean", name, unit, mean, mean_ours, 3.0 if "Defl" in channel else 2.0))
            rows.append(relative(f"{channel} amplitude", name, unit, amplitude, amplitude_ours, 5.0))
            rows.append(phase(f"{channel} phase", name, lag, lag_ours, 10.0))
            if "Mxc" not in channel:
                ax = axes[i, 0 if channel == "RootMyc1" else 1]
                label, factor = result.channel(channel).display_unit
                ax.plot(np.degrees(PSI), ours * factor, color=COLOURS[0], label="meltemi")
                ax.plot(np.degrees(PSI), theirs * factor, "o", ms=3, mfc="none", color=COLOURS[1], label="OpenFAST")
                panel(ax, f"{channel}, {_words(name)}", label)
    for ax in axes[-1]:
        ax.set_xlabel("azimuth of blade 1 [deg]")
    axes[0, 0].legend(ncols=2, **ABOVE)
    title = f"Over the azimuth, in shear and in yaw, against OpenFAST set {aero}"
    return CheckTable(f"periodic {aero}", title, source_of("azimuth"), rows, figures={f"periodic_{aero}": figure})
