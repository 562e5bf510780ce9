"""The native vector environment as a Stable-Baselines3 `VecEnv`."""

import time
from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices, VecEnvObs, VecEnvStepReturn

from hydrone_gym.envs.vector_env import HydroneVectorEnv


class HydroneVecEnv(VecEnv):
    """Many missions for Stable-Baselines3: `PPO("MlpPolicy", HydroneVecEnv("HydroneGym/Mission-v0", 256))` trains.

    Rows are reset at once when their episode ends, as Stable-Baselines3 expects. The info of an ended row holds
    `terminal_observation`, `TimeLimit.truncated`, `is_success`, `outcome` (an int), `time` (s), `energy` (J),
    `clearance` (m) and `episode` (return `r`, steps `l`, seconds `t` since the environment was made), so that no
    `VecMonitor` is needed; the other infos are empty.

    Args:
        env_id: a registered id of this project.
        num_envs: number of rows.
        interface: "egocentric" for learners, or "world".
        autoreset_mode must not be given; every other keyword of `HydroneVectorEnv` may be.
    """

    def __init__(self, env_id: str, num_envs: int = 256, *, interface: str = "egocentric", **options: Any) -> None:
        """Make the vector environment; raises TypeError or ValueError for an option it refuses."""
        made = gym.make_vec(
            env_id,
            num_envs=num_envs,
            vectorization_mode="vector_entry_point",
            interface=interface,
            autoreset_mode=AutoresetMode.SAME_STEP,
            **options,
        )
        if not isinstance(made, HydroneVectorEnv):
            raise TypeError(f"env_id must name a HyDrone environment, got {env_id!r}")
        self.env = made
        super().__init__(num_envs, made.single_observation_space, made.single_action_space)
        self._actions: NDArray | None = None
        self._returns = np.zeros(num_envs)
        self._lengths = np.zeros(num_envs, np.int64)
        self._made_at = time.perf_counter()

    def reset(self) -> VecEnvObs:
        """Begin an episode in every row; seeds given by `seed` are used once."""
        observation = self.begin(self._seeds, self._options)
        self._reset_seeds()
        self._reset_options()
        return observation

    def begin(self, seeds: Sequence[int | None], options: Sequence[dict[str, Any]]) -> VecEnvObs:
        """Begin an episode in every row, with a seed (None: its stream goes on) and reset options each."""
        given = None if all(seed is None for seed in seeds) else seeds
        chosen = next((option for option in options if option), None)
        observation, _ = self.env.reset(seed=given, options=chosen)
        self.reset_infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        self._returns[:] = 0.0
        self._lengths[:] = 0
        return observation

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Fly one period in every row."""
        observation, rewards, terminated, truncated, info = self.env.step(self._actions)  # type: ignore[arg-type]
        self._returns += rewards
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        done = terminated | truncated
        for row in np.flatnonzero(done):
            infos[row] = self._ended(int(row), bool(truncated[row]), info)
        self._returns[done] = 0.0
        self._lengths[done] = 0
        return observation, rewards.astype(np.float32), done, infos

    def _ended(self, row: int, truncated: bool, info: dict[str, Any]) -> dict[str, Any]:
        """Return the info of a row whose episode ended."""
        last = info["final_info"]
        elapsed = time.perf_counter() - self._made_at
        return {
            "terminal_observation": info["final_obs"][row],
            "TimeLimit.truncated": truncated,
            "is_success": bool(last["is_success"][row]),
            "outcome": int(last["outcome"][row]),
            "time": float(last["time"][row]),
            "energy": float(last["energy"][row]),
            "clearance": float(last["clearance"][row]),
            "episode": {"r": float(self._returns[row]), "l": int(self._lengths[row]), "t": elapsed},
        }

    def close(self) -> None:
        """Close the environment."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of the vector environment, once a row: rows share it."""
        value = getattr(self.env, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Refuse: rows share their options, which are fixed when the environment is made."""
        raise AttributeError(f"{attr_name} cannot be set: the options of HydroneVecEnv are fixed when it is made")

    def env_method(self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any) -> list[Any]:
        """Call a method of the vector environment once and return its value for each row asked for."""
        value = getattr(self.env, method_name)(*args, **kwargs)
        return [value for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: VecEnvIndices = None) -> list[bool]:
        """Rows are not wrapped one by one."""
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[np.ndarray | None]:
        """Return a picture of each row, None without `render_mode="rgb_array"`."""
        pictures: Any = self.env.render()
        return [None] * self.num_envs if pictures is None else list(pictures)
