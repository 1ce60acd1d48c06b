"""The grammar of LLVM's text, as far as Numba writes it: from the code of a module to records.

Each row of ``_GRAMMAR`` has the form of some instructions and the type of their result. Code that does not follow it is
an error, never a wrong derivative.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from meltemi.gradients.reverse.code import (
    LOCAL,
    BasicBlock,
    Function,
    Instruction,
    Operand,
    entry_of,
    lanes_of,
    no_rule,
)

_GRAMMAR = """
fadd fsub fmul fdiv frem                                | operand , same              | first
add sub mul shl lshr ashr and or xor                    | operand , same              | first
sdiv srem udiv urem                                     | operand , same              | first
fneg freeze                                             | operand                     | first
icmp fcmp                                               | operand , same              | truth
select                                                  | operand , operand , operand | second
insertelement                                           | operand , operand , operand | first
extractelement                                          | operand , operand           | entry
shufflevector                                           | operand , operand , operand | shuffled
load                                                    | type , operand access       | stated
store                                                   | operand , operand access    | first
phi                                                     | type incoming               | stated
call                                                    | type called                 | stated
alloca                                                  | type anything               | stated
insertvalue                                             | operand , operand places    | first
bitcast sitofp uitofp fpext fptrunc inttoptr            | operand to type             | stated
zext sext trunc fptosi fptoui ptrtoint                  | operand to type             | stated
getelementptr                                           | element operands            | addresses
fence atomicrmw cmpxchg extractvalue                    | anything                    | opaque
br switch ret unreachable                               | anything                    | opaque
"""
_FORMS = {
    operation: (form.split(), result.strip())
    for operations, form, result in (row.split("|") for row in _GRAMMAR.strip().splitlines())
    for operation in operations.split()
}
_ENDS = ("br", "switch", "ret", "unreachable")
_TOKEN = re.compile(r'[%@c]?"[^"]*"|[%@!#]?[-+\w.$]+|[][(){}<>,=*]')
_TYPE = re.compile(r"i\d+|float|ptr|double|void|[<{\[]")
_GLOBAL = re.compile(r'@(?:"[^"]*"|[-\w.$]+)')
_LABEL = re.compile(r'^(?:"([^"]*)"|([-\w.$]+)):')
_INVARIANT = "!invariant.load !0"
_METADATA = re.compile(r"(?:,? !(?!invariant)[\w.]+ ![\w()]*| #\d+)")
_CONSTANTS = frozenset({"true", "false", "null", "none", "poison", "undef", "zeroinitializer"})
_EXPRESSIONS = frozenset({"splat", "getelementptr", "inttoptr", "ptrtoint", "bitcast"})
_CLOSING = {"(": ")", "[": "]", "{": "}", "<": ">"}


class _Mismatch(Exception):
    """A row that does not follow the grammar."""


class _Row:
    """The tokens of a row of code, and the place up to which they are read."""

    def __init__(self, text: str) -> None:
        self.text, self.tokens, self.at = text, [*_TOKEN.finditer(text)], 0

    @property
    def token(self) -> str:
        """The next token; empty at the end."""
        return self.tokens[self.at][0] if self.at < len(self.tokens) else ""

    def take(self, wanted: str = "") -> str:
        """Read a token."""
        token = self.token
        if not token or (wanted and token != wanted):
            raise _Mismatch
        self.at += 1
        return token

    def skip(self) -> None:
        """Read a token, or all up to the bracket that closes it."""
        closing = _CLOSING.get(self.take())
        while closing and self.token != closing:
            self.skip()
        if closing:
            self.take()

    def since(self, first: int) -> str:
        """The text from a token up to here."""
        return self.text[self.tokens[first].start() : self.tokens[self.at - 1].end()]

    def type(self) -> str:
        """A type, after any flags and attributes."""
        while not _TYPE.fullmatch(self.token):
            if self.token[:1] in ("%", "@", ",", ""):
                raise _Mismatch
            self.skip()
        first = self.at
        self.skip()
        return self.since(first)

    def value(self) -> str:
        """A name, number or constant, after any attributes."""
        while self.token[:1].isalpha() and self.token not in _CONSTANTS | _EXPRESSIONS:
            if self.take() == "align":
                self.take()
            elif self.token == "(":
                self.skip()
        first, expression = self.at, self.token in _EXPRESSIONS
        self.skip()
        while expression and self.token[:1].isalpha():
            self.take()
        if expression:
            self.skip()
        return self.since(first)

    def operand(self) -> Operand:
        """A value with its type."""
        return Operand(self.type(), self.value())

    def operands(self, end: str) -> list[Operand]:
        """Values with their types, up to a token; metadata are no values."""
        read = []
        while self.token != end:
            if self.token == "metadata":
                while self.token not in (",", end):
                    self.skip()
            else:
                read.append(self.operand())
            if self.token != end:
                self.take(",")
        return read


def globals_in(text: str) -> set[str]:
    """Names of the functions and global variables in a code."""
    return set(_GLOBAL.findall(text))


def read(text: str, kernels: Mapping[str, str]) -> tuple[dict[str, Function], dict[str, str]]:
    """Functions and global variables of a module by name.

    Args:
      text: LLVM's code.
      kernels: names of the functions in Python, for messages.

    Raises:
      MeltemiError: an instruction that the grammar does not have.
    """
    functions: dict[str, Function] = {}
    variables: dict[str, str] = {}
    lines = iter(text.splitlines())
    for line in lines:
        if name := _GLOBAL.match(line):
            variables[name[0]] = line
        elif line.startswith("define "):
            body = []
            while (inner := next(lines)) != "}":
                body.append(inner)
            function = _function(line, body, kernels)
            functions[function.name] = function
    return functions, variables


def _function(head: str, lines: list[str], kernels: Mapping[str, str]) -> Function:
    names: dict[str, str] = {}

    def rename(raw: str) -> str:
        return names.setdefault(raw.strip('"'), f"v{len(names)}")

    def renamed(text: str) -> str:
        return LOCAL.sub(lambda match: "%" + rename(match[0][1:]), text)

    name = next(_GLOBAL.finditer(head))[0]
    kernel = kernels.get(name[1:], name[1:])
    line = head
    try:
        kind, arguments = _head(renamed(head))
        blocks: dict[str, BasicBlock] = {}
        label, body = "", list[Instruction]()
        for line in _rows(lines):
            if match := _LABEL.match(line):
                label = rename(match[1] if match[1] is not None else match[2])
                continue
            label = label or rename("entry block")
            line = renamed(re.sub(r"!invariant\.load !\d+", _INVARIANT, line))
            body.append(_instruction(line))
            if body[-1].operation == "end":
                blocks[label] = _block(label, body)
                body = []
    except _Mismatch:
        raise no_rule(line, kernel) from None
    for each in blocks.values():
        for target in each.targets:
            blocks[target].sources.append(each.label)
    return Function(name, kernel, kind, arguments, blocks)


def _head(line: str) -> tuple[str, tuple[Operand, ...]]:
    """Type of the result of a function, and its arguments."""
    row = _Row(line)
    row.take("define")
    kind = row.type()
    row.take()
    row.take("(")
    arguments = row.operands(")")
    return kind, tuple(arguments)


def _block(label: str, rows: list[Instruction]) -> BasicBlock:
    end = rows.pop()
    phis, body = (tuple(e for e in rows if (e.operation == "phi") is wanted) for wanted in (True, False))
    return BasicBlock(label, phis, body, end, tuple(re.findall(r"label %(\w+)", end.code)))


def _rows(lines: list[str]) -> list[str]:
    """Rows without blanks, comments and metadata; a ``switch`` in one row."""
    rows: list[str] = []
    for line in lines:
        row = _METADATA.sub("", line).strip()
        if rows and rows[-1].startswith("switch") and "]" not in rows[-1]:
            rows[-1] += " " + row
        elif row and not row.startswith(";"):
            rows.append(row)
    return rows


def _instruction(text: str) -> Instruction:
    row, name = _Row(text), ""
    if row.token.startswith("%"):
        name = row.take()
        row.take("=")
    first = row.at
    if row.token in ("tail", "musttail", "notail"):
        row.take()
    operation = row.take()
    if operation not in _FORMS:
        raise _Mismatch
    form, result = _FORMS[operation]
    parts: dict[str, Any] = {"operands": []}
    for word in form:
        _read(row, word, parts)
    if row.token:
        raise _Mismatch
    operands = tuple(parts.pop("operands"))
    kind = _result(result, operands, parts.pop("kind", ""))
    return Instruction(name, "end" if operation in _ENDS else operation, kind, row.since(first), operands, **parts)


def _read(row: _Row, word: str, parts: dict[str, Any]) -> None:  # noqa: C901 - a case for each word of the grammar
    """Read what a word of the grammar stands for."""
    operands: list[Operand] = parts["operands"]
    match word:
        case "operand":
            operands.append(row.operand())
        case "same":
            operands.append(Operand(operands[0].kind, row.value()))
        case "type":
            parts["kind"] = row.type()
        case "element":
            parts["element"] = row.type()
        case "operands" if row.token:
            row.take(",")
            operands += row.operands("")
        case "incoming":
            sources = []
            while row.token:
                row.take("[")
                operands.append(Operand(parts["kind"], row.value()))
                row.take(",")
                sources.append(row.take()[1:])
                row.take("]")
                if row.token:
                    row.take(",")
            parts["sources"] = tuple(sources)
        case "called":
            while row.token[:1] not in ("%", "@"):
                row.skip()
            callee = row.take()
            if callee[0] == "@":
                parts["callee"] = callee
                row.take("(")
                operands += row.operands(")")
            _read(row, "anything", parts)
        case "access":
            rest = row.at
            _read(row, "anything", parts)
            words = row.since(rest) if row.at > rest else ""
            parts["invariant"] = _INVARIANT in words
            parts["align"] = int(match[1]) if (match := re.search(r"align (\d+)", words)) else 0
        case "places":
            places = []
            while row.token:
                row.take(",")
                if not (place := row.take()).isdecimal():
                    raise _Mismatch
                places.append(int(place))
            parts["places"] = tuple(places)
        case "anything":
            while row.token:
                row.skip()
        case "," | "to":
            row.take(word)


def _result(rule: str, operands: tuple[Operand, ...], stated: str) -> str:
    """Type of a result by the rule of the grammar."""
    match rule:
        case "first":
            return operands[0].kind
        case "second":
            return operands[1].kind
        case "entry":
            return entry_of(operands[0].kind)
        case "truth":
            kind = operands[0].kind
            return f"<{lanes_of(kind)} x i1>" if kind[0] == "<" else "i1"
        case "shuffled":
            return f"<{lanes_of(operands[2].kind)} x {entry_of(operands[0].kind)}>"
        case "addresses":
            vector = next((o.kind for o in operands if o.kind[0] == "<"), "")
            return f"<{lanes_of(vector)} x ptr>" if vector else "ptr"
    return stated or rule
