"""Tables, figures and summary page of a comparison of control schemes."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from meltemi.controllers.schemes import SchemeDesign
from meltemi.controllers.tuning import LoopTuning, TunedPoint
from meltemi.postprocess.ensemble import CONFIDENCE
from meltemi.report.palette import INK
from meltemi.report.plots import ABOVE, new_figure, plot, readable_unit, save
from meltemi.report.tables import Rows, number, write_csv
from meltemi.reports.blocks import Code, Document, Picture, Section, Table
from meltemi.reports.ensemble_tables import UNDECIDED, change_text, ensemble_rows, scheme_rows
from meltemi.reports.html import write_page
from meltemi.reports.rendering import report_folder
from meltemi.reports.spectra_plots import plot_spectra
from meltemi.simulation.result import Result
from meltemi.tuning.compare import SPECTRA, WHOLE, Comparison, failure_line
from meltemi.tuning.comparison_plots import plot_changes
from meltemi.tuning.tuning_plots import plot_tuning

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SERIES_LENGTH = 60.0
"""[s] length of the time series in the figure."""
SERIES = ("wind_x", "RootMyc1", "OoPDefl1", "pitch_1", "flap_1_angle_1", "generator_power")
MAIN = (
    *("RootMyc1 std", "RootMyc1 DEL", "RootMxc1 DEL", "Mtilt DEL", "Myaw DEL", "OoPDefl1 std", "TwrBsMyt DEL"),
    *("YawBrMyp DEL", "YawBrMzp DEL"),
)
"""Loads of the figure of changes."""
OPERATION = ("power std", "rotor speed std", "tracking error")
"""Further quantities of that figure, in a separate panel."""
DUTY = ("pitch travel", "flap travel")
MOST_MEANS = 4
"""Largest number of schemes for which the table has means beside the changes."""
REMOVED = {1: "1P", 2: "1P and 2P"}
JUDGED: tuple[tuple[Literal["std", "load"], str], ...] = (("std", "RootMyc1 std"), ("load", "RootMyc1 DEL"))
STATISTIC = re.compile(" (std|DEL|mean|max)$")


def main_rows(comparison: Comparison) -> tuple[list[str], list[list[str]], list[tuple[str, int]]]:
    """Header, rows and column groups of the table of all quantities."""
    return scheme_rows(comparison.table(), comparison.units(), means=len(comparison.schemes) <= MOST_MEANS)


def notes(comparison: Comparison) -> str:
    """Explanation of the terms of that table."""
    base, *others = comparison.schemes
    sentences = []
    if others:
        interval = f", each with the half-width of its {100.0 * CONFIDENCE:g} % interval"
        several = len(comparison.winds) > 1
        sentences.append(f"Changes are against {base}, formed seed by seed{interval if several else ''}.")
    together = "; of all seeds: their damages together" if len(comparison.winds) > 1 else ""
    sentences.append(f"DEL: damage-equivalent load, 1 Hz, slope 10 for blades and 4 for steel{together}.")
    if any(change_text(e.change) == UNDECIDED for e in comparison.table()):
        sentences.append(f"{UNDECIDED}: a change that {len(comparison.winds)} seeds do not distinguish from zero.")
    meanings = {STATISTIC.sub("", q.name): q.about for q in comparison.quantities if q.about}
    return " ".join([*sentences, "; ".join(f"{name}: {about}" for name, about in meanings.items()) + "."])


def by_blade(comparison: Comparison) -> bool:
    """Whether a scheme pitches the blades differently, or moves flaps: none else reduces 1P and 2P of the moments."""

    def differ(result: Result) -> bool:
        return any(np.ptp(result[name]) > 0.0 for name in result.names if name.startswith("flap_")) or any(
            np.any(result[name] != result["pitch_1"]) for name in ("pitch_2", "pitch_3") if name in result
        )

    return any(differ(comparison.results(scheme)) for scheme in comparison.schemes)


def ceiling_rows(comparison: Comparison) -> Rows:
    """Header and rows of ideal removal of 1P, and of 1P and 2P, and the share of it that each scheme reaches."""
    base, *others = comparison.schemes
    table, units = comparison.table(), comparison.units()
    head = ["removed", "quantity", "unit", base, "left", "change %", *(f"share %\n{s}" for s in others)]
    rows = []
    for harmonics, removed in REMOVED.items():
        for kind, quantity in JUDGED:
            change, left = comparison.ceiling_change(harmonics, kind), comparison.ceiling_left(harmonics, kind)
            unit, factor = units[quantity]
            changes = [table.entry(quantity, s).change for s in others]
            shares = [100.0 * c.mean / change.mean if c and change.mean else math.nan for c in changes]
            before = table.entry(quantity, base).value.mean
            row = [removed, quantity, unit, number(before * factor), number(left.mean * factor), change_text(change)]
            rows.append([*row, *("-" if math.isnan(share) else str(round(share)) for share in shares)])
    return head, rows


def seed_rows(comparison: Comparison) -> Rows:
    """Header and rows of all quantities by seed and scheme."""
    head = ["seed", "scheme", *(f"{q.name} [{q.unit}]" for q in comparison.quantities), "wind"]
    rows = []
    for k, (seed, wind) in enumerate(zip(comparison.seeds, comparison.winds, strict=True)):
        for scheme in comparison.schemes:
            numbers = comparison.runs[scheme][k].numbers[WHOLE]
            values = [f"{numbers[q.name] * q.factor:.7g}" for q in comparison.quantities]
            rows.append([str(k + 1 if seed is None else seed), scheme, *values, wind])
    return head, rows


def tuning_rows(tunings: Mapping[str, LoopTuning]) -> Rows:
    """Header and rows of every loop at every operating point: plant, margins, settings."""
    rows = []
    for name, tuning in tunings.items():
        settings = [text(tuning) for text in SETTINGS.values()]
        rows += [[name, *(number(value(p)) for value in MARGINS.values()), *settings] for p in tuning.points]
    return ["loop", *MARGINS, *SETTINGS], rows


MARGINS: dict[str, Callable[[TunedPoint], float]] = {
    "wind m/s": lambda p: p.wind_speed,
    "rotor rpm": lambda p: p.rotor_speed * 30.0 / math.pi,
    "pitch deg": lambda p: math.degrees(p.pitch),
    "plant kN m/deg": lambda p: 1e-3 * math.radians(abs(p.plant)),
    "its phase deg": lambda p: math.degrees(math.atan2(p.plant.imag, p.plant.real)),
    "bandwidth rad/s": lambda p: p.bandwidth,
    "phase margin deg": lambda p: math.degrees(p.phase_margin),
    "gain margin": lambda p: p.gain_margin,
    "largest sensitivity": lambda p: p.sensitivity,
    "leak": lambda p: p.leak,
}
"""Columns of an operating point of a loop."""
SETTINGS: dict[str, Callable[[LoopTuning], str]] = {
    "gain rad/(N m s)": lambda t: f"{t.loop.integral_gain:.4g}",
    "lead s": lambda t: number(t.loop.proportional_gain / t.loop.integral_gain),
    "lowered to": lambda t: number(t.factor),
    "offset deg": lambda t: number(math.degrees(t.loop.offset)),
    "filter damping": lambda t: number(t.loop.filter_damping),
    "halving pitch deg": lambda t: "" if (h := t.loop.gain_halving_pitch) is None else number(math.degrees(h)),
}
"""Columns of a loop."""


def sentence(comparison: Comparison) -> str:
    """One-sentence summary of a comparison."""
    base, *others = comparison.schemes
    table = comparison.table()
    if not others:
        value = table.entry("RootMyc1 DEL", base).value.mean
        return f"{base}: equivalent load of the out-of-plane blade root moment {number(1e-3 * value)} kN m."
    changes = [f"by {change_text(table.entry('RootMyc1 DEL', s).change)} % with {s}" for s in others]
    text = f"The equivalent load of the out-of-plane blade root moment changes, against {base}, {_list(changes)}."
    ideal = change_text(comparison.ceiling_change(1, "load"))
    return f"{text} With 1P removed ideally it would change by {ideal} %." if by_blade(comparison) else text


def _list(parts: list[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"


def write_comparison(
    comparison: Comparison,
    out: str | Path,
    *,
    design: SchemeDesign | None = None,
    title: str = "Control schemes in the same winds",
    facts: Iterable[tuple[str, str]] = (),
    repeat: str = "",
    footer: str = "",
) -> list[Path]:
    """Write tables, figures and the summary page of a comparison into a folder.

    Args:
      comparison: result of :func:`~meltemi.tuning.compare.compare`.
      out: folder, created if needed.
      design: design with gains and margins of the loops.
      title: title of the page.
      facts: names and values below the title.
      repeat: how to reproduce the comparison, such as a command line.
      footer: last line of the page.

    Returns:
      The files.

    Raises:
      InputError: a file cannot be written.
    """
    out = report_folder(out)
    table, units = comparison.table(), comparison.units()
    files = [
        write_csv(out / "comparison.csv", *ensemble_rows(table, units)),
        write_csv(out / "seeds.csv", *seed_rows(comparison)),
        save(spectra_figure(comparison), out / "spectra.png"),
        save(series_figure(comparison), out / "series.png"),
    ]
    pictures = {path.stem: path for path in files[2:]}
    if len(comparison.schemes) > 1:
        duty = [name for name in DUTY if any(table.entry(name, s).value.mean > 0.0 for s in table.schemes)]
        loads, operation = ([name for name in names if name in units] for names in (MAIN, OPERATION))
        pictures["changes"] = save(plot_changes(table, loads, duty, units, operation), out / "changes.png")
        files.append(pictures["changes"])
    tunings = design.tunings if design else {}
    if tunings:
        pictures["bode"] = save(plot_tuning(tunings), out / "bode.png")
        files += [pictures["bode"], write_csv(out / "tuning.csv", *tuning_rows(tunings))]
    for name in ("changes.png", "bode.png", "tuning.csv"):
        if out / name not in files:
            (out / name).unlink(missing_ok=True)  # of an earlier comparison
    sections, lead = _sections(comparison, pictures, tunings, repeat), sentence(comparison)
    document = Document(title, sections, facts=list(facts), lead=lead, footer=footer)
    return [*files, write_page(out / "comparison.html", document)]


IDEAL = (
    "The reduction if these harmonics were removed from the blade root moment completely, with everything else "
    "unchanged. The bands extend a quarter of the rotor frequency, {rotor:.3f} Hz, to either side of the harmonics. "
    "Shares are changes over this change. It is a reference, not a bound: a controller that also reduces loads at "
    "other frequencies passes 100 %."
)
LOOPS = (
    "A loop at nP works on amplitudes, whose frequency has either sign: negative ones are dashed, with mirrored phase. "
    "Loops of one scheme add up, so the gain is also high at the harmonics of the others; margins and sensitivity are "
    "those of all loops together."
)


def _sections(
    comparison: Comparison, pictures: Mapping[str, Path], tunings: Mapping[str, LoopTuning], repeat: str
) -> list[Section]:
    head, rows, groups = main_rows(comparison)
    numbers: list[str | Table | Picture | Code] = []
    if "changes" in pictures:
        numbers.append(Picture(pictures["changes"], "Changes of the main loads, and how far the actuators travel."))
    numbers.append(Table(head, rows, text_columns=2, groups=groups, note=notes(comparison)))
    numbers += [f"Excluded: {failure_line(failure)}" for failure in comparison.failures]
    begin, end = comparison.windows[WHOLE]
    spectra = Picture(pictures["spectra"], f"Power spectral densities, {begin:g} to {end:g} s, mean over seeds.")
    series = Picture(pictures["series"], f"{comparison.winds[0]}: the first evaluated minute.")
    ideal = IDEAL.format(rotor=comparison.rotor_frequency())
    removal = Section("Ideal removal of 1P and 2P", [ideal, Table(*ceiling_rows(comparison), text_columns=3)])
    sections = [
        Section("Results", numbers),
        *([removal] if by_blade(comparison) else []),
        Section("Spectra", [spectra]),
        Section("Series", [series]),
    ]
    if "bode" in pictures:
        bode = Picture(pictures["bode"], "Gain, phase and sensitivity of the loops.")
        sections.append(Section("Gains and margins", [LOOPS, bode, *_tuning_tables(tunings)]))
    if repeat:
        sections.append(Section("Reproduction", [Code(repeat)]))
    return sections


def _tuning_tables(tunings: Mapping[str, LoopTuning]) -> list[Table]:
    """Settings of each loop, and its margins at each point."""
    head, rows = tuning_rows(tunings)
    n = head.index("leak") + 1
    settings = {row[0]: row[n:] for row in rows}
    return [
        Table([head[0], *head[n:]], [[loop, *values] for loop, values in settings.items()], caption="Settings"),
        Table(head[:n], [row[:n] for row in rows], caption="Operating points"),
    ]


def spectra_figure(comparison: Comparison) -> Figure:
    """Spectra of the blade root moments, mean over seeds, with the harmonics marked."""
    figure, axes = new_figure(len(SPECTRA), size=(9.0, 3.6 * len(SPECTRA)))
    for i, channel in enumerate(SPECTRA):
        spectra = {scheme: comparison.spectrum(channel, scheme) for scheme in comparison.schemes}
        plot_spectra(spectra, channel, rotor=comparison.rotor_frequency(), ax=axes[i, 0])
        if i + 1 < len(SPECTRA):
            axes[i, 0].set_xlabel("")
    return figure


def series_figure(comparison: Comparison) -> Figure:
    """Time series of all schemes over a minute of the first wind, and the power reference if there is one."""
    begin, end = comparison.windows[WHOLE]
    results = [comparison.results(s).between(begin, min(begin + SERIES_LENGTH, end)) for s in comparison.schemes]
    shown = [name for name in SERIES if name in results[0]]
    figure = plot(results, shown, comparison.schemes)
    if "power_reference" in results[0]:
        ax = figure.axes[shown.index("generator_power")]
        _, factor = readable_unit(results[0].channel("generator_power"), *(r["generator_power"] for r in results))
        reference = results[0]["power_reference"] * factor
        (line,) = ax.plot(results[0].time, reference, "--", color=INK, linewidth=0.9, label="power reference")
        ax.legend(handles=[line], **ABOVE)
    return figure
