"""Control in air: cascaded PID in rotor speed (paper eqs. 5-8; deviations E10, E11 and the speed law)."""

from typing import NamedTuple

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.control.reference import Integral, accumulate, clamp
from hydrone_gym.physics.trigonometry import wrap


class AirGainParams(NamedTuple):
    """`hydrone_gym.vehicle.AirGains` as the kernels read it, field for field."""

    altitude_p: float
    altitude_d: float
    altitude_i: float
    altitude_i_limit: float
    roll_p: float
    roll_d: float
    pitch_p: float
    pitch_d: float
    yaw_p: float
    yaw_d: float
    attitude_i: float
    attitude_i_limit: float
    yaw_limit: float
    position_p: float
    position_d: float
    tilt_limit: float
    vertical_tilt_limit: float
    speed_limit: float
    vertical_speed_limit: float
    zone_speed_limit: float
    zone_lateral_speed: float


@inlined
def shorten(x, y, limit):
    """Scale a planar vector down to a length; shorter ones are unchanged."""
    length = np.sqrt(x * x + y * y)
    scale = limit / length if length > limit else 1.0
    return scale * x, scale * y


@inlined
def tilt_reference(state, attitude, reference, vertical, gains):
    """Roll and pitch references that track the reference laterally, or brake in vertical mode.

    The commanded velocity v_ref + (Kp/Kd) e is limited in length, so the vehicle stops short (0.97 m from 2 m/s)
    whatever reference is sent; the paper's PD law on position is the same where the limit does not bind.
    """
    rate = gains.position_p / gains.position_d
    vx, vy = shorten(
        reference.vx + rate * (reference.x - state.x), reference.vy + rate * (reference.y - state.y), gains.speed_limit
    )
    vx = 0.0 if vertical else vx
    vy = 0.0 if vertical else vy
    ax, ay = shorten(
        gains.position_d * (vx - state.vx),
        gains.position_d * (vy - state.vy),
        gains.vertical_tilt_limit if vertical else gains.tilt_limit,
    )
    return ax * attitude.s_psi - ay * attitude.c_psi, ax * attitude.c_psi + ay * attitude.s_psi  # E11


@inlined
def descent_share(state, vertical, gains):
    """Share of the speed limit allowed downwards: in vertical mode the vehicle waits above the water until it is still.

    One below `zone_lateral_speed`, zero above twice that.
    """
    lateral = np.sqrt(state.vx * state.vx + state.vy * state.vy)
    return clamp(2.0 - lateral / gains.zone_lateral_speed, 0.0, 1.0) if vertical else 1.0


@inlined
def air_control(state, attitude, rates, integral, reference, vertical, hover_speed, gains, dt):
    """Return four unsaturated rotor speeds (rpm) and the new `Integral`."""
    error_z = reference.z - state.z
    limit = gains.zone_speed_limit if vertical else gains.vertical_speed_limit
    wanted = reference.vz + gains.altitude_p / gains.altitude_d * error_z
    climb = clamp(wanted, -limit * descent_share(state, vertical, gains), limit)
    # integrate only while the speed limit does not bind: the error is then no fault of the model
    gain_z = gains.altitude_i if wanted == climb else 0.0
    integral_z = accumulate(integral.z, gain_z, error_z, gains.altitude_i_limit, dt)
    lift = (gains.altitude_d * (climb - state.vz) + integral_z) / (attitude.c_phi * attitude.c_theta) + hover_speed

    phi_ref, theta_ref = tilt_reference(state, attitude, reference, vertical, gains)
    error_phi = phi_ref - state.phi
    error_theta = theta_ref - state.theta
    error_psi = wrap(reference.psi - state.psi)
    integral_phi = accumulate(integral.phi, gains.attitude_i, error_phi, gains.attitude_i_limit, dt)
    integral_theta = accumulate(integral.theta, gains.attitude_i, error_theta, gains.attitude_i_limit, dt)
    integral_psi = accumulate(integral.psi, gains.attitude_i, error_psi, gains.attitude_i_limit, dt)
    roll = gains.roll_p * error_phi - gains.roll_d * rates[0] + integral_phi
    pitch = gains.pitch_p * error_theta - gains.pitch_d * rates[1] + integral_theta
    yaw = gains.yaw_p * error_psi - gains.yaw_d * rates[2] + integral_psi
    yaw = clamp(yaw, -gains.yaw_limit, gains.yaw_limit)
    speeds = (lift - pitch + yaw, lift + roll - yaw, lift + pitch + yaw, lift - roll - yaw)
    return speeds, Integral(integral_z, integral_phi, integral_theta, integral_psi)
