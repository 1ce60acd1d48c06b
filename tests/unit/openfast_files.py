"""OpenFAST's output files, written here from the definition of the format and not by the package."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]


def outb(
    path: Path,
    names: Sequence[str],
    units: Sequence[str],
    time: Float,
    data: Float,
    *,
    kind: int = 2,
    description: str = "OpenFAST-v5.0.0",
) -> Path:
    """As ``WrBinFAST`` writes it: the whole range -32768 to 32767, and scale 1 for constant channels."""
    width = 20 if kind == 4 else 10
    low, high = data.min(axis=0), data.max(axis=0)
    scale = np.where(high > low, 65535.0 / np.where(high > low, high - low, 1.0), 1.0).astype("<f4")
    offset = (-32768.0 - scale * low).astype("<f4")
    rows, n = data.shape
    head = struct.pack("<h", kind) + (struct.pack("<h", width) if kind == 4 else b"") + struct.pack("<ii", n, rows)
    span = float(time[-1] - time[0])
    ticks = (time - time[0]) / span * 2.0**30
    if kind == 1:
        head += struct.pack("<dd", 2.0**30 / span, -time[0] * 2.0**30 / span)
    else:
        head += struct.pack("<dd", time[0], time[1] - time[0])
    if kind != 3:
        head += scale.tobytes() + offset.tobytes()
    head += struct.pack("<i", len(description)) + description.encode()
    head += b"".join(text.encode()[:width].ljust(width) for text in ["Time", *names])
    head += b"".join(f"({unit})".encode()[:width].ljust(width) for unit in ["s", *units])
    if kind == 1:
        head += np.rint(ticks).astype("<i4").tobytes()
    if kind == 3:
        body = data.astype("<f8").tobytes()
    else:
        body = (
            np.clip(np.rint(data * scale.astype(float) + offset.astype(float)), -32768, 32767).astype("<i2").tobytes()
        )
    path.write_bytes(head + body)
    return path


def out(path: Path, names: Sequence[str], units: Sequence[str], time: Float, data: Float) -> Path:
    """As OpenFAST 5 writes it with tabs."""
    lines = [
        "",
        "Predictions were generated on 21-Nov-2026 at 10:00:00 using OpenFAST, compiled as a 64-bit application",
        " linked with NWTC Subroutine Library; ElastoDyn; AeroDyn",
        "",
        "Description from the FAST input file:  a test",
        "",
        "\t".join(f"{name:<10s}" for name in ["Time", *names]),
        "\t".join(f"({unit})".ljust(10) for unit in ["s", *units]),
    ]
    lines += [f"{t:10.4f}\t" + "\t".join(f"{v:10.4E}" for v in row) for t, row in zip(time, data, strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
