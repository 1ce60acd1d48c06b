"""The table language: names, offsets, shapes and host-side views of arrays."""

from __future__ import annotations

import numpy as np
import pytest

from meltemi.compiler import (
    Numbers,
    Rot,
    Rotations,
    Sym,
    Symmetrics,
    Table,
    Vec,
    Vectors,
    View,
    blades,
    flaps,
    number,
    rotation,
    symmetric,
    xyz,
)
from meltemi.compiler.tables import TableRow
from meltemi.core.errors import InputError


class Example(Table, axes="blade node"):
    """Fields of all kinds."""

    chord: Numbers = number("m", "length of the section")
    force: Vectors = xyz("N", "on the node")
    frame: Rotations = rotation("-", "orientation")
    inertia: Symmetrics = symmetric("kg m^2", "about the node")
    pitch: Numbers = blades("rad", "of each blade")


def test_rows_stand_in_the_order_of_the_fields_with_parts_expanded() -> None:
    assert Example.names == (
        "chord",
        *(f"force_{part}" for part in "xyz"),
        *(f"frame_{row}{column}" for row in "xyz" for column in "xyz"),
        *(f"inertia_{part}" for part in ("xx", "yy", "zz", "xy", "xz", "yz")),
        *(f"pitch_{b}" for b in (1, 2, 3)),
    )
    assert len(Example) == 1 + 3 + 9 + 6 + 3


def test_every_part_keeps_unit_and_meaning() -> None:
    fields = {f.name: f for f in Example.rows}
    assert fields["chord"] == TableRow("chord", "m", "length of the section")
    for part in "xyz":
        assert fields[f"force_{part}"] == TableRow(f"force_{part}", "N", "on the node")


def test_index_of_a_vector_or_matrix_is_its_first_row() -> None:
    assert [Example.index(n) for n in ("chord", "force", "frame", "inertia", "pitch")] == [0, 1, 4, 13, 19]
    assert Example.index("force_z") == 3


def test_slots_give_offsets_for_several_names() -> None:
    assert Example.slots("pitch force_y chord") == (19, 2, 0)


def test_shape_follows_the_axes() -> None:
    assert Example.shape(blade=3, node=7) == (22, 3, 7)
    zeros = Example.zeros(blade=2, node=4)
    assert zeros.shape == (22, 2, 4)
    assert zeros.dtype == np.float64
    assert zeros.flags.c_contiguous
    assert not zeros.any()


def test_table_without_axes_is_a_vector() -> None:
    class Plain(Table):
        a: float = number("m", "one")
        b: float = number("m", "two")

    assert Plain.zeros().shape == (2,)


def test_vector_that_repeats_a_plain_field_is_refused() -> None:
    with pytest.raises(ValueError, match="'twice': a field name occurs twice"):

        class Twice(Table):
            a_x: float = number("m", "one")
            a: Vec = xyz("m", "again")


def test_unknown_field_is_answered_with_the_closest() -> None:
    with pytest.raises(InputError, match=r"example has no 'chrod': did you mean 'chord'"):
        Example.index("chrod")


def test_view_reads_a_row_or_all_rows_of_a_vector() -> None:
    array = np.arange(22.0 * 2 * 3).reshape(22, 2, 3)
    view = View(Example, array)
    assert np.shares_memory(view["chord"], array)
    np.testing.assert_array_equal(view["chord"], array[0])
    np.testing.assert_array_equal(view["force_y"], array[2])
    for name, rows in (("force", slice(1, 4)), ("frame", slice(4, 13)), ("pitch", slice(19, 22))):
        np.testing.assert_array_equal(view[name], array[rows])


def test_view_of_a_symmetric_matrix_has_six_rows() -> None:
    array = np.arange(22.0).reshape(22, 1, 1)
    np.testing.assert_array_equal(View(Example, array)["inertia"], array[13:19])


def test_view_writes_through_to_the_array_and_nowhere_else() -> None:
    array = Example.zeros(blade=2, node=3)
    view = View(Example, array)
    view["force"] = np.array([1.0, 2.0, 3.0])[:, None, None]
    view["chord"][1, 2] = 5.0
    expected = np.zeros_like(array)
    expected[1], expected[2], expected[3], expected[0, 1, 2] = 1.0, 2.0, 3.0, 5.0
    np.testing.assert_array_equal(array, expected)


def test_view_of_one_number_a_blade_spans_all_blades() -> None:
    class Plain(Table, title="demands"):
        pitch: Numbers = blades("rad", "of each blade")
        yaw: float = number("rad", "of the nacelle")

    array = Plain.zeros()
    View(Plain, array)["pitch"] = 0.2
    np.testing.assert_array_equal(array, [0.2, 0.2, 0.2, 0.0])


@pytest.mark.parametrize("name", ["forces", "Chord", "force_w"])
def test_view_refuses_unknown_names(name: str) -> None:
    view = View(Example, Example.zeros(blade=1, node=1))
    with pytest.raises(InputError, match="did you mean"):
        view[name]
    with pytest.raises(InputError, match="did you mean"):
        view[name] = 1.0


def test_view_names_its_fields() -> None:
    text = repr(View(Example, Example.zeros(blade=1, node=1)))
    assert text.startswith("<example: chord, force_x, ")


