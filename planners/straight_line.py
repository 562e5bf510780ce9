"""The floor that every planner must beat: straight legs, a vertical crossing, and no eye for obstacles."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.simulation.time_to_go import GATE
from hydrone_gym.surface import in_air
from planners.belief import Belief
from planners.policy import Known, PlannerPolicy

COLUMN_RADIUS = 0.2  # m: how far from the column's axis a water entry may begin
REST_SPEED = 0.1  # m/s: lateral speed below which a water entry may begin
BRAKING = 2.8  # m: from here on the reference in air is the end of the leg itself, which the control law stops at
SWIM_LEAD = 1.4  # m: the reference under water, ahead of the vehicle; the surge thrust saturates from 1.1 m on


class StraightLine(PlannerPolicy):
    """Fly in a straight line to the column of the end that lies in water, cross vertically, swim in a straight line.

    No obstacle is avoided, so this is what an empty world asks for and the least a planner must do better than.
    References are placed ahead of the vehicle's position, never ahead of the last reference, so that they cannot run
    away from a vehicle that lags. The policy needs no memory: its state is a tuple of None.

    Args:
        belief: supplies the speed limits, the period and the transition zone.
    """

    def __init__(self, belief: Belief | Any) -> None:
        """Read the speed limits and the period."""
        model = Belief.of(belief)
        self._cruise = model.period * model.envelope.cruise
        self._climb = model.period * model.envelope.climb
        self._zone = model.world.zone
        self._gate = max(GATE, model.world.zone + 0.3)

    def act(self, now: Known, memory: Any) -> tuple[NDArray[np.float64], None]:
        """Return the reference (4,) for the next period (m, m, m, rad) and no memory."""
        if in_air(now.state[2]):
            return self._in_air(now), None
        return self._in_water(now), None

    def _in_air(self, now: Known) -> NDArray[np.float64]:
        """Reference above the surface: straight to the goal, or to the gate over it and then down."""
        position, goal = now.state[:3], now.goal
        heading = now.reference[3]  # free in air: hold it
        if in_air(goal[2]):
            # a vehicle that has just left the water clears the zone before it moves sideways
            aim = goal if position[2] > self._zone else np.array([position[0], position[1], self._gate])
            return self._ahead(position, aim, heading)
        aside = math.hypot(goal[0] - position[0], goal[1] - position[1])
        still = math.hypot(now.state[6], now.state[7]) < REST_SPEED
        below = position[2] <= self._zone
        if below or (aside < COLUMN_RADIUS and still and position[2] < self._gate + COLUMN_RADIUS):
            return np.array([goal[0], goal[1], max(goal[2], -self._gate), heading])
        return self._ahead(position, np.array([goal[0], goal[1], self._gate]), heading)

    def _ahead(self, position: NDArray[np.float64], aim: NDArray[np.float64], heading: float) -> NDArray[np.float64]:
        """Point one period of cruising ahead on the way to `aim`, or `aim` itself when it is near.

        Within both speed limits, so that the path is straight; from `BRAKING` on the law's own limits slow it down.
        """
        offset = aim - position
        if np.linalg.norm(offset) < BRAKING:
            return np.append(aim, heading)
        share = max(math.hypot(offset[0], offset[1]) / self._cruise, abs(offset[2]) / self._climb, 1.0)
        return np.append(position + offset / share, heading)

    def _in_water(self, now: Known) -> NDArray[np.float64]:
        """Reference under water: straight to the goal, or straight up where the vehicle is."""
        position, goal = now.state[:3], now.goal
        heading = now.state[5]  # the law of sight steers; the vehicle must not turn when it comes out
        if in_air(goal[2]):
            return np.array([position[0], position[1], self._gate, heading])
        offset = goal - position
        share = max(float(np.linalg.norm(offset)) / SWIM_LEAD, 1.0)
        return np.append(position + offset / share, heading)
