"""Code of the pages that tests/docs/test_pages.py does not run: commands, notebooks, long or special blocks."""

from __future__ import annotations

import ast
import importlib
import json
import re
import shlex
from functools import cache
from importlib.util import find_spec
from itertools import groupby
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

import pytest
import typer
from ruamel.yaml import YAML

import meltemi
from meltemi.app.cli import app

ROOT = Path(__file__).parents[2]
DOCS = sorted((ROOT / "docs").rglob("*.md"))
TEXTS = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in (ROOT / "README.md", *DOCS)}
NOTEBOOKS = sorted(path.stem for path in (ROOT / "examples" / "notebooks").glob("*.py"))
OWN_CODE = ("floating", "neural_controller", "validation", "vortex_wake")
"""Notebooks that compile machine code which no other test needs, or take more than ten seconds."""


@cache
def commands() -> Any:
    """The command line with all its commands."""
    return typer.main.get_command(app)


def blocks(page: str, kind: str) -> list[str]:
    return re.findall(rf"^```{kind}\n(.*?)^```", TEXTS[page], re.MULTILINE | re.DOTALL)


OF_ALL = ("--help", "--version", "--debug", "--install-completion", "--show-completion")
"""Options of ``meltemi`` itself."""


def calls(text: str) -> list[list[str]]:
    """Arguments of every ``meltemi`` in shell blocks and between backticks."""
    shell = "\n".join(re.findall(r"^```sh\n(.*?)^```", text, re.MULTILINE | re.DOTALL)).replace("\\\n", " ")
    prose = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    lines = [*shell.splitlines(), *(" ".join(code.split()) for code in re.findall(r"`(meltemi\s[^`]+)`", prose))]
    found = []
    for line in lines:
        lexer = shlex.shlex(line, posix=True, punctuation_chars=True)
        lexer.whitespace_split = True
        for ends, part in groupby(lexer, key=lambda word: set(word) <= set("();<>|&")):
            words = [] if ends else list(part)
            here = [i for i, word in enumerate(words) if Path(word).name == "meltemi"]
            if here and words[here[-1] + 1 :]:
                found.append(words[here[-1] + 1 :])
    return found


@pytest.mark.parametrize("page", [page for page, text in TEXTS.items() if calls(text)])
def test_commands_and_options_exist(page: str) -> None:
    for words in calls(TEXTS[page]):
        command: Any = commands()
        rest = [word for word in words if word not in OF_ALL]
        if not rest or rest[0] == "COMMAND":
            continue
        while hasattr(command, "commands") and rest:
            name = rest.pop(0)
            command = command.get_command(command.context_class(command), name)
            assert command is not None, f"{page}: meltemi {' '.join(words)}: no command {name}"
        if "..." in rest or hasattr(command, "commands"):
            continue
        command.make_parser(command.context_class(command)).parse_args(rest)  # an unknown option raises


def test_the_finder_of_commands_finds() -> None:
    text = "```sh\npip install . && .venv/bin/meltemi run x \\\n  --out y   # simulate\n```\n`meltemi\nturbines`"
    assert calls(text) == [["run", "x", "--out", "y"], ["turbines"]]


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.long) if n in OWN_CODE else n for n in NOTEBOOKS])
def test_notebook_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With its reduced values."""
    if name == "learning":
        pytest.importorskip("stable_baselines3", reason="needs the extra rl")
    monkeypatch.syspath_prepend(ROOT / "tools")
    monkeypatch.chdir(tmp_path)
    import matplotlib.pyplot as plt

    text = (ROOT / "examples" / "notebooks" / f"{name}.py").read_text(encoding="utf-8")
    code = [source for kind, source in importlib.import_module("notebooks").cells(text, reduced=True) if kind == "code"]
    exec(compile("\n".join(code), name, "exec"), {"__name__": "notebook"})
    plt.close("all")


@pytest.mark.parametrize("name", NOTEBOOKS)
def test_notebook_is_that_of_its_script(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Remade by ``python tools/notebooks.py``; with at least one picture, below 400 kB, 1 MB with a view."""
    monkeypatch.syspath_prepend(ROOT / "tools")
    tool = importlib.import_module("notebooks")
    script = (ROOT / "examples" / "notebooks" / f"{name}.py").read_text(encoding="utf-8")
    file = ROOT / "docs" / "tutorials" / f"{name}.ipynb"
    cells = json.loads(file.read_text(encoding="utf-8"))["cells"]
    assert [(cell["cell_type"], "".join(cell["source"])) for cell in cells] == tool.cells(script)
    assert not [o for cell in cells for o in cell.get("outputs", ()) if o["output_type"] == "error"]
    text, files = tool.page(name)
    most = 1_500_000 if any(each.endswith(".html") for each in files) else 400_000
    assert text.startswith("# ") and f"{name}-0.png" in files and file.stat().st_size < most
    assert name in tool.names() and f"]({name}.md)" in tool.gallery()


