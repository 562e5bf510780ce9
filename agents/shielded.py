"""Training behind the shield: rows whose references are checked before they are flown."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from agents.vec_env import HydroneVecEnv
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

    def __call__(
        self, perceived: Perceived, references: NDArray[np.float64], starting: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Return the references (n, 4) to fly; rows that begin rest, so where they are is the verified hover."""
        held = np.where(starting[:, None], perceived.reference, self._held)
        sent, self._held, self.choice = self._shield.check(perceived.observation(), references, held)
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
        self.shielded = ShieldFilter(self.env)
        self.env.filter_references(self.shielded)

    def step_wait(self) -> VecEnvStepReturn:
        """Fly one period in every row."""
        observation, rewards, done, infos = super().step_wait()
        penalty = np.where(self.shielded.choice != 0, INTERVENTION, 0.0).astype(np.float32)
        return observation, rewards + penalty, done, infos
