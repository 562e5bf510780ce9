"""From forces and moments to rotor speeds within their limits: what keeps the vehicle upright comes first."""

from hydrone_gym._jit import inlined
from hydrone_gym.control.paper import signed_root
from hydrone_gym.control.reference import clamp


@inlined
def mix_air(lift, roll, pitch, yaw, vehicle, medium):
    """Return four rotor speeds (rpm) for a lift (N) and moments (N m): roll and pitch first, then lift, then yaw.

    It never yaws for the sake of lift: what only a yawing moment would make room for is not given.
    """
    most = medium.thrust * medium.rotor_max * medium.rotor_max
    half = 0.5 / vehicle.arm
    a, b = clamp(half * roll, -0.5 * most, 0.5 * most), clamp(half * pitch, -0.5 * most, 0.5 * most)
    uneven = max(abs(a), abs(b))
    each = clamp(0.25 * lift, uneven, most - uneven)
    room = min(each, most - each) - uneven
    c = clamp(0.25 * yaw / vehicle.yaw_arm_air, -room, room)
    scale = 1.0 / medium.thrust
    return (
        _speed(each - b + c, scale, medium),
        _speed(each + a - c, scale, medium),
        _speed(each + b + c, scale, medium),
        _speed(each - a - c, scale, medium),
    )


@inlined
def mix_water(lift, pitch, push, yaw, vehicle, medium):
    """Return four rotor speeds (rpm) for forces up and ahead (N) and moments (N m), moments first.

    Pitch never takes more than 0.3 of a rotor's thrust: the vehicle rights itself.
    """
    most = medium.thrust * medium.rotor_max * medium.rotor_max
    half = 0.5 / vehicle.arm
    n, m = clamp(half * yaw, -most, most), clamp(half * pitch, -0.3 * most, 0.3 * most)
    room = most - abs(n)
    each, deep = clamp(0.5 * push, -room, room), clamp(0.5 * lift, abs(m) - most, most - abs(m))
    scale = 1.0 / medium.thrust
    return (
        _speed(deep - m, scale, medium),
        _speed(each + n, scale, medium),
        _speed(deep + m, scale, medium),
        _speed(each - n, scale, medium),
    )


@inlined
def _speed(force, scale, medium):
    """Rotor speed (rpm) of a thrust (N), within the rotor's limits."""
    return clamp(signed_root(force * scale), medium.rotor_min, medium.rotor_max)
