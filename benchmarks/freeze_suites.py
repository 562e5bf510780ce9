"""Draw the frozen scenario suites of `hydrone_gym.evaluation` and write them as files.

    python -m benchmarks.freeze_suites            # into hydrone_gym/evaluation/suite_data, with each SHA-256
    python -m benchmarks.freeze_suites --out /tmp

A suite that has been released is never written again: a change gets a new version beside it.
"""

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import tyro

from hydrone_gym.evaluation.suites import FOLDER, Mission, Suite, save_suite
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.world.generator import EXPERIMENT_1, EXPERIMENT_2, ScenarioLaw, generate
from hydrone_gym.world.world import World

DENSE = (0.8, 1.8)  # m: radii of the spheres of dense-40
EXPERIMENTS = {"air-to-water": EXPERIMENT_1, "water-to-air": EXPERIMENT_2}
IDS = {"air-to-water": "HydroneGym/AirToWater-v0", "water-to-air": "HydroneGym/WaterToAir-v0"}
MEDIA = ("air", "water")


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """Where to write."""

    out: Path = FOLDER
    """Folder of the files."""


class Recipe(NamedTuple):
    """How a suite is drawn: world k of each mission from seed `seed + k`, clear of training and of held-out worlds."""

    seed: int
    worlds: int
    laws: dict[str, tuple[str, ScenarioLaw]]  # mission: environment id, law


def _experiments(**changes: object) -> dict[str, tuple[str, ScenarioLaw]]:
    return {name: (IDS[name], replace(law, **changes)) for name, law in EXPERIMENTS.items()}


def _random_ends() -> dict[str, tuple[str, ScenarioLaw]]:
    pairs = ((start, goal) for start in MEDIA for goal in MEDIA)
    return {f"{s}-{g}": ("HydroneGym/Mission-v0", ScenarioLaw(media=(s, g), min_separation=8.0)) for s, g in pairs}


def _densities() -> dict[str, tuple[str, ScenarioLaw]]:
    return {
        f"{name}-{count}": entry
        for count in (0, 10, 20, 30, 40)
        for name, entry in _experiments(num_obstacles=count).items()
    }


def _all_missions() -> dict[str, tuple[str, ScenarioLaw]]:
    return {**_experiments(), "random": ("HydroneGym/Mission-v0", ScenarioLaw())}


RECIPES = {
    "paper-20-v1": Recipe(30_000_000, 200, _experiments(num_obstacles=20)),
    "dense-40-v1": Recipe(31_000_000, 200, _experiments(num_obstacles=40, obstacle_radius=DENSE)),
    "missions-v1": Recipe(32_000_000, 100, _random_ends()),
    "density-v1": Recipe(33_000_000, 50, _densities()),
    "weather-v1": Recipe(34_000_000, 200, _all_missions()),
}


def draw(name: str) -> Suite:
    """Draw a suite."""
    recipe, missions, world = RECIPES[name], [], World()
    for mission, (env_id, law) in recipe.laws.items():
        streams = (np.random.default_rng(recipe.seed + k) for k in range(recipe.worlds))
        scenarios = tuple(generate(law, world, HYDRONE.radius, stream) for stream in streams)
        options = {"num_obstacles": law.num_obstacles, "obstacle_radius": list(law.obstacle_radius)}
        missions.append(Mission(name=mission, env_id=env_id, options=options, scenarios=scenarios))
    return Suite(name=name, missions=tuple(missions))


def main(arguments: Arguments) -> None:
    """Write every suite and print its line of `SHA256`."""
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name in RECIPES:
        path = arguments.out / f"{name}.npz"
        save_suite(draw(name), path)
        print(f'    "{name}": "{hashlib.sha256(path.read_bytes()).hexdigest()}",')


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
