"""The task as Gymnasium environments: observation, reward, outcome, and the classes that adapt shapes."""

from hydrone_gym.envs.hydrone_env import HydroneEnv

__all__ = ["HydroneEnv"]
