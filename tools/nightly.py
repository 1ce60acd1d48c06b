"""What takes too long for every change, on a clean clone: reproductions, slow tests, verification, fuzzing.

    python tools/nightly.py                       # everything, into ../meltemi-nightly
    python tools/nightly.py --parts wang2021,tests
    python tools/nightly.py --from tests          # this part and those after it
    python tools/nightly.py --quick               # a look at the whole procedure
    python tools/nightly.py --list

It clones the repository's present commit, makes a virtual environment there as the README says, with the rosco package
beside it, and runs one part after another. A part that fails does not end the night. What it found stands in a table,
``nightly.md``, written after each part; the logs are in ``logs``. Begun again on the same commit, it skips the parts
that passed; reproductions go on where they ended. The exit status is 0 if every part passed.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
BIN = "Scripts" if os.name == "nt" else "bin"
SUMMARY = re.compile(r"\d+ (?:passed|failed|errors?|skipped|deselected|xfailed|xpassed)\b")


@dataclass
class Night:
    """Where and how.

    Attributes:
      folder: of everything.
      quick: only a look.
      reference: folder of reference series, or None.
      seed: of the fuzzing.
    """

    folder: Path
    quick: bool
    reference: Path | None
    seed: int

    @property
    def clone(self) -> Path:
        """The clean clone."""
        return self.folder / "meltemi"

    def tool(self, name: str) -> str:
        """An executable of the virtual environment."""
        return str(self.clone / ".venv" / BIN / name)


@dataclass
class Entry:
    """A line of the table."""

    part: str
    status: str
    seconds: float
    found: str


def of_reproduction(text: str) -> str:
    """How many claims hold, of what the command printed."""
    lines = [
        *re.findall(r"\d+ of \d+ claims of the paper hold(?: \([^)]*\))?", text),
        *re.findall(r"Of \d+ conditions .*? (\d+ hold in every seed of both winds \(\d+ of \d+ single cases\))", text),
    ]
    failed = text.count("\nfailed: ")
    return "; ".join([*lines, *([f"{failed} cells failed"] if failed else [])])


def of_tests(text: str) -> str:
    """Counts of the last line."""
    return ", ".join(SUMMARY.findall(text.strip().rpartition("\n")[2]))


def last_line(text: str) -> str:
    """Of the output, without what was written where."""
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("wrote ")]
    return lines[-1].strip() if lines else ""


Part = tuple[Callable[[Night], list[list[str]]], Callable[[str], str]]
"""Commands, run in the clone, and what is told of their output."""


def _install(night: Night) -> list[list[str]]:
    python = night.tool("python")
    return [
        [sys.executable, "-m", "venv", ".venv"],
        [python, "-m", "pip", "install", "-q", "-e", ".[test]"],
        [python, "-m", "pip", "install", "-q", "--no-deps", "rosco>=2.10,<3"],
        [night.tool("meltemi"), "--version"],
    ]


def _reproduction(*arguments: str, whole: tuple[str, ...] = ()) -> Callable[[Night], list[list[str]]]:
    def commands(night: Night) -> list[list[str]]:
        more = ["--quick"] if night.quick else whole
        out = str(night.folder / "-".join(a.lstrip("-") for a in arguments))
        return [[night.tool("meltemi"), "reproduce", *arguments, *more, "--out", out]]

    return commands


def _tests(night: Night) -> list[list[str]]:
    which = ["-k", "journal"] if night.quick else []
    cores = ["-n", "auto", "--dist", "loadfile"]
    return [[night.tool("pytest"), *cores, "-m", "slow or long or rosco", "-p", "no:cacheprovider", *which]]


def _verify(night: Night) -> list[list[str]]:
    out = ["--out", str(night.folder / "verify")]
    if night.quick:
        return [[night.tool("meltemi"), "verify", "--quick", *out]]
    more = ["--reference", str(night.reference)] if night.reference else []
    return [[night.tool("python"), "tools/verification_page.py", *more, *out]]


def _fuzz(night: Night) -> list[list[str]]:
    if not (night.clone / "tools" / "fuzz.py").is_file():
        return []
    seconds = "20" if night.quick else "180"
    return [[night.tool("python"), "tools/fuzz.py", "--seconds", seconds, "--seed", str(night.seed)]]


PARTS: dict[str, Part] = {
    "install": (_install, last_line),
    "he2018": (_reproduction("he2018"), of_reproduction),
    "he2018-rosco": (_reproduction("he2018", "--rosco"), last_line),
    "wang2021": (_reproduction("wang2021"), of_reproduction),
    "palanimuthu2022": (_reproduction("palanimuthu2022", whole=("--beyond", "all")), of_reproduction),
    "tests": (_tests, of_tests),
    "verify": (_verify, last_line),
    "fuzz": (_fuzz, last_line),
}


def run(part: str, night: Night) -> Entry:
    """Run a part; its output goes to its log."""
    commands, told = PARTS[part]
    log = night.folder / "logs" / f"{part}.log"
    log.parent.mkdir(exist_ok=True)
    began, status = time.perf_counter(), "passed"
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"} | {"MPLBACKEND": "agg"}
    wanted = commands(night)
    with log.open("w", encoding="utf-8") as file:
        for command in wanted:
            try:
                ended = subprocess.run(
                    command, cwd=night.clone, stdout=file, stderr=subprocess.STDOUT, env=environment, check=False
                ).returncode
            except OSError as error:
                file.write(f"{command[0]}: {error.strerror}\n")
                ended = 127
            if ended:
                status = f"failed ({ended})"
                break
    text = log.read_text(encoding="utf-8", errors="replace")
    found = told(text) or (last_line(text) if wanted else "not there")
    return Entry(part, status if wanted else "skipped", time.perf_counter() - began, found)


def table(entries: dict[str, Entry], commit: str, quick: bool) -> str:
    """The night in Markdown."""
    lines = [f"Nightly{' (a quick look)' if quick else ''} of commit {commit[:12]}.", ""]
    lines += ["| part | status | seconds | found |", "|---|---|---:|---|"]
    for part in PARTS:
        if part in entries:
            e = entries[part]
            found = e.found.replace("|", "\\|")
            lines.append(f"| {e.part} | {e.status} | {e.seconds:.0f} | {found} |")
    total = sum(e.seconds for e in entries.values())
    failed = sum(e.status.startswith("failed") for e in entries.values())
    lines += ["", f"{len(entries)} of {len(PARTS)} parts run, {failed} failed; {total / 60.0:.0f} minutes."]
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=REPOSITORY.parent / "meltemi-nightly", help="folder of everything")
    parser.add_argument("--parts", default="", help="only these, separated by commas; install comes before them")
    parser.add_argument("--from", dest="first", default="", help="this part and those after it")
    parser.add_argument("--again", action="store_true", help="parts that passed, too")
    parser.add_argument("--quick", action="store_true", help="a look at the whole procedure")
    parser.add_argument("--reference", type=Path, default=REPOSITORY.parent / "shared" / "reference",
                        help="folder of reference series for verification and its tests")  # fmt: skip
    parser.add_argument("--seed", type=int, default=int(time.time()) // 86400, help="of the fuzzing [the day]")
    parser.add_argument("--list", action="store_true", help="name the parts")
    given = parser.parse_args()
    if given.list:
        print("\n".join(PARTS))
        return 0
    wanted = [name.strip() for name in given.parts.split(",") if name.strip()] or list(PARTS)
    if given.first:
        wanted = wanted[wanted.index(given.first) :] if given.first in wanted else [given.first]
    for name in wanted:
        if name not in PARTS:
            parser.error(f"no part {name!r}; there are {', '.join(PARTS)}")
    reference = given.reference.resolve() if given.reference.is_dir() else None
    night = Night(given.out.resolve(), given.quick, reference, given.seed)
    night.folder.mkdir(parents=True, exist_ok=True)
    commit = git("rev-parse", "HEAD")
    known = night.folder / ("quick.json" if given.quick else "whole.json")
    entries: dict[str, Entry] = {}
    if known.is_file():
        kept = json.loads(known.read_text(encoding="utf-8"))
        if kept["commit"] == commit:
            entries = {part: Entry(**entry) for part, entry in kept["entries"].items()}
    if not (night.clone / ".git").is_dir() or git("rev-parse", "HEAD", place=night.clone) != commit:
        shutil.rmtree(night.clone, ignore_errors=True)
        subprocess.run(["git", "clone", "-q", str(REPOSITORY), str(night.clone)], check=True)
        git("checkout", "-q", commit, place=night.clone)
        beside = night.folder / "shared"  # where the tests look for it
        if reference is not None and not beside.exists():
            beside.symlink_to(reference.parent, target_is_directory=True)
    if not Path(night.tool("python")).exists():
        entries.pop("install", None)
    for part in dict.fromkeys(["install", *wanted]):
        if part in entries and entries[part].status == "passed" and not (given.again and part != "install"):
            print(f"{part}: passed before", flush=True)
            continue
        print(f"{part} ...", flush=True)
        entries[part] = run(part, night)
        print(f"{part}: {entries[part].status} in {entries[part].seconds:.0f} s: {entries[part].found}", flush=True)
        kept = {"commit": commit, "entries": {name: asdict(entry) for name, entry in entries.items()}}
        known.write_text(json.dumps(kept, indent=1), encoding="utf-8")
        (night.folder / "nightly.md").write_text(table(entries, commit, given.quick), encoding="utf-8")
        if part == "install" and entries[part].status != "passed":
            break
    print("\n" + table(entries, commit, given.quick))
    return int(any(entry.status.startswith("failed") for entry in entries.values()))


def git(*arguments: str, place: Path = REPOSITORY) -> str:
    return subprocess.run(["git", *arguments], cwd=place, check=True, capture_output=True, text=True).stdout.strip()


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        print("interrupted: begun again, it goes on with the part under way", file=sys.stderr)
        sys.exit(130)
