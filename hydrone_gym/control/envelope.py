"""What the control laws make of a vehicle: how fast it goes, how it stops, what its memory is bounded by.

A law publishes its `Envelope`; time-to-go, spaces, objectives and planners read that and never a gain.
"""

import math
from typing import NamedTuple

from hydrone_gym.physics.parameters import MediumParams, vehicle_params
from hydrone_gym.vehicle import Vehicle


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


def envelope_of(vehicle: Vehicle) -> Envelope:
    """Work out the envelope of a vehicle under the paper's law."""
    air, water, params = vehicle.air_gains, vehicle.water_gains, vehicle_params(vehicle)
    swimming = math.sqrt(water.surge_limit / params.water.thrust)
    return Envelope(
        cruise=air.speed_limit,
        climb=air.vertical_speed_limit,
        surge=math.sqrt(2.0 * water.surge_limit * params.water.inverse_mass / params.water.drag_x),
        dive=water.vertical_speed_limit,
        zone=air.zone_speed_limit,
        stop_time=0.45,  # 0.97 m from 2 m/s, less from lower speeds: benchmarks/stop_distances.py
        ahead_air=0.2,
        ahead_water=0.1,
        hold_radius=water.hold_radius,
        flight_power=_power(params.air, vehicle.hover_speed, 4),
        swim_power=_power(params.water, swimming, 2) + _power(params.water, vehicle.neutral_speed, 2),
        height_memory=max(air.altitude_i_limit, water.depth_i_limit),
        attitude_memory=max(air.attitude_i_limit, water.attitude_i_limit),
    )


def _power(medium: MediumParams, speed: float, rotors: int) -> float:
    """Shaft power (W) of rotors at one speed (rpm)."""
    return rotors * medium.power * abs(speed) ** 3
