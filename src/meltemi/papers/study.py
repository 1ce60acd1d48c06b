"""Framework of the reproductions: run a study and write its page, tables and figures."""

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
from meltemi.tuning.run_store import attempt, current, guarded, run_store
from meltemi.turbine.definition import Turbine

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Results = TypeVar("Results")
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
      chapters: chapters by the file names of their tables.
      facts: names and values, such as turbine and seeds.
      shown: tables for the terminal.
      files: further files that were written.
    """

    lead: str
    chapters: Mapping[str, Section]
    facts: Sequence[tuple[str, str]]
    shown: Sequence[Table]
    files: Sequence[Path] = ()


@dataclass(frozen=True)
class Study(Generic[Results]):
    """A paper and its reproduction.

    Attributes:
      name: name of the page and of the files; also of the folder here, unless the study is applied.
      title: title of the page.
      source: citation of the paper.
      run: runs all simulations: ``run(quick=, workers=, progress=, partly=, parts=)``; ``partly`` is called with the
        results so far whenever a page is worth writing.
      figures: figures of the paper by file name: captions and functions that draw them.
      contents: function that evaluates the results for the page.
      parts: names of parts beyond the paper that are only run on request. The chapter of each is also a separate file;
        the page includes all chapters in the folder.
      texts: files at the end of the page.
      runs: selects from the results those for the figures.
      needs: optional packages that the study needs.
      parts_need: optional packages by the claims and parts that need them.
      intro: beginning of the page, in place of the file ``before.md``.
      applied: creates the study of another turbine, without claims.
    """

    name: str
    title: str
    source: str
    run: Callable[..., Results]
    figures: Mapping[str, tuple[str, Callable[[Any], Figure]]]
    contents: Callable[[Results, Path, Draw], Contents]
    parts: Sequence[str] = ()
    texts: Sequence[str] = ("after.md",)
    runs: Callable[[Results], Any] = lambda results: results
    needs: Sequence[str] = ()
    parts_need: Mapping[str, Sequence[str]] = field(default_factory=dict)
    intro: str | None = None
    applied: Callable[[Turbine], Study[Any]] | None = None

    @property
    def before(self) -> str:
        """Beginning of the page."""
        return self.text("before.md") if self.intro is None else self.intro

    def text(self, name: str) -> str:
        """Text of a Markdown file of the study."""
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
      tables: tables for the terminal.
      lead: the result in a few sentences.
      files: files that were written.
      page: page as Markdown for the documentation: with links to its other pages and figures in a folder of the
        study's name.
      failed: reasons by failed cell.
      doubtful: findings by cell whose run left the range of validity of the model.
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
    shard: tuple[int, int] = (1, 1),
    dask: str | None = None,
) -> Reproduction:
    """Run a study and write its page, tables and figures.

    Args:
      study: study to reproduce.
      out: existing folder for page, tables and figures.
      quick: few and short runs, for a first look only.
      workers: number of threads.
      progress: callback with the completed fraction and the current step.
      parts: parts beyond the paper to run.
      shard, dask: as of :func:`~meltemi.tuning.run_store.run_store`.
    """
    began, drawings = time.perf_counter(), dict[str, Block]()

    def draw(name: str, caption: str, of: Callable[[], Figure]) -> Block:
        if not isinstance(drawings.get(name), Picture):  # its results may be complete now
            drawings[name] = guarded_figure(name, caption, of, out)
        return drawings[name]

    def write(results: Any) -> Reproduction:
        runs = study.runs(results)
        pictures = [draw(name, caption, partial(of, runs)) for name, (caption, of) in study.figures.items()]
        figures = [Section("The paper's figures", pictures)] if pictures else []
        contents = study.contents(results, out, draw)
        page_chapters = {name: chapter for name, chapter in contents.chapters.items() if name not in study.parts}
        chapters = {**page_chapters, **failed_chapters(), **contents.chapters}
        files = [d.png for d in drawings.values() if isinstance(d, Picture) and isinstance(d.png, Path)]
        for name, chapter in chapters.items():
            files += (write_chapter if name in study.parts else write_tables)(chapter, name, out)
        made_by = MADE_BY + (f"; {QUICK}" if quick else "")
        text = study.markdown(contents.lead, chapters, figures, out, made_by)
        files.append(write_text(out / f"{study.name}.md", alone(text)))
        before = sections(study.before, "Paper and reproduction")
        after = chain.from_iterable(sections(study.text(name), "Notes") for name in study.texts)
        facts = [*contents.facts, ("computed by", made_by), ("computed in", f"{time.perf_counter() - began:.0f} s")]
        whole = [*before, *chapters.values(), *figures, *after]
        page = Document(study.title, whole, facts=facts, lead=contents.lead, footer=study.source)
        html = write_page(out / f"{study.name}.html", plain(page))
        return Reproduction(
            contents.shown, contents.lead, [*files, *contents.files, html], documented(text, study.name)
        )

    with run_store(out, f"{study.name}, quick {quick}", PACKAGE, shard, dask) as book:
        results = study.run(quick=quick, workers=workers, progress=progress, partly=write, parts=parts)
        return replace(write(results), **book.problems())


def run_parts(
    studies: Mapping[str, Callable[..., Any]],
    progress: Progress,
    partly: Callable[[Mapping[str, Any]], object] = lambda done: None,
) -> dict[str, Any]:
    """Results of parts beyond a paper by name; a failed part becomes a ``FailedResult``.

    Args:
      studies: function of each part, with the argument ``progress``.
      progress: callback of all of them.
      partly: called before each part with the results of those before.
    """
    done: dict[str, Any] = {}
    for i, (name, study) in enumerate(studies.items()):
        partly(dict(done))
        done[name] = attempt(name, study, progress=span(progress, i / len(studies), 1.0 / len(studies)))
    return done


def span(progress: Progress, begin: float, length: float) -> Progress:
    """Progress callback of a part that begins at a fraction of the whole and has a length."""
    return lambda share, what: progress(begin + length * share, what)


def applied(study: Study[Any], turbine: Turbine, words: str, **changes: Any) -> Study[Any]:
    """A study with another turbine: a separate page without claims and without the paper's texts.

    Args:
      study: study of the paper.
      turbine: the other turbine.
      words: title of the applied method.
      changes: other fields of the study.
    """
    title = f"{words}, applied to {turbine.name}"
    intro = f"# {title}\n\nMethods of: {study.source} Nothing here is a claim of the paper.\n"
    name = re.sub(r"[^\w.-]+", "_", turbine.name)  # for file names
    replaced: dict[str, Any] = {"figures": {}, "texts": (), "parts": (), "parts_need": {}, "applied": None}
    replaced |= {"name": f"{study.name}_{name}", "intro": intro, "title": title, "runs": lambda results: results}
    return replace(study, **replaced | changes)


def step_progress(progress: Progress, what: str) -> Callable[[float], None]:
    """Progress callback for one kind of runs."""
    return lambda share: progress(share, what)


def guarded_text(of: Callable[[], str], subject: str) -> str:
    """Text from a function, or a sentence why its subject cannot be judged."""
    return guarded(of, lambda why: f"{subject} {UNJUDGED}{why}.")


def guarded_table(caption: str, of: Callable[[], Table]) -> Table:
    """Table from a function, or one that states why the function failed."""
    return guarded(of, lambda why: Table([caption], [[f"not available: {why}"]], caption))


def answer_chapter(
    heading: str, verdict: Callable[[], str] | None, drawings: Sequence[Block], tables: Callable[[], Sequence[Table]]
) -> Section:
    """Chapter that begins with a verdict, if there is one."""
    content = guarded(tables, lambda why: [Table([heading], [[f"not available: {why}"]], heading)])
    words = guarded_text(verdict, "The answer").split("\n\n") if verdict else []
    return Section(heading, [*words, *drawings, *content])


def guarded_figure(name: str, caption: str, draw: Callable[[], Figure], out: Path) -> Block:
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
        "doubtful": ("Doubtful runs", book.doubtful, "Runs outside of the model's validity; they count all the same"),
    }
    return {
        name: Section(heading, [Table(["cells", "reason"], by_kind(cells), caption, text_columns=2)])
        for name, (heading, cells, caption) in listed.items()
        if cells
    }


def by_kind(cells: Mapping[str, str]) -> list[tuple[str, str]]:
    """Rows of cells with their reasons; reasons that only differ in numbers share a row."""
    kinds: dict[str, list[str]] = {}
    for cell, why in cells.items():
        kinds.setdefault(NUMBER.sub("#", why), []).append(cell)
    more = {kind: f", and {len(names) - 1} more" if len(names) > 1 else "" for kind, names in kinds.items()}
    return [(names[0] + more[kind], cells[names[0]]) for kind, names in kinds.items()]
