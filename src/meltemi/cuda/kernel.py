"""Kernel for graphics cards with one run per thread. Importing this module imports numba-cuda."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from numba import cuda

from meltemi.compiler import record_at
from meltemi.postprocess.counting import add_samples


def march_kernel(functions: Sequence[Any], classes: Sequence[type], first: Sequence[int], **options: Any) -> Any:
    """Kernel that advances each run by its count of time steps and updates its statistics, if any.

    Args:
      functions: time loop, update of the controller, evaluation, observation.
      classes: classes of the records, whose words begin at ``first``.
      options: options of ``numba.cuda.jit``.
    """
    run, control, system, one, plain, sections, *tally = (record_at(cls) for cls in classes)
    loop, update, evaluate, observe = functions
    of_run, of_control, of_system, of_one, of_plain, of_sections, *of_tally = first

    def march(counts: Any, words: Any) -> None:
        i = cuda.grid(1)
        if i < words.shape[0]:
            loop(
                counts[i],
                update,
                evaluate,
                observe,
                run(words, i, of_run),
                control(words, i, of_control),
                system(words, i, of_system),
                one(words, i, of_one),
                plain(words, i, of_plain),
                sections(words, i, of_sections),
            )

    whole = cuda.jit(**options)(march)
    if not tally:
        return whole
    inner, (count,), (at,) = cuda.jit(device=True, **options)(march), tally, of_tally

    def march_and_count(counts: Any, words: Any) -> None:
        i = cuda.grid(1)
        inner(counts, words)
        if i < words.shape[0]:
            add_samples(count(words, i, at))

    return cuda.jit(**options)(march_and_count)
