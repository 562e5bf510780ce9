"""What travels between planning cycles, and what a cycle reports."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planners.cl_rrt.tree import BACKUP, new_nodes
from planners.disturbance import Sight


class Report(NamedTuple):
    """Diagnostics of one cycle."""

    nodes: int  # in the tree
    edges: int  # propagated in this cycle
    depth: int  # edges of the path sent, 0 if none was
    cost: float  # of that path to its end plus what is left, in units of the objective; inf if none
    arrives: bool  # whether that path ends at the goal
    seconds: float  # the cycle took
    waiting: int  # cycles since a path was last sent: above zero, the safety action is flown
    refusal: str | None = None  # why it waits, where forces forbid what it should do; see `planners.refusal`


@dataclass(frozen=True)
class Memory:
    """What one environment's planner remembers between periods; never changed once returned."""

    nodes: np.ndarray  # the tree
    backup: NDArray[np.float64]  # (BACKUP, 4) verified references that end in a stop
    stop: int  # how many of them
    size: int = 0  # nodes in use
    root: int = -1  # node predicted for the next observation, -1 if none
    known: int = 0  # obstacles the tree was grown with
    cycle: int = 0
    waiting: int = 0  # cycles since a path was last sent
    pending: NDArray[np.float64] | None = None  # with latency: the reference decided for the next period
    report: Report | None = None
    sight: Sight | None = None  # what the estimator of the disturbance remembers; None in still weather


def first_memory(capacity: int, reference: NDArray[np.float64]) -> Memory:
    """Return the memory an episode begins with: an empty tree, and the reference in force as the stop."""
    return Memory(new_nodes(capacity), np.tile(reference, (BACKUP, 1)), 1)
