"""Record of the ice on a rotor; its effects are in ``icing.py``. Reference: docs/guide/icing.md."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from meltemi.core.record import Record


class Icing(Record):
    """Ice on selected blades, constant in time."""

    blades: tuple[int, ...] | None = None
    """Numbers of the iced blades, from 1; by default all."""
    amount: float = Field(default=1.0, ge=0.0, le=10.0)
    """Factor on the mass of the formula (or on ``mass``); penalties are independent of it."""
    law: Literal["gl2010", "iec"] = "gl2010"
    """Mass along the span: linear to half the radius and then constant (GL 2010), or linear to the tip (IEC)."""
    mass: float | None = Field(default=None, ge=0.0, le=2000.0)
    """[kg/m] ice mass per length at the tip, instead of that of the formula."""
    density: float = Field(default=700.0, gt=0.0, le=920.0)
    """[kg/m^3] density of the ice, for the law of GL."""
    tip_chord: float | None = Field(default=None, gt=0.0, le=20.0)
    """[m] chord at the tip for the law of GL; by default extrapolated from 70 and 95 % of the radius."""
    lift_penalty: float = Field(default=0.2, ge=0.0, le=1.0)
    """Relative reduction of the lift coefficient at full penalty."""
    drag_penalty: float = Field(default=2.0, ge=0.0, le=20.0)
    """Relative increase of the drag coefficient at full penalty: 2 triples it."""
    penalty_begin: float = Field(default=0.0, ge=0.0, le=1.0)
    """Fraction of the rotor radius where penalties start."""
    penalty_full: float = Field(default=0.5, ge=0.0, le=1.0)
    """Fraction of the rotor radius from which penalties are full; linear between the two."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.blades is not None:
            if not self.blades:
                raise ValueError("blades: name at least one, or leave the key out for all")
            if len(set(self.blades)) < len(self.blades):
                raise ValueError(f"blades: {list(self.blades)} names one twice")
        if self.penalty_begin > self.penalty_full:
            raise ValueError(
                f"penalty_begin {self.penalty_begin:g} must not lie beyond penalty_full {self.penalty_full:g}"
            )
        return self

    def on(self, n_blades: int) -> tuple[int, ...]:
        """Numbers (from 1) of the iced blades of a rotor.

        Raises:
          ValueError: the rotor has no such blade.
        """
        everywhere = tuple(range(1, n_blades + 1))
        if self.blades is None:
            return everywhere
        if missing := [blade for blade in self.blades if blade not in everywhere]:
            raise ValueError(f"icing.blades names blade {missing[0]}; the rotor has blades 1 to {n_blades}")
        return tuple(sorted(self.blades))
