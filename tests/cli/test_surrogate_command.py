"""``meltemi surrogate``: from the design to the verdict of a site; interruptions, options, wrong input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from terminal import Command

pytest.importorskip("pyarrow", reason="needs pyarrow")

from meltemi.loads.surrogate.campaign import read_surrogate_campaign, surrogate_loads
from meltemi.loads.surrogate.model import LoadModel, Polynomials, Surrogate, load_surrogate, write_surrogate
from meltemi.loads.surrogate.space import SiteVariable, Space

SMALL = (
    *("--variables", "speed,turbulence_intensity", "--loads", "tower_base_moment_fore_aft=4", "--points", 8),
    *("--repeats", 1, "--checks", 2, "--seeds", 2, "--duration", 10, "--transient", 2),
)
SITE = """
name: Hill
sectors:
  - {weibull_scale: 7.0, speed: [4, 10, 25], intensity: [0.2, 0.13, 0.1], inclination: 2 deg}
"""


@pytest.mark.long
def test_from_the_design_to_the_verdict(command: Command, tmp_path: Path) -> None:
    folder, site = tmp_path / "s", tmp_path / "site.yaml"
    site.write_text(SITE)
    ran = command("surrogate", "design", "nrel5mw", *SMALL, "--out", folder)
    assert ran.status == 0, ran.err
    assert "8 points of the fit, 2 held-out points: 13 runs" in ran.out
    refused = command("surrogate", "fit", folder)
    assert refused.status == 2 and "no results; 'meltemi surrogate run" in refused.err

    half = command("surrogate", "run", folder, "--shard", "1/2")
    assert half.status == 0 and "7 of 13 runs done, 0 failed, 6 missing" in half.out
    assert "13 of 13 runs done, 0 failed, 0 missing" in command("surrogate", "run", folder).out
    files = {path.name for path in (folder / "results").iterdir()}
    assert command("surrogate", "run", folder, "--workers", 1).status == 0
    assert {path.name for path in (folder / "results").iterdir()} == files  # nothing ran again

    fitted = command("surrogate", "fit", folder)
    assert fitted.status == 0, fitted.err
    assert "8 points (9 runs); errors at 2 held-out points (4 runs)" in fitted.out
    assert {"surrogate.json", "fit.csv", "validation.png"} <= {path.name for path in folder.iterdir()}
    other = tmp_path / "other"  # the same campaign without interruption
    command("surrogate", "design", "nrel5mw", *SMALL, "--out", other)
    command("surrogate", "run", other, "--workers", 1)
    command("surrogate", "fit", other)
    assert (other / "surrogate.json").read_bytes() == (folder / "surrogate.json").read_bytes()

    at = ("surrogate", "evaluate", folder / "surrogate.json", "--at")
    shown = command(*at, "speed=10,turbulence_intensity=0.12", "--json")
    (row,) = json.loads(shown.out)["tables"][0]["rows"]
    mean = load_surrogate(folder / "surrogate.json")(speed=10.0, turbulence_intensity=0.12)
    assert row["mean"] == pytest.approx(float(mean["tower_base_moment_fore_aft"]) / 1e3)
    assert "speed 26 m/s is outside 3 to 25" in command(*at, "speed=26,turbulence_intensity=0.1").err
    with pytest.warns(UserWarning, match="nearest bound"):
        assert command(*at, "speed=26,turbulence_intensity=0.1", "--clip").status == 0

    ratios = []
    for name in ("IA", "IIIC"):
        ran = command("surrogate", "site", folder / "surrogate.json", site, "--class", name, "--out", tmp_path / "o")
        assert ran.status == 0 and "verdict: " in ran.out
        found = command("surrogate", "site", folder / "surrogate.json", site, "--class", name, "--json").out
        assert json.loads(found)["verdict"] in ("suitable", "not suitable", "undecided")
        ratios.append(json.loads(found)["tables"][0]["rows"][0]["ratio"])
    assert ratios[0] < ratios[1]
    assert {"suitability.csv", "suitability.png"} == {path.name for path in (tmp_path / "o").iterdir()}

    before = read_surrogate_campaign(folder)[1]
    assert command("surrogate", "refine", folder, "--points", 3, "--site", site).status == 0
    after = read_surrogate_campaign(folder)[1]
    assert len(after) == len(before) + 3 and np.array_equal(after.values[:13], before.values)
    assert len(surrogate_loads(folder)[1]) == 13  # those of the further points are missing


def test_an_evaluation_tells_its_error_and_what_to_do(command: Command, tmp_path: Path) -> None:
    space = Space((SiteVariable("speed", (3.0,), (25.0,)),))
    for r2, status in ((-149.0, "not usable"), (0.97, "usable")):
        errors = {"r2": r2, "nrmse": 0.123, "floor": 0.01, "bias": 0.0}
        basis = Polynomials(np.array([[0], [1]]))
        own = LoadModel("tower", "N m", 4.0, space, basis, np.array([[14.0, 0.1]]), 0.05, errors)
        file = write_surrogate(Surrogate("nrel5mw", space, {"tower": own}, {"points": 24}), tmp_path / "surrogate.json")
        shown = command("surrogate", "evaluate", file, "--at", "speed=10", "--json")
        (row,) = json.loads(shown.out)["tables"][0]["rows"]
        assert row["R2"] == r2 and row["NRMSE"] == pytest.approx(12.3) and row["verdict"] == status
        ran = command("surrogate", "evaluate", file, "--at", "speed=10")
        assert ("warning: " in ran.err) == (status == "not usable")
        following = "surrogate design nrel5mw --points 48" if status == "not usable" else "surrogate site"
        assert f"next: meltemi {following}" in ran.out


def test_options_reach_the_design(command: Command, tmp_path: Path) -> None:
    def design(*more: object) -> tuple[object, object]:
        out = tmp_path / f"d{len(list(tmp_path.iterdir()))}"
        ran = command("surrogate", "design", "nrel5mw", *more, "--out", out)
        assert ran.status == 0, ran.err
        return read_surrogate_campaign(out)

    _, usual = design()
    assert len(usual.space.names) == 6 and len(np.unique(usual.point)) == 256 + 32
    _, latin = design("--method", "latin")
    _, other = design("--realisation", 2)
    assert not np.array_equal(latin.values, usual.values) and not np.array_equal(other.values, usual.values)
    assert not set(other.seed) & set(usual.seed)
    campaign, narrow = design("--bounds", "air_density=0.9:1.0,speed=5:20", "--controller", "rosco")
    density = narrow.values[:, narrow.space.names.index("air_density")]
    assert 0.9 <= density.min() < density.max() <= 1.0 and narrow.space.ends == (5.0, 20.0)
    assert campaign.controller.kind == "bladed"
    limited, points = design("--variables", "speed,power_reference", "--controller", "power")
    assert limited.controller.kind == "power" and points.values[:, 1].min() >= 2e6
    assert points.values[:, 1].max() <= 5.3e6


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("design", "nrel5mw", "--variables", "spede"), "no site variable 'spede'"),
        (("design", "nrel5mw", "--bounds", "air_density=1"), "expected two numbers, LOW:HIGH"),
        (("design", "nrel5mw", "--loads", "tower_base"), "expected NAME=VALUE"),
        (("design", "nrel5mw", "--method", "random"), "method"),
        (("design", "nrel5mw", "--points", "0"), "points"),
        (("run", "nowhere"), "no surrogate.yaml; 'meltemi surrogate design TURBINE --out FOLDER' writes one"),
        (("evaluate", "nowhere.json", "--at", "speed=1"), "nowhere.json"),
        (("site", "nowhere.json", "site.yaml"), "nowhere.json"),
    ],
)
def test_wrong_input_is_told_in_one_line(
    arguments: tuple[str, ...], words: str, command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    ran = command("surrogate", *arguments)
    assert ran.status == 2 and words in ran.err and len(ran.err.strip().splitlines()) == 1, ran.err
    assert not list(tmp_path.iterdir())


def test_a_damaged_design_is_told(command: Command, tmp_path: Path) -> None:
    command("surrogate", "design", "nrel5mw", *SMALL, "--out", tmp_path)
    path = tmp_path / "design.csv"
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0], lines[1].replace("train", "trial")]))
    assert "line 2: expected 5 entries as in the head, set train or check" in command("surrogate", "run", tmp_path).err
    path.write_text("point,seed\n1,2\n")
    assert "expected rows below the head point,set,seed,speed [m/s]" in command("surrogate", "run", tmp_path).err
