"""The Python on the pages runs as it stands there."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = (
    "README.md",
    "docs/getting-started.md",
    "docs/guide/controllers.md",
    "docs/guide/comparing.md",
    "docs/guide/batches.md",
    "docs/guide/results.md",
    "docs/guide/operating-points.md",
    "docs/guide/linear.md",
    "docs/guide/sensitivities.md",
    "docs/guide/wind.md",
)


@pytest.mark.parametrize("page", PAGES)
def test_code_on_the_page_runs(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    code = "\n".join(re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL))
    assert "import meltemi" in code
    monkeypatch.chdir(tmp_path)
    exec(compile(code, page, "exec"), {"__name__": "page"})
    plots = re.findall(r'savefig\("(.*?)"\)', code)
    assert plots
    for plot in plots:
        assert (tmp_path / plot).stat().st_size > 10_000


def test_the_example_tunes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    example = runpy.run_path(str(ROOT / "examples" / "tune_pitch.py"))
    example["main"](["--duration", "20", "--iterations", "1", "--out", str(tmp_path)])
    values = [float(value) for value in re.findall(r"J = (\d\.\d+)  ", capsys.readouterr().out)]
    assert values[0] == pytest.approx(1.0)
    assert min(values) < 0.99
    assert (tmp_path / "series.png").stat().st_size > 10_000


def test_readme_has_ten_lines() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    code = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)[0]
    assert len([line for line in code.splitlines() if line.strip()]) <= 10
