"""The native vector environment as a Stable-Baselines3 `VecEnv`: rows of one mission or of several, shielded or not."""

import time
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices, VecEnvObs, VecEnvStepReturn

from hydrone_gym.envs.reward import SCALE, TIME
from hydrone_gym.envs.vector_env import HydroneVectorEnv
from hydrone_gym.perception.perceived import Perceived
from planners.shield import Shield

INTERVENTION = SCALE * TIME  # reward of a period in which the shield flew another reference: as if it were lost


class ShieldFilter:
    """Lets references through that the shield lets pass, for rows of one environment.

    `choice` (n,) tells what it did in the last period, as in `planners.shield.ShieldState`.
    """

    def __init__(self, env: HydroneVectorEnv) -> None:
        """Shield the rows of an environment."""
        self._shield = Shield.for_env(None, env)
        self._held = np.zeros((env.num_envs, 4))
        self.choice = np.zeros(env.num_envs, np.int64)
        env.filter_references(self)

    def __call__(
        self, perceived: Perceived, references: NDArray[np.float64], starting: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Return the references (n, 4) to fly; rows that begin rest, so where they are is the verified hover."""
        held = np.where(starting[:, None], perceived.reference, self._held)
        sent, self._held, self.choice = self._shield.check(perceived.observation(), references, held)
        return sent


class MissionMix(VecEnv):
    """Rows of several missions, one mission after the other: one model learns all at once.

    Rows are reset at once when their episode ends, as Stable-Baselines3 expects. The info of an ended row holds
    `terminal_observation`, `TimeLimit.truncated`, `is_success`, `outcome` (an int), `time` (s), `energy` (J),
    `clearance` (m) and `episode` (return `r`, steps `l`, seconds `t` since the environment was made), so that no
    `VecMonitor` is needed; the other infos are empty.

    Args:
        missions: rows an environment id.
        options: keywords of `HydroneVectorEnv` but `autoreset_mode`, the same for all; `interface` is "egocentric",
            for learners, unless given. `weather` may be a list: the rows of each mission share its entries, as evenly
            as they can.
        shield: whether they fly behind the shield; `INTERVENTION` is then added to the reward where it intervenes.

    Raises:
        TypeError, ValueError: no missions at all, an id of another project, an option that is refused, or a mission
            with fewer rows than there are kinds of weather.
    """

    def __init__(
        self, missions: Mapping[str, int], options: Mapping[str, Any] | None = None, *, shield: bool = False
    ) -> None:
        """Make the vector environments."""
        if not missions:
            raise ValueError("missions must name at least one environment")
        self.parts = [part for env_id, rows in missions.items() for part in _parts(env_id, rows, options or {})]
        self.shields = [ShieldFilter(part) for part in self.parts] if shield else []
        *self._firsts, count = np.cumsum([0, *(part.num_envs for part in self.parts)]).tolist()  # first row of each
        super().__init__(count, self.parts[0].single_observation_space, self.parts[0].single_action_space)
        self._returns, self._lengths = np.zeros(count), np.zeros(count, np.int64)
        self._made_at = time.perf_counter()

    def reset(self) -> VecEnvObs:
        """Begin an episode in every row; seeds given by `seed` are used once."""
        observations = []
        for part, first in zip(self.parts, self._firsts):
            rows = slice(first, first + part.num_envs)
            seeds = None if all(seed is None for seed in self._seeds[rows]) else self._seeds[rows]
            options = next((option for option in self._options[rows] if option), None)
            observations.append(part.reset(seed=seeds, options=options)[0])
        self._reset_seeds()
        self._reset_options()
        self._returns[:], self._lengths[:] = 0.0, 0
        return _joined(observations)

    def step_async(self, actions: np.ndarray) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Fly one period in every row."""
        steps = [part.step(sent) for part, sent in zip(self.parts, np.split(self._actions, self._firsts[1:]))]
        observations, rewards, terminated, truncated, told = zip(*steps)
        earned, done = np.concatenate(rewards), np.concatenate(terminated) | np.concatenate(truncated)
        self._returns += earned
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for part, first, cut, info in zip(self.parts, self._firsts, truncated, told):
            for k in np.flatnonzero(done[first : first + part.num_envs]).tolist():
                infos[first + k] = self._ended(first + k, k, info) | {"TimeLimit.truncated": bool(cut[k])}
        self._returns[done], self._lengths[done] = 0.0, 0
        earned = earned.astype(np.float32)
        if self.shields:
            intervened = np.concatenate([shield.choice for shield in self.shields]) != 0
            earned += np.where(intervened, INTERVENTION, 0.0).astype(np.float32)
        return _joined(observations), earned, done, infos

    def _ended(self, row: int, k: int, info: dict[str, Any]) -> dict[str, Any]:
        """Return the info of a row whose episode ended, the k-th of its part."""
        last, elapsed = info["final_info"], time.perf_counter() - self._made_at
        return {
            "terminal_observation": info["final_obs"][k],
            "is_success": bool(last["is_success"][k]),
            "outcome": int(last["outcome"][k]),
            **{key: float(last[key][k]) for key in ("time", "energy", "clearance")},
            "episode": {"r": float(self._returns[row]), "l": int(self._lengths[row]), "t": elapsed},
        }

    def close(self) -> None:
        """Close the environments."""
        for part in self.parts:
            part.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of the vector environments, once a row: rows share it."""
        return self._each_row((getattr(part, attr_name) for part in self.parts), indices)

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Refuse: rows share their options, which are fixed when the environment is made."""
        raise AttributeError(f"{attr_name} cannot be set: the options of HydroneVecEnv are fixed when it is made")

    def env_method(self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any) -> list[Any]:
        """Call a method of each vector environment once and return its value for each row asked for."""
        return self._each_row((getattr(part, method_name)(*args, **kwargs) for part in self.parts), indices)

    def _each_row(self, values: Iterable[Any], indices: VecEnvIndices) -> list[Any]:
        rows = [value for part, value in zip(self.parts, values) for _ in range(part.num_envs)]
        return [rows[row] for row in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type, indices: VecEnvIndices = None) -> list[bool]:
        """Rows are not wrapped one by one."""
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[np.ndarray | None]:
        """Return a picture of each row, None without `render_mode="rgb_array"`."""
        pictures: Any = [part.render() or [None] * part.num_envs for part in self.parts]
        return [picture for part in pictures for picture in part]


class HydroneVecEnv(MissionMix):
    """Many rows of one mission: `PPO("MlpPolicy", HydroneVecEnv("HydroneGym/Mission-v0", 256))` trains.

    Arguments are an id of this project, the number of rows, and what `MissionMix` takes. `env` is what flies.
    """

    def __init__(self, env_id: str, num_envs: int = 256, *, shield: bool = False, **options: Any) -> None:
        """Make the vector environment; raises TypeError or ValueError for an option it refuses."""
        super().__init__({env_id: num_envs}, options, shield=shield)
        self.env = self.parts[0]


def _parts(env_id: str, rows: int, options: Mapping[str, Any]) -> list[HydroneVectorEnv]:
    """Make the vector environments of a mission, one for each kind of weather."""
    several = options.get("weather")
    if not isinstance(several, list):
        return [_made(env_id, rows, options)]
    if not 1 <= len(several) <= rows:
        raise ValueError(f"weather lists {len(several)} kinds for {rows} rows of {env_id}: each kind needs a row")
    shares = np.diff(np.linspace(0, rows, len(several) + 1).astype(int)).tolist()
    return [_made(env_id, share, {**options, "weather": each}) for share, each in zip(shares, several, strict=True)]


def _made(env_id: str, rows: int, options: Mapping[str, Any]) -> HydroneVectorEnv:
    """Make one vector environment."""
    told = {"interface": "egocentric", **options}
    made = gym.make_vec(env_id, rows, "vector_entry_point", autoreset_mode=AutoresetMode.SAME_STEP, **told)
    if not isinstance(made, HydroneVectorEnv):
        raise TypeError(f"env_id must name a HyDrone environment, got {env_id!r}")
    return made


def _joined(observations: Sequence[Any]) -> Any:
    """Put the observations of parts together, one after the other."""
    if isinstance(observations[0], dict):
        return {key: np.concatenate([seen[key] for seen in observations]) for key in observations[0]}
    return np.concatenate(observations)
