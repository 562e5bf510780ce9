"""The algorithms that can be trained: what recipes, checkpoints and agents' files must know about each of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from sb3_contrib import TQC
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm


@dataclass(frozen=True, kw_only=True)
class Algorithm:
    """One class of Stable-Baselines3 and how its models are built and taken apart.

    Attributes:
        model: the class.
        mean: from its policy to the modules, in order, whose output is the mean action before squashing.
        output: what squashes it: "tanh", or "linear" for nothing.
        log_interval: updates, or for off-policy algorithms episodes, between two points in TensorBoard.
    """

    model: type[BaseAlgorithm]
    mean: Callable[[Any], Sequence[torch.nn.Module]]
    output: str
    log_interval: int


def _ppo_mean(policy: Any) -> Sequence[torch.nn.Module]:
    return [*policy.mlp_extractor.policy_net, policy.action_net]


def _gaussian_mean(policy: Any) -> Sequence[torch.nn.Module]:
    return [*policy.actor.latent_pi, policy.actor.mu]


def _td3_mean(policy: Any) -> Sequence[torch.nn.Module]:
    return [*policy.actor.mu][:-1]  # the last module is its tanh


_PPO = Algorithm(model=PPO, mean=_ppo_mean, output="linear", log_interval=1)
_SAC = Algorithm(model=SAC, mean=_gaussian_mean, output="tanh", log_interval=1000)
_TD3 = Algorithm(model=TD3, mean=_td3_mean, output="tanh", log_interval=1000)
_TQC = Algorithm(model=TQC, mean=_gaussian_mean, output="tanh", log_interval=1000)

# by the name of the recipe, agents/hyperparameters/<name>.yml
ALGORITHMS = {"ppo": _PPO, "ppo_shielded": _PPO, "sac": _SAC, "td3": _TD3, "tqc": _TQC}


def algorithm_of(model: BaseAlgorithm) -> Algorithm:
    """Return the entry of a model's class; raises ValueError for a class that has none."""
    for algorithm in ALGORITHMS.values():
        if type(model) is algorithm.model:
            return algorithm
    known = sorted({algorithm.model.__name__ for algorithm in ALGORITHMS.values()})
    raise ValueError(f"model must be one of {', '.join(known)}, got {type(model).__name__}")
