"""The grammar of compiled code: records of instructions, and clear messages for what it does not have."""

from __future__ import annotations

import pytest

from meltemi.compiler import llvm_version
from meltemi.core.errors import MeltemiError
from meltemi.gradients.reverse.code import Function, members_of, size_of
from meltemi.gradients.reverse.compiled import _readable
from meltemi.gradients.reverse.grammar import read
from meltemi.gradients.reverse.simplify import simplified

KERNELS = {"k0": "meltemi.control.baseline.law"}


def function(*rows: str, arguments: str = "ptr nocapture %p, double %x") -> Function:
    text = "\n".join([f"define internal i32 @k0({arguments}) local_unnamed_addr #0 {{", "entry:", *rows, "}", ""])
    functions, _ = read(text, KERNELS)
    return functions["@k0"]


def test_an_unknown_instruction_is_named_with_kernel_version_and_advice() -> None:
    with pytest.raises(MeltemiError) as error:
        function("  %y = va_arg ptr %p, double, !dbg !7", "  ret i32 0")
    message = str(error.value)
    assert "meltemi.control.baseline.law" in message
    assert "'%v3 = va_arg ptr %v0, double'" in message
    assert f"LLVM {llvm_version()}" in message
    assert "use sensitivity" in message


@pytest.mark.parametrize(
    "row",
    [
        "%y = fadd double %x",
        "%y = fadd double %x, %x, %x",
        "%y = fadd quad %x, %x",
        "%y = load double, ptr",
        "%y = select i1 true, double %x",
        "store double",
        "%y = insertvalue { double } poison, double %x, %x",
    ],
)
def test_rows_that_do_not_follow_the_grammar_are_refused(row: str) -> None:
    with pytest.raises(MeltemiError, match="without a rule"):
        function(f"  {row}", "  ret i32 0")


def test_instructions_become_records() -> None:
    read_function = function(
        '  %"a b" = load i64, ptr %p, align 8, !invariant.load !5, !noalias !1',
        '  %q = inttoptr i64 %"a b" to ptr',
        "  %at = getelementptr inbounds nuw double, ptr %q, i64 3",
        "  %y = fmul nsz arcp contract double %x, 0x3FE0000000000000",
        "  %v = insertelement <4 x double> poison, double %y, i64 0",
        "  %s = shufflevector <4 x double> %v, <4 x double> poison, <8 x i32> zeroinitializer",
        "  %c = fcmp ogt <8 x double> %s, splat (double 0x3FF0000000000000)",
        "  %m = tail call <8 x double> @llvm.masked.load.v8f64.p0(ptr nonnull align 8 %at, <8 x i1> %c, "
        "<8 x double> poison) #4, !alias.scope !111",
        "  store double %y, ptr %at, align 4",
        "  ret i32 0",
    )
    (block,) = read_function.blocks.values()
    load, address, step, product, first, spread, truth, masked, store = block.body
    assert (load.kind, load.align, load.invariant) == ("i64", 8, True)
    assert (address.kind, address.operands[0].name) == ("ptr", load.name)
    assert (step.element, step.operands[1].name) == ("double", "3")
    assert [o.kind for o in product.operands] == ["double", "double"]
    assert (first.kind, spread.kind, truth.kind) == ("<4 x double>", "<8 x double>", "<8 x i1>")
    assert masked.function == "masked.load"
    assert [o.name for o in masked.operands] == [step.name, truth.name, "poison"]
    assert masked.code.endswith("<8 x double> poison)")
    assert (store.name, store.kind, store.align, store.place.name) == ("", "double", 4, step.name)
    assert read_function.kernel == KERNELS["k0"]


def test_blocks_know_where_they_come_from() -> None:
    blocks = function(
        "  br i1 true, label %left, label %right",
        "left:",
        "  switch i64 0, label %right [",
        "    i64 1, label %right",
        "  ]",
        "right:",
        "  %z = phi double [ %x, %entry ], [ 1.0, %left ], [ 1.0, %left ]",
        "  ret i32 0",
    ).blocks
    entry, left, right = blocks.values()
    assert entry.targets == (left.label, right.label)
    assert right.sources == [entry.label, left.label, left.label]
    assert right.phis[0].sources == (entry.label, left.label, left.label)
    assert right.end.operation == "end"


def test_aggregates_are_stored_by_their_members_and_words_are_copied_as_numbers() -> None:
    simple = simplified(
        function(
            "  %one = insertvalue { i32, [2 x double] } poison, i32 7, 0",
            "  %pair = insertvalue [2 x double] zeroinitializer, double %x, 1",
            "  %both = insertvalue { i32, [2 x double] } %one, [2 x double] %pair, 1",
            "  store { i32, [2 x double] } %both, ptr %p, align 8",
            "  %word = load i64, ptr %p, align 8",
            "  store i64 %word, ptr %p, align 8",
            "  ret i32 0",
        )
    )
    (block,) = simple.blocks.values()
    stored = [(e.kind, e.operands[0].name) for e in block.body if e.operation == "store"]
    assert stored[:3] == [("i32", "7"), ("double", "zeroinitializer"), ("double", "%v1")]
    steps = [e.operands[1].name for e in block.body if e.operation == "getelementptr"]
    assert steps == ["0", "8", "16"]
    assert [e.kind for e in block.body[-2:]] == ["double", "double"]


def test_a_nested_member_is_refused() -> None:
    nested = function(
        "  %one = insertvalue { { double } } poison, double %x, 0, 0",
        "  store { { double } } %one, ptr %p, align 8",
        "  ret i32 0",
    )
    with pytest.raises(MeltemiError, match="insertvalue"):
        simplified(nested)


def test_sizes_of_types() -> None:
    assert size_of("{ i32, { ptr, i8 }, <4 x double> }") == (64, 32)
    assert members_of("{ i32, { ptr, i8 }, <4 x double> }") == [("i32", 0), ("{ ptr, i8 }", 8), ("<4 x double>", 32)]
    assert size_of("<8 x i1>") == (1, 1)


def test_names_of_kernels_are_readable() -> None:
    assert _readable("_ZN7meltemi7control8baseline3lawB3v12B40c8tJTIcFKzyF2ILShI4CrgQElQb6HczSBAA_3dE5ArrayI") == (
        "meltemi.control.baseline.law"
    )
