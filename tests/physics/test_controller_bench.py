"""Test bench of controllers: suite, plants, margins, verdicts, files."""

import csv
import json
import math
from dataclasses import replace

import numpy as np
import pytest

import meltemi
from meltemi.control.controller import Controller
from meltemi.controllers.tuning import linear_models, margins, scaled
from meltemi.core.errors import InputError
from meltemi.papers.he2018.runs import TUNING_SEEDS, LoadControlSetup
from meltemi.simulation.rotors import default_step
from meltemi.tuning.controller_bench import study
from meltemi.tuning.controller_bench.bench import ControllerBench
from meltemi.tuning.controller_bench.contenders import Contender, contenders
from meltemi.tuning.controller_bench.disturbance import disturbed
from meltemi.tuning.controller_bench.margins import (
    STEP,
    Multisine,
    OpenLoop,
    speed_loop,
)
from meltemi.tuning.controller_bench.report import write_bench
from meltemi.tuning.controller_bench.runs import run_bench
from meltemi.tuning.controller_bench.suite import (
    FIRST_SEED,
    BenchLimits,
    Situation,
    cases_of,
    mistuned,
    suite_of,
)
from meltemi.tuning.controller_bench.tables import criteria_table, leaderboard_rows
from meltemi.tuning.controller_bench.verdicts import decibel

pytestmark = pytest.mark.slow

SINE = Multisine(period=20.0, settling=20.0)
PRODUCTION = Situation("normal turbulence", "NTM", "production", "NTM", (14.0, 18.0), 2, 15.0, 5.0)


@pytest.fixture(scope="module")
def turbine():
    return meltemi.load_turbine("nrel5mw")


@pytest.fixture(scope="module")
def model(turbine):
    return meltemi.build(turbine)


def entry(name, controller):
    return Contender(name, controller, controller)


def weaker(turbine, factor):
    control = turbine.control
    gains = {f"pitch.{k}": factor * getattr(control.pitch, k) for k in ("proportional_gain", "integral_gain")}
    return meltemi.control.BaselineController(turbine.replace(control=control.replace(**gains)))


@pytest.fixture(scope="module")
def bench(model, turbine):
    """The baseline, itself under another name, and a controller without pitch."""

    def frozen(state, measurements, demands, dt):
        demands.generator_torque = 40e3

    entries = [
        entry("baseline", meltemi.control.BaselineController(turbine)),
        entry("same", meltemi.control.BaselineController(turbine)),
        entry("no pitch", Controller(frozen)),
    ]
    softer = Situation("softer", "", "robustness", "NTM", (18.0,), 1, 10.0, 5.0, stiffness=0.8)
    return run_bench(model, entries, (PRODUCTION, softer), sine=SINE, limits=BenchLimits(over_speed=1.2))


def test_suite_has_the_speeds_seeds_and_situations(turbine):
    suite = {s.name: s for s in suite_of(turbine)}
    assert suite["normal turbulence"].speeds == (4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24)
    assert suite["normal turbulence"].seeds == 6
    assert suite["normal turbulence"].duration == 600.0
    wanted = (
        "extreme turbulence,gust,direction change,start,normal stop,emergency stop,grid loss,sensor noise,sensor bias"
    )
    wanted += ",actuator delay,blade stuck,inertia +20 %,inertia -20 %,stiffness +20 %,stiffness -20 %,icing"
    assert set(wanted.split(",")) <= set(suite)
    cases = list(cases_of(tuple(suite.values())))
    assert len({c.name for c in cases}) == len(cases)
    assert sum(c.situation.group == "production" for c in cases) == 66
    quick = list(cases_of(suite_of(turbine, quick=True)))
    assert {c.situation.name for c in quick} == set(suite)
    assert sum(c.duration for c in quick) < 0.06 * sum(c.duration for c in cases)


def test_seeds_are_held_out(turbine):
    """No tuning or study uses them; those of two speeds differ."""
    seeds = {(c.situation.name, c.seed) for c in cases_of(suite_of(turbine)) if c.situation.group == "production"}
    assert len(seeds) == 66
    assert min(seed for _, seed in seeds) > FIRST_SEED > 1_000_000
    assert max(*TUNING_SEEDS, *LoadControlSetup().seeds, *LoadControlSetup().study_seeds) < 1_000_000


