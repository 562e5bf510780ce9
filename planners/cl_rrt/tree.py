"""The tree: plain arrays of nodes with parent indices, a parent always before its children."""

from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined
from hydrone_gym._memory import fields_of, pointer
from hydrone_gym.simulation.rollout import Rollout
from hydrone_gym.simulation.simulation import STILL, Simulation
from hydrone_gym.simulation.storage import VESSEL, Flown
from planners.check import Check, state_of

# What a node is part of. Plain numbers would be literals, and Numba compiles what is handed one anew for each of them.
OPEN = np.int64(0)  # ordinary: may be extended, can stop here
SETTLING = np.int64(1)  # coming to rest before a crossing: can still stop
CROSSING = np.int64(2)  # inside a crossing: the only way to stop is to finish it
ROOT = np.int64(0)  # the root's number

NODE = np.dtype(
    [
        *fields_of(Flown),  # with the reference a vessel
        ("reference", np.float64, (4,)),
        ("time", np.float64),  # since the root, s
        ("cost", np.float64),  # cost-to-come, in units of the objective
        ("to_go", np.float64),  # cost-to-go
        ("parent", np.int64),
        ("next", np.int64),  # successor inside a crossing, else -1
        ("kind", np.int64),
        ("dead", np.int64),  # pruned
        ("unsafe", np.int64),  # its extension ran into something: no place for a path to end
        ("goal", np.int64),  # the edge into it ends at the goal
        ("tried", np.int64),  # the goal was tried from here
    ]
)
_NODE_SIZE = NODE.itemsize // 8
BACKUP = 64  # references; a crossing in full takes about 35


class Workspace(NamedTuple):
    """Arrays a planning cycle works in. `nodes` has one spare slot at the end for scratch edges."""

    nodes: np.ndarray  # (capacity + 1,) dtype NODE
    path: NDArray[np.int64]  # (capacity + 1,)
    backup: NDArray[np.float64]  # (BACKUP, 4) verified references that end in a stop
    rollout: Any  # `Rollout.memory`, with the known obstacles
    scratch: NDArray[np.float64]  # two vessels
    edges: NDArray[np.float64]  # (1,) edges propagated so far

    @classmethod
    def around(
        cls,
        nodes: np.ndarray,
        backup: NDArray[np.float64],
        simulation: Simulation,
        obstacles: NDArray[np.float64],
        conditions: NDArray[np.float64] = STILL[0],
    ) -> Self:
        """Gather the arrays of one planning cycle around a tree and a backup, which it changes."""
        path, rollout = np.zeros(len(nodes), np.int64), Rollout(simulation, obstacles, conditions)
        return cls(nodes, path, backup, rollout.memory, np.zeros(2 * VESSEL), np.zeros(1))


class Planner(NamedTuple):
    """What all parts of a planning cycle work with, made in its kernel."""

    nodes: Any
    path: Any
    backup: Any
    edges: Any
    check: Check  # of stops; holds rollout, goal, world and envelope
    settings: Any  # view of `SettingParams`
    objective: Any  # view of `ObjectiveParams`
    margin: float  # clearance in m that edges keep


def new_nodes(capacity: int) -> np.ndarray:
    """Return an empty tree with room for `capacity` nodes and one for scratch."""
    return np.zeros(capacity + 1, NODE)


@inlined
def node_state(p, i):
    """Look at the `State` of node i."""
    return state_of(pointer(p.nodes[i]))


@inlined
def copy_node(nodes, source, target):
    """Copy one node, number by number (record assignment compiles slowly)."""
    a, b = pointer(nodes[source]), pointer(nodes[target])
    for k in range(_NODE_SIZE):
        b[k] = a[k]


@inlined
def prune_orphans(p, size):
    """Mark every node dead whose parent is dead; one pass, as parents come first."""
    for i in range(1, size):
        if p.nodes[p.nodes[i].parent].dead:
            p.nodes[i].dead = 1


@inlined
def reroot(nodes, size, root, path):
    """Keep only the living subtree of `root`, packed to the front; return its size. `path` is scratch."""
    start, spent = nodes[root].time, nodes[root].cost
    for i in range(size):
        path[i] = -1
    path[root] = 0
    copy_node(nodes, root, ROOT)
    nodes[0].parent = -1
    nodes[0].time, nodes[0].cost = 0.0, 0.0
    kept = ROOT + 1
    for i in range(root + 1, size):
        parent = path[nodes[i].parent]
        if parent >= 0 and not nodes[i].dead:
            path[i] = kept
            copy_node(nodes, i, kept)
            nodes[kept].parent = parent
            nodes[kept].time -= start
            nodes[kept].cost -= spent
            kept += 1
    for i in range(kept):
        if nodes[i].next >= 0:
            nodes[i].next = path[nodes[i].next]
    return kept
