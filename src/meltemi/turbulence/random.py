"""Random numbers as a function of an address: stateless, order-independent, equal on every platform.

The bits are those of Philox 4x32-10 (Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3"): a block
cipher of ten rounds converts an address of four 32-bit numbers, under a key, to four random ones. The key is the
seed; the address is that of a component and a point, so two seeds, components or points never share any.

A pair of 32-bit numbers a, b becomes a complex normal number of unit variance, z = sqrt(-ln u) exp(2 pi i v) with
u = (a + 1/2) / 2^32 and v = (b + 1/2) / 2^32 (Box and Muller 1958); |z| reaches 4.7. It is computed in single
precision, which fields have, with the polynomials of the Cephes library (Moshier 1992). The functions are written out
for loops over arrays, in which the compiler can use vector instructions.
"""

from __future__ import annotations

from math import pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.compiler import kernel, uint64

Bits = NDArray[np.uint32]
Normals = NDArray[np.complexfloating[Any]]

LOW_32 = np.uint64(0xFFFFFFFF)
MULTIPLIER_0, MULTIPLIER_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
STEP_0, STEP_1 = np.uint64(0x9E3779B9), np.uint64(0xBB67AE85)
"""Increments of the key from round to round: the golden ratio and sqrt(3) - 1."""
ROUNDS = 10

B32, B30, B23 = np.uint64(32), np.uint32(30), np.int32(23)

ONE, HALF, ZERO = np.float32(1.0), np.float32(0.5), np.float32(0.0)
STEP_OF_U, QUARTER_TURN = np.float32(2.0**-32), np.float32(0.5 * pi / 2.0**30)
HALF_QUARTER, LOW_30 = np.uint32(0x20000000), np.uint32(0x3FFFFFFF)
MANTISSA, SQRT_HALF, TO_ONE = np.int32(0x007FFFFF), np.int32(0x3F3504F3), np.int32(0x3F800000 - 0x3F3504F3)
"""Bits of a mantissa, of sqrt(1/2), and from there to those of 1."""
LN2_A, LN2_B = np.float32(0.693359375), np.float32(-2.12194440e-4)
LOG_8, LOG_7, LOG_6 = np.float32(7.0376836292e-2), np.float32(-1.1514610310e-1), np.float32(1.1676998740e-1)
LOG_5, LOG_4, LOG_3 = np.float32(-1.2420140846e-1), np.float32(1.4249322787e-1), np.float32(-1.6668057665e-1)
LOG_2, LOG_1, LOG_0 = np.float32(2.0000714765e-1), np.float32(-2.4999993993e-1), np.float32(3.3333331174e-1)
SIN_2, SIN_1, SIN_0 = np.float32(-1.9515295891e-4), np.float32(8.3321608736e-3), np.float32(-1.6666654611e-1)
COS_2, COS_1, COS_0 = np.float32(2.4433157118e-5), np.float32(-1.3887316255e-3), np.float32(4.1666645683e-2)


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
def complex_normals(a: Bits, b: Bits, out: Normals) -> None:
    """Complex normal numbers of unit variance, E z = E z^2 = 0, E |z|^2 = 1, from pairs of 32-bit numbers (n,)."""
    for j in range(len(out)):
        # u = (1 + f) 2^exponent with 1 + f from sqrt(1/2) to sqrt(2); beyond sqrt(1/2), f is u - 1 without cancellation
        shifted = np.int32(np.float32(np.float32(a[j]) + HALF).view(np.int32) + TO_ONE)
        exponent = np.float32((shifted >> B23) - np.int32(127 + 32))
        below_one = -STEP_OF_U * (np.float32(np.uint32(~a[j])) + HALF)
        f = below_one if exponent == ZERO else np.int32((shifted & MANTISSA) + SQRT_HALF).view(np.float32) - ONE
        p = (((LOG_8 * f + LOG_7) * f + LOG_6) * f + LOG_5) * f + LOG_4
        p = (((p * f + LOG_3) * f + LOG_2) * f + LOG_1) * f + LOG_0
        radius = sqrt(-(f + f * f * (p * f - HALF) + exponent * LN2_B + exponent * LN2_A))
        # the angle as quarters of a turn, and the rest between -1/8 and 1/8 of a turn
        turned = np.uint32(b[j] + HALF_QUARTER)
        quarter = np.int32(turned >> B30)
        x = (np.float32(np.int32(turned & LOW_30) - np.int32(HALF_QUARTER)) + HALF) * QUARTER_TURN
        z = x * x
        sine = x + x * z * ((SIN_2 * z + SIN_1) * z + SIN_0)
        cosine = ONE - HALF * z + z * z * ((COS_2 * z + COS_1) * z + COS_0)
        odd = quarter & 1
        s, c = cosine if odd else sine, sine if odd else cosine
        s, c = -s if quarter & 2 else s, -c if (quarter + 1) & 2 else c
        out[j] = complex(radius * c, radius * s)


@kernel
def noise(seed: int, address_1: int, address_2: int, bits: Bits, out: Normals) -> None:
    """Fill ``out`` (2 n,) with the complex normal numbers of an address; ``bits`` (4, n) is a work array.

    Entries j and n + j are from block j of the bits.
    """
    n = bits.shape[1]
    random_bits(bits, seed, address_1, address_2)
    complex_normals(bits[0], bits[1], out[:n])
    complex_normals(bits[2], bits[3], out[n:])
