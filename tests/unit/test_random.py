"""Random numbers: the published bits of Philox, the transform against its definition, and addresses that share none."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from meltemi.turbulence.random import noise, random_bits

CHECKSUM = "8ceae3a99a6c40f09b46131092c1f718d2597133d73164970d97b6163067bd34"


def bits(n: int, seed: int = 0, address_1: int = 0, address_2: int = 0) -> NDArray[np.uint32]:
    out = np.empty((4, n), np.uint32)
    random_bits(out, seed, address_1, address_2)
    return out


def normals(n: int, seed: int = 1, address_1: int = 0, address_2: int = 0) -> NDArray[np.complex128]:
    out = np.empty(2 * n, np.complex128)
    noise(seed, address_1, address_2, np.empty((4, n), np.uint32), out)
    return out


def test_the_bits_are_those_of_philox() -> None:
    # Random123 1.14, kat_vectors: philox4x32 10, counter and key zero
    assert [hex(b) for b in bits(1)[:, 0].tolist()] == ["0x6627e8d5", "0xe169c58d", "0xbc57ac4c", "0x9b00dbd8"]


def test_counter_and_key_enter_as_numpy_has_them() -> None:
    # NumPy's Philox is the 64-bit one; this is 4x32-10 written out with Python's integers
    def philox(counter: list[int], key: list[int]) -> list[int]:
        for _ in range(10):
            p, q = 0xD2511F53 * counter[0], 0xCD9E8D57 * counter[2]
            counter = [(q >> 32) ^ counter[1] ^ key[0], q % 2**32, (p >> 32) ^ counter[3] ^ key[1], p % 2**32]
            key = [(key[0] + 0x9E3779B9) % 2**32, (key[1] + 0xBB67AE85) % 2**32]
        return counter

    # Random123, kat_vectors: the digits of pi
    pi = philox([0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344], [0xA4093822, 0x299F31D0])
    assert [hex(b) for b in pi] == ["0xd16cfe09", "0x94fdcceb", "0x5001e420", "0x24126ea1"]
    seed = 0x299F31D0_A4093822
    found = bits(5, seed, 0x85A308D3, 0x13198A2E)[:, 4].tolist()
    assert found == philox([4, 0x85A308D3, 0x13198A2E, 0], [0xA4093822, 0x299F31D0])


def test_the_checksum_of_the_bits_is_stored() -> None:
    digest = hashlib.sha256(bits(10_000, seed=12345, address_1=7, address_2=16).astype("<u4").tobytes()).hexdigest()
    assert digest == CHECKSUM


def test_the_transform_is_that_of_box_and_muller() -> None:
    raw = bits(5000, seed=3).astype(float)
    u, v = (raw[[0, 2]] + 0.5) / 2.0**32, (raw[[1, 3]] + 0.5) / 2.0**32
    expected = (np.sqrt(-np.log(u)) * np.exp(2j * np.pi * v)).reshape(-1)
    np.testing.assert_allclose(normals(5000, seed=3), expected, rtol=0.0, atol=5e-7)  # of single precision


@pytest.mark.parametrize("a", [0, 1, 2**31, 2**32 - 1])
@pytest.mark.parametrize("b", [0, 2**29 - 1, 2**29, 2**30, 3 * 2**30 - 1, 2**32 - 1])
def test_the_transform_at_the_ends_of_its_ranges(a: int, b: int) -> None:
    from meltemi.turbulence.random import complex_normals

    out = np.empty(1, np.complex128)
    complex_normals(np.array([a], np.uint32), np.array([b], np.uint32), out)
    u, v = (a + 0.5) / 2.0**32, (b + 0.5) / 2.0**32
    # relative to its magnitude, which reaches 1e-5 and 4.7
    assert out[0] == pytest.approx(np.sqrt(-np.log(u)) * np.exp(2j * np.pi * v), rel=3e-7)


def test_the_numbers_are_normal_and_proper() -> None:
    z = normals(200_000)
    n = len(z)
    assert abs(z.mean()) < 4.0 / np.sqrt(n)
    assert np.mean(np.abs(z) ** 2) == pytest.approx(1.0, abs=4.0 / np.sqrt(n))
    assert abs(np.mean(z**2)) < 4.0 / np.sqrt(n)
    for part in (z.real, z.imag):
        assert stats.kstest(part * np.sqrt(2.0), "norm").pvalue > 1e-3


@pytest.mark.parametrize("other", [{"seed": 2}, {"seed": 1 + 2**32}, {"address_1": 1}, {"address_2": 1}])
def test_another_address_has_other_numbers(other: dict[str, Any]) -> None:
    n = 50_000
    a, b = normals(n), normals(n, **other)
    assert abs(np.vdot(a, b)) / (2 * n) < 4.0 / np.sqrt(2 * n)
    assert len(np.intersect1d(bits(n, seed=1), bits(n, **({"seed": 1} | other)))) < 100  # by chance 9 of 200 000


def test_a_longer_field_has_the_numbers_of_the_shorter_one() -> None:
    np.testing.assert_array_equal(bits(100, seed=5)[:, :10], bits(10, seed=5))
