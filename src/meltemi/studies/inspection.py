"""A turbine on one page, as HTML and as a picture."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path

from meltemi.core.errors import InputError
from meltemi.report.html import Picture, Section, Table, write_page
from meltemi.report.plots import plot_performance, plot_power_curve, save
from meltemi.report.tables import power_curve_rows
from meltemi.report.turbine_facts import mode_rows, turbine_facts
from meltemi.report.turbine_plots import plot_turbine, turbine_figures
from meltemi.simulation.portrait import Portrait, PowerPortrait, portrait, power_portrait
from meltemi.turbine.performance import RotorPerformance
from meltemi.turbine.power_turbine import AnyTurbine, PowerTurbine

CAPTIONS = {
    "blade": "Of the blade: shape, sections, and modes when it is clamped and at rest.",
    "tower": "Of the tower: sections, and modes with the mass of nacelle and rotor on its top.",
    "polars": "Polars, coloured from root to tip; insets from -20 to 30 degrees.",
    "rotor": "Coefficients of the rigid rotor without tilt, cone and tower, and where steady operation lies.",
    "operation": "Steady operation of the flexible turbine in uniform wind, means over a revolution; dotted: rated.",
}


def inspect_turbine(
    turbine: AnyTurbine, out: str | Path, *, progress: Callable[[float], None] | None = None
) -> tuple[Portrait | PowerPortrait, list[Path]]:
    """Draw a turbine: ``turbine.html``, which needs nothing else, and ``turbine.png``, all of it in one picture.

    What cannot be computed is left out, and the page says why.

    Args:
      turbine: as described.
      out: folder, which exists.
      progress: called with the share that is done.

    Returns:
      Its numbers, and the files.

    Raises:
      InputError: a file cannot be written.
    """
    out = Path(out)
    if not out.is_dir():
        raise InputError(f"{out}: no such folder; make it first")
    done = progress or (lambda _: None)
    if isinstance(turbine, PowerTurbine):
        return _power_page(power_portrait(turbine), out)
    seen = portrait(turbine, progress=lambda x: done(0.6 * x))
    picture = save(plot_turbine(seen), out / "turbine.png")
    done(0.8)
    page = _write(seen, out / "turbine.html", picture)
    done(1.0)
    return seen, [page, picture]


def _power_page(seen: PowerPortrait, out: Path) -> tuple[PowerPortrait, list[Path]]:
    """The page and the picture of a turbine of a power coefficient."""
    import meltemi

    t, p = seen.turbine, seen.performance
    every = slice(None, None, max(len(p.pitch) // 8, 1))
    shown = RotorPerformance(
        p.tip_speed_ratio, p.pitch[every], p.power[:, every], p.thrust[:, every], p.torque[:, every]
    )
    picture = save(plot_performance(shown), out / "turbine.png")
    rows = [[name if i == 0 else "", *row] for name, found in turbine_facts(seen) for i, row in enumerate(found)]
    sections = [
        Section("Numbers", [Table(["group", "what", "value"], rows, text_columns=3)]),
        Section("Rotor", [Picture(picture, "Its coefficients.")]),
    ]
    if seen.curve:
        content = BytesIO()
        plot_power_curve(seen.curve).savefig(content, dpi=110)
        curve = Picture(content.getvalue(), "Steady operation in uniform wind.")
        sections.append(Section("Operation", [curve, Table(*power_curve_rows(seen.curve), text_columns=0)]))
    if seen.problems:
        sections.append(Section("What is missing", [f"{what}: {why}" for what, why in seen.problems.items()]))
    facts = [("Name", t.name), ("Rated power", f"{t.rated_power / 1e6:g} MW"), ("Source", t.source or "not stated")]
    path = out / "turbine.html"
    page = write_page(path, t.description or t.name, sections, facts=facts, footer=f"meltemi {meltemi.__version__}")
    return seen, [page, picture]


def _write(seen: Portrait, path: Path, overview: Path) -> Path:
    import meltemi

    t = seen.turbine
    pictures = {}
    for name, figure in turbine_figures(seen).items():
        content = BytesIO()
        figure.savefig(content, dpi=110)
        pictures[name] = Picture(content.getvalue(), CAPTIONS[name])
    groups = turbine_facts(seen)
    head = Table(
        ["group", "what", "value"],
        [[name if i == 0 else "", *row] for name, rows in groups for i, row in enumerate(rows)],
        text_columns=3,
    )
    operation: list[Picture | Table] = [pictures["operation"]]
    if seen.curve:
        operation.append(Table(*power_curve_rows(seen.curve), text_columns=0))
    modes = [Table(*mode_rows(seen.modes), text_columns=2)] if seen.modes else []
    sections = [
        Section("On one page", [Picture(overview, "The whole turbine.")]),
        Section("Numbers", [head]),
        Section("Blade", [pictures["blade"]]),
        Section("Tower", [pictures["tower"]]),
        Section("Polars", [pictures["polars"]]),
        Section("Rotor", [pictures["rotor"]]),
        Section("Operation", operation),
    ]
    if modes:
        text = "Of the whole machine at rest and in vacuum, generator held; amplitudes in m and rad."
        sections.append(Section("Modes", [text, *modes]))
    if seen.problems:
        sections.append(Section("What is missing", [f"{what}: {why}" for what, why in seen.problems.items()]))
    facts = [
        ("Name", t.name),
        ("Rated power", f"{t.rated_power / 1e6:g} MW"),
        ("Rotor", f"{t.rotor_diameter:.4g} m"),
        ("Hub height", f"{t.hub_height:.4g} m"),
        ("Source", t.source or "not stated"),
    ]
    return write_page(path, t.description or t.name, sections, facts=facts, footer=f"meltemi {meltemi.__version__}")
