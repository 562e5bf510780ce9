"""The vehicle of an episode: drawn evenly within its bounds, and known to nobody but the physics."""

import dataclasses
import math

import numpy as np
import pytest
from scipy import stats

from hydrone_gym import HYDRONE, Spread, Weather
from hydrone_gym.physics.parameters import vehicle_params
from hydrone_gym.simulation.conditions import conditions_of
from hydrone_gym.simulation.storage import new_rows
from tests.envs.missions import DIVE, make, same
from tests.envs.test_vector_env import native
from tests.weather.outdoors import conditions_for

COUNT = 2000
SPREAD = Spread(
    mass=0.1,
    thrust=0.2,
    inertia=0.15,
    drag=0.5,
    rotor_lag_air=(0.01, 0.05),
    rotor_lag_water=(0.02, 0.2),
    rotor_drag=(1e-4, 2e-4),
    height=(0.1, 0.2),
)
NOMINAL = vehicle_params(HYDRONE)


def drawn(spread, count=COUNT):
    """Conditions of as many episodes."""
    rows = new_rows(count)
    rows["state"][:, 2] = 3.0
    conditions = conditions_for(rows, 16, Weather(), spread=spread)
    return [conditions_of(conditions, 16, row) for row in range(count)]


def quantities(c):
    """What a spread is about, over the nominal value, from the coefficients that the kernel flies with."""
    air, water = c.vehicle.air, c.vehicle.water
    added_mass = (c.real.mass_water - c.real.mass_air) / (1000.0 - 1.293) / HYDRONE.added_mass
    mass = c.real.mass_air / HYDRONE.mass - added_mass * HYDRONE.added_mass * 1.293 / HYDRONE.mass
    added_inertia = (
        (1.0 / water.inverse_inertia_x - 1.0 / air.inverse_inertia_x) / (1000.0 - 1.293) / HYDRONE.added_inertia
    )
    return {
        "mass": mass,
        "thrust in air": air.thrust / NOMINAL.air.thrust,
        "thrust in water": water.thrust / NOMINAL.water.thrust,
        "inertia x": c.vehicle.inertia_x / HYDRONE.inertia[0],
        "inertia y": c.vehicle.inertia_y / HYDRONE.inertia[1],
        "inertia z": c.vehicle.inertia_z / HYDRONE.inertia[2],
        "drag": water.drag_x * c.real.mass_water / (1000.0 * HYDRONE.drag[0]),
        "turning": water.rotational_drag_x / water.inverse_inertia_x / (1000.0 * HYDRONE.rotational_drag[0]),
        "added mass": added_mass,
        "added inertia": added_inertia,
        "lag in air": -0.01 / math.log(c.real.keep_air),
        "lag in water": -0.01 / math.log(c.real.keep_water),
        "rotor drag": c.real.rotor_drag * 60.0 / (2.0 * math.pi),
        "height": 1.0 / c.real.inverse_height,
    }


BOUNDS = {
    "mass": (0.9, 1.1),
    "thrust in air": (0.8, 1.2),
    "thrust in water": (0.8, 1.2),
    "inertia x": (0.85, 1.15),
    "inertia y": (0.85, 1.15),
    "inertia z": (0.85, 1.15),
    "drag": (0.5, 1.5),
    "turning": (0.5, 1.5),
    "added mass": (0.5, 1.5),
    "added inertia": (0.5, 1.5),
    "lag in air": (0.01, 0.05),
    "lag in water": (0.02, 0.2),
    "rotor drag": (1e-4, 2e-4),
    "height": (0.1, 0.2),
}