def test_a_turbine_with_a_lower_cut_out_has_fewer_speeds(turbine):
    assert max(v for s in suite_of(turbine.replace(cut_out=20.0)) for v in s.speeds) == 18.0
    narrow = suite_of(turbine.replace(cut_in=15.0, cut_out=20.0), quick=True)
    assert next(s.speeds for s in narrow if s.group == "production") == (16.0, 18.0)


def test_mistuned_plant_has_other_frequencies_and_the_same_control(turbine, model):
    soft, heavy = mistuned(turbine, 1.0, 0.8), mistuned(turbine, 1.2, 1.0)
    assert soft.control == heavy.control == turbine.control
    assert soft.tower.mass == pytest.approx(turbine.tower.mass)
    assert heavy.blade.structure.mass == pytest.approx(1.2 * turbine.blade.structure.mass)
    assert heavy.drivetrain.generator_inertia == pytest.approx(1.2 * turbine.drivetrain.generator_inertia)

    def tower(plant):
        return meltemi.analysis.natural_modes(plant)[0].frequency

    assert tower(meltemi.build(soft)) / tower(model) == pytest.approx(math.sqrt(0.8), rel=0.005)
    assert mistuned(turbine, 1.0, 1.0) is turbine


@pytest.mark.long
def test_an_identical_controller_differs_by_nothing_and_fails_nothing_of_its_own(bench):
    table = bench.lifetime("same")
    assert all(e.change.mean == 0.0 and e.change.half_width == 0.0 for e in table if e.change is not None)
    same = {v.criterion: v for v in bench.verdicts("same")}
    for name in ("energy", "lifetime loads", "extreme loads"):
        assert same[name].value == 0.0 and same[name].passed
    base = {v.criterion: v.passed for v in bench.verdicts("baseline")}
    assert all(passed == same[name].passed for name, passed in base.items())
    # near rated wind the published gains leave less than 30 degrees
    assert {name for name, passed in base.items() if passed is False} <= {"speed loop: phase margin"}


@pytest.mark.long
def test_a_controller_without_pitch_fails_the_limits_of_speed(bench):
    bad = {v.criterion: v for v in bench.verdicts("no pitch")}
    assert bad["generator speed"].passed is False
    assert bad["generator speed"].value > 120.0
    assert bad["generator speed"].where.startswith("normal turbulence, 1")


def test_limits_decide(bench):
    (tight,) = (
        v for v in bench.judged(BenchLimits(over_speed=1.01)).verdicts("same") if v.criterion == "generator speed"
    )
    assert tight.passed is False
    (wide,) = (
        v for v in bench.judged(BenchLimits(over_speed=5.0)).verdicts("no pitch") if v.criterion == "generator speed"
    )
    assert wide.passed


def test_verdict_says_that_the_limit_lies_within_the_interval(bench):
    energy = next(v for v in bench.verdicts("same") if v.criterion == "energy")
    assert replace(energy, value=-0.9, half_width=0.2).word == "pass, limit within interval"
    assert replace(energy, value=-0.5, half_width=0.2).word == "pass"


def test_changes_are_paired_by_seed():
    """Scatter that both controllers share falls out; the interval is that of Student for the differences."""
    rng, cases = np.random.default_rng(1), tuple(cases_of((replace(PRODUCTION, seeds=6),)))
    names = ["power mean", "power std", "generator speed std", "pitch travel"]
    names += [f"{n} DEL" for n in ("RootMyc1", "RootMxc1", "TwrBsMyt", "TwrBsMxt", "YawBrMyp", "YawBrMzp")]
    numbers = {}
    for case in cases:
        size = 1.0 + 0.3 * rng.random()
        numbers[case.name, "a"] = dict.fromkeys(names, size)
        numbers[case.name, "b"] = dict.fromkeys(names, 0.9 * size)
    found = ControllerBench(
        "", "IB", ("a", "b"), {}, frozenset(), cases, numbers, {}, {}, {}, PRODUCTION.speeds, 10.0, BenchLimits()
    )
    change = found.lifetime("b").entry("TwrBsMyt DEL", "b").change
    assert change.mean == pytest.approx(-0.1, abs=1e-12)
    assert change.half_width < 1e-12 < found.lifetime("b").entry("TwrBsMyt DEL", "b").value.half_width
    assert change.n == 6


