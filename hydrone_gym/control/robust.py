"""A second law, robust to what the paper's leaves out: thrust vectoring, and an observer of what nobody modelled.

    distance to the reference -> wanted velocity       square root far away: constant deceleration; linear nearby
    wanted velocity -> wanted acceleration             and the deceleration that the profile asks for, fed forward
    less the observed disturbance                      what the nominal model does not explain of the last velocities
    air: thrust vector -> tilt, collective thrust -> moments -> rotors, moments first, then lift, then yaw
    water: depth by rotors 1 and 3; heading and surge by 2 and 4, bow or stern along the velocity through the water

The observer predicts velocity and yaw rate with the nominal equations, the very ones that belief flies: in still
weather the error it works on is zero bit for bit. Its disturbance is that error over its time constant, world axes.
Near the surface the vehicle slows down until lateral speed and tilt are what a smooth crossing allows. Under water the
velocity of the water follows from the disturbance, so that a vehicle that holds its place turns against the current.
"""

import math
from collections import namedtuple
from dataclasses import astuple, fields
from typing import NamedTuple

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.control.approach import HOVER_BAND, flow_near, profile, surface_limits, too_fast, way_left
from hydrone_gym.control.envelope import Envelope, shaft_power_at
from hydrone_gym.control.law import Law, register
from hydrone_gym.control.mixing import mix_air, mix_water
from hydrone_gym.control.paper import shorten, signed_root
from hydrone_gym.control.reference import Integral, clamp
from hydrone_gym.physics.dynamics import step
from hydrone_gym.physics.parameters import vehicle_params
from hydrone_gym.physics.trigonometry import arctan, wrap
from hydrone_gym.surface import is_air
from hydrone_gym.vehicle import RobustGains, Vehicle

RobustGainParams = namedtuple("RobustGainParams", [spec.name for spec in fields(RobustGains)])  # type: ignore[misc]
_LEAST_LIFT = 3.0  # m/s^2 of upward thrust that tilt is reckoned with, whatever the vehicle falls with
_STILL = 0.06  # m/s through the water that is not worth a turn
_ASTRAY = 0.6  # rad off course at which a vehicle under water only turns
_MOST_FLOW = 1.0  # m/s of water that is believed
_MEMORY_BOUND = 150.0  # m/s and rad/s: beyond what a state may hold, by what a limited disturbance explains


class Observed(NamedTuple):
    """The disturbance: acceleration in world axes (m/s^2), and about the body's vertical axis (rad/s^2)."""

    x: float
    y: float
    z: float
    yaw: float


@inlined
def observed(state, memory, gains):
    """Return the disturbance that the memory, the velocity predicted for now, tells of; an empty one tells of none."""
    vx, vy, vz, r = memory
    empty = vx == 0.0 and vy == 0.0 and vz == 0.0 and r == 0.0
    rate, most = 0.0 if empty else 1.0 / gains.observer_time, gains.disturbance_limit
    return Observed(
        clamp(rate * (state.vx - vx), -most, most),
        clamp(rate * (state.vy - vy), -most, most),
        clamp(rate * (state.vz - vz), -most, most),
        clamp(rate * (state.r - r), -most, most),
    )


@inlined
def predict(now, disturbance, speeds, model, dt):
    """Return the memory for the next instant: the nominal velocity then, and what is left of today's error."""
    new = step(now.state, now.attitude, speeds, model.vehicle, now.medium, now.air, dt)
    left = model.gains.observer_time - dt
    return Integral(
        new.vx - left * disturbance.x,
        new.vy - left * disturbance.y,
        new.vz - left * disturbance.z,
        new.r - left * disturbance.yaw,
    )


@inlined
def steer(now, gains, flow, limit):
    """Return the wanted lateral acceleration (m/s^2, world) that tracks the reference, at most at a speed (m/s).

    `flow` is what the limit is reckoned from: a velocity (x, y in m/s) and its rate.
    """
    state, reference = now.state, now.reference
    ex, ey = reference.x - state.x, reference.y - state.y
    distance = np.sqrt(ex * ex + ey * ey)
    inverse = 1.0 / distance if distance > 1e-9 else 0.0
    ux, uy = inverse * ex, inverse * ey
    speed, slope = profile(distance, gains.position_p, gains.braking)
    wx, wy = reference.vx + speed * ux, reference.vy + speed * uy
    flow_x, flow_y, rate_x, rate_y = flow
    rx, ry = wx - flow_x, wy - flow_y
    vx, vy = shorten(rx, ry, limit)
    vx, vy = vx + flow_x, vy + flow_y
    closing = (state.vx - reference.vx) * ux + (state.vy - reference.vy) * uy
    free = rx * rx + ry * ry <= limit * limit
    slowing = slope * closing if closing > 0.0 and free else 0.0
    p = gains.velocity_p
    return p * (vx - state.vx) - slowing * ux + rate_x, p * (vy - state.vy) - slowing * uy + rate_y


