"""Training behind the shield: rows whose references are checked before they are flown."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from agents.vec_env import HydroneVecEnv
from hydrone_gym.envs.egocentric_rows import EgocentricRows
from hydrone_gym.envs.reward import SCALE, TIME
from hydrone_gym.envs.task import Episodes
from planners.shield import Shield

INTERVENTION = SCALE * TIME  # reward of a period in which the shield flew another reference: as if it were lost


class ShieldedRows(EgocentricRows):
    """Egocentric rows that fly what the shield lets pass.

    `choice` (n,) tells what it did in the last period, as in `planners.shield.ShieldState`.
    """

    def __init__(self, rows: HydroneVecEnv) -> None:
        """Shield the rows of a vector environment."""
        super().__init__(rows.env.options, rows.num_envs)
        self._shield = Shield(None, rows.env.simulation)
        self._held = np.zeros((rows.num_envs, 4))
        self.choice = np.zeros(rows.num_envs, np.int64)

    def begin(self, episodes: Episodes, rows: NDArray[np.intp]) -> None:
        """Look at rows whose episode begins; they rest, so where they are is the verified hover."""
        super().begin(episodes, rows)
        self._held[rows] = episodes.rows["reference"][rows]

    def references(self, actions: ArrayLike, episodes: Episodes) -> NDArray[np.float64]:
        """Return the references (n, 4) that are flown instead of relative actions (n, 3)."""
        proposed = super().references(actions, episodes)
        now = episodes.rows
        observation = {key: now[key] for key in ("state", "integral", "reference", "goal")}
        observation["obstacles"] = episodes.known
        sent, self._held, self.choice = self._shield.check(observation, proposed, self._held)
        return sent


class ShieldedVecEnv(HydroneVecEnv):
    """`HydroneVecEnv` with the shield in the loop; `INTERVENTION` is added to the reward where it intervenes.

    Args:
        env_id: a registered id of this project.
        num_envs: number of rows.
        options: every keyword of `HydroneVecEnv` but `interface`, which is "egocentric".
    """

    def __init__(self, env_id: str, num_envs: int = 256, **options: Any) -> None:
        """Make the environment and put the shield between actions and vehicle."""
        super().__init__(env_id, num_envs, **options)
        self.shielded = ShieldedRows(self)
        self.env.egocentric = self.shielded

    def step_wait(self) -> VecEnvStepReturn:
        """Fly one period in every row."""
        observation, rewards, done, infos = super().step_wait()
        penalty = np.where(self.shielded.choice != 0, INTERVENTION, 0.0).astype(np.float32)
        return observation, rewards + penalty, done, infos
