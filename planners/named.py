"""Planners with options, or made of several parts, as factories with a name."""

from typing import Any

from hydrone_gym.weather.weather import LEVELS
from planners.cl_rrt.policy import CLRRT
from planners.shield import Shield
from planners.straight_line import StraightLine

_UNNAMED = 3  # the level that is assumed of weather that is none of the levels


def level_of(env: Any) -> int:
    """Return the level of weather that an environment is made for, which is announced, as its vehicle is."""
    first = env.envs[0] if hasattr(env, "envs") else env
    weather = first.unwrapped.options.the_weather
    return LEVELS.index(weather) if weather in LEVELS else _UNNAMED


def clrrt_weather(env: Any, seed: int = 0, **given: Any) -> CLRRT:
    """Return the CL-RRT that is ready for an environment's level of weather, with other arguments of it as given."""
    return CLRRT.for_env(env, level=level_of(env), seed=seed, **given)


def straight_line_shield(env: Any) -> Shield:
    """Return the straight line behind the shield, for an environment."""
    return Shield.for_env(StraightLine.for_env(env), env)


def weather_shield(policy: Any, env: Any, **given: Any) -> Shield:
    """Return any policy behind a shield that is ready for an environment's weather, other arguments as given."""
    return Shield.for_env(policy, env, level=level_of(env), **given)
