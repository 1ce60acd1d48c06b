"""``meltemi hydro``: coefficients of potential flow about a platform."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np

from meltemi.app.signatures import POSITIVE, Range
from meltemi.app.terminal import OutOption, print_table, progress_bar, say, write_figure, wrote

PANELS = 1200
"""Panels by default, about."""
LISTED = (5.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0)
"""[s] periods of the printed table."""


def hydro(
    hull: Annotated[Path, "YAML file of the hull: depth, members, boxes."],
    panel: Annotated[float, "Size of the panels [m]; 0: for about 1200 panels.", Range(0)] = 0.0,
    frequencies: Annotated[int, "How many, equally spaced.", Range(10)] = 50,
    shortest: Annotated[float, "--shortest-period", "[s].", POSITIVE] = 2.5,
    step: Annotated[float, "--heading-step", "Between directions of waves [deg].", Range(0, 360, above=True)] = 10.0,
    out: OutOption = Path("out"),
) -> None:
    """Compute added mass, damping and excitation of a platform by Capytaine; writes files for ``coefficients:``."""
    from meltemi.core.extras import need
    from meltemi.core.yamlfile import read_record
    from meltemi.hydro.hull import Hull
    from meltemi.hydro.panels import contour, panels_of
    from meltemi.hydro.plots import plot_coefficients
    from meltemi.hydro.potential import change_by_panels, coefficients_of, hydrostatics, shortest_period
    from meltemi.hydro.wamit import wamit_texts

    need("meltemi hydro", "capytaine")
    record = read_record(hull, Hull)
    size = panel
    if not size > 0.0:
        low, high = record.bounds()
        size = float(np.sqrt(contour(record.distance, low, high, 0.05 * float(np.max(high - low))).area / PANELS))
    panels = panels_of(record, size)
    volume, centre, stiffness = hydrostatics(record, size)
    frequency = 2.0 * np.pi / shortest * np.arange(1, frequencies + 1) / frequencies
    heading = np.linspace(-180.0, 180.0, round(360.0 / step) + 1)
    say(f"{len(panels.faces)} panels of {size:.3g} m, {frequencies} periods from {shortest:g} s")
    with progress_bar("potential flow") as progress:
        c = coefficients_of(record, panels, frequency, heading, stiffness, progress)
    files = []
    for end, text in wamit_texts(c).items():
        files.append(out / f"{hull.stem}{end}")
        files[-1].write_text(text, encoding="utf-8")
    files.append(write_figure(out / f"{hull.stem}.png", plot_coefficients(hull.stem, c)))
    along = int(np.argmin(np.abs(heading)))
    rows = []
    for n in dict.fromkeys(int(np.argmin(np.abs(frequency - 2.0 * np.pi / T))) for T in LISTED):
        values = [*c.added_mass[n][[0, 2, 4], [0, 2, 4]], *np.abs(c.excitation[n, along][[0, 2, 4]])]
        rows.append([f"{2.0 * np.pi / frequency[n]:.1f}", *(f"{value:.4g}" for value in values)])
    head = ["period [s]", *(f"added {m} [{u}]" for m, u in (("surge", "m^3"), ("heave", "m^3"), ("pitch", "m^5")))]
    head += [f"excitation {m} [{u}]" for m, u in (("surge", "m^2"), ("heave", "m^2"), ("pitch", "m^3"))]
    print_table(f"{hull.stem}, over density (and gravity)", head, rows)
    mass, force = change_by_panels(record, c, size)
    say(
        f"volume: {volume:.6g}  # m^3\nbuoyancy_centre: [{centre[0]:.4f}, {centre[1]:.4f}]  # m\n"
        f"With panels 1.4 times as large added mass changes by {100.0 * mass:.2g} %, excitation by "
        f"{100.0 * force:.2g} % of its largest value.\n"
        "The error is about twice that, and falls with the size of the panels.\n"
        f"Waves have six panels or more along them from periods of {shortest_period(size):.2g} s."
    )
    wrote(*files)
