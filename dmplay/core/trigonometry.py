"""Sine and cosine from sums and products alone, so that every processor gives the same bits.

An unstable system magnifies the last bit of a step by 10**17 in 500 turns. With the library's sine,
which differs between processors, the transcript of a long game would verify on one machine and fail
on another.
"""

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.batch_columns import Constants, select

# Half of pi in two parts, the first of 33 bits: small multiples of it are exact.
HALF_PI, HALF_PI_LOW = 1.57079632673412561417, 6.07710050650619224932e-11
EIGHTH_TURN = np.pi / 4  # the greatest angle that rounds to no quarter turn
# The polynomials of fdlibm's kernels, in z = x^2, highest power first.
SINE_COEFFICIENTS = (
    1.58969099521155010221e-10, -2.50507602534068634195e-08, 2.75573137070700676789e-06,
    -1.98412698298579493134e-04, 8.33333333332248946124e-03, -1.66666666666666324348e-01,
)  # fmt: skip
COSINE_COEFFICIENTS = (
    -1.13596475577881948265e-11, 2.08757232129817482790e-09, -2.75573143513906633035e-07,
    2.48015872894767294178e-05, -1.38888888888741095749e-03, 4.16666666666666019037e-02,
)  # fmt: skip
SINE_CONSTANTS = Constants(*SINE_COEFFICIENTS)
SINE_AND_COSINE_CONSTANTS = Constants(*map(complex, SINE_COEFFICIENTS, COSINE_COEFFICIENTS))


def compute_sine_and_cosine(x: Array) -> tuple[Array, Array]:
    """Return the sine and cosine of angles `[B]` in radians, exact to the last bit or two."""
    is_turned = abs(x) > EIGHTH_TURN
    if not (np.count_nonzero(is_turned) if is_turned.ndim else is_turned):
        return _sine_and_cosine_kernel(x)
    quarter_turns = np.rint(x * (2.0 / np.pi))
    sine, cosine = _sine_and_cosine_kernel(
        (x - quarter_turns * HALF_PI) - quarter_turns * HALF_PI_LOW
    )
    swapped = quarter_turns % 2 == 1
    final_sine, final_cosine = select(swapped, cosine, sine), select(swapped, sine, cosine)
    return (
        select(quarter_turns % 4 >= 2, -final_sine, final_sine),
        select((quarter_turns + 1) % 4 >= 2, -final_cosine, final_cosine),
    )


def compute_cosine_of_triple(x: Array) -> Array:
    """Return cos 3x of angles `[B]` within a quarter turn of 0, by the sine of half of each."""
    half = 0.5 * x
    sine = _sine_kernel(half, half * half)
    cosine = 1.0 - 2.0 * (sine * sine)
    return cosine * (4.0 * (cosine * cosine) - 3.0)


def _sine_and_cosine_kernel(x: Array) -> tuple[Array, Array]:
    """Return the sine and cosine of angles within an eighth of a turn of 0.

    The polynomials are the real and the imaginary part of one. At 64 rows this takes 5 us, not 7.
    """
    z = x * x
    first, *coefficients = SINE_AND_COSINE_CONSTANTS.for_column(z)
    complex_z = z.astype(complex)
    both = first * complex_z
    for coefficient in coefficients:
        both += coefficient
        both *= complex_z
    sine: Array = both.real * x
    cosine: Array = both.imag - 0.5
    sine += x
    cosine *= z
    cosine += 1.0
    return sine, cosine


def _sine_kernel(x: Array, z: Array) -> Array:
    """Return the sine's polynomial x + S6 x^3 + ... + S1 x^13, with z = x^2."""
    first, *coefficients = SINE_CONSTANTS.for_column(z)
    sine: Array = first * z
    for coefficient in coefficients:
        sine += coefficient
        sine *= z
    sine *= x
    sine += x
    return sine
