"""Load case tables: counts and factors of the editions, rules, names, seeds, weights, errors."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from meltemi.cases.case import case_wind
from meltemi.control_laws.load_control import HarmonicLoop, LoadControl
from meltemi.controllers import schemes
from meltemi.controllers.specification import LibraryCase
from meltemi.core.errors import InputError
from meltemi.iec.gusts import EDC_TIME, EOG_TIME, EWS_TIME, RISE_TIME
from meltemi.loads.loadbase.campaign import Campaign, make_campaign, read_campaign, write_campaign
from meltemi.loads.loadbase.jobs import Job, Workshop, jobs_of
from meltemi.loads.loadbase.plan import plan
from meltemi.loads.loadbase.ranges import numbers
from meltemi.loads.loadbase.situations import OPERATING
from meltemi.loads.loadbase.table import load_table
from meltemi.turbine.library import load_turbine
from meltemi.wind.fields import WindBox, unusual

# Burton et al. (2021), Wind Energy Handbook, 3rd ed., chapter 5, for IEC 61400-1 ed. 4; runs by practice. Cases of a
# class IB turbine with V_in 3, V_r 11.4, V_out 25 m/s, so 13 speeds: those by 2 m/s, and V_r
TABLE = """
1.1  | production     | NTM        | ultimate | 1.25 | extrapolated | 4*6 + 9*15  | 3 to 25         | 0
1.2  | production     | NTM        | fatigue  | 1.0  | life         | 13*3*6      | 3 to 25         | -8 0 8
1.3  | production     | ETM        | ultimate | 1.35 | mean         | 13*3*6      | 3 to 25         | -8 0 8
1.4  | production     | ECD        | ultimate | 1.35 | largest      | 3*2*4       | 9.4 11.4 13.4   | 0
1.5  | production     | EWSV EWSH  | ultimate | 1.35 | largest      | 13*2*2*4    | 3 to 25         | 0
2.1  | production     | NTM        | ultimate | 1.35 | upper half   | 13*12       | 3 to 25         | 0
2.2  | production     | NTM        | ultimate | 1.1  | upper half   | 13*12       | 3 to 25         | 0
2.3  | production     | EOG        | ultimate | 1.1  | largest      | 3*3*4       | 9.4 13.4 25     | 0
2.4  | production     | NTM        | fatigue  | 1.0  | life         | 13*2*3      | 3 to 25         | -20 20
2.5  | production     | NWP        | ultimate | 1.2  | largest      | 13*2        | 3 to 25         | 0
3.1  | start          | NWP        | fatigue  | 1.0  | life         | 3           | 3 11.4 25       | 0
3.2  | start          | EOG        | ultimate | 1.35 | largest      | 4*4         | 3 9.4 13.4 25   | 0
3.3  | start          | EDC        | ultimate | 1.35 | largest      | 4*2*2       | 3 9.4 13.4 25   | 0
4.1  | normal stop    | NWP        | fatigue  | 1.0  | life         | 3           | 3 11.4 25       | 0
4.2  | normal stop    | EOG        | ultimate | 1.35 | largest      | 3*6         | 9.4 13.4 25     | 0
5.1  | emergency stop | NTM        | ultimate | 1.35 | upper half   | 3*12        | 9.4 13.4 25     | 0
6.1  | idling         | EWM50      | ultimate | 1.35 | upper half   | 2*6         | 50              | -8 8
6.2  | idling         | EWM50      | ultimate | 1.1  | upper half   | 24          | 50              | all
6.3  | idling         | EWM1       | ultimate | 1.35 | upper half   | 2*6         | 40              | -20 20
6.4  | idling         | NTM        | fatigue  | 1.0  | life         | 17*2*6      | 3 to 35         | -8 8
7.1  | locked         | EWM1       | ultimate | 1.1  | upper half   | 24*4        | 40              | all
7.1b | idling         | EWM1       | ultimate | 1.1  | upper half   | 24          | 40              | all
8.1  | locked         | NTM        | ultimate | 1.35 | upper half   | 2*4*6       | 18              | -8 8
8.2  | idling         | EWM1       | ultimate | 1.1  | largest      | 24          | 56              | all
"""
"""Row, situation, wind, loads, factor, characteristic value, cases, speeds [m/s], yaw errors [deg]."""
ROWS = {
    line.split("|")[0].strip(): [cell.strip() for cell in line.split("|")[1:]] for line in TABLE.strip().splitlines()
}


TURBINE = load_turbine("nrel5mw")


def campaign(edition: int = 4, **settings: Any) -> Campaign:
    return make_campaign("nrel5mw", "IB", edition, rated_wind=11.4, **settings)


@pytest.mark.parametrize("edition", [3, 4])
def test_the_table_row_by_row(edition: int) -> None:
    found = plan(campaign(edition))
    rows = {name: cells for name, cells in ROWS.items() if edition == 4 or name != "2.5"}
    assert list(found.table.rows) == list(rows)
    for name, (situation, wind, kind, factor, characteristic, count, speeds, yaws) in rows.items():
        own, row = [c for c in found.cases if c.row == name], found.table.rows[name]
        assert (row.situation, row.type, row.characteristic) == (situation, kind, characteristic), name
        assert {c.variant.model for c in own} == {*wind.split()}, name
        assert len(own) == sum(math.prod(map(int, part.split("*"))) for part in count.split("+")), name
        assert {c.factor for c in own} == {1.5 if (edition, name) == (3, "8.1") else float(factor)}, name
        given = sorted({c.variant.speed for c in own})
        if " to " in speeds:
            low, high = map(float, speeds.split(" to "))
            assert (given[0], given[-1]) == (low, high) and max(np.diff(given)) <= 2.0, name
            assert 11.4 in given or name == "6.4"
        else:
            assert given == [float(speed) for speed in speeds.split()], name
        turns = sorted({c.variant.yaw or 0.0 for c in own})
        assert turns == ([*range(0, 360, 15)] if yaws == "all" else [float(yaw) for yaw in yaws.split()]), name
    assert len({found.table.dlc(name) for name in rows}) == {3: 22, 4: 23}[edition]
    assert len(found.cases) == {3: 1821, 4: 1847}[edition]
    assert len({c.seed for c in found.cases} - {None}) == sum(c.seed is not None for c in found.cases)


def test_factors_and_times_beside_the_rows() -> None:
    """Factors of IEC 61400-1 that do not belong to a row, durations of its gusts, shares of time."""
    four, three = load_table(4), load_table(3)
    assert four.factors.consequence_ultimate == four.factors.consequence_fatigue == (0.9, 1.0, 1.2)
    assert three.factors.consequence_ultimate == (0.9, 1.0, 1.3)
    assert three.factors.consequence_fatigue == (1.0, 1.15, 1.3)
    assert (four.factors.favourable, four.factors.gravity, four.factors.clearance) == (0.9, (0.15, 0.25), 0.3)
    assert four.extrapolation.probability == 3.8e-7
    assert four.extrapolation.quantiles == ((1.2, 0.99), (1.35, 0.933)) and three.extrapolation.quantiles == ()
    assert (EDC_TIME, EOG_TIME, RISE_TIME, EWS_TIME) == (6.0, 10.5, 10.0, 12.0)
    assert four.states["misaligned"].hours == 50.0
    assert (four.states["parked"].inside, four.states["parked"].outside) == (0.025, 1.0)
    starts = [(c.variant.speed, c.weight.occurrences) for c in plan(campaign()).cases if c.row == "3.1" and c.weight]
    assert starts == [(3.0, 1000.0), (11.4, 50.0), (25.0, 50.0)]


@pytest.mark.parametrize(("period", "factor"), [(1.0, 1.35), (10.0, 1.35), (30.0, 1.225), (50.0, 1.1), (90.0, 1.1)])
def test_the_factor_of_rare_faults_falls(period: float, factor: float) -> None:
    changes = {"faults": {"grid_loss": {"return_period": period}}}
    of = {c.variant.fault: c.factor for c in plan(campaign(changes=changes)).cases if c.row == "2.1"}
    assert of == {"grid_loss": factor, "speed_sensor": 1.35, "pitch_sensor": 1.35}
    older = {c.factor for c in plan(campaign(3, changes=changes)).cases if c.row == "2.1"}
    assert older == {1.35}


def test_situations_have_inclination_imbalance_and_profile() -> None:
    found = plan(campaign(quick=True))
    for c in found.cases:
        content, operating = c.content, c.setting.row.situation in OPERATING
        assert ("imbalance" in content) == ("upflow" in content["wind"]) == operating
        wind = case_wind(c.case(), TURBINE, Path())
        assert unusual(wind, produces=operating) == []
        shear = getattr(wind, "shear_exponent", None)
        assert shear is None or shear == (0.11 if c.variant.model.startswith("EWM") else 0.2)
    plain = plan(campaign(quick=True, inclination=0.0, pitch_imbalance=0.0, mass_imbalance=0.0))
    assert not any("imbalance" in c.content or "upflow" in c.content["wind"] for c in plain.cases)


@pytest.mark.slow
def test_other_controllers_stop_by_pitch_and_do_not_start() -> None:
    found = plan(campaign(quick=True, controller={"kind": "power"}))
    assert list(found.missing().values()) == [["3.1", "3.2", "3.3"]]
    stop = found.case("dlc4.1-25").content["events"]
    assert [(e["type"], e["blade"], e["rate"]) for e in stop[:3]] == [
        ("pitch_runaway", b, 0.06981317) for b in (1, 2, 3)
    ]
    assert stop[3] == {"type": "generator_fault", "at": pytest.approx(70.0 + 45.0 / 4.0, abs=1e-3)}
    short = found.case("dlc2.2-25-generator_overload-s01").content["events"]
    assert [e["type"] for e in short] == ["generator_fault"] * 2 + ["pitch_runaway"] * 3
    stuck = found.case("dlc2.2-25-blade_stuck-s01").content["events"]
    assert [e["type"] for e in stuck] == ["pitch_stuck", "pitch_runaway", "pitch_runaway", "generator_fault"]
    lost = found.case("dlc2.1-25-grid_loss-s01").content["events"]
    assert [e["type"] for e in lost] == ["pitch_runaway"] * 3 + ["grid_loss"]
    assert {e["rate"] for e in lost[:3]} == {found.campaign.emergency_rate}
    baseline = plan(campaign(quick=True, controller={"kind": "baseline"}))
    assert not baseline.missing() and baseline.case("dlc4.1-25").content["controller"]["kind"] == "supervised"
    assert baseline.case("dlc2.1-25-grid_loss-s01").content["events"] == lost
    with pytest.raises(InputError, match="controller: fixed holds torque and pitch"):
        campaign(controller={"kind": "fixed"})


def test_a_library_is_there_and_works_when_the_plan_is_made(
    library: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("law.so").write_bytes(library.read_bytes())
    Path("law.in").write_text("count")
    found = campaign(controller="law.so@law.in").controller
    assert isinstance(found, LibraryCase) and Path(found.library) == tmp_path / "law.so"
    assert found.input == str(tmp_path / "law.in")
    for name, words in (
        ("law.so@low.in", "input file .*low.in: no such file; did you mean 'law.in'"),
        ("lew.so", "library .*lew.so: no such file; did you mean 'law.so'"),
    ):
        with pytest.raises(InputError, match=words):
            campaign(controller=name)
    Path("law.in").write_text("crash 0.0")
    with pytest.raises(InputError, match=r"library law.so with law.in' fails in its first steps: .*SIGSEGV"):
        campaign(controller="law.so@law.in")


def test_the_time_of_all_states_is_the_lifetime() -> None:
    assert sum(c.weight.share for c in plan(campaign()).cases if c.weight) == pytest.approx(1.0, abs=1e-12)


def test_the_cut_out_is_reached_exactly_and_once() -> None:
    values = {"V_in": 3.1, "V_out": 3.1 + 11 * 0.7}
    found = numbers("V_in to V_out by 0.7", values)
    assert len(found) == 12 and found[-1] == values["V_out"]
    assert [c.variant.speed for c in plan(campaign(quick=True)).cases if c.row == "1.1"] == [3.0, 11.4, 25.0]


def test_storms_are_turbulent_at_the_mean_or_steady_at_the_gust() -> None:
    storm = [c for c in plan(campaign()).cases if c.dlc == "6.1"]
    assert {c.variant.speed for c in storm} == {50.0} and all(c.seed is not None for c in storm)
    steady = [c for c in plan(campaign(extreme_wind="steady")).cases if c.dlc == "6.1"]
    assert {(c.variant.speed, c.variant.yaw, c.seed) for c in steady} == {(70.0, -15.0, None), (70.0, 15.0, None)}


def test_every_case_is_a_valid_case_and_seeds_depend_on_the_name_only() -> None:
    before = plan(campaign(quick=True))
    for case in before.cases:
        if not case.unsupported:
            case.case()
    after = plan(campaign(quick=True, changes={"rows": {"1.3x": {"like": "1.3", "factor": 1.2}}}))
    seeds = {c.name: c.seed for c in after.cases}
    assert all(seeds[c.name] == c.seed for c in before.cases) and len(seeds) > len(before.cases)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rows": {"1.33": {"seeds": 2}}}, "no such row; did you mean '1.3'"),
        ({"rows": {"1.3": {"seed": 2}}}, "rows.1.3.seed: unknown key; did you mean 'seeds'"),
        ({"without": ["9.9"]}, "no row '9.9'"),
        ({"rows": {"1.3x": {"like": "1.2"}}}, "have state 'production', whose time would count twice"),
        ({"rows": {"1.3": {"like": "1.2"}}}, "like is for new rows"),
        ({"faults": {"grid_loss": {"events": [{"type": "grid_los"}]}}}, "did you mean 'grid_loss'"),
        ({"faults": {"new": {"title": "without events"}}}, "faults.new.events: missing"),
        ({"rows": {"2.1": {"faults": "grid_los"}}}, "no fault 'grid_los'; did you mean 'grid_loss'"),
        ({"rows": {"1.3": {"speeds": "V_inn to V_out by 2"}}}, "unknown name 'V_inn'; did you mean 'V_in'"),
    ],
)
def test_wrong_changes_are_told(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as error:
        load_table(4, changes)
    assert words in str(error.value)


def test_wrong_campaigns_are_told() -> None:
    with pytest.raises(InputError, match="wind class"):
        make_campaign("nrel5mw", "IX", rated_wind=11.4)
    with pytest.raises(InputError, match="cut_in < rated_wind < cut_out"):
        campaign(cut_in=26.0)


def test_duplicates_are_left_out_or_told() -> None:
    found = plan(campaign(changes={"rows": {"1.4": {"speeds": "V_r, 11.4, V_r +- 2", "azimuths": "0, 0"}}}))
    assert len([c for c in found.cases if c.row == "1.4"]) == 3 * 2
    with pytest.raises(InputError, match=r"rows\.1\.4: two cases have the name dlc1\.4-10-"):
        plan(campaign(changes={"rows": {"1.4": {"speeds": "10, 10.0000001"}}}))


def test_a_campaign_survives_its_file(tmp_path: Path) -> None:
    made = campaign(changes={"rows": {"1.2": {"seeds": 12}}})
    write_campaign(made, tmp_path)
    assert read_campaign(tmp_path) == made


def test_excel_round_trip(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    from meltemi.loads.loadbase.excel import read_excel, write_excel

    path = write_excel(load_table(4), tmp_path / "table.xlsx")
    assert read_excel(path, 4) == {}
    book = openpyxl.load_workbook(path)
    head = [cell.value for cell in book["cases"][1]]
    book["cases"].cell(4, head.index("factor") + 1).value = 1.3
    book.save(path)
    assert read_excel(path, 4) == {"rows": {"1.3": {"factor": 1.3}}}
    book["cases"].cell(4, 1).value = "1.2"
    book.save(path)
    with pytest.raises(InputError, match=r"sheet cases, row 4: two rows have the name '1\.2'"):
        read_excel(path, 4)


@pytest.mark.slow
def test_schemes_and_python_files_in_a_load_base(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A scheme has its supervisor and gains when it is planned; what no scheme touches is the same in all bases."""
    loop = HarmonicLoop(harmonic=2, actuator="flap", integral_gain=1e-8)
    gains = {"cpfc": LoadControl(loops=(loop,))}
    monkeypatch.setattr(schemes, "tuned_schemes", lambda model, names, **given: (gains, {}))
    mine = tmp_path / "mine.py"
    mine.write_text(
        "import meltemi\ndef controller(turbine):\n    law = meltemi.control.BaselineController(turbine)\n"
        "    def update(state, measured, demands, dt):\n        law.update(state, measured, demands, dt)\n"
        "    return meltemi.Controller(update, init=law.init)\n"
    )
    plans = {name: plan(campaign(quick=True, controller=name)) for name in ("supervised", "cpfc", str(mine))}
    keys = {name: {job.name: job.key for job in jobs_of(found)} for name, found in plans.items()}
    for name, found in plans.items():
        same = {case for case, key in keys[name].items() if key == keys["supervised"][case]}
        parked = {c.name for c in found.cases if c.setting.row.situation in ("idling", "locked")}
        assert parked <= same and (same == parked or name == "supervised")
    cpfc = plans["cpfc"].case("dlc1.2-25-y0-s01").content["controller"]
    assert (cpfc["kind"], cpfc["scheme"], len(cpfc["load"]["loops"])) == ("supervised", "cpfc", 1)
    assert plans["cpfc"].case("dlc4.1-25").content["controller"]["load"] == cpfc["load"]
    found = plans[str(mine)]
    assert found.case("dlc1.2-25-y0-s01").content["controller"] == {"kind": "python", "file": str(mine)}
    assert [*found.missing().values()] == [["3.1", "3.2", "3.3"]]
    run = Workshop().run(next(j for j in jobs_of(plans["cpfc"]) if j.name == "dlc1.2-25-y0-s01"))
    assert "flap_1_angle_1" in run.channels and run.model.turbine.flaps  # type: ignore[union-attr]
    before = keys[str(mine)]["dlc1.2-25-y0-s01"]
    mine.write_text(mine.read_text() + "\n# changed\n")
    assert next(j.key for j in jobs_of(found) if j.name == "dlc1.2-25-y0-s01") != before
    mine.write_text("def controller(turbine):\n    return turbin\n")
    with pytest.raises(InputError, match=r"controller\(turbine\) raised NameError: name 'turbin'"):
        campaign(controller=str(mine))


def test_the_field_of_a_case_has_the_key_of_the_case_and_a_shared_one_keeps_its_hash() -> None:
    box = WindBox(np.full((3, 2, 2, 3), 8.0), dt=1.0, dy=100.0, dz=100.0, bottom=20.0, speed=8.0)
    job, turbine = Job("a", "key of a", {"duration": 1.0}, cycles=False), load_turbine("nrel5mw")
    found: Any = Workshop()._wind(job, SimpleNamespace(wind=box, start=None), turbine)  # type: ignore[arg-type]
    assert found.content_hash() == "key of a"
    assert found.velocity is box.velocity
    assert box.content_hash() == replace(box).content_hash()
