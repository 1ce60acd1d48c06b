"""Which values of a module have adjoints, which calls matter, and what is computed again."""

from __future__ import annotations

from collections.abc import Container, Mapping
from typing import Any

from meltemi.gradients.reverse.addresses import CONSTANTS, UNKNOWN, Addresses, Root
from meltemi.gradients.reverse.code import NOTHING, Function, Instruction, Operand, is_float, size_of
from meltemi.gradients.reverse.loops import loops_of
from meltemi.gradients.reverse.rules import FLAT, Emitter
from meltemi.gradients.reverse.simplify import simplified, users_of
from meltemi.gradients.reverse.tape import HEAD, VECTOR

ARITHMETIC = ("fadd", "fsub", "fmul", "fdiv", "fneg")
AGAIN = frozenset(
    "getelementptr add sub mul shl lshr ashr and or xor zext sext trunc icmp inttoptr ptrtoint freeze".split()
)
"""Operations on integers and addresses that are repeated rather than recorded."""
CHEAP = ("fadd", "fsub", "fmul", "fneg", "select", "fcmp", "shufflevector", "insertelement", "extractelement")
"""Operations on numbers that are repeated where all their arguments are known."""
SINGULAR = ("log", "pow", "exp", "expm1", "tan", "sqrt")
"""Functions that may be infinite, or have an infinite derivative; so may quotients."""
PASSING = ("fadd", "fsub", "fmul", "fneg", "insertelement", "extractelement", "shufflevector")
"""Operations whose result is infinite if an argument is."""


