"""A comparison as tables, pictures, and one page in which all of it stands."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from meltemi.core.errors import InputError
from meltemi.postprocess.ensemble import CONFIDENCE
from meltemi.report.comparison_plots import plot_changes
from meltemi.report.ensemble_tables import change_text, ensemble_rows, scheme_rows
from meltemi.report.html import Code, Picture, Section, Table, write_page
from meltemi.report.plots import new_figure, plot, save
from meltemi.report.spectra_plots import plot_spectra
from meltemi.report.tables import number, write_csv
from meltemi.report.tuning_plots import plot_tuning
from meltemi.studies.compare import SPECTRA, WHOLE, Comparison, failure_line
from meltemi.studies.schemes import SchemeDesign
from meltemi.studies.tuning import LoopTuning

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SERIES_LENGTH = 60.0
"""[s] of series that are drawn."""
SERIES = ("wind_x", "RootMyc1", "OoPDefl1", "pitch_1", "flap_1_angle_1", "generator_power")
MAIN = (
    "RootMyc1 std",
    "RootMyc1 DEL",
    "RootMxc1 DEL",
    "Mtilt DEL",
    "Myaw DEL",
    "OoPDefl1 std",
    "TwrBsMyt DEL",
    "YawBrMyp DEL",
    "YawBrMzp DEL",
    "power std",
    "rotor speed std",
)
"""Of which changes are drawn."""
DUTY = ("pitch travel", "flap travel")
MOST_MEANS = 4
"""Schemes up to which their means stand beside their changes."""
REMOVED = {1: "1P", 2: "1P and 2P"}
JUDGED = {"std": "RootMyc1 std", "load": "RootMyc1 DEL"}
STATISTIC = re.compile(" (std|DEL|mean|max)$")


def main_rows(comparison: Comparison) -> tuple[list[str], list[list[str]], list[tuple[str, int]]]:
    """Head, rows and groups of the table of all quantities."""
    return scheme_rows(comparison.table(), comparison.units(), means=len(comparison.schemes) <= MOST_MEANS)


def notes(comparison: Comparison) -> str:
    """What the words of that table mean."""
    base, *others = comparison.schemes
    sentences = []
    if others:
        interval = f", each with the half-width of its {100.0 * CONFIDENCE:g} % interval"
        several = len(comparison.winds) > 1
        sentences.append(f"Changes are against {base}, formed seed by seed{interval if several else ''}.")
    together = "; of all seeds: their damages together" if len(comparison.winds) > 1 else ""
    sentences.append(f"DEL: damage-equivalent load, 1 Hz, slope 10 for blades and 4 for steel{together}.")
    meanings = {STATISTIC.sub("", q.name): q.about for q in comparison.quantities if q.about}
    return " ".join([*sentences, "; ".join(f"{name}: {about}" for name, about in meanings.items()) + "."])


def ceiling_rows(comparison: Comparison) -> tuple[list[str], list[list[str]]]:
    """Head and rows of what ideal removal of 1P, and of 1P and 2P, would leave, and the share each scheme reaches."""
    base, *others = comparison.schemes
    table, units = comparison.table(), comparison.units()
    head = ["removed", "quantity", "unit", base, "left", "change %", *(f"share %\n{s}" for s in others)]
    rows = []
    for harmonics, removed in REMOVED.items():
        for kind, quantity in (("std", JUDGED["std"]), ("load", JUDGED["load"])):
            change = comparison.ceiling_change(harmonics, "std" if kind == "std" else "load")
            left = comparison.ceiling_left(harmonics, "std" if kind == "std" else "load")
            unit, factor = units[quantity]
            found = [table.entry(quantity, s).change for s in others]
            shares = [100.0 * c.mean / change.mean if c and change.mean else math.nan for c in found]
            before = table.entry(quantity, base).value.mean
            row = [removed, quantity, unit, number(before * factor), number(left.mean * factor), change_text(change)]
            rows.append([*row, *("-" if math.isnan(share) else str(round(share)) for share in shares)])
    return head, rows


def seed_rows(comparison: Comparison) -> tuple[list[str], list[list[str]]]:
    """Head and rows of every quantity of every seed and scheme."""
    head = ["seed", "scheme", *(f"{q.name} [{q.unit}]" for q in comparison.quantities), "wind"]
    rows = []
    for k, (seed, wind) in enumerate(zip(comparison.seeds, comparison.winds, strict=True)):
        for scheme in comparison.schemes:
            numbers = comparison.runs[scheme][k].numbers[WHOLE]
            values = [f"{numbers[q.name] * q.factor:.7g}" for q in comparison.quantities]
            rows.append([str(k + 1 if seed is None else seed), scheme, *values, wind])
    return head, rows


def tuning_rows(tunings: Mapping[str, LoopTuning]) -> tuple[list[str], list[list[str]]]:
    """Head and rows of every loop at every operating point: plant, settings, margins."""
    head = [
        "loop",
        "wind m/s",
        "rotor rpm",
        "pitch deg",
        "plant kN m/deg",
        "its phase deg",
        "bandwidth rad/s",
        "phase margin deg",
        "gain margin",
        "largest sensitivity",
        "leak",
        "gain rad/(N m s)",
        "lead s",
        "lowered to",
        "offset deg",
        "filter damping",
        "halving pitch deg",
    ]
    rows = []
    for name, tuning in tunings.items():
        loop, halving = tuning.loop, tuning.loop.gain_halving_pitch
        lead = loop.proportional_gain / loop.integral_gain
        settings = [f"{loop.integral_gain:.4g}", number(lead), number(tuning.factor)]
        settings += [number(math.degrees(loop.offset)), number(loop.filter_damping)]
        settings.append("" if halving is None else number(math.degrees(halving)))
        for p in tuning.points:
            values = (
                p.wind_speed,
                p.rotor_speed * 30.0 / math.pi,
                math.degrees(p.pitch),
                1e-3 * math.radians(abs(p.plant)),
                math.degrees(math.atan2(p.plant.imag, p.plant.real)),
                p.bandwidth,
                math.degrees(p.phase_margin),
                p.gain_margin,
                p.sensitivity,
                p.leak,
            )
            rows.append([name, *(number(v) for v in values), *settings])
    return head, rows


def sentence(comparison: Comparison) -> str:
    """The result in a sentence."""
    base, *others = comparison.schemes
    table = comparison.table()
    if not others:
        value = table.entry("RootMyc1 DEL", base).value.mean
        return f"{base}: equivalent load of the out-of-plane blade root moment {number(1e-3 * value)} kN m."
    changes = [f"by {change_text(table.entry('RootMyc1 DEL', s).change)} % with {s}" for s in others]
    ideal = comparison.ceiling_change(1, "load")
    return (
        f"The equivalent load of the out-of-plane blade root moment changes, against {base}, {_list(changes)}. "
        f"With 1P removed ideally it would change by {change_text(ideal)} %."
    )


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
    """Write tables, pictures and the page of a comparison into a folder.

    Args:
      comparison: from :func:`~meltemi.studies.compare.compare`.
      out: folder, made if it is not there.
      design: gives gains and margins of the loops.
      title: of the page.
      facts: names and values below it.
      repeat: how the comparison is made again, such as a command line.
      footer: last line of the page.

    Returns:
      The files.

    Raises:
      InputError: a file cannot be written.
    """
    out = Path(out)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror or error})") from None
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
        files.append(save(plot_changes(table, MAIN, duty, units), out / "changes.png"))
        pictures["changes"] = files[-1]
    tunings = design.tunings if design else {}
    if tunings:
        files += [
            save(plot_tuning(tunings), out / "bode.png"),
            write_csv(out / "tuning.csv", *tuning_rows(tunings)),
        ]
        pictures["bode"] = files[-2]
    for name in ("changes.png", "bode.png", "tuning.csv"):
        if out / name not in files:
            (out / name).unlink(missing_ok=True)  # of an earlier comparison
    page = write_page(
        out / "comparison.html",
        title,
        _sections(comparison, pictures, tunings, repeat),
        facts=facts,
        lead=sentence(comparison),
        footer=footer,
    )
    return [*files, page]


def _sections(
    comparison: Comparison, pictures: Mapping[str, Path], tunings: Mapping[str, LoopTuning], repeat: str
) -> list[Section]:
    head, rows, groups = main_rows(comparison)
    numbers: list[str | Table | Picture | Code] = []
    if "changes" in pictures:
        numbers.append(Picture(pictures["changes"], "Changes of the main loads, and how far the actuators travel."))
    numbers.append(Table(head, rows, text_columns=2, groups=groups, note=notes(comparison)))
    numbers += [f"Left out: {failure_line(failure)}" for failure in comparison.failures]
    ceiling_head, ceiling = ceiling_rows(comparison)
    begin, end = comparison.windows[WHOLE]
    found = [
        Section("Results", numbers),
        Section(
            "Ceiling",
            [
                (
                    "What a controller could reach that removes these harmonics of the blade root moment wholly and "
                    "adds nothing elsewhere. Taken out are bands of a quarter of the rotor frequency, "
                    f"{comparison.rotor_frequency():.3f} Hz, to either side of them. Shares are changes over the "
                    "change of the ceiling."
                ),
                Table(ceiling_head, ceiling, text_columns=3),
            ],
        ),
        Section(
            "Spectra",
            [Picture(pictures["spectra"], f"Power spectral densities, {begin:g} to {end:g} s, mean over seeds.")],
        ),
        Section("Series", [Picture(pictures["series"], f"{comparison.winds[0]}: the first minute that is judged.")]),
    ]
    if "bode" in pictures:
        found.append(
            Section(
                "Gains and margins",
                [
                    (
                        "A loop at nP works on amplitudes, whose frequency has either sign: negative ones are dashed, "
                        "with mirrored phase. Loops of one scheme add up, so where another one stands the gain is "
                        "high, too; margins and sensitivity are those of all together."
                    ),
                    Picture(pictures["bode"], "Gain, phase and sensitivity of the loops."),
                    *_tuning_tables(tunings),
                ],
            )
        )
    if repeat:
        found.append(Section("How to repeat it", [Code(repeat)]))
    return found


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
    """A minute of the first wind, all schemes on top of each other."""
    begin, end = comparison.windows[WHOLE]
    results = [comparison.results(s).between(begin, min(begin + SERIES_LENGTH, end)) for s in comparison.schemes]
    return plot(results, [name for name in SERIES if name in results[0]], comparison.schemes)
