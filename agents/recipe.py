"""Recipes: hyper-parameters as documented data, one YAML file an algorithm in the format of rl-baselines3-zoo."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.utils import LinearSchedule

from agents.agent import ACTIONS
from agents.algorithms import ALGORITHMS
from agents.plain_data import read_yaml
from agents.recipe_rules import LINEAR, check_entries

FOLDER = Path(__file__).parent / "hyperparameters"
ENV_ID = "HydroneGym/Mission-v0"


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """How to train."""

    algorithm: str  # name of the file, "ppo"
    steps: int  # transitions to learn from
    missions: dict[str, int]  # rows an environment id, in order
    policy: str  # name of the policy class of Stable-Baselines3
    settings: dict[str, Any]  # the other arguments of the algorithm, as written in the file
    shield: bool = False  # whether the rows fly behind the shield
    # keyword options of the environments that the rows fly in, where the defaults are not meant; `weather` may be a
    # list that rows share, see `MissionMix`
    environment: dict[str, Any] = field(default_factory=dict)
    evaluation: dict[str, Any] = field(default_factory=dict)  # the same of the held-out worlds at the end

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

    Raises ValueError for an unknown algorithm, or for a file that is no recipe, naming it, the key and its rule.
    """
    known = sorted(file.stem for file in FOLDER.glob("*.yml"))
    if algorithm not in known:
        raise ValueError(f"algorithm must be one of {', '.join(map(repr, known))}, got {algorithm!r}")
    file = FOLDER / f"{algorithm}.yml" if path is None else path
    content = read_yaml(file)
    if not isinstance(content, dict) or not isinstance(content.get(ENV_ID), dict):
        raise ValueError(f"{file}: needs an entry {ENV_ID!r} with the hyper-parameters")
    check_entries(file, content, ENV_ID, ALGORITHMS[algorithm])
    settings = dict(content[ENV_ID])
    count, steps, policy = settings.pop("n_envs"), int(settings.pop("n_timesteps")), settings.pop("policy")
    return Recipe(
        algorithm=algorithm,
        steps=steps,
        missions=content.get("missions", {ENV_ID: count}),
        policy=policy,
        settings=settings,
        shield=content.get("shield", False),
        environment=content.get("environment", {}),
        evaluation=content.get("evaluation", {}),
    )