def all_tables() -> list[type[Table]]:
    """Every table of the package."""
    from meltemi.aero import tables as aero
    from meltemi.control import actuators, baseline, signals
    from meltemi.simulation import step
    from meltemi.structure import tables as structure
    from meltemi.turbine import exchange
    from meltemi.wind import velocity

    modules = (aero, actuators, baseline, signals, step, structure, exchange, velocity)
    found = {
        id(v): v
        for m in modules
        for v in vars(m).values()
        if isinstance(v, type) and issubclass(v, Table) and v is not Table
    }
    return list(found.values())


def test_every_table_of_the_package_describes_every_field() -> None:
    tables = all_tables()
    assert len(tables) > 20
    allowed = {"blade", "node", "mode", "pair", "station", "flap", "part", "coordinate", "polar", "angle"}
    for t in tables:
        assert set(t.axes) <= allowed, t.title
        for field in t.rows:
            assert field.name.isidentifier(), (t.title, field.name)
            assert field.unit, (t.title, field.name)
            assert field.doc, (t.title, field.name)


class Motion(Table, axes="blade node"):
    """A table as it is declared."""

    chord: Numbers = number("m", "length of the section")
    force: Vectors = xyz("N", "on the node")
    inertia: Symmetrics = symmetric("kg m^2", "about the node")


class Polars(Table, axes="polar angle", fields_last=True):
    """A table with its fields last."""

    lift: Numbers = number("-", "lift coefficient")
    drag: Numbers = number("-", "drag coefficient")


def test_fields_may_stand_last() -> None:
    array = np.arange(12.0).reshape(2, 3, 2)
    polars = Polars(array)
    assert (polars.polars, polars.angles) == (2, 3)
    assert Polars.shape(polar=2, angle=3) == array.shape
    assert (polars.lift[1, 2], polars.drag[1, 2]) == (10.0, 11.0)
    polars.drag[0, 1] = -1.0
    assert array[0, 1, 1] == -1.0
    with pytest.raises(ValueError, match="only fields of one number are allowed"):
        type("Wrong", (Table,), {"force": xyz("N", "of the wind")}, axes="polar", fields_last=True)


class Demands(Table):
    """Without axes."""

    pitch: Numbers = blades("rad", "of each blade")
    flap: Numbers = flaps("rad", "of each flap")
    yaw: float = number("rad", "of the nacelle")
    place: Vec = xyz("m", "of the hub")
    top: Rot = rotation("-", "of the tower")


def test_entries_of_fields_are_read_and_written_by_name() -> None:
    array = np.arange(10.0 * 2 * 3).reshape(10, 2, 3)
    motion = Motion(array)
    assert motion.chord[1, 2] == array[0, 1, 2]
    assert motion.force[1, 2] == Vec(*array[1:4, 1, 2])
    assert motion.inertia[0, 1] == Sym(*array[4:10, 0, 1])
    expected = array.copy()
    expected[0, 1, 2], expected[1:4, 0, 0], expected[4:10, 1, 1] = 5.0, [1.0, 2.0, 3.0], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    motion.chord[1, 2] = 5.0
    motion.force[0, 0] = Vec(1.0, 2.0, 3.0)
    motion.inertia[1, 1] = Sym(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    np.testing.assert_array_equal(array, expected)
    motion.force[0, 0] += 2.0 * Vec(1.0, 0.0, 0.0)
    assert motion.force[0, 0] == Vec(3.0, 2.0, 3.0)


def test_fields_without_axes_are_numbers_vectors_and_rotations() -> None:
    array = Demands.zeros()
    demands = Demands(array)
    demands.yaw, demands.place = 0.5, Vec(1.0, 2.0, 3.0)
    demands.top = Rot(*np.arange(9.0))
    demands.pitch[1], demands.flap[2, 1] = 0.1, 0.2
    rows = dict(zip(Demands.names, array, strict=True))
    assert rows == dict.fromkeys(Demands.names, 0.0) | {
        "yaw": 0.5, "place_x": 1.0, "place_y": 2.0, "place_z": 3.0, "pitch_2": 0.1, "flap_3_2": 0.2,
        **{f"top_{a}{b}": 3.0 * i + j for i, a in enumerate("xyz") for j, b in enumerate("xyz")},
    }  # fmt: skip
    assert (demands.yaw, demands.place, demands.pitch[1], demands.flap[2, 1]) == (0.5, Vec(1.0, 2.0, 3.0), 0.1, 0.2)
    assert demands.top @ Vec(1.0, 0.0, 0.0) == Vec(0.0, 3.0, 6.0)


def test_a_declared_table_knows_its_layout() -> None:
    assert (Motion.title, Motion.axes, len(Motion)) == ("motion", ("blade", "node"), 10)
    assert Motion.index("inertia") == 4 and Motion.rows[1] == TableRow("force_x", "N", "on the node")
    assert Demands.index("flap_1_3") == 5


def test_a_field_may_not_hide_what_a_table_has() -> None:
    with pytest.raises(ValueError, match="a field name occurs twice or is an attribute of tables"):

        class Wrong(Table):
            """A field called as a method."""

            shape: float = number("-", "of the tower")
