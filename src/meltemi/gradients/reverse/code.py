"""Records of the code of compiled kernels, and what types and calls mean.

``grammar`` reads LLVM's text into these records; only there and in ``printed`` is code a text.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

from meltemi.compiler import llvm_version
from meltemi.core.errors import MeltemiError

LOCAL = re.compile(r'%(?:"[^"]*"|[-\w.$]+)')
"""Name of a value or label of a function."""
NOTHING = re.compile(r"@(?:llvm\.(?:lifetime|assume|dbg|experimental\.noalias)|NRT_incref|NRT_decref)")
"""Functions that do nothing to numbers."""


class Operand(NamedTuple):
    """A value with its type."""

    kind: str
    name: str


@dataclass(frozen=True, eq=False)
class Instruction:
    """One instruction.

    Attributes:
      name: name of the result, ``%v7``; empty if there is none.
      operation: ``end`` for those that end a block.
      kind: type of the result; that of the stored value for ``store``.
      code: text after the name, without metadata.
      operands: values with their types.
      callee: callee of a call, ``@name``; empty if its address is computed.
      sources: predecessor of each operand of a ``phi``.
      element: type over which ``getelementptr`` steps.
      places: indices of the member of ``insertvalue``.
      align: [bytes] alignment of an access to memory; 0 for none.
      invariant: whether a load is of memory that never changes.
    """

    name: str
    operation: str
    kind: str
    code: str
    operands: tuple[Operand, ...] = ()
    callee: str = ""
    sources: tuple[str, ...] = ()
    element: str = ""
    places: tuple[int, ...] = ()
    align: int = 0
    invariant: bool = False

    @cached_property
    def uses(self) -> tuple[str, ...]:
        """Names of the values, and of the labels, in the code."""
        return tuple(LOCAL.findall(self.code))

    @property
    def text(self) -> str:
        """The whole instruction."""
        return f"{self.name} = {self.code}" if self.name else self.code

    @cached_property
    def function(self) -> str:
        """Name of the called function: of LLVM without its types, or of the C library; empty for other instructions."""
        if not self.callee.startswith("@llvm."):
            return self.callee[1:]
        return re.sub(r"(?:\.(?:v?\d*[fip]\d+))+$", "", self.callee[6:])

    @property
    def place(self) -> Operand:
        """Address at which an instruction stores numbers."""
        return self.operands[0 if self.function.startswith("mem") else 1]


def printed(code: str, value: Callable[[str], str]) -> str:
    """Code with other names for its values."""
    return LOCAL.sub(lambda match: value(match[0]), code)


@dataclass(frozen=True)
class BasicBlock:
    """Instructions without branches, and the blocks they may come from."""

    label: str
    phis: tuple[Instruction, ...]
    body: tuple[Instruction, ...]
    end: Instruction
    targets: tuple[str, ...]
    sources: list[str] = field(default_factory=list)

    @property
    def instructions(self) -> tuple[Instruction, ...]:
        """All but the last one."""
        return (*self.phis, *self.body)


@dataclass(frozen=True)
class Function:
    """A function, with values and labels renamed to ``%v1``, ``%v2`` and so on.

    Attributes:
      kernel: name of the kernel in Python, for messages.
    """

    name: str
    kernel: str
    kind: str
    arguments: tuple[Operand, ...]
    blocks: dict[str, BasicBlock]


def no_rule(text: str, kernel: str) -> MeltemiError:
    """The error for an instruction that the adjoint does not know."""
    return MeltemiError(
        f"gradient: the kernel {kernel!r}, compiled by LLVM {llvm_version()}, has an instruction without a rule for "
        f"its adjoint: {text[:120]!r}; write the kernel without it, or use sensitivity, which does not need the rule"
    )


def is_float(kind: str) -> bool:
    """Whether values of a type have derivatives."""
    return kind == "double" or kind.endswith("x double>")


def lanes_of(kind: str) -> int:
    """Entries of a vector type."""
    return int(kind[1:].split(" ", 1)[0])


def entry_of(kind: str) -> str:
    """Type of the entries of a vector or array type."""
    return kind[1:-1].partition(" x ")[2].strip()


def size_of(kind: str) -> tuple[int, int]:
    """Size and alignment of a type in memory [bytes]."""
    if kind in ("double", "ptr", "i64"):
        return 8, 8
    if kind in ("i32", "float"):
        return 4, 4
    if kind[0] == "i":
        n = 1 if int(kind[1:]) <= 8 else 2 if int(kind[1:]) <= 16 else 16
        return n, n
    if kind[0] == "<":
        bits = lanes_of(kind) * (1 if entry_of(kind) == "i1" else 8 * size_of(entry_of(kind))[0])
        size = 1 << max(-(-bits // 8) - 1, 0).bit_length()
        return size, size
    if kind[0] == "[":
        one, align = size_of(entry_of(kind))
        return lanes_of(kind) * one, align
    parts = members_of(kind)
    most = max((size_of(member)[1] for member, _ in parts), default=1)
    end = parts[-1][1] + size_of(parts[-1][0])[0] if parts else 0
    return -(-end // most) * most, most


def members_of(kind: str) -> list[tuple[str, int]]:
    """Type and offset of each member of an aggregate."""
    if kind[0] == "[":
        return [(entry_of(kind), i * size_of(entry_of(kind))[0]) for i in range(lanes_of(kind))]
    at, parts, depth, begin = 0, [], 0, 1
    for i, c in enumerate(kind):
        depth += (c in "[{<") - (c in "]}>")
        if (c == "," and depth == 1) or depth == 0:
            member = kind[begin:i].strip()
            begin = i + 1
            if member:
                one, align = size_of(member)
                at = -(-at // align) * align
                parts.append((member, at))
                at += one
    return parts
