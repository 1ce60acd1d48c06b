"""Partial derivatives of the operations and functions of compiled code.

Each rule gives, for the adjoint of a result z = f(x, y), the terms that it adds to the adjoints of x and y (J-3). At
kinks the derivative is that of the branch that was taken.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

Value = Callable[[int], str]
"""Value of an argument by its number; that of the result for -1."""


def constant(kind: str, x: float) -> str:
    """A constant of type ``double`` or vector."""
    word = f"0x{struct.unpack('<Q', struct.pack('<d', x))[0]:016X}"
    return word if kind == "double" else f"splat (double {word})"


class Emitter:
    """Instructions that are generated, in order."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.declared: set[str] = set()
        self.count = 0

    def new(self, text: str) -> str:
        """Append an instruction with a result; returns its name."""
        self.count += 1
        self.lines.append(f"  %t{self.count} = {text}")
        return f"%t{self.count}"

    def do(self, text: str) -> None:
        """Append an instruction without a result."""
        self.lines.append(f"  {text}")

    def op(self, name: str, kind: str, x: str, y: str) -> str:
        """Arithmetic; products with a constant one or zero are not generated."""
        return self.new(f"{name} nsz arcp contract {kind} {x}, {y}")

    def neg(self, kind: str, x: str) -> str:
        """The negative of a value."""
        return self.new(f"fneg nsz arcp contract {kind} {x}")

    def guard(self, kind: str, a: str, term: str) -> str:
        """A term that is zero where the adjoint is, though its other factor may be infinite there."""
        nothing = constant(kind, 0.0)
        return self.choose(self.compare("oeq", kind, a, nothing), kind, nothing, term)

    def compare(self, sign: str, kind: str, x: str, y: str) -> tuple[str, str]:
        """Type and value of a comparison."""
        comparison = self.new(f"fcmp {sign} {kind} {x}, {y}")
        return ("i1" if kind == "double" else kind.replace("double", "i1")), comparison

    def choose(self, condition: tuple[str, str], kind: str, x: str, y: str) -> str:
        """``x`` where the condition is true, else ``y``."""
        return self.new(f"select {condition[0]} {condition[1]}, {kind} {x}, {kind} {y}")

    def call(self, name: str, kind: str, *x: str) -> str:
        """A function of LLVM or of the C library, of numbers of one type."""
        if name in LIBRARY:
            if kind != "double":
                vector = "poison"
                for i in range(int(kind[1:].split(" ")[0])):
                    parts = [self.new(f"extractelement {kind} {each}, i64 {i}") for each in x]
                    vector = self.new(
                        f"insertelement {kind} {vector}, double {self.call(name, 'double', *parts)}, i64 {i}"
                    )
                return vector
            full = f"@{name}"
        else:
            width = "" if kind == "double" else "v" + kind[1:].split(" ")[0]
            full = f"@llvm.{name}.{width}f64"
        self.declared.add(f"declare {kind} {full}({', '.join([kind] * len(x))})")
        return self.new(f"call {kind} {full}({', '.join(f'{kind} {each}' for each in x)})")


LIBRARY = ("sinh", "cosh", "hypot")


def _sqrt(e: Emitter, k: str, a: str, value: Value) -> dict[int, str]:
    z = value(-1)
    rate = e.op("fdiv", k, constant(k, 0.5), z)
    nothing = constant(k, 0.0)
    return {0: e.op("fmul", k, a, e.choose(e.compare("ogt", k, z, nothing), k, rate, nothing))}


def _fabs(e: Emitter, k: str, a: str, value: Value) -> dict[int, str]:
    return {0: e.choose(e.compare("olt", k, value(0), constant(k, 0.0)), k, e.neg(k, a), a)}


def _acos(sign: float) -> Any:
    def rule(e: Emitter, k: str, a: str, value: Value) -> dict[int, str]:
        x, one, nothing = value(0), constant(k, 1.0), constant(k, 0.0)
        rest = e.op("fsub", k, one, e.op("fmul", k, x, x))
        rate = e.op("fdiv", k, constant(k, sign), e.call("sqrt", k, rest))
        return {0: e.op("fmul", k, a, e.choose(e.compare("ogt", k, rest, nothing), k, rate, nothing))}

    return rule


def _by(rate: Any) -> Any:
    """Rule of a function of one argument by its derivative, a function of (emitter, type, value)."""
    return lambda e, k, a, value: {0: e.op("fmul", k, a, rate(e, k, value))}