class Module:
    """The functions that one calls, and where they store numbers.

    Args:
      functions: all of the code, by name.
      top: name of the function that calls the others.
      records, arrays, wanted: see ``transformed``.

    Attributes:
      order: names of the functions that are called, after those that they call.
      parts: analysis of each function.
      used: [bytes] memory that the functions use, before the arrays.
      emitter: emitter of the instructions of all functions.
      plain: code of the functions that record nothing, by name.
    """

    def __init__(
        self,
        functions: Mapping[str, Function],
        top: str,
        records: Mapping[int, Any],
        arrays: Mapping[tuple[str, str], int | None],
        wanted: frozenset[str] | None,
    ) -> None:
        self.functions, self.arrays, self.wanted = functions, arrays, wanted
        self.used = HEAD
        self.emitter, self.plain = Emitter(), dict[str, str]()
        self.order: list[str] = []
        self.parts: dict[str, FunctionAnalysis] = {}
        self._visit(top)
        self.parts[top].addresses.records = dict(records)
        for name in reversed(self.order):
            self.parts[name].bind()
        stored = {root for part in self.parts.values() for root in part.stored()}
        self._stored = {arrays[root] for root in stored if isinstance(root, tuple)}
        self._unknown = UNKNOWN in stored

    def _visit(self, name: str) -> None:
        if name not in self.parts:
            part = self.parts[name] = FunctionAnalysis(self, self.functions[name], len(self.parts))
            for call in part.calls:
                self._visit(call.callee)
            self.order.append(name)

    def slot(self, kind: str) -> int:
        """Place of a variable of the stack in the memory."""
        size, align = size_of(kind)
        at = -(-self.used // max(align, 8)) * max(align, 8)
        self.used = at + size
        return at

    def fixed(self, root: Root) -> bool:
        """Whether the code never changes what is there."""
        if isinstance(root, tuple):
            return not self._unknown and self.arrays[root] not in self._stored
        return root == CONSTANTS

    def inert(self, root: Root) -> bool:
        """Whether numbers there have no derivatives."""
        if isinstance(root, tuple):
            passed_over = self.wanted is not None and root[1] not in self.wanted
            return self.arrays[root] is None or (passed_over and self.fixed(root))
        return root == CONSTANTS


class FunctionAnalysis:
    """One function of a module.

    Args:
      module: module of the function.
      function: records of its code.
      number: number of the function in the module.

    Attributes:
      results: instructions by the name of their result.
      users: instructions that use a value, by its name.
      homes: labels of the blocks of the instructions.
      calls: calls of functions of the module.
      slots: places in the memory of what is on the stack.
      floats: arguments with derivatives.
      result: type of the results of the adjoint: those of ``floats``.
      across: values whose adjoints pass from block to block.
      kept: places of the constants of loops, with their types.
      unit: [bytes] unit of its records on the tape.
    """

    def __init__(self, module: Module, function: Function, number: int) -> None:
        self.module, self.function = module, simplified(function)
        self.forward, self.backward, self.plain = f"@f{number}", f"@r{number}", f"@p{number}"
        self.kinds = {o.name: o.kind for o in function.arguments}
        self.sequence = [each for block in self.function.blocks.values() for each in block.instructions]
        self.results = {each.name: each for each in self.sequence if each.name}
        self.users = users_of(self.function)
        self.homes = {e: b.label for b in self.function.blocks.values() for e in (*b.instructions, b.end)}
        self.calls = [e for e in self.sequence if e.callee in module.functions and not NOTHING.match(e.callee)]
        self.addresses = Addresses(self.function, self.results)
        self.slots = {
            each.name: module.slot(each.kind)
            for each in self.results.values()
            if each.operation == "alloca" and each.kind != "ptr"
        }
        self.floats = [o for o in function.arguments if is_float(o.kind)]
        self.result = f"{{ {', '.join(o.kind for o in self.floats)} }}" if self.floats else "void"
        self.returns = [label for label, block in self.function.blocks.items() if block.end.code.startswith("ret")]
        self.silent: dict[Instruction, frozenset[str]] = {}
        self.across: set[str] = set()
        self.kept: dict[str, str] = {}
        self.unit = VECTOR

    def bind(self) -> None:
        """Tell the functions that are called which records and arrays they are given."""
        for call in self.calls:
            callee = self.module.parts[call.callee]
            for i, o in enumerate(call.operands):
                if o.kind != "ptr":
                    continue
                name = callee.function.arguments[i].name
                record, bound = self.addresses.record(o.name), callee.addresses.bound
                if record is not None:
                    callee.addresses.records[i] = record
                else:
                    bound[name] = bound.get(name, frozenset()) | self.addresses.roots(o.name)

    def stored(self) -> set[Root]:
        """Where numbers are stored."""
        return {root for e in self.sequence if _stores(e) for root in self.addresses.roots(e.place.name)}

    def analyse(self) -> None:
        """Determine the values with adjoints, and the calls that need none; those of functions that it calls are."""
        self.changes = self._changes()
        self.silent = {call: at for call in self.calls if (at := self._changed_by(call)) <= set(self.slots)}
        self.active = self._active()
        while mattering := [e for e, at in self.silent.items() if any(self._matters(name) for name in at)]:
            for each in mattering:
                del self.silent[each]
            self.active = self._active()
        self.doubtful: set[str] = set()
        for each in self.sequence:
            singular = each.operation == "fdiv" or (each.operation == "call" and each.function in SINGULAR)
            passes = each.operation in PASSING and any(o.name in self.doubtful for o in each.operands)
            if singular or passes:
                self.doubtful.add(each.name)
        self.touches = any(self._touches(each) for each in self.sequence)
        self.loops = loops_of(self.function.blocks) if self.touches else []

    # numbers in memory

    def inert(self, pointer: str) -> bool:
        """Whether the numbers at an address have no derivatives."""
        return all(self.module.inert(root) for root in self.addresses.roots(pointer))

    def fixed(self, pointer: str) -> bool:
        """Whether the numbers at an address never change."""
        return all(self.module.fixed(root) for root in self.addresses.roots(pointer))

    def _changes(self) -> frozenset[str]:
        """Arguments at whose addresses numbers are stored, here or in functions that are called; "" for elsewhere."""
        stored = (self.addresses.bases(each.place.name) for each in self.sequence if _stores(each))
        called = (self._changed_by(call) for call in self.calls)
        return frozenset(n for n in frozenset().union(*stored, *called) if n in self.kinds or not n)

    def _changed_by(self, call: Instruction) -> frozenset[str]:
        callee = self.module.parts[call.callee]
        names = [o.name for o in callee.function.arguments]
        bases = self.addresses.bases
        places = (bases(call.operands[names.index(name)].name) if name else {""} for name in callee.changes)
        return frozenset().union(*places)

    def _matters(self, place: str) -> bool:
        """Whether numbers at a place on the stack are read where an adjoint passes."""
        for each in self.users.get(place, []):
            if each.operation == "getelementptr":
                if self._matters(each.name):
                    return True
            elif each.operation == "load":
                if each.name in self.active:
                    return True
            elif each.operation == "call":
                writes = NOTHING.match(each.callee) or each.function.startswith("memset")
                if not writes and each not in self.silent:
                    return True
            elif each.operation != "store":
                return True
        return False

    def recorded(self, call: Instruction) -> bool:
        """Whether a call is of a function with an adjoint, and its results matter."""
        callee = self.module.parts.get(call.callee)
        return callee is not None and callee.touches and call not in self.silent

    def _touches(self, each: Instruction) -> bool:
        return not self.inert(each.place.name) if _stores(each) else self.recorded(each)

    # values

    def _active(self) -> set[str]:
        """The values that depend on numbers with derivatives, and on which something depends."""
        active: set[str] = {o.name for o in self.floats}
        before = -1
        while before != len(active):
            before = len(active)
            for each in self.sequence:
                if each.name and is_float(each.kind) and self._depends(each, active):
                    active.add(each.name)
        wanted = {o.name for each in self.sequence for o in self._operands_stored(each)}
        before = -1
        while before != len(wanted):
            before = len(wanted)
            for each in reversed(self.sequence):
                if each.name in wanted and each.name in active:
                    wanted |= {each.operands[i].name for i in inputs(each)}
        return active & wanted

    def _depends(self, each: Instruction, active: Container[str]) -> bool:
        if each.operation == "load":
            return not self.inert(each.operands[0].name)
        if each.operation == "call" and each.function in ("masked.load", "masked.gather"):
            return not self.inert(each.operands[0].name) or each.operands[2].name in active
        return any(each.operands[i].name in active for i in inputs(each))

    def _operands_stored(self, each: Instruction) -> list[Operand]:
        """Values that reach the memory, or a function with an adjoint."""
        if each.operation == "store" or each.function in ("masked.store", "masked.scatter"):
            return [] if self.inert(each.operands[1].name) else [each.operands[0]]
        return [o for o in each.operands if is_float(o.kind)] if self.recorded(each) else []

    def loop_without(self, label: str, name: str) -> int | None:
        """Number of the largest loop with a block, in which a value is a constant."""
        each = self.results.get(name)
        home = self.homes[each] if each else None
        return next((k for k, (body, _) in enumerate(self.loops) if label in body and home not in body), None)

    def again(self, saved: Container[str]) -> frozenset[str]:
        """Values that follow from those that are saved, by operations that are cheaper than the memory."""
        known: dict[str, bool] = {}
        again = set()

        def is_known(name: str) -> bool:
            if name not in known:
                each = self.results.get(name)
                known[name] = name in saved or (each is None and not is_float(self.kinds[name]))
                if each is not None and follows(each):
                    again.add(name)
                    known[name] = True
            return known[name]

        def follows(each: Instruction) -> bool:
            if each.operation == "load":
                return each.invariant or (is_float(each.kind) and self.fixed(each.operands[0].name))
            if each.operation not in CHEAP and each.operation not in AGAIN:
                return each.operation == "alloca"
            return all(is_known(name) for name in each.uses)

        for name in self.results:
            is_known(name)
        return frozenset(again)


def _stores(each: Instruction) -> bool:
    """Whether an instruction itself stores numbers."""
    if each.operation == "store":
        return is_float(each.kind)
    if each.function in ("masked.store", "masked.scatter"):
        return is_float(each.operands[0].kind)
    return each.function.startswith(("memset", "memcpy", "memmove"))


def inputs(each: Instruction) -> list[int]:
    """Numbers of the operands by which the result has derivatives."""
    everything = list(range(len(each.operands)))
    if each.operation == "call":
        if each.function in FLAT:
            return []
        some = {"masked.load": [2], "masked.gather": [2], "copysign": [0]}
        return some.get(each.function, everything)
    if each.operation in ARITHMETIC or each.operation == "phi":
        return everything
    some = {"select": [1, 2], "insertelement": [0, 1], "shufflevector": [0, 1], "extractelement": [0], "freeze": [0]}
    return some.get(each.operation, [])
