"""Test-only entry point: the integrator of the project at constant rotor speeds, at any step."""

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from hydrone_gym._jit import kernel
from hydrone_gym.physics.dynamics import medium_at, step
from hydrone_gym.physics.kinematics import State, attitude_of
from hydrone_gym.physics.parameters import vehicle_params
from hydrone_gym.surface import is_air


@kernel
def _steps(values, rotor_speed, vehicle, dt, count):
    state = State(*to_fixed_tuple(values, 12))
    speeds = to_fixed_tuple(rotor_speed, 4)
    for _ in range(count):
        air = is_air(state.z)
        state = step(state, attitude_of(state), speeds, vehicle, medium_at(vehicle, air), air, dt)
    for i, value in enumerate(state):
        values[i] = value


def steps(state, rpm, vehicle, dt, count):
    """Return the state after `count` steps of `dt` seconds."""
    values = np.array(state, dtype=np.float64)
    _steps(values, np.array(rpm, dtype=np.float64), vehicle_params(vehicle), float(dt), count)
    return values
