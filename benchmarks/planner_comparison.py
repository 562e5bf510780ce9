"""All planners on the same random worlds: a Markdown table, and every flight as a line of CSV.

    python benchmarks/planner_comparison.py
    python benchmarks/planner_comparison.py --worlds 30 --planners CLRRT MPPI --n-jobs 2 --csv flights.csv

Worlds are drawn by the seeds from `first_seed` on, so every planner flies the same ones; the planners' own seed is 0.
With a backend of several processes decision times include what the processes cost each other.
"""

import csv
import itertools
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import gymnasium as gym
import joblib
import numpy as np
import tyro
from tqdm import tqdm

import hydrone_gym  # noqa: F401  registers the environments
from hydrone_gym.evaluation import fly, percentiles, wilson_interval
from hydrone_gym.simulation.outcome import Outcome
from planners.cl_rrt.policy import CLRRT
from planners.mppi import MPPI
from planners.open_loop_rrt import OpenLoopRRT
from planners.potential_field import PotentialField
from planners.published import PublishedCLRRT
from planners.straight_line import StraightLine

PLANNERS: dict[str, Any] = {
    planner.__name__: planner for planner in (StraightLine, PotentialField, OpenLoopRRT, PublishedCLRRT, MPPI, CLRRT)
}
RADII = {20: (0.5, 1.5), 40: (0.8, 1.8)}  # m: least and greatest, for so many spheres
MISSIONS = {"exp1": "HydroneGym/AirToWater-v0", "exp2": "HydroneGym/WaterToAir-v0"}


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What to compare.

    Attributes:
        worlds: worlds for each mission and number of spheres.
        first_seed: seed of the first world.
        planners: which planners.
        missions: which missions.
        spheres: numbers of spheres.
        radius: least and greatest radius of a sphere in m; None for 0.5 to 1.5 with 20 spheres and 0.8 to 1.8 with 40.
        vehicle: parameter set, "paper" or "physical".
        n_jobs: worlds flown at once; 1 measures decision times best.
        backend: of joblib, "loky", "threading" or any registered one.
        csv: where to write the flights.
    """

    worlds: int = 200
    first_seed: int = 2000
    planners: tuple[str, ...] = tuple(PLANNERS)
    missions: tuple[str, ...] = tuple(MISSIONS)
    spheres: tuple[int, ...] = (20, 40)
    radius: tuple[float, float] | None = None
    vehicle: str = "paper"
    n_jobs: int = 1
    backend: str = "loky"
    csv: Path = Path("planner_comparison.csv")


@dataclass(frozen=True, kw_only=True)
class Record:
    """One flight: time in s, energy in J, clearance and length in m, decisions in ms."""

    planner: str
    mission: str
    spheres: int
    seed: int
    outcome: str
    time: float
    energy: float
    clearance: float
    length: float
    decision_p50: float
    decision_p99: float


def fly_one(
    planner: str, mission: str, spheres: int, radius: tuple[float, float], vehicle: str, seed: int
) -> tuple[Record, np.ndarray]:
    """Fly one world; return its record and the decision times (K,) in ms.

    Environment and planner are new, so that threads share nothing; a first decision, thrown away, loads the kernels.
    """
    env = gym.make(MISSIONS[mission], num_obstacles=spheres, obstacle_radius=radius, vehicle=vehicle)
    policy = PLANNERS[planner].for_env(env)
    observation, _ = env.reset(seed=seed)
    policy.predict(observation)
    flight = fly(env, policy, seed=seed)
    p50, p99 = percentiles(flight.decision_ms, (50.0, 99.0))
    record = Record(
        planner=planner,
        mission=mission,
        spheres=spheres,
        seed=seed,
        outcome=flight.outcome.name,
        time=flight.time,
        energy=flight.energy,
        clearance=flight.clearance,
        length=flight.length,
        decision_p50=p50,
        decision_p99=p99,
    )
    return record, flight.decision_ms


HEADER = (
    "| planner | mission | spheres | success | 95 % interval | collisions | rough | out of bounds | timeouts "
    "| time (s) | energy (kJ) | decision p50 / p99 (ms) |\n|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
)


def table_row(records: list[Record], decisions: np.ndarray) -> str:
    """Sum up one planner on one set of worlds; time and energy are medians over the flights that arrived."""
    outcomes = [record.outcome for record in records]
    arrived = [record for record in records if record.outcome == Outcome.GOAL.name]
    low, high = wilson_interval(len(arrived), len(records))
    time = f"{np.median([r.time for r in arrived]):.1f}" if arrived else "–"
    energy = f"{np.median([r.energy for r in arrived]) / 1e3:.2f}" if arrived else "–"
    ends = (Outcome.COLLISION, Outcome.ROUGH_TRANSITION, Outcome.OUT_OF_BOUNDS, Outcome.TIMEOUT)
    counts = [str(outcomes.count(end.name)) for end in ends]
    p50, p99 = np.percentile(decisions, (50.0, 99.0))
    first = records[0]
    cells = [first.planner, first.mission, str(first.spheres), f"{100.0 * len(arrived) / len(records):.1f} %"]
    cells += [f"{100.0 * low:.1f}–{100.0 * high:.1f}", *counts, time, energy, f"{p50:.2f} / {p99:.2f}"]
    return "| " + " | ".join(cells) + " |"


def main(settings: Settings) -> None:
    """Fly, write the CSV and print the table row by row."""
    for name in settings.planners:
        if name not in PLANNERS:
            raise SystemExit(f"--planners must be among {', '.join(PLANNERS)}, got {name!r}")
    for name in settings.missions:
        if name not in MISSIONS:
            raise SystemExit(f"--missions must be among {', '.join(MISSIONS)}, got {name!r}")
    if settings.worlds < 1:
        raise SystemExit(f"--worlds must be at least 1, got {settings.worlds}")
    for spheres in settings.spheres:
        if settings.radius is None and spheres not in RADII:
            raise SystemExit(f"--radius is needed for {spheres} spheres; without it they must be 20 or 40")
    seeds = range(settings.first_seed, settings.first_seed + settings.worlds)
    sets = list(itertools.product(settings.missions, settings.spheres, settings.planners))
    pool = joblib.Parallel(n_jobs=settings.n_jobs, backend=settings.backend, return_as="generator")
    print(HEADER, flush=True)
    with settings.csv.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Record)])
        writer.writeheader()
        for mission, spheres, planner in sets:
            spec = (planner, mission, spheres, settings.radius or RADII[spheres], settings.vehicle)
            jobs = pool(joblib.delayed(fly_one)(*spec, seed) for seed in seeds)
            results = list(tqdm(jobs, total=len(seeds), desc=f"{planner} {mission} {spheres}", leave=False))
            writer.writerows(asdict(record) for record, _ in results)
            file.flush()
            print(table_row([r for r, _ in results], np.concatenate([d for _, d in results])), flush=True)


if __name__ == "__main__":
    main(tyro.cli(Settings, description=__doc__))
