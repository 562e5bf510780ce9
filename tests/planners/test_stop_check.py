"""The one stop check: its constants have their reasons, and CL-RRT and the shield ask the same one."""

import itertools

import gymnasium as gym
import numpy as np
import pytest

import hydrone_gym  # noqa: F401
from hydrone_gym import HYDRONE, HYDRONE_PHYSICAL, Outcome, Scenario, Spread, Weather
from hydrone_gym.simulation.rollout import Rollout
from hydrone_gym.simulation.simulation import Simulation, row_at
from hydrone_gym.world.world import World
from planners import CLRRT, CLRRTSettings
from planners.caution import caution_at
from planners.check import AIR_GATE, MARGIN
from planners.cl_rrt.execute import Query, cycle
from planners.cl_rrt.tree import BACKUP, Workspace, new_nodes
from planners.policy import known
from planners.shield import RETREAT, Shield
from planners.stop_check import LOOK_AHEAD

VEHICLES = pytest.mark.parametrize("vehicle", [HYDRONE, HYDRONE_PHYSICAL], ids=lambda vehicle: vehicle.name)


def seconds_to_rest(vehicle, state, reference):
    """How long a vehicle takes to be slow, level and outside the zone at a reference, in whole periods."""
    rollout, row = Rollout(Simulation(vehicle, World()), np.zeros((0, 4))), row_at(np.array(state))
    for period in range(1, 40):
        assert rollout.fly(row, np.array(reference)).outcome == Outcome.RUNNING
        s = row["state"][0]
        level = np.linalg.norm(s[[3, 4, 9, 10]]) < 0.02
        if np.linalg.norm(s[6:9]) < 0.03 and level and abs(s[2]) > 0.8:
            return 0.5 * period
    return np.inf


@VEHICLES
def test_stops_fit_into_the_look_ahead(vehicle):
    fast = seconds_to_rest(vehicle, [0, 0, 5.0, 0, 0, 0, 2.0, 0, 0, 0, 0, 0], [0.4, 0, 5.0, 0])
    out_of_water = seconds_to_rest(vehicle, [0, 0, -1.0, *np.zeros(9)], [0, 0, AIR_GATE, 0])
    assert (fast, out_of_water) == (4.5, 5.5)
    assert max(fast, out_of_water) <= LOOK_AHEAD < max(fast, out_of_water) + 1.0


def test_both_keep_the_same_margin():
    """What the shield lets pass beside a sphere keeps the margin until the vehicle rests, and some comes that near."""
    assert CLRRTSettings().rest_margin == MARGIN
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=1)
    sphere, shield = np.array([[0.0, 0.0, 5.0, 1.0]]), Shield.for_env(None, env)
    observation, _ = env.reset(seed=0)
    observation["state"][:6], observation["obstacles"][0] = (-1.8, 0, 5, 0, 0, 0), sphere[0]
    observation["reference"][:] = observation["state"][[0, 1, 2, 5]]
    least = []
    for x in np.linspace(-1.9, -1.0, 91):
        sent, held, choice = shield.check(observation, np.array([[x, 0, 5, 0]]), observation["reference"][None])
        row, rollout = row_at(observation["state"], observation["goal"]), Rollout(shield.simulation, sphere)
        if choice[0] == 0:
            least.append(min(rollout.fly(row, reference).clearance for reference in [sent[0], *[held[0]] * 12]))
    assert MARGIN <= min(least) < MARGIN + 0.02
    assert len(least) < 91


def drifting(env, vy):
    """A vehicle under water that is carried slowly through the wall, holding a hover."""
    observation, _ = env.reset(options={"scenario": Scenario(start=(0, -9.5, -3, 0), goal=(0, 9, -3), obstacles=())})
    observation["state"][:3], observation["state"][7] = (0.0, -9.96, -3.0), vy
    observation["reference"][:] = (0.0, -9.9, -3.0, 0.0)
    return observation


