"""What `hydrone fly` and `hydrone replay` fly: the options that say it, and the environments and policies asked for."""

import functools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import gymnasium as gym
import numpy as np

from hydrone_gym.cli import check_obstacles
from hydrone_gym.evaluation.policies import Policy, PolicySource, find_policy, load_factory
from hydrone_gym.world.scenario import Scenario, load_scenario

EXPERIMENTS = {1: "HydroneGym/AirToWater-v0", 2: "HydroneGym/WaterToAir-v0"}


class Prepared(NamedTuple):
    """One flight about to begin: where, with what, and what the files and the column of the table are called."""

    name: str
    env: gym.Env
    policy: Policy
    scenario: Scenario
    observation: dict[str, np.ndarray]  # the first


@dataclass(frozen=True, kw_only=True)
class MissionOptions:
    """What is flown."""

    experiment: Literal[1, 2] | None = None  # 1: air to water, 2: water to air; both unless given.
    seed: int = 0  # Seed of the random world and of the planner.
    obstacles: int | None = None  # Number of spheres, 20 unless given.
    policy: str = "clrrt"
    """Registered name such as clrrt or straight-line; module:attribute, file.py:attribute, or an agent's folder."""
    iterations: int | None = None  # Samples the CL-RRT draws each cycle, the planner's own number unless given.
    time_budget: float | None = None
    """Seconds a CL-RRT cycle may take, instead of a number of samples; not reproducible."""
    scenario: Path | None = None  # Fly this scenario file instead of an experiment.
    vehicle: Literal["paper", "physical"] = "paper"  # Parameter set of the vehicle.

    def prepare(self) -> list[Prepared]:
        """Check the options and set up what they ask for; raises ValueError or OSError."""
        if self.seed < 0:
            raise ValueError(f"--seed must not be negative, got {self.seed}")
        check_obstacles(self.obstacles)
        source, scenario, count = self._source(), None, 20 if self.obstacles is None else self.obstacles
        numbers = tuple(EXPERIMENTS) if self.experiment is None else (self.experiment,)
        flights = {f"experiment-{number}": EXPERIMENTS[number] for number in numbers}
        if self.scenario is not None:
            if self.experiment is not None or self.obstacles is not None:
                raise ValueError("--scenario excludes --experiment and --obstacles")
            scenario = load_scenario(self.scenario)
            count, flights = len(scenario.obstacles), {self.scenario.stem: "HydroneGym/Mission-v0"}
        prepared = []
        for name, env_id in flights.items():
            env = gym.make(env_id, num_obstacles=count, vehicle=self.vehicle)
            observation, _ = env.reset(seed=self.seed, options=None if scenario is None else {"scenario": scenario})
            policy, drawn = source.make(env, self.seed), env.get_wrapper_attr("scenario")
            prepared.append(Prepared(name, env, policy, drawn, observation))
        return prepared

    def _source(self) -> PolicySource:
        """Find the policy, with the options that belong to the CL-RRT alone."""
        given: dict[str, Any] = {"iterations": self.iterations, "time_budget": self.time_budget}
        given = {name: value for name, value in given.items() if value is not None}
        if len(given) == 2:
            raise ValueError("--iterations and --time-budget exclude each other")
        if given and self.policy != "clrrt":
            raise ValueError("--iterations and --time-budget are options of --policy clrrt")
        source = find_policy(self.policy)
        if given and isinstance(source.factory, str):
            source = replace(source, factory=functools.partial(load_factory(source.factory), **given))
        return source
