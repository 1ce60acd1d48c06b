"""Turbulent fields against what they shall have: sigma, spectra, coherence, phase, independence, and a given series.

The targets are written out here once more, from IEC 61400-1 and from rapid distortion theory, and share nothing with
the package. Fields are periodic and not scaled, so the Fourier coefficients of a point are independent normal numbers
whose variance is half the density times the frequency step: no windows, no leakage, and the error of every quadratic
statistic c* A c with covariance R is known, tr(A R A R). Bounds are four standard errors (SIGMAS), which one of a
thousand such numbers would exceed by chance with a probability of 6 %, and the wider of the accuracies asked for: 5 %
for spectra where 5 % is more than the sampling error, 0.03 for coherence. Seeds are fixed: a test that passes once
passes always.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import special, stats
from scipy.interpolate import CubicSpline
from threadpoolctl import threadpool_limits

from meltemi import Turbine
from meltemi.turbulence import exponential, mann
from meltemi.turbulence.field import generate_field, mean_profile
from meltemi.turbulence.grid import WindGrid
from meltemi.turbulence.measured import hub_amplitudes
from meltemi.turbulence.spectra import coherence_decay
from meltemi.wind.fields import WindBox
from meltemi.wind.turbulent import HubSeries, TurbulentWind
from meltemi.wind_files import read_bts

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

SPEED, INTENSITY, DURATION, DT, SEEDS = 12.0, 0.14, 600.0, 0.25, 30
PLANES = round(DURATION / DT)
GRID = WindGrid(points_y=7, points_z=7, dy=15.0, dz=15.0, bottom=45.0, hub_height=90.0)
F = np.arange(1, PLANES // 2) / DURATION
HUB = 24
SIGMAS = 4.0
MODELS = ("kaimal", "vonkarman", "mann")
EDITION = {"kaimal": 3, "vonkarman": 2, "mann": 3}
SCALE = {2: 21.0, 3: 42.0}
"""[m] scale parameter at a hub height of 90 m."""
BANDS = ((1, 12), (13, 60), (61, 200), (201, 500), (501, 1199))
"""Numbers of the frequencies; those below 0.02 Hz, 0.1 Hz, 0.33 Hz, 0.83 Hz and all the others."""
METHOD = {"kaimal": 1e-3, "vonkarman": 1e-3, "mann": 0.01}
"""Error of the coherence that the method is allowed, beside that of the sample."""


@pytest.fixture(autouse=True, scope="module")
def _one_thread() -> Iterator[None]:
    """Matrices are small here: threads would only wait for each other."""
    with threadpool_limits(1, "blas"):
        yield


def wind(spectrum: str, seed: int = 1, **options: object) -> TurbulentWind:
    settings: dict[str, object] = {
        "speed": SPEED,
        "intensity": INTENSITY,
        "dt": DT,
        "edition": EDITION[spectrum],
        "scaled": False,
        "periodic": True,
    }
    return TurbulentWind.model_validate(settings | {"spectrum": spectrum, "seed": seed} | options)


def coefficients(box: WindBox, setup: TurbulentWind, grid: WindGrid = GRID) -> Complex:
    """(3, P, B) Fourier coefficients of the fluctuations."""
    fluctuation = box.velocity - mean_profile(setup, grid.z, grid.hub_height)[:, None]
    amplitudes = np.fft.rfft(fluctuation, axis=0, norm="forward")[1:-1]
    return amplitudes.reshape(len(amplitudes), -1, 3).transpose(2, 1, 0)


@cache
def ensemble(spectrum: str) -> Complex:
    """(S, 3, P, B) coefficients over the square root of their target variances."""
    made = []
    for seed in range(1, SEEDS + 1):
        setup = wind(spectrum, seed)
        made.append(coefficients(generate_field(setup, GRID, DURATION), setup))
    return np.array(made) / np.sqrt(0.5 * target(spectrum)[:3] / DURATION)[:, None]


# ------------------------------------------------------------------------------------------ targets, written again


def isotropic_energy(k: Float) -> Float:
    """Von Karman's energy spectrum of unit length and deviation: its integral is 3/2."""
    norm = 1.5 * 2.0 * special.gamma(17 / 6) / (special.gamma(2.5) * special.gamma(1 / 3))
    return norm * k**4 / (1.0 + k**2) ** (17 / 6)


@cache
def _lifetime() -> CubicSpline:
    k = np.geomspace(1e-5, 1e5, 4000)
    return CubicSpline(np.log(k), np.log(k ** (-2 / 3) / np.sqrt(special.hyp2f1(1 / 3, 17 / 6, 4 / 3, -(k**-2.0)))))


def sheared_tensor(k1: float, k2: Float, k3: Float, gamma: float) -> Float:
    """(3, 3, ...) spectral tensor by rapid distortion: the linear equations of a mode, integrated by hand.

    With the shear s so far the mode has k(s) = (k1, k2, k30 - k1 s) and du/ds = (-1 + 2 k1^2/k^2, 2 k1 k2/k^2,
    2 k1 k3/k^2) u3, so u3 goes with 1/k^2 and the others with the integrals of 1/k^2 and 1/k^4.
    """
    square = k1**2 + k2**2 + k3**2
    beta = gamma * np.exp(_lifetime()(0.5 * np.log(square))) if gamma else np.zeros(np.broadcast(k2, k3).shape)
    k30 = k3 + beta * k1
    h = k1**2 + k2**2
    first = h + k30**2
    i2 = (np.arctan(k30 / np.sqrt(h)) - np.arctan(k3 / np.sqrt(h))) / (k1 * np.sqrt(h))
    i4 = 0.5 / h * ((k30 / first - k3 / square) / k1 + i2)
    gain = np.zeros((3, 3, *np.broadcast(k2, k3).shape))
    gain[0, 0] = gain[1, 1] = 1.0
    gain[0, 2] = first * (2.0 * k1**2 * i4 - i2)
    gain[1, 2] = first * 2.0 * k1 * k2 * i4
    gain[2, 2] = first / square
    k0 = np.stack(np.broadcast_arrays(k1, k2, k30))
    start = np.eye(3)[:, :, None, None] * first - k0[:, None] * k0
    start *= isotropic_energy(np.sqrt(first)) / (4.0 * np.pi * first**2)
    return np.einsum("ij...,jk...,lk...->il...", gain, start, gain, optimize=True)


