"""Kernels take the record with the fewest members at which they do the same."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numba
import numpy as np
import pytest

from meltemi.compiler import Array1, KernelRecord, RecordType, by_record, hook, joined, kernel, members

pytestmark = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="compares compiled types")


class Machine(KernelRecord):
    x: Array1


class WithPart(Machine):
    y: Array1


class Beside(KernelRecord):
    """A part that does not extend the machine."""

    x: Array1
    z: Array1


@hook
def outer(m: Machine) -> None:
    """Act."""


@outer.variant
@kernel
def _(m: WithPart) -> None:
    m.x[0] += m.y[0]


@by_record
def weight(m: Machine) -> float:
    raise NotImplementedError


@weight.variant
@kernel
def _(m: Machine) -> float:
    return 2.0


@kernel
def double(m: Machine) -> None:
    m.x[0] *= weight(m)


@kernel
def act(m: Machine) -> None:
    outer(m)


inner, outer_module = ModuleType("inner"), ModuleType("outer")
inner.act, inner.back, outer_module.inner = act, outer_module, inner  # type: ignore[attr-defined]


@kernel
def act_within(m: Machine) -> None:
    outer_module.inner.act(m)  # type: ignore[attr-defined]


@kernel
def given(function: Any, m: Machine) -> None:
    function(m)


@kernel
def whole(m: Machine) -> None:
    double(m)
    act_within(m)
    given(act, m)


def record(cls: type[KernelRecord], **arrays: list[float]) -> Any:
    return cls("floats", {name: np.array(values) for name, values in arrays.items()})


def taken(function: Callable[..., Any]) -> set[type[KernelRecord]]:
    """Classes of records for which a kernel was compiled when kernels called it."""
    signatures = function.get_call_template.__closure__  # type: ignore[attr-defined]
    linked = next(c.cell_contents.__self__ for c in signatures if hasattr(c.cell_contents, "__self__"))
    return {kind.cls for args in linked.overloads for kind in args if isinstance(kind, RecordType)}


def test_kernels_that_a_part_does_not_change_are_shared_and_others_are_not() -> None:
    plain, parted = record(Machine, x=[3.0]), record(WithPart, x=[3.0], y=[10.0])
    whole(plain)
    whole(parted)
    assert plain.x[0] == 6.0
    assert parted.x[0] == 26.0  # the part acts once by name, once by the function that is passed
    assert taken(double) == {Machine}
    assert taken(act) == taken(act_within) == taken(given) == {Machine, WithPart}


def test_joined_records_begin_with_the_machine() -> None:
    both = joined(Machine, Beside, WithPart)
    assert list(members(both)) == ["x", "y", "z"]
    assert both.__bases__ == (WithPart, Beside)
    run = record(both, x=[1.0], y=[5.0], z=[7.0])
    whole(run)
    assert run.x[0] == 12.0
    assert taken(double) == {Machine}
