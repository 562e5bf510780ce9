"""Equations of motion in both media and the integrator that steps them (paper eqs. 1-4 and 9-12; E1-E10, E14, E15)."""

from typing import NamedTuple

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import ArrayLike, NDArray

from hydrone_gym._jit import inlined, kernel
from hydrone_gym.physics.kinematics import State, attitude_of, euler_rates, to_body, to_world
from hydrone_gym.physics.parameters import vehicle_params
from hydrone_gym.physics.rotors import rotor_thrusts, rotor_wrench
from hydrone_gym.physics.trigonometry import wrap
from hydrone_gym.surface import is_air
from hydrone_gym.vehicle import HYDRONE, Vehicle, named_vehicle


class BodyAcceleration(NamedTuple):
    """Acceleration without drag, in body axes: linear (m/s^2), then angular (rad/s^2)."""

    x: float
    y: float
    z: float
    roll: float
    pitch: float
    yaw: float


@inlined
def medium_at(vehicle, air):
    """Return the coefficients of the medium."""
    return vehicle.air if air else vehicle.water


@inlined
def acceleration(state, attitude, wrench, force, vehicle, medium):
    """Return every acceleration but drag: rotors, gyroscopic and restoring moments, and a force (N) in world axes."""
    gx, gy, gz = to_body(attitude, force[0], force[1], force[2])
    tilt_pitch = attitude.s_theta * (1.0 + vehicle.restoring_roll_coupling * (attitude.c_phi - 1.0))
    p, q, r = state.p, state.q, state.r
    gyro_x = (vehicle.inertia_z - vehicle.inertia_y) * q * r
    gyro_y = (vehicle.inertia_x - vehicle.inertia_z) * r * p
    gyro_z = (vehicle.inertia_y - vehicle.inertia_x) * p * q
    return BodyAcceleration(
        (wrench.fx + gx) * medium.inverse_mass,
        gy * medium.inverse_mass,
        (wrench.fz + gz) * medium.inverse_mass,
        (wrench.mx - gyro_x - medium.restoring * attitude.s_phi) * medium.inverse_inertia_x,
        (wrench.my - gyro_y - medium.restoring * tilt_pitch) * medium.inverse_inertia_y,
        (wrench.mz - gyro_z) * medium.inverse_inertia_z,
    )


@inlined
def damped(rate, gain, dt):
    """Solve y = rate - dt gain abs(y) y for y: backward Euler for quadratic drag, in closed form.

    Unconditionally stable, monotone, and exact in steady state; explicit schemes blow up on the rotational drag in
    water above 0.08 rad/s.
    """
    return 2.0 * rate / (1.0 + np.sqrt(1.0 + 4.0 * gain * dt * abs(rate)))


@inlined
def step(state, attitude, speeds, vehicle, medium, air, dt):
    """Advance the state by dt seconds at constant rotor speeds: drag implicit, all else explicit, one evaluation."""
    wrench = rotor_wrench(vehicle, air, rotor_thrusts(medium, speeds))
    a = acceleration(state, attitude, wrench, (0.0, 0.0, -medium.weight), vehicle, medium)
    return integrate(state, attitude, a, medium, None, dt)


@inlined
def integrate(state, attitude, a, medium, fluid, dt):
    """Advance the state by dt seconds under a `BodyAcceleration`, with implicit drag.

    `fluid` is the velocity of what surrounds the vehicle, in body axes (m/s): drag works on the velocity relative to
    it. None stands for a fluid at rest.
    """
    bx, by, bz = to_body(attitude, state.vx, state.vy, state.vz)
    bx, by, bz = bx + dt * a.x, by + dt * a.y, bz + dt * a.z
    if fluid is None:
        bx, by, bz = damped(bx, medium.drag_x, dt), damped(by, medium.drag_y, dt), damped(bz, medium.drag_z, dt)
    else:
        bx = damped(bx - fluid[0], medium.drag_x, dt) + fluid[0]
        by = damped(by - fluid[1], medium.drag_y, dt) + fluid[1]
        bz = damped(bz - fluid[2], medium.drag_z, dt) + fluid[2]
    vx, vy, vz = to_world(attitude, bx, by, bz)
    p = damped(state.p + dt * a.roll, medium.rotational_drag_x, dt)
    q = damped(state.q + dt * a.pitch, medium.rotational_drag_y, dt)
    r = damped(state.r + dt * a.yaw, medium.rotational_drag_z, dt)
    half = 0.5 * dt
    phi_rate, theta_rate, psi_rate = euler_rates(attitude, state.p + p, state.q + q, state.r + r)
    return State(
        state.x + half * (state.vx + vx),
        state.y + half * (state.vy + vy),
        state.z + half * (state.vz + vz),
        state.phi + half * phi_rate,
        state.theta + half * theta_rate,
        wrap(state.psi + half * psi_rate),
        vx,
        vy,
        vz,
        p,
        q,
        r,
    )


@kernel
def _derivative(values, rotor_speed, vehicle, out):
    state = State(*to_fixed_tuple(values, 12))
    speeds = to_fixed_tuple(rotor_speed, 4)
    air = is_air(state.z)
    medium = medium_at(vehicle, air)
    attitude = attitude_of(state)
    wrench = rotor_wrench(vehicle, air, rotor_thrusts(medium, speeds))
    a = acceleration(state, attitude, wrench, (0.0, 0.0, -medium.weight), vehicle, medium)
    bx, by, bz = to_body(attitude, state.vx, state.vy, state.vz)
    out[0], out[1], out[2] = state.vx, state.vy, state.vz
    out[3], out[4], out[5] = euler_rates(attitude, state.p, state.q, state.r)
    out[6], out[7], out[8] = to_world(
        attitude,
        a.x - medium.drag_x * abs(bx) * bx,
        a.y - medium.drag_y * abs(by) * by,
        a.z - medium.drag_z * abs(bz) * bz,
    )
    out[9] = a.roll - medium.rotational_drag_x * abs(state.p) * state.p
    out[10] = a.pitch - medium.rotational_drag_y * abs(state.q) * state.q
    out[11] = a.yaw - medium.rotational_drag_z * abs(state.r) * state.r


def state_derivative(state: ArrayLike, rotor_speed: ArrayLike, vehicle: Vehicle | str = HYDRONE) -> NDArray[np.float64]:
    """Time derivative of the state at constant rotor speeds: the open-loop model of one medium.

    Args:
        state: (12,) position (m, world), ZXY Euler angles (rad), velocity (m/s, world), angular velocity (rad/s,
            body). ``state[2] > 0`` is air, otherwise water.
        rotor_speed: (4,) rotor speeds in rpm. Thrust has the sign of the speed in both media; limits are the
            controller's business and are not applied here.
        vehicle: a `Vehicle`, or "paper", "physical", "hydrone-2021" or "hydrone-agile".

    Returns:
        (12,) derivative of `state` (paper eqs. 1-4 and 9-12 with the corrections of docs/deviations.md).

    Raises:
        ValueError: wrong shape, a value that is not finite, or an unknown vehicle name.
    """
    values = _finite_vector("state", state, 12)
    speeds = _finite_vector("rotor_speed", rotor_speed, 4)
    out = np.empty(12)
    _derivative(values, speeds, vehicle_params(named_vehicle(vehicle)), out)
    return out


def _finite_vector(name: str, value: ArrayLike, length: int) -> NDArray[np.float64]:
    array = np.ascontiguousarray(value, dtype=np.float64)
    if array.shape != (length,):
        raise ValueError(f"{name} must have shape ({length},), got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got {array}")
    return array
