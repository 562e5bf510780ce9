"""Recipes: hyper-parameters as documented data, one YAML file an algorithm in the format of rl-baselines3-zoo."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.utils import LinearSchedule

from agents.agent import ACTIONS
from agents.agent_file import read_yaml

FOLDER = Path(__file__).parent / "hyperparameters"
ENV_ID = "HydroneGym/Mission-v0"
LINEAR = "lin_"  # prefix of a value, "lin_5e-4", that falls linearly to zero over the training


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """How to train."""

    algorithm: str  # name of the file, "ppo"
    steps: int  # transitions to learn from
    missions: dict[str, int]  # rows an environment id, in order
    policy: str  # name of the policy class of Stable-Baselines3
    settings: dict[str, Any]  # the other arguments of the algorithm, as written in the file
    shield: bool = False  # whether the rows fly behind the shield
    # keyword options of the environments that the rows fly in, where the defaults are not meant
    environment: dict[str, Any] = field(default_factory=dict)

    def arguments(self) -> dict[str, Any]:
        """Return the settings as the algorithm takes them: schedules and noise made of their names, and completed.

        What they leave open: rectifiers between layers, cheaper than PPO's tanh; more episodes remembered.
        """
        arguments = {"stats_window_size": 1000, **self.settings}
        arguments["policy_kwargs"] = {"activation_fn": torch.nn.ReLU, **arguments.get("policy_kwargs", {})}
        for name, value in arguments.items():
            if isinstance(value, str) and value.startswith(LINEAR):
                arguments[name] = LinearSchedule(float(value.removeprefix(LINEAR)), 0.0, 1.0)
        kind, deviation = arguments.pop("noise_type", None), arguments.pop("noise_std", 0.0)
        if kind is not None:
            arguments["action_noise"] = NormalActionNoise(np.zeros(ACTIONS), np.full(ACTIONS, deviation))
        return arguments


def load_recipe(algorithm: str = "ppo", path: Path | None = None) -> Recipe:
    """Read the recipe of an algorithm, from the package or from a file of the user.

    Raises ValueError for an unknown algorithm, or for a file that is no recipe, naming it and what is wrong.
    """
    known = sorted(file.stem for file in FOLDER.glob("*.yml"))
    if algorithm not in known:
        raise ValueError(f"algorithm must be one of {', '.join(map(repr, known))}, got {algorithm!r}")
    file = FOLDER / f"{algorithm}.yml" if path is None else path
    content = read_yaml(file)
    if not isinstance(content, dict) or not isinstance(content.get(ENV_ID), dict):
        raise ValueError(f"{file}: needs an entry {ENV_ID!r} with the hyper-parameters")
    settings = dict(content[ENV_ID])
    missing = [name for name in ("n_envs", "n_timesteps", "policy") if name not in settings]
    if missing:
        raise ValueError(f"{file}: {ENV_ID} lacks {', '.join(missing)}")
    count, steps, policy = settings.pop("n_envs"), settings.pop("n_timesteps"), settings.pop("policy")
    kwargs, noise = settings.get("policy_kwargs", {}), settings.get("noise_type")
    missions, environment = content.get("missions", {ENV_ID: count}), content.get("environment", {})
    rows = sum(missions.values()) if isinstance(missions, dict) else None
    for fits, rule, got in (
        (isinstance(kwargs, dict), "policy_kwargs must be a mapping, code is not run", kwargs),
        (noise in (None, "normal"), "noise_type must be 'normal'", noise),
        (rows == count, f"the rows of missions must sum to n_envs = {count}", missions),
        (isinstance(environment, dict), "environment must be a mapping of keyword options", environment),
    ):
        if not fits:
            raise ValueError(f"{file}: {rule}, got {got!r}")
    return Recipe(
        algorithm=algorithm,
        steps=int(steps),
        missions=missions,
        policy=policy,
        settings=settings,
        shield=bool(content.get("shield", False)),
        environment=environment,
    )
