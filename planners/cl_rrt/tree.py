"""The tree: plain arrays of nodes with parent indices, a parent always before its children."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import inlined
from hydrone_gym.simulation.block import CROSSING_FIELDS, LOGGED_CROSSINGS, new_block

# What a node is part of
OPEN = 0  # ordinary: may be extended, can stop here
SETTLING = 1  # coming to rest before a crossing: can still stop
CROSSING = 2  # inside a crossing: the only way to stop is to finish it

NODE = np.dtype(
    [
        ("state", np.float64, (12,)),
        ("integral", np.float64, (4,)),
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


class Workspace(NamedTuple):
    """Arrays a planning cycle works in. `nodes` has one spare slot at the end for scratch edges."""

    nodes: np.ndarray  # (capacity + 1,) dtype NODE
    block: np.ndarray  # one lane
    log: NDArray[np.float64]
    closest: NDArray[np.float64]  # (obstacles,)
    obstacles: NDArray[np.float64]  # (4 * obstacles,) flat
    path: NDArray[np.int64]  # (capacity + 1,)
    edges: NDArray[np.int64]  # (1,) edges propagated so far
    backup: NDArray[np.float64]  # (BACKUP, 4) verified references that end in a stop


BACKUP = 64  # references; a crossing in full takes about 35


def new_nodes(capacity: int) -> np.ndarray:
    """Return an empty tree with room for `capacity` nodes and one for scratch."""
    return np.zeros(capacity + 1, NODE)


def new_workspace(nodes: np.ndarray, obstacles: NDArray[np.float64], backup: NDArray[np.float64]) -> Workspace:
    """Gather the arrays of one planning cycle around a tree."""
    log = np.zeros((1, LOGGED_CROSSINGS, len(CROSSING_FIELDS)))
    closest = np.zeros(len(obstacles))
    path = np.zeros(len(nodes), np.int64)
    return Workspace(nodes, new_block(1), log, closest, obstacles.reshape(-1), path, np.zeros(1, np.int64), backup)


@inlined
def copy_node(nodes, source, target):
    """Copy one node, field by field (record assignment compiles slowly)."""
    a, b = nodes[source], nodes[target]
    for c in range(12):
        b.state[c] = a.state[c]
    for c in range(4):
        b.integral[c] = a.integral[c]
        b.reference[c] = a.reference[c]
    b.time, b.cost, b.to_go, b.parent, b.next = a.time, a.cost, a.to_go, a.parent, a.next
    b.kind, b.dead, b.unsafe, b.goal, b.tried = a.kind, a.dead, a.unsafe, a.goal, a.tried


@inlined
def prune_orphans(nodes, size):
    """Mark every node dead whose parent is dead; one pass, as parents come first."""
    for i in range(1, size):
        if nodes[nodes[i].parent].dead:
            nodes[i].dead = 1


@inlined
def reroot(nodes, size, root, path):
    """Keep only the living subtree of `root`, packed to the front; return its size. `path` is scratch."""
    start, spent = nodes[root].time, nodes[root].cost
    for i in range(size):
        path[i] = -1
    path[root] = 0
    copy_node(nodes, root, 0)
    nodes[0].parent = -1
    nodes[0].time, nodes[0].cost = 0.0, 0.0
    kept = 1
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
