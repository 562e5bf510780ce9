"""Training: a recipe, a seed and a folder in; an agent, its curve and what it was made with out.

A run folder holds `config.yaml` and `versions.json`, `curve.csv` and `curve.png`, `checkpoints/`, the finished `agent/`
for `agents.load_agent`, and `evaluation.json` with its success on held-out worlds.
"""

import contextlib
import dataclasses
import json
import shutil
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import torch
from stable_baselines3.common.base_class import BaseAlgorithm

from agents.agent_file import save_agent
from agents.algorithms import ALGORITHMS, export_agent
from agents.checkpoint import MODEL, checkpoints, latest_checkpoint, load_checkpoint
from agents.plain_data import read_yaml, to_yaml
from agents.recipe import ENV_ID, Recipe, load_recipe
from agents.run_log import CHECKPOINTS, CURVE, RunLog, draw_curve
from agents.vec_env import MissionMix
from hydrone_gym._folder_lock import held
from hydrone_gym.evaluation.provenance import commit, versions
from hydrone_gym.evaluation.records import Record
from hydrone_gym.evaluation.run import evaluate_held_out
from hydrone_gym.evaluation.run_folder import write_whole
from hydrone_gym.evaluation.suites import HELD_OUT

CONFIG, VERSIONS = "config.yaml", "versions.json"
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

    Everything is checked and built before the folder is made; a run that ends before its first checkpoint leaves none.

    Raises:
        FileExistsError: the folder holds a run already; go on with it by `resume`.
        BlockingIOError: another process is writing into the folder.
        ValueError, TypeError: a recipe or option that is refused.
    """
    if (run.folder / CONFIG).exists():
        raise FileExistsError(f"{run.folder} holds a run already: resume it, or name another folder")
    if run.folder.exists() and not run.folder.is_dir():
        raise NotADirectoryError(f"{run.folder} is a file: name a folder")
    recipe = load_recipe(run.algorithm, run.recipe)
    if run.steps is not None:
        recipe = dataclasses.replace(recipe, steps=run.steps)
    torch.set_num_threads(run.threads)
    model = _built(run, recipe)
    new = not run.folder.exists()
    try:
        with held(run.folder):
            if (run.folder / CONFIG).exists():  # by a run that has ended since
                raise FileExistsError(f"{run.folder} holds a run already: resume it, or name another folder")
            return _begun(run, recipe, model)
    finally:
        if new:
            with contextlib.suppress(OSError):  # it holds a run
                run.folder.rmdir()


def _built(run: TrainingRun, recipe: Recipe) -> BaseAlgorithm:
    """Make environments and model; ValueError for what they refuse, and for a model that makes no agent."""
    rows = MissionMix(recipe.missions, {**recipe.environment, **run.options}, shield=recipe.shield)
    try:
        kind = ALGORITHMS[run.algorithm].model
        model = kind(recipe.policy, rows, **recipe.arguments(), seed=run.seed, device="cpu")
        export_agent(model, run.algorithm, ENV_ID)
    except Exception as error:  # of Stable-Baselines3 and torch, which assert some of their rules
        reason = f"{type(error).__name__}: {error}"
        raise ValueError(f"{run.recipe or run.algorithm}: no model can be made of this recipe: {reason}") from error
    if run.start_from is not None:
        weights = latest_checkpoint(run.start_from / CHECKPOINTS) / MODEL
        try:
            model.set_parameters(weights, device="cpu")
        except Exception as error:
            raise ValueError(f"{weights} does not fit this recipe: {error}") from error
    return model


def _begun(run: TrainingRun, recipe: Recipe, model: BaseAlgorithm) -> Flown:
    """Write what is trained and with what, and train; without a checkpoint nothing of it stays."""
    told = {name: str(value) if isinstance(value, Path) else value for name, value in dataclasses.asdict(run).items()}
    write_whole(run.folder / CONFIG, to_yaml({"run": told, "recipe": dataclasses.asdict(recipe)}))
    write_whole(run.folder / VERSIONS, json.dumps(_made_with(), indent=1) + "\n")
    try:
        return _learn(run, recipe, model, (0.0, 0.0))
    finally:
        if not checkpoints(run.folder / CHECKPOINTS):
            for name in (CONFIG, VERSIONS, CURVE):
                (run.folder / name).unlink(missing_ok=True)
            for name in (CHECKPOINTS, TENSORBOARD):
                shutil.rmtree(run.folder / name, ignore_errors=True)


def resume(folder: Path, *, progress: bool = True) -> Flown:
    """Go on with a run from its latest checkpoint, as if it had not stopped, and return what `train` does.

    Raises:
        FileNotFoundError: no run, or one without a checkpoint that is whole.
        BlockingIOError: another process is writing into the folder.
        ValueError: a damaged configuration, or a checkpoint of other versions that cannot be read.
    """
    if not (folder / CONFIG).is_file():
        raise FileNotFoundError(f"no training run at {folder}: {folder / CONFIG} does not exist")
    content = read_yaml(folder / CONFIG)
    try:
        recipe = Recipe(**content["recipe"])
        paths = {name: content["run"][name] and Path(content["run"][name]) for name in ("recipe", "start_from")}
        run = TrainingRun(**{**content["run"], **paths, "folder": folder, "progress": progress})
        kind = ALGORITHMS[run.algorithm].model
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        reason = f"{type(error).__name__}: {error}"
        raise ValueError(f"{folder / CONFIG}: not the configuration of a run: {reason}") from None
    with held(folder):
        torch.set_num_threads(run.threads)
        path = latest_checkpoint(folder / CHECKPOINTS)
        try:
            model, extra = load_checkpoint(path, kind)
        except Exception as error:  # written by other versions
            raise ValueError(f"{path} cannot be read: {type(error).__name__}: {error}") from error
        return _learn(run, recipe, model, extra["spent"])


def _made_with() -> dict[str, str | None]:
    """Return the versions of what trains, and the commit of this project."""
    return {**versions(PACKAGES), "commit": commit()}


def _learn(run: TrainingRun, recipe: Recipe, model: BaseAlgorithm, spent: tuple[float, float]) -> Flown:
    """Train to the end, then write the curve's figure, the agent and its evaluation."""
    log = RunLog(run.folder, recipe.steps, every=run.checkpoint_every, progress=run.progress, spent=spent)
    model.tensorboard_log = str(run.folder / TENSORBOARD) if run.tensorboard else None
    left = recipe.steps - model.num_timesteps
    if left > 0:
        interval = ALGORITHMS[run.algorithm].log_interval
        with contextlib.closing(log):
            model.learn(left, callback=log, log_interval=interval, reset_num_timesteps=model.num_timesteps == 0)
    draw_curve(run.folder)
    folder, episodes = run.folder / "agent", run.evaluation_episodes
    seconds = {name: round(value, 2) for name, value in zip(("wall", "cpu"), log.spent, strict=True)}
    notes = {"steps": model.num_timesteps, "seed": run.seed, "seconds": seconds, "versions": _made_with()}
    save_agent(export_agent(model, run.folder.name, ENV_ID, notes), folder)
    flown: Flown = ([], [])
    if episodes > 0:
        policy = f"{folder}+shield" if recipe.shield else str(folder)
        flown = evaluate_held_out(policy, worlds=episodes, options={**recipe.evaluation, **run.options})
    write_whole(run.folder / "evaluation.json", json.dumps(flown[1], indent=1) + "\n")
    return flown
