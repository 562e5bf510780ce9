"""How an episode, a period or a tree edge ended."""

from enum import IntEnum


class Outcome(IntEnum):
    """The state of a mission; everything but RUNNING ends it."""

    RUNNING = 0
    GOAL = 1
    COLLISION = 2
    OUT_OF_BOUNDS = 3
    ROUGH_TRANSITION = 4
    TIMEOUT = 5
    DIVERGED = 6


# Kernels read the members as plain constants.
RUNNING, GOAL, COLLISION, OUT_OF_BOUNDS, ROUGH_TRANSITION, TIMEOUT, DIVERGED = (int(member) for member in Outcome)
