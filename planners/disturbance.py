"""The disturbance a planner believes in: what its own predictions of the last period leave unexplained.

Each period the belief, with the estimate so far, is flown from the state that was observed toward the reference that
was in force. Where the velocity and the place that came differ, the estimate is corrected by that difference over the
belief's own sensitivity to wind, current and push: a damped Gauss-Newton step, filtered. What the vehicle is not in
changes nothing, so its estimate is kept; but where a law perceives the surface, the drift above it tells of the
current. In a world that is as believed nothing differs, so the estimate is zero, exactly.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.simulation.conditions import Steady, steady_conditions, still_conditions
from hydrone_gym.simulation.rollout import Rollout
from hydrone_gym.simulation.simulation import STILL, row_at
from hydrone_gym.surface import in_air
from planners.belief import Belief
from planners.policy import Known

_NEAR_SURFACE = 0.15  # m: nearer, waves and a hull partly under water push more than what goes on
_GAIN = 0.63  # share of a correction that is made in a period
# Of wind (m/s), push in air (N), current (m/s) and push in water (N):
_STEP = np.array([1.0, 1.0, 0.5, 0.05, 0.05, 0.5])  # what the sensitivity is measured with
_MOST_STEP = np.array([3.0, 3.0, 1.5, 0.15, 0.15, 1.5])  # the greatest correction
_MOST = np.array([15.0, 15.0, 3.0, 1.0, 1.0, 3.0])  # bounds of the estimate
# m/s: a velocity that a period's disturbance of `_STEP` must change more than, to tell anything; waves heave
_NOISE = np.array([0.001, 0.001, 0.001, 0.001, 0.001, 0.02])


class Sight(NamedTuple):
    """What one environment's estimator remembers: what was observed last, and the estimate so far."""

    state: NDArray[np.float64]  # (12,)
    integral: NDArray[np.float64]  # controller memory
    reference: NDArray[np.float64]  # (4,) in force
    estimate: NDArray[np.float64]  # (6,) a `Steady`


class Estimator:
    """Estimates the disturbance that a vehicle flies in, from observations, and predicts with it; holds no memory.

    Args:
        belief: the `Belief`; its period is the time between observations.
        weathered: whether there is anything to estimate; without, it believes in still air and flat water.

    Attributes:
        simulation: what to predict with, under `conditions`.
    """

    def __init__(self, belief: Belief, *, weathered: bool) -> None:
        """Make the simulation that predicts."""
        self._still = still_conditions(belief.vehicle)
        self.simulation = belief.simulation(weathered=weathered)

    def look(self, now: Known, before: Sight | None) -> Sight | None:
        """Take in an observation and return the new memory, None without weather; `before` is None at the start."""
        if not self.simulation.weathered:
            return None
        estimate = np.zeros(6) if before is None else self._corrected(before, now)
        return Sight(now.state, now.integral, now.reference, estimate)

    def conditions(self, sight: Sight | None) -> NDArray[np.float64]:
        """Return the conditions (CONDITIONS,) that are believed, none at all without weather."""
        if not self.simulation.weathered:
            return STILL[0]
        return self._still if sight is None else steady_conditions(self._still, Steady(*sight.estimate))

    def ahead(self, now: Known, reference: NDArray[np.float64], sight: Sight | None) -> Known:
        """Predict what will be known a period later, with a reference (4,) sent now."""
        row: Any = row_at(now.state, now.goal)
        row["integral"], row["reference"] = now.integral, now.reference
        Rollout(self.simulation, np.zeros((0, 4)), self.conditions(sight)).fly(row, reference)
        return now._replace(state=row["state"][0], integral=row["integral"][0], reference=reference)

    def _corrected(self, before: Sight, now: Known) -> NDArray[np.float64]:
        """Return the estimate after a period that led from `before` to `now`."""
        estimate, z = before.estimate, np.array([before.state[2], now.state[2]])
        if in_air(z[0]) != in_air(z[1]) or np.abs(z).min() < _NEAR_SURFACE:
            return estimate
        error = self._moved(now.state) - self._moved(self._predicted(before, now, estimate))
        if not error.any():
            return estimate
        sensitivity = np.empty((6, 6))  # zero where an estimate is of the medium the vehicle is not in
        for k in range(6):
            step = np.where(np.arange(6) == k, _STEP, 0.0)
            further, back = (self._predicted(before, now, estimate + sign * step) for sign in (1.0, -1.0))
            sensitivity[:, k] = 0.5 * (self._moved(further) - self._moved(back))
        damped = sensitivity.T @ sensitivity + np.diag(_NOISE**2)
        wanted = np.linalg.solve(damped, sensitivity.T @ error) * _STEP
        return np.clip(estimate + _GAIN * np.clip(wanted, -_MOST_STEP, _MOST_STEP), -_MOST, _MOST)

    def _predicted(self, before: Sight, now: Known, estimate: NDArray[np.float64]) -> NDArray[np.float64]:
        """Predict the state (12,) now under an estimate."""
        then = now._replace(state=before.state, integral=before.integral, reference=before.reference)
        return self.ahead(then, now.reference, before._replace(estimate=estimate)).state

    def _moved(self, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return velocity and position (6,) as what a steady push makes equal, in m/s.

        Velocity alone will not do: a law that fights disturbances itself has it back at the end of a period.
        """
        return np.concatenate([state[6:9], 2.0 / self.simulation.period * state[:3]])


__all__ = ["Estimator", "Sight"]
