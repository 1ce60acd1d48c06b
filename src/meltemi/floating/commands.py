"""``meltemi rao``: response amplitude operators of a floating turbine."""

from __future__ import annotations

from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

import meltemi
from meltemi.app.signatures import POSITIVE, Range
from meltemi.app.terminal import OutOption, print_table, progress_bar, suggest, write_figure, wrote

if TYPE_CHECKING:
    from meltemi.floating.rao import Operators

LISTED = (5.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0, 30.0)
"""[s] periods of the printed table."""
SLOW = 1.0
"""[rad/s] highest frequency of the printed resonances, those of the platform."""


def rao(
    turbine: Annotated[str, "Floating turbine: library name or file."],
    wind_speed: Annotated[float, "[m/s]; 0: rotor at rest, blades feathered.", Range(0)] = 0.0,
    direction: Annotated[float, "Of the waves [deg], clockwise."] = 0.0,
    height: Annotated[float, "Significant, of the white-noise sea [m].", POSITIVE] = 2.0,
    duration: Annotated[float, "Of the run [s]; 0: linear model only.", Range(0)] = 3600.0,
    channels: Annotated[tuple[str, ...] | None, "Separated by commas [motions, tower base moment]."] = None,
    seed: Annotated[int, "Of the waves."] = 1,
    out: OutOption = Path("out"),
) -> None:
    """Find motions and loads per wave amplitude, from the linear model and from a run in a white-noise sea."""
    from meltemi.core.csvfile import write_columns
    from meltemi.floating.rao import CHANNELS, floater_of, linear_operators, random_operators
    from meltemi.floating.rao_plots import plot_operators, plot_radiation, shown_name

    names: Any = CHANNELS if channels is None else channels
    model = meltemi.build(meltemi.load_turbine(turbine))
    with progress_bar("linear model") as progress:
        linear = linear_operators(model, wind_speed, radians(direction), names, progress=progress)
    both: list[tuple[str, Operators, Any]] = [("linear", linear, None)]
    if duration > 0.0:
        with progress_bar("white-noise sea") as progress:
            run, coherence = random_operators(
                model, wind_speed, radians(direction), names, height=height, duration=duration, seed=seed,
                progress=progress,
            )  # fmt: skip
        both.append(("run", run, coherence))
    files = [
        write_columns(out / f"rao_{label}.csv", *columns(operators, coherence)) for label, operators, coherence in both
    ]
    files.append(write_figure(out / "rao.png", plot_operators(turbine, both)))
    platform = floater_of(model)
    figure = plot_radiation(turbine, platform.coefficients, platform.radiation)
    files.append(write_figure(out / "radiation.png", figure))
    silent = linear.silent()
    head, table = ["period [s]"], [[f"{period:g}" for period in LISTED]]
    for channel, value, (unit, factor) in zip(linear.channels, linear.value.T, linear.readable, strict=True):
        if channel in silent:
            continue
        sizes = factor * np.interp(2.0 * np.pi / np.array(LISTED), linear.frequency, np.abs(value))
        head.append(f"{shown_name(channel)} [{unit}/m]")
        table.append([f"{size:.4g}" for size in sizes])
    print_table(f"{turbine}, linear", head, [[*row] for row in zip(*table, strict=True)])
    if silent:
        words = ", ".join(map(shown_name, silent))
        print(f"negligible: {words} (in waves of 5 to 25 s below a thousandth of the largest of their unit)")
    slow = [f"{w / (2.0 * np.pi):.4g} Hz ({100.0 * d:.2g} %)" for w, d in linear.resonances if w < SLOW]
    print(f"resonances and damping ratios, without drag: {', '.join(slow) or 'none'}")
    print(f"radiation: {platform.radiation.words}")
    wrote(*files)
    suggest("run", turbine, "--wind-speed", wind_speed or 12, "--sea", "3,9", "--out", out)


def columns(operators: Operators, coherence: Any) -> tuple[list[tuple[str, str]], Any]:
    """Head and rows of a file: frequency, then amplitude, phase and coherence of each channel."""
    head, data = [("frequency", "Hz")], [operators.frequency / (2.0 * np.pi)]
    for k, (name, (unit, factor)) in enumerate(zip(operators.channels, operators.shown, strict=True)):
        head += [(name, f"{unit}/m"), (f"{name} phase", "deg")]
        data += [factor * np.abs(operators.value[:, k]), np.degrees(np.angle(operators.value[:, k]))]
        if coherence is not None:
            head.append((f"{name} coherence", "-"))
            data.append(coherence[:, k])
    return head, np.column_stack(data)
