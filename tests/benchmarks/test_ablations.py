"""What is taken away is gone, and the rest is as it was."""

import gymnasium as gym
import numpy as np

from benchmarks.ablations import (
    weather_without_estimate,
    weather_without_margins,
    weather_without_room,
    weather_without_verified_stop,
)
from planners import CLRRTSettings
from planners.named import clrrt_weather


def test_each_lacks_one_part_of_being_ready_for_weather():
    env = gym.make("HydroneGym/AirToWater-v0", weather=2, controller="robust")
    whole = clrrt_weather(env)
    lacking = {make: make(env) for make in (weather_without_margins, weather_without_verified_stop)}
    assert lacking[weather_without_margins].settings == CLRRTSettings() != whole.settings
    assert lacking[weather_without_verified_stop].settings.margin == whole.settings.margin
    assert not lacking[weather_without_verified_stop].settings.verify
    near = weather_without_room(env)
    assert (near.caution.room, near.caution.drift) == (0.0, 0.0) < (whole.caution.room, whole.caution.drift)
    first, second = (planner._constants[0].settings for planner in (whole, near))
    assert np.count_nonzero(first != second) == 2
    (observation, _), blind, sees = env.reset(seed=1), None, None
    unmoved = weather_without_estimate(env)
    for _ in range(4):
        reference, blind = unmoved.predict(observation, blind)
        _, sees = whole.predict(observation, sees)
        observation = env.step(reference)[0]
    assert blind[0].sight is None
    assert np.abs(sees[0].sight.estimate[:2]).max() > 0.5
