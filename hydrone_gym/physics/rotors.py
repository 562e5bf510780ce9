"""Rotor thrust, the wrench it makes in each medium, and shaft power (paper eqs. 2, 4, 10, 12; E4, E9)."""

from typing import NamedTuple

from hydrone_gym._jit import inlined


class Wrench(NamedTuple):
    """Force (N) and moment (N m) in body axes."""

    fx: float
    fz: float
    mx: float
    my: float
    mz: float


@inlined
def thrust(medium, speed):
    """Return the thrust of one rotor in newtons, signed like its speed in rpm (E9)."""
    return medium.thrust * speed * abs(speed)


@inlined
def rotor_thrusts(medium, speeds):
    """Return the thrusts of four rotor speeds (rpm) in N."""
    return thrust(medium, speeds[0]), thrust(medium, speeds[1]), thrust(medium, speeds[2]), thrust(medium, speeds[3])


@inlined
def rotor_wrench(vehicle, air, thrusts):
    """Return the `Wrench` of four thrusts (N): all lift in air; in water 1 and 3 lift, 2 and 4 drive."""
    f1, f2, f3, f4 = thrusts
    lift = f1 + f3
    drive = f2 + f4
    differential = vehicle.arm * (f2 - f4)
    return Wrench(
        0.0 if air else drive,
        lift + drive if air else lift,
        differential if air else 0.0,
        vehicle.arm * (f3 - f1),
        vehicle.yaw_arm_air * (lift - drive) if air else differential,
    )


@inlined
def shaft_power(medium, speeds):
    """Return the mechanical power of four rotors in watts, sum of rho eta abs(speed)^3 2 pi / 60."""
    a1, a2, a3, a4 = abs(speeds[0]), abs(speeds[1]), abs(speeds[2]), abs(speeds[3])
    return medium.power * (a1 * a1 * a1 + a2 * a2 * a2 + a3 * a3 * a3 + a4 * a4 * a4)
