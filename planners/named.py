"""Planners with options, or made of several parts, as factories with a name."""

from typing import Any

from planners.cl_rrt.policy import CLRRT
from planners.shield import Shield
from planners.straight_line import StraightLine

WEATHER = 3  # the level that named policies are ready for


def clrrt_weather(env: Any, seed: int = 0) -> CLRRT:
    """Return the CL-RRT that is ready for weather, for an environment."""
    return CLRRT.for_env(env, level=WEATHER, seed=seed)


def straight_line_shield(env: Any) -> Shield:
    """Return the straight line behind the shield, for an environment."""
    return Shield.for_env(StraightLine.for_env(env), env)
