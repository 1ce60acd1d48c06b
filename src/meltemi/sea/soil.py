"""Soil around a pile: layers of sand and clay with their lateral reactions by API, or curves of the user.

Reference: docs/theory/sea.md (H-41 to H-44); API RP 2GEO (2011), 8.5; Matlock (1970).
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from meltemi.core.record import Record, Vector

Float = NDArray[np.float64]


class Layer(Record):
    """Base of layers."""

    top: float = Field(ge=0.0)
    """[m] depth of its upper end below the mudline."""


class Sand(Layer):
    """Sand after API RP 2GEO."""

    kind: Literal["sand"] = "sand"
    friction_angle: float = Field(gt=0.3, lt=0.9)
    """[rad; 0.35 to 0.85] friction angle."""
    weight: float = Field(gt=0.0)
    """[N/m^3; 5e3 to 1.4e4] submerged weight."""
    modulus: float | None = Field(default=None, gt=0.0)
    """[N/m^3; 1e6 to 2e8] initial modulus of subgrade reaction; by default that of API for the friction angle below
    water."""
    cyclic: bool = True

    def reaction(self, y: Float, z: float, diameter: float, above: float) -> Float:
        """Reaction [N/m] per length at deflections y [m] and a depth z [m] below the mudline (H-41).

        Args:
          above: [N/m^2] effective weight of the layers above.
        """
        phi = self.friction_angle
        b, k0, ka = math.pi / 4.0 + phi / 2.0, 0.4, math.tan(math.pi / 4.0 - phi / 2.0) ** 2
        a = phi / 2.0
        c1 = math.tan(b) ** 2 * math.tan(a) / math.tan(b - phi)
        c1 += k0 * (math.tan(phi) * math.sin(b) / (math.cos(a) * math.tan(b - phi)))
        c1 += k0 * math.tan(b) * (math.tan(phi) * math.sin(b) - math.tan(a))
        c2 = math.tan(b) / math.tan(b - phi) - ka
        c3 = ka * (math.tan(b) ** 8 - 1.0) + k0 * math.tan(phi) * math.tan(b) ** 4
        stress = max(above, 1e-6)
        ultimate = min(c1 * z + c2 * diameter, c3 * diameter) * stress
        factor = 0.9 if self.cyclic else max(0.9, 3.0 - 0.8 * z / diameter)
        modulus = self.modulus if self.modulus is not None else subgrade_modulus(phi)
        return factor * ultimate * np.tanh(modulus * max(z, 1e-3) * y / (factor * ultimate))


def subgrade_modulus(friction_angle: float) -> float:
    """[N/m^3] initial modulus of subgrade reaction of sand below water, from API's figure (H-42)."""
    degrees, values = (25.0, 30.0, 35.0, 40.0, 45.0), (5.4e6, 8e6, 22e6, 45e6, 73e6)
    return float(np.interp(math.degrees(friction_angle), degrees, values))


class Clay(Layer):
    """Soft clay after Matlock, as in API RP 2GEO."""

    kind: Literal["clay"] = "clay"
    strength: float = Field(gt=0.0)
    """[N/m^2; 2e3 to 6e5] undrained shear strength."""
    weight: float = Field(gt=0.0)
    """[N/m^3; 3e3 to 1.3e4] submerged weight."""
    strain: float = Field(default=0.01, gt=0.0, lt=0.2)
    """Strain at half the strength [-; 0.002 to 0.05]."""

    def reaction(self, y: Float, z: float, diameter: float, above: float) -> Float:
        """Reaction [N/m] as for :meth:`Sand.reaction` (H-43); linear below a hundredth of the reference deflection."""
        ultimate = min(3.0 + above / self.strength + 0.5 * z / diameter, 9.0) * self.strength * diameter
        reference = 2.5 * self.strain * diameter
        x = np.abs(y) / reference
        share = np.where(x < 0.01, 0.5 * 0.01 ** (1.0 / 3.0) * x / 0.01, 0.5 * np.cbrt(np.minimum(x, 8.0)))
        return np.sign(y) * ultimate * share


class Curve(Layer):
    """A reaction by its values, linear in between and constant beyond."""

    kind: Literal["curve"] = "curve"
    deflection: Vector
    """(K,) [m; 0.005 to 5] deflections increasing from 0."""
    load: Vector
    """(K,) [N/m; 1e4 to 1e9] reactions per length of the pile, from 0."""
    weight: float = Field(default=1e4, gt=0.0)
    """[N/m^3; 3e3 to 1.4e4] submerged weight."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.deflection) < 2 or len(self.deflection) != len(self.load):
            raise ValueError("deflection and load need the same number of entries, at least 2")
        if self.deflection[0] != 0.0 or self.load[0] != 0.0 or np.any(np.diff(self.deflection) <= 0.0):
            raise ValueError("deflection and load begin with 0, and deflection increases")
        return self

    def reaction(self, y: Float, z: float, diameter: float, above: float) -> Float:
        """Reaction [N/m] as for :meth:`Sand.reaction`."""
        return np.sign(y) * np.interp(np.abs(y), self.deflection, self.load)


class Soil(Record):
    """Layers along the embedded part of a pile, as lateral springs that are linear for a load of the case."""

    layers: tuple[Annotated[Sand | Clay | Curve, Field(discriminator="kind")], ...] = Field(min_length=1)
    """Layers from the mudline down; each reaches to the next."""
    shear: float = 0.0
    """[N; 1e4 to 5e8] shear force at the mudline for which the springs are secants of the curves; 0 with moment 0:
    their initial stiffness."""
    moment: float = 0.0
    """[N m; 1e5 to 5e10] moment at the mudline, in the sense of a shear force above it."""
    axial_stiffness: float = Field(default=1e10, gt=0.0)
    """[N/m; 1e8 to 1e12] vertical stiffness at the foot."""
    torsion_stiffness: float = Field(default=1e12, gt=0.0)
    """[N m/rad; 1e9 to 1e14] stiffness about the pile's axis at the foot."""
    damping: float = Field(default=0.0, ge=0.0, lt=0.3)
    """Damping ratio of the first mode if all its stiffness were that of the soil [-; 0.001 to 0.15]."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        tops = [layer.top for layer in self.layers]
        if tops[0] != 0.0 or any(b <= a for a, b in pairwise(tops)):
            raise ValueError(f"layers must begin at the mudline with top 0 and go down, found tops {tops}")
        return self

    def secant(self, y: float, z: float, diameter: float) -> float:
        """Reaction over deflection [N/m^2] at |y| [m], at least 1e-5 of the diameter, and depth z [m]."""
        above, layer = 0.0, self.layers[0]
        for layer, after in zip(self.layers, (*self.layers[1:], None), strict=True):
            below = math.inf if after is None else after.top
            above += layer.weight * (min(z, below) - layer.top)
            if z <= below:
                break
        small = max(abs(y), 1e-5 * diameter)
        return float(layer.reaction(np.array([small]), z, diameter, above)[0] / small)
