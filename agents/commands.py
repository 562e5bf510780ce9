"""The subcommands of `hydrone` about agents; importing this needs none of what they need."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import tyro

from hydrone_gym.cli import check_obstacles
from hydrone_gym.evaluation.records import Record

_IDS = {
    "mission": "HydroneGym/Mission-v0",
    "air-to-water": "HydroneGym/AirToWater-v0",
    "water-to-air": "HydroneGym/WaterToAir-v0",
}


@dataclass(frozen=True, kw_only=True)
class Train:
    """Train an agent, evaluate it on held-out worlds and write a run folder."""

    EXTRA: ClassVar = "agents"
    _TRAINED: ClassVar = ("algorithm", "out", "seed", "steps", "recipe", "start_from", "obstacles", "vehicle")

    algorithm: Annotated[Literal["ppo", "ppo_shielded", "sac", "td3", "tqc"], tyro.conf.Positional] = "ppo"
    """Recipe; ppo_shielded goes on behind the shield and wants --start-from."""
    out: Path | None = None
    """Run folder, runs/<algorithm>-<seed> unless given; must not hold a run already."""
    seed: int = 0
    """Seed of weights, missions and exploration."""
    steps: int | None = None
    """Transitions to learn from, the recipe's number unless given."""
    recipe: Path | None = None
    """YAML file of hyper-parameters to use instead of the package's."""
    start_from: Path | None = None
    """Run folder whose latest weights to begin with."""
    obstacles: int | None = None
    """Number of spheres in training and evaluation; unless given the recipe's, and 20 in evaluation."""
    vehicle: Literal["paper", "physical"] | None = None
    """Parameter set of the vehicle, "paper" unless given."""
    resume: Path | None = None
    """Go on with the run in this folder from its latest checkpoint; excludes every option above."""
    num_threads: int = 1
    """Threads of torch; with one, a seed gives the same weights again."""
    checkpoint_every: int = 500_000
    """Least number of steps between checkpoints."""
    evaluation_episodes: int = 1000
    """Held-out worlds a mission to evaluate on, 0 for none."""
    tensorboard: bool = False
    """Also write a log for TensorBoard; needs the extra `tensorboard`."""
    json: bool = False
    """Print one JSON document instead of the tables, and show no progress bar."""

    def run(self) -> int:
        """Train, report and return the exit code."""
        from agents import training

        if self.resume is not None:
            defaults = type(self)()
            given = [name for name in self._TRAINED if getattr(self, name) != getattr(defaults, name)]
            if given:
                raise ValueError(f"--resume excludes {', '.join(given)}: the run folder says what is trained")
            return _report(self.json, self.resume, *training.resume(self.resume, progress=not self.json))
        if self.algorithm == "ppo_shielded" and self.start_from is None:
            raise ValueError("ppo_shielded goes on with weights trained without the shield: name their --start-from")
        check_obstacles(self.obstacles)
        options = {"num_obstacles": self.obstacles, "vehicle": self.vehicle}
        run = training.TrainingRun(
            folder=Path("runs") / f"{self.algorithm}-{self.seed}" if self.out is None else self.out,
            options={name: value for name, value in options.items() if value is not None},
            threads=self.num_threads,
            progress=not self.json,
            **{name: getattr(self, name) for name in ("algorithm", "seed", "steps", "recipe", "start_from")},
            **{name: getattr(self, name) for name in ("checkpoint_every", "evaluation_episodes", "tensorboard")},
        )
        return _report(self.json, run.folder, *training.train(run))


@dataclass(frozen=True, kw_only=True)
class Demonstrate:
    """Record flights of a policy on training worlds, as Minari datasets to learn from."""

    EXTRA: ClassVar = "agents,demonstrations"

    policy: Annotated[str, tyro.conf.Positional] = "clrrt"
    """Registered name, module:attribute, file.py:attribute or an agent's folder, also as LABEL=…"""
    out: Path = Path("demonstrations")
    """Folder of the datasets, one a mission."""
    missions: tuple[Literal["mission", "air-to-water", "water-to-air"], ...] = tuple(_IDS)  # type: ignore[arg-type]
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
        from agents.demonstration_files import load_demonstrations
        from agents.demonstrations import Recording, record

        check_obstacles(self.obstacles)
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
            return 0
        for row in rows:
            print("{folder}: {flights} flights, {arrived} arrived, {periods} periods".format(**row))
        return 0


@dataclass(frozen=True, kw_only=True)
class Failures:
    """Fly an agent in many held-out worlds, and say where and why it fails: tables, failures.csv and figures."""

    agent: str
    """Name of a shipped agent, or a folder; for comparison also a registered policy such as straight-line."""
    out: Path
    """Folder to write to."""
    shield: bool = False
    """Fly behind the shield."""
    episodes: int = 4000
    """Worlds a mission."""
    obstacles: int = 20
    """Number of spheres."""
    radii: tuple[float, float] = (0.5, 1.5)
    """Least and greatest radius of a sphere, m."""
    vehicle: Literal["paper", "physical"] = "paper"
    """Parameter set of the vehicle."""
    json: bool = False
    """Print one JSON document instead of the tables, and show no progress bar."""

    def run(self) -> int:
        """Fly, write everything to the folder, report and return the exit code."""
        from agents.agent import PRETRAINED, shipped_agents
        from agents.failures.report import write_failure_report

        check_obstacles(self.obstacles)
        options = {"num_obstacles": self.obstacles, "obstacle_radius": self.radii, "vehicle": self.vehicle}
        behind = "+shield" if self.shield else ""
        policy = f"{self.agent}{behind}"
        if self.agent in shipped_agents():
            policy = f"{policy}={PRETRAINED / self.agent}{behind}"
        text, document = write_failure_report(
            policy, self.out, worlds=self.episodes, options=options, progress=not self.json
        )
        print(json.dumps(document) if self.json else text)
        return 0


def _report(as_json: bool, folder: Path, records: list[Record], scores: list[dict[str, Any]]) -> int:
    """Print what came of an agent: tables and its folder, or one JSON document."""
    from hydrone_gym.evaluation.summary import summarise
    from hydrone_gym.evaluation.tables import print_tables, tables_of

    if as_json:
        print(json.dumps({"folder": str(folder), "scores": scores}))
        return 0
    if records:
        print_tables(tables_of(summarise(records)))
    print(folder)
    return 0
