"""Keeping a planner's trees while it flies, to be looked at afterwards."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from planners.cl_rrt.tree import NODE
from planners.cl_rrt.view import TreeView, tree_view
from planners.policy import Observation


class TreeRecorder:
    """Wraps a policy and keeps the tree that each of its decisions left behind; actions and memory stay as they are.

    A CL-RRT, as published or made safe, leaves the part of its tree that can still be flown; any other policy leaves
    trees without edges.

    Args:
        policy: anything with Stable-Baselines3's `predict`, for one environment.

    Attributes:
        trees: a `TreeView` a period of the episode under way.
    """

    def __init__(self, policy: Any) -> None:
        """Begin without trees."""
        self.policy = policy
        self.trees: list[TreeView] = []

    def predict(
        self,
        observation: Observation,
        state: Any = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.float32], Any]:
        """Return what the policy returns, and keep its tree; a new episode drops those of the one before."""
        action, state = self.policy.predict(observation, state, episode_start, deterministic)
        if episode_start is None or np.any(episode_start):
            self.trees = []
        self.trees.append(tree_view(_living(_nodes(state))))
        return action, state


def _nodes(state: Any) -> np.ndarray:
    """Return the nodes that a policy's memory holds, none if it is no tree."""
    memory = getattr(state, "policy", state)  # behind a shield
    first = memory[0] if isinstance(memory, tuple) and memory else memory
    nodes = getattr(first, "nodes", None)
    return nodes[: first.size] if nodes is not None else np.zeros(0, NODE)


def _living(nodes: np.ndarray) -> np.ndarray:
    """Return the nodes that are not pruned, with their parents' new numbers; who is pruned takes its children along."""
    kept = nodes["dead"] == 0
    living = nodes[kept]
    living["parent"] = (np.cumsum(kept) - 1)[living["parent"]]
    return living
