"""Raw observations to look at through the egocentric interface."""

import numpy as np

from hydrone_gym import HYDRONE, World
from hydrone_gym.perception.egocentric import NAMES, Egocentric
from hydrone_gym.simulation.simulation import Simulation
from tests.simulation.batches import random_references, random_rows

WORLD = World()
VAST = World(lower=(-500.0, -500.0, -500.0), upper=(500.0, 500.0, 500.0))
EGO = Egocentric(Simulation(HYDRONE, WORLD))
VAST_EGO = Egocentric(Simulation(HYDRONE, VAST))
INDEX = {name: index for index, name in enumerate(NAMES)}


def raw(state, goal=(0.0, 0.0, 5.0), spheres=(), reference=None):
    """A raw observation; unless given, the reference is where the vehicle is."""
    state = np.append(state, np.zeros(12 - len(state)))
    known = np.zeros((20, 4))
    known[: len(spheres)] = np.reshape(spheres, (-1, 4))
    where = [*state[:3], state[5]] if reference is None else reference
    return {"state": state, "reference": np.array(where), "goal": np.array(goal, float), "obstacles": known}


def random_raw(rng, count=None, spheres=20):
    """Raw observations anywhere in the box, as many as asked for or a single one; their start positions."""
    n = 1 if count is None else count
    rows = random_rows(rng, n, WORLD)
    known = np.zeros((n, 20, 4))
    for row in known[:, :spheres]:
        row[:] = np.column_stack([rng.uniform(WORLD.lower, WORLD.upper, (spheres, 3)), rng.uniform(0.5, 1.5, spheres)])
    batch = {
        "state": rows["state"].copy(),
        "integral": np.zeros((n, 4)),
        "reference": random_references(rng, n, WORLD),
        "goal": rng.uniform(WORLD.lower, WORLD.upper, (n, 3)),
        "obstacles": known,
    }
    starts = rng.uniform(WORLD.lower, WORLD.upper, (n, 3))
    return (batch, starts) if count is not None else ({key: value[0] for key, value in batch.items()}, starts[0])


def entry(flat, name):
    return float(flat[..., INDEX[name]])


def extreme(rng, *shape):
    """Numbers of every size a float64 has, of either sign, and places on walls and on the surface among them."""
    sizes = rng.choice([-1.0, 1.0], shape) * 10.0 ** rng.uniform(-320.0, 308.0, shape)
    ordinary = rng.uniform(-10.0, 10.0, shape)
    special = rng.choice([0.0, -0.0, 10.0, -10.0, -5.0, np.finfo(float).max, -np.finfo(float).max], shape)
    return np.choose(rng.integers(0, 3, shape), [sizes, ordinary, special])
