"""Three-dimensional view as one HTML file that needs no network.

The scripts, their style and three.js (MIT licence) are files in ``viewer`` beside this module; the page contains them
all.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, get_args

import numpy as np

from meltemi.core.errors import InputError
from meltemi.core.extras import need
from meltemi.core.files import write_text
from meltemi.report.palette import BLADES
from meltemi.reports.html import stored
from meltemi.scene.record import Scene, packed, track_arrays
from meltemi.simulation.result import Result
from meltemi.view.sea_surface import with_sea
from meltemi.view.utilisation import with_utilisation
from meltemi.view.viewer import beside, script

if TYPE_CHECKING:
    from meltemi.analyses.campbell import Campbell
    from meltemi.simulation.model import Model
    from meltemi.turbine.power_turbine import AnyTurbine
    from meltemi.view.widget import ViewWidget
    from meltemi.wind.fields import Wind
    from meltemi.wind.turbulent import AnyWind

PLOT_RATE = 20.0
"""[Hz] largest rate of the plotted channels."""
PLOTS: Mapping[str, Sequence[str]] = {
    "Wind speed at the hub": ["wind_x"],
    "Electrical power": ["generator_power"],
    "Rotor speed": ["rotor_speed"],
    "Pitch angle": ["pitch_1", "pitch_2", "pitch_3"],
    "Out-of-plane root moment": [f"root_moment_out_of_plane_{b}" for b in (1, 2, 3)],
    "Out-of-plane tip deflection": ["tip_out_of_plane_1"],
    "Fore-aft tower-base moment": ["tower_base_moment_fore_aft"],
    "Elevation of the sea": ["wave_elevation"],
    "Platform pitch": ["platform_pitch"],
}
"""Channels of the plots by default; those that are not recorded are left out."""


@dataclass(frozen=True)
class Look:
    """Initial appearance of a view.

    Attributes:
      theme: "light", "dark", or empty for that of the operating system.
      begin: [s] initial time.
      state: settings of the viewer by name, such as ``{"loads": "arrows", "wind": "off", "playing": False}``.
    """

    theme: str = ""
    begin: float = 0.0
    state: Mapping[str, Any] | None = None


@dataclass(frozen=True, repr=False)
class View:
    """Three-dimensional view of a turbine or a wind.

    Notebooks display it as a widget where anywidget is installed, otherwise as a page in a frame. Both are stored in
    the notebook, which thus shows the view without Python, too. :meth:`write` writes a file.

    Attributes:
      spec: title, names, colours and initial appearance.
      scenes: scenes as bytes of ``scene.record.packed``.
    """

    spec: Mapping[str, Any]
    scenes: Sequence[bytes]

    @property
    def html(self) -> str:
        """The view as a self-contained page that needs no network."""
        places = [f"scene-{i + 1}" for i in range(len(self.scenes))]
        live = ["live"] if self.spec["live"] else []
        style = "".join(beside(f"{name}.css") for name in ("view", *live))
        data = "\n".join(
            f'<script type="text/plain" id="{place}">{base64.b64encode(scene).decode()}</script>'
            for place, scene in zip(places, self.scenes, strict=True)
        )
        return (
            '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{escape(self.spec['title'])}</title>\n<link rel=icon href=data:,>\n<style>{style}</style>\n"
            f'</head>\n<body>\n<div class="view">\n{beside("page.html")}</div>\n'
            f"{stored('spec', {**self.spec, 'scenes': places})}\n{data}\n"
            f'<script type="text/plain" id="licence">{beside("three-licence.txt")}</script>\n'
            f"<script>\n{script(*live, 'file')}</script>\n</body>\n</html>\n"
        )

    def write(self, path: str | Path) -> Path:
        """Write the page as one HTML file.

        Raises:
          InputError: the file cannot be written.
        """
        return write_text(Path(path), self.html)

    @cached_property
    def widget(self) -> ViewWidget:
        """The view as a widget; ``time`` [s] and ``playing`` can be read and set from Python.

        Raises:
          InputError: anywidget is not installed.
        """
        need("the widget of a view", "anywidget")
        from meltemi.view.widget import ViewWidget

        return ViewWidget(spec=dict(self.spec), scenes=list(self.scenes), time=self.spec["begin"])

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        frame = 'style="width: 100%; height: 640px; border: 0; border-radius: 8px" title="View in three dimensions"'
        shown = {"text/plain": repr(self), "text/html": f'<iframe srcdoc="{escape(self.html)}" {frame}></iframe>'}
        try:
            return self.widget.bundle() | shown
        except InputError:
            return shown

    def __repr__(self) -> str:
        size = sum(map(len, self.scenes)) / 1e6
        return f"<View of {self.spec['title']}: {size:.2f} MB; write(path) makes a file of it>"


def view(
    what: Result | Mapping[str, Result] | Model[Any] | AnyTurbine | AnyWind,
    *,
    channels: Sequence[str] = (),
    look: Look = Look(),
) -> View:
    """Show a run, two runs, the modes of a turbine at standstill, or a wind in three dimensions.

    Args:
      what: a result of a run with ``view=True``; two of them by name; a model or a turbine; or a wind. For a turbulent
        wind, 60 s of a field of 130 m x 130 m at 90 m height are generated.
      channels: channels of results to plot, one per plot; by default wind, power, speed, pitch and main loads.
      look: initial appearance of the page.

    Raises:
      InputError: a result has no recorded motion or lacks a channel, or the turbine is a power-coefficient turbine.
    """
    if isinstance(what, Result):
        return result_view({"result": what}, channels, look)
    if isinstance(what, Mapping):
        return result_view(cast("Mapping[str, Result]", what), channels, look)
    from meltemi.analyses.campbell import campbell
    from meltemi.simulation.model import Model
    from meltemi.simulation.rotors import build
    from meltemi.turbine.representation import TurbineBase
    from meltemi.view.wind_scene import usual_field
    from meltemi.wind.fields import Wind
    from meltemi.wind.turbulent import TurbulentWind

    if isinstance(what, TurbineBase):
        what = build(what)
    if isinstance(what, Model):
        return modes_view(what, campbell(what, rotor_speeds=[0.0], air=False), look)
    if isinstance(what, TurbulentWind):
        what = usual_field(what)
    if not isinstance(what, get_args(Wind)):
        raise InputError(
            f"view: expected a result, two results by name, a model, a turbine or a wind, found {type(what).__name__}"
        )
    return wind_view(what, look)


def result_view(results: Mapping[str, Result], channels: Sequence[str] = (), look: Look = Look()) -> View:
    """The view of one or two results by name; see :func:`view`."""
    farm = all(result.scene is not None and "farm" in result.scene.about for result in results.values())
    if not results or (len(results) > 2 and not farm):
        raise InputError(f"a view shows one or two results, or those of a farm, found {len(results)}")
    for name, result in results.items():
        if result.scene is None:
            raise InputError(
                f"{name}: the motion of the turbine is not recorded; repeat the run with: meltemi run ... --view "
                "(view: true in a case file, view=True in Python)"
            )
    plots = [plot for title, names in _titles(results, channels).items() if (plot := _plot(title, names, results))]
    drawn = [
        with_utilisation(with_sea(with_plots(result.scene, result, plots), result), result)
        for result in results.values()
        if result.scene is not None
    ]
    scenes = [scene for scene, _ in drawn]
    largest = {k: max(scene.about["largest"][k] for scene in scenes) for k in scenes[0].about["largest"]}
    scenes = [replace(scene, about=scene.about | {"largest": largest}) for scene in scenes]
    same = dict.fromkeys(scene.about["turbine"]["name"] for scene in scenes)
    words = scenes[0].about["wind"]["label"] if farm or len(scenes) == 1 else ""
    accuracy = 1e3 * max(scene.about["accuracy"] for scene in scenes)
    note = (
        f"Drawn positions differ from those of the simulation by at most {accuracy:.0f} mm; nacelle and hub have usual "
        "proportions, sections the relative thickness of their airfoils."
        f"{drawn[0][1]}"
    )
    return view_of(" and ".join(same), words, scenes, names=list(results), note=note, look=look)


def modes_view(model: Model[Any], diagram: Campbell, look: Look = Look()) -> View:
    """The view of the modes of a Campbell diagram."""
    from meltemi.view.mode_scenes import modes_scene

    air = "with air" if diagram.air else "in vacuum"
    note = "One period of a mode takes two seconds, and the rotor turns as slowly; damping is not drawn."
    return view_of(f"{model.turbine.name}: modes {air}", "", [modes_scene(model, diagram)], note=note, look=look)


def wind_view(wind: Wind, look: Look = Look()) -> View:
    """The view of a wind alone."""
    from meltemi.view.wind_scene import wind_scene

    note = "The section is through the tower's axis; travelling, it moves with the mean wind and keeps its pattern."
    return view_of("Wind", wind.label, [wind_scene(wind)], note=note, look=look)


def _titles(results: Mapping[str, Result], channels: Sequence[str]) -> Mapping[str, Sequence[str]]:
    if not channels:
        return PLOTS
    channel_list = [result.channel(name) for name in channels for result in results.values()]
    return {channel.description[:1].upper() + channel.description[1:]: [channel.name] for channel in channel_list}


@dataclass(frozen=True)
class _Plot:
    """Channels of one plot in a unit that suits all results."""

    title: str
    names: Sequence[str]
    unit: str
    factor: float


def _plot(title: str, names: Sequence[str], results: Mapping[str, Result]) -> _Plot | None:
    """The plot of channels that all results have; None if there are none."""
    present = [name for name in names if all(name in result for result in results.values())]
    if not present:
        return None
    one = next(iter(results.values()))
    unit, factor = one.channel(present[0]).display_unit
    highest = max(float(np.nanmax(np.abs(result[present[0]]), initial=0.0)) for result in results.values())
    if unit[:1] == "k" and highest * factor >= 1e3:
        unit, factor = "M" + unit[1:], 1e-3 * factor
    return _Plot(title, present, unit, factor)


def with_plots(scene: Scene, result: Result, plots: Sequence[_Plot]) -> Scene:
    """The scene with the series of plots."""
    step = float(result.time[1] - result.time[0]) if len(result.time) > 1 else 1.0
    every = max(1, round(1.0 / (PLOT_RATE * step) - 1e-6))
    descriptions: list[dict[str, Any]] = []
    columns: list[Any] = []
    for plot in plots:
        lines = [{"name": name, "column": len(columns) + i} for i, name in enumerate(plot.names)]
        descriptions.append({"title": plot.title, "unit": plot.unit, "lines": lines})
        columns += [plot.factor * result[name][::every] for name in plot.names]
    about = scene.about | {"plots": descriptions, "steps": scene.about["steps"] | {"plot": every * step}}
    series = track_arrays("plot", np.nan_to_num(np.stack(columns, axis=1))) if columns else {}
    return Scene(about, scene.arrays | series)


def view_of(
    title: str,
    subtitle: str,
    scenes: Sequence[Scene],
    *,
    names: Sequence[str] = (),
    note: str = "",
    look: Look = Look(),
    live: Mapping[str, Any] | None = None,
) -> View:
    """The view of scenes of one kind; ``live`` has the controls of a running scene."""
    spec = {
        "title": title,
        "subtitle": subtitle,
        "names": list(names),
        "words": note,
        "colours": BLADES,
        "theme": look.theme,
        "begin": look.begin,
        "state": dict(look.state or {}),
        "live": live,
    }
    return View(spec, [packed(scene) for scene in scenes])
