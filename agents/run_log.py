"""What a training run writes while it runs: lines of its curve, checkpoints, the progress bar."""

import csv
import time
from pathlib import Path
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback
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
    """Writes `curve.csv` and checkpoints into a run folder.

    Args:
        folder: of the run.
        total: steps of the whole training, for the bar.
        every: least number of steps between checkpoints.
        progress: whether to show the bar.
        spent: wall-clock and processor seconds used before this process took over.
    """

    def __init__(
        self, folder: Path, total: int, *, every: int, progress: bool, spent: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Keep the options."""
        super().__init__()
        self.folder = folder
        self._total, self._every, self._progress, self._spent = total, every, progress, spent
        self._ended: list[tuple[int, float, int]] = []  # outcome, return, periods since the last line
        self._saved_at = -every
        self._written_at = 0

    def _seconds(self) -> tuple[float, float]:
        wall, cpu = time.perf_counter() - self._began[0], time.process_time() - self._began[1]
        return self._spent[0] + wall, self._spent[1] + cpu

    def _on_training_start(self) -> None:
        self._began = (time.perf_counter(), time.process_time())
        self._cut_curve()
        self._bar = tqdm(
            total=self._total, initial=self.num_timesteps, unit="step", unit_scale=True, disable=not self._progress
        )
        self._saved_at = self.num_timesteps if self.num_timesteps else -self._every
        self._written_at = self.num_timesteps

    def _cut_curve(self) -> None:
        """Write the head of the curve, or drop lines later than the checkpoint the training goes on from."""
        path = self.folder / CURVE
        lines: list[list[str]] = []
        if path.exists():
            with path.open(newline="", encoding="utf-8") as stream:
                lines = [line for line in list(csv.reader(stream))[1:] if int(line[0]) <= self.num_timesteps]
        with path.open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream).writerows([list(COLUMNS), *lines])

    def _on_rollout_start(self) -> None:
        """Between an update and a rollout: the one moment at which nothing is under way but the episodes.

        A line has just been written too, so no ended episodes are waiting for one.
        """
        if self.num_timesteps == self._written_at and self.num_timesteps - self._saved_at >= self._every:
            self.checkpoint()

    def checkpoint(self) -> None:
        """Save a checkpoint now."""
        save_checkpoint(self.model, self.folder / CHECKPOINTS, {"spent": self._seconds()})
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
        line = _summary(self._ended)
        wall, cpu = self._seconds()
        with (self.folder / CURVE).open("a", newline="", encoding="utf-8") as stream:
            cells = [self.num_timesteps, f"{wall:.2f}", f"{cpu:.2f}", len(self._ended), *line]
            csv.writer(stream).writerow(cells)
        if self._ended:
            self._bar.set_postfix_str(f"success {100.0 * float(line[0]):.1f} %")
        self._ended, self._written_at = [], self.num_timesteps

    def _on_training_end(self) -> None:
        if self.num_timesteps > self._written_at:
            self._write_line()
        self.checkpoint()
        self._bar.close()


def _summary(ended: list[tuple[int, float, int]]) -> list[Any]:
    """Success rate, mean return, mean periods and the share of each failure; empty cells when none ended."""
    if not ended:
        return [""] * (3 + len(FAILURES))
    outcomes = np.array([outcome for outcome, _, _ in ended])
    shares = [np.mean(outcomes == Outcome[name]) for name in FAILURES]
    means = [np.mean([entry[k] for entry in ended]) for k in (1, 2)]
    return [f"{value:.5f}" for value in (np.mean(outcomes == Outcome.GOAL), *means, *shares)]


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
    axes.set_xlabel("steps (million)")
    axes.set_ylabel("episodes, while exploring (%)")
    axes.set_ylim(0, 100)
    axes.grid(alpha=0.3)
    axes.legend()
    path = folder / "curve.png"
    figure.savefig(path, dpi=120)
    plt.close(figure)
    return path
