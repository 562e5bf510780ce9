"""What planner and shield do otherwise in weather: where crossings begin, with which heading, and how."""

import gymnasium as gym
import numpy as np
import pytest

import hydrone_gym  # noqa: F401
from hydrone_gym import Scenario
from hydrone_gym.evaluation import fly
from planners import CLRRT, Shield, StraightLine
from planners.caution import caution_at
from planners.disturbance import Sight

LIMIT = 10.0  # m: half the width of the box


def crossed_at(env, policy, start, goal):
    """Fly a mission in an empty world; return the state (12,) at the tick before the surface was crossed."""
    flight = fly(env, policy, scenario=Scenario(start=start, goal=goal, obstacles=()))
    assert flight.outcome.name == "GOAL"
    z = flight.trace.states[:, 2]
    return flight.trace.states[np.flatnonzero(np.sign(z[1:]) != np.sign(z[:-1]))[0]]


@pytest.mark.parametrize(
    ("start", "goal"),
    [((-9, -9, 3.0, 0), (9.3, 9.3, -1.3)), ((9.2, -9.2, -1.3, 0), (9.2, 9, 5.0)), ((-9, 0, 3.0, 0), (9.3, 0, -1.5))],
    ids=["entry in a corner", "exit in a corner", "entry at a wall"],
)
def test_crossings_keep_away_from_walls(start, goal):
    """Beside which crossing is quickest in still weather."""
    env = gym.make("HydroneGym/Mission-v0", controller="robust")
    calm, ready = (crossed_at(env, CLRRT.for_env(env, level=level), start, goal) for level in (0, 3))
    kept = 0.85 * caution_at(3).drift
    assert LIMIT - np.abs(calm[:2]).max() < kept < LIMIT - np.abs(ready[:2]).max()


@pytest.mark.parametrize("make", ["planner", "shield"])
def test_who_dives_in_weather_faces_the_middle_of_the_box(make):
    """Beside a wall that it flew along: bow or stern toward the middle, across the wall, and not along the way."""
    env = gym.make("HydroneGym/Mission-v0", controller="robust")
    line = StraightLine.for_env(env)
    policies = [
        CLRRT.for_env(env, level=k) if make == "planner" else Shield.for_env(line, env, level=k) for k in (0, 2)
    ]
    start, goal = (-6.0, 7.0, 4.0, 0.0), (1.0, 7.0, -3.0)
    calm, ready = (crossed_at(env, policy, start, goal) for policy in policies)
    off = [abs((s[5] - np.arctan2(-s[1], -s[0]) + np.pi / 2) % np.pi - np.pi / 2) for s in (calm, ready)]
    assert off[1] < 0.2 < 0.6 < off[0]


def rising(speed, current):
    """A shield's verdict on a straight way up, for a vehicle that moves sideways in a current it believes in."""
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=1, controller="robust", weather=2)
    shield, (observation, _) = Shield.for_env(None, env, level=2), env.reset(seed=0)
    observation["state"][:], observation["integral"][:] = (0, 0, -0.95, 0, 0, 0, 0, speed, 0.5, 0, 0, 0), 0.0
    observation["reference"][:], observation["obstacles"] = (0, 0, -1.0, 0), np.zeros((1, 4))
    believed = np.array([0.0, 0.0, 0.0, 0.0, current, 0.0])
    sight = Sight(observation["state"], observation["integral"], observation["reference"], believed)
    up = np.array([[0.0, 0.0, 1.1, 0.0]])
    return shield.check(observation, up, observation["reference"][None], sights=(sight,))[2][0] == 0


def test_nobody_rises_behind_the_shield_who_moves_sideways_through_the_water():
    assert rising(0.0, 0.0)
    assert rising(0.2, 0.2)
    assert not rising(0.5, 0.0)
    assert not rising(0.0, 0.4)


def under_water(x, psi, current, held):
    """A shield of level 2 and what it sends a vehicle beside the wall at x = 10 m that a current along x carries."""
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=1, controller="robust", weather=2)
    shield, (observation, _) = Shield.for_env(None, env, level=2), env.reset(seed=0)
    observation["state"][:], observation["integral"][:] = (x, 0, -2.5, 0, 0, psi, current, 0, 0, 0, 0, 0), 0.0
    observation["reference"][:], observation["obstacles"] = held, np.zeros((1, 4))
    sight = Sight(*(observation[key] for key in ("state", "integral", "reference")), np.array([0, 0, 0, current, 0, 0]))
    return shield.check(observation, np.array([held]), observation["reference"][None], sights=(sight,))


def test_who_is_carried_toward_a_wall_swims_away_from_it_in_time():
    """Half a meter off, along the wall: it may not stay, and of the ways that are safe it takes one that leads away."""
    stay = (9.45, 0.0, -2.5, 1.2)
    for psi in (1.2, np.pi / 2, -1.2):
        sent, _, choice = under_water(9.45, psi, 0.15, stay)
        assert choice[0] != 0
        assert sent[0, 0] < 9.45
    assert under_water(8.0, 1.2, 0.15, (8.0, 0.0, -2.5, 1.2))[2][0] == 0


def test_a_crossing_that_has_begun_goes_on_behind_the_shield():
    """Between the waves nothing else is flown than what was verified before, whatever is proposed."""
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=1, controller="robust", weather=2)
    shield, (observation, _) = Shield.for_env(None, env, level=2), env.reset(seed=0)
    observation["obstacles"], down = np.zeros((1, 4)), np.array([[0.0, 0.0, -1.0, 0.0]])
    for z, goes_on in ((0.9, False), (0.3, True), (0.05, True)):
        observation["state"][:], observation["integral"][:] = (0, 0, z, *np.zeros(5), -0.3, 0, 0, 0), 0.0
        sent, _, _ = shield.check(observation, np.array([[0.0, 0.0, 2.0, 0.0]]), down)
        assert (sent[0, 2] == -1.0) == goes_on
