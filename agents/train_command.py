"""The subcommand `hydrone train`; importing this needs none of what training needs."""

import dataclasses
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro


@dataclass(frozen=True, kw_only=True)
class Train:
    """Train an agent, evaluate it on held-out worlds and write a run folder."""

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
    resume: Path | None = None
    """Go on with the run in this folder from its latest checkpoint; excludes every option above."""
    obstacles: int | None = None
    """Number of spheres in training and evaluation; unless given the recipe's, and 20 in evaluation."""
    vehicle: Literal["paper", "physical"] | None = None
    """Parameter set of the vehicle, "paper" unless given."""
    num_threads: int = 1
    """Threads of torch; with one, a seed gives the same weights again."""
    checkpoint_every: int = 500_000
    """Least number of steps between checkpoints."""
    evaluation_episodes: int = 1000
    """Held-out worlds a mission to evaluate on, 0 for none."""
    tensorboard: bool = False
    """Also write a log for TensorBoard; needs the extra `tensorboard`."""
    json: bool = False
    """Print one JSON document instead of the table, and show no progress bar."""

    def run(self) -> int:
        """Train, report and return the exit code."""
        try:
            from agents.evaluation import score_table
            from agents.training import TrainingRun, resume, train
        except ImportError as error:
            print(f'hydrone: error: {error}; training needs: pip install "hydrone-gym[agents]"', file=sys.stderr)
            return 2
        try:
            folder, changes = self._folder(), self._changes()
            if self.resume is not None:
                scores = resume(folder, progress=not self.json)
            else:
                scores = train(TrainingRun(folder=folder, progress=not self.json, **changes))
        except (ValueError, TypeError, OSError) as error:
            print(f"hydrone: error: {error}", file=sys.stderr)
            return 2
        if self.json:
            print(json.dumps({"folder": str(folder), "scores": [dataclasses.asdict(score) for score in scores]}))
            return 0
        if scores:
            print(score_table(scores))
        print(folder)
        return 0

    def _folder(self) -> Path:
        if self.resume is not None:
            return self.resume
        return Path("runs") / f"{self.algorithm}-{self.seed}" if self.out is None else self.out

    def _changes(self) -> dict[str, Any]:
        """Return the options of the training run; raises ValueError for options that exclude each other."""
        if self.resume is not None:
            given = [spec.name for spec in dataclasses.fields(self)[:6] if getattr(self, spec.name) != spec.default]
            if given:
                raise ValueError(f"--resume excludes {', '.join(given)}: the run folder says what is trained")
        if self.resume is None and self.algorithm == "ppo_shielded" and self.start_from is None:
            raise ValueError("ppo_shielded goes on with weights trained without the shield: name their --start-from")
        options = {"num_obstacles": self.obstacles, "vehicle": self.vehicle}
        return {
            "algorithm": self.algorithm,
            "seed": self.seed,
            "steps": self.steps,
            "recipe": self.recipe,
            "start_from": self.start_from,
            "options": {name: value for name, value in options.items() if value is not None},
            "threads": self.num_threads,
            "checkpoint_every": self.checkpoint_every,
            "evaluation_episodes": self.evaluation_episodes,
            "tensorboard": self.tensorboard,
        }