def test_failed_run_fails_the_criterion_and_leaves_out_its_seed(bench):
    case = next(c for c in bench.cases if c.situation.group == "production")
    key = (case.name, "same")
    broken = replace(bench, numbers={k: v for k, v in bench.numbers.items() if k != key}, failures={key: "diverged"})
    assert broken.lifetime("same").seeds == bench.lifetime("same").seeds - 1
    assert broken.lifetime("no pitch").seeds == bench.lifetime("no pitch").seeds
    assert broken.verdicts("same")[0].passed is False


def test_a_controller_whose_runs_fail_is_last_and_is_no_reference(bench):
    lost = {(case.name, "same"): "diverged" for case in bench.cases}
    broken = replace(bench, numbers={k: v for k, v in bench.numbers.items() if k[1] != "same"}, failures=lost)
    assert [standing.controller for standing in broken.leaderboard()] == ["baseline", "no pitch", "same"]
    table = criteria_table(broken.all_verdicts())
    energy = next(row for row in table.texts if row[0] == "energy")
    assert energy[2:4] == ["reference", "-"]


def test_margins_are_upper_bounds_where_a_loop_is_not_linear(bench):
    loops = tuple(replace(loop, repeatability=0.2 * i) for i, loop in enumerate(bench.loops["same"]))
    bent = replace(bench, loops={**bench.loops, "same": loops})
    (standing,) = (s for s in bent.leaderboard() if s.controller == "same")
    assert standing.speed_loop.nonlinear == (18.0,)
    assert standing.speed_loop.phase_margin == loops[0].phase_margin
    row = next(row for row in leaderboard_rows(bent.leaderboard(), bent.reference)[1] if row[0] == "same")
    assert all(cell.startswith("≤ ") for cell in row[-4:-2])
    assert row[-2:] == ["-", "-"]  # no blade loops


def loop_of(L, lowest=0.05, highest=20.0):
    w = np.geomspace(lowest, highest, 2000)
    return OpenLoop(12.0, w, L(1j * w), 0.0)


def test_margins_of_closed_forms():
    """L = k / (s (s + 1) (s + 2)): gain margin 6 / k; crossover, phase and delay margin by definition."""
    k = 1.5
    loop = loop_of(lambda s: k / (s * (s + 1.0) * (s + 2.0)))
    assert loop.gain_margin == pytest.approx(6.0 / k, rel=1e-4)
    w = loop.crossover
    assert w * math.hypot(w, 1.0) * math.hypot(w, 2.0) == pytest.approx(k, rel=1e-4)
    phase = math.pi / 2.0 - math.atan(w) - math.atan(w / 2.0)
    assert loop.phase_margin == pytest.approx(phase, rel=1e-4)
    assert loop.delay_margin == pytest.approx(phase / w, rel=1e-4)


def test_a_delay_costs_phase_by_its_frequency():
    slow = loop_of(lambda s: 1.0 / s)
    late = loop_of(lambda s: np.exp(-0.3 * s) / s)
    assert slow.phase_margin - late.phase_margin == pytest.approx(0.3, abs=1e-4)
    assert late.delay_margin == pytest.approx(math.pi / 2.0 - 0.3, rel=1e-3)


