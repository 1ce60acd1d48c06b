"""Where the addresses in a function lead."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from meltemi.compiler import members
from meltemi.gradients.reverse.code import Function, Instruction

Root = tuple[str, str] | str
"""Where an address leads: a member of a record, by class and name, or one of these."""
STACK, CONSTANTS, UNKNOWN = "stack", "constants", "unknown"


class Addresses:
    """Where the addresses of a function lead.

    Args:
      function: function with these addresses.
      results: the instructions of the function by the name of their result.

    Attributes:
      records: classes of the records among its arguments, by number of the argument.
      bound: roots of the other arguments.
    """

    def __init__(self, function: Function, results: Mapping[str, Instruction]) -> None:
        self.results = results
        self.arguments = {o.name: i for i, o in enumerate(function.arguments)}
        self.records: dict[int, Any] = {}
        self.bound: dict[str, frozenset[Root]] = {}
        self._roots: dict[str, frozenset[Root]] = {}

    def record(self, pointer: str) -> Any:
        """Class of the record at an address; None if there is none."""
        return self.records.get(self.arguments[pointer]) if pointer in self.arguments else None

    def roots(self, pointer: str) -> frozenset[Root]:
        """Where an address may lead: into a member of a record, by class and name, or elsewhere."""
        if pointer not in self._roots:
            self._roots[pointer] = frozenset()  # for a loop, in which it adds nothing
            self._roots[pointer] = self._origin(pointer)
        return self._roots[pointer]

    def _origin(self, pointer: str) -> frozenset[Root]:
        if pointer.startswith("@"):
            return frozenset([CONSTANTS])
        if pointer in self.arguments:
            return self.bound.get(pointer, frozenset([UNKNOWN]))
        each = self.results.get(pointer)
        if each is None:
            return frozenset() if pointer in ("poison", "undef", "null") else frozenset([UNKNOWN])
        if each.operation == "alloca":
            return frozenset([STACK])
        if each.operation in ("getelementptr", "freeze", "shufflevector"):
            return self.roots(each.operands[0].name)
        if each.operation in ("select", "phi", "insertelement"):
            those = each.operands[1:] if each.operation == "select" else each.operands
            return frozenset().union(*(self.roots(o.name) for o in those if "ptr" in o.kind))
        member = self._member(each) if each.operation == "inttoptr" else None
        return frozenset([member or UNKNOWN])

    def _member(self, each: Instruction) -> Root | None:
        """Class and name of the member of a record whose address was loaded from the record's words."""
        load = self.results.get(each.operands[0].name)
        if load is None or load.operation != "load" or not load.invariant:
            return None
        at, offset = load.operands[0].name, 0
        step = self.results.get(at)
        if step is not None and step.operation == "getelementptr":
            pointer, distance = (o.name for o in step.operands)
            if step.element != "i8" or not distance.isdigit():
                return None
            at, offset = pointer, int(distance)
        record, word = self.record(at), 0
        for name, member in members(record).items() if record is not None else ():
            if offset == 8 * word:
                return record.__name__, name
            word += 2 + member.ndim
        return None

    def bases(self, pointer: str) -> frozenset[str]:
        """Arguments and places on the stack into which an address leads; "" for anything else."""
        each = self.results.get(pointer)
        if pointer in self.arguments or (each is not None and each.operation == "alloca"):
            return frozenset([pointer])
        if each is not None and each.operation in ("getelementptr", "freeze"):
            return self.bases(each.operands[0].name)
        return frozenset([""])
