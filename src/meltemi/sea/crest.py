"""A wave of prescribed height embedded in an irregular sea: NewWave, the most probable shape of a large crest.

Reference: docs/theory/sea.md (H-17 to H-19); Tromans, Anaturk & Hagemeijer (1991); Taylor, Jonathan & Harland (1997).
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from meltemi.core.record import Record

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Crest(Record):
    """The largest wave of a sea."""

    height: float = Field(gt=0.0, lt=60.0)
    """[m; 0.5 to 40] height of the crest or wave."""
    of: Literal["crest", "crest to trough"] = "crest"
    """Meaning of the height: the crest above still water, or the wave from its crest to the following trough."""
    time: float = Field(default=60.0, ge=0.0)
    """[s] time of the crest at the origin."""

    def embedded(self, frequency: Float, amplitude: Complex, share: Float) -> Complex:
        """Amplitudes (M,) with the crest (H-17): the sea given its elevation and slope at that time.

        Args:
          frequency: (M,) [rad/s] frequencies.
          amplitude: (M,) [m] amplitudes of the random sea.
          share: (M,) variance of each component over the total.
        """
        turn = np.exp(-1j * frequency * self.time)
        at_crest = amplitude / turn
        rise = float(np.real(at_crest).sum())
        slope = float((-frequency * np.imag(at_crest)).sum())
        shape = share * turn
        steepness = float((share * frequency**2).sum())
        if self.of == "crest":
            wanted = self.height
        else:
            lag = np.linspace(0.0, 2.0 * np.pi / np.sqrt(steepness), 181)
            trough = float((np.cos(np.outer(lag, frequency)) @ share).min())
            wanted = self.height / (1.0 - trough)
        # slope: a component i w share / m2 has unit slope and no elevation at the crest
        return np.asarray(amplitude + (wanted - rise) * shape + 1j * frequency * shape * slope / steepness)
