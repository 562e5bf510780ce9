"""Test-only entry point: steps of `immersed_step` at constant rotor speeds in a steady fluid, at any step."""

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple

from hydrone_gym._jit import kernel
from hydrone_gym.physics.immersion import Fluid, immersed_step, unmodelled_of
from hydrone_gym.physics.kinematics import State, attitude_of
from hydrone_gym.physics.parameters import hull_of, vehicle_params

STILL = Fluid(*[0.0] * 14, near_water=1.0)


@kernel
def _steps(values, rotor_speed, vehicle, real, fluid, driven, dt, path):
    state = State(*to_fixed_tuple(values, 12))
    speeds = (*to_fixed_tuple(rotor_speed, 4), 0.0)
    for k in range(len(path)):
        state, _ = immersed_step(state, attitude_of(state), speeds, vehicle, real, fluid, driven, 0.0, dt)
        for i, value in enumerate(state):
            path[k, i] = value


def immersed_path(state, vehicle, dt, count, *, fluid=STILL, rpm=(0.0, 0.0, 0.0, 0.0), driven=False):
    """Return the states (count, 12) after each of `count` steps of `dt` seconds."""
    path = np.empty((count, 12))
    numbers = np.array(state, dtype=np.float64), np.array(rpm, dtype=np.float64)
    real = unmodelled_of(hull_of(vehicle), float(dt))
    _steps(*numbers, vehicle_params(vehicle), real, fluid, bool(driven), float(dt), path)
    return path


def flowing(air=(0.0, 0.0, 0.0), water=(0.0, 0.0, 0.0), **others):
    """Return a `Fluid` whose air and water have steady velocities in m/s."""
    velocities = dict(zip(("air_x", "air_y", "air_z", "water_x", "water_y", "water_z"), (*air, *water), strict=True))
    return STILL._replace(**{name: float(value) for name, value in {**velocities, **others}.items()})
