"""Search for the fastest flights of frozen worlds, known in full, and freeze them beside the suites.

    python -m benchmarks.bounds                                  # paper-20, 100 worlds of both missions
    python -m benchmarks.bounds --vehicle physical --out /tmp    # another vehicle

A world takes about three seconds of one core. Flights are printed as they are found, medians at the end.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import tyro
from joblib import Parallel, delayed

import hydrone_gym  # noqa: F401  (registers the ids)
from hydrone_gym.evaluation.bounds import GRID, Bound, BoundFlight, bounds_path, save_bounds
from hydrone_gym.evaluation.suites import Mission, load_suite
from hydrone_gym.world.scenario import Scenario
from planners.belief import belief_of
from planners.bound import Found, Place, fastest_flights


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """What to search for."""

    suite: str = "paper-20"
    """Name of a frozen suite in still weather."""
    worlds: int = 100
    """The first so many of each mission."""
    vehicle: str = "paper"
    """Name of the vehicle."""
    controller: str = "paper"
    """Name of the control law."""
    effort: int = 1
    """How much longer than usual to search."""
    jobs: int = 1
    """Worlds at once."""
    out: Path | None = None
    """Folder of the file; that of the suites unless given."""


def bound_of(mission: Mission, scenario: Scenario, a: Arguments) -> Bound:
    options: dict[str, Any] = {**mission.options, "vehicle": a.vehicle, "controller": a.controller}
    env = gym.make(mission.env_id, disable_env_checker=True, **options)
    if env.unwrapped.options.weathered:  # type: ignore[attr-defined]
        raise ValueError(f"mission {mission.name} must be in still weather to be searched")
    place = Place(scenario.start, np.array(scenario.goal), scenario.obstacles)
    return Bound(*map(_flight, fastest_flights(belief_of(env), place, grid=GRID, effort=a.effort)))


def _flight(found: Found | None) -> BoundFlight | None:
    return None if found is None else BoundFlight(found.time, found.energy, found.references)


def search(mission: Mission, a: Arguments) -> Iterator[Bound]:
    worlds = (delayed(bound_of)(mission, scenario, a) for scenario in mission.scenarios)
    for world, bound in enumerate(Parallel(n_jobs=a.jobs, return_as="generator")(worlds)):
        told = ("none" if flight is None else f"{flight.time:.2f} s {flight.energy:.0f} J" for flight in bound)
        print(f"{mission.name} {world}: rule kept {', free '.join(told)}", flush=True)
        yield bound


def main(a: Arguments) -> None:
    suite = load_suite(a.suite).first(a.worlds)
    bounds = {mission.name: list(search(mission, a)) for mission in suite.missions}
    path = bounds_path(suite.name, a.vehicle, a.controller)
    save_bounds(path if a.out is None else a.out / path.name, bounds)
    for mission, worlds in bounds.items():
        for name, flights in zip(Bound._fields, zip(*worlds, strict=True), strict=True):
            times, energies = zip(*((f.time, f.energy) for f in flights if f is not None), strict=True)
            medians = f"{np.median(times):.2f} s, {np.median(energies):.0f} J"
            print(f"{mission}, {name}: median {medians}, {len(times)} worlds")


if __name__ == "__main__":
    main(tyro.cli(Arguments, description=__doc__))
