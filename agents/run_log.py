"""What a training run writes while it runs: lines of its curve, checkpoints, the progress bar."""

import csv
import time
from pathlib import Path

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from tqdm import tqdm

from agents.checkpoint import save_checkpoint
from hydrone_gym.rendering.style import BLACK, BLUE, GREEN, PURPLE, RED, WATER
from hydrone_gym.simulation.outcome import Outcome

FAILURES = ("COLLISION", "OUT_OF_BOUNDS", "ROUGH_TRANSITION", "TIMEOUT", "DIVERGED")
COLUMNS = ("steps", "wall_s", "cpu_s", "episodes", "success", "return", "periods", *(n.lower() for n in FAILURES))
_COLOURS = (GREEN, RED, PURPLE, BLUE, WATER, BLACK)  # of success and of each failure
CURVE = "curve.csv"
CHECKPOINTS = "checkpoints"
LINES = 500  # of a curve at most; a rollout that is longer than its share of the training has a line of its own


class RunLog(BaseCallback):
    """Writes `curve.csv` and checkpoints into a run folder, and shows a bar.

    `total` is the number of steps asked for; the bar counts to those that whole rollouts make of it. `every` is the
    least number of steps between checkpoints, `spent` the wall-clock and processor seconds used before this process
    took over.
    """

    def __init__(
        self, folder: Path, total: int, *, every: int, progress: bool, spent: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Keep the options."""
        super().__init__()
        self.folder = folder
        self._total, self._every, self._progress, self._spent = total, every, progress, spent
        self._bar = tqdm(disable=True)
        self.spent = spent  # the same at the latest checkpoint
        self._ended: list[tuple[int, float, int]] = []  # outcome, return, periods since the last line

    def _seconds(self) -> tuple[float, float]:
        wall, cpu = time.perf_counter() - self._began[0], time.process_time() - self._began[1]
        return self._spent[0] + wall, self._spent[1] + cpu

    def _on_training_start(self) -> None:
        self._began = (time.perf_counter(), time.process_time())
        self._saved_at, self._written_at = self.num_timesteps or -self._every, self.num_timesteps
        shown = {"unit": "step", "unit_scale": True, "disable": not self._progress}
        self._bar = tqdm(total=_whole_rollouts(self.model, self._total), initial=self.num_timesteps, **shown)
        lines: list[list[str]] = []
        if (self.folder / CURVE).exists():  # lines later than the checkpoint that the training goes on from are dropped
            with (self.folder / CURVE).open(newline="", encoding="utf-8") as stream:
                lines = [line for line in list(csv.reader(stream))[1:] if int(line[0]) <= self.num_timesteps]
        with (self.folder / CURVE).open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream).writerows([COLUMNS, *lines])

    def _on_rollout_start(self) -> None:
        """Between an update and a rollout: the one moment at which nothing is under way but the episodes.

        A line has just been written too, so no ended episodes are waiting for one.
        """
        if self.num_timesteps == self._written_at and self.num_timesteps - self._saved_at >= self._every:
            self.checkpoint()

    def checkpoint(self) -> None:
        """Save a checkpoint now."""
        self.spent = self._seconds()
        save_checkpoint(self.model, self.folder / CHECKPOINTS, {"spent": self.spent})
        self._saved_at = self.num_timesteps

    def _on_step(self) -> bool:
        infos = self.locals["infos"]
        for row in np.flatnonzero(self.locals["dones"]):
            episode = infos[row]["episode"]
            self._ended.append((infos[row]["outcome"], episode["r"], episode["l"]))
        return True

    def _on_rollout_end(self) -> None:
        self._bar.update(self.num_timesteps - self._bar.n)
        if self.num_timesteps - self._written_at >= self._total / LINES:
            self._write_line()

    def _write_line(self) -> None:
        """Write success rate, mean return, mean periods and share of each failure; empty cells when none ended."""
        cells = [self.num_timesteps, *(f"{seconds:.2f}" for seconds in self._seconds()), len(self._ended)]
        means = [""] * (3 + len(FAILURES))
        if self._ended:
            outcomes, returns, periods = map(np.array, zip(*self._ended))
            shares = [outcomes == Outcome[name] for name in ("GOAL", *FAILURES)]
            means = [f"{np.mean(values):.5f}" for values in (shares[0], returns, periods, *shares[1:])]
            self._bar.set_postfix_str(f"success {100.0 * float(means[0]):.1f} %")
        with (self.folder / CURVE).open("a", newline="", encoding="utf-8") as stream:
            csv.writer(stream).writerow([*cells, *means])
        self._ended, self._written_at = [], self.num_timesteps

    def _on_training_end(self) -> None:
        if self.num_timesteps > self._written_at:
            self._write_line()
        self.checkpoint()

    def close(self) -> None:
        """End the line of the bar, however the training ended."""
        self._bar.close()


def _whole_rollouts(model: BaseAlgorithm, steps: int) -> int:
    """Return how many steps a model takes when asked for some: rollouts are not cut short."""
    periods = model.n_steps if isinstance(model, OnPolicyAlgorithm) else model.train_freq.frequency
    rollout = model.n_envs * periods
    return -(-steps // rollout) * rollout


def draw_curve(folder: Path) -> Path:
    """Draw success and failures over steps from a run's `curve.csv` into `curve.png`; return its path."""
    import matplotlib.pyplot as plt

    with (folder / CURVE).open(newline="", encoding="utf-8") as stream:
        lines = [line for line in csv.DictReader(stream) if line["success"]]
    steps = [float(line["steps"]) / 1e6 for line in lines]
    figure, axes = plt.subplots(figsize=(7, 4), layout="constrained")
    for name, colour in zip(("success", *(failure.lower() for failure in FAILURES)), _COLOURS, strict=True):
        shares = [100.0 * float(line[name]) for line in lines]
        axes.plot(steps, shares, color=colour, linewidth=1.0, label=name.replace("_", " "))
    axes.set(xlabel="steps (million)", ylabel="episodes, while exploring (%)", ylim=(0, 100))
    axes.grid(alpha=0.3)
    axes.legend()
    path = folder / "curve.png"
    figure.savefig(path, dpi=120)
    plt.close(figure)
    return path
