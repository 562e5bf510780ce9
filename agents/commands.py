"""The subcommands of `hydrone` about agents; importing this needs none of what they need."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, get_args

import tyro

from hydrone_gym.cli import check_obstacles
from hydrone_gym.evaluation.suites import MISSIONS

if TYPE_CHECKING:
    from agents.training import Flown

_Mission = Literal["random", "air-to-water", "water-to-air"]
_IDS = dict(zip(get_args(_Mission), MISSIONS, strict=True))
_Vehicle = Literal["paper", "physical"]


@dataclass(frozen=True, kw_only=True)
class Train:
    """Train an agent, evaluate it on held-out worlds and write a run folder."""

    EXTRA: ClassVar = "agents"
    _TRAINED: ClassVar = ("algorithm", "out", "seed", "steps", "recipe", "start_from", "obstacles", "vehicle")

    # Recipe; ppo-shield goes on behind the shield and wants --start-from.
    algorithm: Annotated[Literal["ppo", "ppo-shield", "ppo-weather", "sac", "td3", "tqc"], tyro.conf.Positional] = "ppo"
    out: Path | None = None  # Run folder, runs/<algorithm>-<seed> unless given; must not hold a run already.
    seed: int = 0  # Seed of weights, missions and exploration.
    steps: int | None = None  # Transitions to learn from, the recipe's number unless given.
    recipe: Path | None = None  # YAML file of hyper-parameters to use instead of the package's.
    start_from: Path | None = None  # Run folder whose latest weights to begin with.
    # Number of spheres in training and evaluation; unless given the recipe's, and 20 in evaluation.
    obstacles: int | None = None
    vehicle: _Vehicle | None = None  # Parameter set of the vehicle, "paper" unless given.
    # Go on with the run in this folder from its latest checkpoint; excludes every option above.
    resume: Path | None = None
    num_threads: int = 1  # Threads of torch; with one, a seed gives the same weights again.
    checkpoint_every: int = 500_000  # Least number of steps between checkpoints.
    evaluation_episodes: int = 1000  # Held-out worlds a mission to evaluate on, 0 for none.
    tensorboard: bool = False  # Also write a log for TensorBoard; needs the extra `tensorboard`.
    json: bool = False  # Print one JSON document instead of the tables, and show no progress bar.

    def run(self) -> int:
        """Train, report and return the exit code."""
        from hydrone_gym.evaluation.summary import summarise
        from hydrone_gym.evaluation.tables import print_tables, tables_of

        folder = self.resume or self.out or Path("runs") / f"{self.algorithm}-{self.seed}"
        try:
            records, scores = self._trained(folder) if self.resume is None else self._resumed(folder)
        except KeyboardInterrupt:
            kept = sorted(path.name for path in folder.glob("checkpoints/step_*"))
            on = f"hydrone train --resume {folder} goes on after {kept[-1]}" if kept else "nothing is kept"
            raise KeyboardInterrupt(on.replace("step_", "step ")) from None
        if self.json:
            print(json.dumps({"folder": str(folder), "scores": scores}))
            return 0
        if records:
            print_tables(tables_of(summarise(records)))
        print(folder)
        return 0

    def _resumed(self, folder: Path) -> "Flown":
        """Go on with a run; return how the agent flew."""
        from agents.training import resume

        if given := [name for name in self._TRAINED if getattr(self, name) != getattr(Train, name)]:
            raise ValueError(f"--resume excludes {', '.join(given)}: the run folder says what is trained")
        return resume(folder, progress=not self.json)

    def _trained(self, folder: Path) -> "Flown":
        """Train a new run; return how the agent flew."""
        from agents.training import TrainingRun, train

        if self.algorithm == "ppo-shield" and self.start_from is None:
            raise ValueError("ppo-shield goes on with weights trained without the shield: name their --start-from")
        check_obstacles(self.obstacles)
        options = {"num_obstacles": self.obstacles, "vehicle": self.vehicle}
        return train(
            TrainingRun(
                folder=folder,
                options={name: value for name, value in options.items() if value is not None},
                threads=self.num_threads,
                progress=not self.json,
                **{name: getattr(self, name) for name in ("algorithm", "seed", "steps", "recipe", "start_from")},
                **{name: getattr(self, name) for name in ("checkpoint_every", "evaluation_episodes", "tensorboard")},
            )
        )


@dataclass(frozen=True, kw_only=True)
class Demonstrate:
    """Record flights of a policy on training worlds, as Minari datasets to learn from."""

    EXTRA: ClassVar = "agents,demonstrations"

    # Registered name, module:attribute, file.py:attribute or an agent's folder, also as LABEL=…
    policy: Annotated[str, tyro.conf.Positional] = "clrrt"
    out: Path = Path("demonstrations")  # Folder of the datasets, one a mission.
    missions: tuple[_Mission, ...] = get_args(_Mission)  # Random missions, and the two experiments of the paper.
    flights: int = 400  # Flights a mission, each in a world of its own.
    seed: int = 6_000_000  # Of the first world; below 10,000,000, where the held-out worlds begin.
    obstacles: int = 20  # Number of spheres.
    vehicle: _Vehicle = "paper"  # Parameter set of the vehicle.
    json: bool = False  # Print one JSON document instead of the paths, and show no progress bar.

    def run(self) -> int:
        """Record, report and return the exit code."""
        from agents.demonstrations import Recording, load_demonstrations, record

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
        told = ("{folder}: {flights} flights, {arrived} arrived, {periods} periods".format(**row) for row in rows)
        print(json.dumps(rows) if self.json else "\n".join(told))
        return 0


@dataclass(frozen=True, kw_only=True)
class Failures:
    """Fly an agent in many held-out worlds, and say where and why it fails.

    Writes tables, failures.csv and figures.
    """

    # Name of a shipped agent, or a folder; for comparison also a registered policy such as straight-line.
    agent: str
    out: Path  # Folder to write to.
    shield: bool = False  # Fly behind the shield.
    episodes: int = 4000  # Worlds a mission.
    obstacles: int = 20  # Number of spheres.
    radii: tuple[float, float] = (0.5, 1.5)  # Least and greatest radius of a sphere, m.
    vehicle: _Vehicle = "paper"  # Parameter set of the vehicle.
    json: bool = False  # Print one JSON document instead of the tables, and show no progress bar.

    def run(self) -> int:
        """Fly, write everything to the folder, report and return the exit code."""
        from agents.agent import PRETRAINED, shipped_agents
        from agents.failures.report import write_failure_report
        from hydrone_gym.evaluation.tables import print_tables

        check_obstacles(self.obstacles)
        options = {"num_obstacles": self.obstacles, "obstacle_radius": self.radii, "vehicle": self.vehicle}
        behind = "+shield" if self.shield else ""
        folder = f"={PRETRAINED / self.agent}{behind}" if self.shield and self.agent in shipped_agents() else ""
        tables, document = write_failure_report(
            f"{self.agent}{behind}{folder}", self.out, worlds=self.episodes, options=options, progress=not self.json
        )
        if self.json:
            print(json.dumps(document))
        else:
            print_tables(tables)
            print(self.out)
        return 0
