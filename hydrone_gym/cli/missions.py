"""What subcommands fly: the options that say it, and the environments and policies they ask for."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import gymnasium as gym
import numpy as np

from hydrone_gym.cli.compiling import announce_compiling, kernels_of
from hydrone_gym.evaluation.policies import find_policy
from hydrone_gym.evaluation.policy import Policy
from hydrone_gym.world.scenario import Scenario, load_scenario
from planners import CLRRT

EXPERIMENTS = {1: "HydroneGym/AirToWater-v0", 2: "HydroneGym/WaterToAir-v0"}


@dataclass(frozen=True)
class Mission:
    """One thing to fly: where, with what, and what the files and the column of the table are called."""

    name: str
    env: gym.Env
    policy: Policy
    scenario: Scenario
    observation: dict[str, np.ndarray]  # the first


@dataclass(frozen=True, kw_only=True)
class MissionOptions:
    """What is flown."""

    experiment: Literal[1, 2] | None = None
    """1: air to water, 2: water to air; both unless given."""
    seed: int = 0
    """Seed of the random world and of the planner."""
    obstacles: int | None = None
    """Number of spheres, 20 unless given."""
    policy: str = "clrrt"
    """Registered name such as clrrt or straight-line; module:attribute, file.py:attribute, or an agent's folder."""
    iterations: int | None = None
    """Samples the CL-RRT draws each cycle, the planner's own number unless given."""
    time_budget: float | None = None
    """Seconds a CL-RRT cycle may take, instead of a number of samples; not reproducible."""
    scenario: Path | None = None
    """Fly this scenario file instead of an experiment."""
    vehicle: Literal["paper", "physical"] = "paper"
    """Parameter set of the vehicle."""

    def missions(self) -> list[Mission]:
        """Check the options and set up what they ask for; raises ValueError or OSError."""
        if self.seed < 0:
            raise ValueError(f"--seed must not be negative, got {self.seed}")
        if self.iterations is not None and self.time_budget is not None:
            raise ValueError("--iterations and --time-budget exclude each other")
        if self.policy != "clrrt" and (self.iterations is not None or self.time_budget is not None):
            raise ValueError("--iterations and --time-budget are options of --policy clrrt")
        source = find_policy(self.policy)
        if self.scenario is None:
            announce_compiling(*kernels_of(source))
            numbers = tuple(EXPERIMENTS) if self.experiment is None else (self.experiment,)
            count = 20 if self.obstacles is None else self.obstacles
            return [self._mission(f"experiment-{number}", EXPERIMENTS[number], count, None) for number in numbers]
        if self.experiment is not None or self.obstacles is not None:
            raise ValueError("--scenario excludes --experiment and --obstacles")
        scenario = load_scenario(self.scenario)
        announce_compiling(*kernels_of(source))
        return [self._mission(self.scenario.stem, "HydroneGym/Mission-v0", len(scenario.obstacles), scenario)]

    def _mission(self, name: str, env_id: str, obstacles: int, scenario: Scenario | None) -> Mission:
        """Make environment and policy; without a scenario the seed draws one."""
        env = gym.make(env_id, num_obstacles=obstacles, vehicle=self.vehicle)
        observation, _ = env.reset(seed=self.seed, options=None if scenario is None else {"scenario": scenario})
        return Mission(name, env, self._policy(env), env.get_wrapper_attr("scenario"), observation)

    def _policy(self, env: gym.Env) -> Policy:
        if self.time_budget is not None:
            return CLRRT.for_env(env, time_budget=self.time_budget, seed=self.seed)
        if self.iterations is not None:
            return CLRRT.for_env(env, iterations=self.iterations, seed=self.seed)
        return find_policy(self.policy).make(env, self.seed)