@inlined
def tilt_wanted(now, disturbance, model):
    """Return the wanted roll and pitch (rad), and the thrust upwards (m/s^2)."""
    gains, state, attitude, reference = model.gains, now.state, now.attitude, now.reference
    flow = flow_near(now, model.world)
    limit, descent, tangent = surface_limits(now, gains, flow, model.world)
    error = reference.z - state.z
    speed, slope = profile(abs(error), gains.height_p, gains.height_braking)
    wanted = reference.vz + (speed if error > 0.0 else -speed)
    climb = clamp(wanted, -descent, gains.climb_limit)
    slowing = -slope * (state.vz - reference.vz) if wanted == climb else 0.0
    nearing = state.z - now.surface.elevation > HOVER_BAND and descent < gains.descent_limit
    slowing = gains.zone_braking if wanted < -descent and nearing else slowing
    up = clamp(gains.height_d * (climb - state.vz) + slowing, -gains.height_braking, gains.height_braking)
    up = max(up - disturbance.z + now.medium.weight * now.medium.inverse_mass, _LEAST_LIFT)
    ax, ay = steer(now, gains, flow, limit)
    ax, ay = shorten(ax - disturbance.x, ay - disturbance.y, up * tangent)
    ahead = ax * attitude.c_psi + ay * attitude.s_psi
    aside = ay * attitude.c_psi - ax * attitude.s_psi
    return arctan(-aside / up), arctan(ahead / np.sqrt(aside * aside + up * up)), up


@inlined
def air_control(now, disturbance, model):
    """Return four rotor speeds (rpm) in air."""
    gains, state, medium = model.gains, now.state, now.medium
    phi, theta, up = tilt_wanted(now, disturbance, model)
    p, d = gains.attitude_rate * gains.attitude_rate, 2.0 * gains.attitude_damping * gains.attitude_rate
    roll = (p * (phi - state.phi) - d * now.rates[0]) / medium.inverse_inertia_x
    pitch = (p * (theta - state.theta) - d * now.rates[1]) / medium.inverse_inertia_y
    turn = clamp(wrap(now.reference.psi - state.psi), -gains.yaw_limit, gains.yaw_limit)
    p, d = gains.yaw_rate * gains.yaw_rate, 2.0 * gains.yaw_rate
    yaw = (p * turn - d * now.rates[2] - disturbance.yaw) / medium.inverse_inertia_z
    lift = up / (medium.inverse_mass * now.attitude.c_phi * now.attitude.c_theta)
    return mix_air(lift, roll, pitch, yaw, model.vehicle, medium)


@inlined
def flow_along(velocity, disturbance, drag):
    """Velocity of the water along an axis (m/s) whose drag explains a disturbance along it (m/s^2)."""
    total = disturbance - drag * abs(velocity) * velocity
    return clamp(velocity + signed_root(total / drag), -_MOST_FLOW, _MOST_FLOW)


@inlined
def course(now, disturbance, gains, limit):
    """Return where to swim: (wanted and present speed through the water along the bow, m/s; error of heading, rad).

    The bow or the stern points along the velocity through the water, the wanted one over ground less the current, and
    within the hold radius against the current alone, at most at the speed `limit` (m/s). A vehicle that is not worth
    turning, and one inside the zone in vertical mode, drifts with the water.
    """
    state, attitude, reference = now.state, now.attitude, now.reference
    ahead = state.vx * attitude.c_psi + state.vy * attitude.s_psi
    aside = state.vy * attitude.c_psi - state.vx * attitude.s_psi
    pushed = disturbance.x * attitude.c_psi + disturbance.y * attitude.s_psi
    dragged = disturbance.y * attitude.c_psi - disturbance.x * attitude.s_psi
    flow_x, flow_y = flow_along(ahead, pushed, now.medium.drag_x), flow_along(aside, dragged, now.medium.drag_y)
    dx, dy = reference.x - state.x, reference.y - state.y
    distance = np.sqrt(dx * dx + dy * dy)
    speed, _ = profile(max(distance - gains.hold_radius, 0.0), gains.surge_p, gains.surge_braking)
    share = min(speed, gains.surge_limit) / distance if distance > gains.hold_radius else 0.0
    wx = share * (dx * attitude.c_psi + dy * attitude.s_psi) - flow_x
    wy = share * (dy * attitude.c_psi - dx * attitude.s_psi) - flow_y
    drive = wx * wx + wy * wy > _STILL * _STILL and not now.vertical
    error = arctan(wy / wx) if wx != 0.0 else 0.5 * np.pi
    on_course = max(1.0 - error * error / (_ASTRAY * _ASTRAY), 0.0)
    size = min(np.sqrt(wx * wx + wy * wy), limit) * on_course
    wanted = -size if wx < 0.0 else size
    return wanted if drive else 0.0, ahead - flow_x, error if drive else 0.0


