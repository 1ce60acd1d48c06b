"""All comparisons for the pages of the verification: ``meltemi verify`` and stored runs of OpenFAST.

    python tools/verification_page.py [--offshore] [--reference FOLDER] [--out docs/verification]

Writes verification.md, or offshore.md, with all rows and pictures. The folder has complete series and wind boxes in
``openfast`` and ``openfast_offshore``; with it ten minutes of turbulence are compared, on land or at sea.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from comparisons.known import KNOWN
from comparisons.studies import at_sea, on_land
from meltemi.verification.table import VerificationReport
from meltemi.verification.verification import FULL, compared


def main() -> int:
    parser = argparse.ArgumentParser(description=str(__doc__).splitlines()[0])
    parser.add_argument("--offshore", action="store_true", help="only turbines at sea")
    parser.add_argument("--reference", type=Path, help="folder of complete series")
    parser.add_argument("--out", type=Path, default=Path("out"))
    given = parser.parse_args()
    needed = "openfast_offshore" if given.offshore else "openfast"
    if given.reference is not None and not (given.reference / needed).is_dir():
        parser.error(f"--reference {given.reference}: no folder {needed!r} in it")
    studies = at_sea(given.reference) if given.offshore else [*FULL, *on_land(given.reference)]
    tables = compared(studies, KNOWN, lambda share: None, print, lambda table: print(table.title, flush=True))
    report = VerificationReport(tables, "offshore" if given.offshore else "verification")
    print(*report.write(given.out), report.summary(), sep="\n")
    return int(report.failed)


if __name__ == "__main__":
    sys.exit(main())
