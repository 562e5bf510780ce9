"""Training: a recipe, a seed and a folder in; an agent, its curve and what it was made with out.

A run folder holds `config.yaml` and `versions.json`, `curve.csv` and `curve.png`, `checkpoints/`, the finished `agent/`
for `agents.load_agent`, and `evaluation.json` with its success on held-out worlds.
"""

import dataclasses
import json
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import torch
import yaml
from stable_baselines3.common.base_class import BaseAlgorithm

from agents.agent_file import read_yaml, save_agent
from agents.algorithms import ALGORITHMS, export_agent
from agents.checkpoint import MODEL, checkpoints, load_checkpoint
from agents.recipe import ENV_ID, Recipe, load_recipe
from agents.run_log import CHECKPOINTS, RunLog, draw_curve
from agents.vec_env import MissionMix
from hydrone_gym.evaluation.provenance import versions
from hydrone_gym.evaluation.records import Record
from hydrone_gym.evaluation.run import evaluate_held_out
from hydrone_gym.evaluation.suites import HELD_OUT

CONFIG = "config.yaml"
TENSORBOARD = "tensorboard"
Flown = tuple[list[Record], list[dict[str, Any]]]  # of held-out worlds: records, and their scores
PACKAGES = ("hydrone-gym", "stable_baselines3", "sb3_contrib", "torch", "gymnasium", "numpy", "numba")


@dataclass(frozen=True, kw_only=True)
class TrainingRun:
    """What is trained, where, and from what.

    Raises ValueError for an option out of range, or TensorBoard asked for and not installed.
    """

    folder: Path  # run folder, made by `train`; must not hold a run already
    algorithm: str = "ppo"  # name of a recipe of the package
    seed: int = 0  # of everything random; one seed and one thread give the same weights again
    steps: int | None = None  # transitions, the recipe's number unless given
    recipe: Path | None = None  # path of a YAML file to use instead of the package's
    # keyword options of the environments, `num_obstacles` and so on, in training and evaluation; they go before those
    # of the recipe, which are for training alone
    options: dict[str, Any] = field(default_factory=dict)
    start_from: Path | None = None  # run folder whose latest weights to begin with, None for new ones
    threads: int = 1  # of torch; with one, results repeat bit for bit
    checkpoint_every: int = 500_000  # least number of steps between checkpoints
    evaluation_episodes: int = 1000  # held-out worlds a mission at the end, 0 for none
    progress: bool = True  # show a bar on stderr
    tensorboard: bool = False  # also write Stable-Baselines3's own log for TensorBoard

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not 0 <= self.seed < HELD_OUT // 2:
            raise ValueError(f"seed must lie between 0 and {HELD_OUT // 2 - 1}, got {self.seed}")
        for name, least in (("threads", 1), ("checkpoint_every", 1), ("evaluation_episodes", 0)):
            if getattr(self, name) < least:
                raise ValueError(f"{name} must be at least {least}, got {getattr(self, name)}")
        if self.steps is not None and self.steps < 1:
            raise ValueError(f"steps must be at least 1, got {self.steps}")
        if self.tensorboard and find_spec("tensorboard") is None:
            raise ValueError('tensorboard is not installed: pip install "hydrone-gym[tensorboard]"')


def train(run: TrainingRun) -> Flown:
    """Train from the beginning and return how the agent flew in held-out worlds.

    Raises:
        FileExistsError: the folder holds a run already; go on with it by `resume`.
        ValueError, TypeError: a recipe or option that is refused.
    """
    recipe = load_recipe(run.algorithm, run.recipe)
    if run.steps is not None:
        recipe = dataclasses.replace(recipe, steps=run.steps)
    if (run.folder / CONFIG).exists():
        raise FileExistsError(f"{run.folder} holds a run already: resume it, or name another folder")
    torch.set_num_threads(run.threads)
    rows = MissionMix(recipe.missions, {**recipe.environment, **run.options}, shield=recipe.shield)
    model = ALGORITHMS[run.algorithm].model(recipe.policy, rows, **recipe.arguments(), seed=run.seed, device="cpu")
    if run.start_from is not None:
        model.set_parameters(_latest(run.start_from) / MODEL, device="cpu")
    run.folder.mkdir(parents=True, exist_ok=True)
    told = {name: str(value) if isinstance(value, Path) else value for name, value in dataclasses.asdict(run).items()}
    content = {"run": told, "recipe": dataclasses.asdict(recipe)}
    (run.folder / CONFIG).write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    (run.folder / "versions.json").write_text(json.dumps(versions(PACKAGES), indent=1) + "\n", encoding="utf-8")
    return _learn(run, recipe, model, (0.0, 0.0))


def resume(folder: Path, *, progress: bool = True) -> Flown:
    """Go on with a run from its latest checkpoint, as if it had not stopped, and return what `train` does.

    Raises:
        FileNotFoundError: no run, or one without a checkpoint.
    """
    if not (folder / CONFIG).is_file():
        raise FileNotFoundError(f"no training run at {folder}: {folder / CONFIG} does not exist")
    content = read_yaml(folder / CONFIG)
    recipe = Recipe(**content["recipe"])
    paths = {name: content["run"][name] and Path(content["run"][name]) for name in ("recipe", "start_from")}
    run = TrainingRun(**{**content["run"], **paths, "folder": folder, "progress": progress})
    torch.set_num_threads(run.threads)
    model, extra = load_checkpoint(_latest(folder), ALGORITHMS[run.algorithm].model)
    return _learn(run, recipe, model, extra["spent"])


def _latest(folder: Path) -> Path:
    saved = checkpoints(folder / CHECKPOINTS)
    if not saved:
        raise FileNotFoundError(f"{folder} holds no checkpoint")
    return saved[-1]


def _learn(run: TrainingRun, recipe: Recipe, model: BaseAlgorithm, spent: tuple[float, float]) -> Flown:
    """Train to the end, then write the curve's figure, the agent and its evaluation."""
    log = RunLog(run.folder, recipe.steps, every=run.checkpoint_every, progress=run.progress, spent=spent)
    model.tensorboard_log = str(run.folder / TENSORBOARD) if run.tensorboard else None
    left = recipe.steps - model.num_timesteps
    if left > 0:
        interval = ALGORITHMS[run.algorithm].log_interval
        model.learn(left, callback=log, log_interval=interval, reset_num_timesteps=model.num_timesteps == 0)
    draw_curve(run.folder)
    folder, episodes = run.folder / "agent", run.evaluation_episodes
    notes = {"steps": model.num_timesteps, "seed": run.seed, "versions": versions(PACKAGES)}
    save_agent(export_agent(model, run.folder.name, ENV_ID, notes), folder)
    flown: Flown = ([], [])
    if episodes > 0:
        policy = f"{folder}+shield" if recipe.shield else str(folder)
        flown = evaluate_held_out(policy, worlds=episodes, options=run.options)
    (run.folder / "evaluation.json").write_text(json.dumps(flown[1], indent=1) + "\n", encoding="utf-8")
    return flown
