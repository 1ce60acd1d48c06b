"""The loops of a function, whose constants are recorded once, when a loop is left, and not in each round."""

from __future__ import annotations

from collections.abc import Mapping

from meltemi.gradients.reverse.code import BasicBlock


def loops_of(blocks: Mapping[str, BasicBlock]) -> list[tuple[frozenset[str], tuple[str, ...]]]:
    """Labels of the blocks of each loop, and of those that follow it, the largest loop first.

    Loops are left out that lead to a block which may also be reached from elsewhere.
    """
    above = dominators(blocks)
    rounds: dict[str, set[str]] = {}
    for label, block in blocks.items():
        for head in block.targets:
            if head in above[label]:
                body, left = rounds.setdefault(head, {head}), [label]
                while left:
                    each = left.pop()
                    if each not in body:
                        body.add(each)
                        left += blocks[each].sources
    loops = []
    for body in sorted(rounds.values(), key=len, reverse=True):
        exits = tuple(
            dict.fromkeys(t for label in blocks if label in body for t in blocks[label].targets if t not in body)
        )
        if all(source in body for label in exits for source in blocks[label].sources):
            loops.append((frozenset(body), exits))
    return loops


def dominators(blocks: Mapping[str, BasicBlock]) -> dict[str, set[str]]:
    """For each block the blocks through which every way from the first one to it leads, itself included."""
    first = next(iter(blocks))
    above = {label: set(blocks) for label in blocks}
    above[first] = {first}
    changed = True
    while changed:
        changed = False
        for label, block in blocks.items():
            if label != first:
                new = set.intersection(*(above[s] for s in block.sources)) | {label} if block.sources else {label}
                changed = changed or new != above[label]
                above[label] = new
    return above
