"""CL-RRT over sets of random worlds: success, safety, crossings, time, path, energy and planning time a cycle.

    python -m benchmarks.planning                       # six mission types, 20 and 40 spheres, 1,000 worlds each
    python -m benchmarks.planning --worlds 200 --sets experiment-1 experiment-2 --density 20
    python -m benchmarks.planning --controller robust --crossing aggressive --sets experiment-1 --density 20
    python -m benchmarks.planning --weather 2 --controller robust --sets experiment-1 experiment-2 missions --density 20

World k of a set is drawn from seed k. Every flight goes through the registered environment. Worlds whose flight does
not end at the goal are saved as scenario files beside the results, named after set, density, seed and outcome.
"""

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import gymnasium as gym
import numpy as np
import tyro
from joblib import Parallel, delayed

from benchmarks.freeze_suites import DENSE
from hydrone_gym import save_scenario
from hydrone_gym.evaluation import Record, fly, percentiles, wilson_interval
from hydrone_gym.evaluation.provenance import commit, machine
from hydrone_gym.evaluation.records import record_of
from hydrone_gym.vehicle import named_vehicle
from hydrone_gym.world.generator import EXPERIMENT_1, EXPERIMENT_2, ScenarioLaw, generate
from hydrone_gym.world.world import World
from planners import CLRRT

SETS = {
    "experiment-1": EXPERIMENT_1,
    "experiment-2": EXPERIMENT_2,
    "air-air": ScenarioLaw(media=("air", "air")),
    "water-water": ScenarioLaw(media=("water", "water")),
    "air-water": ScenarioLaw(media=("air", "water")),
    "water-air": ScenarioLaw(media=("water", "air")),
    "missions": ScenarioLaw(),
}
DENSITIES = {20: (0.5, 1.5), 40: DENSE}


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """What to fly."""

    worlds: int = 1000
    """Worlds a set."""
    sets: tuple[str, ...] = tuple(SETS)[:-1]
    """Mission types."""
    density: tuple[int, ...] = tuple(DENSITIES)
    """Numbers of spheres: 20 of 0.5-1.5 m, or 40 of 0.8-1.8 m radius."""
    vehicle: Literal["paper", "physical", "hydrone-agile"] = "paper"
    """Parameter set."""
    controller: Literal["paper", "robust"] = "paper"
    """Control law."""
    weather: int = 0
    """Level of weather that is flown in, and that the planner is ready for."""
    crossing: Literal["vertical", "adaptive", "aggressive"] = "vertical"
    """What a crossing may be."""
    period: float = 0.5
    """Seconds between references."""
    cruise: float | None = None
    """Lateral speed limit of the robust law in m/s, in the place of its own."""
    objective: float | Literal["time", "energy", "length", "paper"] = "time"
    """What the planner minimises; a number is what a second is worth in joules (W)."""
    iterations: int = 100
    """Samples a cycle."""
    latency: bool = False
    """Use each plan one period after it was begun."""
    jobs: int = 1
    """Worlds flown at once; more than one disturbs the planning times."""
    out: Path = Path("benchmarks/results/planning.json")
    """Where the figures go; failed worlds go beside it."""


class Flown(NamedTuple):
    """One flight: its record as in an evaluation, the share of time under water, and each cycle's time in ms."""

    record: Record
    in_water: float
    cycles: np.ndarray


def law_of(name: str, density: int) -> ScenarioLaw:
    """The law of a set at a density."""
    return dataclasses.replace(SETS[name], num_obstacles=density, obstacle_radius=DENSITIES[density])


