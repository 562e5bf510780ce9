"""The shield: what it promises holds in the environment, whatever the policy inside does."""

import gymnasium as gym
import numpy as np
import pytest

import hydrone_gym  # noqa: F401
from hydrone_gym import Outcome, Scenario
from planners import StraightLine
from planners.belief import belief_of
from planners.shield import CANDIDATES, HELD, Shield

IDS = ("HydroneGym/Mission-v0", "HydroneGym/AirToWater-v0", "HydroneGym/WaterToAir-v0")
BAD = (Outcome.COLLISION, Outcome.OUT_OF_BOUNDS, Outcome.ROUGH_TRANSITION, Outcome.DIVERGED)


class Wild:
    """Sends references anywhere within a few metres, often through walls and obstacles, or straight for the goal."""

    def __init__(self, seed, reach):
        self.rng, self.reach = np.random.default_rng(seed), reach

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        position = np.atleast_2d(observation["state"])[:, :3]
        step = self.rng.normal(0.0, self.reach, position.shape)
        toward = np.atleast_2d(observation["goal"]) - position
        toward *= 2.0 / np.maximum(np.linalg.norm(toward, axis=1, keepdims=True), 2.0)
        goes = self.rng.random((len(position), 1)) < 0.5
        action = np.column_stack([position + np.where(goes, toward, step), self.rng.uniform(-4, 4, len(position))])
        return action.reshape(*np.shape(observation["state"])[:-1], 4).astype(np.float32), None


def first_outcomes(policy, env_id, count, seed, periods=None, **options):
    rows = gym.make_vec(env_id, num_envs=count, vectorization_mode="vector_entry_point", **options)
    observation, memory, starts = rows.reset(seed=seed)[0], None, np.ones(count, bool)
    outcome, state = np.zeros(count, int), None
    while not outcome.all():
        actions, state = policy.predict(observation, state, starts)
        observation, _, terminated, truncated, info = rows.step(actions)
        starts = terminated | truncated
        outcome = np.where(outcome == 0, info["outcome"], outcome)
    return outcome, state, memory


@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize("reach", [1.0, 6.0])
def test_a_wild_policy_is_kept_safe(env_id, reach):
    """Random references, far ones included: no collision, no way out of the box, no rough crossing."""
    rows = gym.make_vec(env_id, num_envs=1, vectorization_mode="vector_entry_point")
    shield = Shield.for_env(Wild(3, reach), rows)
    outcome, state, _ = first_outcomes(shield, env_id, 48, 900, time_limit=40.0)
    assert not np.isin(outcome, BAD).any(), outcome
    assert (state.interventions > 0).any()


def test_the_straight_line_arrives_more_often_behind_it():
    rows = gym.make_vec(IDS[1], num_envs=1, vectorization_mode="vector_entry_point")
    bare = StraightLine(belief_of(rows))
    alone = first_outcomes(bare, IDS[1], 60, 40)[0]
    shielded = first_outcomes(Shield(bare, belief_of(rows)), IDS[1], 60, 40)[0]
    assert (alone == Outcome.COLLISION).sum() > 10
    assert not np.isin(shielded, BAD).any()
    assert (shielded == Outcome.GOAL).sum() > (alone == Outcome.GOAL).sum() + 10


def test_a_safe_reference_passes_untouched():
    """In an empty world every reference of the straight line is flown as it is, but for those that leave the sensed."""
    env = gym.make(IDS[0], num_obstacles=0)
    line = StraightLine.for_env(env)
    shield = Shield.for_env(line, env)
    observation, state, done = env.reset(seed=2)[0], None, False
    while not done:
        wanted = line.predict(observation)[0]
        action, state = shield.predict(observation, state)
        np.testing.assert_array_equal(action, wanted)
        observation, _, terminated, truncated, info = env.step(action)
        done = terminated or truncated
    assert info["outcome"] is Outcome.GOAL
    assert state.interventions.tolist() == [0]
    assert state.choice.tolist() == [0]
    assert state.periods[0] == round(info["time"] / 0.5 + 0.499)


