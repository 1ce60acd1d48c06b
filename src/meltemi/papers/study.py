"""Framework of the reproductions: runs a study and writes its page, tables and figures."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import meltemi
from meltemi.core.files import write_text
from meltemi.core.physics import PHYSICS
from meltemi.papers.verdict import UNJUDGED
from meltemi.report.plots import save
from meltemi.report.tables import write_csv
from meltemi.reports.blocks import Block, Document, Picture, Section, Table
from meltemi.reports.html import write_page
from meltemi.reports.markdown import alone, documented, plain, section_lines, sections
from meltemi.tuning.run_store import current, guarded, run_store
from meltemi.turbine.definition import Turbine

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Found = TypeVar("Found")
Progress = Callable[[float, str], None]
"""Called with the completed fraction and the current step."""
PACKAGE = "meltemi.papers"
MADE_BY = f"meltemi {meltemi.__version__}, physics version {PHYSICS}"
NUMBER = re.compile(r"[-+]?\d[\d.e+-]*")
QUICK = "few, short runs, for a first impression only; ?: what two seeds do not tell"


Draw = Callable[[str, str, "Callable[[], Figure]"], Block]
"""Draws a figure of a file name and a caption: a picture, or a text that says why it could not be drawn."""


@dataclass(frozen=True)
class Contents:
    """Content of the page of a study; texts are Markdown.

    Attributes:
      lead: the result in a few sentences.
      chapters: by the names of their tables' files.
      facts: names and values, such as turbine and seeds.
      shown: tables for the terminal.
      files: that were written beside.
    """

    lead: str
    chapters: Mapping[str, Section]
    facts: Sequence[tuple[str, str]]
    shown: Sequence[Table]
    files: Sequence[Path] = ()


@dataclass(frozen=True)
class Study(Generic[Found]):
    """A paper and its reproduction.

    Attributes:
      name: of its page and of its files; of its folder here unless it is applied.
      title: of the page.
      source: the paper.
      run: simulates everything: ``run(quick=, workers=, progress=, partly=, parts=)``; ``partly`` is called with what
        was found whenever a page is worth writing.
      figures: of the paper, by file name: captions and what draws them.
      contents: what is said of the runs.
      parts: names of parts beyond the paper that are run only if asked for. The chapter of each is a file of its own,
        too; the page has all of them that lie in the folder.
      texts: files at the end of the page.
      runs: of what was found those that the figures are drawn from.
      needs: optional packages that the whole needs.
      parts_need: optional packages by the claims and parts that need them, which cannot be judged without.
      intro: begin of the page, in place of the file ``before.md``.
      applied: the study of another turbine, without claims.
    """

    name: str
    title: str
    source: str
    run: Callable[..., Found]
    figures: Mapping[str, tuple[str, Callable[[Any], Figure]]]
    contents: Callable[[Found, Path, Draw], Contents]
    parts: Sequence[str] = ()
    texts: Sequence[str] = ("after.md",)
    runs: Callable[[Found], Any] = lambda found: found
    needs: Sequence[str] = ()
    parts_need: Mapping[str, Sequence[str]] = field(default_factory=dict)
    intro: str | None = None
    applied: Callable[[Turbine], Study[Any]] | None = None

    @property
    def before(self) -> str:
        """Begin of the page."""
        return self.text("before.md") if self.intro is None else self.intro

    def text(self, name: str) -> str:
        """Text of one of its Markdown files."""
        return (Path(__file__).parent / self.name / name).read_text(encoding="utf-8")

    def markdown(
        self, lead: str, chapters: Mapping[str, Section], figures: Sequence[Section], out: Path, made_by: str = MADE_BY
    ) -> str:
        """The page for the documentation."""
        lines = [self.before, lead, "", f"*Computed by {made_by}.*", ""]
        for name, chapter in chapters.items():
            lines += section_lines(chapter) if name not in self.parts else []
        files = [out / f"{name}.md" for name in self.parts]
        lines += [file.read_text(encoding="utf-8") for file in files if file.is_file()]
        lines += chain.from_iterable(map(section_lines, figures))
        return "\n".join([*lines, *map(self.text, self.texts)])


@dataclass(frozen=True)
class Reproduction:
    """Result of a reproduction.

    Attributes:
      tables: for the terminal.
      lead: the result in a few sentences.
      files: that were written.
      page: as Markdown for the documentation: linked to its other pages, its pictures in a folder of the study's name.
      failed: reasons by cell that failed.
      doubtful: findings by cell whose run left what the model is made for.
    """

    tables: Sequence[Table]
    lead: str
    files: Sequence[Path]
    page: str
    failed: Mapping[str, str] = field(default_factory=dict)
    doubtful: Mapping[str, str] = field(default_factory=dict)


def reproduce(
    study: Study[Any],
    out: Path,
    *,
    quick: bool = False,
    workers: int | None = None,
    progress: Progress = lambda share, what: None,
    parts: Sequence[str] = (),
) -> Reproduction:
    """Run a study and write its page, tables and figures.

    Args:
      study: which.
      out: folder for page, tables and figures; it must exist.
      quick: few and short runs: a look, nothing to judge by.
      workers: threads.
      progress: called with the completed fraction and the current step.
      parts: of what lies beyond the paper.
    """
    began, drawings = time.perf_counter(), dict[str, Block]()

    def draw(name: str, caption: str, of: Callable[[], Figure]) -> Block:
        if not isinstance(drawings.get(name), Picture):  # perhaps what it needs is there now
            drawings[name] = drawn(name, caption, of, out)
        return drawings[name]

    def write(found: Any) -> Reproduction:
        runs = study.runs(found)
        pictures = [draw(name, caption, partial(of, runs)) for name, (caption, of) in study.figures.items()]
        figures = [Section("The paper's figures", pictures)] if pictures else []
        said = study.contents(found, out, draw)
        own = {name: chapter for name, chapter in said.chapters.items() if name not in study.parts}
        chapters = {**own, **failed_chapters(), **said.chapters}
        files = [d.png for d in drawings.values() if isinstance(d, Picture) and isinstance(d.png, Path)]
        for name, chapter in chapters.items():
            files += (write_chapter if name in study.parts else write_tables)(chapter, name, out)
        made_by = MADE_BY + (f"; {QUICK}" if quick else "")
        text = study.markdown(said.lead, chapters, figures, out, made_by)
        files.append(write_text(out / f"{study.name}.md", alone(text)))
        before = sections(study.before, "Paper and reproduction")
        after = chain.from_iterable(sections(study.text(name), "Notes") for name in study.texts)
        facts = [*said.facts, ("computed by", made_by), ("computed in", f"{time.perf_counter() - began:.0f} s")]
        whole = [*before, *chapters.values(), *figures, *after]
        page = Document(study.title, whole, facts=facts, lead=said.lead, footer=study.source)
        html = write_page(out / f"{study.name}.html", plain(page))
        return Reproduction(said.shown, said.lead, [*files, *said.files, html], documented(text, study.name))

    with run_store(out, f"{study.name}, quick {quick}", PACKAGE) as book:
        found = study.run(quick=quick, workers=workers, progress=progress, partly=write, parts=parts)
        return replace(write(found), **book.problems())


def span(progress: Progress, begin: float, length: float) -> Progress:
    """Progress callback of a part: its first fraction of the whole, and its length."""
    return lambda share, what: progress(begin + length * share, what)


def applied(study: Study[Any], turbine: Turbine, words: str, **changes: Any) -> Study[Any]:
    """A study with another turbine: a page of its own, without claims and without the paper's texts.

    Args:
      study: of the paper.
      turbine: the other one.
      words: what of the paper is applied.
      changes: of the fields of the study.
    """
    title = f"{words}, applied to {turbine.name}"
    intro = f"# {title}\n\nMethods of: {study.source} Nothing here is a claim of the paper.\n"
    own: dict[str, Any] = {"figures": {}, "texts": (), "parts": (), "applied": None, "intro": intro, "title": title}
    name = re.sub(r"[^\w.-]+", "_", turbine.name)  # of files
    return replace(study, name=f"{study.name}_{name}", **own | changes)


def told(progress: Progress, what: str) -> Callable[[float], None]:
    """Progress callback for one kind of runs."""
    return lambda share: progress(share, what)


def worded(of: Callable[[], str], subject: str) -> str:
    """Sentences, or one that says why their subject cannot be judged."""
    return guarded(of, lambda why: f"{subject} {UNJUDGED}{why}.")


def tabled(caption: str, of: Callable[[], Table]) -> Table:
    """A table, or one that says why it cannot be made."""
    return guarded(of, lambda why: Table([caption], [[f"cannot be made: {why}"]], caption))


def answered(
    heading: str, verdict: Callable[[], str] | None, drawings: Sequence[Block], tables: Callable[[], Sequence[Table]]
) -> Section:
    """A chapter that begins with the answer in words, if there is one."""
    made = guarded(tables, lambda why: [Table([heading], [[f"cannot be made: {why}"]], heading)])
    words = worded(verdict, "The answer").split("\n\n") if verdict else []
    return Section(heading, [*words, *drawings, *made])


def drawn(name: str, caption: str, draw: Callable[[], Figure], out: Path) -> Block:
    """A figure with its caption; a text with the reason if it cannot be drawn."""

    def picture() -> Block:
        return Picture(save(draw(), out / f"{name}.png"), caption)

    return guarded(picture, lambda why: f"*{caption}: cannot be drawn: {why}*")


def write_tables(chapter: Section, name: str, out: Path) -> list[Path]:
    """Write each table of a chapter as a CSV file; several tables are numbered."""
    tables = [each for each in chapter.content if isinstance(each, Table)]
    names = [name] if len(tables) == 1 else [f"{name}_{i}" for i, _ in enumerate(tables, start=1)]
    return [write_csv(out / f"{name}.csv", t.head, t.texts) for name, t in zip(names, tables, strict=True)]


def write_chapter(chapter: Section, name: str, out: Path) -> list[Path]:
    """Write the tables of a chapter as CSV files and the whole as a Markdown file."""
    text = "\n".join(section_lines(chapter))
    return [*write_tables(chapter, name, out), write_text(out / f"{name}.md", text)]


def failed_chapters() -> dict[str, Section]:
    """Tables of failed and of doubtful cells, if any."""
    book = current()
    listed = {
        "failed": ("What failed", book.failed, "Cells that failed; what needs them is not judged"),
        "doubtful": ("Doubtful runs", book.doubtful, "Runs beyond what the model is made for; they count all the same"),
    }
    return {
        name: Section(heading, [Table(["cells", "reason"], by_kind(cells), caption, text_columns=2)])
        for name, (heading, cells, caption) in listed.items()
        if cells
    }


def by_kind(cells: Mapping[str, str]) -> list[tuple[str, str]]:
    """Rows of cells with their reasons, those that differ in numbers only in one row with the first of them."""
    kinds: dict[str, list[str]] = {}
    for cell, why in cells.items():
        kinds.setdefault(NUMBER.sub("#", why), []).append(cell)
    more = {kind: f", and {len(names) - 1} more" if len(names) > 1 else "" for kind, names in kinds.items()}
    return [(names[0] + more[kind], cells[names[0]]) for kind, names in kinds.items()]
