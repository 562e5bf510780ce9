"""The spaces of both interfaces; those of `interface="world"` have finite bounds that no flight can leave."""

import math

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike

from hydrone_gym.control.laws import envelope_of
from hydrone_gym.perception.egocentric import LIMIT, OBSERVATION_SIZE
from hydrone_gym.simulation.advance import RATE_BOUND, SPEED_BOUND
from hydrone_gym.simulation.clock import TICK
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.world.world import World

# A flight ends in the first tick outside the box. The factor leaves room for a speed that the tick's end does not show.
OVERSHOOT = 2.0 * SPEED_BOUND * TICK  # m


def action_space(world: World) -> spaces.Box:
    """References x, y, z (m) inside the box and psi (rad), (4,) float32."""
    low = np.array([*world.lower, -math.pi], np.float32)
    return spaces.Box(low, np.array([*world.upper, math.pi], np.float32), dtype=np.float32)


def observation_space(simulation: Simulation, num_obstacles: int) -> spaces.Dict:
    """Dict of float64 boxes: state (12,), integral (4,), reference (4,), goal (3,), obstacles (num_obstacles, 4)."""
    world, envelope = simulation.world, envelope_of(simulation.vehicle, simulation.law)
    lower, upper, reference = np.array(world.lower), np.array(world.upper), action_space(world)
    moving = [math.pi / 2, math.pi / 2, math.pi] + 3 * [SPEED_BOUND] + 3 * [RATE_BOUND]
    memory = np.array([envelope.height_memory] + 3 * [envelope.attitude_memory])
    # A scenario may hold larger spheres than are drawn, and spheres that only reach into the box.
    size = float((upper - lower).max())
    bounds: dict[str, ArrayLike] = {
        "state": (np.append(lower - OVERSHOOT, np.negative(moving)), np.append(upper + OVERSHOOT, moving)),
        "integral": (-memory, memory),
        "reference": (reference.low, reference.high),
        "goal": (lower, upper),
        "obstacles": np.tile([[[*lower - size, 0.0]], [[*upper + size, size]]], (1, num_obstacles, 1)),
    }
    return spaces.Dict({key: spaces.Box(*np.array(ends, np.float64), dtype=np.float64) for key, ends in bounds.items()})


def relative_action_space() -> spaces.Box:
    """Actions of `interface="egocentric"`: offsets in the mission frame, (3,) float32 in [-1, 1]."""
    return spaces.Box(-1.0, 1.0, (3,), np.float32)


def egocentric_space() -> spaces.Box:
    """Observations of `interface="egocentric"`, (68,) float32 in [-5, 5]."""
    return spaces.Box(-LIMIT, LIMIT, (OBSERVATION_SIZE,), np.float32)
