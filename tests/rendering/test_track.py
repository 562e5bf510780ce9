"""What is drawn has happened: the same numbers as the flight itself, and nothing of what is still to come."""

import numpy as np

from hydrone_gym import Outcome
from hydrone_gym.evaluation import fly
from hydrone_gym.rendering.track import moment_of, moments
from planners import StraightLine
from tests.envs.missions import DIVE, SPHERE_BETWEEN, begin, wander


def test_ticks_are_those_of_the_flight():
    env, _ = begin(DIVE, render_mode="rgb_array")
    flight = fly(env, StraightLine.for_env(env), scenario=DIVE)
    track = env._screen.track(0)
    ticks = track.ticks(env.simulation)
    np.testing.assert_array_equal(ticks[:, :12], flight.trace.states)
    np.testing.assert_array_equal(ticks[:, 12:], flight.trace.references)
    np.testing.assert_array_equal(ticks[-1, :12], flight.states[-1])


def test_ticks_can_be_asked_for_at_any_time():
    env, _ = begin(DIVE, render_mode="rgb_array")
    other, _ = begin(DIVE, render_mode="rgb_array")
    lengths = []
    for _ in range(6):
        for each in (env, other):
            each.step(np.array([0.0, 0.0, 3.0, 0.0]))
        lengths.append(len(env._screen.track(0).ticks(env.simulation)))
    assert lengths == [11, 21, 31, 41, 51, 61]
    often, once = (each._screen.track(0).ticks(each.simulation) for each in (env, other))
    np.testing.assert_array_equal(often, once)


def test_a_copy_goes_on_by_itself():
    env, _ = begin(DIVE, render_mode="rgb_array")
    wander(env, 2, 0)
    copy = env._screen.track(0)
    length = len(copy.ticks(env.simulation))
    wander(env, 2, 1)
    assert len(copy.ticks(env.simulation)) == length
    assert len(env._screen.track(0).ticks(env.simulation)) > length


def test_earlier_moments_know_only_what_was_known():
    env, _ = begin(SPHERE_BETWEEN)
    flight = fly(env, StraightLine.for_env(env), scenario=SPHERE_BETWEEN)
    assert flight.outcome is Outcome.COLLISION
    last = moment_of(flight)
    shown = list(moments(last, range(1, len(last.ticks) + 1), 1.0))
    assert shown[-1] is last
    assert [len(moment.ticks) for moment in shown] == list(range(1, len(last.ticks) + 1))
    np.testing.assert_allclose([moment.time for moment in shown], flight.trace.times, atol=1e-9)
    assert {moment.outcome for moment in shown[:-1]} == {Outcome.RUNNING}
    near = np.linalg.norm(last.ticks[:, :3] - last.obstacles[0, :3], axis=1) - last.obstacles[0, 3] <= 1.001
    assert not near[0]
    assert [bool(moment.detected[0]) for moment in shown] == np.maximum.accumulate(near).tolist()


def test_what_was_known_from_the_start_stays_known():
    env, _ = begin(SPHERE_BETWEEN)
    last = moment_of(fly(env, StraightLine.for_env(env), scenario=SPHERE_BETWEEN))
    far = last._replace(obstacles=last.obstacles + [0.0, 9.0, 0.0, 0.0])
    assert all(moment.detected[0] for moment in moments(far, range(1, 5), 1.0))
