"""The water's surface: what lies above it is air, what lies on or below it is water.

The one place that knows where the media meet. `in_air` serves Python, for numbers and whole arrays; `is_air` is the
same rule for kernels.
"""

from typing import Any

from hydrone_gym._jit import inlined


def in_air(z: Any) -> Any:
    """Whether heights (m) are in air, element by element for an array; the switch at z = 0 is abrupt (paper)."""
    return z > 0.0


is_air = inlined(in_air)
