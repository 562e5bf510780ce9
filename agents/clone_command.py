"""The subcommands `hydrone demonstrate` and `hydrone clone`; importing this needs none of what they need."""

import dataclasses
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

_IDS = {
    "mission": "HydroneGym/Mission-v0",
    "air-to-water": "HydroneGym/AirToWater-v0",
    "water-to-air": "HydroneGym/WaterToAir-v0",
}


@dataclass(frozen=True, kw_only=True)
class Demonstrate:
    """Record flights of a policy on training worlds, as Minari datasets to learn from."""

    policy: Annotated[str, tyro.conf.Positional] = "clrrt"
    """Registered name, module:attribute, file.py:attribute or an agent's folder, also as LABEL=…"""
    out: Path = Path("demonstrations")
    """Folder of the datasets, one a mission."""
    missions: tuple[Literal["mission", "air-to-water", "water-to-air"], ...] = (
        "mission",
        "air-to-water",
        "water-to-air",
    )
    """What is flown: random missions, and the two experiments of the paper."""
    flights: int = 400
    """Flights a mission, each in a world of its own."""
    seed: int = 6_000_000
    """Of the first world; below 10,000,000, where the held-out worlds begin."""
    obstacles: int = 20
    """Number of spheres."""
    vehicle: Literal["paper", "physical"] = "paper"
    """Parameter set of the vehicle."""
    json: bool = False
    """Print one JSON document instead of the paths, and show no progress bar."""

    def run(self) -> int:
        """Record, report and return the exit code."""
        return _report(self._record)

    def _record(self) -> None:
        from agents.demonstration_files import load_demonstrations
        from agents.demonstrations import Recording, record

        recording = Recording(
            root=self.out,
            policy=self.policy,
            missions=tuple(_IDS[name] for name in self.missions),
            flights=self.flights,
            seed=self.seed,
            options={"num_obstacles": self.obstacles, "vehicle": self.vehicle},
            progress=not self.json,
        )
        rows: list[dict[str, Any]] = []
        for folder in record(recording):
            flights = load_demonstrations(folder).flights
            arrived = sum(flight.outcome.name == "GOAL" for flight in flights)
            periods = sum(len(flight.rewards) for flight in flights)
            rows.append({"folder": str(folder), "flights": len(flights), "arrived": arrived, "periods": periods})
        if self.json:
            print(json.dumps(rows))
            return
        for row in rows:
            print(f"{row['folder']}: {row['flights']} flights, {row['arrived']} arrived, {row['periods']} periods")


@dataclass(frozen=True, kw_only=True)
class Clone:
    """Learn a policy from demonstrations by imitation, evaluate it on held-out worlds and write an agent's folder."""

    data: Annotated[Path, tyro.conf.Positional] = Path("demonstrations")
    """Folder of one dataset or of several."""
    out: Path = Path("runs/clone")
    """Folder of the agent; must not hold one already."""
    seed: int = 0
    """Of weights and of the order of the data."""
    epochs: int = 400
    """Times that every pair is learnt from."""
    batch: int = 512
    """Pairs a step of Adam."""
    learning_rate: float = 1e-3
    """At the beginning; it falls linearly to zero."""
    evaluation_episodes: int = 1000
    """Held-out worlds a mission to evaluate on, 0 for none."""
    json: bool = False
    """Print one JSON document instead of the table, and show no progress bar."""

    def run(self) -> int:
        """Learn, report and return the exit code."""
        return _report(self._clone)

    def _clone(self) -> None:
        from agents.cloning import Cloning, clone
        from agents.evaluation import evaluate_missions, score_table

        cloned = clone(
            Cloning(
                data=self.data,
                out=self.out,
                seed=self.seed,
                epochs=self.epochs,
                batch=self.batch,
                learning_rate=self.learning_rate,
                progress=not self.json,
            )
        )
        scores = []
        if self.evaluation_episodes > 0:
            scores = evaluate_missions(
                self.out, shield=False, episodes=self.evaluation_episodes, options=cloned.options
            )
        if self.json:
            described = [dataclasses.asdict(score) for score in scores]
            print(json.dumps({"folder": str(self.out), "cloning": cloned.notes(), "scores": described}))
            return
        print(cloned.summary())
        if scores:
            print(score_table(scores))
        print(self.out)


def _report(work: Callable[[], None]) -> int:
    """Do a command's work and return the exit code: 2 for bad input or a missing extra, told in one line."""
    try:
        work()
    except ImportError as error:
        print(f'hydrone: error: {error}; this needs: pip install "hydrone-gym[agents,demonstrations]"', file=sys.stderr)
        return 2
    except (ValueError, TypeError, OSError) as error:
        print(f"hydrone: error: {error}", file=sys.stderr)
        return 2
    return 0
