"""A tree as arrays, for looking at it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class TreeView(NamedTuple):
    """A tree as arrays, for looking at it."""

    edges: NDArray[np.float64]  # (E, 2, 3) reference at the parent and at the node, m
    air: NDArray[np.bool_]  # (E,) whether the node lies in air
    time: NDArray[np.float64]  # (E,) s from the root
    path: NDArray[np.intp]  # edges of the best path to the goal, in order; empty if none


def tree_view(nodes: np.ndarray) -> TreeView:
    """Return the edges of a tree.

    Args:
        nodes: (n,) dtype `NODE`, the root first and a parent always before its children; pruned ones are shown too.
    """
    edges = np.stack([nodes["reference"][nodes["parent"][1:], :3], nodes["reference"][1:, :3]], axis=1)
    ends = np.flatnonzero((nodes["goal"] == 1) & (nodes["dead"] == 0))
    path: list[int] = []
    i = int(ends[np.argmin(nodes["cost"][ends])]) if len(ends) else 0
    while i > 0:
        path.append(i - 1)
        i = int(nodes["parent"][i])
    return TreeView(edges, nodes["state"][1:, 2] > 0.0, nodes["time"][1:], np.array(path[::-1], np.intp))
