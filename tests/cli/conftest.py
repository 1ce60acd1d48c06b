"""What the tests of the command line share."""

from __future__ import annotations

import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from terminal import Command, Ran, check_next

from meltemi.app.cli import main
from meltemi.compiler.kernels import COLD


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """``meltemi`` with arguments, in this process: an exception that escapes fails the test.

    Text that a successful command prints ends with the next command, which must be valid.
    """

    def call(*arguments: Any) -> Ran:
        monkeypatch.setattr(sys, "argv", ["meltemi", *map(str, arguments)])
        capsys.readouterr()
        status: Any = 0
        try:
            main()
        except SystemExit as end:
            status = end.code or 0
        out, err = capsys.readouterr()
        for line in (line for line in out.splitlines() if line.startswith("next: ")):
            check_next(line)
            assert out.endswith(f"{line}\n")
        silent = {"--help", "-h", "--version", "--json", "template", "greet", "docs"} & set(map(str, arguments))
        assert status or silent or not arguments or "next: meltemi " in out, out
        return Ran(status, out, err.replace(COLD + "\n", ""))

    return call


@pytest.fixture
def bts(tmp_path: Path) -> Callable[..., Path]:
    """A TurbSim file of a wind of 10 m/s with a gust, written as the TurbSim user's guide lays it out."""

    def write(name: str = "field.bts", *, seconds: float = 20.0, width: float = 150.0, hub: float = 90.0) -> Path:
        dt, d, bottom = 0.1, 25.0, 15.0
        nt, n = round(seconds / dt) + 1, round(width / d) + 1
        path = tmp_path / name
        counts = np.zeros((nt, n, n, 3), dtype="<i2")
        counts[: nt // 2, :, :, 0] = 1000
        header = struct.pack("<h4i6f", 7, n, n, 0, nt, d, d, dt, 10.0, hub, bottom)
        # 1000 counts are 1 m/s; the longitudinal component begins at 10 m/s
        header += struct.pack("<6fi4s", 1000.0, -10000.0, 1000.0, 0.0, 1000.0, 0.0, 4, b"test")
        path.write_bytes(header + counts.tobytes())
        return path

    return write
