"""Tables within tables: the layout of a vector by names, in plain Python, floats and duals."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import pytest
from kernel_arrays import call

import meltemi.control  # noqa: F401 - by it kernels know what a table of a vector is
from meltemi.compiler import Entries, Numbers, Table, blades, flaps, kernel, number, numbers, part, parts, series
from meltemi.core.errors import InputError


class Axis(Table, title="test axis"):
    """Fixed length."""

    gain: float = number("-", "gain")
    sum: float = number("-", "sum")


class Ring(Table, title="test ring"):
    """Variable length."""

    room: float = number("-", "entries")
    oldest: float = number("-", "place")
    value: Numbers = series("-", "values", "room")


class Law(Table, title="test law"):
    """Numbers, entries with names, parts of fixed and of variable length."""

    speed: float = number("rad/s", "speed")
    moment: Numbers = blades("N m", "moments")
    flap: Numbers = flaps("rad", "flaps")
    limit: Numbers = numbers("-", "limits", ("low", "high"))
    tilt: Axis = part(Axis)
    own: Axis = part(Axis, prefix="")
    axes_: Entries[Axis] = parts(Axis, 2, prefix="axis")
    loops: float = number("-", "how many")
    n: float = number("-", "rows of the grid")
    m: float = number("-", "columns of the grid")
    loop: Entries[Axis] = parts(Axis, "loops")
    grid: Numbers = series("-", "grid", "n", "m")
    rings: Entries[Ring] = parts(Ring, 2, prefix="ring")
    last: Ring = part(Ring)


def example() -> Any:
    rings = [Ring.of(value=[10.0 * k + i for i in range(3)]) for k in range(2)]
    return Law.of(
        speed=2.0,
        moment=[1.0, 2.0, 3.0],
        limit=[-1.0, 1.0],
        tilt=Axis.of(gain=5.0),
        loop=[Axis.of(gain=7.0, sum=8.0), Axis.of(gain=9.0)],
        grid=np.arange(6.0).reshape(2, 3),
        rings=rings,
        last=Ring.of(oldest=1.0, value=[4.0, 5.0]),
    )


@kernel
def bump(axis: Any, by: float) -> None:
    axis.sum += axis.gain * by


@kernel
def step(array: Any, by: float) -> float:
    x = Law(array)
    x.speed = x.speed + by
    x.moment[1] += 10.0
    x.flap[3, 2] = x.moment[0]
    x.limit[1] = 2.0 * x.limit[0]
    bump(x.tilt, by)
    bump(x.own, by)
    x.axes_[1].gain = 1.5
    bump(x.axes_[1], by)
    for i in range(2):
        bump(x.loop[i], by)
    x.grid[1, 2] += x.grid[0, 1]
    for i in range(2):
        x.rings[i].value[2] += 1.0
    x.last.value[int(by)] = x.rings[1].value[0]
    x.array[0] += 1.0
    return x.speed


def test_lengths_and_names_follow_from_the_declaration() -> None:
    x = example()
    assert len(Law) == 1 + 3 + 12 + 2 + 2 + 2 + 4 + 3
    assert Law.extent(x.array) == len(x.array) == len(Law) + 4 + 6 + 2 * 5 + 4
    names = Law.names_of(x.array)
    assert len(names) == len(set(names)) == len(x.array)
    assert names[:5] == ("speed", "moment_1", "moment_2", "moment_3", "flap_1_1")
    assert names[16:26] == (
        *("limit_low", "limit_high", "tilt_gain", "tilt_sum", "gain", "sum"),
        *("axis_1_gain", "axis_1_sum", "axis_2_gain", "axis_2_sum"),
    )
    assert names[29:33] == ("loop_1_gain", "loop_1_sum", "loop_2_gain", "loop_2_sum")
    assert names[33:39] == tuple(f"grid_{i}_{j}" for i in (1, 2) for j in (1, 2, 3))
    assert names[-4:] == ("last_room", "last_oldest", "last_value_1", "last_value_2")
    assert (x.loops, x.n, x.m, x.last.room) == (2.0, 2.0, 3.0, 2.0)


def expected() -> Any:
    x = example()
    step_in_python = step if numba.config.DISABLE_JIT else step.py_func
    plain = bump if numba.config.DISABLE_JIT else bump.py_func
    step_in_python.__globals__["bump"], kept = plain, step_in_python.__globals__["bump"]
    try:
        step_in_python(x.array, 1.0)
    finally:
        step_in_python.__globals__["bump"] = kept
    return x


def test_names_in_plain_python() -> None:
    x, begin = expected(), example()
    changed = {n: (b, a) for n, a, b in zip(Law.names_of(x.array), x.array, begin.array, strict=True) if a != b}
    assert changed == {
        "speed": (2.0, 4.0),
        "moment_2": (2.0, 12.0),
        "flap_4_3": (0.0, 1.0),
        "limit_high": (1.0, -2.0),
        "tilt_sum": (0.0, 5.0),
        "axis_2_gain": (0.0, 1.5),
        "axis_2_sum": (0.0, 1.5),
        "loop_1_sum": (8.0, 15.0),
        "loop_2_sum": (0.0, 9.0),
        "grid_2_3": (5.0, 6.0),
        "ring_1_value_3": (2.0, 3.0),
        "ring_2_value_3": (12.0, 13.0),
        "last_value_2": (5.0, 10.0),
    }


def test_kernels_read_the_same_names() -> None:
    x = example()
    step(x.array, 1.0)
    np.testing.assert_array_equal(x.array, expected().array)
    bump(x.loop[1], 2.0)  # a part is passed on from Python
    assert x.loop[1].sum == 27.0


@pytest.mark.slow
@pytest.mark.skipif(numba.config.DISABLE_JIT, reason="duals need compiled kernels")
def test_derivatives_go_along() -> None:
    x = example()
    slopes = np.zeros((len(x.array), 8))
    names = Law.names_of(x.array)
    slopes[names.index("loop_2_gain"), 3] = 1.0
    slopes[names.index("ring_2_value_1"), 5] = 2.0

    call(lambda duals: step(duals, 1.0), x.array, kind="duals", slopes=(slopes,))
    np.testing.assert_array_equal(x.array, expected().array)
    assert {(names[i], k): slopes[i, k] for i, k in np.argwhere(slopes)} == {
        ("loop_2_gain", 3): 1.0,
        ("loop_2_sum", 3): 1.0,
        ("ring_2_value_1", 5): 2.0,
        ("last_value_2", 5): 2.0,
    }


def test_refusals() -> None:
    with pytest.raises(ValueError, match="must precede those of variable length"):

        class Wrong(Table):
            n: float = number("-", "how many")
            value: Numbers = series("-", "values", "n")
            after: float = number("-", "too late")

    with pytest.raises(InputError, match="did you mean 'speed'"):
        Law.of(sped=1.0)


def test_places_as_of_the_array() -> None:
    """A user-defined controller may take entries by number and in slices."""

    @kernel
    def swap(array: Any) -> float:
        x = Law(array)
        x[1:4] = x[1] + x[2]
        x[0] = float(len(x))
        return x[0] - 1.0

    x = example()
    assert swap(x.array) == len(x) - 1.0
    assert list(x[:4]) == [len(x.array), 3.0, 3.0, 3.0]


def test_a_table_may_be_declared_anew() -> None:
    """As by a cell of a notebook that runs again: the layout is that of the new class."""

    def place(names: str) -> float:
        fields = {name: number("-", name) for name in names.split()}
        again: Any = type(Table)("Again", (Table,), fields)

        @kernel
        def read(array: Any) -> Any:
            return again(array).wanted

        return float(read(np.arange(3.0)))

    assert [place("wanted other last"), place("other last wanted"), place("other wanted last")] == [0.0, 2.0, 1.0]
