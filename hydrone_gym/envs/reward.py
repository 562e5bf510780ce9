"""The reward: a sum of named terms, each a constant below, all times `SCALE`.

Progress carries the signal, one second of time-to-go for one unit; a mission is worth 10 to 25 units of it, so arriving
and failing weigh about as much as a whole flight. A time-out has no term of its own: it cuts an episode that
could go on, and a learner bootstraps it.
"""

import numpy as np

from hydrone_gym._jit import inlined
from hydrone_gym.simulation.outcome import COLLISION, DIVERGED, GOAL, OUT_OF_BOUNDS, ROUGH_TRANSITION

SCALE = 0.1  # keeps returns of order one, which value networks fit without further normalisation
PROGRESS = 1.0  # a second by which the time-to-go fell; a potential difference, so no detour or loop can earn any
TIME = -0.25  # a period: the faster of two safe flights is better
SLOW = -0.25  # a period that ends slower than SLOW_SPEED: hovering before an obstacle must not pay
SLOW_SPEED = 0.2  # m/s: well below cruise in either medium, above the drift of a vehicle that holds still
GOAL_REACHED = 15.0  # once
FAILURE = -20.0  # once: more than the goal gives, so a risky short cut never pays

TERMS = ("progress", "time", "slow", "goal", "collision", "rough_crossing", "out_of_bounds", "diverged")
_COUNT = len(TERMS)


@inlined
def write_reward(out, before, after, velocity, outcome):
    """Write the terms of a row in the order of `TERMS`, then their sum from left to right.

    Time-to-go (s) before and after the period, velocity (vx, vy, vz) in m/s and `Outcome` at its end.
    """
    vx, vy, vz = velocity
    slow = np.sqrt(vx * vx + vy * vy + vz * vz) < SLOW_SPEED
    out[0] = SCALE * PROGRESS * (before - after)
    out[1] = SCALE * TIME
    out[2] = SCALE * SLOW if slow else 0.0
    out[3] = SCALE * GOAL_REACHED if outcome == GOAL else 0.0
    out[4] = SCALE * FAILURE if outcome == COLLISION else 0.0
    out[5] = SCALE * FAILURE if outcome == ROUGH_TRANSITION else 0.0
    out[6] = SCALE * FAILURE if outcome == OUT_OF_BOUNDS else 0.0
    out[7] = SCALE * FAILURE if outcome == DIVERGED else 0.0
    total = 0.0
    for k in range(_COUNT):
        total += out[k]
    out[_COUNT] = total
