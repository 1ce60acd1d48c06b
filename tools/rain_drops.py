"""Draw what rain takes from two rotors, drop by drop and by the review, for the docs:  python tools/rain_drops.py"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from meltemi.environment.rain import RAIN_CLASSES, Rain, rain_parameters, rain_power_loss
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure
from meltemi.studies.rain_drops import drops_energy, rain_loads
from meltemi.turbine.library import load_turbine

IMAGES = Path(__file__).parents[1] / "docs" / "images"
WIND = 10.0
POINTS = {"nrel5mw": (1.2049, 0.0, 3.72e6), "iea22mw": (0.6734, -0.01745, 17.08e6)}
"""[rad/s], [rad] and [W] of steady operation of rigid blades in this wind."""


def main() -> None:
    """Power against the rate of rain."""
    figure, axes = new_figure(1, 2, size=(8.4, 4.0))
    rates = np.geomspace(1.0, 1000.0, 40)
    for ax, (name, (omega, pitch, power)) in zip(axes[0], POINTS.items(), strict=True):
        turbine = load_turbine(name)
        radius = turbine.rotor_radius
        rains = [Rain(rate=float(rate)) for rate in rates]

        def review(rain: Rain, radius: float = radius) -> float:
            return rain_power_loss(rain_parameters(rain, radius), WIND)

        curves = {
            "review, one diameter of 3 mm": ([review(r.replace(mode="seed")) for r in rains], "-", 1),
            "review, integrated": ([review(r) for r in rains], "--", 1),
            "drops on blades": ([rain_loads(turbine, r, WIND, omega, pitch).power for r in rains], "-", 0),
            "same, water runs to the tips": (
                [rain_loads(turbine, r, WIND, omega, pitch, film="to_tip").power for r in rains],
                ":",
                0,
            ),
            "kinetic energy of the drops": ([drops_energy(r, WIND, radius) for r in rains], "-", 2),
        }
        for label, (loss, line, colour) in curves.items():
            ax.loglog(rates, np.array(loss) / 1e3, line, color=COLOURS[colour], linewidth=1.4, label=label)
        ax.axhline(power / 1e3, color="k", linewidth=0.8)
        ax.text(1.05, power / 1e3 * 1.15, "power in dry air", fontsize=8)
        for rate in RAIN_CLASSES.values():
            ax.axvline(rate, color="0.85", linewidth=0.6, zorder=0)
        ax.set_title(f"{turbine.name}, {WIND:g} m/s")
        ax.set_xlabel("rain [mm/h]")
        ax.set_ylabel("power [kW]")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    figure.savefig(IMAGES / "rain_power.png", dpi=110)


if __name__ == "__main__":
    main()
