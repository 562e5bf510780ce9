"""`fly` against a loop written by hand, and its record against independent sums."""

import math
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest

from hydrone_gym.evaluation import fly
from hydrone_gym.evaluation.flight_figures import attitude_references
from hydrone_gym.simulation.outcome import Outcome
from planners import CLRRT, StraightLine

EXPERIMENTS = ("HydroneGym/AirToWater-v0", "HydroneGym/WaterToAir-v0")


@pytest.fixture(scope="module", params=EXPERIMENTS)
def flown(request):
    env = gym.make(request.param)
    return env, fly(env, CLRRT.for_env(env), seed=4)


def test_agrees_with_a_loop_by_hand(flown):
    env, flight = flown
    policy = CLRRT.for_env(env)
    observation, info = env.reset(seed=4)
    memory, start, rewards, positions = None, np.array([True]), [], [observation["state"][:3]]
    while info["outcome"] is Outcome.RUNNING:
        action, memory = policy.predict(observation, state=memory, episode_start=start)
        observation, reward, _, _, info = env.step(action)
        start = np.array([False])
        rewards.append(reward)
        positions.append(observation["state"][:3])
    assert flight.outcome is info["outcome"]
    assert flight.time == info["time"]
    assert flight.energy == info["energy"]
    assert flight.clearance == info["clearance"]
    assert flight.transitions == info["transitions"]
    assert flight.episode_return == np.cumsum(rewards)[-1]
    np.testing.assert_array_equal(flight.states[:, :3], positions)
    np.testing.assert_array_equal(flight.detected, observation["obstacles"][: len(flight.detected)])
    assert not observation["obstacles"][len(flight.detected) :].any()
    assert len(flight.decision_ms) == len(flight.references) == len(rewards)
    assert (flight.decision_ms > 0.0).all()


def test_trace_is_the_flight_bit_for_bit(flown):
    env, flight = flown
    ticks = env.unwrapped.simulation.ticks
    whole = flight.trace.states[::ticks]
    np.testing.assert_array_equal(whole[: len(flight.states) - 1], flight.states[:-1])
    np.testing.assert_array_equal(flight.trace.states[-1], flight.states[-1])
    assert flight.trace.times[-1] == pytest.approx(flight.time, abs=1e-9)
    np.testing.assert_allclose(flight.trace.references[ticks::ticks, :3], flight.references[:, :3][: len(whole) - 1])


def test_the_trace_compiles_no_kernel_anew():
    """In a process of its own, because signatures stay: a read-only array, say, would cost seconds of compiling."""
    program = """if True:
        import gymnasium as gym
        from hydrone_gym.evaluation import fly
        from hydrone_gym.simulation.rows import advance_rows
        from planners import StraightLine
        env = gym.make("HydroneGym/AirToWater-v0")
        env.reset(seed=0)
        env.step([0.0, 0.0, 5.0, 0.0])
        before = list(advance_rows.signatures)
        fly(env, StraightLine.for_env(env), seed=0)
        print(len(before), len(advance_rows.signatures))
    """
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=True)
    assert result.stdout.split() == ["1", "1"]


def test_length_is_the_sum_of_the_ways_between_ticks(flown):
    _, flight = flown
    length = 0.0
    for a, b in zip(flight.trace.states[:-1], flight.trace.states[1:], strict=True):
        length += math.dist(a[:3], b[:3])
    assert flight.length == pytest.approx(length, rel=1e-12)
    assert flight.length >= math.dist(flight.scenario.start[:3], flight.scenario.goal) - 0.5


def test_detected_and_undetected_make_up_the_scenario(flown):
    _, flight = flown
    everything = np.concatenate((flight.detected, flight.undetected))
    assert sorted(map(tuple, everything.tolist())) == sorted(map(tuple, flight.scenario.obstacles.tolist()))
    positions = flight.trace.states[:, :3]
    for x, y, z, r in flight.undetected:
        assert np.linalg.norm(positions - (x, y, z), axis=1).min() - r > 2.9
    for x, y, z, r in flight.detected:
        assert np.linalg.norm(positions - (x, y, z), axis=1).min() - r < 3.1