def test_what_cl_rrt_holds_under_water_is_verified_again():
    """Walled in, it has nothing to send; what it holds would let it drift out of the box, so it swims against that."""
    env = gym.make("HydroneGym/Mission-v0")
    observation = drifting(env, -0.004)
    held = observation["reference"][None]
    retreat, _, choice = Shield.for_env(None, env).check(observation, held, held)
    assert choice.tolist() == [RETREAT]
    planner, now = CLRRT.for_env(env), known(observation)
    work = Workspace.around(new_nodes(100), np.zeros((BACKUP, 4)), planner.simulation, now.obstacles)
    query = Query(
        start=now.vessel,
        goal=now.goal,
        eye=now.state[:3],
        draws=np.zeros(0),
        size=0,
        root=-1,
        known_before=0,
        held=held[0],
        holds=True,
        roam=0,
        iterations=0,  # no tree, so no path
        begin=True,
        finish=True,
    )
    assert cycle(work, query, planner._constants[0])[1] == -1
    np.testing.assert_array_equal(work.backup[0], retreat[0])


STEADY = Weather(
    wind=3.0,
    wind_direction=0.0,
    turbulence=0.0,
    current=0.3,
    current_direction=np.pi / 2.0,
    current_variation=0.0,
    spread=Spread(rotor_drag=(1.19e-4, 1.19e-4)),
)


def settled(z, periods):
    """An environment in steady weather, a shield that is ready for it, what it observed last and what it remembers."""
    env = gym.make("HydroneGym/Mission-v0", weather=STEADY)
    scenario = Scenario(start=(0.0, 0.0, z, 0.0), goal=(8.0, 8.0, z), obstacles=())
    observation, _ = env.reset(options={"scenario": scenario})
    shield, state, hover = Shield.for_env(Hover(), env, level=3), None, None
    for _ in range(periods):
        hover, state = shield.predict(observation, state)
        observation = env.step(hover)[0]
    return env, shield, observation, shield.predict(observation, state)[1].sights