def sinh_rule(scale: float, highest: float, count: int) -> tuple[Float, Float]:
    """Nodes and weights of the midpoint rule in arcsinh(k / scale), from 0 to ``highest``."""
    top = np.arcsinh(highest / scale)
    x = (np.arange(count) + 0.5) * top / count
    return scale * np.sinh(x), scale * np.cosh(x) * top / count


def cross(k1: float, dy: Float, dz: Float, gamma: float = 3.9, count: int = 240) -> Complex:
    """(3, 3, Z, Y) cross-spectra E u_i(x + r) conj u_j(x) of Mann's tensor, for unit length, by fine quadrature."""
    k2, w2 = sinh_rule(0.2 * k1, 120.0 * np.hypot(k1, 1.0), count)
    k3, w3 = np.concatenate([-k2[::-1], k2]), np.concatenate([w2[::-1], w2])
    tensor = sheared_tensor(-k1, k2, k3[:, None], gamma) * w2 * w3[:, None]
    up = np.exp(1j * np.outer(dz, k3))
    even, odd = np.cos(np.outer(k2, dy)), 1j * np.sin(np.outer(k2, dy))
    result = 2.0 * up @ tensor @ even
    for i, j in ((0, 1), (1, 0), (1, 2), (2, 1)):  # odd in k2
        result[i, j] = 2.0 * up @ tensor[i, j] @ odd
    return np.where(k1 * np.hypot(dz[:, None], dy) > 10.0, 0.0, result)  # below 1e-3, too quick for the rule


@cache
def mann_variances(gamma: float = 3.9) -> Float:
    """(3,) variances of u, v, w for unit isotropic deviation, by an integral in spherical coordinates."""
    k = np.geomspace(1e-4, 1e4, 200)
    mu, wmu = np.polynomial.legendre.leggauss(64)  # of k1 / k
    phi = (np.arange(64) + 0.5) * 2.0 * np.pi / 64
    total = np.zeros(3)
    for m, w in zip(mu[:32], wmu[:32], strict=True):  # the tensor is even
        ring = np.sqrt(1.0 - m**2)
        for radius in k:
            tensor = sheared_tensor(
                m * radius, radius * ring * np.cos(phi[None]), radius * ring * np.sin(phi[None]), gamma
            )
            total += (
                2.0 * w * radius**3 * np.log(k[1] / k[0]) * 2.0 * np.pi * np.einsum("ii...->i...", tensor).mean((1, 2))
            )
    return total + isotropic_energy(k[-1]) * k[-1]  # beyond it is isotropic: 2/3 of the integral of E


@cache
def mann_grid() -> tuple[Float, Complex]:
    """k1 and cross-spectra (K, 3, 3, 13, 13) at the separations of the grid, in lengths of Mann's."""
    k1 = 2.0 * np.pi * F[[0, 3, 8, 20, 45, 90, 150, 220, 330, 500, 750, 1198]] * 0.8 * SCALE[3] / SPEED
    step = 15.0 * np.arange(-6, 7) / (0.8 * SCALE[3])
    return k1, np.array([cross(k, step, step) for k in k1])


@cache
def target(spectrum: str) -> Float:
    """(4, B) one-sided densities [m^2/s^2/Hz] of u, v, w and the co-spectrum uw."""
    sigma, scale, out = INTENSITY * SPEED, SCALE[EDITION[spectrum]], np.zeros((4, len(F)))
    if spectrum == "kaimal":
        for c, (ratio, length) in enumerate(((1.0, 8.1), (0.8, 2.7), (0.5, 0.66))):
            time = length * scale / SPEED
            out[c] = 4.0 * (ratio * sigma) ** 2 * time / (1.0 + 6.0 * F * time) ** (5 / 3)
    elif spectrum == "vonkarman":
        time = 3.5 * scale / SPEED
        x = (F * time) ** 2
        out[0] = 4.0 * sigma**2 * time / (1.0 + 71.0 * x) ** (5 / 6)
        out[1] = out[2] = 2.0 * sigma**2 * time * (1.0 + 189.0 * x) / (1.0 + 71.0 * x) ** (11 / 6)
    else:
        k1, tensors = mann_grid()
        middle = tensors[:, :, :, 6, 6].real
        x = 2.0 * np.pi * F * 0.8 * scale / SPEED
        for c in range(3):
            out[c] = np.exp(CubicSpline(np.log(k1), np.log(middle[:, c, c]))(np.log(x)))
        out[3] = CubicSpline(np.log(k1), middle[:, 0, 2] / np.sqrt(middle[:, 0, 0] * middle[:, 2, 2]))(np.log(x))
        out[3] *= np.sqrt(out[0] * out[2])
        out *= 2.0 * sigma**2 / mann_variances()[0] * 2.0 * np.pi * 0.8 * scale / SPEED
    return out


def decay(spectrum: str, f: Float) -> Float:
    """[1/m] of the coherence exp(-decay r)."""
    a, length = (12.0, 8.1 * 42.0) if EDITION[spectrum] == 3 else (8.8, 3.5 * 21.0)
    return a * np.sqrt((f / SPEED) ** 2 + (0.12 / length) ** 2)


ROW, COLUMN = (index.reshape(-1) for index in np.indices((7, 7)))


