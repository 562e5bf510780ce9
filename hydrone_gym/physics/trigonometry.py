"""Sine, cosine and arctangent as polynomials.

Calls into the C library cannot be vectorised over lanes and differ between machines; these are plain arithmetic,
equal bit for bit everywhere, and within 4.5e-16 of the exact value (tests/physics/test_trigonometry.py).
Coefficients: FreeBSD msun ``k_sin.c`` and ``k_cos.c``; Cephes ``atan.c``.
"""

import math

from hydrone_gym._jit import inlined

_TWO_OVER_PI = 2.0 / math.pi
_ROUND = 6755399441055744.0  # 1.5 * 2**52: adding and taking it away rounds to the nearest integer
_HALF_PI_HIGH = 1.5707963267341256  # first 33 bits of pi/2
_HALF_PI_LOW = 6.077100506506192e-11
_TAN_3_PI_8 = 2.414213562373095
_MORE_BITS = 6.123233995736766e-17  # pi/2 less its double


@inlined
def sincos(angle):
    """Return (sin, cos) of an angle in radians, abs(angle) < 1e5."""
    quarter = (angle * _TWO_OVER_PI + _ROUND) - _ROUND
    r = (angle - quarter * _HALF_PI_HIGH) - quarter * _HALF_PI_LOW
    s = r * r
    sine = r + r * s * (
        -1.66666666666666324348e-01
        + s
        * (
            8.33333333332248946124e-03
            + s
            * (
                -1.98412698298579493134e-04
                + s * (2.75573137070700676789e-06 + s * (-2.50507602534068634195e-08 + s * 1.58969099521155010221e-10))
            )
        )
    )
    cosine = (1.0 - 0.5 * s) + s * s * (
        4.16666666666666019037e-02
        + s
        * (
            -1.38888888888741095749e-03
            + s
            * (
                2.48015872894767294178e-05
                + s * (-2.75573143513906633035e-07 + s * (2.08757232129817482790e-09 + s * -1.13596475577881948265e-11))
            )
        )
    )
    # quadrant in {-2, -1, 0, 1, 2}, kept a float: integer conversions do not vectorise everywhere
    quadrant = quarter - 4.0 * ((quarter * 0.25 + _ROUND) - _ROUND)
    odd = abs(quadrant) == 1.0
    half_turn = abs(quadrant) == 2.0
    sin_out = cosine if odd else sine
    cos_out = sine if odd else cosine
    sin_out = -sin_out if half_turn or quadrant == -1.0 else sin_out
    cos_out = -cos_out if half_turn or quadrant == 1.0 else cos_out
    return sin_out, cos_out


@inlined
def arctan(ratio):
    """Return the arctangent of a number, in radians; infinities give +-pi/2."""
    x = abs(ratio)
    big = x > _TAN_3_PI_8
    middle = x > 0.66
    numerator = -1.0 if big else (x - 1.0 if middle else x)
    denominator = x if big else (x + 1.0 if middle else 1.0)
    offset = math.pi / 2.0 if big else (math.pi / 4.0 if middle else 0.0)
    correction = _MORE_BITS if big else (0.5 * _MORE_BITS if middle else 0.0)
    t = numerator / denominator
    s = t * t
    p = (
        (((-8.750608600031904122785e-1 * s - 1.615753718733365076637e1) * s - 7.500855792314704667340e1) * s)
        - 1.228866684490136173410e2
    ) * s - 6.485021904942025371773e1
    q = (
        (((s + 2.485846490142306297962e1) * s + 1.650270098316988542046e2) * s + 4.328810604912902668951e2) * s
        + 4.853903996359136964868e2
    ) * s + 1.945506571482613964425e2
    result = offset + ((t * (s * (p / q)) + t) + correction)
    return -result if ratio < 0.0 else result


@inlined
def wrap(angle):
    """Bring an angle in [-3 pi, 3 pi] (radians) into [-pi, pi]."""
    angle = angle - 2.0 * math.pi if angle > math.pi else angle
    return angle + 2.0 * math.pi if angle < -math.pi else angle
