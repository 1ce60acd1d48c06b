"""Figures of a wind: time series, spectra, coherence, cross-sections, profiles.

Dashed lines are the targets: the properties that a turbulent wind was specified with.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

from meltemi.core.errors import InputError
from meltemi.report.palette import COLOURS, FAINT, INK, SOFT
from meltemi.report.plots import ABOVE, ON_TOP, figure_title, heading, new_figure, note, panel
from meltemi.turbine.power_turbine import AnyTurbine
from meltemi.turbulence.field import generate_field, mean_profile
from meltemi.turbulence.grid import WindGrid
from meltemi.turbulence.statistics import COMPONENTS, field_statistics, hub_point, wind_coherence, wind_spectrum
from meltemi.turbulence.targets import sigmas, target_coherence, target_densities
from meltemi.wind.fields import SharedTurbulence, SteadyWind, WindBox, WindSeries
from meltemi.wind.turbulent import AnyWind, TurbulentWind

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

NAMES = {"u": "u, along the wind", "v": "v, to the left", "w": "w, upwards"}
TARGET: dict[str, Any] = {"color": INK, "linestyle": (0, (4, 2)), "linewidth": 1.1}
SHARES = (0.1, 0.25, 0.5, 0.9)
"""Separations of a coherence plot over the width and height of the field."""
STRETCH = 10.0
"""Length of a picture along the wind over the width of the field."""
TWO_THIRDS = (0.16, 0.84)
"""Quantiles between which two thirds of spectral estimates lie."""


def _title(figure: Figure, label: str, what: str = "") -> None:
    """Figure title: label of the wind, shortened to the width, and the content."""
    figure_title(figure, label, what, int(11.0 * figure.get_figwidth()))


def _profile_panel(ax: Axes, what: str, x: str) -> None:
    """Set title and abscissa of a panel over height."""
    heading(ax, what)
    ax.set_xlabel(x)


def plot_wind(
    wind: AnyWind, turbine: AnyTurbine | None = None, *, target: TurbulentWind | None = None, duration: float = 600.0
) -> dict[str, Figure]:
    """All figures that apply to the kind of wind, by name.

    Of a field: ``series``, ``spectra``, ``coherence``, ``section`` and ``profile``; of a series: ``series``; of a
    steady wind: ``profile``.

    Args:
      wind: any wind; for a turbulent wind the field is generated first, with the wind itself as target.
      turbine: its rotor is drawn; the wind is evaluated at its hub height.
      target: wind whose properties the field should have.
      duration: [s] of the simulation for which the field of a turbulent wind is generated.

    Raises:
      InputError: a turbulent wind without a turbine, or a turbine whose hub lies outside the field.
    """
    if isinstance(wind, TurbulentWind):
        if turbine is None:
            raise InputError("plot_wind: a turbulent wind requires a turbine, for which its field is generated")
        target, wind = wind, generate_field(wind, turbine, duration)
    if isinstance(wind, SharedTurbulence):
        raise InputError("plot_wind: shared turbulence consists of a mean wind and a field: plot one of them")
    if isinstance(wind, WindSeries):
        return {"series": plot_series(wind)}
    if isinstance(wind, SteadyWind):
        return {"profile": plot_profile(wind, turbine)}
    return {
        "series": plot_hub(wind, turbine),
        "spectra": plot_spectra(wind, turbine, target),
        "coherence": plot_coherence(wind, turbine, target),
        "section": plot_section(wind, turbine),
        "profile": plot_profile(wind, turbine, target),
    }


def _hub(box: WindBox, turbine: AnyTurbine | None) -> float:
    """[m] hub height used for the plots of a field."""
    row, _ = hub_point(box, turbine.hub_height if turbine else None)
    return box.bottom + row * box.dz


def plot_hub(box: WindBox, turbine: AnyTurbine | None = None) -> Figure:
    """Plot the components at the hub over the time of passage, with means and standard deviations.

    Args:
      box: a field.
      turbine: gives the hub height; by default that of the box.

    Raises:
      InputError: the hub lies outside the field.
    """
    statistics = field_statistics(box, _hub(box, turbine))
    time = _passing(box)
    figure, axes = new_figure(3, size=(9.0, 5.6))
    for c, (name, ax) in enumerate(zip(COMPONENTS, axes[:, 0], strict=True)):
        mean, std = (
            float(statistics.mean[statistics.row, statistics.column, c]),
            float(statistics.std[statistics.row, statistics.column, c]),
        )
        ax.axhspan(mean - std, mean + std, color=COLOURS[c], alpha=0.13, linewidth=0.0)
        ax.plot(time, box.velocity[:, statistics.row, statistics.column, c], linewidth=0.7, color=COLOURS[c])
        ax.axhline(mean, color=INK, linewidth=0.9)
        panel(ax, NAMES[name], "m/s")
        heading(ax, f"mean {_clean(mean):.2f} m/s, standard deviation {std:.2f} m/s", "right", 8)
    axes[-1, 0].set_xlim(time[0], time[-1])
    axes[-1, 0].set_xlabel("time [s]")
    _title(figure, box.label, f", at {statistics.height:.1f} m")
    return figure


def _passing(box: WindBox) -> Float:
    """(T,) [s] at which the planes pass the tower."""
    time: Float = box.dt * np.arange(len(box.velocity), dtype=np.float64) - 0.5 * box.width / box.speed
    return time


def _clean(value: float) -> float:
    """Remove the sign of a negative zero."""
    return value if abs(value) >= 0.005 else 0.0


def plot_spectra(box: WindBox, turbine: AnyTurbine | None = None, target: TurbulentWind | None = None) -> Figure:
    """Plot spectra f S of the components at the hub and averaged over the grid, with their targets.

    Two thirds of the estimates at one point scatter within the band about the target; without one, the band about the
    hub's estimates holds the truth as often. A field that was scaled to its standard deviation has the target's shape,
    shifted as a whole.

    Args:
      box: a field.
      turbine: gives the hub height; by default that of the box.
      target: wind whose properties the field should have.

    Raises:
      InputError: the hub lies outside the field, or it has fewer than 4 planes.
    """
    height = _hub(box, turbine)
    figure, axes = new_figure(1, 3, size=(12.0, 4.3))
    finest = box.speed / (2.0 * max(box.dy, box.dz))
    levels = []
    for c, (name, ax) in enumerate(zip(COMPONENTS, axes[0], strict=True)):
        grid = wind_spectrum(box, name, where="grid")
        hub = wind_spectrum(box, name, hub_height=height)
        low, high = (gammaincinv(hub.count, share) / hub.count for share in TWO_THIRDS)
        if target is None:  # where the truth is
            low, high = hub.density / high, hub.density / low
        else:  # where estimates are
            low, high = (x * target_densities(target, height, hub.f)[c] for x in (low, high))
        look: dict[str, Any] = {"color": COLOURS[c]}
        band = {"alpha": 0.17, "linewidth": 0.0, "label": "two thirds of samples"}
        ax.fill_between(hub.f, hub.f * low, hub.f * high, **look, **band)
        ax.plot(hub.f, hub.f * hub.density, **look, linewidth=0.8, marker="o", markersize=2.5, label="hub")
        ax.plot(grid.f, grid.f * grid.density, **look, linewidth=1.8, label="mean over the grid")
        levels.append(grid.f * grid.density)
        if target is not None:
            f = np.geomspace(hub.f[0], hub.f[-1], 200)
            wanted = target_densities(target, height, f)[c]
            ax.plot(f, f * wanted, label="target", **TARGET)
            levels.append(f * wanted)
        if hub.f[0] < finest < hub.f[-1]:
            ax.axvline(finest, color=FAINT, linewidth=0.9, linestyle=":")
            text = f"eddies of two\ngrid steps, {2.0 * max(box.dy, box.dz):.3g} m"
            note(ax, text, (finest, 0.02), (-3, 2), ha="right", **ON_TOP)
        if np.any(hub.density > 0.0):
            ax.set_xscale("log")
            ax.set_yscale("log")
        panel(ax, NAMES[name], "m²/s²", "frequency [Hz]")
        ax.legend(loc="upper right")
    together = np.concatenate(levels)
    if np.any(together > 0.0):
        top = float(together.max())
        lowest = float(np.quantile(together[together > 0.0], 0.01))
        for ax in axes[0]:
            ax.set_ylim(max(0.4 * lowest, 1e-4 * top), 4.0 * top)
    _title(figure, box.label, f": f S(f) at {height:.1f} m and over the grid")
    return figure


def plot_coherence(
    box: WindBox,
    turbine: AnyTurbine | None = None,
    target: TurbulentWind | None = None,
    separations: Sequence[float] | None = None,
) -> Figure:
    """Plot the coherence of the components at four lateral and four vertical separations, with its target.

    Args:
      box: a field.
      turbine: gives the hub height; by default that of the box.
      target: wind whose properties the field should have.
      separations: [m] instead of a tenth, a quarter, half and most of the field's width and height.

    Raises:
      InputError: a separation does not fit into the field.
    """
    from matplotlib.lines import Line2D

    height = _hub(box, turbine)
    sizes = {"lateral": (box.width, box.dy), "vertical": (box.top - box.bottom, box.dz)}
    figure, axes = new_figure(2, 3, size=(12.0, 6.8))
    n = len(box.velocity)
    f = np.geomspace(1.0 / (n * box.dt), n // 2 / (n * box.dt), 50)
    for row, (direction, (size, step)) in enumerate(sizes.items()):
        wanted = separations if separations is not None else [max(s * size, step) for s in SHARES]
        targets: dict[float, Float] = {}
        for c, (name, ax) in enumerate(zip(COMPONENTS, axes[row], strict=True)):
            measured = wind_coherence(box, name, wanted, direction=direction, per_decade=6)  # type: ignore[arg-type]
            for i, r in enumerate(measured.separation):
                colour = COLOURS[i % len(COLOURS)]
                look: dict[str, Any] = {"color": colour, "linewidth": 1.3, "marker": "o", "markersize": 2.5}
                ax.plot(measured.f, measured.coherence[i], **look, label=f"{r:.3g} m")
                if target is not None:
                    if r not in targets:
                        apart = (r, 0.0) if direction == "lateral" else (0.0, r)
                        targets[r] = target_coherence(target, height, f, *apart)
                    ax.plot(f, targets[r][c], **{**TARGET, "color": colour})
            ax.set_xscale("log")
            ax.set_ylim(-0.5, 1.05)
            ax.axhline(0.0, color=INK, linewidth=0.7)
            panel(ax, f"{name}, {direction} separation", "-", "frequency [Hz]" if row == 1 else "")
        handles, _ = axes[row, 2].get_legend_handles_labels()
        if target is not None:
            handles.append(Line2D([], [], label="target", **TARGET))
        look = {"fontsize": 7, "title_fontsize": 7, "loc": "upper right"}
        axes[row, 2].legend(handles=handles, title=f"{direction} separation", **look)
    _title(figure, box.label, ": real part of the coherence, mean of all pairs")
    return figure


def plot_section(box: WindBox, turbine: AnyTurbine | None = None, time: float | None = None) -> Figure:
    """Plot the longitudinal component in a cross-section at one instant, and in a plan view at hub height.

    Time is distance there: what passes later lies upwind. It is stretched across the wind.

    Args:
      box: a field.
      turbine: its rotor and hub are drawn.
      time: [s] at which the section passes the tower; by default that of the strongest wind averaged over the rotor, or
        over the grid if there is no turbine.

    Raises:
      InputError: the hub lies outside the field, or the time outside its duration.
    """
    height = _hub(box, turbine)
    row, _ = hub_point(box, height)
    passing = _passing(box)
    y = box.dy * np.arange(box.velocity.shape[2]) - 0.5 * box.width
    z = box.bottom + box.dz * np.arange(box.velocity.shape[1])
    if time is None:
        inside = np.ones((len(z), len(y)), bool)
        if turbine is not None:
            inside = np.hypot(y, (z - turbine.hub_height)[:, None]) <= 0.5 * turbine.rotor_diameter
        plane = int(np.argmax(box.velocity[:, inside, 0].mean(axis=1)))
    elif passing[0] <= time <= passing[-1]:
        plane = round((time - passing[0]) / box.dt)
    else:
        raise InputError(
            f"{box.label}: {time:g} s lies outside the field, which passes from {passing[0]:g} s to {passing[-1]:g} s"
        )
    x = box.speed * (passing[plane] - passing)
    shown = np.flatnonzero(np.abs(x) <= 0.5 * STRETCH * box.width)
    along, across = box.velocity[shown, row, :, 0], box.velocity[plane, :, :, 0]
    low, high = np.quantile(np.concatenate([along.ravel(), across.ravel()]), [0.005, 0.995])
    figure, _ = new_figure(1, size=(12.0, 4.4))
    figure.clear()
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 2.1))
    look = {"shading": "gouraud", "cmap": "viridis", "vmin": low, "vmax": max(high, low + 1e-6), "rasterized": True}
    left.pcolormesh(y, z, across, **look)
    left.invert_xaxis()
    left.set_aspect("equal")
    left.set_xlabel("y [m], looking downwind")
    left.set_ylabel("height [m]")
    heading(left, f"u across the wind at {passing[plane]:.1f} s")
    image = right.pcolormesh(x[shown], y, along.T, **look)
    right.set_xlabel("x [m], from the section; wind from left to right")
    right.set_ylabel("y [m]")
    heading(right, f"u at {z[row]:.1f} m, seen from above")
    if turbine is not None:
        radius, hub = 0.5 * turbine.rotor_diameter, turbine.hub_height
        angle = np.linspace(0.0, 2.0 * np.pi, 181)
        left.plot(radius * np.cos(angle), hub + radius * np.sin(angle), color="white", linewidth=1.5, label="rotor")
        left.plot([0.0], [hub], marker="+", markersize=9, color="white", linestyle="", label="hub")
        right.plot([0.0, 0.0], [-radius, radius], color="white", linewidth=2.5, label="rotor")
    else:
        right.axvline(0.0, color="white", linewidth=0.9, linestyle="--")
    figure.colorbar(image, ax=[left, right], label="u [m/s]", pad=0.01, extend="both")
    _title(figure, box.label)
    return figure


def plot_profile(
    wind: WindBox | SteadyWind, turbine: AnyTurbine | None = None, target: TurbulentWind | None = None
) -> Figure:
    """Plot mean horizontal speed and direction over height; for a field also the turbulence intensity.

    Args:
      wind: a field, or a steady wind.
      turbine: its rotor is shaded; gives the hub height.
      target: wind whose properties the field should have.

    Raises:
      InputError: the hub lies outside the field.
    """
    field = isinstance(wind, WindBox)
    figure, axes = new_figure(1, 3 if field else 2, size=(12.0 if field else 8.0, 4.2), share=False)
    speed_panel, direction_panel = axes[0, 0], axes[0, 1]
    if isinstance(wind, WindBox):
        statistics = field_statistics(wind, _hub(wind, turbine))
        z = wind.bottom + wind.dz * np.arange(len(statistics.mean))
        mean = statistics.mean.mean(axis=1)
        speed, direction = np.hypot(mean[:, 0], mean[:, 1]), wind.direction - np.arctan2(mean[:, 1], mean[:, 0])
        each = np.hypot(statistics.mean[..., 0], statistics.mean[..., 1])
        speed_panel.fill_betweenx(z, each.min(axis=1), each.max(axis=1), color=COLOURS[0], alpha=0.2, linewidth=0.0)
        intensity_panel = axes[0, 2]
        for c, name in enumerate(COMPONENTS):
            share = 100.0 * statistics.intensity[..., c]
            look: dict[str, Any] = {"color": COLOURS[c], "alpha": 0.2, "linewidth": 0.0}
            intensity_panel.fill_betweenx(z, share.min(axis=1), share.max(axis=1), **look)
            intensity_panel.plot(share.mean(axis=1), z, color=COLOURS[c], label=name)
        if target is not None:
            for sigma in sigmas(target):
                intensity_panel.axvline(100.0 * sigma / target.speed, **TARGET)
        intensity_panel.set_xlim(left=0.0)
        title = "turbulence intensity, range of a row"
        _profile_panel(intensity_panel, title, "standard deviation over speed at hub [%]")
        intensity_panel.legend()
        if target is not None:
            described = WindGrid(
                points_y=2,
                points_z=max(len(z), 2),
                dy=wind.width,
                dz=wind.dz,
                bottom=wind.bottom,
                hub_height=min(max(turbine.hub_height if turbine else statistics.height, wind.bottom), wind.top),
            )
            wanted = mean_profile(target, described)
            speed_panel.plot(np.hypot(wanted[:, 0], wanted[:, 1]), z, label="target", zorder=3, **TARGET)
            turned = target.direction - np.arctan2(wanted[:, 1], wanted[:, 0])
            direction_panel.plot(np.degrees(turned), z, label="target", zorder=3, **TARGET)
            direction_panel.legend()
    else:
        z, speed, direction = _steady_profile(wind, turbine)
    label = "mean of a row, and the range of its points" if field else None
    speed_panel.plot(speed, z, color=COLOURS[0], label=label)
    if field:
        speed_panel.legend(loc="upper left")
    _profile_panel(speed_panel, "mean speed", "horizontal speed [m/s]")
    direction_panel.plot(np.degrees(direction), z, color=COLOURS[0])
    middle, half = np.degrees(0.5 * (direction.min() + direction.max())), np.degrees(0.5 * np.ptp(direction))
    direction_panel.set_xlim(middle - max(1.1 * half, 5.0), middle + max(1.1 * half, 5.0))
    _profile_panel(direction_panel, "mean direction", "direction, clockwise from above [deg]")
    for ax in axes[0]:
        ax.set_ylim(0.0, float(z[-1]))
        ax.set_ylabel("height [m]")
        if turbine is not None:
            radius = 0.5 * turbine.rotor_diameter
            ax.axhspan(turbine.hub_height - radius, turbine.hub_height + radius, color=FAINT, alpha=0.12, linewidth=0.0)
            ax.axhline(turbine.hub_height, color=FAINT, linewidth=0.8)
    _title(figure, wind.label, ": the rotor is shaded" if turbine is not None else "")
    return figure


def _steady_profile(wind: SteadyWind, turbine: AnyTurbine | None) -> tuple[Float, Float, Float]:
    """Height, speed and direction of a steady wind, evaluated as in a simulation."""
    hub = turbine.hub_height if turbine is not None else wind.reference_height or 100.0
    reference = wind.reference_height or hub
    top = hub + (0.6 * turbine.rotor_diameter if turbine is not None else hub)
    z = np.linspace(0.01 * top, top, 200)
    if wind.roughness > 0.0:
        shape = np.maximum(1.0 + np.log(z / reference) / np.log(reference / wind.roughness), 0.0)
    else:
        shape = (z / reference) ** wind.shear_exponent
    return z, wind.speed * shape, wind.direction + wind.veer * (z - reference)


def plot_series(wind: WindSeries) -> Figure:
    """Plot the speed of a uniform wind over time, and what else of direction, vertical speed and shear changes.

    What is constant is written below.

    Args:
      wind: a series.
    """
    shear = {
        "exponent of the power law": wind.exponent,
        "linear vertical shear": wind.vertical_shear,
        "linear horizontal shear": wind.horizontal_shear,
    }
    panels: list[tuple[str, str, dict[str, Float]]] = [
        ("speed, gust included" if np.any(wind.gust) else "speed", "m/s", {"": wind.speed + wind.gust}),
        ("direction, clockwise from above", "deg", {"": np.degrees(wind.direction)}),
        ("vertical speed", "m/s", {"": wind.vertical}),
        ("shear", "-", shear),
    ]
    shown = [i for i, (_, _, lines) in enumerate(panels) if i == 0 or not all(map(_constant, lines.values()))]
    fixed = [
        f"{label or what.partition(',')[0]} {_clean(float(values[0])):.4g} {unit.strip('-')}".strip()
        for i, (what, unit, lines) in enumerate(panels)
        for label, values in lines.items()
        if i not in shown
    ]
    figure, axes = new_figure(len(shown), size=(9.0, 1.0 + 1.4 * max(len(shown), 2)))
    for i, ax in zip(shown, axes[:, 0], strict=True):
        what, unit, lines = panels[i]
        for j, (label, values) in enumerate(lines.items()):
            colour = COLOURS[i] if len(lines) == 1 else COLOURS[j]
            ax.plot(wind.time, values, linewidth=1.2, color=colour, label=label or None)
        panel(ax, what, unit)
        together = np.concatenate(list(lines.values()))
        low, high = float(together.min()), float(together.max())
        ax.margins(y=0.3 if len(lines) > 1 else 0.1)
        if _constant(together):  # and no noise
            ax.set_ylim(low - max(0.1 * abs(low), 1.0), high + max(0.1 * abs(high), 1.0))
        elif len(lines) == 1:
            heading(ax, f"from {_clean(low):.4g} to {_clean(high):.4g} {unit}", "right", 8)
        if len(lines) > 1:
            ax.legend(ncols=3, **ABOVE)
    axes[-1, 0].set_xlabel("time [s]")
    if fixed:
        figure.supxlabel(f"constant: {', '.join(fixed)}", x=0.01, ha="left", fontsize=8, color=SOFT)
    _title(figure, wind.label)
    return figure


def _constant(values: Float) -> bool:
    low, high = float(values.min()), float(values.max())
    return high - low < 1e-9 * max(abs(high), 1.0)