@cache
def correlation(spectrum: str, component: int, band: tuple[int, int]) -> tuple[Complex, Complex]:
    """Coherence of all points: its mean (P, P) over a band, and at about ten of its frequencies (., P, P)."""
    rows, columns = ROW[:, None] - ROW + 6, COLUMN[:, None] - COLUMN + 6
    f = F[band[0] - 1 : band[1]]
    if spectrum == "mann":
        k1, tensors = mann_grid()
        own = tensors[:, component, component]
        x = 2.0 * np.pi * f * 0.8 * SCALE[3] / SPEED
        at = CubicSpline(np.log(k1), own / own[:, 6:7, 6:7].real)(np.log(x))
    else:
        r = 15.0 * np.hypot(np.arange(-6, 7)[:, None], np.arange(-6, 7))
        rate = decay(spectrum, f)[:, None, None]
        at = np.exp(-rate * r) if component == 0 else np.tile(r == 0.0, (len(f), 1, 1))
    some = at[len(f) // 20 :: max(len(f) // 10, 1)]
    return at.mean(axis=0)[rows, columns] + 0j, some[:, rows, columns] + 0j


@cache
def estimate(spectrum: str, component: int, band: tuple[int, int]) -> Complex:
    """(P, P) mean of c c* over seeds and the frequencies of a band."""
    c = ensemble(spectrum)[:, component, :, band[0] - 1 : band[1]].transpose(1, 0, 2).reshape(49, -1)
    return np.einsum("pn,qn->pq", c, c.conj()) / c.shape[1]


def quadratic(spectrum: str, component: int, form: Complex, band: tuple[int, int]) -> tuple[float, float, float]:
    """Mean of c* A c over seeds and the frequencies of a band; its expectation and standard error."""
    mean, some = correlation(spectrum, component, band)
    found = np.sum(form * estimate(spectrum, component, band).T)
    product = np.einsum("pq,bqr->bpr", form, some, optimize=True)
    variance = np.einsum("bij,bji->b", product, product).real.mean()
    error = np.sqrt(variance / (SEEDS * (band[1] - band[0] + 1)))
    return float(found.real), float(np.sum(form * mean.T).real), float(error)


# --------------------------------------------------------------------------------------------- what needs no sample


@pytest.mark.slow
@pytest.mark.parametrize("gamma", [0.0, 3.9])
def test_root_is_that_of_the_tensor_by_rapid_distortion(gamma: float) -> None:
    rng = np.random.default_rng(5)
    table = mann.lifetimes(gamma) if gamma else np.full(mann.ENTRIES, -80.0)
    for _ in range(200):
        k = rng.normal(size=3) * 10.0 ** rng.uniform(-2.0, 1.5)
        psi = np.zeros((3, 3))
        mann.root(*k, table, psi)
        expected = sheared_tensor(k[0], np.array([[k[1]]]), np.array([[k[2]]]), gamma)[:, :, 0, 0]
        np.testing.assert_allclose(psi @ psi.T, expected, atol=2e-3 * np.trace(expected))
        np.testing.assert_allclose(k @ psi, 0.0, atol=1e-9 * np.linalg.norm(k) * np.abs(psi).max())  # no divergence
    # one case by brute force, so that the integrals above are checked as well
    k = np.array([-0.6, 0.4, -0.3])
    beta = 3.9 * float(np.exp(_lifetime()(np.log(np.linalg.norm(k)))))
    u = np.linalg.cholesky(_isotropic(k + np.array([0.0, 0.0, beta * k[0]])) + 1e-14 * np.eye(3))
    steps = 4000
    for i in range(steps):  # midpoint rule
        half = u + 0.5 * beta / steps * _rate(k, beta * (1.0 - i / steps)) @ u
        u = u + beta / steps * _rate(k, beta * (1.0 - (i + 0.5) / steps)) @ half
    expected = sheared_tensor(k[0], k[1:2, None], k[2:3, None], 3.9)[:, :, 0, 0]
    np.testing.assert_allclose(u @ u.T, expected, atol=1e-5 * np.trace(expected))


def _isotropic(k: Float) -> Float:
    s = float(k @ k)
    return isotropic_energy(np.sqrt(s)) / (4.0 * np.pi * s**2) * (s * np.eye(3) - np.outer(k, k))


def _rate(k: Float, left: float) -> Float:
    """du/ds of a mode whose wave vector will be ``k`` after a further shear ``left``: -e1 u3 + 2 k k1 u3 / k^2."""
    now = k + np.array([0.0, 0.0, left * k[0]])
    out = np.zeros((3, 3))
    out[:, 2] = 2.0 * now * k[0] / (now @ now)
    out[0, 2] -= 1.0
    return out


@pytest.mark.long
def test_one_point_spectra() -> None:
    k1 = np.array([0.01, 0.1, 0.5, 2.0, 10.0, 60.0])
    sheared = mann.one_point(3.9)
    for k, found in zip(k1, sheared(k1).T, strict=True):
        f = cross(k, np.zeros(1), np.zeros(1), count=400)[:, :, 0, 0].real
        np.testing.assert_allclose(found[:3], np.diag(f), rtol=3e-3)
        assert found[3] == pytest.approx(f[0, 2], rel=5e-3)
        assert found[3] < 0.0
    np.testing.assert_allclose(sheared.variances[:3], mann_variances(), rtol=1e-3)
    # the standard says 0.55, 0.7 and 0.5
    assert 1.0 / np.sqrt(sheared.variances[0]) == pytest.approx(0.55, abs=0.01)
    np.testing.assert_allclose(np.sqrt(sheared.variances[1:3] / sheared.variances[0]), [0.7, 0.5], atol=0.04)
    # without shear von Karman's are known
    values = np.empty((len(k1), 4))
    mann.integrate_across(k1, np.full(mann.ENTRIES, -80.0), np.exp(np.linspace(-12.0, 12.0, 150)), 64, values)
    c = 2.0 * special.gamma(17 / 6) * 1.5 / (special.gamma(2.5) * special.gamma(1 / 3)) / 55.0
    np.testing.assert_allclose(values[:, 0], 9.0 * c * (1.0 + k1**2) ** (-5 / 6), rtol=1e-6)
    across = 1.5 * c * (3.0 + 8.0 * k1**2) * (1.0 + k1**2) ** (-11 / 6)
    np.testing.assert_allclose(values[:, 1], across, rtol=1e-6)
    np.testing.assert_allclose(values[:, 2], across, rtol=1e-6)
    np.testing.assert_allclose(values[:, 3], 0.0, atol=1e-9)


@pytest.mark.parametrize(("rows", "columns", "dz", "dy"), [(7, 7, 15.0, 15.0), (5, 31, 12.0, 6.0), (61, 61, 2.5, 2.5)])
@pytest.mark.parametrize("kappa", [0.004, 0.02, 0.1, 0.5])
def test_embedding_has_the_coherence_between_all_pairs(
    rows: int, columns: int, dz: float, dy: float, kappa: float
) -> None:
    size = tuple(exponential.torus_size(n, d, exponential.REACH / kappa) for n, d in ((rows, dz), (columns, dy)))
    values = exponential.eigenvalues(np.array([kappa]), (size[0], size[1]), dz, dy)[0]
    covariance = np.zeros((rows, columns))
    row, column = (np.minimum(np.arange(n), n - np.arange(n)) for n in size)
    covariance = np.fft.fft2(values[row[:, None], column], norm="forward")[:rows, :columns]
    expected = np.exp(-kappa * np.hypot(dz * np.arange(rows)[:, None], dy * np.arange(columns)))
    np.testing.assert_allclose(covariance, expected, atol=3e-4)


@pytest.mark.parametrize("spectrum", ["kaimal", "vonkarman"])
@pytest.mark.parametrize("edition", [2, 3, 4])
def test_decay_of_the_editions(spectrum: str, edition: int) -> None:
    f = np.array([0.0, 0.01, 1.0])
    a, scale = (8.8, 21.0) if edition == 2 else (12.0, 42.0)
    length = (8.1 if spectrum == "kaimal" and edition > 2 else 3.5) * scale
    expected = a * np.sqrt((f / SPEED) ** 2 + (0.12 / length) ** 2)
    np.testing.assert_allclose(coherence_decay(spectrum, edition, f, SPEED, scale), expected, rtol=1e-12)


def mann_covariance_error(k1: float, grid: WindGrid, length: float) -> Float:
    """(3,) largest deviation of what a field has, modes and remainder, from the tensor, over the density."""
    found = mann.covariance_with((0, 0), k1, grid, length, 3.9)
    y, z = grid.y - grid.y[0], grid.z - grid.z[0]
    expected = cross(k1, y / length, z / length, count=300)
    worst = np.zeros(3)
    for c in range(3):
        difference = np.abs(found[c, c] - expected[c, c]) / expected[c, c, 0, 0].real
        difference[0, 0] = 0.0  # the remainder makes this one exact
        worst[c] = difference.max()
    return worst


@pytest.mark.slow
@pytest.mark.parametrize("step", [5.0, 15.0])
def test_modes_of_mann_have_the_covariance_of_the_tensor(step: float) -> None:
    length = 33.6
    grid = WindGrid(points_y=7, points_z=7, dy=step, dz=step, bottom=90.0 - 3.0 * step, hub_height=90.0)
    for k1 in (0.02, 0.1, 0.4, 1.0):
        assert mann_covariance_error(k1, grid, length).max() < 0.004, k1
    for reach in (1.0, 2.0, 3.0, 4.9):  # k1 times the step
        bound = 0.006 if reach <= 2.0 else 0.009 if step == 5.0 else 0.016
        assert mann_covariance_error(reach * length / step, grid, length).max() < bound, reach


# ------------------------------------------------------------------------------------------------------ ensembles


@pytest.mark.long
@pytest.mark.parametrize("spectrum", MODELS)
def test_sigma_at_the_hub(spectrum: str) -> None:
    """Not scaled, it is that of the frequencies of the record, not the integral of the spectrum from 0 to infinity."""
    step = target(spectrum)[:3] / DURATION
    found = 2.0 * np.sum(np.abs(ensemble(spectrum)[:, :, HUB]) ** 2 * 0.5 * step, axis=2).mean(axis=0)
    error = np.sqrt(np.sum(step**2, axis=1) / SEEDS)
    assert np.all(np.abs(found - step.sum(axis=1)) < 3.0 * error)
    # scaled it is exact
    expected = {"kaimal": [1.0, 0.8, 0.5], "vonkarman": [1.0, 1.0, 1.0]}.get(spectrum)
    if expected is None:
        expected = list(np.sqrt(mann_variances() / mann_variances()[0]))
    for seed in range(1, 4):
        box = generate_field(wind(spectrum, seed, scaled=True), GRID, DURATION)
        np.testing.assert_allclose(box.velocity[:, 3, 3].std(axis=0), INTENSITY * SPEED * np.array(expected), rtol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("component", [0, 1, 2])
@pytest.mark.parametrize("spectrum", [pytest.param(m, marks=[pytest.mark.long] * (m == "mann")) for m in MODELS])
def test_spectra(spectrum: str, component: int) -> None:
    """All points count, but coherent ones for less: 1 / error^2 is the number of independent estimates."""
    for band in BANDS:
        found, expected, error = quadratic(spectrum, component, np.eye(49) / 49.0 + 0j, band)
        assert expected == pytest.approx(1.0, abs=1e-9)
        assert abs(found - 1.0) < (2.0 if band == BANDS[0] else SIGMAS) * error + 0.003, band
        if error < 0.05 / SIGMAS:
            assert abs(found - 1.0) < 0.05, band


def pairs(rows: int, columns: int) -> Float:
    """(P, P) matrix A for which c* A c is the mean of conj c(x) c(x + r) over all pairs of points so far apart."""
    far = (ROW - ROW[:, None] == rows) & (COLUMN - COLUMN[:, None] == columns)
    return far / far.sum()


@pytest.mark.slow
@pytest.mark.parametrize("component", [0, 1, 2])
@pytest.mark.parametrize("spectrum", MODELS)
def test_coherence(spectrum: str, component: int) -> None:
    for lateral in (False, True):
        for steps in (1, 2, 4, 6):
            form = pairs(0, steps) if lateral else pairs(steps, 0)
            for band in BANDS[1:]:
                found, expected, error = quadratic(spectrum, component, (form + form.T) / 2.0 + 0j, band)
                bound = SIGMAS * error + METHOD[spectrum]
                assert abs(found - expected) < bound, (lateral, steps, band)
                assert abs(found - expected) < 0.03, (lateral, steps, band)


@pytest.mark.parametrize("component", [0, 1, 2])
def test_upper_points_of_mann_lead(component: int) -> None:
    """The shear tilts eddies forward: what a point sees an upper one has seen before, so its phase is ahead."""
    for steps in (1, 2):
        form = (pairs(steps, 0) - pairs(steps, 0).T) / 2j
        for band in BANDS[1:4]:
            found, expected, error = quadratic("mann", component, form, band)
            assert abs(found - expected) < SIGMAS * error + METHOD["mann"], (steps, band)
            if steps * band[1] < 100:
                assert expected > 0.02
                assert found > 0.0
    for steps in (1, 2, 4):  # nothing leads to either side
        form = (pairs(0, steps) - pairs(0, steps).T) / 2j
        for band in BANDS:
            found, expected, error = quadratic("mann", component, form, band)
            assert abs(expected) < 1e-9
            assert abs(found) < SIGMAS * error + 0.003


@pytest.mark.parametrize("spectrum", MODELS)
def test_components_at_a_point(spectrum: str) -> None:
    """The co-spectrum of u and w is that of the tensor, negative; u and v, v and w have none."""
    c = ensemble(spectrum)
    density = target(spectrum)
    uw = density[3] / np.sqrt(density[0] * density[2])
    for i, j, expected in ((0, 2, uw), (0, 1, 0.0 * uw), (1, 2, 0.0 * uw)):
        each = (c[:, i] * c[:, j].conj()).mean(axis=1)  # over points
        for band in BANDS:
            part = each[:, band[0] - 1 : band[1]]
            wanted = expected[band[0] - 1 : band[1]].mean()
            error = part.std() / np.sqrt(part.size)
            assert abs(part.mean().real - wanted) < SIGMAS * error + 0.003, (i, j, band)
            assert abs(part.mean().imag) < SIGMAS * error + 0.003, (i, j, band)
    if spectrum == "mann":
        assert uw.max() < 0.0
        assert uw[:60].mean() < -0.3


@pytest.mark.parametrize("spectrum", MODELS)
def test_inertial_range(spectrum: str) -> None:
    """Density falls with f^(-5/3); there isotropic turbulence has 4/3 of the u spectrum across the wind."""
    power = np.mean(np.abs(ensemble(spectrum)) ** 2, axis=(0, 2)) * target(spectrum)[:3]
    some = slice(500, 1199)
    for c in range(3):
        slope = np.polyfit(np.log(F[some]), np.log(power[c, some]), 1)[0]
        expected = np.polyfit(np.log(F[some]), np.log(target(spectrum)[c, some]), 1)[0]
        assert slope == pytest.approx(expected, abs=0.02)
        assert slope == pytest.approx(-5 / 3, abs=0.12 if spectrum == "kaimal" else 0.07)
    ratio = power[1:, some].mean(axis=1) / power[0, some].mean()
    expected_ratio = target(spectrum)[1:3, some].mean(axis=1) / target(spectrum)[0, some].mean()
    np.testing.assert_allclose(ratio, expected_ratio, rtol=0.02)
    np.testing.assert_allclose(ratio, 4 / 3, rtol=0.03 if spectrum == "vonkarman" else 0.1)


@pytest.mark.parametrize("spectrum", MODELS)
def test_every_point_has_the_same_variance(spectrum: str) -> None:
    """The variance of a point is a sum of exponential numbers: within the bounds of all 49 points at once."""
    step = target(spectrum)[:3] / DURATION
    for c in range(3):
        variance = np.einsum("spb,b->sp", np.abs(ensemble(spectrum)[:, c]) ** 2, step[c]).mean(axis=0)
        freedom = SEEDS * step[c].sum() ** 2 / np.sum(step[c] ** 2)
        low, high = stats.gamma.ppf([0.5e-3 / 49, 1.0 - 0.5e-3 / 49], freedom, scale=step[c].sum() / freedom)
        assert low < variance.min()
        assert variance.max() < high
        flat = np.mean(np.abs(ensemble(spectrum)[:, c, :, 60:]) ** 2, axis=(0, 2))  # many frequencies: sharper
        assert np.abs(flat - 1.0).max() < 4.5 / np.sqrt(SEEDS * 1139) + 0.002


@pytest.mark.parametrize("spectrum", MODELS)
def test_point_values_are_normal(spectrum: str) -> None:
    """Third and fourth moments about the mean and sigma that are known; points and times are not independent, so the
    error is from the scatter of the seeds."""
    step = target(spectrum)[:3] / DURATION
    moments = []
    for c in ensemble(spectrum):
        amplitudes = np.zeros((3, 13, PLANES // 2 + 1), complex)
        amplitudes[..., 1:-1] = c[:, ::4] * np.sqrt(0.5 * step)[:, None]
        x = np.fft.irfft(amplitudes, PLANES, norm="forward") / np.sqrt(step.sum(axis=1))[:, None, None]
        moments.append([(x**3).mean(axis=(1, 2)), (x**4).mean(axis=(1, 2)) - 3.0])
    values = np.array(moments)  # (S, 2, 3)
    error = values.std(axis=0) / np.sqrt(SEEDS)
    assert error.max() < 0.2
    assert np.all(np.abs(values.mean(axis=0)) < SIGMAS * error)


@pytest.mark.parametrize("spectrum", MODELS)
def test_nothing_is_shared(spectrum: str) -> None:
    """Between seeds, components, frequencies, far points: |correlation|^2 n is an exponential number."""
    c = ensemble(spectrum)[:, :, HUB]
    n = c.shape[2]
    flat = c.reshape(-1, n)
    matrix = np.abs(flat @ flat.conj().T) / n
    seeds, components = np.divmod(np.arange(len(flat)), 3)
    other = seeds[:, None] != seeds
    assert matrix[other].max() < SIGMAS / np.sqrt(n) * 1.1
    if spectrum != "mann":
        other = components[:, None] != components
        assert matrix[other].max() < SIGMAS / np.sqrt(n) * 1.1
    squares = np.abs(np.einsum("scb,scb->sc", c, c)) / n  # proper: real and imaginary part alike and independent
    assert squares.max() < SIGMAS * np.sqrt(2.0 / n) * 1.1
    for shift in (1, 2, 7, 600):
        a, b = c[..., shift:], c[..., :-shift]
        assert np.abs((a * b.conj()).mean()) < SIGMAS / np.sqrt(a.size)
        assert np.abs((a * b).mean()) < SIGMAS / np.sqrt(a.size)
    if spectrum != "mann":  # independent points
        v = ensemble(spectrum)[:, 1]
        corner = np.einsum("spb,sqb->pq", v, v.conj()) / (SEEDS * n)
        np.fill_diagonal(corner, 0.0)
        assert np.abs(corner).max() < SIGMAS / np.sqrt(SEEDS * n)


# ------------------------------------------------------------------------------------------- through a given series

SMALL = WindGrid(points_y=5, points_z=5, dy=15.0, dz=15.0, bottom=60.0, hub_height=90.0)
CENTRE = 12


def given_series(spectrum: str, components: str, **options: object) -> tuple[HubSeries, Complex]:
    """A series of the right spectra at the hub at the times of the planes, and its coefficients (3, B)."""
    setup = wind(spectrum, 999, **options)
    box = generate_field(setup, SMALL, DURATION)
    plane = box.velocity[:, 2, 2].astype(float)
    time = DT * np.arange(PLANES)
    columns = {name: plane[:, c] for c, name in enumerate("uvw") if name in components}
    return HubSeries(time=time, **columns), coefficients(box, setup, SMALL)[:, CENTRE]


def conditional(spectrum: str, m: int, given: list[int]) -> tuple[Complex, Complex, Complex]:
    """Covariance (3, 3) at a point, with the hub (3, 3, 5, 5), and weights (3, G, 5, 5) of what is given there."""
    steps = 15.0 * np.arange(-2, 3)
    half = 0.5 * target(spectrum)[:, m - 1] / DURATION
    if spectrum == "mann":
        length = 0.8 * SCALE[3]
        to_hub = cross(2.0 * np.pi * m / DURATION * length / SPEED, steps / length, steps / length)
        to_hub = to_hub * half[0] / to_hub[0, 0, 2, 2]
    else:
        to_hub = np.zeros((3, 3, 5, 5), complex)
        r = np.hypot(steps[:, None], steps)
        to_hub[0, 0] = half[0] * np.exp(-decay(spectrum, np.array([m / DURATION])) * r)
        to_hub[1, 1], to_hub[2, 2] = (half[c] * (r == 0.0) for c in (1, 2))
    point = to_hub[:, :, 2, 2]
    weights = np.einsum("igzy,gh->ihzy", to_hub[:, given], np.linalg.inv(point[np.ix_(given, given)]))
    return point, to_hub, weights


SLOW = pytest.mark.long


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spectrum", "components"),
    [
        ("kaimal", "u"),
        ("kaimal", "uvw"),
        pytest.param("mann", "u", marks=SLOW),
        pytest.param("mann", "uvw", marks=SLOW),
    ],
)
def test_fields_through_a_given_series(spectrum: str, components: str) -> None:
    """Over seeds, the mean is that under the condition of the series, and the variance is less by what it explains."""
    series, hub = given_series(spectrum, components)
    given = ["uvw".index(c) for c in components]
    seeds = 40
    made = []
    for seed in range(seeds):
        setup = wind(spectrum, seed, hub_series=series)
        box = generate_field(setup, SMALL, DURATION)
        now = DT * np.arange(PLANES)
        for c in given:  # exact where a plane stands
            values = np.interp(now, series.time, getattr(series, "uvw"[c]), period=DURATION)
            np.testing.assert_allclose(box.velocity[:, 2, 2, c], values, atol=1e-5 * SPEED)
        made.append(coefficients(box, setup, SMALL))
    found = np.array(made)  # (S, 3, P, B)
    worst, spread = 0.0, []
    fit = np.zeros(2)
    for m in (*range(1, 25), 34, 55, 89, 144, 233, 377, 700):
        point, to_hub, weights = conditional(spectrum, m, given)
        mean = np.einsum("igzy,g->izy", weights, hub[given, m - 1]).reshape(3, -1)
        left = np.diag(point).real[:, None, None] - np.einsum("igzy,igzy->izy", weights, to_hub[:, given].conj()).real
        left = left.reshape(3, -1)
        free = left > 0.02 * np.diag(point).real[:, None]
        deviation = found[..., m - 1] - mean
        error = np.sqrt(np.maximum(left, 1e-12) / seeds)
        slack = 0.02 * np.sqrt(np.diag(point).real)[:, None] if spectrum == "mann" else 0.0
        worst = max(worst, float(((np.abs(deviation.mean(axis=0)) - slack) / error)[free].max()))
        spread.append(np.mean(np.abs(deviation) ** 2, axis=0)[free] / left[free])
        beside = CENTRE + 1
        power = seeds / left[0, beside] * np.array([mean[0, beside].conj(), 1.0])
        fit += (power * np.array([found[:, 0, beside, m - 1].mean(), np.abs(mean[0, beside]) ** 2])).real
    assert worst < SIGMAS
    assert 1.0 / np.sqrt(fit[1]) < 0.025
    assert fit[0] / fit[1] == pytest.approx(1.0, abs=SIGMAS / np.sqrt(fit[1]))  # a tenth more or less would show
    ratios = np.concatenate(spread)
    assert np.abs(ratios - 1.0).max() < 5.0 / np.sqrt(seeds)
    assert ratios.mean() == pytest.approx(1.0, abs=0.03)
    if spectrum == "mann" and components == "u":  # w at the hub keeps its co-spectrum with what is given there
        uw = found[:, 2, CENTRE] * hub[0].conj() / (0.5 * np.sqrt(target("mann")[0] * target("mann")[2]) / DURATION)
        for band in BANDS:
            some = slice(band[0] - 1, band[1])
            density = target("mann")[:, some]
            # given u the mean is a multiple of its own |u|^2
            wanted = (
                density[3] / np.sqrt(density[0] * density[2]) * np.abs(hub[0, some]) ** 2 / density[0] * 2.0 * DURATION
            )
            error = uw[:, some].std() / np.sqrt(uw[:, some].size)
            assert abs(uw[:, some].mean() - wanted.mean()) < SIGMAS * error + 0.003, band


@pytest.mark.slow
@pytest.mark.parametrize("spectrum", ["kaimal", "mann"])
def test_mean_of_a_given_series_is_that_of_the_wind(spectrum: str) -> None:
    series, _ = given_series(spectrum, "u")
    higher = series.model_copy(update={"u": series.u + 1.0})
    settings = {"shear_exponent": 0.2}
    means = [
        generate_field(wind(spectrum, 3, hub_series=s, **settings), SMALL, DURATION).velocity[..., 0].mean(axis=0)
        for s in (series, higher)
    ]
    profile = (SMALL.z / SMALL.hub_height) ** 0.2
    np.testing.assert_allclose(means[1] - means[0], np.tile(profile[:, None], (1, SMALL.points_y)), atol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("spectrum", MODELS)
def test_series_is_continued_where_it_was_not_measured(spectrum: str) -> None:
    """A part of a random series, continued, must be as random as the whole: same spectrum, no step at the joints."""
    rng = np.random.default_rng(11)
    count, begin, end = 200, 480, 1400
    variance = 0.5 * target(spectrum)[0] / DURATION
    power = np.zeros((count, len(F)))
    steps = np.zeros((count, 2))
    for i in range(count):
        c = np.zeros(PLANES // 2 + 1, complex)
        c[1:-1] = np.sqrt(0.5 * variance) * (rng.normal(size=len(F)) + 1j * rng.normal(size=len(F)))
        u = SPEED + np.fft.irfft(c, PLANES, norm="forward")
        part = HubSeries(time=DT * np.arange(begin, end), u=u[begin:end])
        amplitudes = hub_amplitudes(wind(spectrum, i, hub_series=part), SMALL, PLANES)[0]
        made = np.fft.irfft(amplitudes, PLANES, norm="forward") + SPEED
        np.testing.assert_allclose(made[begin + 1 : end - 1], u[begin + 1 : end - 1], atol=1e-9 * SPEED)
        power[i] = np.abs(amplitudes[1:-1]) ** 2 / variance
        steps[i] = made[[begin - 1, end + 1]] - made[[begin + 1, end - 1]]
    for band in BANDS:
        some = power[:, band[0] - 1 : band[1]]
        assert some.mean() == pytest.approx(1.0, abs=SIGMAS / np.sqrt(some.size)), band
    # two steps of time across a joint are as far apart as anywhere
    expected = np.sum(4.0 * variance * (1.0 - np.cos(2.0 * np.pi * F * 2.0 * DT)))
    assert np.mean(steps**2) == pytest.approx(expected, rel=SIGMAS * np.sqrt(2.0 / steps.size))


def test_series_shorter_than_the_run_gives_a_field_with_it() -> None:
    time = np.arange(100.0, 300.0, 0.2)
    series = HubSeries(time=time, u=SPEED + np.sin(0.2 * time), w=0.5 * np.cos(0.3 * time))
    for spectrum in MODELS:
        box = generate_field(wind(spectrum, 2, hub_series=series, periodic=False), SMALL, 400.0)
        now = DT * np.arange(len(box.velocity)) - 0.5 * SMALL.width / SPEED
        known = (now >= time[0]) & (now <= time[-1])
        for c, values in ((0, series.u), (2, series.w)):
            assert values is not None
            expected = np.interp(now[known], time, values)
            np.testing.assert_allclose(box.velocity[known, 2, 2, c], expected, atol=1e-5 * SPEED)
        assert box.velocity[~known, 2, 2, 0].std() > 0.3


# -------------------------------------------------------------------------------------------------------- options

OPTIONS: dict[str, tuple[str, dict[str, object]]] = {
    "speed": ("kaimal", {"speed": 11.0}),
    "intensity": ("kaimal", {"intensity": 0.1}),
    "seed": ("kaimal", {"seed": 2}),
    "spectrum, von Karman": ("kaimal", {"spectrum": "vonkarman"}),
    "spectrum, Mann": ("kaimal", {"spectrum": "mann"}),
    "edition, Kaimal": ("kaimal", {"edition": 2}),
    "edition, von Karman": ("vonkarman", {"edition": 3}),
    "edition, Mann": ("mann", {"edition": 2}),
    "lengths, von Karman": ("vonkarman", {"length_factor": 2.0}),
    "lengths, Mann": ("mann", {"length_factor": 2.0}),
    "coherent, Kaimal": ("kaimal", {"coherent": "all"}),
    "coherent, von Karman": ("vonkarman", {"coherent": "all"}),
    "shear exponent": ("kaimal", {"shear_exponent": 0.1}),
    "roughness": ("kaimal", {"roughness": 0.03}),
    "veer": ("mann", {"veer": 0.002}),
    "direction": ("kaimal", {"direction": 0.1}),
    "scaled": ("mann", {"scaled": True}),
    "periodic": ("vonkarman", {"periodic": False}),
    "points": ("kaimal", {"points": 9}),
    "dt": ("mann", {"dt": 0.2}),
    "hub series": ("kaimal", {"hub_series": {"time": np.array([0.0, 90.0]), "u": np.array([11.0, 13.0])}}),
}


@pytest.mark.parametrize("option", list(OPTIONS))
def test_every_option_changes_the_field(option: str, turbine: Turbine) -> None:
    spectrum, change = OPTIONS[option]
    base = wind(spectrum, points=7)
    changed = TurbulentWind.model_validate(base.model_dump() | change)
    a, b = (generate_field(w, turbine, 60.0) for w in (base, changed))
    if option == "direction":
        assert b.direction == 0.1
        np.testing.assert_array_equal(a.velocity, b.velocity)
    elif a.velocity.shape == b.velocity.shape:
        assert np.abs(a.velocity - b.velocity).max() > 0.02
    else:
        assert option in ("periodic", "points", "dt")
    assert generate_field(base, turbine, 60.0).content_hash() == a.content_hash()
    assert b.content_hash() != a.content_hash()


# ------------------------------------------------------------------------------------- beside another generator


def box_statistics(velocity: Float, profile: Float, dt: float) -> dict[str, Float]:
    """Of a box with the grid of the reference: what two generators must have in common."""
    fluctuation = velocity - profile[:, None]
    n = len(velocity)
    c = np.fft.rfft(fluctuation, axis=0, norm="forward")[1:]
    f = np.arange(1, len(c) + 1) / (n * dt)
    edges = [0.0, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0]
    result = {"mean": velocity.mean(axis=0)[:, 7], "sigma": fluctuation.std(axis=0).mean(axis=(0, 1))}
    result["scatter of sigma"] = fluctuation.std(axis=0).std(axis=(0, 1))
    spectra, coherence = [], []
    for low, high in pairwise(edges):
        some = c[(f > low) & (f <= high)]
        spectra.append(np.log(np.mean(np.abs(some) ** 2, axis=(0, 1, 2)) * 2.0 * n * dt))
        for steps in (1, 2, 4, 8):
            for a, b in ((some[:, :, :-steps], some[:, :, steps:]), (some[:, :-steps], some[:, steps:])):
                together = np.sum(a * b.conj(), axis=(0, 1, 2)).real
                coherence.append(
                    together / np.sqrt(np.sum(np.abs(a) ** 2, (0, 1, 2)) * np.sum(np.abs(b) ** 2, (0, 1, 2)))
                )
    return result | {"log spectra": np.array(spectra), "coherence": np.array(coherence)}


@pytest.mark.long
def test_turbsim_boxes_are_of_the_same_population(reference: Path) -> None:
    """Its two seeds beside an ensemble on the same grid: every statistic within what seeds scatter.

    One differs by design: Veers' method has fixed amplitudes and random phases where points are independent, so there
    all points have the same sigma. Here amplitudes are normal, and sigma scatters as that of nature does.
    """
    grid = WindGrid(points_y=15, points_z=15, dy=150.0 / 14.0, dz=150.0 / 14.0, bottom=15.0, hub_height=90.0)
    settings = {"speed": 20.0, "dt": 0.1, "scaled": True, "shear_exponent": 0.2}
    profile = mean_profile(wind("vonkarman", **settings), grid.z, grid.hub_height)
    seeds = 20
    ours = [
        box_statistics(generate_field(wind("vonkarman", s, **settings), grid, 728.0).velocity, profile, 0.1)
        for s in range(seeds)
    ]
    theirs = []
    for name in ("vkm20_s1", "vkm20_s2"):
        box = read_bts(reference / "openfast" / "wind" / f"{name}.bts")
        assert (box.dt, box.velocity.shape[1:]) == (0.1, (15, 15, 3))
        assert box.bottom == pytest.approx(grid.bottom)
        theirs.append(box_statistics(box.velocity, profile, 0.1))
    for name in ours[0]:
        a, b = np.array([s[name] for s in ours]), np.array([s[name] for s in theirs])
        error = a.std(axis=0, ddof=1) * np.sqrt(1.0 / seeds + 1.0 / len(theirs))
        floor = {"mean": 0.06, "log spectra": 0.01, "coherence": 0.005}.get(name, 0.01)
        difference = np.abs(a.mean(axis=0) - b.mean(axis=0))
        worst = np.max(difference / (error + floor))
        print(f"{name}: differs by up to {difference.max():.4f}, {worst:.1f} standard errors")
        if name == "scatter of sigma":
            assert np.all(b[:, 1:] < 0.2 * a[:, 1:].mean(axis=0))
        else:
            assert worst < SIGMAS, name
