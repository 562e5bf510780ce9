"""Random rows, and the two ways to run them: sixteen lanes at a time or one by one."""

import numpy as np

from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.simulation.storage import new_rows


def random_rows(rng, count, world, *, spread=1.0):
    """Rows anywhere in the box: attitude to 0.3 rad, speed to 2 m/s, rates to 1 rad/s, any heading."""
    rows = new_rows(count)
    state = rows["state"]
    state[:, :3] = rng.uniform(world.lower, world.upper, (count, 3)) * spread
    state[:, 3:5] = rng.uniform(-0.3, 0.3, (count, 2))
    state[:, 5] = rng.uniform(-np.pi, np.pi, count)
    direction = rng.normal(size=(count, 3))
    state[:, 6:9] = direction / np.linalg.norm(direction, axis=1)[:, None] * rng.uniform(0.0, 2.0, (count, 1))
    state[:, 9:12] = rng.uniform(-1.0, 1.0, (count, 3))
    rows["reference"][:, :3], rows["reference"][:, 3] = state[:, :3], state[:, 5]
    rows["goal"] = np.inf
    rows["clearance"] = np.inf
    return rows


def random_references(rng, count, world):
    position = rng.uniform(world.lower, world.upper, (count, 3))
    return np.column_stack([position, rng.uniform(-np.pi, np.pi, count)])


def lane_major(obstacles, lanes):
    """(n, M, 4) spheres as the kernel wants them: (blocks, 4 M lanes), the last block padded with its last row."""
    n, count, _ = obstacles.shape
    blocks = -(-n // lanes)
    rows = np.minimum(np.arange(blocks * lanes), n - 1)
    return np.ascontiguousarray(obstacles[rows].reshape(blocks, lanes, 4 * count).transpose(0, 2, 1)).reshape(
        blocks, -1
    )


def play(simulation: Simulation, rows, references, obstacles=None):
    """Advance rows through (K, n, 4) references; return the rows and each row's distances to its spheres (n, M)."""
    n, lanes = len(rows), simulation.lanes
    spheres = np.zeros((n, 0, 4)) if obstacles is None else obstacles
    count = spheres.shape[1]
    rows = rows.copy()
    flat = lane_major(spheres, lanes)
    closest = np.full((len(flat), count * lanes), np.inf)
    for reference in references:
        simulation.advance(rows, np.ascontiguousarray(reference), flat, closest, count)
    near = closest.reshape(len(flat), count, lanes).transpose(0, 2, 1)
    return rows, near.reshape(len(flat) * lanes, count)[:n]
