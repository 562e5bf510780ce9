"""The paper's control laws: cascaded PID in air (eqs. 5-8), depth, pitch, heading and surge in water (eqs. 13-16).

In air (deviations E10, E11 and the speed law) the commanded velocity is limited so that any reference is safe.
In water (E12, E13) the mixing matrix is the printed one, but it mixes thrusts in newtons, and each rotor's speed
follows by the signed root of its thrust: the thrust of a rotor is flat around rest, and a law linear in rpm sticks.
"""

import math
from collections import namedtuple
from dataclasses import astuple, fields
from typing import NamedTuple

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.control.envelope import Envelope, shaft_power_at
from hydrone_gym.control.law import Law, register
from hydrone_gym.control.reference import Integral, accumulate, clamp
from hydrone_gym.physics.parameters import vehicle_params
from hydrone_gym.physics.trigonometry import arctan, wrap
from hydrone_gym.vehicle import AirGains, Vehicle, WaterGains

# `AirGains` and `WaterGains` as the kernels read them, field for field.
AirGainParams = namedtuple("AirGainParams", [spec.name for spec in fields(AirGains)])  # type: ignore[misc]
WaterGainParams = namedtuple("WaterGainParams", [spec.name for spec in fields(WaterGains)])  # type: ignore[misc]

_TILTING = 0.11  # s that a stop takes longer because the vehicle must tilt first


class PaperGains(NamedTuple):
    """The gains of both media."""

    air: AirGainParams
    water: WaterGainParams


def _gains_of(vehicle: Vehicle) -> PaperGains:
    air, water = astuple(vehicle.air_gains), astuple(vehicle.water_gains)
    return PaperGains(AirGainParams._make(air), WaterGainParams._make(water))


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
def air_control(now, integral, hover_speed, gains, dt):
    """Return four unsaturated rotor speeds (rpm) and the new `Integral`."""
    state, attitude, rates, reference, vertical = now.state, now.attitude, now.rates, now.reference, now.vertical
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
def water_control(now, integral, gains, dt):
    """Return four unsaturated rotor speeds (rpm) and the new `Integral`."""
    state, attitude, rates, reference, medium = now.state, now.attitude, now.rates, now.reference, now.medium
    error_z = reference.z - state.z
    limit = gains.vertical_speed_limit
    wanted = reference.vz + gains.depth_p / gains.depth_d * error_z
    climb = clamp(wanted, -limit, limit)
    gain_z = gains.depth_i if wanted == climb else 0.0
    integral_z = accumulate(integral.z, gain_z, error_z, gains.depth_i_limit, dt)
    drag = 0.5 * medium.drag_z / medium.inverse_mass * abs(climb) * climb
    upright = 1.0 / (attitude.c_phi * attitude.c_theta)
    lift = (gains.depth_d * (climb - state.vz) + integral_z + drag) * upright + 0.5 * medium.weight

    surge, error_psi, drive = surge_and_heading(state, attitude, reference, now.vertical, gains)
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


@inlined
def paper_control(now, integral, model, dt):
    """Fly the medium's law."""
    if now.air:
        speeds, memory = air_control(now, integral, model.vehicle.hover_speed, model.gains.air, dt)
    else:
        speeds, memory = water_control(now, integral, model.gains.water, dt)
    return speeds, memory


@inlined
def attitude_reference(now, gains):
    """Return roll, pitch and yaw (rad) that the law tracks; what it does not track is NaN.

    Under water roll is free, pitch is held level and yaw is the line of sight while the vehicle drives.
    """
    if now.air:
        phi, theta = tilt_reference(now.state, now.attitude, now.reference, now.vertical, gains.air)
        return phi, theta, now.reference.psi
    _, error, drive = surge_and_heading(now.state, now.attitude, now.reference, now.vertical, gains.water)
    return np.nan, 0.0, now.state.psi + error if drive else np.nan


@inlined
def pre_spin_of(gains):
    """Depth (m) above which the aerial rotors of a rising vehicle turn already."""
    return gains.air.pre_spin


def _envelope_of(vehicle: Vehicle) -> Envelope:
    """Work out the limits of a vehicle under this law."""
    air, water, params = vehicle.air_gains, vehicle.water_gains, vehicle_params(vehicle)
    swimming = math.sqrt(water.surge_limit / params.water.thrust)
    return Envelope(
        cruise=air.speed_limit,
        climb=air.vertical_speed_limit,
        surge=math.sqrt(2.0 * water.surge_limit * params.water.inverse_mass / params.water.drag_x),
        dive=water.vertical_speed_limit,
        zone=air.zone_speed_limit,
        # what the speed's first-order loop and the attitude's take, to the centisecond: benchmarks/stop_distances.py
        stop_time=round(1.0 / (vehicle.gravity * air.position_d) + _TILTING, 2),
        ahead_air=0.2,
        ahead_water=0.1,
        hold_radius=water.hold_radius,
        flight_power=shaft_power_at(params.air, vehicle.hover_speed, 4),
        swim_power=shaft_power_at(params.water, swimming, 2) + shaft_power_at(params.water, vehicle.neutral_speed, 2),
        height_memory=max(air.altitude_i_limit, water.depth_i_limit),
        attitude_memory=max(air.attitude_i_limit, water.attitude_i_limit),
    )


register(PaperGains, paper_control, attitude_reference, pre_spin_of)
LAW = Law("paper", PaperGains, _gains_of, _envelope_of)