def _atan2(e: Emitter, k: str, a: str, value: Value) -> dict[int, str]:
    y, x, nothing = value(0), value(1), constant(k, 0.0)
    square = e.op("fadd", k, e.op("fmul", k, x, x), e.op("fmul", k, y, y))
    over = e.choose(e.compare("ogt", k, square, nothing), k, e.op("fdiv", k, a, square), nothing)
    return {0: e.op("fmul", k, over, x), 1: e.neg(k, e.op("fmul", k, over, y))}


def _hypot(e: Emitter, k: str, a: str, value: Value) -> dict[int, str]:
    z, nothing = value(-1), constant(k, 0.0)
    over = e.choose(e.compare("ogt", k, z, nothing), k, e.op("fdiv", k, a, z), nothing)
    return {i: e.op("fmul", k, over, value(i)) for i in range(2)}


def _pow(e: Emitter, k: str, a: str, value: Value) -> dict[int, str]:
    x, y, nothing = value(0), value(1), constant(k, 0.0)
    by_x = e.op("fmul", k, y, e.call("pow", k, x, e.op("fsub", k, y, constant(k, 1.0))))
    growth = e.op("fmul", k, value(-1), e.call("log", k, x))
    by_y = e.choose(e.compare("ogt", k, x, nothing), k, growth, nothing)
    return {0: e.op("fmul", k, a, by_x), 1: e.op("fmul", k, a, by_y)}


def _fma(e: Emitter, k: str, a: str, value: Value) -> dict[int, str]:
    return {0: e.op("fmul", k, a, value(1)), 1: e.op("fmul", k, a, value(0)), 2: a}


def _most(sign: str) -> Any:
    def rule(e: Emitter, k: str, a: str, value: Value) -> dict[int, str]:
        beyond = e.compare(sign, k, value(1), value(0))
        return {0: e.choose(beyond, k, constant(k, 0.0), a), 1: e.choose(beyond, k, a, constant(k, 0.0))}

    return rule


def _one_plus(sign: str, square: int) -> Any:
    """1 +- value squared."""
    return lambda e, k, value: e.op(sign, k, constant(k, 1.0), e.op("fmul", k, value(square), value(square)))


FUNCTIONS: dict[str, Any] = {
    "sqrt": _sqrt,
    "fabs": _fabs,
    "sin": _by(lambda e, k, value: e.call("cos", k, value(0))),
    "cos": _by(lambda e, k, value: e.neg(k, e.call("sin", k, value(0)))),
    "tan": _by(_one_plus("fadd", -1)),
    "exp": _by(lambda e, k, value: value(-1)),
    "expm1": _by(lambda e, k, value: e.op("fadd", k, value(-1), constant(k, 1.0))),
    "log": _by(lambda e, k, value: e.op("fdiv", k, constant(k, 1.0), value(0))),
    "tanh": _by(_one_plus("fsub", -1)),
    "sinh": _by(lambda e, k, value: e.call("cosh", k, value(0))),
    "cosh": _by(lambda e, k, value: e.call("sinh", k, value(0))),
    "acos": _acos(-1.0),
    "asin": _acos(1.0),
    "atan": lambda e, k, a, value: {0: e.op("fdiv", k, a, _one_plus("fadd", 0)(e, k, value))},
    "atan2": _atan2,
    "hypot": _hypot,
    "pow": _pow,
    "fma": _fma,
    "fmuladd": _fma,
    "minnum": _most("olt"),
    "maxnum": _most("ogt"),
}
"""Derivatives by the arguments of functions: (emitter, type, adjoint of the result, values) -> terms by argument."""


FLAT = ("floor", "ceil", "trunc", "rint", "round", "nearbyint", "roundeven", "arithmetic.fence")
"""Functions whose derivative is zero; the last one is ``held`` of ``meltemi.compiler``."""


def terms(
    e: Emitter, operation: str, kind: str, a: str, active: list[bool], doubtful: list[bool], value: Value
) -> dict[int, str]:
    """Terms of the adjoints of the arguments of an arithmetic operation.

    Args:
      active: arguments whose adjoints are wanted.
      doubtful: arguments that may be infinite where the result is not used.
    """
    if operation == "fadd":
        return {0: a, 1: a}
    if operation == "fsub":
        return {0: a} | ({1: e.neg(kind, a)} if active[1] else {})
    if operation == "fneg":
        return {0: e.neg(kind, a)}
    if operation == "fmul":
        products = {i: e.op("fmul", kind, a, value(1 - i)) for i in range(2) if active[i]}
        return {i: e.guard(kind, a, term) if doubtful[1 - i] else term for i, term in products.items()}
    if operation == "fdiv":
        over = e.guard(kind, a, e.op("fdiv", kind, a, value(1)))
        if not active[1]:
            return {0: over}
        return {0: over, 1: e.guard(kind, a, e.neg(kind, e.op("fmul", kind, over, value(-1))))}
    raise NotImplementedError(operation)
