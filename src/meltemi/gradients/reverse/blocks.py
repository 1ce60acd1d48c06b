"""The adjoint of one block of instructions, and what the block has to record for it."""

from __future__ import annotations

from meltemi.core.errors import InputError
from meltemi.gradients.reverse.analysis import AGAIN, ARITHMETIC, FunctionAnalysis
from meltemi.gradients.reverse.code import (
    NOTHING,
    BasicBlock,
    Instruction,
    Operand,
    is_float,
    lanes_of,
    no_rule,
    printed,
    size_of,
)
from meltemi.gradients.reverse.rules import FUNCTIONS, constant, terms
from meltemi.gradients.reverse.tape import SHADOW, popped, pushed

AGAIN_IF_INTEGER = ("select", "extractelement", "insertelement", "shufflevector", "bitcast")


class Reverse:
    """The adjoint of one block.

    Attributes:
      saved: values, and their types, that the block records.
      kept: values, their types, and the numbers of the loops that keep them.
      left: loops that the block follows, which it records.
      across: values whose adjoints pass from block to block.
    """

    def __init__(self, part: FunctionAnalysis, block: BasicBlock, again: frozenset[str]) -> None:
        self.part, self.block, self.again = part, block, again
        self.sources = list(dict.fromkeys(block.sources))
        self.switch = len(self.sources) > 1
        self.e = part.module.emitter
        self.saved: dict[str, str] = {}
        self.kept: dict[str, tuple[str, int]] = {}
        self.left: dict[str, tuple[str, int]] = {}
        self.across: set[str] = set()
        self.known: dict[str, str] = {}
        self.sums: dict[str, str] = {}
        self.before: list[str] = []

    # values of the forward pass

    def value(self, name: str) -> str:
        """Name, in the adjoint, of a value of the forward pass."""
        part = self.part
        if not name.startswith("%"):
            return printed(name, self.value)
        if name in self.known:
            return self.known[name]
        each = part.results.get(name)
        if each is None:
            kind = part.kinds[name]
            return self._save(name, kind) if is_float(kind) else name
        if each.operation == "alloca":
            return name if name in part.slots else "null"
        if not (name in self.again or self._repeated(each)):
            return self._save(name, each.kind)
        text = printed(each.code, self.value)
        self.e.count += 1
        self.known[name] = f"%t{self.e.count}"
        self.before.append(f"  %t{self.e.count} = {text}")
        return self.known[name]

    def _repeated(self, each: Instruction) -> bool:
        """Whether an operation is always repeated rather than recorded."""
        number = is_float(each.kind)
        if each.operation == "load":
            return self.part.fixed(each.operands[0].name) if number else each.invariant
        with_numbers = number or any("double" in o.kind for o in each.operands)
        return each.operation in AGAIN or (each.operation in AGAIN_IF_INTEGER and not with_numbers)

    def _save(self, name: str, kind: str) -> str:
        loop = self.part.loop_without(self.block.label, name)
        if loop is not None:
            self.kept[name] = kind, loop
            self.e.count += 1
            self.known[name] = f"%t{self.e.count}"
            self.before.append(f"  %t{self.e.count} = load {kind}, ptr %k.{loop}.{name[1:]}")
            return self.known[name]
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
        total = self.sums.pop(each.name, None)
        if self._local(each):
            return total
        self.across.add(each.name)
        at = f"%a.{each.name[1:]}"
        old = self.e.new(f"load {each.kind}, ptr {at}")
        self.e.do(f"store {each.kind} zeroinitializer, ptr {at}")
        return old if total is None else self.e.op("fadd", each.kind, old, total)

    def _local(self, each: Instruction) -> bool:
        label = self.block.label
        return each.operation != "phi" and all(
            u.operation not in ("phi", "end") and self.part.homes[u] == label
            for u in self.part.users.get(each.name, [])
        )

    def shadow(self, pointer: str) -> str:
        """Address of the adjoint of what is at an address."""
        return self.e.new(f"getelementptr i8, ptr {self.value(pointer)}, i64 {SHADOW}")

    def emit(self) -> Reverse:
        """Generate the adjoint of the block."""
        part, e = self.part, self.e
        keep, e.lines = e.lines, []
        for each in reversed(self.block.body):
            self._adjoint(each)
        phis = [(phi, self.take(phi)) for phi in self.block.phis if phi.name in part.active]
        for name, total in list(self.sums.items()):
            self._flush(name, total)
        self.sums.clear()
        body, e.lines = e.lines, []
        edges = []
        incoming = {phi: dict(zip(phi.sources, (o.name for o in phi.operands), strict=True)) for phi, _ in phis}
        for source in self.sources:
            e.lines = []
            for phi, adjoint in phis:
                name = incoming[phi][source]
                if adjoint is not None and name in part.active:
                    self._flush(name, adjoint)
            edges.append((source, e.lines))
        self.body, self.edges, e.lines = body, edges, keep
        return self

    def _flush(self, name: str, total: str) -> None:
        part = self.part
        kind = part.results[name].kind if name in part.results else part.kinds[name]
        self.across.add(name)
        at = f"%a.{name[1:]}"
        old = self.e.new(f"load {kind}, ptr {at}")
        self.e.do(f"store {kind} {self.e.op('fadd', kind, old, total)}, ptr {at}")

    def _adjoint(self, each: Instruction) -> None:  # noqa: C901 - a rule for each instruction
        e, kind, operation, x = self.e, each.kind, each.operation, each.operands
        if operation == "store":
            if is_float(kind) and not self.part.inert(x[1].name):
                at, align = self.shadow(x[1].name), aligned(each)
                if x[0].name in self.part.active:
                    self.add(x[0], kind, e.new(f"load {kind}, ptr {at}{align}"))
                e.do(f"store {kind} zeroinitializer, ptr {at}{align}")
            return
        if operation == "call":
            self._adjoint_of_call(each)
            return
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
                at, align = self.shadow(x[0].name), aligned(each)
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
            raise no_rule(each.text, self.part.function.kernel)

    def _of(self, each: Instruction, i: int) -> str:
        return self.value(each.name if i < 0 else each.operands[i].name)

    def _adjoint_of_shuffle(self, each: Instruction, a: str) -> None:
        e, (x, y, mask) = self.e, each.operands
        n, m = lanes_of(x.kind), lanes_of(mask.kind)
        places = mask_of(mask.name, m)
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

    def _adjoint_of_call(self, each: Instruction) -> None:  # noqa: C901 - a rule for each function
        e, part, x = self.e, self.part, each.operands
        if NOTHING.match(each.callee):
            return
        callee = part.module.parts.get(each.callee)
        if callee is not None:
            if part.recorded(each):
                self._adjoint_of_kernel(each, callee)
            return
        name = each.function
        if name.startswith("memset"):
            if not part.inert(x[0].name):
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
        places, m = self._shadows(at), f"{mask.kind} {self.value(mask.name)}"
        back = {"masked.store": "masked.load", "masked.scatter": "masked.gather"}[name]
        suffix = f"v{lanes_of(kind)}f64.{'p0' if at.kind == 'ptr' else f'v{lanes_of(kind)}p0'}"
        e.declared.add(f"declare {kind} @llvm.{back}.{suffix}({at.kind}, {mask.kind}, {kind})")
        e.declared.add(f"declare void @llvm.{name}.{suffix}({kind}, {at.kind}, {mask.kind})")
        align = f"{at.kind} align 8 {places}"
        term = e.new(f"call {kind} @llvm.{back}.{suffix}({align}, {m}, {kind} zeroinitializer)")
        self.add(x, kind, term)
        e.do(f"call void @llvm.{name}.{suffix}({kind} zeroinitializer, {align}, {m})")

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
            suffix = f"v{lanes_of(kind)}f64.p0"
            e.declared.add(f"declare {kind} @llvm.masked.load.{suffix}(ptr, {mask.kind}, {kind})")
            e.declared.add(f"declare void @llvm.masked.store.{suffix}({kind}, ptr, {mask.kind})")
            pointers, where = f"ptr align 8 {places}", f"{m[0]} {m[1]}"
            old = e.new(f"call {kind} @llvm.masked.load.{suffix}({pointers}, {where}, {kind} zeroinitializer)")
            new = e.op("fadd", kind, old, part)
            e.do(f"call void @llvm.masked.store.{suffix}({kind} {new}, {pointers}, {where})")
            return
        for i in range(lanes_of(kind)):
            p = e.new(f"extractelement {at.kind} {places}, i64 {i}")
            on = e.new(f"extractelement {m[0]} {m[1]}, i64 {i}")
            p = e.new(f"select i1 {on}, ptr {p}, ptr {e.new(f'getelementptr i8, ptr %base, i64 {64 + SHADOW}')}")
            old = e.new(f"load double, ptr {p}, align 8")
            e.do(
                f"store double {e.op('fadd', 'double', old, e.new(f'extractelement {kind} {part}, i64 {i}'))}, ptr {p}"
            )

    def _adjoint_of_kernel(self, each: Instruction, callee: FunctionAnalysis) -> None:
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
        entries, at = [], 0
        for name, kind in sorted(self.recorded.items(), key=lambda item: -size_of(item[1])[0]):
            size, align = size_of(kind)
            align = min(align, self.part.unit)
            at = -(-at // align) * align
            entries.append((kind, name, at))
            at += size
        if self.switch:
            at = -(-at // 8) * 8
            entries.append(("i64", "from", at))
            at += 8
        return entries, -(-at // self.part.unit) * self.part.unit

    @property
    def recorded(self) -> dict[str, str]:
        """Values that the block records, with their types."""
        return self.saved | {name: kind for name, (kind, _) in self.left.items()}

    def push(self, n: int) -> list[str]:
        """Code of the forward pass that records."""
        entries, size = self.record()
        values = [(k, f"%from.{n}" if name == "from" else name, at) for k, name, at in entries]
        return pushed(str(n), values, size, self.part.unit)

    def lines(self) -> list[str]:
        """Code of the adjoint."""
        part, label = self.part, self.block.label
        entries, size = self.record()
        lines = [f"r.{label}:"]
        if entries:
            lines += popped(label, size)
            for kind, name, at in entries:
                lines.append(f"  %p.{label}.{at} = getelementptr i8, ptr %tape.{label}, i64 {at}")
                short = "from" if name == "from" else name[1:]
                align = min(size_of(kind)[1], part.unit)
                lines.append(f"  %s.{label}.{short} = load {kind}, ptr %p.{label}.{at}, align {align}")
                if name in self.left:
                    lines.append(f"  store {kind} %s.{label}.{short}, ptr %k.{self.left[name][1]}.{short}")
        lines += self.before + self.body
        if label == next(iter(part.function.blocks)):
            lines += ["  %tape.last = load ptr, ptr %tape", "  store ptr %tape.last, ptr %base"]
            result, value = part.result, "poison"
            for k, o in enumerate(part.floats):
                lines.append(f"  %x.{k} = load {o.kind}, ptr %a.{o.name[1:]}")
                lines.append(f"  %y.{k} = insertvalue {result} {value}, {o.kind} %x.{k}, {k}")
                value = f"%y.{k}"
            lines.append(f"  ret {result} {value}" if part.floats else "  ret void")
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


def aligned(each: Instruction) -> str:
    """The alignment that an access to memory states, as code."""
    return f", align {each.align}" if each.align else ""


def mask_of(text: str, m: int) -> list[int]:
    """Places that a shuffle takes, -1 where it takes any."""
    if text == "zeroinitializer":
        return [0] * m
    if text in ("poison", "undef"):
        return [-1] * m
    if text.startswith("splat"):
        return [int(text[:-1].rsplit(" ", 1)[1])] * m
    return [int(w.split()[1]) if w.split()[1].isdigit() else -1 for w in text[1:-1].split(", ")]
