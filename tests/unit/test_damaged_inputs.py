"""Files that are cut, changed or of another form give one clear error, and nothing is lost to them."""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import replace
from importlib import resources
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from synthetic_base import small_plan

from meltemi.core.errors import InputError, Status
from meltemi.exchange.fmu.controller import fmu_controller
from meltemi.exchange.windio.tree import as_number, as_numbers
from meltemi.farm.layout import Farm
from meltemi.floating.coefficients import DATA, read_coefficients, write_coefficients
from meltemi.floating.members import Member
from meltemi.hydro.hull import Hull
from meltemi.hydro.panels import hull_moments
from meltemi.loads.loadbase import engine
from meltemi.loads.loadbase.engine import OnThreads
from meltemi.loads.loadbase.jobs import CaseRow, jobs_of
from meltemi.loads.loadbase.store import ResultStore, table_of, write_file
from meltemi.reports.workbook import openpyxl, save_workbook
from meltemi.studies.climate.weather import read_weather

HUGE = 10**400


def cut(raw: bytes) -> bytes:
    return raw[: len(raw) // 2]


def flipped(raw: bytes) -> bytes:
    return raw[:2000] + bytes(byte ^ 0xFF for byte in raw[2000:2100]) + raw[2100:]


@pytest.mark.parametrize("damage", [cut, flipped, lambda raw: b"", lambda raw: b"\x93NUMPY" + raw])
def test_a_damaged_file_of_coefficients_is_told(damage: Callable[[bytes], bytes], tmp_path: Path) -> None:
    path = tmp_path / "spar.npz"
    path.write_bytes(damage((DATA / "nrel5mw-spar.npz").read_bytes()))
    with pytest.raises(InputError, match=r"spar\.npz: not a file of coefficients, or damaged"):
        read_coefficients(str(path))


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("damping", lambda a: a[:-1], r"damping: expected finite numbers of shape \(\d+, 6, 6\), found shape"),
        ("heading", lambda a: a[:0], r"excitation: expected finite numbers of shape \(\d+, 0, 6\)"),
        ("infinite", lambda a: a * np.nan, "infinite: .* found values that are not finite"),
        ("frequency", lambda a: a[::-1], "frequency: expected numbers that increase"),
    ],
)
def test_coefficients_that_do_not_fit_are_told(
    name: str, change: Callable[[Any], Any], words: str, tmp_path: Path
) -> None:
    c = read_coefficients("nrel5mw-spar")
    write_coefficients(replace(c, **{name: change(getattr(c, name))}), tmp_path / "other.npz")
    with pytest.raises(InputError, match=rf"other\.npz: {words}"):
        read_coefficients(str(tmp_path / "other.npz"))


@pytest.mark.parametrize("height", [0.0, -10.0, float("nan")])
def test_a_wind_height_of_nothing_is_refused(height: float, tmp_path: Path) -> None:
    path = tmp_path / "site.csv"
    path.write_text("wind_speed,temperature\n8,10\n")
    with pytest.raises(InputError, match=r"site\.csv: wind_height: expected a height above the ground in m, found"):
        read_weather(path, wind_height=height)


def test_integers_beyond_any_number_are_refused() -> None:
    with pytest.raises(InputError, match="farm: positions: "):
        Farm(turbine="nrel5mw", positions=[(0, 0), (HUGE, 0)]).places()
    with pytest.raises(InputError, match="farm: yaw"):
        Farm(turbine="nrel5mw", positions=[(0, 0)], yaw=HUGE).angles()
    with pytest.raises(InputError, match="twist: expected a list of numbers"):
        as_numbers([0.0, HUGE], "twist")
    with pytest.raises(InputError, match="cone: expected a number"):
        as_number(HUGE, "cone")


DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="law" guid="{0}">
  <CoSimulation modelIdentifier="law"/>
  <ModelVariables>
    <ScalarVariable name="generator_torque" valueReference="0" causality="output" initial="calculated"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="1"/></Outputs><InitialUnknowns><Unknown index="1"/></InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""  # noqa: E501


def test_a_unit_for_another_platform_is_told_and_leaves_no_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("fmpy")
    from meltemi.turbine.library import load_turbine

    with zipfile.ZipFile(tmp_path / "law.fmu", "w") as unit:
        unit.writestr("modelDescription.xml", DESCRIPTION)
        unit.writestr("binaries/win32/law.dll", b"")
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    controller = fmu_controller(tmp_path / "law.fmu", load_turbine("nrel5mw"))
    with pytest.raises(InputError, match=r"law\.fmu: its library cannot be loaded here .* one for win32, this is"):
        controller.fresh()  # type: ignore[misc]
    assert not list((tmp_path / "temporary").glob("meltemi_fmu_*"))


