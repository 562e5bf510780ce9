"""The disturbance that planners and shield believe in: right, bounded, exactly zero in still weather, and no truth."""

import pickle

import gymnasium as gym
import numpy as np
import pytest

import hydrone_gym  # noqa: F401
from hydrone_gym import HYDRONE, Scenario, Spread, Weather
from hydrone_gym.simulation.conditions import conditions_of, still_conditions
from hydrone_gym.simulation.rollout import Rollout
from planners import CLRRT, StraightLine
from planners.belief import belief_of
from planners.disturbance import Estimator, Sight
from planners.policy import known
from planners.shield import Shield

IDS = ("HydroneGym/AirToWater-v0", "HydroneGym/WaterToAir-v0")
STEADY = Weather(
    wind=3.0, wind_direction=0.5, turbulence=0.0, current=0.3, current_direction=2.0, current_variation=0.0
)
TRUTH = np.array([3.0 * np.cos(0.5), 3.0 * np.sin(0.5), 0.0, 0.3 * np.cos(2.0), 0.3 * np.sin(2.0), 0.0])
POLICIES = {
    "clrrt": lambda env: CLRRT.for_env(env, level=3),
    "clrrt, latency": lambda env: CLRRT.for_env(env, level=3, latency=True),
    "shield": lambda env: Shield.for_env(StraightLine.for_env(env), env, level=3),
    "shield, latency": lambda env: Shield.for_env(StraightLine.for_env(env), env, level=3, latency=True),
}
LAWS = pytest.mark.parametrize("law", ["paper", "robust"])
EVERY = pytest.mark.parametrize("make", POLICIES.values(), ids=POLICIES)


def sights_of(state):
    """What the estimator remembers in the state of a policy."""
    return state.sights if hasattr(state, "sights") else tuple(memory.sight for memory in state)


def sighted(now, estimate):
    """What an estimator remembers that has come to an estimate."""
    return Sight(now.state, now.integral, now.reference, estimate)


def hovering(env, z):
    """The first observation of a vehicle in the middle of one medium."""
    scenario = Scenario(start=(0.0, 0.0, z, 0.0), goal=(8.0, 8.0, z), obstacles=())
    return env.reset(seed=0, options={"scenario": scenario})[0]


def estimates_of(env, z, periods):
    """The estimates (periods, 6) for a vehicle that is to stay where it is."""
    estimator, sight, estimates = Estimator(belief_of(env), weathered=True), None, []
    observation = hovering(env, z)
    hover = observation["reference"].copy()
    for _ in range(periods):
        observation = env.step(hover)[0]
        sight = estimator.look(known(observation), sight)
        estimates.append(sight.estimate)
    return np.array(estimates)


@LAWS
@pytest.mark.parametrize("wind", [1.0, 3.0])
@pytest.mark.parametrize("direction", [0.0, 0.5, 4.0])
def test_the_wind_is_found_within_three_seconds(wind, direction, law):
    weather = Weather(wind=wind, wind_direction=direction, turbulence=0.0)
    estimates = estimates_of(gym.make(IDS[0], weather=weather, controller=law), 3.0, 6)
    true = wind * np.array([np.cos(direction), np.sin(direction)])
    assert np.linalg.norm(estimates[-1, :2] - true) < 0.1 * wind
    assert np.abs(estimates[:, 2]).max() < 0.05  # N
    assert not estimates[:, 3:].any()  # it knows nothing of the water


# near its place in a weak current the robust law is all switches, and what it leaves tells little
@pytest.mark.parametrize(("law", "current"), [("paper", 0.1), ("paper", 0.3), ("robust", 0.3)])
@pytest.mark.parametrize("direction", [0.0, 0.5, 2.0])
def test_the_current_is_found_within_three_seconds(current, direction, law):
    weather = Weather(current=current, current_direction=direction, current_variation=0.0)
    estimates = estimates_of(gym.make(IDS[0], weather=weather, controller=law), -2.5, 6)
    true = current * np.array([np.cos(direction), np.sin(direction)])
    assert np.linalg.norm(estimates[-1, 3:5] - true) < 0.1 * current
    assert not estimates[:, :3].any()


