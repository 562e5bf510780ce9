"""How far the vehicle runs on while it stops, and the speed that leaves room for it in sensed space.

Nothing unknown is nearer than the sensor's range, so a period of travel and the stop after it must fit into that range
less the vehicle's radius. The distances are measured on the vehicle itself, not assumed.
"""

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.control.laws import envelope_of
from hydrone_gym.simulation.simulation import Simulation, row_at, trajectory

_DEPTH = 2.5  # m from the surface, clear of the transition zone
_STOP = 5.0  # s
_LEAST = 0.1  # of the cruise speed: nobody flies slower
_STEP = 0.01  # m/s to which the safe speed is found
_SPARE = 0.1  # m kept between the end of a stop and the edge of sensed space


def stop_distances(simulation: Simulation, speeds: NDArray[np.float64], *, air: bool) -> NDArray[np.float64]:
    """Measure how far (m) the safety action lets the vehicle run on from forward speeds (m/s) in one medium."""
    reached = np.zeros(len(speeds))
    envelope = envelope_of(simulation.vehicle, simulation.law)
    ahead = envelope.ahead_air if air else envelope.ahead_water
    for k, speed in enumerate(speeds):
        state = np.zeros(12)
        state[2] = _DEPTH if air else -_DEPTH
        state[6] = speed
        reference = np.array([ahead * speed, 0.0, state[2], 0.0])
        periods = int(np.ceil(_STOP / simulation.period))
        states = trajectory(simulation, row_at(state), np.tile(reference, (periods, 1)))[1]
        reached[k] = states[:, 0].max()
    return reached


def safe_speed(simulation: Simulation, periods_ahead: int) -> float:
    """Return the greatest cruise speed (m/s) in air from which the vehicle stops inside sensed space.

    Args:
        simulation: vehicle, world and period.
        periods_ahead: periods between sensing and the end of the edge decided on: 1, or 2 with planning latency.
    """
    cruise = envelope_of(simulation.vehicle, simulation.law).cruise
    room = simulation.world.sensor_range - simulation.vehicle.radius - _SPARE

    def fits(speed: float) -> bool:
        stop = stop_distances(simulation, np.array([speed]), air=True)[0]
        return bool(speed * simulation.period * periods_ahead + stop <= room)

    if fits(cruise):
        return cruise
    low, high = _LEAST * cruise, cruise
    while high - low > _STEP:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low
