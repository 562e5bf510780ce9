"""State, rotation and Euler rates (paper eqs. 1, 3, 9, 11; deviation E3)."""

from typing import NamedTuple

from hydrone_gym._jit import inlined
from hydrone_gym.physics.trigonometry import sincos


class State(NamedTuple):
    """The 12 numbers of the paper's state vector x."""

    x: float  # position, world frame, m
    y: float
    z: float
    phi: float  # roll, pitch, yaw: ZXY Euler angles, rad
    theta: float
    psi: float
    vx: float  # velocity, world frame, m/s
    vy: float
    vz: float
    p: float  # angular velocity, body frame, rad/s
    q: float
    r: float


class Attitude(NamedTuple):
    """Sines and cosines of the Euler angles, computed once a substep."""

    s_phi: float
    c_phi: float
    s_theta: float
    c_theta: float
    s_psi: float
    c_psi: float


@inlined
def attitude_of(state):
    """Return the `Attitude` of a state."""
    s_phi, c_phi = sincos(state.phi)
    s_theta, c_theta = sincos(state.theta)
    s_psi, c_psi = sincos(state.psi)
    return Attitude(s_phi, c_phi, s_theta, c_theta, s_psi, c_psi)


@inlined
def to_world(attitude, bx, by, bz):
    """Rotate a body vector to the world frame with R = Rz(psi) Rx(phi) Ry(theta)."""
    s_phi, c_phi, s_theta, c_theta, s_psi, c_psi = attitude
    tx = c_theta * bx + s_theta * bz
    level = c_theta * bz - s_theta * bx
    ty = c_phi * by - s_phi * level
    return c_psi * tx - s_psi * ty, s_psi * tx + c_psi * ty, s_phi * by + c_phi * level


@inlined
def to_body(attitude, wx, wy, wz):
    """Rotate a world vector to the body frame with the transpose of R."""
    s_phi, c_phi, s_theta, c_theta, s_psi, c_psi = attitude
    tx = c_psi * wx + s_psi * wy
    ty = c_psi * wy - s_psi * wx
    level = c_phi * wz - s_phi * ty
    return c_theta * tx - s_theta * level, c_phi * ty + s_phi * wz, s_theta * tx + c_theta * level


@inlined
def euler_rates(attitude, p, q, r):
    """Return the rates of (phi, theta, psi) for a body angular velocity: the inverse of the printed matrix (E3)."""
    s_phi, c_phi, s_theta, c_theta, _, _ = attitude
    psi_rate = (c_theta * r - s_theta * p) / c_phi
    return c_theta * p + s_theta * r, q - s_phi * psi_rate, psi_rate
