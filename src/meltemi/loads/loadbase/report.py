"""Report of a load base: one HTML file with design loads, their gaps, and every case.

Missing and doubtful cases come first, then the governing loads, then all tables. Each number has its case, and the page
gives the command that simulates the case again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import meltemi
from meltemi.controllers.specification import description
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.physics import PHYSICS
from meltemi.core.yamlfile import read_mapping
from meltemi.loads.loadbase.axes import axes_blocks
from meltemi.loads.loadbase.design import DesignLoads, compare_bases, design_loads, write_tables
from meltemi.loads.loadbase.plan import Plan
from meltemi.loads.loadbase.project import Project, read_project
from meltemi.loads.loadbase.report_cases import assumption_tables, case_table, statistics, statistics_chart
from meltemi.loads.loadbase.report_joints import JointResults, joint_blocks, joint_results, write_joint_tables
from meltemi.loads.loadbase.report_loads import (
    LOADS,
    MOMENT,
    WITH,
    clearance_table,
    duration_blocks,
    energy_words,
    extrapolation_blocks,
    extreme_blocks,
    fatigue_blocks,
    line_blocks,
    load_heads,
    operation_blocks,
    rose_blocks,
    signal_table,
    slopes_of,
    title_of,
    unit_of_driver,
)
from meltemi.postprocess.extremes import COMPONENTS
from meltemi.reports.blocks import (
    Beside,
    Block,
    CaseList,
    CaseName,
    CaseValue,
    Cell,
    Code,
    Document,
    Facts,
    Folded,
    Marked,
    Section,
    Table,
    VerdictBlock,
)
from meltemi.reports.html import write_page
from meltemi.reports.turbine_facts import number
from meltemi.reports.workbook import write_workbook
from meltemi.turbine.library import load_turbine
from meltemi.turbine.power_turbine import aeroelastic

if TYPE_CHECKING:
    import pandas as pd

FILE = "report.html"
WORD = "report.docx"
TABLES, WORKBOOK = "tables", "design_loads.xlsx"
"""Folder beside the report, and a file in it."""
SHOWN = 10
"""Largest number of problems whose list is unfolded."""
CERTIFICATE = (
    "Not certified: rules and factors were taken from secondary sources; the values listed under assumptions must be "
    "replaced by those of the turbine."
)


def write_report(
    plan: Plan,
    folder: str | Path,
    *,
    against: tuple[str, DesignLoads] | None = None,
    limits: Mapping[str, Any] | None = None,
    design: DesignLoads | None = None,
    project: Project | None = None,
    word: bool = False,
) -> list[Path]:
    """Write ``report.html`` into the folder of a load base; beside it its tables, as CSV files in SI units and as one
    Excel file in the units of the report.

    Args:
      plan: plan of the load base.
      folder: folder of the load base.
      against: name and design loads of another load base, to which utilisations refer.
      limits: loads to which utilisations refer instead, by kind ("ultimate", "fatigue", "clearance", "motion"),
        interface and load, such as ``{"ultimate": {"tower_base": {"M_res max": 1.2e8}}}`` in SI units, with partial
        safety factors.
      design: design loads of the load base; evaluated by default.
      project: title block; by default that of ``project.yaml`` in the folder, if that exists.
      word: whether ``report.docx`` is written, too.

    Returns:
      The files, the report first.

    Raises:
      InputError: both ``against`` and ``limits`` are given, a limit names an unknown load, a file cannot be read or
        written, or a library for it is missing.
    """
    if against is not None and limits is not None:
        raise InputError("utilisation: give another load base or limits, not both")
    d = design or design_loads(plan, folder)
    ratios, to = None, ""
    if against is not None:
        ratios, to = compare_bases(d, against[1]), against[0]
    elif limits is not None:
        ratios, to = limit_ratios(d, limits), "the given limits"
    joints = joint_results(plan, folder, doubtful=d.settings.doubtful)
    tables = [*write_tables(d, Path(folder) / TABLES), *write_joint_tables(joints, Path(folder) / TABLES)]
    document = load_report(plan, folder, d, tables, ratios, to, project or read_project(folder), joints)
    files = [write_page(Path(folder) / FILE, document)]
    if word:
        from meltemi.reports.word import write_word

        files.append(write_word(Path(folder) / WORD, document))
    return [*files, write_workbook(Path(folder) / TABLES / WORKBOOK, document), *tables]


def load_report(
    plan: Plan,
    folder: str | Path,
    d: DesignLoads,
    tables: list[Path],
    ratios: pd.DataFrame | None = None,
    to: str = "",
    title: Project | None = None,
    joints: JointResults | None = None,
) -> Document:
    """Report of a load base; ``tables``: files beside it; ``ratios``: utilisations, with their reference ``to``."""
    c, table = plan.campaign, statistics(plan, folder)
    sections = [
        Section("Governing loads", [*glance(d, ratios, to)]),
        Section("Axes", axes_blocks(aeroelastic(load_turbine(c.turbine), "report"))),
        *load_sections(d),
        Section("Joints and members", joint_blocks(joints)),
        Section("Statistics of all cases", statistics_chart([(str(folder), plan, table)])),
        Section("Cases", case_table(plan, table, d)),
        Section("Assumptions", assumption_tables(plan, d)),
        Section("Files and commands", [files_text(folder, tables), *commands(str(folder))]),
    ]
    return Document(
        f"Design loads: {c.turbine_name}",
        [section for section in sections if section.content],
        facts=[*(title.facts if title else ()), *facts(plan)],
        lead=verdict(d, ratios),
        footer=footer_text(),
        running=title.running if title else "",
        cases=[CaseList(str(folder), [case.name for case in plan.cases])],
    )


def load_sections(d: DesignLoads) -> list[Section]:
    """Sections with loads."""
    return [
        Section("Extreme loads", extreme_blocks(d)),
        Section("Fatigue loads", fatigue_blocks(d)),
        Section("Tip clearance", clearance_table(d)),
        Section("Mooring lines", line_blocks(d)),
        Section("Extrapolation", extrapolation_blocks(d)),
        Section("Load directions", rose_blocks(d)),
        Section("Load durations", duration_blocks(d)),
        Section("Energy and operation", operation_blocks(d)),
        Section("Other extremes", signal_table(d)),
    ]


def write_design_loads(design: DesignLoads, folder: str | Path) -> list[Path]:
    """Write all tables of design loads: as CSV files in SI units, and as one Excel file, ``design_loads.xlsx``, in the
    units of the report.

    Returns:
      the files.

    Raises:
      InputError: a file cannot be written, or openpyxl is missing.
    """
    files = write_tables(design, folder)
    sections = [Section("Notes", [*design.notes]), *load_sections(design)]
    document = Document(f"Design loads: {design.plan.campaign.turbine_name}", sections, facts(design.plan))
    return [*files, write_workbook(Path(folder) / WORKBOOK, document)]


def facts(plan: Plan) -> list[tuple[str, str]]:
    """Facts of the computation, in pairs of name and value."""
    c, defaults = plan.campaign, plan.campaign.defaults(plan.table)
    site, file = c.site or c.metocean, Path(c.turbine).name
    where = c.iec_class.name if site is None else f"site {site.name}, {c.iec_class.name}"
    return [
        ("turbine", c.turbine_name if c.turbine_name == file else f"{c.turbine_name} ({file})"),
        ("rotor, hub height", f"{number(c.rotor_diameter)} m, {number(c.hub_height)} m"),
        ("standard", plan.table.title + (" (changed)" if c.changes else "")),
        ("class", f"{where}, V_ref {c.iec_class.v_ref:g} m/s, V_ave {c.iec_class.v_ave:g} m/s"),
        ("V_in, V_r, V_out", f"{c.cut_in:g}, {c.rated_wind:g}, {c.cut_out:g} m/s"),
        ("controller", description(c.controller)),
        ("lifetime", f"{c.years:g} years"),
        ("cases", f"{len(plan.cases)} of {defaults.duration:g} s, {plan.hours:.0f} h simulated"),
        ("seeds", "1 (quick plan)" if c.quick else f"{defaults.seeds}"),
        ("meltemi", f"{meltemi.__version__}, physics {PHYSICS}"),
    ]


def footer_text() -> str:
    """Version and time of a page, and the disclaimer."""
    return f"meltemi {meltemi.__version__}, physics {PHYSICS}, {datetime.now(UTC):%Y-%m-%d %H:%M} UTC. {CERTIFICATE}"


def verdict(d: DesignLoads, ratios: pd.DataFrame | None, base: int = 0) -> VerdictBlock:
    """Completeness, problems and exceeded limits, which an engineer must know before reading a number."""
    coverage = d.coverage
    total, good = int(coverage["cases"].sum()), int(coverage["ok"].sum())
    counts = coverage[["missing", "failed", "unsupported", "doubtful", "warned"]].sum().astype(int).to_dict()
    without = counts["missing"] + counts["failed"] + counts["unsupported"]
    lines = [*d.notes]
    if counts["missing"]:
        rows = [f"{row} ({n})" for row, n in coverage["missing"].items() if n]
        lines.insert(0, f"{counts['missing']} load cases not yet simulated: DLC {', '.join(rows)}")
    if strikes := [f"DLC {row}" for row, line in d.clearance.iterrows() if not line.fits]:
        lines.append(f"Tower strike with partial safety factors in {', '.join(strikes)}")
    if ratios is not None:
        over = exceeded(d, ratios)
        named = [f"{title_of(place)} {load}: {row.ratio:.2f}" for (_, place, load), row in over.head(8).iterrows()]
        named += [f"{len(over) - 8} more"] if len(over) > 8 else []
        count = f"{len(over)} utilisation{'s' if len(over) != 1 else ''} above 1"
        lines.append(": ".join(filter(None, (count, "; ".join(named)))))
    if without:
        kind, heading = "bad", f"Incomplete: no results for {without} of {total} load cases"
    elif counts["doubtful"] or counts["warned"]:
        kind = "bad" if strikes else "doubtful"
        words = {"doubtful": "doubtful", "warned": "with warnings"}
        flawed = ", ".join(f"{counts[state]} {text}" for state, text in words.items() if counts[state])
        heading = f"Complete: {total} load cases simulated, {flawed}"
    else:
        kind = "bad" if strikes else "doubtful" if d.common else "good"
        heading = f"Complete: {good} load cases simulated without warnings"
        heading += f" of single cases, {len(d.common)} for all of them" if d.common else ""
    problems = d.problems[d.problems["state"] != "missing"]
    more: Folded | None = None
    if len(problems):
        listed = [
            [CaseName(str(name), base), p.row, Marked(p.state, p.state), p.message, p.meaning]
            for name, p in problems.iterrows()
        ]
        table = Table(["case", "DLC", "state", "message", "consequence"], listed)
        states = ", ".join(f"{n} {state}" for state, n in counts.items() if n and state != "missing")
        more = Folded(states, table, unfolded=len(problems) <= SHOWN)
    return VerdictBlock(kind, heading, lines, more)


def exceeded(d: DesignLoads, ratios: pd.DataFrame) -> pd.DataFrame:
    """Utilisations above 1 of governing loads: the larger end of each component, fatigue loads and motions."""
    ends = {
        (place, driver)
        for place in d.ultimate.index.unique("interface")
        for name in LOADS
        if (driver := governing_driver(d.ultimate.loc[place], name))
    }
    over = ratios[ratios["ratio"] > 1.0]
    whole = ("fatigue", "motion")
    counted = [key for key in over.index if key[0] in whole or (key[0] == "ultimate" and key[1:] in ends)]
    return over.loc[counted].sort_values("ratio", ascending=False)


def governing_driver(extremes: pd.DataFrame, name: str, column: str = "") -> str:
    """Driver of the end of a component with the larger magnitude, at an interface; empty if there is none.

    Args:
      extremes: loads of the interface, index driver.
      column: column of its values; by default ``name``.
    """
    drivers = [driver for driver in (f"{name} max", f"{name} min") if driver in extremes.index]
    return max(drivers, key=lambda each: abs(float(extremes.at[each, column or name])), default="")


def glance(d: DesignLoads, ratios: pd.DataFrame | None, to: str) -> list[Block]:
    """Key numbers, the governing ultimate load of each component and interface, and the largest fatigue loads."""
    blocks: list[Block] = [key_numbers(d)]
    tables = []
    if len(d.ultimate):
        rows = [
            [title_of(place), *(governing(place, d.ultimate.loc[place], name, ratios) for name in LOADS)]
            for place in d.ultimate.index.unique("interface")
        ]
        words = f" Bars: utilisation against {to}." if to else ""
        caption = f"Ultimate loads, {WITH}"
        tables.append(Table(["interface", *load_heads(LOADS)], rows, caption))
        blocks.append(
            "Largest magnitude of each component with its governing load case; (!) marks a load case that is doubtful "
            f"or has warnings.{words} The extreme loads below have the contemporaneous loads."
        )
    if len(d.fatigue):
        tables.append(fatigue_glance(d, ratios))
    return [*blocks, Beside(tables)] if tables else blocks


def key_numbers(d: DesignLoads) -> Facts:
    """Key numbers: energy, clearance, extremes and stops."""
    numbers: list[tuple[str, str, CaseName | None]] = []
    if d.energy is not None:
        numbers.append(("annual energy", energy_words(d.energy), None))
    if len(d.clearance):
        worst = d.clearance.loc[d.clearance["left"].idxmin()]
        text = f"{number(float(worst.left))} m ({'passes' if worst.fits else 'tower strike'}), "
        numbers.append(("remaining tip clearance with factors", text, CaseName(str(worst.case))))
    for channel, end, label, unit, factor in (
        ("rotor_speed", "max", "largest rotor speed", "rpm", 30.0 / math.pi),
        ("tower_top_acceleration_x", "max", "largest fore-aft tower-top acceleration", "m/s²", 1.0),
        ("platform_offset", "max", "largest offset of the platform", "m", 1.0),
        ("platform_tilt", "max", "largest tilt of the platform", "deg", 180.0 / math.pi),
    ):
        if (channel, end) in d.signals.index:
            row = d.signals.loc[(channel, end)]
            numbers.append((label, f"{number(float(row.value) * factor)} {unit}, ", CaseName(str(row.case))))
    if len(d.stops):
        numbers.append(("stops per year", number(float(d.stops.iloc[:, 0].sum())), None))
    return Facts(numbers)


def governing(place: str, extremes: pd.DataFrame, name: str, ratios: pd.DataFrame | None) -> CaseValue | None:
    """The largest magnitude of a component, with its design load case and utilisation."""
    if not (driver := governing_driver(extremes, name)):
        return None
    row, factor = extremes.loc[driver], unit_of_driver(name)[1]
    case = CaseName(str(row.case), text=f"DLC {row.row}" + ("" if row.state == "ok" else " (!)"))
    return CaseValue(float(row[name]) * factor, case, utilisation(ratios, "ultimate", place, driver))


def utilisation(ratios: pd.DataFrame | None, kind: str, place: str, load: str) -> float:
    """Utilisation of a load; NaN if there is none."""
    if ratios is None or (kind, place, load) not in ratios.index:
        return math.nan
    return float(ratios.at[(kind, place, load), "ratio"])


def fatigue_glance(d: DesignLoads, ratios: pd.DataFrame | None) -> Table:
    """The moment of each interface with the largest lifetime equivalent load."""
    slopes = slopes_of(d.fatigue)
    moments = d.fatigue[d.fatigue["load"].isin(COMPONENTS[3:])]
    rows: list[list[Cell]] = []
    for place, part in moments.groupby("interface", sort=False):
        best = part.loc[part[slopes[-1]].idxmax()]
        use = (utilisation(ratios, "fatigue", str(place), f"{best.load} m={m:g}") for m in slopes)
        loads = (CaseValue(float(best[m]) * MOMENT[1], ratio=ratio) for m, ratio in zip(slopes, use, strict=True))
        rows.append([title_of(str(place)), str(best.load), *loads])
    caption = f"Lifetime damage-equivalent ranges of the largest moment, {d.settings.reference:.3g} cycles"
    return Table(["interface", "moment", *(f"m = {m:g}\n{MOMENT[0]}" for m in slopes)], rows, caption)


def limit_ratios(d: DesignLoads, limits: Mapping[str, Any]) -> pd.DataFrame:
    """Utilisations against limits, in the form of ``compare_bases``.

    Raises:
      InputError: a limit names an unknown load, or is not a number.
    """
    ratios = compare_bases(d, d)
    ratios["reference"], ratios["reference_case"], ratios["ratio"] = math.nan, "limit", math.nan
    for kind, places in limits.items():
        for place, loads in places.items() if isinstance(places, Mapping) else [("", None)]:
            if not isinstance(loads, Mapping):
                raise InputError(f"limits: {kind}: expected interfaces with loads and values, found {places!r}")
            for load, limit in loads.items():
                key, name = (kind, place, load), f"{kind} {place} {load}"
                if key not in ratios.index:
                    near = did_you_mean(name, [" ".join(map(str, each)) for each in ratios.index])
                    raise InputError(f"limits: there is no load {name!r}; {near}")
                if not isinstance(limit, int | float) or isinstance(limit, bool) or not limit:
                    raise InputError(f"limits: {name}: expected a number other than zero, found {limit!r}")
                value = float(ratios.at[key, "value"])
                ratios.loc[[key], "reference"] = float(limit)
                ratios.loc[[key], "ratio"] = limit / value if kind == "clearance" else abs(value / limit)
    return ratios[ratios["ratio"].notna()]


def read_limits(path: str | Path) -> dict[str, Any]:
    """Limits of a YAML file.

    Raises:
      InputError: the file cannot be read.
    """
    return dict(read_mapping(Path(path)))


def files_text(folder: str | Path, tables: list[Path]) -> str:
    """Names of the tables beside the report."""
    base = Path(folder)
    names = [str(path.relative_to(base) if path.is_relative_to(base) else path) for path in tables]
    return (
        f"Tables in the units of this report: {TABLES}/{WORKBOOK}. Tables with all digits, in SI units, for programs: "
        f"{', '.join(names)}."
    )


def commands(base: str) -> list[str | Code]:
    """Commands that reproduce the numbers."""
    return [
        "To simulate a case again, with its series and a plot; the numbers are those of the load base in all digits:",
        Code(f"meltemi loads show {base} CASE --plot"),
        "To complete the load base and write this report:",
        Code(f"meltemi loads run {base}\nmeltemi loads report {base}"),
    ]