def test_all_python_of_the_pages_is_in_a_test() -> None:
    """By the name of its page, and by its title where it has one other than that of a file that the page imports."""
    tests = "".join(path.read_text(encoding="utf-8") for path in Path(__file__).parents[1].rglob("test_*.py"))
    tests = tests.replace("\\", "")
    for page, text in TEXTS.items():
        if re.search(r"^```python$", text, re.MULTILINE):
            assert Path(page).name in tests, f"{page}: no test runs its code"
        if Path(page).name in ("bodies.md", "extensions.md", "file-formats.md", "induction.md", "parts.md"):
            continue  # every block is used there
        code = "".join(blocks(page, "python"))
        for title in re.findall(r'^```python title="(.*?)"$', text, re.MULTILINE):
            tested = title in tests or f"from {Path(title).stem} import" in code
            assert tested, f"{page}: no test runs {title}"


def test_wind_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of docs/guide/wind-files.md, with a smaller box than that of the page."""
    from matplotlib import pyplot as plt

    page = "docs/guide/wind-files.md"
    monkeypatch.chdir(tmp_path)
    turbine = meltemi.load_turbine("nrel5mw")
    field = meltemi.wind.generate_field(meltemi.TurbulentWind(speed=12.0, intensity=0.14, points=8), turbine, 20.0)
    meltemi.io.write_bts(field, "field.bts")
    code = "\n".join(blocks(page, "python"))
    small = code.replace("planes=8192, columns=32, rows=32", "planes=64, columns=8, rows=8")
    assert small != code
    for name in "uvw":
        (tmp_path / f"turb_{name}.bin").write_bytes(bytes(4 * 64 * 8 * 8))
    exec(compile(small, page, "exec"), {"__name__": "page"})
    plt.close("all")
    assert (tmp_path / "small.nc").stat().st_size < (tmp_path / "field.nc").stat().st_size


@pytest.mark.slow
def test_constrained_pitch() -> None:
    """Of docs/guide/constrained-pitch.md, with a shorter run."""
    pytest.importorskip("windIO")
    page, names = "docs/guide/constrained-pitch.md", {"__name__": "page"}
    code = "\n".join(blocks(page, "python"))
    short = code.replace("duration=60.0", "duration=2.0")
    assert short != code
    exec(compile(short, page, "exec"), names)
    assert isinstance(names["result"], meltemi.Result)


@pytest.mark.slow
def test_a_turbine_at_sea(capsys: pytest.CaptureFixture[str]) -> None:
    page = "docs/guide/sea.md"
    exec(compile("\n".join(blocks(page, "python")), page, "exec"), {"__name__": "page"})
    assert capsys.readouterr().out == blocks(page, 'text title="printed"')[0]


def test_seas_and_supports_of_the_page_are_valid() -> None:
    from meltemi.sea.kinds import sea_of

    page, safe = "docs/guide/sea.md", YAML(typ="safe")
    titles = ("", ' title="in a turbine file"', ' title="in the support"')
    sea, support, soil = (safe.load(blocks(page, f"yaml{title}")[0]) for title in titles)
    assert sea_of(sea["sea"], page).label.startswith("JONSWAP sea 6 m")
    content = support["support"] | {"soil": soil["soil"], "position": [-60.0, -10.0, 15.0]}
    described = meltemi.turbine.Support.model_validate(content)
    assert len(described.soil.layers) == 3


@pytest.mark.slow
def test_stability(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    page = "docs/guide/stability.md"
    monkeypatch.chdir(tmp_path)
    exec(compile("\n".join(blocks(page, "python")), page, "exec"), {"__name__": "page"})
    assert blocks(page, 'text title="printed"')[0] in capsys.readouterr().out
    assert (tmp_path / "flutter.png").stat().st_size > 10_000


@pytest.mark.slow
def test_the_twin_of_the_power_turbines_page() -> None:
    (code,) = blocks("docs/guide/power-turbines.md", 'python title="takes some seconds"')
    found: dict[str, Any] = {"meltemi": meltemi}
    exec(code, found)
    assert found["twin"].rated_power == pytest.approx(5e6, rel=1e-3)


@pytest.mark.slow
def test_the_bench_of_its_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of docs/guide/controller-bench.md, with two short runs a controller, none of which is tuned."""
    from meltemi.tuning.controller_bench import study
    from meltemi.tuning.controller_bench.margins import Multisine
    from meltemi.tuning.controller_bench.suite import Situation

    tiny = Situation("normal turbulence", "NTM", "production", "NTM", (16.0, 18.0), 1, 5.0, 1.0)
    monkeypatch.setattr(study, "suite_of", lambda turbine, quick: (tiny,))
    monkeypatch.setattr(study, "QUICK_SINE", Multisine(5.0, 5.0))
    monkeypatch.chdir(tmp_path)
    (code,) = blocks("docs/guide/controller-bench.md", "python")
    exec(code.replace('"ipc"', '"cpc"'), {"__name__": "page"})
    out = capsys.readouterr().out
    assert "individual" in out and "generator speed" in out and "MeanEstimate" in out
    assert (tmp_path / "bench.png").stat().st_size > 10_000 and (tmp_path / "page" / "bench.html").is_file()