def test_loop_is_recovered_from_two_runs_with_a_common_motion():
    """The periodic motion of both runs falls out; a loop k / s with the sensor's signal d has y = -d k / (s + k)."""
    signal, k = Multisine(period=20.0, settling=10.0), 0.8
    time = STEP * np.arange(round(signal.duration / STEP) + 1)
    w = 2.0 * math.pi * signal.lines
    d = np.fft.rfft([signal(t) for t in time[: round(signal.period / STEP)]])
    spectrum = np.zeros_like(d)
    at = np.round(signal.lines * signal.period).astype(int)
    spectrum[at] = -d[at] * k / (1j * w + k)
    once = np.fft.irfft(spectrum, round(signal.period / STEP))
    y = np.resize(once, len(time))
    common = 100.0 * (1.0 + 0.01 * np.sin(3.7 * time))
    loop = speed_loop(12.0, signal, common + 100.0 * y, common - 100.0 * y)
    assert np.abs(loop.response / (k / (1j * w)) - 1.0).max() < 1e-3
    assert loop.repeatability < 1e-3


def measured(model, controller, speed, sine, delay=0.0):
    runs = []
    for sign in (1.0, -1.0):
        signal = Multisine(sine.period, sine.settling, sign)
        result = meltemi.simulate(
            model,
            meltemi.SteadyWind(speed=speed),
            duration=signal.duration,
            controller=disturbed(controller, probe=signal, delay=delay),
            channels=["generator_speed"],
            output_step=STEP,
        )
        runs.append(result["generator_speed"])
    return speed_loop(speed, sine, *runs)


def test_measured_loop_is_that_of_the_linear_model(model, turbine):
    """Turbine from ``linearise``, controller in closed form: PI with schedule, filter, constant power."""
    point = meltemi.operating_point(model, 16.0)
    linear = meltemi.analysis.linearise(model, point, ("generator_torque", "pitch"), ("generator_speed",), azimuths=12)
    control = turbine.control
    sine = Multisine(period=40.0, settling=60.0)
    loop = measured(model, meltemi.control.BaselineController(turbine), 16.0, sine)
    s, dt, p = 1j * loop.frequency, default_step(model), control.pitch
    P, z = linear.response(s)[:, 0], np.exp(s * dt)
    share = 1.0 / (1.0 + point.pitch / p.gain_halving_pitch)
    C = share * (p.proportional_gain + p.integral_gain * dt / (1.0 - 1.0 / z))
    C /= 1.0 + share * point.pitch / p.gain_halving_pitch / z  # the schedule follows the last demand
    slope = -control.torque.rated_power / p.reference_speed**2
    alpha = math.exp(-control.filter_frequency * dt)
    known = -(P[:, 1] * C + P[:, 0] * slope) * (1.0 - alpha) / (1.0 - alpha / z) * np.exp(-0.5 * s * dt)
    some = loop.frequency < 1.5
    assert np.abs(loop.response[some] / known[some] - 1.0).max() < 0.007
    exact = OpenLoop(16.0, loop.frequency, known, 0.0)
    assert loop.phase_margin == pytest.approx(exact.phase_margin, abs=math.radians(0.5))
    late = measured(model, meltemi.control.BaselineController(turbine), 16.0, sine, delay=0.2)
    # all of the loop but the constant power goes through the pitch
    assert np.degrees(loop.phase_margin - late.phase_margin) == pytest.approx(
        math.degrees(0.2 * loop.crossover), rel=0.35
    )


def test_disturbances_change_the_run_and_repeat(model, turbine):
    base = meltemi.control.BaselineController(turbine)

    def speeds(controller):
        run = meltemi.simulate(
            model, 16.0, duration=3.0, controller=controller, channels=["generator_speed", "pitch_1"]
        )
        return run["pitch_1"]

    plain = speeds(base)
    assert np.array_equal(speeds(disturbed(base)), plain)
    noisy = [speeds(disturbed(base, noise=1.0, seed=k)) for k in (1, 1, 2)]
    assert np.array_equal(noisy[0], noisy[1])
    assert not np.array_equal(noisy[0], noisy[2])
    assert not np.array_equal(speeds(disturbed(base, noise=1.0, delay=0.2)), noisy[0])


