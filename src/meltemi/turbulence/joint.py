"""Random fields on a grid together with their values at other places, and their covariances with these.

Both models have the same functions: ``draw`` draws a field and its values at the places, ``condition`` adds to the
field what follows from values at the places, ``spectra`` returns the amplitudes of the field. A channel is a component
of the velocity at a place. Arrays over frequencies have H = n / 2 + 1 entries from 0 to the Nyquist frequency; at these
two the covariances are those of their neighbours, and a random field has none of them.

Reference: docs/theory/wind.md (W-51, W-52).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meltemi.turbulence import exponential, mann
from meltemi.turbulence.grid import WindGrid
from meltemi.turbulence.spectra import coherence_decay
from meltemi.turbulence.synthesis import FIELD_STREAM, POINT_STREAM, CovarianceFactors, add_noise, factors
from meltemi.turbulence.targets import amplitude_variances, length_scale, mann_length
from meltemi.wind.turbulent import TurbulentWind

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.intp]

PLACE_STREAM = 48
"""Of the random numbers of values at places, plus the component; their other address is the place."""
NEAREST, LATTICE = 36, 6
"""Points from which the value at a place is drawn: the nearest ones, and rows and columns of a lattice of others."""
TOUCHING = 1e-6
"""[m] distance below which two places are one."""
ENTRIES_AT_ONCE = 2_000_000
"""Of the covariances of these points that are worked on at once."""


@dataclass(frozen=True)
class Channels:
    """Components of the velocity at places.

    Attributes:
      component: (M,) 0, 1, 2 for u, v, w.
      z, y: (M,) [m] height and lateral position.
    """

    component: Index
    z: Float
    y: Float

    def distances(self, z: Float, y: Float) -> Float:
        """(M, N) [m] to other places."""
        return np.hypot(self.z[:, None] - z, self.y[:, None] - y)


def points_of(grid: WindGrid) -> tuple[Float, Float]:
    """Heights and lateral positions (P,) [m] of the points, rows first."""
    return np.repeat(grid.z, grid.points_y), np.tile(grid.y, grid.points_z)


def hub_of(grid: WindGrid) -> int:
    """Number of the point nearest to the hub."""
    return grid.hub[0] * grid.points_y + grid.hub[1]


def widened(x: Float) -> Float:
    """Values at all frequencies (..., B), with those of the neighbours at 0 and at the Nyquist frequency (..., H)."""
    return np.concatenate([x[..., :1], x, x[..., -1:]], axis=-1)


class ExponentialJoint:
    """Fields of Kaimal and von Karman with exponential coherence; components are independent.

    Args:
      wind, grid: description of the field and its points.
      n: number of planes.
      channels: what is wanted beside the field.
    """

    def __init__(self, wind: TurbulentWind, grid: WindGrid, n: int, channels: Channels) -> None:
        f, variances = amplitude_variances(wind, grid.hub_height, n)
        kappa = coherence_decay(wind.spectrum, wind.edition, f, wind.speed, length_scale(wind, grid.hub_height))
        self.grid, self.channels = grid, channels
        self.kappa, self.variances = widened(kappa), widened(variances)
        self.count = int(np.sum(kappa * min(grid.dy, grid.dz) < exponential.REACH))
        self.coherent = (0,) if wind.coherent == "u" else (0, 1, 2)
        self.fields: dict[int, Complex] = {}
        self.change: Complex = np.zeros((len(channels.z), len(self.kappa)), np.complex128)
        self.factors: CovarianceFactors | None = None  # of what is independent, of a field that is drawn
        self.seed = 0
        self.drawn: list[int] = []  # channels at other places than points and the channels before
        self.points = points_of(grid)

    def coherence(self, component: int, r: Float, some: slice | None = None) -> Float:
        """(b, ...) of points at distances r (...) [m], at some frequencies."""
        kappa = self.kappa[some or slice(None)]
        if component in self.coherent:
            return np.exp(-kappa.reshape(-1, *(1 for _ in r.shape)) * r)
        return np.broadcast_to((r < TOUCHING).astype(float), (len(kappa), *r.shape))

    def among(self) -> Complex:
        """(H, M, M) [m^2/s^2] covariances of the channels."""
        c, r = self.channels.component, self.channels.distances(self.channels.z, self.channels.y)
        result = np.zeros((len(self.kappa), len(c), len(c)), np.complex128)
        for component in set(c.tolist()):
            rows, columns = np.ix_(np.flatnonzero(c == component), np.flatnonzero(c == component))
            covariance = self.variances[component, :, None, None] * self.coherence(component, r[rows, columns])
            result[:, rows, columns] = covariance
        return result

    def with_hub(self, component: int) -> Float:
        """(H, M) [m^2/s^2] covariances of a component at the hub with the channels."""
        r = self.channels.distances(*(x[hub_of(self.grid)][None] for x in self.points))[:, 0]
        same = self.channels.component == component
        return self.variances[component, :, None] * self.coherence(component, r) * same

    def draw(self, seed: int) -> Complex:
        """Draw a field; returns its values (M, H) [m/s] at the places."""
        self.seed, self.drawn = seed, []
        kappa, bins = self.kappa[1:-1], len(self.kappa) - 2
        covered = np.zeros((4, bins))
        for component in self.coherent:
            self.fields[component] = np.empty((len(self.points[0]), self.count), np.complex128)
            covered[component, : self.count] = self.variances[component, 1 : self.count + 1]
        streams = [FIELD_STREAM + c for c in self.coherent]
        for some, fields in exponential.coherent_fields(kappa[: self.count], self.grid, seed, streams):
            for component, field in zip(self.coherent, fields, strict=True):
                field *= np.sqrt(self.variances[component, 1:-1][some])[:, None, None]
                self.fields[component][:, some] = field.reshape(len(field), -1).T
        self.factors = factors(self.variances[:, 1:-1] - covered)
        values = np.zeros((len(self.channels.z), bins + 2), np.complex128)
        for i in range(len(values)):
            self._draw_place(i, values)
        return values

    def _draw_place(self, i: int, values: Complex) -> None:
        """Draw the value of channel ``i`` given points about it and the channels before it (W-51)."""
        component = int(self.channels.component[i])
        r = self.channels.distances(*self.points)[i]
        if np.min(r) < TOUCHING:
            values[i] = self._unconditional(component, int(np.argmin(r)))
            return
        before = [k for k in self.drawn if self.channels.component[k] == component]
        for k in before:
            if math.hypot(self.channels.z[i] - self.channels.z[k], self.channels.y[i] - self.channels.y[k]) < TOUCHING:
                values[i] = values[k]
                return
        self.drawn.append(i)
        rows, columns = (
            np.linspace(0.0, m - 1.0, LATTICE).round().astype(int) for m in (self.grid.points_z, self.grid.points_y)
        )
        lattice = (rows[:, None] * self.grid.points_y + columns).ravel()
        nearest = np.argsort(r, kind="stable")[:NEAREST]
        split = self.count + 1 if component in self.coherent else 1
        whole = np.union1d(nearest, lattice)
        reach = exponential.REACH / self.kappa[min(split, len(self.kappa) - 1)] if component in self.coherent else 0.0
        close = nearest[r[nearest] <= reach]
        fresh = np.zeros((1, values.shape[1]), np.complex128)
        add_noise(fresh, np.ones(values.shape[1] - 2), self.seed, i, PLACE_STREAM + component)
        for points, begin, end in ((whole, 1, split), (close, split, values.shape[1] - 1)):
            z, y = (
                np.concatenate([x[points], mine[before]])
                for x, mine in zip(self.points, (self.channels.z, self.channels.y), strict=True)
            )
            known = np.concatenate([self._unconditional(component, int(p)) for p in points] + [values[before]])
            step = max(ENTRIES_AT_ONCE // max(len(z) ** 2, 1), 1)
            for first in range(begin, end, step):
                some = slice(first, min(first + step, end))
                c = self.coherence(component, np.hypot(self.channels.z[i] - z, self.channels.y[i] - y), some)
                among = self.coherence(component, np.hypot(z[:, None] - z, y[:, None] - y), some)
                weight = np.linalg.solve(among, c[..., None])[..., 0]
                rest = np.sqrt(np.maximum(1.0 - np.sum(weight * c, axis=1), 0.0) * self.variances[component, some])
                values[i, some] = np.einsum("bn,nb->b", weight, known[:, some]) + rest * fresh[0, some]

    def _unconditional(self, component: int, point: int, last: int | None = None) -> Complex:
        """(P, H) [m/s] amplitudes of the random field at successive points."""
        last = point + 1 if last is None else last
        out = np.zeros((last - point, len(self.kappa)), np.complex128)
        if self.factors is not None:
            if component in self.fields:
                out[:, 1 : self.count + 1] = self.fields[component][point:last]
            for stream, factor in self.factors.of(component):
                add_noise(out, factor, self.seed, point, POINT_STREAM + stream)
        return out

    def condition(self, pull: Complex) -> None:
        """Add to the field the covariance with the channels times ``pull`` (M, H)."""
        self.change = pull

    def spectra(self, component: int, first: int, last: int) -> Complex:
        """(P, H) [m/s] amplitudes of a component at points ``first`` to ``last``."""
        out = self._unconditional(component, first, last)
        r = self.channels.distances(*(x[first:last] for x in self.points))
        for i in np.flatnonzero(self.channels.component == component):
            out += self.coherence(component, r[i]).T * (self.variances[component] * self.change[i])
        return out


class MannJoint:
    """Fields of Mann's model; the components are correlated, and one that is measured changes the others.

    What the modes do not contain, and everything at frequencies at which neighbours count as independent, is
    independent from place to place: there a channel changes its point of the grid alone.

    Args:
      wind, grid: description of the field and its points.
      n: number of planes.
      channels: what is wanted beside the field.
    """

    def __init__(self, wind: TurbulentWind, grid: WindGrid, n: int, channels: Channels) -> None:
        f, variances = amplitude_variances(wind, grid.hub_height, n)
        self.grid, self.channels = grid, channels
        self.variances = widened(variances)
        self.length = mann_length(wind, grid.hub_height)
        k1 = 2.0 * np.pi * f * self.length / wind.speed
        self.k1 = k1[k1 * min(grid.dy, grid.dz) < mann.INDEPENDENT * self.length]
        self.unit = wind.intensity**2 * wind.speed**2 / mann.one_point(mann.GAMMA).variances[0] * k1[0]
        beyond = max(float(np.max(np.abs(channels.y))) - 0.5 * grid.width, 0.0)
        columns = grid.points_y + 2 * math.ceil(beyond / grid.dy)
        self.hull = grid.model_copy(update={"points_y": columns})
        self.points = points_of(grid)
        self.same = channels.distances(channels.z, channels.y) < TOUCHING
        touching = channels.distances(*self.points) < TOUCHING
        self.point = np.where(touching.any(axis=1), touching.argmax(axis=1), -1)
        self.fields: Complex = np.zeros((3, len(self.points[0]), len(self.k1) + 1), np.complex128)
        self.change: Complex = np.zeros((len(channels.z), n // 2 + 1), np.complex128)
        self.factors: CovarianceFactors | None = None  # of what is independent, of a field that is drawn
        self.seed = 0
        self.rest, self.covariances, self.hub_covariances = self._covariances()

    def _waves(self, k3: Float, k2: Float) -> Complex:
        """(M, K3, K2) of the modes at the places."""
        z, y = (mann.waves(k, x / self.length) for k, x in ((k3, self.channels.z), (k2, self.channels.y)))
        return z[:, :, None] * y[:, None, :]

    def _covariances(self) -> tuple[Float, Complex, Complex]:
        """Of what is independent between places (4, H), of the channels (H, M, M), of the hub with them (H, 3, M)."""
        c, bins = self.channels.component, self.variances.shape[1]
        covered = np.zeros((4, bins))
        among = np.zeros((bins, len(c), len(c)), np.complex128)
        hub = np.zeros((bins, 3, len(c)), np.complex128)
        z, y = (x[hub_of(self.grid)][None] / self.length for x in self.points)
        for m, k1 in enumerate(self.k1):
            k3, k2, phi = mann.weighted_tensor(float(k1), self.hull, self.length, mann.GAMMA)
            phi *= self.unit
            there = self._waves(k3, k2)
            among[m + 1] = np.einsum("ijkl,ikl,jkl->ij", phi[c[:, None], c], there, there.conj(), optimize=True)
            at_hub = mann.waves(k3, z).T * mann.waves(k2, y)
            hub[m + 1] = np.einsum("cjkl,kl,jkl->cj", phi[:, c], at_hub, there.conj(), optimize=True)
            covered[:, m + 1] = [phi[i, j].sum() for i, j in ((0, 0), (1, 1), (2, 2), (0, 2))]
        covered[:, 0] = covered[:, 1]
        among[0], hub[0] = among[1].real, hub[1].real
        rest = self.variances - covered
        at_place = at_point(rest)
        among += at_place[:, c[:, None], c] * self.same
        hub += at_place[:, :, c] * (self.point == hub_of(self.grid))
        return rest, among, hub

    def among(self) -> Complex:
        """(H, M, M) [m^2/s^2] covariances of the channels."""
        return self.covariances

    def with_hub(self, component: int) -> Complex:
        """(H, M) [m^2/s^2] covariances of a component at the hub with the channels."""
        return self.hub_covariances[:, component]

    def draw(self, seed: int) -> Complex:
        """Draw a field; returns its values (M, H) [m/s] at the places."""
        self.seed, component = seed, self.channels.component
        values = np.zeros((len(component), self.variances.shape[1]), np.complex128)
        modes_of = mann.sheared_modes(self.k1, self.hull, self.length, mann.GAMMA, seed, FIELD_STREAM)
        for m, (k3, k2, modes, _) in enumerate(modes_of):
            modes *= math.sqrt(self.unit)
            self.fields[:, :, m + 1] = self._on_grid(k3, k2, modes)
            values[:, m + 1] = np.einsum("mkl,mkl->m", self._waves(k3, k2), modes[component])
        self.factors = factors(self.rest[:, 1:-1])
        place = np.argmax(self.same, axis=1)  # channels at a place share the numbers of that place
        for i, c in enumerate(component):
            address = self.point[i] if self.point[i] >= 0 else len(self.points[0]) + place[i]
            for stream, factor in self.factors.of(int(c)):
                add_noise(values[i : i + 1], factor, seed, int(address), POINT_STREAM + stream)
        return values

    def _on_grid(self, k3: Float, k2: Float, modes: Complex) -> Complex:
        """(3, P) of modes (3, K3, K2)."""
        z, y = mann.waves(k3, self.grid.z / self.length), mann.waves(k2, self.grid.y / self.length)
        return (z @ modes @ y.T).reshape(3, -1)

    def condition(self, pull: Complex) -> None:
        """Add to the field the covariance with the channels times ``pull`` (M, H)."""
        self.change = pull
        for m, k1 in enumerate(self.k1):
            k3, k2, phi = mann.weighted_tensor(float(k1), self.hull, self.length, mann.GAMMA)
            there = self.unit * self._waves(k3, k2).conj()
            for entry in (m + 1, 0) if m == 0 else (m + 1,):
                modes = np.einsum("cjkl,jkl->ckl", phi[:, self.channels.component], there * pull[:, entry, None, None])
                self.fields[:, :, entry] += self._on_grid(k3, k2, modes)

    def spectra(self, component: int, first: int, last: int) -> Complex:
        """(P, H) [m/s] amplitudes of a component at points ``first`` to ``last``."""
        out = np.zeros((last - first, self.variances.shape[1]), np.complex128)
        out[:, : len(self.k1) + 1] = self.fields[component, first:last]
        if self.factors is not None:
            for stream, factor in self.factors.of(component):
                add_noise(out, factor, self.seed, first, POINT_STREAM + stream)
        rest = at_point(self.rest)
        for i in np.flatnonzero((self.point >= first) & (self.point < last)):
            out[self.point[i] - first] += rest[:, component, self.channels.component[i]] * self.change[i]
        return out


Joint = ExponentialJoint | MannJoint


def joint_of(wind: TurbulentWind, grid: WindGrid, n: int, channels: Channels) -> Joint:
    """The model of a wind's spectrum and coherence."""
    return (MannJoint if wind.spectrum == "mann" else ExponentialJoint)(wind, grid, n, channels)


def at_point(variances: Float) -> Float:
    """(H, 3, 3) covariances of u, v, w at a place from (4, H) those of uu, vv, ww, uw."""
    uu, vv, ww, uw = variances
    zero = np.zeros_like(uu)
    return np.array([[uu, zero, uw], [zero, vv, zero], [uw, zero, ww]]).transpose(2, 0, 1)
