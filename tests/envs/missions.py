"""Hand-made missions and small flights that several tests share."""

import gymnasium as gym
import numpy as np

from hydrone_gym import Scenario  # importing the package registers the ids

IDS = ("HydroneGym/AirToWater-v0", "HydroneGym/WaterToAir-v0", "HydroneGym/Mission-v0")
VEHICLES = ("paper", "physical")
AIR_TO_AIR = Scenario(start=(-2.0, 0.0, 5.0, 0.0), goal=(4.0, 0.0, 5.0), obstacles=[])
SPHERE_BETWEEN = Scenario(start=(-2.0, 0.0, 5.0, 0.0), goal=(4.0, 0.0, 5.0), obstacles=[(1.0, 0.0, 5.0, 0.8)])
DIVE = Scenario(start=(-5.0, 0.0, 2.0, 0.0), goal=(8.0, 0.0, -3.0), obstacles=[])
CLIMB = Scenario(start=(0.0, 0.0, -2.0, 0.0), goal=(8.0, 0.0, 6.0), obstacles=[])


def make(name="Mission", **options):
    """The bare environment: no wrapper between the test and its methods."""
    return gym.make(f"HydroneGym/{name}-v0", **options).unwrapped


def begin(scenario, **options):
    """A Mission environment at the start of a scenario, and its first observation."""
    env = make(**options)
    observation, _ = env.reset(seed=0, options={"scenario": scenario})
    return env, observation


def fly_to(env, reference, steps=240):
    """Send one reference until the episode ends; all (observation, reward, terminated, truncated, info)."""
    returns = []
    for _ in range(steps):
        returns.append(env.step(np.array(reference, np.float32)))
        if returns[-1][2] or returns[-1][3]:
            break
    return returns


def wander(env, steps, seed):
    """Fly random references, beginning a new episode where one ends; everything returned, as one flat list."""
    rng = np.random.default_rng(seed)
    low, high = env.action_space.low, env.action_space.high
    log = []
    for _ in range(steps):
        observation, reward, terminated, truncated, info = env.step(rng.uniform(low, high).astype(np.float32))
        log.append((observation, reward, terminated, truncated, info))
        if terminated or truncated:
            log.append(env.reset())
    return log


def same(a, b):
    """Whether two nested returns are equal bit for bit."""
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    if isinstance(a, list | tuple):
        return len(a) == len(b) and all(map(same, a, b))
    return type(a) is type(b) and a == b