def test_module_and_function_names(model, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    source = "import meltemi\ndef regulator(turbine):\n    return meltemi.control.BaselineController(turbine)\n"
    (tmp_path / "bench_mine.py").write_text(source + "def wrong(turbine):\n    return 1\n")
    (made,) = contenders({"mine": "bench_mine:regulator"}, model)
    assert isinstance(made.controller, Controller)
    for name, words in (
        ("bench_min:regulator", "no module 'bench_min' here or installed; did you mean 'bench_mine'"),
        ("bench_mine:regulater", "did you mean 'regulator'"),
        ("bench_mine:wrong", "must return a meltemi.Controller, found int"),
        (":x", "expected module:function"),
    ):
        with pytest.raises(InputError, match=words):
            contenders({"x": name}, model)


def test_rosco_needs_an_input_file_for_other_turbines(turbine):
    try:
        meltemi.control.find_rosco()
    except InputError:
        pytest.skip("the rosco package is not installed")
    with pytest.raises(InputError, match="rosco@DISCON.IN"):
        contenders({"rosco": "rosco"}, meltemi.build(turbine.replace(name="mine")))


def test_a_controller_that_does_not_work_is_refused_at_once(model, tmp_path):
    """Not after all runs of the suite have ended at their begin."""
    path = tmp_path / "mine.py"
    path.write_text(
        "import meltemi\ndef update(state, measured, demands, dt):\n    demands.pitch[:] = measured.rotor_sped\n"
        "def controller(turbine):\n    return meltemi.Controller(update)\n"
    )
    with pytest.raises(InputError, match=r"controller 'mine' fails in its first steps: .*rotor_sped"):
        contenders({"baseline": "baseline", "mine": str(path)}, model)


def test_files(bench, tmp_path):
    files = {path.name for path in write_bench(bench, tmp_path, repeat="meltemi bench-controller x")}
    assert {"bench.html", "bench.json", "runs.csv", "margins.csv", "verdicts.csv", "leaderboard.md"} <= files
    content = json.loads((tmp_path / "bench.json").read_text())
    assert content["reference"] == "baseline"
    with (tmp_path / "runs.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(bench.cases) * 3
    assert rows[0]["seed"] == str(bench.cases[0].seed)
    board = (tmp_path / "leaderboard.md").read_text().splitlines()
    assert board[0].startswith("| controller | failed |")
    assert "| no pitch |" in board[4]
    page = (tmp_path / "bench.html").read_text()
    for heading in ("Criteria", "Production", "Stability margins", "Robustness"):
        assert f"<h2>{heading}</h2>" in page
    assert '"spokes"' in page


def test_leaderboard_in_numbers(bench):
    first, *_, last = bench.leaderboard()
    assert (first.controller, last.controller) == ("baseline", "no pitch")
    assert first.energy is None and first.failed < last.failed
    assert last.speed == max(numbers["generator speed max"] for numbers in bench.of("no pitch").values())
    table = bench.lifetime("no pitch")
    assert last.tower_load == table.entry("TwrBsMyt DEL", "no pitch").change
    with pytest.raises(InputError, match="did you mean 'no pitch'"):
        bench.verdicts("no ptch")


def test_card_and_figure(bench):
    shown = bench._repr_html_()
    assert "3 controllers of nrel5mw" in shown and "Leaderboard" in shown and "no pitch" in shown
    assert repr(bench) == "<ControllerBench of baseline, same, no pitch on nrel5mw in 5 cases>"
    figure = meltemi.plots.plot_bench(bench)
    radar, *margins = figure.axes
    assert [line.get_label() for line in radar.lines] == list(bench.controllers)
    assert np.allclose(radar.lines[1].get_ydata(), 100.0)
    assert len(margins) == 2
    loops = bench.loops["baseline"]
    margins = meltemi.plots.plot_bench(replace(bench, blade_loops={"same": loops})).axes[1:]
    phases, gains = ([getattr(loop, f"{kind}_margin") for loop in loops] for kind in ("phase", "gain"))
    for ax, values in zip(margins, (np.degrees(phases), [decibel(gain) for gain in gains]), strict=True):
        (dashed,) = (line for line in ax.lines if line.get_linestyle() == "--" and len(line.get_xdata()))
        assert np.allclose(dashed.get_ydata(), np.where(np.isfinite(values), values, np.nan), equal_nan=True)
        assert "blade loops dashed" in ax.get_title(loc="left")


TINY = (Situation("normal turbulence", "NTM", "production", "NTM", (16.0, 18.0), 1, 5.0, 1.0),)


def test_controllers_functions_and_names_by_label(turbine, monkeypatch):
    monkeypatch.setattr(study, "suite_of", lambda turbine, quick: TINY)
    monkeypatch.setattr(study, "QUICK_SINE", Multisine(5.0, 5.0))
    law, seen = meltemi.control.BaselineController, []
    given = {"object": law(turbine), "function": law, "name": "baseline"}
    found = meltemi.analysis.bench_controllers(
        turbine, given, reference="name", quick=True, limits=BenchLimits(over_speed=1.3), progress=seen.append
    )
    assert found.controllers == ("name", "object", "function")
    assert found.supervised == {"name"}
    assert found.limits.over_speed == 1.3
    assert all(standing.tower_load.mean == 0.0 for standing in found.leaderboard() if standing.tower_load)
    assert seen == sorted(seen) and seen[-1] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("controllers", "more", "words"),
    [
        ({}, {}, "name at least one of baseline"),
        ([], {}, "name at least one of baseline"),
        ("ipx", {}, "expected Mapping or a list of texts, found 'ipx'"),
        ({"a": 5}, {}, "'a': expected a controller, a function of the turbine or a name, found int"),
        (["x/mine.so", "y/mine.so"], {}, "two of them are called 'mine'"),
        (["ipc"], {"reference": "basline"}, "did you mean 'baseline'"),
        (["ipc"], {"wind_class": "IX"}, "IX"),
        (["ipc"], {"refrence": "baseline"}, "did you mean 'reference'"),
        ({"a": lambda turbine: 1}, {}, "a: controller.turbine. must return a meltemi.Controller, found int"),
    ],
)
def test_bad_calls(turbine, controllers, more, words):
    with pytest.raises(InputError, match=words):
        meltemi.analysis.bench_controllers(turbine, controllers, **more)


def test_a_turbine_of_coefficients_has_no_bench():
    with pytest.raises(InputError, match="power-coefficient turbine"):
        meltemi.analysis.bench_controllers(meltemi.load_turbine("pmsg20mw"), ["ipc"])


@pytest.mark.long
def test_measured_blade_loops_are_those_of_the_linear_model(model, turbine):
    """Individual pitch at 16 m/s; three times its gains have a third of the gain margin, tenfold ones oscillate."""
    gains = {"integral_gain": 1.27e-8, "proportional_gain": 4.95e-9, "gain_halving_pitch": 1.82}
    ipc = meltemi.control.HarmonicLoop(harmonic=1, filter_damping=2.02, offset=0.461, **gains)
    loops = {f: scaled(ipc, f) for f in (1.0, 3.0, 10.0)}
    entries = [
        entry(f"{f:g}", meltemi.control.LoadController(turbine, meltemi.control.LoadControl(loops=(loop,))))
        for f, loop in loops.items()
    ]
    entries.append(entry("baseline", meltemi.control.BaselineController(turbine)))  # without blade loops
    steady = Situation("normal turbulence", "", "production", "steady", (16.0,), 0, 5.0, 5.0)
    found = run_bench(model, entries, [steady], sine=Multisine(period=50.0, settling=100.0)).blade_loops
    assert set(found) == {"1", "3", "10"}
    once, thrice, tenfold = (found[name][0] for name in ("1", "3", "10"))
    assert not tenfold.linear
    assert decibel(once.gain_margin) - decibel(thrice.gain_margin) == pytest.approx(20.0 * math.log10(3.0), abs=1.0)
    linear = linear_models(model, [16.0])
    for f, loop in ((1.0, once), (3.0, thrice)):
        phase, gain = margins(linear, [loops[f]], sample_time=default_step(model))
        assert loop.phase_margin == pytest.approx(phase, abs=math.radians(2.5))
        assert decibel(loop.gain_margin) == pytest.approx(decibel(gain), abs=3.0)  # lines pass by weakly damped modes