def test_single_is_batch():
    env = gym.make(IDS[1])
    rows = gym.make_vec(IDS[1], num_envs=3, vectorization_mode="vector_entry_point")
    shield = Shield.for_env(StraightLine.for_env(env), env)
    one, many, alone, together = env.reset(seed=8)[0], rows.reset(seed=7)[0], None, None
    for _ in range(30):
        action, alone = shield.predict(one, alone)
        actions, together = shield.predict(many, together)
        np.testing.assert_array_equal(actions[1], action)
        assert together.interventions[1] == alone.interventions[0]
        one, many = env.step(action)[0], rows.step(actions)[0]


def test_held_when_nothing_is_safe():
    """At full speed just before a sphere that was not there: what was verified last is held, and it is counted."""
    env = gym.make(IDS[0])
    observation = env.reset(seed=1)[0]
    state = np.array([0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    spheres = np.zeros((20, 4))
    spheres[0] = [1.6, 0.0, 5.0, 1.0]
    held = np.array([[0.1, 0.0, 5.0, 0.0]])
    observation = {**observation, "state": state, "reference": np.array([0.5, 0.0, 5.0, 0.0]), "obstacles": spheres}
    shield = Shield.for_env(None, env)
    sent, kept, choice = shield.check(observation, np.array([[1.0, 0.0, 5.0, 0.0]]), held)
    assert choice.tolist() == [HELD]
    np.testing.assert_array_equal(sent, held)
    np.testing.assert_array_equal(kept, held)


class Straight:
    """Asks for a point between here and the goal, in every period, whatever happened before."""

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        way = observation["goal"] - observation["state"][:3]
        step = way * min(1.0, 1.5 / np.linalg.norm(way))
        return np.append(observation["state"][:3] + step, 0.0).astype(np.float32), None


def fly_under_a_lid(env, policy):
    """From water straight up to a goal in air, under a sphere that hangs just above the surface."""
    lid = Scenario(start=(0, 0, -2.0, 0), goal=(0, 0, 5.0), obstacles=((0.0, 0.0, 2.0, 1.2),))
    observation, state, done = env.reset(options={"scenario": lid})[0], None, False
    while not done:
        action, state = policy.predict(observation, state)
        observation, _, terminated, truncated, info = env.step(action)
        done = terminated or truncated
    return info["outcome"], state


def test_a_step_aside_leads_out_of_a_pocket(monkeypatch):
    env = gym.make(IDS[0], num_obstacles=1, time_limit=60.0)
    outcome, state = fly_under_a_lid(env, Shield.for_env(Straight(), env))
    assert outcome is Outcome.GOAL
    assert state.detours[0] > 0
    monkeypatch.setattr("planners.aside.PATIENCE", 10_000)
    outcome, state = fly_under_a_lid(env, Shield.for_env(Straight(), env))
    assert outcome is Outcome.TIMEOUT
    assert state.detours[0] == 0


def test_who_waits_of_his_own_accord_is_left_in_peace():
    env = gym.make(IDS[0], num_obstacles=0)
    observation, state = env.reset(seed=5)[0], None

    class Hover:
        def predict(self, observation, state=None, episode_start=None, deterministic=False):
            return observation["reference"].astype(np.float32), None

    shield = Shield.for_env(Hover(), env)
    for _ in range(40):
        action, state = shield.predict(observation, state)
        observation = env.step(action)[0]
    assert state.detours.tolist() == [0]
    assert state.interventions.tolist() == [0]


def test_an_episode_begins_anew():
    env = gym.make(IDS[0])
    shield = Shield.for_env(Wild(0, 3.0), env)
    observation, state = env.reset(seed=3)[0], None
    for _ in range(5):
        action, state = shield.predict(observation, state)
        observation = env.step(action)[0]
    assert state.periods.tolist() == [5]
    state = shield.predict(observation, state, np.array([True]))[1]
    assert state.periods.tolist() == [1]
    assert state.interventions[0] <= 1


def test_candidates():
    assert CANDIDATES.shape == (29, 3)
    assert len(np.unique(CANDIDATES, axis=0)) == 29
    assert CANDIDATES[-1].tolist() == [0.0, 0.0, 0.0]


def test_bad_input():
    env = gym.make(IDS[0])
    shield = Shield.for_env(StraightLine.for_env(env), env)
    observation = env.reset(seed=0)[0]
    state = shield.predict(observation)[1]
    with pytest.raises(ValueError, match="1 memories for 2 observations"):
        shield.predict({k: np.stack([v, v]) for k, v in observation.items()}, state)
    with pytest.raises(ValueError, match="lacks integral"):
        shield.check({k: v for k, v in observation.items() if k != "integral"}, np.zeros((1, 4)), np.zeros((1, 4)))
    with pytest.raises(ValueError, match="must be finite"):
        shield.check(observation, np.full((1, 4), np.nan), np.zeros((1, 4)))
    with pytest.raises(TypeError, match="HyDrone"):
        Shield.for_env(None, gym.make("CartPole-v1"))


class Watching:
    """Flies a straight line and keeps what it was shown."""

    def __init__(self, env):
        self.line, self.shown = StraightLine.for_env(env), []

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        self.shown.append({key: np.copy(value) for key, value in observation.items()})
        return self.line.predict(observation)


def test_with_latency_what_was_checked_in_a_period_is_flown_in_the_next():
    """The policy sees what will be observed then, bit for bit, and the first period is flown as the episode begins."""
    env = gym.make(IDS[1], num_obstacles=0)
    watching = Watching(env)
    shield = Shield.for_env(watching, env, latency=True)
    (observation, _), state, sent = env.reset(seed=4), None, None
    for period in range(30):
        action, new = shield.predict(observation, state)
        np.testing.assert_array_equal(action, observation["reference"] if period == 0 else sent)
        (sent,), state = new.sent.astype(np.float32), new
        observation = env.step(action)[0]
        for key in ("state", "integral", "reference"):
            np.testing.assert_array_equal(observation[key], watching.shown[-1][key])
    assert np.linalg.norm(observation["state"][:3] - watching.shown[0]["state"][:3]) > 5.0


@pytest.mark.parametrize("env_id", IDS)
def test_a_wild_policy_is_kept_safe_with_latency(env_id):
    rows = gym.make_vec(env_id, num_envs=1, vectorization_mode="vector_entry_point")
    shield = Shield.for_env(Wild(3, 6.0), rows, latency=True)
    outcome, state, _ = first_outcomes(shield, env_id, 48, 900, time_limit=40.0)
    assert not np.isin(outcome, BAD).any(), outcome
    assert (state.interventions > 0).any()


def test_with_latency_spheres_are_known_from_where_they_were_sensed():
    """What is within the sensor's range of where the vehicle will be, but not of where it is, is not known free."""
    env = gym.make(IDS[0], num_obstacles=0)
    observation, _ = env.reset(seed=0)
    observation["state"][:] = (0, 0, 5, 0, 0, 0, 1.0, 0, 0, 0, 0, 0)
    observation["reference"][:] = (0, 0, 5, 0)
    shield, held = Shield.for_env(None, env), observation["reference"][None]
    proposed = np.array([[1.8, 0.0, 5.0, 0.0]])
    assert shield.check(observation, proposed, held)[2].tolist() == [0]
    assert shield.check(observation, proposed, held, eyes=np.array([[-1.5, 0.0, 5.0]]))[2].tolist() != [0]


@pytest.mark.parametrize("latency", [1, None, "yes"])
def test_bad_latency(latency):
    with pytest.raises(ValueError, match=f"latency must be True or False, got {latency!r}"):
        Shield.for_env(None, gym.make(IDS[0]), latency=latency)
