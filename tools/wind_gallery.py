"""Draw turbulent fields, their spectra and coherence for the docs:  python tools/wind_gallery.py"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.report.palette import COLOURS, INK
from meltemi.report.plots import new_figure
from meltemi.turbulence import mann
from meltemi.turbulence.field import generate_field, mean_profile
from meltemi.turbulence.grid import WindGrid
from meltemi.turbulence.spectra import coherence_decay, scale_parameter
from meltemi.turbulence.targets import target_densities
from meltemi.wind.turbulent import TurbulentWind

IMAGES = Path(__file__).parents[1] / "docs" / "images"
MODELS = {"kaimal": "Kaimal", "vonkarman": "von Karman", "mann": "Mann"}
SPEED, INTENSITY, DURATION, DT, SEEDS = 12.0, 0.14, 600.0, 0.25, 30
GRID = WindGrid(points_y=9, points_z=9, dy=15.0, dz=15.0, bottom=30.0, hub_height=90.0)
FINE = WindGrid(points_y=51, points_z=49, dy=3.0, dz=3.0, bottom=9.0, hub_height=90.0)
Complex = NDArray[np.complex128]
Float = NDArray[np.float64]


def wind(spectrum: str, seed: int, **options: Any) -> TurbulentWind:
    settings = {"speed": SPEED, "intensity": INTENSITY, "dt": DT, "scaled": False, "periodic": True}
    edition = 2 if spectrum == "vonkarman" else 3
    return TurbulentWind.model_validate(settings | {"spectrum": spectrum, "edition": edition, "seed": seed} | options)


def amplitudes(spectrum: str) -> Complex:
    """(S, B, Z, Y, 3) of an ensemble."""
    made = []
    for seed in range(1, SEEDS + 1):
        setup = wind(spectrum, seed)
        fluctuation = (
            generate_field(setup, GRID, DURATION).velocity - mean_profile(setup, GRID.z, GRID.hub_height)[:, None]
        )
        made.append(np.fft.rfft(fluctuation, axis=0, norm="forward")[1:-1].astype(np.complex64))
    return np.array(made)


def bands(count: int, per_decade: int) -> list[slice]:
    """Numbers of frequencies, in groups of about equal width in the logarithm."""
    edges = np.unique(np.round(np.geomspace(1, count, round(per_decade * np.log10(count)) + 1)).astype(int))
    return [slice(a - 1, b - 1) for a, b in pairwise(edges)]


def draw_spectra(found: dict[str, Complex], f: Float) -> None:
    figure, axes = new_figure(1, 3, size=(10.5, 3.7))
    for ax, (spectrum, name) in zip(axes[0], MODELS.items(), strict=True):
        power = 2.0 * DURATION * np.mean(np.abs(found[spectrum]) ** 2, axis=(0, 2, 3))
        target = target_densities(wind(spectrum, 1), GRID.hub_height, f)
        some = bands(len(f), 9)
        middle = np.array([np.exp(np.log(f[b]).mean()) for b in some])
        for c, component in enumerate("uvw"):
            ax.loglog(f, f * target[c], color=COLOURS[c], linewidth=1.3)
            values = [np.mean(f[b] * power[b, c]) for b in some]
            ax.loglog(middle, values, "o", color=COLOURS[c], markersize=3.6, markerfacecolor="white", label=component)
        if spectrum == "mann":
            ax.loglog(f, -f * target[3], color=COLOURS[4], linewidth=1.3)
            cross = (found[spectrum][..., 0] * found[spectrum][..., 2].conj()).real.mean(axis=(0, 2, 3))
            values = [-2.0 * DURATION * np.mean(f[b] * cross[b]) for b in some]
            ax.loglog(middle, values, "o", color=COLOURS[4], markersize=3.6, markerfacecolor="white", label="-uw")
        x = np.array([0.5, 1.6])
        ax.loglog(x, 1.1 * (x / x[0]) ** (-2 / 3), color=INK, linewidth=0.9)
        ax.text(0.9, 0.85, "slope -2/3", fontsize=7.5, color=INK)
        ax.set(xlim=(1.4e-3, 2.2), ylim=(4e-3, 1.6))
        ax.set_title(name)
        ax.set_xlabel("frequency f [Hz]")
        ax.legend(loc="lower center", ncols=4, handletextpad=0.1, columnspacing=1.0)
    axes[0, 0].set_ylabel("f S(f) [m$^2$/s$^2$]")
    save(figure, "wind_spectra.png")


def coherence(c: Complex, steps: int) -> Float:
    """(B, 3) real part of the cross-spectrum over the spectrum, all lateral pairs so far apart."""
    pair = (c[:, :, :, steps:] * c[:, :, :, :-steps].conj()).real
    return np.stack([pair.mean(axis=(0, 2, 3)), (np.abs(c) ** 2).mean(axis=(0, 2, 3))])


def mann_coherence(f: Float, steps: list[int]) -> Float:
    """(steps, F, 3) of the tensor, by a sum over a grid fine enough to be one."""
    length = 0.8 * scale_parameter(3, GRID.hub_height)
    fine = WindGrid(points_y=49, points_z=2, dy=2.5, dz=2.5, bottom=90.0, hub_height=90.0)
    out = np.empty((len(steps), len(f), 3))
    for i, k1 in enumerate(2.0 * np.pi * f * length / SPEED):
        column = mann.covariance_with((0, 0), float(k1), fine, length, mann.GAMMA)
        for c in range(3):
            density = mann.one_point(mann.GAMMA)(np.array([k1]))[c, 0]
            out[:, i, c] = column[c, c, 0, [s * 6 for s in steps]].real / density
    return out


def draw_coherence(found: dict[str, Complex], f: Float) -> None:
    steps = [1, 2, 4, 8]
    figure, axes = new_figure(1, 4, size=(12.0, 3.5))
    panels = [("kaimal", 0), ("vonkarman", 0), ("mann", 0), ("mann", 1)]
    dense = np.geomspace(f[0], 0.5, 60)
    of_mann = mann_coherence(dense, steps)
    for ax, (spectrum, component) in zip(axes[0], panels, strict=True):
        for i, s in enumerate(steps):
            r = s * GRID.dy
            if spectrum == "mann":
                line = of_mann[i, :, component]
            else:
                edition = 2 if spectrum == "vonkarman" else 3
                scale = scale_parameter(edition, GRID.hub_height)
                line = np.exp(-coherence_decay(spectrum, edition, dense, SPEED, scale) * r)
            ax.semilogx(dense, line, color=COLOURS[i], linewidth=1.3)
            together, alone = coherence(found[spectrum], s)[..., component]
            some = [b for b in bands(len(f), 7) if f[b.start] < 0.5]
            values = [together[b].sum() / alone[b].sum() for b in some]
            middle = [np.exp(np.log(f[b]).mean()) for b in some]
            ax.plot(middle, values, "o", color=COLOURS[i], markersize=3.6, markerfacecolor="white", label=f"{r:g} m")
        ax.axhline(0.0, color=INK, linewidth=0.6)
        ax.set(xlim=(1.4e-3, 0.6), ylim=(-0.4, 1.0))
        ax.set_title(f"{MODELS[spectrum]}, {'uvw'[component]}")
        ax.set_xlabel("frequency f [Hz]")
    axes[0, 0].set_ylabel("coherence, real part [-]")
    axes[0, 0].legend(title="lateral distance")
    save(figure, "wind_coherence.png")


def draw_fields() -> None:
    figure, axes = new_figure(2, 3, size=(10.5, 5.6), share=False)
    limits = {"cmap": "viridis", "vmin": 6.0, "vmax": 18.0}
    image = None
    for column, (spectrum, name) in enumerate(MODELS.items()):
        box = generate_field(wind(spectrum, 7, scaled=True, shear_exponent=0.14), FINE, 120.0)
        row = FINE.hub[0]
        u = box.velocity[..., 0]
        y, z, x = FINE.y, FINE.z, SPEED * DT * np.arange(len(u))
        across, along = axes[:, column]
        image = across.pcolormesh(y, z, u[len(u) // 2], shading="gouraud", rasterized=True, **limits)
        across.set_aspect("equal")
        across.set_title(name)
        across.set_xlabel("y [m], to the left looking downwind")
        some = slice(0, 200)
        along.pcolormesh(-x[some], z, u[some, :, FINE.hub[1]].T, shading="gouraud", rasterized=True, **limits)
        along.axhline(z[row], color="white", linewidth=0.6, linestyle=":")
        along.set_xlabel("x [m], downwind; the first plane is at 0")
    for ax in axes[:, 0]:
        ax.set_ylabel("height z [m]")
    for ax in axes.flat:
        ax.tick_params(labelsize=8)
    figure.colorbar(image, ax=axes, label="u [m/s]", shrink=0.7)
    save(figure, "wind_fields.png")


def save(figure: Any, name: str) -> None:
    from PIL import Image

    figure.savefig(IMAGES / name, dpi=95 if "fields" in name else 110)
    with Image.open(IMAGES / name) as image:  # a palette makes it a third
        small = image.convert("RGB").quantize(160 if "fields" in name else 64, dither=Image.Dither.NONE)
    small.save(IMAGES / name, optimize=True)
    print(name, (IMAGES / name).stat().st_size // 1000, "kB")


def main() -> None:
    found = {spectrum: amplitudes(spectrum) for spectrum in MODELS}
    f = np.arange(1, round(DURATION / DT) // 2) / DURATION
    draw_spectra(found, f)
    draw_coherence(found, f)
    draw_fields()


if __name__ == "__main__":
    main()
