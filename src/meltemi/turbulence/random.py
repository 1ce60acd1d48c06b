"""Random numbers as a function of an address: stateless, order-independent, equal on every platform.

The bits are those of Philox 4x32-10 (Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3"): a block
cipher of ten rounds converts an address of four 32-bit numbers, under a key, to four random ones. The key is the
seed; the address is that of a component and a point, so two seeds, components or points never share any.

A pair of 32-bit numbers a, b becomes a complex normal number of unit variance, z = sqrt(-ln u) exp(2 pi i v) with
u = (a + 1/2) / 2^32 and v = (b + 1/2) / 2^32 (Box and Muller 1958); |z| reaches 4.7. The functions are written out
for loops over arrays, in which the compiler can use vector instructions.
"""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import int64, kernel, uint64
from meltemi.compiler.elementary import (
    COS_0,
    COS_1,
    COS_2,
    COS_3,
    COS_4,
    COS_5,
    LN2_A,
    LN2_B,
    LOG_0,
    LOG_1,
    LOG_2,
    LOG_3,
    LOG_4,
    LOG_5,
    LOG_6,
    SIN_0,
    SIN_1,
    SIN_2,
    SIN_3,
    SIN_4,
    SIN_5,
)

Bits = NDArray[np.uint64]

LOW_32 = np.uint64(0xFFFFFFFF)
MULTIPLIER_0, MULTIPLIER_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
STEP_0, STEP_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
"""Increments of the key from round to round: the golden ratio and sqrt(3) - 1."""
ROUNDS = 10

LOW_30 = np.uint64(0x3FFFFFFF)
HALF_QUARTER = np.uint64(0x20000000)
QUARTER_TURN = 0.5 * pi / 2.0**30

TWO_52 = np.uint64(0x4330000000000000)
"""Bits of 2^52: with a whole number below 2^52 in its last bits they are the sum of both, without a conversion."""
SQRT_HALF = np.uint64(0x3FE6A09E667F3BCD)
"""Bits of sqrt(1/2)."""
TO_MANTISSA = np.uint64(0x3FF0000000000000 - 0x3FE6A09E667F3BCD)
MANTISSA = np.uint64(0x000FFFFFFFFFFFFF)
B52, B63, B32, B30, B1 = np.uint64(52), np.uint64(63), np.uint64(32), np.uint64(30), np.uint64(1)


@kernel
def random_bits(bits: Bits, seed: int, address_1: int, address_2: int) -> None:
    """Fill ``bits`` (4, n) with 32-bit numbers: column j holds those of address (j, address_1, address_2, 0)."""
    key_0, key_1 = uint64(seed) & LOW_32, uint64(seed) >> B32
    for j in range(bits.shape[1]):  # all rounds of a block in registers, eight blocks at once
        a, b, c, d = uint64(j), uint64(address_1), uint64(address_2), uint64(0)
        k_0, k_1 = key_0, key_1
        for _ in range(ROUNDS):
            p, q = MULTIPLIER_0 * (a & LOW_32), MULTIPLIER_1 * (c & LOW_32)
            a, b, c, d = (q >> B32) ^ b ^ k_0, q & LOW_32, (p >> B32) ^ d ^ k_1, p & LOW_32
            k_0, k_1 = (k_0 + STEP_0) & LOW_32, (k_1 + STEP_1) & LOW_32
        bits[0, j], bits[1, j], bits[2, j], bits[3, j] = a, b, c, d


@kernel
def complex_normals(a: Bits, b: Bits, out: NDArray[np.complex128]) -> None:
    """Complex normal numbers of unit variance, E z = E z^2 = 0, E |z|^2 = 1, from pairs of 32-bit numbers (n,)."""
    for j in range(len(out)):
        # u = mantissa 2^exponent with the mantissa in [sqrt(1/2), sqrt(2))
        u = np.uint64(a[j] | TWO_52).view(np.float64) - (4503599627370496.0 - 0.5)
        shifted = np.float64(u).view(np.uint64) + TO_MANTISSA
        exponent = np.float64(int64(shifted >> B52)) - (1023.0 + 32.0)
        f = np.uint64((shifted & MANTISSA) + SQRT_HALF).view(np.float64) - 1.0
        s = f / (f + 2.0)
        z = s * s
        z2 = z * z
        p = (LOG_0 + LOG_1 * z) + z2 * (LOG_2 + LOG_3 * z) + (z2 * z2) * ((LOG_4 + LOG_5 * z) + LOG_6 * z2)
        radius = sqrt(-(exponent * LN2_A + (f - (s * (f - z * p) - exponent * LN2_B))))
        # the angle as quarters of a turn, and the rest between -1/8 and 1/8 of a turn
        turned = b[j] + HALF_QUARTER
        quarter = int64(turned >> B30)
        x = (np.float64(int64(turned & LOW_30)) - (536870912.0 - 0.5)) * QUARTER_TURN
        z = x * x
        z2 = z * z
        z4 = z2 * z2
        sine = x + (x * z) * ((SIN_0 + SIN_1 * z) + z2 * (SIN_2 + SIN_3 * z) + z4 * (SIN_4 + SIN_5 * z))
        cosine = (COS_0 + COS_1 * z) + z2 * (COS_2 + COS_3 * z) + z4 * (COS_4 + COS_5 * z)
        cosine = 1.0 - (0.5 * z - z2 * cosine)
        odd = np.float64(quarter & 1)
        s, c = (1.0 - odd) * sine + odd * cosine, (1.0 - odd) * cosine + odd * sine
        s, c = s * (1.0 - np.float64(quarter & 2)), c * (1.0 - np.float64((quarter + 1) & 2))
        out[j] = complex(radius * c, radius * s)


@kernel
def noise(seed: int, address_1: int, address_2: int, bits: Bits, out: NDArray[np.complex128]) -> None:
    """Fill ``out`` (2 n,) with the complex normal numbers of an address; ``bits`` (4, n) is a work array.

    Entries j and n + j are from block j of the bits.
    """
    n = bits.shape[1]
    random_bits(bits, seed, address_1, address_2)
    complex_normals(bits[0], bits[1], out[:n])
    complex_normals(bits[2], bits[3], out[n:])
