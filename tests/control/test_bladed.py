"""Controller libraries with Bladed's interface, by a small one (discon.c)."""

from __future__ import annotations

import gc
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest

import meltemi
from meltemi import Controller, Model, Status
from meltemi.bladed_controllers import host
from meltemi.bladed_controllers.records import EXCHANGED, RECORDS, SIZE
from meltemi.bladed_controllers.rosco import edit_discon
from meltemi.control import signals as s

WIND = meltemi.SteadyWind(speed=12.0, shear_exponent=0.2, direction=0.1)
SHORT = 0.5


@pytest.fixture
def make(library: Path, model: Model, tmp_path: Path) -> Any:
    """A controller whose library does what a word says."""

    def maker(what: str = "", model: Model = model, **more: Any) -> Controller:
        order = tmp_path / f"{what.replace(' ', '_') or 'plain'}.in"
        order.write_text(what)
        return meltemi.control.BladedController(model.turbine, library, order, **more)

    return maker


def run(model: Model, controller: Controller, duration: float = SHORT, **more: Any) -> meltemi.Result:
    channels = ["generator_torque", "pitch_1", "pitch_2", "pitch_3"]
    return meltemi.simulate(model, WIND, duration=duration, controller=controller, channels=channels, **more)


def children() -> list[psutil.Process]:
    """Library processes that live."""
    found = []
    for process in psutil.Process().children(recursive=True):
        try:
            if host.CHILD.name in " ".join(process.cmdline()):
                found.append(process)
        except psutil.NoSuchProcess:
            pass
    return found


def test_records_are_what_the_turbine_measures(make: Any, model: Model, tmp_path: Path) -> None:
    """Against the same measurements in a Python controller that demands the same."""
    seen = []

    def same(state: Any, m: Any, demands: Any, dt: float) -> None:
        seen.append((m.copy(), demands.copy()))
        demands[s.GENERATOR_TORQUE] = np.float32(40000.0)
        demands[s.PITCH_DEMAND : s.PITCH_DEMAND + 3] = np.float32(0.06)

    run(model, Controller(same))
    run(model, make("dump", folder=tmp_path))
    (dump,) = tmp_path.glob("*/run.SrvD.records")
    rows = np.loadtxt(dump)
    assert rows.shape == (len(seen) + 1, 129)
    got = dict(enumerate(rows[:-1].T, start=1))
    status = [0.0] + [1.0] * (len(seen) - 1) + [-1.0]
    np.testing.assert_array_equal(rows[:, 0], status)
    names = s.Measurements.names
    measured = np.array([m for m, _ in seen])
    by_name = [r for r in RECORDS if r.way == "to" and r.source in names]
    assert len(by_name) > 20
    for r in by_name:
        expected = measured[:, names.index(r.source)]
        if r.source == "azimuth":
            expected = expected % (2.0 * math.pi)
        np.testing.assert_allclose(got[r.number], expected, rtol=1e-6, atol=1e-30, err_msg=r.meaning)
    t = model.turbine
    assert got[3][0] == pytest.approx(measured[1, s.TIME] - measured[0, s.TIME], rel=1e-7)
    assert got[7][0] == pytest.approx(t.pitch_actuator.maximum, rel=1e-7)
    assert got[9][0] == -got[8][0] == pytest.approx(t.pitch_actuator.rate_limit, rel=1e-7)
    assert got[13][0] == t.rated_power
    assert got[22][0] == pytest.approx(t.control.torque.rated_power / t.control.torque.rated_speed)
    assert got[129][0] == SIZE
    # wind from direction 0.1, which is clockwise: over the nacelle it comes from the other side
    np.testing.assert_allclose(got[24], -0.1 - got[37], atol=1e-6)
    np.testing.assert_allclose(np.hypot(got[73], got[74]), np.hypot(got[75], got[76]), rtol=1e-6)
    turned = got[75] * np.cos(got[60]) + got[76] * np.sin(got[60])
    np.testing.assert_allclose(got[73], turned, rtol=1e-4, atol=1.0)
    np.testing.assert_allclose(got[78], measured[:, s.YAW_BEARING_MOMENT + 2], rtol=1e-6)


