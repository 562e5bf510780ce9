"""The algorithms that can be trained, and how an agent is taken out of a model of theirs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from sb3_contrib import TQC
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm

from agents.agent_file import AgentFile
from agents.network import Network


@dataclass(frozen=True, kw_only=True)
class Algorithm:
    """One class of Stable-Baselines3 and how its models are built and taken apart."""

    model: type[BaseAlgorithm]  # the class
    # from its policy to the modules, in order, whose output is the mean action before squashing
    mean: Callable[[Any], Sequence[torch.nn.Module]]
    output: str  # what squashes it: "tanh", or "linear" for nothing
    log_interval: int  # updates, or for off-policy algorithms episodes, between two points in TensorBoard


def _ppo_mean(policy: Any) -> Sequence[torch.nn.Module]:
    return [*policy.mlp_extractor.policy_net, policy.action_net]


_PPO = Algorithm(model=PPO, mean=_ppo_mean, output="linear", log_interval=1)
_SAC = Algorithm(model=SAC, mean=lambda p: [*p.actor.latent_pi, p.actor.mu], output="tanh", log_interval=1000)
_TQC = replace(_SAC, model=TQC)
_TD3 = replace(_SAC, model=TD3, mean=lambda policy: [*policy.actor.mu][:-1])  # the last module is its tanh

# by the name of the recipe, agents/hyperparameters/<name>.yml
ALGORITHMS = {"ppo": _PPO, "ppo_shielded": _PPO, "sac": _SAC, "td3": _TD3, "tqc": _TQC}

_ACTIVATIONS: dict[type, str] = {torch.nn.Tanh: "tanh", torch.nn.ReLU: "relu"}


def algorithm_of(model: BaseAlgorithm) -> Algorithm:
    """Return the entry of a model's class; raises ValueError for a class that has none."""
    found = [algorithm for algorithm in ALGORITHMS.values() if type(model) is algorithm.model]
    if found:
        return found[0]
    known = sorted({algorithm.model.__name__ for algorithm in ALGORITHMS.values()})
    raise ValueError(f"model must be one of {', '.join(known)}, got {type(model).__name__}")


def export_agent(model: BaseAlgorithm, name: str, environment: str, notes: dict[str, Any] | None = None) -> AgentFile:
    """Take the mean action's network out of a model trained on the egocentric interface.

    Args:
        model: PPO, SAC, TD3 or TQC with "MlpPolicy".
        name: of the agent.
        environment: id it was trained on.
        notes: further plain data to keep with it.

    Raises:
        ValueError: another algorithm, or a policy that is no plain multilayer perceptron.
    """
    algorithm = algorithm_of(model)
    network = network_of(algorithm.mean(model.policy), algorithm.output)
    kind = type(model).__name__
    return AgentFile(name=name, algorithm=kind, environment=environment, network=network, notes=notes or {})


def network_of(layers: Sequence[torch.nn.Module], output: str = "linear") -> Network:
    """Return the network that some modules in a row are; raises ValueError for what is no multilayer perceptron."""
    linear = [layer for layer in layers if isinstance(layer, torch.nn.Linear)]
    between = {_ACTIVATIONS.get(type(layer)) for layer in layers if not isinstance(layer, torch.nn.Linear)}
    if len(between) != 1 or None in between or len(layers) != 2 * len(linear) - 1:
        raise ValueError("only multilayer perceptrons with one kind of activation, tanh or relu, can be exported")
    return Network(
        weights=tuple(np.ascontiguousarray(layer.weight.detach().cpu().numpy().T) for layer in linear),
        biases=tuple(layer.bias.detach().cpu().numpy().copy() for layer in linear),
        activation=str(between.pop()),
        output=output,
    )
