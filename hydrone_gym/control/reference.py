"""What a control law looks at and what it remembers (paper's r, and the integrals of eqs. 6, 7, 14, 15)."""

from typing import NamedTuple

from hydrone_gym._jit import inlined
from hydrone_gym.physics.kinematics import Attitude, State
from hydrone_gym.physics.parameters import MediumParams


class Reference(NamedTuple):
    """Where the controller should be now, and how fast that point moves."""

    x: float  # m
    y: float
    z: float
    psi: float  # rad
    vx: float  # m/s
    vy: float
    vz: float


class Integral(NamedTuple):
    """Controller memory, zero at a crossing: integral contributions in output units (rpm in air, N in water).

    The robust law keeps the velocity (m/s) and the yaw rate (rad/s) that it predicts here.
    """

    z: float
    phi: float
    theta: float
    psi: float


class Surface(NamedTuple):
    """The water's surface below or above a vehicle, as its controller perceives it."""

    elevation: float  # above its mean, m
    vx: float  # velocity of the water, m/s
    vy: float
    ax: float  # and its acceleration, m/s^2
    ay: float


FLAT = Surface(0.0, 0.0, 0.0, 0.0, 0.0)  # water at rest


class Instant(NamedTuple):
    """Everything a law looks at."""

    state: State
    attitude: Attitude
    rates: tuple  # of the Euler angles, rad/s
    reference: Reference
    vertical: bool  # whether the vehicle has to hold still laterally, in the transition zone
    air: bool
    medium: MediumParams
    surface: Surface


@inlined
def clamp(value, low, high):
    """Limit a value to [low, high]; NaN passes through."""
    value = low if value < low else value
    return high if value > high else value


@inlined
def accumulate(integral, gain, error, limit, dt):
    """Advance one integral contribution, clamped: anti-windup."""
    return clamp(integral + gain * error * dt, -limit, limit)
