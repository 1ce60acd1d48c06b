"""The code of the functions that belong to one function: forward, which records, its adjoint, and the plain one."""

from __future__ import annotations

import re
from collections.abc import Mapping

from meltemi.core.errors import InputError
from meltemi.gradients.reverse.analysis import FunctionAnalysis
from meltemi.gradients.reverse.blocks import Reverse
from meltemi.gradients.reverse.code import NOTHING, Instruction, is_float, no_rule, size_of
from meltemi.gradients.reverse.tape import NUMBER, VECTOR, padded, popped, pushed, unpadded

_TAPE = ["  %tape = alloca ptr", "  %tape.0 = load ptr, ptr %base", "  store ptr %tape.0, ptr %tape"]


def code_of_part(part: FunctionAnalysis) -> list[str]:
    """The recording function, and its adjoint if it has one."""
    part.analyse()
    if not part.touches:
        return [_forward(part, {})] if part.function.name == part.module.order[-1] else []
    reverse = _reversed_blocks(part)
    vectors = [any(size_of(k)[0] >= VECTOR for k in r.recorded.values()) for r in reverse.values() if r.recorded]
    called = (part.module.parts[call.callee].unit for call in part.calls if part.recorded(call))
    part.unit = VECTOR if 2 * sum(vectors) > len(vectors) else max(called, default=NUMBER)
    return [_forward(part, reverse), _backward(part, reverse)]


def _reversed_blocks(part: FunctionAnalysis) -> dict[str, Reverse]:
    """The adjoints of the blocks: a first round shows what each of them needs, so that less is recorded."""
    blocks = part.function.blocks
    first = {label: Reverse(part, block, frozenset()).emit() for label, block in blocks.items()}
    part.across = set().union(*(r.across for r in first.values()))
    reverse = {
        label: Reverse(part, block, part.again({**first[label].saved, **first[label].kept})).emit()
        for label, block in blocks.items()
    }
    for r in reverse.values():
        for name, (kind, loop) in r.kept.items():
            part.kept[f"%k.{loop}.{name[1:]}"] = kind
            for label in part.loops[loop][1]:
                reverse[label].left[name] = kind, loop
    return reverse


def _slots(part: FunctionAnalysis) -> list[str]:
    return [f"  {name} = getelementptr i8, ptr %base, i64 {at}" for name, at in part.slots.items()]


def _head(part: FunctionAnalysis, name: str, *begin: str) -> list[str]:
    """Begin of a function with the arguments and blocks of the original."""
    arguments = ", ".join(["ptr %base", *(f"{o.kind} {o.name}" for o in part.function.arguments)])
    head = f"define internal {part.function.kind} {name}({arguments}) noinline {{"
    return [head, "start:", *begin, *_slots(part), f"  br label %{next(iter(part.function.blocks))}"]


def _plain(part: FunctionAnalysis) -> str:
    """Name of the function that records nothing, whose code is generated with its first use."""
    if part.plain not in part.module.plain:
        part.module.plain[part.plain] = ""
        lines = _head(part, part.plain)
        for label, block in part.function.blocks.items():
            lines += [f"{label}:", *(f"  {phi.text}" for phi in block.phis)]
            lines += [line for each in block.body for line in _repeat(part, each, recorded=False)]
            lines.append(f"  {block.end.code}")
        part.module.plain[part.plain] = "\n".join([*lines, "}", ""])
    return part.plain


def _forward(part: FunctionAnalysis, reverse: Mapping[str, Reverse]) -> str:
    lines = _head(part, part.forward, *_TAPE)
    for n, (label, block) in enumerate(part.function.blocks.items()):
        lines += [f"{label}:", *(f"  {phi.text}" for phi in block.phis)]
        record = reverse.get(label)
        if record is not None and record.switch:
            pairs = ", ".join(f"[ {record.sources.index(source)}, %{source} ]" for source in block.sources)
            lines.append(f"  %from.{n} = phi i64 {pairs}")
        for each in block.body:
            lines += _repeat(part, each, recorded=True)
        if record is not None:
            lines += record.push(n)
        if label in part.returns:
            if reverse and len(part.returns) > 1:
                lines += pushed(f"end.{n}", [("i64", str(part.returns.index(label)), 0)], part.unit, part.unit)
            if reverse and part.unit == NUMBER:
                lines += [re.sub(r"%pad\.", f"%pad.{n}.", line) for line in padded()]
            lines += [f"  %tape.end{n} = load ptr, ptr %tape", f"  store ptr %tape.end{n}, ptr %base"]
        lines.append(f"  {block.end.code}")
    return "\n".join([*lines, "}", ""])


