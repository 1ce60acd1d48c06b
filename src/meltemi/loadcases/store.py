"""Stores of a batch: what they keep of finished cases, so that these are not run again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from meltemi.core.display import brief
from meltemi.core.errors import InputError, Status
from meltemi.core.representation import Card, badge
from meltemi.core.shown import Shown
from meltemi.simulation.result import Result
from meltemi.simulation.run import Run

Reduce = Callable[[Any], Any]
"""Function from a result to the value that is kept of it."""


@dataclass(frozen=True, repr=False)
class Outcome(Shown):
    """Outcome of one case of a batch.

    Attributes:
      name: name of the case.
      status: outcome; ``FAILED`` if it could not be prepared, or its result not be reduced or written.
      message: reason; empty for a complete and valid run.
      value: the result, the value of ``reduce``, or the file it was written to; None without a result.
      error: class of the exception that ended a failed case.
      reused: whether the stored result was reused without a new run.
    """

    name: str
    status: Status
    message: str = ""
    value: Any = None
    error: type[BaseException] | None = None
    reused: bool = False

    def __repr__(self) -> str:
        remark = f": {self.message}" if self.message else ""
        return f"<Outcome {self.name!r}, {self.status}{remark}>"

    def card(self) -> Card:
        """Status and message, and the result or file."""
        kind = "good" if self.ok else "doubtful" if self.status.complete else "bad"
        facts = [("status", badge(self.status.name, kind)), *([("message", self.message)] if self.message else [])]
        if self.reused:
            facts.append(("run", "not repeated: a stored result was reused"))
        if isinstance(self.value, Shown):
            return Card("Outcome", self.name, facts, [self.value.card().folded(type(self.value).__name__)])
        return Card("Outcome", self.name, [*facts, ("value", brief(self.value))])

    @property
    def ok(self) -> bool:
        """The case reached its end, within the range of validity of the model."""
        return self.status is Status.OK


class BatchStore(Protocol):
    """Store of a batch; it is called in the threads of the cases.

    Attributes:
      folder: where it keeps values, which workers of a cluster must see.
    """

    folder: Path | None

    def begin(self, name: str, case: Any, reduce: Reduce | None) -> Outcome | tuple[Any, Reduce]:
        """Outcome of a case that is finished already; otherwise the case, and a function for its result.

        The function keeps what is to be kept, where the case has run, and returns the value of the outcome.

        Raises:
          MeltemiError: the case cannot run; this becomes its outcome.
        """


def with_model_and_wind(case: Run) -> Run:
    """The case with its model and wind, evaluated where they are functions."""
    model = case.model() if callable(case.model) else case.model
    return replace(case, model=model, wind=case.wind() if callable(case.wind) else case.wind)


def reduced(reduce: Reduce | None, result: Any) -> Any:
    """Value of a result; None where too little of it can be reduced, as its status says more."""
    try:
        return result if reduce is None else reduce(result)
    except InputError:
        if not isinstance(result, Result) or result.status.complete:
            raise
        return None


class Nothing:
    """Store that keeps nothing."""

    folder: Path | None = None

    def begin(self, name: str, case: Any, reduce: Reduce | None) -> tuple[Any, Reduce]:
        """The case."""
        return case, partial(reduced, reduce)
