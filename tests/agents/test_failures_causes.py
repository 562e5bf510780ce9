"""Causes of failures by value: flights made to fail in one known way each."""

import gymnasium as gym
import numpy as np
import pytest

import hydrone_gym  # noqa: F401  (registers the ids)
from agents.failures import causes
from agents.failures.causes import examine
from agents.failures.flights import fly_failed
from hydrone_gym.evaluation import fly
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.world.scenario import Scenario
from planners.shield import Shield

MISSION = "HydroneGym/Mission-v0"


class Steps:
    """Sends the vehicle a step of (x, y, z) m from where it is, the step being a function of state (12,)."""

    def __init__(self, step):
        self.step = step if callable(step) else lambda state: step

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        rows = np.atleast_2d(observation["state"])
        sent = [[*(row[:3] + self.step(row)), 0.0] for row in rows]
        return np.array(sent, np.float32).reshape(observation["reference"].shape), state


class OneWorld(gym.Wrapper):
    """Flies one scenario, whatever the seed."""

    def __init__(self, env, scenario):
        super().__init__(env)
        self.scenario = scenario

    def reset(self, *, seed=None, options=None):
        return self.env.reset(seed=seed, options={"scenario": self.scenario})


def world(start, goal, *spheres, **options):
    return OneWorld(
        gym.make(MISSION, **options),
        Scenario(start=(*start, 0.0), goal=goal, obstacles=np.array(spheres).reshape(-1, 4)),
    )


def failure_of(env, policy, outcome):
    return examine(fly_failed(env, policy, env.scenario, mission=MISSION, seed=0, outcome=outcome.name))


def flown_by_hand(env, policy):
    """Times and observations at each decision, then the end, stepping the environment ourselves."""
    observation, info = env.reset()
    seen, done = [(0.0, observation)], False
    while not done:
        observation, _, terminated, truncated, info = env.step(policy.predict(observation)[0])
        seen.append((info["time"], observation))
        done = terminated or truncated
    return seen, info


def test_into_a_known_sphere():
    env = world((-8.0, 0.0, 5.0), (8.0, 0.0, 5.0), (6.0, 6.0, 5.0, 1.0), (0.5, 0.6, 5.3, 1.0))
    policy = Steps((2.0, 0.0, 0.0))
    failure = failure_of(env, policy, Outcome.COLLISION)
    seen, info = flown_by_hand(env, policy)
    end, last = info["time"], seen[-1][1]["state"]
    learnt = next(time for time, observation in seen if observation["obstacles"][0, 3] > 0.0)
    assert (failure.cause, failure.end.part, failure.end.medium) == (causes.SEEN, causes.AIR_LEG, "air")
    assert failure.end.time_s == end
    assert failure.end.horizontal_speed_m_s == pytest.approx(np.hypot(last[6], last[7]))
    assert failure.end.horizontal_speed_m_s == pytest.approx(2.0, abs=0.02)
    assert failure.end.share_of_way == pytest.approx((last[0] + 8.0) / 16.0)
    assert (failure.contact.sphere, failure.contact.sphere_radius_m) == (1, 1.0)
    toward = (np.array([0.5, 0.6, 5.3]) - last[:3]) / np.linalg.norm(np.array([0.5, 0.6, 5.3]) - last[:3])
    assert failure.contact.closing_speed_m_s == pytest.approx(last[6:9] @ toward)
    assert failure.contact.sphere_elevation_deg == pytest.approx(np.degrees(np.arcsin(toward[2])))
    assert failure.contact.known_s == pytest.approx(end - learnt)
    assert 0.5 < failure.contact.known_s < 1.3  # detected within 3 m, so 2.5 m before the contact, at 2 m/s
    assert failure.chance.known_at_last_chance
    assert failure.chance.last_chance_speed_m_s == pytest.approx(2.0, abs=0.05)
    assert failure.stayed_s == pytest.approx(0.5, abs=0.05)  # 1 m at 2 m/s
    assert failure.end.zone_entry_speed_m_s is None


class HandOver:
    """Flies a policy, and from one decision on another one."""

    def __init__(self, first, then, decision):
        self.first, self.then, self.decision = first, then, decision

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        count, memory = state or (0, None)
        policy = self.then if count >= self.decision else self.first
        action, memory = policy.predict(observation, memory, episode_start)
        return action, (count + 1, memory)