def test_it_is_drawn_evenly_within_its_bounds():
    found = [quantities(c) for c in drawn(SPREAD)]
    columns = {name: np.array([each[name] for each in found]) for name in BOUNDS}
    for name, (low, high) in BOUNDS.items():
        share = (columns[name] - low) / (high - low)
        assert share.min() > -1e-9, name
        assert share.max() < 1.0 + 1e-9, name
        assert share.min() < 0.01, name
        assert share.max() > 0.99, name
        assert stats.kstest(share, "uniform").pvalue > 1e-4, name
    np.testing.assert_allclose(columns["drag"], columns["added mass"], rtol=1e-9)
    np.testing.assert_allclose(columns["turning"], columns["added inertia"], rtol=1e-6)
    apart = [name for name in BOUNDS if not name.startswith("added")]
    correlations = np.corrcoef([columns[name] for name in apart]) - np.eye(len(apart))
    assert np.abs(correlations).max() < 5.0 / math.sqrt(COUNT)


def test_power_keeps_its_share_of_thrust():
    for c in drawn(SPREAD, 50):
        assert c.vehicle.air.power / c.vehicle.air.thrust == pytest.approx(NOMINAL.air.power / NOMINAL.air.thrust)


def test_no_spread_is_the_nominal_vehicle_exactly():
    for c in drawn(Spread(), 20):
        assert c.vehicle == NOMINAL
        assert c.real.keep_air == c.real.keep_water == c.real.rotor_drag == c.real.inverse_height == 0.0


@pytest.mark.parametrize("spread", [0.1, SPREAD])
def test_what_is_believed_stays_nominal(spread):
    """Controller, spaces and what planners are given: all of the vehicle that the options name."""
    env, plain = make(vehicle_spread=spread), make()
    env.reset(seed=3)
    assert env.vehicle == HYDRONE
    assert env.simulation.vehicle == HYDRONE
    assert env.observation_space == plain.observation_space
    assert env.action_space == plain.action_space
    np.testing.assert_array_equal(env.simulation.values, plain.simulation.values)
    assert env.truth["conditions"].vehicle != NOMINAL
    assert env.truth["conditions"].vehicle.hover_speed == NOMINAL.hover_speed  # what the controller adds to


def test_the_trim_error_shows():
    """A vehicle that is heavier, or pulls less, than believed sinks at first: nobody re-centred hover."""
    sunk = []
    for seed in range(30):
        env = make(vehicle_spread=Spread(mass=0.1), num_obstacles=0)
        env.reset(seed=seed, options={"scenario": dataclasses.replace(DIVE, start=(0.0, 0.0, 5.0, 0.0))})
        heavy = env.truth["conditions"].real.mass_air - 1.0 / NOMINAL.air.inverse_mass
        observation, *_ = env.step(np.array([0.0, 0.0, 5.0, 0.0]))
        sunk.append((heavy, observation["state"][2] - 5.0))
    heavy, rise = np.array(sunk).T
    assert (np.sign(heavy) == -np.sign(rise)).all()
    assert np.corrcoef(heavy, rise)[0, 1] < -0.95


def test_an_option_takes_the_place_of_the_weathers_spread():
    exact = make(weather=5, vehicle_spread=0.0)
    exact.reset(seed=1)
    assert exact.truth["conditions"].vehicle == NOMINAL
    assert exact.truth["conditions"].real.inverse_height == 0.0
    env = make(weather=5)
    env.reset(seed=1)
    assert env.truth["conditions"].vehicle != NOMINAL
    assert env.truth["conditions"].gusts == exact.truth["conditions"].gusts


def test_every_row_and_episode_has_its_own():
    rows = native(20, vehicle_spread=0.1)
    rows.reset(seed=0)
    first = [conditions_of(rows._core.outdoors.conditions, 16, row).vehicle for row in range(20)]
    rows.reset()
    second = [conditions_of(rows._core.outdoors.conditions, 16, row).vehicle for row in range(20)]
    assert len({*first, *second}) == 40
    env = make(vehicle_spread=0.1)
    env.reset(seed=7)
    assert env.truth["conditions"].vehicle == first[7]


def test_the_observation_at_reset_tells_nothing():
    assert same(make(vehicle_spread=0.3).reset(seed=2)[0], make().reset(seed=2)[0])
