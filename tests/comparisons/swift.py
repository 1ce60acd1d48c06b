"""Records of the SWiFT site (NREL/wakebench_swift) as a folder of CSV files, as users have them."""

from __future__ import annotations

import csv
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

GUIDE = Path(__file__).parents[2] / "docs/guide/validation.md"
FIRST = datetime(2000, 1, 1, tzinfo=UTC)
"""Of the first file, the others follow by the hour: the archive has no dates."""


def map_of_the_guide() -> str:
    """The channel map of these files, from the page of the guide."""
    begin = "```yaml\nwind: u_32m\n"
    return begin.removeprefix("```yaml\n") + GUIDE.read_text(encoding="utf-8").split(begin)[1].split("```")[0]


def write_folder(records: Path, out: Path) -> list[Path]:
    """One CSV file a record (``*.npz``) with dates, names with units, and empty cells for missing samples."""
    units = {"generator_power": "kW", "generator_torque": "N m", "rotor_speed": "rpm", "blade_root_flap_moment": "N m"}
    written = []
    for k, path in enumerate(sorted(records.glob("*.npz"))):
        with np.load(path) as file:
            columns = dict(file)
        seconds = columns.pop("time")
        rows = zip(*(x.tolist() for x in columns.values()), strict=True)
        written.append(out / f"{path.stem}.csv")
        with written[-1].open("w", newline="", encoding="utf-8") as csv_file:
            writer = csv.writer(csv_file)
            writer.writerow(["time", *(f"{name} [{units.get(name, 'm/s')}]" for name in columns)])
            for t, row in zip(seconds.tolist(), rows, strict=True):
                date = FIRST + timedelta(hours=k, seconds=round(t, 3))
                writer.writerow([date.isoformat(), *("" if np.isnan(x) else f"{x:.9g}" for x in row)])
    return written