@pytest.mark.long
@pytest.mark.skipif(find_spec("windIO") is None, reason="needs windIO")
def test_the_iced_turbine_of_the_icing_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (code,) = blocks("docs/guide/icing.md", 'python title="iea22mw.py"')
    monkeypatch.chdir(tmp_path)
    exec(code, {"meltemi": meltemi})
    assert (tmp_path / "icing-iea22mw.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("page", "kind"),
    [
        ("docs/guide/scale.md", 'python title="cluster.py"'),
        ("docs/migrate/rosco.md", 'python title="rosco_1p.py"'),
        ("docs/development.md", "python"),
    ],
)
def test_names_of_sketches_exist(page: str, kind: str) -> None:
    """What needs a cluster, ROSCO or a study is not run; the names are those of the packages."""
    (code,) = blocks(page, kind)
    tree = ast.parse(code)
    used = {ast.unparse(node) for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
    for name in used:
        if name.startswith("meltemi."):
            resolve_name(name)
    if "STUDY" in code:
        study = vars(importlib.import_module("meltemi.papers.study"))
        capitals = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and node.id.istitle()}
        assert capitals and capitals <= set(study) | set(vars(importlib.import_module("meltemi.papers.claim"))), (
            capitals
        )


def test_changes_of_a_load_case_table(tmp_path: Path) -> None:
    """Of docs/guide/load-case-tables.md."""
    from meltemi.core.yamlfile import read_mapping
    from meltemi.loads.loadbase.table import load_table

    (text,) = blocks("docs/guide/load-case-tables.md", 'yaml title="changes.yaml"')
    path = tmp_path / "changes.yaml"
    path.write_text(text, encoding="utf-8")
    assert set(load_table(4, read_mapping(path)).rows) - set(load_table(4).rows) == {"1.3b"}


def test_settings_of_a_load_base(tmp_path: Path) -> None:
    """Of docs/guide/load-base.md."""
    from meltemi.loads.loadbase.settings import STANDARD, read_settings

    (text,) = blocks("docs/guide/load-base.md", 'yaml title="settings.yaml"')
    path = tmp_path / "settings.yaml"
    path.write_text(text, encoding="utf-8")
    assert all(value != getattr(STANDARD, key) for key, value in read_settings(path) if key in text)


@pytest.mark.skipif(find_spec("pandas") is None, reason="needs pandas")
def test_limits_of_a_load_base(tmp_path: Path) -> None:
    """Of docs/guide/load-base.md."""
    from meltemi.loads.loadbase.report import read_limits

    (text,) = blocks("docs/guide/load-base.md", 'yaml title="limits.yaml"')
    path = tmp_path / "limits.yaml"
    path.write_text(text, encoding="utf-8")
    assert set(read_limits(path)) == {"ultimate", "fatigue", "motion"}
