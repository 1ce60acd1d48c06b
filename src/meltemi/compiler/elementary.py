"""Elementary functions without branches for any number type: a float, or a group of floats (lanes).

Lanes cannot take different branches. The functions therefore use nothing but + - * /, comparisons,
``where``, ``floor``, ``abs``, ``sqrt`` and two operations on the bits of a number: ``two_to(n)`` is 2^n,
and ``split(x)`` the mantissa and the exponent of x.

Method (Muller, Elementary Functions, 3rd ed. 2016, chapters 3 and 11; Cody and Waite, Software Manual for
the Elementary Functions, 1980): the argument is reduced to a short interval, on which a polynomial
approximates the function,

* exp: x = n ln 2 + r, |r| <= ln(2)/2, exp x = 2^n (1 + g), g = r + r^2 P(r),
* expm1: e^x - 1 = 2^n g + (2^n - 1), which loses no digits,
* tanh: (e^2x - 1)/(e^2x + 1) with that,
* log: x = m 2^e, s = (m - 1)/(m + 1), log m = 2 atanh s = 2 s + s^3 P(s^2),
* sin, cos, tan: x = n pi/2 + r, |r| <= pi/4,
* atan: t = a/b <= 1, and atan t = pi/4 + atan((a - b)/(a + b)) for t > tan(pi/8),
* acos: pi/2 - asin x for |x| <= 1/2, and 2 asin(sqrt((1 - x)/2)) for larger x.

n ln 2 and n pi/2 are subtracted in parts (Cody and Waite): the products of n with all but the last part are
exact. The polynomials hold only the part of the function that differs from its leading terms, so that
their rounding counts little. Their coefficients interpolate that part at the zeros of a Chebyshev
polynomial, computed with 60 digits and rounded; the names end in the power of the polynomial's variable.
They are summed in groups of four (Estrin), which shortens the chain of dependent operations.

Errors are in units in the last place (ulp) of the result, found by comparison with 70 digits. Arguments
must be finite.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from meltemi.compiler.generic import floor, split, two_to, where
from meltemi.compiler.kernels import kernel

LOG2_E = 1.4426950408889634
LN2_A = 0.6931471805598903  # the first 42 bits
LN2_B = 5.497923018708371e-14

TWO_OVER_PI = 0.6366197723675814
PI = 3.141592653589793
HALF_PI = 1.5707963267948966
QUARTER_PI = 0.7853981633974483
HALF_PI_A = 1.5707963267341256  # 33 bits each, and the rest
HALF_PI_B = 6.077100506303966e-11
HALF_PI_C = 2.0222662487959506e-21
TAN_PI_8 = 0.41421356237309503

EXP_LOW = -708.0
EXP_HIGH = 710.0
TANH_ONE = 20.0
"""tanh x = 1 in double precision from here on."""

# (exp(r) - 1 - r) / r^2, |r| <= ln(2)/2: error of exp 2e-17
EXP_0 = 0.5
EXP_1 = 0.16666666666666669
EXP_2 = 0.041666666666624164
EXP_3 = 0.008333333333330065
EXP_4 = 0.0013888888917196719
EXP_5 = 0.00019841269863040545
EXP_6 = 2.4801521322368692e-05
EXP_7 = 2.7557268480310024e-06
EXP_8 = 2.7620075879983367e-07
EXP_9 = 2.5100375832561234e-08

# (2 atanh(s) - 2 s) / s^3 by s^2, |s| <= (sqrt(2) - 1)/(sqrt(2) + 1): 4e-18 of log
LOG_0 = 0.666666666666667
LOG_1 = 0.39999999999899505
LOG_2 = 0.28571428625975487
LOG_3 = 0.22222211134795078
LOG_4 = 0.1818288912526188
LOG_5 = 0.1533172160055169
LOG_6 = 0.14616449685088906

# (sin(r) - r) / r^3 by r^2, |r| <= pi/4: 2e-17 of sin
SIN_0 = -0.16666666666666666
SIN_1 = 0.008333333333330948
SIN_2 = -0.00019841269836758574
SIN_3 = 2.755731610255244e-06
SIN_4 = -2.505113184500362e-08
SIN_5 = 1.591812929486638e-10

# (cos(r) - 1 + r^2/2) / r^4 by r^2, |r| <= pi/4: 1e-18 of cos
COS_0 = 0.041666666666666664
COS_1 = -0.0013888888888887398
COS_2 = 2.480158729876569e-05
COS_3 = -2.7557317271729777e-07
COS_4 = 2.087614626840078e-09
COS_5 = -1.138263242537927e-11

# (atan(t) - t) / t^3 by t^2, |t| <= tan(pi/8): 6e-18 of atan
ATAN_0 = -0.3333333333333333
ATAN_1 = 0.1999999999999552
ATAN_2 = -0.14285714284666542
ATAN_3 = 0.11111111015256361
ATAN_4 = -0.09090904578123901
ATAN_5 = 0.07692183190826078
ATAN_6 = -0.06664511447381855
ATAN_7 = 0.05858148912801507
ATAN_8 = -0.050854497379370145
ATAN_9 = 0.03923165829550329
ATAN_10 = -0.01917688711896928

# (asin(s) - s) / s^3 by s^2, |s| <= 1/2: 6e-17 of asin
ASIN_0 = 0.1666666666666665
ASIN_1 = 0.07500000000020764
ASIN_2 = 0.044642857103423646
ASIN_3 = 0.030381947367098483
ASIN_4 = 0.0223720476317445
ASIN_5 = 0.01735525995578648
ASIN_6 = 0.013929652902324969
ASIN_7 = 0.01187549438264838
ASIN_8 = 0.007802949477301906
ASIN_9 = 0.016035514349293623
ASIN_10 = -0.010749050339930202
ASIN_11 = 0.02816921806104353

# (tan(r) - r) / r^3 = P(r^2) / (1 + r^2 Q(r^2)), |r| <= pi/4: 2e-17 of tan
TAN_P0 = 0.3333333333333333
TAN_P1 = -0.021440999355182126
TAN_P2 = 0.00024480336177253004
TAN_P3 = -1.7860849052603087e-08
TAN_Q0 = -0.46432299806554633
TAN_Q1 = 0.024558847406773037
TAN_Q2 = -0.00025595370500335583


class SinCos(NamedTuple):
    """Sine and cosine of one angle."""

    sin: float
    cos: float


@kernel
def _four(z: float, z2: float, a: float, b: float, c: float, d: float) -> float:
    """The cubic polynomial in z with coefficients a to d, z2 = z^2."""
    return (a + b * z) + z2 * (c + d * z)


@kernel
def _growth(r: float) -> float:
    """exp(r) - 1 for |r| <= ln(2)/2."""
    r2 = r * r
    r4 = r2 * r2
    low = _four(r, r2, EXP_0, EXP_1, EXP_2, EXP_3)
    high = _four(r, r2, EXP_4, EXP_5, EXP_6, EXP_7) + r4 * (EXP_8 + EXP_9 * r)
    return r + r2 * (low + r4 * high)


@kernel
def exp(x: float) -> float:
    """e^x to 1.2 ulp; 0 below -708, infinity above 709.78."""
    y = where(x > EXP_HIGH, EXP_HIGH, where(x < EXP_LOW, EXP_LOW, x))
    n = floor(y * LOG2_E + 0.5)
    g = _growth((y - n * LN2_A) - n * LN2_B)
    # n reaches 1024, for which 2^n overflows
    return where(x < EXP_LOW, 0.0, ((1.0 + g) * two_to(n - 1.0)) * 2.0)


@kernel
def _less_one(x: float) -> float:
    """e^x - 1 from -708 to 709."""
    n = floor(x * LOG2_E + 0.5)
    power = two_to(n)
    return power * _growth((x - n * LN2_A) - n * LN2_B) + (power - 1.0)


@kernel
def expm1(x: float) -> float:
    """e^x - 1 to 2.5 ulp, for x up to 709."""
    return _less_one(where(x < EXP_LOW, EXP_LOW, x))


@kernel
def tanh(x: float) -> float:
    """Hyperbolic tangent to 2.5 ulp, for all x."""
    a = abs(x)
    y = where(a > TANH_ONE, TANH_ONE, a)
    g = _less_one(y + y)
    t = g / (g + 2.0)
    return where(x < 0.0, -t, t)


@kernel
def log(x: float) -> float:
    """Natural logarithm to 1 ulp, for positive normal x."""
    m, e = split(x)
    f = m - 1.0
    s = f / (m + 1.0)
    z = s * s
    z2 = z * z
    p = _four(z, z2, LOG_0, LOG_1, LOG_2, LOG_3) + (z2 * z2) * ((LOG_4 + LOG_5 * z) + LOG_6 * z2)
    # 2 s = f - s f keeps the digits of f
    return e * LN2_A + (f - (s * (f - z * p) - e * LN2_B))


@kernel
def _less_quarters(x: float, n: float) -> float:
    """Angle x less n pi/2, for whole n up to 2^20."""
    return ((x - n * HALF_PI_A) - n * HALF_PI_B) - n * HALF_PI_C


@kernel
def sincos(x: float) -> SinCos:
    """Sine and cosine to 2.5 ulp, for |x| up to 1e6."""
    n = floor(x * TWO_OVER_PI + 0.5)
    r = _less_quarters(x, n)
    z = r * r
    z2 = z * z
    z4 = z2 * z2
    s = r + (r * z) * (_four(z, z2, SIN_0, SIN_1, SIN_2, SIN_3) + z4 * (SIN_4 + SIN_5 * z))
    c = _four(z, z2, COS_0, COS_1, COS_2, COS_3) + z4 * (COS_4 + COS_5 * z)
    c = 1.0 - (0.5 * z - z2 * c)
    q = n - 4.0 * floor(0.25 * n)  # quarters of a turn: 0, 1, 2 or 3
    odd = abs(q - 2.0) == 1.0
    sine, cosine = where(odd, c, s), where(odd, s, c)
    return SinCos(where(q > 1.5, -sine, sine), where(abs(q - 1.5) < 1.0, -cosine, cosine))


@kernel
def sin(x: float) -> float:
    """Sine to 2.5 ulp, for |x| up to 1e6; the cosine of the same angle shares its cost."""
    return sincos(x).sin


@kernel
def cos(x: float) -> float:
    """Cosine to 2.5 ulp, for |x| up to 1e6; the sine of the same angle shares its cost."""
    return sincos(x).cos


@kernel
def tan(x: float) -> float:
    """Tangent to 3.5 ulp, for |x| up to 1e6."""
    n = floor(x * TWO_OVER_PI + 0.5)
    r = _less_quarters(x, n)
    z = r * r
    z2 = z * z
    q = TAN_Q0 + TAN_Q1 * z + TAN_Q2 * z2
    p = _four(z, z2, TAN_P0, TAN_P1, TAN_P2, TAN_P3)
    above, below = r + (r * z) * (p + q), 1.0 + z * q
    even = 0.5 * n
    even_n = even == floor(even)
    return where(even_n, above, -below) / where(even_n, below, above)


@kernel
def atan2(y: float, x: float) -> float:
    """Angle of the point (x, y) to 2.5 ulp, in [-pi, pi]; 0 at the origin."""
    a, b = abs(y), abs(x)
    steep = a > b
    low, high = where(steep, b, a), where(steep, a, b)
    wide = low > TAN_PI_8 * high
    above, below = where(wide, low - high, low), where(wide, low + high, high)
    t = above / where(below > 0.0, below, 1.0)
    z = t * t
    z2 = z * z
    z4 = z2 * z2
    p = _four(z, z2, ATAN_0, ATAN_1, ATAN_2, ATAN_3)
    p = p + z4 * (_four(z, z2, ATAN_4, ATAN_5, ATAN_6, ATAN_7) + z4 * ((ATAN_8 + ATAN_9 * z) + ATAN_10 * z2))
    angle = t + (t * z) * p
    angle = where(wide, QUARTER_PI + angle, angle)
    angle = where(steep, HALF_PI - angle, angle)
    angle = where(x < 0.0, PI - angle, angle)
    return where(y < 0.0, -angle, angle)


@kernel
def acos(x: float) -> float:
    """Angle in [0, pi] with cosine x to 1.5 ulp, for x in [-1, 1]."""
    a = abs(x)
    outer = a > 0.5
    z = where(outer, 0.5 - 0.5 * a, x * x)
    s = where(outer, sqrt(z), x)
    z2 = z * z
    z4 = z2 * z2
    p = _four(z, z2, ASIN_0, ASIN_1, ASIN_2, ASIN_3)
    p = p + z4 * (_four(z, z2, ASIN_4, ASIN_5, ASIN_6, ASIN_7) + z4 * _four(z, z2, ASIN_8, ASIN_9, ASIN_10, ASIN_11))
    half = s + (s * z) * p
    return where(outer, where(x < 0.0, PI - (half + half), half + half), HALF_PI - half)
