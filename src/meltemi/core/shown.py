"""Bases of classes that terminals and notebooks show; ``core.representation`` draws what they give."""

from __future__ import annotations

from dataclasses import fields
from importlib import import_module
from typing import TYPE_CHECKING, Any

from meltemi.core.display import brief, one_line

if TYPE_CHECKING:
    from meltemi.core.representation import Card


class Shown:
    """Base of classes that notebooks show as a :class:`Card`."""

    def card(self) -> Card:
        """The card that notebooks show."""
        raise NotImplementedError

    def _repr_html_(self) -> str:
        from meltemi.core.representation import html

        return html(self.card())


class Viewed:
    """Base of classes that have a three-dimensional view."""

    def view(self, **settings: Any) -> Any:
        """The view in three dimensions, which notebooks show: that of ``meltemi.plots.view``, with its settings."""
        return import_module("meltemi.plots").view(self, **settings)


class Brief(Shown):
    """Base of dataclasses that hold arrays or other records; they are decorated with ``repr=False``."""

    def facts(self) -> dict[str, str]:
        """Names and values to be displayed, as text."""
        return {f.name: brief(getattr(self, f.name)) for f in fields(self) if f.repr}  # type: ignore[arg-type]

    def __repr__(self) -> str:
        return one_line(type(self).__name__, self.facts())

    def card(self) -> Card:
        """The facts."""
        from meltemi.core.representation import Card

        return Card(type(self).__name__, "", [(name.replace("_", " "), text) for name, text in self.facts().items()])
