"""What a control law is, and the controller that flies one: rotor limits and memory.

A law is one file that offers a `Law` and registers its kernels under the class of its gains. Nothing else knows which
law flies: a model carries gains of some class, and that class decides what is compiled.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from numba.extending import overload

from hydrone_gym._jit import inlined
from hydrone_gym.control.envelope import Envelope
from hydrone_gym.control.reference import clamp
from hydrone_gym.vehicle import Vehicle


class Law(NamedTuple):
    """What a control law offers."""

    name: str
    gains: type  # the class of its gains, a NamedTuple of numbers, under which its kernel is registered
    gains_of: Callable[[Vehicle], Any]  # those of a vehicle
    envelope_of: Callable[[Vehicle], Envelope]


class _Kernels(NamedTuple):
    """What a law does, compiled."""

    act: Callable
    tracks: Callable
    pre_spin: Callable


_KERNELS: dict[type, _Kernels] = {}


@inlined
def no_pre_spin(gains):
    """Rotors start when their medium is noticed."""
    return 0.0


def register(gains: type, act: Callable, tracks: Callable, pre_spin: Callable = no_pre_spin) -> None:
    """Register the kernels of a law under the class of its gains.

    Args:
        gains: that class.
        act: called as ``act(now, integral, model, dt)``: an `Instant`, the `Integral` so far, the `Model` with these
            gains, and the time step in s; returns four unsaturated rotor speeds (rpm) and the new `Integral`.
        tracks: called as ``tracks(now, gains)``; returns the roll, pitch and yaw (rad) that the law steers to, NaN for
            what it does not. For pictures only.
        pre_spin: called as ``pre_spin(gains)``; returns the depth (m) above which the aerial rotors of a rising vehicle
            turn already at hover speed, 0 for not at all. Without it they do not.
    """
    _KERNELS[gains] = _Kernels(act, tracks, pre_spin)


def _act(gains, now, integral, model, dt):
    """Run the law that gains belong to; for kernels."""


@overload(_act, jit_options={"forceinline": True, "error_model": "numpy"})
def _act_of(gains, now, integral, model, dt):
    law = _KERNELS[gains.instance_class].act

    def act(gains, now, integral, model, dt):
        return law(now, integral, model, dt)

    return act


def tracked(gains, now):
    """Return the attitude that a law steers to; for kernels."""


@overload(tracked, jit_options={"error_model": "numpy"})
def _tracked_of(gains, now):
    tracks = _KERNELS[gains.instance_class].tracks

    def tracked_by_law(gains, now):
        return tracks(now, gains)

    return tracked_by_law


def pre_spin(gains):
    """Depth (m) above which a law has the aerial rotors of a rising vehicle turn; for kernels."""


@overload(pre_spin, jit_options={"forceinline": True, "error_model": "numpy"})
def _pre_spin_of(gains):
    depth = _KERNELS[gains.instance_class].pre_spin

    def pre_spin_of_law(gains):
        return depth(gains)

    return pre_spin_of_law


@inlined
def control(now, integral, model, dt):
    """Return four saturated rotor speeds (rpm) and the new `Integral`.

    An integral only keeps its new value if no rotor saturated, which together with its clamp stops windup.
    """
    wanted, memory = _act(model.gains, now, integral, model, dt)
    w1, w2, w3, w4 = wanted
    low, high = now.medium.rotor_min, now.medium.rotor_max
    s1, s2, s3, s4 = clamp(w1, low, high), clamp(w2, low, high), clamp(w3, low, high), clamp(w4, low, high)
    free = s1 == w1 and s2 == w2 and s3 == w3 and s4 == w4
    return (s1, s2, s3, s4), memory if free else integral
