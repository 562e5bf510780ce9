"""Environment steps and tree edges a CPU second, and the circumstances that change them.

    python -m benchmarks.throughput                      everything, about 6 minutes
    python -m benchmarks.throughput --parts environments edges
    python -m benchmarks.throughput --parts memory --steps 10000000

One environment step is 0.5 s of flight: 50 substeps of control and dynamics, swept collision with 20 spheres and
sensing every 50 ms, observation, reward and outcome.
"""

import json
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import tyro
from rich.console import Console

from benchmarks import conditions, edges, tables
from benchmarks.environments import Flights, has_egocentric, has_vector_env, pendulum, single, vector
from benchmarks.timing import Contestant, in_turns, save

Part = Literal["environments", "edges", "learning", "threads", "neighbour", "memory", "start", "versions"]
PARTS: tuple[Part, ...] = ("environments", "edges", "learning", "threads", "neighbour", "memory", "start", "versions")
NEEDS_VECTOR = ("threads", "neighbour", "memory", "versions")
SIZES = (1, 64, 1024, 4096)


@dataclass(frozen=True, kw_only=True)
class Settings:
    parts: tuple[Part, ...] = PARTS
    """what to measure"""
    rounds: int = 9
    """turns of each contestant"""
    seconds: float = 0.3
    """CPU seconds of a turn"""
    steps: int = 1_000_000
    """environment steps of the memory growth run"""
    json: bool = False
    """print JSON instead of tables; it is written to benchmarks/results in both cases"""


def note(line: str) -> None:
    """Say something without disturbing JSON on standard output."""
    print(line, file=sys.stderr)


def environments(settings: Settings) -> dict[str, Any]:
    """Steps a CPU second of every kind of environment, in turns."""
    contestants: list[Contestant] = [pendulum()]
    flights: dict[str, Flights] = {}

    def add(pair: tuple[Contestant, Flights]) -> None:
        contestants.append(pair[0])
        flights[pair[0].name] = pair[1]

    for driving in ("near", "uniform"):
        add(single(driving, f"single, {driving}"))
    if has_vector_env():
        for count in SIZES:
            add(vector(count, "near", f"vector {count}, near"))
        for count in SIZES[1:]:
            add(vector(count, "uniform", f"vector {count}, uniform"))
        for level in (1, 5):
            add(vector(1024, "near", f"vector 1024, near, weather {level}", weather=level))
        for driving in ("near", "uniform"):
            add(vector(1024, driving, f"vector 1024, {driving}, robust law", controller="robust"))
        if has_egocentric():
            for count in SIZES[1:]:
                add(vector(count, "uniform", f"egocentric {count}", interface="egocentric"))
        else:
            note('no interface="egocentric" yet: not measured')
    else:
        note("the ids have no vector_entry_point: vector environments not measured")
    in_turns(contestants, settings.rounds, settings.seconds)
    return {
        contestant.name: {
            "rate": contestant.rate,
            "spread": contestant.spread,
            **(flights[contestant.name].report() if contestant.name in flights else {}),
        }
        for contestant in contestants
    }


def tree_edges(settings: Settings) -> dict[str, Any]:
    """Edges a CPU second, in turns."""
    with tempfile.TemporaryDirectory() as folder:
        contestants = edges.contestants(Path(folder))
        in_turns(contestants, settings.rounds, settings.seconds)
    return {contestant.name: {"rate": contestant.rate, "spread": contestant.spread} for contestant in contestants}


def learning(settings: Settings) -> dict[str, Any]:
    """Transitions a CPU second inside Stable-Baselines3, in turns."""
    from benchmarks.learning import contestants  # needs torch

    found = [pendulum(), *contestants()]
    in_turns(found, settings.rounds, settings.seconds)
    return {contestant.name: {"rate": contestant.rate, "spread": contestant.spread} for contestant in found}


def main() -> int:
    settings = tyro.cli(Settings, description=__doc__)
    vectors = has_vector_env()
    measures: dict[str, Callable[[], dict[str, Any]]] = {
        "environments": lambda: environments(settings),
        "edges": lambda: tree_edges(settings),
        "learning": lambda: learning(settings),
        "threads": conditions.threads,
        "neighbour": conditions.neighbour,
        "memory": lambda: conditions.memory(settings.steps),
        "start": lambda: conditions.start_up(vectors),
        "versions": lambda: conditions.probe("versions"),
    }
    console = Console()
    everything: dict[str, Any] = {}
    for part in settings.parts:
        if part in NEEDS_VECTOR and not vectors:
            note(f"{part}: not measured, the ids have no vector_entry_point")
            continue
        note(f"measuring {part} …")
        everything[part] = measures[part]()
        options = f" --steps {settings.steps}" if part == "memory" else ""
        save(part, f"python -m benchmarks.throughput --parts {part}{options}", {"measured": everything[part]})
        if not settings.json:
            console.print(tables.BUILDERS[part](everything[part]))
    if settings.json:
        print(json.dumps(everything))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
