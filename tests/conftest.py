"""What several tests share."""

from __future__ import annotations

import csv
import os
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

import pytest

# before NumPy is loaded, here and in the processes of tests: threads of several workers wait for each other's cores
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# before Numba is loaded: it asks the terminal for its colours at every message, also of those that nobody sees
os.environ.setdefault("NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1")

import meltemi
from meltemi import Model, Turbine
from meltemi.app.warmup import STAGES, warmup
from meltemi.compiler import kernels


class _Everything(set[str]):
    def __contains__(self, _: object) -> bool:
        return True


# what is still to be compiled, and said on stderr, depends on the order of the tests
kernels._FEATURES_TOLD = _Everything()

# background shells, nohup and cron switch Ctrl-C off, for processes that are started here, too
if threading.current_thread() is threading.main_thread() and signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


LATER = {"derivatives": "slow", "modal blades": "slow", "gradients": "long"}
"""Stages of machine code, which takes twice the time of all else, that only tests of a mark need."""


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile what is missing before the workers start, which would all compile the same."""
    workers, marks = getattr(session.config.option, "numprocesses", None), str(session.config.option.markexpr)
    wanted = [name for name in STAGES if f"not {LATER.get(name, 'of any mark')}" not in marks]
    if workers and not hasattr(session.config, "workerinput") and (kernels.is_cold() or "not slow" not in marks):
        began = time.perf_counter()
        warmup(wanted, workers=int(workers))
        print(f"compiled the kernels in {time.perf_counter() - began:.0f} s, before the workers start", flush=True)


@pytest.fixture(scope="module", autouse=True)
def not_laid_out(request: pytest.FixtureRequest) -> Iterator[None]:
    """Figures of commands, pages and notebooks are drawn without layout, half of their time; other tests judge it."""
    with pytest.MonkeyPatch.context() as patch:
        if request.path.parent.name in ("cli", "docs"):
            patch.setattr("matplotlib.layout_engine.ConstrainedLayoutEngine.execute", lambda self, figure: None)
        yield


REFERENCE = Path(__file__).parents[2] / "shared" / "reference"


@pytest.fixture(scope="session")
def turbine() -> Turbine:
    return meltemi.load_turbine("nrel5mw")


@pytest.fixture(scope="session")
def model(turbine: Turbine) -> Model:
    """Default degrees of freedom and aerodynamics."""
    return meltemi.build(turbine)


@pytest.fixture(scope="session")
def geared(turbine: Turbine) -> Turbine:
    """The same with a gearbox of two planetary stages and a parallel one, sized for its rated torque."""
    gearbox = meltemi.turbine.size_gearbox(ratio=turbine.drivetrain.gear_ratio, rated_torque=4.18e6)
    return turbine.replace(**{"drivetrain.gearbox": gearbox})


@pytest.fixture(scope="session")
def supervised_case() -> str:
    """Text of a case file that starts from standstill."""
    return """\
turbine: nrel5mw
wind: {kind: steady, speed: 8.0}
duration: 20.0
start: standstill
channels: [rotor_speed, operating_state]
controller:
  kind: supervised
  supervision: {start_time: 5.0}
  protection: {strategy: stop, wind_speeds: [0, 30], thresholds: [0.8, 0.6]}
"""


@pytest.fixture(scope="session")
def reference() -> Path:
    """Folder of the reference runs, which lies beside the repository where it is developed."""
    if not (REFERENCE / "openfast").is_dir():
        pytest.skip(f"needs the OpenFAST reference runs in {REFERENCE}")
    return REFERENCE


@pytest.fixture(scope="session")
def openfast_deck(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the OpenFAST deck of the reference runs and settings of ROSCO, written from their values."""
    folder = tmp_path_factory.mktemp("values") / "deck"
    lines: dict[str, list[str]] = {}
    with Path(__file__).with_name("nrel5mw_deck.csv").open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            keyword, values = row["keyword"], row["values"]
            comment = "!" if row["file"].startswith(("Airfoils", "DISCON")) else ""
            mark = "! " if row["file"] == "DISCON.IN" else ""
            line = {
                "": values,
                "blank": "",
                "title": values,
                "columns": f"{comment} {values}\n{comment} (-)",
                "section": f"{comment}---------- {values} ----------",
                "OutList": "OutList -",
                "END": "END",
            }.get(keyword, f"{values} {mark}{keyword} -")
            lines.setdefault(row["file"], []).append(line)
    for name, text in lines.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("\n".join(text) + "\n", encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def rosco_cases() -> Path:
    """The OpenFAST test cases inside the rosco package, found without importing it."""
    try:
        package = distribution("rosco")
    except PackageNotFoundError:
        pytest.skip("needs the decks of the rosco package: pip install --no-deps 'rosco>=2.10,<3'")
    folder = Path(str(package.locate_file("Examples/Test_Cases")))
    if not folder.is_dir():
        pytest.skip(f"rosco {package.version} has no Examples/Test_Cases")
    return folder


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A Bladed-style controller library, compiled from discon.c."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("needs a C compiler")
    path = tmp_path_factory.mktemp("library") / "libdiscon.so"
    source = Path(__file__).with_name("discon.c")
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", str(path), str(source), "-lm"], check=True)
    return path