def test_moments_are_those_of_the_channels(model: Model) -> None:
    """The measurements that the records brought, by OpenFAST's names: of the step before; accelerations of now."""
    seen: list[Any] = []

    def law(state: Any, m: Any, demands: Any, dt: float) -> None:
        seen.append(m.copy())

    dt = run(model, Controller(law), 0.2).meta["time_step"]
    seen.clear()
    channels = ["LSSTipMys", "LSSTipMzs", "YawBrMxp", "YawBrMyp", "YawBrMzp", "RotPwr"]
    turning = "NcIMURAys"
    result = meltemi.simulate(
        model, WIND, duration=0.2, controller=Controller(law), channels=[*channels, turning], output_step=dt
    )
    measured = np.array(seen)[1:]
    rows = [
        s.HUB_MOMENT + 1,
        s.HUB_MOMENT + 2,
        *(s.YAW_BEARING_MOMENT + i for i in range(3)),
        s.ROTOR_POWER,
    ]
    for channel, row in zip(channels, rows, strict=True):
        np.testing.assert_allclose(measured[:, row], result[channel][:-1], rtol=1e-12, err_msg=channel)
    a = result[turning]
    extrapolated = [a[0], *(2.0 * a[1:-1] - a[:-2])]
    np.testing.assert_allclose(measured[:, s.NACELLE_TURNING + 1], extrapolated, rtol=1e-9)


def test_names_reach_the_library_whole(make: Any, model: Model) -> None:
    assert run(model, make("lengths"))["generator_torque"][-1] == 1.0


def test_demands_reach_the_turbine(make: Any, model: Model) -> None:
    ideal = meltemi.build(model.turbine.replace(**{"pitch_actuator.kind": "ideal"}))
    each = run(ideal, make("each"))
    assert [each[f"pitch_{b}"][-1] for b in (1, 2, 3)] == [np.float32(x) for x in (0.06, 0.08, 0.10)]
    together = run(ideal, make("each", individual_pitch=False))
    assert {float(together[f"pitch_{b}"][-1]) for b in (1, 2, 3)} == {float(np.float32(0.07))}
    assert run(model, make())["generator_torque"][-1] == 40000.0
    assert run(model, make("off"))["generator_torque"][-1] == 0.0


def last_demands(model: Model, controller: Controller) -> Any:
    simulation = meltemi.Simulation(meltemi.Run(model, WIND, duration=SHORT, controller=controller))
    simulation.advance(10)
    demands = simulation.case.view("demands").array.copy()
    simulation.close()
    return demands


def test_brake_yaw_and_flaps(make: Any, model: Model) -> None:
    assert last_demands(model, make())[s.BRAKE] == 0.0
    assert last_demands(model, make("brake"))[s.BRAKE] == 1.0
    assert last_demands(model, make("yaw"))[s.YAW_RATE_DEMAND] == np.float32(0.004)
    flapped = meltemi.build(meltemi.turbine.with_flaps(model.turbine))
    demands = last_demands(flapped, make("flap", model=flapped))
    assert demands[s.FLAP_DEMAND] == pytest.approx(math.radians(5.0))
    assert demands[s.FLAP_DEMAND + 1] == 0.0
    assert not last_demands(model, make("flap"))[s.FLAP_DEMAND :].any()


def test_sample_time_holds_demands(make: Any, model: Model) -> None:
    result = run(model, make("count", sample_time=0.1), 1.0)
    assert result["generator_torque"][-1] == 11.0
    np.testing.assert_array_equal(np.diff(result["generator_torque"])[:4], [0.0, 1.0, 0.0, 1.0])


