"""What one kind of weather at a time does to policies: outcomes and Wilson intervals.

    python -m benchmarks.weather_factors                                # every factor, every policy
    python -m benchmarks.weather_factors --worlds 20 --factors "wind 3" --policies clrrt clrrt-weather --out /tmp/trial

All policies fly the same worlds, in the same weather; `sac+weather-shield` is an agent behind a shield that is ready.
"""

import shlex
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import gymnasium as gym
import tyro
from rich.console import Console

from agents.named import ppo_shield_weather
from benchmarks.timing import RESULTS, save
from hydrone_gym import Spread, Weather
from hydrone_gym.evaluation import fly_worlds
from hydrone_gym.evaluation.policies import PolicySource, find_policies
from hydrone_gym.evaluation.statistics import wilson_interval
from hydrone_gym.evaluation.suites import HELD_OUT
from hydrone_gym.simulation.outcome import Outcome
from hydrone_gym.weather.weather import LEVELS, ROTOR_DRAG
from planners.named import clrrt_weather

POLICIES = ("clrrt", "clrrt-weather", "ppo-shield", "ppo-shield-weather")
READY = {"clrrt": clrrt_weather, "ppo-shield": ppo_shield_weather}  # what promises, or flies with latency, besides
MISSIONS = {
    "air to water": "HydroneGym/AirToWater-v0",
    "water to air": "HydroneGym/WaterToAir-v0",
    "any": "HydroneGym/Mission-v0",
}
_DRAG = Spread(rotor_drag=(ROTOR_DRAG, ROTOR_DRAG))  # without it, wind hardly moves this vehicle
FACTORS: dict[str, Any] = {
    "none": 0,
    **{f"wind {speed}": Weather(wind=speed, spread=_DRAG) for speed in (1, 2, 3, 4)},
    **{f"current {speed}": Weather(current=speed) for speed in (0.1, 0.2, 0.3, 0.5)},
    "mass, thrust 10 %": Weather(spread=Spread(mass=0.1, thrust=0.1)),
    "waves 0.1 m": Weather(wave_height=0.1, wave_period=1.5),
    "waves 0.2 m": Weather(wave_height=0.2, wave_period=2.0),
    "wind 3, current 0.3": Weather(wind=3, current=0.3, spread=_DRAG),
    **{f"level {level}": level for level in range(1, len(LEVELS))},
}


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """What to fly, and where the figures go."""

    worlds: int = 100
    """Worlds of each mission."""
    missions: tuple[str, ...] = ("air to water", "water to air")
    """Both experiments, or "any" two places."""
    factors: tuple[str, ...] = tuple(FACTORS)
    """Kinds of weather by name."""
    policies: tuple[str, ...] = POLICIES
    """Policies, named as for `hydrone evaluate`."""
    promises: tuple[float, ...] = ()
    """Shares of flights that CL-RRT, and PPO behind the shield, promise besides."""
    latency: bool = False
    """Whether CL-RRT, and PPO behind the shield, fly besides with references that are a period old."""
    controller: str = "paper"
    """Control law."""
    seed: int = HELD_OUT
    """Seed of the first world."""
    out: Path = RESULTS
    """Folder of weather_factors.json."""


def cell(factor: str, source: PolicySource, mission: str, a: Arguments) -> dict[str, Any]:
    """Fly a policy in the worlds of an experiment in one kind of weather; `failures` by seed."""
    options = {"weather": FACTORS[factor], "controller": a.controller}
    env = gym.make(MISSIONS[mission], **options)
    rows = gym.make_vec(MISSIONS[mission], a.worlds, vectorization_mode="vector_entry_point", **options)
    endings = fly_worlds(rows, source.make(env, 0), seed=a.seed)
    outcomes = [ending.outcome for ending in endings]
    times = sorted(ending.time for ending in endings if ending.outcome is Outcome.GOAL)
    return {
        "factor": factor,
        "policy": source.label,
        "law": a.controller,
        "mission": mission,
        "success": wilson_interval(outcomes.count(Outcome.GOAL), a.worlds),
        "outcomes": {outcome.name: outcomes.count(outcome) for outcome in Outcome if outcome in outcomes},
        "time": times[len(times) // 2] if times else None,  # median, s
        "failures": {a.seed + k: outcome.name for k, outcome in enumerate(outcomes) if outcome is not Outcome.GOAL},
    }


def measure(a: Arguments) -> dict[str, Any]:
    """Fly every policy in every kind of weather; raises ValueError for a name that is not known."""
    for kind, names, known in (("factor", a.factors, FACTORS), ("mission", a.missions, MISSIONS)):
        if unknown := [name for name in names if name not in known]:
            raise ValueError(f"no {kind} {', '.join(map(repr, unknown))}: known are {', '.join(map(repr, known))}")
    if a.worlds < 1:
        raise ValueError(f"worlds must be at least 1, got {a.worlds}")
    sources, console, cells, began = find_policies(a.policies), Console(stderr=True), [], time.process_time()
    besides: dict[str, dict[str, Any]] = {f"promise-{promise:g}": {"promise": promise} for promise in a.promises}
    besides |= {"latency": {"latency": True}} if a.latency else {}
    for (words, given), (name, kind) in product(besides.items(), READY.items()):
        sources += find_policies({f"{name}-{words}": partial(kind, **given)})
    for factor in a.factors:
        for source in sources:
            cells += [cell(factor, source, mission, a) for mission in a.missions]
            told = ", ".join(f"{c['mission']} {c['outcomes']}" for c in cells[-len(a.missions) :])
            console.print(f"{factor}, {source.label}: {told}")
    return {"seed": a.seed, "cpu_seconds": round(time.process_time() - began, 1), "cells": cells}


def main(arguments: Sequence[str] | None = None) -> int:
    given = sys.argv[1:] if arguments is None else list(arguments)
    a = tyro.cli(Arguments, args=given, description=__doc__)
    try:
        measured = measure(a)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
    print(save("weather_factors", shlex.join(["python", "-m", "benchmarks.weather_factors", *given]), measured, a.out))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
