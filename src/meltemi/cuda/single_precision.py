"""Evaluations in single precision: a pass over the LLVM code of the kernels.

Every number that these kernels load or compute is rounded to single precision. The compiler then uses single-precision
instructions with equal results: the rounded double-precision sum, product, quotient or root of single-precision
numbers equals the single-precision one. States, time, controller, output and statistics stay in double
precision.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

EVALUATION = re.compile(r"_ZN7meltemi(?:4aero|9structure|4wind|5maths|8compiler|10simulation6blades)")
"""Beginning of the names of the kernels that evaluate wind, aerodynamics and structure."""
_FLAG = r"(?:(?:nsz|arcp|contract|nnan|ninf|reassoc|afn|fast) )*"
_NUMBER = re.compile(
    r'(\s+)(%(?:"[^"]+"|[\w.$-]+)) = '
    rf"((?:f(?:add|sub|mul|div|neg) {_FLAG}|(?:tail )?call {_FLAG}|load )(double|<\d+ x double>)[ ,].*)"
)


def rounded(text: str) -> str:
    """LLVM code in which the kernels of an evaluation round all numbers to single precision."""
    lines, inside = [], False
    for n, line in enumerate(text.splitlines()):
        if line.startswith("define"):
            inside = bool(EVALUATION.search(line))
        match = _NUMBER.fullmatch(line) if inside else None
        if match is None:
            lines.append(line)
        else:
            margin, name, operation, kind = match.groups()
            single = kind.replace("double", "float")
            lines.append(f"{margin}%wide.{n} = {operation}")
            lines.append(f"{margin}%narrow.{n} = fptrunc {kind} %wide.{n} to {single}")
            lines.append(f"{margin}{name} = fpext {single} %narrow.{n} to {kind}")
    return "\n".join(lines)


@contextmanager
def on_card() -> Iterator[None]:
    """Context in which numba-cuda compiles code with rounding."""
    from numba.cuda.cudadrv import nvvm

    compile_ir = nvvm.compile_ir

    def compile_rounded(code: Any, **options: Any) -> Any:
        return compile_ir([rounded(text) for text in ([code] if isinstance(code, str) else code)], **options)

    nvvm.compile_ir = compile_rounded
    try:
        yield
    finally:
        nvvm.compile_ir = compile_ir
