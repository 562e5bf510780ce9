"""Planners that are made of several parts, as factories with a name."""

from typing import Any

from planners.shield import Shield
from planners.straight_line import StraightLine


def straight_line_shield(env: Any) -> Shield:
    """Return the straight line behind the shield, for an environment."""
    return Shield.for_env(StraightLine.for_env(env), env)
