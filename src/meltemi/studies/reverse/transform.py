"""From the code of a kernel to two functions: one that records what its adjoint needs, and the adjoint.

Every array is in one block of memory, and the adjoint of the number at an address is ``SHADOW`` bytes behind it. So the
adjoint of ``load`` adds to the shadow, and that of ``store`` takes from it. The values that an adjoint needs are written,
block by block of the code, onto a tape in the order of execution, and read backwards. Values that follow from others, such
as addresses, are computed again.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from meltemi.core.errors import InputError, MeltemiError
from meltemi.maths.records import members
from meltemi.studies.reverse.code import (
    LOCAL,
    Block,
    Function,
    Instruction,
    Operand,
    is_float,
    lanes_of,
    members_of,
    read,
    size_of,
)
from meltemi.studies.reverse.rules import FLAT, FUNCTIONS, Emitter, constant, terms

SHADOW = (1 << 26) + 64 * 33
"""[bytes] distance of the adjoint of a number from it."""
HEAD = 128
"""[bytes] begin of the memory: the end of the tape, and a place that masked entries may use."""
ARITHMETIC = ("fadd", "fsub", "fmul", "fdiv", "fneg")
AGAIN = frozenset(
    "getelementptr add sub mul shl lshr ashr and or xor zext sext trunc icmp inttoptr ptrtoint freeze".split()
)
"""Operations on integers and addresses that are repeated rather than recorded."""
AGAIN_IF_INTEGER = ("select", "extractelement", "insertelement", "shufflevector", "bitcast")
CHEAP = ("fadd", "fsub", "fmul", "fneg", "select", "fcmp", "shufflevector", "insertelement", "extractelement")
"""Operations on numbers that are repeated where all their arguments are known."""
Root = tuple[str, str] | str
"""Where an address leads: a member of a record, by class and name, or one of these."""
Pieces = Mapping[tuple[str, str], frozenset[int] | None]
STACK, CONSTANTS, UNKNOWN = "stack", "constants", "unknown"
NOTHING = re.compile(r"@(?:llvm\.(?:lifetime|assume|dbg|experimental\.noalias)|NRT_incref|NRT_decref)")
_LOOP = """define internal void @move(ptr %to, ptr %from, i64 %n) {
entry:
  %some = icmp sgt i64 %n, 7
  br i1 %some, label %loop, label %done
loop:
  %i = phi i64 [ 0, %entry ], [ %next, %loop ]
  %p = getelementptr i8, ptr %to, i64 %i
  %q = getelementptr i8, ptr %from, i64 %i
  %x = load double, ptr %p, align 8
  %y = load double, ptr %q, align 8
  store double 0.0, ptr %p, align 8
  %z = fadd double %x, %y
  store double %z, ptr %q, align 8
  %next = add i64 %i, 8
  %end = add i64 %i, 15
  %more = icmp slt i64 %end, %n
  br i1 %more, label %loop, label %done
done:
  ret void
}
"""


class Transformed:
    """The module with the recording function ``forward`` and the adjoint ``backward`` of one function.

    Args:
      text: LLVM code of the module.
      top: name of the function.
      records: classes of the records among its arguments, by number of the argument.
      pieces: of memory that each member of a record has, see :meth:`Memory.pieces`.
      tables: whether derivatives by arrays that the code does not change are wanted.

    Attributes:
      text: the code of both.
      used: [bytes] memory that the functions use, before the arrays.
    """

    def __init__(
        self, text: str, top: str, records: Mapping[int, Any], pieces: Pieces, *, tables: bool
    ) -> None:
        self.functions, variables = read(text)
        self.pieces, self.tables = pieces, tables
        self.used = HEAD
        self.order: list[str] = []
        self.parts: dict[str, _Adjoint] = {}
        self._visit(top)
        self.parts[top].records = dict(records)
        for name in reversed(self.order):
            self.parts[name].bind()
        changed = {root for part in self.parts.values() for root in part.changed()}
        self.changed = self.pieces_of(changed)
        self.unknown = UNKNOWN in changed
        kept = set().union(*(part.not_restored() for part in self.parts.values()))
        self.restored = set() if self.unknown else self.changed - self.pieces_of(kept)
        self.emitter = Emitter()
        made = [text for name in self.order for text in self.parts[name].code()]
        first = self.parts[top]
        plain = [o for o in first.function.arguments if not is_float(o.kind)]
        inputs = ", ".join(f"{o.kind} {o.name}" for o in plain)
        passed = ", ".join(["ptr %base", *(f"{o.kind} {o.name}" for o in plain)])
        made.append(
            f"define i32 @forward(ptr %base, {inputs}) {{\n  %s = call i32 {first.forward}({passed})\n  ret i32 %s\n}}\n"
            f"define void @backward(ptr %base, {inputs}) {{\n  call {first.result} {first.backward}({passed})\n"
            "  ret void\n}\n"
        )
        body = "\n".join(made)
        used = {name for name in re.findall(r"@(?:\"[^\"]*\"|[-\w.$]+)", body) if name in variables}
        declared = set(self.emitter.declared)
        self.text = "\n".join(
            [*(variables[name] for name in sorted(used)), *sorted(declared), _LOOP, body, "!0 = !{}", ""]
        )

    def slot(self, kind: str) -> int:
        """Place of a variable of the stack in the memory."""
        size, align = size_of(kind)
        at = -(-self.used // max(align, 8)) * max(align, 8)
        self.used = at + size
        return at

    def _visit(self, name: str) -> None:
        if name not in self.parts:
            part = self.parts[name] = _Adjoint(self, self.functions[name], len(self.parts))
            for call in part.calls:
                self._visit(call.callee)
            self.order.append(name)

    def fixed(self, root: Root) -> bool:
        """Whether the code never changes what is there."""
        if isinstance(root, tuple):
            return not self.unknown and self.changed.isdisjoint(self.pieces[root] or ())
        return root == CONSTANTS

    def pieces_of(self, roots: Iterable[Root]) -> set[int]:
        """Pieces of memory of several members."""
        return {piece for root in roots if isinstance(root, tuple) for piece in self.pieces[root] or ()}

    def is_restored(self, root: Root) -> bool:
        """Whether the adjoint takes back what the code stores there."""
        return isinstance(root, tuple) and self.pieces[root] is not None and self.restored >= self.pieces[root]

    def inert(self, root: Root) -> bool:
        """Whether numbers there have no derivatives."""
        if isinstance(root, tuple):
            return self.pieces[root] is None or (not self.tables and self.fixed(root))
        return root == CONSTANTS


class _Adjoint:
    """One function."""

    def __init__(self, module: Transformed, function: Function, number: int) -> None:
        self.module, self.function, self.number = module, function, number
        self.forward, self.backward = f"@f{number}", f"@r{number}"
        self.arguments = {o.name: (i, o.kind) for i, o in enumerate(function.arguments)}
        self.records: dict[int, Any] = {}
        self.bound: dict[str, frozenset[Root]] = {}
        self._roots: dict[str, frozenset[Root]] = {}
        self._all: set[Root] | None = None
        _expand(function)
        self.made: dict[str, Instruction] = {}
        self.home: dict[str, str] = {}
        self.users: dict[str, list[Instruction]] = {}
        self.slots: dict[str, int] = {}
        for block in function.blocks.values():
            for each in (*block.phis, *block.body):
                if each.name:
                    self.made[each.name], self.home[each.name] = each, block.label
                for name in LOCAL.findall(each.text.partition(" = ")[2] if each.name else each.text):
                    self.users.setdefault(name, []).append(each)
            for name in LOCAL.findall(block.end):
                self.users.setdefault(name, []).append(Instruction("", "end", "", [], block.end))
        self.calls = [
            each for block in function.blocks.values() for each in block.body if each.callee in module.functions
            and not NOTHING.match(each.callee)
        ]
        for each in self.made.values():
            if each.operation == "alloca" and each.kind != "ptr":
                self.slots[each.name] = module.slot(each.kind)
        self._copies()
        floats = [o for o in function.arguments if is_float(o.kind)]
        self.floats = floats
        self.result = f"{{ {', '.join(o.kind for o in floats)} }}" if floats else "void"

    def bind(self) -> None:
        """Tell the functions that are called which records and arrays they are given."""
        for call in self.calls:
            callee = self.module.parts[call.callee]
            for i, o in enumerate(call.operands):
                if o.kind != "ptr":
                    continue
                name = callee.function.arguments[i].name
                record = self.records.get(self.arguments[o.name][0]) if o.name in self.arguments else None
                if record is not None:
                    callee.records[i] = record
                else:
                    callee.bound[name] = callee.bound.get(name, frozenset()) | self.roots(o.name)

    def changed(self) -> set[Root]:
        """Where numbers are stored."""
        found: set[Root] = set()
        for block in self.function.blocks.values():
            for each in block.body:
                if self._stores(each):
                    found |= self.roots(each.operands[0 if intrinsic(each.callee).startswith("mem") else 1].name)
        return found

    def not_restored(self) -> set[Root]:
        """Arrays whose former numbers cannot be recorded by storing one number or vector."""
        found: set[Root] = set()
        for block in self.function.blocks.values():
            for each in block.body:
                name = intrinsic(each.callee) if each.operation == "call" else ""
                if each.operation == "store":
                    roots = self.roots(each.operands[1].name)
                    if not is_float(each.kind) or len(roots) > 1:
                        found |= roots
                elif name.startswith(("memset", "memcpy", "memmove")):
                    found |= self.roots(each.operands[0].name)
                elif name in MASKED and len(roots := self.roots(each.operands[1].name)) > 1:
                    found |= roots
        return found

    def writes(self, each: Instruction) -> set[Root]:
        """Arrays whose numbers an instruction changes."""
        if self._stores(each):
            return set(self.roots(each.operands[0 if intrinsic(each.callee).startswith("mem") else 1].name))
        callee = self.module.parts.get(each.callee)
        return callee.all_changed if callee is not None else set()

    @property
    def all_changed(self) -> set[Root]:
        """Arrays that the function changes, with those it calls."""
        if self._all is None:
            self._all = self.changed().union(*(self.module.parts[call.callee].all_changed for call in self.calls))
        return self._all

    def _stores(self, each: Instruction) -> bool:
        """Whether an instruction itself stores numbers."""
        if each.operation == "store":
            return is_float(each.kind)
        name = intrinsic(each.callee) if each.operation == "call" else ""
        if name in ("masked.store", "masked.scatter"):
            return is_float(each.operands[0].kind)
        return name.startswith(("memset", "memcpy", "memmove"))

    def _copies(self) -> None:
        """Numbers that are only copied, in integer registers."""
        for each in self.made.values():
            users = self.users.get(each.name, [])
            if each.operation == "load" and each.kind == "i64" and "!invariant" not in each.text and users:
                if all(u.operation == "store" and u.operands[0].name == each.name for u in users):
                    each.kind = "double"
                    for user in users:
                        user.kind = "double"

    # analysis -----------------------------------------------------------------------------------

    def roots(self, pointer: str) -> frozenset[Root]:
        """Where an address may lead: into a member of a record, by class and name, or elsewhere."""
        if pointer not in self._roots:
            self._roots[pointer] = frozenset()  # for a loop, in which it adds nothing
            self._roots[pointer] = self._found(pointer)
        return self._roots[pointer]

    def _found(self, pointer: str) -> frozenset[Root]:
        if pointer.startswith("@"):
            return frozenset([CONSTANTS])
        if pointer in self.arguments:
            return self.bound.get(pointer, frozenset([UNKNOWN]))
        each = self.made.get(pointer)
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
        load = self.made.get((LOCAL.findall(each.rest) or [""])[0])
        if load is None or load.operation != "load" or "!invariant" not in load.text:
            return None
        at, offset = load.operands[0].name, 0
        step = self.made.get(at)
        if step is not None and step.operation == "getelementptr":
            if not (step.rest.startswith("i8,") and step.operands[1].name.isdigit()):
                return None
            at, offset = step.operands[0].name, int(step.operands[1].name)
        record = self.records.get(self.arguments[at][0]) if at in self.arguments else None
        if record is None:
            return None
        word = 0
        for name, member in members(record).items():
            if offset == 8 * word:
                return record.__name__, name
            word += 2 + member.ndim
        return None

    def inert(self, pointer: str) -> bool:
        """Whether the numbers at an address have no derivatives."""
        return all(self.module.inert(root) for root in self.roots(pointer))

    def is_restored(self, pointer: str) -> bool:
        """Whether the adjoint takes back what is stored at an address."""
        roots = self.roots(pointer)
        return bool(roots) and all(self.module.is_restored(root) for root in roots)

    def fixed(self, pointer: str) -> bool:
        """Whether the numbers at an address never change."""
        return all(self.module.fixed(root) for root in self.roots(pointer))

    def inputs(self, each: Instruction) -> list[int]:
        """Numbers of the operands by which the result, or what is stored, has derivatives."""
        operation = each.operation
        if operation in ARITHMETIC or operation == "phi":
            return list(range(len(each.operands)))
        if operation == "select":
            return [1, 2]
        if operation in ("insertelement", "shufflevector"):
            return [0, 1]
        if operation in ("extractelement", "freeze"):
            return [0]
        if operation == "call":
            name = intrinsic(each.callee)
            if name == "masked.load":
                return [2]
            if name == "masked.gather":
                return [2]
            if name in ("vector.reduce.fadd", "copysign"):
                return [0, 1] if name == "vector.reduce.fadd" else [0]
            return [] if name in FLAT else list(range(len(each.operands)))
        return []

    def analyse(self) -> None:
        """Find the values that depend on numbers with derivatives, and on which something depends."""
        active: set[str] = {o.name for o in self.floats}
        sequence = [e for b in self.function.blocks.values() for e in (*b.phis, *b.body)]
        changed = True
        while changed:
            changed = False
            for each in sequence:
                if each.name and each.name not in active and is_float(each.kind) and self._depends(each, active):
                    active.add(each.name)
                    changed = True
        wanted: set[str] = set()
        for each in sequence:
            wanted |= {o.name for o in self._stored(each)}
        changed = True
        while changed:
            changed = False
            for each in reversed(sequence):
                if each.name in wanted and each.name in active:
                    new = {each.operands[i].name for i in self.inputs(each)} - wanted
                    wanted |= new
                    changed = changed or bool(new)
        self.active = active & wanted
        self.doubtful: set[str] = set()
        for each in sequence:
            singular = each.operation == "fdiv" or (
                each.operation == "call" and intrinsic(each.callee) in ("log", "pow", "exp", "tan", "sqrt")
            )
            passes = each.operation in ("fadd", "fsub", "fmul", "fneg", "insertelement", "extractelement", "shufflevector")
            if singular or (passes and any(o.name in self.doubtful for o in each.operands)):
                self.doubtful.add(each.name)
        self.touches = any(self._touches(each) for each in sequence)
        self.old = {
            id(each): f"%old.{n}"
            for n, each in enumerate(sequence)
            if self.touches
            and (each.operation == "store" or (each.operation == "call" and intrinsic(each.callee) in MASKED))
            and self.is_restored(each.operands[1].name)
        }

    def _depends(self, each: Instruction, active: set[str]) -> bool:
        if each.operation == "load":
            return not self.inert(each.operands[0].name)
        if each.operation == "call" and intrinsic(each.callee) in ("masked.load", "masked.gather"):
            return not self.inert(each.operands[0].name) or each.operands[2].name in active
        return any(each.operands[i].name in active for i in self.inputs(each))

    def _stored(self, each: Instruction) -> list[Operand]:
        if each.operation == "store":
            return [] if self.inert(each.operands[1].name) else [each.operands[0]]
        if each.operation == "call":
            if intrinsic(each.callee) in ("masked.store", "masked.scatter"):
                return [] if self.inert(each.operands[1].name) else [each.operands[0]]
            callee = self.module.parts.get(each.callee)
            if callee is not None and callee.touches:
                return [o for o in each.operands if is_float(o.kind)]
        return []

    def _touches(self, each: Instruction) -> bool:
        if self._stores(each):
            return not self.inert(each.operands[0 if intrinsic(each.callee).startswith("mem") else 1].name)
        callee = self.module.parts.get(each.callee)
        return callee is not None and callee.touches

    # code ---------------------------------------------------------------------------------------

    def code(self) -> list[str]:
        """The recording function, and its adjoint if it has one."""
        self.analyse()
        blocks = self.function.blocks
        self.returns = [label for label, block in blocks.items() if block.end.startswith("ret")]
        if not self.touches:
            return [self._forward({})]
        first = {label: _Reverse(self, block, frozenset()).emit() for label, block in blocks.items()}
        self.across = set().union(*(r.across for r in first.values()))
        done = {}
        for label, block in blocks.items():
            done[label] = _Reverse(self, block, self._again(first[label].saved, first[label].read)).emit()
        return [self._forward(done), self._backward(done)]

    def _again(self, saved: dict[str, str], read: set[str]) -> frozenset[str]:
        """Values that follow from those that are needed, by operations that are cheaper than the memory."""
        known: dict[str, bool] = {}
        again = set()

        def is_known(name: str) -> bool:
            if name not in known:
                each = self.made.get(name)
                known[name] = name in saved or name in read or (each is None and not is_float(self.arguments[name][1]))
                if each is not None and name not in read and follows(each):
                    again.add(name)
                    known[name] = True
            return known[name]

        def follows(each: Instruction) -> bool:
            if each.operation == "load":
                return "!invariant" in each.text or (is_float(each.kind) and self.fixed(each.operands[0].name))
            if each.operation not in CHEAP and each.operation not in AGAIN:
                return each.operation == "alloca"
            return all(is_known(name) for name in LOCAL.findall(each.text.partition(" = ")[2]))

        for name in self.made:
            is_known(name)
        return frozenset(again)

    def _slots(self) -> list[str]:
        return [f"  {name} = getelementptr i8, ptr %base, i64 {at}" for name, at in self.slots.items()]

    def _forward(self, reverse: dict[str, _Reverse]) -> str:
        arguments = ", ".join(["ptr %base", *(f"{o.kind} {o.name}" for o in self.function.arguments)])
        lines = [f"define internal {self.function.kind} {self.forward}({arguments}) noinline {{"]
        lines += ["start:", "  %tape = alloca ptr", "  %tape.0 = load ptr, ptr %base", "  store ptr %tape.0, ptr %tape"]
        lines += self._slots()
        lines.append(f"  br label %{next(iter(self.function.blocks))}")
        first = next(iter(self.function.blocks))
        for n, (label, block) in enumerate(self.function.blocks.items()):
            lines.append(f"{label}:")
            record = reverse.get(label)
            for phi in block.phis:
                lines.append("  " + _clean(phi.text))
            if record is not None and record.switch:
                pairs = ", ".join(f"[ {record.sources.index(source)}, %{source} ]" for source in block.sources)
                lines.append(f"  %from.{n} = phi i64 {pairs}")
            for each in block.body:
                lines += self._repeat(each, n)
            if record is not None:
                lines += record.push(n)
            if block.end.startswith("ret"):
                if reverse and len(self.returns) > 1:
                    lines += _pushed(f"end.{n}", [("i64", str(self.returns.index(label)), 0)], 64)
                lines += [f"  %tape.end{n} = load ptr, ptr %tape", f"  store ptr %tape.end{n}, ptr %base"]
            lines.append("  " + _clean(block.end))
        pass
        return "\n".join([*lines, "}", ""])

    def _repeat(self, each: Instruction, n: int) -> list[str]:
        if each.operation == "alloca" and each.name in self.slots:
            return []
        if id(each) in self.old:
            x, at = each.operands[:2]
            if each.operation == "store":
                former = f"load {each.kind}, ptr {at.name}{_align(each.text)}"
            else:
                mask = each.operands[2]
                former = masked(self.module.emitter, MASKED[intrinsic(each.callee)], x.kind, at, (mask.kind, mask.name))
            return [f"  {self.old[id(each)]} = {former}", "  " + _clean(each.text)]
        if each.operation != "call":
            return ["  " + _clean(each.text)]
        if NOTHING.match(each.callee):
            return []
        callee = self.module.parts.get(each.callee)
        if callee is None:
            _check(each)
            kinds = ", ".join(o.kind for o in each.operands)
            self.module.emitter.declared.add(f"declare {each.kind} {each.callee}({kinds})")
            values = ", ".join(f"{o.kind} {o.name}" for o in each.operands)
            made = f"{each.name} = " if each.name else ""
            return [f"  {made}call {each.kind} {each.callee}({values})"]
        self.module.emitter.count += 1
        k = self.module.emitter.count
        passed = ", ".join(["ptr %base", *(f"{o.kind} {o.name}" for o in each.operands)])
        made = f"{each.name} = " if each.name else ""
        return [
            f"  %tape.b{k} = load ptr, ptr %tape",
            f"  store ptr %tape.b{k}, ptr %base",
            f"  {made}call {each.kind} {callee.forward}({passed})",
            f"  %tape.a{k} = load ptr, ptr %base",
            f"  store ptr %tape.a{k}, ptr %tape",
        ]

    def _backward(self, reverse: dict[str, _Reverse]) -> str:
        plain = [o for o in self.function.arguments if not is_float(o.kind)]
        arguments = ", ".join(["ptr %base", *(f"{o.kind} {o.name}" for o in plain)])
        lines = [f"define internal {self.result} {self.backward}({arguments}) noinline {{", "start:"]
        lines += ["  %tape = alloca ptr", "  %tape.0 = load ptr, ptr %base", "  store ptr %tape.0, ptr %tape"]
        lines += self._slots()
        kinds = {o.name: o.kind for o in self.floats} | {name: self.made[name].kind for name in self.made}
        for name in sorted(self.across | {o.name for o in self.floats}):
            lines += [f"  %a.{name[1:]} = alloca {kinds[name]}"]
            lines += [f"  store {kinds[name]} zeroinitializer, ptr %a.{name[1:]}"]
        if len(self.returns) > 1:
            lines += _popped("end", 64) + ["  %end = load i64, ptr %tape.end"]
            cases = " ".join(f"i64 {k}, label %r.{label}" for k, label in enumerate(self.returns))
            lines.append(f"  switch i64 %end, label %r.{self.returns[0]} [ {cases} ]")
        else:
            lines.append(f"  br label %r.{self.returns[0]}")
        for label in reversed(self.function.blocks):
            lines += reverse[label].lines()
        return "\n".join([*lines, "}", ""])


class _Reverse:
    """The adjoint of one block.

    Attributes:
      saved: values, and their types, that the block records.
      across: values whose adjoints pass from block to block.
    """

    def __init__(self, part: _Adjoint, block: Block, again: frozenset[str]) -> None:
        self.part, self.block, self.again = part, block, again
        self.sources = list(dict.fromkeys(block.sources))
        self.switch = len(self.sources) > 1
        self.e = part.module.emitter
        self.saved: dict[str, str] = {}
        self.across: set[str] = set()
        self.known: dict[str, str] = {}
        self.sums: dict[str, str] = {}
        self.read: set[str] = set()
        self.at = len(block.body)

    # values of the forward pass

    def value(self, name: str) -> str:
        """Name, in the adjoint, of a value of the forward pass."""
        part = self.part
        if not name.startswith("%"):
            return name if "%" not in name else LOCAL.sub(lambda found: self.value(found[0]), name)
        if name in self.known:
            return self.known[name]
        each = part.made.get(name)
        if each is None:
            kind = part.arguments[name][1]
            return self._save(name, kind) if is_float(kind) else name
        if each.operation == "alloca":
            return name if name in part.slots else "null"
        integer = not is_float(each.kind)
        repeat = (
            each.operation in AGAIN
            or (each.operation in AGAIN_IF_INTEGER and integer and "double" not in each.text)
            or (each.operation == "load" and "!invariant" in each.text and integer)
            or (each.operation == "load" and not integer and part.fixed(each.operands[0].name))
            or name in self.again
        )
        if not repeat and self._may_read(each):
            self.read.add(name)
            repeat = True
        if not repeat:
            return self._save(name, each.kind)
        text = LOCAL.sub(lambda found: self.value(found[0]), _clean(each.text.partition(" = ")[2]))
        self.e.count += 1
        self.known[name] = f"%t{self.e.count}"
        self.e.lines.append(f"  {self.known[name]} = {text}")
        return self.known[name]

    def _may_read(self, each: Instruction) -> bool:
        """Whether a number is still, or again, in the memory from which it was loaded earlier in this block."""
        part, body = self.part, self.block.body
        if each.operation != "load" or part.home[each.name] != self.block.label:
            return False
        pointer = each.operands[0].name
        if not is_float(each.kind) or not part.is_restored(pointer):
            return False
        pieces = part.module.pieces_of(part.roots(pointer))
        first = next(i for i, other in enumerate(body) if other is each)
        return all(
            pieces.isdisjoint(part.module.pieces_of(part.writes(other))) for other in body[first + 1 : self.at + 1]
        )

    def _save(self, name: str, kind: str) -> str:
        self.saved[name] = kind
        self.known[name] = f"%s.{self.block.label}.{name[1:]}"
        return self.known[name]

    # adjoints

    def add(self, operand: Operand | str, kind: str, term: str) -> None:
        """Add to the adjoint of a value."""
        name = operand if isinstance(operand, str) else operand.name
        if name in self.part.active:
            old = self.sums.get(name)
            self.sums[name] = term if old is None else self.e.op("fadd", kind, old, term)

    def take(self, each: Instruction) -> str | None:
        """The adjoint of a result, complete; None if it is zero."""
        if each.name not in self.part.active:
            return None
        made = self.sums.pop(each.name, None)
        if self._local(each):
            return made
        self.across.add(each.name)
        at = f"%a.{each.name[1:]}"
        old = self.e.new(f"load {each.kind}, ptr {at}")
        self.e.do(f"store {each.kind} zeroinitializer, ptr {at}")
        return old if made is None else self.e.op("fadd", each.kind, old, made)

    def _local(self, each: Instruction) -> bool:
        label = self.block.label
        return each.operation != "phi" and all(
            u.operation not in ("phi", "end") and self.part_of(u) == label for u in self.part.users.get(each.name, [])
        )

    def part_of(self, each: Instruction) -> str:
        """Label of the block of an instruction."""
        return self.part.homes[id(each)]

    def shadow(self, pointer: str) -> str:
        """Address of the adjoint of what is at an address."""
        return self.e.new(f"getelementptr i8, ptr {self.value(pointer)}, i64 {SHADOW}")

    def emit(self) -> _Reverse:
        """Generate the adjoint of the block."""
        part, e = self.part, self.e
        if not hasattr(part, "homes"):
            part.homes = {  # type: ignore[attr-defined]
                id(each): b.label for b in part.function.blocks.values() for each in (*b.phis, *b.body)
            }
        keep, e.lines = e.lines, []
        for self.at in range(len(self.block.body) - 1, -1, -1):
            each = self.block.body[self.at]
            self._adjoint(each)
            if id(each) in part.old:
                self._take_back(each, self._save(part.old[id(each)], each.operands[0].kind))
        phis = [(phi, self.take(phi)) for phi in self.block.phis if phi.name in part.active]
        for name, total in list(self.sums.items()):
            self._flush(name, total)
        self.sums.clear()
        body, e.lines = e.lines, []
        edges = []
        for source in self.sources:
            e.lines = []
            for phi, adjoint in phis:
                name = phi.incoming[source]
                if adjoint is not None and name in part.active:
                    self._flush(name, adjoint)
            edges.append((source, e.lines))
        self.body, self.edges, e.lines = body, edges, keep
        return self

    def _take_back(self, each: Instruction, old: str) -> None:
        """Restore what was in memory before a store."""
        x, at = each.operands[:2]
        there = Operand(at.kind, self.value(at.name))
        if each.operation == "store":
            self.e.do(f"store {each.kind} {old}, ptr {there.name}{_align(each.text)}")
        else:
            mask = each.operands[2].kind, self.value(each.operands[2].name)
            self.e.do(masked(self.e, intrinsic(each.callee), x.kind, there, mask, old))

    def _flush(self, name: str, total: str) -> None:
        part = self.part
        kind = part.made[name].kind if name in part.made else part.arguments[name][1]
        self.across.add(name)
        at = f"%a.{name[1:]}"
        old = self.e.new(f"load {kind}, ptr {at}")
        self.e.do(f"store {kind} {self.e.op('fadd', kind, old, total)}, ptr {at}")

    def _adjoint(self, each: Instruction) -> None:
        e, kind, operation, x = self.e, each.kind, each.operation, each.operands
        if operation == "store":
            if is_float(kind) and not self.part.inert(x[1].name):
                at, align = self.shadow(x[1].name), _align(each.text)
                if x[0].name in self.part.active:
                    self.add(x[0], kind, e.new(f"load {kind}, ptr {at}{align}"))
                e.do(f"store {kind} zeroinitializer, ptr {at}{align}")
            return
        if operation == "call":
            return self._adjoint_of_call(each)
        if not (each.name in self.part.active and is_float(kind)):
            return
        a = self.take(each)
        if a is None:
            return
        active = [o.name in self.part.active for o in x]
        if operation in ARITHMETIC:
            doubtful = [o.name in self.part.doubtful for o in x]
            for i, term in terms(e, operation, kind, a, active, doubtful, lambda i: self._of(each, i)).items():
                self.add(x[i], kind, term)
        elif operation == "load":
            if not self.part.inert(x[0].name):
                at, align = self.shadow(x[0].name), _align(each.text)
                old = e.new(f"load {kind}, ptr {at}{align}")
                e.do(f"store {kind} {e.op('fadd', kind, old, a)}, ptr {at}{align}")
        elif operation == "select":
            condition, zero = (x[0].kind, self.value(x[0].name)), constant(kind, 0.0)
            if active[1]:
                self.add(x[1], kind, e.choose(condition, kind, a, zero))
            if active[2]:
                self.add(x[2], kind, e.choose(condition, kind, zero, a))
        elif operation == "freeze":
            self.add(x[0], kind, a)
        elif operation == "extractelement":
            if active[0]:
                at = f"{x[1].kind} {self.value(x[1].name)}"
                self.add(x[0], x[0].kind, e.new(f"insertelement {x[0].kind} zeroinitializer, double {a}, {at}"))
        elif operation == "insertelement":
            at = f"{x[2].kind} {self.value(x[2].name)}"
            if active[1]:
                self.add(x[1], "double", e.new(f"extractelement {kind} {a}, {at}"))
            if active[0]:
                self.add(x[0], kind, e.new(f"insertelement {kind} {a}, double 0.0, {at}"))
        elif operation == "shufflevector":
            self._adjoint_of_shuffle(each, a)
        else:
            raise MeltemiError(f"adjoint: no derivative of {each.text[:120]}")

    def _of(self, each: Instruction, i: int) -> str:
        return self.value(each.name if i < 0 else each.operands[i].name)

    def _adjoint_of_shuffle(self, each: Instruction, a: str) -> None:
        e, (x, y, mask) = self.e, each.operands
        n, m = lanes_of(x.kind), lanes_of(mask.kind)
        places = _mask(mask.name, m)
        for k, operand in enumerate((x, y)):
            mine = [p - k * n if k * n <= p < (k + 1) * n else -1 for p in places]
            if operand.name not in self.part.active or not any(p >= 0 for p in mine):
                continue
            if n > 1 and len(set(mine)) == 1 and m > 1:
                name = f"@llvm.vector.reduce.fadd.v{m}f64"
                e.declared.add(f"declare double {name}(double, {each.kind})")
                total = e.new(f"call reassoc nsz arcp contract double {name}(double -0.0, {each.kind} {a})")
                term = e.new(f"insertelement {x.kind} zeroinitializer, double {total}, i64 {mine[0]}")
                self.add(operand, x.kind, term)
                continue
            while any(p >= 0 for p in mine):
                back = [m] * n
                for j, p in enumerate(mine):
                    if p >= 0 and back[p] == m:
                        back[p], mine[j] = j, -1
                indices = ", ".join(f"i32 {p}" for p in back)
                term = e.new(f"shufflevector {each.kind} {a}, {each.kind} zeroinitializer, <{n} x i32> <{indices}>")
                self.add(operand, x.kind, term)

    def _adjoint_of_call(self, each: Instruction) -> None:
        e, part, x = self.e, self.part, each.operands
        if NOTHING.match(each.callee):
            return
        callee = part.module.parts.get(each.callee)
        if callee is not None:
            if callee.touches:
                self._adjoint_of_kernel(each, callee)
            return
        name = intrinsic(each.callee)
        if name.startswith("memset"):
            if not part.inert(x[0].name) and part.made.get(x[0].name, each).kind != "alloca ptr":
                values = f"ptr {self.shadow(x[0].name)}, i8 0, i64 {self.value(x[2].name)}, i1 false"
                e.do(f"call void @llvm.memset.p0.i64({values})")
        elif name.startswith(("memcpy", "memmove")):
            if not (part.inert(x[0].name) or part.inert(x[1].name)):
                size = self.value(x[2].name)
                e.do(f"call void @move(ptr {self.shadow(x[0].name)}, ptr {self.shadow(x[1].name)}, i64 {size})")
        elif name in ("masked.store", "masked.scatter"):
            kind = x[0].kind
            if is_float(kind) and not part.inert(x[1].name):
                self._adjoint_of_masked(each, name, kind)
        elif each.name in part.active and is_float(each.kind):
            a = self.take(each)
            if a is None:
                return
            kind = each.kind
            if name in ("masked.load", "masked.gather"):
                self._adjoint_of_masked_load(each, name, a)
            elif name == "vector.reduce.fadd":
                self.add(x[0], "double", a)
                one = e.new(f"insertelement {x[1].kind} poison, double {a}, i64 0")
                mask = f"<{lanes_of(x[1].kind)} x i32> zeroinitializer"
                self.add(x[1], x[1].kind, e.new(f"shufflevector {x[1].kind} {one}, {x[1].kind} poison, {mask}"))
            elif name in FUNCTIONS:
                for i, term in FUNCTIONS[name](e, kind, a, lambda i: self._of(each, i)).items():
                    self.add(x[i], kind, e.guard(kind, a, term))
            else:
                raise InputError(f"gradient: the controller or model calls {name!r}, which has no derivative")

    def _shadows(self, operand: Operand) -> str:
        return self.e.new(f"getelementptr i8, {operand.kind} {self.value(operand.name)}, i64 {SHADOW}")

    def _adjoint_of_masked(self, each: Instruction, name: str, kind: str) -> None:
        e, (x, at, mask) = self.e, each.operands[:3]
        there, m = Operand(at.kind, self._shadows(at)), (mask.kind, self.value(mask.name))
        self.add(x, kind, e.new(masked(e, MASKED[name], kind, there, m)))
        e.do(masked(e, name, kind, there, m, "zeroinitializer"))

    def _adjoint_of_masked_load(self, each: Instruction, name: str, a: str) -> None:
        e, kind, (at, mask, other) = self.e, each.kind, each.operands[:3]
        m = (mask.kind, self.value(mask.name))
        zero = constant(kind, 0.0)
        if other.name in self.part.active:
            self.add(other, kind, e.choose(m, kind, zero, a))
        if self.part.inert(at.name):
            return
        places, part = self._shadows(at), e.choose(m, kind, a, zero)
        if name == "masked.load":
            there = Operand("ptr", places)
            old = e.new(masked(e, name, kind, there, m))
            e.do(masked(e, "masked.store", kind, there, m, e.op("fadd", kind, old, part)))
            return
        for i in range(lanes_of(kind)):
            p = e.new(f"extractelement {at.kind} {places}, i64 {i}")
            on = e.new(f"extractelement {m[0]} {m[1]}, i64 {i}")
            p = e.new(f"select i1 {on}, ptr {p}, ptr {e.new(f'getelementptr i8, ptr %base, i64 {64 + SHADOW}')}")
            old = e.new(f"load double, ptr {p}, align 8")
            e.do(f"store double {e.op('fadd', 'double', old, e.new(f'extractelement {kind} {part}, i64 {i}'))}, ptr {p}")

    def _adjoint_of_kernel(self, each: Instruction, callee: _Adjoint) -> None:
        e = self.e
        passed = ["ptr %base", *(f"{o.kind} {self.value(o.name)}" for o in each.operands if not is_float(o.kind))]
        e.do(f"store ptr {e.new('load ptr, ptr %tape')}, ptr %base")
        call = f"call {callee.result} {callee.backward}({', '.join(passed)})"
        result = ""
        if callee.floats:
            result = e.new(call)
        else:
            e.do(call)
        e.do(f"store ptr {e.new('load ptr, ptr %base')}, ptr %tape")
        for k, o in enumerate(o for o in each.operands if is_float(o.kind)):
            if o.name in self.part.active:
                self.add(o, o.kind, e.new(f"extractvalue {callee.result} {result}, {k}"))

    # text

    def record(self) -> tuple[list[tuple[str, str, int]], int]:
        """Type, name and place of what the block records, and its size."""
        found, at = [], 0
        for name, kind in sorted(self.saved.items(), key=lambda item: -size_of(item[1])[0]):
            size, align = size_of(kind)
            at = -(-at // align) * align
            found.append((kind, name, at))
            at += size
        if self.switch:
            at = -(-at // 8) * 8
            found.append(("i64", "from", at))
            at += 8
        return found, -(-at // 64) * 64

    def push(self, n: int) -> list[str]:
        """Code of the forward pass that records."""
        found, size = self.record()
        return _pushed(str(n), [(k, f"%from.{n}" if name == "from" else name, at) for k, name, at in found], size)

    def lines(self) -> list[str]:
        """Code of the adjoint."""
        part, label = self.part, self.block.label
        found, size = self.record()
        lines = [f"r.{label}:"]
        if found:
            lines += _popped(label, size)
            for kind, name, at in found:
                lines.append(f"  %p.{label}.{at} = getelementptr i8, ptr %tape.{label}, i64 {at}")
                short = "from" if name == "from" else name[1:]
                align = min(size_of(kind)[1], 64)
                lines.append(f"  %s.{label}.{short} = load {kind}, ptr %p.{label}.{at}, align {align}")
        lines += self.body
        if label == next(iter(part.function.blocks)):
            lines += ["  %tape.last = load ptr, ptr %tape", "  store ptr %tape.last, ptr %base"]
            result, made = part.result, "poison"
            for k, o in enumerate(part.floats):
                lines.append(f"  %x.{k} = load {o.kind}, ptr %a.{o.name[1:]}")
                lines.append(f"  %y.{k} = insertvalue {result} {made}, {o.kind} %x.{k}, {k}")
                made = f"%y.{k}"
            lines.append(f"  ret {result} {made}" if part.floats else "  ret void")
        elif not self.switch:
            ((source, edge),) = self.edges or ((None, []),)
            lines += edge
            lines.append(f"  br label %r.{source}" if source else "  unreachable")
        else:
            cases = " ".join(f"i64 {k}, label %e.{label}.{k}" for k in range(len(self.sources)))
            lines.append(f"  switch i64 %s.{label}.from, label %e.{label}.0 [ {cases} ]")
            for k, (source, edge) in enumerate(self.edges):
                lines += [f"e.{label}.{k}:", *edge, f"  br label %r.{source}"]
        return lines


MASKED = {"masked.store": "masked.load", "masked.scatter": "masked.gather"}


def masked(e: Emitter, name: str, kind: str, at: Operand, mask: tuple[str, str], value: str = "") -> str:
    """Call that stores a vector where the mask is set, or without a value loads one, with zeros elsewhere."""
    n, there = lanes_of(kind), f"{at.kind} align 8 {at.name}, {mask[0]} {mask[1]}"
    suffix = f"v{n}f64.{'p0' if at.kind == 'ptr' else f'v{n}p0'}"
    if value:
        e.declared.add(f"declare void @llvm.{name}.{suffix}({kind}, {at.kind}, {mask[0]})")
        return f"call void @llvm.{name}.{suffix}({kind} {value}, {there})"
    e.declared.add(f"declare {kind} @llvm.{name}.{suffix}({at.kind}, {mask[0]}, {kind})")
    return f"call {kind} @llvm.{name}.{suffix}({there}, {kind} zeroinitializer)"


def _pushed(n: str, found: list[tuple[str, str, int]], size: int) -> list[str]:
    if not found:
        return []
    lines = [f"  %tape.at{n} = load ptr, ptr %tape"]
    for i, (kind, name, at) in enumerate(found):
        align = min(size_of(kind)[1], 64)
        lines.append(f"  %tape.{n}.{i} = getelementptr i8, ptr %tape.at{n}, i64 {at}")
        lines.append(f"  store {kind} {name}, ptr %tape.{n}.{i}, align {align}")
    lines.append(f"  %tape.next{n} = getelementptr i8, ptr %tape.at{n}, i64 {size}")
    lines.append(f"  store ptr %tape.next{n}, ptr %tape")
    return lines


def _popped(label: str, size: int) -> list[str]:
    return [
        f"  %tape.of.{label} = load ptr, ptr %tape",
        f"  %tape.{label} = getelementptr i8, ptr %tape.of.{label}, i64 -{size}",
        f"  store ptr %tape.{label}, ptr %tape",
    ]


def _clean(text: str) -> str:
    return re.sub(r"(?: #\d+|, !(?!invariant)[\w.]+ !\w+)", "", text)


def _align(text: str) -> str:
    found = re.search(r", align \d+", text)
    return found[0] if found else ""


def _mask(text: str, m: int) -> list[int]:
    if text == "zeroinitializer":
        return [0] * m
    if text in ("poison", "undef"):
        return [-1] * m
    if text.startswith("splat"):
        return [int(text[:-1].rsplit(" ", 1)[1])] * m
    return [int(w.split()[1]) if w.split()[1].isdigit() else -1 for w in text[1:-1].split(", ")]


def intrinsic(callee: str) -> str:
    """Name of a function of LLVM without its types, or of the C library."""
    if not callee.startswith("@llvm."):
        return callee[1:]
    return re.sub(r"(?:\.(?:v?\d*[fip]\d+))+$", "", callee[6:])


def _check(call: Instruction) -> None:
    """Check that a function outside the module may be called in a code that is differentiated.

    Raises:
      InputError: it may change memory, for instance because it allocates an array.
    """
    if not call.callee.startswith("@llvm.") and ("ptr" in call.kind or any("ptr" in o.kind for o in call.operands)):
        name = call.callee[1:]
        what = "makes arrays" if name.startswith("NRT") else f"calls {name!r}"
        raise InputError(f"gradient: the controller {what}, of which there are no derivatives; keep them in its state")


def _expand(function: Function) -> None:
    """Store aggregates member by member."""
    made = {e.name: e for b in function.blocks.values() for e in b.body if e.name}
    count = 0

    def leaves(kind: str, name: str, at: int) -> list[tuple[str, str, int]]:
        if kind[0] not in "[{":
            return [(kind, name, at)]
        parts: list[str | None] = [None] * len(members_of(kind))
        while name in made:
            each = made[name]
            if each.operation != "insertvalue":
                raise MeltemiError(f"adjoint: no rule for {each.text[:120]}")
            index = int(each.text.rsplit(", ", 1)[1])
            if parts[index] is None:
                parts[index] = each.operands[1].name
            name = each.operands[0].name
        found = []
        for (inner, offset), part in zip(members_of(kind), parts, strict=True):
            if part is None and name == "zeroinitializer":
                part = name
            if part is not None:
                found += leaves(inner, part, at + offset)
        return found

    for block in function.blocks.values():
        body = []
        for each in block.body:
            if each.operation == "store" and each.kind[0] in "[{":
                pointer = each.operands[1].name
                for kind, name, at in leaves(each.kind, each.operands[0].name, 0):
                    count += 1
                    place = f"%member.{count}"
                    operands = [Operand("ptr", pointer), Operand("i64", str(at))]
                    text = f"getelementptr i8, ptr {pointer}, i64 {at}"
                    step = Instruction(place, "getelementptr", "ptr", operands, f"{place} = {text}")
                    step.rest = f"i8, ptr {pointer}, i64 {at}"
                    align = f"align {min(size_of(kind)[1], 8)}"
                    value = [Operand(kind, name), Operand("ptr", place)]
                    body += [step, Instruction("", "store", kind, value, f"store {kind} {name}, ptr {place}, {align}")]
            elif each.operation == "insertvalue":
                continue
            else:
                body.append(replace(each))
        block.body = body
