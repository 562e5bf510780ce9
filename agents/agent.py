"""Trained agents as policies on the raw interface: `load_agent("ppo")` flies what a planner flies."""

import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from agents.agent_file import TEXT, AgentFile, read_agent
from hydrone_gym.perception.egocentric import OBSERVATION_SIZE, Egocentric, EgocentricMemory, RawObservation
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.world.world import World

PRETRAINED = Path(__file__).parent / "pretrained"
ACTIONS = 3


class Agent:
    """A trained network behind Stable-Baselines3's `predict`, on raw observations and references.

    The egocentric observation and the relative action are made inside; what that needs from one period to the next
    travels in the state. Actions are those of the trained model's mean, and do not depend on the size of the batch.
    `file` has the network, `model` the vehicle and the world it believes in, the default ones unless given.

    Raises ValueError for a network with other inputs or outputs than the egocentric interface has.
    """

    def __init__(self, file: AgentFile, model: Any = None) -> None:
        """Check that the network fits the interface."""
        sizes = file.network.sizes
        if (sizes[0], sizes[-1]) != (OBSERVATION_SIZE, ACTIONS):
            raise ValueError(
                f"agent {file.name!r} has {sizes[0]} inputs and {sizes[-1]} outputs; "
                f"the egocentric interface has {OBSERVATION_SIZE} and {ACTIONS}"
            )
        self.file = file
        self._egocentric = Egocentric(SimpleNamespace(vehicle=HYDRONE, world=World()) if model is None else model)

    def predict(
        self,
        observation: RawObservation,
        state: EgocentricMemory | None = None,
        episode_start: ArrayLike | None = None,
        deterministic: bool = True,
    ) -> tuple[NDArray[np.float32], EgocentricMemory]:
        """Return references for one observation or a batch, in Stable-Baselines3's form.

        Args:
            observation: Dict observation of `interface="world"`, single or batched along the first axis.
            state: what the last call returned, None at the start.
            episode_start: (n,) True where an episode begins: that memory is dropped.
            deterministic: agents always are; accepted for the interface's sake.

        Returns:
            Actions, (4,) or (n, 4) float32 (m, m, m, rad), and the new state.

        Raises:
            ValueError: an observation of another interface, or arrays of the wrong shape.
        """
        if episode_start is not None and "state" in observation and np.ndim(observation["state"]) == 1:
            episode_start = np.reshape(episode_start, ())
        seen, memory = self._egocentric.observe(observation, state, episode_start)
        action = self.relative_action(np.atleast_2d(seen)).reshape((*seen.shape[:-1], ACTIONS))
        return self._egocentric.reference(action, observation, memory), memory

    def relative_action(self, seen: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the relative actions (n, 3) in [-1, 1] for egocentric observations (n, 68), both float32."""
        return np.clip(self.file.network(seen), -1.0, 1.0)


def load_agent(name_or_path: str | os.PathLike[str], env: Any = None) -> Agent:
    """Load a shipped agent by its name, or one of your own by the path of its folder.

    Nothing is unpickled: the network is built from a YAML text and plain tensors, whose SHA-256 is checked.

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
    if env is None:
        return Agent(read_agent(folder))
    from planners.belief import belief_of

    return Agent(read_agent(folder), belief_of(env))


def shipped_agents() -> list[str]:
    """Return the names of the agents in the package."""
    return sorted(text.parent.name for text in PRETRAINED.glob(f"*/{TEXT}"))
