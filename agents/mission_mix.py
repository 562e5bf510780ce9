"""Several vector environments side by side as one `VecEnv`: one model learns all missions at once."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices, VecEnvObs, VecEnvStepReturn

from agents.shielded import ShieldedVecEnv
from agents.vec_env import HydroneVecEnv


class MissionMix(VecEnv):
    """The rows of several `HydroneVecEnv`, one part after the other.

    Args:
        missions: rows an environment id.
        options: keyword options of the environments, the same for all.
        shield: whether they fly behind the shield.

    Raises:
        ValueError: no missions at all; TypeError or ValueError for what an environment refuses.
    """

    def __init__(
        self, missions: Mapping[str, int], options: Mapping[str, Any] | None = None, *, shield: bool = False
    ) -> None:
        """Make the parts."""
        if not missions:
            raise ValueError("missions must name at least one environment")
        kind = ShieldedVecEnv if shield else HydroneVecEnv
        self.parts = [kind(env_id, rows, **(options or {})) for env_id, rows in missions.items()]
        self._edges = np.cumsum([0, *missions.values()]).tolist()
        first = self.parts[0]
        super().__init__(self._edges[-1], first.observation_space, first.action_space)

    def _slices(self) -> list[slice]:
        return [slice(first, last) for first, last in zip(self._edges[:-1], self._edges[1:])]

    def reset(self) -> VecEnvObs:
        """Begin an episode in every row; seeds given by `seed` are used once."""
        pairs = zip(self.parts, self._slices())
        observations: list[Any] = [part.begin(self._seeds[rows], self._options[rows]) for part, rows in pairs]
        self.reset_infos = [info for part in self.parts for info in part.reset_infos]
        self._reset_seeds()
        self._reset_options()
        return np.concatenate(observations)

    def step_async(self, actions: np.ndarray) -> None:
        """Hand every part its actions."""
        for part, rows in zip(self.parts, self._slices()):
            part.step_async(actions[rows])

    def step_wait(self) -> VecEnvStepReturn:
        """Fly one period in every row."""
        observations, rewards, done, infos = zip(*(part.step_wait() for part in self.parts))
        together = [info for part in infos for info in part]
        return np.concatenate(observations), np.concatenate(rewards), np.concatenate(done), together

    def close(self) -> None:
        """Close the parts."""
        for part in self.parts:
            part.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of the parts' environments, once a row."""
        values = [value for part in self.parts for value in part.get_attr(attr_name)]
        return [values[row] for row in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Refuse, as the parts do."""
        self.parts[0].set_attr(attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any) -> list[Any]:
        """Call a method of each part's environment once and return its value for each row asked for."""
        values = [value for part in self.parts for value in part.env_method(method_name, *args, **kwargs)]
        return [values[row] for row in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: VecEnvIndices = None) -> list[bool]:
        """Rows are not wrapped one by one."""
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[np.ndarray | None]:
        """No row is drawn."""
        return [None] * self.num_envs
