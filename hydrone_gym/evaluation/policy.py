"""What the evaluation asks of a policy: Stable-Baselines3's `predict`, nothing else."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Observation = NDArray | Mapping[str, NDArray]


class Policy(Protocol):
    """Anything that chooses references: a planner, an agent, or a Stable-Baselines3 model as it is."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray, Any]:
        """Return actions for one observation or a batch, and the policy's memory.

        Args:
            observation: what the environment returned, single or batched along the first axis.
            state: what the last call returned, None at the start.
            episode_start: (n,) True where an episode begins, which resets that memory.
            deterministic: take the best action instead of drawing one.

        Returns:
            Actions (4,) or (n, 4) in m, m, m, rad, and the new state.
        """
        ...
