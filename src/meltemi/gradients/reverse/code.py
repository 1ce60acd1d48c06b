"""LLVM code of compiled kernels, read into functions, blocks and instructions.

Only what Numba generates is understood; everything else is an error, never a wrong derivative.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import NamedTuple

from meltemi.core.errors import MeltemiError

LOCAL = re.compile(r'%(?:"[^"]*"|[-\w.$]+)')
GLOBAL = re.compile(r'@(?:"[^"]*"|[-\w.$]+)')
_LABEL = re.compile(r'^(?:"([^"]*)"|([-\w.$]+)):')
_FLAGS = re.compile(
    r"^(?:nuw|nsw|exact|disjoint|inbounds|nusw|nneg|samesign|fast|nnan|ninf|nsz|arcp|contract|afn|reassoc)\b ?"
)
_ATTRIBUTES = re.compile(
    r"^(?:noundef|nonnull|noalias|readonly|readnone|writeonly|nocapture|nofree|returned|signext|zeroext|immarg|"
    r"dead_on_unwind|writable|nocallback|range\([^)]*\)|align \d+|captures\([^)]*\)|"
    r"dereferenceable(?:_or_null)?\(\d+\)|initializes\(\([^)]*\)\)) ?"
)
_METADATA = re.compile(r",? !(?!invariant)[\w.]+ ![\w()]*")
_INVARIANT = re.compile(r"!invariant\.load !\d+")
WORDS = re.compile(r"^(?:i\d+|float|ptr|double|void|opaque)\b")


class Operand(NamedTuple):
    """A value with its type."""

    kind: str
    name: str


@dataclass
class Instruction:
    """One instruction.

    Attributes:
      name: of its result, ``%v7``; empty if there is none.
      kind: type of the result; that of the stored value for ``store``.
      operands: values that derivatives may concern; ``incoming`` of a ``phi`` by predecessor.
      text: the whole instruction, without metadata.
      callee: of a call, ``@name``.
    """

    name: str
    operation: str
    kind: str
    operands: list[Operand]
    text: str
    callee: str = ""
    incoming: dict[str, str] = field(default_factory=dict)
    rest: str = ""


@dataclass
class Block:
    """Instructions without branches, and the blocks they may come from."""

    label: str
    phis: list[Instruction]
    body: list[Instruction]
    end: str
    targets: list[str]
    sources: list[str] = field(default_factory=list)


@dataclass
class Function:
    """A function, with values and labels renamed to ``%v1``, ``%v2`` and so on."""

    name: str
    kind: str
    arguments: list[Operand]
    blocks: dict[str, Block]


def is_float(kind: str) -> bool:
    """Whether values of a type have derivatives."""
    return kind == "double" or kind.endswith("x double>")


def lanes_of(kind: str) -> int:
    """Entries of a vector type."""
    return int(kind[1:].split(" ", 1)[0])


def split_top(text: str) -> list[str]:
    """Parts between the commas that are in no bracket."""
    parts, depth, begin, quoted = [], 0, 0, False
    for i, c in enumerate(text):
        if c == '"':
            quoted = not quoted
        elif quoted:
            continue
        elif c in "([{<":
            depth += 1
        elif c in ")]}>":
            depth -= 1
        elif c == "," and depth == 0:
            parts.append(text[begin:i].strip())
            begin = i + 1
    last = text[begin:].strip()
    return [*parts, last] if last else parts


def take_type(text: str) -> tuple[str, str]:
    """The type at the beginning, and the rest."""
    text = text.strip()
    if text[0] in "<[{":
        depth = 0
        for i, c in enumerate(text):
            depth += c in "<[{"
            depth -= c in ">]}"
            if depth == 0:
                return text[: i + 1], text[i + 1 :].strip()
    found = WORDS.match(text)
    if found is None:
        raise MeltemiError(f"adjoint: unknown type in compiled code: {text[:80]}")
    return found[0], text[found.end() :].strip()


def typed(text: str) -> Operand:
    """A value that follows its type and attributes."""
    kind, rest = take_type(text)
    while found := _ATTRIBUTES.match(rest):
        rest = rest[found.end() :]
    return Operand(kind, rest.strip())


def size_of(kind: str) -> tuple[int, int]:
    """Size and alignment of a type in memory [bytes]."""
    if kind in ("double", "ptr", "i64"):
        return 8, 8
    if kind in ("i32", "float"):
        return 4, 4
    if re.fullmatch(r"i\d+", kind):
        n = 1 if int(kind[1:]) <= 8 else 2 if int(kind[1:]) <= 16 else 16
        return n, n
    if kind[0] in "<[":
        count, _, inner = kind[1:-1].partition(" x ")
        one, align = size_of(inner.strip())
        if kind[0] == "[":
            return int(count) * one, align
        bits = int(count) * (1 if inner.strip() == "i1" else 8 * one)
        size = 1 << max(-(-bits // 8) - 1, 0).bit_length()
        return size, size
    at, most = 0, 1
    for member in split_top(kind[1:-1]):
        one, align = size_of(member)
        at = -(-at // align) * align + one
        most = max(most, align)
    return -(-at // most) * most, most


def members_of(kind: str) -> list[tuple[str, int]]:
    """Type and offset of each member of an aggregate."""
    if kind[0] == "[":
        count, _, inner = kind[1:-1].partition(" x ")
        return [(inner.strip(), i * size_of(inner.strip())[0]) for i in range(int(count))]
    at, found = 0, []
    for member in split_top(kind[1:-1]):
        one, align = size_of(member)
        at = -(-at // align) * align
        found.append((member, at))
        at += one
    return found


def read(text: str) -> tuple[dict[str, Function], dict[str, str]]:
    """Functions and global variables of a module by name."""
    functions: dict[str, Function] = {}
    variables: dict[str, str] = {}
    lines = iter(text.splitlines())
    for line in lines:
        if line.startswith("@"):
            name = GLOBAL.match(line)
            assert name is not None
            variables[name[0]] = line
        elif line.startswith("define "):
            body = []
            for inner in lines:
                if inner == "}":
                    break
                body.append(inner)
            function = _function(line, body)
            functions[function.name] = function
    return functions, variables


def _function(head: str, lines: list[str]) -> Function:
    name = GLOBAL.search(head)
    assert name is not None
    kind = head[: name.start()].split()[-1]
    names: dict[str, str] = {}

    def rename(raw: str) -> str:
        return names.setdefault(raw.strip('"'), f"v{len(names)}")

    def renamed(text: str) -> str:
        return LOCAL.sub(lambda found: "%" + rename(found[0][1:]), text)

    arguments = [typed(renamed(each)) for each in split_top(_inside(head, head.index("(", name.end()) + 1))]
    blocks: dict[str, Block] = {}
    block: Block | None = None
    rows = iter(lines)
    for line in rows:
        if not line.strip() or line.lstrip().startswith(";"):
            continue
        label = _LABEL.match(line)
        if label:
            raw = label[1] if label[1] is not None else label[2]
            block = Block(rename(raw), [], [], "", [])
            blocks[block.label] = block
            continue
        if block is None:
            block = Block(rename("entry block"), [], [], "", [])
            blocks[block.label] = block
        row = line.strip()
        if row.startswith("switch") and "]" not in row:
            for more in rows:
                row += " " + more.strip()
                if "]" in more:
                    break
        row = renamed(_INVARIANT.sub("!invariant.load !0", _METADATA.sub("", row)))
        word = row.split(" ", 1)[0]
        if word in ("br", "switch", "ret", "unreachable"):
            block.end = row
            block.targets = re.findall(r"label %(\w+)", row)
        else:
            made = _instruction(row)
            (block.phis if made.operation == "phi" else block.body).append(made)
    for each in blocks.values():
        for target in each.targets:
            blocks[target].sources.append(each.label)
    return Function(name[0], kind, arguments, blocks)


def _inside(text: str, begin: int) -> str:
    """What follows up to the bracket that closes."""
    depth, at = 1, begin
    while depth:
        depth += text[at] == "("
        depth -= text[at] == ")"
        at += 1
    return text[begin : at - 1]


def _instruction(text: str) -> Instruction:  # noqa: C901, PLR0915 - a form for each instruction
    name, rest = "", text
    found = re.match(r"(%\w+) = ", text)
    if found:
        name, rest = found[1], text[found.end() :]
    rest = re.sub(r"^(?:tail|musttail|notail) (?=call)", "", rest)
    operation, _, rest = rest.partition(" ")
    while flag := _FLAGS.match(rest):
        rest = rest[flag.end() :]
    make = Instruction(name, operation, "", [], text, rest=rest)
    if operation in ("fadd", "fsub", "fmul", "fdiv", "frem", "fneg"):
        first, *others = split_top(rest)
        x = typed(first)
        make.kind, make.operands = x.kind, [x, *(Operand(x.kind, other) for other in others)]
    elif operation in ("select", "insertelement", "extractelement", "shufflevector", "freeze"):
        make.operands = [typed(each) for each in split_top(rest)]
        x = make.operands[1 if operation == "select" else 0]
        make.kind = x.kind
        if operation == "extractelement":
            make.kind = x.kind[1:-1].partition(" x ")[2]
        if operation == "shufflevector":
            make.kind = f"<{lanes_of(make.operands[2].kind)} x {x.kind[1:-1].partition(' x ')[2]}>"
    elif operation == "load":
        kind, pointer, *_ = split_top(rest)
        make.kind, make.operands = kind, [typed(pointer)]
    elif operation == "store":
        value, pointer, *_ = split_top(rest)
        make.operands = [typed(value), typed(pointer)]
        make.kind = make.operands[0].kind
    elif operation == "phi":
        make.kind, rest = take_type(rest)
        for pair in split_top(rest):
            value, source = split_top(pair[1:-1])
            make.incoming[source[1:]] = value
        make.operands = [Operand(make.kind, value) for value in make.incoming.values()]
    elif operation == "call":
        _call(make, rest)
    elif operation == "alloca":
        make.kind = take_type(rest)[0]
    elif operation == "insertvalue":
        whole, part, *_ = split_top(rest)
        make.operands = [typed(whole), typed(part)]
        make.kind = make.operands[0].kind
    elif operation in ("bitcast", "sitofp", "uitofp", "fpext", "fptrunc", "inttoptr"):
        make.operands, make.kind = [], rest.rpartition(" to ")[2].strip()
    elif operation in ("icmp", "fcmp"):
        first, second = split_top(rest.split(" ", 1)[1])
        x = typed(first)
        make.operands = [x, Operand(x.kind, second)]
        make.kind = f"<{lanes_of(x.kind)} x i1>" if x.kind[0] == "<" else "i1"
    elif operation == "getelementptr":
        make.operands = [typed(each) for each in split_top(rest)[1:]]
        make.kind = next((f"<{lanes_of(o.kind)} x ptr>" for o in make.operands if o.kind[0] == "<"), "ptr")
    elif operation in ("zext", "sext", "trunc", "fptosi", "fptoui", "ptrtoint"):
        make.operands, make.kind = [typed(rest.rpartition(" to ")[0])], rest.rpartition(" to ")[2].strip()
    elif operation in ("add", "sub", "mul", "shl", "lshr", "ashr", "and", "or", "xor", "sdiv", "srem", "udiv", "urem"):
        first, second = split_top(rest)
        x = typed(first)
        make.operands, make.kind = [x, Operand(x.kind, second)], x.kind
    elif operation in ("fence", "atomicrmw", "extractvalue", "cmpxchg"):
        make.kind = "opaque"
    else:
        raise MeltemiError(f"adjoint: the compiled code has an instruction without a rule: {text[:120]}")
    return make


def _call(make: Instruction, rest: str) -> None:
    begin = GLOBAL.search(rest)
    while found := _ATTRIBUTES.match(rest):
        rest = rest[found.end() :]
    make.kind = take_type(rest)[0]
    if begin is None:
        make.callee = ""
        return
    make.callee = begin[0]
    inside = _inside(rest, rest.index(make.callee) + len(make.callee) + 1)
    make.operands = [typed(each) for each in split_top(inside) if not each.startswith("metadata")]
