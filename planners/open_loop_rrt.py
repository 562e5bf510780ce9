"""Open-loop RRT: a geometric path that the controller is trusted to follow."""

import itertools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.surface import in_air
from hydrone_gym.world.bodies import gaps_along
from planners.belief import Belief
from planners.check import AIR_GATE, WATER_GATE
from planners.policy import Known, PlannerPolicy, whole_number

_GOAL_BIAS = 0.2
_COLUMN_BIAS = 0.3  # share of samples that are crossings, while the mission must change medium
_COLUMN_SPREAD = 2.5  # m, standard deviation of crossings around the end that lies in water
_LONGEST = 4.0  # m an edge
_WALL = 0.8  # m: samples keep this far from the walls
_CRUISE = 0.8  # share of the limit speeds at which the reference moves
_AT_GATE = (0.45, 0.15)  # m and m/s: how near and how slow before the reference crosses


class Route(NamedTuple):
    """What one environment's planner remembers; never changed once returned."""

    path: NDArray[np.float64]  # (n, 3) corners in m; empty if none was found
    progress: float  # m of the path that the reference has left behind
    known: int  # spheres the path was checked against
    cycle: int


def clearance(a: NDArray[np.float64], b: NDArray[np.float64], spheres: NDArray[np.float64]) -> float:
    """Least distance (m) from the straight edge a-b to the surface of a sphere; infinite without spheres."""
    return float(gaps_along(a, b, spheres).min(initial=np.inf))


