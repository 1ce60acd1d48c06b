"""``meltemi loads plan``: what it prints and writes, options, wrong input."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import pytest
from terminal import Command

from meltemi.loads.loadbase import timing
from meltemi.loads.loadbase.campaign import read_campaign

QUICK = ("--class", "IB", "--quick")


@pytest.fixture(autouse=True)
def short_timing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(timing, "TIMED", 10.0)


def rows_of(base: Path) -> list[dict[str, str]]:
    return list(csv.DictReader((base / "plan.csv").read_text(encoding="utf-8").splitlines()))


def test_help_names_the_standards(command: Command) -> None:
    shown = " ".join(command("loads", "--help").out.split())
    assert all(standard in shown for standard in ("IEC 61400-1 ", "61400-3-1", "61400-3-2"))


@pytest.mark.long
def test_a_plan_is_printed_and_written_and_planned_again(command: Command, tmp_path: Path) -> None:
    ran = command("loads", "plan", "nrel5mw", *QUICK, "--out", tmp_path / "base")
    assert ran.status == 0 and ran.err == ""
    assert "V_in 3, V_r 11.5, V_out 25, V_ref 50 m/s" in ran.out  # V_r from steady operation
    assert [path.name for path in ran.files] == ["campaign.yaml", "plan.csv"]
    rows = rows_of(tmp_path / "base")
    total = next(line for line in ran.out.splitlines() if "total" in line)
    assert str(len(rows)) in re.findall(r"\d+", total)
    assert len({row["case"] for row in rows}) == len(rows)
    campaign = tmp_path / "base" / "campaign.yaml"
    campaign.write_text(campaign.read_text().replace("quick: true", "quick: true\nseeds: 2"))
    again = command("loads", "plan", tmp_path / "base")
    assert again.status == 0 and read_campaign(tmp_path / "base").seeds == 2


@pytest.mark.slow
def test_options_reach_the_campaign(command: Command, tmp_path: Path) -> None:
    changes = tmp_path / "changes.yaml"
    changes.write_text('without: ["2.1"]\nrows: {"1.3x": {like: "1.3", seeds: 24}}\n')
    given = {"--seeds": 3, "--duration": 300, "--transient": 30, "--yaw-error": 10, "--inclination": 0, "--cut-in": 4}
    given |= {"--cut-out": 24, "--rated-wind": 11, "--v-maint": 15, "--idle-pitch": 85, "--years": 25}
    flat = [str(part) for pair in given.items() for part in pair]
    ran = command(
        *("loads", "plan", "iea15mw", "--class", "IIA", "--edition", 3, "--table", changes, "--out", tmp_path / "b"),
        *(*flat, "--extreme-wind", "steady"),
    )
    assert ran.status == 0, ran.err
    c = read_campaign(tmp_path / "b")
    assert (c.edition, c.wind_class, c.seeds, c.duration, c.transient, c.yaw_error) == (3, "IIA", 3, 300.0, 30.0, 10.0)
    assert (c.cut_in, c.cut_out, c.rated_wind, c.v_maint, c.years) == (4.0, 24.0, 11.0, 15.0, 25.0)
    assert c.inclination == 0.0 and c.idle_pitch == pytest.approx(1.48353, abs=1e-5)
    names = [row["case"] for row in rows_of(tmp_path / "b")]
    assert "dlc1.3x-24-y10-s24" in names and "dlc6.1-59.5-y15" in names
    assert not any(name.startswith("dlc2.1") for name in names)


@pytest.mark.slow
def test_a_deck_is_planned_with_its_options(command: Command, tmp_path: Path, openfast_deck: Path) -> None:
    (deck,) = openfast_deck.glob("*.fst")
    ran = command("loads", "plan", deck, *QUICK, "--rated-wind", 11.4, "--out", tmp_path / "base")
    assert ran.status == 0, ran.err
    campaign = read_campaign(tmp_path / "base")
    assert (
        Path(campaign.turbine) == deck
        and campaign.options
        and campaign.rotor_diameter == pytest.approx(126.0, abs=0.01)
    )


@pytest.mark.long
def test_a_controller_library_stops_but_does_not_start(command: Command, tmp_path: Path, library: Path) -> None:
    ran = command(
        "loads", "plan", "nrel5mw", *QUICK, "--rated-wind", 11.4, "--controller", library, "--out", tmp_path / "base"
    )
    assert ran.status == 0, ran.err
    assert "cannot run (DLC 3.1, 3.2, 3.3): a start: controller bladed cannot start the turbine" in ran.err


@pytest.mark.slow
def test_the_options_of_a_base_are_in_its_file(command: Command, tmp_path: Path) -> None:
    command("loads", "plan", "nrel5mw", *QUICK, "--rated-wind", 11.4, "--out", tmp_path / "base")
    ran = command("loads", "plan", tmp_path / "base", "--seeds", 2)
    assert ran.status == 2 and "change its campaign.yaml" in ran.err


@pytest.mark.slow
def test_a_plan_at_sea(command: Command, tmp_path: Path) -> None:
    site = tmp_path / "metocean.yaml"
    assert command("loads", "metocean", "template", "--out", site).status == 0
    there = command("loads", "metocean", "--out", site)
    assert there.status == 2 and "exists already" in there.err
    at_sea = ("loads", "plan", "iea15mw-monopile", "--standard", "61400-3-1", "--rated-wind", 10.7)
    ran = command(*at_sea, "--site", site, "--quick", "--out", tmp_path / "base")
    assert ran.status == 0, ran.err
    assert "iea15mw-monopile: IEC 61400-3-1, template" in ran.out and "cannot run (" not in ran.err
    rows = {row["case"]: row for row in rows_of(tmp_path / "base")}
    row = rows["dlc6.1-50-y8-m0-high-s01"]
    assert (row["wave_height"], row["wave_period"], row["level"]) == ("8.4", "12.8", "2.6")
    for words, given in {
        "did you mean '61400-3-1'": ("--standard", "61400-31"),
        "has no platform; choose a turbine that has one": ("--standard", "61400-3-2", "--site", "weis"),
        "needs --site": (),
        "no site 'weiss'; did you mean 'weis'": ("--site", "weiss"),
        "leave it out": ("--site", "weis", "--edition", 3),
        "iea15mw has no support": ("--site", "weis"),
    }.items():
        turbine = "iea15mw" if "support" in words else "iea15mw-monopile"
        wrong = command("loads", "plan", turbine, "--standard", "61400-3-1", *given, "--out", tmp_path / "no")
        assert wrong.status == 2 and words in wrong.err, wrong.err
    assert not (tmp_path / "no").exists()