def test_every_run_has_a_fresh_library(make: Any, model: Model) -> None:
    controller = make("count")
    first, second = (run(model, controller)["generator_torque"] for _ in range(2))
    np.testing.assert_array_equal(first, second)
    simulation = meltemi.Simulation(
        meltemi.Run(model, WIND, duration=SHORT, controller=controller, channels=["generator_torque"])
    )
    for _ in range(2):
        simulation.advance(simulation.n_steps)
        np.testing.assert_array_equal(simulation.result()["generator_torque"], first)
        assert not children()
        simulation.reset()


def test_metadata_tell_input_files_apart(make: Any, model: Model) -> None:
    hashes = [run(model, make(what)).meta["controller_state_hash"] for what in ("count", "each", "count")]
    assert hashes[0] == hashes[2] != hashes[1]


@pytest.mark.parametrize(
    ("what", "words"),
    [
        ("crash", "crashed (SIGSEGV"),
        ("exit", "ended its process with exit code 3"),
        ("hang", "did not come back from a call within 0.4 s"),
        ("fail", "requested the end of the run: the gearbox is too hot"),
        ("override", "records 55, 56"),
        ("nan", "generator_torque = nan"),
    ],
)
def test_what_goes_wrong_ends_that_run_in_words(make: Any, model: Model, what: str, words: str) -> None:
    result = run(model, make(f"{what} 0.4", timeout=0.4), partial=True)
    assert result.status in (Status.CONTROLLER_RAISED, Status.CONTROLLER_DEMAND)
    assert words in result.message and "\n" not in result.message
    if what != "override":
        assert "at t = 0.4" in result.message
        assert len(result.time) == 8 and np.isfinite(result.data).all()
    if what == "crash":
        assert "libdiscon.so" in result.message and "it printed: hello from the library" in result.message
    assert not children()


def test_a_warning_of_the_library_is_one_of_the_result(make: Any, model: Model) -> None:
    result = run(model, make("warn"))
    assert result.status is Status.OK
    assert result.warnings == ("oil is low",)


@pytest.mark.slow
def test_a_batch_goes_on(make: Any, model: Model) -> None:
    orders = ["count", "crash 0.2", "count", "hang 0.2", "count", "fail 0.2", "count", "exit 0.2"]
    cases = [
        meltemi.Run(
            model,
            WIND,
            duration=SHORT,
            controller=make(order, timeout=2.0),
            channels=["generator_torque"],
            name=f"{i} {order}",
        )
        for i, order in enumerate(orders)
    ]
    outcomes = meltemi.simulate_batch(cases, workers=4)
    assert [outcome.ok for outcome in outcomes] == [order == "count" for order in orders]
    good = [outcome.value["generator_torque"] for outcome in outcomes if outcome.ok]
    for other in good[1:]:
        np.testing.assert_array_equal(other, good[0])
    assert not children()


