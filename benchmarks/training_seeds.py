"""How much the seed of a training matters: the recipes with several seeds each, all agents in the same worlds.

    python -m benchmarks.training_seeds                      # three recipes, three seeds: two hours of one core
    python -m benchmarks.training_seeds --recipes ppo --seeds 0 1 --runs runs/seeds
    python -m benchmarks.training_seeds --recipes ppo-weather --episodes 1000 --out runs

A run that is finished in its folder, `RUNS/ppo-0` say, is not trained again, and one that was stopped goes on: several
of these commands with other seeds can train side by side, and one more evaluates all.
"""

import csv
import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from rich.console import Console

from agents.agent import load_agent
from agents.checkpoint import checkpoints
from agents.recipe import load_recipe
from agents.run_log import CHECKPOINTS, CURVE, FAILURES
from agents.training import TrainingRun, resume, train
from benchmarks.tables import Sheet, number
from benchmarks.timing import RESULTS, save
from benchmarks.world_shapes import SHAPES
from hydrone_gym.evaluation import evaluate_held_out
from hydrone_gym.evaluation.policies import Factory
from planners.shield import Shield

BEGINS_WITH = {"ppo-shield": "ppo"}  # recipe: the one whose weights of the same seed it goes on from
DENSE = SHAPES["40 larger spheres"]
LEARNT = 0.95  # success while exploring, the mean of a curve's last `WINDOW` lines
WINDOW = 5
UNSAFE = tuple(name for name in FAILURES if name != "TIMEOUT")


@dataclass(frozen=True, kw_only=True)
class Arguments:
    """What to train and evaluate."""

    recipes: tuple[str, ...] = ("ppo", "ppo-shield", "sac")
    """Names of recipes of the package."""
    seeds: tuple[int, ...] = (0, 1, 2)
    """Seeds of the trainings."""
    runs: Path = Path("runs") / "seeds"
    """Folder of the run folders."""
    episodes: int = 4000
    """Held-out worlds a mission; 0 only trains."""
    out: Path = RESULTS
    """Folder of training_seeds.json."""


def trained(recipe: str, seed: int, runs: Path) -> Path:
    """Return the run folder of a recipe and seed, trained to its end."""
    folder = runs / f"{recipe}-{seed}"
    if (folder / "evaluation.json").is_file():
        return folder
    if checkpoints(folder / CHECKPOINTS):
        resume(folder)
        return folder
    before = BEGINS_WITH.get(recipe)
    start = None if before is None else trained(before, seed, runs)
    train(TrainingRun(folder=folder, algorithm=recipe, seed=seed, start_from=start, evaluation_episodes=0))
    return folder


def effort(folder: Path) -> dict[str, float | None]:
    """What a training took: steps, seconds, and those after which `LEARNT` was reached."""
    with (folder / CURVE).open(newline="", encoding="utf-8") as stream:
        lines = list(csv.DictReader(stream))
    success = [float(line["success"] or 0.0) for line in lines]
    means = [float(np.mean(success[max(0, k - WINDOW + 1) : k + 1])) for k in range(len(lines))]
    learnt = next((line for line, mean in zip(lines, means, strict=True) if mean >= LEARNT), None)
    last = lines[-1]
    return {
        "steps": int(last["steps"]),
        "wall_s": float(last["wall_s"]),
        "cpu_s": float(last["cpu_s"]),
        "learnt_wall_s": None if learnt is None else float(learnt["wall_s"]),
        "learnt_cpu_s": None if learnt is None else float(learnt["cpu_s"]),
    }


