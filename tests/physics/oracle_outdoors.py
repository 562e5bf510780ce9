"""A hull in wind, current and a wave, in matrix form: slow, obvious, and sharing no line with the kernels.

What surrounds the vehicle is a function of place and time, not of ticks; rotors lag as states of their own.
"""

from typing import NamedTuple

import numba
import numpy as np
from scipy.optimize import brentq

from hydrone_gym.vehicle import Vehicle
from tests.physics import oracle

GRAVITY = 9.78
AIR, WATER = 1.293, 1000.0
rotation, rate_matrix = numba.njit(oracle.rotation), numba.njit(oracle.rate_matrix)


class Hull(NamedTuple):
    arms: np.ndarray  # of the moments in air: l, l, E4; m
    mass: float
    volume: float
    added_mass: float
    inertia: np.ndarray  # diagonals, (3,)
    added_inertia: float
    drag: np.ndarray
    rotational_drag: np.ndarray
    restoring: float  # c (m + rho V) g in water, N m
    coupling: float  # E14
    thrust_air: float  # N/rpm^2
    thrust_water: np.ndarray  # curve, N/rpm^2 and so on
    lags: np.ndarray  # s, air and water
    rotor_drag: float  # N/(m/s)/(rad/s)
    height: float  # m
    near_radius: float  # m


class Around(NamedTuple):
    wind: np.ndarray  # (3,) m/s
    current: np.ndarray  # (3,) m/s
    amplitude: float  # m
    k: float  # 1/m
    omega: float  # rad/s
    way: np.ndarray  # (2,)
    phase: float
    depth: float


def hull(v: Vehicle) -> Hull:
    restoring = v.buoyancy_offset * (v.restoring_mass_share * v.mass + WATER * v.volume) * v.gravity
    curve = v.thrust_water_curve if v.thrust_water_curve[0] else (v.thrust_water, 0.0, 0.0)
    return Hull(
        np.array([v.arm, v.arm, v.yaw_arm_air]),
        v.mass,
        v.volume,
        v.added_mass,
        np.array(v.inertia),
        v.added_inertia,
        np.array(v.drag),
        np.array(v.rotational_drag),
        restoring,
        v.restoring_roll_coupling,
        AIR * v.thrust_air,
        WATER * np.array(curve),
        np.array([v.rotor_lag_air, v.rotor_lag_water]),
        v.rotor_drag,
        v.height,
        v.near_water_radius,
    )


def around(weather, phase, depth=5.0) -> Around:
    """What a weather of given directions, without gusts and eddies, puts around the vehicle."""

    def heading(angle):
        return np.array([np.cos(angle or 0.0), np.sin(angle or 0.0)])

    omega = 2 * np.pi / weather.wave_period
    k = brentq(lambda k: GRAVITY * k * np.tanh(k * depth) - omega**2, 1e-6, 1e3, xtol=1e-14)
    return Around(
        np.append(weather.wind * heading(weather.wind_direction), 0.0),
        np.append(weather.current * heading(weather.current_direction), 0.0),
        weather.wave_height / 2,
        k,
        omega,
        heading(weather.wave_direction),
        phase,
        depth,
    )


@numba.njit
def elevation(x, y, t, a):
    """Height of the surface and how fast it rises at a fixed place, and its slope along x and y."""
    theta = a.k * (a.way[0] * x + a.way[1] * y) - a.omega * t + a.phase
    slope = -a.amplitude * a.k * np.sin(theta)
    return a.amplitude * np.cos(theta), a.amplitude * a.omega * np.sin(theta), slope * a.way[0], slope * a.way[1]


@numba.njit
def water(x, y, z, t, a):
    """Velocity and local acceleration of the water, the Airy wave and the current."""
    theta = a.k * (a.way[0] * x + a.way[1] * y) - a.omega * t + a.phase
    below = min(z, 0.0)
    level = a.amplitude * a.omega * np.cosh(a.k * (below + a.depth)) / np.sinh(a.k * a.depth)
    upright = a.amplitude * a.omega * np.sinh(a.k * (below + a.depth)) / np.sinh(a.k * a.depth)
    velocity = np.array([level * np.cos(theta) * a.way[0], level * np.cos(theta) * a.way[1], upright * np.sin(theta)])
    rate = np.array([level * np.sin(theta) * a.way[0], level * np.sin(theta) * a.way[1], -upright * np.cos(theta)])
    return velocity + a.current, rate * a.omega


