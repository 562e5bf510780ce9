"""The algorithms that can be trained, and how an agent is taken out of a model of theirs."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from sb3_contrib import TQC
from stable_baselines3 import PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm

from agents.agent_file import AgentFile
from agents.network import Network


class Algorithm(NamedTuple):
    """One class of Stable-Baselines3 and how its models are built and taken apart."""

    model: type[BaseAlgorithm]  # the class
    mean: Callable[
        [Any], Sequence[torch.nn.Module]
    ]  # modules of its policy, in order, up to the unsquashed mean action
    output: str  # what squashes it: "tanh", or "linear" for nothing
    log_interval: int  # updates, or for off-policy algorithms episodes, between two points in TensorBoard


_PPO = Algorithm(PPO, lambda policy: [*policy.mlp_extractor.policy_net, policy.action_net], "linear", 1)
_SAC = Algorithm(SAC, lambda policy: [*policy.actor.latent_pi, policy.actor.mu], "tanh", 1000)
_TD3 = _SAC._replace(model=TD3, mean=lambda policy: [*policy.actor.mu][:-1])  # the last module is its tanh

# by the name of the recipe, agents/hyperparameters/<name>.yml
ALGORITHMS = {
    **dict.fromkeys(("ppo", "ppo-shield", "ppo-weather"), _PPO),
    "sac": _SAC,
    "td3": _TD3,
    "tqc": _SAC._replace(model=TQC),
}

_ACTIVATIONS: dict[type, str] = {torch.nn.Tanh: "tanh", torch.nn.ReLU: "relu"}


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
    kind, known = type(model), {algorithm.model: algorithm for algorithm in ALGORITHMS.values()}
    if kind not in known:
        names = sorted(each.__name__ for each in known)
        raise ValueError(f"model must be one of {', '.join(names)}, got {kind.__name__}")
    layers = known[kind].mean(model.policy)
    linear = [layer for layer in layers if isinstance(layer, torch.nn.Linear)]
    between = {_ACTIVATIONS.get(type(layer)) for layer in layers if not isinstance(layer, torch.nn.Linear)}
    if len(between) != 1 or None in between or len(layers) != 2 * len(linear) - 1:
        raise ValueError("only multilayer perceptrons with one kind of activation, tanh or relu, can be exported")
    network = Network(
        weights=tuple(np.ascontiguousarray(layer.weight.detach().cpu().numpy().T) for layer in linear),
        biases=tuple(layer.bias.detach().cpu().numpy().copy() for layer in linear),
        activation=str(between.pop()),
        output=known[kind].output,
    )
    return AgentFile(name=name, algorithm=kind.__name__, environment=environment, network=network, notes=notes or {})