def flights(recipe: str, folder: Path, episodes: int) -> list[dict[str, Any]]:
    """Evaluate an agent as it is meant to fly: behind the shield if it was trained there, then in denser worlds too.

    One that is evaluated in weather flies alone, and behind a shield that is ready for it.
    """
    own, agent, cells = load_recipe(recipe), str(folder / "agent"), []
    kinds: list[tuple[str, str | Factory, dict[str, Any]]]
    if level := own.evaluation.get("weather"):
        ready = f"level {level}, shield", lambda env: Shield.for_env(load_agent(agent, env), env, level=level)
        kinds = [(*kind, own.evaluation) for kind in ((f"level {level}", agent), ready)]
    else:
        kinds = [("20 spheres", f"{agent}{'+shield' * own.shield}", own.evaluation)]
        kinds += [(DENSE.name, f"{agent}+shield", DENSE.options)] if own.shield else []
    for worlds, policy, options in kinds:
        _, scores = evaluate_held_out(policy, worlds=episodes, options=options)
        for score in scores:
            told = {"mission": score["mission"], "outcomes": score["outcomes"], "share": score["success"]}
            cells.append({"worlds": worlds, **told})
    return cells


def measure(a: Arguments) -> dict[str, Any]:
    """Train what is missing and evaluate everything."""
    runs = []
    for recipe in a.recipes:
        for seed in a.seeds:
            folder = trained(recipe, seed, a.runs)
            cells = flights(recipe, folder, a.episodes) if a.episodes else []
            runs.append({"recipe": recipe, "seed": seed, **effort(folder), "flights": cells})
    return {"episodes": a.episodes, "runs": runs}


def sheets(measured: dict[str, Any]) -> list[Sheet]:
    """Success by seed, and what the trainings took."""
    by_cell: dict[tuple[str, str, str], dict[int, dict[str, Any]]] = {}
    for run in measured["runs"]:
        for cell in run["flights"]:
            by_cell.setdefault((run["recipe"], cell["worlds"], cell["mission"]), {})[run["seed"]] = cell
    rows = []
    for (recipe, worlds, mission), cells in by_cell.items():
        shares = 100.0 * np.array([cell["share"] for cell in cells.values()])
        unsafe = ", ".join(str(sum(cell["outcomes"].get(kind, 0) for cell in cells.values())) for kind in UNSAFE)
        each = ", ".join(f"{share:.2f}" for share in shares)
        spread = f"{shares.mean():.2f} ± {shares.std(ddof=1):.2f}" if len(shares) > 1 else "–"
        rows.append((recipe, worlds, mission.removeprefix("HydroneGym/"), each, spread, unsafe))
    seeds = ", ".join(str(seed) for seed in dict.fromkeys(run["seed"] for run in measured["runs"]))
    success = Sheet(
        "At the goal, by training seed",
        ("recipe", "worlds", "mission", f"seeds {seeds}, %", "mean ± deviation, %", "collisions, out, rough, diverged"),
        rows,
        [
            f"{measured['episodes']:,} held-out worlds a mission and seed, deterministic; `ppo-shield`, and where "
            "the worlds say so, behind the shield, else alone. The last column counts flights of all seeds. "
            f"{DENSE.name}: {DENSE.radii[0]}–{DENSE.radii[1]} m."
        ],
    )
    took = [
        (
            run["recipe"],
            str(run["seed"]),
            f"{run['steps']:,}",
            number(run["steps"] / run["cpu_s"]),
            f"{run['cpu_s']:.0f}",
            f"{run['wall_s']:.0f}",
            "–" if run["learnt_cpu_s"] is None else f"{run['learnt_cpu_s']:.0f}",
        )
        for run in measured["runs"]
    ]
    columns = (
        "recipe",
        "seed",
        "steps",
        "steps a CPU second",
        "CPU s",
        "wall-clock s",
        "CPU s to 95 % while exploring",
    )
    return [success, Sheet("What the trainings took, one torch thread", columns, took)]


def main(arguments: Sequence[str] | None = None) -> int:
    given = sys.argv[1:] if arguments is None else list(arguments)
    a = tyro.cli(Arguments, args=given, description=__doc__)
    try:
        measured = measure(a)
    except (ValueError, OSError) as error:
        print(error, file=sys.stderr)
        return 2
    if a.episodes:
        command = shlex.join(["python", "-m", "benchmarks.training_seeds", *given])
        path = save("training_seeds", command, {"measured": measured}, folder=a.out)
        for sheet in sheets(measured):
            Console().print(sheet)
        print(path)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
