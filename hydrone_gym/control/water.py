"""Control in water: depth, pitch, heading and surge (paper eqs. 13-16; deviations E12, E13).

The mixing matrix is the printed one, but it mixes thrusts in newtons, and each rotor's speed follows by the signed root
of its thrust: the thrust of a rotor is flat around rest, and a law linear in rpm sticks there (E12).
"""

from typing import NamedTuple

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.control.reference import Integral, accumulate, clamp
from hydrone_gym.physics.trigonometry import arctan


class WaterGainParams(NamedTuple):
    """`hydrone_gym.vehicle.WaterGains` as the kernels read it, field for field."""

    depth_p: float
    depth_d: float
    depth_i: float
    depth_i_limit: float
    vertical_speed_limit: float
    pitch_p: float
    pitch_d: float
    yaw_p: float
    yaw_d: float
    attitude_i: float
    attitude_i_limit: float
    surge_p: float
    surge_misalignment: float
    surge_limit: float
    surge_brake: float
    hold_radius: float


@inlined
def signed_root(value):
    """Return sign(value) sqrt(abs(value))."""
    root = np.sqrt(abs(value))
    return -root if value < 0.0 else root


@inlined
def surge_and_heading(state, attitude, reference, vertical, gains):
    """Return (surge thrust a rotor in N, heading error in rad, whether the vehicle drives).

    The heading reference is the line of sight. The vehicle drives both ways, so the error lies within a right angle
    and its tangent is the ratio of the offsets seen from the body. Within the hold radius, and in vertical mode, it
    brakes surge and holds its heading: the printed law circles a reference for ever.
    """
    dx = reference.x - state.x
    dy = reference.y - state.y
    ahead = dx * attitude.c_psi + dy * attitude.s_psi
    aside = dy * attitude.c_psi - dx * attitude.s_psi
    distance = np.sqrt(dx * dx + dy * dy)
    drive = distance > gains.hold_radius and not vertical
    error = arctan(aside / ahead) if ahead != 0.0 else 0.5 * np.pi
    thrust = clamp(gains.surge_p * distance + gains.surge_misalignment * error * error, 0.0, gains.surge_limit)
    thrust = -thrust if ahead < 0.0 else thrust
    speed = state.vx * attitude.c_psi + state.vy * attitude.s_psi
    return thrust if drive else -gains.surge_brake * speed, error if drive else 0.0, drive


@inlined
def water_control(state, attitude, rates, integral, reference, vertical, medium, gains, dt):
    """Return four unsaturated rotor speeds (rpm) and the new `Integral`."""
    error_z = reference.z - state.z
    limit = gains.vertical_speed_limit
    wanted = reference.vz + gains.depth_p / gains.depth_d * error_z
    climb = clamp(wanted, -limit, limit)
    gain_z = gains.depth_i if wanted == climb else 0.0
    integral_z = accumulate(integral.z, gain_z, error_z, gains.depth_i_limit, dt)
    drag = 0.5 * medium.drag_z / medium.inverse_mass * abs(climb) * climb
    upright = 1.0 / (attitude.c_phi * attitude.c_theta)
    lift = (gains.depth_d * (climb - state.vz) + integral_z + drag) * upright + 0.5 * medium.weight

    surge, error_psi, drive = surge_and_heading(state, attitude, reference, vertical, gains)
    error_theta = -state.theta
    integral_theta = accumulate(integral.theta, gains.attitude_i, error_theta, gains.attitude_i_limit, dt)
    integral_psi = accumulate(integral.psi, gains.attitude_i, error_psi, gains.attitude_i_limit, dt)
    pitch = gains.pitch_p * error_theta - gains.pitch_d * rates[1] + integral_theta
    yaw = (gains.yaw_p * error_psi + integral_psi if drive else 0.0) - gains.yaw_d * rates[2]
    scale = 1.0 / medium.thrust
    speeds = (
        signed_root((lift - pitch) * scale),
        signed_root((surge + yaw) * scale),
        signed_root((lift + pitch) * scale),
        signed_root((surge - yaw) * scale),
    )
    return speeds, Integral(integral_z, integral.phi, integral_theta, integral_psi)
