"""The spaces of `interface="world"`: finite bounds that no flight can leave."""

import math

import numpy as np
from gymnasium import spaces

from hydrone_gym.control.laws import envelope_of
from hydrone_gym.simulation.advance import RATE_BOUND, SPEED_BOUND, TICK
from hydrone_gym.vehicle import Vehicle
from hydrone_gym.world.world import World

# A flight ends in the first tick outside the box. The factor leaves room for a speed that the tick's end does not show.
OVERSHOOT = 2.0 * SPEED_BOUND * TICK  # m


def action_space(world: World) -> spaces.Box:
    """References x, y, z (m) inside the box and psi (rad), (4,) float32."""
    low = np.array([*world.lower, -math.pi], np.float32)
    return spaces.Box(low, np.array([*world.upper, math.pi], np.float32), dtype=np.float32)


def observation_space(vehicle: Vehicle, world: World, num_obstacles: int) -> spaces.Dict:
    """Dict of float64 boxes: state (12,), integral (4,), reference (4,), goal (3,), obstacles (num_obstacles, 4)."""
    lower, upper = np.array(world.lower), np.array(world.upper)
    reference = action_space(world)
    moving = [math.pi / 2, math.pi / 2, math.pi] + 3 * [SPEED_BOUND] + 3 * [RATE_BOUND]
    envelope = envelope_of(vehicle)
    memory = np.array([envelope.height_memory] + 3 * [envelope.attitude_memory])
    # A scenario may hold larger spheres than are drawn, and spheres that only reach into the box.
    size = float((upper - lower).max())
    return spaces.Dict(
        {
            "state": _box(np.append(lower - OVERSHOOT, np.negative(moving)), np.append(upper + OVERSHOOT, moving)),
            "integral": _box(-memory, memory),
            "reference": _box(reference.low, reference.high),
            "goal": _box(lower, upper),
            "obstacles": _box(
                np.tile(np.append(lower - size, 0.0), (num_obstacles, 1)),
                np.tile(np.append(upper + size, size), (num_obstacles, 1)),
            ),
        }
    )


def _box(low: np.ndarray, high: np.ndarray) -> spaces.Box:
    return spaces.Box(low.astype(np.float64), high.astype(np.float64), dtype=np.float64)
