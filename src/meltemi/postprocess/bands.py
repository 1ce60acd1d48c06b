"""Ideal removal of frequency bands: the upper bound for a controller of these harmonics.

A band is removed ideally: its frequencies of the discrete Fourier transform are set to zero, all others stay, with
their phases. Tones of whole periods in a band vanish, those outside stay exactly, and the variance falls by that of the
band. Records that do not close have two errors, both small in a record of many periods:

* A tone that does not fit the record keeps a fraction of about 1 / (pi^2 N) of its variance, at worst twice that; N is
  the number of frequencies of the record between the tone and the edge of the band.
* The jump J from the end of a record to its beginning has a part in every band: a variance of about
  J^2 / (2 pi^2) (1/a - 1/b) is removed with the band; a and b are the numbers of periods of its edges in the record.
  ``detrend="linear"`` removes a drift of several standard deviations before and adds it after. The line is fitted to
  the rest outside the bands, since whole periods of a tone have a slope, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import nan
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.core.errors import InputError
from meltemi.postprocess.fatigue import damage_equivalent_load, usual_slope
from meltemi.postprocess.inputs import floats, positive
from meltemi.postprocess.spectra import even_series
from meltemi.simulation.result import Result

Float = NDArray[np.float64]
Band = tuple[float, float]
"""[Hz] first and last frequency; both included."""
Detrend = Literal["constant", "linear"]


@dataclass(frozen=True)
class IdealRemoval:
    """Standard deviation and equivalent load of a series, before and after ideal removal of bands.

    Attributes:
      bands: [Hz] removed bands.
      slope: m of the S-N curve.
      std, std_left: standard deviation before and after, in the unit of the series.
      load, load_left: damage-equivalent load before and after, in the unit of the series.
    """

    bands: tuple[Band, ...]
    slope: float
    std: float
    std_left: float
    load: float
    load_left: float

    @property
    def std_change(self) -> float:
        """Relative change of the standard deviation; NaN for a constant series."""
        return self.std_left / self.std - 1.0 if self.std > 0.0 else nan

    @property
    def load_change(self) -> float:
        """Relative change of the equivalent load; NaN for a constant series."""
        return self.load_left / self.load - 1.0 if self.load > 0.0 else nan


def harmonic_bands(rotor_frequency: float, multiples: Sequence[float], half_width: float) -> tuple[Band, ...]:
    """Bands about multiples of the rotor frequency.

    Args:
      rotor_frequency: [Hz] see ``rotor_frequency``.
      multiples: 1 for 1P, 2 for 2P.
      half_width: half-width of each band, over the rotor frequency: 0.25 takes 0.75P to 1.25P.

    Raises:
      InputError: something is not positive, or a band would reach below zero.
    """
    positive(rotor_frequency, "harmonic_bands: rotor_frequency")
    positive(half_width, "harmonic_bands: half_width")
    centres = np.ravel(floats(multiples, "harmonic_bands: multiples"))
    bands = tuple((float(n - half_width) * rotor_frequency, float(n + half_width) * rotor_frequency) for n in centres)
    _check(bands, "harmonic_bands")
    return bands


def remove_bands(series: ArrayLike, dt: float, bands: Sequence[Band], *, detrend: Detrend = "constant") -> Float:
    """The series without the frequencies of the bands; the mean is kept.

    Args:
      series: (T,) values.
      dt: [s] between them.
      bands: [Hz] pairs from, to, both included; they may overlap.
      detrend: part that is kept: the mean, or a line.

    Returns:
      (T,) in the unit of the series.

    Raises:
      InputError: a band is empty or contains no frequency of the record, or values are not finite.
    """
    where = "remove_bands"
    x, dt, _ = even_series(series, None, dt, where)
    _check(bands, where)
    if detrend not in ("constant", "linear"):
        raise InputError(f"{where}: detrend must be 'constant' or 'linear', found {detrend!r}")
    frequency = np.fft.rfftfreq(len(x), dt)
    rounding = 1e-9 / (len(x) * dt)
    removed = np.zeros(len(frequency), dtype=bool)
    for low, high in bands:
        inside = (frequency >= low - rounding) & (frequency <= high + rounding)
        if not inside.any():
            raise InputError(
                f"{where}: {low:g} to {high:g} Hz contains no frequency of the record, "
                f"which are {1.0 / (len(x) * dt):g} Hz apart up to {frequency[-1]:g} Hz"
            )
        removed |= inside
    removed[0] = False
    if not removed.any():
        return x.copy()

    def outside(y: Float) -> Float:
        amplitudes = np.fft.rfft(y)
        amplitudes[removed] = 0.0
        kept: Float = np.fft.irfft(amplitudes, len(y))
        return kept

    rest = outside(x)
    if detrend == "constant":
        return rest
    line = np.linspace(-0.5, 0.5, len(x))
    ramp = outside(line)
    # if the bands have nearly all frequencies, the rest does not determine a line
    steep = float(ramp @ ramp)
    slope = float(ramp @ (rest - rest.mean())) / steep if steep > 1e-12 * float(line @ line) else 0.0
    left: Float = rest + slope * (line - ramp)
    return left


def ideal_removal(
    source: Result | ArrayLike,
    channel: str | None = None,
    *,
    bands: Sequence[Band],
    dt: float | None = None,
    slope: float | None = None,
    f_eq: float = 1.0,
    between: tuple[float, float] | None = None,
    detrend: Detrend = "constant",
) -> IdealRemoval:
    """Reduction of standard deviation and equivalent load of a series by ideal removal of bands.

    A controller could reach it that removes these harmonics completely and adds nothing elsewhere. It is no
    strict bound on equivalent loads, which also depend on how harmonics meet.

    Args:
      source: a result, with ``channel``, or (T,) values, with ``dt``.
      channel: name of the channel.
      bands: [Hz] pairs from, to; see ``harmonic_bands``.
      dt: [s] between the values of a bare series.
      slope: m of the S-N curve; the usual one of a channel unless given.
      f_eq: [Hz] frequency of the equivalent load.
      between: [s] evaluated part; bands are removed from the whole series, as short records separate them badly.
        Times of a bare series begin with its first value.
      detrend: see ``remove_bands``.

    Raises:
      InputError: the slope of a bare series is missing, a band is empty, or ``between`` holds fewer than two values.
    """
    where = "ideal_removal"
    x, step, recorded = even_series(source, channel, dt, where)
    if slope is None:
        slope = usual_slope(recorded) if recorded else None
        if slope is None:
            raise InputError(f"{where}: specify the slope of the S-N curve; defaults exist for load channels only")
    left = remove_bands(x, step, bands, detrend=detrend)
    if between is not None:
        time = source.time if isinstance(source, Result) else step * np.arange(len(x))
        part = (time >= between[0] - 1e-6 * step) & (time <= between[1] + 1e-6 * step)
        x, left = x[part], left[part]
        if len(x) < 2:
            raise InputError(f"{where}: between {between[0]:g} and {between[1]:g} s lie fewer than two values")
    duration = (len(x) - 1) * step
    load, load_left = (damage_equivalent_load(y, duration=duration, slope=slope, f_eq=f_eq) for y in (x, left))
    return IdealRemoval(
        bands=tuple((float(low), float(high)) for low, high in bands),
        slope=slope,
        std=float(x.std()),
        std_left=float(left.std()),
        load=load,
        load_left=load_left,
    )


def _check(bands: Sequence[Band], where: str) -> None:
    for low, high in bands:
        if not 0.0 <= low < high:
            raise InputError(f"{where}: a band must go from at least 0 Hz upwards, found {low:g} to {high:g} Hz")
