"""Model predictive path integral control over references, on the batch kernel."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import kernel
from hydrone_gym.simulation.outcome import GOAL, RUNNING
from hydrone_gym.simulation.rollout import Flock
from hydrone_gym.simulation.simulation import row_at
from hydrone_gym.simulation.storage import LANES
from hydrone_gym.simulation.time_to_go import CruiseSpeeds, cruise_speeds, time_to_go
from hydrone_gym.surface import in_air
from planners.belief import Belief
from planners.policy import Known, PlannerPolicy, whole_number
from planners.straight_line import StraightLine

_REACH = np.array([1.4, 1.4, 1.2])  # m: the reference is at most this far from the vehicle, along x, y and z
_SPREAD = np.array([0.7, 0.7, 0.5])  # m, standard deviation of the noise
_SMOOTH = 0.8  # correlation of the noise from one period to the next
_MARGIN = 0.5  # m: clearance below which nearness costs
_NEARNESS = 12.0  # s, cost of touching, growing with the square of the clearance lost
_FAILURE = 100.0  # s, cost of a sample that ends in anything but the goal
_ROUGHNESS = 20.0  # s/(m/s)^2, cost of lateral speed inside the transition zone
_TEMPERATURE = 0.5  # s
_BEST = 4  # candidates flown again beside their mean


class Plan(NamedTuple):
    """What one environment's planner remembers; never changed once returned."""

    offsets: NDArray[np.float64]  # (horizon, 3) reference minus vehicle at the start of each period, m
    cycle: int


@kernel
def add_costs(
    rows: np.ndarray,
    speeds: CruiseSpeeds,
    zone: float,
    before: NDArray[np.float64],
    weight: float,
    costs: NDArray[np.float64],
) -> None:
    """Add one period's cost to `costs` (n,): time-to-go times a weight, and roughness.

    Args:
        rows: (n,) dtype `ROW`.
        speeds: of the vehicle.
        zone: half-height of the transition zone, m.
        before: (n,) outcome before the period; what had ended costs no roughness.
        weight: of the time-to-go.
        costs: (n,) s.
    """
    for i in range(rows.size):
        s, g = rows[i].state, rows[i].goal
        left = time_to_go(s[0], s[1], s[2], g[0], g[1], g[2], speeds)
        costs[i] += 0.0 if rows[i].outcome == GOAL else weight * left
        if before[i] == RUNNING and abs(s[2]) < zone:
            costs[i] += _ROUGHNESS * (s[6] * s[6] + s[7] * s[7])


class MPPI(PlannerPolicy):
    """Model predictive path integral control (Williams et al., T-RO 34(6), 2018) with references as inputs.

    An input is where the reference lies relative to the vehicle at the start of a period. Each cycle shifts the last
    plan, adds smooth noise, flies every sample in closed loop through the simulation kernel against the known spheres,
    and averages the samples by exp(-cost / temperature). The cost is time-to-go, nearness to spheres, lateral speed in
    the transition zone and failure, all in seconds. Among the samples are the straight line, holding still, and leaving
    the transition zone either way. As an average of two ways round a sphere may hit it, it is flown again beside the
    best samples, and the least cost wins.

    What it cannot do: see past its horizon or out of a local minimum of time-to-go, such as a pocket or a sphere over
    the place where it came out of the water; promise anything about space not sensed yet, as no stop is verified.

    Args:
        belief: supplies vehicle, world and period.
        samples: flights a cycle.
        horizon: periods ahead.
        seed: of the random stream; every episode starts it anew.

    Raises:
        ValueError: an argument out of range.
    """

    def __init__(self, belief: Belief | Any, *, samples: int = 256, horizon: int = 10, seed: int = 0) -> None:
        """Check the budget."""
        self.samples = whole_number("samples", samples, LANES)
        self.horizon, self.seed = whole_number("horizon", horizon, 2), whole_number("seed", seed, 0)
        model = Belief.of(belief)
        self._simulation = model.simulation(LANES)
        self._line = StraightLine(model)
        self._speeds = cruise_speeds(model.envelope)
        self._low = np.array(model.world.lower, np.float32).astype(np.float64)
        self._high = np.array(model.world.upper, np.float32).astype(np.float64)

    def act(self, now: Known, memory: Plan | None) -> tuple[NDArray[np.float64], Plan]:
        """Return the reference (4,) for the next period (m, m, m, rad) and the memory."""
        reference, _ = self._line.act(now, None)
        straight = np.clip(reference[:3] - now.state[:3], -_REACH, _REACH)
        last = Plan(np.tile(straight, (self.horizon, 1)), 0) if memory is None else memory
        random = np.random.Generator(np.random.Philox(key=self.seed, counter=last.cycle))
        noise = random.standard_normal((self.samples, self.horizon, 3)) * _SPREAD
        for k in range(1, self.horizon):
            noise[:, k] = _SMOOTH * noise[:, k - 1] + math.sqrt(1.0 - _SMOOTH**2) * noise[:, k]
        noise[0] = 0.0
        offsets = np.clip(last.offsets + noise, -_REACH, _REACH)
        offsets[1], offsets[2] = straight, 0.0
        # in the zone nothing is gained until it is left, up or down, which smooth noise seldom does
        offsets[3:5, :, :2] = np.clip(now.goal[:2] - now.state[:2], -_REACH[:2], _REACH[:2])
        offsets[3:5, :, 2] = [[_REACH[2]], [-_REACH[2]]]
        costs = self._fly(now, offsets)
        weights = np.exp((costs.min() - costs) / _TEMPERATURE)
        mean = np.tensordot(weights / weights.sum(), offsets, 1)
        finalists = np.stack([mean, *offsets[np.argsort(costs, kind="stable")[:_BEST]]])
        plan = finalists[np.argmin(self._fly(now, finalists))]
        psi = now.reference[3] if in_air(now.state[2]) else now.state[5]
        point = np.clip(now.state[:3] + plan[0], self._low, self._high)
        return np.append(point, psi), Plan(np.vstack([plan[1:], plan[-1:]]), last.cycle + 1)

    def _fly(self, now: Known, offsets: NDArray[np.float64]) -> NDArray[np.float64]:
        """Fly every sequence of offsets (n, horizon, 3) in closed loop; return the costs (n,) in s."""
        start: Any = row_at(now.state, now.goal)
        start["integral"], start["reference"] = now.integral, now.reference
        flock = Flock(self._simulation, start, len(offsets), now.obstacles)
        rows, costs = flock.rows, np.zeros(len(offsets))
        for k in range(self.horizon):
            before = rows["outcome"].copy()
            air = in_air(rows["state"][:, 2])
            points = np.clip(rows["state"][:, :3] + offsets[:, k], self._low, self._high)
            psi = np.where(air, rows["reference"][:, 3], rows["state"][:, 5])
            flock.fly(np.column_stack([points, psi]).astype(np.float32).astype(np.float64))
            weight = 1.0 if k == self.horizon - 1 else 1.0 / self.horizon
            add_costs(rows, self._speeds, self._simulation.world.zone, before, weight, costs)
        lost = np.maximum(0.0, 1.0 - rows["clearance"] / _MARGIN)
        failed = (rows["outcome"] != RUNNING) & (rows["outcome"] != GOAL)
        return costs + _NEARNESS * lost**2 + _FAILURE * failed
