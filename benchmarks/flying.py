"""Rows in mid-flight, for measurements below the environments: same rows for every contestant."""

import numpy as np

from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.simulation.storage import new_rows
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.world.world import World

WORLD = World()
OBSTACLES = 20


def flying_rows(rng: np.random.Generator, count: int, share_in_air: float = 0.5) -> np.ndarray:
    """Rows at random places of the box, slow and nearly level; height by medium."""
    rows = new_rows(count)
    state = rows["state"]
    state[:, :2] = rng.uniform(-8.0, 8.0, (count, 2))
    air = rng.uniform(size=count) < share_in_air
    state[:, 2] = np.where(air, rng.uniform(1.0, 9.0, count), rng.uniform(-4.0, -1.0, count))
    state[:, 3:5] = rng.uniform(-0.1, 0.1, (count, 2))
    state[:, 5] = rng.uniform(-np.pi, np.pi, count)
    state[:, 6:9] = rng.uniform(-0.5, 0.5, (count, 3))
    rows["reference"][:, :3], rows["reference"][:, 3] = state[:, :3], state[:, 5]
    rows["goal"] = np.inf
    rows["clearance"] = np.inf
    return rows


def near_references(rng: np.random.Generator, rows: np.ndarray) -> np.ndarray:
    """References (n, 4) within a metre of each row, any heading."""
    n = len(rows)
    return np.column_stack([rows["state"][:, :3] + rng.uniform(-1.0, 1.0, (n, 3)), rng.uniform(-np.pi, np.pi, n)])


def spheres_out_of_the_way(rng: np.random.Generator, count: int) -> np.ndarray:
    """Spheres (n, M, 4) that cost their distance computation and stop nobody."""
    centres = rng.uniform(WORLD.lower, WORLD.upper, (count, OBSTACLES, 3)) + 40.0
    return np.concatenate([centres, rng.uniform(0.5, 1.5, (count, OBSTACLES, 1))], axis=2)


def lane_major(spheres: np.ndarray, lanes: int) -> np.ndarray:
    """(n, M, 4) spheres as the kernel reads them: (blocks, 4 M lanes); the last block repeats its last row."""
    n, count, _ = spheres.shape
    blocks = -(-n // lanes)
    rows = np.minimum(np.arange(blocks * lanes), n - 1)
    columns = spheres[rows].reshape(blocks, lanes, 4 * count).transpose(0, 2, 1)
    return np.ascontiguousarray(columns).reshape(blocks, -1)


def simulation(lanes: int) -> Simulation:
    """The default simulation."""
    return Simulation(HYDRONE, WORLD, lanes=lanes)