def test_the_last_chance_is_the_last():
    """Whoever hands over to the shield there does not touch the sphere; one decision later it has nothing left."""
    env = world((-8.0, 0.0, 5.0), (8.0, 0.0, 5.0), (0.0, 0.0, 5.0, 1.4), time_limit=20.0)
    policy = Steps((2.0, 0.0, 0.0))
    failure = failure_of(env, policy, Outcome.COLLISION)
    decision = round((failure.end.time_s - failure.chance.last_chance_s) / 0.5)
    shield = Shield.for_env(policy, env)
    assert fly(env, HandOver(policy, shield, decision)).outcome is Outcome.TIMEOUT
    assert fly(env, HandOver(policy, shield, decision + 1)).outcome is Outcome.COLLISION


@pytest.mark.parametrize(("x", "cause"), [(0.5, causes.LATE), (0.9, causes.NEVER)])
def test_a_sphere_that_is_sensed_late(x, cause):
    """Sensed from 1.2 m, 0.75 m before the contact: at 2 m/s there is one decision more, or none."""
    env = world((-8.0, 0.0, 5.0), (8.0, 0.0, 5.0), (x, 0.0, 5.0, 1.0), sensor_range=1.2)
    failure = failure_of(env, Steps((2.0, 0.0, 0.0)), Outcome.COLLISION)
    assert failure.cause == cause
    assert (failure.contact.known_s is None) == (cause == causes.NEVER)
    if cause == causes.LATE:
        assert 0.0 < failure.contact.known_s <= 0.375 + 0.05
        assert failure.chance is None or not failure.chance.known_at_last_chance


@pytest.mark.parametrize(("x", "cause"), [(-3.0, causes.SLID), (-2.5, causes.SLID_LATE)])
def test_a_dive_that_slides_on_in_the_zone(x, cause):
    """It enters the zone at 2 m/s, and braking with 4 degrees of tilt takes it 2.8 m on, against its own reference."""

    def dive(state):
        return np.array([2.0 if state[2] > 1.2 else -2.0, 0.0, -0.7])

    env = world((-8.0, 0.0, 3.0), (8.0, 0.0, -3.0), (x, 0.0, 0.9, 0.6))
    failure = failure_of(env, Steps(dive), Outcome.COLLISION)
    assert (failure.cause, failure.end.part, failure.end.medium) == (cause, causes.FROM_AIR, "air")
    assert failure.end.tilt_deg == pytest.approx(4.0, abs=0.1)
    assert failure.end.zone_entry_speed_m_s == pytest.approx(2.0, abs=0.1)
    assert 0.5 < failure.end.horizontal_speed_m_s < 1.6
    late = failure.chance.last_chance_s > failure.contact.known_s
    assert (late, failure.chance.known_at_last_chance) == (cause == causes.SLID_LATE, cause == causes.SLID)


def test_rising_under_a_sphere_in_the_zone():
    env = world((-5.0, 0.0, -3.0), (5.0, 0.0, 3.0), (-5.0, 0.5, 1.3, 0.8))
    failure = failure_of(env, Steps((0.0, 0.0, 1.5)), Outcome.COLLISION)
    assert (failure.cause, failure.end.part, failure.end.medium) == (causes.ROSE_OR_SANK, causes.FROM_WATER, "air")
    assert (failure.end.x_m, failure.end.horizontal_speed_m_s) == pytest.approx((-5.0, 0.0), abs=1e-3)
    height = 1.3 - np.sqrt((0.8 + env.unwrapped.vehicle.radius) ** 2 - 0.5**2)  # where the column meets the sphere
    assert failure.end.z_m == pytest.approx(height, abs=0.03)  # a tick at 0.5 m/s
    assert failure.contact.known_s > 4.0


def test_out_of_the_box():
    start, goal = (5.0, 0.0, 3.0), (-5.0, 0.0, -3.0)
    slid = failure_of(world(start, goal), Steps((2.0, 0.0, -1.5)), Outcome.OUT_OF_BOUNDS)
    assert (slid.cause, slid.contact, slid.chance.known_at_last_chance) == (causes.SLID_OUT, None, None)
    assert slid.end.x_m > 10.0
    assert slid.end.share_of_way < 0.0
    sank = failure_of(world((5.0, 0.0, -3.0), (-5.0, 0.0, -3.0)), Steps((0.0, 0.0, -1.5)), Outcome.OUT_OF_BOUNDS)
    assert (sank.cause, sank.end.part, sank.end.medium) == (causes.LEFT, causes.WATER_LEG, "water")
    assert sank.end.z_m < -5.0