class Hover:
    """Asks for the reference in force."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        return np.float32(observation["reference"]), None


def test_in_still_weather_a_way_out_of_the_water_that_is_held_is_verified_again():
    """Held is a place in air, and a sphere that has come into sight hangs in the way: the vehicle swims off instead."""
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=1)
    observation = drifting(env, -0.004)
    observation["obstacles"] = np.array([[0.0, -9.9, -1.0, 0.5]])
    held = np.array([[0.0, -9.9, AIR_GATE, 0.0]])
    assert Shield.for_env(None, env).check(observation, held, held)[2].tolist() == [RETREAT]


def test_in_wind_a_vehicle_that_leans_is_at_rest():
    _, shield, observation, sights = settled(4.0, 16)
    assert np.linalg.norm(observation["state"][3:5]) > 0.03  # more than what is level in still weather
    here = observation["reference"][None]
    assert shield.check(observation, here, here, sights=sights)[2].tolist() == [0]
    # who believes in still air sees it rise against the wind, and comes to rest level
    unaware = Shield.for_env(None, gym.make("HydroneGym/Mission-v0"))
    row, rollout = row_at(observation["state"]), Rollout(unaware.simulation, np.zeros((0, 4)))
    row["integral"], row["reference"] = observation["integral"], observation["reference"]
    rollout.fly(row, observation["reference"])
    assert np.abs(row["state"][0, :2] - observation["state"][:2]).max() > 0.04


def test_in_a_current_a_drift_that_stays_clear_is_a_stop():
    """Six seconds flown and two more carried on: 12, as in still water, would end at the farther sphere too.

    Where it does not stay clear, the stop is to drive off, ahead or astern, a little off the drift.
    """
    _, shield, observation, (sight,) = settled(-2.5, 1)
    observation["state"][:], observation["integral"][:] = (0, 0, -2.5, 0, 0, 0, 0, 0.15, 0, 0, 0, 0), 0.0
    observation["reference"][:] = (0, 0, -2.5, 0)
    here, stops = observation["reference"][None], []
    adrift = (sight._replace(estimate=np.array([0.0, 0.0, 0.0, 0.0, 0.15, 0.0])),)
    for distance in (2.55, 3.0):
        observation["obstacles"] = np.array([[0.0, distance, -2.5, 0.8]])
        _, held, choice = shield.check(observation, here, here, sights=adrift)
        assert choice.tolist() == [0]
        stops.append(held[0])
    assert np.abs(stops[1][:3] - observation["state"][:3]).max() < 0.1
    away = stops[0][:2] - observation["state"][:2]
    assert np.hypot(*away) > 1.7
    assert abs(away[0]) > 1.5


def test_a_current_that_cannot_be_turned_against_in_time_is_left_obliquely():
    """0.8 m from a wall, side on to a current toward it: a quarter turn takes five seconds, the wall is reached in two.

    Held as it is the vehicle leaves the box; what the shield holds instead is flown, and stays inside.
    """
    _, shield, observation, (sight,) = settled(-2.5, 1)
    observation["state"][:], observation["integral"][:] = (0, -9.2, -2.5, 0, 0, 0, 0, -0.2, 0, 0, 0, 0), 0.0
    observation["reference"][:] = (0, -9.2, -2.5, 0)
    observation["obstacles"] = np.zeros((1, 4))
    here, steady = observation["reference"][None], np.array([0.0, 0.0, 0.0, 0.0, -0.3, 0.0])
    adrift = (sight._replace(estimate=steady),)
    sent, held, _ = shield.check(observation, here, here, sights=adrift)
    conditions, least = shield.estimator.conditions(adrift[0]), []
    for references in ([here[0]] * 10, [sent[0], *[held[0]] * 9]):
        row, rollout = row_at(observation["state"]), Rollout(shield.simulation, np.zeros((0, 4)), conditions)
        row["reference"] = observation["reference"]
        places = []
        for reference in references:
            rollout.fly(row, reference)
            places.append(row["state"][0, 1])
        least.append(min(places))
    assert least[0] < -10.0 < -9.9 < least[1]


def test_in_weather_more_is_kept_from_walls_and_spheres():
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=0)
    observation, _ = env.reset(seed=0)
    observation["state"][:6], observation["reference"][:] = (9.6, 0, 5, 0, 0, 0), (9.6, 0, 5, 0)
    here, ends = observation["reference"][None], {0: [], 3: []}
    for level, x in itertools.product(ends, np.linspace(9.6, 10.0, 21)):
        sent, held, _ = Shield.for_env(None, env, level=level).check(observation, np.array([[x, 0, 5, 0]]), here)
        row, rollout = row_at(observation["state"]), Rollout(Simulation(HYDRONE, World()), np.zeros((0, 4)))
        for reference in [sent[0], *[held[0]] * 12]:
            rollout.fly(row, reference)
            ends[level].append(row["state"][0, 0])
    assert max(ends[3]) <= 9.6 + 1e-9 < 9.88 < max(ends[0]) < 10.0  # who is nearer than `room` comes no nearer
    assert {name: value for name, value in caution_at(3)._asdict().items() if name != "tube"} == pytest.approx(
        {
            "margin": 0.2,
            "edge_margin": 0.25,
            "rest_margin": 0.12,
            "room": 0.75,
            "crossing_speed": 0.15,
            "crossing_tilt": np.radians(4.5),
            "drift": 1.5,
        }
    )


def test_a_vehicle_that_weather_has_put_near_a_wall_may_leave():
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=0)
    observation, _ = env.reset(seed=0)
    observation["state"][:6], observation["reference"][:] = (9.95, 0, 5, 0, 0, 0), (9.95, 0, 5, 0)
    here = observation["reference"][None]
    for level in (0, 3):
        shield = Shield.for_env(None, env, level=level)
        assert shield.check(observation, np.array([[9.9, 0.0, 5.0, 0.0]]), here)[2].tolist() == [0]
