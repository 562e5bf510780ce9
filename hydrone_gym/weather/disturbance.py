"""What else may move air and water: a jet, a squall line, a whirl, in one file of its own.

A disturbance is a named tuple of numbers and a kernel that tells the flow it makes at a place and time:

    class Jet(NamedTuple):
        x: float
        ...

    @inlined
    def flow(jet, chance, place, time):
        return (0.0, 0.0, up), (0.0, 0.0, 0.0)

    register(Jet, flow)

`Weather(extra=Jet(...))` adds it to the wind, current and waves of an environment.
"""

import math
from collections.abc import Callable
from typing import Any

from numba.extending import overload

MOST = 12  # numbers that a disturbance may have

_FLOWS: dict[type, Callable] = {}


def register(kind: type, flow: Callable) -> None:
    """Register the kernel of a disturbance under the class of its numbers.

    Args:
        kind: a `NamedTuple` of at most `MOST` numbers.
        flow: an inlined kernel, called as ``flow(numbers, chance, place, time)`` in the middle of every tick: `chance`
            are four numbers drawn for the episode, even between 0 and 1; `place` is (x, y, z) in m and `time` that of
            the episode in s. It returns the velocity (x, y, z in m/s) that it adds to the air, and that to the water.

    Raises:
        TypeError: numbers that are no `NamedTuple`, or too many.
    """
    if not hasattr(kind, "_fields") or len(kind._fields) > MOST:
        raise TypeError(f"a disturbance must be a NamedTuple of at most {MOST} numbers, got {kind!r}")
    _FLOWS[kind] = flow


def check(extra: Any) -> None:
    """Raise ValueError unless it is a registered disturbance of finite numbers."""
    if type(extra) not in _FLOWS:
        known = ", ".join(kind.__name__ for kind in _FLOWS) or "none yet"
        raise ValueError(f"Weather.extra must be a registered disturbance (known: {known}), got {extra!r}")
    for name, value in zip(extra._fields, extra, strict=True):
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ValueError(f"Weather.extra.{name} must be a finite number, got {value!r}")


def flow_of(numbers, chance, place, time):
    """Return the flow of a disturbance; for kernels."""


@overload(flow_of, jit_options={"forceinline": True, "error_model": "numpy"})
def _flow_of(numbers, chance, place, time):
    flow = _FLOWS[numbers.instance_class]

    def of_kind(numbers, chance, place, time):
        return flow(numbers, chance, place, time)

    return of_kind
