"""Designs by gradients without simulation: variables, terms, the problem and its search, history."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Result, Turbine, load_turbine
from meltemi.core.yamlfile import validated, write_record
from meltemi.designs.design import _of_seeds, _places, _Study
from meltemi.designs.problem import History, Problem
from meltemi.designs.report import controller_text
from meltemi.designs.runs import Statistics, TrialError, cases_of
from meltemi.designs.search import multipliers, search
from meltemi.designs.settings import ConstraintSetting, Design, VariableSetting
from meltemi.designs.terms import combined, soft_maximum, statistic, term_of
from meltemi.designs.variables import Variable, Variables, spline_rows, variables_of
from meltemi.gradients.extrapolation import ENOUGH, extrapolated
from meltemi.loads import damage_equivalent_load
from meltemi.simulation.channels import every_kind

TURBINE = load_turbine("nrel5mw")
assert isinstance(TURBINE, Turbine)
NAMES = ("tower_base_moment_fore_aft", "pitch_1", "tip_clearance_1", "tip_clearance_2")
FILE: dict[str, Any] = {
    "turbine": "nrel5mw",
    "variables": {"controller.proportional_gain": {"low": 0.5, "high": 2.0, "relative": True}},
    "objective": {"std rotor_speed": 1.0},
    "cases": [{"speed": 16.0, "seeds": [1, 2], "weight": 3.0}, {"speed": 20.0}],
}


def series(seed: int = 1) -> Result:
    random, time = np.random.default_rng(seed), np.arange(0.0, 40.0, 0.1)
    data = np.cumsum(random.normal(size=(len(time), len(NAMES))), axis=0) + 3.0
    kinds = every_kind()
    channels = [replace(kinds[n if n in kinds else f"{n[:-1]}{{b}}"], name=n) if n in kinds else None for n in NAMES]
    named = [c or SimpleNamespace(name=n, names=(n,), unit="m", alias="") for c, n in zip(channels, NAMES, strict=True)]
    return Result(time=time, data=data, channels=tuple(named))  # type: ignore[arg-type]


# --------------------------------------------------------------------------------------------------- variables


def test_splines_are_one_at_their_knot_and_sum_to_one_and_lines_stay_lines() -> None:
    span = np.linspace(0.0, 1.0, 41)
    rows = spline_rows(span, 5)
    np.testing.assert_allclose(rows[:, ::10], np.eye(5), atol=1e-12)
    np.testing.assert_allclose(rows.sum(axis=0), 1.0, rtol=1e-12)
    np.testing.assert_allclose(np.linspace(2.0, 4.0, 5) @ rows, 2.0 + 2.0 * span, rtol=1e-12)
    np.testing.assert_allclose(spline_rows(span, 2)[1], span)


def of(path: str, state: dict[str, float] | None = None, **setting: Any) -> Variables:
    return variables_of({path: VariableSetting(**({"low": 0.5, "high": 2.0} | setting))}, TURBINE, state or {})


def test_a_factor_on_a_list_an_offset_at_knots_and_one_entry() -> None:
    chord = of("turbine.blade.aerodynamics.chord")
    np.testing.assert_allclose(chord.apply([1.1]).blade.aerodynamics.chord, 1.1 * TURBINE.blade.aerodynamics.chord)
    twist = of("turbine.blade.aerodynamics.twist", knots=3, add=True, low="-3 deg", high="3 deg")
    assert twist.names == [f"turbine.blade.aerodynamics.twist[{k}/3]" for k in (1, 2, 3)]
    change = twist.apply([0.0, 0.0, 0.02]).blade.aerodynamics.twist - TURBINE.blade.aerodynamics.twist
    assert change[0] == pytest.approx(0.0, abs=1e-15) and change[-1] == pytest.approx(0.02)
    assert twist.low[0] == pytest.approx(-np.radians(3.0))
    entry = of("turbine.tower.mass", entry=2).apply([1.5]).tower.mass / TURBINE.tower.mass
    np.testing.assert_allclose(entry, [1.0, 1.5] + [1.0] * (len(entry) - 2))


def test_factors_of_one_list_multiply_nothing_twice() -> None:
    settings = {"turbine.tower.mass": VariableSetting(low=0.5, high=2.0, knots=4)}
    both = variables_of(settings, TURBINE, {}).apply([1.2] * 4)
    np.testing.assert_allclose(both.tower.mass, 1.2 * TURBINE.tower.mass)


def test_all_airfoils_by_a_star_and_numbers_relative_or_not() -> None:
    drag = of("turbine.airfoils.*.drag").apply([1.3]).airfoils
    for name, airfoil in drag.items():
        np.testing.assert_allclose(airfoil.drag, 1.3 * TURBINE.airfoils[name].drag)
    gain = TURBINE.control.pitch.proportional_gain
    relative = of("turbine.control.pitch.proportional_gain", relative=True)
    assert relative.start == [1.0] and relative.apply([2.0]).control.pitch.proportional_gain == 2.0 * gain
    absolute = of("turbine.hub.mass", low=1e4, high=1e5)
    assert absolute.start == [TURBINE.hub.mass] and absolute.apply([2e4]).hub.mass == 2e4


def test_parameters_of_the_baseline_controller_are_those_of_the_turbine() -> None:
    from meltemi.control.baseline import BaselineState

    state = dict.fromkeys(BaselineState.names, 1.0)
    for name, path in (("proportional_gain", "pitch.proportional_gain"), ("rated_speed", "torque.rated_speed"),
                       ("minimum_pitch", "pitch.minimum"), ("filter_frequency", "filter_frequency")):  # fmt: skip
        (variable,) = of(f"controller.{name}", state, low=-9.0, high=1e9).each
        assert variable.path == f"control.{path}"
    (own,) = of("controller.gain", {"gain": 1.2}, relative=True).each
    assert Variables(TURBINE, (own,)).entries([1.5]) == {"controller.gain": pytest.approx(1.8)}


def test_one_factor_on_the_same_number_of_several_records() -> None:
    spar = load_turbine("nrel5mw-spar")
    lines = variables_of({"turbine.platform.lines.*.length": VariableSetting(low=0.9, high=1.1)}, spar, {})
    longer = lines.apply([1.01]).platform.lines
    assert [each.length for each in longer] == [pytest.approx(1.01 * each.length) for each in spar.platform.lines]
    second = variables_of({"turbine.platform.lines.2.length": VariableSetting(low=800, high=999)}, spar, {})
    assert [each.length for each in second.apply([900.0]).platform.lines] == [902.2, 900.0, 902.2]


@pytest.mark.parametrize(
    ("path", "setting", "words"),
    [
        ("turbine.blade.aero.chord", {}, "leads nowhere at 'aero': did you mean 'aerodynamics'"),
        ("turbine.blade.aerodynamics", {}, "neither a number nor a list of numbers"),
        ("turbine.blade.aerodynamics.airfoil", {}, "neither a number nor a list of numbers"),
        ("turbine.hub.mass", {"knots": 3}, "is a number: knots, entry and add are for lists"),
        ("turbine.hub.mass", {}, "begins at 56780, outside low 0.5 to high 2"),
        ("turbine.tower.mass", {"entry": 99}, "entry 99 is asked for"),
        ("controller.nothing", {}, "the controller has no 'controller.nothing'"),
        ("hub.mass", {}, "no controller.NAME, turbine.PATH or layup.LAYER"),
    ],
)
def test_variables_that_lead_nowhere(path: str, setting: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        of(path, {"gain": 1.0}, **setting)


def test_a_design_that_is_no_turbine_is_one_sentence() -> None:
    with pytest.raises(InputError, match="the design is no valid turbine: "):
        of("turbine.tower.mass", low=-1.0, high=2.0).apply([-0.5])


# ------------------------------------------------------------------------------------------------------- terms


def test_the_soft_maximum_lies_between_the_maximum_and_its_bound() -> None:
    y = np.random.default_rng(2).normal(size=1000)
    soft, by = soft_maximum(y, 50.0, 3.0)
    assert y.max() < soft < y.max() + 3.0 / 50.0 * np.log(1000)  # (D-6)
    assert by.sum() == pytest.approx(1.0)
    way = np.random.default_rng(3).normal(size=1000)
    difference = (soft_maximum(y + 1e-6 * way, 50.0, 3.0)[0] - soft_maximum(y - 1e-6 * way, 50.0, 3.0)[0]) / 2e-6
    assert by @ way == pytest.approx(difference, rel=1e-6)


@pytest.mark.parametrize("name", ["del tower_base_moment_fore_aft", "std pitch_1", "mean pitch_1", "rate pitch_1",
                                  "travel pitch_1", "max pitch_1", "min pitch_1", "clearance"])  # fmt: skip
def test_derivatives_of_statistics_by_samples(name: str) -> None:
    term, result = term_of(name, 1.0), series()
    value, weights = statistic(term, result, 5.0, 7.0)
    assert all(np.all(w[:50] == 0.0) for w in weights.values())
    random = np.random.default_rng(4)
    way = random.normal(size=result.data.shape)
    expected = sum(w @ way[:, result.names.index(channel)] for channel, w in weights.items())
    low, high = (statistic(term, replace(result, data=result.data + h * way), 5.0, 7.0)[0] for h in (-1e-7, 1e-7))
    assert expected == pytest.approx((high - low) / 2e-7, rel=2e-5)
    if term.kind == "clearance":
        least = min(result[c][50:].min() for c in NAMES[2:])
        assert least - 7.0 / 200.0 * np.log(700) < value < least


def test_equivalent_loads_of_runs_add_their_damage() -> None:
    term = term_of("del tower_base_moment_fore_aft", 1.0)
    loads = np.array([damage_equivalent_load(series(s)[NAMES[0]], duration=39.9, slope=4.0) for s in (1, 2, 3)])
    shares = np.array([0.5, 0.3, 0.2])
    total, by = combined(term, 4.0, loads, shares, 1.0)
    assert total == pytest.approx((shares @ loads**4) ** 0.25)
    for i in range(3):
        moved = loads.copy()
        moved[i] += 1e-5
        assert by[i] == pytest.approx((combined(term, 4.0, moved, shares, 1.0)[0] - total) / 1e-5, rel=1e-4)
    assert combined(term_of("mean pitch_1", 1.0), 4.0, loads, shares, 1.0)[0] == pytest.approx(shares @ loads)
    assert combined(term_of("max pitch_1", 1.0), 4.0, loads, shares, 1e-3)[0] == pytest.approx(loads.max(), rel=1e-3)


@pytest.mark.parametrize(("name", "words"), [("dell x", "did you mean 'del'"), ("del", "expected a name after del")])
def test_terms_that_mean_nothing(name: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        term_of(name, 1.0)


# -------------------------------------------------------------------------------------------- extrapolated tables


def test_extrapolation_is_exact_for_polynomials_and_sees_kinks() -> None:
    found, error = extrapolated(lambda h: {"a": np.array([(1.0 + h) ** 7, np.exp(h)]), "b": np.ones(2)}, 0.03)
    assert found.keys() == {"a"} and error < 1e-12
    np.testing.assert_allclose(found["a"], [7.0, 1.0], rtol=1e-12)
    _, kink = extrapolated(lambda h: {"a": np.array([1.0 + max(h - 0.001, 0.0)])}, 0.03)
    assert kink > ENOUGH
    found, error = extrapolated(lambda h: {"a": np.array([np.exp(h) + 5.0 * max(h - 0.01, 0.0)])}, 0.03)
    assert error < 1e-10 and found["a"][0] == pytest.approx(1.0, rel=1e-10)  # steps between kinks


# --------------------------------------------------------------------------------------- the problem and its search


@dataclass
class Toy:
    """Statistics a = 1 + (x - 2)^2 + (y - 1)^2 and b = x + y in place of runs; beyond ``wall`` nothing can be built."""

    wall: float = np.inf
    calls: int = 0
    seconds: float = 0.0

    def __post_init__(self) -> None:
        self.of_runs = [term_of("mean a", 1.0), term_of("mean b", 1.0)]
        self.of_turbine: list[Any] = []
        self.cases = [None]

    def statistics(self, x: Any) -> Statistics:
        self.calls += 1
        if x[0] > self.wall:
            raise TrialError("the tower does not stand")
        return Statistics(np.array([[1.0 + (x[0] - 2.0) ** 2 + (x[1] - 1.0) ** 2, x[0] + x[1]]]), {})

    def totals(self, found: Statistics) -> tuple[Any, list[Any]]:
        return found.of_runs[0], [np.ones(1)] * 2

    def derivatives(self, x: Any, outputs: Any, found: Statistics) -> Any:
        self.calls += 1
        return outputs @ np.array([[2.0 * (x[0] - 2.0), 2.0 * (x[1] - 1.0)], [1.0, 1.0]])


def problem_of(toy: Toy, history: History | None = None, **limits: Any) -> Problem:
    each = tuple(Variable(n, n, -4.0, 4.0, 0.5, 2.0) for n in ("x", "y"))
    limits = {"most": 1.0} | limits
    setting = validated(limits, ConstraintSetting, "limits")
    constraints = [replace(toy.of_runs[1], setting=setting)]
    toy.of_runs[1] = constraints[0]
    constraints = constraints if limits["most"] != 9.0 else []  # which is never active
    problem = Problem(
        Variables(TURBINE, each), toy, toy.derivatives, toy.of_runs[:1], constraints, history or History(None, "")
    )  # type: ignore[arg-type]
    problem.begin()
    return problem


def find(problem: Problem, method: str = "slsqp") -> Any:
    steps: list[Any] = []
    search(problem, method=method, iterations=200, tolerance=1e-9, step=steps.append)
    assert steps
    return problem.best()


@pytest.mark.parametrize("method", ["slsqp", "trust-constr"])
def test_the_optimum_on_a_limit_and_its_multiplier(method: str) -> None:
    """Least a on x + y <= 2 from (0.5, 0.5), where x + y is 1: at (1.5, 0.5), by symmetry about the line."""
    problem = problem_of(Toy(), most=2.0)
    best = find(problem, method)
    np.testing.assert_allclose(best.x, [1.5, 0.5], atol=2e-3)
    found, rest = multipliers(problem, best.x, 1.0, margin=1e-2)
    # a falls by 2 (2 - x) = 1 per unit of x + y, over a = 3.5 at the start; the unit of the limit is x + y = 1 there
    assert found == {"mean b at most 2 of the start": pytest.approx(1.0 / 3.5, rel=5e-3)}
    assert rest < 1e-2


@pytest.mark.parametrize("method", ["slsqp", "l-bfgs-b"])
def test_the_optimum_without_an_active_limit(method: str) -> None:
    problem = problem_of(Toy(), most=9.0)
    np.testing.assert_allclose(find(problem, method).x, [2.0, 1.0], atol=1e-3)


@pytest.mark.parametrize("method", ["slsqp", "l-bfgs-b"])
def test_the_first_step_has_the_length_of_a_scale(method: str) -> None:
    problem = problem_of(Toy(), most=9.0)
    find(problem, method)
    first, second = (problem.scaled(trial.x) for trial in problem.trials[:2])
    assert np.linalg.norm(second - first) == pytest.approx(1.0)


def test_trials_that_fail_turn_the_search_back() -> None:
    toy = Toy(wall=1.2)
    problem = problem_of(toy, most=9.0)
    best = find(problem)
    assert any(t.failed == "the tower does not stand" for t in problem.trials)
    assert not best.failed and best.x[0] <= 1.2 and best.objective < 1.0


def test_iterations_are_trials_that_the_search_accepts() -> None:
    """The callback of SLSQP is called with the first trial of a line search, here often one that fails."""
    problem, steps = problem_of(Toy(wall=1.2), most=9.0), list[Any]()
    search(problem, method="slsqp", iterations=200, tolerance=1e-9, step=steps.append)
    accepted = [problem.trial(x) for x in steps]
    assert len(accepted) > 1 and not any(t.failed for t in accepted)
    assert [t.objective for t in accepted] == sorted((t.objective for t in accepted), reverse=True)
    np.testing.assert_array_equal(steps[-1], problem.best().x)


def test_a_search_without_a_feasible_trial_ends_close_to_one() -> None:
    best = find(problem_of(Toy(), most=None, least=20.0))
    np.testing.assert_allclose(best.x, [4.0, 4.0], atol=1e-6)
    assert best.violation == pytest.approx(12.0)


def test_a_resumed_search_repeats_its_trials_and_computes_nothing_twice(tmp_path: Path) -> None:
    file = tmp_path / "history.jsonl"
    first = find(problem_of(Toy(), History(file, "design"), most=2.0))
    lines = file.read_text().splitlines()
    file.write_text("\n".join(lines[:-3]) + '\n{"key": "cut o')  # as if the process had been killed
    toy = Toy()
    again = find(problem_of(toy, History(file, "design", resume=True), most=2.0))
    assert np.array_equal(again.x, first.x) and toy.calls == 3
    assert [json.loads(line) for line in file.read_text().splitlines()] == [json.loads(line) for line in lines]


def test_histories_of_other_designs_and_missing_ones(tmp_path: Path) -> None:
    file = tmp_path / "history.jsonl"
    with pytest.raises(InputError, match="there is no search to resume"):
        History(file, "design", resume=True)
    History(file, "design").get("values 1", lambda: {"x": [1.0], "runs": [[2.0]]})
    with pytest.raises(InputError, match="a search has been here: add --resume"):
        History(file, "design")
    with pytest.raises(InputError, match="the history is of another design"):
        History(file, "other", resume=True)


def test_a_start_that_failed_does_not_keep_its_folder(tmp_path: Path) -> None:
    file = tmp_path / "history.jsonl"
    History(file, "design").get("values 1", lambda: {"x": [1.0], "failed": "does not stand"})
    assert History(file, "mended").known == {}


def test_a_term_that_is_zero_at_the_start() -> None:
    toy = Toy()
    toy.statistics = lambda x: Statistics(np.zeros((1, 2)), {})  # type: ignore[method-assign]
    with pytest.raises(InputError, match="'mean a' is zero at the start"):
        problem_of(toy)


# ------------------------------------------------------------------------------------------------------ settings


def design(**changes: Any) -> Design:
    return validated(FILE | changes, Design, "design.yaml")


def test_cases_share_their_weight_between_seeds_and_take_keys_of_the_common_case() -> None:
    given = design(case={"duration": 50.0, "wind": {"intensity": 0.1}})
    cases = cases_of(given, Path())
    assert [c.share for c in cases] == pytest.approx([0.375, 0.375, 0.25])
    assert [c.seed for c in cases] == [1, 2, 1] and [c.group for c in cases] == [0, 0, 1]
    assert cases[0].case.wind.speed == 16.0 and cases[2].case.wind.seed == 1 and cases[0].case.duration == 50.0


def test_winds_without_turbulence_have_no_seed() -> None:
    iec = {"kind": "iec", "wind_class": "IB"}
    winds = [iec | {"model": "ETM"}, iec | {"model": "ECD"}, {"kind": "steady"}]
    cases = cases_of(design(cases=[{"speed": 12.0, "seeds": [7], "wind": wind} for wind in winds]), Path())
    assert [getattr(c.case.wind, "seed", None) for c in cases] == [7, None, None]


def test_a_gust_runs_once_in_all_sets_of_seeds_and_is_no_secret_of_the_proof() -> None:
    gust = {"speed": 12.0, "seeds": [1, 2], "wind": {"kind": "iec", "wind_class": "IB", "model": "ECD"}}
    random = {"speed": 16.0, "seeds": [1, 2], "weight": 3.0, "wind": {"intensity": 0.1}}
    given = design(cases=[random, gust], proof={"seeds": [5, 6]})
    cases = cases_of(given, Path())
    assert [c.share for c in cases] == pytest.approx([0.375, 0.375, 0.25])
    unseen = _Study._unseen(SimpleNamespace(design=given, cases=cases, folder=Path()))  # type: ignore[arg-type]
    assert [c.seed for c in unseen] == [5, 6, 5]
    runs = SimpleNamespace(of_runs=[term_of("mean pitch_1", 1.0)], slopes=[1.0], units=[1.0])
    found = _of_seeds(runs, np.array([[1.0], [2.0], [10.0]]), 0, unseen, _places(unseen))  # type: ignore[arg-type]
    weights = np.array([0.375, 0.25]) / 0.625
    np.testing.assert_allclose(found, [weights @ [1.0, 10.0], weights @ [2.0, 10.0]])


@pytest.mark.slow
def test_ultimate_cases_of_a_load_base_have_no_share_of_the_lifetime(tmp_path: Path) -> None:
    campaign = meltemi.loads.make_campaign("nrel5mw", "IB", quick=True, rated_wind=11.4)
    write_record(campaign, tmp_path / "campaign.yaml")

    def shares(*dlc: str) -> dict[str, float]:
        cases = cases_of(design(cases=[], base={"file": "campaign.yaml", "dlc": dlc}), tmp_path)
        return {c.name: c.share for c in cases}

    both = shares("1.2", "1.3")
    assert sum(both.values()) == pytest.approx(1.0)
    assert all((share > 0.0) == name.startswith("dlc1.2") for name, share in both.items())
    assert list(shares("1.3").values()) == pytest.approx([1.0 / 9.0] * 9)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"cases": []}, "give either cases or base"),
        ({"variables": {"turbine.hub.mass": {"low": 2.0, "high": 1.0}}}, "no value lies between the bounds"),
        ({"variables": {"turbine.hub.mass": {"low": "a", "high": 1.0}}}, "must be numbers, or angles"),
        ({"variables": {"turbine.hub.mass": {"low": 0, "high": 1, "start": 2}}}, "start 2 lies outside"),
        ({"constraints": {"energy": {}}}, "a constraint needs one of"),
        ({"constraints": {"energy": {"least": 2.0, "most": 1.0}}}, "contradict each other"),
        ({"constraints": {"energy": {"least": 1.0}}, "method": "l-bfgs-b"}, "takes bounds only"),
        ({"cases": [{"seeds": [1, 1]}]}, "each once"),
        ({"iteration": 3}, "did you mean 'iterations'"),
    ],
)
def test_designs_that_contradict_themselves(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        design(**changes)


def test_a_case_that_is_none_names_its_place() -> None:
    with pytest.raises(InputError, match="cases 1"):
        cases_of(design(case={"duration": -1.0}), Path())


def test_the_written_controller_has_the_designed_entries() -> None:
    from meltemi.control.controller import StartPoint
    from meltemi.controllers.specification import BaselineCase

    cases = [SimpleNamespace(case=SimpleNamespace(controller=BaselineCase()))]
    result = SimpleNamespace(
        problem=SimpleNamespace(evaluator=SimpleNamespace(cases=cases)), entries={"controller.smoothing": 0.25}
    )
    module: dict[str, Any] = {}
    exec(controller_text(result), module)  # type: ignore[arg-type]
    made = module["controller"](TURBINE)
    state = made.initial_state(StartPoint(wind_speed=12.0, generator_speed=120.0, pitch=0.1, generator_torque=4e4))
    assert state[made.state_names.index("smoothing")] == 0.25
    assert state[made.state_names.index("proportional_gain")] == TURBINE.control.pitch.proportional_gain


def test_ipopt_is_asked_for_where_it_is_missing() -> None:
    if find_spec("cyipopt"):
        pytest.skip("cyipopt is installed")
    with pytest.raises(InputError, match="cyipopt"):
        find(problem_of(Toy(), most=2.0), "ipopt")


def test_ipopt_finds_the_same_optimum() -> None:
    pytest.importorskip("cyipopt", reason="needs cyipopt: pip install cyipopt")
    problem = problem_of(Toy(), most=2.0)
    ended = search(problem, method="ipopt", iterations=200, tolerance=1e-9, step=lambda y: None)
    np.testing.assert_allclose(problem.best().x, [1.5, 0.5], atol=1e-3)
    assert ended.startswith("Algorithm terminated successfully")