def _repeat(part: FunctionAnalysis, each: Instruction, *, recorded: bool) -> list[str]:
    """An instruction of the original function; of a call, also the hand-over of the tape if it records."""
    if each.name in part.slots or NOTHING.match(each.callee):
        return []
    if each.operation != "call":
        return [f"  {each.text}"]
    emitter, callee = part.module.emitter, part.module.parts.get(each.callee)
    result = f"{each.name} = " if each.name else ""
    values = [f"{o.kind} {o.name}" for o in each.operands]
    if callee is None:
        _check(part, each)
        kinds = ", ".join(o.kind for o in each.operands)
        emitter.declared.add(f"declare {each.kind} {each.callee}({kinds})")
        return [f"  {result}call {each.kind} {each.callee}({', '.join(values)})"]
    passed = ", ".join(["ptr %base", *values])
    if not (recorded and part.recorded(each)):
        return [f"  {result}call {each.kind} {_plain(callee)}({passed})"]
    emitter.count += 1
    k = emitter.count
    return [
        f"  %tape.b{k} = load ptr, ptr %tape",
        f"  store ptr %tape.b{k}, ptr %base",
        f"  {result}call {each.kind} {callee.forward}({passed})",
        f"  %tape.a{k} = load ptr, ptr %base",
        f"  store ptr %tape.a{k}, ptr %tape",
    ]


def _check(part: FunctionAnalysis, call: Instruction) -> None:
    """Check that a function outside the module may be called in a code that is differentiated.

    Raises:
      InputError: the function may change memory, for instance because it allocates an array.
      MeltemiError: the address of the function is computed, so that its code is unknown.
    """
    if not call.callee:
        raise no_rule(call.text, part.function.kernel)
    if not call.callee.startswith("@llvm.") and ("ptr" in call.kind or any("ptr" in o.kind for o in call.operands)):
        name = call.callee[1:]
        what = "makes arrays" if name.startswith("NRT") else f"calls {name!r}"
        raise InputError(f"gradient: the controller {what}, of which there are no derivatives; keep them in its state")


def _backward(part: FunctionAnalysis, reverse: Mapping[str, Reverse]) -> str:
    plain = (f"{o.kind} {o.name}" for o in part.function.arguments if not is_float(o.kind))
    arguments = ", ".join(["ptr %base", *plain])
    lines = [f"define internal {part.result} {part.backward}({arguments}) noinline {{", "start:", *_TAPE]
    lines += _slots(part)
    kinds = part.kinds | {name: each.kind for name, each in part.results.items()}
    for name in sorted(part.across | {o.name for o in part.floats}):
        lines += [f"  %a.{name[1:]} = alloca {kinds[name]}"]
        lines += [f"  store {kinds[name]} zeroinitializer, ptr %a.{name[1:]}"]
    lines += [f"  {name} = alloca {kind}" for name, kind in part.kept.items()]
    lines += unpadded() if part.unit == NUMBER else []
    if len(part.returns) > 1:
        lines += [*popped("end", part.unit), "  %end = load i64, ptr %tape.end"]
        cases = " ".join(f"i64 {k}, label %r.{label}" for k, label in enumerate(part.returns))
        lines.append(f"  switch i64 %end, label %r.{part.returns[0]} [ {cases} ]")
    else:
        lines.append(f"  br label %r.{part.returns[0]}")
    for label in reversed(part.function.blocks):
        lines += reverse[label].lines()
    return "\n".join([*lines, "}", ""])
