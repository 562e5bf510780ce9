"""Artificial potential field: a reactive planner that looks at what is near now and nowhere else."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.simulation.time_to_go import GATE
from hydrone_gym.surface import in_air
from planners.belief import Belief
from planners.policy import Known, PlannerPolicy
from planners.straight_line import SWIM_LEAD, StraightLine

_NEAREST = 0.05  # m: clearances are not taken smaller, so that the force stays finite
_WALL_INFLUENCE = 1.0  # m
_WALL = 0.4  # m: references keep this far inside the box
_ARRIVING = 1.0  # m: within this distance of the aim repulsion fades, or a goal near a sphere is never reached
_SLOW = 2.0  # m: clearance ahead below which the vehicle slows down
_SLOWEST = 0.25  # share of full speed
_TURNING_LEAD = 0.6  # m: the reference under water is never nearer; within 0.4 m the law holds still
_COLUMN_MARGIN = 0.35  # m: clearance of a crossing; a vehicle under water stops up to 0.4 m short of its reference
_AT_COLUMN = 0.15  # m
_PUSHES = 20


class PotentialField(PlannerPolicy):
    """Attraction along the straight way, repulsion from what is near (Khatib, IJRR 5(1), 1986).

    The attraction is the straight line's reference: to the gate over the goal, vertically through the surface, on to
    the goal. A sphere with clearance rho < rho_0 repels with gain (1/rho - 1/rho_0) / rho^2, a wall likewise. Where the
    attraction points into a sphere, a force along its surface is added, at most of the attraction's size (De Medio and
    Oriolo, 1991); near the aim repulsion fades (Ge and Cui, 2000). A column blocked by a known sphere is pushed aside;
    a crossing that has begun is finished. References stay within a period's travel of the vehicle, nearer the closer
    the spheres ahead. Its state is a tuple of None.

    What it cannot do: leave a local minimum between several spheres (it stays there until time is out), promise a
    clearance (the field knows nothing of the vehicle's inertia, nor of its turning under water), or cross the surface
    to get round something.

    Args:
        belief: supplies speed limits, period and world.
        influence: distance rho_0 from which spheres repel, m.
        gain: of the repulsion, in units of the attraction, m^3; 1 balances it at a clearance of 0.8 m.

    Raises:
        ValueError: an argument that is not positive.
    """

    def __init__(self, belief: Belief | Any, *, influence: float = 2.0, gain: float = 1.0) -> None:
        """Check the field and read the limits."""
        for name, value, unit in (("influence", influence, "m"), ("gain", gain, "m^3")):
            if not 0.0 < value < math.inf:
                raise ValueError(f"{name} must be positive ({unit}), got {value!r}")
        self.influence = influence
        self.gain = gain
        model = Belief.of(belief)
        self._line = StraightLine(model)
        self._world = model.world
        self._radius = model.vehicle.radius
        self._step = model.period * model.envelope.cruise
        self._low, self._high = np.array(self._world.lower) + _WALL, np.array(self._world.upper) - _WALL
        self._gate = max(GATE, model.world.zone + 0.3)

    def act(self, now: Known, memory: Any) -> tuple[NDArray[np.float64], None]:
        """Return the reference (4,) for the next period (m, m, m, rad) and no memory."""
        position = now.state[:3]
        aim = self._aim(now)
        reference, _ = self._line.act(now._replace(goal=aim), None)
        crossing = in_air(reference[2]) != in_air(position[2])
        if crossing or abs(position[2]) <= self._world.zone:
            return reference, None
        pull = reference[:3] - position
        length = float(np.linalg.norm(pull))
        near, away = self._near(position, now.obstacles)
        if length < 1e-6 or not len(near):
            return reference, None
        force = self._force(pull / length, near, away, length)
        ahead = near[away @ force < 0.0]
        speed = min(1.0, max(_SLOWEST, ahead.min(initial=np.inf) / _SLOW))
        air = in_air(position[2])
        lead = speed * min(length, self._step) if air else max(speed * SWIM_LEAD, _TURNING_LEAD)
        reference[:3] = position + min(lead, length) * force
        reference[:3] = np.clip(reference[:3], self._low, self._high)
        shallow = self._world.zone + 0.1  # references stay out of the zone until the crossing
        reference[2] = max(reference[2], shallow) if air else min(reference[2], -shallow)
        return reference, None

    def _aim(self, now: Known) -> NDArray[np.float64]:
        """Where to go next: the goal, or the foot of a free column if the one for the crossing is blocked."""
        position, goal = now.state[:3], now.goal
        if in_air(position[2]) == in_air(goal[2]):
            return goal
        over = goal if in_air(position[2]) else position
        x, y = self._free_column(over[0], over[1], now.obstacles)
        aside = math.hypot(x - over[0], y - over[1])
        if aside < _AT_COLUMN or (not in_air(position[2]) and position[2] >= -self._world.zone):
            return goal
        depth = -self._gate if in_air(position[2]) else min(position[2], -self._gate)
        if not in_air(position[2]):  # swim beyond the hold radius, or the vehicle stops short of the column
            share = max(1.0, _TURNING_LEAD / aside)
            x, y = position[0] + share * (x - position[0]), position[1] + share * (y - position[1])
        return np.array([x, y, depth])

    def _free_column(self, x: float, y: float, spheres: NDArray[np.float64]) -> tuple[float, float]:
        """Push a vertical line from gate to gate out of the known spheres, one after the other."""
        low, high = self._low, self._high
        for _ in range(_PUSHES):
            above = np.maximum(0.0, np.maximum(spheres[:, 2] - self._gate, -self._gate - spheres[:, 2]))
            reach = np.sqrt(np.maximum((spheres[:, 3] + self._radius + _COLUMN_MARGIN) ** 2 - above**2, 0.0))
            dx, dy = x - spheres[:, 0], y - spheres[:, 1]
            apart = np.hypot(dx, dy)
            inside = np.flatnonzero(apart < reach)
            if not len(inside):
                break
            k = inside[np.argmin(apart[inside] - reach[inside])]
            ux, uy = (dx[k] / apart[k], dy[k] / apart[k]) if apart[k] > 1e-6 else (1.0, 0.0)
            x = float(np.clip(spheres[k, 0] + 1.01 * reach[k] * ux, low[0], high[0]))
            y = float(np.clip(spheres[k, 1] + 1.01 * reach[k] * uy, low[1], high[1]))
        return x, y

    def _near(
        self, position: NDArray[np.float64], spheres: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return clearances (n,) in m and the directions away (n, 3) from the spheres and walls that repel.

        A wall's clearance is scaled to the influence of spheres.
        """
        apart = position - spheres[:, :3]
        distance = np.linalg.norm(apart, axis=1)
        walls = np.concatenate([position - self._world.lower, self._world.upper - position])
        near = np.concatenate([distance - spheres[:, 3] - self._radius, walls * (self.influence / _WALL_INFLUENCE)])
        away = np.concatenate([apart / np.maximum(distance, 1e-9)[:, None], np.eye(3), -np.eye(3)])
        keep = near < self.influence
        return np.maximum(near[keep], _NEAREST), away[keep]

    def _force(
        self, pull: NDArray[np.float64], near: NDArray[np.float64], away: NDArray[np.float64], left: float
    ) -> NDArray[np.float64]:
        """Return attraction and repulsion together (3,), at most of length 1, which is that of the attraction."""
        push = self.gain * (1.0 / near - 1.0 / self.influence) / near**2 * min(1.0, left / _ARRIVING)
        into = np.maximum(-(away @ pull), 0.0)
        along = pull - (away @ pull)[:, None] * away
        size = np.linalg.norm(along, axis=1)
        # straight into a sphere every way round is as good: take the left one
        left_hand = np.cross([0.0, 0.0, 1.0], pull) if abs(pull[2]) < 0.99 else np.array([1.0, 0.0, 0.0])
        along = np.where(size[:, None] > 1e-3, along / np.maximum(size, 1e-9)[:, None], left_hand)
        slide = np.minimum(push, 1.0) * into  # bounded, or it would draw the vehicle into a gap that is too narrow
        force = pull + push @ away + slide @ along
        return force / max(1.0, float(np.linalg.norm(force)))
