"""A run of OpenFAST as its own file, against ours in the same wind: every channel that is mapped has unit and sign."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meltemi
from comparisons import thinned
from comparisons.turbulent import SHORT, short_wind
from meltemi.postprocess.files.openfast import OutputColumns, result_of
from meltemi.verification.steady import deck_model

UNCERTAIN = {"rotor_power", "skew_angle", "tip_speed_ratio"}
"""Whose definitions differ: mean wind and speed of the shaft."""


@pytest.mark.slow
def test_every_common_channel_is_the_same_quantity(tmp_path: Path) -> None:
    runs = thinned("turbulent_runs")
    names, units = [str(n) for n in runs["A_channels"]], [str(u) for u in runs["A_units"]]
    time = SHORT.begin + SHORT.step * np.arange(len(runs["A_counts"]))
    table = OutputColumns(tuple(names), tuple(units), time, runs["A_counts"] * runs["A_steps"], "OpenFAST-v5.0.0")
    path = meltemi.write_result(result_of(table, tmp_path), tmp_path / "theirs.outb")
    theirs = meltemi.read_result(path)
    run = {"duration": SHORT.end, "output_step": SHORT.step, "start": SHORT.start}
    ours = meltemi.simulate(deck_model("A"), short_wind(), channels=["all"], **run)
    found = meltemi.analysis.compare_results(ours, theirs)
    assert found.notes == ("they cover 0 to 65 s and 20 to 65 s", "compared from 20 to 65 s")
    assert len(found.channels) == 63  # all of the file that the catalogue has, but the azimuth
    for d in found.channels:
        assert d.correlation > (0.5 if d.channel.name in UNCERTAIN else 0.88), d
        assert 0.9 < d.std[0] / d.std[1] < 1.1, d
    # in pairs: the first output node of that run is node 6
    (alpha,) = meltemi.analysis.compare_results(ours, theirs, ["B1N6Alpha=B1N1Alpha"]).channels
    assert alpha.correlation > 0.999
    assert abs(alpha.mean_change) < 0.01
