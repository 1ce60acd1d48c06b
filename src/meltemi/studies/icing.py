"""Effects of blade icing: power loss, blade frequencies, and loads of a rotor with mass imbalance."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from meltemi.analyses.modes import natural_modes
from meltemi.compiler import View
from meltemi.core.shown import Brief
from meltemi.iec.winds import ntm
from meltemi.loadcases.batch import simulate_batch
from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.postprocess.fatigue import equivalent_loads
from meltemi.report.palette import COLOURS
from meltemi.report.plots import new_figure, panel
from meltemi.reports.blocks import Table
from meltemi.reports.ensemble_tables import change_bar, change_text
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.result import Result
from meltemi.simulation.rotors import build
from meltemi.simulation.run import Run
from meltemi.simulation.trim import operating_point
from meltemi.structure.tables import BladeNode
from meltemi.tuning.run_store import completed
from meltemi.turbine.definition import Turbine
from meltemi.turbine.icing import Icing, with_ice
from meltemi.turbulence.field import generate_field

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Float = NDArray[np.float64]

CLEAN = "clean"
LOADS = {
    "shaft_force_y": "main shaft, lateral force",
    "shaft_moment_y": "main shaft, rotating bending",
    "yaw_moment_z": "yaw bearing, torsion",
    "root_moment_in_plane_1": "root of blade 1, in plane",
    "root_moment_out_of_plane_1": "root of blade 1, out of plane",
    "tower_base_moment_side_side": "tower base, side to side",
    "tower_base_moment_fore_aft": "tower base, fore and aft",
}
"""Channels and their labels."""
STANDING = ("tower", "yaw", "drivetrain", "generator")


@dataclass(frozen=True, repr=False)
class IcingEffects(Brief):
    """Results of a turbine with and without ice.

    Attributes:
      turbine: name of the turbine.
      mass: [kg] mass of the ice on a blade, and of the blade.
      speeds: (n,) [m/s] steady wind speeds.
      power: (n,) [W] electrical power in steady wind, by variant.
      frequencies: [Hz] natural frequencies of the clean and of the iced blade at rest, by mode.
      load_speeds: (m,) [m/s] mean wind speed of turbulent simulations.
      loads: (m, seeds) [N or N m] equivalent loads by variant and channel.
      first: (m, seeds) [N or N m] 1P amplitudes by variant and channel.
    """

    turbine: str
    mass: tuple[float, float]
    speeds: Float
    power: Mapping[str, Float]
    frequencies: Mapping[str, tuple[float, float]]
    load_speeds: tuple[float, ...]
    loads: Mapping[str, Mapping[str, Float]]
    first: Mapping[str, Mapping[str, Float]]


def icing_effects(  # noqa: PLR0913 - options of a study, each with a default
    turbine: Turbine,
    icing: Icing | None = None,
    *,
    speeds: Sequence[float] = tuple(np.arange(4.0, 15.1, 0.5)),
    load_speeds: Sequence[float] = (8.0, 12.0, 18.0),
    seeds: Sequence[int] = (1, 2, 3, 4, 5, 6),
    duration: float = 600.0,
    options: ModelOptions | None = None,
    wind_class: str = "IIB",
    points: int = 21,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> IcingEffects:
    """Power, frequencies and loads of a turbine without ice, with ice on one blade, on all but one and on all.

    Args:
      turbine: turbine without ice.
      icing: ice of the iced blades; its ``blades`` are not used.
      speeds: [m/s] steady wind speeds, for the power.
      load_speeds: [m/s] mean wind speeds of turbulent simulations, for the loads.
      seeds: seeds of the normal turbulence model of ``wind_class``.
      duration: [s] duration of a turbulent simulation.
      options: model options.
      wind_class: wind class of IEC 61400-1.
      points: grid points of the wind fields in each direction.
      workers: number of threads.
      progress: callback with the completed fraction.
    """
    icing = icing or Icing()
    every = tuple(range(1, turbine.n_blades + 1))
    sets = {CLEAN: None, "one blade": (1,), "all but one": every[1:], "all blades": every}
    models = {
        name: build(with_ice(turbine, None if on is None else icing.replace(blades=on)), options)
        for name, on in sets.items()
    }
    grid = np.asarray(speeds, dtype=float)
    power = {
        name: np.array([operating_point(model, float(v))["generator_power"] for v in grid])
        for name, model in models.items()
    }
    winds = [(float(v), seed) for v in load_speeds for seed in seeds]
    starts = {(name, v): operating_point(model, v) for name, model in models.items() for v in dict(winds)}
    results: list[Float] = []
    for done, (v, seed) in enumerate(winds):
        wind = generate_field(ntm(v, wind_class, seed=seed, points=points), turbine, duration)
        cases = [
            Run(model, wind, duration=duration, channels=["azimuth", *LOADS], start=starts[name, v], name=name)
            for name, model in models.items()
        ]
        results += completed(simulate_batch(cases, reduce=_reduced, workers=workers))
        if progress is not None:
            progress((done + 1) / len(winds))
    values = np.array(results).reshape(len(load_speeds), len(seeds), len(sets), 2, len(LOADS))
    both = [
        {name: {load: values[:, :, i, kind, j] for j, load in enumerate(LOADS)} for i, name in enumerate(sets)}
        for kind in (0, 1)
    ]
    return IcingEffects(
        turbine.name,
        _masses(models[CLEAN], models["one blade"]),
        grid,
        power,
        _frequencies(turbine, icing, options or ModelOptions()),
        tuple(dict(winds)),
        *both,
    )


def _reduced(result: Result) -> Float:
    """(2, loads) equivalent loads, and 1P amplitudes."""
    life = equivalent_loads(result, list(LOADS))
    turn = np.exp(-1j * result["azimuth"])
    once = [2.0 * abs(np.mean((result[name] - result[name].mean()) * turn)) for name in LOADS]
    return np.array([[life[name] for name in LOADS], once])


def _masses(clean: BladedModel, iced: BladedModel) -> tuple[float, float]:
    before, after = (float(View(BladeNode, model.rotor.blade_nodes)["mass"][0].sum()) for model in (clean, iced))
    return after - before, before


def _frequencies(turbine: Turbine, icing: Icing, options: ModelOptions) -> dict[str, tuple[float, float]]:
    """Natural frequencies [Hz] of the isolated blade 1, clean and iced, by mode, without residual modes."""
    frequencies = []
    for each in (None, icing.replace(blades=(1,))):
        model = build(with_ice(turbine, each), options.replace(locked=STANDING, residual_modes=0))
        modes: dict[str, float] = {}
        for mode in natural_modes(model):
            moves = [name for name, x in zip(mode.coordinates, np.abs(mode.shape), strict=True) if x > 0.99]
            if moves[0].startswith("blade 1 "):
                modes.setdefault(moves[0].removeprefix("blade 1 "), mode.frequency / (2.0 * np.pi))
        frequencies.append(modes)
    return {name: (frequencies[0][name], frequencies[1][name]) for name in frequencies[0] if name in frequencies[1]}


def power_table(effects: IcingEffects) -> Table:
    """Table of power in steady wind: clean, and changes by ice."""
    clean = effects.power[CLEAN]
    names = [name for name in effects.power if name != CLEAN]
    rows = [
        [f"{v:g}", f"{p / 1e6:.2f}", *(f"{100.0 * (effects.power[name][i] / p - 1.0):+.1f}" for name in names)]
        for i, (v, p) in enumerate(zip(effects.speeds, clean, strict=True))
    ]
    head = ["wind\nm/s", "clean\nMW", *(f"{name}\n%" for name in names)]
    return Table(head, rows, f"{effects.turbine}: power in steady wind, change by ice", text_columns=0)


def frequency_table(effects: IcingEffects) -> Table:
    """Table of natural frequencies of a blade."""
    rows = [
        [name, f"{clean:.3f}", f"{iced:.3f}", f"{100.0 * (iced / clean - 1.0):+.1f}"]
        for name, (clean, iced) in effects.frequencies.items()
    ]
    ice, blade = effects.mass
    note = f"Ice of {ice:,.0f} kg on a blade of {blade:,.0f} kg ({100.0 * ice / blade:.0f} %)."
    return Table(["mode", "clean\nHz", "iced\nHz", "%"], rows, f"{effects.turbine}: blade at rest", note=note)


def load_changes(effects: IcingEffects, name: str, load: str) -> list[MeanEstimate]:
    """Relative change of an equivalent load against the clean turbine in the same wind, for each wind speed."""
    ratio = effects.loads[name][load] / effects.loads[CLEAN][load] - 1.0
    return [mean_interval(row) for row in ratio]


def load_table(effects: IcingEffects) -> Table:
    """Table of equivalent loads and 1P amplitudes in turbulence."""
    names = [name for name in effects.loads if name != CLEAN]
    rows = []
    for load, words in LOADS.items():
        unit = 1e3 if load == "shaft_force_y" else 1e6
        for i, v in enumerate(effects.load_speeds):
            row = [words, f"{v:g}", f"{effects.loads[CLEAN][load][i].mean() / unit:.3g}"]
            for name in names:
                row.append(change_text(load_changes(effects, name, load)[i]))
            row += [f"{effects.first[name][load][i].mean() / unit:.3g}" for name in (CLEAN, *names[:1])]
            rows.append(row)
    changes = [f"DEL {name}\n%" for name in names]
    head = ["load", "wind\nm/s", "DEL clean\nMN m (kN)", *changes, "1P clean", "1P one blade"]
    note = (
        "Means over seeds with 95 % confidence; forces in kN, moments in MN m; 1P: amplitude at the rotor's frequency."
    )
    return Table(head, rows, f"{effects.turbine}: loads in turbulence", note=note)


def plot_icing(effects: IcingEffects) -> Figure:
    """Plot power curves, their changes by ice, natural frequencies, and loads."""
    figure, axes = new_figure(2, 2, size=(11.0, 7.0), share=False)
    (power, loss), (modes, loads) = axes
    for colour, (name, values) in zip(COLOURS, effects.power.items(), strict=False):
        power.plot(effects.speeds, values / 1e6, color=colour, label=name)
        loss.plot(effects.speeds, 100.0 * (values / effects.power[CLEAN] - 1.0), color=colour)
    for ax, title, unit in ((power, f"{effects.turbine}: power in steady wind", "MW"), (loss, "change by ice", "%")):
        panel(ax, title, unit)
        ax.set_xlabel("wind speed [m/s]")
    power.legend()
    place = np.arange(len(effects.frequencies))
    for shift, colour, label in ((-0.2, COLOURS[0], CLEAN), (0.2, COLOURS[3], "iced")):
        heights = [pair[label == "iced"] for pair in effects.frequencies.values()]
        modes.bar(place + shift, heights, 0.38, color=colour, label=label)
    modes.set_xticks(place, [name.replace(" ", "\n") for name in effects.frequencies])
    panel(modes, "natural frequencies of a blade at rest", "Hz")
    modes.legend()
    middle = len(effects.load_speeds) // 2
    place = np.arange(len(LOADS))
    names = [name for name in effects.loads if name != CLEAN]
    for i, (colour, name) in enumerate(zip(COLOURS[1:], names, strict=False)):
        changes = [load_changes(effects, name, load)[middle] for load in LOADS]
        mean, half = zip(*map(change_bar, changes), strict=True)
        loads.barh(place + 0.27 * (i - 1), mean, 0.25, xerr=half, color=colour, error_kw={"linewidth": 0.8})
    loads.set_yticks(place, list(LOADS.values()))
    loads.invert_yaxis()
    panel(loads, f"equivalent loads against the clean turbine at {effects.load_speeds[middle]:g} m/s [%]", "load")
    loads.set_ylabel("")
    return figure