def fly_some(name: str, density: int, seeds: list[int], a: Arguments) -> list[Flown]:
    """Fly the worlds of some seeds; save those that do not end at the goal."""
    vehicle = named_vehicle(a.vehicle)
    if a.cruise is not None:
        gains = dataclasses.replace(vehicle.robust_gains, speed_limit=a.cruise)
        vehicle = dataclasses.replace(vehicle, robust_gains=gains)
    options: dict[str, Any] = {"vehicle": vehicle, "controller": a.controller, "crossing": a.crossing}
    options |= {"weather": a.weather, "period": a.period, "num_obstacles": density, "disable_env_checker": True}
    env = gym.make("HydroneGym/Mission-v0", **options)
    budget: dict[str, Any] = {"iterations": a.iterations, "objective": a.objective, "latency": a.latency}
    planner: Any = CLRRT.for_env(env, level=a.weather, **budget)
    law, flown = law_of(name, density), []
    observation, _ = env.reset(seed=0)
    planner.predict(observation)  # compiled, or loaded from the cache, before anything is timed
    for seed in seeds:
        scenario = generate(law, World(), vehicle.radius, np.random.default_rng(seed))
        flight = fly(env, planner, seed=seed, scenario=scenario)
        record = record_of((name, f"{density} spheres", seed, "clrrt"), flight)
        flown.append(Flown(record, float((flight.trace.states[:, 2] < 0.0).mean()), flight.decision_ms))
        if not record.success:
            folder = a.out.parent / "failed"
            folder.mkdir(parents=True, exist_ok=True)
            kind = f"{a.vehicle}-{a.controller}-{a.weather}-{a.crossing}-{a.objective}"
            stem = f"{kind}-{name}-{density}-{seed}-{record.outcome.lower()}"
            save_scenario(scenario, folder / f"{stem}.json")
    return flown


def summary(flown: list[Flown]) -> dict[str, Any]:
    """Figures of a set; medians over the flights that arrived."""
    records = [f.record for f in flown]
    reached = [record for record in records if record.success]
    outcomes = [record.outcome for record in records]
    low, high = wilson_interval(len(reached), len(records))
    p50, p99, most = percentiles(np.concatenate([f.cycles for f in flown]), (50.0, 99.0, 100.0))

    def median(name: str) -> float | None:
        values = [value for record in reached if (value := getattr(record, name)) is not None]
        return float(np.median(values)) if values else None

    return {
        "worlds": len(records),
        "goal": len(reached),
        "success_low": low,
        "success_high": high,
        "failures": {str(record.world): record.outcome for record in records if not record.success},
        "collisions": outcomes.count("COLLISION"),
        "rough": outcomes.count("ROUGH_TRANSITION"),
        "time_s": median("time"),
        "length_m": median("length"),
        "energy_J": median("energy"),
        "crossing_s": median("crossing_time"),
        "water_share": float(np.mean([f.in_water for f in flown if f.record.success])),
        "lateral_max": max(record.lateral_speed or 0.0 for record in records),
        "tilt_max": float(np.degrees(max(record.tilt or 0.0 for record in records))),
        "clearance_min": min((r.clearance for r in records if r.clearance is not None), default=None),
        "cycle_p50_ms": p50,
        "cycle_p99_ms": p99,
        "cycle_max_ms": most,
    }


def table(results: dict[str, dict[str, Any]]) -> str:
    """A Markdown table of all sets."""
    lines = [
        "| set | goal | collisions | rough | time s | path m | energy J | crosses at s "
        "| lateral max m/s | tilt max deg | cycle p50 / p99 ms |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, r in results.items():
        crossing = "-" if r["crossing_s"] is None else f"{r['crossing_s']:.1f}"
        lines.append(
            f"| {name} | {r['goal']}/{r['worlds']} | {r['collisions']} | {r['rough']} | {r['time_s']:.1f} "
            f"| {r['length_m']:.1f} | {r['energy_J']:.0f} | {crossing} | {r['lateral_max']:.3f} | {r['tilt_max']:.2f} "
            f"| {r['cycle_p50_ms']:.2f} / {r['cycle_p99_ms']:.1f} |"
        )
    return "\n".join(lines)


def main(a: Arguments) -> None:
    """Fly all sets, print the table and save the figures."""
    results = {}
    for density in a.density:
        for name in a.sets:
            parts = np.array_split(np.arange(a.worlds), a.jobs)
            jobs = (delayed(fly_some)(name, density, [int(k) for k in part], a) for part in parts)
            flown = [flight for part in Parallel(n_jobs=a.jobs)(jobs) for flight in part]
            results[f"{name}, {density} spheres"] = summary(flown)
            print(table(dict([list(results.items())[-1]])).splitlines()[-1], flush=True)
    a.out.parent.mkdir(parents=True, exist_ok=True)
    arguments = {key: str(value) for key, value in dataclasses.asdict(a).items()}
    document = {"arguments": arguments, "commit": commit(), "machine": machine(), "results": results}
    a.out.write_text(json.dumps(document, indent=1, default=float) + "\n")
    print("\n" + table(results))


if __name__ == "__main__":
    main(tyro.cli(Arguments))