@numba.njit
def submerged(height, h, abrupt):
    if h == 0.0:
        return abrupt
    return min(max(0.5 - height / h, 0.0), 1.0)


@numba.njit
def derivative(y, t, wanted, driven, medium, h, a):
    """Rate of change of the state (12,) and four rotor speeds; `medium` is 1.0 in water for an abrupt surface."""
    position, velocity, omega = y[0:3], y[6:9], y[9:12]
    phi, theta = y[3], y[4]
    out = np.zeros(16)
    lag = h.lags[0] if driven else h.lags[1]
    rpm = y[12:16] if lag > 0.0 else wanted
    if lag > 0.0:
        out[12:16] = (wanted - rpm) / lag
    r = rotation(phi, theta, y[5])
    eta, rise, slope_x, slope_y = elevation(position[0], position[1], t, a)
    flow, flow_rate = water(position[0], position[1], position[2], t, a)
    clear = position[2] - eta
    s = submerged(clear, h.height, medium)
    # thrust
    corners = h.arms[0] * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    above = max(clear, h.near_radius)
    near = 1.0 + (h.near_radius / (4.0 * above)) ** 2 if above > 0.0 else 1.0
    f, turning = np.zeros(4), 0.0
    for i in range(4):
        wet = submerged(clear + (r @ corners[i])[2], h.height, s)
        n = abs(rpm[i])
        if driven:
            f[i] = near * h.thrust_air * rpm[i] * n * (1.0 - wet)
            turning += rpm[i] * 2 * np.pi / 60 * (1.0 - wet)
        else:
            f[i] = (h.thrust_water[0] + h.thrust_water[1] * n + h.thrust_water[2] * n**2) * rpm[i] * n * wet
    if driven:
        force = np.array([0.0, 0.0, f.sum()])
        moment = h.arms * np.array([f[1] - f[3], f[2] - f[0], f[0] - f[1] + f[2] - f[3]])
    else:
        force = np.array([f[1] + f[3], 0.0, f[0] + f[2]])
        moment = h.arms[0] * np.array([0.0, f[2] - f[0], f[1] - f[3]])
    # drag, of each fluid on its own
    in_air, in_water = r.T @ (velocity - a.wind), r.T @ (velocity - flow)
    drag = -h.drag * ((1.0 - s) * AIR * np.abs(in_air) * in_air + s * WATER * np.abs(in_water) * in_water)
    flapping = -h.rotor_drag * turning * np.array([in_air[0], in_air[1], 0.0])
    # added mass that comes and goes
    mass = h.mass + h.added_mass * ((1.0 - s) * AIR + s * WATER)
    steep = -h.added_mass * (WATER - AIR) / h.height if 0.0 < s < 1.0 and h.height > 0.0 else 0.0  # dm'/dz
    seen_rise = rise + slope_x * velocity[0] + slope_y * velocity[1]
    relative = velocity - flow
    entering = -steep * (velocity[2] - seen_rise) * relative
    entering[2] += 0.5 * steep * relative @ relative
    pushed = s * WATER * (h.added_mass + h.volume) * flow_rate
    weight = np.array([0.0, 0.0, -(h.mass - s * WATER * h.volume) * GRAVITY])
    out[0:3] = velocity
    out[3:6] = np.linalg.solve(rate_matrix(phi, theta), omega)
    out[6:9] = (r @ (force + drag + flapping) + weight + entering + pushed) / mass
    # rotation
    tilt = np.array([np.sin(phi), (1.0 + h.coupling * (np.cos(phi) - 1.0)) * np.sin(theta), 0.0])
    torque = moment - np.cross(omega, h.inertia * omega) - s * h.restoring * tilt
    dry, wet_inertia = h.inertia + AIR * h.added_inertia, h.inertia + WATER * h.added_inertia
    inverse = (1.0 - s) / dry + s / wet_inertia
    braking = (1.0 - s) * AIR * h.rotational_drag / dry + s * WATER * h.rotational_drag / wet_inertia
    out[9:12] = torque * inverse - braking * np.abs(omega) * omega
    return out
