"""From a Stable-Baselines3 model to the files of an agent."""

from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm

from agents.agent_file import AgentFile
from agents.algorithms import algorithm_of
from agents.network import Network

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
    algorithm = algorithm_of(model)
    layers = algorithm.mean(model.policy)
    linear = [layer for layer in layers if isinstance(layer, torch.nn.Linear)]
    between = {_ACTIVATIONS.get(type(layer)) for layer in layers if not isinstance(layer, torch.nn.Linear)}
    if len(between) != 1 or None in between or len(layers) != 2 * len(linear) - 1:
        raise ValueError("only multilayer perceptrons with one kind of activation, tanh or relu, can be exported")
    network = Network(
        weights=tuple(np.ascontiguousarray(layer.weight.detach().cpu().numpy().T) for layer in linear),
        biases=tuple(layer.bias.detach().cpu().numpy().copy() for layer in linear),
        activation=str(between.pop()),
        output=algorithm.output,
    )
    kind = type(model).__name__
    return AgentFile(name=name, algorithm=kind, environment=environment, network=network, notes=notes or {})