@inlined
def water_control(now, disturbance, model):
    """Return four rotor speeds (rpm) in water."""
    gains, state, medium, attitude = model.gains, now.state, now.medium, now.attitude
    error = now.reference.z - state.z
    speed, _ = profile(abs(error), gains.depth_p, gains.depth_braking)
    below, seconds = way_left(now, gains)
    excess = too_fast(now, gains, flow_near(now, model.world), seconds, model.world)
    rise = min(gains.rise_limit, below * gains.zone_braking / excess) if excess > 0.0 else gains.rise_limit
    climb = clamp(now.reference.vz + (speed if error > 0.0 else -speed), -gains.dive_limit, rise)
    upwards = gains.depth_d * (climb - state.vz) - disturbance.z + medium.drag_z * abs(climb) * climb
    lift = (upwards / medium.inverse_mass + medium.weight) / (attitude.c_phi * attitude.c_theta)
    level = -(gains.level_p * state.theta + gains.level_d * now.rates[1]) / medium.inverse_inertia_y
    surfacing = gains.crossing_share * model.world.rough_speed + gains.zone_braking * seconds
    limit = min(gains.surge_limit, surfacing) if is_air(now.reference.z) else gains.surge_limit
    wanted, surge, off = course(now, disturbance, gains, limit)
    push = (gains.surge_d * (wanted - surge) + medium.drag_x * abs(wanted) * wanted) / medium.inverse_mass
    fastest = gains.turn_limit
    rate = clamp(gains.heading_p * off, -fastest, fastest)
    turning = gains.heading_d * (rate - state.r) - disturbance.yaw + medium.rotational_drag_z * abs(rate) * rate
    yaw = turning / medium.inverse_inertia_z
    return mix_water(lift, level, push, yaw, model.vehicle, medium)


@inlined
def robust_control(now, memory, model, dt):
    """Fly the medium's law, and predict what comes of it."""
    disturbance = observed(now.state, memory, model.gains)
    speeds = air_control(now, disturbance, model) if now.air else water_control(now, disturbance, model)
    return speeds, predict(now, disturbance, speeds, model, dt)


@inlined
def pre_spin_of(gains):
    """Depth (m) above which the aerial rotors of a rising vehicle turn already."""
    return gains.pre_spin


@inlined
def attitude_reference(now, gains):
    """Return what the law steers to in attitude: heading in air only, since tilt follows from its memory too."""
    return np.nan, np.nan if now.air else 0.0, now.reference.psi if now.air else np.nan


def _gains_of(vehicle: Vehicle) -> RobustGainParams:
    """Return the gains of a vehicle: attitude as fast as its rotors follow, turns as fast as its thrusters manage."""
    gains = vehicle.robust_gains
    numbers = dict(zip(RobustGainParams._fields, astuple(gains), strict=True))
    if vehicle.rotor_lag_air > 0.0:
        numbers["attitude_rate"] = min(gains.attitude_rate, 0.5 / vehicle.rotor_lag_air)
    water = vehicle_params(vehicle).water
    moment = 2.0 * vehicle.arm * water.thrust * water.rotor_max**2
    resisted = water.rotational_drag_z / water.inverse_inertia_z
    numbers["turn_limit"] = min(gains.turn_limit, math.sqrt(0.8 * moment / resisted)) if resisted else gains.turn_limit
    numbers["tilt_limit"] = math.tan(gains.tilt_limit)
    return RobustGainParams(**numbers)


def _envelope_of(vehicle: Vehicle) -> Envelope:
    """Work out the limits of a vehicle under this law."""
    gains, params = vehicle.robust_gains, vehicle_params(vehicle)
    water = params.water
    surge = min(gains.surge_limit, math.sqrt(2.0 * water.thrust * water.inverse_mass / water.drag_x) * water.rotor_max)
    swimming = surge * math.sqrt(0.5 * water.drag_x / (water.inverse_mass * water.thrust))
    return Envelope(
        cruise=gains.speed_limit,
        climb=gains.descent_limit,
        surge=surge,
        dive=gains.dive_limit,
        zone=gains.rise_limit,
        stop_time=0.37,  # a little more than it takes, 0.94 m from 2.8 m/s: benchmarks/stop_distances.py
        ahead_air=0.15,
        ahead_water=0.1,
        hold_radius=gains.hold_radius,
        flight_power=shaft_power_at(params.air, vehicle.hover_speed, 4),
        swim_power=shaft_power_at(water, swimming, 2) + shaft_power_at(water, vehicle.neutral_speed, 2),
        height_memory=_MEMORY_BOUND,
        attitude_memory=_MEMORY_BOUND,
    )


register(RobustGainParams, robust_control, attitude_reference, pre_spin_of)
LAW = Law("robust", RobustGainParams, _gains_of, _envelope_of)