@pytest.mark.parametrize(("z", "entry", "looks"), [(3.0, 2, 8), (-2.5, 5, 16)])
def test_a_wrong_mass_is_found_as_a_push(z, entry, looks):
    """Slower under water, where waves heave as much as a wrong mass does."""
    env = gym.make(IDS[0], vehicle_spread=Spread(mass=0.1))
    estimates = estimates_of(env, z, looks)
    outdoors = env.unwrapped._core.outdoors
    heavier = conditions_of(outdoors.conditions, 1, 0).vehicle.air.weight - HYDRONE.mass * HYDRONE.gravity
    assert abs(heavier) > 0.3  # N
    np.testing.assert_allclose(estimates[-1, entry], -heavier, rtol=0.1)
    assert np.abs(np.delete(estimates, entry, axis=1)).max() < 0.05


def test_the_estimate_is_bounded_whatever_is_observed():
    env = gym.make(IDS[0])
    estimator, sight, rng = Estimator(belief_of(env), weathered=True), None, np.random.default_rng(0)
    observation = hovering(env, 3.0)
    for _ in range(60):
        observation["state"][6:9] = rng.normal(0.0, 20.0, 3)
        sight = estimator.look(known(observation), sight)
        assert np.isfinite(sight.estimate).all()
    assert (np.abs(sight.estimate) <= [15.0, 15.0, 3.0, 1.0, 1.0, 3.0]).all()


@LAWS
@pytest.mark.parametrize("env_id", IDS)
def test_it_is_exactly_zero_in_still_weather(env_id, law):
    """Through the surface and to the goal: the model with weather and the model without are one, bit for bit."""
    env = gym.make(env_id, controller=law)
    planner = CLRRT.for_env(env, level=3)
    (observation, _), state, done, periods = env.reset(seed=3), None, False, 0
    while not done:
        action, state = planner.predict(observation, state)
        assert not state[0].sight.estimate.any()
        expected = planner.estimator.ahead(known(observation), action.astype(np.float64), state[0].sight).state
        observation, _, terminated, truncated, info = env.step(action)
        done, periods = terminated or truncated, periods + 1
        np.testing.assert_array_equal(observation["state"], expected)
    assert info["outcome"].name == "GOAL"
    assert info["transitions"]


@LAWS
@pytest.mark.parametrize("env_id", IDS)
def test_prediction_is_execution_in_steady_wind_and_current(env_id, law):
    """With the truth for an estimate: in air, in water, and through the surface."""
    env = gym.make(env_id, weather=STEADY, num_obstacles=0, rough_transition="count", controller=law)
    estimator, line = Estimator(belief_of(env), weathered=True), StraightLine.for_env(env)
    (observation, _), heights = env.reset(seed=0), []
    for _ in range(60):
        action = line.predict(observation)[0]
        now = known(observation)
        expected = estimator.ahead(now, action.astype(np.float64), sighted(now, TRUTH)).state
        observation, _, terminated, _, _ = env.step(action)
        if terminated:
            break
        heights.append(observation["state"][2])
        np.testing.assert_allclose(observation["state"], expected, rtol=0.0, atol=1e-12)
    assert max(heights) > 0.0 > min(heights)


def test_the_other_mediums_estimate_is_kept():
    env = gym.make(IDS[0], weather=STEADY, num_obstacles=0)
    estimator = Estimator(belief_of(env), weathered=True)
    observation = hovering(env, -2.5)
    sight = sighted(known(observation), np.array([2.0, -1.0, 0.3, 0.0, 0.0, 0.0]))
    for _ in range(3):
        observation = env.step(observation["reference"])[0]
        sight = estimator.look(known(observation), sight)
    assert sight.estimate[:3].tolist() == [2.0, -1.0, 0.3]
    assert np.linalg.norm(sight.estimate[3:5]) > 0.1


