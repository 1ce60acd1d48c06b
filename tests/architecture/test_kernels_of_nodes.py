"""What a kernel must keep to so that it works in every kind of number (docs/number-types.md)."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

import meltemi
from meltemi import Model, Stations, SteadyWind
from meltemi.compiler import N_DERIVATIVES, members
from meltemi.simulation.case import Case
from meltemi.simulation.system import Control, March, Outputs, System
from meltemi.turbine.library import load_turbine

SOURCES = Path(meltemi.__file__).parent
VARIANTS = [path for path in sorted((SOURCES / "aero").glob("*/*.py")) if "@kernel" in path.read_text(encoding="utf-8")]
"""Models of stall, inflow and tower influence."""
MODULES: dict[str, tuple[str, ...]] = {
    "aero/rotor.py": (),
    "aero/bem.py": (),
    **{f"aero/{path.parent.name}/{path.name}": () for path in VARIANTS},
    "aero/lag.py": (),
    "aero/polars.py": (),
    "wind/velocity.py": (),
    "floating/segments.py": (),
    "vortex/near_wake.py": ("over_ages", "trail_velocity", "far_wake", "thrust_weight"),
    "structure/blades.py": ("node_motion", "collect_node"),
    "structure/equations.py": ("inertia_about",),
}
"""Files compiled for nodes, and the functions in them that are; none named means all."""

RECORDS = (System, Outputs, Control, March)
SAME_FOR_ALL = {"t", "dt"}
"""Arguments that are one number for all nodes, besides whole numbers."""
ARRAYS_WITHOUT_NODES = {"options", "aero", "wind", "now", "times", "series", "frame", "machine", "rotor", "structure"}
"""Arrays in which nothing belongs to a single node."""
TABLES_WITHOUT_NODES = ARRAYS_WITHOUT_NODES | {"aero_options", "pitch", "drive"}
"""Tables of a record, or names for them, in which nothing belongs to a single node."""
LENGTHS = {"blades", "nodes", "modes", "coordinates"}
ADVICE = (
    "{place}: `{code}` decides for one node, but may see eight. Write where(condition, a, b) for `a if condition else "
    "b`, & and | for `and` and `or`, and `if anywhere(condition):` to skip work that no node needs. If it is the same "
    "for all nodes, take it from an array without nodes ({arrays}) or a whole number. See docs/number-types.md."
)


def decision(e: ast.AST) -> ast.expr | None:
    """What an expression decides by, or an expression that only plain numbers have."""
    if isinstance(e, ast.IfExp):
        return e.test
    choice = isinstance(e, ast.BoolOp) or (isinstance(e, ast.UnaryOp) and isinstance(e.op, ast.Not))
    plain = isinstance(e, ast.Call) and isinstance(e.func, ast.Name) and e.func.id in ("int", "float", "bool", "round")
    power = isinstance(e, ast.BinOp) and isinstance(e.op, ast.Pow)
    return e if isinstance(e, ast.expr) and (choice or plain or power) else None


class Reader:
    """Follows one function line by line and notes which names are the same for all nodes."""

    def __init__(self, function: ast.FunctionDef) -> None:
        self.function = function
        arguments = function.args.args
        whole = {a.arg for a in arguments if isinstance(a.annotation, ast.Name) and a.annotation.id == "int"}
        self.known = whole | (SAME_FOR_ALL & {a.arg for a in arguments})
        self.found: list[ast.expr] = []
        self.read(function.body)

    def same(self, e: ast.expr) -> bool:
        """The expression has one value for all nodes."""
        if isinstance(e, ast.Constant):
            return True
        if isinstance(e, ast.Name):
            return e.id in self.known or e.id.isupper()
        if isinstance(e, ast.Attribute):
            return e.attr == "shape" or e.attr.isupper() or e.attr in LENGTHS or self.without_nodes(e.value)
        if isinstance(e, ast.Subscript):
            of = e.value
            plain = isinstance(of, ast.Name) and of.id in ARRAYS_WITHOUT_NODES
            field = isinstance(of, ast.Attribute) and (of.attr == "shape" or self.without_nodes(of.value))
            return (plain or field) and self.same(e.slice)
        if isinstance(e, ast.Call):
            if isinstance(e.func, ast.Name) and e.func.id in ("anywhere", "reverse"):
                return True
            return all(self.same(a) for a in e.args) and not e.keywords
        if isinstance(e, ast.BinOp | ast.Compare | ast.BoolOp | ast.UnaryOp | ast.IfExp | ast.Tuple):
            return all(self.same(c) for c in ast.iter_child_nodes(e) if isinstance(c, ast.expr))
        return False

    def without_nodes(self, e: ast.expr) -> bool:
        """The expression is a table without nodes: ``m.aero_options`` or a name for it."""
        name = e.attr if isinstance(e, ast.Attribute) else e.id if isinstance(e, ast.Name) else ""
        return name in TABLES_WITHOUT_NODES

    def check(self, node: ast.AST) -> None:
        """Note the expressions in which a choice is made by something that is not the same for all nodes."""
        for e in ast.walk(node):
            by = decision(e)
            if by is not None and not self.same(by):
                self.found.append(by)

    def assign(self, target: ast.expr, value: ast.expr | None) -> None:
        """Note whether a name is the same for all nodes from here on."""
        if isinstance(target, ast.Tuple):
            values = value.elts if isinstance(value, ast.Tuple) else [value] * len(target.elts)
            for one, of in zip(target.elts, values, strict=True):
                self.assign(one, of)
        elif isinstance(target, ast.Name):
            if value is not None and self.same(value):
                self.known.add(target.id)
            else:
                self.known.discard(target.id)

    def read(self, body: list[ast.stmt]) -> None:
        for s in body:
            if isinstance(s, ast.For):
                self.check(s.iter)
                self.assign(s.target, s.iter)
                self.read(s.body)
                self.read(s.body)  # with what the first time round has left
            elif isinstance(s, ast.If | ast.While):
                self.check(s.test)
                if not self.same(s.test):
                    self.found.append(s.test)
                self.read(s.body)
                self.read(s.orelse)
            else:
                self.check(s)
                if isinstance(s, ast.Assign):
                    for target in s.targets:
                        self.assign(target, s.value)
                elif isinstance(s, ast.AugAssign) and not self.same(s.value):
                    self.assign(s.target, None)


def kernels(path: str, text: str) -> list[ast.FunctionDef]:
    """Those of a file that are compiled for nodes."""
    wanted = MODULES.get(path, ())
    functions = [f for f in ast.parse(text).body if isinstance(f, ast.FunctionDef) and (not wanted or f.name in wanted)]
    return [f for f in functions if any(isinstance(d, ast.Name) and d.id == "kernel" for d in f.decorator_list)]


@pytest.mark.parametrize("path", MODULES)
def test_kernels_of_nodes_have_no_branches_on_values(path: str) -> None:
    functions = kernels(path, (SOURCES / path).read_text(encoding="utf-8"))
    assert functions and not set(MODULES[path]) - {f.name for f in functions}
    wrong = [
        ADVICE.format(
            place=f"{path}:{e.lineno}, {f.name}", code=ast.unparse(e), arrays=", ".join(sorted(ARRAYS_WITHOUT_NODES))
        )
        for f in functions
        for e in Reader(f).found
    ]
    assert not wrong, "\n".join(wrong)


BAD = [
    "return x if x > 0.0 else -x",
    "if x > 0.0:\n        x = -x\n    return x",
    "if options[0] == 1 and x > 0.0:\n        x = -x\n    return x",
    "return where((x > 0.0) and (x < 1.0), x, 0.0)",
    "return where(not x > 0.0, x, 0.0)",
    "y = 2.0 * x\n    while y > 1.0:\n        y -= 1.0\n    return y",
    "speed = flow[3, b, n]\n    if speed > 0.0:\n        return 1.0\n    return x",
    "here = options[0] == 1\n    here = x > 0.0\n    return 1.0 if here else 2.0",
    "s = 0.0\n    for k in range(3):\n        if s > 1.0:\n            return s\n        s += x\n    return s",
    "g = whole(x)\n    return section[g, 0] if section[g, 1] > 0.0 else 0.0",
    "if g := x > 0.0:\n        return x\n    return g",
    "return polars[int(x)]",
    "return 1.0 if m.flow.speed[b, n] > 0.0 else x",
    "flow = m.flow\n    if flow.lift[b, n] > 1.0:\n        x = 0.0 * x\n    return x",
    "return x**2",
]
GOOD = [
    "return where(x > 0.0, x, -x)",
    "if anywhere(x > 0.0):\n        x = where(x > 0.0, -x, x)\n    return x",
    "return 1.0 * x if options[WAKE] == 1 and b > 0 else x",
    "variable = options[2] == 1\n    return aero[0] * x if variable else x",
    "last = flow.shape[1] - 1\n    if b == last or n > 2:\n        return 2.0 * x\n    return x",
    "for k in range(3):\n        if k == b:\n            x += 1.0\n    return x",
    "influenced = cos(frame[8, b]) <= 0.0\n    if influenced:\n        x = 0.0 * x\n    return x",
    "lost = x > 0.0\n    return where(lost & (x < 2.0), x, 0.0)",
    "options = m.aero_options\n    return x if options.wake == 1 or m.aero.fade_end == 0.0 else 1.0 * x",
    "influenced = cos(m.frame.azimuth[b]) <= 0.0 and b < m.motion.blades\n    return 0.0 * x if influenced else x",
]


@pytest.mark.parametrize(("body", "allowed"), [*((b, False) for b in BAD), *((g, True) for g in GOOD)])
def test_the_rule_sees_what_it_is_for(body: str, allowed: bool) -> None:
    text = f"@kernel\ndef f(x: float, options: Int, flow: Float, b: int, n: int) -> float:\n    {body}\n"
    (function,) = kernels("", text)
    assert (not Reader(function).found) == allowed


@pytest.mark.slow
def test_every_array_of_a_derivative_run_has_derivatives() -> None:
    """Or is named as a constant; arrays that share memory share their derivatives."""
    model: Model = meltemi.build(load_turbine("nrel5mw"))
    case = Case(model, SteadyWind(speed=9.0), Stations((10.0,), (40.0,)), numbers="duals")
    # the controller's state gets its derivatives with the controller, the output with the run
    later = {"controller_state", "output", "clock", "events", "limits", "places"}
    arrays = {**case.arrays, "aero_state": case.aero_state.vector, "signals": case.signals.vector}
    found = {name: member.constant for record in RECORDS for name, member in members(record).items()}
    assert set(found) - later <= set(arrays)
    kept = {}
    for name in set(found) - later:
        slopes = case.slopes.get(name)
        if found[name]:
            assert slopes is None, f"{name} is Constant, and has derivatives"
        else:
            assert slopes is not None, f"{name} has no derivatives: give it some in Case.slopes, or mark it as Constant"
            assert slopes.shape == (*arrays[name].shape, N_DERIVATIVES), name
            kept[name] = slopes
    for one in kept:
        for two in kept:
            shared = np.shares_memory(arrays[one], arrays[two])
            assert np.shares_memory(kept[one], kept[two]) == shared, (one, two)


def test_constants_are_not_written_to() -> None:
    """Their derivatives would be lost: they do not change in an evaluation with floats."""
    model = meltemi.build(load_turbine("nrel5mw"))
    case = Case(model, SteadyWind(speed=9.0), Stations((10.0,), (40.0,)))
    constant = {name for record in (System, Outputs) for name, member in members(record).items() if member.constant}
    before = {name: case[name].copy() for name in constant}
    case["v"][:] = 0.1
    case.evaluate(1.0, 0.01)
    case.loads(1.0)
    for name, array in before.items():
        np.testing.assert_array_equal(case[name], array)