@pytest.mark.parametrize(
    ("height", "cause"), [(1.0, causes.ROUGH_SPEED), (0.3, causes.ROUGH_BOTH), (0.2, causes.ROUGH_TILT)]
)
def test_rough_crossings(height, cause):
    """Sinking without the vertical mode, from a height on also sideways: the later, the slower but the more tilted."""

    def sink(state):
        return np.array([2.0 if state[2] < height else 0.0, 0.0, -0.3])

    env = world((-5.0, 0.0, 1.0), (5.0, 0.0, -3.0), vertical_mode=False, period=0.05)
    failure = failure_of(env, Steps(sink), Outcome.ROUGH_TRANSITION)
    crossing = flown_by_hand(env, Steps(sink))[1]["transitions"][-1]
    assert (failure.cause, failure.end.part) == (cause, causes.FROM_AIR)
    assert failure.end.horizontal_speed_m_s == crossing["lateral_speed"]
    assert failure.end.vertical_speed_m_s == crossing["vertical_speed"]
    assert failure.end.tilt_deg == pytest.approx(np.degrees(crossing["tilt"]))
    assert (failure.end.horizontal_speed_m_s > 0.2) == (cause != causes.ROUGH_TILT)
    assert (failure.end.tilt_deg > 5.0) == (cause != causes.ROUGH_SPEED)


def around(state):
    """A step along a circle of 3 m about (-5, 0)."""
    angle = np.arctan2(state[1], state[0] + 5.0) + 0.3
    return np.array([3.0 * np.cos(angle) - 5.0 - state[0], 3.0 * np.sin(angle) - state[1], 5.0 - state[2]])


@pytest.mark.parametrize(
    ("step", "cause"),
    [
        ((0.0, 0.0, 0.0), causes.WAITED),
        (around, causes.CIRCLED),
        ((0.1, 0.0, 0.0), causes.MADE_WAY),
    ],
)
def test_time_outs(step, cause):
    env = world((-8.0, 0.0, 5.0), (8.0, 8.0, 5.0), time_limit=45.0)
    failure = failure_of(env, Steps(step), Outcome.TIMEOUT)
    assert (failure.cause, failure.contact, failure.chance) == (cause, None, None)
    assert failure.end.time_s == 45.0
    if cause == causes.WAITED:
        assert failure.stayed_s == 45.0
    else:
        assert 0.0 < failure.stayed_s < 10.0
    assert failure.path.shape == (91, 2)
    assert failure.path[-1] == pytest.approx((failure.end.share_of_way, failure.end.z_m))


def test_waiting_in_the_zone():
    """Whoever asks for steps to the side at its own height stays in the zone: the vertical mode ignores them."""

    def sideways(state):
        return np.array([2.0, 0.0, 0.4 - state[2]])

    env = world((-5.0, 0.0, 1.0), (8.0, 0.0, 5.0), time_limit=45.0)
    failure = failure_of(env, Steps(sideways), Outcome.TIMEOUT)
    assert (failure.cause, failure.end.part) == (causes.WAITED_IN_ZONE, causes.FROM_AIR)
    assert failure.end.z_m == pytest.approx(0.4, abs=0.1)
    assert failure.interventions is None


def test_waiting_begins_where_it_stops():
    """12 s of flight at 0.4 m/s and more, then still."""

    def stop_later(state):
        return np.array([2.0, 0.0, 0.0]) if state[0] < 0.0 else np.zeros(3)

    env = world((-8.0, 0.0, 5.0), (8.0, 8.0, 5.0), time_limit=45.0)
    failure = failure_of(env, Steps(stop_later), Outcome.TIMEOUT)
    assert failure.cause == causes.WAITED
    states = fly(env, Steps(stop_later)).trace.states
    away = np.linalg.norm(states[:, :3] - states[-1, :3], axis=1) > 1.0
    assert failure.stayed_s == pytest.approx(45.0 - 0.05 * np.flatnonzero(away)[-1])
    assert 35.0 < failure.stayed_s < 44.0
