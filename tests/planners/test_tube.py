"""Tubes: conformal quantiles of whole flights, and margins that grow with the time since the look."""

import gymnasium as gym
import numpy as np
import pytest

import hydrone_gym  # noqa: F401
from benchmarks.tubes import covered, tube_from
from hydrone_gym import HYDRONE, HYDRONE_PHYSICAL
from hydrone_gym.weather.weather import LEVELS
from hydrone_gym.world.world import World
from planners import CLRRT, Shield
from planners.belief import Belief
from planners.caution import caution_at, caution_for
from planners.check import MARGIN, TUBE_LENGTH
from planners.tube import Tube, tube_of

ROBUST = Belief(vehicle=HYDRONE, world=World(), law="robust")


def drawn_flights(random, count):
    """Flights of 20 looks whose deviations grow with time, those of one flight more or less alike."""
    flights = []
    for _ in range(count):
        size = random.lognormal(0.0, 0.5)
        flights.append((random.integers(0, 3, 20), size * random.random((20, TUBE_LENGTH)) * np.arange(1, 15)))
    return flights


def test_a_promise_is_kept_by_flights_of_the_same_kind():
    """Whatever the distribution: the share inside, over many tubes, is the promise and at most 1/(n + 1) more."""
    random, shares = np.random.default_rng(0), {0.5: [], 0.9: []}
    for _ in range(60):
        tube, others = tube_from(drawn_flights(random, 99)), drawn_flights(random, 50)
        for promise, found in shares.items():
            found.append(covered(tube.at(promise), others))
    for promise, found in shares.items():
        assert abs(np.mean(found) - promise) < 3.0 * np.std(found) / np.sqrt(len(found)) + 0.01


def test_a_promise_is_the_quantile_of_the_scores():
    tube = Tube(np.ones((3, TUBE_LENGTH)), np.arange(1.0, 100.0))
    assert [tube.at(p)[0, 0] for p in (0.01, 0.5, 0.505, 0.99)] == [1.0, 50.0, 51.0, 99.0]


@pytest.mark.parametrize("promise", [0.0, -0.1, 0.995, 1.0, 2.0, np.nan, True, "0.9"])
def test_bad_promise(promise):
    tube = Tube(np.ones((3, TUBE_LENGTH)), np.arange(1.0, 100.0))
    with pytest.raises(ValueError, match=r"promise must be a share of flights above 0 and at most 0.99, got"):
        tube.at(promise)


def test_a_promise_needs_weather_and_a_tube_that_was_measured():
    with pytest.raises(
        ValueError, match=r"promise needs a level of weather from 1 to 5 to be measured in, got level=0"
    ):
        caution_for(ROBUST, 0, 0.9)
    other = Belief(vehicle=HYDRONE_PHYSICAL, world=World())
    with pytest.raises(ValueError, match=r"promise needs a tube of 'physical.*measured these: paper, paper, 0.5 s"):
        caution_for(other, 2, 0.9)


@pytest.mark.parametrize("law", ["paper", "robust"])
def test_stored_tubes_grow_with_level_and_promise(law):
    tubes = [tube_of(Belief(vehicle=HYDRONE, world=World(), law=law), level) for level in range(1, len(LEVELS))]
    assert all(len(tube.scores) == 1000 for tube in tubes)
    after_3_s = [tube.at(0.9)[2, 5] for tube in tubes]
    assert after_3_s == sorted(after_3_s)
    assert 0.05 < after_3_s[0] < 0.5 < after_3_s[-1]
    assert (tubes[1].at(0.99) > tubes[1].at(0.9)).all()


def test_stops_keep_the_tube():
    """A hover a little off a sphere: kept without a promise, and with one as soon as the tube is no wider than that."""
    env = gym.make("HydroneGym/Mission-v0", num_obstacles=1, weather=2, controller="robust")
    observation, _ = env.reset(seed=0)
    observation["state"][:], observation["integral"][:] = (0, 0, 5, *np.zeros(9)), 0.0
    observation["reference"][:] = (0, 0, 5, 0)
    shields = {p: Shield.for_env(None, env, level=2, promise=p) for p in (None, 0.9)}
    width = shields[0.9].caution.tube[0].max()
    assert shields[0.9].caution.margin == MARGIN
    step = np.array([[0.3, 0.0, 5.0, 0.0]])
    verdicts = {}
    for promise, shield in shields.items():
        for clearance in (0.4, MARGIN + width + 0.1):
            distance = 0.3 + HYDRONE.radius + 0.5 + clearance
            observation["obstacles"] = np.array([[distance, 0.0, 5.0, 0.5]])
            verdicts[promise, clearance > 0.4] = shield.check(observation, step, observation["reference"][None])[2][0]
    assert [verdicts[None, False], verdicts[None, True], verdicts[0.9, True]] == [0, 0, 0]
    assert verdicts[0.9, False] != 0


def test_without_a_promise_nothing_is_kept_for_it():
    assert not caution_at(3).tube.any()
    env = gym.make("HydroneGym/Mission-v0")
    assert not CLRRT.for_env(env, level=3).caution.tube.any()