@EVERY
def test_no_policy_reads_the_truth(make):
    """The weather changes after the observation was made, and what the policy does with it does not."""
    flights = []
    for other in (False, True):
        env = gym.make(IDS[1], weather=3)
        policy = make(env)
        (observation, _), state = env.reset(seed=1), None
        actions = []
        for _ in range(6):
            kept = env.unwrapped.get_state()
            if other:
                conditions = env.unwrapped._core.outdoors.conditions
                conditions[...] = np.random.default_rng(0).permutation(conditions, axis=1)
            action, state = policy.predict(observation, state)
            env.unwrapped.set_state(kept)
            observation = env.step(action)[0]
            actions.append(action)
        flights.append(np.array(actions))
        assert sights_of(state)[0].estimate.any()
    np.testing.assert_array_equal(*flights)


@EVERY
def test_its_memory_can_be_sent_elsewhere(make):
    env = gym.make(IDS[0], weather=2)
    policy = make(env)
    (observation, _), state = env.reset(seed=0), None
    for _ in range(4):
        action, state = policy.predict(observation, state)
        observation = env.step(action)[0]
    action, _ = policy.predict(observation, state)
    np.testing.assert_array_equal(policy.predict(observation, pickle.loads(pickle.dumps(state)))[0], action)
    elsewhere = pickle.loads(pickle.dumps(policy))
    np.testing.assert_array_equal(elsewhere.predict(observation, state)[0], action)


@EVERY
def test_a_batch_is_so_many_single_flights(make):
    rows = gym.make_vec(IDS[0], num_envs=3, vectorization_mode="vector_entry_point", weather=2)
    policy = make(rows)
    (observation, _), state, singly = rows.reset(seed=5), None, [None] * 3
    for k in range(5):
        starts = np.array([k == 0] * 3)
        actions, state = policy.predict(observation, state, starts)
        for row in range(3):
            alone = {key: value[row] for key, value in observation.items()}
            action, singly[row] = policy.predict(alone, singly[row], starts[:1])
            np.testing.assert_array_equal(action, actions[row])
        observation = rows.step(actions)[0]
    assert len(sights_of(state)) == 3


def test_an_episode_begins_without_an_estimate():
    env = gym.make(IDS[0], weather=3, vehicle_spread=Spread(mass=0.05))
    planner, shield = CLRRT.for_env(env, level=3), Shield.for_env(StraightLine.for_env(env), env, level=3)
    for policy in (planner, shield):
        (observation, _), state = env.reset(seed=0), None
        for _ in range(4):
            action, state = policy.predict(observation, state)
            observation = env.step(action)[0]
        assert sights_of(state)[0].estimate.any()
        state = policy.predict(observation, state, np.array([True]))[1]
        assert not sights_of(state)[0].estimate.any()


def test_a_rollout_wants_conditions_where_there_is_weather():
    belief = belief_of(gym.make(IDS[0]))
    with pytest.raises(ValueError, match="a simulation with weathered=True got 0 conditions"):
        Rollout(belief.simulation(weathered=True), np.zeros((0, 4)))
    with pytest.raises(ValueError, match="a simulation with weathered=False got"):
        Rollout(belief.simulation(), np.zeros((0, 4)), still_conditions(HYDRONE))


@pytest.mark.parametrize("level", [-1, 6, 1.5, True, "3"])
def test_bad_levels(level):
    env = gym.make(IDS[0])
    with pytest.raises(ValueError, match="level must be a whole number from 0 to 5, got"):
        CLRRT.for_env(env, level=level)
    with pytest.raises(ValueError, match="level must be a whole number from 0 to 5, got"):
        Shield.for_env(None, env, level=level)
