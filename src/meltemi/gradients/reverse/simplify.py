"""Functions in the form that the adjoint takes: numbers are stored one by one, and as numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from meltemi.gradients.reverse.code import Function, Instruction, Operand, members_of, no_rule, size_of


def simplified(function: Function) -> Function:
    """The function with aggregates stored member by member, and copies of words as copies of numbers."""
    return _copies_as_numbers(_members_stored(function))


def _replaced(function: Function, bodies: dict[str, tuple[Instruction, ...]]) -> Function:
    blocks = {label: replace(block, body=bodies[label]) for label, block in function.blocks.items()}
    return replace(function, blocks=blocks)


def _members_stored(function: Function) -> Function:
    """Store aggregates member by member."""
    results = {e.name: e for block in function.blocks.values() for e in block.body if e.name}

    def leaves(kind: str, name: str, at: int) -> Iterator[tuple[str, str, int]]:
        """Type, value and offset of each number in an aggregate."""
        if kind[0] not in "[{":
            yield kind, name, at
            return
        parts: dict[int, str] = {}
        while name in results:
            each = results[name]
            if each.operation != "insertvalue" or len(each.places) != 1:
                raise no_rule(each.text, function.kernel)
            parts.setdefault(each.places[0], each.operands[1].name)
            name = each.operands[0].name
        for i, (inner, offset) in enumerate(members_of(kind)):
            if i in parts or name == "zeroinitializer":
                yield from leaves(inner, parts.get(i, name), at + offset)

    def stores() -> Iterator[tuple[Instruction, ...]]:
        count = 0
        for block in function.blocks.values():
            body = []
            for each in block.body:
                if each.operation == "insertvalue":
                    continue
                if each.operation != "store" or each.kind[0] not in "[{":
                    body.append(each)
                    continue
                value, pointer = each.operands
                for kind, name, at in leaves(each.kind, value.name, 0):
                    count += 1
                    place, align = Operand("ptr", f"%member.{count}"), min(size_of(kind)[1], 8)
                    step = f"getelementptr i8, ptr {pointer.name}, i64 {at}"
                    store = f"store {kind} {name}, ptr {place.name}, align {align}"
                    ahead = (Operand("ptr", pointer.name), Operand("i64", str(at)))
                    body.append(Instruction(place.name, "getelementptr", "ptr", step, ahead, element="i8"))
                    body.append(Instruction("", "store", kind, store, (Operand(kind, name), place), align=align))
            yield tuple(body)

    return _replaced(function, dict(zip(function.blocks, stores(), strict=True)))


def _copies_as_numbers(function: Function) -> Function:
    """Treat as numbers the words that are only loaded and stored."""
    users = users_of(function)
    copies = set[Instruction]()
    for block in function.blocks.values():
        for each in block.body:
            by = users.get(each.name, []) if each.operation == "load" and each.kind == "i64" else []
            stored = all(user.operation == "store" and user.operands[0].name == each.name for user in by)
            if by and stored and not each.invariant:
                copies |= {each, *by}
    bodies = {
        label: tuple(replace(e, kind="double") if e in copies else e for e in block.body)
        for label, block in function.blocks.items()
    }
    return _replaced(function, bodies)


def users_of(function: Function) -> dict[str, list[Instruction]]:
    """Instructions that use a value, by its name."""
    users: dict[str, list[Instruction]] = {}
    for block in function.blocks.values():
        for each in (*block.instructions, block.end):
            for name in each.uses:
                users.setdefault(name, []).append(each)
    return users
