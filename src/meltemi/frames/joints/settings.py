"""Settings of the fatigue of joints and of the utilisation of members."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from meltemi.core.record import Record
from meltemi.frames.joints.hot_spots import Classification
from meltemi.frames.joints.scf import ChordBending
from meltemi.frames.joints.utilisation import Standard
from meltemi.postprocess.sn import Environment


class JointSettings(Record):
    """Settings of the fatigue of joints and of the utilisation of members."""

    curve: str = "T"
    """Name of the S-N curve: T for tubular joints."""
    edition: str = "2016"
    """Year of DNV-RP-C203, or path of a YAML file with S-N curves."""
    environment: Literal["height"] | Environment = "height"
    """Of all joints, or by ``height``: cathodic protection below the splash zone, free corrosion in it, air above."""
    splash_zone: tuple[float, float] = (-4.0, 6.0)
    """[m; -8 to 10] lowest and highest level of the splash zone above mean sea level."""
    design_fatigue_factor: float = Field(default=3.0, ge=1.0)
    """Design fatigue factor [-; 1 to 3] by which the damage is multiplied in its utilisation."""
    classification: Classification = "load path"
    """Shares of K, X and T/Y: at each instant by ``load path``, or by ``geometry``."""
    chord_bending: ChordBending = "frame"
    """Bending of the chord at the crowns: that of the ``frame``, or the alpha of the ``formula``."""
    chord_axial: bool = True
    """Whether the axial stress of the chord is added at the crowns."""
    fixity: float = Field(default=0.7, ge=0.5, le=1.0)
    """Fixity C [-; 0.5 to 1] of the chord's ends: 0.5 clamped, 1 pinned."""
    alpha: float | None = Field(default=None, gt=0.0)
    """Chord length parameter [-; 4 to 40] of all joints, in place of that of the members."""
    cans: dict[str, Annotated[float, Field(gt=0.0, lt=0.5)]] = Field(default={})
    """[m; 0.02 to 0.1] wall of the chord at some joints, by name, where it is thicker than that of its members."""
    counting: Literal["rainflow", "dirlik"] = "rainflow"
    """Damage from counted cycles, or by Dirlik's formula from the spectrum."""
    standard: Standard = "NORSOK N-004"
    """Standard of the utilisation."""
    yield_stress: float = Field(default=355e6, ge=1e8, le=1.5e9)
    """[N/m^2; 2.35e8 to 5e8] yield stress of members."""
    yield_stresses: dict[str, Annotated[float, Field(ge=1e8, le=1.5e9)]] = Field(default={})
    """Those of some members, by name."""
    effective_length: float = Field(default=1.0, gt=0.0, le=3.0)
    """Effective length factor k [-; 0.7 to 1] of members."""
    effective_lengths: dict[str, float] = Field(default={})
    """Those of some members, by name."""
    moment_factor: float = Field(default=0.85, gt=0.0, le=1.0)
    """Factor C_m [-; 0.4 to 1] of moments in column buckling."""
    end_caps: bool = True
    """Whether axial loads of members contain the water's pressure on their ends (wall force)."""