@pytest.mark.parametrize("kind", ["text", "number"])
def test_warnings_of_a_case_that_are_no_list_are_told(kind: str, tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    table = table_of([CaseRow("a", "key", Status.OK)])
    other = pa.array(["doubtful"] if kind == "text" else [1.0])
    write_file(table.set_column(table.column_names.index("warnings"), "warnings", other), tmp_path / "results")
    with pytest.raises(InputError, match=r"parquet: cannot be read \(warnings are .*, not a list of texts\)"):
        ResultStore(tmp_path).table({"key": ["a"]})


def test_a_full_disk_keeps_the_cases_that_were_finished_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cases that take long are written as they finish, long before they make a group."""
    pytest.importorskip("pyarrow")
    jobs = jobs_of(small_plan())[:5]
    assert len(jobs) == 5
    store = ResultStore(tmp_path)

    class Shop:
        def run(self, job: Any) -> Any:
            return job

        row = None

    class Finishing:
        def __init__(self, runs: Any, *, done: Any, **_: Any) -> None:
            self.runs, self.done, self.interrupted = runs, done, False

        def run(self) -> None:
            for job in self.runs:
                now[0] += 1000.0
                self.done(SimpleNamespace(name=job.name, value=CaseRow(job.name, job.key, Status.OK), status=Status.OK))

    now, written = [0.0], []

    def full(handle: int) -> None:
        written.append(handle)
        if len(written) > 6:  # a file and its folder each
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(engine, "Workshop", Shop)
    monkeypatch.setattr(engine, "Batch", Finishing)
    monkeypatch.setattr(engine, "perf_counter", lambda: now[0])
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match=r"results/\w+\.parquet: cannot be written \(No space left on device\)"):
        OnThreads(workers=1)([jobs], lambda rows: store.write(rows) and None)
    found = ResultStore(tmp_path)
    assert found.places.keys() == {job.key for job in jobs[:3]} and not found.unreadable


def test_text_that_begins_with_an_equals_sign_stays_text(tmp_path: Path) -> None:
    book = openpyxl().Workbook()
    book.active.append(["=1+1", "+2", 3.0, '=HYPERLINK("x")'])
    save_workbook(book, tmp_path / "book.xlsx")
    (row,) = openpyxl().load_workbook(tmp_path / "book.xlsx").active.iter_rows()
    assert [cell.value for cell in row] == ["=1+1", "+2", 3.0, '=HYPERLINK("x")']
    assert [cell.data_type for cell in row] == ["s", "s", "n", "s"]
    with zipfile.ZipFile(tmp_path / "book.xlsx") as parts:
        assert b"<f>" not in parts.read("xl/worksheets/sheet1.xml")


BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
PAGE = """<meta charset="utf-8"><div id="root"><div id="plots"></div></div><script>
{script}
const find = (id) => document.getElementById(id);
const live = {{ sliders: [], controllers: [{{ name: {name}, about: "" }}], faults: {{}}, requests: {{}}, state: {{}} }};
const clock = {{ find, view: {{ root: find("root") }}, live }};
try {{ LiveClock.prototype.build.call(clock, {{}}); }} catch (e) {{ if (!clock.panel) throw e; }} // no button
const [option, ...others] = clock.panel.querySelector("select").options;
const same = [option.text === {name}, option.value === {name}];
const told = [...same, others.length, document.images.length, window.done];
document.body.textContent = `told ${{told.join(" ")}}`;
</script>"""


@pytest.mark.slow
@pytest.mark.skipif(BROWSER is None, reason="needs chromium or google-chrome")
def test_the_name_of_a_controller_is_text_on_the_live_page(tmp_path: Path) -> None:
    script = resources.files("meltemi.view").joinpath("viewer/live.js").read_text(encoding="utf-8")
    name = json.dumps('a</option><option>b<img src=x onerror="window.done=1">')
    (tmp_path / "page.html").write_text(PAGE.format(script=script, name=name), encoding="utf-8")
    how = ("--headless=new", "--no-sandbox", "--disable-gpu", "--dump-dom", f"--user-data-dir={tmp_path / 'profile'}")
    page = (tmp_path / "page.html").as_uri()
    made = subprocess.run([str(BROWSER), *how, page], capture_output=True, text=True, timeout=60.0, check=True)
    assert "told true true 0 0 " in made.stdout, made.stdout[-500:]


def test_a_hull_too_large_for_its_panels_is_told() -> None:
    hull = Hull(depth=200.0, members=[Member(start=[0, 0, -20], end=[480, 480, 5], diameter=9.0)])
    with pytest.raises(InputError, match=r"hull: .* cells of 1 m for its .* check start and end"):
        hull_moments(hull, 2.0)
