"""What the control laws make of a vehicle: how fast it goes, how it stops, what its memory is bounded by.

A law publishes its `Envelope`; time-to-go, spaces, objectives and planners read that and never a gain.
"""

from typing import NamedTuple

from hydrone_gym.physics.parameters import MediumParams


class Envelope(NamedTuple):
    """The limits of a vehicle under its control law."""

    cruise: float  # lateral speed in air, m/s
    climb: float  # vertical speed in air, m/s
    surge: float  # lateral speed in water, m/s: surge thrust against drag
    dive: float  # vertical speed in water, m/s
    zone: float  # vertical speed inside the transition zone, m/s
    stop_time: float  # stop distance over speed in air, s
    ahead_air: float  # s along its velocity that a reference must lead a vehicle in air for the shortest stop
    ahead_water: float  # the same in water
    hold_radius: float  # m: in water the vehicle drives to a reference farther away, and holds still within
    flight_power: float  # shaft power of level flight, W
    swim_power: float  # shaft power of swimming at surge speed while holding depth, W
    height_memory: float  # greatest magnitude of the controller's memory for height: rpm in air, N in water
    attitude_memory: float  # of each of its other three entries


def shaft_power_at(medium: MediumParams, speed: float, rotors: int) -> float:
    """Shaft power (W) of rotors at one speed (rpm)."""
    return rotors * medium.power * abs(speed) ** 3
