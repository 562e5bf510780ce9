"""The flights that tubes are measured by: a straight line behind the shield, each look flown on to its stop."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.envs import HydroneEnv
from hydrone_gym.simulation.rollout import Rollout
from hydrone_gym.simulation.simulation import row_at
from hydrone_gym.surface import in_air
from planners.belief import Belief
from planners.check import AIR_GATE, TUBE_LENGTH, TUBE_STEP, WATER_GATE
from planners.disturbance import Estimator, Sight
from planners.policy import Known, known
from planners.shield import Shield
from planners.straight_line import StraightLine
from planners.tube import PLACES, Tube

_SHAPE = 0.99  # quantile of the deviations that makes the shape
_LEAST = 0.02  # m: smaller deviations are not told apart
_LONGEST = 40  # looks of a flight
SEED = 20_000_000  # of the flights that tubes are made from
FLIGHTS = 1000


def deviations(env: Any, shield: Shield, seed: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Fly a mission; return the place of each look (n,), an index of `PLACES`, and the deviations after it.

    The latter are (n, TUBE_LENGTH) in m, NaN from where the stop left the box.
    """
    observation, state, places, found = env.reset(seed=seed)[0], None, [], []
    every = round(TUBE_STEP / shield.belief.period)
    for _ in range(_LONGEST):
        sent, state = shield.predict(observation, state)
        stop, now = state.held[0].astype(np.float32), known(observation)
        predicted = _predicted(shield.estimator, now, state.sights[0], sent, stop, every * TUBE_LENGTH)
        z = now.state[2]
        places.append(1 if -WATER_GATE < z < AIR_GATE else 0 if in_air(z) else 2)  # as `planners.stop_check.place_of`
        found.append(_flown(env, sent, stop, predicted)[every - 1 :: every])
        observation, _, terminated, truncated, _ = env.step(sent)
        if terminated or truncated:
            break
    return np.array(places), np.array(found)


def _predicted(
    estimator: Estimator,
    now: Known,
    sight: Sight | None,
    sent: NDArray[np.float32],
    stop: NDArray[np.float32],
    periods: int,
) -> NDArray[np.float64]:
    """Return where the vehicle is believed to be after each period (periods, 3) of a reference and its stop."""
    row: Any = row_at(now.state, now.goal)
    row["integral"], row["reference"] = now.integral, now.reference
    rollout, places = Rollout(estimator.simulation, np.zeros((0, 4)), estimator.conditions(sight)), []
    for k in range(periods):
        rollout.fly(row, (stop if k else sent).astype(np.float64))
        places.append(row["state"][0, :3].copy())
    return np.array(places)


def _flown(
    env: Any, sent: NDArray[np.float32], stop: NDArray[np.float32], predicted: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Fly them, and go back; return the distance from what was predicted (periods,) in m, NaN once the flight ended."""
    before, distances = env.unwrapped.get_state(), np.full(len(predicted), np.nan)
    for k, place in enumerate(predicted):
        told, _, terminated, truncated, _ = env.step(stop if k else sent)
        if terminated or truncated:
            break
        distances[k] = math.dist(told["state"][:3], place)
    env.unwrapped.set_state(before)
    return distances


def flights_of(belief: Belief, level: int, weather: Any, count: int, seed: int) -> list[tuple[NDArray, NDArray]]:
    """Return the `deviations` of so many flights in a weather, with a shield that is ready for a level."""
    env = HydroneEnv(
        vehicle=belief.vehicle,
        controller=belief.law,
        period=belief.period,
        vertical_mode=belief.world.vertical_mode,
        weather=weather,
        num_obstacles=0,
        rough_transition="count",
    )
    shield = Shield.for_env(StraightLine.for_env(env), env, level=level)
    return [deviations(env, shield, seed + k) for k in range(count)]


def measure(belief: Belief, level: int, count: int = FLIGHTS, seed: int = SEED) -> Tube:
    """Measure the tube of a vehicle under its law at a level of weather: a minute or two for a thousand flights."""
    flown = flights_of(belief, level, level, count, seed)
    places, found = np.concatenate([f[0] for f in flown]), np.concatenate([f[1] for f in flown])
    shape = np.array([np.nanquantile(found[places == place], _SHAPE, axis=0) for place in range(len(PLACES))])
    shape = np.maximum(shape, _LEAST)
    return Tube(shape, np.sort([score(shape, *each) for each in flown]))


def score(shape: NDArray[np.float64], places: NDArray[np.int64], found: NDArray[np.float64]) -> float:
    """Return how many times the shape the worst deviation of a flight is, over all its looks and times."""
    return float(np.nanmax(found / shape[places], initial=0.0))
