"""A run of OpenFAST as its own file, against ours in the same wind: every channel that is mapped has unit and sign."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import meltemi
from meltemi.postprocess.files.openfast import Columns, result_of
from meltemi_verification.steady import deck_model

UNCERTAIN = {"rotor_power", "skew_angle", "tip_speed_ratio"}
"""Whose definitions differ: mean wind and speed of the shaft."""


def test_every_common_channel_is_the_same_quantity(reference: Path, tmp_path: Path) -> None:
    with np.load(reference / "openfast/series/A_turb_vkm20_s1.npz") as z:
        names, units, data = [str(n) for n in z["channels"]], [str(u) for u in z["units"]], z["data"].astype(float)
    table = Columns(tuple(names[1:]), tuple(units[1:]), data[:, 0], data[:, 1:], "OpenFAST-v5.0.0")
    path = meltemi.write_result(result_of(table, tmp_path), tmp_path / "theirs.outb")
    wind = meltemi.read_wind(reference / "openfast/wind/vkm20_s1.bts")
    ours, theirs = meltemi.simulate(deck_model("A"), wind, duration=200.0, channels=["all"]), meltemi.read_result(path)
    found = meltemi.analysis.compare_results(ours, theirs, begin=100.0)
    assert found.notes == ("they cover 0 to 200 s and 0 to 700 s", "compared from 100 to 200 s")
    assert len(found.channels) == 63  # all of the file that the catalogue has, but the azimuth
    for d in found.channels:
        assert d.correlation > (0.5 if d.channel.name in UNCERTAIN else 0.88), d
        assert 0.9 < d.std[0] / d.std[1] < 1.1, d
    # in pairs: the first output node of that run is node 6
    (alpha,) = meltemi.analysis.compare_results(ours, theirs, ["B1N6Alpha=B1N1Alpha"], begin=100.0).channels
    assert alpha.correlation > 0.999
    assert abs(alpha.mean_change) < 0.01
