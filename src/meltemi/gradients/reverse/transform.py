"""From the code of a kernel to two functions: one that records what its adjoint needs, and the adjoint.

Every array is in one block of memory, and the adjoint of the number at an address is ``SHADOW`` bytes behind it. So
the adjoint of ``load`` adds to the shadow, and that of ``store`` takes from it. The values that an adjoint needs are
written, block by block of the code, onto a tape in the order of execution, and read backwards. Values that follow from
others, such as addresses, are computed again.

``grammar`` reads the code into records (``code``), ``simplify`` and ``analysis`` decide on them what has an adjoint,
``blocks`` has the adjoints by the rules of ``rules``, and ``printing`` writes the functions.

Reference: docs/theory/adjoint.md (J-3); Griewank & Walther (2008), Evaluating Derivatives, chapters 3, 4 and 6.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from meltemi.gradients.reverse.analysis import Module
from meltemi.gradients.reverse.code import is_float
from meltemi.gradients.reverse.grammar import globals_in, read
from meltemi.gradients.reverse.printing import code_of_part

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


@dataclass(frozen=True)
class ModuleCode:
    """LLVM code of a module.

    Attributes:
      text: the code.
      top: name of the function that is differentiated.
      kernels: names of the functions in Python, for messages.
    """

    text: str
    top: str
    kernels: Mapping[str, str]


def transformed(
    code: ModuleCode,
    records: Mapping[int, Any],
    arrays: Mapping[tuple[str, str], int | None],
    wanted: frozenset[str] | None,
) -> tuple[str, int]:
    """The code of the functions ``forward`` and ``backward``, and [bytes] memory that they use, before the arrays.

    Args:
      code: code of the function, with all that it calls.
      records: classes of the records among its arguments, by number of the argument.
      arrays: number of the array, in memory, of each member of a record by the names of record and member; members that
        overlap share it; None for one without derivatives.
      wanted: members by which derivatives are wanted though the code does not change them; by all if None.

    Raises:
      MeltemiError: the code has an instruction without a rule.
      InputError: the code calls a function without a derivative.
    """
    functions, variables = read(code.text, code.kernels)
    module = Module(functions, code.top, records, arrays, wanted)
    texts = [text for name in module.order for text in code_of_part(module.parts[name])]
    texts += module.plain.values()
    top = module.parts[code.top]
    inputs = ", ".join(f"{o.kind} {o.name}" for o in top.function.arguments if not is_float(o.kind))
    texts.append(
        f"define i32 @forward(ptr %base, {inputs}) {{\n"
        f"  %s = call i32 {top.forward}(ptr %base, {inputs})\n  ret i32 %s\n}}\n"
        f"define void @backward(ptr %base, {inputs}) {{\n  call {top.result} {top.backward}(ptr %base, {inputs})\n"
        "  ret void\n}\n"
    )
    body = "\n".join(texts)
    used = (variables[name] for name in sorted(globals_in(body) & variables.keys()))
    return "\n".join([*used, *sorted(module.emitter.declared), _LOOP, body, "!0 = !{}", ""]), module.used
