"""What `hydrone fly` and `hydrone replay` fly: the options that say it, and the environments and policies asked for."""

import functools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import gymnasium as gym
import numpy as np

from hydrone_gym.cli import check_obstacles
from hydrone_gym.evaluation.policies import Policy, PolicySource, did_you_mean, find_policy, load_factory
from hydrone_gym.world.scenario import Scenario, load_scenario

# The paper's two experiments first.
MISSIONS = {
    "air-to-water": "HydroneGym/AirToWater-v0",
    "water-to-air": "HydroneGym/WaterToAir-v0",
    "random": "HydroneGym/Mission-v0",
}
MOST_ITERATIONS = 1_000_000  # of an option; more take minutes a cycle
EXPERIMENTS = ("air-to-water", "water-to-air")


class Prepared(NamedTuple):
    """One flight about to begin: where, with what, and what the files and the column of the table are called."""

    name: str
    title: str  # name, policy and seed
    env: gym.Env
    policy: Policy
    scenario: Scenario
    observation: dict[str, np.ndarray]  # the first


@dataclass(frozen=True, kw_only=True)
class MissionOptions:
    """What is flown."""

    mission: str | None = None
    """air-to-water or water-to-air, the paper's experiments 1 and 2, or random; both experiments unless given."""
    seed: int = 0  # Seed of the random world and of the planner.
    obstacles: int | None = None  # Number of spheres, 20 unless given.
    policy: str = "clrrt"
    """Registered name such as clrrt or straight-line; module:attribute, file.py:attribute, or an agent's folder."""
    iterations: int | None = None  # Samples the CL-RRT draws each cycle, the planner's own number unless given.
    time_budget: float | None = None
    """Seconds a CL-RRT cycle may take, instead of a number of samples; not reproducible."""
    scenario: Path | None = None  # Fly this scenario file instead.
    vehicle: Literal["paper", "physical", "hydrone-2021", "hydrone-agile"] = "paper"  # Parameter set of the vehicle.
    weather: int = 0  # Level of wind, current, waves and of a vehicle that is not the nominal one, 0 to 5.

    def prepare(self) -> list[Prepared]:
        """Check the options and set up what they ask for; raises ValueError or OSError."""
        if self.seed < 0:
            raise ValueError(f"--seed must not be negative, got {self.seed}")
        check_obstacles(self.obstacles)
        source, scenario, count = self._source(), None, 20 if self.obstacles is None else self.obstacles
        flights = {name: MISSIONS[name] for name in self._missions()}
        if self.scenario is not None:
            if self.mission is not None or self.obstacles is not None:
                raise ValueError("--scenario excludes --mission and --obstacles")
            scenario = load_scenario(self.scenario)
            count, flights = len(scenario.obstacles), {self.scenario.stem: MISSIONS["random"]}
        prepared = []
        for name, env_id in flights.items():
            env = gym.make(env_id, num_obstacles=count, vehicle=self.vehicle, weather=self.weather)
            observation, _ = env.reset(seed=self.seed, options=None if scenario is None else {"scenario": scenario})
            policy, drawn = source.make(env, self.seed), env.get_wrapper_attr("scenario")
            prepared.append(Prepared(name, title_of(name, self.policy, self.seed), env, policy, drawn, observation))
        return prepared

    def _missions(self) -> tuple[str, ...]:
        """Return the names of the missions to fly, which may also be given as ids of their environments."""
        if self.mission is None:
            return EXPERIMENTS
        names = [name for name, env_id in MISSIONS.items() if self.mission in (name, env_id)]
        if not names:
            meant = did_you_mean(self.mission, MISSIONS)
            raise ValueError(f"no mission {self.mission!r}{meant}: known are {', '.join(MISSIONS)}")
        return tuple(names)

    def _source(self) -> PolicySource:
        """Find the policy, with the options that belong to the CL-RRT alone."""
        given: dict[str, Any] = {"iterations": self.iterations, "time_budget": self.time_budget}
        given = {name: value for name, value in given.items() if value is not None}
        if len(given) == 2:
            raise ValueError("--iterations and --time-budget exclude each other")
        if given and self.policy != "clrrt":
            raise ValueError("--iterations and --time-budget are options of --policy clrrt")
        if self.iterations is not None and self.iterations > MOST_ITERATIONS:
            raise ValueError(f"--iterations must be at most {MOST_ITERATIONS}, got {self.iterations}")
        source = find_policy(self.policy)
        if given and isinstance(source.factory, str):
            source = replace(source, factory=functools.partial(load_factory(source.factory), **given))
        return source


def title_of(name: str, policy: str, seed: int) -> str:
    """Return what a flight is called in titles."""
    return f"{name[:1].upper()}{name[1:].replace('-', ' ')}, {policy}, seed {seed}"