def test_the_same_seed_or_scenario_gives_the_same_flight(flown):
    env, flight = flown
    again = fly(env, CLRRT.for_env(env), seed=4)
    np.testing.assert_array_equal(again.references, flight.references)
    given = fly(env, CLRRT.for_env(env), scenario=flight.scenario)
    assert given.scenario == flight.scenario
    np.testing.assert_array_equal(given.trace.states, flight.trace.states)


def test_a_flight_that_fails_is_recorded_to_its_end():
    env = gym.make(EXPERIMENTS[0], num_obstacles=40)
    for seed in range(40):
        flight = fly(env, StraightLine.for_env(env), seed=seed)
        if flight.outcome is Outcome.COLLISION:
            break
    assert flight.outcome is Outcome.COLLISION
    assert flight.clearance <= 0.0
    np.testing.assert_array_equal(flight.trace.states[-1], flight.states[-1])


def test_attitude_references_against_the_control_laws_by_hand():
    env = gym.make(EXPERIMENTS[0])
    flight = fly(env, CLRRT.for_env(env), seed=4)
    wanted = attitude_references(env.unwrapped.simulation, flight.trace)
    gains, zone = env.unwrapped.vehicle.air_gains, env.unwrapped.world.zone
    _, states, moving = flight.trace[:3]
    checked = 0
    for n in range(1, len(states)):
        x, y, z, _, _, psi, vx, vy = states[n, :8]
        if z <= zone:
            continue
        velocity = (moving[n, :2] - moving[n - 1, :2]) / 0.05
        velocity = velocity + gains.position_p / gains.position_d * (moving[n, :2] - (x, y))
        velocity *= min(1.0, gains.speed_limit / np.linalg.norm(velocity))
        ax, ay = gains.position_d * (velocity - (vx, vy))
        phi = ax * math.sin(psi) - ay * math.cos(psi)
        theta = ax * math.cos(psi) + ay * math.sin(psi)
        share = min(1.0, gains.tilt_limit / math.hypot(phi, theta))
        np.testing.assert_allclose(wanted[n, :2], (share * phi, share * theta), atol=1e-12)
        assert wanted[n, 2] == moving[n, 3]
        checked += 1
    assert checked > 100
    wet = states[:, 2] <= 0.0
    assert wet.any()
    assert np.isnan(wanted[wet, 0]).all()
    assert (wanted[wet, 1] == 0.0).all()


def test_other_environments_are_refused():
    cart_pole = gym.make("CartPole-v1")
    with pytest.raises(TypeError, match="fly needs a HyDrone environment, got CartPoleEnv"):
        fly(cart_pole, StraightLine.for_env(gym.make(EXPERIMENTS[0])))


class Blurred(gym.ObservationWrapper):
    """Tells a position that is half a metre off."""

    def observation(self, seen):
        return {**seen, "state": seen["state"] + np.append([0.5, 0.0, 0.0], np.zeros(9))}


def test_a_record_is_of_what_was_flown_not_of_what_was_told():
    env = gym.make("HydroneGym/AirToWater-v0", num_obstacles=0)
    told = []

    class Listener:
        def predict(self, observation, state=None, episode_start=None, deterministic=False):
            told.append(observation["state"][0])
            return (observation["reference"] + [1.0, 1.0, 0.0, 0.0]).astype(np.float32), None

    blurred = fly(Blurred(env), Listener(), seed=0)
    np.testing.assert_allclose(blurred.states[:-1, 0], np.array(told) - 0.5)
    np.testing.assert_array_equal(blurred.trace.states[-1], blurred.states[-1])
    assert blurred.states[0, :3].tolist() == list(env.unwrapped.scenario.start[:3])
