"""Numbers of a load case table as text: ``V_in to V_out by 2, V_r``, ``V_r +- 2``, ``0 to 345 by 15``."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from meltemi.core.errors import did_you_mean

SYMBOLS = ("V_in", "V_r", "V_out", "V_ref", "V_maint", "yaw_error")
"""Names that a text may use: speeds of the turbine and its class, and the usual yaw error."""
EXAMPLE = "'V_in to V_out by 2, V_r', 'V_r +- 2' or '-8, 0, 8'"
MOST = 1000
"""Largest number of values of one text."""
TOKEN = re.compile(r"\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)|([A-Za-z_]+)|(\+-|\+/-|[-+*]))")


def numbers(text: str, values: Mapping[str, float], *, once: bool = True) -> tuple[float, ...]:
    """Numbers that a text describes, in the order of the text.

    Items are separated by commas. An item is a sum such as ``0.7 V_ref`` or ``V_r - 2``; ``a +- b`` is a - b and a + b;
    ``a to b by c`` are a, a + c, ... below b, and b itself, exactly.

    Args:
      text: numbers as text; angles in degrees.
      values: values of the names in ``SYMBOLS``.
      once: whether repetitions are left out.

    Raises:
      ValueError: the text cannot be read, or describes a range that does not ascend.
    """
    result: list[float] = []
    for part in text.split(","):
        if not (item := _tokens(part, text)):
            raise ValueError(f"{text!r}: an item is empty; expected a text such as {EXAMPLE}")
        for value in _item(item, text, values):
            if not once or not any(abs(value - other) <= 1e-9 * max(1.0, abs(value)) for other in result):
                result.append(value)
    return tuple(result)


def _tokens(part: str, text: str) -> list[str]:
    """Numbers, names and signs in a part of a text."""
    tokens, at = [], 0
    while part[at:].strip():
        match = TOKEN.match(part, at)
        if match is None:
            raise ValueError(f"{text!r}: cannot read {part[at:].strip()!r}; expected a text such as {EXAMPLE}")
        tokens.append(match[0].strip().replace("+/-", "+-"))
        at = match.end()
    return tokens


def _item(tokens: list[str], text: str, values: Mapping[str, float]) -> list[float]:
    if "to" not in tokens:
        return _sum(tokens, text, values)
    to = tokens.index("to")
    by = tokens.index("by") if "by" in tokens else -1
    parts = (tokens[:to], tokens[to + 1 : by], tokens[by + 1 :]) if by > to else ()
    if not parts or not all(parts):
        raise ValueError(f"{text!r}: a range is written 'a to b by c', for instance 'V_in to V_out by 2'")
    first, last, step = (_one(part, text, values) for part in parts)
    if not (step > 0.0 and last >= first and (last - first) / step < MOST):
        raise ValueError(f"{text!r}: the range goes from {first:g} to {last:g} by {step:g}, which does not ascend")
    n = math.ceil((last - first) / step - 1e-9)
    return [first + i * step for i in range(n)] + [last]


def _one(tokens: list[str], text: str, values: Mapping[str, float]) -> float:
    if "+-" in tokens:
        raise ValueError(f"{text!r}: no '+-' within a range")
    return _sum(tokens, text, values)[0]


def _sum(tokens: list[str], text: str, values: Mapping[str, float]) -> list[float]:
    """Sum of products of numbers and names; two values with ``+-``."""
    totals, sign, term = [0.0], "+", None
    for token in [*tokens, "end"]:
        if token in ("+", "-", "+-", "end"):
            if term is None:
                if sign != "+" or token in ("+-", "end") or totals != [0.0]:
                    raise ValueError(f"{text!r}: a number is missing; expected a text such as {EXAMPLE}")
            elif sign == "+-":
                totals = [t + s * term for t in totals for s in (-1.0, 1.0)]
            else:
                totals = [t + (term if sign == "+" else -term) for t in totals]
            sign, term = token, None
        elif token != "*":
            term = (1.0 if term is None else term) * _value(token, text, values)
    return totals


def _value(token: str, text: str, values: Mapping[str, float]) -> float:
    if not token[0].isalpha():
        return float(token)
    if token not in values:
        raise ValueError(f"{text!r}: unknown name {token!r}; {did_you_mean(token, SYMBOLS)}")
    return values[token]


def counts(text: str, values: Mapping[str, float]) -> list[tuple[float, int]]:
    """Numbers of seeds and the speeds [m/s] from which they count: ``6, 15 from V_r - 2``.

    Raises:
      ValueError: it cannot be read.
    """
    rules: list[tuple[float, int]] = []
    for part in str(text).split(","):
        number, *rest = part.split(" from ")
        if not number.strip().isdigit() or not 1 <= int(number) <= MOST or len(rest) > 1 or (not rest) == bool(rules):
            raise ValueError(f"{text!r}: expected numbers of seeds such as '6' or '6, 15 from V_r - 2'")
        rules.append((_one(_tokens(rest[0], rest[0]), rest[0], values) if rest else -math.inf, int(number)))
    return rules
