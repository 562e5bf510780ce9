"""How fast to swim, dive and rise: what the vehicle makes of a carrot so far ahead, measured on the vehicle itself."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.control.laws import envelope_of
from hydrone_gym.simulation.rollout import Rollout
from hydrone_gym.simulation.simulation import Simulation, row_at
from hydrone_gym.world.world import World

_ROOM = World(lower=(-100.0, -100.0, -100.0), upper=(100.0, 100.0, 100.0))
_DEPTH = 50.0  # m
_RUN = 3.0  # s to come to a steady pace, and as long to measure it
_LEAST = 0.05  # m/s: slower is no way to get anywhere
_AHEAD = np.arange(0.05, 1.65, 0.05)  # m beyond the hold radius, leads tried
_BELOW = np.arange(0.1, 1.05, 0.1)  # the same down and up, as a share of what the limit speed makes in a period


class Pace(NamedTuple):
    """A steady way through water."""

    lead: float  # m the carrot is laid ahead, every period
    speed: float  # m/s
    power: float  # W


def steady(simulation: Simulation, direction: NDArray[np.float64], lead: float) -> Pace:
    """Fly a vehicle through water after a carrot that is laid `lead` m ahead in a direction (3,), a unit vector."""
    roomy = Simulation(simulation.vehicle, _ROOM, simulation.period, law=simulation.law)
    row, rollout = row_at(np.append([0.0, 0.0, -_DEPTH], np.zeros(9))), Rollout(roomy, np.zeros((0, 4)))
    periods = int(np.ceil(_RUN / simulation.period))
    passed = []
    for period in range(2 * periods + 1):
        if period % periods == 0:
            passed.append((row["state"][0, :3] @ direction, row["energy"][0]))
        rollout.fly(row, np.append(row["state"][0, :3] + lead * direction, 0.0))
    way, spent = np.subtract(passed[2], passed[1]) / (periods * simulation.period)
    return Pace(lead, float(way), float(spent))


def cheapest(simulation: Simulation, direction: NDArray[np.float64], worth: float) -> Pace:
    """Return the `Pace` in a direction that costs least a metre, where a second is worth so many joules (W)."""
    envelope = envelope_of(simulation.vehicle, simulation.law)
    leads = _BELOW * envelope.dive * simulation.period if direction[2] else envelope.hold_radius + _AHEAD
    paces = [pace for lead in leads if (pace := steady(simulation, direction, float(lead))).speed > _LEAST]
    return min(paces, key=lambda pace: (worth + pace.power) / pace.speed)
