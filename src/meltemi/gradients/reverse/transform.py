"""From the code of a kernel to two functions: one that records what its adjoint needs, and the adjoint.

Every array is in one block of memory, and the adjoint of the number at an address is ``SHADOW`` bytes behind it. So
the adjoint of ``load`` adds to the shadow, and that of ``store`` takes from it. The values that an adjoint needs are
written, block by block of the code, onto a tape in the order of execution, and read backwards. Values that follow from
others, such as addresses, are computed again. One module: both functions follow the same blocks, and their rules have
to be read side by side.

Reference: docs/theory/adjoint.md (J-3); Griewank & Walther (2008), Evaluating Derivatives, chapters 3, 4 and 6.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from meltemi.compiler import members
from meltemi.core.errors import InputError, MeltemiError
from meltemi.gradients.reverse.blocks import (
    AGAIN,
    ARITHMETIC,
    CHEAP,
    NOTHING,
    NUMBER,
    VECTOR,
    Reverse,
    clean,
    intrinsic,
    padded,
    popped,
    pushed,
    unpadded,
)
from meltemi.gradients.reverse.code import (
    LOCAL,
    Function,
    Instruction,
    Operand,
    is_float,
    members_of,
    read,
    size_of,
)
from meltemi.gradients.reverse.loops import loops_of
from meltemi.gradients.reverse.rules import FLAT, Emitter

HEAD = 128
"""[bytes] begin of the memory: the end of the tape, and a place that masked entries may use."""
Root = tuple[str, str] | str
"""Where an address leads: a member of a record, by class and name, or one of these."""
STACK, CONSTANTS, UNKNOWN = "stack", "constants", "unknown"
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
      arrays: number of the array, in memory, of each member of a record by the names of record and member; members that
        overlap share it; None for one without derivatives.
      wanted: members by which derivatives are wanted though the code does not change them; by all if None.

    Attributes:
      text: the code of both.
      used: [bytes] memory that the functions use, before the arrays.
    """

    def __init__(
        self,
        text: str,
        top: str,
        records: Mapping[int, Any],
        arrays: Mapping[tuple[str, str], int | None],
        wanted: frozenset[str] | None,
    ) -> None:
        self.functions, variables = read(text)
        self.arrays, self.wanted = arrays, wanted
        self.used = HEAD
        self.order: list[str] = []
        self.parts: dict[str, _Adjoint] = {}
        self._visit(top)
        self.parts[top].records = dict(records)
        for name in reversed(self.order):
            self.parts[name].bind()
        changed = {root for part in self.parts.values() for root in part.changed()}
        self.changed = {self.arrays[root] for root in changed if isinstance(root, tuple)}
        self.unknown = UNKNOWN in changed
        self.emitter = Emitter()
        self.plain: dict[str, str] = {}
        made = [text for name in self.order for text in self.parts[name].code()]
        made += self.plain.values()
        first = self.parts[top]
        plain = [o for o in first.function.arguments if not is_float(o.kind)]
        inputs = ", ".join(f"{o.kind} {o.name}" for o in plain)
        passed = ", ".join(["ptr %base", *(f"{o.kind} {o.name}" for o in plain)])
        made.append(
            f"define i32 @forward(ptr %base, {inputs}) {{\n"
            f"  %s = call i32 {first.forward}({passed})\n  ret i32 %s\n}}\n"
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
            number = self.arrays[root]
            return not self.unknown and number not in self.changed
        return root == CONSTANTS

    def inert(self, root: Root) -> bool:
        """Whether numbers there have no derivatives."""
        if isinstance(root, tuple):
            passed_over = self.wanted is not None and root[1] not in self.wanted
            return self.arrays[root] is None or (passed_over and self.fixed(root))
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
        self.silent: dict[int, frozenset[str]] = {}
        self.unit = VECTOR
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
            each
            for block in function.blocks.values()
            for each in block.body
            if each.callee in module.functions and not NOTHING.match(each.callee)
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
            integer = each.operation == "load" and each.kind == "i64" and "!invariant" not in each.text
            if integer and users and all(u.operation == "store" and u.operands[0].name == each.name for u in users):
                for copy in (each, *users):
                    copy.kind = "double"

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

    def _active(self) -> set[str]:
        """The values that depend on numbers with derivatives, and on which something depends."""
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
        return active & wanted

    def analyse(self) -> None:
        """Find the values with adjoints, and the calls that need none."""
        self.silent = {id(call): at for call in self.calls if (at := self._results(call)) is not None}
        while True:
            self.active = self._active()
            heard = [key for key, at in self.silent.items() if any(self._matters(name) for name in at)]
            if not heard:
                break
            for key in heard:
                del self.silent[key]
        sequence = [e for b in self.function.blocks.values() for e in (*b.phis, *b.body)]
        self.doubtful: set[str] = set()
        for each in sequence:
            singular = each.operation == "fdiv" or (
                each.operation == "call" and intrinsic(each.callee) in ("log", "pow", "exp", "expm1", "tan", "sqrt")
            )
            passes = each.operation in (
                "fadd",
                "fsub",
                "fmul",
                "fneg",
                "insertelement",
                "extractelement",
                "shufflevector",
            )
            if singular or (passes and any(o.name in self.doubtful for o in each.operands)):
                self.doubtful.add(each.name)
        self.touches = any(self._touches(each) for each in sequence)

    def bases(self, pointer: str) -> frozenset[str]:
        """Arguments and places on the stack into which an address leads; "" for anything else."""
        each = self.made.get(pointer)
        if pointer in self.arguments or (each is not None and each.operation == "alloca"):
            return frozenset([pointer])
        if each is not None and each.operation in ("getelementptr", "freeze"):
            return self.bases(each.operands[0].name)
        return frozenset([""])

    def _changes(self) -> frozenset[str]:
        """Arguments at whose addresses numbers are stored, here or in functions that are called; "" for elsewhere."""
        found: set[str] = set()
        for block in self.function.blocks.values():
            for each in block.body:
                if self._stores(each):
                    at = each.operands[0 if intrinsic(each.callee).startswith("mem") else 1]
                    found |= self.bases(at.name)
        for call in self.calls:
            found |= self._changed_by(call)
        return frozenset(name for name in found if name in self.arguments or not name)

    def _changed_by(self, call: Instruction) -> frozenset[str]:
        callee = self.module.parts[call.callee]
        names = [o.name for o in callee.function.arguments]
        places = (self.bases(call.operands[names.index(name)].name) if name else {""} for name in callee.changes)
        return frozenset().union(*places)

    def _results(self, call: Instruction) -> frozenset[str] | None:
        """Places on the stack where a call stores numbers, if it stores none elsewhere."""
        found = self._changed_by(call)
        return found if found <= set(self.slots) else None

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
                writes = NOTHING.match(each.callee) or intrinsic(each.callee).startswith("memset")
                if not writes and id(each) not in self.silent:
                    return True
            elif each.operation != "store":
                return True
        return False

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
            if self.recorded(each):
                return [o for o in each.operands if is_float(o.kind)]
        return []

    def recorded(self, call: Instruction) -> bool:
        """Whether a call is of a function with an adjoint, and its results matter."""
        callee = self.module.parts.get(call.callee)
        return callee is not None and callee.touches and id(call) not in self.silent

    def _touches(self, each: Instruction) -> bool:
        if self._stores(each):
            return not self.inert(each.operands[0 if intrinsic(each.callee).startswith("mem") else 1].name)
        return self.recorded(each)

    # code ---------------------------------------------------------------------------------------

    def code(self) -> list[str]:
        """The recording function, and its adjoint if it has one."""
        self.changes = self._changes()
        self.analyse()
        blocks = self.function.blocks
        self.returns = [label for label, block in blocks.items() if block.end.startswith("ret")]
        if not self.touches:
            return [self._forward({})] if self.function.name == self.module.order[-1] else []
        self.loops = loops_of(blocks)
        first = {label: Reverse(self, block, frozenset()).emit() for label, block in blocks.items()}
        self.across = set().union(*(r.across for r in first.values()))
        done = {}
        for label, block in blocks.items():
            done[label] = Reverse(self, block, self._again({**first[label].saved, **first[label].kept})).emit()
        self.kept: dict[str, str] = {}
        for r in done.values():
            for name, (kind, number) in r.kept.items():
                self.kept[f"%k.{number}.{name[1:]}"] = kind
                for label in self.loops[number][1]:
                    done[label].left[name] = kind, number
        vectors = [any(size_of(k)[0] >= VECTOR for k in r.recorded.values()) for r in done.values() if r.recorded]
        called = (self.module.parts[call.callee].unit for call in self.calls if self.recorded(call))
        self.unit = VECTOR if 2 * sum(vectors) > len(vectors) else max(called, default=NUMBER)
        return [self._forward(done), self._backward(done)]

    def loop_without(self, label: str, name: str) -> int | None:
        """Number of the largest loop with a block, in which a value is a constant."""
        home = self.home.get(name)
        return next((k for k, (body, _) in enumerate(self.loops) if label in body and home not in body), None)

    def _again(self, saved: Mapping[str, Any]) -> frozenset[str]:
        """Values that follow from those that are needed, by operations that are cheaper than the memory."""
        known: dict[str, bool] = {}
        again = set()

        def is_known(name: str) -> bool:
            if name not in known:
                each = self.made.get(name)
                known[name] = name in saved or (each is None and not is_float(self.arguments[name][1]))
                if each is not None and follows(each):
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

    def plain(self) -> str:
        """Name of the function that records nothing."""
        name = f"@p{self.number}"
        if name not in self.module.plain:
            self.module.plain[name] = ""
            arguments = ", ".join(["ptr %base", *(f"{o.kind} {o.name}" for o in self.function.arguments)])
            lines = [f"define internal {self.function.kind} {name}({arguments}) noinline {{", "start:", *self._slots()]
            lines.append(f"  br label %{next(iter(self.function.blocks))}")
            for label, block in self.function.blocks.items():
                lines += [f"{label}:", *("  " + clean(phi.text) for phi in block.phis)]
                lines += [line for each in block.body for line in self._repeat(each, recorded=False)]
                lines.append("  " + clean(block.end))
            self.module.plain[name] = "\n".join([*lines, "}", ""])
        return name

    def _forward(self, reverse: dict[str, Reverse]) -> str:
        arguments = ", ".join(["ptr %base", *(f"{o.kind} {o.name}" for o in self.function.arguments)])
        lines = [f"define internal {self.function.kind} {self.forward}({arguments}) noinline {{"]
        lines += ["start:", "  %tape = alloca ptr", "  %tape.0 = load ptr, ptr %base", "  store ptr %tape.0, ptr %tape"]
        lines += self._slots()
        lines.append(f"  br label %{next(iter(self.function.blocks))}")
        for n, (label, block) in enumerate(self.function.blocks.items()):
            lines.append(f"{label}:")
            record = reverse.get(label)
            for phi in block.phis:
                lines.append("  " + clean(phi.text))
            if record is not None and record.switch:
                pairs = ", ".join(f"[ {record.sources.index(source)}, %{source} ]" for source in block.sources)
                lines.append(f"  %from.{n} = phi i64 {pairs}")
            for each in block.body:
                lines += self._repeat(each)
            if record is not None:
                lines += record.push(n)
            if block.end.startswith("ret"):
                if reverse and len(self.returns) > 1:
                    lines += pushed(f"end.{n}", [("i64", str(self.returns.index(label)), 0)], self.unit, self.unit)
                if reverse and self.unit == NUMBER:
                    lines += [re.sub(r"%pad\.", f"%pad.{n}.", line) for line in padded()]
                lines += [f"  %tape.end{n} = load ptr, ptr %tape", f"  store ptr %tape.end{n}, ptr %base"]
            lines.append("  " + clean(block.end))
        return "\n".join([*lines, "}", ""])

    def _repeat(self, each: Instruction, *, recorded: bool = True) -> list[str]:
        if each.operation == "alloca" and each.name in self.slots:
            return []
        if each.operation != "call":
            return ["  " + clean(each.text)]
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
        passed = ", ".join(["ptr %base", *(f"{o.kind} {o.name}" for o in each.operands)])
        made = f"{each.name} = " if each.name else ""
        if not (recorded and self.recorded(each)):
            return [f"  {made}call {each.kind} {callee.plain()}({passed})"]
        self.module.emitter.count += 1
        k = self.module.emitter.count
        return [
            f"  %tape.b{k} = load ptr, ptr %tape",
            f"  store ptr %tape.b{k}, ptr %base",
            f"  {made}call {each.kind} {callee.forward}({passed})",
            f"  %tape.a{k} = load ptr, ptr %base",
            f"  store ptr %tape.a{k}, ptr %tape",
        ]

    def _backward(self, reverse: dict[str, Reverse]) -> str:
        plain = [o for o in self.function.arguments if not is_float(o.kind)]
        arguments = ", ".join(["ptr %base", *(f"{o.kind} {o.name}" for o in plain)])
        lines = [f"define internal {self.result} {self.backward}({arguments}) noinline {{", "start:"]
        lines += ["  %tape = alloca ptr", "  %tape.0 = load ptr, ptr %base", "  store ptr %tape.0, ptr %tape"]
        lines += self._slots()
        kinds = {o.name: o.kind for o in self.floats} | {name: self.made[name].kind for name in self.made}
        for name in sorted(self.across | {o.name for o in self.floats}):
            lines += [f"  %a.{name[1:]} = alloca {kinds[name]}"]
            lines += [f"  store {kinds[name]} zeroinitializer, ptr %a.{name[1:]}"]
        lines += [f"  {name} = alloca {kind}" for name, kind in self.kept.items()]
        lines += unpadded() if self.unit == NUMBER else []
        if len(self.returns) > 1:
            lines += [*popped("end", self.unit), "  %end = load i64, ptr %tape.end"]
            cases = " ".join(f"i64 {k}, label %r.{label}" for k, label in enumerate(self.returns))
            lines.append(f"  switch i64 %end, label %r.{self.returns[0]} [ {cases} ]")
        else:
            lines.append(f"  br label %r.{self.returns[0]}")
        for label in reversed(self.function.blocks):
            lines += reverse[label].lines()
        return "\n".join([*lines, "}", ""])


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