def test_nothing_is_left_behind(make: Any, model: Model, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Not by a run that is dropped, interrupted, or whose progress raises; nothing is printed, no file stays."""
    before = sorted(tmp_path.parent.rglob("*"))
    controller = make()
    order = tmp_path / "plain.in"
    dropped = meltemi.Simulation(meltemi.Run(model, WIND, duration=SHORT, controller=controller))
    dropped.advance(5)
    (process,) = children()
    folder = Path(process.cwd())
    assert (folder / host.LOG).is_file()
    del dropped
    gc.collect()
    assert not children() and not folder.exists()

    def stop(share: float) -> None:
        raise KeyboardInterrupt

    assert run(model, controller, 5.0, progress=stop, partial=True).status is Status.INTERRUPTED
    assert not children()
    assert capfd.readouterr().out == ""
    assert set(tmp_path.parent.rglob("*")) - set(before) == {order}


def test_a_kept_folder_has_what_was_printed(make: Any, model: Model, tmp_path: Path) -> None:
    run(model, make(folder=tmp_path))
    (log,) = tmp_path.glob("controller-*/library.log")
    assert log.read_text() == "hello from the library\n"


@pytest.mark.slow
def test_a_child_ends_with_its_parent(library: Path) -> None:
    """Even when the library never returns and the parent is killed."""
    order = library.with_name("hang.in")
    order.write_text("hang")
    script = (
        "import sys; from pathlib import Path; from meltemi.bladed_controllers.host import Host, Library\n"
        f"h = Host(Library(Path({str(library)!r}), {str(order)!r}, 'DISCON', 60.0, 60.0, None))\n"
        "h._watch.idle = False; h._requests.write(h._request); print(h._process.pid, flush=True)\n"
        "import time; time.sleep(60)"
    )
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    child = psutil.Process(int(parent.stdout.readline()))
    parent.kill()
    parent.wait()
    parent.stdout.close()
    assert psutil.wait_procs([child], timeout=10.0)[1] == []


def test_bad_input_says_what_to_do(library: Path, model: Model, tmp_path: Path) -> None:
    turbine = model.turbine
    with pytest.raises(meltemi.InputError, match="did you mean 'libdiscon.so'"):
        meltemi.control.BladedController(turbine, library.with_name("libdiscom.so"))
    with pytest.raises(meltemi.InputError, match="input file .*DISCON.IN: no such file"):
        meltemi.control.BladedController(turbine, library, tmp_path / "DISCON.IN")
    with pytest.raises(meltemi.InputError, match="timeout must be"):
        meltemi.control.BladedController(turbine, library, timeout=math.nan)
    with pytest.raises(meltemi.InputError, match="no folder"):
        meltemi.control.BladedController(turbine, library, folder=tmp_path / "nowhere")
    with pytest.raises(meltemi.InputError, match=r"expected a shared library .* with the function CONTROL") as wrong:
        run(model, meltemi.control.BladedController(turbine, library, procedure="CONTROL"))
    assert "undefined symbol" in str(wrong.value) or "CONTROL" in str(wrong.value)
    text = tmp_path / "text.so"
    text.write_text("no library")
    with pytest.raises(meltemi.InputError, match=r"text.so: cannot be used as a controller library"):
        run(model, meltemi.control.BladedController(turbine, text))
    assert not children()


def test_the_table_has_every_record_once() -> None:
    numbers = [r.number for r in RECORDS]
    assert numbers == sorted(set(numbers)) and numbers[-1] < EXCHANGED


DISCON = """! a comment
1    ! LoggingLevel - as it was
0.0  0.0 ! IPC_KI  - gains
"Cp.txt" ! PerfFileName - table
"none.txt" ! OL_Filename - not there
"""


def test_discon_files_are_edited(tmp_path: Path) -> None:
    source, target = tmp_path / "DISCON.IN", tmp_path / "sub" / "new.IN"
    source.write_text(DISCON)
    (tmp_path / "Cp.txt").write_text("")
    target.parent.mkdir()
    edit_discon(source, target, IPC_KI=(1e-8, 0.0), LoggingLevel=0)
    lines = target.read_text().splitlines()
    assert lines[0] == "! a comment" and lines[1] == "0  ! LoggingLevel"
    assert lines[2] == "1e-08 0  ! IPC_KI"
    assert lines[3] == f'"{tmp_path / "Cp.txt"}"  ! PerfFileName'
    assert lines[4].startswith('"none.txt"')
    with pytest.raises(meltemi.InputError, match="did you mean 'IPC_KI'"):
        edit_discon(source, target, IPC_KJ=1.0)
    with pytest.raises(meltemi.InputError, match="cannot be read"):
        edit_discon(tmp_path / "nothing", target)


def test_rosco_is_looked_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("meltemi.core.extras.installed", lambda name: False)
    with pytest.raises(meltemi.InputError, match="pip install --no-deps"):
        meltemi.control.find_rosco()
