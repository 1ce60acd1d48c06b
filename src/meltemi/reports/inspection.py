"""Summary page of a turbine, as HTML and as a picture."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from meltemi.analyses.rotor_performance import RotorPerformance
from meltemi.core.errors import InputError
from meltemi.report.plots import plot_performance, plot_power_curve, save
from meltemi.report.tables import power_curve_rows
from meltemi.reports.blocks import Document, Picture, Section, Table
from meltemi.reports.frame_overview import frame_blocks
from meltemi.reports.html import write_page
from meltemi.reports.turbine_facts import fact_rows, mode_rows
from meltemi.reports.turbine_overview import (
    PowerTurbineOverview,
    TurbineOverview,
    power_turbine_overview,
    turbine_overview,
)
from meltemi.reports.turbine_plots import plot_turbine, turbine_figures
from meltemi.turbine.power_turbine import AnyTurbine, PowerTurbine

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CAPTIONS = {
    "blade": "Blade: planform, section properties, and modes of the clamped blade at rest.",
    "tower": "Tower: section properties, and modes with the mass of nacelle and rotor.",
    "polars": "Polars, coloured from root to tip; insets from -20 to 30 degrees.",
    "rotor": "Coefficients of the rigid rotor without tilt, cone and tower, and steady operating points.",
    "operation": "Steady operation of the flexible turbine in uniform wind, azimuthal averages; dotted: rated.",
}


def inspect_turbine(
    turbine: AnyTurbine, out: str | Path, *, progress: Callable[[float], None] | None = None
) -> tuple[TurbineOverview | PowerTurbineOverview, list[Path]]:
    """Write the self-contained summary page ``turbine.html`` of a turbine, and the summary figure ``turbine.png``.

    Quantities that cannot be computed are left out, and the page gives the reason.

    Args:
      turbine: turbine of either kind.
      out: existing folder.
      progress: callback with the completed fraction.

    Returns:
      The evaluated turbine, and the files.

    Raises:
      InputError: a file cannot be written.
    """
    import meltemi

    out = Path(out)
    if not out.is_dir():
        raise InputError(f"{out}: no such folder; make it first")
    done = progress or (lambda _: None)
    overview: TurbineOverview | PowerTurbineOverview
    size: list[tuple[str, str]] = []
    picture = out / "turbine.png"
    if isinstance(turbine, PowerTurbine):
        overview = power_turbine_overview(turbine)
        sections = _power_sections(overview, picture)
    else:
        overview = turbine_overview(turbine, progress=lambda x: done(0.6 * x))
        save(plot_turbine(overview), picture)
        done(0.8)
        sections = _sections(overview, picture)
        size = [("Rotor", f"{turbine.rotor_diameter:.4g} m"), ("Hub height", f"{turbine.hub_height:.4g} m")]
    if overview.problems:
        sections.append(Section("Missing data", [f"{what}: {why}" for what, why in overview.problems.items()]))
    rated, described = f"{turbine.rated_power / 1e6:g} MW", turbine.description
    description = [("Description", described)] if described else []
    facts = [*description, ("Rated power", rated), *size, ("Source", turbine.source or "not stated")]
    document = Document(turbine.name, sections, facts=facts, footer=f"meltemi {meltemi.__version__}")
    page = write_page(out / "turbine.html", document)
    done(1.0)
    return overview, [page, picture]


def _power_sections(overview: PowerTurbineOverview, picture: Path) -> list[Section]:
    """Sections of the page of a power-coefficient turbine; draws the picture."""
    p = overview.performance
    every = slice(None, None, max(len(p.pitch) // 8, 1))
    shown = RotorPerformance(
        p.tip_speed_ratio, p.pitch[every], p.power[:, every], p.thrust[:, every], p.torque[:, every]
    )
    save(plot_performance(shown), picture)
    coefficients = Picture(picture, "Power, thrust and torque coefficients.")
    sections = [Section("Main data", [_numbers(overview)]), Section("Rotor", [coefficients])]
    if overview.curve:
        curve = _picture(plot_power_curve(overview.curve), "Steady operation in uniform wind.")
        sections.append(Section("Operation", [curve, Table(*power_curve_rows(overview.curve), text_columns=0)]))
    return sections


def _sections(overview: TurbineOverview, picture: Path) -> list[Section]:
    """Sections of the page of an aeroelastic turbine."""
    pictures = {name: _picture(figure, CAPTIONS[name]) for name, figure in turbine_figures(overview).items()}
    operation = [Table(*power_curve_rows(overview.curve), text_columns=0)] if overview.curve else []
    sections = [
        Section("Overview", [Picture(picture, "Summary figure.")]),
        Section("Main data", [_numbers(overview)]),
        *(Section(name.capitalize(), [pictures[name]]) for name in ("blade", "tower", "polars", "rotor")),
        Section("Operation", [pictures["operation"], *operation]),
    ]
    if overview.turbine.frame is not None and overview.model is not None:
        sections.insert(4, Section("Frame", frame_blocks(overview.turbine, overview.model.rotor.tower)))
    if overview.modes:
        text = "Modes of the turbine at rest and in vacuum, with locked generator; amplitudes in m and rad."
        sections.append(Section("Modes", [text, Table(*mode_rows(overview.modes), text_columns=2)]))
    return sections


def _numbers(overview: TurbineOverview | PowerTurbineOverview) -> Table:
    return Table(["group", "what", "value"], fact_rows(overview), text_columns=3)


def _picture(figure: Figure, caption: str) -> Picture:
    content = BytesIO()
    figure.savefig(content, dpi=110)
    return Picture(content.getvalue(), caption)
