"""Trained agents as policies on the raw interface: `load_agent("ppo")` flies what a planner flies."""

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.agent_file import TEXT, AgentFile, read_agent
from agents.egocentric_policy import CHOSEN, EgocentricPolicy
from hydrone_gym.perception.egocentric import OBSERVATION_SIZE

PRETRAINED = Path(__file__).parent / "pretrained"
ACTIONS = CHOSEN.shape[0]


class Agent(EgocentricPolicy):
    """The `EgocentricPolicy` of a network in a file; it needs neither torch nor Stable-Baselines3.

    Actions are those of the trained model's mean, and do not depend on the size of the batch. `env` is that of
    `EgocentricPolicy`. Raises ValueError for a network with other inputs or outputs than the egocentric interface has.
    """

    def __init__(self, file: AgentFile, env: Any = None) -> None:
        """Check that the network fits the interface."""
        sizes = file.network.sizes
        if (sizes[0], sizes[-1]) != (OBSERVATION_SIZE, ACTIONS):
            raise ValueError(
                f"agent {file.name!r} has {sizes[0]} inputs and {sizes[-1]} outputs; "
                f"the egocentric interface has {OBSERVATION_SIZE} and {ACTIONS}"
            )
        super().__init__(file.network, env)
        self.file = file

    def relative_action(self, seen: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the relative actions (n, 3) in [-1, 1] for egocentric observations (n, 68), both float32."""
        return np.clip(self.file.network(seen), -1.0, 1.0)


def load_agent(name_or_path: str | os.PathLike[str], env: Any = None) -> Agent:
    """Load a shipped agent by its name, or one of your own by the path of its folder.

    Nothing is unpickled and nothing is larger than it says: the network is built from a short YAML text and plain
    tensors, whose SHA-256 and sizes are checked.

    Args:
        name_or_path: "ppo" or another name of `shipped_agents`, or a folder that training wrote.
        env: environment it is to fly; needed only if that has another vehicle or world than the default.

    Raises:
        FileNotFoundError: neither a shipped agent nor a folder of one; the message lists those there are.
        ValueError: a foreign or damaged file, or one for another environment or version.
        TypeError: an environment of another kind.
    """
    path = Path(name_or_path)
    folder = PRETRAINED / path if str(path) in shipped_agents() else path
    if not folder.exists():
        names = ", ".join(shipped_agents()) or "none"
        raise FileNotFoundError(f"no agent {os.fspath(name_or_path)!r}: shipped are {names}; or give a folder")
    return Agent(read_agent(folder), env)


def shipped_agents() -> list[str]:
    """Return the names of the agents in the package."""
    return sorted(text.parent.name for text in PRETRAINED.glob(f"*/{TEXT}"))
