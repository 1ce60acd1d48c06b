"""``meltemi diff``: comparison of two results of the same case."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import meltemi
from meltemi.app.terminal import OutOption, print_table, progress_bar, suggest, warn, write_results, wrote
from meltemi.core.formats import suffixes
from meltemi.postprocess.formats import FORMATS

LISTED = 12
"""Largest number of printed channels that only one result contains."""


def diff(
    ours: Annotated[Path, f"First result: {suffixes(FORMATS)}."],
    theirs: Annotated[Path, "Second result, the reference."],
    channels: Annotated[
        tuple[str, ...] | None, "Channels, separated by commas; node_6_alpha_1=B1N1Alpha pairs names [all common]."
    ] = None,
    begin: Annotated[float | None, "Start of the compared interval [s]."] = None,
    end: Annotated[float | None, "End of the compared interval [s]."] = None,
    out: OutOption = Path("out"),
) -> None:
    """Compare two results channel by channel; writes a table and a plot."""
    first, second = meltemi.read_result(ours), meltemi.read_result(theirs)
    with progress_bar("differences") as progress:
        differences = meltemi.analysis.compare_results(first, second, channels, begin=begin, end=end, progress=progress)
    from meltemi.studies.difference_plots import difference_rows, short_difference_rows

    labels = _labels(ours, theirs)
    title, every = f"{labels[0]} against {labels[1]}", difference_rows(differences, labels)
    figure = meltemi.plots.plot_differences(differences, channels, labels=labels)
    files = write_results(out / "differences", every, figure)
    print_table(title, *short_difference_rows(differences), text_columns=2, all_rows=every)
    print(
        "mean, std, DEL: of the second result, and change of the first in percent; a mean near 0: in percent of the std"
    )
    print("DEL: damage-equivalent load, 1 Hz, slope 10 for blades, 3 for mooring lines, 4 for other loads")
    warn((*first.warnings, *second.warnings))
    for note in differences.notes:
        print(note)
    for label, names in zip(labels, (differences.only_first, differences.only_second), strict=True):
        if names:
            more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
            print(f"only in {label}: {', '.join(names[:LISTED])}{more}")
    wrote(*files)
    name = max(differences.channels, key=lambda c: c.distance if c.distance == c.distance else 0.0).channel.name
    suggest(
        *(("channels", "--explain", name) if channels else ("diff", ours, theirs, "--channels", name, "--out", out))
    )


def _labels(ours: Path, theirs: Path) -> tuple[str, str]:
    """Names of the files, with their folders if the names are equal."""
    if ours.name != theirs.name:
        return ours.name, theirs.name
    return str(ours), str(theirs)