class OpenLoopRRT(PlannerPolicy):
    """RRT with straight edges (LaValle, 1998), tracked by a reference that moves along the path at cruise speed.

    Edges clear the known spheres, inflated by the vehicle's radius and a margin; both ends of an edge lie in one medium
    outside the transition zone, or it is a vertical crossing from gate to gate. The first path found is shortened
    corner to corner and flown until a newly detected sphere blocks what is left of it; then a new one is planned from
    where the vehicle is. The reference waits at a gate for the vehicle to arrive, and whenever it is `lead` ahead.

    This is the ablation of closed-loop prediction: nothing here knows how the vehicle lags, cuts corners, turns under
    water, or how far it needs to stop; the margin has to cover for all of that and is not proven to.

    Args:
        belief: supplies speed limits, period and world.
        samples: most samples a plan may take; without a path the vehicle holds still and tries again next period.
        margin: clearance of edges, m.
        lead: the reference waits while it is this far ahead of the vehicle, m; infinite for one that never waits.
        seed: of the random stream; every episode starts it anew.

    Raises:
        ValueError: an argument out of range.
    """

    def __init__(
        self, belief: Belief | Any, *, samples: int = 1000, margin: float = 0.4, lead: float = 1.0, seed: int = 0
    ) -> None:
        """Check the arguments and work out the cruise speeds."""
        self.samples, self.seed = whole_number("samples", samples, 1), whole_number("seed", seed, 0)
        if not 0.0 <= margin < math.inf:
            raise ValueError(f"margin must be finite and not negative (m), got {margin!r}")
        if not lead > 0.5:  # the law under water holds still within 0.4 m of the reference
            raise ValueError(f"lead must be more than 0.5 m, got {lead!r}")
        model = Belief.of(belief)
        self.margin, self.lead = margin, lead
        self._radius, self._period, limits = model.vehicle.radius, model.period, model.envelope
        self._low = np.array(model.world.lower) + _WALL
        self._high = np.array(model.world.upper) - _WALL
        self._ahead = {True: limits.ahead_air, False: limits.ahead_water}
        self._air_speed = _CRUISE * np.array([limits.cruise, limits.climb])
        self._water_speed = _CRUISE * np.array([limits.surge, limits.dive])
        self._zone_speed = _CRUISE * limits.zone

    def act(self, now: Known, memory: Route | None) -> tuple[NDArray[np.float64], Route]:
        """Return the reference (4,) for the next period (m, m, m, rad) and the memory."""
        track = Route(np.zeros((0, 3)), 0.0, 0, 0) if memory is None else memory
        position, count = now.state[:3], len(now.obstacles)
        path, progress = track.path, track.progress
        if not len(path) or (count > track.known and self._blocked(path, progress, now.obstacles)):
            random = np.random.Generator(np.random.Philox(key=self.seed, counter=track.cycle))
            path, progress = self.plan(now, random), 0.0
        psi = now.reference[3] if in_air(position[2]) else now.state[5]
        if not len(path):
            still = position + self._ahead[bool(in_air(position[2]))] * now.state[6:9]
            return np.append(still, psi), Route(path, 0.0, count, track.cycle + 1)
        progress, point = self._move(path, progress, now.state)
        return np.append(point, psi), Route(path, progress, count, track.cycle + 1)

    def plan(self, now: Known, random: np.random.Generator) -> NDArray[np.float64]:
        """Return the corners (n, 3) of a path from the vehicle to the goal, (0, 3) if none was found."""
        start, goal, spheres = now.state[:3], now.goal, now.obstacles
        # a vehicle already nearer to a sphere than the margin asks what is left
        left = clearance(start, start, spheres) - self._radius - 0.02
        need = self._radius + min(self.margin, max(left, 0.0))
        points, parents = [start], [-1]

        def grow(parent: int, point: NDArray[np.float64]) -> bool:
            if clearance(points[parent], point, spheres) < need:
                return False
            points.append(point)
            parents.append(parent)
            return True

        gates = [np.array([start[0], start[1], z]) for z in (AIR_GATE, -WATER_GATE)]
        if -WATER_GATE < start[2] < AIR_GATE:  # out of the zone there is no way but up or down
            for gate in gates:
                grow(0, gate)
        for _ in range(self.samples):
            point, column = self._sample(start, goal, random)
            side = np.array(points)
            able = np.flatnonzero((side[:, 2] >= AIR_GATE) if in_air(point[2]) else (side[:, 2] <= -WATER_GATE))
            if not len(able):
                continue
            apart = np.linalg.norm(side[able] - point, axis=1)
            nearest = int(able[np.argmin(apart)])
            step = min(1.0, _LONGEST / max(float(apart.min()), 1e-9))
            point = points[nearest] + step * (point - points[nearest]) if step < 1.0 else point
            if not grow(nearest, point) or step < 1.0:
                continue
            if column:
                beyond = -WATER_GATE if in_air(point[2]) else AIR_GATE
                grow(len(points) - 1, np.array([point[0], point[1], beyond]))
            elif point is goal:
                return self._shorten(points, parents, spheres, need)
        return np.zeros((0, 3))

    def _sample(
        self, start: NDArray[np.float64], goal: NDArray[np.float64], random: np.random.Generator
    ) -> tuple[NDArray[np.float64], bool]:
        """Draw a point outside the zone, the goal itself, or the gate on this side of a crossing (then True)."""
        kind, medium, *unit = random.random(5)
        low, high = self._low, self._high
        air, change = in_air(start[2]), in_air(start[2]) != in_air(goal[2])
        if kind < _GOAL_BIAS:
            return goal, False
        if change and kind < _GOAL_BIAS + _COLUMN_BIAS:
            wet = goal if air else start
            x, y = np.clip(wet[:2] + _COLUMN_SPREAD * random.standard_normal(2), low[:2], high[:2])
            return np.array([x, y, AIR_GATE if air else -WATER_GATE]), True
        up = medium < 0.5 if change else air
        bottom, top = (AIR_GATE, high[2]) if up else (low[2], -WATER_GATE)
        x, y = low[:2] + np.array(unit[:2]) * (high - low)[:2]
        return np.array([x, y, bottom + unit[2] * (top - bottom)]), False

    @staticmethod
    def _shorten(
        points: list[NDArray[np.float64]], parents: list[int], spheres: NDArray[np.float64], need: float
    ) -> NDArray[np.float64]:
        """Walk back from the last point and leave out corners that a straight edge in one medium can pass."""
        corners, i = [points[-1]], parents[-1]
        while i >= 0:
            corners.insert(0, points[i])
            i = parents[i]

        def direct(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
            one_medium = min(a[2], b[2]) >= AIR_GATE or max(a[2], b[2]) <= -WATER_GATE
            return bool(one_medium) and clearance(a, b, spheres) >= need

        path, i = [corners[0]], 0
        while i < len(corners) - 1:
            i = next((j for j in range(len(corners) - 1, i + 1, -1) if direct(corners[i], corners[j])), i + 1)
            path.append(corners[i])
        return np.array(path)

    def _blocked(self, path: NDArray[np.float64], progress: float, spheres: NDArray[np.float64]) -> bool:
        """Whether what is left of a path passes a known sphere with less than half the margin."""
        ends = _lengths(path)
        rest = np.vstack([_point_at(path, ends, progress), path[ends > progress]])
        near = min((clearance(a, b, spheres) for a, b in itertools.pairwise(rest)), default=math.inf)
        return near < self._radius + 0.5 * self.margin

    def _move(
        self, path: NDArray[np.float64], progress: float, state: NDArray[np.float64]
    ) -> tuple[float, NDArray[np.float64]]:
        """Move the reference along the path for one period; return its progress (m) and place (3,)."""
        ends, left = _lengths(path), self._period
        while left > 1e-9 and progress < ends[-1] - 1e-9:
            i = int(np.searchsorted(ends, progress + 1e-9, side="right")) - 1
            lag = float(np.linalg.norm(_point_at(path, ends, progress) - state[:3]))
            crossing = in_air(path[i, 2]) != in_air(path[i + 1, 2])
            late = lag > _AT_GATE[0] or float(np.linalg.norm(state[6:9])) > _AT_GATE[1]
            if lag >= self.lead or (crossing and progress - ends[i] < 1e-6 and late):
                break
            speed = self._speed(path[i + 1] - path[i], in_air(path[i, 2]), crossing)
            step = min(left * speed, ends[i + 1] - progress, self.lead - lag)
            progress += step
            left -= max(step / speed, 1e-3)
        return progress, _point_at(path, ends, progress)

    def _speed(self, edge: NDArray[np.float64], air: bool, crossing: bool) -> float:
        """Cruise speed (m/s) along an edge, within the limits across and up."""
        if crossing:
            return self._zone_speed
        across, up = self._air_speed if air else self._water_speed
        length = float(np.linalg.norm(edge))
        return length / max(math.hypot(edge[0], edge[1]) / across, abs(edge[2]) / up, 1e-9)


def _lengths(path: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the metres of path up to every corner."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])


def _point_at(path: NDArray[np.float64], ends: NDArray[np.float64], progress: float) -> NDArray[np.float64]:
    """Return the point (3,) so many metres along a path."""
    return np.array([np.interp(progress, ends, path[:, axis]) for axis in range(3)])
