"""The closed loop in each kind of weather against SciPy: 20 s manoeuvres within 2 cm."""

import dataclasses

import numpy as np
import pytest

from hydrone_gym.simulation.conditions import conditions_of
from hydrone_gym.simulation.simulation import Simulation, row_at
from hydrone_gym.vehicle import HYDRONE, HYDRONE_2021
from hydrone_gym.weather import Weather
from hydrone_gym.weather.weather import ROTOR_DRAG
from hydrone_gym.world.world import World
from tests.simulation.closed_loop_outdoors import OutdoorLoop
from tests.simulation.test_integrator import circle_in_air, dive_and_return, water_entry, water_exit, weave_in_water
from tests.weather.outdoors import conditions_for

WORLD = World(lower=(-50.0, -50.0, -20.0), upper=(50.0, 50.0, 50.0), rough_transition="count")


def made(**changes):
    return dataclasses.replace(HYDRONE, name="custom", **changes)


FLAPPING = made(rotor_drag=ROTOR_DRAG)
EVERYTHING = made(
    rotor_drag=ROTOR_DRAG,
    height=0.2,
    rotor_lag_air=0.03,
    rotor_lag_water=0.1,
    thrust_water_curve=HYDRONE_2021.thrust_water_curve,
    near_water_radius=0.2,
)
# neither buoyed up by the hull nor by the near water for long: the law for air would float, and any error would grow
DIVING = dataclasses.replace(EVERYTHING, height=0.1, near_water_radius=0.0)
WIND = Weather(wind=4.0, turbulence=0.0, wind_direction=0.7)
BREEZE = Weather(wind=1.0, turbulence=0.0, wind_direction=2.0)
CURRENT = Weather(current=0.3, current_variation=0.0, current_direction=2.0)
DRIFT = Weather(current=0.1, current_variation=0.0, current_direction=2.5)
WAVE = Weather(wave_height=0.2, wave_period=2.0, wave_direction=0.4)
ALL = Weather(
    wind=1.0,
    turbulence=0.0,
    wind_direction=2.0,
    current=0.1,
    current_variation=0.0,
    current_direction=2.5,
    wave_height=0.05,
    wave_period=1.5,
    wave_direction=0.4,
)
CASES = {
    "wind": (HYDRONE, WIND, circle_in_air, 0),
    "wind with rotor drag": (FLAPPING, WIND, circle_in_air, 0),
    "wind and a dive": (FLAPPING, BREEZE, water_entry, 1),
    "current": (HYDRONE, CURRENT, weave_in_water, 0),
    "current and an exit": (HYDRONE, DRIFT, water_exit, 1),
    "wave": (HYDRONE, WAVE, weave_in_water, 0),
    "layer, entry": (made(height=0.2), Weather(), water_entry, 1),
    "layer, exit": (made(height=0.2), Weather(), water_exit, 1),
    "lag in air": (made(rotor_lag_air=0.03), Weather(), circle_in_air, 0),
    "lag in water": (made(rotor_lag_water=0.1), Weather(), weave_in_water, 0),
    "lag, both ways": (made(rotor_lag_air=0.02, rotor_lag_water=0.05), Weather(), dive_and_return, 2),
    "curve of thrust": (made(thrust_water_curve=HYDRONE_2021.thrust_water_curve), Weather(), weave_in_water, 0),
    "near water": (made(near_water_radius=0.3), Weather(), dive_and_return, 2),
    "together in air": (EVERYTHING, dataclasses.replace(ALL, wind=4.0), circle_in_air, 0),
    "together in water": (EVERYTHING, dataclasses.replace(ALL, current=0.3, wave_height=0.2), weave_in_water, 0),
    # in a drift the heading law under water makes centimetres of the millimetres that the crossing leaves
    "together, entry": (DIVING, dataclasses.replace(ALL, current=0.0), water_entry, 1),
    "together, exit": (EVERYTHING, ALL, water_exit, 1),
}


def flown(vehicle, weather, row, references):
    """States (N, 12) of every tick from the kernel, the final row and the conditions at the start."""
    conditions = conditions_for(row, 1, weather, vehicle=vehicle, seed=3)
    start = conditions_of(conditions, 1, 0)
    simulation, row = Simulation(HYDRONE, WORLD, weathered=True), row.copy()
    states, none = [row["state"][0].copy()], np.zeros((1, 0))
    for reference in references:
        for tick in range(simulation.ticks):
            simulation.advance(row, reference[None], none, none.copy(), 0, tick, tick + 1, conditions)
            states.append(row["state"][0].copy())
    return np.array(states), row, start


@pytest.mark.parametrize(("vehicle", "weather", "manoeuvre", "crossings"), CASES.values(), ids=CASES)
def test_positions_within_two_centimetres(vehicle, weather, manoeuvre, crossings, record_property):
    """The controller is that of the nominal vehicle throughout."""
    position, references = manoeuvre()
    references = np.array(references)
    references[:, 3] = (references[:, 3] + np.pi) % (2 * np.pi) - np.pi
    start = np.array([*position, *np.zeros(9)])
    states, row, conditions = flown(vehicle, weather, row_at(start), references)
    loop = OutdoorLoop(vehicle, WORLD, 0.5, start, [*position, 0.0], weather, conditions, HYDRONE)
    exact = np.array([start] + [state.copy() for state in loop.play(references, loop.advance_exact)])
    error = np.linalg.norm(states[:, :3] - exact[::5, :3], axis=1)
    record_property("largest position error in m", float(error.max()))
    assert row["crossings"][0] == loop.crossings == crossings
    assert error.max() <= 0.02
    assert np.ptp(states[:, :3], axis=0).max() > 2.0  # it went somewhere
