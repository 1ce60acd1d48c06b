"""Scene of a wind alone, without a turbine."""

from __future__ import annotations

from meltemi.core.errors import InputError
from meltemi.scene.air import CrossSection, wind_section
from meltemi.scene.record import Scene, track_arrays
from meltemi.turbulence.field import generate_field
from meltemi.turbulence.grid import WindGrid
from meltemi.wind.fields import SharedTurbulence, Wind, WindBox, WindSeries
from meltemi.wind.turbulent import TurbulentWind

POINTS, RATE, LONGEST = 15, 5.0, 600.0
"""Limits of the scene of a wind: points along each side, rate [Hz], and time that is drawn [s]."""
USUAL_HEIGHT, USUAL_SIZE = 90.0, 65.0
"""[m] hub height and half width at which a wind without grid is drawn."""
USUAL_DURATION = 60.0
"""[s] shown duration of a wind without end."""


def usual_field(wind: TurbulentWind) -> WindBox:
    """Field of a turbulent wind without turbine."""
    spacing = 2.0 * USUAL_SIZE / (wind.points - 1)
    grid = WindGrid(
        points_y=wind.points,
        points_z=wind.points,
        dy=spacing,
        dz=spacing,
        bottom=USUAL_HEIGHT - USUAL_SIZE,
        hub_height=USUAL_HEIGHT,
    )
    return generate_field(wind, grid, USUAL_DURATION)


def wind_scene(wind: Wind) -> Scene:
    """Scene of a wind alone, with the wind in the middle of the section as a plot: at most its first 600 s."""
    if isinstance(wind, SharedTurbulence):
        raise InputError("view: shared turbulence consists of a mean wind and a field: show one of them")
    if isinstance(wind, WindBox):
        height, up, across = 0.5 * (wind.bottom + wind.top), 0.5 * (wind.top - wind.bottom), 0.5 * wind.width
        begin, end = float(wind.passing[0]), float(wind.passing[-1])
    else:
        height, up, across = wind.reference_height or USUAL_HEIGHT, USUAL_SIZE, USUAL_SIZE
        begin, end = map(float, wind.time[[0, -1]]) if isinstance(wind, WindSeries) else (0.0, USUAL_DURATION)
    begin, end = max(begin, 0.0), min(max(end, begin + 1.0), max(begin, 0.0) + LONGEST)
    about, arrays = wind_section(wind, CrossSection(height, across, up, POINTS, 2.0 * across), begin, end, RATE)
    about["alone"] = True
    middle = POINTS // 2
    steps = {"wind": 1.0 / RATE}
    scene = Scene({"kind": "wind", "begin": begin, "duration": end - begin, "steps": steps, "wind": about}, arrays)
    series = scene.arrays["wind.amplitude"][:, middle, middle] * arrays["wind.scale"] + arrays["wind.mean"]
    if len(series) > 1:
        scene.about["plots"] = [
            {"title": f"Wind {name}, in the middle", "unit": "m/s", "lines": [{"name": name, "column": i}]}
            for i, name in enumerate(("downwind", "to the left", "up"))
        ]
        scene.about["steps"]["plot"] = 1.0 / RATE
        arrays |= track_arrays("plot", series.astype(float))
    return scene
