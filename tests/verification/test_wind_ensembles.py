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

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import special, stats
from scipy.interpolate import CubicSpline

from meltemi.wind import exponential, mann
from meltemi.wind.fields import WindBox
from meltemi.wind.files import read_bts
from meltemi.wind.grid import Grid
from meltemi.wind.spectra import coherence_decay
from meltemi.wind.turbulence import generate_field, hub_amplitudes, mean_profile
from meltemi.wind.turbulent import HubSeries, TurbulentWind

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

SPEED, INTENSITY, DURATION, DT, SEEDS = 12.0, 0.14, 600.0, 0.25, 30
PLANES = round(DURATION / DT)
GRID = Grid(points_y=7, points_z=7, dy=15.0, dz=15.0, bottom=45.0, hub_height=90.0)
F = np.arange(1, PLANES // 2) / DURATION
HUB = 24
SIGMAS = 4.0
MODELS = ("kaimal", "vonkarman", "mann")
EDITION = {"kaimal": 3, "vonkarman": 2, "mann": 3}
SCALE = {2: 21.0, 3: 42.0}
"""[m] scale parameter at a hub height of 90 m."""
BANDS = ((1, 12), (13, 60), (61, 200), (201, 500), (501, 1199))
"""Numbers of the frequencies; those below 0.02 Hz, 0.1 Hz, 0.33 Hz, 0.83 Hz and all the others."""
METHOD = {"kaimal": 1e-3, "vonkarman": 1e-3, "mann": 0.015}
"""Error of the coherence that the method is allowed, beside that of the sample."""


def wind(spectrum: str, seed: int = 1, **options: object) -> TurbulentWind:
    settings: dict[str, object] = {
        "speed": SPEED,
        "intensity": INTENSITY,
        "dt": DT,
        "edition": EDITION[spectrum],
        "scaled": False,
        "periodic": True,
    }
    return TurbulentWind.model_validate(settings | options | {"spectrum": spectrum, "seed": seed})


def coefficients(box: WindBox, setup: TurbulentWind, grid: Grid = GRID) -> Complex:
    """(3, P, B) Fourier coefficients of the fluctuations."""
    fluctuation = box.velocity - mean_profile(setup, grid)[:, None]
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
    return result


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
            tensor = sheared_tensor(m * radius, radius * ring * np.cos(phi[None]), radius * ring * np.sin(phi[None]), gamma)
            total += 2.0 * w * radius**3 * np.log(k[1] / k[0]) * 2.0 * np.pi * np.einsum("ii...->i...", tensor).mean((1, 2))
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
def correlation(spectrum: str, component: int) -> Complex:
    """(B', P, P) coherence of all points at every eighth frequency, which stands for its neighbours."""
    rows, columns = ROW[:, None] - ROW, COLUMN[:, None] - COLUMN
    f = F[3::8]
    if spectrum == "mann":
        k1, tensors = mann_grid()
        own = tensors[:, component, component]
        ratio = CubicSpline(np.log(k1), own / own[:, 6:7, 6:7].real)(np.log(2.0 * np.pi * f * 0.8 * SCALE[3] / SPEED))
        return ratio[:, rows + 6, columns + 6]
    if component > 0:
        return np.broadcast_to(np.eye(49, dtype=complex), (len(f), 49, 49))
    return np.exp(-decay(spectrum, f)[:, None, None] * 15.0 * np.hypot(rows, columns)).astype(complex)


def near(band: tuple[int, int]) -> NDArray[np.intp]:
    """Which of every eighth frequency stand for the ones of a band."""
    return np.minimum(np.arange(band[0] - 1, band[1]) // 8, len(F[3::8]) - 1)


def quadratic(spectrum: str, component: int, form: Complex, band: tuple[int, int]) -> tuple[float, float, float]:
    """Mean of c* A c over seeds and the frequencies of a band; its expectation and standard error."""
    c = ensemble(spectrum)[:, component, :, band[0] - 1 : band[1]]
    found = np.einsum("spb,spb->", c.conj(), np.einsum("pq,sqb->spb", form, c)).real / (SEEDS * c.shape[2])
    product = form @ correlation(spectrum, component)
    each = near(band)
    mean = np.trace(product, axis1=1, axis2=2).real[each].mean()
    variance = np.einsum("bij,bji->b", product, product).real[each].mean()
    return float(found), float(mean), float(np.sqrt(variance / (SEEDS * len(each))))


# --------------------------------------------------------------------------------------------- what needs no sample


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
    u = np.linalg.cholesky(_isotropic(k + [0.0, 0.0, beta * k[0]]) + 1e-14 * np.eye(3))
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
    size = tuple(
        exponential.torus_size(n, d, exponential.REACH / kappa) for n, d in ((rows, dz), (columns, dy))
    )
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


def mann_covariance_error(k1: float, grid: Grid, length: float) -> Float:
    """(3,) largest deviation of what a field has, modes and remainder, from the tensor, over the density."""
    found = mann.covariance_with((0, 0), k1, grid, length, 3.9)
    y, z = grid.y - grid.y[0], grid.z - grid.z[0]
    expected = cross(k1, y / length, z / length, count=400)
    worst = np.zeros(3)
    for c in range(3):
        difference = np.abs(found[c, c] - expected[c, c]) / expected[c, c, 0, 0].real
        difference[0, 0] = 0.0  # the remainder makes this one exact
        worst[c] = difference.max()
    return worst


@pytest.mark.parametrize("step", [5.0, 15.0])
def test_modes_of_mann_have_the_covariance_of_the_tensor(step: float) -> None:
    length = 33.6
    grid = Grid(points_y=7, points_z=7, dy=step, dz=step, bottom=90.0 - 3.0 * step, hub_height=90.0)
    for k1 in (0.02, 0.1, 0.4, 1.0):
        assert mann_covariance_error(k1, grid, length).max() < 0.006, k1
    for reach in (1.0, 2.0, 3.0, 4.9):  # k1 times the step
        assert mann_covariance_error(reach * length / step, grid, length).max() < 0.025, reach


# ------------------------------------------------------------------------------------------------------ ensembles


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


@pytest.mark.parametrize("component", [0, 1, 2])
@pytest.mark.parametrize("spectrum", MODELS)
def test_spectra(spectrum: str, component: int) -> None:
    """All points count, but coherent ones for less: 1 / error^2 is the number of independent estimates."""
    for band in BANDS:
        found, expected, error = quadratic(spectrum, component, np.eye(49) / 49.0 + 0j, band)
        assert expected == pytest.approx(1.0, abs=1e-9)
        assert abs(found - 1.0) < SIGMAS * error + 0.003, band
        if error < 0.05 / SIGMAS:
            assert abs(found - 1.0) < 0.05, band


def pairs(rows: int, columns: int) -> Float:
    """(P, P) matrix A for which c* A c is the mean of conj c(x) c(x + r) over all pairs of points so far apart."""
    far = (ROW == ROW[:, None] + rows) & (COLUMN == COLUMN[:, None] + columns)
    return far / far.sum()


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
    expected_ratio = {"kaimal": [1.333, 1.288], "vonkarman": [1.331, 1.331], "mann": [1.33, 1.33]}[spectrum]
    np.testing.assert_allclose(ratio, expected_ratio, rtol=0.05)


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
    """The error comes from the scatter of the seeds, as points and times are not independent."""
    setup = wind(spectrum)
    mean = mean_profile(setup, GRID)[:, None]
    sigma = np.sqrt(target(spectrum)[:3].sum(axis=1) / DURATION)
    moments = []
    for seed in range(1, SEEDS + 1):
        amplitudes = np.zeros((3, 49, PLANES // 2 + 1), complex)
        amplitudes[..., 1:-1] = ensemble(spectrum)[seed - 1] * np.sqrt(0.5 * target(spectrum)[:3] / DURATION)[:, None]
        x = np.fft.irfft(amplitudes[:, ::4], PLANES, norm="forward") / sigma[:, None, None]
        moments.append([(x**3).mean(axis=(1, 2)), (x**4).mean(axis=(1, 2)) - 3.0 * (x**2).mean(axis=(1, 2)) ** 2])
    assert mean.shape == (7, 1, 3)
    values = np.array(moments)  # (S, 2, 3)
    error = values.std(axis=0) / np.sqrt(SEEDS)
    # the fourth moment of one record is less by what its own variance scatters
    own = 3.0 * np.array([np.sum((s := target(spectrum)[c] / target(spectrum)[c].sum()) ** 2) for c in range(3)])
    expected = np.stack([np.zeros(3), -own if spectrum == "mann" else -own * _shared(spectrum)])
    assert np.all(np.abs(values.mean(axis=0) - expected) < SIGMAS * error + 0.02)


def _shared(spectrum: str) -> Float:
    """Share of the scatter of a record's variance that all points have in common: none where they are independent."""
    return np.array([1.0, 1.0 / 13.0, 1.0 / 13.0])


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
