"""Representations of turbines in terminals and notebooks."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from meltemi.core.record import Record
from meltemi.core.shown import Viewed

if TYPE_CHECKING:
    from meltemi.core.representation import Card


class TurbineBase(Record, Viewed):
    """Base class of turbine records."""

    name: str
    description: str = ""
    source: str = ""

    if TYPE_CHECKING:
        control: Any
        drivetrain: Any

    @property
    def rated_rotor_speed(self) -> float:
        """Rotor speed [rad/s] that the controller maintains at rated power."""
        return float(self.control.pitch.reference_speed / self.drivetrain.gear_ratio)

    def __repr__(self) -> str:
        from meltemi.turbine.key_figures import summary

        return f"<{type(self).__name__} {summary(self)}>"

    def card(self) -> Card:
        """Card with the key figures and folded sections of all parts."""
        from meltemi.core.representation import Fold, record_card
        from meltemi.turbine.key_figures import key_figures

        whole = record_card(self)
        others = [row for row in whole.facts if row[0] not in ("name", "description", "source", "rated power")]
        source = [("source", self.source)] if self.source else []
        facts = [*key_figures(self), *source]
        inside = [*([Fold("Further data", others)] if others else []), *whole.sections]
        return replace(whole, lead=f"{self.name} {self.description}".strip(), facts=facts, sections=inside)
